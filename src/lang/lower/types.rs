//! Component types declared in a deployment.

use super::{by_name, entries, own_name};
use crate::lang::bound;
use crate::lang::grammar::{OPERATION, PORT, PROPERTY, TYPE};
use crate::lang::tree::{Cx, Entry, Fields, Node};
use crate::model::{
    ComponentType, Direction, Effect, Finding, Ident, OperationType, Origin, PortType, PropertyType, Tunable, TypeName,
    ValueType, codes,
};
use std::collections::BTreeMap;

/// The map of declared types.
pub fn types(cx: &mut Cx, node: Node) -> Vec<ComponentType> {
    let entries = entries(cx, node, "`types`", "types: { Gain: { ports: {...} } }");
    entries.into_iter().filter_map(|entry| component_type(cx, entry)).collect()
}

fn component_type(cx: &mut Cx, entry: Entry) -> Option<ComponentType> {
    let type_name = own_name::<TypeName>(cx, &entry, "a component type", "Gain");
    let mut fields = Fields::of(cx, entry.value, &TYPE)?;
    let mut ty = ComponentType::new(type_name.as_ref().map_or("unnamed", TypeName::as_str), "");
    ty.origin = entry.origin;
    ty.ports = members(cx, &mut fields, "ports", "u: { direction: in, type: float }", port);
    ty.properties = members(cx, &mut fields, "properties", "k: { type: float, default: 1.0 }", property);
    ty.operations = members(cx, &mut fields, "operations", "reset: { effect: none }", operation);
    bound::TYPE.read(&mut ty, &mut fields, cx);
    fields.finish(cx);
    type_name.map(|_| ty)
}

/// The members of one kind, each lowered by `one`.
fn members<T>(
    cx: &mut Cx,
    fields: &mut Fields,
    key: &'static str,
    example: &str,
    one: impl Fn(&mut Cx, Entry) -> Option<T>,
) -> BTreeMap<Ident, T> {
    let Some(node) = fields.take(cx, key) else { return BTreeMap::new() };
    let entries = entries(cx, node, &format!("`{key}`"), example);
    let one = |cx: &mut Cx, _, entry: Entry| one(cx, entry);
    by_name(cx, entries, "a member of a component type", example, one).into_iter().collect()
}

fn port(cx: &mut Cx, entry: Entry) -> Option<PortType> {
    let mut fields = Fields::of(cx, entry.value, &PORT)?;
    let mut port = PortType { origin: entry.origin, ..PortType::new(Direction::In, ValueType::Bool) };
    let is_whole = bound::PORT.read(&mut port, &mut fields, cx);
    fields.finish(cx);
    if port.required && port.direction == Direction::Out {
        let finding = Finding::error(codes::TEXT_BAD_VALUE, "only an in-port can be required");
        cx.report(
            finding.at(entry.origin).help("leave `required` out: who needs the samples says so at its own in-port"),
        );
    }
    is_whole.then_some(port)
}

fn property(cx: &mut Cx, entry: Entry) -> Option<PropertyType> {
    let mut fields = Fields::of(cx, entry.value, &PROPERTY)?;
    let default_at = fields.value_place("default");
    let mut property = PropertyType { origin: entry.origin, ..PropertyType::new(ValueType::Bool, Tunable::default()) };
    let is_whole = bound::PROPERTY.read(&mut property, &mut fields, cx);
    fields.finish(cx);
    is_whole.then(|| fitting(cx, property, default_at, "a property"))
}

/// A property, or what is like one, with its default (written at `default_at`), if both are in order.
pub(super) fn fitting(cx: &mut Cx, mut property: PropertyType, default_at: Option<Origin>, what: &str) -> PropertyType {
    let default = property.default.take();
    let origin = property.origin;
    if property.ty == ValueType::Event {
        let finding = Finding::error(codes::TYPE_BAD_TYPE, format!("{what} cannot be of type `event`"));
        cx.report(finding.at(origin).help("only ports carry events"));
    }
    if let (Some(min), Some(max)) = (property.min, property.max)
        && min > max
    {
        let finding = Finding::error(codes::TYPE_BAD_DEFAULT, format!("`min` ({min}) is larger than `max` ({max})"));
        cx.report(finding.at(origin).help("no value would be allowed: exchange them"));
    } else if let Some(default) = default {
        match property.fit(default) {
            Ok(default) => property.default = Some(default),
            Err(error) => {
                let finding = Finding::error(codes::TYPE_BAD_DEFAULT, format!("the default is not allowed: {error}"));
                cx.report(finding.at(default_at.unwrap_or(origin)).help(format!(
                    "a default is of the {}'s type and within its limits",
                    what.trim_start_matches("a ")
                )));
            }
        }
    }
    property
}

fn operation(cx: &mut Cx, entry: Entry) -> Option<OperationType> {
    let mut fields = Fields::of(cx, entry.value, &OPERATION)?;
    let mut operation = OperationType { origin: entry.origin, ..OperationType::new(Effect::Irreversible) };
    bound::OPERATION.read(&mut operation, &mut fields, cx);
    fields.finish(cx);
    Some(operation)
}
