//! The guards of a Lua world in which texts of others run: what is protected, what loops in the library, and what patterns
//! cost. Used by coordinators' functions (`host.rs`) and by scripts; configurations have a closed world of their own
//! (`lang`), and use only [`loops`].

use super::budget::Budget;
use super::errors::message_within;
use super::{patterns, work};
use mlua::chunk::ChunkMode;
use mlua::thread::ThreadStatus;
use mlua::{Function, Lua, LuaString, Result, Table, Thread, Value};
use std::rc::Rc;
use std::sync::OnceLock;
use std::time::Duration;

const GUARDS: &str = include_str!("lua/guards.lua");
const LOOPS: &str = include_str!("lua/loops.lua");

/// What a guarded world needs for as long as it lives.
pub struct Guards {
    /// Of all calls.
    pub budget: Rc<Budget>,
    _memory: work::CountedMemory,
}

/// Puts a budget and its guards on a state that has the libraries it will have. `native` is given what the Lua part borrows.
///
/// # Errors
/// When Lua has no memory for it.
pub fn install(lua: &Lua, native: &Table, bytes: usize, time: Duration) -> Result<Guards> {
    lua.set_memory_limit(bytes)?;
    let budget = Budget::install(lua, time)?;
    let memory = work::count_memory(lua)?;
    let charge = work::charge(lua)?;
    native.raw_set("charge", &charge)?;
    loops(lua, &charge)?;
    let look = budget.clone();
    native.raw_set("over", lua.create_function(move |_, ()| Ok(look.count.is_over()))?)?;
    let ended = budget.clone();
    let failure = move |lua: &Lua, ()| lua.create_string(ended.count.ended().to_bytes());
    native.raw_set("failure", lua.create_function(failure)?)?;
    native.raw_set(
        "text_of",
        lua.create_function(move |lua, value: Value| match value {
            Value::Error(error) => Ok(Value::String(lua.create_string(message_within(&error, bytes))?)),
            other => Ok(other),
        })?,
    )?;
    // Of an error, not by coming to its end.
    let died = |_: &Lua, thread: Thread| Ok(thread.status() == ThreadStatus::Error);
    native.raw_set("died", lua.create_function(died)?)?;
    #[cfg(target_os = "linux")]
    {
        let (resume, close) = super::watch::functions(lua)?;
        native.raw_set("resume", resume)?;
        native.raw_set("close", close)?;
    }
    patterns_of(lua, native, &budget)?;
    lua.load(GUARDS).set_name("=[davit]").into_function()?.call::<()>(native)?;
    Ok(Guards { budget, _memory: memory })
}

/// Replaces the functions of a state's libraries that loop where nothing is counted: `charge` is called with a number of
/// elements before they are gone through, and raises an error when they are too many. `pairs` keeps an order.
///
/// # Errors
/// When Lua has no memory for it.
pub fn loops(lua: &Lua, charge: &Function) -> Result<()> {
    let globals = lua.globals();
    let library = |name: &str| globals.raw_get::<Value>(name);
    let arguments = (charge, library("string")?, library("table")?, library("utf8")?);
    let (tonumber, pairs): (Function, Function) = compiled(lua)?.call(arguments)?;
    globals.raw_set("pairs", pairs)?;
    globals.raw_set("tonumber", tonumber)
}

/// [`LOOPS`] as a function: read once in a process, for that costs more than all else that makes a state.
fn compiled(lua: &Lua) -> Result<Function> {
    static CODE: OnceLock<Vec<u8>> = OnceLock::new();
    if let Some(code) = CODE.get() {
        return lua.load(&code[..]).set_mode(ChunkMode::Binary).set_name("=[davit]").into_function();
    }
    let function = lua.load(LOOPS).set_name("=[davit]").into_function()?;
    let _ = CODE.set(function.dump(false));
    Ok(function)
}

/// What is asked before a pattern function of Lua's runs.
fn patterns_of(lua: &Lua, native: &Table, budget: &Rc<Budget>) -> Result<()> {
    let room = |_: &Lua, pattern: LuaString| {
        Ok(patterns::room(&pattern.as_bytes()).map_or(-1, |room| i64::try_from(room).unwrap_or(i64::MAX)))
    };
    native.raw_set("room", lua.create_function(room)?)?;
    let spent = budget.clone();
    let walk = move |_: &Lua, args: (LuaString, LuaString, Option<i64>, Option<i64>, bool)| {
        let (text, pattern, from, matches, anchors) = args;
        let (text, pattern) = (text.as_bytes(), pattern.as_bytes());
        let from = start(from, text.len());
        let matches = matches.map_or(usize::MAX, |matches| usize::try_from(matches.max(0)).unwrap_or(usize::MAX));
        let (anchored, pattern) = match pattern.strip_prefix(b"^").filter(|_| anchors) {
            Some(rest) => (true, rest),
            None => (false, &*pattern),
        };
        match patterns::walk(&text, pattern, from, matches, anchored, &mut spent.count.steps()) {
            Err(patterns::Stop::Over) => Err(spent.count.error()),
            _ => Ok(()),
        }
    };
    native.raw_set("walk", lua.create_function(walk)?)?;
    let spent = budget.clone();
    let walk_plain = move |_: &Lua, (text, what, from): (LuaString, LuaString, Option<i64>)| {
        let (text, what) = (text.as_bytes(), what.as_bytes());
        match patterns::walk_plain(&text, &what, start(from, text.len()), &mut spent.count.steps()) {
            Err(patterns::Stop::Over) => Err(spent.count.error()),
            _ => Ok(()),
        }
    };
    native.raw_set("walk_plain", lua.create_function(walk_plain)?)
}

/// From which byte on, where Lua counts from one, and from the end where negative.
fn start(from: Option<i64>, length: usize) -> usize {
    let from = from.unwrap_or(1);
    let length = i64::try_from(length).unwrap_or(i64::MAX);
    let from = if from < 0 { length.saturating_add(from) } else { from.saturating_sub(1) };
    usize::try_from(from.max(0)).unwrap_or(usize::MAX)
}
