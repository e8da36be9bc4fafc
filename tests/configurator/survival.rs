//! Hung components, silent platforms, faults, panics, irreversible steps: named, bounded, survived.

use crate::rig::*;
use davit::configurator::{Reason, Recovery};
use davit::model::*;
use davit::platform::simulated::{Delays, Fault, FaultRule, Faults, Simulated, SimulatedOptions, StepPattern};
use davit::platform::*;
use davit::time::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

fn up_with(more: Vec<Configuration>) -> Rig {
    let mut all = scenario();
    all.extend(more);
    let rig = Rig::new(all);
    for word in ["make", "wire", "run"] {
        assert_eq!(rig.ask(word), [format!("{word}.ok")]);
    }
    rig
}

#[test]
fn a_hung_operation_delays_nothing_beyond_its_deadline() {
    let rig = up_with(vec![configuration("look", "", "call A.look", "")]);
    let before = rig.see();
    rig.inject("operation_call", Fault::Hang { returns: Some(Duration::from_secs(20)) });
    let asked = rig.clock.now();
    rig.submit("look");
    rig.submit("eight");
    rig.wait(3.0);
    assert_eq!(rig.events()[3..], ["look.failed", "eight.failed"]);
    let took = rig.answers.lock().unwrap()[3].at.since(asked);
    assert!(took <= Duration::from_millis(1_200), "{took:?}");
    assert_eq!(rig.view().quarantined, [name("A")]);
    assert!(rig.last().findings()[0].message.contains("`A` is in quarantine"), "the refusal names it");
    assert_eq!(rig.see(), before);
    rig.wait(30.0);
    assert!(rig.view().quarantined.is_empty(), "it came back");
    assert_eq!(rig.ask("eight"), ["eight.ok"]);
    rig.each_answered_once();
}

#[test]
fn a_late_return_makes_whole_what_could_not_be_undone() {
    let rig = Rig::new(scenario());
    assert_eq!(rig.ask("make"), ["make.ok"]);
    let before = rig.see();
    // `start B` hangs when A and C have been started or not; whatever was done is taken back, B by its return.
    rig.platform.set_faults(Faults::new([FaultRule::on("configure D", Fault::Fail)]));
    rig.inject("start B", Fault::Hang { returns: Some(Duration::from_secs(10)) });
    rig.submit("run");
    rig.wait(5.0);
    assert_eq!(rig.events()[1..], ["run.failed"]);
    rig.wait(30.0);
    assert_eq!(rig.see(), before);
    assert!(rig.view().broken.is_none());
    rig.in_step();
}

#[test]
fn what_nobody_can_settle_is_broken_and_says_so() {
    let rig = up_with(vec![configuration("open", "", "call A.open; set B.k 2", "")]);
    rig.inject("operation_call", Fault::LostAnswer);
    assert_eq!(rig.ask("open"), ["open.broken"]);
    let view = rig.view();
    let residual = view.broken.as_ref().unwrap();
    assert_eq!(residual.unsettled.len(), 1, "{residual}");
    assert!(residual.difference.is_empty(), "the rest is rolled back: {residual}");
    assert_eq!(rig.ask("eight"), ["eight.failed"]);
    assert!(matches!(rig.last().reason.as_deref(), Some(Reason::StillBroken(_))));
    assert_eq!(rig.ask("open.undo"), ["open.undone"], "its own undo recovers");
    assert_eq!(rig.ask("eight"), ["eight.ok"]);
}

#[test]
fn what_is_connected_to_something_broken_is_not_replaced() {
    let rig = up_with(vec![configuration("open", "", "call A.open", "")]);
    rig.inject("operation_call", Fault::LostAnswer);
    assert_eq!(rig.ask("open"), ["open.broken"]);
    // It names B alone, and would disconnect A from it.
    assert_eq!(rig.ask("hot"), ["hot.failed"]);
    assert!(matches!(rig.last().reason.as_deref(), Some(Reason::StillBroken(_))));
    assert_eq!(rig.ask("open.undo"), ["open.undone"]);
    assert_eq!(rig.ask("hot"), ["hot.ok"]);
    rig.in_step();
}

