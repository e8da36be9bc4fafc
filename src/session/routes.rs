//! The ways between coordinator, configurator and platform: names raised become requests, answers and reports become
//! events. Called in the threads of those who raise; nothing here waits.

use super::held::{Alarms, OnTheWay};
use super::hub::{Hub, Meaning};
use super::log::{Happening, LoggedAnswer, StepTime};
use super::raising::make_safe;
use super::steps::Steps;
use super::subsystems::Subsystems;
use crate::configurator::{Answer, Batch, ConfiguratorHandle, Progress, Reason, Request, Requester, Scope};
use crate::coordinator::{ChartTrouble, Class, CoordinatorHandle, Delivered, Incoming, Listener, NotAccepted, Tag};
use crate::model::{Ask, Deployment, EventName, FAULTED, Ident, Precedence, RequestId, Verdict};
use crate::platform::PlatformEvent;
use crate::statechart::{Chart, EventId, FunctionOutput, NodeId, Raised};
use crate::time::lock;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, Weak};
use std::time::Duration;

/// Why the event that begins the deployment is heard by nobody then.
pub(super) const NO_MORE: &str = "the deployment is being stopped, and does not come up again";

/// Coordinators, mostly few: giving them an event asks for no memory.
pub(super) type Handles = SmallVec<[CoordinatorHandle; 8]>;

/// What the coordinators' and the configurator's threads need of each other: filled once both exist. Weak, so that neither keeps the other alive.
#[derive(Default)]
pub(super) struct Junction {
    /// With the names under which they ask.
    pub coordinators: Mutex<Vec<(Requester, CoordinatorHandle)>>,
    pub configurator: Mutex<Option<ConfiguratorHandle>>,
    /// Events that go before all others, whoever raises them.
    urgent: FxHashMap<EventName, Precedence>,
    /// The events that begin and end the deployment.
    ends: Option<(EventName, EventName)>,
    /// Its subsystems.
    pub subsystems: Option<Arc<Subsystems>>,
    /// What it says before it leaves, and what it waits for then: it has no parent that would let it go.
    leaving: Option<(EventName, EventName)>,
    /// Somebody plays its parent, and lets it go.
    pub has_parent: AtomicBool,
    /// Nobody drives it any more.
    closed: AtomicBool,
    pub alarms: Alarms,
    pub on_the_way: OnTheWay,
    /// Held while an event is given to several coordinators: what one of them tells the others of it comes behind it everywhere.
    giving: Mutex<()>,
}

impl Junction {
    /// Of a deployment whose threads do not run yet.
    pub fn new(deployment: &Deployment, subsystems: Arc<Subsystems>) -> Self {
        let urgent = deployment.urgent().map(|event| (event, deployment.precedence(event))).collect();
        let ends = Some((deployment.deploy.event, deployment.shutdown.event));
        let leaving = deployment.interface.leaving.map(|leaving| (leaving.says, leaving.until));
        let alarms = Alarms::of(deployment);
        Self { urgent, ends, subsystems: Some(subsystems), leaving, alarms, ..Self::default() }
    }

    /// Whether every coordinator has done what it was to do by what came: what it asks for then has been asked for. What one of them told another one
    /// meanwhile, who had been looked at already, is written down.
    pub fn has_reacted(&self, hub: &Hub) -> bool {
        let before = hub.epoch();
        self.on_the_way.is_none()
            && lock(&self.coordinators).iter().all(|(_, coordinator)| coordinator.is_settled())
            && self.on_the_way.is_none()
            && hub.epoch() == before
    }

    /// Its subsystems, if it has any.
    pub fn subsystems(&self) -> Option<&Subsystems> {
        self.subsystems.as_deref().filter(|subsystems| !subsystems.is_empty())
    }

    /// Nobody drives it any more.
    pub fn close(&self) {
        self.closed.store(true, Ordering::Release);
        if let Some(subsystems) = self.subsystems() {
            subsystems.close();
        }
    }

    /// Whether nobody drives it any more.
    pub fn is_closed(&self) -> bool {
        self.closed.load(Ordering::Acquire)
    }

    /// The coordinators of the subsystem of that path; none: of the deployment itself.
    pub fn in_file(&self, path: Option<Ident>) -> Handles {
        let (subsystems, all) = (self.subsystems(), lock(&self.coordinators));
        let own = all.iter().filter(|(name, _)| subsystems.is_none_or(|subsystems| subsystems.is_for(path, *name)));
        own.map(|(_, coordinator)| coordinator.clone()).collect()
    }

