//! The monitor language: both spellings mean the same; a mistake in every word and name has its place and its help.

use crate::helpers::{codes, load, shown};
use davit::diagnostics::Language;
use davit::lang::print;
use davit::lang::{self, LoadOptions, LoadedMonitors, Sources};
use davit::model::Monitor;
use std::path::Path;

fn read(file: &str, text: &str) -> LoadedMonitors {
    let set = if text.contains("stand_in") { vec![("stand_in".to_owned(), "true".to_owned())] } else { Vec::new() };
    lang::load_monitors(
        &Sources::memory([(file, text)]),
        Path::new(file),
        &LoadOptions { set, ..LoadOptions::default() },
    )
}

fn good(file: &str, text: &str) -> Vec<Monitor> {
    let loaded = read(file, text);
    assert!(loaded.findings.is_empty(), "{}", shown(&loaded.findings, &loaded.sources));
    loaded.monitors
}

const LUA: &str = r#"
local calm = below("Dynamics.f_raw_norm", 2.0)
Monitors {
  aligned = monitor { when = calm:for_at_least(0.3), event = "e_aligned" },
  misaligned = monitor {
    when = above("Dynamics.f_raw_norm", 8.0, { hysteresis = 1.5 }):for_at_least(0.1),
    event = "e_misaligned", cleared = "e_calm", every = 0.01, repeat_every = 1,
    description = "pulls too hard",
  },
  lost = monitor {
    when = any { above(age("Link_Rx.link_stats"), 0.1), silent("youbot.jointstate", 0.5), faulted("Link_Rx"),
                 no(in_state("Link_Rx", "running")), at_most(sample_rate("Link_Rx.link_stats", 0.5), 20) },
    event = "e_link_lost", enabled = false,
  },
  odd = monitor {
    when = all { since(calm, rise(is_true("Mon.ready")), { 0.1, math.huge }), once(calm, { 0, 2 }),
                 historically(fall(calm), { 1, 2 }), implies(calm, calm):within_last(3),
                 at_least(norm { "A.f[0]", "A.f[1]" }, max { "A.g.x", abs("A.h"), 1 }),
                 equals(difference("A.h", min { 1, 2 }), activity("control", "overruns")), differs("A.h", 0) },
    event = "e_odd",
  },
}
"#;

const YAML: &str = r#"
monitors:
  aligned: { when: { for_at_least: [{ below: [Dynamics.f_raw_norm, 2.0] }, 0.3] }, event: e_aligned }
  misaligned:
    when: { for_at_least: [{ above: [Dynamics.f_raw_norm, 8.0, { hysteresis: 1.5 }] }, 0.1] }
    event: e_misaligned
    cleared: e_calm
    every: 0.01
    repeat_every: 1
    description: pulls too hard
  lost:
    when:
      any:
        - above: [{ age: Link_Rx.link_stats }, 0.1]
        - silent: [youbot.jointstate, 0.5]
        - faulted: Link_Rx
        - no: { in_state: [Link_Rx, running] }
        - at_most: [{ sample_rate: [Link_Rx.link_stats, 0.5] }, 20]
    event: e_link_lost
    enabled: false
  odd:
    when:
      all:
        - since: [&calm { below: [Dynamics.f_raw_norm, 2.0] }, { rise: { is_true: Mon.ready } }, [0.1, .inf]]
        - once: [*calm, [0, 2]]
        - historically: [{ fall: *calm }, [1, 2]]
        - within_last: [{ implies: [*calm, *calm] }, 3]
        - at_least: [{ norm: ["A.f[0]", "A.f[1]"] }, { max: [A.g.x, { abs: A.h }, 1] }]
        - equals: [{ difference: [A.h, { min: [1, 2] }] }, { activity: [control, overruns] }]
        - differs: [A.h, 0]
    event: e_odd
"#;

#[test]
fn both_spellings_mean_the_same() {
    let (lua, yaml) = (good("m.lua", LUA), good("m.yaml", YAML));
    assert_eq!(lua.len(), 4);
    assert_eq!(lua, yaml);
}

