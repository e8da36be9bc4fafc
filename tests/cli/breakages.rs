//! One deliberate mistake at a time in a sound deployment, and the exact finding it leads to.

use crate::demo::Demo;
use crate::tongue::strange;
use serde_json::Value;

struct Mistake {
    file: &'static str,
    from: &'static str,
    to: &'static str,
    code: &'static str,
    /// A part of the help line.
    help: &'static str,
    severity: &'static str,
}

const D: &str = "deployment.yaml";
const C: &str = "configurations.lua";
const K: &str = "coordinator.lua";

const fn error(
    file: &'static str,
    from: &'static str,
    to: &'static str,
    code: &'static str,
    help: &'static str,
) -> Mistake {
    Mistake { file, from, to, code, help, severity: "error" }
}

const fn warning(
    file: &'static str,
    from: &'static str,
    to: &'static str,
    code: &'static str,
    help: &'static str,
) -> Mistake {
    Mistake { file, from, to, code, help, severity: "warning" }
}

const MISTAKES: &[Mistake] = &[
    // Names in the deployment.
    error(D, "platform: simulated", "platform: simulatd", "deploy::unknown_platform", "`simulated`"),
    error(D, "up: operational", "up: operationel", "deploy::unknown_state", "`operational`"),
    error(D, "down: idle", "down: idel", "deploy::unknown_state", "`idle`"),
    error(D, "failed: [failed]", "failed: [faild]", "deploy::unknown_state", "`failed`"),
    error(D, "event: e_start", "event: e_strat", "deploy::event_unheard", "`e_start`"),
    error(D, "event: e_shutdown", "event: e_shutdwn", "deploy::event_unheard", "`e_shutdown`"),
    warning(D, "emits: [e_ready]", "emits: [e_ready, e_redy]", "coord::never_emitted", "`e_ready`"),
    error(D, "emits: [e_ready]", "emits: [e_redy]", "coord::unknown_request", "`e_redy`"),
    error(D, "  control: {", "  contrl: {", "conf::unknown_activity", "`contrl`"),
    error(D, "direction: out, type: int", "direction: out, typ: int", "text::unknown_key", "`type`"),
    // Names in configurations.
    error(C, "\"Source\"", "\"Sorce\"", "conf::unknown_type", "`Source`"),
    error(C, "connect(\"source.y\"", "connect(\"sorce.y\"", "conf::unknown_component", "`source`"),
    error(C, "\"source.y\"", "\"source.z\"", "conf::unknown_port", "`y`"),
    error(C, "\"sink.u\"", "\"sink.limits\"", "conf::unknown_port", "property"),
    error(C, "property_set(\"source.k\"", "property_set(\"source.kk\"", "conf::unknown_property", "`k`"),
    error(C, "k = 2.0", "kay = 2.0", "conf::unknown_property", "`k`"),
    error(C, "source.reset", "source.rest", "conf::unknown_operation", "`reset`"),
    error(C, "\"sink:running\"", "\"snk:running\"", "conf::unknown_component", "`sink`"),
    error(C, "create(\"sink\"", "creat(\"sink\"", "lua::undefined", "`create`"),
    // Values, types, units, limits.
    error(C, "k = 2.0", "k = \"two\"", "conf::bad_value", "float"),
    error(C, "k = 2.0", "k = 20.0", "conf::bad_value", "float"),
    error(C, "name = \"first\", ", "", "conf::missing_property", "`name"),
    error(C, "port_write(\"sink.flag\", false)", "port_write(\"sink.flag\", 1)", "conf::bad_value", "bool"),
    error(C, "\"sink.u\"", "\"sink.w\"", "conf::port_units", "unit"),
    error(C, "connect(\"source.y\"", "connect(\"source.n\"", "conf::port_types", "same type"),
    error(
        C,
        "connect(\"source.y\", \"sink.u\")",
        "connect(\"sink.u\", \"source.y\")",
        "conf::not_an_out_port",
        "wrong way",
    ),
    error(
        C,
        "connect(\"source.y\", \"sink.u\")",
        "connect(\"source.y\", \"source.queue\")",
        "conf::needs_buffer",
        "buffer",
    ),
    error(
        C,
        "port_write(\"sink.flag\", false)",
        "port_write(\"source.queue\", 1.0)",
        "conf::port_not_writable",
        "connect",
    ),
    error(
        C,
        "operation_call(\"source.reset\", 0.5)",
        "operation_call(\"source.reset\")",
        "conf::bad_arguments",
        "(float)",
    ),
    // What does not fit the system it meets.
    error(
        C,
        "    connect(\"source.y\", \"sink.u\"),",
        "    connect(\"source.y\", \"sink.u\"), connect(\"source.y\", \"sink.u\", { buffer = 4 }),",
        "conf::clash",
        "",
    ),
    error(C, "port_write(\"sink.flag\", false)", "port_write(\"sink.u\", 1.0)", "conf::port_driven", ""),
    error(C, "property_set(\"source.k\", 1.0)", "property_set(\"source.mode\", 1)", "conf::not_tunable", ""),
    error(
        C,
        "property_set(\"source.name\", \"second\")",
        "property_set(\"source.k\", 1.0), property_set(\"source.k\", 2.0)",
        "conf::clash",
        "",
    ),
    error(C, "    connect(\"source.y\", \"sink.u\"),\n", "    destroy(\"source\"),\n", "deploy::never_up", ""),
    // Names in the coordinator.
    error(K, "tgt = \"wiring\"", "tgt = \"wirring\"", "chart::unknown_state", ""),
    error(K, "entry = \"create_all\"", "entry = \"creat_all\"", "coord::unknown_request", "`create_all`"),
    error(K, "config = \"slow\"", "config = \"slwo\"", "coord::unknown_request", "`slow`"),
    error(K, "\"create_all.ok\"", "\"creat_all.ok\"", "coord::unknown_answer", "`create_all.ok`"),
    error(K, "\"create_all.ok\"", "\"create_all.okay\"", "coord::unknown_answer", "`create_all.ok`"),
    error(
        K,
        "\"connect_all.failed\", ",
        "\"connect_all.failed\", \"connect_all.udno.failed\", ",
        "coord::unknown_answer",
        "`connect_all.undo.failed`",
    ),
    warning(K, "\"create_all.ok\"", "\"create_all.ok\", \"rename.ok\"", "coord::answer_never_comes", "`rename`"),
    warning(K, "\"e_shutdown\"", "\"e_shutdwon\"", "coord::near_event", "`e_shutdown`"),
    // What the coordinator does.
    warning(K, "\"connect_all.failed\", ", "", "coord::failure_unhandled", "connect_all.failed"),
    error(K, "events = { \"connect_all.ok\" }", "events = { \"connect_all.cancelled\" }", "deploy::never_up", ""),
    error(K, "tgt = \"removing\"", "tgt = \"stopping\"", "deploy::never_down", ""),
    error(
        K,
        "events = { \"connect_all.undone\" } },\n  },",
        "events = { \"connect_all.undone\" } },\n    trans { src = \"unwiring\", tgt = \"root.idle\", events = { \"connect_all.undone\" }, pn = 1 },\n  },",
        "deploy::leftovers",
        "",
    ),
    warning(
        K,
        "trans { src = \"failed\", tgt = \"leaving\", events = { \"e_shutdown\" } },",
        "",
        "coord::stuck",
        "`e_shutdown`",
    ),
];

