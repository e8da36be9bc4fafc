//! What is not sure is not called *sound*, nor refused for that alone.

use crate::support::Small;
use crate::verdicts::{BASE, by_base, said_and_run};

const ESTOP: &str = "trans { src = 'up', tgt = 'up', events = { 'e_estop' } },";

/// The verdict, and what was left out.
fn verdict(small: &Small) -> (String, String) {
    let said = small.check();
    (said.0["verdict"].as_str().unwrap().to_owned(), said.0["left"].to_string())
}

/// How a run ends that brings it up, does `then`, and takes it down.
fn run(small: &Small, then: &str) -> i32 {
    small.demo.write("run.lua", &format!("deploy('small.yaml')\nwait(0.1)\n{then}\n"));
    small.demo.run(&["run", "run.lua", "--clock", "simulated", "--platform", "simulated"]).code
}

/// What is reported a time after a step comes so late beside the main way down, too, and begins a time anew there.
#[test]
fn a_report_has_its_time_beside_the_main_way() {
    let conf = format!("{BASE}, park = Configuration {{ property_set('a.gain', 2.0) }}");
    let small = |delay: &str, cooling: &str| {
        let side = format!(
            "{ESTOP} side = state {{}}, c1 = state {{}}, c0 = state {{ entry = 'park' }}, cooling = state {{}}, un = state {{ entry = 'park.undo' }},
             trans {{ src = 'up', tgt = 'side', events = {{ 'e_side' }} }},
             trans {{ src = 'side', tgt = 'c1', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'c1', tgt = 'c0', events = {{ 'e_after(2.5)' }} }},
             trans {{ src = 'c0', tgt = 'cooling', events = {{ 'park.ok' }} }},
             trans {{ src = 'c0', tgt = 'un', events = {{ 'park.failed', 'park.broken' }} }},
             trans {{ src = 'un', tgt = 'leaving', events = {{ 'park.undone' }} }},
             trans {{ src = 'un', tgt = 'failed', events = {{ 'park.undo.failed', 'park.undo.broken' }} }}, {cooling}"
        );
        let states =
            by_base("up", "leaving", &side).replace("src = 'failed', tgt = 'leaving'", "src = 'failed', tgt = 'un'");
        let reaction = format!("{{ after: property_set a.gain = 2.0, delay_s: {delay}, raise: e_rep, component: a }}");
        Small::new(&conf, &states, &format!("safety: [e_estop]\nsimulated: {{ reactions: [{reaction}] }}\n"))
    };
    let reported = "trans { src = 'cooling', tgt = 'un', events = { 'e_rep' } },";
    let anew = "trans { src = 'cooling', tgt = 'cooling', events = { 'e_rep' } },
         trans { src = 'cooling', tgt = 'un', events = { 'e_after(1.5)' } },";
    let long = |lasts: &str| {
        vec![format!("the way down by `root.c1` lasts {lasts} s at least, and `shutdown.within_s` gives it 5 s")]
    };
    let cases = [
        ("3.0", reported, long("5.5"), 4),
        ("1.0", reported, Vec::new(), 0),
        ("1.4", anew, long("5.4"), 4),
        // It would come too late to begin it anew.
        ("1.6", anew, Vec::new(), 0),
    ];
    for (delay, cooling, told, exit) in cases {
        let small = small(delay, cooling);
        assert_eq!(
            said_and_run(&small, "coord::no_way_down", "raise('e_side') wait(0.1)"),
            (told, exit),
            "{delay} {cooling}"
        );
    }
}

