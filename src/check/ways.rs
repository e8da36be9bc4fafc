//! Bring-up and shutdown must work when everything goes well.

use super::closed::still_comes;
use super::drive;
use super::effort::Effort;
use super::judge::Traced;
use super::members::Member;
use super::product::Product;
use super::reactions::triggers;
use super::state::{Move, Next, ProductState};
use super::timers::Timer;
use super::trace::TraceStep;
use super::tried::{Goal, Way};
use crate::limits;
use crate::model::codes::{DEPLOY_BY_HAND, DEPLOY_LEFTOVERS, DEPLOY_NEVER_DOWN, DEPLOY_NEVER_UP, STACK_SQUASHED};
use crate::model::finding::nearest;
use crate::model::{Ask, Catalogue, Code, ConfigId, Deployment, EventName, Finding, Origin, Severity, Verdict};
use crate::stack::Request;
use crate::statechart::{Chart, NodeId};
use std::collections::BTreeSet;

/// What is wrong with the bring-up and the shutdown, with the ways to it from the start.
pub fn ways(product: &mut Product<'_>) -> Traced {
    let operator = std::mem::take(&mut product.operator);
    let ways = drive::ways(product);
    product.operator = operator;
    let Some((mut rise, mut fall)) = ways else { return Traced::new() };
    by_itself(product, &mut rise);
    fall.iter_mut().for_each(|fall| by_itself(product, fall));
    // The reasons of a refusal are findings of their own, each at its place; the stack is bounded where its limit stands.
    let deployment = product.deployment;
    let placed = |reason: Finding| match reason.code == STACK_SQUASHED {
        true if !reason.origin.is_some() => reason.at(deployment.key_origin("limits.stack")).path("limits.stack"),
        _ => reason,
    };
    let reasons = |way: &Way| {
        way.refused
            .iter()
            .filter(|_| !way.unfollowed)
            .flat_map(|(_, reasons)| reasons.clone())
            .map(placed)
            // What has none is said where it is asked for.
            .filter(|reason| reason.origin.is_some())
            .collect::<Vec<_>>()
    };
    let mut up = reasons(&rise);
    if !rise.reached && !rise.unfollowed {
        up.push(stops(product, &rise, DEPLOY_NEVER_UP, "deploy.up", |member| member.goal_up(), "the bring-up"));
    }
    up.extend(late(product, &rise, DEPLOY_NEVER_UP, "deploy.within_s", "the bring-up"));
    if rise.reached {
        up.extend(by_hand(product, &rise, true));
    }
    let mut down = fall.as_ref().map(reasons).unwrap_or_default();
    if let Some(fall) = &fall {
        down.extend(late(product, fall, DEPLOY_NEVER_DOWN, "shutdown.within_s", "the shutdown"));
        if !fall.reached {
            let stops =
                || stops(product, fall, DEPLOY_NEVER_DOWN, "shutdown.down", |member| member.down, "the shutdown");
            down.extend((!fall.unfollowed).then(stops));
        } else {
            down.extend(by_hand(product, fall, false));
            down.extend(leftovers(product, fall.end()));
        }
    }
    product.never_down = down.iter().any(|finding| finding.code == DEPLOY_NEVER_DOWN);
    let both: Vec<&Way> = std::iter::once(&rise).chain(&fall).collect();
    let mut found = Traced::new();
    for (findings, ways) in [(up, &both[..1]), (down, &both[..])] {
        // A trace costs as much as going the way again: only where something is wrong.
        let trace = if findings.is_empty() { Vec::new() } else { trace(product, ways) };
        found.extend(findings.into_iter().map(|finding| (finding, trace.clone())));
    }
    let in_this_order = rise.in_this_order || fall.as_ref().is_some_and(|fall| fall.in_this_order);
    for (finding, _) in &mut found {
        // What functions decide is not known here, and in another order it comes there.
        if in_this_order || !product.members.iter().all(|member| member.chart.is_pure()) {
            finding.severity = finding.severity.min(Severity::Warning);
        }
    }
    found
}

