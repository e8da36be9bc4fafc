//! The reference: what one key, one table or one word is, and the pages of all of them.

use crate::lang::grammar::{FILES, File, Form, Key, Languages, OWN_WORDS, Object, OwnWord, Words};
use crate::lang::spelling::as_yaml;
use crate::lang::words::{CONDITIONS, SIGNALS, Word};
use serde::Serialize;
use std::fmt::Write as _;

/// What `davit explain` tells of something that can be written.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ReferenceEntry {
    /// Its name: `timeout`.
    pub name: &'static str,
    /// What it stands in: `configuration`; of a table or a word nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of: Option<&'static str>,
    /// What stands behind it.
    pub form: String,
    /// The unit of its number.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub unit: &'static str,
    /// Whether it must be there.
    pub required: bool,
    /// The key that may stand in its place, where one of the two must be there.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub instead: &'static str,
    /// What holds without it.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub default: &'static str,
    /// What it means.
    pub doc: &'static str,
    /// How it is written.
    pub example: Example,
    /// A line that is refused, and the code of the finding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<(&'static str, &'static str)>,
}

impl ReferenceEntry {
    /// Behind its name, whether it must be there.
    pub fn demanded(&self) -> String {
        match (self.required, self.instead) {
            (true, _) => " (required)".to_owned(),
            (false, "") => String::new(),
            (false, other) => format!(" (required, or `{other}`)"),
        }
    }
}

/// A line as it is written.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Example {
    /// In YAML; none: it cannot be written there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yaml: Option<String>,
    /// In Lua; none: it is not written by a name there, or not at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lua: Option<&'static str>,
}

impl Example {
    /// Of an example as the table has it: Lua's, or YAML's where only that can have it.
    fn of(example: &'static str, only: Languages) -> Self {
        match as_yaml(example) {
            _ if only == Languages::Lua => Self { yaml: None, lua: Some(example) },
            Some(yaml) => Self { yaml: Some(yaml), lua: Some(example) },
            None => Self { yaml: Some(example.to_owned()), lua: None },
        }
    }
}

fn of_key(object: &Object, key: &Key) -> ReferenceEntry {
    let refused = (!key.refused.is_empty()).then_some((key.refused, key.code.0));
    ReferenceEntry {
        name: key.name,
        of: Some(object.name),
        form: key.form.words(Words::Plain),
        unit: key.unit_of(),
        required: key.required,
        instead: key.instead,
        default: key.default,
        doc: key.doc,
        example: Example::of(key.example, key.language),
        refused,
    }
}

fn of_object(object: &Object) -> ReferenceEntry {
    let keys: Vec<_> = object.names().map(|name| format!("`{name}`")).collect();
    ReferenceEntry {
        name: object.name,
        form: format!("a table with {}", keys.join(", ")),
        doc: object.doc,
        example: Example {
            yaml: Some(object.yaml()),
            lua: as_yaml(object.example).is_some().then_some(object.example),
        },
        ..ReferenceEntry::default()
    }
}

fn of_word(word: &Word, what: &str) -> ReferenceEntry {
    ReferenceEntry {
        name: word.name,
        form: format!("{what} of the monitors' language"),
        doc: word.doc,
        example: Example::of(word.usage, Languages::All),
        ..ReferenceEntry::default()
    }
}

fn of_own_word(term: &OwnWord) -> ReferenceEntry {
    ReferenceEntry {
        name: term.name,
        form: term.form.to_owned(),
        doc: term.doc,
        example: Example::of(term.example, term.language),
        ..ReferenceEntry::default()
    }
}

/// The tables that a path leads to, as findings name places: from a table, or a key, over keys. What stands under names of its
/// own (`types.Gain.ports`) may be written with such a name, or without.
fn tables(path: &str) -> Vec<&'static Object> {
    let all: Vec<&'static Object> = FILES.iter().flat_map(File::objects).collect();
    let mut here: Vec<&'static Object> = Vec::new();
    for (at, part) in path.split('.').enumerate() {
        let part = part.split('[').next().unwrap_or(part);
        let from = if at == 0 { &all } else { &here };
        let mut next: Vec<&'static Object> = Vec::new();
        if at == 0 {
            next.extend(all.iter().filter(|object| object.name == part));
        }
        let keys = from.iter().flat_map(|object| object.keys).filter(|key| key.name == part);
        keys.for_each(|key| key.form.tables(&mut |inner| next.push(inner)));
        // A name of its own leads no further.
        if at == 0 || !next.is_empty() {
            here = next;
        }
    }
    here
}

