//! Tables of options that functions of a script take: `{ force = true }`, `{ name = "rms error", max = 0.012 }`.

use super::error;
use crate::model::finding::did_you_mean;
use mlua::{Table, Value};
use std::collections::BTreeMap;

/// The fields of a table, which are those that a function takes: another one is a typo.
pub(super) struct OptionFields {
    function: &'static str,
    given: BTreeMap<&'static str, Value>,
}

impl OptionFields {
    pub(super) fn of(
        function: &'static str,
        table: Option<Table>,
        known: &'static [&'static str],
    ) -> mlua::Result<Self> {
        let mut given = BTreeMap::new();
        for pair in table.iter().flat_map(Table::pairs::<Value, Value>) {
            let (key, value) = pair?;
            let key = key.to_string()?;
            let Some(known) = known.iter().find(|known| **known == key) else {
                let help = did_you_mean(&key, "options", known.iter().copied());
                return Err(error(format!("`{function}`: there is no option `{key}`: {help}")));
            };
            given.insert(*known, value);
        }
        Ok(Self { function, given })
    }

    /// Something else was given than what `name` is.
    fn wrong(&self, name: &str, is: &str, value: &Value) -> mlua::Error {
        error(format!("`{}`: `{name}` is {is}, and this is of the type {}", self.function, value.type_name()))
    }

    /// To Lua everything is true but `false` and nil; `force = 0` would be, too.
    pub(super) fn flag(&self, name: &str) -> mlua::Result<bool> {
        match self.given.get(name) {
            None => Ok(false),
            Some(Value::Boolean(value)) => Ok(*value),
            Some(other) => Err(self.wrong(name, "true or false", other)),
        }
    }

    pub(super) fn text(&self, name: &str) -> mlua::Result<Option<String>> {
        match self.given.get(name) {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text.to_string_lossy())),
            Some(other) => Err(self.wrong(name, "a text", other)),
        }
    }

    #[allow(clippy::cast_precision_loss)]
    pub(super) fn number(&self, name: &str) -> mlua::Result<Option<f64>> {
        match self.given.get(name) {
            None => Ok(None),
            Some(Value::Integer(value)) => Ok(Some(*value as f64)),
            Some(Value::Number(value)) => Ok(Some(*value)),
            Some(other) => Err(self.wrong(name, "a number", other)),
        }
    }

    pub(super) fn table(&self, name: &str) -> mlua::Result<Option<&Table>> {
        match self.given.get(name) {
            None => Ok(None),
            Some(Value::Table(table)) => Ok(Some(table)),
            Some(other) => Err(self.wrong(name, "a table", other)),
        }
    }

    /// One name, or a list of them; none: it is not given.
    pub(super) fn names(&self, name: &str) -> mlua::Result<Option<Vec<String>>> {
        let wrong = |value: &Value| self.wrong(name, "a name or a list of names", value);
        let text = |value: &Value| match value {
            Value::String(text) => Ok(text.to_string_lossy()),
            other => Err(wrong(other)),
        };
        match self.given.get(name) {
            None => Ok(None),
            // What has a name of its own in there would be passed over.
            Some(Value::Table(list)) if list.pairs::<Value, Value>().count() != list.raw_len() => Err(error(format!(
                "`{}`: `{name}` is a name or a list of names, and this table has keys: write `{name} = {{ \"NAME\" }}`",
                self.function
            ))),
            Some(Value::Table(list)) => {
                list.sequence_values::<Value>().map(|value| text(&value?)).collect::<mlua::Result<_>>().map(Some)
            }
            Some(one) => Ok(Some(vec![text(one)?])),
        }
    }

    /// What a function cannot do without.
    pub(super) fn needed<T>(&self, name: &str, given: Option<T>, example: &str) -> mlua::Result<T> {
        given.ok_or_else(|| error(format!("`{}` needs `{name}`: {example}", self.function)))
    }
}

/// Whether the one option that there is is set.
pub(super) fn force(function: &'static str, options: Option<Table>) -> mlua::Result<bool> {
    OptionFields::of(function, options, &["force"])?.flag("force")
}