/// The same of a deployment and all of its subsystems, which go up and down as one. None: it was not followed, since there are too many
/// configurations, or too many ways, or since what functions raise is not known.
pub fn together(whole: &Deployment, catalogue: &Catalogue) -> Option<Traced> {
    if whole.configurations.len() > limits::CHECK_TOGETHER {
        return None;
    }
    let charts: Option<Vec<Chart>> = whole.charts().map(|chart| crate::statechart::compile(chart).0).collect();
    let charts = charts.filter(|charts| charts.iter().all(Chart::is_pure))?;
    let charts: Vec<&Chart> = charts.iter().collect();
    let mut product = Product::of_all(whole, &charts, catalogue);
    let effort = Effort { transitions: limits::CHECK_TOGETHER_WAYS, ..Effort::default() };
    product.follow_with(effort);
    product.most_driven = limits::CHECK_TOGETHER_WAYS;
    let found = ways(&mut product);
    (!product.untimed).then_some(found)
}

/// The ways one after the other, as a trace from the start.
fn trace(product: &mut Product<'_>, ways: &[&Way]) -> Vec<TraceStep> {
    let mut steps = Vec::new();
    let mut pairs: Vec<(&ProductState, &Next)> = Vec::new();
    for way in ways {
        let mut from = &way.from;
        for next in &way.moves {
            pairs.push((from, next));
            from = &next.state;
        }
    }
    if let Some(first) = ways.first() {
        steps.push(product.begins(&first.from));
    }
    let replays = product.replay(&pairs);
    steps.extend(pairs.iter().zip(replays).map(|((before, next), replay)| product.step(before, next, replay)));
    let refused = ways.last().and_then(|way| way.refused.as_ref());
    if let (Some(last), Some((request, reasons))) = (steps.last_mut(), refused) {
        let within = product.fails_within(request.ask, reasons);
        last.replay.then = Some((request.ask.failed().event(request.ask), within));
    }
    steps
}

