//! Functions that misbehave: each call ends, the error is told, and the coordinator goes on.

use super::support::Model;
use davit::limits;

/// A machine with `a` and `b`, events `e` and `back`; `parts` are put where they belong.
fn model(a: &str, transition: &str) -> Model {
    Model::new(&format!(
        "return rfsm.state {{ a = rfsm.state {{ {a} }}, b = rfsm.state {{ entry = function() print('in b') end }},
           rfsm.trans {{ src='initial', tgt='a' }}, rfsm.trans {{ src='a', tgt='b', events={{'e'}} {transition} }},
           rfsm.trans {{ src='b', tgt='a', events={{'back'}} }} }}"
    ))
}

/// It reached `b` with one error of that tag, whose text has these words.
fn told(model: &Model, tag: &str, words: &str) {
    let seen = model.play(&["run", "e", "run"]);
    assert_eq!(seen[2].active.last().unwrap(), "root.b", "{seen:?}");
    let notes: Vec<&String> = seen.iter().flat_map(|s| &s.notes).filter(|n| n.starts_with("error: ")).collect();
    assert_eq!(notes.len(), 1, "{notes:?}");
    assert!(notes[0].contains(tag) && notes[0].contains(words), "{notes:?}");
}

#[test]
fn endless_entries_exits_and_effects_end() {
    let endless = "function() while true do end end";
    told(&model(&format!("entry = {endless}"), ""), "ENTRY", "million instructions");
    told(&model(&format!("exit = {endless}"), ""), "EXIT", "million instructions");
    told(&model("", &format!(", effect = {endless}")), "EFFECT", "million instructions");
    told(&model(&format!("doo = {endless}"), ""), "DOO", "million instructions");
}

#[test]
fn an_endless_guard_says_no() {
    let model = model("", ", guard = function() repeat until false end");
    let seen = model.play(&["run", "e"]);
    assert_eq!(seen[1].active.last().unwrap(), "root.a");
    assert!(seen[1].notes.iter().any(|n| n.contains("GUARD") && n.contains("million instructions")), "{seen:?}");
}

#[test]
fn protected_calls_and_coroutines_do_not_outlive_the_budget() {
    for body in [
        "while true do pcall(function() while true do end end) end",
        "while true do xpcall(function() while true do end end, function() end) end",
        "while true do coroutine.resume(coroutine.create(function() while true do end end)) end",
        "while true do coroutine.wrap(function() for i = 1, 10 do end end)() end",
        "local function f() return f() end f()",
        // Turns of a machine that goes round for ever count, though it has no functions.
        "local m = rfsm.init(rfsm.state { err = false, warn = false, info = false, x = rfsm.state {}, y = rfsm.state {},
           rfsm.trans { src='initial', tgt='x' }, rfsm.trans { src='x', tgt='y', events={ 'e_done' } },
           rfsm.trans { src='y', tgt='x', events={ 'e_done' } } }) while true do pcall(rfsm.run, m) end",
        // What is closed on the way out is counted too.
        "local c <close> = setmetatable({}, { __close = function() while true do end end }) while true do end",
        "coroutine.wrap(function()
           local c <close> = setmetatable({}, { __close = function() while true do end end }) while true do end end)()",
    ] {
        told(&model(&format!("entry = function() {body} end"), ""), "ENTRY", "million instructions");
    }
}

#[test]
fn the_budget_is_of_one_call() {
    // Two thirds of a budget in each of three calls.
    let work = limits::CALL_INSTRUCTIONS / 6;
    let body = format!("function() for i = 1, {work} do local x = i * i end end");
    let model = model(&format!("entry = {body}, exit = {body}"), &format!(", effect = {body}"));
    assert_eq!(model.notes(&["run", "e", "run"]), ["in b"]);
}

#[test]
fn memory_is_bounded() {
    let eats = "function() local t = {} for i = 1, 1e7 do t[i] = ('x'):rep(1000000) .. i end end";
    told(&model(&format!("entry = {eats}"), ""), "ENTRY", "MB of memory");
    told(&model("", ", effect = function() local s = ('x'):rep(1e9) end"), "EFFECT", "");
}

