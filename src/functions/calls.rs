//! The hook: how the engine calls a machine's functions, with what rFSM gives them.

use super::bound::BoundMachine;
use super::host::Host;
use super::tracing;
use crate::limits;
use crate::model::EventName;
use crate::model::statechart::FunctionId;
use crate::statechart::{
    ActionPlace, Chart, Doo, EdgeId, EventId, FunctionOutput, Hook, HookContext, NodeId, Printer, Queue, Trace,
};
use mlua::thread::ThreadStatus;
use mlua::{Lua, LuaString, Result, Value};
use std::rc::Rc;
use std::sync::Arc;

/// Calls the functions of one machine.
pub struct Functions {
    /// What a coordinator's functions share; an inner machine's is held by the outermost one's. It goes before the state.
    pub(super) _host: Option<Rc<Host>>,
    pub(super) lua: Lua,
    pub(super) bound: Rc<BoundMachine>,
}

impl std::fmt::Debug for Functions {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Functions").field("count", &self.bound.tables().functions()).finish()
    }
}

impl Functions {
    /// Calls a step hook with the table of the step's events. `false`: it raised an error that ends the step.
    fn step_hook(&self, field: &LuaString, view: &mut HookContext<'_>) -> bool {
        let bound = &self.bound;
        let Ok(Value::Function(hook)) = bound.fsm.raw_get(field) else { return true };
        let outcome = bound
            .events(&self.lua, view)
            .and_then(|events| bound.calling(view, || hook.call::<()>((&bound.fsm, &events))));
        let Err(error) = outcome else { return true };
        self.failed(error, "HOOK", &field.to_string_lossy());
        bound.driven.get()
    }

    /// rFSM lets an error of a hook end the step: who steps his machines himself reads of it, of a machine that Davit steps
    /// `err` is told.
    fn failed(&self, error: mlua::Error, tag: &str, what: &str) {
        let bound = &self.bound;
        if bound.driven.get() {
            bound.complain(tag, &format!("error executing {what}: "), &error);
        } else {
            bound.failed.borrow_mut().get_or_insert(error);
        }
    }

    /// What a hook left in the table of a step's events.
    fn left_in_table(&self, was: &mut Vec<EventId>) {
        let bound = &self.bound;
        let Some(table) = bound.events.borrow().clone() else { return };
        let mut count = 0;
        while count < limits::CHART_QUEUE
            && let Ok(value) = table.raw_get::<Value>(count + 1)
            && !value.is_nil()
        {
            match was.get(count) {
                Some(event) if bound.value(*event) == value => {}
                Some(_) => was[count] = bound.event(value),
                None => was.push(bound.event(value)),
            }
            count += 1;
        }
        was.truncate(count);
    }

    /// Tells the model's `err` a text.
    fn tell_err(&self, text: &str) {
        let told = self
            .bound
            .fsm
            .raw_get::<mlua::Function>("err")
            .and_then(|err| self.bound.budget.spend(limits::CALL_INSTRUCTIONS, || err.call::<()>(text)));
        if told.is_err() {
            self.bound.voice.say(Printer::Err, text);
        }
    }

    fn guarded(&self, function: FunctionId, edge: EdgeId, view: &mut HookContext<'_>) -> Result<Value> {
        let bound = &self.bound;
        let events = bound.events(&self.lua, view)?;
        let tables = bound.tables();
        bound.calling(view, || tables.function(function).call((tables.edge(edge), events)))
    }

    fn resumed(&self, function: FunctionId, state: NodeId, view: &mut HookContext<'_>) -> Result<Doo> {
        let bound = &self.bound;
        let tables = bound.tables();
        if bound.traces.get() && bound.thread.borrow().is_none() {
            tracing::tell_doo(&self.lua, bound, "begins:", state, view);
        }
        let thread = {
            let mut kept = bound.thread.borrow_mut();
            match &*kept {
                Some(thread) => thread.clone(),
                None => {
                    let thread = self.lua.create_thread(tables.function(function).clone())?;
                    *kept = Some(thread.clone());
                    thread
                }
            }
        };
        let value: Value = bound.calling(view, || {
            // By Lua's own resume: mlua's clears the stack of a thread that failed, and so closes its variables uncounted.
            bound.go_on.call((&thread, &bound.fsm, tables.node(state), &bound.words.doo))
        })?;
        Ok(if thread.status() == ThreadStatus::Resumable {
            Doo::Yielded { idle: !matches!(value, Value::Nil | Value::Boolean(false)) }
        } else {
            Doo::Finished
        })
    }

