//! Every statement about pure charts that was confirmed by running rFSM (marked [P] in `rfsm.md`), and the gaps that its
//! own tests leave (§10).

use crate::scripted::*;
use crate::support::*;
use davit::statechart::{Ended, Machine, Nobody, Sim, Step};
use davit::time::Time;

/// Refused with that code.
fn refused(parts: Vec<Part>, code: &str) {
    let found = findings(parts);
    assert!(found.iter().any(|f| f.is_error() && f.code.0 == code), "{code} expected: {found:#?}");
}

/// Accepted, with a finding of that code.
fn doubted(parts: Vec<Part>, code: &str) {
    let found = findings(parts);
    assert!(!found.iter().any(|f| f.is_error()), "{found:#?}");
    assert!(found.iter().any(|f| f.code.0 == code), "{code} expected: {found:#?}");
}

mod construction {
    use super::*;

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
        let davit::model::statechart::Node::State(a) = &mut model.root.children[0] else { panic!("a state") };
        a.doo = function(1);
        let (chart, found) = davit::statechart::compile(&model);
        assert!(chart.is_none());
        let codes: Vec<&str> = found.iter().map(|f| f.code.0).collect();
        assert!(codes.contains(&"chart::doo_in_composite") && codes.contains(&"chart::unknown_state"), "{codes:?}");
    }

    #[test]
    fn an_activity_of_a_composite_is_never_run() {
        let mut model =
            root(vec![s("a", vec![c("initial"), s("x", vec![]), t("initial", "x", "")]), t("initial", "a", "")]);
        let davit::model::statechart::Node::State(a) = &mut model.root.children[0] else { panic!("a state") };
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
}

mod references {
    use super::*;

    fn help(parts: Vec<Part>) -> String {
        let found = findings(parts);
        let finding = found.into_iter().find(|f| f.is_error()).expect("an error");
        format!("{}; {}", finding.message, finding.help.unwrap_or_default())
    }

    #[test]
    fn unknown_names_are_told_with_the_nearest() {
        let said = help(vec![s("lighthouse", vec![]), t("initial", "lighthuose", "")]);
        assert_eq!(said, "there is no `lighthuose` in `root`; did you mean `lighthouse`?");
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
        refused(
            vec![s("a", vec![]), inside(), t("initial", "a", ""), t("a", "b", "e")],
            "chart::target_without_initial",
        );
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
}

mod choosing {
    use super::*;

    /// Leaves `t1`…`tn`, all reached from `a` on `e` with these priorities; answers in which order they are tried.
    fn order(priorities: &[Option<f64>]) -> Vec<usize> {
        let names: Vec<String> = (1..=priorities.len()).map(|i| format!("t{i}")).collect();
        let mut tried = Vec::new();
        // Taking away the winner's event each time would change the list; so each target has an own event as well, and
        // the order is read off the compiled list.
        let mut parts = vec![s("a", vec![]), t("initial", "a", "")];
        for (name, pn) in names.iter().zip(priorities) {
            parts.push(s(name, vec![]));
            parts.push(tx("a", name, "e", pn.unwrap_or(0.0), ""));
        }
        let chart = compiled(parts);
        let a = chart.find("a").unwrap();
        for edge in chart.outgoing(a) {
            let target = chart.name(chart.ends(edge).1).to_string();
            tried.push(target[1..].parse().unwrap());
        }
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        assert_eq!(leaf_after(&mut sim, "e"), format!("root.t{}", tried[0]), "the first of the list is taken");
        tried
    }

    #[test]
    fn equal_priorities_are_not_in_written_order() {
        assert_eq!(order(&[None; 4]), [1, 3, 2, 4]);
        assert_eq!(order(&[None; 5]), [1, 4, 3, 2, 5]);
        assert_eq!(order(&[None; 7]), [1, 5, 6, 4, 2, 3, 7]);
        assert_eq!(order(&[None; 12]), [1, 8, 7, 9, 10, 11, 6, 4, 5, 2, 3, 12]);
        let some = Some;
        assert_eq!(
            order(&[some(0.0), some(5.0), some(0.0), some(5.0), None, some(-1.0), some(5.0), some(0.0)]),
            [4, 2, 7, 5, 1, 8, 3, 6]
        );
        assert_eq!(order(&[some(-1.0), some(-1.0), some(2.0)]), [3, 2, 1]);
    }

