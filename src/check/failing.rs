//! Bring-ups that fail, or are stopped by people: a state listed under `deploy.failed` means it, and from there the deployment is
//! stopped; so is one that is late.
//!
//! Where nobody hears the event that ends it, and nothing is under way any more, a running deployment that was still coming up is
//! taken back without its coordinators at once: a time, or an event, that would lead on there is not waited for.

use super::edges::{Barred, Edge};
use super::explore::Graph;
use super::judge::Traced;
use super::state::{Failed, Move};
use crate::model::Finding;
use crate::model::Severity;
use crate::model::codes::COORD_NO_WAY_DOWN;
use rustc_hash::FxHashSet;

impl Graph<'_, '_> {
    /// Whether the coordinators have come up in a state, and wait for nothing more.
    pub(super) fn is_up(&self, at: u32) -> bool {
        let state = &self.states[at as usize];
        // What operators ask for there is asked for later.
        let waits = || self.product.members.iter().any(|member| state.outstanding(member.by) > 0);
        let heard = state.inbox.is_empty() && state.in_transit.is_empty();
        heard && self.product.all_in(state, |member| member.goal_up()) && !waits()
    }

    /// Which states a deployment comes to before it is up, or has failed.
    pub(super) fn comes_up(&self) -> Vec<bool> {
        let failed = |at: u32| self.product.failed_in(&self.states[at as usize]).is_some();
        let stops = |at: u32| self.states[at as usize].stopping;
        // From the first of them on it is being stopped.
        let leads = |_: usize, edge: &Edge| !self.is_up(edge.from) && !failed(edge.from) && !stops(edge.to);
        let comes_up = self.spread_from(vec![0], leads);
        (0u32..).zip(comes_up).map(|(at, comes_up)| comes_up && !self.is_up(at)).collect()
    }

    /// The states in which a bring-up has failed and rests, with nothing worse than a configuration that was not applied.
    fn failed_bring_ups(&self, comes_up: &[bool]) -> Vec<u32> {
        if self.product.members.iter().all(|member| member.failed.is_empty()) {
            return Vec::new();
        }
        let state = |at: u32| &self.states[at as usize];
        let failed = |at: u32| self.product.failed_in(state(at)).is_some();
        let known = |at: u32| self.product.worlds.top(state(at).world).is_none();
        let expected = |at: u32| self.failed[at as usize] <= Failed::Apply;
        let comes_up = (0u32..).zip(comes_up).filter(|(_, comes_up)| **comes_up).map(|(at, _)| at);
        comes_up.filter(|at| failed(*at) && state(*at).is_at_rest() && known(*at) && expected(*at)).collect()
    }

    /// Where it is stopped after a bring-up that has failed, nothing failing any more.
    pub(super) fn behind_failed(&self, comes_up: &[bool]) -> Vec<bool> {
        let failed = self.failed_bring_ups(comes_up);
        let stops = |_: usize, edge: &Edge| self.states[edge.to as usize].stopping && edge.failed() == Failed::Nothing;
        self.spread_from(failed, stops)
    }

    /// Where it rests, with something left, when it was stopped before it was up and nobody heard that.
    fn rests_unheard(&self, comes_up: &[bool]) -> Vec<u32> {
        let state = |at: u32| &self.states[at as usize];
        let dropped = self.edges.iter().filter(|edge| edge.dropped() && comes_up[edge.from as usize]);
        // The event comes once.
        let goes_on = |_: usize, edge: &Edge| {
            !state(edge.from).is_at_rest() && state(edge.to).stopping && edge.barred() != Some(Barred::Again)
        };
        let open = self.spread_from(dropped.map(|edge| edge.to).collect(), goes_on);
        let left = |at: u32| {
            let world = self.product.worlds.get(state(at).world);
            world.is_some_and(|world| !world.is_bare() || !world.stack.is_empty())
        };
        let open = (0u32..).zip(open).filter(|(_, open)| *open).map(|(at, _)| at);
        // That it is let go comes by itself.
        let until = self.product.deployment.interface.leaving.map(|leaving| leaving.until);
        let let_go = |edge: &&Edge| match self.by(edge) {
            Move::Event(at) => Some(self.product.outside[usize::from(at)]) == until,
            _ => false,
        };
        let let_go: FxHashSet<u32> = self.edges.iter().filter(let_go).map(|edge| edge.from).collect();
        let rests = |at: &u32| {
            !let_go.contains(at) && state(*at).is_at_rest() && !self.product.is_down(state(*at)) && left(*at)
        };
        open.filter(|at| rests(at) && self.failed[*at as usize] <= Failed::Apply).collect()
    }

