//! The law of claims (semantics: *Laws*): requests that are carried out at the same time end in the same system, with the same
//! answers, as one after the other in the order of their answers.

use crate::rig::*;
use davit::configurator::Requester;
use davit::model::{Configuration, Confirm, DeploymentLimits};
use davit::platform::simulated::{Delays, Fault, FaultRule, Faults, SimulatedOptions, StepPattern};
use proptest::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Some alone on a component, some across two, a group, some that need a run state, and what changes connections.
fn configurations() -> Vec<Configuration> {
    let group = |name: &str, changes: &str| Configuration {
        group: Some(ident("gain")),
        ..configuration(name, "", changes, "")
    };
    vec![
        configuration("make", "", "create A; create B; create C; create D", "_default:running"),
        configuration("a1", "", "set A.k 1; call A.open", ""),
        configuration("a2", "A:stopped", "set A.s 2", "A:running"),
        configuration("b1", "", "set B.k 1", ""),
        configuration("b2", "B:stopped", "set B.s 2", "B:running"),
        configuration("c1", "", "call C.look; write C.w 1", ""),
        configuration("c2", "C:stopped", "set C.s 1", ""),
        configuration("d1", "", "set D.k 1; set D.k 1", ""),
        configuration("ab", "", "connect A.y B.u", ""),
        configuration("cd", "", "connect C.y D.u; set D.k 4", ""),
        configuration("cut", "", "disconnect C.y D.u", ""),
        group("low", "set A.k 3"),
        group("high", "set B.k 4"),
        configuration("fails", "", "set C.k 9", ""),
    ]
}

const IDS: [&str; 13] = ["a1", "a2", "b1", "b2", "c1", "c2", "d1", "ab", "cd", "cut", "low", "high", "fails"];
const REQUESTERS: usize = 3;

fn requester(n: usize) -> Requester {
    if n == 0 { Requester::Operator } else { coordinator(&format!("c{n}")) }
}

/// What is asked for: by whom, what, and how many milliseconds after the one before.
#[derive(Debug, Clone)]
struct Asked {
    by: usize,
    words: Vec<String>,
    after: u64,
}

fn asked() -> impl Strategy<Value = Asked> {
    let word = (0..IDS.len(), prop::bool::weighted(0.35))
        .prop_map(|(at, undo)| if undo { format!("{}.undo", IDS[at]) } else { IDS[at].to_owned() });
    let words = prop::collection::vec(word, 1..3);
    (0..REQUESTERS, words, 0..600u64).prop_map(|(by, words, after)| Asked { by, words, after })
}

fn rig(delays: Delays) -> Rig {
    let limits = DeploymentLimits { step_timeout: Duration::from_secs(30), ..DeploymentLimits::default() };
    let rig = Rig::full(
        configurations(),
        SimulatedOptions { delays, ..SimulatedOptions::default() },
        |platform| Arc::new(platform),
        limits,
    );
    assert_eq!(rig.ask("make"), ["make.ok"]);
    rig.platform.set_faults(Faults::new([FaultRule::on("property_set C.k = 9.0", Fault::Fail)]));
    rig
}

/// Who was answered what, in order, since `make`.
fn told(rig: &Rig) -> Vec<(Requester, String)> {
    let answers = rig.answers.lock().unwrap();
    answers[1..].iter().map(|answer| (answer.request.requester, answer.event().to_string())).collect()
}

