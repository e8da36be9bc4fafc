//! The coordinator against the deployment: what it asks for, what it waits for, which states the deployment names.

use super::paths;
use super::slips::KnownEvents;
use crate::model::codes::{
    COORD_ANSWER_NEVER_COMES, COORD_NEVER_EMITTED, COORD_UNKNOWN_ANSWER, COORD_UNKNOWN_REQUEST, DEPLOY_EVENT_UNHEARD,
    DEPLOY_UNKNOWN_STATE,
};
use crate::model::event::UNDO;
use crate::model::finding::{and_also, did_you_mean, nearest};
use crate::model::statechart::is_internal;
use crate::model::{Ask, ConfigId, Deployment, EventName, Finding, Findings, Raise, Verdict};
use crate::statechart::{Chart, EdgeId, EventId, FindError, NodeId, RaiseMoment};
use std::collections::BTreeSet;

/// What a raised name asks for; none when it is no request.
pub fn ask_of(deployment: &Deployment, name: EventName) -> Option<Ask> {
    match Raise::of(name, |id| deployment.configuration(id).is_some()) {
        Raise::Request(ask) => Some(ask),
        Raise::UnknownUndo | Raise::Event => None,
    }
}

/// The answers to `ask` that need somebody to hear them.
pub fn bad_answers(ask: Ask) -> [EventName; 2] {
    [ask.failed().event(ask), ask.broken().event(ask)]
}

/// What is wrong between the coordinator and the deployment.
pub fn check(deployment: &Deployment, chart: &Chart, known: &KnownEvents<'_>) -> Findings {
    let mut findings = Vec::new();
    states(deployment, chart, &mut findings);
    raised(deployment, chart, known, &mut findings);
    heard(deployment, chart, known, &mut findings);
    findings
}

fn states(deployment: &Deployment, chart: &Chart, findings: &mut Findings) {
    let mut named = vec![
        ("deploy.up".to_owned(), &deployment.first_coordinator().up),
        ("shutdown.down".to_owned(), &deployment.first_coordinator().down),
    ];
    named.extend(
        deployment.first_coordinator().failed.iter().enumerate().map(|(i, s)| (format!("deploy.failed[{i}]"), s)),
    );
    for (key, state) in named {
        if let Err(error) = chart.find(state) {
            let at = deployment.key_origins.get(&key).copied();
            let at = at.unwrap_or_else(|| deployment.key_origin(key.split('[').next().unwrap_or(&key)));
            let names: Vec<String> =
                chart.nodes().filter(|n| chart.is_state(*n)).map(|n| chart.name(n).to_string()).collect();
            let own = state.rsplit('.').next().unwrap_or(state);
            let (message, help) = match &error {
                FindError::Unknown { name, .. } => (
                    format!("{key}: the coordinator has no state `{name}`"),
                    did_you_mean(own, "states", names.iter().map(String::as_str)),
                ),
                FindError::Ambiguous { .. } => (format!("{key}: {error}"), "write one of these names".to_owned()),
            };
            findings.push(
                Finding::error(DEPLOY_UNKNOWN_STATE, message)
                    .at(at)
                    .path(key)
                    .also(deployment.first_coordinator().chart.root.origin, "the coordinator")
                    .help(help),
            );
        }
    }
    for (key, event) in [("deploy.event", deployment.deploy.event), ("shutdown.event", deployment.shutdown.event)] {
        if !listens(chart, event) {
            let heard: Vec<&str> = outside_events(deployment, chart).into_iter().map(|e| e.as_str()).collect();
            findings.push(
                Finding::error(
                    DEPLOY_EVENT_UNHEARD,
                    format!("{key}: no transition of the coordinator waits for `{event}`"),
                )
                .at(deployment.key_origin(key))
                .path(key)
                .also(deployment.first_coordinator().chart.root.origin, "the coordinator")
                .help(did_you_mean(event.as_str(), "events", heard)),
            );
        }
    }
}

/// Whether some transition lists `event`.
fn listens(chart: &Chart, event: EventName) -> bool {
    chart.events().contains(&event)
}