/// `engage`: a call of A that a call of B takes back, and a property of C.
fn engage() -> Configuration {
    let call = |operation: &str| Call { operation: member(operation), args: vec![] };
    let mut engage = configuration("engage", "", "set C.k 2", "");
    let kind = ChangeKind::OperationCall { call: call("A.open"), undo: Some(call("B.close")) };
    engage.changes.push(Change { kind, origin: Origin::NONE });
    engage
}

#[test]
fn a_component_that_only_takes_something_back_is_there_after_its_call_has_hung() {
    let rig = up_with(vec![engage()]);
    let before = rig.see();
    let hang = Fault::Hang { returns: Some(Duration::from_secs(5)) };
    rig.platform.set_faults(Faults::new([
        FaultRule::on("property_set C.k", Fault::Fail).times(1),
        FaultRule::on("operation_call B.close", hang).times(1),
    ]));
    rig.submit("engage");
    rig.wait(3.0);
    assert_eq!(rig.events()[3..], ["engage.broken"]);
    let residual = rig.view().broken.clone().expect("nobody knows of the call");
    assert_eq!(residual.unsettled.len(), 1, "{residual}");
    assert_eq!(residual.quarantined, [name("B")], "{residual}");
    // When it returns, nothing of B is taken for too much.
    rig.wait(10.0);
    assert!(rig.view().quarantined.is_empty(), "it came back");
    assert_eq!(rig.see(), before);
    rig.in_step();
    let deadline = rig.clock.now() + Duration::from_secs(20);
    assert_eq!(rig.handle.recover(Recovery::Back, deadline), Some(Ok(true)));
    assert_eq!(rig.see(), before);
    assert_eq!(rig.frames(), ["make", "wire", "run"]);
    assert_eq!(rig.ask("engage"), ["engage.ok"]);
    rig.each_answered_once();
}

#[test]
fn a_platform_that_cannot_be_read_leaves_it_broken_and_unobserved() {
    let rig = up_with(vec![]);
    rig.platform.set_faults(Faults {
        blind: true,
        ..Faults::new([FaultRule::on("property_set B.k", Fault::LostAnswer).times(1)])
    });
    let asked = rig.clock.now();
    rig.submit("switch");
    rig.wait(20.0);
    assert_eq!(rig.events()[3..], ["switch.broken"]);
    assert!(rig.last().at.since(asked) < Duration::from_secs(8));
    assert!(!rig.view().broken.as_ref().unwrap().observed);
    rig.platform.set_faults(Faults::default());
    let deadline = rig.clock.now() + Duration::from_secs(20);
    assert_eq!(rig.handle.recover(Recovery::Back, deadline), Some(Ok(true)));
    rig.in_step();
    assert_eq!(rig.ask("switch"), ["switch.ok"]);
}

#[test]
fn a_failure_after_an_irreversible_step_is_broken() {
    let mut burn = configuration("burn", "", "set B.k 2; call A.burn", "C:stopped");
    burn.irreversible = true;
    let rig = up_with(vec![burn]);
    rig.inject("stop C", Fault::Fail);
    assert_eq!(rig.ask("burn"), ["burn.broken"]);
    let Some(Reason::Broken(residual)) = rig.last().reason.as_deref().cloned() else { panic!("{:?}", rig.last()) };
    assert_eq!(residual.irreversible.len(), 1, "{residual}");
    assert!(residual.difference.is_empty());
    assert!(rig.view().residuals.is_empty(), "everything is known: what is left is a partial frame");
    assert!(rig.view().stack.last().unwrap().partial);
    assert_eq!(rig.ask("burn.undo"), ["burn.undo.failed"], "a floor");
    let deadline = rig.clock.now() + Duration::from_secs(20);
    assert_eq!(rig.handle.recover(Recovery::Back, deadline), Some(Ok(true)), "a person has accepted it");
    assert_eq!(rig.ask("burn"), ["burn.ok"]);
    assert_eq!(rig.ask("undo"), ["undo.failed"], "a floor");
}

