//! How a safe configuration ends: as it is wanted, whoever did it and whatever was answered; else it is told what was not
//! done, and its frame has what was.

use crate::rig::*;
use davit::model::{RunState, Value};
use davit::platform::simulated::{Delays, Fault, FaultRule, Faults, StepPattern};
use std::time::Duration;

/// `A` running with a gain, and `B`; two safe configurations about both.
fn up() -> Rig {
    let mut all = vec![
        configuration("make", "", "create A; create B; set A.k 3", "A:running"),
        configuration("aside", "", "set B.s 7", ""),
        configuration("halt", "", "", "A:stopped"),
        configuration("low", "", "set A.k 1", ""),
        configuration("calm", "", "set B.k 9", "A:stopped"),
        configuration("all", "", "set A.k 1; set B.k 9", "A:stopped"),
    ];
    for configuration in &mut all {
        configuration.safe = ["low", "calm", "all"].contains(&configuration.id.as_str());
    }
    let rig = Rig::new(all);
    assert_eq!(rig.ask("make"), ["make.ok"]);
    rig
}

fn takes(times: &[(&str, f64)]) -> Delays {
    let of = |(step, seconds): &(&str, f64)| (StepPattern::new(step), Duration::from_secs_f64(*seconds));
    Delays { of: times.iter().map(of).collect(), ..Delays::default() }
}

fn fails(rig: &Rig, steps: &[&str]) {
    rig.platform.set_faults(Faults::new(steps.iter().map(|step| FaultRule::on(step, Fault::Fail).times(1))));
}

/// The gains of both, and whether `A` runs.
fn seen(rig: &Rig) -> (f64, f64, bool) {
    let seen = rig.see();
    let gain = |of: &str| match seen.components[&name(of)].properties[&ident("k")] {
        Value::Float(gain) => gain,
        ref other => panic!("{other}"),
    };
    (gain("A"), gain("B"), seen.components[&name("A")].state == RunState::Running)
}

fn is_partial(rig: &Rig) -> bool {
    rig.view().stack.last().expect("its frame").partial
}

#[test]
fn what_was_done_though_the_platform_says_no_is_as_wanted() {
    let rig = up();
    rig.inject("property_set A.k", Fault::FalseNotDone);
    assert_eq!(rig.ask("low"), ["low.ok"]);
    assert!(!is_partial(&rig) && rig.view().broken.is_none());
    assert_eq!(seen(&rig), (1.0, 0.0, true));
    assert_eq!(rig.ask("low.undo"), ["low.undone"]);
    assert_eq!(seen(&rig), (3.0, 0.0, true));
    rig.in_step();
}

#[test]
fn what_another_one_has_done_meanwhile_is_as_wanted() {
    let rig = up();
    // `stop A` of what is interrupted lands before its own begins.
    rig.platform.set_delays(takes(&[("stop A", 0.5), ("property_set B.k", 0.8)]));
    rig.submit("halt");
    rig.wait(0.1);
    rig.submit_as("calm", coordinator("c2")).unwrap();
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.events()[1..], ["calm.ok", "halt.failed"], "{:?}", rig.last());
    assert!(!is_partial(&rig) && rig.view().broken.is_none());
    assert_eq!(seen(&rig), (3.0, 9.0, false));
    assert_eq!(rig.ask_as("calm.undo", coordinator("c2")), ["calm.undone"]);
    assert_eq!(seen(&rig), (3.0, 0.0, true), "as before both");
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn all_that_was_not_done_is_told_and_the_frame_has_the_rest() {
    let rig = up();
    fails(&rig, &["property_set A.k", "stop A"]);
    assert_eq!(rig.ask("all"), ["all.broken"]);
    let told: Vec<String> = rig.last().findings().iter().map(|finding| finding.message.clone()).collect();
    for what in ["done and not taken back: `property_set B.k = 9.0`", "`property_set A.k = 1.0`: ", "`stop A`: "] {
        assert!(told.iter().any(|told| told.contains(what)), "{what}: {told:?}");
    }
    assert!(is_partial(&rig));
    assert_eq!(seen(&rig), (3.0, 9.0, true));
    assert_eq!(rig.ask("all.undo"), ["all.undone"]);
    assert_eq!(seen(&rig), (3.0, 0.0, true));
    assert!(rig.view().broken.is_none());
    rig.in_step();
}

#[test]
fn the_frame_has_only_what_was_done_also_where_something_was_interrupted() {
    let rig = up();
    rig.platform.set_delays(takes(&[("property_set B.s", 0.5)]));
    rig.submit("aside");
    rig.wait(0.1);
    fails(&rig, &["stop A", "property_set A.k"]);
    rig.submit_as("all", coordinator("c2")).unwrap();
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.events()[1..], ["all.broken", "aside.failed"]);
    assert!(is_partial(&rig));
    assert_eq!(seen(&rig), (3.0, 9.0, true));
    assert_eq!(rig.ask_as("all.undo", coordinator("c2")), ["all.undone"], "{:?}", rig.last());
    assert_eq!(seen(&rig), (3.0, 0.0, true));
    rig.in_step();
    rig.each_answered_once();
}