    fn polled(&self) -> Result<Vec<Value>> {
        let bound = &self.bound;
        let Value::Function(getevents) = bound.fsm.raw_get("getevents")? else { return Ok(Vec::new()) };
        let events: Value = bound.budget.spend(limits::CALL_INSTRUCTIONS, || getevents.call(()))?;
        let Value::Table(list) = events else { return Ok(Vec::new()) };
        list.sequence_values().collect()
    }
}

impl Hook for Functions {
    fn event(&mut self, _: &Chart, name: EventName) -> EventId {
        let text = self.bound.tables().in_lua(name);
        match self.lua.create_string(text) {
            Ok(text) => self.bound.event(Value::String(text)),
            Err(_) => EventId::OTHER,
        }
    }

    fn event_text(&self, chart: &Chart, event: EventId) -> String {
        self.bound.event_text(chart, event)
    }

    fn seconds(&mut self, function: FunctionId, state: NodeId, view: &mut HookContext<'_>) -> Option<f64> {
        let bound = &self.bound;
        let tables = bound.tables();
        let seconds = bound.calling(view, || tables.function(function).call::<f64>(()));
        match seconds {
            Ok(seconds) => Some(seconds),
            Err(error) => {
                let text = format!("time of state '{}' failed: ", view.chart.fqn(state));
                bound.complain("TIMEEVENT", &text, &error);
                None
            }
        }
    }

    fn said(&mut self, said: &mut Vec<FunctionOutput>) {
        self.bound.voice.drain(said);
    }

    fn lost(&self) -> u64 {
        self.bound.voice.lost_events()
    }

    fn traces(&self) -> bool {
        self.bound.traces.get()
    }

    fn trace(&mut self, what: Trace<'_>, view: &mut HookContext<'_>) {
        tracing::tell(&self.lua, &self.bound, what, view);
    }

    fn polls(&self) -> bool {
        self.bound.polls || self.bound.idle_hook
    }

    fn entered(&mut self, _: &Chart, state: NodeId) {
        let mut status = self.bound.status.borrow_mut();
        status.active.push(state);
        status.through = false;
    }

    fn exited(&mut self, _: &Chart, _: NodeId) {
        self.bound.status.borrow_mut().active.pop();
    }

    fn conflict(&mut self, chart: &Chart, connector: NodeId, ways: &mut dyn Iterator<Item = EdgeId>) {
        let bound = &self.bound;
        let warn = |args: Vec<String>| {
            let told = bound.fsm.raw_get::<mlua::Function>("warn").and_then(|warn| {
                let args: mlua::Variadic<String> = args.iter().cloned().collect();
                bound.budget.spend(limits::CALL_INSTRUCTIONS, || warn.call::<()>(args))
            });
            if told.is_err() {
                bound.voice.say(Printer::Warn, &args.join(" "));
            }
        };
        warn(vec![format!("conflicting transitions from src {} to", chart.fqn(connector))]);
        for way in ways {
            warn(vec!["\t".to_owned(), chart.fqn(chart.ends(way).1).to_string()]);
        }
    }

    fn not_entered(&mut self, _: &Chart) {
        self.tell_err("ERROR: failed to enter fsm root root, no valid path from root.initial");
    }

    fn poll(&mut self, queue: &mut Queue) -> bool {
        // What was sent between two microsteps.
        for event in self.bound.status.borrow_mut().outbox.drain(..) {
            queue.push(event);
        }
        if !self.bound.polls {
            return true;
        }
        match self.polled() {
            Ok(values) => {
                for value in values {
                    if queue.room() == 0 {
                        queue.push(EventId::OTHER); // counted as dropped
                    } else {
                        queue.push(self.bound.event(value));
                    }
                }
                true
            }
            Err(error) => {
                self.failed(error, "GETEVENTS", "getevents");
                self.bound.driven.get()
            }
        }
    }

    fn before_step(&mut self, view: &mut HookContext<'_>, events: &mut Vec<EventId>) -> bool {
        *self.bound.events.borrow_mut() = None;
        self.bound.look_for_dbg();
        let goes_on = self.step_hook(&self.bound.words.pre_step, view);
        self.left_in_table(events);
        goes_on
    }

    fn after_step(&mut self, view: &mut HookContext<'_>) {
        if self.bound.failed.borrow().is_none() {
            self.step_hook(&self.bound.words.post_step, view);
        }
        self.bound.status.borrow_mut().leaf = view.leaf;
        self.bound.show_leaf(view.leaf);
    }

    fn guard(&mut self, function: FunctionId, edge: EdgeId, view: &mut HookContext<'_>) -> bool {
        match self.guarded(function, edge, view) {
            Ok(value) => value != Value::Boolean(false),
            Err(error) => {
                let text = format!("error executing guard of {}: ", self.bound.transition_text(edge));
                self.bound.complain("GUARD", &text, &error);
                false
            }
        }
    }

