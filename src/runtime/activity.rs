//! Activities: what updates components, in a thread each, or as a task of the simulated clock.
//!
//! An activity shares with the configurator atomic words, a signal, a queue of operations and the latest list of its
//! components, and no lock.

use super::call::{Reply, Responder};
use super::cell::{Cell, CellGuard, CellRequest};
use super::gate::Closed;
use super::latest::Reader;
use crate::limits;
use crate::model::monitor::Counter;
use crate::model::{Activity as Spec, ActivityStatus, ComponentName, Ident, RunState};
use crate::time::{Clock, Receiver, Signal, TaskWait, Time};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The components of an activity, in the order in which they are updated.
pub(crate) type Schedule = Arc<[Arc<Cell>]>;

/// An operation to be run in the activity's thread.
pub(crate) struct OperationJob {
    pub(crate) cell: Arc<Cell>,
    pub(crate) asked: CellRequest,
    pub(crate) call: Responder,
    /// It does not wait until a call that was given up has come to rest.
    pub(crate) safe: bool,
}

/// Counters of an activity. All times in nanoseconds.
#[derive(Default)]
struct Counters {
    cycles: AtomicU64,
    overruns: AtomicU64,
    latency_last: AtomicU64,
    latency_max: AtomicU64,
    duration_last: AtomicU64,
    duration_max: AtomicU64,
}

/// Adds to a counter that the activity alone counts: whoever reads it meanwhile has it before or after, and an exchange, which would cost
/// more than what is counted, is not needed.
fn count(counter: &AtomicU64, more: u64) {
    counter.store(counter.load(Ordering::Relaxed) + more, Ordering::Relaxed);
}

/// The same of what is noted last, and of the largest of them.
fn note(last: &AtomicU64, largest: &AtomicU64, value: u64) {
    last.store(value, Ordering::Relaxed);
    if value > largest.load(Ordering::Relaxed) {
        largest.store(value, Ordering::Relaxed);
    }
}

/// What is done with a component that was put in quarantine and has come back.
pub(crate) type LateCall = Box<dyn Fn(&Arc<Cell>) + Send + Sync>;

pub(crate) struct ActivityThread {
    pub(crate) name: Ident,
    spec: Spec,
    clock: Clock,
    pub(crate) signal: Signal,
    /// Components that run.
    pub(crate) running: AtomicUsize,
    /// The thread waits for a component that runs.
    parked: AtomicBool,
    ended: AtomicBool,
    /// Since when the present round lasts; `NEVER`: no round.
    busy_since: AtomicU64,
    counters: Counters,
    complaint: Mutex<Option<String>>,
    late: LateCall,
}

/// What an activity keeps from one step to the next.
pub(crate) struct Rounds {
    schedule: Reader<Schedule>,
    requests: Receiver<OperationJob>,
    /// Operations that wait until their component has come to rest.
    held: VecDeque<OperationJob>,
    /// When the next round is due.
    release: Time,
    begun: bool,
    /// Nothing ran the last time it looked.
    idle: bool,
    /// Rounds in succession in which something was updated, of an event-driven activity.
    restless: u32,
}

impl Rounds {
    pub(crate) fn new(schedule: Reader<Schedule>, requests: Receiver<OperationJob>) -> Self {
        let held = VecDeque::new();
        Self { schedule, requests, held, release: Time::default(), begun: false, idle: true, restless: 0 }
    }
}

impl ActivityThread {
    pub(crate) fn new(name: Ident, spec: Spec, clock: &Clock, late: LateCall) -> Self {
        Self {
            name,
            spec,
            clock: clock.clone(),
            signal: clock.signal(),
            running: AtomicUsize::new(0),
            parked: AtomicBool::new(false),
            ended: AtomicBool::new(false),
            busy_since: AtomicU64::new(Time::NEVER.0),
            counters: Counters::default(),
            complaint: Mutex::new(None),
            late,
        }
    }

    pub(crate) fn is_event_driven(&self) -> bool {
        self.spec.period.is_none()
    }

    /// A component has begun to run.
    pub(crate) fn started(&self, cell: &Cell) {
        self.running.fetch_add(1, Ordering::SeqCst);
        if self.is_event_driven() {
            cell.beat.poke();
        } else if self.parked.load(Ordering::SeqCst) {
            self.signal.notify();
        }
    }

    /// A component runs no longer.
    pub(crate) fn stopped(&self, cell: &Cell) {
        self.running.fetch_sub(1, Ordering::SeqCst);
        if cell.beat.restless.load(Ordering::Acquire) > 0 {
            // It is at rest now: what was kept back goes on.
            self.signal.notify();
        }
    }

    /// The thread is to end.
    pub(crate) fn end(&self) {
        self.ended.store(true, Ordering::SeqCst);
        self.signal.notify();
    }

