//! Safe configurations go first.

use crate::rig::*;
use davit::configurator::Requester;
use davit::model::{Ask, ComponentType, Configuration, RequestId, RunState, TypeName, Value, Verdict};
use davit::platform::simulated::{Delays, Fault, FaultRule, Faults, SimulatedOptions, StepPattern};
use davit::stack::{Batch, Request, Scope};
use std::sync::Arc;
use std::time::Duration;

fn up() -> Rig {
    let rig = Rig::new(scenario());
    for word in ["make", "wire", "run"] {
        assert_eq!(rig.ask(word), [format!("{word}.ok")]);
    }
    rig
}

fn slow(pattern: &str, seconds: f64) -> Delays {
    Delays { of: vec![(StepPattern::new(pattern), Duration::from_secs_f64(seconds))], ..Delays::default() }
}

#[test]
fn a_safe_configuration_is_a_frame_like_others_when_nothing_is_under_way() {
    let rig = up();
    let before = rig.see();
    assert_eq!(rig.ask("quiet"), ["quiet.ok"]);
    assert!(rig.see().components.values().all(|c| c.state == RunState::Stopped));
    assert_eq!(rig.frames().last().unwrap(), "quiet");
    assert_eq!(rig.ask("quiet.undo"), ["quiet.undone"]);
    assert_eq!(rig.see(), before);
    rig.in_step();
}

#[test]
fn it_goes_before_what_is_under_way_and_does_not_wait_for_what_is_out() {
    let rig = up();
    rig.platform.set_delays(slow("property_set B.k", 0.8));
    rig.submit("switch");
    rig.wait(0.1);
    rig.submit("eight");
    let asked = rig.clock.now();
    rig.platform.record();
    rig.submit("quiet");
    rig.wait(0.05);
    assert_eq!(rig.events()[3..], ["eight.cancelled", "quiet.ok"], "answered before the slow step is back");
    assert!(rig.last().at.since(asked) < Duration::from_millis(20));
    let stopped: Vec<String> = rig.platform.record().iter().map(ToString::to_string).collect();
    assert_eq!(stopped, ["stop A", "stop C"], "B was stopped by what was interrupted");
    rig.wait(50.0);
    assert_eq!(rig.events()[3..], ["eight.cancelled", "quiet.ok", "switch.failed"], "what waited is not begun");
    let passed: Vec<String> = rig.platform.record().iter().map(ToString::to_string).collect();
    assert!(!passed.iter().any(|step| step.starts_with("start")), "nothing is started on the way back: {passed:?}");
    rig.platform.set_delays(Delays::default());
    let seen = rig.see();
    assert!(seen.components.values().all(|c| c.state == RunState::Stopped), "{seen:?}");
    let b = &seen.components[&name("B")];
    assert_eq!(b.properties[&ident("s")], Value::Float(0.0), "the rest is rolled back");
    assert!(!seen.ports.contains_key(&member("C.w")));
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn its_frame_undoes_to_the_system_before_both() {
    let rig = up();
    let before = rig.see();
    rig.platform.set_delays(slow("property_set B.k", 0.8));
    rig.submit("switch");
    rig.wait(0.1);
    rig.submit("quiet");
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.frames(), ["make", "wire", "run", "quiet"]);
    assert_eq!(rig.ask("quiet.undo"), ["quiet.undone"]);
    assert_eq!(rig.see(), before);
    rig.in_step();
}

