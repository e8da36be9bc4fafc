//! Requests to a configurator and its answers (design §6), as data.

use super::names::{ConfigId, EventName};
use serde::Serialize;
use std::fmt;

/// The number of a request; every request gets exactly one answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
pub struct RequestId(pub u64);

/// What is asked of a configurator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Ask {
    /// `ID`: push the configuration.
    Apply(ConfigId),
    /// `ID.undo`: undo the newest frame of it by this requester.
    UndoOf(ConfigId),
    /// `undo`: pop the top.
    Undo,
    /// Pop until `n` frames are left (an operator's).
    UndoTo(usize),
    /// Make the operator's own frames permanent.
    Commit {
        /// Also while a coordinator's frame is in force.
        force: bool,
    },
}

impl fmt::Display for Ask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Apply(id) => write!(f, "{id}"),
            Self::UndoOf(id) => write!(f, "{id}.undo"),
            Self::Undo => f.write_str("undo"),
            Self::UndoTo(n) => write!(f, "undo --to {n}"),
            Self::Commit { .. } => f.write_str("commit"),
        }
    }
}

/// How an answer ends a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Applied: `ID.ok`.
    Ok,
    /// Not applied, the system is as before: `ID.failed`.
    Failed,
    /// Neither applied nor as before: `ID.broken`.
    Broken,
    /// Overtaken before it began: `ID.cancelled`.
    Cancelled,
    /// Undone: `ID.undone`, `undo.done`.
    Undone,
    /// Not undone, nothing changed: `ID.undo.failed`, `undo.failed`.
    UndoFailed,
    /// Half undone: `ID.undo.broken`, `undo.broken`.
    UndoBroken,
    /// Popped because its confirmation did not come: `ID.reverted`.
    Reverted,
}

impl Verdict {
    /// Whether the request got what it asked for.
    pub fn is_success(self) -> bool {
        matches!(self, Self::Ok | Self::Undone)
    }

    /// The status event that tells the verdict on `ask`.
    ///
    /// # Panics
    /// Never: every status event is an event name.
    pub fn event(self, ask: Ask) -> EventName {
        let subject = match ask {
            Ask::Apply(id) | Ask::UndoOf(id) => id.as_str(),
            Ask::Undo | Ask::UndoTo(_) => "undo",
            Ask::Commit { .. } => "commit",
        };
        let plain = matches!(ask, Ask::Undo | Ask::UndoTo(_));
        let suffix = match self {
            Self::Ok => ".ok",
            Self::Failed => ".failed",
            Self::Broken => ".broken",
            Self::Cancelled => ".cancelled",
            Self::Undone if plain => ".done",
            Self::Undone => ".undone",
            Self::UndoFailed if plain => ".failed",
            Self::UndoFailed => ".undo.failed",
            Self::UndoBroken if plain => ".broken",
            Self::UndoBroken => ".undo.broken",
            Self::Reverted => ".reverted",
        };
        EventName::new(&format!("{subject}{suffix}")).expect("a status event is a name")
    }
}
