//! Rules of single steps: what each needs, and what it does.

use super::bed::Bed;
use super::trial::{RuleEnds, Trial, broken, holds, same};
use super::words::*;
use crate::model::{ComponentSnapshot, Policy, RunState, Transition, Value, ValueType};
use {Policy::Buffer, Policy::Data, Transition::Cleanup, Transition::Configure, Transition::Start, Transition::Stop};

/// The component, which must be there.
fn seen(t: &Trial, component: &str) -> RuleEnds<ComponentSnapshot> {
    let found = t.see()?.components.remove(&name(component));
    found.ok_or_else(|| broken("observing", format_args!("`{component}`"), "it is not there"))
}

fn ports_are(t: &Trial, with: &str, expected: &[(&str, Value)]) -> RuleEnds {
    same(with, &t.see()?.ports, &written(expected))
}

pub fn create_needs_a_known_type_and_a_free_name(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.is_empty("a platform that was just made")?;
    t.refuses(create_of("Nothing", "a", Vec::new()))?;
    t.does(create("a"))?;
    t.refuses(create("a"))?;
    let a = seen(&t, "a")?;
    same("`create a`, its type", &a.ty.as_str(), &"Plant")?;
    same("`create a`, its run state", &a.state, &RunState::Unconfigured)?;
    same("`create a`, its activity", &a.activity, &None)?;
    same("`create a`, its properties", &a.properties.into_values().collect::<Vec<_>>(), &plant_values())?;
    let system = t.see()?;
    holds(system.ports.is_empty(), "`create a`", "no written port", format_args!("{:?}", system.ports))?;
    holds(system.connections.is_empty(), "`create a`", "no connection", format_args!("{:?}", system.connections))
}

pub fn create_needs_every_value_of_its_type_and_within_its_limits(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    let with = |at: usize, value: Value| {
        let mut properties = plant_values();
        properties[at] = value;
        create_of("Plant", "a", properties)
    };
    t.refuses(create_of("Plant", "a", vec![Value::str("none")]))?;
    t.refuses(with(1, Value::Bool(true)))?;
    t.refuses(with(1, Value::Float(10.5)))?;
    t.refuses(with(1, Value::Float(f64::NAN)))?;
    t.refuses(with(2, Value::floats(&[1.0, 2.0])))?;
    t.refuses(with(2, Value::floats(&[1.0, 2.0, -0.5])))?;
    t.refuses(with(4, pose(0.0, 1.5)))?;
    t.does(with(1, Value::Float(10.0))).map(drop)
}

pub fn run_states_move_along_the_legal_path_only(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.refuses(state("a", Configure))?;
    t.does(create("a"))?;
    let mut at = RunState::Unconfigured;
    // A walk that tries every transition in every state and comes back.
    for step in [Configure, Start, Stop, Cleanup] {
        for transition in [Configure, Start, Stop, Cleanup] {
            if !transition.allowed_in(at) {
                t.refuses(state("a", transition))?;
            }
        }
        t.does(state("a", step))?;
        at = step.target();
        t.stands(step, "a", Some(at))?;
    }
    Ok(())
}

pub fn destroy_needs_unconfigured_and_no_connections(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.refuses(destroy("a"))?;
    t.all([create("a"), create("b"), state("a", Configure)])?;
    t.refuses(destroy("a"))?;
    t.does(state("a", Start))?;
    t.refuses(destroy("a"))?;
    t.all([state("a", Stop), state("a", Cleanup), connect("a.y", "b.u", Data)])?;
    t.refuses(destroy("a"))?;
    t.refuses(destroy("b"))?;
    t.all([disconnect("a.y", "b.u"), write("a.u", Some(Value::Float(1.0))), destroy("a"), destroy("b")])?;
    t.is_empty("everything was destroyed")
}

