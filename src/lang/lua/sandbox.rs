//! The closed world of a Lua file: which names exist, and the budgets it runs under.
//!
//! Absent on purpose: files, processes, network, `require` of anything but rFSM's constructors, loading of text or
//! bytecode, the debug library, random numbers (a file must give the same model every time), finalisers (`__gc` runs
//! where no budget can stop it), and the pattern functions of `string` (one call can run for years and is not
//! interrupted by a hook). `table.sort` and `table.concat` are ours, since the library's run long in one instruction; the
//! other functions that loop are charged before they do (`functions::loops`).

use super::budget::{charge, known_metatables};
use super::convert;
use super::recorder::{ReadName, SharedRecorder};
use crate::functions;
use crate::lang::tree::Kind;
use crate::limits;
use crate::model::finding::{did_you_mean, nearest};
use crate::model::{Finding, codes};
use mlua::{Function, LightUserData, Lua, MultiValue, Table, Thread, Value};

/// What of Lua's base library a file may use.
const BASE: &[&str] = &[
    "assert",
    "error",
    "getmetatable",
    "ipairs",
    "next",
    "pairs",
    "rawequal",
    "rawget",
    "rawlen",
    "rawset",
    "select",
    "tonumber",
    "tostring",
    "type",
    "_VERSION",
];

/// What of `string`.
const STRING: &[&str] = &["byte", "char", "format", "len", "lower", "reverse", "sub", "upper"];

/// What of `table`.
const TABLE: &[&str] = &["insert", "pack", "remove", "unpack"];

/// What of `coroutine`.
const COROUTINE: &[&str] = &["create", "isyieldable", "running", "status", "wrap", "yield"];

/// What of `math`.
const NOT_OF_MATH: &[&str] = &["random", "randomseed"];

/// Names of Lua that are closed, with what to say about them.
const CLOSED: &[(&str, &str)] = &[
    ("io", "files are closed to Lua here"),
    ("os", "processes, files and the time are closed to Lua here"),
    ("debug", "the debug library is closed to Lua here"),
    ("package", "other files are closed to Lua here"),
    ("load", "loading of text is closed to Lua here"),
    ("loadstring", "loading of text is closed to Lua here"),
    ("loadfile", "other files are closed to Lua here"),
    ("dofile", "other files are closed to Lua here"),
    ("collectgarbage", "memory is looked after"),
    ("string.find", "pattern functions are left out: one call can run without end"),
    ("string.match", "pattern functions are left out: one call can run without end"),
    ("string.gmatch", "pattern functions are left out: one call can run without end"),
    ("string.gsub", "pattern functions are left out: one call can run without end"),
    ("string.dump", "bytecode is closed to Lua here"),
    ("string.pack", "binary data has no use here"),
    ("string.unpack", "binary data has no use here"),
    ("table.move", "write a loop instead"),
    ("math.random", "a file must give the same model every time"),
    ("math.randomseed", "a file must give the same model every time"),
    ("coroutine.close", "coroutines end by themselves"),
];

/// Why a name of Lua is not there; none: it is, or is none of Lua's.
pub fn why_closed(name: &str) -> Option<&'static str> {
    let name = if name == "require" { "dofile" } else { name };
    CLOSED.iter().find(|(closed, _)| *closed == name).map(|(_, why)| *why)
}

const SORT: &str = "
return function(list, less)
  less = less or function(a, b) return a < b end
  local n, width, other = #list, 1, {}
  while width < n do
    for from = 1, n, 2 * width do
      local i, j = from, from + width
      local i_end, j_end = j, j + width
      if i_end > n + 1 then i_end = n + 1 end
      if j_end > n + 1 then j_end = n + 1 end
      for k = from, j_end - 1 do
        if i < i_end and (j >= j_end or not less(list[j], list[i])) then other[k] = list[i]; i = i + 1
        else other[k] = list[j]; j = j + 1 end
      end
    end
    for k = 1, n do list[k] = other[k] end
    width = 2 * width
  end
end";

/// The line of the Lua code that called the function that is running.
pub fn line(lua: &Lua) -> u32 {
    line_from(lua, 1)
}

