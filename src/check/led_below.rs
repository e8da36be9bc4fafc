//! Nor does an emergency of a subsystem, or of another coordinator, end since its parent goes on: what lets go of something safe there is given
//! by what people ask for.
//!
//! A coordinator may come to that by an answer, by time, or by what a subsystem tells it, after the event of safety that made it safe below.
//! Who hears that event where it waits, and goes elsewhere, waits for people from then on. A subsystem may be stopped alone, too, by somebody
//! there, its components or its monitors: then its parent hears what that emits of it, or nothing.

use super::by_itself::by;
use super::coordinator::{ask_of, edges, place};
use super::led_on::{HeldSafe, held};
use super::stops_below::{StopBelow, compiled, is_given_on};
use super::taken::{Taken, raised_by};
use crate::model::codes::COORD_SAFE_LEFT;
use crate::model::{Ask, Deployment, EventName, Finding, Findings};
use crate::statechart::{Chart, EdgeId, EventId, NodeId, NodeKind, RaiseMoment, RaiseSite};
use rustc_hash::FxHashSet;
use std::collections::{BTreeMap, BTreeSet};

/// Events that let go of what is safe, each with the stops by which it came to be.
type LetsGo = BTreeMap<EventName, Vec<StopBelow>>;

/// Transitions of these coordinators by which a subsystem, or another one of them, is let go unasked.
pub fn check(deployment: &Deployment, charts: &[&Chart]) -> Findings {
    let below = below(deployment, &BTreeSet::new());
    let mut findings = Findings::new();
    for (number, chart) in charts.iter().enumerate() {
        let mut lets_go = below.clone();
        let others = charts.iter().enumerate().filter(|(other, _)| *other != number);
        for (_, other) in others {
            for event in let_go_by(deployment, other, &below) {
                lets_go
                    .entry(event)
                    .or_insert_with(|| deployment.safety.iter().map(|(event, _)| StopBelow::given(*event)).collect());
            }
        }
        if !lets_go.is_empty() {
            findings.extend(edges(chart).filter_map(|edge| unasked(deployment, chart, edge, &lets_go)));
            findings.extend(leading_there(deployment, chart, &lets_go));
        }
    }
    findings
}

/// What lets go of subsystems, by the names that their parent has for it. `above`: events of safety of those around it, which are given on past it.
fn below(deployment: &Deployment, above: &BTreeSet<EventName>) -> LetsGo {
    let mut all = LetsGo::new();
    let safety: BTreeSet<EventName> =
        deployment.safety.iter().map(|(event, _)| *event).chain(above.iter().copied()).collect();
    for subsystem in &deployment.subsystems {
        let own = subsystem.own.own_part();
        let inner = below(own, &safety);
        let charts = compiled(own);
        let events: FxHashSet<EventName> = charts.iter().flat_map(|chart| let_go_by(own, chart, &inner)).collect();
        let given = safety.iter().copied().filter(|event| is_given_on(*event, own)).map(StopBelow::given);
        let stops: Vec<StopBelow> = given.chain(StopBelow::alone(subsystem)).collect();
        if stops.is_empty() {
            continue;
        }
        let accepts = own.interface.accepts.iter().map(|(event, _)| *event);
        for event in accepts.chain([own.deploy.event, own.shutdown.event]).filter(|event| events.contains(event)) {
            all.insert(event.within(subsystem.name), stops.clone());
        }
    }
    all
}

/// The events by which a coordinator lets go of what is safe, its own or that of a subsystem.
fn let_go_by(deployment: &Deployment, chart: &Chart, below: &LetsGo) -> FxHashSet<EventName> {
    let held = held(deployment, chart);
    let is_safe = |ask: Ask| matches!(ask, Ask::UndoOf(id) if deployment.configuration(id).is_some_and(|of| of.safe));
    let mut all = FxHashSet::default();
    for edge in edges(chart) {
        // What an exit takes back is looked at as what is held.
        let takes_back = |site: &RaiseSite| {
            let exits = matches!(site.when, RaiseMoment::Exit(_));
            !exits && !site.scoped && ask_of(deployment, site.name).is_some_and(is_safe)
        };
        let lets_go = held.iter().any(|of: &HeldSafe| of.is_left_by(deployment, chart, edge))
            || raised_by(chart, edge).any(|site| below.contains_key(&site.name) || takes_back(site));
        if lets_go {
            let triggers = chart.triggers(edge).unwrap_or(&[]);
            all.extend(triggers.iter().filter_map(|event| EventName::new(&chart.event_text(*event)).ok()));
        }
    }
    all
}

