//! A bank with inputs that a test writes, and what it raised.

use davit::model::monitor::*;
use davit::model::*;
use davit::monitor::{Bank, InputSample, MonitorInput};
use davit::time::Time;
use std::time::Duration;

pub const MS: u64 = 1_000_000;

pub fn ms(n: u64) -> Duration {
    Duration::from_millis(n)
}

pub fn port(text: &str) -> MonitoredSignal {
    MonitoredSignal::new(SignalKind::Port(text.parse().unwrap()))
}

pub fn constant(v: f64) -> MonitoredSignal {
    MonitoredSignal::new(SignalKind::Constant(v))
}

pub fn compare(left: MonitoredSignal, op: Comparison, right: f64) -> Condition {
    Condition::new(ConditionKind::Compare { left, op, right: constant(right), hysteresis: None })
}

pub fn above(text: &str, v: f64) -> Condition {
    compare(port(text), Comparison::Above, v)
}

pub fn monitor(when: Condition) -> Monitor {
    Monitor {
        raise: Some(EventName::new("e_on").unwrap()),
        cleared: Some(EventName::new("e_off").unwrap()),
        ..Monitor::new(Ident::new("m").unwrap(), when)
    }
}

/// A bank and what its inputs hold, by the text of the input.
pub struct Rig {
    pub bank: Bank,
    pub samples: Vec<InputSample>,
    pub raised: Vec<(u64, usize, String)>,
}

impl Rig {
    pub fn new(monitors: &[Monitor]) -> Self {
        Self::of(Bank::new(monitors))
    }

    pub fn of(bank: Bank) -> Self {
        let samples = vec![InputSample::default(); bank.inputs().len()];
        Self { bank, samples, raised: Vec::new() }
    }

    pub fn input(&self, text: &str) -> usize {
        let name = |input: &MonitorInput| match input {
            MonitorInput::Port(port) => port.to_string(),
            MonitorInput::State(component) => format!("state {component}"),
            MonitorInput::Faulted(component) => format!("faulted {component}"),
            MonitorInput::Activity { activity, counter } => format!("{activity} {}", counter.word()),
        };
        self.bank.inputs().iter().position(|i| name(i) == text).unwrap_or_else(|| panic!("no input {text}"))
    }

    /// Writes an input at a time.
    pub fn write(&mut self, text: &str, at: u64, value: f64) {
        let i = self.input(text);
        let sample = &mut self.samples[i];
        *sample = InputSample { value, at: Time(at), writes: sample.writes + 1, present: true };
    }

    /// One step.
    pub fn step(&mut self, now: u64) {
        let (samples, raised) = (&self.samples, &mut self.raised);
        self.bank.step(Time(now), &mut |i| samples[i], &mut |m, event| raised.push((now, m, event.to_string())));
    }

    /// Steps at every time the bank wants one, up to and with `now`.
    pub fn run(&mut self, now: u64) {
        self.run_before(now);
        self.step(now);
    }

    /// Writes, after everything that was due before.
    pub fn sample(&mut self, text: &str, at: u64, value: f64) {
        if at > 0 {
            self.run_before(at);
        }
        self.write(text, at, value);
        self.step(at);
    }

    fn run_before(&mut self, now: u64) {
        let mut last = None;
        while let Some(wake) = self.bank.next_wake().filter(|w| w.0 < now) {
            assert!(last.is_none_or(|last| wake > last), "woken twice for {wake}");
            last = Some(wake);
            self.step(wake.0);
        }
    }

    /// What was raised, as `time event`.
    pub fn events(&self) -> Vec<String> {
        self.raised.iter().map(|(at, _, event)| format!("{at} {event}")).collect()
    }
}
