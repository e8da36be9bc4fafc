//! The words of a model's own `dbg` printer: rFSM's tags, with the names of what they are about.

use super::bound::BoundMachine;
use crate::limits;
use crate::statechart::{Chart, EventId, HookContext, NodeId, Trace};
use mlua::{Lua, Result, Value};

/// Tells the model's `dbg` what happens. An error of it is told to `err`.
pub fn tell(lua: &Lua, bound: &BoundMachine, what: Trace<'_>, view: &mut HookContext<'_>) {
    let chart = view.chart;
    let fqn = |node: NodeId| chart.fqn(node).to_string();
    let (tag, words) = match what {
        Trace::Searching => {
            let events: Vec<String> = view.events.iter().map(|event| text(bound, chart, *event)).collect();
            ("TRANSITION", vec![format!("looking for transitions for {}", events.join(", "))])
        }
        Trace::NotFound => ("TRANSITION", vec!["none is enabled".to_owned()]),
        Trace::Checking(state) => ("CHECKING", vec!["depth:".to_owned(), chart.depth(state).to_string(), fqn(state)]),
        Trace::Path(edges) => {
            let ends = edges.iter().map(|edge| fqn(chart.ends(*edge).1));
            let start = edges.first().map(|edge| fqn(chart.ends(*edge).0));
            ("EXEC_PATH", vec![start.into_iter().chain(ends).collect::<Vec<_>>().join(" -> ")])
        }
        Trace::Leaving(edge) => {
            let (source, _) = chart.ends(edge);
            let lca = chart.least_common_ancestor(edge);
            let mut top = source;
            while let Some(parent) = chart.parent(top).filter(|parent| *parent != lca) {
                top = parent;
            }
            ("TRANS_EXIT", vec!["up to".to_owned(), fqn(top), "lca:".to_owned(), fqn(lca)])
        }
        Trace::Left(state) => ("STATE_EXIT", vec![fqn(state)]),
        Trace::Effect(edge) => ("EFFECT", vec![bound.transition_text(edge)]),
        Trace::Entering(edge) => {
            let lca = chart.least_common_ancestor(edge);
            ("TRANS_ENTER", vec!["lca:".to_owned(), fqn(lca), "down to".to_owned(), fqn(chart.ends(edge).1)])
        }
        Trace::Entered(state) => ("STATE_ENTER", vec![fqn(state)]),
        Trace::Due(event) => ("TIMEEVENT", vec!["is due:".to_owned(), text(bound, chart, event)]),
        Trace::Raised(event) => ("RAISED", vec![text(bound, chart, event)]),
    };
    let told = bound.calling(view, || call(lua, bound, tag, &words));
    complain(bound, told);
}

/// The same outside of a step, where what it sends waits for the next one.
pub fn tell_idle(lua: &Lua, bound: &BoundMachine) {
    let words = ["nothing to do".to_owned()];
    let told = bound.budget.spend(limits::CALL_INSTRUCTIONS, || call(lua, bound, "HIBERNATING", &words));
    complain(bound, told);
}

/// The same of a `doo`.
pub fn tell_doo(lua: &Lua, bound: &BoundMachine, word: &str, state: NodeId, view: &mut HookContext<'_>) {
    let words = [word.to_owned(), view.chart.fqn(state).to_string()];
    let told = bound.calling(view, || call(lua, bound, "DOO", &words));
    complain(bound, told);
}

fn call(lua: &Lua, bound: &BoundMachine, tag: &str, words: &[String]) -> Result<()> {
    let Value::Function(dbg) = bound.fsm.raw_get("dbg")? else { return Ok(()) };
    let mut arguments = vec![Value::String(lua.create_string(tag)?)];
    for word in words {
        arguments.push(Value::String(lua.create_string(word)?));
    }
    dbg.call(mlua::MultiValue::from_vec(arguments))
}

fn text(bound: &BoundMachine, chart: &Chart, event: EventId) -> String {
    bound.event_text(chart, event)
}

fn complain(bound: &BoundMachine, told: Result<()>) {
    if let Err(error) = told {
        bound.complain("DBG", "error executing dbg: ", &error);
    }
}
