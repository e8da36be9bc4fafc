//! The rules of the `Platform` trait, one function each.

use crate::bed::*;
use davit::model::*;
use davit::platform::{Cause, Ended, Outcome, PlatformEvent};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;
use {Policy::Buffer, Policy::Data, Transition::Cleanup, Transition::Configure, Transition::Start, Transition::Stop};

pub fn create_needs_a_known_type_and_a_free_name(bed: &dyn Bed) {
    let made = bed.make(&[]);
    assert!(made.see().is_empty());
    made.refuses(Step::Create {
        component: name("a"),
        ty: TypeName::new("Nothing").unwrap(),
        activity: None,
        properties: Vec::new(),
    });
    made.does(create("a"));
    made.refuses(create("a"));
    let seen = made.see();
    let a = &seen.components[&name("a")];
    assert_eq!((a.ty.as_str(), a.state, a.activity), ("Plant", RunState::Unconfigured, None));
    assert_eq!(a.properties.values().cloned().collect::<Vec<_>>(), plant_values());
    assert!(seen.ports.is_empty() && seen.connections.is_empty());
}

pub fn create_needs_every_value_of_its_type_and_within_its_limits(bed: &dyn Bed) {
    let made = bed.make(&[]);
    let with = |at: usize, value: Value| {
        let mut properties = plant_values();
        properties[at] = value;
        Step::Create { component: name("a"), ty: TypeName::new("Plant").unwrap(), activity: None, properties }
    };
    made.refuses(Step::Create {
        component: name("a"),
        ty: TypeName::new("Plant").unwrap(),
        activity: None,
        properties: vec![Value::str("none")],
    });
    made.refuses(with(1, Value::Bool(true)));
    made.refuses(with(1, Value::Float(10.5)));
    made.refuses(with(1, Value::Float(f64::NAN)));
    made.refuses(with(2, Value::floats(&[1.0, 2.0])));
    made.refuses(with(2, Value::floats(&[1.0, 2.0, -0.5])));
    made.refuses(with(4, pose(0.0, 1.5)));
    made.does(with(1, Value::Float(10.0)));
}

pub fn run_states_move_along_the_legal_path_only(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.refuses(state("a", Configure));
    made.does(create("a"));
    let mut at = RunState::Unconfigured;
    // A walk that tries every transition in every state and comes back.
    for step in [Configure, Start, Stop, Cleanup] {
        for transition in [Configure, Start, Stop, Cleanup] {
            if !transition.allowed_in(at) {
                made.refuses(state("a", transition));
            }
        }
        made.does(state("a", step));
        at = step.target();
        assert_eq!(made.state_of("a"), Some(at));
    }
}

pub fn destroy_needs_unconfigured_and_no_connections(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.refuses(destroy("a"));
    made.all([create("a"), create("b"), state("a", Configure)]);
    made.refuses(destroy("a"));
    made.does(state("a", Start));
    made.refuses(destroy("a"));
    made.all([state("a", Stop), state("a", Cleanup), connect("a.y", "b.u", Data)]);
    made.refuses(destroy("a"));
    made.refuses(destroy("b"));
    made.all([disconnect("a.y", "b.u"), write("a.u", Some(Value::Float(1.0))), destroy("a"), destroy("b")]);
    assert!(made.see().is_empty(), "nothing is left behind, no written value either");
}

pub fn a_property_takes_its_type_within_its_limits(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.refuses(set("a.gain", 1.0));
    made.does(create("a"));
    made.refuses(set("a.nothing", 1.0));
    made.refuses(set("a.gain", true));
    made.refuses(set("a.gain", 11.0));
    made.refuses(set("a.gain", f64::INFINITY));
    made.refuses(set("a.mode", 1.0));
    made.refuses(set("a.gains", Value::floats(&[1.0, 2.0, 10.5])));
    made.refuses(set("a.gains", Value::floats(&[1.0])));
    made.refuses(set("a.pose", pose(2.0, 0.0)));
    made.all([set("a.gain", 10.0), set("a.gains", Value::floats(&[0.0, 1.0, 2.0])), set("a.pose", pose(1.0, -1.0))]);
    let a = &made.see().components[&name("a")];
    assert_eq!(a.properties[&ident("gain")], Value::Float(10.0));
    assert_eq!(a.properties[&ident("gains")], Value::floats(&[0.0, 1.0, 2.0]));
    assert_eq!(a.properties[&ident("pose")], pose(1.0, -1.0));
}

