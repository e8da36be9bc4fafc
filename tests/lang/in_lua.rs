//! The table of what can be written, in Lua: what is refused in YAML is refused there too.

use crate::reference::{around, least, load, put, shown};
use davit::lang::grammar::{CHANGES, FILES, File, Form, Key, Languages, Object};
use davit::lang::schema;
use davit::model::{Code, codes};
use serde_yaml::{Mapping, Value};

/// What is refused in Lua with a code of its own, since it is a call there and no key.
const OTHERWISE: &[(&str, Code)] = &[
    ("configuration.holds", codes::LUA_UNDEFINED),
    ("monitor.when", codes::LUA_UNDEFINED),
    ("operation_call.undo", codes::TEXT_BAD_NAME),
];

/// What cannot be written wrongly so: an argument of a call that takes as many as there are.
const NO_KEYS: &[&str] = &["operation_call.args", "undo.args"];

/// A value that is the same wherever it stands.
fn plain(value: &Value) -> String {
    match value {
        Value::Null => "nil".to_owned(),
        Value::Bool(truth) => truth.to_string(),
        Value::Number(number) => match number.as_f64().unwrap_or_default() {
            number if number.is_nan() => "0/0".to_owned(),
            number if number.is_infinite() => "math.huge".to_owned(),
            _ => number.to_string(),
        },
        Value::String(text) => format!("{text:?}"),
        Value::Sequence(list) => format!("{{ {} }}", list.iter().map(plain).collect::<Vec<_>>().join(", ")),
        Value::Mapping(table) => {
            let entry = |(key, value): (&Value, &Value)| format!("[{}] = {}", plain(key), plain(value));
            format!("{{ {} }}", table.iter().map(entry).collect::<Vec<_>>().join(", "))
        }
        Value::Tagged(_) => panic!("no example has one: {value:?}"),
    }
}

/// A condition, or what a word is said of: each word is a function.
fn condition(value: &Value, outermost: bool) -> String {
    let word = match value {
        Value::Mapping(table) if table.len() == 1 => table.iter().next(),
        _ => None,
    };
    let known = |name: &Value| name.as_str().is_some_and(|name| schema::about(name).iter().any(|of| of.of.is_none()));
    let Some((name, of)) = word.filter(|(name, _)| outermost || known(name)) else { return plain(value) };
    let name = name.as_str().expect("a word");
    let args = match of {
        Value::Sequence(args) => args.iter().map(|arg| condition(arg, false)).collect::<Vec<_>>().join(", "),
        one => condition(one, false),
    };
    if ["all", "any", "norm", "min", "max"].contains(&name) {
        return format!("{name} {{ {args} }}");
    }
    format!("{name}({args})")
}

/// A change: its keys are arguments.
fn change(verb: &str, table: &Mapping) -> String {
    let of = CHANGES.iter().find(|change| change.object.name == verb).expect("a change");
    let mut given = Vec::new();
    let mut rest: Vec<String> = Vec::new();
    let mut undo = String::new();
    let of_key =
        |name: &str, value: &Value| of.object.key(name).map_or_else(|| plain(value), |key| lua(&key.form, value));
    for argument in of.arguments {
        given.push(match argument.strip_suffix('…') {
            Some(list) => match table.get(list) {
                Some(Value::Sequence(all)) => all.iter().map(plain).collect::<Vec<_>>().join(", "),
                Some(one) => plain(one),
                None => continue,
            },
            None if *argument == "options" => continue,
            None => table.get(*argument).map_or_else(|| "nil".to_owned(), |value| of_key(argument, value)),
        });
    }
    while given.last().is_some_and(|last| last == "nil") {
        given.pop();
    }
    let is_argument = |name: &str| of.arguments.iter().any(|argument| argument.trim_end_matches('…') == name);
    for (name, value) in table.iter().map(|(name, value)| (name.as_str().expect("a name"), value)) {
        if name == "undo" {
            undo = match value {
                Value::Mapping(called) => {
                    let args = called.get("args").and_then(Value::as_sequence).into_iter().flatten().map(plain);
                    let all: Vec<String> = called.get("operation").map(plain).into_iter().chain(args).collect();
                    format!(":undo({})", all.join(", "))
                }
                other => format!(":undo({})", plain(other)),
            };
        } else if !is_argument(name) {
            rest.push(format!("{name} = {}", of_key(name, value)));
        }
    }
    if of.arguments.contains(&"options") && !rest.is_empty() {
        given.push(format!("{{ {} }}", rest.join(", ")));
    }
    format!("{verb}({}){undo}", given.join(", "))
}

/// A table: most have a constructor, and what is a list of parts in YAML are its elements.
fn table(object: &Object, table: &Mapping) -> String {
    let mut parts = Vec::new();
    for (name, value) in table.iter().map(|(name, value)| (name.as_str().expect("a name"), value)) {
        let form = object.key(name).map(|key| key.form);
        match (object.name, name, value) {
            ("configuration", "changes", Value::Sequence(all)) => {
                for one in all.iter().filter_map(Value::as_mapping) {
                    let (verb, of) = one.iter().next().expect("a change");
                    parts.push(change(verb.as_str().unwrap(), of.as_mapping().expect("a table")));
                }
            }
            ("state", "states", Value::Mapping(states)) => {
                let Some(Form::Named(_, inner)) = form else { unreachable!() };
                parts
                    .extend(states.iter().map(|(name, of)| format!("{} = {}", name.as_str().unwrap(), lua(inner, of))));
            }
            ("state", "transitions", Value::Sequence(all)) => {
                let Some(Form::List(inner)) = form else { unreachable!() };
                parts.extend(all.iter().map(|one| lua(inner, one)));
            }
            ("connector", "connector", _) => {}
            _ => parts.push(format!("{name} = {}", form.map_or_else(|| plain(value), |form| lua(&form, value)))),
        }
    }
    let constructor = match object.name {
        "configuration" => "Configuration ",
        "state" => "state ",
        "transition" => "trans ",
        "connector" => "conn ",
        "monitor" => "monitor ",
        _ => "",
    };
    format!("{constructor}{{ {} }}", parts.join(", "))
}

