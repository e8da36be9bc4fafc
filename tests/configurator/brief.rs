//! Brief steps: several in one call of the platform, in any manner a platform may carry them out.

use crate::rig::*;
use davit::configurator::{Progress, progress::StepEnd};
use davit::model::*;
use davit::platform::simulated::{Faults, Options, Simulated};
use davit::platform::{Ended, Execution, Outcome, Platform};
use davit::time::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Manner {
    /// As many as it is given.
    All,
    /// The first of them.
    One,
    /// As many as it is given, each in so many milliseconds.
    Slow(u64),
    /// Says nothing at all, once.
    Silent,
    /// Panics once, after the first of them.
    Panics,
    /// Does not come back for half a minute, once, after the first of them.
    Lost,
    /// The same, and cannot be observed meanwhile.
    Gone,
}

/// Creating and destroying are brief here; the calls that carry them out are counted.
struct Hasty {
    inner: Simulated,
    manner: Manner,
    calls: Arc<AtomicUsize>,
}

impl Hasty {
    fn each(&self, steps: &[Step], each: Duration, until: Time) -> Vec<Ended> {
        let mut ended = Vec::new();
        for step in steps {
            let deadline = (self.inner.clock().now() + each).min(until);
            ended.push(Ended { outcome: Platform::execute(&self.inner, step, deadline), took: Some(each / 1000) });
            if !matches!(ended.last(), Some(Ended { outcome: Outcome::Done(_), .. })) {
                break;
            }
        }
        ended
    }
}

impl Platform for Hasty {
    leaves_to_inner!();

    fn execution(&self, step: &Step) -> Execution {
        match step {
            Step::Create { .. } | Step::Destroy { .. } => Execution::Brief,
            _ => self.inner.execution(step),
        }
    }
    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        Platform::execute(&self.inner, step, deadline)
    }
    fn execute_brief(&self, steps: Vec<Step>, each: Duration, until: Time, stop: &Arc<AtomicBool>) -> Vec<Ended> {
        let first = self.calls.fetch_add(1, Ordering::SeqCst) == 0;
        match self.manner {
            Manner::One => self.each(&steps[..1], each, until),
            Manner::Slow(ms) => {
                let clock = self.inner.clock();
                let mut ended = Vec::new();
                for step in &steps {
                    if ended.is_empty() || !stop.load(Ordering::SeqCst) {
                        clock.sleep(Duration::from_millis(ms));
                        ended.extend(self.each(std::slice::from_ref(step), each, until));
                    }
                }
                ended
            }
            Manner::Silent if first => Vec::new(),
            Manner::Panics if first => {
                self.each(&steps[..1], each, until);
                panic!("a defect of the platform")
            }
            Manner::Lost | Manner::Gone if first => {
                let ended = self.each(&steps[..1], each, until);
                self.inner.clock().sleep(Duration::from_secs(30));
                ended
            }
            _ => self.each(&steps, each, until),
        }
    }
}

fn rig(manner: Manner, blocking: bool) -> (Rig, Arc<AtomicUsize>) {
    let calls = Arc::new(AtomicUsize::new(0));
    let counted = calls.clone();
    let options = Options { blocking, ..Options::default() };
    (Rig::with(scenario(), options, move |inner| Arc::new(Hasty { inner, manner, calls: counted })), calls)
}

/// Whether it tells that a step of that name was done.
fn told_of(told: &Progress, verb: &str) -> bool {
    matches!(told, Progress::Ended { step, end: StepEnd::Done, undoing: false, .. } if step.verb == verb)
}

#[test]
fn every_manner_leads_to_the_same() {
    for blocking in [false, true] {
        for manner in [Manner::All, Manner::One, Manner::Slow(20)] {
            let (rig, calls) = rig(manner, blocking);
            for word in ["make", "wire", "run", "replace"] {
                assert_eq!(rig.ask(word), [format!("{word}.ok")], "{manner:?}");
                rig.in_step();
            }
            // One that is alone is no list. `replace` destroys B and creates it again: never together, since one needs
            // the other.
            let lists = if manner == Manner::One { 2 } else { 1 };
            assert_eq!(calls.load(Ordering::SeqCst), lists, "{manner:?}, blocking: {blocking}");
            for _ in 0..4 {
                assert_eq!(rig.ask("undo"), ["undo.done"], "{manner:?}");
                rig.in_step();
            }
            assert!(rig.see().is_empty());
            rig.each_answered_once();
        }
    }
}

/// The way back takes its time: several brief steps are not late because those that they take back were.
#[test]
fn what_was_too_slow_is_taken_back() {
    let calls = Arc::new(AtomicUsize::new(0));
    let counted = calls.clone();
    let mut all = scenario();
    all.iter_mut().filter(|c| c.id == id("make")).for_each(|c| c.timeout = Some(Duration::from_millis(250)));
    let wrap = move |inner| Arc::new(Hasty { inner, manner: Manner::Slow(100), calls: counted }) as Arc<dyn Platform>;
    let rig = Rig::with(all, Options { blocking: true, ..Options::default() }, wrap);
    assert_eq!(rig.ask("make"), ["make.failed"]);
    assert!(rig.see().is_empty());
    rig.each_answered_once();
    rig.in_step();
}

#[test]
fn a_platform_that_breaks_its_word_is_read_back() {
    for manner in [Manner::Silent, Manner::Panics, Manner::Lost] {
        let (rig, _) = rig(manner, false);
        assert_eq!(rig.ask("make"), ["make.failed"], "{manner:?}");
        assert!(rig.see().is_empty(), "{manner:?}: what it had done unseen was taken back");
        assert_eq!(rig.ask("make"), ["make.ok"], "{manner:?}");
        rig.in_step();
        rig.each_answered_once();
    }
}

#[test]
fn a_platform_that_does_not_answer_is_not_asked_for_each() {
    let (rig, _) = rig(Manner::Gone, false);
    let blind = Faults { blind: true, ..Faults::default() };
    rig.submit("make");
    rig.wait(0.01);
    rig.platform.set_faults(blind);
    let began = rig.clock.now();
    while rig.events().is_empty() {
        rig.wait(0.1);
        assert!(rig.clock.now().since(began) < Duration::from_millis(4_500), "one question is enough");
    }
    assert_eq!(rig.events(), ["make.broken"]);
    rig.wait(60.0);
    rig.each_answered_once();
}

#[test]
fn a_safe_configuration_comes_before_the_rest_of_many() {
    let (rig, _) = rig(Manner::Slow(100), false);
    rig.submit("make");
    rig.wait(0.15);
    rig.submit("quiet");
    rig.wait(0.01);
    assert_eq!(rig.events(), ["quiet.ok"], "it does not wait for the end of `make`");
    rig.wait(0.19);
    let made = rig.progress.lock().unwrap().iter().filter(|told| told_of(told, "create")).count();
    assert_eq!(made, 2, "the third was not begun any more");
    rig.wait(10.0);
    rig.in_step();
    rig.each_answered_once();
}