pub fn a_property_is_set_only_where_it_is_tunable(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.does(create("a"));
    made.all([set("a.device", "x"), set("a.mode", 1), set("a.gain", 2.0)]);
    made.does(state("a", Configure));
    made.refuses(set("a.device", "y"));
    made.all([set("a.mode", 2), set("a.gain", 3.0), state("a", Start)]);
    made.refuses(set("a.device", "y"));
    made.refuses(set("a.mode", 3));
    made.does(set("a.gain", 4.0));
    made.all([state("a", Stop), state("a", Cleanup)]);
    let a = &made.see().components[&name("a")];
    let kept = [("device", Value::str("x")), ("mode", Value::Int(2)), ("gain", Value::Float(4.0))];
    for (property, value) in kept {
        assert_eq!(a.properties[&ident(property)], value, "{property} outlives the run states");
    }
    made.does(set("a.device", "z"));
}

pub fn a_data_connection_is_the_only_one_of_its_port(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.all([create("a"), create("b"), create("c")]);
    made.does(connect("a.y", "b.u", Data));
    made.refuses(connect("a.y", "b.u", Data));
    made.refuses(connect("a.y", "b.u", Buffer(4)));
    made.refuses(connect("c.y", "b.u", Data));
    made.refuses(connect("c.y", "b.u", Buffer(4)));
    made.does(connect("a.y", "c.u", Data));
    made.does(disconnect("a.y", "b.u"));
    made.refuses(disconnect("a.y", "b.u"));
    made.all([connect("a.y", "b.u", Buffer(4)), connect("a.y2", "b.u", Buffer(2))]);
    made.refuses(connect("c.y", "b.u", Data));
    made.refuses(connect("c.y", "b.u", Buffer(0)));
    made.refuses(connect("a.y", "b.q", Data));
    made.all([connect("a.y", "b.q", Buffer(1)), connect("c.y", "b.q", Buffer(3))]);
    let seen = made.see().connections;
    let expected = [
        ("a.y", "b.u", Buffer(4)),
        ("a.y2", "b.u", Buffer(2)),
        ("a.y", "b.q", Buffer(1)),
        ("c.y", "b.q", Buffer(3)),
        ("a.y", "c.u", Data),
    ];
    assert_eq!(seen, expected.iter().map(|(f, t, p)| ((member(f), member(t)), *p)).collect());
}

pub fn types_units_and_directions_of_connected_ports_agree(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.refuses(connect("a.y", "b.u", Data));
    made.all([create("a"), create("b")]);
    made.refuses(connect("a.y", "b.nothing", Data));
    made.refuses(connect("a.nothing", "b.u", Data));
    made.refuses(connect("a.u", "b.u", Data));
    made.refuses(connect("a.y", "b.y", Data));
    made.refuses(connect("a.y", "b.u_m", Data));
    made.refuses(connect("a.y", "b.n", Data));
    made.refuses(connect("a.y", "b.v", Data));
    made.refuses(connect("a.said", "b.u", Data));
    made.refuses(connect("a.y", "b.heard", Data));
    made.all([connect("a.y", "b.u_plain", Data), connect("a.w", "b.v", Data)]);
}

pub fn event_ports_take_many_connections(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.all([create("a"), create("b"), create("c")]);
    made.all([connect("a.said", "c.heard", Data), connect("b.said", "c.heard", Data)]);
    made.refuses(connect("a.said", "c.heard", Data));
    made.does(connect("c.said", "c.heard", Buffer(8)));
    assert_eq!(made.see().connections.len(), 3);
}

pub fn port_write_needs_a_port_that_nothing_drives(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.refuses(write("b.u", Some(Value::Float(1.0))));
    made.all([create("a"), create("b")]);
    made.refuses(write("b.nothing", Some(Value::Float(1.0))));
    made.refuses(write("b.y", Some(Value::Float(1.0))));
    made.refuses(write("b.q", Some(Value::Float(1.0))));
    made.refuses(write("b.heard", Some(Value::str("e"))));
    made.refuses(write("b.u", Some(Value::Bool(true))));
    made.refuses(write("b.u", Some(Value::Float(f64::NAN))));
    made.refuses(write("b.v", Some(Value::floats(&[1.0]))));
    made.does(connect("a.y", "b.u", Data));
    made.refuses(write("b.u", Some(Value::Float(1.0))));
    made.does(write("b.v", Some(Value::floats(&[1.0, 2.0, 3.0]))));
    made.all([state("b", Configure), state("b", Start), write("b.n", Some(Value::Int(3)))]);
    assert_eq!(made.see().ports, written(&[("b.v", Value::floats(&[1.0, 2.0, 3.0])), ("b.n", Value::Int(3))]));
}

