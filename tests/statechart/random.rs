//! Charts made up from random bytes, run by the engine and by the naive interpreter side by side.

use crate::naive::Naive;
use crate::support::raise;
use davit::model::finding::Origin;
use davit::model::names::{ConfigId, EventName, Ident};
use davit::model::statechart::{ChartNode, ChartTransition, Connector, State, Statechart, Trigger};
use davit::statechart::{AtOnce, Chart, EventId, Hook, Machine, Raised, RunEnd, Sim, Stepped, compile};
use davit::time::Time;
use proptest::prelude::*;
use std::cell::Cell;

/// Choices out of bytes; all zero when they are used up, so that fewer bytes make a smaller chart.
struct Choices<'a>(&'a [u8]);

impl Choices<'_> {
    fn below(&mut self, n: usize) -> usize {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        usize::from(*first) % n
    }

    fn of<'t>(&mut self, list: &'t [String]) -> &'t str {
        &list[self.below(list.len())]
    }
}

pub const EVENTS: [&str; 4] = ["e1", "e2", "e3", "e4"];
const NAMES: [&str; 3] = ["a", "b", "c"];

/// States and connectors first; full names of all nodes are noted.
fn tree(choices: &mut Choices<'_>, name: &str, fqn: &str, depth: usize, all: &mut Vec<(String, bool)>) -> State {
    let mut state = State::new(Ident::new(name).unwrap());
    all.push((fqn.to_owned(), true));
    if choices.below(3) == 1 {
        state.entry.push(raise(&format!("in_{}", fqn.replace('.', "_"))));
    }
    if choices.below(3) == 1 {
        state.exit.push(raise(&format!("out_{}", fqn.replace('.', "_"))));
    }
    for number in 0..choices.below(3) {
        state.config.push((ConfigId::new(&format!("conf_{}_{number}", fqn.replace('.', "_"))).unwrap(), Origin::NONE));
    }
    let children = if depth == 0 {
        1 + choices.below(3)
    } else if depth < 4 {
        choices.below(4)
    } else {
        0
    };
    for name in NAMES.iter().take(children) {
        let inner = tree(choices, name, &format!("{fqn}.{name}"), depth + 1, all);
        state.children.push(ChartNode::State(inner));
    }
    if children > 0 {
        for number in 0..choices.below(3) {
            let name = format!("k{number}");
            all.push((format!("{fqn}.{name}"), false));
            state.children.push(ChartNode::Connector(Connector::new(Ident::new(&name).unwrap())));
        }
    }
    state
}

fn events(choices: &mut Choices<'_>, all: &[(String, bool)]) -> Vec<Trigger> {
    let count = [0, 1, 1, 1, 1, 2, 3][choices.below(7)];
    let mut list = Vec::new();
    for _ in 0..count {
        let text = match choices.below(12) {
            0..=7 => EVENTS[choices.below(4)].to_owned(),
            8 => "e_done".to_owned(),
            9 => format!("e_done@{}", all[choices.below(all.len())].0),
            10 => ["e_after(1)", "e_after(2)", "e_after(0.5)"][choices.below(3)].to_owned(),
            _ => ["e_at(3)", "e_init_fsm"][choices.below(2)].to_owned(),
        };
        list.push(Trigger::parse(&text).unwrap());
    }
    list
}

/// `fqn` as it may be written in `scope`.
fn written(choices: &mut Choices<'_>, scope: &str, fqn: &str) -> String {
    let inside = fqn.strip_prefix(scope).and_then(|rest| rest.strip_prefix('.'));
    let form = choices.below(3);
    match inside {
        Some(name) if !name.contains('.') => name.to_owned(),
        Some(path) if form == 0 => format!(".{path}"),
        _ if form == 1 && fqn.matches('.').count() > 1 => fqn.trim_start_matches("root.").to_owned(),
        _ => fqn.to_owned(),
    }
}

