//! What a subsystem takes of its parent and tells it, and in which order: its interface automaton. Whoever follows the parent asks it what
//! the subsystem may tell next, and follows nothing else of it.
//!
//! It may do everything that was followed of the subsystem, and more: where states are taken for one, each may do what any of them does.

use super::state::Failed;
use crate::model::EventName;
use petgraph::algo::kosaraju_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::hash::BuildHasher;

/// What leads from one state of an interface automaton to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum InterfaceAction {
    /// Nothing that the parent can see.
    Silent,
    /// It takes an event of its parent up; heeded: a transition takes it, or may.
    Takes {
        /// By its name there.
        event: EventName,
        /// See there.
        heeded: bool,
    },
    /// It tells its parent an event; what has failed in it since it was begun, at worst.
    Tells(EventName, Failed),
}

/// What leads on from a state.
type InterfaceEdges = Vec<(InterfaceAction, u32)>;

/// A state of an interface automaton by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct InterfaceState {
    /// It is down, and nobody has begun it since.
    pub down: bool,
    /// Something has failed since it was begun.
    pub failed: bool,
}

/// An interface automaton. Events have the names of the subsystem's own file.
#[derive(Debug, Clone, PartialEq)]
pub struct InterfaceAutomaton {
    /// What leads on from each state.
    edges: Vec<InterfaceEdges>,
    /// What is known of each by itself.
    states: Vec<InterfaceState>,
    start: u32,
}

impl InterfaceAutomaton {
    /// The automaton of these states, as small as it becomes. `edges` have the states as numbers.
    pub fn new(
        edges: impl IntoIterator<Item = (u32, InterfaceAction, u32)>,
        states: Vec<InterfaceState>,
        start: u32,
    ) -> Self {
        let mut whole = Self { edges: vec![Vec::new(); states.len()], states, start };
        for (from, by, to) in edges {
            whole.edges[from as usize].push((by, to));
        }
        let whole = whole.merged(&whole.silent_rounds());
        let whole = whole.merged(&whole.passed_through());
        let whole = whole.merged(&whole.alike());
        whole.merged(&whole.passed_through())
    }

    /// What leads on from a state.
    pub fn leads(&self, at: u32) -> &[(InterfaceAction, u32)] {
        &self.edges[at as usize]
    }

    /// What is known of a state by itself.
    pub fn state(&self, at: u32) -> InterfaceState {
        self.states[at as usize]
    }

    /// Where it starts.
    pub fn start(&self) -> u32 {
        self.start
    }

    /// How many states it has.
    pub fn len(&self) -> usize {
        self.edges.len()
    }

    /// Of each state the number of those that it leads to and that lead back, all silently.
    fn silent_rounds(&self) -> Vec<u32> {
        let mut graph: DiGraph<(), (), u32> = DiGraph::with_capacity(self.len(), self.len());
        for _ in &self.edges {
            graph.add_node(());
        }
        for (from, edges) in self.edges.iter().enumerate() {
            let silent = edges.iter().filter(|(by, _)| *by == InterfaceAction::Silent);
            for (_, to) in silent {
                graph.add_edge(NodeIndex::new(from), NodeIndex::new(*to as usize), ());
            }
        }
        let mut of = vec![0; self.len()];
        for (number, states) in (0u32..).zip(kosaraju_scc(&graph)) {
            states.into_iter().for_each(|state| of[state.index()] = number);
        }
        of
    }

    /// Of each state the number of the one that it becomes silently, where it can do nothing else.
    fn passed_through(&self) -> Vec<u32> {
        let next = |at: u32| match self.edges[at as usize][..] {
            [(InterfaceAction::Silent, to)] if self.state(at) == self.state(to) => Some(to),
            _ => None,
        };
        let mut names: FxHashMap<u32, u32> = FxHashMap::default();
        let mut of = Vec::with_capacity(self.len());
        for at in (0u32..).take(self.len()) {
            // There are no rounds of such steps any more.
            let mut last = at;
            for _ in 0..self.len() {
                let Some(to) = next(last) else { break };
                last = to;
            }
            let name = u32::try_from(names.len()).unwrap_or(u32::MAX);
            of.push(*names.entry(last).or_insert(name));
        }
        of
    }

