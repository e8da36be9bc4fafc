//! Between a parent and a subsystem that waits to be let go, by the texts alone: what lets it go comes, and not in the step that ends it where
//! that is too early. That it is lost elsewhere is found by following the parent ([`promises`](super::promises)).

use super::reactions::{Macrostep, Reactions};
use crate::model::codes::COMPOSE_UNLEFT;
use crate::model::{Deployment, EventName, Finding, Findings, Subsystem};
use crate::stack::Requester;
use crate::statechart::{Chart, EventId, NodeId, RaiseSite, compile};
use rustc_hash::FxHashSet;

/// What is wrong with how a deployment lets a subsystem go. `charts` are its own.
pub fn check(own: &Deployment, subsystem: &Subsystem, charts: &[&Chart]) -> Findings {
    let finding = never(subsystem, charts).or_else(|| too_early(own, subsystem, charts));
    finding.into_iter().collect()
}

fn raised<'c>(charts: &'c [&Chart], event: EventName) -> Option<&'c RaiseSite> {
    charts.iter().flat_map(|chart| chart.raises()).find(|site| site.name == event)
}

/// It is ended, and nobody lets it go.
fn never(subsystem: &Subsystem, charts: &[&Chart]) -> Option<Finding> {
    let until = subsystem.own.interface.leaving?.until.within(subsystem.name);
    let ends = subsystem.own.shutdown.event.within(subsystem.name);
    let site = raised(charts, ends).filter(|_| raised(charts, until).is_none())?;
    let message =
        format!("`{ends}` is raised and `{until}` never: `{}` waits for that before it goes down", subsystem.name);
    Some(
        Finding::warning(COMPOSE_UNLEFT, message)
            .at(site.origin)
            .help(format!("raise `{until}` when nothing of what it exports is held any more")),
    )
}

/// It is let go in the step that ends it, and does not wait for that at once: what comes before is lost.
fn too_early(own: &Deployment, subsystem: &Subsystem, charts: &[&Chart]) -> Option<Finding> {
    let leaving = subsystem.own.interface.leaving?;
    let (until, says) = (leaving.until.within(subsystem.name), leaving.says.within(subsystem.name));
    let (end, site) = (subsystem.own.shutdown.event, raised(charts, until)?);
    let ends = end.within(subsystem.name);
    let both = |step: &Macrostep| step.emits(ends) && step.emits(until);
    let together = charts.iter().any(|chart| {
        let mut reactions = Reactions::new(own, chart, &[], Requester::Operator, None);
        let Some(first) = reactions.enter() else { return false };
        let mut some = both(&first);
        follow(chart, &mut reactions, first.leaf, &[], |step| some |= both(step));
        some
    });
    if !together || !waits_later(&subsystem.own, leaving.until) {
        return None;
    }
    let path = subsystem.name;
    let message = format!(
        "`{until}` is raised with `{ends}`: `{path}` does not wait for it at once after `{end}`, and what comes \
         before is lost"
    );
    let help = format!(
        "raise `{until}` when `{says}` was heard, or let `{path}` wait for `{}` as the first thing after `{end}`",
        leaving.until
    );
    Some(Finding::warning(COMPOSE_UNLEFT, message).at(site.origin).also(subsystem.origin, "the subsystem").help(help))
}

/// Whether the event that ends a deployment leads somewhere from where it comes to wait for `until`, and does not yet.
fn waits_later(own: &Deployment, until: EventName) -> bool {
    own.charts().filter_map(|chart| compile(chart).0).any(|chart| {
        let (until, ends, begins) =
            (chart.event(until), chart.event(own.shutdown.event), chart.event(own.deploy.event));
        let mut reactions = Reactions::new(own, &chart, &[], Requester::Operator, None);
        let Some(first) = reactions.enter() else { return false };
        let all = follow(&chart, &mut reactions, first.leaf, &[], |_| {});
        let after: FxHashSet<NodeId> = all
            .into_iter()
            .filter_map(|leaf| Some(reactions.react(leaf, ends)).filter(|step| step.taken).map(|step| step.leaf))
            .collect();
        until != EventId::OTHER
            && after.into_iter().any(|leaf| {
                let mut waits = |leaf: &NodeId| reactions.react(*leaf, until).taken;
                !waits(&leaf) && {
                    let later = follow(&chart, &mut reactions, leaf, &[until, ends, begins], |_| {});
                    later.iter().any(|leaf| reactions.react(*leaf, until).taken)
                }
            })
    })
}

/// The leaves that a coordinator may come to, but for these events; `sees` is told each step on the way.
fn follow(
    chart: &Chart,
    reactions: &mut Reactions<'_>,
    from: NodeId,
    but: &[EventId],
    mut sees: impl FnMut(&Macrostep),
) -> Vec<NodeId> {
    let events: Vec<EventId> = chart.events().iter().map(|event| chart.event(*event)).collect();
    let (mut all, mut met) = (vec![from], FxHashSet::from_iter([from]));
    let mut at = 0;
    while let Some(leaf) = all.get(at).copied() {
        at += 1;
        let timed = reactions.offers(leaf);
        for event in events.iter().chain(timed.iter()).filter(|event| !but.contains(event)) {
            let step = reactions.react(leaf, *event);
            sees(&step);
            if met.insert(step.leaf) {
                all.push(step.leaf);
            }
        }
    }
    all
}
