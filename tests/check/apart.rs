//! Coordinators that have nothing in common but that a safe configuration of one interrupts the other are followed apart.

use crate::aside::Chance;
use crate::flat;
use crate::support::Small;
use davit::check::{Effort, Report, run_with};
use davit::model::{Severity, codes};
use std::collections::BTreeSet;

/// A drive with a coordinator of its own: it is made, and stopped by its own safe configuration where that is asked for. `heard` are
/// further answers of its making, `leaves` of the undoing.
fn drive(name: &str, heard: &str, leaves: &str) -> (String, String) {
    let configurations = format!(
        "{name}_base = Configuration {{ create('{name}', 'Drive') }},
         {name}_calm = Configuration {{ safe = true, property_set('{name}.gain', 0.0) }},\n"
    );
    let coordinator = format!(
        "idle = state {{}}, starting = state {{ entry = '{name}_base' }}, up = state {{}},
         stopped = state {{ entry = '{name}_calm' }}, leaving = state {{ entry = '{name}_base.undo' }},
         released = state {{ entry = '{name}_calm.undo' }},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'starting', events = {{ 'e_start' }} }},
         trans {{ src = 'starting', tgt = 'up', events = {{ '{name}_base.ok' }} }},
         trans {{ src = 'starting', tgt = 'idle', events = {{ '{name}_base.failed'{heard} }} }},
         trans {{ src = 'starting', tgt = 'leaving', events = {{ '{name}_base.broken' }} }},
         trans {{ src = 'up', tgt = 'stopped', events = {{ 'e_{name}_stop' }} }},
         trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'stopped', tgt = 'released', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'released', tgt = 'leaving', events = {{ '{name}_calm.undone', '{name}_calm.undo.failed', '{name}_calm.undo.broken' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ '{name}_base.undone'{leaves} }} }},"
    );
    (configurations, coordinator)
}

const HEARD: &str = ", '{name}_base.cancelled'";
const LEAVES: &str = ", '{name}_base.undo.failed', '{name}_base.undo.broken'";

fn drives(parts: &[(&str, &str, &str)]) -> Small {
    let made: Vec<_> = (parts.iter())
        .map(|(name, heard, leaves)| {
            (name, drive(name, &heard.replace("{name}", name), &leaves.replace("{name}", name)))
        })
        .collect();
    let configurations: String = made.iter().map(|(_, (configurations, _))| configurations.as_str()).collect();
    let coordinators: Vec<(&str, &str)> =
        made.iter().map(|(name, (_, coordinator))| (**name, coordinator.as_str())).collect();
    Small::several(&configurations, &coordinators, "")
}

fn followed(small: &Small, together: bool) -> Report {
    let read = small.read();
    run_with(read.deployment, &read.catalogue, Effort { together, transitions: 300_000, ..Effort::default() })
}

/// It waits for somebody where the event that ends the deployment is not heard: that event is raised once, whoever else hears it.
#[test]
fn who_waits_where_nobody_leads_it_down_is_told_beside_others_too() {
    let waits = "idle = state {}, waiting = state {}, up = state {},
        trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'waiting', events = { 'e_start' } },
        trans { src = 'waiting', tgt = 'up', events = { 'e_b_on' } },
        trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },";
    let follows = "idle = state {}, up = state {}, trans { src = 'initial', tgt = 'idle' },
        trans { src = 'idle', tgt = 'up', events = { 'e_start' } },
        trans { src = 'up', tgt = 'idle', events = { 'e_shutdown' } },";
    for coordinators in [&[("b", waits)][..], &[("b", waits), ("c", follows)]] {
        let small = Small::several("", coordinators, "");
        for together in [false, true] {
            let told = followed(&small, together).findings;
            let told: Vec<_> = told.iter().filter(|finding| finding.severity > Severity::Info).collect();
            assert!(told.iter().any(|finding| finding.code == codes::COORD_NO_WAY_DOWN), "{together}: {told:?}");
        }
    }
}

