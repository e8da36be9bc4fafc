//! A session's parts and how they are joined.

use super::Command;
use super::hub::{Hub, Meaning};
use super::life::{Ended, leftovers};
use super::log::{Answered, FrameView, Happening, Phase, StatusView, StepTime};
use crate::configurator::{
    Answer, Batch, Configurator, ConfiguratorHandle, Progress, Request, Requester, Setup as ConfiguratorSetup, StepEnd,
    TakenDown, View,
};
use crate::coordinator::{Coordinator, Incoming, Listener, Tag, Trouble};
use crate::limits;
use crate::model::{Ask, Catalogue, ConfigId, Deployment, EventName, RequestId, Snapshot, Step, Verdict};
use crate::platform::{Platform, PlatformEvent};
use crate::statechart::{Chart, NodeId, RaiseSite, Raised, When};
use crate::time::Clock;
use rustc_hash::FxHashSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// What a session is made of.
pub struct Setup {
    /// The deployment; it has been checked.
    pub deployment: Arc<Deployment>,
    /// Its coordinator, compiled.
    pub chart: Arc<Chart>,
    /// The component types it may use.
    pub catalogue: Catalogue,
    /// Where its components live.
    pub platform: Arc<dyn Platform>,
    /// Its time.
    pub clock: Clock,
}

