//! What one call may take, and what its errors are called.

use crate::limits;
use mlua::{HookTriggers, Lua, Result, VmState};
use std::cell::Cell;
use std::rc::Rc;

/// Instructions between two looks.
const TICK: u32 = 1_000;

/// Counts the instructions of the call under way. Once they are used up every look fails, and what protects calls in Lua
/// passes that on, so that the call ends wherever it is.
#[derive(Debug, Default)]
pub struct Budget {
    used: Cell<u64>,
    limit: Cell<u64>,
    depth: Cell<u32>,
    over: Cell<bool>,
}

impl Budget {
    /// Puts a budget on all code of a Lua state, coroutines included.
    pub fn install(lua: &Lua) -> Result<Rc<Self>> {
        lua.set_memory_limit(limits::FUNCTIONS_BYTES)?;
        let budget = Rc::new(Self { limit: Cell::new(limits::LUA_INSTRUCTIONS), ..Self::default() });
        let counted = budget.clone();
        lua.set_global_hook(HookTriggers::new().every_nth_instruction(TICK), move |_, _| {
            counted.used.set(counted.used.get() + u64::from(TICK));
            if counted.used.get() > counted.limit.get() {
                counted.over.set(true);
                return Err(counted.error());
            }
            Ok(VmState::Continue)
        })?;
        Ok(budget)
    }

    /// Whether the budget of the call under way is used up.
    pub fn is_over(&self) -> bool {
        self.over.get()
    }

    fn error(&self) -> mlua::Error {
        let limit = self.limit.get() / 1_000_000;
        mlua::Error::runtime(format!("ended after {limit} million instructions: is there an endless loop?"))
    }

    /// Makes a call of at most `limit` instructions. A call inside another shares the outer one's budget.
    pub fn spend<R>(&self, limit: u64, call: impl FnOnce() -> Result<R>) -> Result<R> {
        let outermost = self.depth.get() == 0;
        if outermost {
            self.used.set(0);
            self.limit.set(limit);
        }
        self.depth.set(self.depth.get() + 1);
        let outcome = call();
        self.depth.set(self.depth.get() - 1);
        if outermost && self.over.replace(false) {
            return Err(self.error());
        }
        outcome
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
