//! States that no sequence of events comes to though transitions lead to them: what these wait for is never told where they begin. A name that was
//! written for another one does that (`hurry: { config: fast }`, and `fast.ok` in the place of `e_fast`), and no single transition shows it.

use super::explore::Graph;
use super::judge::Traced;
use crate::model::codes::COORD_NEVER_ENTERED;
use crate::model::{ConfigId, EventName, Finding, Severity};
use crate::statechart::{EventId, NodeId};
use rustc_hash::FxHashSet;
use std::collections::BTreeSet;

impl Graph<'_, '_> {
    /// What is never entered in all that was followed: the first states on each way there. Where something was left out they may be entered in that.
    pub(super) fn never_entered(&mut self, found: &mut Traced) {
        if self.is_cut_off() || self.product.knows_less() {
            return;
        }
        // A subsystem's file is written for other parents, too.
        let known = self.bounds.is_empty() && self.product.parent.is_none();
        let asked = self.product.worlds.asked().clone();
        for number in 0..self.product.members.len() {
            let entered = self.entered(number);
            let member = &self.product.members[number];
            let chart = member.chart;
            if !chart.is_pure() {
                continue;
            }
            let missing = chart.nodes().filter(|node| chart.is_state(*node) && !entered[node.index()]);
            for node in missing {
                // The outermost of them, and only what something leads to from where it comes.
                let outermost = chart.parent(node).is_none_or(|parent| entered[parent.index()]);
                let edges = chart.nodes().filter(|from| entered[from.index()]).flat_map(|from| chart.outgoing(from));
                let leading: Vec<_> = edges.filter(|edge| chart.is_inside(chart.ends(*edge).1, node)).collect();
                let Some(first) = leading.first().filter(|_| outermost) else { continue };
                // What nobody asks for but who is there already is a slip; that something does not come that was to be heard in time is prudence.
                let name = |event: &EventId| member.name_of(*event);
                let mut names =
                    leading.iter().flat_map(|edge| chart.triggers(*edge).unwrap_or_default()).filter_map(name);
                let ids = self.product.deployment.configurations.iter().map(|configuration| configuration.id);
                let unasked: Vec<ConfigId> = ids.filter(|id| !asked.contains(id)).collect();
                let answers = |name: EventName| {
                    let of = |id: &ConfigId| {
                        name.as_str().strip_prefix(id.as_str()).is_some_and(|rest| rest.starts_with('.'))
                    };
                    unasked.iter().any(of)
                };
                let slip = known && !leading.is_empty() && names.all(answers);
                let severity = if slip { Severity::Warning } else { Severity::Info };
                let events = leading.iter().flat_map(|edge| chart.triggers(*edge).unwrap_or_default());
                let events: BTreeSet<String> = events.map(|event| format!("`{}`", chart.event_text(*event))).collect();
                let events: Vec<String> = events.into_iter().collect();
                let fqn = chart.fqn(node).to_string();
                let message = match &events[..] {
                    [] => {
                        format!("`{fqn}` is never entered: another transition is taken before the one that leads there")
                    }
                    events => format!(
                        "`{fqn}` is never entered: {} never comes where that would lead there",
                        events.join(" or ")
                    ),
                };
                let finding = Finding::new(severity, COORD_NEVER_ENTERED, message)
                    .at(chart.origin(node))
                    .path(format!("coordinator.{fqn}"))
                    .also(chart.edge_origin(*first), "leads there")
                    .help("have that transition wait for what does come there, or take the state out");
                found.push((finding, Vec::new()));
            }
        }
    }

    /// Which nodes of a coordinator were entered, also to be left at once.
    fn entered(&mut self, number: usize) -> Vec<bool> {
        let leaves: FxHashSet<NodeId> = self.reached.states.iter().map(|state| state.leaves[number]).collect();
        let member = &mut self.product.members[number];
        let first = member.enter().into_iter().flat_map(|first| first.left);
        let passed: Vec<NodeId> = first.chain(member.passed(&leaves)).collect();
        let chart = member.chart;
        let mut entered = vec![false; chart.nodes().len()];
        for node in leaves.into_iter().chain(passed) {
            let mut at = Some(node);
            while let Some(own) = at.filter(|own| !std::mem::replace(&mut entered[own.index()], true)) {
                at = chart.parent(own);
            }
        }
        // A connector is passed, if at all, where what it is in is entered.
        for node in chart.nodes().filter(|node| !chart.is_state(*node)) {
            entered[node.index()] = chart.parent(node).is_none_or(|parent| entered[parent.index()]);
        }
        entered
    }
}