    /// Gives an event to the coordinators of one file.
    pub fn give_to(&self, hub: &Hub, path: Option<Ident>, incoming: Incoming) {
        self.give(hub, self.in_file(path), incoming);
    }

    /// An event with the subsystem whose it is (none: the deployment's own), and behind it, of one of safety, those of the subsystems that it
    /// is given on to.
    pub fn reaches(&self, event: EventName) -> impl Iterator<Item = (EventName, Option<Ident>)> + '_ {
        let subsystems = self.subsystems();
        let given_on = subsystems.map_or(&[][..], |subsystems| subsystems.given_on(event));
        let all = std::iter::once(event).chain(given_on.iter().copied());
        all.map(move |event| (event, subsystems.and_then(|subsystems| subsystems.path_of(event))))
    }

    /// Gives an event to whom it is for.
    fn give_all(&self, hub: &Hub, class: Class, event: EventName) {
        for (event, path) in self.reaches(event) {
            self.give_to(hub, path, self.incoming(class, event));
        }
    }

    /// Whether an event is the one that begins the deployment.
    pub fn begins(&self, event: EventName) -> bool {
        self.ends.is_some_and(|(begins, _)| event == begins)
    }

    /// An event came: from the one that ends the deployment on it is led down, until it is down, or a transition is taken on the one that begins it.
    pub fn tell_leaving(&self, configurator: &ConfiguratorHandle, event: EventName) {
        if self.ends.is_some_and(|(_, ends)| event == ends) {
            configurator.leaving(true);
        }
    }

    /// An event of a class, unless it is one that goes before all others.
    pub fn incoming(&self, class: Class, event: EventName) -> Incoming {
        Incoming::new(class, event).going(self.urgent.get(&event).copied().unwrap_or_default())
    }

    /// What gives an event to several coordinators has this until all of them have it.
    pub fn giving(&self) -> MutexGuard<'_, ()> {
        lock(&self.giving)
    }

    /// Gives an event to these. What becomes of it is told when all of them have it: whoever hears that may raise another one.
    pub fn give(&self, hub: &Hub, to: Handles, incoming: Incoming) {
        let delivered: SmallVec<[_; 8]> = {
            let _giving = self.giving();
            to.iter().map(|coordinator| coordinator.deliver(incoming)).collect()
        };
        for delivered in delivered {
            if delivered.is_err() && incoming.ticket != 0 {
                hub.taken_up(incoming.ticket, None);
            }
            hub.taken(delivered);
        }
    }

    /// The coordinator that asks under that name.
    pub fn coordinator(&self, name: Requester) -> Option<CoordinatorHandle> {
        lock(&self.coordinators).iter().find(|(own, _)| *own == name).map(|(_, coordinator)| coordinator.clone())
    }
}

/// Hears a coordinator: names become requests, and what moves is written down.
pub(super) struct ToConfigurator {
    pub hub: Arc<Hub>,
    pub junction: Weak<Junction>,
    pub name: Requester,
    /// Written before the names of its states, where there are several coordinators.
    pub prefix: String,
    /// Its state that means down.
    pub down: Option<NodeId>,
    /// Whether it is in that, and whether that has not been told yet.
    pub is_down: bool,
    pub untold: bool,
    /// The event that begins the deployment was delivered, and nothing has moved since.
    pub begins: bool,
    /// The one that begins the subsystem of that path, or ends it, was.
    pub led: Option<(Ident, bool)>,
}

