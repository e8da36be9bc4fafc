//! Starting a configurator, and what others hold of it while its thread runs.

use super::conditions::Conditions;
use super::control::{ConfiguratorView, ControlCommand, Drift, QueuedCommand, Recovery, TakenDown, UrgentCommand};
use super::engine::{Engine, Force, Given};
use super::inbox::{self, Mail, Post};
use super::pool::Pool;
use super::progress::{AnswerSink, ProgressSink};
use super::request::{Answer, Batch, QueueFull, Reason, Request, Residual};
use crate::limits;
use crate::model::{Ask, Catalogue, ConfigId, Configuration, DeploymentLimits, EventName, Ident};
use crate::plan::PlanContext;
use crate::platform::{Platform, PlatformEvent};
use crate::stack::claims::Claims;
use crate::stack::{Requester, World};
use crate::system::System;
use crate::time::{Clock, Join, Receiver, Time};
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What a configurator is started with.
pub struct ConfiguratorSetup {
    /// The configurations that may be asked for.
    pub configurations: Vec<Configuration>,
    /// Those of them that bring the system to rest when it is taken down by force, in this order.
    pub rest: Vec<ConfigId>,
    /// Those of them that an operator may apply, beside those that are safe.
    pub operator: Vec<ConfigId>,
    /// The component types.
    pub catalogue: Catalogue,
    /// The deployment's activities.
    pub activities: BTreeSet<Ident>,
    /// The names under which coordinators ask.
    pub coordinators: BTreeSet<Requester>,
    /// The paths of subsystems, with the names under which all coordinators of each ask.
    pub subsystems: Vec<(Ident, Vec<Requester>)>,
    /// Where the components live.
    pub platform: Arc<dyn Platform>,
    /// The time.
    pub clock: Clock,
    /// Bounds the user may set.
    pub limits: DeploymentLimits,
    /// Blocking platform calls made at the same time.
    pub workers: usize,
    /// Where answers go.
    pub answers: AnswerSink,
    /// Hears what is under way.
    pub progress: Option<ProgressSink>,
    /// Who evaluates what configurations stand for, and what settles calls; none: the former counts as true, the latter is
    /// not known.
    pub conditions: Option<Arc<dyn Conditions>>,
}

/// Starts configurators.
pub struct Configurator;

impl Configurator {
    /// Starts a configurator on a thread of its own, for a platform on which nothing of the deployment is yet.
    pub fn start(setup: ConfiguratorSetup) -> ConfiguratorHandle {
        let (post, inbox) = inbox::new(&setup.clock);
        let safe_in_order = setup.configurations.iter().filter(|c| c.safe).map(|c| c.id).collect();
        let configurations: FxHashMap<ConfigId, Configuration> =
            setup.configurations.into_iter().map(|c| (c.id, c)).collect();
        let force = Force { safe: safe_in_order, rest: setup.rest };
        let safe = configurations.values().filter(|c| c.safe).map(|c| c.id).collect();
        let awaited = configurations.values().filter_map(|c| c.confirm.map(|confirm| confirm.event)).collect();
        let pool = Pool::new(
            setup.clock.clone(),
            setup.platform.clone(),
            post.clone(),
            setup.workers.min(limits::WORKERS_MOST),
        );
        // Each coordinator's, and operators' in each subsystem and in the deployment itself.
        let piles = setup.coordinators.len() + setup.subsystems.len() + 1;
        let given = Given {
            clock: setup.clock.clone(),
            platform: setup.platform,
            limits: setup.limits,
            claims: Claims::new(configurations.values(), &setup.catalogue),
            configurations: Arc::new(configurations),
            force,
            operator: setup.operator.into_iter().collect(),
            context: PlanContext { activities: setup.activities, avoid: BTreeSet::new() },
            coordinators: setup.coordinators,
            subsystems: setup.subsystems,
            answers: setup.answers.clone(),
            progress: setup.progress,
            conditions: setup.conditions,
        };
        let stack = crate::stack::Stack::new(setup.limits.stack).for_piles(piles);
        let engine = Engine::new(
            given,
            pool,
            inbox,
            post.counts.clone(),
            World::new(System::new(Arc::new(setup.catalogue)), stack),
        );
        let thread = setup.clock.spawn("configurator", move || engine.live());
        let inner = HandleInner {
            post,
            clock: setup.clock,
            safe,
            awaited,
            answers: setup.answers,
            thread: Mutex::new(Some(thread)),
        };
        ConfiguratorHandle { inner: Arc::new(inner) }
    }
}

