//! An emergency leads back to where it came from: whatever of it was lost, late, slow or not true, however often it was pressed, and whatever it has
//! interrupted. What it has taken the place of is not done again while it is in force, nor when it ends.

use crate::alternatives::{ARM, CHART};
use crate::demo::Demo;

/// The chart of the alternatives, in which something ordinary is asked for, changed for another one, and let go of.
fn chart() -> String {
    let (idle, on) = ("idle: { IDLE }", "idle: {}, on: { config: slow }, on2: { config: fast }");
    let begun = "        - { src: starting, tgt: idle, events: [run.ok] }\n";
    let more = "        - { src: idle, tgt: on, events: [e_slow] }
        - { src: on, tgt: on2, events: [e_fast] }
        - { src: on, tgt: idle, events: [e_off] }\n";
    assert!(CHART.contains(idle) && CHART.contains(begun), "the chart is another one");
    let again = "    - { src: rest, tgt: again, events: [e_reset] }
    - { src: again, tgt: down, events: [e_end] }
    - { src: again, tgt: stopped, events: [e_stop] }
    - { src: again, tgt: halted, events: [e_halt] }\n";
    let rest = "    rest: {}\n    again: { entry: [stop.undo, halt.undo] }\n";
    CHART
        .replace(idle, on)
        .replace(begun, &format!("{begun}{more}"))
        .replace("    rest: {}\n", rest)
        .replace("    - { src: rest, tgt: stopped", &format!("{again}    - {{ src: rest, tgt: stopped"))
}

/// What is made beside the motor `m`, the other configurations, what goes wrong, what comes when, and what is called from the first safety event on.
type Case = (&'static str, [&'static str; 4], &'static str, &'static str, &'static str);

const NOTHING: &str = "changes: [{ property_set: { property: m.limit, value: 0.5 } }]";
const APART: &str = "changes: [{ disconnect: { from: l.o, to: m.ref } }]";
const TOGETHER: &str = "changes: [{ connect: { from: l.o, to: m.ref, policy: data } }]";
const TOGETHER_TOO: &str = "changes: [{ connect: { from: x.o, to: n.ref, policy: data } }]";
const BRAKE: &str = "changes: [{ operation_call: { operation: m.brake } }]";
const CLAMP: &str = "changes: [{ operation_call: { operation: m.clamp } }]";
const LIMIT: &str = "changes: [{ property_set: { property: m.limit, value: 0.1 } }]";
const LIMIT_OPEN: &str = "changes: [{ property_set: { property: m.limit, value: 0.7 } }]";
const STILL: &str = "changes: [{ port_write: { port: m.speed, value: 0.0 } }]";
const OTHER: &str = "changes: [{ property_set: { property: n.limit, value: 0.1 } }]";
const GONE: &str = "changes: [{ destroy: { component: x } }]";
const DOWN: &str = "post_conf_state: [\"m:unconfigured\"]";
const N: &str = "create: { component: n, type: Motor }";
const L: &str = "create: { component: l, type: Lamp }";
const LED: &str = "create: { component: l, type: Lamp } }, { connect: { from: l.o, to: m.ref, policy: data }";