/// The finding of a transition that comes unasked, and lets go of somebody who may have been made safe meanwhile.
fn unasked(deployment: &Deployment, chart: &Chart, edge: EdgeId, lets_go: &LetsGo) -> Option<Finding> {
    let (by, raised, stop) = raised_by(chart, edge).find_map(|site| {
        let (raised, stops) = (site.name, lets_go.get(&site.name)?);
        let unheard = |stop: &&StopBelow| !is_heard(chart, edge, stop, lets_go);
        let by_itself = || Some((by(deployment, chart, edge)?, stops.iter().find(unheard)?));
        // It comes of the stop itself.
        let is_it = |event: &&EventName| chart.triggers(edge).is_some_and(|all| all.contains(&chart.event(**event)));
        let at_once = stops.iter().find_map(|stop| Some((format!("`{}`", stop.heard.iter().find(is_it)?), stop)));
        let (by, stop) = at_once.or_else(by_itself)?;
        Some((by, raised, stop))
    })?;
    Some(finding(
        deployment,
        chart,
        edge,
        &format!("{by} leads"),
        (&format!("and `{raised}` is raised on that way"), stop),
    ))
}

/// Transitions that come unasked and lead on, unasked, to where somebody is let go of: the stop may have come before the first of them.
fn leading_there(deployment: &Deployment, chart: &Chart, lets_go: &LetsGo) -> Findings {
    let by_itself: Vec<(EdgeId, String)> =
        edges(chart).filter_map(|edge| Some((edge, by(deployment, chart, edge)?))).collect();
    let lets_go_of =
        |edge: EdgeId| raised_by(chart, edge).map(|site| site.name).find(|name| lets_go.contains_key(name));
    let mut open: Vec<(EdgeId, EventName)> =
        by_itself.iter().filter_map(|(edge, _)| Some((*edge, lets_go_of(*edge)?))).collect();
    let mut seen: FxHashSet<EdgeId> = open.iter().map(|(edge, _)| *edge).collect();
    let mut findings = Findings::new();
    while let Some((edge, raised)) = open.pop() {
        let source = chart.ends(edge).0;
        let leads = |before: EdgeId| {
            let from_outside = !chart.is_inside(chart.ends(before).0, source);
            from_outside && Taken::of(chart, before).entered.iter().any(|node| chart.is_inside(*node, source))
        };
        for (before, by) in by_itself.iter().filter(|(before, _)| leads(*before)) {
            if !seen.insert(*before) {
                continue;
            }
            open.push((*before, raised));
            if let Some(stop) = lets_go[&raised].iter().find(|stop| !is_heard(chart, *before, stop, lets_go)) {
                let how = format!("and by itself on to where `{raised}` is raised");
                findings.push(finding(deployment, chart, *before, &format!("{by} leads"), (&how, stop)));
            }
        }
    }
    findings
}

fn finding(
    deployment: &Deployment,
    chart: &Chart,
    edge: EdgeId,
    leads: &str,
    (how, stop): (&str, &StopBelow),
) -> Finding {
    let (source, target) = chart.ends(edge);
    let message = format!(
        "{leads} from `{}` to `{}`, {how}: what `{}` has made safe there meanwhile is let go, and nobody said that the emergency is over",
        chart.fqn(source),
        chart.fqn(target),
        stop.event
    );
    let help = format!(
        "{} in `{}`, and go to a state from which an event of people leads on, such as `{}`",
        stop.hear(),
        chart.fqn(source),
        deployment.shutdown.event
    );
    let finding = Finding::warning(COORD_SAFE_LEFT, message).at(chart.edge_origin(edge));
    finding.path(place(chart, RaiseMoment::Effect(edge))).help(help)
}

/// Whether a stop is heard wherever a transition may begin, leads away from there, and lets go of nothing itself.
fn is_heard(chart: &Chart, edge: EdgeId, stop: &StopBelow, lets_go: &LetsGo) -> bool {
    let source = chart.ends(edge).0;
    let events: Vec<EventId> =
        stop.heard.iter().map(|event| chart.event(*event)).filter(|event| *event != EventId::OTHER).collect();
    let leads_away = |other: &EdgeId| {
        chart.triggers(*other).is_some_and(|all| events.iter().any(|event| all.contains(event)))
            && !chart.is_inside(chart.ends(*other).1, source)
            && !raised_by(chart, *other).any(|site| lets_go.contains_key(&site.name))
    };
    let hearing: FxHashSet<NodeId> = edges(chart).filter(leads_away).map(|other| chart.ends(other).0).collect();
    let mut leaves = chart.nodes().filter(|node| chart.kind(*node) == NodeKind::Leaf && chart.is_inside(*node, source));
    leaves.all(|leaf| std::iter::successors(Some(leaf), |node| chart.parent(*node)).any(|node| hearing.contains(&node)))
}