    /// The component that is being called now, if the round has lasted too long.
    pub(crate) fn stuck<'a>(&self, mut members: impl Iterator<Item = &'a Arc<Cell>>) -> Option<ComponentName> {
        let since = self.busy_since.load(Ordering::Acquire);
        (since != Time::NEVER.0 && self.clock.now().since(Time(since)) >= limits::ACTIVITY_STUCK)
            .then(|| members.find(|cell| cell.gate.is_busy()).map(|cell| cell.name))
            .flatten()
    }

    pub(crate) fn status<'a>(&self, members: impl Iterator<Item = &'a Arc<Cell>> + Clone) -> ActivityStatus {
        let nanos = |counter: &AtomicU64| Duration::from_nanos(counter.load(Ordering::Relaxed));
        ActivityStatus {
            name: self.name,
            period: self.spec.period,
            components: members.clone().count(),
            running: self.running.load(Ordering::Relaxed),
            cycles: self.counters.cycles.load(Ordering::Relaxed),
            overruns: self.counters.overruns.load(Ordering::Relaxed),
            latency_last: nanos(&self.counters.latency_last),
            latency_max: nanos(&self.counters.latency_max),
            duration_last: nanos(&self.counters.duration_last),
            duration_max: nanos(&self.counters.duration_max),
            stuck: self.stuck(members),
            complaint: crate::time::lock(&self.complaint).clone(),
        }
    }

    /// A counter as a number: rounds, or seconds.
    #[allow(clippy::cast_precision_loss)]
    pub(crate) fn counter(&self, counter: Counter) -> f64 {
        let (word, unit) = match counter {
            Counter::Cycles => (&self.counters.cycles, 1.0),
            Counter::Overruns => (&self.counters.overruns, 1.0),
            Counter::Latency => (&self.counters.latency_last, 1e-9),
            Counter::Duration => (&self.counters.duration_last, 1e-9),
        };
        word.load(Ordering::Relaxed) as f64 * unit
    }

    /// Serves what is asked; while nothing runs, or when it is to end, answers what to wait for.
    fn attend(&self, rounds: &mut Rounds) -> Option<TaskWait> {
        // Nobody else marks it.
        if self.parked.load(Ordering::Relaxed) {
            self.parked.store(false, Ordering::SeqCst);
        }
        if self.ended.load(Ordering::SeqCst) {
            return Some(TaskWait::End);
        }
        self.take_up(&mut rounds.held);
        while let Ok(request) = rounds.requests.try_recv() {
            self.admit(request, &mut rounds.held);
        }
        if self.running.load(Ordering::SeqCst) > 0 {
            return None;
        }
        rounds.idle = true;
        self.parked.store(true, Ordering::SeqCst);
        // Whoever starts a component sees the mark, or is seen here.
        (self.running.load(Ordering::SeqCst) == 0).then_some(TaskWait::Wait(Time::NEVER))
    }

    /// What it does when it is its turn: what is asked, and a round when one is due.
    pub(crate) fn step(&self, rounds: &mut Rounds) -> TaskWait {
        if !rounds.begun {
            rounds.begun = true;
            rounds.release = self.clock.now();
            if !self.clock.is_simulated() {
                *crate::time::lock(&self.complaint) = super::realtime::apply(self.spec.priority, self.spec.cpu);
            }
        }
        match self.spec.period {
            Some(period) => self.step_periodic(period.max(limits::SHORTEST_PERIOD), rounds),
            None => self.step_on_events(rounds),
        }
    }

    fn step_periodic(&self, period: Duration, rounds: &mut Rounds) -> TaskWait {
        let step = u64::try_from(period.as_nanos()).unwrap_or(u64::MAX);
        loop {
            if let Some(next) = self.attend(rounds) {
                return next;
            }
            let now = self.clock.now();
            if std::mem::take(&mut rounds.idle) {
                rounds.release = rounds.release.max(now);
            }
            let mut release = rounds.release;
            if now < release {
                return TaskWait::Wait(release);
            }
            let late = now.since(release);
            if late >= period {
                // An operation took long, or the thread came late: what is past is missed but for the newest, so that no two rounds come at once.
                let missed = (now.0 - release.0) / step;
                count(&self.counters.overruns, missed);
                release = Time(release.0.saturating_add(missed.saturating_mul(step)));
            }
            note(&self.counters.latency_last, &self.counters.latency_max, nanos(late));
            self.round(now, &mut rounds.schedule, |cell| {
                if let Some(inside) = CellGuard::running(cell) {
                    self.update(cell, inside, now, release, period.as_secs_f64());
                }
            });
            rounds.release = Time(release.0.saturating_add(step));
            let now = self.clock.now();
            if now > rounds.release {
                // The releases that are past are missed; the phase is kept.
                let missed = (now.0 - rounds.release.0).div_ceil(step);
                count(&self.counters.overruns, missed);
                rounds.release = Time(rounds.release.0.saturating_add(missed.saturating_mul(step)));
            }
        }
    }

    fn step_on_events(&self, rounds: &mut Rounds) -> TaskWait {
        loop {
            if let Some(next) = self.attend(rounds) {
                return next;
            }
            let now = self.clock.now();
            let (mut any, mut next) = (false, Time::NEVER);
            self.round(now, &mut rounds.schedule, |cell| {
                let wake_at = Time(cell.beat.wake_at.load(Ordering::Relaxed));
                let pending = cell.beat.pending.load(Ordering::Acquire);
                if !pending && wake_at > now {
                    next = next.min(wake_at);
                } else if let Some(inside) = CellGuard::running(cell) {
                    any = true;
                    // An exchange, not a store: what was written before the last poke must be seen by this update, and a
                    // poke after it must stay.
                    cell.beat.pending.swap(false, Ordering::AcqRel);
                    if wake_at <= now {
                        cell.beat.wake_at.store(Time::NEVER.0, Ordering::Relaxed);
                    }
                    self.update(cell, inside, now, now, 0.0);
                }
            });
            if !any {
                rounds.restless = 0;
                return TaskWait::Wait(next);
            }
            if rounds.restless >= limits::EVENT_ROUNDS {
                // A loop of components that wake each other would hold simulated time still and a CPU busy for ever.
                rounds.restless = 0;
                count(&self.counters.overruns, 1);
                return TaskWait::Pause(self.clock.now() + limits::EVENT_PAUSE);
            }
            rounds.restless += 1;
        }
    }

    fn round(&self, now: Time, schedule: &mut Reader<Schedule>, mut visit: impl FnMut(&Arc<Cell>)) {
        self.busy_since.store(now.0, Ordering::Release);
        schedule.update();
        for cell in schedule.value().iter() {
            visit(cell);
        }
        self.busy_since.store(Time::NEVER.0, Ordering::Release);
        let took = nanos(self.clock.now().since(now));
        count(&self.counters.cycles, 1);
        note(&self.counters.duration_last, &self.counters.duration_max, took);
    }

    #[inline]
    fn update(&self, cell: &Arc<Cell>, mut inside: CellGuard<'_>, now: Time, release: Time, period: f64) {
        let fault = inside.update(&self.clock, now, release, period).err();
        self.leave(cell, inside, fault);
    }

    /// Serves a request, or keeps it back: until its component has come to rest from a call that was given up, it begins no
    /// other; and requests of one component keep their order.
    fn admit(&self, request: OperationJob, held: &mut VecDeque<OperationJob>) {
        let waits = !request.safe
            && (request.cell.is_restless() || held.iter().any(|other| Arc::ptr_eq(&other.cell, &request.cell)));
        if !waits {
            self.serve(request);
        } else if held.len() < limits::ACTIVITY_REQUESTS {
            held.push_back(request);
        } else {
            request.call.0.answer(Reply::Refused(format!("too many operations wait for the activity `{}`", self.name)));
        }
    }

    /// What was kept back and may be served now.
    fn take_up(&self, held: &mut VecDeque<OperationJob>) {
        if held.is_empty() {
            return;
        }
        for request in std::mem::take(held) {
            if !request.call.0.is_withdrawn() {
                self.admit(request, held);
            }
        }
    }

    fn serve(&self, request: OperationJob) {
        let OperationJob { cell, asked, call, safe } = request;
        let progress = call.0.clone();
        if !progress.begin() {
            return;
        }
        self.busy_since.store(self.clock.now().0, Ordering::Release);
        match CellGuard::for_operation(&*cell, safe) {
            Ok(mut inside) => {
                let mut ended = inside.operation(&self.clock, &asked, call);
                progress.returned();
                self.leave(&cell, inside, ended.fault.take());
                ended.answer();
            }
            Err(closed) => {
                let text = match closed {
                    Closed::Quarantined => "the component is in quarantine",
                    _ => "another call is under way",
                };
                progress.answer(Reply::Refused(text.to_owned()));
            }
        }
        self.busy_since.store(Time::NEVER.0, Ordering::Release);
    }

    #[inline]
    fn leave(&self, cell: &Arc<Cell>, inside: CellGuard<'_>, fault: Option<String>) {
        let left = inside.leave(fault.is_some().then_some(RunState::Faulted));
        if left.ended_running {
            self.stopped(cell);
        }
        if let Some(reason) = fault {
            cell.beat.faulted(reason, self.clock.now());
        }
        if left.quarantined {
            (self.late)(cell);
        }
    }
}

fn nanos(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}