#[test]
fn what_is_closed_is_an_error_that_names_it() {
    told(&model("entry = function() io.open('x') end", ""), "ENTRY", "open: [io]");
    for (call, name) in [("os.execute('true')", "os"), ("io.open('x')", "io"), ("debug.sethook()", "debug")] {
        told(&model(&format!("entry = function() {call} end"), ""), "ENTRY", &format!("'{name}'"));
    }
    told(&model("entry = function() dofile('x') end", ""), "ENTRY", "dofile");
    told(&model("entry = function() assert(load('\\27Lua')) end", ""), "ENTRY", "");
}

#[test]
fn deep_recursion_and_errors_that_are_no_texts() {
    told(&model("entry = function() local function f() return 1 + f() end f() end", ""), "ENTRY", "");
    told(&model("entry = function() error({ code = 1 }) end", ""), "ENTRY", "");
    told(&model("entry = function() error() end", ""), "ENTRY", "");
    told(
        &model("entry = function() error(setmetatable({}, { __tostring = function() error 'again' end })) end", ""),
        "ENTRY",
        "",
    );
}

#[test]
fn a_printer_that_fails_does_not_swallow_the_error() {
    let model = Model::new(
        "return rfsm.state { err = function() error('the printer too') end, a = rfsm.state { entry = function() error('first', 0) end },
           rfsm.trans { src='initial', tgt='a' } }",
    );
    let notes = model.notes(&["run"]);
    assert!(notes.iter().any(|n| n.contains("ENTRY") && n.contains("first")), "{notes:?}");
}

#[test]
fn a_flood_of_events_and_lines_is_bounded_and_said() {
    let flood = "entry = function(fsm) for i = 1, 10000 do rfsm.send_events(fsm, 'x' .. i) end end";
    let seen = model(flood, "").play(&["", "run"]);
    assert!(seen[0].queue.len() <= limits::CHART_QUEUE, "{}", seen[0].queue.len());
    assert_eq!(seen[0].queue[0], "x1");
    assert_eq!(seen[0].notes, ["error: 8,976 events found no room: at most 1,024 wait for a step"]);
    // One line a step, however many calls sent them.
    let flood = "entry = function(fsm) for i = 1, 10000 do rfsm.send_events(fsm, 'x', 'y') end end";
    assert_eq!(model(flood, "").notes(&[""]), ["error: 18,976 events found no room: at most 1,024 wait for a step"]);
    let notes =
        model("entry = function() for i = 1, 2000 do print(i) end print(('x'):rep(1e6)) end", "").notes(&["run"]);
    assert_eq!(notes.len(), limits::SAID_LINES + 1);
    assert!(notes.last().unwrap().contains("more lines"), "{:?}", notes.last());
}

#[test]
fn machines_made_for_ever_are_bounded() {
    let body = "entry = function() for i = 1, 100000 do local m = rfsm.init(rfsm.state { err = false, warn = false, info = false,
        x = rfsm.state {}, rfsm.trans { src='initial', tgt='x' } }) if not m then print('no more at ' .. i) return end end end";
    let notes = model(body, "").notes(&["run"]);
    assert!(notes.iter().any(|n| n.starts_with("no more at")), "{notes:?}");
}

#[test]
fn the_coordinators_own_machine_cannot_be_stepped_from_inside() {
    told(&model("entry = function(fsm) rfsm.run(fsm) end", ""), "ENTRY", "stepped by Davit");
    told(&model("entry = function(fsm) rfsm.reset(fsm) end", ""), "ENTRY", "stepped by Davit");
}

