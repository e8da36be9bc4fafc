//! `rfsm.init`: what a model is, copies, printers, the default connector (docs/rfsm.md §1.1, §1.2, §1.4, §2.1 to §2.5, §2.12).

use crate::lab::{run, run_with, told};

#[test]
fn events_are_compared_by_value_and_tables_by_identity() {
    run("local key = {}
         local t = S { a = S {}, b = S {}, c = S {}, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={ key } }, T { src='a', tgt='c', events={ 42, true } } }
         local fsm = init(t) rfsm.run(fsm)
         rfsm.send_events(fsm, key) rfsm.run(fsm) eq(leaf(fsm), 'root.a', 'init copied the table')
         rfsm.send_events(fsm, fsm._transitions[2].events[1]) rfsm.run(fsm) eq(leaf(fsm), 'root.b', 'the copy matches')
         local again = init(t) rfsm.run(again) rfsm.send_events(again, 42.0) rfsm.run(again) eq(leaf(again), 'root.c')
         local third = init(t) rfsm.run(third) rfsm.send_events(third, true) rfsm.run(third) eq(leaf(third), 'root.c')");
}

#[test]
fn a_doo_around_an_initial_is_refused_and_still_announced() {
    run("t = S { T { src='initial', tgt='x' }, bad = S { x = S {}, doo = function() end, T { src='initial', tgt='x' } }, x = S {} }
         t.info = say
         eq(init(t), false)
         eq(lines[1], 'INFO: created undeclared connector root.initial')
         eq(lines[2], 'ERROR: merge failed: parent root.bad defines a doo function!')
         eq(lines[3], 'INFO: created undeclared connector root.bad.initial')");
}

#[test]
fn a_template_is_reusable_and_functions_are_shared() {
    run("local n = 0
         local t = S { a = S { entry = function(f, s) s.count = (s.count or 0) + 1 n = n + 1 end }, T { src='initial', tgt='a' } }
         local one, two = init(t), init(t) rfsm.run(one) rfsm.run(two)
         eq(n, 2) eq(one.a.count, 1) eq(two.a.count, 1) eq(t.a.count, nil) assert(one.a ~= two.a)");
}

/// Whatever stands there, unless it is a node or a transition.
#[test]
fn free_fields_and_names_with_an_underscore_are_no_parts() {
    run("local fsm = init(S { a = S { _b = S {}, note = 'x', list = { S {} } }, _hidden = S {}, T { src='initial', tgt='a' },
           named = T { src='a', tgt='a', events={'e'} }, _t = T { src='nobody', tgt='nowhere' } })
         assert(rfsm.is_leaf(fsm.a), 'metadata makes no composite')
         rfsm.run(fsm) eq(leaf(fsm), 'root.a') eq(fsm.a.note, 'x')
         local n = 0 rfsm.post_step_hook_add(fsm, function() n = n + 1 end)
         rfsm.send_events(fsm, 'e') eq(rfsm.step(fsm), false, 'a transition under a name is one') eq(n, 1)
         eq(#rfsm.mapfsm(function(o, s, name) return name end, fsm), 5)");
}

#[test]
fn any_class_that_says_so_is_a_state() {
    run("local mine = { rfsm = true, type = function() return 'state' end } mine.__index = mine
         local x = setmetatable({ entry = function() say 'x+' end }, mine)
         assert(rfsm.is_state(x) and not rfsm.is_conn(x) and not rfsm.is_state({}) and not rfsm.is_state(setmetatable({}, { type = mine.type })))
         local fsm = init(S { x = x, T { src='initial', tgt='x' } }) lines = {} rfsm.run(fsm)
         eq(leaf(fsm), 'root.x') eq(lines, {'x+'})");
}

#[test]
fn the_printers_are_those_of_the_root() {
    let said = told(
        "fsm = rfsm.init(S { err = false, warn = true, info = 7, a = S { err = say, warn = false }, T { src='initial', tgt='a' } })
         fsm.err('nothing') fsm.warn('loud') fsm.info('plain') fsm.dbg('nothing')
         eq(lines, {}, 'what a state inside has is none')
         local own = rfsm.init(S { err = say, warn = say, info = say, dbg = say, a = S {}, T { src='initial', tgt='a' } })
         eq(lines[1], 'INFO: created undeclared connector root.initial')
         local none = rfsm.init(S { a = S {}, T { src='initial', tgt='a' } })
         none.err('e') none.warn('w') none.info('i') none.dbg('d')",
    );
    assert_eq!(
        said,
        [
            "Info unknown printer: info",
            "Info INFO: created undeclared connector root.initial",
            "Info WARNING: no outgoing transitions from node 'root.a'",
            "Info loud",
            "Info plain",
            "Info INFO: created undeclared connector root.initial",
            "Warn WARNING: no outgoing transitions from node 'root.a'",
            "Err e",
            "Warn w",
            "Info i",
        ]
    );
}

/// rFSM puts the printer in its place, and trips over the reference later.
#[test]
fn a_child_of_the_root_with_a_printers_name_is_replaced() {
    for name in ["err", "warn", "info", "dbg"] {
        let said = told(&format!(
            "local t = S {{ a = S {{}}, {name} = S {{}}, T {{ src='initial', tgt='a' }}, T {{ src='a', tgt='{name}', events={{'e'}} }} }}
             eq(pcall(rfsm.init, t) and rfsm.init(t), false, 'the reference finds a function')"
        ));
        assert_eq!(said[0], format!("Info unknown printer: {name}"), "{said:?}");
        let ran = told(&format!(
            "local fsm = rfsm.init(S {{ a = S {{}}, {name} = S {{}}, T {{ src='initial', tgt='a' }} }})
             eq(type(fsm.{name}), 'function') rfsm.run(fsm) eq(leaf(fsm), 'root.a', 'nothing refers to it')"
        ));
        assert_eq!(ran[0], format!("Info unknown printer: {name}"), "{ran:?}");
    }
}

#[test]
fn one_state_at_two_names_stays_one_object() {
    run("local x = S { entry = function(f, s) say(s._fqn) end }
         local fsm = init(S { a = x, b = x, T { src='initial', tgt='a' }, T { src='a', tgt='b', events={'e'} } })
         assert(fsm.a == fsm.b and fsm.a ~= x) eq(fsm.a._fqn, fsm.b._fqn)
         assert(fsm.a._fqn == 'root.a' or fsm.a._fqn == 'root.b')
         lines = {} rfsm.run(fsm) rfsm.send_events(fsm, 'e') rfsm.run(fsm) eq(lines, { fsm.a._fqn, fsm.a._fqn })");
}

#[test]
fn only_a_source_called_initial_makes_the_connector_and_it_is_announced() {
    run("local fsm = init(S { info = say, a = S { x = S {}, T { src='initial', tgt='x' } }, b = S { y = S {} }, T { src='initial', tgt='a' },
           T { src='a', tgt='.b.y', events={'e'} } })
         eq(lines[1], 'INFO: created undeclared connector root.initial')
         eq(lines[2], 'INFO: created undeclared connector root.a.initial')
         assert(rfsm.is_conn(fsm.initial) and rfsm.is_conn(fsm.a.initial)) eq(fsm.b.initial, nil)
         lines = {} eq(init(S { a = S {}, T { src='a', tgt='initial' } }), false)
         eq(lines, {'ERROR: fsm root without initial connector'}, 'never for a target')
         lines = {} eq(init(S { T { src='initial', tgt='a' } }), false, 'a root without nodes is no composite')
         eq(lines, {'ERROR: fsm root without initial connector'})
         lines = {} local own = init(S { info = say, initial = C {}, a = S {}, T { src='initial', tgt='a' } })
         eq(lines, {\"WARNING: no outgoing transitions from node 'root.a'\"}, 'the one that is there is taken')");
}

#[test]
fn what_is_loaded_must_be_a_state() {
    let bad = "return { a = 1 }";
    run_with(
        &[("bad.lua", bad), ("good.lua", "shared = 7 return rfsm.state { a = rfsm.state {} }")],
        "local ok, why = pcall(rfsm.load, 'bad.lua') eq(ok, false)
         assert(tostring(why):find(\"rfsm.load: no valid rfsm in file 'bad.lua' found.\", 1, true), tostring(why))
         local t = rfsm.load 'good.lua' eq(t._initialized, nil) eq(shared, 7, 'files share their globals')
         eq(rfsm.is_initialized_root(t), false)
         ok, why = pcall(rfsm.load_str, 'return nonsense(', 'my text') eq(ok, false)
         assert(why:find('rfsm.load_str: failed to load chunk: ', 1, true) and why:find('my text', 1, true), why)",
    );
}

#[test]
fn a_plugin_works_on_every_later_machine_and_on_no_earlier_one() {
    run("local function make() return init(S { a = S {}, T { src='initial', tgt='a' } }) end
         local before = make() require 'rfsm.emem' local after = make() local last = make()
         eq(before.emem, nil) assert(after.emem and last.emem and after.emem ~= last.emem)
         require 'rfsm.preview' eq(pcall(init, S { a = S { prepare = 1 }, T { src='initial', tgt='a' } }), false, 'its errors come through')");
}
