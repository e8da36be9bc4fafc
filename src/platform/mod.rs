//! Platforms: where components live.
//!
//! One trait, of blocking calls with deadlines, made from worker threads. Nothing assumes that a call is local, quick or
//! answered: the same trait must fit components on other hosts and ROS 2 lifecycle nodes.

pub mod embedded;
pub mod simulated;

pub use crate::model::outcome::{Cause, Execution, Outcome};
use crate::model::{ActivityStatus, Catalogue, ComponentName, ComponentSnapshot, EventName, Snapshot, Step, Value};
use crate::time::Time;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// How one of several steps ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Ended {
    /// How.
    pub outcome: Outcome,
    /// How long it took, where the platform has measured it.
    pub took: Option<Duration>,
}

/// What a platform reports by itself.
#[derive(Debug, Clone, PartialEq)]
pub enum PlatformEvent {
    /// A component raised an event on one of its event ports, or the platform did in its name.
    Raised {
        /// The event.
        event: EventName,
        /// Who.
        component: ComponentName,
        /// When.
        at: Time,
    },
    /// A component became faulted.
    Faulted {
        /// Who.
        component: ComponentName,
        /// What happened.
        reason: String,
        /// When.
        at: Time,
    },
    /// A component whose call had never returned came back and was cleaned up (it is gone, or as before the call).
    Returned {
        /// Who.
        component: ComponentName,
        /// When.
        at: Time,
    },
}

/// Where platform events go. Called from any thread; must not block.
pub type EventSink = Arc<dyn Fn(PlatformEvent) + Send + Sync>;

/// Why an observation failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ObserveError {
    /// No answer before the deadline.
    #[error("the platform did not answer in time")]
    Timeout,
    /// The connection was lost.
    #[error("the connection to the platform was lost: {0}")]
    Lost(String),
}

/// Where components live.
pub trait Platform: Send + Sync {
    /// The component types it can make (libraries' and declared ones).
    fn catalogue(&self) -> &Catalogue;

    /// Whether a step is immediate or blocking here.
    fn execution(&self, step: &Step) -> Execution;

    /// Carries out one step. Returns by `deadline` (a little later at most), whatever the component does.
    /// Checks its own precondition: a step that does not fit what is there is refused and changes nothing.
    fn execute(&self, step: &Step, deadline: Time) -> Outcome;

    /// Carries out brief steps, none of which needs another one, in their order: each has `each` from its beginning, and
    /// `until` at most. Begins no further one after one that is not done, nor after
    /// [`BRIEF_TURN`](crate::limits::BRIEF_TURN), nor once `stop` is set. Answers for those that were begun, at least one;
    /// the others did not happen.
    ///
    /// A platform that calls steps brief carries out several; by itself this carries out the first.
    fn execute_brief(&self, steps: Vec<Step>, each: Duration, until: Time, stop: &Arc<AtomicBool>) -> Vec<Ended> {
        let _ = (each, stop);
        steps.iter().take(1).map(|step| Ended { outcome: self.execute(step, until), took: None }).collect()
    }

    /// The whole system as it is.
    ///
    /// # Errors
    /// When it cannot be read by `deadline`.
    fn observe(&self, deadline: Time) -> Result<Snapshot, ObserveError>;

    /// One component as it is; none when there is none. Used to settle an unknown outcome.
    ///
    /// # Errors
    /// When it cannot be read by `deadline`.
    fn observe_component(
        &self,
        component: ComponentName,
        deadline: Time,
    ) -> Result<Option<ComponentSnapshot>, ObserveError>;

    /// Resolves a fixed list of steps (no create, destroy) to handles, so that running them again and again costs as
    /// little as the platform can make it. None: not supported, or some step is blocking.
    fn prepare(&self, steps: &[Step]) -> Option<Box<dyn Prepared>> {
        let _ = steps;
        None
    }

    /// From now on events go to `sink` (one sink; the last one set).
    fn subscribe(&self, sink: EventSink);

    /// Components whose call never returned.
    fn quarantined(&self) -> Vec<ComponentName>;

    /// What the activities that have components did so far, by name: rounds, overruns, latencies, who holds one up.
    /// Empty: the platform does not know.
    fn activities(&self) -> Vec<ActivityStatus> {
        Vec::new()
    }
}

/// A fixed list of immediate steps, resolved.
pub trait Prepared: Send {
    /// Carries out step `index` of the list with the value it was prepared with, or with `value` where given (an
    /// inverse: the value captured). `now`: the time, as its caller last knew it; what is written bears it. Allocates
    /// nothing, takes no lock shared with an activity.
    fn execute(&mut self, index: usize, value: Option<&Value>, now: Time, deadline: Time) -> Outcome;

    /// Whether the step that was carried out last had to wait for something, so that its time is worth measuring.
    fn waited(&self) -> bool {
        true
    }
}
