//! Platforms: where components live.
//!
//! One trait, of blocking calls with deadlines, made from worker threads. Nothing assumes that a call is local, quick or
//! answered: the same trait must fit components on other hosts and ROS 2 lifecycle nodes.

mod batch;
pub mod conformance;
pub mod embedded;
pub mod simulated;

pub use crate::model::outcome::{Cause, Execution, Outcome};
use crate::model::{
    ActivityStatus, Catalogue, ComponentName, ComponentSnapshot, EventName, Injection, Snapshot, Step, Value,
};
use crate::monitor::{InputSample, MonitorInput};
use crate::time::{Signal, Time};
pub use batch::{StepBatch, TimedOutcome, TimedStep};
use std::collections::BTreeSet;
use std::sync::Arc;

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
    /// A component that was in quarantine has left it: its call has returned and it was cleaned up (it is gone, or as
    /// before the call); or a call that was given up has come to rest at last, and it is as that left it.
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
#[allow(unused_variables)] // their names tell what a default that does nothing is given
pub trait Platform: Send + Sync {
    /// The component types it can make (libraries' and declared ones).
    fn catalogue(&self) -> &Catalogue;

    /// Whether a step is immediate or blocking here.
    fn execution(&self, step: &Step) -> Execution;

    /// Whether a blocking step is better carried out in one call with others, one after the other, than in a call of its own
    /// beside them: it hardly takes time, or the way there and back takes most of it. Never asked of operations, which may
    /// take long and may be given up: each has a call of its own.
    fn batches(&self, step: &Step) -> bool {
        false
    }

    /// Carries out one step. Returns by `deadline` (a little later at most), whatever the component does.
    /// Checks its own precondition: a step that does not fit what is there is refused and changes nothing.
    fn execute(&self, step: &Step, deadline: Time) -> Outcome;

    /// [`Platform::execute`], for a step of a `safe` configuration: it does not wait until a call that was given up has come
    /// to rest, and quarantine does not keep it out, wherever the platform can do without: a value that is written without
    /// waiting, an operation that runs beside the component's own activity (a brake).
    fn execute_safe(&self, step: &Step, deadline: Time) -> Outcome {
        self.execute(step, deadline)
    }

    /// Gives up the call that is under way for exactly this step: whoever carries it out is told so at once. Does not wait,
    /// never blocks, and does nothing where no such call is under way (it is over, or has not reached the platform yet).
    ///
    /// The `execute` that is out returns as soon as the component has come to rest:
    ///
    /// * [`Cause::Cancelled`], *not done*: it had not begun, and never will.
    /// * *Done*, with or without a value: it had begun. A call given up half way counts as done, whatever it answered: an
    ///   error of an operation that has been told is no word that nothing happened, and only what counts as done is taken
    ///   back by its compensation. Only a panic stays one.
    /// * [`Cause::Failed`]: the component had said so before it was told.
    /// * *Unknown* at its deadline: it has not come to rest, and is in quarantine until it has. The deadline stays; whoever
    ///   wants to give the component time to come to rest gives up before it.
    ///
    /// Until then the component begins no other operation, except those that run beside its activity, and those of
    /// [`Platform::execute_safe`]. Only operations can be told; making, dropping and moving between run states goes on to
    /// its end once it has begun. Of a batch that is to stop every step that was taken and is not answered is given up so, but
    /// the first: what has not begun never will.
    fn cancel(&self, step: &Step);

    /// Carries out blocking steps: every call that a worker makes is this one, with one step or with several that
    /// [`Platform::batches`] says so of. They are carried out in their order, each by its own deadline from its beginning
    /// on, and answered one by one as they end. Behind one that is not done none begins, nor once the batch is stopped. Who
    /// returns before all have begun gives the others back: they did not happen.
    ///
    /// By itself this carries out one after the other. A platform far away takes all that may begin ([`StepBatch::begin`]), sends
    /// them in one message with the time that each may take, and answers as the answers come; what it has sent and hears nothing of
    /// any more is unknown, each of them.
    fn execute_batch(&self, batch: &StepBatch) {
        batch.one_by_one(|step, deadline| match batch.is_safe() {
            true => self.execute_safe(step, deadline),
            false => self.execute(step, deadline),
        });
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

    /// Those of these components that exist, as [`Platform::observe`] has them, with the connections that begin or end at
    /// any of them and their written ports. A platform that can costs in proportion to them, and not to all there is.
    ///
    /// # Errors
    /// When they cannot be read by `deadline`.
    fn observe_some(&self, components: &[ComponentName], deadline: Time) -> Result<Snapshot, ObserveError> {
        let mut seen = self.observe(deadline)?;
        let asked: BTreeSet<ComponentName> = components.iter().copied().collect();
        seen.components.retain(|name, _| asked.contains(name));
        seen.connections.retain(|(from, to), _| asked.contains(&from.component) || asked.contains(&to.component));
        seen.ports.retain(|port, _| asked.contains(&port.component));
        Ok(seen)
    }

    /// Resolves a fixed list of steps (no create, destroy) to handles, so that running them again and again costs as
    /// little as the platform can make it. None: not supported, or some step is blocking.
    fn prepare(&self, steps: &[Step]) -> Option<Box<dyn Prepared>> {
        None
    }

    /// From now on events go to `sink` (one sink; the last one set).
    fn subscribe(&self, sink: EventSink);

    /// Has something go wrong in a component at once, as the world would, for scenarios: also in the middle of an operation. Returns
    /// when it has happened, by `deadline` at the latest.
    ///
    /// # Errors
    /// In words: there is no such component, it does not know this, or it does not come to it. By itself a platform injects
    /// nothing.
    fn inject(&self, component: ComponentName, injection: &Injection, deadline: Time) -> Result<(), String> {
        Err("nothing can be injected into components on this platform".to_owned())
    }

    /// Looks at what conditions are about, beside all connections; of ports, at what is written from now on and at nothing
    /// before. Whenever something is written there, `wake` is notified; whoever looks also does so after each step, and
    /// when a component was reported. Never waits. None: this platform shows no values at all.
    fn watch(&self, inputs: &[MonitorInput], wake: &Signal) -> Option<Box<dyn Watch>> {
        None
    }

    /// Components whose call never returned, or did not come to rest when it was given up.
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

/// A look at the inputs of conditions; it ends when it is dropped.
pub trait Watch: Send {
    /// Whether the platform can show this input, of those it was asked for, at all.
    fn shows(&self, input: usize) -> bool;

    /// The newest samples, in the order of the inputs. What is not there is absent. It waits for nothing: what is applied meanwhile, and is
    /// safe, would wait with it.
    fn look(&mut self, now: Time, samples: &mut [InputSample]);
}
