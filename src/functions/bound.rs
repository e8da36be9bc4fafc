//! A machine with its tables, and what a call may see of it and send to it.

use super::budget::Budget;
use super::errors::{message_of, undefined_global, without_address};
use super::tables::{NotBuilt, Tables};
use super::voice::Voice;
use crate::limits;
use crate::model::{Ident, Openings};
use crate::statechart::{Chart, EdgeId, EventId, HookContext, Machine, NodeId, NodeKind, Printer};
use mlua::{Function, Lua, LuaString, Result, Table, Thread, Value};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// Strange events remembered at once: more than a queue, a step and the call in between can hold.
const STRANGE: usize = 4 * limits::CHART_QUEUE;

/// What a call may see of the machine, and what it sends.
#[derive(Debug, Default)]
pub struct Status {
    pub active: Vec<NodeId>,
    pub leaf: Option<NodeId>,
    /// How many events wait, and how many more would find room.
    pub waiting: usize,
    pub room: usize,
    pub outbox: Vec<EventId>,
    /// Whether the activity of the active leaf is through.
    pub through: bool,
}

/// A machine's tables.
pub struct BoundMachine {
    pub budget: Rc<Budget>,
    pub voice: Rc<Voice>,
    /// They only grow, and a call that is under way keeps those it began with.
    pub tables: RefCell<Rc<Tables>>,
    /// The model has added to them, and the machine is not told yet.
    pub has_grown: Cell<bool>,
    /// As written, for comparing two runs of one text.
    pub written: crate::model::Statechart,
    pub fsm: Table,
    strange: RefCell<Vec<Value>>,
    strange_next: Cell<usize>,
    pub status: RefCell<Status>,
    /// The leaf that `fsm._act_leaf` shows.
    shown_leaf: Cell<Option<NodeId>>,
    pub thread: RefCell<Option<Thread>>,
    /// The events of this step as the functions get them.
    pub events: RefCell<Option<Table>>,
    /// Resumes the coroutine of a `doo`.
    pub go_on: Function,
    /// Words that functions are called with.
    pub words: CallWords,
    /// The model has a `dbg` printer of its own.
    pub traces: Cell<bool>,
    /// The printer of those that have none.
    quiet: Value,
    /// What a step hook raised: ends a step of an inner machine.
    pub failed: RefCell<Option<mlua::Error>>,
    /// Stepped by Davit, not by Lua.
    pub driven: Cell<bool>,
    /// The machine of one that is stepped by Lua; none while it is being stepped.
    pub machine: RefCell<Option<Machine>>,
    /// `getevents` was given by the model.
    pub polls: bool,
    pub idle_hook: bool,
}

/// Words that functions are called with.
pub struct CallWords {
    pub entry: LuaString,
    pub exit: LuaString,
    pub effect: LuaString,
    pub doo: LuaString,
    pub pre_step: LuaString,
    pub post_step: LuaString,
    /// The name of the printer that hears of what happens.
    pub dbg: LuaString,
    /// Where a model finds its active leaf.
    pub act_leaf: LuaString,
}

impl BoundMachine {
    /// Compiles a machine's tables. `native`: the functions of the Lua part; `path`: see [`Tables::new`].
    pub fn new(
        lua: &Lua,
        (budget, voice): (&Rc<Budget>, &Rc<Voice>),
        native: &Table,
        fsm: &Table,
        path: Option<Ident>,
    ) -> std::result::Result<Self, NotBuilt> {
        let (tables, written) = Tables::new(lua, native, fsm, path)?;
        let given = |key: &str| -> Result<bool> { Ok(matches!(fsm.raw_get(key)?, Value::Function(_))) };
        let polls = given("_polls")?;
        let word = |text: &str| lua.create_string(text);
        let machine = Machine::new(&tables.chart);
        fsm.raw_set("_act_leaf", false)?;
        Ok(Self {
            budget: budget.clone(),
            voice: voice.clone(),
            written,
            fsm: fsm.clone(),
            strange: RefCell::default(),
            strange_next: Cell::new(0),
            status: RefCell::new(Status { room: limits::CHART_QUEUE, ..Status::default() }),
            shown_leaf: Cell::new(None),
            thread: RefCell::default(),
            events: RefCell::default(),
            words: CallWords {
                entry: word("entry")?,
                exit: word("exit")?,
                effect: word("effect")?,
                doo: word("doo")?,
                pre_step: word("pre_step_hook")?,
                post_step: word("post_step_hook")?,
                dbg: word("dbg")?,
                act_leaf: word("_act_leaf")?,
            },
            go_on: native.raw_get("go_on")?,
            traces: Cell::new(false),
            quiet: native.raw_get("quiet")?,
            failed: RefCell::default(),
            driven: Cell::new(false),
            machine: RefCell::new(Some(machine)),
            polls,
            idle_hook: given("idle_hook")?,
            tables: RefCell::new(Rc::new(tables)),
            has_grown: Cell::new(false),
        })
    }