/// The same from that level of calls on; 0 is the function that runs.
pub fn line_from(lua: &Lua, level: usize) -> u32 {
    for level in level..level + 5 {
        // Not a line of what is ours.
        let of_file = |debug: &mlua::debug::Debug<'_>| {
            debug.current_line().filter(|_| debug.source().short_src.is_some_and(|source| is_file(&source)))
        };
        if let Some(Some(line)) = lua.inspect_stack(level, of_file) {
            return u32::try_from(line).unwrap_or(u32::MAX);
        }
    }
    1
}

/// The table of globals of a file.
pub fn environment(lua: &Lua, shared: &SharedRecorder) -> mlua::Result<Table> {
    let globals = lua.globals();
    let charge = charge(lua, shared)?;
    functions::loops(lua, &charge)?;
    let env = lua.create_table()?;
    for name in BASE {
        env.raw_set(*name, globals.raw_get::<Value>(*name)?)?;
    }
    let string = library(lua, shared, &env, "string", STRING)?;
    string.raw_set("rep", lua.create_function(repeat)?)?;
    lua.create_string("")?;
    if let Some(strings) = lua.type_metatable::<mlua::LuaString>() {
        strings.raw_set("__index", string)?;
        strings.raw_set("__metatable", false)?;
    }
    let table = library(lua, shared, &env, "table", TABLE)?;
    table.raw_set("concat", lua.create_function(move |lua, arguments| concat(lua, &charge, arguments))?)?;
    table.raw_set("sort", lua.load(SORT).set_name("=sort").eval::<Function>()?)?;
    let math: Table = globals.raw_get("math")?;
    for name in NOT_OF_MATH {
        math.raw_remove(*name)?;
    }
    closed(lua, shared, &math, "math")?;
    env.raw_set("math", math)?;
    let coroutine = library(lua, shared, &env, "coroutine", COROUTINE)?;
    let recorder = shared.clone();
    coroutine.raw_set(
        "resume",
        lua.create_function(move |lua, (thread, args): (Thread, MultiValue)| {
            let outcome = thread.resume::<MultiValue>(args);
            caught(lua, &recorder, outcome)
        })?,
    )?;
    let recorder = shared.clone();
    env.raw_set(
        "pcall",
        lua.create_function(move |lua, (function, args): (Function, MultiValue)| {
            let outcome = function.call::<MultiValue>(args);
            caught(lua, &recorder, outcome)
        })?,
    )?;
    let recorder = shared.clone();
    env.raw_set(
        "xpcall",
        lua.create_function(move |lua, (function, handler, args): (Function, Function, MultiValue)| {
            let mut outcome = caught(lua, &recorder, function.call::<MultiValue>(args))?;
            if outcome.front() == Some(&Value::Boolean(false)) {
                let handled = handler.call::<MultiValue>(outcome.get(1).cloned().unwrap_or(Value::Nil))?;
                outcome = std::iter::once(Value::Boolean(false)).chain(handled).collect();
            }
            Ok(outcome)
        })?,
    )?;
    env.raw_set("setmetatable", lua.create_function(set_metatable)?)?;
    let recorder = shared.clone();
    env.raw_set(
        "print",
        lua.create_function(move |lua, values: MultiValue| {
            let line = line(lua);
            let mut recorder = recorder.borrow_mut();
            if recorder.undefined.insert(format!("\0print {line}")) {
                let origin = recorder.word_at(line, "print");
                let texts: Vec<String> = values.iter().map(|v| v.to_string().unwrap_or_default()).collect();
                let shown: String = texts.join(" ").chars().take(200).collect();
                recorder.cx.report(Finding::info(codes::LUA_PRINT, format!("the file prints: {shown}")).at(origin));
            }
            Ok(())
        })?,
    )?;
    env.raw_set("_G", &env)?;
    undefined(lua, shared, &env, "")?;
    lua.set_type_metatable::<LightUserData>(Some(handles(lua, shared)?));
    Ok(env)
}

