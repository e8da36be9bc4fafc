//! Where nobody leads down any more: behind a safe configuration that was not done whole, and where what ends the deployment has led to a
//! state from which an emergency alone leads on.

use super::edges::{Barred, Edge};
use super::explore::Graph;
use super::judge::Traced;
use super::state::{Failed, Move, ProductState};
use crate::model::codes::COORD_NO_WAY_DOWN;
use crate::model::{EventName, Finding, Severity};

impl Graph<'_, '_> {
    /// Behind a safe configuration of which a step has failed nothing is known of the system, but what the coordinators wait for is: where no
    /// answer, however it ends, and no event leads to *down*, they never come there. One finding, of the first. Of several that are followed
    /// together it is not known whose that was, and who waits for whom.
    pub(super) fn down_behind_safe(&mut self, found: &mut Traced) {
        if self.product.members.len() > 1 {
            return;
        }
        let unknown = |state: &ProductState| self.product.worlds.top(state.world).is_some_and(|top| top.safe);
        let known = (0u32..)
            .zip(&self.states)
            .map(|(at, state)| !self.followed[at as usize] || self.product.is_down(state) || self.ends.contains(&at));
        let mut known: Vec<bool> = known.collect();
        for (at, trouble) in &self.troubles {
            known[*at as usize] |= trouble.stays_in_force();
        }
        let reaches = self.leading_to(known, |_, _| true);
        let lost = |at: &u32| {
            let state = &self.states[*at as usize];
            unknown(state) && state.is_at_rest() && !reaches[*at as usize] && !self.is_stranded(*at)
        };
        let some = (0u32..).zip(&self.states).map(|(at, _)| at).filter(lost).collect();
        let Some(at) = self.best_first(some).first().copied() else { return };
        let help = self.leads_nowhere(at);
        let state = &self.states[at as usize];
        let (member, place) = (&self.product.members[0], self.product.place(state));
        let message = format!("from `{place}` no way leads down, where something safe could not be done whole");
        let finding = Finding::warning(COORD_NO_WAY_DOWN, message)
            .at(member.chart.origin(state.leaves[0]))
            .path("shutdown.down")
            .also(self.product.deployment.key_origin("shutdown.down"), "the state that means down")
            .help(help);
        let severity = if self.product.knows_less() { Severity::Info } else { Severity::Warning };
        let trace = self.trace(at);
        found.push((Finding { severity, ..finding }, trace));
    }

    /// Where it rests when what ends the deployment was heard, nothing has failed and no emergency has come: that one would lead on is no way
    /// down. `begun`: where it begins to be stopped; `bars`: what leads on then.
    pub(super) fn led_by_emergency_alone(&self, begun: &[u32], arrives: &[bool], bars: &[Option<Barred>]) -> Vec<u32> {
        let emergency = |edge: &Edge| self.emergency(edge).is_some();
        let calm = |number: usize, edge: &Edge| {
            self.states[edge.to as usize].stopping && bars[number] != Some(Barred::Closed) && !emergency(edge)
        };
        let calm = self.spread_from(begun.to_vec(), calm);
        let leads = |number: usize, edge: &Edge| !emergency(edge) && bars[number] != Some(Barred::Again);
        let reaches = self.leading_to(arrives.to_vec(), leads);
        let lost = |at: &u32| {
            let (state, at) = (&self.states[*at as usize], *at as usize);
            let safe = self.product.worlds.is_safe(state.world);
            state.stopping
                && state.is_at_rest()
                && calm[at]
                && !safe
                && !reaches[at]
                && self.failed[at] <= Failed::Apply
        };
        (0u32..).zip(&self.states).map(|(at, _)| at).filter(lost).collect()
    }

    /// The event of safety that leads on, where something safe is asked for by that.
    fn emergency(&self, edge: &Edge) -> Option<EventName> {
        let Move::Event(at) = self.by(edge) else { return None };
        let (name, to) = (self.product.outside[usize::from(at)], &self.states[edge.to as usize]);
        let safe = !to.safe.is_empty() || self.product.worlds.is_safe(to.world);
        let listed = || self.product.deployment.safety.iter().any(|(event, _)| *event == name);
        (safe && listed()).then_some(name)
    }

    /// That nothing but an emergency leads on from there.
    pub(super) fn waits_for_an_emergency(&self, at: u32) -> Finding {
        let (deployment, state) = (self.product.deployment, &self.states[at as usize]);
        let (event, place) = (deployment.shutdown.event, self.product.place(state));
        let out = self.outgoing().of(at).iter().map(|number| &self.edges[*number as usize]);
        let again = out.clone().filter(|edge| !edge.dropped()).any(|edge| edge.barred() == Some(Barred::Again));
        let by = out.into_iter().filter(|edge| edge.to != at).find_map(|edge| self.emergency(edge));
        let by = by.map(|by| format!(", or `{by}`, which is for an emergency,")).unwrap_or_default();
        let message = match again {
            true => format!("from `{place}` only a second `{event}`{by} leads on, and it is raised once"),
            false => format!("from `{place}` nothing leads down when `{event}` has led there"),
        };
        Finding::warning(COORD_NO_WAY_DOWN, message)
            .at(self.product.members[0].chart.origin(state.leaves[0]))
            .path("shutdown.event")
            .help("let an answer or a time lead on from there; else what is left is taken down without the coordinator")
    }
}