/// What our own functions raise is a text as Lua's own errors are: with the line that called, and nothing of what is inside.
#[test]
fn errors_of_ours_are_texts_with_a_place() {
    let body = "entry = function(fsm)
        print(pcall(function() rfsm.step(fsm) end))
        print(pcall(rfsm.load, 'absent.lua'))
        print(xpcall(function() rfsm.load('absent.lua') end, function(why) return type(why) end))
        print(coroutine.resume(coroutine.create(function() rfsm.reset(fsm) end)))
        print(pcall(coroutine.wrap(function() rfsm.reset(fsm) end)))
        print(pcall(function() rfsm.state('x') end))
        rfsm.exit_state(fsm, fsm)
    end";
    let notes = model(body, "").notes(&["run"]);
    assert_eq!(
        notes,
        [
            "false model.lua:2: rfsm.step: the coordinator is stepped by Davit",
            "false model.lua:3: `absent.lua` was not loaded before",
            "false string",
            "false model.lua:5: rfsm.reset: the coordinator is stepped by Davit",
            "false model.lua:6: rfsm.reset: the coordinator is stepped by Davit",
            "false model.lua:7: one table is wanted here, this is a string",
            "error: ENTRY error executing entry of root.a: model.lua:8: rfsm.exit_state: the coordinator is stepped by Davit",
        ]
    );
}

/// A table that stands in tables many times over is not written down for ever.
#[test]
fn what_is_written_as_json_is_bounded() {
    let body = "local t = {} for i = 1, 60 do t = { t, t } end
        local m = rfsm.init(rfsm.state { err = false, warn = false, info = false,
          x = rfsm.state {}, rfsm.trans { src='initial', tgt='x' } })
        m._id = t require('rfsm.rfsm2json').encode(m)";
    told(&model(&format!("entry = function() {body} end"), ""), "ENTRY", "million instructions");
}

/// The engine's turns for a machine that a model steps are counted too.
#[test]
fn machines_that_are_stepped_for_ever_end() {
    let body = "local m = rfsm.init(rfsm.state { err = false, warn = false, info = false,
          x = rfsm.state {}, rfsm.trans { src='initial', tgt='x' }, rfsm.trans { src='x', tgt='x', events={ 'e_done' } } })
        while true do rfsm.run(m) end";
    told(&model(&format!("entry = function() {body} end"), ""), "ENTRY", "million instructions");
}

#[test]
fn what_the_host_should_have_given_is_named_where_it_is_missed() {
    told(&model("entry = function() rtt.log('x') end", ""), "ENTRY", "`--host FILE` of `davit sim`");
    told(&model("", ", effect = function() yarp() end"), "EFFECT", "there is no `yarp`");
}

#[test]
fn a_step_hook_that_fails_is_told() {
    let model = Model::new(
        "local hooked = false
         return rfsm.state { a = rfsm.state { entry = function(fsm) rfsm.pre_step_hook_add(fsm, function() error('hook', 0) end) end },
           rfsm.trans { src='initial', tgt='a' } }",
    );
    let notes = model.notes(&["", "x"]);
    assert!(notes.iter().any(|n| n.contains("HOOK") && n.contains("hook")), "{notes:?}");
}

#[test]
fn a_doo_that_never_rests_leaves_room_for_events() {
    let seen = model("doo = function() while true do rfsm.yield(false) end end", "").play(&["", "e", "run"]);
    assert_eq!(seen[2].active.last().unwrap(), "root.b");
}

