//! From a machine's Lua tables to the model's statechart, with its functions in a list.

use crate::limits;
use crate::model::naming::Naming;
use crate::model::statechart::{
    Action, ChartNode, ChartTransition, Connector, FunctionId, Since, State, Statechart, TimeEvent, Trigger,
};
use crate::model::within::Within;
use crate::model::{Code, ConfigId, EventName, Ident, Origin, codes};
use mlua::{Function, Result, Table, Value};
use std::collections::BTreeMap;

/// Where a constructor was called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Spot {
    /// The file, by the name it was run under.
    pub file: String,
    /// The line, from 1.
    pub line: u32,
    /// The how-manieth call on that line, from 0.
    pub nth: u32,
}

/// What is wrong with a part of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// The code of the finding.
    pub code: Code,
    /// What is wrong.
    pub message: String,
    /// The place, as the caller gave it.
    pub origin: Origin,
    /// What to do.
    pub help: String,
}

/// A chart with what belongs to it in Lua.
pub struct Lowered {
    pub chart: Statechart,
    pub functions: Vec<Function>,
    /// Transitions in the order of the list; their origins are given by number.
    pub transitions: Vec<Table>,
    /// Events that are no plain texts: value and name, in pairs.
    pub values: Vec<(Value, EventName)>,
    pub problems: Vec<Problem>,
}

impl Lowered {
    /// The same, of a coordinator of the subsystem of that path: its events are called as from outside. What they are in Lua stays.
    pub fn within(mut self, path: Option<Ident>) -> Self {
        if let Some(path) = path {
            let within = Within { path, activities: &BTreeMap::new() };
            within.chart(&mut self.chart);
            self.values.iter_mut().for_each(|(_, name)| *name = within.event(*name));
        }
        self
    }
}

/// Gives places: by the number of the spot, the number in the list, and a word.
pub type OriginLookup<'a> = dyn FnMut(Option<usize>, usize, &str) -> Origin + 'a;

struct Lowering<'a, 'p> {
    functions: Vec<Function>,
    plugins: Vec<(FunctionId, String)>,
    values: Vec<(Value, EventName)>,
    problems: Vec<Problem>,
    places: &'a mut OriginLookup<'p>,
    timed_class: Table,
    /// By function: the plugin that added it.
    plugin_of: Table,
}

/// The flat list that `rfsm.lua` makes of a machine, as a chart.
pub fn lower(list: &Table, native: &Table, places: &mut OriginLookup<'_>) -> Result<Lowered> {
    let (timed_class, plugin_of) = (native.raw_get("timed_class")?, native.raw_get("plugin_of")?);
    let mut with = Lowering {
        functions: Vec::new(),
        plugins: Vec::new(),
        values: Vec::new(),
        problems: Vec::new(),
        places,
        timed_class,
        plugin_of,
    };
    let length = list.raw_len();
    // By number in the list: states not yet put into their parents.
    let mut made: Vec<Option<(State, usize, Option<ChartNode>)>> = Vec::with_capacity(length);
    let mut transitions = Vec::new();
    for number in 1..=length {
        let row: Table = list.raw_get(number)?;
        let what: String = row.raw_get("what")?;
        let scope: usize = row.raw_get("scope")?;
        let table: Table = row.raw_get("table")?;
        let spot: Option<usize> = row.raw_get("spot")?;
        let origin = (with.places)(spot, number, "");
        if what == "transition" {
            let transition = with.transition(&row, &table, number, spot, origin)?;
            transitions.push((scope, transition, table));
            made.push(None);
            continue;
        }
        let text: String = row.raw_get("name")?;
        let name = match Ident::new(&text) {
            Ok(name) => name,
            Err(error) => {
                let message = format!("`{text}` cannot be the name of a state: {}", error.reason);
                with.problem(codes::TEXT_BAD_NAME, message, origin, "take another name");
                Ident::new("unnamed").expect("a name")
            }
        };
        if what == "connector" {
            let doc = None;
            made.push(Some((State::new(name), scope, Some(ChartNode::Connector(Connector { name, doc, origin })))));
        } else {
            let state = with.state(name, &table, number, spot, origin)?;
            made.push(Some((state, scope, None)));
        }
    }
    // Transitions into their scopes in written order, then children into parents, the last first.
    let mut tables = Vec::with_capacity(transitions.len());
    for (scope, transition, table) in transitions {
        if let Some(Some((state, ..))) = made.get_mut(scope.wrapping_sub(1)) {
            state.transitions.push(transition);
        }
        tables.push(table);
    }
    for number in (1..made.len()).rev() {
        let Some((state, scope, connector)) = made[number].take() else { continue };
        if let Some(Some((parent, ..))) = made.get_mut(scope.wrapping_sub(1)) {
            parent.children.insert(0, connector.unwrap_or(ChartNode::State(state)));
        }
    }
    let mut chart =
        made.first_mut().and_then(Option::take).map_or_else(Statechart::default, |(root, ..)| Statechart::new(root));
    let Lowering { functions, plugins, values, problems, .. } = with;
    chart.plugins = plugins;
    Ok(Lowered { chart, functions, transitions: tables, values, problems })
}

