//! `davit get` and `davit set`: one property or port of what runs.

use crate::demo::{Demo, Ran};
use crate::kept::deploy;
use serde_json::json;

/// Takes the deployment down whatever the test found.
struct Deployed(Demo);

impl Drop for Deployed {
    fn drop(&mut self) {
        let _ = self.0.command(&["shutdown", "--force"]).output();
    }
}

impl Deployed {
    fn new(demo: Demo) -> Self {
        deploy(&demo, "deployment.yaml");
        Self(demo)
    }

    fn run(&self, args: &[&str]) -> Ran {
        self.0.run(args)
    }

    fn value(&self, name: &str) -> serde_json::Value {
        self.run(&["get", name, "--json"]).json()["value"].clone()
    }
}

#[test]
fn a_property_is_set_by_a_frame_that_can_be_undone() {
    let demo = Demo::new();
    demo.write("deployment.yaml", &(demo.read("deployment.yaml") + "operator: [source.k, sink.flag]\n"));
    let deployed = Deployed::new(demo);
    let run = |args: &[&str]| deployed.run(args);

    let got = run(&["get", "source.k", "--json"]);
    let seen = got.json();
    assert_eq!(
        (got.code, &seen["value"], &seen["kind"], &seen["type"]),
        (0, &json!(1.0), &json!("property"), &json!("float"))
    );
    assert!(seen["at"].as_f64().is_some_and(|at| at > 0.0), "{seen}");
    assert!(
        run(&["get", "source.k"]).out.starts_with("source.k = 1.0  (float, at "),
        "{}",
        run(&["get", "source.k"]).out
    );

    // Integers where a float is wanted; listed, so without force.
    let set = run(&["set", "source.k", "3"]);
    assert!(set.code == 0 && set.out.starts_with("source.k.ok (1 step"), "{}{}", set.out, set.err);
    assert_eq!(deployed.value("source.k"), 3.0);
    // Another value is another value, however often: nothing that is kept for a fixed switch is used.
    for value in [4.0, 5.0, 4.0, 6.0] {
        assert_eq!(run(&["set", "source.k", &value.to_string()]).code, 0);
        assert_eq!(deployed.value("source.k"), value);
    }
    assert_eq!(run(&["set", "sink.flag", "true"]).code, 0);
    assert_eq!(deployed.value("sink.flag"), true);
    let stack = run(&["stack", "--json"]).json();
    let newest = stack.as_array().and_then(|frames| frames.last()).expect("a frame").clone();
    assert_eq!((&newest["configuration"], &newest["by"]), (&json!("sink.flag"), &json!("operator")), "{stack}");

    assert_eq!(run(&["undo"]).code, 0);
    assert_eq!(deployed.value("sink.flag"), false, "as the coordinator had written it");
    for value in [4.0, 5.0, 4.0, 3.0, 1.0] {
        let undone = run(&["undo", "source.k"]);
        assert_eq!(undone.code, 0, "{}{}", undone.out, undone.err);
        assert_eq!(deployed.value("source.k"), value);
    }
    // Below one of the coordinator's that was pushed since: the value is handed over, and the coordinator's undo brings back
    // what was there before both.
    assert_eq!(run(&["set", "source.k", "7"]).code, 0);
    assert_eq!(run(&["event", "e_fast", "--wait", "fast.ok"]).code, 0);
    assert_eq!((run(&["undo"]).code, deployed.value("source.k")), (0, json!(9.0)));
    let log = run(&["log", "--steps"]).out;
    assert!(log.contains("request    source.k by operator") && log.contains("property_set source.k"), "{log}");
    let down = run(&["shutdown"]);
    assert_eq!(down.code, 0, "{}{}", down.out, down.err);
}

