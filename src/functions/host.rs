//! What everything of one Lua state shares: its budget, what it prints, its machines, and the files that are being run.

use super::bound::BoundMachine;
use super::budget::Budget;
use super::guards::Guards;
use super::lower::Spot;
use super::voice::Voice;
use crate::model::Ident;
use crate::time::Clock;
use mlua::chunk::ChunkMode;
use mlua::{Function, Lua, MultiValue, Result, Table};
use rustc_hash::FxHashMap;
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// Text by the name a model gives: the name that findings give it, and the text.
pub type FileReader = Box<dyn FnMut(&str) -> std::result::Result<(String, String), String>>;

/// What everything of one state shares.
pub struct Host {
    pub budget: Rc<Budget>,
    pub _guards: Guards,
    pub voice: Rc<Voice>,
    /// Where constructors were called, in order.
    pub spots: RefCell<Vec<Spot>>,
    /// Number of the spot by table (weak), 1-based.
    pub spot_of: Table,
    /// Machines by the address of their root.
    pub machines: RefCell<FxHashMap<usize, Rc<BoundMachine>>>,
    pub gettime: RefCell<Option<Function>>,
    pub reader: RefCell<FileReader>,
    /// Files that are being run, each loaded by the one before it.
    pub loading: RefCell<Vec<String>>,
    /// The time of inner machines whose model says none.
    pub clock: RefCell<Option<Clock>>,
    pub serial: Cell<u32>,
    /// The path of the subsystem of the machine that is being made: the coordinator itself, and none that it makes.
    pub path: Cell<Option<Ident>>,
    /// Functions of the Lua part that the Rust part calls.
    pub native: Table,
}

/// While a file is being run.
pub struct Loading<'a>(&'a Host);

impl Drop for Loading<'_> {
    fn drop(&mut self) {
        self.0.loading.borrow_mut().pop();
    }
}

impl Host {
    /// A file begins to be run; one that is being run already is refused, with the way that leads round.
    pub fn loading(&self, file: &str) -> Result<Loading<'_>> {
        let mut loading = self.loading.borrow_mut();
        if let Some(at) = loading.iter().position(|known| known == file) {
            let way: Vec<&str> = loading[at..].iter().map(String::as_str).chain([file]).collect();
            return Err(mlua::Error::runtime(format!("files load each other in a circle: {}", way.join(" -> "))));
        }
        loading.push(file.to_owned());
        Ok(Loading(self))
    }

    /// The module `rfsm`.
    pub fn rfsm(&self, lua: &Lua) -> Result<Table> {
        lua.named_registry_value(RFSM_KEY)
    }
}

/// Where a state keeps the module `rfsm`.
pub const RFSM_KEY: &str = "davit.rfsm";

/// The text without a first line `#!…`, which the shell reads and Lua does not; the end of that line stays, for the numbers of the others.
pub fn without_hash_bang(text: &str) -> &str {
    if text.starts_with('#') { &text[text.find('\n').unwrap_or(text.len())..] } else { text }
}

/// Runs a text as a file of that name.
pub fn run(lua: &Lua, file: &str, text: &str) -> Result<MultiValue> {
    let chunk = lua.load(without_hash_bang(text)).set_name(format!("@{file}")).set_mode(ChunkMode::Text);
    // Not `eval`, which tries the text as an expression first: a file never is one.
    chunk.into_function()?.call(())
}
