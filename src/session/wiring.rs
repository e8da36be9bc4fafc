//! A session's parts and how they are joined.

use super::Command;
use super::halt::StoppingView;
use super::hub::Hub;
use super::life::{Ended, UNSEEN, leftovers};
use super::log::{FrameStatus, Happening, Phase, StatusView};
use super::members::Settings;
use super::parts::{CoordinatorPart, between};
use super::recovery::Difference;
use super::routes::{Junction, on_answer, on_platform, on_progress};
use super::stands::Evaluator;
use super::steps::Steps;
use super::subsystems::Subsystems;
use crate::configurator::{
    Batch, Conditions, Configurator, ConfiguratorHandle, ConfiguratorSetup, ConfiguratorView, Request, Requester,
};
use crate::coordinator::Dropped;
use crate::functions::Opener;
use crate::limits;
use crate::model::{Ask, Catalogue, ConfigId, Deployment, EventName, Ident, RequestId, Snapshot};
use crate::platform::Platform;
use crate::statechart::{Chart, NodeId};
use crate::time::{Clock, Time, lock};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// What a session is made of.
pub struct SessionSetup {
    /// The deployment; it has been checked.
    pub deployment: Arc<Deployment>,
    /// Its coordinators, compiled, in the order of [`Deployment::coordinators`].
    pub charts: Vec<Arc<Chart>>,
    /// The functions of each, where it has some; opened on its thread.
    pub functions: Vec<Option<Opener>>,
    /// The component types it may use.
    pub catalogue: Catalogue,
    /// Where its components live.
    pub platform: Arc<dyn Platform>,
    /// Its time.
    pub clock: Clock,
}

/// The configurator has not answered in time: nobody knows how system and stack stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the configurator has not answered in time")]
pub struct Unanswered;

/// One deployment alive.
///
/// Made down; [`bring_up`](Self::bring_up), [`serve`](Self::serve) and [`take_down`](Self::take_down) are called by one
/// thread, a participant of the clock. Everything else may be called from anywhere.
pub struct Session {
    deployment: Arc<Deployment>,
    clock: Clock,
    platform: Arc<dyn Platform>,
    hub: Arc<Hub>,
    parts: Vec<CoordinatorPart>,
    configurator: ConfiguratorHandle,
    junction: Arc<Junction>,
    evaluator: Option<Arc<Evaluator>>,
    /// What operators have set, as a configuration each.
    settings: Settings,
    commands: Mutex<Vec<Command>>,
    /// Set by every command.
    commanded: Mutex<Option<Arc<AtomicBool>>>,
    /// Somebody is there who may ask for force.
    pub(super) attended: AtomicBool,
    /// Something safe keeps it from coming up, and that was told.
    pub(super) coming_up_held: AtomicBool,
    ended: Mutex<Option<Ended>>,
}

