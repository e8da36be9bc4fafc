//! What a deployment declares about itself: names that do not exist are told, and what is declared is shown.

use crate::demo::Demo;
use serde_json::json;

/// The demo with something declared in every place.
fn declared() -> Demo {
    let demo = Demo::new();
    demo.replace(
        "deployment.yaml",
        "      burn: { args: [] }\n",
        "      burn: { args: [], moves: true, settled_by: { above: [self.y, 0.5] } }\n    moves: [start]\n",
    );
    demo.replace(
        "deployment.yaml",
        "deploy:   {",
        "safety: [e_fast]\noperator: [rename, source.k, sink.flag]\n\
         faults: [{ step: property_set source.k, how: fail, times: 2 }]\ndeploy:   {",
    );
    demo.replace("deployment.yaml", "down: idle,      within_s: 5", "down: idle, within_s: 5, rest: [slow]");
    demo.replace(
        "configurations.lua",
        "fast = Configuration { group = \"speed\",",
        "fast = Configuration { group = \"speed\", on_failure = \"rollback\", holds = above(\"source.y\", 1.0),",
    );
    demo
}

/// Code, message with help, and line of the first finding that is no note.
fn found(demo: &Demo) -> Option<(String, String, u64)> {
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let first = json["findings"].as_array().unwrap().iter().find(|f| f["severity"] != "info")?.clone();
    let text = |key: &str| first[key].as_str().unwrap_or_default().to_owned();
    Some((text("code"), text("message") + "; " + &text("help"), first["line"].as_u64().unwrap_or_default()))
}

#[test]
fn names_are_checked() {
    // All names are right; that the simulated platform shows no values, and that nobody hears what is lost, are other
    // matters. An operator who may rename what the coordinator holds does not get in its way when it leads down.
    let (code, ..) = found(&declared()).expect("a warning");
    assert_eq!(code, "conf::holds_unseen");
    let demo = declared();
    demo.replace("configurations.lua", "above(\"source.y\", 1.0)", "in_state(\"source\", \"running\")");
    assert_eq!(found(&demo).map(|(code, ..)| code).as_deref(), Some("coord::lost_unheard"));
    for (file, from, to, code, said, line) in [
        ("deployment.yaml", "[rename,", "[renam,", "deploy::unknown_configuration", "did you mean `rename`", 31),
        ("deployment.yaml", "source.k, sink", "sorce.k, sink", "conf::unknown_component", "did you mean `source`", 31),
        ("deployment.yaml", "source.k, sink", "source.kk, sink", "conf::unknown_property", "did you mean `k`", 31),
        ("deployment.yaml", "source.k, sink", "source.y, sink", "conf::not_an_in_port", "out-port", 31),
        ("deployment.yaml", "rest: [slow]", "rest: [solw]", "deploy::unknown_configuration", "did you mean `slow`", 34),
        ("deployment.yaml", "property_set source.k,", "property_set source.kk,", "conf::unknown_property", "`k`", 32),
        (
            "deployment.yaml",
            "property_set source.k,",
            "set source.k,",
            "simulated::unknown_step",
            "did you mean `property_set`",
            32,
        ),
        ("deployment.yaml", "[self.y, 0.5]", "[self.yy, 0.5]", "conf::unknown_port", "did you mean `y`", 16),
        ("deployment.yaml", "[self.y, 0.5]", "[source.y, 0.5]", "type::settled_elsewhere", "`self`", 16),
        ("deployment.yaml", "{ above: [self.y, 0.5] }", "{ is_true: self.y.z }", "monitor::no_such_part", "fields", 16),
        (
            "deployment.yaml",
            "[self.y, 0.5]",
            "[{ activity: [control, overruns] }, 0.5]",
            "type::settled_elsewhere",
            "activity",
            16,
        ),
        (
            "deployment.yaml",
            "    moves: [start]\n",
            "    moves: [start]\n    start_after: [Sink, Snik]\n",
            "type::unknown_type",
            "did you mean `Sink`",
            18,
        ),
        (
            "deployment.yaml",
            "    moves: [start]\n",
            "    moves: [start]\n    stop_before: Snik\n",
            "type::unknown_type",
            "did you mean `Sink`",
            18,
        ),
        (
            "deployment.yaml",
            "    moves: [start]\n  Sink:\n",
            "    moves: [start]\n    start_after: [Sink]\n  Sink:\n    start_after: [Source]\n",
            "type::circle",
            "start_after leads round in a circle: Source → Sink → Source",
            18,
        ),
        ("configurations.lua", "\"source.y\", 1.0", "\"sorce.y\", 1.0", "conf::unknown_component", "`source`", 16),
        ("configurations.lua", "\"source.y\", 1.0", "\"source.yy\", 1.0", "conf::unknown_port", "`y`", 16),
    ] {
        let demo = declared();
        demo.replace(file, from, to);
        let (got, text, at) = found(&demo).unwrap_or_else(|| panic!("{to}: nothing is found"));
        assert_eq!((got.as_str(), at), (code, line), "{to}: {text}");
        assert!(text.contains(said), "{to}: {text}");
    }
}

