//! Examples that are no key's: of tables, of the monitors' words, and of words that are no keys.

use crate::reference::{around, least, load, shown, yaml};
use davit::lang::grammar::{FILES, File, OWN_WORDS, Object};
use davit::lang::schema::{self, ReferenceEntry};
use davit::model::codes;
use serde_yaml::{Mapping, Value};

fn read(file: &File, text: &str, name: &str, what: &str) {
    let loaded = load(file, text, name);
    let news: Vec<_> = loaded.findings.iter().filter(|f| f.code != codes::MONITOR_NOTHING_REPEATED).collect();
    assert!(news.is_empty(), "{what}\n{text}\n{}", shown(&loaded));
}

/// The table that an example is: itself, or what stands behind its one name.
fn table_of(object: &Object, example: &Value) -> Option<Mapping> {
    let whole = example.as_mapping()?;
    if whole.keys().all(|key| object.key(key.as_str().unwrap()).is_some()) {
        return Some(whole.clone());
    }
    let inside = whole.values().next().filter(|_| whole.len() == 1)?.as_mapping()?;
    let known = inside.keys().all(|key| object.key(key.as_str().unwrap()).is_some());
    known.then(|| inside.clone())
}

#[test]
fn every_table_is_written_as_its_example_says() {
    let mut tried = 0;
    for file in FILES {
        for object in file.objects() {
            let example = yaml(&object.yaml());
            let text = match (object.name, table_of(object, &example)) {
                // What has another form beside the table, and what is part of a condition.
                ("trusted", _) => {
                    let mut table = least(file.object);
                    table.extend(example.as_mapping().unwrap().clone());
                    Value::Mapping(table)
                }
                ("comparison", _) if file.name == "monitors" => monitor(&object.yaml()),
                ("comparison", _) => continue,
                (_, Some(table)) => {
                    let mut whole = least(object);
                    whole.extend(table);
                    around(file, object, whole)
                }
                (name, None) => panic!("{name}: its example is no such table: {}", object.yaml()),
            };
            read(file, &serde_yaml::to_string(&text).unwrap(), "x.yaml", object.name);
            tried += 1;
        }
    }
    assert!(tried > 35, "{tried}");
}

/// What stands around the example of a table in Lua.
const IN_LUA: &[(&str, &str)] = &[
    ("configuration", "ConfiguratorConf { EXAMPLE }"),
    ("create", CHANGE),
    ("destroy", CHANGE),
    ("connect", CHANGE),
    ("disconnect", CHANGE),
    ("property_set", CHANGE),
    ("port_write", CHANGE),
    ("operation_call", CHANGE),
    ("replace", CHANGE),
    ("undo", CHANGE),
    ("confirm", CHANGE),
    ("buffer", "ConfiguratorConf { c = Configuration { connect(\"A.y\", \"B.u\", EXAMPLE) } }"),
    ("monitor", "Monitors { EXAMPLE }"),
    ("comparison", WHEN),
];
const CHANGE: &str = "ConfiguratorConf { c = Configuration { EXAMPLE } }";
const WHEN: &str = "Monitors { m = monitor { when = EXAMPLE, event = \"e_high\" } }";

fn file_of(around: &str) -> &'static File {
    let name = match around.split([' ', '{']).next() {
        Some("ConfiguratorConf") => "configurations",
        Some("Monitors") => "monitors",
        _ => "coordinator",
    };
    File::named(name).unwrap()
}

#[test]
fn every_table_of_lua_is_written_as_its_example_says() {
    let tables = FILES.iter().filter(|file| file.in_lua).flat_map(File::objects);
    let mut tried = 0;
    for object in tables {
        // Told in Lua as well as in YAML: what `davit explain` shows.
        let told = schema::about(object.name).into_iter().find(|entry| entry.of.is_none()).unwrap();
        let Some(example) = told.example.lua else { continue };
        let (_, around) = IN_LUA.iter().find(|(name, _)| *name == object.name).expect("what stands around it");
        read(file_of(around), &around.replace("EXAMPLE", example), "x.lua", object.name);
        tried += 1;
    }
    assert!(tried >= IN_LUA.len(), "{tried}");
}