impl Session {
    /// Starts the threads of a deployment; nothing happens until it is brought up.
    pub fn start(setup: SessionSetup) -> Arc<Self> {
        let SessionSetup { deployment, charts, functions, catalogue, platform, clock } = setup;
        let emits = deployment.emits.iter().map(|(event, _)| *event).chain(between(&charts));
        let hub = Hub::new(&clock, deployment.configurations.iter().map(|c| c.id), emits);
        let safe = deployment.configurations.iter().filter(|c| c.safe).map(|c| c.id).collect();
        let hub = Arc::new(hub.with_safety(deployment.safety.iter().map(|(event, _)| *event), safe));
        hub.begin_writing();
        let subsystems = Arc::new(Subsystems::new(&deployment, &clock));
        let junction = Arc::new(Junction::new(&deployment, subsystems.clone()));
        let steps = Arc::new(Steps::default());
        let evaluator =
            super::stands::needed(&deployment, &catalogue).then(|| Evaluator::start(&clock, &platform, &junction));
        let configurator = Configurator::start(ConfiguratorSetup {
            configurations: deployment.configurations.clone(),
            rest: deployment.all_rest(),
            operator: deployment.operator_applies().collect(),
            catalogue,
            activities: deployment.activities.keys().copied().collect(),
            coordinators: deployment.coordinators.iter().map(|c| Requester::Coordinator(c.name.into())).collect(),
            subsystems: super::subsystems::scopes(&deployment),
            platform: platform.clone(),
            clock: clock.clone(),
            limits: deployment.limits,
            workers: limits::SESSION_WORKERS,
            answers: {
                let (hub, junction, steps) = (hub.clone(), junction.clone(), steps.clone());
                Arc::new(move |answer| on_answer(&hub, &junction, &steps, &answer))
            },
            progress: {
                let (hub, junction) = (hub.clone(), junction.clone());
                Some(Arc::new(move |progress| on_progress(&hub, &junction, &steps, progress)))
            },
            conditions: evaluator.as_ref().map(|evaluator| evaluator.clone() as Arc<dyn Conditions>),
        });
        *lock(&junction.configurator) = Some(configurator.clone());
        let parts = CoordinatorPart::start_all(&deployment, charts.into_iter().zip(functions), &clock, &hub, &junction);
        subsystems.watch(&hub, &junction);
        {
            let (hub, junction) = (hub.clone(), junction.clone());
            platform.subscribe(Arc::new(move |event| on_platform(&hub, &junction, &event)));
        }
        Arc::new(Self {
            deployment,
            clock,
            platform,
            hub,
            parts,
            configurator,
            junction,
            evaluator,
            settings: Settings::default(),
            commands: Mutex::new(Vec::new()),
            commanded: Mutex::default(),
            attended: AtomicBool::new(true),
            coming_up_held: AtomicBool::new(false),
            ended: Mutex::new(None),
        })
    }

    /// The deployment.
    pub fn deployment(&self) -> &Deployment {
        &self.deployment
    }

    /// Its clock.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Where its components live.
    pub fn platform(&self) -> &Arc<dyn Platform> {
        &self.platform
    }

    pub(super) fn settings(&self) -> &Settings {
        &self.settings
    }

    pub(super) fn configurator(&self) -> &ConfiguratorHandle {
        &self.configurator
    }

    /// Has the configurator's thread panic, in the middle of whatever it does. Whether there was room to say so.
    pub fn inject_configurator_panic(&self) -> bool {
        self.configurator.inject_panic()
    }

    /// Its memory: log, observers, what was heard.
    pub fn hub(&self) -> &Hub {
        &self.hub
    }

    /// Its configurations.
    pub fn configurations(&self) -> Vec<ConfigId> {
        self.deployment.configurations.iter().map(|c| c.id).collect()
    }

    /// Events that its coordinators know, by name.
    pub fn events(&self) -> Vec<EventName> {
        let mut events: Vec<EventName> = self.parts.iter().flat_map(|part| part.chart.events()).copied().collect();
        events.extend(self.deployment.configurations.iter().filter_map(|c| c.confirm.map(|confirm| confirm.event)));
        // Those that are only given on to subsystems.
        events.extend(self.deployment.safety.iter().map(|(event, _)| *event));
        events.sort_unstable();
        events.dedup();
        events
    }

    /// Whether a configuration waits for that event to be confirmed.
    pub fn confirms(&self, event: EventName) -> bool {
        self.deployment.configurations.iter().any(|c| c.confirm.is_some_and(|confirm| confirm.event == event))
    }

    /// Whether a coordinator has functions, which see every event, also one that no transition lists.
    pub fn sees_all_events(&self) -> bool {
        self.parts.iter().any(|part| part.sees_all)
    }

    /// The states of its coordinators, by name.
    pub fn states(&self) -> BTreeSet<String> {
        let of = |part: &CoordinatorPart| -> Vec<String> {
            let chart = &part.chart;
            chart.nodes().filter(|node| chart.is_state(*node)).map(|node| chart.name(node).to_string()).collect()
        };
        self.parts.iter().flat_map(of).collect()
    }

