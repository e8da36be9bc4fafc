//! What makes a deployment a part of another one: its parameters, what it shows, its subsystems.

use super::types::fitting;
use super::{by_name, entries, name, text, value};
use crate::lang::bound;
use crate::lang::grammar::{EXPORTS, LEAVING, PARAMETER, SUBSYSTEM};
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::model::finding::nearest;
use crate::model::{
    EventName, Export, Finding, Ident, Interface, LeavingRule, MemberClass, MemberRef, Origin, PropertyType, Tunable,
    ValueType, codes,
};
use std::collections::BTreeMap;

/// A subsystem, before its file is read.
pub struct SubsystemDraft {
    /// Its name.
    pub name: Ident,
    /// Its file.
    pub file: String,
    /// Where that is named.
    pub named_at: Origin,
    /// What it is given.
    pub parameters: Vec<Entry>,
    /// Which of that are parameters of this file that it gives on, and where.
    pub given_on: Vec<(String, Origin)>,
    /// Its activities that are those of this file.
    pub activities: Vec<(Ident, Ident, Origin)>,
    /// Where it is named.
    pub origin: Origin,
}

/// `parameters`, `exports`, `accepts` and `leaving`; and the parameters that are not declared in order, which is said.
pub fn interface(cx: &mut Cx, fields: &mut Fields) -> (Interface, Vec<Ident>) {
    let mut ill = Vec::new();
    let mut interface = Interface { accepts: super::names(cx, fields, "accepts", "`accepts`"), ..Interface::default() };
    let example = fields.row("parameters").example;
    if let Some(node) = fields.take(cx, "parameters") {
        for (name, entry) in named(cx, node, "`parameters`", example) {
            match parameter(cx, entry) {
                Ok(parameter) => {
                    interface.parameters.insert(name, parameter);
                }
                Err(declared) => {
                    ill.push(name);
                    interface.parameters.extend(declared.map(|parameter| (name, parameter)));
                }
            }
        }
    }
    if let Some(node) = fields.take(cx, "exports") {
        exports(cx, node, &mut interface);
    }
    interface.leaving = fields.take(cx, "leaving").and_then(|node| leaving(cx, node));
    (interface, ill)
}

/// A table of things by plain names.
fn named(cx: &mut Cx, node: Node, what: &str, example: &str) -> Vec<(Ident, Entry)> {
    let entries = entries(cx, node, what, example);
    by_name(cx, entries, what, example, |_, _, entry| Some(entry))
}

/// A parameter, if it is declared in order; else what is known of it.
fn parameter(cx: &mut Cx, entry: Entry) -> Result<PropertyType, Option<PropertyType>> {
    let mut fields = Fields::of(cx, entry.value, &PARAMETER).ok_or(None)?;
    let default_at = fields.value_place("default");
    let mut given = PropertyType { origin: entry.origin, ..PropertyType::new(ValueType::Bool, Tunable::default()) };
    let is_whole = bound::PARAMETER.read(&mut given, &mut fields, cx);
    fields.finish(cx);
    if !is_whole {
        return Err(None);
    }
    let has_default = default_at.is_some();
    let parameter = fitting(cx, given, default_at, "a parameter");
    let none_fits =
        parameter.ty == ValueType::Event || parameter.min.zip(parameter.max).is_some_and(|(min, max)| min > max);
    if none_fits || has_default && parameter.default.is_none() { Err(Some(parameter)) } else { Ok(parameter) }
}

fn exports(cx: &mut Cx, node: Node, interface: &mut Interface) {
    let Some(mut fields) = Fields::of(cx, node, &EXPORTS) else { return };
    for (_, kind) in MemberClass::WORDS {
        let key = kind.several();
        let example = fields.row(key).example;
        let Some(node) = fields.take(cx, key) else { continue };
        for (name, entry) in named(cx, node, &format!("`exports.{key}`"), example) {
            let Some(of) = super::name::<MemberRef>(cx, &entry.value, "an export", "Arm_Kinematics.tool_pose") else {
                continue;
            };
            if let Some(first) = interface.exports.get(&name) {
                let message = format!("`{name}` is exported twice");
                let finding = Finding::error(codes::TEXT_DUPLICATE_KEY, message).at(entry.origin);
                cx.report(finding.also(first.origin, "first here").help("give one of them another name"));
                continue;
            }
            interface.exports.insert(name, Export { kind: *kind, of, origin: entry.origin });
        }
    }
    let place = fields.place("from");
    let from: Option<EventName> = fields.name(cx, "from");
    interface.from = from.zip(place);
    fields.finish(cx);
}