/// A running configurator. Cheap to clone; when the last clone is dropped it ends.
#[derive(Clone)]
pub struct ConfiguratorHandle {
    inner: Arc<HandleInner>,
}

struct HandleInner {
    post: Post,
    clock: Clock,
    safe: FxHashSet<ConfigId>,
    awaited: FxHashSet<EventName>,
    answers: AnswerSink,
    thread: Mutex<Option<Join>>,
}

impl Drop for HandleInner {
    fn drop(&mut self) {
        self.post.command(QueuedCommand::Stop);
    }
}

impl ConfiguratorHandle {
    /// Submits requests; never blocks.
    ///
    /// # Errors
    /// `QueueFull` when the queue is full or the configurator has ended; each request that found no room has then been answered
    /// *failed*. What is safe has room of its own, also in a batch whose other requests find none.
    pub fn submit(&self, batch: Batch) -> Result<(), QueueFull> {
        if batch.requests.is_empty() {
            return Ok(());
        }
        let is_safe = |request: &Request| matches!(request.ask, Ask::Apply(id) if self.inner.safe.contains(&id));
        let safe = batch.requests.iter().filter(|request| is_safe(request)).count();
        let Err(batch) = self.inner.post.batch(batch, safe) else { return Ok(()) };
        // What is safe does not wait for room that the rest of its batch does not find.
        let (apart, mut refused): (SmallVec<[Request; 2]>, SmallVec<[Request; 2]>) =
            batch.requests.into_iter().partition(|request| safe > 0 && is_safe(request));
        let number = apart.len();
        let apart = Batch { requests: apart };
        let alone = if number > 0 && !refused.is_empty() { self.inner.post.batch(apart, number) } else { Err(apart) };
        refused.extend(alone.err().into_iter().flat_map(|batch| batch.requests));
        let at = self.inner.clock.now();
        for request in refused {
            let verdict = request.ask.failed();
            let reason = Some(Arc::new(Reason::Full));
            (self.inner.answers)(Answer { request, verdict, at, took: Duration::ZERO, reason });
        }
        Err(QueueFull)
    }

    /// Tells what the platform reported; never blocks. Faults and late returns change the picture of the system, a raised
    /// event may be the confirmation that is waited for.
    pub fn platform_event(&self, event: &PlatformEvent) {
        match event {
            PlatformEvent::Raised { event, .. } => self.event(*event),
            other => self.inner.post.report(Mail::Platform(other.clone())),
        }
    }

    /// Tells that an event was raised (by a component, a monitor, an operator); never blocks. Only events that some
    /// configuration names as its confirmation matter.
    pub fn event(&self, event: EventName) {
        if self.inner.awaited.contains(&event) {
            self.inner.post.report(Mail::Event(event));
        }
    }

    /// Tells that truths of conditions have changed; never blocks.
    pub fn truths_changed(&self) {
        self.inner.post.truths();
    }

    /// How things stand, with the system if it is wanted. None: the configurator did not answer by `deadline`.
    pub fn view(&self, system: bool, deadline: Time) -> Option<Arc<ConfiguratorView>> {
        self.ask(deadline, |reply| UrgentCommand::View { system, reply })
    }

    /// The difference between the picture and the platform.
    pub fn drift(&self, deadline: Time) -> Option<Drift> {
        self.ask(deadline, |reply| QueuedCommand::Drift { reply })
    }