pub fn a_property_takes_its_type_within_its_limits(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.refuses(set("a.gain", 1.0))?;
    t.does(create("a"))?;
    t.refuses(set("a.nothing", 1.0))?;
    t.refuses(set("a.gain", true))?;
    t.refuses(set("a.gain", 11.0))?;
    t.refuses(set("a.gain", f64::INFINITY))?;
    t.refuses(set("a.mode", 1.0))?;
    t.refuses(set("a.gains", Value::floats(&[1.0, 2.0, 10.5])))?;
    t.refuses(set("a.gains", Value::floats(&[1.0])))?;
    t.refuses(set("a.pose", pose(2.0, 0.0)))?;
    let taken = [("gain", Value::Float(10.0)), ("gains", Value::floats(&[0.0, 1.0, 2.0])), ("pose", pose(1.0, -1.0))];
    t.all(taken.iter().map(|(property, value)| set(&format!("a.{property}"), value.clone())))?;
    let a = seen(&t, "a")?;
    taken.iter().try_for_each(|(property, value)| {
        same(format_args!("`a.{property}`, which was set"), &a.properties.get(&ident(property)), &Some(value))
    })
}

pub fn a_property_is_set_only_where_it_is_tunable(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.does(create("a"))?;
    t.all([set("a.device", "x"), set("a.mode", 1), set("a.gain", 2.0)])?;
    t.does(state("a", Configure))?;
    t.refuses(set("a.device", "y"))?;
    t.all([set("a.mode", 2), set("a.gain", 3.0), state("a", Start)])?;
    t.refuses(set("a.device", "y"))?;
    t.refuses(set("a.mode", 3))?;
    t.does(set("a.gain", 4.0))?;
    t.all([state("a", Stop), state("a", Cleanup)])?;
    let a = seen(&t, "a")?;
    for (property, value) in [("device", Value::str("x")), ("mode", Value::Int(2)), ("gain", Value::Float(4.0))] {
        let with = format!("`a.{property}`, which outlives the run states");
        same(with, &a.properties.get(&ident(property)), &Some(&value))?;
    }
    t.does(set("a.device", "z")).map(drop)
}

pub fn a_data_connection_is_the_only_one_of_its_port(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.all([create("a"), create("b"), create("c")])?;
    t.does(connect("a.y", "b.u", Data))?;
    t.refuses(connect("a.y", "b.u", Data))?;
    t.refuses(connect("a.y", "b.u", Buffer(4)))?;
    t.refuses(connect("c.y", "b.u", Data))?;
    t.refuses(connect("c.y", "b.u", Buffer(4)))?;
    t.does(connect("a.y", "c.u", Data))?;
    t.does(disconnect("a.y", "b.u"))?;
    t.refuses(disconnect("a.y", "b.u"))?;
    t.all([connect("a.y", "b.u", Buffer(4)), connect("a.y2", "b.u", Buffer(2))])?;
    t.refuses(connect("c.y", "b.u", Data))?;
    t.refuses(connect("c.y", "b.u", Buffer(0)))?;
    t.refuses(connect("a.y", "b.q", Data))?;
    t.all([connect("a.y", "b.q", Buffer(1)), connect("c.y", "b.q", Buffer(3))])?;
    let expected = [
        ("a.y", "b.u", Buffer(4)),
        ("a.y2", "b.u", Buffer(2)),
        ("a.y", "b.q", Buffer(1)),
        ("c.y", "b.q", Buffer(3)),
        ("a.y", "c.u", Data),
    ];
    let expected = expected.iter().map(|(from, to, policy)| ((member(from), member(to)), *policy)).collect();
    same("what was connected", &t.see()?.connections, &expected)
}

