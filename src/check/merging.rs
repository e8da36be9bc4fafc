//! States of an interface automaton of which some are taken for one: those that nobody can tell apart by what is seen.

use super::adjacency::Adjacency;
use super::automaton::InterfaceState;
use indexmap::IndexSet;
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::hash::BuildHasher;
use std::rc::Rc;

/// The number of what the parent cannot see.
pub(super) const SILENT: u32 = 0;

/// In so many sets each state may be, on average, where it is followed in which ones it may be: what takes longer saves nothing.
const MOST_MEMBERS: usize = 64;

pub(super) fn number(index: usize) -> u32 {
    u32::try_from(index).unwrap_or(u32::MAX)
}

/// States of which some are taken for one, again and again.
pub(super) struct Merging {
    /// Where in `edges` those of each state begin.
    starts: Vec<u32>,
    edges: Vec<(u32, u32)>,
    states: Vec<InterfaceState>,
    start: u32,
}

impl Merging {
    /// Of these edges, which are gone through twice.
    pub fn new(edges: impl Iterator<Item = (u32, u32, u32)> + Clone, states: Vec<InterfaceState>, start: u32) -> Self {
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

    /// How many states there are.
    pub fn count(&self) -> usize {
        self.states.len()
    }

    /// What is known of each by itself, and which one it starts in.
    pub fn states(self) -> (Vec<InterfaceState>, u32) {
        (self.states, self.start)
    }

    /// What leads on from a state.
    pub fn of(&self, at: u32) -> &[(u32, u32)] {
        &self.edges[self.starts[at as usize] as usize..self.starts[at as usize + 1] as usize]
    }

    /// All edges, and where each comes from.
    fn all(&self) -> impl Iterator<Item = (u32, u32, u32)> + Clone + '_ {
        (0..number(self.states.len())).flat_map(|from| self.of(from).iter().map(move |(by, to)| (from, *by, *to)))
    }

    /// Of each state the number of those that it leads to and that lead back, all silently.
    pub fn silent_rounds(&self) -> Vec<u32> {
        let silent = self.all().filter(|(_, by, _)| *by == SILENT).map(|(from, _, to)| (from, to));
        Adjacency::new(self.states.len(), silent).components()
    }

    /// Of each state the number of the one that it becomes silently, where it can do nothing else.
    pub fn passed_through(&self) -> Vec<u32> {
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
    pub fn alike(&self) -> Vec<u32> {
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

    /// The same where what was seen says which state it is in, but for those that differ by themselves and become each other silently (subset
    /// construction): each stands for all those in which it may be then, and may do what any of them does, no more and no less. None: that makes
    /// more than so many of them.
    pub fn determined(&self, most: usize) -> Option<Self> {
        let mut sets: IndexSet<Rc<[u32]>, FxBuildHasher> = IndexSet::default();
        let (mut met, mut making) = (vec![0_u32; self.states.len()], 0);
        let mut silently_from = |some: &mut dyn Iterator<Item = u32>| -> Rc<[u32]> {
            making += 1;
            let (mut open, mut set): (Vec<u32>, Vec<u32>) = (some.collect(), Vec::new());
            while let Some(at) = open.pop() {
                if std::mem::replace(&mut met[at as usize], making) != making {
                    set.push(at);
                    let silent = self.of(at).iter().take_while(|(by, _)| *by == SILENT).map(|(_, to)| *to);
                    open.extend(silent.filter(|to| self.states[*to as usize] == self.states[at as usize]));
                }
            }
            set.sort_unstable();
            set.into()
        };
        sets.insert(silently_from(&mut std::iter::once(self.start)));
        let (mut edges, mut states, mut members) = (Vec::new(), Vec::new(), 0);
        let mut leads: Vec<(u32, InterfaceState, u32)> = Vec::new();
        while let Some(set) = sets.get_index(states.len()).cloned() {
            members += set.len();
            if sets.len() > most || members > MOST_MEMBERS * self.states.len() {
                return None;
            }
            let (from, own) = (number(states.len()), self.states[set[0] as usize]);
            states.push(own);
            leads.clear();
            let of = |at: &u32| self.of(*at).iter().map(|(by, to)| (*by, self.states[*to as usize], *to));
            leads.extend(set.iter().flat_map(of).filter(|(by, state, _)| *by != SILENT || *state != own));
            leads.sort_unstable();
            for alike in leads.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
                let to = silently_from(&mut alike.iter().map(|(_, _, to)| *to));
                edges.push((from, alike[0].0, number(sets.insert_full(to).0)));
            }
        }
        Some(Self::new(edges.iter().copied(), states, 0))
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
    pub fn merged(&self, of: &[u32]) -> Self {
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
    use proptest::collection::vec;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// Where it may be after what was seen, and what may be seen next.
    fn silently(of: &Merging, some: impl IntoIterator<Item = u32>) -> (BTreeSet<u32>, BTreeSet<u32>) {
        let (mut all, mut open) = (BTreeSet::new(), some.into_iter().collect::<Vec<_>>());
        while let Some(at) = open.pop() {
            if all.insert(at) {
                open.extend(of.of(at).iter().filter(|(by, _)| *by == SILENT).map(|(_, to)| *to));
            }
        }
        let seen = all.iter().flat_map(|at| of.of(*at)).map(|(by, _)| *by).filter(|by| *by != SILENT).collect();
        (all, seen)
    }

    fn kinds(of: &Merging, all: &BTreeSet<u32>) -> BTreeSet<InterfaceState> {
        all.iter().map(|at| of.states[*at as usize]).collect()
    }

    proptest! {
        /// It shows what it showed, in the order in which it did, and is what it was then.
        #[test]
        fn what_is_determined_shows_the_same(
            edges in vec((0_u32..6, 0_u32..4, 0_u32..6), 1..20),
            states in vec((any::<bool>(), any::<bool>()), 6),
            way in vec(0_usize..8, 0..12),
        ) {
            let states = states.into_iter().map(|(down, failed)| InterfaceState { down, failed }).collect();
            let before = Merging::new(edges.iter().copied(), states, 0);
            let Some(after) = before.determined(usize::MAX) else { return Ok(()) };
            let after = after.merged(&after.alike());
            let (mut then, mut now) = (silently(&before, [before.start]), silently(&after, [after.start]));
            for step in way {
                prop_assert_eq!(kinds(&before, &then.0), kinds(&after, &now.0));
                prop_assert_eq!(&then.1, &now.1);
                if then.1.is_empty() {
                    break;
                }
                let seen = *then.1.iter().nth(step % then.1.len()).unwrap();
                let next = |of: &Merging, all: &BTreeSet<u32>| {
                    let to = all.iter().flat_map(|at| of.of(*at)).filter(|(by, _)| *by == seen).map(|(_, to)| *to);
                    silently(of, to)
                };
                (then, now) = (next(&before, &then.0), next(&after, &now.0));
            }
        }
    }

    /// One that may be anywhere after each step is one state for each thing that was seen, and not one for each place.
    #[test]
    fn what_is_seen_says_where_it_is() {
        let edges = (0..20).flat_map(|at| (0..20).map(move |to| (at, 1 + (at + to) % 2, to)));
        let whole = Merging::new(edges, vec![InterfaceState::default(); 20], 0);
        let determined = whole.determined(20).expect("few enough");
        assert_eq!(determined.merged(&determined.alike()).count(), 1);
        let silent = Merging::new([(0, SILENT, 1), (1, SILENT, 0)].into_iter(), vec![InterfaceState::default(); 2], 0);
        assert!(silent.determined(0).is_none(), "more than none");
    }
}
