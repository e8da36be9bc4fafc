//! Files that mean harm, or were made by a program gone wrong: each ends in a clear finding, none in a crash.
//!
//! The budgets are counted (instructions, bytes, values, depth); nothing here looks at a clock.

use crate::helpers::{COORDINATOR, DEPLOYMENT, codes, load, shown, with_configurations};
use davit::lang::{self, LoadOptions, Sources};
use std::fmt::Write as _;
use std::path::Path;

/// The codes that a Lua file of configurations gives, without places.
fn lua(text: &str) -> Vec<String> {
    let loaded = with_configurations(text);
    assert!(loaded.deployment.is_none());
    let mut codes: Vec<String> = loaded.findings.iter().map(|f| f.code.to_string()).collect();
    codes.dedup();
    codes
}

fn yaml(text: impl Into<Vec<u8>>) -> Vec<String> {
    let loaded =
        lang::load_configurations(&Sources::memory([("c.yaml", text)]), Path::new("c.yaml"), &LoadOptions::default());
    let _ = shown(&loaded.findings, &loaded.sources);
    loaded.findings.iter().map(|f| f.code.to_string()).collect()
}

#[test]
fn endless_loops_end() {
    for text in [
        "while true do end",
        "while true do pcall(function() while true do end end) end",
        "local function f() while true do end end while true do xpcall(f, f) end",
        "local co = coroutine.create(function() while true do end end) while true do coroutine.resume(co) end",
        "while true do pcall(coroutine.wrap(function() while true do end end)) end",
        "local f = coroutine.wrap(function() while true do coroutine.yield() end end) while true do f() end",
        "local t = setmetatable({}, { __index = function(t, k) return t[k + 1] end }) while true do pcall(function() return t[1] end) end",
        "local t = setmetatable({}, { __add = function(a, b) while true do end end }) return t + 1",
        "local t = setmetatable({}, { __close = function() while true do end end }) do local x <close> = t end",
        // What is closed when the budget has ended what runs, in the file itself, in a coroutine, and of a string.
        "local x <close> = setmetatable({}, { __close = function() while true do end end }) while true do end",
        "local m = {} local t = setmetatable({}, m) m.__close = function() while true do end end local x <close> = t while true do end",
        "coroutine.wrap(function() local x <close> = setmetatable({}, { __close = function() while true do end end }) while true do end end)()",
        "while true do pcall(coroutine.wrap(function() for _ in next, {1}, nil, setmetatable({}, { __close = function() while true do end end }) do while true do end end end)) end",
        "goto a ::a:: goto a",
        "for i = 1, math.huge do end",
        "local function f() return f() end f()",
        "while true do pcall(error) end",
        "table.sort({ 3, 2, 1 }, function() while true do end end)",
        "local t = {} for i = 1, 100000 do t[i] = i % 7 end while true do table.sort(t) end",
        "local s = string.rep('x', 1000000) while true do local _ = s:upper() end",
        "local s = 'x' while #s < 8000000 do s = s .. s end while true do local _ = s .. 'y' end",
        // What loops in the library, where no instruction is counted.
        "table.insert(setmetatable({}, { __len = function() return 1e15 end }), 1, 0)",
        "table.remove(setmetatable({}, { __len = function() return 1e15 end }), 1)",
        "pcall(table.remove, setmetatable({}, { __len = function() return 1e15 end }), 1) while true do end",
        "table.unpack(setmetatable({}, { __len = function() return 900000 end, __index = function() return 1 end })) while true do end",
        "local t = {} for i = 1, 100000 do t[i] = i end while true do table.insert(t, 1, 1) table.remove(t, 1) end",
        "local t = {} for i = 1, 100000 do t[i] = i end while true do select('#', table.unpack(t)) end",
        "local t = {} for i = 1, 1000000 do t[i] = '' end while true do table.concat(t) end",
        "local s = ('x'):rep(100000) while true do s:byte(1, -1) end",
        "local s = ('1'):rep(1000000) while true do tonumber(s) end",
        "string.rep('', 1e15) string.rep('', 1e15, '') while true do end",
    ] {
        assert_eq!(lua(text), ["lua::instructions"], "{text}");
    }
}

