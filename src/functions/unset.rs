//! Globals that a text reads while it is run, and that nobody has set. In rFSM they are nil without a word.

use super::lower::Spot;
use crate::limits;
use mlua::{Lua, Result, Table, Value};
use std::cell::RefCell;
use std::rc::Rc;

/// Watches reads of globals, until it is asked what it saw.
pub struct UnsetWatch(Rc<RefCell<Vec<(String, Spot)>>>);

/// What `lua/base.lua` calls with the name of a global that is not there.
const KEY: &str = "unset";

impl UnsetWatch {
    /// Begins.
    pub fn begin(lua: &Lua, native: &Table) -> Result<Self> {
        let seen: Rc<RefCell<Vec<(String, Spot)>>> = Rc::default();
        let kept = seen.clone();
        let note = lua.create_function(move |lua, name: Value| {
            let mut seen = kept.borrow_mut();
            // The reader stands above this function and the one of `base.lua`.
            let at = lua.inspect_stack(2, |debug| {
                let line = u32::try_from(debug.current_line()?).ok()?;
                Some((debug.source().source?.trim_start_matches(['@', '=']).to_owned(), line))
            });
            if let (Some((file, line)), Value::String(name), true) = (at.flatten(), name, seen.len() < limits::FINDINGS)
            {
                let one = (name.to_string_lossy(), Spot { file, line, nth: 0 });
                if !seen.contains(&one) {
                    seen.push(one);
                }
            }
            Ok(())
        })?;
        native.raw_set(KEY, note)?;
        Ok(Self(seen))
    }

    /// Ends, and answers the names with the lines that read them.
    pub fn end(self, native: &Table) -> Result<Vec<(String, Spot)>> {
        native.raw_set(KEY, Value::Nil)?;
        Ok(self.0.take())
    }
}