/// What a protected call answers. Budgets and memory are not caught: a file must not outlive them.
fn caught(lua: &Lua, shared: &SharedRecorder, outcome: mlua::Result<MultiValue>) -> mlua::Result<MultiValue> {
    match outcome {
        Ok(values) => Ok(std::iter::once(Value::Boolean(true)).chain(values).collect()),
        Err(error) => {
            let message = functions::text_of(&error);
            if shared.borrow().exhausted.is_some() || message.contains("not enough memory") {
                return Err(error);
            }
            let message = Value::String(lua.create_string(message)?);
            Ok([Value::Boolean(false), message].into_iter().collect())
        }
    }
}

/// A library with some of its functions; the others are told to be closed.
fn library(lua: &Lua, shared: &SharedRecorder, env: &Table, name: &'static str, kept: &[&str]) -> mlua::Result<Table> {
    let full: Table = lua.globals().raw_get(name)?;
    let table = lua.create_table()?;
    for function in kept {
        table.raw_set(*function, full.raw_get::<Value>(*function)?)?;
    }
    closed(lua, shared, &table, name)?;
    env.raw_set(name, &table)?;
    Ok(table)
}

fn closed(lua: &Lua, shared: &SharedRecorder, table: &Table, name: &str) -> mlua::Result<()> {
    undefined(lua, shared, table, &format!("{name}."))
}

/// Makes reading an absent name of a table a finding, and its value one that everything can be done with: so one
/// mistake gives one finding, and the rest of the file is still looked at.
pub fn undefined(lua: &Lua, shared: &SharedRecorder, table: &Table, prefix: &str) -> mlua::Result<()> {
    let (recorder, prefix) = (shared.clone(), prefix.to_owned());
    let meta = lua.create_table()?;
    let absent = lua.create_function(move |lua, (table, key): (Table, Value)| {
        let name = match &key {
            Value::String(text) => text.to_string_lossy(),
            // `t[1]` of a library or of the globals: nothing is there, and nobody means a name.
            _ => return Ok(Value::Nil),
        };
        if prefix.is_empty() {
            let mut recorder = recorder.borrow_mut();
            if let Some(param) = recorder.params.all.iter_mut().find(|p| p.name == name) {
                param.used = true;
                let (value, lost) = (convert::to_lua(lua, &param.value)?, matches!(param.value.kind, Kind::Poison));
                if lost {
                    recorder.undefined.insert(name.clone());
                }
                table.raw_set(key, value.clone())?;
                return Ok(value);
            }
        }
        let full = format!("{prefix}{name}");
        let line = line(lua);
        if !recorder.borrow_mut().undefined.insert(full.clone()) {
            return Ok(convert::poison());
        }
        let mut known: Vec<String> = Vec::new();
        table.for_each(|k: Value, _: Value| {
            known.extend(k.as_string().map(mlua::LuaString::to_string_lossy));
            Ok(())
        })?;
        // Who means a value does not mean a function of Lua that happens to be spelt a little like it.
        let far = |k: &String| prefix.is_empty() && BASE.contains(&k.as_str()) && k.chars().next() != name.chars().next();
        known.retain(|k| !far(k));
        known.sort();
        let mut recorder = recorder.borrow_mut();
        known.extend(recorder.params.all.iter().map(|p| p.name.clone()).filter(|_| prefix.is_empty()));
        let origin = match prefix.is_empty() {
            true => recorder.read_at(line, &name),
            false => recorder.word_at(line, &name),
        };
        let finding = match why_closed(&full) {
            Some(why) => Finding::error(codes::LUA_CLOSED, format!("`{full}` is not there: {why}"))
                .at(origin)
                .help("a configuration file is plain data with a little arithmetic: give what it needs as a parameter (`with:`)"),
            None => {
                let near = nearest(&name, known.iter().map(String::as_str));
                let read = recorder.read_here(line, &name);
                let help = match near {
                    // What is not used as it would be was hardly meant.
                    Some(near) if prefix.is_empty() && !is_used_as(&table, near, &read) => {
                        format!("what is a name of something stands in quotes: `\"{}\"`; if not, did you mean `{near}`?", read.path)
                    }
                    Some(near) if prefix.is_empty() => {
                        format!("did you mean `{near}`? what is a name of something stands in quotes: `\"{name}\"`")
                    }
                    Some(near) => format!("did you mean `{prefix}{near}`?"),
                    None if prefix.is_empty() => format!(
                        "if it is a name of something, write it in quotes: `\"{name}\"`; else define it in the file \
                         (`local {name} = …`), or give it as a parameter: `with: {{ {name}: … }}` in the deployment, or `--set {name}=…`"
                    ),
                    None => did_you_mean(&name, "functions", known.iter().map(String::as_str)),
                };
                Finding::error(codes::LUA_UNDEFINED, format!("`{full}` is not defined")).at(origin).help(help)
            }
        };
        recorder.cx.report(finding.labelled("here"));
        Ok(convert::poison())
    })?;
    meta.raw_set("__index", absent)?;
    meta.raw_set("__metatable", false)?;
    table.set_metatable(Some(meta))?;
    Ok(())
}

