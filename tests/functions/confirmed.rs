//! What was confirmed of rFSM by probes (rfsm.md, marked there) as far as functions, the checks of `init` and the API are
//! concerned, and the gaps of its own tests. What the engine does without functions is in `tests/statechart/confirmed.rs`.

use super::lab::run;

mod construction {
    use super::run;

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
            (
                "S { a = S { b = S {} }, T { src='initial', tgt='a' } }",
                "ends on composite state without initial connector",
            ),
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
}

mod enabled {
    use super::run;

    const TWO: &str = "local fsm = init(S { a = S {}, b = S {}, c = S {}, T { src='initial', tgt='a' }, ";

    #[test]
    fn a_guard_that_answers_nothing_says_yes() {
        for (answer, to) in
            [("", "b"), ("return nil", "b"), ("return 0", "b"), ("return true", "b"), ("return false", "a")]
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
}

mod executing {
    use super::run;

    #[test]
    fn what_functions_see_while_a_transition_is_under_way() {
        run("local function see(f, s, w) say(w, ' ', tostring(leaf(f)), ' ', table.concat(rfsm.get_active_conf(f), ','), ' ', w == 'effect' and '' or rfsm.get_sta_mode(s)) end
             local fsm = init(S { a = S { exit = see }, b = S { entry = see }, T { src='initial', tgt='a' },
               T { src='a', tgt='b', events={'e'}, effect=see } })
             rfsm.run(fsm) lines = {} rfsm.send_events(fsm, 'e') rfsm.run(fsm)
             eq(lines[1], 'exit root.a root inactive') eq(lines[2], 'effect false root ') eq(lines[3], 'entry false root,root.b active')");
    }

    #[test]
    fn errors_of_entry_exit_and_effect_are_told_and_abort_nothing() {
        run("local function bad() error('oh', 0) end
             local fsm = init(S { a = S { exit = bad }, b = S { entry = bad }, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'}, effect=bad } })
             rfsm.run(fsm) lines = {} rfsm.send_events(fsm, 'e') rfsm.run(fsm) eq(leaf(fsm), 'root.b') eq(rfsm.get_sta_mode(fsm.b), 'done')
             eq(lines[1]:sub(1, 4), 'EXIT') eq(lines[2]:sub(1, 6), 'EFFECT') eq(lines[3]:sub(1, 5), 'ENTRY')
             for i = 1, 3 do eq(lines[i]:sub(-4), ': oh') end");
    }

    #[test]
    fn events_sent_on_entry_come_before_the_completion() {
        run("local sets = {}
             local fsm = init(S { a = S { entry = function(f) rfsm.send_events(f, 'mine') end }, T { src='initial', tgt='a' } })
             rfsm.pre_step_hook_add(fsm, function(f, e) sets[#sets+1] = table.concat(e, ',') end)
             rfsm.run(fsm) eq(sets[2], 'mine,e_done@root.a')");
    }

    #[test]
    fn a_failed_entry_loses_the_events_and_runs_no_post_hook() {
        run("local open = false local n = 0
             local fsm = init(S { a = S {}, entry = function() say 'root+' end, T { src='initial', tgt='a', guard=function() say 'guard' return open end } })
             rfsm.post_step_hook_add(fsm, function() n = n + 1 end) lines = {}
             eq(rfsm.run(fsm), false) eq(n, 0)
             eq(lines, {'guard', 'ERROR: failed to enter fsm root root, no valid path from root.initial'})
             open = true lines = {} eq(rfsm.run(fsm), true) eq(lines, {'guard', 'root+'})");
    }
}

mod stepping {
    use super::run;

    #[test]
    fn hooks_may_append_events_to_the_set() {
        run("local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'extra'} } })
             rfsm.run(fsm) rfsm.pre_step_hook_add(fsm, function(f, e) e[#e+1] = 'extra' end) rfsm.step(fsm) eq(leaf(fsm), 'root.b')");
    }

    #[test]
    fn errors_of_hooks_end_the_step() {
        run("local fsm = init(S { a = S {}, T { src='initial', tgt='a' } })
             for _, which in ipairs { 'pre', 'post' } do
               local function bad() error('hook', 0) end
               rfsm[which .. '_step_hook_add'](fsm, bad)
               local ok, why = pcall(rfsm.step, fsm) eq(ok, false) assert(tostring(why):find('hook'), tostring(why))
               rfsm[which .. '_step_hook_rm'](fsm, bad) assert(rfsm.run(fsm) ~= nil)
             end");
    }

    #[test]
    fn an_endless_run_is_ended() {
        run("local fsm = init(S { getevents = function() return { 'nothing' } end, a = S {}, T { src='initial', tgt='a' } })
             eq(rfsm.run(fsm), false, 'rFSM would never return')");
    }

    #[test]
    fn events_from_outside_are_merged_and_counted() {
        run("local outside = {}
             local fsm = init(S { getevents = function() local e = outside outside = {} return e end, a = S {}, b = S {},
               T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'} } })
             rfsm.run(fsm) outside = { 'x', 'y' } eq(rfsm.check_events(fsm), 2) eq(rfsm.check_events(fsm), 2)
             outside = { 'e' } rfsm.run(fsm) eq(leaf(fsm), 'root.b')");
    }

    #[test]
    fn an_idle_hook_goes_on() {
        run("local n = 0
             local fsm fsm = init(S { idle_hook = function(f) n = n + 1 if n == 3 then error('enough', 0) end end, a = S {}, T { src='initial', tgt='a' } })
             eq(pcall(rfsm.run, fsm), false) eq(n, 3)");
    }

    #[test]
    fn sending_takes_arguments_up_to_the_first_nil_and_needs_a_machine() {
        run("local fsm = init(S { a = S {}, T { src='initial', tgt='a' } }) rfsm.run(fsm)
             rfsm.send_events(fsm, 'x', nil, 'y') eq(rfsm.check_events(fsm), 1)
             local ok, why = pcall(rfsm.send_events, S {}, 'x') eq(ok, false) assert(why:find('ERROR send_events: invalid fsm argument', 1, true))");
    }

    #[test]
    fn a_doo_that_fails_completes_nothing() {
        run("local fsm = init(S { a = S { doo = function() error('broken', 0) end }, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e_done'} } })
             lines = {} eq(rfsm.run(fsm), true) eq(leaf(fsm), 'root.a') eq(rfsm.get_sta_mode(fsm.a), 'done')
             eq(lines, {\"DOOdoo program of state 'root.a' failed: broken\"})");
    }

    #[test]
    fn event_sets_of_a_doo_that_yields_once() {
        run("local sets = {}
             local fsm = init(S { a = S { doo = function() rfsm.yield() end }, T { src='initial', tgt='a' } })
             rfsm.pre_step_hook_add(fsm, function(f, e) sets[#sets+1] = '{' .. table.concat(e, ',') .. '}' end)
             rfsm.run(fsm) eq(table.concat(sets, ' '), '{e_init_fsm} {} {} {e_done@root.a} {}')");
    }

    #[test]
    fn a_null_transition_takes_its_own_completion() {
        run(
            "local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b' } }) rfsm.run(fsm) eq(leaf(fsm), 'root.b')",
        );
    }

    #[test]
    fn completion_is_never_raised_for_a_composite() {
        run("local fsm = init(S { c = S { x = S {}, T { src='initial', tgt='x' } }, b = S {}, T { src='initial', tgt='c' }, T { src='c', tgt='b', events={'e_done'} } })
             rfsm.run(fsm) eq(leaf(fsm), 'root.c.x') rfsm.send_events(fsm, 'e_done@root.c') rfsm.run(fsm) eq(leaf(fsm), 'root.b', 'from outside it can be sent')");
    }

    #[test]
    fn only_the_last_of_two_time_events_of_a_state_comes() {
        run("local te = require 'rfsm.timeevent' local now = 0 te.set_gettime_hook(function() return now end)
             local fsm = init(S { a = S {}, b = S {}, c = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={ te.e_after(1) } }, T { src='a', tgt='c', events={ te.e_after(3) } } })
             rfsm.run(fsm) now = 2e9 rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.a') now = 4e9 rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.c')");
    }
}

mod api {
    use super::run;

    #[test]
    fn maps_and_names() {
        run("local fsm = init(S { a = S { x = S {}, T { src='initial', tgt='x' } }, T { src='initial', tgt='a' } })
             local all = rfsm.mapfsm(function(o, scope, name) return rfsm.fsmobj_tochar(o) end, fsm) table.sort(all)
             eq(all, {'CS', 'LS', 'TR', 'TR', 'c', 'c'})
             eq(rfsm.map_from_to(fsm, function(f, s) return s._fqn end, fsm.a.x, fsm), {'root.a.x', 'root.a', 'root'})
             rfsm.run(fsm) eq(rfsm.actchild_get(fsm), fsm.a) eq(rfsm.actchild_get(fsm.a), fsm.a.x)
             assert(rfsm.is_leaf(fsm.a.x) and rfsm.is_composite(fsm.a) and rfsm.is_conn(fsm.initial) and rfsm.is_root(fsm))");
    }

    #[test]
    fn constructors_mark_and_return_their_argument() {
        run("local t = {} eq(rfsm.state(t), t) eq(t:type(), 'state') local u = {} eq(rfsm.trans:new(u), u) eq(u:type(), 'transition')
             assert(rfsm.state == rfsm.sista and rfsm.sista == rfsm.composite_state and rfsm.trans == rfsm.transition and rfsm.conn == rfsm.connector)
             eq(rfsm.yield, coroutine.yield)");
    }

    #[test]
    fn likely_targets_prepare_themselves() {
        run("require 'rfsm.preview' local soon = false
             local fsm = init(S { a = S {}, b = S { prepare = function() say 'prepared' end }, T { src='initial', tgt='a' },
               T { src='a', tgt='b', events={'e'}, likely=function() return soon end } })
             rfsm.run(fsm) lines = {} rfsm.step(fsm) eq(lines, {}) soon = true rfsm.step(fsm) eq(lines, {'prepared'})
             eq(pcall(init, S { a = S { prepare = 1 }, T { src='initial', tgt='a' } }), false)");
    }
}
