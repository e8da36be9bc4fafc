//! Cycles of answers in which no time passes and no step fails: who is on one goes round for ever.
//!
//! They are looked for among all such moves at once, so that none is too long to be found.

use super::adjacency::Adjacency;
use super::edges::Edge;
use super::explore::Graph;
use super::judge::Traced;
use super::state::{Failed, Move, Next, ProductState};
use crate::limits;
use crate::model::codes::COORD_ENDLESS;
use crate::model::{Finding, Severity};
use crate::statechart::NodeId;

use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::VecDeque;

impl Graph<'_, '_> {
    /// Cycles of answers, each told once however it is entered.
    pub(super) fn endless(&mut self, found: &mut Traced) {
        let mut said: FxHashSet<Vec<(usize, NodeId)>> = FxHashSet::default();
        for cycle in self.cycles() {
            let at = cycle[0];
            let of = self.round_of(&cycle);
            let leaves = |number: &usize| {
                let number = *number;
                cycle.iter().map(move |at| (number, *at))
            };
            let on: Vec<(usize, u32)> = of.iter().flat_map(leaves).collect();
            let leaf = |(number, at): (usize, u32)| (number, self.states[at as usize].leaves[number]);
            let mut round: Vec<(usize, NodeId)> = on.into_iter().map(leaf).collect();
            round.sort_unstable();
            round.dedup();
            // The others may be anywhere meanwhile.
            if !said.insert(round) {
                continue;
            }
            let place = |at: &u32| format!("`{}`", self.product.place_of(&self.states[*at as usize], &of));
            let mut named: Vec<String> = cycle.iter().map(place).collect();
            named.dedup();
            let more = named.len().saturating_sub(6);
            named.truncate(6);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let first = self.states[at as usize].leaves[of[0]];
            let behind_undo = self.failed[at as usize] >= Failed::Undo;
            let severity = if behind_undo { Severity::Info } else { Severity::Warning };
            let finding = Finding::new(
                severity,
                COORD_ENDLESS,
                format!(
                    "answers go round for ever, with nothing failing and no time passing: {}{more}",
                    named.join(", ")
                ),
            )
            .at(self.product.members[of[0]].chart.origin(first))
            .help("wait for an event or for a time (`e_after(1.0)`) somewhere on the way round");
            let round = self.round(&cycle);
            let trace = self.trace_on(at, round);
            found.push((finding, trace));
            // One that is entered from many places is told once.
            if said.len() >= limits::CHECK_TOLD {
                return;
            }
        }
    }

    /// The moves of a cycle, once round.
    fn round(&mut self, cycle: &[u32]) -> Vec<(ProductState, Next)> {
        let ends: Vec<(u32, u32)> = cycle.iter().copied().zip(cycle.iter().copied().cycle().skip(1)).collect();
        let edge = |(from, to): &(u32, u32)| {
            let is = |edge: &Edge| edge.quiet() && (edge.from, edge.to) == (*from, *to);
            self.edges.iter().position(is).and_then(|number| u32::try_from(number).ok())
        };
        let numbers: Vec<u32> = ends.iter().filter_map(edge).collect();
        numbers.into_iter().map(|number| self.gone(number)).collect()
    }

    /// The coordinators that go round on a cycle: those that change their state on it, or who hear something on it; one at
    /// least.
    fn round_of(&mut self, cycle: &[u32]) -> Vec<usize> {
        let all = 0..self.product.members.len();
        let leaf = |at: u32, number: usize| self.states[at as usize].leaves[number];
        let moves = |number: &usize| cycle.iter().any(|at| leaf(*at, *number) != leaf(cycle[0], *number));
        let moving: Vec<usize> = all.clone().filter(moves).collect();
        if !moving.is_empty() || all.len() < 2 {
            return if moving.is_empty() { vec![0] } else { moving };
        }
        let mut hearing: Vec<usize> = Vec::new();
        let on: FxHashSet<(u32, u32)> = cycle.iter().copied().zip(cycle.iter().copied().cycle().skip(1)).collect();
        let on: Vec<Edge> =
            self.edges.iter().filter(|edge| edge.quiet() && on.contains(&(edge.from, edge.to))).copied().collect();
        for edge in on {
            let next = edge.place().and_then(|place| self.nexts(edge.from).all.into_iter().nth(place));
            match next.as_ref().map(|next| (next.by, &next.answers)) {
                Some((Move::Taken(number, _), _)) => hearing.push(usize::from(number)),
                Some((_, answers)) => {
                    hearing.extend(answers.iter().filter_map(|(request, _)| self.product.member(request.requester)));
                }
                None => {}
            }
        }
        hearing.sort_unstable();
        hearing.dedup();
        if hearing.is_empty() { vec![0] } else { hearing }
    }

    /// Of all states that lead to each other by quiet moves one cycle, from the first of them; the first ones first.
    fn cycles(&self) -> Vec<Vec<u32>> {
        // Where nothing is known it is not known what is answered, so nothing can be said of cycles.
        let known = |at: u32| self.product.worlds.top(self.states[at as usize].world).is_none();
        let is_quiet = |edge: &Edge| edge.quiet() && known(edge.from) && known(edge.to);
        let mut quiet: Vec<u32> = Vec::with_capacity(self.edges.len());
        quiet.extend((0u32..).zip(self.edges.iter()).filter(|(_, edge)| is_quiet(edge)).map(|(number, _)| number));
        let ends = |number: &u32| (self.edges[*number as usize].from, self.edges[*number as usize].to);
        let quiet = quiet.iter().map(ends);
        let itself: FxHashSet<u32> = quiet.clone().filter(|(from, to)| from == to).map(|(at, _)| at).collect();
        let quiet = Adjacency::new(self.states.len(), quiet);
        let component = quiet.components();
        let mut sizes = vec![0u32; component.len()];
        component.iter().for_each(|number| sizes[*number as usize] += 1);
        let round = (0u32..).zip(&component).filter(|(at, of)| sizes[**of as usize] > 1 || itself.contains(at));
        let of: FxHashMap<u32, u32> = round.map(|(at, of)| (at, *of)).collect();
        if of.is_empty() {
            return Vec::new();
        }
        let mut gone_round: FxHashSet<u32> = FxHashSet::default();
        let firsts = self.in_order().into_iter().filter(|at| of.get(at).is_some_and(|of| gone_round.insert(*of)));
        firsts.filter_map(|at| cycle(&quiet, &of, at)).collect()
    }
}

/// A shortest cycle through `at`, of states that all lead to each other.
fn cycle(quiet: &Adjacency, of: &FxHashMap<u32, u32>, at: u32) -> Option<Vec<u32>> {
    let mut from: FxHashMap<u32, u32> = FxHashMap::default();
    let mut queue = VecDeque::from([at]);
    while let Some(state) = queue.pop_front() {
        for next in quiet.of(state).iter().rev().copied().filter(|next| of.get(next) == of.get(&at)) {
            if next == at {
                let mut cycle = vec![state];
                let mut back = state;
                while back != at {
                    back = from[&back];
                    cycle.push(back);
                }
                cycle.reverse();
                return Some(cycle);
            }
            from.entry(next).or_insert_with(|| {
                queue.push_back(next);
                state
            });
        }
    }
    None
}
