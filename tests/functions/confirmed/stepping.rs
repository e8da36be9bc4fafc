//! `step`, `run`, `send_events`, `getevents`, hooks, and activities (docs/rfsm.md §6, §7).

use crate::lab::{run, told};

#[test]
fn hooks_may_append_events_to_the_set() {
    run("local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'extra'} } })
         rfsm.run(fsm) rfsm.pre_step_hook_add(fsm, function(f, e) e[#e+1] = 'extra' end) rfsm.step(fsm) eq(leaf(fsm), 'root.b')");
}

/// The table is the set itself: what a hook takes out or puts in its place is gone or there.
#[test]
fn hooks_may_change_the_set_in_any_way() {
    run("local change
         local fsm = init(S { a = S {}, b = S {}, c = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'} }, T { src='a', tgt='c', events={'f'},
           effect=function(f, tr, w, e) say(table.concat(e, ',')) end } })
         rfsm.pre_step_hook_add(fsm, function(f, e) if change then change(e) end end)
         rfsm.post_step_hook_add(fsm, function(f, e) if change then say('post ', table.concat(e, ',')) end end)
         rfsm.run(fsm)
         local function go(how, ...) change = how lines = {} rfsm.send_events(fsm, ...) rfsm.step(fsm) change = nil return leaf(fsm) end
         eq(go(function(e) table.remove(e, 1) end, 'e'), 'root.a', 'taken out: nothing to do') eq(lines, {'post '})
         eq(go(function(e) e[1] = 'x' end, 'e'), 'root.a') eq(lines[1], 'post x')
         eq(go(function(e) table.insert(e, 1, 'f') e[3] = nil e[2] = 'y' end, 'e', 'z'), 'root.c') eq(lines, {'f,y', 'post f,y'})");
}

/// Nothing of the step is done.
#[test]
fn an_error_before_the_step_leaves_the_state_as_it_was() {
    run("local fails = false
         local fsm = init(S { getevents = function(...) eq(select('#', ...), 0) if fails == 'out' then error('outside', 0) end return {} end, a = S {}, b = S {},
           T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'} } })
         rfsm.pre_step_hook_add(fsm, function() if fails == 'hook' then error('hook', 0) end end)
         rfsm.post_step_hook_add(fsm, function() say 'post' end)
         rfsm.run(fsm)
         for _, which in ipairs { 'hook', 'out' } do
           fails = which lines = {} rfsm.send_events(fsm, 'e') local ok, why = pcall(rfsm.step, fsm)
           eq(ok, false) assert(tostring(why):find(which), tostring(why)) eq(leaf(fsm), 'root.a') eq(lines, {}, which)
           eq(pcall(rfsm.check_events, fsm), which == 'hook') fails = false rfsm.reset(fsm) rfsm.run(fsm)
         end");
}

#[test]
fn stepping_what_is_no_machine_is_told() {
    for call in ["rfsm.step(S {})", "rfsm.run(S {})", "rfsm.run(S { a = S {}, T { src='initial', tgt='a' } })"] {
        let said = told(&format!("eq(pcall(function() {call} end), false)"));
        assert_eq!(said, ["Err ERROR step: invalid fsm"], "{call}");
    }
}

/// `init` writes out whose completion it is.
#[test]
fn a_literal_completion_is_that_of_the_source() {
    run("local shared = { 'e_done', 'e' }
         local fsm = init(S { a = S { x = S {}, T { src='initial', tgt='x' } }, b = S {}, k = C {}, T { src='initial', tgt='a' }, T { src='a', tgt='k', events=shared },
           T { src='k', tgt='b', events='e_done' }, T { src='b', tgt='a', events={'e_done@root.a', 'f'}, guard=function(tr) say(tr.events[1]) end }, T { src='.a.x', tgt='b', events=shared } })
         local seen = {} for i, tr in ipairs(fsm._transitions) do seen[i] = table.concat(tr.events or {}, ' ') end table.sort(seen)
         eq(table.concat(seen, ', '), ', , e_done@root.a e, e_done@root.a f, e_done@root.a.x e, e_done@root.k')
         eq(shared[1], 'e_done', 'the template is as it was') rfsm.run(fsm) eq(leaf(fsm), 'root.b')
         eq(require('rfsm.marsh').model2tab(fsm).transitions[3].events, { 'e_done@root.k' })");
}

/// What it sends is there at once.
#[test]
fn an_idle_hook_may_send() {
    run("local fsm fsm = init(S { idle_hook = function(f) eq(f, fsm) rfsm.send_events(f, 'e') if leaf(f) == 'root.b' then error('enough', 0) end end,
           a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'} } })
         eq(pcall(rfsm.run, fsm), false) eq(leaf(fsm), 'root.b')");
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
    for guard in ["nil", "function(tr, e) eq(e, { 'e_done@root.a' }) end"] {
        run(&format!(
            "local fsm = init(S {{ a = S {{}}, b = S {{ doo = function() rfsm.yield(true) end }}, T {{ src='initial', tgt='a' }}, T {{ src='a', tgt='b', guard={guard} }} }})
             rfsm.step(fsm) eq(leaf(fsm), 'root.a') rfsm.step(fsm) eq(leaf(fsm), 'root.b')"
        ));
    }
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

#[test]
fn a_step_takes_all_that_waits_and_keeps_nothing() {
    run("local sets, outside = {}, {}
         local fsm = init(S { getevents = function() local e = outside outside = {} return e end, a = S {}, b = S {}, c = S {}, T { src='initial', tgt='a' },
           T { src='a', tgt='b', events={'e1'} }, T { src='b', tgt='c', events={'e2'} } })
         rfsm.pre_step_hook_add(fsm, function(f, e) sets[#sets+1] = table.concat(e, ',') end)
         rfsm.run(fsm) sets = {} outside = { 'e2', 'x', nil, 'y' } rfsm.send_events(fsm, 'own', 'e1') eq(rfsm.step(fsm), false)
         eq(sets, {'own,e1,e2,x'}, 'the inside first; outside up to the first nil') eq(leaf(fsm), 'root.b', 'one transition')
         rfsm.run(fsm) eq(leaf(fsm), 'root.b', 'e2 was not kept')");
}

/// What `check_events` found outside waits inside for the next step.
#[test]
fn a_second_look_outside_keeps_what_it_finds() {
    run("local answers = { {}, { 'e' } }
         local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'} },
           getevents = function() return table.remove(answers, 1) or {} end })
         answers = {} rfsm.run(fsm) answers = { {}, { 'e' } } eq(rfsm.step(fsm), false, 'not idle') eq(leaf(fsm), 'root.a')
         rfsm.step(fsm) eq(leaf(fsm), 'root.b')");
}

#[test]
fn an_unmatched_event_goes_on_into_the_doo() {
    run("local n = 0
         local fsm = init(S { a = S { doo = function() while true do n = n + 1 rfsm.yield(n == 2) end end }, T { src='initial', tgt='a' } })
         rfsm.step(fsm) eq(n, 0) rfsm.send_events(fsm, 'other') eq(rfsm.step(fsm), false, 'busy') eq(n, 1)
         rfsm.send_events(fsm, 'other') eq(rfsm.step(fsm), true, 'idle') eq(n, 2)");
}

#[test]
fn hooks_are_called_in_every_turn_with_its_set() {
    run("local fsm = init(S { a = S {}, T { src='initial', tgt='a' } })
         rfsm.pre_step_hook_add(fsm, function(f, e) say('pre', f == fsm, ' ', table.concat(e, ',')) end)
         rfsm.post_step_hook_add(fsm, function(f, e) say('post', f == fsm, ' ', table.concat(e, ',')) end)
         lines = {} rfsm.run(fsm)
         eq(lines, { 'pretrue e_init_fsm', 'posttrue e_init_fsm', 'pretrue e_done@root.a', 'posttrue e_done@root.a', 'pretrue ', 'posttrue ' })");
}

#[test]
fn what_a_doo_yields_says_whether_it_rests() {
    for (yields, idle) in [("true", true), ("'x'", true), ("0", true), ("", false), ("nil", false), ("false", false)] {
        run(&format!(
            "local fsm = init(S {{ a = S {{ doo = function() while true do rfsm.yield({yields}) end end }}, T {{ src='initial', tgt='a' }} }})
             rfsm.step(fsm) eq(rfsm.step(fsm), {idle}) eq(rfsm.step(fsm, 3), {idle}) eq(rfsm.get_sta_mode(fsm.a), 'active')"
        ));
    }
    // One that returns is through, whatever it returns, and its completion keeps the step from being idle.
    run("local n = 0 local fsm = init(S { a = S { doo = function() n = n + 1 return true end }, T { src='initial', tgt='a' } })
         rfsm.step(fsm) eq(rfsm.step(fsm), false) eq(rfsm.get_sta_mode(fsm.a), 'done') eq(rfsm.check_events(fsm), 1) eq(rfsm.run(fsm), true) eq(n, 1)");
}

#[test]
fn modes_of_composites_know_no_done() {
    run("local fsm = init(S { a = S { x = S {}, T { src='initial', tgt='x' } }, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'} } })
         local function modes() return { rfsm.get_sta_mode(fsm), rfsm.get_sta_mode(fsm.a), rfsm.get_sta_mode(fsm.a.x), rfsm.get_sta_mode(fsm.b) } end
         eq(modes(), { 'inactive', 'inactive', 'inactive', 'inactive' }) rfsm.run(fsm) eq(modes(), { 'active', 'active', 'done', 'inactive' })
         rfsm.send_events(fsm, 'e') rfsm.run(fsm) eq(modes(), { 'active', 'inactive', 'inactive', 'done' })
         rfsm.reset(fsm) eq(modes(), { 'inactive', 'inactive', 'inactive', 'inactive' })");
}

#[test]
fn a_reset_drops_the_activity_and_begins_it_cold() {
    run("local begun = 0
         local fsm = init(S { a = S { doo = function() begun = begun + 1 while true do rfsm.yield(true) end end }, T { src='initial', tgt='a' } })
         rfsm.run(fsm) rfsm.run(fsm) eq(begun, 1) rfsm.reset(fsm) eq(rfsm.get_active_conf(fsm), {}) eq(leaf(fsm), false) rfsm.run(fsm) eq(begun, 2)");
}

#[test]
fn completion_from_a_connector_never_comes() {
    run("local fsm = init(S { a = S {}, b = S {}, k = C {}, T { src='initial', tgt='a' }, T { src='a', tgt='k', events={'e', 'e_done'} }, T { src='k', tgt='b', events={'e_done'} } })
         rfsm.run(fsm) eq(leaf(fsm), 'root.a') rfsm.send_events(fsm, 'e', 'e_done') rfsm.run(fsm) eq(leaf(fsm), 'root.a')
         rfsm.send_events(fsm, 'e', 'e_done@root.k') rfsm.run(fsm) eq(leaf(fsm), 'root.b', 'but may be sent')");
}

#[test]
fn as_many_steps_as_were_asked_for() {
    run("local n = 0 local fsm = init(S { a = S { doo = function() while true do n = n + 1 rfsm.yield() end end }, T { src='initial', tgt='a' } })
         rfsm.step(fsm) eq(rfsm.step(fsm, 12000), false) eq(n, 12000) eq(rfsm.step(fsm, 0), false) eq(n, 12001, 'none is one')");
}
