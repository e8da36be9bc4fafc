//! What monitors look at, and what it holds.

use crate::model::monitor::{Counter, PortSignal};
use crate::model::{ComponentName, Ident, MemberRef, RunState};
use crate::time::Time;
use std::fmt;

/// Something that monitors look at.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum MonitorInput {
    /// A number in what a port carries (bools as 0 and 1). With an empty path, also ports that carry no number: then only
    /// when they were written matters.
    Port(PortSignal),
    /// The run state of a component, as a number (`state_value`).
    State(ComponentName),
    /// Whether a component is faulted: 1 or 0.
    Faulted(ComponentName),
    /// A counter of an activity.
    Activity {
        /// The activity.
        activity: Ident,
        /// Which.
        counter: Counter,
    },
}

impl MonitorInput {
    /// The value of a port itself.
    pub fn whole(member: MemberRef) -> Self {
        Self::Port(PortSignal::whole(member))
    }
}

/// As the columns of a file of samples are called: `Arm.force[0]`, `state(Arm)`, `faulted(Arm)`,
/// `activity(control.overruns)`.
impl fmt::Display for MonitorInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Port(port) => write!(f, "{port}"),
            Self::State(component) => write!(f, "state({component})"),
            Self::Faulted(component) => write!(f, "faulted({component})"),
            Self::Activity { activity, counter } => write!(f, "activity({activity}.{})", counter.word()),
        }
    }
}

/// The number that stands for a run state.
pub fn state_value(state: RunState) -> f64 {
    match state {
        RunState::Unconfigured => 0.0,
        RunState::Stopped => 1.0,
        RunState::Running => 2.0,
        RunState::Faulted => 3.0,
    }
}

/// What an input holds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InputSample {
    /// The value; NaN when what was written is no number.
    pub value: f64,
    /// When it was written last: from then on it counts, or from the last step on if that was later. Of states and
    /// counters it does not matter; they count from the step that finds them.
    pub at: Time,
    /// How often it was written so far. Of states and counters it does not matter.
    pub writes: u64,
    /// Whether there is one: not when the port was never written, or its component or activity does not exist.
    pub present: bool,
}

impl InputSample {
    /// The value, NaN when there is none.
    pub(super) fn number(&self) -> f64 {
        if self.present { self.value } else { f64::NAN }
    }

    /// The position from which the age counts: of the newest sample, or of the beginning when there is none.
    pub(super) fn since(&self, begun: u64) -> u64 {
        if self.present { self.at.as_nanos().saturating_mul(2) } else { begun }
    }

    /// What came since `self` was there.
    pub(super) fn news(&self, now: &Self) -> InputNews {
        if now.holds_other_than(self) {
            InputNews::Other
        } else if now.writes != self.writes {
            InputNews::Written
        } else {
            InputNews::Nothing
        }
    }

    /// Whether something else is there now.
    pub(super) fn differs(&self, other: &Self) -> bool {
        self.writes != other.writes || self.holds_other_than(other)
    }

    /// Whether what is there now is another value: written once more, the same is the same.
    pub(super) fn holds_other_than(&self, other: &Self) -> bool {
        self.present != other.present || self.value.to_bits() != other.value.to_bits()
    }
}

/// What came to an input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum InputNews {
    /// Nothing.
    Nothing,
    /// It was written with what it held.
    Written,
    /// Something else is there.
    Other,
}
