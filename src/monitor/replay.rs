//! Monitors over recorded samples.

use super::bank::{Bank, Troubles};
use super::sample::{InputSample, MonitorInput};
use super::table::{Columns, TableProblem};
use crate::limits::SAMPLES_WAKES;
use crate::model::{EventName, Monitor};
use crate::time::Time;
use std::time::Duration;

/// Monitors and the recording they look at, line by line.
#[derive(Debug, Clone)]
pub struct Replay {
    bank: Bank,
    columns: Columns,
    /// Of each column, the inputs that it feeds.
    feeds: Vec<Vec<usize>>,
    wanted: Vec<bool>,
    samples: Vec<InputSample>,
    /// Of each input, the line that wrote it last.
    touched: Vec<u64>,
    tallies: Vec<Tally>,
    now: Option<Time>,
    lines: u64,
    jumped: bool,
    first_nan: Option<(usize, Time)>,
}

/// What a monitor said over a recording.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tally {
    /// How often its condition became true.
    pub times: u64,
    /// How long it was true in all.
    pub total: Duration,
    /// The least robustness that is finite, and when it came to be.
    pub least: Option<(f64, Time)>,
    /// The greatest one.
    pub greatest: Option<(f64, Time)>,
    /// What it was last.
    verdict: bool,
}

/// An event that a monitor raised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MonitorEvent {
    /// When.
    pub at: Time,
    /// The index of the monitor.
    pub monitor: usize,
    /// The event.
    pub event: EventName,
    /// The robustness of its condition then.
    pub robustness: f64,
}

impl Replay {
    /// Monitors over a recording with these columns; `names` gives columns other names than they have in the file
    /// (signal, column). The inputs that no column feeds are answered beside it: their conditions would see
    /// nothing. What only monitors look at that are not enabled is not missed.
    pub fn new(monitors: &[Monitor], columns: Columns, names: &[(String, String)]) -> (Self, Vec<MonitorInput>) {
        let bank = Bank::new(monitors);
        let mut feeds = vec![Vec::new(); columns.names().len()];
        let mut missing = Vec::new();
        for (i, input) in bank.inputs().iter().enumerate() {
            let own = input.to_string();
            let column = names.iter().find(|(signal, _)| *signal == own).map_or(own.as_str(), |(_, column)| column);
            let found = columns.names().iter().position(|name| name == column);
            if let Some(found) = found.filter(|found| *found != columns.time()) {
                feeds[found].push(i);
                continue;
            }
            // Of a port that is only watched for coming, any part of it tells.
            let parts: Vec<usize> = match input {
                MonitorInput::Port(port) if !bank.is_valued(i) => {
                    let whole = port.member.to_string();
                    let is_part =
                        |name: &str| name.strip_prefix(&whole).is_some_and(|rest| rest.starts_with(['.', '[']));
                    (0..feeds.len()).filter(|c| is_part(&columns.names()[*c])).collect()
                }
                _ => Vec::new(),
            };
            if parts.is_empty() && bank.is_watched(i) {
                missing.push(input.clone());
            }
            parts.into_iter().for_each(|c| feeds[c].push(i));
        }
        let wanted = feeds.iter().map(|f| !f.is_empty()).collect();
        let samples = vec![InputSample::default(); bank.inputs().len()];
        let tallies = vec![Tally::default(); monitors.len()];
        let touched = vec![0; samples.len()];
        let (now, first_nan) = (None, None);
        let replay =
            Self { bank, columns, feeds, wanted, samples, touched, tallies, now, lines: 0, jumped: false, first_nan };
        (replay, missing)
    }

    /// Everything that the monitors look at, as columns name it.
    pub fn signals(&self) -> Vec<String> {
        self.bank.inputs().iter().map(ToString::to_string).collect()
    }

    /// Columns that nothing looks at.
    pub fn unused(&self) -> Vec<&str> {
        let names = self.columns.names().iter().enumerate();
        names.filter(|(i, _)| *i != self.columns.time() && !self.wanted[*i]).map(|(_, name)| name.as_str()).collect()
    }

    /// Goes on to the next line; `raised` hears the events up to its time, in order.
    ///
    /// # Errors
    /// What is wrong with the line; nothing of it has been taken then.
    pub fn line(&mut self, line: &str, raised: &mut dyn FnMut(MonitorEvent)) -> Result<(), TableProblem> {
        let mut fresh = Vec::new();
        let at = self.columns.line(line, &self.wanted, &mut |column, value| fresh.push((column, value)))?;
        // The history begins at the first line, not when the clock did.
        if self.now.is_some() {
            let mut wakes = 0;
            while let Some(wake) = self.bank.next_wake().filter(|wake| *wake < at) {
                if wakes == SAMPLES_WAKES {
                    self.jumped = true;
                    break;
                }
                wakes += 1;
                self.step(wake, raised);
            }
        }
        self.lines += 1;
        for (column, value) in fresh {
            if value.is_nan() {
                self.first_nan.get_or_insert((column, at));
            }
            for input in &self.feeds[column] {
                let sample = &mut self.samples[*input];
                // Several columns of one port in one line are one sample of it.
                let again = std::mem::replace(&mut self.touched[*input], self.lines) == self.lines;
                let writes = sample.writes + u64::from(!again);
                *sample = InputSample { value, at, writes, present: true };
            }
        }
        self.step(at, raised);
        Ok(())
    }

    fn step(&mut self, now: Time, raised: &mut dyn FnMut(MonitorEvent)) {
        let passed = self.now.map_or(Duration::ZERO, |before| now.since(before));
        for tally in self.tallies.iter_mut().filter(|t| t.verdict) {
            tally.total += passed;
        }
        let mut events: smallvec::SmallVec<[(usize, EventName); 8]> = smallvec::SmallVec::new();
        let samples = &self.samples;
        self.bank.step(now, &mut |i| samples[i], &mut |monitor, event| events.push((monitor, event)));
        for (i, tally) in self.tallies.iter_mut().enumerate() {
            let verdict = self.bank.is_true(i).unwrap_or(false);
            tally.times += u64::from(verdict && !tally.verdict);
            tally.verdict = verdict;
            if let Some(robustness) = self.bank.robustness(i).filter(|r| r.is_finite()) {
                if tally.least.is_none_or(|(least, _)| robustness < least) {
                    tally.least = Some((robustness, now));
                }
                if tally.greatest.is_none_or(|(greatest, _)| robustness > greatest) {
                    tally.greatest = Some((robustness, now));
                }
            }
        }
        for (monitor, event) in events {
            let robustness = self.bank.robustness(monitor).unwrap_or(f64::NEG_INFINITY);
            raised(MonitorEvent { at: now, monitor, event, robustness });
        }
        self.now = Some(now);
    }

    /// What each monitor said so far.
    pub fn tallies(&self) -> &[Tally] {
        &self.tallies
    }

    /// Lines with samples so far.
    pub fn lines(&self) -> u64 {
        self.lines
    }

    /// Whether part of a gap was passed in one step.
    pub fn jumped(&self) -> bool {
        self.jumped
    }

    /// The column and the time of the first sample that is no number.
    pub fn first_nan(&self) -> Option<(&str, Time)> {
        self.first_nan.map(|(column, at)| (self.columns.names()[column].as_str(), at))
    }

    /// How many pieces of signals a monitor has merged so far.
    pub fn merged(&self, monitor: usize) -> u64 {
        self.bank.merged(monitor)
    }

    /// What was not as it should be.
    pub fn troubles(&self) -> Troubles {
        self.bank.troubles()
    }
}
