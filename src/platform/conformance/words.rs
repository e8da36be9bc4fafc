//! The types that the rules are tried with, and short words for steps.

use crate::model::{
    Call, ComponentName, ComponentType, Direction, Effect, Ident, MemberRef, OperationType, Policy, PortType,
    PropertyType, Step, Transition, Tunable, TypeName, Value,
};
use std::collections::BTreeMap;

fn port(direction: Direction, ty: &str, unit: Option<&str>, buffered: bool) -> PortType {
    PortType { unit: unit.map(Into::into), buffered, ..PortType::new(direction, ty.parse().expect("a type")) }
}

fn property(ty: &str, default: Option<Value>, limits: Option<(f64, f64)>, tunable: Tunable) -> PropertyType {
    let (min, max) = limits.unzip();
    PropertyType { default, min, max, ..PropertyType::new(ty.parse().expect("a type"), tunable) }
}

fn operation(args: &[&str], returns: Option<&str>) -> OperationType {
    OperationType {
        args: args.iter().map(|t| t.parse().expect("a type")).collect(),
        returns: returns.map(|t| t.parse().expect("a type")),
        ..OperationType::new(Effect::None)
    }
}

/// The types that a platform is tried with. `Plant` has a member of every kind; `Misbehaving` is as plain as can be, and does in
/// its hooks what the bed was asked for.
pub fn types() -> Vec<ComponentType> {
    let mut plant = ComponentType::new("Plant", "Has a member of every kind.");
    let (i, o) = (Direction::In, Direction::Out);
    for (name, ty) in [
        ("u", port(i, "float", Some("N"), false)),
        ("u_plain", port(i, "float", None, false)),
        ("u_m", port(i, "float", Some("m"), false)),
        ("v", port(i, "float[3]", None, false)),
        ("n", port(i, "int", None, false)),
        ("q", port(i, "float", Some("N"), true)),
        ("heard", port(i, "event", None, false)),
        ("y", port(o, "float", Some("N"), false)),
        ("y2", port(o, "float", Some("N"), false)),
        ("w", port(o, "float[3]", None, false)),
        ("said", port(o, "event", None, false)),
    ] {
        plant.ports.insert(ident(name), ty);
    }
    for (name, ty) in [
        ("gain", property("float", Some(Value::Float(1.0)), Some((0.0, 10.0)), Tunable::Always)),
        ("gains", property("float[3]", Some(Value::floats(&[1.0; 3])), Some((0.0, 10.0)), Tunable::Always)),
        ("mode", property("int", None, None, Tunable::Stopped)),
        ("device", property("string", Some(Value::str("none")), None, Tunable::Unconfigured)),
        ("pose", property("{x: float, y: float}", Some(pose(0.0, 0.0)), Some((-1.0, 1.0)), Tunable::Always)),
    ] {
        plant.properties.insert(ident(name), ty);
    }
    plant.operations.insert(ident("nothing"), operation(&[], None));
    plant.operations.insert(ident("scale"), operation(&["float", "int"], Some("float")));
    let mut misbehaving = ComponentType::new("Misbehaving", "Does in its hooks what the test asks for.");
    for name in ["work", "brake", "nothing"] {
        misbehaving.operations.insert(ident(name), operation(&[], None));
    }
    misbehaving.operations.insert(ident("echo"), operation(&["int"], None));
    vec![plant, misbehaving]
}

pub fn pose(x: f64, y: f64) -> Value {
    Value::Record(vec![(ident("x"), Value::Float(x)), (ident("y"), Value::Float(y))])
}

pub fn ident(text: &str) -> Ident {
    Ident::new(text).expect("a name")
}

pub fn name(text: &str) -> ComponentName {
    ComponentName::new(text).expect("a name")
}

pub fn member(text: &str) -> MemberRef {
    MemberRef::new(text).expect("a member")
}

/// The values of a `Plant`, in the order of its type: device, gain, gains, mode, pose.
pub fn plant_values() -> Vec<Value> {
    vec![Value::str("none"), Value::Float(1.0), Value::floats(&[1.0; 3]), Value::Int(0), pose(0.0, 0.0)]
}

/// A component of that type.
pub fn create_of(ty: &str, component: &str, properties: Vec<Value>) -> Step {
    let ty = TypeName::new(ty).expect("a name");
    Step::Create { component: name(component), ty, activity: None, properties }
}

pub fn create(component: &str) -> Step {
    create_of("Plant", component, plant_values())
}

pub fn create_misbehaving() -> Step {
    create_of("Misbehaving", "bad", Vec::new())
}

pub fn state(component: &str, transition: Transition) -> Step {
    Step::State { component: name(component), transition }
}

pub fn destroy(component: &str) -> Step {
    Step::Destroy { component: name(component) }
}

pub fn connect(from: &str, to: &str, policy: Policy) -> Step {
    Step::Connect { from: member(from), to: member(to), policy }
}

pub fn disconnect(from: &str, to: &str) -> Step {
    Step::Disconnect { from: member(from), to: member(to) }
}

pub fn set(property: &str, value: impl Into<Value>) -> Step {
    Step::PropertySet { property: member(property), value: value.into() }
}

pub fn write(port: &str, value: Option<Value>) -> Step {
    Step::PortWrite { port: member(port), value }
}

pub fn call(operation: &str, args: Vec<Value>) -> Step {
    Step::Operation(Call { operation: member(operation), args })
}

pub fn written(pairs: &[(&str, Value)]) -> BTreeMap<MemberRef, Value> {
    pairs.iter().map(|(port, value)| (member(port), value.clone())).collect()
}
