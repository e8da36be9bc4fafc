//! Names with a path before them in a coordinator: whether there is such a subsystem, and whether it takes what is raised for it.

use crate::model::codes::{COMPOSE_UNKNOWN, COORD_UNKNOWN_REQUEST};
use crate::model::finding::{did_you_mean, nearest};
use crate::model::{Deployment, EventName, Finding, Findings, Subsystem};
use crate::statechart::Chart;
use std::collections::BTreeSet;

/// The finding of an event that is raised for a subsystem which does not take it, or is not there; none where the name has no path, or the
/// deployment no subsystems.
pub fn raised(deployment: &Deployment, name: EventName) -> Option<Finding> {
    if let Some(near) = dotted(deployment, name.as_str()) {
        let message = format!("`{name}` asks for nothing: what is raised for a subsystem has its path before it");
        return Some(Finding::error(COORD_UNKNOWN_REQUEST, message).help(format!("did you mean `{near}`?")));
    }
    let (path, own) = name.as_str().split_once('/')?;
    if deployment.subsystems.is_empty() {
        return None;
    }
    let Some(subsystem) = named(deployment, path) else {
        let message = format!("`{name}` is raised for nobody: there is no subsystem `{path}`");
        return Some(Finding::error(COORD_UNKNOWN_REQUEST, message).help(which(deployment, path)));
    };
    let message = format!("`{name}` is nothing that `{path}` accepts");
    let accepts: Vec<&str> = accepted(subsystem).map(|event| event.as_str()).collect();
    let list = accepts.iter().map(|event| format!("`{event}`")).collect::<Vec<_>>().join(", ");
    let by_itself = subsystem.own.safety.iter().any(|(event, _)| event.as_str() == own);
    let is_configuration = subsystem.own.configurations.iter().any(|configuration| configuration.id.as_str() == own);
    let help = match nearest(own, accepts) {
        _ if by_itself => format!("`{own}` is an event of safety, which reaches `{path}` by itself; it accepts {list}"),
        _ if is_configuration => format!(
            "`{own}` is a configuration, which the coordinator of `{path}` asks for: raise an event that it waits for, and lists under `accepts`"
        ),
        Some(near) => format!("did you mean `{path}/{near}`? `{path}` accepts {list}"),
        None if own.contains('/') => {
            format!("what is inside of `{path}` is led by its own coordinator: raise what that accepts, {list}")
        }
        None => format!(
            "`{path}` accepts {list}: what it is to take its coordinator hears, and its file lists under `accepts`"
        ),
    };
    Some(Finding::error(COORD_UNKNOWN_REQUEST, message).also(subsystem.origin, "the subsystem").help(help))
}

/// What a name was meant to be that has a dot behind the name of a subsystem (`left.up`): `left/up`.
pub fn dotted(deployment: &Deployment, name: &str) -> Option<String> {
    let (path, own) = name.split_once('.').filter(|(path, own)| !path.contains('/') && !own.contains('/'))?;
    named(deployment, path).map(|_| format!("{path}/{own}"))
}

/// Events with the path of no subsystem that transitions wait for.
pub fn heard(deployment: &Deployment, charts: &[&Chart]) -> Findings {
    let (mut findings, mut said) = (Findings::new(), BTreeSet::new());
    if deployment.subsystems.is_empty() {
        return findings;
    }
    for chart in charts {
        for edge in chart.nodes().flat_map(|node| chart.outgoing(node)) {
            for trigger in chart.triggers(edge).unwrap_or(&[]) {
                let text = chart.event_text(*trigger);
                let Some((path, _)) = text.split_once('/') else { continue };
                // A name that is put together (`path .. "/up"`) is wrong in all that are made of it: said once.
                if text.contains('(') || named(deployment, path).is_some() || !said.insert(path.to_owned()) {
                    continue;
                }
                let message = format!("`{text}` never comes: there is no subsystem `{path}`");
                let finding = Finding::error(COMPOSE_UNKNOWN, message).at(chart.edge_origin(edge));
                findings.push(finding.labelled("waits for it").help(which(deployment, path)));
            }
        }
    }
    findings
}

fn named<'d>(deployment: &'d Deployment, path: &str) -> Option<&'d Subsystem> {
    deployment.subsystems.iter().find(|subsystem| subsystem.name.as_str() == path)
}

fn which(deployment: &Deployment, path: &str) -> String {
    did_you_mean(path, "subsystems", deployment.subsystems.iter().map(|subsystem| subsystem.name.as_str()))
}

/// What a subsystem takes of its parent, by the names of its own file.
fn accepted(subsystem: &Subsystem) -> impl Iterator<Item = EventName> + '_ {
    let own = &*subsystem.own;
    let mut all: BTreeSet<EventName> = own.interface.accepts.iter().map(|(event, _)| *event).collect();
    all.extend([own.deploy.event, own.shutdown.event]);
    all.into_iter()
}
