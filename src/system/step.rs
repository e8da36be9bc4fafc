//! What a step means: when it may happen, what it does to the picture of a system, and which steps undo it.
//!
//! The three stand together, one kind of step after the other, because each is the other two's specification (semantics: *Steps and plans*).
//! What it touches stands beside them, in [`touch`](super::touch).

pub use super::reversibility::Reversibility;
pub use super::touch::{absolute, components, touch_each, touches};
use super::violation::brief;
use super::{ComponentNode, Driven, MemberClass, View, ViewMut, Violation, exclusive};
use crate::model::{
    Call, ComponentName, Direction, Effect, Ident, MemberRef, Policy, PortType, PropertyType, RunState, Step,
    Transition, TypeName, Value, ValueType,
};

/// What undoes a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Undo {
    /// This step.
    One(Step),
    /// These steps, in this order.
    Many(Vec<Step>),
    /// Nothing needs to be undone (an operation without effect), or nothing may be (a faulted state is never restored).
    Nothing,
    /// Nothing can undo it; in words, why.
    Irreversible(String),
}

impl Undo {
    /// The steps that undo it, in order.
    pub fn steps(&self) -> &[Step] {
        match self {
            Self::One(step) => std::slice::from_ref(step),
            Self::Many(steps) => steps,
            Self::Nothing | Self::Irreversible(_) => &[],
        }
    }
}

/// Every false precondition of `step` in `view`; empty: it may happen.
pub fn precondition(step: &Step, view: &impl View) -> Vec<Violation> {
    let mut found = Vec::new();
    match step {
        Step::State { component, transition } => match view.component(*component) {
            None => found.push(Violation::UnknownComponent(*component)),
            Some(node) => {
                move_allowed(node, *transition, &mut found);
                if *transition == Transition::Configure {
                    found.extend(exclusive::taken(node, view));
                }
            }
        },
        Step::Create { component, ty, properties, .. } => create_allowed(*component, *ty, properties, view, &mut found),
        Step::Destroy { component } => destroy_allowed(*component, view, &mut found),
        Step::Connect { from, to, policy } => connect_allowed(*from, *to, *policy, view, &mut found),
        Step::Disconnect { from, to } => {
            if view.link(*from, *to).is_none() {
                // An unknown end is told as such; two known ends are not connected.
                let ends = port_of(*from, view, &mut found).is_some() & port_of(*to, view, &mut found).is_some();
                if ends {
                    found.push(Violation::NotConnected { from: *from, to: *to });
                }
            }
        }
        Step::PropertySet { property, value } => set_allowed(*property, value, view, &mut found),
        Step::PortWrite { port, value } => write_allowed(*port, value.as_ref(), view, &mut found),
        Step::Operation(call) => call_allowed(call, view, &mut found),
    }
    found
}

/// What `step` does to the picture. Its precondition holds.
///
/// # Panics
/// When the precondition does not hold and the picture would become wrong: a broken invariant of the caller.
pub fn effect(step: &Step, view: &mut impl ViewMut) {
    match step {
        Step::State { component, transition } => view.put_state(*component, transition.target()),
        Step::Create { component, ty, activity, properties } => {
            let ty = view.types().get(*ty).cloned().expect("the type of a create is known");
            view.insert_component(ComponentNode::new(*component, ty, *activity, properties.clone()));
        }
        Step::Destroy { component } => view.remove_component(*component),
        Step::Connect { from, to, policy } => view.insert_link(*from, *to, *policy),
        Step::Disconnect { from, to } => view.remove_link(*from, *to),
        Step::PropertySet { property, value } => {
            let at = view.component(property.component).and_then(|n| n.property(property.member)).map(|(i, _)| i);
            view.put_property(property.component, at.expect("the property exists"), value);
        }
        Step::PortWrite { port, value } => {
            let at = view.component(port.component).and_then(|n| n.port(port.member)).map(|(i, _)| i);
            view.put_port(port.component, at.expect("the port exists"), value.as_ref());
        }
        Step::Operation(_) => {}
    }
}

