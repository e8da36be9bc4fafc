//! `simulated`: what the components of the simulated platform do by themselves; `faults`: what goes wrong on it.

use super::text;
use crate::lang::grammar::{FAULT, REACTION, SIMULATED};
use crate::lang::tree::{Cx, Fields, Kind, Node};
use crate::model::{FaultKind, Origin, SimulatedReaction, StepFault};

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
    let raise = fields.name(cx, "raise");
    let component = fields.name(cx, "component");
    let delay = fields.written(cx, "delay_s", Fields::time);
    fields.finish(cx);
    // What is wrong may be in any of its keys.
    let (after, _) = after?;
    Some(SimulatedReaction {
        after,
        delay: delay.unwrap_or(Some(std::time::Duration::ZERO))?,
        raise: raise?,
        component: component?,
        origin,
    })
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
    let how = fields.choice(cx, "how", FaultKind::WORDS);
    let times = fields.written(cx, "times", Fields::whole);
    let takes = match (how, fields.has("takes_s")) {
        (Some(how), true) if how != FaultKind::Slow => {
            if let Some(node) = fields.take(cx, "takes_s") {
                cx.wrong(&node, "`takes_s`", "nothing: only `slow` takes time", "how: slow, takes_s: 0.5");
            }
            None
        }
        (Some(FaultKind::Slow), false) => {
            fields.needed(cx, "takes_s", |_, _| "add `takes_s: 0.5`".to_owned()).and(None)
        }
        (_, written) => {
            let takes = fields.time(cx, "takes_s");
            if written { takes } else { Some(std::time::Duration::ZERO) }
        }
    };
    fields.finish(cx);
    let times = times.unwrap_or(Some(1)).and_then(|n| u32::try_from(n).ok());
    let (step, origin) = step?;
    Some(StepFault { step, how: how?, times: times?, takes: takes?, origin })
}
