//! Prepared switches do what the ordinary way does, and give way to it when they no longer fit.

use crate::rig::*;
use davit::model::*;
use davit::platform::simulated::{Simulated, SimulatedOptions};
use davit::platform::*;
use davit::time::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Counts what goes the prepared way.
struct Counting {
    inner: Simulated,
    prepared: Arc<AtomicUsize>,
}

struct Counted {
    inner: Box<dyn Prepared>,
    prepared: Arc<AtomicUsize>,
}

impl Prepared for Counted {
    fn execute(&mut self, index: usize, value: Option<&Value>, now: Time, deadline: Time) -> Outcome {
        self.prepared.fetch_add(1, Ordering::SeqCst);
        self.inner.execute(index, value, now, deadline)
    }
}

impl Platform for Counting {
    leaves_to_inner!();

    fn execution(&self, step: &Step) -> Execution {
        self.inner.execution(step)
    }
    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        Platform::execute(&self.inner, step, deadline)
    }
    fn prepare(&self, steps: &[Step]) -> Option<Box<dyn Prepared>> {
        let prepared = self.prepared.clone();
        self.inner.prepare(steps).map(|inner| Box::new(Counted { inner, prepared }) as _)
    }
}

fn up() -> (Rig, Arc<AtomicUsize>) {
    let prepared = Arc::new(AtomicUsize::new(0));
    let count = prepared.clone();
    let rig = Rig::with(scenario(), SimulatedOptions::default(), move |inner| Arc::new(Counting { inner, prepared }));
    for word in ["make", "wire", "run"] {
        assert_eq!(rig.ask(word), [format!("{word}.ok")]);
    }
    (rig, count)
}

#[test]
fn a_switch_goes_the_prepared_way_to_and_fro() {
    let (rig, count) = up();
    let before = rig.see();
    assert_eq!(rig.ask("quick"), ["quick.ok"]);
    assert_eq!(count.load(Ordering::SeqCst), 0, "the first time in the ordinary way");
    let after = rig.see();
    for round in 1..4 {
        assert_eq!(rig.ask("quick.undo"), ["quick.undone"]);
        assert_eq!(rig.see(), before);
        rig.in_step();
        assert_eq!(rig.ask("quick"), ["quick.ok"]);
        assert_eq!(rig.see(), after);
        rig.in_step();
        assert_eq!(rig.frames(), ["make", "wire", "run", "quick"]);
        // The first frame was pushed in the ordinary way and is popped so: stop, two properties, a port, start; the rest
        // to and fro.
        assert_eq!(count.load(Ordering::SeqCst), 5 + 10 * (round - 1));
    }
    for _ in 0..4 {
        assert_eq!(rig.ask("undo"), ["undo.done"]);
    }
    assert!(rig.see().is_empty(), "frames of both kinds are undone in the ordinary way too");
    rig.each_answered_once();
}

#[test]
fn it_declines_when_its_component_is_another_one() {
    let (rig, count) = up();
    rig.ask("quick");
    rig.ask("quick.undo");
    assert_eq!(rig.ask("replace"), ["replace.ok"]);
    assert_eq!(rig.ask("quick"), ["quick.ok"]);
    assert_eq!(count.load(Ordering::SeqCst), 0, "B is another B");
    rig.in_step();
    assert_eq!(rig.ask("quick.undo"), ["quick.undone"]);
    assert_eq!(rig.ask("quick"), ["quick.ok"]);
    assert_eq!(count.load(Ordering::SeqCst), 5, "prepared anew");
    rig.in_step();
}

#[test]
fn values_in_between_are_captured_anew() {
    let (rig, count) = up();
    rig.ask("quick");
    rig.ask("quick.undo");
    assert_eq!(rig.ask("eight"), ["eight.ok"]);
    let before = rig.see();
    assert_eq!(rig.ask("quick"), ["quick.ok"]);
    assert!(count.load(Ordering::SeqCst) > 0);
    assert_eq!(rig.ask("quick.undo"), ["quick.undone"]);
    assert_eq!(rig.see(), before, "what eight had set, not what was there the first time");
    rig.in_step();
}
