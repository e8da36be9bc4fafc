//! Frames that are taken back unless an event confirms them in time.

use super::request::Request;
use crate::model::{Confirm, EventName};
use crate::stack::{FrameId, Stack};
use crate::time::Time;

/// A frame that waits for its confirmation.
pub(super) struct Confirming {
    pub request: Request,
    pub frame: FrameId,
    event: EventName,
    until: Time,
}

/// What waits for its confirmation, and confirming events that came while what they confirm was still being applied.
#[derive(Default)]
pub(super) struct Confirmations {
    waiting: Vec<Confirming>,
    heard: Vec<(EventName, Time)>,
}

impl Confirmations {
    /// An event came that some configuration waits for; `early`: something is under way that it may be meant for.
    pub fn came(&mut self, event: EventName, now: Time, early: bool) {
        self.waiting.retain(|waiting| waiting.event != event);
        if early {
            // The last time counts; there are no more of them than configurations wait for.
            self.heard.retain(|(heard, _)| *heard != event);
            self.heard.push((event, now));
        }
    }

    /// Nothing is under way any more: what came early confirms nothing.
    pub fn nothing_under_way(&mut self) {
        self.heard.clear();
    }

    /// The frame of a request that began at that time waits from now on, unless its event has come already.
    pub fn wait_for(&mut self, confirm: Confirm, request: Request, frame: FrameId, begun: Time, now: Time) {
        if !self.heard.iter().any(|(event, at)| *event == confirm.event && *at >= begun) {
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
