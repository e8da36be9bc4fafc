//! Bring-ups that fail: a state listed under `deploy.failed` means it, and from there the deployment is stopped.
//!
//! Where nobody hears the event that ends it, and nothing is under way, a running deployment that is still coming up is taken
//! back without its coordinators at once: a time, or an event, that would lead on there is not waited for.

use super::explore::{Edge, Graph};
use super::judge::Traced;
use super::state::Failed;
use crate::model::Finding;
use crate::model::Severity;
use crate::model::codes::COORD_NO_WAY_DOWN;

impl Graph<'_, '_> {
    /// The states in which a bring-up has failed and rests, with nothing worse than a configuration that was not applied.
    pub(super) fn failed_bring_ups(&self) -> Vec<u32> {
        if self.product.members.iter().all(|member| member.failed.is_empty()) {
            return Vec::new();
        }
        let state = |at: u32| &self.states[at as usize];
        let is_up = |at: u32| state(at).is_at_rest() && self.product.all_in(state(at), |member| member.up);
        let failed = |at: u32| self.product.failed_in(state(at)).is_some();
        // From the first of them on it is being stopped.
        let leads = |_: usize, edge: &Edge| !is_up(edge.from) && !failed(edge.from) && !state(edge.to).stopping;
        let comes_up = self.spread_from(vec![0], leads);
        let known = |at: u32| self.product.worlds.top(state(at).world).is_none();
        let expected = |at: u32| self.failed[at as usize] <= Failed::Apply;
        let comes_up = (0u32..).zip(comes_up).filter(|(_, comes_up)| *comes_up).map(|(at, _)| at);
        comes_up.filter(|at| failed(*at) && state(*at).is_at_rest() && known(*at) && expected(*at)).collect()
    }

    /// Where it is stopped after a bring-up that has failed, nothing failing any more.
    pub(super) fn behind_failed(&self) -> Vec<bool> {
        let failed = self.failed_bring_ups();
        let stops = |_: usize, edge: &Edge| self.states[edge.to as usize].stopping && edge.failed == Failed::Nothing;
        self.spread_from(failed, stops)
    }

    /// That nobody hears the event that ends the deployment where a bring-up has failed; `told` is told already.
    pub(super) fn failing(&mut self, told: Option<u32>, found: &mut Traced) {
        let failed = self.failed_bring_ups();
        let mut unheard: Vec<u32> = self.edges.iter().filter(|edge| edge.dropped).map(|edge| edge.from).collect();
        unheard.retain(|at| failed.contains(at));
        let Some(at) = self.best_first(unheard).first().copied() else { return };
        let state = &self.states[at as usize];
        if told.is_some_and(|told| self.states[told as usize].leaves == state.leaves) {
            return;
        }
        let event = self.product.deployment.shutdown.event;
        let by = self.product.failed_in(state).unwrap_or_default();
        let message = format!(
            "nobody hears `{event}` in `{}`, where the bring-up has failed: it is taken back without its coordinator",
            self.product.place(state)
        );
        let finding = Finding::new(Severity::Warning, COORD_NO_WAY_DOWN, message)
            .at(self.product.members[by].chart.origin(state.leaves[by]))
            .path("deploy.failed")
            .also(self.product.deployment.key_origin("deploy.failed"), "it means that the bring-up has failed")
            .help(format!("add a transition on `{event}` that leads down from there"));
        let trace = self.trace(at);
        found.push((finding, trace));
    }
}
