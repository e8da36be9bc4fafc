//! The scheduler of simulated time: one token, handed round in a fixed order.
//!
//! One mutex guards everything; every participant waits on a condition variable of its own, so that a hand-over wakes
//! exactly one thread. Locks are taken in the order *channel, then scheduler*, never the reverse.

use super::{Time, lock};
use rustc_hash::FxHashMap;
use std::cell::RefCell;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A participant. Numbers only grow, so they are also the order among those who wait for the same moment.
type Id = u64;

/// One wait of one participant; a later wait of the same participant has another number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct WaitUntil {
    id: Id,
    number: u64,
}

impl WaitUntil {
    pub(super) fn is_of(self, id: u64) -> bool {
        self.id == id
    }
}

/// The scheduler of one simulated clock.
pub(super) struct Scheduler {
    /// Which clock it is, in the thread-local list of memberships.
    clock: u64,
    pace: Option<Pace>,
    now: AtomicU64,
    state: Mutex<SchedulerState>,
}

struct Pace {
    factor: f64,
    start: Instant,
}

#[derive(Default)]
struct SchedulerState {
    next_id: Id,
    next_wait: u64,
    participants: FxHashMap<Id, Participant>,
    /// Who holds the token. Nobody: all wait for a moment that pacing has not reached, or for the outside.
    running: Option<Id>,
    ready: VecDeque<Id>,
    /// Moments waited for; entries of waits that have ended otherwise stay until they come up.
    timers: BinaryHeap<Reverse<(Time, Id, u64)>>,
    /// Moments for which alone time does not move on; at most one of each participant, and of few.
    idle: Vec<(Time, Id, u64)>,
    hung: Vec<WaitUntil>,
    shut: bool,
    /// Who watches real time, when paced.
    pacer: Option<Id>,
    hand_overs: u64,
}

struct Participant {
    turn: Arc<Condvar>,
    /// The wait it is in; none: ready or running.
    wait: Option<u64>,
}

thread_local! {
    /// Which participants of which clocks this thread is.
    static MEMBER: RefCell<Vec<(u64, Id)>> = const { RefCell::new(Vec::new()) };
}

static CLOCKS: AtomicU64 = AtomicU64::new(0);

impl Scheduler {
    pub(super) fn new(factor: Option<f64>) -> Self {
        Self {
            clock: CLOCKS.fetch_add(1, Ordering::Relaxed),
            pace: factor.map(|factor| Pace { factor, start: Instant::now() }),
            now: AtomicU64::new(0),
            state: Mutex::new(SchedulerState::default()),
        }
    }

    pub(super) fn now(&self) -> Time {
        if self.pace.is_some() {
            let state = lock(&self.state);
            self.catch_up(&state);
        }
        Time(self.now.load(Ordering::Acquire))
    }

    pub(super) fn hand_overs(&self) -> u64 {
        lock(&self.state).hand_overs
    }

    /// The number of the calling thread among the participants.
    fn me(&self) -> Option<Id> {
        MEMBER.with_borrow(|list| list.iter().find(|(clock, _)| *clock == self.clock).map(|(_, id)| *id))
    }

    /// A new participant, ready; its thread will call [`Scheduler::begin`].
    pub(super) fn register(&self) -> Id {
        let mut state = lock(&self.state);
        self.catch_up(&state);
        let id = state.add();
        state.ready.push_back(id);
        self.dispatch(&mut state, None);
        id
    }

    /// Takes back a registration whose thread never came up.
    pub(super) fn withdraw(&self, id: Id) {
        let mut state = lock(&self.state);
        state.participants.remove(&id);
        state.ready.retain(|ready| *ready != id);
        if state.running == Some(id) {
            state.running = None;
            self.dispatch(&mut state, None);
        }
    }

    /// The calling thread is participant `id` from now on; waits for its turn.
    pub(super) fn begin(&self, id: Id) {
        MEMBER.with_borrow_mut(|list| list.push((self.clock, id)));
        let state = lock(&self.state);
        drop(self.wait_for_turn(state, id));
    }

    /// Makes the calling thread a participant; false when it was one.
    pub(super) fn enter(&self) -> bool {
        if self.me().is_some() {
            return false;
        }
        let id = self.register();
        self.begin(id);
        true
    }

    /// The calling thread is no participant any more.
    pub(super) fn leave(&self) {
        let Some(id) = self.me() else { return };
        MEMBER.with_borrow_mut(|list| list.retain(|member| *member != (self.clock, id)));
        let mut state = lock(&self.state);
        state.participants.remove(&id);
        state.running = None;
        self.dispatch(&mut state, None);
    }