fn leaving(cx: &mut Cx, node: Node) -> Option<LeavingRule> {
    let origin = node.origin;
    let mut fields = Fields::of(cx, node, &LEAVING)?;
    let (says, until) = (fields.name(cx, "says"), fields.name(cx, "until"));
    fields.finish(cx);
    Some(LeavingRule { says: says?, until: until?, origin })
}

/// `subsystems`
pub fn subsystems(cx: &mut Cx, fields: &mut Fields) -> Vec<SubsystemDraft> {
    let example = fields.row("subsystems").example;
    let Some(node) = fields.take(cx, "subsystems") else { return Vec::new() };
    let entries = named(cx, node, "`subsystems`", example);
    entries.into_iter().filter_map(|(name, entry)| subsystem(cx, name, entry)).collect()
}

fn subsystem(cx: &mut Cx, own: Ident, entry: Entry) -> Option<SubsystemDraft> {
    let mut fields = Fields::of(cx, entry.value, &SUBSYSTEM)?;
    let file = fields.take(cx, "deployment");
    let named_at = file.as_ref().map_or(entry.origin, |node| node.origin);
    let file = file.and_then(|node| text(cx, &node, "`deployment`", fields.row("deployment").example));
    let parameters = fields.entries(cx, "parameters");
    let mut activities = Vec::new();
    let example = fields.row("activities").example;
    if let Some(node) = fields.take(cx, "activities") {
        for (inner, entry) in named(cx, node, "`activities`", example) {
            let outer = name::<Ident>(cx, &entry.value, "an activity", example);
            activities.extend(outer.map(|outer| (inner, outer, entry.origin)));
        }
    }
    fields.finish(cx);
    let given_on = Vec::new();
    Some(SubsystemDraft { name: own, file: file?, named_at, parameters, given_on, activities, origin: entry.origin })
}

/// Values of parameters as the Lua files read them: those that are given, and the defaults of the others (of an `ill` one, which is not
/// declared in order, nothing is known). For messages: who gives them (`of`), what stands before their names on the command line, and where
/// something is given on.
pub fn given(
    cx: &mut Cx,
    (declared, ill): (&BTreeMap<Ident, PropertyType>, &[Ident]),
    (mut given, given_on): (Vec<Entry>, &[(String, Origin)]),
    (of, within): (&str, &str),
    at: Origin,
) -> Vec<Entry> {
    let mut values = Vec::new();
    for name in ill {
        given.retain(|entry| entry.key != name.as_str());
        values.push(lost(*name, at));
    }
    for (name, parameter) in declared.iter().filter(|(name, _)| !ill.contains(name)) {
        let node = given.iter().position(|entry| entry.key == name.as_str()).map(|place| given.remove(place));
        let Some(entry) = node else {
            if let Some(default) = &parameter.default {
                let value = node_of(default, parameter.origin);
                values.push(Entry { key: name.to_string().into(), origin: parameter.origin, value });
            } else {
                let message = format!("{of} does not give the parameter `{name}`, which has no default");
                let finding = Finding::error(codes::COMPOSE_PARAMETER, message).at(at);
                let there = match within {
                    "" => String::new(),
                    _ => format!("`parameters: {{ {name}: … }}` there, or "),
                };
                let ty = &parameter.ty;
                cx.report(finding.also(parameter.origin, "declared here").help(format!(
                    "give it ({ty}): {there}`--set {within}{name}=…`; or write a `default` where it is declared"
                )));
                values.push(lost(*name, parameter.origin));
            }
            continue;
        };
        let (origin, place) = (entry.origin, entry.value.origin);
        let Some(is) = value(cx, entry.value, "a parameter") else {
            values.push(lost(*name, place));
            continue;
        };
        match parameter.fit(is) {
            Ok(is) => values.push(Entry { key: name.to_string().into(), origin, value: node_of(&is, place) }),
            Err(error) => {
                let finding = Finding::error(codes::COMPOSE_PARAMETER, format!("the parameter `{name}`: {error}"));
                let quotes = if parameter.ty == ValueType::Str {
                    ", in quotes (`\"3\"`) where it looks like another"
                } else {
                    ""
                };
                let help = format!("{}{quotes}", error.advice(&parameter.ty));
                let finding = finding.at(place).also(parameter.origin, "declared here").help(help);
                let here = given_on.iter().find(|(given_on, _)| *given_on == name.as_str());
                cx.report(here.into_iter().fold(finding, |finding, (_, at)| finding.also(*at, "given on here")));
                values.push(lost(*name, place));
            }
        }
    }
    for entry in given {
        let known = declared.keys().map(Ident::as_str);
        let help = crate::model::finding::did_you_mean(&entry.key, "parameters", known);
        let message = format!("there is no parameter `{}`", entry.key);
        cx.report(Finding::error(codes::COMPOSE_PARAMETER, message).at(entry.origin).help(help));
    }
    values
}