    /// The tables as they are now.
    pub fn tables(&self) -> Rc<Tables> {
        self.tables.borrow().clone()
    }

    /// An event as it is known now: what was strange, or a completion that no transition listed, may be listed since.
    pub fn known_now(&self, event: EventId) -> EventId {
        match self.value(event) {
            Value::Nil => event,
            value => self.event(value),
        }
    }

    /// Looks whether there is a `dbg` printer that wants to hear of what happens; it may come and go between steps.
    pub fn look_for_dbg(&self) {
        let dbg = self.fsm.raw_get::<Value>(&self.words.dbg);
        self.traces.set(dbg.is_ok_and(|dbg| matches!(dbg, Value::Function(_)) && dbg != self.quiet));
    }

    /// What an event is in Lua.
    pub fn value(&self, event: EventId) -> Value {
        if let Some(number) = event.as_strange() {
            return self.strange.borrow().get(number as usize).cloned().unwrap_or(Value::Nil);
        }
        self.tables.borrow().value(event).unwrap_or(Value::Nil)
    }

    /// An event in words. One that is no text has the name by which the chart knows it, never an address: two runs of one
    /// model tell the same.
    pub fn event_text(&self, chart: &Chart, event: EventId) -> String {
        // As from outside, like everything else that is told of it.
        let path = self.tables.borrow().path;
        if path.is_some() && event.as_strange().is_none() {
            return chart.event_text(event);
        }
        let value = self.value(event);
        let text = match &value {
            Value::Nil => return chart.event_text(event),
            value => value.to_string().unwrap_or_default(),
        };
        match (without_address(&text), event.as_strange()) {
            (None, _) => path.map_or_else(|| text.clone(), |path| format!("{path}/{text}")),
            (Some(_), None) => chart.event_text(event),
            (Some(kind), Some(number)) => format!("{kind}#unlisted{}", number + 1),
        }
    }

    /// The event that a Lua value is.
    pub fn event(&self, value: Value) -> EventId {
        if let Some(event) = self.tables.borrow().event(&value) {
            return event;
        }
        let mut strange = self.strange.borrow_mut();
        let number = self.strange_next.get();
        self.strange_next.set((number + 1) % STRANGE);
        if number < strange.len() {
            strange[number] = value;
        } else {
            strange.push(value);
        }
        EventId::strange(u32::try_from(number).unwrap_or(0))
    }

    /// Sends events to the machine from within a call.
    pub fn send(&self, values: impl IntoIterator<Item = Value>) {
        let mut lost = 0;
        for value in values {
            let room = {
                let status = self.status.borrow();
                status.outbox.len() < status.room
            };
            if !room {
                lost += 1;
                continue;
            }
            let event = self.event(value);
            self.status.borrow_mut().outbox.push(event);
        }
        self.voice.no_room(lost);
    }

    /// The events of the step that a view shows.
    pub fn events(&self, lua: &Lua, view: &HookContext<'_>) -> Result<Table> {
        if let Some(table) = &*self.events.borrow() {
            return Ok(table.clone());
        }
        let table = lua.create_table_with_capacity(view.events.len(), 0)?;
        for event in view.events {
            table.raw_push(self.value(*event))?;
        }
        *self.events.borrow_mut() = Some(table.clone());
        Ok(table)
    }

