//! One name, several types: a hot swap destroys `ctrl: Pid` and creates `ctrl: Mpc` in one configuration. What is written
//! about `ctrl` is judged by the type that it has there, whichever configuration stands first in the text.

use crate::demo::Demo;
use serde_json::Value;

/// A member of both types, and what may be done to it while `ctrl` is the one or the other.
struct Shared {
    what: &'static str,
    /// Its declaration in `Pid` and in `Mpc`.
    pid: &'static str,
    mpc: &'static str,
    /// A change that fits `Pid`, what must be taken back before `ctrl` is destroyed, and a change that fits `Mpc`.
    of_pid: &'static str,
    off: &'static str,
    of_mpc: &'static str,
    /// What is wrong when that of `Pid` is asked of `Mpc`: code, message, help.
    wrong: [&'static str; 3],
}

const SHARED: &[Shared] = &[
    Shared {
        what: "direction",
        pid: "ports: { x: { direction: in, type: float } }",
        mpc: "ports: { x: { direction: out, type: float } }",
        of_pid: "connect('plant.y', 'ctrl.x')",
        off: "disconnect('plant.y', 'ctrl.x')",
        of_mpc: "connect('ctrl.x', 'plant.u')",
        wrong: [
            "conf::not_an_in_port",
            "`ctrl.x` is an out-port; a connection ends at an in-port",
            "are the two ends the wrong way round? the out-port is the first: `connect(out_port, in_port)`",
        ],
    },
    Shared {
        what: "direction of a written port",
        pid: "ports: { x: { direction: in, type: float } }",
        mpc: "ports: { x: { direction: out, type: float } }",
        of_pid: "port_write('ctrl.x', 1.0)",
        off: "",
        of_mpc: "connect('ctrl.x', 'plant.u')",
        wrong: [
            "conf::not_an_in_port",
            "`ctrl.x` is an out-port; only an in-port can be written",
            "name an in-port: what leaves an out-port, its component decides",
        ],
    },
    Shared {
        what: "type of a port",
        pid: "ports: { x: { direction: in, type: float } }",
        mpc: "ports: { x: { direction: in, type: int } }",
        of_pid: "connect('plant.y', 'ctrl.x')",
        off: "disconnect('plant.y', 'ctrl.x')",
        of_mpc: "connect('plant.n', 'ctrl.x')",
        wrong: [
            "conf::port_types",
            "`plant.y` carries float, `ctrl.x` takes int",
            "connect ports of the same type; nothing is converted on the way",
        ],
    },
    Shared {
        what: "unit of a port",
        pid: "ports: { x: { direction: in, type: float, unit: N } }",
        mpc: "ports: { x: { direction: in, type: float, unit: m } }",
        of_pid: "connect('plant.force', 'ctrl.x')",
        off: "disconnect('plant.force', 'ctrl.x')",
        of_mpc: "connect('plant.way', 'ctrl.x')",
        wrong: [
            "conf::port_units",
            "`plant.force` is in N, `ctrl.x` in m",
            "put a component between them that converts, or correct the unit of one",
        ],
    },
    Shared {
        what: "buffered or not",
        pid: "ports: { x: { direction: in, type: float } }",
        mpc: "ports: { x: { direction: in, type: float, buffered: true } }",
        of_pid: "connect('plant.y', 'ctrl.x')",
        off: "disconnect('plant.y', 'ctrl.x')",
        of_mpc: "connect('plant.y', 'ctrl.x', { buffer = 4 })",
        wrong: [
            "conf::needs_buffer",
            "`ctrl.x` takes only buffered connections",
            "give the connection a buffer, such as `buffer = 64`",
        ],
    },
    Shared {
        what: "buffered or not, of a written port",
        pid: "ports: { x: { direction: in, type: float } }",
        mpc: "ports: { x: { direction: in, type: float, buffered: true } }",
        of_pid: "port_write('ctrl.x', 1.0)",
        off: "",
        of_mpc: "connect('plant.y', 'ctrl.x', { buffer = 4 })",
        wrong: [
            "conf::port_not_writable",
            "`ctrl.x` is a buffered port and cannot be written",
            "connect a component that sends what you want to write",
        ],
    },
    Shared {
        what: "event port",
        pid: "ports: { x: { direction: in, type: string } }",
        mpc: "ports: { x: { direction: in, type: event } }",
        of_pid: "port_write('ctrl.x', 'go')",
        off: "",
        of_mpc: "connect('plant.e', 'ctrl.x')",
        wrong: [
            "conf::port_not_writable",
            "`ctrl.x` is an event port and cannot be written",
            "connect a component that sends what you want to write",
        ],
    },
    Shared {
        what: "type of a property",
        pid: "properties: { k: { type: float, default: 1.0 } }",
        mpc: "properties: { k: { type: string, default: slow } }",
        of_pid: "property_set('ctrl.k', 2.0)",
        off: "",
        of_mpc: "property_set('ctrl.k', 'fast')",
        wrong: [
            "conf::bad_value",
            "`ctrl.k` cannot be 2.0: expected string, found a float (2)",
            "give it a value of type string",
        ],
    },
    Shared {
        what: "range of a property",
        pid: "properties: { k: { type: float, default: 1.0, max: 10.0, unit: N } }",
        mpc: "properties: { k: { type: float, default: 30.0, min: 20.0, unit: N } }",
        of_pid: "property_set('ctrl.k', 2.0)",
        off: "",
        of_mpc: "property_set('ctrl.k', 25)",
        wrong: [
            "conf::bad_value",
            "`ctrl.k` cannot be 2.0: 2 is less than 20",
            "give it a value of type float, in N (written without the unit), at least 20",
        ],
    },
    Shared {
        what: "length of an array",
        pid: "properties: { k: { type: 'float[2]', default: [1.0, 2.0] } }",
        mpc: "properties: { k: { type: 'float[3]', default: [1.0, 2.0, 3.0] } }",
        of_pid: "property_set('ctrl.k', { 3, 4 })",
        off: "",
        of_mpc: "property_set('ctrl.k', { 3, 4, 5 })",
        wrong: [
            "conf::bad_value",
            "`ctrl.k` cannot be {3, 4}: expected 3 elements, found 2",
            "give it a value of type float[3]",
        ],
    },
    Shared {
        what: "type of a written value",
        pid: "ports: { x: { direction: in, type: float } }",
        mpc: "ports: { x: { direction: in, type: bool } }",
        of_pid: "port_write('ctrl.x', 1.0)",
        off: "",
        of_mpc: "port_write('ctrl.x', true)",
        wrong: [
            "conf::bad_value",
            "`ctrl.x` cannot be 1.0: expected bool, found a float (1)",
            "give it a value of type bool",
        ],
    },
    Shared {
        what: "number of arguments",
        pid: "operations: { home: { args: [], effect: none } }",
        mpc: "operations: { home: { args: [float], effect: none } }",
        of_pid: "operation_call('ctrl.home')",
        off: "",
        of_mpc: "operation_call('ctrl.home', 0.5)",
        wrong: ["conf::bad_arguments", "`ctrl.home` takes 1 argument, 0 are given", "call it as ctrl.home(float)"],
    },
    Shared {
        what: "type of an argument",
        pid: "operations: { home: { args: [float], effect: none } }",
        mpc: "operations: { home: { args: [string], effect: none } }",
        of_pid: "operation_call('ctrl.home', 1)",
        off: "",
        of_mpc: "operation_call('ctrl.home', 'left')",
        wrong: [
            "conf::bad_arguments",
            "argument 1 of `ctrl.home` cannot be 1: expected string, found an int (1)",
            "call it as ctrl.home(string)",
        ],
    },
    Shared {
        what: "arguments of an undo",
        pid: "operations: { home: { args: [] } }",
        mpc: "operations: { home: { args: [float] } }",
        of_pid: "operation_call('plant.reset'):undo('ctrl.home')",
        off: "",
        of_mpc: "operation_call('plant.reset'):undo('ctrl.home', 1.5)",
        wrong: ["conf::bad_arguments", "`ctrl.home` takes 1 argument, 0 are given", "call it as ctrl.home(float)"],
    },
    Shared {
        what: "a member of the old type only",
        pid: "properties: { k: { type: float, default: 1.0 } }",
        mpc: "properties: { steps: { type: int, default: 5 } }",
        of_pid: "property_set('ctrl.k', 2.0)",
        off: "",
        of_mpc: "property_set('ctrl.steps', 8)",
        wrong: ["conf::unknown_property", "ctrl (Mpc) has no property `k`", "known properties: `steps`"],
    },
    Shared {
        what: "a member of another kind",
        pid: "properties: { k: { type: float, default: 1.0 } }",
        mpc: "ports: { k: { direction: in, type: float } }",
        of_pid: "property_set('ctrl.k', 2.0)",
        off: "",
        of_mpc: "port_write('ctrl.k', 3.0)",
        wrong: ["conf::unknown_property", "ctrl (Mpc) has no property `k`", "`k` is a port of Mpc"],
    },
];

const COORDINATOR: &str = r#"return state {
  idle = state {},
  raising = state { entry = "up" },
  operational = state {},
  swapping = state { entry = "swap" },
  swapped = state {},
  back = state { entry = "swap.undo" },
  leaving = state { entry = "up.undo" },
  failed = state {},
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "raising", events = { "e_start" } },
  trans { src = "raising", tgt = "operational", events = { "up.ok" } },
  trans { src = "raising", tgt = "failed", events = { "up.failed", "up.broken" } },
  trans { src = "operational", tgt = "swapping", events = { "e_swap" } },
  trans { src = "operational", tgt = "leaving", events = { "e_shutdown" } },
  trans { src = "swapping", tgt = "swapped", events = { "swap.ok" } },
  trans { src = "swapping", tgt = "operational", events = { "swap.failed" } },
  trans { src = "swapping", tgt = "failed", events = { "swap.broken" } },
  trans { src = "swapped", tgt = "back", events = { "e_shutdown" } },
  trans { src = "back", tgt = "leaving", events = { "swap.undone" } },
  trans { src = "back", tgt = "failed", events = { "swap.undo.failed", "swap.undo.broken" } },
  trans { src = "leaving", tgt = "idle", events = { "up.undone" } },
  trans { src = "leaving", tgt = "failed", events = { "up.undo.failed", "up.undo.broken" } },
  trans { src = "failed", tgt = "back", events = { "e_shutdown" } },
}
"#;

