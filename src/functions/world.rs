//! The Lua state of a coordinator with functions: what is there, under which names, what is closed, and how a program is run in it.

use super::guards;
use super::host::{FileReader, Host, RFSM_KEY, run};
use super::native;
use super::values::to_lua;
use crate::limits;
use crate::model::program::{Openings, Program};
use mlua::{Lua, LuaOptions, MultiValue, Result, StdLib, Table, Value};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// The parts that are written in Lua.
const RFSM: &str = include_str!("lua/rfsm.lua");
const MERGE: &str = include_str!("lua/merge.lua");
const PLUGINS: &str = include_str!("lua/plugins.lua");
const BASE: &str = include_str!("lua/base.lua");

/// A state with everything in it that a model finds, and nothing run yet.
pub fn state(open: Openings, reader: FileReader) -> Result<(Lua, Rc<Host>)> {
    let mut libraries = StdLib::TABLE | StdLib::STRING | StdLib::MATH | StdLib::COROUTINE | StdLib::UTF8;
    if open.io {
        libraries |= StdLib::IO;
    }
    if open.os {
        libraries |= StdLib::OS;
    }
    let lua = Lua::new_with(libraries, LuaOptions::new().catch_rust_panics(true))?;
    let native = lua.create_table()?;
    let guards = guards::install(&lua, &native, limits::FUNCTIONS_BYTES, limits::CALL_TIME)?;
    let spot_of = lua.create_table()?;
    let weak = lua.create_table()?;
    weak.raw_set("__mode", "k")?;
    spot_of.set_metatable(Some(weak))?;
    let host = Rc::new(Host {
        budget: guards.budget.clone(),
        _guards: guards,
        voice: Rc::default(),
        spots: RefCell::default(),
        spot_of: spot_of.clone(),
        machines: RefCell::default(),
        gettime: RefCell::default(),
        clock: RefCell::default(),
        reader: RefCell::new(reader),
        loading: RefCell::default(),
        serial: Cell::new(0),
        path: Cell::default(),
        native,
    });
    native::install(&lua, &host)?;
    host.budget.spend(limits::LUA_INSTRUCTIONS, || {
        let rfsm: Table = lua.load(RFSM).set_name("=rfsm").into_function()?.call((&host.native, &spot_of))?;
        lua.set_named_registry_value(RFSM_KEY, &rfsm)?;
        lua.load(MERGE).set_name("=rfsm").into_function()?.call::<()>((&host.native, &rfsm))?;
        let plugins: Table = lua.load(PLUGINS).set_name("=rfsm").into_function()?.call((&host.native, &rfsm))?;
        lua.load(BASE).set_name("=rfsm").into_function()?.call::<()>((&host.native, &rfsm, &plugins))
    })?;
    Ok((lua, host))
}

/// Runs a program: parameters, host files, the model. Answers the model's template.
pub fn run_program(lua: &Lua, host: &Host, program: &Program) -> std::result::Result<Value, (String, mlua::Error)> {
    let globals = lua.globals();
    let mut values = MultiValue::new();
    let run_all = |values: &mut MultiValue| -> std::result::Result<(), (String, mlua::Error)> {
        let at = |file: &str| {
            let file = file.to_owned();
            move |error| (file, error)
        };
        for (name, value) in &program.with {
            let value = to_lua(lua, value).map_err(at(&program.file))?;
            globals.raw_set(name.as_str(), value).map_err(at(&program.file))?;
        }
        for (file, text) in &program.host {
            let ran = host.budget.spend(limits::LUA_INSTRUCTIONS, || run(lua, file, text));
            ran.map_err(at(file))?;
        }
        let _loading = host.loading(&program.file).map_err(at(&program.file))?;
        *values = host
            .budget
            .spend(limits::LUA_INSTRUCTIONS, || run(lua, &program.file, &program.text))
            .map_err(at(&program.file))?;
        Ok(())
    };
    run_all(&mut values)?;
    Ok(values.pop_front().unwrap_or(Value::Nil))
}
