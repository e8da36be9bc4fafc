//! Frames that are taken back unless an event confirms them in time.

use super::request::Request;
use crate::model::{Confirm, EventName, RequestId};
use crate::stack::{FrameId, Stack};
use crate::time::Time;
use smallvec::SmallVec;

/// A frame that waits for its confirmation.
pub(super) struct Confirming {
    pub request: Request,
    pub frame: FrameId,
    event: EventName,
    until: Time,
}

/// What waits for its confirmation, and requests not answered yet whose confirming event has come since they came.
#[derive(Default)]
pub(super) struct Confirmations {
    waiting: Vec<Confirming>,
    early: Vec<RequestId>,
}

impl Confirmations {
    /// An event came that some configuration waits for; `asked`: the requests not answered yet that it confirms.
    pub fn came(&mut self, event: EventName, asked: impl Iterator<Item = RequestId>) {
        self.waiting.retain(|waiting| waiting.event != event);
        for id in asked.filter(|id| !self.early.contains(id)).collect::<SmallVec<[RequestId; 4]>>() {
            self.early.push(id);
        }
    }

    /// A request is answered, or nobody waits for that any more.
    pub fn answered(&mut self, id: RequestId) {
        self.early.retain(|early| *early != id);
    }

    /// The frame of a request waits from now on, unless its event has come already.
    pub fn wait_for(&mut self, confirm: Confirm, request: Request, frame: FrameId, now: Time) {
        if !self.early.contains(&request.id) {
            let until = now + confirm.within;
            self.waiting.push(Confirming { request, frame, event: confirm.event, until });
        }
    }

    /// Frames that are gone need no confirmation any more.
    pub fn keep_those_of(&mut self, stack: &Stack) {
        self.waiting.retain(|waiting| stack.frame(waiting.frame).is_some());
    }

    /// Nothing waits any more.
    pub fn clear(&mut self) {
        self.waiting.clear();
    }

    /// The frames that wait.
    pub fn frames(&self) -> impl Iterator<Item = FrameId> + '_ {
        self.waiting.iter().map(|waiting| waiting.frame)
    }

    /// When the first of them has waited long enough.
    pub fn until(&self) -> Time {
        self.waiting.iter().map(|waiting| waiting.until).min().unwrap_or(Time::NEVER)
    }

    /// One whose confirmation did not come in time.
    pub fn take_late(&mut self, now: Time) -> Option<Confirming> {
        let at = self.waiting.iter().position(|waiting| waiting.until <= now)?;
        Some(self.waiting.remove(at))
    }
}