/// What undoes `step`, with the values it will overwrite, seen in the system `before` it. `undo` is the call that a
/// configuration names for an operation's call.
pub fn inverse(step: &Step, undo: Option<&Call>, before: &impl View) -> Undo {
    match step {
        Step::State { component, transition } => {
            let node = before.component(*component);
            let never = node.map(|n| n.ty.irreversible).unwrap_or_default();
            match transition {
                Transition::Configure if never.configure => {
                    Undo::Irreversible(format!("configuring `{component}` cannot be undone"))
                }
                Transition::Stop if never.stop => {
                    Undo::Irreversible(format!("stopping `{component}` cannot be undone"))
                }
                Transition::Cleanup if node.is_some_and(|n| n.state == RunState::Faulted) => Undo::Nothing,
                _ => Undo::One(Step::State { component: *component, transition: transition.inverse() }),
            }
        }
        Step::Create { component, .. } => Undo::One(Step::Destroy { component: *component }),
        Step::Destroy { component } => match before.component(*component) {
            None => Undo::Nothing,
            Some(node) if node.ty.irreversible.destroy => {
                Undo::Irreversible(format!("destroying `{component}` cannot be undone"))
            }
            Some(node) => {
                let create = Step::Create {
                    component: *component,
                    ty: node.ty.name,
                    activity: node.activity,
                    properties: node.properties.clone(),
                };
                let writes = node
                    .written_ports()
                    .map(|(port, value)| Step::PortWrite { port: component.member(port), value: Some(value.clone()) });
                let steps: Vec<Step> = std::iter::once(create).chain(writes).collect();
                Undo::Many(steps)
            }
        },
        Step::Connect { from, to, .. } => Undo::One(Step::Disconnect { from: *from, to: *to }),
        Step::Disconnect { from, to } => match before.link(*from, *to) {
            Some(policy) => Undo::One(Step::Connect { from: *from, to: *to, policy }),
            None => Undo::Nothing,
        },
        Step::PropertySet { property, .. } => {
            match before.component(property.component).and_then(|n| n.value(property.member)) {
                Some(value) => Undo::One(Step::PropertySet { property: *property, value: value.clone() }),
                None => Undo::Nothing,
            }
        }
        Step::PortWrite { port, .. } => match written(*port, before) {
            Some(value) => Undo::One(Step::PortWrite { port: *port, value: value.cloned() }),
            None => Undo::Nothing,
        },
        Step::Operation(call) => {
            if let Some(undo) = undo {
                return Undo::One(Step::Operation(undo.clone()));
            }
            let ty = before.component(call.operation.component).map(|n| &n.ty);
            match ty.and_then(|ty| ty.operations.get(&call.operation.member).map(|o| (ty, &o.effect))) {
                Some((_, Effect::None)) | None => Undo::Nothing,
                Some((ty, Effect::Undo(name))) => {
                    let takes = ty.operations.get(name).is_some_and(|o| !o.args.is_empty());
                    let args = if takes { call.args.clone() } else { Vec::new() };
                    Undo::One(Step::Operation(Call { operation: call.operation.component.member(*name), args }))
                }
                Some((_, Effect::Irreversible)) => {
                    Undo::Irreversible(format!("the call of `{}` cannot be undone", call.operation))
                }
            }
        }
    }
}

/// How far `step` can be undone, given what undoes it.
pub fn reversibility(step: &Step, undo: &Undo) -> Reversibility {
    match (undo, step) {
        (Undo::Irreversible(_), _) => Reversibility::Irreversible,
        (_, Step::Operation(_)) => Reversibility::Compensated,
        _ => Reversibility::Exact,
    }
}