    pub(super) fn junction(&self) -> &Junction {
        &self.junction
    }

    /// The names of the coordinators.
    pub fn coordinators(&self) -> Vec<Ident> {
        self.parts.iter().map(|part| part.name).collect()
    }

    /// Makes a request in the name of an operator. `force`: also one that applies what is not listed, undoes a coordinator's
    /// frame, or moves while a safe configuration is in force.
    pub fn request(&self, ask: Ask, by: &str, force: bool) -> RequestId {
        self.request_on(0, ask, by, force)
    }

    /// The same through a connection: requests of one connection (other than 0) begin one after the other.
    pub fn request_on(&self, line: u32, ask: Ask, by: &str, force: bool) -> RequestId {
        let id = self.hub.request(ask, Requester::Operator, by);
        let request = Request { force, line, ..Request::new(id, ask, Requester::Operator) };
        // A full queue has answered it already.
        let _ = self.configurator.submit(Batch::one(request));
        id
    }

    /// Whether a coordinator has a state of that name (`STATE`, or `COORDINATOR:STATE`).
    pub fn knows_state(&self, state: &str) -> bool {
        self.parts.iter().any(|part| !part.named(state).is_empty())
    }

    /// Whether a state is active: in all coordinators that have one of that name, any of those that a name stands for.
    pub fn in_state(&self, state: &str) -> bool {
        let named = self.parts.iter().map(|part| (part, part.named(state)));
        let mut found = named.filter(|(_, ids)| !ids.is_empty()).peekable();
        found.peek().is_some() && found.all(|(part, ids)| ids.iter().any(|id| part.coordinator.is_active(*id)))
    }

    /// From now on `flag` is set by every command, also one that changes nothing any more: who drives several deployments one after
    /// the other is asked to end, and not only this one.
    pub fn flag_commands(&self, flag: &Arc<AtomicBool>) {
        *lock(&self.commanded) = Some(flag.clone());
    }

    /// Whether stopping stands still, and goes on when somebody asks for force.
    pub fn waits_to_be_forced(&self) -> bool {
        self.hub.halt().is_held()
    }

    /// Leaves a command for whoever drives the session. Where it is being stopped already, to shut down raises the event
    /// again, and force is the next stage.
    pub fn command(&self, command: Command) {
        let Command::Shutdown { force } = command;
        if let Some(flag) = &*lock(&self.commanded) {
            flag.store(true, Ordering::Relaxed);
        }
        if self.hub.is_stopping() && !force {
            if self.hub.halt().is_led() {
                self.raise(self.deployment.shutdown.event, "operator");
            }
            return;
        }
        {
            let mut commands = lock(&self.commands);
            if !commands.contains(&command) {
                commands.push(command);
            }
        }
        if force {
            self.configurator.hurry();
        }
        self.hub.changed.notify();
    }

    pub(super) fn parts(&self) -> &[CoordinatorPart] {
        &self.parts
    }

    /// The frames in force, oldest first.
    pub(super) fn frames(&self) -> Result<Vec<crate::configurator::FrameView>, Unanswered> {
        Ok(self.view(false)?.map_or_else(Vec::new, |view| view.stack.clone()))
    }

    /// Whether nothing is asked for, and no coordinator has anything to react to.
    pub(super) fn is_still(&self) -> bool {
        let before = self.hub.epoch();
        let settled = || self.parts.iter().all(|part| part.coordinator.is_settled());
        self.hub.all_answered() && settled() && self.hub.epoch() == before
    }

    pub(super) fn pending_command(&self) -> Option<Command> {
        let mut commands = lock(&self.commands);
        if commands.is_empty() { None } else { Some(commands.remove(0)) }
    }

    /// How it ended, once it has.
    pub fn ended(&self) -> Option<Ended> {
        lock(&self.ended).clone()
    }