/// What begins and ends the deployment is to be heard by each that has nothing to do with the others, as if it were alone: that another one
/// hears it leads it nowhere.
#[test]
fn that_another_one_hears_it_leads_nobody_down() {
    let of = |up: &str, down: &str| {
        format!(
            "idle = state {{}}, up = state {{}}, trans {{ src = 'initial', tgt = 'idle' }},
             trans {{ src = 'idle', tgt = 'up', events = {{ '{up}' }} }},
             trans {{ src = 'up', tgt = 'idle', events = {{ '{down}' }} }},"
        )
    };
    let (hears, tells) = (of("e_start", "e_shutdown"), of("e_start", "e_shutdown', 'e_lost"));
    // What it waits for elsewhere does not help where it is up.
    let elsewhere = "odd = state {}, trans { src = 'odd', tgt = 'idle', events = { 'e_shutdown' } },
        trans { src = 'up', tgt = 'odd', events = { 'e_odd' } },";
    for (b, code, at) in [
        (of("e_start", "e_off"), codes::DEPLOY_NEVER_DOWN, "`root.up`"),
        (of("e_start", "e_off") + elsewhere, codes::DEPLOY_NEVER_DOWN, "`root.up`"),
        (of("e_on", "e_shutdown"), codes::DEPLOY_NEVER_UP, "`root.idle`"),
    ] {
        let small = Small::several("", &[("a", &hears), ("b", &b)], "");
        let told = followed(&small, false).findings;
        let told: Vec<_> = told.iter().filter(|f| f.code == code).map(|f| f.message.as_str()).collect();
        assert!(told.len() == 1 && told[0].contains("does not begin for `b`") && told[0].contains(at), "{told:?}");
    }
    // Where something tells it by itself nobody has to know: a monitor, or a component.
    let reports = "simulated: { reactions: [{ after: create x, delay_s: 0.1, raise: e_on, component: x }] }\n";
    let makes = hears.replace("up = state {}", "up = state { entry = 'make' }");
    let small = Small::several(
        "make = Configuration { create('x', 'Drive') }",
        &[("a", &makes), ("b", &of("e_on", "e_shutdown"))],
        reports,
    );
    let told = followed(&small, false).findings;
    assert!(!told.iter().any(|f| f.message.contains("does not begin")), "{told:#?}");
    // Who is told by one that hears it is led by that.
    let told = tells.replace("up = state {}", "up = state { exit = 'e_b_off' }");
    let small = Small::several("", &[("a", &told), ("b", &of("e_start", "e_b_off"))], "emits: [e_b_off]\n");
    let report = followed(&small, false);
    assert!(!report.findings.iter().any(|f| f.severity > Severity::Info), "{:#?}", report.findings);
}

/// Three cost three times what one costs, and not the product.
#[test]
fn a_safe_configuration_joins_nobody() {
    let of = |names: &[&str]| {
        let parts: Vec<_> = names.iter().map(|name| (*name, HEARD, LEAVES)).collect();
        followed(&drives(&parts), false).explored
    };
    let (two, three) = (of(&["a", "b"]), of(&["a", "b", "c"]));
    assert_eq!(two.states * 3, three.states * 2);
    assert_eq!(two.transitions * 3, three.transitions * 2);
}

/// What it interrupts of the other one is followed: that it was cancelled before it began is to be heard there.
#[test]
fn what_a_safe_configuration_of_another_one_interrupts_is_known() {
    let said = |parts: &[(&str, &str, &str)]| -> Vec<String> {
        let report = followed(&drives(parts), false);
        let way = |at: usize| report.traces[at].iter().map(ToString::to_string).collect::<Vec<_>>().join("; ");
        let all = report.findings.iter().enumerate();
        all.filter(|(_, f)| f.severity > Severity::Info).map(|(at, f)| format!("{}: {}", f.message, way(at))).collect()
    };
    let told = said(&[("a", "", LEAVES), ("b", HEARD, LEAVES)]);
    assert!(told.iter().any(|told| told.contains("`b_calm` interrupts")), "{told:#?}");
    assert!(!said(&[("a", HEARD, LEAVES), ("b", HEARD, LEAVES)]).iter().any(|told| told.contains("interrupts")));
}

/// What the product of both finds is found where each is followed alone.
#[test]
fn apart_finds_what_together_does() {
    let mut wrong = Vec::new();
    let (mut compared, mut found) = (0, 0);
    for seed in 0..40 {
        let mut chance = Chance(seed * 7919 + 11);
        let mut part = |name: &'static str| {
            let heard = if chance.percent(50) { HEARD } else { "" };
            let leaves = [LEAVES, "", ", '{name}_base.undo.failed'", ", '{name}_base.undo.broken'"][chance.below(4)];
            (name, heard, leaves)
        };
        let small = drives(&[part("a"), part("b")]);
        let (plain, apart) = (followed(&small, true), followed(&small, false));
        if plain.left.iter().any(|left| left.contains("as many as are looked at")) {
            continue;
        }
        compared += 1;
        let codes = |report: &Report| -> BTreeSet<String> {
            let of = |f: &davit::model::Finding| (f.severity > Severity::Info).then(|| f.code.to_string());
            report.findings.iter().filter_map(of).collect()
        };
        let (with, without) = (codes(&plain), codes(&apart));
        found += usize::from(!with.is_empty());
        if !with.is_subset(&without) {
            let told = |report: &Report| {
                report.findings.iter().map(|f| format!("{:?} {}", f.severity, f.message)).collect::<Vec<_>>()
            };
            wrong.push(format!("{seed}: together {:#?}, apart {:#?}", told(&plain), told(&apart)));
        }
        assert!(apart.explored.states < plain.explored.states, "{seed}");
    }
    assert!(wrong.is_empty(), "{} differ: {}", wrong.len(), wrong.join("\n"));
    assert!(compared > 20 && found > 10, "{compared} compared, {found} with findings");
}

