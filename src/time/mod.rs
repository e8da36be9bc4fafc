//! Time: one clock, real or simulated, for everything (semantics: *Platforms*).
//!
//! What runs on a [`Clock`] never reads another one: no `Instant::now`, no `thread::sleep`, no other channel, anywhere
//! else in the project. In return the same code runs in real time and, on [`Clock::simulated`], as fast as the machine and
//! the same way every time, threads included.
//!
//! * [`clock`]: the handle.
//! * [`channel`]: bounded queues between participants. [`signal`]: one thread waits, anybody notifies.
//! * [`simulated`]: the scheduler that hands one token round; [`schedule`]: who is next.
//! * [`tasks`]: what is done again and again, with a thread of its own in real time and without one in simulated time.
//! * [`wall`]: the calendar's time, for what is written down for people. Nothing is decided by it.

// The one room that may ask the operating system for the time; everybody else asks the clock.
#![allow(clippy::disallowed_methods)]

pub mod channel;
pub mod clock;
pub mod schedule;
pub mod signal;
pub mod simulated;
pub mod tasks;
#[cfg(test)]
mod tests;
pub mod wall;

pub use channel::{Receiver, RecvError, SendError, Sender, TryRecvError, TrySendError};
pub use clock::{Clock, Guard, Join, JoinError, NoThread, Released};
pub use schedule::TaskWait;
pub use signal::Signal;
pub use wall::Wall;

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Locks, also after a panic elsewhere: what our locks guard is consistent between any two statements that may panic.
pub(crate) fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A moment, in nanoseconds since the clock's start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, serde::Serialize)]
pub struct Time(pub u64);

impl Time {
    /// The latest moment: a deadline that never comes.
    pub const NEVER: Self = Self(u64::MAX);

    /// Nanoseconds since the clock's start.
    pub fn as_nanos(self) -> u64 {
        self.0
    }

    /// Seconds since the clock's start.
    #[allow(clippy::cast_precision_loss)]
    pub fn as_secs_f64(self) -> f64 {
        // Not times 1e-9, which is no number of a computer: 0.6 s would read 0.6000000000000001.
        self.0 as f64 / 1e9
    }

    /// The time from `earlier` to `self`, zero if it is later.
    pub fn since(self, earlier: Self) -> Duration {
        Duration::from_nanos(self.0.saturating_sub(earlier.0))
    }
}

impl std::ops::Add<Duration> for Time {
    type Output = Self;
    fn add(self, d: Duration) -> Self {
        Self(self.0.saturating_add(u64::try_from(d.as_nanos()).unwrap_or(u64::MAX)))
    }
}

impl std::ops::AddAssign<Duration> for Time {
    fn add_assign(&mut self, d: Duration) {
        *self = *self + d;
    }
}

/// Seconds with as many digits as there are: `1.5 s`.
impl std::fmt::Display for Time {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if *self == Self::NEVER { f.write_str("never") } else { write!(f, "{} s", self.as_secs_f64()) }
    }
}