/// A deployment in which `ctrl` is a `Pid` with that member after `up`, and an `Mpc` with this one after `swap`.
fn deployment(pid: &str, mpc: &str, up: &str, swap: &str, swap_first: bool) -> Demo {
    let demo = Demo::new();
    demo.write(
        "deployment.yaml",
        &format!(
            "davit: 1\nname: swap\nplatform: simulated\ntypes:\n  Pid:\n    {pid}\n  Mpc:\n    {mpc}\n  Plant:\n    ports:\n      \
             y: {{ direction: out, type: float }}\n      n: {{ direction: out, type: int }}\n      \
             e: {{ direction: out, type: event }}\n      force: {{ direction: out, type: float, unit: N }}\n      \
             way: {{ direction: out, type: float, unit: m }}\n      u: {{ direction: in, type: float }}\n    \
             operations:\n      reset: {{ args: [], effect: none }}\n\
             configurations: [configurations.lua]\ncoordinator: coordinator.lua\n\
             deploy:   {{ event: e_start,    up: operational, failed: [failed], within_s: 5 }}\n\
             shutdown: {{ event: e_shutdown, down: idle,      within_s: 5 }}\n"
        ),
    );
    let up =
        format!("  up = Configuration {{\n    create('ctrl', 'Pid'), create('plant', 'Plant'),\n    {up}\n  }},\n");
    let swap = format!("  swap = Configuration {{\n    destroy('ctrl'), create('ctrl', 'Mpc'),\n    {swap}\n  }},\n");
    let both = if swap_first { swap + &up } else { up + &swap };
    demo.write("configurations.lua", &format!("ConfiguratorConf {{\n{both}}}\n"));
    demo.write("coordinator.lua", COORDINATOR);
    demo
}

