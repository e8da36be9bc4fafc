//! Scripts of ways on which several things happen close to each other: what is armed for one of them does not hit another, and
//! where no script can go a way, that is told. `check` of the support replays every script.

use crate::support::{Said, Small};
use serde_json::Value;

/// What is said of the script of each finding with a way: none, or why there is none.
fn scripts(small: &Small, said: &Said) -> Vec<(Value, Option<String>)> {
    let findings = said.0["findings"].as_array().unwrap().iter().enumerate();
    let with = findings.filter(|(_, finding)| finding["trace"].as_array().is_some_and(|trace| !trace.is_empty()));
    let made = |(at, finding): (usize, &Value)| {
        let made = small.demo.run(&["check", "small.yaml", "--trace", &(at + 1).to_string(), "--as", "one.lua"]);
        (finding.clone(), (!made.err.is_empty()).then_some(made.err))
    };
    with.map(made).collect()
}

fn all_go(small: &Small, said: &Said) {
    let none: Vec<_> = scripts(small, said).into_iter().filter(|(_, why)| why.is_some()).collect();
    assert!(none.is_empty(), "{none:#?}");
}

/// `up` brings `own` with it; from `leaving` it is undone, and `base` with it.
fn life(own: &str, more: &str) -> String {
    format!(
        "idle = state {{}}, building = state {{ entry = 'base' }}, up = state {{ config = '{own}' }},
         leaving = state {{ entry = 'base.undo' }}, stays = state {{}},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'building', events = {{ 'e_start' }} }},
         trans {{ src = 'building', tgt = 'up', events = {{ 'base.ok' }} }},
         trans {{ src = 'building', tgt = 'leaving', events = {{ 'base.failed', 'base.broken', 'e_shutdown' }} }},
         trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown', '{own}.failed', '{own}.broken' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone' }} }},
         trans {{ src = 'leaving', tgt = 'stays', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},
         trans {{ src = 'stays', tgt = 'leaving', events = {{ 'e_shutdown' }} }},{more}"
    )
}

/// An undo is under way and fails; another of the same, which takes back what waits behind it, is answered before.
#[test]
fn an_undo_that_is_asked_for_again_is_not_the_one_under_way() {
    let conf = "base = Configuration { create('a', 'Drive'), post_conf_state = { 'a:stopped' } },
                c0 = Configuration { property_set('a.gain', 2.0) }";
    let again = "trans { src = 'leaving', tgt = 'building', events = { 'e_start' } },";
    let small = Small::new(conf, &life("c0", again), "");
    let said = small.check();
    assert_eq!(said.of("coord::leftovers").len(), 1, "{:#}", said.0);
    all_go(&small, &said);
}

/// An operator and the coordinator ask for the same: what makes the one slow is not met by the other. And that the operator's
/// frame is in the way of two undos is one kind of finding.
#[test]
fn two_who_ask_for_the_same_are_told_apart() {
    let conf = "base = Configuration { create('a', 'Drive'), post_conf_state = { 'a:stopped' } },
                heave = Configuration { operation_call('a.raise') }";
    // What moves does not go with what a coordinator undoes: it is in the way.
    let small = Small::new(conf, &life("heave", ""), "operator: [heave]\n");
    let said = small.check();
    all_go(&small, &said);
    let by_operator = said.of("coord::refused_by_other");
    assert!(by_operator.iter().any(|f| f["message"].as_str().unwrap().starts_with("`heave.undo`")), "{:#}", said.0);
    assert!(by_operator.iter().any(|f| f["message"].as_str().unwrap().starts_with("`base.undo`")), "{:#}", said.0);
    let own = said.of("coord::request_refused");
    assert!(own.iter().all(|finding| finding["severity"] == "info"), "{own:#?}");
}

