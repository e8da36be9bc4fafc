//! An interface automaton as it is found, made as small as it becomes: of hundreds of thousands of states, some hundreds. So what leads on from
//! a state is a piece of one list, and what an edge does is a number.

use super::adjacency::Adjacency;
use super::automaton::{InterfaceAction, InterfaceAutomaton, InterfaceState};
use super::chunks::Chunks;
use indexmap::IndexSet;
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::hash::BuildHasher;

/// The number of what the parent cannot see.
const SILENT: u32 = 0;

/// What is known so far: states by their numbers, and what leads from one to another.
pub(super) struct AutomatonDraft {
    actions: IndexSet<InterfaceAction, FxBuildHasher>,
    states: Vec<InterfaceState>,
    /// From where, by which action, to where.
    edges: Chunks<(u32, u32, u32)>,
}

impl Default for AutomatonDraft {
    fn default() -> Self {
        let mut actions = IndexSet::default();
        actions.insert(InterfaceAction::Silent);
        Self { actions, states: Vec::new(), edges: Chunks::default() }
    }
}

impl AutomatonDraft {
    /// One state more; answers its number.
    pub fn add(&mut self, state: InterfaceState) -> u32 {
        self.states.push(state);
        number(self.states.len() - 1)
    }

    /// One edge more.
    pub fn lead(&mut self, from: u32, by: InterfaceAction, to: u32) {
        let by = if by == InterfaceAction::Silent { SILENT } else { number(self.actions.insert_full(by).0) };
        self.edges.push((from, by, to));
    }

    /// The automaton of these states. `edges` have them as numbers.
    #[cfg(test)]
    pub fn whole(
        edges: impl IntoIterator<Item = (u32, InterfaceAction, u32)>,
        states: Vec<InterfaceState>,
        start: u32,
    ) -> InterfaceAutomaton {
        let mut draft = Self::default();
        for state in states {
            draft.add(state);
        }
        edges.into_iter().for_each(|(from, by, to)| draft.lead(from, by, to));
        draft.finished(start)
    }

    /// The automaton.
    pub fn finished(self, start: u32) -> InterfaceAutomaton {
        let Self { actions, states, edges } = self;
        let whole = Merging::new(edges.iter().copied(), states, start);
        let whole = whole.merged(&whole.silent_rounds());
        let whole = whole.merged(&whole.passed_through());
        let whole = whole.merged(&whole.alike());
        let whole = whole.merged(&whole.passed_through());
        let edges = (0..number(whole.states.len())).map(|at| {
            let mut edges: Vec<_> = whole.of(at).iter().map(|(by, to)| (actions[*by as usize], *to)).collect();
            edges.sort_unstable();
            edges
        });
        InterfaceAutomaton::of(edges.collect(), whole.states, whole.start)
    }
}

fn number(index: usize) -> u32 {
    u32::try_from(index).unwrap_or(u32::MAX)
}

/// States of which some are taken for one, again and again.
struct Merging {
    /// Where in `edges` those of each state begin.
    starts: Vec<u32>,
    edges: Vec<(u32, u32)>,
    states: Vec<InterfaceState>,
    start: u32,
}

impl Merging {
    /// Of these edges, which are gone through twice.
    fn new(edges: impl Iterator<Item = (u32, u32, u32)> + Clone, states: Vec<InterfaceState>, start: u32) -> Self {
        let mut starts = vec![0; states.len() + 1];
        edges.clone().for_each(|(from, _, _)| starts[from as usize + 1] += 1);
        for at in 0..states.len() {
            starts[at + 1] += starts[at];
        }
        let (mut all, mut next) = (vec![(SILENT, 0); starts[states.len()] as usize], starts.clone());
        for (from, by, to) in edges {
            let place = &mut next[from as usize];
            all[*place as usize] = (by, to);
            *place += 1;
        }
        // Each once.
        let mut kept = 0;
        for at in 0..states.len() {
            let (from, to) = (starts[at] as usize, starts[at + 1] as usize);
            all[from..to].sort_unstable();
            starts[at] = number(kept);
            for edge in from..to {
                if edge == from || all[edge] != all[edge - 1] {
                    all[kept] = all[edge];
                    kept += 1;
                }
            }
        }
        starts[states.len()] = number(kept);
        all.truncate(kept);
        Self { starts, edges: all, states, start }
    }

    /// What leads on from a state.
    fn of(&self, at: u32) -> &[(u32, u32)] {
        &self.edges[self.starts[at as usize] as usize..self.starts[at as usize + 1] as usize]
    }

