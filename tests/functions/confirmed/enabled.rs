//! Events, guards, predicates, the search for a path, and conflicts, where functions decide (docs/rfsm.md §4).

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

/// Event by event in the order of the queue: the list first, then the functions in theirs; the first hit ends it.
#[test]
fn listed_events_come_before_predicates_and_earlier_events_before_later_ones() {
    run(&format!(
        "local function p(name, accepts) return function(e) say(name, e) return e == accepts end end
         {TWO} T {{ src='a', tgt='b', events={{ p('p', 'y'), 'e', p('q', 'x') }} }} }})
         rfsm.run(fsm)
         local function go(...) lines = {{}} rfsm.send_events(fsm, ...) rfsm.step(fsm) end
         go('e') eq(lines, {{}}, 'the list comes first') eq(leaf(fsm), 'root.b')
         rfsm.reset(fsm) rfsm.run(fsm) go('o', 'x', 'e') eq(lines, {{'po', 'qo', 'px', 'qx'}}) eq(leaf(fsm), 'root.b')
         rfsm.reset(fsm) rfsm.run(fsm) go('o', 'y', 'x') eq(lines, {{'po', 'qo', 'py'}})
         rfsm.reset(fsm) rfsm.run(fsm) go('x', 'e') eq(lines, {{'px', 'qx'}}, 'x is before e')"
    ));
}

#[test]
fn a_predicate_must_say_yes() {
    for (answer, to) in [("", "a"), ("return nil", "a"), ("return false", "a"), ("return 0", "b"), ("return ''", "b")] {
        run(&format!(
            "{TWO} T {{ src='a', tgt='b', events={{ function() {answer} end }} }} }})
             rfsm.step(fsm) rfsm.send_events(fsm, 'e') rfsm.step(fsm) eq(leaf(fsm), 'root.{to}')"
        ));
    }
}

/// All guards of a node run, so that they tell the order of its transitions.
#[test]
fn guards_run_in_the_order_that_luas_sort_leaves() {
    for (priorities, order) in [
        ("0, 0, 0, 0", "1 3 2 4"),
        ("0, 0, 0, 0, 0", "1 4 3 2 5"),
        ("0, 0, 0, 0, 0, 0, 0", "1 5 6 4 2 3 7"),
        ("0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0", "1 8 7 9 10 11 6 4 5 2 3 12"),
        ("0, 5, 0, 5, false, -1, 5, 0", "4 2 7 5 1 8 3 6"),
        ("-1, -1, 2", "3 2 1"),
        ("0, 0, 0", "1 2 3"),
    ] {
        run(&format!(
            "local t = S {{ a = S {{}}, b = S {{}}, T {{ src='initial', tgt='a' }} }}
             for i, pn in ipairs {{ {priorities} }} do t[#t + 1] = T {{ src='a', tgt='b', pn=pn or nil, events={{'e'}}, guard=function() say(i) return false end }} end
             local fsm = init(t) rfsm.step(fsm) lines = {{}} rfsm.send_events(fsm, 'e') rfsm.step(fsm)
             local seen = {{}} for i = 1, {} do seen[i] = lines[i] end eq(table.concat(seen, ' '), '{order}')",
            order.split(' ').count()
        ));
    }
}

/// Outside, transitions come first at equal priority; the scope they stand in decides, not the depth of their source.
#[test]
fn outer_scopes_come_before_inner_ones_in_the_list() {
    run("local function g(name) return function() say(name) return false end end
         local fsm = init(S { a = S { x = S {}, T { src='initial', tgt='x' }, T { src='x', tgt='x', guard=g 'inner' }, T { src='x', tgt='x', guard=g 'second' } },
           T { src='initial', tgt='a' }, T { src='.a.x', tgt='a', guard=g 'outer' } })
         rfsm.step(fsm) lines = {} rfsm.step(fsm) eq(lines[1]..' '..lines[2]..' '..lines[3], 'outer inner second')");
}

#[test]
fn the_outermost_way_wins_and_nothing_is_asked_further_in() {
    run("local function g(name, answer) return function() say(name) return answer end end
         local fsm = init(S { a = S { x = S {}, T { src='initial', tgt='x' }, T { src='x', tgt='x', pn=100, events={'e', 'f'}, guard=g('inner') } }, b = S {}, k = C {},
           T { src='initial', tgt='a' }, T { src='a', tgt='b', pn=-100, events={'e'}, guard=g('outer') }, T { src='a', tgt='k', events={'f'} }, T { src='k', tgt='b', events={'f'}, guard=g('far', false) } })
         rfsm.run(fsm) lines = {} rfsm.send_events(fsm, 'f') rfsm.step(fsm) eq(lines, {'far', 'outer', 'inner'}, 'a dead end outside leaves it to the inside')
         rfsm.run(fsm) lines = {} rfsm.send_events(fsm, 'e') rfsm.step(fsm) eq(lines, {'outer'}) eq(leaf(fsm), 'root.b')");
}

/// Nothing is done before all is decided: guards behind connectors see the state before.
#[test]
fn all_segments_are_decided_before_anything_is_done() {
    run("local open = false
         local fsm = init(S { a = S { exit = function() say 'a-' open = true end }, b = S {}, c = S {}, k = C {}, T { src='initial', tgt='a' },
           T { src='a', tgt='k', pn=5, events={'e'}, guard=function() say 'g1' end, effect=function() say 'e1' open = true end },
           T { src='k', tgt='b', guard=function(tr, ev) say('g2', ev[1]) return open end }, T { src='k', tgt='b', guard=function() say 'g3' return false end },
           T { src='a', tgt='c', events={'e'}, guard=function() say 'g4' end } })
         rfsm.run(fsm) lines = {} rfsm.send_events(fsm, 'e') rfsm.step(fsm)
         eq(lines, {'g1', 'g2e', 'g3', 'g4', 'a-'}, 'a dead end: the next one of the source, though of lower pn') eq(leaf(fsm), 'root.c')");
}

#[test]
fn a_circle_of_connectors_is_refused_unless_a_guard_holds_it() {
    run("local function round(guard) return S { a = S {}, b = S {}, k = C {}, l = C {}, T { src='initial', tgt='a' }, T { src='a', tgt='k', events={'e'} },
           T { src='k', tgt='l', guard=guard }, T { src='l', tgt='k' }, T { src='l', tgt='b' } } end
         eq(init(round()), false) assert(lines[#lines]:find('circle'), lines[#lines])
         local n = 0 local fsm = init(round(function() n = n + 1 return n < 3 end)) rfsm.run(fsm) rfsm.send_events(fsm, 'e') rfsm.run(fsm)
         eq(leaf(fsm), 'root.b') eq(n, 3)");
}

#[test]
fn no_event_no_null_transition() {
    run("local fsm = init(S { a = S { doo = function() while true do rfsm.yield(true) end end }, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b' } })
         rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.a') rfsm.send_events(fsm, 'any') rfsm.run(fsm) eq(leaf(fsm), 'root.b')");
}

/// At a state the first of several is taken without a word.
#[test]
fn several_ways_from_a_state_are_no_conflict() {
    run(&format!(
        "{TWO} T {{ src='a', tgt='b', events={{'e'}} }}, T {{ src='a', tgt='c', events={{'e'}} }} }})
         rfsm.run(fsm) lines = {{}} rfsm.send_events(fsm, 'e') rfsm.run(fsm) eq(leaf(fsm), 'root.b') eq(lines, {{}})"
    ));
}