/// What a file gives on of its own parameters to its subsystems (`{ parameter: NAME }` for a value). `own`: what these are worth here. Answers the
/// names of those that some subsystem is given.
pub fn hand_down(cx: &mut Cx, subsystems: &mut [SubsystemDraft], own: &[Entry]) -> Vec<String> {
    let mut handed = Vec::new();
    for SubsystemDraft { parameters, given_on, .. } in subsystems {
        for entry in parameters {
            let Kind::Map(of) = &entry.value.kind else { continue };
            let [only] = &of[..] else { continue };
            let Kind::Str(name) = &only.value.kind else { continue };
            let (name, at) = (name.to_string(), only.value.origin);
            if only.key != "parameter" {
                if nearest(&only.key, ["parameter"]).is_some() {
                    let message = format!("`{}: {name}` gives nothing on", only.key);
                    let finding = Finding::error(codes::COMPOSE_PARAMETER, message).at(only.origin);
                    cx.report(finding.help(format!("did you mean `parameter: {name}`?")));
                    entry.value = Node::new(Kind::Poison, at);
                }
                continue;
            }
            if let Some(known) = own.iter().find(|known| known.key == name.as_str()) {
                // Where it was given to this file: what is wrong with it is mended there.
                entry.value = known.value.clone();
                given_on.push((entry.key.to_string(), at));
                handed.push(name);
            } else {
                let known = own.iter().map(|known| &*known.key);
                let help = match own {
                    [] => format!("declare it in this file: `parameters: {{ {name}: {{ type: float }} }}`"),
                    _ => crate::model::finding::did_you_mean(&name, "parameters of this file", known),
                };
                let finding = Finding::error(codes::COMPOSE_PARAMETER, format!("this file has no parameter `{name}`"));
                cx.report(finding.at(at).labelled("to be given on").help(help));
                entry.value = Node::new(Kind::Poison, at);
            }
        }
    }
    handed
}

/// One that has no value, which is said: files that read it are not at fault.
fn lost(name: Ident, origin: Origin) -> Entry {
    Entry { key: name.to_string().into(), origin, value: Node::new(Kind::Poison, origin) }
}

fn node_of(of: &crate::model::Value, origin: Origin) -> Node {
    use crate::model::Value as V;
    let kind = match of {
        V::Bool(is) => Kind::Bool(*is),
        V::Int(is) => Kind::Int(*is),
        V::Float(is) => Kind::Float(*is),
        V::Str(is) => Kind::Str(is.to_string().into()),
        V::Array(list) => Kind::List(list.iter().map(|of| node_of(of, origin)).collect()),
        V::Record(fields) => {
            let entry =
                |(name, of): &(Ident, V)| Entry { key: name.to_string().into(), origin, value: node_of(of, origin) };
            Kind::Map(fields.iter().map(entry).collect())
        }
    };
    Node::new(kind, origin)
}
