//! What `check` takes for one state: as little as can be told apart, and no less.

use crate::demo::Demo;
use serde_json::Value;

const CONFIGURATIONS: &str = r#"ConfiguratorConf {
  base = Configuration { create("sink", "Sink"), create("source", "Source", { properties = { name = "it" } }) },
  one = Configuration { ONE },
  two = Configuration { TWO },
}
"#;

/// `one` and `two` are applied in either order, then one of them is undone.
const COORDINATOR: &str = r#"return state {
  idle = state {},
  up = state { entry = "base" },
  one_first = state { entry = "one" },
  two_second = state { entry = "two" },
  two_first = state { entry = "two" },
  one_second = state { entry = "one" },
  both = state {},
  less_one = state { entry = "one.undo" },
  less_two = state { entry = "two.undo" },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "up", events = { "e_start" } },
  trans { src = "up", tgt = "one_first", events = { "e_one" } },
  trans { src = "up", tgt = "two_first", events = { "e_two" } },
  trans { src = "one_first", tgt = "two_second", events = { "one.ok" } },
  trans { src = "two_first", tgt = "one_second", events = { "two.ok" } },
  trans { src = "two_second", tgt = "both", events = { "two.ok" } },
  trans { src = "one_second", tgt = "both", events = { "one.ok" } },
  trans { src = "both", tgt = "less_one", events = { "e_less_one" } },
  trans { src = "both", tgt = "less_two", events = { "e_less_two" } },
  trans { src = "up", tgt = "idle", events = { "e_shutdown" }, effect = "base.undo" },
}
"#;

fn check(one: &str, two: &str) -> Value {
    let demo = Demo::new();
    demo.write("configurations.lua", &CONFIGURATIONS.replace("ONE", one).replace("TWO", two));
    demo.write("coordinator.lua", COORDINATOR);
    demo.replace("deployment.yaml", "emits: [e_ready]\n", "");
    demo.replace("deployment.yaml", "up: operational, failed: [failed],", "up: up,");
    demo.run(&["check", "deployment.yaml", "--json"]).json()
}

/// What is said of refused undoings.
fn refused(json: &Value) -> Vec<&str> {
    let findings = json["findings"].as_array().unwrap();
    let told = findings.iter().filter(|f| f["code"] == "coord::request_refused");
    told.map(|f| f["message"].as_str().unwrap()).filter(|m| m.contains(".undo` is refused")).collect()
}

/// Each demands that the sink runs. The first one makes it run, and stays as long as the second one needs it.
#[test]
fn the_order_of_frames_counts_where_one_keeps_the_other() {
    let runs = "post_conf_state = { \"sink:running\" }";
    let json = check(runs, runs);
    for which in ["one", "two"] {
        let told = refused(&json);
        assert!(
            told.iter().any(|m| m.starts_with(&format!("`{which}.undo` is refused"))),
            "{which}: in one of the two orders it cannot be undone: {json:#}"
        );
    }
}

/// Both write, each another property: which was first makes no difference, and `both` is one state of the system.
#[test]
fn the_order_of_frames_does_not_count_where_neither_keeps_the_other() {
    let (one, two) = ("property_set(\"source.k\", 3.0)", "property_set(\"source.mode\", 1)");
    let free = check(one, two);
    assert!(refused(&free).is_empty(), "{free:#}");
    let bound = check("post_conf_state = { \"sink:running\" }", "post_conf_state = { \"sink:stopped\" }");
    let states = |json: &Value| json["explored"]["states"].as_u64().unwrap();
    assert!(states(&free) > 10 && states(&free) < states(&bound), "{free:#}{bound:#}");
}