#[test]
fn a_step_that_was_out_does_not_defeat_it() {
    // `start B` is out when everything is to stop: it lands afterwards and is stopped again.
    let rig = up();
    assert_eq!(rig.ask("quiet"), ["quiet.ok"]);
    rig.platform.set_delays(slow("start B", 0.8));
    rig.submit("run");
    rig.wait(0.1);
    rig.submit_as("quiet", coordinator("c2")).unwrap();
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert!(rig.see().components.values().all(|c| c.state == RunState::Stopped), "{:?}", rig.see());
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn it_is_applied_when_the_system_is_broken() {
    let rig = up();
    rig.inject("stop B", Fault::Hang { returns: None });
    assert_eq!(rig.ask("burnt"), ["burnt.failed"], "there is no such configuration");
    assert_eq!(rig.ask("switch"), ["switch.failed"], "a hung stop has not happened");
    assert_eq!(rig.ask("switch"), ["switch.failed"], "B is in quarantine");
    assert!(rig.last().findings()[0].message.contains("`B` is in quarantine"));
    assert_eq!(rig.ask("quiet"), ["quiet.broken"], "as far as it goes");
    let seen = rig.see();
    assert_eq!(seen.components[&name("A")].state, RunState::Stopped);
    assert_eq!(seen.components[&name("C")].state, RunState::Stopped);
    assert_eq!(rig.ask("eight"), ["eight.failed"], "while broken");
    assert_eq!(rig.ask_as("quiet", Requester::Operator).len(), 1, "again and again");
    assert_eq!(rig.last().verdict, Verdict::Broken);
    rig.each_answered_once();
}

/// `A` with a gain, and safe configurations about it.
fn about_a() -> Rig {
    let mut all = vec![
        configuration("make", "", "create A; create B; set A.k 3", "A:running"),
        configuration("gain", "", "set A.k 7", ""),
        configuration("drop", "", "destroy A; call B.open", ""),
        configuration("low", "A:stopped", "set A.k 1", ""),
        configuration("lower", "", "set A.k 2", ""),
    ];
    for configuration in &mut all {
        configuration.safe = configuration.id.as_str().starts_with("low");
    }
    let rig = Rig::new(all);
    assert_eq!(rig.ask("make"), ["make.ok"]);
    rig
}

fn gain(rig: &Rig) -> Value {
    rig.see().components[&name("A")].properties[&ident("k")].clone()
}

#[test]
fn what_lands_before_its_own_step_is_not_taken_back_over_it() {
    let rig = about_a();
    // Both are out at once: that of what is interrupted ends first.
    rig.platform.set_delays(slow("property_set A.k", 0.5));
    rig.submit("gain");
    rig.wait(0.2);
    rig.submit("lower");
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.events()[1..], ["lower.ok", "gain.failed"]);
    assert_eq!(gain(&rig), Value::Float(2.0), "what is safe stays");
    assert_eq!(rig.ask("lower.undo"), ["lower.undone"]);
    assert_eq!(gain(&rig), Value::Float(3.0), "and goes back to before both");
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn what_it_finds_gone_comes_back_as_it_wants_it() {
    let rig = about_a();
    let before = rig.see();
    // `A` is gone, and the rest of the batch still out, when it comes.
    rig.platform.set_delays(slow("operation_call", 0.5));
    rig.submit("drop");
    rig.wait(0.2);
    assert!(!rig.see().components.contains_key(&name("A")));
    rig.submit("low");
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.events()[1..], ["low.ok", "drop.failed"]);
    assert_eq!(rig.frames(), ["make", "low"]);
    let a = &rig.see().components[&name("A")];
    assert_eq!((a.state, &a.properties[&ident("k")]), (RunState::Stopped, &Value::Float(1.0)));
    assert_eq!(rig.ask("low.undo"), ["low.undone"]);
    assert_eq!(rig.see(), before);
    rig.in_step();
}

#[test]
fn of_two_at_once_the_later_wins_and_the_earlier_does_not_write_it() {
    let rig = about_a();
    rig.platform.set_delays(slow("stop", 0.5));
    rig.platform.record();
    rig.submit_as("low", coordinator("c1")).unwrap();
    rig.submit_as("lower", coordinator("c2")).unwrap();
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    let steps: Vec<String> = rig.platform.record().iter().map(ToString::to_string).collect();
    assert_eq!(steps.iter().filter(|step| step.contains("A.k")).count(), 1, "{steps:?}");
    assert_eq!(rig.events()[1..], ["low.ok", "lower.ok"], "neither is broken");
    assert_eq!(gain(&rig), Value::Float(2.0));
    assert_eq!(rig.frames(), ["make", "low", "lower"]);
    assert_eq!(rig.ask_as("lower.undo", coordinator("c2")), ["lower.undone"]);
    assert_eq!(gain(&rig), Value::Float(1.0), "as after the earlier one");
    assert_eq!(rig.ask_as("low.undo", coordinator("c1")), ["low.undone"]);
    assert_eq!(gain(&rig), Value::Float(3.0));
    rig.in_step();
}