    /// Runs `f` as a participant: with the number the thread has, or one for this call.
    pub(super) fn as_participant<R>(&self, f: impl FnOnce(Id) -> R) -> R {
        struct Leave<'a>(&'a Scheduler, bool);
        impl Drop for Leave<'_> {
            fn drop(&mut self) {
                if self.1 {
                    self.0.leave();
                }
            }
        }
        let _leave = Leave(self, self.enter());
        f(self.me().expect("entered just now"))
    }

    pub(super) fn sleep_until(&self, time: Time) {
        self.as_participant(|me| {
            let mut state = lock(&self.state);
            if time <= Time(self.now.load(Ordering::Relaxed)) {
                return;
            }
            // Nobody else is due before: no hand-over, time just moves.
            if self.pace.is_none()
                && state.ready.is_empty()
                && state.next_timer().is_none_or(|(at, id)| (time, me) < (at, id))
            {
                self.now.store(time.0, Ordering::Release);
                return;
            }
            self.begin_wait(&mut state, me, time);
            self.block(state, me);
        });
    }

    pub(super) fn hang(&self) {
        self.as_participant(|me| {
            let mut state = lock(&self.state);
            if !state.shut {
                let wait = self.begin_wait(&mut state, me, Time::NEVER);
                state.hung.push(wait);
                self.block(state, me);
            }
        });
    }

    pub(super) fn shutdown(&self) {
        let mut state = lock(&self.state);
        self.catch_up(&state);
        state.shut = true;
        for wait in std::mem::take(&mut state.hung) {
            state.make_ready(wait);
        }
        self.dispatch(&mut state, None);
    }

    /// Says that the participant waits from now on; it may be made ready by [`Scheduler::wake`] from here, and must
    /// call [`Scheduler::wait`] with the same lock or after it.
    fn begin_wait(&self, state: &mut SchedulerState, me: Id, deadline: Time) -> WaitUntil {
        let number = state.next_wait;
        state.next_wait += 1;
        if let Some(participant) = state.participants.get_mut(&me) {
            participant.wait = Some(number);
        }
        if deadline != Time::NEVER {
            state.timers.push(Reverse((deadline, me, number)));
        }
        WaitUntil { id: me, number }
    }

    /// Waits until woken or until `deadline`. `register` gets the wait before the token is given away (and before any
    /// other lock that the caller holds is released), so that no wake-up is lost.
    pub(super) fn wait(&self, me: Id, deadline: Time, register: impl FnOnce(WaitUntil)) {
        self.wait_or_idle(me, deadline, Time::NEVER, register);
    }

    /// [`Self::wait`], which also ends at `idle`, when time comes that far because of what others wait for.
    pub(super) fn wait_or_idle(&self, me: Id, deadline: Time, idle: Time, register: impl FnOnce(WaitUntil)) {
        let mut state = lock(&self.state);
        let wait = self.begin_wait(&mut state, me, deadline);
        if idle < deadline {
            state.idle.retain(|(_, id, _)| *id != me);
            state.idle.push((idle, me, wait.number));
        }
        register(wait);
        self.block(state, me);
    }

    /// Ends a wait; false when it has ended already.
    pub(super) fn wake(&self, wait: WaitUntil) -> bool {
        let mut state = lock(&self.state);
        self.catch_up(&state);
        let woken = state.make_ready(wait);
        self.dispatch(&mut state, None);
        woken
    }

    /// Gives the token away and waits for the next turn.
    fn block(&self, mut state: MutexGuard<'_, SchedulerState>, me: Id) {
        state.running = None;
        self.dispatch(&mut state, Some(me));
        drop(self.wait_for_turn(state, me));
    }

    fn wait_for_turn<'a>(
        &'a self,
        mut state: MutexGuard<'a, SchedulerState>,
        me: Id,
    ) -> MutexGuard<'a, SchedulerState> {
        let Some(turn) = state.participants.get(&me).map(|p| p.turn.clone()) else { return state };
        while state.running != Some(me) {
            let pacing = state.pacer == Some(me) && state.running.is_none();
            match (&self.pace, pacing.then(|| state.next_timer()).flatten()) {
                (Some(pace), Some((at, _))) => {
                    let left = pace.until(at);
                    if !left.is_zero() {
                        state = turn.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
                    }
                    self.dispatch(&mut state, Some(me));
                }
                _ => state = turn.wait(state).unwrap_or_else(PoisonError::into_inner),
            }
        }
        state
    }

    /// Gives the token, if nobody has it, to whoever is next. `blocked`: the caller, if it waits from now on.
    fn dispatch(&self, state: &mut SchedulerState, blocked: Option<Id>) {
        while state.running.is_none() {
            if let Some(id) = state.ready.pop_front() {
                if let Some(participant) = state.participants.get(&id) {
                    participant.turn.notify_one();
                    state.running = Some(id);
                    state.hand_overs += 1;
                }
                continue;
            }
            let Some((at, _)) = state.next_timer() else { return };
            // A clock that follows real time goes on anyway.
            if self.pace.is_none() && state.is_idle() {
                return;
            }
            if let Some(pace) = &self.pace
                && !pace.until(at).is_zero()
            {
                // Real time has not come so far: somebody has to watch it.
                let watcher = blocked.or_else(|| state.participants.keys().min().copied());
                if state.pacer != watcher || blocked.is_none() {
                    state.pacer = watcher;
                    if let Some(participant) = watcher.and_then(|id| state.participants.get(&id)) {
                        participant.turn.notify_one();
                    }
                }
                return;
            }
            self.now.fetch_max(at.0, Ordering::AcqRel);
            while let Some((next, _)) = state.next_timer()
                && next == at
                && let Some(wait) = state.pop_timer()
            {
                state.make_ready(wait);
            }
        }
    }

    /// When paced and everybody waits, lets simulated time follow real time up to the next moment somebody waits for:
    /// something from outside is about to happen. While a participant runs, time stands still.
    fn catch_up(&self, state: &SchedulerState) {
        if let Some(pace) = &self.pace
            && state.running.is_none()
            && !state.participants.is_empty()
        {
            let idle = state.idle.iter().map(|(at, ..)| *at);
            let limit = idle.chain(state.timers.peek().map(|Reverse((at, ..))| *at)).min().unwrap_or(Time::NEVER);
            self.now.fetch_max(pace.now().min(limit).0, Ordering::AcqRel);
        }
    }
}

