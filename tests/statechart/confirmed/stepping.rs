//! The step loop, `e_done` and the first entry (docs/rfsm.md §6, §7).

use super::doubted;
use crate::scripted::*;
use crate::support::*;
use davit::statechart::{Machine, MicrostepResult, Nobody, RunEnd, Sim};
use davit::time::Time;

fn entered_on_event() -> davit::statechart::Chart {
    compiled(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", "e_begin"), t("a", "b", "e")])
}

#[test]
fn a_failed_entry_loses_the_events_and_is_not_idle() {
    let chart = entered_on_event();
    let mut machine = Machine::new(&chart);
    let stepped = machine.step(&chart, Time(0), 1, &mut Nobody);
    assert_eq!((stepped.idle, stepped.ended), (false, RunEnd::NotEntered));
    assert!(machine.queue().events().is_empty() && machine.active().is_empty());
    let mut sim = Sim::new(&chart);
    let seen = line(&mut sim, "e");
    assert_eq!(
        serde_json::to_string(&seen).unwrap(),
        r#"{"active":[],"mode":null,"queue":[],"actions":[],"transition":false,"idle":false}"#
    );
    assert_eq!(seen.notes, ["failed to enter, no valid path from root.initial"]);
    assert_eq!(leaf_after(&mut sim, "run"), "", "run returns as well");
    assert_eq!(leaf_after(&mut sim, "e_begin"), "root.a");
}

#[test]
fn a_step_that_matches_nothing_does_not_count() {
    let chart = compiled(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), t("a", "b", "e")]);
    let mut sim = Sim::new(&chart);
    assert!(!line(&mut sim, "").idle, "the entry was the step");
    let seen = line(&mut sim, "nothing");
    assert!(seen.idle && !seen.transition, "it went on into an idle step");
    let seen = line(&mut sim, "e");
    assert!(!seen.idle && seen.transition, "a step that takes a transition returns false");
    assert_eq!(seen.queue, ["e_done@root.b"]);
}

#[test]
fn one_transition_a_step_and_the_rest_of_the_set_is_lost() {
    let chart = compiled(vec![
        s("a", vec![]),
        s("b", vec![]),
        s("d", vec![]),
        t("initial", "a", ""),
        t("a", "b", "e1"),
        t("b", "d", "e2"),
    ]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    assert_eq!(leaf_after(&mut sim, "e1 e2"), "root.b");
    assert_eq!(leaf_after(&mut sim, "run"), "root.b", "e2 was not kept");
}

#[test]
fn completion_is_never_raised_for_composites() {
    let parts = || {
        vec![
            s("a", vec![s("x", vec![]), t("initial", "x", "")]),
            s("b", vec![]),
            t("initial", "a", ""),
            t("a", "b", "e_done"),
        ]
    };
    let chart = compiled(parts());
    let mut sim = Sim::new(&chart);
    assert_eq!(leaf_after(&mut sim, "run"), "root.a.x");
    assert_eq!(leaf_after(&mut sim, "e_done@root.a"), "root.b", "from outside one must send the whole name");
    doubted(parts(), "chart::never_done");
}

#[test]
fn a_bare_completion_from_outside_is_no_completion() {
    let chart = compiled(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), t("a", "b", "e_done x")]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "");
    // What waits inside is e_done@root.a.
    assert_eq!(line(&mut sim, "").active, ["root", "root.b"]);
    let chart = compiled(vec![
        s("a", vec![s("x", vec![]), t("initial", "x", "")]),
        s("b", vec![]),
        t("initial", "a", ""),
        t("a", "b", "e_done"),
    ]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    assert_eq!(leaf_after(&mut sim, "e_done"), "root.a.x");
}

#[test]
fn what_waits_outside_is_merged_before_idle_is_told() {
    let model = root(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), t("a", "b", "e")]);
    let mut run = Run::of(&model, Scripted::default());
    run.run();
    let e = run.event("e");
    run.hook.outside = [vec![], vec![e]].into();
    assert!(!run.step(1), "the second look found an event: not idle, and kept for the next step");
    assert_eq!(run.leaf(), "root.a");
    assert_eq!(run.microstep(), MicrostepResult::Taken);
    assert_eq!(run.leaf(), "root.b");
}

#[test]
fn an_idle_hook_goes_on() {
    let model = root(vec![s("a", vec![]), t("initial", "a", "")]);
    let mut run = Run::of(&model, Scripted::default());
    run.hook.go_on = 4;
    assert!(run.run());
    assert_eq!(run.hook.sets.len(), 6, "entry, completion, idle, and three more");
}

#[test]
fn an_endless_run_is_ended() {
    let parts =
        || vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), t("a", "b", "e_done"), t("b", "a", "e_done")];
    let chart = compiled(parts());
    let mut machine = Machine::new(&chart);
    assert_eq!(machine.run(&chart, Time(0), &mut Nobody).ended, RunEnd::Endless);
    doubted(parts(), "chart::endless");
}

#[test]
fn the_event_of_the_first_entry_can_be_waited_for() {
    let chart = compiled(vec![s("a", vec![]), t("initial", "a", "e_init_fsm")]);
    let mut sim = Sim::new(&chart);
    assert_eq!(leaf_after(&mut sim, ""), "root.a");
}

#[test]
fn completion_from_a_connector_never_comes() {
    let parts = || {
        vec![
            s("a", vec![]),
            s("b", vec![]),
            c("k"),
            t("initial", "a", ""),
            t("a", "k", "e e_done"),
            t("k", "b", "e_done"),
        ]
    };
    let chart = compiled(parts());
    let mut sim = Sim::new(&chart);
    assert_eq!(leaf_after(&mut sim, "run"), "root.a");
    assert_eq!(leaf_after(&mut sim, "e e_done e_done@root.a"), "root.a");
    assert_eq!(leaf_after(&mut sim, "e e_done@root.k"), "root.b", "but it may be sent");
    doubted(parts(), "chart::never_done");
}

/// The whole queue is one set, in the order in which it was sent; the engine's own completion is a part of it.
#[test]
fn all_that_waits_is_one_set() {
    let chart = compiled(vec![
        s("a", vec![]),
        s("b", vec![]),
        c("k"),
        t("initial", "a", ""),
        t("a", "k", "e_done"),
        t("k", "b", "e"),
    ]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "");
    assert_eq!(leaf_after(&mut sim, "e"), "root.b", "the completion of `a` waited inside");
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    assert_eq!(leaf_after(&mut sim, "e"), "root.a", "and was gone after a step of its own");
}
