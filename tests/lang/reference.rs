//! The table of what can be written against reading: every row's example is read, in both languages, and its refused line refused
//! (in Lua: `in_lua`); the schema says what reading says; the pages of the reference are made of it.

use davit::diagnostics::render;
use davit::lang::grammar::{CHANGES, FILES, File, Form, Key, Languages, Object};
use davit::lang::schema::{self, OptionName, PlatformNames, ProgramNames};
use davit::lang::{self, LoadOptions, Loaded, Sources};
use davit::model::{Ident, ValueType, codes};
use serde_yaml::{Mapping, Value};
use std::path::Path;

/// Files that examples name.
const BESIDE: &[(&str, &str)] = &[
    ("configurations.lua", "ConfiguratorConf { up = Configuration { create(\"A\", \"Gain\") } }"),
    ("coordinator.lua", COORDINATOR),
    ("arm.lua", COORDINATOR),
    ("gripper.lua", COORDINATOR),
    ("monitors.lua", "Monitors { high = monitor { when = above(\"A.x\", 2.0), event = \"e_high\" } }"),
    ("robot.lua", ""),
    ("robot.yaml", ROBOT),
    ("delayed.lua", "ConfiguratorConf { up = Configuration { property_set(\"A.k\", delay_s) } }"),
];
/// A deployment that can be a subsystem.
const ROBOT: &str = "davit: 1
name: robot
platform: embedded
libraries: [standard]
parameters: { delay_s: { type: float, default: 0.005 } }
activities: { control: { period_ms: 1.0 } }
configurations: [delayed.lua]
coordinator: coordinator.lua
deploy: { event: e_start, up: idle, within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";
/// One that uses the parameter whose table is tried.
const WITH_A: &str = "ConfiguratorConf { up = Configuration { property_set(\"A.k\", a) } }";
const COORDINATOR: &str = "return state { idle = state {}, trans { src = \"initial\", tgt = \"idle\" } }";
/// One that uses the parameter of the example of `with`.
const WITH_GAIN: &str = "ConfiguratorConf { up = Configuration { property_set(\"A.k\", gain) } }";

pub fn yaml(line: &str) -> Value {
    serde_yaml::from_str(line).unwrap_or_else(|why| panic!("{line}: {why}"))
}

/// Puts the keys of `line` (`key: value`) into a table.
pub fn put(table: &mut Mapping, line: &str) {
    if line.is_empty() {
        return;
    }
    let Value::Mapping(entries) = yaml(line) else { panic!("`{line}` is no key with a value") };
    table.extend(entries);
}

/// A table with what it must have.
pub fn least(object: &Object) -> Mapping {
    let mut table = Mapping::new();
    object.yaml_keys().filter(|key| key.required).for_each(|key| put(&mut table, &key.yaml()));
    if object.name == "deployment" {
        put(&mut table, "libraries: [standard]");
        put(&mut table, "coordinator: coordinator.lua");
        // What subsystems may be updated in.
        put(&mut table, "activities: { control: { period_ms: 1.0, priority: 80 } }");
    }
    if object.name == "subsystem" {
        put(&mut table, "deployment: robot.yaml");
    }
    table
}

/// A table where a form has one.
fn within(form: &Form, object: &Object, value: Value) -> Option<Value> {
    let named = |name: &str, value| Value::Mapping([(Value::from(name), value)].into_iter().collect());
    match form {
        Form::Table(other) => std::ptr::eq(*other, object).then_some(value),
        Form::List(inner) | Form::Several(inner) | Form::Set(inner) => {
            Some(Value::Sequence(vec![within(inner, object, value)?]))
        }
        Form::Named(_, inner) => Some(named("a", within(inner, object, value)?)),
        Form::Either(forms) => forms.iter().find_map(|form| within(form, object, value.clone())),
        Form::Changes => {
            let change = CHANGES.iter().find(|change| std::ptr::eq(change.object, object))?;
            Some(Value::Sequence(vec![named(change.object.name, value)]))
        }
        Form::Condition if object.name == "comparison" => {
            let Value::Mapping(mut above) = yaml("above: [A.x, 2.0]") else { unreachable!() };
            above.values_mut().for_each(|args| args.as_sequence_mut().unwrap().push(value.clone()));
            Some(Value::Mapping(above))
        }
        _ => None,
    }
}

/// A whole file in which the table stands.
pub fn around(file: &File, object: &Object, table: Mapping) -> Value {
    let mut value = Value::Mapping(table);
    let mut inner = object;
    while !std::ptr::eq(inner, file.object) {
        let holder = |outer: &&'static Object| !std::ptr::eq(*outer, inner) && holds(outer, inner).is_some();
        let outer = file.objects().into_iter().find(holder).expect("a table that it stands in");
        let key = holds(outer, inner).unwrap();
        let mut table = least(outer);
        table.insert(Value::from(key.name), within(&key.form, inner, value).unwrap());
        (value, inner) = (Value::Mapping(table), outer);
    }
    value
}

/// The key of a table behind which another one may stand.
fn holds(outer: &'static Object, inner: &Object) -> Option<&'static Key> {
    outer.yaml_keys().find(|key| {
        let mut found = false;
        key.form.tables(&mut |table| found |= std::ptr::eq(table, inner));
        found
    })
}

/// Loads a file of that kind, in a deployment.
pub fn load(file: &File, text: &str, name: &str) -> Loaded {
    let gain = (text.contains("with:") || text.contains("parameters:")) && text.contains("gain");
    let a = text.contains("parameters:\n  a:");
    let deployment = match file.name {
        "deployment" => text.to_owned(),
        kind => {
            let mut table = least(File::named("deployment").unwrap().object);
            let named =
                if kind == "coordinator" { Value::from(name) } else { Value::Sequence(vec![Value::from(name)]) };
            table.insert(Value::from(kind), named);
            if text.contains("function") {
                put(&mut table, "trusted: true");
            }
            serde_yaml::to_string(&Value::Mapping(table)).unwrap()
        }
    };
    let mut files = vec![("d.yaml", deployment.as_str()), (name, text)];
    let other = |(name, text): &(&'static str, &'static str)| match *name {
        "configurations.lua" if a => ("configurations.lua", WITH_A),
        "configurations.lua" if gain => ("configurations.lua", WITH_GAIN),
        _ => (*name, *text),
    };
    files.extend(BESIDE.iter().map(other));
    // One without a default must be given.
    let set = if a { vec![("a".to_owned(), "0.5".to_owned())] } else { Vec::new() };
    lang::load_from(&Sources::memory(files), Path::new("d.yaml"), &LoadOptions { set, ..LoadOptions::default() })
}

/// Whether reading refuses it, or the compiler of statecharts, which sees what a chart as a whole lacks.
fn refused(loaded: &Loaded) -> bool {
    let charts = || loaded.deployment.iter().flat_map(davit::model::Deployment::charts);
    loaded.findings.iter().any(davit::model::Finding::is_error)
        || charts().any(|chart| davit::statechart::compile(chart).0.is_none())
}

pub fn shown(loaded: &Loaded) -> String {
    render(&loaded.findings, &loaded.sources, false)
}

/// Every row that YAML can have, with the file in which it stands: that with its example, and that with its refused line.
fn rows() -> Vec<(&'static File, &'static Object, &'static Key, Value, Value)> {
    let mut rows = Vec::new();
    for file in FILES {
        for object in file.objects() {
            for key in object.keys.iter().filter(|key| key.language != Languages::Lua) {
                let with = |line: &str| {
                    let mut table = least(object);
                    table.remove(Value::from(key.name));
                    put(&mut table, key.beside);
                    put(&mut table, line);
                    around(file, object, table)
                };
                rows.push((file, object, key, with(&key.yaml()), with(key.refused)));
            }
        }
    }
    assert!(rows.len() > 100, "{}", rows.len());
    rows
}

#[test]
fn every_example_is_read_and_every_refused_line_is_refused_so() {
    for (file, object, key, read, refused) in rows() {
        let what = format!("{}.{}", object.name, key.name);
        assert!(!key.doc.is_empty() || key.language == Languages::None, "{what} says nothing");
        if key.language != Languages::None {
            let text = serde_yaml::to_string(&read).unwrap();
            let loaded = load(file, &text, "x.yaml");
            assert!(loaded.findings.is_empty(), "{what}\n{text}\n{}", shown(&loaded));
        }
        let text = serde_yaml::to_string(&refused).unwrap();
        let loaded = load(file, &text, "x.yaml");
        let found: Vec<&str> = loaded.findings.iter().map(|finding| finding.code.0).collect();
        assert!(found.contains(&key.code.0), "{what}: {} is not in {found:?}\n{text}\n{}", key.code.0, shown(&loaded));
    }
}

/// Keys that are read into something else than themselves, and so are not written again.
const NOT_WRITTEN_AGAIN: &[(&str, &str)] = &[
    // Values that the texts have where they were used.
    ("deployment", "with"),
    ("deployment", "parameters"),
    // Of what is composed, the whole is written.
    ("deployment", "subsystems"),
    // Of coordinators with functions, which stay the files that they are; those of these examples have none.
    ("deployment", "trusted"),
    ("deployment", "host"),
    ("trusted", "open"),
];

#[test]
fn what_is_read_is_written_again() {
    let mut written = 0;
    for (file, object, key, read, _) in rows().into_iter().filter(|(_, _, key, ..)| key.language != Languages::None) {
        let of_composing = ["subsystem", "parameter"].contains(&object.name);
        if of_composing || NOT_WRITTEN_AGAIN.contains(&(object.name, key.name)) {
            continue;
        }
        let text = serde_yaml::to_string(&read).unwrap();
        let deployment = load(file, &text, "x.yaml").deployment.unwrap();
        let files = lang::print::deployment(&deployment, davit::diagnostics::Language::Yaml);
        let all: String = files.into_iter().map(|(_, text)| text).collect();
        let is_there = all.match_indices(key.name).any(|(at, name)| {
            let before = all[..at].chars().next_back();
            before.is_none_or(|c| " {\n".contains(c)) && all[at + name.len()..].starts_with(':')
        });
        assert!(is_there, "{}.{} is read, and not written:\n{text}\n{all}", object.name, key.name);
        written += 1;
    }
    assert!(written > 90, "{written}");
}

#[test]
fn every_example_in_lua_is_read() {
    let mut read = 0;
    for (object, around) in [
        ("configuration", "ConfiguratorConf { c = Configuration { EXAMPLE } }"),
        ("state", "return state { idle = state { EXAMPLE }, trans { src = \"initial\", tgt = \"idle\" } }"),
        (
            "transition",
            "return state { idle = state {}, busy = state {}, trans { src = \"initial\", tgt = \"idle\" }, trans { EXAMPLE } }",
        ),
        ("monitor", "Monitors { m = monitor { EXAMPLE } }"),
    ] {
        let file = FILES.iter().find(|file| file.in_lua && file.objects().iter().any(|o| o.name == object)).unwrap();
        let object = file.objects().into_iter().find(|o| o.name == object).unwrap();
        for key in
            object.keys.iter().filter(|key| key.language != Languages::Yaml && !matches!(key.form, Form::Changes))
        {
            let others = object.keys.iter().filter(|other| other.required && other.name != key.name);
            let lines: Vec<&str> = others.map(|other| other.example).chain([key.example]).collect();
            let text = around.replace("EXAMPLE", &lines.join(", "));
            let loaded = load(file, &text, "x.lua");
            let news: Vec<_> = loaded.findings.iter().filter(|f| f.code != codes::MONITOR_NOTHING_REPEATED).collect();
            assert!(news.is_empty(), "{}.{}\n{text}\n{}", object.name, key.name, shown(&loaded));
            read += 1;
        }
    }
    assert!(read > 25, "{read}");
}

/// `davit explain --keys` shows the first sentence: it is one, and says what the key is for, not what one of its words means.
#[test]
fn what_a_key_is_for_is_said_first() {
    for object in FILES.iter().flat_map(File::objects) {
        for key in object.keys.iter().filter(|key| key.language != Languages::None) {
            let first = key.doc.split(". ").next().unwrap();
            let of_a_word = first.starts_with('`') && first.contains("`: ");
            assert!(!of_a_word && first.len() > 8, "{}.{}: {first}", object.name, key.name);
        }
    }
}

/// Who leaves a key out knows what holds then.
#[test]
fn what_holds_without_a_key_is_said() {
    for object in FILES.iter().flat_map(File::objects) {
        for key in object.keys.iter().filter(|key| key.language != Languages::None) {
            let optional = !key.required && key.instead.is_empty();
            assert_eq!(optional, !key.default.is_empty(), "{}.{}: {}", object.name, key.name, key.default);
        }
    }
}

/// Where one of two keys must be there, an editor says so.
#[test]
fn the_schema_demands_one_of_two_keys() {
    let file = File::named("deployment").unwrap();
    let text = "davit: 1\nname: a\nplatform: simulated\nlibraries: [standard]\nconfigurations: [c.lua]\ncoordinator: k.lua\n\
                deploy: { event: e, up: up, within_s: 1 }\nshutdown: { event: f, down: idle, within_s: 1 }\n";
    let valid = |text: &str| validator(file).is_valid(&as_json(&serde_yaml::from_str(text).unwrap()));
    assert!(valid(text));
    assert!(valid(&text.replace("coordinator: k.lua", "coordinators: { a: k.lua }")));
    assert!(valid(&text.replace("libraries: [standard]", "types: {}")));
    assert!(!valid(&text.replace("coordinator: k.lua\n", "")));
    assert!(!valid(&text.replace("libraries: [standard]\n", "")));
}

/// The schema of a program has its platforms with their options, and its libraries.
#[test]
fn the_schema_has_the_names_of_its_program() {
    let option = |name: &str, ty, required| OptionName { name: ident(name), ty, required, doc: "it".to_owned() };
    let bus = vec![option("device", ValueType::Str, true), option("rate", ValueType::Float, false)];
    let platforms =
        [("bus", bus), ("embedded", Vec::new())].map(|(name, options)| PlatformNames { name: ident(name), options });
    let names = ProgramNames { platforms: platforms.into(), libraries: vec![ident("standard")], types: Vec::new() };
    let file = File::named("deployment").unwrap();
    let validator = jsonschema::validator_for(&schema::json_schema(file, &names)).unwrap();
    for (line, right) in [
        ("platform: embedded", true),
        ("platform: embeded", false),
        ("platform: { embedded: }", true),
        ("platform: { embedded: {}, bus: { device: can0 } }", false),
        ("platform: { embedded: { device: can0 } }", false),
        ("platform: { bus: { device: can0 } }", true),
        ("platform: { bus: { device: can0, rate: 1 } }", true),
        ("platform: { bus: { device: can0, rate: fast } }", false),
        ("platform: { bus: { rate: 1.0 } }", false),
        ("platform: { bus: { device: can0, rat: 1.0 } }", false),
        ("platform: { bus: }", false),
        ("libraries: standard", true),
        ("libraries: [standart]", false),
    ] {
        let mut table = least(file.object);
        put(&mut table, line);
        assert_eq!(validator.is_valid(&as_json(&Value::Mapping(table))), right, "{line}");
    }
}

fn ident(name: &str) -> Ident {
    Ident::new(name).unwrap()
}

/// What no schema sees: files, numbers that are none, and what stands in several places.
const BEYOND: &[davit::model::Code] = &[
    codes::TEXT_NO_FILE,
    codes::TYPE_BAD_DEFAULT,
    codes::TEXT_DUPLICATE_KEY,
    codes::TEXT_NOT_FINITE,
    codes::MONITOR_BAD_HYSTERESIS,
];

fn validator(file: &File) -> jsonschema::Validator {
    jsonschema::validator_for(&schema::json_schema(file, &ProgramNames::default()))
        .unwrap_or_else(|why| panic!("{}: {why}", file.name))
}

fn as_json(value: &Value) -> serde_json::Value {
    serde_json::to_value(value).unwrap()
}

#[test]
fn the_schema_says_what_reading_says() {
    for file in FILES {
        let validator = validator(file);
        for (of, object, key, read, refused) in rows() {
            if !std::ptr::eq(of, file) {
                continue;
            }
            let what = format!("{}.{}", object.name, key.name);
            if key.language != Languages::None {
                assert!(validator.is_valid(&as_json(&read)), "{what}: {read:?}");
            }
            let beyond = BEYOND.contains(&key.code)
                || (["property", "parameter"].contains(&object.name) && key.refused == "type: event");
            // A connector that is none is a state to it.
            if !beyond && object.name != "connector" {
                assert!(!validator.is_valid(&as_json(&refused)), "{what}: `{}` passes the schema", key.refused);
            }
        }
    }
}

/// Each row with the value of its example.
fn examples() -> impl Iterator<Item = (&'static File, &'static Object, &'static Key, Value)> {
    let with_example = |(file, object, key, ..): (&'static File, &'static Object, &'static Key, Value, Value)| {
        let example = yaml(&key.yaml()).as_mapping().and_then(|table| table.get(key.name)).cloned();
        (key.language != Languages::None).then(|| (file, object, key, example.expect("the key's own example")))
    };
    rows().into_iter().filter_map(with_example)
}

/// The whole file in which a row has that value, and whether reading takes it.
fn is_read(file: &'static File, object: &'static Object, key: &Key, value: Value) -> (Value, bool) {
    let mut table = least(object);
    put(&mut table, key.beside);
    table.insert(Value::from(key.name), value);
    let whole = around(file, object, table);
    let loaded = load(file, &serde_yaml::to_string(&whole).unwrap(), "x.yaml");
    (whole, !loaded.findings.iter().any(davit::model::Finding::is_error))
}

/// What is a list in which each stands once is one to both, and what is not is one to neither.
#[test]
fn the_schema_and_reading_agree_about_what_stands_twice() {
    let mut tried = (0, 0);
    for (file, object, key, example) in examples() {
        let (Form::List(inner) | Form::Several(inner) | Form::Set(inner)) = key.form else { continue };
        // Two transitions that are the same are another mistake.
        if matches!(inner, Form::Table(_)) {
            continue;
        }
        let one = example.as_sequence().and_then(|list| list.first()).unwrap_or(&example).clone();
        let (whole, read) = is_read(file, object, key, Value::Sequence(vec![one.clone(), one]));
        let what = format!("{}.{}", object.name, key.name);
        let once = matches!(key.form, Form::Set(_));
        *(if once { &mut tried.0 } else { &mut tried.1 }) += 1;
        assert_eq!(read, !once, "{what}: reading\n{}", serde_yaml::to_string(&whole).unwrap());
        assert_eq!(validator(file).is_valid(&as_json(&whole)), !once, "{what}: the schema");
    }
    assert!(tried.0 > 12 && tried.1 > 4, "{tried:?}");
}

/// What a table's own entries may be called is the same to both.
#[test]
fn the_schema_and_reading_agree_about_names() {
    let mut tried = 0;
    for (file, object, key, example) in examples() {
        let is_named = |form: &Form| matches!(form, Form::Named(..));
        let named = is_named(&key.form) || matches!(key.form, Form::Either(forms) if forms.iter().any(is_named));
        let Some((_, value)) = example.as_mapping().filter(|_| named).and_then(|table| table.iter().next()) else {
            continue;
        };
        for (name, right) in [("ne-ar", false), ("9th", false), ("", false), ("a b", false), ("near", true)] {
            let table = Value::Mapping([(Value::from(name), value.clone())].into_iter().collect());
            let (whole, read) = is_read(file, object, key, table);
            let what = format!("{}.{}: `{name}`", object.name, key.name);
            // A name that is right may still be one that nothing has.
            assert!(right || !read, "{what}: reading");
            assert_eq!(validator(file).is_valid(&as_json(&whole)), right, "{what}: the schema");
        }
        tried += 1;
    }
    assert!(tried > 14, "{tried}");
}

/// An editor underlines a slip however deep it stands in a condition.
#[test]
fn the_schema_knows_the_words_inside_of_conditions() {
    let file = FILES.iter().find(|file| file.name == "monitors").expect("monitors");
    let validator = validator(file);
    let holds = |when: &str| {
        let text = format!("monitors:\n  m:\n    when: {when}\n    event: e_x\n");
        validator.is_valid(&as_json(&serde_yaml::from_str(&text).expect("it is YAML")))
    };
    let right =
        "{ all: [{ above: [{ norm: [\"A.x\", \"A.y\"] }, 2.0, { hysteresis: 0.5 }] }, { no: { is_true: A.ready } }] }";
    assert!(holds(right));
    for (word, slip) in [("above", "abve"), ("norm", "nrm"), ("hysteresis", "hysteresi"), ("is_true", "istrue")] {
        assert!(!holds(&right.replace(word, slip)), "{slip}");
    }
}

#[test]
fn every_shipped_file_passes_its_schema() {
    let mut seen = 0;
    for entry in yaml_files("deployments").chain(yaml_files("configs")).chain(yaml_files("examples")) {
        let text = std::fs::read_to_string(&entry).unwrap();
        let Ok(value) = serde_yaml::from_str::<Value>(&text) else { continue };
        let Some(table) = value.as_mapping() else { continue };
        let kind = if table.contains_key("davit") {
            "deployment"
        } else if let Some(file) = FILES.iter().find(|file| table.contains_key(file.name)) {
            file.name
        } else {
            continue;
        };
        let errors: Vec<String> =
            validator(File::named(kind).unwrap()).iter_errors(&as_json(&value)).map(|why| format!("{why}")).collect();
        assert!(errors.is_empty(), "{}: {errors:#?}", entry.display());
        seen += 1;
    }
    assert!(seen >= 7, "{seen}");
}

/// The YAML files below a folder.
fn yaml_files(folder: &str) -> impl Iterator<Item = std::path::PathBuf> {
    fn walk(folder: &Path, found: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, found);
            } else if path.extension().is_some_and(|e| e == "yaml" || e == "yml") {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    walk(Path::new(folder), &mut found);
    found.sort();
    found.into_iter()
}

/// An editor that underlines what is right is worse than none: what the schema refuses, reading refuses.
#[test]
fn what_the_schema_refuses_is_refused() {
    let mut random = Random(1);
    let (mut cases, mut by_schema) = (0, 0);
    let validators: Vec<_> = FILES.iter().map(validator).collect();
    for (file, object, key, read, _) in rows().into_iter().filter(|(_, _, key, ..)| key.language != Languages::None) {
        let validator = &validators[FILES.iter().position(|other| std::ptr::eq(other, file)).unwrap()];
        for _ in 0..25 {
            let mut value = read.clone();
            mutate(&mut value, &mut random);
            cases += 1;
            if validator.is_valid(&as_json(&value)) {
                continue;
            }
            by_schema += 1;
            let text = serde_yaml::to_string(&value).unwrap();
            let loaded = load(file, &text, "x.yaml");
            assert!(refused(&loaded), "{}.{}: only the schema refuses\n{text}", object.name, key.name);
        }
    }
    assert!(cases > 2_000 && by_schema > cases / 4, "{by_schema} of {cases}");
}

/// A small generator: the same numbers every time.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(self.0 >> 33).unwrap() % n
    }
}