/// Whether a name is used as what has that other one would be: a function is called, of a table something is asked for.
fn is_used_as(table: &Table, other: &str, read: &ReadName) -> bool {
    match table.raw_get::<Value>(other) {
        Ok(Value::Function(_)) => read.called,
        Ok(Value::Table(_)) => read.called || read.path.contains('.'),
        _ => true,
    }
}

/// What can be done with handles and with the undefined value: `:undo` of a handle, anything with the latter.
fn handles(lua: &Lua, shared: &SharedRecorder) -> mlua::Result<Table> {
    let meta = lua.create_table()?;
    let quiet = lua.create_function(|_, (_, _): (Value, MultiValue)| Ok(convert::poison()))?;
    for event in [
        "__add", "__sub", "__mul", "__div", "__mod", "__pow", "__unm", "__idiv", "__band", "__bor", "__bxor", "__shl",
        "__shr", "__bnot", "__concat",
    ] {
        meta.raw_set(event, &quiet)?;
    }
    let recorder = shared.clone();
    let no = lua.create_function(move |lua, (a, b): (Value, Value)| {
        super::monitors::compared(&recorder, lua, [&a, &b]);
        Ok(false)
    })?;
    meta.raw_set("__lt", &no)?;
    meta.raw_set("__le", &no)?;
    meta.raw_set("__len", lua.create_function(|_, _: MultiValue| Ok(0))?)?;
    meta.raw_set(
        "__newindex",
        lua.create_function(|_, (handle, _): (LightUserData, MultiValue)| match convert::index_of(handle) {
            None => Ok(()),
            Some(_) => Err(mlua::Error::runtime(
                "what a constructor made cannot be changed: write all of it inside its braces",
            )),
        })?,
    )?;
    meta.raw_set(
        "__call",
        lua.create_function(|_, (handle, _): (LightUserData, MultiValue)| match convert::index_of(handle) {
            None => Ok(convert::poison()),
            Some(_) => {
                Err(mlua::Error::runtime("what a constructor made is no function: is a comma missing before this?"))
            }
        })?,
    )?;
    let undo = super::constructors::undo(lua, shared)?;
    let methods = super::monitors::methods(lua, shared)?;
    let recorder = shared.clone();
    meta.raw_set(
        "__index",
        lua.create_function(move |lua, (handle, key): (LightUserData, Value)| {
            let name = key.as_string().map(mlua::LuaString::to_string_lossy).unwrap_or_default();
            if convert::index_of(handle).is_none() {
                return Ok(convert::poison());
            }
            if name == "undo" {
                return Ok(Value::Function(undo.clone()));
            }
            if let Some(method) = super::monitors::method(&methods, handle, &name)? {
                return Ok(Value::Function(method));
            }
            let line = line(lua);
            let mut recorder = recorder.borrow_mut();
            let origin = recorder.word_at(line, &name);
            let finding =
                Finding::error(codes::LUA_UNDEFINED, format!("`{name}` is not defined for what a constructor made"));
            let mut known: Vec<String> =
                methods.pairs::<String, Value>().filter_map(|pair| Some(pair.ok()?.0)).collect();
            known.push("undo".to_owned());
            known.sort();
            let help = did_you_mean(&name, "methods", known.iter().map(String::as_str));
            recorder.cx.report(finding.at(origin).help(help));
            recorder.undefined.insert(name);
            Ok(convert::poison())
        })?,
    )?;
    meta.raw_set("__metatable", false)?;
    Ok(meta)
}

