//! A deployment in the background, and the commands that talk to it: one process each, as typed.

use crate::demo::Demo;

/// Takes the deployment down whatever the test found.
struct Deployed(Demo);

impl Drop for Deployed {
    fn drop(&mut self) {
        let _ = self.0.command(&["shutdown", "--force"]).output();
    }
}

#[test]
fn deployed_switched_undone_and_shut_down() {
    let demo = Deployed(Demo::new());
    let run = |args: &[&str]| demo.0.run(args);
    // That this returns at all says that the process in the background holds on to neither of our pipes.
    let up = run(&["deploy", "deployment.yaml", "--detach"]);
    assert_eq!(up.code, 0, "{}{}", up.out, up.err);
    assert!(up.out.contains("demo up after") && up.out.contains("`davit shutdown` takes it down"), "{}", up.out);

    let status = run(&["status", "--json"]).json();
    assert_eq!(status["phase"], "up");
    assert_eq!(status["coordinator"], serde_json::json!(["root", "root.operational", "root.operational.slow_mode"]));
    assert_eq!(status["system"]["components"]["source"]["state"], "running");
    assert_eq!(status["system"]["connections"][0]["to"], "sink.u");

    let never = run(&["event", "e_fast", "--wait", "fast.okk"]);
    assert!(never.code == 1 && never.err.contains("did you mean `fast.ok`?"), "{}{}", never.out, never.err);
    assert_eq!(
        run(&["status", "--json"]).json()["system"]["components"]["source"]["properties"]["k"],
        1.0,
        "not raised"
    );
    // What no transition hears leads to no answer, whatever others bring about meanwhile.
    let unheard = run(&["event", "e_slow", "--wait", "slow.ok"]);
    assert_eq!(
        (unheard.code, unheard.out.as_str()),
        (1, "e_slow raised, and no transition heard it\n"),
        "{}",
        unheard.err
    );
    let event = run(&["event", "e_fast", "--wait", "fast.ok"]);
    assert_eq!(event.code, 0, "{}{}", event.out, event.err);
    assert_eq!(run(&["status", "--json"]).json()["system"]["components"]["source"]["properties"]["k"], 9.0);

    let unlisted = run(&["apply", "rename", "--wait"]);
    assert_eq!(unlisted.code, 1, "{}{}", unlisted.out, unlisted.err);
    assert!(unlisted.out.contains("rename.failed") && unlisted.out.contains("`operator:`"), "{}", unlisted.out);
    assert!(unlisted.out.contains("`--force`"), "{}", unlisted.out);
    let applied = run(&["apply", "rename", "--force", "--wait", "--json"]);
    assert_eq!(applied.code, 0, "{}{}", applied.out, applied.err);
    let name = || run(&["status", "--json"]).json()["system"]["components"]["source"]["properties"]["name"].clone();
    assert_eq!(name(), "second");
    assert_eq!(run(&["undo", "--wait"]).code, 0);
    assert_eq!(name(), "first");

    let stack = run(&["stack", "--json"]).json();
    let newest = stack.as_array().and_then(|frames| frames.last()).map(|frame| frame["configuration"].clone());
    assert_eq!(newest, Some("fast".into()));
    let log = run(&["log", "--steps", "--json"]).json();
    assert!(log.as_array().is_some_and(|entries| entries.iter().any(|entry| entry["answer"] == "rename.ok")), "{log}");

    let refused = run(&["apply", "rnename", "--wait"]);
    assert!(refused.code != 0 && refused.err.contains("`rename`"), "{}{}", refused.out, refused.err);

    let down = run(&["shutdown"]);
    assert_eq!(down.code, 0, "{}{}", down.out, down.err);
    assert_eq!(down.out, "demo: down\n");
    let gone = run(&["status"]);
    assert_eq!(gone.code, 1, "nobody is there any more: {}{}", gone.out, gone.err);
}