fn stops(product: &Product<'_>, way: &Way, code: Code, key: &str, goal: Goal, what: &str) -> Finding {
    let deployment = product.deployment;
    // Those that have not arrived.
    let inside = |member: &Member<'_>, leaf| goal(member).is_some_and(|goal| member.chart.is_inside(leaf, goal));
    let all = product.members.iter().zip(&way.end().leaves);
    let short: Vec<(&Member<'_>, &NodeId)> = all.filter(|(member, leaf)| !inside(member, **leaf)).collect();
    let at = product.place(way.end());
    let rests = way.end().is_at_rest();
    let finding = match (&way.refused, way.failed) {
        (Some((request, reasons)), _) => {
            let why = reasons.first().map_or("", |f| f.message.as_str());
            let message = format!("{what} stops at `{at}`: `{}` is refused, because {why}", request.ask);
            let mut finding = Finding::error(code, message);
            for reason in reasons.iter().filter(|reason| reason.origin.is_some()).take(4) {
                finding = finding.also(reason.origin, reason.message.clone());
            }
            finding
        }
        (None, Some(by)) => {
            let message = format!("{what} comes to `{at}`, where `deploy.failed` says that it has failed");
            let leaf = product.members[by].chart.origin(way.end().leaves[by]);
            Finding::error(code, message).also(leaf, "comes here, even if every request succeeds")
        }
        (None, None) => {
            if let Some(number) = way.unheard {
                let event = if code == DEPLOY_NEVER_UP { deployment.deploy.event } else { deployment.shutdown.event };
                let (member, leaf) = (&product.members[number], way.end().leaves[number]);
                let (name, fqn) = (member.name, member.chart.fqn(leaf));
                let message = format!("{what} does not begin for `{name}`: it does not wait for `{event}` in `{fqn}`");
                // A component may raise something there that its type does not tell.
                let severity = if deployment.kind.imitates { Severity::Error } else { Severity::Warning };
                let nobody = "nor does anybody who tells it anything";
                return Finding::new(severity, code, message)
                    .also(member.chart.origin(leaf), nobody)
                    .help(format!(
                        "add a transition for `{event}` there, or let a coordinator that waits for it tell `{name}`"
                    ))
                    .at(deployment.key_origin(key))
                    .path(key);
            }
            // As its file has it.
            let written = |member: &Member<'_>| {
                let coordinator = deployment.coordinators.iter().find(|coordinator| coordinator.name == member.name);
                let up = code == DEPLOY_NEVER_UP;
                coordinator.map_or("", |of| if up { &of.up } else { &of.down })
            };
            let goals: BTreeSet<String> = short.iter().map(|(member, _)| format!("`{}`", written(member))).collect();
            let goals: Vec<String> = goals.into_iter().collect();
            let stops = if rests { "stops at" } else { "goes round for ever at" };
            let message = format!("{what} {stops} `{at}` and never reaches {}", goals.join(", "));
            let mut finding = Finding::error(code, message);
            if let Some((waits, first)) = way.overtaken {
                let why = format!("is never over: {} always comes first", product.waits_for(first));
                finding = finding.also(waits_at(product, waits), why);
            }
            for (member, leaf) in short {
                finding = finding.also(member.chart.origin(*leaf), "stops here, even if every request succeeds");
            }
            finding
        }
    };
    let help = way.refused.as_ref().and_then(|(_, reasons)| reasons.first()).and_then(|reason| reason.help.clone());
    let several = if product.members.len() > 1 {
        "one of them wait for that no other emits"
    } else {
        "the coordinator wait for at its end"
    };
    let closed = if code == DEPLOY_NEVER_DOWN { product.closed_at(way.end()) } else { Vec::new() };
    let failed =
        way.failed.map(|_| "take it out of `deploy.failed`, or let the bring-up come up without it".to_owned());
    let overtaken = way.overtaken.map(|(waits, first)| {
        let (waits, first) = (product.waits_for(waits), product.waits_for(first));
        format!(
            "what would lead on takes {waits}, and {first} always comes before: give it less time, or the other more"
        )
    });
    let untold = || untold(product, code);
    let begins = if code == DEPLOY_NEVER_UP { deployment.deploy.event } else { deployment.shutdown.event };
    let unheard = || (rests && way.refused.is_none()).then(|| unheard(product, way, begins)).flatten();
    let help = help.or(failed).or(overtaken).or_else(untold).or_else(unheard).unwrap_or_else(|| match closed.first() {
        Some(event) => still_comes(event.as_str()),
        None if way.refused.is_some() => {
            "see what is said of it, or let the coordinator ask for it elsewhere".to_owned()
        }
        None if !rests => "wait for an event or for a time (`e_after(1.0)`) somewhere on the way round".to_owned(),
        None => format!("look at the trace: which event does {several}?"),
    });
    finding.help(help).at(deployment.key_origin(key)).path(key)
}

/// What comes last on a way that stops, where no transition takes it: an answer, or what it begins with.
fn unheard(product: &Product<'_>, way: &Way, begins: EventName) -> Option<String> {
    let waits = |number: usize, event: EventName| {
        let (member, leaf) = (&product.members[number], way.end().leaves[number]);
        triggers(member.chart, leaf).0.contains(&member.chart.event(event))
    };
    let place = |number: usize| product.members[number].chart.fqn(way.end().leaves[number]);
    if way.end().leaves == way.from.leaves && !way.moves.iter().any(|next| !next.answers.is_empty()) {
        let number = (0..product.members.len()).find(|number| !waits(*number, begins))?;
        return Some(format!("no transition waits for `{begins}` in `{}`: write the one that leads on", place(number)));
    }
    let before = way.moves.len().checked_sub(2).map_or(&way.from, |at| &way.moves[at].state);
    let told = |(request, verdict): &(Request, Verdict)| {
        let number = product.member(request.requester)?;
        let event = verdict.event(request.ask);
        let stays = before.leaves[number] == way.end().leaves[number] && !waits(number, event);
        let place = place(number);
        stays.then(|| {
            format!("`{event}` comes in `{place}` at last, and no transition waits for it there: write the one that leads on")
        })
    };
    way.moves.last()?.answers.iter().find_map(told)
}

