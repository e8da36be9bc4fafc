//! What a subsystem tells is told once, whether somebody waits for it or not: also where all that it may tell makes too much of its parent.

use super::composed::{catalogue, load};
use davit::check::{self, CheckVerdict, Effort, Report};
use davit::lang::Sources;

const POD: &str = "
davit: 1
name: pod
platform: simulated
types: { Esc: {} }
configurations: [pod_conf.yaml]
coordinator: pod_coord.yaml
deploy: { event: e_on, up: on, failed: [failed], within_s: 3 }
shutdown: { event: e_off, down: off, within_s: 3 }
";

const POD_CONF: &str = "
configurations:
  make: { changes: [{ create: { component: esc, type: Esc } }] }
";

const POD_COORDINATOR: &str = "
coordinator:
  states:
    off: {}
    alive:
      states: { making: { entry: make }, on: {}, failed: {}, removing: { entry: make.undo } }
      transitions:
        - { src: initial, tgt: making }
        - { src: making, tgt: on, events: [make.ok] }
        - { src: making, tgt: failed, events: [make.failed, make.broken] }
        - { src: removing, tgt: failed, events: [make.undo.failed, make.undo.broken] }
  transitions:
    - { src: initial, tgt: off }
    - { src: off, tgt: alive, events: [e_on] }
    - { src: alive, tgt: .alive.removing, events: [e_off] }
    - { src: alive, tgt: off, events: [make.undone] }
";

const TWO: &str = "
davit: 1
name: two
platform: simulated
types: { Lamp: {} }
subsystems: { port: { deployment: pod.yaml }, star: { deployment: pod.yaml } }
configurations: [two_conf.yaml]
coordinator: two_coord.yaml
deploy: { event: e_start, up: ready, within_s: 5 }
shutdown: { event: e_end, down: off, within_s: 5 }
";

/// It waits for one to be down, and then for the other; the way down begins in a state around all.
const TWO_COORDINATOR: &str = "
coordinator:
  states:
    off: {}
    alive:
      states:
        one: { entry: [port/e_on, star/e_on] }
        two: {}
        ready: {}
        three: { entry: [port/e_off, star/e_off] }
        four: {}
      transitions:
        - { src: initial, tgt: one }
        - { src: one, tgt: two, events: [port/up] }
        - { src: two, tgt: ready, events: [star/up] }
        - { src: three, tgt: four, events: [port/down, port/e_off.ignored] }
  transitions:
    - { src: initial, tgt: off }
    - { src: off, tgt: alive, events: [e_start] }
    - { src: alive, tgt: .alive.three, events: [e_end] }
    - { src: .alive.four, tgt: off, events: [star/down, star/e_off.ignored] }
";

fn checked(coordinator: String, transitions: usize) -> Report {
    let files = [
        ("pod.yaml", POD),
        ("pod_conf.yaml", POD_CONF),
        ("pod_coord.yaml", POD_COORDINATOR),
        ("two.yaml", TWO),
        ("two_conf.yaml", "configurations: {}\n"),
        ("two_coord.yaml", &coordinator),
    ];
    of_files(files, transitions)
}

fn of_files(files: [(&str, &str); 6], transitions: usize) -> Report {
    let deployment = load(&Sources::memory(files.map(|(name, text)| (name, text.to_owned()))), "two.yaml", &[])
        .deployment
        .expect("it can be read");
    let catalogue = catalogue(&deployment);
    check::run_with(deployment, &catalogue, Effort { transitions, ..Effort::default() })
}

/// Of the findings of one code what they say and what they say to do.
fn said(report: &Report, code: &str) -> Vec<(String, String)> {
    let of = report.findings.iter().filter(|finding| finding.code.0 == code);
    of.map(|finding| (finding.message.clone(), finding.help.clone().unwrap_or_default())).collect()
}

