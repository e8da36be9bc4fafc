//! A way up or down that is tried with every request answered *ok*, and what is tried.

use super::members::Member;
use super::product::Product;
use super::state::{Next, ProductState};
use super::timers::Timer;
use crate::model::{EventName, Findings};
use crate::stack::Request;
use crate::statechart::{EventId, NodeId};
use std::time::Duration;

/// A way: states with what leads to them.
pub struct Way {
    pub from: ProductState,
    pub moves: Vec<Next>,
    pub reached: bool,
    pub refused: Option<(Request, Findings)>,
    /// It ends where a coordinator is in a state that means that the bring-up has failed.
    pub failed: Option<usize>,
    /// No way lasts shorter: so long, and what it waits for. Only where it has less time.
    pub late: Option<(Duration, Vec<Timer>)>,
    /// Another way would wait for the first of these, and the second always comes before it.
    pub overtaken: Option<(Timer, Timer)>,
    /// It does not arrive as far as was looked: there are too many ways.
    pub unfollowed: bool,
    /// It does not arrive, and neither this coordinator nor anybody whom it has to do with waits for what comes first.
    pub unheard: Option<usize>,
    /// It does not arrive, and would in another order of answers and of what coordinators tell each other.
    pub in_this_order: bool,
}

/// What is tried.
pub struct Tried {
    /// The event that it begins with.
    pub first: EventName,
    /// The event that does not come on it.
    pub never: EventName,
    /// Stopping has begun: not every event comes any more.
    pub stopping: bool,
    /// So much time there is.
    pub within: Duration,
    /// Coordinators for which no operator raises anything: neither they nor those whom they have to do with hear what it begins with, so
    /// nobody knows to.
    pub unreached: Vec<usize>,
}

impl Way {
    /// The state at the end.
    pub fn end(&self) -> &ProductState {
        self.moves.last().map_or(&self.from, |next| &next.state)
    }
}

impl Tried {
    /// The same from that state on, to that goal. Who has nothing to do with those that hear what it begins with has to be led there by itself,
    /// as where it is alone.
    pub(super) fn from(self, product: &mut Product<'_>, state: &ProductState, goal: Goal) -> Self {
        let groups = product.groups.clone();
        let mut unreached = Vec::new();
        for group in groups.iter().filter(|_| groups.len() > 1) {
            if !group.iter().any(|at| product.members[*at].takes(state.leaves[*at], self.first)) {
                unreached.extend(group.iter().copied().filter(|at| !product.are_in(state, goal, Some(&[*at]))));
            }
        }
        Self { unreached, ..self }
    }

    /// Whether an operator would have to raise an event for some for whom nobody does. What a monitor, a component of the simulated platform or
    /// a subsystem tells comes by itself.
    pub(super) fn is_for_unreached(&self, product: &Product<'_>, name: EventName) -> bool {
        let hears = |at: &usize| product.members[*at].chart.event(name) != EventId::OTHER;
        self.unreached.iter().any(hears) && !product.is_told_by_child(name) && !product.is_reported(name)
    }

    /// The first of these moves after which a bring-up has failed, though every request is answered *ok*: by which
    /// coordinator, and its place.
    pub(super) fn fails(&self, product: &Product<'_>, moves: &[Next]) -> Option<(usize, usize)> {
        let failing = |(at, next): (usize, &Next)| product.failed_in(&next.state).map(|by| (by, at));
        moves.iter().enumerate().filter(|_| !self.stopping).find_map(failing)
    }
}

/// Which state of a coordinator is the goal.
pub type Goal = fn(&Member<'_>) -> Option<NodeId>;
