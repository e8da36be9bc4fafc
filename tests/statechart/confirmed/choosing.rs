//! Guards and events, the search for a path, and which of several is taken (docs/rfsm.md §4.2, §4.4, §4.5).

use super::refused;
use crate::scripted::*;
use crate::support::*;
use davit::statechart::Sim;

#[test]
fn the_outermost_state_with_a_path_wins_whatever_the_priorities() {
    let chart = compiled(vec![
        s("a", vec![s("x", vec![]), s("y", vec![]), t("initial", "x", ""), tx("x", "y", "e", 100.0, "")]),
        s("b", vec![]),
        t("initial", "a", ""),
        tx("a", "b", "e", -100.0, ""),
    ]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    assert_eq!(leaf_after(&mut sim, "e"), "root.b");
}

#[test]
fn an_outer_transition_into_a_dead_end_leaves_it_to_the_inner_one() {
    let chart = compiled(vec![
        s("a", vec![s("x", vec![]), s("y", vec![]), t("initial", "x", ""), t("x", "y", "e")]),
        s("b", vec![]),
        c("k"),
        t("initial", "a", ""),
        t("a", "k", "e"),
        t("k", "b", "f"),
    ]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    assert_eq!(leaf_after(&mut sim, "e"), "root.a.y");
}

#[test]
fn a_dead_end_falls_back_to_a_lower_priority() {
    let chart = compiled(vec![
        s("a", vec![]),
        s("b", vec![]),
        s("d", vec![]),
        c("k"),
        t("initial", "a", ""),
        tx("a", "k", "e", 10.0, ""),
        tx("a", "d", "e", -10.0, ""),
        t("k", "b", "f"),
    ]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    assert_eq!(leaf_after(&mut sim, "e"), "root.d");
}

#[test]
fn a_null_transition_needs_some_event_and_its_own_completion_is_one() {
    let chart = compiled(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), t("a", "b", "")]);
    let mut sim = Sim::new(&chart);
    assert_eq!(leaf_after(&mut sim, ""), "root.a", "nothing yet: the completion waits");
    let seen = line(&mut sim, "");
    assert_eq!(seen.active, ["root", "root.b"], "the completion of `a` was the event");
    let mut run = busy_leaf();
    run.run();
    assert_eq!(run.leaf(), "root.a", "without completion no event, without event no transition");
}

/// As above with an activity in `a` that never ends.
fn busy_leaf() -> Run {
    let mut model = root(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), t("a", "b", "")]);
    let davit::model::statechart::ChartNode::State(a) = &mut model.root.children[0] else { panic!("a state") };
    a.doo = function(1);
    Run::of(&model, Scripted::default().function(1, |_| IDLE))
}

#[test]
fn several_ways_in_are_a_conflict_too() {
    let model = root(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), t("initial", "b", "")]);
    let mut run = Run::of(&model, Scripted::default());
    run.run();
    assert_eq!(run.hook.take(), "root+ conflict root.initial: root.a,root.b a+");
}

#[test]
fn several_ways_on_from_a_connector_are_a_conflict() {
    let model = root(vec![
        s("a", vec![]),
        s("b", vec![]),
        s("d", vec![]),
        c("k"),
        t("initial", "a", ""),
        t("a", "k", "e"),
        tx("k", "b", "", 0.0, ""),
        tx("k", "d", "", 0.0, ""),
    ]);
    let mut run = Run::of(&model, Scripted::default());
    run.run();
    run.hook.take();
    run.send("e");
    run.run();
    assert_eq!(run.hook.take(), "a- conflict root.k: root.b,root.d b+");
    let mut sim = Sim::new(&run.chart);
    line(&mut sim, "run");
    assert_eq!(line(&mut sim, "e").notes, ["conflicting transitions from src root.k to root.b, root.d"]);
}

#[test]
fn circles_of_connectors_are_refused() {
    refused(
        vec![
            s("a", vec![]),
            c("k"),
            c("l"),
            t("initial", "a", ""),
            t("a", "k", "e"),
            t("k", "l", ""),
            t("l", "k", ""),
            t("l", "a", "never"),
        ],
        "chart::connector_circle",
    );
    refused(vec![s("a", vec![]), t("initial", "a", ""), t("initial", "initial", "")], "chart::connector_circle");
}

