//! What functions are given and see while a transition is taken, and what becomes of their errors (docs/rfsm.md §5).

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

/// `err` gets three: a tag, a text that ends so that the third can follow, and what was raised.
#[test]
fn errors_are_told_in_three_parts() {
    run("local told = {}
         local function bad() error('oh', 0) end
         local fsm = init(S { err = function(...) told[#told + 1] = table.pack(...) end, a = S { exit = bad }, b = S { entry = bad, doo = bad }, T { src='initial', tgt='a' },
           T { src='a', tgt='b', events={'e'}, effect=bad }, T { src='b', tgt='a', events={'f'}, guard=bad } })
         rfsm.run(fsm) told = {} rfsm.send_events(fsm, 'e') rfsm.run(fsm) rfsm.send_events(fsm, 'f') rfsm.run(fsm)
         local tags = {} for i, t in ipairs(told) do tags[i] = t[1] eq(t.n, 3) assert(t[2]:find(': $'), t[2]) eq(t[3], 'oh') end
         eq(tags, { 'EXIT', 'EFFECT', 'ENTRY', 'DOO', 'GUARD' })");
}

/// rFSM never returns from there: its root is its own active child at that moment.
#[test]
fn the_entry_of_the_root_sees_the_root_alone() {
    run("local fsm = init(S { entry = function(f, s, w) say(w, ' ', f == s, ' ', tostring(leaf(f)), ' ', table.concat(rfsm.get_active_conf(f), ','), ' ', rfsm.get_sta_mode(f)) end,
           a = S {}, T { src='initial', tgt='a' } })
         lines = {} rfsm.run(fsm) eq(lines, {'entry true false root active'})");
}

const TRACED: &str = "local function of(name) return S { entry = function() say(name, '+') end, exit = function() say(name, '-') end } end
    local function put(s, parts) for k, v in pairs(parts) do s[k] = v end return s end
    local function fx(name) return function() say(name) end end ";

#[test]
fn a_way_through_a_connector_enters_and_leaves_what_is_around_it() {
    run(&format!(
        "{TRACED} local fsm = init(put(of 'root', {{ a = of 'a', b = of 'b', C = put(of 'C', {{ k = C {{}}, T {{ src='k', tgt='root.b', effect=fx 'e2' }} }}),
           T {{ src='initial', tgt='a' }}, T {{ src='a', tgt='.C.k', events={{'go'}}, effect=fx 'e1' }} }}))
         rfsm.run(fsm) lines = {{}} rfsm.send_events(fsm, 'go') rfsm.step(fsm) eq(table.concat(lines, ' '), 'a- e1 C+ C- e2 b+')"
    ));
}

#[test]
fn the_traces_that_were_probed() {
    run(&format!(
        "{TRACED} local fsm = init(put(of 'root', {{ A = put(of 'A', {{ A1 = put(of 'A1', {{ A11 = of 'A11', T {{ src='initial', tgt='A11', effect=fx 'ef_A1' }} }}),
             T {{ src='initial', tgt='A1', effect=fx 'ef_A' }}, T {{ src='.A1.A11', tgt='root.A', events={{'up'}}, effect=fx 'ef' }} }}), b = of 'b',
           T {{ src='initial', tgt='A', effect=fx 'ef_init' }}, T {{ src='A', tgt='A', events={{'self'}}, effect=fx 'ef' }}, T {{ src='A', tgt='.A.A1.A11', events={{'down'}}, effect=fx 'ef' }},
           T {{ src='A', tgt='b', events={{'out'}} }}, T {{ src='b', tgt='initial', events={{'again'}}, effect=fx 'ef' }} }}))
         local function go(...) lines = {{}} rfsm.send_events(fsm, ...) rfsm.step(fsm) return table.concat(lines, ' ') end
         eq(go(), 'root+ ef_init A+ ef_A A1+ ef_A1 A11+')
         eq(go 'self', 'A11- A1- A- ef A+ ef_A A1+ ef_A1 A11+', 'external')
         eq(go 'down', 'A11- A1- A- ef A+ A1+ A11+', 'external, initials are skipped')
         eq(go 'up', 'A11- A1- ef ef_A A1+ ef_A1 A11+', 'local: A is not left')
         go 'out' eq(go 'again', 'b- ef ef_init A+ ef_A A1+ ef_A1 A11+', 'the root is not left')"
    ));
}
