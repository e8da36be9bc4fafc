//! All monitors of a deployment, over inputs that are sampled once.

use super::compile::{PIECES, compile};
use super::program::CompiledCondition;
use crate::model::monitor::{Condition, Counter, Monitor, PortSignal, Sampling};
use crate::model::{ComponentName, EventName, Ident, MemberRef, Origin, RunState};
use crate::time::Time;
use std::fmt;
use std::time::Duration;

/// Something that monitors look at.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum MonitorInput {
    /// A number in what a port carries (bools as 0 and 1). With an empty path, also ports that carry no number: then only
    /// when they were written matters.
    Port(PortSignal),
    /// The run state of a component, as [`state_value`].
    State(ComponentName),
    /// Whether a component is faulted: 1 or 0.
    Faulted(ComponentName),
    /// A counter of an activity.
    Activity {
        /// The activity.
        activity: Ident,
        /// Which.
        counter: Counter,
    },
}

impl MonitorInput {
    /// The value of a port itself.
    pub fn whole(member: MemberRef) -> Self {
        Self::Port(PortSignal::whole(member))
    }
}

/// As the columns of a file of samples are called: `Arm.force[0]`, `state(Arm)`, `faulted(Arm)`,
/// `activity(control.overruns)`.
impl fmt::Display for MonitorInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Port(port) => write!(f, "{port}"),
            Self::State(component) => write!(f, "state({component})"),
            Self::Faulted(component) => write!(f, "faulted({component})"),
            Self::Activity { activity, counter } => write!(f, "activity({activity}.{})", counter.word()),
        }
    }
}

/// The number that stands for a run state.
pub fn state_value(state: RunState) -> f64 {
    match state {
        RunState::Unconfigured => 0.0,
        RunState::Stopped => 1.0,
        RunState::Running => 2.0,
        RunState::Faulted => 3.0,
    }
}

/// What an input holds.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InputSample {
    /// The value; NaN when what was written is no number.
    pub value: f64,
    /// When it was written last: from then on it counts, or from the last step on if that was later. Of states and
    /// counters it does not matter; they count from the step that finds them.
    pub at: Time,
    /// How often it was written so far. Of states and counters it does not matter.
    pub writes: u64,
    /// Whether there is one: not when the port was never written, or its component or activity does not exist.
    pub present: bool,
}

impl InputSample {
    /// The value, NaN when there is none.
    pub(super) fn number(&self) -> f64 {
        if self.present { self.value } else { f64::NAN }
    }

    /// The position from which the age counts: of the newest sample, or of the beginning when there is none.
    pub(super) fn since(&self, begun: u64) -> u64 {
        if self.present { self.at.as_nanos().saturating_mul(2) } else { begun }
    }

    /// Whether something else is there now.
    fn differs(&self, other: &Self) -> bool {
        self.writes != other.writes || self.holds_other_than(other)
    }

    /// Whether what is there now is another value: written once more, the same is the same.
    fn holds_other_than(&self, other: &Self) -> bool {
        self.present != other.present || self.value.to_bits() != other.value.to_bits()
    }
}

/// What was not as it should be, counted since the beginning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Troubles {
    /// Times that went backwards: of steps, and of samples (also those that lie in the future). The time before was taken.
    pub backwards: u64,
    /// Samples that are no number.
    pub not_numbers: u64,
    /// Pieces of signals that were merged because the memory of an operator was used up.
    pub merged: u64,
}

/// All monitors of a deployment.
#[derive(Debug, Clone)]
pub struct Bank {
    inputs: Vec<MonitorInput>,
    /// Of which the value matters, not only when it comes.
    valued: Vec<bool>,
    samples: Vec<InputSample>,
    watches: Vec<WatchedMonitor>,
    last: Time,
    troubles: Troubles,
}

/// One monitor at work.
#[derive(Debug, Clone)]
struct WatchedMonitor {
    program: CompiledCondition,
    /// Its inputs in the bank, and what they held when it was last evaluated.
    slots: Box<[usize]>,
    held: Box<[InputSample]>,
    /// Which of them are ports, whose samples tell their instant.
    stamped: Box<[bool]>,
    /// Of which it matters that they were written, whatever it was.
    counted: Box<[bool]>,
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

impl Bank {
    /// The monitors, with an empty history.
    pub fn new(monitors: &[Monitor]) -> Self {
        Self::with_memory(monitors, PIECES)
    }