pub fn types_units_and_directions_of_connected_ports_agree(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.refuses(connect("a.y", "b.u", Data))?;
    t.all([create("a"), create("b")])?;
    for (from, to) in [
        ("a.y", "b.nothing"),
        ("a.nothing", "b.u"),
        ("a.u", "b.u"),
        ("a.y", "b.y"),
        ("a.y", "b.u_m"),
        ("a.y", "b.n"),
        ("a.y", "b.v"),
        ("a.said", "b.u"),
        ("a.y", "b.heard"),
    ] {
        t.refuses(connect(from, to, Data))?;
    }
    t.all([connect("a.y", "b.u_plain", Data), connect("a.w", "b.v", Data)])
}

pub fn event_ports_take_many_connections(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.all([create("a"), create("b"), create("c")])?;
    t.all([connect("a.said", "c.heard", Data), connect("b.said", "c.heard", Data)])?;
    t.refuses(connect("a.said", "c.heard", Data))?;
    t.does(connect("c.said", "c.heard", Buffer(8)))?;
    same("how many are connected", &t.see()?.connections.len(), &3)
}

pub fn port_write_needs_a_port_that_nothing_drives(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.refuses(write("b.u", Some(Value::Float(1.0))))?;
    t.all([create("a"), create("b")])?;
    t.refuses(write("b.nothing", Some(Value::Float(1.0))))?;
    t.refuses(write("b.y", Some(Value::Float(1.0))))?;
    t.refuses(write("b.q", Some(Value::Float(1.0))))?;
    t.refuses(write("b.heard", Some(Value::str("e"))))?;
    t.refuses(write("b.u", Some(Value::Bool(true))))?;
    t.refuses(write("b.u", Some(Value::Float(f64::NAN))))?;
    t.refuses(write("b.v", Some(Value::floats(&[1.0]))))?;
    t.does(connect("a.y", "b.u", Data))?;
    t.refuses(write("b.u", Some(Value::Float(1.0))))?;
    t.does(write("b.v", Some(Value::floats(&[1.0, 2.0, 3.0]))))?;
    t.all([state("b", Configure), state("b", Start), write("b.n", Some(Value::Int(3)))])?;
    ports_are(&t, "what was written", &[("b.v", Value::floats(&[1.0, 2.0, 3.0])), ("b.n", Value::Int(3))])
}

pub fn a_written_value_survives_a_connection_and_never_written_comes_back(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.all([create("a"), create("b")])?;
    let there = [("b.u", Value::Float(2.0))];
    t.all([write("b.u", Some(Value::Float(1.0))), write("b.u", Some(Value::Float(2.0)))])?;
    ports_are(&t, "what was written twice", &there)?;
    t.does(connect("a.y", "b.u", Data))?;
    ports_are(&t, "what was written, while connected", &there)?;
    t.does(disconnect("a.y", "b.u"))?;
    ports_are(&t, "what was written, disconnected again", &there)?;
    t.does(write("b.u", None))?;
    ports_are(&t, "what was written, taken back", &[])
}

pub fn a_component_may_be_connected_to_itself(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.all([create("a"), connect("a.y", "a.u", Data)])?;
    t.refuses(destroy("a"))?;
    t.all([disconnect("a.y", "a.u"), destroy("a")])?;
    t.is_empty("`destroy a`")
}

pub fn operations_need_their_arguments_and_answer_their_type(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.refuses(call("a.nothing", vec![]))?;
    t.all([create("a"), state("a", Configure)])?;
    t.refuses(call("a.unknown", vec![]))?;
    t.refuses(call("a.nothing", vec![Value::Int(1)]))?;
    t.refuses(call("a.scale", vec![Value::Float(1.0)]))?;
    t.refuses(call("a.scale", vec![Value::Float(1.0), Value::Float(2.0)]))?;
    same("`a.nothing`, what it answers", &t.does(call("a.nothing", vec![]))?, &None)?;
    let answer = t.does(call("a.scale", vec![Value::Float(1.0), Value::Int(2)]))?;
    let is = answer.as_ref().is_some_and(|answer| answer.is_of(&ValueType::Float));
    holds(is, "`a.scale`, what it answers", "a float", format_args!("{answer:?}"))
}
