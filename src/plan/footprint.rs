//! What a plan touches, slot by slot, so that frames can tell what they share (design §4).

use crate::model::{ComponentName, MemberRef, Value};
use rustc_hash::{FxHashMap, FxHashSet};
use std::fmt;

/// A thing of a system that can be read and written by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Slot {
    /// The existence of a component; a write to it touches everything of the component.
    Component(ComponentName),
    /// Its run state.
    State(ComponentName),
    /// A property.
    Property(MemberRef),
    /// What was written to a port.
    Port(MemberRef),
    /// What drives an in-port.
    Drive(MemberRef),
    /// A connection.
    Link(MemberRef, MemberRef),
    /// What an operation does.
    Operation(MemberRef),
}

impl Slot {
    /// The components it belongs to (a connection belongs to two).
    pub fn components(self) -> (ComponentName, ComponentName) {
        match self {
            Self::Component(c) | Self::State(c) => (c, c),
            Self::Property(m) | Self::Port(m) | Self::Drive(m) | Self::Operation(m) => (m.component, m.component),
            Self::Link(from, to) => (from.component, to.component),
        }
    }

    /// Whether writes to it are absolute: they say what it holds afterwards whatever it held before.
    pub fn is_absolute(self) -> bool {
        matches!(self, Self::Property(_) | Self::Port(_))
    }
}

impl fmt::Display for Slot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Component(c) => write!(f, "the component `{c}`"),
            Self::State(c) => write!(f, "the run state of `{c}`"),
            Self::Property(m) => write!(f, "the property `{m}`"),
            Self::Port(m) => write!(f, "the written value of `{m}`"),
            Self::Drive(m) => write!(f, "what drives `{m}`"),
            Self::Link(from, to) => write!(f, "the connection {from} -> {to}"),
            Self::Operation(m) => write!(f, "the operation `{m}`"),
        }
    }
}

/// How a slot is touched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Access {
    /// It must stay as it is.
    Need,
    /// One source among many is added or removed: two of these do not disturb each other.
    Join,
    /// It is changed.
    Write,
}

impl Access {
    fn shares(self, other: Self) -> bool {
        match (self, other) {
            (Self::Need, Self::Need) | (Self::Join, Self::Join) => false,
            (a, b) => a != Self::Need || b != Self::Need,
        }
    }
}

/// One touched slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Touch {
    /// The slot.
    pub slot: Slot,
    /// How.
    pub access: Access,
    /// The absolute write this is needed for; when that write's value is handed over, it is not needed.
    pub serves: Option<Slot>,
}

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
        self.touches.push(Touch { slot, access, serves: None });
    }

    /// Adds something that the inverse of an absolute write needs.
    pub fn serve(&mut self, slot: Slot, access: Access, write: Slot) {
        self.touches.push(Touch { slot, access, serves: Some(write) });
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
}

impl Index {
    /// The touches of `footprint` that `keep` keeps.
    pub fn new(footprint: &Footprint, keep: impl Fn(&Touch) -> bool) -> Self {
        let mut index = Self::default();
        for touch in footprint.touches.iter().filter(|t| keep(t)) {
            // A need and a join of one slot disturb whatever a write would.
            let strongest = |now: Access| if now == touch.access { now } else { Access::Write };
            index.slots.entry(touch.slot).and_modify(|now| *now = strongest(*now)).or_insert(touch.access);
            let (a, b) = touch.slot.components();
            index.components.insert(a);
            index.components.insert(b);
            if let Slot::Component(c) = touch.slot
                && touch.access != Access::Need
            {
                index.existence.insert(c);
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
        // Absolute writes never block each other: the saved value is handed over.
        !touch.slot.is_absolute() && self.slots.get(&touch.slot).is_some_and(|access| access.shares(touch.access))
    }
}
