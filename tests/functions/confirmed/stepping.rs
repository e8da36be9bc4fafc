//! `step`, `run`, `send_events`, `getevents`, hooks, and activities (rfsm.md §6, §7).

use crate::lab::run;

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
