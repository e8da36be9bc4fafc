//! Views as Lua values, and Lua values as what is sent.

pub use crate::functions::{of_value, to_value};
use mlua::{Error, Lua, Result, Value};
use serde_json::Value as Json;

/// A view as Lua tables; null is nil.
pub fn to_lua(lua: &Lua, json: &Json) -> Result<Value> {
    Ok(match json {
        Json::Null => Value::Nil,
        Json::Bool(b) => Value::Boolean(*b),
        Json::Number(n) => match n.as_i64() {
            Some(i) => Value::Integer(i),
            None => Value::Number(n.as_f64().unwrap_or(f64::NAN)),
        },
        Json::String(s) => Value::String(lua.create_string(s)?),
        Json::Array(items) => {
            let table = lua.create_table_with_capacity(items.len(), 0)?;
            for item in items {
                table.push(to_lua(lua, item)?)?;
            }
            Value::Table(table)
        }
        Json::Object(fields) => {
            let table = lua.create_table_with_capacity(0, fields.len())?;
            for (name, value) in fields {
                table.set(name.as_str(), to_lua(lua, value)?)?;
            }
            Value::Table(table)
        }
    })
}

/// A Lua value as plain data: a table with an element 1, or with nothing, is a list.
pub fn from_lua(value: &Value) -> Result<Json> {
    below(value, 0)
}

fn below(value: &Value, depth: usize) -> Result<Json> {
    Ok(match value {
        Value::Boolean(b) => (*b).into(),
        Value::Integer(i) => (*i).into(),
        Value::Number(n) => (*n).into(),
        Value::String(text) => text.to_str()?.to_owned().into(),
        Value::Table(table) if depth < DEEPEST => match table.raw_len() {
            0 if !table.is_empty() => {
                let fields = table.pairs::<String, Value>();
                fields
                    .map(|pair| pair.and_then(|(name, v)| Ok((name, below(&v, depth + 1)?))))
                    .collect::<Result<_>>()?
            }
            _ => table.sequence_values().map(|v| below(&v?, depth + 1)).collect::<Result<_>>()?,
        },
        other => return Err(Error::runtime(format!("a {} is no value of a property or port", other.type_name()))),
    })
}

/// No type of a property is nested deeper.
const DEEPEST: usize = 32;
