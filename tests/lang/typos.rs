//! A mistake in every kind of key, name, type and time, in every kind of file: its code, its place, its help.

use crate::helpers::{COORDINATOR, DEPLOYMENT, codes, load, shown, with_configurations};
use crate::tongue::strange;
use davit::lang::{self, LoadOptions, Loaded, Sources};
use std::path::Path;

fn replaced(file: &str, text: &str, from: &str, to: &str) -> Loaded {
    assert!(text.contains(from), "`{from}` is not in the example");
    load(&[(file, &text.replacen(from, to, 1))], &LoadOptions::default())
}

/// The mistakes of a table that are not answered by one finding, with that code at that place, whose help or message
/// holds the hint.
#[derive(Default)]
struct Answers(Vec<String>);

impl Answers {
    fn one(&mut self, loaded: &Loaded, (from, to): (&str, &str), expected: &str, hint: &str) {
        let text = shown(&loaded.findings, &loaded.sources);
        let found = codes(loaded);
        let first = loaded.findings.first();
        let help = first.and_then(|f| f.help.clone()).unwrap_or_default();
        let hinted = help.contains(hint) || first.is_some_and(|f| f.message.contains(hint) || f.label.contains(hint));
        // Every finding says what to do.
        if found != [expected] || !hinted || help.is_empty() {
            self.0.push(format!("{from} -> {to}\nexpected {expected} with `{hint}`, found {found:?}\n{text}"));
        }
        self.0.extend(strange(&davit::diagnostics::to_json(&loaded.findings, &loaded.sources)));
    }
}

impl Drop for Answers {
    fn drop(&mut self) {
        assert!(
            self.0.is_empty() || std::thread::panicking(),
            "{} answers differ:\n{}",
            self.0.len(),
            self.0.join("\n")
        );
    }
}

