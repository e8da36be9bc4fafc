//! Advice that is true: what is said of frames that pile up, of an operator in the way, of events that may be slips.

use crate::support::{Said, Small};

const CONFIGURATIONS: &str = "base = Configuration { create(\"a\", \"Drive\") }, soft = Configuration { property_set(\"a.gain\", 0.5) },
    other = Configuration { property_set(\"a.gain\", 0.7) }, gone = Configuration { destroy(\"a\") },
    halt = Configuration { post_conf_state = { \"a:stopped\" } },
    run = Configuration { post_conf_state = { \"a:running\" } }, service = Configuration { post_conf_state = { \"a:running\" } },";

const STATES: &str = "idle = state {}, building = state { entry = \"base\" }, up = state {}, leaving = state { entry = \"base.undo\" }, stuck = state {},
    trans { src = \"initial\", tgt = \"idle\" },
    trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
    trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
    trans { src = \"building\", tgt = \"leaving\", events = { \"base.failed\", \"base.broken\", \"e_shutdown\" } },
    trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
    trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },
    trans { src = \"leaving\", tgt = \"stuck\", events = { \"base.undo.failed\", \"base.undo.broken\" } },
    trans { src = \"stuck\", tgt = \"leaving\", events = { \"e_shutdown\" } },";

fn check(more: &str, keys: &str) -> Said {
    Small::new(CONFIGURATIONS, &format!("{STATES}{more}"), keys).check()
}

fn texts<'a>(said: &'a Said, code: &str) -> Vec<(&'a str, &'a str)> {
    let text = |f: &'a serde_json::Value, key: &str| f[key].as_str().unwrap_or_default();
    said.of(code).into_iter().map(|f| (text(f, "message"), text(f, "help"))).collect()
}

#[test]
fn what_is_scoped_and_piles_up_since_its_undo_failed_is_not_to_be_scoped() {
    let round = |on: &str, inner: &str, way: &str| {
        format!(
            "on = state {{ {on} calm = state {{}}, more = state {{ entry = \"{inner}\" }}, trans {{ src = \"initial\", tgt = \"calm\" }},
               trans {{ src = \"calm\", tgt = \"more\", events = {{ \"e_more\" }} }} }},
             trans {{ src = \"up\", tgt = \"on\", events = {{ \"e_go\" }} }},
             trans {{ src = \"on\", tgt = \"up\", events = {{ \"e_back\" }} }},
             trans {{ src = \"on\", tgt = \"leaving\", events = {{ \"e_shutdown\" }}, effect = \"{way}\" }},"
        )
    };
    // What is applied inside lies above it and changes the same: the undo is refused each time.
    let scoped = check(&round("config = \"soft\",", "other", "base.undo"), "");
    let found = texts(&scoped, "coord::stack_grows");
    let soft: Vec<_> = found.iter().filter(|(message, _)| message.contains("`soft`")).collect();
    assert_eq!(soft.len(), 1, "{:#}", scoped.0);
    let (message, help) = soft[0];
    assert!(message.ends_with("after its undo has failed"), "{message}");
    assert!(help.contains("`soft.undo.failed`") && !help.contains("`config`"), "{help}");
    // Where nobody undoes it on the way round, though elsewhere, the old advice is true.
    let left = check(&round("", "soft", "soft.undo"), "");
    let found = texts(&left, "coord::stack_grows");
    assert_eq!(found.len(), 1, "{:#}", left.0);
    let (message, help) = found[0];
    assert!(
        message.ends_with("without undoing it") && help.contains("make `soft` the `config` of a state"),
        "{message}: {help}"
    );
}

#[test]
fn an_operator_in_the_way_is_told_to_undo_first_and_not_to_have_components_of_its_own() {
    let runs = "ready = state { config = \"run\" }, trans { src = \"up\", tgt = \"ready\", events = { \"e_go\" } },
        trans { src = \"ready\", tgt = \"up\", events = { \"e_back\" } }, trans { src = \"ready\", tgt = \"leaving\", events = { \"e_shutdown\" } },";
    let said = check(runs, "operator: [service]\n");
    let found = texts(&said, "coord::refused_by_other");
    assert!(!found.is_empty(), "{:#}", said.0);
    for (message, help) in found {
        assert!(help.contains("`operator:`") && !help.contains("each coordinator"), "{message}: {help}");
    }
}

#[test]
fn an_operator_is_not_blamed_for_the_frames_of_a_coordinator() {
    let more = "more = state { entry = \"halt\" }, trans { src = \"up\", tgt = \"more\", events = { \"e_go\" } },
        trans { src = \"more\", tgt = \"leaving\", events = { \"halt.failed\", \"halt.broken\", \"e_shutdown\" } },
        last = state { config = \"soft\" }, trans { src = \"more\", tgt = \"last\", events = { \"halt.ok\" } },
        trans { src = \"last\", tgt = \"leaving\", events = { \"soft.failed\", \"soft.broken\", \"e_shutdown\" } },";
    let states = STATES.replace("base.undone", "gone.ok").replace("base.undo", "gone");
    let said =
        Small::new(CONFIGURATIONS, &format!("{states}{more}"), "operator: [run]\nlimits: { stack: 2 }\n").check();
    let full = |f: &&&serde_json::Value| f["message"].as_str().unwrap().contains("none can be squashed");
    let (own, others) = (said.of("coord::request_refused"), said.of("coord::refused_by_other"));
    assert!(own.iter().any(|f| full(&f)) && !others.iter().any(|f| full(&f)), "{:#}", said.0);
    // Without the operator's frame between them there would be two to squash.
    assert!(own.iter().filter(full).all(|f| f["severity"] == "warning"), "{:#}", said.0);
}

#[test]
fn a_near_event_is_a_slip_where_it_is_near_enough_and_nobody_declares_it() {
    let listens = |events: &[&str], keys: &str| {
        let states = ["building", "up", "stuck"];
        let more: String = events
            .iter()
            .zip(states)
            .map(|(event, state)| {
                format!("trans {{ src = \"{state}\", tgt = \"leaving\", events = {{ \"{event}\" }} }},")
            })
            .collect();
        check(&more, keys).of("coord::near_event").len()
    };
    assert_eq!(listens(&["e_tart"], ""), 1, "one letter");
    assert_eq!(listens(&["e_stt"], ""), 0, "two letters of a short name");
    assert_eq!(listens(&["e_shudwon"], ""), 1, "two letters of a long one");
    assert_eq!(listens(&["e_tart", "e_tart"], ""), 0, "nobody slips twice in the same way");
    assert_eq!(listens(&["e_tart"], "safety: [e_tart]\n"), 0, "declared");
    // What a parent raises and nobody hears is told where it is accepted, with the same two names: not the other way round as well.
    assert_eq!(listens(&["e_rest"], "accepts: [e_reset]\n"), 0);
    let more = "trans { src = \"building\", tgt = \"leaving\", events = { \"e_rest\" } },";
    let told = check(more, "accepts: [e_reset]\n");
    let asks = "did the transition that waits for `e_rest` mean `e_reset`?";
    assert!(texts(&told, "compose::unknown").iter().any(|(_, help)| *help == asks), "{:#}", told.0);
    let heard = "trans { src = \"up\", tgt = \"leaving\", events = { \"e_rest\", \"e_reset\" } },";
    assert_eq!(
        check(heard, "accepts: [e_reset]\n").of("coord::near_event").len(),
        1,
        "one letter of what a parent raises"
    );
    assert_eq!(listens(&["e_5dof"], "accepts: [e_8dof]\n"), 0, "another number is another thing");
    // One word of it is another one: what is to be done and what has been, something and its contrary, another axis.
    for (heard, accepted, told) in [
        ("e_released", "e_release", 0),
        ("e_opening", "e_open", 0),
        ("e_opened", "e_open", 0),
        ("e_gate_unlocked", "e_gate_locked", 0),
        ("e_limit_x", "e_limit_y", 0),
        ("e_limit_x_hit", "e_limit_y_hit", 0),
        ("e_EC_TIMEOUT", "e_ec_timeout", 1),
        ("e_Reset", "e_reset", 1),
        ("E_jam_", "e_jam", 1),
        ("e_gate_lockd", "e_gate_locked", 1),
        ("e_gate_unlocekd", "e_gate_unlocked", 1),
    ] {
        let more = format!("trans {{ src = \"up\", tgt = \"leaving\", events = {{ \"{heard}\", \"{accepted}\" }} }},");
        let said = check(&more, &format!("accepts: [{accepted}]\n"));
        assert_eq!(said.of("coord::near_event").len(), told, "{heard} beside {accepted}: {:#}", said.0);
    }
}

#[test]
fn a_slip_in_what_a_component_raises_is_told_by_its_type() {
    let told = |events: &[&str]| {
        let states = ["up", "stuck"];
        let hears: String = (events.iter().zip(states))
            .map(|(event, state)| {
                format!("trans {{ src = \"{state}\", tgt = \"leaving\", events = {{ \"{event}\" }} }},")
            })
            .collect();
        let small = Small::new(CONFIGURATIONS, &format!("{STATES}{hears}"), "");
        small.demo.replace("small.yaml", "    operations:", "    raises: [e_arrived, e_axis2_fell]\n    operations:");
        let said = small.check();
        texts(&said, "coord::near_event").iter().map(|(message, help)| format!("{message}; {help}")).collect::<Vec<_>>()
    };
    let slip = "`e_arived` is nearly `e_arrived`, which a component raises; did you mean `e_arrived`? if not, a component or an \
                operator must raise `e_arived`";
    assert_eq!(told(&["e_arived"]), [slip]);
    assert_eq!(told(&["e_arrived", "e_arived"]), [slip], "where it is waited for elsewhere, too");
    assert!(told(&["e_arrived"]).is_empty());
    let named = "`a.e_arrived` never comes: what `a` raises is heard without its name; did you mean `e_arrived`?";
    assert_eq!(told(&["a.e_arrived"]), [named]);
    for (heard, wanted) in [
        ("a.fault", "nobody raises `a.fault`: of `a` itself only `a.faulted` is told; did you mean `a.faulted`?"),
        ("a.falted", "`a.falted` never comes: that `a` fails is told as `a.faulted`; did you mean `a.faulted`?"),
        (
            "a.ready",
            "nobody raises `a.ready`: of `a` itself only `a.faulted` is told; wait for `a.faulted`, or for what it raises, which is \
             heard without its name",
        ),
    ] {
        assert_eq!(told(&[heard]), [wanted]);
    }
    assert!(told(&["a.faulted"]).is_empty());
    // An operator raises it, who says so.
    let hears = "trans { src = \"up\", tgt = \"leaving\", events = { \"a.ready\" } },";
    assert!(check(hears, "safety: [a.ready]\n").of("coord::near_event").is_empty());
    assert!(told(&["e_one"]).is_empty(), "another word");
    for done in ["e_dne", "E_Done"] {
        let said = told(&[done]);
        assert!(said.len() == 1 && said[0].contains(&format!("`{done}` is nearly `e_done`")), "{said:?}");
    }
    assert_eq!(told(&["e_axi2s_fell"]).len(), 1, "a number in another place is a slip");
    let small = Small::new(CONFIGURATIONS, STATES, "");
    small.demo.replace("small.yaml", "    operations:", "    raises: [e_arrived, run.ok]\n    operations:");
    let said = small.check();
    let found = texts(&said, "type::no_event");
    assert!(found.len() == 1 && found[0].0.starts_with("`run.ok` is an answer of the configurator"), "{:#}", said.0);
    assert!(told(&["e_axis1_fell"]).is_empty() && told(&["e_axis12_fell"]).is_empty(), "another number is none");
}

#[test]
fn a_safety_event_that_nobody_waits_for_is_told_without_an_actuator_and_an_answer_is_refused() {
    let stops = "trans { src = \"up\", tgt = \"leaving\", events = { \"e_estop\" } },";
    let slip = check(stops, "safety: [e_estp]\n");
    let found = slip.of("coord::safety_unheard");
    assert_eq!((found.len(), found[0]["severity"].as_str()), (1, Some("warning")), "{:#}", slip.0);
    assert!(found[0]["help"].as_str().unwrap().contains("did you mean `e_estop`?"), "{:#}", found[0]);
    assert!(check(stops, "safety: [e_estop]\n").of("coord::safety_unheard").is_empty());
    // With an actuator more is said, once.
    let arm = CONFIGURATIONS.replace("create(\"a\", \"Drive\")", "create(\"a\", \"Drive\"), create(\"arm\", \"Arm\")");
    let moving = Small::new(&arm, &format!("{STATES}{stops}"), "safety: [e_estp]\n").check();
    let found = moving.of("coord::safety_unheard");
    assert_eq!((found.len(), found[0]["severity"].as_str()), (1, Some("error")), "{:#}", moving.0);
    assert!(found[0]["help"].as_str().unwrap().starts_with("did you mean `e_estop`?"), "{:#}", found[0]);
    let answer = check(stops, "safety: [base.ok]\n");
    assert_eq!(answer.of("deploy::safety_answer").len(), 1, "{:#}", answer.0);
    assert_eq!(answer.0["verdict"], "refused", "{:#}", answer.0);
}

#[test]
fn no_coordinator_is_called_operator() {
    let named = Small::several(CONFIGURATIONS, &[("operator", STATES)], "").check();
    assert_eq!(named.of("deploy::operator_name").len(), 1, "{:#}", named.0);
    let small = Small::new(CONFIGURATIONS, STATES, "");
    small.demo.replace("small.yaml", "name: small", "name: operator");
    let alone = small.check();
    let found = texts(&alone, "deploy::operator_name");
    assert!(found.len() == 1 && found[0].1.contains("`name`"), "{:#}", alone.0);
}

#[test]
fn a_bare_undo_is_answered_too() {
    let waits = "trans { src = \"up\", tgt = \"leaving\", events = { \"undo.done\" } },";
    let never = check(waits, "");
    let found = texts(&never, "coord::answer_never_comes");
    assert!(found.len() == 1 && found[0].0.contains("does not ask for `undo`"), "{:#}", never.0);
    // Somebody else's word, that ends in the same way.
    let grasped = check("trans { src = \"up\", tgt = \"leaving\", events = { \"grasp.done\" } },", "");
    assert!(grasped.of("coord::unknown_answer").is_empty(), "{:#}", grasped.0);
}

/// What an operator's frame has done is no mistake of the coordinator, whether the frame or what it did stands in the way.
#[test]
fn what_an_operators_frame_has_changed_is_the_operators_doing() {
    let running = CONFIGURATIONS.replace("\"Drive\") },", "\"Drive\"), post_conf_state = { \"a:running\" } },")
        + " heave = Configuration { operation_call(\"a.raise\") },";
    let check = |keys: &str| Small::new(&running, STATES, keys).check();
    let alone = check("");
    assert_eq!(alone.0["verdict"], "sound", "{:#}", alone.0);
    // What can be undone without moving anything goes with what the coordinator undoes when it leads down.
    let soft = check("operator: [soft]\n");
    assert!(soft.of("coord::refused_by_other").is_empty(), "{:#}", soft.0);
    assert_eq!(soft.0["verdict"], "sound", "{:#}", soft.0);
    let applied = "heave";
    let said = check(&format!("operator: [{applied}]\n"));
    let found = said.of("coord::refused_by_other");
    assert!(found.iter().any(|f| f["severity"] == "warning"), "{applied}: {:#}", said.0);
    let own = said.refused("base.undo");
    assert!(own.iter().all(|(severity, _)| *severity == "info"), "{applied}: {:#}", said.0);
    assert_eq!(said.0["verdict"], "warnings", "{applied}: {:#}", said.0);
}

/// Where something moves, force is told what brings it to rest; where nothing names it that is noted, and no more.
#[test]
fn what_moves_and_is_brought_to_rest_by_nothing_is_noted() {
    let said = check("", "");
    let found = texts(&said, "deploy::no_rest");
    let (message, help) = found[0];
    assert!(message.contains("`Drive` moves") && help.contains("rest: [park]"), "{message}: {help}");
    assert_eq!(said.0["verdict"], "sound", "{:#}", said.0);
    let arms = Small::new(&CONFIGURATIONS.replace("\"Drive\"", "\"Arm\""), STATES, "").check();
    assert!(arms.of("deploy::no_rest").is_empty(), "{:#}", arms.0);
    let small = Small::new(CONFIGURATIONS, STATES, "");
    small.demo.replace("small.yaml", "down: idle", "rest: [halt], down: idle");
    let named = small.check();
    assert!(named.of("deploy::no_rest").is_empty(), "{:#}", named.0);
}

#[test]
fn a_group_that_is_misspelt_is_told() {
    let told = |first: &str, second: &str, third: &str| {
        let configurations = format!(
            "{CONFIGURATIONS} one = Configuration {{ group = '{first}', property_set('a.gain', 1.0) }},
             two = Configuration {{ group = '{second}', property_set('a.gain', 2.0) }},
             three = Configuration {{ group = '{third}', property_set('a.gain', 3.0) }},"
        );
        let said = Small::new(&configurations, STATES, "").check();
        texts(&said, "conf::alone_in_group").into_iter().map(|(message, help)| format!("{message}; {help}")).collect()
    };
    let found: Vec<String> = told("stiffness", "stiffness", "stifness");
    assert_eq!(
        found,
        [
            "only `three` is of the group `stifness`, so it replaces nothing; did you mean `stiffness`? Else leave it out"
        ]
    );
    for (first, second, third) in [("mode", "mode", "mode"), ("mode", "mode", "speed")] {
        let found: Vec<String> = told(first, second, third);
        assert!(found.is_empty(), "{found:?}");
    }
}

/// A time event that is misspelt is an event that somebody must raise, and so is the fault of a component that there is not.
#[test]
fn an_event_that_nobody_can_mean_is_told() {
    let cases = [
        (
            "e_aftre(1.5)",
            "`e_aftre(1.5)` is no time event: somebody must raise it under that very name; did you mean `e_after(1.5)`?",
        ),
        (
            "e_ater(5)",
            "`e_ater(5)` is no time event: somebody must raise it under that very name; did you mean `e_after(5)`?",
        ),
        (
            "after(5)",
            "`after(5)` is no time event: somebody must raise it under that very name; did you mean `e_after(5)`?",
        ),
        ("E_at(3)", "`E_at(3)` is no time event: somebody must raise it under that very name; did you mean `e_at(3)`?"),
        ("aa.faulted", "`aa.faulted` never comes: there is no component `aa`; did you mean `a.faulted`?"),
    ];
    for (event, told) in cases {
        let more = format!("trans {{ src = \"stuck\", tgt = \"leaving\", events = {{ \"{event}\" }} }},");
        let found: Vec<String> = texts(&check(&more, ""), "coord::near_event")
            .into_iter()
            .map(|(message, help)| format!("{message}; {help}"))
            .collect();
        assert_eq!(found, [told]);
    }
    let more = "trans { src = \"stuck\", tgt = \"leaving\", events = { \"a.faulted\", \"e_after(1.5)\" } },";
    assert!(texts(&check(more, ""), "coord::near_event").is_empty());
}

/// What no coordinator asks for and no operator is expected to is a note, one for all.
#[test]
fn what_nobody_asks_for_is_told_once() {
    let noted = |keys: &str| {
        let said = check("", keys);
        let told = said.of("conf::unasked").into_iter();
        told.map(|f| (f["severity"].as_str().unwrap().to_owned(), f["message"].as_str().unwrap().to_owned()))
            .collect::<Vec<_>>()
    };
    let (severity, message) = &noted("operator: [run, service]")[0];
    let whole = "`soft`, `other`, `gone`, `halt`: no coordinator asks for them, and `operator:` does not list them";
    assert_eq!((severity.as_str(), message.as_str()), ("info", whole));
    assert!(noted("")[0].1.starts_with("`soft`, `other`, `gone`, `halt` and 2 more: "), "{:?}", noted(""));
    assert!(noted("operator: [soft, other, gone, halt, run, service]").is_empty());
}

/// What is written nearly as an answer, or as what a subsystem tells, is told as that.
#[test]
fn what_is_no_answer_and_no_event_is_told_as_what_was_meant() {
    let told = |event: &str, code: &str| {
        let said = check(&format!("trans {{ src = 'up', tgt = 'leaving', events = {{ '{event}' }} }},"), "");
        texts(&said, code).iter().map(|(message, help)| format!("{message}; {help}")).collect::<Vec<_>>()
    };
    let done = told("base.done", "coord::answer_never_comes");
    assert!(
        done.len() == 1
            && done[0].starts_with("`base.done` never comes: `base` is not answered so; `base` is answered `base.ok`"),
        "{done:?}"
    );
    let undone = told("base.undo.ok", "coord::answer_never_comes");
    assert!(undone.len() == 1 && undone[0].contains("`base.undo` is answered `base.undone`"), "{undone:?}");
    for event in ["bsae.undo.ok", "bsae.undone"] {
        let misspelt = told(event, "coord::unknown_answer");
        assert!(
            misspelt.len() == 1
                && misspelt[0].contains("there is no configuration `bsae`")
                && misspelt[0].ends_with("did you mean `base.undone`?"),
            "{misspelt:?}"
        );
    }
    let soft = told("soft.ok", "coord::answer_never_comes");
    assert!(soft.len() == 1 && soft[0].contains("the coordinator does not ask for `soft`"), "{soft:?}");
    let fault = told("a.faultd", "coord::near_event");
    assert!(fault.len() == 1 && fault[0].ends_with("did you mean `a.faulted`?"), "{fault:?}");
    let base = told("base", "coord::unknown_answer");
    assert!(
        base.len() == 1 && base[0].ends_with("nobody raises it; did you mean `base.ok`, which answers it?"),
        "{base:?}"
    );
}

/// What stands twice is done once: of a call that may have been meant otherwise.
#[test]
fn a_change_that_stands_twice_is_told() {
    let told = |changes: &str| {
        let small = Small::new(&format!("base = Configuration {{ create('a', 'Drive'), {changes} }}"), STATES, "");
        let said = small.check();
        let told = said.of("conf::change_twice").into_iter();
        told.map(|f| (f["severity"].as_str().unwrap().to_owned(), f["message"].as_str().unwrap().to_owned()))
            .collect::<Vec<_>>()
    };
    assert!(told("property_set('a.gain', 2.0), operation_call('a.open')").is_empty());
    let [(severity, message)] = &told("operation_call('a.open'), operation_call('a.open')")[..] else { panic!("one") };
    assert!(severity == "warning" && message.contains("a.open") && message.contains("stands twice"), "{message}");
    let set = told("property_set('a.gain', 2.0), property_set('a.gain', 2.0), property_set('a.gain', 2.0)");
    assert!(set.len() == 2 && set.iter().all(|(severity, _)| severity == "info"), "{set:?}");
}

/// One of two frames was undone, and the other one is in the way: to undo it first was done already.
#[test]
fn what_was_asked_for_twice_and_undone_once_is_told_as_that() {
    let states = STATES.replace("src = \"up\", tgt = \"leaving\"", "src = \"up\", tgt = \"dropping\"");
    let more = "on = state { entry = \"soft\" }, dropping = state { entry = \"soft.undo\" },
        trans { src = \"up\", tgt = \"on\", events = { \"e_go\" } }, trans { src = \"on\", tgt = \"up\", events = { \"e_back\" } },
        trans { src = \"on\", tgt = \"dropping\", events = { \"e_shutdown\" } },
        trans { src = \"dropping\", tgt = \"leaving\", events = { \"soft.undone\", \"soft.undo.failed\", \"soft.undo.broken\" } },";
    let said = Small::new(CONFIGURATIONS, &format!("{states}{more}"), "").check();
    let found = texts(&said, "coord::request_refused");
    let refused = found.iter().find(|(message, _)| message.starts_with("`base.undo`"));
    let Some((message, help)) = refused else { panic!("{:#}", said.0) };
    assert!(
        message.contains("`soft.undo` was answered before: `soft` was asked for more than once")
            && help.contains("`exit: soft.undo`"),
        "{message}: {help}"
    );
}

/// A transition that is forgotten in the bring-up is told where it is missing, and not where an emergency would lead.
#[test]
fn a_bring_up_that_stops_is_told_where_it_stops() {
    let states = STATES.replace(
        "trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },",
        "failed = state {}, trans { src = \"building\", tgt = \"failed\", events = { \"e_stop\" } },
         trans { src = \"failed\", tgt = \"leaving\", events = { \"e_shutdown\" } },",
    );
    let small = Small::new(CONFIGURATIONS, &states, "safety: [e_stop]");
    small.demo.replace("small.yaml", "deploy: {", "deploy: { failed: [failed],");
    let said = small.check();
    let [(message, help)] = texts(&said, "deploy::never_up")[..] else { panic!("{:#}", said.0) };
    assert_eq!(message, "the bring-up stops at `root.building` and never reaches `up`");
    assert!(help.starts_with("`base.ok` comes in `root.building` at last, and no transition waits for it"), "{help}");
}

/// So is a way down, and one that nobody begins.
#[test]
fn a_way_down_that_stops_is_told_where_it_stops() {
    let stopped = "safe_hold = state { entry = \"halt\" }, trans { src = \"leaving\", tgt = \"safe_hold\", events = { \"e_stop\" } },";
    let told = |without: &str| {
        let states = format!("{}{stopped}", STATES.replace(without, ""));
        let configurations = CONFIGURATIONS.replace("halt = Configuration {", "halt = Configuration { safe = true,");
        let said = Small::new(&configurations, &states, "safety: [e_stop]").check();
        let [(message, help)] = texts(&said, "deploy::never_down")[..] else { panic!("{:#}", said.0) };
        format!("{message}; {help}")
    };
    let undone = told("trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },");
    assert!(
        undone.starts_with("the shutdown stops at `root.leaving` and never reaches `idle`; `base.undone` comes in `root.leaving` at last"),
        "{undone}"
    );
    let begun = told("trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },");
    assert!(
        begun.contains("stops at `root.up`") && begun.contains("no transition waits for `e_shutdown` in `root.up`"),
        "{begun}"
    );
}

/// What ends the deployment may ask for something safe itself: the way goes on from there, and stops where nothing waits for its answer.
#[test]
fn a_way_down_that_begins_with_something_safe_is_told_where_it_stops() {
    let states = STATES
        .replace(
            "{ src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } }",
            "{ src = \"up\", tgt = \"halting\", events = { \"e_shutdown\" } }",
        )
        .replace("leaving = state", "halting = state { entry = \"halt\" }, leaving = state");
    let configurations = CONFIGURATIONS.replace("halt = Configuration {", "halt = Configuration { safe = true,");
    let said = Small::new(&configurations, &states, "safety: [e_stop]").check();
    let [(message, help)] = texts(&said, "deploy::never_down")[..] else { panic!("{:#}", said.0) };
    assert_eq!(message, "the shutdown stops at `root.halting` and never reaches `idle`");
    assert!(help.starts_with("`halt.ok` comes in `root.halting` at last, and no transition waits for it"), "{help}");
}

/// A property that is misspelt is missing as well: that is told second.
#[test]
fn a_misspelt_property_is_told_before_the_one_that_is_missing() {
    let small =
        Small::new("base = Configuration { create('a', 'Drive', { properties = { gian = 2.0 } }) }", STATES, "");
    small.demo.replace("small.yaml", "gain: { type: float, default: 1.0 }", "gain: { type: float }");
    let said = small.check();
    let codes: Vec<&str> = said.0["findings"].as_array().unwrap().iter().filter_map(|f| f["code"].as_str()).collect();
    assert_eq!(codes[..2], ["conf::unknown_property", "conf::missing_property"], "{:#}", said.0);
}

/// What ends the deployment and is lost is told where it is lost, and not where only a second one would lead down.
#[test]
fn an_end_that_is_lost_is_told_where_it_is_lost() {
    let states = STATES.replace("\"base.failed\", \"base.broken\", \"e_shutdown\"", "\"base.failed\", \"base.broken\"");
    let said = Small::new(CONFIGURATIONS, &states, "").check();
    let [(message, help)] = texts(&said, "coord::no_way_down")[..] else { panic!("{:#}", said.0) };
    assert!(message.starts_with("no transition waits for `e_shutdown` in `root.building`"), "{message}");
    assert!(message.contains("leads to `root.up`"), "{message}");
    assert!(help.starts_with("let `e_shutdown` lead down from `root.building` as well"), "{help}");
    let helped = Small::new(CONFIGURATIONS, STATES, "").check();
    assert!(texts(&helped, "coord::no_way_down").is_empty(), "{:#}", helped.0);
}
