//! A parent is followed against what its subsystems may tell, in the order in which they tell it.

use super::composed::{catalogue, files, found, load};
use davit::check::{self, CheckVerdict};
use davit::model::{Finding, Severity};

/// A parent of one arm.
pub const SOLO: &str = "davit: 1
name: solo
platform: simulated
types: {}
subsystems: { left: { deployment: arm.yaml } }
configurations: [solo_conf.lua]
coordinator: solo.lua
deploy: { event: e_start, up: on, within_s: 10 }
shutdown: { event: e_shutdown, down: idle, within_s: 10 }
";
pub const SOLO_CONF: &str = "ConfiguratorConf { stiff = Configuration { property_set('left.k', 2.0) } }";
/// It touches the arm where that wants to leave before it has said that it is built, which it never does.
pub const SOLO_COORDINATOR: &str = "return state {
  idle = state {}, raising = state { entry = 'left/e_start' }, built = state {}, on = state {},
  odd = state { entry = 'stiff' }, even = state { entry = 'stiff.undo' },
  lowering = state { entry = { 'left/e_shutdown', 'left/e_released' } },
  trans { src = 'initial', tgt = 'idle' },
  trans { src = 'idle', tgt = 'raising', events = { 'e_start' } },
  trans { src = 'raising', tgt = 'built', events = { 'left/e_built' } },
  trans { src = 'raising', tgt = 'odd', events = { 'left/e_leaving' } },
  trans { src = 'raising', tgt = 'lowering', events = { 'e_shutdown' } },
  trans { src = 'built', tgt = 'on', events = { 'left/up' } },
  trans { src = 'built', tgt = 'lowering', events = { 'e_shutdown', 'left/e_leaving' } },
  trans { src = 'on', tgt = 'lowering', events = { 'e_shutdown', 'left/e_leaving' } },
  trans { src = 'odd', tgt = 'even', events = { 'stiff.ok' } },
  trans { src = 'even', tgt = 'lowering', events = { 'stiff.undone' } },
  trans { src = 'lowering', tgt = 'idle', events = { 'left/down' } },
}";

pub fn solo(changes: &[(&str, &str, &str)]) -> Vec<Finding> {
    let loaded = load(&files(changes), "solo.yaml", &[]);
    let deployment = loaded.deployment.unwrap_or_else(|| panic!("{:#?}", loaded.findings));
    let catalogue = catalogue(&deployment);
    check::run(deployment, &catalogue).findings
}

fn with(findings: &[Finding], code: &str, severity: Severity) -> Vec<String> {
    let of = findings.iter().filter(|finding| finding.code.0 == code && finding.severity == severity);
    of.map(|finding| format!("{} {}", finding.message, finding.help.clone().unwrap_or_default())).collect()
}

#[test]
fn what_never_comes_in_that_order_refuses_nothing() {
    let touches = |changes: &[(&str, &str, &str)]| with(&solo(changes), "compose::promise", Severity::Error);
    assert!(touches(&[]).is_empty(), "{:?}", touches(&[]));
    // One that does say so first.
    let first = ("arm.lua", "making = state { entry = 'make' }", "making = state { entry = { 'e_leaving', 'make' } }");
    let says = touches(&[first]);
    assert!(says.len() == 1 && says[0].contains("`stiff` is asked for where"), "{says:?}");
}