#[test]
fn an_event_that_no_transition_lists_reaches_functions_and_is_remarked_on() {
    let demo = Deployed(Demo::new());
    let run = |args: &[&str]| demo.0.run(args);
    let coordinator = "
return rfsm.state {
  idle = rfsm.state {}, on = rfsm.state {}, seen = rfsm.state {},
  rfsm.trans { src = 'initial', tgt = 'idle' },
  rfsm.trans { src = 'idle', tgt = 'on', events = { 'e_start' } },
  rfsm.trans { src = 'on', tgt = 'seen', events = { function(event) return event:match('^e_odd') end },
               effect = 'seen' },
  rfsm.trans { src = 'seen', tgt = 'idle', events = { 'e_stop' } },
  rfsm.trans { src = 'on', tgt = 'idle', events = { 'e_stop' } },
}
";
    let deployment = "
davit: 1
name: demo
platform: simulated
libraries: [standard]
configurations: []
emits: [seen]
coordinator: c.lua
trusted: true
deploy: { event: e_start, up: on, within_s: 20 }
shutdown: { event: e_stop, down: idle, within_s: 20 }
";
    demo.0.write("c.lua", coordinator);
    demo.0.write("seen.yaml", deployment);
    let up = run(&["deploy", "seen.yaml", "--detach"]);
    assert_eq!(up.code, 0, "{}{}", up.out, up.err);
    let event = run(&["event", "e_odd_one", "--wait", "seen"]);
    assert_eq!(event.code, 0, "{}{}", event.out, event.err);
    assert!(event.err.contains("no transition lists `e_odd_one`"), "{}", event.err);
    assert_eq!(run(&["status", "--json"]).json()["coordinator"], serde_json::json!(["root", "root.seen"]));
    let known = run(&["event", "e_stop", "--json"]).json();
    assert_eq!(known, serde_json::json!({ "accepted": true, "taken": true }));
    assert_eq!(run(&["shutdown"]).code, 0);
}

#[test]
fn a_running_deployments_active_states_are_marked() {
    let demo = Deployed(Demo::new());
    let run = |args: &[&str]| demo.0.run(args);
    assert_eq!(run(&["deploy", "deployment.yaml", "--detach"]).code, 0);
    for (format, marked) in [
        ("json", "\"root.operational.slow_mode\""),
        ("plantuml", "root_operational_slow_mode"),
        ("mermaid", "slow_mode"),
        ("dot", "slow_mode"),
        ("svg", "slow_mode"),
    ] {
        let plain = run(&["graph", "deployment.yaml", "--what", "coordinator", "--format", format]);
        let live = run(&["graph", "deployment.yaml", "--what", "coordinator", "--format", format, "--live"]);
        assert_eq!((plain.code, live.code), (0, 0), "{format}: {}{}", plain.err, live.err);
        assert!(live.out.contains(marked), "{format}");
        assert_ne!(plain.out, live.out, "{format}: something is marked");
    }
    assert_eq!(run(&["shutdown"]).code, 0);
}

#[test]
fn coordinators_go_out_in_every_format_and_scxml_comes_back() {
    let demo = Demo::new();
    let graph = |format: &str| {
        let ran = demo.run(&["graph", "deployment.yaml", "--what", "coordinator", "--format", format]);
        assert_eq!(ran.code, 0, "{format}: {}", ran.err);
        ran.out
    };
    assert!(graph("plantuml").starts_with("@startuml") && graph("plantuml").trim_end().ends_with("@enduml"));
    let json: serde_json::Value = serde_json::from_str(&graph("json")).expect("JSON");
    assert!(json.is_object());
    demo.write("machine.scxml", &graph("scxml"));
    let events = "run\ne_start\ncreate_all.ok\nconnect_all.ok\nstart_all.ok\ne_fast\n";
    demo.write("events.txt", events);
    let of = |file: &str| {
        let ran = demo.run(&["sim", file, "--events", "events.txt", "--json"]);
        assert_eq!(ran.code, 0, "{file}: {}", ran.err);
        ran.out
    };
    assert!(of("coordinator.lua").contains("root.operational.fast_mode"));
    let last = |text: &str| {
        let line: serde_json::Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
        line["active"].clone()
    };
    assert_eq!(last(&of("machine.scxml")), last(&of("coordinator.lua")));
}
