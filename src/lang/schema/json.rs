//! JSON Schema (draft 7, which editors know best) of one kind of file in YAML.
//!
//! It is no more than a first look: what it refuses, reading refuses too (a test compares them); what it lets stand may still be
//! refused for what stands in other places.

use crate::lang::grammar::{CHANGES, COMPARISON, File, Form, Key, NameKind, Object, Words};
use crate::lang::words::{CONDITIONS, SIGNALS, Word};
use crate::model::{Ident, RunState, TypeName, ValueType};
use serde_json::{Map, Value, json};

/// What the files of a program may name that no file declares. Of what is empty nothing is known, and any name stands.
#[derive(Debug, Clone, Default)]
pub struct ProgramNames {
    /// Its platforms.
    pub platforms: Vec<PlatformNames>,
    /// Its libraries of component types.
    pub libraries: Vec<Ident>,
    /// Their types.
    pub types: Vec<TypeName>,
}

/// A platform that deployments can name.
#[derive(Debug, Clone)]
pub struct PlatformNames {
    /// Its name.
    pub name: Ident,
    /// What it is given.
    pub options: Vec<OptionName>,
}

/// An option of a platform.
#[derive(Debug, Clone)]
pub struct OptionName {
    /// Its name.
    pub name: Ident,
    /// Of which type it is.
    pub ty: ValueType,
    /// Whether it must be given.
    pub required: bool,
    /// What it means.
    pub doc: String,
}

/// The schema of a kind of file, for a program that has these.
pub fn json_schema(file: &File, names: &ProgramNames) -> Value {
    let made = SchemaWriter { names };
    let mut definitions = Map::new();
    for inner in file.objects().into_iter().skip(1) {
        definitions.insert(inner.name.to_owned(), made.object(inner));
    }
    definitions.insert("value".to_owned(), any_value());
    definitions.insert("value_type".to_owned(), value_type());
    definitions.insert("condition".to_owned(), condition());
    definitions.insert("argument".to_owned(), made.argument());
    definitions.insert("change".to_owned(), change());
    // What nothing refers to would only be noise.
    let mut whole = made.object(file.object);
    let mut used = vec![whole.clone()];
    let mut kept = Map::new();
    while let Some(from) = used.pop() {
        for name in references(&from) {
            if let Some(definition) = definitions.remove(&name) {
                used.push(definition.clone());
                kept.insert(name, definition);
            }
        }
    }
    if let Value::Object(whole) = &mut whole {
        whole.insert("$schema".to_owned(), json!("http://json-schema.org/draft-07/schema#"));
        whole.insert("title".to_owned(), json!(format!("Davit: {}", file.object.what)));
        whole.insert("definitions".to_owned(), Value::Object(kept));
    }
    whole
}

/// The names of the definitions that a schema refers to.
fn references(schema: &Value) -> Vec<String> {
    match schema {
        Value::Object(entries) => entries
            .iter()
            .flat_map(|(key, value)| match (key.as_str(), value) {
                ("$ref", Value::String(path)) => path.rsplit('/').next().map(str::to_owned).into_iter().collect(),
                _ => references(value),
            })
            .collect(),
        Value::Array(list) => list.iter().flat_map(references).collect(),
        _ => Vec::new(),
    }
}

fn refer(name: &str) -> Value {
    json!({ "$ref": format!("#/definitions/{name}") })
}

/// What it is made with.
#[derive(Clone, Copy)]
struct SchemaWriter<'a> {
    names: &'a ProgramNames,
}

