//! What is said of worlds: where something leads to, and what a batch or a safe configuration comes to in one.

use super::desks::AnsweredPlaces;
use super::kept::KeptValue;
use crate::model::codes::STACK_FULL;
use crate::model::{ConfigId, Findings, Verdict};
use crate::stack::{Ending, Endings, FrameId, Group, LedDown, Request, Requester, Told};
use crate::transaction::{Stopping, endings};
use smallvec::SmallVec;
use std::cell::OnceCell;
use std::rc::Rc;

/// The number of a world.
pub type WorldId = u32;

/// The world in which nothing was applied.
pub const EMPTY: WorldId = 0;

/// Where frames stand that count.
#[derive(Debug)]
pub struct FramePlaces {
    /// Of each that counted before, its place among those that count now.
    pub of: Vec<Option<u8>>,
    /// The places of those that were pushed, with the configurations.
    pub pushed: SmallVec<[(ConfigId, u8); 1]>,
}

/// Where something leads to.
#[derive(Debug, Clone)]
pub struct Went {
    /// The world.
    pub world: WorldId,
    /// Where frames stand then; none: nothing was asked about that.
    pub places: Option<Rc<FramePlaces>>,
    /// A configuration of which one requester has more than [`limits::CHECK_FRAMES`] frames then.
    pub deep: Option<ConfigId>,
    /// The same with [`limits::CHECK_LEFT`].
    pub left: Option<ConfigId>,
}

/// A configuration, and who asked for it.
pub type Whose = (ConfigId, Requester);

/// Frames that must stay as they are.
pub type Held = SmallVec<[FrameId; 2]>;

impl Went {
    /// To a world of which no frames are known.
    pub fn to(world: WorldId) -> Self {
        Self { world, places: None, deep: None, left: None }
    }
}

/// What is under way beside a batch, as far as the batch minds it.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct ConcurrentWork {
    /// Frames that others pop or hand over to, or that wait for their confirmation.
    pub held: Held,
    /// The batch was begun as one, and some of it were answered since.
    pub joined: bool,
    /// Its pushes have taken their place.
    pub placed: bool,
    /// It takes along what stands in its way, while this is led down.
    pub led: Option<LedDown>,
}

/// What the first requests of a batch come to.
#[derive(Debug, Clone)]
pub struct Comes {
    /// The first requests as the stack decides.
    pub group: DecidedGroup,
    /// Those that are told because they are refused.
    pub refused: Box<[(usize, Rc<Findings>)]>,
    /// Those that can only fail, since what they stand for is false when all is done.
    pub hollow: Box<[(usize, Rc<Findings>)]>,
    /// What planning warns of, if of anything.
    pub warnings: Option<Rc<Findings>>,
    /// The frames that it pops or hands over to.
    pub holds: Box<[FrameId]>,
    /// Of each part of the group, whether something in it can fail.
    pub can_fail: SmallVec<[bool; 2]>,
    /// When all is done.
    pub done: Went,
    /// Of each part: when it was given up, and when it failed; those before it stand.
    pub(super) stopped: Box<[(Went, Option<Went>)]>,
    /// How it may end where nothing stops it, once that was asked.
    pub(super) ends: OnceCell<KeptValue<Vec<EndsSo>>>,
    /// How it may end where a safe configuration interrupts it, and nothing of it was given up.
    pub(super) interrupted: OnceCell<KeptValue<Vec<InterruptedSo>>>,
}

/// One way in which the first requests of a batch may end where a safe configuration interrupts them.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct InterruptedSo {
    /// Something of them is left in between.
    pub broken: bool,
    /// The places of the undos whose frames stay.
    pub stay: SmallVec<[usize; 2]>,
    /// Who is answered what.
    pub given: KeptValue<AnsweredPlaces>,
}

/// One way in which the first requests of a batch may end.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct EndsSo {
    /// How their parts end.
    pub endings: Endings,
    /// Who is answered what.
    pub given: KeptValue<AnsweredPlaces>,
}

