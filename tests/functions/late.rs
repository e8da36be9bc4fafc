//! The same faults on a real clock, where a call is counted only when it takes long: endless ones end all the same,
//! wherever they hide. No time is measured: a call that did not end would hang the test.

use super::support::Model;
use davit::time::Clock;

const STATES: &str = "rfsm.trans { src='initial', tgt='a' }, rfsm.trans { src='b', tgt='a', events={'back'} }";

/// A machine whose `a` and whose transition to `b` have these parts.
fn model(before: &str, a: &str, transition: &str) -> Model {
    Model::new(&format!(
        "{before} return rfsm.state {{ a = rfsm.state {{ {a} }}, b = rfsm.state {{ entry = function() print('in b') end }},
           rfsm.trans {{ src='a', tgt='b', events={{'e'}} {transition} }}, {STATES} }}"
    ))
}

/// What is said on a real clock, error by error, and whether it came to `b`.
fn said(model: &Model, lines: &[&str]) -> (Vec<String>, bool) {
    let mut sim = model.sim_on(Some(Clock::real()));
    let seen: Vec<_> = lines.iter().map(|line| sim.line(line).expect("a line")).collect();
    let errors = seen.iter().flat_map(|s| &s.notes).filter(|note| note.starts_with("error: ")).cloned().collect();
    (errors, seen.last().expect("lines").active.last().is_some_and(|state| state == "root.b"))
}

/// One error of that tag, about the budget; and all else goes on.
fn ends(model: &Model, tag: &str) {
    let (errors, arrived) = said(model, &["run", "e", "run"]);
    assert_eq!(errors.len(), 1, "{errors:?}");
    assert!(errors[0].contains(tag) && errors[0].contains("million instructions"), "{errors:?}");
    assert!(arrived);
}

#[test]
fn endless_functions_of_every_kind_end() {
    let endless = "function() while true do end end";
    ends(&model("", &format!("entry = {endless}"), ""), "ENTRY");
    ends(&model("", &format!("exit = {endless}"), ""), "EXIT");
    ends(&model("", &format!("doo = {endless}"), ""), "DOO");
    ends(&model("", "doo = function() rfsm.yield(false) local i = 0 while true do i = i + 1 end end", ""), "DOO");
    ends(&model("", "", &format!(", effect = {endless}")), "EFFECT");
    let hook = format!("entry = function(fsm) fsm.pre_step_hook = {endless} end");
    let (errors, arrived) = said(&model("", &hook, ""), &["run", "e", "run"]);
    assert!(arrived && !errors.is_empty() && errors.iter().all(|e| e.contains("HOOK")), "{errors:?}");
    let polls = format!(
        "return rfsm.state {{ getevents = {endless}, a = rfsm.state {{ exit = function() end }}, b = rfsm.state {{}},
        rfsm.trans {{ src='a', tgt='b', events={{'e'}} }}, {STATES} }}"
    );
    let (errors, arrived) = said(&Model::new(&polls), &["run", "e", "run"]);
    assert!(arrived && !errors.is_empty() && errors.iter().all(|e| e.contains("GETEVENTS")), "{errors:?}");
    let (errors, arrived) = said(&model("", "", &format!(", guard = {endless}")), &["run", "e", "run"]);
    assert!(!arrived && !errors.is_empty() && errors.iter().all(|e| e.contains("GUARD")), "{errors:?}");
    let predicate = format!(
        "return rfsm.state {{ a = rfsm.state {{}}, b = rfsm.state {{}},
        rfsm.trans {{ src='a', tgt='b', events={{ {endless} }} }}, {STATES} }}"
    );
    let (errors, arrived) = said(&Model::new(&predicate), &["run", "e", "run"]);
    assert!(!arrived && !errors.is_empty() && errors.iter().all(|e| e.contains("PREDICATE")), "{errors:?}");
}