impl SchemaWriter<'_> {
    fn object(self, object: &Object) -> Value {
        let properties: Map<String, Value> =
            object.yaml_keys().map(|key| (key.name.to_owned(), self.row(key))).collect();
        let required: Vec<&str> = object.yaml_keys().filter(|key| key.required).map(|key| key.name).collect();
        let kind = if object.may_be_empty { json!(["object", "null"]) } else { json!("object") };
        let mut out = json!({
            "type": kind, "description": object.doc, "properties": properties, "additionalProperties": false,
        });
        if !required.is_empty() {
            out["required"] = json!(required);
        }
        let either = object.yaml_keys().filter(|key| !key.instead.is_empty());
        let either: Vec<Value> =
            either.map(|key| json!({ "anyOf": [{ "required": [key.name] }, { "required": [key.instead] }] })).collect();
        if !either.is_empty() {
            out["allOf"] = json!(either);
        }
        out
    }

    /// A key with what an editor shows of it. What stands beside a reference is not looked at, so that goes around it.
    fn row(self, key: &Key) -> Value {
        let mut out = match self.form(&key.form) {
            Value::Object(entries) if !entries.contains_key("$ref") => Value::Object(entries),
            // Editors complete what they know to be a table with its colon.
            reference
                if matches!(key.form, Form::Table(inner) if !inner.may_be_empty)
                    || matches!(key.form, Form::Condition) =>
            {
                json!({ "type": "object", "allOf": [reference] })
            }
            reference => json!({ "allOf": [reference] }),
        };
        out["description"] = json!(key.told());
        out
    }

    fn form(self, form: &Form) -> Value {
        let of = |form: &Form| self.form(form);
        match form {
            Form::Version => json!({ "const": 1 }),
            Form::Truth => json!({ "type": "boolean" }),
            Form::Text | Form::Path | Form::Step => json!({ "type": "string" }),
            Form::Name(names) => self.name(*names),
            Form::State => text("^([A-Za-z_][A-Za-z0-9_]*:)?[A-Za-z_][A-Za-z0-9_]*(\\.[A-Za-z_][A-Za-z0-9_]*)*$"),
            Form::Trigger => {
                text("^((?!e_(after|at)\\()\\S+|e_(after|at)\\(\\s*[-+0-9.eE]+\\s*(,\\s*[^\\s,()]+\\s*)?\\))$")
            }
            Form::Whole { least, most } => json!({ "type": "integer", "minimum": least, "maximum": most }),
            Form::Number => json!({ "type": "number" }),
            Form::Seconds => json!({ "type": "number", "exclusiveMinimum": 0, "maximum": 86_400 }),
            Form::Milliseconds => json!({ "type": "number", "exclusiveMinimum": 0, "maximum": 86_400_000 }),
            Form::Choice(words) => json!({ "type": "string", "enum": words }),
            Form::Value => refer("value"),
            Form::ValueType => refer("value_type"),
            Form::Condition => refer("condition"),
            Form::States => states(),
            // Only Lua has functions.
            Form::Function => json!(false),
            Form::Changes => json!({ "type": "array", "items": refer("change") }),
            Form::List(inner) => json!({ "type": "array", "items": of(inner) }),
            Form::Several(inner) => json!({ "anyOf": [of(inner), { "type": "array", "items": of(inner) }] }),
            Form::Set(inner) => {
                json!({ "anyOf": [of(inner), { "type": "array", "items": of(inner), "uniqueItems": true }] })
            }
            Form::Named(NameKind::Platform, inner) => self.platforms(of(inner)),
            Form::Named(names, inner) => {
                json!({ "type": "object", "propertyNames": self.name(*names), "additionalProperties": of(inner) })
            }
            Form::Table(inner) => refer(inner.name),
            Form::Either(forms) => json!({ "anyOf": forms.iter().map(of).collect::<Vec<_>>() }),
        }
    }

    /// A name. Where the program has all that there are, one of those; component types may be declared in a file as well.
    fn name(self, of: NameKind) -> Value {
        let (pattern, names) = (text(of.pattern()), self.names);
        let one_of = |known: Vec<&str>| if known.is_empty() { text(of.pattern()) } else { json!({ "enum": known }) };
        match of {
            NameKind::Platform => one_of(names.platforms.iter().map(|platform| platform.name.as_str()).collect()),
            NameKind::Library => one_of(names.libraries.iter().map(|name| name.as_str()).collect()),
            NameKind::Type if !names.types.is_empty() => {
                let known: Vec<&str> = names.types.iter().map(|name| name.as_str()).collect();
                json!({ "anyOf": [{ "enum": known }, pattern] })
            }
            _ => pattern,
        }
    }

    /// One platform, with its options under its name.
    fn platforms(self, any: Value) -> Value {
        let options = |platform: &PlatformNames| {
            let properties: Map<String, Value> =
                platform.options.iter().map(|option| (option.name.to_string(), self.option(option))).collect();
            let required: Vec<&str> =
                platform.options.iter().filter(|option| option.required).map(|option| option.name.as_str()).collect();
            let kind = if required.is_empty() { json!(["object", "null"]) } else { json!("object") };
            let of = json!({
                "type": kind, "properties": properties, "required": required, "additionalProperties": false,
            });
            (platform.name.to_string(), of)
        };
        let known: Map<String, Value> = self.names.platforms.iter().map(options).collect();
        let others = if known.is_empty() { any } else { json!(false) };
        json!({
            "type": "object", "minProperties": 1, "maxProperties": 1, "properties": known,
            "propertyNames": text(NameKind::Platform.pattern()), "additionalProperties": others,
        })
    }

    /// What a word may be said of: values, members, further words, and how a comparison is made.
    fn argument(self) -> Value {
        let mut words: Map<String, Value> = CONDITIONS.iter().chain(SIGNALS).map(word_of).collect();
        words.extend(COMPARISON.yaml_keys().map(|key| (key.name.to_owned(), self.row(key))));
        // Each of these is asked of the kind of value that it is about.
        json!({
            "type": ["number", "string", "boolean", "array", "object"],
            "items": refer("argument"), "properties": words, "additionalProperties": false,
        })
    }

    fn option(self, option: &OptionName) -> Value {
        let mut of = value_of(&option.ty);
        of["description"] = json!(option.doc);
        of
    }
}

