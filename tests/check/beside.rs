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
