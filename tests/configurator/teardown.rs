//! Taking everything down.

use crate::rig::*;
use davit::configurator::TakenDown;
use davit::model::{RunState, Step};
use davit::platform::simulated::{Delays, Fault, FaultRule, Faults, StepPattern};
use std::time::Duration;

fn up() -> Rig {
    let rig = Rig::new(scenario());
    for word in ["make", "wire", "run", "switch"] {
        assert_eq!(rig.ask(word), [format!("{word}.ok")]);
    }
    rig
}

fn down(rig: &Rig, forced: bool) -> TakenDown {
    let deadline = rig.clock.now() + Duration::from_secs(30);
    let answer = if forced { rig.handle.force_down(deadline) } else { rig.handle.unwind(deadline) };
    answer.recv_deadline(deadline + Duration::from_secs(30)).expect("it is told how it ended")
}

#[test]
fn unwinding_pops_every_frame() {
    let rig = up();
    let told = down(&rig, false);
    assert!(told.is_clean() && told.in_time && told.observed, "{told:?}");
    assert_eq!(told.popped.iter().map(|c| c.as_str()).collect::<Vec<_>>(), ["switch", "run", "wire", "make"]);
    assert!(told.forced.is_empty(), "{:?}", told.forced);
    assert!(rig.see().is_empty());
    assert!(rig.view().stack.is_empty());
}

#[test]
fn what_cannot_be_popped_is_removed() {
    let rig = up();
    rig.platform.set_faults(Faults::new([FaultRule::on("port_write C.w", Fault::Fail).times(1)]));
    let told = down(&rig, false);
    assert!(told.is_clean(), "{told:?}");
    assert!(!told.forced.is_empty() && !told.troubles.is_empty(), "{told:?}");
    assert!(rig.see().is_empty());
}

#[test]
fn by_force_the_safe_configurations_come_first() {
    let rig = up();
    rig.platform.record();
    let told = down(&rig, true);
    assert_eq!(told.safe, [id("quiet")]);
    assert!(told.is_clean(), "{told:?}");
    let steps = rig.platform.record();
    let first: Vec<String> = steps.iter().take(3).map(ToString::to_string).collect();
    assert!(first.iter().all(|step| step.starts_with("stop")), "{first:?}");
    assert!(matches!(steps.last(), Some(Step::Destroy { .. })));
    assert!(rig.see().is_empty());
}

#[test]
fn what_is_under_way_gives_way_and_everything_is_answered() {
    let rig = up();
    rig.platform.set_faults(Faults::new([FaultRule::on("property_set A.k", Fault::LostRequest).times(1)]));
    rig.submit("eight");
    rig.wait(0.1);
    rig.submit("rewire");
    let told = down(&rig, true);
    assert!(told.is_clean(), "{told:?}");
    assert_eq!(rig.events()[4..], ["eight.broken", "rewire.failed"]);
    rig.each_answered_once();
}

/// What stands behind in a batch and has not begun is not begun by taking down.
#[test]
fn what_had_not_begun_does_not_begin() {
    for forced in [false, true] {
        let rig = up();
        rig.platform.set_delays(Delays {
            of: vec![(StepPattern::new("property_set"), Duration::from_secs(1))],
            ..Delays::default()
        });
        rig.platform.record();
        rig.submit("eight rewire");
        rig.wait(0.1);
        down(&rig, forced);
        let steps: Vec<String> = rig.platform.record().iter().map(ToString::to_string).collect();
        assert!(!steps.iter().any(|step| step.starts_with("connect A.y -> C.u")), "{steps:?}");
        rig.each_answered_once();
    }
}

#[test]
fn a_hung_component_is_named_and_goes_when_it_returns() {
    for returns in [None, Some(Duration::from_secs(60))] {
        let rig = up();
        rig.platform.set_faults(Faults::new([FaultRule::on("stop C", Fault::Hang { returns }).times(1)]));
        let told = down(&rig, true);
        assert_eq!(told.quarantined, [name("C")]);
        assert_eq!(told.left.components.keys().copied().collect::<Vec<_>>(), [name("C")], "{told:?}");
        assert_eq!(told.left.components[&name("C")].state, RunState::Running);
        assert!(rig.view().broken.is_some());
        rig.wait(100.0);
        assert_eq!(rig.see().is_empty(), returns.is_some(), "nothing at all, if it returns");
        assert_eq!(rig.view().broken.is_none(), returns.is_some());
    }
}

#[test]
fn a_panicking_component_is_removed() {
    let rig = up();
    rig.platform.set_faults(Faults::new([FaultRule::on("stop", Fault::Panic)]));
    let told = down(&rig, true);
    rig.platform.set_faults(Faults::default());
    assert!(told.is_clean(), "faulted components can be destroyed: {told:?}");
}

#[test]
fn it_can_be_deployed_again() {
    let rig = up();
    assert!(down(&rig, false).is_clean());
    for word in ["make", "wire", "run"] {
        assert_eq!(rig.ask(word), [format!("{word}.ok")]);
    }
    rig.in_step();
}
