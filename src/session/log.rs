//! What happened, in memory: a bounded number of entries, oldest dropped first.

use super::halt::{StandsStill, StoppingView};
use super::lanes::Lanes;
use super::recovery::Difference;
use super::stages::Stage;
use crate::configurator::{StepEnd, StepName};
use crate::coordinator::Dropped;
use crate::limits;
use crate::model::Snapshot;
use crate::model::words::words;
use serde::ser::SerializeStruct;
use serde::{Deserialize, Serialize, Serializer};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// One thing that happened.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LogEntry {
    /// When, in seconds of the deployment's clock since its start.
    pub at: f64,
    /// What.
    #[serde(flatten)]
    pub what: Happening,
}

/// What may happen.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "what", rename_all = "snake_case")]
pub enum Happening {
    /// The deployment's phase changed.
    Phase {
        /// The new phase.
        phase: Phase,
    },
    /// An event was given to the coordinator.
    Event {
        /// The event.
        event: String,
        /// Who raised it: `operator`, a component, `configurator`.
        from: String,
        /// A component raised it, and it is one of safety: told to people whatever else is.
        #[serde(skip)]
        safety: bool,
    },
    /// The coordinator raised an event that leaves the deployment.
    Emitted {
        /// The event.
        event: String,
    },
    /// The coordinator's active states changed.
    State {
        /// From root to leaf.
        active: Vec<String>,
    },
    /// A request was made.
    Requested {
        /// Its number; none of a recovery, which is answered where it was asked.
        #[serde(skip_serializing_if = "Option::is_none")]
        request: Option<u64>,
        /// What is asked.
        ask: String,
        /// Who asks.
        by: String,
    },
    /// A request was answered.
    Answered(LoggedAnswer),
    /// An answer came after the state that asked had been left; the coordinator did not hear it.
    Stale {
        /// The answer.
        event: String,
    },
    /// A component failed.
    Fault {
        /// Which.
        component: String,
        /// How.
        reason: String,
    },
    /// A scenario has something go wrong in a component.
    Injected {
        /// Which.
        component: String,
        /// What.
        fault: String,
    },
    /// A component whose call had not returned came back and was cleaned up.
    Returned {
        /// Which.
        component: String,
    },
    /// What a configuration in force did or stands for is no longer so; the coordinators hear `ID.lost`.
    Lost {
        /// `ID.lost`.
        event: String,
        /// Why, one line each.
        reasons: Vec<String>,
    },
    /// Something broken is right again.
    Recovered {
        /// The steps that nobody's request stands for and that were carried out since the last time.
        steps: Vec<StepTime>,
    },
    /// A stage of stopping begins.
    Stopping {
        /// Which.
        stage: Stage,
        /// Why it comes to this one; none: it is the first, as it should be.
        #[serde(skip_serializing_if = "Option::is_none")]
        why: Option<String>,
    },
    /// Something had to be forced, or was left over.
    Forced {
        /// What.
        note: String,
    },
    /// Something that whoever reads has to know, and that nobody asked for: what was not delivered, why it stands still, what is otherwise.
    Noted {
        /// What.
        note: String,
    },
    /// A coordinator does not keep up: events found its inbox full and were dropped.
    Dropped {
        /// How many since this was last told.
        events: u64,
    },
    /// A coordinator has been reacting to one event for long: a function of its model waits outside of Lua. Told once.
    Slow {
        /// Which.
        coordinator: String,
        /// For how many seconds so far.
        seconds: f64,
    },
    /// The process of a deployment in the background printed something: a component, a library, what is said of an error.
    Printed {
        /// One line of it.
        text: String,
    },
    /// A function of the coordinator printed something, or failed.
    Said {
        /// By which printer: `err`, `warn`, `info` or `dbg`.
        by: &'static str,
        /// What.
        text: String,
    },
}

/// An answer with what led to it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoggedAnswer {
    /// The request's number.
    pub request: u64,
    /// What was asked.
    pub ask: String,
    /// The status event.
    pub answer: String,
    /// Whether the request got what it asked for.
    pub ok: bool,
    /// Who asked.
    pub by: String,
    /// From the beginning of its execution to the answer, in microseconds.
    pub took_us: f64,
    /// Why not, one line each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reasons: Vec<String>,
    /// The steps that were carried out.
    pub steps: Vec<StepTime>,
}

/// How long a step took. Put into words only when it is shown: it is written down in the configurator's thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepTime {
    /// The step.
    pub step: StepName,
    /// Whether it took something back.
    pub undoing: bool,
    /// How it ended.
    pub end: StepEnd,
    /// How long it took; none: it was not measured by itself.
    pub took: Option<Duration>,
}

impl StepTime {
    /// As it is told in a line: `` `start A` (done) ``.
    pub fn told(&self) -> String {
        let undo = if self.undoing { "undo: " } else { "" };
        format!("`{undo}{}` ({})", self.step, self.end)
    }
}