pub fn a_written_value_survives_a_connection_and_never_written_comes_back(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.all([create("a"), create("b")]);
    let there = written(&[("b.u", Value::Float(2.0))]);
    made.all([write("b.u", Some(Value::Float(1.0))), write("b.u", Some(Value::Float(2.0)))]);
    assert_eq!(made.see().ports, there);
    made.does(connect("a.y", "b.u", Data));
    assert_eq!(made.see().ports, there, "recorded while connected");
    made.does(disconnect("a.y", "b.u"));
    assert_eq!(made.see().ports, there, "in force again");
    made.does(write("b.u", None));
    assert!(made.see().ports.is_empty());
}

pub fn a_component_may_be_connected_to_itself(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.all([create("a"), connect("a.y", "a.u", Data)]);
    made.refuses(destroy("a"));
    made.all([disconnect("a.y", "a.u"), destroy("a")]);
    assert!(made.see().is_empty());
}

pub fn operations_need_their_arguments_and_answer_their_type(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.refuses(call("a.nothing", vec![]));
    made.all([create("a"), state("a", Configure)]);
    made.refuses(call("a.unknown", vec![]));
    made.refuses(call("a.nothing", vec![Value::Int(1)]));
    made.refuses(call("a.scale", vec![Value::Float(1.0)]));
    made.refuses(call("a.scale", vec![Value::Float(1.0), Value::Float(2.0)]));
    assert_eq!(made.does(call("a.nothing", vec![])), None);
    let answer = made.does(call("a.scale", vec![Value::Float(1.0), Value::Int(2)])).expect("an answer");
    assert!(answer.is_of(&ValueType::Float), "{answer}");
}

/// The run state before `hook` is called, and the steps that lead there.
fn up_to(hook: &str) -> (RunState, Vec<Step>) {
    let all = [create_misbehaving("bad"), state("bad", Configure), state("bad", Start)];
    match hook {
        "configure" => (RunState::Unconfigured, all[..1].to_vec()),
        "start" | "cleanup" => (RunState::Stopped, all[..2].to_vec()),
        "stop" => (RunState::Running, all.to_vec()),
        "create" => (RunState::Unconfigured, Vec::new()),
        "destroy" => (RunState::Unconfigured, all[..1].to_vec()),
        other => panic!("no hook {other}"),
    }
}

fn step_of(hook: &str) -> Step {
    match hook {
        "create" => return create_misbehaving("bad"),
        "destroy" => return destroy("bad"),
        _ => {}
    }
    let transition = [Configure, Start, Stop, Cleanup].into_iter().find(|t| t.as_str() == hook).expect("a hook");
    state("bad", transition)
}

const HOOKS: [&str; 4] = ["configure", "start", "stop", "cleanup"];

/// Everything that may run a component's own code but its operations.
const CALLS: [&str; 6] = ["create", "configure", "start", "stop", "cleanup", "destroy"];

pub fn a_failed_step_leaves_the_component_as_it_was(bed: &dyn Bed) {
    for hook in ["configure", "start"] {
        let made = bed.make(&[(hook, Trouble::Fail)]);
        let (_, steps) = up_to(hook);
        made.all(steps);
        let before = made.see();
        let outcome = made.run(&step_of(hook));
        assert!(matches!(outcome, Outcome::NotDone(Cause::Failed(_))), "{hook}: {outcome:?}");
        assert_eq!(made.see(), before, "{hook}");
    }
}

pub fn a_panic_faults_the_component_and_nothing_else(bed: &dyn Bed) {
    for hook in HOOKS {
        let made = bed.make(&[(hook, Trouble::Panic)]);
        let heard = made.listen();
        let (_, steps) = up_to(hook);
        made.all(steps);
        made.all([create("other"), state("other", Configure), state("other", Start)]);
        let outcome = made.run(&step_of(hook));
        assert!(matches!(outcome, Outcome::NotDone(Cause::Panicked(_))), "{hook}: {outcome:?}");
        assert_eq!(made.state_of("bad"), Some(RunState::Faulted), "{hook}");
        assert_eq!(made.state_of("other"), Some(RunState::Running), "{hook}");
        let heard = heard.lock().unwrap();
        assert!(
            heard.iter().any(|e| matches!(e, PlatformEvent::Faulted { component, .. } if *component == name("bad"))),
            "{hook}: {heard:?}"
        );
    }
}

