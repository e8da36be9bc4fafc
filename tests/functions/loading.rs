//! Which files are read, what they find, and what is said of those that are refused.

use super::support::{Model, line, read, refused};
use davit::lang::{LoadOptions, Sources, load_coordinator};
use davit::model::codes;
use std::path::Path;

const WITH_GUARD: &str = "
return rfsm.state {
  a = rfsm.state {},
  rfsm.trans { src = 'initial', tgt = 'a',
               guard = function() return true end },
}";

#[test]
fn functions_need_trust_and_the_finding_points_at_the_function() {
    let from = Sources::memory([("model.lua", WITH_GUARD.as_bytes())]);
    let loaded = load_coordinator(&from, Path::new("model.lua"), &LoadOptions::default());
    assert!(loaded.coordinator.is_none());
    let finding = loaded.findings.iter().find(|f| f.code == codes::CHART_FUNCTION).expect("said");
    assert!(finding.help.as_ref().unwrap().contains("trusted: true"), "{finding:?}");
    assert_eq!(loaded.sources.locate(finding.origin).unwrap().line, 4, "of the transition with the guard");
    assert!(!Model::new(WITH_GUARD).is_pure());
}

#[test]
fn a_pure_file_stays_pure_and_is_read_strictly_though_trusted() {
    assert!(
        Model::new("return state { a = state { entry = 'e_in' }, trans { src = 'initial', tgt = 'a' } }").is_pure()
    );
}

#[test]
fn parts_of_a_model_are_loaded_from_files_beside_it() {
    let main = "return rfsm.state { sub = rfsm.load('parts/sub.lua'), rfsm.trans { src = 'initial', tgt = 'sub' } }";
    let pure = "return rfsm.state { x = rfsm.state {}, rfsm.trans { src = 'initial', tgt = 'x' } }";
    let files = [("model.lua", main), ("parts/sub.lua", pure)];
    let model = Model::of(&files, &[]);
    assert!(model.is_pure(), "composition needs no trust");
    let from = Sources::memory(files.map(|(name, text)| (name, text.as_bytes())));
    let untrusted = load_coordinator(&from, Path::new("model.lua"), &LoadOptions::default());
    assert!(untrusted.coordinator.is_some(), "{:?}", untrusted.findings);

    let noisy = pure.replace("x = rfsm.state {}", "x = rfsm.state { entry = function(f, s) print(s._fqn) end }");
    let model = Model::of(&[("model.lua", main), ("parts/sub.lua", &noisy)], &[]);
    assert_eq!(model.notes(&["run"]), ["root.sub.x"]);
}

#[test]
fn a_fault_in_a_loaded_file_is_shown_there() {
    let main = "return rfsm.state { sub = rfsm.load('sub.lua'), rfsm.trans { src = 'initial', tgt = 'sub' } }";
    let loaded =
        read(&[("model.lua", main), ("sub.lua", "\n\nreturn rfsm.state { entry = function() end, x = nil + 1 }")], &[]);
    let finding = &loaded.findings[0];
    let place = loaded.sources.locate(finding.origin).unwrap();
    assert_eq!((&*loaded.sources.file(place.file).name, place.line), ("sub.lua", 3), "{finding:?}");
    let missing = read(&[("model.lua", main)], &[]);
    assert!(missing.coordinator.is_none());
    assert!(missing.findings.iter().any(|f| f.message.contains("sub.lua")), "{:?}", missing.findings);
}

#[test]
fn what_a_model_expects_of_its_host_is_named_and_can_be_given() {
    let text = "local tc = rtt.getTC()\nreturn rfsm.state { a = rfsm.state { entry = function() print(tc) end },\n rfsm.trans { src = 'initial', tgt = 'a' } }";
    let (finding, loaded) = refused(text);
    assert_eq!(finding.code, codes::LUA_HOST_MISSING, "{finding:?}");
    assert!(finding.message.contains("`rtt`") && finding.help.as_ref().unwrap().contains("--host"), "{finding:?}");
    assert_eq!(line(&loaded, &finding), 1);
    let host = "rtt = { getTC = function() return 'the task context' end }";
    let model = Model::of(&[("model.lua", text), ("host.lua", host)], &["host.lua"]);
    assert_eq!(model.notes(&["run"]), ["the task context"]);
}

#[test]
fn files_and_processes_are_closed() {
    for name in ["io", "os"] {
        let (finding, _) = refused(&format!("local x = {name}.read\nreturn rfsm.state {{ entry = function() end }}"));
        assert_eq!(finding.code, codes::LUA_CLOSED, "{finding:?}");
        assert!(finding.help.as_ref().unwrap().contains(&format!("open: [{name}]")), "{finding:?}");
    }
    for call in ["dofile('x')", "loadfile('x')", "debug.getinfo(1)", "string.dump(print)"] {
        let loaded = read(&[("model.lua", &format!("{call}\nreturn rfsm.state {{ entry = function() end }}"))], &[]);
        assert!(loaded.coordinator.is_none(), "{call}");
    }
}