/// What would have to be slower than it may be is no way of a script.
#[test]
fn nothing_is_under_way_for_longer_than_it_may_be() {
    let conf = "base = Configuration { create('a', 'Drive'), create('b', 'Drive'), post_conf_state = { 'a:stopped', 'b:stopped' } },
                c0 = Configuration { group = 'g', property_set('b.gain', 2.0) },
                c1 = Configuration { group = 'g', property_set('a.gain', 4.0) }, c2 = Configuration { property_set('a.gain', 2.0) }";
    let coordinator = life("c0", "").replace(
        "up = state { config = 'c0' }",
        "up = state { config = 'c0', k0 = state { entry = 'c2' },
         trans { src = 'initial', tgt = 'k0' }, trans { src = 'k0', tgt = 'k0', events = { 'e_after(4.0)', 'e0' } } }",
    );
    let coordinator = coordinator.replace("entry = 'base.undo' }", "entry = { 'c2.undo', 'base.undo' } }");
    let small = Small::new(conf, &coordinator, "operator: [c1]\n");
    let said = small.check();
    let why: Vec<String> = scripts(&small, &said).into_iter().filter_map(|(_, why)| why).collect();
    assert!(why.iter().all(|why| why.contains("would not have so long") || why.contains("a time is over")), "{why:#?}");
    assert!(why.iter().any(|why| why.contains("would not have so long")), "{why:#?}");
}

/// A time that is over before the next move of a script comes leads elsewhere.
#[test]
fn a_time_shorter_than_a_move_is_told() {
    let conf = "base = Configuration { create('a', 'Drive') }, c0 = Configuration { property_set('a.gain', 2.0) },
                wrong = Configuration { create('a', 'Drive') }";
    let more = "other = state { entry = 'wrong' }, trans { src = 'up', tgt = 'up', events = { 'e_after(0.01)' } },
        trans { src = 'up', tgt = 'other', events = { 'e0' } },
        trans { src = 'other', tgt = 'leaving', events = { 'e_shutdown', 'wrong.failed', 'wrong.broken' } },";
    let small = Small::new(conf, &life("c0", more), "");
    let said = small.check();
    let why: Vec<String> = scripts(&small, &said).into_iter().filter_map(|(_, why)| why).collect();
    assert!(!why.is_empty() && why.iter().all(|why| why.contains("a time is over")), "{why:#?}");
    // With more time a script goes all of them.
    let small = Small::new(conf, &life("c0", &more.replace("0.01", "0.5")), "");
    let said = small.check();
    all_go(&small, &said);
}

/// Where answers go round for ever beside the way, the bring-up goes on all the same, and the one that goes round is named.
#[test]
fn a_circle_beside_the_bring_up_is_what_is_named() {
    let one = format!(
        "{}trans {{ src = 'up', tgt = 'up', events = {{ 'c0.ok' }} }},",
        life("c0", "").replace("up = state { config = 'c0' }", "up = state { config = 'c0', entry = 'e_ready' }")
    );
    let two = "idle = state {}, up = state {}, trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'up', events = { 'e_ready' } }, trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },";
    let conf = "base = Configuration { create('a', 'Drive'), post_conf_state = { 'a:stopped' } },
                c0 = Configuration { post_conf_state = { '_default:stopped' } }";
    let small = Small::several(conf, &[("one", &one), ("two", two)], "emits: [e_ready]\n");
    let said = small.check();
    let up = said.of("deploy::never_up");
    assert_eq!(up.len(), 1, "{:#}", said.0);
    let message = up[0]["message"].as_str().unwrap();
    assert!(message.starts_with("the bring-up goes round for ever at `one:root.up, two:root.up`"), "{message}");
}

/// On a way its script alone says what components raise: not the deployment once more.
#[test]
fn what_components_raise_by_themselves_comes_when_it_does_on_the_way() {
    let conf = "base = Configuration { create('a', 'Drive'), post_conf_state = { 'a:running' } },
                c0 = Configuration { property_set('a.gain', 2.0) }, wrong = Configuration { create('a', 'Drive') }";
    let more = "late = state {}, other = state { entry = 'wrong' },
        trans { src = 'building', tgt = 'stays', events = { 'e_seen' } },
        trans { src = 'up', tgt = 'late', events = { 'e_seen' } },
        trans { src = 'late', tgt = 'other', events = { 'e_seen' } },
        trans { src = 'late', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'other', tgt = 'leaving', events = { 'e_shutdown', 'wrong.failed', 'wrong.broken' } },";
    let keys = "simulated: { reactions: [{ after: start a, delay_s: 0.05, raise: e_seen, component: a }] }\n";
    let small = Small::new(conf, &life("c0", more), keys);
    let said = small.check();
    let refused = said.refused("wrong");
    assert!(!refused.is_empty(), "{:#}", said.0);
    all_go(&small, &said);
}

