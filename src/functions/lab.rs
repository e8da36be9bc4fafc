//! rFSM without a coordinator, for tests.

use super::host::{FileReader, Host, run};
use super::open::NotOpened;
use super::values::to_json;
use super::world::state;
use crate::limits;
use crate::model::Openings;
use crate::statechart::FunctionOutput;
use mlua::{Lua, MultiValue};
use std::collections::BTreeMap;
use std::rc::Rc;

/// A Lua state with rFSM in it and no coordinator: texts that make and step machines of their own. For tests of the
/// semantics.
pub struct Lab {
    host: Rc<Host>,
    lua: Lua,
}

impl Lab {
    /// A fresh one, that can load the given files.
    ///
    /// # Errors
    /// When Lua has no memory for it.
    pub fn new(files: BTreeMap<String, String>, open: Openings) -> Result<Self, NotOpened> {
        let reader: FileReader = Box::new(move |name| {
            files
                .get(name)
                .map(|text| (name.to_owned(), text.clone()))
                .ok_or_else(|| format!("there is no file `{name}`"))
        });
        let (lua, host) = state(open, reader).map_err(|error| NotOpened::new("", &error))?;
        Ok(Self { lua, host })
    }

    /// Runs a text; answers what it returned, as JSON.
    ///
    /// # Errors
    /// [`NotOpened`]: it does not parse, fails, or is over its budget.
    pub fn run(&self, name: &str, text: &str) -> Result<Vec<serde_json::Value>, NotOpened> {
        let failed = |error: mlua::Error| NotOpened::new(name, &error);
        let values: MultiValue =
            self.host.budget.spend(limits::LUA_INSTRUCTIONS, || run(&self.lua, name, text)).map_err(failed)?;
        let mut any = || true;
        values.iter().map(|value| to_json(value, 0, &mut any).map_err(failed)).collect()
    }

    /// What was printed since the last time.
    pub fn said(&self) -> Vec<FunctionOutput> {
        let mut said = Vec::new();
        self.host.voice.drain(&mut said);
        said
    }
}
