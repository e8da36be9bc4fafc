//! The words of the Configurator language and of rFSM, as Lua functions that record what they are given.

use super::recorder::{Classed, SharedRecorder};
use super::{convert, sandbox};
use crate::lang::grammar::CHANGES;
use crate::lang::tree::{Entry, Kind, Node};
use crate::model::finding::{are, count};
use crate::model::{Code, Finding, Origin, codes};
use mlua::{Function, Lua, MultiValue, Table, Value};
use std::borrow::Cow;

/// rFSM's constructors with their other names.
const CLASSES: &[(&str, &[&str])] = &[
    ("state", &["state", "sista", "simple_state", "csta", "composite_state"]),
    ("trans", &["trans", "transition"]),
    ("conn", &["conn", "connector", "junc"]),
];

fn entry(key: &'static str, origin: Origin, value: Node) -> Entry {
    Entry { key: Cow::Borrowed(key), origin, value }
}

/// Puts all constructors into the environment.
pub fn install(lua: &Lua, env: &Table, shared: &SharedRecorder) -> mlua::Result<()> {
    for primitive in CHANGES {
        let verb = primitive.object.name;
        env.raw_set(verb, change(lua, shared, verb, primitive.arguments)?)?;
    }
    env.raw_set("Configuration", of_a_table(lua, shared, "Configuration", None)?)?;
    // A list inside ConfiguratorConf has no names.
    let unnamed = (codes::CONF_UNNAMED, "write `name = Configuration { … }`");
    env.raw_set("ConfiguratorConf", of_a_table(lua, shared, "ConfiguratorConf", Some(unnamed))?)?;
    let rfsm = lua.create_table()?;
    let keep = lua.create_table()?;
    for (class, names) in CLASSES {
        let made = class_table(lua, shared, class, &keep)?;
        for name in *names {
            env.raw_set(*name, &made)?;
            rfsm.raw_set(*name, &made)?;
        }
    }
    sandbox::undefined(lua, shared, &rfsm, "rfsm.")?;
    env.raw_set("rfsm", &rfsm)?;
    let recorder = shared.clone();
    env.raw_set(
        "require",
        lua.create_function(move |lua, name: Value| {
            let text = name.as_string().map(mlua::LuaString::to_string_lossy).unwrap_or_default();
            if text == "rfsm" {
                return Ok(Value::Table(rfsm.clone()));
            }
            let line = sandbox::line(lua);
            let mut recorder = recorder.borrow_mut();
            let origin = recorder.word_at(line, "require");
            let finding =
                Finding::error(codes::LUA_CLOSED, format!("`require \"{text}\"`: other files are closed to Lua here"));
            recorder
                .cx
                .report(finding.at(origin).help("only `require \"rfsm\"` is known: it gives rFSM's constructors"));
            Ok(convert::poison())
        })?,
    )
}

/// A constructor that takes one table and records it. `unnamed`: elements without a name are an error, with this help.
pub fn of_a_table(
    lua: &Lua,
    shared: &SharedRecorder,
    verb: &'static str,
    unnamed: Option<(Code, &'static str)>,
) -> mlua::Result<Function> {
    let recorder = shared.clone();
    lua.create_function(move |lua, args: MultiValue| {
        let origin = recorder.borrow_mut().call_at(sandbox::line(lua), verb);
        let node = match args.front() {
            Some(Value::Table(table)) => match convert::parts(&recorder, table, origin, 1) {
                Some(parts) => Node::new(Kind::Made(verb, parts.named, parts.list), origin),
                None => Node::new(Kind::Poison, origin),
            },
            Some(Value::LightUserData(handle)) if convert::index_of(*handle).is_none() => {
                Node::new(Kind::Poison, origin)
            }
            _ => {
                let finding = Finding::error(codes::LUA_ARGUMENTS, format!("`{verb}` takes one table")).at(origin);
                recorder.borrow_mut().cx.report(finding.help(format!("write `{verb} {{ … }}`")));
                Node::new(Kind::Poison, origin)
            }
        };
        let mut recorder = recorder.borrow_mut();
        if let (Some((code, help)), Kind::Made(_, _, list)) = (unnamed, &node.kind)
            && !list.is_empty()
        {
            let finding = Finding::error(code, format!("an element of `{verb}` has no name"));
            recorder.cx.report(finding.at(origin).help(help));
        }
        Ok(convert::handle(recorder.record(verb, origin, node)))
    })
}

fn change(
    lua: &Lua,
    shared: &SharedRecorder,
    verb: &'static str,
    names: &'static [&'static str],
) -> mlua::Result<Function> {
    let recorder = shared.clone();
    lua.create_function(move |lua, args: MultiValue| {
        let line = sandbox::line(lua);
        let origin = {
            let mut recorder = recorder.borrow_mut();
            if recorder.count(2 + args.len(), line) {
                return Err(mlua::Error::runtime("the budget is used up"));
            }
            recorder.call_at(line, verb)
        };
        let mut entries = Vec::with_capacity(args.len() + 1);
        let mut rest = args.into_iter();
        for name in names {
            if *name == "args…" {
                let list: Vec<Node> = rest.by_ref().map(|v| convert::node(&recorder, &v, origin)).collect();
                entries.push(entry("args", origin, Node::new(Kind::List(list), origin)));
                break;
            }
            let Some(value) = rest.next() else { break };
            if value.is_nil() {
                continue;
            }
            let node = convert::node(&recorder, &value, origin);
            match (*name, node.kind) {
                ("options", Kind::Map(options)) => entries.extend(options),
                ("options", Kind::List(list)) if list.is_empty() => {}
                ("options", Kind::Poison) => {}
                ("options", kind) => {
                    let node = Node::new(kind, origin);
                    let example = "{ activity = \"control\", properties = { k = 1.0 } }";
                    let what = format!("the last argument of `{verb}`");
                    recorder.borrow_mut().cx.wrong(&node, &what, "a table", example);
                }
                (name, kind) => entries.push(entry(name, origin, Node::new(kind, origin))),
            }
        }
        let more = rest.count();
        let mut recorder = recorder.borrow_mut();
        if more > 0 {
            let (takes, given) = (count(names.len(), "argument"), are(names.len() + more));
            let message = format!("`{verb}` takes {takes}, {given} given");
            let finding = Finding::error(codes::LUA_ARGUMENTS, message).at(origin);
            recorder.cx.report(finding.help(format!("write `{verb}({})`", names.join(", "))));
        }
        let node = Node::new(Kind::Made(verb, entries, Vec::new()), origin);
        Ok(convert::handle(recorder.record(verb, origin, node)))
    })
}

