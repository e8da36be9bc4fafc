//! What a safe configuration has called stays while it is in force, whoever else called the same (semantics: *Safe configurations*).

use crate::rig::*;
use davit::configurator::{Batch, Request, Requester};
use davit::model::{Ask, Configuration, DeploymentLimits, OnFailure, RequestId};
use davit::platform::simulated::{Delays, Fault, SimulatedOptions, StepPattern};
use std::sync::Arc;
use std::time::Duration;

/// `open` is to the gate what braking is to a drive, and `close`, which undoes it, what releasing is.
fn configurations() -> Vec<Configuration> {
    let mut all = vec![
        configuration("make", "", "create A; create B; set A.k 3", "A:running"),
        configuration("hold", "", "call A.open", ""),
        configuration("still", "", "call A.open; set B.k 1", ""),
        configuration("ease", "", "call A.open", ""),
        configuration("gain", "", "set B.k 7", ""),
        configuration("more", "", "call A.open; set B.k 5", ""),
        configuration("twice", "", "call B.open", ""),
        configuration("keep", "", "call A.open; set B.k 5", ""),
    ];
    for configuration in &mut all {
        configuration.safe = ["hold", "still"].contains(&configuration.id.as_str());
        if configuration.id == id("keep") {
            configuration.on_failure = OnFailure::Hold;
        }
    }
    all
}

fn made() -> Rig {
    let rig = Rig::new(configurations());
    assert_eq!(rig.ask("make"), ["make.ok"]);
    rig.platform.record();
    rig
}

/// What was called since the last time.
fn called(rig: &Rig) -> Vec<String> {
    let steps = rig.platform.record().iter().map(ToString::to_string).collect::<Vec<_>>();
    steps.into_iter().filter(|step| step.contains("A.open") || step.contains("A.close")).collect()
}

const OPEN: &str = "operation_call A.open()";
const CLOSE: &str = "operation_call A.close()";

#[test]
fn of_two_frames_of_one_safe_configuration_only_the_last_takes_its_call_back() {
    let operator = Requester::Operator;
    for (first, second) in [(coordinator(COORDINATOR), operator), (operator, coordinator(COORDINATOR))] {
        let rig = made();
        assert_eq!(rig.ask_as("hold", first), ["hold.ok"]);
        assert_eq!(rig.ask_as("hold", second), ["hold.ok"]);
        assert_eq!(called(&rig), [OPEN, OPEN], "it is called again: that is wanted now");
        // In which order does not count.
        let undo = |number: u64, by| {
            let undo = Request::new(RequestId(number), Ask::UndoOf(id("hold")), by);
            rig.handle.submit(Batch::one(undo)).unwrap();
            rig.wait(1.0);
            assert_eq!(rig.events().last().unwrap(), "hold.undone");
        };
        undo(1001, first);
        assert_eq!((called(&rig), rig.frames().len()), (vec![], 2), "the other one is in force");
        assert_eq!(rig.ask_as("hold", first), ["hold.ok"]);
        undo(1002, first);
        assert_eq!((called(&rig), rig.frames().len()), (vec![OPEN.to_owned()], 2), "the other one is in force");
        undo(1003, second);
        assert_eq!(called(&rig), [CLOSE]);
        rig.in_step();
    }
}

/// Calls that stay share nothing; what else two frames call is undone in its order.
#[test]
fn what_is_called_beside_what_stays_keeps_its_order() {
    let mut all = configurations();
    all.push(Configuration { safe: true, ..configuration("both", "", "call A.open; call B.open", "") });
    let rig = Rig::new(all);
    rig.ask("make");
    assert_eq!(rig.ask_as("both", Requester::Operator), ["both.ok"]);
    // The call of B is not safe's alone: `twice` is above it, and shares that.
    assert_eq!(rig.ask("twice"), ["twice.ok"]);
    assert_eq!(rig.ask("hold"), ["hold.ok"]);
    assert_eq!(rig.ask_as("both.undo", Requester::Operator), ["both.undo.failed"]);
    assert_eq!(rig.ask("hold.undo"), ["hold.undone"]);
    assert_eq!(rig.ask("twice.undo"), ["twice.undone"]);
    assert_eq!(rig.ask_as("both.undo", Requester::Operator), ["both.undone"]);
    rig.in_step();
}