/// What is left of it is told for as long as it is so.
#[test]
fn what_something_else_has_overwritten_is_not_left_any_more() {
    let mut hold = configuration("hold", "B:stopped", "set B.k 9; set B.s 3", "B:running");
    hold.on_failure = OnFailure::Hold;
    let calm = Configuration { safe: true, ..configuration("calm", "", "set B.k 0", "") };
    let rig = up_with(vec![hold, calm]);
    let left = || -> Vec<String> {
        let view = rig.view();
        let mut left: Vec<String> = view.partial.iter().flat_map(|part| &part.left).map(ToString::to_string).collect();
        left.sort();
        left
    };
    rig.inject("start B", Fault::Fail);
    assert_eq!(rig.ask("hold"), ["hold.broken"]);
    assert_eq!(left(), ["property_set B.k = 9.0", "property_set B.s = 3.0", "stop B"]);
    assert_eq!(rig.ask("calm"), ["calm.ok"]);
    assert_eq!(left(), ["property_set B.s = 3.0", "stop B"]);
    assert_eq!(rig.ask("hold.undo"), ["hold.undone"]);
    assert!(left().is_empty());
}

#[test]
fn hold_undoes_nothing() {
    let mut hold = configuration("hold", "B:stopped", "set B.k 9; set B.s 3", "B:running");
    hold.on_failure = OnFailure::Hold;
    let rig = up_with(vec![hold]);
    let before = rig.see();
    rig.inject("start B", Fault::Fail);
    assert_eq!(rig.ask("hold"), ["hold.broken"]);
    let seen = rig.see();
    assert_eq!(seen.components[&name("B")].properties[&ident("k")], Value::Float(9.0));
    let Some(Reason::Broken(residual)) = rig.last().reason.as_deref().cloned() else { panic!("{:?}", rig.last()) };
    let left: Vec<String> = residual.left.iter().map(ToString::to_string).collect();
    assert!(left.contains(&"stop B".to_owned()), "{left:?}");
    assert!(left.contains(&"property_set B.k = 9.0".to_owned()), "{left:?}");
    assert!(rig.view().residuals.is_empty() && rig.view().stack.last().unwrap().partial);
    assert_eq!(rig.ask("hold.undo"), ["hold.undone"]);
    assert_eq!(rig.see(), before);
    assert_eq!(rig.ask("hold"), ["hold.ok"]);
}

#[test]
fn independent_steps_run_side_by_side_within_the_bound() {
    let rig = up_with(vec![configuration(
        "many",
        "",
        "set A.k 4; set B.k 4; set C.k 4; write A.w 1; write B.w 1; write C.w 1",
        "",
    )]);
    rig.platform.set_delays(Delays { base: Duration::from_millis(100), ..Delays::default() });
    let asked = rig.clock.now();
    rig.submit("many");
    rig.wait(5.0);
    assert_eq!(rig.events()[3..], ["many.ok"]);
    let took = rig.last().at.since(asked);
    // Six steps on four workers: two rounds, not six and not one.
    assert!(took >= Duration::from_millis(200) && took < Duration::from_millis(300), "{took:?}");
}

#[test]
fn a_fault_is_in_the_picture() {
    let rig = up_with(vec![]);
    assert!(rig.platform.fault(name("B"), "it burns"));
    rig.wait(1.0);
    let view = rig.view();
    assert_eq!(view.system.as_ref().unwrap().components[&name("B")].state, RunState::Faulted);
    rig.in_step();
    assert_eq!(rig.ask("switch"), ["switch.ok"], "the way out of a fault is planned from the picture");
    assert_eq!(rig.see().components[&name("B")].state, RunState::Running);
    // A fault is never restored: the undo leaves B where it came to from the fault, and that of `run` brings it from there to
    // where it was before.
    assert_eq!(rig.ask("undo"), ["undo.done"]);
    assert_eq!(rig.see().components[&name("B")].state, RunState::Unconfigured);
    assert_eq!(rig.ask("undo"), ["undo.done"]);
    assert_eq!(rig.see().components[&name("B")].state, RunState::Stopped);
    let deadline = rig.clock.now() + Duration::from_secs(30);
    let told = rig.handle.take_back(deadline).recv_deadline(deadline).expect("it is told how it ended");
    assert!(told.is_clean() && told.forced.is_empty(), "{told:?}");
    rig.each_answered_once();
}

/// A platform whose caller meets a panic in the configurator's own thread.
struct Treacherous {
    inner: Simulated,
    armed: Arc<AtomicBool>,
}

impl Platform for Treacherous {
    leaves_to_inner!();

