//! Requests to a configurator and its answers (semantics: *Requests*), as data.

use super::names::{ConfigId, EventName};
use serde::Serialize;
use std::fmt;

/// How the event ends that tells of a component's fault: `COMPONENT.faulted`.
pub const FAULTED: &str = ".faulted";

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
    /// `undo`: undo the requester's newest frame.
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

/// What asks for an undo ends so.
pub const UNDO: &str = ".undo";

/// What a name means that a coordinator raises (semantics: *Coordinators*).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Raise {
    /// A request: a configuration's ID, one with `.undo` behind it, or `undo`.
    Request(Ask),
    /// `X.undo` where X is no configuration: answered `X.undo.failed`.
    UnknownUndo,
    /// No request; an event, if somebody takes it for one.
    Event,
}

impl Raise {
    /// What `name` means where `configured` tells which configurations there are.
    pub fn of(name: EventName, configured: impl Fn(ConfigId) -> bool) -> Self {
        let text = name.as_str();
        if text == "undo" {
            return Self::Request(Ask::Undo);
        }
        if let Some(id) = text.strip_suffix(UNDO) {
            return match ConfigId::new(id) {
                Ok(id) if configured(id) => Self::Request(Ask::UndoOf(id)),
                _ => Self::UnknownUndo,
            };
        }
        match ConfigId::new(text) {
            Ok(id) if configured(id) => Self::Request(Ask::Apply(id)),
            _ => Self::Event,
        }
    }
}

impl Ask {
    /// How it is asked for on the command line.
    pub fn command(self) -> String {
        match self {
            Self::Apply(id) => match id.sets() {
                Some((member, value)) => format!("set {member} {value}"),
                None => format!("apply {id}"),
            },
            Self::UndoOf(_) => format!("undo {}", self.subject()),
            Self::Undo | Self::UndoTo(_) | Self::Commit { .. } => self.to_string(),
        }
    }

    /// Whether it takes something back.
    pub fn is_undo(self) -> bool {
        matches!(self, Self::UndoOf(_) | Self::Undo | Self::UndoTo(_))
    }

    /// What its status events begin with.
    pub fn subject(&self) -> &str {
        match self {
            Self::Apply(id) | Self::UndoOf(id) => id.sets().map_or(id.as_str(), |(member, _)| member),
            Self::Undo | Self::UndoTo(_) => "undo",
            Self::Commit { .. } => "commit",
        }
    }

    /// The verdict when it got what it asked for.
    pub fn done(self) -> Verdict {
        if self.is_undo() { Verdict::Undone } else { Verdict::Ok }
    }

    /// The verdict when nothing has changed.
    pub fn failed(self) -> Verdict {
        if self.is_undo() { Verdict::UndoFailed } else { Verdict::Failed }
    }

    /// The verdict when something is left in between.
    pub fn broken(self) -> Verdict {
        if self.is_undo() { Verdict::UndoBroken } else { Verdict::Broken }
    }

    /// Every verdict that it can be answered with, notices about its frame included.
    pub fn verdicts(self) -> &'static [Verdict] {
        use Verdict::{Broken, Cancelled, Failed, Lost, Ok, Reverted, UndoBroken, UndoFailed, Undone};
        match self {
            Self::Apply(_) => &[Ok, Failed, Broken, Cancelled, Reverted, Lost],
            Self::Commit { .. } => &[Ok, Failed],
            _ => &[Undone, UndoFailed, UndoBroken],
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
    /// What it stands for is no longer so: `ID.lost`.
    Lost,
}

impl Verdict {
    /// Whether the request got what it asked for.
    pub fn is_success(self) -> bool {
        matches!(self, Self::Ok | Self::Undone)
    }

    /// How status events end, those first that end in others.
    pub const ENDINGS: [&'static str; 10] = [
        Self::UndoFailed.ending(false),
        Self::UndoBroken.ending(false),
        Self::Ok.ending(false),
        Self::Failed.ending(false),
        Self::Broken.ending(false),
        Self::Cancelled.ending(false),
        Self::Undone.ending(false),
        Self::Undone.ending(true),
        Self::Reverted.ending(false),
        Self::Lost.ending(false),
    ];

