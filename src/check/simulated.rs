//! What the deployment says that simulated components raise by themselves, and what goes wrong there: do the steps and
//! components exist, does somebody listen.

use super::links::links;
use super::listeners::Listeners;
use super::universe::Universe;
use crate::model::codes::{SIMULATED_NOT_USED, SIMULATED_UNHEARD, SIMULATED_UNKNOWN_STEP, TYPE_NO_EVENT};
use crate::model::finding::did_you_mean;
use crate::model::{ChangeKind, ComponentName, Deployment, EventName, Finding, Findings, MemberRef, Origin, StepFault};
use crate::statechart::Chart;
use crate::system::MemberClass;
use std::collections::BTreeSet;

/// The steps that are done to a component as a whole.
const WHOLE: [&str; 6] = ["create", "destroy", "configure", "start", "stop", "cleanup"];

/// The steps that are done to one of its members.
const PARTS: [(&str, MemberClass); 5] = [
    ("connect", MemberClass::Port),
    ("disconnect", MemberClass::Port),
    ("property_set", MemberClass::Property),
    ("port_write", MemberClass::Port),
    ("operation_call", MemberClass::Operation),
];

/// What is wrong with the names.
pub fn check(deployment: &Deployment, universe: &Universe) -> Findings {
    let mut findings = Vec::new();
    for (i, reaction) in deployment.reactions.iter().enumerate() {
        let mut wrong = step(&reaction.after, reaction.origin, universe);
        if universe.of(reaction.component).is_empty() {
            let unknown = universe.unknown_anywhere(reaction.component, reaction.origin);
            // Mostly it is the one of the step.
            let is_told = wrong.iter().any(|told| told.message == unknown.message);
            wrong.extend((!is_told).then_some(unknown));
        }
        findings.extend(wrong.into_iter().map(|finding| finding.path(format!("simulated.reactions[{i}]"))));
    }
    findings.extend(faults(deployment, deployment, universe));
    if !deployment.kind.imitates && !deployment.reactions.is_empty() {
        let message = format!("the platform is `{}`: what `simulated` says is not used", deployment.platform);
        findings.push(
            Finding::warning(SIMULATED_NOT_USED, message)
                .at(deployment.key_origin("simulated"))
                .path("simulated")
                .help("write `platform: simulated`, or leave it out"),
        );
    }
    findings
}

/// What is wrong with the faults that a file has, of steps of the `whole` that runs, its subsystems' among them.
pub fn faults(deployment: &Deployment, whole: &Deployment, universe: &Universe) -> Findings {
    let mut findings = Vec::new();
    for (i, fault) in deployment.faults.iter().enumerate() {
        let wrong = self::fault(fault, whole, universe);
        findings.extend(wrong.into_iter().map(|finding| finding.path(format!("faults[{i}]"))));
    }
    if !deployment.kind.imitates && !deployment.faults.is_empty() {
        let message =
            format!("the platform is `{}`: faults are injected on the simulated one only", deployment.platform);
        findings.push(
            Finding::info(SIMULATED_NOT_USED, message)
                .at(deployment.key_origin("faults"))
                .path("faults")
                .help("`davit run --platform simulated` runs it there"),
        );
    }
    findings
}

/// What is wrong with the step that is to go wrong. What no configuration does never comes, and a test that waits for it
/// would test nothing. (States, properties and in-ports are also moved and set by other hands: operators, a teardown.)
pub fn fault(fault: &StepFault, deployment: &Deployment, universe: &Universe) -> Findings {
    let wrong = step(&fault.step, fault.origin, universe);
    if !wrong.is_empty() {
        return wrong;
    }
    never_done(fault, deployment, universe).into_iter().collect()
}

fn never_done(fault: &StepFault, deployment: &Deployment, universe: &Universe) -> Option<Finding> {
    let (verb, rest) = fault.step.split_once(' ').unwrap_or((&fault.step, ""));
    let changes = || deployment.configurations.iter().flat_map(|c| &c.changes);
    let connects = matches!(verb, "connect" | "disconnect");
    let (operand, done): (&str, BTreeSet<String>) = if connects {
        // Each is the other's undo.
        let ended = changes().filter_map(|change| match change.kind {
            ChangeKind::Disconnect { from, to } => Some((from, to)),
            _ => None,
        });
        let done = links(deployment.configurations.iter())
            .into_iter()
            .chain(ended)
            .map(|(from, to)| format!("{from} -> {to}"));
        (rest.split_once(" (").map_or(rest, |(ends, _)| ends), done.collect())
    } else if verb == "operation_call" {
        let calls = changes().filter_map(|change| match &change.kind {
            ChangeKind::OperationCall { call, undo } => Some((call, undo)),
            _ => None,
        });
        let called = calls.flat_map(|(call, undo)| {
            let own = [Some(call.operation), undo.as_ref().map(|undo| undo.operation)];
            own.into_iter().flatten().chain(universe.undone_by(call.operation))
        });
        (rest.split('(').next().unwrap_or(rest), called.map(|operation| operation.to_string()).collect())
    } else {
        return None;
    };
    // As the platform compares: the text begins so, and a word ends there.
    let fits = |text: &str| text.strip_prefix(operand).is_some_and(|rest| rest.is_empty() || rest.starts_with(' '));
    if operand.is_empty() && !done.is_empty() || done.iter().any(|text| fits(text)) {
        return None;
    }
    let message = if connects {
        format!("no configuration connects or disconnects `{operand}`")
    } else {
        format!("no configuration calls `{operand}`, nor is it what undoes a call")
    };
    Some(Finding::error(SIMULATED_UNKNOWN_STEP, message).at(fault.origin).labelled("never done").help(did_you_mean(
        operand,
        "steps",
        done.iter().map(String::as_str),
    )))
}