    /// Of each state the number of those that do the same (bisimilar; silent steps among them count for nothing): the coarsest partition that
    /// is stable, by splitting. A state is looked at anew only where one that it leads to was split off.
    fn alike(&self) -> Vec<u32> {
        let mut before: Vec<Vec<u32>> = vec![Vec::new(); self.len()];
        for (from, edges) in (0u32..).zip(&self.edges) {
            edges.iter().for_each(|(_, to)| before[*to as usize].push(from));
        }
        let block = |state: &InterfaceState| u32::from(state.down) + 2 * u32::from(state.failed);
        let mut of: Vec<u32> = self.states.iter().map(block).collect();
        // Of each block how many are in it, and what those of it do that need not be looked at.
        let mut sizes = vec![0_usize; 4];
        of.iter().for_each(|block| sizes[*block as usize] += 1);
        let mut does: Vec<Option<u64>> = vec![None; 4];
        let mut dirty: Vec<u32> = (0u32..).zip(&of).map(|(at, _)| at).collect();
        while !dirty.is_empty() {
            let mut groups: FxHashMap<(u32, u64), Vec<u32>> = FxHashMap::default();
            let mut looked_at: FxHashMap<u32, usize> = FxHashMap::default();
            for at in std::mem::take(&mut dirty) {
                let block = of[at as usize];
                // That two of so many numbers are the same by chance makes one state of two, which may do more then, and never less.
                let seen = FxBuildHasher.hash_one(self.seen_as(at as usize, &of));
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
                let new = u32::try_from(sizes.len()).unwrap_or(u32::MAX);
                sizes.push(states.len());
                sizes[block as usize] -= states.len();
                does.push(Some(seen));
                for at in states {
                    of[at as usize] = new;
                    // A silent step to the rest of the block is one that counts from now on.
                    dirty.push(at);
                    dirty.extend(before[at as usize].iter().copied());
                }
            }
            dirty.sort_unstable();
            dirty.dedup();
        }
        of
    }

    /// What a state does where states are taken for one.
    fn seen_as(&self, at: usize, of: &[u32]) -> InterfaceEdges {
        let told = self.edges[at].iter().map(|(by, to)| (*by, of[*to as usize]));
        let mut does: InterfaceEdges =
            told.filter(|(by, to)| *by != InterfaceAction::Silent || *to != of[at]).collect();
        does.sort_unstable();
        does.dedup();
        does
    }

    /// The same with the states of one number as one.
    fn merged(&self, of: &[u32]) -> Self {
        // Numbers that nothing has are none.
        let mut numbers: Vec<u32> = of.to_vec();
        numbers.sort_unstable();
        numbers.dedup();
        let name = |number: &u32| u32::try_from(numbers.partition_point(|of| of < number)).unwrap_or(u32::MAX);
        let of: Vec<u32> = of.iter().map(name).collect();
        let (of, len) = (&of[..], numbers.len());
        let mut edges = vec![InterfaceEdges::new(); len];
        let mut states = vec![InterfaceState { down: true, failed: true }; len];
        for at in 0..self.len() {
            let into = of[at] as usize;
            edges[into].extend(self.seen_as(at, of));
            states[into].down &= self.states[at].down;
            states[into].failed &= self.states[at].failed;
        }
        for edges in &mut edges {
            edges.sort_unstable();
            edges.dedup();
        }
        Self { edges, states, start: of[self.start as usize] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            InterfaceAutomaton::new(edges, plain(202), 0).len()
        };
        // The start, what tells, and what leads nowhere.
        assert_eq!(chain(None), 3);
        assert_eq!(chain(Some("down")), 4);
        // In two places at once it is one: what it may do is told apart by what has to be told first.
        let ring = (0..100).flat_map(|at| [(at, WELL, (at + 1) % 100), (at, tells("up"), 100)]);
        assert_eq!(InterfaceAutomaton::new(ring, plain(101), 0).len(), 2);
    }

    #[test]
    fn silent_rounds_are_one_state() {
        let edges = [(0, WELL, 1), (1, WELL, 2), (2, WELL, 0), (1, tells("up"), 3)];
        let whole = InterfaceAutomaton::new(edges, plain(4), 0);
        assert_eq!((whole.len(), whole.leads(whole.start()).len()), (2, 1), "{whole:?}");
    }
}
