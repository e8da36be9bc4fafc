//! The tap: whatever observes hangs on one (a terminal, a subscriber, a recording), and nothing that acts ever waits for it
//! (semantics: *Coordinators*).
//!
//! An observer has a thread of its own and a bounded queue before it. On the real clock what finds the queue full is
//! dropped and counted, and the observer is told of the hole where it is: once it keeps up again, and at most once in
//! [`limits::DROPS_TOLD`]; until then everything is dropped, so that there are few holes and between them a whole story. On
//! a simulated clock nothing acts on a robot and time stands still as long as somebody computes: there who drives the
//! simulation waits for the observer ([`Tap::keep_pace`]), and nothing is lost, unless the observer takes nothing at all
//! for [`limits::TAP_PATIENCE`].

use super::log::LogEntry;
use crate::limits;
use crate::time::{Clock, Time, lock};
use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Something that hears all that happens. Never waits, but where it is asked to keep pace.
pub trait LogSink: Send + Sync {
    /// Called in the thread that acts, in the order in which things happen.
    fn hear(&self, entry: &Arc<LogEntry>);

    /// Called in simulated time, behind it and without any lock of the session: may wait for a slow observer.
    fn keep_pace(&self) {}
}

/// What an observer is handed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum News<T> {
    /// The next thing.
    One(T),
    /// In this place so many are missing.
    Missed(u64),
}

/// The queue was full, or nobody takes anything out of it any more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Full;

/// An observer's queue and thread. Clones are the same; when the last one is gone, the observer ends with what waits.
pub struct Tap<T> {
    end: Arc<TapEnd<T>>,
}

struct TapEnd<T>(Arc<TapShared<T>>);

struct TapShared<T> {
    clock: Clock,
    bound: usize,
    state: Mutex<TapState<T>>,
    /// Wakes the observer.
    put: Condvar,
    /// Wakes who waits for the observer.
    taken: Condvar,
}

struct TapState<T> {
    queue: VecDeque<News<T>>,
    /// What was dropped since the queue was full; as long as it is not told, everything is dropped.
    missing: u64,
    /// When a hole was told last.
    told: Option<Time>,
    /// How many the observer was done with, and whether it is at one.
    done: u64,
    busy: bool,
    /// It took nothing for longer than anybody waits.
    stalled: bool,
    /// Nothing more comes.
    closed: bool,
    /// Its thread has ended.
    gone: bool,
}

impl<T> Clone for Tap<T> {
    fn clone(&self) -> Self {
        Self { end: self.end.clone() }
    }
}

impl<T> Drop for TapEnd<T> {
    fn drop(&mut self) {
        lock(&self.0.state).closed = true;
        self.0.put.notify_all();
    }
}

impl<T: Send + 'static> Tap<T> {
    /// Starts an observer with room for `bound` things. It is handed them in its own thread, which may wait for whatever it
    /// likes.
    ///
    /// # Errors
    /// When the operating system has no thread left.
    pub fn new(
        name: &str,
        bound: usize,
        clock: &Clock,
        observer: impl FnMut(News<T>) + Send + 'static,
    ) -> io::Result<Self> {
        let state = TapState {
            queue: VecDeque::new(),
            missing: 0,
            told: None,
            done: 0,
            busy: false,
            stalled: false,
            closed: false,
            gone: false,
        };
        let shared = Arc::new(TapShared {
            clock: clock.clone(),
            bound: bound.max(1),
            state: Mutex::new(state),
            put: Condvar::new(),
            taken: Condvar::new(),
        });
        let own = shared.clone();
        std::thread::Builder::new().name(name.to_owned()).spawn(move || own.live(observer))?;
        Ok(Self { end: Arc::new(TapEnd(shared)) })
    }
}

impl<T> Tap<T> {
    /// Hands something on; never waits. Without room it is dropped and counted.
    pub fn put(&self, what: T) {
        self.end.0.put(what, 0);
    }

    /// The same of what a command says of itself, a few lines at most: there is room kept for it where the queue is full.
    pub fn put_own(&self, what: T) {
        self.end.0.put(what, limits::TAP_OWN);
    }

    /// Hands something on, if there is room; never waits. For an observer that must not miss anything: who cannot follow
    /// is cut off.
    ///
    /// # Errors
    /// [`Full`]; then it is handed nothing.
    pub fn offer(&self, what: T) -> Result<(), Full> {
        let shared = &self.end.0;
        let mut state = lock(&shared.state);
        if state.closed || state.gone || state.queue.len() >= shared.bound {
            return Err(Full);
        }
        state.queue.push_back(News::One(what));
        shared.put.notify_one();
        Ok(())
    }