/// A circle that only several events open in one step: each alone finds its way, together they find none, in the states
/// further in either. rFSM overflows its stack.
#[test]
fn a_circle_held_by_events_works() {
    let model = root(vec![
        s("a", vec![]),
        s("b", vec![]),
        c("k"),
        c("l"),
        t("initial", "a", ""),
        t("a", "k", "e"),
        t("k", "l", "e2"),
        t("l", "k", "e3"),
        t("l", "b", ""),
        t("b", "a", "back"),
        t("a", "b", "e3"),
    ]);
    let (chart, findings) = davit::statechart::compile(&model);
    let circle: Vec<_> = findings.iter().filter(|f| f.code.0 == "chart::connector_circle").collect();
    let [one] = &circle[..] else { panic!("{findings:?}") };
    assert!(!one.is_error() && one.message.starts_with("when `e2` and `e3` come in one step"), "{}", one.message);
    let chart = chart.expect("accepted");
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    let seen = line(&mut sim, "e e2 e3");
    assert_eq!((seen.active.last().unwrap().as_str(), seen.transition), ("root.a", false));
    assert_eq!(seen.notes, ["connectors lead round in a circle at root.k: no path is taken"]);
    assert_eq!(line(&mut sim, "e e2").active.last().unwrap(), "root.b");
    line(&mut sim, "back");
    assert_eq!(line(&mut sim, "e3").active.last().unwrap(), "root.b", "what was lost is found in the next step");
    // One event opens it alone: a warning that says so.
    let model =
        root(vec![s("a", vec![]), c("k"), t("initial", "a", ""), t("a", "k", "e"), t("k", "k", "e"), t("k", "a", "")]);
    let (chart, findings) = davit::statechart::compile(&model);
    assert!(chart.is_some() && findings.iter().any(|f| f.message.starts_with("on `e` connectors")), "{findings:?}");
}

/// Circles inside circles that guards hold end soon, too.
#[test]
fn many_ways_round_are_not_all_gone() {
    let guarded = |src, tgt| {
        let mut one = transition(src, tgt, "");
        one.guard = function(1);
        Part::Trans(one)
    };
    let model = root(vec![
        s("a", vec![]),
        c("k"),
        t("initial", "a", ""),
        t("a", "k", "e"),
        guarded("k", "k"),
        guarded("k", "k"),
        guarded("k", "k"),
        t("k", "a", ""),
    ]);
    let mut run = Run::of(&model, Scripted::default().function(1, |_| 1));
    run.run();
    run.hook.take();
    run.send("e");
    run.run();
    assert_eq!(run.hook.log.iter().filter(|l| l.starts_with("runaway root.")).count(), 1);
}

#[test]
fn a_circle_held_by_a_guard_works() {
    let mut guarded = transition("k", "l", "");
    guarded.guard = function(1);
    let circle = |guarded| {
        root(vec![
            s("a", vec![]),
            s("b", vec![]),
            c("k"),
            c("l"),
            t("initial", "a", ""),
            t("a", "k", "e"),
            Part::Trans(guarded),
            t("l", "k", ""),
            t("l", "b", ""),
        ])
    };
    let mut turns = 0;
    let hook = Scripted::default().function(1, move |_| {
        turns += 1;
        i32::from(turns < 3)
    });
    let mut run = Run::of(&circle(guarded.clone()), hook);
    run.run();
    run.hook.take();
    run.send("e");
    run.run();
    assert_eq!(run.leaf(), "root.b");
    assert_eq!(run.hook.take(), "g1 g1 g1 a- conflict root.l: root.k,root.b b+", "twice round, and out");
    // A guard that never says no: rFSM overflows its stack, here it is told and no path is found.
    let mut run = Run::of(&circle(guarded), Scripted::default().function(1, |_| 1));
    run.run();
    run.hook.take();
    run.send("e");
    run.run();
    assert!(run.hook.log.iter().any(|l| l.starts_with("runaway root.")));
}

#[test]
fn all_guards_run_also_where_the_events_do_not_match() {
    let mut first = transition("a", "b", "e");
    first.guard = function(1);
    let mut second = transition("a", "d", "e");
    second.guard = function(2);
    let mut third = transition("a", "d", "not_this");
    third.guard = function(3);
    let model = root(vec![
        s("a", vec![]),
        s("b", vec![]),
        s("d", vec![]),
        t("initial", "a", ""),
        Part::Trans(first),
        Part::Trans(second),
        Part::Trans(third),
    ]);
    let yes = |_: &mut davit::statechart::HookContext<'_>| 1;
    let mut run = Run::of(&model, Scripted::default().function(1, yes).function(2, yes).function(3, yes));
    run.run();
    run.hook.take();
    run.send("e");
    run.step(1);
    assert_eq!(run.hook.take(), "g1 g2 g3 a- b+");
}

#[test]
fn guards_of_the_first_entry_run_before_the_roots_entry() {
    let mut first = transition("initial", "a", "");
    first.guard = function(1);
    let mut model = root(vec![s("a", vec![]), Part::Trans(first)]);
    model.root.entry.push(call(2));
    let mut run = Run::of(&model, Scripted::default().function(1, |_| 1));
    run.run();
    assert_eq!(run.hook.take(), "g1 root+ entry2[root,none] a+");
}