/// `slow`, `fast`, `stop`, `halt`.
const CASES: &[Case] = &[
    // A step fails once, and another one comes: no run state is taken back twice.
    (
        N,
        [
            DOWN,
            NOTHING,
            DOWN,
            "post_conf_state: [\"m:unconfigured\"], changes: [{ operation_call: { operation: m.brake } }]",
        ],
        "fault('operation_call m.brake', 'fail', 1)",
        "slow 0.2 halt 2 stop 3",
        "",
    ),
    // What was not true and was found out is the matter of the one that comes then.
    (LED, [NOTHING, NOTHING, BRAKE, APART], "fault('disconnect l.o', 'lie', 1)", "halt 6 stop 1", "brake release"),
    (
        N,
        [
            "changes: [{ create: { component: k, type: Lamp } }, { connect: { from: k.o, to: m.ref, policy: data } }]",
            NOTHING,
            BRAKE,
            LIMIT,
        ],
        "fault('disconnect k.o', 'lie', 1)",
        "slow 0.2 stop 6 stop 3",
        "brake brake release",
    ),
    // Two at a time: what the later one has done is no part of what the earlier one has left broken.
    (
        "create: { component: x, type: Lamp }",
        ["changes: [{ destroy: { component: x } }, { operation_call: { operation: m.clamp } }]", NOTHING, STILL, LIMIT],
        "fault('create x', 'lost', 1) fault('operation_call m.unclamp', 'lost', 1)",
        "slow 0.2 halt 0.5 stop 3",
        "unclamp",
    ),
    // What an earlier one was to write and did not is nothing that the later one gives back.
    (
        L,
        [TOGETHER, NOTHING, STILL, STILL],
        "fault('port_write m.speed = 0.0', 'lost', 1)",
        "slow 0.2 stop 0 halt 3",
        "",
    ),
    (
        L,
        [TOGETHER, NOTHING, LIMIT, STILL],
        "fault('property_set m.limit', 'lost', 1) fault('disconnect l.o', 'lost', 1)",
        "slow 0.2 stop 0.5 stop 5",
        "",
    ),
    (
        L,
        [
            TOGETHER,
            NOTHING,
            "post_conf_state: [\"m:stopped\"], changes: [{ port_write: { port: m.speed, value: 0.0 } }]",
            STILL,
        ],
        "fault('port_write m.speed = 0.0', 'lost', 1)",
        "slow 0.2 stop 0 halt 7 halt 2",
        "",
    ),
    // What it interrupts has set what it sets as well, and the first press is lost.
    (
        N,
        [
            "changes: [{ property_set: { property: n.limit, value: 0.7 } }, { port_write: { port: m.speed, value: 0.5 } }]",
            NOTHING,
            OTHER,
            LIMIT,
        ],
        "fault('port_write m.speed', 'slow', 1, 0.9) fault('property_set n.limit = 0.1', 'lost', 1)",
        "slow 0.2 stop 0.02 stop 8",
        "",
    ),
    // What the second press has called is taken back, though the first one had it to call, too.
    (
        N,
        [
            NOTHING,
            NOTHING,
            "pre_conf_state: [\"m:stopped\"], changes: [{ operation_call: { operation: m.clamp } }]",
            LIMIT,
        ],
        "fault('stop m', 'late', 1)",
        "stop 0.5 stop 9",
        "clamp unclamp",
    ),
    // What the first one has made safe is not owed to what it has taken the place of, and what the second one makes up for stays done where it fails itself.
    (
        N,
        [
            CLAMP,
            NOTHING,
            "changes: [{ operation_call: { operation: m.clamp } }, { property_set: { property: n.limit, value: 0.1 } }]",
            BRAKE,
        ],
        "fault('property_set n.limit', 'fail', 1)",
        "slow 0.2 stop 2 halt 2",
        "clamp brake release unclamp",
    ),
    (
        N,
        ["post_conf_state: [\"n:running\"]", NOTHING, BRAKE, LIMIT],
        "fault('stop n', 'fail', 1) fault('property_set m.limit', 'fail', 1)",
        "slow 0.2 stop 2 halt 2",
        "brake release",
    ),
    (
        N,
        [
            "changes: [{ port_write: { port: m.speed, value: 0.7 } }]",
            NOTHING,
            LIMIT,
            "changes: [{ port_write: { port: n.speed, value: 0.0 } }]",
        ],
        "fault('port_write m.speed = 0.1', 'fail', 1) fault('property_set m.limit', 'fail', 1)",
        "slow 0.2 halt 1 stop 2",
        "",
    ),
    (
        N,
        [
            "changes: [{ create: { component: k, type: Lamp } }]",
            NOTHING,
            LIMIT,
            "changes: [{ port_write: { port: n.speed, value: 0.0 } }]",
        ],
        "fault('destroy k', 'fail', 1) fault('property_set m.limit', 'fail', 1)",
        "slow 0.2 halt 1 stop 2 stop 2",
        "",
    ),
    // What the first one is still taking back is back for the second one, which sets the same.
    (
        N,
        [
            "changes: [{ port_write: { port: m.speed, value: 0.7 } }], post_conf_state: [\"m:stopped\"]",
            NOTHING,
            STILL,
            "changes: [{ port_write: { port: n.speed, value: 0.0 } }]",
        ],
        "fault('start m', 'slow', 1, 0.9)",
        "slow 0.2 halt 0.3 stop 3",
        "",
    ),
    // A switch of the group, or an undo, is interrupted: its way back does nothing again whose place was taken (what it had called is told
    // when it is answered).
    (
        N,
        [BRAKE, "changes: [{ port_write: { port: n.speed, value: 0.5 } }]", LIMIT, STILL],
        "fault('port_write n.speed', 'slow', 1, 0.8)",
        "slow 0.2 fast 0.05 stop 8",
        "release",
    ),
    (
        N,
        [
            "changes: [{ create: { component: k, type: Lamp } }, { operation_call: { operation: m.clamp } }]",
            "changes: [{ port_write: { port: n.speed, value: 0.5 } }]",
            LIMIT,
            STILL,
        ],
        "fault('port_write n.speed', 'slow', 1, 0.5)",
        "slow 0.2 fast 0.3 stop 3",
        "unclamp",
    ),
    // What it does as well as the one that was being taken back is taken back by its end.
    (
        "create: { component: n, type: Motor } }, { create: { component: l, type: Lamp } }, { connect: { from: l.o, to: m.ref, policy: data }",
        [APART, "changes: [{ port_write: { port: n.speed, value: 0.5 } }]", APART, STILL],
        "fault('port_write n.speed', 'slow', 1, 0.5)",
        "slow 0.2 fast 0.3 stop 3",
        "",
    ),
    (
        "create: { component: n, type: Motor } }, { create: { component: l, type: Lamp }",
        ["post_conf_state: [\"l:running\"]", "changes: [{ port_write: { port: n.speed, value: 0.5 } }]", CLAMP, STILL],
        "fault('port_write n.speed', 'slow', 1, 0.8)",
        "slow 0.2 fast 0.05 stop 8",
        "clamp unclamp",
    ),
    (
        N,
        [
            "changes: [{ operation_call: { operation: m.clamp } }, { port_write: { port: m.speed, value: 0.4 } }]",
            NOTHING,
            OTHER,
            STILL,
        ],
        "fault('port_write m.speed = 0.1', 'slow', 1, 0.8)",
        "slow 0.2 off 0.1 stop 8",
        "unclamp",
    ),
    (
        "create: { component: n, type: Motor } }, { create: { component: l, type: Lamp }",
        [
            "changes: [{ operation_call: { operation: m.clamp } }], post_conf_state: [\"l:running\"]",
            NOTHING,
            OTHER,
            STILL,
        ],
        "fault('operation_call m.unclamp', 'slow', 1, 0.8)",
        "slow 0.2 off 0.1 stop 8",
        "unclamp unclamp",
    ),
    // What it destroys as well is made again by its end, and not by the way back of what it interrupts.
    (
        "create: { component: n, type: Motor } }, { create: { component: x, type: Lamp }",
        [GONE, "changes: [{ port_write: { port: n.speed, value: 0.5 } }]", GONE, STILL],
        "fault('port_write n.speed', 'slow', 1, 0.5)",
        "slow 0.2 fast 0.3 stop 3",
        "",
    ),
    (
        "create: { component: n, type: Motor } }, { create: { component: x, type: Lamp }",
        [
            "changes: [{ destroy: { component: x } }, { port_write: { port: n.speed, value: 0.5 } }]",
            NOTHING,
            "post_conf_state: [\"m:stopped\"], changes: [{ destroy: { component: x } }]",
            STILL,
        ],
        "fault('port_write n.speed', 'slow', 1, 0.5)",
        "slow 0.1 stop 3",
        "",
    ),
    // What the first press is still bringing back is brought back once more, and the motor ends as it was before both.
    (
        N,
        [DOWN, NOTHING, "post_conf_state: [\"m:stopped\"]", STILL],
        "fault('configure m', 'lost', 1)",
        "slow 0.2 stop 0.5 stop 3",
        "",
    ),
    // Two at one instant, the first of which connects again, taking back, what the second one is to cut.
    (
        LED,
        [
            APART,
            "changes: [{ disconnect: { from: l.o, to: m.ref } }, { destroy: { component: l } }]",
            "changes: [{ disconnect: { from: l.o, to: m.ref } }, { destroy: { component: l } }]",
            LIMIT,
        ],
        "raise('e_slow') wait(0.2) fault('destroy l', 'slow', 1, 0.8)",
        "fast 0.3 halt 0 stop 5",
        "",
    ),
    // What it has taken back is taken back also where it interrupts, and something else of that is lost.
    (
        LED,
        [
            "changes: [{ disconnect: { from: l.o, to: m.ref } }], post_conf_state: [\"m:unconfigured\"]",
            LIMIT_OPEN,
            BRAKE,
            LIMIT,
        ],
        "raise('e_slow') wait(0.2) fault('configure m', 'lost', 1) fault('connect l.o', 'lost', 1)",
        "fast 0.05 stop 9",
        "brake release",
    ),
    // What the interrupted one has connected is in its way.
    (
        "create: { component: n, type: Motor } }, { create: { component: l, type: Lamp }",
        [
            "changes: [{ create: { component: k, type: Lamp } }, { connect: { from: k.o, to: m.ref, policy: data } }, { operation_call: { operation: n.clamp } }]",
            NOTHING,
            "changes: [{ connect: { from: l.o, to: m.ref, policy: data } }], post_conf_state: [\"m:stopped\"]",
            STILL,
        ],
        "fault('operation_call n.clamp', 'slow', 1, 0.7)",
        "slow 0.3 stop 3",
        "",
    ),
    // What the interrupted one has out is done when it comes to the same itself.
    (
        N,
        [DOWN, "changes: [{ property_set: { property: n.limit, value: 0.7 } }]", OTHER, STILL],
        "fault('configure m', 'slow', 2, 0.8)",
        "slow 0.2 fast 0.3 stop 5",
        "",
    ),
    (
        N,
        [LIMIT_OPEN, "post_conf_state: [\"m:stopped\"]", DOWN, STILL],
        "fault('stop m', 'slow', 2, 0.8)",
        "slow 0.2 fast 0.2 stop 5",
        "",
    ),
    // What the first press left to the second one, and that did not come to, nobody has done.
    (
        N,
        [
            "changes: [{ port_write: { port: n.speed, value: 0.5 } }]",
            NOTHING,
            "pre_conf_state: [\"m:unconfigured\"]",
            STILL,
        ],
        "fault('port_write n.speed', 'lost', 1) fault('stop m', 'slow', 1, 1.3)",
        "slow 0.2 stop 0.5 stop 5",
        "",
    ),
    (
        LED,
        [
            CLAMP,
            NOTHING,
            "changes: [{ disconnect: { from: l.o, to: m.ref } }], post_conf_state: [\"m:unconfigured\"]",
            "changes: [{ port_write: { port: m.speed, value: 0.0 } }], post_conf_state: [\"m:stopped\"]",
        ],
        "fault('port_write m.speed', 'slow', 1, 2)",
        "slow 0.2 halt 0.02 stop 0.1 halt 9",
        "unclamp",
    ),
    // What the first one has made again, taking back, the second one was to destroy, and did not: it is there.
    (
        "create: { component: l, type: Lamp } }, { create: { component: x, type: Lamp }",
        [
            "changes: [{ destroy: { component: x } }], post_conf_state: [\"m:unconfigured\"]",
            NOTHING,
            "changes: [{ destroy: { component: x } }, { port_write: { port: m.speed, value: 0.0 } }]",
            "changes: [{ operation_call: { operation: m.brake } }]",
        ],
        "raise('e_slow') wait(0.2) fault('configure m', 'late', 1) fault('destroy x', 'fail', 1)",
        "halt 9 stop 1",
        "brake release",
    ),
    // What the first press was to write is written by the third in its place: the second one gives nothing of it back.
    (
        LED,
        [
            APART,
            NOTHING,
            "changes: [{ property_set: { property: m.limit, value: 0.1 } }, { port_write: { port: m.speed, value: 0.0 } }]",
            "changes: [{ property_set: { property: m.limit, value: 0.2 } }, { port_write: { port: m.speed, value: 0.0 } }]",
        ],
        "fault('connect l.o', 'lost', 1)",
        "slow 0.2 stop 0.5 stop 0 halt 9",
        "",
    ),
];

