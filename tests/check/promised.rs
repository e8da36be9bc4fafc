//! What a subsystem exports, and who is held to it: made anew, passed on, let go, by one coordinator or by several.

use super::composed::{catalogue, files, found, load, one};
use davit::check::{self, CheckVerdict};
use davit::model::{Finding, Severity};

type Change = (&'static str, &'static str, &'static str);

/// In the pair `left` is an arm that is passed on.
const PASSED_ON: Change =
    ("pair.yaml", "left: { deployment: arm.yaml, parameters: { gain: 0.7 } }", "left: { deployment: mid.yaml }");

fn of(changes: &[Change], code: &str, severity: Severity) -> Vec<String> {
    let is = |finding: &Finding| finding.code.0 == code && finding.severity == severity;
    found(changes).into_iter().filter(is).map(|finding| finding.message).collect()
}

#[test]
fn what_is_wrong_with_the_parameters_of_one_instance_only_is_told() {
    let again = [
        ("arm.yaml", "accepts: [e_released]", "accepts: [e_released, e_again]"),
        (
            "arm.lua",
            "on = state {},",
            "on = state {}, again = state { entry = gain < 0.6 and 'make.undo' or { 'run.undo', 'make.undo' } },",
        ),
        (
            "arm.lua",
            "  trans { src = 'on', tgt = 'leaving'",
            "  trans { src = 'on', tgt = 'again', events = { 'e_again' } },
  trans { src = 'again', tgt = gain < 0.6 and 'on' or 'undone',
    events = gain < 0.6 and { 'make.undo.failed' } or { 'make.undone', 'make.undo.failed', 'make.undo.broken' } },
  trans { src = 'again', tgt = 'leaving', events = { 'e_shutdown' } },
  trans { src = 'on', tgt = 'leaving'",
        ),
    ];
    let both = of(&again, "coord::request_refused", Severity::Error);
    assert!(both.iter().any(|says| says.contains("`make.undo`")), "{both:?} {:#?}", found(&again));
    let known = of(&again, "coord::request_refused", Severity::Info);
    assert!(
        known.iter().any(|says| both.contains(says)),
        "the words are those of a note of `left`: {known:?} {both:?}"
    );
}

#[test]
fn an_in_port_that_is_passed_on_is_driven_by_the_parent_alone() {
    assert!(of(&[PASSED_ON], "compose::export_driven", Severity::Error).is_empty());
    let driven = (
        "mid_conf.lua",
        "ConfiguratorConf {}",
        "ConfiguratorConf { push = Configuration { port_write('inner.ref', 1.0) } }",
    );
    let says = one(&[PASSED_ON, driven], "compose::export_driven").0;
    assert!(says.contains("is exported as `ref`"), "{says}");
}

#[test]
fn what_is_exported_is_not_made_anew_while_it_is_promised() {
    for remake in ["destroy('D'), create('D', 'Drive'), post_conf_state = { 'D:running' }", "replace('D', 'Other')"] {
        let remade = format!(
            "run = Configuration {{ post_conf_state = {{ 'D:running' }} }}, remake = Configuration {{ {remake} }},"
        );
        let remade = [
            ("arm.yaml", "  Drive:\n", "  Other: { properties: { k: { type: float, default: 1.0 } } }\n  Drive:\n"),
            ("arm.yaml", "accepts: [e_released]", "accepts: [e_released, e_again]"),
            ("arm_conf.lua", "run = Configuration { post_conf_state = { 'D:running' } },", remade.as_str()),
            ("arm.lua", "on = state {},", "on = state {}, again = state { entry = 'remake' },"),
            (
                "arm.lua",
                "  trans { src = 'on', tgt = 'leaving'",
                "  trans { src = 'on', tgt = 'again', events = { 'e_again' } },
  trans { src = 'again', tgt = 'on', events = { 'remake.ok', 'remake.failed' } },
  trans { src = 'again', tgt = 'leaving', events = { 'e_shutdown' } },
  trans { src = 'on', tgt = 'leaving'",
            ),
        ];
        let found = found(&remade);
        let told =
            found.iter().find(|finding| finding.code.0 == "compose::unleft" && finding.message.starts_with("`remake`"));
        let told = told.unwrap_or_else(|| panic!("{remake}: {found:#?}"));
        assert!(told.is_error() && told.message.contains("between `e_built` and `e_released`"), "{told:?}");
    }
}

#[test]
fn what_is_passed_on_is_promised_as_long_as_the_subsystem_promises_it() {
    let unleft = |changes: &[Change]| of(changes, "compose::unleft", Severity::Error);
    assert!(unleft(&[PASSED_ON]).is_empty(), "{:#?}", found(&[PASSED_ON]));
    assert!(found(&[PASSED_ON]).iter().all(|finding| !finding.is_error()), "{:#?}", found(&[PASSED_ON]));
    let early = ("mid.lua", "events = { 'inner/up' }", "events = { 'e_after(0.1)' }");
    let late = ("mid.lua", "tgt = 'leaving', events = { 'e_shutdown'", "tgt = 'lowering', events = { 'e_shutdown'");
    for wrong in [early, late] {
        let says = unleft(&[PASSED_ON, wrong]);
        let [says] = &says[..] else { panic!("{wrong:?}: {says:?}") };
        assert!(
            says.starts_with("what is exported of `inner` need not be there between `up` and `e_released`"),
            "{says}"
        );
    }
}

#[test]
fn what_a_subsystem_told_before_it_was_let_go_promises_nothing_anew() {
    let stale = [
        ("pair.lua", "lone = state {},", "lone = state {}, again = state { entry = 'stiff' },"),
        (
            "pair.lua",
            "  trans { src = 'lowering', tgt = 'lone'",
            "  trans { src = 'lowering', tgt = 'again', events = { 'left/up' } },
  trans { src = 'again', tgt = 'parting', events = { 'stiff.ok' } },
  trans { src = 'lowering', tgt = 'lone'",
        ),
    ];
    let says = of(&stale, "compose::promise", Severity::Error);
    assert!(
        says.iter().any(|says| says == "`stiff` is asked for where what `left` exports need not be there"),
        "{says:?}"
    );
}

#[test]
fn who_begins_a_subsystem_and_who_touches_it_are_followed_together() {
    let two = [
        ("pair.yaml", "coordinator: pair.lua", "coordinators: { lead: lead.lua, link: link.lua }"),
        ("pair.yaml", "up: coupled", "up: ['lead:on', 'link:joined']"),
    ];
    let says = of(&two, "compose::promise", Severity::Error);
    assert!(says.iter().any(|says| says.starts_with("`stiff` is ") && says.contains("`left`")), "{says:?}");
}

#[test]
fn who_promises_an_export_and_who_makes_it_are_followed_together() {
    let two = [
        ("arm.yaml", "coordinator: arm.lua", "coordinators: { body: arm.lua, voice: voice.lua }"),
        ("arm.yaml", "up: on", "up: ['body:on', 'voice:loud']"),
        ("arm.yaml", "down: idle", "down: ['body:idle', 'voice:quiet']"),
        ("arm.lua", "entry = { 'e_built', 'run' }", "entry = 'run'"),
    ];
    let says = of(&two, "compose::unleft", Severity::Error);
    assert!(
        says.iter().any(|says| says.starts_with("`D`, which is exported, is not there")),
        "{says:?} {:#?}",
        found(&two)
    );
}

#[test]
fn a_subsystem_that_waits_to_be_let_go_is_let_go_by_somebody() {
    let never = [("pair.lua", "'left/e_released', 'right/e_released'", "'right/e_released'")];
    let says = of(&never, "compose::unleft", Severity::Warning);
    let expected = "`left/e_shutdown` is raised and `left/e_released` never: `left` waits for that before it goes down";
    assert_eq!(says, [expected]);
    assert!(of(&[], "compose::unleft", Severity::Warning).is_empty());
}

#[test]
fn what_a_safe_configuration_interrupts_in_a_subsystem_is_not_said_to_be_followed() {
    let bounds = |changes: &[Change]| {
        let deployment = load(&files(changes), "pair.yaml", &[]).deployment.unwrap();
        let types = catalogue(&deployment);
        let report = check::run(deployment, &types);
        assert!(report.verdict != CheckVerdict::Sound || report.left.is_empty());
        report.left.iter().filter(|bound| bound.contains("safe configuration")).count()
    };
    assert_eq!(bounds(&[]), 0);
    assert_eq!(bounds(&[("pair_conf.lua", "stiff = Configuration {", "stiff = Configuration { safe = true, ")]), 1);
}

#[test]
fn to_let_go_with_the_end_is_too_early_where_the_subsystem_waits_later() {
    let stops_first = ("arm.lua", "trans { src = 'on', tgt = 'leaving'", "trans { src = 'on', tgt = 'halting'");
    let halts = (
        "arm.lua",
        "unmaking = state { entry = 'make.undo' },",
        "unmaking = state { entry = 'make.undo' }, halting = state { entry = 'run.undo' }, 
  trans { src = 'halting', tgt = 'leaving', events = { 'run.undone', 'run.undo.failed', 'run.undo.broken' } },",
    );
    let early = |changes: &[Change]| of(changes, "compose::unleft", Severity::Warning);
    assert!(early(&[]).is_empty(), "it waits at once: {:?}", early(&[]));
    let says = early(&[stops_first, halts]);
    assert!(says.len() == 2 && says[0].contains("does not wait for it at once after `e_shutdown`"), "{says:?}");
}

#[test]
fn to_let_go_what_has_not_asked_for_it_is_too_early() {
    let early = |changes: &[Change]| of(changes, "compose::unleft", Severity::Warning);
    let unasked = ("pair.lua", "coupled = state {},", "coupled = state { entry = 'left/e_released' },");
    let says = early(&[unasked]);
    assert!(
        says.len() == 1
            && says[0].contains("`left/e_released` is raised where `left` does not wait for it, and is lost"),
        "{says:?}"
    );
    // Nor before the event that ends it, in the same step.
    let (before, after) = (
        "'left/e_shutdown', 'right/e_shutdown', 'left/e_released', 'right/e_released'",
        "'left/e_released', 'left/e_shutdown', 'right/e_shutdown', 'right/e_released'",
    );
    assert_eq!(early(&[("pair.lua", before, after)]).len(), 1);
    // When it was heard that it wants to leave it is not.
    let asked = [
        (
            "pair.lua",
            "lone = state {},",
            "lone = state {}, asked = state { entry = { 'left/e_released', 'couple.undo' } },",
        ),
        (
            "pair.lua",
            "events = { 'e_shutdown', 'left/e_leaving', 'right/e_leaving', 'couple.failed', 'couple.broken' } },",
            "events = { 'e_shutdown', 'right/e_leaving', 'couple.failed', 'couple.broken' } },
  trans { src = 'alive', tgt = 'asked', events = { 'left/e_leaving' } },
  trans { src = 'asked', tgt = 'lowering', events = { 'couple.undone', 'couple.undo.failed', 'couple.undo.broken' } },",
        ),
    ];
    assert!(early(&asked).is_empty(), "{:?}", early(&asked));
}
