//! One call of an operation, between who asked for it and who carries it out: whether it has begun, was given up, is
//! answered. One atomic word decides between the two sides, so that neither waits for the other.

use super::beat::Beat;
use crate::model::Value;
use crate::time::{Sender, Signal};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};

/// How a call of an operation ended, without types.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Reply {
    Done(Option<Value>),
    Failed(String),
    Panicked(String),
    /// It was never begun: the component was busy, gone or faulted.
    Refused(String),
    /// It was never begun: its caller took it back.
    Withdrawn,
    /// It was given up while it was under way, and ended without being done: it counts as done half way.
    HalfWay,
}

/// The component's code is, or was, inside the call.
const BEGUN: u8 = 1;
/// The code has come back (though its answer may come later).
const RETURNED: u8 = 2;
/// The caller took it back before it had begun: it never begins.
const WITHDRAWN: u8 = 4;
/// The caller has given it up and said so.
const TOLD: u8 = 8;
const ANSWERED: u8 = 16;

/// How far a call has come.
pub(crate) struct CallProgress {
    bits: AtomicU8,
    reply: Sender<Reply>,
    /// The component that begins nothing else until this call has come to rest, once it was given up; none: the call runs
    /// beside it.
    holds: Option<Arc<Beat>>,
    /// The activity that may keep other calls of the component back until then.
    wake: Option<Signal>,
}

impl CallProgress {
    pub(crate) fn new(reply: Sender<Reply>, holds: Option<Arc<Beat>>, wake: Option<Signal>) -> Self {
        Self { bits: AtomicU8::new(0), reply, holds, wake }
    }

    fn has(&self, bit: u8) -> bool {
        self.bits.load(Ordering::Acquire) & bit != 0
    }

    /// The component's code is about to be called; false: it must not be.
    pub(crate) fn begin(&self) -> bool {
        self.bits.compare_exchange(0, BEGUN, Ordering::AcqRel, Ordering::Acquire).is_ok()
    }

    /// The component's code has come back.
    pub(crate) fn returned(&self) {
        self.bits.fetch_or(RETURNED, Ordering::AcqRel);
    }

    /// Whether the component's code is being run.
    pub(crate) fn is_inside(&self) -> bool {
        self.bits.load(Ordering::Acquire) & (BEGUN | RETURNED) == BEGUN
    }

    /// Takes the call back if it has not begun.
    pub(crate) fn withdraw(&self) -> bool {
        self.bits.compare_exchange(0, WITHDRAWN, Ordering::AcqRel, Ordering::Acquire).is_ok()
    }

    pub(crate) fn is_withdrawn(&self) -> bool {
        self.has(WITHDRAWN)
    }

    /// Says that the caller has given the call up. Whoever carries it out sees it at its next look.
    pub(crate) fn tell(&self) {
        let before = self.bits.fetch_or(TOLD, Ordering::AcqRel);
        if before & BEGUN != 0
            && before & (TOLD | ANSWERED) == 0
            && let Some(beat) = &self.holds
        {
            beat.restless.fetch_add(1, Ordering::AcqRel);
        }
    }

    /// Whether the caller has given the call up.
    pub(crate) fn is_told(&self) -> bool {
        self.has(TOLD)
    }

    pub(crate) fn is_answered(&self) -> bool {
        self.has(ANSWERED)
    }

    /// Gives the call up from outside: takes it back, or says so to who carries it out. Never waits.
    pub(crate) fn cancel(&self) {
        if self.withdraw() {
            let _ = self.reply.try_send(Reply::Withdrawn);
        } else {
            self.tell();
        }
    }

    /// Answers, if nothing has yet. An error of a call that was given up before is no word on whether anything happened:
    /// it counts as done half way.
    pub(crate) fn answer(&self, reply: Reply) {
        let before = self.bits.fetch_or(ANSWERED, Ordering::AcqRel);
        if before & (ANSWERED | WITHDRAWN) != 0 {
            return;
        }
        let given_up = before & TOLD != 0;
        let _ = self.reply.try_send(match reply {
            Reply::Failed(_) if given_up => Reply::HalfWay,
            other => other,
        });
        if given_up
            && before & BEGUN != 0
            && let Some(beat) = &self.holds
        {
            beat.restless.fetch_sub(1, Ordering::AcqRel);
            if let Some(wake) = &self.wake {
                wake.notify();
            }
        }
    }
}

/// The answering end of a call: dropped unanswered, the call failed.
pub(crate) struct Responder(pub(crate) Arc<CallProgress>);

impl Drop for Responder {
    fn drop(&mut self) {
        self.0.answer(Reply::Failed("the component ended before it answered".to_owned()));
    }
}
