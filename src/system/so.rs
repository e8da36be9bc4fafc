//! Whether what a step leads to is so already: in a picture of a system, and in what a platform shows of it.

use super::{View, step};
use crate::model::{Snapshot, Step};

/// Whether what `step` leads to is so in `view`, whoever did it. Of a call nothing tells.
pub fn is_so(step: &Step, view: &impl View) -> bool {
    match step {
        Step::State { component, transition } => {
            view.component(*component).is_some_and(|node| node.state == transition.target())
        }
        Step::Create { component, ty, .. } => view.component(*component).is_some_and(|node| node.ty.name == *ty),
        Step::Destroy { component } => view.component(*component).is_none(),
        Step::Connect { from, to, policy } => view.link(*from, *to) == Some(*policy),
        Step::Disconnect { from, to } => view.link(*from, *to).is_none(),
        Step::PropertySet { property, value } => {
            view.component(property.component).and_then(|node| node.value(property.member)) == Some(value)
        }
        Step::PortWrite { port, value } => step::written(*port, view) == Some(value.as_ref()),
        Step::Operation(_) => false,
    }
}

/// The same of what a platform shows; none: that does not tell, since it says nothing of the component, or of a call.
pub fn is_seen_so(step: &Step, seen: &Snapshot) -> Option<bool> {
    let one = seen.components.get(&step.component());
    match step {
        Step::State { transition, .. } => one.map(|one| one.state == transition.target()),
        Step::Create { ty, .. } => Some(one.is_some_and(|one| one.ty == *ty)),
        Step::Destroy { .. } => Some(one.is_none()),
        Step::Connect { from, to, policy } => Some(seen.connections.get(&(*from, *to)) == Some(policy)),
        Step::Disconnect { from, to } => Some(!seen.connections.contains_key(&(*from, *to))),
        Step::PropertySet { property, value } => Some(one?.properties.get(&property.member)? == value),
        Step::PortWrite { port, value } => Some(seen.ports.get(port) == value.as_ref()),
        Step::Operation(_) => None,
    }
}