/// The values of a type.
fn value_of(ty: &ValueType) -> Value {
    match ty {
        ValueType::Bool => json!({ "type": "boolean" }),
        ValueType::Int => json!({ "type": "integer" }),
        ValueType::Float => json!({ "type": "number" }),
        ValueType::Str | ValueType::Event => json!({ "type": "string" }),
        ValueType::Array(of, None) => json!({ "type": "array", "items": value_of(of) }),
        ValueType::Array(of, Some(n)) => {
            json!({ "type": "array", "items": value_of(of), "minItems": n, "maxItems": n })
        }
        ValueType::Record(fields) => {
            let properties: Map<String, Value> =
                fields.iter().map(|(name, ty)| (name.to_string(), value_of(ty))).collect();
            let required: Vec<&str> = fields.iter().map(|(name, _)| name.as_str()).collect();
            json!({ "type": "object", "properties": properties, "required": required, "additionalProperties": false })
        }
    }
}

fn text(pattern: &str) -> Value {
    json!({ "type": "string", "pattern": pattern })
}

fn states() -> Value {
    let who = NameKind::Component.pattern().trim_matches(['^', '$']);
    let demanded: Vec<&str> = RunState::NAMES
        .iter()
        .copied()
        .filter(|name| RunState::from_name(name).and_then(RunState::wanted).is_some())
        .collect();
    json!({ "type": "array", "items": text(&format!("^\\s*{who}\\s*:\\s*({})\\s*$", demanded.join("|"))) })
}

fn any_value() -> Value {
    json!({ "description": Form::Value.words(Words::Plain), "type": ["boolean", "number", "string", "array", "object"] })
}

fn value_type() -> Value {
    json!({
        "description": Form::ValueType.words(Words::Plain),
        "anyOf": [
            { "type": "string", "pattern": "^\\s*((bool|int|float|string|event)\\s*(\\[\\s*[0-9]*\\s*\\]\\s*)*|\\{.*\\}.*)$" },
            { "type": "object", "minProperties": 1, "additionalProperties": refer("value_type") },
        ],
    })
}

/// A word with its arguments.
fn word_of(word: &Word) -> (String, Value) {
    let of = json!({ "type": ["array", "string", "object"], "allOf": [refer("argument")], "description": word.doc });
    (word.name.to_owned(), of)
}

/// One word with its arguments.
fn condition() -> Value {
    let words: Map<String, Value> = CONDITIONS.iter().map(word_of).collect();
    json!({
        "description": "A condition: one word, with its argument or the list of its arguments.",
        "type": "object", "minProperties": 1, "maxProperties": 1, "properties": words, "additionalProperties": false,
    })
}

/// One change: its word, and its parts.
fn change() -> Value {
    let one = |object: &'static Object| {
        (object.name.to_owned(), json!({ "type": "object", "allOf": [refer(object.name)], "description": object.doc }))
    };
    let words: Map<String, Value> = CHANGES.iter().map(|change| one(change.object)).collect();
    json!({
        "description": "A change: one word, with what it is about.",
        "type": "object", "minProperties": 1, "maxProperties": 1, "properties": words, "additionalProperties": false,
    })
}
