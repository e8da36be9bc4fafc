//! What a transaction hears: each input, and what becomes of it where whoever drives it fails.

use super::{Input, Question, Transaction, TransactionPhase};
use crate::model::{Cause, Outcome, Step};
use crate::stack::Reason;
use crate::system::System;

impl Transaction {
    /// A step that was begun is back: [`Input::Ended`].
    pub fn ended(&mut self, step: u32, outcome: Outcome, live: &mut System) {
        self.doubted |= matches!(outcome, Outcome::Unknown(_));
        self.in_hand_mut().ended(step, outcome, live);
    }

    /// What happened.
    pub fn on(&mut self, input: Input, live: &mut System) {
        match input {
            Input::Ended { step, outcome } => self.ended(step, outcome, live),
            Input::NotBegun(step) => self.in_hand_mut().not_begun(step),
            Input::Seen(seen) => self.seen = Some(seen),
            Input::Told { question, is } => {
                // What is no longer asked is no news.
                if let Some(asked) = self.asked.iter_mut().find(|asked| asked.question == question) {
                    asked.told = Some(is);
                }
            }
            Input::GiveUp { part } => {
                // Once it is on its way back, that goes on.
                if matches!(self.phase, TransactionPhase::Forward | TransactionPhase::Standing) {
                    self.stopped_by.get_or_insert(Reason::GivenUp);
                    self.given_up.push(part);
                    // What a safe configuration has interrupted moves for no undo of the same request.
                    self.asked_back |= !self.interrupted;
                    self.cancel();
                }
            }
            Input::Interrupt(by) => {
                self.stopped_by = Some(Reason::Interrupted(by));
                // Its frame counts on what it interrupts going back.
                self.broken_off = false;
                self.interrupted = true;
                self.asked_back = false;
                self.held = true;
                self.cancel();
                self.in_hand_mut().late_from_now = true;
                // Wholly: also what stood before the failure, and was being finished; and what is mended is looked at anew.
                let looks = matches!(
                    self.phase,
                    TransactionPhase::Looking | TransactionPhase::Mending | TransactionPhase::LookingAgain
                );
                if self.between.take().is_some() || looks {
                    self.mending.interrupt();
                    self.phase = TransactionPhase::Stopping;
                }
            }
            Input::Release(touched) => self.release(touched),
            Input::BreakOff(reason) => {
                self.stopped_by = Some(reason);
                self.broken_off = true;
                self.asked_back = false;
                self.cancel();
            }
            Input::Stop => {
                if matches!(self.phase, TransactionPhase::Forward | TransactionPhase::Standing) {
                    self.stopped_by.get_or_insert(Reason::TakenDown);
                    self.cancel();
                }
            }
            Input::TakenDown => {
                self.stopped_by.get_or_insert(Reason::TakenDown);
                self.taken_down = true;
                self.held = false;
                self.cancel();
            }
        }
    }

    /// Calls that are out are told that they are given up.
    fn cancel(&mut self) {
        let run = self.in_hand();
        let calls = run.outstanding().filter(|i| matches!(run.list[*i as usize].step, Step::Operation(_)));
        let calls: Vec<u32> = calls.collect();
        if self.back.is_none() {
            self.told.extend_from_slice(&calls);
        }
        self.cancels.extend(calls);
    }

    /// Whoever drives it has failed in between: what was taken and is not out any more (`is_out`), or was asked and is not being
    /// found out, comes never. Whether such a step happened nobody knows until it is looked at; what was asked is asked anew, and
    /// read where nobody `reads`.
    pub fn lost(
        &mut self,
        is_out: impl Fn(u32) -> bool,
        asks: impl Fn(Question) -> bool,
        reads: bool,
        live: &mut System,
    ) {
        let run = self.in_hand();
        let known = |step: &u32| is_out(*step) || run.unread.iter().any(|(unread, _)| unread == step);
        let lost: Vec<u32> = run.outstanding().filter(|step| !known(step)).collect();
        for step in lost {
            self.ended(step, Outcome::Unknown(Cause::Lost("the configurator failed meanwhile".to_owned())), live);
        }
        self.asked.retain(|asked| asked.told.is_some() || asks(asked.question));
        self.reading &= reads || self.seen.is_some();
    }

    /// It failed again: it ends now, on what the model knows, without being asked anything more.
    pub fn break_off_blind(&mut self, reason: Reason, live: &System) {
        if self.phase == TransactionPhase::Over {
            return;
        }
        self.stopped_by = Some(reason);
        self.broken_off = true;
        // Also those whose outcome was not settled yet.
        let run = self.in_hand_mut();
        let open: Vec<u32> = run.outstanding().collect();
        open.into_iter().for_each(|step| run.leave_unsettled(step));
        (run.out, run.unread) = (0, Vec::new());
        if let Some((run, way)) = self.back.take() {
            self.took_back(&run, &way);
        }
        self.note_perhaps(live);
        self.compare_blind(self.failed_part(), false, live);
    }
}
