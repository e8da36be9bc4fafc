//! What the deployment says that simulated components raise by themselves: do the steps and components exist, does somebody
//! listen.

use super::universe::Universe;
use crate::model::codes::{SIMULATED_NOT_USED, SIMULATED_UNHEARD, SIMULATED_UNKNOWN_STEP};
use crate::model::finding::did_you_mean;
use crate::model::{ComponentName, Deployment, Finding, Findings, MemberRef, SimulatedReaction};
use crate::statechart::Chart;
use crate::system::Member;
use std::collections::BTreeSet;

/// The steps that are done to a component as a whole.
const WHOLE: [&str; 6] = ["create", "destroy", "configure", "start", "stop", "cleanup"];

/// The steps that are done to one of its members.
const PARTS: [(&str, Member); 5] = [
    ("connect", Member::Port),
    ("disconnect", Member::Port),
    ("property_set", Member::Property),
    ("port_write", Member::Port),
    ("operation_call", Member::Operation),
];

/// What is wrong with the names.
pub fn check(deployment: &Deployment, universe: &Universe) -> Findings {
    let mut findings = Vec::new();
    for (i, reaction) in deployment.reactions.iter().enumerate() {
        let mut wrong = step(reaction, universe);
        if universe.of(reaction.component).is_empty() {
            wrong.push(universe.unknown(reaction.component, reaction.origin));
        }
        findings.extend(wrong.into_iter().map(|finding| finding.path(format!("simulated.reactions[{i}]"))));
    }
    if deployment.platform.as_str() != "simulated" && !deployment.reactions.is_empty() {
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

/// Events that nobody waits for.
pub fn events(deployment: &Deployment, charts: &[&Chart]) -> Findings {
    let heard: BTreeSet<&str> = charts.iter().flat_map(|chart| chart.events()).map(|event| event.as_str()).collect();
    let confirms = |r: &SimulatedReaction| {
        deployment.configurations.iter().any(|c| c.confirm.is_some_and(|confirm| confirm.event == r.raise))
    };
    let deaf = |r: &&SimulatedReaction| !heard.contains(r.raise.as_str()) && !confirms(r);
    let told = deployment.reactions.iter().enumerate().filter(|(_, reaction)| deaf(reaction));
    told.map(|(i, reaction)| {
        let message = format!("nobody listens to `{}` of `{}`", reaction.raise, reaction.component);
        Finding::warning(SIMULATED_UNHEARD, message)
            .at(reaction.origin)
            .path(format!("simulated.reactions[{i}]"))
            .help(did_you_mean(reaction.raise.as_str(), "events", heard.iter().copied()))
    })
    .collect()
}

/// What is wrong with the step after which it happens. A verb alone means each of its steps.
fn step(reaction: &SimulatedReaction, universe: &Universe) -> Findings {
    let text = reaction.after.trim();
    let (verb, rest) = text.split_once(' ').map_or((text, None), |(verb, rest)| (verb, Some(rest)));
    let part = PARTS.iter().find(|(name, _)| *name == verb).map(|(_, member)| *member);
    if part.is_none() && !WHOLE.contains(&verb) {
        let known = WHOLE.into_iter().chain(PARTS.iter().map(|(name, _)| *name));
        return vec![
            Finding::error(SIMULATED_UNKNOWN_STEP, format!("`{verb}` is no step"))
                .at(reaction.origin)
                .labelled("after which step?")
                .help(did_you_mean(verb, "steps", known)),
        ];
    }
    let Some(rest) = rest else { return Vec::new() };
    let Some(part) = part else { return whole(reaction, verb, rest, universe) };
    if !matches!(verb, "connect" | "disconnect") {
        // A value or arguments follow, which nobody can know before the step is planned.
        let (operand, _) = rest.split_once([' ', '(']).unwrap_or((rest, ""));
        return member(reaction, verb, part, operand, universe);
    }
    let mut words = rest.split(' ');
    let mut findings = member(reaction, verb, part, words.next().unwrap_or_default(), universe);
    match words.next() {
        None => {}
        Some("->") => {
            findings.extend(words.next().into_iter().flat_map(|to| member(reaction, verb, part, to, universe)));
            let policy = words.collect::<Vec<_>>().join(" ");
            if !policy.is_empty() && (verb == "disconnect" || !policy.starts_with('(')) {
                findings.push(never(reaction, &policy, &format!("{verb} radio.out -> arm.in")));
            }
        }
        Some(word) => findings.push(never(reaction, word, &format!("{verb} radio.out -> arm.in"))),
    }
    findings
}

/// What follows is in the text of no such step.
fn never(reaction: &SimulatedReaction, word: &str, example: &str) -> Finding {
    Finding::error(SIMULATED_UNKNOWN_STEP, format!("no step is written with `{word}` there"))
        .at(reaction.origin)
        .labelled("after which step?")
        .help(format!("write it as `davit plan` prints steps, such as `{example}`"))
}

/// What is wrong with the component of a step that is done to it as a whole. A creation goes on with its type.
fn whole(reaction: &SimulatedReaction, verb: &str, rest: &str, universe: &Universe) -> Findings {
    let mut words = rest.split(' ');
    let operand = words.next().unwrap_or_default();
    let Ok(name) = ComponentName::new(operand) else {
        return vec![unreadable(reaction, operand, "a component", &format!("{verb} radio"))];
    };
    let creations = universe.of(name);
    if creations.is_empty() {
        return vec![universe.unknown(name, reaction.origin)];
    }
    match words.next() {
        None => Vec::new(),
        Some(":") if verb == "create" => Vec::new(),
        Some(word) => vec![never(reaction, word, &format!("{verb} {operand}"))],
    }
}

fn unreadable(reaction: &SimulatedReaction, operand: &str, what: &str, example: &str) -> Finding {
    Finding::error(SIMULATED_UNKNOWN_STEP, format!("`{operand}` is not {what}"))
        .at(reaction.origin)
        .help(format!("write it as `davit plan` prints steps, such as `{example}`"))
}

/// What is wrong with a member that a step is done to.
fn member(reaction: &SimulatedReaction, verb: &str, part: Member, operand: &str, universe: &Universe) -> Findings {
    let Ok(member) = MemberRef::new(operand) else {
        return vec![unreadable(reaction, operand, "a member of a component", &format!("{verb} radio.channel"))];
    };
    if universe.of(member.component).is_empty() {
        return vec![universe.unknown(member.component, reaction.origin)];
    }
    universe.lacks(part, member, reaction.origin).into_iter().collect()
}
