//! What a step touches, slot by slot, and what its inverse will need: the fourth part of a step's meaning, beside [`step`].
//!
//! [`step`]: super::step

use super::{View, exclusive};
use crate::model::{Call, ComponentName, Effect, MemberRef, Policy, Step, Transition, Tunable};
use rustc_hash::FxBuildHasher;
use smallvec::{SmallVec, smallvec};
use std::fmt;
use std::hash::BuildHasher;

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
    /// A thing that a component has for itself, known by its name. Whoever holds one of the same name touches the same.
    Held(ComponentName, HeldName),
}

/// What stands for the name of a thing that components have for themselves. Two names that have the same by chance count as one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct HeldName(u64);

impl HeldName {
    pub(crate) fn of(name: &str) -> Self {
        Self(FxBuildHasher.hash_one(name))
    }
}

impl Slot {
    /// The components it belongs to (a connection belongs to two).
    pub fn components(self) -> (ComponentName, ComponentName) {
        match self {
            Self::Component(c) | Self::State(c) | Self::Held(c, _) => (c, c),
            Self::Property(m) | Self::Port(m) | Self::Drive(m) | Self::Operation(m) => (m.component, m.component),
            Self::Link(from, to) => (from.component, to.component),
        }
    }

    /// Whether a write of one is a write of the other: the existence of a component is all of it.
    pub fn overlaps(self, other: Self) -> bool {
        let about = |whole: Self, of: Self| match whole {
            Self::Component(name) => of.components().0 == name || of.components().1 == name,
            _ => false,
        };
        self == other || about(self, other) || about(other, self)
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
            Self::Held(c, _) => write!(f, "what `{c}` has for itself"),
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
    /// Whether two touches of one slot disturb each other.
    pub fn shares(self, other: Self) -> bool {
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

impl Touch {
    /// A touch for its own sake.
    pub fn new(slot: Slot, access: Access) -> Self {
        Self { slot, access, serves: None }
    }
}

/// What a step touches; seldom more than two slots.
pub type Touches = SmallVec<[Touch; 2]>;

/// What a step is about, where each thing is one: what it writes, makes, takes away, links or calls.
pub fn slot(step: &Step) -> Slot {
    match step {
        Step::State { component, .. } => Slot::State(*component),
        Step::Create { component, .. } | Step::Destroy { component } => Slot::Component(*component),
        Step::Connect { from, to, .. } | Step::Disconnect { from, to } => Slot::Link(*from, *to),
        Step::PropertySet { property, .. } => Slot::Property(*property),
        Step::PortWrite { port, .. } => Slot::Port(*port),
        Step::Operation(call) => Slot::Operation(call.operation),
    }
}

/// What `step` touches in the system `before` it, and what its inverse will need. `undo` is the call that a configuration
/// names for an operation's call, as for [`inverse`](super::step::inverse).
///
/// What `before` does not know (a component that an earlier step of a list makes) counts as the most that it can be: a
/// property as bound to run states, an in-port as the data port of its only connection.
pub fn touches(step: &Step, undo: Option<&Call>, before: &impl View) -> Touches {
    let mut touches = Touches::new();
    touch_each(step, undo, before, &mut |touch| touches.push(touch));
    touches
}

/// The same, one after the other: a touch is large, and a plan has many.
#[inline]
pub fn touch_each(step: &Step, undo: Option<&Call>, before: &impl View, each: &mut impl FnMut(Touch)) {
    match step {
        Step::State { component, transition } => {
            each(Touch::new(Slot::State(*component), Access::Write));
            // Where one of these two is done or undone it is configured, and nobody else holds what it needs.
            if matches!(transition, Transition::Configure | Transition::Cleanup)
                && let Some(node) = before.component(*component)
            {
                let held = exclusive::names(node).map(|name| Slot::Held(*component, HeldName::of(&name)));
                held.for_each(|slot| each(Touch::new(slot, Access::Write)));
            }
        }
        Step::Create { component, .. } | Step::Destroy { component } => {
            each(Touch::new(Slot::Component(*component), Access::Write));
        }
        Step::Connect { from, to, policy } => link(*from, *to, *policy, before, each),
        Step::Disconnect { from, to } => {
            link(*from, *to, before.link(*from, *to).unwrap_or_default(), before, each);
        }
        Step::PropertySet { property, .. } => {
            let declared = before.component(property.component).and_then(|n| n.property(property.member));
            let bound = declared.is_none_or(|(_, p)| p.tunable != Tunable::Always);
            absolute_write(Slot::Property(*property), bound.then_some(Slot::State(property.component)), each);
        }
        Step::PortWrite { port, .. } => absolute_write(Slot::Port(*port), Some(Slot::Drive(*port)), each),
        Step::Operation(call) => {
            let of = call.operation;
            let declared = || before.component(of.component).and_then(|n| n.ty.operations.get(&of.member));
            let inverse = match (undo, declared().map(|o| &o.effect)) {
                (Some(undo), _) => Some(undo.operation),
                (None, Some(Effect::Undo(name))) => Some(of.component.member(*name)),
                (None, _) => None,
            };
            let called = std::iter::once(of).chain(inverse.filter(|inverse| *inverse != of));
            called.for_each(|operation| each(Touch::new(Slot::Operation(operation), Access::Write)));
            // What has moved is moved back by a component that is as it was: nothing takes its power away under it.
            if let Some(inverse) = inverse.filter(|_| declared().is_some_and(|operation| operation.moves)) {
                let (slot, serves) = (Slot::State(of.component), Some(Slot::Operation(inverse)));
                each(Touch { slot, access: Access::Need, serves });
            }
        }
    }
}

fn link(from: MemberRef, to: MemberRef, policy: Policy, before: &impl View, each: &mut impl FnMut(Touch)) {
    let event = || before.component(to.component).and_then(|n| n.port(to.member)).is_some_and(|(_, p)| p.is_event());
    let access = if policy == Policy::Data && !event() { Access::Write } else { Access::Join };
    each(Touch::new(Slot::Link(from, to), Access::Write));
    each(Touch::new(Slot::Drive(to), access));
}

/// A write whose inverse needs that `needs` is as it was.
fn absolute_write(slot: Slot, needs: Option<Slot>, each: &mut impl FnMut(Touch)) {
    each(Touch::new(slot, Access::Write));
    if let Some(needed) = needs {
        each(Touch { slot: needed, access: Access::Need, serves: Some(slot) });
    }
}

/// The slot of an absolute write.
pub fn absolute(step: &Step) -> Option<Slot> {
    Some(slot(step)).filter(|slot| slot.is_absolute())
}

/// The components that `step` is done to, each once: of a connection both ends.
pub fn components(step: &Step) -> SmallVec<[ComponentName; 2]> {
    match step {
        Step::Connect { from, to, .. } | Step::Disconnect { from, to } if from.component != to.component => {
            smallvec![from.component, to.component]
        }
        other => smallvec![other.component()],
    }
}