impl Listener for ToConfigurator {
    fn raised(&mut self, _: &Chart, batch: &[Raised]) {
        let mut requests = Batch::default();
        let mut emitted: SmallVec<[(EventName, Tag); 2]> = SmallVec::new();
        for raised in batch {
            match self.hub.meaning(raised.name) {
                Meaning::Request(ask) => {
                    let id = self.hub.request(ask, self.name, &self.name.to_string());
                    let tag = (raised.owner.index() as u64, u64::from(raised.visit));
                    let scope = raised.scope.and_then(|state| u32::try_from(state.index()).ok()).map(Scope);
                    let request = Request { scope, tag, ..Request::new(id, ask, self.name) };
                    match self.hold() {
                        Err(NotAccepted::Full) => self.refuse(request),
                        _ => requests.requests.push(request),
                    }
                }
                Meaning::Emitted(event) => {
                    self.hub.note(Happening::Emitted { event: event.to_string() });
                    emitted.push((event, Tag::from(*raised)));
                }
                Meaning::UnknownUndo(name) => {
                    // There is no such ID: answered at once, as the table of requests says.
                    let event = EventName::new(&format!("{name}.failed")).expect("an event with a suffix is one");
                    self.hub.note(Happening::Event {
                        event: event.to_string(),
                        from: "configurator".to_owned(),
                        safety: false,
                    });
                    self.deliver(Incoming::new(Class::Notice, event).tagged(Some(Tag::from(*raised))));
                }
                Meaning::Unknown(name) => self.hub.note(Happening::Noted {
                    note: format!("`{name}` was raised: no configuration, and not declared under `emits`"),
                }),
            }
        }
        if !requests.requests.is_empty() {
            self.of_subsystems(|subsystems, _| subsystems.asks(self.name));
        }
        if let Some(configurator) = self.configurator() {
            // A full queue answers every request itself.
            let _ = configurator.submit(requests);
        }
        // Behind what the same step asks for.
        for (event, tag) in emitted {
            // It may be what confirms a configuration.
            if let Some(configurator) = self.configurator() {
                configurator.event(event);
            }
            self.tell_others(event, tag);
        }
        self.tell_down();
    }

    fn delivers(&mut self, event: EventName) {
        let Some(junction) = self.junction.upgrade() else { return };
        junction.alarms.hear(event, || self.hub.now());
        self.begins = junction.begins(event);
        self.led = junction.subsystems().and_then(|subsystems| subsystems.takes_up(self.name, event));
        if let Some(configurator) = self.configurator() {
            if let Some((path, ends)) = self.led {
                configurator.leaving_inside(path, ends);
            }
            // It may wait behind the one that begins it.
            junction.tell_leaving(&configurator, event);
        }
    }

    fn moved(&mut self, chart: &Chart, active: &[NodeId]) {
        self.tell_down();
        if std::mem::take(&mut self.begins)
            && let Some(configurator) = self.configurator()
        {
            configurator.leaving(false);
        }
        self.tell_led(true);
        let is_down = self.down.is_some_and(|down| active.contains(&down));
        self.untold = is_down && !self.is_down;
        self.is_down = is_down;
        self.hub.note(Happening::State {
            active: active.iter().map(|n| format!("{}{}", self.prefix, chart.fqn(*n))).collect(),
        });
    }

    fn unmatched(&mut self, _: EventName) {
        self.begins = false;
        self.tell_led(false);
    }

    fn overtaken(&mut self, event: EventName) {
        let note = format!("`{event}` is not heard any more: an event of safety came before it was taken up");
        self.hub.note(Happening::Noted { note });
    }

    fn taken_up(&mut self, ticket: u64, delivered: Delivered) {
        self.hub.taken_up(ticket, (delivered == Delivered::Taken).then_some(self.name));
        self.of_subsystems(|subsystems, junction| subsystems.tell_ignored(&self.hub, junction));
    }

    fn stale(&mut self, _: &Chart, event: EventName, _: Tag) {
        self.hub.note(Happening::Stale { event: event.to_string() });
    }

    fn rested(&mut self) {
        self.tell_down();
        self.of_subsystems(|subsystems, junction| subsystems.look(self.name, &self.hub, junction));
        // An event that moves nothing is written down nowhere: without this, who waits for "up" would not look again.
        self.hub.wake();
    }

    fn said(&mut self, said: &FunctionOutput) {
        self.hub.note(Happening::Said { by: said.by.word(), text: said.text.clone() });
    }

    fn ended(&mut self, why: &str) {
        let note = format!("the coordinator `{}` has ended and leads no more: {why}", self.name);
        self.hub.note(Happening::Noted { note });
    }

    fn trouble(&mut self, chart: &Chart, trouble: ChartTrouble) {
        self.hub.note(Happening::Noted { note: trouble.finding(chart).message });
    }
}

impl ToConfigurator {
    fn configurator(&self) -> Option<ConfiguratorHandle> {
        self.junction.upgrade().and_then(|j| lock(&j.configurator).clone())
    }

