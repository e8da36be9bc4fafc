//! What a coordinator has let go of and what stayed all the same goes on the way down: whoever's undo it is in the way of, whichever way
//! it was let go of, and whatever that undo came to.

use crate::demo::Demo;

/// The conveyor of the examples, whose safe configuration writes nothing that `slow` does, with a state where it is paused.
fn conveyor() -> Demo {
    let demo = Demo::new();
    for file in ["conveyor.yaml", "configurations.yaml", "coordinator.yaml"] {
        let text = std::fs::read_to_string(format!("{}/examples/conveyor/{file}", env!("CARGO_MANIFEST_DIR")));
        demo.write(file, &text.unwrap());
    }
    demo.replace("configurations.yaml", "slow:\n    group: speed\n", "slow:\n");
    demo.replace("configurations.yaml", "      - port_write: { port: belt.speed, value: 0.0 }\n", "");
    demo.replace("coordinator.yaml", "config: slow }", "config: slow }\n        paused: {}");
    let pauses = "        - { src: running, tgt: paused, events: [e_pause] }\n    failed: {}";
    demo.replace("coordinator.yaml", "    failed: {}", pauses);
    demo
}

/// `check` has nothing against it (but that what is safe takes back what moves), and it is led down by its coordinators, with `slow` or whatever is named.
fn goes_down(demo: &Demo, script: &str, told: &[&str]) {
    let file = if script.contains("d.yaml") { "d.yaml" } else { "conveyor.yaml" };
    let checked = demo.run(&["check", file]);
    let warned = checked.err.matches('⚠').count();
    assert!(checked.code == 0 && warned == checked.err.matches("conf::safe_moves").count(), "{}", checked.err);
    demo.write("s.lua", script);
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
    let missing: Vec<_> = told.iter().filter(|told| !ran.out.contains(*told)).collect();
    assert!(missing.is_empty(), "{missing:?}\n{}{}", ran.out, ran.err);
    assert_eq!((ran.code, ran.out.contains("forced")), (0, false), "{}{}", ran.out, ran.err);
}

/// By naming its undo, and not by leaving a state that has it as its `config`.
#[test]
fn what_was_to_be_undone_by_its_name_goes_on_the_way_down() {
    let demo = conveyor();
    demo.replace("coordinator.yaml", "{ config: slow }", "{ entry: slow, exit: slow.undo }");
    demo.replace(
        "coordinator.yaml",
        "slow.broken, belt.faulted",
        "slow.broken, slow.undo.failed, slow.undo.broken, belt.faulted",
    );
    let script = "fault('port_write belt.speed', 'slow', 9, 0.2)
        deploy('conveyor.yaml') wait(0.5)
        raise('e_pause') wait(0.05) raise('e_stop') wait(2) shutdown()";
    goes_down(&demo, script, &["slow.undo.failed", "`slow`, whose undo had failed before, was undone with it"]);
}

/// The undo ended *broken*, was mended when the component came back, and nobody asks for it any more.
#[test]
fn what_was_broken_and_came_back_goes_on_the_way_down() {
    let demo = conveyor();
    demo.replace(
        "configurations.yaml",
        "port_write: { port: belt.speed, value: 0.1 }",
        "operation_call: { operation: belt.ease }",
    );
    demo.replace(
        "conveyor.yaml",
        "    operations:\n",
        "    operations:\n      ease:    { effect: { undo: tighten } }\n      tighten: { effect: { undo: ease } }\n",
    );
    demo.replace("coordinator.yaml", "running: { config: slow }", "ready: {}\n        running: { config: slow }");
    demo.replace(
        "coordinator.yaml",
        "tgt: running, events: [run.ok] }",
        "tgt: ready, events: [run.ok] }\n        - { src: ready, tgt: running, events: [e_go] }",
    );
    demo.replace("conveyor.yaml", "up: running", "up: ready");
    let script = "fault('operation_call belt.ease', 'late', 1)
        deploy('conveyor.yaml') raise('e_go') wait(8) shutdown()";
    goes_down(
        &demo,
        script,
        &["slow.broken", "slow.undo.broken", "recovered", "`slow`, whose undo had failed before, was undone with it"],
    );
}

