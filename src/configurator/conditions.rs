//! Conditions that somebody else evaluates for the configurator: what configurations stand for, what settles calls.

use crate::model::monitor::Condition;
use crate::model::{ComponentName, ConfigId};
use crate::time::Time;
use std::collections::BTreeMap;

/// What is known of a condition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Truth {
    /// Whether it was so when last looked at; none: not looked at yet.
    pub is: Option<bool>,
    /// It was so, and then was not.
    pub fell: bool,
    /// Everything that it looks at was written since it is looked at.
    pub sampled: bool,
    /// The platform cannot show what it looks at; then it counts as true while nothing that it looks at is faulted.
    pub unseen: bool,
}

/// Evaluates conditions, each by a number. Called in the configurator's thread: it never waits there, and tells by
/// [`ConfiguratorHandle::truths_changed`](super::ConfiguratorHandle::truths_changed) when to look again.
pub trait Conditions: Send + Sync {
    /// Evaluates a condition from now on, on what is written from now on, without earlier history.
    fn begin(&self, number: u64, condition: &Condition);
    /// No longer.
    fn end(&self, number: u64);
    /// What is known of it.
    fn truth(&self, number: u64) -> Truth;
    /// Something was done, or reported: what it looks at may be another now.
    fn nudge(&self);
}

/// How a configuration in force is watched.
pub(super) enum HoldsWatch {
    /// By the condition of that number. With a time: it was taken up anew and may become true until then.
    On(u64, Option<Time>),
    /// Something is under way that may rightly make it false.
    Paused,
    /// It was lost, or a configuration has stopped or destroyed what it looks at: not before it is applied anew.
    Over,
}

/// A configuration in force that stands for something, or of which something was lost.
pub(super) struct Standing {
    pub watch: HoldsWatch,
    /// Components that its condition looks at and that were running when it was applied.
    pub runs: Vec<ComponentName>,
    pub lost: bool,
}

/// All of them.
#[derive(Default)]
pub(super) struct Standings {
    pub of: BTreeMap<ConfigId, Standing>,
    /// What they were last compared with: transactions so far, those under way, the revision of the view.
    pub seen: (u64, usize, u64),
}
