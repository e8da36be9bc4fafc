//! What a model adds to a machine that runs (`docs/rfsm.md` §8, `fsm_merge`).
//!
//! The Lua part has put the tables in their places and asks here for the chart. Questions are answered by the chart as it
//! is from then on; a step that is under way goes on with the one it began with.

use super::bound::BoundMachine;
use super::lower::{self, Lowered};
use crate::model::{EventName, Origin};
use crate::statechart::{Addition, Chart, EventId, NodeId};
use mlua::{Function, Lua, Result, Table, Value};
use std::rc::Rc;

/// Adds `object` to the machine, as a child of `parent` if it has a name; answers what keeps it from that.
pub fn merge(
    lua: &Lua,
    native: &Table,
    bound: &BoundMachine,
    (parent, object): (NodeId, &Table),
    name: Option<&str>,
) -> Result<Option<String>> {
    if bound.tables().node_of(object).is_some() || bound.tables().edge_of(object).is_some() {
        return Ok(Some("it is in this machine already".to_owned()));
    }
    let what = if name.is_some() { kind(native, object)? } else { "transition".to_owned() };
    // Read as the only thing in an empty root.
    let list = lua.create_table()?;
    let row = |what: &str, scope: usize, table: &Table, name: Option<&str>| -> Result<()> {
        let row = lua.create_table_from([("what", what)])?;
        row.raw_set("scope", scope)?;
        row.raw_set("table", table)?;
        row.raw_set("name", name)?;
        list.raw_push(row)
    };
    row("state", 0, &lua.create_table()?, Some("root"))?;
    row(&what, 1, object, name)?;
    let Lowered { mut chart, functions, values, problems, .. } =
        lower::lower(&list, native, &mut |_, _, _| Origin::NONE)?.within(bound.tables().path);
    if !problems.is_empty() {
        let all: Vec<String> = problems.into_iter().map(|problem| problem.message).collect();
        return Ok(Some(all.join("; ")));
    }
    let mut tables = bound.tables.borrow_mut();
    let tables = Rc::make_mut(&mut tables);
    let before = u32::try_from(tables.functions()).unwrap_or(u32::MAX);
    let added = if let (Some(_), Some(node)) = (name, chart.root.children.pop()) {
        match tables.chart.add_node(parent, Addition { what: &node, functions: before }) {
            Ok(id) => tables.push_node(lua, id, Value::Table(object.clone())).map(|()| None)?,
            Err(why) => Some(why.to_string()),
        }
    } else if let Some(transition) = chart.root.transitions.pop() {
        let end = |key: &str| -> Result<Option<NodeId>> {
            let Value::Table(node) = object.raw_get::<Value>(key)? else { return Ok(None) };
            Ok(tables.node_of(&node))
        };
        let (Some(src), Some(tgt)) = (end("src")?, end("tgt")?) else {
            return Ok(Some("its src or its tgt is no state or connector of this machine".to_owned()));
        };
        // Events that are no texts were named without regard to those that are there.
        let mut odd: Vec<(Value, EventName, Option<EventName>)> = Vec::new();
        for (value, name) in values {
            let known = tables.event(&value).and_then(|event| tables.chart.events().get(event.listed()?).copied());
            odd.push((value, name, known));
        }
        let mut event = |chart: &mut Chart, name: EventName| {
            let name = match odd.iter_mut().find(|(_, n, _)| *n == name) {
                Some((_, _, known)) => *known.get_or_insert_with(|| unused(chart)),
                None => name,
            };
            chart.add_event(name)
        };
        match tables.chart.add_edge((src, tgt), Addition { what: &transition, functions: before }, &mut event) {
            Ok(places) => {
                for (edge, was) in places {
                    let table = was.map_or_else(|| Value::Table(object.clone()), |was| tables.edge(was).clone());
                    if let Value::Table(table) = table {
                        tables.put_edge(edge, table);
                    }
                }
                let odd: Vec<_> = odd.into_iter().filter_map(|(value, _, name)| Some((value, name?))).collect();
                tables.take_events(lua, &odd).map(|()| None)?
            }
            Err(why) => Some(why.to_string()),
        }
    } else {
        Some("it is neither a state, nor a connector, nor a transition".to_owned())
    };
    if added.is_none() {
        tables.add_functions(functions);
    }
    Ok(added)
}

/// A name for an event that is no text, which no other has.
fn unused(chart: &Chart) -> EventName {
    let mut number = chart.events().len();
    loop {
        let name = EventName::new(&format!("value#{number}")).expect("no blanks");
        if chart.event(name) == EventId::OTHER {
            return name;
        }
        number += 1;
    }
}

/// What a table is, as a model says it.
fn kind(native: &Table, object: &Table) -> Result<String> {
    let kind: Function = native.raw_get("kind")?;
    Ok(kind.call::<Option<String>>(object)?.unwrap_or_default())
}
