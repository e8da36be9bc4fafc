//! What happens is written down: what others do by themselves, and what components raise by who comes next.
//!
//! A component raises an event in the thread of its activity, which may be a control loop's: that makes no texts, asks for no memory and
//! calls nobody. It leaves the event behind; whoever writes something else down, or looks at what is written, writes down first
//! what was left, so the order stays that in which things happened.

use super::hub::{Hub, HubState};
use super::log::{Happening, LogEntry};
use super::tap::LogSink;
use crate::limits;
use crate::model::{ComponentName, EventName};
use crate::time::{TaskWait, Time};
use smallvec::SmallVec;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// An event that a component raised.
pub(super) struct UnwrittenEvent {
    at: Time,
    event: EventName,
    by: ComponentName,
    safety: bool,
}

impl Hub {
    /// Writes down that something happened, and tells the observers.
    pub fn note(&self, what: Happening) {
        self.record(Some((what, false)));
    }

    /// The same, of what components do or say by themselves: however many there are, they displace only each other.
    pub fn report(&self, what: Happening) {
        self.record(Some((what, true)));
    }

    /// The same, of an event that a component raised. Whoever raises it, a control activity mostly, makes no texts of it and calls
    /// nobody: that does whoever notes or looks next, at the latest the thread that is there for it.
    pub fn raised(&self, event: EventName, by: ComponentName) {
        let (at, safety) = (self.clock.now(), self.is_safety(event));
        let waiting = {
            let mut state = self.state();
            state.unwritten.push_back(UnwrittenEvent { at, event, by, safety });
            state.unwritten.len()
        };
        match waiting < limits::UNWRITTEN && self.is_written.load(Ordering::Acquire) {
            true => self.unwritten.notify(),
            false => self.write_down(),
        }
    }

    /// Starts the thread that writes down what components raise; without one, whoever raises it does. It ends when it is
    /// [told to](Self::end_writing).
    pub fn begin_writing(self: &Arc<Self>) {
        let hub = self.clone();
        let step = move || {
            hub.write_down();
            if hub.is_written.load(Ordering::Acquire) { TaskWait::Wait(Time::NEVER) } else { TaskWait::End }
        };
        self.is_written.store(true, Ordering::Release);
        if self.clock.try_spawn_task("davit-log", &self.unwritten, step).is_err() {
            self.end_writing();
        }
    }

    /// Ends that thread.
    pub fn end_writing(&self) {
        self.is_written.store(false, Ordering::Release);
        self.unwritten.notify();
        self.write_down();
    }

    /// Writes down what components have raised, and in simulated time waits for slow observers.
    fn write_down(&self) {
        self.record(None);
    }

    /// Writes down what components have raised so far, and then this; in simulated time waits for slow observers.
    fn record(&self, what: Option<(Happening, bool)>) {
        self.catch_up(what).iter().for_each(|tap| tap.keep_pace());
    }

    /// The same without waiting; answers who may have to be waited for.
    pub(super) fn catch_up(&self, what: Option<(Happening, bool)>) -> Vec<Arc<dyn LogSink>> {
        let now = self.clock.now();
        let (news, observers, taps) = {
            let mut state = self.state();
            let mut news: SmallVec<[(Time, Arc<LogEntry>); 2]> = SmallVec::new();
            while let Some(UnwrittenEvent { at, event, by, safety }) = state.unwritten.pop_front() {
                let what = Happening::Event { event: event.to_string(), from: by.to_string(), safety };
                news.push((at, state.write(at, what, true)));
            }
            news.extend(what.map(|(what, is_report)| (now, state.write(now, what, is_report))));
            if news.is_empty() {
                return Vec::new();
            }
            let slow = if self.clock.is_simulated() { state.taps.clone() } else { Vec::new() };
            (news, state.observers.clone(), slow)
        };
        for (at, entry) in &news {
            observers.iter().for_each(|observer| observer(*at, &entry.what));
        }
        self.wake();
        taps
    }
}

impl HubState {
    /// Writes down one thing, and hands it to the taps: under the lock, so that all hear it in one order.
    fn write(&mut self, at: Time, what: Happening, is_report: bool) -> Arc<LogEntry> {
        let heard = match &what {
            Happening::Event { event, .. }
            | Happening::Emitted { event }
            | Happening::Lost { event, .. }
            | Happening::Stale { event } => Some(event.clone()),
            Happening::Answered(answered) => Some(answered.answer.clone()),
            Happening::State { active } => {
                let of = active.first().and_then(|root| root.split_once(':')).map_or("", |(name, _)| name);
                self.active.insert(of.to_owned(), active.clone());
                None
            }
            _ => None,
        };
        if let Some(event) = heard {
            self.heard.push(event, is_report);
        }
        self.epoch += 1;
        let entry = Arc::new(LogEntry { at: at.as_secs_f64(), what });
        self.log.push(entry.clone(), is_report);
        self.taps.iter().for_each(|tap| tap.hear(&entry));
        entry
    }
}
