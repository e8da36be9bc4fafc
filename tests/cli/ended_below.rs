//! An emergency of a subsystem, or of another coordinator, that ends since its parent goes on by itself: `check` says so, and what it advises
//! keeps it until people ask.

use crate::demo::Demo;
use serde_json::Value as Json;

const HALL: &str = "davit: 1
name: hall
platform: simulated
types: { Lamp: {} }
subsystems: { belt: { deployment: conveyor.yaml } }
configurations: hall_configurations.yaml
coordinator: hall_coordinator.yaml
safety: e_stop
deploy:   { event: e_open,  up: open, failed: failed, within_s: 5 }
shutdown: { event: e_close, down: shut, within_s: 5 }
faults: [{ step: stop Lamp, how: slow, takes_s: 0.5 }]
";
const HALL_CONFIGURATIONS: &str = "configurations:
  lamp: { changes: [{ create: { component: Lamp, type: Lamp } }] }
  light: { post_conf_state: [\"Lamp:running\"] }
";
/// Takes its light back, and ends the conveyor when that is done.
const HALL_COORDINATOR: &str = "coordinator:
  states:
    shut: {}
    making: { entry: lamp }
    lighting: { entry: light }
    waiting: {}
    open: {}
    failed: {}
    dimming: { entry: light.undo }
    ending: { entry: belt/e_end }
    removing: { entry: lamp.undo }
  transitions:
    - { src: initial, tgt: shut }
    - { src: shut, tgt: making, events: e_open }
    - { src: making, tgt: lighting, events: lamp.ok }
    - { src: lighting, tgt: waiting, events: light.ok, effect: belt/e_start }
    - { src: waiting, tgt: open, events: belt/up }
    - { src: waiting, tgt: failed, events: belt/failed }
    - { src: making, tgt: failed, events: [lamp.failed, lamp.broken] }
    - { src: lighting, tgt: failed, events: [light.failed, light.broken] }
    - { src: making, tgt: dimming, events: e_close }
    - { src: lighting, tgt: dimming, events: e_close }
    - { src: waiting, tgt: dimming, events: e_close }
    - { src: open, tgt: dimming, events: e_close }
    - { src: failed, tgt: dimming, events: e_close }
    - { src: dimming, tgt: ending, events: [light.undone, light.undo.failed, light.undo.broken] }
    - { src: ending, tgt: removing, events: [belt/down, belt/e_end.ignored] }
    - { src: ending, tgt: ending, events: e_close }
    - { src: removing, tgt: shut, events: lamp.undone }
    - { src: removing, tgt: failed, events: [lamp.undo.failed, lamp.undo.broken] }
";
/// Passes a conveyor on.
const LINE: &str = "davit: 1
name: line
platform: simulated
types: {}
subsystems: { inner: { deployment: conveyor.yaml } }
configurations: none.yaml
coordinator: line.lua
deploy:   { event: e_start, up: on, failed: failed, within_s: 8 }
shutdown: { event: e_end, down: off, within_s: 8 }
";
const LINE_COORDINATOR: &str = "return state {
  off = state {}, raising = state { entry = 'inner/e_start' }, on = state {}, failed = state {}, ending = state { entry = 'inner/e_end' },
  trans { src = 'initial', tgt = 'off' },
  trans { src = 'off', tgt = 'raising', events = { 'e_start' } },
  trans { src = 'raising', tgt = 'on', events = { 'inner/up' } },
  trans { src = 'raising', tgt = 'failed', events = { 'inner/failed' } },
  trans { src = 'raising', tgt = 'ending', events = { 'e_end' } },
  trans { src = 'failed', tgt = 'ending', events = { 'e_end' } },
  trans { src = 'on', tgt = 'ending', events = { 'e_end' } },
  trans { src = 'ending', tgt = 'off', events = { 'inner/down', 'inner/e_end.ignored' } },
}";

/// A conveyor that is held inside of the state in which it hears the stop.
const ALIVE: &str = "coordinator:
  states:
    off: {}
    alive:
      states:
        building: { entry: build }
        starting: { entry: run }
        running: {}
        failed: {}
        held: { config: hold, states: { whole: {}, in_part: {} }, transitions: [{ src: initial, tgt: whole }, { src: whole, tgt: in_part, events: [hold.failed, hold.broken] }] }
        stopping: { entry: run.undo }
        removing: { entry: build.undo }
      transitions:
        - { src: initial, tgt: building }
        - { src: building, tgt: starting, events: build.ok }
        - { src: starting, tgt: running, events: run.ok }
        - { src: building, tgt: failed, events: [build.failed, build.broken] }
        - { src: starting, tgt: failed, events: [run.failed, run.broken] }
        - { src: held, tgt: failed, events: e_reset }
        - { src: building, tgt: stopping, events: e_end }
        - { src: starting, tgt: stopping, events: e_end }
        - { src: running, tgt: stopping, events: e_end }
        - { src: failed, tgt: stopping, events: e_end }
        - { src: held, tgt: stopping, events: e_end }
        - { src: stopping, tgt: removing, events: [run.undone, run.undo.failed, run.undo.broken] }
  transitions:
    - { src: initial, tgt: off }
    - { src: off, tgt: alive, events: e_start }
    - { src: alive, tgt: alive.held, events: e_stop, effect: e_stopped }
    - { src: alive, tgt: off, events: [build.undone, build.undo.failed, build.undo.broken] }
";

fn hall() -> Demo {
    let demo = Demo::new();
    for file in ["conveyor.yaml", "configurations.yaml", "coordinator.yaml"] {
        let text = std::fs::read_to_string(format!("{}/examples/conveyor/{file}", env!("CARGO_MANIFEST_DIR")));
        demo.write(file, &text.unwrap());
    }
    demo.write("hall.yaml", HALL);
    demo.write("hall_configurations.yaml", HALL_CONFIGURATIONS);
    demo.write("hall_coordinator.yaml", HALL_COORDINATOR);
    demo
}

/// The conveyor tells that it is stopped, wherever it is.
fn tells(demo: &Demo) {
    demo.replace("conveyor.yaml", "safety:", "emits: [e_stopped]\nsafety:");
    for from in ["up", "failed", "down", "left"] {
        let stop = format!("{{ src: {from}, tgt: held, events: [e_stop]");
        demo.replace("coordinator.yaml", &format!("{stop} }}"), &format!("{stop}, effect: e_stopped }}"));
    }
}

/// What the help of the finding says; where the conveyor has not been begun nothing holds it, and nobody is waited for.
fn hears(demo: &Demo) {
    tells(demo);
    for (from, to) in [
        ("    removing: { entry", "    stopped: {}\n    early: { entry: light.undo }\n    removing: { entry"),
        ("{ src: making, tgt: dimming", "{ src: making, tgt: early"),
        ("{ src: lighting, tgt: dimming", "{ src: lighting, tgt: early"),
        (
            "    - { src: ending, tgt: removing",
            "    - { src: dimming, tgt: stopped, events: [e_stop, belt/e_stopped] }
    - { src: stopped, tgt: dimming, events: e_close }
    - { src: early, tgt: removing, events: [light.undone, light.undo.failed, light.undo.broken] }
    - { src: ending, tgt: removing",
        ),
    ] {
        demo.replace("hall_coordinator.yaml", from, to);
    }
}

/// The messages of `coord::safe_left`, and what they advise.
fn told_of(demo: &Demo, key: &str) -> Vec<String> {
    let checked = demo.run(&["check", "hall.yaml", "--json"]).json();
    let all = checked["findings"].as_array().unwrap().iter().filter(|one| one["code"] == "coord::safe_left");
    all.map(|one: &Json| one[key].as_str().unwrap().to_owned()).collect()
}
fn told(demo: &Demo) -> Vec<String> {
    told_of(demo, "message")
}

#[test]
fn who_ends_a_subsystem_by_an_answer_hears_what_stops_it() {
    let demo = hall();
    let [one] = &told(&demo)[..] else { panic!("{:?}", told(&demo)) };
    assert!(one.starts_with("`light.undone` leads from `root.dimming` to `root.ending`"), "{one}");
    assert!(one.contains("`belt/e_end` is raised") && one.contains("`e_stop`"), "{one}");
    // By time, and by what the subsystem tells, it is the same.
    for by in ["e_after(1)", "belt/failed"] {
        let demo = hall();
        demo.replace("hall_coordinator.yaml", "[light.undone, light.undo.failed, light.undo.broken]", by);
        assert!(told(&demo).iter().any(|one| one.starts_with(&format!("`{by}"))), "{by}: {:?}", told(&demo));
    }
    // So it is where that is raised on leaving, by the stop itself, and by whatever comes next.
    for (from, to, by) in [
        ("dimming: { entry: light.undo }", "dimming: { entry: light.undo, exit: belt/e_end }", "`light.undone`"),
        ("[light.undone, light.undo.failed, light.undo.broken]", "[light.undo.broken, e_stop]", "`e_stop`"),
        (", events: [light.undone, light.undo.failed, light.undo.broken] }", " }", "whatever comes next"),
    ] {
        let demo = hall();
        demo.replace("hall_coordinator.yaml", from, to);
        assert!(told(&demo).iter().any(|one| one.starts_with(by)), "{by}: {:?}", told(&demo));
    }
    // A way that begins by itself before that, and what is held that is left by time.
    let demo = hall();
    demo.replace(
        "hall_coordinator.yaml",
        "{ src: open, tgt: dimming, events: e_close }",
        "{ src: open, tgt: closing, events: e_close }",
    );
    demo.replace("hall_coordinator.yaml", "    removing: { entry", "    closing: {}\n    removing: { entry");
    demo.replace(
        "hall_coordinator.yaml",
        "    - { src: ending, tgt: removing",
        "    - { src: closing, tgt: dimming, events: e_after(1) }\n    - { src: ending, tgt: removing",
    );
    let found = told(&demo);
    assert!(
        found.len() == 2 && found.iter().any(|one| one.contains("by itself on to where `belt/e_end` is raised")),
        "{found:?}"
    );
    let demo = hall();
    hears(&demo);
    demo.replace(
        "hall_coordinator.yaml",
        "{ src: stopped, tgt: dimming, events: e_close }",
        "{ src: stopped, tgt: dimming, events: [e_close, e_after(2)] }",
    );
    let found = told(&demo);
    assert!(found.len() == 1 && found[0].starts_with("`e_after(2)"), "{found:?}");
    // Where it is heard in a part of the state alone, and past a file in between that knows of no event of safety.
    let demo = hall();
    demo.replace("hall_coordinator.yaml", "dimming: { entry: light.undo }", "dimming: { entry: light.undo, states: { a: {}, b: {} }, transitions: [{ src: initial, tgt: a }, { src: a, tgt: b, events: e_on }] }");
    demo.replace("hall_coordinator.yaml", "    removing: { entry", "    stopped: {}\n    removing: { entry");
    demo.replace(
        "hall_coordinator.yaml",
        "    - { src: ending, tgt: removing",
        "    - { src: dimming.b, tgt: stopped, events: e_stop }\n    - { src: stopped, tgt: dimming, events: e_close }\n    - { src: ending, tgt: removing",
    );
    assert_eq!(told(&demo).len(), 1, "{}", demo.run(&["check", "hall.yaml"]).err);
    let demo = hall();
    demo.replace("hall.yaml", "deployment: conveyor.yaml", "deployment: line.yaml");
    demo.write("line.yaml", LINE);
    demo.write("line.lua", LINE_COORDINATOR);
    demo.write("none.yaml", "configurations: {}\n");
    assert!(told(&demo).iter().any(|one| one.contains("`belt/e_end`")), "{}", demo.run(&["check", "hall.yaml"]).err);
    // By people it is what they ask for; and so it is where it ends nothing below.
    for (file, from, to) in [
        ("hall_coordinator.yaml", "[light.undone, light.undo.failed, light.undo.broken]", "e_go"),
        ("coordinator.yaml", "    - { src: held, tgt: down, events: [e_end] }\n", ""),
    ] {
        let demo = hall();
        demo.replace(file, from, to);
        assert_eq!(told(&demo), [""; 0], "{file}: {from}");
    }
}

#[test]
fn who_follows_the_advice_keeps_it_until_people_ask() {
    let story = "deploy('hall.yaml') wait_state('hall:open', 2) raise('e_close') wait(0.2) raise('e_stop') wait(3)
        for _, frame in ipairs(stack()) do say(frame.configuration) end
        raise('e_close') wait_state('hall:shut', 3) say('shut ' .. #stack())";
    let said = |demo: &Demo| {
        demo.write("s.lua", story);
        let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
        assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
        ran.out.lines().map(str::to_owned).collect::<Vec<_>>()
    };
    let demo = hall();
    hears(&demo);
    assert_eq!(told(&demo), [""; 0]);
    // Nor is it held against that one that it waits for people, who raise the end once more.
    let checked = demo.run(&["check", "hall.yaml"]).err;
    assert!(!checked.contains("only a second `e_close` leads down"), "{checked}");
    let told = said(&demo);
    assert!(told.contains(&"belt/hold".to_owned()), "{told:?}");
    assert_eq!(told.last().unwrap(), "shut 0");
}

/// A stop of the subsystem alone is heard by its parent where that is told of it, and in no other way.
#[test]
fn who_ends_a_subsystem_by_an_answer_is_told_where_it_is_stopped_alone() {
    let alone = |demo: &Demo| {
        let found = told(demo);
        assert!(found.len() == 1 && found[0].contains("what `belt/e_stop` has made safe"), "{found:?}");
        told_of(demo, "help").remove(0)
    };
    // Given on or not; where nothing, or not always something, is told; and where that is not heard.
    let demo = hall();
    demo.replace("hall.yaml", "safety: e_stop\n", "");
    assert!(alone(&demo).contains("let the subsystem emit an event wherever it takes `belt/e_stop` up"));
    let demo = hall();
    hears(&demo);
    demo.replace(
        "coordinator.yaml",
        "{ src: failed, tgt: held, events: [e_stop], effect: e_stopped }",
        "{ src: failed, tgt: held, events: [e_stop] }",
    );
    assert!(alone(&demo).contains("let the subsystem emit an event"));
    let demo = hall();
    hears(&demo);
    demo.replace("hall_coordinator.yaml", "[e_stop, belt/e_stopped]", "e_stop");
    assert!(alone(&demo).contains("hear `belt/e_stopped` (by which that is told) in `root.dimming`"));
    // Told in one place, where a state takes it up into one of its own.
    let demo = hall();
    hears(&demo);
    demo.write("coordinator.yaml", ALIVE);
    demo.replace("conveyor.yaml", "up: running, failed: [failed]", "up: alive.running, failed: [alive.failed]");
    let silent = demo.run(&["check", "hall.yaml", "--json"]).json();
    assert!(told(&demo).is_empty() && silent["ok"] == true, "{silent:#}");
    demo.replace("coordinator.yaml", ", effect: e_stopped", "");
    alone(&demo);
    // Behind a connector, on each of the ways or on one of them.
    for second in ["effect: e_stopped, ", ""] {
        let demo = hall();
        hears(&demo);
        demo.replace("coordinator.yaml", "    left: {}\n", "    left: {}\n    which: { connector: true }\n");
        demo.replace(
            "coordinator.yaml",
            "{ src: failed, tgt: held, events: [e_stop], effect: e_stopped }",
            &format!(
                "{{ src: failed, tgt: which, events: [e_stop] }}
    - {{ src: which, tgt: held, effect: e_stopped, events: [e_stop] }}
    - {{ src: which, tgt: held, {second}events: [e_stop] }}"
            ),
        );
        match second.is_empty() {
            true => assert!(alone(&demo).contains("let the subsystem emit an event")),
            false => assert!(told(&demo).is_empty(), "{:?}", told(&demo)),
        }
    }
    // One between passes it on, or does not.
    for passes_on in [false, true] {
        let demo = hall();
        hears(&demo);
        demo.replace("hall.yaml", "deployment: conveyor.yaml", "deployment: line.yaml");
        demo.write("line.yaml", &LINE.replace("deploy:  ", "safety: e_stop\nemits: [e_stopped]\ndeploy:  "));
        let stopped = "trans { src = 'off', tgt = 'raising', events = { 'e_start' } },";
        let all = ["raising", "on", "failed", "ending"];
        let passed = all.map(|from| {
            let effect = if passes_on { ", effect = 'e_stopped'" } else { "" };
            format!("  trans {{ src = '{from}', tgt = 'stopped', events = {{ 'inner/e_stopped' }}{effect} }},\n")
        });
        let own = all.map(|from| {
            format!("  trans {{ src = '{from}', tgt = 'stopped', events = {{ 'e_stop' }}, effect = 'e_stopped' }},\n")
        });
        let ends = "  trans { src = 'stopped', tgt = 'ending', events = { 'e_end' } },\n";
        let chart = LINE_COORDINATOR.replace("off = state {},", "off = state {}, stopped = state {},");
        demo.write(
            "line.lua",
            &chart.replace(stopped, &format!("{stopped}\n{}{}{ends}", own.concat(), passed.concat())),
        );
        demo.write("none.yaml", "configurations: {}\n");
        let found = told(&demo);
        let inner = found.iter().any(|one| one.contains("what `belt/inner/e_stop` has made safe"));
        assert_eq!(inner, !passes_on, "{found:?}\n{}", demo.run(&["check", "hall.yaml"]).err);
    }
}

/// Who follows that advice keeps it until people ask, too.
#[test]
fn a_stop_of_the_subsystem_alone_waits_for_people() {
    let story = "deploy('hall.yaml') wait_state('hall:open', 2) raise('e_close') wait(0.2) raise('belt/e_stop') wait(3)
        say('held ' .. #stack())
        raise('e_close') wait_state('hall:shut', 3) say('shut ' .. #stack())";
    let demo = hall();
    hears(&demo);
    demo.write("s.lua", story);
    let ran = demo.run(&["run", "s.lua", "--clock", "simulated", "--quiet"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    assert_eq!(ran.out.lines().collect::<Vec<_>>(), ["held 4", "shut 0"]);
}

/// A stop that is heard where one waits, and stays there, keeps nobody from going on.
#[test]
fn to_hear_it_and_stay_is_not_enough() {
    let demo = hall();
    demo.replace(
        "hall_coordinator.yaml",
        "    - { src: ending, tgt: removing",
        "    - { src: dimming, tgt: dimming, events: e_stop }\n    - { src: ending, tgt: removing",
    );
    assert_eq!(told(&demo).len(), 1);
}

/// Two coordinators of one file are no better than two files.
#[test]
fn so_is_one_that_another_coordinator_of_the_file_ends() {
    let demo = hall();
    demo.write("hall.yaml", &std::fs::read_to_string(demo.path("conveyor.yaml")).unwrap());
    demo.replace(
        "hall.yaml",
        "coordinator: coordinator.yaml",
        "coordinators: { belt: coordinator.yaml, lead: lead.yaml }",
    );
    demo.write(
        "lead.yaml",
        "coordinator:
  states: { here: {}, away: {} }
  transitions:
    - { src: initial, tgt: here }
    - { src: here, tgt: away, events: e_after(3), effect: e_end }
",
    );
    let found = told(&demo);
    assert!(
        found.iter().any(|one| one.contains("`e_end` is raised")),
        "{found:?}\n{}",
        demo.run(&["check", "hall.yaml"]).err
    );
}