pub fn faulted_components_can_be_cleaned_up_and_destroyed(bed: &dyn Bed) {
    for last in ["cleanup", "destroy"] {
        let made = bed.make(&[("start", Trouble::Panic)]);
        made.all(up_to("start").1);
        made.run(&step_of("start"));
        made.refuses(state("bad", Start));
        made.refuses(state("bad", Stop));
        made.refuses(state("bad", Configure));
        if last == "cleanup" {
            made.does(state("bad", Cleanup));
            assert_eq!(made.state_of("bad"), Some(RunState::Unconfigured));
        } else {
            made.does(destroy("bad"));
            assert!(made.see().is_empty());
        }
    }
}

pub fn a_hung_call_is_unknown_at_its_deadline_and_quarantined(bed: &dyn Bed) {
    for hook in CALLS {
        let made = bed.make(&[(hook, Trouble::Hang(None))]);
        made.all(up_to(hook).1);
        made.does(create("other"));
        let deadline = made.deadline();
        let outcome = made.platform.execute(&step_of(hook), deadline);
        assert!(matches!(outcome, Outcome::Unknown(Cause::Timeout)), "{hook}: {outcome:?}");
        let late = made.clock.now().since(deadline);
        assert!(made.clock.now() >= deadline && late < Duration::from_millis(100), "{hook}: {late:?} late");
        assert_eq!(made.platform.quarantined(), [name("bad")], "{hook}");
        for step in [step_of(hook), state("bad", Configure), destroy("bad")] {
            let outcome = made.run(&step);
            assert!(matches!(outcome, Outcome::NotDone(_)), "{hook}: `{step}` in quarantine: {outcome:?}");
        }
        made.all([state("other", Configure), state("other", Start)]);
        assert!(made.platform.observe_component(name("bad"), made.deadline()).is_ok(), "{hook}");
    }
}

pub fn a_quarantined_component_can_be_disconnected(bed: &dyn Bed) {
    // `Misbehaving` has no ports: this rule is about a plain component whose neighbour hangs, and about the platform
    // as a whole going on.
    let made = bed.make(&[("start", Trouble::Hang(None))]);
    made.all(up_to("start").1);
    made.all([create("a"), create("b"), connect("a.y", "b.u", Data)]);
    made.run(&step_of("start"));
    made.all([disconnect("a.y", "b.u"), destroy("a"), destroy("b")]);
    assert_eq!(made.see().components.keys().copied().collect::<Vec<_>>(), [name("bad")]);
}

pub fn a_call_that_returns_late_is_cleaned_up(bed: &dyn Bed) {
    for hook in CALLS {
        let made = bed.make(&[(hook, Trouble::Hang(Some(LIMIT + Duration::from_secs(2))))]);
        let heard = made.listen();
        let (before, steps) = up_to(hook);
        made.all(steps);
        assert!(matches!(made.run(&step_of(hook)), Outcome::Unknown(_)), "{hook}");
        assert_eq!(made.platform.quarantined(), [name("bad")], "{hook}");
        made.wait(Duration::from_secs(5));
        assert!(made.platform.quarantined().is_empty(), "{hook}");
        let heard = heard.lock().unwrap();
        assert!(
            heard.iter().any(|e| matches!(e, PlatformEvent::Returned { component, .. } if *component == name("bad"))),
            "{hook}: {heard:?}"
        );
        let now = made.state_of("bad");
        assert!(now.is_none() || now == Some(before), "{hook}: gone or as before the call, but {now:?}");
    }
}

