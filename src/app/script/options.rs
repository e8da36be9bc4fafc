//! Tables of options that functions of a script take: `{ force = true }`.

use super::error;
use crate::model::finding::did_you_mean;
use mlua::Table;

/// Whether the one option that there is is set; another one is a typo.
pub(super) fn flag(options: Option<Table>, name: &'static str) -> mlua::Result<bool> {
    let Some(options) = options else { return Ok(false) };
    for pair in options.pairs::<mlua::Value, mlua::Value>() {
        let key = pair?.0.to_string()?;
        if key != name {
            let help = did_you_mean(&key, "options", [name]);
            return Err(error(format!("there is no option `{key}`: {help}")));
        }
    }
    options.get::<Option<bool>>(name).map(|set| set.unwrap_or(false))
}
