//! What happened, who asked, how long each step took: a bounded list in memory, and the progress of what is under way.

use super::request::{Answer, Reason, Request};
use crate::limits;
use crate::model::{ComponentName, Ident, MemberRef, Step, Verdict};
use crate::platform::Outcome;
use crate::time::{Time, lock};
use serde::{Serialize, Serializer};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A step in short: what it does and to what, without its values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepName {
    /// `start`, `property_set`, …
    pub verb: &'static str,
    /// The component.
    pub component: ComponentName,
    /// The member of it, where there is one; of a connection, the in-port.
    pub member: Option<Ident>,
    /// Of a connection, the out-port.
    pub from: Option<MemberRef>,
}

impl StepName {
    /// The short form of `step`.
    pub fn of(step: &Step) -> Self {
        let (member, from) = match step {
            Step::State { .. } | Step::Create { .. } | Step::Destroy { .. } => (None, None),
            Step::Connect { from, to, .. } | Step::Disconnect { from, to } => (Some(to.member), Some(*from)),
            Step::PropertySet { property, .. } => (Some(property.member), None),
            Step::PortWrite { port, .. } => (Some(port.member), None),
            Step::Operation(call) => (Some(call.operation.member), None),
        };
        Self { verb: step.verb(), component: step.component(), member, from }
    }
}

/// `start Dynamics`, `connect Kin.jacobian -> Dynamics.jacobian`.
impl std::fmt::Display for StepName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ", self.verb)?;
        if let Some(from) = self.from {
            write!(f, "{from} -> ")?;
        }
        write!(f, "{}", self.component)?;
        self.member.map_or(Ok(()), |member| write!(f, ".{member}"))
    }
}

impl Serialize for StepName {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_str(self)
    }
}

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StepEnd {
    /// It happened.
    Done,
    /// It did not happen.
    NotDone,
    /// Nobody knows yet.
    Unknown,
}

impl From<&Outcome> for StepEnd {
    fn from(outcome: &Outcome) -> Self {
        match outcome {
            Outcome::Done(_) => Self::Done,
            Outcome::NotDone(_) => Self::NotDone,
            Outcome::Unknown(_) => Self::Unknown,
        }
    }
}

/// What is told while a request is carried out.
#[derive(Debug, Clone)]
pub enum Progress {
    /// A request was taken up; so many steps are planned.
    Begun {
        /// The request.
        request: Request,
        /// Steps of its plan.
        steps: usize,
    },
    /// A step was given to the platform.
    Started(StepName),
    /// A step ended.
    Ended {
        /// The step.
        step: StepName,
        /// How.
        end: StepEnd,
        /// How long it took.
        took: Duration,
        /// Whether it took something back.
        undoing: bool,
    },
    /// A request was answered.
    Answered(Answer),
    /// A broken system is whole again.
    Recovered,
}

/// Hears the progress, in the configurator's thread: must not block.
pub type ProgressSink = Arc<dyn Fn(&Progress) + Send + Sync>;

/// An entry of the log.
#[derive(Debug, Clone)]
pub struct Entry {
    /// When it ended.
    pub at: Time,
    /// What.
    pub what: What,
}

/// What an entry of the log tells.
#[derive(Debug, Clone)]
pub enum What {
    /// A step ended.
    Step {
        /// The step.
        step: StepName,
        /// How.
        end: StepEnd,
        /// How long it took.
        took: Duration,
        /// Whether it took something back.
        undoing: bool,
    },
    /// A request was answered.
    Answer {
        /// The request.
        request: Request,
        /// How it ended.
        verdict: Verdict,
        /// How long it took.
        took: Duration,
        /// Why, where it is not simply a success.
        reason: Option<Arc<Reason>>,
    },
    /// A component failed by itself.
    Faulted(ComponentName),
    /// A component came out of quarantine.
    Returned(ComponentName),
    /// Something else worth knowing.
    Note(String),
}

/// The log: the newest entries, bounded.
#[derive(Debug, Clone)]
pub struct Log {
    entries: Arc<Mutex<VecDeque<Entry>>>,
}

impl Default for Log {
    fn default() -> Self {
        // All memory at once: writing allocates nothing.
        Self { entries: Arc::new(Mutex::new(VecDeque::with_capacity(limits::LOG_ENTRIES))) }
    }
}

impl Log {
    pub(super) fn write(&self, at: Time, what: What) {
        let mut entries = lock(&self.entries);
        let old = if entries.len() == limits::LOG_ENTRIES { entries.pop_front() } else { None };
        entries.push_back(Entry { at, what });
        drop(entries);
        drop(old);
    }

    /// The newest entries, oldest first; at most `most`.
    pub fn newest(&self, most: usize) -> Vec<Entry> {
        let entries = lock(&self.entries);
        entries.iter().skip(entries.len().saturating_sub(most)).cloned().collect()
    }
}
