//! A subsystem that hears the event that ends it in a state in which nobody had begun it: its parent is told when it is down.

use crate::demo::{Demo, Ran};

const ROBOT: &str = "davit: 1
name: robot
platform: simulated
types: { A: {} }
configurations: [conf.yaml]
coordinator: robot.lua
deploy:   { event: e_start, up: on, within_s: 20 }
shutdown: { event: e_stop, down: off, within_s: 20 }
";

const MAKE: &str = "configurations:
  mk: { changes: [ { create: { component: x, type: A } } ], post_conf_state: [\"x:running\"] }
";

/// It is not down at first, and hears there what ends it.
const BOOTS: &str = r#"return state {
  boot = state {}, off = state {}, make = state { entry = "mk" }, on = state {}, fail = state {}, leave = state { entry = "mk.undo" },
  trans { src = "initial", tgt = "boot" },
  trans { src = "boot", tgt = "off", events = { "e_stop", "e_ready" } },
  trans { src = "boot", tgt = "make", events = { "e_start" } },
  trans { src = "off", tgt = "make", events = { "e_start" } },
  trans { src = "make", tgt = "on", events = { "mk.ok" } },
  trans { src = "make", tgt = "fail", events = { "mk.failed", "mk.broken" } },
  trans { src = "make", tgt = "leave", events = { "e_stop" } },
  trans { src = "on", tgt = "leave", events = { "e_stop" } },
  trans { src = "fail", tgt = "leave", events = { "e_stop" } },
  trans { src = "leave", tgt = "off", events = { "mk.undone" } },
  trans { src = "leave", tgt = "fail", events = { "mk.undo.failed", "mk.undo.broken" } },
}
"#;

const PAIR: &str = "davit: 1
name: pair
platform: simulated
types: {}
subsystems: { left: { deployment: robot.yaml }, right: { deployment: robot.yaml } }
configurations: [none.yaml]
coordinator: pair.lua
deploy:   { event: e_start, up: on, within_s: 0.5 }
shutdown: { event: e_stop, down: idle, within_s: 5 }
";

/// It begins one after the other, and ends both, wherever it has come to.
const ONE_BY_ONE: &str = r#"return state {
  idle = state {}, w0 = state {}, w1 = state {}, on = state {}, l0 = state {}, l1 = state {},
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "w0", events = { "e_start" }, effect = "left/e_start" },
  trans { src = "w0", tgt = "w1", events = { "left/up" }, effect = "right/e_start" },
  trans { src = "w1", tgt = "on", events = { "right/up" } },
  trans { src = "w0", tgt = "l0", events = { "e_stop" }, effect = "right/e_stop" },
  trans { src = "w1", tgt = "l0", events = { "e_stop" }, effect = "right/e_stop" },
  trans { src = "on", tgt = "l0", events = { "e_stop" }, effect = "right/e_stop" },
  trans { src = "l0", tgt = "l1", events = { "right/down", "right/e_stop.ignored" }, effect = "left/e_stop" },
  trans { src = "l1", tgt = "idle", events = { "left/down", "left/e_stop.ignored" } },
}
"#;

fn pair() -> Demo {
    let demo = Demo::new();
    for (file, text) in [
        ("robot.yaml", ROBOT),
        ("conf.yaml", MAKE),
        ("robot.lua", BOOTS),
        ("pair.yaml", PAIR),
        ("none.yaml", "configurations: {}\n"),
        ("pair.lua", ONE_BY_ONE),
    ] {
        demo.write(file, text);
    }
    demo
}

#[test]
fn who_ends_what_nobody_has_begun_is_told_when_it_is_down() {
    let pair = pair();
    let checked: Ran = pair.run(&["check", "pair.yaml"]);
    assert_eq!(checked.code, 0, "{}{}", checked.out, checked.err);
    // The first one takes so long that it is given up before the second one is begun.
    pair.write(
        "story.lua",
        "fault('configure left/x', 'slow', 1, 0.9)
assert(not pcall(deploy, 'pair.yaml'))",
    );
    let ran = pair.run(&["run", "story.lua", "--clock", "simulated"]);
    assert!(
        ran.out.contains("right/down from right") && ran.out.contains("in  pair:root.l1"),
        "{}{}",
        ran.out,
        ran.err
    );
    let last = ran.out.lines().rfind(|line| line.contains("  in  ")).unwrap_or_default();
    assert!(last.contains("pair:root.idle"), "its coordinator leads it down: {}{}", ran.out, ran.err);
}
