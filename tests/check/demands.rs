//! What is demanded: of safety events, of what is lost, of what is confirmed, of what broke; and advice that is true.

use crate::support::Small;

const STATES: &str = "idle = state {}, building = state { entry = \"base\" }, up = state {}, gone = state {}, leaving = state { entry = \"base.undo\" },
    failed = state {},
    trans { src = \"initial\", tgt = \"idle\" },
    trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
    trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
    trans { src = \"building\", tgt = \"failed\", events = { \"base.failed\", \"base.broken\" } },
    trans { src = \"failed\", tgt = \"leaving\", events = { \"e_shutdown\" } },
    trans { src = \"building\", tgt = \"leaving\", events = { \"e_shutdown\" } },
    trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
    trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },
    trans { src = \"leaving\", tgt = \"failed\", events = { \"base.undo.failed\", \"base.undo.broken\" } },";

#[test]
fn a_safety_event_leads_to_a_safe_configuration_wherever_an_actuator_exists() {
    let configurations = "base = Configuration { create(\"arm\", \"Arm\"), create(\"a\", \"Drive\") },
        stop = Configuration { safe = true, property_set(\"a.gain\", 0.0) },";
    let stopped = "stopped = state { entry = \"stop\" }, trans { src = \"stopped\", tgt = \"leaving\", events = { \"e_shutdown\" }, effect = \"stop.undo\" },";
    let hears = |from: &[&str]| {
        from.iter()
            .map(|state| format!("trans {{ src = \"{state}\", tgt = \"stopped\", events = {{ \"e_estop\" }} }},"))
            .collect::<String>()
    };
    let keys = "safety: [e_estop]\n";
    let some = Small::new(configurations, &format!("{STATES}{stopped}{}", hears(&["building", "up"])), keys).check();
    let found = some.of("coord::safety_unheard");
    assert_eq!(found.len(), 1, "{:#}", some.0);
    assert_eq!(found[0]["severity"], "error");
    assert!(found[0]["message"].as_str().unwrap().contains("root.leaving"), "{:#}", found[0]);
    assert!(found[0]["trace"].as_array().unwrap().len() > 2, "{:#}", found[0]);
    // Where the components are gone, or a safe configuration is in force already, nothing is demanded.
    let all = hears(&["building", "up", "leaving", "failed"]);
    let heard = Small::new(configurations, &format!("{STATES}{stopped}{all}"), keys).check();
    assert!(heard.of("coord::safety_unheard").is_empty(), "{:#}", heard.0);
    // Without an actuator it is nobody's business.
    let harmless = configurations.replace("create(\"arm\", \"Arm\"), ", "");
    let none = Small::new(&harmless, &format!("{STATES}{stopped}{}", hears(&["up"])), keys).check();
    assert!(none.of("coord::safety_unheard").is_empty(), "{:#}", none.0);
    // Heard, but answered by something else: on the way to the safe configuration an event from outside is needed.
    let detour = format!("{STATES}{stopped}{all}").replace(
        "trans { src = \"up\", tgt = \"stopped\", events = { \"e_estop\" } }",
        "trans { src = \"up\", tgt = \"gone\", events = { \"e_estop\" } }, trans { src = \"gone\", tgt = \"stopped\", events = { \"e_sure\", \"e_estop\" } }",
    );
    let late = Small::new(configurations, &detour, keys).check();
    let found = late.of("coord::safety_unheard");
    assert!(found.len() == 1 && found[0]["message"].as_str().unwrap().contains("root.up"), "{:#}", late.0);
}

/// Where what a safety event asks for is not safe, that is said, before all that comes of it.
#[test]
fn a_safe_configuration_that_is_not_called_so_is_told_first() {
    let configurations = "base = Configuration { create(\"arm\", \"Arm\"), create(\"a\", \"Drive\") },
        stop = Configuration { SAFE property_set(\"a.gain\", 0.0) },";
    let stopped = "stopped = state { entry = \"stop\" }, trans { src = \"stopped\", tgt = \"leaving\", events = { \"e_shutdown\" }, effect = \"stop.undo\" },";
    let hears: String = ["building", "up", "leaving", "failed"]
        .iter()
        .map(|state| format!("trans {{ src = \"{state}\", tgt = \"stopped\", events = {{ \"e_estop\" }} }},"))
        .collect();
    let said = |safe: &str| {
        let configurations = configurations.replace("SAFE", safe);
        Small::new(&configurations, &format!("{STATES}{stopped}{hears}"), "safety: [e_estop]\n").check()
    };
    assert!(said("safe = true,").of("coord::safety_unheard").is_empty());
    let forgotten = said("");
    let first = &forgotten.0["findings"][0];
    let told = "`e_estop` leads to `root.stopped` and asks for `stop`, which is not `safe`";
    assert_eq!(
        (first["message"].as_str(), first["severity"].as_str()),
        (Some(told), Some("error")),
        "{:#}",
        forgotten.0
    );
    assert!(first["help"].as_str().unwrap().starts_with("write `safe"), "{first:#}");
    assert!(first["trace"].as_array().unwrap().len() > 2, "{first:#}");
}

#[test]
fn what_is_lost_is_heard_wherever_it_may_be_in_force() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\"), post_conf_state = { \"a:running\" }, holds = in_state(\"a\", \"running\") },";
    let demo = |more: &str| Small::new(configurations, &format!("{STATES}{more}"), "").check();
    let silent = demo("");
    let found = silent.of("coord::lost_unheard");
    assert_eq!(found.len(), 1, "{:#}", silent.0);
    assert!(found[0]["message"].as_str().unwrap().contains("base.lost"), "{:#}", found[0]);
    let everywhere: String = ["up", "building", "leaving", "failed"]
        .iter()
        .map(|state| format!("trans {{ src = \"{state}\", tgt = \"failed\", events = {{ \"base.lost\" }} }},"))
        .collect();
    let heard = demo(&everywhere);
    assert!(heard.of("coord::lost_unheard").is_empty(), "{:#}", heard.0);
}

/// What somebody has stopped since is watched no more, as long as it is in force: there is nothing to hear of it.
#[test]
fn what_was_stopped_since_is_not_lost() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\"), post_conf_state = { \"a:running\" }, holds = in_state(\"a\", \"running\") },
        rest = Configuration { post_conf_state = { \"a:stopped\" } },
        tune = Configuration { property_set(\"a.gain\", 2.0) },";
    let said = |other: &str| {
        let heard: String = ["up", "building", "leaving", "failed"]
            .iter()
            .map(|state| format!("trans {{ src = \"{state}\", tgt = \"failed\", events = {{ \"base.lost\" }} }},"))
            .collect();
        let more = format!(
            "resting = state {{ entry = \"{other}\" }}, rested = state {{}},
             trans {{ src = \"up\", tgt = \"resting\", events = {{ \"e_rest\" }} }},
             trans {{ src = \"resting\", tgt = \"rested\", events = {{ \"{other}.ok\" }} }},
             trans {{ src = \"resting\", tgt = \"failed\", events = {{ \"{other}.failed\", \"{other}.broken\" }} }},
             trans {{ src = \"resting\", tgt = \"leaving\", events = {{ \"e_shutdown\", \"base.lost\" }}, effect = \"{other}.undo\" }},
             trans {{ src = \"rested\", tgt = \"leaving\", events = {{ \"e_shutdown\" }}, effect = \"{other}.undo\" }},"
        );
        Small::new(configurations, &format!("{STATES}{more}{heard}"), "").check()
    };
    let rests = said("rest");
    assert!(rests.of("coord::lost_unheard").is_empty(), "{:#}", rests.0);
    let tunes = said("tune");
    let found = tunes.of("coord::lost_unheard");
    assert!(found.len() == 1 && found[0].to_string().contains("root.rested"), "{:#}", tunes.0);
}

/// A platform that is found to differ is a loss too: where it is listened to, it is followed.
#[test]
fn what_is_found_to_differ_is_followed_where_it_is_heard() {
    let configurations = "base = Configuration { create(\"arm\", \"Arm\") }, stop = Configuration { safe = true, post_conf_state = { \"arm:stopped\" } },";
    let stopped = "stopped = state { entry = \"stop\" }, trans { src = \"stopped\", tgt = \"leaving\", events = { \"e_shutdown\" }, effect = \"stop.undo\" },";
    let heard: String = ["building", "up", "leaving", "failed"]
        .iter()
        .map(|state| format!("trans {{ src = \"{state}\", tgt = \"stopped\", events = {{ \"e_estop\" }} }},"))
        .collect();
    let lost = "odd = state {}, trans { src = \"up\", tgt = \"odd\", events = { \"base.lost\" } }, trans { src = \"odd\", tgt = \"leaving\", events = { \"e_shutdown\" } },";
    let said = |more: &str| {
        Small::new(configurations, &format!("{STATES}{stopped}{heard}{more}"), "safety: [e_estop]\n").check()
    };
    assert!(said("").of("coord::safety_unheard").is_empty());
    let said = said(lost);
    let found = said.of("coord::safety_unheard");
    assert!(found.len() == 1 && found[0]["message"].as_str().unwrap().contains("root.odd"), "{:#}", said.0);
    assert!(said.of("coord::lost_unheard").is_empty(), "nobody has to listen: {:#}", said.0);
}

/// A frame that is not confirmed is taken back, and what is asked for then does not fit any more.
#[test]
fn what_is_reverted_is_followed() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\") },
        try = Configuration { create(\"b\", \"Drive\"), confirm = { event = \"e_fine\", within = 1.0 } },
        use = Configuration { property_set(\"b.gain\", 2.0) },";
    let states = format!(
        "{STATES} trying = state {{ entry = \"try\" }}, using = state {{ entry = \"use\" }},
         trans {{ src = \"up\", tgt = \"trying\", events = {{ \"e_try\" }} }},
         trans {{ src = \"trying\", tgt = \"using\", events = {{ \"try.reverted\" }} }},
         trans {{ src = \"trying\", tgt = \"leaving\", events = {{ \"e_shutdown\" }}, effect = \"try.undo\" }},
         trans {{ src = \"using\", tgt = \"leaving\", events = {{ \"e_shutdown\" }}, effect = \"try.undo\" }},"
    );
    let said = Small::new(configurations, &states, "").check();
    let refused = said.refused("use");
    assert!(refused.iter().any(|(_, message)| message.contains("there is no component `b`")), "{:#}", said.0);
}

/// That a frame was taken back unconfirmed is no answer to the state that asked: it is heard wherever the coordinator is by
/// then, in the running deployment too (the script of the way), and has to be.
#[test]
fn what_is_reverted_is_heard_wherever_the_coordinator_is() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\") },
        try = Configuration { create(\"b\", \"Drive\"), confirm = { event = \"e_fine\", within = 1.0 } },
        use = Configuration { property_set(\"b.gain\", 2.0) },";
    let said = |heard: &str| {
        let states = format!(
            "{STATES} trying = state {{ entry = \"try\" }}, tried = state {{}}, using = state {{ entry = \"use\" }},
             trans {{ src = \"up\", tgt = \"trying\", events = {{ \"e_try\" }} }},
             trans {{ src = \"trying\", tgt = \"tried\", events = {{ \"try.ok\", \"try.failed\", \"try.broken\" }} }},
             trans {{ src = \"{heard}\", tgt = \"using\", events = {{ \"try.reverted\" }} }},
             trans {{ src = \"trying\", tgt = \"leaving\", events = {{ \"e_shutdown\" }}, effect = \"try.undo\" }},
             trans {{ src = \"tried\", tgt = \"leaving\", events = {{ \"e_shutdown\" }}, effect = \"try.undo\" }},
             trans {{ src = \"using\", tgt = \"leaving\", events = {{ \"e_shutdown\" }}, effect = \"try.undo\" }},"
        );
        Small::new(configurations, &states, "").check()
    };
    let heard = said("tried");
    let refused = heard.refused("use");
    assert!(refused.iter().any(|(_, message)| message.contains("there is no component `b`")), "{:#}", heard.0);
    // On the way down its own undo takes it back; behind one that failed it is said, and no more.
    let behind = heard.of("coord::reverted_unheard");
    assert!(behind.iter().all(|found| found["severity"] == "info"), "{:#}", heard.0);
    // Only in the state that asked, which is left by then.
    let deaf = said("trying");
    assert!(deaf.refused("use").iter().all(|(severity, _)| *severity == "info"), "{:#}", deaf.0);
    let found = deaf.of("coord::reverted_unheard");
    assert_eq!(found.len(), 1, "{:#}", deaf.0);
    assert_eq!(found[0]["severity"], "warning");
    let message = found[0]["message"].as_str().unwrap();
    assert!(message.contains("`try.reverted` in root.tried"), "{message}");
}

/// What confirms may come while it is still being applied, here and in the running deployment; and what came before it was asked for does
/// not count.
#[test]
fn what_is_confirmed_before_its_answer_is_not_taken_back() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\") },
        try = Configuration { create(\"b\", \"Drive\"), confirm = { event = \"e_fine\", within = 1.0 } },";
    // The event that it is asked for on, and the one that leads to where nobody hears that it was taken back.
    let unheard = |asks: &str, leads: &str| {
        let states = format!(
            "{STATES} trying = state {{ entry = \"try\" }}, tried = state {{}},
             trans {{ src = \"up\", tgt = \"trying\", events = {{ \"{asks}\" }} }},
             trans {{ src = \"trying\", tgt = \"tried\", events = {{ \"{leads}\" }} }},
             trans {{ src = \"trying\", tgt = \"up\", events = {{ \"try.failed\", \"try.broken\", \"try.reverted\" }} }},
             trans {{ src = \"trying\", tgt = \"leaving\", events = {{ \"e_shutdown\" }}, effect = \"try.undo\" }},
             trans {{ src = \"tried\", tgt = \"leaving\", events = {{ \"e_shutdown\" }}, effect = \"try.undo\" }},"
        );
        let said = Small::new(configurations, &states, "").check();
        said.of("coord::reverted_unheard").iter().filter(|found| found["severity"] == "warning").count()
    };
    assert_eq!(unheard("e_try", "e_fine"), 0);
    assert_eq!(unheard("e_fine", "try.ok"), 1);
    assert_eq!(unheard("e_try", "try.ok"), 1);
}

/// After something broke, a safety event must be heard still.
#[test]
fn after_broken_safety_events_are_heard() {
    let configurations = "base = Configuration { create(\"arm\", \"Arm\") }, stop = Configuration { safe = true, post_conf_state = { \"arm:stopped\" } },";
    let more = "stopped = state { entry = \"stop\" }, trans { src = \"stopped\", tgt = \"leaving\", events = { \"e_shutdown\" }, effect = \"stop.undo\" },
        trans { src = \"building\", tgt = \"stopped\", events = { \"e_estop\" } }, trans { src = \"up\", tgt = \"stopped\", events = { \"e_estop\" } },
        trans { src = \"leaving\", tgt = \"stopped\", events = { \"e_estop\" } },";
    // In `failed` after `base.failed` there is no arm; after `base.broken` there may be one.
    let broken = STATES.replace(
        "trans { src = \"leaving\", tgt = \"failed\", events = { \"base.undo.failed\", \"base.undo.broken\" } },",
        "",
    );
    let said = Small::new(configurations, &format!("{broken}{more}"), "safety: [e_estop]\n").check();
    let found = said.of("coord::safety_unheard");
    assert_eq!(found.len(), 1, "{:#}", said.0);
    assert!(found[0]["message"].as_str().unwrap().contains("root.failed"), "{:#}", found[0]);
    assert_eq!(found[0]["severity"], "warning");
    assert!(crate::support::Said::answers(found[0]).contains(&"base.broken".to_owned()), "{:#}", found[0]);
}

/// The event that ends the deployment is raised once: where it takes two of them, nothing ever comes down.
#[test]
fn one_shutdown_event_leads_down() {
    let configurations =
        "base = Configuration { create(\"a\", \"Drive\") }, park = Configuration { property_set(\"a.gain\", 0.0) },";
    let parked = STATES.replace(
        "trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },",
        "parked = state { entry = \"park\" }, trans { src = \"up\", tgt = \"parked\", events = { \"e_shutdown\" } },
         trans { src = \"parked\", tgt = \"leaving\", events = { LEADS }, effect = \"park.undo\" },",
    );
    let said = |leads: &str| Small::new(configurations, &parked.replace("LEADS", leads), "").check();
    let twice = said("\"e_shutdown\"");
    let found = twice.of("coord::no_way_down");
    assert!(found.len() == 1 && found[0]["severity"] == "warning", "{:#}", twice.0);
    assert!(
        found[0]["message"].as_str().unwrap().contains("from `root.parked` only a second `e_shutdown`"),
        "{:#}",
        found[0]
    );
    // Where nobody hears it, it is gone.
    let deaf = STATES.replace("trans { src = \"building\", tgt = \"leaving\", events = { \"e_shutdown\" } },", "");
    let deaf = Small::new(configurations, &deaf, "").check();
    let found = deaf.of("coord::no_way_down");
    assert!(
        found.len() == 1
            && found[0]["message"]
                .as_str()
                .unwrap()
                .contains("no transition waits for `e_shutdown` in `root.building`"),
        "{:#}",
        deaf.0
    );
    for leads in ["\"park.ok\", \"park.failed\", \"park.broken\"", "\"e_shutdown\", \"e_after(1.0)\""] {
        let once = said(leads);
        assert!(once.of("coord::no_way_down").iter().all(|found| found["severity"] == "info"), "{leads}: {:#}", once.0);
    }
}

/// With `up`, `leaving` and `failed`, the second visit of `leaving` asks for no undo: that is what is wrong.
#[test]
fn advice_names_what_never_comes() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\") },";
    let states = "idle = state {}, up = state { entry = \"base\" }, leaving = state {}, failed = state {},
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"up\", events = { \"e_start\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" }, effect = \"base.undo\" },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },
        trans { src = \"leaving\", tgt = \"failed\", events = { \"base.undo.failed\", \"base.undo.broken\" } },
        trans { src = \"failed\", tgt = \"leaving\", events = { \"e_shutdown\" } },";
    let said = Small::new(configurations, states, "").check();
    let stuck = said.of("coord::stuck");
    assert_eq!(stuck.len(), 1, "{:#}", said.0);
    let message = stuck[0]["message"].as_str().unwrap();
    assert!(message.contains("never comes") && message.contains("`base.undone`"), "{message}");
    assert!(stuck[0]["help"].as_str().unwrap().contains("on the entry"), "{:#}", stuck[0]);
}

/// What a state does already is no advice: it asks itself for what it waits for, or hears the event that ends the deployment, which
/// a connector then holds up.
#[test]
fn no_advice_is_what_is_done_already() {
    let configurations =
        "base = Configuration { create(\"a\", \"Drive\") }, park = Configuration { property_set(\"a.gain\", 0.0) },";
    let parks = STATES.replace(
        "trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },",
        "parks = state { entry = \"park\" }, trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
         trans { src = \"up\", tgt = \"parks\", events = { \"e_go\" } },
         trans { src = \"parks\", tgt = \"up\", events = { \"park.failed\", \"park.broken\" } },",
    );
    let said = Small::new(configurations, &parks, "").check();
    let stuck = said.of("coord::stuck");
    assert_eq!(stuck.len(), 1, "{:#}", said.0);
    let (message, help) = (stuck[0]["message"].as_str().unwrap(), stuck[0]["help"].as_str().unwrap());
    assert!(message.contains("nothing leads on from `root.parks`: `park` is answered otherwise"), "{message}");
    assert_eq!(help, "add a transition on the answers that it does not hear: `park.ok`");

    let held_up = STATES.replace(
        "trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },",
        "half = conn {}, trans { src = \"up\", tgt = \"half\", events = { \"e_shutdown\" } },
         trans { src = \"half\", tgt = \"leaving\", events = { \"e_also\" } },",
    );
    let said = Small::new(configurations, &held_up, "").check();
    let stuck = said.of("coord::stuck");
    assert!(stuck.iter().any(|found| found["message"] == "nothing leads on from `root.up`"), "{:#}", said.0);
    let no_help = |found: &&serde_json::Value| found["help"].as_str().unwrap().contains("add a transition from it");
    assert!(!stuck.iter().any(no_help), "{:#}", said.0);
}

/// A frame that the bound of the stack has squashed is told where that bound is written.
#[test]
fn what_is_squashed_is_told_where_the_bound_stands() {
    let configurations =
        "base = Configuration { create(\"a\", \"Drive\") }, one = Configuration { property_set(\"a.gain\", 2.0) },
        two = Configuration { property_set(\"a.gain\", 3.0) },";
    let states = "idle = state {}, building = state { entry = \"base\" }, first = state { entry = \"one\" },
        second = state { entry = \"two\" }, up = state {}, leaving = state { entry = \"base.undo\" },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"first\", events = { \"base.ok\" } },
        trans { src = \"first\", tgt = \"second\", events = { \"one.ok\" } },
        trans { src = \"second\", tgt = \"up\", events = { \"two.ok\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },";
    let said = Small::new(configurations, states, "limits: { stack: 2 }\n").check();
    let squashed = said.of("stack::squashed");
    assert_eq!(squashed.len(), 1, "{:#}", said.0);
    let file = squashed[0]["file"].as_str().expect("a place");
    assert!(file.ends_with("small.yaml") && squashed[0]["line"].is_u64(), "{:#}", squashed[0]);
}

/// What a configuration stands for is known beforehand where it rests on run states: applied where that is false, it can only
/// fail. The script of the way sees it fail.
#[test]
fn what_can_never_hold_is_found_where_it_is_applied() {
    let configurations = |holds: &str| {
        format!(
            "base = Configuration {{ create(\"a\", \"Drive\"), create(\"b\", \"Drive\"), post_conf_state = {{ \"a:running\", \"b:stopped\" }} }},
             start = Configuration {{ post_conf_state = {{ \"b:running\" }} }},
             try = Configuration {{ timeout = 0.5, property_set(\"a.gain\", 2.0), holds = {holds} }},"
        )
    };
    let states = |more: &str| {
        format!(
            "{STATES} trying = state {{ entry = \"try\" }}, starting = state {{ entry = \"start\" }},
             trans {{ src = \"up\", tgt = \"trying\", events = {{ \"e_try\" }} }},
             trans {{ src = \"up\", tgt = \"starting\", events = {{ \"e_start\" }} }},
             trans {{ src = \"trying\", tgt = \"leaving\", events = {{ \"e_shutdown\" }}, effect = \"try.undo\" }},
             trans {{ src = \"starting\", tgt = \"leaving\", events = {{ \"e_shutdown\" }}, effect = {{ \"try.undo\", \"start.undo\" }} }},
             {more}"
        )
    };
    let said = |holds: &str, more: &str| Small::new(&configurations(holds), &states(more), "").check();
    let severities = |said: &crate::support::Said| -> Vec<String> {
        said.of("conf::holds_never").iter().map(|found| found["severity"].as_str().unwrap().to_owned()).collect()
    };
    let never = said("in_state(\"b\", \"running\")", "");
    assert_eq!(severities(&never), ["error"], "{:#}", never.0);
    let found = never.of("conf::holds_never")[0];
    assert!(found["file"].as_str().unwrap().ends_with("conf.lua") && found["line"].is_number(), "{found:#}");
    assert!(found["trace"].as_array().unwrap().len() > 2, "{found:#}");
    // Nothing follows that only comes when it was applied: what it stands for cannot be lost.
    assert!(never.of("coord::lost_unheard").is_empty(), "{:#}", never.0);
    for (holds, wrong) in [
        ("in_state(\"b\", \"stopped\")", false),
        ("all { in_state(\"a\", \"running\"), no(faulted(\"b\")) }", false),
        ("faulted(\"b\")", true),
        ("any { in_state(\"b\", \"running\"), in_state(\"a\", \"stopped\") }", true),
        ("in_state(\"a\", \"running\"):for_at_least(0.1)", false),
        ("in_state(\"b\", \"running\"):for_at_least(0.1)", true),
        // Values are not shown by this platform: then it counts as true.
        ("all { above(\"a.out\", 1), in_state(\"b\", \"running\") }", false),
    ] {
        let said = said(holds, "");
        assert_eq!(!severities(&said).is_empty(), wrong, "{holds}: {:#}", said.0);
    }
    // Asked for where another one has brought that about, it is applied; and where not, it is found still.
    let after = said(
        "in_state(\"b\", \"running\")",
        "second = state { entry = \"try\" }, trans { src = \"starting\", tgt = \"second\", events = { \"start.ok\" } },
         trans { src = \"second\", tgt = \"leaving\", events = { \"e_shutdown\" }, effect = { \"try.undo\", \"start.undo\" } },",
    );
    assert!(!after.of("coord::lost_unheard").is_empty(), "it may be in force: {:#}", after.0);
    assert_eq!(severities(&after), ["error"], "{:#}", after.0);
}

/// The same of two coordinators that hear of each other.
#[test]
fn one_shutdown_event_leads_all_coordinators_down() {
    let configurations =
        "base = Configuration { create(\"a\", \"Drive\") }, park = Configuration { description = \"rest\" },
        two = Configuration { create(\"b\", \"Drive\") },";
    let first = |parked: &str| {
        format!(
            "idle = state {{}}, building = state {{ entry = \"base\" }}, up = state {{ entry = \"e_hello\" }}, parked = state {{ entry = \"park\" }},
             leaving = state {{ entry = \"base.undo\" }}, failed = state {{}},
             trans {{ src = \"initial\", tgt = \"idle\" }},
             trans {{ src = \"idle\", tgt = \"building\", events = {{ \"e_start\" }} }},
             trans {{ src = \"building\", tgt = \"up\", events = {{ \"base.ok\" }} }},
             trans {{ src = \"building\", tgt = \"failed\", events = {{ \"base.failed\", \"base.broken\" }} }},
             trans {{ src = \"failed\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},
             trans {{ src = \"building\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},
             trans {{ src = \"up\", tgt = \"parked\", events = {{ \"e_shutdown\" }} }},
             trans {{ src = \"parked\", tgt = \"leaving\", events = {{ \"{parked}\", \"park.failed\", \"park.broken\" }} }},
             trans {{ src = \"leaving\", tgt = \"idle\", events = {{ \"base.undone\" }} }},
             trans {{ src = \"leaving\", tgt = \"failed\", events = {{ \"base.undo.failed\", \"base.undo.broken\" }} }},"
        )
    };
    let second = "idle = state {}, leaving = state { entry = \"two.undo\" }, failed = state {},
        up = state { entry = \"two\", low = state {}, heard = state {},
            trans { src = \"initial\", tgt = \"low\" },
            trans { src = \"low\", tgt = \"heard\", events = { \"e_hello\" } } },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"up\", events = { \"e_start\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\", \"two.failed\", \"two.broken\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"two.undone\" } },
        trans { src = \"leaving\", tgt = \"failed\", events = { \"two.undo.failed\", \"two.undo.broken\" } },
        trans { src = \"failed\", tgt = \"leaving\", events = { \"e_shutdown\" } },";
    let check = |parked: &str| {
        Small::several(configurations, &[("first", &first(parked)), ("second", second)], "emits: [e_hello]\n").check()
    };
    let twice = check("e_shutdown");
    let found = twice.of("coord::no_way_down");
    assert_eq!(found.len(), 1, "{:#}", twice.0);
    assert_eq!((found[0]["severity"].as_str(), found[0]["file"].as_str()), (Some("warning"), Some("first.lua")));
    let message = found[0]["message"].as_str().unwrap();
    assert!(
        message.starts_with("from `first:root.parked") && message.contains("only a second `e_shutdown`"),
        "{message}"
    );
    assert_eq!(twice.0["verdict"], "warnings");
    // It is no matter for those who go on by an answer.
    let once = check("park.ok");
    assert!(once.of("coord::no_way_down").iter().all(|f| f["severity"] == "info"), "{:#}", once.0);
}

/// Where there is an actuator, what commands it is watched: as far as data reach, and what a configuration stands for.
#[test]
fn what_commands_an_actuator_and_dies_is_noticed() {
    let base = |more: &str| {
        format!(
            "base = Configuration {{ create(\"arm\", \"Arm\"), create(\"a\", \"Drive\"), create(\"b\", \"Drive\"),
                connect(\"a.out\", \"b.in\"), connect(\"b.out\", \"arm.push\"), create(\"aside\", \"Drive\"), {more}
                post_conf_state = {{ \"_default:running\" }} }},"
        )
    };
    let unwatched = |configurations: &str, chart: &str, keys: &str| {
        let small = Small::new(configurations, &format!("{STATES}{chart}"), keys);
        small.demo.write("mon.yaml", "monitors: { dead: { when: { silent: [a.out, 0.05] }, event: e_dead } }\n");
        let said = small.check();
        let found = said.of("deploy::unwatched");
        assert!(!said.0.to_string().contains("\"severity\":\"error\""), "{:#}", said.0);
        assert!(found.iter().all(|finding| finding["severity"] == "warning"), "{:#}", said.0);
        let named =
            |finding: &serde_json::Value| finding["message"].as_str().unwrap().split('`').nth(1).unwrap().to_owned();
        found.iter().map(|finding| named(finding)).collect::<Vec<_>>()
    };
    // What sends to nobody who moves is nobody's business.
    assert_eq!(unwatched(&base(""), "", ""), ["a", "b"]);
    assert!(unwatched(&base("").replace("connect(\"b.out\", \"arm.push\"),", ""), "", "").is_empty());
    // Somebody receives it who can tell.
    let guarded = base("create(\"guard\", \"Guard\"), connect(\"b.out\", \"guard.seen\"),");
    assert_eq!(unwatched(&guarded, "", ""), ["a"]);
    // Its fault is heard.
    let heard = "trans { src = \"up\", tgt = \"failed\", events = { \"a.faulted\" } },";
    assert_eq!(unwatched(&guarded, heard, ""), [""; 0]);
    // A monitor reads it, and its event is heard; and somebody watches the monitors.
    let monitors = "monitors: [mon.yaml]\n";
    let watched =
        base("create(\"guard\", \"Guard\"), connect(\"b.out\", \"guard.seen\"), create(\"mon\", \"davit.Monitors\"),");
    assert_eq!(unwatched(&watched, "", monitors), ["a", "mon"], "nobody hears `e_dead`");
    let hears = "trans { src = \"up\", tgt = \"failed\", events = { \"e_dead\" } },";
    assert_eq!(unwatched(&watched, hears, monitors), ["mon"]);
    let both = format!("{hears}trans {{ src = \"up\", tgt = \"failed\", events = {{ \"mon.faulted\" }} }},");
    assert_eq!(unwatched(&watched, &both, monitors), [""; 0]);
    // What a configuration stands for is no truth of who died.
    let holds = base("")
        .replace("post_conf_state", "holds = equals(\"aside.out\", 1), post_conf_state")
        .replace("connect(\"b.out\", \"arm.push\"),", "");
    assert_eq!(unwatched(&holds, "", ""), ["aside"]);
}

/// Of something safe as much is done as can be; what can be done in no system is refused all the same.
#[test]
fn what_does_not_commute_is_refused_in_something_safe_too() {
    let of = |changes: &str| {
        let configurations = format!(
            "base = Configuration {{ create(\"a\", \"Drive\"), post_conf_state = {{ \"a:running\" }} }},
             stop = Configuration {{ safe = true, {changes} }},"
        );
        let said = Small::new(&configurations, STATES, "").check();
        said.of("conf::clash").iter().filter(|finding| finding["severity"] == "error").count()
    };
    assert_eq!(of("property_set(\"a.gain\", 0.0), operation_call(\"a.open\")"), 0);
    assert_eq!(of("property_set(\"a.gain\", 0.0), property_set(\"a.gain\", 1.0)"), 1);
    // A call and what takes it back.
    assert_eq!(of("operation_call(\"a.open\"), operation_call(\"a.close\")"), 1);
}

/// A key has no place in a list; behind it `_default` may stand as one.
#[test]
fn a_keyed_run_state_beside_others_is_refused() {
    let of = |states: &str| {
        let configurations = format!(
            "base = Configuration {{ create(\"a\", \"Drive\"), create(\"b\", \"Drive\"), post_conf_state = {{ {states} }} }},"
        );
        Small::new(&configurations, STATES, "").check().of("conf::keyed_entries").len()
    };
    assert_eq!(of("\"a:running\", _default = \"running\""), 0);
    assert_eq!(of("a = \"running\", \"b:running\""), 1);
}

/// Something safe takes the place of something that is not: what moves when that is taken back would move in an emergency.
#[test]
fn what_moves_when_something_safe_takes_its_place_is_warned_of() {
    let of = |open: &str, shut: &str| {
        let configurations = format!(
            "base = Configuration {{ create(\"a\", \"Valve\") }},
             open = Configuration {{ {open} }},
             shut = Configuration {{ safe = true, {shut} property_set(\"a.gain\", 0.0) }},"
        );
        let small = Small::new(&configurations, STATES, "");
        small.demo.replace(
            "small.yaml",
            "types:\n",
            "types:
  Valve:
    moves: start
    properties: { gain: { type: float, default: 1.0 } }
    operations: { turn: { effect: { undo: back } }, back: { moves: true, effect: { undo: turn } } }
",
        );
        let said = small.check();
        let found = said.of("conf::safe_moves");
        assert!(found.iter().all(|finding| finding["severity"] == "warning"), "{:#}", said.0);
        found.iter().map(|finding| finding["message"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let turned = "group = \"g\", operation_call(\"a.turn\"),";
    let told = of(turned, "group = \"g\",");
    let whole = "`shut` is safe, and replaces `open`, something of which moves when it is taken back: `a.back` moves, and takes `a.turn` back";
    assert_eq!(told, [whole]);
    // It calls it too; they are no alternatives; what takes it back does not move.
    assert_eq!(of(turned, "group = \"g\", operation_call(\"a.turn\"),"), [""; 0]);
    assert_eq!(of(turned, ""), [""; 0]);
    assert_eq!(of("group = \"g\", property_set(\"a.gain\", 2.0),", "group = \"g\","), [""; 0]);
    assert_eq!(of(turned, "group = \"h\","), [""; 0]);
    // Of what is safe itself nothing is taken back.
    assert_eq!(of("safe = true, group = \"g\", operation_call(\"a.turn\"),", "group = \"g\","), [""; 0]);
    // What it has brought to rest would start again, unless the safe one brings it to rest as well.
    let rests = "group = \"g\", post_conf_state = { \"a:stopped\" },";
    let told = of(rests, "group = \"g\",");
    assert!(told.len() == 1 && told[0].ends_with("taken back: `a` starts again where it ran before"), "{told:?}");
    assert_eq!(of(rests, rests), [""; 0]);
    assert_eq!(of(rests, "group = \"g\", post_conf_state = { \"_default:stopped\" },"), [""; 0]);
    assert_eq!(of("group = \"g\", post_conf_state = { \"a:running\" },", "group = \"g\","), [""; 0]);
}

/// What others may change meanwhile is not judged, and that is said.
#[test]
fn what_a_configuration_stands_for_and_others_change_is_not_called_followed() {
    let aux = STATES.replace("base", "lamp").replace("e_start", "e_lamp");
    let said = |holds: &str| {
        let configurations = format!(
            "base = Configuration {{ create(\"a\", \"Drive\"){holds} }},
             lamp = Configuration {{ create(\"b\", \"Drive\"), post_conf_state = {{ \"b:running\" }} }},"
        );
        let lost = ["building", "up", "failed", "leaving"]
            .map(|state| format!("trans {{ src = \"{state}\", tgt = \"failed\", events = {{ \"base.lost\" }} }},"))
            .concat();
        let main = format!("{STATES}{}", if holds.is_empty() { "" } else { &lost });
        let both = Small::several(&configurations, &[("main", &main), ("aux", &aux)], "");
        both.demo.replace("small.yaml", "up: up", "up: [main:up, aux:idle]");
        both.check().0
    };
    let names_it = |said: &serde_json::Value| {
        said["left"].as_array().unwrap().iter().any(|left| left.as_str().unwrap().contains("`holds`"))
    };
    let (plain, judged) = (said(""), said(", holds = in_state(\"b\", \"running\")"));
    assert!(!names_it(&plain) && names_it(&judged), "{plain:#}\n{judged:#}");
}
