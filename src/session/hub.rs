//! Where coordinator, configurator and platform meet: names raised become requests or emitted events, answers become
//! events, and everything is written down on the way.
//!
//! All of it is called from the threads of others and never waits for anything but short locks of its own.

use super::halt::StoppingState;
use super::lanes::Lanes;
use super::log::{ComponentFault, Happening, Log, LogEntry, LoggedAnswer, Phase};
use super::names::Unlisted;
use super::tap::LogSink;
use super::writing::UnwrittenEvent;
use crate::coordinator::{NotAccepted, Put};
use crate::limits;
use crate::model::{Ask, ConfigId, EventName, Raise, RequestId};
use crate::stack::Requester;
use crate::time::{Clock, Signal, Time, lock};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Called with everything that happens, in the thread that writes it down: for tests and measurements, which keep no one waiting. On
/// the real clock two that happen at once may come in another order than they are written in. What shows or passes on what happens hangs
/// on a [tap](super::tap).
pub type Observer = Arc<dyn Fn(Time, &Happening) + Send + Sync>;

/// The common memory of one session.
pub struct Hub {
    pub(super) clock: Clock,
    /// For those who wait outside.
    real: Clock,
    state: Mutex<HubState>,
    /// Whether events were dropped that nobody was told of.
    untold: AtomicBool,
    /// Wakes whoever drives the session.
    pub changed: Signal,
    /// What components have raised, oldest first, and nobody has written down yet. Its own lock, so that whoever raises something waits for
    /// nobody who writes.
    pub(super) unwritten: Mutex<VecDeque<UnwrittenEvent>>,
    /// Wakes the thread that writes it down.
    pub(super) raised: Signal,
    /// There is such a thread.
    pub(super) is_written: AtomicBool,
    /// Wakes threads outside the clock (those of the control socket).
    outside: Condvar,
    configurations: FxHashSet<ConfigId>,
    emits: FxHashSet<EventName>,
    /// Names from outside that only functions may hear.
    pub(super) unlisted: Unlisted,
    halt: StoppingState,
}

pub(super) struct HubState {
    pub(super) phase: Phase,
    /// Something is broken, as the configurator has told.
    broken: bool,
    next: u64,
    outstanding: FxHashMap<RequestId, Outstanding>,
    faults: Vec<ComponentFault>,
    pub(super) log: Log,
    /// Room for what components have raised, while it is written down.
    pub(super) taken: VecDeque<UnwrittenEvent>,
    pub(super) observers: Vec<Observer>,
    pub(super) taps: Vec<Arc<dyn LogSink>>,
    /// The newest answers and events, for those who wait for one.
    pub(super) heard: Lanes<String>,
    /// Events that found an inbox full since that was last told, and when it was.
    dropped: u64,
    dropped_told: Option<Time>,
    /// Events of which somebody wants to know whether a transition hears them: by how many coordinators each is still to be
    /// taken up, and whether one heard it.
    tickets: FxHashMap<u64, (usize, Vec<Requester>)>,
    /// The newest answers.
    answers: VecDeque<LoggedAnswer>,
    /// By coordinator: what its states are written with (`arm:`, or nothing), and its active ones.
    pub(super) active: BTreeMap<String, Vec<String>>,
    pub(super) epoch: u64,
}

impl HubState {
    /// What is up and has something broken is *broken*.
    fn phase(&self) -> Phase {
        if self.phase == Phase::Up && self.broken { Phase::Broken } else { self.phase }
    }
}

/// A request that is not answered yet.
#[derive(Debug, Clone)]
pub struct Outstanding {
    /// What was asked.
    pub ask: Ask,
    /// Who asked.
    pub by: Requester,
    /// How that is told.
    pub told: String,
}

/// What a name raised by a coordinator means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Meaning {
    /// A request to the configurator.
    Request(Ask),
    /// An event that leaves the deployment.
    Emitted(EventName),
    /// `X.undo` of a configuration that does not exist.
    UnknownUndo(EventName),
    /// Neither.
    Unknown(EventName),
}