    pub(super) fn set_ended(&self, ended: &Ended) {
        *lock(&self.ended) = Some(ended.clone());
        self.hub.wake();
    }

    /// How things stand; none once it is down: nothing is there, and nobody who would answer.
    fn view(&self, system: bool) -> Result<Option<Arc<ConfiguratorView>>, Unanswered> {
        match self.configurator.view(system, self.clock.now() + limits::VIEW) {
            None if self.hub.phase() != Phase::Down => Err(Unanswered),
            view => Ok(view),
        }
    }

    /// The system as the configurator knows it.
    ///
    /// # Errors
    /// It has not answered in time.
    pub fn system(&self) -> Result<Snapshot, Unanswered> {
        Ok(self.view(true)?.and_then(|view| view.system.as_deref().cloned()).unwrap_or_default())
    }

    /// How everything stands.
    pub fn status(&self) -> StatusView {
        let known = self.view(true).ok();
        let view = known.as_ref().map(Option::as_deref);
        let frames = view.map(|view| view.map_or(&[][..], |view| &view.stack));
        let broken = view.flatten().is_some_and(|view| view.broken.is_some());
        let system = view.map(|view| view.and_then(|view| view.system.as_deref().cloned()).unwrap_or_default());
        let (phase, left) = self.phase_of(broken, system.as_ref());
        StatusView {
            name: self.deployment.name.to_string(),
            phase,
            coordinator: self.parts[0].coordinator.active(),
            coordinators: self.active(),
            subsystems: self.junction.subsystems().map_or_else(Vec::new, Subsystems::view),
            system,
            left,
            stack: frames.map(|frames| frames.iter().map(|frame| FrameStatus::of(frame, &self.deployment)).collect()),
            residual: view.map(|view| view.map_or_else(Vec::new, Difference::of_view)),
            faults: self.hub.faults(),
            outstanding: self.hub.outstanding(),
            stopping: self
                .hub
                .halt()
                .view(self.hub.outstanding())
                .map(|view| StoppingView { stands_still: frames.and_then(|frames| self.held_by(frames)), ..view }),
            stands_still: frames.and_then(|frames| self.held_coming_up(frames)),
            slow: self.slow(),
            dropped: self.parts.iter().map(|part| part.coordinator.dropped()).fold(Dropped::default(), Dropped::and),
            at: self.clock.now().as_secs_f64(),
        }
    }

    /// Coordinators that have been reacting to one event for long, with the seconds.
    fn slow(&self) -> BTreeMap<String, f64> {
        let now = self.clock.now();
        let hanging = self.parts.iter().filter(|part| part.coordinator.hangs());
        hanging
            .filter_map(|part| {
                let since = part.coordinator.reacting_since()?;
                Some((part.name.to_string(), now.since(since).as_secs_f64()))
            })
            .collect()
    }

    /// Tells of coordinators that have begun to hang, of each reaction once.
    pub(super) fn tell_slow(&self) {
        for part in &self.parts {
            let Some(since) = part.coordinator.reacting_since().filter(|_| part.coordinator.hangs()) else { continue };
            if part.told_slow.swap(since.0, Ordering::Relaxed) != since.0 {
                let seconds = self.clock.now().since(since).as_secs_f64();
                self.hub.note(Happening::Slow { coordinator: part.name.to_string(), seconds });
            }
        }
    }

    /// When whoever drives the session has to look again: now and then where functions may hang. Simulated time stands
    /// still meanwhile, and must not be moved by looking.
    pub(super) fn next_look(&self, deadline: Time) -> Time {
        if self.clock.is_simulated() || !self.sees_all_events() {
            return deadline;
        }
        deadline.min(self.clock.now() + limits::REACTION_LONG)
    }

    /// Each coordinator's active states, root to leaf, by its name.
    fn active(&self) -> BTreeMap<String, Vec<String>> {
        self.parts.iter().map(|part| (part.name.to_string(), part.coordinator.active())).collect()
    }