    /// Recovers a broken system, and answers whether it was broken; the error is what remains. None: no answer by `deadline`.
    pub fn recover(&self, direction: Recovery, deadline: Time) -> Option<Result<bool, Arc<Residual>>> {
        self.ask(deadline, |reply| QueuedCommand::Recover { direction, reply })
    }

    /// Takes in a configuration that an operator makes up, in the place of the one of that name, which must not be asked for
    /// meanwhile. `listed`: it may be applied without force. Answers whether it was taken in by `deadline`.
    pub fn define(&self, configuration: Configuration, listed: bool, deadline: Time) -> bool {
        let configuration = Box::new(configuration);
        self.ask(deadline, |reply| UrgentCommand::Define { configuration, listed, reply }).is_some()
    }

    /// Stopping begins: what is in force now is known apart from what comes since, and operators' requests are refused.
    pub fn stopping(&self) {
        self.inner.post.command(UrgentCommand::Stopping);
    }

    /// The event that ends the deployment was raised: until it is down, or (`false`) the one that begins it is raised, an undo
    /// of a coordinator takes along what nobody asks for any more and is in its way.
    pub fn leaving(&self, leaving: bool) {
        self.inner.post.leaving(leaving);
    }

    /// The event that ends the subsystem of that path was taken up: the same of it, until it is empty, or (`false`) brought up again.
    pub fn leaving_inside(&self, path: Ident, leaving: bool) {
        self.inner.post.leaving_inside(path, leaving);
    }

    /// Whether the event that ends the deployment was raised, and it is neither down nor brought up since.
    pub fn is_leaving(&self) -> bool {
        self.inner.post.is_leaving()
    }

    /// The second stage of stopping: what is under way is given up, and frames are popped, newest first, as far as that goes.
    /// The answer comes out of the receiver.
    pub fn take_back(&self, deadline: Time) -> Receiver<TakenDown> {
        let (reply, answer) = self.inner.clock.channel(1);
        self.inner.post.command(QueuedCommand::TakeBack { deadline, reply });
        answer
    }

    /// The third stage: applies the `safe` configurations and what brings the system to rest, then removes everything.
    pub fn force_down(&self, deadline: Time) -> Receiver<TakenDown> {
        let (reply, answer) = self.inner.clock.channel(1);
        self.inner.post.command(QueuedCommand::Force { deadline, reply });
        answer
    }

    /// Its thread panics, in the middle of whatever it does: for a script that tries it. Whether there was room to say so.
    pub fn inject_panic(&self) -> bool {
        self.inner.post.inject_panic()
    }

    /// The third stage is wanted: what takes its time breaks off.
    pub fn hurry(&self) {
        self.inner.post.hurry();
    }

    /// A coordinator has come to its *down* state: when that is taken up, behind what it asked for before, all coordinators
    /// are down and nothing is there any more, what was in force is forgotten.
    pub fn down(&self, coordinator: Requester) {
        self.inner.post.command(UrgentCommand::Down(coordinator));
    }

    /// Forgets the stack: the *down* state was reached with an empty system.
    pub fn discard_stack(&self) {
        self.inner.post.command(QueuedCommand::DiscardStack);
    }

    /// Ends the configurator: what is under way is broken off, what waits is answered *failed*. Waits until it has
    /// ended, at most until `deadline`; answers whether it has.
    pub fn stop(&self, deadline: Time) -> bool {
        self.inner.post.command(QueuedCommand::Stop);
        let thread = crate::time::lock(&self.inner.thread).take();
        thread.is_none_or(|thread| thread.join(deadline).is_ok())
    }

    fn ask<T, C: Into<ControlCommand>>(
        &self,
        deadline: Time,
        command: impl FnOnce(crate::time::Sender<T>) -> C,
    ) -> Option<T> {
        let (reply, answer) = self.inner.clock.channel(1);
        if !self.inner.post.command(command(reply)) {
            return None;
        }
        answer.recv_deadline(deadline).ok()
    }
}
