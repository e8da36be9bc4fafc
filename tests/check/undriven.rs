//! In-ports that nothing drives while a deployment is up: which configurations count, and when.

use crate::demo::Demo;
use crate::support::{Said, Small};

const CONFIGURATIONS: &str = "base = Configuration { create('a', 'Drive'), create('b', 'Drive') },";
/// It drives one of them, and wants to be asked for.
const FEED: &str = "feed = Configuration { connect('a.out', 'b.in') },";

const STATES: &str = "idle = state {}, building = state { entry = 'base' }, up = state {}, leaving = state { entry = 'base.undo' }, stuck = state {},
    trans { src = 'initial', tgt = 'idle' },
    trans { src = 'idle', tgt = 'building', events = { 'e_start' } },
    trans { src = 'building', tgt = 'up', events = { 'base.ok' } },
    trans { src = 'building', tgt = 'leaving', events = { 'base.failed', 'base.broken', 'e_shutdown' } },
    trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown' } },
    trans { src = 'leaving', tgt = 'idle', events = { 'base.undone' } },
    trans { src = 'leaving', tgt = 'stuck', events = { 'base.undo.failed', 'base.undo.broken' } },
    trans { src = 'stuck', tgt = 'leaving', events = { 'e_shutdown' } },";

/// A mode beside `up` that `feed` belongs to.
const MODE: &str = "fed = state { config = 'feed' },
    trans { src = 'up', tgt = 'fed', events = { 'e_feed' } },
    trans { src = 'fed', tgt = 'up', events = { 'e_back', 'feed.failed', 'feed.broken' } },
    trans { src = 'fed', tgt = 'leaving', events = { 'e_shutdown' } },";

fn small(configurations: &str, states: &str, keys: &str) -> Small {
    Small::new(&format!("{CONFIGURATIONS}{configurations}"), &format!("{STATES}{states}"), keys)
}

/// What the note says.
fn note(said: &Said) -> &str {
    said.of("deploy::port_undriven").first().and_then(|finding| finding["message"].as_str()).unwrap_or_default()
}

/// The warnings, each with its help.
fn required(said: &Said) -> Vec<(String, String)> {
    let text = |finding: &serde_json::Value, key: &str| finding[key].as_str().unwrap_or_default().to_owned();
    said.of("deploy::port_required").into_iter().map(|of| (text(of, "message"), text(of, "help"))).collect()
}

fn needs(small: &Small) {
    small.demo.replace(
        "small.yaml",
        "in: { direction: in, type: float }",
        "in: { direction: in, type: float, required: true }",
    );
}

/// A note of all in-ports that nothing drives, a warning of each that its type says it needs.
#[test]
fn what_nothing_drives_is_told() {
    let small = small("", "", "");
    let said = small.check();
    assert_eq!(note(&said), "`a.in`, `b.in`: in-ports that nothing drives");
    assert_eq!(said.0["verdict"], "sound", "{:#}", said.0);
    needs(&small);
    let said = small.check();
    assert_eq!(note(&said), "");
    let (message, help) = &required(&said)[0];
    assert_eq!(message, "nothing drives `a.in`, and its component needs it");
    assert!(help.contains("port_write(\"a.in\", …)"), "{help}");
    assert_eq!(said.0["verdict"], "warnings", "{:#}", said.0);
    // An operator who may set it drives it, and so does what is written with what it is made by.
    small.demo.replace("small.yaml", "coordinator:", "operator: [a.in]\ncoordinator:");
    small.demo.replace("conf.lua", "create('b', 'Drive')", "create('b', 'Drive'), port_write('b.in', 1.0)");
    let said = small.check();
    assert!(required(&said).is_empty() && note(&said).is_empty(), "{:#}", said.0);
}

