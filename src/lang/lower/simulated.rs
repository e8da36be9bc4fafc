//! `simulated`: what the components of the simulated platform do by themselves; `faults`: what goes wrong on it.

use super::{Unit, choice, name, text, time, whole};
use crate::lang::tree::{Cx, Fields, Kind, Node};
use crate::limits;
use crate::model::{ComponentName, EventName, FaultKind, Origin, SimulatedReaction, StepFault};

const EXAMPLE: &str =
    "simulated: { reactions: [{ after: start radio, delay_s: 0.5, raise: e_qos_ok, component: radio }] }";
const REACTION: &str = "{ after: start radio, delay_s: 0.5, raise: e_qos_ok, component: radio }";

/// Lowers the key `simulated`.
pub fn reactions(cx: &mut Cx, node: Node) -> Vec<SimulatedReaction> {
    let Some(mut fields) = Fields::of(cx, node, "`simulated`", EXAMPLE) else { return Vec::new() };
    let list = match fields.take("reactions") {
        Some(Node { kind: Kind::List(list), .. }) => list,
        Some(node) => {
            cx.wrong(&node, "`reactions`", "a list", EXAMPLE);
            Vec::new()
        }
        None => Vec::new(),
    };
    fields.finish(cx);
    list.into_iter().filter_map(|node| reaction(cx, node)).collect()
}

fn reaction(cx: &mut Cx, node: Node) -> Option<SimulatedReaction> {
    let origin = node.origin;
    let mut fields = Fields::of(cx, node, "a reaction", REACTION)?;
    let after = fields.required(cx, "after", "after: start radio");
    let after = after.and_then(|node| step(cx, node, origin, "`after`", "after: start radio"));
    let raise = fields.required(cx, "raise", "raise: e_qos_ok");
    let raise = raise.and_then(|node| name::<EventName>(cx, &node, "`raise`", "raise: e_qos_ok"));
    let component = fields.required(cx, "component", "component: radio");
    let component = component.and_then(|node| name::<ComponentName>(cx, &node, "a component", "radio"));
    let delay = fields.take("delay_s").map(|node| time(cx, &node, "`delay_s`", Unit::Seconds, "delay_s: 0.5"));
    fields.finish(cx);
    let (after, origin) = after?;
    Some(SimulatedReaction {
        after,
        delay: delay.unwrap_or(Some(std::time::Duration::ZERO))?,
        raise: raise?,
        component: component?,
        origin,
    })
}

/// The text of a step with its place; without one of its own, that of what it stands in.
fn step(cx: &mut Cx, node: Node, around: Origin, what: &str, example: &str) -> Option<(String, Origin)> {
    let step = text(cx, &node, what, example)?;
    // One blank between words, as steps are printed.
    let step = step.split_whitespace().collect::<Vec<_>>().join(" ");
    Some((step, if cx.sources.is_exact(node.origin) { node.origin } else { around }))
}

/// Lowers the key `faults`.
pub fn faults(cx: &mut Cx, node: Node) -> Vec<StepFault> {
    const EXAMPLE: &str = "faults: [{ step: \"property_set a.k\", how: fail }]";
    let Kind::List(list) = node.kind else {
        cx.wrong(&node, "`faults`", "a list", EXAMPLE);
        return Vec::new();
    };
    list.into_iter().filter_map(|node| fault(cx, node)).collect()
}

fn fault(cx: &mut Cx, node: Node) -> Option<StepFault> {
    let origin = node.origin;
    let mut fields = Fields::of(cx, node, "a fault", "{ step: \"property_set a.k\", how: fail, times: 1 }")?;
    let step = fields.required(cx, "step", "step: \"property_set a.k\"");
    let step = step.and_then(|node| self::step(cx, node, origin, "`step`", "step: \"property_set a.k\""));
    let how = fields.required(cx, "how", "how: fail");
    let how = how.and_then(|node| choice(cx, &node, "`how`", &FaultKind::NAMES));
    let times =
        fields.take("times").map(|node| whole(cx, &node, "`times`", 1..=i64::from(limits::FAULT_TIMES), "times: 1"));
    let takes = match (how, fields.take("takes_s")) {
        (_, Some(node)) if how.is_some_and(|how| how != FaultKind::Slow) => {
            cx.wrong(&node, "`takes_s`", "nothing: only `slow` takes time", "how: slow, takes_s: 0.5");
            None
        }
        (_, Some(node)) => time(cx, &node, "`takes_s`", Unit::Seconds, "takes_s: 0.5"),
        (Some(FaultKind::Slow), None) => fields.required(cx, "takes_s", "takes_s: 0.5").and(None),
        (_, None) => Some(std::time::Duration::ZERO),
    };
    fields.finish(cx);
    let times = times.unwrap_or(Some(1)).and_then(|n| u32::try_from(n).ok());
    let (step, origin) = step?;
    Some(StepFault { step, how: how?, times: times?, takes: takes?, origin })
}
