//! What is said of a state from which nothing leads on.

use super::coordinator::{answers, ask_of};
use super::product::Product;
use super::reactions::triggers;
use crate::model::codes::COORD_STUCK;
use crate::model::{Ask, EventName, Finding, Verdict};
use crate::statechart::{NodeId, RaiseMoment};
use std::collections::BTreeSet;

impl Product<'_> {
    /// That nothing leads on from a state, and what would. What it does already is no help.
    pub(super) fn nothing_leads_on(&self, leaf: NodeId) -> Finding {
        let (member, deployment) = (&self.members[0], self.deployment);
        let (chart, fqn) = (member.chart, member.chart.fqn(leaf).to_string());
        let awaited = answers(deployment, chart);
        let names: BTreeSet<EventName> = triggers(chart, leaf).0.iter().filter_map(|e| member.name_of(*e)).collect();
        let listed = |names: &mut dyn Iterator<Item = EventName>| {
            names.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
        };
        let waits = listed(&mut names.intersection(&awaited).copied());
        // What it asks for itself, and hears another answer to.
        let entered = |site: &&crate::statechart::RaiseSite| matches!(site.when, RaiseMoment::Entry(node) if chart.is_inside(leaf, node));
        let asks = chart.raises().iter().filter(entered).filter_map(|site| ask_of(deployment, site.name));
        // What still waits when a safe configuration comes is cancelled.
        let cancels = deployment.configurations.iter().any(|configuration| configuration.safe);
        let told = |ask: Ask| {
            let cancelled = (cancels && !ask.is_undo()).then_some(Verdict::Cancelled);
            let ends = [ask.done(), ask.failed(), ask.broken()].into_iter().chain(cancelled);
            ends.map(|verdict| verdict.event(ask)).collect::<Vec<_>>()
        };
        let own: Vec<Ask> = asks.filter(|ask| told(*ask).iter().any(|answer| names.contains(answer))).collect();
        let unhandled: BTreeSet<EventName> =
            own.iter().flat_map(|ask| told(*ask)).filter(|answer| !names.contains(answer)).collect();
        let finding = if waits.is_empty() {
            let shutdown = deployment.shutdown.event;
            let help = match names.contains(&shutdown) {
                // Else it would be followed: what stands behind a connector wants another event.
                true => format!(
                    "`{shutdown}` alone takes no transition from it all the way: behind the connector that it leads to another event \
                     is waited for, and there is one event a step; let it lead to a state"
                ),
                false => format!("add a transition from it, at least on `{shutdown}`"),
            };
            Finding::warning(COORD_STUCK, format!("nothing leads on from `{fqn}`")).help(help)
        } else if !unhandled.is_empty() {
            let asked = own.iter().map(|ask| format!("`{ask}`")).collect::<Vec<_>>().join(", ");
            let message = format!("nothing leads on from `{fqn}`: {asked} is answered otherwise than with {waits}");
            let unhandled = listed(&mut unhandled.into_iter());
            Finding::warning(COORD_STUCK, message)
                .help(format!("add a transition on the answers that it does not hear: {unhandled}"))
        } else {
            let message = format!(
                "what `{fqn}` waits for never comes: {waits}, for on this way nothing is asked for that would be answered so"
            );
            Finding::warning(COORD_STUCK, message).help(
                "ask for it on the entry of the state, so that it is asked for on every way there; or add a transition on \
                 an event from outside",
            )
        };
        finding.at(chart.origin(leaf)).path(format!("coordinator.{fqn}"))
    }
}