/// What no coordinator asks for and no operator may apply is never in force.
#[test]
fn what_nobody_asks_for_drives_nothing() {
    let never = "never = Configuration { connect('a.out', 'a.in'), port_write('b.in', 1.0) },";
    let small = small(never, "", "");
    let said = small.check();
    assert_eq!(note(&said), "`a.in`, `b.in`: in-ports that nothing drives while the deployment is up");
    assert!(said.of("deploy::port_undriven")[0]["help"].as_str().unwrap().contains("`never`"), "{:#}", said.0);
    needs(&small);
    let said = small.check();
    let told = required(&said);
    assert_eq!(told.len(), 2, "{:#}", said.0);
    assert_eq!(told[1].0, "nothing drives `b.in` while the deployment is up, and its component needs it");
    assert!(told[1].1.contains("`never`") && told[1].1.contains("operator: [never]"), "{told:?}");
    assert_eq!(said.0["verdict"], "warnings", "{:#}", said.0);
    let text = small.demo.run(&["check", "small.yaml"]);
    assert!(text.out.contains("while the deployment is up") || text.err.contains("while the deployment is up"));
    // What an operator may apply may be in force.
    small.demo.replace("small.yaml", "coordinator:", "operator: [never]\ncoordinator:");
    assert!(required(&small.check()).is_empty());
    small.demo.replace("small.yaml", "operator: [never]\n", "");
    small.demo.replace("conf.lua", "never = Configuration {", "never = Configuration { safe = true,");
    assert!(required(&small.check()).is_empty());
}

/// One that drives in some mode drives; one that is over before it is up does not.
#[test]
fn what_is_in_force_while_it_is_up_drives() {
    let mode = small(FEED, MODE, "").check();
    assert_eq!(note(&mode), "`a.in`: an in-port that nothing drives", "{:#}", mode.0);
    let first = STATES.replace("tgt = 'up', events = { 'base.ok' }", "tgt = 'trying', events = { 'base.ok' }");
    let tried = "trying = state { entry = 'feed' }, tried = state { entry = 'feed.undo' }, giving_up = state { entry = 'feed.undo' },
        trans { src = 'trying', tgt = 'tried', events = { 'feed.ok' } },
        trans { src = 'trying', tgt = 'leaving', events = { 'feed.failed' } },
        trans { src = 'trying', tgt = 'giving_up', events = { 'feed.broken', 'e_shutdown' } },
        trans { src = 'tried', tgt = 'up', events = { 'feed.undone' } },
        trans { src = 'tried', tgt = 'giving_up', events = { 'feed.undo.failed', 'feed.undo.broken', 'e_shutdown' } },
        trans { src = 'giving_up', tgt = 'leaving', events = { 'feed.undone', 'feed.undo.failed', 'feed.undo.broken' } },";
    let small = Small::new(&format!("{CONFIGURATIONS}{FEED}"), &format!("{first}{tried}"), "");
    let over = small.check();
    assert_eq!(note(&over), "`a.in`, `b.in`: in-ports that nothing drives while the deployment is up", "{:#}", over.0);
    assert!(over.of("deploy::port_undriven")[0]["help"].as_str().unwrap().contains("`feed`"), "{:#}", over.0);
    // Where it was not followed to the end, what is asked for counts.
    let cut = Said(small.demo.run(&["check", "small.yaml", "--budget", "20", "--json"]).json());
    assert_eq!(note(&cut), "`a.in`: an in-port that nothing drives", "{:#}", cut.0);
    // As an operator may apply it at any time, it may be in force.
    small.demo.replace("small.yaml", "coordinator:", "operator: [feed]\ncoordinator:");
    assert_eq!(note(&small.check()), "`a.in`: an in-port that nothing drives");
}

/// Of a component that only such configurations make which nobody asks for all count: it is as wrong, or as right, as it is written.
#[test]
fn what_nobody_makes_is_judged_as_written() {
    let spare = "spare = Configuration { create('c', 'Drive'), connect('c.out', 'c.in') },";
    let said = small(spare, "", "").check();
    assert_eq!(note(&said), "`a.in`, `b.in`: in-ports that nothing drives", "{:#}", said.0);
    // And so is the type that only such a one gives a component.
    let swap =
        "swap = Configuration { replace('a', 'Guard', { map = { out = 'alarms' } }), connect('b.out', 'a.seen') },";
    let said = small(swap, "", "").check();
    assert_eq!(note(&said), "`a.in`, `b.in`: in-ports that nothing drives", "{:#}", said.0);
}

