//! The platform of the example, as a program that brings one tries it: docs/platforms.md shows these lines.

#[path = "../../../examples/own_platform/bus.rs"]
mod bus;

use bus::Bus;
use davit::platforms::conformance::{Bed, BedTrouble, StandIn, UnderTest, run};
use davit::platforms::{Outcome, Platform, StepBatch, TimedStep};
use davit::{Clock, Step, Time, Value};
use std::io::{self, Write};
use std::sync::{Arc, Mutex};
use std::time::Duration;

struct BusBed;

impl Bed for BusBed {
    fn make(&self, trouble: &[(&'static str, BedTrouble)]) -> UnderTest {
        // What is at the other end: it fails, panics and hangs as it is told to.
        let (books, made) = StandIn::with(trouble);
        let bus = Bus::new(Box::new(std::io::sink()), String::new(), books);
        UnderTest { platform: Arc::new(bus), ..made }
    }
}

#[test]
fn the_bus_keeps_the_rules() {
    let report = run(&BusBed);
    assert!(report.is_kept(), "{report}");
    let skipped: Vec<&str> = report.skipped().map(|(rule, _)| rule.name).collect();
    assert_eq!(skipped, ["prepared_steps_do_what_executed_ones_do"], "it prepares nothing, and need not");
}

/// The lines that were sent.
#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<u8>>>);

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A device that is gone.
struct Nowhere;

impl Write for Nowhere {
    fn write(&mut self, _: &[u8]) -> io::Result<usize> {
        Err(io::ErrorKind::BrokenPipe.into())
    }
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// So many components that are made in one call.
fn making(clock: &Clock, count: usize) -> StepBatch {
    let pose = Value::Record(vec![("x".parse().unwrap(), 0.0.into()), ("y".parse().unwrap(), 0.0.into())]);
    let properties = vec![Value::Str("".into()), 1.0.into(), Value::floats(&[1.0; 3]), Value::Int(0), pose];
    let step = |i| Step::Create {
        component: format!("c{i}").parse().unwrap(),
        ty: "Plant".parse().unwrap(),
        activity: None,
        properties: properties.clone(),
    };
    let timed = |i| TimedStep { step: step(i), patience: Duration::from_secs(1), until: Time::NEVER };
    StepBatch::new(clock.clone(), (0..count).map(timed).collect())
}

#[test]
fn many_steps_are_one_message() {
    let (books, made) = StandIn::with(&[]);
    let lines = Lines::default();
    let bus = Bus::new(Box::new(lines.clone()), String::new(), books);
    let batch = making(&made.clock, 20);
    bus.execute_batch(&batch);
    let answers = batch.take(true);
    assert!(answers.len() == 20 && answers.iter().all(|answer| answer.outcome == Outcome::Done(None)), "{answers:?}");
    let sent = String::from_utf8(lines.0.lock().unwrap().clone()).unwrap();
    assert_eq!(sent.lines().count(), 1, "{sent}");
    assert!(sent.starts_with("create c0") && sent.contains("; create c19"), "{sent}");
}

#[test]
fn what_cannot_be_sent_is_not_done() {
    let (books, made) = StandIn::with(&[]);
    let bus = Bus::new(Box::new(Nowhere), String::new(), books);
    let batch = making(&made.clock, 3);
    bus.execute_batch(&batch);
    let answers = batch.take(true);
    assert!(matches!(answers[..], [ref only] if matches!(only.outcome, Outcome::NotDone(_))), "{answers:?}");
    assert!(bus.observe(made.clock.now()).unwrap().is_empty());
}