#[test]
fn what_was_not_followed_is_told() {
    let demo = Demo::new();
    let text = demo.run(&["check", "deployment.yaml"]).out;
    assert!(text.contains("followed with at most 3 frames of one configuration in force"), "{text}");
    assert!(!text.contains("not followed further"), "{text}");
    // Twelve switches that have nothing to do with each other: more systems than anybody follows.
    let mut states = String::new();
    let mut configurations = String::new();
    let mut moves = String::new();
    for i in 0..12 {
        states += &format!("s{i} = state {{ entry = \"c{i}\" }}, t{i} = state {{ entry = \"c{i}.undo\" }},\n");
        configurations += &format!("c{i} = Configuration {{ create(\"x{i}\", \"Sink\") }},\n");
        moves += &format!(
            "trans {{ src = \"operational\", tgt = \"s{i}\", events = {{ \"e_on{i}\" }} }},
             trans {{ src = \"operational\", tgt = \"t{i}\", events = {{ \"e_off{i}\" }} }},
             trans {{ src = \"s{i}\", tgt = \"operational\", events = {{ \"c{i}.ok\", \"c{i}.failed\", \"c{i}.broken\" }} }},
             trans {{ src = \"t{i}\", tgt = \"operational\", events = {{ \"c{i}.undone\", \"c{i}.undo.failed\", \"c{i}.undo.broken\" }} }},\n"
        );
    }
    demo.replace("configurations.lua", "ConfiguratorConf {", &format!("ConfiguratorConf {{\n{configurations}"));
    demo.replace("coordinator.lua", "  idle = state {},\n", &format!("  idle = state {{}},\n{states}"));
    demo.replace(
        "coordinator.lua",
        "  trans { src = \"initial\", tgt = \"idle\" },\n",
        &format!("  trans {{ src = \"initial\", tgt = \"idle\" }},\n{moves}"),
    );
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    assert_eq!(json["explored"]["complete"], false, "{json:#}");
    assert!(json["explored"]["unfollowed"].as_u64().unwrap() > 100, "{json:#}");
    let text = demo.run(&["check", "deployment.yaml"]).out;
    assert!(text.contains("not all there are") && text.contains("were met and not followed further"), "{text}");
}

/// A coordinator that starts to work as soon as it is entered: `check` comes to an end all the same.
fn by_itself(states: &str) -> Value {
    let demo = Demo::new();
    demo.write(
        "configurations.lua",
        "ConfiguratorConf {
          base = Configuration { create(\"source\", \"Source\", { properties = { name = \"it\" } }) },
          x = Configuration { group = \"g\", property_set(\"source.k\", 2.0) },
          y = Configuration { group = \"g\", property_set(\"source.k\", 3.0) },
        }",
    );
    demo.write("coordinator.lua", &format!("return state {{ on = state {{}}, {states} }}"));
    demo.replace("deployment.yaml", "emits: [e_ready]\n", "");
    demo.replace("deployment.yaml", "up: operational, failed: [failed],", "up: on,");
    demo.run(&["check", "deployment.yaml", "--json"]).json()
}

#[test]
fn who_goes_round_by_itself_is_followed_to_an_end() {
    let round = "a = state {}, idle = state { entry = \"base.undo\" }, b = state { entry = \"base\" },
      trans { src = \"initial\", tgt = \"b\" },
      trans { src = \"b\", tgt = \"idle\", events = { \"base.ok\" } },
      trans { src = \"idle\", tgt = \"b\", events = { \"base.undone\" } },
      trans { src = \"on\", tgt = \"idle\", events = { \"e_shutdown\" } },";
    // Wherever on its round it listens, that is where it is brought up from.
    for at in ["b", "idle"] {
        let json = by_itself(&format!("{round} trans {{ src = \"{at}\", tgt = \"on\", events = {{ \"e_start\" }} }}"));
        assert_eq!(json["explored"]["unfollowed"], 0, "{json:#}");
        let codes: Vec<&str> =
            json["findings"].as_array().unwrap().iter().map(|f| f["code"].as_str().unwrap()).collect();
        assert!(!codes.contains(&"deploy::never_up"), "{at}: {json:#}");
        assert!(codes.contains(&"coord::endless"), "{at}: {json:#}");
    }
}

/// Each answer makes it ask for two things more.
#[test]
fn who_asks_for_more_than_is_answered_is_followed_so_far() {
    let piles = "idle = state { entry = \"base\" },
      a = state { m = state {}, n = state {},
        trans { src = \"initial\", tgt = \"m\", effect = { \"x\", \"y\" } },
        trans { src = \"m\", tgt = \"n\", events = { \"x.ok\", \"y.ok\" }, effect = { \"x\", \"y\" } },
        trans { src = \"n\", tgt = \"m\", events = { \"x.ok\", \"y.ok\" }, effect = { \"x\", \"y\" } } },
      trans { src = \"initial\", tgt = \"idle\" },
      trans { src = \"idle\", tgt = \"a\", events = { \"base.ok\" } },
      trans { src = \"a\", tgt = \"on\", events = { \"e_start\" } },
      trans { src = \"on\", tgt = \"idle\", events = { \"e_shutdown\" } },";
    let json = by_itself(piles);
    assert_eq!(json["explored"]["complete"], false, "{json:#}");
    assert!(json["explored"]["states"].as_u64().unwrap() > 30, "{json:#}");
}
