//! What a deployment shows to one that it is a subsystem of, and what it says to its own subsystems, by the texts alone.

use super::universe::Universe;
use super::{children, let_go};
use crate::model::codes::{
    COMPOSE_EXPORT_DRIVEN, COMPOSE_NOT_DOWN_AT_FIRST, COMPOSE_SAFETY, COMPOSE_UNKNOWN, COMPOSE_WORD,
};
use crate::model::finding::{did_you_mean, nearest};
use crate::model::subsystem::IGNORED;
use crate::model::{
    Catalogue, ChangeKind, Deployment, Direction, EventName, Finding, Findings, Ident, Origin, Subsystem,
    SubsystemStanding,
};
use crate::statechart::{Chart, EventId};
use std::collections::BTreeSet;

/// What is wrong with what it shows.
pub fn check(deployment: &Deployment, universe: &Universe, charts: &[&Chart]) -> Findings {
    let mut findings = Vec::new();
    exports(deployment, universe, &mut findings);
    events(deployment, charts, &mut findings);
    findings
}

fn exports(deployment: &Deployment, universe: &Universe, findings: &mut Findings) {
    for (name, export) in &deployment.interface.exports {
        let of = export.of;
        // What one of a subsystem's own is, is looked at in that one's file; who drives it, here as well.
        let passed_on = deployment.path_of(of.component.as_str()).is_some();
        if passed_on && universe.of(of.component).is_empty() {
            continue;
        }
        let path = format!("exports.{}.{name}", export.kind.several());
        if universe.of(of.component).is_empty() {
            let unknown = universe.unknown(of.component, export.origin);
            findings.push(Finding { code: COMPOSE_UNKNOWN, ..unknown }.path(path));
            continue;
        }
        if let Some(lacks) = universe.lacks(export.kind, of, export.origin) {
            findings.push(Finding { code: COMPOSE_UNKNOWN, ..lacks }.path(path));
            continue;
        }
        let mut types = universe.of(of.component).iter().filter_map(|creation| creation.description.as_deref());
        let is_in = types.any(|ty| ty.port(of.member).is_some_and(|port| port.direction == Direction::In));
        let drives = |kind: &ChangeKind| match kind {
            ChangeKind::Connect { to, .. } => *to == of,
            ChangeKind::PortWrite { port, .. } => *port == of,
            _ => false,
        };
        let mut changes = deployment.configurations.iter().flat_map(|configuration| &configuration.changes);
        if let Some(driven) = changes.find(|change| is_in && drives(&change.kind)) {
            let message = format!("`{of}` is exported as `{name}` for a parent to drive, and driven inside");
            findings.push(
                Finding::error(COMPOSE_EXPORT_DRIVEN, message)
                    .at(export.origin)
                    .path(path)
                    .also(driven.origin, "driven here")
                    .help("leave the export out, or let the parent alone drive it"),
            );
        }
    }
}

