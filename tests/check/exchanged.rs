//! Groups of coordinators that are the same but for names: one of them is followed, and what is said of all is what is said where each is followed.

use crate::apart_random::{Has, Made, made, told};
use crate::aside::Chance;
use crate::composed::{catalogue, load};
use crate::support::Small;
use davit::check::{Effort, Report, run_with};
use davit::model::{Code, Severity, codes};
use std::collections::BTreeSet;

/// What is done to the second one, which is the first one by other names.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Changed {
    Nothing,
    /// A transition is left out.
    Less(usize),
    /// Something of what it asks for is worth something else.
    Other,
    /// What it does where a request has failed it does where that is broken, and the other way round.
    Verdicts,
}

fn copies(seed: u64, changed: Changed) -> [Made; 3] {
    let of = |name: &str| {
        let mut chance = Chance(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1357_9bdf);
        let has = Has { stop: false, more: chance.percent(70), tells: false, shared: chance.percent(30) };
        made(&mut chance, name, has)
    };
    let mut all = ["a", "b", "c"].map(of);
    match changed {
        Changed::Nothing => {}
        Changed::Less(at) => {
            let kept = |coordinator: &str| -> Vec<String> { coordinator.lines().map(str::to_owned).collect() };
            let mut lines = kept(&all[1].coordinator);
            let arrows: Vec<usize> = (0..lines.len()).filter(|i| lines[*i].starts_with("trans {")).collect();
            lines.remove(arrows[at % arrows.len()]);
            all[1].coordinator = lines.join("\n");
        }
        Changed::Other => {
            let conf = &mut all[1].configurations;
            *conf = conf.replace("b_base = Configuration { ", "b_base = Configuration { port_write('b.in', 7.0), ");
        }
        Changed::Verdicts => {
            let chart = &mut all[1].coordinator;
            *chart = chart.replace(".failed'", ".?'").replace(".broken'", ".failed'").replace(".?'", ".broken'");
        }
    }
    all
}

/// The report; `apart`: what says so is called otherwise in the second and third, so that nothing is taken for the same.
fn report(all: &[Made; 3], apart: bool) -> Option<Report> {
    let charts: Vec<String> = (0..)
        .zip(all)
        .map(|(i, of)| match apart {
            true => of.coordinator.replace("leaving", &format!("leaving{i}")),
            false => of.coordinator.clone(),
        })
        .collect();
    let configurations: String = all.iter().map(|of| of.configurations.as_str()).collect();
    let coordinators = [("a", charts[0].as_str()), ("b", &charts[1]), ("c", &charts[2])];
    let read = Small::several(&configurations, &coordinators, "").read();
    let effort = Effort { transitions: 3_000, ..Effort::default() };
    let report = run_with(read.deployment, &read.catalogue, effort);
    (!report.left.iter().any(|left| left.contains("as many as are looked at"))).then_some(report)
}

fn said(report: &Report) -> BTreeSet<(Code, String)> {
    let plain = |text: String| (0..3).fold(text, |text, i| text.replace(&format!("leaving{i}"), "leaving"));
    told(report).into_iter().map(|(code, text)| (code, plain(text))).collect()
}

/// `DAVIT_EXCHANGED_CASES=10000` is the long run.
#[test]
fn what_is_the_same_but_for_names_is_judged_as_where_each_is_followed() {
    let cases = std::env::var("DAVIT_EXCHANGED_CASES").map_or(60, |n| n.parse().expect("a number"));
    let (mut compared, mut fewer, mut found) = (0u64, [0u64; 4], 0u64);
    for seed in 0.. {
        if compared >= cases {
            break;
        }
        let less = Changed::Less(usize::try_from(seed).unwrap());
        for (kind, changed) in (0..).zip([Changed::Nothing, less, Changed::Other, Changed::Verdicts]) {
            let all = copies(seed, changed);
            let (Some(once), Some(each)) = (report(&all, false), report(&all, true)) else { continue };
            compared += 1;
            assert_eq!(said(&once), said(&each), "{seed} {changed:?}");
            assert_eq!((&once.verdict, &once.left), (&each.verdict, &each.left), "{seed} {changed:?}");
            assert!(once.explored.states <= each.explored.states, "{seed} {changed:?}");
            fewer[kind] += u64::from(once.explored.states < each.explored.states);
            found += u64::from(!said(&each).is_empty());
        }
    }
    // Where the second one is another one, the third is still like the first. Mostly something is found on them, and each is followed.
    assert!(fewer.iter().all(|n| *n > 0) && found > cases / 20, "{fewer:?} {found} of {compared}");
}