#[test]
fn that_one_was_down_before_anybody_waited_for_it_is_told_where_there_is_too_much_of_it() {
    let report = checked(TWO_COORDINATOR.to_owned(), 800_000);
    let message = "from `root.alive.three` only a second `e_end` leads down, and it is raised once".to_owned();
    let help = "`star/down` comes in `root.alive.three`, where no transition waits for it, and is told once: hear it there as well; else what \
                is left is taken down without the coordinator"
        .to_owned();
    assert_eq!(said(&report, "coord::no_way_down"), [(message, help)], "{:#?}", report.left);
    // What is left out, and that a larger budget does without.
    let bounds =
        |report: &Report| report.left.iter().filter(|bound| bound.contains("subsystems")).cloned().collect::<Vec<_>>();
    let [bound] = &bounds(&report)[..] else { panic!("{:#?}", report.left) };
    assert!(bound.starts_with("in which order subsystems tell things"), "{bound}");
    assert!(bound.ends_with("more than 300000 transitions (`--budget`)"), "{bound}");
    // Heard in either order.
    let hears = TWO_COORDINATOR
        .replace("four: {}", "four: {}\n        five: {}")
        .replace("        - { src: three, tgt: four,", "        - { src: three, tgt: five, events: [star/down, star/e_off.ignored] }\n        - { src: three, tgt: four,")
        + "    - { src: .alive.five, tgt: off, events: [port/down, port/e_off.ignored] }\n";
    // That something was ignored is told to who raised it: `three` is left with the first.
    let report = checked(hears.clone(), 800_000);
    let stops = said(&report, "coord::no_way_down");
    assert!(stops.len() == 1 && stops[0].0 == "from `root.alive.five` no way leads to `off`", "{stops:?}");
    let inside = "low: { entry: [port/e_off, star/e_off], states: { three: {}, four: {}, five: {} }, transitions: [
          { src: initial, tgt: three },
          { src: three, tgt: four, events: [port/down, port/e_off.ignored] },
          { src: three, tgt: five, events: [star/down, star/e_off.ignored] }] }";
    let hears = TWO_COORDINATOR
        .replace("three: { entry: [port/e_off, star/e_off] }\n        four: {}", inside)
        .replace("        - { src: three, tgt: four, events: [port/down, port/e_off.ignored] }\n", "")
        .replace(".alive.three", ".alive.low")
        .replace(".alive.four", ".alive.low.four")
        + "    - { src: .alive.low.five, tgt: off, events: [port/down, port/e_off.ignored] }\n";
    let report = checked(hears, 800_000);
    assert_eq!(said(&report, "coord::no_way_down"), []);
    assert!(matches!(report.verdict, CheckVerdict::Followed { .. }), "{:#?}", report.findings);
}

/// It says that it wants to leave, and waits until it is let go.
const LEAVING_POD: &str = "
davit: 1
name: pod
platform: simulated
types: { Esc: { properties: { gain: { type: float, default: 1.0 } } } }
configurations: [pod_conf.yaml]
coordinator: pod_coord.yaml
exports: { properties: { gain: esc.gain } }
accepts: [e_released]
emits: [e_leaving]
leaving: { says: e_leaving, until: e_released }
deploy: { event: e_on, up: on, failed: [failed], within_s: 3 }
shutdown: { event: e_off, down: off, within_s: 3 }
";

const LEAVING_POD_CONF: &str = "
configurations:
  make: { changes: [{ create: { component: esc, type: Esc } }], post_conf_state: [esc:running] }
";

const LEAVING_POD_COORDINATOR: &str = "
coordinator:
  states:
    off: {}
    alive:
      states: { making: { entry: make }, on: {}, failed: {}, leaving: { entry: e_leaving }, removing: { entry: make.undo } }
      transitions:
        - { src: initial, tgt: making }
        - { src: making, tgt: on, events: [make.ok] }
        - { src: making, tgt: failed, events: [make.failed, make.broken] }
        - { src: leaving, tgt: removing, events: [e_released] }
        - { src: removing, tgt: failed, events: [make.undo.failed, make.undo.broken] }
  transitions:
    - { src: initial, tgt: off }
    - { src: off, tgt: alive, events: [e_on] }
    - { src: alive, tgt: .alive.leaving, events: [e_off] }
    - { src: alive, tgt: off, events: [make.undone] }
