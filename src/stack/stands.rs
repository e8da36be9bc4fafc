//! When what a configuration stands for (`holds`) is watched no more: the configurator tells no loss from then on, and `check`
//! follows none.

use crate::model::monitor::Condition;
use crate::model::{ComponentName, RunState};
use crate::system::{System, View as _};

/// The components that a configuration's condition looks at and that run when it has been applied, each once.
pub fn running_for(holds: &Condition, system: &System) -> Vec<ComponentName> {
    let mut runs: Vec<ComponentName> = Vec::new();
    holds.for_each_component(&mut |name, _| runs.push(name));
    runs.sort_unstable();
    runs.dedup();
    runs.retain(|name| system.component(*name).is_some_and(|node| node.state == RunState::Running));
    runs
}

/// Whether one of those that ran was stopped or destroyed since: then another configuration has done that, and rightly. A fault
/// is none of that.
pub fn is_stood_down(mut runs: impl Iterator<Item = ComponentName>, system: &System) -> bool {
    let goes = |state| matches!(state, RunState::Running | RunState::Faulted);
    runs.any(|name| system.component(name).is_none_or(|node| !goes(node.state)))
}