fn transitions(choices: &mut Choices<'_>, state: &mut State, fqn: &str, all: &[(String, bool)]) {
    let add = |choices: &mut Choices<'_>, state: &mut State, src: String, tgt: &str, events: Vec<Trigger>| {
        let tgt = written(choices, fqn, tgt);
        let mut transition = ChartTransition::new(&src, &tgt, events);
        transition.pn = [0.0, 0.0, 0.0, 1.0, -1.0, 2.0][choices.below(6)];
        if choices.below(2) == 1 {
            transition.effect.push(raise(&format!("ef{}", choices.below(9))));
        }
        state.transitions.push(transition);
    };
    let inside: Vec<String> =
        all.iter().map(|(name, _)| name.clone()).filter(|n| n.starts_with(&format!("{fqn}."))).collect();
    let nodes: Vec<String> = all.iter().map(|(name, _)| name.clone()).filter(|n| n != "root").collect();
    if !inside.is_empty() {
        for number in 0..1 + choices.below(2) {
            let target = choices.of(&inside).to_owned();
            // Mostly one without events, so that most charts can be entered.
            let list = if number == 0 && choices.below(4) != 1 { vec![] } else { events(choices, all) };
            add(choices, state, "initial".to_owned(), &target, list);
        }
    }
    let more = if fqn == "root" { 2 + choices.below(8) } else { choices.below(5) };
    for _ in 0..more {
        let source = choices.of(&nodes).to_owned();
        let target = choices.of(&nodes).to_owned();
        let src = written(choices, fqn, &source);
        let list = events(choices, all);
        add(choices, state, src, &target, list);
    }
    // So many from one node that those of an event are looked up.
    if fqn == "root" && choices.below(8) == 1 {
        let (source, target) = (choices.of(&nodes).to_owned(), choices.of(&nodes).to_owned());
        for number in 0..2 * davit::limits::CHART_WIDE {
            let trigger = Trigger::parse(&format!("e_pad{number}")).unwrap();
            state.transitions.push(ChartTransition::new(&source, &target, [trigger]));
        }
    }
    for child in &mut state.children {
        if let ChartNode::State(inner) = child {
            let name = format!("{fqn}.{}", inner.name);
            transitions(choices, inner, &name, all);
        }
    }
}

pub fn chart(bytes: &[u8]) -> Statechart {
    let mut choices = Choices(bytes);
    let mut all = Vec::new();
    let mut root = tree(&mut choices, "root", "root", 0, &mut all);
    transitions(&mut choices, &mut root, "root", &all);
    Statechart::new(root)
}

/// Notes what is raised, and lets whole reactions be taken at once.
#[derive(Default)]
struct Names(Vec<Raised>);

impl Hook for Names {
    const MICROSTEPS: bool = false;
    const WATCHES: bool = false;

    fn raised(&mut self, _: &Chart, raised: Raised) {
        self.0.push(raised);
    }
}

/// The same, but one that watches: it is always served the general way.
#[derive(Default)]
struct Watched(Vec<Raised>);

impl Hook for Watched {
    const MICROSTEPS: bool = false;

    fn raised(&mut self, _: &Chart, raised: Raised) {
        self.0.push(raised);
    }
}

/// One event, then to rest, as a coordinator does it: at once where the reaction is known.
fn react(machine: &mut Machine, chart: &Chart, event: EventId, now: Time, names: &mut Names) -> Stepped {
    match machine.at_once(chart, event, now, names) {
        AtOnce::Rests => Stepped { idle: true, transition: true, ended: RunEnd::Idle },
        AtOnce::Goes => Stepped { transition: true, ..machine.run(chart, now, names) },
        AtOnce::No => {
            machine.send(event);
            machine.run(chart, now, names)
        }
    }
}

/// Events one by one, each to rest: once by what is known beforehand, once step by step. Answers how many were taken at once.
fn at_once_or_step_by_step(bytes: &[u8], script: &[u8]) -> Result<usize, TestCaseError> {
    let (Some(chart), _) = compile(&chart(bytes)) else { return Ok(0) };
    let (mut quick, mut general) = (Machine::new(&chart), Machine::new(&chart));
    let (mut names, mut all) = (Names::default(), Watched::default());
    let (mut now, mut at_once) = (Time::default(), 0);
    let completion = EventName::new("e_done@root.a").unwrap();
    quick.run(&chart, now, &mut names);
    general.run(&chart, now, &mut all);
    for byte in script {
        now = Time(now.as_nanos() + u64::from(byte >> 4) * 100_000_000);
        let event = match byte % 8 {
            0..=5 => chart.event(EventName::new(EVENTS[usize::from(byte % 4)]).unwrap()),
            6 => chart.event(completion),
            _ => EventId::OTHER,
        };
        at_once += usize::from(quick.clone().at_once(&chart, event, now, &mut Names::default()) != AtOnce::No);
        let one = react(&mut quick, &chart, event, now, &mut names);
        general.send(event);
        let other = general.run(&chart, now, &mut all);
        if one.ended == RunEnd::Endless && other.ended == RunEnd::Endless {
            // Both were stopped somewhere on the way round.
            return Ok(at_once);
        }
        prop_assert_eq!(one, other, "{:#?}", chart);
        prop_assert_eq!(&names.0, &all.0);
        prop_assert_eq!(quick.active(), general.active());
        prop_assert_eq!((quick.leaf(), quick.mode()), (general.leaf(), general.mode()));
        prop_assert_eq!(quick.queue().events(), general.queue().events());
        prop_assert_eq!(quick.next_deadline(&chart), general.next_deadline(&chart));
        for node in chart.nodes() {
            prop_assert_eq!(quick.visit(node), general.visit(node), "visits of {}", chart.fqn(node));
        }
    }
    Ok(at_once)
}

