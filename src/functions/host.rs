//! The Lua state of a coordinator with functions: what is there, under which names, and what is closed.

use super::bound::Bound;
use super::budget::Budget;
use super::guards::{self, Guards};
use super::lower::Spot;
use super::native;
use crate::limits;
use crate::model::finding::count;
use crate::model::program::{Openings, Program};
use crate::statechart::{Printer, Said};
use crate::time::Clock;
use mlua::chunk::ChunkMode;
use mlua::{Function, Lua, LuaOptions, MultiValue, Result, StdLib, Table, Value};
use rustc_hash::FxHashMap;
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// Text by the name a model gives: the name that findings give it, and the text.
pub type Reader = Box<dyn FnMut(&str) -> std::result::Result<(String, String), String>>;

/// What was printed, bounded.
#[derive(Debug, Default)]
pub struct Voice {
    lines: RefCell<Vec<Said>>,
    lost: Cell<usize>,
    /// Events that found no room: since that was last told, and before.
    no_room: Cell<u64>,
    no_room_before: Cell<u64>,
}

impl Voice {
    /// Says a line.
    pub fn say(&self, by: Printer, text: &str) {
        let mut lines = self.lines.borrow_mut();
        if lines.len() >= limits::SAID_LINES {
            self.lost.set(self.lost.get() + 1);
            return;
        }
        let text = if text.chars().count() > limits::SAID_LENGTH {
            text.chars().take(limits::SAID_LENGTH).chain(" …".chars()).collect()
        } else {
            text.to_owned()
        };
        lines.push(Said { by, text });
    }

    /// Counts events that found no room; how many there were is told once a step.
    pub fn no_room(&self, events: u64) {
        self.no_room.set(self.no_room.get() + events);
    }

    /// How many events found no room, ever.
    pub fn lost_events(&self) -> u64 {
        self.no_room.get() + self.no_room_before.get()
    }

    /// Moves all of it to the end of `out`.
    pub fn drain(&self, out: &mut Vec<Said>) {
        out.append(&mut self.lines.borrow_mut());
        let events = self.no_room.replace(0);
        if events > 0 {
            self.no_room_before.set(self.no_room_before.get() + events);
            let (events, most) = (count(grouped(events), "event"), grouped(limits::CHART_QUEUE as u64));
            let text = format!("{events} found no room: at most {most} wait for a step");
            out.push(Said { by: Printer::Err, text });
        }
        let lost = self.lost.replace(0);
        if lost > 0 {
            out.push(Said {
                by: Printer::Warn,
                text: format!("{} left out: too much was printed at once", count(lost, "more line")),
            });
        }
    }
}

/// A number as people read it: `18,976`.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            out.push(',');
        }
        out.push(digit);
    }
    out
}

/// What everything of one state shares.
pub struct Host {
    pub budget: Rc<Budget>,
    _guards: Guards,
    pub voice: Rc<Voice>,
    /// Where constructors were called, in order.
    pub spots: RefCell<Vec<Spot>>,
    /// Number of the spot by table (weak), 1-based.
    pub spot_of: Table,
    /// Machines by the address of their root.
    pub machines: RefCell<FxHashMap<usize, Rc<Bound>>>,
    pub gettime: RefCell<Option<Function>>,
    pub reader: RefCell<Reader>,
    /// Files that are being run, each loaded by the one before it.
    loading: RefCell<Vec<String>>,
    /// The time of inner machines whose model says none.
    pub clock: RefCell<Option<Clock>>,
    pub serial: Cell<u32>,
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

const RFSM_KEY: &str = "davit.rfsm";

/// The parts that are written in Lua.
const RFSM: &str = include_str!("lua/rfsm.lua");
const MERGE: &str = include_str!("lua/merge.lua");
const PLUGINS: &str = include_str!("lua/plugins.lua");
const BASE: &str = include_str!("lua/base.lua");

/// A state with everything in it that a model finds, and nothing run yet.
pub fn state(open: Openings, reader: Reader) -> Result<(Lua, Rc<Host>)> {
    let mut libraries = StdLib::TABLE | StdLib::STRING | StdLib::MATH | StdLib::COROUTINE | StdLib::UTF8;
    if open.io {
        libraries |= StdLib::IO;
    }
    if open.os {
        libraries |= StdLib::OS;
    }
    let lua = Lua::new_with(libraries, LuaOptions::new().catch_rust_panics(true))?;
    let native = lua.create_table()?;
    let guards = guards::install(&lua, &native, limits::FUNCTIONS_BYTES, limits::CALL_TIME)?;
    let spot_of = lua.create_table()?;
    let weak = lua.create_table()?;
    weak.raw_set("__mode", "k")?;
    spot_of.set_metatable(Some(weak))?;
    let host = Rc::new(Host {
        budget: guards.budget.clone(),
        _guards: guards,
        voice: Rc::default(),
        spots: RefCell::default(),
        spot_of: spot_of.clone(),
        machines: RefCell::default(),
        gettime: RefCell::default(),
        clock: RefCell::default(),
        reader: RefCell::new(reader),
        loading: RefCell::default(),
        serial: Cell::new(0),
        native,
    });
    native::install(&lua, &host)?;
    host.budget.spend(limits::LUA_INSTRUCTIONS, || {
        let rfsm: Table = lua.load(RFSM).set_name("=rfsm").into_function()?.call((&host.native, &spot_of))?;
        lua.set_named_registry_value(RFSM_KEY, &rfsm)?;
        lua.load(MERGE).set_name("=rfsm").into_function()?.call::<()>((&host.native, &rfsm))?;
        let plugins: Table = lua.load(PLUGINS).set_name("=rfsm").into_function()?.call((&host.native, &rfsm))?;
        lua.load(BASE).set_name("=rfsm").into_function()?.call::<()>((&host.native, &rfsm, &plugins))
    })?;
    Ok((lua, host))
}

/// Runs a text as a file of that name.
pub fn run(lua: &Lua, file: &str, text: &str) -> Result<MultiValue> {
    // A first line `#!…` is blanked and not cut: lines keep their numbers.
    let text = if text.starts_with('#') { &text[text.find('\n').unwrap_or(text.len())..] } else { text };
    let chunk = lua.load(text).set_name(format!("@{file}")).set_mode(ChunkMode::Text);
    // Not `eval`, which tries the text as an expression first: a file never is one.
    chunk.into_function()?.call(())
}

/// Runs a program: parameters, host files, the model. Answers the model's template.
pub fn run_program(lua: &Lua, host: &Host, program: &Program) -> std::result::Result<Value, (String, mlua::Error)> {
    let globals = lua.globals();
    let mut values = MultiValue::new();
    let run_all = |values: &mut MultiValue| -> std::result::Result<(), (String, mlua::Error)> {
        let at = |file: &str| {
            let file = file.to_owned();
            move |error| (file, error)
        };
        for (name, value) in &program.with {
            let value = super::values::to_lua(lua, value).map_err(at(&program.file))?;
            globals.raw_set(name.as_str(), value).map_err(at(&program.file))?;
        }
        for (file, text) in &program.host {
            let ran = host.budget.spend(limits::LUA_INSTRUCTIONS, || run(lua, file, text));
            ran.map_err(at(file))?;
        }
        let _loading = host.loading(&program.file).map_err(at(&program.file))?;
        *values = host
            .budget
            .spend(limits::LUA_INSTRUCTIONS, || run(lua, &program.file, &program.text))
            .map_err(at(&program.file))?;
        Ok(())
    };
    run_all(&mut values)?;
    Ok(values.pop_front().unwrap_or(Value::Nil))
}
