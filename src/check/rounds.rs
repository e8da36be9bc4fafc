//! Frames that nobody ever undoes pile up where a cycle pushes one each time round, until the oldest frames are squashed:
//! what comes of that is followed too.
//!
//! A cycle is gone round for each configuration that is pushed on it, in each world in which it is, up to a bound. What else
//! is pushed on another cycle with the same push in the same world is followed for that.

use super::adjacency::Adjacency;
use super::bound::Bound;
use super::edges::{Edge, NOWHERE};
use super::explore::Graph;
use super::outcome::EMPTY;
use super::state::Failed;
use crate::limits;
use crate::stack::{Request, World};
use rustc_hash::FxHashMap;
use std::collections::VecDeque;

/// The cycles on which no undo fails.
struct Cycles {
    /// The numbers of their edges, by where these come from.
    edges: Adjacency,
    /// Of each state, on which it is.
    of: Vec<u32>,
}

impl Graph<'_, '_> {
    /// Goes round cycles that were met since. True: there is more to follow.
    pub(super) fn go_round(&mut self) -> bool {
        let mut pushes: Vec<_> = std::mem::take(&mut self.pushes).into_iter().collect();
        for (who, edges) in &mut pushes {
            let gone = self.gone_round.get(who);
            edges.retain(|edge| {
                let world = self.states[self.edges[*edge as usize].from as usize].world;
                gone.is_none_or(|gone| !gone.contains(&world)) && !self.product.worlds.is_piled_up(world)
            });
        }
        pushes.retain(|(_, edges)| !edges.is_empty());
        if pushes.is_empty() {
            return false;
        }
        pushes.sort_unstable_by_key(|((id, by), _)| (*id, *by));
        let cycles = self.cyclic();
        let before = self.edges.len();
        let easy = before <= limits::CHECK_EASY;
        let most = if easy { limits::CHECK_ROUNDS } else { 1 };
        let worsts = if easy { &[Failed::Nothing, Failed::Apply][..] } else { &[Failed::Nothing][..] };
        for ((id, by), edges) in pushes {
            // A frame of a group takes the place of the one before: none piles up.
            let piles = self.product.worlds.configuration(id).is_some_and(|c| c.group.is_none());
            for edge in edges {
                let Edge { from, to, .. } = self.edges[edge as usize];
                let (class, world) = (self.failed[from as usize], self.states[from as usize].world);
                // What was met since is on none of them.
                let on = |at: u32| cycles.of.get(at as usize).copied().unwrap_or(NOWHERE);
                if on(from) == NOWHERE || on(from) != on(to) {
                    continue;
                }
                let gone = self.gone_round.entry((id, by)).or_default();
                if gone.contains(&world) {
                    continue;
                }
                let (some, full) = (!gone.is_empty(), gone.len() >= most);
                // One is enough to see that nothing piles up.
                if full || some && !piles {
                    if piles {
                        self.cut(Bound::Rounds, class);
                    }
                    continue;
                }
                let cycle = worsts.iter().find_map(|worst| {
                    let cycle = self.cycle(edge, &cycles, *worst)?;
                    Some((cycle, *worst))
                });
                let Some((cycle, worst)) = cycle else {
                    if !easy && piles {
                        self.cut(Bound::Rounds, class);
                    }
                    continue;
                };
                self.gone_round.entry((id, by)).or_default().insert(world);
                if !self.round_and_round(&cycle, worst) {
                    self.cut(Bound::Rounds, class.max(worst));
                }
            }
        }
        self.edges.len() > before
    }

    /// The edges of cycles on which no undo fails and something stays in force, and which states are on one cycle.
    fn cyclic(&self) -> Cycles {
        let fits = |edge: &Edge| {
            // Where nothing is left, frames are forgotten: they do not pile up.
            edge.failed() <= Failed::Apply && edge.place().is_some() && self.states[edge.to as usize].world != EMPTY
        };
        // Whether one fits is looked up once: the states are all over memory.
        let mut all: Vec<u32> = Vec::with_capacity(self.edges.len());
        all.extend((0u32..).zip(self.edges.iter()).filter(|(_, edge)| fits(edge)).map(|(number, _)| number));
        let edge = |number: &u32| &self.edges[*number as usize];
        let ends = |number: &u32| (edge(number).from, edge(number).to);
        let of = Adjacency::new(self.states.len(), all.iter().map(ends)).components();
        all.retain(|number| of[edge(number).from as usize] == of[edge(number).to as usize]);
        let edges = Adjacency::new(self.states.len(), all.iter().map(|number| (edge(number).from, *number)));
        Cycles { edges, of }
    }

