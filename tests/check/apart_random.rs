//! Random coordinators that have nothing to do with each other, but that a safe configuration of one may interrupt the other, that both
//! may hear the same events from outside, or that one waits for what the other tells: what is found where those that have nothing to
//! do with each other are followed apart is what the plain search through the product of all finds, no less, and seldom more.

use crate::aside::Chance;
use crate::support::Small;
use davit::check::{CheckVerdict, Effort, Report, run_with};
use davit::model::{Code, Finding, Severity, codes};
use std::collections::BTreeSet;
use std::fmt::Write;

/// What one coordinator is made of.
pub struct Made {
    pub configurations: String,
    pub coordinator: String,
    /// It has a safe configuration: it interrupts others.
    safe: bool,
}

/// The answers that a state hears of those there are: all, or some of them.
fn some(chance: &mut Chance, of: &str, answers: &[&str], all: usize) -> Vec<String> {
    let all = chance.percent(all);
    answers.iter().filter(|_| all || chance.percent(60)).map(|answer| format!("'{of}.{answer}'")).collect()
}

fn trans(out: &mut String, src: &str, tgt: &str, events: &[String]) {
    if !events.is_empty() {
        writeln!(out, "trans {{ src = '{src}', tgt = '{tgt}', events = {{ {} }} }},", events.join(", ")).unwrap();
    }
}

/// How a coordinator has to do with others.
#[derive(Clone, Copy)]
pub struct Has {
    /// A safe configuration, which interrupts others.
    pub stop: bool,
    /// It may be made in two steps, and have modes.
    pub more: bool,
    /// It tells `e_NAME_told` somewhere.
    pub tells: bool,
    /// Its events from outside are those of others, too.
    pub shared: bool,
}

