//! Whatever has gone wrong, with safe configurations in between: once nothing goes wrong any more the model is the platform, and
//! undo, newest first, with `recover` where something is broken, leads back to the beginning.

use crate::rig::*;
use davit::configurator::{Progress, Recovery, Requester};
use davit::model::{
    Catalogue, Configuration, Confirm, DeploymentLimits, Effect, Moves, OnFailure, OperationType, PropertyType,
    Tunable, Verdict,
};
use davit::platform::simulated::{Delays, Fault, FaultRule, Faults, SimulatedOptions, StepPattern};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// A node whose start and stop move, with a property that is set unconfigured and a call that moves.
fn moving() -> Catalogue {
    let plain = catalogue();
    let mut node = plain.get(davit::model::TypeName::new("Node").unwrap()).unwrap().as_ref().clone();
    node.moves = Moves { start: true, stop: true };
    let stopped: PropertyType = node.properties[&ident("s")].clone();
    node.properties.insert(ident("n"), PropertyType { tunable: Tunable::Unconfigured, ..stopped });
    for (word, undo) in [("up", "down"), ("down", "up")] {
        let operation = OperationType { moves: true, ..OperationType::new(Effect::Undo(ident(undo))) };
        node.operations.insert(ident(word), operation);
    }
    let mut catalogue = Catalogue::new();
    assert!(catalogue.insert(node).is_none());
    catalogue
}

const MAKE: &str = "make";
const PLAIN: [&str; 15] = [
    "swap", "go", "halt", "work", "lift", "tune", "write", "hold", "roll", "again", "other", "left", "right", "meant",
    "tried",
];
const SAFE: [&str; 4] = ["rest", "quiet", "slow", "brake"];

fn configurations() -> Vec<Configuration> {
    let mut all = vec![
        configuration(MAKE, "", "create A; create B; create C", "A:running B:stopped C:running"),
        configuration("swap", "B:unconfigured", "set B.n 4", "B:running"),
        configuration("go", "", "", "B:running"),
        configuration("halt", "", "", "A:stopped"),
        configuration("work", "A:stopped", "set A.s 2; call C.open", "A:running"),
        configuration("lift", "", "call A.up", ""),
        configuration("tune", "", "set A.k 7; set B.k 8", ""),
        configuration("write", "", "write C.w 4; set C.k 3", ""),
        configuration("hold", "C:unconfigured", "set C.n 5; call B.open", "C:running"),
        configuration("roll", "C:stopped", "set C.s 5; call A.up", "C:running"),
        configuration("again", "", "destroy C; create C", "C:running"),
        configuration("other", "", "write A.u 2; write B.u 3; connect A.y B.w", ""),
        configuration("left", "", "set A.k 4; call B.open", "B:running"),
        configuration("right", "A:stopped", "set A.k 6; set A.s 6", "A:running"),
        configuration("meant", "", "set C.k 2; call A.up", ""),
        configuration("tried", "", "set A.k 2; write C.w 2", "B:running"),
        configuration("rest", "", "", "A:stopped B:stopped"),
        configuration("quiet", "", "", "_default:stopped"),
        configuration("slow", "", "set A.k 9; set B.k 9; write C.w 0", ""),
        configuration("brake", "", "call A.down; set C.k 9", "C:stopped"),
    ];
    for configuration in &mut all {
        let word = configuration.id.as_str();
        configuration.group = ["left", "right"].contains(&word).then(|| ident("side"));
        configuration.confirm = ["meant", "tried"]
            .contains(&word)
            .then(|| Confirm { event: event("e_good"), within: Duration::from_millis(400) });
        configuration.safe = SAFE.contains(&configuration.id.as_str());
        configuration.on_failure = match configuration.id.as_str() {
            "hold" => OnFailure::Hold,
            "roll" | "meant" => OnFailure::Rollback,
            _ => OnFailure::default(),
        };
    }
    all
}

const STEPS: [&str; 20] = [
    "start A",
    "stop A",
    "start B",
    "stop B",
    "cleanup B",
    "configure B",
    "start C",
    "stop C",
    "cleanup C",
    "configure C",
    "create C",
    "destroy C",
    "property_set A.k",
    "property_set B.n",
    "property_set A.s",
    "port_write C.w",
    "operation_call A.up",
    "operation_call A.down",
    "operation_call C.open",
    "operation_call B.close",
];