/// A way that goes on, and does not arrive, only after something safe was asked for, or to where the bring-up has failed after people have raised
/// something, stops before that by itself.
fn by_itself(product: &Product<'_>, way: &mut Way) {
    if way.reached || way.refused.is_some() || way.overtaken.is_some() {
        return;
    }
    let deployment = product.deployment;
    let failed = way.failed.is_some();
    let before = std::iter::once(&way.from).chain(way.moves.iter().map(|next| &next.state));
    let led_off = |(state, next): (&ProductState, &Next)| {
        // What begins or ends the deployment may ask for something safe itself.
        let Move::Event(at) = next.by else { return false };
        if product.is_first_or_last(next.by) {
            return false;
        }
        let name = product.outside[usize::from(at)];
        let by_people = || product.raised_by_hand(state, next.by).is_some();
        let safety = deployment.safety.iter().any(|(event, _)| *event == name);
        safety || !next.state.safe.is_empty() || failed && by_people()
    };
    if let Some(at) = before.zip(&way.moves).position(led_off) {
        way.moves.truncate(at);
        way.failed = None;
    }
}

/// That the way up, or down, goes on only when somebody raises an event: nothing in the deployment does. Mostly it is misspelt.
fn by_hand(product: &Product<'_>, way: &Way, up: bool) -> Option<Finding> {
    let deployment = product.deployment;
    let begins = if up { deployment.deploy.event } else { deployment.shutdown.event };
    let before = std::iter::once(&way.from).chain(way.moves.iter().map(|next| &next.state));
    let (state, event) = before.zip(&way.moves).find_map(|(state, next)| {
        let event = product.raised_by_hand(state, next.by)?;
        (event != begins).then_some((state, event))
    })?;
    let place = product.place(state);
    let hears = product.listens(state, event);
    let leaf = hears.map_or(Origin::NONE, |number| product.members[number].chart.origin(state.leaves[number]));
    let (what, key) = if up { ("bring-up", "deploy.up") } else { ("shutdown", "shutdown.event") };
    let message = format!("the {what} waits in `{place}` for `{event}`, which nothing here raises");
    let may_be = may_be(deployment);
    let near = nearest(event.as_str(), may_be.iter().map(String::as_str));
    let answer = near.map_or_else(
        || "is it an answer, as `ID.ok`, that leads on?".to_owned(),
        |near| format!("did you mean `{near}`?"),
    );
    let help = match up {
        true => format!(
            "{answer} If people raise it, name in `deploy.up` where it waits for them; else it fails {} s after `{begins}`",
            deployment.deploy.within.as_secs_f64()
        ),
        false => format!(
            "{answer} If people raise it, let a time lead on as well (`e_after(1.0)`); else it is taken down without the coordinator {} s after \
             `{begins}`",
            deployment.shutdown.within.as_secs_f64()
        ),
    };
    let finding = Finding::warning(DEPLOY_BY_HAND, message).help(help);
    Some(finding.also(leaf, "waits here").at(deployment.key_origin(key)).path(key))
}