/// Of three that are the same, with and without faults in them, states are counted once, and what is wrong is said of each.
#[test]
fn it_is_followed_once_and_told_of_each() {
    let (mut clean, mut wrong) = (0, 0);
    for seed in 0..120 {
        let all = copies(seed, Changed::Nothing);
        let (Some(three), Some(each)) = (report(&all, false), report(&all, true)) else { continue };
        match three.explored.states == each.explored.states {
            true => wrong += 1,
            false => {
                assert_eq!(each.explored.states, 3 * three.explored.states, "{seed}");
                clean += 1;
            }
        }
        assert_eq!(said(&three), said(&each), "{seed}");
    }
    assert!(clean > 3 && wrong > 3, "{clean} {wrong}");
}

const LEAF: &str = "davit: 1
name: leaf
platform: simulated
types: { Drive: { exclusive: ['can:{ifname}'], properties: { ifname: { type: string, tunable: unconfigured } } } }
parameters: { ifname: { type: string } }
accepts: [e_ask, e_low]
emits: [e_asked]
configurations: [leaf_conf.lua]
coordinator: leaf.lua
deploy: { event: e_start, up: on, within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";
const LEAF_CONF: &str =
    "ConfiguratorConf { make = Configuration { create('Drive', 'Drive', { properties = { ifname = ifname } }),
  post_conf_state = { 'Drive:running' } } }";
const LEAF_COORDINATOR: &str = "return state {
  idle = state {}, making = state { entry = 'make' }, on = state {}, asked = state { entry = 'e_asked' }, bad = state {}, removing = state { entry = 'make.undo' },
  trans { src = 'initial', tgt = 'idle' }, trans { src = 'idle', tgt = 'making', events = { 'e_start' } },
  trans { src = 'making', tgt = 'on', events = { 'make.ok' } }, trans { src = 'making', tgt = 'bad', events = { 'make.failed', 'make.broken' } },
  trans { src = 'making', tgt = 'removing', events = { 'e_shutdown' } }, trans { src = 'on', tgt = 'removing', events = { 'e_shutdown' } },
  trans { src = 'bad', tgt = 'removing', events = { 'e_shutdown' } }, trans { src = 'on', tgt = 'asked', events = { 'e_ask' } },
  trans { src = 'asked', tgt = 'on', events = { 'e_low' } }, trans { src = 'asked', tgt = 'removing', events = { 'e_shutdown' } },
  trans { src = 'removing', tgt = 'idle', events = { 'make.undone' } },
  trans { src = 'removing', tgt = 'bad', events = { 'make.undo.failed', 'make.undo.broken' } } }";
const PARENT: &str = "davit: 1
name: parent
platform: simulated
types: { Gate: { exclusive: ['can:{bus}'], properties: { bus: { type: string, tunable: unconfigured } } } }
subsystems:
  left:  { deployment: leaf.yaml, parameters: { ifname: can0 } }
  right: { deployment: leaf.yaml, parameters: { ifname: can1 } }
configurations: [parent_conf.lua]
coordinators: { a: a.lua, b: b.lua }
deploy: { event: e_start, up: on, within_s: 10 }
shutdown: { event: e_shutdown, down: idle, within_s: 10 }
";