#[test]
fn a_file_that_runs_for_ever_or_eats_memory_is_ended() {
    let (finding, _) = refused("local f = function() end\nwhile true do pcall(f) end");
    assert_eq!(finding.code, codes::LUA_INSTRUCTIONS, "{finding:?}");
    let (finding, _) = refused("local one = ('x'):rep(5000000) local t = {} for i = 1, 1e9 do t[i] = one .. i end");
    assert_eq!(finding.code, codes::LUA_MEMORY, "{finding:?}");
    // What a model says itself is its own, whatever the words.
    for word in ["three million instructions", "2 MB of memory"] {
        let (finding, _) = refused(&format!("error('{word} are not enough')"));
        assert_eq!(finding.code, codes::LUA_ERROR, "{finding:?}");
    }
    let (finding, _) = refused("local t = setmetatable({}, { __gc = function() end })\nreturn rfsm.state {}");
    assert!(finding.message.contains("__gc"), "{finding:?}");
}

/// What unmodified models of the years 2010 to 2013 need (docs/rfsm.md §11.1).
#[test]
fn the_legacy_dialect_is_read() {
    let text = r#"
        require("rfsm_timeevent")
        require("rfsm_emem")
        require("rfsmpp")
        require("rfsm.await")
        local t = rfsm_timeevent or error("no global")
        t.set_gettime_hook(function() return 10, 500 end)
        local unpacked = { unpack({ 1, 2 }) }
        return rfsm.composite_state:new {
            dbg = rfsmpp.gen_dbgcolor("name", { STATE_ENTER = true }, false),
            idle_hook = function() end,
            free = { field = 1 }, number = 3,
            choice = rfsm.junc:new {},
            a = rfsm.simple_state:new { doo = function() end, my_data = unpacked },
            b = rfsm.sista { entry = function(fsm, s) print("b", utils.tab2str({}), ansicolors.red .. "x") end },
            rfsm.trans:new { src = 'initial', tgt = 'choice' },
            rfsm.transition { src = 'choice', tgt = 'a', events = {} },
            rfsm.transition { src = 'a', tgt = 'b', events = { 'e_finished@moving_down', 'jnt01234vel.e_VEL_ZERO_false' } },
        }"#;
    let model = Model::new(text);
    let mut sim = model.sim();
    assert_eq!(sim.line("").unwrap().active, ["root", "root.a"]);
    let seen = sim.line("jnt01234vel.e_VEL_ZERO_false").unwrap();
    assert_eq!(seen.active, ["root", "root.b"]);
    assert_eq!(seen.notes, ["b {} x", "name: STATE_ENTER root.b"]);
}

#[test]
fn templates_are_taken_by_value_and_can_be_edited() {
    let text = "
        local sub = rfsm.state { x = rfsm.state { entry = function(f, s) s.n = (s.n or 0) + 1; print(s._fqn, s.n) end },
                                 rfsm.trans { src = 'initial', tgt = 'x' } }
        local fsm = rfsm.init(rfsm.state { a = sub, rfsm.trans { src = 'initial', tgt = 'a' } })
        assert(rfsm.run(fsm))
        sub.y = rfsm.state { entry = function(f, s) print(s._fqn) end }
        table.insert(sub, rfsm.trans { src = 'x', tgt = 'y', events = { 'e_done' } })
        return rfsm.state { a = sub, rfsm.trans { src = 'initial', tgt = 'a' } }";
    assert_eq!(Model::new(text).notes(&["run"]), ["root.a.x 1", "root.a.x 1", "root.a.y"][1..]);
}

#[test]
fn a_file_that_makes_another_chart_the_second_time_is_refused() {
    use davit::functions::Opener;
    use std::sync::Arc;
    let text = "local n = math.random(1, 2^40)
        return rfsm.state { ['s' .. n] = rfsm.state { entry = function() end }, rfsm.trans { src = 'initial', tgt = 's' .. n } }";
    let loaded = read(&[("model.lua", text)], &[]);
    let opener = Opener::new(loaded.program.expect("functions"), Arc::new(loaded.coordinator.unwrap()));
    // Lua takes chance from the second and from an address, so a state made where one was before may see the same.
    let mut kept = Vec::new();
    let failure = (0..2).find_map(|_| opener.open(None).map(|functions| kept.push(functions)).err());
    let failure = failure.expect("two states side by side see different numbers");
    assert!(failure.message.contains("another chart"), "{failure}");
}

#[test]
fn a_chart_that_asks_its_host_for_events_is_not_taken_for_a_pure_one() {
    let text = |field: &str| {
        format!(
            "local n = 0 return rfsm.state {{ {field}, a = rfsm.state {{}}, b = rfsm.state {{}},
              rfsm.trans {{ src='initial', tgt='a' }}, rfsm.trans {{ src='a', tgt='b', events={{'e'}} }} }}"
        )
    };
    let asked = Model::new(&text("getevents = function() n = n + 1 return n == 3 and { 'e' } or {} end"));
    let seen = asked.play(&["run", "run"]);
    assert_eq!(seen[1].active.last().unwrap(), "root.b", "{seen:?}");
    let idle =
        Model::new(&text("idle_hook = function(fsm) n = n + 1 if n == 1 then rfsm.send_events(fsm, 'e') end end"));
    let mut sim = idle.sim();
    let seen = sim.line("run").unwrap();
    assert_eq!(seen.active.last().unwrap(), "root.b", "it is called when there is nothing to do: {seen:?}");
    // These printers only tell, and of what goes wrong in functions.
    let printers = "err = function() end, warn = function() end, info = function() end";
    assert!(Model::new(&text(printers)).is_pure());
}