/// What the stack decides of a batch ([`Group`]), without the plan and the reasons, and in little room: there is one for each world in which
/// the batch was asked for.
#[derive(Debug, Clone)]
pub struct DecidedGroup {
    takes: u32,
    commits: bool,
    places: Box<[u32]>,
    visits: Box<[Option<FrameId>]>,
    told: Box<[(u32, Option<Verdict>)]>,
    stay: Box<[(u32, FrameId)]>,
}

impl DecidedGroup {
    /// The same as what was decided.
    pub fn of(group: &Group) -> Self {
        let place = |place: usize| u32::try_from(place).unwrap_or(u32::MAX);
        Self {
            takes: place(group.takes),
            commits: group.commits,
            places: group.places.iter().map(|at| place(*at)).collect(),
            visits: group.visits.iter().copied().collect(),
            told: group.told.iter().map(|told| (place(told.place), told.verdict)).collect(),
            stay: group.stay.iter().map(|(at, frame)| (place(*at), *frame)).collect(),
        }
    }

    /// As the stack has it, for who settles it.
    pub fn group(&self) -> Group {
        let told = |(place, verdict): &(u32, Option<Verdict>)| Told {
            place: *place as usize,
            verdict: *verdict,
            reason: None,
        };
        Group {
            takes: self.takes as usize,
            commits: self.commits,
            places: self.places().collect(),
            visits: self.visits.iter().copied().collect(),
            told: self.told.iter().map(told).collect(),
            stay: self.stay.iter().map(|(at, frame)| (*at as usize, *frame)).collect(),
            ..Group::default()
        }
    }

    /// Of each part, the place of its request in the batch.
    pub fn places(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        self.places.iter().map(|place| *place as usize)
    }

    /// The frames that were to be undone with the state they belong to, and stay.
    pub fn staying(&self) -> impl Iterator<Item = FrameId> + '_ {
        self.stay.iter().map(|(_, frame)| *frame)
    }

    /// The place of the request of a part.
    pub fn place(&self, part: usize) -> usize {
        self.places[part] as usize
    }
}

impl Comes {
    /// Where it leads to that the parts ended so; none: something is left in between, or all was interrupted.
    pub fn went(&self, endings: &[Ending]) -> Option<&Went> {
        match endings.iter().enumerate().find(|(_, ending)| **ending != Ending::Done) {
            None => Some(&self.done),
            Some((part, Ending::Cancelled)) => Some(&self.stopped[part].0),
            // What cannot fail by itself is as if it had been given up.
            Some((part, Ending::Failed)) => {
                let (cancelled, failed) = &self.stopped[part];
                Some(failed.as_ref().unwrap_or(cancelled))
            }
            _ => None,
        }
    }

    /// How it may end. What says of itself what is false does not end as done.
    pub fn endings(&self, stop: Stopping<'_>, each: bool) -> impl Iterator<Item = Endings> + use<> {
        let hollow = !self.hollow.is_empty();
        let all_done = |endings: &Endings| endings.iter().all(|ending| *ending == Ending::Done);
        endings(&self.can_fail, stop, each).into_iter().filter(move |endings| !hollow || !all_done(endings))
    }

    /// Whether a push is refused because the stack is full.
    pub fn lacks_room(&self) -> bool {
        self.refused.iter().any(|(_, why)| why.iter().any(|finding| finding.code == STACK_FULL))
    }

    /// So many requests are settled then.
    pub fn takes(&self) -> usize {
        (self.group.takes as usize).max(1)
    }

    /// Whether a part undoes something.
    pub fn undoes(&self, part: usize, requests: &[Request]) -> bool {
        requests[self.group.place(part)].ask.is_undo()
    }
}

/// What a safe configuration comes to.
#[derive(Debug, Clone)]
pub struct SafeComes {
    /// When all of it is done that can be.
    pub done: Went,
    /// How it is answered then.
    pub verdict: Verdict,
    /// What of it cannot be done there: then it ends *broken*.
    pub troubles: Rc<Findings>,
    /// Whether a step of it can fail.
    pub may_fail: bool,
}
