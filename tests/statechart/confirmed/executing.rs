//! Taking a transition: what is left, done and entered, in which order, and what functions see of it (docs/rfsm.md §5).

use crate::scripted::*;
use crate::support::*;
use davit::statechart::Sim;

fn a11() -> davit::statechart::Chart {
    compiled(vec![
        s(
            "A",
            vec![
                s("A1", vec![s("A11", vec![]), tx("initial", "A11", "", 0.0, "ef_A1")]),
                tx("initial", "A1", "", 0.0, "ef_A"),
                tx(".A1.A11", "root.A", "up", 0.0, "ef"),
            ],
        ),
        tx("initial", "A", "", 0.0, "ef_init"),
        tx("A", "A", "self", 0.0, "ef"),
        tx("A", ".A.A1.A11", "down", 0.0, "ef"),
        s("b", vec![]),
        t("A", "b", "out"),
        tx("b", "initial", "again", 0.0, "ef"),
    ])
}

#[test]
fn traces_as_probed() {
    let chart = a11();
    let mut sim = Sim::new(&chart);
    assert_eq!(trace_of(&mut sim, "run"), "root+ ef_init A+ ef_A A1+ ef_A1 A11+");
    assert_eq!(trace_of(&mut sim, "self"), "A11- A1- A- ef A+ ef_A A1+ ef_A1 A11+", "external");
    assert_eq!(trace_of(&mut sim, "down"), "A11- A1- A- ef A+ A1+ A11+", "external, and initials are skipped");
    assert_eq!(trace_of(&mut sim, "up"), "A11- A1- ef ef_A A1+ ef_A1 A11+", "A is not left: local");
    assert_eq!(trace_of(&mut sim, "out"), "A11- A1- A- b+");
    assert_eq!(trace_of(&mut sim, "again"), "b- ef ef_init A+ ef_A A1+ ef_A1 A11+", "root is not left");
}

#[test]
fn a_connector_inside_a_composite_really_enters_and_leaves_it() {
    let chart = compiled(vec![
        s("a", vec![]),
        s("b", vec![]),
        s("C", vec![c("k"), Part::Entry("C_in"), Part::Exit("C_out"), tx("k", "root.b", "", 0.0, "e2")]),
        t("initial", "a", ""),
        tx("a", ".C.k", "go", 0.0, "e1"),
    ]);
    let mut sim = Sim::new(&chart);
    line(&mut sim, "run");
    assert_eq!(trace_of(&mut sim, "go"), "a- e1 C+ C_in C- C_out e2 b+");
}

#[test]
fn what_functions_see_while_a_transition_is_under_way() {
    let mut model = root(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", "")]);
    let mut go = transition("a", "b", "e");
    go.effect.push(call(2));
    model.root.transitions.push(go);
    for (index, entry) in [(0, false), (1, true)] {
        let davit::model::statechart::ChartNode::State(state) = &mut model.root.children[index] else { panic!() };
        if entry { state.entry.push(call(3)) } else { state.exit.push(call(1)) }
    }
    let mut run = Run::of(&model, Scripted::default());
    run.run();
    run.hook.take();
    run.send("e");
    run.step(1);
    // On exit the state is inactive already and the leaf still set; on entry active, and no leaf yet.
    assert_eq!(run.hook.take(), "a- exit1[root,a] effect2[root,none] b+ entry3[b,none]");
}

#[test]
fn what_entry_sends_is_queued_before_the_completion() {
    let mut model = root(vec![s("a", vec![]), t("initial", "a", ""), t("a", "a", "mine")]);
    let davit::model::statechart::ChartNode::State(a) = &mut model.root.children[0] else { panic!("a state") };
    a.entry.push(call(1));
    let hook = Scripted::default().function(1, |view| {
        let mine = view.chart.event(davit::model::names::EventName::new("mine").unwrap());
        view.queue.push(mine);
        0
    });
    let mut run = Run::of(&model, hook);
    run.step(1);
    let queue: Vec<String> = run.machine.queue().events().iter().map(|e| run.chart.event_text(*e)).collect();
    assert_eq!(queue, ["mine", "e_done@root.a"]);
}

#[test]
fn configurations_come_after_entry_names_and_go_before_exit_names() {
    let chart = compiled(vec![
        s(
            "a",
            vec![
                Part::Entry("in"),
                Part::Exit("out"),
                Part::Config("one"),
                Part::Config("two"),
                s("x", vec![Part::Config("three")]),
                t("initial", "x", ""),
            ],
        ),
        s("b", vec![]),
        t("initial", "a", ""),
        t("a", "b", "e"),
    ]);
    let mut sim = Sim::new(&chart);
    assert_eq!(trace_of(&mut sim, "run"), "root+ a+ in one two x+ three");
    assert_eq!(trace_of(&mut sim, "e"), "x- three.undo a- two.undo one.undo out b+", "last in, first out");
}
