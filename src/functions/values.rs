//! Plain data to and from Lua.

use crate::model::Value as Worth;
use mlua::{Error, Lua, Result, Value};
use serde_json::Value as Json;

/// Levels of nesting that are followed.
const LEVELS: usize = 64;

/// Plain data as a Lua value; null is nil.
///
/// # Errors
/// When Lua has no memory for it.
pub fn to_lua(lua: &Lua, json: &Json) -> Result<Value> {
    Ok(match json {
        Json::Null => Value::Nil,
        Json::Bool(v) => Value::Boolean(*v),
        Json::Number(v) => match v.as_i64() {
            Some(i) => Value::Integer(i),
            None => Value::Number(v.as_f64().unwrap_or(f64::NAN)),
        },
        Json::String(text) => Value::String(lua.create_string(text)?),
        Json::Array(items) => {
            let table = lua.create_table_with_capacity(items.len(), 0)?;
            for item in items {
                table.raw_push(to_lua(lua, item)?)?;
            }
            Value::Table(table)
        }
        Json::Object(fields) => {
            let table = lua.create_table_with_capacity(0, fields.len())?;
            for (name, value) in fields {
                table.raw_set(name.as_str(), to_lua(lua, value)?)?;
            }
            Value::Table(table)
        }
    })
}

/// A Lua value as JSON; what has no counterpart by its text. `spend` is asked at every value (a table may stand in a
/// table many times over); `false`: enough.
pub fn to_json(value: &Value, level: usize, spend: &mut dyn FnMut() -> bool) -> Result<Json> {
    if !spend() {
        return Err(mlua::Error::runtime("more values than can be written down"));
    }
    Ok(match value {
        Value::Nil => Json::Null,
        Value::Boolean(v) => Json::Bool(*v),
        Value::Integer(v) => Json::from(*v),
        Value::Number(v) => Json::from(*v),
        Value::Table(table) if level < LEVELS => {
            let length = table.raw_len();
            let mut fields = serde_json::Map::new();
            let mut items = Vec::with_capacity(length);
            for i in 1..=length {
                items.push(to_json(&table.raw_get::<Value>(i)?, level + 1, spend)?);
            }
            table.for_each(|key: Value, inner: Value| {
                if let Value::String(name) = &key {
                    fields.insert(name.to_string_lossy(), to_json(&inner, level + 1, spend)?);
                }
                Ok(())
            })?;
            if fields.is_empty() { Json::Array(items) } else { Json::Object(fields) }
        }
        other => Json::String(other.to_string()?),
    })
}

/// A value of the model; a number that is not finite stays one.
///
/// # Errors
/// When Lua has no memory for it.
pub fn of_value(lua: &Lua, value: &Worth) -> Result<Value> {
    Ok(match value {
        Worth::Bool(b) => Value::Boolean(*b),
        Worth::Int(i) => Value::Integer(*i),
        Worth::Float(n) => Value::Number(*n),
        Worth::Str(text) => Value::String(lua.create_string(&**text)?),
        Worth::Array(elements) => {
            let table = lua.create_table_with_capacity(elements.len(), 0)?;
            elements.iter().try_for_each(|element| table.push(of_value(lua, element)?))?;
            Value::Table(table)
        }
        Worth::Record(fields) => {
            let table = lua.create_table_with_capacity(0, fields.len())?;
            fields.iter().try_for_each(|(name, value)| table.set(name.as_str(), of_value(lua, value)?))?;
            Value::Table(table)
        }
    })
}

/// A number, a text, a list of them or the like as a value of the model.
///
/// # Errors
/// It is none (a function, nil).
pub fn to_value(value: &Value) -> Result<Worth> {
    nested(value, 0)
}

/// Lists in lists are read so deep: a table may hold itself.
const DEEPEST: usize = 8;

fn nested(value: &Value, depth: usize) -> Result<Worth> {
    if depth > DEEPEST {
        return Err(Error::runtime(format!("a list more than {DEEPEST} deep is no value of a parameter")));
    }
    Ok(match value {
        Value::Boolean(b) => Worth::Bool(*b),
        Value::Integer(i) => Worth::Int(*i),
        Value::Number(n) => Worth::Float(*n),
        Value::String(text) => Worth::str(&text.to_str()?),
        Value::Table(table) => {
            Worth::Array(table.sequence_values().map(|v| nested(&v?, depth + 1)).collect::<Result<_>>()?)
        }
        other => return Err(Error::runtime(format!("a {} is no value of a parameter", other.type_name()))),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_that_holds_itself_is_no_value() {
        let lua = Lua::new();
        let list: Value = lua.load("local t = {} t[1] = t return t").eval().unwrap();
        assert!(to_value(&list).unwrap_err().to_string().contains("more than 8 deep"));
        let list: Value = lua.load("return { { 1, 2 }, { 3 } }").eval().unwrap();
        let inner = |numbers: &[i64]| Worth::Array(numbers.iter().map(|n| Worth::Int(*n)).collect());
        assert_eq!(to_value(&list).unwrap(), Worth::Array(vec![inner(&[1, 2]), inner(&[3])]));
    }
}
