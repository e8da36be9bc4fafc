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

pub const ARM: &str = "davit: 1
name: arm
platform: simulated
types:
  Motor:
    actuator: true
    moves: [start]
    ports: { speed: { direction: in, type: float }, ref: { direction: in, type: float } }
    operations:
      brake: { effect: { undo: release } }
      release: { effect: { undo: brake } }
      clamp: { effect: { undo: unclamp } }
      unclamp: { effect: { undo: clamp } }
  Lamp: { ports: { o: { direction: out, type: float } } }
configurations: [c.yaml]
coordinator: k.yaml
safety: [e_stop, e_halt]
deploy: { event: e_start, up: up.idle, failed: [failed], within_s: 5 }
shutdown: { event: e_end, down: off, within_s: 30 }
";

pub const CHART: &str = "coordinator:
  states:
    off: {}
    up:
      states: { building: { entry: build }, starting: { entry: run }, idle: { IDLE } }
      transitions:
        - { src: initial, tgt: building }
        - { src: building, tgt: starting, events: [build.ok] }
        - { src: starting, tgt: idle, events: [run.ok] }
    rest: {}
    failed: {}
    left: {}
    stopped: { config: stop }
    halted: { config: halt }
    down:
      states:
        letting: { entry: [stop.undo, halt.undo] }
        stopping: { entry: run.undo }
        removing: { entry: build.undo }
      transitions:
        - { src: initial, tgt: letting }
        - { src: letting, tgt: stopping, events: [stop.undone, stop.undo.failed, stop.undo.broken] }
        - { src: stopping, tgt: removing, events: [run.undone, run.undo.failed, run.undo.broken] }
  transitions:
    - { src: initial, tgt: off }
    - { src: off, tgt: up, events: [e_start] }
    - { src: up, tgt: failed, events: [build.failed, build.broken, run.failed, run.broken, slow.failed, slow.broken] }
    - { src: up, tgt: stopped, events: [e_stop] }
    - { src: up, tgt: halted, events: [e_halt] }
    - { src: up, tgt: down, events: [e_end] }
    - { src: rest, tgt: down, events: [e_end] }
    - { src: rest, tgt: stopped, events: [e_stop] }
    - { src: rest, tgt: halted, events: [e_halt] }
    - { src: failed, tgt: stopped, events: [e_stop] }
    - { src: failed, tgt: halted, events: [e_halt] }
    - { src: failed, tgt: down, events: [e_end] }
    - { src: left, tgt: stopped, events: [e_stop] }
    - { src: left, tgt: halted, events: [e_halt] }
    - { src: left, tgt: down, events: [e_end] }
    - { src: down, tgt: stopped, events: [e_stop] }
    - { src: down, tgt: halted, events: [e_halt] }
    - { src: stopped, tgt: stopped, events: [e_stop] }
    - { src: stopped, tgt: halted, events: [e_halt] }
    - { src: stopped, tgt: down, events: [e_end] }
    - { src: halted, tgt: stopped, events: [e_stop] }
    - { src: halted, tgt: halted, events: [e_halt] }
    - { src: halted, tgt: down, events: [e_end] }
    - { src: stopped, tgt: rest, events: [e_reset] }
    - { src: halted, tgt: rest, events: [e_reset] }
    - { src: down, tgt: off, events: [build.undone] }
    - { src: down, tgt: left, events: [build.undo.failed, build.undo.broken] }
";

