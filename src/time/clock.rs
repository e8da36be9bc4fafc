//! The clock's handle: what a thread may ask of time.

use super::channel::{self, Receiver, RecvError, Sender};
use super::signal::Signal;
use super::simulated::Scheduler;
use super::{Time, lock};
use std::any::Any;
use std::marker::PhantomData;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What [`Clock::spawn`] panics with.
#[derive(Debug)]
pub struct NoThread(pub std::io::Error);

/// A clock: real time, or simulated time that moves as fast as the machine and the same way every time.
///
/// Cheap to clone; all clones are the same clock.
///
/// # Simulated time
///
/// The threads that run on a simulated clock are its *participants*: those it [spawned](Clock::spawn), and those that
/// [entered](Clock::enter). They are ordinary threads, but only the one that holds the token runs. A participant gives
/// the token away when it waits *in a call of the clock* (sleep, receive, send with a deadline, wait for a signal, join)
/// or ends. It goes to the participant that became ready first; when nobody is ready, time jumps to the earliest moment
/// somebody waits for, and those who wait for the same moment run in the order in which they became participants.
/// While a participant computes, time stands still. So a run is a function of the program, threads or not.
///
/// What follows from it: a participant must not wait in any other way (a mutex that another participant holds across a
/// call of the clock, `std`'s join, a socket), nor spin on [`Clock::now`]; it would keep the token.
///
/// A thread that is no participant (one that reads a socket) may call everything. `now`, `try_send`, `try_recv` and
/// `notify` do not wait; a call that waits makes it a participant for as long as the call takes.
#[derive(Clone)]
pub struct Clock(pub(super) Arc<TimeKind>);

#[allow(clippy::large_enum_variant)] // one of them in a process, behind an `Arc`
pub(super) enum TimeKind {
    Real(Real),
    Simulated(Scheduler),
}

pub(super) struct Real {
    start: Instant,
    /// Whether the clock is shut down; waited for by those who hang.
    shut: Mutex<bool>,
    shut_changed: Condvar,
}

impl Real {
    /// The moment as the operating system counts it; none when it never comes.
    pub(super) fn instant(&self, time: Time) -> Option<Instant> {
        if time == Time::NEVER { None } else { self.start.checked_add(Duration::from_nanos(time.0)) }
    }

    pub(super) fn now(&self) -> Time {
        Time(u64::try_from(self.start.elapsed().as_nanos()).unwrap_or(u64::MAX))
    }
}

impl std::fmt::Debug for Clock {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} clock at {}", if self.is_simulated() { "simulated" } else { "real" }, self.now())
    }
}

/// What a call of [`Clock::hang`] unwinds with when the clock is shut down.
#[derive(Debug, Clone, Copy)]
pub struct Released;

impl Clock {
    /// Real time, counted from now.
    pub fn real() -> Self {
        Self(Arc::new(TimeKind::Real(Real {
            start: Instant::now(),
            shut: Mutex::new(false),
            shut_changed: Condvar::new(),
        })))
    }

    /// Simulated time, as fast as the machine.
    pub fn simulated() -> Self {
        Self(Arc::new(TimeKind::Simulated(Scheduler::new(None))))
    }

    /// Simulated time that runs at most `factor` times as fast as real time (1: as fast; a factor that is not a positive
    /// number counts as 1). For a simulated deployment in the foreground, which would otherwise spin through the years.
    /// What one participant wakes another with is as deterministic as ever; what comes from outside arrives at a moment
    /// that depends on when it came.
    pub fn simulated_paced(factor: f64) -> Self {
        let factor = if factor.is_finite() && factor > 0.0 { factor } else { 1.0 };
        Self(Arc::new(TimeKind::Simulated(Scheduler::new(Some(factor)))))
    }

    /// Whether time is simulated.
    pub fn is_simulated(&self) -> bool {
        matches!(*self.0, TimeKind::Simulated(_))
    }

    /// The present moment. Never waits.
    pub fn now(&self) -> Time {
        match &*self.0 {
            TimeKind::Real(real) => real.now(),
            TimeKind::Simulated(scheduler) => scheduler.now(),
        }
    }

