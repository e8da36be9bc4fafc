//! Safe configurations that come at one instant, beside one another that hangs, or on top of something that is being done: what each comes to on
//! the platform.

use crate::demo::Demo;

const CELL: &str = r#"davit: 1
name: cell
platform: simulated
types:
  Motor:
    ports:
      speed: { direction: in, type: float }
      pos:   { direction: out, type: float }
      w:     { direction: in, type: float }
    properties: { limit: { type: float, default: 0.5 }, k: { type: float, default: 1.0 } }
    operations:
      brake:   { effect: { undo: release } }
      release: { effect: { undo: brake } }
configurations: [conf.lua]
coordinator: a.yaml
deploy: { event: e_start, up: up, within_s: 5 }
shutdown: { event: e_end, down: off, within_s: 5 }
"#;

const COORDINATOR: &str = r#"coordinator:
  states: { off: {}, building: { entry: build }, up: {}, halved: { entry: half }, back: { entry: half.undo }, down: { entry: build.undo } }
  transitions:
    - { src: initial, tgt: off }
    - { src: off, tgt: building, events: [e_start] }
    - { src: building, tgt: up, events: [build.ok, build.failed, build.broken, build.cancelled] }
    - { src: building, tgt: down, events: [e_end] }
    - { src: up, tgt: down, events: [e_end] }
    - { src: up, tgt: halved, events: [e_half] }
    - { src: halved, tgt: back, events: [e_end] }
    - { src: back, tgt: down, events: [half.undone, half.undo.failed, half.undo.broken] }
    - { src: down, tgt: off, events: [build.undone] }
    - { src: down, tgt: up, events: [build.undo.failed, build.undo.broken] }
"#;

const CONFIGURATIONS: &str = r#"return ConfiguratorConf {
  build = Configuration { create("l","Motor"), create("r","Motor"), port_write("r.speed",0.1) },
  gentle = Configuration { group="pm", property_set("l.limit",0.2), property_set("r.limit",0.25) },
  still = Configuration { safe=true, group="pm", property_set("l.limit",0.01), property_set("r.limit",0.02) },
  freeze = Configuration { safe=true, group="ice", property_set("l.limit",0.0), property_set("l.k",0.0) },
  stop = Configuration { safe=true, port_write("r.speed",0.0), operation_call("r.brake") },
  join = Configuration { connect("l.pos","r.w") },
  tune = Configuration { property_set("r.k",2.0) },
  half = Configuration { on_failure="hold", property_set("l.k",3.0), operation_call("l.brake") },
}
"#;

/// What a script says, on the simulated clock; what is left over at the end is nothing to these.
fn said(script: &str) -> Vec<String> {
    let demo = Demo::new();
    for (name, text) in [("cell.yaml", CELL), ("a.yaml", COORDINATOR), ("conf.lua", CONFIGURATIONS)] {
        demo.write(name, text);
    }
    demo.write("own.lua", &format!("deploy('cell.yaml') {script} say('end') pcall(shutdown, {{force = true}})"));
    let ran = demo.run(&["run", "own.lua", "--clock", "simulated", "--quiet"]);
    let told =
        ran.out.lines().take_while(|line| *line != "end").filter(|line| !line.starts_with("note ")).map(str::to_owned);
    let told: Vec<String> = told.collect();
    assert!(ran.out.lines().any(|line| line == "end"), "{}{}", ran.out, ran.err);
    told
}

/// `freeze` comes again while `still` takes the place of `gentle` below it, and both end at one moment: what the one hands over to the other has
/// a taker.
#[test]
fn two_that_end_at_one_moment_leave_a_stack_that_leads_back() {
    let told = said(
        "apply('gentle', {force = true}) wait(1) apply('freeze') wait(1) apply('still') apply('freeze') wait(1)
         undo('still') wait(1) say('held ' .. property('l.limit')) undo('freeze') wait(1)
         say('free ' .. property('l.limit') .. ' ' .. property('r.limit') .. ' ' .. property('l.k'))",
    );
    assert_eq!(told, ["held 0.0", "free 0.5 0.5 1.0"]);
}

/// A call of `l` does not come back: what is made safe at `r` is so at once, by the same configuration and by another one, which is answered as what
/// it has come to itself.
#[test]
fn one_that_hangs_elsewhere_keeps_none_waiting() {
    let told = said(
        "apply('gentle', {force = true}) wait(1) fault('property_set l.limit', 'hang', 1) apply('still') wait(0.05)
         apply('stop') wait(0.01) say('speed ' .. port('r.speed') .. ' ' .. property('r.limit')) wait_answer('stop.ok', 2)
         for _, frame in ipairs(stack()) do say(frame.configuration .. ' ' .. tostring(frame.partial)) end",
    );
    assert_eq!(told, ["speed 0.0 0.02", "build false", "still true", "stop false"]);
}

/// What it had said to be done is not, and is found so with what it has interrupted: it is written again, and not taken for what was there before.
#[test]
fn what_it_said_to_be_done_is_not_forgotten_with_what_it_has_interrupted() {
    let told = said(
        "fault('property_set l.k', 'slow', 1, 0.2) fault('property_set l.k', 'late', 1) fault('property_set l.k', 'lie', 1)
         apply('half', {force = true}) wait(0.14) apply('freeze') wait(12) say('k ' .. property('l.k') .. ' ' .. #drift())
         undo('freeze') wait(1) say('k ' .. property('l.k'))",
    );
    assert_eq!(told, ["k 0.0 0", "k 1.0"]);
}

/// `half` breaks while a connection to `r` is there that was said to be gone, and `r` is being set: that is no part of what differs.
#[test]
fn what_is_at_the_other_end_of_a_connection_is_left_alone() {
    let told = said(
        "apply('join', {force = true}) wait(1) fault('disconnect l.pos -> r.w', 'lie') undo('join') wait_answer('join.undone', 1)
         fault('property_set r.k', 'slow', 1, 0.3) apply('tune', {force = true})
         fault('operation_call l.brake', 'fail', 1) raise('e_half') wait_answer('half.broken', 0.1) wait_answer('tune.ok', 1)
         for _, one in ipairs(drift()) do say(one.text) end
         recover('back') say('k ' .. property('r.k') .. ' ' .. #drift())",
    );
    assert_eq!(told, ["connect l.pos -> r.w (data)", "k 2.0 0"]);
}