/// What moves and was interrupted is not taken back unasked, though no step fails: `check` says what has to be asked for, and where that is
/// asked for it goes.
#[test]
fn what_moves_and_was_interrupted_has_to_be_asked_for_by_its_name() {
    let demo = Demo::new();
    for file in ["conveyor.yaml", "configurations.yaml", "coordinator.yaml"] {
        let text = std::fs::read_to_string(format!("{}/examples/conveyor/{file}", env!("CARGO_MANIFEST_DIR")));
        demo.write(file, &text.unwrap());
    }
    demo.replace(
        "configurations.yaml",
        "port_write: { port: belt.speed, value: 0.1 }",
        "operation_call: { operation: belt.lock }",
    );
    demo.replace(
        "conveyor.yaml",
        "    operations:\n",
        "    operations:\n      lock:   { moves: true, effect: { undo: unlock } }\n      unlock: { moves: true, effect: { undo: lock } }\n",
    );
    demo.replace("coordinator.yaml", "running: { config: slow }", "ready: {}\n        running: { config: slow }");
    demo.replace(
        "coordinator.yaml",
        "tgt: running, events: [run.ok] }",
        "tgt: ready, events: [run.ok] }\n        - { src: ready, tgt: running, events: [e_go] }",
    );
    demo.replace("conveyor.yaml", "up: running", "up: ready");
    let script = "fault('operation_call belt.lock', 'slow', 1, 0.3)
        deploy('conveyor.yaml') wait(0.5)
        raise('e_go') wait(0.07) raise('e_stop') wait(2)
        raise('e_end') wait(1) shutdown()";
    let checked = demo.run(&["check", "conveyor.yaml"]);
    let flat = checked.err.split_whitespace().filter(|word| *word != "│").collect::<Vec<_>>().join(" ");
    for told in [
        "`run.undo` is refused where something safe comes while `slow` is being applied: `operation_call belt.unlock()` moves and is not done \
         unasked, and `run` cannot be undone before `slow`",
        "ask for `slow.undo` before `run.undo` on every way down",
    ] {
        assert!(checked.code == 0 && checked.err.contains('⚠') && flat.contains(told), "{told}: {}", checked.err);
    }
    demo.write("s.lua", script);
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
    let why = "that is not undone with it: `operation_call belt.unlock()` moves, and `slow.undo` has to be asked for by its name";
    assert!(ran.code == 4 && ran.out.contains(why), "{}{}", ran.out, ran.err);

    demo.replace(
        "coordinator.yaml",
        "stopping: { entry: run.undo }",
        "unlocking: { entry: slow.undo }\n        stopping: { entry: run.undo }",
    );
    demo.replace(
        "coordinator.yaml",
        "src: initial, tgt: stopping }",
        "src: initial, tgt: unlocking }\n        - { src: unlocking, tgt: stopping, events: [slow.undone, slow.undo.failed, slow.undo.broken] }",
    );
    goes_down(&demo, script, &["slow.broken", "slow.undone"]);
}