    /// Waits until `time`; returns at once when it is past. [`Time::NEVER`]: see [`Clock::hang`].
    pub fn sleep_until(&self, time: Time) {
        if time == Time::NEVER {
            self.hang();
        }
        match &*self.0 {
            TimeKind::Real(real) => {
                if let Some(end) = real.instant(time) {
                    loop {
                        let left = end.saturating_duration_since(Instant::now());
                        if left.is_zero() {
                            return;
                        }
                        std::thread::sleep(left);
                    }
                }
            }
            TimeKind::Simulated(scheduler) => scheduler.sleep_until(time),
        }
    }

    /// Waits for `duration` from now.
    pub fn sleep(&self, duration: Duration) {
        self.sleep_until(self.now() + duration);
    }

    /// Blocks for ever: what a component that hangs does in a test. When the clock is [shut down](Clock::shutdown) the
    /// call unwinds (with `Released` as its payload and without a word on stderr), so that no thread is left behind.
    pub fn hang(&self) -> ! {
        match &*self.0 {
            TimeKind::Real(real) => {
                let mut shut = lock(&real.shut);
                while !*shut {
                    shut = real.shut_changed.wait(shut).unwrap_or_else(PoisonError::into_inner);
                }
            }
            TimeKind::Simulated(scheduler) => scheduler.hang(),
        }
        resume_unwind(Box::new(Released))
    }

    /// Releases all who hang, now and from now on. Nothing else changes: time goes on and channels stay open, so that
    /// everybody else ends in order.
    pub fn shutdown(&self) {
        match &*self.0 {
            TimeKind::Real(real) => {
                *lock(&real.shut) = true;
                real.shut_changed.notify_all();
            }
            TimeKind::Simulated(scheduler) => scheduler.shutdown(),
        }
    }

    /// Makes the calling thread a participant until the guard is dropped, waiting for the token first. On the real clock,
    /// and in a thread that is a participant already, it does nothing.
    #[must_use = "the thread is a participant while the guard lives"]
    pub fn enter(&self) -> Guard {
        let entered = match &*self.0 {
            TimeKind::Real(_) => false,
            TimeKind::Simulated(scheduler) => scheduler.enter(),
        };
        Guard { clock: entered.then(|| self.clone()), not_send: PhantomData }
    }

    /// Runs `f` in a thread of its own, a participant.
    ///
    /// # Panics
    /// With what that error is when the operating system has no thread left; see [`Clock::try_spawn`].
    pub fn spawn(&self, name: &str, f: impl FnOnce() + Send + 'static) -> Join {
        // Nobody needs to read where in the program that was.
        self.try_spawn(name, f).unwrap_or_else(|error| resume_unwind(Box::new(NoThread(error))))
    }

    /// Runs `f` in a thread of its own, a participant.
    ///
    /// # Errors
    /// When the operating system has no thread left.
    pub fn try_spawn(&self, name: &str, f: impl FnOnce() + Send + 'static) -> std::io::Result<Join> {
        let (done, ended) = self.channel(1);
        // The order of participants is the order in which they were spawned, not the one in which threads come up.
        let id = match &*self.0 {
            TimeKind::Real(_) => None,
            TimeKind::Simulated(scheduler) => Some(scheduler.register()),
        };
        let clock = self.clone();
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || {
            if let (TimeKind::Simulated(scheduler), Some(id)) = (&*clock.0, id) {
                scheduler.begin(id);
            }
            let _participant = Guard { clock: id.map(|_| clock.clone()), not_send: PhantomData };
            let outcome = catch_unwind(AssertUnwindSafe(f)).map_err(|payload| JoinError::of(&*payload));
            let _ = done.try_send(outcome);
            // Before the token goes: who waits for the end must not be woken from outside the order.
            drop(done);
        });
        match thread {
            Ok(thread) => Ok(Join { ended, thread: Some(thread), last: TaskThread::default() }),
            Err(error) => {
                if let (TimeKind::Simulated(scheduler), Some(id)) = (&*self.0, id) {
                    scheduler.withdraw(id);
                }
                Err(error)
            }
        }
    }

    /// A queue of at most `bound` values (at least 1) between any number of senders and receivers.
    pub fn channel<T>(&self, bound: usize) -> (Sender<T>, Receiver<T>) {
        channel::new(self, bound.max(1))
    }

    /// A signal: one thread waits for it, any thread notifies.
    pub fn signal(&self) -> Signal {
        Signal::new(self)
    }

    /// How often the token of a simulated clock has been given to a participant; 0 on the real clock.
    pub fn hand_overs(&self) -> u64 {
        match &*self.0 {
            TimeKind::Real(_) => 0,
            TimeKind::Simulated(scheduler) => scheduler.hand_overs(),
        }
    }

    /// Whether both are the same clock.
    pub fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// While it lives, its thread is a participant of a simulated clock.
