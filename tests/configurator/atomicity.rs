//! Whole or not at all: with something going wrong at any step, also while undoing, the system is the one before, or the
//! outcome is *broken* and its residual is exact.

#[allow(dead_code)]
#[path = "../laws/generate.rs"]
mod generate;

use crate::rig::*;
use davit::configurator::{Reason, Recovery, Requester};
use davit::model::{Catalogue, Configuration, DeploymentLimits, RunState, Snapshot, Verdict};
use davit::platform::simulated::{Fault, FaultRule, Faults, SimulatedOptions};
use davit::system::{System, step};
use proptest::prelude::*;
use std::sync::Arc;
use std::time::Duration;

const KINDS: usize = 8;

fn fault(n: usize) -> Fault {
    match n % KINDS {
        0 => Fault::Fail,
        1 => Fault::Hang { returns: None },
        2 => Fault::Hang { returns: Some(Duration::from_secs(5)) },
        3 => Fault::LostRequest,
        4 => Fault::LostAnswer,
        5 => Fault::FalseNotDone,
        6 => Fault::Panic,
        _ => Fault::FalseDone,
    }
}

fn system(snapshot: &Snapshot, catalogue: &Catalogue) -> System {
    System::from_snapshot(snapshot, Arc::new(catalogue.clone())).unwrap()
}

/// Submits `word` with these faults, and judges the end. False: the rig is of no further use.
#[track_caller]
fn judge(rig: &Rig, catalogue: &Catalogue, word: &str, faults: Faults, say: &str) -> bool {
    let before = rig.see();
    let frames = rig.frames().len();
    let lies = faults.rules.iter().any(|rule| rule.fault == Fault::FalseDone);
    let answered = rig.answers.lock().unwrap().len();
    rig.platform.set_faults(faults);
    rig.submit_as(word, Requester::Operator).unwrap();
    // Long enough for every deadline, not for a hung call to return.
    let told = |rig: &Rig| rig.answers.lock().unwrap().len() > answered;
    while !told(rig) {
        rig.wait(0.5);
    }
    let answer = rig.answers.lock().unwrap()[answered].clone();
    let seen = rig.see();
    let told = || -> Vec<String> {
        rig.progress.lock().unwrap().iter().rev().take(30).map(|told| format!("{told:?}")).collect()
    };
    match answer.verdict {
        Verdict::Ok | Verdict::Undone => {
            if !lies {
                assert_eq!(*rig.view().system.clone().unwrap(), seen, "{say}: done, and known");
            }
            if lies {
                return false;
            }
        }
        Verdict::Failed | Verdict::UndoFailed => {
            assert!(seen == before, "{say}: failed, and as before: {:#?} is {seen:?}, was {before:?}", told());
            rig.in_step();
        }
        Verdict::Broken | Verdict::UndoBroken => {
            let Some(Reason::Broken(residual)) = answer.reason.as_deref() else { panic!("{say}: {answer:?}") };
            assert!(residual.observed, "{say}");
            let mut there = system(&before, catalogue);
            // What was done and not taken back, and what differs beside.
            for step in residual.left.iter().chain(&residual.difference) {
                step::apply(step, &mut there).unwrap_or_else(|e| panic!("{say}: {step}: {e:?}"));
            }
            for component in &residual.faulted {
                assert!(there.set_state(*component, RunState::Faulted), "{say}");
            }
            assert_eq!(there.snapshot(), seen, "{say}: the residual is exact: {residual}: {:#?}", told());
            assert!(!residual.is_empty(), "{say}: broken for a reason: {residual}");
            let partial = rig.view().stack.iter().any(|frame| frame.partial);
            assert!(partial || residual.left.is_empty(), "{say}: what was left has a frame: {residual}");
            rig.in_step();
            if !rig.platform_quarantined().is_empty() {
                // A call that returns late makes it whole by itself.
                rig.wait(30.0);
            }
            if rig.platform_quarantined().is_empty() {
                let deadline = rig.clock.now() + Duration::from_secs(60);
                let outcome = rig.handle.recover(Recovery::Back, deadline).expect("an answer");
                assert!(outcome.is_ok(), "{say}: {outcome:?}");
                let undone = answer.verdict == Verdict::UndoBroken;
                // What was being undone may be undone to its end instead.
                let finished = undone && rig.frames().len() < frames;
                assert!(finished || rig.see() == before, "{say}: recovered: {:?} {:?}", rig.see(), before);
                rig.in_step();
            }
        }
        other => panic!("{say}: {other:?}"),
    }
    rig.each_answered_once();
    rig.wait(30.0);
    rig.platform_quarantined().is_empty()
}

/// The scenario, brought to where `word` may be asked for.
fn ready(word: &str) -> Rig {
    let rig = Rig::new(scenario());
    let before: &[&str] = match word {
        "make" => &[],
        "wire" => &["make"],
        "run" => &["make", "wire"],
        "five" => &["make", "wire", "run", "eight"],
        "drop" => &["make", "wire"],
        "switch.undo" => &["make", "wire", "run", "switch"],
        "make.undo" => &["make"],
        // Prepared by its first application.
        "quick" => &["make", "wire", "run", "quick", "quick.undo"],
        "quick.undo" => &["make", "wire", "run", "quick", "quick.undo", "quick"],
        _ => &["make", "wire", "run"],
    };
    for word in before {
        rig.ask_as(word, Requester::Operator);
        assert!(rig.last().verdict.is_success(), "{word}");
    }
    rig
}