fn errors(json: &Value) -> Vec<Value> {
    json["findings"].as_array().unwrap().iter().filter(|f| f["severity"] == "error").cloned().collect()
}

#[test]
fn a_swap_between_types_that_share_a_name_is_sound_and_is_planned() {
    for (shared, swap_first) in SHARED.iter().flat_map(|shared| [(shared, false), (shared, true)]) {
        let swap = format!("{}{}{}", shared.off, if shared.off.is_empty() { "" } else { ", " }, shared.of_mpc);
        let demo = deployment(shared.pid, shared.mpc, shared.of_pid, &swap, swap_first);
        let ran = demo.run(&["check", "deployment.yaml", "--json"]);
        assert!(ran.code == 0 && errors(&ran.json()).is_empty(), "{}: {}{}", shared.what, ran.out, ran.err);
        let planned = demo.run(&["plan", "deployment.yaml", "up", "swap", "--json"]);
        assert_eq!(planned.code, 0, "{}: {}{}", shared.what, planned.out, planned.err);
        assert_eq!(planned.json()[1]["result"]["components"]["ctrl"]["type"], "Mpc", "{}", shared.what);
    }
}

#[test]
fn what_only_the_old_type_allows_is_refused_where_it_is_written() {
    for (shared, swap_first) in SHARED.iter().flat_map(|shared| [(shared, false), (shared, true)]) {
        // Of the right type, but to the new component.
        let swap = format!("{}{}\n    {}", shared.off, if shared.off.is_empty() { "" } else { "," }, shared.of_pid);
        let demo = deployment(shared.pid, shared.mpc, shared.of_pid, &swap, swap_first);
        let text = demo.read("configurations.lua");
        let swap_at = text.find("swap = ").unwrap();
        let at = swap_at + text[swap_at..].find(&format!("\n    {}\n", shared.of_pid)).unwrap() + 1;
        let line = text[..at].matches('\n').count() + 1;
        let ran = demo.run(&["check", "deployment.yaml", "--json"]);
        let found = errors(&ran.json());
        let of_swap: Vec<&Value> = found
            .iter()
            .filter(|f| f["path"].as_str().is_some_and(|p| p.starts_with("configurations.swap.")))
            .collect();
        assert_eq!(of_swap.len(), 1, "{}: {}", shared.what, ran.out);
        let finding = of_swap[0];
        let [code, message, help] = shared.wrong;
        assert_eq!(finding["code"], code, "{}", shared.what);
        assert_eq!(finding["message"], message, "{}", shared.what);
        assert_eq!(finding["help"], help, "{}", shared.what);
        assert_eq!(finding["line"], line, "{}: {text}", shared.what);
        assert_eq!(ran.code, 1);
        // The planner finds the same, in the same words.
        let planned = demo.run(&["plan", "deployment.yaml", "up", "swap", "--json"]);
        assert_eq!(planned.code, 1, "{}", shared.what);
        assert!(planned.out.contains(code), "{}: {}", shared.what, planned.out);
    }
}

