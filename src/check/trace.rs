//! Ways: how the deployment comes from its start to what a finding is about.

use crate::model::{Ask, ComponentName, EventName, FaultKind, Verdict};
use serde::Serialize;
use smallvec::SmallVec;
use std::fmt;
use std::time::Duration;

/// One thing that happens on a way.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct TraceStep {
    /// What happens.
    #[serde(flatten)]
    pub what: Happened,
    /// The innermost states of the coordinators then, in the order of the deployment.
    pub states: Vec<Place>,
    /// What coordinators hear then, in order: each is stepped alone by that.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hears: Vec<HeardEvent>,
    /// What a script does to bring it about.
    #[serde(skip)]
    pub replay: MoveReplay,
}

/// Where a coordinator is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Place {
    /// The coordinator; none: there is only this one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coordinator: Option<String>,
    /// The full name of its innermost state.
    pub state: String,
}

/// What a coordinator hears.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct HeardEvent {
    /// The coordinator; none: there is only this one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coordinator: Option<String>,
    /// The event; a time event comes by itself.
    pub event: String,
}

/// What can happen on a way.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(tag = "what", rename_all = "lowercase")]
pub enum Happened {
    /// The coordinators are entered.
    Start,
    /// An event comes from outside.
    Event {
        /// Its name.
        event: String,
    },
    /// A subsystem tells an event where nobody waits for it: it is gone.
    Unheard {
        /// Its name.
        event: String,
    },
    /// Time passes for a coordinator.
    Time {
        /// The coordinator.
        coordinator: String,
        /// Its time event.
        event: String,
    },
    /// A coordinator takes what another one has emitted, or what came from outside before.
    Heard {
        /// The coordinator.
        coordinator: String,
        /// The event.
        event: String,
    },
    /// Requests are answered.
    Answer {
        /// The answers, in their order.
        answers: Vec<Answered>,
    },
    /// A confirmation comes.
    Confirmed {
        /// The configuration whose frame waited for it.
        configuration: String,
    },
    /// What a configuration stands for is no longer so.
    Lost {
        /// The configuration.
        configuration: String,
    },
    /// An operator asks for something.
    Operator {
        /// The request.
        request: String,
    },
    /// The same again, back to here, so many times: frames pile up and are squashed.
    Rounds {
        /// How many times.
        times: usize,
    },
    /// Coordinators that have nothing to do with these are down as well: what was in force is forgotten.
    Down,
    /// A safe configuration that has nothing to do with these interrupts what is under way.
    Elsewhere {
        /// The configuration.
        configuration: String,
    },
}

/// A request that is answered.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Answered {
    /// Who asked: a coordinator, or `operator`.
    pub by: String,
    /// What was asked.
    pub request: String,
    /// The answer as an event.
    pub answer: String,
    /// How it ended.
    pub verdict: Verdict,
}

/// What a move of a way needs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct MoveReplay {
    /// When it happens, from the beginning.
    pub at: Duration,
    /// What is armed before it: the text of a step, how it goes, and how long it takes.
    pub arms: Vec<(String, FaultKind, Duration)>,
    /// What is to be done for it.
    pub does: Does,
    /// At the end of a way: an answer that comes there within that time, without being part of it.
    pub then: Option<(EventName, Duration)>,
    /// At the end of a way: what is asked for there has nothing to do, so that it goes on from there at once.
    pub passes: bool,
    /// Answers that may be others, and lead to the same: what was given up and has nothing to do may be through before.
    pub either: SmallVec<[EventName; 1]>,
    /// A cycle is gone round.
    pub again: Option<Again>,
    /// For which coordinators alone something is raised; or where those that are not followed with these are to be, each with
    /// its name before it.
    pub others: Vec<String>,
}

/// A cycle that is gone round again and again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Again {
    /// So many times.
    pub times: usize,
    /// Of so many moves.
    pub round: usize,
    /// The moves of the first rounds, [`REPLAY_ROUNDS`](crate::limits::REPLAY_ROUNDS) at most.
    pub steps: Vec<TraceStep>,
}

/// What is to be done for a move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Does {
    /// It comes by itself.
    #[default]
    Nothing,
    /// This event is raised.
    Raise(EventName),
    /// This event is raised for some coordinators alone: others hear of it at another time.
    RaiseTo(EventName),
    /// An operator asks for this.
    Ask(Ask),
    /// A component fails by itself, and this is told.
    Fail(ComponentName, EventName),
    /// Nothing: it comes by itself that this is told.
    Hear(EventName),
    /// The coordinators that are not followed with these have come to *down* too, since the event that ends the deployment.
    OthersDown,
    /// No script brings it about, and why.
    Cannot(&'static str),
}

impl TraceStep {
    /// The answers that are given, as events.
    pub fn answers(&self) -> Vec<&str> {
        match &self.what {
            Happened::Answer { answers } => answers.iter().map(|answered| answered.answer.as_str()).collect(),
            _ => Vec::new(),
        }
    }
}

impl fmt::Display for TraceStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.what {
            Happened::Start => f.write_str("start")?,
            Happened::Event { event } => f.write_str(event)?,
            Happened::Unheard { event } => write!(f, "{event}, for nobody")?,
            Happened::Time { coordinator, event } | Happened::Heard { coordinator, event } => match self.states.len() {
                1 => f.write_str(event)?,
                _ => write!(f, "{coordinator} hears {event}")?,
            },
            Happened::Answer { answers } => {
                for (i, answered) in answers.iter().enumerate() {
                    write!(f, "{}{}", if i == 0 { "" } else { ", " }, answered.answer)?;
                }
            }
            Happened::Confirmed { configuration } => write!(f, "`{configuration}` is confirmed")?,
            Happened::Lost { configuration } => write!(f, "{configuration}.lost")?,
            Happened::Operator { request } => write!(f, "operator: {request}")?,
            Happened::Rounds { times } => write!(f, "the same {times} times")?,
            Happened::Down => f.write_str("the others are down")?,
            Happened::Elsewhere { configuration } => write!(f, "`{configuration}` interrupts")?,
        }
        f.write_str(" → ")?;
        for (i, place) in self.states.iter().enumerate() {
            let comma = if i == 0 { "" } else { ", " };
            match &place.coordinator {
                Some(name) => write!(f, "{comma}{name}:{}", place.state)?,
                None => write!(f, "{comma}{}", place.state)?,
            }
        }
        Ok(())
    }
}