#[test]
fn what_a_subsystem_told_where_nobody_waited_is_not_told_again() {
    let stuck = |changes: &[(&str, &str, &str)]| with(&found(changes), "coord::stuck", Severity::Warning);
    assert!(stuck(&[]).is_empty(), "{:?}", stuck(&[]));
    // `left/down` may come before `right/e_leaving`, while nobody waits for it.
    let missed = [
        (
            "pair.lua",
            "lowering = state { entry = { 'left/e_shutdown', 'right/e_shutdown', 'left/e_released', 'right/e_released' } },",
            "lowering = state { entry = { 'left/e_shutdown', 'left/e_released', 'right/e_shutdown' } }, freeing = state { entry = 'right/e_released' },",
        ),
        (
            "pair.lua",
            "trans { src = 'lowering', tgt = 'lone', events = { 'left/down' } },",
            "trans { src = 'lowering', tgt = 'freeing', events = { 'right/e_leaving' } },
  trans { src = 'freeing', tgt = 'lone', events = { 'left/down' } },",
        ),
        ("pair.lua", "trans { src = 'lowering', tgt = 'ltwo'", "trans { src = 'freeing', tgt = 'ltwo'"),
    ];
    let says = stuck(&missed);
    assert!(
        says.iter().any(|says| says.contains("`root.ltwo`") && says.contains("`left/down` may have been told before")),
        "{says:?}"
    );
}

#[test]
fn a_composition_that_waits_where_things_are_told_is_sound() {
    let loaded = load(&files(&[]), "pair.yaml", &[]);
    let deployment = loaded.deployment.unwrap_or_else(|| panic!("{:#?}", loaded.findings));
    let catalogue = catalogue(&deployment);
    let report = check::run(deployment, &catalogue);
    let warned = report.findings.iter().filter(|finding| finding.severity > Severity::Info).count();
    assert_eq!((warned, report.verdict), (0, CheckVerdict::Sound), "{:#?} {:#?}", report.findings, report.left);
}

#[test]
fn a_subsystem_that_nobody_begins_never_comes_up() {
    let nobody = ("pair.lua", "entry = { 'left/e_start', 'right/e_start' }", "entry = 'right/e_start'");
    let says = with(&found(&[nobody]), "deploy::never_up", Severity::Error);
    assert!(says.len() == 1 && says[0].contains("never reaches `coupled`"), "{says:?}");
}

#[test]
fn to_let_go_twice_is_to_let_go() {
    let twice = (
        "pair.lua",
        "'left/e_released', 'right/e_released' }",
        "'left/e_released', 'right/e_released', 'left/e_released' }",
    );
    let found = found(&[twice]);
    let warned: Vec<&Finding> = found.iter().filter(|finding| finding.severity > Severity::Info).collect();
    assert!(warned.is_empty(), "{warned:#?}");
}

/// Nobody leads it down again where its parent is down: its coordinator hears of no shutdown.
#[test]
fn a_subsystem_that_goes_on_by_itself_when_it_is_down_is_not_called_sound() {
    let begins = "trans { src = 'initial', tgt = 'idle' },";
    let goes_on = format!("{begins} trans {{ src = 'idle', tgt = 'undone', events = {{ 'e_after(0.1)' }} }},");
    let loaded = load(&files(&[("arm.lua", begins, &goes_on)]), "pair.yaml", &[]);
    let deployment = loaded.deployment.unwrap_or_else(|| panic!("{:#?}", loaded.findings));
    let catalogue = catalogue(&deployment);
    let report = check::run(deployment, &catalogue);
    let told = |left: &String| left.contains("goes on by itself though it is down");
    assert!(
        report.verdict != CheckVerdict::Sound && report.left.iter().any(told),
        "{:#?} {:#?}",
        report.findings,
        report.left
    );
    assert!(!report.explored.complete);
}

/// It is down where nobody has led its subsystem down, and the event that ends the deployment comes there: nothing does then.
#[test]
fn a_parent_that_is_down_while_its_subsystem_is_up_is_warned_of() {
    let waits = "  trans { src = 'on', tgt = 'lowering', events = { 'e_shutdown', 'left/e_leaving' } },";
    let judged = |more: &str| {
        let with = format!("{waits}\n{more}");
        let loaded = load(&files(&[("solo.lua", waits, &with)]), "solo.yaml", &[]);
        let deployment = loaded.deployment.unwrap_or_else(|| panic!("{:#?}", loaded.findings));
        let catalogue = catalogue(&deployment);
        let report = check::run(deployment, &catalogue);
        (with_code(&report.findings), report.verdict)
    };
    fn with_code(findings: &[Finding]) -> Vec<String> {
        with(findings, "coord::no_way_down", Severity::Warning)
    }
    assert_eq!(judged("").0, Vec::<String>::new());
    let (told, verdict) = judged("trans { src = 'on', tgt = 'idle', events = { 'e_drop' } },");
    assert_eq!(verdict, CheckVerdict::Warnings);
    assert!(told.len() == 1 && told[0].contains("left"), "{told:?}");
    // Led down by the same event, it comes down by itself.
    let led = "dropping = state { entry = { 'left/e_shutdown', 'left/e_released' } },
  trans { src = 'on', tgt = 'dropping', events = { 'e_drop' } }, trans { src = 'dropping', tgt = 'idle', events = { 'e_go' } },";
    let (told, _) = judged(led);
    assert!(!told.iter().any(|told| told.contains("`root.idle`")), "{told:?}");
}

