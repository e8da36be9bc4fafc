//! The tests that rFSM's authors named (`docs/rfsm.md` §10), as far as they mean something without Lua, written anew.

use crate::scripted::*;
use crate::support::*;
use davit::model::finding::Origin;
use davit::model::statechart::{FunctionId, Statechart, Trigger};
use davit::statechart::{Mode, Sim};
use std::cell::RefCell;
use std::rc::Rc;

mod core {
    use super::*;

    #[test]
    fn initial_entry() {
        let chart = compiled(vec![s("off", vec![]), s("on", vec![]), t("initial", "off", ""), t("off", "on", "e_on")]);
        let mut sim = Sim::new(&chart);
        let seen = line(&mut sim, "run");
        assert_eq!(seen.active, ["root", "root.off"]);
        assert_eq!(seen.mode, Some(Mode::Done));
        assert!(seen.idle && seen.transition);
    }

    #[test]
    fn event_transition() {
        let chart = compiled(vec![s("off", vec![]), s("on", vec![]), t("initial", "off", ""), t("off", "on", "e_on")]);
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        assert_eq!(leaf_after(&mut sim, "e_on"), "root.on");
    }

    #[test]
    fn unknown_event_no_transition() {
        let chart = compiled(vec![s("off", vec![]), s("on", vec![]), t("initial", "off", ""), t("off", "on", "e_on")]);
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        let seen = line(&mut sim, "e_never_heard_of");
        assert_eq!(seen.active, ["root", "root.off"]);
        assert!(!seen.transition && seen.actions.is_empty());
    }

    #[test]
    fn entry_exit_order() {
        let chart = compiled(vec![
            s("a", vec![Part::Entry("a_entry"), Part::Exit("a_exit")]),
            s("b", vec![Part::Entry("b_entry")]),
            t("initial", "a", ""),
            t("a", "b", "e"),
        ]);
        let mut sim = Sim::new(&chart);
        assert_eq!(trace_of(&mut sim, "run"), "root+ a+ a_entry");
        assert_eq!(trace_of(&mut sim, "e"), "a- a_exit b+ b_entry");
    }