impl Lowering<'_, '_> {
    fn problem(&mut self, code: Code, message: String, origin: Origin, help: &str) {
        if self.problems.len() < limits::FINDINGS {
            self.problems.push(Problem { code, message, origin, help: help.to_owned() });
        }
    }

    fn function(&mut self, function: Function) -> FunctionId {
        let id = FunctionId(u32::try_from(self.functions.len()).unwrap_or(u32::MAX));
        let plugin = self.plugin_of.raw_get::<Option<String>>(&function).ok().flatten();
        self.plugins.extend(plugin.map(|plugin| (id, plugin)));
        self.functions.push(function);
        id
    }

    fn state(
        &mut self,
        name: Ident,
        table: &Table,
        number: usize,
        spot: Option<usize>,
        origin: Origin,
    ) -> Result<State> {
        let mut state = State::new(name);
        state.origin = origin;
        state.entry = self.actions(table, "entry", number, spot)?;
        state.exit = self.actions(table, "exit", number, spot)?;
        for value in one_or_more(table.raw_get("config")?)? {
            let place = self.place(spot, number, &value);
            match value.as_string().map(mlua::LuaString::to_string_lossy).map(|text| ConfigId::new(&text)) {
                Some(Ok(id)) => state.config.push((id, place)),
                Some(Err(error)) => {
                    self.problem(codes::TEXT_BAD_NAME, error.to_string(), place, "name a configuration")
                }
                None => self.wrong("`config`", &value, place, "name a configuration: config = \"enable_copying\""),
            }
        }
        state.doo = self.one_function(table, "doo", "fsm, state", number, spot)?;
        state.doc = table.raw_get::<Value>("doc")?.as_string().map(mlua::LuaString::to_string_lossy);
        Ok(state)
    }

    fn one_function(
        &mut self,
        table: &Table,
        key: &str,
        arguments: &str,
        number: usize,
        spot: Option<usize>,
    ) -> Result<Option<(FunctionId, Origin)>> {
        let value = table.raw_get::<Value>(key)?;
        if value.is_nil() {
            return Ok(None);
        }
        let place = (self.places)(spot, number, key);
        if let Value::Function(f) = value {
            return Ok(Some((self.function(f), place)));
        }
        let help = format!("write a function: {key} = function({arguments}) … end");
        self.wrong(&format!("`{key}`"), &value, place, &help);
        Ok(None)
    }

    fn wrong(&mut self, what: &str, value: &Value, origin: Origin, help: &str) {
        let message = format!("{what} is a {}, which means nothing here", value.type_name());
        self.problem(codes::TEXT_WRONG_TYPE, message, origin, help);
    }

    fn place(&mut self, spot: Option<usize>, number: usize, value: &Value) -> Origin {
        let word = value.as_string().map(mlua::LuaString::to_string_lossy).unwrap_or_default();
        (self.places)(spot, number, &word)
    }

    /// Functions to call and names to raise, mixed.
    fn actions(
        &mut self,
        table: &Table,
        key: &str,
        number: usize,
        spot: Option<usize>,
    ) -> Result<Vec<(Action, Origin)>> {
        let mut out = Vec::new();
        for value in one_or_more(table.raw_get(key)?)? {
            if let Value::Function(function) = value {
                let place = (self.places)(spot, number, key);
                out.push((Action::Function(self.function(function)), place));
                continue;
            }
            let place = self.place(spot, number, &value);
            match value.as_string().map(mlua::LuaString::to_string_lossy).map(|text| EventName::new(&text)) {
                Some(Ok(name)) => out.push((Action::Raise(name), place)),
                Some(Err(error)) => {
                    self.problem(codes::TEXT_BAD_NAME, error.to_string(), place, "names have no blanks")
                }
                None => self.wrong(&format!("`{key}`"), &value, place, "write a function, or names to raise"),
            }
        }
        Ok(out)
    }

