//! Functions of a coordinator: where they stand, and what therefore is not known.

use crate::model::codes::COORD_NOT_PURE;
use crate::model::statechart::{FunctionId, Node, ROOT, State};
use crate::model::{Deployment, Finding, Origin};
use std::collections::BTreeMap;

/// Places shown; the rest is counted.
const SHOWN: usize = 12;

/// Where functions stand.
#[derive(Default)]
struct Places {
    /// The model's own: what it is, which parts of it, and where.
    own: Vec<(String, Vec<&'static str>, Origin)>,
    /// Of each plugin: in how many places nothing but the plugin's stands, and the first of them.
    plugins: BTreeMap<String, (usize, Origin)>,
}

/// One finding that names every state and transition with functions, and the plugins that added some; none for a
/// coordinator without any.
pub fn check(deployment: &Deployment) -> Option<Finding> {
    let of: BTreeMap<FunctionId, &str> =
        deployment.coordinator.plugins.iter().map(|(function, plugin)| (*function, plugin.as_str())).collect();
    let mut places = Places::default();
    places.collect(&deployment.coordinator.root, ROOT, &of);
    let Places { own, plugins } = places;
    let runs_lua = !deployment.programs.is_empty();
    if own.is_empty() && plugins.is_empty() {
        return None;
    }
    let transitions = own.iter().filter(|(what, ..)| what.contains(" → ")).count();
    let named: Vec<String> = plugins.keys().map(|plugin| format!("`{plugin}`")).collect();
    let by = match named.len() {
        0 => String::new(),
        1 => format!("the plugin {}", named[0]),
        _ => format!("the plugins {}", named.join(", ")),
    };
    let mut message = if own.is_empty() {
        format!("the coordinator has no functions of its own, but those of {by}")
    } else {
        format!("the coordinator has functions in {} states and {transitions} transitions", own.len() - transitions)
    };
    if !own.is_empty() && !by.is_empty() {
        message += &format!(", beside those of {by}");
    }
    let mut finding = Finding::info(COORD_NOT_PURE, message + ": what depends on them is not verified")
        .at(deployment.coordinator.root.origin);
    for (what, parts, origin) in own.iter().take(SHOWN) {
        finding = finding.also(*origin, format!("{what}: {} — {}", parts.join(", "), unknown(parts)));
    }
    for (plugin, (count, origin)) in plugins {
        let elsewhere = match count {
            0 | 1 => String::new(),
            2 => ", here and in another place".to_owned(),
            n => format!(", here and in {} other places", n - 1),
        };
        finding = finding.also(origin, format!("added by the plugin `{plugin}`{elsewhere}"));
    }
    let more = own.len().saturating_sub(SHOWN);
    let rest = if more > 0 { format!(" ({more} more places are not shown)") } else { String::new() };
    let how = if runs_lua { "`davit sim` runs them" } else { "they are not run" };
    Some(finding.help(if own.is_empty() {
        format!("without the plugins it is pure; {how}")
    } else {
        format!("names of events in place of functions make it pure; {how}{rest}")
    }))
}

/// What a function at such places keeps from being known.
fn unknown(parts: &[&str]) -> &'static str {
    if parts.iter().any(|part| matches!(*part, "guard" | "events")) {
        "whether it is taken is not known"
    } else {
        "what it does and sends is not known"
    }
}

impl Places {
    fn add(
        &mut self,
        what: impl FnOnce() -> String,
        functions: Vec<(&'static str, FunctionId)>,
        origin: Origin,
        of: &BTreeMap<FunctionId, &str>,
    ) {
        let mut parts: Vec<&'static str> = Vec::new();
        for (part, function) in functions {
            match of.get(&function) {
                Some(plugin) => self.plugins.entry((*plugin).to_owned()).or_insert((0, origin)).0 += 1,
                None if parts.contains(&part) => {}
                None => parts.push(part),
            }
        }
        if !parts.is_empty() {
            self.own.push((what(), parts, origin));
        }
    }

    fn collect(&mut self, state: &State, fqn: &str, of: &BTreeMap<FunctionId, &str>) {
        self.add(|| format!("`{fqn}`"), state.functions(), state.origin, of);
        for transition in &state.transitions {
            let end = |end: &Option<(String, Origin)>| end.as_ref().map_or("?".to_owned(), |(text, _)| text.clone());
            let what = || format!("`{}` → `{}` in `{fqn}`", end(&transition.src), end(&transition.tgt));
            self.add(what, transition.functions(), transition.origin, of);
        }
        for child in &state.children {
            if let Node::State(inner) = child {
                self.collect(inner, &format!("{fqn}.{}", inner.name), of);
            }
        }
    }
}
