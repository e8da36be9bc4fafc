//! `rfsm.load` and `rfsm.load_str`: a statechart made of several files. What they load runs in the same closed world,
//! under the same budgets.

use super::recorder::SharedRecorder;
use super::{Loads, chunk, convert, sandbox};
use crate::diagnostics::Language;
use crate::lang::tree::Reading;
use crate::model::{Finding, codes};
use mlua::{Lua, LuaString, Result, Table, Value};

/// What a text that is loaded is called.
const TEXT: &str = "rfsm.load_str";

/// Levels of files that load files.
const LEVELS: usize = 16;

/// Puts both into the module `rfsm` of the environment.
pub fn install(lua: &Lua, env: &Table, shared: &SharedRecorder) -> Result<()> {
    let rfsm: Table = env.raw_get("rfsm")?;
    let (recorder, world) = (shared.clone(), env.clone());
    rfsm.raw_set(
        "load",
        lua.create_function(move |lua, name: LuaString| {
            let name = name.to_string_lossy();
            let Some((text, reading)) = read(&recorder, &name, sandbox::line(lua)) else {
                return Ok(convert::poison());
            };
            within(lua, &recorder, &text, reading, &world)
        })?,
    )?;
    let (recorder, world) = (shared.clone(), env.clone());
    rfsm.raw_set(
        "load_str",
        lua.create_function(move |lua, text: LuaString| {
            let text = text.to_string_lossy();
            let reading = {
                let mut recorder = recorder.borrow_mut();
                let file = recorder.cx.sources.add_file(TEXT, text.clone(), Language::Lua);
                Reading { file, whole: recorder.cx.sources.whole_file(file) }
            };
            within(lua, &recorder, &text, reading, &world)
        })?,
    )
}

/// Runs a text as a file of its own; lines in findings are its.
fn within(lua: &Lua, shared: &SharedRecorder, text: &str, reading: Reading, world: &Table) -> Result<Value> {
    let before = {
        let mut recorder = shared.borrow_mut();
        let name = |file| recorder.cx.sources.file(file).name.to_string();
        let (loader, file) = (name(recorder.reading.file), name(reading.file));
        if recorder.loading.is_empty() {
            recorder.loading.push(loader);
        }
        if file != TEXT
            && let Some(at) = recorder.loading.iter().position(|known| *known == file)
        {
            let way: Vec<&str> = recorder.loading[at..].iter().chain([&file]).map(String::as_str).collect();
            return Err(mlua::Error::runtime(format!("files load each other in a circle: {}", way.join(" -> "))));
        }
        recorder.loading.push(file);
        if recorder.loading.len() > LEVELS {
            return Err(mlua::Error::runtime(format!("files load files more than {LEVELS} deep")));
        }
        std::mem::replace(&mut recorder.reading, reading)
    };
    // After an error the run is over, and the error's line is one of this text.
    let value: Value = chunk(lua, shared, text, world.clone())?.call(())?;
    let mut recorder = shared.borrow_mut();
    recorder.reading = before;
    recorder.loading.pop();
    Ok(value)
}

fn read(shared: &SharedRecorder, name: &str, line: u32) -> Option<(String, Reading)> {
    let mut recorder = shared.borrow_mut();
    let at = recorder.word_at(line, name);
    let Some(Loads { from, folder }) = recorder.loads.clone() else {
        let finding =
            Finding::error(codes::LUA_CLOSED, format!("`rfsm.load(\"{name}\")`: other files are closed here"));
        recorder.cx.report(finding.at(at).help("only a coordinator's file may load others, and only by a plain name"));
        return None;
    };
    let path = folder.join(name);
    if path.extension().is_none_or(|ending| ending != "lua") {
        let finding = Finding::error(codes::TEXT_UNKNOWN_LANGUAGE, format!("`{name}` is not Lua by its name"));
        recorder.cx.report(finding.at(at).help("a statechart's file ends in `.lua`"));
        return None;
    }
    match from.read(&path) {
        Ok(text) if !text.starts_with('\u{1b}') => {
            let file = recorder.cx.sources.add_file(from.shown(&path), text.clone(), Language::Lua);
            let whole = recorder.cx.sources.whole_file(file);
            Some((text, Reading { file, whole }))
        }
        Ok(_) => {
            let finding = Finding::error(codes::LUA_BYTECODE, "this is compiled Lua").at(at);
            recorder.cx.refuse(finding.help("only texts are read: name the source file"));
            None
        }
        Err(finding) => {
            recorder.cx.refuse(finding.at(at));
            None
        }
    }
}