/// What the first one did not come to is made up for by the one that takes its place: what it was to take back of something that is not safe, and what
/// it has out. What nobody knows of it stands in nobody's way who lets go.
#[test]
fn what_the_first_one_missed_is_made_up_for_and_the_end_takes_all_of_it_back() {
    let motor = "build: { changes: [{ create: { component: m, type: Motor } }] }";
    let both = "build: { changes: [{ create: { component: m, type: Motor } }, { create: { component: l, type: Lamp } },
      { connect: { from: l.o, to: m.ref, policy: data } }] }";
    let run = "run: { pre_conf_state: [\"m:stopped\"], post_conf_state: [\"m:running\"] }";
    let starts = "run: { pre_conf_state: [\"m:stopped\"] }";
    let group = "safe: true, group: speed";
    let slow = "slow: { group: speed, changes: [{ port_write: { port: m.speed, value: 0.4 } }] }";
    let clamped = "slow: { group: speed, changes: [{ port_write: { port: m.speed, value: 0.4 } }, { operation_call: { operation: m.clamp } }] }";
    let driven = "slow: { group: speed, changes: [{ port_write: { port: m.speed, value: 0.4 } }], post_conf_state: [\"m:running\"] }";
    let safe = |name: &str, what: &str| format!("{name}: {{ {group}, {what} }}");
    let brake = "changes: [{ operation_call: { operation: m.brake } }]";
    let apart = "changes: [{ disconnect: { from: l.o, to: m.ref } }]";
    let clamp = "changes: [{ operation_call: { operation: m.clamp } }], post_conf_state: [\"m:stopped\"]";
    let still = "changes: [{ port_write: { port: m.speed, value: 0.0 } }]";
    let down = "post_conf_state: [\"m:unconfigured\"]";
    let away = "changes: [{ port_write: { port: m.speed, value: 0.0 } }, { operation_call: { operation: m.clamp } },
      { disconnect: { from: l.o, to: m.ref } }]";
    let lost = |step: &str| format!("fault('{step}', 'lost', 1)");
    let fails = |step: &str| format!("fault('{step}', 'fail', 1)");
    // What there is, what `stop` and `halt` do, what goes wrong, what comes when, and how it is while it is held, and after the end.
    let table = [
        (
            [both, run, slow],
            "",
            apart,
            brake,
            lost("operation_call m.brake"),
            "halt 2 stop 2 halt 3",
            "running nil 0",
            "running nil 1 0",
        ),
        (
            [both, run, slow],
            "",
            apart,
            brake,
            lost("operation_call m.brake"),
            "halt 0.5 stop 0.5 halt 3",
            "running nil 0",
            "running nil 1 0",
        ),
        (
            [both, run, slow],
            "",
            apart,
            brake,
            lost("disconnect l.o"),
            "stop 0.5 stop 3",
            "running nil 0",
            "running nil 1 0",
        ),
        (
            [motor, run, slow],
            "config: slow",
            still,
            brake,
            fails("port_write m.speed"),
            "stop 0.5 halt 2",
            "running nil 0",
            "running nil 0 0",
        ),
        (
            [motor, run, clamped],
            "config: slow",
            brake,
            still,
            fails("port_write m.speed"),
            "stop 0.5 stop 2",
            "running nil 0",
            "running nil 0 0",
        ),
        (
            [motor, starts, driven],
            "config: slow",
            brake,
            still,
            fails("stop m"),
            "stop 0.5 stop 2",
            "stopped nil 0",
            "stopped nil 0 0",
        ),
        (
            [motor, run, slow],
            "",
            down,
            clamp,
            lost("operation_call m.clamp"),
            "halt 0.05 stop 2",
            "unconfigured nil 0",
            "running nil 0 0",
        ),
        // What another one has made safe is not what a broken one was to take back.
        (
            [both, run, slow],
            "",
            brake,
            away,
            fails("operation_call m.brake"),
            "halt 1 stop 2 stop 2",
            "running 0.0 0",
            "running nil 1 0",
        ),
        (
            [both, run, slow],
            "",
            brake,
            apart,
            lost("operation_call m.brake"),
            "halt 1 stop 2 stop 2",
            "running nil 0",
            "running nil 1 0",
        ),
        (
            [both, run, slow],
            "config: slow",
            brake,
            away,
            lost("operation_call m.brake"),
            "halt 1 stop 2 halt 2 stop 1",
            "running 0.0 0",
            "running nil 1 0",
        ),
    ];
    for (base, idle, stop, halt, fault, events, held, end) in table {
        let demo = Demo::new();
        demo.write("deployment.yaml", ARM);
        demo.write("k.yaml", &CHART.replace("IDLE", idle));
        let all = [base.map(str::to_owned).to_vec(), vec![safe("stop", stop), safe("halt", halt)]].concat();
        demo.write("c.yaml", &format!("configurations:\n  {}\n", all.join("\n  ")));
        let words: Vec<&str> = events.split(' ').collect();
        let raised: Vec<String> =
            words.chunks(2).map(|two| format!("raise('e_{}') wait({})", two[0], two[1])).collect();
        let script = format!(
            "local function told(more) say(state('m') .. ' ' .. tostring(port('m.speed')) .. ' ' .. #system().connections .. more) end
             deploy('deployment.yaml') wait(0.2) {fault} {}
             told('')
             raise('e_reset') wait(3)
             told(' ' .. #drift())
             shutdown()",
            raised.join(" ")
        );
        demo.write("s.lua", &script);
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
        let told: Vec<&str> = ran.out.lines().collect();
        assert_eq!((told.as_slice(), ran.code), (&[held, end][..], 0), "{all:#?} {fault} {events}\n{}", ran.err);
    }
}