    fn predicate(&mut self, function: FunctionId, event: EventId, view: &mut HookContext<'_>) -> bool {
        let bound = &self.bound;
        let value = bound.value(event);
        let tables = bound.tables();
        let outcome: Result<Value> = bound.calling(view, || tables.function(function).call(value));
        match outcome {
            Ok(value) => !matches!(value, Value::Nil | Value::Boolean(false)),
            Err(error) => {
                bound.complain("PREDICATE", "error executing predicate: ", &error);
                false
            }
        }
    }

    fn action(&mut self, function: FunctionId, place: ActionPlace, view: &mut HookContext<'_>) {
        let bound = &self.bound;
        let tables = bound.tables();
        let function = tables.function(function);
        let outcome = match place {
            ActionPlace::Entry(state) => {
                bound.calling(view, || function.call::<()>((&bound.fsm, tables.node(state), &bound.words.entry)))
            }
            ActionPlace::Exit(state) => {
                bound.calling(view, || function.call::<()>((&bound.fsm, tables.node(state), &bound.words.exit)))
            }
            ActionPlace::Effect(edge) => bound.events(&self.lua, view).and_then(|events| {
                let words = &bound.words;
                bound.calling(view, || function.call::<()>((&bound.fsm, tables.edge(edge), &words.effect, events)))
            }),
        };
        if let Err(error) = outcome {
            let (tag, text) = match place {
                ActionPlace::Entry(state) => {
                    ("ENTRY", format!("error executing entry of {}: ", tables.chart.fqn(state)))
                }
                ActionPlace::Exit(state) => ("EXIT", format!("error executing exit of {}: ", tables.chart.fqn(state))),
                ActionPlace::Effect(edge) => {
                    ("EFFECT", format!("error executing effect of {}: ", bound.transition_text(edge)))
                }
            };
            bound.complain(tag, &text, &error);
        }
    }

    fn doo_reset(&mut self, _: NodeId) {
        *self.bound.thread.borrow_mut() = None;
    }

    fn doo(&mut self, function: FunctionId, state: NodeId, view: &mut HookContext<'_>) -> Doo {
        match self.resumed(function, state, view) {
            Ok(Doo::Finished) => {
                self.bound.status.borrow_mut().through = true;
                *self.bound.thread.borrow_mut() = None;
                if self.bound.traces.get() {
                    tracing::tell_doo(&self.lua, &self.bound, "is through:", state, view);
                }
                Doo::Finished
            }
            Ok(doo) => doo,
            Err(error) => {
                self.bound.status.borrow_mut().through = true;
                *self.bound.thread.borrow_mut() = None;
                let text = format!("doo program of state '{}' failed: ", view.chart.fqn(state));
                self.bound.complain("DOO", &text, &error);
                Doo::Failed
            }
        }
    }

    fn go_on(&mut self) -> bool {
        let bound = &self.bound;
        if !bound.idle_hook {
            if bound.traces.get() {
                tracing::tell_idle(&self.lua, bound);
            }
            return false;
        }
        let Ok(Value::Function(hook)) = bound.fsm.raw_get("idle_hook") else { return false };
        {
            let mut status = bound.status.borrow_mut();
            (status.waiting, status.room) = (0, limits::CHART_QUEUE);
        }
        match bound.budget.spend(limits::CALL_INSTRUCTIONS, || hook.call::<()>(&bound.fsm)) {
            // Davit does not go on at once but when there is something to go on with; it asks again a little later.
            Ok(()) => !bound.driven.get() || !bound.status.borrow().outbox.is_empty(),
            Err(error) => {
                self.failed(error, "HOOK", "idle_hook");
                false
            }
        }
    }

    fn no_way(&mut self, chart: &Chart, from: NodeId) {
        let kind = if chart.is_state(from) { "state" } else { "connector" };
        self.tell_err(&format!("ERROR: node_find_path invalid starting node{}, type{kind}", chart.fqn(from)));
    }

    fn grown(&mut self, chart: &Chart, queue: &mut Queue) -> Option<Arc<Chart>> {
        let bound = &self.bound;
        if !bound.has_grown.take() {
            return None;
        }
        queue.exchange(|event| bound.known_now(event));
        // A machine that Lua steps is given the chart anew each time.
        bound.driven.get().then(|| Arc::new(bound.tables().chart.clone().placed_as(chart)))
    }

    fn runaway(&mut self, chart: &Chart, connector: NodeId) {
        let text = format!("connectors lead round in a circle at {}: no path is taken", chart.fqn(connector));
        self.bound.voice.say(Printer::Err, &text);
    }
}