    /// The sort of a real Lua, over random lists of up to 100.
    #[test]
    fn the_order_is_what_lua_makes_of_it() {
        let lua = mlua::Lua::new();
        let sort: mlua::Function = lua
            .load(
                "local pn = ...; local list = {}; for i = 1, #pn do list[i] = { i = i, pn = pn[i] } end
                 table.sort(list, function(a, b) return a.pn > b.pn end)
                 local out = {}; for i, t in ipairs(list) do out[i] = t.i end; return out",
            )
            .into_function()
            .unwrap();
        let mut seed = 1_u64;
        let mut next = |below: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) % below
        };
        for _ in 0..300 {
            let length = 2 + next(98);
            let kinds = 1 + next(6);
            let pn: Vec<f64> = (0..length).map(|_| next(kinds) as f64).collect();
            let lua: Vec<usize> = sort.call(pn.clone()).unwrap();
            let ours = order(&pn.into_iter().map(Some).collect::<Vec<_>>());
            assert_eq!(ours, lua);
        }
    }

    #[test]
    fn at_equal_priority_the_outer_scope_wins() {
        let chart = compiled(vec![
            s("a", vec![s("x", vec![]), s("inner", vec![]), t("initial", "x", ""), t("x", "inner", "e")]),
            s("outer", vec![]),
            t("initial", "a", ""),
            t(".a.x", "outer", "e"),
        ]);
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        assert_eq!(leaf_after(&mut sim, "e"), "root.outer");
    }

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
        let davit::model::statechart::Node::State(a) = &mut model.root.children[0] else { panic!("a state") };
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
        let yes = |_: &mut davit::statechart::View<'_>| 1;
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
}

mod executing {
    use super::*;

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
            let davit::model::statechart::Node::State(state) = &mut model.root.children[index] else { panic!() };
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
        let davit::model::statechart::Node::State(a) = &mut model.root.children[0] else { panic!("a state") };
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
}

mod stepping {
    use super::*;

    fn entered_on_event() -> davit::statechart::Chart {
        compiled(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", "e_begin"), t("a", "b", "e")])
    }

    #[test]
    fn a_failed_entry_loses_the_events_and_is_not_idle() {
        let chart = entered_on_event();
        let mut machine = Machine::new(&chart);
        let stepped = machine.step(&chart, Time(0), 1, &mut Nobody);
        assert_eq!((stepped.idle, stepped.ended), (false, Ended::NotEntered));
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
        assert_eq!(run.turn(), Step::Taken);
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
        let parts = || {
            vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), t("a", "b", "e_done"), t("b", "a", "e_done")]
        };
        let chart = compiled(parts());
        let mut machine = Machine::new(&chart);
        assert_eq!(machine.run(&chart, Time(0), &mut Nobody).ended, Ended::Endless);
        doubted(parts(), "chart::endless");
    }

    #[test]
    fn the_event_of_the_first_entry_can_be_waited_for() {
        let chart = compiled(vec![s("a", vec![]), t("initial", "a", "e_init_fsm")]);
        let mut sim = Sim::new(&chart);
        assert_eq!(leaf_after(&mut sim, ""), "root.a");
    }
}

mod doubts {
    use super::*;

