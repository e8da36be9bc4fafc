//! What few states of the product have: batches that were stopped, answers on their way, frames that wait for something.
//!
//! Most states have nothing of it. It is behind one pointer, shared by all states that have it of each other until one changes it,
//! and none where there is nothing: so states are small, equal where they are the same, and copied in no time.

use super::outcome::WorldId;
use super::shared_list::SharedList;
use crate::model::{ConfigId, EventName, Verdict};
use crate::stack::{Batch, Request};
use crate::statechart::NodeId;
use std::rc::Rc;

/// A batch under way that a safe configuration has interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Interrupted {
    /// The number of the batch.
    pub number: u32,
    /// The world in which it was planned.
    pub planned: WorldId,
    /// So many undos had given something of it up before.
    pub given_up: usize,
}

/// A frame that waits for its confirmation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Unconfirmed {
    /// Its place among the frames that count.
    pub place: u8,
    /// The request that pushed it.
    pub request: Request,
    /// What confirms it came when it was too late, and what takes it back waits.
    pub late: bool,
}

/// An event that a parent's coordinator has raised for a subsystem, until it was taken, or that it was ignored was heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct RaisedForChild {
    /// The event.
    pub event: EventName,
    /// The coordinator that raised it.
    pub by: u8,
    /// Its state that hears that it was ignored.
    pub owner: NodeId,
    /// The coordinators that have still to come to it, by their bits; none: it was ignored, and that is not heard yet.
    pub waits: u64,
}

/// What few states have.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Seldom {
    /// Batches under way that are interrupted.
    pub interrupted: SharedList<Interrupted>,
    /// Batches under way that were begun as one, of which some requests were answered since.
    pub joined: SharedList<u32>,
    /// Batches under way whose pushes found their place only where frames can be squashed: what others hold on to since does
    /// not take it away.
    pub placed: SharedList<u32>,
    /// Safe configurations that are being applied, in their order.
    pub safe: SharedList<Request>,
    /// Answers on their way.
    pub due: SharedList<(Request, Verdict)>,
    /// Answers that are given and not heard yet; where coordinators hear them at once, none in a state between moves.
    pub telling: SharedList<(Request, Verdict)>,
    /// Frames that wait for their confirmation.
    pub unconfirmed: SharedList<Unconfirmed>,
    /// Configurations that were asked for, and whose confirmation has come before they are there.
    pub confirmed: SharedList<ConfigId>,
    /// Configurations that were lost, and are not applied anew.
    pub lost: SharedList<ConfigId>,
    /// Configurations in force of which something that ran when they were applied was stopped since: what they stand for is watched
    /// no more.
    pub over: SharedList<ConfigId>,
    /// Batches on their way, the first of which would stop what is under way: what it would stop ends before.
    pub in_transit: SharedList<Batch>,
    /// Coordinators that have moved since the inboxes were empty, by their bits. Kept only where events come meanwhile.
    pub moved: u64,
    /// Events that were raised for subsystems and are not taken yet. Kept only where these are followed with their parent.
    pub offered: SharedList<RaisedForChild>,
}

/// Nothing of it.
pub const NOTHING: &Seldom = &Seldom {
    interrupted: SharedList::new(),
    joined: SharedList::new(),
    placed: SharedList::new(),
    safe: SharedList::new(),
    due: SharedList::new(),
    telling: SharedList::new(),
    unconfirmed: SharedList::new(),
    confirmed: SharedList::new(),
    lost: SharedList::new(),
    over: SharedList::new(),
    in_transit: SharedList::new(),
    moved: 0,
    offered: SharedList::new(),
};

/// The same as a state has it: none where it has nothing of it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct SharedSeldom(Option<Rc<Seldom>>);

impl SharedSeldom {
    /// What there is of it.
    pub fn get(&self) -> &Seldom {
        self.0.as_deref().unwrap_or(NOTHING)
    }

    /// Whether there is nothing of it.
    pub fn is_nothing(&self) -> bool {
        self.0.is_none()
    }

    /// Lets something change it.
    pub fn change<R>(&mut self, with: impl FnOnce(&mut Seldom) -> R) -> R {
        let seldom = Rc::make_mut(self.0.get_or_insert_with(|| Rc::new(NOTHING.clone())));
        let answer = with(seldom);
        if *seldom == *NOTHING {
            self.0 = None;
        }
        answer
    }
}
