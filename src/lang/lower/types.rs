//! Component types declared in a deployment.

use super::{by_name, condition, entries, name, names, own_name, text, value};
use crate::lang::grammar::{EFFECT, OPERATION, PORT, PROPERTY, TYPE};
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::model::finding::nearest;
use crate::model::{
    ComponentType, Direction, Effect, EventName, Finding, Ident, OperationType, PortType, PropertyType, Resource,
    Tunable, TypeName, ValueType, codes,
};
use std::collections::BTreeMap;
use std::sync::Arc;

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
    ty.doc = doc(cx, &mut fields);
    ty.ports = members(cx, &mut fields, "ports", "u: { direction: in, type: float }", port);
    ty.properties = members(cx, &mut fields, "properties", "k: { type: float, default: 1.0 }", property);
    ty.operations = members(cx, &mut fields, "operations", "reset: { effect: none }", operation);
    let raised = names::<EventName>(cx, &mut fields, "raises", "`raises`");
    ty.raises = raised.into_iter().map(|(event, _)| (event, String::new())).collect();
    ty.start_after = fields.names(cx, "start_after");
    ty.stop_before = fields.names(cx, "stop_before");
    ty.actuator = fields.truth(cx, "actuator").unwrap_or_default();
    for start in fields.choices(cx, "moves", &[("start", true), ("stop", false)]) {
        let mark = if start { &mut ty.moves.start } else { &mut ty.moves.stop };
        *mark = true;
    }
    for which in fields.choices(cx, "irreversible", &[("configure", 0), ("stop", 1), ("destroy", 2)]) {
        let lost = &mut ty.irreversible;
        *[&mut lost.configure, &mut lost.stop, &mut lost.destroy][which] = true;
    }
    ty.exclusive = resources(cx, &mut fields);
    fields.finish(cx);
    type_name.map(|_| ty)
}

/// What is needed for itself, each with the mistake in its text.
fn resources(cx: &mut Cx, fields: &mut Fields) -> Vec<Resource> {
    let mut read = Vec::new();
    for node in fields.several(cx, "exclusive") {
        let Some(text) = text(cx, &node, "`exclusive`", "exclusive: [can0]") else { continue };
        match Resource::parse(&text) {
            Ok(resource) => read.push(resource),
            Err(why) => cx.report(
                Finding::error(codes::TEXT_BAD_VALUE, format!("`{text}` names nothing that a component could hold: {why}"))
                    .at(node.origin)
                    .help("write a name, `exclusive: [can0]`, or one with the value of a property, `exclusive: [\"can:{bus}\"]`"),
            ),
        }
    }
    read
}

fn doc(cx: &mut Cx, fields: &mut Fields) -> String {
    fields.text(cx, "doc").unwrap_or_default()
}

fn unit(cx: &mut Cx, fields: &mut Fields) -> Option<Arc<str>> {
    fields.text(cx, "unit").map(Arc::from)
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
    let direction = fields.choice(cx, "direction", Direction::WORDS);
    let ty = fields.take(cx, "type").and_then(|node| value_type(cx, node));
    let unit = unit(cx, &mut fields);
    let buffered = fields.truth(cx, "buffered").unwrap_or_default();
    let required = fields.truth(cx, "required").unwrap_or_default();
    let doc = doc(cx, &mut fields);
    fields.finish(cx);
    if required && direction == Some(Direction::Out) {
        let finding = Finding::error(codes::TEXT_BAD_VALUE, "only an in-port can be required");
        cx.report(
            finding.at(entry.origin).help("leave `required` out: who needs the samples says so at its own in-port"),
        );
    }
    Some(PortType { direction: direction?, ty: ty?, unit, buffered, required, doc, origin: entry.origin })
}

fn property(cx: &mut Cx, entry: Entry) -> Option<PropertyType> {
    let mut fields = Fields::of(cx, entry.value, &PROPERTY)?;
    let ty = fields.take(cx, "type").and_then(|node| value_type(cx, node));
    let default = fields.take(cx, "default");
    let (min, max) = (fields.number(cx, "min"), fields.number(cx, "max"));
    let tunable = fields.choice(cx, "tunable", Tunable::WORDS).unwrap_or_default();
    let unit = unit(cx, &mut fields);
    let doc = doc(cx, &mut fields);
    fields.finish(cx);
    let property = PropertyType { ty: ty?, default: None, min, max, tunable, unit, doc, origin: entry.origin };
    Some(fitting(cx, property, default, "a property"))
}

