//! The slow look at components that nothing is under way with: a false *done* and a stranger's doing are found.

use super::rig::*;
use davit::configurator::{Progress, Recovery};
use davit::model::*;
use davit::platform::simulated::{Fault, Simulated, SimulatedOptions};
use davit::platform::{EventSink, ObserveError, Platform};
use davit::time::Time;
use std::sync::Arc;
use std::time::Duration;

fn set(property: &str, value: f64) -> Step {
    Step::PropertySet { property: member(property), value: Value::Float(value) }
}

fn lost(rig: &Rig) -> Vec<String> {
    let progress = rig.progress.lock().unwrap();
    let word = |told: &Progress| match told {
        Progress::Lost { configuration, .. } => Some(configuration.to_string()),
        _ => None,
    };
    progress.iter().filter_map(word).collect()
}

fn up() -> Rig {
    let rig = Rig::new(scenario());
    assert_eq!(rig.ask("make"), ["make.ok"]);
    assert_eq!(rig.ask("wire"), ["wire.ok"]);
    assert_eq!(rig.ask("run"), ["run.ok"]);
    rig
}

#[test]
fn what_a_stranger_changes_is_found_and_the_newest_who_wrote_it_is_lost() {
    let rig = up();
    assert_eq!(rig.ask("eight"), ["eight.ok"]);
    assert!(rig.view().broken.is_none() && lost(&rig).is_empty());
    assert!(rig.platform.tamper(&set("A.k", 99.0)));
    rig.wait(12.0);
    // `wire` wrote it too, but longer ago.
    assert_eq!(lost(&rig), ["eight"]);
    let view = rig.view();
    let residual = view.broken.as_ref().expect("it is broken");
    assert_eq!(residual.difference, [set("A.k", 99.0)]);
    let marked: Vec<_> = view.stack.iter().filter(|frame| frame.lost).map(|frame| frame.configuration).collect();
    assert_eq!(marked, [id("eight")]);
    let drift = rig.handle.drift(rig.clock.now() + Duration::from_secs(5)).unwrap();
    assert_eq!(drift.steps, [set("A.k", 99.0)]);
    // Who names A is refused, everything else goes on; it is told once.
    assert_eq!(rig.ask("five"), ["five.failed"]);
    assert_eq!(rig.ask("rewire"), ["rewire.failed"], "A is named there too");
    rig.wait(20.0);
    assert_eq!(lost(&rig), ["eight"]);
    let deadline = rig.clock.now() + Duration::from_secs(5);
    assert_eq!(rig.handle.recover(Recovery::Back, deadline), Some(Ok(true)));
    assert_eq!(rig.see().components[&name("A")].properties[&ident("k")], Value::Float(8.0));
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn a_false_done_is_found() {
    let rig = up();
    rig.inject("property_set B.k", Fault::FalseDone);
    rig.submit("eight");
    rig.wait(1.0);
    assert_eq!(rig.events().last().unwrap(), "eight.ok");
    assert!(rig.view().broken.is_none(), "nobody knows yet");
    rig.wait(6.0);
    assert_eq!(lost(&rig), ["eight"]);
    assert_eq!(rig.view().broken.as_ref().unwrap().difference, [set("B.k", 0.0)]);
    // Its own undo repairs it and takes it back.
    assert_eq!(rig.ask("eight.undo"), ["eight.undone"]);
    assert!(rig.view().broken.is_none());
    rig.in_step();
}

#[test]
fn a_component_that_is_gone_is_lost_for_who_made_or_used_it_last() {
    let rig = up();
    for step in [
        Step::Disconnect { from: member("B.y"), to: member("C.u") },
        Step::State { component: name("C"), transition: Transition::Stop },
    ] {
        assert!(rig.platform.tamper(&step));
    }
    rig.wait(12.0);
    let mut told = lost(&rig);
    told.sort_unstable();
    assert_eq!(told, ["run", "wire"]);
    assert_eq!(rig.view().residuals.len(), 1);
}

#[test]
fn what_is_under_way_is_left_alone_and_nothing_is_delayed() {
    let rig = up();
    // A call that takes its time: meanwhile its components are in flux and not looked at.
    let delays = davit::platform::simulated::Delays {
        of: vec![(davit::platform::simulated::StepPattern::new("property_set A.k"), Duration::from_millis(900))],
        ..Default::default()
    };
    rig.platform.set_delays(delays);
    let asked = rig.clock.now();
    for _ in 0..30 {
        rig.submit("eight");
        rig.wait(0.95);
        rig.submit("eight.undo");
        rig.wait(0.95);
    }
    // Steps that have happened and of which nobody has heard yet.
    rig.platform.set_delays(Default::default());
    for _ in 0..12 {
        rig.inject("property_set B.k", Fault::LostAnswer);
        rig.submit("eight");
        rig.wait(1.3);
        assert_eq!(rig.events().last().unwrap(), "eight.ok");
        rig.submit("eight.undo");
        rig.wait(0.4);
    }
    assert!(lost(&rig).is_empty() && rig.view().broken.is_none(), "{:?}", lost(&rig));
    let answers = rig.answers.lock().unwrap();
    // A lost answer is waited for.
    let late = answers.iter().filter(|a| a.at > asked && a.took > Duration::from_millis(1001));
    let late: Vec<_> = late.collect();
    assert!(late.is_empty(), "{late:?}");
}

/// A platform that takes its time to look, and tells what was there when it began.
struct SlowEyes {
    inner: Simulated,
}

impl Platform for SlowEyes {
    fn catalogue(&self) -> &Catalogue {
        self.inner.catalogue()
    }
    fn execution(&self, step: &Step) -> Execution {
        self.inner.execution(step)
    }
    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        self.inner.execute(step, deadline)
    }
    fn cancel(&self, step: &Step) {
        self.inner.cancel(step);
    }
    fn observe(&self, deadline: Time) -> Result<Snapshot, ObserveError> {
        self.inner.observe(deadline)
    }
    fn observe_component(&self, name: ComponentName, until: Time) -> Result<Option<ComponentSnapshot>, ObserveError> {
        self.inner.observe_component(name, until)
    }
    fn observe_some(&self, components: &[ComponentName], deadline: Time) -> Result<Snapshot, ObserveError> {
        let seen = self.inner.observe_some(components, deadline);
        self.inner.clock().sleep(Duration::from_millis(500));
        seen
    }
    fn subscribe(&self, sink: EventSink) {
        self.inner.subscribe(sink);
    }
    fn quarantined(&self) -> Vec<ComponentName> {
        self.inner.quarantined()
    }
}