/// Whether doing `step` moves hardware: a call of an operation that is declared to, or starting or stopping a component of
/// a type that says so. Seen in a system in which its component exists; of one that does not, nothing is known to move.
///
/// What moves because of a value (a gain, a reference) cannot be known.
pub fn moves(step: &Step, view: &impl View) -> bool {
    // Looked up only for what may move at all.
    let ty = || view.component(step.component()).map(|node| &node.ty);
    match step {
        Step::State { transition: Transition::Start, .. } => ty().is_some_and(|ty| ty.moves.start),
        Step::State { transition: Transition::Stop, .. } => ty().is_some_and(|ty| ty.moves.stop),
        Step::Operation(call) => {
            ty().is_some_and(|ty| ty.operations.get(&call.operation.member).is_some_and(|o| o.moves))
        }
        Step::State { transition: Transition::Configure | Transition::Cleanup, .. }
        | Step::Create { .. }
        | Step::Destroy { .. }
        | Step::Connect { .. }
        | Step::Disconnect { .. }
        | Step::PropertySet { .. }
        | Step::PortWrite { .. } => false,
    }
}

/// Whether undoing a step moves hardware, seen in the system before it or after it.
pub fn undo_moves(undo: &Undo, view: &impl View) -> bool {
    undo.steps().iter().any(|step| moves(step, view))
}

/// Makes `step` happen in the picture, when its precondition holds.
///
/// # Errors
/// Every false precondition; nothing has changed then.
pub fn apply(step: &Step, view: &mut impl ViewMut) -> Result<(), Vec<Violation>> {
    let found = precondition(step, view);
    if found.is_empty() {
        effect(step, view);
        Ok(())
    } else {
        Err(found)
    }
}

/// What was written to a port: none when there is no such port, `Some(None)` when it was never written.
pub fn written(port: MemberRef, view: &impl View) -> Option<Option<&Value>> {
    let node = view.component(port.component)?;
    let (at, _) = node.port(port.member)?;
    Some(node.written(at))
}

fn create_allowed(name: ComponentName, ty: TypeName, values: &[Value], view: &impl View, found: &mut Vec<Violation>) {
    if view.component(name).is_some() {
        found.push(Violation::Exists(name));
    }
    let Some(ty) = view.types().get(ty) else {
        found.push(Violation::UnknownType { component: name, ty });
        return;
    };
    if ty.properties.len() != values.len() {
        let (expected, found_n) = (ty.properties.len(), values.len());
        found.push(Violation::PropertyCount { component: name, expected, found: found_n });
        return;
    }
    for ((property, declared), value) in ty.properties.iter().zip(values) {
        found.extend(bad_value(name.member(*property), declared, value));
    }
}

fn destroy_allowed(name: ComponentName, view: &impl View, found: &mut Vec<Violation>) {
    let Some(node) = view.component(name) else {
        found.push(Violation::UnknownComponent(name));
        return;
    };
    if !matches!(node.state, RunState::Unconfigured | RunState::Faulted) {
        found.push(Violation::NotUnconfigured { component: name, state: node.state });
    }
    if node.degree > 0 {
        let mut links = Vec::new();
        view.for_each_link(&mut |from, to, _| {
            if from.component == name || to.component == name {
                links.push((from, to));
            }
        });
        links.sort_unstable();
        found.push(Violation::StillConnected { component: name, links });
    }
}

fn port_of<'v>(port: MemberRef, view: &'v impl View, found: &mut Vec<Violation>) -> Option<&'v PortType> {
    let Some(node) = view.component(port.component) else {
        found.push(Violation::UnknownComponent(port.component));
        return None;
    };
    let declared = node.ty.ports.get(&port.member);
    if declared.is_none() {
        found.push(lacks(MemberClass::Port, port, node));
    }
    declared
}

fn lacks(what: MemberClass, member: MemberRef, node: &ComponentNode) -> Violation {
    Violation::UnknownMember { what, member, types: vec![node.ty.name] }
}

/// Out-ports that drive an in-port. A search: only for messages.
fn sources(to: MemberRef, view: &impl View) -> Vec<MemberRef> {
    let mut by = Vec::new();
    view.for_each_link(&mut |from, t, _| {
        if t == to {
            by.push(from);
        }
    });
    by.sort_unstable();
    by
}

