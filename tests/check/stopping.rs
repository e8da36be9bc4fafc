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
    for keys in ["", "safety: [e_estop, e_yes]\n"] {
        let said = Small::new(BASE, &asking("'e_yes'"), keys).check();
        assert!(said.of("deploy::never_down").is_empty(), "{keys} {:#}", said.0);
        assert!(said.of("coord::no_way_down").is_empty(), "{keys} {:#}", said.0);
    }
}

/// That something fails nobody can promise, whether or not it is said which events are those of safety.
#[test]
fn a_failure_is_no_way_down() {
    for keys in ["", "safety: [e_estop]\n", "safety: [e_estop, a.faulted]\n"] {
        let small = Small::new(BASE, &asking("'a.faulted'"), keys);
        let said = Said(small.demo.run(&["check", "small.yaml", "--json"]).json());
        let finding = only(&said, "coord::no_way_down");
        assert!(finding["message"].as_str().unwrap().contains("only where something fails"), "{keys} {finding:#}");
    }
}

/// What a simulated component reports half a second after a step.
fn reports(after: &str) -> String {
    format!(
        "safety: [e_estop]\nsimulated: {{ reactions: [{{ after: {after}, delay_s: 0.5, raise: e_yes, component: a }}] }}\n"
    )
}

/// Up by `base`; stopped from there it comes to `stopped`. From everywhere else an emergency leads on, as the end does.
fn stopping_at(stopped: &str, more: &str) -> String {
    format!(
        "idle = state {{}}, building = state {{ entry = 'base' }}, up = state {{}}, {stopped},
         leaving = state {{ entry = {{ 'step.undo', 'base.undo' }} }}, stays = state {{}},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'building', events = {{ 'e_start' }} }},
         trans {{ src = 'building', tgt = 'up', events = {{ 'base.ok' }} }},
         trans {{ src = 'building', tgt = 'leaving', events = {{ 'base.failed', 'base.broken', 'e_shutdown', 'e_estop' }} }},
         trans {{ src = 'up', tgt = 'stopped', events = {{ 'e_shutdown', 'e_estop' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone' }} }},
         trans {{ src = 'leaving', tgt = 'stays', events = {{ 'step.undo.failed', 'step.undo.broken' }} }},
         trans {{ src = 'leaving', tgt = 'stays', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},
         trans {{ src = 'stays', tgt = 'leaving', events = {{ 'e_shutdown' }} }},{more}"
    )
}

const STEP: &str =
    "base = Configuration { create('a', 'Drive') }, step = Configuration { property_set('a.gain', 2.0) }";

#[test]
fn what_a_component_reports_leads_down_also_while_it_is_stopped() {
    let asks = stopping_at(
        "stopped = state { entry = 'step' }",
        "trans { src = 'stopped', tgt = 'leaving', events = { 'e_yes', 'step.failed', 'step.broken' } },",
    );
    // After a step that is done there; and not after one that was done long ago.
    for (after, exit, warned) in [("property_set a.gain", 0, 0), ("create a", 4, 1)] {
        let small = Small::new(STEP, &asks, &reports(after));
        let said = small.check();
        assert!(said.of("deploy::never_down").is_empty(), "stopped at once it comes down: {:#}", said.0);
        assert_eq!(said.of("coord::no_way_down").len(), warned, "{after} {:#}", said.0);
        small.demo.write("late.lua", "deploy('small.yaml')\nwait(1.0)\nshutdown()\n");
        let ran = small.demo.run(&["run", "late.lua", "--clock", "simulated", "--platform", "simulated"]);
        assert_eq!(ran.code, exit, "{after} {}{}", ran.out, ran.err);
    }
}

/// What it reports comes once. Where it may have come before, nothing leads down.
#[test]
fn what_a_component_has_reported_already_is_no_way_down() {
    let small = Small::new(BASE, &asking("'e_yes'"), &reports("create a"));
    let said = small.check();
    assert!(said.of("deploy::never_down").is_empty(), "stopped at once it comes down: {:#}", said.0);
    let finding = only(&said, "coord::no_way_down");
    let message = "from `root.life.asking` only `e_yes` leads down, and nothing is sure to raise it there";
    assert_eq!((finding["severity"].as_str(), finding["message"].as_str()), (Some("warning"), Some(message)));
    assert_eq!(stopped(&small).0, 0);
    // Where it would have been heard in every place since that step, it is still to come.
    let waits = stopping_at(
        "stopped = state {}",
        "trans { src = 'stopped', tgt = 'leaving', events = { 'e_yes', 'base.failed', 'base.broken' } },",
    );
    let waits = waits
        .replace("tgt = 'up', events = { 'base.ok' }", "tgt = 'up', events = { 'e_yes' }")
        .replace("'base.broken', 'e_shutdown', 'e_estop' } }", "'base.broken', 'e_estop' } }")
        .replace("src = 'up', tgt = 'stopped'", "src = 'up', tgt = 'leaving'")
        + "trans { src = 'building', tgt = 'stopped', events = { 'e_shutdown' } },";
    let said = Small::new(STEP, &waits.replace("'step.undo', ", ""), &reports("create a")).check();
    assert!(said.of("coord::no_way_down").iter().all(|found| found["severity"] == "info"), "{:#}", said.0);
}

/// That something fails, or is lost, is no way down: it may well not.
#[test]
fn a_fault_is_no_way_down() {
    let small = Small::new(BASE, &asking("'a.faulted'"), "safety: [e_estop]\n");
    let said = small.check();
    let message = "from `root.life.asking` only `a.faulted` leads down, and that comes only where something fails";
    assert_eq!(only(&said, "coord::no_way_down")["message"], message);
    assert_eq!(said.0["verdict"], "warnings");
    assert_eq!(stopped(&small).0, 4);
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

/// What is only noted, since something has failed before, does not hide what is warned of elsewhere.
#[test]
fn a_note_about_the_way_down_hides_no_warning() {
    let life = |aside: &str| {
        let stopped = "trans { src = 'stopped', tgt = 'leaving', events = { 'step.ok' } },
            trans { src = 'stopped', tgt = 'stays', events = { 'step.failed', 'step.broken' } },";
        stopping_at("stopped = state { entry = 'step' }", &format!("{stopped}{aside}"))
    };
    let said = Small::new(STEP, &life(""), "safety: [e_estop]\n").check();
    let message = "from `root.stays` only a second `e_shutdown` leads down, and it is raised once";
    let finding = only(&said, "coord::no_way_down");
    assert_eq!((finding["severity"].as_str(), finding["message"].as_str()), (Some("info"), Some(message)));
    let aside = "aside = state {}, waits = state {}, trans { src = 'up', tgt = 'aside', events = { 'e_aside' } },
        trans { src = 'aside', tgt = 'waits', events = { 'e_shutdown', 'e_estop' } },
        trans { src = 'waits', tgt = 'stopped', events = { 'e_yes' } },";
    let said = Small::new(STEP, &life(aside), "safety: [e_estop]\n").check();
    let message = "from `root.waits` only `e_yes` leads down, which is refused when `e_shutdown` has been raised";
    let finding = only(&said, "coord::no_way_down");
    assert_eq!((finding["severity"].as_str(), finding["message"].as_str()), (Some("warning"), Some(message)));
}

/// Where an emergency comes on the way down its time stands still, and people lead on: by the event that ends it once more.
#[test]
fn after_an_emergency_on_the_way_down_people_lead_on() {
    let conf = "base = Configuration { create('a', 'Drive') }, step = Configuration { safe = true, property_set('a.gain', 0.0) }";
    let said = |from: &str, to: &str| {
        let brakes = format!(
            "trans {{ src = 'stopped', tgt = 'leaving', events = {{ 'e_after(1.0)' }} }},
             braking = state {{ entry = 'step' }}, braked = state {{}}, waits = state {{}},
             trans {{ src = '{from}', tgt = 'braking', events = {{ 'e_estop' }} }},
             trans {{ src = 'braking', tgt = 'braked', events = {{ 'step.ok', 'step.failed', 'step.broken' }} }},
             trans {{ src = 'braked', tgt = '{to}', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'braked', tgt = 'leaving', events = {{ 'e_reset' }} }},
             trans {{ src = 'waits', tgt = 'leaving', events = {{ 'e_shutdown', 'e_reset' }} }},"
        );
        let coordinator = stopping_at("stopped = state {}", &brakes);
        let coordinator = coordinator.replace(
            "'up', tgt = 'stopped', events = { 'e_shutdown', 'e_estop' }",
            "'up', tgt = 'stopped', events = { 'e_shutdown' }",
        );
        Small::new(conf, &coordinator, "safety: [e_estop]\n").check()
    };
    let after = said("stopped", "leaving");
    let found = after.of("coord::no_way_down");
    assert!(found.iter().all(|finding| finding["severity"] == "info"), "{found:#?}");
    // Nobody is asked where it came before.
    let before = said("up", "waits");
    let message = "from `root.waits` only `e_reset` leads down, which is refused when `e_shutdown` has been raised";
    assert_eq!(only(&before, "coord::no_way_down")["message"], message);
    assert_eq!(before.0["verdict"], "warnings");
}

/// Up by `base` and, there, `step`: where that fails, to `failed`.
fn failing(failed: &str, listed: bool) -> Small {
    let coordinator = stopping_at(
        "failed = state {}",
        &format!(
            "waits = state {{}}, trans {{ src = 'up', tgt = 'failed', events = {{ 'step.failed', 'step.broken' }} }},{failed}"
        ),
    );
    let coordinator = coordinator
        .replace("up = state {}", "up = state { entry = 'step' }")
        .replace("tgt = 'stopped'", "tgt = 'leaving'")
        .replace("'base.failed', 'base.broken', 'e_shutdown', 'e_estop' } }", "'e_shutdown' } }")
        + "trans { src = 'building', tgt = 'failed', events = { 'base.failed', 'base.broken' } },";
    let small = Small::new(STEP, &coordinator, "safety: [e_estop]\n");
    if listed {
        small.demo.replace("small.yaml", "up: up, within_s", "up: up, failed: [failed], within_s");
    }
    small
}

/// Brings it up, where `step` fails: the exit status.
fn fails(small: &Small) -> i32 {
    small.demo.write("fails.lua", "fault('property_set a.gain', 'fail', 1)\ndeploy('small.yaml')\n");
    small.demo.run(&["run", "fails.lua", "--clock", "simulated", "--platform", "simulated"]).code
}

/// A bring-up that fails is stopped where `deploy.failed` says so: what nobody hears there leads nowhere, and nothing is waited
/// for.
#[test]
fn a_bring_up_that_has_failed_is_led_down_by_the_event_that_ends_it() {
    let warned = |small: &Small| -> Vec<String> {
        let said = small.check();
        let found = said.of("coord::no_way_down").into_iter().filter(|finding| finding["severity"] == "warning");
        found.map(|finding| finding["message"].as_str().unwrap().to_owned()).collect()
    };
    let deaf = "trans { src = 'failed', tgt = 'leaving', events = { 'e_after(1.0)', 'e_estop' } },";
    let small = failing(deaf, true);
    let message = "nobody hears `e_shutdown` in `root.failed`, where the bring-up has failed: it is taken back without its coordinator";
    assert_eq!((warned(&small), fails(&small)), (vec![message.to_owned()], 4));
    // What is not known to mean that it failed is waited in, until that takes too long.
    let small = failing(deaf, false);
    assert_eq!((warned(&small), fails(&small)), (vec![], 1));
    // Stopped there all the same (by people, or since it is late), it is not waited for, either.
    let message = "nobody hears `e_shutdown` in `root.failed`, before it is up; it rests there, and is taken back without its coordinator";
    let said = small.check();
    let found = only(&said, "coord::no_way_down");
    assert_eq!((found["severity"].as_str(), found["message"].as_str()), (Some("info"), Some(message)));
    small.demo.replace("small.yaml", "up: up, within_s: 5", "up: up, within_s: 0.5");
    assert_eq!(fails(&small), 4);
    // What it leads to is looked at as where nothing has failed.
    let small = failing(
        "trans { src = 'failed', tgt = 'waits', events = { 'e_shutdown' } },
         trans { src = 'waits', tgt = 'leaving', events = { 'e_reset' } },",
        true,
    );
    let message = "from `root.waits` only `e_reset` leads down, which is refused when `e_shutdown` has been raised";
    assert_eq!((warned(&small), fails(&small)), (vec![message.to_owned()], 4));
    let small = failing("trans { src = 'failed', tgt = 'leaving', events = { 'e_shutdown' } },", true);
    assert_eq!((warned(&small), fails(&small)), (vec![], 1));
}

/// What is still coming up and is stopped where nobody hears that: what is under way comes to its end, and nothing else.
#[test]
fn a_bring_up_that_is_stopped_where_nobody_hears_it_is_told() {
    let rests = |heard: &str, more: &str| {
        let way = timed("'e_warm'", "'e_done'")
            .replace("trans { src = 'warming', tgt = 'leaving', events = { 'e_shutdown' } },", more);
        let small = Small::new(BASE, &way.replace("'base.broken', 'e_shutdown'", heard), "safety: [e_estop]\n");
        small.demo.replace("small.yaml", "up: up, within_s: 5", "up: up, within_s: 0.5");
        let said = small.check();
        let found = said.of("coord::no_way_down").into_iter().filter(|finding| finding["severity"] == "warning");
        let found: Vec<String> = found.map(|finding| finding["message"].as_str().unwrap().to_owned()).collect();
        small.demo.write("late.lua", "deploy('small.yaml')\n");
        let ran = small.demo.run(&["run", "late.lua", "--clock", "simulated", "--platform", "simulated"]);
        (found, ran.code)
    };
    let message = |unheard: &str| {
        let rests = if unheard == "root.warming" { "there" } else { "in `root.warming`" };
        format!(
            "nobody hears `e_shutdown` in `{unheard}`, before it is up; it rests {rests}, and is taken back without its coordinator"
        )
    };
    let leads = "trans { src = 'warming', tgt = 'leaving', events = { 'e_shutdown', 'e_after(1.0)' } },";
    assert_eq!(rests("'base.broken', 'e_shutdown'", leads), (vec![], 1));
    let leads = "trans { src = 'warming', tgt = 'leaving', events = { 'e_after(1.0)' } },";
    assert_eq!(rests("'base.broken', 'e_shutdown'", leads), (vec![message("root.warming")], 4));
    // It may come before that, too.
    assert_eq!(rests("'base.broken'", leads), (vec![message("root.building")], 4));
    // Nothing is there to be taken back.
    let way = timed("'e_done'", "'e_done'").replace(
        "'leaving', events = { 'base.failed', 'base.broken', 'e_shutdown' } },",
        "'leaving', events = { 'base.broken', 'e_shutdown' } }, bad = state {},
         trans { src = 'building', tgt = 'bad', events = { 'base.failed' } },
         trans { src = 'bad', tgt = 'leaving', events = { 'e_after(1.0)' } },",
    );
    let small = Small::new(BASE, &way, "safety: [e_estop]\n");
    small.demo.replace("small.yaml", "up: up, within_s: 5", "up: up, within_s: 0.5");
    assert!(
        small.check().of("coord::no_way_down").iter().all(|found| !found["message"].as_str().unwrap().contains("bad"))
    );
    small.demo.write("fails.lua", "fault('create a', 'fail', 1)\ndeploy('small.yaml')\n");
    assert_eq!(small.demo.run(&["run", "fails.lua", "--clock", "simulated"]).code, 1);
}

/// A state listed in `deploy.failed` on the way up.
#[test]
fn a_bring_up_that_comes_to_where_it_has_failed_never_comes_up() {
    let way = stopping_at(
        "warming = state {}",
        "trans { src = 'warming', tgt = 'up', events = { 'e_after(1.0)' } },
         trans { src = 'warming', tgt = 'leaving', events = { 'e_shutdown', 'e_estop' } },",
    );
    let way = way.replace("tgt = 'up', events = { 'base.ok' }", "tgt = 'warming', events = { 'base.ok' }");
    let way = way.replace("tgt = 'stopped'", "tgt = 'leaving'").replace("'step.undo', ", "");
    let of = |failed: &str| {
        let small = Small::new(STEP, &way, "");
        small.demo.replace("small.yaml", "up: up, within_s", &format!("up: up, failed: [{failed}], within_s"));
        small
    };
    for (failed, at) in [("warming", "root.warming"), ("up", "root.up")] {
        let said = of(failed).check();
        let message = format!("the bring-up comes to `{at}`, where `deploy.failed` says that it has failed");
        assert_eq!(only(&said, "deploy::never_up")["message"], message.as_str());
    }
    let said = of("stays").check();
    assert!(said.of("deploy::never_up").is_empty(), "{:#}", said.0);
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

/// Times that add up beside the way on which everything goes well.
#[test]
fn a_way_down_whose_times_add_up_to_more_than_there_is_is_told() {
    let aside = |states: &str, ways: &str| {
        let more = format!(
            "stays = state {{}}, hot = state {{}}, {states}, trans {{ src = 'up', tgt = 'hot', events = {{ 'e_hot' }} }},
             trans {{ src = 'hot', tgt = 'vents', events = {{ 'e_shutdown' }} }},{ways}"
        );
        Small::new(BASE, &timed("'e_done'", "'e_done'").replace("stays = state {},", &more), "")
    };
    let two = |second: &str| {
        let ways = format!(
            "trans {{ src = 'vents', tgt = 'airs', events = {{ 'e_after(3.0)' }} }},
             trans {{ src = 'airs', tgt = 'leaving', events = {{ {second} }} }},"
        );
        aside("vents = state {}, airs = state {}", &ways)
    };
    let one_in_the_other = aside(
        "vents = state { first = state {}, second = state {}, trans { src = 'initial', tgt = 'first' },
         trans { src = 'first', tgt = 'second', events = { 'e_after(3.0)' } } }",
        "trans { src = 'vents', tgt = 'leaving', events = { 'e_after(4.0)' } },",
    );
    let message = "the way down by `root.vents` lasts 5.5 s at least, and `shutdown.within_s` gives it 5 s";
    let aside = [(two("'e_after(2.5)'"), vec![message], 4), (two("'e_after(1.5)'"), vec![], 0)];
    for (small, told, exit) in aside.into_iter().chain([(one_in_the_other, vec![], 0)]) {
        let said = small.check();
        let found = said.of("coord::no_way_down");
        let messages: Vec<_> = found.iter().map(|finding| finding["message"].as_str().unwrap()).collect();
        assert_eq!(messages, told, "{:#}", said.0);
        small.demo.write("hot.lua", "deploy('small.yaml')\nraise('e_hot')\nwait(0.1)\nshutdown()\n");
        let ran = small.demo.run(&["run", "hot.lua", "--clock", "simulated", "--platform", "simulated"]);
        assert_eq!(ran.code, exit, "{}{}", ran.out, ran.err);
    }
    // Nothing need be waited for where something else may lead on.
    let said = two("'e_after(2.5)', 'e_cool'").check();
    assert!(said.of("coord::no_way_down").is_empty(), "{:#}", said.0);
    // Where something has failed before it is noted.
    let parks = "stays = state {}, parks = state { entry = 'park' }, again = state {}, rests = state {},
        trans { src = 'parks', tgt = 'leaving', events = { 'park.ok' } },
        trans { src = 'parks', tgt = 'again', events = { 'park.failed', 'park.broken' } },
        trans { src = 'again', tgt = 'rests', events = { 'e_after(3.0)' } },
        trans { src = 'rests', tgt = 'leaving', events = { 'e_after(3.0)' } },";
    let parks = timed("'e_done'", "'e_done'").replace("stays = state {},", parks);
    let parks = parks.replace("'cooling', tgt = 'leaving'", "'cooling', tgt = 'parks'");
    let parks = parks.replace("entry = 'base.undo'", "entry = { 'park.undo', 'base.undo' }");
    let conf = format!("{BASE}, park = Configuration {{ property_set('a.gain', 2.0) }}");
    let said = Small::new(&conf, &parks, "").check();
    let message = "the way down by `root.again` lasts 6 s at least, and `shutdown.within_s` gives it 5 s";
    let finding = only(&said, "coord::no_way_down");
    assert_eq!((finding["severity"].as_str(), finding["message"].as_str()), (Some("info"), Some(message)));
}

/// What comes late on the way down, and begins another time there.
#[test]
fn a_way_down_on_which_an_event_comes_late_is_told_where_its_times_add_up() {
    let cooling = |down: &str, states: &str, keys: &str| {
        let states = format!("stays = state {{}}, {states}");
        Small::new(BASE, &timed("'e_done'", down).replace("stays = state {},", &states), keys)
    };
    let vents = |first: &str, then: &str| {
        let states = format!(
            "vents = state {{}}, trans {{ src = 'cooling', tgt = 'vents', events = {{ 'e_estop' }} }},
             trans {{ src = 'vents', tgt = 'leaving', events = {{ {then} }} }},"
        );
        // Half a second before the first time is over.
        let late = "safety: [e_estop]\nsimulated: { reactions: [{ after: create a, delay_s: 3.0, raise: e_estop, component: a }] }\n";
        cooling(first, &states, late)
    };
    let lasts = |at: &str, all: &str, why: &str| {
        format!("the way down by `root.{at}` lasts up to {all} s where {why}, and `shutdown.within_s` gives it 5 s")
    };
    let late = vec![lasts("vents", "5.5", "`e_estop` comes late")];
    let cases = [
        (vents("'e_after(3.0)'", "'e_after(2.5)'"), late.clone(), 4),
        // Also where it would go on sooner with it than without it, were it raised at once.
        (vents("'e_after(3.5)'", "'e_after(2.0)'"), late, 0),
        (vents("'e_after(3.0)'", "'e_after(2.0)'"), vec![], 0),
        // What somebody else may lead on from is not waited for.
        (vents("'e_after(3.0)'", "'e_after(2.5)', 'e_estop'"), vec![], 4),
    ];
    for (small, told, exit) in cases {
        let said = small.check();
        let found = said.of("coord::no_way_down").into_iter().filter(|finding| finding["severity"] == "warning");
        let messages: Vec<_> = found.map(|finding| finding["message"].as_str().unwrap()).collect();
        assert_eq!(messages, told, "{:#}", said.0);
        small.demo.write("late.lua", "deploy('small.yaml')\nwait(0.5)\nshutdown()\n");
        let ran = small.demo.run(&["run", "late.lua", "--clock", "simulated", "--platform", "simulated"]);
        assert_eq!(ran.code, exit, "{}{}", ran.out, ran.err);
    }
    let told = |small: &Small| -> Vec<String> {
        let said = small.check();
        said.of("coord::no_way_down").iter().map(|found| found["message"].as_str().unwrap().to_owned()).collect()
    };
    // One after the other, and one and the same again and again.
    let both = cooling(
        "'e_after(2.0)'",
        "vents = state {}, airs = state {}, trans { src = 'cooling', tgt = 'vents', events = { 'e_one' } },
         trans { src = 'vents', tgt = 'airs', events = { 'e_two' } },
         trans { src = 'vents', tgt = 'leaving', events = { 'e_after(2.0)' } },
         trans { src = 'airs', tgt = 'leaving', events = { 'e_after(1.5)' } },",
        "",
    );
    assert_eq!(told(&both), [lasts("airs", "5.5", "`e_one`, `e_two` come late")]);
    let again = "trans { src = 'cooling', tgt = 'cooling', events = { 'e_one' } },";
    let again = cooling("'e_after(2.0)'", again, "");
    assert_eq!(told(&again), [lasts("cooling", "6", "`e_one` comes late again and again")]);
    // What leads on as the time does makes nothing longer, whenever it comes.
    let as_well = cooling(
        "'e_after(2.0)'",
        "vents = state {}, airs = state {}, trans { src = 'cooling', tgt = 'vents', events = { 'e_after(2.0)' } },
         trans { src = 'vents', tgt = 'airs', events = { 'e_after(3.0)', 'e_one' } },
         trans { src = 'airs', tgt = 'leaving', events = { 'e_after(1.0)' } },",
        "",
    );
    as_well.demo.replace(
        "coordinator.lua",
        "src = 'cooling', tgt = 'leaving', events = { 'e_after(2.0)' }",
        "src = 'cooling', tgt = 'leaving', events = { 'e_never' }",
    );
    let found = told(&as_well);
    assert!(!found.iter().any(|message| message.contains("late")), "{found:?}");
    // A time around it runs on, whatever comes inside.
    let inside = |around: &str| {
        let states = "vents = state {}, cooling = state { first = state {}, second = state {},
             trans { src = 'initial', tgt = 'first' }, trans { src = 'first', tgt = 'second', events = { 'e_one' } },
             trans { src = 'first', tgt = 'vents', events = { 'e_after(3.0)' } } },
             trans { src = 'vents', tgt = 'leaving', events = { 'e_done' } },";
        let way = timed("'e_done'", around).replace("cooling = state {},", "").replace("stays = state {},", states);
        Small::new(BASE, &way.replace("leaving = state", "stays = state {}, leaving = state"), "")
    };
    assert!(told(&inside("'e_after(4.0)'")).is_empty());
    // Nobody raises what is refused; a fault, or the event that ends it once more, is no emergency.
    for event in ["e_one", "a.faulted", "e_shutdown"] {
        let states = format!(
            "vents = state {{}}, trans {{ src = 'cooling', tgt = 'vents', events = {{ '{event}' }} }},
             trans {{ src = 'vents', tgt = 'leaving', events = {{ 'e_after(2.5)' }} }},"
        );
        let small = cooling("'e_after(3.0)'", &states, "safety: [e_estop]\n");
        assert_eq!(told(&small), Vec::<String>::new(), "{event}");
    }
}

/// Where it is not heard, stopping begins at any moment of a state that has a time.
#[test]
fn a_time_that_has_just_begun_when_stopping_begins_counts_whole() {
    let way = |within: &str| {
        let states = "stays = state {}, hot = state {}, trans { src = 'up', tgt = 'hot', events = { 'e_hot' } },
             trans { src = 'hot', tgt = 'cooling', events = { 'e_after(3.0)' } },";
        let small = Small::new(BASE, &timed("'e_done'", "'e_after(2.5)'").replace("stays = state {},", states), "");
        small.demo.replace("small.yaml", "down: idle, within_s: 5", &format!("down: idle, within_s: {within}"));
        small
    };
    let small = way("5");
    let said = small.check();
    let message = "the way down by `root.hot` lasts 5.5 s at least, and `shutdown.within_s` gives it 5 s";
    assert_eq!(only(&said, "coord::no_way_down")["message"], message);
    let script = "deploy('small.yaml')\nraise('e_hot')\nwait(0.1)\nshutdown()\n";
    for (small, exit) in [(small, 4), (way("6"), 0)] {
        small.demo.write("hot.lua", script);
        let ran = small.demo.run(&["run", "hot.lua", "--clock", "simulated", "--platform", "simulated"]);
        assert_eq!(ran.code, exit, "{}{}", ran.out, ran.err);
    }
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

/// The event that ends the deployment overtakes what has come just before, and is refused no more.
#[test]
fn an_event_that_came_just_before_is_heard_behind_the_one_that_ends_it() {
    let states = |back: &str| {
        format!(
            "idle = state {{}}, building = state {{ entry = 'base' }}, up = state {{}}, failed = state {{}},
             leaving = state {{ entry = 'base.undo', going = state {{}}, turn = state {{}},
               trans {{ src = 'initial', tgt = 'going' }},
               trans {{ src = 'going', tgt = 'turn', events = {{ 'e_back' }} }},
               trans {{ src = 'turn', tgt = 'going', events = {{ 'e_shutdown' }} }} }},
             trans {{ src = 'initial', tgt = 'idle' }},
             trans {{ src = 'idle', tgt = 'building', events = {{ 'e_start' }} }},
             trans {{ src = 'building', tgt = 'up', events = {{ 'base.ok' }} }},
             trans {{ src = 'building', tgt = 'failed', events = {{ 'base.failed', 'base.broken' }} }},
             trans {{ src = 'building', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'up', tgt = 'up', events = {{ 'e_estop' }} }},
             trans {{ src = 'failed', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'leaving.going', tgt = 'idle', events = {{ 'base.undone' }} }},
             trans {{ src = 'leaving.turn', tgt = '{back}', events = {{ 'base.undone' }} }},
             trans {{ src = 'leaving', tgt = 'failed', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},"
        )
    };
    for (back, warned, exit) in [("building", 1, 4), ("idle", 0, 0)] {
        let small = Small::new(BASE, &states(back), "safety: [e_estop]\n");
        let said = small.check();
        let found = said.of("coord::no_way_down").into_iter().filter(|found| found["severity"] == "warning");
        assert_eq!(found.count(), warned, "{back} {:#}", said.0);
        small.demo.write("back.lua", "deploy('small.yaml')\nwait(0.1)\nraise('e_back')\n");
        let ran = small.demo.run(&["run", "back.lua", "--clock", "simulated", "--platform", "simulated"]);
        assert_eq!(ran.code, exit, "{back} {}{}", ran.out, ran.err);
    }
}

/// From a mode that is entered while it is being stopped a failure alone leads on, in the end: that hides nothing of where nothing has failed.
#[test]
fn a_way_that_only_failures_open_hides_no_state_without_one() {
    let states = |more: &str| {
        format!(
            "idle = state {{}}, fail = state {{}}, leave = state {{}}, again = state {{ entry = 'base.undo' }},
             life = state {{ config = 'base', s = state {{}}, w = state {{}}, up = state {{}},
               trans {{ src = 'initial', tgt = 's' }}, trans {{ src = 's', tgt = 'w', events = {{ 'e_shutdown' }} }},
               trans {{ src = 's', tgt = 'up', events = {{ 'base.ok' }} }}, trans {{ src = 'w', tgt = 'up', events = {{ 'base.ok' }} }},
               {more} }},
             trans {{ src = 'initial', tgt = 'idle' }}, trans {{ src = 'idle', tgt = 'life', events = {{ 'e_start' }} }},
             trans {{ src = 'life', tgt = 'fail', events = {{ 'base.failed', 'base.broken' }} }},
             trans {{ src = 'life.up', tgt = 'leave', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'fail', tgt = 'again', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'leave', tgt = 'idle', events = {{ 'base.undone' }} }},
             trans {{ src = 'leave', tgt = 'fail', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},
             trans {{ src = 'again', tgt = 'idle', events = {{ 'base.undone' }} }},
             trans {{ src = 'again', tgt = 'fail', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},"
        )
    };
    let mode = "mode = state { config = 'soft' },
        trans { src = 'up', tgt = 'mode', events = { 'e_mode' } },
        trans { src = 'mode', tgt = 'up', events = { 'e_base', 'soft.failed', 'soft.broken' } },";
    let leaves = "trans { src = 'life.mode', tgt = 'leave', events = { 'e_shutdown' } },";
    for states in [states(""), states(mode) + leaves] {
        let soft = format!("{BASE}, soft = Configuration {{ property_set('a.gain', 2.0) }}");
        let small = Small::new(&soft, &states, "");
        let said = small.check();
        let told = only(&said, "coord::no_way_down");
        assert_eq!(told["severity"], "warning", "{told:#}");
        let message = told["message"].as_str().unwrap();
        assert!(message.starts_with("from `root.life.up` only a second `e_shutdown` leads down"), "{message}");
    }
}

/// Nobody is there to raise it, unless it is listed as one that comes from outside, or a reaction does.
#[test]
fn a_bring_up_that_waits_for_what_nothing_raises_is_told() {
    let life = |event: &str| {
        format!(
            "idle = state {{}}, building = state {{ entry = 'base' }}, warming = state {{}}, up = state {{}},
             leaving = state {{ entry = 'base.undo' }},
             trans {{ src = 'initial', tgt = 'idle' }},
             trans {{ src = 'idle', tgt = 'building', events = {{ 'e_start' }} }},
             trans {{ src = 'building', tgt = 'warming', events = {{ 'base.ok' }} }},
             trans {{ src = 'building', tgt = 'leaving', events = {{ 'base.failed', 'base.broken', 'e_shutdown' }} }},
             trans {{ src = 'warming', tgt = 'up', events = {{ {event} }} }},
             trans {{ src = 'warming', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone', 'base.undo.failed', 'base.undo.broken' }} }},"
        )
    };
    let said = |event: &str, keys: &str| Small::new(BASE, &life(event), keys).check();
    let told = said("'e_wram'", "");
    let finding = only(&told, "deploy::by_hand");
    assert_eq!(finding["message"], "the bring-up waits in `root.warming` for `e_wram`, which nothing here raises");
    assert_eq!(finding["severity"], "warning");
    let reacts = "simulated: { reactions: [{ after: create a, delay_s: 0.5, raise: e_warm, component: a }] }\n";
    for (event, keys) in [
        ("'e_warm'", reacts),
        ("'e_warm', 'e_other'", reacts),
        ("'e_after(1.0)'", ""),
        ("'e_warm'", "safety: [e_warm]\n"),
    ] {
        assert!(said(event, keys).of("deploy::by_hand").is_empty(), "{event} {keys}");
    }
}

/// On the way down as on the way up; where a time leads on as well nobody has to raise it.
#[test]
fn a_shutdown_that_waits_for_what_nothing_raises_is_told() {
    let life = |event: &str| {
        format!(
            "idle = state {{}}, building = state {{ entry = 'base' }}, up = state {{}}, asking = state {{}}, leaving = state {{ entry = 'base.undo' }},
             trans {{ src = 'initial', tgt = 'idle' }},
             trans {{ src = 'idle', tgt = 'building', events = {{ 'e_start' }} }},
             trans {{ src = 'building', tgt = 'up', events = {{ 'base.ok' }} }},
             trans {{ src = 'building', tgt = 'leaving', events = {{ 'base.failed', 'base.broken', 'e_shutdown' }} }},
             trans {{ src = 'up', tgt = 'asking', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'asking', tgt = 'leaving', events = {{ {event} }} }},
             trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone', 'base.undo.failed', 'base.undo.broken' }} }},"
        )
    };
    let said = |event: &str| Small::new(BASE, &life(event), "").check();
    let told = said("'e_yes'");
    let finding = only(&told, "deploy::by_hand");
    assert_eq!(finding["message"], "the shutdown waits in `root.asking` for `e_yes`, which nothing here raises");
    assert_eq!(finding["severity"], "warning");
    assert!(said("'e_yes', 'e_after(1.0)'").of("deploy::by_hand").is_empty());
}

/// A step of something safe fails, and its coordinator waits from then on for an answer that it has had: of the system nothing is known there, but of
/// what is waited for there is.
#[test]
fn who_is_not_led_down_behind_something_safe_that_failed_is_told() {
    let configurations = "base = Configuration { create('a', 'Drive') },
        dim = Configuration { safe = true, property_set('a.gain', 0.0) },";
    let coordinator = |heard: &str| {
        format!(
            "idle = state {{}}, making = state {{ entry = 'base' }}, up = state {{}}, dimmed = state {{}},
             dimming = state {{ entry = 'dim', waits = state {{}}, going = state {{}},
               trans {{ src = 'initial', tgt = 'waits' }}, trans {{ src = 'waits', tgt = 'going', events = {{ 'e_shutdown' }} }} }},
             lighting = state {{ entry = 'dim.undo' }}, leaving = state {{ entry = 'base.undo' }},
             trans {{ src = 'initial', tgt = 'idle' }},
             trans {{ src = 'idle', tgt = 'making', events = {{ 'e_start' }} }},
             trans {{ src = 'making', tgt = 'up', events = {{ 'base.ok' }} }},
             trans {{ src = 'making', tgt = 'leaving', events = {{ 'base.failed', 'base.broken', 'e_shutdown' }} }},
             trans {{ src = 'up', tgt = 'dimming', events = {{ 'e_dim' }} }},
             trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'dimming.waits', tgt = 'dimmed', events = {{ {heard} }} }},
             trans {{ src = 'dimming.going', tgt = 'lighting', events = {{ 'dim.ok', 'dim.failed', 'dim.broken' }} }},
             trans {{ src = 'dimmed', tgt = 'lighting', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'lighting', tgt = 'leaving', events = {{ 'dim.undone', 'dim.undo.failed', 'dim.undo.broken' }} }},
             trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone' }} }},
             trans {{ src = 'leaving', tgt = 'leaving', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},"
        )
    };
    let whole = Small::new(configurations, &coordinator("'dim.ok', 'dim.failed', 'dim.broken'"), "").check();
    assert!(whole.of("coord::no_way_down").is_empty(), "{:#}", whole.0);
    let small = Small::new(configurations, &coordinator("'dim.ok', 'dim.failed'"), "");
    let said = small.check();
    let message = only(&said, "coord::no_way_down")["message"].as_str().unwrap();
    assert_eq!(message, "from `root.dimming.waits` no way leads down, where something safe could not be done whole");
    // So it is.
    small.demo.write(
        "s.lua",
        "deploy('small.yaml') fault('property_set a.gain', 'fail', 1) raise('e_dim') wait(1) raise('e_shutdown') wait(1)
         say(active()[#active()])",
    );
    let ran = small.demo.run(&["run", "s.lua", "--clock", "simulated", "--platform", "simulated", "--quiet"]);
    assert_eq!((ran.out.lines().next(), ran.code), (Some("root.dimming.going"), 4), "{}", ran.err);
}