#[test]
fn what_was_done_while_the_platform_looked_is_no_difference() {
    let rig = Rig::with(scenario(), SimulatedOptions::default(), |inner| Arc::new(SlowEyes { inner }));
    for word in ["make", "wire", "run"] {
        assert_eq!(rig.ask(word), [format!("{word}.ok")]);
    }
    for _ in 0..40 {
        rig.submit("rewire eight");
        rig.wait(0.35);
        rig.submit("eight.undo rewire.undo");
        rig.wait(0.35);
    }
    assert!(rig.answers.lock().unwrap().iter().all(|answer| answer.verdict.is_success()));
    assert!(lost(&rig).is_empty() && rig.view().broken.is_none(), "{:?}", lost(&rig));
}

#[test]
fn a_fault_nobody_reported_is_a_fault_and_no_difference() {
    let rig = up();
    // The report is made and lost: whoever hears the platform is another one for a moment.
    rig.platform_deaf(|platform| assert!(platform.fault(name("B"), "it burns")));
    assert_eq!(rig.view().system.as_ref().unwrap().components[&name("B")].state, RunState::Running);
    rig.wait(12.0);
    assert_eq!(rig.view().system.as_ref().unwrap().components[&name("B")].state, RunState::Faulted);
    assert!(rig.view().broken.is_none() && lost(&rig).is_empty());
}