fn connect_allowed(from: MemberRef, to: MemberRef, policy: Policy, view: &impl View, found: &mut Vec<Violation>) {
    let source = port_of(from, view, found);
    let sink = port_of(to, view, found);
    if let Some(p) = source.filter(|p| p.direction != Direction::Out) {
        found.push(Violation::NotOut { port: from, declared: p.origin });
    }
    if let Some(p) = sink.filter(|p| p.direction != Direction::In) {
        found.push(Violation::NotIn { port: to, declared: p.origin });
    }
    if policy == Policy::Buffer(0) {
        found.push(Violation::BufferSize(to));
    }
    let (Some(source), Some(sink)) = (source, sink) else { return };
    let ends = ((from, source.origin), (to, sink.origin));
    if source.ty != sink.ty {
        let (from_ty, to_ty) = (source.ty.clone(), sink.ty.clone());
        found.push(Violation::PortTypes { from: ends.0, to: ends.1, from_ty, to_ty });
    }
    if let (Some(from_unit), Some(to_unit)) = (&source.unit, &sink.unit)
        && from_unit != to_unit
    {
        let (from_unit, to_unit) = (from_unit.clone(), to_unit.clone());
        found.push(Violation::PortUnits { from: ends.0, to: ends.1, from_unit, to_unit });
    }
    if view.link(from, to).is_some() {
        found.push(Violation::AlreadyConnected { from, to });
    } else if !sink.is_event() {
        if sink.buffered && policy == Policy::Data {
            found.push(Violation::NeedsBuffer { port: to, declared: sink.origin });
        }
        let Driven { links, data } = view.driven(to);
        if data > 0 || (policy == Policy::Data && links > 0) {
            found.push(Violation::DataAlone { to, by: sources(to, view) });
        }
    }
}

/// Why a property cannot have this value, which is of its type already or can be of none.
pub(crate) fn bad_value(slot: MemberRef, declared: &PropertyType, value: &Value) -> Option<Violation> {
    if declared.takes(value) {
        return None;
    }
    let reason = match declared.fit(value.clone()) {
        Err(error) => error.to_string(),
        Ok(fitted) => unfitted(&declared.ty, &fitted),
    };
    let bounds = match (declared.min, declared.max) {
        (Some(min), Some(max)) => format!(", from {min} to {max}"),
        (Some(min), None) => format!(", at least {min}"),
        (None, Some(max)) => format!(", at most {max}"),
        (None, None) if declared.raises => ", the name of an event or \"\"".to_owned(),
        (None, None) => String::new(),
    };
    let wanted = wanted(&declared.ty, declared.unit.as_deref()) + &bounds;
    Some(Violation::BadValue { slot, value: brief(value), reason, wanted, declared: declared.origin })
}

fn unfitted(ty: &ValueType, value: &Value) -> String {
    format!("expected {ty}, found {} (not converted)", value.describe())
}

/// `float, in N`, and that the number stands alone.
fn wanted(ty: &ValueType, unit: Option<&str>) -> String {
    unit.map_or_else(|| ty.to_string(), |unit| format!("{ty}, in {unit} (written without the unit)"))
}

fn set_allowed(property: MemberRef, value: &Value, view: &impl View, found: &mut Vec<Violation>) {
    let Some(node) = view.component(property.component) else {
        found.push(Violation::UnknownComponent(property.component));
        return;
    };
    let Some((_, declared)) = node.property(property.member) else {
        found.push(lacks(MemberClass::Property, property, node));
        return;
    };
    value_allowed(node, property, declared, value, found);
}

pub(super) fn move_allowed(node: &ComponentNode, transition: Transition, found: &mut Vec<Violation>) {
    if !transition.allowed_in(node.state) {
        found.push(Violation::Transition { component: node.name, transition, state: node.state });
    }
}

pub(super) fn value_allowed(
    node: &ComponentNode,
    property: MemberRef,
    declared: &PropertyType,
    value: &Value,
    found: &mut Vec<Violation>,
) {
    if !declared.tunable.allows(node.state) {
        let (tunable, state, declared) = (declared.tunable, node.state, declared.origin);
        found.push(Violation::NotTunable { property, tunable, state, declared });
    }
    found.extend(bad_value(property, declared, value));
}

fn write_allowed(port: MemberRef, value: Option<&Value>, view: &impl View, found: &mut Vec<Violation>) {
    if let Some(declared) = port_of(port, view, found) {
        sample_allowed(port, declared, value, view, found);
    }
}

