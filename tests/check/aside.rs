//! What is set aside where undos fail one after the other changes nothing that is found: it is what the plain search finds.

use crate::support::Small;
use davit::check::{Effort, Report, run_with};
use davit::limits::CHECK_ASIDE;
use std::collections::BTreeSet;
use std::fmt::Write;

/// Numbers out of a seed, the same each time.
pub struct Chance(pub u64);

impl Chance {
    pub fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(self.0 >> 33).unwrap() % n
    }

    pub fn percent(&mut self, n: usize) -> bool {
        self.below(100) < n
    }

    fn pick<'t>(&mut self, list: &[&'t str]) -> &'t str {
        list[self.below(list.len())]
    }
}

/// A robot of a few drives with modes that a state each brings with it, some of which share a drive, and a coordinator that deals
/// with what fails in one of many ways.
fn modes(seed: u64) -> Small {
    let mut chance = Chance(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x5bd1_e995);
    let (drives, modes) = (2 + chance.below(3), 2 + chance.below(2));
    let creates: Vec<String> = (0..drives).map(|i| format!("create('k{i}', 'Drive')")).collect();
    let states: Vec<String> = (0..drives).map(|i| format!("'k{i}:running'")).collect();
    let mut configurations =
        format!("base = Configuration {{ {}, post_conf_state = {{ {} }} }},\n", creates.join(", "), states.join(", "));
    for mode in 0..modes {
        // Mostly a drive of its own.
        let own = if chance.percent(75) { mode % drives } else { chance.below(drives) };
        let other = chance.below(drives);
        let mut changes: BTreeSet<String> = BTreeSet::new();
        for _ in 0..=chance.below(2) {
            changes.insert(match chance.below(8) {
                0..=3 => format!("property_set('k{own}.gain', {mode}.5)"),
                4 => format!("operation_call('k{own}.open')"),
                5 => format!("connect('k{other}.out', 'k{own}.in')"),
                6 => format!("port_write('k{own}.in', 1.0)"),
                _ => format!("property_set('k{other}.gain', 2.0)"),
            });
        }
        if chance.percent(12) {
            changes.insert(format!("create('extra{mode}', 'Drive')"));
        }
        if chance.percent(12) {
            changes.insert(format!("post_conf_state = {{ 'k{own}:stopped' }}"));
        }
        let changes: Vec<String> = changes.into_iter().collect();
        writeln!(configurations, "s{mode} = Configuration {{ {} }},", changes.join(", ")).unwrap();
    }
    let mut up = "hub = state {}, trans { src = 'initial', tgt = 'hub' },\n".to_owned();
    let tried_again = chance.percent(40);
    for mode in 0..modes {
        writeln!(up, "m{mode} = state {{ config = 's{mode}' }},").unwrap();
        writeln!(up, "trans {{ src = 'hub', tgt = 'm{mode}', events = {{ 'e_{mode}' }} }},").unwrap();
        let back =
            chance.pick(&["'e_back'", "'e_back', 's{m}.failed', 's{m}.broken'"]).replace("{m}", &mode.to_string());
        writeln!(up, "trans {{ src = 'm{mode}', tgt = 'hub', events = {{ {back} }} }},").unwrap();
        if chance.percent(30) {
            let next = (mode + 1) % modes;
            writeln!(up, "trans {{ src = 'm{mode}', tgt = 'm{next}', events = {{ 'e_next' }} }},").unwrap();
        }
        if tried_again {
            writeln!(up, "r{mode} = state {{ entry = 's{mode}.undo' }},").unwrap();
            writeln!(up, "trans {{ src = 'hub', tgt = 'r{mode}', events = {{ 's{mode}.undo.failed' }} }},").unwrap();
            writeln!(
                up,
                "trans {{ src = 'r{mode}', tgt = 'hub', events = {{ 's{mode}.undone', 's{mode}.undo.broken' }} }},"
            )
            .unwrap();
            if chance.percent(50) {
                writeln!(up, "trans {{ src = 'r{mode}', tgt = 'hub', events = {{ 's{mode}.undo.failed' }} }},")
                    .unwrap();
            }
        }
    }
    let mut outer = String::new();
    if chance.percent(30) {
        let mode = chance.below(modes);
        writeln!(outer, "trans {{ src = 'up', tgt = 'leaving', events = {{ 's{mode}.undo.failed' }} }},").unwrap();
    }
    let coordinator = format!(
        "idle = state {{}}, starting = state {{ entry = 'base' }},
         up = state {{ {up} }}, leaving = state {{ entry = 'base.undo' }}, again = state {{ entry = 'base.undo' }},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'starting', events = {{ 'e_start' }} }},
         trans {{ src = 'starting', tgt = 'up', events = {{ 'base.ok' }} }},
         trans {{ src = 'starting', tgt = 'idle', events = {{ 'base.failed' }} }},
         trans {{ src = 'starting', tgt = 'leaving', events = {{ 'e_shutdown', 'base.broken' }} }},
         trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone' }} }},
         trans {{ src = 'leaving', tgt = '{}', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},
         trans {{ src = 'again', tgt = 'leaving', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},
         trans {{ src = 'again', tgt = 'idle', events = {{ 'base.undone' }} }},\n{outer}",
        chance.pick(&["again", "again", "up"])
    );
    Small::new(&configurations, &coordinator, "")
}

