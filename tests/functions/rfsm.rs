//! rFSM's own tests (docs/rfsm.md §10) under their names, written anew, as Lua texts that step machines themselves. Those that
//! say nothing of functions are in `tests/statechart/rfsm.rs` too, against the engine alone.

use super::lab::{run, run_with};

mod core {
    use super::run;

    #[test]
    fn initial_entry() {
        run("local fsm = init(S { off = S {}, T { src='initial', tgt='off' } })
             eq(rfsm.run(fsm), true) eq(leaf(fsm), 'root.off') eq(rfsm.get_sta_mode(fsm.off), 'done')");
    }

    #[test]
    fn event_transition() {
        run("local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e_go'} } })
             rfsm.run(fsm) rfsm.send_events(fsm, 'e_go') rfsm.run(fsm) eq(leaf(fsm), 'root.b')");
    }

    #[test]
    fn unknown_event_no_transition() {
        run("local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e_go'} } })
             rfsm.run(fsm) rfsm.send_events(fsm, 'e_other', 7, {}) eq(rfsm.run(fsm), true) eq(leaf(fsm), 'root.a')");
    }

    #[test]
    fn init_rejects_non_state() {
        run("for _, bad in ipairs { 1, 'x', {}, T {}, C {} } do
               local ok, why = pcall(rfsm.init, bad)
               eq(ok, false) assert(why:find('invalid fsm model passed to rfsm.init', 1, true), why)
             end");
    }

    #[test]
    fn entry_exit_order() {
        run("local fsm = init(S {
               a = S { entry = function() say 'a_entry' end, exit = function() say 'a_exit' end },
               b = S { entry = function() say 'b_entry' end },
               T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e_go'} } })
             lines = {} rfsm.run(fsm) rfsm.send_events(fsm, 'e_go') rfsm.run(fsm)
             eq(lines, {'a_entry', 'a_exit', 'b_entry'})");
    }

    #[test]
    fn guard_blocks_transition() {
        run("local open = false
             local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' },
               T { src='a', tgt='b', events={'e_go'}, guard=function(tr, events) return open end } })
             rfsm.run(fsm) rfsm.send_events(fsm, 'e_go') rfsm.run(fsm) eq(leaf(fsm), 'root.a')
             open = true rfsm.send_events(fsm, 'e_go') rfsm.run(fsm) eq(leaf(fsm), 'root.b')");
    }

    #[test]
    fn effect_runs_and_receives_events() {
        run("local got
             local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' },
               T { src='a', tgt='b', events={'e_go'},
                   effect=function(f, tr, what, events) got = { f._id, tr.src._fqn, tr.tgt._fqn, what, events[1], #events } end } })
             rfsm.run(fsm) rfsm.send_events(fsm, 'e_go') rfsm.run(fsm)
             eq(got, { 'root', 'root.a', 'root.b', 'effect', 'e_go', 1 })");
    }

    #[test]
    fn priority_number() {
        run("local fsm = init(S { a = S {}, low = S {}, high = S {}, T { src='initial', tgt='a' },
               T { src='a', tgt='low', events={'e'}, pn=1 }, T { src='a', tgt='high', events={'e'}, pn=10 } })
             rfsm.run(fsm) rfsm.send_events(fsm, 'e') rfsm.run(fsm) eq(leaf(fsm), 'root.high')");
    }

    #[test]
    fn any_event_transition() {
        run("local fsm = init(S { a = S { doo = function() rfsm.yield(true) rfsm.yield(true) end }, b = S {},
               T { src='initial', tgt='a' }, T { src='a', tgt='b', events={} } })
             rfsm.run(fsm) eq(leaf(fsm), 'root.a') rfsm.send_events(fsm, 42) rfsm.run(fsm) eq(leaf(fsm), 'root.b')");
    }

    #[test]
    fn reset() {
        run("local fsm = init(S { a = S { entry = function() say 'a+' end, exit = function() say 'a-' end }, b = S {},
               T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'} }, T { src='b', tgt='a', events={'f'} } })
             rfsm.run(fsm) rfsm.reset(fsm) eq(leaf(fsm), false) eq(rfsm.get_active_conf(fsm), {})
             rfsm.run(fsm) eq(leaf(fsm), 'root.a') eq(lines, {'a+', 'a+'})");
    }

    #[test]
    fn string_event_sugar() {
        run("local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events='e_go' } })
             rfsm.run(fsm) rfsm.send_events(fsm, 'e_go') rfsm.run(fsm) eq(leaf(fsm), 'root.b')");
    }

    #[test]
    fn predicate_event() {
        run("local seen = {}
             local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' },
               T { src='a', tgt='b', events={ function(e) seen[#seen+1] = e; return type(e) == 'table' and e.speed > 3 end } } })
             rfsm.run(fsm) rfsm.send_events(fsm, { speed = 2 }) rfsm.run(fsm) eq(leaf(fsm), 'root.a')
             rfsm.send_events(fsm, { speed = 4 }) rfsm.run(fsm) eq(leaf(fsm), 'root.b')
             eq(seen[1], 'e_done@root.a')");
    }

    #[test]
    fn get_active_conf() {
        run("local fsm = init(S { outer = S { inner = S {}, T { src='initial', tgt='inner' } }, T { src='initial', tgt='outer' } })
             eq(rfsm.get_active_conf(fsm), {}) rfsm.run(fsm)
             eq(rfsm.get_active_conf(fsm), {'root', 'root.outer', 'root.outer.inner'})");
    }

    #[test]
    fn step_hook_add_rm() {
        run("local n = 0
             local function hook(f, events) n = n + 1 end
             local fsm = init(S { a = S {}, T { src='initial', tgt='a' } })
             for _, which in ipairs { 'pre', 'post' } do
               n = 0
               rfsm[which .. '_step_hook_add'](fsm, hook) rfsm.step(fsm) assert(n > 0, which)
               eq(rfsm[which .. '_step_hook_rm'](fsm, hook), true)
               local before = n
               rfsm.step(fsm) eq(n, before) eq(rfsm[which .. '_step_hook_rm'](fsm, hook), false)
             end
             local order = {}
             rfsm.pre_step_hook_add(fsm, function() order[#order+1] = 'second' end)
             rfsm.pre_step_hook_add(fsm, function() order[#order+1] = 'first' end, 'before')
             rfsm.step(fsm) eq(order, {'first', 'second'})");
    }

    #[test]
    fn load_str() {
        run("local t = rfsm.load_str(\"return rfsm.state { a = rfsm.state {}, rfsm.trans { src='initial', tgt='a' } }\")
             local fsm = init(t) rfsm.run(fsm) eq(leaf(fsm), 'root.a') eq(t._initialized, nil)");
    }

    #[test]
    fn load_str_rejects_non_state() {
        run("local ok, why = pcall(rfsm.load_str, 'return 1')
             eq(ok, false) assert(why:find('rfsm.load_str: chunk did not return a valid rfsm', 1, true), why)
             ok, why = pcall(rfsm.load_str, 'return return')
             eq(ok, false) assert(why:find('rfsm.load_str: failed to load chunk: ', 1, true), why)");
    }

    #[test]
    fn relative_and_local_refs() {
        run("local fsm = init(S { operational = S {
                 motors_on = S { moving = S {}, stopped = S {}, T { src='initial', tgt='moving' }, T { src='moving', tgt='stopped', events={'stop'} } },
                 motors_off = S {}, T { src='motors_on', tgt='motors_off', events={'off'} }, T { src='.motors_on.stopped', tgt='.motors_on.moving', events={'go'} } },
               off = S {}, T { src='initial', tgt='.operational.motors_on.moving' },
               T { src='.operational.motors_off', tgt='off', events={'end'} }, T { src='off', tgt='operational.motors_on', events={'begin'} } })
             local function go(e) rfsm.send_events(fsm, e) rfsm.run(fsm) return leaf(fsm) end
             rfsm.run(fsm) eq(leaf(fsm), 'root.operational.motors_on.moving', 'refined') eq(go 'stop', 'root.operational.motors_on.stopped')
             eq(go 'go', 'root.operational.motors_on.moving') eq(go 'off', 'root.operational.motors_off') eq(go 'end', 'root.off')
             eq(go 'begin', 'root.operational.motors_on.moving')");
    }
}

mod connector {
    use super::run;

    const CHAIN: &str = "local fsm = init(S { a = S {}, b = S {}, x = C {}, y = C {}, T { src='initial', tgt='a' },
        T { src='a', tgt='x', events={'e1'}, effect=function() say 'ax' end },
        T { src='x', tgt='y', events={'e2'} , effect=function() say 'xy' end }, T { src='y', tgt='b' } }) rfsm.run(fsm) lines = {} ";

    #[test]
    fn partial_chain_not_taken() {
        run(&format!("{CHAIN} rfsm.send_events(fsm, 'e1') rfsm.run(fsm) eq(leaf(fsm), 'root.a') eq(lines, {{}})"));
    }

    #[test]
    fn full_chain_taken() {
        run(&format!(
            "{CHAIN} rfsm.send_events(fsm, 'e1', 'e2') rfsm.run(fsm) eq(leaf(fsm), 'root.b') eq(lines, {{'ax', 'xy'}})"
        ));
    }

    #[test]
    fn split_connector() {
        run("local fsm = init(S { a = S {}, l = S {}, r = S {}, x = C {}, T { src='initial', tgt='a' },
               T { src='a', tgt='x', events={'left', 'right'} },
               T { src='x', tgt='l', events={'left'} }, T { src='x', tgt='r', events={'right'} } })
             rfsm.run(fsm) rfsm.send_events(fsm, 'right') rfsm.run(fsm) eq(leaf(fsm), 'root.r')");
    }

    #[test]
    fn exit_connector() {
        run("local fsm = init(S { idle = S {}, busy = S { x = S {}, cexit = C {}, T { src='initial', tgt='x' },
                 T { src='x', tgt='cexit', events={'e_done'} } },
               T { src='initial', tgt='busy' }, T { src='busy.cexit', tgt='idle' } })
             rfsm.run(fsm) eq(leaf(fsm), 'root.idle')");
    }
}

mod composite {
    use super::{run, run_with};

    const NESTED: &str = "local fsm = init(S { on = S { slow = S {}, fast = S {}, T { src='initial', tgt='slow' },
          T { src='slow', tgt='fast', events={'faster'} } }, off = S {},
        T { src='initial', tgt='off' }, T { src='off', tgt='on', events={'on'} }, T { src='on', tgt='off', events={'off'} } })
        rfsm.run(fsm) local function go(e) rfsm.send_events(fsm, e) rfsm.run(fsm) return leaf(fsm) end ";

    #[test]
    fn nested_entry_and_transitions() {
        run(&format!("{NESTED} eq(go 'on', 'root.on.slow') eq(go 'faster', 'root.on.fast') eq(go 'off', 'root.off')"));
    }

    #[test]
    fn reentry_uses_initial() {
        run(&format!("{NESTED} go 'on' go 'faster' go 'off' eq(go 'on', 'root.on.slow')"));
    }

    /// Nine, as many as rFSM ships: of one file and of several, of old dialect and new, with all that a model can have.
    #[test]
    fn example_models_load() {
        let leaf = "return rfsm.simple_state { doo = function(fsm) rfsm.yield(true) end }";
        let sub = "return rfsm.composite_state { dbg = true, inner = rfsm.load('leaf.lua'),
            rfsm.transition { src='initial', tgt='inner' } }";
        let old = "require 'rfsm_timeevent' rfsm_timeevent.set_gettime_hook(function() return 1, 0 end)
            return rfsm.composite_state:new { on = rfsm.simple_state:new { entry = function() end }, off = rfsm.sista:new {},
              rfsm.trans:new { src='initial', tgt='off' }, rfsm.trans:new { src='off', tgt='on', events={ 'e_after(1)' } } }";
        run_with(
            &[("leaf.lua", leaf), ("sub.lua", sub), ("old.lua", old)],
            "local function leafed(parts) parts.a, parts[#parts + 1] = parts.a or S {}, T { src='initial', tgt='a' } return S(parts) end
             local models = {
               rfsm.load('sub.lua'),
               S { a = rfsm.load('sub.lua'), b = rfsm.load('sub.lua'), T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'} } },
               rfsm.csta { hit = rfsm.sista { entry = function() end }, rfsm.transition { src='initial', tgt='hit' } },
               rfsm.load('old.lua'),
               leafed { b = S {}, k = C {}, T { src='a', tgt='k', events={'x'} }, T { src='k', tgt='a', events={'y'} }, T { src='k', tgt='b', events={'z'} } },
               leafed { T { src='a', tgt='a', events={'e'}, guard=function() return true end, effect=function() end, pn=3 } },
               leafed { a = require('rfsm.ext').gen_monitor_state { montab = { e = function() return false end } } },
               leafed { a = S { idle = S {}, rfsm.trans { src='initial', tgt='idle', events={} } }, idle_hook = false },
               leafed { a = S { doo = function() for i = 1, 3 do rfsm.yield() end end }, b = S {}, T { src='a', tgt='b', events={'e_done'} } },
             }
             models[2].a.extra = S {}
             table.insert(models[2].a, T { src='inner', tgt='extra', events={'more'} })
             eq(#models, 9)
             for i, m in ipairs(models) do
               m.dbg = false
               local fsm = init(m) assert(fsm, i) rfsm.step(fsm, 5) assert(leaf(fsm), i)
             end
             local fsm = init(models[2]) rfsm.run(fsm) rfsm.send_events(fsm, 'more') rfsm.run(fsm)
             eq(leaf(fsm), 'root.a.extra')
             local ok, why = pcall(rfsm.load, 'none.lua') eq(ok, false)",
        );
    }
}

mod doo {
    use super::run;

    #[test]
    fn leaf_without_doo_completes_immediately() {
        run("local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e_done'} } })
             rfsm.run(fsm) eq(leaf(fsm), 'root.b')");
    }

    #[test]
    fn doo_runs_to_completion_raises_e_done() {
        run("local n = 0
             local fsm = init(S { a = S { doo = function(f, s, w) for i = 1, 3 do n = n + 1 eq(s._fqn .. w, 'root.adoo')
                 local f2, s2, w2 = rfsm.yield() eq(w2, 'doo') end end }, b = S {},
               T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e_done'} } })
             eq(rfsm.run(fsm), true) eq(n, 3) eq(leaf(fsm), 'root.b')");
    }

    #[test]
    fn doo_can_raise_events() {
        run("local fsm = init(S { a = S { doo = function(f) rfsm.yield(false) rfsm.send_events(f, 'e_x') rfsm.yield(true) end }, b = S {},
               T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e_x'} } })
             rfsm.run(fsm) eq(leaf(fsm), 'root.b')");
    }

    #[test]
    fn event_preempts_doo() {
        run("local n, begun = 0, 0
             local fsm = init(S { a = S { doo = function() begun = begun + 1 while true do n = n + 1 rfsm.yield(true) end end }, b = S {},
               T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'} }, T { src='b', tgt='a', events={'f'} } })
             rfsm.run(fsm) eq(n, 1) rfsm.send_events(fsm, 'e') rfsm.run(fsm) eq(leaf(fsm), 'root.b') eq(n, 1)
             rfsm.send_events(fsm, 'f') rfsm.run(fsm) eq(n, 2) eq(begun, 2, 'it begins anew')");
    }

    #[test]
    fn idle_flag_keeps_state_active() {
        run("local fsm = init(S { a = S { doo = function() while true do rfsm.yield(true) end end }, T { src='initial', tgt='a' } })
             eq(rfsm.run(fsm), true) eq(rfsm.get_sta_mode(fsm.a), 'active')");
    }

    #[test]
    fn step_count() {
        run("local fsm = init(S { a = S { doo = function() while true do rfsm.yield(false) end end }, T { src='initial', tgt='a' } })
             local n = 0 rfsm.post_step_hook_add(fsm, function() n = n + 1 end)
             eq(rfsm.step(fsm, 5), false) eq(n, 5)");
    }
}

mod timeevent {
    use super::run;

    const CLOCK: &str = "local te = require 'rfsm.timeevent' local now = 0
        te.set_gettime_hook(function() return now end)
        local function advance(s) now = now + s * 1e9 end\n";

    #[test]
    fn fires_after_timeout() {
        run(&format!("{CLOCK} local fsm = init(S {{ a = S {{}}, b = S {{}}, T {{ src='initial', tgt='a' }}, T {{ src='a', tgt='b', events={{ te.e_after(2) }} }} }})
             rfsm.run(fsm) advance(2) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.a', 'not at once')
             advance(0.1) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.b')"));
    }

    #[test]
    fn timeout_via_function() {
        run(&format!(
            "{CLOCK} local wait = 5
             local fsm = init(S {{ a = S {{}}, b = S {{}}, T {{ src='initial', tgt='a' }},
               T {{ src='a', tgt='b', events={{ te.e_after(function() return wait end, 'w') }} }} }})
             rfsm.run(fsm) advance(4) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.a')
             advance(2) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.b')"
        ));
    }

    #[test]
    fn timer_restarts_on_reentry() {
        run(&format!("{CLOCK} local fsm = init(S {{ a = S {{}}, b = S {{}}, T {{ src='initial', tgt='a' }}, T {{ src='a', tgt='a', events={{'again'}} }},
               T {{ src='a', tgt='b', events={{ te.e_after(2) }} }} }})
             rfsm.run(fsm) advance(1.5) rfsm.send_events(fsm, 'again') rfsm.run(fsm) advance(1.5) rfsm.run(fsm) rfsm.run(fsm)
             eq(leaf(fsm), 'root.a') advance(1) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.b')"));
    }

    #[test]
    fn e_at_absolute() {
        run(&format!("{CLOCK} local fsm = init(S {{ a = S {{}}, b = S {{}}, T {{ src='initial', tgt='a' }}, T {{ src='a', tgt='b', events={{ te.e_at(10) }} }} }})
             advance(9) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.a') advance(2) rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.b')"));
    }

    #[test]
    fn legacy_string_syntax() {
        run("require 'rfsm_timeevent' local s = 10
             rfsm_timeevent.set_gettime_hook(function() return s, 500 end)
             local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={ 'e_after(2)' } } })
             rfsm.run(fsm) s = 11 rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.a') s = 13 rfsm.run(fsm) rfsm.run(fsm) eq(leaf(fsm), 'root.b')");
    }
}

mod extensions {
    use super::run;

    #[test]
    fn emem_counts_across_steps() {
        run("require 'rfsm.emem'
             local fsm = init(S { a = S { b = S {}, T { src='initial', tgt='b' } }, T { src='initial', tgt='a' } })
             rfsm.run(fsm)
             for i = 1, 3 do rfsm.send_events(fsm, 'e', 'e', 'f') rfsm.run(fsm) end
             eq(fsm.a.b.emem.e, 6) eq(fsm.a.emem.f, 3) eq(fsm.emem.e, 6) eq(fsm.a.emem.g, nil)
             eq(fsm.a.emem.e_init_fsm, nil, 'the first step is not counted')");
    }

    #[test]
    fn emem_reset_on_exit() {
        run("local emem = require 'rfsm.emem'
             local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'go'}, guard=function(tr) return tr.src.emem.e == 2 end } })
             rfsm.run(fsm) rfsm.send_events(fsm, 'e') rfsm.run(fsm) rfsm.send_events(fsm, 'go') rfsm.run(fsm) eq(leaf(fsm), 'root.a')
             rfsm.send_events(fsm, 'e', 'go') rfsm.run(fsm) eq(leaf(fsm), 'root.b', 'seen by guards of the same step')
             eq(fsm.a.emem.e, 0) eq(fsm.emem.e, 2)");
    }

    #[test]
    fn await_multiple_events() {
        run("require 'rfsm.await'
             local fsm = init(S { a = S {}, b = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={ [[await(x, 'y', \"z\")]] } } })
             rfsm.run(fsm)
             for _, e in ipairs { 'y', 'x' } do rfsm.send_events(fsm, e) rfsm.run(fsm) eq(leaf(fsm), 'root.a') end
             rfsm.send_events(fsm, 'z') rfsm.run(fsm) eq(leaf(fsm), 'root.b')");
    }

    #[test]
    fn await_resets_on_exit() {
        run("require 'rfsm.await'
             local fsm = init(S { a = S {}, b = S {}, c = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={ 'await(x,y)' } },
               T { src='a', tgt='c', events={'out'} }, T { src='c', tgt='a', events={'back'} } })
             local function go(e) rfsm.send_events(fsm, e) rfsm.run(fsm) end
             rfsm.run(fsm) go 'x' go 'out' go 'back' go 'y' eq(leaf(fsm), 'root.a') go 'x' eq(leaf(fsm), 'root.b')");
    }

    #[test]
    fn checkevents_warns_on_unknown() {
        run("require 'rfsm.checkevents'
             local fsm = init(S { a = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='a', events={'known'} } })
             rfsm.run(fsm) rfsm.send_events(fsm, 'known') rfsm.run(fsm) eq(lines, {})
             rfsm.send_events(fsm, 'strange') rfsm.run(fsm) eq(lines, {'WARNING: undeclared event strange received'})");
    }

    #[test]
    fn monitor_state() {
        run("local ext = require 'rfsm.ext'
             local hot = false
             local fsm = init(S { watch = ext.gen_monitor_state { montab = { e_hot = function(f) return hot end } }, alarm = S {},
               T { src='initial', tgt='watch' }, T { src='watch', tgt='alarm', events={'e_hot'} } })
             rfsm.step(fsm, 3) eq(leaf(fsm), 'root.watch') hot = true rfsm.step(fsm, 3) eq(leaf(fsm), 'root.alarm')
             local ok, why = pcall(ext.gen_monitor_state, {}) eq(ok, false)
             assert(why:find(\"gen_monitor_state: missing or invalid 'montab' argument\", 1, true), why)");
    }

    #[test]
    fn seqand() {
        run("local ext = require 'rfsm.ext'
             local function sub(name) return init(S {
               a = S { entry = function() say(name, 'a+') end, exit = function() say(name, 'a-') end },
               b = S { entry = function() say(name, 'b+') end, exit = function() say(name, 'b-') end },
               T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e_' .. name} }, T { src='b', tgt='a', events={'never'} } }) end
             local fsm = init(S { off = S {}, par = ext.seqand { order={'one'}, one = sub 'one', two = sub 'two' },
               T { src='initial', tgt='off' }, T { src='off', tgt='par', events={'on'} }, T { src='par', tgt='off', events={'off'} } })
             lines = {} rfsm.run(fsm) rfsm.send_events(fsm, 'on') rfsm.run(fsm) eq(lines, {'onea+', 'twoa+'})
             rfsm.send_events(fsm, 'e_two') rfsm.run(fsm) eq(lines, {'onea+', 'twoa+', 'twoa-', 'twob+'})
             lines = {} rfsm.send_events(fsm, 'off') rfsm.run(fsm) eq(lines, {'onea-', 'twob-'}) eq(leaf(fsm), 'root.off')
             lines = {} rfsm.send_events(fsm, 'on') rfsm.run(fsm) eq(lines, {'onea+', 'twoa+'})");
    }
}

mod marsh {
    use super::run;

    const FSM: &str = "local fsm = init(S { a = S { x = S {}, T { src='initial', tgt='x' } }, T { src='initial', tgt='a', events={}, pn=3 } }) ";

    #[test]
    fn model2tab_structure() {
        run(&format!("{FSM} local t = require('rfsm.marsh').model2tab(fsm)
             eq(t.id, 'root') eq(t.type, 'state') eq(#t.subnodes, 2) eq(#t.transitions, 1)
             local tr = t.transitions[1] eq({{tr.type, tr.src, tr.tgt, tr.pn}}, {{'transition', 'root.initial', 'root.a.initial', 3}})"));
    }

    #[test]
    fn model2tab_requires_initialized() {
        run("eq(pcall(require('rfsm.marsh').model2tab, S {}), false)");
    }

    #[test]
    fn actinfo2tab() {
        run(&format!(
            "{FSM} local m = require 'rfsm.marsh' eq(m.actinfo2tab(fsm), false) rfsm.run(fsm)
             local t = m.actinfo2tab(fsm) eq({{t.fqn, t.mode}}, {{'root.a.x', 'done'}})"
        ));
    }

    #[test]
    fn rfsm2json_encode() {
        let values = run(&format!("{FSM} rfsm.run(fsm) return require('rfsm.rfsm2json').encode(fsm)"));
        let json: serde_json::Value = serde_json::from_str(values[0].as_str().expect("a text")).expect("JSON");
        assert_eq!((&json["version"], &json["active_leaf"]), (&2.into(), &"root.a.x".into()));
        assert_eq!(json["graph"]["subnodes"].as_array().unwrap().len(), 2);
    }
}

mod plantuml {
    use super::run;

    fn encode(title: &str) -> String {
        let text = format!(
            "local fsm = init(S {{ on = S {{ x = S {{}}, c = C {{}}, T {{ src='initial', tgt='x' }}, T {{ src='x', tgt='c', events={{'e_done'}} }} }}, off = S {{}},
               T {{ src='initial', tgt='off' }}, T {{ src='off', tgt='on', events={{'e_on', 'e_go'}} }}, T {{ src='.on.c', tgt='off' }} }})
             return require('rfsm.plantuml').encode(fsm{title})"
        );
        run(&text)[0].as_str().expect("a text").to_owned()
    }

    #[test]
    fn encode_basics() {
        let text = encode("");
        assert!(text.starts_with("@startuml\n") && text.ends_with("@enduml"), "{text}");
        assert!(text.contains("root_off --> root_on : e_on, e_go"), "{text}");
    }

    #[test]
    fn states_and_nesting() {
        let text = encode("");
        let block = text.split("state \"on\" as root_on {").nth(1).expect("a block").split("\n}").next().unwrap();
        assert!(block.contains("state \"x\" as root_on_x") && block.contains("as root_on_c <<choice>>"), "{text}");
    }

    #[test]
    fn transitions_and_initial() {
        let text = encode("");
        assert!(text.contains("[*] --> root_off") && text.contains("  [*] --> root_on_x"), "{text}");
        assert!(text.contains("root_on_x --> root_on_c : e_done\n"), "the source is cut: {text}");
        assert!(text.contains("root_on_c --> root_off"), "{text}");
    }

    #[test]
    fn title() {
        assert!(encode(", 'My machine'").contains("title My machine"));
        assert!(!encode("").contains("title"));
    }

    #[test]
    fn requires_initialized() {
        run("eq(pcall(require('rfsm.plantuml').encode, S {}), false)");
    }
}
