//! The states of the product, and the moves between them.

use super::desks::KeptDesk;
use super::outcome::WorldId;
use super::seldom::{Interrupted, Seldom, SharedSeldom};
use super::shared_list::SharedList;
use crate::model::codes::{STACK_EMPTY, STACK_NO_FRAME};
use crate::model::{Ask, ComponentName, ConfigId, EventName, Findings, Verdict};
use crate::stack::{Batch, Request, Requester};
use crate::statechart::{EventId, NodeId};
use smallvec::SmallVec;
use std::ops::Deref;
use std::rc::Rc;

/// The worst that failed on a way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Failed {
    /// Nothing did.
    Nothing,
    /// A configuration was not applied, or did not stay: to be expected, and the coordinator's to deal with.
    Apply,
    /// Something could not be undone: it stays in force, and not every coordinator can go on from there. A shutdown that
    /// gets stuck on it is forced.
    Undo,
    /// Something is left in between, and nothing is known any more.
    Broken,
}

/// A state of the product.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct ProductState {
    /// Where each coordinator is.
    pub leaves: SmallVec<[NodeId; 2]>,
    /// System and stack.
    pub world: WorldId,
    /// What waits and what is under way.
    pub desk: KeptDesk,
    /// Events on their way to a coordinator, those of one in order.
    pub inbox: SharedList<(u8, EventId)>,
    /// Components that ran when something in force was applied, and that what it stands for looks at.
    pub stands: SharedList<(ConfigId, ComponentName)>,
    /// What few states have.
    pub seldom: SharedSeldom,
    /// An undo that waited was cancelled by a safe configuration, and its frame stays; false in a state between moves.
    pub stayed: bool,
    /// Frames whose undo has failed were set aside: they may be there ([`undo_failed`](super::undo_failed)).
    pub aside: bool,
    /// The event that ends the deployment has come, and it is not down yet. Kept only where it makes a difference.
    pub stopping: bool,
    /// The same as the configurator knows it: until all coordinators have come to *down*. Kept only where an operator may have
    /// put something in their way.
    pub leaving: bool,
    /// A safe configuration of those who have nothing to do with these has come since it is being stopped, and is in force.
    pub elsewhere: bool,
    /// An event came while some had not heard yet what came before.
    pub across: bool,
    /// Coordinators that have come to *down* and asked for nothing since, by their bits.
    pub down: u64,
    /// How its subsystems stand, as far as their parent can know ([`promises`](super::promises)).
    pub children: u64,
    /// What is known of each of them ([`belief`](super::belief)); of those that are not here, what is known at the start.
    pub beliefs: SharedList<u32>,
    /// What was told its parent since the last move, and what was raised for a subsystem in vain; empty in a state between moves.
    pub told: SharedList<EventName>,
}

impl Clone for ProductState {
    /// There are a dozen copies for each state that is met: where the coordinators are is copied as bytes.
    fn clone(&self) -> Self {
        Self {
            leaves: SmallVec::from_slice(&self.leaves),
            desk: self.desk.clone(),
            inbox: self.inbox.clone(),
            stands: self.stands.clone(),
            seldom: self.seldom.clone(),
            beliefs: self.beliefs.clone(),
            told: self.told.clone(),
            ..*self
        }
    }
}

impl Deref for ProductState {
    type Target = Seldom;

    /// What few states have is read as what all have.
    fn deref(&self) -> &Seldom {
        self.seldom.get()
    }
}

impl ProductState {
    /// Whether nothing of that one waits or is being done, nor what is safe.
    pub fn has_answered(&self, by: Requester) -> bool {
        let own = |request: &Request| request.requester == by;
        self.desk.has_answered(by) && !self.safe.iter().any(own) && !self.undos().any(own)
    }

