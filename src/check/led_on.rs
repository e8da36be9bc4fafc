//! An emergency never leads on by itself: what is safe is in force until somebody says that it is over.
//!
//! A state that takes a safe configuration back when it is left must not be left by what comes without anybody: by that configuration's own
//! answers, by time, or by whatever comes first. What was done of the emergency would be undone unasked, at the latest when part of it
//! failed.

use super::coordinator::{ask_of, edges, place};
use crate::model::codes::COORD_SAFE_LEFT;
use crate::model::{Ask, ConfigId, Deployment, EventName, Finding, Findings, Verdict};
use crate::statechart::{Chart, EdgeId, EventId, NodeId, NodeKind, RaiseMoment};
use rustc_hash::FxHashSet;

/// Transitions by which a state is left unasked that takes something safe back.
pub fn check(deployment: &Deployment, chart: &Chart) -> Findings {
    let is_safe = |id: ConfigId| deployment.configuration(id).is_some_and(|of| of.safe);
    let asks = |node: NodeId| {
        let asked = chart.raises().iter().filter(|site| site.when == RaiseMoment::Entry(node));
        let mut ids = asked.filter_map(|site| match ask_of(deployment, site.name) {
            Some(Ask::Apply(id)) => Some(id),
            _ => None,
        });
        ids.any(is_safe)
    };
    let mut findings = Vec::new();
    for site in chart.raises() {
        let (RaiseMoment::Exit(state), Some(Ask::UndoOf(id))) = (site.when, ask_of(deployment, site.name)) else {
            continue;
        };
        if !is_safe(id) {
            continue;
        }
        let leaves = |edge: &EdgeId| {
            chart.is_inside(chart.ends(*edge).0, state) && !chart.is_inside(chart.least_common_ancestor(*edge), state)
        };
        for edge in edges(chart).filter(leaves) {
            let Some(by) = unasked(chart, edge, id) else { continue };
            if !ways_end_safe(chart, edge, &asks) {
                let (_, target) = chart.ends(edge);
                let message = format!(
                    "{by} leads from `{}` to `{}`, which takes `{id}` back: nobody said that the emergency is over",
                    chart.fqn(state),
                    chart.fqn(target)
                );
                findings.push(
                    Finding::warning(COORD_SAFE_LEFT, message)
                        .at(chart.edge_origin(edge))
                        .also(site.origin, "taken back by what is written here")
                        .path(place(chart, RaiseMoment::Effect(edge)))
                        .help(format!(
                            "let an event of people lead on (`e_reset`), and hear `{id}.failed` and `{id}.broken` between two states inside of `{}`",
                            chart.fqn(state)
                        )),
                );
            }
        }
    }
    findings
}

/// What takes that transition without anybody having said so, in words.
fn unasked(chart: &Chart, edge: EdgeId, id: ConfigId) -> Option<String> {
    let Some(triggers) = chart.triggers(edge) else { return Some("whatever comes next".to_owned()) };
    let ask = Ask::Apply(id);
    let own: Vec<EventName> = [Verdict::Ok, ask.failed(), ask.broken()].map(|of| of.event(ask)).into();
    let by = |event: &&EventId| chart.time_of(**event).is_some() || own.iter().any(|own| chart.event(*own) == **event);
    triggers.iter().find(by).map(|event| format!("`{}`", chart.event_text(*event)))
}

/// Whether all that the transition enters asks for something safe on its way in.
fn ways_end_safe(chart: &Chart, edge: EdgeId, asks: &dyn Fn(NodeId) -> bool) -> bool {
    let mut seen: FxHashSet<EdgeId> = FxHashSet::default();
    let mut open = vec![edge];
    while let Some(edge) = open.pop() {
        if !seen.insert(edge) {
            continue;
        }
        let (_, target) = chart.ends(edge);
        let stays = chart.least_common_ancestor(edge);
        let mut entered =
            std::iter::successors(Some(target), |node| chart.parent(*node)).take_while(|node| *node != stays);
        if entered.any(asks) {
            continue;
        }
        match chart.kind(target) {
            // The way into a composite state is one to its connector `initial`.
            NodeKind::Leaf | NodeKind::Composite => return false,
            NodeKind::Connector => open.extend(chart.outgoing(target)),
        }
    }
    true
}
