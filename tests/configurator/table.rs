//! The table of requests, row by row.

use crate::rig::*;
use davit::configurator::{Reason, Requester};
use davit::model::{Configuration, Confirm, Step, Value, Verdict};
use davit::platform::simulated::Fault;
use std::time::Duration;

fn up() -> Rig {
    let rig = Rig::new(scenario());
    assert_eq!(rig.ask("make"), ["make.ok"]);
    assert_eq!(rig.ask("wire"), ["wire.ok"]);
    assert_eq!(rig.ask("run"), ["run.ok"]);
    rig.in_step();
    rig
}

#[test]
fn a_configuration_is_applied_and_undone() {
    let rig = up();
    let before = rig.see();
    assert_eq!(rig.ask("switch"), ["switch.ok"]);
    let seen = rig.see();
    assert_eq!(seen.components[&name("B")].properties[&ident("s")], Value::Float(2.0));
    assert_eq!(seen.ports[&member("C.w")], Value::Float(4.0));
    assert_eq!(rig.frames(), ["make", "wire", "run", "switch"]);
    assert_eq!(rig.ask("switch.undo"), ["switch.undone"]);
    assert_eq!(rig.see(), before);
    assert_eq!(rig.frames(), ["make", "wire", "run"]);
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn everything_is_undone_frame_by_frame() {
    let rig = up();
    for name in ["switch", "rewire", "eight"] {
        assert_eq!(rig.ask(name), [format!("{name}.ok")]);
    }
    for _ in 0..6 {
        assert_eq!(rig.ask("undo"), ["undo.done"]);
    }
    assert!(rig.see().is_empty());
    assert_eq!(rig.ask("undo"), ["undo.failed"], "nothing to undo");
    rig.each_answered_once();
}

#[test]
fn unknown_configurations_are_answered() {
    let rig = up();
    assert_eq!(rig.ask("swich"), ["swich.failed"]);
    assert!(matches!(rig.last().reason.as_deref(), Some(Reason::Unknown(_))));
    assert_eq!(rig.ask("swich.undo"), ["swich.undo.failed"]);
    rig.each_answered_once();
}

#[test]
fn a_refused_configuration_fails_with_every_finding_and_changes_nothing() {
    let rig = up();
    let before = rig.see();
    assert_eq!(rig.ask("bad"), ["bad.failed"]);
    let findings = rig.last().findings();
    assert!(!findings.is_empty() && findings[0].is_error(), "{findings:?}");
    assert_eq!(rig.see(), before);
}

#[test]
fn undo_of_what_has_no_frame_is_done() {
    let rig = up();
    assert_eq!(rig.ask("switch.undo"), ["switch.undone"]);
    rig.inject("property_set B.k", Fault::Fail);
    assert_eq!(rig.ask("switch"), ["switch.failed"]);
    assert_eq!(rig.ask("switch.undo"), ["switch.undone"], "also when it failed");
}

#[test]
fn a_coordinator_undoes_its_own_frames_and_an_operator_anyones() {
    let rig = up();
    let other = coordinator("c2");
    assert_eq!(rig.ask_as("switch", other), ["switch.ok"]);
    assert_eq!(rig.ask("switch.undo"), ["switch.undone"], "c1 has no frame of it");
    assert_eq!(rig.frames().last().unwrap(), "switch");
    assert_eq!(rig.ask_as("switch.undo", Requester::Operator), ["switch.undone"]);
    assert_eq!(rig.frames().last().unwrap(), "run");
}

#[test]
fn undo_to_pops_down_to_a_number_of_frames() {
    let rig = up();
    rig.ask("switch");
    rig.ask("rewire");
    assert_eq!(rig.ask_as("to=1", Requester::Operator), ["undo.done"]);
    assert_eq!(rig.frames(), ["make"]);
    assert_eq!(rig.ask_as("to=5", Requester::Operator), ["undo.failed"]);
    rig.in_step();
}

#[test]
fn commit_makes_the_operators_own_frames_permanent() {
    let mut burn = configuration("burn", "", "call B.burn", "");
    burn.irreversible = true;
    let rig = Rig::new(scenario().into_iter().chain([burn]).collect::<Vec<_>>());
    let operator = |word: &str| rig.ask_as(word, Requester::Operator);
    for word in ["make", "wire", "run"] {
        assert_eq!(operator(word), [format!("{word}.ok")]);
    }
    assert_eq!(operator("commit"), ["commit.ok"]);
    assert!(rig.frames().is_empty());
    assert_eq!(rig.ask("undo"), ["undo.failed"]);
    assert_eq!(operator("run.undo"), ["run.undo.failed"], "in force, and not to be undone by itself");
    assert_eq!(rig.ask("switch"), ["switch.ok"]);
    assert_eq!(operator("commit"), ["commit.failed"], "a coordinator's frame is in force");
    assert_eq!(rig.last().findings()[0].code, davit::model::codes::STACK_HELD);
    assert_eq!(rig.ask("undo"), ["undo.done"]);

    assert_eq!(rig.ask("switch"), ["switch.ok"]);
    for word in ["rewire", "burn"] {
        assert_eq!(operator(word), [format!("{word}.ok")]);
    }
    assert_eq!(operator("commit!"), ["commit.ok"]);
    assert_eq!(rig.frames(), ["switch", "burn"], "the coordinator's, and the floor that holds it back");
    assert_eq!(rig.ask("undo"), ["undo.failed"]);
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn a_frame_that_others_build_on_is_not_undone() {
    let rig = up();
    assert_eq!(rig.ask("make.undo"), ["make.undo.failed"]);
    assert!(matches!(rig.last().reason.as_deref(), Some(Reason::Refused(_))));
    rig.in_step();
}

#[test]
fn a_group_replaces_its_frame_and_never_passes_through_the_value_before_both() {
    let rig = up();
    assert_eq!(rig.ask("eight"), ["eight.ok"]);
    rig.platform.record();
    assert_eq!(rig.ask("five"), ["five.ok"]);
    let writes = rig.platform.record();
    let gains = |value: f64| {
        ["A.k", "B.k"].map(|p| Step::PropertySet { property: member(p), value: Value::Float(value) }).to_vec()
    };
    let mut sorted = writes.clone();
    sorted.sort_by_key(ToString::to_string);
    assert_eq!(sorted, gains(5.0), "two writes, straight to the new values");
    assert_eq!(rig.frames(), ["make", "wire", "run", "five"]);
    assert_eq!(rig.ask("undo"), ["undo.done"]);
    let seen = rig.see();
    assert_eq!(seen.components[&name("A")].properties[&ident("k")], Value::Float(1.0), "the value before both");
}

#[test]
fn an_undo_and_a_push_of_one_step_are_one_transaction() {
    let mut all = scenario();
    all.iter_mut().for_each(|c| c.group = None);
    let rig = Rig::new(all);
    for word in ["make", "wire", "eight"] {
        rig.ask(word);
    }
    rig.platform.record();
    assert_eq!(rig.ask("eight.undo five"), ["eight.undone", "five.ok"]);
    let passed: Vec<String> = rig.platform.record().iter().map(ToString::to_string).collect();
    assert_eq!(passed.len(), 2, "{passed:?}");
    assert!(passed.iter().all(|step| step.ends_with("= 5.0")), "{passed:?}");
    assert_eq!(rig.frames(), ["make", "wire", "five"]);
    rig.each_answered_once();
}

#[test]
fn a_failing_push_does_not_keep_the_old_configuration_in_force() {
    let mut all = scenario();
    all.iter_mut().for_each(|c| c.group = None);
    for (fault, planned) in [(true, "five"), (false, "bad")] {
        let rig = Rig::new(all.clone());
        for word in ["make", "wire", "eight"] {
            rig.ask(word);
        }
        if fault {
            rig.inject("property_set A.k = 5.0", Fault::Fail);
        }
        let mut events = rig.ask(&format!("eight.undo {planned}"));
        events.sort();
        let mut expected = vec!["eight.undone".to_owned(), format!("{planned}.failed")];
        expected.sort();
        assert_eq!(events, expected);
        assert_eq!(rig.frames(), ["make", "wire"]);
        assert_eq!(rig.see().components[&name("A")].properties[&ident("k")], Value::Float(1.0));
        rig.each_answered_once();
    }
}

#[test]
fn a_queued_request_is_cancelled_by_its_undo() {
    let rig = up();
    rig.inject("stop B", Fault::LostAnswer);
    rig.submit("switch");
    rig.wait(0.01);
    rig.submit("eight");
    rig.submit("eight.undo");
    rig.wait(100.0);
    let events = rig.events()[3..].to_vec();
    assert_eq!(events, ["eight.cancelled", "eight.undone", "switch.ok"]);
    assert_eq!(rig.frames().last().unwrap(), "switch");
    rig.each_answered_once();
}

#[test]
fn what_has_begun_is_given_up_by_its_undo() {
    let rig = up();
    rig.inject("stop B", Fault::LostAnswer);
    rig.submit("switch");
    rig.wait(0.01);
    rig.submit("switch.undo");
    rig.wait(100.0);
    assert_eq!(rig.events()[3..], ["switch.cancelled", "switch.undone"], "{:?}", rig.last());
    assert_eq!(rig.frames(), ["make", "wire", "run"]);
    rig.in_step();
}

#[test]
fn anothers_queued_request_is_not_cancelled() {
    let rig = up();
    rig.inject("stop B", Fault::LostAnswer);
    rig.submit("switch");
    rig.wait(0.01);
    rig.submit_as("eight", coordinator("c2")).unwrap();
    rig.submit("eight.undo");
    rig.wait(100.0);
    assert_eq!(rig.events()[3..], ["switch.ok", "eight.ok", "eight.undone"]);
    assert_eq!(rig.frames().last().unwrap(), "eight");
}

fn confirmed(within: u64) -> Vec<Configuration> {
    let mut all = scenario();
    for configuration in &mut all {
        if configuration.id == id("switch") {
            configuration.confirm = Some(Confirm { event: event("e_fine"), within: Duration::from_secs(within) });
        }
    }
    all
}

#[test]
fn without_its_confirmation_a_frame_is_popped() {
    let rig = Rig::new(confirmed(5));
    for word in ["make", "wire", "run"] {
        rig.ask(word);
    }
    let before = rig.see();
    assert_eq!(rig.ask("switch"), ["switch.ok", "switch.reverted"]);
    assert_eq!(rig.see(), before);
    assert_eq!(rig.frames(), ["make", "wire", "run"]);
    let answer = rig.last();
    assert_eq!((answer.verdict, answer.took < Duration::from_secs(1)), (Verdict::Reverted, true));
    rig.each_answered_once();
}

#[test]
fn with_its_confirmation_a_frame_stays() {
    let rig = Rig::new(confirmed(5));
    for word in ["make", "wire", "run"] {
        rig.ask(word);
    }
    rig.submit("switch");
    rig.wait(4.9);
    rig.platform.raise(name("B"), event("e_fine"));
    rig.wait(100.0);
    assert_eq!(rig.events()[3..], ["switch.ok"]);
    assert_eq!(rig.frames().last().unwrap(), "switch");
}

#[test]
fn a_full_queue_is_answered() {
    let rig = up();
    rig.inject("stop B", Fault::LostAnswer);
    rig.submit("switch");
    rig.wait(0.01);
    let mut refused = 0;
    for _ in 0..400 {
        if rig.submit_as("eight", coordinator("c1")).is_err() {
            refused += 1;
        }
    }
    assert!(refused >= 100, "{refused}");
    assert_eq!(rig.events().iter().filter(|e| *e == "eight.failed").count(), refused, "at once");
    assert!(rig.submit_as("quiet", coordinator("c1")).is_ok(), "a safe one gets in");
    // As where a state with a configuration of its own is left for one that is safe.
    assert!(rig.submit_as("eight.undo quiet", coordinator("c1")).is_err(), "not all of it gets in");
    rig.wait(100.0);
    assert_eq!(rig.events().iter().filter(|e| *e == "quiet.ok").count(), 2, "what is safe does");
    rig.each_answered_once();
}

#[test]
fn the_configurations_own_timeout_bounds_it() {
    use davit::platform::simulated::Delays;
    let mut all = scenario();
    all.iter_mut().filter(|c| c.id == id("switch")).for_each(|c| c.timeout = Some(Duration::from_millis(200)));
    let rig = Rig::new(all);
    for word in ["make", "wire", "run"] {
        rig.ask(word);
    }
    let before = rig.see();
    rig.platform.set_delays(Delays { base: Duration::from_millis(90), ..Delays::default() });
    let begun = rig.clock.now();
    rig.submit("switch");
    rig.wait(2.0);
    assert_eq!(rig.events()[3..], ["switch.failed"]);
    assert!(matches!(rig.last().reason.as_deref(), Some(Reason::Timeout(_) | Reason::Step { .. })), "{:?}", rig.last());
    assert!(rig.last().at.since(begun) < Duration::from_secs(2));
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.see(), before);
    rig.in_step();
}