/// One coordinator with components of its own: made in one step or two, with modes that are switched, and with a stop, or without.
pub fn made(chance: &mut Chance, name: &str, has: Has) -> Made {
    let Has { stop: safe, more, tells, shared } = has;
    let (n, of) = (name, if shared { "all" } else { name });
    // Where it tells something: while it is made, when it is up, or on its way down.
    let at = if tells { chance.below(3) } else { 3 };
    let entry = |place: usize, asks: &str| match place == at {
        true => format!("entry = {{ 'e_{n}_told', '{asks}' }}"),
        false => format!("entry = '{asks}'"),
    };
    let mut configurations = String::new();
    let mut c = String::from("idle = state {}, trans { src = 'initial', tgt = 'idle' },\n");
    let running = if chance.percent(40) { format!(", post_conf_state = {{ '{n}:running' }}") } else { String::new() };
    writeln!(configurations, "{n}_base = Configuration {{ create('{n}', 'Drive'){running} }},").unwrap();
    let two = more && chance.percent(45);
    if two {
        let more = ["operation_call('{n}.open')", "operation_call('{n}.raise')", "port_write('{n}.in', 1.0)"];
        let change = more[chance.below(more.len())].replace("{n}", n);
        let hold = if chance.percent(20) { "on_failure = 'hold', " } else { "" };
        writeln!(configurations, "{n}_more = Configuration {{ {hold}{change} }},").unwrap();
    }
    // Up.
    trans(&mut c, "idle", "starting", &["'e_start'".to_owned()]);
    writeln!(c, "starting = state {{ {} }},", entry(0, &format!("{n}_base"))).unwrap();
    trans(&mut c, "starting", if two { "adding" } else { "up" }, &[format!("'{n}_base.ok'")]);
    // That it is cancelled before it has begun comes of another one's stop alone, mostly.
    let base = format!("{n}_base");
    let failed = [some(chance, &base, &["failed"], 60), some(chance, &base, &["cancelled"], 10)].concat();
    trans(&mut c, "starting", "idle", &failed);
    let mut leads_down = if chance.percent(85) { vec![format!("'{n}_base.broken'")] } else { Vec::new() };
    if chance.percent(70) {
        leads_down.push("'e_shutdown'".to_owned());
    }
    trans(&mut c, "starting", "leaving", &leads_down);
    if two {
        writeln!(c, "adding = state {{ entry = '{n}_more' }},").unwrap();
        trans(&mut c, "adding", "up", &[format!("'{n}_more.ok'")]);
        let failed = some(chance, &format!("{n}_more"), &["failed", "cancelled", "broken"], 60);
        trans(&mut c, "adding", "leaving", &failed);
        if chance.percent(70) {
            trans(&mut c, "adding", "removing", &["'e_shutdown'".to_owned()]);
        }
        writeln!(c, "removing = state {{ entry = '{n}_more.undo' }},").unwrap();
        let over = some(chance, &format!("{n}_more"), &["undone", "undo.failed", "undo.broken"], 70);
        trans(&mut c, "removing", "leaving", &over);
    }
    // Modes inside.
    let modes = if more && !two { 1 + chance.below(2) } else { 0 };
    let mut up = String::new();
    if modes > 0 {
        up += "hub = state {}, trans { src = 'initial', tgt = 'hub' },\n";
    }
    for mode in 0..modes {
        let changes = [
            format!("property_set('{n}.gain', {mode}.5)"),
            format!("operation_call('{n}.close')"),
            format!("port_write('{n}.in', 2.0)"),
            format!("confirm = {{ event = 'e_{n}_yes', within = 0.5 }}, property_set('{n}.gain', {mode}.25)"),
        ];
        let change = &changes[chance.below(changes.len())];
        let group = if chance.percent(30) { format!("group = '{n}_g', ") } else { String::new() };
        writeln!(configurations, "{n}_m{mode} = Configuration {{ {group}{change} }},").unwrap();
        trans(&mut up, "hub", &format!("m{mode}"), &[format!("'e_{of}_{mode}'")]);
        let back = format!("'e_{of}_back'");
        if chance.percent(50) {
            writeln!(up, "m{mode} = state {{ config = '{n}_m{mode}' }},").unwrap();
            let mut events = some(chance, &format!("{n}_m{mode}"), &["failed", "broken", "reverted"], 50);
            events.push(back);
            trans(&mut up, &format!("m{mode}"), "hub", &events);
        } else {
            writeln!(up, "m{mode} = state {{ entry = '{n}_m{mode}', exit = '{n}_m{mode}.undo' }},").unwrap();
            trans(&mut up, &format!("m{mode}"), "hub", &[back]);
        }
    }
    let told = if at == 1 { format!("entry = 'e_{n}_told', ") } else { String::new() };
    writeln!(c, "up = state {{ {told}{up} }},").unwrap();
    // Its stop.
    if safe {
        writeln!(configurations, "{n}_calm = Configuration {{ safe = true, property_set('{n}.gain', 0.0) }},").unwrap();
        writeln!(c, "stopped = state {{ entry = '{n}_calm' }}, released = state {{ entry = '{n}_calm.undo' }},")
            .unwrap();
        trans(&mut c, "up", "stopped", &[format!("'e_{of}_stop'")]);
        let goes_on = chance.percent(40);
        let ends = if goes_on { format!("'e_{of}_go'") } else { "'e_shutdown'".to_owned() };
        trans(&mut c, "stopped", "released", &[ends]);
        let over = some(chance, &format!("{n}_calm"), &["undone", "undo.failed", "undo.broken"], 80);
        trans(&mut c, "released", if goes_on { "up" } else { "leaving" }, &over);
        if goes_on {
            trans(&mut c, "stopped", "leaving", &["'e_shutdown'".to_owned()]);
        }
    }
    // Down.
    trans(&mut c, "up", if two { "removing" } else { "leaving" }, &["'e_shutdown'".to_owned()]);
    writeln!(c, "leaving = state {{ {} }},", entry(2, &format!("{n}_base.undo"))).unwrap();
    if chance.percent(50) {
        // Tried again until it is undone: nothing is left behind, and nobody waits for ever.
        writeln!(c, "again = state {{ entry = '{n}_base.undo' }},").unwrap();
        let wrong = ["failed", "broken"].map(|how| format!("'{n}_base.undo.{how}'"));
        trans(&mut c, "leaving", "again", &wrong);
        trans(&mut c, "again", "leaving", &wrong);
        ["leaving", "again"].iter().for_each(|src| trans(&mut c, src, "idle", &[format!("'{n}_base.undone'")]));
    } else {
        let over = some(chance, &format!("{n}_base"), &["undone", "undo.failed", "undo.broken"], 60);
        trans(&mut c, "leaving", "idle", &over);
    }
    Made { configurations, coordinator: c, safe }
}