/// A parent that does not wait until its subsystem is down is told that, and not that one of its states leads nowhere.
#[test]
fn a_parent_that_waits_for_no_down_is_told_which_to_wait_for() {
    let waits = "trans { src = 'lowering', tgt = 'idle', events = { 'left/down' } },";
    let goes = "trans { src = 'lowering', tgt = 'idle' },";
    let told = with(&solo(&[("solo.lua", waits, goes)]), "coord::no_way_down", Severity::Warning);
    assert!(
        told.len() == 1
            && told[0].starts_with("no transition waits for `left/down`: whether all is down in `idle` is not known")
            && told[0].ends_with("wait on the way to `idle` until each subsystem is down"),
        "{told:?}"
    );
}

/// What a subsystem tells only when something fails in it need not come, as that something fails need not.
#[test]
fn what_is_told_of_a_failure_only_is_no_way_down() {
    let leaves = "trans { src = 'on', tgt = 'leaving', events = { 'e_shutdown' } },";
    let down = "trans { src = 'on', tgt = 'lowering', events = { 'e_shutdown', 'left/e_leaving' } },";
    let waits = "trans { src = 'on', tgt = 'waiting', events = { 'e_shutdown' } }, waiting = state {},
        trans { src = 'on', tgt = 'lowering', events = { 'left/e_leaving' } },
        trans { src = 'waiting', tgt = 'lowering', events = { 'left/e_sick', 'left/e_leaving' } },";
    let told = |effect: &str| {
        let sick = format!("{leaves} {effect}");
        let emits = ("arm.yaml", "emits: [e_built, e_leaving]", "emits: [e_built, e_leaving, e_sick]");
        let changes = [emits, ("arm.lua", leaves, &*sick), ("solo.lua", down, waits)];
        with(&solo(&changes), "coord::no_way_down", Severity::Warning)
    };
    let failed = told("trans { src = 'on', tgt = 'leaving', events = { 'arm.faulted' }, effect = { 'e_sick' } },");
    assert!(failed.len() == 1 && failed[0].starts_with("from `root.waiting` only `left/e_sick`"), "{failed:?}");
    // By itself it comes.
    let by_itself = told("trans { src = 'on', tgt = 'leaving', events = { 'e_after(1)' }, effect = { 'e_sick' } },");
    assert_eq!(by_itself, Vec::<String>::new());
}

