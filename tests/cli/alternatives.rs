//! Two safe configurations of one group, different ones: what the one has made safe stays so when the other one comes, however quickly they come and
//! whatever of them does not answer; and the end of the emergency takes all of it back.

use crate::demo::Demo;
use crate::emergency::{belt, said};

/// A belt that `stop` brakes and brings to a stop, and `halt` does something else to as well.
fn with_halt(halt: &str) -> Demo {
    let demo = belt();
    let stop = "      - operation_call: { operation: motor.brake }\n";
    let halt =
        format!("{stop}    post_conf_state: [\"motor:stopped\"]\n  halt:\n    safe: true\n    group: speed\n{halt}");
    demo.replace("belt/configurations.yaml", stop, &halt);
    let lock = "    operations:\n      lock: { effect: { undo: unlock } }\n      unlock: { effect: { undo: lock } }\n";
    demo.replace("belt/deployment.yaml", "    operations:\n", lock);
    demo.replace("belt/deployment.yaml", "safety: [e_stop]", "safety: [e_stop, e_halt]");
    let also = "    - { src: up, tgt: halted, events: [e_halt] }
    - { src: stopped, tgt: halted, events: [e_halt] }
    - { src: halted, tgt: halted, events: [e_halt] }
    - { src: halted, tgt: stopped, events: [e_stop] }
    - { src: halted, tgt: failed, events: [e_reset] }
    - { src: failed, tgt: halted, events: [e_halt] }
    - { src: down, tgt: halted, events: [e_halt] }
    - { src: left, tgt: halted, events: [e_halt] }
    - { src: halted, tgt: down, events: [e_end] }
    - { src: up, tgt: stopped, events: [e_stop] }\n";
    demo.replace("belt/coordinator.yaml", "    - { src: up, tgt: stopped, events: [e_stop] }\n", also);
    demo.replace("belt/coordinator.yaml", "    failed: {}\n", "    failed: {}\n    halted: { config: halt }\n");
    // What it brought to rest has to be let go of by its name before anything else is taken back.
    let letting = "letting: { entry: stop.undo }\n        stopping: { entry: run.undo }";
    demo.replace("belt/coordinator.yaml", "stopping: { entry: run.undo }", letting);
    let then = "{ src: initial, tgt: letting }
        - { src: letting, tgt: stopping, events: [stop.undone, stop.undo.failed, stop.undo.broken] }";
    demo.replace("belt/coordinator.yaml", "{ src: initial, tgt: stopping }", then);
    demo
}

/// Speed and brake; another lock and the end of the motion; a limit and a lock, and the motion goes on.
const HALTS: [&str; 3] = [
    "    changes:
      - port_write: { port: motor.speed, value: 0.0 }
      - operation_call: { operation: motor.brake }\n",
    "    changes:
      - port_write: { port: motor.speed, value: 0.0 }
      - operation_call: { operation: motor.lock }
    post_conf_state: [\"motor:stopped\"]\n",
    "    changes:
      - property_set: { property: motor.limit, value: 0.1 }
      - operation_call: { operation: motor.lock }\n",
];

#[test]
fn what_one_has_made_safe_stays_when_another_one_of_its_group_comes() {
    for halt in HALTS {
        let demo = with_halt(halt);
        let lines = said(
            &demo,
            "deploy('deployment.yaml') wait(0.1)
             for _, event in ipairs{ 'e_stop', 'e_halt', 'e_stop', 'e_halt' } do
               raise(event) wait(0.5)
               say(state('motor') .. ' ' .. tostring(port('motor.speed')))
             end
             for _, it in ipairs(log()) do
               for _, step in ipairs(it.steps or {}) do
                 if it.answer and it.at > 0.05 then say(it.answer .. ' ' .. step.step) end
               end
             end
             shutdown()",
        );
        assert_eq!(lines[..4], ["stopped 0.0"; 4], "{halt}{lines:#?}");
        let lets_go =
            |line: &&String| ["start motor", "motor.release", "motor.unlock"].iter().any(|step| line.contains(step));
        let undone = |line: &&String| line.contains(".undone");
        assert!(!lines.iter().filter(|line| !undone(line)).any(|line| lets_go(&line)), "{halt}{lines:#?}");
    }
}

/// With one step that fails, is lost or is slow, and two or three that come at one instant, or one a tenth of a second after the other: one frame is in
/// force, and its undo leads to where the motor was, without force.
#[test]
fn however_they_come_and_whatever_fails_the_end_takes_all_of_it_back() {
    let faults = [
        "",
        "fault('operation_call motor.brake', 'fail', 1)",
        "fault('operation_call motor.brake', 'lost', 1)",
        "fault('port_write motor.speed', 'lost', 1)",
        "fault('port_write motor.speed', 'slow', 1, 0.3)",
        "fault('stop motor', 'slow', 1, 0.3)",
        "fault('stop motor', 'fail', 1)",
        "fault('stop motor', 'lost', 1)",
    ];
    let orders =
        ["'e_stop', 'e_halt'", "'e_halt', 'e_stop'", "'e_halt', 'e_stop', 'e_stop'", "'e_stop', 'e_halt', 'e_halt'"];
    for (turn, halt) in HALTS.iter().enumerate() {
        let demo = with_halt(halt);
        for (at, fault) in faults.iter().enumerate() {
            for (gap, order) in [(0.0, orders[(at + turn) % 4]), (0.1, orders[(at + turn + 2) % 4])] {
                let script = format!(
                    "deploy('deployment.yaml') wait(0.1) {fault}
                     for _, event in ipairs{{ {order} }} do raise(event) wait({gap}) end
                     wait(8)
                     local function frames()
                       local all = {{}}
                       for _, it in ipairs(stack()) do all[#all + 1] = it.configuration end
                       return table.concat(all, ' ')
                     end
                     say(frames():match('(%S+)$') .. ' ' .. #stack())
                     raise('e_reset') wait(2)
                     say(state('motor') .. ' ' .. tostring(port('motor.speed')) .. ' ' .. property('motor.limit') .. ' ' .. #drift() .. ' ' .. frames())
                     shutdown()"
                );
                let lines = said(&demo, &script);
                let last = if order.ends_with("e_halt'") { "halt 3" } else { "stop 3" };
                let case = format!("{halt}{fault} {order} {gap}");
                assert_eq!(lines, [last, "running nil 0.5 0 build run"], "{case}");
            }
        }
    }
}
