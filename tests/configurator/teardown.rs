//! The second and the third stage of stopping.

use crate::rig::*;
use davit::configurator::{Requester, TakenDown};
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
    let answer = if forced { rig.handle.force_down(deadline) } else { rig.handle.take_back(deadline) };
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
fn what_cannot_be_popped_stays_with_what_it_blocks_until_force() {
    let rig = up();
    rig.platform.set_faults(Faults::new([FaultRule::on("port_write C.w", Fault::Fail)]));
    let told = down(&rig, false);
    assert!(!told.is_clean() && !told.troubles.is_empty() && told.forced.is_empty(), "{told:?}");
    assert!(told.kept.contains(&id("switch")) && told.kept.contains(&id("make")), "{told:?}");
    let told = down(&rig, true);
    assert!(told.is_clean() && !told.forced.is_empty(), "{told:?}");
    assert!(rig.see().is_empty());
}

/// What came since stopping began stays, and so does what is safe; the rest is popped around them.
#[test]
fn frames_of_stopping_itself_and_safe_ones_are_not_popped() {
    let rig = up();
    rig.handle.stopping();
    assert_eq!(rig.ask("eight"), ["eight.ok"]);
    let told = down(&rig, false);
    // `eight` writes what `make` made.
    assert_eq!(told.popped, [id("switch"), id("run"), id("wire")], "{told:?}");
    assert_eq!(rig.frames(), ["make", "eight"]);
    assert!(!told.held && !told.still, "{told:?}");

    let rig = up();
    assert_eq!(rig.ask("quiet"), ["quiet.ok"]);
    rig.handle.stopping();
    let told = down(&rig, false);
    assert!(told.held && told.still && !told.is_clean(), "{told:?}");
    assert_eq!(rig.frames().last().map(String::as_str), Some("quiet"));
    assert!(rig.see().components.values().all(|c| c.state != RunState::Running), "what it stopped stays so");
}

/// What was asked for before stopping began counts as before, whenever it ends; what is asked for by the same name afterwards
/// does not.
#[test]
fn what_is_asked_for_again_has_come_since() {
    let rig = up();
    rig.platform
        .set_delays(Delays { of: vec![(StepPattern::new("stop"), Duration::from_millis(800))], ..Delays::default() });
    rig.submit("quiet");
    rig.handle.stopping();
    rig.wait(20.0);
    let last = |rig: &Rig| rig.view().stack.last().map(|frame| (frame.configuration, frame.since_stopping));
    assert_eq!(last(&rig), Some((id("quiet"), false)), "{:?}", rig.events());
    assert_eq!(rig.ask("quiet.undo"), ["quiet.undone"]);
    assert_eq!(rig.ask("quiet"), ["quiet.ok"]);
    assert_eq!(last(&rig), Some((id("quiet"), true)));
    let told = down(&rig, false);
    assert!(!told.held && told.still, "{told:?}");
}

/// From the first moment of stopping on nobody but the coordinator asks for anything.
#[test]
fn operators_are_refused_also_those_that_wait() {
    let rig = up();
    rig.platform.set_delays(Delays {
        of: vec![(StepPattern::new("property_set"), Duration::from_secs(1))],
        ..Delays::default()
    });
    rig.submit("eight");
    rig.wait(0.1);
    rig.submit_as("five", Requester::Operator).unwrap();
    rig.wait(0.1);
    rig.handle.stopping();
    rig.wait(0.1);
    assert_eq!(rig.events()[4..], ["five.failed"], "it waited");
    assert_eq!(rig.ask_as("switch.undo", Requester::Operator)[0], "switch.undo.failed");
    assert_eq!(rig.ask_as("quiet", Requester::Operator), ["quiet.ok"], "what is safe is never refused");
    rig.each_answered_once();
}

/// Every stop, cleanup, disconnect and destroy that fails for good: the others go all the same, and what is left is told.
#[test]
fn force_goes_on_past_every_single_failure() {
    let steps: Vec<String> = {
        let rig = up();
        rig.platform.record();
        down(&rig, true);
        rig.platform.record().iter().map(ToString::to_string).collect()
    };
    assert!(steps.len() > 10, "{steps:?}");
    for step in steps {
        let rig = up();
        rig.platform.set_faults(Faults::new([FaultRule::on(&step, Fault::Fail)]));
        let told = down(&rig, true);
        let of: Vec<&str> = step.split_whitespace().skip(1).map(|word| &word[..1]).collect();
        let left: Vec<_> = told.left.components.iter().collect();
        assert!(!told.is_clean() && !told.troubles.is_empty(), "{step}: {told:?}");
        assert!(left.iter().all(|(name, _)| of.contains(&name.as_str())), "{step} left {left:?}");
        // Once is no harm.
        let rig = up();
        rig.platform.set_faults(Faults::new([FaultRule::on(&step, Fault::Fail).times(1)]));
        assert!(down(&rig, true).is_clean(), "{step}, once");
    }
}

/// Force does not wait for what takes its time.
#[test]
fn force_breaks_off_what_is_being_taken_back() {
    let rig = up();
    rig.platform.set_delays(Delays {
        of: vec![(StepPattern::new("port_write"), Duration::from_millis(900))],
        ..Delays::default()
    });
    let deadline = rig.clock.now() + Duration::from_secs(30);
    let answer = rig.handle.take_back(deadline);
    rig.wait(0.1);
    rig.handle.hurry();
    let told = answer.recv_deadline(deadline).expect("it is told how it ended");
    assert!(told.popped.is_empty() && !told.is_clean(), "{told:?}");
    assert!(down(&rig, true).is_clean());
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
