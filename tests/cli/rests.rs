//! What force brings to rest of a deployment of two arms: what is held stays, everything else goes on, and all is removed in the end.

use crate::demo::{Demo, Ran};

const ARM: &str = "davit: 1
name: arm
platform: simulated
types:
  Arm:
    actuator: true
    properties: { hold: { type: float, default: 0.0 } }
    operations:
      raise: { effect: { undo: fold }, moves: true }
      fold:  { effect: { undo: raise }, moves: true }
      brake: { effect: none }
exports: { operations: { fold: Arm.fold } }
configurations: [arm_conf.lua]
coordinator: arm.lua
deploy:   { event: e_start, up: on, within_s: 10 }
shutdown: { event: e_shutdown, down: idle, within_s: 1, rest: [fold] }
safety: [e_estop]
";

const ARM_CONF: &str = r#"ConfiguratorConf {
  make = Configuration { create("Arm", "Arm"), post_conf_state = { "Arm:running" } },
  hold = Configuration { safe = true, timeout = 2, property_set("Arm.hold", 1.0), operation_call("Arm.brake") },
  fold = Configuration { timeout = 3, operation_call("Arm.fold") },
}
"#;

const ARM_COORDINATOR: &str = r#"local answers = { "hold.ok", "hold.failed", "hold.broken" }
local undone = { "hold.undone", "hold.undo.failed", "hold.undo.broken" }
return state {
  idle = state {},
  made = state {
    making = state { entry = "make" }, on = state {}, failed = state {},
    holding = state { entry = "hold" }, held = state {}, going = state { entry = "hold.undo" },
    removing = state { entry = "make.undo" },
    trans { src = "initial", tgt = "making" },
    trans { src = "making", tgt = "on", events = { "make.ok" } },
    trans { src = "making", tgt = "failed", events = { "make.failed", "make.broken" } },
    trans { src = "holding", tgt = "held", events = answers },
    trans { src = "held", tgt = "going", events = { "e_shutdown" } },
    trans { src = "going", tgt = "removing", events = undone },
    trans { src = "removing", tgt = "failed", events = { "make.undo.failed", "make.undo.broken" } },
    trans { src = "making", tgt = "removing", events = { "e_shutdown" } },
    trans { src = "on", tgt = "removing", events = { "e_shutdown" } },
    trans { src = "failed", tgt = "removing", events = { "e_shutdown" } },
    trans { src = "making", tgt = "holding", events = { "e_estop" } },
    trans { src = "on", tgt = "holding", events = { "e_estop" } },
    trans { src = "failed", tgt = "holding", events = { "e_estop" } },
    trans { src = "going", tgt = "holding", events = { "e_estop" } },
    trans { src = "removing", tgt = "holding", events = { "e_estop" } },
  },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "made", events = { "e_start" } },
  trans { src = ".made.removing", tgt = "idle", events = { "make.undone" } },
}
"#;

const PAIR: &str = "davit: 1
name: pair
platform: simulated
types: {}
subsystems: { left: { deployment: arm.yaml }, right: { deployment: arm.yaml } }
configurations: [pair_conf.lua]
coordinator: pair.lua
deploy:   { event: e_start, up: joined, within_s: 10 }
shutdown: { event: e_shutdown, down: idle, within_s: 5, rest: [tuck] }
safety: [e_estop]
";

const PAIR_COORDINATOR: &str = r#"return state {
  idle = state {}, first = state {}, second = state {}, joined = state {}, last = state {}, lowering = state {},
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "first", events = { "e_start" }, effect = { "left/e_start" } },
  trans { src = "first", tgt = "second", events = { "left/up" }, effect = { "right/e_start" } },
  trans { src = "second", tgt = "joined", events = { "right/up" } },
  trans { src = "joined", tgt = "lowering", events = { "e_shutdown" }, effect = { "left/e_shutdown" } },
  trans { src = "lowering", tgt = "last", events = { "left/down" }, effect = { "right/e_shutdown" } },
  trans { src = "last", tgt = "idle", events = { "right/down" } },
}
"#;

/// What comes of that, once `file` is up, by force at the end.
fn forced(file: &str, script: &str) -> Ran {
    let demo = Demo::new();
    let tuck = "ConfiguratorConf { tuck = Configuration { timeout = 3, operation_call(\"left.fold\") } }\n";
    let files = [
        ("arm.yaml", ARM),
        ("arm_conf.lua", ARM_CONF),
        ("arm.lua", ARM_COORDINATOR),
        ("pair.yaml", PAIR),
        ("pair_conf.lua", tuck),
        ("pair.lua", PAIR_COORDINATOR),
    ];
    files.iter().for_each(|(name, text)| demo.write(name, text));
    demo.write("story.lua", &format!("deploy('{file}') say('---') {script} shutdown{{ force = true }}"));
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 4, "{}{}", ran.out, ran.err);
    assert!(!ran.out.contains("left  "), "nothing is left: {}{}", ran.out, ran.err);
    ran
}

fn rested(ran: &Ran, what: &str) -> bool {
    ran.out.lines().any(|line| line.ends_with(&format!("`{what}`, to come to rest, applied")))
}

#[test]
fn what_a_subsystem_holds_its_parents_rest_does_not_move() {
    let free = forced("pair.yaml", "");
    assert!(["tuck", "left/fold", "right/fold"].iter().all(|what| rested(&free, what)), "{}", free.out);
    let held = forced("pair.yaml", "raise('left/e_estop') wait_answer('left/hold.ok', 1)");
    assert!(rested(&held, "right/fold") && !rested(&held, "tuck"), "{}", held.out);
    let why = "`operation_call left/Arm.fold()` moves, and the safe configuration `left/hold` is in force";
    assert!(held.out.contains(why) && !held.out.contains("`left/fold`"), "{}", held.out);
}

/// Asked for before, it is no emergency that came meanwhile: it is held, and all is removed.
#[test]
fn what_is_being_made_safe_when_force_begins_was_so_before() {
    let slow = "fault('operation_call left/Arm.brake', 'slow', 9, 1.5) raise('left/e_estop') wait(0.05)";
    let held = forced("pair.yaml", slow);
    assert!(rested(&held, "right/fold") && !held.out.contains("`left/fold`"), "{}", held.out);
}

#[test]
fn it_is_removed_however_long_coming_to_rest_has_taken() {
    let slow = "fault('operation_call Arm.brake', 'slow', 9, 1.9) fault('operation_call Arm.fold', 'slow', 9, 2.9)";
    for panics in ["", "inject('configurator', 'panic', {}, now() + 2.8)"] {
        let ran = forced("arm.yaml", &format!("{slow} {panics}"));
        assert!(rested(&ran, "fold"), "{panics}: {}", ran.out);
    }
}