fn fault(kind: usize) -> Fault {
    let seconds = Duration::from_secs_f64;
    match kind {
        0 => Fault::Fail,
        1 => Fault::LostRequest,
        2 => Fault::LostAnswer,
        3 => Fault::Slow(seconds(0.25)),
        4 => Fault::Slow(seconds(0.7)),
        5 => Fault::Hang { returns: Some(seconds(2.0)) },
        6 => Fault::Deaf,
        7 => Fault::FalseDone,
        8 => Fault::FalseNotDone,
        _ => Fault::Panic,
    }
}

/// What is done, and how long is waited then.
#[derive(Debug, Clone, Copy)]
enum Act {
    Apply(usize),
    Undo(usize),
    Safe(usize),
    UndoSafe(usize),
    /// One is undone and another applied, in one step.
    Instead(usize, usize),
    /// An operator's, who means it.
    Operator(usize),
    OperatorUndo(usize),
    /// The configurator's thread panics, so many times in one moment.
    Panic(usize),
    /// Whoever listens to it does, after so many tellings.
    Trap(usize),
}

impl Act {
    fn word(self) -> String {
        match self {
            Self::Apply(n) | Self::Operator(n) => PLAIN[n].to_owned(),
            Self::Instead(a, b) => format!("{}.undo {}", PLAIN[a], PLAIN[b]),
            Self::Undo(n) | Self::OperatorUndo(n) => format!("{}.undo", PLAIN[n]),
            Self::Safe(n) => SAFE[n].to_owned(),
            Self::UndoSafe(n) => format!("{}.undo", SAFE[n]),
            Self::Panic(_) | Self::Trap(_) => String::new(),
        }
    }
}

fn acts() -> impl Strategy<Value = Vec<(Act, usize)>> {
    let act = prop_oneof![
        4 => (0..PLAIN.len()).prop_map(Act::Apply),
        2 => (0..PLAIN.len()).prop_map(Act::Undo),
        3 => (0..SAFE.len()).prop_map(Act::Safe),
        2 => (0..SAFE.len()).prop_map(Act::UndoSafe),
        1 => (0..PLAIN.len(), 0..PLAIN.len()).prop_map(|(a, b)| Act::Instead(a, b)),
        1 => (0..PLAIN.len()).prop_map(Act::Operator),
        1 => (0..PLAIN.len()).prop_map(Act::OperatorUndo),
    ];
    prop::collection::vec((act, 0usize..6), 1..6)
}

/// The same, with panics in between.
fn acts_and_panics() -> impl Strategy<Value = Vec<(Act, usize)>> {
    let panic = prop_oneof![1 => Just(Act::Panic(1)), 1 => Just(Act::Panic(9)), 3 => (1usize..30).prop_map(Act::Trap)];
    let panics = prop::collection::vec((0usize..6, panic, 0usize..6), 1..4);
    (acts(), panics).prop_map(|(mut acts, panics)| {
        for (at, panic, wait) in panics {
            acts.insert(at.min(acts.len()), (panic, wait));
        }
        acts
    })
}

/// What has come of it so far, for whoever has to find out why.
fn told(rig: &Rig) -> String {
    let told = rig.answers.lock().unwrap();
    let lines = told.iter().map(|answer| {
        format!(
            "{:?} {} {}",
            answer.at,
            answer.event(),
            answer.reason.as_deref().map(ToString::to_string).unwrap_or_default()
        )
    });
    let view = rig.view();
    let broken: Vec<String> = view.residuals.iter().map(ToString::to_string).collect();
    let frames: Vec<String> = view
        .stack
        .iter()
        .map(|f| format!("{}{}", f.configuration, if f.partial { " (partial)" } else { "" }))
        .collect();
    let steps = rig
        .progress
        .lock()
        .unwrap()
        .iter()
        .filter_map(|told| match told {
            Progress::Ended { request, step, end, undoing, .. } => {
                Some(format!("{} {}{step} {end:?}", request.0, if *undoing { "undo " } else { "" }))
            }
            Progress::Differs(of) => Some(format!("differs: {of}")),
            _ => None,
        })
        .collect::<Vec<_>>();
    let lines = lines.collect::<Vec<_>>().join("\n");
    format!("{lines}\nframes {frames:?}\nbroken {broken:?}\n{}", steps.join("\n"))
}

