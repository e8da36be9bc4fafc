//! Run states and their legal transitions (design §2, §3).

use serde::{Deserialize, Serialize};
use std::fmt;

/// The run state of a component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RunState {
    /// Created, or cleaned up.
    Unconfigured,
    /// Configured, not updated.
    Stopped,
    /// Updated by its activity.
    Running,
    /// Failed by itself. Ways out: cleanup (to unconfigured) and destroy. Never demanded, never restored.
    Faulted,
}

/// A move between run states.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Transition {
    /// unconfigured → stopped
    Configure,
    /// stopped → running
    Start,
    /// running → stopped
    Stop,
    /// stopped or faulted → unconfigured
    Cleanup,
}

impl Transition {
    /// The state it leads to.
    pub fn target(self) -> RunState {
        match self {
            Self::Configure | Self::Stop => RunState::Stopped,
            Self::Start => RunState::Running,
            Self::Cleanup => RunState::Unconfigured,
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

    /// Its name: `configure`, `start`, `stop`, `cleanup`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Configure => "configure",
            Self::Start => "start",
            Self::Stop => "stop",
            Self::Cleanup => "cleanup",
        }
    }
}

impl RunState {
    /// The legal path from `self` to `target`, empty when already there; `target` is never `faulted`.
    pub fn path_to(self, target: Self) -> &'static [Transition] {
        use RunState::{Faulted, Running, Stopped, Unconfigured};
        use Transition::{Cleanup, Configure, Start, Stop};
        match (self, target) {
            (Unconfigured, Stopped) => &[Configure],
            (Unconfigured, Running) => &[Configure, Start],
            (Stopped, Unconfigured) | (Faulted, Unconfigured) => &[Cleanup],
            (Stopped, Running) => &[Start],
            (Running, Stopped) => &[Stop],
            (Running, Unconfigured) => &[Stop, Cleanup],
            (Faulted, Stopped) => &[Cleanup, Configure],
            (Faulted, Running) => &[Cleanup, Configure, Start],
            (Unconfigured, Unconfigured) | (Stopped, Stopped) | (Running, Running) | (_, Faulted) => &[],
        }
    }

    /// Our name of it.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Unconfigured => "unconfigured",
            Self::Stopped => "stopped",
            Self::Running => "running",
            Self::Faulted => "faulted",
        }
    }

    /// The state a text names, in our words or the field's (RTT, ROS 2, microblx, the paper); design §2.
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

impl fmt::Display for RunState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

impl fmt::Display for Transition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.as_str())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_path_is_legal_and_arrives() {
        use RunState::{Faulted, Running, Stopped, Unconfigured};
        for from in [Unconfigured, Stopped, Running, Faulted] {
            for to in [Unconfigured, Stopped, Running] {
                let mut state = from;
                for t in from.path_to(to) {
                    assert!(t.allowed_in(state), "{from}→{to}: {t} in {state}");
                    state = t.target();
                }
                assert_eq!(state, to);
            }
        }
    }
}
