//! Functions of a coordinator: where they stand, and what therefore is not known.

use crate::model::codes::COORD_NOT_PURE;
use crate::model::statechart::{Node, ROOT, State};
use crate::model::{Deployment, Finding, Origin};

/// Places shown; the rest is counted.
const SHOWN: usize = 12;

/// One finding that names every state and transition with functions; none for a coordinator without any.
pub fn check(deployment: &Deployment) -> Option<Finding> {
    let mut places = Vec::new();
    collect(&deployment.coordinator.root, ROOT, &mut places);
    let runs_lua = !deployment.programs.is_empty();
    if places.is_empty() {
        return None;
    }
    let transitions = places.iter().filter(|(what, ..)| what.contains(" → ")).count();
    let message = format!(
        "the coordinator has functions in {} states and {transitions} transitions: what depends on them is not verified",
        places.len() - transitions
    );
    let mut finding = Finding::info(COORD_NOT_PURE, message).at(deployment.coordinator.root.origin);
    for (what, parts, origin) in places.iter().take(SHOWN) {
        finding = finding.also(*origin, format!("{what}: {} — {}", parts.join(", "), unknown(parts)));
    }
    let more = places.len().saturating_sub(SHOWN);
    let rest = if more > 0 { format!(" ({more} more places are not shown)") } else { String::new() };
    let how = if runs_lua { "`davit sim` runs them" } else { "they are not run" };
    Some(finding.help(format!("names of events in place of functions make it pure; {how}{rest}")))
}

/// What a function at such places keeps from being known.
fn unknown(parts: &[&str]) -> &'static str {
    if parts.iter().any(|part| matches!(*part, "guard" | "events")) {
        "whether it is taken is not known"
    } else {
        "what it does and sends is not known"
    }
}

fn collect<'a>(state: &'a State, fqn: &str, out: &mut Vec<(String, Vec<&'a str>, Origin)>) {
    let own = state.functions();
    if !own.is_empty() {
        out.push((format!("`{fqn}`"), own, state.origin));
    }
    for transition in &state.transitions {
        let parts = transition.functions();
        if !parts.is_empty() {
            let end = |end: &Option<(String, Origin)>| end.as_ref().map_or("?".to_owned(), |(text, _)| text.clone());
            let what = format!("`{}` → `{}` in `{fqn}`", end(&transition.src), end(&transition.tgt));
            out.push((what, parts, transition.origin));
        }
    }
    for child in &state.children {
        if let Node::State(inner) = child {
            collect(inner, &format!("{fqn}.{}", inner.name), out);
        }
    }
}