/// Events that transitions list and that can only come from components, operators or other deployments.
pub fn outside_events(deployment: &Deployment, chart: &Chart) -> Vec<EventName> {
    let answers = answers(deployment, chart);
    chart
        .events()
        .iter()
        .copied()
        .filter(|e| !answers.contains(e) && deployment.never_from_outside(e.as_str()).is_none())
        .collect()
}

/// All answers to what the chart asks for, and what it is told about that later.
pub fn answers(deployment: &Deployment, chart: &Chart) -> BTreeSet<EventName> {
    let asks = chart.raises().iter().filter_map(|site| ask_of(deployment, site.name));
    let mut answers: BTreeSet<EventName> = asks.flat_map(answers_to).collect();
    // Told in whatever state it is, whoever asked.
    let holds = deployment.configurations.iter().filter(|c| c.holds.is_some());
    answers.extend(holds.map(|c| Verdict::Lost.event(Ask::Apply(c.id))));
    answers
}

/// The names under which these configurations may be meant by a name.
fn asked_for(ids: &[&str], name: &str) -> Vec<String> {
    // `run.udno` and `run_undo` are nearer to what undoes `run` than to `run`.
    let undos = ids
        .iter()
        .filter(|_| name.contains('.') || name.contains(UNDO.trim_start_matches('.')))
        .map(|id| format!("{id}.undo"));
    ids.iter().map(|id| (*id).to_owned()).chain(undos).collect()
}

fn raised(deployment: &Deployment, chart: &Chart, known: &KnownEvents<'_>, findings: &mut Findings) {
    let ids: Vec<&str> = deployment.named_configurations().map(|c| c.id.as_str()).collect();
    let mut unknown = BTreeSet::new();
    let emits: BTreeSet<EventName> = deployment.emits.iter().map(|(e, _)| *e).collect();
    for site in chart.raises() {
        let name = site.name.as_str();
        if !site.scoped && Verdict::split(name).is_some() && deployment.looks_like_answer(name) {
            // Another coordinator that waits for it would be told what has not happened.
            let message = format!("`{}` is an answer: it comes to who asked, and nobody raises it", site.name);
            let finding = Finding::error(COORD_UNKNOWN_REQUEST, message).at(site.origin).labelled("raised here");
            let help = "raise an event of its own, which the other coordinator waits for";
            findings.push(finding.path(place(chart, site.when)).help(help));
            continue;
        }
        let is_known = match Raise::of(site.name, |id| ids.contains(&id.as_str())) {
            Raise::Request(_) => true,
            Raise::UnknownUndo => false,
            // What a state has as its `config` is a configuration, whatever is emitted.
            Raise::Event => emits.contains(&site.name) && !site.scoped,
        };
        // The undo of a state-scoped configuration was not written by anybody; its entry is reported.
        if is_known || (site.scoped && matches!(site.when, RaiseMoment::Exit(_))) {
            continue;
        }
        unknown.insert(site.name);
        if let Some(finding) = paths::raised(deployment, site.name) {
            findings.push(finding.at(site.origin).labelled("raised here").path(place(chart, site.when)));
            continue;
        }
        let (id, undo) = site.name.as_str().strip_suffix(".undo").map_or((site.name.as_str(), ""), |id| (id, ".undo"));
        let may_be_event = undo.is_empty() && !site.scoped;
        let (asked_for, emitted) = (asked_for(&ids, id), emits.iter().map(|e| e.as_str()).filter(|_| may_be_event));
        let what = if may_be_event { "configurations and events" } else { "configurations" };
        let help = did_you_mean(id, what, asked_for.iter().map(String::as_str).chain(emitted));
        let message = if site.scoped || !undo.is_empty() {
            format!("there is no configuration `{id}`")
        } else {
            format!("`{}` is neither a configuration nor an event that the deployment emits", site.name)
        };
        // Either of the two may be the slip.
        let unraised = deployment.emits.iter().filter(|(event, _)| !chart.raises().iter().any(|s| s.name == *event));
        let unraised: Vec<_> = unraised.filter(|_| may_be_event).collect();
        let near = nearest(id, unraised.iter().map(|(event, _)| event.as_str()));
        let other = unraised.iter().find(|(event, _)| near == Some(event.as_str()));
        let finding = Finding::error(COORD_UNKNOWN_REQUEST, message)
            .at(site.origin)
            .labelled("raised here")
            .path(place(chart, site.when));
        findings.push(
            match other {
                Some((event, at)) => finding.also(*at, format!("nothing raises `{event}`")),
                None => finding.also(deployment.key_origin("configurations"), "the configurations of the deployment"),
            }
            .help(match known.waited_for_as(id).filter(|_| may_be_event) {
                Some(near) => format!("did you mean `{near}`, which is waited for and nobody raises?"),
                None if id.contains('.') || !may_be_event => help,
                None if other.is_some() => and_also(&help, &format!("else list `{id}` under `emits`")),
                None => and_also(&help, "an event that is meant to leave the deployment is listed under `emits`"),
            }),
        );
    }
    let raised: BTreeSet<EventName> = chart.raises().iter().map(|s| s.name).collect();
    for (event, origin) in &deployment.emits {
        if !raised.contains(event) {
            let known: Vec<&str> = raised.iter().map(|e| e.as_str()).collect();
            let near = nearest(event.as_str(), known);
            // Where that is nothing that there is, it is said there what was meant.
            if near.is_some_and(|near| unknown.iter().any(|name| name.as_str() == near)) {
                continue;
            }
            let near = near.map_or_else(
                || "raise it in the coordinator, or leave it out".to_owned(),
                |near| format!("did you mean `{near}`?"),
            );
            findings.push(
                Finding::warning(COORD_NEVER_EMITTED, format!("nothing in the coordinator raises `{event}`"))
                    .at(*origin)
                    .path("emits")
                    .help(near),
            );
        }
    }
}