/// It is in the way of another coordinator's undo alone, when its own has come to its end.
#[test]
fn what_is_in_the_way_of_another_coordinator_goes_on_the_way_down() {
    let demo = conveyor();
    demo.replace("conveyor.yaml", "coordinator: coordinator.yaml", "coordinators: { k: coordinator.yaml, j: j.yaml }");
    demo.replace("conveyor.yaml", "up: running", "up: [k:running, j:running]");
    demo.replace("conveyor.yaml", "    actuator: true\n    moves: [start]\n", "");
    demo.replace(
        "configurations.yaml",
        "configurations:\n",
        "configurations:\n  build_j:\n    changes: [{ create: { component: aux, type: Motor } }]\n",
    );
    demo.replace("configurations.yaml", "belt.speed, value: 0.1", "aux.speed, value: 0.1");
    demo.replace(
        "coordinator.yaml",
        "{ src: initial, tgt: building }",
        "{ src: initial, tgt: waiting }\n        - { src: waiting, tgt: building, events: [e_up] }",
    );
    demo.replace("coordinator.yaml", "        building: {", "        waiting: {}\n        building: {");
    demo.replace(
        "coordinator.yaml",
        "tgt: off, events: [build.undone] }",
        "tgt: off, events: [build.undone], effect: e_down }",
    );
    demo.write(
        "j.yaml",
        "coordinator:
  states:
    off: {}
    building: { entry: build_j }
    running: { entry: e_up }
    failed: {}
    leaving: {}
    down: { entry: build_j.undo }
    left: {}
  transitions:
    - { src: initial, tgt: off }
    - { src: off, tgt: building, events: [e_start] }
    - { src: building, tgt: running, events: [build_j.ok] }
    - { src: building, tgt: failed, events: [build_j.failed, build_j.broken] }
    - { src: building, tgt: down, events: [e_end] }
    - { src: running, tgt: leaving, events: [e_end] }
    - { src: leaving, tgt: down, events: [e_down, \"e_after(1)\"] }
    - { src: failed, tgt: down, events: [e_end] }
    - { src: left, tgt: down, events: [e_end] }
    - { src: down, tgt: off, events: [build_j.undone] }
    - { src: down, tgt: left, events: [build_j.undo.failed, build_j.undo.broken] }
",
    );
    let script = "fault('port_write aux.speed', 'slow', 9, 0.2)
        deploy('conveyor.yaml') wait(0.5)
        raise('e_pause') wait(0.05) raise('e_stop') wait(2) shutdown()";
    goes_down(&demo, script, &["slow.undo.failed", "`slow`, whose undo had failed before, was undone with it"]);
}

/// Something safe whose undo is asked for by its name while it is still being applied, and comes to nothing since it is asked for anew.
#[test]
fn what_is_safe_and_was_let_go_of_before_it_was_there_goes_on_the_way_down() {
    let demo = conveyor();
    demo.replace("configurations.yaml", "    group: speed\n", "");
    demo.replace("coordinator.yaml", "      config: hold\n", "      entry: hold\n      exit: hold.undo\n");
    demo.replace(
        "coordinator.yaml",
        "src: held, tgt: held, events: [e_stop]",
        "src: held, tgt: failed, events: [hold.undo.failed, hold.undo.broken]",
    );
    let script = "fault('operation_call belt.brake', 'slow', 1, 0.1)
        deploy('conveyor.yaml') wait(0.5)
        raise('e_stop') wait(0.02) raise('e_reset') wait(0.02) raise('e_stop') wait(2) shutdown()";
    demo.write("s.lua", script);
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
    assert!(
        ran.out.contains("hold.undo.failed")
            && ran.out.contains("`hold`, `slow`, whose undo had failed before, were undone with it"),
        "{}{}",
        ran.out,
        ran.err
    );
    assert_eq!((ran.code, ran.out.contains("forced")), (0, false), "{}{}", ran.out, ran.err);
}

/// The platform had said that it started, and it did not: the undo that takes that back does not start it first, whatever goes with it.
#[test]
fn what_stands_still_is_not_started_to_be_taken_back() {
    let demo = Demo::new();
    demo.write(
        "d.yaml",
        "davit: 1
name: belt
platform: simulated
types:
  Motor:
    moves: [start]
    ports: { speed: { direction: in, type: float } }
configurations: [c.yaml]
coordinator: k.yaml
deploy:   { event: e_start, up: running, within_s: 5 }
shutdown: { event: e_end, down: off, within_s: 5 }
",
    );
    demo.write(
        "c.yaml",
        "configurations:
  build:
    changes: [{ create: { component: belt, type: Motor } }]
    post_conf_state: [\"belt:running\"]
  slow:
    changes: [{ port_write: { port: belt.speed, value: 0.1 } }]
",
    );
    demo.write(
        "k.yaml",
        "coordinator:
  states:
    off: {}
    building: { entry: build }
    setting: { entry: slow }
    running: {}
    failed: {}
    slowing: { entry: slow.undo }
    leaving: { entry: build.undo }
    left: {}
  transitions:
    - { src: initial, tgt: off }
    - { src: off, tgt: building, events: [e_start] }
    - { src: building, tgt: setting, events: [build.ok] }
    - { src: building, tgt: failed, events: [build.failed, build.broken] }
    - { src: building, tgt: leaving, events: [e_end] }
    - { src: setting, tgt: running, events: [slow.ok] }
    - { src: setting, tgt: failed, events: [slow.failed, slow.broken] }
    - { src: setting, tgt: slowing, events: [e_end] }
    - { src: failed, tgt: slowing, events: [e_end] }
    - { src: running, tgt: slowing, events: [e_end] }
    - { src: slowing, tgt: leaving, events: [slow.undone, slow.undo.failed, slow.undo.broken] }
    - { src: leaving, tgt: off, events: [build.undone] }
    - { src: leaving, tgt: left, events: [build.undo.failed, build.undo.broken] }
    - { src: left, tgt: slowing, events: [e_end] }
",
    );
    let script = |asks: &str| {
        format!(
            "fault('start belt', 'lie', 1) deploy('d.yaml') wait(6) {asks} wait(1)
             for _, entry in ipairs(log{{ since = 5.5 }}) do
               for _, done in ipairs(entry.steps or {{}}) do assert(done.step ~= 'start belt', 'it is started') end
             end
             shutdown()"
        )
    };
    let kept = "`slow`, whose undo had failed before, was undone with it";
    goes_down(&demo, &script("raise('e_end')"), &["build.undone", kept]);
    goes_down(&demo, &script("fault('port_write belt.speed', 'fail', 2) raise('e_end')"), &["build.undone", kept]);
    // An undo that is refused, for what stands in its way, has not started it either.
    let refused = "`build` cannot be undone before `slow`";
    goes_down(
        &demo,
        &script("undo('build', { force = true }) wait(0.1)"),
        &["build.undo.failed", refused, "build.undone"],
    );
}
