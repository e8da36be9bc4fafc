//! The embedded platform: components of this process, run by the embedded runtime.
//!
//! * [`registry`]: what is there, behind one lock that no activity ever takes; [`activities`] its activities, [`wiring`] its
//!   ports and properties.
//! * [`steps`]: the steps that are immediate. [`step_sequence`], [`calls`]: those that run a component's own code, on workers under
//!   a deadline; [`under_way`]: how they are given up; [`workers`]: their threads.
//! * [`injecting`]: faults that a scenario puts into components.
//! * [`watchers`]: the probes by which monitors and conditions look at components. [`prepared`]: fixed lists of immediate steps.
//!   [`order`]: the data-flow order.
//!
//! What is immediate: everything but operations, the state changes of types that declare a hook for them, and `create` and
//! `destroy` of types that do not promise to be made and dropped at once. These two go in batches; but `destroy` of a type with
//! hooks goes alone: it may close devices. A `stop` waits until an update under way has ended, at most until its deadline.
//!
//! A call of a component that has not returned by its deadline is *unknown*, the component in quarantine: it is not updated
//! any more and every step on it is refused, but disconnecting its neighbours, and of a `safe` configuration what it writes
//! and what runs beside the component. When the call does return, the component is cleaned up, disconnected and destroyed,
//! and [`PlatformEvent::Returned`] says so.
//!
//! An operation that was given up and has not answered by its deadline, though its code has come back (it answers in a later
//! update), also puts the component in quarantine; but that is updated on, lets all `safe` steps in, and leaves quarantine as
//! it is when it answers.

mod activities;
mod calls;
mod injecting;
mod order;
mod others;
mod prepared;
mod registry;
mod step_sequence;
mod steps;
mod under_way;
mod watchers;
mod wiring;
mod workers;

use super::{EventSink, Execution, ObserveError, Outcome, Platform, PlatformEvent, Prepared, StepBatch, Watch};
use crate::limits;
use crate::model::{
    Activity as Spec, ActivityStatus, Catalogue, ComponentName, ComponentSnapshot, Ident, Injection, Origin, Snapshot,
    Step, Transition, TypeName,
};
use crate::monitor::MonitorInput;
use crate::runtime::{ComponentFactory, Libraries, Notice, Notices, guard};
use crate::time::{Clock, Signal, Time, lock};
use registry::Registry;
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError, RwLock, Weak};
use under_way::UnderWay;
use workers::Workers;

/// The embedded platform. Dropping it ends its threads and drops its components, without calling their hooks: taking a
/// system down in order is the configurator's business.
pub struct EmbeddedPlatform {
    inner: Arc<Inner>,
}

/// What the platform is, for those of its threads that may outlive it.
struct Inner {
    own: Weak<Inner>,
    clock: Clock,
    catalogue: Catalogue,
    kinds: FxHashMap<TypeName, Arc<ComponentFactory>>,
    activities: BTreeMap<Ident, Spec>,
    /// The activity of components that name none.
    default_activity: Ident,
    notices: Arc<Notices>,
    sink: RwLock<Option<EventSink>>,
    registry: Mutex<Registry>,
    workers: Workers,
    under_way: UnderWay,
}

impl EmbeddedPlatform {
    /// A platform without components that can make those of `libraries` and run them in these activities. Components that
    /// name no activity run in the one named `default`; it need not be declared.
    ///
    /// # Panics
    /// Never: `default` is a name.
    pub fn new(clock: &Clock, libraries: &Libraries, activities: &BTreeMap<Ident, Spec>) -> Self {
        guard::install();
        let mut activities = activities.clone();
        let default_activity = Ident::new("default").expect("a plain name");
        activities.entry(default_activity).or_insert(Spec {
            period: Some(limits::DEFAULT_PERIOD),
            priority: 0,
            cpu: None,
            origin: Origin::NONE,
        });
        let inner = Arc::new_cyclic(|own| Inner {
            own: own.clone(),
            clock: clock.clone(),
            catalogue: libraries.catalogue(),
            kinds: libraries.kinds(),
            activities,
            default_activity,
            notices: Arc::new(Notices::default()),
            sink: RwLock::new(None),
            registry: Mutex::new(Registry::default()),
            workers: Workers::new(clock),
            under_way: UnderWay::default(),
        });
        Self { inner }
    }
}

impl Inner {
    fn tell(&self, event: PlatformEvent) {
        let sink = self.sink.read().unwrap_or_else(PoisonError::into_inner).clone();
        if let Some(sink) = sink {
            sink(event);
        }
    }
}

impl Platform for EmbeddedPlatform {
    fn catalogue(&self) -> &Catalogue {
        &self.inner.catalogue
    }