#[test]
fn deployment_keys_names_and_values() {
    let table = [
        ("name: arm", "nmae: arm", "text::unknown_key 2:1", "`name`"),
        ("name: arm", "name: 3arm", "text::bad_name 2:7", "name: youbot_arm"),
        (
            "name: arm",
            "name: a_name_with_more_letters_than_there_are_in_the_name_of_a_socket__",
            "text::bad_name 2:7",
            "at a file of that name",
        ),
        ("name: arm", "name: 12", "text::wrong_type 2:7", "quotes"),
        ("name: arm\n", "", "text::missing_key 1:1", "name: "),
        ("davit: 1", "davit: 2", "text::bad_value 1:8", "davit: 1"),
        ("types:", "tpyes:", "text::unknown_key 4:1", "`types`"),
        ("    ports:", "    prots:", "text::unknown_key 6:5", "`ports`"),
        ("direction: in", "direction: inn", "text::bad_value 7:23", "`in`"),
        ("direction: in", "driection: in", "text::unknown_key 7:12", "`direction`"),
        ("type: float, unit", "type: flaot, unit", "type::bad_type 7:33", "`float`"),
        ("default: 1.0", "default: 11.0", "type::bad_default 10:34", "11"),
        ("default: 1.0", "default: one", "type::bad_default 10:34", "expected float"),
        ("min: 0.0", "min: 20.0", "type::bad_default 10:39", "exchange"),
        ("tunable: stopped", "tunable: stoped", "text::bad_value 10:69", "`stopped`"),
        ("effect: none", "effect: non", "text::bad_value 12:54", "`none`"),
        ("effect: none", "effect: nothing", "text::bad_value 12:54", "`{ undo: OPERATION }`"),
        ("below: [self.y", "below: [age(self.y)", "text::wrong_type 12:95", "`{ age: [self.y] }`"),
        ("default: 1.0", "default: 1,0", "text::unknown_key 10:36", "with a point"),
        ("args: [float]", "args: float", "text::wrong_type 12:22", "args: [float, int]"),
        ("period_ms: 1.0", "period_ms: 1ms", "text::bad_time 14:25", "period_ms: 1"),
        ("period_ms: 1.0", "period_ms: 0", "text::bad_time 14:25", "more than 0"),
        ("period_ms: 1.0", "period_ms: '2.5'", "text::bad_time 14:25", "period_ms: 2.5`"),
        ("period_ms: 1.0", "period_s: 1.0", "text::unknown_key 14:14", "`period_ms`"),
        ("priority: 80", "priority: 100", "text::bad_value 14:40", "99"),
        ("[c.lua]", "[d.lua]", "text::no_file 15:18", "`c.lua`"),
        ("[c.lua]", "[c.txt]", "text::unknown_language 15:18", ".lua"),
        ("coordinator: k.lua", "coordinator: kk.lua", "text::no_file 16:14", "`k.lua`"),
        ("coordinator: k.lua", "coordinator: c.lua", "text::nothing 1:1", "return state"),
        ("emits: [e_ready]", "emits: [e ready]", "text::bad_name 17:9", "blanks"),
        ("emits: [e_ready]", "emits: [e_ready, e_ready]", "text::duplicate_key 17:18", "once"),
        ("event: e_start", "evnt: e_start", "text::unknown_key 18:11", "`event`"),
        ("up: operational", "up: opera-tional", "text::bad_name 18:31", "operational"),
        ("within_s: 20 }\nshut", "within_s: 20s }\nshut", "text::bad_time 18:71", "within_s: 20"),
        ("within_s: 20 }\nshut", "within: 20 }\nshut", "text::unknown_key 18:61", "`within_s`"),
        ("down: idle, ", "", "text::missing_key 19:11", "down: idle"),
        ("stack: 32", "stack: 0", "text::bad_value 20:18", "100000"),
        ("step_timeout_s: 0.5", "step_timeout_s: 500000", "text::bad_time 20:38", "longer than a day"),
        ("step_timeout_s: 0.5", "step_timeout_ms: 0.5", "text::unknown_key 20:22", "`step_timeout_s`"),
        ("moves: true", "moves: yes", "text::wrong_type 12:67", "true or false"),
        ("moves: true, settled", "moves: true, setled", "text::unknown_key 12:73", "`settled_by`"),
        ("below: [self.y", "belw: [self.y", "monitor::unknown_word 12:87", "`below`"),
        ("    operations:", "    moves: [start, halt]\n    operations:", "text::bad_value 11:20", "`start`"),
        ("rest: [up]", "rest: [\"u p\"]", "text::bad_name 19:65", "rest: [park]"),
        ("rest: [up]", "rest: [up, up]", "text::duplicate_key 19:69", "once"),
        ("[e_estop]", "[e_estop, e_estop]", "text::duplicate_key 21:19", "once"),
        ("[e_estop]", "[e estop]", "text::bad_name 21:10", "safety: [e_estop]"),
        ("[up, A.k]", "[up, A.]", "text::bad_name 22:16", "operator: ["),
        ("[up, A.k]", "[up, A.k, up]", "text::duplicate_key 22:21", "once"),
        ("step: \"start A\"", "stp: \"start A\"", "text::unknown_key 23:12", "`step`"),
        ("how: fail", "how: fial", "text::bad_value 23:34", "`fail`"),
        (", how: fail", "", "text::missing_key 23:10", "how: fail"),
        ("times: 2", "times: 0", "text::bad_value 23:47", "times: 2"),
        (
            "safety: [e_estop]",
            "durability: full",
            "deploy::no_journal 21:1",
            "there is no journal yet; leave the key out",
        ),
        ("safety: [e_estop]", "monitors: [m.lua]", "text::no_file 21:12", "`c.lua`"),
        ("safety: [e_estop]", "with: { gain: 1 }", "text::unknown_parameter 21:9", "gain"),
        // A list without elements is no table: `trusted: []` trusts nobody.
        ("safety: [e_estop]", "trusted: []", "text::wrong_type 21:10", "true or false"),
        ("safety: [e_estop]", "trusted: yes", "text::wrong_type 21:10", "true or false"),
        ("{ stack: 32, step_timeout_s: 0.5 }", "[]", "text::wrong_type 20:9", "limits: {"),
        ("effect: none", "effect: []", "text::wrong_type 12:54", "`none`, `irreversible`"),
        ("up: operational", "up: []", "deploy::unknown_state 18:27", "every coordinator has one"),
        ("down: idle", "down: []", "deploy::unknown_state 19:32", "every coordinator has one"),
    ];
    let mut answers = Answers::default();
    for (from, to, expected, hint) in table {
        let loaded = replaced("d.yaml", DEPLOYMENT, from, to);
        // What cannot be told from the text any more is not judged twice.
        answers.one(&loaded, (from, to), expected, hint);
        let refused = loaded.findings[0].is_error();
        assert_eq!(loaded.deployment.is_none(), refused);
        let missing = expected.starts_with("text::no_file") || expected.starts_with("text::unknown_language");
        assert_eq!(loaded.unreadable, missing);
    }
}