    /// Batches of a requester that are not answered. That it has come to *down* once counts for nothing.
    pub fn outstanding(&self, by: Requester) -> usize {
        // Most states have nothing.
        if self.desk.is_empty() && self.seldom.is_nothing() {
            return 0;
        }
        let first = |batch: &&Batch| batch.requests.first().is_some_and(|request| request.requester == by);
        let under_way = self.desk.under_way().iter().map(|active| &active.batch);
        let (mut downs, mut batches) = (0_usize, 0);
        for batch in under_way.chain(self.desk.waiting()).filter(first) {
            *(if batch.is_down() { &mut downs } else { &mut batches }) += 1;
        }
        let due = usize::from(self.is_owed(by));
        let safe = self.safe.iter().filter(|request| request.requester == by).count();
        let given_up = self.undos().filter(|undo| undo.requester == by).count();
        batches + downs.saturating_sub(1) + due + safe + given_up
    }

    /// Whether an answer to a requester is on its way: what the configurator answers it later comes after that.
    pub fn is_owed(&self, by: Requester) -> bool {
        self.due.iter().any(|(request, _)| request.requester == by)
    }

    /// Undos that give something up.
    pub fn undos(&self) -> impl Iterator<Item = &Request> {
        self.desk.under_way().iter().flat_map(|active| active.given_up.iter().map(|given_up| &given_up.undo))
    }

    /// Whether a batch under way is interrupted.
    pub fn interrupted(&self, number: u32) -> Option<&Interrupted> {
        self.interrupted.iter().find(|of| of.number == number)
    }

    /// The world in which a batch under way was planned.
    pub fn planned(&self, number: u32) -> WorldId {
        self.interrupted(number).map_or(self.world, |interrupted| interrupted.planned)
    }

    /// Whether a batch under way is interrupted, or something of it was given up.
    pub fn is_stopped(&self, number: u32) -> bool {
        self.interrupted(number).is_some() || self.desk.active(number).is_some_and(|active| !active.given_up.is_empty())
    }

    /// How many requests are not answered.
    pub fn waiting(&self) -> usize {
        let under_way: usize = self.desk.under_way().iter().map(|active| active.batch.requests.len()).sum();
        self.desk.len() + under_way + self.safe.len() + self.due.len() + self.undos().count()
    }

    /// Whether nothing waits to be answered or heard.
    pub fn is_at_rest(&self) -> bool {
        let seldom = &**self;
        self.desk.is_empty()
            && self.inbox.is_empty()
            && seldom.safe.is_empty()
            && seldom.due.is_empty()
            && seldom.telling.is_empty()
            && seldom.in_transit.is_empty()
    }

    /// Lets something change what few states have.
    pub fn change<R>(&mut self, with: impl FnOnce(&mut Seldom) -> R) -> R {
        self.seldom.change(with)
    }

    /// Nothing waits for its confirmation any more.
    pub fn waits_for_none(&mut self) {
        if !self.unconfirmed.is_empty() {
            self.change(|seldom| seldom.unconfirmed.clear());
        }
    }

    /// A batch is no longer under way, or begins anew: how it was stopped means nothing any more.
    pub fn forget_batch(&mut self, number: u32) {
        let of = |seldom: &Seldom| {
            let interrupted = seldom.interrupted.iter().any(|of| of.number == number);
            interrupted || seldom.joined.contains(&number) || seldom.placed.contains(&number)
        };
        if !self.seldom.is_nothing() && of(self) {
            self.change(|seldom| {
                seldom.interrupted.retain(|of| of.number != number);
                seldom.joined.retain(|of| *of != number);
                seldom.placed.retain(|of| *of != number);
            });
        }
    }
}