    /// All edges, and where each comes from.
    fn all(&self) -> impl Iterator<Item = (u32, u32, u32)> + Clone + '_ {
        (0..number(self.states.len())).flat_map(|from| self.of(from).iter().map(move |(by, to)| (from, *by, *to)))
    }

    /// Of each state the number of those that it leads to and that lead back, all silently.
    fn silent_rounds(&self) -> Vec<u32> {
        let silent = self.all().filter(|(_, by, _)| *by == SILENT).map(|(from, _, to)| (from, to));
        Adjacency::new(self.states.len(), silent).components()
    }

    /// Of each state the number of the one that it becomes silently, where it can do nothing else.
    fn passed_through(&self) -> Vec<u32> {
        let next = |at: u32| match self.of(at) {
            [(SILENT, to)] if self.states[at as usize] == self.states[*to as usize] => Some(*to),
            _ => None,
        };
        const UNKNOWN: u32 = u32::MAX;
        let mut of = vec![UNKNOWN; self.states.len()];
        let mut way = Vec::new();
        for at in 0..number(self.states.len()) {
            let mut last = at;
            // There are no rounds of such steps any more.
            while of[last as usize] == UNKNOWN && way.len() < self.states.len() {
                way.push(last);
                let Some(to) = next(last) else { break };
                last = to;
            }
            let known = of[last as usize];
            let end = if known == UNKNOWN { last } else { known };
            way.drain(..).for_each(|passed| of[passed as usize] = end);
        }
        of
    }

    /// Of each state the number of those that do the same (bisimilar; silent steps among them count for nothing): the coarsest partition that
    /// is stable, by splitting. A state is looked at anew only where one that it leads to was split off.
    fn alike(&self) -> Vec<u32> {
        let before = Adjacency::new(self.states.len(), self.all().map(|(from, _, to)| (to, from)));
        let block = |state: &InterfaceState| u32::from(state.down) + 2 * u32::from(state.failed);
        let mut of: Vec<u32> = self.states.iter().map(block).collect();
        // Of each block how many are in it, and what those of it do that need not be looked at.
        let mut sizes = vec![0_usize; 4];
        of.iter().for_each(|block| sizes[*block as usize] += 1);
        let mut does: Vec<Option<u64>> = vec![None; 4];
        let mut dirty: Vec<u32> = (0..number(of.len())).collect();
        let mut seen_as = Vec::new();
        while !dirty.is_empty() {
            let mut groups: FxHashMap<(u32, u64), Vec<u32>> = FxHashMap::default();
            let mut looked_at: FxHashMap<u32, usize> = FxHashMap::default();
            for at in std::mem::take(&mut dirty) {
                let block = of[at as usize];
                self.seen_as(at, &of, &mut seen_as);
                // That two of so many numbers are the same by chance makes one state of two, which may do more then, and never less.
                let seen = FxBuildHasher.hash_one(&seen_as);
                groups.entry((block, seen)).or_default().push(at);
                *looked_at.entry(block).or_default() += 1;
            }
            // Where all of a block was looked at, the first of its groups keeps the name.
            for (block, count) in looked_at {
                if count == sizes[block as usize] {
                    does[block as usize] = None;
                }
            }
            let mut groups: Vec<_> = groups.into_iter().collect();
            groups.sort_unstable_by_key(|(_, states)| states[0]);
            for ((block, seen), states) in groups {
                let known = does[block as usize].get_or_insert(seen);
                if *known == seen {
                    continue;
                }
                let new = number(sizes.len());
                sizes.push(states.len());
                sizes[block as usize] -= states.len();
                does.push(Some(seen));
                for at in states {
                    of[at as usize] = new;
                    // A silent step to the rest of the block is one that counts from now on.
                    dirty.push(at);
                    dirty.extend(before.of(at));
                }
            }
            dirty.sort_unstable();
            dirty.dedup();
        }
        of
    }

    /// What a state does where states are taken for one, into `does`.
    fn seen_as(&self, at: u32, of: &[u32], does: &mut Vec<(u32, u32)>) {
        does.clear();
        let told = self.of(at).iter().map(|(by, to)| (*by, of[*to as usize]));
        does.extend(told.filter(|(by, to)| *by != SILENT || *to != of[at as usize]));
        does.sort_unstable();
        does.dedup();
    }

    /// The same with the states of one number as one.
    fn merged(&self, of: &[u32]) -> Self {
        // Numbers that nothing has are none.
        let mut numbers: Vec<u32> = of.to_vec();
        numbers.sort_unstable();
        numbers.dedup();
        let name = |number_of: &u32| number(numbers.partition_point(|of| of < number_of));
        let of: Vec<u32> = of.iter().map(name).collect();
        let mut states = vec![InterfaceState { down: true, failed: true }; numbers.len()];
        for (at, state) in self.states.iter().enumerate() {
            let into = &mut states[of[at] as usize];
            into.down &= state.down;
            into.failed &= state.failed;
        }
        let of_edge = |(from, by, to): (u32, u32, u32)| (of[from as usize], by, of[to as usize]);
        let edges = self.all().map(of_edge);
        let edges = edges.filter(|(from, by, to)| *by != SILENT || from != to);
        Self::new(edges, states, of[self.start as usize])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::state::Failed;
    use crate::model::EventName;

    const WELL: InterfaceAction = InterfaceAction::Silent;

    fn tells(event: &str) -> InterfaceAction {
        InterfaceAction::Tells(name(event), Failed::Nothing)
    }

    fn plain(states: usize) -> Vec<InterfaceState> {
        vec![InterfaceState::default(); states]
    }

    fn name(text: &str) -> EventName {
        EventName::new(text).unwrap()
    }

    #[test]
    fn states_that_show_the_same_are_one_and_no_others() {
        // Two ways of a hundred steps; at the end of one of them something is told.
        let chain = |last: Option<&str>| {
            let mut edges = vec![(0, WELL, 1), (0, WELL, 101), (100, tells("up"), 201)];
            edges.extend((1..100).chain(101..200).map(|at| (at, WELL, at + 1)));
            edges.extend(last.map(|event| (201, tells(event), 0)));
            AutomatonDraft::whole(edges, plain(202), 0).len()
        };
        // The start, what tells, and what leads nowhere.
        assert_eq!(chain(None), 3);
        assert_eq!(chain(Some("down")), 4);
        // In two places at once it is one: what it may do is told apart by what has to be told first.
        let ring = (0..100).flat_map(|at| [(at, WELL, (at + 1) % 100), (at, tells("up"), 100)]);
        assert_eq!(AutomatonDraft::whole(ring, plain(101), 0).len(), 2);
    }

    #[test]
    fn silent_rounds_are_one_state() {
        let edges = [(0, WELL, 1), (1, WELL, 2), (2, WELL, 0), (1, tells("up"), 3)];
        let whole = AutomatonDraft::whole(edges, plain(4), 0);
        assert_eq!((whole.len(), whole.leads(whole.start()).len()), (2, 1), "{whole:?}");
    }
}
