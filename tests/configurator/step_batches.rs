//! Several steps in one call of the platform, in any manner a platform may carry them out.

use crate::rig::*;
use davit::configurator::{Progress, progress::StepEnd};
use davit::model::*;
use davit::platform::simulated::{Faults, Simulated, SimulatedOptions};
use davit::platform::{Execution, Outcome, Platform, StepBatch};
use davit::time::Time;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Manner {
    /// One after the other, as a platform does by itself.
    All,
    /// The first of them.
    One,
    /// One after the other, each in so many milliseconds.
    Slow(u64),
    /// All that may begin are taken at once, as if sent far away; each takes so many milliseconds there.
    Far(u64),
    /// Says nothing at all, once.
    Silent,
    /// Panics once, when the second of them has happened.
    Panics,
    /// Does not come back for half a minute, once, before the second of them happens; then it does not.
    Lost,
    /// The same, when it has happened.
    Gone,
}

/// Creating and destroying go in batches here, far away everything does; the calls that carry several out are counted.
struct Hasty {
    inner: Simulated,
    manner: Manner,
    calls: Arc<AtomicUsize>,
    /// What was given up before it had begun far away.
    given_up: Mutex<Vec<Step>>,
}

impl Hasty {
    fn far(&self, batch: &StepBatch, each: Duration) {
        for timed in batch.begin(usize::MAX) {
            let given_up = std::mem::take(&mut *self.given_up.lock().unwrap());
            if given_up.contains(&timed.step) {
                return batch.answer(Outcome::NotDone(Cause::Cancelled));
            }
            self.inner.clock().sleep(each);
            let outcome = Platform::execute(&self.inner, &timed.step, batch.deadline());
            let done = matches!(outcome, Outcome::Done(_));
            batch.answer(outcome);
            if !done {
                return;
            }
        }
    }

    /// The first is done, and something comes up in the second.
    fn second(&self, batch: &StepBatch, happens: bool, then: impl FnOnce()) {
        let step = |at: usize| Platform::execute(&self.inner, &batch.steps()[at].step, batch.deadline());
        if batch.begin(1).len() == 1 {
            batch.answer(step(0));
        }
        if batch.begin(1).len() == 1 && happens {
            step(1);
        }
        then();
    }
}

impl Platform for Hasty {
    leaves_to_inner!(all but cancel);

    fn execution(&self, step: &Step) -> Execution {
        match step {
            Step::Create { .. } | Step::Destroy { .. } => Execution::Blocking,
            _ => self.inner.execution(step),
        }
    }
    fn batches(&self, step: &Step) -> bool {
        matches!(self.manner, Manner::Far(_)) || matches!(step, Step::Create { .. } | Step::Destroy { .. })
    }
    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        Platform::execute(&self.inner, step, deadline)
    }
    fn cancel(&self, step: &Step) {
        self.given_up.lock().unwrap().push(step.clone());
        self.inner.cancel(step);
    }
    fn execute_batch(&self, batch: &StepBatch) {
        if batch.steps().len() == 1 {
            return batch.one_by_one(|step, deadline| Platform::execute(&self.inner, step, deadline));
        }
        let first = self.calls.fetch_add(1, Ordering::SeqCst) == 0;
        let clock = self.inner.clock();
        match self.manner {
            Manner::One => {
                if let [timed] = batch.begin(1) {
                    batch.answer(Platform::execute(&self.inner, &timed.step, batch.deadline()));
                }
            }
            Manner::Slow(ms) => batch.one_by_one(|step, deadline| {
                clock.sleep(Duration::from_millis(ms));
                Platform::execute(&self.inner, step, deadline)
            }),
            Manner::Far(ms) => self.far(batch, Duration::from_millis(ms)),
            Manner::Silent if first => {}
            Manner::Panics if first => self.second(batch, true, || panic!("a defect of the platform")),
            Manner::Lost | Manner::Gone if first => {
                self.second(batch, self.manner == Manner::Gone, || clock.sleep(Duration::from_secs(30)));
            }
            _ => batch.one_by_one(|step, deadline| Platform::execute(&self.inner, step, deadline)),
        }
    }
}

fn rig(manner: Manner, blocking: bool) -> (Rig, Arc<AtomicUsize>) {
    let calls = Arc::new(AtomicUsize::new(0));
    let counted = calls.clone();
    let options = SimulatedOptions { blocking, ..SimulatedOptions::default() };
    (
        Rig::with(scenario(), options, move |inner| {
            Arc::new(Hasty { inner, manner, calls: counted, given_up: Mutex::default() })
        }),
        calls,
    )
}

/// Whether it tells that a step of that name was done.
fn told_of(told: &Progress, verb: &str) -> bool {
    matches!(told, Progress::Ended { step, end: StepEnd::Done, undoing: false, .. } if step.verb == verb)
}

#[test]
fn every_manner_leads_to_the_same() {
    for blocking in [false, true] {
        for manner in [Manner::All, Manner::One, Manner::Slow(20), Manner::Far(20)] {
            let (rig, calls) = rig(manner, blocking);
            for word in ["make", "wire", "run", "replace"] {
                assert_eq!(rig.ask(word), [format!("{word}.ok")], "{manner:?}");
                rig.in_step();
            }
            // `replace` destroys B and creates it again: never together, since one needs the other.
            let several = calls.load(Ordering::SeqCst);
            match manner {
                Manner::One => assert_eq!(several, 2, "blocking: {blocking}"),
                Manner::Far(_) if blocking => assert!((2..8).contains(&several), "{several}"),
                _ => assert_eq!(several, 1, "{manner:?}, blocking: {blocking}"),
            }
            for _ in 0..4 {
                assert_eq!(rig.ask("undo"), ["undo.done"], "{manner:?}");
                rig.in_step();
            }
            assert!(rig.see().is_empty());
            rig.each_answered_once();
        }
    }
}

