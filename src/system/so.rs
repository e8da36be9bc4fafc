//! Whether what a step leads to is so already.

use super::{View, step};
use crate::model::Step;

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