fn heard(deployment: &Deployment, chart: &Chart, known: &KnownEvents<'_>, findings: &mut Findings) {
    let answers = answers(deployment, chart);
    let ids: Vec<&str> = deployment.named_configurations().map(|c| c.id.as_str()).collect();
    let mut said: BTreeSet<EventName> = BTreeSet::new();
    for edge in edges(chart) {
        for trigger in chart.triggers(edge).unwrap_or(&[]) {
            let text = chart.event_text(*trigger);
            let Ok(event) = EventName::new(&text) else { continue };
            if is_internal(&text) || answers.contains(&event) || known.is_known(&text) || !said.insert(event) {
                continue;
            }
            let at = chart.edge_origin(edge);
            if let Some(finding) = known.never_raised(&text) {
                findings.push(finding.at(at).labelled("waits for it"));
                continue;
            }
            if let Some(near) = paths::dotted(deployment, &text) {
                let message = format!("`{event}` is no event: what a subsystem tells has its path before it");
                let finding = Finding::error(COORD_UNKNOWN_ANSWER, message).at(at).labelled("waits for it");
                findings.push(finding.help(format!("did you mean `{near}`?")));
                continue;
            }
            if deployment.names_configuration(&text) {
                let message = format!("`{event}` is a configuration, and no event: nobody raises it");
                let finding = Finding::error(COORD_UNKNOWN_ANSWER, message).at(at).labelled("waits for it");
                findings.push(finding.help(format!("did you mean `{event}.ok`, which answers it?")));
                continue;
            }
            if !deployment.looks_like_answer(&text) {
                let near = known.near(event, listed(chart, *trigger));
                findings.extend(near.map(|finding| finding.at(at).labelled("waits for it")));
                continue;
            }
            let (id, suffix) = Verdict::split(&text).unwrap_or_else(|| text.rsplit_once('.').unwrap_or((&text, "")));
            let id = id.strip_suffix(".undo").unwrap_or(id);
            let bare = id == Ask::Undo.subject();
            let exists = bare || ConfigId::new(id).is_ok_and(|id| deployment.configuration(id).is_some());
            if !exists {
                findings.push(
                    Finding::error(
                        COORD_UNKNOWN_ANSWER,
                        format!("`{event}` answers nothing: there is no configuration `{id}`"),
                    )
                    .at(at)
                    .labelled("waits for it")
                    .also(deployment.key_origin("configurations"), "the configurations of the deployment")
                    .help(match nearest(id, asked_for(&ids, id).iter().map(String::as_str)) {
                        Some(near) => answer_meant(deployment, near, &text[id.len()..]),
                        None => did_you_mean(id, "configurations", ids.iter().copied()),
                    }),
                );
            } else if Verdict::ENDINGS.iter().any(|s| s.trim_start_matches('.') == suffix.trim_start_matches('.')) {
                let undo = text.contains(".undo") || text.ends_with(".undone");
                let what = if undo && !bare { format!("{id}.undo") } else { id.to_owned() };
                let asked = chart.raises().iter().find(|site| site.name.as_str() == what);
                let (why, help) = match asked.and_then(|site| ask_of(deployment, site.name)) {
                    Some(ask) => {
                        let answers = ask.verdicts().iter().map(|verdict| format!("`{}`", verdict.event(ask)));
                        let answers = answers.collect::<Vec<_>>().join(", ");
                        (format!("`{what}` is not answered so"), format!("`{what}` is answered {answers}"))
                    }
                    None => (
                        format!("the coordinator does not ask for `{what}`"),
                        format!(
                            "raise `{what}` where it is wanted, or leave the event out: answers go to whoever asked"
                        ),
                    ),
                };
                findings.push(
                    Finding::warning(COORD_ANSWER_NEVER_COMES, format!("`{event}` never comes: {why}"))
                        .at(at)
                        .help(help),
                );
            } else {
                findings.push(
                    Finding::error(COORD_UNKNOWN_ANSWER, format!("`{event}` is no answer of a configurator"))
                        .at(at)
                        .labelled("waits for it")
                        .help(answer_meant(
                            deployment,
                            text[..text.len() - suffix.len()].trim_end_matches('.'),
                            suffix,
                        )),
                );
            }
        }
    }
}