#[test]
fn faults_of_another_platform_are_a_note() {
    let demo = declared();
    demo.replace("deployment.yaml", "platform: simulated", "platform: embedded");
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let note = json["findings"].as_array().unwrap().iter().find(|f| f["code"] == "simulated::not_used").cloned();
    assert_eq!(note.expect("a note")["severity"], "info", "{json:#}");
}

#[test]
fn a_plan_refuses_what_stands_for_nothing() {
    let demo = declared();
    demo.replace("configurations.lua", "\"source.y\", 1.0", "\"sorce.y\", 1.0");
    let all = ["create_all", "connect_all", "start_all", "fast"];
    let ran = demo.run(&[&["plan", "deployment.yaml", "--json"], &all[..]].concat());
    assert_eq!((ran.code, ran.json()["findings"][0]["code"].as_str()), (1, Some("conf::unknown_component")));
    assert_eq!(demo.run(&[&["plan", "deployment.yaml"], &all[..3]].concat()).code, 0, "it is not asked for");
}

#[test]
fn what_moves_and_what_settles_is_shown() {
    let demo = declared();
    demo.replace(
        "configurations.lua",
        "operation_call(\"source.reset\", 0.5)",
        "operation_call(\"source.reset\", 0.5):undo(\"source.burn\")",
    );
    let ids = ["create_all", "connect_all", "start_all", "fast"];
    let plans = demo.run(&[&["plan", "deployment.yaml", "--json"], &ids[..]].concat()).json();
    let flags = |plan: &serde_json::Value, verb: &str, target: &str| {
        let steps = plan["steps"].as_array().unwrap();
        let step = steps.iter().find(|s| s["do"] == verb && s["target"] == target).unwrap();
        [step["moves"].clone(), step["undo"]["moves"].clone()]
    };
    assert_eq!(flags(&plans[2], "start", "source"), [json!(true), json!(false)]);
    assert_eq!(flags(&plans[2], "start", "sink"), [json!(false), json!(false)]);
    assert_eq!(flags(&plans[3], "operation_call", "source.reset"), [json!(false), json!(true)]);
    let text = demo.run(&[&["plan", "deployment.yaml"], &ids[..]].concat()).out;
    assert!(text.contains("exact, moves") && text.contains("source.burn() (moves)"), "{text}");
    let ty = demo.run(&["types", "deployment.yaml", "Source"]).out;
    assert!(ty.contains("`start` moves hardware"), "{ty}");
    assert!(ty.contains("irreversible, moves hardware, settled by above(\"self.y\", 0.5)"), "{ty}");
    let ty = demo.run(&["types", "deployment.yaml", "Source", "--json"]).json();
    assert_eq!(ty["moves"], json!({ "start": true, "stop": false }));
    assert_eq!(ty["operations"]["burn"]["moves"], true);
    assert_eq!(ty["operations"]["burn"]["settled_by"], "above(\"self.y\", 0.5)");
}

#[test]
fn the_shipped_arms_say_what_moves() {
    let demo = Demo::new();
    let file = |name: &str| format!("{}/deployments/{name}", env!("CARGO_MANIFEST_DIR"));
    for (deployment, moving) in [
        ("youbot_arm.yaml", &["youbot.start_calibration", "youbot.unfold"][..]),
        ("generic_arm.yaml", &["arm.home", "arm.raise"]),
    ] {
        let plans = demo.run(&["plan", &file(deployment), "--bringup", "--json"]).json();
        let steps: Vec<_> = plans.as_array().unwrap().iter().flat_map(|p| p["steps"].as_array().unwrap()).collect();
        let moves: Vec<&str> =
            steps.iter().filter(|s| s["moves"] == true).map(|s| s["target"].as_str().unwrap()).collect();
        assert_eq!(moves, moving, "{deployment}");
        let back: Vec<&str> = steps
            .iter()
            .filter(|s| s["undo"]["moves"] == true)
            .map(|s| s["undo"]["target"].as_str().unwrap())
            .collect();
        let fold = if deployment.starts_with("youbot") { "youbot.fold" } else { "arm.lower" };
        assert_eq!(back, [fold], "{deployment}");
    }
}

/// The type `standard.Gain`, declared as the library has it.
const GAIN: &str = "types:
  standard.Gain:
    ports:
      u: { direction: in, type: float }
      y: { direction: out, type: float }
    properties:
      k: { type: float, default: 1.0 }
";