/// The findings about `tune`, which does not create `ctrl` itself.
fn tuned(pid: &str, mpc: &str, change: &str) -> Vec<Value> {
    let demo = deployment(pid, mpc, "", "", false);
    demo.replace("configurations.lua", "ConfiguratorConf {\n", &format!("ConfiguratorConf {{ tune = {change},\n"));
    errors(&demo.run(&["check", "deployment.yaml", "--json"]).json())
}

#[test]
fn a_configuration_that_meets_either_type_is_refused_when_both_refuse_it() {
    let (k, x) =
        ("properties: { k: { type: float, max: 5.0, default: 1.0 } }", "ports: { x: { direction: in, type: float } }");
    let tune = |pid, mpc, change: &str| tuned(pid, mpc, &format!("Configuration {{ {change} }}"));
    assert!(tune(k, x, "property_set('ctrl.k', 2.0), port_write('ctrl.x', 1.0)").is_empty());
    let found = tune(k, x, "property_set('ctrl.gain', 2.0)");
    assert_eq!(found.len(), 1, "{found:#?}");
    assert_eq!(found[0]["message"], "ctrl (Pid or Mpc) has no property `gain`");
    let labels: Vec<&str> = found[0]["labels"].as_array().unwrap().iter().filter_map(|l| l["text"].as_str()).collect();
    for text in ["Pid is declared here", "Mpc is declared here", "`ctrl` is created here as Pid"] {
        assert!(labels.contains(&text), "{labels:?}");
    }
    // Each refuses it for the same reason, or each for its own.
    let found = tune(k, k, "property_set('ctrl.k', 6.0)");
    assert_eq!(found[0]["message"], "`ctrl.k` cannot be 6.0: 6 is more than 5, whether `ctrl` is Pid or Mpc");
    let found = tune(k, x, "property_set('ctrl.k', 6.0)");
    assert_eq!(found.len(), 1, "{found:#?}");
    assert_eq!(found[0]["message"], "`ctrl.k` cannot be 6.0: 6 is more than 5, if `ctrl` is Pid");
    let text = "if `ctrl` is Mpc: ctrl (Mpc) has no property `k`";
    assert!(found[0]["labels"].as_array().unwrap().iter().any(|l| l["text"] == text), "{found:#?}");
    let found = tune(x, x, "disconnect('plant.y', 'ctrl.z')");
    assert_eq!(found[0]["message"], "ctrl (Pid or Mpc) has no port `z`");
}

