//! Where coordinator, configurator and platform meet: names raised become requests or emitted events, answers become
//! events, and everything is written down on the way.
//!
//! All of it is called from the threads of others and never waits for anything but short locks of its own.

use super::lanes::Lanes;
use super::log::{Answered, Fault, Happening, Log, Phase};
use crate::coordinator::Refused;
use crate::limits;
use crate::model::{Ask, ConfigId, EventName, Raise, RequestId};
use crate::time::{Clock, Signal, Time};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Called with everything that happens, in order; must not block.
pub type Observer = Arc<dyn Fn(Time, &Happening) + Send + Sync>;

/// The common memory of one session.
pub struct Hub {
    clock: Clock,
    state: Mutex<State>,
    /// Whether events were dropped that nobody was told of.
    untold: AtomicBool,
    /// Wakes whoever drives the session.
    pub changed: Signal,
    /// Wakes threads outside the clock (those of the control socket).
    outside: Condvar,
    configurations: FxHashSet<ConfigId>,
    emits: FxHashSet<EventName>,
}

struct State {
    phase: Phase,
    next: u64,
    outstanding: FxHashMap<RequestId, Outstanding>,
    faults: Vec<Fault>,
    log: Log,
    observers: Vec<Observer>,
    /// The newest answers and events, for those who wait for one.
    heard: Lanes<String>,
    /// Events that found an inbox full since that was last told, and when it was.
    dropped: u64,
    dropped_told: Option<Time>,
    /// The newest answers.
    answers: VecDeque<Answered>,
    /// By coordinator: what its states are written with (`arm:`, or nothing), and its active ones.
    active: BTreeMap<String, Vec<String>>,
    epoch: u64,
}

/// A request that is not answered yet.
#[derive(Debug, Clone)]
pub struct Outstanding {
    /// What was asked.
    pub ask: Ask,
    /// Who asked.
    pub by: String,
    /// When.
    pub at: Time,
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
            state: Mutex::new(State {
                phase: Phase::Down,
                next: 1,
                outstanding: FxHashMap::default(),
                faults: Vec::new(),
                log: Log::default(),
                observers: Vec::new(),
                heard: Lanes::new(limits::HEARD, limits::HEARD),
                dropped: 0,
                dropped_told: None,
                answers: VecDeque::new(),
                active: BTreeMap::new(),
                epoch: 0,
            }),
            untold: AtomicBool::new(false),
            changed: clock.signal(),
            outside: Condvar::new(),
            configurations: configurations.into_iter().collect(),
            emits: emits.into_iter().collect(),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What a raised name means (design §7): a request if it is a configuration's ID or ends in `.undo` (or is `undo`);
    /// else an event that the deployment declares as emitted; else nothing, which `check` refuses.
    pub fn meaning(&self, name: EventName) -> Meaning {
        match Raise::of(name, |id| self.configurations.contains(&id)) {
            Raise::Request(ask) => Meaning::Request(ask),
            Raise::UnknownUndo => Meaning::UnknownUndo(name),
            Raise::Event if self.emits.contains(&name) => Meaning::Emitted(name),
            Raise::Event => Meaning::Unknown(name),
        }
    }

    /// Writes down that something happened, and tells the observers.
    pub fn note(&self, what: Happening) {
        self.record(what, false);
    }

    /// The same, of an event that a component raised by itself: however many there are, they displace only each other.
    pub fn report(&self, what: Happening) {
        self.record(what, true);
    }

