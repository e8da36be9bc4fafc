//! One change in both languages, by what the grammar says of it: which parts it has, and which of them Lua has as arguments.

use super::fields;
use crate::diagnostics::Language;
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
    let written = parts.iter().map(|(key, part)| (*key, part.written(Language::Lua)));
    let (own, options): (Vec<_>, Vec<_>) = written.partition(|(key, _)| takes(key));
    let mut written: Vec<String> = own.into_iter().map(|(_, part)| part).collect();
    if !options.is_empty() {
        written.push(fields::table(options, Language::Lua));
    }
    _ = write!(out, "({})", written.join(", "));
    for (key, part) in undo {
        _ = write!(out, ":{key}({})", part.written(Language::Lua));
    }
    out
}

/// `create: { component: A, type: T, activity: control }`
pub fn in_yaml(kind: &ChangeKind) -> String {
    format!("{}: {}", kind.verb(), keys(&parts(kind)))
}

fn keys(parts: &[(&'static str, Operand<'_>)]) -> String {
    fields::table(parts.iter().map(|(key, part)| (*key, part.written(Language::Yaml))), Language::Yaml)
}

impl Operand<'_> {
    fn written(&self, language: Language) -> String {
        let text = |text: &str| fields::text(text, language);
        match self {
            Self::Name(name) => text(name),
            Self::Value(value) => fields::value(value, language),
            Self::Args(args) => {
                let args: Vec<String> = args.iter().map(|value| fields::value(value, language)).collect();
                // In Lua they are arguments of the call.
                if language == Language::Lua { args.join(", ") } else { fields::list(&args, language) }
            }
            Self::Values(values) => {
                let values = values.iter().map(|(name, value)| (name.as_str(), fields::value(value, language)));
                fields::table(values, language)
            }
            Self::Names(names) => {
                fields::table(names.iter().map(|(from, to)| (from.as_str(), text(to.as_str()))), language)
            }
            Self::Policy(Policy::Data) => text("data"),
            Self::Policy(Policy::Buffer(n)) => fields::table([("buffer", n.to_string())], language),
            Self::Call(call) if language == Language::Lua => {
                called(call).iter().map(|(_, part)| part.written(language)).collect::<Vec<_>>().join(", ")
            }
            Self::Call(call) => keys(&called(call)),
        }
    }
}