    /// One condition by itself, watched from `now` on: without events, without what was before.
    ///
    /// # Panics
    /// Never: its name is a plain one.
    pub fn alone(condition: &Condition, now: Time) -> Self {
        let monitor = Monitor {
            name: Ident::new("holds").expect("a plain name"),
            when: condition.clone(),
            raise: None,
            cleared: None,
            repeat: None,
            sampling: Sampling::OnSample,
            enabled: false,
            description: None,
            origin: Origin::NONE,
        };
        let mut bank = Self::new(&[monitor]);
        bank.enable(0, true, now);
        bank
    }

    /// The same, with another number of pieces that each operator over time may keep (two at least).
    pub fn with_memory(monitors: &[Monitor], pieces: usize) -> Self {
        let mut inputs: Vec<MonitorInput> = Vec::new();
        let mut valued: Vec<bool> = Vec::new();
        let mut known: rustc_hash::FxHashMap<MonitorInput, usize> = rustc_hash::FxHashMap::default();
        let watches = monitors.iter().map(|monitor| {
            let (program, own) = compile(&monitor.when, pieces);
            let stamped = own.iter().map(|input| matches!(input, (MonitorInput::Port(_), _))).collect();
            let counted = (0..own.len()).map(|slot| program.counts(slot)).collect();
            let slots: Box<[usize]> = own
                .into_iter()
                .map(|(input, matters)| {
                    let slot = *known.entry(input).or_insert_with_key(|input| {
                        inputs.push(input.clone());
                        valued.push(false);
                        inputs.len() - 1
                    });
                    valued[slot] |= matters;
                    slot
                })
                .collect();
            WatchedMonitor {
                program,
                held: vec![InputSample::default(); slots.len()].into(),
                slots,
                stamped,
                counted,
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
        });
        let watches = watches.collect();
        let samples = vec![InputSample::default(); inputs.len()];
        Self { inputs, valued, samples, watches, last: Time::default(), troubles: Troubles::default() }
    }

    /// What the monitors look at, each once; [`Bank::step`] reads them by their index here.
    pub fn inputs(&self) -> &[MonitorInput] {
        &self.inputs
    }

    /// Whether the value of an input matters; else only when it is written does, and the value may be anything.
    ///
    /// # Panics
    /// When there is no input of that index.
    pub fn is_valued(&self, input: usize) -> bool {
        self.valued[input]
    }

    /// Looks at every input and evaluates the monitors whose turn it is. `raise` is called with the index of a monitor and
    /// its event, in the order in which things came to be, monitor by monitor.
    ///
    /// A time before the last one counts as that one. Nothing is allocated.
    pub fn step(
        &mut self,
        now: Time,
        read: &mut dyn FnMut(usize) -> InputSample,
        raise: &mut dyn FnMut(usize, EventName),
    ) {
        if now < self.last {
            self.troubles.backwards += 1;
        }
        let before = self.last;
        let now = now.max(before);
        self.last = now;
        if !self.watches.iter().any(|w| w.enabled) {
            return;
        }
        for (i, known) in self.samples.iter_mut().enumerate() {
            let mut fresh = read(i);
            // Another component may stand behind the name now; its clock is the same.
            let earliest = if fresh.writes > known.writes && known.present { known.at } else { Time::default() };
            let at = fresh.at.min(now).max(earliest);
            if fresh.present && at != fresh.at {
                self.troubles.backwards += u64::from(fresh.differs(known));
                fresh.at = at;
            }
            if fresh.present && self.valued[i] && fresh.value.is_nan() && fresh.differs(known) {
                self.troubles.not_numbers += 1;
            }
            *known = fresh;
        }
        for (i, watch) in self.watches.iter_mut().enumerate().filter(|(_, w)| w.enabled) {
            watch.step(before, now, &self.samples, &mut |event| raise(i, event));
        }
    }

    /// Switches a monitor on or off. One that is switched on begins with an empty history at the next step; one that is
    /// switched off says nothing more, not even that its condition is cleared. What is so already stays as it is.
    ///
    /// # Panics
    /// When there is no monitor of that index.
    pub fn enable(&mut self, monitor: usize, on: bool, now: Time) {
        let watch = &mut self.watches[monitor];
        if watch.enabled == on {
            return;
        }
        watch.enabled = on;
        watch.verdict = None;
        watch.waits = now;
        watch.again = Time::NEVER;
        watch.program.clear();
    }

    /// What a monitor's condition was when last evaluated; none when it is off, or new.
    ///
    /// # Panics
    /// When there is no monitor of that index.
    pub fn is_true(&self, monitor: usize) -> Option<bool> {
        self.watches[monitor].verdict
    }

    /// How far the condition was from the contrary when last evaluated; none when it is off, or new.
    ///
    /// # Panics
    /// When there is no monitor of that index.
    pub fn robustness(&self, monitor: usize) -> Option<f64> {
        let watch = &self.watches[monitor];
        watch.verdict.map(|_| watch.program.grade().robustness)
    }

    /// When a step is due though no sample comes: a time passes, a rate falls, an event is to be repeated, a monitor that
    /// runs at a rate has its turn. Never before the last step.
    pub fn next_wake(&self) -> Option<Time> {
        let times = self.watches.iter().filter(|w| w.enabled).map(WatchedMonitor::wake);
        times.min().filter(|wake| *wake != Time::NEVER).map(|wake| wake.max(self.last))
    }

    /// Whether a monitor that is enabled looks at an input.
    pub fn is_watched(&self, input: usize) -> bool {
        self.watches.iter().any(|watch| watch.enabled && watch.slots.contains(&input))
    }

    /// How many pieces of signals one monitor has merged so far.
    ///
    /// # Panics
    /// When there is no monitor of that index.
    pub fn merged(&self, monitor: usize) -> u64 {
        self.watches[monitor].program.merged()
    }

    /// What was not as it should be.
    pub fn troubles(&self) -> Troubles {
        let merged = self.watches.iter().map(|w| w.program.merged()).sum();
        Troubles { merged, ..self.troubles }
    }
}

/// The first instant that is not before a position.
fn time_of(position: u64) -> Time {
    if position == u64::MAX { Time::NEVER } else { Time(position / 2 + position % 2) }
}

impl WatchedMonitor {
    fn wake(&self) -> Time {
        match (self.verdict, self.sampling) {
            (None, _) => self.waits,
            (_, Sampling::Every(_)) => self.tick,
            (Some(_), Sampling::OnSample) => time_of(self.program.wake()).min(self.again),
        }
    }

