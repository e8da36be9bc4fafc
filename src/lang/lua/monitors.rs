//! The words of the monitor language, as Lua functions and methods that record what they are given.

use super::constructors::of_a_table;
use super::recorder::{Recorder, SharedRecorder};
use super::{convert, sandbox};
use crate::lang::tree::{Kind, Node};
use crate::lang::words::{self, CONDITIONS, SIGNALS, Word};
use crate::limits;
use crate::model::{Finding, codes};
use mlua::{Function, LightUserData, Lua, MultiValue, Table, Value};

/// Puts all words into the environment.
pub fn install(lua: &Lua, env: &Table, shared: &SharedRecorder) -> mlua::Result<()> {
    for word in CONDITIONS.iter().chain(SIGNALS) {
        env.raw_set(word.name, recording(lua, shared, word, false)?)?;
    }
    env.raw_set("monitor", of_a_table(lua, shared, "monitor", None)?)?;
    let unnamed = (codes::MONITOR_UNNAMED, "write `name = monitor { … }`");
    env.raw_set("Monitors", of_a_table(lua, shared, "Monitors", Some(unnamed))?)?;
    Ok(())
}

/// A word as a function, or as a method of its first argument.
fn recording(lua: &Lua, shared: &SharedRecorder, word: &'static Word, method: bool) -> mlua::Result<Function> {
    let recorder = shared.clone();
    lua.create_function(move |lua, args: MultiValue| {
        let line = sandbox::line(lua);
        let origin = {
            let mut recorder = recorder.borrow_mut();
            if recorder.count(1 + args.len(), line) {
                return Err(mlua::Error::runtime("the budget is used up"));
            }
            recorder.call_at(line, word.name)
        };
        if method && !matches!(args.front(), Some(Value::LightUserData(_))) {
            let mut recorder = recorder.borrow_mut();
            let message = format!("`{}` is called with `.`, so it does not get what stands before it", word.name);
            let finding = Finding::error(codes::MONITOR_ARGUMENTS, message).at(origin);
            // What it was to be part of is lost, and no news.
            recorder.undefined.insert(word.name.to_owned());
            recorder.cx.report(finding.help(format!("write `:` for it: `{}`", word.usage)));
            return Ok(convert::poison());
        }
        let mut nodes: Vec<Node> = args.iter().map(|v| convert::node(&recorder, v, origin)).collect();
        if word.many
            && nodes.len() == 1
            && let Kind::List(list) = &mut nodes[0].kind
        {
            nodes = std::mem::take(list);
        }
        let node = Node::new(Kind::Made(word.name, Vec::new(), nodes), origin);
        Ok(convert::handle(recorder.borrow_mut().record(word.name, origin, node)))
    })
}

/// The words that are also methods, by name.
pub fn methods(lua: &Lua, shared: &SharedRecorder) -> mlua::Result<Table> {
    let table = lua.create_table()?;
    for word in CONDITIONS.iter().filter(|word| word.method) {
        table.raw_set(word.name, recording(lua, shared, word, true)?)?;
    }
    Ok(table)
}

/// `age("A.x") > 0.1` cannot be recorded: Lua makes a bool of every comparison. It is said, with the words that can.
pub fn compared(shared: &SharedRecorder, lua: &Lua, sides: [&Value; 2]) {
    let made = |value: &Value| match value {
        Value::LightUserData(handle) => convert::index_of(*handle),
        _ => None,
    };
    let line = sandbox::line(lua);
    let mut recorder = shared.borrow_mut();
    let Some(index) = sides.into_iter().find_map(made) else { return };
    let verb = recorder.made[index].verb;
    let origin = recorder.word_at(line, verb);
    let finding = Finding::error(codes::MONITOR_COMPARED, format!("`{verb}` cannot be compared with `<` or `>` here"));
    // What it was to be part of is lost, and no news.
    recorder.undefined.insert(verb.to_owned());
    recorder.cx.report(
        finding
            .at(origin)
            .help("in Lua that is true or false at once; write `below(…)`, `above(…)`, `at_most(…)` or `at_least(…)`"),
    );
}

impl Recorder {
    /// The named monitors of the file, in the order they were made; none when it has no `Monitors`.
    pub fn monitors(&mut self) -> Option<Node> {
        let (lists, named) = self.named("Monitors", "monitor", "a monitor");
        let mut entries = Vec::with_capacity(named.len());
        for (handle, mut entry) in named {
            let mut value = Node::new(Kind::Handle(handle), entry.origin);
            self.fill(&mut value, false, 0);
            entry.value = value;
            entry.origin = self.cx.part(entry.value.origin, &entry.key);
            entries.push(entry);
        }
        (lists > 0).then(|| Node::new(Kind::Map(entries), self.reading.whole))
    }

    /// Puts what was made into its places, at every depth. What stands in several places is copied, under the budget.
    pub(super) fn fill(&mut self, node: &mut Node, copy: bool, depth: usize) {
        if depth > limits::TEXT_DEPTH {
            let origin = node.origin;
            node.kind = Kind::Poison;
            if self.undefined.insert("\0depth".to_owned()) {
                let message = format!("conditions nested more than {} levels deep", limits::TEXT_DEPTH);
                let finding = Finding::error(codes::TEXT_TOO_DEEP, message).at(origin);
                self.cx.report(finding.help("`all` and `any` take as many conditions as are wanted, side by side"));
            }
            return;
        }
        let mut copy = copy;
        if let Kind::Handle(handle) = node.kind {
            if self.count(1, 1) {
                node.kind = Kind::Poison;
                return;
            }
            let made = &mut self.made[handle as usize];
            copy |= made.uses > 1;
            let made = if copy { made.node.clone() } else { made.node.take() };
            *node = made.unwrap_or_else(|| Node::new(Kind::Poison, node.origin));
        }
        match &mut node.kind {
            Kind::Made(_, entries, items) => {
                entries.iter_mut().for_each(|entry| self.fill(&mut entry.value, copy, depth + 1));
                items.iter_mut().for_each(|item| self.fill(item, copy, depth + 1));
            }
            Kind::List(items) => items.iter_mut().for_each(|item| self.fill(item, copy, depth + 1)),
            Kind::Map(entries) => entries.iter_mut().for_each(|entry| self.fill(&mut entry.value, copy, depth + 1)),
            _ => {}
        }
    }

    /// What to say of something that no `Monitors` holds; none when it is no word of this language.
    pub fn unused_monitor(&self, verb: &str) -> Option<(String, &'static str)> {
        match verb {
            "monitor" => Some((
                "this monitor has no name, so nothing evaluates it".to_owned(),
                "write it as `name = monitor { … }` inside `Monitors { … }`",
            )),
            word => words::find(word).map(|_| {
                (
                    format!("this `{word}` stands in no monitor, so it is never evaluated"),
                    "put it into the `when` of a monitor, or into the `holds` of a configuration",
                )
            }),
        }
    }
}

/// The method of a handle, if there is one of that name.
pub fn method(methods: &Table, handle: LightUserData, name: &str) -> mlua::Result<Option<Function>> {
    if convert::index_of(handle).is_none() {
        return Ok(None);
    }
    methods.raw_get(name)
}