/// Two youBots written flat are followed to their end, each for itself; and it is found that one's stop cancels what the other one is
/// doing, where nobody there hears that.
#[test]
fn two_youbots_side_by_side_are_followed_to_their_end() {
    let folder = tempfile::tempdir().unwrap();
    let file = flat::youbots(folder.path(), &["l_", "r_"]);
    let read = davit::app::read(&file, &davit::lang::LoadOptions::default(), davit::libraries::builtin());
    let read = read.unwrap_or_else(|_| panic!("it is readable"));
    let report = run_with(read.deployment, &read.catalogue, Effort::default());
    assert_eq!(report.explored.unfollowed, 0, "{:?}", report.explored);
    assert!(!report.left.iter().any(|left| left.contains("as many as are looked at")), "{:?}", report.left);
    let behind = "was not followed: with that there are more than 800000 transitions (`--budget`)";
    assert!(report.left.iter().any(|left| left.contains(behind)), "{:?}", report.left);
    let told: Vec<&str> = (report.findings.iter())
        .filter(|finding| finding.severity > Severity::Info)
        .map(|finding| finding.message.as_str())
        .collect();
    let stuck = "what `root.shutting_down.unwiring.braked.waiting` waits for never comes: `l_base_stop.broken`";
    assert!(told.iter().any(|told| told.starts_with(stuck)), "{told:#?}");
    assert!(told.iter().all(|told| told.contains("unwiring") || told.contains("destroying")), "{told:#?}");
}

/// One that takes no part in anything here: it comes up, may be stopped, and goes down.
const BESIDE: &str = "idle = state {}, starting = state { entry = 'b_base' }, up = state {}, leaving = state { entry = 'b_base.undo' },
    stopped = state { entry = 'b_calm' }, released = state { entry = 'b_calm.undo' },
    trans { src = 'initial', tgt = 'idle' }, trans { src = 'idle', tgt = 'starting', events = { 'e_start' } },
    trans { src = 'starting', tgt = 'up', events = { 'b_base.ok' } },
    trans { src = 'starting', tgt = 'idle', events = { 'b_base.failed', 'b_base.cancelled' } },
    trans { src = 'starting', tgt = 'leaving', events = { 'b_base.broken' } },
    trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown' } },
    trans { src = 'leaving', tgt = 'idle', events = { 'b_base.undone', 'b_base.undo.failed', 'b_base.undo.broken' } },
    trans { src = 'up', tgt = 'stopped', events = { 'e_b_stop' } },
    trans { src = 'stopped', tgt = 'released', events = { 'e_shutdown' } },
    trans { src = 'released', tgt = 'leaving', events = { 'b_calm.undone', 'b_calm.undo.failed', 'b_calm.undo.broken' } },";

fn refused_beside(configurations: &str, coordinator: &str, of: &str) -> bool {
    let both = "b_base = Configuration { create('b', 'Drive') },
                b_calm = Configuration { safe = true, property_set('b.gain', 0.0) },";
    let small = Small::several(&format!("{configurations} {both}"), &[("a", coordinator), ("b", BESIDE)], "");
    let report = followed(&small, false);
    report.findings.iter().any(|f| f.code == davit::model::codes::COORD_REQUEST_REFUSED && f.message.contains(of))
}

/// A raised event that ends it does not keep the one that begins it from being heard: one comes up again while the other one is led down.
#[test]
fn that_one_begins_again_while_the_other_is_led_down_is_followed() {
    let coordinator = "idle = state {}, clean = state { entry = 'a_off.undo' }, starting = state { entry = 'a_base' }, up = state {},
        leaving = state { entry = 'a_off' },
        trans { src = 'initial', tgt = 'idle' }, trans { src = 'idle', tgt = 'clean', events = { 'e_start' } },
        trans { src = 'clean', tgt = 'starting', events = { 'a_off.undone', 'a_off.undo.failed', 'a_off.undo.broken' } },
        trans { src = 'starting', tgt = 'up', events = { 'a_base.ok', 'a_base.broken' } },
        trans { src = 'starting', tgt = 'idle', events = { 'a_base.failed', 'a_base.cancelled' } },
        trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'leaving', tgt = 'idle', events = { 'a_off.ok', 'a_off.failed', 'a_off.broken', 'a_off.cancelled' } },";
    let configurations = "a_base = Configuration { create('a', 'Drive') }, a_off = Configuration { destroy('a') },";
    assert!(refused_beside(configurations, coordinator, "there is a component `a` already"));
}