#[test]
fn a_second_one_finds_what_the_first_has_left() {
    let rig = about_a();
    let before = rig.see();
    // `A` is on its way down, with its cleanup still out, when both come.
    rig.platform.set_delays(slow("cleanup", 0.5));
    rig.submit("drop");
    rig.wait(0.2);
    rig.submit_as("low", coordinator("c1")).unwrap();
    rig.wait(0.1);
    rig.submit_as("low", coordinator("c2")).unwrap();
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.events()[1..], ["low.ok", "low.ok", "drop.failed"]);
    let stopped = rig.see();
    assert_eq!(stopped.components[&name("A")].state, RunState::Stopped);
    assert_eq!(rig.ask_as("low.undo", coordinator("c2")), ["low.undone"]);
    assert_eq!(rig.see(), stopped, "the first is still in force");
    assert_eq!(rig.ask_as("low.undo", coordinator("c1")), ["low.undone"]);
    assert_eq!(rig.see(), before);
    rig.in_step();
}

#[test]
fn a_second_one_finds_what_landed_after_the_first_as_it_was_before() {
    let rig = about_a();
    assert_eq!(rig.ask("low"), ["low.ok"]);
    let before = rig.see();
    // The step that the first does not know of is back when the second comes.
    rig.platform.set_delays(slow("cleanup", 0.5));
    rig.submit("low.undo drop");
    rig.wait(0.2);
    rig.submit_as("low", coordinator("c1")).unwrap();
    rig.wait(0.1);
    rig.platform.set_delays(slow("operation_call", 0.5));
    rig.wait(0.25);
    rig.submit_as("low", coordinator("c2")).unwrap();
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.frames(), ["make", "low", "low", "low"]);
    for of in ["c2", "c1"] {
        assert_eq!(rig.ask_as("low.undo", coordinator(of)), ["low.undone"]);
        assert_eq!(rig.see(), before, "the first is still in force");
    }
    rig.in_step();
}

/// `A` stopped, and a safe configuration that wants it running.
fn wanted_higher() -> Rig {
    let mut all = vec![
        configuration("make", "", "create A; create B", "A:stopped"),
        configuration("drop", "", "destroy A; call B.open", ""),
        configuration("hold_up", "", "", "A:running"),
    ];
    all[2].safe = true;
    let rig = Rig::new(all);
    assert_eq!(rig.ask("make"), ["make.ok"]);
    rig
}

#[test]
fn what_comes_back_goes_on_to_where_it_wants_it() {
    for fails in [None, Some("configure A"), Some("start A")] {
        let rig = wanted_higher();
        let before = rig.see();
        rig.platform.set_delays(slow("operation_call", 0.5));
        rig.submit("drop");
        rig.wait(0.2);
        assert!(!rig.see().components.contains_key(&name("A")));
        if let Some(step) = fails {
            rig.inject(step, Fault::Fail);
        }
        rig.submit("hold_up");
        rig.wait(50.0);
        rig.platform.set_delays(Delays::default());
        assert_eq!(rig.events()[1..], ["hold_up.ok", "drop.failed"], "{fails:?}");
        assert_eq!(rig.see().components[&name("A")].state, RunState::Running, "{fails:?}");
        assert_eq!(rig.ask("hold_up.undo"), ["hold_up.undone"]);
        assert_eq!(rig.see(), before);
        rig.in_step();
    }
}

#[test]
fn of_what_it_interrupted_that_is_broken_of_which_something_is_left() {
    let all = vec![
        configuration("make", "", "create A; create B; set A.k 3", ""),
        configuration("same", "", "set A.k 3", ""),
        configuration("gain", "", "set A.k 7", ""),
        configuration("more", "", "create C", "C:stopped"),
        Configuration { safe: true, ..configuration("low", "", "set B.k 1", "") },
    ];
    // Nothing is left of an undo without a step; of the other nothing could be taken back, since the way back ends before.
    for (undone, verdict, value) in [("same", "failed", 3.0), ("gain", "broken", 3.0)] {
        let rig = Rig::new(all.clone());
        assert_eq!(rig.ask("make"), ["make.ok"]);
        assert_eq!(rig.ask(undone), [format!("{undone}.ok")]);
        rig.platform.set_delays(slow("configure", 0.5));
        rig.submit(&format!("{undone}.undo more"));
        rig.wait(0.2);
        rig.platform.set_faults(Faults::new([FaultRule::on("destroy", Fault::Fail).times(100)]));
        rig.submit("low");
        rig.wait(50.0);
        rig.platform.set_delays(Delays::default());
        let (undo, broken) = (format!("{undone}.undo.{verdict}"), "more.broken".to_owned());
        assert_eq!(rig.events()[2..], ["low.ok".to_owned(), undo, broken]);
        assert_eq!(rig.frames(), ["make", undone, "more", "low"]);
        assert_eq!(gain(&rig), Value::Float(value));
        assert!(rig.see().components.contains_key(&name("C")));
        if verdict == "failed" {
            assert_eq!(rig.ask("more.undo"), ["more.undone"]);
            assert!(!rig.see().components.contains_key(&name("C")));
        }
        rig.in_step();
        rig.each_answered_once();
    }
}

