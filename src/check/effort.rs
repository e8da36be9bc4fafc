//! How much is followed, and who is asked meanwhile whether it goes on.

use crate::limits;

/// How far following a file has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Far {
    /// States that were met.
    pub states: usize,
    /// Transitions that were followed.
    pub transitions: usize,
}

impl Far {
    /// This and another one, as one.
    pub fn and(self, other: Self) -> Self {
        Self { states: self.states + other.states, transitions: self.transitions + other.transitions }
    }
}

/// Why following ends before its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Halt {
    /// It takes up as much memory as it may.
    Memory,
    /// Somebody wants what there is so far.
    Interrupted,
}

/// How much is followed. `check` itself looks at no clock, no memory and no signals: who wants an end by these is asked.
#[derive(Clone, Copy)]
pub struct Effort<'e> {
    /// So many transitions of coordinators that are followed together, at most.
    pub transitions: usize,
    /// So many states of coordinators that are followed together, at most.
    pub states: usize,
    /// What failed undos leave is known one at a time where so many configurations may be left, at least ([`undo_failed`](super::undo_failed)); where
    /// they are fewer, following every subset of them is less.
    pub aside_from: usize,
    /// Coordinators that have nothing to do with each other are followed together all the same, and so are all files of a deployment with
    /// subsystems.
    pub together: bool,
    /// Told every few thousand states how far it is; an error ends it there, and what was left out is said. Files of a deployment with subsystems
    /// are followed side by side: each thread tells of its own.
    pub goes_on: &'e (dyn Fn(Far) -> Result<(), Halt> + Sync),
}

impl Effort<'_> {
    /// So many transitions at most while all is known of the order in which subsystems tell things: three of eight, and
    /// [`limits::CHECK_BELIEVED`] at least.
    pub(super) fn believed(&self) -> usize {
        (self.transitions / 8).saturating_mul(3).max(limits::CHECK_BELIEVED).min(self.transitions)
    }

    /// So many states of a subsystem, as often as they differ for its parent, of which an interface automaton is made: as many as an eighth of the
    /// transitions, and [`limits::CHECK_PLACES`] at least.
    pub(super) fn places(&self) -> usize {
        (self.transitions / 8).max(limits::CHECK_PLACES)
    }
}

impl Default for Effort<'_> {
    /// [`limits::CHECK_TRANSITIONS`], any number of states, and to the end.
    fn default() -> Self {
        Self {
            transitions: limits::CHECK_TRANSITIONS,
            states: usize::MAX,
            aside_from: limits::CHECK_ASIDE,
            together: false,
            goes_on: &|_| Ok(()),
        }
    }
}

/// The effort that is still to be made.
pub(super) struct Left<'e> {
    effort: Effort<'e>,
    halted: Option<Halt>,
}

impl<'e> From<Effort<'e>> for Left<'e> {
    fn from(effort: Effort<'e>) -> Self {
        Self { effort, halted: None }
    }
}

impl Left<'_> {
    /// The same, with so many transitions at most.
    pub fn at_most(&self, transitions: usize) -> Self {
        Effort { transitions: transitions.min(self.effort.transitions), ..self.effort }.into()
    }

    /// [`Effort::believed`].
    pub fn believed(&self) -> usize {
        self.effort.believed()
    }

    /// [`Effort::places`].
    pub fn places(&self) -> usize {
        self.effort.places()
    }

    /// So many transitions at most.
    pub fn transitions(&self) -> usize {
        self.effort.transitions
    }

    /// So many states at most.
    pub fn states(&self) -> usize {
        self.effort.states
    }

    /// Why it ended, once it has.
    pub fn halted(&self) -> Option<Halt> {
        self.halted
    }

    /// Tells how far it is, after every [`limits::CHECK_TELL`] states that were looked at. False: no further.
    pub fn goes_on(&mut self, looked_at: usize, far: Far) -> bool {
        if self.halted.is_none() && looked_at.is_multiple_of(limits::CHECK_TELL) {
            self.halted = (self.effort.goes_on)(far).err();
        }
        self.halted.is_none()
    }
}
