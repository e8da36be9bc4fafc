//! What is known of safe configurations beside their transactions.

use super::request::{Reason, Request};
use crate::model::{RequestId, Step};
use crate::stack::{Edits, FrameId};
use crate::transaction::Touched;
use std::collections::VecDeque;

/// Safe configurations that were asked for, and what those under way and over leave for others to heed.
#[derive(Default)]
pub(super) struct Safety {
    /// Requests that have come and were not begun.
    pub waiting: VecDeque<Request>,
    /// What those under way could not plan, and what others before them were to do for them and did not.
    pub troubles: Vec<Troubled>,
    /// What those that have ended touched, and what was interrupted was not told yet.
    pub touched: Touched,
    /// The frames of those that have ended, by the numbers under which they were under way: those that came after may take their places.
    pub pushed: Vec<(u64, FrameId)>,
}

/// A safe configuration under way of which not everything is done.
#[derive(Debug)]
pub(super) struct Troubled {
    pub request: RequestId,
    pub reasons: Vec<Reason>,
    /// The steps that others were to do for it.
    pub missed: Vec<Step>,
}

/// Frames of safe configurations that are being applied have numbers from here on, by which those that come after know them.
const COMING: u64 = 1 << 62;

/// The number of the frame that one will leave which is under way under this number.
pub(super) fn coming(number: u64) -> FrameId {
    FrameId(COMING + number)
}

impl Safety {
    /// What one does to the stack, as far as it is known by now: frames of those that came before and have ended have their numbers. What was
    /// done of one that has ended *broken* is taken over when this one is pushed.
    pub fn settled(&self, mut edits: Edits) -> Edits {
        let real = |id: FrameId| {
            let ended = self.pushed.iter().find(|(number, _)| coming(*number) == id);
            ended.map_or(id, |(_, frame)| *frame)
        };
        edits.over.iter_mut().for_each(|id| *id = real(*id));
        for (id, hand) in &mut edits.pops {
            *id = real(*id);
            hand.renumber(real);
        }
        edits
    }

    /// What one that is over could not plan, and what was not done for it.
    pub fn troubles_of(&mut self, request: RequestId) -> (Vec<Reason>, Vec<Step>) {
        let at = self.troubles.iter().position(|troubled| troubled.request == request);
        at.map(|at| self.troubles.remove(at)).map(|troubled| (troubled.reasons, troubled.missed)).unwrap_or_default()
    }
}
