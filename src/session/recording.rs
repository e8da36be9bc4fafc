//! Series of numbers, recorded beside whoever acts: at fixed times it is looked at what ports carry, and that is kept, up to a
//! bound, and summed up, without one.

use super::Session;
use crate::model::monitor::PortSignal;
use crate::monitor::{InputSample, MonitorInput};
use crate::platform::Watch;
use crate::time::{Clock, Signal, Time, lock};
use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A recording. Clones are the same one. It goes on until it is [stopped](Self::stop).
#[derive(Clone)]
pub struct Recording {
    signals: Arc<[PortSignal]>,
    every: Duration,
    state: Arc<Mutex<RecordingState>>,
    wake: Signal,
}

impl fmt::Debug for Recording {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Recording").field("signals", &self.signals).field("every", &self.every).finish_non_exhaustive()
    }
}

#[derive(Default)]
struct RecordingState {
    stopped: bool,
    /// When it was looked, and what there was then, of all signals one behind the other; NaN where there was nothing.
    times: Vec<Time>,
    values: Vec<f64>,
    figures: Vec<SeriesFigures>,
    looks: u64,
    /// From when on nothing is kept any more, since there was no room.
    full: Option<Time>,
}

/// What is known of all values of a series, kept or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesFigures {
    /// How many there are.
    pub count: u64,
    sum: f64,
    squares: f64,
    /// The smallest.
    pub min: f64,
    /// The largest.
    pub max: f64,
    /// The newest.
    pub last: f64,
}

impl Default for SeriesFigures {
    fn default() -> Self {
        let (min, max) = (f64::INFINITY, f64::NEG_INFINITY);
        Self { count: 0, sum: 0.0, squares: 0.0, min, max, last: f64::NAN }
    }
}

impl SeriesFigures {
    fn add(&mut self, value: f64) {
        self.count += 1;
        self.sum += value;
        self.squares += value * value;
        // Not a number is neither small nor large, and must not be overlooked.
        self.min = if value.is_nan() || value < self.min { value } else { self.min };
        self.max = if value.is_nan() || value > self.max { value } else { self.max };
        self.last = value;
    }

    #[allow(clippy::cast_precision_loss)]
    fn number(&self) -> f64 {
        self.count as f64
    }

    /// The mean.
    pub fn mean(&self) -> f64 {
        self.sum / self.number()
    }

    /// The root of the mean of the squares.
    pub fn rms(&self) -> f64 {
        (self.squares / self.number()).sqrt()
    }
}

/// What a recording has kept.
#[derive(Debug, Clone, Default)]
pub struct RecordedTable {
    /// When it was looked.
    pub times: Vec<Time>,
    /// A row a time, a value a signal, one row behind the other; NaN where there was nothing.
    pub values: Vec<f64>,
    /// How often it was looked in all.
    pub looks: u64,
    /// From when on nothing was kept any more.
    pub full: Option<Time>,
}

/// Room for values, shared by several recordings.
#[derive(Debug, Clone)]
pub struct RecordingRoom(Arc<AtomicUsize>);

impl RecordingRoom {
    /// For so many values.
    pub fn new(values: usize) -> Self {
        Self(Arc::new(AtomicUsize::new(values)))
    }

    fn take(&self, values: usize) -> bool {
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(values)).is_ok()
    }
}

impl Session {
    /// Records numbers that go through ports from now on, the first of them after `every`, until it is stopped.
    ///
    /// # Errors
    /// When this platform does not show them, or there is no thread left.
    pub fn record(&self, signals: Vec<PortSignal>, every: Duration, room: &RecordingRoom) -> Result<Recording, String> {
        let inputs: Vec<MonitorInput> = signals.iter().cloned().map(MonitorInput::Port).collect();
        let clock = self.clock().clone();
        // It looks when its time has come, and at no write.
        let watch = self.platform().watch(&inputs, &clock.signal());
        let watch = watch.filter(|watch| (0..inputs.len()).all(|input| watch.shows(input)));
        let watch = watch.ok_or("this platform does not show what goes through ports")?;
        let figures = vec![SeriesFigures::default(); signals.len()];
        let state = Arc::new(Mutex::new(RecordingState { figures, ..RecordingState::default() }));
        let recording = Recording { signals: signals.into(), every, state, wake: clock.signal() };
        let (own, room, began) = (recording.clone(), room.clone(), clock.now());
        let thread = clock.clone();
        clock
            .try_spawn("recording", move || own.live(&thread, began, watch, &room))
            .map_err(|error| format!("the operating system has no thread for it: {error}"))?;
        Ok(recording)
    }
}

