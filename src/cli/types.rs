//! `davit types`

use super::exit::Exit;
use super::input::{CommandInput, Parameters};
use super::output::{Output, Style, Table};
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::diagnostics::Language;
use crate::lang;
use crate::model::codes::CLI_UNKNOWN_TYPE;
use crate::model::finding::did_you_mean;
use crate::model::monitor::{Condition, MONITORS_TYPE};
use crate::model::{Catalogue, ComponentType, Direction, Effect, GENERIC_INJECTIONS, InjectionParameter};
use std::path::PathBuf;

/// What component types offer: ports, properties, operations, with types, units, limits and what can be undone.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A deployment file (then: the types it may use), or a type, with or without its library's name (then: that one in
    /// full); without either, all types of this program's libraries.
    #[arg(value_name = "FILE|TYPE")]
    what: Option<String>,
    /// With a file: show this type in full.
    #[arg(value_name = "TYPE")]
    ty: Option<String>,
    /// The types of this library of the program.
    #[arg(long, value_name = "NAME")]
    library: Option<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    parameters: Parameters,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let is_file =
            self.what.as_ref().is_some_and(|w| w.contains('/') || w.ends_with(".yaml") || w.ends_with(".yml"));
        let (catalogue, wanted) = if is_file {
            let file = PathBuf::from(self.what.unwrap_or_default());
            let read = CommandInput { file, parameters: self.parameters }.read(context)?;
            (read.catalogue, self.ty)
        } else {
            let catalogue = match &self.library {
                None => context.extensions.libraries.catalogue(),
                Some(name) => {
                    let found = context.extensions.libraries.iter().find(|l| l.name().as_str() == name);
                    let Some(library) = found else {
                        let known: Vec<String> =
                            context.extensions.libraries.iter().map(|l| l.name().to_string()).collect();
                        return Err(CommandFailure::no(
                            crate::model::codes::DEPLOY_UNKNOWN_LIBRARY,
                            format!("this program has no component library `{name}`"),
                            did_you_mean(name, "libraries", known.iter().map(String::as_str)),
                        ));
                    };
                    library.catalogue()
                }
            };
            (catalogue, self.what)
        };
        let out = &context.out;
        match wanted {
            None if self.json => out.json(&catalogue.iter().map(|ty| view(ty)).collect::<Vec<_>>()),
            None => list(out, &catalogue),
            Some(name) => {
                let ends = |ty: &ComponentType| {
                    let whole = ty.name.as_str();
                    ['.', '/'].into_iter().any(|before| whole.rsplit(before).next() == Some(&name))
                };
                let mut by_last = catalogue.iter().filter(|ty| ends(ty));
                // The name alone will do while only one library, or subsystem, has it.
                let only = by_last.next().filter(|_| by_last.next().is_none());
                let Some(ty) = catalogue.iter().find(|ty| ty.name.as_str() == name).or(only) else {
                    let of_library = |ty: &ComponentType| ty.name.as_str().split('.').next() == Some(&name);
                    let several = catalogue.iter().filter(|ty| ends(ty)).map(|ty| format!("`{}`", ty.name));
                    let several: Vec<String> = several.collect();
                    let help = if !several.is_empty() {
                        format!("several have one: {}", several.join(", "))
                    } else if name == MONITORS_TYPE {
                        format!("what it has are a deployment's own monitors: `davit types FILE {MONITORS_TYPE}`")
                    } else {
                        match catalogue.iter().any(|ty| of_library(ty)) {
                            true => format!("`davit types --library {name}` shows those of the library"),
                            false => did_you_mean(&name, "types", catalogue.iter().map(|ty| ty.name.as_str())),
                        }
                    };
                    let message = format!("there is no component type `{name}`");
                    return Err(CommandFailure::no(CLI_UNKNOWN_TYPE, message, help));
                };
                if self.json { out.json(&view(ty)) } else { one(out, ty) }
            }
        }
        Ok(Exit::Done)
    }
}

/// A condition as it is written in Lua.
fn settling(condition: &Condition) -> String {
    lang::print::condition(condition, Language::Lua)
}

/// A type as JSON, with the conditions of its operations as they are written.
fn view(ty: &ComponentType) -> serde_json::Value {
    let mut view = serde_json::json!(ty);
    for (name, operation) in &ty.operations {
        let settled = operation.settled_by.as_ref().map(settling);
        view["operations"][name.as_str()]["settled_by"] = serde_json::json!(settled);
    }
    view
}

fn list(out: &Output, catalogue: &Catalogue) {
    let mut table = Table::new(0);
    for ty in catalogue.iter() {
        table.row([out.paint(Style::Name, ty.name), first_sentence(&ty.doc)]);
    }
    if table.is_empty() {
        out.line("no component types");
    }
    out.text(table.to_string());
}

fn first_sentence(doc: &str) -> String {
    doc.lines().next().unwrap_or_default().split_inclusive(". ").next().unwrap_or_default().trim().to_owned()
}

