//! What a step of a chart did.

/// The mode of the active leaf.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Its activity goes on.
    Active,
    /// It has none, or it is through.
    Done,
}

/// What one microstep of the step loop did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MicrostepResult {
    /// The chart was entered.
    Entered,
    /// The chart could not be entered; the events are lost.
    NotEntered,
    /// A transition was taken.
    Taken,
    /// There were events, and no transition for them.
    Unmatched,
    /// There were no events; the leaf's activity was resumed, if it has one.
    Quiet {
        /// Nothing left to do.
        idle: bool,
    },
}

/// What [`Machine::step`](super::Machine::step) and [`Machine::run`](super::Machine::run) did.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Stepped {
    /// What rFSM's `step` returns: nothing is left to do. `false`: the number of steps was used up, or entering failed.
    pub idle: bool,
    /// At least one transition was taken, the first entry counted.
    pub transition: bool,
    /// Why it ended.
    pub ended: RunEnd,
}

/// Why stepping ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RunEnd {
    /// Nothing left to do.
    Idle,
    /// As many steps as asked for.
    Steps,
    /// The chart could not be entered.
    NotEntered,
    /// It did not come to rest within [`CHART_RUN`](crate::limits::CHART_RUN) microsteps (rFSM would never return).
    Endless,
}
