//! Statecharts, as written (placeholder until the statechart room lands).

/// A hierarchical statechart.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Statechart {}
