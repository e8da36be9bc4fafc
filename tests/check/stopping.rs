//! What is said of a way down that a deployment which is being stopped cannot go: by an event that is refused then, or by a
//! time that lasts longer than there is. The same is seen on the running product.

use crate::support::{Said, Small};
use serde_json::Value;

const BASE: &str = "base = Configuration { create('a', 'Drive') }";

/// Up in `up`, from where the shutdown event leads to `asking`; `way` leads on from there.
fn asking(way: &str) -> String {
    format!(
        "idle = state {{}}, stays = state {{}}, leaving = state {{}},
         life = state {{ config = 'base', up = state {{}}, asking = state {{}},
           trans {{ src = 'initial', tgt = 'up' }},
           trans {{ src = 'up', tgt = 'up', events = {{ 'e_estop' }} }},
           trans {{ src = 'up', tgt = 'asking', events = {{ 'e_shutdown' }} }} }},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'life', events = {{ 'e_start' }} }},
         trans {{ src = 'life', tgt = 'leaving', events = {{ 'base.failed', 'base.broken' }} }},
         trans {{ src = 'life.asking', tgt = 'leaving', events = {{ {way} }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone' }} }},
         trans {{ src = 'leaving', tgt = 'stays', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},
         trans {{ src = 'stays', tgt = 'leaving', events = {{ 'e_shutdown' }}, effect = 'base.undo' }},"
    )
}

fn only<'s>(said: &'s Said, code: &str) -> &'s Value {
    let found = said.of(code);
    assert_eq!(found.len(), 1, "{code}: {:#}", said.0);
    found[0]
}

/// Brings it up and takes it down: the exit status.
fn stopped(small: &Small) -> (i32, String) {
    small.demo.write("stop.lua", "deploy('small.yaml')\nshutdown()\n");
    let ran = small.demo.run(&["run", "stop.lua", "--clock", "simulated", "--platform", "simulated"]);
    (ran.code, ran.out + &ran.err)
}

#[test]
fn an_event_that_is_refused_while_stopping_is_no_way_down() {
    let small = Small::new(BASE, &asking("'e_yes'"), "safety: [e_estop]\n");
    let said = small.check();
    assert_eq!(said.0["verdict"], "refused", "{:#}", said.0);
    let finding = only(&said, "deploy::never_down");
    assert!(finding["help"].as_str().unwrap().contains("`e_yes` is refused while it is being stopped"), "{finding:#}");
    assert!(said.of("coord::no_way_down").is_empty(), "one cause is told once: {:#}", said.0);
    let (code, told) = stopped(&small);
    assert_eq!(code, 1, "it is not even started: {told}");

    // What stays open leads down: no event is refused without `safety`, and those that it lists are not.
    for (way, keys) in
        [("'e_yes'", ""), ("'e_yes'", "safety: [e_estop, e_yes]\n"), ("'a.faulted'", "safety: [e_estop]\n")]
    {
        let said = Small::new(BASE, &asking(way), keys).check();
        assert!(said.of("deploy::never_down").is_empty(), "{way} {keys} {:#}", said.0);
    }
}

#[test]
fn what_a_component_reports_leads_down_also_while_it_is_stopped() {
    let keys = "safety: [e_estop]
simulated: { reactions: [{ after: create a, delay_s: 0.5, raise: e_yes, component: a }] }\n";
    let said = Small::new(BASE, &asking("'e_yes'"), keys).check();
    assert!(said.of("deploy::never_down").is_empty(), "{:#}", said.0);
    assert!(said.of("coord::no_way_down").is_empty(), "{:#}", said.0);
}

#[test]
fn a_place_beside_the_way_that_only_a_refused_event_leads_down_from_is_told() {
    let aside = asking("'e_shutdown', 'e_after(0.5)'").replace(
        "trans { src = 'up', tgt = 'up', events = { 'e_estop' } },",
        "trans { src = 'up', tgt = 'up', events = { 'e_estop' } }, aside = state {}, waits = state {},
         trans { src = 'up', tgt = 'aside', events = { 'e_aside' } },
         trans { src = 'aside', tgt = 'waits', events = { 'e_shutdown' } },
         trans { src = 'waits', tgt = 'asking', events = { 'e_yes' } },",
    );
    let said = Small::new(BASE, &aside, "safety: [e_estop]\n").check();
    let finding = only(&said, "coord::no_way_down");
    let message = "from `root.life.waits` only `e_yes` leads down, which is refused when `e_shutdown` has been raised";
    assert_eq!(finding["message"], message);
    assert_eq!((said.0["verdict"].as_str(), finding["severity"].as_str()), (Some("warnings"), Some("warning")));
    let said = Small::new(BASE, &aside, "").check();
    assert!(said.of("coord::no_way_down").is_empty(), "{:#}", said.0);
}