#[test]
fn the_demo_is_sound() {
    let demo = Demo::new();
    let ran = demo.run(&["check", "deployment.yaml", "--json"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    let json = ran.json();
    let findings = json["findings"].as_array().unwrap();
    assert!(findings.iter().all(|f| f["severity"] == "info"), "{findings:#?}");
    assert_eq!(json["explored"]["complete"], true);
    assert!(json["explored"]["states"].as_u64().unwrap() > 20);
}

#[test]
fn what_reading_found_stands_among_what_was_followed_by_what_it_is_worth() {
    let demo = Demo::new();
    demo.replace("deployment.yaml", "types:\n", "parameters: { unread: { type: float, default: 1.0 } }\ntypes:\n");
    // The demo has notes.
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let found: Vec<&str> = json["findings"].as_array().unwrap().iter().filter_map(|f| f["severity"].as_str()).collect();
    assert!(found.first() == Some(&"warning") && found.contains(&"info"), "{json:#}");
    let shown = demo.run(&["check", "deployment.yaml"]).err;
    assert!(shown.contains("⚠ no Lua file reads the parameter `unread`"), "{shown}");
}

#[test]
fn every_mistake_is_found_where_it_is() {
    let mut wrong = Vec::new();
    for mistake in MISTAKES {
        let demo = Demo::new();
        let line = demo.replace(mistake.file, mistake.from, mistake.to);
        let ran = demo.run(&["check", "deployment.yaml", "--json"]);
        let json = ran.json();
        let findings = json["findings"].as_array().cloned().unwrap_or_default();
        let codes: Vec<String> = findings.iter().map(|f| f["code"].as_str().unwrap_or("").to_owned()).collect();
        let name = format!("{} -> {} in {}", mistake.from, mistake.to, mistake.file);
        let of_code = |f: &&Value| f["code"] == mistake.code && f["severity"] == mistake.severity;
        let Some(finding) = findings.iter().find(of_code) else {
            wrong.push(format!("{name}: no {} {}, but {codes:?}", mistake.severity, mistake.code));
            continue;
        };
        let help = finding["help"].as_str().unwrap_or("");
        if help.is_empty() || !help.contains(mistake.help) {
            wrong.push(format!("{name}: the help does not say `{}`: {help}", mistake.help));
        }
        let expected = if mistake.severity == "error" { 1 } else { 0 };
        if ran.code != expected && mistake.code != "text::unknown_key" && mistake.code != "lua::undefined" {
            wrong.push(format!("{name}: exit status {} instead of {expected}", ran.code));
        }
        // Findings about names stand at the name itself.
        let at_the_name = mistake.code.contains("unknown") && mistake.file != D;
        if at_the_name && (finding["line"] != line || !finding["file"].as_str().unwrap_or("").ends_with(mistake.file)) {
            wrong
                .push(format!("{name}: at {}:{} instead of {}:{line}", finding["file"], finding["line"], mistake.file));
        }
    }
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), MISTAKES.len(), wrong.join("\n"));
}