/// Of what is held when it fails nothing may be done, where it has simply failed: whatever begins at once fails.
#[test]
fn what_holds_fails_only_where_nothing_beside_is_done() {
    let conf = "base = Configuration { create('a', 'Drive'), create('b', 'Drive'), post_conf_state = { 'a:stopped', 'b:stopped' } },
                c0 = Configuration { on_failure = 'hold', property_set('a.gain', 2.0), property_set('b.gain', 2.0) },
                wrong = Configuration { create('a', 'Drive') }";
    let more = "other = state { entry = 'wrong' },
        trans { src = 'other', tgt = 'leaving', events = { 'e_shutdown', 'wrong.failed', 'wrong.broken' } },
        trans { src = 'up', tgt = 'other', events = { 'c0.failed' }, pn = 1 },";
    let moving =
        conf.replace("on_failure = 'hold', ", "").replace("property_set('b.gain', 2.0)", "operation_call('b.raise')");
    for conf in [conf, &moving] {
        let small = Small::new(conf, &life("c0", more), "");
        let said = small.check();
        let refused = said.refused("wrong");
        assert!(!refused.is_empty(), "{:#}", said.0);
        all_go(&small, &said);
    }
}

/// What is raised for nobody waits to be heard: the way to a state in which it lies in all inboxes.
#[test]
fn what_nobody_has_heard_yet_is_raised_all_the_same() {
    let two = "idle = state {}, up = state {}, trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'up', events = { 'e_start' } }, trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },";
    let conf = "base = Configuration { create('a', 'Drive'), post_conf_state = { 'a:stopped' } },
                c0 = Configuration { property_set('a.gain', 2.0) }";
    let small = Small::several(conf, &[("one", &life("c0", "")), ("two", two)], "");
    let script =
        "deploy('small.yaml', { replay = true }) raise('e_start', { to = {} }) wait_answer('e_start', 0) wait(0.1)
        wait_state('one:idle', 0) wait_state('two:idle', 0)
        raise('e_start', { to = 'two' }) wait_state('two:up', 0.1) wait_state('one:idle', 0)
        raise('e_start', { to = { 'one' } }) wait_state('one:up', 1)";
    small.demo.write("way.lua", script);
    let ran = small.demo.run(&["run", "way.lua", "--clock", "simulated", "--platform", "simulated"]);
    assert!(!ran.err.contains("davit::script"), "{}{}", ran.out, ran.err);
}

/// A file with `leaving` that runs alone is let go by itself: not on a way, where the event that lets it go comes when the script says so.
#[test]
fn what_lets_a_part_go_comes_when_it_does_on_the_way() {
    let conf = "make = Configuration { create('a', 'Drive'), post_conf_state = { 'a:stopped' } },
                run = Configuration { post_conf_state = { 'a:running' } }";
    let coordinator = "idle = state {}, making = state { entry = 'make' }, starting = state { entry = { 'e_built', 'run' } }, up = state {},
        undone = state {}, leaving = state { entry = 'e_leaving' },
        stopping = state { entry = 'run.undo' }, removing = state { entry = 'make.undo' },
        trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'making', events = { 'e_start' } },
        trans { src = 'making', tgt = 'starting', events = { 'make.ok' } },
        trans { src = 'starting', tgt = 'up', events = { 'run.ok' } },
        trans { src = 'making', tgt = 'undone', events = { 'make.failed', 'make.broken' } },
        trans { src = 'starting', tgt = 'undone', events = { 'run.failed', 'run.broken' } },
        trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown', 'a.faulted' } },
        trans { src = 'undone', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'leaving', tgt = 'stopping', events = { 'e_released' } },
        trans { src = 'stopping', tgt = 'removing', events = { 'run.undone' } },
        trans { src = 'removing', tgt = 'idle', events = { 'make.undone' } },
        trans { src = 'removing', tgt = 'undone', events = { 'make.undo.failed', 'make.undo.broken' } },";
    let keys = "exports: { ports: { out: a.out }, from: e_built }