    /// Whether every coordinator (of the deployment itself, or of its subsystems too) is at rest in that state of its own and nothing asked is
    /// unanswered: what is seen between two equal epochs was so at one moment.
    fn at_rest(
        &self,
        counts: impl Fn(&CoordinatorPart) -> bool,
        state: impl Fn(&CoordinatorPart) -> Option<NodeId>,
    ) -> bool {
        let before = self.hub.epoch();
        let answered = |part: &CoordinatorPart| self.hub.has_answered(Requester::Coordinator(part.name.into()));
        let rest = (self.hub.all_answered() || self.parts.iter().filter(|part| counts(part)).all(answered))
            && self.parts.iter().filter(|part| counts(part)).all(|part| {
                part.coordinator.is_settled() && state(part).is_some_and(|id| part.coordinator.is_active(id))
            })
            // One that was looked at first may have been told something by one looked at later.
            && self.parts.iter().filter(|part| counts(part)).all(|part| part.coordinator.is_settled());
        rest && self.hub.epoch() == before
    }

    pub(super) fn is_up(&self) -> bool {
        self.at_rest(|part| part.of.is_none(), |part| part.up)
    }

    pub(super) fn is_down(&self) -> bool {
        self.hub.all_answered() && self.at_rest(|_| true, |part| part.down)
    }

    pub(super) fn failed_state(&self) -> Option<&str> {
        self.parts.iter().filter(|part| part.of.is_none()).find_map(CoordinatorPart::failed_state)
    }

    /// Why requests failed since the deployment began to come up, one line each.
    pub(super) fn failures_since(&self, heard: u64) -> Vec<String> {
        self.hub.failures_since(heard)
    }

    /// None of them leads any more. The safety events that came before and to which nobody has reacted, each once.
    pub(super) fn detach_coordinators(&self) -> Vec<EventName> {
        let mut unheard = Vec::new();
        for event in self.parts.iter().flat_map(|part| part.coordinator.detach()) {
            if self.hub.is_safety(event) && !unheard.contains(&event) {
                unheard.push(event);
            }
        }
        unheard
    }

    /// What is left, as the platform sees it. Where it does not answer: as the configurator knows it, and that more may be.
    pub(super) fn left_over(&self) -> Vec<String> {
        let deadline = self.clock.now() + limits::VIEW;
        let seen = self.platform.observe(deadline).ok();
        let unseen = seen.is_none().then(|| UNSEEN.to_owned());
        let system = seen.or_else(|| self.system().ok()).unwrap_or_default();
        let quarantined: Vec<String> = self.platform.quarantined().iter().map(ToString::to_string).collect();
        leftovers(&system, &quarantined).into_iter().chain(unseen).collect()
    }

    pub(super) fn stop_threads(&self) {
        self.configurator.discard_stack();
        let deadline = self.clock.now() + limits::VIEW;
        self.configurator.stop(deadline);
        // Nothing is needed of a coordinator any more; one that hangs is left behind at once.
        let soon = self.clock.now() + limits::REACTION_LONG;
        for part in &self.parts {
            if part.coordinator.hangs() {
                part.coordinator.detach();
            } else {
                let _ = part.coordinator.stop(soon);
            }
        }
        self.part();
    }

    /// The threads' handles hold each other through the junction; without it they end.
    fn part(&self) {
        if let Some(evaluator) = &self.evaluator {
            evaluator.close();
        }
        self.hub.end_writing();
        self.junction.close();
        lock(&self.junction.coordinators).clear();
        lock(&self.junction.configurator).take();
    }
}

/// A session that is dropped without having been taken down leaves its components to the platform, but no thread behind.
impl Drop for Session {
    fn drop(&mut self) {
        self.detach_coordinators();
        self.part();
    }
}

/// For those who hold a session only to look at it.
impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Session({}, {})", self.deployment.name, self.hub.phase().as_str())
    }
}
