//! One monitor at work: when its condition is evaluated, and what it raises.

use super::program::CompiledCondition;
use super::sample::{InputNews, InputSample};
use crate::model::EventName;
use crate::model::monitor::{Monitor, Sampling};
use crate::time::Time;
use std::time::Duration;

/// One monitor at work.
#[derive(Debug, Clone)]
pub(super) struct WatchedMonitor {
    program: CompiledCondition,
    /// Its inputs in the bank, and what they held when it was last evaluated.
    slots: Box<[usize]>,
    held: Box<[InputSample]>,
    /// Which of them are ports, whose samples tell their instant.
    stamped: Box<[bool]>,
    /// Of which it matters that they were written, whatever it was.
    counted: Box<[bool]>,
    /// Room for what came with the present step.
    arrivals: Box<[(u64, usize)]>,
    raise: Option<EventName>,
    cleared: Option<EventName>,
    repeat: Option<Duration>,
    sampling: Sampling,
    enabled: bool,
    /// Since when it waits for its first evaluation.
    waits: Time,
    /// What it said last; none before it was evaluated.
    verdict: Option<bool>,
    /// Its next evaluation, when it runs at a rate.
    tick: Time,
    /// When its event is raised again.
    again: Time,
}

/// The first instant that is not before a position.
fn time_of(position: u64) -> Time {
    if position == u64::MAX { Time::NEVER } else { Time(position / 2 + position % 2) }
}

impl WatchedMonitor {
    /// Over these inputs of the bank; `stamped`: which of them are ports.
    pub fn new(monitor: &Monitor, program: CompiledCondition, slots: Box<[usize]>, stamped: Box<[bool]>) -> Self {
        Self {
            held: vec![InputSample::default(); slots.len()].into(),
            arrivals: vec![(0, 0); slots.len()].into(),
            stamped,
            counted: (0..slots.len()).map(|slot| program.counts(slot)).collect(),
            slots,
            program,
            raise: monitor.raise,
            cleared: monitor.cleared,
            repeat: monitor.repeat,
            sampling: monitor.sampling,
            enabled: monitor.enabled,
            waits: Time::default(),
            verdict: None,
            tick: Time::default(),
            again: Time::NEVER,
        }
    }

    /// Switches it on, with an empty history, or off.
    pub fn enable(&mut self, on: bool, now: Time) {
        if self.enabled != on {
            (self.enabled, self.verdict, self.waits, self.again) = (on, None, now, Time::NEVER);
            self.program.clear();
        }
    }

    /// Whether it is on.
    pub fn is_enabled(&self) -> bool {
        self.enabled
    }

    /// Whether it looks at an input of the bank.
    pub fn looks_at(&self, input: usize) -> bool {
        self.slots.contains(&input)
    }

    /// What its condition was when last evaluated; none when it is off, or new.
    pub fn verdict(&self) -> Option<bool> {
        self.verdict
    }

    /// How far the condition was from the contrary then.
    pub fn robustness(&self) -> Option<f64> {
        self.verdict.map(|_| self.program.grade().robustness)
    }

    /// How many pieces of signals it has merged so far.
    pub fn merged(&self) -> u64 {
        self.program.merged()
    }

    /// When it must be looked at though no sample comes.
    pub fn wake(&self) -> Time {
        match (self.verdict, self.sampling) {
            (None, _) => self.waits,
            (_, Sampling::Every(_)) => self.tick,
            (Some(_), Sampling::OnSample) => time_of(self.program.wake()).min(self.again),
        }
    }