pub fn brief_steps_are_carried_out_as_far_as_they_are_done(bed: &dyn Bed) {
    let made = bed.make(&[("create", Trouble::Hang(Some(LIMIT + Duration::from_secs(2))))]);
    let until = || made.clock.now() + Duration::from_secs(60);
    let names = ["a", "b", "c"];
    let mut steps: Vec<Step> = names.iter().map(|n| create(n)).collect();
    while !steps.is_empty() {
        let ended = made.platform.execute_brief(steps.clone(), LIMIT, until(), &Arc::default());
        assert!(!ended.is_empty() && ended.len() <= steps.len());
        assert!(ended.iter().all(|e| e.outcome == Outcome::Done(None)), "{ended:?}");
        steps.drain(..ended.len());
    }
    assert_eq!(made.see().components.keys().copied().collect::<Vec<_>>(), names.map(name));
    // One that hangs ends the turn: what comes before it is done, what comes after it is not begun.
    let mut steps = vec![destroy("a"), create_misbehaving("bad"), create("d"), destroy("b")];
    while steps[0].component() != name("bad") {
        let ended = made.platform.execute_brief(steps.clone(), LIMIT, until(), &Arc::default());
        let done = ended.iter().take_while(|e| e.outcome == Outcome::Done(None)).count();
        assert!(done > 0, "{ended:?}");
        steps.drain(..done);
        if let Some(last) = ended.get(done) {
            assert_eq!(last.outcome, Outcome::Unknown(Cause::Timeout));
            assert_eq!(ended.len(), done + 1);
            break;
        }
    }
    if made.platform.quarantined().is_empty() {
        let ended = made.platform.execute_brief(steps, LIMIT, made.deadline(), &Arc::default());
        assert_eq!(ended[0].outcome, Outcome::Unknown(Cause::Timeout));
    }
    assert_eq!(made.platform.quarantined(), [name("bad")]);
    assert_eq!(made.see().components.keys().copied().collect::<Vec<_>>(), [name("b"), name("c")]);
    made.wait(Duration::from_secs(5));
    assert!(made.platform.quarantined().is_empty());
    assert_eq!(made.see().components.keys().copied().collect::<Vec<_>>(), [name("b"), name("c")], "nothing else began");
    // Once it is told to stop it begins no second one.
    let stop = Arc::new(AtomicBool::new(true));
    let stopped = made.platform.execute_brief(vec![destroy("c"), destroy("b")], LIMIT, until(), &stop);
    assert!(matches!(stopped[..], [Ended { outcome: Outcome::Done(None), .. }]), "{stopped:?}");
    assert_eq!(made.see().components.keys().copied().collect::<Vec<_>>(), [name("b")]);
    let wrong = made.platform.execute_brief(vec![create("b"), create("e")], LIMIT, until(), &Arc::default());
    assert!(matches!(wrong[..], [Ended { outcome: Outcome::NotDone(Cause::Refused(_)), .. }]), "{wrong:?}");
}

pub fn what_is_not_done_by_its_deadline_does_not_happen_later(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.does(create("a"));
    for (step, there) in [(destroy("a"), [true, false]), (create("b"), [false, true])] {
        // Its deadline is past: it may happen all the same, or not, but not when it was answered that it did not.
        let outcome = made.platform.execute(&step, made.clock.now());
        made.wait(Duration::from_secs(5));
        let happened = match outcome {
            Outcome::Done(_) => 1,
            Outcome::NotDone(_) => 0,
            Outcome::Unknown(_) => continue,
        };
        assert_eq!(made.state_of(&step.component().to_string()).is_some(), there[happened], "`{step}`: {outcome:?}");
        assert!(made.platform.quarantined().is_empty());
    }
}

pub fn unknown_is_settled_by_reading_back(bed: &dyn Bed) {
    let made = bed.make(&[("configure", Trouble::Hang(None))]);
    made.all(up_to("configure").1);
    assert!(matches!(made.run(&step_of("configure")), Outcome::Unknown(_)));
    let seen = made.platform.observe_component(name("bad"), made.deadline()).expect("an answer");
    let seen = seen.expect("it is still there");
    assert_eq!(seen.state, RunState::Unconfigured, "a call that has not returned has not happened");
}

pub fn events_of_components_reach_the_sink(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.all([create("a"), state("a", Configure), state("a", Start)]);
    let heard = made.listen();
    (made.raise)("a", "e_hello");
    made.wait(Duration::from_secs(1));
    let heard = heard.lock().unwrap();
    assert!(
        matches!(&heard[..], [PlatformEvent::Raised { event, component, .. }]
            if event.as_str() == "e_hello" && *component == name("a")),
        "{heard:?}"
    );
}