#[test]
fn nothing_in_a_call_outlives_its_budget() {
    let endless = "function() while true do end end";
    for body in [
        format!("while true do pcall({endless}) end"),
        format!("while true do xpcall({endless}, function() end) end"),
        format!("xpcall({endless}, {endless})"),
        format!("xpcall(error, {endless})"),
        format!("while true do coroutine.resume(coroutine.create({endless})) end"),
        format!("coroutine.wrap({endless})()"),
        format!("coroutine.wrap(function() coroutine.wrap(function() pcall({endless}) end)() end)()"),
        format!("for _ in coroutine.wrap(function() coroutine.yield(1) pcall({endless}) end) do end"),
        "while true do coroutine.wrap(function() for i = 1, 10 do end end)() end".to_owned(),
        "local function f() return f() end f()".to_owned(),
        "::again:: goto again".to_owned(),
        format!("local t = setmetatable({{}}, {{ __index = {endless} }}) return t.x"),
        format!("local t = setmetatable({{}}, {{ __newindex = {endless} }}) t.x = 1"),
        format!("local t = setmetatable({{}}, {{ __concat = {endless} }}) return t .. t"),
        format!("local t = setmetatable({{}}, {{ __tostring = {endless} }}) print(t)"),
        format!("table.sort({{ 1, 2, 3 }}, {endless})"),
        format!("(('x'):rep(3)):gsub('x', {endless})"),
        format!("local c <close> = setmetatable({{}}, {{ __close = {endless} }})"),
        format!("local c <close> = setmetatable({{}}, {{ __close = {endless} }}) while true do end"),
        // A coroutine that is closed while its call is being ended.
        format!(
            "local co = coroutine.create(function()
               local c <close> = setmetatable({{}}, {{ __close = {endless} }}) while true do end end)
             local d <close> = setmetatable({{}}, {{ __close = function() coroutine.close(co) end }})
             coroutine.resume(co)"
        ),
        // And one that is only suspended.
        format!(
            "local co = coroutine.create(function()
               local c <close> = setmetatable({{}}, {{ __close = {endless} }}) coroutine.yield() end)
             coroutine.resume(co) coroutine.close(co)"
        ),
        // An inner machine whose functions are endless.
        format!(
            "local m = rfsm.init(rfsm.state {{ err = false, warn = false, info = false,
               x = rfsm.state {{ entry = {endless} }}, rfsm.trans {{ src='initial', tgt='x' }} }}) rfsm.run(m)"
        ),
        // And one without functions that goes round for ever, again and again.
        "local m = rfsm.init(rfsm.state { err = false, warn = false, info = false, x = rfsm.state {}, y = rfsm.state {},
           rfsm.trans { src='initial', tgt='x' }, rfsm.trans { src='x', tgt='y', events={ 'e_done' } },
           rfsm.trans { src='y', tgt='x', events={ 'e_done' } } }) while true do pcall(rfsm.run, m) end"
            .to_owned(),
        "load('while true do end')()".to_owned(),
        // Library calls that run in one piece.
        "(('a'):rep(40)):find(('a?'):rep(40) .. ('a'):rep(40) .. 'b')".to_owned(),
        "pcall(string.match, ('a'):rep(1000), '.-.-.-.-b')".to_owned(),
        "for _ in string.gmatch(('a'):rep(100000), '.-b') do end".to_owned(),
        "string.gsub(('a'):rep(1000), '(.-)%1(.-)%2b', '')".to_owned(),
        "string.gfind(('a'):rep(3000000), '.*b')".to_owned(),
        "while true do string.find(('ab'):rep(1000), '(.-)b') end".to_owned(),
    ] {
        ends(&model("", &format!("entry = function() {body} end"), ""), "ENTRY");
    }
}