#[test]
fn disconnects_and_pre_entries_concern_the_component_that_is_destroyed() {
    let (pid, mpc) = ("ports: { x: { direction: in, type: float } }", "ports: { w: { direction: in, type: float } }");
    let swap = "disconnect('plant.y', 'ctrl.x'), connect('plant.y', 'ctrl.w'), \
                pre_conf_state = { 'ctrl:running' }, post_conf_state = { 'ctrl:stopped' }";
    let demo = deployment(pid, mpc, "connect('plant.y', 'ctrl.x')", swap, false);
    let ran = demo.run(&["check", "deployment.yaml", "--json"]);
    assert!(ran.code == 0 && errors(&ran.json()).is_empty(), "{}", ran.out);
    // The new one's port is not there yet when the old one is disconnected.
    demo.replace("configurations.lua", "disconnect('plant.y', 'ctrl.x')", "disconnect('plant.y', 'ctrl.w')");
    let found = errors(&demo.run(&["check", "deployment.yaml", "--json"]).json());
    assert_eq!(found[0]["message"], "ctrl (Pid) has no port `w`");
}

#[test]
fn findings_about_values_name_what_cannot_have_them() {
    let demo = Demo::new();
    let changes = [
        ("k = 2.0", "k = 0/0", "text::not_finite", "`source.k` cannot be NaN: it is not a finite number"),
        ("k = 2.0", "k = 20", "conf::bad_value", "`source.k` cannot be 20: 20 is outside 0 … 10"),
        (
            "\"source.k\", 9",
            "\"source.k\", 1/0",
            "text::not_finite",
            "`source.k` cannot be inf: it is not a finite number",
        ),
        (
            "\"source.k\", 9",
            "\"source.k\", -1.5",
            "conf::bad_value",
            "`source.k` cannot be -1.5: -1.5 is outside 0 … 10",
        ),
        (
            "\"source.reset\", 0.5",
            "\"source.reset\", -1/0",
            "text::not_finite",
            "an argument of `source.reset` cannot be -inf: it is not a finite number",
        ),
        (
            "\"sink.flag\", true",
            "\"sink.flag\", { 0/0 }",
            "text::not_finite",
            "`sink.flag` cannot be NaN: it is not a finite number",
        ),
    ];
    for (from, to, code, message) in changes {
        let text = demo.read("configurations.lua");
        let line = demo.replace("configurations.lua", from, to);
        let found = errors(&demo.run(&["check", "deployment.yaml", "--json"]).json());
        demo.write("configurations.lua", &text);
        assert!(
            found.iter().any(|f| f["code"] == code && f["message"] == message && f["line"] == line),
            "{to}: {found:#?}"
        );
    }
}

// ---- `replace` ---------------------------------------------------------------------------------------------------