/// The line is the file's, not one of what guards it.
#[test]
fn a_budget_that_ends_in_the_library_is_told_at_the_line_that_called() {
    let text = "\n\ntable.insert(setmetatable({}, { __len = function() return 1e15 end }), 1, 0)";
    let loaded = with_configurations(text);
    let place = loaded.sources.locate(loaded.findings[0].origin).expect("a place");
    assert_eq!(place.line, 3);
}

/// Where an error has no place of its own it is told where it was raised, and not at the beginning of the file.
#[test]
fn what_is_raised_without_a_place_has_its_line() {
    for (text, says) in [
        ("\n\nerror({})", "the file fails: the error is a table and no text"),
        ("\n\nerror('plain', 0)", "the file fails: plain"),
        ("\n\nlocal s = string.rep('x', 1e9)", "the file fails: string.rep would make a text of more than 1 MB"),
        ("\n\nlocal c = operation_call('A.lock').undo('A.unlock')", "`undo` does not know of what"),
    ] {
        let loaded = with_configurations(text);
        let said = shown(&loaded.findings, &loaded.sources);
        assert!(said.contains(says) && said.contains(":3:"), "{text}: {said}");
    }
}

#[test]
fn memory_bombs_end() {
    for text in [
        "local t = {} while true do t[#t + 1] = { {}, {}, {} } end",
        "local s = 'x' while true do s = s .. s end",
        "local s = 'x' while true do pcall(function() s = s .. s end) end",
        "local t = {} for i = 1, 1e9 do t[i] = tostring(i) .. 'abcdefgh' end",
        "local function f(...) return f(1, ...) end f()",
    ] {
        let codes = lua(text);
        assert!(
            codes == ["lua::memory"] || codes == ["lua::instructions"] || codes == ["lua::error"],
            "{text}: {codes:?}"
        );
    }
    assert_eq!(lua("string.rep('x', 1e9)"), ["lua::error"]);
    // Whichever budget is met first: that depends on how the program was built.
    for text in ["create('A', 'B')", "state {}", "pcall(create, 'A', 'B')", "connect('A.x', 'B.y', { buffer = 1 })"] {
        let codes = lua(&format!("while true do {text} end"));
        let budgets = ["text::too_many_values", "lua::instructions", "lua::memory"];
        assert!(codes.len() == 1 && budgets.contains(&codes[0].as_str()), "{text}: {codes:?}");
    }
    let shared = "local t = {} for i = 1, 40 do t = { t, t } end property_set('A.k', t)";
    assert!(lua(shared).contains(&"text::too_many_values".to_owned()));
}

#[test]
fn pattern_functions_are_left_out() {
    let text = "local s = string.rep('a', 100) local _ = s:find(string.rep('a?', 100) .. string.rep('a', 100))";
    assert_eq!(lua(text), ["lua::closed"]);
    for name in ["match", "gmatch", "gsub"] {
        assert_eq!(lua(&format!("local _ = string.{name}('a', '.*')")), ["lua::closed"], "{name}");
    }
}

#[test]
fn the_world_is_closed() {
    for text in [
        "io.open('/etc/passwd')",
        "os.execute('true')",
        "local _ = os.time()",
        "load('return 1')()",
        "loadstring('return 1')",
        "dofile('x.lua')",
        "loadfile('x.lua')",
        "debug.sethook()",
        "package.loadlib('x', 'y')",
        "require 'socket'",
        "collectgarbage('stop')",
        "local _ = math.random()",
        "string.dump(function() end)",
        "local _ = _G.io",
        "local _ = _ENV.os",
    ] {
        assert_eq!(lua(text), ["lua::closed"], "{text}");
    }
    assert_eq!(lua("setmetatable({}, { __gc = function() while true do end end })"), ["lua::error"]);
    assert_eq!(lua("setmetatable(_G, nil)"), ["lua::error"], "the undefined names stay guarded");
    assert_eq!(lua("setmetatable({}, { __gc = true })"), ["lua::error"]);
    assert_eq!(lua("getmetatable('').__index = nil"), ["lua::error"]);
}

