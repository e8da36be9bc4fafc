//! In-ports that nothing drives: no configuration connects them or writes them, and no operator may. Where one that is needed is exported
//! the parent drives it, so the file is a part of something larger.

use super::links::links;
use super::universe::Universe;
use crate::model::codes::{DEPLOY_PART, DEPLOY_PORT_REQUIRED, DEPLOY_PORT_UNDRIVEN};
use crate::model::{
    Catalogue, ChangeKind, Deployment, Direction, Finding, Findings, MemberRef, OperatorMay, Origin, Severity,
};
use rustc_hash::FxHashSet;

/// Names that a finding shows; the rest is counted.
const SHOWN: usize = 6;

/// A warning for each that its type declares `required`, and one note of all others.
pub fn check(deployment: &Deployment, universe: &Universe) -> Findings {
    let driven = driven(deployment);
    let mut components: Vec<_> = universe.components().collect();
    components.sort_unstable_by_key(|name| name.as_str());
    let mut findings = Findings::new();
    let (mut others, mut first): (Vec<MemberRef>, _) = (Vec::new(), Origin::NONE);
    for component in components {
        for creation in universe.of(component) {
            let ports = creation.description.iter().flat_map(|ty| &ty.ports);
            for (name, port) in ports.filter(|(_, port)| port.direction == Direction::In) {
                let member = component.member(*name);
                if driven.contains(&member) {
                    continue;
                }
                if port.required {
                    findings.push(required(member, creation.origin, port.origin));
                } else if !others.contains(&member) {
                    first = if others.is_empty() { creation.origin } else { first };
                    others.push(member);
                }
            }
        }
    }
    if !others.is_empty() {
        findings.push(note(&others, first));
    }
    findings
}

/// What says that a deployment is a part of something larger: it exports in-ports that its components need, for a parent to drive. Where code runs
/// it is not deployed alone (an error), but it is checked, planned and imitated (a note).
pub fn part(deployment: &Deployment, catalogue: &Catalogue, severity: Severity) -> Option<Finding> {
    if deployment.kind.imitates || deployment.interface.exports.is_empty() {
        return None;
    }
    let universe = Universe::new(deployment, catalogue);
    let needs = |of: MemberRef| {
        let types = universe.of(of.component).iter().filter_map(|creation| creation.description.as_deref());
        let mut ports = types.flat_map(|ty| &ty.ports).filter(|(name, _)| **name == of.member);
        ports.any(|(_, port)| port.direction == Direction::In && port.required)
    };
    let mut needed = deployment.interface.exports.iter().filter(|(_, export)| needs(export.of)).peekable();
    let origin = needed.peek()?.1.origin;
    let names: Vec<String> = needed.map(|(name, export)| format!("`{name}` ({})", export.of)).collect();
    let (drives, needs) = match names.len() {
        1 => ("an in-port that its component needs is", "it"),
        _ => ("in-ports that their components need are", "them"),
    };
    let message = format!(
        "`{}` is a part of something larger: {drives} exported, for a parent to drive {needs}: {}",
        deployment.name,
        names.join(", ")
    );
    Some(
        Finding::new(severity, DEPLOY_PART, message)
            .at(origin)
            .path("exports")
            .help("deploy a file that has it among its `subsystems` and connects this; `--platform simulated` of `davit run` imitates it alone"),
    )
}

/// What some configuration connects or writes, or an operator may set.
fn driven(deployment: &Deployment) -> FxHashSet<MemberRef> {
    let changes = deployment.configurations.iter().flat_map(|configuration| &configuration.changes);
    let written = changes.filter_map(|change| match &change.kind {
        ChangeKind::PortWrite { port, .. } => Some(*port),
        _ => None,
    });
    let set = deployment.operator.iter().filter_map(|(may, _)| match may {
        OperatorMay::Set(member) => Some(*member),
        OperatorMay::Apply(_) => None,
    });
    // What is exported is the parent's to drive.
    let exported = deployment.interface.exports.values().map(|export| export.of);
    links(deployment).into_iter().map(|(_, to)| to).chain(written).chain(set).chain(exported).collect()
}

fn required(port: MemberRef, created: Origin, declared: Origin) -> Finding {
    Finding::warning(DEPLOY_PORT_REQUIRED, format!("nothing drives `{port}`, and its component needs it"))
        .at(created)
        .labelled("created here")
        .also(declared, "required here")
        .help(format!("connect it (`connect(\"…\", \"{port}\")`), or write it (`port_write(\"{port}\", …)`)"))
}

fn note(ports: &[MemberRef], created: Origin) -> Finding {
    let names: Vec<String> = ports.iter().take(SHOWN).map(|port| format!("`{port}`")).collect();
    let more = ports.len().saturating_sub(SHOWN);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let are = if ports.len() == 1 { "an in-port that nothing drives" } else { "in-ports that nothing drives" };
    Finding::info(DEPLOY_PORT_UNDRIVEN, format!("{}{more}: {are}", names.join(", ")))
        .at(created)
        .help("they stay as if never written; connect or write them where that is not meant (a type may say that a port is `required`)")
}