fn leads_out(acts: &[(Act, usize)], faults: &[(usize, usize, u32)]) -> Result<&'static str, TestCaseError> {
    let limits = DeploymentLimits { step_timeout: Duration::from_millis(500), ..DeploymentLimits::default() };
    let of = [("start", 0.1), ("stop", 0.05), ("cleanup", 0.05), ("configure", 0.1), ("operation_call", 0.3)];
    let of = of.map(|(pattern, seconds)| (StepPattern::new(pattern), Duration::from_secs_f64(seconds))).to_vec();
    let options = SimulatedOptions { delays: Delays { of, ..Delays::default() }, ..SimulatedOptions::default() };
    let rig = Rig::of(moving(), BTreeSet::new(), configurations(), options, |platform| Arc::new(platform), limits);
    let start = rig.see();
    prop_assert_eq!(rig.ask(MAKE), ["make.ok"]);
    let rules = faults.iter().map(|(step, kind, times)| FaultRule::on(STEPS[*step], fault(*kind)).times(*times));
    rig.platform.set_faults(Faults::new(rules.collect::<Vec<_>>()));
    for (act, wait) in acts {
        let operator = matches!(act, Act::Operator(_) | Act::OperatorUndo(_));
        let by = if operator { Requester::Operator } else { coordinator(COORDINATOR) };
        match act {
            Act::Panic(times) => (0..*times).for_each(|_| assert!(rig.handle.inject_panic())),
            Act::Trap(tellings) => rig.trap.store(*tellings, Ordering::SeqCst),
            _ => rig.submit_as(&act.word(), by).unwrap(),
        }
        rig.wait([0.0, 0.02, 0.12, 0.3, 1.0, 8.0][*wait]);
    }
    // Whatever is out comes back or is given up, and what was lied about is seen.
    rig.wait(30.0);
    rig.trap.store(0, Ordering::SeqCst);
    rig.platform.set_faults(Faults::default());
    rig.platform.set_delays(Delays::default());
    rig.wait(30.0);
    rig.each_answered_once();
    prop_assert!(rig.platform_quarantined().is_empty());
    let (mut known, mut seen) = ((*rig.view().system.clone().unwrap()).clone(), rig.see());
    for residual in &rig.view().residuals {
        for component in residual.components() {
            for snapshot in [&mut known, &mut seen] {
                snapshot.components.remove(&component);
                snapshot.ports.retain(|port, _| port.component != component);
                snapshot.connections.retain(|(from, to), _| from.component != component && to.component != component);
            }
        }
    }
    prop_assert_eq!(known, seen, "but for what is broken the model is the platform: {}", told(&rig));
    let bad = rig.answers.lock().unwrap().iter().any(|a| matches!(a.verdict, Verdict::Broken | Verdict::UndoBroken));
    let broken = bad || !rig.view().residuals.is_empty();
    // A round: undo the newest frame; where that is refused, have what is broken repaired, by the undo of whose it is or else
    // by who recovers.
    let standing = |rig: &Rig| (rig.frames(), rig.view().residuals.iter().map(ToString::to_string).collect::<Vec<_>>());
    while let (frames, residuals) = standing(&rig)
        && !frames.is_empty()
    {
        let top = frames.last().expect("there is one");
        let answers = rig.ask_as(&format!("{top}.undo"), Requester::Operator);
        let gone = rig.frames().len() < frames.len();
        prop_assert!(broken || gone && answers == [format!("{top}.undone")], "{answers:?}: {}", told(&rig));
        if !gone {
            prop_assert!(!residuals.is_empty(), "`{top}` stays, and nothing is broken: {}", told(&rig));
            for frame in frames.iter().rev().skip(1) {
                rig.ask_as(&format!("{frame}.undo"), Requester::Operator);
            }
            let _ = rig.handle.recover(Recovery::Back, rig.clock.now() + Duration::from_secs(60)).expect("an answer");
            prop_assert!(standing(&rig) != (frames, residuals), "no way out: {}", told(&rig));
        }
    }
    prop_assert!(rig.frames().is_empty(), "{}", told(&rig));
    prop_assert!(rig.view().residuals.is_empty(), "{}", told(&rig));
    let end = rig.see();
    prop_assert_eq!(end, start, "{}", told(&rig));
    let safe = acts.iter().any(|(act, _)| matches!(act, Act::Safe(_)));
    Ok(match (broken, safe) {
        (true, true) => "broken, with a safe configuration",
        (true, false) => "broken",
        (false, true) => "whole, with a safe configuration",
        (false, false) => "whole",
    })
}

