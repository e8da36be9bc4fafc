//! Annotations (LuaCATS) for editors of Lua: the constructors and words that files of configurations, coordinators and monitors are
//! written with, each with what it takes.

use crate::lang::grammar::{
    CHANGES, CONFIGURATION, CONNECTOR, FILES, Form, Key, Languages, MONITOR, Object, Primitive, STATE, TRANSITION,
    Words,
};
use crate::lang::words::{CONDITIONS, SIGNALS, Word};
use std::fmt::Write as _;

/// What tables of Lua hold beside their keys.
fn elements(object: &Object) -> &'static [&'static str] {
    match object.name {
        "configuration" => &["[integer] davit.Change Its changes."],
        "state" => &[
            "[integer] davit.Transition Transitions between the states in it.",
            "[string] davit.State|davit.Connector|string|string[]|function|nil The states in it, by name.",
        ],
        _ => &[],
    }
}

/// The annotations, as a file of Lua.
pub fn annotations() -> String {
    let mut out = String::from(
        "---@meta davit\n-- What files of configurations, coordinators and monitors are written with. Made by `davit schema lua`.\n\n\
         ---@alias davit.Value boolean|number|string|table\n\n---@class davit.Change\nlocal Change = {}\n\n\
         --- Names the call that takes this one back.\n---@param operation string\n---@param ... davit.Value\n---@return davit.Change\n\
         function Change:undo(operation, ...) end\n\n---@alias davit.Signal number|string|davit.SignalOf\n\n---@class davit.SignalOf\n\n",
    );
    out.push_str("---@class davit.Condition\n");
    for word in CONDITIONS.iter().filter(|word| word.method) {
        _ = writeln!(out, "---@field {} fun(self: davit.Condition, ...): davit.Condition {}", word.name, word.doc);
    }
    out.push('\n');
    let mut written: Vec<&str> = Vec::new();
    for file in FILES.iter().filter(|file| file.in_lua) {
        // The file's own table is YAML's.
        for object in file.objects().into_iter().skip(1) {
            if !written.contains(&object.name) && CHANGES.iter().all(|change| change.object.name != object.name) {
                written.push(object.name);
                class(&mut out, object);
            }
        }
    }
    for change in CHANGES.iter().filter(|change| change.arguments.contains(&"options")) {
        _ = writeln!(out, "---@class davit.{}Options", class_name(change.object));
        options(change).for_each(|key| field(&mut out, key));
        out.push('\n');
    }
    CHANGES.iter().for_each(|change| primitive(&mut out, change));
    for (name, object) in [
        ("Configuration", &CONFIGURATION),
        ("state", &STATE),
        ("trans", &TRANSITION),
        ("conn", &CONNECTOR),
        ("monitor", &MONITOR),
    ] {
        let class = class_name(object);
        _ = writeln!(
            out,
            "--- {}\n---@param fields davit.{class}\n---@return davit.{class}\nfunction {name}(fields) end\n",
            object.doc
        );
    }
    for (name, object) in [("ConfiguratorConf", &CONFIGURATION), ("Monitors", &MONITOR)] {
        _ = writeln!(out, "---@param named table<string, davit.{}>\nfunction {name}(named) end\n", class_name(object));
    }
    CONDITIONS.iter().for_each(|of| word(&mut out, of, "davit.Condition"));
    SIGNALS.iter().for_each(|of| word(&mut out, of, "davit.Signal"));
    out.truncate(out.trim_end().len());
    out.push('\n');
    out
}

fn class_name(object: &Object) -> String {
    let capital = |part: &str| part[..1].to_uppercase() + &part[1..];
    object.name.split('_').map(capital).collect()
}

fn class(out: &mut String, object: &Object) {
    _ = writeln!(out, "--- {}\n---@class davit.{}", object.doc, class_name(object));
    object.keys.iter().for_each(|key| field(out, key));
    for element in elements(object) {
        _ = writeln!(out, "---@field {element}");
    }
    out.push('\n');
}

fn field(out: &mut String, key: &Key) {
    let only_yaml = matches!(key.language, Languages::Yaml | Languages::None) || matches!(key.form, Form::Changes);
    if !only_yaml {
        let optional = if key.required { "" } else { "?" };
        // Of numbers the type says less than there is to say.
        let range = match key.form {
            Form::Whole { .. } | Form::Seconds | Form::Milliseconds => format!("({}) ", key.form.words(Words::Plain)),
            _ => String::new(),
        };
        _ = writeln!(out, "---@field {}{optional} {} {range}{}", key.name, kind(&key.form), key.told());
    }
}

/// The keys of a primitive that stand in a table behind its other arguments.
fn options(primitive: &Primitive) -> impl Iterator<Item = &'static Key> {
    let arguments = primitive.arguments;
    primitive.object.keys.iter().filter(move |key| !arguments.contains(&key.name))
}

fn primitive(out: &mut String, primitive: &Primitive) {
    let object = primitive.object;
    _ = writeln!(out, "--- {}", object.doc);
    let mut names = Vec::new();
    for argument in primitive.arguments {
        match (*argument, object.key(argument)) {
            ("options", _) => {
                _ = writeln!(out, "---@param options? davit.{}Options", class_name(object));
                names.push("options");
            }
            (_, Some(key)) => {
                let optional = if key.required { "" } else { "?" };
                _ = writeln!(out, "---@param {argument}{optional} {} {}", kind(&key.form), key.told());
                names.push(argument);
            }
            (_, None) => {
                _ = writeln!(out, "---@param ... davit.Value Its arguments.");
                names.push("...");
            }
        }
    }
    _ = writeln!(out, "---@return davit.Change\nfunction {}({}) end\n", object.name, names.join(", "));
}

fn word(out: &mut String, word: &Word, of: &str) {
    let doc = word.doc;
    let takes = if word.many { "list" } else { "..." };
    _ = writeln!(
        out,
        "--- {doc}\n--- `{}`\n---@param {takes} any\n---@return {of}\nfunction {}({takes}) end\n",
        word.usage, word.name
    );
}

/// A form as a type of Lua.
fn kind(form: &Form) -> String {
    match form {
        Form::Version | Form::Whole { .. } => "integer".to_owned(),
        Form::Truth => "boolean".to_owned(),
        Form::Text | Form::Path | Form::Name(_) | Form::State | Form::Step => "string".to_owned(),
        Form::Trigger => "string|function".to_owned(),
        Form::Number | Form::Seconds | Form::Milliseconds => "number".to_owned(),
        Form::Choice(words) => words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join("|"),
        Form::Value => "davit.Value".to_owned(),
        Form::ValueType => "string|table".to_owned(),
        Form::Condition => "davit.Condition".to_owned(),
        Form::States => "string[]".to_owned(),
        Form::Function => "function".to_owned(),
        Form::Changes => "davit.Change[]".to_owned(),
        Form::List(inner) => list(inner),
        Form::Several(inner) | Form::Set(inner) => format!("{}|{}", kind(inner), list(inner)),
        Form::Named(_, inner) => format!("table<string, {}>", kind(inner)),
        Form::Table(object) => format!("davit.{}", class_name(object)),
        Form::Either(forms) => forms.iter().map(kind).collect::<Vec<_>>().join("|"),
    }
}

fn list(form: &Form) -> String {
    let inner = kind(form);
    if inner.contains('|') { format!("({inner})[]") } else { format!("{inner}[]") }
}