#[test]
fn bytecode_is_refused() {
    let bytecode: &[u8] = b"\x1bLuaT\x00\x19\x93\r\n\x1a\n\x04\x08\x08xV";
    for bytes in [bytecode.to_vec(), b"\x1bLua text".to_vec()] {
        let loaded = lang::load_configurations(
            &Sources::memory([("c.lua", bytes)]),
            Path::new("c.lua"),
            &LoadOptions::default(),
        );
        assert_eq!(loaded.findings[0].code.0, "lua::bytecode");
        assert!(loaded.unreadable);
    }
    let hidden = with_configurations("#!/usr/bin/lua\n\x1bLua");
    assert!(hidden.unreadable && hidden.findings[0].code.0 == "text::syntax");
}

#[test]
fn ten_thousand_levels_end() {
    let n = 10_000;
    for text in [
        format!("return {}{}", "{".repeat(n), "}".repeat(n)),
        format!("return {}1{}", "(".repeat(n), ")".repeat(n)),
        format!("{}{}", "do ".repeat(n), "end ".repeat(n)),
        format!("return {}1", "-".repeat(2 * n).replace("--", "- ")),
        format!("return {}", "function() return ".repeat(n)),
    ] {
        assert_eq!(lua(&text), ["text::too_deep"], "{}", &text[..40]);
    }
    let by_loop = "local t = {} local r = t for i = 1, 10000 do t.x = {} t = t.x end property_set('A.k', r)";
    assert!(lua(by_loop).contains(&"text::too_deep".to_owned()));
    let cycle = "local t = {} t.t = t Configuration { property_set('A.k', t) }";
    assert!(lua(cycle).contains(&"text::too_deep".to_owned()));
    let states = "local s = state {} for i = 1, 10000 do s = state { x = s } end return s";
    let loaded = load(&[("k.lua", states)], &LoadOptions::default());
    assert_eq!(loaded.findings[0].code.0, "text::too_deep");
    for text in [
        "[".repeat(n),
        format!("{}{}", "[".repeat(n), "]".repeat(n)),
        "{a: ".repeat(n),
        "- ".repeat(n),
        (0..n).fold(String::new(), |mut out, i| {
            _ = writeln!(out, "{}a:", " ".repeat(i % 3_000));
            out
        }),
        format!("configurations: {}1{}", "[".repeat(100), "]".repeat(100)),
        "? ".repeat(n),
    ] {
        let codes = yaml(text.clone());
        assert!(matches!(codes[0].as_str(), "text::too_deep" | "text::syntax"), "{codes:?} {}", &text[..40]);
    }
}

#[test]
fn alias_bombs_end() {
    let mut bomb = String::from("a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n");
    for i in 1..12 {
        _ = writeln!(bomb, "a{i}: &a{i} [{}]", vec![format!("*a{}", i - 1); 10].join(", "));
    }
    assert_eq!(yaml(bomb), ["text::too_many_values"]);
    assert_eq!(yaml("a: &a [*a]")[0], "text::syntax");
    assert_eq!(yaml("a: *b")[0], "text::syntax");
}