#[test]
fn coroutines_that_are_older_than_the_call_end_too() {
    let body = "function() coroutine.yield() while true do end end";
    // Made when the file was read, when all was counted.
    ends(
        &model(
            &format!("local co = coroutine.create({body}) coroutine.resume(co)"),
            "exit = function() coroutine.resume(co) end",
            "",
        ),
        "EXIT",
    );
    ends(&model(&format!("local go = coroutine.wrap({body}) go()"), "exit = function() go() end", ""), "EXIT");
    // Made in another call, in which nothing was counted.
    ends(
        &model(
            "local co",
            &format!(
                "entry = function() co = coroutine.create({body}) coroutine.resume(co) end,
        exit = function() coroutine.resume(co) end"
            ),
            "",
        ),
        "EXIT",
    );
    // Made in a call that was ended.
    let text = format!(
        "entry = function() co = coroutine.create({body}) coroutine.resume(co) while true do end end,
        exit = function() coroutine.resume(co) end"
    );
    let (errors, arrived) = said(&model("local co", &text, ""), &["run", "e", "run"]);
    assert!(arrived && errors.len() == 2 && errors[0].contains("ENTRY") && errors[1].contains("EXIT"), "{errors:?}");
}

/// Fewer instructions than are counted at once fit between two ticks.
#[test]
fn expensive_instructions_end_too() {
    ends(&model("", "entry = function() while true do local s = ('x'):rep(1e6) end end", ""), "ENTRY");
    let joins = "local s = ('abcdefgh'):rep(250000) while true do local t = s .. 'x' end";
    ends(&model("", &format!("exit = function() {joins} end"), ""), "EXIT");
}

/// What a coroutine would do when it is closed is not done for one that was ended: nothing could end that.
#[test]
fn closing_what_was_ended_is_refused() {
    let endless = "local c <close> = setmetatable({}, { __close = function() while true do end end })
        while true do end";
    for a in [
        format!("entry = function() co = coroutine.create(function() {endless} end) coroutine.resume(co) end"),
        format!("entry = function() coroutine.wrap(function() co = coroutine.running() {endless} end)() end"),
        format!("doo = function() co = coroutine.running() {endless} end"),
    ] {
        let exit = "exit = function() print('closed', coroutine.close(co)) print(coroutine.status(co)) end";
        let model = model("local co", &format!("{a}, {exit}"), "");
        for clock in [Clock::real(), Clock::simulated()] {
            let mut sim = model.sim_on(Some(clock));
            let seen: Vec<_> = ["run", "e", "run"].map(|line| sim.line(line).expect("a line")).into();
            let notes: Vec<_> = seen.iter().flat_map(|seen| seen.notes.clone()).collect();
            assert_eq!(notes.len(), 4, "{notes:?}");
            assert!(notes[0].contains("million instructions"), "{notes:?}");
            assert_eq!(notes[1..], ["closed false ended: its instructions are used up", "dead", "in b"], "{a}");
        }
    }
}

/// Wherever the look that ends the call comes, and whatever look comes right after it.
#[test]
fn closing_what_was_ended_is_refused_at_every_instruction() {
    for before in 0..110 {
        let model = model(
            "local co",
            &format!(
                "entry = function()
                    co = coroutine.create(function()
                        local c <close> = setmetatable({{}}, {{ __close = function() while true do end end }})
                        while true do end
                    end)
                    for i = 1, {before} do end
                    coroutine.resume(co)
                end,
                exit = function() print('closed', coroutine.close(co)) end"
            ),
            "",
        );
        // In simulated time every call is counted from its first instruction on, so each of these looks comes elsewhere.
        let mut sim = model.sim_on(Some(Clock::simulated()));
        let last = ["run", "e", "run"].into_iter().map(|line| sim.line(line).expect("a line")).last();
        assert_eq!(last.and_then(|seen| seen.active.last().cloned()).as_deref(), Some("root.b"), "{before}");
    }
}

#[test]
fn coroutines_that_ended_by_themselves_are_closed_as_lua_does() {
    let text = "entry = function()
            local function closes() local c <close> = setmetatable({}, { __close = function() print('closes') end }) end
            local good = coroutine.create(closes)
            coroutine.resume(good)
            print(coroutine.close(good))
            local bad = coroutine.create(function()
                local c <close> = setmetatable({}, { __close = function() print('late') end })
                error('mine', 0)
            end)
            print(coroutine.resume(bad))
            print(coroutine.close(bad))
            local waits = coroutine.create(function()
                local c <close> = setmetatable({}, { __close = function() print('left') end })
                coroutine.yield()
            end)
            coroutine.resume(waits)
            print(coroutine.close(waits), coroutine.status(waits))
        end";
    let model = model("", text, "");
    for clock in [Clock::real(), Clock::simulated()] {
        let mut sim = model.sim_on(Some(clock));
        let notes = sim.line("run").expect("a line").notes;
        assert_eq!(notes, ["closes", "true", "false mine", "late", "false mine", "left", "true dead"]);
    }
}