const WORDS: [&str; 13] = [
    "make",
    "wire",
    "run",
    "switch",
    "rewire",
    "replace",
    "hot",
    "five",
    "drop",
    "switch.undo",
    "make.undo",
    "quick",
    "quick.undo",
];

#[test]
fn one_thing_goes_wrong_at_any_step_of_any_configuration() {
    let mut cases = 0;
    for word in WORDS {
        for kind in 0..KINDS {
            let mut rig = ready(word);
            for nth in 1.. {
                let faults = Faults::new([FaultRule::nth(nth, fault(kind))]);
                let say = format!("{word}, {:?} at {nth}", fault(kind));
                let good = judge(&rig, &catalogue(), word, faults, &say);
                cases += 1;
                let applied = rig.last().verdict.is_success();
                if applied || !good {
                    rig = ready(word);
                }
                if nth > 14 {
                    break;
                }
            }
        }
    }
    assert!(cases > 1000, "{cases}");
}

#[test]
fn something_goes_wrong_while_undoing_too() {
    for word in ["switch", "rewire", "replace", "hot", "drop", "quick", "quick.undo"] {
        for kind in 0..KINDS {
            let mut rig = ready(word);
            for nth in 2..7u64 {
                for later in 1..6 {
                    let faults =
                        Faults::new([FaultRule::nth(nth, Fault::Fail), FaultRule::nth(nth + later, fault(kind))]);
                    let say = format!("{word}, failure at {nth}, {:?} at {}", fault(kind), nth + later);
                    let good = judge(&rig, &catalogue(), word, faults, &say);
                    if rig.last().verdict.is_success() || !good {
                        rig = ready(word);
                    }
                }
            }
        }
    }
}

#[test]
fn a_lie_about_success_is_found_when_something_fails_later() {
    let rig = ready("switch");
    let before = rig.see();
    rig.platform.set_faults(Faults::new([
        FaultRule::on("property_set B.k", Fault::FalseDone).times(1),
        FaultRule::on("start B", Fault::Fail).times(1),
    ]));
    rig.submit("switch");
    rig.wait(50.0);
    assert_eq!(rig.last().verdict, Verdict::Failed);
    assert_eq!(rig.see(), before);
    rig.in_step();
}

/// Configurations that are accepted one after the other, and the types they are about.
fn accepted(types: &[generate::TypeGene], genes: &[generate::ConfigGene]) -> (Catalogue, Vec<Configuration>) {
    let catalogue = generate::catalogue(types, false);
    let mut system = System::new(catalogue.clone());
    let mut all = Vec::new();
    for gene in genes {
        let mut configuration = generate::read(gene, &system);
        configuration.id = id(&format!("k{}", all.len()));
        configuration.group = None;
        if let Ok(plan) = davit::plan::plan(&system, &configuration, &generate::context()) {
            for planned in &plan.steps {
                step::apply(&planned.step, &mut system).unwrap();
            }
            all.push(configuration);
        }
    }
    ((*catalogue).clone(), all)
}

/// Each case injects several times: 1,300 of these are more than 10,000 injections. `DAVIT_CASES` multiplies.
fn cases() -> u32 {
    1300 * std::env::var("DAVIT_CASES").ok().and_then(|n| n.parse::<u32>().ok()).unwrap_or(1)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), max_shrink_iters: 400, ..ProptestConfig::default() })]

    #[test]
    fn something_goes_wrong_in_generated_configurations(
        types in generate::types(),
        genes in generate::configs(2..7),
        what in proptest::collection::vec((1u64..14, 0..KINDS, 0u64..6, 0..KINDS), 8),
    ) {
        let (catalogue, all) = accepted(&types, &genes);
        prop_assume!(!all.is_empty());
        let last = all.last().unwrap().id.to_string();
        let make = || {
            let rig = Rig::of(
                catalogue.clone(),
                generate::context().activities,
                all.clone(),
                SimulatedOptions::default(),
                |platform| Arc::new(platform),
                DeploymentLimits::default(),
            );
            for configuration in &all[..all.len() - 1] {
                let word = configuration.id.to_string();
                // An accepted plan never meets a refusal: soundness, with a platform that is no model of ours.
                assert_eq!(rig.ask_as(&word, Requester::Operator), [format!("{word}.ok")]);
                rig.in_step();
            }
            rig
        };
        let mut rig = make();
        for (nth, first, later, second) in what {
            let mut rules = vec![FaultRule::nth(nth, fault(first))];
            if later > 0 {
                rules.push(FaultRule::nth(nth + later, fault(second)));
            }
            let say = format!("{rules:?}");
            let good = judge(&rig, &catalogue, &last, Faults::new(rules), &say);
            if rig.last().verdict == Verdict::Ok || !good {
                rig = make();
            }
        }
    }
}