/// The way back takes its time: the steps of a batch are not late because those that they take back were.
#[test]
fn what_was_too_slow_is_taken_back() {
    let calls = Arc::new(AtomicUsize::new(0));
    let counted = calls.clone();
    let mut all = scenario();
    all.iter_mut().filter(|c| c.id == id("make")).for_each(|c| c.timeout = Some(Duration::from_millis(250)));
    let hasty = |inner| Hasty { inner, manner: Manner::Slow(100), calls: counted, given_up: Mutex::default() };
    let wrap = move |inner| Arc::new(hasty(inner)) as Arc<dyn Platform>;
    let rig = Rig::with(all, SimulatedOptions { blocking: true, ..SimulatedOptions::default() }, wrap);
    assert_eq!(rig.ask("make"), ["make.failed"]);
    assert!(rig.see().is_empty());
    rig.each_answered_once();
    rig.in_step();
}

#[test]
fn a_platform_that_breaks_its_word_is_read_back() {
    for manner in [Manner::Silent, Manner::Panics, Manner::Lost, Manner::Gone] {
        let (rig, _) = rig(manner, false);
        if matches!(manner, Manner::Silent | Manner::Lost) {
            assert_eq!(rig.ask("make"), ["make.failed"], "{manner:?}");
            assert!(rig.see().is_empty(), "{manner:?}: what was done is taken back");
        }
        assert_eq!(rig.ask("make"), ["make.ok"], "{manner:?}: what has happened unseen is seen");
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
    for manner in [Manner::Slow(100), Manner::Far(100)] {
        let (rig, _) = rig(manner, false);
        rig.submit("make");
        rig.wait(0.15);
        rig.submit("quiet");
        rig.wait(0.01);
        assert_eq!(rig.events(), ["quiet.ok"], "{manner:?}: it does not wait for the end of `make`");
        rig.wait(0.19);
        assert_eq!(told_done(&rig, "create"), 2, "{manner:?}: the third was not begun any more");
        rig.wait(10.0);
        rig.in_step();
        rig.each_answered_once();
    }
}

/// How many steps of that name were told to be done.
fn told_done(rig: &Rig, verb: &str) -> usize {
    rig.progress.lock().unwrap().iter().filter(|told| told_of(told, verb)).count()
}

#[test]
fn answers_are_told_as_they_come() {
    for manner in [Manner::Slow(100), Manner::Far(100)] {
        let (rig, calls) = rig(manner, false);
        rig.submit("make");
        rig.wait(0.05);
        for done in 0..3 {
            assert_eq!(told_done(&rig, "create"), done, "{manner:?}");
            rig.wait(0.1);
        }
        assert_eq!(rig.events(), ["make.ok"], "{manner:?}");
        assert_eq!(calls.load(Ordering::SeqCst), 1, "{manner:?}");
    }
}

/// Of a batch only the step that hangs is unknown: what comes before it is done, and what comes behind it has not begun.
#[test]
fn only_the_one_that_hangs_is_unknown() {
    let (rig, _) = rig(Manner::Lost, false);
    rig.submit("make");
    rig.wait(0.5);
    assert_eq!(told_done(&rig, "create"), 1, "it is told while the second hangs");
    rig.wait(20.0);
    assert_eq!(rig.events(), ["make.failed"]);
    let told = rig.progress.lock().unwrap().clone();
    let ends = told.iter().filter_map(|told| match told {
        Progress::Ended { step, end, undoing: false, .. } if step.verb == "create" => Some(*end),
        _ => None,
    });
    let ends: Vec<StepEnd> = ends.collect();
    assert!(matches!(ends[..], [StepEnd::Done, StepEnd::Unknown]), "{ends:?}");
    assert!(rig.see().is_empty(), "the first is taken back");
    rig.wait(60.0);
    rig.each_answered_once();
}

/// What was sent far away and has not begun there is given up, and comes to nothing.
#[test]
fn what_was_sent_and_has_not_begun_is_given_up() {
    for manner in [Manner::Slow(100), Manner::Far(100)] {
        let (rig, _) = rig(manner, false);
        rig.submit("make");
        rig.wait(0.15);
        rig.submit("make.undo");
        rig.wait(10.0);
        assert_eq!(told_done(&rig, "create"), 2, "{manner:?}: the third does not begin");
        assert!(rig.see().is_empty(), "{manner:?}");
        rig.in_step();
        rig.each_answered_once();
    }
}

/// Far away every step but operations goes with others: three components are made, connected and started in few messages.
#[test]
fn a_platform_far_away_is_sent_few_messages() {
    let (rig, calls) = rig(Manner::Far(1), true);
    for word in ["make", "wire", "run"] {
        assert_eq!(rig.ask(word), [format!("{word}.ok")]);
    }
    // To create, to configure; to connect and write; to start what may begin together.
    assert!(calls.load(Ordering::SeqCst) <= 5, "{calls:?}");
    assert_eq!(rig.ask("switch"), ["switch.ok"]);
    rig.in_step();
    for _ in 0..4 {
        assert_eq!(rig.ask("undo"), ["undo.done"]);
    }
    assert!(rig.see().is_empty());
    rig.each_answered_once();
}