/// Texts that a careless or hostile model may have: none may take the program down, whatever is said of them.
#[test]
fn strange_models_are_refused_or_read() {
    use super::support::read;
    let use_functions = "entry = function() end";
    let texts = [
        "local s = rfsm.state { entry = function() end } s.me = s return s".to_owned(),
        "local s = rfsm.state { entry = function() end } for i = 1, 1000 do s = rfsm.state { x = s, entry = s.entry } end return s".to_owned(),
        "local t = { f = function() end } t.t = t return rfsm.state { t = t, a = rfsm.state { entry = t.f }, rfsm.trans { src='initial', tgt='a' } }".to_owned(),
        "return rfsm.state { entry = 1, exit = {}, doo = 'x', rfsm.trans { src = {}, tgt = function() end, guard = 3, effect = true, pn = 'high', events = 7 } }".to_owned(),
        "return rfsm.state { [1.5] = rfsm.state { entry = function() end }, [true] = rfsm.trans {}, rfsm.conn {} }".to_owned(),
        "return setmetatable({ entry = function() end }, { rfsm = true, __index = function() error('index') end })".to_owned(),
        "return setmetatable({ type = function() return 'state' end, entry = function() end }, { rfsm = true, __pairs = function() error('pairs') end })".to_owned(),
        "rfsm.state.type = nil return rfsm.state { entry = function() end }".to_owned(),
        "string.format, table.insert, pairs, ipairs, type = nil return rfsm.state { entry = function() end, a = rfsm.state {}, rfsm.trans { src='initial', tgt='a' } }".to_owned(),
        "_G.rfsm = nil return 7".to_owned(),
        "setmetatable(_G, nil) return rfsm.state { entry = function() end }".to_owned(),
        "return rfsm.load('model.lua')".to_owned(),
        "return rfsm.load('/etc/passwd')".to_owned(),
        format!(r"return rfsm.state {{ {use_functions}, rfsm.trans {{ src='a\0b', tgt='\255', events={{ '\255', 'x y', 0/0, -0.0 }} }} }}"),
        format!("local s = rfsm.state {{ {use_functions} }} for i = 1, 20000 do s['s' .. i] = rfsm.state {{}} end return s"),
        "coroutine.yield(1) return rfsm.state { entry = function() end }".to_owned(),
        "error(nil) return function() end".to_owned(),
        "return function() end".to_owned(),
        r"\27Lua".to_owned(),
    ];
    for text in texts {
        let loaded = read(&[("model.lua", &text)], &[]);
        assert!(loaded.coordinator.is_some() || !loaded.findings.is_empty(), "nothing is said of {text}");
        assert!(
            loaded.findings.iter().all(|f| f.help.is_some() || f.severity != davit::model::Severity::Error),
            "{:?}",
            loaded.findings
        );
    }
}

#[test]
fn files_that_load_each_other_in_a_circle_are_named() {
    for files in [
        &[("model.lua", "return rfsm.load('model.lua')")][..],
        &[
            ("model.lua", "local f = function() end return rfsm.load('b.lua')"),
            ("b.lua", "return rfsm.load('model.lua')"),
        ],
    ] {
        let loaded = super::support::read(files, &[]);
        assert!(loaded.coordinator.is_none());
        let text = &loaded.findings[0].message;
        let way = if files.len() == 1 { "model.lua -> model.lua" } else { "model.lua -> b.lua -> model.lua" };
        assert!(text.contains("files load each other in a circle") && text.contains(way), "{text}");
    }
}

/// What files print while they are loaded is one remark, and is not said again when they are run.
#[test]
fn what_is_printed_while_a_model_loads_is_told_once() {
    let prints = (1..=9).map(|i| format!("print('line {i}') ")).collect::<String>();
    let text = format!(
        "{prints} local m = rfsm.init(rfsm.state {{ x = rfsm.state {{}} }})
         return rfsm.state {{ a = rfsm.state {{ entry = function() print('in a') end }}, rfsm.trans {{ src='initial', tgt='a' }} }}"
    );
    let loaded = super::support::read(&[("model.lua", &text)], &[]);
    let said: Vec<_> = loaded.findings.iter().filter(|f| f.code.to_string() == "lua::print").collect();
    assert_eq!(said.len(), 1, "{said:?}");
    let expected = "`model.lua` prints while it is loaded: line 1; line 2; line 3; line 4; line 5; and 5 more lines";
    assert_eq!(said[0].message, expected);
    assert_eq!(Model::new(&text).notes(&["run"]), ["in a"]);
}

/// What functions print is placed between what happened before and after it.
#[test]
fn notes_stand_where_they_happened() {
    let body = "entry = function() print('in a') end, exit = function() print('out of a') end";
    let seen = model(body, ", effect = function() print('on the way') end").play(&["", "e"]);
    let text = seen[1].to_string();
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let at = |line: &str| lines.iter().position(|l| *l == line).unwrap_or_else(|| panic!("{line}: {lines:?}"));
    assert!(at("exit root.a") < at("note: out of a") && at("note: out of a") < at("note: on the way"));
    assert!(at("note: on the way") < at("entry root.b") && at("entry root.b") < at("note: in b"), "{lines:?}");
    assert_eq!(seen[1].notes_after, [1, 1, 2]);
}