/// `operation_call(…):undo(operation, …)`
pub fn undo(lua: &Lua, shared: &SharedRecorder) -> mlua::Result<Function> {
    let recorder = shared.clone();
    lua.create_function(move |lua, (of, args): (Value, MultiValue)| {
        let line = sandbox::line(lua);
        let Value::LightUserData(handle) = of else {
            let mut recorder = recorder.borrow_mut();
            let origin = recorder.call_at(line, "undo");
            let finding = Finding::error(codes::LUA_ARGUMENTS, "`undo` does not know of what").at(origin);
            recorder
                .cx
                .report(finding.help("it is written with a colon: `operation_call(\"A.lock\"):undo(\"A.unlock\")`"));
            return Ok(convert::poison());
        };
        let Some(index) = convert::index_of(handle) else { return Ok(of) };
        let origin = recorder.borrow_mut().call_at(line, "undo");
        let mut nodes: Vec<Node> = args.iter().map(|v| convert::node(&recorder, v, origin)).collect();
        let mut entries = Vec::with_capacity(2);
        if !nodes.is_empty() {
            entries.push(entry("operation", origin, nodes.remove(0)));
        }
        entries.push(entry("args", origin, Node::new(Kind::List(nodes), origin)));
        let undo = entry("undo", origin, Node::new(Kind::Map(entries), origin));
        let mut recorder = recorder.borrow_mut();
        let made = &mut recorder.made[index];
        let (verb, first) = (made.verb, made.origin);
        match made.node.as_mut().map(|node| &mut node.kind) {
            Some(Kind::Made("operation_call", entries, _)) => {
                if entries.iter().any(|e| e.key == "undo") {
                    let finding = Finding::error(codes::LUA_ARGUMENTS, "a second `:undo`").at(origin);
                    recorder
                        .cx
                        .report(finding.also(first, "of this call").help("a call is undone by one call: keep one"));
                } else {
                    entries.push(undo);
                }
            }
            _ => {
                let finding = Finding::error(codes::LUA_ARGUMENTS, format!("`:undo` of a `{verb}`")).at(origin);
                recorder.cx.report(
                    finding.help("only an `operation_call` names its undo; that of all other changes is computed"),
                );
            }
        }
        Ok(Value::LightUserData(handle))
    })
}

/// `state`, `trans`, `conn`: called with a table, or as `state:new { … }`. They answer the table itself, as rFSM does.
fn class_table(lua: &Lua, shared: &SharedRecorder, class: &'static str, keep: &Table) -> mlua::Result<Table> {
    let (recorder, keep) = (shared.clone(), keep.clone());
    let mark = lua.create_function(move |lua, (_, value): (Value, Value)| {
        let line = sandbox::line(lua);
        let mut recorder = recorder.borrow_mut();
        let origin = recorder.call_at(line, class);
        let Value::Table(table) = value else {
            let poison = matches!(&value, Value::LightUserData(h) if convert::index_of(*h).is_none());
            if !poison {
                let finding = Finding::error(codes::LUA_ARGUMENTS, format!("`{class}` takes one table")).at(origin);
                recorder.cx.report(finding.help(format!("write `{class} {{ … }}`")));
            }
            return Ok(convert::poison());
        };
        // The table and the note of it, which outlives the table.
        if recorder.count(2, line) {
            return Err(mlua::Error::runtime("the budget is used up"));
        }
        let sequence = u32::try_from(recorder.classed.len()).unwrap_or(u32::MAX - 1) + 1;
        recorder.classed.insert(table.to_pointer() as usize, Classed { class, origin, sequence });
        // Held until the end: the address of a table that is gone could be another's.
        keep.raw_push(&table)?;
        Ok(Value::Table(table))
    })?;
    let made = lua.create_table()?;
    made.raw_set("new", &mark)?;
    let meta = lua.create_table()?;
    meta.raw_set("__call", mark)?;
    meta.raw_set("__metatable", false)?;
    made.set_metatable(Some(meta))?;
    Ok(made)
}