/// What helps is written as the file is that it is about: each mistake in Lua, and where it can be read, in YAML.
#[test]
fn findings_speak_the_language_of_their_file() {
    let (mut wrong, mut in_yaml) = (Vec::new(), 0);
    let more = [
        error(C, "    connect(\"source.y\", \"sink.u\"),", "    disconnect(\"source.y\", \"sink.u\"),", "", ""),
        error(C, "create(\"sink\", \"Sink\"", "create(\"source2\", \"Sink\"", "", ""),
        error(
            C,
            "    connect(\"source.y\", \"sink.u\"),\n",
            "    destroy(\"source\"), connect(\"source.y\", \"sink.u\"),\n",
            "",
            "",
        ),
        error(C, "property_set(\"source.name\", \"second\")", "destroy(\"source\")", "", ""),
        error(C, "property_set(\"source.k\", 1.0)", "connect(\"source.y\", \"sink.u\")", "", ""),
        error(C, "property_set(\"source.k\", 1.0)", "operation_call(\"source.burn\")", "", ""),
        error(C, "property_set(\"source.k\", 1.0)", "replace(\"source\", \"Sink\")", "", ""),
        error(K, "trans { src = \"initial\", tgt = \"idle\" },", "", "", ""),
        error(K, "trans { src = \"initial\", tgt = \"idle\" },", "trans { tgt = \"idle\" },", "", ""),
        error(K, "trans { src = \"initial\",  tgt = \"creating\" },", "", "", ""),
        error(D, "direction: in, type: bool", "direction: in, type: bool, required: true", "", ""),
    ];
    for mistake in MISTAKES.iter().chain(&more).filter(|mistake| mistake.code != "lua::undefined") {
        let demo = Demo::new();
        if mistake.to.contains("required") {
            demo.replace(C, "port_write(\"sink.flag\", false),", "");
            demo.replace(C, "port_write(\"sink.flag\", true),", "");
        }
        demo.replace(mistake.file, mistake.from, mistake.to);
        let findings = |path: &str| demo.run(&["check", path, "--json", "--notes"]).json()["findings"].clone();
        // What the deployment says of files in Lua is in Lua.
        let strange_in_lua = strange(&findings(D)).into_iter().filter(|text| !text.contains(&format!(" at {D}: ")));
        wrong.extend(strange_in_lua.map(|text| format!("{}: {text}", mistake.to)));
        let converted = demo.run(&["convert", D, "--to", "yaml", "-o", "yaml"]);
        if converted.code == 0 {
            in_yaml += 1;
            let found = findings("yaml/demo.deployment.yaml");
            assert!(found.as_array().is_some_and(|found| !found.is_empty()), "{}", mistake.to);
            wrong.extend(strange(&found).into_iter().map(|text| format!("{}: {text}", mistake.to)));
        }
    }
    wrong.sort();
    wrong.dedup();
    assert!(wrong.is_empty(), "{}:\n{}", wrong.len(), wrong.join("\n"));
    assert!(in_yaml > 30, "{in_yaml}");
}