#[test]
fn there_is_a_way_out_of_whatever_goes_wrong() {
    let met = runs(acts());
    let (of, least) = (met.values().sum::<u32>(), met.values().min());
    assert!(met.len() == 4 && least >= Some(&(of / 50)), "{met:?}");
}

/// Also where the configurator itself fails, in the middle of whatever it does: what was done is in partial frames.
#[test]
fn there_is_a_way_out_of_panics() {
    let met = runs(acts_and_panics());
    assert!(met.len() == 4, "{met:?}");
}

/// Runs the law, and tells what was met how often.
fn runs(acts: impl Strategy<Value = Vec<(Act, usize)>>) -> BTreeMap<&'static str, u32> {
    let long = std::env::var("DAVIT_WAY_OUT_CASES").ok().and_then(|n| n.parse().ok());
    let cases = long.unwrap_or(400);
    let met = std::cell::RefCell::new(BTreeMap::<&str, u32>::new());
    let faults = prop::collection::vec((0..STEPS.len(), 0usize..10, 1u32..3), 0..4);
    // The same cases each time. Who asks for a number of them gets others.
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    let mut runner = match long {
        Some(_) => TestRunner::new(config),
        None => TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha)),
    };
    let ran = runner.run(&(acts, faults), |(acts, faults)| {
        *met.borrow_mut().entry(leads_out(&acts, &faults)?).or_default() += 1;
        Ok(())
    });
    ran.unwrap_or_else(|failed| panic!("{failed}"));
    met.into_inner()
}

