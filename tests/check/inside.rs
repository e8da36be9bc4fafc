//! A subsystem's file as it runs: with the limits and the safety of the deployment that it is part of, whatever its own file says.

use super::composed::{catalogue, load};
use davit::check::{self, Report};
use davit::lang::Sources;
use davit::model::{Finding, Severity};

const SUB: &str = "davit: 1
name: sub
platform: simulated
types: { Drive: { properties: { gain: { type: float, default: 1.0 }, bias: { type: float, default: 0.0 } } } }
configurations: [conf.yaml]
coordinator: sub_coord.yaml
accepts: [e_go]
emits: [e_pong]
deploy: { event: e_start, up: ready, failed: [fault], within_s: 5 }
shutdown: { event: e_end, down: idle, within_s: 5 }
";

const CONF: &str = "configurations:
  base: { changes: [{ create: { component: A, type: Drive } }] }
  one: { changes: [{ property_set: { property: A.gain, value: 2.0 } }] }
  two: { changes: [{ property_set: { property: A.bias, value: 2.0 } }] }
";

/// With more states, and more transitions.
const COORDINATOR: &str = "coordinator:
  states:
    idle: {}
    building: { entry: base }
    ready: {}
    fault: {}
    leaving: { entry: base.undo }
STATES  transitions:
    - { src: initial, tgt: idle }
    - { src: idle, tgt: building, events: [e_start] }
    - { src: building, tgt: ready, events: [base.ok] }
    - { src: building, tgt: fault, events: [base.failed, base.broken] }
    - { src: building, tgt: leaving, events: [e_end] }
    - { src: ready, tgt: leaving, events: [e_end] }
    - { src: fault, tgt: leaving, events: [e_end] }
    - { src: leaving, tgt: idle, events: [base.undone] }
    - { src: leaving, tgt: fault, events: [base.undo.failed, base.undo.broken] }
EDGES";

const MAIN: &str = "davit: 1
name: main
platform: simulated
types: {}
subsystems: { s: { deployment: sub.yaml } }
configurations: [none.yaml]
coordinator: main_coord.yaml
deploy: { event: e_start, up: ready, failed: [fault], within_s: 5 }
shutdown: { event: e_end, down: idle, within_s: 5 }
";

const MAIN_COORDINATOR: &str = "coordinator:
  states: { idle: {}, raising: {}, ready: {}, fault: {}, lowering: {} }
  transitions:
    - { src: initial, tgt: idle }
    - { src: idle, tgt: raising, events: [e_start], effect: [s/e_start] }
    - { src: raising, tgt: ready, events: [s/up] }
    - { src: raising, tgt: fault, events: [s/failed] }
    - { src: ready, tgt: fault, events: [s/failed] }
    - { src: raising, tgt: lowering, events: [e_end], effect: [s/e_end] }
    - { src: ready, tgt: lowering, events: [e_end], effect: [s/e_end] }
    - { src: fault, tgt: lowering, events: [e_end], effect: [s/e_end] }
    - { src: lowering, tgt: idle, events: [s/down, s/e_end.ignored] }
";

/// The subsystem's coordinator with these states and transitions, in a deployment with these keys whose coordinator has these transitions.
fn report((states, edges): (&str, &str), keys: &str, more: &str) -> Report {
    let sub = if edges.contains("e_pong") { SUB.to_owned() } else { SUB.replace("emits: [e_pong]\n", "") };
    let files = [
        ("sub.yaml", sub),
        ("conf.yaml", CONF.to_owned()),
        ("sub_coord.yaml", COORDINATOR.replace("STATES", states).replace("EDGES", edges)),
        ("main.yaml", format!("{MAIN}{keys}")),
        ("none.yaml", "configurations: {}\n".to_owned()),
        ("main_coord.yaml", format!("{MAIN_COORDINATOR}{more}")),
    ];
    let deployment = load(&Sources::memory(files), "main.yaml", &[]).deployment.expect("it can be read");
    let catalogue = catalogue(&deployment);
    check::run(deployment, &catalogue)
}

fn told(report: &Report) -> Vec<(&str, &str)> {
    let told = |finding: &&Finding| finding.severity > Severity::Info;
    report.findings.iter().filter(told).map(|finding| (finding.code.0, &finding.message[..])).collect()
}

#[test]
fn the_limit_of_the_stack_is_that_of_the_deployment_that_runs() {
    let modes = (
        "    m1: { entry: one }
    m2: { entry: two }
    d2: { entry: two.undo }
    d1: { entry: one.undo }
",
        "    - { src: ready, tgt: m1, events: [e_go] }
    - { src: m1, tgt: m2, events: [one.ok] }
    - { src: m1, tgt: d1, events: [e_end, one.failed, one.broken] }
    - { src: m2, tgt: d2, events: [e_end, two.failed, two.broken] }
    - { src: d2, tgt: d1, events: [two.undone, two.undo.failed, two.undo.broken] }
    - { src: d1, tgt: leaving, events: [one.undone, one.undo.failed, one.undo.broken] }
",
    );
    assert_eq!(told(&report(modes, "", "")), []);
    let small = report(modes, "limits: { stack: 2 }\n", "");
    let refused = told(&small).into_iter().filter(|(code, _)| *code == "coord::request_refused").collect::<Vec<_>>();
    let squashed = "is refused when it is asked for: `base` was committed, or squashed together with others";
    assert!(refused.iter().any(|(_, message)| message.ends_with(squashed)), "{refused:?}");
}

#[test]
fn an_event_of_a_subsystem_is_refused_while_it_is_being_stopped_where_the_whole_declares_safety() {
    let asks = (
        "    mode: {}\n    asking: {}\n",
        "    - { src: ready, tgt: mode, events: [e_go] }
    - { src: mode, tgt: asking, events: [e_end] }
    - { src: asking, tgt: leaving, events: [e_yes] }
",
    );
    assert_eq!(told(&report(asks, "", "")), []);
    let stops = "    - { src: ready, tgt: fault, events: [e_stop] }\n";
    let closed = report(asks, "safety: [e_stop]\n", stops);
    let message = "from `root.asking` only `e_yes` leads down, which is refused when `e_end` has been raised";
    assert_eq!(told(&closed), [("coord::no_way_down", message)]);
}

/// More of them lie in the subsystem's inbox than are followed: the one that ends it is among them all the same.
#[test]
fn what_ends_a_subsystem_is_not_lost_among_what_is_raised_for_it() {
    let answers = ("", "    - { src: ready, tgt: ready, events: [e_go], effect: [e_pong] }\n");
    let asks = "    - { src: ready, tgt: ready, events: [e_go], effect: [s/e_go] }
    - { src: ready, tgt: ready, events: [s/e_pong] }
";
    assert_eq!(told(&report(answers, "", asks)), []);
}

#[test]
fn what_is_not_known_of_times_is_said() {
    let left = |(states, edges), more: &str| report((states, edges), "", more).left.concat();
    let plain = left(("", ""), "");
    assert!(!plain.contains("in time") && !plain.contains("e_at"), "{plain}");
    let waits = ("", "    - { src: ready, tgt: fault, events: ['e_after(3)'] }\n");
    assert!(left(waits, "").contains("whether ways down through several files are in time"));
    let clocked = "    - { src: ready, tgt: fault, events: ['e_at(3)'] }\n";
    assert!(left(("", ""), clocked).contains("(`e_at`)"));
}
