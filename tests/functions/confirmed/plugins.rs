//! Plugins that count, wait for, watch and prepare (docs/rfsm.md §9). Time events are in `timeevent.rs`, machines inside of states
//! in `ext.rs`.

use crate::lab::run;

#[test]
fn emem_counts_before_guards_look_and_never_the_first_step() {
    run("require 'rfsm.emem'
         local fsm = init(S { a = S { b = S {}, T { src='initial', tgt='b' } }, c = S {}, T { src='initial', tgt='a' },
           T { src='a', tgt='c', events={'e'}, guard=function(tr) say(tostring(tr.src.emem.e), tostring(tr.src.emem.f)) return false end } })
         rfsm.step(fsm) eq(next(fsm.emem), nil) eq(next(fsm.a.b.emem), nil)
         lines = {} rfsm.send_events(fsm, 'e', 'e') rfsm.step(fsm) eq(lines, {'2nil'})
         eq({ fsm.emem.e, fsm.a.emem.e, fsm.a.b.emem.e, tostring(fsm.c.emem.e) }, { 2, 2, 2, 'nil' }, 'from the leaf to the root')
         eq(fsm.emem['e_done@root.a.b'], 1)");
}

#[test]
fn emem_forgets_counts_after_the_exit_and_keeps_the_names() {
    run("local emem = require 'rfsm.emem' local fails = false
         local fsm = init(S { a = S { exit = function(f, s) say(s.emem.e) if fails then error('no', 0) end end }, b = S {}, T { src='initial', tgt='a' },
           T { src='a', tgt='b', events={'go'} }, T { src='b', tgt='a', events={'back'} } })
         local function go(...) rfsm.send_events(fsm, ...) rfsm.run(fsm) end
         rfsm.run(fsm) lines = {} go('e', 'e') go('go') eq(lines, {2}, 'still there in the exit') eq(fsm.a.emem.e, 0)
         go('back') go('e') fails = true lines = {} go('go') eq(lines[1], 1) eq(fsm.a.emem.e, 1, 'an exit that fails keeps them')
         emem.emem_reset(fsm.a) eq(fsm.a.emem.e, 0) eq(fsm.emem.e, 3, 'the root is never left')");
}

#[test]
fn emem_and_hooks_survive_a_reset() {
    run("require 'rfsm.emem' local n = 0
         local fsm = init(S { a = S {}, T { src='initial', tgt='a' } })
         rfsm.post_step_hook_add(fsm, function() n = n + 1 end)
         rfsm.run(fsm) rfsm.send_events(fsm, 'e') rfsm.run(fsm) local before = n
         rfsm.send_events(fsm, 'lost') rfsm.reset(fsm) eq(rfsm.check_events(fsm), 1, 'e_init_fsm alone')
         eq(fsm.a.emem.e, 1) rfsm.run(fsm) assert(n > before) eq(fsm.a.emem.lost, nil)");
}

#[test]
fn await_asks_its_own_guard_last_and_all_of_several_lists() {
    run("require 'rfsm.await'
         local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' },
           T { src='a', tgt='b', events={ 'plain', \"await( x , 'y')\", 'await(\"z\")', 'await(x)' }, guard=function(tr, e) say('asked') return e[1] ~= 'not_now' end } })
         eq(fsm._transitions[2].events, { 'plain', 'x', 'y', 'z' }, 'names are appended')
         local function go(...) rfsm.send_events(fsm, ...) rfsm.run(fsm) end
         rfsm.run(fsm) lines = {} go 'plain' eq(leaf(fsm), 'root.a', 'a plain event needs all the others seen')
         go('x') go('y') eq(leaf(fsm), 'root.a', 'the lists are one') eq(lines, {}, 'not all seen: the guard is not asked')
         go('not_now', 'z') eq(leaf(fsm), 'root.a') assert(lines[1] == 'asked')
         go 'other' eq(leaf(fsm), 'root.a', 'all seen, and none of them comes') go 'plain' eq(leaf(fsm), 'root.b')");
}

#[test]
fn await_sees_nothing_while_its_state_is_inactive_and_forgets_after_the_exit() {
    run("require 'rfsm.await'
         local fsm = init(S { off = S {}, a = S {}, b = S {}, T { src='initial', tgt='off' }, T { src='off', tgt='a', events={'on'} },
           T { src='a', tgt='off', events={'out'} }, T { src='a', tgt='b', events={ 'await(x, y)' } } })
         local function go(...) rfsm.send_events(fsm, ...) rfsm.run(fsm) end
         rfsm.run(fsm) go 'x' go('on', 'x') go 'y' eq(leaf(fsm), 'root.a', 'x came before')
         go 'out' go 'on' go 'x' eq(leaf(fsm), 'root.a', 'y is forgotten') go 'y' eq(leaf(fsm), 'root.b')");
}

#[test]
fn await_tells_dbg_of_what_it_saw() {
    run("require 'rfsm.await'
         local fsm = init(S { dbg = function(tag, ...) if tag == 'AWAIT' then say(...) end end, a = S {}, b = S {}, T { src='initial', tgt='a' },
           T { src='a', tgt='b', events={ 'await(x, y)' } } })
         rfsm.run(fsm) rfsm.send_events(fsm, 'x', 'z') lines = {} rfsm.run(fsm) eq(#lines, 1) assert(lines[1]:find('x$'), lines[1])");
}

#[test]
fn checkevents_knows_completions_and_no_predicates() {
    run("require 'rfsm.checkevents'
         local fsm = init(S { a = S { x = S {}, T { src='initial', tgt='x' } }, T { src='initial', tgt='a' },
           T { src='a', tgt='a', events={ 'known', function(e) return e == 'by_function' end, 7 } } })
         lines = {} rfsm.run(fsm) eq(lines, {}, 'the first event and completions are known')
         for _, event in ipairs { 'known', 7, 'e_done@root.a', 'e_done@root.a.x', 'e_init_fsm' } do rfsm.send_events(fsm, event) rfsm.run(fsm) end
         eq(lines, {}) rfsm.send_events(fsm, 'by_function', 'e_done@root', 8) rfsm.run(fsm)
         eq(lines, { 'WARNING: undeclared event by_function received', 'WARNING: undeclared event e_done@root received', 'WARNING: undeclared event 8 received' })");
}

#[test]
fn preview_prepares_from_the_outside_and_no_composite() {
    run("require 'rfsm.preview'
         local function p(name) return function(f) say(name, f._fqn) end end
         local function yes(f) assert(f._fqn == 'root') return true end
         local fsm = init(S { prepare = p 'root', a = S { x = S {}, y = S { prepare = p 'y' }, T { src='initial', tgt='x', likely=yes },
             T { src='x', tgt='y', events={'f'}, likely=yes } },
           b = S { prepare = p 'b' }, c = S { prepare = p 'c', z = S { prepare = p 'z' }, T { src='initial', tgt='z' } }, d = S { prepare = p 'd' },
           T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'}, likely=yes }, T { src='a', tgt='c', events={'e'}, likely=yes },
           T { src='a', tgt='d', events={'e'}, likely=function() return false end } })
         lines = {} rfsm.step(fsm) eq(lines, { 'broot', 'yroot' })
         for _, bad in ipairs { S { a = S { prepare = 1 }, T { src='initial', tgt='a' } }, S { a = S {}, T { src='initial', tgt='a', likely='x' } } } do
           eq(pcall(init, bad), false)
         end");
}

/// In the order in which the engine tries them.
#[test]
fn preview_follows_the_priorities() {
    run("require 'rfsm.preview'
         local function p(name) return S { prepare = function() say(name) end } end local function yes() return true end
         local fsm = init(S { a = S {}, b = p 'b', c = p 'c', d = p 'd', T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'}, likely=yes, pn=1 },
           T { src='a', tgt='c', events={'e'}, likely=yes, pn=3 }, T { src='a', tgt='d', events={'e'}, likely=yes, pn=2 } })
         lines = {} rfsm.step(fsm) eq(lines, { 'c', 'd', 'b' })");
}