#[test]
fn what_is_not_listed_needs_force_and_the_gates_are_those_of_apply() {
    let deployed = Deployed::new(Demo::new());
    let run = |args: &[&str]| deployed.run(args);
    let refused = run(&["set", "source.name", "second"]);
    assert_eq!(refused.code, 1, "{}{}", refused.out, refused.err);
    assert!(
        refused.out.contains("source.name.failed") && refused.out.contains("`operator:` does not list `source.name`"),
        "{}",
        refused.out
    );
    let set = run(&["set", "source.name", "second", "--force"]);
    assert_eq!((set.code, deployed.value("source.name")), (0, json!("second")), "{}{}", set.out, set.err);
    // The text of a number is a text.
    assert_eq!(run(&["set", "source.name", "7", "--force"]).code, 0);
    assert_eq!(deployed.value("source.name"), "7");
    assert_eq!(run(&["set", "sink.limits", "[1, 2]", "--force", "--json"]).json()["answer"], "sink.limits.ok");
    assert_eq!(deployed.value("sink.limits"), json!([1.0, 2.0]));

    for (args, code, told) in [
        (&["set", "source.k", "11", "--force"][..], 1, "10"),
        (&["set", "source.k", "-1", "--force"], 1, "source.k.failed"),
        (&["set", "source.mode", "1", "--force"], 1, "source.mode.failed"),
        (&["set", "source.k", "1e400", "--force"], 2, "`1e400` is no finite number"),
        (&["set", "source.k", "fast", "--force"], 1, "`source.k` is a float"),
        (&["set", "sink.limits", "[1]", "--force"], 1, "expected 2 elements"),
        (&["set", "sink.u", "1", "--force"], 1, "sink.u.failed"),
        (&["set", "source.y", "1", "--force"], 1, "is an out-port"),
        (&["set", "source.kk", "1", "--force"], 1, "did you mean `k`?"),
        (&["set", "sorce.k", "1", "--force"], 1, "did you mean `source`?"),
        (&["get", "source"], 1, "`Component.member`"),
        (&["get", "sink.w"], 1, "it was never written"),
        // The simulated platform moves no values.
        (&["get", "source.y"], 1, "does not show"),
        (&["get", "sink.u"], 1, "does not show"),
        (&["apply", "source.name"], 1, "davit set source.name"),
        (&["undo", "sink.w"], 1, "there is no configuration"),
    ] {
        let ran = run(args);
        let all = format!("{}{}", ran.out, ran.err);
        assert!(ran.code == code && all.contains(told), "{args:?} {}: {all}", ran.code);
    }
    assert_eq!(run(&["stack", "--json"]).json().as_array().map(Vec::len), Some(4 + 3), "what failed left nothing");
    let wrong = run(&["set", "source.k", "1e999", "--force", "--json"]).json();
    assert_eq!(wrong["ok"], false, "{wrong}");
}

#[test]
fn what_a_component_sends_is_shown_with_its_time() {
    let demo = Demo::new();
    let text = demo.read("deployment.yaml").replace("platform: simulated", "platform: embedded\nlibraries: [standard]");
    let types = text.find("types:").unwrap()..text.find("activities:").unwrap();
    demo.write("deployment.yaml", &[&text[..types.start], &text[types.end..]].concat());
    let configurations = "ConfiguratorConf {
  create_all = Configuration { create('source', 'standard.Constant', { activity = 'control', properties = { value = 2.5 } }),
                               create('sink', 'standard.Gain', { activity = 'control' }) },
  connect_all = Configuration { connect('source.y', 'sink.u') },
  start_all = Configuration { post_conf_state = { 'sink:running', 'source:running' } },
  slow = Configuration { property_set('sink.k', 2.0) },
  fast = Configuration { property_set('sink.k', 4.0) },
}
";
    demo.write("configurations.lua", configurations);
    let deployed = Deployed::new(demo);
    let seen = deployed.run(&["get", "sink.y", "--json", "--within", "60"]).json();
    assert_eq!((&seen["value"], &seen["kind"]), (&json!(5.0), &json!("out")), "{seen}");
    let seen = deployed.run(&["get", "sink.u", "--json", "--within", "60"]).json();
    assert_eq!((&seen["value"], &seen["driven_by"]), (&json!(2.5), &json!(["source.y"])), "{seen}");
    let earlier = seen["at"].as_f64().expect("a time");
    let later = deployed.run(&["get", "sink.u", "--json", "--within", "60"]).json()["at"].as_f64();
    assert!(later.is_some_and(|later| later > earlier), "{earlier} {later:?}");
    assert_eq!(deployed.run(&["set", "sink.k", "3", "--force"]).code, 0);
    // What was sent before may be on its way still.
    crate::foreground::until("it has its effect", || (deployed.value("sink.y") == 7.5).then_some(()));
    assert_eq!(deployed.run(&["undo"]).code, 0);
    assert_eq!(deployed.run(&["shutdown"]).code, 0);
}
