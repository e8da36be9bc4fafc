//! Which function, state, transition and event of a chart is which in Lua.

use super::lower::{self, Lowered};
use crate::model::statechart::FunctionId;
use crate::model::{EventName, Finding, Ident, Origin, Severity, Statechart};
use crate::statechart::{Chart, EdgeId, EventId, NodeId, NodeKind, compile};
use mlua::{Function, Lua, Result, Table, Value};
use rustc_hash::FxHashMap;

/// A chart with its tables. It only ever grows: a number, once given, stays.
#[derive(Clone)]
pub struct Tables {
    pub chart: Chart,
    /// By node: states and connectors.
    nodes: Vec<Value>,
    /// By transition.
    edges: Vec<Value>,
    /// By number.
    functions: Vec<Function>,
    node_of: FxHashMap<usize, NodeId>,
    edge_of: FxHashMap<usize, EdgeId>,
    /// By number in the chart: what a listed event is in Lua.
    listed: Vec<Value>,
    /// By node: the completion's text.
    done: Vec<Value>,
    init: Value,
    known: FxHashMap<Box<[u8]>, EventId>,
    /// Values of events that are no texts → number in `listed`, 1-based.
    odd: Table,
    /// The path of the subsystem whose coordinator it is: in Lua its events are called as in its file.
    pub path: Option<Ident>,
}

/// Why a machine could not be made of its tables.
pub enum NotBuilt {
    Lua(mlua::Error),
    Findings(Vec<Finding>),
}

impl From<mlua::Error> for NotBuilt {
    fn from(error: mlua::Error) -> Self {
        Self::Lua(error)
    }
}

impl Tables {
    /// Compiles a machine's tables; answers also the chart as written. `path`: that of the subsystem whose coordinator it is.
    pub fn new(
        lua: &Lua,
        native: &Table,
        fsm: &Table,
        path: Option<Ident>,
    ) -> std::result::Result<(Self, Statechart), NotBuilt> {
        let list = lower::flat(native, fsm)?;
        // A transition is known by its number; nothing else needs a place here.
        let mut places = |_: Option<usize>, number: usize, word: &str| {
            if word.is_empty() { Origin(u32::try_from(number).unwrap_or(0)) } else { Origin::NONE }
        };
        let Lowered { chart: written, functions, transitions, values, problems } =
            lower::lower(&list, native, &mut places)?.within(path);
        if !problems.is_empty() {
            let findings = problems.into_iter().map(|p| Finding::error(p.code, p.message).help(p.help));
            return Err(NotBuilt::Findings(findings.collect()));
        }
        let (chart, findings) = compile(&written);
        let Some(chart) = chart else {
            return Err(NotBuilt::Findings(findings.into_iter().filter(|f| f.severity == Severity::Error).collect()));
        };
        let mut by_number: FxHashMap<u32, Table> = FxHashMap::default();
        let mut next = transitions.into_iter();
        for number in 1..=list.raw_len() {
            let row: Table = list.raw_get(number)?;
            if row.raw_get::<mlua::LuaString>("what")? == "transition" {
                by_number.extend(next.next().map(|table| (u32::try_from(number).unwrap_or(0), table)));
            }
        }
        let mut tables = Self {
            nodes: Vec::with_capacity(chart.len()),
            edges: vec![Value::Nil; chart.edge_count()],
            functions,
            node_of: FxHashMap::default(),
            edge_of: FxHashMap::default(),
            listed: Vec::new(),
            done: Vec::with_capacity(chart.len()),
            init: Value::String(lua.create_string("e_init_fsm")?),
            known: FxHashMap::from_iter([((*b"e_init_fsm").into(), chart.init_event())]),
            odd: lua.create_table()?,
            chart,
            path,
        };
        for node in tables.chart.nodes() {
            let table = match tables.chart.parent(node).map(|parent| &tables.nodes[parent.index()]) {
                None => Value::Table(fsm.clone()),
                Some(Value::Table(parent)) => parent.raw_get(tables.chart.name(node).as_str())?,
                Some(_) => Value::Nil,
            };
            tables.push_node(lua, node, table)?;
            for edge in tables.chart.outgoing(node) {
                if let Some(table) = by_number.get(&tables.chart.edge_origin(edge).0) {
                    tables.put_edge(edge, table.clone());
                }
            }
        }
        tables.take_events(lua, &values)?;
        Ok((tables, written))
    }

