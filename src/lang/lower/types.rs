//! Component types declared in a deployment.

use super::{choice, condition, name, number, one_or_more, text, truth, value};
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::model::{
    ComponentType, Direction, Effect, Finding, Ident, OperationType, PortType, PropertyType, Tunable, TypeName,
    ValueType, codes,
};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The map of declared types.
pub fn types(cx: &mut Cx, node: Node) -> Vec<ComponentType> {
    let entries = members(cx, node, "`types`", "types: { Gain: { ports: {...} } }");
    entries.into_iter().filter_map(|entry| component_type(cx, entry)).collect()
}

fn members(cx: &mut Cx, node: Node, what: &str, example: &str) -> Vec<Entry> {
    match node.kind {
        Kind::Map(entries) => entries,
        Kind::List(list) if list.is_empty() => Vec::new(),
        _ => {
            cx.wrong(&node, what, "a table of named values", example);
            Vec::new()
        }
    }
}

fn component_type(cx: &mut Cx, entry: Entry) -> Option<ComponentType> {
    let key = Node::new(Kind::Str(entry.key.into()), entry.origin);
    let type_name = name::<TypeName>(cx, &key, "a component type", "Gain");
    let value = match entry.value.kind {
        // `Marker:` alone declares a type without members.
        Kind::Null => Node::new(Kind::Map(Vec::new()), entry.origin),
        _ => entry.value,
    };
    let mut fields = Fields::of(cx, value, "a component type", "Gain: { ports: {...}, properties: {...} }")?;
    let mut ty = ComponentType::new(type_name.as_ref().map_or("unnamed", TypeName::as_str), "");
    ty.origin = entry.origin;
    ty.doc = doc(cx, &mut fields);
    if let Some(node) = fields.take("ports") {
        ty.ports = named(cx, node, "`ports`", "u: { direction: in, type: float }", port);
    }
    if let Some(node) = fields.take("properties") {
        ty.properties = named(cx, node, "`properties`", "k: { type: float, default: 1.0 }", property);
    }
    if let Some(node) = fields.take("operations") {
        ty.operations = named(cx, node, "`operations`", "reset: { effect: none }", operation);
    }
    ty.start_after = type_names(cx, &mut fields, "start_after");
    ty.stop_before = type_names(cx, &mut fields, "stop_before");
    if let Some(node) = fields.take("actuator") {
        ty.actuator = truth(cx, &node, "`actuator`", "actuator: true").unwrap_or_default();
    }
    if let Some(node) = fields.take("moves") {
        for node in one_or_more(node) {
            match choice(cx, &node, "`moves`", &[("start", true), ("stop", false)]) {
                Some(true) => ty.moves.start = true,
                Some(false) => ty.moves.stop = true,
                None => {}
            }
        }
    }
    if let Some(node) = fields.take("irreversible") {
        for node in one_or_more(node) {
            match choice(cx, &node, "`irreversible`", &[("configure", 0), ("stop", 1), ("destroy", 2)]) {
                Some(0) => ty.irreversible.configure = true,
                Some(1) => ty.irreversible.stop = true,
                Some(_) => ty.irreversible.destroy = true,
                None => {}
            }
        }
    }
    fields.finish(cx);
    type_name.map(|_| ty)
}

fn doc(cx: &mut Cx, fields: &mut Fields) -> String {
    fields.take("doc").and_then(|node| text(cx, &node, "`doc`", "doc: multiplies its input")).unwrap_or_default()
}

fn unit(cx: &mut Cx, fields: &mut Fields) -> Option<Arc<str>> {
    fields.take("unit").and_then(|node| text(cx, &node, "`unit`", "unit: N")).map(Arc::from)
}

fn type_names(cx: &mut Cx, fields: &mut Fields, key: &'static str) -> Vec<TypeName> {
    let Some(node) = fields.take(key) else { return Vec::new() };
    one_or_more(node).iter().filter_map(|node| name(cx, node, "a component type", "Driver")).collect()
}

/// A map of members, each lowered by `one`.
fn named<T>(
    cx: &mut Cx,
    node: Node,
    what: &str,
    example: &str,
    one: impl Fn(&mut Cx, Entry) -> Option<T>,
) -> BTreeMap<Ident, T> {
    let mut out = BTreeMap::new();
    for entry in members(cx, node, what, example) {
        let key = Node::new(Kind::Str(entry.key.to_string().into()), entry.origin);
        let ident = name::<Ident>(cx, &key, "a member of a component type", example);
        if let (Some(ident), Some(member)) = (ident, one(cx, entry)) {
            out.insert(ident, member);
        }
    }
    out
}

fn port(cx: &mut Cx, entry: Entry) -> Option<PortType> {
    const EXAMPLE: &str = "{ direction: in, type: float, unit: N }";
    let mut fields = Fields::of(cx, entry.value, "a port", EXAMPLE)?;
    let direction = fields
        .required(cx, "direction", "direction: in")
        .and_then(|node| choice(cx, &node, "`direction`", &[("in", Direction::In), ("out", Direction::Out)]));
    let ty = fields.required(cx, "type", "type: float").and_then(|node| value_type(cx, node));
    let unit = unit(cx, &mut fields);
    let buffered =
        fields.take("buffered").and_then(|node| truth(cx, &node, "`buffered`", "buffered: true")).unwrap_or_default();
    let doc = doc(cx, &mut fields);
    fields.finish(cx);
    Some(PortType { direction: direction?, ty: ty?, unit, buffered, doc, origin: entry.origin })
}

