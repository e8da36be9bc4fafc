//! What the deployment says that simulated components raise by themselves: do the steps and components exist, does somebody
//! listen.

use super::configurations::Member;
use super::universe::Universe;
use crate::model::codes::{SIMULATED_NOT_USED, SIMULATED_UNHEARD, SIMULATED_UNKNOWN_STEP};
use crate::model::finding::did_you_mean;
use crate::model::{ComponentName, Deployment, Finding, Findings, MemberRef, SimulatedReaction};
use crate::statechart::Chart;
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
    let mut words = reaction.after.split(' ');
    let verb = words.next().unwrap_or_default();
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
    let Some(operand) = words.next() else { return Vec::new() };
    let unreadable = |what: &str, example: &str| {
        Finding::error(SIMULATED_UNKNOWN_STEP, format!("`{operand}` is not {what}"))
            .at(reaction.origin)
            .help(format!("write it as `davit plan` prints steps, such as `{verb} {example}`"))
    };
    let Some(part) = part else {
        return match ComponentName::new(operand) {
            Err(_) => vec![unreadable("a component", "radio")],
            Ok(name) if universe.of(name).is_empty() => vec![universe.unknown(name, reaction.origin)],
            Ok(_) => Vec::new(),
        };
    };
    let Ok(member) = MemberRef::new(operand.split('(').next().unwrap_or(operand)) else {
        return vec![unreadable("a member of a component", "radio.channel")];
    };
    let creations = universe.of(member.component);
    if creations.is_empty() {
        return vec![universe.unknown(member.component, reaction.origin)];
    }
    let types = || creations.iter().filter_map(|creation| creation.description.as_ref());
    // That a type is unknown is said where it is created.
    if types().count() < creations.len() || types().any(|ty| part.of(ty).contains(&member.member.as_str())) {
        return Vec::new();
    }
    let (what, plural, code) = part.words();
    let known: BTreeSet<&str> = types().flat_map(|ty| part.of(ty)).collect();
    vec![
        Finding::error(code, format!("{} has no {what} `{}`", member.component, member.member))
            .at(reaction.origin)
            .labelled(format!("no such {what}"))
            .help(did_you_mean(member.member.as_str(), plural, known)),
    ]
}