    fn step(&mut self, before: Time, now: Time, samples: &[InputSample], raise: &mut dyn FnMut(EventName)) {
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
                let changed = self.slots.iter().enumerate().any(|(i, slot)| self.is_news(i, &samples[*slot]));
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
            loop {
                // Always onwards: time stands still for nobody.
                let position = self.program.next().min(self.pending(looked, samples)).max(self.program.position() + 1);
                if position >= target {
                    break;
                }
                self.arrive(looked, position, samples);
                self.program.evaluate(position, &self.held);
                if self.sampling == Sampling::OnSample {
                    self.repeat(time_of(position - 1), raise);
                    self.observe(time_of(position), raise);
                }
            }
        }
        let news = new || (0..self.slots.len()).any(|i| self.is_news(i, &samples[self.slots[i]]));
        for (held, slot) in self.held.iter_mut().zip(&self.slots) {
            *held = samples[*slot];
        }
        // All that came is taken in already, at the instants at which it came, and nothing changes by itself up to now.
        match news || self.program.next() <= target {
            true => _ = self.program.evaluate(target, &self.held),
            false => self.program.go_on(target),
        }
        if self.verdict == Some(true) && !self.program.grade().holds {
            // What was due before it ended was due.
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

    /// The first position from which a sample counts that is not held yet.
    fn pending(&self, looked: u64, samples: &[InputSample]) -> u64 {
        let arrivals = self.slots.iter().enumerate().filter_map(|(i, slot)| self.arrival(looked, i, &samples[*slot]));
        arrivals.min().unwrap_or(u64::MAX)
    }

    /// Takes the samples that count from `position` on.
    fn arrive(&mut self, looked: u64, position: u64, samples: &[InputSample]) {
        for i in 0..self.slots.len() {
            let sample = samples[self.slots[i]];
            if self.arrival(looked, i, &sample).is_some_and(|arrival| arrival <= position) {
                self.held[i] = sample;
            }
        }
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
