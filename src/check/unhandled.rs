//! Requests whose failure nobody hears: the coordinator would wait for an answer that came already.
//!
//! A transition hears an answer when that event alone can take it all the way: from a state, through connectors, to a leaf.
//! So what stands behind a connector counts with what leads to it, and the way into a composite state, which wants no
//! event, does not hear.

use super::coordinator::{ask_of, bad_answers, edges, place};
use crate::model::codes::COORD_FAILURE_UNHANDLED;
use crate::model::{Ask, Deployment, EventName, Finding, Findings, Verdict};
use crate::statechart::{Chart, EdgeId, EventId, NodeId, NodeKind, RaiseMoment, RaiseSite};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::{BTreeMap, BTreeSet};

/// Requests whose failure no transition waits for that could be there to hear it.
pub fn check(deployment: &Deployment, chart: &Chart) -> Findings {
    let mut findings = Vec::new();
    let mut missing: BTreeMap<EventName, (&RaiseSite, Ask, BTreeSet<EventName>)> = BTreeMap::new();
    let mut hearers: FxHashMap<EventId, Vec<NodeId>> = FxHashMap::default();
    for site in chart.raises() {
        let Some(ask) = ask_of(deployment, site.name) else { continue };
        // Undoing what a state brought with it: nobody waits for that, and the stack keeps the frame.
        if site.scoped && matches!(site.when, RaiseMoment::Exit(_)) {
            continue;
        }
        // A configuration that must be confirmed is undone behind the coordinator's back if it is not. `cancelled` needs
        // nobody: it comes only when the request was taken back, by whoever made it or by an operator.
        let reverted = match ask {
            Ask::Apply(id) => deployment.configuration(id).is_some_and(|c| c.confirm.is_some()),
            _ => false,
        };
        let owner = owner(chart, site.when);
        // It is told in whatever state the coordinator is: where that matters is followed.
        if reverted && chart.event(Verdict::Reverted.event(ask)) == EventId::OTHER {
            let none = missing.entry(site.name).or_insert_with(|| (site, ask, BTreeSet::new()));
            none.2.insert(Verdict::Reverted.event(ask));
        }
        for answer in bad_answers(ask) {
            let event = chart.event(answer);
            let hearers = hearers.entry(event).or_insert_with(|| hearing(chart, event));
            if !hearers.iter().any(|state| chart.is_inside(*state, owner) || chart.is_inside(owner, *state)) {
                missing.entry(site.name).or_insert_with(|| (site, ask, BTreeSet::new())).2.insert(answer);
            }
        }
    }
    for (name, (site, ask, answers)) in missing {
        let failed = [ask.failed(), Verdict::Reverted].iter().any(|verdict| answers.contains(&verdict.event(ask)));
        let list: Vec<String> = answers.iter().map(|a| format!("`{a}`")).collect();
        let message = format!("no transition hears {} of the request raised here", list.join(" or "));
        let finding = if failed {
            Finding::warning(COORD_FAILURE_UNHANDLED, message)
        } else {
            Finding::info(COORD_FAILURE_UNHANDLED, message)
        };
        findings.push(finding.at(site.origin).labelled(format!("asks for {name}")).path(place(chart, site.when)).help(
            match is_held(deployment, site, ask) {
                true => format!(
                    "add a transition on {} between two states inside of this one: leaving it would take back what was done of the emergency",
                    list.join(", ")
                ),
                false => format!(
                    "add a transition on {} that leaves the state, so that the coordinator does not wait for ever",
                    list.join(", ")
                ),
            },
        ));
    }
    findings
}

/// Whether what is asked for is safe, and in force for as long as a state is active.
fn is_held(deployment: &Deployment, site: &RaiseSite, ask: Ask) -> bool {
    site.scoped && matches!(ask, Ask::Apply(id) if deployment.configuration(id).is_some_and(|of| of.safe))
}

/// The state that is active until an answer comes, or nobody is told: who enters asks for himself; what an exit or an
/// effect asks for is heard in the outermost state that stays active on the way, here on any way there is.
fn owner(chart: &Chart, when: RaiseMoment) -> NodeId {
    let edge = match when {
        RaiseMoment::Entry(state) => return state,
        RaiseMoment::Exit(_) => return NodeId::ROOT,
        RaiseMoment::Effect(edge) => edge,
    };
    let mut seen: FxHashSet<EdgeId> = FxHashSet::default();
    let mut open = vec![edge];
    let mut owner = chart.least_common_ancestor(edge);
    while let Some(edge) = open.pop() {
        if !seen.insert(edge) {
            continue;
        }
        let stays = chart.least_common_ancestor(edge);
        if chart.depth(stays) < chart.depth(owner) {
            owner = stays;
        }
        let (from, to) = chart.ends(edge);
        if !chart.is_state(to) {
            open.extend(chart.outgoing(to));
        }
        if !chart.is_state(from) {
            open.extend(edges(chart).filter(|before| chart.ends(*before).1 == from));
        }
    }
    owner
}

/// States with a transition that the event alone can take all the way to a leaf. What functions decide counts as a yes.
fn hearing(chart: &Chart, event: EventId) -> Vec<NodeId> {
    let mut leads = vec![false; chart.len()];
    let mut into: FxHashMap<NodeId, Vec<NodeId>> = FxHashMap::default();
    let mut open: Vec<NodeId> = Vec::new();
    for edge in edges(chart).filter(|edge| chart.may_trigger(*edge, event)) {
        let (from, to) = chart.ends(edge);
        into.entry(to).or_default().push(from);
        if chart.kind(to) == NodeKind::Leaf {
            open.push(from);
        }
    }
    let mut hears = Vec::new();
    while let Some(node) = open.pop() {
        if std::mem::replace(&mut leads[node.index()], true) {
            continue;
        }
        if chart.is_state(node) {
            hears.push(node);
        } else {
            open.extend(into.get(&node).into_iter().flatten());
        }
    }
    hears
}