    /// How the status event of this verdict ends; `bare`: on an undo that names no configuration.
    pub const fn ending(self, bare: bool) -> &'static str {
        match self {
            Self::Ok => ".ok",
            Self::Failed => ".failed",
            Self::Broken => ".broken",
            Self::Cancelled => ".cancelled",
            Self::Undone if bare => ".done",
            Self::Undone => ".undone",
            Self::UndoFailed if bare => ".failed",
            Self::UndoFailed => ".undo.failed",
            Self::UndoBroken if bare => ".broken",
            Self::UndoBroken => ".undo.broken",
            Self::Reverted => ".reverted",
            Self::Lost => ".lost",
        }
    }

    /// The one that an answer ends with, written without its point (`undo.failed`). A bare `failed` is a push's.
    pub fn ended(ending: &str) -> Option<Self> {
        let all = [
            (Self::Ok, false),
            (Self::Failed, false),
            (Self::Broken, false),
            (Self::Cancelled, false),
            (Self::Undone, false),
            (Self::UndoFailed, false),
            (Self::UndoBroken, false),
            (Self::Reverted, false),
            (Self::Lost, false),
            (Self::Undone, true),
        ];
        all.into_iter().find(|(verdict, bare)| &verdict.ending(*bare)[1..] == ending).map(|(verdict, _)| verdict)
    }

    /// What it means for who asked (semantics: *Requests*).
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Ok => "The configuration is applied, and its frame is on the stack. Undo it with `ID.undo`.",
            Self::Failed => {
                "The configuration is not applied: it was refused, or a step failed, and what was done is taken back. The system is as before."
            }
            Self::Broken => {
                "A step failed, and what was done could not be taken back, or not unasked: the system is neither as before nor as asked for. \
                 What remains is told (`davit drift`); the undo of the configuration, `davit recover` or a shutdown lead on."
            }
            Self::Cancelled => {
                "The request was overtaken before it began, by something `safe` or by its own undo: nothing of it was done."
            }
            Self::Undone => {
                "The configuration is taken back, and its frame is off the stack: so it is also where none was in force. An `undo` that names none \
                 is answered `undo.done`."
            }
            Self::UndoFailed => {
                "The configuration is not taken back: it was refused, or a step failed. Nothing is changed, and its frame stays. An `undo` that names none \
                 is answered `undo.failed`."
            }
            Self::UndoBroken => {
                "The configuration is taken back in part: what remains is told (`davit drift`), and its undo may be asked for again. An `undo` that names none \
                 is answered `undo.broken`."
            }
            Self::Reverted => {
                "The configuration was applied, and is taken back: the event that was to confirm it (`confirm`) did not come in time. Nobody asked for that."
            }
            Self::Lost => {
                "What the configuration stands for is no longer so: a component of it failed, or was seen otherwise than it was left. It stays on the stack, and \
                 is told once, to the coordinator that had asked for it."
            }
        }
    }

    /// What an event tells about that is spelt like an answer (a configuration, `undo`), with how it ends.
    pub fn split(event: &str) -> Option<(&str, &'static str)> {
        let told = |ending: &&'static str| event.strip_suffix(*ending).map(|subject| (subject, *ending));
        Self::ENDINGS.iter().find_map(told).filter(|(subject, ending)| {
            // Only a bare undo is answered so: `grasp.done` is somebody else's word.
            *ending != Self::Undone.ending(true) || *subject == Ask::Undo.subject()
        })
    }

    /// The status event that tells the verdict on `ask`.
    ///
    /// # Panics
    /// Never: every status event is an event name.
    pub fn event(self, ask: Ask) -> EventName {
        let ending = self.ending(matches!(ask, Ask::Undo | Ask::UndoTo(_)));
        EventName::new(&format!("{}{ending}", ask.subject())).expect("a status event is a name")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_answer_has_one_of_the_endings_and_the_first_that_fits_is_it() {
        let id = ConfigId::new("grasp").unwrap();
        for ask in [Ask::Apply(id), Ask::UndoOf(id), Ask::Undo, Ask::UndoTo(1), Ask::Commit { force: false }] {
            for verdict in ask.verdicts() {
                let event = verdict.event(ask).to_string();
                let subject = Verdict::ENDINGS.iter().find_map(|ending| event.strip_suffix(ending));
                assert_eq!(subject, Some(ask.subject()), "{event}");
                assert_eq!(Verdict::split(&event).map(|(subject, _)| subject), subject, "{event}");
            }
        }
    }
}