/// Of two times that are over at the same moment either may come first.
#[test]
fn what_is_over_at_the_same_moment_is_told() {
    let told = "over at the same moment";
    let tick = "state { tick = state {}, trans { src = 'initial', tgt = 'tick' } }";
    let up = |inside: &str| {
        let warming = format!(
            "warming = {tick}, side = state {{}},
             trans {{ src = 'warming.tick', tgt = 'up', events = {{ 'e_after({inside})' }} }},
             trans {{ src = 'warming', tgt = 'side', events = {{ 'e_after(1.0)' }} }},
             trans {{ src = 'warming', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'side', tgt = 'leaving', events = {{ 'e_shutdown' }} }},"
        );
        Small::new(BASE, &by_base("warming", "leaving", &warming), "")
    };
    let (word, left) = verdict(&up("1.0"));
    assert!(word == "followed" && left.contains(told), "{word} {left}");
    assert_eq!(run(&up("1.0"), ""), 1);
    assert_eq!(verdict(&up("0.5")), ("sound".to_owned(), "[]".to_owned()));
    // On the way down, and beside it.
    let down = |stopped: &str, inside: &str| {
        let cooling = format!(
            "cooling = {tick}, blip = state {{}}, hot = state {{}},
             trans {{ src = 'cooling.tick', tgt = 'leaving', events = {{ 'e_after({inside})' }} }},
             trans {{ src = 'cooling', tgt = 'blip', events = {{ 'e_after(1.0)' }} }},
             trans {{ src = 'blip', tgt = 'cooling', events = {{ 'e_done' }} }},
             trans {{ src = 'up', tgt = 'hot', events = {{ 'e_hot' }} }},
             trans {{ src = 'hot', tgt = 'cooling', events = {{ 'e_shutdown' }} }},"
        );
        Small::new(BASE, &by_base("up", stopped, &cooling), "")
    };
    for (stopped, then) in [("cooling", ""), ("leaving", "raise('e_hot') wait(0.1)")] {
        let small = down(stopped, "1.0");
        let (word, left) = verdict(&small);
        assert!(word == "followed" && left.contains(told), "{stopped} {word} {left}");
        assert_eq!(run(&small, then), 4, "{stopped}");
        let small = down(stopped, "0.5");
        assert_eq!(verdict(&small), ("sound".to_owned(), "[]".to_owned()), "{stopped}");
        assert_eq!(run(&small, then), 0, "{stopped}");
    }
    // It is not refused for it.
    let conf = "base = Configuration { create('a', 'Drive'), post_conf_state = { 'a:running' } },
         park = Configuration { timeout = 10.0, holds = in_state('a', 'running'):for_at_least(1.0), property_set('a.gain', 2.0) }";
    let parking = "parking = state { entry = 'park' }, side = state {}, un = state { entry = 'park.undo' },
         trans { src = 'parking', tgt = 'side', events = { 'park.ok' } },
         trans { src = 'parking', tgt = 'un', events = { 'e_after(1.0)' } },
         trans { src = 'un', tgt = 'leaving', events = { 'park.undone' } },
         trans { src = 'parking', tgt = 'failed', events = { 'park.failed', 'park.broken' } },
         trans { src = 'un', tgt = 'failed', events = { 'park.undo.failed', 'park.undo.broken' } },";
    let small = Small::new(conf, &by_base("up", "parking", parking), "");
    let said = small.check();
    assert!(said.of("deploy::never_down").is_empty() && said.0["left"].to_string().contains(told), "{:#}", said.0);
    assert_eq!(run(&small, ""), 0);
}

/// One that goes from `idle` to `up` at once and tells `x_1`.
const TELLS: &str = "idle = state {}, up = state {}, trans { src = 'initial', tgt = 'idle' },
    trans { src = 'idle', tgt = 'up', events = { 'e_start' }, effect = { 'x_1' } },
    trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },";

/// A way is driven in one order of what happens by itself; where another one leads elsewhere neither is sure.
#[test]
fn a_way_that_depends_on_the_order_of_answers_is_not_sure() {
    let of = |from: &str, keys: &str| {
        let aside = format!(
            "side = state {{}}, trans {{ src = '{from}', tgt = 'side', events = {{ 'x_1' }} }},
             trans {{ src = 'side', tgt = 'leaving', events = {{ 'e_shutdown' }} }},"
        );
        let coordinators = [("one", TELLS), ("two", &by_base("up", "leaving", &aside))];
        let small = Small::several(BASE, &coordinators, "emits: [x_1]\n");
        small.demo.replace("small.yaml", "up: up,", &format!("up: up,{keys}"));
        small
    };
    let small = of("building", "");
    let (word, left) = verdict(&small);
    assert!(word == "followed" && left.contains("another one leads elsewhere"), "{word} {left}");
    assert_eq!(run(&small, ""), 1);
    // It comes before it is up.
    let small = of("up", " failed: [side],");
    let said = small.check();
    let severities: Vec<_> = said.of("deploy::never_up").iter().map(|found| found["severity"].clone()).collect();
    assert_eq!(severities, ["warning"], "{:#}", said.0);
    assert_eq!(run(&small, ""), 0);
    let small = of("idle", "");
    assert!(!verdict(&small).1.contains("another one leads elsewhere"));
}