    fn execution(&self, step: &Step) -> Execution {
        match step {
            Step::Operation(_) => Execution::Blocking,
            Step::State { component, transition } => {
                let registry = lock(&self.inner.registry);
                let waits = registry.find(*component).is_ok_and(|slot| {
                    let cell = &registry.entry(slot).cell;
                    cell.kind.has_hook(*transition) || (*transition == Transition::Stop && cell.gate.is_busy())
                });
                if waits { Execution::Blocking } else { Execution::Immediate }
            }
            Step::Create { ty, .. } => match self.inner.kinds.get(ty) {
                Some(kind) if !kind.is_immediate() => Execution::Blocking,
                _ => Execution::Immediate,
            },
            Step::Destroy { component } => {
                let registry = lock(&self.inner.registry);
                registry.find(*component).map_or(Execution::Immediate, |slot| {
                    let kind = &registry.entry(slot).cell.kind;
                    if kind.is_immediate() && !kind.has_hooks() { Execution::Immediate } else { Execution::Blocking }
                })
            }
            _ => Execution::Immediate,
        }
    }

    fn batches(&self, step: &Step) -> bool {
        match step {
            Step::Create { .. } => true,
            Step::Destroy { component } => {
                let registry = lock(&self.inner.registry);
                registry.find(*component).is_ok_and(|slot| !registry.entry(slot).cell.kind.has_hooks())
            }
            _ => false,
        }
    }

    fn execute_batch(&self, batch: &StepBatch) {
        let made_or_dropped = |step: &Step| matches!(step, Step::Create { .. } | Step::Destroy { .. });
        match batch.steps().iter().all(|timed| made_or_dropped(&timed.step)) {
            true => self.inner.in_sequence(batch),
            false => batch.one_by_one(|step, deadline| self.inner.execute(step, deadline, batch.is_safe())),
        }
    }

    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        self.inner.execute(step, deadline, false)
    }

    fn execute_safe(&self, step: &Step, deadline: Time) -> Outcome {
        self.inner.execute(step, deadline, true)
    }

    fn cancel(&self, step: &Step) {
        self.inner.under_way.cancel(step);
    }

    fn observe(&self, _: Time) -> Result<Snapshot, ObserveError> {
        Ok(lock(&self.inner.registry).snapshot())
    }

    fn observe_component(&self, component: ComponentName, _: Time) -> Result<Option<ComponentSnapshot>, ObserveError> {
        let registry = lock(&self.inner.registry);
        Ok(registry.find(component).ok().map(|slot| registry.component(slot)))
    }

    fn observe_some(&self, components: &[ComponentName], _: Time) -> Result<Snapshot, ObserveError> {
        Ok(lock(&self.inner.registry).some(components))
    }

    fn prepare(&self, steps: &[Step]) -> Option<Box<dyn Prepared>> {
        prepared::prepare(&self.inner, steps)
    }

    fn watch(&self, inputs: &[MonitorInput], wake: &Signal) -> Option<Box<dyn Watch>> {
        Some(Box::new(watchers::ProbeWatch::new(&self.inner, inputs, wake)))
    }

    fn inject(&self, component: ComponentName, injection: &Injection, deadline: Time) -> Result<(), String> {
        self.inner.inject(component, injection, deadline)
    }

    fn subscribe(&self, sink: EventSink) {
        *self.inner.sink.write().unwrap_or_else(PoisonError::into_inner) = Some(sink.clone());
        self.inner.notices.subscribe(Arc::new(move |notice| {
            sink(match notice {
                Notice::Raised { event, component, at } => PlatformEvent::Raised { event, component, at },
                Notice::Faulted { component, reason, at } => PlatformEvent::Faulted { component, reason, at },
            });
        }));
    }

    fn quarantined(&self) -> Vec<ComponentName> {
        let registry = lock(&self.inner.registry);
        // Who was restless and does not run any more is at rest.
        let at_rest = |name| registry.find(name).is_ok_and(|slot| !registry.entry(slot).cell.gate.is_quarantined());
        let mut names: Vec<_> = registry.quarantined.iter().copied().filter(|name| !at_rest(*name)).collect();
        names.sort_unstable();
        names
    }

    fn activities(&self) -> Vec<ActivityStatus> {
        let registry = lock(&self.inner.registry);
        let mut list: Vec<_> =
            registry.activities().map(|scheduled| scheduled.activity.status(registry.cells(scheduled))).collect();
        list.sort_by_key(|status| status.name);
        list
    }
}

impl Drop for EmbeddedPlatform {
    fn drop(&mut self) {
        let (threads, entries) = lock(&self.inner.registry).clear();
        for thread in threads {
            let _ = thread.join(self.inner.clock.now() + limits::RUNTIME_END);
        }
        // The components' own code, here too: who hangs in it is left behind with its worker, and who stands behind it.
        let drop_them = Box::new(move || entries.into_iter().for_each(|entry| _ = guard::call(|| drop(entry))));
        let _ = guard::call(|| self.inner.workers.run(drop_them));
        self.inner.workers.close();
    }
}
