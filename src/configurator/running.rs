//! A transaction under way: what it is for, and its calls that are out.

use super::inbox::PoolTicket;
use crate::limits;
use crate::model::RequestId;
use crate::stack::{Frame, FrameId, Group, Request};
use crate::time::Time;
use crate::transaction::{Question, Touched, Transaction};
use smallvec::SmallVec;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A call that is out: one blocking step, or several brief ones.
pub(super) struct Flight {
    pub ticket: PoolTicket,
    pub steps: SmallVec<[u32; 1]>,
    pub started: Time,
    pub deadline: Time,
    /// Set: no further one of several is to be begun.
    pub stop: Arc<AtomicBool>,
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
}

/// A transaction under way.
pub(super) struct Running {
    /// Its number, never used twice.
    pub number: u64,
    pub machine: Transaction,
    pub purpose: Purpose,
    /// The request that each part of the plan serves, for the log.
    pub serves: SmallVec<[RequestId; 2]>,
    pub flights: Vec<Flight>,
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
            flights: Vec::new(),
            read: None,
            asked: Vec::new(),
            stood: Vec::new(),
            after: SmallVec::new(),
            since,
            over: false,
        }
    }

    pub fn is_safe(&self) -> bool {
        matches!(self.purpose, Purpose::Safe(_))
    }

    /// When something must be looked at again, if nothing comes.
    pub fn until(&self) -> Time {
        let flights = self.flights.iter().map(|flight| flight.deadline + limits::PLATFORM_GRACE);
        let asked = self.asked.iter().map(|asked| asked.until);
        flights.chain(self.read.map(|(_, until)| until)).chain(asked).min().unwrap_or(Time::NEVER)
    }

    /// No further one of the brief steps that are out is to be begun.
    pub fn stop_brief(&self) {
        self.flights.iter().for_each(|flight| flight.stop.store(true, Ordering::Release));
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
