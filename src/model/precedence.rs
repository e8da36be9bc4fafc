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
    /// Before those that are queued; one that comes while it waits is the same, unless what begins or ends the deployment came in between:
    /// then it is heard before that and once more after it, for the last word is that of who wants it safe.
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

/// The places of what is taken first of what has come, in the order in which it came: of an urgent one wherever it came, but for what is heard
/// once more. Empty: nothing has come.
pub fn taken_first<E: Copy + PartialEq>(came: &[(E, Precedence)]) -> SmallVec<[usize; 2]> {
    let own = |of: usize| (0..came.len()).filter(move |at| came[*at].0 == came[of].0);
    // Where a safety event is heard once more: behind the last that came before it of what begins and ends the deployment.
    let again = |of: usize| {
        let (first, last) = (own(of).next()?, own(of).last()?);
        let between = (first..last).rfind(|at| came[*at].1 == Precedence::UrgentAsLast)?;
        own(of).find(|at| *at > between)
    };
    let waits_here = |at: &usize| match came[*at].1 {
        Precedence::Queued => false,
        Precedence::Urgent => own(*at).next() == Some(*at) || again(*at) == Some(*at),
        Precedence::UrgentAsLast => own(*at).last() == Some(*at),
    };
    match (0..came.len()).find(waits_here) {
        Some(first) => {
            let until = again(first).filter(|_| came[first].1 == Precedence::Urgent);
            own(first).filter(|at| until.is_none_or(|until| *at < until)).collect()
        }
        None => came.iter().take(1).map(|_| 0).collect(),
    }
}
