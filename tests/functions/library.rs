//! Functions of Lua's library that loop where no instruction is counted: each ends, and otherwise answers as Lua's own.

use super::support::Model;
use davit::time::Clock;

/// Each would run for hours or years in one piece, or asks for far too much again and again.
pub const LONG: &[&str] = &[
    "table.insert(setmetatable({}, { __len = function() return 1e15 end }), 1, 0)",
    "table.remove(setmetatable({}, { __len = function() return 1e15 end }), 1)",
    "local n = 0 table.insert(setmetatable({}, { __len = function() n = n + 1 return n % 2 == 0 and 1e15 or 1 end }), 1, 0) while true do end",
    "table.concat(setmetatable({}, { __len = function() return 1e15 end, __index = function() return '' end }))",
    "table.concat(setmetatable({}, { __index = type }), '', 1, 1e15)",
    "table.unpack(setmetatable({}, { __len = function() return 900000 end, __index = function() return 1 end })) while true do end",
    "table.move(setmetatable({}, { __index = type }), 1, 1e15, 2)",
    "table.move({}, 1, 1e15, 2)",
    "table.move({}, 1.0, '1000000000000000', 2)",
    "table.move({}, 1, 1e15, 2, setmetatable({}, { __newindex = rawequal }))",
    "table.sort(setmetatable({}, { __len = function() return 2000000000 end, __index = rawlen }))",
    "getmetatable('').__len = function() return 1e15 end getmetatable('').__newindex = rawequal pcall(table.insert, 'x', 1, 0) while true do end",
    "string.rep('', 1e15, '') string.rep('', 1e15) while true do end",
    "while true do local s = ('x'):rep(100000, ',') end",
    "local s = ('a'):rep(1000000) s:find(('a'):rep(500000) .. 'b', 1, true)",
    "local s = ('ab'):rep(100000) while true do s:find('bb', 1, true) end",
    "local t = {} for i = 1, 100000 do t[i] = i end for i = 1, 10000 do table.concat(t) end",
    "local t = {} for i = 1, 100000 do t[i] = i end while true do table.remove(t, 1) t[#t + 1] = 1 end",
    "local t = {} for i = 1, 100000 do t[i] = i end while true do table.insert(t, 1, 1) table.remove(t) end",
    "local t = {} for i = 1, 100000 do t[i] = i end while true do table.sort(t) end",
    "local t = {} for i = 1, 100000 do t[i] = i end while true do select('#', table.unpack(t)) end",
    "local t = {} for i = 1, 100000 do t[i] = i end while true do table.move(t, 1, #t, 2) end",
    "local s = ('x'):rep(100000) while true do s:byte(1, -1) end",
    "local s = ('x'):rep(1000000) while true do utf8.len(s) end",
    "local s = ('x'):rep(1000000) while true do utf8.offset(s, 1e15) end",
    "local s = ('x'):rep(100000) while true do utf8.codepoint(s, 1, -1) end",
    "local s = ('1'):rep(1000000) while true do tonumber(s) tonumber(s, 2) end",
    "local s = ('b'):rep(1000000) while true do string.packsize(s) end",
    "for i = 1, 1e5 do local s = ('x'):rep(1e6) end",
    "local s = ('x'):rep(1e6) while true do local t = s .. 'y' end",
    "local s = ('x'):rep(1e6) while true do local t = s:upper() t = s:reverse() t = s:sub(2) end",
    "while true do local t = table.pack(table.unpack({}, 1, 10000)) end",
];

fn model(before: &str, body: &str) -> Model {
    Model::new(&format!(
        "{before} return rfsm.state {{ a = rfsm.state {{ entry = function() {body} end }}, b = rfsm.state {{}},
           rfsm.trans {{ src='initial', tgt='a' }}, rfsm.trans {{ src='a', tgt='b', events={{'e'}} }},
           rfsm.trans {{ src='b', tgt='a', events={{'back'}} }} }}"
    ))
}