/// `string.rep`, bounded.
fn repeat(lua: &Lua, (text, n, separator): (mlua::LuaString, i64, Option<mlua::LuaString>)) -> mlua::Result<Value> {
    let n = usize::try_from(n).unwrap_or(0);
    let separator = separator.as_ref().map(|s| s.as_bytes().to_vec()).unwrap_or_default();
    let text = text.as_bytes();
    let each = text.len() + separator.len();
    if n.saturating_mul(each) > limits::LUA_STRING {
        return Err(mlua::Error::runtime("string.rep would make a text of more than 1 MB"));
    }
    // Nothing, however often, is nothing.
    if n == 0 || each == 0 {
        return Ok(Value::String(lua.create_string("")?));
    }
    let mut out = [&text[..], &separator[..]].concat().repeat(n);
    out.truncate(n * each - separator.len());
    Ok(Value::String(lua.create_string(out)?))
}

/// `table.concat`, bounded.
fn concat(
    lua: &Lua,
    charge: &Function,
    (list, separator, from, to): (Table, Option<mlua::LuaString>, Option<i64>, Option<i64>),
) -> mlua::Result<Value> {
    let separator = separator.as_ref().map(|s| s.as_bytes().to_vec()).unwrap_or_default();
    let length = i64::try_from(list.raw_len()).unwrap_or(0);
    let to = to.unwrap_or(length);
    // What is absent ends it.
    let count = if list.raw_get::<Value>(to)?.is_nil() { length } else { to.saturating_sub(from.unwrap_or(1)) };
    charge.call::<()>(count.max(0))?;
    let mut out: Vec<u8> = Vec::new();
    for i in from.unwrap_or(1)..=to {
        match list.raw_get::<Value>(i)? {
            Value::String(text) => out.extend_from_slice(&text.as_bytes()),
            Value::Integer(v) => out.extend_from_slice(v.to_string().as_bytes()),
            Value::Number(v) => out.extend_from_slice(
                lua.coerce_string(Value::Number(v))?.map(|s| s.as_bytes().to_vec()).unwrap_or_default().as_slice(),
            ),
            other => {
                let kind = other.type_name();
                return Err(mlua::Error::runtime(format!("table.concat: element {i} is a {kind}, no text or number")));
            }
        }
        if i < to {
            out.extend_from_slice(&separator);
        }
        if out.len() > limits::LUA_STRING {
            return Err(mlua::Error::runtime("table.concat would make a text of more than 1 MB"));
        }
    }
    Ok(Value::String(lua.create_string(out)?))
}

/// `setmetatable` without finalisers: they would run with hooks off, where no budget reaches.
fn set_metatable(lua: &Lua, (table, meta): (Table, Option<Table>)) -> mlua::Result<Table> {
    if let Some(old) = table.metatable()
        && old.raw_get::<Value>("__metatable")? != Value::Nil
    {
        return Err(mlua::Error::runtime("cannot change a protected metatable"));
    }
    if let Some(meta) = &meta
        && meta.raw_get::<Value>("__gc")? != Value::Nil
    {
        return Err(mlua::Error::runtime("finalisers (`__gc`) are closed to Lua here"));
    }
    if let Some(meta) = &meta {
        known_metatables(lua)?.raw_set(meta, true)?;
    }
    table.set_metatable(meta)?;
    Ok(table)
}

/// Whether a text of Lua is one that somebody wrote, and not ours.
pub fn is_file(source: &str) -> bool {
    source == "davit"
}

/// `davit:12: message` → its line and the message.
pub fn split_line(text: &str) -> (Option<u32>, String) {
    let parts = text.strip_prefix("davit:").and_then(|rest| rest.split_once(": "));
    match parts.and_then(|(line, message)| Some((line.parse().ok()?, message))) {
        Some((line, message)) => (Some(line), message.to_owned()),
        None => (None, text.to_owned()),
    }
}
