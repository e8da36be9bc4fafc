//! An emergency never leads on by itself: what is safe is in force until somebody says that it is over.
//!
//! A state that takes a safe configuration back when it is left must not be left by what comes without anybody: by that configuration's own
//! answers, by time, or by whatever comes first; nor, from where it is entered, by anything else that comes by itself. What was done of the emergency would be undone unasked, at the latest when part of it
//! failed.

use super::by_itself::ways_on;
use super::coordinator::{ask_of, edges, place};
use super::taken::enters;
use crate::model::codes::COORD_SAFE_LEFT;
use crate::model::{Ask, ConfigId, Deployment, EventName, Finding, Findings, Origin, Verdict};
use crate::statechart::{Chart, EdgeId, EventId, NodeId, NodeKind, RaiseMoment, RaiseSite};
use rustc_hash::FxHashSet;

/// A state that takes something safe back when it is left.
pub struct HeldSafe {
    /// The state.
    state: NodeId,
    /// What is safe.
    id: ConfigId,
    /// Where that is written.
    at: Origin,
}

/// Those of a coordinator.
pub fn held(deployment: &Deployment, chart: &Chart) -> Vec<HeldSafe> {
    let is_safe = |id: ConfigId| deployment.configuration(id).is_some_and(|of| of.safe);
    let left = |site: &RaiseSite| match (site.when, ask_of(deployment, site.name)) {
        (RaiseMoment::Exit(state), Some(Ask::UndoOf(id))) if is_safe(id) => {
            Some(HeldSafe { state, id, at: site.origin })
        }
        _ => None,
    };
    chart.raises().iter().filter_map(left).collect()
}

impl HeldSafe {
    /// Whether a transition leaves it, to where nothing safe is asked for.
    pub fn is_left_by(&self, deployment: &Deployment, chart: &Chart, edge: EdgeId) -> bool {
        let asks = |node: NodeId| {
            let asked = chart.raises().iter().filter(|site| site.when == RaiseMoment::Entry(node));
            let mut asked = asked.filter_map(|site| ask_of(deployment, site.name));
            asked.any(|ask| matches!(ask, Ask::Apply(id) if deployment.configuration(id).is_some_and(|of| of.safe)))
        };
        chart.is_inside(chart.ends(edge).0, self.state)
            && !chart.is_inside(chart.least_common_ancestor(edge), self.state)
            && !ways_end_safe(chart, edge, &asks)
    }
}

/// Transitions by which a state is left unasked that takes a safe configuration back.
pub fn check(deployment: &Deployment, chart: &Chart) -> Findings {
    let mut findings = Findings::new();
    for held in held(deployment, chart) {
        let HeldSafe { state, id, at } = held;
        let ways_on = ways_on(deployment, chart, state);
        for edge in edges(chart).filter(|edge| held.is_left_by(deployment, chart, *edge)) {
            let leads_on = || ways_on.iter().find(|(way, _)| *way == edge).map(|(_, by)| by.clone());
            let Some(by) = unasked(chart, edge, id).or_else(leads_on) else { continue };
            let (_, target) = chart.ends(edge);
            let message = format!(
                "{by} leads from `{}` to `{}`, which takes `{id}` back: nobody said that the emergency is over",
                chart.fqn(state),
                chart.fqn(target)
            );
            findings.push(
                Finding::warning(COORD_SAFE_LEFT, message)
                    .at(chart.edge_origin(edge))
                    .also(at, "taken back by what is written here")
                    .path(place(chart, RaiseMoment::Effect(edge)))
                    .help(format!(
                        "let an event of people lead on (`e_reset`), and hear `{id}.failed` and `{id}.broken` between two states inside of `{}`",
                        chart.fqn(state)
                    )),
            );
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
        if enters(chart, edge).any(asks) {
            continue;
        }
        let target = chart.ends(edge).1;
        match chart.kind(target) {
            // The way into a composite state is one to its connector `initial`.
            NodeKind::Leaf | NodeKind::Composite => return false,
            NodeKind::Connector => open.extend(chart.outgoing(target)),
        }
    }
    true
}