    /// In simulated time waits until the observer has caught up half of its queue, if that is more than half full, as long
    /// as it takes anything; else does nothing.
    pub fn keep_pace(&self) {
        let shared = &self.end.0;
        if !shared.clock.is_simulated() {
            return;
        }
        let mut state = lock(&shared.state);
        if state.queue.len() <= shared.bound / 2 {
            return;
        }
        while state.queue.len() > shared.bound / 2 && !state.stalled && !state.gone {
            let done = state.done;
            state = shared.wait_for_progress(state, limits::TAP_PATIENCE);
            state.stalled = state.done == done;
        }
    }

    /// Waits until the observer has taken all that waits, as long as it takes anything within `patience` (real time);
    /// answers how many it did not take.
    pub fn flush(&self, patience: Duration) -> u64 {
        let shared = &self.end.0;
        let mut state = lock(&shared.state);
        while !state.gone && state.left() > 0 {
            let done = state.done;
            state = shared.wait_for_progress(state, patience);
            if state.done == done {
                break;
            }
        }
        if state.gone { 0 } else { state.left() }
    }

    /// The same, and nothing more comes.
    pub fn finish(&self, patience: Duration) -> u64 {
        lock(&self.end.0.state).closed = true;
        self.end.0.put.notify_all();
        self.flush(patience)
    }

    /// How many wait.
    #[cfg(any(test, feature = "internals"))]
    pub fn waiting(&self) -> usize {
        lock(&self.end.0.state).queue.len()
    }
}

impl<T: From<Arc<LogEntry>> + Send> LogSink for Tap<T> {
    fn hear(&self, entry: &Arc<LogEntry>) {
        self.put(T::from(entry.clone()));
    }

    fn keep_pace(&self) {
        Tap::keep_pace(self);
    }
}

impl<T> TapState<T> {
    /// What the observer is not done with.
    fn left(&self) -> u64 {
        self.queue.len() as u64 + u64::from(self.busy) + self.missing
    }
}

impl<T> TapShared<T> {
    fn put(&self, what: T, own: usize) {
        let mut state = lock(&self.state);
        if state.closed || state.gone {
            return;
        }
        let room = state.queue.len() < self.bound + own;
        if state.missing > 0 {
            let keeps_up = state.queue.len() <= self.bound / 2 && self.until_told(&state).is_zero();
            if !(keeps_up || own > 0 && room) {
                state.missing += 1;
                return;
            }
            let missing = std::mem::take(&mut state.missing);
            state.told = Some(self.clock.now());
            state.queue.push_back(News::Missed(missing));
        } else if !room {
            state.missing = 1;
            return;
        }
        state.queue.push_back(News::One(what));
        self.put.notify_one();
    }

    /// How long it is until a hole may be told again. Simulated time does not go on for it.
    fn until_told(&self, state: &TapState<T>) -> Duration {
        match state.told {
            Some(told) if !self.clock.is_simulated() => (told + limits::DROPS_TOLD).since(self.clock.now()),
            _ => Duration::ZERO,
        }
    }

    /// Waits until the observer has done one more, or ends, at most for `patience`.
    fn wait_for_progress<'a>(
        &'a self,
        state: MutexGuard<'a, TapState<T>>,
        patience: Duration,
    ) -> MutexGuard<'a, TapState<T>> {
        let done = state.done;
        let still = |state: &mut TapState<T>| state.done == done && !state.gone;
        self.taken.wait_timeout_while(state, patience, still).unwrap_or_else(PoisonError::into_inner).0
    }

    fn live(&self, mut observer: impl FnMut(News<T>)) {
        let _gone = TapGone(self);
        while let Some(news) = self.next() {
            observer(news);
            let mut state = lock(&self.state);
            state.done += 1;
            (state.busy, state.stalled) = (false, false);
            drop(state);
            self.taken.notify_all();
        }
    }

    fn next(&self) -> Option<News<T>> {
        let mut state = lock(&self.state);
        loop {
            if let Some(news) = state.queue.pop_front() {
                state.busy = true;
                return Some(news);
            }
            let left = if state.closed { Duration::ZERO } else { self.until_told(&state) };
            if state.missing > 0 && left.is_zero() {
                state.busy = true;
                state.told = Some(self.clock.now());
                return Some(News::Missed(std::mem::take(&mut state.missing)));
            }
            if state.closed {
                return None;
            }
            state = match state.missing {
                0 => self.put.wait(state).unwrap_or_else(PoisonError::into_inner),
                _ => self.put.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0,
            };
        }
    }
}

/// However the observer ends, nobody waits for it any more, and nothing is kept for it.
struct TapGone<'a, T>(&'a TapShared<T>);

impl<T> Drop for TapGone<'_, T> {
    fn drop(&mut self) {
        let mut state = lock(&self.0.state);
        state.gone = true;
        let rest = std::mem::take(&mut state.queue);
        drop(state);
        drop(rest);
        self.0.taken.notify_all();
    }
}
