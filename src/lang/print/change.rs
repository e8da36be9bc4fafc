//! One change in both languages, by what the grammar says of it: which parts it has, and which of them Lua has as arguments.

use super::{lua, yaml};
use crate::lang::grammar::primitive;
use crate::model::{Call, ChangeKind, Ident, Policy, Value};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// What stands behind a key of a change.
enum Operand<'c> {
    Name(String),
    Value(&'c Value),
    Args(&'c [Value]),
    Values(&'c BTreeMap<Ident, Value>),
    Names(&'c BTreeMap<Ident, Ident>),
    Policy(Policy),
    Call(&'c Call),
}

/// The keys of a change with what stands behind them, as far as it says more than what holds without it.
fn parts(kind: &ChangeKind) -> Vec<(&'static str, Operand<'_>)> {
    let name = |text: &dyn std::fmt::Display| Operand::Name(text.to_string());
    match kind {
        ChangeKind::Create { component, ty, activity, properties }
        | ChangeKind::Replace { component, ty, activity, properties, .. } => {
            let mut parts = vec![("component", name(component)), ("type", name(ty))];
            parts.extend(activity.as_ref().map(|activity| ("activity", name(activity))));
            parts.extend(Some(("properties", Operand::Values(properties))).filter(|_| !properties.is_empty()));
            if let ChangeKind::Replace { map, .. } = kind {
                parts.extend(Some(("map", Operand::Names(map))).filter(|_| !map.is_empty()));
            }
            parts
        }
        ChangeKind::Destroy { component } => vec![("component", name(component))],
        ChangeKind::Connect { from, to, policy } => {
            let mut parts = vec![("from", name(from)), ("to", name(to))];
            parts.extend(Some(("policy", Operand::Policy(*policy))).filter(|_| *policy != Policy::Data));
            parts
        }
        ChangeKind::Disconnect { from, to } => vec![("from", name(from)), ("to", name(to))],
        ChangeKind::PropertySet { property, value } => {
            vec![("property", name(property)), ("value", Operand::Value(value))]
        }
        ChangeKind::PortWrite { port, value } => vec![("port", name(port)), ("value", Operand::Value(value))],
        ChangeKind::OperationCall { call, undo } => {
            let mut parts = called(call);
            parts.extend(undo.as_ref().map(|undo| ("undo", Operand::Call(undo))));
            parts
        }
    }
}

fn called(call: &Call) -> Vec<(&'static str, Operand<'_>)> {
    let mut parts = vec![("operation", Operand::Name(call.operation.to_string()))];
    parts.extend(Some(("args", Operand::Args(&call.args))).filter(|_| !call.args.is_empty()));
    parts
}

/// `create("A", "T", { activity = "control" })`
pub fn in_lua(kind: &ChangeKind) -> String {
    let arguments = primitive(kind.verb()).map_or(&[][..], |of| of.arguments);
    let mut out = kind.verb().to_owned();
    let parts = parts(kind);
    let (undo, parts): (Vec<_>, Vec<_>) = parts.into_iter().partition(|(_, part)| matches!(part, Operand::Call(_)));
    // What is no argument stands in a table behind them.
    let takes = |key: &str| arguments.iter().any(|argument| argument.trim_end_matches('…') == key);
    let (own, options): (Vec<_>, Vec<_>) = parts.iter().partition(|(key, _)| takes(key));
    let mut written: Vec<String> = own.iter().map(|(_, part)| part.lua()).collect();
    if !options.is_empty() {
        let options: Vec<String> = options.iter().map(|(key, part)| format!("{key} = {}", part.lua())).collect();
        written.push(format!("{{ {} }}", options.join(", ")));
    }
    _ = write!(out, "({})", written.join(", "));
    for (key, part) in undo {
        _ = write!(out, ":{key}({})", part.lua());
    }
    out
}

/// `create: { component: A, type: T, activity: control }`
pub fn in_yaml(kind: &ChangeKind) -> String {
    format!("{}: {{ {} }}", kind.verb(), keys(&parts(kind)))
}

fn keys(parts: &[(&'static str, Operand<'_>)]) -> String {
    parts.iter().map(|(key, part)| format!("{key}: {}", part.yaml())).collect::<Vec<_>>().join(", ")
}

impl Operand<'_> {
    fn lua(&self) -> String {
        let written = |value: &Value| {
            let mut out = String::new();
            lua::value(&mut out, value);
            out
        };
        let table = |fields: Vec<String>| format!("{{ {} }}", fields.join(", "));
        match self {
            Self::Name(name) => lua::quoted(name),
            Self::Value(value) => written(value),
            Self::Args(args) => args.iter().map(written).collect::<Vec<_>>().join(", "),
            Self::Values(values) => {
                table(values.iter().map(|(name, v)| format!("{} = {}", lua::key(name.as_str()), written(v))).collect())
            }
            Self::Names(names) => {
                let one = |(from, to): (&Ident, &Ident)| {
                    format!("{} = {}", lua::key(from.as_str()), lua::quoted(to.as_str()))
                };
                table(names.iter().map(one).collect())
            }
            Self::Policy(Policy::Data) => lua::quoted("data"),
            Self::Policy(Policy::Buffer(n)) => format!("{{ buffer = {n} }}"),
            Self::Call(call) => called(call).iter().map(|(_, part)| part.lua()).collect::<Vec<_>>().join(", "),
        }
    }

    fn yaml(&self) -> String {
        match self {
            Self::Name(name) => yaml::t(name),
            Self::Value(value) => yaml::value(value),
            Self::Args(args) => yaml::list(args.iter().map(yaml::value)),
            Self::Values(values) => yaml::value_map(values.iter().map(|(name, v)| (name, yaml::value(v)))),
            Self::Names(names) => yaml::value_map(names.iter().map(|(from, to)| (from, yaml::t(to)))),
            Self::Policy(Policy::Data) => "data".to_owned(),
            Self::Policy(Policy::Buffer(n)) => format!("{{ buffer: {n} }}"),
            Self::Call(call) => format!("{{ {} }}", keys(&called(call))),
        }
    }
}