    fn execution(&self, step: &Step) -> Execution {
        let meant = matches!(step, Step::PropertySet { .. });
        if meant && self.armed.swap(false, Ordering::SeqCst) {
            panic!("a defect of the configurator");
        }
        self.inner.execution(step)
    }
    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        Platform::execute(&self.inner, step, deadline)
    }
}

#[test]
fn a_panic_in_the_configurator_is_answered_and_survived() {
    let armed = Arc::new(AtomicBool::new(false));
    let arm = armed.clone();
    let rig = Rig::with(scenario(), SimulatedOptions::default(), move |inner| Arc::new(Treacherous { inner, armed }));
    for word in ["make", "wire", "run"] {
        assert_eq!(rig.ask(word), [format!("{word}.ok")]);
    }
    let before = rig.see();
    // At the first step of all: nothing was done, and everything goes on.
    arm.store(true, Ordering::SeqCst);
    assert_eq!(rig.ask("eight"), ["eight.broken"]);
    assert_eq!(rig.ask("eight"), ["eight.ok"]);
    assert_eq!(rig.ask("eight.undo"), ["eight.undone"]);
    // In the middle: B is stopped, which is left in a partial frame, and recovered.
    arm.store(true, Ordering::SeqCst);
    assert_eq!(rig.ask("switch"), ["switch.broken"]);
    let view = rig.view();
    let residual = view.broken.as_ref().expect("B is stopped").clone();
    assert_eq!(residual.left.iter().map(ToString::to_string).collect::<Vec<_>>(), ["stop B"]);
    assert!(residual.difference.is_empty() && view.stack.last().unwrap().partial, "{residual}");
    let deadline = rig.clock.now() + Duration::from_secs(20);
    assert_eq!(rig.handle.recover(Recovery::Back, deadline), Some(Ok(true)));
    assert_eq!(rig.see(), before);
    assert_eq!(rig.ask("switch"), ["switch.ok"]);
    for _ in 0..4 {
        assert_eq!(rig.ask("undo"), ["undo.done"]);
    }
    assert!(rig.see().is_empty());
    rig.each_answered_once();
}

#[test]
fn the_progress_tells_what_happened_and_how_long_it_took() {
    use davit::configurator::Progress;
    let rig = up_with(vec![]);
    rig.platform.set_delays(Delays {
        of: vec![(StepPattern::new("property_set B.k"), Duration::from_millis(30))],
        ..Delays::default()
    });
    rig.ask("switch");
    let log = rig.progress.lock().unwrap().clone();
    let took = log.iter().find_map(|told| match told {
        Progress::Ended { step, took, .. } if step.to_string() == "property_set B.k" => *took,
        _ => None,
    });
    assert_eq!(took, Some(Duration::from_millis(30)));
    let answered = log.iter().any(|told| {
        matches!(told, Progress::Answered(answer)
            if answer.verdict == Verdict::Ok && answer.request.ask == Ask::Apply(id("switch")))
    });
    assert!(answered);
}

#[test]
fn after_a_panic_while_everything_is_taken_down_requests_begin_again() {
    let armed = Arc::new(AtomicBool::new(false));
    let arm = armed.clone();
    let mut all = scenario();
    all.push(configuration("fresh", "", "create D", ""));
    let rig = Rig::with(all, SimulatedOptions::default(), move |inner| Arc::new(Treacherous { inner, armed }));
    for word in ["make", "wire"] {
        assert_eq!(rig.ask(word), [format!("{word}.ok")]);
    }
    // When the second frame is popped.
    arm.store(true, Ordering::SeqCst);
    let deadline = rig.clock.now() + Duration::from_secs(30);
    let told = rig.handle.take_back(deadline).recv_deadline(deadline).expect("it begins again, and is told");
    assert!(told.is_clean(), "{told:?}");
    assert_eq!(rig.ask("fresh"), ["fresh.ok"]);
    assert!(rig.see().components.contains_key(&name("D")));
    rig.in_step();
    rig.each_answered_once();
}