/// A file of one monitor, in YAML.
fn monitor(when: &str) -> Value {
    yaml(&format!("monitors: {{ m: {{ when: {when}, event: e_high }} }}"))
}

/// Words of the monitors' language, and whether each is a condition.
fn words() -> Vec<(ReferenceEntry, bool)> {
    let all = schema::names().into_iter().flat_map(schema::about);
    let of = |entry: &ReferenceEntry| match entry.form.as_str() {
        "a condition of the monitors' language" => Some(true),
        "a signal of the monitors' language" => Some(false),
        _ => None,
    };
    all.filter_map(|entry| of(&entry).map(|condition| (entry, condition))).collect()
}

#[test]
fn every_word_of_the_monitors_is_written_as_its_example_says() {
    let words = words();
    assert!(words.len() > 25, "{}", words.len());
    let file = File::named("monitors").unwrap();
    for (word, is_condition) in words {
        let (lua, yaml) = (word.example.lua.unwrap(), word.example.yaml.unwrap());
        let (lua, yaml) = match is_condition {
            true => (lua.to_owned(), yaml),
            false => (format!("above({lua}, 1.0)"), format!("{{ above: [{yaml}, 1.0] }}")),
        };
        read(file, &WHEN.replace("EXAMPLE", &lua), "x.lua", word.name);
        read(file, &serde_yaml::to_string(&monitor(&yaml)).unwrap(), "x.yaml", word.name);
    }
}

const TRANSITION: &str = "return state { idle = state {}, trans { src = \"initial\", tgt = \"idle\" }, trans { src = \"idle\", \
                          tgt = \"idle\", EXAMPLE } }";
const TRANSITION_YAML: &str = "coordinator: { states: { idle: {} }, transitions: [{ src: initial, tgt: idle }, { src: idle, tgt: idle, \
                               EXAMPLE }] }";

/// What stands around the example of a word that is no key, in Lua and in YAML; empty: it is not written there.
const OWN: &[(&str, &str, &str)] = &[
    ("self", "", "OPERATION"),
    ("_default", CHANGE, "configurations: { c: { EXAMPLE } }"),
    (
        "initial",
        "return state { idle = state {}, trans { EXAMPLE } }",
        "coordinator: { states: { idle: {} }, transitions: [{ EXAMPLE }] }",
    ),
    ("e_after", TRANSITION, TRANSITION_YAML),
    ("e_at", TRANSITION, TRANSITION_YAML),
    ("e_done", TRANSITION, TRANSITION_YAML),
    ("condition", WHEN, "monitors: { m: { when: EXAMPLE, event: e_high } }"),
    ("signal", WHEN, "monitors: { m: { when: EXAMPLE, event: e_high } }"),
];

#[test]
fn every_word_that_is_no_key_is_written_as_its_example_says() {
    for word in OWN_WORDS {
        let told = schema::about(word.name).into_iter().find(|entry| entry.of.is_none()).unwrap().example;
        let (_, in_lua, in_yaml) = OWN.iter().find(|(name, ..)| *name == word.name).expect("what stands around it");
        assert_eq!(told.lua.is_some(), !in_lua.is_empty(), "{}", word.name);
        if let Some(lua) = told.lua {
            read(file_of(in_lua), &in_lua.replace("EXAMPLE", lua), "x.lua", word.name);
        }
        let example = told.yaml.unwrap();
        let text = match *in_yaml {
            "OPERATION" => {
                let (file, name) = (File::named("deployment").unwrap(), "operation");
                let object = file.objects().into_iter().find(|object| object.name == name).unwrap();
                around(file, object, yaml(&example).as_mapping().unwrap().clone())
            }
            text => yaml(&text.replace("EXAMPLE", &example)),
        };
        let file = File::named(word.file).unwrap();
        read(file, &serde_yaml::to_string(&text).unwrap(), "x.yaml", word.name);
    }
}