#[test]
fn what_loops_in_the_library_ends_with_the_budget() {
    for clock in [None, Some(Clock::real())] {
        for body in LONG {
            let model = model("", body);
            let mut sim = model.sim_on(clock.clone());
            let seen: Vec<_> = ["run", "e"].map(|line| sim.line(line).expect("a line")).into();
            let notes: Vec<_> = seen.iter().flat_map(|seen| seen.notes.clone()).collect();
            assert!(
                notes.len() == 1 && notes[0].contains("ENTRY") && notes[0].contains("million instructions"),
                "{body}: {notes:?}"
            );
            assert_eq!(seen[1].active.last().map(String::as_str), Some("root.b"), "{body}");
        }
    }
}

/// When the model is loaded, where the budget is larger.
#[test]
fn what_loops_while_a_model_loads_ends_too() {
    for body in &LONG[..16] {
        let loaded = super::support::read(
            &[("model.lua", &format!("{body} return rfsm.state {{ entry = function() end }}"))],
            &[],
        );
        assert!(loaded.coordinator.is_none(), "{body}");
        let codes: Vec<String> = loaded.findings.iter().map(|finding| finding.code.to_string()).collect();
        assert!(codes.iter().any(|code| code == "lua::instructions" || code == "lua::memory"), "{body}: {codes:?}");
    }
}

/// A comparison of two long texts is one instruction; no count sees it.
#[test]
fn what_no_count_sees_ends_with_the_processors_time() {
    let body = "local s = ('x'):rep(1e7) local a, b = s .. 'y', s .. 'y' while a == b do end";
    for clock in [None, Some(Clock::real())] {
        let model = model("", body);
        let seen = model.sim_on(clock).line("run").expect("a line");
        assert!(seen.notes.len() == 1 && seen.notes[0].contains("s of processor time"), "{:?}", seen.notes);
    }
}

#[test]
fn ordinary_work_is_within_the_budget() {
    let body = "local t = {} for i = 1, 1000 do table.insert(t, 1, i) end for i = 1, 1000 do table.remove(t, 1) end
        for i = 1, 1000 do t[i] = tostring(i) end for i = 1, 100 do local s = table.concat(t, ',') end
        for i = 1, 20 do table.sort(t) end local s = '' for i = 1, 2000 do s = s .. 'some words ' end
        for i = 1, 1000 do local a, b = s:find('words', i, true) end
        for i = 1, 10000 do local b = s:byte(i, i) end";
    let notes = model("", body).notes(&["run"]);
    assert!(notes.is_empty(), "{notes:?}");
}