/// One deployment alive.
///
/// Made down; [`bring_up`](Self::bring_up), [`serve`](Self::serve) and [`take_down`](Self::take_down) are called by one
/// thread, a participant of the clock. Everything else may be called from anywhere.
pub struct Session {
    deployment: Arc<Deployment>,
    chart: Arc<Chart>,
    clock: Clock,
    platform: Arc<dyn Platform>,
    hub: Arc<Hub>,
    coordinator: Coordinator,
    configurator: ConfiguratorHandle,
    junction: Arc<Junction>,
    commands: Mutex<Vec<Command>>,
    ended: Mutex<Option<Ended>>,
    up: Option<NodeId>,
    failed: Vec<(NodeId, String)>,
    down: Option<NodeId>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What the coordinator's and the configurator's threads need of each other: filled once both exist. Weak, so that
/// neither keeps the other alive.
#[derive(Default)]
struct Junction {
    coordinator: Mutex<Option<Coordinator>>,
    configurator: Mutex<Option<ConfiguratorHandle>>,
}

impl Session {
    /// Starts the threads of a deployment; nothing happens until it is brought up.
    pub fn start(setup: Setup) -> Arc<Self> {
        let Setup { deployment, chart, catalogue, platform, clock } = setup;
        let emits = deployment.emits.iter().map(|(event, _)| *event);
        let hub = Arc::new(Hub::new(&clock, deployment.configurations.iter().map(|c| c.id), emits));
        let junction = Arc::new(Junction::default());
        let steps = Arc::new(Mutex::new(Vec::new()));
        let configurator = Configurator::start(ConfiguratorSetup {
            configurations: deployment.configurations.clone(),
            catalogue,
            activities: deployment.activities.keys().copied().collect(),
            platform: platform.clone(),
            clock: clock.clone(),
            limits: deployment.limits,
            workers: limits::SESSION_WORKERS,
            answers: {
                let (hub, junction, steps) = (hub.clone(), junction.clone(), steps.clone());
                Arc::new(move |answer| on_answer(&hub, &junction, &steps, &answer))
            },
            progress: Some(Arc::new(move |progress| on_progress(&steps, progress))),
        });
        *lock(&junction.configurator) = Some(configurator.clone());
        let listener = ToConfigurator {
            hub: hub.clone(),
            junction: Arc::downgrade(&junction),
            name: Requester::Coordinator(deployment.name.into()),
            scoped: scoped(&chart),
        };
        let coordinator = Coordinator::start("coordinator", chart.clone(), &clock, listener);
        *lock(&junction.coordinator) = Some(coordinator.clone());
        {
            let (hub, junction) = (hub.clone(), junction.clone());
            platform.subscribe(Arc::new(move |event| on_platform(&hub, &junction, &event)));
        }
        let state = |name: &str| chart.find(name).ok();
        Arc::new(Self {
            up: state(&deployment.deploy.up),
            failed: deployment.deploy.failed.iter().filter_map(|n| state(n).map(|id| (id, n.clone()))).collect(),
            down: state(&deployment.shutdown.down),
            deployment,
            chart,
            clock,
            platform,
            hub,
            coordinator,
            configurator,
            junction,
            commands: Mutex::new(Vec::new()),
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

    /// Its memory: log, observers, what was heard.
    pub fn hub(&self) -> &Hub {
        &self.hub
    }

    /// Its configurations.
    pub fn configurations(&self) -> Vec<ConfigId> {
        self.deployment.configurations.iter().map(|c| c.id).collect()
    }

    /// Events that its coordinator knows, by name.
    pub fn events(&self) -> Vec<EventName> {
        let mut events = self.chart.events().to_vec();
        events.extend(self.deployment.configurations.iter().filter_map(|c| c.confirm.map(|confirm| confirm.event)));
        events.sort_unstable();
        events.dedup();
        events
    }

    /// Gives an event to the coordinator, in the name of `from`.
    pub fn raise(&self, event: EventName, from: &str) {
        self.hub.note(Happening::Event { event: event.to_string(), from: from.to_owned() });
        self.configurator.event(event);
        if self.coordinator.deliver(Incoming::control(event)).is_err() {
            self.hub.note(Happening::Forced {
                note: format!("`{event}` was not delivered: the coordinator is full or gone"),
            });
        }
    }

    /// Makes a request in the name of an operator.
    pub fn request(&self, ask: Ask, by: &str) -> RequestId {
        let id = self.hub.request(ask, by);
        let request = Request { id, ask, requester: Requester::Operator, scoped: false, tag: (0, 0) };
        // A full queue has answered it already.
        let _ = self.configurator.submit(Batch::one(request));
        id
    }

    /// Whether the coordinator has a state of that name.
    pub fn knows_state(&self, state: &str) -> bool {
        self.chart.find(state).is_ok()
    }

    /// Whether a state is active.
    pub fn in_state(&self, state: &str) -> bool {
        self.chart.find(state).is_ok_and(|id| self.coordinator.is_active(id))
    }

    /// Leaves a command for whoever drives the session.
    pub fn command(&self, command: Command) {
        lock(&self.commands).push(command);
        self.hub.changed.notify();
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

    fn view(&self, system: bool) -> Option<Arc<View>> {
        self.configurator.view(system, self.clock.now() + limits::VIEW)
    }

    /// The system as the configurator knows it; empty when the configurator has ended.
    pub fn system(&self) -> Snapshot {
        self.view(true).and_then(|view| view.system.as_deref().cloned()).unwrap_or_default()
    }

    /// How everything stands.
    pub fn status(&self) -> StatusView {
        let view = self.view(true);
        let stack = view.iter().flat_map(|v| &v.stack).map(FrameView::of).collect();
        let phase = match self.hub.phase() {
            Phase::Up | Phase::Deploying if view.as_ref().is_some_and(|v| v.broken.is_some()) => Phase::Broken,
            phase => phase,
        };
        StatusView {
            name: self.deployment.name.to_string(),
            phase,
            coordinator: self.coordinator.active(),
            system: view.and_then(|v| v.system.as_deref().cloned()).unwrap_or_default(),
            stack,
            faults: self.hub.faults(),
            outstanding: self.hub.outstanding(),
            at: self.clock.now().as_secs_f64(),
        }
    }

    /// Follows the configurator into *broken* and back.
    pub(super) fn refresh_phase(&self) {
        let broken = self.view(false).is_some_and(|view| view.broken.is_some());
        match (self.hub.phase(), broken) {
            (Phase::Up, true) => self.hub.set_phase(Phase::Broken),
            (Phase::Broken, false) => self.hub.set_phase(Phase::Up),
            _ => {}
        }
    }

    /// Whether the coordinator is at rest and nothing asked is unanswered: what is seen between two equal epochs was so
    /// at one moment.
    fn at_rest(&self, state: Option<NodeId>) -> bool {
        let before = self.hub.epoch();
        let rest = self.hub.all_answered()
            && self.coordinator.is_settled()
            && state.is_some_and(|id| self.coordinator.is_active(id));
        rest && self.hub.epoch() == before
    }

    pub(super) fn is_up(&self) -> bool {
        self.at_rest(self.up)
    }

    pub(super) fn is_down(&self) -> bool {
        self.at_rest(self.down)
    }

    pub(super) fn failed_state(&self) -> Option<&str> {
        self.failed.iter().find(|(id, _)| self.coordinator.is_active(*id)).map(|(_, name)| name.as_str())
    }

    /// Why requests failed since the deployment began to come up, one line each.
    pub(super) fn failures_since(&self, heard: u64) -> Vec<String> {
        self.hub.failures_since(heard)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.view(true)
            .is_some_and(|view| view.system.as_ref().is_some_and(|s| s.is_empty()) && view.quarantined.is_empty())
    }

    pub(super) fn detach_coordinator(&self) {
        self.coordinator.detach();
    }

    /// Pops everything; answers what had to be forced, one line each.
    pub(super) fn unwind(&self) -> Vec<String> {
        let deadline = self.clock.now() + self.deployment.shutdown.within;
        self.taken_down(self.configurator.unwind(deadline).recv_deadline(deadline + limits::VIEW).ok())
    }

    pub(super) fn force_down(&self) -> Vec<String> {
        let deadline = self.clock.now() + self.deployment.shutdown.within;
        self.taken_down(self.configurator.force_down(deadline).recv_deadline(deadline + limits::VIEW).ok())
    }

    fn taken_down(&self, taken: Option<TakenDown>) -> Vec<String> {
        let Some(taken) = taken else { return vec!["the configurator did not answer".to_owned()] };
        let mut notes: Vec<String> = taken.safe.iter().map(|id| format!("safe configuration `{id}` applied")).collect();
        notes.extend(forced(&taken.forced));
        notes.extend(taken.troubles.iter().map(ToString::to_string));
        for note in &notes {
            self.hub.note(Happening::Forced { note: note.clone() });
        }
        notes
    }

    /// What is left, as the platform sees it; as the configurator knows it where the platform does not answer.
    pub(super) fn left_over(&self) -> Vec<String> {
        let deadline = self.clock.now() + limits::VIEW;
        let system = self.platform.observe(deadline).unwrap_or_else(|_| self.system());
        let quarantined: Vec<String> = self.platform.quarantined().iter().map(ToString::to_string).collect();
        leftovers(&system, &quarantined)
    }

    pub(super) fn stop_threads(&self) {
        self.configurator.discard_stack();
        let deadline = self.clock.now() + limits::VIEW;
        self.configurator.stop(deadline);
        let _ = self.coordinator.stop(deadline);
        self.part();
    }

    /// The threads' handles hold each other through the junction; without it they end.
    fn part(&self) {
        lock(&self.junction.coordinator).take();
        lock(&self.junction.configurator).take();
    }
}

/// A session that is dropped without having been taken down leaves its components to the platform, but no thread behind.
impl Drop for Session {
    fn drop(&mut self) {
        self.coordinator.detach();
        self.part();
    }
}

impl FrameView {
    fn of(frame: &crate::configurator::FrameView) -> Self {
        Self {
            configuration: frame.configuration.to_string(),
            by: frame.by.to_string(),
            at: frame.at.as_secs_f64(),
            parts: frame.parts,
            floor: frame.floor,
        }
    }
}

/// Steps that had to be forced: each, or how many of each kind where there are too many to read.
fn forced(steps: &[Step]) -> Vec<String> {
    if steps.len() <= limits::FORCED_SHOWN {
        return steps.iter().map(ToString::to_string).collect();
    }
    let mut counts: Vec<(&str, usize)> = Vec::new();
    for step in steps {
        match counts.iter_mut().find(|(verb, _)| *verb == step.verb()) {
            Some((_, count)) => *count += 1,
            None => counts.push((step.verb(), 1)),
        }
    }
    counts.into_iter().map(|(verb, count)| format!("{count} × {verb}")).collect()
}

/// Hears the coordinator: names become requests, and what moves is written down.
struct ToConfigurator {
    hub: Arc<Hub>,
    junction: Weak<Junction>,
    name: Requester,
    /// Names that a state raises because of its state-scoped configurations.
    scoped: FxHashSet<(EventName, NodeId)>,
}

fn scoped(chart: &Chart) -> FxHashSet<(EventName, NodeId)> {
    let of = |site: &RaiseSite| match site.when {
        When::Entry(state) if site.scoped => Some((site.name, state)),
        _ => None,
    };
    chart.raises().iter().filter_map(of).collect()
}

impl Listener for ToConfigurator {
    fn raised(&mut self, _: &Chart, batch: &[Raised]) {
        let mut requests = Batch::default();
        for raised in batch {
            match self.hub.meaning(raised.name) {
                Meaning::Request(ask) => {
                    let id = self.hub.request(ask, &self.name.to_string());
                    let tag = (raised.owner.index() as u64, u64::from(raised.visit));
                    let scoped = self.scoped.contains(&(raised.name, raised.owner));
                    requests.requests.push(Request { id, ask, requester: self.name, scoped, tag });
                }
                Meaning::Emitted(event) => self.hub.note(Happening::Emitted { event: event.to_string() }),
                Meaning::UnknownUndo(name) => {
                    // There is no such ID: answered at once, as the table of requests says.
                    let event = EventName::new(&format!("{name}.failed")).expect("an event with a suffix is one");
                    self.hub.note(Happening::Event { event: event.to_string(), from: "configurator".to_owned() });
                    self.deliver(Incoming::answer(event, Tag::from(*raised)));
                }
                Meaning::Unknown(name) => self.hub.note(Happening::Forced {
                    note: format!("`{name}` was raised: no configuration, and not declared under `emits`"),
                }),
            }
        }
        let configurator = self.junction.upgrade().and_then(|j| lock(&j.configurator).clone());
        if let Some(configurator) = configurator {
            // A full queue answers every request itself.
            let _ = configurator.submit(requests);
        }
    }

    fn moved(&mut self, chart: &Chart, active: &[NodeId]) {
        self.hub.note(Happening::State { active: active.iter().map(|n| chart.fqn(*n).to_string()).collect() });
    }

    fn stale(&mut self, _: &Chart, event: EventName, _: Tag) {
        self.hub.note(Happening::Stale { event: event.to_string() });
    }

    fn trouble(&mut self, chart: &Chart, trouble: Trouble) {
        self.hub.note(Happening::Forced { note: trouble.finding(chart).message });
    }
}

impl ToConfigurator {
    fn deliver(&self, incoming: Incoming) {
        if let Some(coordinator) = self.junction.upgrade().and_then(|j| lock(&j.coordinator).clone()) {
            let _ = coordinator.deliver(incoming);
        }
    }
}

/// Steps carried out since the last answer.
type Steps = Mutex<Vec<StepTime>>;

fn on_progress(steps: &Steps, progress: &Progress) {
    match progress {
        Progress::Begun { .. } => lock(steps).clear(),
        Progress::Ended { step, end, took, undoing } => {
            let mut steps = lock(steps);
            if steps.len() < limits::STEPS_LOGGED {
                let outcome = match end {
                    StepEnd::Done => "done",
                    StepEnd::NotDone => "not done",
                    StepEnd::Unknown => "unknown",
                };
                let step = if *undoing { format!("undo: {step}") } else { step.to_string() };
                steps.push(StepTime { step, outcome: outcome.to_owned(), took_us: took.as_secs_f64() * 1e6 });
            }
        }
        Progress::Started(_) | Progress::Answered(_) | Progress::Recovered => {}
    }
}

/// An answer becomes an event for whoever asked.
fn on_answer(hub: &Hub, junction: &Junction, steps: &Steps, answer: &Answer) {
    let event = answer.event();
    let reasons: Vec<String> = answer.findings().iter().map(|finding| finding.message.clone()).collect();
    hub.answered(Answered {
        request: answer.request.id.0,
        ask: answer.request.ask.to_string(),
        answer: event.to_string(),
        ok: matches!(answer.verdict, Verdict::Ok | Verdict::Undone),
        by: answer.request.requester.to_string(),
        took_us: answer.took.as_secs_f64() * 1e6,
        reasons,
        steps: std::mem::take(&mut *lock(steps)),
    });
    if let Requester::Coordinator(_) = answer.request.requester
        && let Some(coordinator) = lock(&junction.coordinator).clone()
    {
        let (owner, visit) = answer.request.tag;
        let owner = usize::try_from(owner).ok().and_then(|i| coordinator.chart().node(i));
        let incoming = match (owner, u32::try_from(visit)) {
            (Some(owner), Ok(visit)) => Incoming::answer(event, Tag { owner, visit }),
            _ => Incoming::control(event),
        };
        let _ = coordinator.deliver(incoming);
    }
    // Only now: who sees that all is answered also sees that the coordinator has something to react to.
    hub.settled(answer.request.id);
}

/// What the platform reports becomes an event; a fault is told as `COMPONENT.faulted`.
fn on_platform(hub: &Hub, junction: &Junction, event: &PlatformEvent) {
    let configurator = lock(&junction.configurator).clone();
    if let Some(configurator) = configurator {
        configurator.platform_event(event);
    }
    let (event, from) = match event {
        PlatformEvent::Raised { event, component, .. } => (*event, component.to_string()),
        PlatformEvent::Faulted { component, reason, .. } => {
            hub.fault(component.as_str(), reason);
            let event = EventName::new(&format!("{component}.faulted")).expect("a name with a suffix is one");
            (event, component.to_string())
        }
        PlatformEvent::Returned { component, .. } => {
            hub.clear_fault(component.as_str());
            hub.note(Happening::Returned { component: component.to_string() });
            return;
        }
    };
    hub.note(Happening::Event { event: event.to_string(), from });
    let coordinator = lock(&junction.coordinator).clone();
    if let Some(coordinator) = coordinator {
        // A full lane counts what it drops.
        let _ = coordinator.deliver(Incoming::report(event));
    }
}

/// For those who hold a session only to look at it.
impl std::fmt::Debug for Session {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Session({}, {})", self.deployment.name, self.hub.phase().as_str())
    }
}
