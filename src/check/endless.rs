//! Circles of answers in which no time passes and no step fails: who is on one goes round for ever.
//!
//! They are looked for among all such moves at once, so that none is too long to be found.

use super::explore::Graph;
use super::judge::Traced;
use super::state::Failed;
use crate::limits;
use crate::model::codes::COORD_ENDLESS;
use crate::model::{Finding, Severity};
use crate::statechart::NodeId;
use petgraph::algo::kosaraju_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::VecDeque;

impl Graph<'_, '_> {
    /// Circles of answers, each told once however it is entered.
    pub(super) fn endless(&mut self, found: &mut Traced) {
        let mut said: FxHashSet<Vec<NodeId>> = FxHashSet::default();
        for circle in self.circles() {
            let at = circle[0];
            let mut leaves: Vec<NodeId> =
                circle.iter().flat_map(|at| self.states[*at as usize].leaves.iter().copied()).collect();
            leaves.sort_unstable();
            leaves.dedup();
            if !said.insert(leaves) {
                continue;
            }
            let places: Vec<String> = circle.iter().map(|at| self.product.place(&self.states[*at as usize])).collect();
            let mut named: Vec<String> = places.into_iter().map(|place| format!("`{place}`")).collect();
            named.dedup();
            let more = named.len().saturating_sub(6);
            named.truncate(6);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let leaf = self.states[at as usize].leaves[0];
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
            .at(self.product.members[0].chart.origin(leaf))
            .help("wait for an event or for a time (`e_after(1.0)`) somewhere on the way round");
            let trace = self.trace(at);
            found.push((finding, trace));
            // One that is entered from many places is told once.
            if said.len() >= limits::CHECK_TOLD {
                return;
            }
        }
    }

    /// Of all states that lead to each other by quiet moves one circle, from the first of them; the first ones first.
    fn circles(&self) -> Vec<Vec<u32>> {
        // Where nothing is known it is not known what is answered, so nothing can be said of circles.
        let known = |at: u32| self.product.worlds.top(self.states[at as usize].world).is_none();
        let quiet = self.edges.iter().filter(|edge| edge.quiet && known(edge.from) && known(edge.to));
        let quiet = DiGraph::<(), ()>::from_edges(quiet.map(|edge| (edge.from, edge.to)));
        let mut of: FxHashMap<u32, usize> = FxHashMap::default();
        for (number, states) in kosaraju_scc(&quiet).into_iter().enumerate() {
            if states.len() > 1 || quiet.contains_edge(states[0], states[0]) {
                of.extend(states.into_iter().filter_map(|at| Some((u32::try_from(at.index()).ok()?, number))));
            }
        }
        if of.is_empty() {
            return Vec::new();
        }
        let mut gone_round: FxHashSet<usize> = FxHashSet::default();
        let firsts = self.in_order().into_iter().filter(|at| of.get(at).is_some_and(|of| gone_round.insert(*of)));
        firsts.filter_map(|at| circle(&quiet, &of, at)).collect()
    }
}

/// A shortest circle through `at`, of states that all lead to each other.
fn circle(quiet: &DiGraph<(), ()>, of: &FxHashMap<u32, usize>, at: u32) -> Option<Vec<u32>> {
    let mut from: FxHashMap<u32, u32> = FxHashMap::default();
    let mut queue = VecDeque::from([at]);
    while let Some(state) = queue.pop_front() {
        let next = quiet.neighbors(NodeIndex::from(state)).filter_map(|next| u32::try_from(next.index()).ok());
        for next in next.filter(|next| of.get(next) == of.get(&at)) {
            if next == at {
                let mut circle = vec![state];
                let mut back = state;
                while back != at {
                    back = from[&back];
                    circle.push(back);
                }
                circle.reverse();
                return Some(circle);
            }
            from.entry(next).or_insert_with(|| {
                queue.push_back(next);
                state
            });
        }
    }
    None
}
