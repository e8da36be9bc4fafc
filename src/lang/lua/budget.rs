//! The budgets of a Lua file: instructions, and what counts like them; processor time; memory.

use super::recorder::{Exhausted, SharedRecorder};
use super::sandbox::line_from;
use crate::functions::processor_time;
use crate::limits;
use crate::model::codes;
use mlua::debug::HookTriggers;
use mlua::{Function, Lua, Table, Value, VmState};

/// Instructions between two looks at the budgets. Library calls count as one instruction each, so it is small: between
/// two looks a file can make only so many of them.
const TICK: u32 = 100;

/// Starts counting. The hook is global (coroutines have it too); once a budget is used up it fires at every
/// instruction and fails each time, so that no code of the file goes on.
pub fn start(lua: &Lua, shared: &SharedRecorder) -> mlua::Result<()> {
    let recorder = shared.clone();
    let started = processor_time();
    // Strings have a metatable, which a file can reach.
    if let Some(meta) = lua.type_metatable::<mlua::LuaString>() {
        known_metatables(lua)?.raw_set(meta, true)?;
    }
    lua.set_global_hook(HookTriggers::new().every_nth_instruction(TICK), move |lua, _| {
        let mut recorder = recorder.borrow_mut();
        recorder.instructions += u64::from(TICK);
        if recorder.exhausted.is_none() {
            let over = if recorder.instructions > limits::LUA_INSTRUCTIONS {
                Some((codes::LUA_INSTRUCTIONS, too_many()))
            } else if processor_time().saturating_sub(started) > limits::LUA_TIME {
                let limit = limits::LUA_TIME.as_secs_f64();
                Some((codes::LUA_INSTRUCTIONS, format!("the file keeps the processor longer than {limit} s")))
            } else {
                None
            };
            if let Some((code, message)) = over {
                let line = line_from(lua, 0);
                recorder.exhausted = Some(Exhausted { code, message, line });
            }
        }
        if recorder.exhausted.is_none() {
            return Ok(VmState::Continue);
        }
        drop(recorder);
        close_nothing(lua)?;
        lua.set_global_hook(HookTriggers::new().every_nth_instruction(1), |_, _| {
            Err(mlua::Error::runtime("the budget is used up"))
        })?;
        Err(mlua::Error::runtime("the budget is used up"))
    })
}

fn too_many() -> String {
    format!("the file runs longer than {} million instructions", limits::LUA_INSTRUCTIONS / 1_000_000)
}

/// Counts the elements that a function of the library is going to touch, where no hook reaches.
pub fn charge(lua: &Lua, shared: &SharedRecorder) -> mlua::Result<Function> {
    let recorder = shared.clone();
    lua.create_function(move |lua, elements: f64| {
        let at = line_from(lua, 1);
        let mut recorder = recorder.borrow_mut();
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // saturates, and no number is zero
        let elements = elements.ceil() as u64;
        recorder.instructions = recorder.instructions.saturating_add(elements / limits::CALL_ELEMENTS);
        if recorder.instructions <= limits::LUA_INSTRUCTIONS && recorder.exhausted.is_none() {
            return Ok(());
        }
        let exhausted = Exhausted { code: codes::LUA_INSTRUCTIONS, message: too_many(), line: at };
        recorder.exhausted.get_or_insert(exhausted);
        Err(mlua::Error::runtime("the budget is used up"))
    })
}

/// All metatables of a file, as the keys of a table that does not keep them.
pub fn known_metatables(lua: &Lua) -> mlua::Result<Table> {
    const KEY: &str = "davit.metatables";
    if let Some(known) = lua.named_registry_value::<Option<Table>>(KEY)? {
        return Ok(known);
    }
    let (known, weak) = (lua.create_table()?, lua.create_table()?);
    weak.raw_set("__mode", "k")?;
    known.set_metatable(Some(weak))?;
    lua.set_named_registry_value(KEY, &known)?;
    Ok(known)
}

/// Variables that close something (`local x <close>`) close nothing any more: what an error closes on its way out of a
/// hook, or with a coroutine that has ended, runs with hooks off, where no budget reaches.
fn close_nothing(lua: &Lua) -> mlua::Result<()> {
    known_metatables(lua)?.for_each(|meta: Table, _: bool| meta.raw_set("__close", Value::Nil))
}
