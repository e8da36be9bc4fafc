//! In-ports that nothing drives while the deployment is up: nothing that may be in force then connects them or writes them, and no operator
//! may. Where one that is needed is exported the parent drives it, so the file is a part of something larger.

use super::driven::{DrivenPorts, DrivesInVain};
use super::universe::Universe;
use crate::model::codes::{DEPLOY_PART, DEPLOY_PORT_REQUIRED, DEPLOY_PORT_UNDRIVEN};
use crate::model::{Catalogue, Deployment, Direction, Finding, Findings, MemberRef, Origin, Severity};

/// Names that a finding shows; the rest is counted.
const SHOWN: usize = 6;

/// Configurations that a note shows which drive some of its ports, and not while the deployment is up.
const SHOWN_IN_VAIN: usize = 3;

/// A warning for each that its type declares `required`, and one note of all others.
pub fn check(universe: &Universe, driven: &DrivenPorts<'_>) -> Findings {
    let mut components: Vec<_> = universe.components().collect();
    components.sort_unstable_by_key(|name| name.as_str());
    let mut findings = Findings::new();
    let (mut others, mut first): (Vec<MemberRef>, _) = (Vec::new(), Origin::NONE);
    let mut in_vain: Vec<DrivesInVain> = Vec::new();
    for component in components {
        for creation in universe.of(component) {
            let ports = creation.description.iter().flat_map(|ty| &ty.ports);
            for (name, port) in ports.filter(|(_, port)| port.direction == Direction::In) {
                let member = component.member(*name);
                if driven.drives(member, creation.ty) {
                    continue;
                }
                let vain = driven.in_vain(member);
                if port.required {
                    findings.push(required(member, vain, creation.origin, port.origin));
                } else if !others.contains(&member) {
                    first = if others.is_empty() { creation.origin } else { first };
                    others.push(member);
                    let new = vain.filter(|of| in_vain.iter().all(|known| known.id != of.id));
                    in_vain.extend(new);
                }
            }
        }
    }
    if !others.is_empty() {
        findings.push(note(&others, &in_vain, first));
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

impl DrivesInVain {
    /// What it does, for who looks at it.
    fn told(&self) -> String {
        match self.asked {
            true => format!("`{}` does, and not while it is up", self.id),
            false => format!("`{}` would, and nobody asks for it", self.id),
        }
    }

    /// What to do about it.
    fn help(&self) -> String {
        match self.asked {
            true => format!("keep `{}` in force while it is up", self.id),
            false => format!("let a coordinator ask for `{0}`, or an operator (`operator: [{0}]`)", self.id),
        }
    }
}

/// What is driven at some other time, or would be, is not driven while it is up.
fn while_up(in_vain: bool) -> &'static str {
    if in_vain { " while the deployment is up" } else { "" }
}

fn required(port: MemberRef, in_vain: Option<DrivesInVain>, created: Origin, declared: Origin) -> Finding {
    let while_up = while_up(in_vain.is_some());
    let message = format!("nothing drives `{port}`{while_up}, and its component needs it");
    let finding = Finding::warning(DEPLOY_PORT_REQUIRED, message)
        .at(created)
        .labelled("created here")
        .also(declared, "required here");
    let help = format!("connect it (`connect(\"…\", \"{port}\")`), or write it (`port_write(\"{port}\", …)`)");
    match in_vain {
        Some(of) => finding.also(of.at, of.told()).help(format!("{}; or {help}", of.help())),
        None => finding.help(help),
    }
}

fn note(ports: &[MemberRef], in_vain: &[DrivesInVain], created: Origin) -> Finding {
    let names: Vec<String> = ports.iter().take(SHOWN).map(|port| format!("`{port}`")).collect();
    let more = ports.len().saturating_sub(SHOWN);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let are = if ports.len() == 1 { "an in-port that nothing drives" } else { "in-ports that nothing drives" };
    let while_up = while_up(!in_vain.is_empty());
    let message = format!("{}{more}: {are}{while_up}", names.join(", "));
    let finding = Finding::info(DEPLOY_PORT_UNDRIVEN, message).at(created);
    let finding = in_vain.iter().take(SHOWN_IN_VAIN).fold(finding, |finding, of| finding.also(of.at, of.told()));
    finding.help(match in_vain.first() {
        Some(of) => format!("they stay as if never written then; where that is not meant, {}", of.help()),
        None => "they stay as if never written; connect or write them where that is not meant (a type may say that a port is \
                 `required`)"
            .to_owned(),
    })
}
