//! Events, guards, predicates, and conflicts (rfsm.md §4).

use crate::lab::run;

const TWO: &str = "local fsm = init(S { a = S {}, b = S {}, c = S {}, T { src='initial', tgt='a' }, ";

#[test]
fn a_guard_that_answers_nothing_says_yes() {
    for (answer, to) in [("", "b"), ("return nil", "b"), ("return 0", "b"), ("return true", "b"), ("return false", "a")]
    {
        run(&format!(
            "{TWO} T {{ src='a', tgt='b', events={{'e'}}, guard=function() {answer} end }} }})
             rfsm.run(fsm) rfsm.send_events(fsm, 'e') rfsm.run(fsm) eq(leaf(fsm), 'root.{to}')"
        ));
    }
}

#[test]
fn guards_run_on_events_that_do_not_match_and_all_of_them_run() {
    run(&format!("{TWO} T {{ src='a', tgt='b', events={{'e'}}, guard=function(tr, ev) say('b', ev[1]) end }},
            T {{ src='a', tgt='c', events={{'e'}}, guard=function(tr, ev) say('c', ev[1]) end }} }})
         lines = {{}} rfsm.run(fsm) lines = {{}} rfsm.send_events(fsm, 'other') rfsm.step(fsm) eq(lines, {{'bother', 'cother'}})
         lines = {{}} rfsm.send_events(fsm, 'e') rfsm.step(fsm) eq(lines, {{'be', 'ce'}}) eq(leaf(fsm), 'root.b')"));
}

#[test]
fn a_guard_that_fails_says_no_and_is_told() {
    run(&format!(
        "{TWO} T {{ src='a', tgt='b', events={{'e'}}, guard=function() error('bad guard', 0) end }} }})
         rfsm.run(fsm) lines = {{}} rfsm.send_events(fsm, 'e') rfsm.run(fsm) eq(leaf(fsm), 'root.a')
         eq(lines[1], \"GUARDerror executing guard of T={{ src='root.a', tgt='root.b', events='e' }}: bad guard\")"
    ));
}

#[test]
fn a_predicate_that_fails_is_no_match() {
    run(&format!(
        "{TWO} T {{ src='a', tgt='b', events={{ function() error 'x' end }} }} }})
         rfsm.run(fsm) rfsm.send_events(fsm, 'e') eq(rfsm.run(fsm), true) eq(leaf(fsm), 'root.a')"
    ));
}

#[test]
fn an_unmatched_event_does_not_count_as_a_step() {
    run(&format!(
        "{TWO} T {{ src='a', tgt='b', events={{'e'}} }} }})
         rfsm.run(fsm) local n = 0 rfsm.post_step_hook_add(fsm, function() n = n + 1 end)
         rfsm.send_events(fsm, 'other') eq(rfsm.step(fsm, 1), true) eq(n, 2, 'the unmatched turn and an idle one')
         rfsm.send_events(fsm, 'e') n = 0 eq(rfsm.step(fsm, 1), false) eq(n, 1)"
    ));
}

#[test]
fn conflicts_are_warned_of_with_their_targets() {
    run("local fsm = init(S { a = S {}, b = S {}, c = S {}, x = C {}, T { src='initial', tgt='a' }, T { src='a', tgt='x', events={'e'} },
           T { src='x', tgt='b' }, T { src='x', tgt='c' } })
         rfsm.run(fsm) lines = {} rfsm.send_events(fsm, 'e') rfsm.run(fsm) eq(leaf(fsm), 'root.b')
         eq(lines[1], 'conflicting transitions from src root.x to') eq(lines[2], '\\troot.b') eq(lines[3], '\\troot.c')");
}