/// Whoever asked for what is under way when the configurator ends is told: nobody knows how far it came.
#[test]
fn what_is_under_way_at_the_end_is_answered() {
    let rig = Rig::with(scenario(), SimulatedOptions { blocking: true, ..SimulatedOptions::default() }, |platform| {
        Arc::new(platform)
    });
    rig.inject("create B", Fault::Slow(Duration::from_secs(2)));
    rig.submit("make");
    rig.submit("wire");
    rig.wait(0.5);
    assert!(rig.handle.stop(rig.clock.now() + Duration::from_secs(60)));
    let mut events = rig.events();
    events.sort();
    assert_eq!(events, ["make.broken", "wire.failed"]);
    rig.each_answered_once();
}

#[test]
fn however_often_it_panics_a_call_under_way_is_left_to_its_undo() {
    for times in [1, 9] {
        let rig = up_with(vec![configuration("open", "", "call A.open", "")]);
        let of = vec![(StepPattern::new("operation_call"), Duration::from_millis(300))];
        rig.platform.set_delays(Delays { of, ..Delays::default() });
        rig.submit("open");
        rig.wait(0.1);
        (0..times).for_each(|_| assert!(rig.handle.inject_panic()));
        rig.wait(10.0);
        assert_eq!(rig.events()[3..], ["open.broken"]);
        assert!(rig.view().stack.last().unwrap().partial, "{times}");
        assert_eq!(rig.ask("open.undo"), ["open.undone"]);
        let told = rig.progress.lock().unwrap();
        let closed = |told: &davit::configurator::Progress| matches!(told, davit::configurator::Progress::Ended { step, .. } if step.to_string() == "operation_call A.close");
        assert!(told.iter().any(closed), "{times}");
        drop(told);
        rig.each_answered_once();
    }
}

/// What comes of a stage of stopping of which the configurator panics in the middle.
fn panics_in(stage: impl FnOnce(&Rig, Time) -> davit::time::Receiver<davit::configurator::TakenDown>) {
    let rig = up_with(vec![]);
    rig.platform
        .set_delays(Delays { of: vec![(StepPattern::new("stop"), Duration::from_millis(200))], ..Delays::default() });
    let deadline = rig.clock.now() + Duration::from_secs(30);
    let answer = stage(&rig, deadline);
    rig.wait(0.3);
    assert!(rig.handle.inject_panic());
    let told = answer.recv_deadline(deadline).expect("it is told how it ended");
    assert!(told.is_clean() && told.kept.is_empty() && told.troubles.is_empty(), "{told:?}");
    assert!(rig.clock.now() < deadline, "it is told when it is over");
    assert!(rig.see().is_empty());
}

#[test]
fn a_panic_does_not_end_force() {
    panics_in(|rig, deadline| rig.handle.force_down(deadline));
}

#[test]
fn a_panic_does_not_end_the_second_stage_of_stopping() {
    panics_in(|rig, deadline| rig.handle.take_back(deadline));
}

/// Who recovers something is told at once what became of it, and may go on.
#[test]
fn a_panic_while_something_is_recovered_is_told() {
    let mut hold = configuration("hold", "B:stopped", "set B.k 9; set B.s 3", "B:running");
    hold.on_failure = OnFailure::Hold;
    let rig = up_with(vec![hold]);
    let before = rig.see();
    rig.inject("start B", Fault::Fail);
    assert_eq!(rig.ask("hold"), ["hold.broken"]);
    rig.platform.set_faults(Faults::default());
    rig.platform
        .set_delays(Delays { of: vec![(StepPattern::new("start"), Duration::from_millis(300))], ..Delays::default() });
    let began = rig.clock.now();
    let deadline = began + Duration::from_secs(30);
    let (handle, told) = (rig.handle.clone(), Arc::new(std::sync::Mutex::new(None)));
    let tells = told.clone();
    let asks = rig.clock.spawn("operator", move || *tells.lock().unwrap() = handle.recover(Recovery::Back, deadline));
    rig.wait(0.1);
    assert!(rig.handle.inject_panic());
    asks.join(deadline).expect("it comes back");
    let left = told.lock().unwrap().take().expect("an answer").expect_err("it was broken off");
    assert!(matches!(left.cause, Reason::Panic(_)), "{left}");
    assert!(rig.clock.now() < began + Duration::from_secs(1), "it is told at once");
    rig.wait(1.0);
    assert_eq!(rig.handle.recover(Recovery::Back, rig.clock.now() + Duration::from_secs(30)), Some(Ok(true)));
    assert_eq!(rig.see(), before);
}
