//! What a subsystem does not take, as its parent is told it where all are planned as one.

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

/// That something was ignored is heard behind what the subsystem told before.
#[test]
fn what_is_ignored_is_told_in_the_order_of_what_else_is() {
    let told_first = COORDINATOR.replace(
        r#"trans { src = "lowering", tgt = "idle", events = { "duo/down" } },"#,
        r#"again = state { entry = { "duo/e_start", "duo/e_shutdown", "duo/e_shutdown" } }, odd = state {},
  trans { src = "lowering", tgt = "again", events = { "duo/down" } },
  trans { src = "again", tgt = "idle", events = { "duo/down" } },
  trans { src = "again", tgt = "odd", events = { "duo/e_shutdown.ignored" } },"#,
    );
    let demo = cell();
    demo.write("cell_coordinator.lua", &told_first);
    demo.write("story.lua", r#"deploy("cell.yaml") shutdown()"#);
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    assert!(!ran.out.contains("cell:root.odd"), "{}{}", ran.out, ran.err);
}