#[test]
fn files_are_refused_by_size_and_encoding() {
    let folder = tempfile::tempdir().unwrap();
    let large = folder.path().join("large.lua");
    // A hole: a hundred megabytes by its size, nothing on the disk.
    std::fs::File::create(&large).unwrap().set_len(100 * 1024 * 1024).unwrap();
    let loaded = lang::load_configurations(&Sources::Disk, &large, &LoadOptions::default());
    assert_eq!(loaded.findings[0].code.0, "text::too_large");
    assert!(loaded.unreadable && loaded.sources.files().is_empty());
    let folder_as_file = lang::load(folder.path().join("x.yaml").as_path(), &LoadOptions::default());
    assert_eq!(folder_as_file.findings[0].code.0, "text::no_file");
    assert_eq!(yaml(b"name: \xff\xfe".to_vec()), ["text::not_utf8"]);
    assert_eq!(lua("property_set('A.k', '\\xff')")[0], "text::not_utf8");
    std::fs::create_dir(folder.path().join("d.yaml")).unwrap();
    let directory = lang::load(&folder.path().join("d.yaml"), &LoadOptions::default());
    assert_eq!(directory.findings[0].code.0, "text::unreadable");
}

/// A bit of each is kept: more than there are bits are not followed as if they were fewer.
#[test]
fn a_deployment_has_so_many_coordinators() {
    let folder = tempfile::tempdir().unwrap();
    let chart = "coordinator: { states: { off: {} }, transitions: [{ src: initial, tgt: off }] }\n";
    std::fs::write(folder.path().join("k.yaml"), chart).unwrap();
    let loaded = |n: usize| {
        let all: Vec<String> = (0..n).map(|i| format!("k{i}: k.yaml")).collect();
        let text = format!(
            "davit: 1\nname: many\nplatform: simulated\ntypes: {{}}\nconfigurations: []\ncoordinators: {{ {} }}\n\
             deploy: {{ event: e_start, up: off, within_s: 1 }}\nshutdown: {{ event: e_end, down: off, within_s: 1 }}\n",
            all.join(", ")
        );
        let file = folder.path().join("many.yaml");
        std::fs::write(&file, text).unwrap();
        let findings = lang::load(&file, &LoadOptions::default()).findings;
        findings.into_iter().filter(|finding| finding.code.0 == "text::too_large").count()
    };
    assert_eq!((loaded(60), loaded(61)), (0, 1));
}

#[test]
fn values_are_finite() {
    for value in ["0/0", "1/0", "-math.huge", "{ 1.0, 0/0 }"] {
        let text = format!("ConfiguratorConf {{ a = Configuration {{ property_set('A.k', {value}) }} }}");
        assert_eq!(lua(&text), ["text::not_finite"], "{value}");
    }
    // Whose value it is, is said.
    for (change, whose) in [
        ("property_set('A.k', 0/0)", "`A.k` cannot be NaN"),
        ("create('A', 'T', { properties = { k = { 1.0, 1/0 } } })", "`A.k` cannot be inf"),
        ("port_write('A.u', -1/0)", "`A.u` cannot be -inf"),
        ("operation_call('A.go', 0/0)", "an argument of `A.go` cannot be NaN"),
    ] {
        let text = format!("ConfiguratorConf {{ a = Configuration {{ {change} }} }}");
        let loaded = with_configurations(&text);
        let message = loaded.findings[0].message.replace("-NaN", "NaN");
        assert!(loaded.findings.len() == 1 && message.starts_with(whose), "{change}: {message}");
    }
    for value in [".nan", ".inf", "-.inf", "[1.0, .nan]"] {
        let text = format!(
            "configurations: {{ a: {{ changes: [{{ property_set: {{ property: A.k, value: {value} }} }}] }} }}"
        );
        assert_eq!(yaml(text), ["text::not_finite"], "{value}");
    }
    let huge = "configurations: { a: { changes: [{ port_write: { port: A.k, value: 99999999999999999999 } }] } }";
    assert_eq!(yaml(huge), ["text::wrong_type"]);
}