fn property(cx: &mut Cx, entry: Entry) -> Option<PropertyType> {
    const EXAMPLE: &str = "{ type: float, default: 1.0, min: 0.0, max: 10.0, tunable: stopped }";
    let mut fields = Fields::of(cx, entry.value, "a property", EXAMPLE)?;
    let ty = fields.required(cx, "type", "type: float").and_then(|node| value_type(cx, node));
    let default = fields.take("default");
    let default_origin = default.as_ref().map(|node| node.origin);
    let default = default.and_then(|node| value(cx, node, "`default`"));
    let mut limit = |key| fields.take(key).and_then(|node| number(cx, &node, key, "0.5"));
    let (min, max) = (limit("min"), limit("max"));
    let tunable = fields.take("tunable").and_then(|node| {
        let choices =
            [("unconfigured", Tunable::Unconfigured), ("stopped", Tunable::Stopped), ("always", Tunable::Always)];
        choice(cx, &node, "`tunable`", &choices)
    });
    let unit = unit(cx, &mut fields);
    let doc = doc(cx, &mut fields);
    fields.finish(cx);
    let mut property = PropertyType {
        ty: ty?,
        default: None,
        min,
        max,
        tunable: tunable.unwrap_or_default(),
        unit,
        doc,
        origin: entry.origin,
    };
    if property.ty == ValueType::Event {
        let finding = Finding::error(codes::TYPE_BAD_TYPE, "a property cannot be of type `event`");
        cx.report(finding.at(entry.origin).help("only ports carry events"));
    }
    if let (Some(min), Some(max)) = (min, max)
        && min > max
    {
        let finding = Finding::error(codes::TYPE_BAD_DEFAULT, format!("`min` ({min}) is larger than `max` ({max})"));
        cx.report(finding.at(entry.origin).help("no value would be allowed: exchange them"));
    } else if let Some(default) = default {
        match property.fit(default) {
            Ok(default) => property.default = Some(default),
            Err(error) => {
                let finding = Finding::error(codes::TYPE_BAD_DEFAULT, format!("the default is not allowed: {error}"));
                let origin = default_origin.unwrap_or(entry.origin);
                cx.report(finding.at(origin).help("a default is of the property's type and within its limits"));
            }
        }
    }
    Some(property)
}

fn operation(cx: &mut Cx, entry: Entry) -> Option<OperationType> {
    const EXAMPLE: &str = "{ args: [float], returns: bool, effect: none }";
    let value = match entry.value.kind {
        Kind::Null => Node::new(Kind::Map(Vec::new()), entry.origin),
        _ => entry.value,
    };
    let mut fields = Fields::of(cx, value, "an operation", EXAMPLE)?;
    let mut args = Vec::new();
    if let Some(node) = fields.take("args") {
        match node.kind {
            Kind::List(list) => args.extend(list.into_iter().filter_map(|node| value_type(cx, node))),
            _ => cx.wrong(&node, "`args`", "a list of types", "args: [float, int]"),
        }
    }
    let returns = fields.take("returns").and_then(|node| value_type(cx, node));
    let effect = fields.take("effect").and_then(|node| effect(cx, node)).unwrap_or(Effect::Irreversible);
    let moves = fields.take("moves").and_then(|node| truth(cx, &node, "`moves`", "moves: true")).unwrap_or_default();
    let settled_by = fields.take("settled_by").and_then(|node| condition::condition(cx, node, 0));
    let doc = doc(cx, &mut fields);
    fields.finish(cx);
    Some(OperationType { args, returns, effect, moves, settled_by, doc, origin: entry.origin })
}

/// `none`, `irreversible`, or `undo: OPERATION`: in a flow map `{…, effect: undo: park}` YAML allows no second colon, so
/// the text `undo: park` in quotes and the map `{ undo: park }` are both taken.
fn effect(cx: &mut Cx, node: Node) -> Option<Effect> {
    const EXAMPLE: &str = "effect: { undo: park }";
    match &node.kind {
        Kind::Str(text) => {
            if let Some(operation) = text.strip_prefix("undo:") {
                let node = Node::new(Kind::Str(operation.trim().into()), node.origin);
                return name(cx, &node, "an operation", EXAMPLE).map(Effect::Undo);
            }
            let choices = [("none", 0), ("irreversible", 1)];
            choice(cx, &node, "`effect`", &choices).map(|n| if n == 0 { Effect::None } else { Effect::Irreversible })
        }
        _ => {
            let mut fields = Fields::of(cx, node, "`effect`", EXAMPLE)?;
            let operation = fields.required(cx, "undo", EXAMPLE);
            fields.finish(cx);
            operation.and_then(|node| name(cx, &node, "an operation", EXAMPLE)).map(Effect::Undo)
        }
    }
}

/// A type: a text (`float`, `"float[3]"`), or a record as a map (`{x: float, y: float}`).
fn value_type(cx: &mut Cx, node: Node) -> Option<ValueType> {
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
            let mut fields = Vec::with_capacity(length);
            for entry in entries {
                let key = Node::new(Kind::Str(entry.key.into()), entry.origin);
                let field = name::<Ident>(cx, &key, "a field of a record", "{x: float, y: float}");
                if let (Some(field), Some(ty)) = (field, value_type(cx, entry.value)) {
                    fields.push((field, ty));
                }
            }
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