/// `A` running, which is undone and made anew, with the making still out when safe configurations come.
fn made_anew() -> (Rig, davit::model::Snapshot) {
    let mut all = vec![
        configuration("other", "", "create B", ""),
        configuration("make", "", "create A", "A:running"),
        configuration("low", "A:stopped", "write B.u 1", ""),
        configuration("both", "", "set B.k 1", "A:stopped"),
    ];
    all[2].safe = true;
    all[3].safe = true;
    let rig = Rig::new(all);
    assert_eq!(rig.ask("other"), ["other.ok"]);
    assert_eq!(rig.ask("make"), ["make.ok"]);
    let before = rig.see();
    let of = [("create A", 0.5), ("property_set B.k", 1.0), ("port_write B.u", 1.0)];
    let of = of.map(|(step, seconds)| (StepPattern::new(step), Duration::from_secs_f64(seconds))).to_vec();
    rig.platform.set_delays(Delays { of, ..Delays::default() });
    rig.submit("make.undo make");
    rig.wait(0.2);
    assert!(!rig.see().components.contains_key(&name("A")));
    (rig, before)
}

#[test]
fn what_was_made_anew_meanwhile_comes_back_as_it_wants_it() {
    let (rig, before) = made_anew();
    rig.submit("low");
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.events()[2..], ["low.ok", "make.undo.failed", "make.failed"]);
    assert_eq!(rig.frames(), ["other", "make", "low"]);
    assert_eq!(
        rig.see().components[&name("A")].state,
        RunState::Stopped,
        "what came late is gone, and this is as before"
    );
    assert_eq!(rig.ask("low.undo"), ["low.undone"]);
    assert_eq!(rig.see(), before);
    rig.in_step();
}

#[test]
fn a_second_one_finds_what_was_made_anew_meanwhile_as_the_first_wants_it() {
    let (rig, before) = made_anew();
    rig.submit_as("both", coordinator("c1")).unwrap();
    // What was out is back, and the first not there yet: the second one brings it up, and it goes away all the same.
    rig.wait(0.6);
    assert!(rig.see().components.contains_key(&name("A")));
    rig.submit_as("low", coordinator("c2")).unwrap();
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.events()[2..], ["both.ok", "low.ok", "make.undo.failed", "make.failed"]);
    assert_eq!(rig.frames(), ["other", "make", "both", "low"]);
    assert_eq!(rig.see().components[&name("A")].state, RunState::Stopped);
    assert_eq!(rig.ask_as("low.undo", coordinator("c2")), ["low.undone"]);
    assert_eq!(rig.see().components[&name("A")].state, RunState::Stopped, "the first is still in force");
    assert_eq!(rig.ask_as("both.undo", coordinator("c1")), ["both.undone"]);
    assert_eq!(rig.see(), before);
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn what_the_last_step_back_brings_back_goes_on_to_where_a_later_one_wants_it() {
    let mut all = vec![
        configuration("make", "", "create A; create B", ""),
        configuration("drop", "", "destroy A; create C", ""),
        configuration("calm", "", "set B.k 1", ""),
        configuration("low", "", "", "A:stopped"),
    ];
    all[2].safe = true;
    all[3].safe = true;
    let rig = Rig::new(all);
    assert_eq!(rig.ask("make"), ["make.ok"]);
    let before = rig.see();
    rig.platform.set_delays(slow("create", 0.5));
    rig.submit("drop");
    rig.wait(0.2);
    rig.submit("calm");
    // `C` is there and gone again, and `A` on its way back.
    rig.wait(0.5);
    assert_eq!(rig.see().components.len(), 1);
    rig.submit("low");
    rig.wait(50.0);
    rig.platform.set_delays(Delays::default());
    assert_eq!(rig.events()[1..], ["calm.ok", "low.ok", "drop.failed"]);
    assert_eq!(rig.see().components[&name("A")].state, RunState::Stopped);
    assert_eq!(rig.ask("low.undo calm.undo"), ["low.undone", "calm.undone"]);
    assert_eq!(rig.see(), before);
    rig.in_step();
}