#[test]
fn a_reaction_taken_at_once_is_the_one_taken_step_by_step() {
    let (taken, all) = (Cell::new(0), Cell::new(0));
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig {
        cases: cases(),
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let bytes = proptest::collection::vec(any::<u8>(), 0..220);
    let script = proptest::collection::vec(any::<u8>(), 1..24);
    let result = runner.run(&(bytes, script), |(bytes, script)| {
        taken.set(taken.get() + at_once_or_step_by_step(&bytes, &script)?);
        all.set(all.get() + 1);
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    println!("{} reactions taken at once in {} charts", taken.get(), all.get());
    assert!(taken.get() * 10 > all.get(), "only {} in {} charts: the test has become empty", taken.get(), all.get());
}

pub fn cases() -> u32 {
    std::env::var("DAVIT_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000)
}

/// Both do the same with the same lines. Answers what it was: refused, never entered, or run.
/// `rounds` counts the steps in which connectors led round.
fn side_by_side(bytes: &[u8], script: &[u8], rounds: &Cell<usize>) -> Result<&'static str, TestCaseError> {
    let model = chart(bytes);
    let (compiled, findings) = compile(&model);
    let naive = Naive::new(&model).filter(|naive| !naive.has_circle(true));
    prop_assert_eq!(compiled.is_some(), naive.is_some(), "accepted by one only: {:?} {:?}", findings, model);
    let (Some(chart), Some(mut naive)) = (compiled, naive) else { return Ok("refused") };
    let mut sim = Sim::new(&chart);
    let mut outcome = "never entered";
    for (number, byte) in script.iter().enumerate() {
        let set: Vec<&str> = (0..4).filter(|bit| byte >> bit & 1 == 1).map(|bit| EVENTS[bit]).collect();
        let (text, expected) = match byte >> 4 {
            0..=2 => {
                naive.advance(i128::from(1 + byte % 4) * 400_000_000);
                (format!("advance {}", f64::from(1 + byte % 4) * 0.4), naive.step(1, &[], 10_000))
            }
            3 | 4 => ("run".to_owned(), naive.step(u64::MAX, &[], 300)),
            5 => {
                let text = format!("{} e_done@root.a nobody", set.join(" "));
                let words: Vec<&str> = text.split_whitespace().collect();
                let done = naive.step(1, &words, 10_000);
                (text, done)
            }
            _ => (set.join(" "), naive.step(1, &set, 10_000)),
        };
        rounds.set(rounds.get() + std::mem::take(&mut naive.rounds));
        // The naive one gave up: the chart does not come to rest, which other tests look at.
        let Some(idle) = expected else { return Ok("endless") };
        let seen = sim.line(&text).unwrap();
        let ours = (&seen.actions[..], &seen.active[..], &seen.queue[..], seen.transition, seen.idle);
        let active = naive.active();
        let theirs = (&naive.actions[..], &active[..], naive.queue(), naive.transition, idle);
        prop_assert_eq!(ours, theirs, "line {} `{}` of {:#?}", number, text, model);
        prop_assert_eq!(seen.mode, naive.leaf_mode());
        if !seen.active.is_empty() {
            outcome = "run";
        }
    }
    Ok(outcome)
}

#[test]
fn the_engine_does_what_the_naive_interpreter_does() {
    let (run, all, rounds) = (Cell::new(0), Cell::new(0), Cell::new(0));
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig {
        cases: cases(),
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let bytes = proptest::collection::vec(any::<u8>(), 0..220);
    let script = proptest::collection::vec(any::<u8>(), 1..16);
    let result = runner.run(&(bytes, script), |(bytes, script)| {
        let outcome = side_by_side(&bytes, &script, &rounds)?;
        all.set(all.get() + 1);
        run.set(run.get() + u32::from(outcome == "run"));
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    println!("{} of {} charts ran; connectors led round in {} steps", run.get(), all.get(), rounds.get());
    assert!(rounds.get() * 200 > all.get() as usize, "connectors led round in {} steps only", rounds.get());
    assert!(run.get() * 4 > all.get(), "only {} of {} charts ran: the test has become empty", run.get(), all.get());
}