    /// Puts the active leaf where rFSM has it (`docs/rfsm.md` §5): only when it is another one than was seen last.
    pub fn show_leaf(&self, leaf: Option<NodeId>) {
        if self.shown_leaf.replace(leaf) == leaf {
            return;
        }
        let value = leaf.map_or(Value::Boolean(false), |leaf| self.tables.borrow().node(leaf).clone());
        // Where there is no memory for that, the call that comes finds none either.
        let _ = self.fsm.raw_set(&self.words.act_leaf, value);
    }

    /// Makes a call that sees what `view` shows; what it sends goes into the view's queue.
    pub fn calling<R>(&self, view: &mut HookContext<'_>, call: impl FnOnce() -> Result<R>) -> Result<R> {
        {
            let mut status = self.status.borrow_mut();
            status.leaf = view.leaf;
            status.waiting = view.queue.events().len();
            status.room = view.queue.room();
        }
        self.show_leaf(view.leaf);
        let outcome = self.budget.spend(limits::CALL_INSTRUCTIONS, call);
        let mut status = self.status.borrow_mut();
        for event in status.outbox.drain(..) {
            view.queue.push(event);
        }
        outcome
    }

    /// Tells the model's `err` of an error: a tag, a text, and the message.
    pub fn complain(&self, tag: &str, text: &str, error: &mlua::Error) {
        let mut message = message_of(error);
        if let Some(name) = undefined_global(&message) {
            let why = if Openings::NAMES.contains(&name) {
                format!("closed to this model, `trusted: {{ open: [{name}] }}` in a deployment opens it")
            } else {
                format!(
                    "there is no `{name}`; if the model expects it from its host, a Lua file can stand in for it: \
                     `host: [FILE]` in a deployment, `--host FILE` of `davit sim`"
                )
            };
            message = format!("{message}: {why}");
        }
        let told = self.fsm.raw_get::<Value>("err").and_then(|printer| match printer {
            Value::Function(err) => {
                self.budget.spend(limits::CALL_INSTRUCTIONS, || err.call::<()>((tag, text, message.as_str())))
            }
            _ => Err(mlua::Error::runtime("no printer")),
        });
        if told.is_err() {
            self.voice.say(Printer::Err, &format!("{tag} {text}{message}"));
        }
    }

    /// A transition's text as rFSM writes it.
    pub fn transition_text(&self, edge: EdgeId) -> String {
        let text = |tr: &Table| -> Result<String> {
            let end = |key| -> Result<String> {
                Ok(match tr.raw_get::<Value>(key)? {
                    Value::Table(node) => node.raw_get::<Option<String>>("_fqn")?.unwrap_or_default(),
                    other => other.to_string()?,
                })
            };
            let pn = tr.raw_get::<Option<f64>>("pn")?.map(|pn| format!(", pn={pn}")).unwrap_or_default();
            let mut events = Vec::new();
            if let Value::Table(list) = tr.raw_get("events")? {
                for event in list.sequence_values::<Value>() {
                    events.push(event?.to_string()?);
                }
            }
            let events = if events.is_empty() { "{}".to_owned() } else { events.join(", ") };
            Ok(format!("T={{ src='{}', tgt='{}{pn}', events='{events}' }}", end("src")?, end("tgt")?))
        };
        match self.tables.borrow().edge(edge) {
            Value::Table(tr) => text(tr).unwrap_or_default(),
            _ => String::new(),
        }
    }

    /// `active`, `done` or `inactive`.
    pub fn mode(&self, node: NodeId) -> &'static str {
        let status = self.status.borrow();
        if !status.active.contains(&node) {
            return "inactive";
        }
        let chart = &self.tables.borrow().chart;
        let settled = chart.kind(node) == NodeKind::Leaf
            && status.leaf == Some(node)
            && (chart.doo(node).is_none() || status.through);
        if settled { "done" } else { "active" }
    }
}
