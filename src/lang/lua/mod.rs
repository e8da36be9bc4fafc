//! Lua → loose tree: a file runs once in a fresh, closed state, its constructors record what they are given.
//!
//! Nothing of Lua remains afterwards: the model is plain data.

mod budget;
mod constructors;
mod convert;
mod loading;
mod logic;
mod monitors;
mod recorder;
mod sandbox;
mod syntax;

use super::files::Sources;
use super::params::Params;
use super::tokens::{KeyAgain, Token, keys_again, tokens};
use super::tree::{Cx, Entry, Kind, Node, Reading, stands_twice};
use crate::functions::without_hash_bang;
use crate::limits;
use crate::model::{Finding, codes};
use mlua::chunk::ChunkMode;
use mlua::{LuaOptions, StdLib};
use recorder::{Recorder, SharedRecorder};
pub use sandbox::why_closed;
use std::cell::RefCell;
use std::path::PathBuf;
use std::rc::Rc;
pub use syntax::not_lua;

/// What a Lua file made.
pub struct Made {
    /// Its named configurations in written order, as a map.
    pub configurations: Option<Node>,
    /// The statechart it returned.
    pub chart: Option<Node>,
    /// Its named monitors in written order, as a map.
    pub monitors: Option<Node>,
}

/// Where files that a file loads (`rfsm.load`) are looked for.
#[derive(Debug, Clone)]
pub struct Loads {
    /// The set of files.
    pub from: Sources,
    /// The folder of the file that loads them.
    pub folder: PathBuf,
}

/// Runs the text of `reading`'s file. `stem` names a configuration that stands alone without a name. None, with
/// findings, when the file does not parse, fails, or exceeds a budget.
pub fn read(cx: &mut Cx, reading: Reading, params: &mut Params, stem: &str, loads: Option<Loads>) -> Option<Made> {
    let text = cx.sources.file(reading.file).text.clone();
    if text.starts_with('\u{1b}') {
        let finding = Finding::error(codes::LUA_BYTECODE, "this is compiled Lua").at(reading.whole);
        cx.refuse(finding.help("only texts are read: give the source file"));
        return None;
    }
    let recorder = Recorder::new(std::mem::take(cx), reading, std::mem::take(params), loads);
    let shared: SharedRecorder = Rc::new(RefCell::new(recorder));
    let outcome = run(&shared, &text);
    let mut recorder = shared.take();
    let ran = match outcome {
        Ok(returned) => {
            if let Some(exhausted) = recorder.exhausted.take() {
                recorder.report_exhausted(&exhausted);
                None
            } else {
                returned
            }
        }
        Err(error) => {
            recorder.report_error(&error);
            None
        }
    };
    let made = ran.map(|returned| recorder.assemble(returned, stem));
    let before = recorder.cx.findings.len();
    logic::check(&mut recorder, &text);
    // What Lua's own words made nothing of stands nowhere: that is no news.
    if recorder.cx.findings.len() > before {
        recorder.cx.findings.retain(|finding| finding.code != codes::LUA_UNUSED);
    }
    // Putting conditions into their places is bounded as well.
    if let Some(exhausted) = recorder.exhausted.take() {
        recorder.report_exhausted(&exhausted);
    }
    *cx = recorder.cx;
    *params = recorder.params;
    made
}

/// Runs the text and answers what it returned, as a tree.
fn run(shared: &SharedRecorder, text: &str) -> mlua::Result<Option<Node>> {
    let options = LuaOptions::new().catch_rust_panics(true);
    let lua = mlua::Lua::new_with(StdLib::MATH | StdLib::STRING | StdLib::TABLE | StdLib::COROUTINE, options)?;
    lua.set_memory_limit(limits::LUA_BYTES)?;
    let env = sandbox::environment(&lua, shared)?;
    constructors::install(&lua, &env, shared)?;
    monitors::install(&lua, &env, shared)?;
    loading::install(&lua, &env, shared)?;
    budget::start(&lua, shared)?;
    let function = chunk(&lua, shared, text, env)?;
    let returned: mlua::Value = function.call(())?;
    lua.remove_global_hook();
    lua.remove_hook();
    if matches!(returned, mlua::Value::Nil) {
        return Ok(Some(Node::new(Kind::Null, shared.borrow().reading.whole)));
    }
    let origin = shared.borrow().reading.whole;
    Ok(Some(convert::node(shared, &returned, origin)))
}

/// A text as a function of Lua.
fn chunk(lua: &mlua::Lua, shared: &SharedRecorder, text: &str, env: mlua::Table) -> mlua::Result<mlua::Function> {
    let text = without_hash_bang(text);
    let chunk = lua.load(text).set_name("=davit").set_mode(ChunkMode::Text).set_environment(env);
    // Not `eval`, which tries the text as an expression first: a file never is one.
    let before = std::mem::replace(&mut shared.borrow_mut().parsing, true);
    let function = chunk.into_function()?;
    shared.borrow_mut().parsing = before;
    twice(&mut shared.borrow_mut(), text);
    Ok(function)
}

