//! Time events (docs/rfsm.md §9).

use crate::lab::run;

const CLOCK: &str = "local te = require 'rfsm.timeevent' local now = 0 te.set_gettime_hook(function() return now end)
    local function tick(s) now = now + s * 1e9 end
    local function made(from) return init(S { a = S { x = S {}, y = S {}, T { src='initial', tgt='x' }, T { src='x', tgt='y', events={'e'} } }, b = S {}, c = C {},
      T { src='initial', tgt='a' }, T { src='a', tgt='b', events=from }, T { src='b', tgt='a', events={'back'} } }) end\n";

/// Its hook runs after the step said whether it is idle.
#[test]
fn a_time_event_waits_for_the_next_run_though_this_one_was_idle() {
    run(&format!(
        "{CLOCK} local fsm = made {{ te.e_after(2) }} rfsm.run(fsm)
         now = 2e9 eq(rfsm.run(fsm), true) eq(rfsm.check_events(fsm), 0, 'more than two seconds, not two')
         now = 2e9 + 1 eq(rfsm.run(fsm), true) eq(leaf(fsm), 'root.a.x') eq(rfsm.check_events(fsm), 1)
         eq(rfsm.run(fsm), true) eq(leaf(fsm), 'root.b')"
    ));
}

#[test]
fn a_time_event_is_called_by_its_id_and_its_source() {
    for (made, name) in [
        ("te.e_after(1)", "e_after(1)@root.a"),
        ("te.e_after(1.0)", "e_after(1.0)@root.a"),
        ("te.e_after(1, 'soon')", "e_after(soon)@root.a"),
        ("te.e_after(function() return 1 end, 'f')", "e_after(f)@root.a"),
        ("te.e_at(0.5, 7)", "e_at(7)@root.a"),
        ("'e_after(1)'", "e_after(1)@root.a"),
        ("'e_at(1)'", "e_at(1)@root.a"),
    ] {
        run(&format!(
            "{CLOCK} local fsm = made {{ {made} }} local seen = {{}}
             rfsm.pre_step_hook_add(fsm, function(f, e) for _, x in ipairs(e) do seen[x] = true end end)
             rfsm.run(fsm) tick(1.5) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.b') assert(seen['{name}'], '{name}')"
        ));
        // From outside the whole name does the same.
        run(&format!(
            "{CLOCK} local fsm = made {{ {made} }} rfsm.run(fsm) rfsm.send_events(fsm, '{name}') rfsm.run(fsm) eq(leaf(fsm), 'root.b')"
        ));
    }
}

#[test]
fn composites_have_time_events_and_connectors_have_none() {
    run(&format!(
        "{CLOCK} local fsm = made {{ te.e_after(2) }} rfsm.run(fsm) tick(1.5) rfsm.send_events(fsm, 'e') rfsm.run(fsm) eq(leaf(fsm), 'root.a.y')
         tick(1) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.b', 'moving about inside does not restart it')
         local other = init(S {{ a = S {{}}, b = S {{}}, k = C {{}}, T {{ src='initial', tgt='a' }}, T {{ src='a', tgt='k', events={{'e'}} }},
           T {{ src='k', tgt='b', events={{ te.e_after(0) }} }} }})
         rfsm.run(other) tick(9) rfsm.run(other) rfsm.run(other) eq(leaf(other), 'root.a')
         rfsm.send_events(other, 'e') rfsm.run(other) eq(leaf(other), 'root.a')"
    ));
}