/// The differences that are found where `from` is `to` in that declaration: severity, message, line.
fn differences(platform: &str, from: &str, to: &str) -> Vec<(String, String, u64)> {
    let demo = Demo::new();
    let declared = GAIN.replacen(from, to, 1);
    assert!(from.is_empty() || declared != GAIN, "{from}");
    demo.write(
        "deployment.yaml",
        &format!(
            "davit: 1\nname: demo\nplatform: {platform}\nlibraries: [standard]\n{declared}\
             configurations: [configurations.lua]\ncoordinator: coordinator.lua\n\
             deploy: {{ event: e_start, up: up, within_s: 5 }}\nshutdown: {{ event: e_stop, down: idle, within_s: 5 }}\n"
        ),
    );
    demo.write("configurations.lua", "ConfiguratorConf { a = Configuration { create('g', 'standard.Gain') } }");
    let coordinator =
        "return state { idle = state {}, up = state { config = 'a' }, trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'up', events = { 'e_start' } },
        trans { src = 'up', tgt = 'idle', events = { 'e_stop', 'a.failed', 'a.broken' } } }";
    demo.write("coordinator.lua", coordinator);
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let all = json["findings"].as_array().unwrap().iter();
    let rest = all.clone().find(|f| f["code"] != "type::differs" && f["severity"] == "error");
    assert!(rest.is_none(), "{to}: {rest:#?}");
    let text = |f: &serde_json::Value, key: &str| f[key].as_str().unwrap_or_default().to_owned();
    all.filter(|f| f["code"] == "type::differs")
        .map(|f| (text(f, "severity"), text(f, "message"), f["line"].as_u64().unwrap()))
        .collect()
}

#[test]
fn a_declaration_is_held_against_the_library_that_has_the_type() {
    for platform in ["embedded", "simulated"] {
        assert_eq!(differences(platform, "", ""), [], "what is the same is no difference");
    }
    let k = "k: { type: float, default: 1.0 }";
    for (from, to, severity, message, line) in [
        (
            "u: { direction: in, type: float }",
            "v: { direction: in, type: float }",
            "error",
            "the library's `standard.Gain` has no port `v`",
            8,
        ),
        (
            "      u: { direction: in, type: float }\n",
            "",
            "warning",
            "the library's `standard.Gain` has a port `u` that is not declared",
            6,
        ),
        (
            "direction: in, type: float",
            "direction: out, type: float",
            "error",
            "`standard.Gain.u`: the direction is declared as out, the library has in",
            8,
        ),
        (
            "direction: in, type: float",
            "direction: in, type: int",
            "error",
            "`standard.Gain.u`: the type is declared as int, the library has float",
            8,
        ),
        (
            "direction: in, type: float",
            "direction: in, type: float, unit: N",
            "warning",
            "`standard.Gain.u`: the unit is declared as `N`, the library has none",
            8,
        ),
        (
            "direction: in, type: float",
            "direction: in, type: float, buffered: true",
            "error",
            "`standard.Gain.u`: buffered is declared as true, the library has false",
            8,
        ),
        (
            "direction: in, type: float",
            "direction: in, type: float, required: true",
            "warning",
            "`standard.Gain.u`: required is declared as true, the library has false",
            8,
        ),
        (
            k,
            "k: { type: float, default: 2.0 }",
            "warning",
            "`standard.Gain.k`: the default is declared as 2.0, the library has 1.0",
            11,
        ),
        (
            k,
            "k: { type: float }",
            "warning",
            "`standard.Gain.k`: the default is declared as none, the library has 1.0",
            11,
        ),
        (
            k,
            "k: { type: float, default: 1.0, max: 5.0 }",
            "warning",
            "`standard.Gain.k`: max is declared as 5, the library has none",
            11,
        ),
        (
            k,
            "k: { type: float, default: 1.0, tunable: stopped }",
            "warning",
            "`standard.Gain.k`: tunable is declared as stopped, the library has always",
            11,
        ),
        (
            "    properties:",
            "    operations: { zero: {} }\n    properties:",
            "error",
            "the library's `standard.Gain` has no operation `zero`",
            10,
        ),
        (
            "    ports:",
            "    moves: [start]\n    ports:",
            "warning",
            "`standard.Gain`: moves is declared as start, the library has none",
            6,
        ),
        (
            "    ports:",
            "    actuator: true\n    ports:",
            "warning",
            "`standard.Gain`: actuator is declared as true, the library has false",
            6,
        ),
        (
            "    ports:",
            "    start_after: [standard.Sine]\n    ports:",
            "warning",
            "`standard.Gain`: start_after is declared as standard.Sine, the library has none",
            6,
        ),
        (
            "    ports:",
            "    raises: [e_loud]\n    ports:",
            "warning",
            "`standard.Gain`: raises is declared as e_loud, the library has none",
            6,
        ),
    ] {
        let found = differences("embedded", from, to);
        let wanted = (severity.to_owned(), message.to_owned(), line);
        assert!(found.contains(&wanted), "{to}: {found:#?}");
    }
}
