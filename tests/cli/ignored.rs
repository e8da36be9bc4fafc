//! What a subsystem does not take, as its parent is told it where all are planned as one.

use crate::demo::Demo;
use crate::hierarchy::{COORDINATOR, cell};
use serde_json::json;

/// A parent that asks for the end of what is down already is answered `.ignored`, in a plan as in a run; it is told to the state that asked.
#[test]
fn a_plan_tells_a_parent_what_its_subsystem_ignored() {
    let asks_twice = COORDINATOR.replace(
        r#"trans { src = "lowering", tgt = "idle", events = { "duo/down" } },"#,
        r#"again = state { entry = "duo/e_shutdown" },
  trans { src = "lowering", tgt = "again", events = { "duo/down" } },
  trans { src = "again", tgt = "idle", events = { "duo/e_shutdown.ignored" } },"#,
    );
    let demo = cell();
    demo.write("cell_coordinator.lua", &asks_twice);
    let down = demo.run(&["plan", "cell.yaml", "--shutdown", "--json"]);
    assert_eq!(down.code, 0, "{}{}", down.out, down.err);
    assert_eq!(down.json().as_array().unwrap().last().unwrap()["result"]["components"], json!({}));
    demo.write("story.lua", r#"deploy("cell.yaml") shutdown()"#);
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);

    // Who has left that state is not told. That it does not come down so is known before it runs.
    demo.write(
        "cell_coordinator.lua",
        &asks_twice.replace(
            r#"trans { src = "again", tgt = "idle", events = { "duo/e_shutdown.ignored" } },"#,
            r#"later = state {},
  trans { src = "again", tgt = "later", events = { "e_done" } },
  trans { src = "later", tgt = "idle", events = { "duo/e_shutdown.ignored" } },"#,
        ),
    );
    let down = demo.run(&["plan", "cell.yaml", "--shutdown"]);
    assert!(down.code == 1 && down.err.contains("stops at `cell:root.later`"), "{}{}", down.out, down.err);
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    let refused = ran.err.contains("deploy::never_down") && ran.err.contains("`cell:root.later");
    assert!(ran.code == 1 && refused, "{}: {}{}", ran.code, ran.out, ran.err);

    // What is taken is not answered.
    let waits = COORDINATOR.replace(
        r#"trans { src = "lowering", tgt = "idle", events = { "duo/down" } },"#,
        r#"trans { src = "lowering", tgt = "idle", events = { "duo/e_shutdown.ignored" } },"#,
    );
    demo.write("cell_coordinator.lua", &waits);
    let down = demo.run(&["plan", "cell.yaml", "--shutdown"]);
    assert!(down.code == 1 && down.err.contains("stops at `cell:root.lowering`"), "{}{}", down.out, down.err);
}

/// What is raised twice is answered twice, also within one step.
#[test]
fn each_event_that_is_ignored_is_answered() {
    let twice = COORDINATOR.replace(
        r#"trans { src = "lowering", tgt = "idle", events = { "duo/down" } },"#,
        r#"first = state {}, second = state {},
  trans { src = "lowering", tgt = "first", events = { "duo/down" }, effect = { "duo/e_shutdown", "duo/e_shutdown" } },
  trans { src = "first", tgt = "second", events = { "duo/e_shutdown.ignored" } },
  trans { src = "second", tgt = "idle", events = { "duo/e_shutdown.ignored" } },"#,
    );
    let demo = cell();
    demo.write("cell_coordinator.lua", &twice);
    demo.write("story.lua", r#"deploy("cell.yaml") shutdown()"#);
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    assert!(ran.code == 0 && ran.out.contains("cell:root.second"), "{}{}", ran.out, ran.err);
}

/// That something was ignored is heard behind what the subsystem told before: as `check` follows it, which finds nothing that is refused there.
#[test]
fn what_is_ignored_is_told_in_the_order_of_what_else_is() {
    let demo = Demo::new();
    let deployment = |name: &str, more: &str| {
        format!(
            "davit: 1\nname: {name}\nplatform: simulated\ntypes: {{ Lamp: {{}} }}\nconfigurations: [{name}_conf.yaml]\ncoordinator: {name}_coord.yaml
deploy: {{ event: e_start, up: 'on', within_s: 5 }}\nshutdown: {{ event: e_end, down: idle, within_s: 5 }}\n{more}\n"
        )
    };
    demo.write("inner.yaml", &deployment("inner", "accepts: [e_a, e_b]\nemits: [e_told]"));
    demo.write("inner_conf.yaml", "configurations: {}\n");
    demo.write(
        "inner_coord.yaml",
        "coordinator:
  states: { idle: {}, 'on': {}, told: { entry: e_told }, other: {} }
  transitions:
    - { src: initial, tgt: idle }
    - { src: idle, tgt: 'on', events: [e_start] }
    - { src: 'on', tgt: told, events: [e_a] }
    - { src: 'on', tgt: other, events: [e_b] }
    - { src: 'on', tgt: idle, events: [e_end] }
    - { src: told, tgt: idle, events: [e_end] }
    - { src: other, tgt: idle, events: [e_end] }
",
    );
    demo.write("outer.yaml", &deployment("outer", "subsystems: { a: { deployment: inner.yaml } }"));
    demo.write("outer_conf.yaml", "configurations: {}\n");
    demo.write(
        "outer_coord.yaml",
        "coordinator:
  states: { idle: {}, raising: { entry: a/e_start }, 'on': {}, go: { entry: [a/e_a, a/e_b] }, first: {}, ignored: {}, low: { entry: a/e_end } }
  transitions:
    - { src: initial, tgt: idle }
    - { src: idle, tgt: raising, events: [e_start] }
    - { src: raising, tgt: 'on', events: [a/up] }
    - { src: 'on', tgt: go, events: [e_go] }
    - { src: go, tgt: first, events: [a/e_told] }
    - { src: go, tgt: ignored, events: [a/e_b.ignored] }
    - { src: raising, tgt: low, events: [e_end] }
    - { src: 'on', tgt: low, events: [e_end] }
    - { src: go, tgt: low, events: [e_end] }
    - { src: first, tgt: low, events: [e_end] }
    - { src: ignored, tgt: low, events: [e_end] }
    - { src: low, tgt: idle, events: [a/down, a/e_end.ignored] }
",
    );
    demo.write("story.lua", r#"deploy("outer.yaml") raise("e_go") wait(1) shutdown()"#);
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    let states = (ran.out.contains("outer:root.first"), ran.out.contains("outer:root.ignored"));
    assert_eq!((ran.code, states), (0, (true, false)), "{}{}", ran.out, ran.err);
}