fn one(out: &Output, ty: &ComponentType) {
    out.line(out.paint(Style::Bold, ty.name));
    if !ty.doc.is_empty() {
        out.line(&ty.doc);
    }
    let mut facts = Vec::new();
    if ty.actuator {
        facts.push("moves something (actuator)".to_owned());
    }
    let does = ty.moves.words().map(|word| format!("`{word}` moves hardware: no automatic rollback does it unasked"));
    facts.extend(does.chain(ty.irreversible.words().map(|word| format!("`{word}` cannot be undone"))));
    for (word, types) in [("starts after", &ty.start_after), ("stops before", &ty.stop_before)] {
        if !types.is_empty() {
            facts.push(format!("{word} {}", types.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")));
        }
    }
    for resource in &ty.exclusive {
        facts.push(format!("has `{resource}` for itself from configured on"));
    }
    for fact in facts {
        out.line(format!("  {fact}"));
    }
    for (heading, direction) in [("in-ports", Direction::In), ("out-ports", Direction::Out)] {
        let mut table = Table::new(2);
        for (name, port) in ty.ports.iter().filter(|(_, p)| p.direction == direction) {
            let buffered = if port.buffered { " (buffered)" } else { "" };
            let required = if port.required { " (required)" } else { "" };
            let unit = port.unit.as_deref().unwrap_or_default();
            table.row([
                out.paint(Style::Name, name),
                format!("{}{buffered}{required}", port.ty),
                unit.to_owned(),
                port.doc.clone(),
            ]);
        }
        section(out, heading, &table);
    }
    let mut table = Table::new(2);
    for (name, property) in &ty.properties {
        let limits = between(property.min, property.max);
        let default = property.default.as_ref().map_or_else(|| "required".to_owned(), |v| format!("= {v}"));
        let unit = property.unit.as_deref().unwrap_or_default().to_owned();
        table.row([
            out.paint(Style::Name, name),
            property.ty.to_string(),
            default,
            unit,
            limits,
            property.tunable.to_string() + if property.raises { ", raises" } else { "" },
            property.doc.clone(),
        ]);
    }
    section(out, "properties", &table);
    let mut table = Table::new(2);
    for (name, operation) in &ty.operations {
        let args: Vec<String> = operation.args.iter().map(ToString::to_string).collect();
        let returns = operation.returns.as_ref().map_or_else(String::new, |ty| format!(" -> {ty}"));
        let mut effect = match &operation.effect {
            Effect::None => "leaves nothing behind".to_owned(),
            Effect::Undo(undo) => format!("undone by {undo}"),
            Effect::Irreversible => "irreversible".to_owned(),
        };
        if operation.moves {
            effect += ", moves hardware";
        }
        if let Some(condition) = &operation.settled_by {
            effect += &format!(", settled by {}", settling(condition));
        }
        table.row([
            format!("{}({}){returns}", out.paint(Style::Name, name), args.join(", ")),
            effect,
            operation.doc.clone(),
        ]);
    }
    section(out, "operations", &table);
    let mut table = Table::new(2);
    for (event, doc) in &ty.raises {
        table.row([out.paint(Style::Name, event), doc.clone()]);
    }
    section(out, "events", &table);
    let mut table = Table::new(2);
    for [call, doc] in injections(ty) {
        table.row([out.paint(Style::Name, call), doc]);
    }
    section(out, "injections (of scripts, where its code runs in this process)", &table);
}

/// Limits, as they are shown.
fn between(min: Option<f64>, max: Option<f64>) -> String {
    match (min, max) {
        (Some(min), Some(max)) => format!("{min} … {max}"),
        (Some(min), None) => format!("≥ {min}"),
        (None, Some(max)) => format!("≤ {max}"),
        (None, None) => String::new(),
    }
}

/// What can be made to go wrong in a component of the type.
fn injections(ty: &ComponentType) -> Vec<[String; 2]> {
    let own = ty.injections.iter().map(|(name, injection)| {
        let one = |p: &InjectionParameter| {
            let default = p.default.as_ref().map_or_else(String::new, |value| format!(" = {value}"));
            let unit = p.unit.as_deref().map_or_else(String::new, |unit| format!(" {unit}"));
            let limits = between(p.min, p.max);
            let limits = if limits.is_empty() { limits } else { format!(" ({limits})") };
            format!("{}: {}{default}{unit}{limits}", p.name, p.ty)
        };
        let parameters: Vec<String> = injection.parameters.iter().map(one).collect();
        [format!("{name}({})", parameters.join(", ")), injection.doc.clone()]
    });
    let generic = GENERIC_INJECTIONS.map(|(name, parameters, doc)| [format!("{name}({parameters})"), doc.to_owned()]);
    own.chain(generic).collect()
}

fn section(out: &Output, heading: &str, table: &Table) {
    if !table.is_empty() {
        out.line(format!("\n{}", out.paint(Style::Bold, heading)));
        out.text(table.to_string());
    }
}
