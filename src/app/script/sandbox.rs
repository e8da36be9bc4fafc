//! The Lua that scripts run in: the language and its harmless libraries, no files, processes or network, and bounds on
//! memory and on instructions, which nothing in a script outlives.

use crate::functions::{self, Guards};
use crate::limits;
use mlua::{Lua, LuaOptions, Result, StdLib, Value};

/// A state for one script, and its guards, which go before it.
///
/// # Errors
/// When Lua has no memory for it.
pub fn state() -> Result<(Lua, Guards)> {
    let lua = Lua::new_with(StdLib::TABLE | StdLib::STRING | StdLib::MATH | StdLib::UTF8, LuaOptions::default())?;
    let globals = lua.globals();
    for closed in ["load", "loadfile", "dofile", "collectgarbage", "require", "print"] {
        globals.raw_set(closed, Value::Nil)?;
    }
    let guards = functions::guard(&lua, &lua.create_table()?, limits::SCRIPT_MEMORY, limits::SCRIPT_TIME)?;
    Ok((lua, guards))
}