/// What may be meant where nothing raises what is waited for: answers, and what the deployment accepts.
fn may_be(deployment: &Deployment) -> Vec<String> {
    let answers = |id: ConfigId| {
        let of = |ask: Ask, well: Verdict| [well.event(ask), ask.failed().event(ask), ask.broken().event(ask)];
        of(Ask::Apply(id), Verdict::Ok).into_iter().chain(of(Ask::UndoOf(id), Verdict::Undone))
    };
    let answers = deployment.named_configurations().flat_map(|configuration| answers(configuration.id));
    let accepted = deployment.interface.accepts.iter().map(|(event, _)| *event);
    answers.chain(accepted).map(|event| event.to_string()).collect()
}

/// The subsystems that nobody ever tells what begins them, or ends them: what to do about it. Of one file only its own are asked for.
fn untold(product: &Product<'_>, code: Code) -> Option<String> {
    let deployment = product.deployment;
    let whole = deployment.own.is_some();
    let subsystems = deployment.all_subsystems().into_iter();
    let subsystems = subsystems.filter(|(path, _)| whole || deployment.subsystems.iter().any(|own| own.name == *path));
    let all = subsystems.map(|(path, subsystem)| {
        let own = &subsystem.own;
        let event = if code == DEPLOY_NEVER_UP { own.deploy.event } else { own.shutdown.event };
        (path, event.within(path))
    });
    let does = if code == DEPLOY_NEVER_UP { "begins" } else { "ends" };
    let untold = all.filter(|(_, event)| !deployment.charts().any(|chart| chart.raises(event.as_str()))).take(4);
    let untold: Vec<String> = untold.map(|(path, event)| format!("`{event}`, which {does} `{path}`")).collect();
    (!untold.is_empty()).then(|| format!("no coordinator raises {}: raise it on the way", untold.join(", nor ")))
}

/// A way that lasts longer than there is time for it, where none is shorter.
fn late(product: &Product<'_>, way: &Way, code: Code, key: &str, what: &str) -> Option<Finding> {
    let (lasts, times) = way.late.as_ref()?;
    let deployment = product.deployment;
    let within = if code == DEPLOY_NEVER_UP { deployment.deploy.within } else { deployment.shutdown.within };
    let mut words: Vec<String> = times.iter().map(|timer| product.waits_for(*timer)).collect();
    let more = if words.len() > 4 { format!(" and {} more", words.len() - 4) } else { String::new() };
    words.truncate(4);
    let message = format!(
        "{what} lasts {} s at least ({}{more}), and `{key}` gives it {} s",
        lasts.as_secs_f64(),
        words.join(", "),
        within.as_secs_f64()
    );
    let mut finding = Finding::error(code, message);
    for timer in times.iter().take(4) {
        finding = finding.also(waits_at(product, *timer), "waits here, even if every request is answered at once");
    }
    let help = format!("give it more time with `{key}`, or let something lead on sooner");
    Some(finding.help(help).at(deployment.key_origin(key)).path(key))
}

/// Where something is written that takes time.
fn waits_at(product: &Product<'_>, timer: Timer) -> Origin {
    match timer {
        Timer::Time(number, _) => product.members[number].chart.origin(product.waits_at(timer).unwrap_or(NodeId::ROOT)),
        Timer::Stands(id) | Timer::Reverts(id) => {
            product.worlds.configuration(id).map(|c| c.origin).unwrap_or_default()
        }
        Timer::Reports(at) => product.deployment.reactions[at].origin,
    }
}

fn leftovers(product: &Product<'_>, end: &ProductState) -> Option<Finding> {
    let mut left: Vec<String> = product.there(end).iter().map(ToString::to_string).collect();
    if left.is_empty() {
        return None;
    }
    let more = if left.len() > 6 { format!(" and {} more", left.len() - 6) } else { String::new() };
    left.truncate(6);
    let message = format!("the shutdown leaves {}{more} behind", left.join(", "));
    let finding = Finding::error(DEPLOY_LEFTOVERS, message)
        .at(product.deployment.key_origin("shutdown.down"))
        .path("shutdown.down")
        .help("let the coordinator undo what it applied, or apply a configuration that destroys what is left");
    Some(finding)
}