/// Where a large element holds many mistakes, looking for each in it would take for ever: past a budget the element is shown.
#[test]
fn mistakes_in_something_huge_are_not_looked_for_for_ever() {
    let keys: Vec<String> = (0..20_000).map(|i| format!("k{i} = 'v{i}'")).collect();
    let loaded = with_configurations(&format!("ConfiguratorConf {{ {} }}", keys.join(", ")));
    let all = davit::diagnostics::to_json(&loaded.findings, &loaded.sources);
    let columns: Vec<u64> = all.as_array().unwrap().iter().map(|f| f["column"].as_u64().unwrap()).collect();
    assert_eq!(columns.len(), davit::limits::FINDINGS);
    assert!(columns[0] > 18 && columns[80] > columns[0], "exactly at first: {:?}", &columns[..81]);
    assert!(columns[120..].iter().all(|column| *column == 1), "{:?}", &columns[120..]);
}

/// Mistakes in calls on one line are each found where they stand, and cost no more the further to the right that is.
#[test]
fn mistakes_in_calls_on_one_huge_line_are_found_where_they_stand() {
    let call = "property_set(5, 1), ";
    let begins = "ConfiguratorConf { a = Configuration { ";
    let loaded = with_configurations(&format!("{begins}{} }} }}", call.repeat(60_000)));
    let all = davit::diagnostics::to_json(&loaded.findings, &loaded.sources);
    let columns: Vec<usize> = all.as_array().unwrap().iter().map(|f| f["column"].as_u64().unwrap() as usize).collect();
    assert_eq!(columns.len(), davit::limits::FINDINGS);
    let wanted: Vec<usize> =
        (0..columns.len()).map(|nth| begins.len() + nth * call.len() + "property_set(".len() + 1).collect();
    let found: Vec<usize> = columns.iter().take(80).copied().collect();
    assert_eq!(found, wanted[..80], "exactly at first");
    let begin = |column: &usize| (column - 1 - begins.len()) % call.len();
    assert!(columns.iter().all(|column| [0, "property_set(".len()].contains(&begin(column))), "{columns:?}");
    assert!(columns.is_sorted(), "each in its own call");
}

#[test]
fn duplicates_are_found() {
    let twice = "ConfiguratorConf { a = Configuration { }, a = Configuration { destroy('A') } }";
    let loaded = with_configurations(twice);
    assert_eq!(codes(&loaded), ["text::duplicate_key 1:43"], "told once, where it stands again");
    assert!(shown(&loaded.findings, &loaded.sources).contains("first here"));
    // Of plain values Lua keeps no trace at all: neither of states, nor of lists.
    for (chart, at) in [
        (COORDINATOR.replace("fault = state {},", "idle = state { up = state {} }, fault = state {},"), "4:3"),
        (COORDINATOR.replace("config = \"up\"", "config = \"up\", ['config'] = \"up\""), "3:41"),
        (COORDINATOR.replace("tgt = \"idle\", events", "tgt = \"idle\", src = \"fault\", events"), "8:46"),
    ] {
        let loaded = load(&[("k.lua", &chart)], &LoadOptions::default());
        let found = codes(&loaded);
        assert!(found.contains(&format!("text::duplicate_key {at}")), "{chart}: {found:?}");
    }
    // Where it is trusted it is run as rFSM runs it, and told.
    let chart = COORDINATOR.replace("fault = state {},", "fault = state {}, fault = state { entry = function() end },");
    let trusted = format!("{DEPLOYMENT}trusted: true\n");
    let loaded = load(&[("k.lua", &chart), ("d.yaml", &trusted)], &LoadOptions::default());
    assert_eq!(codes(&loaded), ["chart::slip 4:21"], "{}", shown(&loaded.findings, &loaded.sources));
    assert!(loaded.deployment.is_some());
    let over_files = load(
        &[
            ("c.lua", "ConfiguratorConf { up = Configuration {} }"),
            ("b.lua", "ConfiguratorConf {\n up = Configuration {} }"),
            ("d.yaml", &crate::helpers::DEPLOYMENT.replace("[c.lua]", "[c.lua, b.lua]")),
        ],
        &LoadOptions::default(),
    );
    assert_eq!(codes(&over_files), ["conf::duplicate 2:7"]);
    assert!(shown(&over_files.findings, &over_files.sources).contains("c.lua:1:25"), "the other file is shown too");
    assert_eq!(yaml("configurations: { a: {}, b: {}, a: {} }"), ["text::duplicate_key"]);
    let many: String = (0..20).map(|i| format!("  a{i}: {{}}\n")).collect();
    assert_eq!(yaml(format!("configurations:\n{many}  a15: {{}}\n")), ["text::duplicate_key"]);
}

