//! All monitors of a deployment, over inputs that are sampled once.

use super::compile::{PIECES, compile};
use super::sample::{InputNews, InputSample, MonitorInput};
use super::watched::WatchedMonitor;
use crate::model::monitor::{Condition, Monitor};
use crate::model::{EventName, Ident};
use crate::time::Time;

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
    /// What came to each with the present step.
    news: Vec<InputNews>,
    watches: Vec<WatchedMonitor>,
    last: Time,
    troubles: Troubles,
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
        let name = Ident::new("holds").expect("a plain name");
        let monitor = Monitor { enabled: false, ..Monitor::new(name, condition.clone()) };
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
            WatchedMonitor::new(monitor, program, slots, stamped)
        });
        let watches = watches.collect();
        let samples = vec![InputSample::default(); inputs.len()];
        let news = vec![InputNews::Nothing; inputs.len()];
        Self { inputs, valued, samples, news, watches, last: Time::default(), troubles: Troubles::default() }
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
        if !self.watches.iter().any(|w| w.is_enabled()) {
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
            self.news[i] = known.news(&fresh);
            *known = fresh;
        }
        for (i, watch) in self.watches.iter_mut().enumerate().filter(|(_, w)| w.is_enabled()) {
            watch.step(before, now, &self.samples, &self.news, &mut |event| raise(i, event));
        }
    }

    /// Switches a monitor on or off. One that is switched on begins with an empty history at the next step; one that is
    /// switched off says nothing more, not even that its condition is cleared. What is so already stays as it is.
    ///
    /// # Panics
    /// When there is no monitor of that index.
    pub fn enable(&mut self, monitor: usize, on: bool, now: Time) {
        self.watches[monitor].enable(on, now);
    }

    /// What a monitor's condition was when last evaluated; none when it is off, or new.
    ///
    /// # Panics
    /// When there is no monitor of that index.
    pub fn is_true(&self, monitor: usize) -> Option<bool> {
        self.watches[monitor].verdict()
    }

    /// How far the condition was from the contrary when last evaluated; none when it is off, or new.
    ///
    /// # Panics
    /// When there is no monitor of that index.
    pub fn robustness(&self, monitor: usize) -> Option<f64> {
        self.watches[monitor].robustness()
    }

    /// When a step is due though no sample comes: a time passes, a rate falls, an event is to be repeated, a monitor that
    /// runs at a rate has its turn. Never before the last step.
    pub fn next_wake(&self) -> Option<Time> {
        let times = self.watches.iter().filter(|w| w.is_enabled()).map(WatchedMonitor::wake);
        times.min().filter(|wake| *wake != Time::NEVER).map(|wake| wake.max(self.last))
    }

    /// Whether a monitor that is enabled looks at an input.
    pub fn is_watched(&self, input: usize) -> bool {
        self.watches.iter().any(|watch| watch.is_enabled() && watch.looks_at(input))
    }

    /// How many pieces of signals one monitor has merged so far.
    ///
    /// # Panics
    /// When there is no monitor of that index.
    pub fn merged(&self, monitor: usize) -> u64 {
        self.watches[monitor].merged()
    }

    /// What was not as it should be.
    pub fn troubles(&self) -> Troubles {
        let merged = self.watches.iter().map(WatchedMonitor::merged).sum();
        Troubles { merged, ..self.troubles }
    }
}