pub struct Guard {
    clock: Option<Clock>,
    /// The token belongs to the thread.
    not_send: PhantomData<*const ()>,
}

impl Drop for Guard {
    fn drop(&mut self) {
        if let Some(clock) = &self.clock
            && let TimeKind::Simulated(scheduler) = &*clock.0
        {
            scheduler.leave();
        }
    }
}

/// A thread that was spawned. Dropping it lets the thread run on by itself.
#[derive(Debug)]
pub struct Join {
    ended: Receiver<Result<(), JoinError>>,
    /// None: a task, which has no thread of its own.
    thread: Option<JoinHandle<()>>,
    /// The thread that has run the end of a task.
    last: TaskThread,
}

/// Where the thread is put that has run the last step of a task, and ends with it.
pub(super) type TaskThread = Arc<Mutex<Option<JoinHandle<()>>>>;

/// How a thread did not simply end.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum JoinError {
    /// It still runs at the deadline.
    #[error("the thread still runs")]
    Timeout,
    /// It panicked.
    #[error("the thread panicked: {0}")]
    Panicked(String),
    /// It hung until the clock was shut down.
    #[error("the thread hung until the clock was shut down")]
    Released,
}

impl JoinError {
    pub(super) fn of(payload: &(dyn Any + Send)) -> Self {
        if payload.is::<Released>() { Self::Released } else { Self::Panicked(panic_text(payload)) }
    }
}

/// The text of a panic, from what it unwinds with.
pub fn panic_text(payload: &(dyn Any + Send)) -> String {
    if let Some(text) = payload.downcast_ref::<&'static str>() {
        (*text).to_owned()
    } else if let Some(text) = payload.downcast_ref::<String>() {
        text.clone()
    } else if payload.is::<Released>() {
        "released by the shutdown of the clock".to_owned()
    } else {
        "a panic without a text".to_owned()
    }
}

impl Join {
    pub(super) fn of_task(ended: Receiver<Result<(), JoinError>>, last: TaskThread) -> Self {
        Self { ended, thread: None, last }
    }

    /// Waits until the thread has ended, at most until `deadline`.
    ///
    /// # Errors
    /// [`JoinError`]: it still runs (then it is left to itself), or how it ended badly.
    pub fn join(self, deadline: Time) -> Result<(), JoinError> {
        match self.ended.recv_deadline(deadline) {
            Ok(outcome) => {
                // What is left of it needs no token: it is only taken off the operating system's list.
                if let Some(thread) = self.thread.or_else(|| lock(&self.last).take()) {
                    let _ = thread.join();
                }
                outcome
            }
            Err(RecvError::Timeout) => Err(JoinError::Timeout),
            Err(RecvError::Closed) => Err(JoinError::Panicked("the thread ended without a word".to_owned())),
        }
    }

    /// Whether the thread has ended (or is just about to).
    pub fn is_finished(&self) -> bool {
        !self.ended.is_empty() || self.thread.as_ref().is_some_and(JoinHandle::is_finished)
    }

    /// The thread, for what the operating system may be asked about it; none: a task on a simulated clock.
    pub fn thread(&self) -> Option<&std::thread::Thread> {
        self.thread.as_ref().map(JoinHandle::thread)
    }
}