/// What is told: how bad, what, and in which words.
fn told(report: &Report) -> BTreeSet<String> {
    let one = |finding: &davit::model::Finding| format!("{:?} {} {}", finding.severity, finding.code, finding.message);
    report.findings.iter().map(one).collect()
}

#[test]
fn what_is_set_aside_changes_no_finding() {
    let (first, cases) = (0, 200);
    let (mut apart, mut compared) = (0, 0);
    let mut wrong = Vec::new();
    for seed in first..first + cases {
        let read = modes(seed).read();
        let followed = |aside_from: usize| {
            let effort = Effort { aside_from, transitions: 20_000, ..Effort::default() };
            run_with(read.deployment.clone(), &read.catalogue, effort)
        };
        let (plain, aside) = (followed(usize::MAX), followed(0));
        if plain.left.iter().any(|left| left.contains("--budget")) {
            continue;
        }
        compared += 1;
        apart += usize::from(aside.explored.states != plain.explored.states);
        let (with, without) = (told(&aside), told(&plain));
        let more: Vec<_> = with.difference(&without).collect();
        let less: Vec<_> = without.difference(&with).collect();
        if !more.is_empty() || !less.is_empty() {
            let states = (plain.explored.states, aside.explored.states);
            wrong.push(format!("{seed}: states {states:?}, more {more:#?}, less {less:#?}"));
        }
    }
    assert!(wrong.is_empty(), "{} differ: {}", wrong.len(), wrong.join("\n"));
    assert!(compared > 60 && apart > 15, "{compared} compared, of which {apart} had something set aside");
}

/// What an undo leaves is known also where it is come to only behind another one that failed, and that was set aside. (Not where the
/// deployment is led down: there it is taken along.)
#[test]
fn what_is_left_behind_another_one_is_known() {
    let configurations = "base = Configuration { create('a', 'Drive'), create('b', 'Drive'),
           post_conf_state = { 'a:running', 'b:running' } },
         s0 = Configuration { property_set('a.gain', 2.5) }, s1 = Configuration { property_set('b.gain', 2.5) },";
    let coordinator = "idle = state {}, starting = state { entry = 'base' },
         up = state { first = state { config = 's0' }, between = state {}, second = state { config = 's1' }, last = state {},
           trans { src = 'initial', tgt = 'first' },
           trans { src = 'first', tgt = 'between', events = { 'e_next', 's0.failed', 's0.broken' } },
           trans { src = 'between', tgt = 'second', events = { 's0.undo.failed' } },
           trans { src = 'second', tgt = 'last', events = { 'e_next', 's1.failed', 's1.broken' } } },
         leaving = state { entry = 'base.undo' },
         trans { src = 'initial', tgt = 'idle' },
         trans { src = 'idle', tgt = 'starting', events = { 'e_start' } },
         trans { src = 'starting', tgt = 'up', events = { 'base.ok' } },
         trans { src = 'starting', tgt = 'idle', events = { 'base.failed' } },
         trans { src = 'starting', tgt = 'leaving', events = { 'e_shutdown', 'base.broken' } },
         trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown', 'e_back' } },
         trans { src = 'leaving', tgt = 'idle', events = { 'base.undone', 'base.undo.failed', 'base.undo.broken' } },";
    let read = Small::new(configurations, coordinator, "").read();
    let report = run_with(read.deployment, &read.catalogue, Effort { aside_from: 0, ..Effort::default() });
    assert!(report.left.iter().any(|left| left.contains("several undos that failed")), "{:?}", report.left);
    for left in ["s0", "s1"] {
        let refused = format!("`base` cannot be undone before `{left}`");
        assert!(told(&report).iter().any(|told| told.contains(&refused)), "{refused}: {:#?}", told(&report));
    }
}

