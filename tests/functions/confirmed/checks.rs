//! The early checks of `rfsm.init`, what fails and what only warns, and their words (docs/rfsm.md §2.6 to §2.8).

use crate::lab::run;

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
fn a_failed_composite_check_leaves_out_the_later_ones_and_fails_nothing() {
    run("local fsm = init(S { c = S { x = S {}, initial = C {}, doo = function() say 'doo' end, T { src='initial', tgt='x' },
             T { src='x', tgt='x', event='e' } }, T { src='initial', tgt='c' } })
         assert(fsm, 'told, and made') eq(lines[1], 'ERROR: doo not permitted in composite states: root.c')
         for _, line in ipairs(lines) do assert(not line:find('has no meaning'), line) end
         rfsm.run(fsm) eq(leaf(fsm), 'root.c.x')");
}

/// Its check was left out, so it is found when the references are resolved.
#[test]
fn a_missing_end_after_a_failed_composite_check_is_an_error_of_lua() {
    for trans in ["T { src='a' }", "T { tgt='a' }"] {
        run(&format!(
            "local ok = pcall(init, S {{ a = S {{}}, c = S {{ x = S {{}}, initial = C {{}}, doo = function() end, T {{ src='initial', tgt='x' }} }},
               T {{ src='initial', tgt='a' }}, {trans} }})
             eq(ok, false) eq(lines, {{'ERROR: doo not permitted in composite states: root.c'}})"
        ));
    }
}

#[test]
fn a_composites_initial_that_is_no_connector_is_told_with_the_parents_name() {
    run("local fsm = init(S { harbour = S { initial = S {}, dock = S {}, T { src='dock', tgt='initial', events={'e'} } }, T { src='initial', tgt='harbour' } })
         assert(fsm, 'told, and made')
         assert(lines[1]:find('ERROR: in composite root.initial is not of type connector but ', 1, true), lines[1])
         rfsm.run(fsm) eq(leaf(fsm), 'root.harbour.initial')");
}

#[test]
fn stages_hide_later_ones_and_within_a_stage_all_is_told() {
    run("eq(init(S { a = S { x = S {}, doo = function() end }, T { src='a' }, T { tgt='a' } }), false)
         eq(lines, {'ERROR: fsm root without initial connector'})
         local calls = 0
         eq(rfsm.init(S { err = function(text) calls = calls + 1 lines = { text } end, warn = false, info = false, a = S {},
           T { src='initial', tgt='a' }, T { src='a' }, T { tgt='a', events=1, event='e' } }), false)
         eq(calls, 1, 'all of one stage are one text')
         local texts = {} for text in lines[1]:gmatch('[^\\n]+') do texts[#texts + 1] = text end
         eq(texts, { \"ERROR: T={ src='a', tgt='none', events='{}' } missing tgt state, parent='root'\",
           \"ERROR: T={ src='none', tgt='a', events='{}' } missing src state, parent='root'\",
           \"ERROR: T={ src='none', tgt='a', events='{}' } 'events' field must be a table\",
           \"WARNING: T={ src='none', tgt='a', events='{}' } 'event' field has no meaning, did you mean 'events'?\" })");
}

#[test]
fn nodes_without_a_way_out_are_warned_of_and_the_root_is_not() {
    run("assert(init(S { a = S { x = S {}, T { src='initial', tgt='x' } }, c = C {}, T { src='initial', tgt='a' }, T { src='a', tgt='c', events={'e'} } }))
         table.sort(lines) eq(lines, { \"WARNING: no outgoing transitions from node 'root.a.x'\", \"WARNING: no outgoing transitions from node 'root.c'\" })");
}