    /// Looks at what the inputs hold at `now`, for the first time after `before`, and raises what has come to be. `news` is what came
    /// since the bank's last step: a monitor that is not new and was not evaluated there held all of
    /// that already.
    pub fn step(
        &mut self,
        before: Time,
        now: Time,
        samples: &[InputSample],
        news: &[InputNews],
        raise: &mut dyn FnMut(EventName),
    ) {
        let new = self.verdict.is_none();
        match self.sampling {
            Sampling::Every(period) => {
                if !new && now < self.tick {
                    return;
                }
                let period = u64::try_from(period.as_nanos()).unwrap_or(u64::MAX).max(1);
                let first = if new { now.as_nanos() } else { self.tick.as_nanos() };
                let missed = (now.as_nanos() - first) / period;
                self.tick = Time(first.saturating_add(period.saturating_mul(missed + 1)));
            }
            Sampling::OnSample => {
                let matters = |counted: bool| if counted { InputNews::Written } else { InputNews::Other };
                let changed =
                    self.slots.iter().zip(&self.counted).any(|(slot, counted)| news[*slot] >= matters(*counted));
                if !new && !changed && now < time_of(self.program.next()).min(self.again) {
                    return;
                }
            }
        }
        let mut target = now.as_nanos().saturating_mul(2);
        // What was not there at the last look, whatever its stamp, counts from right behind it.
        let looked = match self.sampling {
            Sampling::OnSample => before.as_nanos().saturating_mul(2).max(self.program.position()),
            Sampling::Every(_) => self.program.position(),
        };
        if !new {
            // A second look at one instant counts as the next nanosecond.
            if target <= self.program.position() {
                target = (self.program.position() | 1) + 1;
            }
            let mut arrived = 0;
            let arrivals = self.find_arrivals(looked, samples);
            loop {
                // Always onwards: time stands still for nobody.
                let pending = self.arrivals[..arrivals].get(arrived).map_or(u64::MAX, |(arrival, _)| *arrival);
                let position = self.program.next().min(pending).max(self.program.position() + 1);
                if position >= target {
                    break;
                }
                while let Some((arrival, i)) = self.arrivals[..arrivals].get(arrived).copied()
                    && arrival <= position
                {
                    self.take(i, &samples[self.slots[i]]);
                    arrived += 1;
                }
                self.program.evaluate(position, &self.held);
                if self.sampling == Sampling::OnSample {
                    self.repeat(time_of(position - 1), raise);
                    self.observe(time_of(position), raise);
                }
            }
        }
        let mut news = new;
        for i in 0..self.slots.len() {
            news |= self.take(i, &samples[self.slots[i]]);
        }
        // All that came is taken in already, at the instants at which it came, and nothing changes by itself up to now.
        match news || self.program.next() <= target {
            true => _ = self.program.evaluate(target, &self.held),
            false => self.program.go_on(target),
        }
        if self.sampling == Sampling::OnSample && self.verdict == Some(true) && !self.program.grade().holds {
            // What was due before it ended was due; who looks at ticks only sees at this one that it has ended.
            self.repeat(Time(now.as_nanos().saturating_sub(1)), raise);
        }
        self.observe(now, raise);
        self.repeat(now, raise);
    }

    /// Whether the condition may be another for that sample.
    fn is_news(&self, i: usize, sample: &InputSample) -> bool {
        if self.counted[i] { sample.differs(&self.held[i]) } else { sample.holds_other_than(&self.held[i]) }
    }

    /// The position from which a sample counts that is not held yet: its own instant, but after the last look.
    fn arrival(&self, looked: u64, i: usize, sample: &InputSample) -> Option<u64> {
        let news = self.stamped[i] && sample.present && self.is_news(i, sample);
        news.then(|| sample.at.as_nanos().saturating_mul(2).max(looked.max(self.program.position()) + 1))
    }

    /// Lists the samples that are not held yet, by the position from which they count; how many there are.
    fn find_arrivals(&mut self, looked: u64, samples: &[InputSample]) -> usize {
        let mut count = 0;
        for i in 0..self.slots.len() {
            if let Some(arrival) = self.arrival(looked, i, &samples[self.slots[i]]) {
                self.arrivals[count] = (arrival, i);
                count += 1;
            }
        }
        self.arrivals[..count].sort_unstable();
        count
    }

    /// Takes a sample. Whether the condition may be another for it.
    fn take(&mut self, i: usize, sample: &InputSample) -> bool {
        let news = self.is_news(i, sample);
        if news {
            self.program.touch(i);
        }
        self.held[i] = *sample;
        news
    }

    /// Raises what has changed.
    fn observe(&mut self, at: Time, raise: &mut dyn FnMut(EventName)) {
        let holds = self.program.grade().holds;
        let before = self.verdict.replace(holds).unwrap_or(false);
        if holds && !before {
            self.raise.into_iter().for_each(&mut *raise);
            self.again = self.repeat.map_or(Time::NEVER, |period| at + period);
        } else if before && !holds {
            self.again = Time::NEVER;
            if let Some(cleared) = self.cleared {
                raise(cleared);
            }
        }
    }

    /// Raises the event again when that is due; several times that were missed count as one.
    fn repeat(&mut self, now: Time, raise: &mut dyn FnMut(EventName)) {
        if let Some(period) = self.repeat
            && now >= self.again
        {
            self.raise.into_iter().for_each(&mut *raise);
            let period = u64::try_from(period.as_nanos()).unwrap_or(u64::MAX).max(1);
            let missed = (now.as_nanos() - self.again.as_nanos()) / period;
            self.again = Time(self.again.as_nanos().saturating_add(period.saturating_mul(missed + 1)));
        }
    }
}
