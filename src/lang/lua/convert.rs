//! Lua values → tree, and parameters → Lua values. Under budgets: cycles, sharing and depth end in a finding.

use super::recorder::SharedRecorder;
use crate::lang::tree::{Entry, Kind, Node};
use crate::limits;
use crate::model::{Finding, Origin, codes};
use mlua::{LightUserData, Lua, Table, Value};
use std::ffi::c_void;

/// The Lua value that stands for what was recorded under a number.
pub fn handle(index: usize) -> Value {
    Value::LightUserData(LightUserData((index + 1) as *mut c_void))
}

/// The number behind a handle; none for the value that stands for something undefined.
pub fn index_of(handle: LightUserData) -> Option<usize> {
    (handle.0 as usize).checked_sub(1)
}

/// The value that stands for something undefined: a finding about it has been made.
pub fn poison() -> Value {
    Value::LightUserData(LightUserData(std::ptr::null_mut()))
}

/// A value as a tree. `origin` is the place of the constructor it was given to.
pub fn node(shared: &SharedRecorder, value: &Value, origin: Origin) -> Node {
    convert(shared, value, origin, 0)
}

fn convert(shared: &SharedRecorder, value: &Value, origin: Origin, depth: usize) -> Node {
    let kind = match value {
        Value::Nil => Kind::Null,
        Value::Boolean(v) => Kind::Bool(*v),
        Value::Integer(v) => Kind::Int(*v),
        Value::Number(v) => Kind::Float(*v),
        Value::String(text) => match text.to_str() {
            Ok(text) => Kind::Str((*text).into()),
            Err(_) => {
                let finding = Finding::error(codes::TEXT_NOT_UTF8, "a text that is not UTF-8").at(origin);
                shared.borrow_mut().cx.report(finding.help("escapes such as `\\xff` must make UTF-8 together"));
                Kind::Poison
            }
        },
        Value::Table(table) => return self::table(shared, table, origin, depth),
        Value::Function(_) => Kind::Function,
        Value::LightUserData(handle) => match index_of(*handle) {
            Some(index) => {
                shared.borrow_mut().made[index].uses += 1;
                Kind::Handle(u32::try_from(index).unwrap_or(u32::MAX))
            }
            None => Kind::Poison,
        },
        other => {
            let finding = Finding::error(codes::TEXT_WRONG_TYPE, format!("a {} is no value", other.type_name()));
            shared
                .borrow_mut()
                .cx
                .report(finding.at(origin).help("values are bools, numbers, texts and tables of them"));
            Kind::Poison
        }
    };
    Node::new(kind, origin)
}

fn too_deep(shared: &SharedRecorder, origin: Origin) -> Node {
    let message = format!("a table nested more than {} levels deep, or inside itself", limits::TEXT_DEPTH);
    let mut recorder = shared.borrow_mut();
    if recorder.undefined.insert("\0depth".to_owned()) {
        let finding = Finding::error(codes::TEXT_TOO_DEEP, message).at(origin);
        recorder.cx.report(finding.help("nothing that Davit reads needs so many levels"));
    }
    Node::new(Kind::Poison, origin)
}

/// The parts of a table: its elements 1…n in order, its named entries by name.
pub struct TableParts {
    pub list: Vec<Node>,
    pub named: Vec<Entry>,
}

fn table(shared: &SharedRecorder, table: &Table, origin: Origin, depth: usize) -> Node {
    if depth >= limits::TEXT_DEPTH {
        return too_deep(shared, origin);
    }
    let classed = {
        let recorder = shared.borrow();
        if recorder.classed.is_empty() { None } else { recorder.classed.get(&(table.to_pointer() as usize)).copied() }
    };
    let origin = classed.map_or(origin, |c| c.origin);
    let Some(TableParts { list, mut named }) = parts(shared, table, origin, depth) else {
        return Node::new(Kind::Poison, origin);
    };
    if let Some(classed) = classed {
        return Node::new(Kind::Made(classed.class, named, list), origin);
    }
    let kind = match (list.is_empty(), named.is_empty()) {
        (_, true) => Kind::List(list),
        (true, false) => {
            named.sort_by(|a, b| a.key.cmp(&b.key));
            Kind::Map(named)
        }
        (false, false) => {
            named.sort_by(|a, b| a.key.cmp(&b.key));
            Kind::Mixed(list, named)
        }
    };
    Node::new(kind, origin)
}

