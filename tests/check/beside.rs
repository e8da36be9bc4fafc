//! Several coordinators: who is blamed, and what is said of them together.

use crate::support::{Said, Small};

fn holder(name: &str, also: &str) -> String {
    format!(
        "idle = state {{}}, up = state {{ config = \"{name}_base\", low = state {{}}, high = state {{ config = \"{name}_high\" }},
           trans {{ src = \"initial\", tgt = \"low\" }},
           trans {{ src = \"low\", tgt = \"high\", events = {{ \"e_{name}_up\" }} }},
           trans {{ src = \"high\", tgt = \"low\", events = {{ \"e_{name}_down\" }} }},
         }},
         trans {{ src = \"initial\", tgt = \"idle\" }},
         trans {{ src = \"idle\", tgt = \"up\", events = {{ \"e_start\" }} }},
         trans {{ src = \"up\", tgt = \"idle\", events = {{ \"e_shutdown\"{also} }} }},"
    )
}

/// The gripper's `high` touches the arm's drive; the lamp has nothing to do with either.
#[test]
fn a_refusal_is_blamed_on_those_who_share_a_component() {
    let own = |name: &str, of: &str| {
        format!(
            "{name}_base = Configuration {{ create(\"{name}Drive\", \"Drive\"), post_conf_state = {{ \"{name}Drive:running\" }} }},
             {name}_high = Configuration {{ property_set(\"{of}Drive.gain\", 5.0) }},"
        )
    };
    // The lamp emits something that the others hear, so that it is followed with them.
    let lamp = holder("lamp", "").replace("idle = state {}", "idle = state { entry = \"e_lamp\" }");
    let said = Small::several(
        &format!("{}{}{}", own("arm", "arm"), own("gripper", "arm"), own("lamp", "lamp")),
        &[("arm", &holder("arm", ", \"e_lamp\"")), ("gripper", &holder("gripper", ", \"e_lamp\"")), ("lamp", &lamp)],
        "emits: [e_lamp]\n",
    )
    .check();
    let found = said.of("coord::refused_by_other");
    assert!(!found.is_empty(), "{:#}", said.0);
    for finding in found {
        let message = finding["message"].as_str().unwrap();
        assert!(!message.contains("`lamp`"), "{message}");
        assert!(!finding["trace"].as_array().unwrap().is_empty());
    }
}

/// Batches of two coordinators are under way at the same time: each may end first.
#[test]
fn every_order_of_endings_is_followed() {
    let other = |name: &str| {
        format!(
            "idle = state {{}}, up = state {{ entry = \"{name}\" }}, done = state {{ entry = \"e_{name}\" }}, leaving = state {{ entry = \"{name}.undo\" }},
             trans {{ src = \"initial\", tgt = \"idle\" }},
             trans {{ src = \"idle\", tgt = \"up\", events = {{ \"e_start\" }} }},
             trans {{ src = \"up\", tgt = \"done\", events = {{ \"{name}.ok\" }} }},
             trans {{ src = \"done\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},
             trans {{ src = \"up\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},
             trans {{ src = \"leaving\", tgt = \"idle\", events = {{ \"{name}.undone\", \"e_shutdown\" }} }},"
        )
    };
    // The second one asks for something that is wrong when the first one is ready before it.
    let second = other("two")
        + "late = state { entry = \"wrong\" }, trans { src = \"up\", tgt = \"late\", events = { \"e_one\" } },
           trans { src = \"late\", tgt = \"leaving\", events = { \"e_shutdown\" } },";
    let said = Small::several(
        "one = Configuration { create(\"a\", \"Drive\") }, two = Configuration { create(\"b\", \"Drive\") },
         wrong = Configuration { destroy(\"nothing\"), create(\"nothing\", \"Drive\") },",
        &[("first", &other("one")), ("second", &second)],
        "emits: [e_one, e_two]\n",
    )
    .check();
    assert!(!said.refused("wrong").is_empty(), "{:#}", said.0);
}

/// `plan --bringup` and `--shutdown` show what all of them ask for.
#[test]
fn all_coordinators_are_driven_together() {
    let own = |name: &str| {
        format!(
            "{name}_base = Configuration {{ create(\"{name}Drive\", \"Drive\") }}, {name}_high = Configuration {{ property_set(\"{name}Drive.gain\", 5.0) }},"
        )
    };
    let small = Small::several(
        &format!("{}{}", own("arm"), own("gripper")),
        &[("arm", &holder("arm", "")), ("gripper", &holder("gripper", ""))],
        "",
    );
    for (way, requests) in
        [("--bringup", ["arm_base", "gripper_base"]), ("--shutdown", ["arm_base.undo", "gripper_base.undo"])]
    {
        let json = small.demo.run(&["plan", "small.yaml", way, "--json"]).json();
        let asked = json.to_string();
        for request in requests {
            assert!(asked.contains(request), "{way}: {request}: {json:#}");
        }
    }
}

/// Two coordinators with a component each, which share nothing but what an operator may apply.
fn two_apart(both: &str, keys: &str) -> Small {
    let own = |name: &str, component: &str| format!("{name} = Configuration {{ create('{component}', 'Drive') }},");
    // Back to where it was without being shut down: what an operator has put in the way is not taken along.
    let coordinator = |name: &str| {
        format!(
            "idle = state {{}}, up = state {{ config = '{name}' }},
             trans {{ src = 'initial', tgt = 'idle' }},
             trans {{ src = 'idle', tgt = 'up', events = {{ 'e_start' }} }},
             trans {{ src = 'up', tgt = 'idle', events = {{ 'e_shutdown', 'e_{name}_off' }} }},"
        )
    };
    Small::several(
        &format!("{}{}{both}", own("left", "a"), own("right", "b")),
        &[("left", &coordinator("left")), ("right", &coordinator("right"))],
        keys,
    )
}

/// What `check` says, the ways to what it finds not gone: of two coordinators these are many.
fn said(small: &Small) -> Said {
    Said(small.demo.run(&["check", "small.yaml", "--json"]).json())
}

/// Whether a request is refused because of an operator.
fn is_refused(said: &Said, request: &str) -> bool {
    let found = said.of("coord::refused_by_other");
    let mut messages = found.iter().map(|finding| finding["message"].as_str().unwrap());
    messages.any(|m| m.starts_with(&format!("`{request}` of ")) && m.contains("because of the frames of an operator"))
}

/// What an operator may apply touches what both touch: they are followed together with it, and what it bars is found, as it is
/// where it runs.
#[test]
fn what_an_operator_applies_to_both_is_followed_with_both() {
    for changes in [
        "property_set('a.gain', 2.0), property_set('b.gain', 2.0)",
        "connect('a.out', 'b.in')",
        "safe = true, post_conf_state = { 'a:stopped', 'b:stopped' }",
    ] {
        let small = two_apart(&format!("both = Configuration {{ {changes} }},"), "operator: [both]\n");
        let said = said(&small);
        assert!(is_refused(&said, "left.undo") && is_refused(&said, "right.undo"), "{changes}: {:#}", said.0);
        let shared = said.of("coord::shared");
        assert_eq!(shared.len(), 1, "{changes}: {:#}", said.0);
        let message = shared[0]["message"].as_str().unwrap();
        let why = "`both`, which an operator may apply, touches `a` like the coordinator `left`, and `b` like `right`:";
        assert!(message.starts_with(why), "{message}");
        // And so it goes.
        let story = "deploy('small.yaml', { replay = true }) raise('e_start') wait_answer('left.ok', 1) wait_answer('right.ok', 1)
            apply('both') wait_answer('both.ok', 1) raise('e_left_off') wait_answer('left.undo.failed', 1)
            raise('e_right_off') wait_answer('right.undo.failed', 1)";
        small.demo.write("story.lua", story);
        let ran = small.demo.run(&["run", "story.lua", "--clock", "simulated", "--platform", "simulated"]);
        assert!(!ran.err.contains("davit::script"), "{changes}: {}{}", ran.out, ran.err);
    }
}

/// What an operator applies to one of them is followed with that one, and what touches nobody with nobody else.
#[test]
fn what_an_operator_applies_to_one_joins_nobody() {
    let soft = "soft = Configuration { property_set('a.gain', 2.0) }, own = Configuration { create('c', 'Drive') },";
    let small = two_apart(soft, "operator: [soft, own]\n");
    // Each of the ways is gone: a script of one of several names the coordinator whose state it waits for.
    let found = small.check();
    assert!(found.of("coord::shared").is_empty(), "{:#}", found.0);
    assert!(is_refused(&found, "left.undo") && !is_refused(&found, "right.undo"), "{:#}", found.0);
    // What each of them is followed with is its own alone.
    let soft =
        "one = Configuration { property_set('a.gain', 2.0) }, other = Configuration { property_set('b.gain', 2.0) },";
    let states = |operator: &str| {
        let found = said(&two_apart(soft, &format!("operator: [{operator}]\n")));
        found.0["explored"]["states"].as_u64().unwrap()
    };
    assert_eq!(states("one, other") - states("other"), states("one") - states(""));
    // Safe ones stop everybody, whatever they touch: nothing that moves is done for `right` while one is in force.
    let stop = "stop = Configuration { safe = true, post_conf_state = { 'a:stopped' } },";
    let found = said(&two_apart(stop, ""));
    assert!(found.of("coord::shared").is_empty(), "{:#}", found.0);
    assert!(is_refused(&found, "left.undo") && !is_refused(&found, "right.undo"), "{:#}", found.0);
}

/// Up by its own configuration when `first` comes, and down from there by `stopped`.
fn alone(of: &str, first: &str, stopped: &str) -> String {
    format!(
        "idle = state {{}}, building = state {{ entry = '{of}' }}, up = state {{}}, leaving = state {{ entry = '{of}.undo' }},
         failed = state {{}},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'building', events = {{ '{first}' }} }},
         trans {{ src = 'building', tgt = 'up', events = {{ '{of}.ok' }} }},
         trans {{ src = 'building', tgt = 'failed', events = {{ '{of}.failed', '{of}.broken' }} }},
         trans {{ src = 'building', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         {stopped}
         trans {{ src = 'failed', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ '{of}.undone' }} }},
         trans {{ src = 'leaving', tgt = 'failed', events = {{ '{of}.undo.failed', '{of}.undo.broken' }} }},"
    )
}

const TWO: &str = "base = Configuration { create('a', 'Drive') }, lamp = Configuration { create('b', 'Drive') }";
const AT_ONCE: &str = "trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown' } },";

/// They are down where all of them are at once.
#[test]
fn that_one_followed_apart_goes_on_when_it_is_down_is_told() {
    let cools = "cooling = state {}, trans { src = 'up', tgt = 'cooling', events = { 'e_shutdown' } },
         trans { src = 'cooling', tgt = 'leaving', events = { 'e_after(3.0)' } },";
    let cases = [
        ("e_after(1.0)", cools, "", 4, "followed"),
        ("e_lamp", AT_ONCE, "raise('e_lamp')", 4, "followed"),
        ("e_start", cools, "", 0, "sound"),
    ];
    for (first, stopped, raised, exit, verdict) in cases {
        let (main, aux) = (alone("base", "e_start", stopped), alone("lamp", first, AT_ONCE));
        let small = Small::several(TWO, &[("main", &main), ("aux", &aux)], "");
        if first == "e_lamp" {
            small.demo.replace("small.yaml", "up: up", "up: ['main:up', 'aux:idle']");
        }
        let said = small.check();
        assert_eq!(said.0["verdict"], verdict, "{first} {:#}", said.0);
        let told =
            said.0["left"].as_array().unwrap().iter().filter(|left| left.as_str().unwrap().contains("down already"));
        assert_eq!(told.count(), usize::from(verdict == "followed"), "{first} {:#}", said.0);
        small.demo.write("run.lua", &format!("deploy('small.yaml')\nwait(0.1)\n{raised}\n"));
        let ran = small.demo.run(&["run", "run.lua", "--clock", "simulated"]);
        assert_eq!(ran.code, exit, "{first} {}{}", ran.out, ran.err);
    }
}

/// What another one emits while a time runs begins that anew.
#[test]
fn what_another_one_emits_late_counts_in_how_long_the_way_down_lasts() {
    let two = |turns: &str| {
        let stopped = "cooling = state {}, trans { src = 'up', tgt = 'cooling', events = { 'e_shutdown' } },
             trans { src = 'cooling', tgt = 'cooling', events = { 'x_1' } },
             trans { src = 'cooling', tgt = 'leaving', events = { 'e_after(4.0)' } },";
        let tells = format!(
            "idle = state {{}}, up = state {{}}, turning = state {{}}, told = state {{ entry = 'x_1' }},
             trans {{ src = 'initial', tgt = 'idle' }},
             trans {{ src = 'idle', tgt = 'up', events = {{ 'e_start' }} }},
             trans {{ src = 'up', tgt = 'turning', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'turning', tgt = 'told', events = {{ 'e_after({turns})' }} }},
             trans {{ src = 'told', tgt = 'idle', events = {{ 'e_done' }} }},"
        );
        Small::several(BASE, &[("one", &alone("base", "e_start", stopped)), ("two", &tells)], "emits: [x_1]\n")
    };
    for (turns, told) in [("3.0", 1), ("0.5", 0)] {
        let small = two(turns);
        let said = small.check();
        let found = said.of("deploy::never_down");
        assert_eq!(found.len(), told, "{:#}", said.0);
        assert!(found.iter().all(|f| f["message"].as_str().unwrap().starts_with("the shutdown lasts 7 s at least")));
        small.demo.write("run.lua", "deploy('small.yaml')\nwait(0.1)\n");
        let ran = small.demo.run(&["run", "run.lua", "--clock", "simulated"]);
        // What is refused is not even started.
        assert_eq!(ran.code, i32::from(told == 1), "{}{}", ran.out, ran.err);
    }
}

const BASE: &str = "base = Configuration { create('a', 'Drive') }";
/// The states of one that goes from `up` to `idle`, with what is in `up`.
fn going(up: &str, transitions: &str) -> String {
    format!(
        "idle = state {{}}, up = state {{ {up} }},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'up', events = {{ 'e_start' }} }},
         trans {{ src = 'up', tgt = 'idle', events = {{ 'e_shutdown' }} }}, {transitions}"
    )
}

/// One that has the component `b` while it is up, and asks for it once more in `trap`.
fn trapped(up: &str) -> String {
    format!(
        "idle = state {{}}, off = state {{ entry = 'cb.undo' }}, left = state {{}},
         up = state {{ entry = 'cb', t0 = state {{}}, {up} trans {{ src = 'initial', tgt = 't0' }} }},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'up', events = {{ 'e_start' }} }},
         trans {{ src = 'up', tgt = 'off', events = {{ 'e_shutdown', 'cb.failed', 'cb.broken' }} }},
         trans {{ src = 'off', tgt = 'idle', events = {{ 'cb.undone' }} }},
         trans {{ src = 'off', tgt = 'left', events = {{ 'cb.undo.failed', 'cb.undo.broken' }} }},
         trans {{ src = 'left', tgt = 'off', events = {{ 'e_shutdown' }} }},"
    )
}

const TRAP: &str = "trap = state { entry = 'bad' }, after = state {},
    trans { src = 'trap', tgt = 'after', events = { 'bad.failed', 'bad.broken' } },";
const AGAIN: &str = "cb = Configuration { create('b', 'Drive') }, bad = Configuration { create('b', 'Drive') },";

/// What was left out, of what is sound else.
fn left(small: &Small) -> Vec<String> {
    let said = said(small);
    let word = said.0["verdict"].as_str().unwrap();
    let left: Vec<String> =
        said.0["left"].as_array().unwrap().iter().map(|of| of.as_str().unwrap().to_owned()).collect();
    assert_eq!(word, if left.is_empty() { "sound" } else { "followed" }, "{:#}", said.0);
    left
}

/// What is urgent overtakes what was told before it, also where one coordinator tells both to another.
#[test]
fn what_is_urgent_overtakes_what_was_told_before() {
    let one = going(
        "s0 = state {}, s1 = state { entry = { 'x_1', 'e_estop' } },
         trans { src = 'initial', tgt = 's0' }, trans { src = 's0', tgt = 's1', events = { 'e_a' } },",
        "",
    );
    let up = |urgent: &str| {
        format!(
            "t1 = state {{}}, t3 = state {{}}, {TRAP} trans {{ src = 't0', tgt = 't1', events = {{ 'x_1' }} }},
             trans {{ src = 't0', tgt = 't3', events = {{ '{urgent}' }} }}, trans {{ src = 't3', tgt = 'trap', events = {{ 'x_1' }} }},"
        )
    };
    let of = |safety: &str| {
        let keys = format!("emits: [x_1, e_estop]\n{safety}");
        said(&Small::several(AGAIN, &[("one", &one), ("two", &trapped(&up("e_estop")))], &keys))
    };
    assert!(!of("safety: [e_estop]\n").refused("bad").is_empty());
    // In its turn it comes behind.
    assert!(of("").refused("bad").is_empty());
}

/// Of an urgent event one waits: told again before it is heard it is the same.
#[test]
fn an_urgent_event_that_waits_is_one_with_the_next() {
    let one = "idle = state {}, first = state { entry = 'e_tick' }, up = state { entry = 'e_tick' },
         trans { src = 'initial', tgt = 'idle' },
         trans { src = 'idle', tgt = 'first', events = { 'e_start' } },
         trans { src = 'first', tgt = 'up', events = { 'e_done' } },
         trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },";
    let two = "idle = state {}, w0 = state {}, w1 = state {}, up = state {},
         trans { src = 'initial', tgt = 'idle' },
         trans { src = 'idle', tgt = 'w0', events = { 'e_start' } },
         trans { src = 'w0', tgt = 'w1', events = { 'e_tick' } },
         trans { src = 'w1', tgt = 'up', events = { 'e_tick' } },
         trans { src = 'w0', tgt = 'idle', events = { 'e_shutdown' } },
         trans { src = 'w1', tgt = 'idle', events = { 'e_shutdown' } },
         trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },";
    let of = |safety: &str| {
        let keys = format!("emits: [e_tick]\n{safety}");
        said(&Small::several("base = Configuration { create('a', 'Drive') },", &[("one", one), ("two", two)], &keys))
    };
    assert!(!of("safety: [e_tick]\n").of("deploy::never_up").is_empty());
    assert!(of("").of("deploy::never_up").is_empty());
}

/// What only coordinators tell each other is raised by nobody else; what people may raise as well is followed as that.
#[test]
fn what_coordinators_tell_each_other_comes_of_them_alone() {
    // It never comes to where it would tell it.
    let one = going("s0 = state {}, s1 = state { entry = 'e_halt' }, trans { src = 'initial', tgt = 's0' },", "");
    let two = trapped(&format!("{TRAP} trans {{ src = 't0', tgt = 'trap', events = {{ 'e_halt' }} }},"));
    let of = |safety: &str| {
        let keys = format!("emits: [e_halt]\n{safety}");
        Small::several(AGAIN, &[("one", &one), ("two", &two)], &keys)
    };
    let (theirs, anybodys) = (of(""), of("safety: [e_halt]\n"));
    assert!(said(&theirs).refused("bad").is_empty());
    assert!(!said(&anybodys).refused("bad").is_empty());
    let script = "deploy('small.yaml') wait(0.1) say(select(2, pcall(raise, 'e_halt')))";
    theirs.demo.write("raise.lua", script);
    let ran = theirs.demo.run(&["run", "raise.lua", "--clock", "simulated"]);
    assert!(ran.out.contains("what coordinators tell each other"), "{}{}", ran.out, ran.err);
}

/// An event that comes before the last one was heard by all is not followed; that is said where the order matters.
#[test]
fn what_comes_before_all_have_heard_is_told_where_it_matters() {
    let of = |one: &str, up: &str, configurations: &str| {
        let keys = "emits: [x_1, x_2]\n";
        let one = going(&format!("s0 = state {{}}, trans {{ src = 'initial', tgt = 's0' }}, {one}"), "");
        left(&Small::several(configurations, &[("one", &one), ("two", &trapped(up))], keys))
    };
    let told = |left: &[String]| left.iter().any(|line| line.contains("before all coordinators have heard"));
    // `e_b` may overtake what `e_a` leads to.
    let tells = "s1 = state { entry = { 'x_1', 'x_2' } }, s2 = state {}, s9 = state {}, trans { src = 's0', tgt = 's1', events = { 'e_a' } },
         trans { src = 's1', tgt = 's2', events = { 'e_b' } }, trans { src = 's0', tgt = 's9', events = { 'e_b' } },";
    let hears = "t1 = state {}, t2 = state {}, t3 = state {}, trans { src = 't0', tgt = 't1', events = { 'x_1' } },
         trans { src = 't1', tgt = 't2', events = { 'e_b' } }, trans { src = 't0', tgt = 't3', events = { 'e_b' } },";
    let trap = format!("{hears} {TRAP} trans {{ src = 't3', tgt = 'trap', events = {{ 'x_1' }} }},");
    assert!(told(&of(tells, &trap, AGAIN)));
    // Two times at one moment.
    let later =
        "s1 = state { entry = 'x_1' }, s2 = state {}, trans { src = 's0', tgt = 's1', events = { 'e_after(1.0)' } },
         trans { src = 's0', tgt = 's2', events = { 'x_2' } },";
    let crossed = format!(
        "t1 = state {{}}, t3 = state {{ entry = 'x_2' }}, {TRAP} trans {{ src = 't0', tgt = 't1', events = {{ 'x_1' }} }},
         trans {{ src = 't0', tgt = 't3', events = {{ 'e_after(1.0)' }} }}, trans {{ src = 't3', tgt = 'trap', events = {{ 'x_1' }} }},"
    );
    assert!(told(&of(later, &crossed, AGAIN)));
    // Whatever comes first, nothing is asked for.
    assert_eq!(of(tells, hears, "cb = Configuration { create('b', 'Drive') },"), [""; 0]);
}

/// One that has `base` while it is up, and more by what is in `up`.
fn based(base: &str, begins: &str, up: &str) -> String {
    format!(
        "idle = state {{}}, building = state {{ entry = '{base}' }}, up = state {{}}, leaving = state {{ entry = '{base}.undo' }},
         failed = state {{}},
         trans {{ src = 'initial', tgt = 'idle' }}, trans {{ src = 'idle', tgt = 'building', events = {{ '{begins}' }} }},
         trans {{ src = 'building', tgt = 'up', events = {{ '{base}.ok' }} }},
         trans {{ src = 'building', tgt = 'failed', events = {{ '{base}.failed', '{base}.broken' }} }},
         trans {{ src = 'building', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'failed', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ '{base}.undone' }} }},
         trans {{ src = 'leaving', tgt = 'failed', events = {{ '{base}.undo.failed', '{base}.undo.broken' }} }}, {up}"
    )
}

/// Several frames of an operator at once are not followed; that is said where they matter together.
#[test]
fn several_frames_of_an_operator_are_told_where_they_matter() {
    let of = |second: &str| {
        let configurations = format!(
            "base = Configuration {{ create('a', 'Drive'), create('b', 'Drive'), create('c', 'Drive'), connect('a.out', 'b.in') }},
             x = Configuration {{ destroy('c'), create('c', 'Drive') }},
             p1 = Configuration {{ disconnect('a.out', 'b.in') }}, p2 = Configuration {{ {second} }},"
        );
        let up = "on = state { entry = 'x' }, off = state { entry = 'x.undo' },
             trans { src = 'up', tgt = 'on', events = { 'e_a' } }, trans { src = 'on', tgt = 'off', events = { 'e_shutdown' } },
             trans { src = 'on', tgt = 'failed', events = { 'x.failed', 'x.broken' } },
             trans { src = 'off', tgt = 'leaving', events = { 'x.undone' } },
             trans { src = 'off', tgt = 'failed', events = { 'x.undo.failed', 'x.undo.broken' } },";
        let states =
            based("base", "e_start", up).replace("src = 'failed', tgt = 'leaving'", "src = 'failed', tgt = 'off'");
        left(&Small::new(&configurations, &states, "operator: [p1, p2]\n"))
    };
    let together = of("connect('c.out', 'b.in')");
    assert!(together.iter().any(|line| line.contains("several are in force at once")), "{together:?}");
    assert_eq!(of("property_set('b.gain', 2.0)"), [""; 0]);
}

/// An operator's frames for those that are followed apart may be squashed into one: that is said.
#[test]
fn an_operators_frames_for_several_are_told() {
    let of = |operator: &str| {
        let configurations =
            "base = Configuration { create('a', 'Drive') }, lamp = Configuration { create('b', 'Drive') },
             pa = Configuration { property_set('a.gain', 2.0) }, pb = Configuration { property_set('b.gain', 2.0) },";
        let small = Small::several(
            configurations,
            &[("one", &based("base", "e_start", "")), ("two", &based("lamp", "e_start", ""))],
            &format!("operator: [{operator}]\nlimits: {{ stack: 2 }}\n"),
        );
        left(&small)
    };
    assert!(of("pa, pb").iter().any(|line| line.contains("squashed into one")));
    // What one alone meets is not tied; but whoever is followed apart may begin again while it is led down.
    let alone = of("pa");
    assert!(alone.len() == 1 && alone[0].contains("begins again"), "{alone:?}");
}