/// Files of these: what is made beside the motor `m`, and `slow`, `fast`, `stop`, `halt`.
fn arm(chart: &str, made: &str, [slow, fast, stop, halt]: &[&str; 4]) -> Demo {
    let operations = "    operations:\n      brake:";
    let limited = "    properties: { limit: { type: float, default: 0.5 } }\n    operations:\n      brake:";
    let demo = Demo::new();
    demo.write("deployment.yaml", &ARM.replace(operations, limited));
    demo.write("k.yaml", chart);
    let text = format!(
        "configurations:
  build: {{ changes: [{{ create: {{ component: m, type: Motor }} }}, {{ {made} }}] }}
  run: {{ pre_conf_state: [\"m:stopped\"], changes: [{{ port_write: {{ port: m.speed, value: 0.1 }} }}], post_conf_state: [\"m:running\"] }}
  slow: {{ group: speed, {slow} }}
  fast: {{ group: speed, {fast} }}
  stop: {{ safe: true, group: speed, {stop} }}
  halt: {{ safe: true, group: speed, {halt} }}
"
    );
    demo.write("c.yaml", &text);
    demo
}

/// Two are asked for in one step, and the first one takes its time: what has not begun does not begin over what was made safe.
#[test]
fn what_stands_behind_what_is_interrupted_does_not_begin() {
    let (letting, and) = ("entry: [stop.undo, halt.undo] }", "entry: [stop.undo, halt.undo, slow.undo, fast.undo] }");
    let chart = chart().replace(letting, and).replace("        - { src: on, tgt: idle, events: [e_off] }\n", "");
    let chart = chart.replace("on: { config: slow }, on2: { config: fast }", "on: { entry: [slow, fast] }, on2: {}");
    let both = ["changes: [{ port_write: { port: n.speed, value: 0.4 } }]", LIMIT_OPEN, LIMIT, STILL];
    let demo = arm(&chart, N, &both);
    demo.replace("c.yaml", "fast: { group: speed, ", "fast: { ");
    demo.write(
        "s.lua",
        "deploy('deployment.yaml') wait(0.2) fault('port_write n.speed', 'slow', 1, 0.3)
         raise('e_slow') wait(0.1) raise('e_stop') wait(1) say('held ' .. property('m.limit'))
         raise('e_reset') wait(1) say('over ' .. property('m.limit') .. ' ' .. #drift() .. ' ' .. #stack()) shutdown()",
    );
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
    let told: Vec<&str> = ran.out.lines().filter(|line| line.starts_with("held") || line.starts_with("over")).collect();
    assert_eq!((told.as_slice(), ran.code), (&["held 0.1", "over 0.5 0 2"][..], 0), "{}{}", ran.out, ran.err);
    assert!(ran.out.contains("slow.failed") && ran.out.contains("fast.cancelled"), "{}", ran.out);
}

/// Where the first one fails in part, what it has written stays while another one comes.
#[test]
fn what_is_made_safe_is_not_owed() {
    let slow = "changes: [{ port_write: { port: m.speed, value: 0.4 } }]";
    let stop = "changes: [{ port_write: { port: m.speed, value: 0.0 } }, { operation_call: { operation: m.brake } }]";
    let demo = arm(&chart(), N, &[slow, NOTHING, stop, LIMIT]);
    demo.write(
        "s.lua",
        "deploy('deployment.yaml') wait(0.2) fault('operation_call m.brake', 'fail', 1)

         raise('e_slow') wait(0.2) raise('e_stop') wait(1) local at = port('m.speed') raise('e_halt')
         for _ = 1, 20 do wait(0.05) if port('m.speed') ~= 0 then at = port('m.speed') end end say(at)
         raise('e_reset') wait(1) say(port('m.speed') .. ' ' .. #stack()) shutdown()",
    );
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
    assert_eq!((ran.out.lines().collect::<Vec<_>>().as_slice(), ran.code), (&["0.0", "0.1 2"][..], 0), "{}", ran.err);
}

/// What is left of what it interrupts is repaired by its own undo, or on the way down: pressed twice, an emergency has nothing to do with that.
#[test]
fn what_is_left_of_what_it_interrupts_is_its_own_matter() {
    let made = "create: { component: n, type: Motor } }, { create: { component: l, type: Lamp } }, { connect: { from: l.o, to: m.ref, policy: data }";
    let slow = "changes: [{ disconnect: { from: l.o, to: m.ref } }, { operation_call: { operation: m.brake } }]";
    for second in ["stop", "halt"] {
        let demo = arm(&chart(), made, &[slow, NOTHING, OTHER, STILL]);
        demo.write(
            "s.lua",
            &format!(
                "deploy('deployment.yaml') wait(0.2) fault('operation_call m.brake', 'late', 1)
                 raise('e_slow') wait(0.2) raise('e_stop') wait(2) raise('e_{second}') wait(8)
                 raise('e_reset') wait(1) local at = stack()
                 say(#at .. ' ' .. at[#at].configuration .. ' ' .. property('n.limit')) shutdown()"
            ),
        );
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
        assert_eq!((ran.out.trim(), ran.code), ("3 slow 0.5", 0), "{second}: {}", ran.err);
    }
}

/// What it interrupts, or takes the place of, has made or unmade the same: it is so while it holds, with *ok*, and back at its end.
#[test]
fn what_is_so_already_counts_as_done() {
    let made = "create: { component: n, type: Motor } }, { create: { component: x, type: Lamp } }, { create: { component: l, type: Lamp } }, { connect: { from: l.o, to: m.ref, policy: data }";
    let cases = [
        ("destroy: { component: x }", "nil nil 1"),
        ("disconnect: { from: l.o, to: m.ref }", "nil unconfigured 0"),
        ("connect: { from: x.o, to: n.ref, policy: data }", "nil unconfigured 2"),
        ("create: { component: k, type: Lamp }", "unconfigured unconfigured 1"),
    ];
    for (act, held) in cases {
        let both = format!("changes: [{{ {act} }}, {{ port_write: {{ port: n.speed, value: 0.5 }} }}]");
        let stop = format!("post_conf_state: [\"m:stopped\"], changes: [{{ {act} }}]");
        // In the middle of it, and after it.
        for slow in [0.5, 0.0] {
            let demo = arm(&chart(), made, &[&both, NOTHING, &stop, STILL]);
            demo.write(
                "s.lua",
                &format!(
                    "local function at()
                       return tostring(state('k')) .. ' ' .. tostring(state('x')) .. ' ' .. #system().connections
                     end
                     deploy('deployment.yaml') wait(0.2) fault('port_write n.speed', 'slow', 1, {slow})
                     raise('e_slow') wait(0.2) raise('e_stop') wait(1) say('held ' .. at() .. ' ' .. #stack())
                     raise('e_reset') wait(0.5) raise('e_reset') wait(0.5)
                     say('over ' .. at() .. ' ' .. #stack() .. ' ' .. #drift()) shutdown()"
                ),
            );
            let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
            let told: Vec<&str> =
                ran.out.lines().filter(|line| line.starts_with("held") || line.starts_with("over")).collect();
            let (held, over) = (format!("held {held} 3"), "over nil unconfigured 1 2 0");
            assert_eq!((told.as_slice(), ran.code), (&[held.as_str(), over][..], 0), "{act}: {}{}", ran.out, ran.err);
            assert!(ran.out.contains("stop.ok"), "{act} {slow}: {}", ran.out);
        }
    }
}

/// What the interrupted one has connected, has out, or has half taken back, keeps nothing of it from being done: *ok*.
#[test]
fn what_is_in_its_way_or_on_its_way_makes_nothing_of_it_broken() {
    let lamps = "create: { component: n, type: Motor } }, { create: { component: l, type: Lamp }";
    let led = "create: { component: n, type: Motor } }, { create: { component: l, type: Lamp } }, { connect: { from: l.o, to: m.ref, policy: data }";
    let connects = "changes: [{ create: { component: k, type: Lamp } }, { connect: { from: k.o, to: m.ref, policy: data } }, { operation_call: { operation: n.clamp } }]";
    let takes_away = "changes: [{ disconnect: { from: l.o, to: m.ref } }, { destroy: { component: l } }]";
    let (makes, makes_running) = (
        "changes: [{ create: { component: k, type: Lamp } }]",
        "changes: [{ create: { component: k, type: Lamp } }], post_conf_state: [\"k:running\"]",
    );
    let writes = "changes: [{ port_write: { port: m.ref, value: 0.0 } }]";
    let (clamp, fast) = ("'operation_call n.clamp', 'slow', 1, 0.7", "raise('e_fast') wait(0.3)");
    let cases = [
        (lamps, [connects, NOTHING, TOGETHER, STILL], clamp, "", "running nil 1", "running nil 0"),
        (lamps, [connects, NOTHING, writes, STILL], clamp, "", "running nil 0", "running nil 0"),
        (
            lamps,
            [DOWN, LIMIT_OPEN, OTHER, STILL],
            "'configure m', 'slow', 2, 0.8",
            fast,
            "running nil 0",
            "running nil 0",
        ),
        (
            lamps,
            [LIMIT_OPEN, "post_conf_state: [\"m:stopped\"]", DOWN, STILL],
            "'stop m', 'slow', 2, 0.8",
            fast,
            "unconfigured nil 0",
            "running nil 0",
        ),
        (
            led,
            [takes_away, OTHER, APART, STILL],
            "'connect l.o', 'slow', 1, 0.8",
            fast,
            "running nil 0",
            "running nil 1",
        ),
        (
            lamps,
            [makes_running, OTHER, makes, STILL],
            "'destroy k', 'slow', 1, 0.8",
            fast,
            "running unconfigured 0",
            "running nil 0",
        ),
        (
            lamps,
            [makes_running, OTHER, makes, STILL],
            "'cleanup k', 'slow', 1, 0.8",
            fast,
            "running unconfigured 0",
            "running nil 0",
        ),
        (
            lamps,
            [makes_running, OTHER, makes, STILL],
            "'start k', 'slow', 1, 0.8",
            "",
            "running unconfigured 0",
            "running nil 0",
        ),
    ];
    for (made, which, fault, more, held, over) in cases {
        let demo = arm(&chart(), made, &which);
        // Where it is switched it was applied wholly.
        let first = if more.is_empty() { 0.3 } else { 1.0 };
        demo.write(
            "s.lua",
            &format!(
                "local function at()
                   return state('m') .. ' ' .. tostring(state('k')) .. ' ' .. #system().connections
                 end
                 deploy('deployment.yaml') wait(0.2) local slow = {{ {fault} }}
                 if {first} < 0.5 then fault(table.unpack(slow)) end
                 raise('e_slow') wait({first}) if {first} > 0.5 then fault(table.unpack(slow)) end
                 {more} raise('e_stop') wait(4) say('held ' .. at() .. ' ' .. #drift()) raise('e_reset') wait(3)
                 raise('e_reset') wait(1) say('over ' .. at() .. ' ' .. #stack()) shutdown()"
            ),
        );
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
        let told: Vec<&str> =
            ran.out.lines().filter(|line| line.starts_with("held") || line.starts_with("over")).collect();
        let (held, over) = (format!("held {held} 0"), format!("over {over} 2"));
        assert_eq!(
            (told.as_slice(), ran.code),
            (&[held.as_str(), &over][..], 0),
            "{which:?} {fault}: {}{}",
            ran.out,
            ran.err
        );
        assert!(ran.out.contains("stop.ok"), "{which:?}: {}", ran.out);
    }
}

/// A switch takes back, late, what the emergency that has interrupted it does as well: while that holds it is as it wants it, and its end leads back.
#[test]
fn what_a_switch_brings_back_late_is_not_left() {
    let made = "create: { component: n, type: Motor } }, { create: { component: x, type: Lamp } }, { create: { component: l, type: Lamp } }, { connect: { from: l.o, to: m.ref, policy: data }";
    let cases = [
        ("post_conf_state: [\"m:stopped\"]", "start m", "stopped unconfigured 1"),
        ("post_conf_state: [\"m:unconfigured\"]", "configure m", "unconfigured unconfigured 1"),
        (APART, "connect l.o", "running unconfigured 0"),
        (TOGETHER_TOO, "disconnect x.o", "running unconfigured 2"),
        (GONE, "create x", "running nil 1"),
        ("changes: [{ create: { component: k, type: Lamp } }]", "destroy k", "running unconfigured 1 k"),
    ];
    for (both, step, held) in cases {
        for (how, fast) in [("'slow', 1, 0.3", NOTHING), ("'slow', 1, 0.3", STILL), ("'late', 1", NOTHING)] {
            let demo = arm(&chart(), made, &[both, fast, both, STILL]);
            demo.write(
                "s.lua",
                &format!(
                    "local function at()
                       return state('m') .. ' ' .. tostring(state('x')) .. ' ' .. #system().connections .. (state('k') and ' k' or '')
                     end
                     deploy('deployment.yaml') wait(0.2) fault('{step}', {how})
                     raise('e_slow') wait(0.2) raise('e_fast') wait(0.05) raise('e_stop') wait(9)
                     say('held ' .. at() .. ' ' .. #drift()) raise('e_reset') wait(2)
                     if #drift() > 0 then recover('back') wait(1) end
                     raise('e_reset') wait(1) say('over ' .. at() .. ' ' .. #stack() .. ' ' .. #drift()) shutdown()"
                ),
            );
            let ran = demo.run(&["run", "s.lua", "--clock", "simulated"]);
            let told: Vec<&str> =
                ran.out.lines().filter(|line| line.starts_with("held") || line.starts_with("over")).collect();
            let (held, over) = (format!("held {held} 0"), "over running unconfigured 1 2 0");
            assert_eq!(told, [held.as_str(), over], "{both} {how} {fast}: {}{}", ran.out, ran.err);
        }
    }
}

#[test]
fn an_emergency_ends_where_it_began() {
    for (made, which, faults, events, calls) in CASES {
        let demo = arm(&chart(), made, which);
        let [slow, fast, stop, halt] = which;
        let words: Vec<&str> = events.split(' ').collect();
        let raised: String = words.chunks(2).map(|two| format!("raise('e_{}') wait({}) ", two[0], two[1])).collect();
        let script = format!(
            "local function same(a, b)
               if type(a) ~= 'table' or type(b) ~= 'table' then return a == b end
               for k, v in pairs(a) do if not same(v, b[k]) then return false end end
               for k in pairs(b) do if a[k] == nil then return false end end
               return true
             end
             deploy('deployment.yaml') wait(0.2) local before = system()
             {faults} {raised}
             raise('e_reset') wait(3) raise('e_reset') wait(1)
             if #drift() > 0 then recover('back') wait(1) end
             say(tostring(same(before, system())) .. ' ' .. #drift() .. ' ' .. #stack()) shutdown()"
        );
        demo.write("s.lua", &script);
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--json"]);
        let lines: Vec<serde_json::Value> =
            ran.out.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        let case = format!("{made} {slow} {fast} {stop} {halt} {faults} {events}\n{}{}", ran.out, ran.err);
        let end = lines.iter().position(|line| line["what"] == "said").unwrap_or_else(|| panic!("no end: {case}"));
        assert_eq!((lines[end]["text"].as_str(), ran.code), (Some("true 0 2"), 0), "{case}");
        let stopped = |line: &&serde_json::Value| {
            line["what"] == "event" && matches!(line["event"].as_str(), Some("e_stop" | "e_halt"))
        };
        let since = lines.iter().find(stopped).and_then(|line| line["at"].as_f64()).expect("a safety event");
        let answers =
            lines[..end].iter().filter(|line| line["what"] == "answered" && line["at"].as_f64() >= Some(since));
        let steps = answers.flat_map(|answer| answer["steps"].as_array().into_iter().flatten());
        let called: Vec<&str> = steps
            .filter(|step| step["outcome"] == "done")
            .filter_map(|step| step["step"].as_str()?.trim_start_matches("undo: ").strip_prefix("operation_call m."))
            .collect();
        assert_eq!(called.join(" "), *calls, "{case}");
    }
}
