//! An emergency never leads on by itself: what is safe is in force until somebody says that it is over.
//!
//! A state that takes a safe configuration back when it is left must not be left by what comes without anybody: by that configuration's own
//! answers, by time, or by whatever comes first; nor, from where it is entered, by anything else that comes by itself. What was done of the emergency would be undone unasked, at the latest when part of it
//! failed.

use super::by_itself::{by, ways_on};
use super::coordinator::{ask_of, edges, place};
use super::taken::{Taken, enters, raised_by};
use crate::model::codes::COORD_SAFE_LEFT;
use crate::model::{Ask, ConfigId, Deployment, EventName, Finding, Findings, Origin, Verdict};
use crate::statechart::{Chart, EdgeId, EventId, NodeId, NodeKind, RaiseMoment, RaiseSite};
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;

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
    let known: FxHashSet<Origin> = findings.iter().map(|finding| finding.origin).collect();
    findings.extend(let_go_later(deployment, chart).into_iter().filter(|finding| !known.contains(&finding.origin)));
    findings
}

/// Transitions that come by themselves after an event of safety, one after another, and let go of what that has made safe, though no state holds it: by its
/// name, or since what is asked for takes its place in its group.
fn let_go_later(deployment: &Deployment, chart: &Chart) -> Findings {
    let is_safe = |id: ConfigId| deployment.configuration(id).is_some_and(|of| of.safe);
    let safety: Vec<EventId> = deployment.safety.iter().map(|(event, _)| chart.event(*event)).collect();
    let stops = edges(chart).filter(|edge| {
        chart.triggers(*edge).is_some_and(|all| all.iter().any(|of| *of != EventId::OTHER && safety.contains(of)))
    });
    let mut made_safe: BTreeMap<ConfigId, FxHashSet<NodeId>> = BTreeMap::new();
    for edge in stops {
        let asks = raised_by(chart, edge).filter_map(|site| ask_of(deployment, site.name));
        for id in
            asks.filter_map(|ask| if let Ask::Apply(id) = ask { Some(id).filter(|id| is_safe(*id)) } else { None })
        {
            made_safe.entry(id).or_default().extend(Taken::of(chart, edge).entered);
        }
    }
    let mut findings = Findings::new();
    for (id, mut reached) in made_safe {
        let mut open: Vec<(EdgeId, String)> =
            edges(chart).filter_map(|edge| Some((edge, by(deployment, chart, edge)?))).collect();
        let leaves = |reached: &FxHashSet<NodeId>, edge: EdgeId| {
            let source = chart.ends(edge).0;
            reached.iter().any(|node| chart.is_inside(*node, source))
        };
        while let Some(at) = open.iter().position(|(edge, _)| leaves(&reached, *edge)) {
            let (edge, by) = open.swap_remove(at);
            let Some(how) = lets_go(deployment, chart, edge, id) else {
                reached.extend(Taken::of(chart, edge).entered);
                continue;
            };
            let (source, target) = chart.ends(edge);
            let message = format!(
                "{by} leads from `{}` to `{}`, and {how}: nobody said that the emergency is over",
                chart.fqn(source),
                chart.fqn(target)
            );
            let finding = Finding::warning(COORD_SAFE_LEFT, message).at(chart.edge_origin(edge));
            findings.push(finding.path(place(chart, RaiseMoment::Effect(edge))).help(format!(
                "let an event of people lead on (`e_reset`) from where `{id}` is asked for to where that is done"
            )));
        }
    }
    findings
}

/// How a transition lets go of something safe that no state holds, in words; one that asks for something safe again does not.
fn lets_go(deployment: &Deployment, chart: &Chart, edge: EdgeId, id: ConfigId) -> Option<String> {
    let of = |id: ConfigId| deployment.configuration(id);
    let sites = raised_by(chart, edge).filter(|site| !matches!(site.when, RaiseMoment::Exit(_)));
    let asks: Vec<Ask> = sites.filter_map(|site| ask_of(deployment, site.name)).collect();
    let asks_anew = |ask: &Ask| matches!(ask, Ask::Apply(id) if of(*id).is_some_and(|of| of.safe));
    if asks.iter().any(asks_anew) {
        return None;
    }
    let group = of(id)?.group;
    // Of several another one may be in force still.
    let alone = deployment.configurations.iter().filter(|of| of.safe).count() == 1;
    asks.into_iter().find_map(|ask| match ask {
        Ask::UndoOf(undone) if undone == id && alone => Some(format!("`{ask}` lets go of `{id}`")),
        Ask::Undo if alone => Some(format!("`{ask}` lets go of what was applied last, `{id}` perhaps")),
        Ask::Apply(other) if group.is_some() && of(other)?.group == group => {
            Some(format!("`{other}` takes the place of `{id}` there, which is of its group"))
        }
        _ => None,
    })
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