    /// Where nobody heard the event that ends it, of what comes to rest there: the first on the shortest way.
    fn unheard_before(&mut self, at: u32, comes_up: &[bool]) -> Option<u32> {
        let state = |at: u32| &self.states[at as usize];
        let mut unheard = Vec::new();
        let (mut open, mut met) = (vec![at], FxHashSet::from_iter([at]));
        while let Some(to) = open.pop() {
            for number in self.incoming().of(to) {
                let edge = &self.edges[*number as usize];
                if edge.dropped() && comes_up[edge.from as usize] {
                    unheard.push(edge.from);
                } else if !state(edge.from).is_at_rest() && state(edge.from).stopping && met.insert(edge.from) {
                    open.push(edge.from);
                }
            }
        }
        self.best_first(unheard).first().copied()
    }

    /// That nobody hears the event that ends the deployment where a bring-up has failed, or is stopped; `told` is told already.
    pub(super) fn failing(&mut self, comes_up: &[bool], told: Option<u32>, found: &mut Traced) {
        let failed = self.failed_bring_ups(comes_up);
        let is_listed = |graph: &Self, at: u32| {
            let leaves = &graph.states[at as usize].leaves;
            failed.iter().any(|failed| graph.states[*failed as usize].leaves == *leaves)
        };
        // Where something has failed that it is not known to mean the end, not every coordinator can go on.
        let warned = |graph: &Self, at: u32| graph.failed[at as usize] == Failed::Nothing || is_listed(graph, at);
        let all = self.rests_unheard(comes_up);
        let some: Vec<u32> = all.iter().copied().filter(|at| warned(self, *at)).collect();
        let severity = if some.is_empty() { Severity::Info } else { Severity::Warning };
        let Some(at) = self.best_first(if some.is_empty() { all } else { some }).first().copied() else { return };
        if told.is_some_and(|told| self.states[told as usize].leaves == self.states[at as usize].leaves) {
            return;
        }
        let from = if is_listed(self, at) { at } else { self.unheard_before(at, comes_up).unwrap_or(at) };
        let state = &self.states[at as usize];
        let deployment = self.product.deployment;
        let (event, place) = (deployment.shutdown.event, self.product.place(state));
        let by = self.product.failed_in(state).unwrap_or_default();
        let unheard = self.product.place(&self.states[from as usize]);
        let origin = |at: u32| self.product.members[by].chart.origin(self.states[at as usize].leaves[by]);
        let finding = match is_listed(self, at) {
            true => Finding::new(
                severity,
                COORD_NO_WAY_DOWN,
                format!(
                    "nobody hears `{event}` in `{place}`, where the bring-up has failed: it is taken back without its coordinator"
                ),
            )
            .path("deploy.failed")
            .also(deployment.key_origin("deploy.failed"), "it means that the bring-up has failed"),
            false => {
                let message = format!("nobody hears `{event}` in `{unheard}`, before it is up");
                let rests = if unheard == place { "there".to_owned() } else { format!("in `{place}`") };
                let message = format!("{message}; it rests {rests}, and is taken back without its coordinator");
                let finding = Finding::new(severity, COORD_NO_WAY_DOWN, message).path("shutdown.event");
                if unheard == place { finding } else { finding.also(origin(at), "it rests here") }
            }
        };
        let finding =
            finding.at(origin(from)).help(format!("add a transition on `{event}` that leads down from `{unheard}`"));
        let trace = self.trace(at);
        found.push((finding, trace));
    }
}