    #[test]
    fn each_doubt_is_told_and_a_good_chart_raises_none() {
        let good = || {
            vec![
                s("a", vec![s("x", vec![]), s("y", vec![]), t("initial", "x", ""), t("x", "y", "e"), t("y", "x", "e")]),
                s("b", vec![]),
                t("initial", "a", ""),
                t("a", "b", "f"),
                t("b", "a", "f"),
            ]
        };
        assert!(findings(good()).is_empty(), "{:#?}", findings(good()));
        let with = |more: Vec<Part>| good().into_iter().chain(more).collect::<Vec<_>>();
        let cases = [
            ("chart::no_outgoing", with(vec![s("z", vec![]), t("a", "z", "g")])),
            ("chart::no_outgoing", with(vec![c("k"), t("a", "k", "g")])),
            ("chart::unreachable", with(vec![s("z", vec![]), t("z", "a", "g")])),
            ("chart::order_decides", with(vec![s("z", vec![]), t("a", "z", "f"), t("z", "a", "f")])),
            ("chart::order_decides", with(vec![s("z", vec![]), t("a", "z", ""), t("z", "a", "f")])),
            ("chart::shadowed", with(vec![s("z", vec![]), tx("b", "z", "", 1.0, ""), t("z", "a", "f")])),
            ("chart::never_done", with(vec![tx("b", "a", "e_done@root.nobody", 2.0, "")])),
            ("chart::two_timers", with(vec![t("b", "a", "e_after(1)"), t("b", "a", "e_after(2)")])),
            ("chart::root_exit", with(vec![Part::Exit("bye")])),
            ("chart::root_exit", with(vec![Part::Config("always")])),
        ];
        for (code, parts) in cases {
            doubted(parts, code);
        }
        doubted(vec![s("a", vec![]), t("initial", "a", "e"), t("a", "a", "f")], "chart::entry_waits");
        // Equal priorities that lead to the same are no doubt.
        assert!(findings(with(vec![t("a", "b", "f")])).is_empty());
        assert!(findings(with(vec![t("a", "b", "other")])).is_empty());
    }

    #[test]
    fn find_takes_any_end_of_a_path() {
        let chart = compiled(vec![
            s("up", vec![s("x", vec![]), t("initial", "x", "")]),
            s("down", vec![s("x", vec![]), t("initial", "x", "")]),
            t("initial", "up", ""),
            t("up", "down", "e"),
        ]);
        assert_eq!(chart.fqn(chart.find("up").unwrap()).to_string(), "root.up");
        assert_eq!(chart.find("root.up"), chart.find("up"));
        assert_eq!(chart.fqn(chart.find("down.x").unwrap()).to_string(), "root.down.x");
        assert_eq!(chart.find("x").unwrap_err().to_string(), "`x` is the name of 2 states: root.up.x, root.down.x");
        assert_eq!(
            chart.find("dwon").unwrap_err().to_string(),
            "the coordinator has no state `dwon`; did you mean `down`?"
        );
        assert!(chart.find("initial").is_err(), "a connector is no state");
    }
}

mod sim {
    use super::*;

    #[test]
    fn the_object_of_the_design() {
        let chart = compiled(vec![
            s("unsync", vec![Part::Exit("X")]),
            s("sync", vec![s("harmonizing", vec![]), t("initial", "harmonizing", "")]),
            t("initial", "unsync", ""),
            t("unsync", "sync", "e_qos_ok"),
            t("sync", "unsync", "e_link_lost"),
        ]);
        let mut sim = Sim::new(&chart);
        line(&mut sim, "");
        assert_eq!(
            serde_json::to_string(&line(&mut sim, "e_qos_ok")).unwrap(),
            r#"{"active":["root","root.sync","root.sync.harmonizing"],"mode":"done","queue":["e_done@root.sync.harmonizing"],"actions":["exit root.unsync","raise X","entry root.sync","entry root.sync.harmonizing"],"transition":true,"idle":false}"#
        );
    }

    #[test]
    fn lines_that_say_nothing_known_change_nothing() {
        let chart = compiled(vec![s("a", vec![]), t("initial", "a", "")]);
        let mut sim = Sim::new(&chart);
        for text in ["advance", "advance x", "advance -1", "advance 1 2", "advance nan", "advance inf", "a\u{1}b"] {
            assert!(sim.line(text).is_err(), "{text}");
        }
        assert!(sim.machine().active().is_empty());
        assert_eq!(leaf_after(&mut sim, "run advance"), "root.a", "two words are two events");
    }

    #[test]
    fn a_set_too_large_is_cut_and_said() {
        let chart = compiled(vec![s("a", vec![]), t("initial", "a", "")]);
        let mut sim = Sim::new(&chart);
        let seen = line(&mut sim, &"e ".repeat(davit::limits::CHART_QUEUE + 4));
        assert_eq!(seen.notes.len(), 1, "one place was taken by the event of the first entry");
        assert!(seen.notes[0].starts_with("5 events found no room"));
    }
}