#[test]
fn they_answer_as_luas_own() {
    let text = r##"
        local log = {}
        local function say(...)
          local out = table.pack(...)
          for i = 1, out.n do out[i] = tostring(out[i]) end
          log[#log + 1] = table.concat(out, " ")
        end
        local function brief(ok, text)
          if not ok then return say(text) end
          local sum = 0
          for i = 1, #text, 97 do sum = (sum * 31 + text:byte(i)) % 1000003 end
          say(#text, sum)
        end
        local function list(n) local t = {} for i = 1, n do t[i] = i end return t end
        local function watched(t)
          return setmetatable({}, { __index = t, __newindex = function(_, k, v) t[k] = v end, __len = function() return #t end })
        end
        local function show(t, n) local out = {} for i = 1, n or #t do out[i] = tostring(t[i]) end say(table.concat(out, ",")) end
        for _, n in ipairs { 0, 1, 5, 300 } do
          for _, make in ipairs { list, function(n) return watched(list(n)) end } do
            for _, at in ipairs { -1, 0, 1, 2, n, n + 1, n + 2, 1.0, 1.5, "1", "x", math.mininteger, math.maxinteger } do
              local t = make(n)
              say(pcall(table.insert, t, at, "new")) show(t, n + 1)
              t = make(n)
              say(pcall(table.remove, t, at)) show(t, n + 1)
              for _, to in ipairs { -1, 0, 3, n, n + 1, "2" } do
                say(select("#", pcall(table.unpack, make(n), at, to)), (pcall(table.unpack, make(n), at, to)))
                say((pcall(table.concat, make(n), "-", at, to)))
              end
            end
            local t = make(n) table.insert(t, "end") show(t) say(table.remove(t)) show(t) say(table.remove(t, nil))
            say(pcall(table.insert, t)) say(pcall(table.insert, t, 1, 2, 3))
            say(table.unpack(make(n))) say(table.concat(make(n))) say(table.concat(make(n), ", ", 1, math.min(n, 2)))
            for _, m in ipairs { { 1, n, 1 }, { 1, n, 2 }, { 2, n, 1 }, { 1, n, 3 }, { 3, 2, 1 }, { 1, 3, -2 } } do
              local t = make(n) say(table.move(t, m[1], m[2], m[3]) == t) show(t, n + 2)
              local other = make(0) table.move(list(n), m[1], m[2], m[3], other) show(other, n + 2)
            end
            t = make(n) table.sort(t, function(a, b) return a > b end) show(t) table.sort(t) show(t)
          end
        end
        say(pcall(table.move, {}, 1, math.maxinteger, 2)) say(pcall(table.move, {}, -1, math.maxinteger, 2))
        say(pcall(table.sort, { 3, "x", 1 })) say(pcall(table.sort, { 3, 2, 1 }, function() error("mine", 0) end))
        for _, f in ipairs { table.insert, table.remove, table.concat, table.sort, table.move, table.unpack } do
          say((pcall(f))) say((pcall(f, nil, 1, 1, 1))) say((pcall(f, 7, 1, 1, 1)))
        end
        say(pcall(table.concat, { 1, {}, 3 })) say(table.concat({ 1, 2.5, "x" }, 7)) say(pcall(table.concat, list(300), "", 1, 400))
        for _, s in ipairs { "", "a", "abc", ("abc"):rep(200), "äöü€" } do
          for _, i in ipairs { -500, -2, -1, 0, 1, 2, 400, "3", 1.5 } do
            say(pcall(string.byte, s, i)) say(pcall(utf8.offset, s, i)) say(pcall(utf8.codepoint, s, i))
            for _, j in ipairs { -500, -1, 0, 1, 3, 500 } do
              say(select("#", pcall(string.byte, s, i, j)), pcall(string.byte, s, i, j)) say(pcall(utf8.len, s, i, j))
              say(pcall(utf8.codepoint, s, i, j))
            end
          end
          say(utf8.len(s)) say(s:byte()) say(s:find("bc", 1, true)) say(s:find("bc", -2, true)) say(s:find("", 10, true))
          for _, n in ipairs { -1, 0, 1, 2, 63, 64, 65, 127, 128, 1000, 6400, 6401, "70", 2.5 } do
            for _, sep in ipairs { "", ",", "--", 7 } do brief(pcall(string.rep, s, n, sep)) end
            brief(pcall(string.rep, s, n))
          end
        end
        say(pcall(string.rep, "x", 1 << 62)) say((""):rep(1000), (7):rep(100), (7):rep(100, 8)) say(pcall(string.rep)) say(pcall(string.rep, {}, 100))
        say(tonumber("10"), tonumber("ff", 16), tonumber("x"), tonumber(nil)) say(pcall(tonumber, "1", 99))
        say(tonumber(("1"):rep(150), 10), tonumber(("1"):rep(150)))
        say(string.packsize("i4i4"), string.unpack("z", string.pack("z", "text"))) say(pcall(string.packsize, "?"))
        return (table.concat(log, "\n"):gsub("'[%w._]+'", "NAME"):gsub("got no value", "got nil"))
    "##;
    let text = text.replace("(7):rep", "(\"7\"):rep");
    let own = super::lab::run(&text);
    let lua = mlua::Lua::new();
    let stock: String = lua.load(&text).set_name("@test").eval().expect("it runs");
    let own = own[0].as_str().expect("a text");
    let differ = own.lines().zip(stock.lines()).find(|(a, b)| a != b);
    assert_eq!(differ, None);
    assert_eq!(own.lines().count(), stock.lines().count());
    assert!(stock.lines().count() > 2000);
}
