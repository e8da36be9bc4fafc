//! What one call may take.

use super::count::Count;
use super::errors::placed;
use super::exact;
#[cfg(target_os = "linux")]
use super::watch::CallWatch;
use mlua::{Lua, Result};
use std::cell::Cell;
#[cfg(target_os = "linux")]
use std::cell::OnceCell;
use std::rc::Rc;
use std::time::Duration;

/// Counts the instructions of the call under way. Once they are used up every look fails, and what protects calls in Lua
/// passes that on, so that the call ends wherever it is.
///
/// Counting costs more than most calls. It is exact, from the first instruction on, until [`Budget::count_late`]. What
/// instructions set in motion (`work.rs`) is always counted.
pub struct Budget {
    /// What the call under way has used.
    pub count: Rc<Count>,
    depth: Cell<u32>,
    /// Finds the calls that take long; none: all are counted.
    #[cfg(target_os = "linux")]
    watch: OnceCell<CallWatch>,
}

impl Budget {
    /// Puts a budget on all code of a Lua state, coroutines included. `time` is the processor time that a call may take
    /// where all is counted.
    pub fn install(lua: &Lua, time: Duration) -> Result<Rc<Self>> {
        let count = Rc::new(Count::new(time));
        exact::begin(lua)?;
        #[cfg(target_os = "linux")]
        let budget = Self { count, depth: Cell::new(0), watch: OnceCell::new() };
        #[cfg(not(target_os = "linux"))]
        let budget = Self { count, depth: Cell::new(0) };
        Ok(Rc::new(budget))
    }

    /// From now on counts the instructions of a call only when it has taken longer than
    /// [`limits::CALL_TICK`](crate::limits::CALL_TICK) on this thread. Where the operating system gives no timer for that,
    /// every call is counted as before.
    pub fn count_late(&self, lua: &Lua) {
        #[cfg(target_os = "linux")]
        {
            let count = Rc::downgrade(&self.count);
            let look = move |instructions| count.upgrade().is_some_and(|count| count.ticked(instructions));
            if let Some(watch) = CallWatch::start(lua, look)
                && exact::end(lua).is_ok()
            {
                let _ = self.watch.set(watch);
                self.count.count_late();
            }
        }
        #[cfg(not(target_os = "linux"))]
        let _ = lua;
    }

    /// Makes a call of at most `limit` instructions. A call inside another shares the outer one's budget.
    pub fn spend<R>(&self, limit: u64, call: impl FnOnce() -> Result<R>) -> Result<R> {
        struct Leave<'a>(&'a Cell<u32>);
        impl Drop for Leave<'_> {
            fn drop(&mut self) {
                self.0.set(self.0.get() - 1);
            }
        }
        let outermost = self.depth.get() == 0;
        self.depth.set(self.depth.get() + 1);
        let leave = Leave(&self.depth);
        if !outermost {
            return call();
        }
        self.count.begin(limit);
        let outcome = exact::during(&self.count, || self.watched(call));
        drop(leave);
        match self.count.end() {
            // What it was doing then is where to look.
            Some(used_up) => Err(match &outcome {
                Err(at) => placed(used_up, at),
                Ok(_) => used_up,
            }),
            None => outcome,
        }
    }

    #[cfg(target_os = "linux")]
    fn watched<R>(&self, call: impl FnOnce() -> R) -> R {
        match self.watch.get() {
            Some(watch) => watch.during(call),
            None => call(),
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn watched<R>(&self, call: impl FnOnce() -> R) -> R {
        call()
    }
}