    /// A transition has taken the event that begins or ends its subsystem, or none has.
    fn tell_led(&mut self, heeded: bool) {
        let Some((path, ends)) = self.led.take() else { return };
        self.of_subsystems(|subsystems, _| subsystems.led(path, ends, heeded));
    }

    /// Has those know who know how subsystems stand, if there are any.
    fn of_subsystems(&self, know: impl FnOnce(&Subsystems, &Junction)) {
        if let Some(junction) = self.junction.upgrade()
            && let Some(subsystems) = junction.subsystems()
        {
            know(subsystems, &junction);
        }
    }

    /// Has it stand in the queue that the *down* state was entered, if it was.
    fn tell_down(&mut self) {
        if std::mem::take(&mut self.untold)
            && let Some(configurator) = self.configurator()
        {
            configurator.down(self.name);
        }
    }

    fn own(&self) -> Option<CoordinatorHandle> {
        self.junction.upgrade().and_then(|junction| junction.coordinator(self.name))
    }

    /// Takes room for an answer.
    fn hold(&self) -> Result<(), NotAccepted> {
        self.own().map_or(Err(NotAccepted::Detached), |own| own.hold(Class::Answer))
    }

    /// Answers a request at once: there is no room for a later answer.
    fn refuse(&self, request: Request) {
        let Some(junction) = self.junction.upgrade() else { return };
        let reason = Some(Arc::new(Reason::Unheard));
        let verdict = request.ask.failed();
        let answer = Answer { request, verdict, at: self.hub.now(), took: Duration::ZERO, reason };
        give(&self.hub, &junction, &answer, Vec::new(), Class::Notice);
    }

    /// What one coordinator emits is an event of the others that wait for it somewhere. It is a report, so that two
    /// coordinators that answer each other for ever delay neither an operator nor an answer.
    fn tell_others(&self, event: EventName, tag: Tag) {
        let Some(junction) = self.junction.upgrade() else { return };
        if self.hub.is_stopping() && junction.begins(event) {
            return;
        }
        let alone = !junction.has_parent.load(Ordering::Acquire);
        if let Some((_, until)) = junction.leaving.filter(|(says, _)| alone && *says == event) {
            junction.give_all(&self.hub, Class::Report, until);
        }
        let others: Handles = lock(&junction.coordinators)
            .iter()
            .filter(|(name, other)| *name != self.name && other.chart().event(event) != EventId::OTHER)
            .map(|(_, other)| other.clone())
            .collect();
        let mut incoming = junction.incoming(Class::Report, event);
        let offered = junction
            .subsystems()
            .map(|subsystems| (subsystems, subsystems.offers(&self.hub, event, self.name, Some(tag), others.len())));
        if let Some((_, Some(ticket))) = offered {
            incoming = incoming.watched(ticket);
        }
        junction.give(&self.hub, others, incoming);
        if let Some((subsystems, Some(_))) = offered {
            // Nobody waits for it anywhere, or none had room.
            subsystems.tell_ignored(&self.hub, &junction);
        }
    }

    fn deliver(&self, incoming: Incoming) {
        if let Some(own) = self.own() {
            self.hub.taken(own.deliver(incoming));
        }
    }
}

pub(super) fn on_progress(hub: &Hub, junction: &Junction, steps: &Steps, progress: &Progress) {
    match progress {
        Progress::Begun { .. } => {}
        Progress::Ended { request, step, end, took, undoing } => {
            let noted = || StepTime { step: *step, undoing: *undoing, end: *end, took: *took };
            steps.note(*request, noted);
        }
        Progress::Survived(text) => {
            hub.note(Happening::Noted { note: format!("the configurator itself failed and goes on: {text}") });
        }
        Progress::Stuck(why) => hub.note(Happening::Noted { note: why.clone() }),
        Progress::Lost { configuration, reason } => {
            let event = Verdict::Lost.event(Ask::Apply(*configuration));
            let _on_the_way = junction.on_the_way.begin();
            hub.note(Happening::Lost { event: event.to_string(), reasons: reason.told() });
            // In whatever state they are: it answers nothing that was asked there.
            let path = junction.subsystems().and_then(|subsystems| subsystems.path_of(event));
            junction.give_to(hub, path, Incoming::new(Class::Notice, event));
        }
        Progress::Emptied(path) => {
            if let Some(subsystems) = junction.subsystems() {
                subsystems.emptied(*path, hub, junction);
            }
        }
        Progress::Differs(residual) => hub.note(Happening::Noted { note: residual.cause.to_string() }),
        Progress::Broken(broken) => hub.broken(*broken),
        Progress::Recovered => {
            hub.note(Happening::Recovered { steps: steps.take(RequestId(0)) });
        }
        Progress::NotRecovered => {
            // What was done for it belongs to no later one.
            let done: Vec<String> = steps.take(RequestId(0)).iter().map(StepTime::told).collect();
            if !done.is_empty() {
                hub.note(Happening::Noted { note: format!("done to recover: {}", done.join(", ")) });
            }
        }
        Progress::Started(_) | Progress::Answered(_) => {}
    }
}