#[test]
fn a_refused_request_comes_with_the_shortest_way_to_it() {
    let demo = Demo::new();
    demo.replace("configurations.lua", "port_write(\"sink.flag\", false)", "port_write(\"sink.u\", 1.0)");
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let trace: Vec<&str> = json["trace"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert_eq!(trace.first(), Some(&"start → root.idle"));
    assert!(trace.contains(&"e_start → root.deploying.creating"), "{trace:?}");
    assert!(trace.len() <= 6, "{trace:?}");
}

#[test]
fn a_missing_library_and_a_missing_file_are_named() {
    let demo = Demo::new();
    demo.replace("deployment.yaml", "types:\n", "libraries: [youbt]\ntypes:\n");
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    assert_eq!(json["findings"][0]["code"], "deploy::unknown_library");
    let help = json["findings"][0]["help"].as_str().unwrap();
    assert!(help.contains("`youbot`") && help.contains("a program of one's own"), "{help}");
    let demo = Demo::new();
    let line = demo.replace("deployment.yaml", "[configurations.lua]", "[configuration.lua]");
    let ran = demo.run(&["check", "deployment.yaml", "--json"]);
    assert_eq!(ran.code, 2);
    assert_eq!(ran.json()["findings"][0]["code"], "text::no_file");
    assert_eq!(ran.json()["findings"][0]["line"], line);
}

#[test]
fn of_a_file_that_is_not_there_it_is_said_which_are() {
    let demo = Demo::new();
    let help = |args: &[&str]| demo.run(args).json()["findings"][0]["help"].as_str().unwrap_or_default().to_owned();
    assert_eq!(help(&["check", "deploymnt.yaml", "--json"]), "did you mean `deployment.yaml`?");
    std::fs::create_dir_all(demo.path("empty")).unwrap();
    demo.write("empty/notes.txt", "");
    let none = "no file in the folder empty is Lua, YAML or SCXML by its name";
    assert_eq!(help(&["check", "empty/nope.yaml", "--json"]), none);
    std::fs::create_dir_all(demo.path("empty/deployments")).unwrap();
    demo.write("empty/deployments/arm.yaml", "");
    let below = "in the folder empty/deployments: known files: `arm.yaml`";
    assert_eq!(help(&["check", "empty/nope.yaml", "--json"]), below);
    assert_eq!(
        help(&["check", "empty/deployments", "--json"]),
        "name a file in it, such as `empty/deployments/arm.yaml`"
    );
    // A file of another kind is told so by every command.
    let drawn = demo.run(&["graph", "configurations.lua"]);
    assert!(
        drawn.err.contains("this is read as a coordinator") && drawn.err.contains("deployments/NAME.yaml"),
        "{}",
        drawn.err
    );
    assert_eq!(help(&["check", "empty/none/nope.yaml", "--json"]), "there is no folder empty/none either");
}