/// Events that nobody waits for.
pub fn events(deployment: &Deployment, charts: &[&Chart]) -> Findings {
    let listeners = Listeners::new(deployment, charts);
    let is_told = |event: &str| deployment.looks_like_answer(event) || deployment.names_configuration(event);
    let forged = deployment.reactions.iter().enumerate().filter(|(_, reaction)| is_told(reaction.raise.as_str()));
    let forged = forged.filter_map(|(i, reaction)| {
        let message = deployment.never_from_outside(reaction.raise.as_str())?;
        Some(
            Finding::error(TYPE_NO_EVENT, message)
                .at(reaction.origin)
                .path(format!("simulated.reactions[{i}]"))
                .labelled("no event of a component")
                .help("let it raise an event that a component of that type raises"),
        )
    });
    let deaf = |event: EventName| !is_told(event.as_str()) && !listeners.listen_to(event);
    let told = deployment.reactions.iter().enumerate().filter(|(_, reaction)| deaf(reaction.raise));
    let unheard = told.map(|(i, reaction)| {
        let message = format!("nobody listens to `{}` of `{}`", reaction.raise, reaction.component);
        Finding::warning(SIMULATED_UNHEARD, message)
            .at(reaction.origin)
            .path(format!("simulated.reactions[{i}]"))
            .help(listeners.advice(reaction.raise))
    });
    forged.chain(unheard).collect()
}

/// What is wrong with the text of a step. A verb alone means each of its steps.
fn step(text: &str, at: Origin, universe: &Universe) -> Findings {
    let text = text.trim();
    let (verb, rest) = text.split_once(' ').map_or((text, None), |(verb, rest)| (verb, Some(rest)));
    let part = PARTS.iter().find(|(name, _)| *name == verb).map(|(_, member)| *member);
    if part.is_none() && !WHOLE.contains(&verb) {
        let known = WHOLE.into_iter().chain(PARTS.iter().map(|(name, _)| *name));
        return vec![
            Finding::error(SIMULATED_UNKNOWN_STEP, format!("`{verb}` is no step"))
                .at(at)
                .labelled("which step?")
                .help(did_you_mean(verb, "steps", known)),
        ];
    }
    let Some(rest) = rest else { return Vec::new() };
    let Some(part) = part else { return whole(at, verb, rest, universe) };
    if !matches!(verb, "connect" | "disconnect") {
        // A value or arguments follow, which nobody can know before the step is planned.
        let (operand, _) = rest.split_once([' ', '(']).unwrap_or((rest, ""));
        return member(at, verb, part, operand, universe);
    }
    let mut words = rest.split(' ');
    let mut findings = member(at, verb, part, words.next().unwrap_or_default(), universe);
    match words.next() {
        None => {}
        Some("->") => {
            findings.extend(words.next().into_iter().flat_map(|to| member(at, verb, part, to, universe)));
            let policy = words.collect::<Vec<_>>().join(" ");
            if !policy.is_empty() && (verb == "disconnect" || !policy.starts_with('(')) {
                findings.push(never(at, &policy, &format!("{verb} radio.out -> arm.in")));
            }
        }
        Some(word) => findings.push(never(at, word, &format!("{verb} radio.out -> arm.in"))),
    }
    findings
}

/// What follows is in the text of no such step.
fn never(at: Origin, word: &str, example: &str) -> Finding {
    Finding::error(SIMULATED_UNKNOWN_STEP, format!("no step is written with `{word}` there"))
        .at(at)
        .labelled("which step?")
        .help(format!("write it as `davit plan` prints steps, such as `{example}`"))
}

/// What is wrong with the component of a step that is done to it as a whole. A creation goes on with its type.
fn whole(at: Origin, verb: &str, rest: &str, universe: &Universe) -> Findings {
    let mut words = rest.split(' ');
    let operand = words.next().unwrap_or_default();
    let Ok(name) = ComponentName::new(operand) else {
        return vec![unreadable(at, operand, "a component", &format!("{verb} radio"))];
    };
    let creations = universe.of(name);
    if creations.is_empty() {
        return vec![universe.unknown_anywhere(name, at)];
    }
    match words.next() {
        None => Vec::new(),
        Some(":") if verb == "create" => Vec::new(),
        Some(word) => vec![never(at, word, &format!("{verb} {operand}"))],
    }
}

fn unreadable(at: Origin, operand: &str, what: &str, example: &str) -> Finding {
    Finding::error(SIMULATED_UNKNOWN_STEP, format!("`{operand}` is not {what}"))
        .at(at)
        .help(format!("write it as `davit plan` prints steps, such as `{example}`"))
}

/// What is wrong with a member that a step is done to.
fn member(at: Origin, verb: &str, part: MemberClass, operand: &str, universe: &Universe) -> Findings {
    let Ok(member) = MemberRef::new(operand) else {
        return vec![unreadable(at, operand, "a member of a component", &format!("{verb} radio.channel"))];
    };
    if universe.of(member.component).is_empty() {
        return vec![universe.unknown_anywhere(member.component, at)];
    }
    universe.lacks(part, member, at).into_iter().collect()
}