/// Goes through a table once.
pub fn parts(shared: &SharedRecorder, table: &Table, origin: Origin, depth: usize) -> Option<TableParts> {
    if shared.borrow_mut().count(table.raw_len(), 0) {
        return None;
    }
    let mut list: Vec<(i64, Node)> = Vec::with_capacity(table.raw_len());
    let mut named: Vec<(u32, Entry)> = Vec::new();
    let mut ordered = true;
    let mut bad_key = None;
    let mut exhausted = false;
    let outcome = table.for_each(|key: Value, value: Value| {
        exhausted = shared.borrow_mut().count(1, 0);
        if exhausted {
            return Err(mlua::Error::runtime("too many values"));
        }
        let sequence = match &value {
            Value::Table(t) => shared.borrow().classed.get(&(t.to_pointer() as usize)).map_or(0, |c| c.sequence),
            _ => 0,
        };
        match &key {
            Value::Integer(i) => {
                ordered &= *i == i64::try_from(list.len()).unwrap_or(0) + 1;
                list.push((*i, convert(shared, &value, origin, depth + 1)));
            }
            Value::String(text) => match text.to_str() {
                Ok(text) => {
                    let key = text.to_owned().into();
                    named.push((sequence, Entry { key, origin, value: convert(shared, &value, origin, depth + 1) }));
                }
                Err(_) => bad_key = Some("a text that is not UTF-8".to_owned()),
            },
            Value::LightUserData(handle) if index_of(*handle).is_none() => {}
            other => bad_key = Some(format!("a {}", other.type_name())),
        }
        Ok(())
    });
    if exhausted || outcome.is_err() {
        return None;
    }
    if let Some(key) = bad_key {
        let finding = Finding::error(codes::TEXT_WRONG_TYPE, format!("a key of a table is {key}")).at(origin);
        shared.borrow_mut().cx.report(finding.help("keys are names, or the numbers 1, 2, 3, … of a list"));
    }
    if !ordered {
        list.sort_by_key(|(i, _)| *i);
        if let Some(hole) = list.iter().zip(1..).find_map(|((i, _), n)| (*i != n).then_some(n)) {
            let finding = Finding::error(codes::TEXT_WRONG_TYPE, format!("element {hole} of a list is missing (nil)"));
            shared.borrow_mut().cx.report(finding.at(origin).help("a list has no holes: give every element a value"));
        }
    }
    // Made earlier is written earlier; what was not made by a constructor has no order and is sorted by name.
    named.sort_by(|a, b| a.0.cmp(&b.0).then_with(|| a.1.key.cmp(&b.1.key)));
    Some(TableParts {
        list: list.into_iter().map(|(_, node)| node).collect(),
        named: named.into_iter().map(|(_, entry)| entry).collect(),
    })
}

/// A parameter as a Lua value.
pub fn to_lua(lua: &Lua, node: &Node) -> mlua::Result<Value> {
    Ok(match &node.kind {
        Kind::Bool(v) => Value::Boolean(*v),
        Kind::Int(v) => Value::Integer(*v),
        Kind::Float(v) => Value::Number(*v),
        Kind::Str(v) => Value::String(lua.create_string(&**v)?),
        Kind::List(list) => {
            let table = lua.create_table_with_capacity(list.len(), 0)?;
            for node in list {
                table.raw_push(to_lua(lua, node)?)?;
            }
            Value::Table(table)
        }
        Kind::Map(entries) => {
            let table = lua.create_table()?;
            for entry in entries {
                table.raw_set(&*entry.key, to_lua(lua, &entry.value)?)?;
            }
            Value::Table(table)
        }
        // What it was to be could not be read, and that is said.
        Kind::Poison => poison(),
        _ => Value::Nil,
    })
}
