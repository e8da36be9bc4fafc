//! What a safe configuration touched, so that the rollback of the work it interrupted leaves that alone.

use crate::model::{ComponentName, Ident, MemberRef, Step};
use rustc_hash::FxHashSet;

/// The smallest thing a step changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Slot {
    /// A component's run state, or its being there at all.
    Component(ComponentName),
    Member(ComponentName, Ident),
    Link(MemberRef, MemberRef),
}

fn slot(step: &Step) -> Slot {
    match step {
        Step::State { component, .. } | Step::Create { component, .. } | Step::Destroy { component } => {
            Slot::Component(*component)
        }
        Step::Connect { from, to, .. } | Step::Disconnect { from, to } => Slot::Link(*from, *to),
        Step::PropertySet { property: member, .. } | Step::PortWrite { port: member, .. } => {
            Slot::Member(member.component, member.member)
        }
        Step::Operation(call) => Slot::Member(call.operation.component, call.operation.member),
    }
}

/// A set of touched things.
#[derive(Debug, Default)]
pub(super) struct Touched {
    slots: FxHashSet<Slot>,
    /// Components of which anything was touched.
    components: FxHashSet<ComponentName>,
}

impl Touched {
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty()
    }

    /// `step` was done, or what it leads to was demanded.
    pub fn add(&mut self, step: &Step) {
        self.slots.insert(slot(step));
        match step {
            Step::Connect { from, to, .. } | Step::Disconnect { from, to } => {
                self.components.extend([from.component, to.component]);
            }
            other => drop(self.components.insert(other.component())),
        }
    }

    /// The run state of `component` was demanded.
    pub fn add_state(&mut self, component: ComponentName) {
        self.slots.insert(Slot::Component(component));
        self.components.insert(component);
    }

    /// Whether `step` would change something touched.
    pub fn has(&self, step: &Step) -> bool {
        match step {
            Step::Create { component, .. } | Step::Destroy { component } => self.components.contains(component),
            other => self.slots.contains(&slot(other)),
        }
    }
}
