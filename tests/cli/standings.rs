//! How a subsystem stands, as its parent is told: once for each change, of the life in which it is, and of no other.

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
    assert_eq!(checked.err.matches("compose::not_down_at_first").count(), 2, "{}", checked.err);
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

/// A drive that goes to `off` again where it cannot be made, hears what begins it in `fail` as well, and may be busy.
const DRIVE: &str = r#"return state {
  off = state {}, make = state { entry = "mk" }, on = state {}, busy = state {}, fail = state {}, leave = state { entry = "mk.undo" },
  trans { src = "initial", tgt = "off" },
  trans { src = "off", tgt = "make", events = { "e_start" } },
  trans { src = "fail", tgt = "make", events = { "e_start" } },
  trans { src = "make", tgt = "on", events = { "mk.ok" } },
  trans { src = "make", tgt = "FAILED", events = { "mk.failed", "mk.broken" } },
  trans { src = "make", tgt = "leave", events = { "e_stop" } },
  trans { src = "on", tgt = "busy", events = { "e_work" } },
  trans { src = "busy", tgt = "leave", events = { "e_stop" } },
  trans { src = "on", tgt = "leave", events = { "e_stop" } },
  trans { src = "fail", tgt = "leave", events = { "e_stop" } },
  trans { src = "leave", tgt = "off", events = { "mk.undone" } },
  trans { src = "leave", tgt = "fail", events = { "mk.undo.failed", "mk.undo.broken" } },
}
"#;

/// A drive that asks for nothing.
const PLAIN: &str = r#"return state {
  off = state {}, on = state {}, fail = state {},
  trans { src = "initial", tgt = "off" },
  trans { src = "off", tgt = "on", events = { "e_start" } },
  trans { src = "on", tgt = "off", events = { "e_stop" } },
}
"#;

/// What is told of `a`, which comes to `failed` where it cannot be made, while a script runs: each with the second in which it is told.
fn told(failed: &str, script: &str) -> Vec<String> {
    told_of(&DRIVE.replace("FAILED", failed), script)
}

fn told_of(chart: &str, script: &str) -> Vec<String> {
    let demo = Demo::new();
    let own = "deploy:   { event: e_start, up: on, failed: [fail], within_s: 5 }";
    let drive = ROBOT
        .replace("name: robot", "name: drive")
        .replace("robot.lua", "drive.lua")
        .replace("within_s: 20", "within_s: 5");
    let drive = drive.replace("deploy:   { event: e_start, up: on, within_s: 5 }", own) + "accepts: [e_work]\n";
    demo.write("drive.yaml", &drive);
    demo.write("drive.lua", chart);
    demo.write("conf.yaml", MAKE);
    demo.write("none.yaml", "configurations: {}\n");
    demo.write(
        "top.yaml",
        &PAIR
            .replace(
                "left: { deployment: robot.yaml }, right: { deployment: robot.yaml }",
                "a: { deployment: drive.yaml }",
            )
            .replace("pair", "top")
            .replace("up: on, within_s: 0.5", "up: on, within_s: 60"),
    );
    // It only passes on what it is told to, and hears all.
    demo.write(
        "top.lua",
        r#"return state {
  idle = state {}, on = state {}, heard = state {},
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "on", events = { "e_start" } },
  trans { src = "on", tgt = "on", events = { "e_begin" }, effect = "a/e_start" },
  trans { src = "on", tgt = "on", events = { "e_end" }, effect = "a/e_stop" },
  trans { src = "on", tgt = "on", events = { "e_anew" }, effect = { "a/e_stop", "a/e_start" } },
  trans { src = "on", tgt = "on", events = { "e_busy" }, effect = "a/e_work" },
  trans { src = "on", tgt = "idle", events = { "e_stop" } },
}
"#,
    );
    demo.write("story.lua", &format!("deploy('top.yaml', {{ replay = true }}) raise('e_start')\n{script}\nwait(20)"));
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--json"]);
    let line = |line: &str| {
        let json: serde_json::Value = serde_json::from_str(line).ok()?;
        let is_told = json["what"] == "event" && json["from"] == "a";
        is_told.then(|| {
            format!(
                "{} {}",
                json["at"].as_f64().unwrap_or_default().floor(),
                json["event"].as_str().unwrap_or_default()
            )
        })
    };
    let all: Vec<String> = ran.out.lines().filter_map(line).collect();
    assert!(!all.is_empty(), "{}{}", ran.out, ran.err);
    all
}

#[test]
fn each_life_of_a_subsystem_is_told_of_by_itself() {
    // Down again it is late no more, and who ends it then hears nothing of it.
    let down = told("off", "fault('create a/x', 'fail', 1) raise('e_begin') wait(6) raise('e_end')");
    assert_eq!(down, ["0 a/down"]);
    // Begun anew after it had failed it tells that it has failed again.
    let failed = told("fail", "fault('create a/x', 'fail', 2) raise('e_begin') wait(1) raise('e_begin')");
    assert_eq!(failed, ["0 a/failed", "1 a/failed"]);
    // Ended and begun in one step it tells that it is up again.
    let anew = told_of(PLAIN, "raise('e_begin') wait(1) raise('e_anew')");
    assert_eq!(anew.last().map(String::as_str), Some("1 a/up"), "{anew:?}");
    // What begins it and is ignored says nothing of when it has to be up.
    let busy = told("off", "raise('e_begin') wait(1) raise('e_begin') raise('e_busy')");
    assert_eq!(busy, ["0 a/up"]);
    // Where it has failed on its way down, it is told all the same that it is not down in time.
    let stranded = told("off", "fault('destroy a/x', 'fail', 1) raise('e_begin') wait(1) raise('e_end')");
    assert_eq!(stranded, ["0 a/up", "1 a/failed", "6 a/stranded"]);
}