/// How many events come before all have heard, and how many frames an operator has in force, is always said.
#[test]
fn what_is_followed_of_several_is_always_said() {
    let text = |small: &Small| small.demo.run(&["check", "small.yaml"]).out;
    let (event, frames) = ("at most one event from outside before", "at most 2 frames of an operator in force");
    let conf = format!("{BASE}, soft = Configuration {{ property_set('a.gain', 2.0) }}");
    let one = text(&Small::new(&conf, &by_base("up", "leaving", ""), ""));
    assert!(!one.contains(event) && !one.contains(frames), "{one}");
    let operated = text(&Small::new(&conf, &by_base("up", "leaving", ""), "operator: [soft]\n"));
    assert!(!operated.contains(event) && operated.contains(frames), "{operated}");
    let several = [("one", TELLS), ("two", &by_base("up", "leaving", ""))];
    let several = text(&Small::several(&conf, &several, "emits: [x_1]\n"));
    assert!(several.contains(event) && !several.contains(frames), "{several}");
}

/// A safe frame of an operator is followed alone: that is said where there may be another one.
#[test]
fn a_safe_frame_and_another_one_of_an_operator_are_told() {
    let conf = format!(
        "{BASE}, calm = Configuration {{ safe = true, property_set('a.gain', 0.0) }}, soft = Configuration {{ property_set('a.mode', 1) }}"
    );
    let of = |keys: &str| verdict(&Small::new(&conf, &by_base("up", "leaving", ""), keys));
    assert!(of("operator: [soft]\n").1.contains("several are in force at once"));
    assert!(!of("").1.contains("several are in force at once"));
}

/// From six coordinators on no event is followed that comes before all have heard: that is said.
#[test]
fn too_many_coordinators_to_follow_an_event_in_between_are_told() {
    let hears = "idle = state {}, trans { src = 'initial', tgt = 'idle' }, trans { src = 'idle', tgt = 'idle', events = { 'x_1' } },";
    let names = ["z0", "z1", "z2", "z3", "z4"];
    let of = |count: usize| {
        let mut all = vec![("one", TELLS)];
        all.extend(names[..count].iter().map(|name| (*name, hears)));
        let small = Small::several(BASE, &all, "emits: [x_1]\n");
        let up = names[..count].iter().map(|name| format!(", '{name}:idle'")).collect::<String>();
        small.demo.replace("small.yaml", "up: up", &format!("up: ['one:up'{up}]"));
        verdict(&small).1
    };
    let told = "before all coordinators have heard";
    assert!(of(5).contains(told) && !of(2).contains(told), "{} {}", of(5), of(2));
}

/// What leads up again, and came just before the event that ends the deployment, is heard behind it.
#[test]
fn what_leads_up_again_is_told() {
    let again = "trans { src = 'idle', tgt = 'building', events = { 'e_on' } },
         trans { src = 'up', tgt = 'leaving', events = { 'e_off' } },";
    let small = Small::new(BASE, &by_base("up", "leaving", again), "");
    let (word, left) = verdict(&small);
    assert!(word == "followed" && left.contains("leads up from where all are down"), "{word} {left}");
    assert_eq!(run(&small, "raise('e_off') wait(0.1) raise('e_on')"), 4);
    let small = Small::new(BASE, &by_base("up", "leaving", ""), "");
    assert_eq!(verdict(&small), ("sound".to_owned(), "[]".to_owned()));
}

/// It is wanted up once.
#[test]
fn what_begins_the_deployment_comes_once() {
    let waits = "waits = state {}, trans { src = 'waits', tgt = 'up', events = { 'e_start' } },
         trans { src = 'waits', tgt = 'leaving', events = { 'e_shutdown' } },";
    let small = Small::new(BASE, &by_base("waits", "leaving", waits), "");
    let never = "the bring-up stops at `root.waits` and never reaches `up`".to_owned();
    assert_eq!(said_and_run(&small, "deploy::never_up", ""), (vec![never], 1));
}

/// What has to stand longer than it has time is false whatever others do.
#[test]
fn what_cannot_stand_so_long_is_told_also_of_what_others_have() {
    let of = |lasts: &str| {
        let parking = "parking = state { entry = 'park' }, un = state { entry = 'park.undo' },
             trans { src = 'parking', tgt = 'up', events = { 'park.ok' } },
             trans { src = 'parking', tgt = 'un', events = { 'park.failed', 'park.broken', 'park.lost', 'e_shutdown' } },
             trans { src = 'un', tgt = 'leaving', events = { 'park.undone' } },
             trans { src = 'un', tgt = 'failed', events = { 'park.undo.failed', 'park.undo.broken' } },";
        let conf = format!(
            "{BASE}, lamp = Configuration {{ create('b', 'Drive'), post_conf_state = {{ 'b:running' }} }},
             park = Configuration {{ timeout = 1.0, holds = in_state('b', 'running'):for_at_least({lasts}), property_set('a.gain', 2.0) }}"
        );
        let lamp = by_base("up", "leaving", "").replace("base", "lamp");
        let small = Small::several(&conf, &[("one", &by_base("parking", "un", parking)), ("two", &lamp)], "");
        // No script goes the way to what never becomes true.
        let said = small.demo.run(&["check", "small.yaml", "--json"]).json();
        said["findings"].as_array().unwrap().iter().filter(|found| found["code"] == "conf::holds_never").count()
    };
    assert_eq!((of("5.0"), of("0.5")), (1, 0));
}