const LUA: &str = "\
ConfiguratorConf {
  up = Configuration { timeout = 0.5, group = \"dof\", on_failure = \"rollback\",
    confirm = { event = \"e_ok\", within = 2.0 },
    pre_conf_state = { 'A:stopped', '_default:running' },
    create(\"A\", \"Gain\", { activity = \"control\", properties = { k = 1.0 } }),
    connect(\"A.y\", \"B.u\", { buffer = 8 }),
    operation_call(\"A.reset\", 1.0):undo(\"A.set\", 2.0),
    post_conf_state = { _default='running' },
  },
}
";

/// What asks for undoing is no configuration's name.
#[test]
fn a_configuration_is_not_called_undo() {
    let text = "ConfiguratorConf { undo = Configuration { destroy(\"A\") } }";
    let loaded =
        lang::load_configurations(&Sources::memory([("c.lua", text)]), Path::new("c.lua"), &LoadOptions::default());
    let codes: Vec<&str> = loaded.findings.iter().map(|finding| finding.code.0).collect();
    assert_eq!((codes, loaded.configurations.len()), (vec!["conf::reserved_name"], 0));
}

#[test]
fn configurations_in_lua() {
    let table = [
        ("ConfiguratorConf {", "ConfiguratorCnf {", "lua::undefined 1:1", "`ConfiguratorConf`"),
        ("ConfiguratorConf {", "ConfigurationConf {", "lua::undefined 1:1", "`ConfiguratorConf`"),
        ("timeout = 0.5", "timeout = timeout", "lua::undefined 2:34", "local timeout"),
        ("= Configuration {", "= Configuraton {", "lua::undefined 2:8", "`Configuration`"),
        ("timeout =", "timout =", "text::unknown_key 2:24", "`timeout`"),
        ("timeout = 0.5", "timeout = '500ms'", "text::bad_time 2:34", "timeout = 0.5"),
        ("timeout = 0.5", "timeout = -1", "text::bad_time 2:34", "more than 0"),
        ("timeout = 0.5", "timeout_ms = 500", "text::unknown_key 2:24", "`timeout`"),
        ("group = \"dof\"", "group = \"d of\"", "text::bad_name 2:47", "dof"),
        ("\"rollback\"", "\"rolback\"", "text::bad_value 2:67", "`rollback`"),
        ("\"rollback\"", "\"hold\"", "conf::confirm_contradicted 3:5", "keep one"),
        ("on_failure = \"rollback\"", "safe = true", "conf::confirm_contradicted 3:5", "keep one"),
        ("confirm = { event = \"e_ok\", within = 2.0 }", "safe = true", "conf::on_failure_safe 2:54", "leave"),
        ("on_failure", "holds = abov(\"A.y\", 1.0), on_failure", "lua::undefined 2:62", "`above`"),
        ("on_failure", "holds = above(\"A.y\"), on_failure", "monitor::arguments 2:62", "above("),
        ("on_failure", "holds = 1.0, on_failure", "text::wrong_type 2:54", "a condition"),
        (
            "on_failure",
            "holds = above(\"A.y\", 1.0).for_at_least(0.1), on_failure",
            "monitor::arguments 2:80",
            "`above(\"A.x\", 2.0):for_at_least(0.3)`",
        ),
        (
            "on_failure",
            "holds = above(abc.y, 1.0), on_failure",
            "lua::undefined 2:68",
            "in quotes: `\"abc.y\"`; if not",
        ),
        (
            "on_failure",
            "holds = above(\"A.y\", \"1.5 m/s\"), on_failure",
            "text::wrong_type 2:75",
            "`above(\"A.x\", 1.5)`",
        ),
        ("event = \"e_ok\"", "evnt = \"e_ok\"", "text::unknown_key 3:17", "`event`"),
        ("'A:stopped'", "'A:stoped'", "conf::bad_state 4:27", "`stopped`"),
        ("'A:stopped'", "'A.stopped'", "conf::bad_state 4:24", "component:state"),
        ("'A:stopped'", "'A-B:stopped'", "text::bad_name 4:25", "compA:running"),
        ("'A:stopped'", "'A:faulted'", "conf::faulted_demanded 4:27", "unconfigured"),
        ("'A:stopped'", "'_default:stopped'", "conf::default_twice 4:45", "keep one"),
        ("pre_conf_state", "pre_conf_sate", "text::unknown_key 4:5", "`pre_conf_state`"),
        ("create(", "crate(", "lua::undefined 5:5", "`create`"),
        // The word that others would say.
        ("connect(\"A.y\"", "set(\"A.y\"", "lua::undefined 6:5", "did you mean `property_set`"),
        ("connect(\"A.y\"", "call(\"A.y\"", "lua::undefined 6:5", "did you mean `operation_call`"),
        ("connect(\"A.y\"", "write(\"A.y\"", "lua::undefined 6:5", "did you mean `port_write`"),
        ("\"Gain\"", "\"Ga in\"", "text::bad_name 5:17", "youbot.Dynamics"),
        ("activity =", "activty =", "text::unknown_key 5:27", "`activity`"),
        ("properties =", "propertys =", "text::unknown_key 5:49", "`properties`"),
        ("\"A.y\"", "\"A\"", "text::bad_name 6:13", "Component.member"),
        ("buffer = 8", "bufer = 8", "text::unknown_key 6:29", "`buffer`"),
        ("buffer = 8", "buffer = 0", "text::bad_value 6:38", "1 to"),
        ("{ buffer = 8 }", "\"dta\"", "text::bad_value 6:27", "`{ buffer = 8 }`"),
        ("up = Configuration {", "e_done = Configuration {", "conf::reserved_name 2:12", "another name"),
        ("connect(\"A.y\", \"B.u\", { buffer = 8 })", "connect(\"A.y\")", "text::missing_key 6:5", "`to`"),
        ("connect(\"A.y\", \"B.u\", { buffer = 8 })", "destroy(\"A\", 1)", "lua::arguments 6:5", "destroy(component)"),
        (":undo(", ":udno(", "lua::undefined 7:36", "undo"),
        (
            "_default='running'",
            "_default='running', A='stopped'",
            "conf::keyed_entries 8:5",
            "'A:stopped', '_default:running'",
        ),
        ("_default='running'", "_dfault='running' }, nothing = {", "text::unknown_key 8:46", "keys"),
    ];
    let mut answers = Answers::default();
    for (from, to, expected, hint) in table {
        let loaded = replaced("c.lua", LUA, from, to);
        // A misspelt constructor leaves its arguments unused: said once, about the name.
        answers.one(&loaded, (from, to), expected, hint);
        assert!(loaded.deployment.is_none() && !loaded.unreadable);
    }
    assert!(with_configurations(LUA).findings.is_empty());
    let broken = replaced("c.lua", LUA, "timeout = 0.5,", "timeout = 0.5;;");
    assert_eq!(codes(&broken), ["text::syntax 2:3"]);
    assert!(broken.unreadable);
    // A word of Lua itself, in each kind of file.
    let misspelt = load(&[("c.lua", &format!("  lcoal rate = 0.5\n{LUA}"))], &LoadOptions::default());
    answers.one(&misspelt, ("local", "lcoal"), "text::syntax 1:3", "`local`");
    let coordinator = COORDINATOR.replacen("return state", "retunr state", 1);
    assert_ne!(coordinator, COORDINATOR);
    let misspelt = load(&[("k.lua", &coordinator), ("c.lua", LUA)], &LoadOptions::default());
    answers.one(&misspelt, ("return", "retunr"), "text::syntax 1:1", "`return`");
}

/// What is meant to be true or false, and is neither.
#[test]
fn what_is_nearly_true_or_false_is_told() {
    let mut answers = Answers::default();
    for (written, meant) in [("treu", "true"), ("Flase", "false"), ("yes", "true"), ("off", "false")] {
        let text = YAML.replacen("    timeout: 0.5", &format!("    safe: {written}\n    timeout: 0.5"), 1);
        answers.one(&yaml(&text), ("safe: true", written), "text::wrong_type 3:11", &format!("`{meant}`"));
    }
}

const YAML: &str = "\
configurations:
  up:
    timeout: 0.5
    group: dof
    pre_conf_state: [\"A:stopped\", \"_default:running\"]
    changes:
      - create: { component: A, type: Gain, activity: control, properties: { k: 1.0 } }
      - connect: { from: A.y, to: B.u, policy: { buffer: 8 } }
      - operation_call: { operation: A.reset, args: [1.0], undo: { operation: A.set, args: [2.0] } }
    post_conf_state: [\"_default:running\"]
    confirm: { event: e_ok, within: 2.0 }
    on_failure: rollback
";

fn yaml(text: &str) -> Loaded {
    let deployment = DEPLOYMENT.replace("c.lua", "c.yaml");
    load(&[("d.yaml", &deployment), ("c.yaml", text)], &LoadOptions::default())
}

#[test]
fn configurations_in_yaml() {
    let table = [
        ("configurations:", "configuration:", "text::unknown_key 1:1", "`configurations`"),
        ("timeout: 0.5", "timeout: 500ms", "text::bad_time 3:14", "timeout: 0.5"),
        ("timeout: 0.5", "timout: 0.5", "text::unknown_key 3:5", "`timeout`"),
        ("\"A:stopped\"", "\"A:stoped\"", "conf::bad_state 5:25", "`stopped`"),
        ("\"A:stopped\"", "\"A:faulted\"", "conf::faulted_demanded 5:25", "unconfigured"),
        ("\"A:stopped\"", "\"_default:stopped\"", "conf::default_twice 5:43", "keep one"),
        ("- create:", "- crate:", "conf::unknown_change 7:9", "`create`"),
        ("component: A", "compnent: A", "text::unknown_key 7:19", "`component`"),
        (
            "- create: {",
            "- create:\n        component: A\n      - create: {",
            "conf::unknown_change 8:9",
            "`component` belongs to `create`",
        ),
        ("k: 1.0", "k-1: 1.0", "text::bad_name 7:78", "friction_comp"),
        ("from: A.y", "from: Ay", "text::bad_name 8:26", "Component.member"),
        ("buffer: 8", "bufer: 8", "text::unknown_key 8:50", "`buffer`"),
        ("args: [1.0]", "args: 1.0", "text::wrong_type 9:53", "args: [6]"),
        (
            "  up:\n    timeout: 0.5\n    group: dof\n",
            "  up:\n  group: dof\n  down:\n",
            "text::wrong_type 3:3",
            "indent",
        ),
        ("undo: { operation", "undo: { operatoin", "text::unknown_key 9:68", "`operation`"),
        ("on_failure: rollback", "on_failure: rolback", "text::bad_value 12:17", "`rollback`"),
        ("on_failure: rollback", "on_failure: hold", "conf::confirm_contradicted 11:5", "keep one"),
        ("on_failure: rollback", "safe: true", "conf::confirm_contradicted 11:5", "keep one"),
        ("confirm: { event: e_ok, within: 2.0 }", "safe: true", "conf::on_failure_safe 12:5", "leave"),
        ("on_failure: rollback", "holds: { abov: [A.y, 1.0] }", "monitor::unknown_word 12:14", "`above`"),
        (
            "[\"_default:running\"]\n    conf",
            "{ _default: running }\n    conf",
            "conf::keyed_entries 10:22",
            "\"_default:running\"",
        ),
        (
            "connect: { from: A.y, to: B.u, policy: { buffer: 8 } }",
            "connect: [A.y, B.u]",
            "text::wrong_type 8:18",
            "connect: { from: Kin.jacobian",
        ),
        (
            "[\"_default:running\"]\n    conf",
            "{ _default: running, A: stopped }\n    conf",
            "conf::keyed_entries 10:22",
            "\"A:stopped\"",
        ),
    ];
    let mut answers = Answers::default();
    for (from, to, expected, hint) in table {
        assert!(YAML.contains(from));
        answers.one(&yaml(&YAML.replacen(from, to, 1)), (from, to), expected, hint);
    }
}

#[test]
fn both_spellings_give_the_same_model() {
    let lua = with_configurations(LUA);
    let yaml = yaml(YAML);
    crate::helpers::clean(&lua);
    crate::helpers::clean(&yaml);
    assert_eq!(lua.deployment.unwrap().configurations, yaml.deployment.unwrap().configurations);
}

#[test]
fn coordinators() {
    let table = [
        ("idle = state {}", "idle = sate {}", "lua::undefined 2:10", "`state`"),
        ("trans { src = \"initial\"", "tarns { src = \"initial\"", "lua::undefined 5:3", "`trans`"),
        ("config = \"up\"", "confg = \"up\"", "text::unknown_key 3:25", "`config`"),
        ("config = \"up\"", "config = \"u p\"", "text::bad_name 3:34", "enable_copying"),
        ("config = \"up\"", "entry = function() end", "chart::function 3:25", "entry = \"e_ready\""),
        ("events = { \"e_start\" }", "event = { \"e_start\" }", "text::unknown_key 6:46", "`events`"),
        ("events = { \"e_start\" }", "events = { \"e start\" }", "text::bad_name 6:57", "blanks"),
        ("events = { \"e_start\" }", "guard = function() end", "chart::function 6:46", "pure"),
        ("\"e_start\"", "\"e_after(soon)\"", "text::bad_name 6:57", "e_after(SECONDS)"),
        ("\"e_start\"", "\"e_after(2s)\"", "text::bad_name 6:57", "\"e_after(2)\""),
        ("\"e_start\"", "\"e_at 500ms\"", "text::bad_name 6:57", "\"e_at(0.5)\""),
        ("fault = state {}", "fault = {}", "text::unknown_key 4:3", "`fault = state { … }`"),
        ("src = \"idle\"", "src = 1", "text::wrong_type 6:17", "src = \"idle\""),
        ("fault = state {}", "entry = state {}", "chart::reserved_name 4:3", "another name"),
        ("return state", "local s = state", "text::nothing 1:1", "return state"),
    ];
    let mut answers = Answers::default();
    for (from, to, expected, hint) in table {
        answers.one(&replaced("k.lua", COORDINATOR, from, to), (from, to), expected, hint);
    }
    let text = "coordinator:\n  states:\n    idle: {}\n    busy: { confg: up }\n  transitions:\n    - { src: initial, target: idle }\n";
    let loaded =
        lang::load_coordinator(&Sources::memory([("k.yaml", text)]), Path::new("k.yaml"), &LoadOptions::default());
    let found: Vec<_> = loaded.findings.iter().map(|f| f.code.0).collect();
    assert_eq!(found, ["text::unknown_key", "text::unknown_key"], "all findings, not the first");
    let text = text.replace("confg: up", "entry: e_x").replace("target: idle", "tgt: idle, guard: \"A.y > 1\"");
    let loaded =
        lang::load_coordinator(&Sources::memory([("k.yaml", &*text)]), Path::new("k.yaml"), &LoadOptions::default());
    let told: Vec<_> = loaded.findings.iter().map(|f| (f.code.0, f.help.clone().unwrap_or_default())).collect();
    assert!(
        matches!(&told[..], [("text::wrong_type", help)] if help.contains("let a monitor raise an event")),
        "{told:?}"
    );
    // A coordinator's file among the configurations.
    let loaded =
        load(&[("d.yaml", &DEPLOYMENT.replace("c.lua", "k.yaml")), ("k.yaml", &text)], &LoadOptions::default());
    let told = loaded.findings.first().and_then(|f| f.help.clone()).unwrap_or_default();
    assert!(
        told.contains("name this file under `coordinator` in the deployment, and not under `configurations`"),
        "{told}"
    );
}

/// Only functions have a host, and only Lua has functions.
#[test]
fn a_host_of_coordinators_that_are_not_in_lua_is_told() {
    let chart = "coordinator:\n  states: { idle: {}, operational: {}, fault: {} }\n  transitions: [{ src: initial, tgt: idle }]\n";
    let deployment = DEPLOYMENT.replace("k.lua", "k.yaml");
    for (trusted, wanted) in
        [("trusted: true\nhost: [h.lua]\n", &["text::bad_value 25:8"][..]), ("trusted: true\n", &[])]
    {
        let text = format!("{deployment}{trusted}");
        let files = [("d.yaml", text.as_str()), ("k.yaml", chart), ("h.lua", "")];
        let loaded = load(&files, &LoadOptions::default());
        assert_eq!(codes(&loaded), wanted, "{}", shown(&loaded.findings, &loaded.sources));
    }
}

#[test]
fn rfsm_spellings_are_understood() {
    let plain = "return state { a = state {}, c = conn {}, trans { src = 'initial', tgt = 'a' } }";
    for text in [
        "return rfsm.state { a = rfsm.sista {}, c = rfsm.conn {}, rfsm.trans { src = 'initial', tgt = 'a' } }",
        "local rfsm = require 'rfsm'\nreturn rfsm.composite_state { a = simple_state {}, c = connector {}, transition { src = 'initial', tgt = 'a' } }",
        "return rfsm.csta:new { a = rfsm.state:new {}, c = rfsm.connector:new {}, rfsm.transition:new { src = 'initial', tgt = 'a' } }",
        "local s = state {} s.a = state {} s.c = conn {} s[#s + 1] = trans { src = 'initial', tgt = 'a', events = {} } return s",
    ] {
        let chart = |text: &str| {
            let loaded = lang::load_coordinator(
                &Sources::memory([("k.lua", text)]),
                Path::new("k.lua"),
                &LoadOptions::default(),
            );
            assert!(loaded.findings.is_empty(), "{}", shown(&loaded.findings, &loaded.sources));
            loaded.coordinator.unwrap()
        };
        assert_eq!(chart(text), chart(plain), "{text}");
    }
}

#[test]
fn all_findings_come_at_once() {
    let text = "ConfiguratorConf {\n  up = Configuration { timeot = 1,\n    property_set(\"A k\", 1),\n    destroy(undefined_name),\n    connect(\"A.y\", 5),\n  },\n}";
    assert_eq!(
        codes(&with_configurations(text)),
        ["lua::undefined 4:13", "text::bad_name 3:18", "text::wrong_type 5:20", "text::unknown_key 2:24"]
    );
}

/// What helps is written as the file is in which the mistake stands.
#[test]
fn examples_are_in_the_language_of_the_file() {
    let mut answers = Answers::default();
    let lua = [
        ("connect(\"A.y\", \"B.u\", { buffer = 8 })", "connect(\"A.y\")", "text::missing_key 6:5", "`connect(\"Kin."),
        ("\"Gain\",", "nil,", "text::missing_key 5:5", "`create("),
        ("event = \"e_ok\", ", "", "text::missing_key 3:5", "`event = \"e_aligned\"`"),
        ("within = 2.0", "within = true", "text::wrong_type 3:33", "`within = 2.0`"),
        ("'A:stopped'", "'A'", "conf::bad_state 4:24", "`{ 'compA:running'"),
    ];
    for (from, to, expected, hint) in lua {
        answers.one(&replaced("c.lua", LUA, from, to), (from, to), expected, hint);
    }
    let text = "configurations:
  up:
    timeout: 0.5
    confirm: { event: e_ok, within: 2.0 }
    holds: { above: [A.y, 1.0] }
    pre_conf_state: [\"A:stopped\"]
    changes:
      - connect: { from: A.y, to: B.u, policy: { buffer: 8 } }
      - create: { component: A, type: Gain, properties: { k: 1.0 } }
";
    let table = [
        ("timeout: 0.5", "timeout: half", "text::bad_time 3:14", "`timeout: 0.5`"),
        ("event: e_ok, ", "", "text::missing_key 4:14", "`event: e_aligned`"),
        ("within: 2.0", "within: true", "text::wrong_type 4:37", "`within: 2.0`"),
        ("above: [A.y, 1.0]", "above: [A.y]", "monitor::arguments 5:14", "`{ above: [A.x, 2.0] }`"),
        ("holds: { above: [A.y, 1.0] }", "holds: 3", "text::wrong_type 5:12", "`{ above: [A.x, 2.0] }`"),
        ("A:stopped", "A", "conf::bad_state 6:22", "[\"compA:running\""),
        ("[\"A:stopped\"]", "{ A: stopped, B: stopped }", "conf::keyed_entries 6:21", "[\"A:stopped\", \"B:stopped\"]"),
        ("[\"A:stopped\"]", "3", "text::wrong_type 6:21", "[\"compA:running\""),
        (", to: B.u", "", "text::missing_key 8:18", "`to: Dynamics.jacobian`"),
        ("buffer: 8", "buffer: 0", "text::bad_value 8:58", "`buffer: 64`"),
        (
            "- create: { component: A, type: Gain, properties: { k: 1.0 } }",
            "- 3",
            "text::wrong_type 9:9",
            "- property_set: {",
        ),
        ("{ k: 1.0 }", "3", "text::wrong_type 9:57", "`properties: { friction_comp: 0.9 }`"),
    ];
    for (from, to, expected, hint) in table {
        assert!(text.contains(from), "`{from}` is not in the example");
        answers.one(&yaml(&text.replacen(from, to, 1)), (from, to), expected, hint);
    }
}

/// What there is instead of an unknown key is what can be written there.
#[test]
fn the_keys_that_there_are_are_those_of_the_language() {
    let told = |loaded: &Loaded| -> String { loaded.findings.iter().filter_map(|found| found.help.clone()).collect() };
    let lua = [
        ("c.lua", LUA, "timeout = 0.5", "xyzq = 0.5", "`timeout`", &["`changes`"][..]),
        ("c.lua", LUA, "{ buffer = 8 }", "{ xyzq = 8 }", "`buffer`", &["`from`", "`to`"]),
        (
            "k.lua",
            COORDINATOR,
            "idle = state {}",
            "idle = state { xyzq = 1 }",
            "`entry`",
            &["`states`", "`transitions`"],
        ),
    ];
    for (file, text, from, to, known, others) in lua {
        let told = told(&replaced(file, text, from, to));
        assert!(told.contains(known) && others.iter().all(|other| !told.contains(other)), "{to}: {told}");
    }
    let text =
        "coordinator:\n  states:\n    idle: { xyzq: 1 }\n  transitions:\n    - { src: initial, tgt: idle, xyzp: 1 }\n";
    let yaml =
        lang::load_coordinator(&Sources::memory([("k.yaml", text)]), Path::new("k.yaml"), &LoadOptions::default());
    let told: String = yaml.findings.iter().filter_map(|found| found.help.clone()).collect();
    assert!(told.contains("`states`") && told.contains("`effect`"), "{told}");
    assert!(!told.contains("`doo`") && !told.contains("`guard`"), "{told}");
    // In Lua changes stand in a configuration as they are, also where there are none.
    let mut answers = Answers::default();
    for changes in ["changes = {},", "changes = { destroy(\"A\") },", "changes = 1,"] {
        let to = format!("{changes} timeout = 0.5,");
        let loaded = replaced("c.lua", LUA, "timeout = 0.5,", &to);
        answers.one(&loaded, ("timeout = 0.5,", &to), "text::unknown_key 2:24", "stand in it as they are");
    }
}
