//! `simulated`: what the components of the simulated platform do by themselves; `faults`: what goes wrong on it.

use super::text;
use crate::lang::bound;
use crate::lang::grammar::{FAULT, REACTION, SIMULATED};
use crate::lang::tree::{Cx, Fields, Kind, Node};
use crate::model::{ComponentName, EventName, FaultKind, Finding, Origin, SimulatedReaction, StepFault, codes};
use std::time::Duration;

/// Lowers the key `simulated`.
pub fn reactions(cx: &mut Cx, node: Node) -> Vec<SimulatedReaction> {
    let Some(mut fields) = Fields::of(cx, node, &SIMULATED) else { return Vec::new() };
    let list = match fields.take(cx, "reactions") {
        Some(Node { kind: Kind::List(list), .. }) => list,
        Some(node) => {
            cx.wrong(&node, "`reactions`", "a list", SIMULATED.example);
            Vec::new()
        }
        None => Vec::new(),
    };
    fields.finish(cx);
    list.into_iter().filter_map(|node| reaction(cx, node)).collect()
}

fn reaction(cx: &mut Cx, node: Node) -> Option<SimulatedReaction> {
    let origin = node.origin;
    let mut fields = Fields::of(cx, node, &REACTION)?;
    let after = step(cx, &mut fields, origin, "after");
    // Both names are required, so that none of these is ever one.
    let (raise, component) = (EventName::new("unnamed").ok()?, ComponentName::new("unnamed").ok()?);
    let mut reaction = SimulatedReaction { after: String::new(), delay: Duration::ZERO, raise, component, origin };
    let is_whole = bound::REACTION.read(&mut reaction, &mut fields, cx);
    fields.finish(cx);
    // What is wrong may be in any of its keys.
    let (after, _) = after?;
    is_whole.then_some(SimulatedReaction { after, ..reaction })
}

/// The text of a step with its place; without one of its own, that of what it stands in.
fn step(cx: &mut Cx, fields: &mut Fields, around: Origin, key: &'static str) -> Option<(String, Origin)> {
    let node = fields.take(cx, key)?;
    let step = text(cx, &node, &format!("`{key}`"), fields.row(key).example)?;
    // One blank between words, as steps are printed.
    let step = step.split_whitespace().collect::<Vec<_>>().join(" ");
    Some((step, if cx.sources.is_exact(node.origin) { node.origin } else { around }))
}

/// Lowers the key `faults`.
pub fn faults(cx: &mut Cx, node: Node) -> Vec<StepFault> {
    let Kind::List(list) = node.kind else {
        cx.wrong(&node, "`faults`", "a list", "faults: [{ step: \"property_set a.k\", how: fail }]");
        return Vec::new();
    };
    list.into_iter().filter_map(|node| fault(cx, node)).collect()
}

fn fault(cx: &mut Cx, node: Node) -> Option<StepFault> {
    let origin = node.origin;
    let mut fields = Fields::of(cx, node, &FAULT)?;
    let step = self::step(cx, &mut fields, origin, "step");
    let takes = fields.has("takes_s").then(|| fields.value_place("takes_s").unwrap_or(origin));
    let mut fault = StepFault { step: String::new(), how: FaultKind::Fail, times: 1, takes: Duration::ZERO, origin };
    let is_whole = bound::FAULT.read(&mut fault, &mut fields, cx);
    let is_slow = fault.how == FaultKind::Slow;
    match takes {
        Some(place) if is_whole && !is_slow => {
            let message = format!("`takes_s` stands beside `how: {}`: only `slow` takes time", fault.how);
            let finding = Finding::error(codes::TEXT_WRONG_TYPE, message).at(place);
            cx.report(finding.help("write `how: slow`, or leave `takes_s` out"));
        }
        None if is_slow => _ = fields.needed(cx, "takes_s", |_, _| "add `takes_s: 0.5`".to_owned()),
        _ => {}
    }
    fields.finish(cx);
    let (step, origin) = step?;
    is_whole.then_some(StepFault { step, origin, ..fault })
}
