//! Safe configurations go first.

use crate::rig::*;
use davit::configurator::Requester;
use davit::model::{RunState, Value, Verdict};
use davit::platform::simulated::{Delays, Fault, StepPattern};
use std::time::Duration;

fn up() -> Rig {
    let rig = Rig::new(scenario());
    for word in ["make", "wire", "run"] {
        assert_eq!(rig.ask(word), [format!("{word}.ok")]);
    }
    rig
}

fn slow(pattern: &str, seconds: f64) -> Delays {
    Delays { of: vec![(StepPattern::new(pattern), Duration::from_secs_f64(seconds))], ..Delays::default() }
}

#[test]
fn a_safe_configuration_is_a_frame_like_others_when_nothing_is_under_way() {
    let rig = up();
    let before = rig.see();
    assert_eq!(rig.ask("quiet"), ["quiet.ok"]);
    assert!(rig.see().components.values().all(|c| c.state == RunState::Stopped));
    assert_eq!(rig.frames().last().unwrap(), "quiet");
    assert_eq!(rig.ask("quiet.undo"), ["quiet.undone"]);
    assert_eq!(rig.see(), before);
    rig.in_step();
}

#[test]
fn it_goes_before_what_is_under_way_and_does_not_wait_for_what_is_out() {
    let rig = up();
    rig.platform.set_delays(slow("property_set B.k", 0.8));
    rig.submit("switch");
    rig.wait(0.1);
    rig.submit("eight");
    let asked = rig.clock.now();
    rig.platform.record();
    rig.submit("quiet");
    rig.wait(0.05);
    assert_eq!(rig.events()[3..], ["eight.cancelled", "quiet.ok"], "answered before the slow step is back");
    assert!(rig.last().at.since(asked) < Duration::from_millis(20));
    let stopped: Vec<String> = rig.platform.record().iter().map(ToString::to_string).collect();
    assert_eq!(stopped, ["stop A", "stop C"], "B was stopped by what was interrupted");
    rig.wait(50.0);
    assert_eq!(rig.events()[3..], ["eight.cancelled", "quiet.ok", "switch.failed"], "what waited is not begun");
    let passed: Vec<String> = rig.platform.record().iter().map(ToString::to_string).collect();
    assert!(!passed.iter().any(|step| step.starts_with("start")), "nothing is started on the way back: {passed:?}");
    rig.platform.set_delays(Delays::default());
    let seen = rig.see();
    assert!(seen.components.values().all(|c| c.state == RunState::Stopped), "{seen:?}");
    let b = &seen.components[&name("B")];
    assert_eq!(b.properties[&ident("s")], Value::Float(0.0), "the rest is rolled back");
    assert!(!seen.ports.contains_key(&member("C.w")));
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn its_frame_undoes_to_the_system_before_both() {
    let rig = up();
    let before = rig.see();
    rig.platform.set_delays(slow("property_set B.k", 0.8));
    rig.submit("switch");
    rig.wait(0.1);
    rig.submit("quiet");
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.frames(), ["make", "wire", "run", "quiet"]);
    assert_eq!(rig.ask("quiet.undo"), ["quiet.undone"]);
    assert_eq!(rig.see(), before);
    rig.in_step();
}

#[test]
fn a_step_that_was_out_does_not_defeat_it() {
    // `start B` is out when everything is to stop: it lands afterwards and is stopped again.
    let rig = up();
    assert_eq!(rig.ask("quiet"), ["quiet.ok"]);
    rig.platform.set_delays(slow("start B", 0.8));
    rig.submit("run");
    rig.wait(0.1);
    rig.submit_as("quiet", coordinator("c2")).unwrap();
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert!(rig.see().components.values().all(|c| c.state == RunState::Stopped), "{:?}", rig.see());
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn it_is_applied_when_the_system_is_broken() {
    let rig = up();
    rig.inject("stop B", Fault::Hang { returns: None });
    assert_eq!(rig.ask("burnt"), ["burnt.failed"], "there is no such configuration");
    assert_eq!(rig.ask("switch"), ["switch.failed"], "a hung stop has not happened");
    assert_eq!(rig.ask("switch"), ["switch.failed"], "B is in quarantine");
    assert!(rig.last().findings()[0].message.contains("`B` is in quarantine"));
    assert_eq!(rig.ask("quiet"), ["quiet.broken"], "as far as it goes");
    let seen = rig.see();
    assert_eq!(seen.components[&name("A")].state, RunState::Stopped);
    assert_eq!(seen.components[&name("C")].state, RunState::Stopped);
    assert_eq!(rig.ask("eight"), ["eight.failed"], "while broken");
    assert_eq!(rig.ask_as("quiet", Requester::Operator).len(), 1, "again and again");
    assert_eq!(rig.last().verdict, Verdict::Broken);
    rig.each_answered_once();
}