#[test]
fn what_was_ended_leaves_no_trace() {
    // The coroutine was running when its call was ended; later calls do their work, in it and beside it.
    let text = "entry = function()
            co = coroutine.wrap(function() while true do local n = coroutine.yield() for i = 1, n do end end end)
            co() co(1e9)
        end,
        exit = function() other = coroutine.wrap(function() while true do local n = coroutine.yield() end end) other() other(1) end";
    let model = model("local co, other", text, "");
    let (errors, arrived) = said(&model, &["run", "e", "run"]);
    assert!(arrived && errors.len() == 1 && errors[0].contains("ENTRY"), "{errors:?}");
    // Two sets of functions on one thread, in turns.
    let (mut one, mut two) = (model.sim_on(Some(Clock::real())), model.sim_on(Some(Clock::real())));
    for sim in [&mut one, &mut two] {
        sim.line("run").expect("a line");
    }
    for sim in [&mut two, &mut one] {
        let seen = sim.line("e").expect("a line");
        assert_eq!(seen.active.last().map(String::as_str), Some("root.b"), "{seen:?}");
    }
}

#[test]
fn memory_is_bounded_too() {
    let eats = "function() local t = {} for i = 1, 1e7 do t[i] = ('x'):rep(1000000) .. i end end";
    let (errors, arrived) = said(&model("", &format!("entry = {eats}"), ""), &["run", "e", "run"]);
    assert!(arrived && errors.len() == 1 && errors[0].contains("MB of memory"), "{errors:?}");
}