";

const JOINED: &str = "
davit: 1
name: two
platform: simulated
types: { Lamp: {} }
subsystems: { port: { deployment: pod.yaml }, star: { deployment: pod.yaml } }
configurations: [two_conf.yaml]
coordinator: two_coord.yaml
deploy: { event: e_start, up: ready, failed: [failed], within_s: 5 }
shutdown: { event: e_end, down: off, within_s: 20 }
";

const JOINED_CONF: &str = "
configurations:
  join: { changes: [{ property_set: { property: port.gain, value: 2.0 } }, { property_set: { property: star.gain, value: 3.0 } }] }
";

/// It leads down what it has begun, or not, as `docs/composition.md` says.
const JOINED_COORDINATOR: &str = "
coordinator:
  states:
    off: {}
    alive:
      states:
        raising: { entry: [port/e_on, star/e_on] }
        one: {}
        two: {}
        joining: { entry: join }
        ready: {}
      transitions:
        - { src: initial, tgt: raising }
        - { src: raising, tgt: one, events: [port/up] }
        - { src: raising, tgt: two, events: [star/up] }
        - { src: one, tgt: joining, events: [star/up] }
        - { src: two, tgt: joining, events: [port/up] }
        - { src: joining, tgt: ready, events: [join.ok] }
    failed: {}
    down:
      states:
        parting: { entry: join.undo }
        lowering: { entry: [port/e_off, star/e_off, port/e_released, star/e_released] }
        three: {}
        four: {}
      transitions:
        - { src: initial, tgt: parting }
        - { src: parting, tgt: lowering, events: [join.undone, join.undo.failed, join.undo.broken] }
        - { src: lowering, tgt: three, events: [port/down, port/e_off.ignored] }
        - { src: lowering, tgt: four, events: [star/down, star/e_off.ignored] }
  transitions:
    - { src: initial, tgt: off }
    - { src: off, tgt: alive, events: [e_start] }
    - { src: alive, tgt: failed, events: [port/failed, star/failed, join.failed, join.broken] }
    - { src: alive, tgt: down, events: [port/e_leaving, star/e_leaving] }
    - { src: alive, tgt: down, events: [e_end] }
    - { src: failed, tgt: down, events: [e_end] }
    - { src: .down.three, tgt: off, events: [star/down, star/e_off.ignored] }
    - { src: .down.four, tgt: off, events: [port/down, port/e_off.ignored] }
";

#[test]
fn that_one_which_leaves_ignored_its_end_says_that_it_is_down_where_there_is_too_much_of_it() {
    let checked = |pod: &str| {
        let files = [
            ("pod.yaml", LEAVING_POD),
            ("pod_conf.yaml", LEAVING_POD_CONF),
            ("pod_coord.yaml", pod),
            ("two.yaml", JOINED),
            ("two_conf.yaml", JOINED_CONF),
            ("two_coord.yaml", JOINED_COORDINATOR),
        ];
        let report = of_files(files, 2_500);
        assert!(report.left.iter().any(|bound| bound.contains("in which order subsystems")), "{:#?}", report.left);
        report
    };
    let report = checked(LEAVING_POD_COORDINATOR);
    assert!(matches!(report.verdict, CheckVerdict::Followed { .. }), "{:#?}", report.findings);
    // One that ignores it in another state as well does not say that.
    let deaf =
        LEAVING_POD_COORDINATOR.replace("src: alive, tgt: .alive.leaving", "src: .alive.on, tgt: .alive.leaving");
    assert!(!said(&checked(&deaf), "compose::promise").is_empty());
}

