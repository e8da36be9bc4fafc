//! Views as Lua values, and Lua values as what is sent.

use crate::functions;
pub use crate::functions::{of_value, to_value};
use mlua::{Error, Lua, Result, Value};
use serde::Serialize;
use serde_json::Value as Json;

/// A view as Lua tables; null is nil.
pub fn to_lua(lua: &Lua, view: &impl Serialize) -> Result<Value> {
    functions::to_lua(lua, &serde_json::to_value(view).expect("plain data"))
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