accepts: [e_released]
emits: [e_built, e_leaving]
leaving: { says: e_leaving, until: e_released }\n";
    let small = Small::new(conf, coordinator, keys);
    let said = small.check();
    all_go(&small, &said);
    let ways =
        (1..=said.0["findings"].as_array().unwrap().len()).map(|number| small.demo.path(&format!("way{number}.lua")));
    let texts: Vec<String> = ways.filter_map(|way| std::fs::read_to_string(way).ok()).collect();
    let waits =
        |text: &String| text.contains("raise(\"e_released\")") && text.contains("wait_answer(\"run.undo.failed\", 0)");
    assert!(texts.iter().any(waits), "{:#}{texts:#?}", said.0);
}

/// One event confirms what waits for it, what is under way, and what waits its turn; and of two that nobody confirms the one that came first is
/// taken back first.
#[test]
fn what_confirms_counts_for_all_that_was_asked_for() {
    let conf = "base = Configuration { create('a', 'Drive'), create('b', 'Drive') },
                trial = Configuration { property_set('a.gain', 2.0), confirm = { event = 'e_fine', within = 0.5 } },
                trial2 = Configuration { property_set('b.gain', 2.0), confirm = { event = 'e_fine', within = 0.5 } }";
    let life = |trying: &str, more: &str| {
        format!(
            "idle = state {{}}, building = state {{ entry = 'base' }}, up = state {{}}, trying = state {{ {trying} }}, good = state {{}},
             leaving = state {{ entry = {{ 'trial2.undo', 'trial.undo', 'base.undo' }} }}, stays = state {{}},
             trans {{ src = 'initial', tgt = 'idle' }},
             trans {{ src = 'idle', tgt = 'building', events = {{ 'e_start' }} }},
             trans {{ src = 'building', tgt = 'up', events = {{ 'base.ok' }} }},
             trans {{ src = 'building', tgt = 'leaving', events = {{ 'base.failed', 'base.broken', 'e_shutdown' }} }},
             trans {{ src = 'up', tgt = 'trying', events = {{ 'e_try' }} }},
             trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'trying', tgt = 'leaving', events = {{ 'e_shutdown', 'trial.failed', 'trial2.failed' }} }},
             trans {{ src = 'good', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone' }} }},
             trans {{ src = 'leaving', tgt = 'stays', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},
             trans {{ src = 'stays', tgt = 'leaving', events = {{ 'e_shutdown' }} }},{more}"
        )
    };
    let emits = "emits: [e_fine]\n";
    for (trying, more, emits) in [
        ("entry = { 'trial', 'trial2' }", "trans { src = 'trying', tgt = 'good', events = { 'e_fine' } },", ""),
        ("entry = { 'trial', 'trial2' }", "trans { src = 'trying', tgt = 'good', events = { 'trial2.ok' } },", ""),
        ("entry = { 'trial', 'e_fine' }", "trans { src = 'trying', tgt = 'good', events = { 'trial.ok' } },", emits),
        (
            "entry = 'trial'",
            "then2 = state { entry = 'trial2' }, trans { src = 'trying', tgt = 'then2', events = { 'trial.ok' } },
             trans { src = 'then2', tgt = 'good', events = { 'e_fine' } },
             trans { src = 'then2', tgt = 'up', events = { 'trial.reverted', 'trial2.reverted' } },
             trans { src = 'then2', tgt = 'leaving', events = { 'e_shutdown' } },",
            "",
        ),
    ] {
        // Every way is gone by a script, where it is not said that none can.
        let said = Small::new(conf, &life(trying, more), emits).check();
        assert!(!said.0["findings"].as_array().unwrap().is_empty(), "{trying} {more}");
    }
}
