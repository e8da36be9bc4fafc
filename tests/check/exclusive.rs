//! What components hold for themselves: in one file, and between subsystems.

use super::composed::{found, one};
use davit::model::Finding;

type Change = (&'static str, &'static str, &'static str);

/// The drive of an arm has a bus for itself, which a parameter names.
const BUS: [Change; 4] = [
    ("arm.yaml", "  Drive:\n", "  Drive:\n    exclusive: [\"can:{bus}\"]\n"),
    (
        "arm.yaml",
        "k: { type: float, default: 1.0 } }\n    operations",
        "k: { type: float, default: 1.0 }, bus: { type: string, default: can0, tunable: unconfigured } }\n    operations",
    ),
    ("arm.yaml", "max: 2.0 } }", "max: 2.0 }, bus: { type: string, default: can0 } }"),
    ("arm_conf.lua", "property_set('D.k', gain),", "property_set('D.k', gain), property_set('D.bus', bus),"),
];
const OTHER_BUS: Change =
    ("pair.yaml", "right: { deployment: arm.yaml }", "right: { deployment: arm.yaml, parameters: { bus: can1 } }");

fn held(changes: &[Change]) -> Vec<String> {
    let of =
        |finding: Finding| (finding.code.0 == "compose::exclusive" && finding.is_error()).then_some(finding.message);
    found(changes).into_iter().filter_map(of).collect()
}

#[test]
fn two_subsystems_have_not_the_same_thing_at_once() {
    let says = one(&BUS, "compose::exclusive").0;
    assert!(says.contains("`can:can0`") && says.contains("`left`") && says.contains("`right`"), "{says}");
    let apart: Vec<Change> = BUS.into_iter().chain([OTHER_BUS]).collect();
    assert!(held(&apart).is_empty(), "{:#?}", found(&apart));
}

/// `right` is begun when `left` is down, and only then.
fn in_turns() -> Vec<Change> {
    let turns = [
        ("pair_conf.lua", "connect('left.pose', 'right.ref'), connect('right.pose', 'left.ref')", ""),
        (
            "pair.lua",
            "raising = state { entry = { 'left/e_start', 'right/e_start' } }, one = state {}, two = state {},",
            "raising = state { entry = 'left/e_start' }, one = state { entry = { 'left/e_shutdown', 'left/e_released' } },
             two = state { entry = 'right/e_start' },",
        ),
        ("pair.lua", "trans { src = 'raising', tgt = 'two', events = { 'right/up' } }", "trans { src = 'one', tgt = 'two', events = { 'left/down' } }"),
        ("pair.lua", "trans { src = 'one', tgt = 'coupling', events = { 'right/up' } },", ""),
        ("pair.lua", "src = 'two', tgt = 'coupling', events = { 'left/up' }", "src = 'two', tgt = 'coupling', events = { 'right/up' }"),
        ("pair.lua", "events = { 'e_shutdown', 'left/e_leaving', 'right/e_leaving',", "events = { 'e_shutdown', 'right/e_leaving',"),
    ];
    BUS.into_iter().chain(turns).collect()
}

#[test]
fn one_after_the_other_they_may() {
    let turns = in_turns();
    assert!(held(&turns).is_empty(), "{:#?}", held(&turns));
    // And without waiting for that they may not.
    let early: Vec<Change> = turns
        .iter()
        .map(|change| {
            if change.2.contains("'left/down'") {
                (change.0, change.1, "trans { src = 'one', tgt = 'two', events = { 'left/stranded' } }")
            } else {
                *change
            }
        })
        .collect();
    assert_eq!(held(&early).len(), 1);
}

#[test]
fn what_comes_up_unbidden_may_be_there_at_any_time() {
    let unbidden = [
        ("arm.yaml", "accepts: [e_released]", "accepts: [e_released, e_again]"),
        ("arm.lua", "tgt = 'making', events = { 'e_start' }", "tgt = 'making', events = { 'e_start', 'e_again' }"),
    ];
    let by_event: Vec<Change> = in_turns().into_iter().chain(unbidden).collect();
    assert_eq!(held(&by_event).len(), 1, "{:#?}", found(&by_event));
    let operated: Vec<Change> =
        in_turns().into_iter().chain([("arm.yaml", "accepts:", "operator: [run]\naccepts:")]).collect();
    assert_eq!(held(&operated).len(), 1, "{:#?}", found(&operated));
}

#[test]
fn that_one_is_down_may_have_been_told_before_it_was_begun_anew() {
    let anew = [
        (
            "pair.lua",
            "trans { src = 'one', tgt = 'two', events = { 'left/down' } }",
            "trans { src = 'one', tgt = 'anew', events = { 'left/stranded' } },
             trans { src = 'anew', tgt = 'two', events = { 'left/down' } }",
        ),
        (
            "pair.lua",
            "two = state { entry = 'right/e_start' },",
            "two = state { entry = 'right/e_start' }, anew = state { entry = 'left/e_start' },",
        ),
    ];
    let anew: Vec<Change> = in_turns().into_iter().chain(anew).collect();
    assert_eq!(held(&anew).len(), 1, "{:#?}", found(&anew));
}

#[test]
fn two_coordinators_that_begin_one_each_are_followed_together() {
    let lead = "return state { idle = state {}, on = state { entry = 'SIDE/e_start' }, off = state { entry = { 'SIDE/e_shutdown', 'SIDE/e_released' } },
  trans { src = 'initial', tgt = 'idle' }, trans { src = 'idle', tgt = 'on', events = { 'e_start' } },
  trans { src = 'on', tgt = 'off', events = { 'e_shutdown' } }, trans { src = 'off', tgt = 'idle', events = { 'SIDE/down' } } }";
    let (left, right) = (lead.replace("SIDE", "left"), lead.replace("SIDE", "right"));
    let (left, right): (&'static str, &'static str) = (left.leak(), right.leak());
    let sources = [
        ("pair.yaml", "coordinator: pair.lua", "coordinators: { lead: lead.lua, link: link.lua }"),
        ("pair.yaml", "up: coupled", "up: [lead:on, link:on]"),
        ("pair.yaml", "down: idle", "down: [lead:idle, link:idle]"),
        ("lead.lua", super::composed::LEAD, left),
        ("link.lua", super::composed::LINK, right),
    ];
    let both: Vec<Change> = BUS.into_iter().chain(sources).collect();
    assert_eq!(held(&both).len(), 1, "{:#?}", found(&both));
}