/// `up` makes a `Pid` that is connected to a plant and to itself, and a log behind it; `swap` is given.
fn replaced(swap: &str) -> Demo {
    let demo = deployment(
        "ports: { in: { direction: in, type: float }, loop: { direction: in, type: float }, y: { direction: out, type: float } }\n    \
         properties: { k: { type: float, default: 1.0 } }",
        "ports: { state: { direction: in, type: float }, loop: { direction: in, type: float }, command: { direction: out, type: float },\n            \
         n: { direction: in, type: int }, y: { direction: out, type: int } }\n    \
         properties: { horizon: { type: int, default: 5, max: 50 }, rate: { type: float } }",
        "create('log', 'Pid'), connect('plant.y', 'ctrl.in', { buffer = 4 }), connect('ctrl.y', 'ctrl.loop'),
         connect('ctrl.y', 'log.in'), post_conf_state = { '_default:running' },",
        "",
        false,
    );
    demo.replace("configurations.lua", "destroy('ctrl'), create('ctrl', 'Mpc'),", swap);
    demo.replace("configurations.lua", "create('ctrl', 'Pid')", "create('ctrl', 'Pid', { activity = 'fast' })");
    demo.replace("deployment.yaml", "configurations:", "activities: { fast: { period_ms: 1.0 } }\nconfigurations:");
    demo
}

const FITS: &str = "properties = { rate = 2.0 }, map = { ['in'] = 'state', y = 'command' }";

fn planned(demo: &Demo) -> Value {
    let planned = demo.run(&["plan", "deployment.yaml", "up", "swap", "--json"]);
    assert_eq!(planned.code, 0, "{}{}", planned.out, planned.err);
    planned.json()[1].clone()
}

#[test]
fn a_replacement_is_what_is_written_by_hand() {
    let sugar = replaced(&format!("replace('ctrl', 'Mpc', {{ {FITS} }}),"));
    let ran = sugar.run(&["check", "deployment.yaml", "--json"]);
    assert!(ran.code == 0 && errors(&ran.json()).is_empty(), "{}", ran.out);
    let plan = planned(&sugar);
    let by_hand = replaced(
        "destroy('ctrl'), create('ctrl', 'Mpc', { activity = 'fast', properties = { rate = 2.0 } }),
         disconnect('ctrl.y', 'ctrl.loop'), connect('ctrl.command', 'ctrl.loop'),
         disconnect('ctrl.y', 'log.in'), connect('ctrl.command', 'log.in'),
         disconnect('plant.y', 'ctrl.in'), connect('plant.y', 'ctrl.state', { buffer = 4 }),
         post_conf_state = { 'ctrl:running' },",
    );
    assert_eq!(plan, planned(&by_hand));
    assert_eq!(plan["result"]["components"]["ctrl"]["activity"], "fast");
    // In the other language it is the same.
    let yaml = sugar.run(&["convert", "deployment.yaml", "--to", "yaml", "-o", "yaml"]);
    assert_eq!(yaml.code, 0, "{}", yaml.err);
    let text = sugar.read("yaml/configurations.yaml");
    assert!(
        text.contains(
            "- replace: { component: ctrl, type: Mpc, properties: { rate: 2.0 }, map: { in: state, \"y\": command } }"
        ),
        "{text}"
    );
    let again = sugar.run(&["plan", "yaml/swap.deployment.yaml", "up", "swap", "--json"]);
    assert_eq!(again.json()[1], plan);
}

#[test]
fn the_new_one_comes_to_the_run_state_of_the_old_one() {
    for (pre, post, wanted) in [
        ("", "", "running"),
        ("'ctrl:stopped'", "", "stopped"),
        ("'_default:stopped'", "", "stopped"),
        ("'ctrl:unconfigured'", "", "unconfigured"),
        ("'ctrl:unconfigured'", "'ctrl:stopped'", "stopped"),
        ("", "'ctrl:stopped'", "stopped"),
        ("'_default:stopped'", "'_default:running'", "running"),
        ("", "'_default:stopped'", "stopped"),
        ("", "'plant:stopped'", "running"),
    ] {
        let lists = format!("pre_conf_state = {{ {pre} }}, post_conf_state = {{ {post} }},");
        let plan = planned(&replaced(&format!("replace('ctrl', 'Mpc', {{ {FITS} }}), {lists}")));
        assert_eq!(plan["result"]["components"]["ctrl"]["state"], wanted, "{lists}");
        // It does not go further than it stays.
        let moves = plan["steps"].as_array().unwrap().iter().filter(|step| {
            step["stage"] == "post"
                && step["target"] == "ctrl"
                && ["stop", "cleanup"].iter().any(|verb| step["do"] == *verb)
        });
        assert_eq!(moves.count(), 0, "{lists}: {plan:#}");
    }
}

