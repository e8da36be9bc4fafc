//! The other functions of the module `rfsm` (rfsm.md §1.1, §8).

use crate::lab::run;

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
