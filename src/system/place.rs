//! Steps and slots resolved to handles: the same meaning as in [`step`](super::step), without a name being looked up.
//!
//! A handle is as good as the component behind it: whoever keeps one looks whether that is still the same
//! ([`Node::born`](super::ComponentNode::born)).

use super::step::{move_allowed, sample_allowed, value_allowed};
use super::{Slot, System, View, Violation, exclusive};
use crate::model::{Step, Transition, Value};
use petgraph::stable_graph::NodeIndex;

/// Where a slot is: its component's handle, and the place of the property or port in the type's order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SlotHandle {
    /// The component.
    pub node: NodeIndex,
    /// The property or port of it; of a run state nothing.
    at: usize,
}

impl SlotHandle {
    /// The place of a run state, a property or a port. None: it is not there, or a slot of another kind.
    pub fn of(slot: Slot, system: &System) -> Option<Self> {
        let node = system.index_of(slot.components().0)?;
        let it = system.node_at(node)?;
        let at = match slot {
            Slot::State(_) => 0,
            Slot::Property(property) => it.property(property.member)?.0,
            Slot::Port(port) => it.port(port.member)?.0,
            _ => return None,
        };
        Some(Self { node, at })
    }

    /// What the property or port there holds; none: never written.
    pub fn held(self, slot: Slot, system: &System) -> Option<&Value> {
        let node = system.node_at(self.node)?;
        match slot {
            Slot::Property(_) => node.properties.get(self.at),
            _ => node.written(self.at),
        }
    }

    /// Every false precondition of a state step, a property_set or a port_write there, as
    /// [`precondition`](super::step::precondition) finds them.
    pub fn precondition(self, step: &Step, system: &System) -> Vec<Violation> {
        let mut found = Vec::new();
        let Some(node) = system.node_at(self.node) else { return vec![Violation::UnknownComponent(step.component())] };
        match step {
            Step::State { transition, .. } => {
                move_allowed(node, *transition, &mut found);
                found.extend((*transition == Transition::Configure).then(|| exclusive::taken(node, system)).flatten());
            }
            Step::PropertySet { property, value } => {
                let declared = node.ty.properties.values().nth(self.at).expect("a place is of the type");
                value_allowed(node, *property, declared, value, &mut found);
            }
            Step::PortWrite { port, value } => {
                let declared = node.ty.ports.values().nth(self.at).expect("a place is of the type");
                sample_allowed(*port, declared, value.as_ref(), system, &mut found);
            }
            other => return super::step::precondition(other, system),
        }
        found
    }

    /// Whether a step may happen there whose value is known to be allowed there (types do not change): what is left of
    /// [`Self::precondition`] is what the system can change.
    pub fn allows(self, step: &Step, system: &System) -> bool {
        let Some(node) = system.node_at(self.node) else { return false };
        match step {
            Step::State { transition, .. } => {
                transition.allowed_in(node.state)
                    && (*transition != Transition::Configure || exclusive::taken(node, system).is_none())
            }
            Step::PropertySet { .. } => {
                node.ty.properties.values().nth(self.at).is_some_and(|p| p.tunable.allows(node.state))
            }
            Step::PortWrite { port, .. } => system.driven(*port).links == 0,
            other => super::step::precondition(other, system).is_empty(),
        }
    }

    /// Does to the picture what [`effect`](super::step::effect) does. Its precondition holds.
    pub fn effect(self, step: &Step, system: &mut System) {
        let Some(node) = system.touch_at(self.node) else { return };
        match step {
            Step::State { transition, .. } => node.state = transition.target(),
            Step::PropertySet { value, .. } => node.properties[self.at].clone_from(value),
            Step::PortWrite { value, .. } => node.put_port(self.at, value.as_ref()),
            other => super::step::effect(other, system),
        }
    }
}
