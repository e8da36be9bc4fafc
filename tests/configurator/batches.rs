//! What was found where a running configurator and `check` told different stories: requests of one batch, given up or
//! stopped at any moment.

use crate::rig::*;
use davit::model::Configuration;
use davit::platform::simulated::{Delays, Fault, SimulatedOptions};
use std::time::Duration;

/// `on` makes A, `off` makes B, `low` and `high` are of one group, `calm` is safe. Every step takes a second.
fn slow() -> Rig {
    let group = |name: &str, changes: &str| Configuration {
        group: Some(ident("gain")),
        ..configuration(name, "", changes, "")
    };
    let configurations = vec![
        configuration("on", "", "create A", "A:stopped"),
        configuration("off", "", "create B", ""),
        configuration("wrong", "", "set Z.k 2", ""),
        group("low", "set A.k 1"),
        group("high", "set A.k 2"),
        Configuration { safe: true, ..configuration("calm", "", "set A.k 0", "") },
        Configuration { safe: true, ..configuration("rest", "", "set A.k 0", "") },
    ];
    let delays = Delays { base: Duration::from_secs(1), ..Delays::default() };
    Rig::with(configurations, SimulatedOptions { delays, ..SimulatedOptions::default() }, |platform| {
        std::sync::Arc::new(platform)
    })
}

fn made() -> Rig {
    let rig = slow();
    assert_eq!(rig.ask("on"), ["on.ok"]);
    rig
}

/// Both undos of one step are answered, whichever of them gives it up.
#[test]
fn what_is_given_up_twice_answers_both() {
    for (batch, behind) in [("on", false), ("off on", true)] {
        let rig = slow();
        rig.submit(batch);
        rig.wait(0.5);
        let answers = rig.ask("on.undo on.undo");
        assert_eq!(answers.iter().filter(|answer| *answer == "on.undone").count(), 2, "{behind}: {answers:?}");
        rig.each_answered_once();
    }
}

/// The undo of a step stands when the push of the same step is given up, however far the steps of either are.
#[test]
fn a_push_that_is_given_up_leaves_the_undo_of_its_batch_in_force() {
    for after in [0.5, 1.5, 2.5] {
        let rig = made();
        rig.submit("on.undo off");
        rig.wait(after);
        let answers = rig.ask("off.undo");
        assert_eq!(answers, ["on.undone", "off.cancelled", "off.undone"], "after {after} s");
        assert!(rig.see().is_empty(), "after {after} s: {:?}", rig.see());
        assert!(rig.frames().is_empty());
        rig.in_step();
    }
}

/// One before it fails: what was given up is not to blame, and is cancelled.
#[test]
fn what_is_given_up_is_not_blamed_for_what_failed_before_it() {
    let rig = made();
    rig.inject("cleanup A", Fault::Fail);
    rig.submit("on.undo off");
    rig.wait(0.5);
    let answers = rig.ask("off.undo");
    assert_eq!(answers, ["on.undo.failed", "off.cancelled", "off.undone"]);
    let failed = rig.answers.lock().unwrap().iter().find(|a| a.event().as_str() == "on.undo.failed").cloned().unwrap();
    let reason = failed.reason.unwrap().to_string();
    assert!(reason.contains("a failure was injected"), "{reason}");
    assert_eq!(rig.frames(), ["on"]);
    rig.in_step();
}

/// Two configurations of one group in one batch: the later takes the place of the earlier.
#[test]
fn a_batch_leaves_one_frame_of_a_group() {
    let rig = made();
    assert_eq!(rig.ask("wrong.undo low high low"), ["wrong.undone", "low.ok", "high.ok", "low.ok"]);
    assert_eq!(rig.frames(), ["on", "low"]);
    rig.in_step();
}

/// What was found to have nothing to do, since an undo before it would have done it, is looked at again when that fails.
#[test]
fn what_stands_behind_an_undo_that_fails_is_taken_up_anew() {
    let rig = made();
    assert_eq!(rig.ask("low"), ["low.ok"]);
    rig.inject("property_set A.k", Fault::Fail);
    assert_eq!(rig.ask("low.undo low.undo off"), ["low.undo.failed", "low.undone", "off.ok"]);
    assert_eq!(rig.frames(), ["on", "off"], "the second undo found the frame that the first one left");
}

/// Safe configurations asked for one after the other are answered, and lie, in that order.
#[test]
fn safe_configurations_of_one_moment_keep_their_order() {
    let rig = made();
    assert_eq!(rig.ask("calm rest"), ["calm.ok", "rest.ok"]);
    assert_eq!(rig.frames(), ["on", "calm", "rest"]);
}

/// What was refused behind in its batch, and is given up by its own undo, is answered once.
#[test]
fn what_was_refused_in_its_batch_is_given_up_once() {
    let rig = made();
    rig.submit("on.undo wrong off");
    rig.wait(0.5);
    let answers = rig.ask("wrong.undo");
    assert_eq!(answers, ["wrong.cancelled", "wrong.undone", "on.undone", "off.ok"]);
    rig.each_answered_once();
}

/// A state that is left takes back what it had asked for itself, not the same of somebody else in its batch.
#[test]
fn an_undo_gives_up_the_newest_that_is_meant() {
    let rig = made();
    rig.submit("off.undo low low");
    rig.wait(0.5);
    let given_up = rig.ask("low.undo");
    let cancelled: Vec<&String> = given_up.iter().filter(|answer| *answer == "low.cancelled").collect();
    assert_eq!(cancelled.len(), 1, "{given_up:?}");
    assert_eq!(rig.frames(), ["on", "low"], "the earlier one stands");
}
