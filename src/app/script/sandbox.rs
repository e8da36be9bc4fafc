//! The Lua that scripts run in: the language and its harmless libraries, no files, processes or network, and bounds on
//! memory and on instructions between two of its answers.

use crate::limits;
use mlua::{HookTriggers, Lua, LuaOptions, Result, StdLib, Value, VmState};
use std::cell::Cell;

/// A state for one script.
///
/// # Errors
/// When Lua has no memory for it.
pub fn state() -> Result<Lua> {
    let lua = Lua::new_with(StdLib::TABLE | StdLib::STRING | StdLib::MATH | StdLib::UTF8, LuaOptions::default())?;
    let globals = lua.globals();
    for closed in ["load", "loadfile", "dofile", "collectgarbage", "require", "print"] {
        globals.raw_set(closed, Value::Nil)?;
    }
    lua.set_memory_limit(limits::SCRIPT_MEMORY)?;
    let used = Cell::new(0_u64);
    lua.set_global_hook(HookTriggers::new().every_nth_instruction(TICK), move |lua, _| {
        used.set(used.get() + u64::from(TICK));
        if used.get() <= limits::SCRIPT_INSTRUCTIONS {
            return Ok(VmState::Continue);
        }
        // From here on every instruction fails, so that `pcall` cannot go on.
        lua.set_global_hook(HookTriggers::new().every_nth_instruction(1), |_, _| Err(over()))?;
        Err(over())
    })?;
    Ok(lua)
}

const TICK: u32 = 10_000;

fn over() -> mlua::Error {
    let millions = limits::SCRIPT_INSTRUCTIONS / 1_000_000;
    mlua::Error::runtime(format!("the script ran more than {millions} million instructions: is there an endless loop?"))
}

/// The text of an error, with file and line where Lua knows them, without stack traces.
pub fn message(error: &mlua::Error) -> String {
    match error {
        mlua::Error::CallbackError { cause, traceback } => {
            let text = message(cause);
            match place(traceback) {
                Some(place) if !text.starts_with(&place) => format!("{place}: {text}"),
                _ => text,
            }
        }
        mlua::Error::SyntaxError { message, .. }
        | mlua::Error::RuntimeError(message)
        | mlua::Error::MemoryError(message) => {
            message.split("\nstack traceback:").next().unwrap_or_default().to_owned()
        }
        other => other.to_string(),
    }
}

/// The innermost place of the script in a stack trace: `story.lua:12`.
fn place(traceback: &str) -> Option<String> {
    traceback.lines().map(str::trim).find_map(|line| {
        let mut parts = line.splitn(3, ':');
        let (file, number) = (parts.next()?, parts.next()?);
        let known = !file.starts_with('[') && number.bytes().all(|b| b.is_ascii_digit()) && !number.is_empty();
        known.then(|| format!("{file}:{number}"))
    })
}

/// The text without a first line `#!…`, which the shell reads and Lua does not; its line stays, for the numbers.
pub fn without_hash_bang(text: &[u8]) -> &[u8] {
    if !text.starts_with(b"#") {
        return text;
    }
    let end = text.iter().position(|b| *b == b'\n').unwrap_or(text.len());
    &text[end..]
}