    fn transition(
        &mut self,
        row: &Table,
        table: &Table,
        number: usize,
        spot: Option<usize>,
        origin: Origin,
    ) -> Result<ChartTransition> {
        let mut out = ChartTransition { origin, ..ChartTransition::default() };
        for (key, end) in [("src", &mut out.src), ("tgt", &mut out.tgt)] {
            match row.raw_get::<Value>(key)? {
                Value::Nil => {}
                Value::String(text) => {
                    let text = text.to_string_lossy();
                    let place = (self.places)(spot, number, &text);
                    *end = Some((text, place));
                }
                other => {
                    let place = (self.places)(spot, number, key);
                    self.wrong(&format!("`{key}`"), &other, place, "write the name of a state: src = \"idle\"");
                }
            }
        }
        // `init` writes out whose completion `e_done` is; the chart has it as it is written in a text.
        let done = match table.raw_get::<Value>("src")? {
            Value::Table(src) => src.raw_get::<Option<String>>("_fqn")?.map(|fqn| format!("e_done@{fqn}")),
            _ => None,
        };
        for value in one_or_more(table.raw_get("events")?)? {
            let is_own_done =
                matches!((&value, &done), (Value::String(text), Some(done)) if text.as_bytes() == done.as_bytes());
            if is_own_done {
                let place = (self.places)(spot, number, "e_done");
                out.events.push((Trigger::parse("e_done").expect("an event"), place));
                continue;
            }
            let place = self.place(spot, number, &value);
            let trigger = self.trigger(value, place)?;
            out.events.extend(trigger.map(|trigger| (trigger, place)));
        }
        out.guard = self.one_function(table, "guard", "tr, events", number, spot)?;
        out.effect = self.actions(table, "effect", number, spot)?;
        out.pn = match table.raw_get::<Value>("pn")? {
            Value::Nil => 0.0,
            #[allow(clippy::cast_precision_loss)] // priorities are small
            Value::Integer(v) => v as f64,
            Value::Number(v) => v,
            other => {
                let place = (self.places)(spot, number, "pn");
                self.wrong("`pn`", &other, place, "write a number: pn = 1");
                0.0
            }
        };
        out.doc = table.raw_get::<Value>("doc")?.as_string().map(mlua::LuaString::to_string_lossy);
        Ok(out)
    }

    fn trigger(&mut self, value: Value, place: Origin) -> Result<Option<Trigger>> {
        Ok(match &value {
            Value::Function(f) => Some(Trigger::Predicate(self.function(f.clone()))),
            Value::String(text) => match Trigger::parse(&text.to_string_lossy()) {
                Ok(trigger) => Some(trigger),
                Err(_) => Some(Trigger::Event(self.named(value.clone(), "text"))),
            },
            Value::Table(table) if table.metatable().as_ref() == Some(&self.timed_class) => {
                let since = if table.raw_get::<String>("since")? == "e_at" { Since::Start } else { Since::Entry };
                let id: String = table.raw_get("id")?;
                if id.is_empty()
                    || id.chars().any(|c| c.is_whitespace() || c.is_control() || matches!(c, ',' | '(' | ')'))
                {
                    let message = format!("`{id}` cannot name a time event");
                    self.problem(codes::TEXT_BAD_NAME, message, place, "no blanks, commas or parentheses");
                    return Ok(None);
                }
                let (seconds, by) = match table.raw_get::<Value>("x")? {
                    Value::Function(f) => (0.0, Some(self.function(f))),
                    #[allow(clippy::cast_precision_loss)] // seconds
                    Value::Integer(v) => (v as f64, None),
                    Value::Number(v) if v.is_finite() => (v, None),
                    _ => {
                        self.problem(
                            codes::TEXT_BAD_VALUE,
                            "a time event needs a finite time".to_owned(),
                            place,
                            "give seconds",
                        );
                        return Ok(None);
                    }
                };
                Some(Trigger::Timed(TimeEvent { since, seconds, id, by }))
            }
            Value::Nil => None,
            other => {
                let kind = other.type_name();
                Some(Trigger::Event(self.named(value.clone(), kind)))
            }
        })
    }

    /// A name for an event that is no plain text.
    fn named(&mut self, value: Value, kind: &str) -> EventName {
        if let Some((_, name)) = self.values.iter().find(|(known, _)| *known == value) {
            return *name;
        }
        let name = EventName::new(&format!("{kind}#{}", self.values.len() + 1)).expect("no blanks");
        self.values.push((value, name));
        name
    }
}

/// A value, or the elements of a list. A timed event is a table and no list.
fn one_or_more(value: Value) -> Result<Vec<Value>> {
    match value {
        Value::Nil => Ok(Vec::new()),
        Value::Table(list) if list.metatable().is_none() => {
            let mut out = Vec::new();
            for i in 1..=list.raw_len() {
                out.push(list.raw_get::<Value>(i)?);
            }
            Ok(out)
        }
        other => Ok(vec![other]),
    }
}

/// The flat list of a machine.
pub fn flat(native: &Table, fsm: &Table) -> Result<Table> {
    native.raw_get::<Function>("flatten")?.call(fsm)
}