/// What functions raise is not known.
#[test]
fn where_a_coordinator_has_functions_all_count() {
    let small = small(FEED, "", "trusted: true\n");
    small.demo.replace("coordinator.lua", "up = state {}", "up = state { entry = function(fsm) fsm.wired = true end }");
    assert_eq!(note(&small.check()), "`a.in`: an in-port that nothing drives");
}

/// Of coordinators that are followed apart it is what they ask for.
#[test]
fn of_several_coordinators_what_each_asks_for_counts() {
    let states = |base: &str| STATES.replace("base", base);
    let configurations = "one = Configuration { create('a', 'Drive'), port_write('a.in', 1.0) }, two = Configuration { create('b', 'Drive') },
        never = Configuration { port_write('b.in', 1.0) },";
    let said = Small::several(configurations, &[("first", &states("one")), ("second", &states("two"))], "").check();
    assert_eq!(note(&said), "`b.in`: an in-port that nothing drives while the deployment is up", "{:#}", said.0);
}

/// What a subsystem exports is its parent's to drive, by what the parent's own coordinator asks for.
#[test]
fn what_a_subsystem_exports_is_driven_by_its_parent() {
    let arm = small("", "", "exports: { ports: { in: a.in } }\n");
    needs(&arm);
    arm.demo.replace("conf.lua", "create('b', 'Drive')", "create('b', 'Drive'), port_write('b.in', 1.0)");
    assert!(required(&arm.check()).is_empty(), "alone it is its parent's");
    let demo: &Demo = &arm.demo;
    let drives = "drive = Configuration { port_write('arm.in', 1.0) },";
    demo.write("parent_conf.lua", &format!("ConfiguratorConf {{ {drives} }}"));
    let parent = |driving: &str, driven: &str| {
        format!(
            "return state {{ idle = state {{}}, raising = state {{ entry = 'arm/e_start' }}, driving = state {{ {driving} }}, up = state {{}},
               leaving = state {{ entry = 'arm/e_shutdown' }},
               trans {{ src = 'initial', tgt = 'idle' }},
               trans {{ src = 'idle', tgt = 'raising', events = {{ 'e_start' }} }},
               trans {{ src = 'raising', tgt = 'driving', events = {{ 'arm/up' }} }},
               trans {{ src = 'raising', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
               trans {{ src = 'driving', tgt = 'up', events = {{ {driven} }} }},
               trans {{ src = 'driving', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
               trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
               trans {{ src = 'leaving', tgt = 'idle', events = {{ 'arm/down' }} }} }}"
        )
    };
    demo.write(
        "parent.yaml",
        "davit: 1\nname: parent\nplatform: simulated\ntypes: {}\nsubsystems: { arm: { deployment: small.yaml } }\nconfigurations: [parent_conf.lua]
coordinator: parent.lua\ndeploy: { event: e_start, up: up, within_s: 5 }\nshutdown: { event: e_shutdown, down: idle, within_s: 5 }\n",
    );
    let check = |coordinator: &str| {
        demo.write("parent.lua", coordinator);
        Said(demo.run(&["check", "parent.yaml", "--json"]).json())
    };
    let asked = check(&parent("entry = 'drive'", "'drive.ok'"));
    assert!(required(&asked).is_empty(), "{:#}", asked.0);
    let never = check(&parent("", "'e_after(1)'"));
    let told = required(&never);
    assert_eq!(told.len(), 1, "{:#}", never.0);
    assert!(told[0].0.starts_with("nothing drives `arm/a.in` while the deployment is up"), "{told:?}");
}