/// A property, or what is like one, with its default, if both are in order.
pub(super) fn fitting(cx: &mut Cx, mut property: PropertyType, default: Option<Node>, what: &str) -> PropertyType {
    let default_origin = default.as_ref().map_or(property.origin, |node| node.origin);
    let default = default.and_then(|node| value(cx, node, "`default`"));
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
                cx.report(finding.at(default_origin).help(format!(
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
    let mut args = Vec::new();
    if let Some(node) = fields.take(cx, "args") {
        match node.kind {
            Kind::List(list) => args.extend(list.into_iter().filter_map(|node| value_type(cx, node))),
            _ => cx.wrong(&node, "`args`", "a list of types", fields.row("args").example),
        }
    }
    let returns = fields.take(cx, "returns").and_then(|node| value_type(cx, node));
    let effect = fields.take(cx, "effect").and_then(|node| effect(cx, node)).unwrap_or(Effect::Irreversible);
    let moves = fields.truth(cx, "moves").unwrap_or_default();
    let settled_by = fields.take(cx, "settled_by").and_then(|node| condition::condition(cx, node, 0));
    let doc = doc(cx, &mut fields);
    fields.finish(cx);
    Some(OperationType { args, returns, effect, moves, settled_by, doc, origin: entry.origin })
}

/// `none`, `irreversible`, or `undo: OPERATION`: in a flow map `{…, effect: undo: park}` YAML allows no second colon, so
/// the text `undo: park` in quotes and the map `{ undo: park }` are both taken.
fn effect(cx: &mut Cx, node: Node) -> Option<Effect> {
    match &node.kind {
        Kind::Str(text) => {
            if let Some(operation) = text.strip_prefix("undo:") {
                let node = Node::new(Kind::Str(operation.trim().into()), node.origin);
                return name(cx, &node, "an operation", EFFECT.example).map(Effect::Undo);
            }
            let words = ["none", "irreversible"];
            match &**text {
                "none" => return Some(Effect::None),
                "irreversible" => return Some(Effect::Irreversible),
                _ => {}
            }
            let help = match nearest(text, words) {
                Some(near) => format!("did you mean `{near}`?"),
                None => "known values: `none`, `irreversible`, `{ undo: OPERATION }`".to_owned(),
            };
            let (origin, message) = (cx.place(&node), format!("`effect` cannot be `{text}`"));
            cx.report(Finding::error(codes::TEXT_BAD_VALUE, message).at(origin).help(help));
            None
        }
        _ => {
            if !matches!(node.kind, Kind::Map(_)) {
                cx.wrong(&node, "`effect`", "`none`, `irreversible` or a table with `undo`", EFFECT.example);
                return None;
            }
            let mut fields = Fields::of(cx, node, &EFFECT)?;
            let operation = fields.name(cx, "undo");
            fields.finish(cx);
            operation.map(Effect::Undo)
        }
    }
}

/// A type: a text (`float`, `"float[3]"`), or a record as a map (`{x: float, y: float}`).
pub(super) fn value_type(cx: &mut Cx, node: Node) -> Option<ValueType> {
    match node.kind {
        Kind::Str(text) => match text.parse() {
            Ok(ty) => Some(ty),
            Err(_) => {
                let origin = node.origin;
                let words = ["bool", "int", "float", "string", "event"];
                let near = crate::model::finding::nearest(&text, words);
                let help = near.map_or_else(
                    || {
                        "types are bool, int, float, string, event, \"float[3]\", \"float[]\", {x: float, y: float}"
                            .to_owned()
                    },
                    |near| format!("did you mean `{near}`?"),
                );
                cx.report(
                    Finding::error(codes::TYPE_BAD_TYPE, format!("`{text}` is not a type")).at(origin).help(help),
                );
                None
            }
        },
        Kind::Map(entries) if !entries.is_empty() => {
            let length = entries.len();
            let one = |cx: &mut Cx, _, entry: Entry| value_type(cx, entry.value);
            let fields = by_name(cx, entries, "a field of a record", "{x: float, y: float}", one);
            (fields.len() == length).then_some(ValueType::Record(fields))
        }
        // `float[3]` without quotes inside brackets is read by YAML as a list: say so.
        Kind::List(_) => {
            cx.wrong(&node, "a type", "a text or a record", "\"float[3]\" (in quotes)");
            None
        }
        _ => {
            cx.wrong(&node, "a type", "a text or a record", "float");
            None
        }
    }
}