#[test]
fn a_machine_that_never_rests_is_shown_in_short() {
    let model = Model::new(
        "return rfsm.state { a = rfsm.state { entry = function() print('a') end }, b = rfsm.state {}, rfsm.trans { src='initial', tgt='a' },
           rfsm.trans { src='a', tgt='b', events={'e_done'} }, rfsm.trans { src='b', tgt='a', events={'e_done'} } }",
    );
    let seen = &model.play(&["run"])[0];
    assert!(seen.actions.len() > 10_000);
    let text = seen.to_string();
    let left_out = seen.actions.len() - 2 * limits::SIM_ACTIONS_SHOWN;
    assert!(text.contains(&format!("… {left_out} more are left out")), "{}", text.len());
    assert!(text.lines().count() < 2 * limits::SIM_ACTIONS_SHOWN + limits::SIM_NOTES + 10);
}

/// Events and errors that are no texts are told without addresses, so that two runs tell the same.
#[test]
fn nothing_that_is_told_has_an_address() {
    let body = "entry = function(fsm) rfsm.send_events(fsm, { 1 }, print, fsm[2].events[1]) error({}) end";
    let model = Model::new(&format!(
        "local known = {{}} return rfsm.state {{ a = rfsm.state {{ {body} }}, b = rfsm.state {{}}, rfsm.trans {{ src='initial', tgt='a' }},
           rfsm.trans {{ src='a', tgt='b', events={{ known }}, guard=function() return false end }} }}"
    ));
    let seen = &model.play(&[""])[0];
    assert_eq!(seen.queue[..3], ["table#unlisted1", "function#unlisted2", "table#1"], "{:?}", seen.queue);
    assert_eq!(seen.notes, ["error: ENTRY error executing entry of root.a: the error is a table and no text"]);
}

/// `docs/rfsm.md` §5: set after the entry, away after the exit.
#[test]
fn the_active_leaf_is_found_in_the_machine() {
    let text = "local function show(where, fsm) print(where, fsm._act_leaf and fsm._act_leaf._fqn) end
        local a = rfsm.state { entry = function(fsm) show('entry', fsm) end, doo = function(fsm) show('doo', fsm) end,
                               exit = function(fsm) show('exit', fsm) end }
        return rfsm.state { a = a, b = rfsm.state {}, rfsm.trans { src='initial', tgt='a' },
          post_step_hook = function(fsm) show('after', fsm) end,
          rfsm.trans { src='a', tgt='b', events={'e'}, effect = function(fsm) show('effect', fsm) end } }";
    let notes = Model::new(text).notes(&["", "run", "e"]);
    assert_eq!(notes[..2], ["entry false", "after root.a"], "{notes:?}");
    assert!(notes.contains(&"doo root.a".to_owned()), "{notes:?}");
    assert_eq!(notes[notes.len() - 3..], ["exit root.a", "effect false", "after root.b"], "{notes:?}");
    let own = super::lab::run(
        "local m = rfsm.init(rfsm.state { err = false, warn = false, info = false, a = rfsm.state {}, b = rfsm.state {},
           rfsm.trans { src='initial', tgt='a' }, rfsm.trans { src='a', tgt='b', events={'e'} } })
         local before = m._act_leaf
         rfsm.run(m) local first = m._act_leaf._fqn
         rfsm.send_events(m, 'e') rfsm.run(m) local second = m._act_leaf._fqn
         rfsm.exit_state(m, m) local left = m._act_leaf rfsm.run(m)
         rfsm.reset(m) return before, first, second, left, m._act_leaf",
    );
    assert_eq!(serde_json::Value::from(own), serde_json::json!([false, "root.a", "root.b", false, false]));
}