/// One without a component, which waits for an event: for the whole of its way up, or between two states of it.
fn waits(chance: &mut Chance, event: &str) -> Made {
    let mut c = String::from("idle = state {}, trans { src = 'initial', tgt = 'idle' },\n");
    let (told, down) = ([format!("'{event}'")], ["'e_shutdown'".to_owned()]);
    if chance.percent(50) {
        c += "waiting = state {}, up = state {},\n";
        trans(&mut c, "idle", "waiting", &["'e_start'".to_owned()]);
        trans(&mut c, "waiting", "up", &told);
        if chance.percent(70) {
            trans(&mut c, "waiting", "idle", &down);
        }
    } else {
        trans(&mut c, "idle", "up", &["'e_start'".to_owned()]);
        c += "up = state { low = state {}, high = state {}, trans { src = 'initial', tgt = 'low' },\n";
        trans(&mut c, "low", "high", &told);
        c += "},\n";
    }
    if chance.percent(80) {
        trans(&mut c, "up", "idle", &down);
    }
    Made { configurations: String::new(), coordinator: c, safe: false }
}

/// One without a component, which tells `e_a_told` when it is up, or when somebody wants that.
fn teller(chance: &mut Chance) -> Made {
    let mut c = String::from("idle = state {}, trans { src = 'initial', tgt = 'idle' },\n");
    trans(&mut c, "idle", "up", &["'e_start'".to_owned()]);
    trans(&mut c, "up", "idle", &["'e_shutdown'".to_owned()]);
    if chance.percent(50) {
        c += "up = state { entry = 'e_a_told' },\n";
    } else {
        c +=
            "up = state { off = state {}, on = state { entry = 'e_a_told' }, trans { src = 'initial', tgt = 'off' },\n";
        trans(&mut c, "off", "on", &["'e_a_on'".to_owned()]);
        c += "},\n";
    }
    Made { configurations: String::new(), coordinator: c, safe: false }
}

/// What those of one case have to do with each other.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Joined {
    /// Two, and nothing.
    Nothing,
    /// Two that hear the same events from outside.
    Outside,
    /// Three, the second of which waits for what the first one tells.
    Told,
}

struct Case {
    small: Small,
    joined: Joined,
    /// How many have a stop.
    stops: usize,
}

fn case(seed: u64) -> Case {
    let mut chance = Chance(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x2545_f491);
    let one_of = |dice: usize, most: &[usize]| most.iter().position(|most| dice < *most).expect("a face");
    let joined = [Joined::Nothing, Joined::Outside, Joined::Told][one_of(chance.below(20), &[8, 12, 20])];
    // One of them is small, and each that has a stop: the product of all is followed to its end.
    let parts = if joined == Joined::Told {
        let small = chance.percent(50);
        let has = Has { stop: small && chance.percent(50), more: false, tells: !small, shared: false };
        let drive = made(&mut chance, if small { "b" } else { "a" }, has);
        let (first, other) = match small {
            true => (teller(&mut chance), drive),
            false => (drive, waits(&mut chance, "e_b_on")),
        };
        vec![("a", first), ("b", other), ("l", waits(&mut chance, "e_a_told"))]
    } else {
        let stops = [(false, false), (true, false)][one_of(chance.below(20), &[10, 20])];
        let shared = joined == Joined::Outside;
        let mut of = |name, stop, more| (name, made(&mut chance, name, Has { stop, more, tells: false, shared }));
        vec![of("a", stops.0, false), of("b", stops.1, !stops.0)]
    };
    let configurations: String = parts.iter().map(|(_, part)| part.configurations.as_str()).collect();
    let coordinators: Vec<_> = parts.iter().map(|(name, part)| (*name, part.coordinator.as_str())).collect();
    let keys = if joined == Joined::Told { "emits: [e_a_told]\n" } else { "" };
    let stops = parts.iter().filter(|(_, part)| part.safe).count();
    Case { small: Small::several(&configurations, &coordinators, keys), joined, stops }
}

/// How bad what is found is: refused, warned of, or neither.
fn class(report: &Report) -> usize {
    match report.verdict {
        CheckVerdict::Refused => 2,
        CheckVerdict::Warnings => 1,
        CheckVerdict::Sound | CheckVerdict::Followed { .. } => 0,
    }
}