/// A value of that form, as Lua has it.
fn lua(form: &Form, value: &Value) -> String {
    match (form, value) {
        (Form::Table(object), Value::Mapping(of)) => table(object, of),
        (Form::List(inner) | Form::Several(inner) | Form::Set(inner), Value::Sequence(all)) => {
            format!("{{ {} }}", all.iter().map(|one| lua(inner, one)).collect::<Vec<_>>().join(", "))
        }
        (Form::Named(_, inner), Value::Mapping(of)) => {
            let entry = |(name, value): (&Value, &Value)| format!("[{}] = {}", plain(name), lua(inner, value));
            format!("{{ {} }}", of.iter().map(entry).collect::<Vec<_>>().join(", "))
        }
        (Form::Either(forms), Value::Mapping(of)) => {
            let all_known = |object: &Object| of.keys().all(|key| object.key(key.as_str().unwrap()).is_some());
            let mut tables = forms.iter().filter(|form| matches!(form, Form::Table(_)));
            let fits = tables.clone().find(|form| matches!(form, Form::Table(object) if all_known(object)));
            lua(fits.or_else(|| tables.next()).expect("a table"), value)
        }
        (Form::Condition, value) => condition(value, true),
        _ => plain(value),
    }
}

/// A whole file of Lua that says what a file of YAML says.
fn written(file: &File, value: &Value) -> String {
    let (name, of) = value.as_mapping().and_then(|table| table.iter().next()).expect("one key");
    let form = file.object.key(name.as_str().unwrap()).expect("its key").form;
    match file.name {
        "configurations" => format!("ConfiguratorConf {}", lua(&form, of)),
        "monitors" => format!("Monitors {}", lua(&form, of)),
        _ => format!("return {}", lua(&form, of)),
    }
}

/// Every row that Lua can have, with the file in which it stands and the line that is refused.
fn rows() -> impl Iterator<Item = (&'static File, &'static Object, &'static Key)> {
    FILES.iter().filter(|file| file.in_lua).flat_map(|file| {
        let objects = file.objects().into_iter().filter(|object| !std::ptr::eq(*object, file.object));
        objects.flat_map(move |object| {
            let in_lua = |key: &&Key| matches!(key.language, Languages::All | Languages::Lua);
            object.keys.iter().filter(in_lua).map(move |key| (file, object, key))
        })
    })
}

/// A file with that line in its table, in both languages.
fn with(file: &File, object: &Object, key: &Key, line: &str) -> (Value, String) {
    let mut table = least(object);
    table.remove(Value::from(key.name));
    put(&mut table, key.beside);
    put(&mut table, line);
    let value = around(file, object, table);
    let text = written(file, &value);
    (value, text)
}

#[test]
fn what_is_refused_in_yaml_is_refused_in_lua() {
    let mut refused = 0;
    for (file, object, key) in rows() {
        let what = format!("{}.{}", object.name, key.name);
        if NO_KEYS.contains(&what.as_str()) || matches!(key.form, Form::Changes) {
            continue;
        }
        let line = match key.language {
            Languages::Lua => key.refused.replacen(" = ", ": ", 1),
            _ => key.refused.to_owned(),
        };
        let (value, text) = with(file, object, key, &line);
        let code = OTHERWISE.iter().find(|(of, _)| *of == what).map_or(key.code, |(_, code)| *code);
        let loaded = load(file, &text, "x.lua");
        let found: Vec<&str> = loaded.findings.iter().map(|finding| finding.code.0).collect();
        assert!(found.contains(&code.0), "{what}: {} is not in {found:?}\n{text}\n{}", code.0, shown(&loaded));
        if key.language == Languages::Lua {
            // In YAML nobody can write one.
            let loaded = load(file, &serde_yaml::to_string(&value).unwrap(), "x.yaml");
            assert!(loaded.findings.iter().any(davit::model::Finding::is_error), "{what}");
        }
        refused += 1;
    }
    assert!(refused > 50, "{refused}");
}

/// The printer above says what is meant: with the examples of the table the same files are read without a finding.
#[test]
fn what_is_read_in_yaml_is_read_in_lua() {
    for (file, object, key) in rows().filter(|(_, _, key)| key.language == Languages::All) {
        let (_, text) = with(file, object, key, &key.yaml());
        let loaded = load(file, &text, "x.lua");
        let news: Vec<_> = loaded.findings.iter().filter(|f| f.code != codes::MONITOR_NOTHING_REPEATED).collect();
        assert!(news.is_empty(), "{}.{}\n{text}\n{}", object.name, key.name, shown(&loaded));
    }
}