#[test]
fn what_is_carried_out_at_the_same_time_ends_as_one_after_the_other() {
    let (compared, overlapped) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let cases = 250;
    let delays = prop::collection::vec(0..500u64, 4);
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig {
        cases,
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let result = runner.run(&(prop::collection::vec(asked(), 2..9), delays), |(all, delays)| {
        let of = |(at, ms): (usize, &u64)| {
            let component = ["A", "B", "C", "D"][at];
            let time = Duration::from_millis(*ms);
            ["property_set", "stop", "operation_call", "port_write"]
                .map(|verb| (StepPattern::new(&format!("{verb} {component}")), time))
        };
        // A pattern ends at a word's end: members are named.
        let mut slow: Vec<(StepPattern, Duration)> = delays.iter().enumerate().flat_map(of).collect();
        for (at, ms) in delays.iter().enumerate() {
            let component = ["A", "B", "C", "D"][at];
            for member in ["k", "s", "w", "open", "look"] {
                for verb in ["property_set", "operation_call", "port_write"] {
                    slow.push((StepPattern::new(&format!("{verb} {component}.{member}")), Duration::from_millis(*ms)));
                }
            }
        }
        let together = rig(Delays::default());
        together.platform.set_delays(Delays { of: slow, ..Delays::default() });
        for one in &all {
            together.wait(one.after as f64 / 1000.0);
            if together.submitted.lock().unwrap().len() > together.answers.lock().unwrap().len() {
                overlapped.fetch_add(1, Ordering::Relaxed);
            }
            together.submit_as(&one.words.join(" "), requester(one.by)).unwrap();
        }
        together.wait(100.0);
        together.each_answered_once();
        let answers = told(&together);
        // What was given up or overtaken depends on when it was.
        if answers.iter().any(|(_, event)| event.ends_with(".cancelled")) {
            return Ok(());
        }
        compared.fetch_add(1, Ordering::Relaxed);
        let alone = rig(Delays::default());
        for (by, event) in &answers {
            let word = event.strip_suffix(".undo.failed").map(|id| format!("{id}.undo"));
            let word = word.or_else(|| event.strip_suffix(".undone").map(|id| format!("{id}.undo")));
            let word = word.unwrap_or_else(|| event.rsplit_once('.').unwrap().0.to_owned());
            alone.ask_as(&word, *by);
        }
        prop_assert_eq!(&told(&alone), &answers);
        prop_assert_eq!(alone.frames(), together.frames());
        prop_assert_eq!(alone.see(), together.see());
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    let (compared, overlapped) = (compared.into_inner(), overlapped.into_inner());
    assert!(compared > 100 && overlapped > 150, "{compared} compared, {overlapped} came while something was under way");
}

/// All operators are one requester: what one connection is applying has its place on the stack, and counts for another one.
#[test]
fn what_operators_push_at_once_has_no_more_places_than_there_are() {
    let waits = Configuration {
        confirm: Some(Confirm { event: event("e_fine"), within: Duration::from_secs(1000) }),
        ..configuration("waits", "", "set A.k 1", "")
    };
    let all = vec![
        configuration("make", "", "create A; create B; create C", ""),
        waits,
        configuration("b", "", "set B.k 1", ""),
        configuration("c", "", "set C.k 1", ""),
        Configuration { group: Some(ident("gain")), ..configuration("one", "", "set B.k 2", "") },
        Configuration { group: Some(ident("gain")), ..configuration("two", "", "set B.k 3", "") },
    ];
    let limits = DeploymentLimits { stack: 2, ..DeploymentLimits::default() };
    let delays = || Delays { base: Duration::from_millis(500), ..Delays::default() };
    let options = || SimulatedOptions { delays: delays(), ..SimulatedOptions::default() };
    let rig = Rig::full(all.clone(), options(), |platform| Arc::new(platform), limits);
    assert_eq!(rig.ask("make"), ["make.ok"]);
    // Neither of two can be squashed: one waits for its confirmation, and the other one is the newest.
    assert_eq!(rig.ask_as("waits", Requester::Operator), ["waits.ok"]);
    rig.submit_as("b", Requester::Operator).unwrap();
    rig.submit_as("c", Requester::Operator).unwrap();
    // Another requester has places of its own.
    rig.submit("one");
    rig.wait(100.0);
    assert_eq!(rig.events()[2..], ["c.failed", "b.ok", "one.ok"]);
    let told = rig.view();
    assert_eq!(told.stack.iter().filter(|frame| frame.by == Requester::Operator).count(), 2, "{:?}", rig.frames());
    rig.each_answered_once();

    // A group's frame leaves its place to the one that comes for it.
    let rig = Rig::full(all, options(), |platform| Arc::new(platform), limits);
    assert_eq!(rig.ask("make"), ["make.ok"]);
    assert_eq!(rig.ask_as("one", Requester::Operator), ["one.ok"]);
    rig.submit_as("two", Requester::Operator).unwrap();
    rig.submit_as("waits", Requester::Operator).unwrap();
    rig.wait(100.0);
    assert_eq!(rig.events()[2..], ["two.ok", "waits.ok"]);
}

/// One request with more slow steps than there are workers leaves one to whoever else begins.
#[test]
fn no_request_takes_all_workers() {
    let six = ["B", "C", "D", "E", "F", "G"];
    let list = |verb: &str, after: &str, of: &[&str]| {
        of.iter().map(|name| format!("{verb} {name}{after}")).collect::<Vec<_>>().join("; ")
    };
    let all: Vec<&str> = std::iter::once("A").chain(six).collect();
    let rig = Rig::new(vec![
        configuration("make", "", &list("create", "", &all), "_default:stopped"),
        configuration("many", "", &list("call", ".open", &six), ""),
        configuration("one", "", "call A.open", ""),
    ]);
    assert_eq!(rig.ask("make"), ["make.ok"]);
    let of = vec![(StepPattern::new("operation_call"), Duration::from_secs(1))];
    let limits = Delays { of, ..Delays::default() };
    rig.platform.set_delays(limits);
    let asked = rig.clock.now();
    rig.submit("many");
    rig.submit_as("one", coordinator("c2")).unwrap();
    rig.wait(20.0);
    let answers = rig.answers.lock().unwrap().clone();
    let at = |word: &str| {
        answers.iter().find(|answer| answer.event().to_string() == word).expect("it is answered").at.since(asked)
    };
    assert_eq!(at("one.ok"), Duration::from_secs(1), "it begins at once");
    assert_eq!(at("many.ok"), Duration::from_secs(2), "the others go on in parallel");
}