/// It lets what is inside go down by itself.
const MID: &str = r#"return state {
  off = state {}, w = state {}, on = state {}, l = state {},
  trans { src = "initial", tgt = "off" },
  trans { src = "off", tgt = "w", events = { "e_start" }, effect = "b/e_start" },
  trans { src = "w", tgt = "on", events = { "b/up" } },
  trans { src = "w", tgt = "l", events = { "e_stop" }, effect = "b/e_stop" },
  trans { src = "l", tgt = "off", events = { "b/down", "b/e_stop.ignored" } },
  trans { src = "on", tgt = "off", events = { "e_stop" }, effect = "b/e_stop" },
}
"#;

#[test]
fn a_subsystem_is_not_down_before_what_is_inside_is() {
    let demo = Demo::new();
    let drive = DRIVE.replace("FAILED", "fail").replace(
        r#"trans { src = "on", tgt = "leave", events = { "e_stop" } },"#,
        r#"slow = state {}, trans { src = "on", tgt = "slow", events = { "e_stop" } }, trans { src = "slow", tgt = "leave", events = { "e_after(1.0)" } },"#,
    );
    let top = PAIR
        .replace("left: { deployment: robot.yaml }, right: { deployment: robot.yaml }", "a: { deployment: mid.yaml }");
    let mid = ROBOT
        .replace("robot.lua", "mid.lua")
        .replace("name: robot", "name: mid")
        .replace("{ A: {} }", "{}")
        .replace("conf.yaml", "none.yaml");
    for (file, text) in [
        ("drive.yaml", ROBOT.replace("robot.lua", "drive.lua")),
        ("drive.lua", drive),
        ("conf.yaml", MAKE.to_owned()),
        ("none.yaml", "configurations: {}\n".to_owned()),
        ("mid.yaml", mid + "subsystems: { b: { deployment: drive.yaml } }\n"),
        ("mid.lua", MID.to_owned()),
        ("pair.yaml", top),
    ] {
        demo.write(file, &text);
    }
    demo.write(
        "pair.lua",
        r#"return state {
  idle = state {}, w = state {}, on = state {}, l = state {},
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "w", events = { "e_start" }, effect = "a/e_start" },
  trans { src = "w", tgt = "on", events = { "a/up" } },
  trans { src = "w", tgt = "l", events = { "e_stop" }, effect = "a/e_stop" },
  trans { src = "on", tgt = "l", events = { "e_stop" }, effect = "a/e_stop" },
  trans { src = "l", tgt = "idle", events = { "a/down" } },
}
"#,
    );
    demo.write("story.lua", "deploy('pair.yaml') wait(1) raise('e_stop') wait(3) say('over')");
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    let lines: Vec<&str> = ran.out.lines().collect();
    let at = |what: &str| lines.iter().rposition(|line| line.contains(what));
    let (inside, parent) = (at("in  a/b:root.off"), at("in  pair:root.idle"));
    assert!(inside.is_some() && inside < parent, "in its first life, too: {}{}", ran.out, ran.err);
}

/// Of a subsystem with several coordinators it is not known what it tells in which order. That nobody has ended it is.
#[test]
fn who_waits_for_down_of_what_nobody_has_ended_is_warned_of() {
    let pair = pair();
    let two = ROBOT.replace("coordinator: robot.lua", "coordinators: { m: robot.lua, k: k.lua }");
    let two = two.replace("up: on", "up: [m:on, k:u]").replace("down: off", "down: [m:off, k:z]");
    pair.write("robot.yaml", &two);
    let begins = BOOTS.replace("boot = state {}, ", "").replace("tgt = \"boot\" }", "tgt = \"off\" }");
    let lines = begins.lines().filter(|line| !line.contains("src = \"boot\""));
    pair.write("robot.lua", &lines.collect::<Vec<_>>().join("\n"));
    let second = r#"return state { z = state {}, u = state {}, trans { src = "initial", tgt = "z" },
  trans { src = "z", tgt = "u", events = { "e_start" } }, trans { src = "u", tgt = "z", events = { "e_stop" } } }"#;
    pair.write("k.lua", second);
    pair.write("pair.yaml", &PAIR.replace(", right: { deployment: robot.yaml }", ""));
    let alone = |unended: &str| {
        let chart = r#"return state {
  idle = state {}, w = state {}, on = state {}, l = state {},
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "w", events = { "e_start" }, effect = "left/e_start" },
  trans { src = "w", tgt = "on", events = { "left/up" } },
  trans { src = "w", tgt = "l", events = { "e_stop" }, effect = "left/e_stop" },
  trans { src = "on", tgt = "l", events = { "e_stop" }, effect = "left/e_stop" },
  trans { src = "l", tgt = "idle", events = { "left/down" } },
}"#;
        pair.write("pair.lua", &chart.replace(unended, &unended.replace(r#", effect = "left/e_stop""#, "")));
        pair.run(&["check", "pair.yaml"])
    };
    let led = alone("nothing of it");
    assert!(!led.err.contains("no_way_down"), "{}", led.err);
    let not_led = alone(r#"src = "w", tgt = "l", events = { "e_stop" }, effect = "left/e_stop" }"#);
    let warned =
        ["from `root.l` only `left/down` leads down, and nobody has ended `left` there", "raise `left/e_stop`"];
    assert!(warned.iter().all(|words| not_led.err.contains(words)), "{}", not_led.err);
}