/// What is found, and of which element: messages name the states of all that are followed together.
pub fn told(report: &Report) -> BTreeSet<(Code, String)> {
    let worth = report.findings.iter().filter(|finding| finding.severity > Severity::Info);
    // That nothing leads on in one is, of both together, that no way leads down.
    let one = |finding: &Finding| match finding.code {
        codes::COORD_STUCK | codes::COORD_NO_WAY_DOWN => (codes::COORD_NO_WAY_DOWN, String::new()),
        codes::COORD_LEFTOVERS | codes::DEPLOY_NEVER_UP | codes::DEPLOY_NEVER_DOWN => (finding.code, String::new()),
        code => (code, finding.message.clone()),
    };
    worth.map(one).collect()
}

/// Whether the plain search cannot tell it. What is not followed to its end may lead down: behind an undo that failed, or where more
/// waits than is followed, that is more of the product than of each alone. And where both are never down at once, what one leaves
/// on its own way down is told of that one alone.
fn is_only_told_apart(code: Code, plainly: &BTreeSet<(Code, String)>, plain: &Report) -> bool {
    let never_down = [codes::COORD_NO_WAY_DOWN, codes::DEPLOY_NEVER_DOWN];
    match code {
        codes::COORD_NO_WAY_DOWN => !plain.left.is_empty(),
        codes::COORD_LEFTOVERS => plainly.iter().any(|(code, _)| never_down.contains(code)),
        _ => false,
    }
}

/// How many are compared.
const CASES: u64 = 80;

/// `DAVIT_APART_CASES=10000` is the long run, from the case `DAVIT_APART_FIRST` on.
#[test]
fn random_coordinators_are_judged_apart_as_together() {
    let number = |name: &str, usual: u64| std::env::var(name).map_or(usual, |n| n.parse().expect("a number"));
    let (mut seed, cases) = (number("DAVIT_APART_FIRST", 0), number("DAVIT_APART_CASES", CASES));
    let (mut compared, mut with_stops, mut more_in, mut classes, mut kinds) = (0, 0, 0, [0; 3], [0; 3]);
    let mut wrong: Vec<String> = Vec::new();
    while compared < cases {
        let Case { small, joined, stops } = case(seed);
        seed += 1;
        let read = small.read();
        let followed = |together: bool, transitions: usize| {
            let effort = Effort { together, transitions, ..Effort::default() };
            let report = run_with(read.deployment.clone(), &read.catalogue, effort);
            let cut = report.left.iter().any(|left| left.contains("as many as are looked at"));
            (!cut).then_some(report)
        };
        // Of those whose product is large there are enough elsewhere.
        let Some(apart) = followed(false, 1_400) else { continue };
        let Some(plain) = followed(true, 40_000) else { continue };
        compared += 1;
        with_stops += usize::from(stops > 0);
        kinds[joined as usize] += 1;
        classes[class(&plain)] += 1;
        let (all, those) = (told(&plain), told(&apart));
        let less: Vec<_> = all.difference(&those).collect();
        let more: Vec<_> = those.difference(&all).collect();
        more_in += usize::from(!more.is_empty());
        let unexplained: Vec<_> = more.iter().filter(|(code, _)| !is_only_told_apart(*code, &all, &plain)).collect();
        let worse = class(&apart) > class(&plain) && more.is_empty();
        // Behind what is refused anyway the one goes on where the other does not.
        let misses = !less.is_empty() && class(&apart) < 2;
        if misses || !unexplained.is_empty() || worse || class(&apart) < class(&plain) {
            let verdicts = [&plain, &apart].map(|report| report.verdict.text());
            wrong.push(format!("{}, of {stops} stops: less {less:#?}, more {more:#?}, {verdicts:?}", seed - 1));
        }
    }
    assert!(wrong.is_empty(), "{} of {compared} differ: {}", wrong.len(), wrong.join("\n"));
    let some = usize::try_from(cases).unwrap() / 20;
    assert!(more_in <= some, "in {more_in} of {compared} more is found apart");
    // Some of everything was among them.
    let enough = with_stops > some && classes.iter().chain(&kinds).all(|n| *n >= some);
    assert!(enough, "{with_stops} with a stop, {classes:?}, {kinds:?}");
}