#[test]
fn the_undo_of_another_configuration_leaves_a_safe_ones_call() {
    let rig = made();
    assert_eq!(rig.ask("ease"), ["ease.ok"]);
    assert_eq!(rig.ask("ease.undo"), ["ease.undone"]);
    assert_eq!(called(&rig), [OPEN, CLOSE], "as ever, where nothing is safe");
    assert_eq!(rig.ask("hold"), ["hold.ok"]);
    assert_eq!(rig.ask_as("more", Requester::Operator), ["more.ok"]);
    assert_eq!(rig.ask_as("undo", Requester::Operator), ["undo.done"]);
    assert_eq!(called(&rig), [OPEN, OPEN]);
    // Nothing else keeps a call: what is not safe is a frame like others.
    assert_eq!(rig.ask("ease"), ["ease.ok"]);
    assert_eq!(rig.ask("ease.undo hold.undo"), ["ease.undone", "hold.undone"]);
    assert_eq!(called(&rig), [OPEN, CLOSE], "once, by the last one");
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn the_way_back_of_what_failed_leaves_a_safe_ones_call() {
    let rig = made();
    let before = rig.see();
    assert_eq!(rig.ask("hold"), ["hold.ok"]);
    rig.inject("property_set B.k", Fault::Fail);
    assert_eq!(rig.ask("more"), ["more.failed"]);
    assert_eq!(called(&rig), [OPEN, OPEN]);
    // What is left of what was held is without it, too: the safe one takes it back.
    rig.inject("property_set B.k", Fault::Fail);
    assert_eq!(rig.ask("keep"), ["keep.broken"]);
    assert_eq!(rig.ask("keep.undo"), ["keep.undone"]);
    assert_eq!(called(&rig), [OPEN]);
    assert_eq!(rig.ask("hold.undo"), ["hold.undone"]);
    assert_eq!(called(&rig), [CLOSE]);
    rig.inject("property_set B.k", Fault::Fail);
    assert_eq!(rig.ask("more"), ["more.failed"]);
    assert_eq!(called(&rig), [OPEN, CLOSE], "as ever, where nothing is safe");
    assert_eq!(rig.see(), before);
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn what_a_safe_configuration_interrupts_goes_back_without_its_call() {
    let slow = |pattern: &str| Delays {
        of: vec![(StepPattern::new(pattern), Duration::from_millis(500))],
        ..Delays::default()
    };
    for fails in [false, true] {
        let rig = made();
        rig.platform.set_delays(slow("property_set B.k"));
        rig.submit("more");
        rig.wait(0.2);
        assert_eq!(called(&rig), [OPEN], "it has called, and writes");
        if fails {
            rig.inject("operation_call", Fault::Fail);
        }
        rig.submit_as("hold", Requester::Operator).unwrap();
        rig.wait(50.0);
        rig.platform.set_delays(Delays::default());
        match fails {
            false => assert_eq!(rig.events()[1..], ["hold.ok", "more.failed"]),
            true => assert_eq!(rig.events()[1..], ["hold.broken", "more.failed"]),
        }
        // A call that failed keeps nothing.
        let calls = called(&rig);
        let back = calls.iter().filter(|call| *call == CLOSE).count();
        assert_eq!(back, usize::from(fails), "{calls:?}");
        assert_eq!(rig.ask_as("hold.undo", Requester::Operator), ["hold.undone"]);
        assert_eq!(called(&rig), vec![CLOSE; usize::from(!fails)]);
        rig.in_step();
        rig.each_answered_once();
    }
}

#[test]
fn a_squashed_frame_keeps_and_leaves_calls_as_its_parts() {
    let limits = DeploymentLimits { stack: 2, ..DeploymentLimits::default() };
    let rig = Rig::full(configurations(), SimulatedOptions::default(), |platform| Arc::new(platform), limits);
    assert_eq!(rig.ask("make"), ["make.ok"]);
    rig.platform.record();
    let operator = Requester::Operator;
    // The coordinator's below; of the operator's two a third makes one.
    assert_eq!(rig.ask("hold"), ["hold.ok"]);
    for word in ["ease", "still", "gain"] {
        assert_eq!(rig.ask_as(word, operator), [format!("{word}.ok")]);
    }
    assert_eq!(rig.frames().len(), 4);
    assert_eq!(called(&rig), [OPEN; 3]);
    for _ in 0..2 {
        assert_eq!(rig.ask_as("undo", operator), ["undo.done"]);
    }
    assert_eq!(rig.frames(), ["make", "hold"]);
    assert_eq!(called(&rig), [""; 0], "the coordinator's is in force");
    for word in ["ease", "still", "gain"] {
        assert_eq!(rig.ask_as(word, operator), [format!("{word}.ok")]);
    }
    // And the squashed one keeps it for others.
    assert_eq!(rig.ask_as("ease", coordinator("c2")), ["ease.ok"]);
    called(&rig);
    assert_eq!(rig.ask_as("ease.undo", coordinator("c2")), ["ease.undone"]);
    assert_eq!(called(&rig), [""; 0]);
    rig.in_step();
    rig.each_answered_once();
}

/// A safe configuration that replaces its group's frame does not let go first of what it has called too: for a moment nothing would
/// brake.
#[test]
fn replaced_by_a_safe_one_a_call_of_both_is_not_taken_back_before() {
    let mut all = configurations();
    for configuration in &mut all {
        if ["hold", "still", "ease"].contains(&configuration.id.as_str()) {
            configuration.group = Some(ident("stopped"));
        }
    }
    let rig = Rig::new(all);
    assert_eq!(rig.ask("make"), ["make.ok"]);
    let before = rig.see();
    rig.platform.record();
    for (next, calls) in [
        ("ease", [OPEN].as_slice()),
        ("hold", &[OPEN]),
        ("still", &[OPEN]),
        ("still", &[OPEN]),
        // What is not safe lets go of what it replaces, as ever.
        ("ease", &[CLOSE, OPEN]),
        ("hold", &[OPEN]),
    ] {
        assert_eq!(rig.ask(next), [format!("{next}.ok")]);
        assert_eq!(called(&rig), calls, "{next}");
    }
    assert_eq!(rig.frames().len(), 2);
    assert_eq!(rig.ask("hold.undo"), ["hold.undone"]);
    assert_eq!(called(&rig), [CLOSE], "once, by the last one");
    assert_eq!(rig.see(), before);
    rig.in_step();
    rig.each_answered_once();
}
