//! Who asks besides the coordinators, what piles up, and what has no end.

use crate::support::{Said, Small};

/// After many switches that nobody undoes the oldest frames are squashed, and one of them is asked to be undone.
#[test]
fn an_undo_of_what_was_squashed_is_found() {
    let configurations =
        "base = Configuration { create(\"a\", \"Drive\") }, keep = Configuration { property_set(\"a.mode\", 1) },
        one = Configuration { property_set(\"a.gain\", 2.0) }, two = Configuration { property_set(\"a.gain\", 3.0) },
        all = Configuration { destroy(\"a\") },";
    let states = "idle = state {}, building = state { entry = \"base\" }, keeping = state { entry = \"keep\" }, up = state {},
        first = state { entry = \"one\" }, second = state { entry = \"two\" }, undoing = state { entry = \"keep.undo\" },
        leaving = state { entry = \"all\" },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"keeping\", events = { \"base.ok\" } },
        trans { src = \"keeping\", tgt = \"up\", events = { \"keep.ok\" } },
        trans { src = \"up\", tgt = \"first\", events = { \"e_one\" } },
        trans { src = \"first\", tgt = \"second\", events = { \"one.ok\" } },
        trans { src = \"second\", tgt = \"up\", events = { \"two.ok\" } },
        trans { src = \"up\", tgt = \"undoing\", events = { \"e_undo\" } },
        trans { src = \"undoing\", tgt = \"leaving\", events = { \"keep.undone\", \"keep.undo.failed\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"all.ok\" } },"
        .to_owned()
        + &["building", "keeping", "up", "first", "second"]
            .map(|state| format!("trans {{ src = \"{state}\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},"))
            .join(" ");
    let said = Small::new(configurations, &states, "").check();
    let refused = said.refused("keep.undo");
    assert!(
        refused.iter().any(|(severity, message)| *severity == "error" && message.contains("squashed")),
        "{:#}",
        said.0
    );
}

/// It asks, undoes and asks again, and nothing ever fails or waits.
#[test]
fn a_circle_of_answers_has_no_end() {
    let round = |wait: &str| {
        format!(
            "idle = state {{}}, building = state {{ entry = \"base\" }}, up = state {{ entry = \"one\" }}, back = state {{ entry = \"one.undo\" }}, rest = state {{}},
             trans {{ src = \"initial\", tgt = \"idle\" }},
             trans {{ src = \"idle\", tgt = \"building\", events = {{ \"e_start\" }} }},
             trans {{ src = \"building\", tgt = \"up\", events = {{ \"base.ok\" }} }},
             trans {{ src = \"up\", tgt = \"back\", events = {{ \"one.ok\" }} }},
             trans {{ src = \"back\", tgt = \"rest\", events = {{ \"one.undone\" }} }},
             trans {{ src = \"rest\", tgt = \"up\", events = {{ \"{wait}\" }} }},
             trans {{ src = \"rest\", tgt = \"idle\", events = {{ \"e_shutdown\" }}, effect = \"base.undo\" }},
             trans {{ src = \"back\", tgt = \"idle\", events = {{ \"e_shutdown\" }}, effect = \"base.undo\" }},
             trans {{ src = \"up\", tgt = \"idle\", events = {{ \"e_shutdown\" }}, effect = {{ \"one.undo\", \"base.undo\" }} }},
             trans {{ src = \"building\", tgt = \"idle\", events = {{ \"e_shutdown\" }}, effect = \"base.undo\" }},"
        )
    };
    let configurations =
        "base = Configuration { create(\"a\", \"Drive\") }, one = Configuration { property_set(\"a.gain\", 2.0) },";
    let endless = Small::new(configurations, &round("e_done"), "").check();
    let found = endless.of("coord::endless");
    assert_eq!(found.len(), 1, "{:#}", endless.0);
    assert!(!found[0]["trace"].as_array().unwrap().is_empty());
    for wait in ["e_after(1.0)", "e_go"] {
        let waits = Small::new(configurations, &round(wait), "").check();
        assert!(waits.of("coord::endless").is_empty(), "{wait}: {:#}", waits.0);
    }
}

/// What an operator may apply at any time lies above what the coordinator undoes.
#[test]
fn an_operators_requests_in_between_are_followed() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\") }, run = Configuration { post_conf_state = { \"a:running\" } },
        service = Configuration { post_conf_state = { \"a:running\" } }, soft = Configuration { property_set(\"a.gain\", 0.5) },";
    let states =
        "idle = state {}, building = state { entry = \"base\" }, up = state { config = \"run\" }, ready = state {},
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"ready\", events = { \"base.ok\" } },
        trans { src = \"ready\", tgt = \"up\", events = { \"e_run\" } },
        trans { src = \"up\", tgt = \"ready\", events = { \"e_stop\" } },
        trans { src = \"ready\", tgt = \"idle\", events = { \"e_shutdown\" }, effect = \"base.undo\" },
        trans { src = \"building\", tgt = \"idle\", events = { \"e_shutdown\" }, effect = \"base.undo\" },";
    let alone = Small::new(configurations, states, "").check();
    assert!(alone.of("coord::refused_by_other").is_empty(), "{:#}", alone.0);
    let operated = Small::new(configurations, states, "operator: [service]\n").check();
    let found = operated.of("coord::refused_by_other");
    let run = found.iter().find(|f| f["message"].as_str().unwrap().starts_with("`run.undo` of `small` is refused"));
    let run = run.unwrap_or_else(|| panic!("{:#}", operated.0));
    assert!(run["message"].as_str().unwrap().contains("an operator"), "{run:#}");
    let asked = run["trace"].as_array().unwrap().iter().any(|step| step["request"] == "apply service");
    assert!(asked, "{run:#}");
    // What shares nothing with what is undone then is in nobody's way.
    let soft = Small::new(configurations, states, "operator: [soft]\n").check();
    let found = soft.of("coord::refused_by_other");
    assert!(!found.iter().any(|f| f["message"].as_str().unwrap().starts_with("`run.undo`")), "{:#}", soft.0);
}

/// A floor holds back what shares a component with it, and nothing else.
#[test]
fn a_floor_of_one_coordinator_is_none_for_another() {
    let own = |name: &str, component: &str, other: &str| {
        format!(
            "idle = state {{}}, making = state {{ entry = \"{name}\" }}, up = state {{ entry = \"e_of_{name}\" }}, more = state {{ entry = \"{name}_more\" }},
             set = state {{ entry = \"{component}_set\" }}, back = state {{ entry = \"{component}_set.undo\" }}, leaving = state {{ entry = \"{name}_gone\" }},
             trans {{ src = \"initial\", tgt = \"idle\" }},
             trans {{ src = \"idle\", tgt = \"making\", events = {{ \"e_start\" }} }},
             trans {{ src = \"making\", tgt = \"up\", events = {{ \"{name}.ok\" }} }},
             trans {{ src = \"up\", tgt = \"more\", events = {{ \"e_{name}\" }} }},
             trans {{ src = \"more\", tgt = \"up\", events = {{ \"{name}_more.ok\", \"e_of_{other}\" }} }},
             trans {{ src = \"up\", tgt = \"set\", events = {{ \"e_{name}_set\" }} }},
             trans {{ src = \"set\", tgt = \"back\", events = {{ \"{component}_set.ok\" }} }},
             trans {{ src = \"back\", tgt = \"up\", events = {{ \"{component}_set.undone\" }} }},
             trans {{ src = \"up\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},
             trans {{ src = \"leaving\", tgt = \"idle\", events = {{ \"{name}_gone.ok\" }} }},"
        )
    };
    let of = |name: &str, component: &str| {
        format!(
            "{name} = Configuration {{ create(\"{component}\", \"Drive\") }}, {name}_gone = Configuration {{ destroy(\"{component}\") }},
             {name}_more = Configuration {{ irreversible = true, operation_call(\"{component}.weld\") }},
             {component}_set = Configuration {{ post_conf_state = {{ \"{component}:stopped\" }} }},"
        )
    };
    let said = Small::several(
        &format!("{}{}", of("arm", "a"), of("hand", "h")),
        &[("arm", &own("arm", "a", "hand")), ("hand", &own("hand", "h", "arm"))],
        "emits: [e_of_arm, e_of_hand]\n",
    )
    .check();
    for request in ["a_set.undo", "h_set.undo"] {
        assert!(said.refused(request).iter().all(|(severity, _)| *severity == "info"), "{request}: {:#}", said.0);
    }
    assert!(said.of("coord::refused_by_other").is_empty(), "{:#}", said.0);
}

/// What has nothing to do may be through before its undo gives it up: that is the same, and the script that goes that way
/// waits for neither answer.
#[test]
fn a_way_may_give_up_what_has_nothing_to_do() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\"), create(\"b\", \"Drive\") },
        x = Configuration { property_set(\"a.gain\", 2.0) }, y = Configuration { property_set(\"b.gain\", 3.0) },";
    let states = "idle = state {}, building = state { entry = \"base\" },
        up = state { one = state { entry = \"x\" }, two = state { entry = \"y\" },
            trans { src = \"initial\", tgt = \"one\" }, trans { src = \"one\", tgt = \"two\", events = { \"e_turn\" } },
            trans { src = \"two\", tgt = \"one\", events = { \"e_turn\" } } },
        first = state { entry = \"y.undo\" }, second = state { entry = \"x.undo\" }, last = state { entry = \"base.undo\" },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"up\", tgt = \"first\", events = { \"e_shutdown\" } },
        trans { src = \"first\", tgt = \"second\", events = { \"y.undone\" } },
        trans { src = \"second\", tgt = \"last\", events = { \"x.undone\" } },
        trans { src = \"last\", tgt = \"idle\", events = { \"base.undone\" } },";
    let small = Small::new(configurations, states, "limits: { stack: 3 }\n");
    let said = small.check();
    let all = said.0["findings"].as_array().unwrap();
    let gone = |finding: &&serde_json::Value| {
        finding["trace"].is_array() && Said::answers(finding).iter().any(|answer| answer == "x.cancelled")
    };
    assert!(all.iter().any(|finding| gone(&finding)), "{:#}", said.0);
    let numbered = (1..).zip(all).filter(|(_, finding)| gone(finding));
    let scripts = numbered.map(|(number, _)| std::fs::read_to_string(small.demo.path(&format!("way{number}.lua"))));
    assert!(scripts.flatten().any(|text| text.contains("which leads to the same")), "{:#}", said.0);
}

/// Where the stack is full, the frame that was pushed first is squashed first: two orders of frames that share nothing are two
/// worlds then.
#[test]
fn which_of_two_frames_is_squashed_first_is_kept_apart() {
    let configurations =
        "base = Configuration { create(\"a\", \"Drive\"), create(\"b\", \"Drive\") }, z = Configuration { create(\"c\", \"Drive\") },
        x = Configuration { property_set(\"a.gain\", 2.0) }, y = Configuration { property_set(\"b.gain\", 3.0) },
        all = Configuration { destroy(\"a\"), destroy(\"b\"), destroy(\"c\") },";
    // By the shorter way `x` lies below `y`, by the longer one above it.
    let states = "idle = state {}, building = state { entry = \"base\" }, up = state {}, later = state {},
        x1 = state { entry = \"x\" }, y2 = state { entry = \"y\" }, y1 = state { entry = \"y\" }, x2 = state { entry = \"x\" },
        both = state {}, full = state { entry = \"z\" }, undoing = state { entry = \"y.undo\" }, off = state { entry = \"x.undo\" },
        leaving = state { entry = \"all\" },
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"up\", tgt = \"x1\", events = { \"e_x\" } },
        trans { src = \"x1\", tgt = \"y2\", events = { \"x.ok\" } },
        trans { src = \"y2\", tgt = \"both\", events = { \"y.ok\" } },
        trans { src = \"up\", tgt = \"later\", events = { \"e_later\" } },
        trans { src = \"later\", tgt = \"y1\", events = { \"e_y\" } },
        trans { src = \"y1\", tgt = \"x2\", events = { \"y.ok\" } },
        trans { src = \"x2\", tgt = \"both\", events = { \"x.ok\" } },
        trans { src = \"both\", tgt = \"full\", events = { \"e_full\" } },
        trans { src = \"full\", tgt = \"undoing\", events = { \"e_shutdown\" } },
        trans { src = \"undoing\", tgt = \"off\", events = { \"y.undone\", \"y.undo.failed\" } },
        trans { src = \"off\", tgt = \"leaving\", events = { \"x.undone\", \"x.undo.failed\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"all.ok\" } },";
    let said = Small::new(configurations, states, "limits: { stack: 3 }\n").check();
    for request in ["x.undo", "y.undo"] {
        let refused = said.refused(request);
        assert!(refused.iter().any(|(severity, _)| *severity == "error"), "{request} {refused:?} {:#}", said.0);
    }
}

/// It brings a drive, and more with it in `high`; it goes back on its own and when it is shut down.
fn goes_back(more: &str, keys: &str) -> Small {
    let configurations = format!(
        "base = Configuration {{ create('a', 'Drive') }}, high = Configuration {{ property_set('a.gain', 5.0) }},{more}"
    );
    let states =
        "idle = state {}, building = state { entry = 'base' }, up = state {}, high = state { config = 'high' },
        leaving = state { entry = 'base.undo' }, stays = state {},
        trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'building', events = { 'e_start' } },
        trans { src = 'building', tgt = 'up', events = { 'base.ok' } },
        trans { src = 'building', tgt = 'leaving', events = { 'base.failed', 'base.broken', 'e_shutdown' } },
        trans { src = 'up', tgt = 'high', events = { 'e_high' } },
        trans { src = 'high', tgt = 'up', events = { 'e_low' } },
        trans { src = 'up', tgt = 'leaving', events = { 'e_off', 'e_shutdown' } },
        trans { src = 'high', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'leaving', tgt = 'idle', events = { 'base.undone' } },
        trans { src = 'leaving', tgt = 'stays', events = { 'base.undo.failed', 'base.undo.broken' } },
        trans { src = 'stays', tgt = 'leaving', events = { 'e_shutdown', 'e_off' } },";
    Small::new(&configurations, states, keys)
}

/// What stands in the way of a request that is refused because of an operator.
fn barred<'s>(said: &'s Said, request: &str) -> Vec<&'s str> {
    let found = said.of("coord::refused_by_other").into_iter();
    let messages = found.map(|finding| finding["message"].as_str().unwrap());
    messages.filter(|message| message.starts_with(&format!("`{request}` of"))).collect()
}

/// Runs a story from where `base` is there.
#[track_caller]
fn goes(small: &Small, story: &str) {
    let story = format!("deploy('small.yaml', {{ replay = true }}) raise('e_start') wait_answer('base.ok', 1) {story}");
    small.demo.write("story.lua", &story);
    let ran = small.demo.run(&["run", "story.lua", "--clock", "simulated", "--platform", "simulated"]);
    assert!(!ran.err.contains("davit::script"), "{story}: {}{}", ran.out, ran.err);
}

/// What an operator may set is followed like what it may apply.
#[test]
fn what_an_operator_may_set_is_followed() {
    let alone = goes_back("", "").check();
    assert!(barred(&alone, "base.undo").is_empty(), "{:#}", alone.0);
    for (member, value) in [("a.gain", "2.5"), ("a.in", "2.5"), ("a.mode", "7")] {
        let small = goes_back("", &format!("operator: [{member}]\n"));
        let said = small.check();
        assert!(!barred(&said, "base.undo").is_empty(), "{member}: {:#}", said.0);
        goes(
            &small,
            &format!(
                "set('{member}', {value}) wait_answer('{member}.ok', 1) raise('e_off') wait_answer('base.undo.failed', 1)"
            ),
        );
    }
}

/// What it is set to makes no difference to anybody else: one value is followed, and any other bars the same.
#[test]
fn any_value_that_is_set_bars_the_same() {
    let small = goes_back("", "operator: [a.gain]\n");
    let said = small.check();
    assert!(barred(&said, "high.undo").is_empty() && !barred(&said, "base.undo").is_empty(), "{:#}", said.0);
    for value in ["5.0", "4.0", "1.0"] {
        let set = format!("set('a.gain', {value}) wait_answer('a.gain.ok', 1)");
        let low = "raise('e_low') wait_answer('high.undone', 1) raise('e_off') wait_answer('base.undo.failed', 1)";
        goes(
            &small,
            &format!(
                "raise('e_high') wait_answer('high.ok', 1) {set} {low} undo('a.gain') wait_answer('a.gain.undone', 1)"
            ),
        );
        goes(&small, &format!("{set} raise('e_high') wait_answer('high.ok', 1) {low}"));
    }
}

/// An operator may make what somebody else would make, also where nothing is there.
#[test]
fn what_an_operator_makes_first_is_followed() {
    let states = "idle = state {}, up = state { config = 'base' },
        trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'up', events = { 'e_start' } },
        trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },";
    let configurations =
        "base = Configuration { create('a', 'Drive') }, mine = Configuration { create('a', 'Drive') },";
    let small = Small::new(configurations, states, "operator: [mine]\n");
    let said = small.check();
    let found = said.of("coord::refused_by_other");
    let first = |finding: &&serde_json::Value| {
        finding["severity"] == "warning" && finding["trace"][1]["request"] == "apply mine"
    };
    assert!(found.iter().any(first), "{:#}", said.0);
    small.demo.write(
        "story.lua",
        "deploy('small.yaml', { replay = true }) apply('mine') wait_answer('mine.ok', 1) raise('e_start') wait_answer('base.failed', 1)",
    );
    let ran = small.demo.run(&["run", "story.lua", "--clock", "simulated", "--platform", "simulated"]);
    assert!(!ran.err.contains("davit::script"), "{}{}", ran.out, ran.err);
}

/// What tells that it is down may wait behind what was asked for before: where it has been led up and down again since, that
/// tells of the life before, and what an operator applied goes with what is undone.
#[test]
fn that_it_was_down_before_does_not_count_where_it_is_led_down_again() {
    let configurations = "base = Configuration { create('a', 'Drive'), create('b', 'Drive') },
        one = Configuration { property_set('a.mode', 2) },
        mine = Configuration { group = 'g', property_set('b.gain', 5.0) },";
    let states = "idle = state {}, building = state { entry = 'base' }, up = state {}, bad = state {},
        leaving = state { entry = { 'one.undo', 'base.undo' } }, stays = state {},
        trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'building', events = { 'e_start' } },
        trans { src = 'building', tgt = 'up', events = { 'base.ok' } },
        trans { src = 'building', tgt = 'bad', events = { 'base.failed', 'base.broken' } },
        trans { src = 'building', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'bad', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'stays', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'leaving', tgt = 'idle', events = { 'base.undone' } },
        trans { src = 'leaving', tgt = 'stays', events = { 'base.undo.failed', 'base.undo.broken' } },";
    let said = Small::new(configurations, states, "operator: [mine]\n").check();
    assert!(said.of("coord::refused_by_other").is_empty(), "{:#}", said.0);
}

/// The event that begins the deployment, where nobody hears it: it is led down all the same, and what an operator has set goes
/// with what is undone.
#[test]
fn who_is_led_down_and_not_heard_is_led_down_all_the_same() {
    let configurations = "base = Configuration { create('a', 'Drive') },";
    let states = "idle = state {}, up = state { entry = 'base' }, slow = state {}, leaving = state { entry = 'base.undo' }, stays = state {},
        trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'up', events = { 'e_start' } },
        trans { src = 'up', tgt = 'slow', events = { 'e_shutdown' } },
        trans { src = 'slow', tgt = 'leaving', events = { 'e_after(0.5)' } },
        trans { src = 'leaving', tgt = 'idle', events = { 'base.undone' } },
        trans { src = 'leaving', tgt = 'stays', events = { 'base.undo.failed', 'base.undo.broken' } },
        trans { src = 'stays', tgt = 'leaving', events = { 'e_shutdown' } },";
    let small = Small::new(configurations, states, "operator: [a.gain]\n");
    let said = small.check();
    assert!(said.of("coord::refused_by_other").is_empty(), "{:#}", said.0);
    small.demo.write(
        "twice.lua",
        "deploy('small.yaml') set('a.gain', 3.0) wait(0.1) raise('e_shutdown') wait(0.1) raise('e_start') wait(1)",
    );
    let ran = small.demo.run(&["run", "twice.lua", "--clock", "simulated"]);
    assert!(ran.out.contains("base.undone") && !ran.out.contains("base.undo.failed"), "{}{}", ran.out, ran.err);
}

/// What is answered later comes later: an answer that is on its way is heard before it, however long that takes, and not in the
/// next life.
#[test]
fn an_answer_on_its_way_is_heard_before_what_is_answered_later() {
    let configurations =
        "base = Configuration { create('a', 'Drive') }, one = Configuration { operation_call('a.open') },
        look = Configuration { property_set('a.gain', 2.0) },";
    let states = "idle = state {}, building = state { entry = 'base' }, up = state {}, bad = state {},
        m = state { entry = 'one' }, broken = state {}, undoing = state {},
        leaving = state { entry = { 'one.undo', 'base.undo' } }, stays = state {},
        trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'building', events = { 'e_start' } },
        trans { src = 'building', tgt = 'up', events = { 'base.ok' } },
        trans { src = 'building', tgt = 'bad', events = { 'base.failed', 'base.broken' } },
        trans { src = 'building', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'up', tgt = 'm', events = { 'e_one' } },
        trans { src = 'm', tgt = 'up', events = { 'one.failed' } },
        trans { src = 'm', tgt = 'broken', events = { 'one.broken' } },
        trans { src = 'm', tgt = 'undoing', events = { 'e_undo' }, effect = 'one.undo' },
        trans { src = 'undoing', tgt = 'up', events = { 'one.undone' } },
        trans { src = 'undoing', tgt = 'broken', events = { 'one.undo.failed', 'one.undo.broken' } },
        trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'bad', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'm', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'broken', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'undoing', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'stays', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'leaving', tgt = 'idle', events = { 'base.undone' } },
        trans { src = 'leaving', tgt = 'stays', events = { 'one.undo.failed', 'one.undo.broken', 'base.undo.failed', 'base.undo.broken' } },";
    for (operator, verdict) in [("one", "warnings"), ("look", "followed")] {
        let said = Small::new(configurations, states, &format!("operator: [{operator}]\n")).check();
        assert_eq!(said.0["verdict"], verdict, "{:#}", said.0);
        let undo = said.refused("base.undo");
        assert!(undo.iter().all(|(severity, _)| *severity == "info"), "{undo:?}");
        // As the few states show in which an answer is on its way.
        assert!(said.0["explored"]["states"].as_u64() < Some(2000), "{:#}", said.0["explored"]);
    }
}