/// Everything that can be written, with where it stands: `timeout`, `configuration.timeout`, `type.ports.unit`, `configuration`,
/// `above`, `e_after`.
pub fn about(name: &str) -> Vec<ReferenceEntry> {
    // A time event as it is written.
    let name = name.split('(').next().unwrap_or(name);
    let (of, key) = name.rsplit_once('.').map_or((None, name), |(of, key)| (Some(of), key));
    let around: Vec<&str> = of.map(tables).unwrap_or_default().iter().map(|object| object.name).collect();
    let mut found = Vec::new();
    let mut seen: Vec<&str> = Vec::new();
    for object in FILES.iter().flat_map(File::objects) {
        if seen.contains(&object.name) {
            continue;
        }
        seen.push(object.name);
        let here = of.is_none() || around.contains(&object.name);
        if of.is_none() && object.name == name {
            found.push(of_object(object));
        }
        let rows = object.keys.iter().filter(|row| row.name == key && row.language != Languages::None);
        found.extend(rows.filter(|_| here).map(|row| of_key(object, row)));
    }
    if of.is_none() {
        let words = CONDITIONS.iter().map(|word| (word, "a condition")).chain(SIGNALS.iter().map(|w| (w, "a signal")));
        found.extend(words.filter(|(word, _)| word.name == name).map(|(word, what)| of_word(word, what)));
        found.extend(OWN_WORDS.iter().filter(|term| term.name == name).map(of_own_word));
    }
    found
}

/// The keys of the tables that a path leads to: of `type.ports` those of a port.
pub fn keys_of(path: &str) -> Vec<&'static str> {
    tables(path).into_iter().flat_map(Object::names).collect()
}

/// Every name that [`about`] knows, each once.
pub fn names() -> Vec<&'static str> {
    let objects = FILES.iter().flat_map(File::objects);
    let mut all: Vec<&str> = objects.flat_map(|object| object.names().chain([object.name])).collect();
    all.extend(CONDITIONS.iter().chain(SIGNALS).map(|word| word.name));
    all.extend(OWN_WORDS.iter().map(|term| term.name));
    all.sort_unstable();
    all.dedup();
    all
}

/// The page of a kind of file, as Markdown.
pub fn markdown(file: &File) -> String {
    let mut out = format!("# Reference: {}\n\n", file.name);
    out.push_str("Made from the table that files are read by; `davit explain KEY` shows the same in a terminal.\n");
    for object in file.objects() {
        table(&mut out, object);
    }
    let terms: Vec<&OwnWord> = OWN_WORDS.iter().filter(|term| term.file == file.name).collect();
    if !terms.is_empty() {
        out.push_str("\n## Words that are no keys\n\n| word | stands as | meaning |\n|---|---|---|\n");
        for term in terms {
            _ = writeln!(out, "| `{}` | {} | {} |", term.name, term.form, term.doc);
        }
    }
    if file.name == "monitors" {
        words(&mut out, "conditions", "A condition is true or false at every instant.", CONDITIONS);
        words(&mut out, "signals", "A signal is a number, a port (`\"A.x\"`, `\"A.x[0]\"`), or one of these.", SIGNALS);
        out.push_str("\nWhat they mean, to the instant, is said in [Monitors](../monitors.md).\n");
    }
    out
}

fn table(out: &mut String, object: &Object) {
    _ = write!(out, "\n## Table `{}`\n\n{}\n", object.name, object.doc);
    if object.may_be_empty {
        out.push_str("\nNothing behind its name stands for one without keys.\n");
    }
    for key in object.keys.iter().filter(|key| key.language != Languages::None) {
        let entry = of_key(object, key);
        let mark = entry.demanded();
        let form = key.form.words(Words::Linked);
        _ = write!(out, "\n### `{}`{mark}\n\n{}{}.", key.name, form[..1].to_uppercase(), &form[1..]);
        // The unit of a time is in its form.
        if !entry.unit.is_empty() && !matches!(key.form, Form::Seconds | Form::Milliseconds) {
            _ = write!(out, " Unit: {}.", entry.unit);
        }
        _ = write!(out, " {}", key.doc);
        if !key.default.is_empty() {
            _ = write!(out, " Without it: {}.", key.default);
        }
        out.push_str("\n\n");
        if let Some(yaml) = &entry.example.yaml {
            _ = writeln!(out, "- YAML: `{yaml}`");
        }
        if let Some(lua) = entry.example.lua {
            _ = writeln!(out, "- Lua: `{lua}`");
        }
        if let Some((line, code)) = entry.refused {
            _ = writeln!(out, "- refused: `{line}` (`{code}`)");
        }
    }
}

fn words(out: &mut String, title: &str, what: &str, words: &[Word]) {
    _ = write!(out, "\n## {title}\n\n{what}\n\n| Lua | YAML | meaning |\n|---|---|---|\n");
    for word in words {
        let yaml = as_yaml(word.usage).unwrap_or_default();
        _ = writeln!(out, "| `{}` | `{yaml}` | {} |", word.usage, word.doc);
    }
}
