//! Immediate steps, carried out one after the other in the list's own order: of many small steps most are, and the way from
//! one to the next is a good part of what they cost.

use super::{Transaction, TransactionPhase};
use crate::model::{Execution, Outcome, Step};
use crate::system::System;
use crate::time::Time;

/// An immediate step that is carried out now.
#[derive(Debug, Clone, Copy)]
pub struct Doing<'t> {
    /// The step.
    pub step: &'t Step,
    /// The part that it belongs to.
    pub part: usize,
    /// Whether it takes something back.
    pub undoing: bool,
    /// When it must be over.
    pub deadline: Time,
}

impl Transaction {
    /// A step of the list in hand that is carried out from `now` on.
    pub fn doing(&self, number: u32, now: Time) -> Doing<'_> {
        let part = if self.planned.parts.len() == 1 { 0 } else { self.part_of_step(number) };
        Doing {
            step: &self.step(number).step,
            part,
            undoing: self.is_going_back(),
            deadline: self.deadline(number, now),
        }
    }

    /// Carries out what [`Self::poll`] would let begin, as long as these are immediate steps, nothing else is to be done
    /// between them and `goes_on` says so, at most `most`. `execute` does a step on the platform, from the given time on, which
    /// becomes the time of its end. Answers how many were carried out; none: nothing is known by that. Not where steps come
    /// after those of others ([`Can::busy`](super::Can::busy)).
    pub fn immediate_ones(
        &mut self,
        most: usize,
        live: &mut System,
        now: &mut Time,
        execution: &impl Fn(&Step) -> Execution,
        goes_on: impl Fn() -> bool,
        mut execute: impl FnMut(Doing<'_>, &mut Time) -> Outcome,
    ) -> usize {
        let carries_out =
            matches!(self.phase, TransactionPhase::Forward | TransactionPhase::Back | TransactionPhase::Mending);
        if !carries_out || !self.cancels.is_empty() || self.is_stopped() {
            return 0;
        }
        let mut count = 0;
        while count < most && goes_on() {
            let Some(number) = self.in_hand_mut().next_immediate(live, *now, execution) else { break };
            let outcome = execute(self.doing(number, *now), now);
            count += 1;
            if matches!(outcome, Outcome::Done(_)) {
                self.in_hand_mut().was_executed(number, live);
            } else {
                // What comes of that is seen to first.
                self.ended(number, outcome, live);
                break;
            }
        }
        count
    }
}
