//! What one call may take, and what its errors are called.

use super::exact;
#[cfg(target_os = "linux")]
use super::watch::Watch;
use crate::limits;
use mlua::{Lua, Result};
use std::cell::Cell;
#[cfg(target_os = "linux")]
use std::cell::OnceCell;
use std::rc::Rc;

/// Counts the instructions of the call under way. Once they are used up every look fails, and what protects calls in Lua
/// passes that on, so that the call ends wherever it is.
///
/// Counting costs more than most calls. It is exact, from the first instruction on, until [`Budget::count_late`].
#[derive(Default)]
pub struct Budget {
    used: Cell<u64>,
    limit: Cell<u64>,
    depth: Cell<u32>,
    over: Cell<bool>,
    /// Finds the calls that take long; none: all are counted.
    #[cfg(target_os = "linux")]
    watch: OnceCell<Watch>,
}

impl Budget {
    /// Puts a budget on all code of a Lua state, coroutines included.
    pub fn install(lua: &Lua) -> Result<Rc<Self>> {
        lua.set_memory_limit(limits::FUNCTIONS_BYTES)?;
        let budget = Rc::new(Self { limit: Cell::new(limits::LUA_INSTRUCTIONS), ..Self::default() });
        exact::begin(lua)?;
        Ok(budget)
    }

    /// From now on counts the instructions of a call only when it has taken longer than [`limits::CALL_TICK`] on this
    /// thread. Where the operating system gives no timer for that, every call is counted as before.
    pub fn count_late(self: &Rc<Self>, lua: &Lua) {
        #[cfg(target_os = "linux")]
        {
            let budget = Rc::downgrade(self);
            let look = move |instructions| budget.upgrade().is_some_and(|budget| budget.look(instructions));
            if let Some(watch) = Watch::start(lua, look)
                && exact::end(lua).is_ok()
            {
                let _ = self.watch.set(watch);
            }
        }
        #[cfg(not(target_os = "linux"))]
        let _ = lua;
    }

    /// Whether the budget of the call under way is used up.
    pub fn is_over(&self) -> bool {
        self.over.get()
    }

    /// Whether only calls that take long are counted.
    pub(super) fn counts_late(&self) -> bool {
        #[cfg(target_os = "linux")]
        return self.watch.get().is_some();
        #[cfg(not(target_os = "linux"))]
        false
    }

    /// So many instructions more; whether they are too many.
    pub(super) fn look(&self, instructions: u32) -> bool {
        self.used.set(self.used.get() + u64::from(instructions));
        let over = self.used.get() > self.limit.get();
        if over {
            self.over.set(true);
        }
        over
    }

    /// Counts the steps of something that is no Lua, each like an instruction; `false`: they are used up.
    pub fn steps(&self) -> impl FnMut() -> bool + '_ {
        let mut steps = 0;
        move || {
            steps += 1;
            if steps < limits::CALL_LOOK {
                return true;
            }
            steps = 0;
            !self.look(limits::CALL_LOOK)
        }
    }

    /// What a call whose budget is used up ends with.
    pub fn error(&self) -> mlua::Error {
        let limit = self.limit.get() / 1_000_000;
        mlua::Error::runtime(format!("ended after {limit} million instructions: is there an endless loop?"))
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
        self.used.set(0);
        self.limit.set(limit);
        let outcome = exact::during(self, || self.watched(call));
        drop(leave);
        if self.over.replace(false) {
            return Err(self.error());
        }
        outcome
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

/// The text of an error, with file and line where Lua knows them, without stack traces.
pub fn message_of(error: &mlua::Error) -> String {
    let text = match error {
        mlua::Error::CallbackError { cause, .. } => return message_of(cause),
        mlua::Error::SyntaxError { message, .. }
        | mlua::Error::RuntimeError(message)
        | mlua::Error::MemoryError(message) => message.clone(),
        other => other.to_string(),
    };
    let text = text.split("\nstack traceback:").next().unwrap_or_default();
    let text = text.strip_prefix("runtime error: ").unwrap_or(text);
    if text.contains("not enough memory") {
        let mb = limits::FUNCTIONS_BYTES / 1024 / 1024;
        return format!("needs more than the {mb} MB of memory that the coordinator's functions may hold");
    }
    text.to_owned()
}

/// The global name that an error found undefined.
pub fn undefined_global(message: &str) -> Option<&str> {
    message.split("(global '").nth(1)?.split('\'').next().filter(|name| !name.is_empty())
}
