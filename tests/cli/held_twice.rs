//! What is safe stays in force where the state that has it is entered anew: an emergency that is heard twice lets nothing go.

use crate::demo::Demo;

const DEPLOYMENT: &str = "davit: 1
name: twice
platform: simulated
types:
  Motor:
    actuator: true
    operations:
      release: { effect: { undo: brake } }
      brake:   { effect: { undo: release } }
configurations: [c.yaml]
coordinator: k.yaml
safety: [e_estop]
deploy:   { event: e_start, up: on, within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";

const CONFIGURATIONS: &str = "configurations:
  build: { changes: [{ create: { component: m, type: Motor } }], post_conf_state: [\"m:running\"] }
  ease:  { GROUP changes: [{ operation_call: { operation: m.release } }] }
  hold:  { safe: true, GROUP changes: [{ operation_call: { operation: m.brake } }] }
";

const COORDINATOR: &str = "coordinator:
  states:
    idle: {}
    alive:
      states:
        building: { entry: build }
        on: { config: ease }
        failed: {}
        held: { HELD }
        other: { HELD }
      transitions:
        - { src: initial, tgt: building }
        - { src: building, tgt: on, events: [build.ok] }
        - { src: building, tgt: failed, events: [build.failed, build.broken] }
        - { src: building, tgt: held, events: [e_estop] }
        - { src: on, tgt: held, events: [e_estop] }
        - { src: on, tgt: failed, events: [ease.failed, ease.broken] }
        - { src: failed, tgt: held, events: [e_estop] }
        - { src: held, tgt: held, events: [e_estop] }
        - { src: held, tgt: other, events: [e_other] }
        - { src: other, tgt: held, events: [e_estop] }
        - { src: held, tgt: failed, events: [e_reset, hold.failed, hold.broken] }
        - { src: other, tgt: failed, events: [e_reset, hold.failed, hold.broken] }
    leaving:
      states: { dropping: { entry: hold.undo }, destroying: { entry: build.undo } }
      transitions:
        - { src: initial, tgt: dropping }
        - { src: dropping, tgt: destroying, events: [hold.undone, hold.undo.failed, hold.undo.broken] }
  transitions:
    - { src: initial, tgt: idle }
    - { src: idle, tgt: alive, events: [e_start] }
    - { src: alive, tgt: leaving, events: [e_shutdown] }
    - { src: leaving, tgt: .alive.held, events: [e_estop] }
    - { src: leaving, tgt: idle, events: [build.undone] }
    - { src: leaving, tgt: .alive.failed, events: [build.undo.failed, build.undo.broken] }
";

#[test]
fn an_emergency_that_is_heard_again_lets_nothing_go() {
    for (group, held) in [
        ("group: g,", "config: hold"),
        ("group: g,", "entry: hold, exit: hold.undo"),
        ("", "config: hold"),
        ("", "entry: hold, exit: hold.undo"),
    ] {
        let demo = Demo::new();
        demo.write("deployment.yaml", DEPLOYMENT);
        demo.write("c.yaml", &CONFIGURATIONS.replace("GROUP", group));
        let mut coordinator = COORDINATOR.replace("HELD", held);
        if group.is_empty() {
            // Beside each other they would be in each other's way.
            coordinator =
                coordinator.replace("on: { config: ease }", "on: {}").replace("[ease.failed, ease.broken]", "[e_bad]");
        }
        demo.write("k.yaml", &coordinator);
        let script = "deploy('deployment.yaml')
            for _, event in ipairs({ 'e_estop', 'e_estop', 'e_other', 'e_estop', 'e_estop' }) do
              raise(event) wait(0.3)
              local holds = 0
              for _, frame in ipairs(stack()) do if frame.configuration == 'hold' then holds = holds + 1 end end
              say(event .. ': ' .. holds)
            end
            for _, it in ipairs(log()) do
              if it.what == 'answered' then say(it.answer) end
            end
            shutdown()";
        demo.write("story.lua", script);
        let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--json"]);
        let told = |what: &str| ran.out.matches(what).count();
        assert_eq!((told("e_estop: 1"), told("e_other: 1")), (4, 1), "{group} {held}: {}{}", ran.out, ran.err);
        // What is in the way of its group is released by nothing in between.
        let since = ran.out.find("hold.ok").unwrap_or_default();
        let until = ran.out.find("shutting_down").unwrap_or(ran.out.len());
        assert!(!ran.out[since..until].contains("m.release\",\"outcome"), "{group} {held}: {}", ran.out);
    }
}