/// Up by a time, and down by one.
fn timed(up: &str, down: &str) -> String {
    format!(
        "idle = state {{}}, building = state {{ entry = 'base' }}, warming = state {{}}, up = state {{}}, cooling = state {{}},
         leaving = state {{ entry = 'base.undo' }}, stays = state {{}},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'building', events = {{ 'e_start' }} }},
         trans {{ src = 'building', tgt = 'warming', events = {{ 'base.ok' }} }},
         trans {{ src = 'warming', tgt = 'up', events = {{ {up} }} }},
         trans {{ src = 'warming', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'building', tgt = 'leaving', events = {{ 'base.failed', 'base.broken', 'e_shutdown' }} }},
         trans {{ src = 'up', tgt = 'cooling', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'cooling', tgt = 'leaving', events = {{ {down} }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone' }} }},
         trans {{ src = 'leaving', tgt = 'stays', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},
         trans {{ src = 'stays', tgt = 'leaving', events = {{ 'e_shutdown' }} }},"
    )
}

#[test]
fn a_time_that_lasts_longer_than_the_bring_up_may_is_told_with_the_numbers() {
    let said = Small::new(BASE, &timed("'e_after(10.0)'", "'e_done'"), "").check();
    assert_eq!(said.0["verdict"], "refused");
    let message = "the bring-up lasts 10 s at least (10 s in `root.warming`), and `deploy.within_s` gives it 5 s";
    assert_eq!(only(&said, "deploy::never_up")["message"], message);
    // What lasts shorter, and what need not be waited for.
    for up in ["'e_after(4.0)'", "'e_after(10.0)', 'e_warm'"] {
        let said = Small::new(BASE, &timed(up, "'e_done'"), "").check();
        assert!(said.of("deploy::never_up").is_empty(), "{up} {:#}", said.0);
    }
    // Times one after the other.
    let two = timed("'e_after(3.0)'", "'e_done'").replace("tgt = 'up', events", "tgt = 'warmer', events").replace(
        "stays = state {},",
        "stays = state {}, warmer = state {}, trans { src = 'warmer', tgt = 'up', events = { 'e_after(2.5)' } },
         trans { src = 'warmer', tgt = 'leaving', events = { 'e_shutdown' } },",
    );
    let said = Small::new(BASE, &two, "").check();
    let message = "the bring-up lasts 5.5 s at least (3 s in `root.warming`, 2.5 s in `root.warmer`), and `deploy.within_s` \
                   gives it 5 s";
    assert_eq!(only(&said, "deploy::never_up")["message"], message);
}

#[test]
fn a_time_that_lasts_longer_than_the_shutdown_may_is_told_with_the_numbers() {
    let small = Small::new(BASE, &timed("'e_done'", "'e_after(10.0)'"), "");
    let said = small.check();
    let message = "the shutdown lasts 10 s at least (10 s in `root.cooling`), and `shutdown.within_s` gives it 5 s";
    assert_eq!(only(&said, "deploy::never_down")["message"], message);
    assert!(said.of("coord::no_way_down").is_empty(), "one cause is told once: {:#}", said.0);
    let small = Small::new(BASE, &timed("'e_done'", "'e_after(4.0)'"), "");
    assert_eq!(small.check().0["verdict"], "sound");
    assert_eq!(stopped(&small).0, 0);
}

#[test]
fn a_place_beside_the_way_that_a_time_leads_down_from_too_late_is_told() {
    let aside = timed("'e_done'", "'e_done'").replace(
        "stays = state {},",
        "stays = state {}, hot = state {}, vents = state {}, trans { src = 'up', tgt = 'hot', events = { 'e_hot' } },
         trans { src = 'hot', tgt = 'vents', events = { 'e_shutdown' } },
         trans { src = 'vents', tgt = 'leaving', events = { 'e_after(7.5)' } },",
    );
    let said = Small::new(BASE, &aside, "").check();
    let message = "from `root.vents` only a time of 7.5 s leads down, and `shutdown.within_s` gives it 5 s";
    assert_eq!(only(&said, "coord::no_way_down")["message"], message);
    assert_eq!(said.0["verdict"], "warnings");
}

#[test]
fn one_event_for_both_ends_is_told_as_what_it_is() {
    let small = Small::new(BASE, &timed("'e_done'", "'e_done'").replace("'e_start'", "'e_shutdown'"), "");
    small.demo.replace("small.yaml", "event: e_start", "event: e_shutdown");
    let said = Said(small.demo.run(&["check", "small.yaml", "--json"]).json());
    assert_eq!(only(&said, "deploy::one_event")["message"], "`e_shutdown` both starts and ends the deployment");
    let findings = said.0["findings"].as_array().unwrap();
    assert_eq!(findings.iter().filter(|found| found["severity"] != "info").count(), 1, "{:#}", said.0);
}