    fn guarded() -> Statechart {
        let mut back = transition("a", "b", "e");
        back.guard = function(1);
        root(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), Part::Trans(back)])
    }

    #[test]
    fn guard_blocks_transition() {
        let open = Rc::new(RefCell::new(0));
        let answer = open.clone();
        let mut run = Run::of(&guarded(), Scripted::default().function(1, move |_| *answer.borrow()));
        run.run();
        run.send("e");
        run.run();
        assert_eq!(run.leaf(), "root.a");
        *open.borrow_mut() = 1;
        run.send("e");
        run.run();
        assert_eq!(run.leaf(), "root.b");
    }

    #[test]
    fn effect_runs_and_receives_events() {
        let mut go = transition("a", "b", "e_go");
        go.effect.push(call(1));
        let model = root(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), Part::Trans(go)]);
        let seen = Rc::new(RefCell::new(Vec::new()));
        let note = seen.clone();
        let hook = Scripted::default().function(1, move |view| {
            note.borrow_mut().extend(view.events.iter().map(|e| view.chart.event_text(*e)));
            0
        });
        let mut run = Run::of(&model, hook);
        run.run();
        run.send("e_go");
        run.run();
        assert_eq!(*seen.borrow(), ["e_go"]);
    }

    #[test]
    fn priority_number() {
        let chart = compiled(vec![
            s("a", vec![]),
            s("low", vec![]),
            s("high", vec![]),
            t("initial", "a", ""),
            tx("a", "low", "e", 1.0, ""),
            tx("a", "high", "e", 10.0, ""),
        ]);
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        assert_eq!(leaf_after(&mut sim, "e"), "root.high");
    }

    #[test]
    fn any_event_transition() {
        let chart = compiled(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), t("a", "b", "")]);
        let mut sim = Sim::new(&chart);
        assert_eq!(leaf_after(&mut sim, ""), "root.a");
        assert_eq!(leaf_after(&mut sim, "whatever"), "root.b");
    }

    #[test]
    fn reset() {
        let model = root(vec![
            s("a", vec![Part::Exit("left")]),
            s("b", vec![Part::Exit("left")]),
            t("initial", "a", ""),
            t("a", "b", "e"),
        ]);
        let mut run = Run::of(&model, Scripted::default());
        run.run();
        run.send("e");
        run.run();
        assert_eq!(run.leaf(), "root.b");
        run.hook.take();
        run.machine.reset(&run.chart);
        assert_eq!(run.leaf(), "");
        assert!(run.machine.active().is_empty() && run.machine.mode().is_none());
        run.run();
        assert_eq!(run.hook.take(), "root+ a+", "no exit ran");
    }

    #[test]
    fn predicate_event() {
        let mut go = transition("a", "b", "");
        go.events = vec![(Trigger::Predicate(FunctionId(1)), Origin::NONE)];
        let model = root(vec![s("a", vec![]), s("b", vec![]), t("initial", "a", ""), Part::Trans(go)]);
        let yes = Rc::new(RefCell::new(0));
        let answer = yes.clone();
        let mut run = Run::of(&model, Scripted::default().function(1, move |_| *answer.borrow()));
        run.run();
        run.hook.take();
        run.send("x y");
        run.step(1);
        assert_eq!(
            run.hook.take(),
            "p1(other) p1(other)",
            "once for each event; a step without a match does not count"
        );
        *yes.borrow_mut() = 1;
        run.send("x y");
        run.step(1);
        assert_eq!(run.hook.take(), "p1(other) a- b+", "the first match is enough");
    }

    #[test]
    fn get_active_conf() {
        let chart =
            compiled(vec![s("outer", vec![s("inner", vec![]), t("initial", "inner", "")]), t("initial", "outer", "")]);
        let mut sim = Sim::new(&chart);
        assert!(sim.machine().active().is_empty());
        assert_eq!(line(&mut sim, "run").active, ["root", "root.outer", "root.outer.inner"]);
    }

    #[test]
    fn relative_and_local_refs() {
        let chart = compiled(vec![
            s("off", vec![]),
            s(
                "operational",
                vec![
                    s("motors_off", vec![]),
                    s("motors_on", vec![s("moving", vec![]), s("stopped", vec![]), t("initial", "moving", "")]),
                    t("initial", ".motors_on.moving", ""),
                    t("motors_on", "motors_off", "e_off"),
                    t("motors_off", ".motors_on.stopped", "e_on"),
                    t(".motors_on.stopped", "root.off", "e_end"),
                    t("root.operational.motors_on.moving", "operational.motors_on.stopped", "e_stop"),
                ],
            ),
            t("initial", "operational", ""),
            t("off", "operational.motors_on", "e_begin"),
        ]);
        let mut sim = Sim::new(&chart);
        assert_eq!(leaf_after(&mut sim, ""), "root.operational.motors_on.moving");
        assert_eq!(leaf_after(&mut sim, "e_stop"), "root.operational.motors_on.stopped");
        assert_eq!(leaf_after(&mut sim, "e_off"), "root.operational.motors_off");
        assert_eq!(leaf_after(&mut sim, "e_on"), "root.operational.motors_on.stopped");
        assert_eq!(leaf_after(&mut sim, "e_end"), "root.off");
        assert_eq!(leaf_after(&mut sim, "e_begin"), "root.operational.motors_on.moving");
    }
}

mod connector {
    use super::*;

    fn chain() -> davit::statechart::Chart {
        compiled(vec![
            s("a", vec![]),
            s("b", vec![]),
            c("k"),
            t("initial", "a", ""),
            t("a", "k", "e_1"),
            t("k", "b", "e_2"),
        ])
    }

    #[test]
    fn partial_chain_not_taken() {
        let chart = chain();
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        let seen = line(&mut sim, "e_1");
        assert!(!seen.transition && seen.actions.is_empty());
        assert_eq!(leaf_after(&mut sim, "e_2"), "root.a", "the first half is forgotten");
    }

    #[test]
    fn full_chain_taken() {
        let chart = chain();
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        assert_eq!(leaf_after(&mut sim, "e_2 e_1"), "root.b", "both events in one step");
    }

    #[test]
    fn split_connector() {
        let chart = compiled(vec![
            s("a", vec![]),
            s("left", vec![]),
            s("right", vec![]),
            c("k"),
            t("initial", "a", ""),
            t("a", "k", "e"),
            t("k", "left", "e_left"),
            t("k", "right", "e_right"),
        ]);
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        assert_eq!(leaf_after(&mut sim, "e e_right"), "root.right");
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        assert_eq!(leaf_after(&mut sim, "e e_left"), "root.left");
    }

    #[test]
    fn exit_connector() {
        let chart = compiled(vec![
            s("busy", vec![s("one", vec![]), c("cexit"), t("initial", "one", ""), t("one", "cexit", "e_done")]),
            s("idle", vec![]),
            t("initial", "busy", ""),
            t(".busy.cexit", "idle", "e_done@root.busy.one"),
        ]);
        let mut sim = Sim::new(&chart);
        let seen = line(&mut sim, "run");
        assert_eq!(seen.active, ["root", "root.idle"]);
        assert_eq!(short(&seen), "root+ busy+ one+ one- busy- idle+");
    }
}

