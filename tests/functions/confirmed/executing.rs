//! What functions are given and see while a transition is taken, and what becomes of their errors (rfsm.md §5).

use crate::lab::run;

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