    /// The edges of a cycle that ends with this one, on which nothing fails that is worse.
    fn cycle(&self, edge: u32, cycles: &Cycles, worst: Failed) -> Option<Vec<u32>> {
        let last = self.edges[edge as usize];
        let (goal, start, failed) = (last.from, last.to, last.failed());
        if failed > worst || self.failed[start as usize] > worst {
            return None;
        }
        let mut by: FxHashMap<u32, u32> = FxHashMap::default();
        let mut queue: VecDeque<u32> = VecDeque::from([start]);
        while let Some(at) = queue.pop_front() {
            if at == goal {
                let mut cycle = vec![edge];
                let mut at = goal;
                while at != start {
                    let number = by[&at];
                    cycle.push(number);
                    at = self.edges[number as usize].from;
                }
                cycle.reverse();
                return Some(cycle);
            }
            for number in cycles.edges.of(at) {
                let edge = self.edges[*number as usize];
                let (to, failed) = (edge.to, edge.failed());
                if failed <= worst && to != start && !by.contains_key(&to) {
                    by.insert(to, *number);
                    queue.push_back(to);
                }
            }
        }
        None
    }

    /// Goes round a cycle until the oldest frames are squashed, or something on it is refused; what it leads to is followed.
    /// False: it cannot be gone by what its requests come to alone.
    fn round_and_round(&mut self, cycle: &[u32], worst: Failed) -> bool {
        let Some(first) = cycle.first().map(|edge| self.edges[*edge as usize]) else { return false };
        let begun = self.states[first.from as usize].world;
        let Some(mut world) = self.product.worlds.get(begun).cloned() else { return false };
        let mut system = self.product.worlds.system(begun);
        let mut requests: Vec<(Edge, Vec<Request>)> = Vec::new();
        for number in cycle {
            let edge = self.edges[*number as usize];
            let next = self.nexts(edge.from).all.into_iter().nth(edge.place().unwrap_or(usize::MAX));
            let answered = next.into_iter().flat_map(|next| next.answers);
            let done = answered.filter(|(_, verdict)| verdict.is_success()).map(|(request, _)| request).collect();
            requests.push((edge, done));
        }
        let limit = self.product.deployment.limits.stack;
        let mut at = first.from;
        let squashed = |world: &World| world.stack.frames().iter().any(|frame| frame.is_squashed());
        'round: for round in 0..limit + 2 {
            let frames = world.stack.len();
            for (edge, requests) in &requests {
                if !self.product.worlds.carry_on(&mut world, &mut system, requests) {
                    at = edge.from;
                    break 'round;
                }
                // What fails may leave something else than nothing done.
                if round == 0 && worst != Failed::Nothing && !squashed(&world) {
                    let met = self.product.worlds.intern(world.clone(), system);
                    if met != self.states[edge.to as usize].world {
                        return false;
                    }
                }
            }
            // None piles up.
            if world.stack.len() == frames && !squashed(&world) {
                break;
            }
        }
        let mut state = self.states[at as usize].clone();
        let world = self.product.worlds.intern(world, system);
        if world == state.world {
            return true;
        }
        state.world = world;
        state.waits_for_none();
        let (failed, depth) = (self.failed[at as usize].max(worst), self.depth[at as usize] + 1);
        let to = self.reach(state, failed, depth);
        let number = u32::try_from(self.edges.len()).unwrap_or(NOWHERE);
        self.rounds.insert(number, cycle.to_vec());
        let shown = cycle.iter().all(|edge| self.edges[*edge as usize].shown());
        self.rounds_lead(at, to, worst, shown);
        true
    }
}
