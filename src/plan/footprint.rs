//! What a plan touches, slot by slot, so that frames can tell what they share (semantics: *Steps and plans*).
//!
//! What one step touches is said in [`crate::system::touch`].

use crate::model::{ComponentName, Value};
use crate::system::touch::HeldName;
pub use crate::system::{Access, Slot, Touch};
use rustc_hash::{FxHashMap, FxHashSet};
use std::cell::{Cell, OnceCell};

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

/// So many touches are compared one by one, before it is worth while to put the others into tables.
const ONE_BY_ONE: u32 = 16;

/// A footprint prepared for comparisons: most are compared with few touches, some with thousands.
#[derive(Debug)]
pub struct Index {
    touches: Vec<Touch>,
    compared: Cell<u32>,
    tables: OnceCell<TouchTables>,
}

impl Index {
    /// The touches of `footprint` that `keep` keeps.
    pub fn new(footprint: &Footprint, keep: impl Fn(&Touch) -> bool) -> Self {
        let mut touches = Vec::with_capacity(footprint.touches.len());
        touches.extend(footprint.touches.iter().copied().filter(|touch| keep(touch)));
        Self { touches, compared: Cell::new(0), tables: OnceCell::new() }
    }

    /// Whether `touch` of another footprint shares its slot, or its component's existence, with this one.
    pub fn shares(&self, touch: &Touch) -> bool {
        let compared = self.compared.get();
        if compared < ONE_BY_ONE {
            self.compared.set(compared + 1);
            return self.touches.iter().any(|own| disturb(own, touch));
        }
        self.tables.get_or_init(|| TouchTables::new(&self.touches)).shares(touch)
    }
}

/// Whether two touches are of one slot and disturb each other, or one is about the existence of what the other touches.
fn disturb(own: &Touch, other: &Touch) -> bool {
    let ends = |one: &Touch, of: &Touch| match one.slot {
        Slot::Component(c) if one.access != Access::Need => {
            let (a, b) = of.slot.components();
            c == a || c == b
        }
        _ => false,
    };
    if ends(own, other) || ends(other, own) {
        return true;
    }
    match (own.slot, other.slot) {
        (Slot::Held(_, a), Slot::Held(_, b)) => a == b,
        // Absolute writes never block each other: the saved value is handed over.
        (a, b) => a == b && !b.is_absolute() && own.access.shares(other.access),
    }
}

/// All touches of a footprint, to be compared with very many.
#[derive(Debug, Default)]
struct TouchTables {
    slots: FxHashMap<Slot, Access>,
    existence: FxHashSet<ComponentName>,
    components: FxHashSet<ComponentName>,
    /// What components have for themselves, whichever they are.
    held: FxHashSet<HeldName>,
}

impl TouchTables {
    fn new(touches: &[Touch]) -> Self {
        let mut tables = Self::default();
        // Most slots are touched once.
        tables.slots.reserve(touches.len());
        for touch in touches {
            // A need and a join of one slot disturb whatever a write would.
            let strongest = |now: Access| if now == touch.access { now } else { Access::Write };
            tables.slots.entry(touch.slot).and_modify(|now| *now = strongest(*now)).or_insert(touch.access);
            let (a, b) = touch.slot.components();
            tables.components.insert(a);
            tables.components.insert(b);
            match touch.slot {
                Slot::Component(c) if touch.access != Access::Need => _ = tables.existence.insert(c),
                Slot::Held(_, name) => _ = tables.held.insert(name),
                _ => {}
            }
        }
        tables
    }

    fn shares(&self, touch: &Touch) -> bool {
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
        // See [`disturb`].
        !touch.slot.is_absolute() && self.slots.get(&touch.slot).is_some_and(|access| access.shares(touch.access))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::MemberRef;

    /// Touches compared one by one share what they share by tables.
    #[test]
    fn tables_tell_what_comparing_one_by_one_tells() {
        let names = ["a", "b"].map(|name| ComponentName::new(name).unwrap());
        let members: Vec<MemberRef> = ["a.x", "a.y", "b.x"].iter().map(|name| MemberRef::new(name).unwrap()).collect();
        let mut slots: Vec<Slot> = names.iter().flat_map(|name| [Slot::Component(*name), Slot::State(*name)]).collect();
        for name in names {
            slots.extend(["p", "q"].map(|thing| Slot::Held(name, HeldName::of(thing))));
        }
        for member in &members {
            slots.extend([Slot::Property(*member), Slot::Drive(*member), Slot::Operation(*member)]);
            slots.extend(members.iter().map(|other| Slot::Link(*member, *other)));
        }
        let accesses = [Access::Need, Access::Join, Access::Write];
        let all: Vec<Touch> = slots.iter().flat_map(|slot| accesses.map(|access| Touch::new(*slot, access))).collect();
        for (at, first) in all.iter().enumerate() {
            for second in all.iter().skip(at).step_by(7) {
                let own = [*first, *second];
                let tables = TouchTables::new(&own);
                for touch in &all {
                    let one_by_one = own.iter().any(|own| disturb(own, touch));
                    assert_eq!(tables.shares(touch), one_by_one, "{own:?} and {touch:?}");
                }
            }
        }
    }
}
