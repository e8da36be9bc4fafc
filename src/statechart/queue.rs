//! The events inside a machine that wait for its next step.

use super::EventId;
use crate::limits;

/// Events on their way to the next step, bounded.
#[derive(Debug, Clone)]
pub struct Queue {
    pub(super) events: Vec<EventId>,
    dropped: u64,
}

impl Queue {
    pub(super) fn new() -> Self {
        Self { events: Vec::with_capacity(limits::CHART_QUEUE), dropped: 0 }
    }

    /// Appends an event; `false`: the queue is full, and the event is dropped and counted.
    pub fn push(&mut self, event: EventId) -> bool {
        let room = self.events.len() < limits::CHART_QUEUE;
        if room {
            self.events.push(event);
        } else {
            self.dropped += 1;
        }
        room
    }

    /// Exchanges every event for what `by` makes of it.
    pub fn exchange(&mut self, mut by: impl FnMut(EventId) -> EventId) {
        self.events.iter_mut().for_each(|event| *event = by(*event));
    }

    /// How many more it takes.
    pub fn room(&self) -> usize {
        limits::CHART_QUEUE.saturating_sub(self.events.len())
    }

    /// The events, oldest first.
    pub fn events(&self) -> &[EventId] {
        &self.events
    }

    /// How many events found no room so far.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}
