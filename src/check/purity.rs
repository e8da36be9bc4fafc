//! Functions of a coordinator: where they stand, and what therefore is not known.

use crate::model::codes::COORD_NOT_PURE;
use crate::model::finding::count;
use crate::model::functions::function_places;
use crate::model::{Deployment, Finding, Origin};
use std::collections::BTreeMap;

/// Places shown; the rest is counted.
const SHOWN: usize = 12;

/// A plugin that only tells: nothing depends on it.
const TELLS: &str = "checkevents";

/// One finding that names every state and transition with functions, and the plugins that added some; none for a
/// coordinator without any.
pub fn check(deployment: &Deployment) -> Option<Finding> {
    let coordinator = deployment.first_coordinator();
    let program = deployment.programs.get(&coordinator.name);
    let beside = program.map_or(&[][..], |program| &program.beside);
    let places = function_places(&coordinator.chart, beside);
    // Of each plugin: in how many places it put a function, and the first of them.
    let mut plugins: BTreeMap<&str, (usize, Origin)> = BTreeMap::new();
    for place in &places {
        for (part, plugin) in &place.parts {
            if let Some(plugin) = plugin.as_deref().filter(|plugin| *plugin != TELLS) {
                // A step hook stands nowhere in the text.
                plugins.entry(plugin).or_insert((0, place.origin)).0 += usize::from(!part.ends_with("_hook"));
            }
        }
    }
    let own: Vec<_> = places.iter().filter(|place| !place.own().is_empty()).collect();
    if own.is_empty() && plugins.is_empty() {
        return None;
    }
    let transitions = own.iter().filter(|place| place.is_transition()).count();
    let named: Vec<String> = plugins.keys().map(|plugin| format!("`{plugin}`")).collect();
    let by = match named.len() {
        0 => String::new(),
        1 => format!("the plugin {}", named[0]),
        _ => format!("the plugins {}", named.join(", ")),
    };
    let mut message = if own.is_empty() {
        format!("the coordinator has no functions of its own, but those of {by}")
    } else {
        let (states, transitions) = (count(own.len() - transitions, "state"), count(transitions, "transition"));
        format!("the coordinator has functions in {states} and {transitions}")
    };
    if !own.is_empty() && !by.is_empty() {
        message += &format!(", beside those of {by}");
    }
    let mut finding = Finding::info(COORD_NOT_PURE, message + ": what depends on them is not verified")
        .at(coordinator.chart.root.origin);
    for place in own.iter().take(SHOWN) {
        let parts = place.own();
        finding = finding.also(place.origin, format!("{}: {} — {}", place.what, parts.join(", "), unknown(&parts)));
    }
    for (plugin, (places, origin)) in plugins {
        let elsewhere = match places {
            0 | 1 => String::new(),
            2 => ", here and in another place".to_owned(),
            n => format!(", here and in {} other places", n - 1),
        };
        finding = finding.also(origin, format!("added by the plugin `{plugin}`{elsewhere}"));
    }
    let more = own.len().saturating_sub(SHOWN);
    let rest = if more > 0 { format!(" ({} not shown)", count(more, "more place")) } else { String::new() };
    let how = if deployment.programs.is_empty() { "they are not run" } else { "`davit sim` runs them" };
    Some(finding.help(if own.is_empty() {
        format!("without the plugins it is pure; {how}")
    } else {
        format!("names of events in place of functions make it pure; {how}{rest}")
    }))
}

/// What functions at such places keep from being known.
fn unknown(parts: &[&str]) -> &'static str {
    let any = |keys: &[&str]| parts.iter().any(|part| keys.contains(part));
    if any(&["getevents", "pre_step_hook"]) {
        "which events come is not known"
    } else if any(&["guard", "events"]) {
        "whether it is taken is not known"
    } else {
        "what it does and sends is not known"
    }
}
