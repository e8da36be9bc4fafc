//! The scheduler of simulated time: one token, handed round in a fixed order.
//!
//! One mutex guards everything; every participant is parked by itself, so that a hand-over wakes exactly one thread,
//! and wakes it when the mutex is free again. Tasks ([`super::tasks`]) are participants without a thread of their own. Locks
//! are taken in the order *channel or signal, then scheduler*, never the reverse.

use super::schedule::{Called, Id, SchedulerState, WaitUntil};
use super::{Time, lock};
use std::cell::RefCell;
use std::cmp::Reverse;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// The scheduler of one simulated clock.
pub(super) struct Scheduler {
    /// Which clock it is, in the thread-local list of memberships.
    clock: u64,
    pace: Option<Pace>,
    pub(super) now: AtomicU64,
    pub(super) state: Mutex<SchedulerState>,
    /// Where threads that run tasks wait for one.
    pub(super) idle_runners: Condvar,
}

struct Pace {
    factor: f64,
    start: Instant,
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
            idle_runners: Condvar::new(),
        }
    }

    /// Whether time follows real time.
    pub(super) fn is_paced(&self) -> bool {
        self.pace.is_some()
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
        self.dispatch_and_call(state);
        id
    }

    /// Takes back a registration whose thread never came up.
    pub(super) fn withdraw(&self, id: Id) {
        let mut state = lock(&self.state);
        state.participants.remove(&id);
        state.ready.retain(|ready| *ready != id);
        if state.running == Some(id) {
            state.running = None;
            self.dispatch_and_call(state);
        }
    }

    /// The calling thread is participant `id` from now on; waits for the token.
    pub(super) fn begin(&self, id: Id) {
        self.be(id);
        self.wait_for_token(lock(&self.state), id, Called::Nobody);
    }

    /// Room for what [`Self::be`] notes, so that a task's step allocates nothing whoever runs it.
    pub(super) fn make_room() {
        MEMBER.with_borrow_mut(|list| list.reserve(4));
    }

    /// The calling thread speaks for participant `id`, until it is [nobody](Self::be_nobody).
    pub(super) fn be(&self, id: Id) {
        MEMBER.with_borrow_mut(|list| list.push((self.clock, id)));
    }

    pub(super) fn be_nobody(&self, id: Id) {
        MEMBER.with_borrow_mut(|list| list.retain(|member| *member != (self.clock, id)));
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
        self.be_nobody(id);
        let mut state = lock(&self.state);
        state.participants.remove(&id);
        state.running = None;
        self.dispatch_and_call(state);
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
        self.dispatch_and_call(state);
    }

    /// Says that the participant waits from now on; it may be made ready by [`Scheduler::wake`] from here, and must
    /// call [`Scheduler::wait`] with the same lock or after it.
    pub(super) fn begin_wait(&self, state: &mut SchedulerState, me: Id, deadline: Time) -> WaitUntil {
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
        self.dispatch_and_call(state);
        woken
    }

    /// Gives the token away and waits for it.
    fn block<'a>(&'a self, mut state: MutexGuard<'a, SchedulerState>, me: Id) {
        state.running = None;
        let called = self.dispatch(&mut state, Some(me));
        self.wait_for_token(state, me, called);
    }

    /// Waits until `me` has the token; `called` is woken first.
    fn wait_for_token<'a>(&'a self, mut state: MutexGuard<'a, SchedulerState>, me: Id, mut called: Called) {
        let Some(parker) = state.participants.get(&me).map(|p| p.parker.clone()) else { return };
        while state.running != Some(me) {
            let pacing = state.pacer == Some(me) && state.running.is_none();
            let watched = match (&self.pace, pacing.then(|| state.next_timer()).flatten()) {
                (Some(pace), Some((at, _))) => Some(pace.until(at)),
                _ => None,
            };
            drop(state);
            self.call(std::mem::replace(&mut called, Called::Nobody));
            if watched.is_none_or(|left| !left.is_zero()) {
                parker.park(watched);
            }
            state = lock(&self.state);
            if watched.is_some() {
                called = self.dispatch(&mut state, Some(me));
            }
        }
        drop(state);
        self.call(called);
    }

    pub(super) fn call(&self, called: Called) {
        match called {
            Called::Nobody => {}
            Called::Thread(parker) => parker.unpark(),
            Called::Runner => self.idle_runners.notify_one(),
        }
    }

    /// [`Self::dispatch`] by who does not wait itself.
    pub(super) fn dispatch_and_call(&self, mut state: MutexGuard<'_, SchedulerState>) {
        let called = self.dispatch(&mut state, None);
        drop(state);
        self.call(called);
    }

    /// Gives the token, if nobody has it, to whoever is next, who is to be [called](Self::call) afterwards. `blocked`: the
    /// caller, if it waits from now on; it looks by itself.
    pub(super) fn dispatch(&self, state: &mut SchedulerState, blocked: Option<Id>) -> Called {
        while state.running.is_none() {
            if let Some(id) = state.ready.pop_front() {
                let Some(participant) = state.participants.get(&id) else { continue };
                state.running = Some(id);
                state.hand_overs += 1;
                if participant.task.is_some() {
                    state.due = Some(id);
                    return Called::Runner;
                }
                return if blocked == Some(id) { Called::Nobody } else { Called::Thread(participant.parker.clone()) };
            }
            let Some((at, _)) = state.next_timer() else { return Called::Nobody };
            // A clock that follows real time goes on anyway.
            if self.pace.is_none() && state.is_idle() {
                return Called::Nobody;
            }
            if let Some(pace) = &self.pace
                && !pace.until(at).is_zero()
            {
                // Real time has not come so far: somebody has to watch it.
                let watcher = blocked.or_else(|| state.participants.keys().min().copied());
                if state.pacer != watcher || blocked.is_none() {
                    state.pacer = watcher;
                    if let Some(participant) = watcher.and_then(|id| state.participants.get(&id)) {
                        return Called::Thread(participant.parker.clone());
                    }
                }
                return Called::Nobody;
            }
            self.now.fetch_max(at.0, Ordering::AcqRel);
            while let Some(wait) = state.pop_timer(at) {
                state.make_ready(wait);
            }
        }
        Called::Nobody
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