/// A safe configuration that is in force keeps a revert that moves from being carried out, also that of another coordinator.
#[test]
fn what_is_not_confirmed_while_another_one_is_stopped_is_followed() {
    let coordinator = "idle = state {}, starting = state { entry = 'a_base' }, up = state {}, high = state { entry = 'a_up' }, is = state {},
        lowering = state { entry = 'a_up.undo' }, leaving = state { entry = 'a_base.undo' },
        trans { src = 'initial', tgt = 'idle' }, trans { src = 'idle', tgt = 'starting', events = { 'e_start' } },
        trans { src = 'starting', tgt = 'up', events = { 'a_base.ok' } },
        trans { src = 'starting', tgt = 'idle', events = { 'a_base.failed', 'a_base.cancelled' } },
        trans { src = 'starting', tgt = 'leaving', events = { 'a_base.broken' } },
        trans { src = 'up', tgt = 'leaving', events = { 'e_shutdown' } },
        trans { src = 'leaving', tgt = 'idle', events = { 'a_base.undone', 'a_base.undo.failed', 'a_base.undo.broken' } },
        trans { src = 'up', tgt = 'high', events = { 'e_high' } },
        trans { src = 'high', tgt = 'is', events = { 'a_up.ok' } },
        trans { src = 'high', tgt = 'up', events = { 'a_up.failed', 'a_up.cancelled' } },
        trans { src = 'high', tgt = 'lowering', events = { 'a_up.broken' } },
        trans { src = 'is', tgt = 'up', events = { 'a_up.reverted' } },
        trans { src = 'is', tgt = 'lowering', events = { 'e_shutdown', 'a_up.undo.failed', 'a_up.undo.broken' } },
        trans { src = 'lowering', tgt = 'leaving', events = { 'a_up.undone', 'a_up.undo.failed', 'a_up.undo.broken' } },";
    let configurations = "a_base = Configuration { create('a', 'Drive') },
        a_up = Configuration { on_failure = 'rollback', confirm = { event = 'e_yes', within = 0.5 }, operation_call('a.raise') },";
    assert!(refused_beside(configurations, coordinator, "the safe configuration `b_calm` is in force"));
}

/// Their way up and down is looked for group by group: that of twelve, each of which waits for two things, is the sum of theirs, where their
/// product is more than is looked at.
#[test]
fn the_way_of_many_that_have_nothing_to_do_with_each_other_is_found() {
    let names: Vec<String> = (0..12).map(|n| format!("d{n}")).collect();
    let parts: Vec<(String, String)> = names.iter().map(|name| waits_twice(name)).collect();
    let configurations: String = parts.iter().map(|(configurations, _)| configurations.as_str()).collect();
    let coordinators: Vec<(&str, &str)> =
        names.iter().zip(&parts).map(|(name, (_, coordinator))| (name.as_str(), coordinator.as_str())).collect();
    let report = followed(&Small::several(&configurations, &coordinators, ""), false);
    assert!(report.checked.is_some(), "{:#?}", report.findings);
    let timely = |left: &String| !left.contains("comes up, or down, in time");
    assert!(report.left.iter().all(timely), "{:#?}", report.left);
}

/// A drive that is up when two things have been said to its coordinator.
fn waits_twice(name: &str) -> (String, String) {
    let configurations = format!("{name}_base = Configuration {{ create('{name}', 'Drive') }},\n");
    let coordinator = format!(
        "idle = state {{}}, starting = state {{ entry = '{name}_base' }}, made = state {{}}, armed = state {{}}, up = state {{}},
         leaving = state {{ entry = '{name}_base.undo' }},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'starting', events = {{ 'e_start' }} }},
         trans {{ src = 'starting', tgt = 'made', events = {{ '{name}_base.ok' }} }},
         trans {{ src = 'starting', tgt = 'idle', events = {{ '{name}_base.failed', '{name}_base.cancelled' }} }},
         trans {{ src = 'starting', tgt = 'leaving', events = {{ '{name}_base.broken' }} }},
         trans {{ src = 'made', tgt = 'armed', events = {{ 'e_{name}_arm' }} }},
         trans {{ src = 'armed', tgt = 'up', events = {{ 'e_{name}_go' }} }},
         trans {{ src = 'made', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'armed', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ '{name}_base.undone', '{name}_base.undo.failed', '{name}_base.undo.broken' }} }},"
    );
    (configurations, coordinator)
}