/// So many events raised in one step, and the subsystem may tell something before it takes the first of them.
fn told_before(events: usize) -> check::Report {
    let list = |of: &dyn Fn(usize) -> String| (1..=events).map(of).collect::<Vec<_>>().join(", ");
    let child = format!(
        "davit: 1\nname: child\nplatform: simulated\ntypes: {{ Drive: {{}} }}\nconfigurations: [child_conf.lua]\ncoordinator: child.lua
deploy: {{ event: e_start, up: on, within_s: 5 }}\nshutdown: {{ event: e_shutdown, down: idle, within_s: 5 }}
accepts: [{}]\nemits: [e_lost, e_all]\n",
        list(&|i| format!("e_{i}"))
    );
    let states: String = (1..=events).map(|i| format!("s{i} = state {{}}, ")).collect();
    let steps: String = (1..=events)
        .map(|i| {
            let (from, effect) = (if i == 1 { "on".to_owned() } else { format!("s{}", i - 1) }, if i == events { "e_all" } else { "" });
            let effect = if effect.is_empty() { String::new() } else { format!(", effect = '{effect}'") };
            format!("trans {{ src = '{from}', tgt = 's{i}', events = {{ 'e_{i}' }}{effect} }}, trans {{ src = 's{i}', tgt = 'off', events = {{ 'e_shutdown' }} }},")
        })
        .collect();
    let child_chart = format!(
        "return state {{ idle = state {{}}, making = state {{ entry = 'make' }}, on = state {{}}, lost = state {{}}, off = state {{ entry = 'make.undo' }}, {states}
  trans {{ src = 'initial', tgt = 'idle' }}, trans {{ src = 'idle', tgt = 'making', events = {{ 'e_start' }} }},
  trans {{ src = 'making', tgt = 'on', events = {{ 'make.ok' }} }}, trans {{ src = 'making', tgt = 'off', events = {{ 'e_shutdown', 'make.failed', 'make.broken' }} }},
  trans {{ src = 'on', tgt = 'lost', events = {{ 'D.faulted' }}, effect = 'e_lost' }}, {steps}
  trans {{ src = 'on', tgt = 'off', events = {{ 'e_shutdown' }} }}, trans {{ src = 'lost', tgt = 'off', events = {{ 'e_shutdown' }} }},
  trans {{ src = 'off', tgt = 'idle', events = {{ 'make.undone', 'make.undo.failed', 'make.undo.broken' }} }} }}"
    );
    let parent = "davit: 1\nname: parent\nplatform: simulated\ntypes: { Gain: {} }\nsubsystems: { a: { deployment: child.yaml } }
configurations: [parent_conf.lua]\ncoordinator: parent.lua
deploy: { event: e_start, up: on, within_s: 10 }\nshutdown: { event: e_shutdown, down: idle, within_s: 10 }\n";
    let raised = list(&|i| format!("'a/e_{i}'"));
    let chart = format!(
        "return state {{ idle = state {{}}, raising = state {{}}, making = state {{ entry = 'own' }}, on = state {{}}, busy = state {{}},
  trap = state {{ entry = 'again' }}, bad = state {{}}, off = state {{ entry = 'own.undo' }}, low = state {{ entry = 'a/e_shutdown' }},
  trans {{ src = 'initial', tgt = 'idle' }}, trans {{ src = 'idle', tgt = 'raising', events = {{ 'e_start' }}, effect = 'a/e_start' }},
  trans {{ src = 'raising', tgt = 'making', events = {{ 'a/up' }} }}, trans {{ src = 'raising', tgt = 'low', events = {{ 'a/failed', 'e_shutdown' }} }},
  trans {{ src = 'making', tgt = 'on', events = {{ 'own.ok' }} }}, trans {{ src = 'making', tgt = 'off', events = {{ 'own.failed', 'own.broken', 'e_shutdown' }} }},
  trans {{ src = 'on', tgt = 'busy', events = {{ 'e_go' }}, effect = {{ {raised} }} }}, trans {{ src = 'busy', tgt = 'bad', events = {{ 'a/e_all' }} }},
  trans {{ src = 'busy', tgt = 'trap', events = {{ 'a/e_lost' }} }}, trans {{ src = 'trap', tgt = 'bad', events = {{ 'again.ok', 'again.failed', 'again.broken' }} }},
  trans {{ src = 'on', tgt = 'off', events = {{ 'e_shutdown' }} }}, trans {{ src = 'busy', tgt = 'off', events = {{ 'e_shutdown' }} }},
  trans {{ src = 'trap', tgt = 'off', events = {{ 'e_shutdown' }} }}, trans {{ src = 'bad', tgt = 'off', events = {{ 'e_shutdown' }} }},
  trans {{ src = 'off', tgt = 'low', events = {{ 'own.undone', 'own.undo.failed', 'own.undo.broken' }} }},
  trans {{ src = 'low', tgt = 'idle', events = {{ 'a/down', 'a/e_shutdown.ignored' }} }} }}"
    );
    let made = "Configuration { create('G', 'Gain') }";
    let files = [
        ("child.yaml", child),
        (
            "child_conf.lua",
            "ConfiguratorConf { make = Configuration { create('D', 'Drive'), post_conf_state = { 'D:running' } } }"
                .to_owned(),
        ),
        ("child.lua", child_chart),
        ("parent.yaml", parent.to_owned()),
        ("parent_conf.lua", format!("ConfiguratorConf {{ own = {made}, again = {made} }}")),
        ("parent.lua", chart),
    ];
    let loaded = load(&davit::lang::Sources::memory(files), "parent.yaml", &[]);
    let deployment = loaded.deployment.unwrap_or_else(|| panic!("{:#?}", loaded.findings));
    let catalogue = catalogue(&deployment);
    check::run(deployment, &catalogue)
}

