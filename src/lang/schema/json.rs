//! JSON Schema (draft 7, which editors know best) of one kind of file in YAML.
//!
//! It is no more than a first look: what it refuses, reading refuses too (a test compares them); what it lets stand may still be
//! refused for what stands in other places.

use crate::lang::grammar::{CHANGES, COMPARISON, File, Form, Key, NameKind, Object, Words};
use crate::lang::words::{CONDITIONS, SIGNALS, Word};
use crate::model::RunState;
use serde_json::{Map, Value, json};

/// The schema of a kind of file.
pub fn json_schema(file: &File) -> Value {
    let mut definitions = Map::new();
    for inner in file.objects().into_iter().skip(1) {
        definitions.insert(inner.name.to_owned(), object(inner));
    }
    definitions.insert("value".to_owned(), any_value());
    definitions.insert("value_type".to_owned(), value_type());
    definitions.insert("condition".to_owned(), condition());
    definitions.insert("argument".to_owned(), argument());
    definitions.insert("change".to_owned(), change());
    // What nothing refers to would only be noise.
    let mut whole = object(file.object);
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

fn object(object: &Object) -> Value {
    let properties: Map<String, Value> = object.yaml_keys().map(|key| (key.name.to_owned(), row(key))).collect();
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
fn row(key: &Key) -> Value {
    let mut out = match form(&key.form) {
        Value::Object(entries) if !entries.contains_key("$ref") => Value::Object(entries),
        // Editors complete what they know to be a table with its colon.
        reference
            if matches!(key.form, Form::Table(inner) if !inner.may_be_empty) || matches!(key.form, Form::Condition) =>
        {
            json!({ "type": "object", "allOf": [reference] })
        }
        reference => json!({ "allOf": [reference] }),
    };
    out["description"] = json!(key.told());
    out
}

fn text(pattern: &str) -> Value {
    json!({ "type": "string", "pattern": pattern })
}

fn form(form: &Form) -> Value {
    use self::form as of;
    match form {
        Form::Version => json!({ "const": 1 }),
        Form::Truth => json!({ "type": "boolean" }),
        Form::Text | Form::Path | Form::Step => json!({ "type": "string" }),
        Form::Name(names) => text(names.pattern()),
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
        Form::Named(inner) => json!({ "type": "object", "additionalProperties": of(inner) }),
        Form::Table(inner) => refer(inner.name),
        Form::Either(forms) => json!({ "anyOf": forms.iter().map(of).collect::<Vec<_>>() }),
    }
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

/// What a word may be said of: values, members, further words, and how a comparison is made.
fn argument() -> Value {
    let mut words: Map<String, Value> = CONDITIONS.iter().chain(SIGNALS).map(word_of).collect();
    words.extend(COMPARISON.yaml_keys().map(|key| (key.name.to_owned(), row(key))));
    // Each of these is asked of the kind of value that it is about.
    json!({
        "type": ["number", "string", "boolean", "array", "object"],
        "items": refer("argument"), "properties": words, "additionalProperties": false,
    })
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
