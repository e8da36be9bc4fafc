//! A fault at every step of a bring-up: what fails or panics leaves nothing behind, what hangs leaves itself at most.

use super::life::checked;
use davit::app;
use davit::platform::Platform;
use davit::platform::simulated::{Fault, FaultRule, Faults, Simulated, SimulatedOptions};
use davit::session::{NotUp, Phase};
use davit::time::Clock;
use std::sync::Arc;
use std::time::Duration;

/// How a bring-up ended whose `nth` step went wrong; none: it had fewer steps.
struct End {
    not_up: Option<NotUp>,
    left: usize,
    quarantined: usize,
    /// What was left a minute later.
    left_later: usize,
}

fn bring_up(nth: u64, fault: Fault) -> Option<End> {
    let checked = checked("deployments/generic_arm.yaml");
    let clock = Clock::simulated();
    let _me = clock.enter();
    let faults = Faults::new([FaultRule::nth(nth, fault)]);
    let platform = Arc::new(Simulated::new(
        checked.catalogue.clone(),
        clock.clone(),
        SimulatedOptions { faults, ..SimulatedOptions::default() },
    ));
    let session = app::start_on(&checked, platform.clone(), &clock);
    let not_up = session.bring_up().err();
    if not_up.is_none() {
        let beyond = platform.asked() < nth;
        session.take_down(false);
        clock.shutdown();
        // A fault that the bring-up survives (a late answer, say) is as good as none.
        return if beyond { None } else { Some(End { not_up: None, left: 0, quarantined: 0, left_later: 0 }) };
    }
    let observe = || platform.observe(clock.now() + Duration::from_secs(1)).unwrap().components.len();
    let (left, quarantined) = (observe(), platform.quarantined().len());
    clock.sleep(Duration::from_secs(60));
    let left_later = observe();
    clock.shutdown();
    Some(End { not_up, left, quarantined, left_later })
}

fn every_step(fault: &Fault, look: impl Fn(u64, &End)) -> u64 {
    let mut failed = 0;
    for nth in 1.. {
        let Some(end) = bring_up(nth, fault.clone()) else {
            assert!(nth > 20, "the bring-up has more steps than {nth}");
            return failed;
        };
        failed += u64::from(end.not_up.is_some());
        look(nth, &end);
    }
    unreachable!("a bring-up has an end")
}

#[test]
fn a_failure_at_any_step_leaves_nothing_behind() {
    let failed = every_step(&Fault::Fail, |nth, end| {
        let not_up = end.not_up.as_ref().unwrap_or_else(|| panic!("step {nth} failed and nobody noticed"));
        assert!(not_up.ended.is_clean(), "step {nth}: {not_up:?}");
        assert_eq!(not_up.ended.phase, Phase::Down);
        assert_eq!((end.left, end.quarantined), (0, 0), "step {nth}");
        assert!(!not_up.reasons.is_empty(), "step {nth} failed without a reason");
    });
    assert!(failed > 20, "{failed}");
}

#[test]
fn a_panic_at_any_step_leaves_nothing_behind() {
    let failed = every_step(&Fault::Panic, |nth, end| {
        let not_up = end.not_up.as_ref().unwrap_or_else(|| panic!("step {nth} panicked and nobody noticed"));
        assert!(not_up.ended.is_clean(), "step {nth}: {not_up:?}");
        assert_eq!((end.left, end.quarantined), (0, 0), "step {nth}");
    });
    assert!(failed > 20, "{failed}");
}

#[test]
fn a_hang_at_any_step_leaves_at_most_the_hung_component() {
    let failed = every_step(&Fault::Hang { returns: None }, |nth, end| {
        let Some(not_up) = &end.not_up else { return };
        assert_eq!(end.quarantined, 1, "step {nth}");
        assert!(end.left <= 1, "step {nth}: {} left", end.left);
        assert!(!not_up.ended.is_clean(), "step {nth}: a hung component is left, and nobody says so");
        assert_eq!(not_up.ended.phase, Phase::Broken, "step {nth}");
        assert!(not_up.ended.left.iter().any(|line| line.contains("quarantined")), "step {nth}: {not_up:?}");
    });
    assert!(failed > 10, "{failed}");
}

#[test]
fn a_hang_that_returns_late_leaves_nothing_at_all() {
    let returns = Some(Duration::from_secs(30));
    let failed = every_step(&Fault::Hang { returns }, |nth, end| {
        if end.not_up.is_some() {
            assert_eq!(end.left_later, 0, "step {nth}: something is left after the call returned");
        }
    });
    assert!(failed > 10, "{failed}");
}

#[test]
fn a_lost_answer_at_any_step_is_settled_or_rolled_back() {
    for fault in [Fault::LostAnswer, Fault::LostRequest] {
        every_step(&fault, |nth, end| {
            if let Some(not_up) = &end.not_up {
                assert_eq!(end.left, 0, "step {nth}: {not_up:?}");
            }
        });
    }
}