pub fn prepared_steps_do_what_executed_ones_do(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.all([create("a"), state("a", Configure), state("a", Start)]);
    let steps = [
        set("a.gains", Value::floats(&[0.1, 0.2, 0.3])),
        write("a.n", Some(Value::Int(7))),
        state("a", Stop),
        state("a", Start),
        write("a.n", None),
    ];
    let Some(mut prepared) = made.platform.prepare(&steps) else {
        return; // A platform need not support it.
    };
    for (index, step) in steps.iter().enumerate().take(3) {
        let outcome = prepared.execute(index, None, made.clock.now(), made.deadline());
        assert!(matches!(outcome, Outcome::Done(_)), "{step}: {outcome:?}");
    }
    let seen = made.see();
    assert_eq!(seen.components[&name("a")].properties[&ident("gains")], Value::floats(&[0.1, 0.2, 0.3]));
    assert_eq!(seen.components[&name("a")].state, RunState::Stopped);
    assert_eq!(seen.ports, written(&[("a.n", Value::Int(7))]));
    let again = prepared.execute(2, None, made.clock.now(), made.deadline());
    assert!(matches!(again, Outcome::NotDone(_)), "a prepared step is checked as well: {again:?}");
    let back = Value::floats(&[1.0; 3]);
    assert!(matches!(prepared.execute(0, Some(&back), made.clock.now(), made.deadline()), Outcome::Done(_)));
    assert!(matches!(prepared.execute(1, Some(&Value::Int(8)), made.clock.now(), made.deadline()), Outcome::Done(_)));
    assert_eq!(made.see().ports, written(&[("a.n", Value::Int(8))]));
    assert!(matches!(prepared.execute(4, None, made.clock.now(), made.deadline()), Outcome::Done(_)));
    assert!(matches!(prepared.execute(3, None, made.clock.now(), made.deadline()), Outcome::Done(_)));
    let seen = made.see();
    assert!(seen.ports.is_empty());
    assert_eq!(seen.components[&name("a")].properties[&ident("gains")], back);
    assert_eq!(seen.components[&name("a")].state, RunState::Running);
}

pub fn one_component_observed_is_the_one_of_the_whole(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.all([create("a"), create("b"), state("a", Configure), set("a.gain", 2.5)]);
    let whole = made.see();
    for component in ["a", "b", "nobody"] {
        let one = made.platform.observe_component(name(component), made.deadline()).expect("an answer");
        assert_eq!(one.as_ref(), whole.components.get(&name(component)), "{component}");
    }
}

pub fn some_components_observed_are_those_of_the_whole(bed: &dyn Bed) {
    let made = bed.make(&[]);
    made.all([create("a"), create("b"), create("c"), create("d"), state("a", Configure), set("a.gain", 2.5)]);
    made.all([connect("a.y", "b.u", Data), connect("a.y2", "b.q", Buffer(3)), connect("c.y", "b.q", Buffer(2))]);
    made.all([connect("c.y", "c.u", Data), connect("a.w", "d.v", Data), connect("a.y", "c.u_plain", Data)]);
    made.all([write("a.u", Some(Value::Float(1.0))), write("b.n", Some(Value::Int(2)))]);
    let check = |made: &Made| {
        for asked in
            [&[][..], &["a"], &["b"], &["c"], &["d"], &["b", "c"], &["nobody", "d", "d"], &["a", "b", "c", "d"]]
        {
            let names: Vec<ComponentName> = asked.iter().map(|n| name(n)).collect();
            let some = made.platform.observe_some(&names, made.deadline()).expect("an answer");
            let mut whole = made.see();
            whole.components.retain(|n, _| names.contains(n));
            whole.connections.retain(|(f, t), _| names.contains(&f.component) || names.contains(&t.component));
            whole.ports.retain(|port, _| names.contains(&port.component));
            assert_eq!(some, whole, "{asked:?}");
        }
    };
    check(&made);
    made.all([disconnect("a.y2", "b.q"), disconnect("c.y", "c.u"), write("a.u", None)]);
    check(&made);
    made.all([disconnect("a.w", "d.v"), destroy("d"), create("d"), connect("c.w", "d.v", Data)]);
    check(&made);
}

pub fn safe_steps_do_what_others_do(bed: &dyn Bed) {
    let made = bed.make(&[]);
    let safe = |step: Step| made.platform.execute_safe(&step, made.deadline());
    made.does(create("a"));
    for step in
        [set("a.gain", 2.0), write("a.n", Some(Value::Int(1))), state("a", Configure), call("a.nothing", vec![])]
    {
        assert_eq!(safe(step.clone()), Outcome::Done(None), "{step}");
    }
    let before = made.see();
    for step in [set("a.gain", 11.0), state("a", Configure), call("a.unknown", vec![]), call("b.nothing", vec![])] {
        assert!(matches!(safe(step.clone()), Outcome::NotDone(Cause::Refused(_))), "{step}");
    }
    assert_eq!(made.see(), before);
}
