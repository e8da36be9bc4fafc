//! From a program to its chart, and from a program to functions that can be called.

use super::aside::{self, Field};
pub use super::calls::Functions;
use super::errors::{Short, message_of, short_of, undefined_global};
use super::host::{FileReader, Host};
use super::lower::{self, Problem, Spot};
use super::tables::address;
use super::unset::UnsetWatch;
use super::values::{of_value, to_value};
use super::world::{run_program, state};
use crate::limits;
use crate::model::program::{AuxiliaryFunction, Program};
use crate::model::{Ident, Origin, Statechart};
use crate::statechart::{FunctionOutput, Printer};
use crate::time::Clock;
use mlua::{Function, Lua, MultiValue, Table, Value};
use std::sync::Arc;

/// Why a program gives no machine.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{message}", line.map(|line| format!("{file}:{line}: ")).unwrap_or_default())]
pub struct NotOpened {
    /// The file at fault, by the name it was run under.
    pub file: String,
    /// The line, from 1, where Lua knows it.
    pub line: Option<u32>,
    /// What is wrong.
    pub message: String,
    /// Whether the text is no Lua at all.
    pub syntax: bool,
    /// The global name that the model expects and that nobody gave.
    pub missing: Option<String>,
    /// What it had not enough of.
    pub short: Option<Short>,
}

impl NotOpened {
    pub(super) fn new(file: &str, error: &mlua::Error) -> Self {
        let syntax = matches!(error, mlua::Error::SyntaxError { .. });
        let full = message_of(error);
        let missing = undefined_global(&full).map(str::to_owned);
        let mut parts = full.splitn(3, ':');
        let place = (parts.next(), parts.next().and_then(|line| line.parse().ok()), parts.next());
        let (file, line, message) = match place {
            (Some(file), Some(line), Some(rest)) => (file.to_owned(), Some(line), rest.trim().to_owned()),
            _ => (file.to_owned(), None, full.clone()),
        };
        Self { file, line, message, syntax, missing, short: short_of(error) }
    }

    fn plain(program: &Program, message: impl Into<String>) -> Self {
        let file = program.file.clone();
        Self { file, line: None, message: message.into(), syntax: false, missing: None, short: None }
    }
}

/// What running a program told.
#[derive(Debug)]
pub struct Reads {
    /// The chart; it may be faulty still, `statechart::compile` says how.
    pub chart: Statechart,
    /// What is wrong in its parts.
    pub problems: Vec<Problem>,
    /// Whether it needs Lua to run: functions, hooks, plugins, `getevents`, `dbg`.
    pub runs_lua: bool,
    /// What was printed.
    pub said: Vec<FunctionOutput>,
    /// Fields that mean nothing.
    pub fields: Vec<Field>,
    /// Functions that are called beside those of the chart.
    pub beside: Vec<AuxiliaryFunction>,
    /// Globals that it read and that nobody has set, and where.
    pub unset: Vec<(String, Spot)>,
}

/// Runs a program and answers its chart. `place` gives places: where a constructor was called, and a word in it (empty:
/// the whole).
///
/// # Errors
/// [`NotOpened`]: a text does not parse, fails, is over its budget, or gives no state.
pub fn read(
    program: &Program,
    reader: FileReader,
    place: &mut dyn FnMut(Option<&Spot>, &str) -> Origin,
) -> Result<Reads, NotOpened> {
    let failed = |error: mlua::Error| NotOpened::new(&program.file, &error);
    let (lua, host) = state(program.open, reader).map_err(failed)?;
    let watch = UnsetWatch::begin(&lua, &host.native).map_err(failed)?;
    let template = template(&lua, &host, program);
    let unset = watch.end(&host.native).map_err(failed)?;
    let template = template?;
    let tells = template.raw_get::<Value>("dbg").map_err(failed)?.is_function();
    let tables: Function = host.native.raw_get("tables").map_err(failed)?;
    let fsm: Table = host.budget.spend(limits::LUA_INSTRUCTIONS, || tables.call(&template)).map_err(failed)?;
    let list = host.budget.spend(limits::LUA_INSTRUCTIONS, || lower::flat(&host.native, &fsm)).map_err(failed)?;
    let spots = host.spots.borrow().clone();
    let mut places = |spot: Option<usize>, _: usize, word: &str| {
        place(spot.and_then(|number| spots.get(number.wrapping_sub(1))), word)
    };
    let lowered = lower::lower(&list, &host.native, &mut places).map_err(failed)?;
    let mut runs_lua = tells || !lowered.chart.is_pure();
    for key in ["pre_step_hook", "post_step_hook", "getevents", "idle_hook"] {
        runs_lua |= matches!(fsm.raw_get(key).map_err(failed)?, Value::Function(_));
    }
    let fields = aside::fields(&list, &host.native, &mut places).map_err(failed)?;
    let beside = aside::beside(&template, &list, &host.native, &mut places).map_err(failed)?;
    let mut said = Vec::new();
    host.voice.drain(&mut said);
    Ok(Reads { chart: lowered.chart, problems: lowered.problems, runs_lua, said, fields, beside, unset })
}