/// Another value somewhere, another name of a key, or one key less.
fn mutate(value: &mut Value, random: &mut Random) {
    let inner = match value {
        Value::Mapping(table) if !table.is_empty() => {
            let keys: Vec<Value> = table.keys().cloned().collect();
            let key = keys[random.below(keys.len())].clone();
            match random.below(6) {
                0 => {
                    table.remove(&key);
                    return;
                }
                1 => {
                    let entry = table.remove(&key).unwrap();
                    table.insert(Value::from("misspelt"), entry);
                    return;
                }
                _ => table.get_mut(&key),
            }
        }
        Value::Sequence(list) if !list.is_empty() => {
            let at = random.below(list.len());
            list.get_mut(at)
        }
        _ => None,
    };
    match inner {
        Some(inner) if random.below(4) > 0 => mutate(inner, random),
        _ => {
            let others = ["true", "[]", "7", "-1", "0.5", "x y", "\"\"", "[a]", "[1]", "{ k: 1 }", "1e9", "9z"];
            *value = yaml(others[random.below(others.len())]);
        }
    }
}

#[test]
fn the_annotations_are_lua_and_name_every_constructor() {
    let text = schema::annotations();
    let lua = mlua::Lua::new();
    lua.load(&text).exec().unwrap_or_else(|why| panic!("{why}\n{text}"));
    let words = CHANGES.iter().map(|change| change.object.name);
    for name in
        words.chain(["Configuration", "ConfiguratorConf", "state", "trans", "conn", "Monitors", "monitor", "above"])
    {
        assert!(lua.globals().get::<mlua::Function>(name).is_ok(), "{name}");
    }
    for (file, object, key, ..) in rows() {
        let only_yaml = key.language != Languages::All || matches!(key.form, Form::Changes);
        let is_field = file.in_lua && !std::ptr::eq(object, file.object) && !only_yaml;
        let of_call =
            CHANGES.iter().any(|change| std::ptr::eq(change.object, object)) && matches!(key.name, "args" | "undo");
        if is_field && !of_call {
            let named = [format!("@field {}", key.name), format!("@param {}", key.name)];
            assert!(named.iter().any(|name| text.contains(name)), "{}.{}", object.name, key.name);
            assert!(text.contains(&key.told()), "{}.{}: not all of it is told", object.name, key.name);
        }
    }
}

/// `DAVIT_WRITE_REFERENCE=1 cargo test --test lang reference` writes the pages anew.
#[test]
fn the_pages_are_those_of_the_table() {
    let write = std::env::var_os("DAVIT_WRITE_REFERENCE").is_some();
    for file in FILES {
        let path = format!("docs/reference/{}.md", file.name);
        let made = schema::markdown(file);
        if write {
            std::fs::create_dir_all("docs/reference").unwrap();
            std::fs::write(&path, &made).unwrap();
        }
        let written = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(written == made, "{path} is not what the table says: write it anew (see this test)");
    }
}

#[test]
fn every_name_is_explained() {
    let names = schema::names();
    assert!(names.len() > 100, "{}", names.len());
    for name in names {
        let entries = schema::about(name);
        assert!(!entries.is_empty(), "{name}");
        for entry in entries {
            assert!(entry.example.yaml.is_some() || entry.example.lua.is_some(), "{name}");
            let path = entry.of.map(|of| format!("{of}.{name}"));
            assert!(path.is_none_or(|path| schema::about(&path).len() == 1), "{name}");
        }
    }
    assert!(schema::about("durability").is_empty() && schema::about("configuration.src").is_empty());
}
