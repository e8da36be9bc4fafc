//! A transaction under way: what it is for, and its calls that are out.

use super::inbox::PoolTicket;
use crate::limits;
use crate::model::{Ask, ConfigId, RequestId};
use crate::platform::{Platform, StepBatch};
use crate::stack::{Frame, FrameId, Group, Request};
use crate::time::Time;
use crate::transaction::{Question, Touched, Transaction};
use smallvec::SmallVec;

/// A call that is out.
pub(super) struct OutstandingCall {
    pub ticket: PoolTicket,
    /// The steps, by their numbers in the list in hand, and how many of them are back.
    pub steps: SmallVec<[u32; 1]>,
    pub back: usize,
    pub batch: StepBatch,
    /// It was given up: it is waited for no longer.
    pub bound: Time,
}

impl OutstandingCall {
    /// When it must have told something.
    pub fn deadline(&self) -> Time {
        self.batch.deadline().min(self.bound) + limits::PLATFORM_GRACE
    }

    pub fn is_of(&self, step: u32) -> bool {
        self.steps[self.back..].contains(&step)
    }

    /// No further one of its steps is to begin; the platform is told what it has taken.
    fn stop(&self, platform: &dyn Platform) {
        if self.steps.len() > 1 && !self.batch.is_stopped() {
            self.batch.stop();
            // The first may have begun, and goes on.
            self.batch.under_way().iter().skip(1).for_each(|timed| platform.cancel(&timed.step));
        }
    }
}

/// A condition that is being evaluated for a transaction, and until when it is waited for.
pub(super) struct AskedBatch {
    pub question: Question,
    pub number: u64,
    pub until: Time,
}

/// What a transaction is for.
#[allow(clippy::large_enum_variant)] // nearly always the large one, once for each request
pub(super) enum Purpose {
    /// Requests of a batch under way on the desk, by its number.
    Requests(u32, Group),
    /// A safe configuration: its request, the frame it leaves, and what it touches.
    Safe(Box<(Request, Frame, Touched)>),
    /// Something of the configurator's own, waited for by whoever began it.
    Own,
    /// The same, and a panic has taken who waited for it.
    Abandoned,
}

/// A transaction under way.
pub(super) struct Running {
    /// Its number, never used twice.
    pub number: u64,
    pub machine: Transaction,
    pub purpose: Purpose,
    /// The request that each part of the plan serves, for the log.
    pub serves: SmallVec<[RequestId; 2]>,
    pub outstanding: Vec<OutstandingCall>,
    pub read: Option<(PoolTicket, Time)>,
    pub asked: Vec<AskedBatch>,
    /// Parts that stand for what they should, with the numbers of their conditions.
    pub stood: Vec<(usize, u64)>,
    /// Safe configurations that came before and do something about the same components: its end comes after theirs.
    pub after: SmallVec<[u64; 1]>,
    /// The number of the first frame that could come after it began: a safe configuration's from there on interrupted it.
    pub since: FrameId,
    /// Quarantine does not keep its steps out.
    pub enters_quarantine: bool,
    pub over: bool,
    /// Panics that came in the middle of it.
    pub panics: u8,
}

impl Running {
    pub fn new(
        number: u64,
        machine: Transaction,
        purpose: Purpose,
        serves: SmallVec<[RequestId; 2]>,
        since: FrameId,
    ) -> Self {
        Self {
            number,
            machine,
            enters_quarantine: matches!(purpose, Purpose::Safe(_)),
            purpose,
            serves,
            outstanding: Vec::new(),
            read: None,
            asked: Vec::new(),
            stood: Vec::new(),
            after: SmallVec::new(),
            since,
            over: false,
            panics: 0,
        }
    }

    pub fn is_safe(&self) -> bool {
        matches!(self.purpose, Purpose::Safe(_))
    }

    /// The safe configuration that it applies.
    pub fn safe_configuration(&self) -> Option<ConfigId> {
        match &self.purpose {
            Purpose::Safe(safe) => match safe.0.ask {
                Ask::Apply(id) => Some(id),
                _ => None,
            },
            _ => None,
        }
    }

    /// Whether a safe configuration has interrupted it, and it is not over.
    pub fn is_interrupted(&self) -> bool {
        !self.is_safe() && !self.over && self.machine.is_interrupted()
    }

    /// When something must be looked at again, if nothing comes.
    pub fn until(&self) -> Time {
        let outstanding = self.outstanding.iter().map(OutstandingCall::deadline);
        let asked = self.asked.iter().map(|asked| asked.until);
        outstanding.chain(self.read.map(|(_, until)| until)).chain(asked).min().unwrap_or(Time::NEVER)
    }

    /// No further step of the calls that are out is to begin.
    pub fn stop_batches(&self, platform: &dyn Platform) {
        self.outstanding.iter().for_each(|call| call.stop(platform));
    }

    pub fn serves(&self, step: u32) -> RequestId {
        let part = if self.serves.len() == 1 { 0 } else { self.machine.part_of_step(step) };
        served(&self.serves, part)
    }
}

/// The request that a part of a plan serves; 0 for what nobody asked for.
pub(super) fn served(serves: &[RequestId], part: usize) -> RequestId {
    serves.get(part).or(serves.last()).copied().unwrap_or(RequestId(0))
}
