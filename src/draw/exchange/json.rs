//! A coordinator in the form of rFSM's `rfsm2json`, version 2: the graph as `model2tab` gives it, but each transition under the state that it leads
//! from and not in whose table it is written; and where it stands.

use crate::draw::text::raised;
use crate::model::Statechart;
use crate::model::outline::Outline;
use crate::model::statechart::{INITIAL, Trigger};
use serde_json::{Value, json};

/// The JSON object, one line. `active` are the active states from the root to the leaf; empty: not known, or not entered.
///
/// Beside rFSM's keys: `entry`, `exit`, `config` and `effect` with the names that are raised, where there are any. A
/// transition stands with the node that it leaves, its ends by their full names; a target that is a composite state is its
/// initial connector, as rFSM's `init` makes it.
pub fn coordinator_json(chart: &Statechart, active: &[String]) -> String {
    let outline = Outline::of(chart);
    let leaf = active.last();
    let value = json!({
        "version": 2,
        "graph": node(&outline, 0),
        "active_leaf": leaf.map_or(Value::Bool(false), |leaf| Value::String(leaf.clone())),
        "active_leaf_state": leaf.map(|leaf| mode(&outline, leaf)),
    });
    value.to_string()
}

/// A leaf with nothing to do is done as soon as it is entered. One with a `doo` is active as long as that runs, which is not
/// known here.
fn mode(outline: &Outline<'_>, leaf: &str) -> &'static str {
    let state = outline.items.iter().find(|item| item.fqn == *leaf).and_then(|item| item.state);
    if state.is_some_and(|state| state.doo.is_none()) { "done" } else { "active" }
}

fn node(outline: &Outline<'_>, at: usize) -> Value {
    let item = &outline.items[at];
    let fqn = |at: usize| outline.items[at].fqn.clone();
    let target = |at: usize| {
        let initial = if outline.is_composite(at) { outline.child(at, INITIAL) } else { None };
        fqn(initial.unwrap_or(at))
    };
    let transitions: Vec<Value> = outline
        .links
        .iter()
        .filter(|link| link.src == at)
        .map(|link| {
            // By their whole names, as `init` writes them out.
            let src = fqn(link.src);
            let whole = |trigger: &Trigger| match trigger {
                Trigger::Event(name) if name.as_str() == "e_done" => format!("e_done@{src}"),
                Trigger::Timed(timed) => timed.event_of(&src),
                other => other.to_string(),
            };
            let events: Vec<String> = link.transition.events.iter().map(|(t, _)| whole(t)).collect();
            let mut value = json!({
                "type": "transition",
                "src": fqn(link.src),
                "tgt": target(link.tgt),
                "pn": link.transition.pn,
                "events": events,
            });
            if !link.transition.effect.is_empty() {
                value["effect"] = json!(raised(&link.transition.effect));
            }
            value
        })
        .collect();
    let subnodes: Vec<Value> = outline.children(at).map(|child| node(outline, child)).collect();
    let mut value = json!({
        "id": item.name,
        "type": if item.state.is_some() { "state" } else { "connector" },
        "transitions": transitions,
        "subnodes": subnodes,
    });
    if let Some(state) = item.state {
        for (key, actions) in [("entry", &state.entry), ("exit", &state.exit)] {
            if !actions.is_empty() {
                value[key] = json!(raised(actions));
            }
        }
        if !state.config.is_empty() {
            value["config"] = json!(state.config.iter().map(|(id, _)| id.as_str()).collect::<Vec<_>>());
        }
    }
    value
}

#[cfg(test)]
mod tests {
    use super::super::tests::sample;
    use super::*;

    #[test]
    fn the_graph_and_where_it_stands() {
        let text = coordinator_json(&sample(), &["root".into(), "root.idle".into()]);
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!((&value["version"], &value["active_leaf"]), (&json!(2), &json!("root.idle")));
        assert_eq!(value["active_leaf_state"], "done", "it has nothing to do");
        let nodes = value["graph"]["subnodes"].as_array().unwrap();
        let of = |name: &str| nodes.iter().find(|n| n["id"] == name).unwrap_or_else(|| panic!("{name} in {text}"));
        assert_eq!(of("fork")["type"], "connector");
        assert_eq!(of("fork")["transitions"][0]["tgt"], "root.on.initial");
        assert_eq!(of("idle")["transitions"][0]["pn"], 2.0);
        assert_eq!(of("idle")["transitions"][0]["effect"], json!(["e_gone"]));
        let low =
            &of("on")["subnodes"].as_array().unwrap().iter().find(|n| n["id"] == "low").unwrap()["transitions"][0];
        assert_eq!(low["events"], json!(["e_done@root.on.low", "e_after(1)@root.on.low"]));
        assert_eq!(of("on")["config"], json!(["power"]));
        assert_eq!(of("on")["subnodes"][0]["entry"], json!(["e_low"]));
        let unknown: Value = serde_json::from_str(&coordinator_json(&sample(), &[])).unwrap();
        assert_eq!((&unknown["active_leaf"], &unknown["active_leaf_state"]), (&json!(false), &Value::Null));
    }
}