#[test]
fn odd_yaml_is_refused() {
    assert_eq!(yaml("configurations:\n\ta: {}\n"), ["text::syntax"]);
    assert_eq!(yaml("configurations: {}\n---\nconfigurations: {}\n"), ["text::several_documents"]);
    assert_eq!(yaml("configurations: !include x.yaml\n"), ["text::tag"]);
    assert_eq!(yaml("configurations: !!binary aGk=\n"), ["text::tag"]);
    assert_eq!(yaml("? [a, b]\n: c\n")[0], "text::syntax");
    assert_eq!(yaml(""), ["text::missing_key"]);
    assert_eq!(yaml("configurations: {a: {}"), ["text::syntax"]);
    assert_eq!(yaml("\u{feff}configurations: {}\n"), Vec::<String>::new(), "a byte order mark is no mistake");
    assert_eq!(yaml("configurations: &x\n  a: &y { changes: [] }\n  b: *y\n"), Vec::<String>::new());
}

#[test]
fn findings_do_not_flood() {
    let text = "for i = 1, 100000 do local _ = _G['x' .. i] end";
    let loaded = with_configurations(text);
    assert!(loaded.findings.len() <= davit::limits::FINDINGS);
    let shown = shown(&loaded.findings, &loaded.sources);
    assert!(shown.contains("more findings") && shown.len() < 100_000);
}

#[test]
fn a_shebang_keeps_the_line_numbers() {
    let loaded = with_configurations("#!/usr/bin/env davit\nConfiguratorConf { a = Configuration { frobnicate() } }");
    assert_eq!(codes(&loaded), ["lua::undefined 2:40"]);
}

/// Any text whatever: no panic, and an error always leaves a finding.
#[test]
fn any_text_is_answered() {
    use proptest::prelude::*;
    let words = prop::sample::select(vec![
        "Configuration",
        "ConfiguratorConf",
        "{",
        "}",
        "(",
        ")",
        "create",
        "\"A\"",
        "'_default:running'",
        ",",
        "=",
        "state",
        "trans",
        "src",
        "return",
        "end",
        "function",
        "local",
        "x",
        "1",
        "..",
        ":undo",
        "nil",
        "[",
        "]",
        "\n",
        "davit: 1",
        "- ",
        ": ",
        "&a",
        "*a",
        "configurations:",
        "coordinator:",
        "states:",
        "|",
        ">",
        "'",
        "\"",
        "é",
        "\t",
        "connect",
        "pcall",
        "post_conf_state",
        "_G",
        "rfsm.",
    ]);
    let texts = proptest::collection::vec(words, 0..24).prop_map(|words| words.join(" "));
    let config = ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() };
    proptest!(config, |(text in texts)| {
        for file in ["c.lua", "c.yaml"] {
            let sources = Sources::memory([(file, text.as_str())]);
            let loaded = lang::load_configurations(&sources, Path::new(file), &LoadOptions::default());
            let chart = lang::load_coordinator(&sources, Path::new(file), &LoadOptions::default());
            prop_assert!(chart.coordinator.is_some() || !chart.findings.is_empty());
            let _ = (shown(&loaded.findings, &loaded.sources), shown(&chart.findings, &chart.sources));
        }
        let loaded = lang::load_from(&Sources::memory([("d.yaml", text.as_str())]), Path::new("d.yaml"), &LoadOptions::default());
        prop_assert!(loaded.deployment.is_none() && !loaded.findings.is_empty());
    });
}
