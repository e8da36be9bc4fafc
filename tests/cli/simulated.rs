//! What a deployment says that simulated components raise by themselves.

use crate::demo::Demo;

fn with(reaction: &str) -> Demo {
    let demo = Demo::new();
    demo.replace(
        "deployment.yaml",
        "deploy:   {",
        &format!("simulated:\n  reactions:\n    - {reaction}\ndeploy:   {{"),
    );
    demo
}

const SOUND: &str = "{ after: start source, delay_s: 0.5, raise: e_fast, component: source }";

#[test]
fn the_coordinator_meets_what_it_waits_for() {
    let script = "deploy('deployment.yaml')
        wait_state('slow_mode', 0.1)
        wait_state('fast_mode', 5)
        shutdown()";
    let demo = with(SOUND);
    demo.write("script.lua", script);
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    let demo = Demo::new();
    demo.write("script.lua", script);
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 1, "nobody raises it there: {}{}", ran.out, ran.err);
    assert!(ran.err.contains("fast_mode"), "{}", ran.err);
}

/// The first finding of `check`: code, help, line; none if there is no error or warning.
fn found(reaction: &str) -> Option<(String, String, u64)> {
    let demo = with(reaction);
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let findings = json["findings"].as_array().unwrap();
    let first = findings.iter().find(|f| f["severity"] != "info")?;
    let text = |key: &str| first[key].as_str().unwrap_or_default().to_owned();
    Some((text("code"), text("help"), first["line"].as_u64().unwrap_or_default()))
}

#[test]
fn names_are_checked() {
    for after in [
        "start",
        "create source",
        "connect source.y -> sink.u",
        "connect source.y ->",
        "connect source.y -> sink.u (data)",
        "disconnect source.y -> sink.u",
        "property_set source.k = 2.0",
        "create source : Source",
        "property_set source.k",
        "operation_call source.reset(0.5)",
        "port_write sink.flag",
    ] {
        assert_eq!(found(&SOUND.replace("start source", &format!("\"{after}\""))), None, "{after}");
    }
    for (from, to, code, help) in [
        ("start source", "strat source", "simulated::unknown_step", "did you mean `start`"),
        ("start source", "\"\"", "simulated::unknown_step", "known steps"),
        ("start source", "start sorce", "conf::unknown_component", "did you mean `source`"),
        ("start source", "start 17", "simulated::unknown_step", "start radio"),
        ("start source", "property_set source", "simulated::unknown_step", "radio.channel"),
        ("start source", "property_set source.kk", "conf::unknown_property", "`k`"),
        ("start source", "operation_call source.rest(1.0)", "conf::unknown_operation", "`reset`"),
        ("start source", "port_write sink.flga", "conf::unknown_port", "`flag`"),
        ("start source", "start source now", "simulated::unknown_step", "such as `start source`"),
        ("start source", "\"create source: Source\"", "simulated::unknown_step", "such as"),
        ("start source", "connect source.y -> snik.u", "conf::unknown_component", "did you mean `sink`"),
        ("start source", "connect source.y -> sink.uu", "conf::unknown_port", "`u`"),
        ("start source", "disconnect source.y -> sink", "simulated::unknown_step", "such as"),
        ("start source", "connect source.y sink.u", "simulated::unknown_step", "connect radio.out -> arm.in"),
        ("start source", "connect source.y -> sink.u data", "simulated::unknown_step", "connect radio.out -> arm.in"),
        ("component: source", "component: sorce", "conf::unknown_component", "did you mean `source`"),
        ("raise: e_fast", "raise: e_fats", "simulated::unheard", "did you mean `e_fast`"),
        ("delay_s: 0.5", "delay_s: -1", "text::bad_time", ""),
        ("delay_s: 0.5", "delay: 1", "text::unknown_key", "`delay_s`"),
        (", component: source", "", "text::missing_key", "component: radio"),
    ] {
        let (got, said, line) = found(&SOUND.replace(from, to)).unwrap_or_else(|| panic!("{to}: nothing is found"));
        assert_eq!(got, code, "{to}");
        assert!(said.contains(help), "{to}: {said}");
        assert_eq!(line, 31, "{to}");
    }
    let demo = with(SOUND);
    demo.replace("deployment.yaml", "platform: simulated", "platform: embedded");
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let codes: Vec<&str> = json["findings"].as_array().unwrap().iter().map(|f| f["code"].as_str().unwrap()).collect();
    assert!(codes.contains(&"simulated::not_used"), "{codes:?}");
}

/// Everything is answered at once there, so time would stand still for ever: the deadline comes all the same.
#[test]
fn who_goes_round_for_ever_does_not_stop_simulated_time() {
    let demo = Demo::new();
    demo.write("configurations.lua", "ConfiguratorConf { x = Configuration { create(\"sink\", \"Sink\") } }");
    demo.write(
        "coordinator.lua",
        "return state {
          a = state { entry = \"x\" }, b = state { entry = \"x.undo\" }, on = state {}, idle = state {},
          down = state { entry = \"x.undo\" },
          trans { src = \"initial\", tgt = \"a\" },
          trans { src = \"a\", tgt = \"b\", events = { \"x.ok\", \"x.failed\", \"x.broken\" } },
          trans { src = \"b\", tgt = \"a\", events = { \"x.undone\", \"x.undo.failed\", \"x.undo.broken\" } },
          trans { src = \"b\", tgt = \"on\", events = { \"e_start\" } },
          trans { src = \"on\", tgt = \"down\", events = { \"e_shutdown\" } },
          trans { src = \"down\", tgt = \"idle\", events = { \"x.undone\", \"x.undo.failed\", \"x.undo.broken\" } },
        }",
    );
    demo.replace("deployment.yaml", "emits: [e_ready]\n", "");
    demo.replace("deployment.yaml", "up: operational, failed: [failed], within_s: 5", "up: on, within_s: 0.2");
    demo.write("script.lua", "deploy('deployment.yaml')");
    let ran = demo.run(&["run", "script.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 4, "nor does it come down by itself: {}", ran.err);
    assert!(ran.err.contains("not up after 0.2 s"), "{}", ran.err);
}