/// What is written can be read by people too: what stands in several places has a name, and no line is long.
#[test]
fn what_is_written_repeats_nothing_and_has_lines() {
    let text = std::fs::read_to_string("configs/youbot/monitors.lua").unwrap();
    let lua = good("m.lua", &text);
    for (file, language) in [("m.yaml", Language::Yaml), ("m.lua", Language::Lua)] {
        let written = print::monitors(&lua, language);
        assert_eq!(good(file, &written), lua, "{written}");
        for line in written.lines() {
            assert!(line.chars().count() <= 125 || line.contains("description"), "{line}");
        }
        assert_eq!(written.matches("&c1 ").count(), usize::from(language == Language::Yaml), "{written}");
    }
    let yaml = print::monitors(&lua, Language::Yaml);
    assert!(yaml.matches("*c1").count() > 1 && yaml.len() < 2 * text.len(), "{} bytes\n{yaml}", yaml.len());
}

#[test]
fn a_deployment_names_files_of_monitors() {
    let deployment =
        crate::helpers::DEPLOYMENT.replace("coordinator: k.lua", "coordinator: k.lua\nmonitors: [m.lua, n.yaml]");
    let m = "Monitors { high = monitor { when = above('A.y', limit), event = 'e_high' } }";
    let deployment = format!("{deployment}with: {{ limit: 2 }}\n");
    let n = "monitors: { low: { when: { below: [A.y, 1] }, event: e_low } }";
    let loaded = load(&[("d.yaml", &deployment), ("m.lua", m), ("n.yaml", n)], &LoadOptions::default());
    crate::helpers::clean(&loaded);
    let names: Vec<_> = loaded.deployment.unwrap().monitors.iter().map(|m| m.name.to_string()).collect();
    assert_eq!(names, ["high", "low"]);
    let again = n.replace("{ low:", "{ high:");
    let loaded = load(&[("d.yaml", &deployment), ("m.lua", m), ("n.yaml", &again)], &LoadOptions::default());
    assert_eq!(codes(&loaded), ["monitor::duplicate 1:13"]);
}

