//! What the deployment declares about itself: what configurations stand for, what settles an operation, what an operator may
//! do, what brings the system to rest. Do the things exist that these name.

use super::monitors;
use super::universe::Universe;
use crate::model::codes::{
    CONF_HOLDS_UNSEEN, DEPLOY_NO_REST, DEPLOY_ONE_EVENT, DEPLOY_SAFETY_ANSWER, DEPLOY_UNKNOWN_CONFIGURATION,
    NOT_AN_IN_PORT, TYPE_EXCLUSIVE, TYPE_SETTLED_ELSEWHERE, UNKNOWN_PROPERTY,
};
use crate::model::finding::did_you_mean;
use crate::model::monitor::{Condition, ConditionKind, SELF, SignalKind};
use crate::model::{
    ComponentType, ConfigId, Deployment, Direction, Finding, Findings, Ident, MemberRef, OperatorMay, Origin,
};
use std::collections::BTreeSet;

/// What is wrong with the names.
pub fn check(deployment: &Deployment, universe: &Universe) -> Findings {
    let mut findings: Findings = deployment.types.iter().flat_map(|ty| settled(deployment, ty)).collect();
    let ids: Vec<ConfigId> = deployment.configurations.iter().map(|c| c.id).collect();
    findings.extend(holds(deployment, universe, &ids));
    for (i, (may, at)) in deployment.operator.iter().enumerate() {
        let wrong = match may {
            OperatorMay::Apply(id) => configuration(deployment, *id, *at),
            OperatorMay::Set(member) => settable(universe, *member, *at),
        };
        findings.extend(wrong.map(|finding| finding.path(format!("operator[{i}]"))));
    }
    for (i, (event, at)) in deployment.safety.iter().enumerate() {
        if let Some(message) = deployment.never_from_outside(event.as_str()) {
            findings.push(
                Finding::error(DEPLOY_SAFETY_ANSWER, message)
                    .at(*at)
                    .labelled("no event from outside")
                    .path(format!("safety[{i}]"))
                    .help("list an event that a component, a monitor or an operator raises: `safety: [e_estop]`"),
            );
        }
    }
    if deployment.deploy.event == deployment.shutdown.event {
        let message = format!("`{}` both starts and ends the deployment", deployment.deploy.event);
        findings.push(
            Finding::error(DEPLOY_ONE_EVENT, message)
                .at(deployment.key_origin("shutdown.event"))
                .also(deployment.key_origin("deploy.event"), "starts it")
                .path("shutdown.event")
                .help("give it another one: `shutdown: { event: e_shutdown, … }`"),
        );
    }
    for (i, (id, at)) in deployment.shutdown.rest.iter().enumerate() {
        let wrong = configuration(deployment, *id, *at);
        findings.extend(wrong.map(|finding| finding.path(format!("shutdown.rest[{i}]"))));
    }
    findings.extend(restless(deployment, universe));
    findings
}

/// That something moves, and nothing is named that brings it to rest by force.
fn restless(deployment: &Deployment, universe: &Universe) -> Option<Finding> {
    if !deployment.shutdown.rest.is_empty() {
        return None;
    }
    let moves = |ty: &ComponentType| {
        let operation = ty.operations.iter().find(|(_, operation)| operation.moves);
        let starts = [(ty.moves.start, "starting it"), (ty.moves.stop, "stopping it")];
        let starts = starts.into_iter().find(|(moves, _)| *moves).map(|(_, what)| what.to_owned());
        operation.map(|(name, _)| format!("`{name}`")).or(starts)
    };
    let moving = universe.types().filter_map(|ty| Some((ty.name, moves(ty)?)));
    let (ty, what) = moving.min_by_key(|(ty, _)| ty.as_str())?;
    let message = format!("`{ty}` moves ({what}), and `shutdown.rest` names nothing that brings it to rest by force");
    Some(
        Finding::info(DEPLOY_NO_REST, message)
            .at(deployment.key_origin("shutdown"))
            .path("shutdown.rest")
            .help("name the configurations that do, in their order: `shutdown: { rest: [park], … }`"),
    )
}

/// What is wrong with what these configurations stand for.
pub fn holds(deployment: &Deployment, universe: &Universe, ids: &[ConfigId]) -> Findings {
    let asked = deployment.configurations.iter().filter(|c| ids.contains(&c.id));
    let conditions = asked.filter_map(|c| Some((c.holds.as_ref()?, format!("configurations.{}", c.id))));
    let of = |(holds, path): (&Condition, String)| {
        let mut findings = monitors::condition(deployment, universe, holds, path.clone());
        findings.extend(unseen(deployment, holds).map(|finding| finding.path(path)));
        findings
    };
    conditions.flat_map(of).collect()
}

/// Whether the platform does not show what a configuration stands for: the simulated one shows run states only.
pub fn is_unseen(deployment: &Deployment, holds: &Condition) -> bool {
    let mut values = false;
    holds.for_each(&mut |condition| {
        use ConditionKind as K;
        values |= matches!(condition.kind, K::IsTrue(_) | K::Silent { .. } | K::Compare { .. });
    });
    values && !deployment.kind.shows_values
}