/// `{"step": "undo: start A", "outcome": "not done", "took_us": 1.5}`; without `took_us` where it was not measured.
impl Serialize for StepTime {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        let undo = if self.undoing { "undo: " } else { "" };
        let mut fields = s.serialize_struct("StepTime", 2 + usize::from(self.took.is_some()))?;
        fields.serialize_field("step", &format_args!("{undo}{}", self.step))?;
        fields.serialize_field("outcome", &self.end)?;
        match self.took {
            Some(took) => fields.serialize_field("took_us", &(took.as_secs_f64() * 1e6))?,
            None => fields.skip_field("took_us")?,
        }
        fields.end()
    }
}

words! {
    /// Where a deployment is in its life.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Phase by as_str {
        /// Being brought up.
        Deploying = "deploying",
        /// Up.
        Up = "up",
        /// Being taken down.
        ShuttingDown = "shutting_down",
        /// Down: nothing is left.
        Down = "down",
        /// Neither: something could not be undone.
        Broken = "broken",
    }
}

/// What happened, in memory.
#[derive(Debug)]
pub struct Log(Lanes<Arc<LogEntry>>);

impl Default for Log {
    fn default() -> Self {
        Self(Lanes::new(limits::LOG_ENTRIES - limits::LOG_REPORTS, limits::LOG_REPORTS))
    }
}

impl Log {
    /// Adds an entry, dropping the oldest of its kind past the bound. `is_report`: a component raised an event.
    pub fn push(&mut self, entry: Arc<LogEntry>, is_report: bool) {
        self.0.push(entry, is_report);
    }

    /// How many entries it no longer has, and when the newest of them was written.
    pub fn displaced(&self) -> Option<(u64, f64)> {
        self.0.displaced().map(|(entries, newest)| (entries, newest.at))
    }

    /// The newest `last` entries, oldest first.
    pub fn last(&self, last: usize) -> Vec<Arc<LogEntry>> {
        self.0.newest(last).cloned().collect()
    }
}

/// A component that failed, or whose call has not returned.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComponentFault {
    /// The component.
    pub component: String,
    /// What is wrong with it.
    pub reason: String,
    /// When it was noticed, in seconds.
    pub at: f64,
}

/// A frame of the stack.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FrameStatus {
    /// The configuration it was made by.
    pub configuration: String,
    /// Who asked.
    pub by: String,
    /// When it was applied, in seconds.
    pub at: f64,
    /// How many applied configurations it stands for: more than one once the oldest were squashed.
    pub parts: usize,
    /// Whether undo stops here.
    pub floor: bool,
    /// Whether it is what was done and not taken back of something that ended *broken*.
    pub partial: bool,
    /// Whether what its configuration did or stands for is no longer so, since it was applied last.
    pub lost: bool,
    /// Whether the platform does not show what its configuration stands for: it counts as true while nothing is faulted.
    pub unseen: bool,
    /// The path of the subsystem whose configuration it is; none: the deployment's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub subsystem: Option<String>,
    /// The paths of other subsystems that have components which its configuration names.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub touches: Vec<String>,
}

/// A subsystem at one moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SubsystemStatus {
    /// Its path.
    pub name: String,
    /// What its parent was told of it last: `up`, `failed`, `down` or `stranded`; `deploying` from the event that begins it on, and
    /// `shutting_down` from the one that ends it on, until the next of these is told.
    pub standing: &'static str,
    /// Its own coordinators, by name.
    pub coordinators: Vec<String>,
}

/// A deployment at one moment: what `status --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StatusView {
    /// Its name.
    pub name: String,
    /// Where it is in its life.
    pub phase: Phase,
    /// Active states of the coordinator, root to leaf.
    pub coordinator: Vec<String>,
    /// The same of every coordinator, by name; the one above is the first.
    pub coordinators: BTreeMap<String, Vec<String>>,
    /// Its subsystems to any depth, parents before their children.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub subsystems: Vec<SubsystemStatus>,
    /// The system as the configurator knows it; none, as of the next two: it has not answered, and nobody knows.
    pub system: Option<Snapshot>,
    /// Frames in force, newest last.
    pub stack: Option<Vec<FrameStatus>>,
    /// What is left of an application that is neither done nor undone; empty unless it is broken.
    pub residual: Option<Vec<Difference>>,
    /// What is there though all coordinators are down; without it left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left: Vec<String>,
    /// What is wrong.
    pub faults: Vec<ComponentFault>,
    /// Requests that are not answered yet.
    pub outstanding: Vec<String>,
    /// What stopping is at, once it has begun.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stopping: Option<StoppingView>,
    /// Why it does not come up before people decide: something safe is in force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stands_still: Option<StandsStill>,
    /// Events that found a coordinator's inbox, or its own queue, full, since the session began.
    pub dropped: Dropped,
    /// For how many seconds coordinators have been in one function, by name; those that have been for longer than
    /// a second.
    pub slow: BTreeMap<String, f64>,
    /// Seconds of its clock since its start.
    pub at: f64,
}