#[test]
fn a_parent_holds_nothing_that_a_subsystem_may_need() {
    let own = [
        ("pair.yaml", "types: {}", "types: { Sniffer: { exclusive: [\"can:can1\"] } }"),
        (
            "pair_conf.lua",
            "couple = Configuration { ",
            "couple = Configuration { create('S', 'Sniffer'), post_conf_state = { 'S:running' }, ",
        ),
        OTHER_BUS,
    ];
    let own: Vec<Change> = BUS.into_iter().chain(own).collect();
    let held = held(&own);
    assert!(held.len() == 1 && held[0].starts_with("`S` holds `can:can1`"), "{held:?}");
}

#[test]
fn an_operator_does_not_choose_what_is_held() {
    let operated: Vec<Change> =
        BUS.into_iter().chain([OTHER_BUS, ("arm.yaml", "accepts:", "operator: [D.bus, D.k]\naccepts:")]).collect();
    let says = one(&operated, "type::exclusive").0;
    assert!(says.starts_with("`D.bus` says which `can:{bus}` `D` has for itself"), "{says}");
}

#[test]
fn a_second_holder_is_refused_where_it_would_be_configured() {
    let second = |what: &'static str| {
        let run: &'static str = format!("run = Configuration {{ {what} }},").leak();
        let changes: Vec<Change> = BUS
            .into_iter()
            .chain([OTHER_BUS, ("arm_conf.lua", "run = Configuration { post_conf_state = { 'D:running' } },", run)])
            .collect();
        let of = |finding: Finding| (finding.code.0 == "conf::resource_held").then_some(finding.message);
        found(&changes).into_iter().filter_map(of).collect::<Vec<_>>()
    };
    let says =
        second("create('E', 'Drive', { properties = { bus = bus } }), post_conf_state = { 'E:stopped', 'D:running' }");
    assert!(says.iter().any(|says| says == "`E` needs `can:can0` for itself, and `D` holds it"), "{says:?}");
    for fine in [
        "create('E', 'Drive', { properties = { bus = bus } }), post_conf_state = { 'D:running' }",
        "create('E', 'Drive', { properties = { bus = 'can9' } }), post_conf_state = { 'E:running', 'D:running' }",
        "pre_conf_state = { 'D:unconfigured' }, create('E', 'Drive', { properties = { bus = bus } }), post_conf_state = { 'E:running' }",
    ] {
        assert_eq!(second(fine), Vec::<String>::new(), "{fine}");
    }
}
