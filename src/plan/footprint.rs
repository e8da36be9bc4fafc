//! What a plan touches, slot by slot, so that frames can tell what they share (semantics: *Steps and plans*).
//!
//! What one step touches is said in [`crate::system::touch`].

use crate::model::{ComponentName, Value};
use crate::system::touch::HeldName;
pub use crate::system::{Access, Slot, Touch};
use rustc_hash::{FxHashMap, FxHashSet};

/// What an absolute write overwrote.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Saved {
    /// A property's value.
    Property(Value),
    /// A port's written value; none: never written.
    Port(Option<Value>),
}

/// All touched slots. One slot may stand more than once.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Footprint {
    /// In the order they were touched.
    pub touches: Vec<Touch>,
}

impl Footprint {
    /// Adds a touch.
    pub fn touch(&mut self, slot: Slot, access: Access) {
        self.touches.push(Touch::new(slot, access));
    }

    /// Whether it writes `slot`.
    pub fn writes(&self, slot: Slot) -> bool {
        self.touches.iter().any(|t| t.slot == slot && t.access != Access::Need)
    }
}

/// A footprint prepared for many comparisons.
#[derive(Debug, Default)]
pub struct Index {
    slots: FxHashMap<Slot, Access>,
    existence: FxHashSet<ComponentName>,
    components: FxHashSet<ComponentName>,
    /// What components have for themselves, whichever they are.
    held: FxHashSet<HeldName>,
}

impl Index {
    /// The touches of `footprint` that `keep` keeps.
    pub fn new(footprint: &Footprint, keep: impl Fn(&Touch) -> bool) -> Self {
        let mut index = Self::default();
        // Most slots are touched once.
        index.slots.reserve(footprint.touches.len());
        for touch in footprint.touches.iter().filter(|t| keep(t)) {
            // A need and a join of one slot disturb whatever a write would.
            let strongest = |now: Access| if now == touch.access { now } else { Access::Write };
            index.slots.entry(touch.slot).and_modify(|now| *now = strongest(*now)).or_insert(touch.access);
            let (a, b) = touch.slot.components();
            index.components.insert(a);
            index.components.insert(b);
            match touch.slot {
                Slot::Component(c) if touch.access != Access::Need => _ = index.existence.insert(c),
                Slot::Held(_, name) => _ = index.held.insert(name),
                _ => {}
            }
        }
        index
    }

    /// Whether `touch` of another footprint shares its slot, or its component's existence, with this one.
    pub fn shares(&self, touch: &Touch) -> bool {
        let (a, b) = touch.slot.components();
        if self.existence.contains(&a) || self.existence.contains(&b) {
            return true;
        }
        if let Slot::Component(c) = touch.slot
            && touch.access != Access::Need
            && self.components.contains(&c)
        {
            return true;
        }
        if let Slot::Held(_, name) = touch.slot {
            return self.held.contains(&name);
        }
        // Absolute writes never block each other: the saved value is handed over.
        !touch.slot.is_absolute() && self.slots.get(&touch.slot).is_some_and(|access| access.shares(touch.access))
    }
}