/// Reports keys that stand twice in one table: Lua keeps the last, and what was written first is lost.
fn twice(recorder: &mut Recorder, text: &str) {
    let file = recorder.reading.file;
    for KeyAgain { key, first, again } in keys_again(&tokens(text)) {
        let mut at = |token: Token<'_>| recorder.cx.sources.exact(file, token.line, token.column, token.length);
        let (first, again) = (at(first), at(again));
        recorder.cx.report(stands_twice(key, first, again));
        recorder.has_lost = true;
    }
}

impl Recorder {
    /// Puts what was made together: configurations by name in the order they were made, the chart that was returned.
    fn assemble(&mut self, returned: Node, stem: &str) -> Made {
        let chart = match &returned.kind {
            Kind::Made("state", ..) => Some(returned),
            Kind::Null | Kind::Handle(_) | Kind::Poison => None,
            _ => {
                let finding =
                    Finding::error(codes::LUA_BAD_RETURN, format!("the file returns {}", returned.describe()));
                self.cx.report(finding.at(returned.origin).help(
                    "a coordinator's file returns `state { … }`; a configuration's file calls `ConfiguratorConf { … }`, a \
                     file of monitors `Monitors { … }`",
                ));
                None
            }
        };
        let (confs, named) = self.named("ConfiguratorConf", "Configuration", "a configuration");
        let mut entries = Vec::with_capacity(named.len());
        for (handle, mut entry) in named {
            entry.value = self.take(handle as usize);
            entry.origin = self.cx.part(entry.value.origin, &entry.key);
            entries.push(entry);
        }
        self.unnamed(stem, confs, &mut entries);
        let monitors = self.monitors();
        self.unused();
        let some = confs > 0 || !entries.is_empty();
        let whole = self.reading.whole;
        Made { configurations: some.then(|| Node::new(Kind::Map(entries), whole)), chart, monitors }
    }

    /// How often a list of that verb was made, and the entries of all of them, in the order in which they were written.
    fn named(&mut self, list: &str, element: &str, what: &str) -> (usize, Vec<(u32, Entry)>) {
        let mut named: Vec<(u32, Entry)> = Vec::new();
        let mut lists = 0;
        for index in 0..self.made.len() {
            if self.made[index].verb != list {
                continue;
            }
            lists += 1;
            self.made[index].uses += 1;
            let Kind::Made(_, entries, _) = self.take(index).kind else { continue };
            for entry in entries {
                match entry.value.kind {
                    Kind::Handle(handle) if self.made[handle as usize].verb == element => named.push((handle, entry)),
                    Kind::Poison => {}
                    _ => {
                        let value = Node::new(entry.value.kind, entry.origin);
                        let example = format!("name = {element} {{ … }}");
                        self.cx.wrong(&value, &format!("`{}`", entry.key), what, &example);
                    }
                }
            }
        }
        // Lua forgets the order of named entries; the order in which the values were made is the written one.
        named.sort_by_key(|(handle, entry)| (*handle, entry.key.clone()));
        (lists, named)
    }

    /// The paper's first listing is a `Configuration` alone in its file: it takes the file's name.
    fn unnamed(&mut self, stem: &str, confs: usize, entries: &mut Vec<Entry>) {
        let alone: Vec<usize> =
            (0..self.made.len()).filter(|i| self.made[*i].verb == "Configuration" && self.made[*i].uses == 0).collect();
        for (nth, index) in alone.into_iter().enumerate() {
            self.made[index].uses += 1;
            let value = self.take(index);
            if confs == 0 && nth == 0 {
                entries.push(Entry { key: stem.to_owned().into(), origin: value.origin, value });
                continue;
            }
            if self.has_lost() {
                continue;
            }
            let finding =
                Finding::error(codes::CONF_UNNAMED, "this configuration has no name, so nothing can ask for it");
            self.cx.report(
                finding
                    .at(value.origin)
                    .labelled("made, and held by nothing")
                    .help("write it as `name = Configuration { … }` inside `ConfiguratorConf { … }`"),
            );
        }
    }

    /// Changes that no configuration holds.
    fn unused(&mut self) {
        if self.has_lost() {
            return;
        }
        for index in 0..self.made.len() {
            let made = &self.made[index];
            if made.uses == 0 && !matches!(made.verb, "Configuration" | "ConfiguratorConf" | "Monitors") {
                let (origin, verb) = (made.origin, made.verb);
                let (message, help) = self.unused_monitor(verb).unwrap_or_else(|| {
                    let message = format!("this `{verb}` stands in no configuration, so it is never made");
                    (message, "put it inside a `Configuration { … }`")
                });
                self.cx.report(Finding::error(codes::LUA_UNUSED, message).at(origin).help(help));
            }
        }
    }
}