/// What leads from one state to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Move {
    /// An event comes from outside, by its place among them.
    Event(u16),
    /// An event comes from outside, by its place among them, and nobody hears it.
    Dropped(u16),
    /// A subsystem tells an event, by its place among those from outside, that nobody waits for there.
    Unheard(u16),
    /// Time passes for a coordinator.
    Time(u8, EventId),
    /// A coordinator takes what lies in its inbox.
    Taken(u8, EventId),
    /// Requests are answered.
    Answer,
    /// A confirmation comes.
    Confirmed(ConfigId),
    /// What a configuration stands for is no longer so.
    Lost(ConfigId),
    /// An operator asks for something.
    Operator(Ask),
    /// Coordinators that have nothing to do with these are down as well.
    OthersDown,
    /// A safe configuration comes that has nothing to do with these, and interrupts what is under way.
    Elsewhere(ConfigId),
    /// The same cycle again and again, until frames are squashed.
    Rounds,
}

/// The answers that a move gives.
pub type Answers = SharedList<(Request, Verdict)>;

/// Reactions of the simulated platform, by their places among them.
pub type Reacts = SmallVec<[u16; 2]>;

/// States, mostly one.
pub type States = SmallVec<[ProductState; 1]>;

/// One of them.
pub fn one(state: ProductState) -> States {
    SmallVec::from_buf([state])
}

/// These as well. Mostly they are the first.
pub fn add(all: &mut States, more: States) {
    if all.is_empty() {
        *all = more;
    } else {
        all.extend(more);
    }
}

/// A state that follows.
#[derive(Debug, Clone)]
pub struct Next {
    /// What leads there.
    pub by: Move,
    /// The answers given.
    pub answers: Answers,
    /// The state.
    pub state: ProductState,
    /// What its parent is told on the way, as far as that is looked at, and what is raised for a subsystem in vain.
    pub told: SharedList<EventName>,
    /// What failed.
    pub failed: Failed,
    /// A configuration of which there are more frames than are followed, and more than are followed behind undoings that
    /// failed.
    pub deep: (Option<ConfigId>, Option<ConfigId>),
    /// An operator asks for a safe configuration.
    pub by_hand: bool,
}

/// What is wrong with a move.
#[derive(Debug, Clone)]
pub enum Trouble {
    /// The request is refused.
    Refused(Request, Rc<Findings>),
    /// The request can only fail: what it stands for is false when it has been applied.
    Hollow(Request, Rc<Findings>),
    /// Nobody hears that this is lost, or was taken back unconfirmed.
    Unhandled(ConfigId, Verdict),
}

impl Trouble {
    /// Whether something stays in force because another one above it does: that it is asked for in vain is told as what it is, and
    /// whoever goes on asking is no further from *down* than the one above it.
    pub fn stays_in_force(&self) -> bool {
        let Self::Refused(request, reasons) = self else { return false };
        request.ask.is_undo()
            && reasons.first().is_some_and(|first| ![STACK_EMPTY, STACK_NO_FRAME].contains(&first.code))
    }
}

/// All that follows from a state.
#[derive(Debug, Default)]
pub struct Nexts {
    /// The states.
    pub all: Vec<Next>,
    /// What is wrong.
    pub troubles: Vec<Trouble>,
    /// What planning warns of.
    pub warnings: Vec<Rc<Findings>>,
    /// Events were heard here and not followed, since too many requests wait.
    pub cut: bool,
}

impl Next {
    /// A state that comes without an answer.
    pub(super) fn plain(by: Move, state: ProductState, failed: Failed) -> Self {
        Self::answered(by, Answers::new(), state, failed)
    }

    /// A state that comes with answers.
    pub(super) fn answered(by: Move, answers: Answers, mut state: ProductState, failed: Failed) -> Self {
        let failed = if std::mem::take(&mut state.stayed) { failed.max(Failed::Undo) } else { failed };
        let told = std::mem::take(&mut state.told);
        Self { by, answers, state, told, failed, deep: (None, None), by_hand: false }
    }
}

/// A coordinator's bit: there are no more of them than that ([`limits::COORDINATORS`](crate::limits::COORDINATORS)).
pub fn bit(number: usize) -> u64 {
    1 << number.min(63)
}

/// A coordinator's number as a state has it.
pub fn index(number: usize) -> u8 {
    u8::try_from(number).unwrap_or(u8::MAX)
}
