//! What happens is written down: what others do by themselves, and what components raise by who comes next.
//!
//! A component raises an event in the thread of its activity, which may be a control loop's: that makes no texts, asks for no memory and
//! calls nobody. It leaves the event behind; whoever writes something else down, or looks at what is written, writes down first
//! what was left, so the order stays that in which things happened.

use super::hub::{Hub, HubState};
use super::log::{Happening, LogEntry, Phase};
use super::tap::LogSink;
use crate::limits;
use crate::model::{ComponentName, EventName};
use crate::time::{TaskWait, Time, lock};
use smallvec::SmallVec;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// An event that a component raised.
pub(super) struct UnwrittenEvent {
    at: Time,
    event: EventName,
    by: ComponentName,
    safety: bool,
}

impl UnwrittenEvent {
    /// Room for as many as there may be, and for those of who raises one meanwhile.
    pub fn room() -> VecDeque<Self> {
        VecDeque::with_capacity(2 * limits::UNWRITTEN)
    }
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
        let safety = self.is_safety(event);
        let waiting = {
            let mut unwritten = lock(&self.unwritten);
            unwritten.push_back(UnwrittenEvent { at: self.clock.now(), event, by, safety });
            unwritten.len()
        };
        match waiting < limits::UNWRITTEN && self.is_written.load(Ordering::Acquire) {
            true => self.raised.notify(),
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
        if self.clock.try_spawn_task("davit-log", &self.raised, step).is_err() {
            self.end_writing();
        }
    }

    /// Ends that thread.
    pub fn end_writing(&self) {
        self.is_written.store(false, Ordering::Release);
        self.raised.notify();
        self.write_down();
    }

    /// Writes down what components have raised, and in simulated time waits for slow observers.
    fn write_down(&self) {
        self.record(None);
    }

    /// Begins a phase where nothing was written down since that count ([`Hub::epoch`]): whatever is told then comes behind it. Answers whether it has begun.
    pub fn begin_phase(&self, phase: Phase, seen: u64) -> bool {
        let mut has_begun = false;
        let begin = |state: &mut HubState| {
            has_begun = state.epoch == seen;
            if has_begun {
                state.phase = phase;
            }
            has_begun
        };
        self.catch_up(Some((Happening::Phase { phase }, false)), begin).iter().for_each(|tap| tap.keep_pace());
        has_begun
    }

    /// Writes down what components have raised so far, and then this; in simulated time waits for slow observers.
    fn record(&self, what: Option<(Happening, bool)>) {
        self.catch_up(what, |_| true).iter().for_each(|tap| tap.keep_pace());
    }

    /// The same without waiting, and only if it may be written behind what they have raised; answers who may have to be waited for.
    pub(super) fn catch_up(
        &self,
        what: Option<(Happening, bool)>,
        may: impl FnOnce(&mut HubState) -> bool,
    ) -> Vec<Arc<dyn LogSink>> {
        let (news, observers, taps) = {
            let mut state = self.state();
            // What is raised from here on comes later, also by the clock.
            let now = {
                let mut unwritten = lock(&self.unwritten);
                std::mem::swap(&mut *unwritten, &mut state.taken);
                self.clock.now()
            };
            let mut news: SmallVec<[(Time, Arc<LogEntry>); 2]> = SmallVec::new();
            while let Some(UnwrittenEvent { at, event, by, safety }) = state.taken.pop_front() {
                let what = Happening::Event { event: event.to_string(), from: by.to_string(), safety };
                news.push((at, state.write(at, what, true)));
            }
            let what = what.filter(|_| may(&mut state));
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
            Happening::Event { event, .. } | Happening::Emitted { event } | Happening::Lost { event, .. } => {
                Some(event.clone())
            }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Clock;
    use std::sync::Mutex;

    /// When what is written down happened, in the order in which it is.
    #[derive(Default)]
    struct Times(Mutex<Vec<f64>>);

    impl LogSink for Times {
        fn hear(&self, entry: &Arc<LogEntry>) {
            lock(&self.0).push(entry.at);
        }
    }

    #[test]
    fn what_threads_raise_and_note_at_once_is_written_in_the_order_of_its_times() {
        const EACH: usize = 20_000;
        let hub = Arc::new(Hub::new(&Clock::real(), [], []));
        let times = Arc::new(Times::default());
        hub.attach(times.clone());
        hub.begin_writing();
        let (event, by) = (EventName::new("e_blink").unwrap(), ComponentName::new("A").unwrap());
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| (0..EACH).for_each(|_| hub.raised(event, by)));
                scope.spawn(|| {
                    (0..EACH).for_each(|_| hub.note(Happening::Stale { event: "e".to_owned() }));
                });
            }
        });
        hub.end_writing();
        let times = lock(&times.0);
        assert_eq!(times.len(), 4 * EACH, "nothing is lost, and nothing is told twice");
        let back = times.windows(2).filter(|pair| pair[1] < pair[0]).count();
        assert_eq!(back, 0, "times go back");
    }

    /// What was told before a phase begins was before it: who begins it has to have heard that.
    #[test]
    fn a_phase_begins_where_nothing_was_told_since() {
        let hub = Arc::new(Hub::new(&Clock::real(), [], []));
        hub.begin_writing();
        let raised = |hub: &Hub| hub.raised(EventName::new("e_stop").unwrap(), ComponentName::new("A").unwrap());
        let noted = |hub: &Hub| hub.note(Happening::Stale { event: "e".to_owned() });
        hub.set_phase(Phase::Deploying);
        for told in [&raised as &dyn Fn(&Hub), &noted] {
            let seen = hub.epoch();
            told(&hub);
            assert!(!hub.begin_phase(Phase::ShuttingDown, seen));
            assert_eq!(hub.phase(), Phase::Deploying);
        }
        raised(&hub);
        assert!(hub.begin_phase(Phase::ShuttingDown, hub.epoch()));
        assert_eq!(hub.phase(), Phase::ShuttingDown);
        hub.end_writing();
        let last = hub.log(1);
        assert!(matches!(last[0].what, Happening::Phase { phase: Phase::ShuttingDown }), "{last:?}");
    }

    #[test]
    fn who_looks_sees_what_was_raised_before() {
        let clock = Clock::simulated();
        let _guard = clock.enter();
        let hub = Arc::new(Hub::new(&clock, [], []));
        hub.begin_writing();
        let (event, by) = (EventName::new("e_blink").unwrap(), ComponentName::new("A").unwrap());
        let before = hub.heard();
        hub.raised(event, by);
        assert_eq!(hub.first_heard(&["e_blink".to_owned()], before), Some("e_blink".to_owned()));
        (0..3 * limits::UNWRITTEN).for_each(|_| hub.raised(event, by));
        assert_eq!(hub.heard(), before + 1 + 3 * limits::UNWRITTEN as u64);
        hub.end_writing();
    }
}