/// Each mistake of a table is answered by one finding, with that code at that place, that gives the hint.
fn mistakes(file: &str, text: &str, table: &[(&str, &str, &str, &str)]) {
    let mut wrong = Vec::new();
    for (from, to, expected, hint) in table {
        assert!(text.contains(from), "`{from}` is not in the example");
        let loaded = read(file, &text.replacen(from, to, 1));
        let found: Vec<String> = davit::diagnostics::to_json(&loaded.findings, &loaded.sources)
            .as_array()
            .unwrap()
            .iter()
            .map(|f| format!("{} {}:{}", f["code"].as_str().unwrap(), f["line"], f["column"]))
            .collect();
        let shown = shown(&loaded.findings, &loaded.sources);
        let helped = loaded.findings.iter().all(|f| f.help.is_some());
        if found != [*expected] || !shown.contains(hint) || !helped {
            wrong.push(format!("{from} -> {to}\nexpected {expected} with `{hint}`, found {found:?}\n{shown}"));
        }
    }
    assert!(wrong.is_empty(), "{} answers differ:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn mistakes_in_lua() {
    mistakes(
        "m.lua",
        LUA,
        &[
            ("below(", "bellow(", "lua::undefined 2:14", "`below`"),
            ("= monitor { when = calm:for", "= montior { when = calm:for", "lua::undefined 4:13", "`monitor`"),
            ("calm:for_at_least(0.3)", "calm:for_at_lest(0.3)", "lua::undefined 4:35", "`for_at_least`"),
            ("calm:for_at_least(0.3)", "calm:for_at_least('300ms')", "text::bad_time 4:48", "number alone"),
            ("calm:for_at_least(0.3)", "calm:for_at_least(0)", "text::bad_time 4:48", "more than 0"),
            ("calm:for_at_least(0.3)", "calm:for_at_least(300000)", "text::bad_time 4:48", "longer than a day"),
            ("calm:for_at_least(0.3)", "calm:for_at_least()", "monitor::arguments 4:35", "for_at_least(0.3)"),
            ("8.0, {", "8.0, 1, {", "monitor::arguments 6:12", "2 to 3"),
            ("hysteresis = 1.5", "hysteresis = -1.5", "monitor::bad_hysteresis 6:12", "0 or more"),
            ("hysteresis = 1.5", "hystersis = 1.5", "text::unknown_key 6:48", "`hysteresis`"),
            ("cleared =", "clered =", "text::unknown_key 7:29", "`cleared`"),
            ("when = calm:for_at_least(0.3), ", "", "text::missing_key 4:13", "when ="),
            ("event = \"e_odd\"", "event = \"e odd\"", "text::bad_name 20:13", "blanks"),
            ("enabled = false", "enabled = 0", "text::wrong_type 13:38", "true or false"),
            (
                "above(age(\"Link_Rx.link_stats\"), 0.1)",
                "age(\"Link_Rx.link_stats\")",
                "monitor::unknown_word 11:18",
                "compare it",
            ),
            (
                "above(age(\"Link_Rx.link_stats\"), 0.1)",
                "above(0.1, age(\"Link_Rx.link_stats\"))",
                "monitor::age 11:29",
                "seconds",
            ),
            (
                "above(age(\"Link_Rx.link_stats\"), 0.1)",
                "above(calm, 0.1)",
                "monitor::unknown_word 2:14",
                "condition, not a signal",
            ),
            (
                "above(age(\"Link_Rx.link_stats\"), 0.1)",
                "above('Link_Rx', 0.1)",
                "text::bad_name 11:24",
                "Component.port",
            ),
            ("above(age(\"Link_Rx.link_stats\"), 0.1)", "above('A.x[-1]', 0.1)", "text::bad_name 11:24", "from 0"),
            ("\"running\")", "\"runing\")", "conf::bad_state 12:41", "`running`"),
            ("\"overruns\"", "\"overrun\"", "text::bad_value 19:78", "`overruns`"),
            ("{ 0, 2 }", "{ 2, 0 }", "monitor::bad_interval 16:79", "newer end"),
            ("{ 0, 2 }", "{ -1, 2 }", "monitor::bad_interval 16:92", "how long ago"),
            ("{ 0, 2 }", "{ math.huge, 2 }", "monitor::bad_interval 16:79", "older one"),
            ("{ 0, 2 }", "{ 2 }", "monitor::bad_interval 16:79", "two ends"),
            ("{ 0, 2 }", "2", "text::wrong_type 16:90", "two numbers"),
            ("norm { \"A.f[0]\", \"A.f[1]\" }", "norm {}", "monitor::arguments 18:27", "norm"),
            ("norm { \"A.f[0]\", \"A.f[1]\" }", "norm { 'A.f[0]', 0/0 }", "text::not_finite 18:27", "NaN"),
            (
                "Monitors {\n",
                "Monitors {\n monitor { when = calm, event = 'e' },",
                "monitor::unnamed 3:1",
                "name = monitor",
            ),
            ("Monitors {", "Monitor {", "lua::undefined 3:1", "`Monitors`"),
            ("above(age(\"Link_Rx.link_stats\"), 0.1)", "above('Link_Rx.x' > 0.1)", "lua::error 11:5", "`below(…)`"),
            ("Monitors {", "local x = faulted('A')\nMonitors {", "lua::unused 3:11", "in no monitor"),
        ],
    );
}

#[test]
fn lua_cannot_compare_signals_by_itself() {
    let loaded = read("m.lua", "Monitors { m = monitor { when = no(age('A.x') > 0.1), event = 'e' } }");
    let found: Vec<_> = loaded.findings.iter().map(|f| f.code.0).collect();
    assert_eq!(found, ["monitor::compared", "text::wrong_type"]);
    assert!(shown(&loaded.findings, &loaded.sources).contains("`below(…)`"));
}

#[test]
fn mistakes_in_yaml() {
    mistakes(
        "m.yaml",
        YAML,
        &[
            ("monitors:", "moniters:", "text::unknown_key 2:1", "`monitors`"),
            ("{ below: [Dyn", "{ bellow: [Dyn", "monitor::unknown_word 3:39", "`below`"),
            ("aligned: { when: {", "aligned: { when: { no: 1, ", "monitor::arguments 3:30", "any"),
            (
                "when: { for_at_least: [{ below: [Dynamics.f_raw_norm, 2.0] }, 0.3] }",
                "when: 1",
                "text::wrong_type 3:20",
                "a condition",
            ),
            ("faulted: Link_Rx", "faulted: [Link_Rx, A]", "monitor::arguments 16:11", "takes 1 argument, 2 are given"),
            ("Dynamics.f_raw_norm, 2.0]", "Dynamics, 2.0]", "text::bad_name 3:47", "Component.port"),
            ("Dynamics.f_raw_norm, 2.0]", "Dynamics.f_raw_norm, two]", "text::bad_name 3:68", "Component.port"),
            ("[0.1, .inf]", "[0.1, .nan]", "text::not_finite 24:104", "NaN"),
            ("event: e_odd", "evnt: e_odd", "text::unknown_key 31:5", "`event`"),
            ("enabled: false", "enabled: never", "text::wrong_type 20:14", "true or false"),
        ],
    );
}

#[test]
fn hostile_conditions_end_in_a_finding() {
    let bomb = "local c = faulted('A')\nfor i = 1, 40 do c = all { c, c } end\nMonitors { m = monitor { when = c, event = 'e' } }";
    let deep = "local c = faulted('A')\nfor i = 1, 100000 do c = no(c) end\nMonitors { m = monitor { when = c, event = 'e' } }";
    let level =
        "local c = faulted('A')\nfor i = 1, 30 do c = no(c) end\nMonitors { m = monitor { when = c, event = 'e' } }";
    for (text, code) in [(bomb, "text::too_many_values"), (deep, "text::too_deep"), (level, "monitor::too_deep")] {
        let loaded = read("m.lua", text);
        let found: Vec<_> = loaded.findings.iter().map(|f| f.code.0).collect();
        assert!(found.contains(&code), "{found:?}");
    }
    let nested =
        format!("monitors: {{ m: {{ event: e, when: {}{{ faulted: A }}{} }} }}", "{ no: ".repeat(30), " }".repeat(30));
    let found: Vec<_> = read("m.yaml", &nested).findings.iter().map(|f| f.code.0).collect();
    assert_eq!(found, ["monitor::too_deep"]);
}

#[test]
fn luas_own_logic_between_conditions_is_told() {
    let text = |when: &str| {
        format!(
            "-- x and y: no code\nlocal x = above('A.x', 1)\nlocal y = below(\"A.y\", 2):once {{ 0, 1 }}\n\
             local strict = false -- [[ x or y ]]\nlocal text = [[x and y]] .. 'x and y' .. \"not x\"\n\
             Monitors {{ m = monitor {{ when = {when}, event = 'e' }}, n = monitor {{ when = all {{ x, y }} }} }}"
        )
    };
    for (when, word) in [
        ("x and y", "and"),
        ("x or y", "or"),
        ("(not x) and x or y", "not"),
        ("x:for_at_least(1) and y", "and"),
        ("above(age('A.x'), ({ 1 })[1]) and y", "and"),
        ("any { x }:within_last(2) or y", "or"),
        ("all { no(x and y), y }", "and"),
    ] {
        let loaded = read("m.lua", &text(when));
        let found: Vec<_> = loaded.findings.iter().filter(|f| f.code.to_string() == "lua::logic").collect();
        assert!(!found.is_empty(), "{when}: {}", shown(&loaded.findings, &loaded.sources));
        let place = loaded.sources.locate(found[0].origin).expect("a place");
        let line = text(when).lines().nth(5).unwrap().to_owned();
        let column = line.find(when).unwrap() + when.find(&format!("{word} ")).unwrap();
        assert_eq!((place.line, place.column as usize), (6, column + 1), "{when}");
    }
    // A choice by a parameter is none of it.
    for when in ["strict and x or y", "all { x, (strict and y or x) }", "not strict and x or y", "x"] {
        good("m.lua", &text(when));
    }
}