/// What the law has found, each as small as it could be made.
#[test]
fn there_is_a_way_out_of_what_was_found() {
    let place = |of: &[&str], word: &str| of.iter().position(|one| *one == word).unwrap();
    let apply = |word: &str| Act::Apply(place(&PLAIN, word));
    let safe = |word: &str| Act::Safe(place(&SAFE, word));
    let on = |step: &str, kind: usize| (place(&STEPS, step), kind, 1);
    let (fails, late, lie, silent, panic) = (0, 4, 7, 8, 9);
    let found = [
        // `_default` is about what another safe configuration under way is about.
        (vec![(safe("rest"), 0), (safe("quiet"), 0)], vec![]),
        // Mending brings what was demanded stopped down to where a property may be set, and back.
        (vec![(safe("rest"), 0), (apply("halt"), 0), (apply("swap"), 0)], vec![on("start B", late)]),
        // A partial frame does not undo what the safe configuration above it does.
        (vec![(apply("roll"), 0), (apply("swap"), 2), (safe("quiet"), 0)], vec![]),
        // What was cleaned up after a fault is not brought down once more.
        (vec![(safe("slow"), 0), (apply("hold"), 0)], vec![on("port_write C.w", panic)]),
        // Interrupted while it was mended: that is done.
        (vec![(apply("swap"), 3), (safe("quiet"), 0)], vec![on("configure B", silent)]),
        // What is gone is made again, though a safe configuration had demanded its run state.
        (vec![(apply("again"), 0), (apply("swap"), 2), (safe("quiet"), 0)], vec![on("create C", late)]),
        // A partial frame stands above a safe configuration that had not interrupted it.
        (vec![(safe("quiet"), 0), (apply("hold"), 0)], vec![on("start C", late)]),
        // What a safe configuration took for stopped is stopped for it.
        (vec![(apply("work"), 2), (safe("rest"), 0)], vec![on("stop A", lie)]),
        // A safe configuration has nothing to take back of what was taken away under it.
        (vec![(apply("again"), 2), (safe("slow"), 0)], vec![on("create C", late)]),
        // Mending that broke off goes on to where it should be.
        (vec![(apply("roll"), 2), (safe("rest"), 0)], vec![on("stop C", panic)]),
        // What was undone of a safe frame, and another safe configuration has done again, is still to be undone.
        (vec![(safe("brake"), 4), (Act::UndoSafe(place(&SAFE, "brake")), 2), (safe("quiet"), 0)], vec![]),
        // What a safe configuration wants stopped is stopped, though something else that came up with it stays.
        (vec![(safe("quiet"), 2), (Act::UndoSafe(place(&SAFE, "quiet")), 1), (safe("brake"), 0)], vec![]),
        // What a safe configuration had not stopped is stopped by the next, and started again by the undo of the first.
        (vec![(safe("quiet"), 0), (apply("swap"), 5), (safe("quiet"), 0)], vec![on("stop C", lie)]),
        (
            vec![(safe("brake"), 2), (Act::Undo(0), 2), (apply("hold"), 4), (safe("quiet"), 0)],
            vec![on("configure C", 2), (place(&STEPS, "stop C"), lie, 2)],
        ),
        (
            vec![(safe("quiet"), 0), (apply("again"), 0), (apply("swap"), 5), (safe("quiet"), 0)],
            vec![on("start C", silent), (place(&STEPS, "stop A"), late, 2)],
        ),
        // What is half undone of a safe configuration is no longer kept as that wanted it.
        (
            vec![(safe("quiet"), 0), (Act::UndoSafe(place(&SAFE, "quiet")), 0)],
            vec![on("start C", lie), on("start A", fails)],
        ),
        // What was being mended when a safe configuration came is known to it as it was before it failed.
        (
            vec![
                (Act::Operator(place(&PLAIN, "roll")), 0),
                (apply("swap"), 3),
                (Act::UndoSafe(0), 3),
                (safe("rest"), 0),
            ],
            vec![on("operation_call A.up", panic)],
        ),
        // What was found otherwise, and was being mended when a safe configuration came, is otherwise still.
        (vec![(apply("roll"), 2), (safe("rest"), 0)], vec![on("stop C", silent), on("start C", fails)]),
        // What was done though the platform said that it was not is mended before what is left is taken back.
        (vec![(Act::Operator(place(&PLAIN, "again")), 3), (safe("slow"), 0)], vec![on("start C", silent)]),
        // What is left of one request, and was brought about by mending what was left of another, is left no more.
        (vec![(apply("halt"), 2), (Act::Instead(2, 12), 5)], vec![(place(&STEPS, "start A"), 1, 2)]),
        // What a panic has broken off goes back all the same where a safe configuration interrupts it.
        (
            vec![
                (Act::Undo(0), 0),
                (Act::Operator(place(&PLAIN, "again")), 2),
                (Act::Panic(1), 0),
                (Act::Safe(place(&SAFE, "quiet")), 0),
            ],
            vec![],
        ),
        // However often it panics, what a call may have done is not forgotten.
        (vec![(apply("lift"), 2), (Act::Panic(9), 0)], vec![]),
        // What whoever listens fails at is lost, and nothing else.
        (vec![(Act::Trap(9), 0), (Act::Instead(0, 9), 0)], vec![on("create C", 1)]),
        (
            vec![
                (Act::Panic(1), 1),
                (Act::Trap(9), 0),
                (Act::Instead(0, 7), 2),
                (Act::UndoSafe(0), 0),
                (Act::Safe(0), 0),
            ],
            vec![],
        ),
        (vec![(Act::Apply(0), 0), (Act::Trap(4), 0), (apply("tune"), 0), (Act::Apply(0), 0)], vec![]),
        // What is half undone of a safe configuration, and a panic has broken off, is mended with the rest of its undo.
        (
            vec![(safe("brake"), 1), (Act::Trap(10), 0), (safe("rest"), 0), (Act::UndoSafe(place(&SAFE, "brake")), 0)],
            vec![on("start C", lie)],
        ),
    ];
    for (acts, faults) in found {
        leads_out(&acts, &faults).unwrap_or_else(|failed| panic!("{acts:?} {faults:?}: {failed}"));
    }
}