impl Recording {
    /// Ends it; what it has stays.
    pub fn stop(&self) {
        lock(&self.state).stopped = true;
        self.wake.notify();
    }

    /// What it records.
    pub fn signals(&self) -> &[PortSignal] {
        &self.signals
    }

    /// How often it looks.
    pub fn every(&self) -> Duration {
        self.every
    }

    /// What is known of a signal's values so far.
    pub fn figures(&self, signal: usize) -> SeriesFigures {
        lock(&self.state).figures[signal]
    }

    /// What it has kept so far.
    pub fn table(&self) -> RecordedTable {
        let state = lock(&self.state);
        let (times, values) = (state.times.clone(), state.values.clone());
        RecordedTable { times, values, looks: state.looks, full: state.full }
    }

    fn live(&self, clock: &Clock, began: Time, mut watch: Box<dyn Watch>, room: &RecordingRoom) {
        let mut samples = vec![InputSample::default(); self.signals.len()];
        let mut next = began + self.every;
        loop {
            self.wake.wait(next);
            if lock(&self.state).stopped {
                return;
            }
            let now = clock.now();
            if now < next {
                continue;
            }
            watch.look(now, &mut samples);
            lock(&self.state).add(now, &samples, room);
            while next <= now {
                next += self.every;
            }
        }
    }
}

impl RecordingState {
    fn add(&mut self, now: Time, samples: &[InputSample], room: &RecordingRoom) {
        self.looks += 1;
        for (figures, sample) in self.figures.iter_mut().zip(samples).filter(|(_, sample)| sample.present) {
            figures.add(sample.value);
        }
        if self.full.is_some() || !room.take(samples.len()) {
            self.full.get_or_insert(now);
            return;
        }
        self.times.push(now);
        self.values.extend(samples.iter().map(|sample| if sample.present { sample.value } else { f64::NAN }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(value: f64, present: bool) -> InputSample {
        InputSample { value, at: Time(0), writes: 1, present }
    }

    #[test]
    fn what_has_no_room_still_counts() {
        let mut state = RecordingState { figures: vec![SeriesFigures::default(); 2], ..RecordingState::default() };
        let room = RecordingRoom::new(5);
        for (at, value) in [(1, 3.0), (2, -4.0), (3, 5.0)] {
            state.add(Time(at), &[sample(value, true), sample(1.0, false)], &room);
        }
        let figures = state.figures[0];
        assert_eq!((figures.count, figures.min, figures.max, figures.last), (3, -4.0, 5.0, 5.0));
        assert!((figures.rms() - (50.0_f64 / 3.0).sqrt()).abs() < 1e-12 && (figures.mean() - 4.0 / 3.0).abs() < 1e-12);
        assert_eq!(state.figures[1].count, 0, "what is not there is no value");
        assert_eq!((state.times.len(), state.looks, state.full), (2, 3, Some(Time(3))));
        assert!(state.values[1].is_nan() && state.values[2] == -4.0);
    }

    #[test]
    fn not_a_number_is_not_overlooked() {
        let mut figures = SeriesFigures::default();
        [1.0, f64::NAN].into_iter().for_each(|value| figures.add(value));
        assert!(figures.max.is_nan() && figures.min.is_nan() && figures.rms().is_nan());
        figures.add(9.0);
        assert!(figures.max.is_nan(), "not by what comes after it either");
    }
}