/// An answer becomes an event for whoever asked.
pub(super) fn on_answer(hub: &Hub, junction: &Junction, steps: &Steps, answer: &Answer) {
    // What nobody asked for answers nothing, and nobody held room for it.
    let class = if answer.request.is_asked() { Class::Answer } else { Class::Notice };
    give(hub, junction, answer, steps.take(answer.request.id), class);
}

fn give(hub: &Hub, junction: &Junction, answer: &Answer, steps: Vec<StepTime>, class: Class) {
    let event = answer.event();
    let _on_the_way = junction.on_the_way.begin();
    let reasons = answer.reason.as_ref().map(|reason| reason.told()).unwrap_or_default();
    hub.answered(LoggedAnswer {
        request: answer.request.id.0,
        ask: answer.request.ask.to_string(),
        answer: event.to_string(),
        ok: matches!(answer.verdict, Verdict::Ok | Verdict::Undone),
        by: answer.request.requester.to_string(),
        took_us: answer.took.as_secs_f64() * 1e6,
        reasons,
        steps,
    });
    if let Some(coordinator) = junction.coordinator(answer.request.requester) {
        let (owner, visit) = answer.request.tag;
        let owner = usize::try_from(owner).ok().and_then(|i| coordinator.chart().node(i));
        let tag = match (owner, u32::try_from(visit)) {
            (Some(owner), Ok(visit)) if answer.request.is_asked() => Some(Tag { owner, visit }),
            _ => None,
        };
        hub.taken(coordinator.deliver(Incoming::new(class, event).tagged(tag)));
    }
    // Only now: who sees that all is answered also sees that the coordinator has something to react to.
    hub.settled(answer.request.id);
    if let Some(subsystems) = junction.subsystems() {
        subsystems.look(answer.request.requester, hub, junction);
    }
}

/// What the platform reports becomes an event; a fault is told as `COMPONENT.faulted`.
pub(super) fn on_platform(hub: &Hub, junction: &Junction, event: &PlatformEvent) {
    let configurator = lock(&junction.configurator).clone();
    if let Some(configurator) = &configurator {
        configurator.platform_event(event);
    }
    let (event, from) = match event {
        PlatformEvent::Raised { event, component, .. } => {
            let heard = junction.subsystems().map(|subsystems| subsystems.heard_of(component.as_str(), *event));
            (heard.unwrap_or(*event), *component)
        }
        PlatformEvent::Faulted { component, reason, .. } => {
            hub.fault(component.as_str(), reason);
            let event = EventName::new(&format!("{component}{FAULTED}")).expect("a name with a suffix is one");
            (event, *component)
        }
        PlatformEvent::Returned { component, .. } => {
            hub.clear_fault(component.as_str());
            hub.note(Happening::Returned { component: component.to_string() });
            return;
        }
    };
    if hub.is_stopping() && junction.begins(event) {
        hub.note(Happening::Noted { note: format!("`{event}` of `{from}` is passed over: {NO_MORE}") });
        return;
    }
    let _on_the_way = junction.on_the_way.begin();
    hub.raised(event, from);
    hub.halt().report(event);
    let acts = || configurator.as_ref().and_then(|configurator| make_safe(hub, configurator, event, Class::Report));
    if let Some(configurator) = &configurator {
        junction.tell_leaving(configurator, event);
    }
    if acts().is_none() {
        junction.give_all(hub, Class::Report, event);
        // Nobody leads any more since just now.
        acts();
    }
}
