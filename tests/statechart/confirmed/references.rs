//! What the text of a source or target means, and what is said when it means nothing (docs/rfsm.md §3).

use super::refused;
use crate::support::*;
use davit::statechart::Sim;

fn help(parts: Vec<Part>) -> String {
    let found = findings(parts);
    let finding = found.into_iter().find(|f| f.is_error()).expect("an error");
    format!("{}; {}", finding.message, finding.help.unwrap_or_default())
}

#[test]
fn unknown_names_are_told_with_the_nearest() {
    let said = help(vec![s("lighthouse", vec![]), t("initial", "lighthuose", "")]);
    assert_eq!(said, "there is no `lighthuose` in `root`; did you mean `lighthouse`?");
    let said = help(vec![s("a", vec![]), s("b", vec![s("x", vec![]), t("x", "initial", "e")]), t("initial", "a", "")]);
    assert!(said.contains("write a transition with `src = \"initial\"` in `root.b`"), "not another state's: {said}");
    let said = help(vec![s("a", vec![s("lamp", vec![])]), t("initial", "lamp", "")]);
    assert_eq!(said, "there is no `lamp` in `root`; there is one elsewhere: write `root.a.lamp`");
    let said = help(vec![s("a", vec![]), t("initial", "root.harbour.dock", "")]);
    assert!(said.starts_with("`root.harbour.dock` leads nowhere: there is no `harbour` in `root`"), "{said}");
}

#[test]
fn a_dotted_reference_starts_at_the_root_wherever_it_is_written() {
    let dispatch = || s("faults", vec![s("dispatch", vec![])]);
    compiled(vec![dispatch(), t("initial", "faults.dispatch", "")]);
    // The same in a nested scope: not from there.
    refused(
        vec![
            s("a", vec![dispatch(), s("x", vec![]), t("initial", "x", ""), t("x", "faults.dispatch", "e")]),
            t("initial", "a", ""),
        ],
        "chart::unknown_state",
    );
    let with_dot = compiled(vec![
        s("a", vec![dispatch(), s("x", vec![]), t("initial", "x", ""), t("x", ".faults.dispatch", "e")]),
        t("initial", "a", ""),
    ]);
    let mut sim = Sim::new(&with_dot);
    line(&mut sim, "run");
    assert_eq!(leaf_after(&mut sim, "e"), "root.a.faults.dispatch");
}

#[test]
fn leading_roots_are_stripped_from_both_forms() {
    for target in ["root.a.x", "a.x", "root.root.a.x", ".a.x", ".root.a.x", "a\\x", "a.x."] {
        let chart = compiled(vec![s("a", vec![s("x", vec![])]), t("initial", target, "")]);
        let mut sim = Sim::new(&chart);
        assert_eq!(leaf_after(&mut sim, ""), "root.a.x", "{target}");
    }
    refused(vec![s("a", vec![s("x", vec![])]), t("initial", "a..x", "")], "chart::unknown_state");
    // Without a dot `root` is a name like any other.
    refused(vec![s("a", vec![]), t("initial", "a", ""), t("root", "a", "e")], "chart::unknown_state");
}

#[test]
fn a_composite_target_needs_an_initial_connector() {
    let inside = || s("b", vec![s("x", vec![])]);
    refused(vec![s("a", vec![]), inside(), t("initial", "a", ""), t("a", "b", "e")], "chart::target_without_initial");
    let direct = compiled(vec![s("a", vec![]), inside(), t("initial", "a", ""), t("a", ".b.x", "e")]);
    let mut sim = Sim::new(&direct);
    line(&mut sim, "run");
    assert_eq!(leaf_after(&mut sim, "e"), "root.b.x", "fine when one of its states is the target");
}

#[test]
fn a_dot_alone_is_the_scope_itself() {
    let chart = compiled(vec![s("a", vec![t(".", "root.b", "e")]), s("b", vec![]), t("initial", "a", "")]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    assert_eq!(leaf_after(&mut sim, "e"), "root.b");
    // rFSM accepts it at the root and fails when it is taken.
    refused(vec![s("a", vec![]), t("initial", "a", ""), t(".", "a", "e")], "chart::from_root");
}

#[test]
fn internal_transitions_are_rejected() {
    refused(vec![s("a", vec![]), t("initial", "a", ""), t("a", "internal", "e")], "chart::internal_transition");
}

/// Where a transition stands and where it starts are two things: rFSM does not ask for an `initial` of the own scope.
#[test]
fn a_transition_from_an_initial_connector_further_in_may_stand_outside() {
    let chart = compiled(vec![
        s("a", vec![c("initial"), s("x", vec![]), s("y", vec![])]),
        t("initial", "a", ""),
        t(".a.initial", ".a.y", ""),
    ]);
    let mut sim = Sim::new(&chart);
    assert_eq!(leaf_after(&mut sim, ""), "root.a.y");
}
