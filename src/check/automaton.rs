//! What a subsystem takes of its parent and tells it, and in which order: its interface automaton. Whoever follows the parent asks it what
//! the subsystem may tell next, and follows nothing else of it.
//!
//! It may do everything that was followed of the subsystem, and more: where states are taken for one, each may do what any of them does.

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
