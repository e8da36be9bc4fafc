//! What a subsystem takes of its parent and tells it, and in which order: its interface automaton. Whoever follows the parent asks it what
//! the subsystem may tell next, and follows nothing else of it.
//!
//! It may do everything that was followed of the subsystem, and more: where states are taken for one, each may do what any of them does.

#[cfg(test)]
use super::automaton_draft::AutomatonDraft;
use super::state::Failed;
use crate::model::EventName;

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
pub(super) type InterfaceEdges = Vec<(InterfaceAction, u32)>;

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
    #[cfg(test)]
    pub fn new(
        edges: impl IntoIterator<Item = (u32, InterfaceAction, u32)>,
        states: Vec<InterfaceState>,
        start: u32,
    ) -> Self {
        let mut draft = AutomatonDraft::default();
        for state in states {
            draft.add(state);
        }
        edges.into_iter().for_each(|(from, by, to)| draft.lead(from, by, to));
        draft.finished(start)
    }

    /// One of which all is known; `edges` in their order, each once.
    pub(super) fn of(edges: Vec<InterfaceEdges>, states: Vec<InterfaceState>, start: u32) -> Self {
        Self { edges, states, start }
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
    #[cfg(test)]
    pub fn len(&self) -> usize {
        self.edges.len()
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
