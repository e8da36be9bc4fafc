//! An interface automaton as it is found, made as small as it becomes: of hundreds of thousands of states, some hundreds. So what leads on from
//! a state is a piece of one list, and what an edge does is a number.

use super::automaton::{InterfaceAction, InterfaceAutomaton, InterfaceEdges, InterfaceState};
use super::chunks::Chunks;
use super::merging::{Merging, SILENT, number};
use indexmap::IndexSet;
use rustc_hash::FxBuildHasher;

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
        let whole = match whole.determined(whole.count()) {
            Some(determined) => determined.merged(&determined.alike()),
            None => whole,
        };
        let edges: Vec<InterfaceEdges> = (0..number(whole.count()))
            .map(|at| {
                let mut edges: Vec<_> = whole.of(at).iter().map(|(by, to)| (actions[*by as usize], *to)).collect();
                edges.sort_unstable();
                edges
            })
            .collect();
        let (states, start) = whole.states();
        InterfaceAutomaton::of(edges, states, start)
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
        // What may still tell, and what leads nowhere, or tells once more.
        assert_eq!(chain(None), 2);
        assert_eq!(chain(Some("down")), 2);
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
