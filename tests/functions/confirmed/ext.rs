//! States that watch and states with machines in them, and what tells of a machine (docs/rfsm.md §9).

use crate::lab::run;

#[test]
fn a_monitor_state_sends_all_that_happens_or_the_first() {
    run("local ext = require 'rfsm.ext'
         local function watch(options)
           options.montab = { e_x = function() return 1 end, e_y = function() return 'yes' end, e_z = function() return false end }
           options.entry = function() say 'in' end options.exit = function() say 'out' end
           local fsm = init(S { a = ext.gen_monitor_state(options), b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'stop'} } }) lines = {}
           local all = {} rfsm.pre_step_hook_add(fsm, function(f, e) for _, x in ipairs(e) do all[#all + 1] = x end end)
           eq(rfsm.step(fsm, 2), false, 'always busy') all = {} rfsm.step(fsm, 1) local got = all all = {} table.sort(got)
           eq(rfsm.get_sta_mode(fsm.a), 'active') rfsm.send_events(fsm, 'stop') rfsm.run(fsm) eq(leaf(fsm), 'root.b') return got
         end
         eq(watch {}, {'e_x', 'e_y'}) eq(lines, {'in', 'out'})
         eq(#watch { break_first = true }, 1) eq(#watch { breakfirst = true }, 1)
         local calm = init(S { a = ext.gen_monitor_state { montab = { e_x = function() return nil end } }, T { src='initial', tgt='a' } })
         eq(rfsm.step(calm, 5), false, 'busy though nothing happens') eq(rfsm.get_sta_mode(calm.a), 'active')
         for _, bad in ipairs { 7, 'x', true } do eq(pcall(ext.gen_monitor_state, { montab = bad }), false) end");
}

const SUB: &str = "local ext = require 'rfsm.ext'
    local function sub(name, doo) return init(S { a = S { doo = doo, entry = function() say(name, 'a+') end, exit = function() say(name, 'a-') end },
      b = S { entry = function() say(name, 'b+') end, exit = function() say(name, 'b-') end },
      T { src='initial', tgt='a' }, T { src='a', tgt='b', events={ 'e_' .. name, 'on' } } }) end
    local function around(par) return init(S { off = S {}, par = ext.seqand(par), T { src='initial', tgt='off' },
      T { src='off', tgt='par', events={'on'} }, T { src='par', tgt='off', events={'off'} } }) end
    local function go(fsm, ...) rfsm.send_events(fsm, ...) return rfsm.run(fsm) end\n";

#[test]
fn machines_inside_hear_all_events_also_those_of_the_step_that_entered() {
    run(&format!(
        "{SUB} local one, two = sub 'one', sub 'two'
         local fsm = around {{ order={{'two'}}, one=one, two=two, entry=function() say 'in' end, exit=function() say 'out' end }}
         assert(rfsm.is_leaf(fsm.par)) rfsm.run(fsm) lines = {{}}
         rfsm.send_events(fsm, 'on') rfsm.step(fsm)
         eq(lines, {{ 'in', 'twoa+', 'onea+' }}, 'its own entry first, then by order; entering takes the set')
         lines = {{}} go(fsm, 'on') eq(lines, {{ 'twoa-', 'twob+', 'onea-', 'oneb+' }})
         eq(leaf(two), 'root.b', 'those that were given, not copies')
         lines = {{}} go(fsm, 'off') eq(lines, {{ 'twob-', 'oneb-', 'out' }}, 'its own exit last')
         eq(leaf(one), false, 'they are reset') eq(rfsm.check_events(one), 1, 'to their beginning') eq(fsm.post_step_hook, nil, 'and the hook is gone')
         lines = {{}} go(fsm, 'e_one') eq(lines, {{}}) go(fsm, 'on')
         eq(lines, {{ 'in', 'twoa+', 'onea+', 'twoa-', 'twob+', 'onea-', 'oneb+' }}, 'they hear what brought it there, and take it when it is active')"
    ));
}

#[test]
fn machines_inside_are_stepped_or_run_and_say_whether_they_rest() {
    run(&format!(
        "{SUB} local n = 0 local function busy() while true do n = n + 1 rfsm.yield(n % 4 == 0) end end
         local function still(doo) return init(S {{ a = S {{ doo = doo }}, T {{ src='initial', tgt='a' }} }}) end
         local fsm = around {{ one = still(busy), step = 3 }} rfsm.run(fsm) eq(go(fsm, 'on'), true, 'idle unless told') eq(n, 4, 'on entry, and once more')
         n = 0 rfsm.step(fsm) eq(n, 3) rfsm.step(fsm) eq(n, 4, 'idle ends a step') rfsm.step(fsm) eq(n, 7)
         n = 0 fsm = around {{ one = still(busy), run = true }} rfsm.run(fsm) go(fsm, 'on') eq(n, 8)
         fsm = around {{ one = sub 'one', idle_doo = false }} rfsm.run(fsm) rfsm.send_events(fsm, 'on') eq(rfsm.step(fsm, 9), false, 'never idle')
         eq(pcall(ext.seqand, {{ one = sub 'one', step = 1, run = true }}), false, 'not both')"
    ));
}

#[test]
fn events_inside_do_not_come_out() {
    run(&format!(
        "{SUB} local inner = init(S {{ a = S {{ entry = function(f) rfsm.send_events(f, 'off') end }}, T {{ src='initial', tgt='a' }} }})
         local fsm = around {{ inner = inner }} rfsm.run(fsm) go(fsm, 'on') go(fsm, 'any') eq(leaf(fsm), 'root.par')"
    ));
}

#[test]
fn tables_of_a_machine() {
    run("local m = require 'rfsm.marsh'
         local fsm = init(S { a = S { x = S {}, T { src='initial', tgt='x' } }, k = C {}, T { src='initial', tgt='a' }, T { src='a', tgt='k', events={'e', 'f'}, pn=2 },
           T { src='k', tgt='a' } })
         local t = m.model2tab(fsm) local by = {} for _, s in ipairs(t.subnodes) do by[s.id] = s end
         eq({ t.id, t.type, #t.subnodes, by.a.type, by.k.type, by.initial.type, #by.a.subnodes, #by.a.transitions }, { 'root', 'state', 3, 'state', 'connector', 'connector', 2, 1 })
         local tr = t.transitions[2] eq({ tr.type, tr.src, tr.tgt, tr.pn, table.unpack(tr.events) }, { 'transition', 'root.a', 'root.k', 2, 'e', 'f' })
         eq(m.actinfo2tab(fsm), false) eq(pcall(m.actinfo2tab, S {}), false)
         rfsm.run(fsm) eq({ m.actinfo2tab(fsm).fqn, m.actinfo2tab(fsm).mode }, { 'root.a.x', 'done' })
         eq(pcall(require('rfsm.rfsm2json').encode, S {}), false)");
}

#[test]
fn a_dbg_that_shows_what_is_asked_for() {
    run("local pp = require 'rfsm.pp'
         local chosen = pp.gen_dbgcolor('m', { CHECKING = true, EFFECT = false }, false, say)
         chosen('CHECKING', 'a') chosen('EFFECT', 'b') chosen('RAISED', 'c') eq(#lines, 1) assert(lines[1]:find('m') and lines[1]:find('CHECKING') and lines[1]:find('a$'))
         lines = {} local others = pp.gen_dbgcolor('m', { EFFECT = false }, true, say) others('EFFECT', 'b') others('RAISED', 'c') eq(#lines, 1)
         local fsm = init(S { a = S { x = S {}, T { src='initial', tgt='x' } }, T { src='initial', tgt='a' } }) rfsm.run(fsm)
         local text = pp.fsm2str(fsm) assert(text:find('a %[active%]') and text:find('x %[done%]'), text)");
}
