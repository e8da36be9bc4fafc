//! Making a machine of a model: the connector `initial`, reserved names, missing ends (docs/rfsm.md §1.2, §2).

use super::{doubted, refused};
use crate::scripted::*;
use crate::support::*;

#[test]
fn a_root_without_nodes_gets_no_initial_connector() {
    refused(vec![t("initial", "a", "")], "chart::no_initial");
    refused(vec![], "chart::no_initial");
}

#[test]
fn only_a_source_makes_the_initial_connector() {
    refused(vec![s("a", vec![]), t("a", "initial", "e")], "chart::no_initial");
}

#[test]
fn a_composite_with_an_activity_gets_no_initial_connector() {
    let mut model = root(vec![s("a", vec![s("x", vec![]), t("initial", "x", "")]), t("initial", "a", "")]);
    let davit::model::statechart::ChartNode::State(a) = &mut model.root.children[0] else { panic!("a state") };
    a.doo = function(1);
    let (chart, found) = davit::statechart::compile(&model);
    assert!(chart.is_none());
    let codes: Vec<&str> = found.iter().map(|f| f.code.0).collect();
    assert!(codes.contains(&"chart::doo_in_composite") && codes.contains(&"chart::unknown_state"), "{codes:?}");
    let unknown = found.iter().find(|f| f.code.0 == "chart::unknown_state").expect("looked at");
    let help = unknown.help.as_ref().expect("help");
    assert!(help.starts_with("a state with a `doo` is given none"), "{help}");
}

#[test]
fn an_activity_of_a_composite_is_never_run() {
    let mut model =
        root(vec![s("a", vec![c("initial"), s("x", vec![]), t("initial", "x", "")]), t("initial", "a", "")]);
    let davit::model::statechart::ChartNode::State(a) = &mut model.root.children[0] else { panic!("a state") };
    a.doo = function(1);
    let mut run = Run::of(&model, Scripted::default().function(1, |_| FINISHED));
    assert!(run.run());
    assert_eq!(run.hook.take(), "root+ a+ x+");
}

#[test]
fn a_transition_needs_both_ends() {
    let mut one = transition("a", "a", "e");
    one.tgt = None;
    refused(vec![s("a", vec![]), t("initial", "a", ""), Part::Trans(one)], "chart::missing_end");
    let mut other = transition("a", "a", "e");
    other.src = None;
    refused(vec![s("a", vec![]), t("initial", "a", ""), Part::Trans(other)], "chart::missing_end");
}

#[test]
fn all_faults_are_told_at_once() {
    let found = findings(vec![
        s("a", vec![]),
        t("initial", "a", ""),
        t("a", "nowhere", "e"),
        t("nobody", "a", "e"),
        t("a", "internal", "e"),
    ]);
    let codes: Vec<&str> = found.iter().filter(|f| f.is_error()).map(|f| f.code.0).collect();
    assert_eq!(codes, ["chart::unknown_state", "chart::unknown_state", "chart::internal_transition"]);
}

#[test]
fn names_that_rfsm_uses_itself() {
    refused(vec![s("err", vec![]), t("initial", "err", "")], "chart::reserved_name");
    refused(vec![s("type", vec![]), t("initial", "type", "")], "chart::reserved_name");
    let inside = compiled(vec![s("a", vec![s("err", vec![]), t("initial", "err", "")]), t("initial", "a", "")]);
    assert!(inside.find("root.a.err").is_ok(), "only the root's own fields are taken");
}

#[test]
fn initial_must_be_a_connector() {
    refused(vec![s("initial", vec![]), s("a", vec![]), t("initial", "a", "e")], "chart::initial_is_a_state");
    doubted(
        vec![
            s("a", vec![]),
            s("b", vec![s("initial", vec![])]),
            t("initial", "a", ""),
            t("a", "b", "e"),
            t("b", "a", "f"),
        ],
        "chart::initial_is_a_state",
    );
}

#[test]
fn two_children_of_one_name() {
    refused(vec![s("a", vec![]), s("a", vec![]), t("initial", "a", "")], "chart::two_nodes");
}
