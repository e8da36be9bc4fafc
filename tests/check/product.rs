//! What a batch comes to, and which worlds are one: `check` follows what a running deployment does.

use crate::support::{Said, Small};

const BASE: &str = "base = Configuration { create(\"a\", \"Drive\"), post_conf_state = { \"a:stopped\" } },";

/// The undo and the push of one step: the push fails, and the undo stands.
#[test]
fn a_push_that_fails_leaves_the_undo_of_its_batch_in_force() {
    let states = |then: &str| {
        format!(
            "idle = state {{}}, up = state {{ config = \"one\" }}, other = state {{ config = \"two\" }}, after = state {{ entry = \"{then}\" }},
             trans {{ src = \"initial\", tgt = \"idle\" }},
             trans {{ src = \"idle\", tgt = \"up\", events = {{ \"e_start\" }} }},
             trans {{ src = \"up\", tgt = \"other\", events = {{ \"e_other\" }} }},
             trans {{ src = \"other\", tgt = \"after\", events = {{ \"two.failed\" }} }},
             trans {{ src = \"after\", tgt = \"idle\", events = {{ \"e_shutdown\" }}, effect = {{ \"again.undo\" }} }},
             trans {{ src = \"other\", tgt = \"idle\", events = {{ \"e_shutdown\" }} }},
             trans {{ src = \"up\", tgt = \"idle\", events = {{ \"e_shutdown\" }} }},"
        )
    };
    let configurations =
        "one = Configuration { create(\"a\", \"Drive\") }, two = Configuration { create(\"b\", \"Drive\") },
        again = Configuration { create(\"a\", \"Drive\") }, uses = Configuration { property_set(\"a.gain\", 2.0) },";
    let made = Small::new(configurations, &states("again"), "").check();
    assert!(made.refused("again").iter().all(|(severity, _)| *severity == "info"), "{:#}", made.0);
    let used = Small::new(configurations, &states("uses"), "").check();
    let refused = used.refused("uses");
    assert!(refused.iter().any(|(severity, _)| *severity == "warning"), "it was undone: {:#}", used.0);
}

/// A safe configuration goes first: the undo raised with it meets its frame.
#[test]
fn a_safe_configuration_is_no_part_of_its_batch() {
    let configurations = format!(
        "{BASE} run = Configuration {{ post_conf_state = {{ \"a:running\" }} }},
         stop = Configuration {{ safe = true, post_conf_state = {{ \"a:stopped\" }} }},"
    );
    let states = "idle = state {}, building = state { entry = \"base\" }, up = state { entry = \"run\" },
        stopping = state { entry = { \"run.undo\", \"stop\" } },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"up\", tgt = \"stopping\", events = { \"e_stop\" } },
        trans { src = \"stopping\", tgt = \"idle\", events = { \"e_shutdown\" }, effect = { \"stop.undo\", \"run.undo\", \"base.undo\" } },
        trans { src = \"building\", tgt = \"idle\", events = { \"e_shutdown\" }, effect = \"base.undo\" },
        trans { src = \"up\", tgt = \"idle\", events = { \"e_shutdown\" }, effect = { \"run.undo\", \"base.undo\" } },";
    let said = Small::new(&configurations, states, "").check();
    let refused = said.refused("run.undo");
    assert!(
        refused.iter().any(|(severity, message)| *severity == "error" && message.contains("before `stop`")),
        "{:#}",
        said.0
    );
}

/// Coming to *down* with something left ends nothing: what waits for its confirmation still does.
#[test]
fn down_with_something_left_is_no_end() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\") },
        tryout = Configuration { group = \"g\", confirm = { event = \"e_good\", within = 0.5 }, create(\"b\", \"Drive\") },
        bad = Configuration { property_set(\"b.gain\", 2.0) },";
    let states = "idle = state {}, up = state { entry = \"base\" }, odd = state { entry = \"bad\" },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"up\", events = { \"e_start\" } },
        trans { src = \"up\", tgt = \"idle\", events = { \"e_shutdown\" }, effect = \"base.undo\" },
        trans { src = \"up\", tgt = \"idle\", events = { \"e_try\" }, effect = { \"base.undo\", \"tryout\" } },
        trans { src = \"idle\", tgt = \"odd\", events = { \"tryout.reverted\" } },
        trans { src = \"odd\", tgt = \"idle\", events = { \"e_shutdown\" } },";
    let small = Small::new(configurations, states, "");
    let said = Said(small.demo.run(&["check", "small.yaml", "--json"]).json());
    assert!(!said.refused("bad").is_empty(), "{:#}", said.0);
    // And so it goes.
    let story = "deploy('small.yaml', {replay = true}) raise('e_start') wait_answer('base.ok', 1) raise('e_try')
        wait_answer('tryout.ok', 1) wait_answer('tryout.reverted', 1) wait_answer('bad.failed', 1)";
    small.demo.write("story.lua", story);
    let ran = small.demo.run(&["run", "story.lua", "--clock", "simulated", "--platform", "simulated"]);
    assert!(!ran.err.contains("davit::script"), "{}{}", ran.out, ran.err);
}

/// Answers of one batch come undos first, whatever the order in which they were raised.
#[test]
fn answers_come_undos_first() {
    let configurations = format!(
        "{BASE} one = Configuration {{ property_set(\"a.gain\", 2.0) }},
        two = Configuration {{ property_set(\"a.mode\", 1) }}, wrong = Configuration {{ create(\"a\", \"Drive\") }},"
    );
    let states = "idle = state {}, building = state { entry = \"base\" }, up = state { entry = \"one\" },
        both = state { entry = { \"two\", \"one.undo\" } }, undone = state {}, pushed = state { entry = \"wrong\" },
        leaving = state { entry = { \"two.undo\", \"one.undo\", \"base.undo\" } },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"up\", tgt = \"both\", events = { \"e_both\" } },
        trans { src = \"both\", tgt = \"undone\", events = { \"one.undone\", \"one.undo.failed\", \"one.undo.broken\" } },
        trans { src = \"both\", tgt = \"pushed\", events = { \"two.ok\" } },
        trans { src = \"pushed\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"undone\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },";
    let said = Small::new(&configurations, states, "").check();
    assert!(said.refused("wrong").is_empty(), "`pushed` is never reached: {:#}", said.0);
}

/// What is raised in two steps to rest is two batches: the push is tried though the undo before it failed.
#[test]
fn two_steps_to_rest_are_two_batches() {
    let configurations = format!(
        "{BASE} one = Configuration {{ property_set(\"a.gain\", 2.0) }},
        two = Configuration {{ create(\"b\", \"Drive\") }}, again = Configuration {{ create(\"b\", \"Drive\") }},"
    );
    let states = "idle = state {}, building = state { entry = \"base\" }, up = state { entry = \"one\" },
        first = state {}, second = state {}, waits = state {}, tried = state { entry = \"again\" },
        leaving = state { entry = { \"again.undo\", \"two.undo\", \"one.undo\", \"base.undo\" } },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"up\", tgt = \"first\", events = { \"e_both\" }, effect = \"one.undo\" },
        trans { src = \"first\", tgt = \"second\", events = { \"e_done\" }, effect = \"two\" },
        trans { src = \"second\", tgt = \"waits\", events = { \"one.undo.failed\" } },
        trans { src = \"waits\", tgt = \"tried\", events = { \"e_again\" } },
        trans { src = \"second\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"waits\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"tried\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },";
    let said = Small::new(&configurations, states, "").check();
    let refused = said.refused("again");
    assert!(!refused.is_empty(), "`two` is applied though `one.undo` failed: {:#}", said.0);
}

/// Two ways to one place; afterwards the same is asked for. `then` is refused only where it was the second way.
fn two_ways(configurations: &str, ways: [&str; 2], then: &str) -> Said {
    let states = format!(
        "idle = state {{}}, building = state {{ entry = \"base\" }}, up = state {{}},
         left = state {{ entry = {{ {} }} }}, right = state {{ entry = {{ {} }} }}, both = state {{}}, next = state {{ entry = {{ {then} }} }},
         leaving = state {{ entry = \"all\" }},
         trans {{ src = \"initial\", tgt = \"idle\" }},
         trans {{ src = \"idle\", tgt = \"building\", events = {{ \"e_start\" }} }},
         trans {{ src = \"building\", tgt = \"up\", events = {{ \"base.ok\" }} }},
         trans {{ src = \"up\", tgt = \"left\", events = {{ \"e_left\" }} }},
         trans {{ src = \"up\", tgt = \"right\", events = {{ \"e_right\" }} }},
         trans {{ src = \"left\", tgt = \"both\", events = {{ \"e_both\" }} }},
         trans {{ src = \"right\", tgt = \"both\", events = {{ \"e_both\" }} }},
         trans {{ src = \"both\", tgt = \"next\", events = {{ \"e_then\" }} }},",
        ways[0], ways[1]
    ) + &["building", "up", "left", "right", "both", "next"]
        .map(|state| format!("trans {{ src = \"{state}\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},"))
        .join(" ")
        + "trans { src = \"leaving\", tgt = \"idle\", events = { \"all.ok\" } },";
    let all = "all = Configuration { destroy(\"a\"), destroy(\"b\"), destroy(\"c\") },";
    let base = "base = Configuration { create(\"a\", \"Drive\"), create(\"b\", \"Drive\"), create(\"c\", \"Drive\") },";
    Small::new(&format!("{base} {all} {configurations}"), &states, "").check()
}

#[test]
fn a_connections_policy_tells_worlds_apart() {
    let configurations = "data = Configuration { connect(\"a.out\", \"b.in\", \"data\") },
        buffer = Configuration { connect(\"a.out\", \"b.in\", { buffer = 4 }) },
        more = Configuration { connect(\"c.out\", \"b.in\", { buffer = 4 }) },";
    for ways in [["\"data\"", "\"buffer\""], ["\"buffer\"", "\"data\""]] {
        let said = two_ways(configurations, ways, "\"more\"");
        assert!(said.refused("more").iter().any(|(severity, _)| *severity == "error"), "{ways:?}: {:#}", said.0);
    }
}

#[test]
fn a_frames_inverse_tells_worlds_apart() {
    // Undone, `run` leads to where it was applied from: unconfigured or stopped.
    let configurations = "stop = Configuration { post_conf_state = { \"a:stopped\" } },
        run = Configuration { post_conf_state = { \"a:running\" } },
        back = Configuration { property_set(\"a.address\", 3) },";
    for ways in [["\"run\"", "\"stop\", \"run\""], ["\"stop\", \"run\"", "\"run\""]] {
        let said = two_ways(configurations, ways, "\"run.undo\", \"back\"");
        assert!(said.refused("back").iter().any(|(severity, _)| *severity == "error"), "{ways:?}: {:#}", said.0);
    }
}

/// A value that is there already needs no step, and what needs no step cannot fail.
#[test]
fn a_value_that_decides_whether_a_step_is_needed_tells_worlds_apart() {
    let states = |first: &str, second: &str| {
        format!(
            "idle = state {{}}, building = state {{ entry = \"base\" }}, up = state {{}},
             left = state {{ entry = \"{first}\" }}, right = state {{ entry = \"{second}\" }}, both = state {{}}, next = state {{ entry = \"five\" }},
             failed = state {{ entry = \"wrong\" }}, leaving = state {{ entry = \"all\" }},
             trans {{ src = \"initial\", tgt = \"idle\" }},
             trans {{ src = \"idle\", tgt = \"building\", events = {{ \"e_start\" }} }},
             trans {{ src = \"building\", tgt = \"up\", events = {{ \"base.ok\" }} }},
             trans {{ src = \"up\", tgt = \"left\", events = {{ \"e_left\" }} }},
             trans {{ src = \"up\", tgt = \"right\", events = {{ \"e_right\" }} }},
             trans {{ src = \"left\", tgt = \"both\", events = {{ \"{first}.ok\" }} }},
             trans {{ src = \"right\", tgt = \"both\", events = {{ \"{second}.ok\" }} }},
             trans {{ src = \"both\", tgt = \"next\", events = {{ \"e_then\" }} }},
             trans {{ src = \"next\", tgt = \"failed\", events = {{ \"five.failed\" }} }},"
        ) + &["building", "up", "left", "right", "both", "next", "failed"]
            .map(|state| format!("trans {{ src = \"{state}\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},"))
            .join(" ")
            + "trans { src = \"leaving\", tgt = \"idle\", events = { \"all.ok\" } },"
    };
    let configurations = format!("{BASE} all = Configuration {{ destroy(\"a\") }}, wrong = Configuration {{ create(\"a\", \"Drive\") }},
        five = Configuration {{ property_set(\"a.gain\", 5.0) }}, set5 = Configuration {{ property_set(\"a.gain\", 5.0) }},
        set2 = Configuration {{ property_set(\"a.gain\", 2.0) }},");
    for (first, second) in [("set5", "set2"), ("set2", "set5")] {
        let said = Small::new(&configurations, &states(first, second), "").check();
        assert!(!said.refused("wrong").is_empty(), "{first}: {:#}", said.0);
    }
}

/// What nobody undoes by its name counts where it keeps something else from being undone.
#[test]
fn a_frame_in_the_way_tells_worlds_apart() {
    let configurations = "made = Configuration { create(\"d\", \"Drive\"), post_conf_state = { \"d:running\" } },
        call = Configuration { operation_call(\"d.lower\") },";
    let (alone, under) = ("\"made\"", "\"made\", \"call\"");
    let in_the_way = |ways: [&str; 2]| {
        let said = two_ways(configurations, ways, "\"made.undo\"");
        said.refused("made.undo").iter().filter(|(_, message)| message.contains("`call`")).count()
    };
    assert_eq!(in_the_way([alone, alone]), 0);
    assert!(in_the_way([alone, under]) > 0);
}

/// What nobody undoes by its name counts where it takes over a value: undone below it, that value stays.
#[test]
fn a_frame_that_takes_over_a_value_tells_worlds_apart() {
    let states = |first: &str, second: &str| {
        format!(
            "idle = state {{}}, building = state {{ entry = \"base\" }}, up = state {{}},
             left = state {{ entry = \"five\" }}, left2 = state {{ entry = {{ {first} }} }}, both = state {{}},
             right = state {{ entry = \"five\" }}, right2 = state {{ entry = {{ {second} }} }},
             back = state {{ entry = \"five.undo\" }}, next = state {{ entry = \"one\" }},
             failed = state {{ entry = \"wrong\" }}, leaving = state {{ entry = \"all\" }},
             trans {{ src = \"initial\", tgt = \"idle\" }},
             trans {{ src = \"idle\", tgt = \"building\", events = {{ \"e_start\" }} }},
             trans {{ src = \"building\", tgt = \"up\", events = {{ \"base.ok\" }} }},
             trans {{ src = \"up\", tgt = \"left\", events = {{ \"e_left\" }} }},
             trans {{ src = \"up\", tgt = \"right\", events = {{ \"e_right\" }} }},
             trans {{ src = \"left\", tgt = \"left2\", events = {{ \"five.ok\" }} }},
             trans {{ src = \"left2\", tgt = \"both\", events = {{ \"e_both\" }} }},
             trans {{ src = \"right\", tgt = \"right2\", events = {{ \"five.ok\" }} }},
             trans {{ src = \"right2\", tgt = \"both\", events = {{ \"e_both\" }} }},
             trans {{ src = \"both\", tgt = \"back\", events = {{ \"e_then\" }} }},
             trans {{ src = \"back\", tgt = \"next\", events = {{ \"five.undone\" }} }},
             trans {{ src = \"next\", tgt = \"failed\", events = {{ \"one.failed\" }} }},"
        ) + &["building", "up", "left", "left2", "right", "right2", "both", "back", "next", "failed"]
            .map(|state| format!("trans {{ src = \"{state}\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},"))
            .join(" ")
            + "trans { src = \"leaving\", tgt = \"idle\", events = { \"all.ok\" } },"
    };
    let configurations = format!("{BASE} all = Configuration {{ destroy(\"a\") }}, wrong = Configuration {{ create(\"a\", \"Drive\") }},
        five = Configuration {{ property_set(\"a.gain\", 5.0) }}, same = Configuration {{ property_set(\"a.gain\", 5.0) }},
        one = Configuration {{ property_set(\"a.gain\", 1.0) }},");
    let (alone, under) = ("", "\"same\"");
    for (first, second) in [(alone, under), (under, alone)] {
        let said = Small::new(&configurations, &states(first, second), "").check();
        assert!(!said.refused("wrong").is_empty(), "{first}: {:#}", said.0);
    }
    // Without it in the way the value is there already, and what needs no step cannot fail.
    let said = Small::new(&configurations, &states(alone, alone), "").check();
    assert!(said.refused("wrong").is_empty(), "{:#}", said.0);
    // Both at once: given up while it begins, the first goes back before the second goes on.
    let together = states(alone, under)
        .replace("right = state { entry = \"five\" }", "right = state { entry = { \"five\", \"same\" } }")
        .replace("tgt = \"right2\", events = { \"five.ok\" }", "tgt = \"both\", events = { \"e_both\" }");
    Small::new(&configurations, &together, "").check();
}

/// A state that is met first behind a request that fails, and later without any failure.
#[test]
fn a_state_is_judged_by_its_best_way() {
    let configurations = format!(
        "{BASE} all = Configuration {{ destroy(\"a\") }}, wrong = Configuration {{ create(\"a\", \"Drive\") }},
         soft = Configuration {{ property_set(\"a.gain\", 2.0) }},"
    );
    let states =
        "idle = state {}, building = state { entry = \"base\" }, up = state {}, trying = state { entry = \"soft\" },
        one = state {}, two = state {}, three = state {}, both = state {}, next = state { entry = \"wrong\" },
        leaving = state { entry = \"all\" },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"up\", tgt = \"trying\", events = { \"e_try\" } },
        trans { src = \"trying\", tgt = \"both\", events = { \"soft.failed\" } },
        trans { src = \"trying\", tgt = \"leaving\", events = { \"soft.ok\", \"soft.broken\", \"e_shutdown\" } },
        trans { src = \"up\", tgt = \"one\", events = { \"e_one\" } },
        trans { src = \"one\", tgt = \"two\", events = { \"e_two\" } },
        trans { src = \"two\", tgt = \"three\", events = { \"e_three\" } },
        trans { src = \"three\", tgt = \"both\", events = { \"e_both\" } },
        trans { src = \"both\", tgt = \"next\", events = { \"e_then\" } },
        trans { src = \"building\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"one\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"two\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"three\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"both\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"next\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"all.ok\" } },";
    let said = Small::new(&configurations, states, "").check();
    let refused = said.of("coord::request_refused").into_iter();
    let wrong: Vec<_> = refused.filter(|f| f["message"].as_str().unwrap().starts_with("`wrong`")).collect();
    assert!(wrong.iter().any(|f| f["severity"] == "error"), "{:#}", said.0);
    // And its way is the best one, too.
    let answers = Said::answers(wrong[0]);
    assert_eq!(answers, ["base.ok"], "{:#}", said.0);
}

/// A coordinator that goes round by itself asks without end: what is followed of it has a bound, and that is told.
#[test]
fn what_asks_without_end_is_followed_up_to_a_bound() {
    let configurations = format!(
        "{BASE} one = Configuration {{ property_set(\"a.gain\", 2.0) }}, two = Configuration {{ property_set(\"a.mode\", 1) }},"
    );
    let states = "idle = state {}, building = state { entry = \"base\" }, up = state {},
        ping = state { entry = \"one\" }, pong = state { entry = \"two\" },
        leaving = state { entry = \"base.undo\" },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"up\", tgt = \"ping\", events = { \"e_go\" } },
        trans { src = \"ping\", tgt = \"pong\", events = { \"e_done\" } },
        trans { src = \"pong\", tgt = \"ping\", events = { \"e_done\" } },
        trans { src = \"ping\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"pong\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },";
    let said = Small::new(&configurations, states, "").check().0;
    let left = said["left"].as_array().unwrap();
    assert!(left.iter().any(|left| left.as_str().unwrap().contains("more than 64 things")), "{said:#}");
    assert_eq!(said["explored"]["complete"], false);
    assert!(said["explored"]["states"].as_u64().unwrap() < 100_000, "{}", said["explored"]);
}

#[test]
fn what_had_not_begun_when_a_safe_configuration_came_is_no_way_of_a_script() {
    let small = Small::new(
        "build = Configuration { create('a', 'Drive') },
         gain = Configuration { property_set('a.gain', 2.0) },
         stop = Configuration { safe = true, property_set('a.gain', 0.0) }",
        "idle = state {},
         life = state { config = 'build',
           wait = state {}, up = state {}, high = state { config = 'gain' }, halted = state { config = 'stop' },
           trans { src = 'initial', tgt = 'wait' },
           trans { src = 'wait', tgt = 'up', events = { 'build.ok' } },
           trans { src = 'up', tgt = 'high', events = { 'e_high' } },
           trans { src = 'high', tgt = 'up', events = { 'e_low', 'gain.failed', 'gain.broken' } },
           trans { src = 'wait', tgt = 'halted', events = { 'e_stop' } },
           trans { src = 'halted', tgt = 'up', events = { 'e_reset', 'stop.failed' } } },
         leaving = state {}, fault = state {},
         trans { src = 'initial', tgt = 'idle' },
         trans { src = 'idle', tgt = 'life', events = { 'e_start' } },
         trans { src = 'life', tgt = 'fault', events = { 'build.failed', 'build.broken' } },
         trans { src = 'life', tgt = 'leaving', events = { 'e_shutdown' } },
         trans { src = 'leaving', tgt = 'idle', events = { 'build.undone' } }",
        "",
    );
    // Each way is gone by its script, or told to be none of a script's.
    let said = small.check();
    assert!(!said.refused("gain").is_empty(), "{:#}", said.0);
}

#[test]
fn what_cannot_be_taken_back_unconfirmed_is_told_with_its_way() {
    let small = Small::new(
        "base = Configuration { create('a', 'Drive') },
         x = Configuration { post_conf_state = { 'a:running' }, confirm = { event = 'e_conf', within = 1.0 } },
         y = Configuration { pre_conf_state = { 'a:running' }, operation_call('a.raise') }",
        "idle = state {}, b = state { entry = 'base' }, t = state { entry = 'x' }, up = state { entry = 'y' },
         d0 = state { entry = 'y.undo' }, d1 = state { entry = 'x.undo' }, d2 = state { entry = 'base.undo' },
         trans { src = 'initial', tgt = 'idle' },
         trans { src = 'idle', tgt = 'b', events = { 'e_start' } },
         trans { src = 'b', tgt = 't', events = { 'base.ok' } },
         trans { src = 't', tgt = 'up', events = { 'x.ok' } },
         trans { src = 't', tgt = 'd0', events = { 'x.failed', 'x.broken', 'e_shutdown' } },
         trans { src = 'up', tgt = 'd0', events = { 'y.failed', 'y.broken', 'e_shutdown' } },
         trans { src = 'd0', tgt = 'd1', events = { 'y.undone' } },
         trans { src = 'd1', tgt = 'd2', events = { 'x.undone' } },
         trans { src = 'd2', tgt = 'idle', events = { 'base.undone' } }",
        "",
    );
    let said = small.check();
    let all = said.of("coord::request_refused").into_iter();
    let unconfirmed: Vec<_> =
        all.filter(|f| f["message"].as_str().unwrap().contains("not confirmed within 1 s")).collect();
    let [finding] = unconfirmed[..] else { panic!("{:#}", said.0) };
    assert!(finding["message"].as_str().unwrap().starts_with("`x` cannot be taken back"), "{finding:#}");
    assert_eq!((finding["file"].as_str(), finding["line"].as_u64()), (Some("conf.lua"), Some(2)), "{finding:#}");
    assert_eq!(Said::answers(finding).last().map(String::as_str), Some("y.ok"), "{finding:#}");
    // Its script waits for the time to run out.
    let script = (1..40).map(|n| format!("way{n}.lua")).find(|script| {
        std::fs::read_to_string(small.demo.path(script))
            .is_ok_and(|text| text.contains("wait_answer(\"x.undo.failed\", 1)"))
    });
    assert!(script.is_some());
}

/// Up and down again while it goes down, with a stack that is full all the time: what waits for its place is forgotten when it
/// is over, whatever became of it.
#[test]
fn a_full_stack_has_no_more_states_than_there_are() {
    let configurations =
        "base = Configuration { create(\"a\", \"Drive\") }, one = Configuration { property_set(\"a.gain\", 3.0) },";
    let states = "idle = state {}, building = state { entry = \"base\" }, up = state { entry = \"one\" }, leaving = state { entry = \"base.undo\" },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"building\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },
        trans { src = \"leaving\", tgt = \"building\", events = { \"e_start\" } },";
    let small = Small::new(configurations, states, "limits: { stack: 2 }\n");
    let json = small.demo.run(&["check", "small.yaml", "--json"]).json();
    assert!(json["explored"]["states"].as_u64().unwrap() < 2000, "{:#}", json["explored"]);
}

/// Two orders lead to the same frames, with other numbers: what is held in the one is found again in the other, and what is
/// interrupted while the stack gets full is not squashed. (Which of the others is, is followed for one of the orders.)
#[test]
fn what_is_interrupted_holds_its_frame_whatever_its_number() {
    let safe = |id: &str| format!("{id} = Configuration {{ safe = true, property_set('z.gain', 0.0) }},");
    let configurations = "base = Configuration { create('a', 'Drive') }, zed = Configuration { create('z', 'Drive') },
        one = Configuration { group = 'g', property_set('a.gain', 2.0) },
        two = Configuration { group = 'g', property_set('a.gain', 3.0) },"
        .to_owned()
        + &["s1", "s2", "s3", "s4", "s5"].map(safe).concat();
    let states = "idle = state {}, stays = state {},
        leaving = state { entry = { 's2.undo', 's1.undo', 'two.undo', 'one.undo', 'base.undo' } },
        life = state { building = state { entry = 'base' }, up = state {},
          first = state { entry = 's1' }, other = state { entry = 'one' },
          one = state { entry = 'one' }, two = state { entry = 'two' },
          calm = state { entry = { 's1', 's2' }, third = state { config = 's3',
            fourth = state { config = 's4', fifth = state { config = 's5' }, trans { src = 'initial', tgt = 'fifth' } },
            trans { src = 'initial', tgt = 'fourth' } }, trans { src = 'initial', tgt = 'third' } },
          trans { src = 'initial', tgt = 'building' },
          trans { src = 'building', tgt = 'up', events = { 'base.ok' } },
          trans { src = 'up', tgt = 'first', events = { 'e_calm' } },
          trans { src = 'first', tgt = 'other', events = { 's1.ok' } },
          trans { src = 'up', tgt = 'one', events = { 'e_one' } },
          trans { src = 'one', tgt = 'two', events = { 'one.ok' } },
          trans { src = 'two', tgt = 'calm', events = { 'e_calm' } } },
        trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'life', events = { 'e_start' } },
        trans { src = 'life', tgt = 'leaving', events = { 'e_shutdown', 'base.failed', 'base.broken' } },
        trans { src = 'stays', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'leaving', tgt = 'idle', events = { 'base.undone' } },
        trans { src = 'leaving', tgt = 'stays', events = { 'base.undo.failed', 'base.undo.broken' } },";
    let small = Small::new(&configurations, states, "limits: { stack: 6 }\n");
    let said = Said(small.demo.run(&["check", "small.yaml", "--json"]).json());
    assert!(!said.refused("s1.undo").is_empty(), "it does get full: {:#}", said.0);
    assert!(said.refused("one.undo").is_empty(), "{:?}", said.refused("one.undo"));
}
