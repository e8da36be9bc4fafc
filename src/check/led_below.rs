//! Nor does an emergency of a subsystem, or of another coordinator, end since its parent goes on: what lets go of something safe there is given
//! by what people ask for.
//!
//! A coordinator may come to that by an answer, by time, or by what a subsystem tells it, after the event of safety that made it safe below.
//! Who hears that event where it waits, and goes elsewhere, waits for people from then on.

use super::coordinator::{ask_of, edges, place};
use super::led_on::{HeldSafe, held};
use crate::model::codes::COORD_SAFE_LEFT;
use crate::model::{Ask, Deployment, EventName, Finding, Findings, Ident, Verdict};
use crate::statechart::{Chart, EdgeId, EventId, NodeId, NodeKind, RaiseMoment, compile};
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;

/// Events that let go of what is safe, each with the events of safety by which it came to be.
type LetsGo = BTreeMap<EventName, Vec<EventName>>;

/// Transitions of these coordinators by which a subsystem, or another one of them, is let go unasked.
pub fn check(deployment: &Deployment, charts: &[&Chart]) -> Findings {
    let below = below(deployment);
    let mut findings = Findings::new();
    for (number, chart) in charts.iter().enumerate() {
        let mut lets_go = below.clone();
        let others = charts.iter().enumerate().filter(|(other, _)| *other != number);
        for (_, other) in others {
            for event in let_go_by(deployment, other, &below) {
                lets_go.entry(event).or_insert_with(|| deployment.safety.iter().map(|(event, _)| *event).collect());
            }
        }
        if !lets_go.is_empty() {
            findings.extend(edges(chart).filter_map(|edge| unasked(deployment, chart, edge, &lets_go)));
        }
    }
    findings
}

/// What lets go of subsystems, by the names that their parent has for it.
fn below(deployment: &Deployment) -> LetsGo {
    let mut all = LetsGo::new();
    for subsystem in &deployment.subsystems {
        let own = &*subsystem.own;
        let inner = below(own);
        let charts: Vec<Chart> = own.charts().filter_map(|chart| compile(chart).0).collect();
        let events: FxHashSet<EventName> = charts.iter().flat_map(|chart| let_go_by(own, chart, &inner)).collect();
        let given = deployment.safety.iter().map(|(event, _)| *event);
        let given: Vec<EventName> = given.filter(|event| own.safety.iter().any(|(its, _)| its == event)).collect();
        if given.is_empty() {
            continue;
        }
        let accepts = own.interface.accepts.iter().map(|(event, _)| *event);
        for event in accepts.chain([own.deploy.event, own.shutdown.event]).filter(|event| events.contains(event)) {
            all.insert(within(subsystem.name, event), given.clone());
        }
    }
    all
}

fn within(path: Ident, event: EventName) -> EventName {
    EventName::new(&format!("{path}/{event}")).expect("an event with a path is one")
}

/// The events by which a coordinator lets go of what is safe, its own or that of a subsystem.
fn let_go_by(deployment: &Deployment, chart: &Chart, below: &LetsGo) -> FxHashSet<EventName> {
    let held = held(deployment, chart);
    let is_safe = |ask: Ask| matches!(ask, Ask::UndoOf(id) if deployment.configuration(id).is_some_and(|of| of.safe));
    let mut all = FxHashSet::default();
    for edge in edges(chart) {
        let lets_go = held.iter().any(|of: &HeldSafe| of.is_left_by(deployment, chart, edge))
            || raised_by(chart, edge).any(|(name, scoped)| {
                below.contains_key(&name) || !scoped && ask_of(deployment, name).is_some_and(is_safe)
            });
        if lets_go {
            let triggers = chart.triggers(edge).unwrap_or(&[]);
            all.extend(triggers.iter().filter_map(|event| EventName::new(&chart.event_text(*event)).ok()));
        }
    }
    all
}

/// What is raised where a transition is taken, and whether it is a state-scoped configuration's.
fn raised_by(chart: &Chart, edge: EdgeId) -> impl Iterator<Item = (EventName, bool)> + '_ {
    let entered = entered(chart, edge);
    let by = move |when: RaiseMoment| match when {
        RaiseMoment::Effect(of) => of == edge,
        RaiseMoment::Entry(node) => entered.contains(&node),
        RaiseMoment::Exit(_) => false,
    };
    chart.raises().iter().filter(move |site| by(site.when)).map(|site| (site.name, site.scoped))
}

/// The states that a transition enters, those behind connectors among them.
fn entered(chart: &Chart, edge: EdgeId) -> FxHashSet<NodeId> {
    let (mut all, mut seen, mut open) = (FxHashSet::default(), FxHashSet::default(), vec![edge]);
    while let Some(edge) = open.pop() {
        if !seen.insert(edge) {
            continue;
        }
        let ((_, target), stays) = (chart.ends(edge), chart.least_common_ancestor(edge));
        let outwards = std::iter::successors(Some(target), |node| chart.parent(*node));
        all.extend(outwards.take_while(|node| *node != stays));
        if chart.kind(target) == NodeKind::Connector {
            open.extend(chart.outgoing(target));
        }
    }
    all
}

/// The finding of a transition that comes unasked, and lets go of somebody who may have been made safe meanwhile.
fn unasked(deployment: &Deployment, chart: &Chart, edge: EdgeId, lets_go: &LetsGo) -> Option<Finding> {
    let by = by(deployment, chart, edge)?;
    let (source, target) = chart.ends(edge);
    let unheard = |event: &&EventName| !is_heard(chart, edge, **event);
    let (raised, safety) = raised_by(chart, edge).find_map(|(name, _)| {
        let safety = lets_go.get(&name)?.iter().find(unheard)?;
        Some((name, *safety))
    })?;
    let message = format!(
        "{by} leads from `{}` to `{}`, where `{raised}` is raised: what `{safety}` has made safe there meanwhile is let go, and nobody said \
         that the emergency is over",
        chart.fqn(source),
        chart.fqn(target)
    );
    let help = format!(
        "hear `{safety}` in `{}`, and go to a state from which an event of people leads on, such as `{}`",
        chart.fqn(source),
        deployment.shutdown.event
    );
    let finding = Finding::warning(COORD_SAFE_LEFT, message).at(chart.edge_origin(edge));
    Some(finding.path(place(chart, RaiseMoment::Effect(edge))).help(help))
}

/// What takes a transition without anybody having said so, in words.
fn by(deployment: &Deployment, chart: &Chart, edge: EdgeId) -> Option<String> {
    let triggers = chart.triggers(edge)?;
    let comes_by_itself = |event: &&EventId| {
        let text = chart.event_text(**event);
        let is_answer = Verdict::split(&text).is_some() && deployment.looks_like_answer(&text);
        let is_told = text
            .split_once('/')
            .is_some_and(|(path, _)| deployment.subsystems.iter().any(|subsystem| subsystem.name.as_str() == path));
        chart.time_of(**event).is_some() || is_answer || is_told
    };
    triggers.iter().find(comes_by_itself).map(|event| format!("`{}`", chart.event_text(*event)))
}

/// Whether an event of safety is heard where a transition begins, and leads away from there.
fn is_heard(chart: &Chart, edge: EdgeId, safety: EventName) -> bool {
    let (source, event) = (chart.ends(edge).0, chart.event(safety));
    edges(chart).any(|other| {
        let (from, to) = chart.ends(other);
        let there = chart.is_inside(source, from) || chart.is_inside(from, source);
        there && !chart.is_inside(to, source) && chart.triggers(other).is_some_and(|all| all.contains(&event))
    })
}