#[test]
fn it_fires_once_a_visit_and_only_the_last_written_one() {
    run(&format!(
        "{CLOCK} local n = 0
         local fsm = made {{ te.e_after(1), te.e_after(2) }}
         rfsm.pre_step_hook_add(fsm, function(f, e) for _, x in ipairs(e) do if x:find('^e_after') then n = n + 1 end end end)
         rfsm.run(fsm) tick(1.5) rfsm.run(fsm) rfsm.run(fsm) eq(n, 0, 'the first one is overwritten') eq(leaf(fsm), 'root.a.x')
         tick(1) for i = 1, 5 do rfsm.run(fsm) end eq(n, 1) eq(leaf(fsm), 'root.b')
         local stays = init(S {{ a = S {{}}, T {{ src='initial', tgt='a' }}, T {{ src='a', tgt='a', events={{ te.e_after(1) }}, guard=function() return false end }} }})
         n = 0 rfsm.pre_step_hook_add(stays, function(f, e) for _, x in ipairs(e) do if x:find('^e_after') then n = n + 1 end end end)
         rfsm.run(stays) for i = 1, 5 do tick(5) rfsm.run(stays) rfsm.run(stays) end eq(n, 1)"
    ));
}

#[test]
fn two_time_events_of_two_transitions_leave_the_later_written() {
    run(&format!(
        "{CLOCK} local fsm = init(S {{ a = S {{}}, b = S {{}}, c = S {{}}, T {{ src='initial', tgt='a' }}, T {{ src='a', tgt='b', events={{ te.e_after(2) }} }},
           T {{ src='a', tgt='c', events={{ te.e_after(1) }} }} }})
         rfsm.run(fsm) tick(1.5) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.c', 'later written, not sooner due')"
    ));
}

/// What the user's entry does takes no time off it, and a function is asked anew.
#[test]
fn it_begins_before_the_entry_of_its_state() {
    run(&format!(
        "{CLOCK} local wait = 2
         local fsm = init(S {{ a = S {{ entry = function() tick(1) wait = 50 end }}, b = S {{}}, T {{ src='initial', tgt='a' }},
           T {{ src='a', tgt='b', events={{ te.e_after(function() return wait end, 'w') }} }} }})
         rfsm.run(fsm) tick(1.5) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.b')"
    ));
}

#[test]
fn e_at_counts_from_the_clocks_beginning() {
    run(&format!(
        "{CLOCK} tick(5) local fsm = made {{ te.e_at(7) }} rfsm.run(fsm) now = 7e9 rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.a.x')
         now = 7e9 + 1 rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.b') rfsm.send_events(fsm, 'back') rfsm.run(fsm) rfsm.run(fsm)
         eq(leaf(fsm), 'root.b', 'long past')"
    ));
}

#[test]
fn a_function_that_says_the_time_is_given_the_id() {
    run(&format!(
        "{CLOCK} local fsm = made {{ te.e_after(function(...) say(select('#', ...), ...) return 2 end, 'warm') }} lines = {{}} rfsm.run(fsm)
         eq(lines[1], '1warm') tick(2.5) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.b')"
    ));
}

#[test]
fn dbg_is_told_of_a_time_event() {
    run(&format!(
        "{CLOCK} local fsm = made {{ te.e_after(2) }} rfsm.run(fsm) tick(3) fsm.dbg = function(tag, ...) say(tag, ' ', ...) end lines = {{}} rfsm.run(fsm)
         assert(lines[1]:find('^TIMEEVENT .*e_after%(2%)@root.a$') and lines[2] == 'RAISED e_after(2)@root.a', table.concat(lines, '|'))"
    ));
}

#[test]
fn of_several_that_are_due_the_leafs_comes_first() {
    run(&format!(
        "{CLOCK} local fsm = init(S {{ a = S {{ x = S {{}}, T {{ src='initial', tgt='x' }}, T {{ src='x', tgt='x', events={{ te.e_after(2) }} }} }}, b = S {{}},
           T {{ src='initial', tgt='a' }}, T {{ src='a', tgt='b', events={{ te.e_after(1) }} }} }})
         rfsm.run(fsm) local sets = {{}} rfsm.pre_step_hook_add(fsm, function(f, e) sets[#sets + 1] = table.concat(e, ' ') end)
         tick(5) rfsm.step(fsm) rfsm.step(fsm) eq(sets[2], 'e_after(2)@root.a.x e_after(1)@root.a') eq(leaf(fsm), 'root.b', 'and the outer one wins')"
    ));
}