/// What a parent raises lies in a subsystem's inbox, up to three events: where it raises more, it is said that this was not followed.
#[test]
fn more_than_is_followed_untaken_is_told() {
    for events in [2, 3] {
        let refused = told_before(events).findings;
        assert!(refused.iter().any(|finding| finding.code.0 == "coord::request_refused"), "{events}: {refused:#?}");
    }
    for events in [4, 6] {
        let report = told_before(events);
        let said = report.left.iter().any(|left| left.contains("more than 3 events that a subsystem has not taken"));
        assert!(said && !report.explored.complete, "{events}: {:?} {:?}", report.verdict, report.left);
    }
}

/// A safety event may have led a subsystem elsewhere on its way down: where its parent then only waits for it, nothing leads down.
#[test]
fn who_waits_for_one_that_was_led_elsewhere_waits_in_vain() {
    let child = "davit: 1
name: child
platform: simulated
types: { Motor: { actuator: true, moves: [start], ports: { speed: { direction: in, type: float } } } }
configurations: [child_conf.lua]
coordinator: child.lua
deploy: { event: e_start, up: on, failed: [failed], within_s: 5 }
shutdown: { event: e_end, down: idle, within_s: 5, rest: [halt] }
emits: [e_note]
safety: [e_stop]
";
    let conf = "ConfiguratorConf { make = Configuration { create('M', 'Motor'), post_conf_state = { 'M:running' } },
  halt = Configuration { safe = true, port_write('M.speed', 0.0) } }";
    // `by_itself`: what it holds it lets go of after a second.
    let chart = |by_itself: &str| {
        format!(
            "return state {{ idle = state {{}}, making = state {{ entry = 'make' }}, on = state {{}}, failed = state {{}}, held = state {{ config = 'halt' }},
  off = state {{ entry = 'make.undo' }}, left = state {{}},
  trans {{ src = 'initial', tgt = 'idle' }}, trans {{ src = 'idle', tgt = 'making', events = {{ 'e_start' }} }},
  trans {{ src = 'making', tgt = 'on', events = {{ 'make.ok' }} }}, trans {{ src = 'making', tgt = 'failed', events = {{ 'make.failed', 'make.broken' }} }},
  trans {{ src = 'making', tgt = 'held', events = {{ 'e_stop' }} }}, trans {{ src = 'on', tgt = 'held', events = {{ 'e_stop' }} }},
  trans {{ src = 'off', tgt = 'held', events = {{ 'e_stop' }} }}, trans {{ src = 'failed', tgt = 'held', events = {{ 'e_stop' }} }},
  trans {{ src = 'left', tgt = 'held', events = {{ 'e_stop' }} }}, trans {{ src = 'held', tgt = 'held', events = {{ 'e_stop' }} }},
  trans {{ src = 'making', tgt = 'off', events = {{ 'e_end' }} }}, trans {{ src = 'on', tgt = 'off', events = {{ 'e_end' }} }},
  trans {{ src = 'held', tgt = 'off', events = {{ 'e_end' {by_itself} }} }}, trans {{ src = 'left', tgt = 'off', events = {{ 'e_end' }} }},
  trans {{ src = 'failed', tgt = 'off', events = {{ 'e_end' }} }}, trans {{ src = 'off', tgt = 'off', events = {{ 'e_end' }} }},
  trans {{ src = 'off', tgt = 'idle', events = {{ 'make.undone' }} }}, trans {{ src = 'off', tgt = 'left', events = {{ 'make.undo.failed', 'make.undo.broken' }} }} }}"
        )
    };
    let parent = "davit: 1