/// Which answer to what is asked for, or to its undo, may have been meant, where what stands behind that is none.
fn answer_meant(deployment: &Deployment, asked: &str, rest: &str) -> String {
    let ask = EventName::new(asked).ok().and_then(|name| ask_of(deployment, name));
    let undo = ask.and_then(|ask| if let Ask::Apply(id) = ask { Some(Ask::UndoOf(id)) } else { None });
    let answers: Vec<String> =
        ask.into_iter().chain(undo).flat_map(|ask| answers_to(ask).map(|event| event.to_string())).collect();
    let whole = format!("{asked}.{}", rest.trim_start_matches('.'));
    // An undo is no `ok`, but it is what it would be called.
    let done = whole.strip_suffix(".undo.ok").or_else(|| whole.strip_suffix(".undo.done"));
    let undone = done.map(|of| format!("{of}{}", Verdict::Undone.ending(false)));
    match nearest(&whole, answers.iter().map(String::as_str)) {
        _ if answers.contains(&whole) => format!("did you mean `{whole}`?"),
        _ if undone.as_ref().is_some_and(|undone| answers.contains(undone)) => {
            format!("did you mean `{}`?", undone.unwrap_or_default())
        }
        Some(near) => format!("did you mean `{near}`?"),
        None => did_you_mean(&whole, "answers", answers.iter().map(String::as_str)),
    }
}

fn answers_to(ask: Ask) -> impl Iterator<Item = EventName> {
    ask.verdicts().iter().map(move |verdict| verdict.event(ask))
}

/// How many transitions list an event.
fn listed(chart: &Chart, event: EventId) -> usize {
    edges(chart).filter(|edge| chart.triggers(*edge).is_some_and(|triggers| triggers.contains(&event))).count()
}

/// Every transition of the chart.
pub fn edges(chart: &Chart) -> impl Iterator<Item = EdgeId> + '_ {
    chart.nodes().flat_map(|node| chart.outgoing(node))
}

/// Where a name is raised, as a path of the model.
pub fn place(chart: &Chart, when: RaiseMoment) -> String {
    match when {
        RaiseMoment::Entry(node) => format!("coordinator.{}.entry", chart.fqn(node)),
        RaiseMoment::Exit(node) => format!("coordinator.{}.exit", chart.fqn(node)),
        RaiseMoment::Effect(edge) => {
            let (from, to): (NodeId, NodeId) = chart.ends(edge);
            format!("coordinator.{} -> {}", chart.fqn(from), chart.fqn(to))
        }
    }
}