/// Two that lead a leaf each, and make a gate on a bus; how the second one is another one, how many states were followed, and what was found.
fn found_on_two(buses: [&str; 2], second: &[(&str, &str)]) -> (usize, Vec<Code>) {
    let lead = |who: &str, own: &str| {
        format!(
            "return state {{ idle = state {{}}, raising = state {{ entry = '{who}/e_start' }}, on = state {{}}, asking = state {{ entry = '{who}/e_ask' }},
  low = state {{ entry = '{who}/e_low' }}, making = state {{ entry = '{own}' }}, made = state {{}}, failed = state {{}}, removing = state {{ entry = '{own}.undo' }},
  lowering = state {{ entry = '{who}/e_shutdown' }},
  trans {{ src = 'initial', tgt = 'idle' }}, trans {{ src = 'idle', tgt = 'raising', events = {{ 'e_start' }} }},
  trans {{ src = 'raising', tgt = 'on', events = {{ '{who}/up' }} }}, trans {{ src = 'raising', tgt = 'lowering', events = {{ 'e_shutdown', '{who}/failed' }} }},
  trans {{ src = 'on', tgt = 'asking', events = {{ 'e_go' }} }}, trans {{ src = 'asking', tgt = 'low', events = {{ '{who}/e_asked' }} }},
  trans {{ src = 'asking', tgt = 'lowering', events = {{ 'e_shutdown' }} }},
  trans {{ src = 'low', tgt = 'making', events = {{ 'e_after(0.1)' }} }}, trans {{ src = 'low', tgt = 'lowering', events = {{ 'e_shutdown' }} }},
  trans {{ src = 'making', tgt = 'made', events = {{ '{own}.ok' }} }}, trans {{ src = 'making', tgt = 'failed', events = {{ '{own}.failed', '{own}.broken' }} }},
  trans {{ src = 'making', tgt = 'removing', events = {{ 'e_shutdown' }} }}, trans {{ src = 'made', tgt = 'removing', events = {{ 'e_shutdown' }} }},
  trans {{ src = 'failed', tgt = 'removing', events = {{ 'e_shutdown' }} }}, trans {{ src = 'on', tgt = 'lowering', events = {{ 'e_shutdown' }} }},
  trans {{ src = 'removing', tgt = 'lowering', events = {{ '{own}.undone' }} }},
  trans {{ src = 'removing', tgt = 'failed', events = {{ '{own}.undo.failed', '{own}.undo.broken' }} }},
  trans {{ src = 'lowering', tgt = 'lowering', events = {{ 'e_shutdown' }} }},
  trans {{ src = 'lowering', tgt = 'idle', events = {{ '{who}/down', '{who}/e_shutdown.ignored' }} }} }}"
        )
    };
    let mut b = lead("right", "own_right");
    for (from, to) in second {
        assert!(b.contains(from), "{from}");
        b = b.replace(from, to);
    }
    let gate = |name: &str, bus: &str| {
        format!(
            "Configuration {{ create('{name}', 'Gate', {{ properties = {{ bus = '{bus}' }} }}), post_conf_state = {{ '{name}:running' }} }}"
        )
    };
    let conf =
        format!("ConfiguratorConf {{ own_left = {}, own_right = {} }}", gate("L", buses[0]), gate("R", buses[1]));
    let files = [
        ("leaf.yaml", LEAF.to_owned()),
        ("leaf_conf.lua", LEAF_CONF.to_owned()),
        ("leaf.lua", LEAF_COORDINATOR.to_owned()),
        ("parent.yaml", PARENT.to_owned()),
        ("parent_conf.lua", conf),
        ("a.lua", lead("left", "own_left")),
        ("b.lua", b),
    ];
    let loaded = load(&davit::lang::Sources::memory(files), "parent.yaml", &[]);
    let deployment = loaded.deployment.unwrap_or_else(|| panic!("{:#?}", loaded.findings));
    let catalogue = catalogue(&deployment);
    let report = run_with(deployment, &catalogue, Effort::default());
    let worse = report.findings.iter().filter(|finding| finding.severity > Severity::Info);
    (report.explored.states, worse.map(|finding| finding.code).collect())
}

/// What an event is called in the file of a subsystem is no name that might be exchanged; what the parent has itself may be what a subsystem holds.
#[test]
fn what_is_said_to_a_subsystem_and_what_that_holds_is_no_matter_of_names() {
    let (once, found) = found_on_two(["can2", "can3"], &[]);
    assert_eq!(found, []);
    let swapped = [("right/e_ask'", "right/?'"), ("right/e_low'", "right/e_ask'"), ("right/?'", "right/e_low'")];
    let (both, _) = found_on_two(["can2", "can3"], &swapped);
    assert!(both > once, "{both} {once}");
    let (_, found) = found_on_two(["can2", "can1"], &[]);
    assert!(found.contains(&codes::COMPOSE_EXCLUSIVE), "{found:?}");
}
