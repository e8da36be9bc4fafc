//! Run states and their legal transitions (semantics: *Words*).

use super::words::words;
use std::fmt;

words! {
    /// The run state of a component.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
    pub enum RunState by as_str {
        /// Created, or cleaned up.
        Unconfigured = "unconfigured",
        /// Configured, not updated.
        Stopped = "stopped",
        /// Updated by its activity.
        Running = "running",
        /// Failed by itself. Ways out: cleanup (to unconfigured) and destroy. Never demanded, never restored.
        Faulted = "faulted",
    }
}

/// A run state that can be demanded: nobody brings a component to `faulted`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Wanted {
    /// Created, or cleaned up.
    Unconfigured,
    /// Configured, not updated.
    Stopped,
    /// Updated by its activity.
    Running,
}

impl From<Wanted> for RunState {
    fn from(wanted: Wanted) -> Self {
        match wanted {
            Wanted::Unconfigured => Self::Unconfigured,
            Wanted::Stopped => Self::Stopped,
            Wanted::Running => Self::Running,
        }
    }
}

impl fmt::Display for Wanted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        RunState::from(*self).fmt(f)
    }
}

words! {
    /// A move between run states.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
    pub enum Transition by as_str {
        /// unconfigured → stopped
        Configure = "configure",
        /// stopped → running
        Start = "start",
        /// running → stopped
        Stop = "stop",
        /// stopped or faulted → unconfigured
        Cleanup = "cleanup",
    }
}

impl Transition {
    /// The state it leads to.
    pub fn target(self) -> RunState {
        self.wanted().into()
    }

    /// The same, as one that can be demanded.
    pub fn wanted(self) -> Wanted {
        match self {
            Self::Configure | Self::Stop => Wanted::Stopped,
            Self::Start => Wanted::Running,
            Self::Cleanup => Wanted::Unconfigured,
        }
    }

    /// Whether it may happen in `state`.
    pub fn allowed_in(self, state: RunState) -> bool {
        match self {
            Self::Configure => state == RunState::Unconfigured,
            Self::Start => state == RunState::Stopped,
            Self::Stop => state == RunState::Running,
            Self::Cleanup => matches!(state, RunState::Stopped | RunState::Faulted),
        }
    }

    /// The transition that takes it back. (From `faulted`, cleanup has none: a faulted state is never restored.)
    pub fn inverse(self) -> Self {
        match self {
            Self::Configure => Self::Cleanup,
            Self::Cleanup => Self::Configure,
            Self::Start => Self::Stop,
            Self::Stop => Self::Start,
        }
    }
}

impl RunState {
    /// The legal path from `self` to `target`, empty when already there.
    pub fn path_to(self, target: Wanted) -> &'static [Transition] {
        use RunState::{Faulted, Running, Stopped, Unconfigured};
        use Transition::{Cleanup, Configure, Start, Stop};
        match (self, target) {
            (Unconfigured, Wanted::Stopped) => &[Configure],
            (Unconfigured, Wanted::Running) => &[Configure, Start],
            (Stopped | Faulted, Wanted::Unconfigured) => &[Cleanup],
            (Stopped, Wanted::Running) => &[Start],
            (Running, Wanted::Stopped) => &[Stop],
            (Running, Wanted::Unconfigured) => &[Stop, Cleanup],
            (Faulted, Wanted::Stopped) => &[Cleanup, Configure],
            (Faulted, Wanted::Running) => &[Cleanup, Configure, Start],
            (Unconfigured, Wanted::Unconfigured) | (Stopped, Wanted::Stopped) | (Running, Wanted::Running) => &[],
        }
    }

    /// The same as a state that can be demanded; none of `faulted`.
    pub fn wanted(self) -> Option<Wanted> {
        match self {
            Self::Unconfigured => Some(Wanted::Unconfigured),
            Self::Stopped => Some(Wanted::Stopped),
            Self::Running => Some(Wanted::Running),
            Self::Faulted => None,
        }
    }

    /// The state a text names, in our words or the field's (RTT, ROS 2, microblx, the paper).
    pub fn from_name(text: &str) -> Option<Self> {
        Some(match text {
            "unconfigured" | "PreOperational" | "preinit" => Self::Unconfigured,
            "stopped" | "Stopped" | "inactive" | "configure" | "configured" => Self::Stopped,
            "running" | "Running" | "active" => Self::Running,
            "faulted" => Self::Faulted,
            _ => return None,
        })
    }

    /// All accepted names of states that may be demanded.
    pub const NAMES: &'static [&'static str] = &[
        "unconfigured",
        "stopped",
        "running",
        "PreOperational",
        "Stopped",
        "Running",
        "inactive",
        "active",
        "preinit",
        "configure",
        "configured",
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_path_is_legal_and_arrives() {
        use RunState::{Faulted, Running, Stopped, Unconfigured};
        for from in [Unconfigured, Stopped, Running, Faulted] {
            for to in [Wanted::Unconfigured, Wanted::Stopped, Wanted::Running] {
                let mut state = from;
                for t in from.path_to(to) {
                    assert!(t.allowed_in(state), "{from}→{to}: {t} in {state}");
                    state = t.target();
                }
                assert_eq!(state, to.into());
                assert_eq!(state.wanted(), Some(to));
            }
        }
    }
}