    /// Counts an event that found its coordinator's inbox full. That is told at once, and what comes after it at most once
    /// in [`limits::DROPS_TOLD`], with the next event that comes then.
    pub fn taken(&self, taken: Result<(), Refused>) {
        let full = taken == Err(Refused::Full);
        if !full && !self.untold.load(Ordering::Relaxed) {
            return;
        }
        let now = self.clock.now();
        let events = {
            let mut state = self.lock();
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

    fn record(&self, what: Happening, is_report: bool) {
        let now = self.clock.now();
        let observers = {
            let mut state = self.lock();
            let heard = match &what {
                Happening::Event { event, .. }
                | Happening::Emitted { event }
                | Happening::Lost { event, .. }
                | Happening::Stale { event } => Some(event.clone()),
                Happening::Answered(answered) => Some(answered.answer.clone()),
                Happening::State { active } => {
                    let of = active.first().and_then(|root| root.split_once(':')).map_or("", |(name, _)| name);
                    state.active.insert(of.to_owned(), active.clone());
                    None
                }
                _ => None,
            };
            if let Some(event) = heard {
                state.heard.push(event, is_report);
            }
            state.epoch += 1;
            state.log.push(now, what.clone(), is_report);
            state.observers.clone()
        };
        for observer in observers {
            observer(now, &what);
        }
        self.wake();
    }

    /// From now on everything that happens is told to `observer`.
    pub fn observe(&self, observer: Observer) {
        self.lock().observers.push(observer);
    }

    /// A new request of `by`.
    pub fn request(&self, ask: Ask, by: &str) -> RequestId {
        let id = {
            let mut state = self.lock();
            let id = RequestId(state.next);
            state.next += 1;
            state.outstanding.insert(id, Outstanding { ask, by: by.to_owned(), at: self.clock.now() });
            id
        };
        self.note(Happening::Requested { request: Some(id.0), ask: ask.to_string(), by: by.to_owned() });
        id
    }

    /// A request was answered. It stays outstanding until it is [settled](Self::settled), when whoever asked has been told.
    pub fn answered(&self, answered: Answered) {
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
            state.faults.push(Fault { component: component.to_owned(), reason: reason.to_owned(), at });
        }
        self.note(Happening::Fault { component: component.to_owned(), reason: reason.to_owned() });
    }

    /// A component is well again, or gone.
    pub fn clear_fault(&self, component: &str) {
        self.lock().faults.retain(|f| f.component != component);
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

    /// The phase.
    pub fn phase(&self) -> Phase {
        self.lock().phase
    }

    /// Sets the phase.
    pub fn set_phase(&self, phase: Phase) {
        let was = std::mem::replace(&mut self.lock().phase, phase);
        if was != phase {
            self.note(Happening::Phase { phase });
        }
    }

    /// Requests not answered yet, oldest first.
    pub fn outstanding(&self) -> Vec<String> {
        let state = self.lock();
        let mut list: Vec<_> = state.outstanding.iter().collect();
        list.sort_by_key(|(id, _)| **id);
        list.into_iter().map(|(_, o)| format!("{} by {}", o.ask, o.by)).collect()
    }

    /// Whether every request raised so far has been answered.
    pub fn all_answered(&self) -> bool {
        self.lock().outstanding.is_empty()
    }

    /// What is wrong.
    pub fn faults(&self) -> Vec<Fault> {
        self.lock().faults.clone()
    }

    /// The newest entries of the log, oldest first.
    pub fn log(&self, last: usize) -> Vec<super::log::Entry> {
        self.lock().log.last(last)
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
            _ => format!("the coordinators are in {}", leaves.join(" and ")),
        }
    }

    /// How many events and answers were heard so far: where a wait for the next one begins.
    pub fn heard(&self) -> u64 {
        self.lock().heard.count()
    }

    /// Whether `event` was heard after the `since`-th; answers its number.
    pub fn heard_since(&self, event: &str, since: u64) -> Option<u64> {
        self.heard_but(event, since, &[])
    }

    /// The same, leaving out those of some numbers.
    pub fn heard_but(&self, event: &str, since: u64, but: &[u64]) -> Option<u64> {
        let state = self.lock();
        let mut news = state.heard.iter().filter(|(number, text)| *number > since && *text == event);
        news.find(|(number, _)| !but.contains(number)).map(|(number, _)| number)
    }

    /// The answer to a request, if it has come (and is not long ago).
    pub fn answer(&self, request: RequestId) -> Option<Answered> {
        self.lock().answers.iter().rev().find(|a| a.request == request.0).cloned()
    }

    /// Waits, outside the clock and in real time, until `look` finds something; for threads that are no participants.
    pub fn wait_outside<T>(&self, limit: Duration, look: impl Fn(&Self) -> Option<T>) -> Option<T> {
        // Real time, since whoever waits is a client in the real world; a condition variable keeps the deadline for us.
        let mut left = limit;
        let step = Duration::from_millis(100).min(limit);
        loop {
            if let Some(found) = look(self) {
                return Some(found);
            }
            if left.is_zero() {
                return None;
            }
            let state = self.lock();
            let (_state, result) =
                self.outside.wait_timeout(state, step.min(left)).unwrap_or_else(PoisonError::into_inner);
            // A wake-up in between is counted as no time at all: the limit is a bound from below, of idle time.
            if result.timed_out() {
                left = left.saturating_sub(step);
            }
        }
    }
}