name: parent
platform: simulated
types: {}
subsystems: { s: { deployment: child.yaml } }
configurations: []
coordinator: parent.lua
deploy: { event: e_start, up: on, failed: [failed], within_s: 9 }
shutdown: { event: e_end, down: idle, within_s: 9 }
safety: [e_stop]
";
    let lead = |more: &str| {
        format!(
            "return state {{ idle = state {{}}, raising = state {{}}, on = state {{}}, failed = state {{}}, lowering = state {{}}, {more}
  trans {{ src = 'initial', tgt = 'idle' }}, trans {{ src = 'idle', tgt = 'raising', events = {{ 'e_start' }}, effect = 's/e_start' }},
  trans {{ src = 'raising', tgt = 'on', events = {{ 's/up' }} }}, trans {{ src = 'raising', tgt = 'failed', events = {{ 's/failed' }} }},
  trans {{ src = 'raising', tgt = 'lowering', events = {{ 'e_end' }}, effect = 's/e_end' }}, trans {{ src = 'on', tgt = 'lowering', events = {{ 'e_end' }}, effect = 's/e_end' }},
  trans {{ src = 'failed', tgt = 'lowering', events = {{ 'e_end' }}, effect = 's/e_end' }}, trans {{ src = 'lowering', tgt = 'idle', events = {{ 's/down' }} }} }}"
        )
    };
    let in_vain = |by_itself: &str, more: &str| {
        let files = [
            ("child.yaml", child.to_owned()),
            ("child_conf.lua", conf.to_owned()),
            ("child.lua", chart(by_itself)),
            ("parent.yaml", parent.to_owned()),
            ("parent.lua", lead(more)),
        ];
        let loaded = load(&davit::lang::Sources::memory(files), "parent.yaml", &[]);
        let deployment = loaded.deployment.unwrap_or_else(|| panic!("{:#?}", loaded.findings));
        let catalogue = catalogue(&deployment);
        let found = check::run(deployment, &catalogue).findings;
        assert!(!found.iter().any(Finding::is_error), "{found:#?}");
        let says = with(&found, "coord::no_way_down", Severity::Warning);
        says.into_iter().filter(|says| says.contains("tells nothing more by itself")).collect::<Vec<_>>()
    };
    let says = in_vain("", "");
    assert!(says.len() == 1 && says[0].contains("root.lowering") && says[0].contains("`s/e_end`"), "{says:?}");
    assert_eq!(
        in_vain("", "trans { src = 'lowering', tgt = 'lowering', events = { 'e_end' }, effect = 's/e_end' },"),
        [""; 0]
    );
    assert_eq!(
        in_vain("", "trans { src = 'lowering', tgt = 'lowering', events = { 'e_after(1)' }, effect = 's/e_end' },"),
        [""; 0]
    );
    assert_eq!(in_vain(", 'e_after(1)'", ""), [""; 0]);
    // It may still tell something, which is heard elsewhere.
    let notes = "} }, trans { src = 'held', tgt = 'held', effect = 'e_note', events = { 'e_reset'";
    let says = in_vain(notes, "trans { src = 'on', tgt = 'on', events = { 's/e_note' } },");
    assert!(says.len() == 1 && says[0].contains("root.lowering"), "{says:?}");
    let ends = "trans { src = 'lowering', tgt = 'lowering', events = { 's/e_note' }, effect = 's/e_end' },";
    assert_eq!(in_vain(notes, ends), [""; 0]);
}
