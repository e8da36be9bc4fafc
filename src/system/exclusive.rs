//! What components hold for themselves: from *configured* on, until they are *unconfigured* again, one component at a time.

use super::{ComponentNode, View, Violation};
use crate::model::{ComponentName, RunState};

/// The names of what a component needs for itself, as its properties are now.
pub fn names(node: &ComponentNode) -> impl Iterator<Item = String> + '_ {
    node.ty.exclusive.iter().filter_map(|resource| resource.named(|property| node.value(property)))
}

/// Components that need something of what `node` needs, whether they hold it now or not, with its name.
pub fn rivals(node: &ComponentNode, view: &impl View) -> Vec<(ComponentName, RunState, String)> {
    if node.ty.exclusive.is_empty() {
        return Vec::new();
    }
    let own: Vec<String> = names(node).collect();
    let mut found = Vec::new();
    view.for_each_component(&mut |other| {
        if other.name != node.name
            && let Some(name) = names(other).find(|name| own.contains(name))
        {
            found.push((other.name, other.state, name));
        }
    });
    found.sort_unstable_by_key(|(name, ..)| *name);
    found
}

/// Why a component cannot be configured: another one holds what it needs. A faulted one holds it still.
pub fn taken(node: &ComponentNode, view: &impl View) -> Option<Violation> {
    let mut held = rivals(node, view).into_iter().filter(|(_, state, _)| *state != RunState::Unconfigured);
    held.next().map(|(by, _, resource)| Violation::ResourceHeld { component: node.name, resource, by })
}
