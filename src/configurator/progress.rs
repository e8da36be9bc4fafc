//! What is told while requests are carried out: each step with how it ended and how long it took.

use super::request::{Answer, Reason, Request, Residual};
use crate::model::words::{sent_as_shown, words};
use crate::model::{ComponentName, ConfigId, Ident, MemberRef, Outcome, RequestId, Step};
use crate::system::Slot;
use crate::system::touch::slot;
use std::sync::Arc;
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
        let (member, from) = match slot(step) {
            Slot::Property(member) | Slot::Port(member) | Slot::Operation(member) => (Some(member.member), None),
            Slot::Link(from, to) => (Some(to.member), Some(from)),
            // Of the last two no step is: they are touched beside what it is about.
            Slot::Component(_) | Slot::State(_) | Slot::Drive(_) | Slot::Held(..) => (None, None),
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

sent_as_shown!(StepName);

words! {
    /// How a step ended.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum StepEnd by word {
        /// It happened.
        Done = "done",
        /// It did not happen.
        NotDone = "not done",
        /// Nobody knows yet.
        Unknown = "unknown",
    }
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
        /// The request that it belongs to; 0 for what nobody asked for.
        request: RequestId,
        /// The step.
        step: StepName,
        /// How.
        end: StepEnd,
        /// How long it took. None: too short to be worth a look at the clock of its own (an immediate step of a prepared
        /// switch); the answer tells how long all of them took.
        took: Option<Duration>,
        /// Whether it took something back.
        undoing: bool,
    },
    /// A request was answered.
    Answered(Answer),
    /// What a configuration in force did or stands for is no longer so: told once until it is applied anew.
    Lost {
        /// Which.
        configuration: ConfigId,
        /// Why.
        reason: Arc<Reason>,
    },
    /// All coordinators of the subsystem of that path are down, and nothing is left of it.
    Emptied(Ident),
    /// A later look at the platform shows otherwise what nothing was under way with.
    Differs(Arc<Residual>),
    /// Something is broken now, or only in part in force; or nothing is any more.
    Broken(bool),
    /// Something broken is right again.
    Recovered,
    /// It was tried, and something still is not.
    NotRecovered,
    /// The configurator itself failed, and goes on.
    Survived(String),
    /// So many calls have not returned that no further one is made, but for what is safe: told once until one comes back.
    Stuck(String),
}

/// Hears the progress, in the configurator's thread: must not block.
pub type ProgressSink = Arc<dyn Fn(&Progress) + Send + Sync>;

/// Where answers go. Called in the configurator's thread (for a full queue, in the thread that submits): must not block.
pub type AnswerSink = Arc<dyn Fn(Answer) + Send + Sync>;
