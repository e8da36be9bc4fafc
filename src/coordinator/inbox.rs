//! Where events wait for the coordinator.
//!
//! Two lanes, each bounded and in the order of arrival. Answers of the configurator and an operator's events go by the
//! control lane, everything that monitors and components report by the other one. The control lane is always emptied
//! first; so a flood of reports neither delays nor displaces an answer or an emergency stop. When a lane is full the
//! event that arrives is dropped and counted: what waits already is older, and was to be reacted to first.
//!
//! Control events are bounded by nature (one answer a request, a person's typing), so their lane is short, and a drop in
//! it says that somebody misuses it.

use super::core::Tag;
use crate::limits;
use crate::model::names::EventName;
use serde::Serialize;
use std::collections::VecDeque;

/// By which lane an event travels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Lane {
    /// Answers to requests, events of operators, of deployment and shutdown.
    Control,
    /// Events of monitors and components.
    Report,
}

/// An event on its way to a coordinator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Incoming {
    /// The event.
    pub event: EventName,
    /// For whom it is, when it answers something that a state asked; not delivered once that visit of the state is over.
    pub tag: Option<Tag>,
    /// By which lane it travels.
    pub lane: Lane,
    /// Whose number is told with what became of it; 0: nobody wants to know.
    pub ticket: u64,
}

impl Incoming {
    /// An answer for whoever asked.
    pub fn answer(event: EventName, tag: Tag) -> Self {
        Self { event, tag: Some(tag), lane: Lane::Control, ticket: 0 }
    }

    /// An operator's event, or an answer that is for nobody in particular.
    pub fn control(event: EventName) -> Self {
        Self { event, tag: None, lane: Lane::Control, ticket: 0 }
    }

    /// The same, of which somebody wants to know whether a transition heard it.
    pub fn watched(event: EventName, ticket: u64) -> Self {
        Self { ticket, ..Self::control(event) }
    }

    /// An event of a monitor or a component.
    pub fn report(event: EventName) -> Self {
        Self { event, tag: None, lane: Lane::Report, ticket: 0 }
    }
}

/// Why an event was not accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Refused {
    /// Its lane is full; the event was dropped and counted.
    #[error("the coordinator's inbox is full")]
    Full,
    /// The coordinator was detached or has ended.
    #[error("the coordinator has been detached")]
    Detached,
}

/// Events that found their lane full.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Dropped {
    /// Of the control lane.
    pub control: u64,
    /// Of the lane for reports.
    pub report: u64,
    /// Of the chart's own queue: events that its functions sent, or that it raised for itself.
    pub inside: u64,
}

impl Dropped {
    /// This and another one, as one.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            control: self.control + other.control,
            report: self.report + other.report,
            inside: self.inside + other.inside,
        }
    }
}

/// Both lanes.
#[derive(Debug)]
pub(super) struct Inbox {
    control: VecDeque<Incoming>,
    report: VecDeque<Incoming>,
    dropped: Dropped,
}

impl Inbox {
    pub fn new() -> Self {
        Self {
            control: VecDeque::with_capacity(limits::INBOX_CONTROL),
            report: VecDeque::with_capacity(limits::INBOX_REPORT),
            dropped: Dropped::default(),
        }
    }

    pub fn push(&mut self, incoming: Incoming) -> Result<(), Refused> {
        let (lane, bound, dropped) = match incoming.lane {
            Lane::Control => (&mut self.control, limits::INBOX_CONTROL, &mut self.dropped.control),
            Lane::Report => (&mut self.report, limits::INBOX_REPORT, &mut self.dropped.report),
        };
        if lane.len() >= bound {
            *dropped += 1;
            return Err(Refused::Full);
        }
        lane.push_back(incoming);
        Ok(())
    }

    pub fn pop(&mut self) -> Option<Incoming> {
        self.control.pop_front().or_else(|| self.report.pop_front())
    }

    pub fn is_empty(&self) -> bool {
        self.control.is_empty() && self.report.is_empty()
    }

    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    pub fn clear(&mut self) {
        self.control.clear();
        self.report.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(text: &str) -> EventName {
        EventName::new(text).unwrap()
    }

    #[test]
    fn a_flood_of_reports_neither_delays_nor_displaces_control() {
        let mut inbox = Inbox::new();
        let mut refused = 0;
        for _ in 0..limits::INBOX_REPORT + 10 {
            refused += usize::from(inbox.push(Incoming::report(event("chatter"))) == Err(Refused::Full));
        }
        assert_eq!(refused, 10);
        inbox.push(Incoming::control(event("stop"))).unwrap();
        inbox.push(Incoming::control(event("after"))).unwrap();
        assert_eq!(inbox.dropped(), Dropped { control: 0, report: 10, inside: 0 });
        assert_eq!(inbox.pop().unwrap().event, event("stop"));
        assert_eq!(inbox.pop().unwrap().event, event("after"));
        assert_eq!(inbox.pop().unwrap().event, event("chatter"));
    }

    #[test]
    fn the_control_lane_is_bounded_too() {
        let mut inbox = Inbox::new();
        for _ in 0..limits::INBOX_CONTROL {
            inbox.push(Incoming::control(event("e"))).unwrap();
        }
        assert_eq!(inbox.push(Incoming::control(event("e"))), Err(Refused::Full));
        assert_eq!(inbox.dropped().control, 1);
    }
}