/// What has been taken back when the first one failed is not called once more by who comes again, and its end calls nothing that nobody has asked for.
#[test]
fn what_was_taken_back_already_is_called_no_more() {
    let motor = "build: { changes: [{ create: { component: m, type: Motor } }] }";
    let run = "run: { pre_conf_state: [\"m:stopped\"], post_conf_state: [\"m:running\"] }";
    let clamped = "slow: { group: speed, changes: [{ port_write: { port: m.speed, value: 0.4 } }, { operation_call: { operation: m.clamp } }] }";
    let unclamped = "slow: { group: speed, changes: [{ operation_call: { operation: m.clamp } }] }";
    let down = "slow: { group: speed, post_conf_state: [\"m:unconfigured\"] }";
    let brake = "safe: true, group: speed, changes: [{ operation_call: { operation: m.brake } }]";
    // It does itself what takes the other one back, too.
    let opens = "safe: true, group: speed, changes: [{ operation_call: { operation: m.unclamp } }, { property_set: { property: m.limit, value: 1.0 } }]";
    let away = "safe: true, group: speed, post_conf_state: [\"m:unconfigured\"]";
    let table = [
        (clamped, brake, brake, "port_write m.speed", "stop", "unclamp brake | release"),
        (clamped, brake, brake, "operation_call m.brake", "stop", "unclamp |"),
        (clamped, brake, brake, "operation_call m.brake", "stop stop", "unclamp | brake | release"),
        (clamped, brake, brake, "operation_call m.unclamp", "stop", "brake | release unclamp"),
        (clamped, brake, brake, "operation_call m.unclamp", "stop stop", "brake | unclamp brake | release"),
        (clamped, brake, brake, "operation_call m.unclamp", "stop halt", "brake | unclamp brake | release"),
        (unclamped, opens, brake, "property_set m.limit", "stop", "unclamp unclamp | clamp"),
        (unclamped, opens, brake, "property_set m.limit", "stop halt", "unclamp unclamp | brake | release clamp"),
        (
            down,
            away,
            &format!("{away}, changes: [{{ operation_call: {{ operation: m.brake }} }}]"),
            "operation_call m.brake",
            "halt stop",
            "| |",
        ),
    ];
    for (slow, stop, halt, fails, events, calls) in table {
        let demo = Demo::new();
        let limit = "    operations:\n      brake:";
        let properties = "    properties: { limit: { type: float, default: 5.0 } }\n    operations:\n      brake:";
        demo.write("deployment.yaml", &ARM.replace(limit, properties));
        demo.write("k.yaml", &CHART.replace("IDLE", "config: slow"));
        let all = [motor, run, slow, &format!("stop: {{ {stop} }}"), &format!("halt: {{ {halt} }}")].join("\n  ");
        demo.write("c.yaml", &format!("configurations:\n  {all}\n"));
        let raised: String = events.split(' ').map(|event| format!("raise('e_{event}') wait(2) ")).collect();
        let script = format!(
            "deploy('deployment.yaml') wait(0.2) fault('{fails}', 'fail', 1) {raised}
             raise('e_reset') wait(3) say(state('m') .. ' ' .. tostring(port('m.speed')) .. ' ' .. #drift()) shutdown()"
        );
        demo.write("s.lua", &script);
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--json"]);
        let lines: Vec<serde_json::Value> =
            ran.out.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        let end = lines.iter().position(|line| line["what"] == "said").expect("it has come to its end");
        assert_eq!(
            (lines[end]["text"].as_str(), ran.code),
            (Some("running nil 0"), 0),
            "{all} {fails} {events}\n{}",
            ran.out
        );
        let answers = lines[..end].iter().filter(|line| {
            let of = line["answer"].as_str().unwrap_or_default();
            line["what"] == "answered" && (of.starts_with("stop") || of.starts_with("halt"))
        });
        let called: Vec<String> = answers
            .map(|answer| {
                let done = answer["steps"].as_array().into_iter().flatten().filter(|step| step["outcome"] == "done");
                let call =
                    done.filter_map(|step| step["step"].as_str()?.strip_prefix("operation_call m.").map(str::to_owned));
                call.collect::<Vec<String>>().join(" ")
            })
            .filter(|calls| !calls.is_empty())
            .collect();
        let wanted: Vec<&str> = calls.split('|').map(str::trim).filter(|calls| !calls.is_empty()).collect();
        assert_eq!(called, wanted, "{all} {fails} {events}\n{}", ran.out);
    }
}