#[test]
fn leaving_a_state_whose_frame_is_gone_does_not_undo_that_of_the_next_visit() {
    let rig = wanted_higher();
    let by_state = |id: u64, ask: Ask| Request {
        scope: Some(Scope(7)),
        ..Request::new(RequestId(id), ask, coordinator(COORDINATOR))
    };
    let hold = |at: u64| by_state(at, Ask::Apply(id("hold_up")));
    rig.handle.submit(Batch::one(hold(1001))).unwrap();
    rig.wait(1.0);
    assert_eq!(rig.ask("hold_up.undo"), ["hold_up.undone"]);
    // The state is left and entered again in one step: what is safe goes first.
    let leave = by_state(1002, Ask::UndoOf(id("hold_up")));
    rig.handle.submit([leave, hold(1003)].into_iter().collect()).unwrap();
    rig.wait(1.0);
    assert_eq!(rig.events()[1..], ["hold_up.ok", "hold_up.undone", "hold_up.ok", "hold_up.undone"]);
    assert_eq!(rig.frames(), ["make", "hold_up"]);
    assert_eq!(rig.see().components[&name("A")].state, RunState::Running);
    rig.in_step();
}

#[test]
fn an_undo_that_is_refused_and_interrupted_is_not_about_the_next_visit() {
    let mut all = vec![
        configuration("make", "", "create A", "A:running"),
        configuration("gain", "", "set A.k 7", ""),
        configuration("more", "", "create B", ""),
        configuration("low", "", "", "A:stopped"),
    ];
    all[3].safe = true;
    let rig = Rig::new(all);
    let of = |number: u64, ask: Ask| Request::new(RequestId(number), ask, coordinator(COORDINATOR));
    let by_state = |number: u64, ask: Ask| Request { scope: Some(Scope(7)), ..of(number, ask) };
    assert_eq!((rig.ask("make"), rig.ask("gain")), (vec!["make.ok".to_owned()], vec!["gain.ok".to_owned()]));
    rig.handle.submit(Batch::one(by_state(1001, Ask::Apply(id("low"))))).unwrap();
    rig.wait(1.0);
    assert_eq!(rig.ask("low"), ["low.ok"], "it stands in the way of leaving the state");
    rig.platform.set_delays(slow("create", 0.5));
    let (gain, more) = (of(1002, Ask::UndoOf(id("gain"))), of(1004, Ask::Apply(id("more"))));
    rig.handle.submit([gain, by_state(1003, Ask::UndoOf(id("low"))), more].into_iter().collect()).unwrap();
    rig.wait(0.2);
    // The state is entered again while that is under way.
    rig.handle.submit(Batch::one(by_state(1005, Ask::Apply(id("low"))))).unwrap();
    rig.wait(5.0);
    assert_eq!(rig.events()[4..], ["low.ok", "gain.undo.failed", "low.undo.failed", "more.failed"]);
    assert_eq!(rig.frames(), ["make", "gain", "low", "low", "low"]);
    rig.handle.submit(Batch::one(by_state(1006, Ask::UndoOf(id("low"))))).unwrap();
    rig.wait(5.0);
    assert_eq!(rig.frames(), ["make", "gain", "low", "low"], "that of the second visit goes with it");
    rig.in_step();
}

/// What is reported faulted is looked at before something is planned: what is safe does not wait for that, and what does is
/// something that waits.
#[test]
fn a_safe_configuration_does_not_wait_for_a_look() {
    let mut all = scenario();
    all.push(Configuration { safe: true, ..configuration("low", "", "", "A:stopped") });
    let rig = Rig::with(all, SimulatedOptions { blocking: true, ..SimulatedOptions::default() }, |platform| {
        Arc::new(platform)
    });
    for word in ["make", "wire", "run"] {
        rig.ask(word);
    }
    // Nobody answers questions: a look lasts as long as it may.
    rig.platform.set_faults(Faults { blind: true, ..Faults::default() });
    assert!(rig.platform.fault(name("B"), "it burns"));
    rig.wait(0.001);
    rig.submit("eight");
    rig.wait(0.01);
    assert_eq!(rig.events().len(), 3, "the look is not over");
    rig.submit("low");
    rig.wait(0.01);
    assert_eq!(rig.events()[3..], ["eight.cancelled", "low.ok"]);
    rig.submit("five");
    rig.wait(0.01);
    assert_eq!(rig.events().len(), 5, "the look is not over");
    rig.wait(100.0);
    assert_eq!(rig.events()[5..], ["five.ok"]);
    rig.each_answered_once();
}