/// Runs a program to the template it returns.
fn template(lua: &Lua, host: &Host, program: &Program) -> Result<Table, NotOpened> {
    let value = run_program(lua, host, program).map_err(|(file, error)| NotOpened::new(&file, &error))?;
    let kind: Function = host.native.raw_get("kind").map_err(|e| NotOpened::new(&program.file, &e))?;
    match value {
        Value::Table(table) if kind.call::<Option<String>>(&table).ok().flatten().as_deref() == Some("state") => {
            Ok(table)
        }
        other => Err(NotOpened::plain(
            program,
            format!("the file returns {}, not a state", if other.is_nil() { "nothing" } else { other.type_name() }),
        )),
    }
}

/// A function that a model finds as a global, beside its own: what rFSM's program gives to it.
#[derive(Clone)]
pub struct HostFunction {
    /// Its name.
    pub name: Ident,
    /// What it does, in the coordinator's own thread.
    pub call: Arc<CallHost>,
}

type CallHost = dyn Fn(&[crate::model::Value]) -> Result<crate::model::Value, String> + Send + Sync;

impl std::fmt::Debug for HostFunction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("HostFunction").field(&self.name).finish()
    }
}

impl HostFunction {
    fn give(&self, lua: &Lua) -> mlua::Result<()> {
        let call = self.call.clone();
        let function = lua.create_function(move |lua, values: MultiValue| {
            let values = values.iter().map(to_value).collect::<mlua::Result<Vec<_>>>()?;
            of_value(lua, &call(&values).map_err(mlua::Error::runtime)?)
        })?;
        lua.globals().raw_set(self.name.as_str(), function)
    }
}

/// Opens the functions of a program where they are to be called.
#[derive(Debug, Clone)]
pub struct Opener {
    program: Arc<Program>,
    chart: Arc<Statechart>,
    host: Vec<HostFunction>,
    path: Option<Ident>,
}

impl Opener {
    /// The functions of `program`, whose chart is `chart`.
    pub fn new(program: Arc<Program>, chart: Arc<Statechart>) -> Self {
        Self { program, chart, host: Vec::new(), path: None }
    }

    /// Of a coordinator of the subsystem of that path: `chart` has its events as they are called from outside, its functions hear and send
    /// them as they are called in its file.
    #[must_use]
    pub fn within(mut self, path: Option<Ident>) -> Self {
        self.path = path;
        self
    }

    /// With functions of the program that runs it. They are there once the texts were run: what a text makes must not depend on them.
    #[must_use]
    pub fn with_host(mut self, host: Vec<HostFunction>) -> Self {
        self.host = host;
        self
    }

    /// Runs the program on this thread and answers its functions. They cannot leave the thread.
    ///
    /// On a real clock a call's instructions are counted only once it has taken [`limits::CALL_TICK`]; on a simulated one,
    /// and without a clock, from the first on.
    ///
    /// # Errors
    /// [`NotOpened`]: it fails, or makes another chart than the one that was checked.
    pub fn open(&self, clock: Option<Clock>) -> Result<Functions, NotOpened> {
        let program = &*self.program;
        let failed = |error: mlua::Error| NotOpened::new(&program.file, &error);
        let files = program.files.clone();
        let reader: FileReader = Box::new(move |name| match files.get(name) {
            Some((shown, text)) => Ok((shown.clone(), text.to_string())),
            None => Err(format!("`{name}` was not loaded before")),
        });
        let (lua, host) = state(program.open, reader).map_err(failed)?;
        let simulated = clock.as_ref().is_none_or(Clock::is_simulated);
        *host.clock.borrow_mut() = clock;
        let template = template(&lua, &host, program)?;
        self.host.iter().try_for_each(|function| function.give(&lua)).map_err(failed)?;
        // What the texts print was told when they were read.
        host.voice.drain(&mut Vec::new());
        let init: Function = host.rfsm(&lua).and_then(|rfsm| rfsm.raw_get("init")).map_err(failed)?;
        host.path.set(self.path);
        let made: Value = host.budget.spend(limits::LUA_INSTRUCTIONS, || init.call(template)).map_err(failed)?;
        let Value::Table(fsm) = made else {
            let mut said = Vec::new();
            host.voice.drain(&mut said);
            let errors: Vec<String> = said.into_iter().filter(|s| s.by == Printer::Err).map(|s| s.text).collect();
            return Err(NotOpened::plain(program, errors.join("; ")));
        };
        let bound = host.machines.borrow().get(&address(&fsm)).cloned();
        let bound = bound.ok_or_else(|| NotOpened::plain(program, "rfsm.init made no machine"))?;
        if bound.written != *self.chart {
            let message = "run again, the file makes another chart: what it makes must not depend on time or chance";
            return Err(NotOpened::plain(program, message));
        }
        // What `init` remarks, `statechart::compile` has said at its place.
        let mut said = Vec::new();
        host.voice.drain(&mut said);
        said.into_iter().filter(|line| line.by == Printer::Err).for_each(|line| host.voice.say(line.by, &line.text));
        bound.driven.set(true);
        // In simulated time every run is to be like every other, so what decides is what was counted.
        if !simulated {
            host.budget.count_late(&lua);
        }
        bound.machine.borrow_mut().take();
        Ok(Functions { lua, bound, _host: Some(host) })
    }
}