mod composite {
    use super::*;

    fn nested() -> davit::statechart::Chart {
        compiled(vec![
            s("a", vec![s("a1", vec![]), s("a2", vec![]), t("initial", "a1", ""), t("a1", "a2", "e_next")]),
            s("b", vec![]),
            t("initial", "a", ""),
            t("a", "b", "e_out"),
            t("b", "a", "e_in"),
        ])
    }

    #[test]
    fn nested_entry_and_transitions() {
        let chart = nested();
        let mut sim = Sim::new(&chart);
        assert_eq!(trace_of(&mut sim, "run"), "root+ a+ a1+");
        assert_eq!(trace_of(&mut sim, "e_next"), "a1- a2+");
        assert_eq!(trace_of(&mut sim, "e_out"), "a2- a- b+");
    }

    #[test]
    fn reentry_uses_initial() {
        let chart = nested();
        let mut sim = Sim::new(&chart);
        for text in ["run", "e_next", "e_out"] {
            line(&mut sim, text);
        }
        assert_eq!(leaf_after(&mut sim, "e_in"), "root.a.a1", "no history");
    }
}

mod doo {
    use super::*;

    /// `a` with an activity, `b` to go to on completion or on `e_stop`.
    fn busy(hook: Scripted) -> Run {
        let mut model = root(vec![
            s("a", vec![]),
            s("b", vec![]),
            t("initial", "a", ""),
            t("a", "b", "e_done"),
            t("a", "b", "e_stop"),
            t("b", "a", "e_again"),
        ]);
        let davit::model::statechart::ChartNode::State(a) = &mut model.root.children[0] else { panic!("a state") };
        a.doo = function(1);
        Run::of(&model, hook)
    }

    fn yields(times: usize, with: i32, then: i32) -> Scripted {
        let mut left = times;
        Scripted::default().function(1, move |_| {
            let more = left > 0;
            left = left.saturating_sub(1);
            if more { with } else { then }
        })
    }

    #[test]
    fn leaf_without_doo_completes_immediately() {
        let chart = compiled(vec![s("a", vec![]), t("initial", "a", "")]);
        let mut sim = Sim::new(&chart);
        let seen = line(&mut sim, "");
        assert_eq!(seen.mode, Some(Mode::Done));
        assert_eq!(seen.queue, ["e_done@root.a"]);
        assert!(!seen.idle);
    }

    #[test]
    fn doo_runs_to_completion_raises_e_done() {
        let mut run = busy(yields(3, BUSY, FINISHED));
        assert!(run.run());
        assert_eq!(run.leaf(), "root.b");
        assert_eq!(run.hook.take(), "root+ a+ reset1 doo1 doo1 doo1 doo1 a- b+");
    }

    #[test]
    fn doo_can_raise_events() {
        let hook = Scripted::default().function(1, |view| {
            let event = view.chart.event(davit::model::names::EventName::new("e_stop").unwrap());
            view.queue.push(event);
            BUSY
        });
        let mut run = busy(hook);
        run.run();
        assert_eq!(run.leaf(), "root.b");
    }

    #[test]
    fn event_preempts_doo() {
        let mut run = busy(yields(1000, IDLE, FINISHED));
        run.run();
        run.hook.take();
        run.send("e_stop");
        run.run();
        assert_eq!(run.leaf(), "root.b");
        assert_eq!(run.hook.take(), "a- b+", "not resumed again");
        run.send("e_again");
        run.step(1);
        assert_eq!(run.hook.take(), "b- a+ reset1", "and cold when entered again");
    }

    #[test]
    fn idle_flag_keeps_state_active() {
        let mut run = busy(yields(1000, IDLE, FINISHED));
        assert!(run.run());
        assert_eq!(run.machine.mode(), Some(Mode::Active));
        assert_eq!(run.leaf(), "root.a");
    }

    #[test]
    fn step_count() {
        let mut run = busy(yields(1000, BUSY, FINISHED));
        assert!(!run.step(1));
        assert_eq!(run.hook.take(), "root+ a+ reset1");
        assert!(!run.step(3));
        assert_eq!(run.hook.take(), "doo1 doo1 doo1");
    }

    /// `docs/rfsm.md` §7: what each step sees when the activity yields once and then returns.
    #[test]
    fn event_sets_step_by_step() {
        let mut run = busy(yields(1, BUSY, FINISHED));
        // The completion leads on here; the sets are the same.
        run.run();
        assert_eq!(run.hook.sets[..4].concat(), ["e_init_fsm", "e_done@root.a"]);
        assert_eq!(run.hook.sets.iter().map(Vec::len).collect::<Vec<_>>(), [1, 0, 0, 1, 1, 0]);
    }

