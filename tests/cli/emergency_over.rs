//! When an emergency is over it is as it was before, where the same is in force: several safe configurations at one instant, let go of by something
//! ordinary, pressed again while one of their steps is out, with what else failed meanwhile. What would move is told and left to who recovers.

use crate::demo::Demo;

const DEPLOYMENT: &str = "davit: 1
name: over
platform: simulated
types:
  Motor:
    actuator: true
    moves: [start]
    properties: { limit: { type: float, default: 0.5 } }
    ports: { speed: { direction: in, type: float }, ref: { direction: in, type: float } }
    operations:
      clamp: { effect: { undo: unclamp } }
      unclamp: { effect: { undo: clamp } }
      brake: { effect: { undo: release } }
      release: { effect: { undo: brake } }
  Lamp: { ports: { o: { direction: out, type: float } } }
configurations: [configurations.yaml]
coordinator: coordinator.yaml
safety: [e_stop, e_halt]
deploy: { event: e_start, up: up.idle, failed: [failed], within_s: 5 }
shutdown: { event: e_end, down: off, within_s: 5 }
";

const COORDINATOR: &str = "coordinator:
  states:
    off: {}
    up:
      states:
        building: { entry: build }
        starting: { entry: run }
        idle: {}
        slowly: { entry: slow }
        quickly: { config: quick }
      transitions:
        - { src: initial, tgt: building }
        - { src: building, tgt: starting, events: [build.ok] }
        - { src: starting, tgt: idle, events: [run.ok] }
        - { src: idle, tgt: slowly, events: [e_slow] }
        - { src: slowly, tgt: quickly, events: [e_quick] }
    failed: {}
    stopped: { config: stop }
    halted: { config: halt }
    down:
      states:
        d0: { entry: slow.undo }
        stopping: { entry: run.undo }
        removing: { entry: build.undo }
      transitions:
        - { src: initial, tgt: d0 }
        - { src: d0, tgt: stopping, events: [slow.undone, slow.undo.failed, slow.undo.broken] }
        - { src: stopping, tgt: removing, events: [run.undone, run.undo.failed, run.undo.broken] }
    left: {}
  transitions:
    - { src: initial, tgt: off }
    - { src: off, tgt: up, events: [e_start] }
    - { src: up, tgt: failed, events: [build.failed, build.broken, run.failed, run.broken] }
    - { src: up, tgt: stopped, events: [e_stop] }
    - { src: failed, tgt: stopped, events: [e_stop] }
    - { src: stopped, tgt: stopped, events: [e_stop] }
    - { src: halted, tgt: stopped, events: [e_stop] }
    - { src: up, tgt: halted, events: [e_halt] }
    - { src: failed, tgt: halted, events: [e_halt] }
    - { src: stopped, tgt: halted, events: [e_halt] }
    - { src: halted, tgt: halted, events: [e_halt] }
    - { src: stopped, tgt: failed, events: [e_reset] }
    - { src: halted, tgt: failed, events: [e_reset] }
    - { src: up, tgt: down, events: [e_end] }
    - { src: failed, tgt: down, events: [e_end] }
    - { src: stopped, tgt: down, events: [e_end] }
    - { src: halted, tgt: down, events: [e_end] }
    - { src: down, tgt: stopped, events: [e_stop] }
    - { src: down, tgt: halted, events: [e_halt] }
    - { src: down, tgt: off, events: [build.undone] }
    - { src: down, tgt: left, events: [build.undo.failed, build.undo.broken] }
    - { src: left, tgt: stopped, events: [e_stop] }
    - { src: left, tgt: halted, events: [e_halt] }
    - { src: left, tgt: down, events: [e_end] }
";

