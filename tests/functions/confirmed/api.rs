//! The other functions of the module `rfsm` (docs/rfsm.md §1.1, §8).

use crate::lab::run;

#[test]
fn maps_and_names() {
    run("local fsm = init(S { a = S { x = S {}, T { src='initial', tgt='x' } }, T { src='initial', tgt='a' } })
         local all = rfsm.mapfsm(function(o, scope, name) return rfsm.fsmobj_tochar(o) end, fsm) table.sort(all)
         eq(all, {'CS', 'CS', 'LS', 'TR', 'TR', 'c', 'c'})
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
fn mapfsm_goes_from_the_outside_in_with_object_scope_and_name() {
    run("local fsm = init(S { a = S { x = S {}, T { src='initial', tgt='x' } }, T { src='initial', tgt='a' } })
         local seen = {} local function note(o, scope, name) seen[#seen + 1] = scope._fqn .. '/' .. tostring(name) return o end
         local all = rfsm.mapfsm(note, fsm, rfsm.is_node) table.sort(seen)
         eq(seen, { 'root.a/initial', 'root.a/x', 'root/a', 'root/initial', 'root/root' }) eq(#all, 5)
         local at = {} rfsm.mapfsm(function(o) at[#at + 1] = o._id end, fsm, rfsm.is_state) eq(at, {'root', 'a', 'x'}, 'a state before what is in it')
         seen = {} rfsm.mapfsm(note, fsm, rfsm.is_node, 1) table.sort(seen) eq(seen, { 'root/a', 'root/initial', 'root/root' }, 'one level')
         eq(#rfsm.mapfsm(note, fsm, rfsm.is_trans), 2)");
}

#[test]
fn step_hooks_stand_in_lists_and_the_runner_is_gone_with_the_last() {
    run("local fsm = init(S { a = S {}, T { src='initial', tgt='a' } })
         for _, which in ipairs { 'pre', 'post' } do
           local function one() say(which, 1) end local function two() say(which, 2) end
           local add, rm, list = rfsm[which .. '_step_hook_add'], rfsm[which .. '_step_hook_rm'], '_' .. which .. '_step_hooks'
           eq(fsm[which .. '_step_hook'], nil) add(fsm, one) add(fsm, two, 'before') eq(#fsm[list], 2) assert(fsm[list][1] == two and fsm[list][2] == one)
           local three = function() say(which, 3) end add(fsm, three, 'after')
           lines = {} rfsm.send_events(fsm, 'x') rfsm.step(fsm) eq(lines[1] .. lines[2] .. lines[3], which .. 2 .. which .. 1 .. which .. 3)
           eq(type(fsm[which .. '_step_hook']), 'function') eq(rm(fsm, two), true) eq(rm(fsm, two), false) rm(fsm, one) rm(fsm, three)
           eq(fsm[which .. '_step_hook'], nil) lines = {} rfsm.step(fsm) eq(lines, {})
         end");
}

#[test]
fn every_state_has_the_fields_of_its_class() {
    run("local s = S {} eq(s.type, S.type) eq(s.new, S.new) eq(s.rfsm, true) eq(rawget(s, 'type'), nil)
         for _, name in ipairs { 'state', 'sista', 'simple_state', 'csta', 'composite_state' } do assert(rawequal(rfsm[name], rfsm.state), name) eq(rfsm[name]:new({}):type(), 'state') end
         for _, name in ipairs { 'trans', 'transition' } do assert(rawequal(rfsm[name], rfsm.trans), name) eq(rfsm[name]{}:type(), 'transition') end
         for _, name in ipairs { 'conn', 'connector', 'junc' } do assert(rawequal(rfsm[name], rfsm.conn), name) eq(rfsm[name]{}:type(), 'connector') end
         assert(rfsm.is_leaf(rfsm.composite_state {}) and rfsm.is_composite(rfsm.simple_state { c = rfsm.conn {} }), 'what is in it decides, a connector is enough')");
}