/// That it does not show it.
fn unseen(deployment: &Deployment, holds: &Condition) -> Option<Finding> {
    is_unseen(deployment, holds).then(|| {
        let message = "the simulated platform does not show values: what this stands for counts as true there";
        Finding::warning(CONF_HOLDS_UNSEEN, message).at(holds.origin).labelled("cannot be seen there").help(
            "check it on the platform whose components run; a fault of a component that it looks at is a loss here too",
        )
    })
}

fn configuration(deployment: &Deployment, id: ConfigId, at: Origin) -> Option<Finding> {
    if deployment.named_configurations().any(|c| c.id == id) {
        return None;
    }
    let known = deployment.named_configurations().map(|c| c.id.as_str());
    Some(
        Finding::error(DEPLOY_UNKNOWN_CONFIGURATION, format!("there is no configuration `{id}`"))
            .at(at)
            .labelled("no such configuration")
            .help(did_you_mean(id.as_str(), "configurations", known)),
    )
}

/// Whether an operator can set it at all: a property or an in-port, of one of the types that the component may have.
fn settable(universe: &Universe, member: MemberRef, at: Origin) -> Option<Finding> {
    let creations = universe.of(member.component);
    if creations.is_empty() {
        return Some(universe.unknown(member.component, at));
    }
    let types: Vec<&ComponentType> = creations.iter().filter_map(|c| c.description.as_deref()).collect();
    let names = |ty: &ComponentType| {
        ty.exclusive.iter().find(|thing| thing.properties().any(|name| name == member.member)).map(ToString::to_string)
    };
    // Whatever value is chosen may be that of another component.
    if let Some(thing) = types.iter().find_map(|ty| names(ty)) {
        let message = format!(
            "`{member}` says which `{thing}` `{}` has for itself: an operator could name one that is held",
            member.component
        );
        let help = "give it where the component is created; with `--force` an operator sets it all the same";
        return Some(Finding::error(TYPE_EXCLUSIVE, message).at(at).help(help));
    }
    let is_in = |ty: &ComponentType| ty.port(member.member).is_some_and(|port| port.direction == Direction::In);
    let fits = |ty: &&ComponentType| ty.properties.contains_key(&member.member) || is_in(ty);
    // That a type is unknown is said where it is created.
    if types.len() < creations.len() || types.iter().any(fits) {
        return None;
    }
    if types.iter().any(|ty| ty.port(member.member).is_some()) {
        let message = format!("`{member}` is an out-port: its component alone sends on it");
        let help = "an operator can set properties, and write in-ports that nothing drives";
        return Some(Finding::error(NOT_AN_IN_PORT, message).at(at).help(help));
    }
    let in_ports = |ty: &ComponentType| -> Vec<Ident> {
        ty.ports.iter().filter(|(_, port)| port.direction == Direction::In).map(|(name, _)| *name).collect()
    };
    let known: BTreeSet<Ident> =
        types.iter().flat_map(|ty| ty.properties.keys().copied().chain(in_ports(ty))).collect();
    let message = format!("{} has no property or in-port `{}`", member.component, member.member);
    Some(Finding::error(UNKNOWN_PROPERTY, message).at(at).labelled("no such property or in-port").help(did_you_mean(
        member.member.as_str(),
        "properties and in-ports",
        known.iter().map(Ident::as_str),
    )))
}

/// What is wrong with the conditions that settle the operations of a type.
fn settled(deployment: &Deployment, ty: &ComponentType) -> Findings {
    let named = ty.operations.iter().filter_map(|(name, operation)| Some((name, operation.settled_by.as_ref()?)));
    let about = |(name, condition)| {
        let path = format!("types.{}.operations.{name}", ty.name);
        about_itself(deployment, ty, condition).into_iter().map(move |finding| finding.path(path.clone()))
    };
    named.flat_map(about).collect()
}

/// What is wrong with a condition that may look at a component of the type and at nothing else.
fn about_itself(deployment: &Deployment, ty: &ComponentType, condition: &Condition) -> Findings {
    let mut strangers: Vec<(String, Origin)> = Vec::new();
    condition.for_each_component(&mut |component, at| {
        if component.as_str() != SELF {
            strangers.push((format!("`{component}`"), at));
        }
    });
    condition.for_each_signal(&mut |signal| {
        if let SignalKind::Activity { activity, .. } = &signal.kind {
            strangers.push((format!("the activity `{activity}`"), signal.origin));
        }
    });
    if strangers.is_empty() {
        return monitors::condition(deployment, &Universe::alone(SELF, ty), condition, String::new());
    }
    let finding = |(what, at): (String, Origin)| {
        let message = format!("`settled_by` looks at {what}: a type knows its own component only");
        let help = format!("write the component itself as `{SELF}`: `equals: [{SELF}.mode, 6]`");
        Finding::error(TYPE_SETTLED_ELSEWHERE, message).at(at).help(help)
    };
    strangers.into_iter().map(finding).collect()
}