/// The other configurations, and what comes.
struct Case {
    what: &'static str,
    configurations: [&'static str; 5],
    comes: &'static str,
    /// How often it was told that something was left; and what was, until somebody recovered it.
    told: &'static str,
}

const LAMP: &str = "changes: [{ create: { component: k0, type: Lamp } }]";
const NOTHING: &str = "pre_conf_state: [\"m:stopped\"]";
const STILL: &str = "changes: [{ port_write: { port: m.speed, value: 0.0 } }]";
const LIMIT: &str = "changes: [{ property_set: { property: m.limit, value: 0.1 } }]";
const QUICK: &str = "changes: [{ property_set: { property: m.limit, value: 0.7 } }]";

/// `run`, `slow`, `quick`, `stop`, `halt`.
const CASES: &[Case] = &[
    Case {
        what: "another one, and the first again, at one instant",
        configurations: [
            "post_conf_state: [\"m:stopped\"]",
            LAMP,
            QUICK,
            "post_conf_state: [\"m:unconfigured\"]",
            NOTHING,
        ],
        comes: "raise('e_stop') wait(1) raise('e_halt') raise('e_stop') wait(1) raise('e_reset') wait(1)",
        told: "0",
    },
    Case {
        what: "pressed again after its write came too late",
        configurations: [
            "post_conf_state: [\"m:stopped\"]",
            "changes: [{ property_set: { property: m.limit, value: 0.7 } }, { create: { component: k0, type: Lamp } }]",
            QUICK,
            LIMIT,
            NOTHING,
        ],
        comes: "fault('create k0', 'slow', 1, 0.8) raise('e_slow') wait(0.2) fault('property_set m.limit', 'slow', 1, 1.3)
                raise('e_stop') wait(3) raise('e_stop') wait(3) raise('e_reset') wait(2) recover('back') wait(1)",
        told: "1",
    },
    Case {
        what: "something ordinary over it, by force, whose call is late",
        configurations: [
            "changes: [{ port_write: { port: m.speed, value: 0.1 } }], post_conf_state: [\"m:stopped\"]",
            "changes: [{ operation_call: { operation: m.clamp } }]",
            QUICK,
            "changes: [{ property_set: { property: m.limit, value: 0.1 } }, { port_write: { port: m.speed, value: 0.0 } }]",
            NOTHING,
        ],
        comes: "raise('e_stop') wait(0.1) fault('operation_call m.clamp', 'late', 1) apply('slow', { force = true }) wait(2)
                raise('e_stop') wait(9) raise('e_reset') wait(2)",
        told: "0",
    },
    Case {
        what: "pressed again in the instant in which what was starting is there",
        configurations: [
            "post_conf_state: [\"m:stopped\"]",
            "changes: [{ property_set: { property: m.limit, value: 0.7 } }], post_conf_state: [\"m:running\"]",
            QUICK,
            "post_conf_state: [\"m:stopped\"]",
            STILL,
        ],
        comes: "fault('start m', 'slow', 1, 0.3) fault('stop m', 'slow', 1, 1.3) raise('e_slow') wait(0.2) raise('e_stop') wait(0.1)
                raise('e_stop') wait(5) raise('e_reset') wait(2)",
        told: "1",
    },
    Case {
        what: "something ordinary over it, by force, that another one interrupts",
        configurations: [
            "post_conf_state: [\"m:running\", \"n:running\"]",
            "post_conf_state: [\"n:stopped\"]",
            QUICK,
            "post_conf_state: [\"m:stopped\"]",
            STILL,
        ],
        comes: "fault('stop n', 'slow', 1, 0.3) raise('e_stop') wait(1) apply('slow', { force = true }) wait(0.1) raise('e_halt') wait(5)
                raise('e_reset') wait(3) undo('slow', { force = true }) wait(1) told = state('m') recover('back') wait(1)",
        told: "1 stopped",
    },
    Case {
        what: "pressed for the third time before the second is answered",
        configurations: [
            "post_conf_state: [\"m:running\"]",
            LAMP,
            QUICK,
            "post_conf_state: [\"m:unconfigured\"]",
            STILL,
        ],
        comes: "fault('cleanup m', 'fail', 1) fault('cleanup m', 'lost', 1) raise('e_stop') wait(2) raise('e_stop') wait(1)
                raise('e_stop') wait(9) raise('e_reset') wait(3) told = state('m') recover('back') wait(1)",
        told: "0 running",
    },
    Case {
        what: "two at one instant that free one in-port",
        configurations: [
            "post_conf_state: [\"m:running\"]",
            LAMP,
            QUICK,
            "changes: [{ disconnect: { from: l.o, to: m.ref } }, { connect: { from: x.o, to: m.ref, policy: data } }]",
            "changes: [{ disconnect: { from: l.o, to: m.ref } }]",
        ],
        comes: "raise('e_stop') raise('e_halt') wait(1) raise('e_reset') wait(1)",
        told: "0",
    },
    Case {
        what: "two that free one in-port, the second while that of the first is out",
        configurations: [
            "post_conf_state: [\"m:running\"]",
            LAMP,
            QUICK,
            "changes: [{ disconnect: { from: l.o, to: m.ref } }, { connect: { from: x.o, to: m.ref, policy: data } }]",
            "changes: [{ disconnect: { from: l.o, to: m.ref } }]",
        ],
        comes: "fault('disconnect l.o -> m.ref', 'slow', 1, 0.3) raise('e_stop') wait(0.1) raise('e_halt') wait(1) raise('e_reset') wait(1)",
        told: "0",
    },
    Case {
        what: "one that frees an in-port and writes there, again while that is out",
        configurations: [
            "post_conf_state: [\"m:running\"]",
            LAMP,
            QUICK,
            "changes: [{ disconnect: { from: l.o, to: m.ref } }, { port_write: { port: m.ref, value: 0.0 } }]",
            STILL,
        ],
        comes: "fault('disconnect l.o -> m.ref', 'slow', 1, 0.3) raise('e_stop') wait(0.1) raise('e_stop') wait(1) raise('e_reset') wait(1)",
        told: "0",
    },
];

fn demo(configurations: &[&str; 5]) -> Demo {
    let [run, slow, quick, stop, halt] = configurations;
    let made = "changes: [{ create: { component: m, type: Motor } }, { create: { component: n, type: Motor } }, { create: { component: l, type: Lamp } }, { create: { component: x, type: Lamp } }, { connect: { from: l.o, to: m.ref, policy: data } }]";
    let demo = Demo::new();
    demo.write("over.yaml", DEPLOYMENT);
    demo.write("coordinator.yaml", COORDINATOR);
    demo.write(
        "configurations.yaml",
        &format!(
            "configurations:
  build: {{ {made} }}
  run: {{ {run} }}
  slow: {{ group: speed, {slow} }}
  quick: {{ group: speed, {quick} }}
  stop: {{ safe: true, group: speed, {stop} }}
  halt: {{ safe: true, group: speed, {halt} }}
"
        ),
    );
    demo
}

#[test]
fn where_the_same_is_in_force_it_is_as_before() {
    CASES.iter().for_each(|case| ends_as_before(case, ""));
}

/// What is in force when an emergency comes, and whose place that takes, is gone afterwards, and nothing else is.
#[test]
fn where_something_ordinary_of_its_group_was_in_force_it_is_as_without_that() {
    let alone = CASES.iter().filter(|case| !case.comes.contains("slow') ") && !case.comes.contains("'e_slow'"));
    let mut some = 0;
    for case in alone.filter(|case| !case.comes.contains("apply('slow'")) {
        ends_as_before(case, "raise('e_slow') wait(0.5)");
        some += 1;
    }
    assert!(some >= 5, "{some}");
}

fn ends_as_before(Case { what, configurations, comes, told }: &Case, first: &str) {
    let demo = demo(configurations);
    demo.write(
            "s.lua",
            &format!(
                "local function same(a, b)
                   if type(a) ~= 'table' or type(b) ~= 'table' then return a == b end
                   for k, v in pairs(a) do if not same(v, b[k]) then return false end end
                   for k in pairs(b) do if a[k] == nil then return false end end
                   return true
                 end
                 deploy('over.yaml') wait(0.2) local before = system() local told = nil
                 {first} {comes}
                 local told_of = 0
                 for _, entry in ipairs(log()) do
                   if entry.note and string.find(entry.note, 'the emergency is over', 1, true) then told_of = told_of + 1 end
                 end
                 say(tostring(same(before, system())) .. ' ' .. #drift() .. ' ' .. #stack() .. ' ' .. told_of
                   .. (told and ' ' .. told or '')) shutdown()"
            ),
        );
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
    let said = ran.out.lines().find(|line| line.starts_with("true ") || line.starts_with("false "));
    let expected = format!("true 0 2 {told}");
    assert_eq!((said, ran.code), (Some(expected.as_str()), 0), "{what} {first}: {}{}", ran.out, ran.err);
}

/// The end of an emergency moves what that had moved itself, and nothing else: what somebody's undo has left so is for who asks for that.
#[test]
fn it_sets_nothing_in_motion_that_it_has_not_stopped() {
    let stop = "changes: [{ port_write: { port: m.speed, value: 0.0 } }]";
    let runs = "changes: [{ property_set: { property: m.limit, value: 0.8 } }], post_conf_state: [\"m:running\"]";
    let demo = demo(&["post_conf_state: [\"m:stopped\"]", runs, QUICK, stop, STILL]);
    demo.write(
        "s.lua",
        "deploy('over.yaml') wait(0.2) apply('slow', { force = true }) wait(1)
         fault('property_set m.limit', 'fail', 3) undo('slow', { force = true }) wait(1)
         raise('e_stop') wait(1) raise('e_stop') wait(1) raise('e_reset') wait(2)
         for _, entry in ipairs(log()) do for _, step in ipairs(entry.steps or {}) do
           if entry.at > 2 and step.step == 'start m' and step.outcome == 'done' then say('started by ' .. entry.answer) end
         end end
         say('m ' .. state('m')) shutdown{ force = true }",
    );
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
    let found: Vec<&str> =
        ran.out.lines().filter(|line| line.starts_with("m ") || line.starts_with("started")).collect();
    assert_eq!(found, ["m stopped"], "{}{}", ran.out, ran.err);
}

/// A hot swap that is interrupted by an emergency which connects what is being swapped: both can be let go of.
#[test]
fn what_it_connects_in_the_middle_of_a_hot_swap_is_let_go_of() {
    let connects = "changes: [{ connect: { from: x.o, to: n.ref, policy: data } }]";
    let swap = "changes: [{ replace: { component: n, type: Motor } }]";
    let demo = demo(&["post_conf_state: [\"n:running\"]", swap, QUICK, connects, STILL]);
    for step in ["stop", "cleanup", "destroy", "create", "configure", "start"] {
        demo.write(
            "s.lua",
            &format!(
                "deploy('over.yaml') wait(0.2) fault('{step} n', 'slow', 1, 0.3) raise('e_slow') wait(0.1) raise('e_stop') wait(2)
                 raise('e_reset') wait(1) pcall(undo, 'slow', {{ force = true }}) wait(1)
                 say('n ' .. state('n') .. ' ' .. #system().connections .. ' ' .. #stack() .. ' ' .. #drift()) shutdown()"
            ),
        );
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
        let found = ran.out.lines().find(|line| line.starts_with("n "));
        assert_eq!((found, ran.code), (Some("n running 1 2 0"), 0), "{step}: {}{}", ran.out, ran.err);
    }
}

/// What an operator has set meanwhile stays, also where something else of the same component is put right.
#[test]
fn what_was_set_meanwhile_stays_where_the_rest_is_put_right() {
    let of = CASES.iter().find(|case| case.what.ends_with("that another one interrupts"));
    let demo = demo(&of.expect("the case").configurations);
    demo.write(
        "s.lua",
        "deploy('over.yaml') wait(0.2) fault('stop n', 'slow', 1, 0.3) raise('e_stop') wait(1) apply('slow', { force = true }) wait(0.1)
         raise('e_halt') wait(5) set('m.limit', 0.9, { force = true, within = 1 }) raise('e_reset') wait(3)
         undo('slow', { force = true }) wait(1) say('before ' .. state('m')) recover('back') wait(1)
         say('m ' .. state('m') .. ' limit ' .. property('m.limit') .. ' ' .. #drift()) shutdown{ force = true }",
    );
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
    let found: Vec<&str> =
        ran.out.lines().filter(|line| line.starts_with("m ") || line.starts_with("before ")).collect();
    assert_eq!(found, ["before stopped", "m running limit 0.9 0"], "{}{}", ran.out, ran.err);
}

/// Two of them, and what their parent applies when it hears `e_cut`, which `e_mend` ends.
fn pair(demo: &Demo, cut: &str) {
    demo.write(
        "pair.yaml",
        "davit: 1
name: pair
platform: simulated
types: {}
subsystems: { left: { deployment: over.yaml }, right: { deployment: over.yaml } }
configurations: [parent.yaml]
coordinator: both.yaml
safety: [e_stop, e_halt]
deploy: { event: e_go, up: on, failed: [failed], within_s: 10 }
shutdown: { event: e_down, down: idle, within_s: 20 }
",
    );
    demo.write("parent.yaml", &format!("configurations: {{ cut: {{ safe: true, group: cut, {cut} }} }}\n"));
    demo.write(
        "both.yaml",
        "coordinator:
  states:
    idle: {}
    up:
      states: { a: { entry: left/e_start }, b: { entry: right/e_start } }
      transitions: [{ src: initial, tgt: a }, { src: a, tgt: b, events: [left/up] }]
    on: {}
    held: { config: cut }
    mending: {}
    letting: {}
    failed: {}
    c: { entry: left/e_end }
    d: { entry: right/e_end }
  transitions:
    - { src: initial, tgt: idle }
    - { src: idle, tgt: up, events: [e_go] }
    - { src: up, tgt: on, events: [right/up] }
    - { src: up, tgt: failed, events: [left/failed, right/failed] }
    - { src: on, tgt: held, events: [e_cut] }
    - { src: held, tgt: mending, events: [e_mend] }
    - { src: held, tgt: letting, events: [e_down] }
    - { src: mending, tgt: on, events: [cut.undone, cut.undo.failed, cut.undo.broken] }
    - { src: mending, tgt: letting, events: [e_down] }
    - { src: letting, tgt: c, events: [cut.undone, cut.undo.failed, cut.undo.broken] }
    - { src: up, tgt: c, events: [e_down] }
    - { src: on, tgt: c, events: [e_down] }
    - { src: failed, tgt: c, events: [e_down] }
    - { src: c, tgt: d, events: [left/down, left/e_end.ignored] }
    - { src: d, tgt: idle, events: [right/down, right/e_end.ignored] }
",
    );
}

/// What a parent has made safe in two subsystems is all taken back, also where one of these had an emergency of its own meanwhile.
#[test]
fn what_a_parent_has_made_safe_is_its_own_matter() {
    let leads_down = "post_conf_state: [\"m:unconfigured\"]";
    let demo = demo(&["post_conf_state: [\"m:stopped\"]", LIMIT, QUICK, leads_down, NOTHING]);
    demo.write("over.yaml", &format!("{DEPLOYMENT}exports: {{ properties: {{ limit: n.limit }} }}\n"));
    let set = |of: &str| format!("{{ property_set: {{ property: {of}.limit, value: 0.2 }} }}");
    pair(&demo, &format!("changes: [{}, {}]", set("left"), set("right")));
    demo.write(
        "s.lua",
        "deploy('pair.yaml') wait(0.2) raise('e_stop', { to = { 'left' } }) wait(1) raise('e_cut') wait(1)
         raise('e_halt', { to = { 'left' } }) raise('e_stop', { to = { 'left' } }) wait(1) raise('left/e_reset') wait(1)
         raise('e_mend') wait(1)
         say('n ' .. property('left/n.limit') .. ' ' .. property('right/n.limit') .. ' ' .. #drift()) shutdown()",
    );
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
    let found = ran.out.lines().find(|line| line.starts_with("n "));
    assert_eq!((found, ran.code), (Some("n 0.5 0.5 0"), 0), "{}{}", ran.out, ran.err);
}

/// Each subsystem has an emergency of its own: what a sibling is just doing, or has broken, is no matter of it.
#[test]
fn what_goes_on_in_a_sibling_is_no_matter_of_it() {
    let frees = "changes: [{ disconnect: { from: l.o, to: m.ref } }, { port_write: { port: m.ref, value: 0.0 } }]";
    let demo = demo(&["post_conf_state: [\"m:running\"]", LIMIT, QUICK, frees, STILL]);
    pair(&demo, "");
    for busy in
        ["", "fault('property_set right/m.limit', 'slow', 1, 0.8)", "fault('property_set right/m.limit', 'late', 1)"]
    {
        demo.write(
            "s.lua",
            &format!(
                "deploy('pair.yaml') wait(0.2) {busy} raise('right/e_slow') wait(0.1)
                 fault('disconnect left/l.o -> left/m.ref', 'slow', 1, 0.3)
                 raise('e_stop', {{ to = {{ 'left' }} }}) wait(0.1) raise('e_stop', {{ to = {{ 'left' }} }}) wait(1)
                 raise('left/e_reset') wait_answer('left/stop.undone', 1)
                 local left = 0 for _, frame in ipairs(stack()) do if frame.configuration == 'left/stop' then left = left + 1 end end
                 say('left ' .. left) wait(10) recover('back') shutdown()"
            ),
        );
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
        assert!(ran.code == 0 && ran.out.contains("left 0"), "{busy}: {}{}", ran.out, ran.err);
    }
}

/// What an operator has accepted, or made permanent, while an emergency was in force is not taken back by its end.
#[test]
fn what_was_accepted_meanwhile_stays() {
    let stop = "changes: [{ port_write: { port: m.speed, value: 0.0 } }], post_conf_state: [\"m:stopped\"]";
    let demo = demo(&["post_conf_state: [\"m:running\", \"n:running\"]", LAMP, QUICK, stop, STILL]);
    for (comes, said) in [
        (
            "fault('stop m', 'fail', 3) raise('e_stop') wait(2) recover('accept') wait(1)",
            "m running n running l x, limit 0.5, told 0",
        ),
        (
            "set('m.limit', 0.9, { force = true, within = 1 }) raise('e_stop') wait(1) commit{ force = true } wait(1)
             raise('e_reset') wait(1)",
            "m running n running l x, limit 0.9, told 0",
        ),
        (
            "apply('stop', { force = true }) wait(1) commit{ force = true } wait(1)",
            "m stopped n running l x, limit 0.5, told 0",
        ),
        (
            "raise('e_halt') wait(1) set('m.limit', 0.9, { force = true, within = 1 }) commit{ force = true } wait(1) fault('stop m', 'slow', 1, 0.3)
             raise('e_stop') wait(0.1) raise('e_stop') wait(1) raise('e_reset') wait(1)",
            "m running n running l x, limit 0.9, told 0",
        ),
        (
            "raise('e_stop') wait(1) set('m.limit', 0.9, { force = true, within = 1 }) commit{ force = true } wait(1)
             raise('e_reset') wait(1)",
            "m running n running l x, limit 0.9, told 0",
        ),
    ] {
        demo.write(
            "s.lua",
            &format!(
                "deploy('over.yaml') wait(0.2) {comes}
                 local told = 0
                 for _, entry in ipairs(log()) do
                   if entry.note and string.find(entry.note, 'the emergency is over', 1, true) then told = told + 1 end
                 end
                 say('m ' .. tostring(state('m')) .. ' n ' .. tostring(state('n')) .. (state('l') and ' l' or '') .. (state('x') and ' x' or '')
                   .. ', limit ' .. property('m.limit') .. ', told ' .. told) shutdown{{ force = true }}"
            ),
        );
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
        let found = ran.out.lines().find(|line| line.starts_with("m "));
        assert_eq!(found, Some(said), "{comes}: {}{}", ran.out, ran.err);
    }
}

/// A component that has failed since is brought back by nobody's undo; and one that came back late, and is made anew while the emergency is in
/// force, is as that wants it.
#[test]
fn what_failed_or_came_back_late_meanwhile() {
    let demo = demo(&["", "", "", "", ""]);
    let types =
        &DEPLOYMENT[DEPLOYMENT.find("types:").expect("types")..DEPLOYMENT.find("configurations:").expect("the end")];
    let own = "libraries: [standard]\nactivities: { loop: { period_ms: 5.0, priority: 10 } }\n";
    demo.write("over.yaml", &DEPLOYMENT.replace(types, own).replace("platform: simulated", "platform: embedded"));
    demo.write(
        "configurations.yaml",
        "configurations:
  build: { changes: [{ create: { component: n, type: standard.Pid, activity: loop } }] }
  run: { post_conf_state: [\"n:running\"] }
  slow: { group: speed, changes: [{ property_set: { property: n.ki, value: 0.7 } }] }
  quick: { group: speed, changes: [{ property_set: { property: n.ki, value: 0.8 } }] }
  stop: { safe: true, group: speed, changes: [{ property_set: { property: n.kp, value: 0.1 } }] }
  halt: { safe: true, group: speed, changes: [{ property_set: { property: n.kp, value: 0.2 } }] }
  off: { pre_conf_state: [\"n:unconfigured\"] }
",
    );
    for (comes, said) in [
        (
            "raise('e_stop') wait(1) inject('n', 'panic') wait(1) apply('off', { force = true }) wait(1)
             undo('off', { force = true }) wait(1) raise('e_reset') wait(1)",
            "n unconfigured 1.0",
        ),
        (
            "inject('n', 'stall', { seconds = 8 }) raise('e_halt') wait(0.1) raise('e_stop') wait(1)
             apply('off', { force = true }) wait(12)",
            "n running 0.1",
        ),
    ] {
        demo.write(
            "s.lua",
            &format!("deploy('over.yaml') wait(0.2) {comes} say('n ' .. state('n') .. ' ' .. property('n.kp')) shutdown{{ force = true }}"),
        );
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
        let found = ran.out.lines().find(|line| line.starts_with("n "));
        assert_eq!(found, Some(said), "{comes}: {}{}", ran.out, ran.err);
    }
}