/// A parent that makes `again` what is there where it comes to `trap`.
fn again(states: &str, transitions: &str) -> String {
    format!(
        "coordinator:
  states:
    off: {{}}
    own: {{ entry: own }}
    ready: {{}}
{states}
    trap: {{ entry: again }}
    down: {{ entry: [port/e_off, port/e_released] }}
    unown: {{ entry: own.undo }}
    left: {{}}
  transitions:
    - {{ src: initial, tgt: off }}
    - {{ src: off, tgt: own, events: [e_start] }}
    - {{ src: own, tgt: ready, events: [own.ok] }}
    - {{ src: own, tgt: down, events: [own.failed, own.broken, e_end] }}
    - {{ src: ready, tgt: down, events: [e_end] }}
{transitions}
    - {{ src: trap, tgt: down, events: [e_end, again.ok, again.failed, again.broken] }}
    - {{ src: down, tgt: unown, events: [port/down, port/e_off.ignored] }}
    - {{ src: unown, tgt: off, events: [own.undone] }}
    - {{ src: unown, tgt: left, events: [own.undo.failed, own.undo.broken] }}
    - {{ src: left, tgt: unown, events: [e_end] }}
"
    )
}

const AGAIN: &str = "
configurations:
  own: { changes: [{ create: { component: lamp, type: Lamp } }] }
  again: { changes: [{ create: { component: lamp, type: Lamp } }] }
";

/// Refusals that are found of a parent of one subsystem, where nothing is known of the order in which that tells things.
fn refused(pod: &str, pod_coordinator: &str, parent: &str) -> usize {
    let one = JOINED.replace("star: { deployment: pod.yaml }", "").replace("failed: [failed], ", "");
    let one = one.replace("{ deployment: pod.yaml }, }", "{ deployment: pod.yaml } }");
    let files = [
        ("pod.yaml", pod),
        ("pod_conf.yaml", LEAVING_POD_CONF),
        ("pod_coord.yaml", pod_coordinator),
        ("two.yaml", &one),
        ("two_conf.yaml", AGAIN),
        ("two_coord.yaml", parent),
    ];
    let report = of_files(files, 600);
    assert!(report.left.iter().any(|bound| bound.contains("in which order subsystems")), "{:#?}", report.left);
    said(&report, "coord::request_refused").len()
}

/// What is ignored of an event that was raised before a subsystem was begun says nothing of the life that has begun since.
#[test]
fn what_was_ignored_in_another_life_does_not_say_that_it_is_down() {
    let parent = again(
        "    cycle: { entry: [port/e_off, port/e_off], states: { w: {}, w1: {}, w2: {} }, transitions: [
      { src: initial, tgt: w }, { src: w, tgt: w1, events: [port/e_off.ignored], effect: [port/e_on] }, { src: w1, tgt: w2, events: [port/e_off.ignored] }] }",
        "    - { src: ready, tgt: cycle, events: [e_go] }
    - { src: .cycle.w2, tgt: trap, events: [port/up] }
    - { src: cycle, tgt: down, events: [e_end] }",
    );
    assert_eq!(refused(LEAVING_POD, LEAVING_POD_COORDINATOR, &parent), 1);
}

/// So does another event than the one that begins it.
#[test]
fn what_wakes_a_subsystem_lets_it_tell_what_it_tells() {
    let parent = again(
        "    kicked: { entry: port/e_kick }",
        "    - { src: ready, tgt: kicked, events: [e_go] }
    - { src: kicked, tgt: trap, events: [port/up] }
    - { src: kicked, tgt: down, events: [e_end] }",
    );
    let pod = LEAVING_POD.replace("accepts: [e_released]", "accepts: [e_released, e_kick]");
    let chart = LEAVING_POD_COORDINATOR.replace("events: [e_on]", "events: [e_on, e_kick]");
    assert_eq!(refused(&pod, &chart, &parent), 1);
}
