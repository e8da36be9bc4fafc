//! `simulated`: what the components of the simulated platform do by themselves.

use super::{Unit, name, text, time};
use crate::lang::tree::{Cx, Fields, Kind, Node};
use crate::model::{ComponentName, EventName, SimulatedReaction};

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
    let after = after.and_then(|node| Some((text(cx, &node, "`after`", "after: start radio")?, node.origin)));
    let raise = fields.required(cx, "raise", "raise: e_qos_ok");
    let raise = raise.and_then(|node| name::<EventName>(cx, &node, "`raise`", "raise: e_qos_ok"));
    let component = fields.required(cx, "component", "component: radio");
    let component = component.and_then(|node| name::<ComponentName>(cx, &node, "a component", "radio"));
    let delay = fields.take("delay_s").map(|node| time(cx, &node, "`delay_s`", Unit::Seconds, "delay_s: 0.5"));
    fields.finish(cx);
    let (after, at) = after?;
    // One blank between words, as steps are printed.
    let after = after.split_whitespace().collect::<Vec<_>>().join(" ");
    let origin = if cx.sources.is_exact(at) { at } else { origin };
    Some(SimulatedReaction {
        after,
        delay: delay.unwrap_or(Some(std::time::Duration::ZERO))?,
        raise: raise?,
        component: component?,
        origin,
    })
}