pub(super) fn sample_allowed(
    port: MemberRef,
    declared: &PortType,
    value: Option<&Value>,
    view: &impl View,
    found: &mut Vec<Violation>,
) {
    if declared.direction != Direction::In {
        found.push(Violation::WritesOut { port, declared: declared.origin });
        return;
    }
    if declared.is_event() || declared.buffered {
        found.push(Violation::NotWritable { port, event: declared.is_event(), declared: declared.origin });
        return;
    }
    if let Some(value) = value
        && !value.is_of(&declared.ty)
    {
        let reason = match value.clone().fit(&declared.ty) {
            Err(error) => error.to_string(),
            Ok(_) => unfitted(&declared.ty, value),
        };
        let wanted = wanted(&declared.ty, declared.unit.as_deref());
        found.push(Violation::BadValue { slot: port, value: brief(value), reason, wanted, declared: declared.origin });
    }
    if view.driven(port).links > 0 {
        found.push(Violation::Driven { port, by: sources(port, view) });
    }
}

fn call_allowed(call: &Call, view: &impl View, found: &mut Vec<Violation>) {
    let operation = call.operation;
    let Some(node) = view.component(operation.component) else {
        found.push(Violation::UnknownComponent(operation.component));
        return;
    };
    let Some(declared) = node.ty.operations.get::<Ident>(&operation.member) else {
        found.push(lacks(MemberClass::Operation, operation, node));
        return;
    };
    let (wanted, origin) = (|| declared.args.clone(), declared.origin);
    if declared.args.len() != call.args.len() {
        let found_n = call.args.len();
        found.push(Violation::ArgumentCount { operation, wanted: wanted(), found: found_n, declared: origin });
        return;
    }
    for (i, (ty, value)) in declared.args.iter().zip(&call.args).enumerate() {
        if !value.is_of(ty) {
            let reason = match value.clone().fit(ty) {
                Err(error) => error.to_string(),
                Ok(_) => unfitted(ty, value),
            };
            let (position, value) = (i + 1, brief(value));
            found.push(Violation::Argument { operation, position, value, reason, wanted: wanted(), declared: origin });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Catalogue, ComponentType, Moves, OperationType};
    use crate::system::System;
    use std::sync::Arc;

    #[test]
    fn what_moves_is_what_its_type_says() {
        let ident = |name| Ident::new(name).unwrap();
        let mut ty = ComponentType::new("Arm", "");
        ty.moves = Moves { start: true, stop: false };
        for (name, moves) in [("fold", true), ("look", false)] {
            ty.operations.insert(ident(name), OperationType { moves, ..OperationType::new(Effect::None) });
        }
        let mut types = Catalogue::new();
        types.insert(ty);
        let mut system = System::new(Arc::new(types));
        let arm = ComponentName::new("arm").unwrap();
        let create =
            Step::Create { component: arm, ty: TypeName::new("Arm").unwrap(), activity: None, properties: vec![] };
        let state = |transition| Step::State { component: arm, transition };
        let call = |name| Step::Operation(Call { operation: arm.member(ident(name)), args: vec![] });
        assert!(!moves(&state(Transition::Start), &system), "of a component that is not there nothing is known");
        assert!(!moves(&create, &system));
        apply(&create, &mut system).unwrap();
        let moving: Vec<bool> = [Transition::Configure, Transition::Start, Transition::Stop, Transition::Cleanup]
            .map(|transition| moves(&state(transition), &system))
            .to_vec();
        assert_eq!(moving, [false, true, false, false]);
        assert_eq!(["fold", "look", "nothing"].map(|name| moves(&call(name), &system)), [true, false, false]);
        assert!(!moves(&Step::Destroy { component: arm }, &system));
        assert!(undo_moves(&inverse(&state(Transition::Stop), None, &system), &system));
        assert!(!undo_moves(&inverse(&state(Transition::Start), None, &system), &system));
        let Step::Operation(fold) = call("fold") else { unreachable!() };
        assert!(undo_moves(&inverse(&call("look"), Some(&fold), &system), &system));
        assert!(!undo_moves(&Undo::Nothing, &system));
    }
}