impl Hub {
    /// The memory of a session that has not begun.
    pub fn new(
        clock: &Clock,
        configurations: impl IntoIterator<Item = ConfigId>,
        emits: impl IntoIterator<Item = EventName>,
    ) -> Self {
        Self {
            clock: clock.clone(),
            real: Clock::real(),
            state: Mutex::new(HubState {
                phase: Phase::Down,
                broken: false,
                next: 1,
                outstanding: FxHashMap::default(),
                faults: Vec::new(),
                log: Log::default(),
                taken: UnwrittenEvent::room(),
                observers: Vec::new(),
                taps: Vec::new(),
                heard: Lanes::new(limits::HEARD, limits::HEARD),
                dropped: 0,
                dropped_told: None,
                tickets: FxHashMap::default(),
                answers: VecDeque::new(),
                active: BTreeMap::new(),
                epoch: 0,
            }),
            untold: AtomicBool::new(false),
            changed: clock.signal(),
            unwritten: Mutex::new(UnwrittenEvent::room()),
            raised: clock.signal(),
            is_written: AtomicBool::new(false),
            outside: Condvar::new(),
            configurations: configurations.into_iter().collect(),
            emits: emits.into_iter().collect(),
            unlisted: Unlisted::default(),
            halt: StoppingState::default(),
        }
    }

    /// With the events that make it safe, and what is applied then, when no coordinator hears them any more.
    #[must_use]
    pub fn with_safety(self, events: impl IntoIterator<Item = EventName>, safe: Vec<ConfigId>) -> Self {
        Self { halt: StoppingState::new(events, safe), ..self }
    }

    /// Whether an event is one of safety, of the deployment or of a subsystem.
    pub fn is_safety(&self, event: EventName) -> bool {
        self.halt.is_safety(event)
    }

    /// How far stopping is.
    pub(super) fn halt(&self) -> &StoppingState {
        &self.halt
    }

    /// Whether stopping has begun.
    pub fn is_stopping(&self) -> bool {
        self.halt.has_begun()
    }

