//! A way up or down that is tried with every request answered *ok*, and what is tried.

use super::members::Member;
use super::product::Product;
use super::state::{Next, ProductState};
use super::timers::Timer;
use crate::model::{EventName, Findings};
use crate::stack::Request;
use crate::statechart::NodeId;
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
}

impl Way {
    /// The state at the end.
    pub fn end(&self) -> &ProductState {
        self.moves.last().map_or(&self.from, |next| &next.state)
    }
}

impl Tried {
    /// The first of these moves after which a bring-up has failed, though every request is answered *ok*: by which
    /// coordinator, and its place.
    pub(super) fn fails(&self, product: &Product<'_>, moves: &[Next]) -> Option<(usize, usize)> {
        let failing = |(at, next): (usize, &Next)| product.failed_in(&next.state).map(|by| (by, at));
        moves.iter().enumerate().filter(|_| !self.stopping).find_map(failing)
    }
}

/// Which state of a coordinator is the goal.
pub type Goal = fn(&Member<'_>) -> Option<NodeId>;
