//! Which of the events that have come to a coordinator it takes first. A running coordinator's inbox keeps lists, so that this
//! costs it nothing (`coordinator/inbox`, held against this by a test); `check` asks here.

use super::deployment::Deployment;
use super::names::EventName;
use smallvec::SmallVec;

/// When an event is taken that waits among others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precedence {
    /// What came first goes first.
    #[default]
    Queued,
    /// Before those that are queued; one that comes while it waits is the same.
    Urgent,
    /// The same, but it waits from then on where it came last: which of those that begin and end a deployment came last says
    /// where that is to go.
    UrgentAsLast,
}

impl Precedence {
    /// Whether it goes before those that are queued.
    pub fn is_urgent(self) -> bool {
        self != Self::Queued
    }
}

impl Deployment {
    /// When a coordinator of it takes an event.
    pub fn precedence(&self, event: EventName) -> Precedence {
        match self.urgent().any(|urgent| urgent == event) {
            false => Precedence::Queued,
            true if [self.deploy.event, self.shutdown.event].contains(&event) => Precedence::UrgentAsLast,
            true => Precedence::Urgent,
        }
    }
}

/// The places of what is taken first of what has come, in the order in which it came: of an urgent one wherever it came. Empty:
/// nothing has come.
pub fn taken_first<E: Copy + PartialEq>(came: &[(E, Precedence)]) -> SmallVec<[usize; 2]> {
    let comes_again = |at: usize| came[at + 1..].iter().any(|(other, _)| *other == came[at].0);
    let waits_here = |at: usize| came[at].1 == Precedence::Urgent || !comes_again(at);
    let urgent = (0..came.len()).find(|at| came[*at].1.is_urgent() && waits_here(*at));
    match urgent {
        Some(first) => (0..came.len()).filter(|at| came[*at].0 == came[first].0).collect(),
        None => came.iter().take(1).map(|_| 0).collect(),
    }
}