#[test]
fn several_are_replaced_together_and_a_disconnect_beside_ends_a_connection() {
    let both = format!(
        "replace('ctrl', 'Mpc', {{ {FITS} }}), replace('log', 'Mpc', {{ {FITS} }}), disconnect('ctrl.y', 'ctrl.loop'),"
    );
    let plan = planned(&replaced(&both));
    let links: Vec<String> = plan["result"]["connections"]
        .as_array()
        .unwrap()
        .iter()
        .map(|link| format!("{} {} {}", link["from"].as_str().unwrap(), link["to"].as_str().unwrap(), link["policy"]))
        .collect();
    assert_eq!(links, ["ctrl.command log.state \"data\"", "plant.y ctrl.state {\"buffer\":4}"]);
}

#[test]
fn what_cannot_be_replaced_is_told_where_it_is_written() {
    let one = |options: &str| format!("replace('ctrl', 'Mpc', {{ properties = {{ rate = 2.0 }}, {options} }}),");
    let cases = [
        (
            one("map = { y = 'command' }"),
            "conf::port_unmapped",
            "`ctrl.in` is connected to `plant.y`, and Mpc, which replaces ctrl, has no port `in`",
            "say what it is called there, `map = { [\"in\"] = \"…\" }` (",
        ),
        (
            one("map = { ['in'] = 'state', u = 'n', y = 'command' }"),
            "conf::unknown_port",
            "ctrl (Pid) has no port `u`",
            "known ports: `in`, `loop`, `y`",
        ),
        (
            one("map = { ['in'] = 'stat', y = 'command' }"),
            "conf::unknown_port",
            "ctrl (Mpc) has no port `stat`",
            "did you mean `state`?",
        ),
        (
            one("map = { ['in'] = 'command', y = 'command' }"),
            "conf::port_unlike",
            "`ctrl.in` cannot become `command`: that is an out-port, this one an in-port",
            "a port becomes one of the same direction",
        ),
        (
            one("map = { ['in'] = 'n', y = 'command' }"),
            "conf::port_unlike",
            "`ctrl.in` cannot become `n`: that is of type int, this one float",
            "a port becomes one of the same direction",
        ),
        (
            one("map = { ['in'] = 'state' }"),
            "conf::port_types",
            "`ctrl.y` carries int, `log.in` takes float",
            "connect ports of the same type",
        ),
        (
            "replace('ctrl', 'Mpc', { map = { ['in'] = 'state', y = 'command' } }),".to_owned(),
            "conf::missing_property",
            "`ctrl` is created without a value for `rate`, which has no default",
            "add `rate = …` (float)",
        ),
        (
            format!("replace('ctrl', 'Mpc', {{ {FITS} }}), replace('ctrl', 'Pid'),"),
            "conf::clash",
            "`replace ctrl : Mpc` and `replace ctrl : Pid` do not commute",
            "keep one of the two",
        ),
        (
            format!("replace('ctrl', 'Mcp', {{ {FITS} }}),"),
            "conf::unknown_type",
            "there is no component type `Mcp`",
            "did you mean `Mpc`?",
        ),
        (
            format!("replace('ctlr', 'Mpc', {{ {FITS} }}),"),
            "conf::unknown_component",
            "no configuration creates a component `ctlr`",
            "did you mean `ctrl`?",
        ),
    ];
    for (swap, code, message, help) in cases {
        let demo = replaced(&swap);
        let text = demo.read("configurations.lua");
        let line = text.lines().position(|line| line.contains("replace(")).unwrap() + 1;
        let found = errors(&demo.run(&["check", "deployment.yaml", "--json"]).json());
        let told = found.iter().find(|f| f["code"] == code && f["message"] == message);
        let Some(told) = told else { panic!("{swap}: {found:#?}") };
        assert!(told["help"].as_str().unwrap().contains(help), "{swap}: {told}");
        assert_eq!(told["line"], line, "{swap}: {told}");
        // The planner says the same.
        let planned = demo.run(&["plan", "deployment.yaml", "up", "swap", "--json"]);
        assert!(planned.code == 1 && planned.out.contains(code), "{swap}: {}", planned.out);
    }
}