impl Pace {
    /// Simulated time as real time would have it.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn now(&self) -> Time {
        Time((self.start.elapsed().as_secs_f64() * self.factor * 1e9) as u64)
    }

    /// Real time left until `at`; at most an hour, after which the caller looks again.
    fn until(&self, at: Time) -> Duration {
        let real = (at.as_secs_f64() / self.factor - self.start.elapsed().as_secs_f64()).min(3600.0);
        if real > 0.0 { Duration::from_secs_f64(real) } else { Duration::ZERO }
    }
}

impl SchedulerState {
    fn add(&mut self) -> Id {
        let id = self.next_id;
        self.next_id += 1;
        self.participants.insert(id, Participant { turn: Arc::new(Condvar::new()), wait: None });
        id
    }

    fn make_ready(&mut self, wait: WaitUntil) -> bool {
        match self.participants.get_mut(&wait.id) {
            Some(participant) if participant.wait == Some(wait.number) => {
                participant.wait = None;
                self.ready.push_back(wait.id);
                true
            }
            _ => false,
        }
    }

    /// The earliest moment somebody waits for, and who.
    fn next_timer(&mut self) -> Option<(Time, Id)> {
        let (eager, idle) = (self.next_eager(), self.next_idle());
        eager.into_iter().chain(idle).min().map(|(at, id, _)| (at, id))
    }

    /// Takes it.
    fn pop_timer(&mut self) -> Option<WaitUntil> {
        let (eager, idle) = (self.next_eager(), self.next_idle());
        let first = eager.into_iter().chain(idle).min()?;
        if idle == Some(first) {
            self.idle.retain(|timer| *timer != first);
        } else {
            self.timers.pop();
        }
        Some(WaitUntil { id: first.1, number: first.2 })
    }

    /// Whether nobody waits for a moment for which time moves on.
    fn is_idle(&mut self) -> bool {
        self.next_eager().is_none()
    }

    fn next_eager(&mut self) -> Option<(Time, Id, u64)> {
        while let Some(Reverse((at, id, number))) = self.timers.peek().copied() {
            if self.participants.get(&id).is_some_and(|p| p.wait == Some(number)) {
                return Some((at, id, number));
            }
            self.timers.pop();
        }
        None
    }

    fn next_idle(&mut self) -> Option<(Time, Id, u64)> {
        let Self { participants, idle, .. } = self;
        idle.retain(|(_, id, number)| participants.get(id).is_some_and(|p| p.wait == Some(*number)));
        idle.iter().min().copied()
    }
}