    /// What an event is called in Lua.
    pub fn in_lua(&self, name: EventName) -> &'static str {
        self.path.and_then(|path| name.local(path)).unwrap_or(name.as_str())
    }

    /// The table of a state or connector.
    pub fn node(&self, node: NodeId) -> &Value {
        &self.nodes[node.index()]
    }

    /// The table of a transition.
    pub fn edge(&self, edge: EdgeId) -> &Value {
        &self.edges[edge.index()]
    }

    /// A function.
    pub fn function(&self, function: FunctionId) -> &Function {
        &self.functions[function.0 as usize]
    }

    /// How many functions there are.
    pub fn functions(&self) -> usize {
        self.functions.len()
    }

    /// The state or connector that a table is.
    pub fn node_of(&self, table: &Table) -> Option<NodeId> {
        self.node_of.get(&address(table)).copied()
    }

    /// The transition that a table is.
    pub fn edge_of(&self, table: &Table) -> Option<EdgeId> {
        self.edge_of.get(&address(table)).copied()
    }

    /// What an event is in Lua; none for those that only the machine's memory of strange ones knows.
    pub fn value(&self, event: EventId) -> Option<Value> {
        if let Some(number) = event.listed() {
            return self.listed.get(number).cloned();
        }
        if event.as_strange().is_some() {
            return None;
        }
        if let Some(leaf) = event.as_completion() {
            return self.done.get(leaf.index()).cloned();
        }
        (event != EventId::OTHER).then(|| self.init.clone())
    }

    /// The event that a Lua value is, if it has a number.
    pub fn event(&self, value: &Value) -> Option<EventId> {
        match value {
            Value::String(text) => self.known.get(&*text.as_bytes()).copied(),
            // A number that is none equals nothing, not even itself.
            Value::Number(v) if v.is_nan() => None,
            other => {
                let number = self.odd.raw_get::<Option<usize>>(other.clone()).ok().flatten()?;
                self.chart.events().get(number - 1).map(|event| self.chart.event(*event))
            }
        }
    }

    /// Adds functions; answers how many there were.
    pub(super) fn add_functions(&mut self, functions: Vec<Function>) -> u32 {
        let before = u32::try_from(self.functions.len()).unwrap_or(u32::MAX);
        self.functions.extend(functions);
        before
    }

    /// The table of the node of the next number.
    pub(super) fn push_node(&mut self, lua: &Lua, node: NodeId, table: Value) -> Result<()> {
        let mut done = Value::Nil;
        if self.chart.kind(node) == NodeKind::Leaf {
            let text = format!("e_done@{}", self.chart.fqn(node));
            self.known.insert(text.as_bytes().into(), self.chart.completion(node));
            done = Value::String(lua.create_string(text)?);
        }
        if let Value::Table(table) = &table {
            self.node_of.insert(address(table), node);
        }
        self.nodes.push(table);
        self.done.push(done);
        Ok(())
    }

    /// The table of a transition; one that moved has it under both numbers.
    pub(super) fn put_edge(&mut self, edge: EdgeId, table: Table) {
        if self.edges.len() <= edge.index() {
            self.edges.resize(edge.index() + 1, Value::Nil);
        }
        self.edge_of.insert(address(&table), edge);
        self.edges[edge.index()] = Value::Table(table);
    }

    /// Notes what the events that the chart lists since the last time are in Lua: `values` for those that are no texts.
    pub(super) fn take_events(&mut self, lua: &Lua, values: &[(Value, EventName)]) -> Result<()> {
        for number in self.listed.len()..self.chart.events().len() {
            let name = self.chart.events()[number];
            let id = self.chart.event(name);
            let value = match values.iter().find(|(_, n)| *n == name).map(|(value, _)| value.clone()) {
                Some(value) => value,
                None => Value::String(lua.create_string(self.in_lua(name))?),
            };
            match &value {
                Value::String(text) => {
                    self.known.insert(text.as_bytes().as_ref().into(), id);
                }
                odd => self.odd.raw_set(odd.clone(), number + 1)?,
            }
            self.listed.push(value);
        }
        Ok(())
    }
}

/// A table's address, by which machines and states are known.
pub fn address(table: &Table) -> usize {
    table.to_pointer() as usize
}