fn events(deployment: &Deployment, charts: &[&Chart], findings: &mut Findings) {
    let interface = &deployment.interface;
    let emits: BTreeSet<EventName> = deployment.emits.iter().map(|(event, _)| *event).collect();
    let accepts: BTreeSet<EventName> = interface
        .accepts
        .iter()
        .map(|(event, _)| *event)
        .chain([deployment.deploy.event, deployment.shutdown.event])
        .collect();
    for (event, origin) in deployment.emits.iter().chain(&interface.accepts) {
        let text = event.as_str();
        if SubsystemStanding::WORDS.iter().any(|(word, _)| *word == text) || text.ends_with(IGNORED) {
            let message = format!("`{event}` is told of every subsystem by itself");
            findings.push(Finding::error(COMPOSE_WORD, message).at(*origin).help("give the event another name"));
        } else if !text.contains('/') && (deployment.looks_like_answer(text) || deployment.names_configuration(text)) {
            // A parent that raised it would tell what has not happened.
            let message = match deployment.looks_like_answer(text) {
                true => format!("`{event}` is an answer: it comes to who asked, and nobody else raises it"),
                false => {
                    format!("`{event}` is a configuration, and no event: a coordinator that raises it asks for it")
                }
            };
            findings.push(Finding::error(COMPOSE_WORD, message).at(*origin).help(
                "list what a transition waits for, or a coordinator raises, of its own: an event that a parent, or who looks on, may know",
            ));
        }
    }
    for (event, origin) in &interface.accepts {
        if charts.iter().all(|chart| chart.event(*event) == EventId::OTHER) {
            let known: Vec<&str> = charts.iter().flat_map(|chart| chart.events()).map(|event| event.as_str()).collect();
            let message = format!("`{event}` is accepted, and no transition waits for it: it would always be ignored");
            let accepted = |event: &&str| interface.accepts.iter().any(|(accepted, _)| accepted.as_str() == *event);
            // Which of the two is the slip is not known here.
            let help = match nearest(event.as_str(), known.iter().copied().filter(|event| !accepted(event))) {
                Some(near) => format!("did the transition that waits for `{near}` mean `{event}`?"),
                None => did_you_mean(event.as_str(), "events", known),
            };
            findings.push(Finding::warning(COMPOSE_UNKNOWN, message).at(*origin).path("accepts").help(help));
        }
    }
    let mut among = |event: EventName, all: &BTreeSet<EventName>, at: Origin, key: &str, list: &str| {
        if !all.contains(&event) {
            let message = format!("{key}: `{event}` is not among what the deployment {list}");
            let help = did_you_mean(event.as_str(), "events", all.iter().map(|event| event.as_str()));
            findings.push(Finding::error(COMPOSE_UNKNOWN, message).at(at).path(key).help(help));
        }
    };
    if let Some((from, at)) = interface.from {
        among(from, &emits, at, "exports.from", "emits");
    }
    if let Some(leaving) = interface.leaving {
        among(leaving.says, &emits, deployment.key_origin("leaving.says"), "leaving.says", "emits");
        among(leaving.until, &accepts, deployment.key_origin("leaving.until"), "leaving.until", "accepts");
    }
}

/// What a deployment may hear of a subsystem.
pub fn told_by(subsystem: &Subsystem) -> BTreeSet<EventName> {
    let own = &*subsystem.own;
    let accepts = own.interface.accepts.iter().map(|(event, _)| *event).chain([own.deploy.event, own.shutdown.event]);
    let ignored = accepts.filter_map(|event| EventName::new(&format!("{event}{IGNORED}")).ok());
    let emits = own.emits.iter().map(|(event, _)| *event);
    let told = emits.chain(ignored).map(|event| event.within(subsystem.name));
    told.chain(SubsystemStanding::WORDS.iter().map(|(_, standing)| standing.event(subsystem.name))).collect()
}

/// What is wrong between a deployment and its subsystems. `own` is what stands in its own file.
pub fn between(own: &Deployment, charts: &[&Chart], catalogue: &Catalogue) -> Findings {
    let mut findings = Vec::new();
    for subsystem in &own.subsystems {
        unheard(subsystem, charts, &mut findings);
        findings.extend(not_down_at_first(subsystem));
        findings.extend(let_go::check(own, subsystem, charts));
        let declared: Vec<(EventName, Origin)> = own.safety.clone();
        for (event, origin) in declared {
            let mut missing = Vec::new();
            unsafe_in(subsystem, subsystem.name, event, catalogue, &mut missing);
            let theirs = subsystem.own.safety.iter().map(|(event, _)| event.as_str());
            let meant = nearest(event.as_str(), theirs).map(|near| format!("did you mean `{near}`? Else "));
            for (path, at) in missing {
                let message = format!("`{event}` does not reach `{path}`, which has actuators");
                findings.push(Finding::error(COMPOSE_SAFETY, message).at(at).also(origin, "declared here").help(
                    format!(
                        "{}list it under `safety` in the file of `{path}`, where it leads to a safe configuration",
                        meant.as_deref().unwrap_or_default()
                    ),
                ));
            }
        }
    }
    findings.extend(unlisted(own, catalogue));
    findings
}