/// The coroutine functions are our own where calls are counted late; they answer as Lua's.
#[test]
fn coroutines_answer_as_luas_own() {
    let text = r##"
        local log = {}
        local function say(...)
          local out = table.pack(...)
          for i = 1, out.n do out[i] = tostring(out[i]) end
          log[#log + 1] = table.concat(out, " ")
        end
        local co = coroutine.create(function(...) say("in", ...) local a, b = coroutine.yield(1, nil, 3) say(a, b) return "end" end)
        say(coroutine.status(co)) say(coroutine.resume(co, "x", nil, "y")) say(coroutine.status(co))
        say(coroutine.resume(co, 7)) say(coroutine.status(co)) say(coroutine.resume(co)) say(coroutine.close(co))
        co = coroutine.create(function() error({ 1 }) end)
        local ok, why = coroutine.resume(co) say(ok, type(why), why[1]) ok, why = coroutine.close(co) say(ok, type(why))
        co = coroutine.create(function() error("text") end) say(coroutine.resume(co)) say(coroutine.close(co)) say(coroutine.resume(co))
        co = coroutine.create(function() error("text", 0) end) say(coroutine.resume(co))
        co = coroutine.create(function() error() end) say(coroutine.resume(co))
        local self self = coroutine.create(function() say(coroutine.resume(self)) say(pcall(coroutine.close, self)) end)
        say(coroutine.resume(self))
        local go = coroutine.wrap(function(a) say(a) local b = coroutine.yield(a + 1) return b, nil, 5 end)
        say(go(1)) say(go(2)) say(pcall(go))
        go = coroutine.wrap(function() error("inside") end) say(pcall(function() go() end)) say(pcall(function() go() end))
        go = coroutine.wrap(function() error("inside", 0) end) say(pcall(function() go() end))
        go = coroutine.wrap(function() error({ 2 }) end) ok, why = pcall(go) say(ok, why[1])
        go = coroutine.wrap(function() local c <close> = setmetatable({}, { __close = function(_, e) say("closed", e) end }) error("tbc", 0) end)
        say(pcall(function() go() end))
        go = coroutine.wrap(function() local c <close> = setmetatable({}, { __close = function() error("later", 0) end }) error("first", 0) end)
        say(pcall(function() go() end))
        co = coroutine.create(function() local c <close> = setmetatable({}, { __close = function() error("shut", 0) end }) coroutine.yield() end)
        coroutine.resume(co) say(coroutine.close(co)) say(coroutine.status(co))
        co = coroutine.create(function() local c <close> = setmetatable({}, { __close = function() say("shut") end }) coroutine.yield() end)
        coroutine.resume(co) say(coroutine.close(co)) say(coroutine.status(co))
        local sum = 0 for v in coroutine.wrap(function() for i = 1, 10 do coroutine.yield(i) end end) do sum = sum + v end say(sum)
        say(select("#", coroutine.resume(coroutine.create(function() return table.unpack({}, 1, 200) end))))
        say(pcall(coroutine.resume, 7) == false, pcall(coroutine.close, 7) == false, pcall(coroutine.wrap, 7) == false)
        say(coroutine.isyieldable(), select(2, coroutine.running()))
        say(pcall(function() return coroutine.wrap(function() return pcall(function() return coroutine.yield(1) end) end)() end))
        say(xpcall(function() error("x", 0) end, function(m) return m .. "!" end)) say(xpcall(function(...) return ... end, print, 1, nil, 2))
        return table.concat(log, "\n")
    "##;
    let own = super::lab::run(text);
    let lua = mlua::Lua::new();
    let stock: String = lua.load(text).set_name("@test").eval().expect("it runs");
    assert_eq!(own[0].as_str().expect("a text"), stock);
    assert!(stock.lines().count() > 40, "{stock}");
}

/// They are looked at before, and answer as Lua's.
#[test]
fn pattern_functions_answer_as_luas_own() {
    let text = r##"
        local log = {}
        local function say(...)
          local out = table.pack(...)
          for i = 1, out.n do out[i] = tostring(out[i]) end
          log[#log + 1] = table.concat(out, " ")
        end
        local long = ("key = some value; "):rep(500)
        for _, s in ipairs { "a key=value b", long, "" } do
          for _, p in ipairs { "(%w+)%s*=%s*(%w+)", "^(.-)%s*=", "()=()", "%b=;", "%f[%w]%w+", "e*", "x-", "^key", "(k)e%1?", "." } do
            say(s:find(p)) say(s:find(p, 5)) say(s:find(p, -3)) say(s:find(p, 1, true)) say(s:match(p)) say(s:match(p, 3))
            local count, sum = 0, 0
            for a, b in s:gmatch(p) do count = count + 1 sum = sum + #tostring(a) + #tostring(b) end
            say(count, sum)
            local out, n = s:gsub(p, "<%0>") say(#out, n)
            out, n = s:gsub(p, function(x) return #tostring(x) end, 7) say(#out, n)
            out, n = s:gsub(p, { key = "K" }) say(#out, n)
          end
        end
        say(string.find(12345, "34")) say(("x"):rep(3, ",")) say(#(""):rep(3, "ab")) say(("x"):rep(-1) == "")
        for _, p in ipairs { "[a", "%", "(", ")", "%1", "(()", "%f", "%b", ("("):rep(40) } do
          say(pcall(string.find, "some text", p)) say(pcall(string.gsub, long, p, ""))
        end
        say(pcall(function() local at = ("x"):find("[a") return at end)) say(pcall(function() local s = long:gsub("%", "") return s end))
        say(pcall(function() return ("x"):gsub("x", function() error("mine") end) end))
        say(pcall(function() return ("x"):gsub("x", function() error({}) end) end) == false)
        say(table.concat(table.move({ 1, 2, 3 }, 1, 3, 2), ","))
        return (table.concat(log, "\n"):gsub("'[%a?]+'", "NAME"))
    "##;
    let own = super::lab::run(text);
    let lua = mlua::Lua::new();
    let stock: String = lua.load(text).set_name("@test").eval().expect("it runs");
    assert_eq!(own[0].as_str().expect("a text"), stock);
    assert!(stock.lines().count() > 300);
}