    /// With all written down that there is: whoever looks sees what happened before. It may be an observer that looks, so none is
    /// waited for.
    fn lock(&self) -> MutexGuard<'_, HubState> {
        if !lock(&self.unwritten).is_empty() {
            self.catch_up(None, |_| true);
        }
        self.state()
    }

    pub(super) fn state(&self) -> MutexGuard<'_, HubState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What a raised name means (semantics: *Coordinators*): a request if it is a configuration's ID or ends in `.undo` (or is `undo`);
    /// else an event that the deployment declares as emitted; else nothing, which `check` refuses.
    pub fn meaning(&self, name: EventName) -> Meaning {
        match Raise::of(name, |id| self.configurations.contains(&id)) {
            Raise::Request(ask) => Meaning::Request(ask),
            Raise::UnknownUndo => Meaning::UnknownUndo(name),
            Raise::Event if self.emits.contains(&name) => Meaning::Emitted(name),
            Raise::Event => Meaning::Unknown(name),
        }
    }

    /// Counts an event that was lost since its coordinator's inbox is full. That is told at once, and what comes after it at
    /// most once in [`limits::DROPS_TOLD`], with the next event that comes then.
    pub fn taken(&self, taken: Result<Put, NotAccepted>) {
        let full = matches!(taken, Err(NotAccepted::Full) | Ok(Put::Displaced));
        if !full && !self.untold.load(Ordering::Relaxed) {
            return;
        }
        let now = self.clock.now();
        let events = {
            let mut state = self.state();
            state.dropped += u64::from(full);
            let soon = state.dropped_told.is_some_and(|told| now < told + limits::DROPS_TOLD);
            self.untold.store(soon && state.dropped > 0, Ordering::Relaxed);
            if soon || state.dropped == 0 {
                return;
            }
            state.dropped_told = Some(now);
            std::mem::take(&mut state.dropped)
        };
        self.note(Happening::Dropped { events });
    }

    /// A number for an event that so many coordinators are given, to be asked with [`Hub::was_heard`] what became of it.
    pub fn ticket(&self, coordinators: usize) -> u64 {
        let mut state = self.lock();
        let ticket = state.next;
        state.next += 1;
        state.tickets.insert(ticket, (coordinators, Vec::new()));
        ticket
    }

    /// A coordinator took such an event up (or cannot), and a transition of it `heard` it, or none did.
    pub fn taken_up(&self, ticket: u64, heard: Option<Requester>) {
        if let Some((left, all)) = self.lock().tickets.get_mut(&ticket) {
            *left = left.saturating_sub(1);
            all.extend(heard);
        }
        self.outside.notify_all();
    }

    /// Whether a transition heard it, once all have taken it up.
    pub fn was_heard(&self, ticket: u64) -> Option<bool> {
        self.who_heard(ticket).map(|heard| !heard.is_empty())
    }

    /// The coordinators of which a transition heard it, once all have taken it up.
    pub fn who_heard(&self, ticket: u64) -> Option<Vec<Requester>> {
        self.lock().tickets.get(&ticket).filter(|(left, _)| *left == 0).map(|(_, heard)| heard.clone())
    }

    /// Nobody wants to know any more.
    pub fn forget(&self, ticket: u64) {
        self.lock().tickets.remove(&ticket);
    }

    /// From now on everything that happens is told to `observer`.
    pub fn observe(&self, observer: Observer) {
        self.lock().observers.push(observer);
    }

    /// From now on everything that happens is handed to `tap`.
    pub fn attach(&self, tap: Arc<dyn LogSink>) {
        self.lock().taps.push(tap);
    }

    /// A new request of `by`, told as `told`.
    pub fn request(&self, ask: Ask, by: Requester, told: &str) -> RequestId {
        let id = self.number();
        self.requested(id, ask, by, told.to_owned());
        id
    }

    /// A number for a request that comes at once.
    pub fn number(&self) -> RequestId {
        let mut state = self.lock();
        state.next += 1;
        RequestId(state.next - 1)
    }

    /// A request of that number is made.
    pub fn requested(&self, id: RequestId, ask: Ask, by: Requester, told: String) {
        let outstanding = Outstanding { ask, by, told: told.clone() };
        self.lock().outstanding.insert(id, outstanding);
        self.note(Happening::Requested { request: Some(id.0), ask: ask.to_string(), by: told });
    }

    /// Whether one of these is asked for, and not answered.
    pub fn asks_for(&self, is: impl Fn(&Outstanding) -> bool) -> bool {
        self.lock().outstanding.values().any(is)
    }

    /// Whether one of these is to be applied, and that not answered.
    pub fn applies(&self, is: impl Fn(ConfigId) -> bool) -> bool {
        self.asks_for(|of| matches!(of.ask, Ask::Apply(id) if is(id)))
    }

    /// A request was answered. It stays outstanding until it is [settled](Self::settled), when whoever asked has been told.
    pub fn answered(&self, answered: LoggedAnswer) {
        {
            let mut state = self.lock();
            if state.answers.len() == limits::HEARD {
                state.answers.pop_front();
            }
            state.answers.push_back(answered.clone());
        }
        self.note(Happening::Answered(answered));
    }

    /// The answer to a request has been delivered.
    pub fn settled(&self, request: RequestId) {
        {
            let mut state = self.lock();
            state.outstanding.remove(&request);
            state.epoch += 1;
        }
        self.wake();
    }

    /// Lets everybody who waits look again.
    pub fn wake(&self) {
        self.changed.notify();
        self.outside.notify_all();
    }

    /// A component failed, or its call does not return.
    pub fn fault(&self, component: &str, reason: &str) {
        let at = self.clock.now().as_secs_f64();
        {
            let mut state = self.lock();
            state.faults.retain(|f| f.component != component);
            state.faults.push(ComponentFault { component: component.to_owned(), reason: reason.to_owned(), at });
        }
        self.note(Happening::Fault { component: component.to_owned(), reason: reason.to_owned() });
    }

    /// A component is well again, or gone.
    pub fn clear_fault(&self, component: &str) {
        self.lock().faults.retain(|f| f.component != component);
    }

    /// The session's time.
    pub fn now(&self) -> Time {
        self.clock.now()
    }

    /// Counts what was noted: between two looks with the same count nothing happened.
    pub fn epoch(&self) -> u64 {
        self.lock().epoch
    }

    /// Why requests failed, one line each, after the `since`-th thing heard.
    pub fn failures_since(&self, since: u64) -> Vec<String> {
        let state = self.lock();
        state
            .answers
            .iter()
            .filter(|a| !a.ok && state.heard.iter().any(|(number, text)| number > since && *text == a.answer))
            .flat_map(|a| a.reasons.iter().map(move |reason| format!("{}: {reason}", a.answer)))
            .collect()
    }

    /// The phase: what is up and has something broken is *broken*.
    pub fn phase(&self) -> Phase {
        self.lock().phase()
    }

    /// Sets the phase. That it is up is told also where something is broken then.
    pub fn set_phase(&self, phase: Phase) {
        let mut state = self.lock();
        let was = state.phase();
        state.phase = phase;
        let now = state.phase();
        drop(state);
        let changed = [phase, now].into_iter().skip(usize::from(phase == now)).filter(|phase| *phase != was);
        changed.for_each(|phase| self.note(Happening::Phase { phase }));
    }

    /// Something is broken now, or nothing any more.
    pub fn broken(&self, broken: bool) {
        let mut state = self.lock();
        let was = state.phase();
        state.broken = broken;
        let phase = state.phase();
        drop(state);
        if phase != was {
            self.note(Happening::Phase { phase });
        }
    }

    /// Requests not answered yet, oldest first.
    pub fn outstanding(&self) -> Vec<String> {
        let state = self.lock();
        let mut list: Vec<_> = state.outstanding.iter().collect();
        list.sort_by_key(|(id, _)| **id);
        list.into_iter().map(|(_, o)| format!("{} by {}", o.ask, o.told)).collect()
    }

    /// Whether this is asked for and not answered.
    pub fn is_outstanding(&self, ask: Ask) -> bool {
        self.asks_for(|of| of.ask == ask)
    }

    /// Whether every request raised so far has been answered.
    pub fn all_answered(&self) -> bool {
        self.lock().outstanding.is_empty()
    }

    /// Whether every request that was made under that name has been answered.
    pub fn has_answered(&self, by: Requester) -> bool {
        !self.asks_for(|of| of.by == by)
    }

    /// What is wrong.
    pub fn faults(&self) -> Vec<ComponentFault> {
        self.lock().faults.clone()
    }

    /// The newest entries of the log, oldest first.
    pub fn log(&self, last: usize) -> Vec<Arc<LogEntry>> {
        self.lock().log.last(last)
    }

    /// The whole log, oldest first; and how many entries it no longer has, with the time of the newest of these.
    pub fn whole_log(&self) -> (Vec<Arc<LogEntry>>, Option<(u64, f64)>) {
        let state = self.lock();
        (state.log.last(limits::LOG_ENTRIES), state.log.displaced())
    }

    /// The active states, root to leaf, as last published; of several coordinators those of each, with its name before
    /// (`arm:root.on`).
    pub fn active(&self) -> Vec<String> {
        self.lock().active.values().flatten().cloned().collect()
    }

    /// Where the coordinators are: the innermost active state of each, for a sentence.
    pub fn whereabouts(&self) -> String {
        let state = self.lock();
        let leaves: Vec<String> =
            state.active.values().filter_map(|a| a.last()).map(|leaf| format!("`{leaf}`")).collect();
        match leaves[..] {
            [] => "the coordinator is in `no state`".to_owned(),
            [ref leaf] => format!("the coordinator is in {leaf}"),
            [ref before @ .., ref last] => format!("the coordinators are in {} and {last}", before.join(", ")),
        }
    }

    /// How many events and answers were heard so far: where a wait for the next one begins.
    pub fn heard(&self) -> u64 {
        self.lock().heard.count()
    }

    /// Which of these was heard first after the `since`-th.
    pub fn first_heard(&self, events: &[String], since: u64) -> Option<String> {
        let state = self.lock();
        let mut news = state.heard.iter().filter(|(number, text)| *number > since && events.contains(text));
        news.next().map(|(_, event)| event.clone())
    }

    /// Whether `event` was heard after the `since`-th, leaving out those of some numbers; answers its number.
    pub fn heard_but(&self, event: &str, since: u64, but: &[u64]) -> Option<u64> {
        let state = self.lock();
        let mut news = state.heard.iter().filter(|(number, text)| *number > since && *text == event);
        news.find(|(number, _)| !but.contains(number)).map(|(number, _)| number)
    }

    /// The answer to a request, if it has come (and is not long ago).
    pub fn answer(&self, request: RequestId) -> Option<LoggedAnswer> {
        self.lock().answers.iter().rev().find(|a| a.request == request.0).cloned()
    }

    /// Waits, outside the clock and in real time, until `look` finds something; for threads that are no participants.
    pub fn wait_outside<T>(&self, limit: Duration, look: impl Fn(&Self) -> Option<T>) -> Option<T> {
        // Real time, since whoever waits is a client in the real world.
        let deadline = self.real.now() + limit;
        loop {
            if let Some(found) = look(self) {
                return Some(found);
            }
            let left = deadline.since(self.real.now());
            if left.is_zero() {
                return None;
            }
            // Something may have happened since the look, and `look` may see what nobody tells (a client that is gone).
            let step = left.min(limits::SOCKET_LOOK);
            drop(self.outside.wait_timeout(self.lock(), step).unwrap_or_else(PoisonError::into_inner));
        }
    }
}