/// A subsystem that is not down before it is begun keeps its parent from being down that has neither begun nor ended it.
fn not_down_at_first(subsystem: &Subsystem) -> Option<Finding> {
    let own = subsystem.own.own_part();
    let number = children::not_down_at_first(own)?;
    let coordinator = &own.coordinators[number];
    let message =
        format!("`{}` is not down before it is begun: it does not begin in `{}`", subsystem.name, coordinator.down);
    let help = format!(
        "let it begin in `{}`, or have its parent end it (`{}`) wherever that leads down",
        coordinator.down,
        own.shutdown.event.within(subsystem.name)
    );
    let finding = Finding::warning(COMPOSE_NOT_DOWN_AT_FIRST, message).at(subsystem.origin);
    Some(finding.also(subsystem.own.key_origin("shutdown.down"), "the state that means down").help(help))
}

/// A safety event of subsystems that no event of their deployment's own stands for: nobody can stop all of them at once. One that does not reach
/// all that need it would be refused here.
fn unlisted(own: &Deployment, catalogue: &Catalogue) -> Option<Finding> {
    let reaches = |event: EventName| {
        let mut missing = Vec::new();
        let all = own.subsystems.iter();
        all.for_each(|subsystem| unsafe_in(subsystem, subsystem.name, event, catalogue, &mut missing));
        missing.is_empty()
    };
    let declares = |of: &Subsystem, event: EventName| of.own.own_part().safety.iter().any(|(own, _)| *own == event);
    let theirs = own.subsystems.iter().flat_map(|subsystem| subsystem.own.own_part().safety.iter());
    let event = theirs.map(|(event, _)| *event).find(|event| own.safety.is_empty() && reaches(*event))?;
    let of: Vec<&Subsystem> = own.subsystems.iter().filter(|subsystem| declares(subsystem, event)).collect();
    let names: Vec<String> = of.iter().map(|subsystem| format!("`{}/{event}`", subsystem.name)).collect();
    let raised = if names.len() == 1 { "has to be raised" } else { "have to be raised one by one" };
    Some(
        Finding::info(COMPOSE_SAFETY, format!("there is no `safety` here: {} {raised}", names.join(", ")))
            .at(of.first()?.origin)
            .help(format!("list `safety: [{event}]` here as well: it is heard in all subsystems then")),
    )
}

/// The subsystems with actuators that do not declare a safety event, to any depth.
fn unsafe_in(of: &Subsystem, path: Ident, event: EventName, catalogue: &Catalogue, missing: &mut Vec<(Ident, Origin)>) {
    let own = of.own.own_part();
    let local = catalogue.known_in(path);
    let acts = Universe::new(own, &local).types().any(|ty| ty.actuator);
    if acts && !own.safety.iter().any(|(declared, _)| *declared == event) {
        missing.push((path, of.origin));
    }
    for inner in &of.own.subsystems {
        unsafe_in(inner, inner.name.within(path), event, catalogue, missing);
    }
}

/// Events of a subsystem that transitions wait for and that it never tells.
fn unheard(subsystem: &Subsystem, charts: &[&Chart], findings: &mut Findings) {
    let told = told_by(subsystem);
    let mut said = BTreeSet::new();
    for chart in charts {
        for edge in super::coordinator::edges(chart) {
            for trigger in chart.triggers(edge).unwrap_or(&[]) {
                let Ok(event) = EventName::new(&chart.event_text(*trigger)) else { continue };
                let Some(own) = event.local(subsystem.name) else { continue };
                if told.contains(&event) || !said.insert(event) {
                    continue;
                }
                let known: Vec<&str> = told.iter().filter_map(|event| event.local(subsystem.name)).collect();
                let message = format!("`{event}` never comes: `{}` emits nothing called `{own}`", subsystem.name);
                findings.push(
                    Finding::error(COMPOSE_UNKNOWN, message)
                        .at(chart.edge_origin(edge))
                        .also(subsystem.origin, "the subsystem")
                        .help(did_you_mean(own, "events", known)),
                );
            }
        }
    }
}