#[test]
fn what_only_a_replacement_drives_or_connects_is_known() {
    let demo = replaced(&format!("replace('ctrl', 'Mpc', {{ {FITS} }}),"));
    demo.replace("deployment.yaml", "state: { direction: in,", "state: { direction: in, required: true,");
    demo.replace(
        "deployment.yaml",
        "configurations:",
        "faults: [{ step: \"connect plant.y -> ctrl.state\", how: fail }]\nconfigurations:",
    );
    let ran = demo.run(&["check", "deployment.yaml", "--json"]);
    let found = ran.json();
    let of = |f: &&Value| ["deploy::port_required", "simulated::unknown_step"].iter().any(|code| f["code"] == *code);
    let told: Vec<&Value> = found["findings"].as_array().unwrap().iter().filter(of).collect();
    assert!(told.is_empty(), "{told:#?}");
    // Without the map nothing connects it.
    demo.replace("configurations.lua", "['in'] = 'state'", "['in'] = 'loop'");
    let found = demo.run(&["check", "deployment.yaml", "--json"]).json();
    assert_eq!(found["findings"].as_array().unwrap().iter().filter(of).count(), 2);
}

/// What a parent has connected to a component stands when that is exchanged in its own file: it is connected to the new one, and to the old one
/// again, and is in force all the time. What was done to the new one alone is void with that.
#[test]
fn what_a_parent_has_done_stays_when_its_subsystem_exchanges_a_component() {
    for (then, left) in [
        ("undo('left/swap', { force = true })", "left/make right/make left/run right/run join"),
        ("apply('left/swap', { force = true })", "left/make right/make left/run right/run join left/swap left/swap"),
    ] {
        let demo = Demo::new();
        for file in std::fs::read_dir(format!("{}/examples/pair", env!("CARGO_MANIFEST_DIR"))).expect("the folder") {
            let file = file.expect("one of it");
            std::fs::copy(file.path(), demo.path(&file.file_name().to_string_lossy())).expect("copied");
        }
        let run = "  run = Configuration";
        demo.replace(
            "robot_configurations.lua",
            run,
            &format!("  swap = Configuration {{ replace(\"Drive\", \"Drive\") }},\n{run}"),
        );
        demo.write(
            "s.lua",
            &format!(
                "local function names() local all = {{}} for _, frame in ipairs(stack()) do all[#all + 1] = frame.configuration end
                   table.sort(all) return table.concat(all, ' ') .. ', ' .. #system().connections .. ' ' .. #drift() end
                 deploy('pair.yaml') say('before ' .. names())
                 apply('left/swap', {{ force = true }}) wait_answer('left/swap.ok', 2) say('swapped ' .. names())
                 {then} wait(1) say('then ' .. names()) shutdown()"
            ),
        );
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
        let sorted = |names: &str| {
            let mut all: Vec<&str> = names.split(' ').filter(|name| !name.is_empty()).collect();
            all.sort_unstable();
            all.join(" ")
        };
        let base = "left/make right/make left/run right/run join";
        let expected = [
            format!("before {}, 2 0", sorted(base)),
            format!("swapped {}, 2 0", sorted(&format!("{base} left/swap"))),
            format!("then {}, 2 0", sorted(left)),
        ];
        let said: Vec<&str> = ran.out.lines().filter(|line| line.contains(", ")).take(3).collect();
        assert_eq!(
            (said, ran.code),
            (expected.iter().map(String::as_str).collect(), 0),
            "{then}: {}{}",
            ran.out,
            ran.err
        );
    }
}