/// Two subsystems of one component each, and their parent's connection across.
fn two_subsystems() -> Rig {
    let mut all = vec![
        configuration("join", "", "connect left/A.y right/A.u; set right/A.k 9", ""),
        configuration("lift", "", "call left/A.open", ""),
    ];
    for path in ["left", "right"] {
        all.extend([
            configuration(&format!("{path}/make"), "", &format!("create {path}/A"), &format!("{path}/A:running")),
            configuration(&format!("{path}/gain"), "", &format!("set {path}/A.k 1"), ""),
            configuration(&format!("{path}/lift"), "", &format!("call {path}/A.open"), ""),
            configuration(&format!("{path}/quiet"), &format!("{path}/A:stopped"), "", ""),
        ]);
    }
    for configuration in &mut all {
        configuration.safe = configuration.id.as_str().ends_with("quiet");
    }
    let mut types = catalogue();
    let mut node = ComponentType::clone(types.get(TypeName::new("Node").unwrap()).expect("the one type"));
    for operation in ["open", "close"] {
        node.operations.get_mut(&ident(operation)).expect("one of its operations").moves = true;
    }
    types.insert(node);
    let options = SimulatedOptions::default();
    let rig = Rig::of(types, Default::default(), all, options, |platform| Arc::new(platform), Default::default());
    for path in ["left", "right"] {
        assert_eq!(rig.ask_as(&format!("{path}/make"), coordinator(path)), [format!("{path}/make.ok")]);
    }
    rig
}

#[test]
fn that_of_a_subsystem_interrupts_what_claims_something_of_it_and_nothing_else() {
    let rig = two_subsystems();
    rig.platform.set_delays(slow("property_set right/A.k", 0.8));
    rig.submit_as("right/gain", coordinator("right")).unwrap();
    rig.wait(0.1);
    rig.submit_as("left/quiet", coordinator("left")).unwrap();
    rig.wait(0.05);
    assert_eq!(rig.events()[2..], ["left/quiet.ok"]);
    rig.wait(50.0);
    assert_eq!(rig.events()[3..], ["right/gain.ok"], "it goes on, and is not cut short");
    assert_eq!(rig.ask_as("left/quiet.undo right/gain.undo", coordinator("left")).len(), 2);
    // Of the parent's, both: its part elsewhere is taken back with it.
    rig.submit_as("join", coordinator("parent")).unwrap();
    rig.wait(0.1);
    rig.submit_as("left/quiet", coordinator("left")).unwrap();
    rig.wait(50.0);
    assert_eq!(rig.events()[6..], ["left/quiet.ok", "join.failed"]);
    assert_eq!(rig.see().components[&name("right/A")].properties[&ident("k")], Value::Float(1.0), "as it was made");
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn while_that_of_a_subsystem_is_applied_others_begin() {
    let rig = two_subsystems();
    rig.platform.set_delays(slow("stop left/A", 0.8));
    rig.submit_as("left/quiet", coordinator("left")).unwrap();
    rig.wait(0.1);
    // Behind it: its own waits, the other one's does not.
    rig.submit_as("left/gain", coordinator("other")).unwrap();
    rig.submit_as("right/gain", coordinator("right")).unwrap();
    rig.wait(0.05);
    assert_eq!(rig.events()[2..], ["right/gain.ok"]);
    rig.wait(50.0);
    assert_eq!(rig.events()[3..], ["left/quiet.ok", "left/gain.ok"]);
    rig.in_step();
    rig.each_answered_once();
}

#[test]
fn what_a_subsystem_keeps_still_is_not_moved_from_outside_either() {
    let rig = two_subsystems();
    assert_eq!(rig.ask_as("left/quiet", coordinator("left")), ["left/quiet.ok"]);
    for (number, (word, answer)) in
        (900..).zip([("lift", "lift.failed"), ("left/lift", "left/lift.failed"), ("right/lift", "right/lift.ok")])
    {
        // An operator, without force.
        let request = Request::new(RequestId(number), Ask::Apply(id(word)), Requester::Operator);
        rig.handle.submit(Batch::one(request)).unwrap();
        rig.wait(1.0);
        assert_eq!(rig.events().last().unwrap(), answer);
    }
    rig.in_step();
}
