//! A signal: one thread waits, any thread notifies.
//!
//! Notifying takes no lock on the real clock and allocates nothing, so that it may be done by a control activity and to
//! one: the waiting thread is parked, and un-parking it is one atomic exchange (and a system call when it sleeps).

use super::clock::{Clock, TimeKind};
use super::schedule::WaitUntil;
use super::{Time, lock};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread::Thread;
use std::time::Instant;

/// A flag that one thread (the first one that waits) waits for, and that any thread sets. Notifications do not add up.
#[derive(Clone)]
pub struct Signal {
    clock: Clock,
    inner: Arc<SignalInner>,
}

struct SignalInner {
    set: AtomicBool,
    /// On the real clock.
    waiter: OnceLock<Thread>,
    /// On a simulated clock.
    wait: Mutex<Option<WaitUntil>>,
}

impl Signal {
    pub(super) fn new(clock: &Clock) -> Self {
        let inner = SignalInner { set: AtomicBool::new(false), waiter: OnceLock::new(), wait: Mutex::new(None) };
        Self { clock: clock.clone(), inner: Arc::new(inner) }
    }

    /// Sets the flag and wakes the thread that waits for it. Never waits.
    pub fn notify(&self) {
        match &*self.clock.0 {
            TimeKind::Real(_) => {
                if !self.inner.set.swap(true, Ordering::SeqCst)
                    && let Some(thread) = self.inner.waiter.get()
                {
                    thread.unpark();
                }
            }
            TimeKind::Simulated(scheduler) => {
                let mut wait = lock(&self.inner.wait);
                self.inner.set.store(true, Ordering::SeqCst);
                if let Some(wait) = wait.take() {
                    scheduler.wake(wait);
                }
            }
        }
    }

    /// Waits until the flag is set, at most until `deadline`; clears it and answers whether it was set.
    ///
    /// # Panics
    /// On the real clock, when a second thread waits.
    pub fn wait(&self, deadline: Time) -> bool {
        match &*self.clock.0 {
            TimeKind::Real(real) => {
                let me = self.inner.waiter.get_or_init(std::thread::current);
                assert!(me.id() == std::thread::current().id(), "a signal is waited for by one thread only");
                let end = real.instant(deadline);
                loop {
                    if self.inner.set.swap(false, Ordering::SeqCst) {
                        return true;
                    }
                    match end.map(|end| end.saturating_duration_since(Instant::now())) {
                        None => std::thread::park(),
                        Some(left) if left.is_zero() => return false,
                        Some(left) => std::thread::park_timeout(left),
                    }
                }
            }
            TimeKind::Simulated(scheduler) => scheduler.as_participant(|me| {
                loop {
                    let mut wait = lock(&self.inner.wait);
                    if self.inner.set.swap(false, Ordering::SeqCst) {
                        return true;
                    }
                    if self.clock.now() >= deadline {
                        return false;
                    }
                    scheduler.wait(me, deadline, move |number| *wait = Some(number));
                }
            }),
        }
    }

    /// What [`Self::wait`] does before it gives the token away, for who waits without a thread: false when there is nothing
    /// to wait for, else `begin` has told how the wait is ended.
    pub(super) fn begin_wait(&self, deadline: Time, begin: impl FnOnce() -> WaitUntil) -> bool {
        // On a simulated clock it is set under the same lock.
        let mut wait = lock(&self.inner.wait);
        if self.inner.set.load(Ordering::SeqCst) {
            self.clear();
            return false;
        }
        if self.clock.now() >= deadline {
            return false;
        }
        *wait = Some(begin());
        true
    }

    /// What [`Self::wait`] does when the wait has ended.
    pub(super) fn clear(&self) {
        if self.inner.set.load(Ordering::SeqCst) {
            self.inner.set.store(false, Ordering::SeqCst);
        }
    }
}