    #[test]
    fn an_error_ends_it_without_completion() {
        let mut run = busy(yields(1, BUSY, FAILED));
        assert!(run.run());
        assert_eq!(run.leaf(), "root.a");
        assert_eq!(run.machine.mode(), Some(Mode::Done));
        assert!(run.machine.queue().events().is_empty());
    }
}

mod timeevent {
    use super::*;

    fn timed(trigger: &str) -> davit::statechart::Chart {
        compiled(vec![
            s("a", vec![]),
            s("b", vec![]),
            t("initial", "a", ""),
            t("a", "b", trigger),
            t("b", "a", "e_back"),
            t("a", "a", "e_again"),
        ])
    }

    #[test]
    fn fires_after_timeout() {
        let chart = timed("e_after(1)");
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        assert!(line(&mut sim, "advance 1").queue.is_empty(), "more than the time must have passed");
        let seen = line(&mut sim, "advance 0.000000001");
        assert_eq!(seen.queue, ["e_after(1)@root.a"], "raised after the step, seen by the next one");
        assert!(seen.idle, "the step was idle all the same");
        assert_eq!(leaf_after(&mut sim, "run"), "root.b");
    }

    #[test]
    fn timer_restarts_on_reentry() {
        let chart = timed("e_after(1)");
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        line(&mut sim, "advance 0.9");
        line(&mut sim, "e_again");
        assert!(line(&mut sim, "advance 0.9").queue.is_empty());
        line(&mut sim, "advance 0.2");
        assert_eq!(leaf_after(&mut sim, "run"), "root.b");
        line(&mut sim, "e_back");
        line(&mut sim, "run");
        line(&mut sim, "advance 1.1");
        assert_eq!(leaf_after(&mut sim, "run"), "root.b", "again after entering again");
    }

    #[test]
    fn e_at_absolute() {
        let chart = timed("e_at(2)");
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        line(&mut sim, "advance 1.5");
        line(&mut sim, "e_again");
        assert!(line(&mut sim, "advance 0.5").queue.iter().all(|e| !e.starts_with("e_at")));
        assert_eq!(line(&mut sim, "advance 0.1").queue, ["e_at(2)@root.a"], "entering again does not restart it");
        assert_eq!(leaf_after(&mut sim, "run"), "root.b");
        line(&mut sim, "e_back");
        assert_eq!(leaf_after(&mut sim, "run"), "root.b", "long past: at once");
    }

    #[test]
    fn legacy_string_syntax() {
        let chart = timed("e_after(0.50)");
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        assert_eq!(line(&mut sim, "advance 0.6").queue, ["e_after(0.50)@root.a"]);
    }

    /// Only the time event written last is ever raised, of several at one state.
    #[test]
    fn two_time_events_of_one_state() {
        let chart = compiled(vec![
            s("a", vec![]),
            s("b", vec![]),
            s("d", vec![]),
            t("initial", "a", ""),
            t("a", "b", "e_after(1)"),
            t("a", "d", "e_after(2)"),
        ]);
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        assert!(line(&mut sim, "advance 1.5").queue.is_empty());
        assert_eq!(line(&mut sim, "advance 1").queue, ["e_after(2)@root.a"]);
        assert_eq!(leaf_after(&mut sim, "run"), "root.d");
    }

    #[test]
    fn composite_sources_work_and_fire_once_a_visit() {
        let chart = compiled(vec![
            s("a", vec![s("x", vec![]), s("y", vec![]), t("initial", "x", ""), t("x", "y", "e")]),
            s("b", vec![]),
            t("initial", "a", ""),
            tx("a", "b", "e_after(1)", 0.0, ""),
            t("b", "a", "e_after(1)"),
        ]);
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        line(&mut sim, "advance 0.9");
        line(&mut sim, "e");
        line(&mut sim, "run");
        let seen = line(&mut sim, "advance 0.2");
        assert_eq!(seen.queue, ["e_after(1)@root.a"], "moving about inside does not restart it");
        assert_eq!(leaf_after(&mut sim, "run"), "root.b");
    }

    #[test]
    fn connector_sources_never_fire() {
        let parts = || {
            vec![
                s("a", vec![]),
                s("b", vec![]),
                c("k"),
                t("initial", "a", ""),
                t("a", "k", "e"),
                t("k", "b", "e_after(1)"),
            ]
        };
        let chart = compiled(parts());
        let mut sim = Sim::new(&chart);
        line(&mut sim, "run");
        assert!(line(&mut sim, "advance 5").queue.is_empty());
        assert!(findings(parts()).iter().any(|f| f.code.0 == "chart::timer_at_connector"));
    }
}
