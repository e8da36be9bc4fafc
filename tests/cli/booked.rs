//! What is told of requests that are carried out together, and faults that stand in the deployment: on the product, with the
//! coordinator in the loop.

use crate::demo::Demo;
use serde_json::Value;

const DEPLOYMENT: &str = "davit: 1
name: small
platform: simulated
types:
  Drive:
    properties: { gain: { type: float, default: 1.0 }, mode: { type: int, default: 0, tunable: stopped } }
    operations:
      open: { effect: { undo: close } }
      close: { effect: { undo: open } }
configurations: [conf.lua]
coordinator: coordinator.lua
limits: { step_timeout_s: 0.5 }
deploy:   { event: e_start, up: up, within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";

const CONFIGURATIONS: &str = r#"ConfiguratorConf {
  base   = Configuration { create("a", "Drive"), create("b", "Drive") },
  manual = Configuration { property_set("a.gain", 3.0), property_set("b.gain", 4.0), post_conf_state = { "a:running" } },
  auto   = Configuration { property_set("a.gain", 5.0), property_set("b.mode", 2), post_conf_state = { "b:stopped" } },
  opened = Configuration { operation_call("a.open"), property_set("b.gain", 7.0) },
}
"#;

const COORDINATOR: &str = r#"return state {
  idle = state {}, building = state { entry = "base" }, leaving = state { entry = "base.undo" }, stuck = state {},
  up = state {
    rest = state {}, manual = state { config = "manual" }, auto = state { config = "auto" },
    opened = state { config = "opened" }, failed = state {},
    trans { src = "initial", tgt = "rest" },
    trans { src = "rest", tgt = "manual", events = { "e_manual" } },
    trans { src = "rest", tgt = "opened", events = { "e_open" } },
    trans { src = "manual", tgt = "auto", events = { "e_auto" } },
    trans { src = "opened", tgt = "auto", events = { "e_auto" } },
    trans { src = "auto", tgt = "manual", events = { "e_manual" } },
    trans { src = "manual", tgt = "failed", events = { "manual.failed", "manual.broken", "manual.lost" } },
    trans { src = "opened", tgt = "failed", events = { "opened.failed", "opened.broken", "opened.lost" } },
    trans { src = "auto", tgt = "failed", events = { "auto.failed", "auto.broken", "auto.lost" } },
  },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "building", events = { "e_start" } },
  trans { src = "building", tgt = "up", events = { "base.ok" } },
  trans { src = "building", tgt = "leaving", events = { "base.failed", "base.broken", "e_shutdown" } },
  trans { src = "up", tgt = "leaving", events = { "e_shutdown" } },
  trans { src = "leaving", tgt = "idle", events = { "base.undone" } },
  trans { src = "leaving", tgt = "stuck", events = { "base.undo.failed", "base.undo.broken" } },
  trans { src = "stuck", tgt = "leaving", events = { "e_shutdown" } },
}
"#;

/// The answers that a script leads to, each with its steps.
fn answers(faults: &str, script: &str) -> Vec<(String, Vec<String>)> {
    let demo = Demo::new();
    demo.write("small.yaml", &format!("{DEPLOYMENT}{faults}"));
    demo.write("conf.lua", CONFIGURATIONS);
    demo.write("coordinator.lua", COORDINATOR);
    demo.write(
        "story.lua",
        &format!("deploy('small.yaml', {{ replay = true }}) raise('e_start') wait(0.1)\n{script}\nshutdown()"),
    );
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--json"]);
    let left = ran.err.contains("left something behind");
    assert!(left || !ran.err.contains("davit::script"), "{}{}", ran.out, ran.err);
    let lines = ran.out.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let told = lines.filter(|line| line["what"] == "answered" || line["what"] == "lost").map(|line| {
        let name = line["answer"].as_str().or(line["event"].as_str()).expect("a name").to_owned();
        let steps = line["steps"].as_array().cloned().unwrap_or_default();
        (name, steps.iter().map(|step| step["step"].as_str().expect("a step").to_owned()).collect())
    });
    told.collect()
}

fn of<'t>(told: &'t [(String, Vec<String>)], name: &str) -> &'t [String] {
    &told.iter().find(|(answer, _)| answer == name).unwrap_or_else(|| panic!("no `{name}`: {told:?}")).1
}

/// An undo and a push of one step are carried out as one; each is told with its own steps.
#[test]
fn what_is_carried_out_as_one_is_booked_where_it_belongs() {
    let told = answers("", "raise('e_manual') wait(0.1) raise('e_auto') wait(0.1)");
    assert_eq!(of(&told, "manual.undone"), ["stop a", "cleanup a", "property_set b.gain"]);
    // From one value to the other, not over the one before both.
    assert_eq!(of(&told, "auto.ok"), ["property_set a.gain", "property_set b.mode", "configure b"]);
    let (undone, ok) = ("manual.undone", "auto.ok");
    let place = |name: &str| told.iter().position(|(answer, _)| answer == name).unwrap();
    assert!(place(undone) < place(ok), "{told:?}");
}

/// A push that fails leaves the undo of the same step done: what was undone is not done again to be undone once more.
#[test]
fn what_is_undone_is_not_done_again_when_the_push_beside_it_fails() {
    let faults = "faults: [{ step: \"configure b\", how: fail, times: 1 }]\n";
    let told = answers(faults, "raise('e_open') wait(0.1) raise('e_auto') wait(0.1)");
    let undone: Vec<&String> =
        told.iter().flat_map(|(_, steps)| steps).filter(|step| step.contains("a.close")).collect();
    let done = told.iter().flat_map(|(_, steps)| steps).filter(|step| step.contains("a.open")).count();
    assert_eq!((undone.len(), done), (1, 1), "{told:?}");
    assert!(told.iter().any(|(answer, _)| answer == "auto.failed"), "{told:?}");
    assert_eq!(of(&told, "opened.undone"), ["property_set b.gain", "operation_call a.close"], "{told:?}");
}

/// Each kind of fault that may stand in a deployment comes to what it says.
#[test]
fn faults_of_the_deployment_happen() {
    let fault = |step: &str, how: &str| format!("faults: [{{ step: \"{step}\", how: {how}, times: 1 }}]\n");
    let came = |how: &str| {
        let told = answers(&fault("property_set a.gain", how), "raise('e_manual') wait(8)");
        told.into_iter().map(|(answer, _)| answer).find(|answer| answer.starts_with("manual.")).expect("an answer")
    };
    for how in ["fail", "hang", "late", "lost"] {
        assert_eq!(came(how), "manual.failed", "{how}");
    }
    let told = answers(&fault("property_set a.gain", "lie"), "raise('e_manual') wait(8)");
    let manual: Vec<&str> =
        told.iter().map(|(answer, _)| answer.as_str()).filter(|a| a.starts_with("manual.")).collect();
    assert_eq!(manual, ["manual.ok", "manual.lost", "manual.undone"], "{told:?}");
}