/// What coordinators tell each other is not mistaken for a slip.
#[test]
fn what_another_coordinator_tells_is_no_slip() {
    let tells = by_base(
        "up",
        "leaving",
        "trans { src = 'up', tgt = 'up', events = { 'e_a' }, effect = { 'e_arm_off' } },
        trans { src = 'up', tgt = 'up', events = { 'e_arm_on' } },",
    );
    let of = |effect: &str| {
        let hears = "idle = state {}, up = state {}, trans { src = 'initial', tgt = 'idle' },
            trans { src = 'idle', tgt = 'up', events = { 'e_start' } }, trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },
            trans { src = 'up', tgt = 'up', events = { 'e_arm_off' } },";
        let keys = "emits: [e_arm_off]\nsimulated: { reactions: [{ after: create a, delay_s: 0.2, raise: e_arm_on, component: a }] }\n";
        let small = Small::several(BASE, &[("one", &tells.replace("'e_arm_off'", effect)), ("two", hears)], keys);
        small.check().of("coord::near_event").len()
    };
    assert_eq!((of("'e_arm_off'"), of("")), (0, 1));
}

/// Where it is raised, too: what is waited for and nobody raises was meant.
#[test]
fn a_slip_in_what_is_raised_for_another_coordinator_names_what_is_waited_for() {
    let tells =
        by_base("up", "leaving", "trans { src = 'up', tgt = 'up', events = { 'e_a' }, effect = { 'e_arm_maed' } },");
    let hears = "idle = state {}, up = state {}, trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'up', events = { 'e_start' } }, trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },
        trans { src = 'up', tgt = 'up', events = { 'e_arm_made' } },";
    let help = |tells: &str| {
        let said = Small::several(BASE, &[("one", tells), ("two", hears)], "").check();
        let help = |f: &serde_json::Value| f["help"].as_str().unwrap().to_owned();
        said.of("coord::unknown_request").into_iter().map(help).collect::<Vec<_>>()
    };
    assert_eq!(help(&tells), ["did you mean `e_arm_made`, which is waited for and nobody raises?"]);
    let told = help(&tells.replace("e_arm_maed", "e_something_else"));
    assert!(told.len() == 1 && told[0].ends_with("is listed under `emits`"), "{told:?}");
}

#[test]
fn a_slip_in_what_another_coordinator_tells_is_one() {
    let tells =
        by_base("up", "leaving", "trans { src = 'up', tgt = 'up', events = { 'e_a' }, effect = { 'e_arm_made' } },");
    let of = |event: &str| {
        let hears = format!(
            "idle = state {{}}, up = state {{}}, away = state {{}}, trans {{ src = 'initial', tgt = 'idle' }},
            trans {{ src = 'idle', tgt = 'up', events = {{ 'e_start' }} }}, trans {{ src = 'up', tgt = 'idle', events = {{ 'e_shutdown' }} }},
            trans {{ src = 'up', tgt = 'away', events = {{ 'e_arm_made' }} }}, trans {{ src = 'away', tgt = 'up', events = {{ '{event}' }} }},
            trans {{ src = 'away', tgt = 'idle', events = {{ 'e_shutdown' }} }},"
        );
        Small::several(BASE, &[("one", &tells), ("two", &hears)], "").check().of("coord::near_event").len()
    };
    assert_eq!((of("e_arm_maed"), of("e_arm_made"), of("e_back")), (1, 0, 0));
}

/// Whoever hears what another one's component reports is followed with it.
#[test]
fn who_hears_what_anothers_component_reports_is_followed_with_it() {
    let reports = "simulated: { reactions: [{ after: create a, delay_s: 0.2, raise: e_rep, component: a }] }\n";
    let waits = "idle = state {}, waiting = state {}, up = state {}, trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'waiting', events = { 'e_start' } }, trans { src = 'waiting', tgt = 'up', events = { 'e_rep' } },
        trans { src = 'waiting', tgt = 'idle', events = { 'e_shutdown' } }, trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },";
    let of = |keys: &str| {
        let small = Small::several(BASE, &[("one", &by_base("up", "leaving", "")), ("two", waits)], keys);
        small.check().0["explored"]["states"].as_u64().unwrap()
    };
    assert!(of(reports) > 2 * of(""), "{} {}", of(reports), of(""));
}
