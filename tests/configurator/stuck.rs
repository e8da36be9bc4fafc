//! Calls that never return: how many threads they may hold, and that what is safe gets through all the same.

use crate::rig::*;
use davit::configurator::Progress;
use davit::limits;
use davit::model::*;
use davit::platform::simulated::{Simulated, SimulatedOptions};
use davit::platform::{Execution, Outcome, Platform};
use davit::time::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// A platform that never comes back from setting anything to 5.
struct Sticky {
    inner: Simulated,
    stuck: Arc<AtomicUsize>,
}

impl Platform for Sticky {
    leaves_to_inner!();

    fn execution(&self, step: &Step) -> Execution {
        self.inner.execution(step)
    }
    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        if matches!(step, Step::PropertySet { value: Value::Float(5.0), .. }) {
            self.stuck.fetch_add(1, Ordering::SeqCst);
            self.inner.clock().hang();
        }
        Platform::execute(&self.inner, step, deadline)
    }
}

#[test]
fn calls_that_never_return_are_bounded_and_what_is_safe_gets_through() {
    let calm = |name: &str, value: u8| Configuration {
        safe: true,
        ..configuration(name, "", &format!("set E.k {value}; write E.u {value}"), "")
    };
    let all = vec![
        configuration("make", "", "create A; create B; create C; create D; create E", "_default:stopped"),
        configuration("four", "", "set A.k 5; set B.k 5; set C.k 5; set D.k 5", ""),
        configuration("one", "", "set A.k 5", ""),
        calm("calm", 1),
        calm("still", 2),
    ];
    let stuck = Arc::new(AtomicUsize::new(0));
    let count = stuck.clone();
    let options = SimulatedOptions { blocking: true, ..SimulatedOptions::default() };
    let rig = Rig::with(all, options, move |inner| Arc::new(Sticky { inner, stuck }));
    assert_eq!(rig.ask("make"), ["make.ok"]);
    // All workers are out, and none of them was given up yet.
    rig.submit("four");
    rig.wait(0.01);
    assert_eq!(count.load(Ordering::SeqCst), 4);
    let asked = rig.clock.now();
    rig.submit_as("calm", coordinator("c2")).unwrap();
    rig.wait(20.0);
    let answers = rig.answers.lock().unwrap().clone();
    let calmed = answers.iter().find(|answer| answer.event().to_string() == "calm.ok").expect("it is applied");
    assert!(calmed.at.since(asked) < Duration::from_millis(100), "{:?}", calmed.at.since(asked));

    for _ in 0..limits::WORKERS_GIVEN_UP + 6 {
        rig.submit("one");
        rig.wait(3.0);
    }
    assert_eq!(count.load(Ordering::SeqCst), limits::WORKERS_GIVEN_UP);
    let why = format!("{} calls have not returned: no further one is made", limits::WORKERS_GIVEN_UP);
    assert_eq!(rig.events().last().unwrap(), "one.failed");
    assert!(rig.last().findings()[0].message.contains(&why), "{:?}", rig.last());
    let told = rig.progress.lock().unwrap().clone();
    let told = told.iter().filter(|told| matches!(told, Progress::Stuck(text) if *text == why)).count();
    assert_eq!(told, 1, "once");
    assert_eq!(rig.ask_as("still", coordinator("c2")), ["still.ok"]);
    assert_eq!(rig.see().components[&name("E")].properties[&ident("k")], Value::Float(2.0));
    rig.each_answered_once();
}