/// A hub and `n` modes, each of which sets a property of a component of its own; `number` tells several coordinators apart.
fn hub(number: usize, n: usize) -> (String, String) {
    let creates: Vec<String> = (0..n).map(|i| format!("create('c{number}_{i}', 'Drive')")).collect();
    let states: Vec<String> = (0..n).map(|i| format!("'c{number}_{i}:running'")).collect();
    let (mut modes, mut up) = (String::new(), String::new());
    for i in 0..n {
        writeln!(modes, "s{number}_{i} = Configuration {{ property_set('c{number}_{i}.gain', 2.5) }},").unwrap();
        writeln!(
            up,
            "m{i} = state {{ config = 's{number}_{i}' }},
             trans {{ src = 'hub', tgt = 'm{i}', events = {{ 'e{number}_{i}' }} }},
             trans {{ src = 'm{i}', tgt = 'hub', events = {{ 'e{number}_back', 's{number}_{i}.failed', 's{number}_{i}.broken' }} }},"
        )
        .unwrap();
    }
    let base = format!("base{number}");
    let configurations = format!(
        "{base} = Configuration {{ {}, post_conf_state = {{ {} }} }},\n{modes}",
        creates.join(", "),
        states.join(", ")
    );
    let coordinator = format!(
        "idle = state {{}}, starting = state {{ entry = '{base}' }},
         up = state {{ hub = state {{}}, trans {{ src = 'initial', tgt = 'hub' }}, {up} }},
         leaving = state {{ entry = '{base}.undo' }}, again = state {{ entry = '{base}.undo' }},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'starting', events = {{ 'e_start' }} }},
         trans {{ src = 'starting', tgt = 'up', events = {{ '{base}.ok' }} }},
         trans {{ src = 'starting', tgt = 'idle', events = {{ '{base}.failed' }} }},
         trans {{ src = 'starting', tgt = 'leaving', events = {{ 'e_shutdown', '{base}.broken' }} }},
         trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ '{base}.undone' }} }},
         trans {{ src = 'leaving', tgt = 'again', events = {{ '{base}.undo.failed', '{base}.undo.broken' }} }},
         trans {{ src = 'again', tgt = 'leaving', events = {{ '{base}.undo.failed', '{base}.undo.broken' }} }},
         trans {{ src = 'again', tgt = 'idle', events = {{ '{base}.undone' }} }},"
    );
    (configurations, coordinator)
}

fn states(small: &Small, aside_from: usize) -> usize {
    let read = small.read();
    let effort = Effort { aside_from, ..Effort::default() };
    let report = run_with(read.deployment, &read.catalogue, effort);
    assert!(!report.left.iter().any(|left| left.contains("--budget")), "{:?}", report.left);
    report.explored.states
}

/// How many states a hub with so many modes has.
fn alone(n: usize) -> usize {
    4 * n * n * n + 30 * n * n + 40 * n + 24
}

/// Where each of n modes may be left over, the states are as many as a coordinator can be in with one of them left, not with any
/// subset: where it is, which one is left, and which two are asked for at once.
#[test]
fn what_may_be_left_of_many_is_followed_one_at_a_time() {
    let of = |n: usize| {
        let (configurations, coordinator) = hub(0, n);
        Small::new(&configurations, &coordinator, "")
    };
    for n in [8, 10, 13] {
        assert_eq!(states(&of(n), CHECK_ASIDE), alone(n), "{n} modes");
    }
    let (two, three) = (states(&of(6), usize::MAX), states(&of(7), usize::MAX));
    assert!(two > states(&of(6), CHECK_ASIDE) && three > two * 18 / 10, "every subset: {two}, {three}");
}

/// Coordinators that claim nothing in common cost their sum.
#[test]
fn coordinators_that_claim_nothing_in_common_cost_their_sum() {
    let names = ["left", "middle", "right"];
    for n in [8, 10] {
        let (mut configurations, mut coordinators) = (String::new(), Vec::new());
        for (number, name) in names.iter().enumerate() {
            let (own, coordinator) = hub(number, n);
            configurations += &own;
            coordinators.push((*name, coordinator));
        }
        let listed: Vec<(&str, &str)> = coordinators.iter().map(|(name, text)| (*name, text.as_str())).collect();
        // Each may be down, or begin anew, while others are still led down.
        let one = alone(n) + 3;
        assert_eq!(states(&Small::several(&configurations, &listed, ""), CHECK_ASIDE), names.len() * one, "{n} modes");
    }
}
