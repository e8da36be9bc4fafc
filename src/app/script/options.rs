//! Tables of options that functions of a script take: `{ force = true }`.

use super::error;
use crate::model::finding::did_you_mean;
use mlua::Table;

/// Whether the one option that there is is set; another one is a typo.
pub(super) fn flag(options: Option<Table>, name: &'static str) -> mlua::Result<bool> {
    let Some(options) = options else { return Ok(false) };
    let mut set = false;
    for pair in options.pairs::<mlua::Value, mlua::Value>() {
        let (key, value) = pair?;
        let key = key.to_string()?;
        if key != name {
            let help = did_you_mean(&key, "options", [name]);
            return Err(error(format!("there is no option `{key}`: {help}")));
        }
        // To Lua everything is true but `false` and nil; `force = 0` would be, too.
        match value {
            mlua::Value::Boolean(value) => set = value,
            other => {
                return Err(error(format!("`{name}` is true or false, and this is of the type {}", other.type_name())));
            }
        }
    }
    Ok(set)
}

/// The names under the one option that there is: one name, or a list of them; none: it is not given.
pub(super) fn names(options: Option<Table>, name: &'static str) -> mlua::Result<Option<Vec<String>>> {
    let Some(options) = options else { return Ok(None) };
    let wrong = |value: &mlua::Value| {
        let kind = value.type_name();
        error(format!("`{name}` is a name or a list of names, and this is of the type {kind}"))
    };
    let mut names = None;
    for pair in options.pairs::<mlua::Value, mlua::Value>() {
        let (key, value) = pair?;
        let key = key.to_string()?;
        if key != name {
            let help = did_you_mean(&key, "options", [name]);
            return Err(error(format!("there is no option `{key}`: {help}")));
        }
        let text = |value: mlua::Value| match value {
            mlua::Value::String(text) => Ok(text.to_string_lossy()),
            other => Err(wrong(&other)),
        };
        names = Some(match value {
            mlua::Value::Table(list) => {
                list.sequence_values::<mlua::Value>().map(|value| text(value?)).collect::<mlua::Result<_>>()?
            }
            one => vec![text(one)?],
        });
    }
    Ok(names)
}
