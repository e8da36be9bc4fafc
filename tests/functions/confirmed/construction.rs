//! `rfsm.init`: copies, printers, the early checks and their words (rfsm.md §1, §2, §3).

use crate::lab::run;

#[test]
fn events_are_compared_by_value_and_tables_by_identity() {
    run("local key = {}
         local t = S { a = S {}, b = S {}, c = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={ key } }, T { src='a', tgt='c', events={ 42, true } } }
         local fsm = init(t) rfsm.run(fsm)
         rfsm.send_events(fsm, key) rfsm.run(fsm) eq(leaf(fsm), 'root.a', 'init copied the table')
         rfsm.send_events(fsm, fsm._transitions[2].events[1]) rfsm.run(fsm) eq(leaf(fsm), 'root.b', 'the copy matches')
         local again = init(t) rfsm.run(again) rfsm.send_events(again, 42.0) rfsm.run(again) eq(leaf(again), 'root.c')
         local third = init(t) rfsm.run(third) rfsm.send_events(third, true) rfsm.run(third) eq(leaf(third), 'root.c')");
}

#[test]
fn a_doo_around_an_initial_is_refused_and_still_announced() {
    run("t = S { T { src='initial', tgt='x' }, bad = S { x = S {}, doo = function() end, T { src='initial', tgt='x' } }, x = S {} }
         t.info = say
         eq(init(t), false)
         eq(lines[1], 'INFO: created undeclared connector root.initial')
         eq(lines[2], 'ERROR: merge failed: parent root.bad defines a doo function!')
         eq(lines[3], 'INFO: created undeclared connector root.bad.initial')");
}

#[test]
fn the_checks_of_init_say_what_rfsm_says() {
    let cases = [
        ("S {}", "ERROR: fsm root without initial connector"),
        (
            "S { a = S {}, T { src='initial' } }",
            "ERROR: T={ src='initial', tgt='none', events='{}' } missing tgt state, parent='root'",
        ),
        (
            "S { a = S {}, T { src='initial', tgt='a' }, T { tgt='a', pn=2, events={'x', 'y'} } }",
            "ERROR: T={ src='none', tgt='a, pn=2', events='x, y' } missing src state, parent='root'",
        ),
        (
            "S { a = S {}, T { src='initial', tgt='a', events=3 } }",
            "ERROR: T={ src='initial', tgt='a', events='{}' } 'events' field must be a table",
        ),
        (
            "S { a = S {}, T { src='initial', tgt='b' } }",
            "ERROR: resolving tgt failed T={ src='root.initial', tgt='b', events='{}' }: no b in root|ERROR: failed to resolve transitions of fsm root",
        ),
        ("S { a = S {}, T { src='initial', tgt='root.lighthouse.lamp' } }", ": no lighthouse in lighthouse"),
        ("S { a = S {}, T { src='initial', tgt='.dock' } }", ": no dock in |"),
        (
            "S { a = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='internal' } }",
            "ERROR: internal events not supported (yet?)",
        ),
        ("S { a = S { b = S {} }, T { src='initial', tgt='a' } }", "ends on composite state without initial connector"),
    ];
    for (model, said) in cases {
        run(&format!(
            "eq(init({model}), false) local all = table.concat(lines, '|') .. '|'
             assert(all:find([[{said}]], 1, true), 'said: ' .. all)"
        ));
    }
}

#[test]
fn warnings_do_not_fail_init() {
    run("local fsm = init(S { a = S {}, T { src='initial', tgt='a', event='e' } })
         assert(fsm) assert(lines[1]:find(\"WARNING: T={ src='initial', tgt='a', events='{}' } 'event' field has no meaning, did you mean 'events'?\", 1, true), lines[1])
         eq(lines[2], \"WARNING: no outgoing transitions from node 'root.a'\")");
}

#[test]
fn a_composite_with_a_doo_is_told_and_the_machine_runs() {
    run("local ran = false
         local fsm = init(S { c = S { x = S {}, initial = C {}, doo = function() ran = true end, T { src='initial', tgt='x' } }, T { src='initial', tgt='c' } })
         eq(lines[1], 'ERROR: doo not permitted in composite states: root.c') assert(fsm)
         rfsm.run(fsm) eq(leaf(fsm), 'root.c.x') eq(ran, false)");
}

#[test]
fn printers_are_chosen_at_the_root() {
    run("local fsm = rfsm.init(S { err = false, warn = true, info = 7, a = S { err = say }, T { src='initial', tgt='a' } })
         fsm.err('nothing') fsm.warn('loud') eq(type(fsm.info), 'function')");
}

#[test]
fn a_template_is_reusable_and_functions_are_shared() {
    run("local n = 0
         local t = S { a = S { entry = function(f, s) s.count = (s.count or 0) + 1 n = n + 1 end }, T { src='initial', tgt='a' } }
         local one, two = init(t), init(t) rfsm.run(one) rfsm.run(two)
         eq(n, 2) eq(one.a.count, 1) eq(two.a.count, 1) eq(t.a.count, nil) assert(one.a ~= two.a)");
}
