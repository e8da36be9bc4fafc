//! Whether every way leads down, and what it leaves behind.

use super::bound::Bound;
use super::explore::{Edge, Graph};
use super::judge::Traced;
use super::product::Product;
use super::state::{Failed, State};
use crate::model::codes::{COORD_LEFTOVERS, COORD_NO_WAY_DOWN};
use crate::model::{ComponentName, Finding, Severity};
use crate::statechart::{EventId, NodeId};
use crate::system::View;
use rustc_hash::FxHashSet;

impl Graph<'_, '_> {
    /// Ways down that leave something behind.
    pub(super) fn leftovers(&mut self, found: &mut Traced) {
        let left = |state: &State| left_in(self.product, state);
        let some = (0u32..).zip(&self.states).filter(|(_, state)| !left(state).is_empty());
        let some = some.map(|(at, _)| at).collect();
        let Some(at) = self.best_first(some).first().copied() else { return };
        let left = left_in(self.product, &self.states[at as usize]);
        let names: Vec<String> = left.iter().take(6).map(ToString::to_string).collect();
        let more = if left.len() > 6 { format!(" and {} more", left.len() - 6) } else { String::new() };
        let finding = Finding::warning(COORD_LEFTOVERS, format!("a way down leaves {}{more} behind", names.join(", ")))
            .at(self.product.deployment.key_origin("shutdown.down"))
            .path("shutdown.down")
            .help("let every way down undo or destroy what was applied on the way up; else what is left is taken away without its coordinator");
        let trace = self.trace(at);
        found.push((finding, trace));
    }

    /// From everywhere there is a way down. Only what was followed to the end counts: where events were not followed since
    /// too many requests waited, their answers lead on.
    pub(super) fn ways_down(&mut self, stuck: &FxHashSet<u32>, found: &mut Traced) {
        let cut = |bound: &Bound| {
            matches!(bound, Bound::Budget | Bound::Piled | Bound::Inbox | Bound::Forks | Bound::Entered)
        };
        if self.bounds.keys().any(cut) {
            return;
        }
        let reaches = self.reaching_down(|_| true);
        let several = self.product.members.len() > 1;
        let lost = |at: &u32| !reaches[*at as usize] && (!several || self.states[*at as usize].is_at_rest());
        let all: Vec<u32> = (0u32..).zip(&self.states).map(|(at, _)| at).filter(lost).collect();
        let leaves: FxHashSet<&[NodeId]> = stuck.iter().map(|at| &self.states[*at as usize].leaves[..]).collect();
        let some: Vec<u32> = if several {
            // Where nothing leads on at all tells most.
            let some: Vec<u32> = all.iter().copied().filter(|at| stuck.contains(at)).collect();
            if some.is_empty() { all } else { some }
        } else {
            all.into_iter().filter(|at| !leaves.contains(&self.states[*at as usize].leaves[..])).collect()
        };
        let Some(at) = self.best_first(some).first().copied() else { return self.once_down(&reaches, found) };
        let deployment = self.product.deployment;
        let state = &self.states[at as usize];
        let finding = if several {
            let message = format!("from {} no way leads down together", self.product.place(state));
            Finding::warning(COORD_NO_WAY_DOWN, message)
                .at(deployment.key_origin("shutdown.down"))
                .path("shutdown.down")
                .help("look at the trace: which of them waits for the other, and for what?")
        } else {
            let member = &self.product.members[0];
            let (leaf, fqn) = (state.leaves[0], member.chart.fqn(state.leaves[0]).to_string());
            let down = deployment.coordinator_named(member.name).map_or("", |c| c.down.as_str());
            Finding::warning(COORD_NO_WAY_DOWN, format!("from `{fqn}` no way leads to `{down}`"))
                .at(member.chart.origin(leaf))
                .path(format!("coordinator.{fqn}"))
                .also(deployment.key_origin("shutdown.down"), "the state that means down")
                .help("add transitions that lead down from there")
        };
        let trace = self.trace(at);
        found.push((finding, trace));
    }

    /// From which states such edges lead to *down*, or to where it is not followed, or to nothing that is known.
    fn reaching_down(&self, counts: impl Fn(&Edge) -> bool) -> Vec<bool> {
        let mut before: Vec<Vec<u32>> = vec![Vec::new(); self.states.len()];
        let edges = self.edges.iter().filter(|edge| counts(edge));
        edges.for_each(|edge| before[edge.to as usize].push(edge.from));
        let forced = |state: &State| self.product.worlds.top(state.world).is_some();
        let mut reaches: Vec<bool> =
            self.states.iter().map(|state| self.product.is_down(state) || forced(state)).collect();
        let ends = self.ends.iter().copied().chain(self.troubles.iter().map(|(at, _)| *at));
        ends.for_each(|at| reaches[at as usize] = true);
        // What the broken ends lead to is taken away by force: that is no way down of an intact system.
        let mut open: Vec<u32> = (0u32..).zip(&reaches).filter(|(_, reaches)| **reaches).map(|(at, _)| at).collect();
        open.retain(|at| !forced(&self.states[*at as usize]));
        while let Some(at) = open.pop() {
            for from in &before[at as usize] {
                if !std::mem::replace(&mut reaches[*from as usize], true) {
                    open.push(*from);
                }
            }
        }
        reaches
    }

    /// The event that ends the deployment is raised once: it must not take another one to come down.
    fn once_down(&mut self, reaches: &[bool], found: &mut Traced) {
        let once = self.reaching_down(|edge| !edge.again);
        let again = |at: &u32| {
            let state = &self.states[*at as usize];
            state.stopping && state.is_at_rest() && reaches[*at as usize] && !once[*at as usize]
        };
        let some = (0..u32::try_from(self.states.len()).unwrap_or_default()).filter(again).collect();
        let Some(at) = self.best_first(some).first().copied() else { return };
        let (deployment, state) = (self.product.deployment, &self.states[at as usize]);
        let severity = if self.failed[at as usize] == Failed::Nothing { Severity::Warning } else { Severity::Info };
        let (event, place) = (deployment.shutdown.event, self.product.place(state));
        let message = format!("from `{place}` only a second `{event}` leads down, and it is raised once");
        // The one that is not down yet, and would be led on by the second one.
        let late = |number: &usize| {
            let member = &self.product.members[*number];
            let down = member.down.is_some_and(|down| member.chart.is_inside(state.leaves[*number], down));
            !down && member.chart.event(event) != EventId::OTHER
        };
        let late = (0..self.product.members.len()).find(late).unwrap_or(0);
        let finding = Finding::new(severity, COORD_NO_WAY_DOWN, message)
            .at(self.product.members[late].chart.origin(state.leaves[late]))
            .path("shutdown.event")
            .help(
                "let an answer or a time lead on from there; else what is left is taken down without the coordinator",
            );
        let trace = self.trace(at);
        found.push((finding, trace));
    }
}

/// What is left in a state in which all are down.
fn left_in(product: &Product<'_>, state: &State) -> Vec<ComponentName> {
    let mut names = Vec::new();
    if let Some(world) = product.worlds.get(state.world).filter(|_| product.is_down(state)) {
        world.system.for_each_component(&mut |node| names.push(node.name));
    }
    names.sort_unstable();
    names
}
