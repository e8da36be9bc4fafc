//! The loose tree both languages are read into: shapes and places, no meaning yet.

use super::grammar::{Key, Languages, Object};
use super::spelling::{as_yaml, told_in_yaml};
use super::spelling_xml::told_in_scxml;
use crate::diagnostics::{FileId, Language, SourceMap};
use crate::limits;
use crate::model::finding::{did_you_mean, nearest};
use crate::model::{Finding, Findings, Origin, codes};
use rustc_hash::FxHashSet;
use std::borrow::Cow;

/// A piece of text with the place where it was written.
#[derive(Debug, Clone)]
pub struct Node {
    /// What it is.
    pub kind: Kind,
    /// Where it stands. In Lua that of the constructor around it: only lines of calls are known there.
    pub origin: Origin,
}

/// The shape of a node.
#[derive(Debug, Clone)]
pub enum Kind {
    /// Nothing: `nil`, an empty YAML value.
    Null,
    /// `true`, `false`
    Bool(bool),
    /// A number without a point.
    Int(i64),
    /// A number with one. May be NaN or infinite.
    Float(f64),
    /// A text.
    Str(Box<str>),
    /// Elements in order. Lua's `{}` is an empty one.
    List(Vec<Node>),
    /// Named elements.
    Map(Vec<Entry>),
    /// Lua's table with both: elements, then named ones.
    Mixed(Vec<Node>, Vec<Entry>),
    /// What a constructor made: its name, its named fields, its elements.
    Made(&'static str, Vec<Entry>, Vec<Node>),
    /// What a constructor made, before it is put in its place.
    Handle(u32),
    /// A Lua function.
    Function,
    /// What a finding has been made about already.
    Poison,
}

/// A named element.
#[derive(Debug, Clone)]
pub struct Entry {
    /// The name.
    pub key: Cow<'static, str>,
    /// Where the name stands.
    pub origin: Origin,
    /// The element.
    pub value: Node,
}

impl Node {
    /// A node.
    pub fn new(kind: Kind, origin: Origin) -> Self {
        Self { kind, origin }
    }

    /// What it is, for messages: `a string ("abc")`.
    pub fn describe(&self) -> String {
        match &self.kind {
            Kind::Null => "nothing".to_owned(),
            Kind::Bool(v) => format!("a bool ({v})"),
            Kind::Int(v) => format!("an int ({v})"),
            Kind::Float(v) => format!("a float ({v:?})"),
            Kind::Str(v) => format!("a string ({:?})", v.chars().take(32).collect::<String>()),
            Kind::List(v) => format!("a list of {}", v.len()),
            Kind::Map(_) | Kind::Mixed(..) => "a table of named values".to_owned(),
            Kind::Made(verb, ..) => format!("a `{verb}`"),
            Kind::Handle(_) => "something made by a constructor".to_owned(),
            Kind::Function => "a function".to_owned(),
            Kind::Poison => "something that could not be read".to_owned(),
        }
    }
}

/// What reading and lowering work with: the source map and the findings so far.
#[derive(Debug)]
pub struct Cx {
    /// The texts and the places in them.
    pub sources: SourceMap,
    /// What was found.
    pub findings: Findings,
    /// Whether some text could not be read or parsed at all.
    pub unreadable: bool,
}

impl Default for Cx {
    fn default() -> Self {
        let mut sources = SourceMap::new();
        sources.spell_with(|language, text| match language {
            Language::Lua => text.to_owned(),
            Language::Yaml => told_in_yaml(text),
            Language::Scxml => told_in_scxml(text),
        });
        Self { sources, findings: Findings::new(), unreadable: false }
    }
}

impl Cx {
    /// Of findings with the same words about the same place one is kept: a file that is several subsystems is read for each.
    pub fn told_once(&mut self) {
        let mut told = FxHashSet::default();
        let sources = &self.sources;
        self.findings.retain(|finding| {
            let Some(at) = sources.locate(finding.origin) else { return true };
            told.insert((finding.code, finding.message.clone(), sources.file(at.file).name.clone(), at.line, at.column))
        });
    }

    /// Adds a finding, unless there are too many.
    pub fn report(&mut self, finding: Finding) {
        if self.findings.len() < limits::FINDINGS {
            self.findings.push(finding);
        }
    }

    /// Adds a finding that says that a text could not be read.
    pub fn refuse(&mut self, finding: Finding) {
        self.unreadable = true;
        self.report(finding);
    }

    /// The place of a word of an element.
    pub fn part(&mut self, origin: Origin, word: &str) -> Origin {
        self.sources.within(origin, word)
    }

    /// The place of an element of a list: its own where the language knows it, else its text inside the list.
    pub fn inside(&mut self, list: Origin, own: Origin, word: &str) -> Origin {
        if self.sources.is_exact(own) { own } else { self.sources.within(list, word) }
    }

    /// The place of a node: its own text inside the constructor around it.
    pub fn place(&mut self, node: &Node) -> Origin {
        match &node.kind {
            Kind::Str(text) => self.sources.within(node.origin, text),
            Kind::Int(v) => self.sources.within(node.origin, &v.to_string()),
            _ => node.origin,
        }
    }

    /// An example as the file spells it in which something stands: one of Lua also in YAML.
    pub fn spelt(&self, origin: Origin, example: &str) -> String {
        self.either(origin, example, &as_yaml(example).unwrap_or_else(|| example.to_owned()))
    }

    /// Which of two spellings is the file's in which something stands.
    pub fn either(&self, origin: Origin, lua: &str, yaml: &str) -> String {
        if self.language(origin) == Some(Language::Yaml) { yaml.to_owned() } else { lua.to_owned() }
    }

    /// Whether it stands in a file of Lua, where `{}` is a list without elements and a table without keys.
    pub fn is_lua(&self, origin: Origin) -> bool {
        // Of a place that is only known by its line no text is kept.
        self.language(origin) != Some(Language::Yaml)
    }

    fn language(&self, origin: Origin) -> Option<Language> {
        self.sources.file_of(origin).map(|file| self.sources.file(file).language)
    }

    /// Reports that a node is not of the kind wanted; `example` is a line as it should be.
    pub fn wrong(&mut self, node: &Node, what: &str, expected: &str, example: &str) {
        let quoted = matches!(node.kind, Kind::Bool(_) | Kind::Int(_) | Kind::Float(_));
        let hint = if quoted && expected.contains("text") { " (quotes make a text of it)" } else { "" };
        let example = self.spelt(node.origin, example);
        self.wrong_so(node, what, expected, &format!("write it like `{example}`{hint}"));
    }

    /// The same where no line of that kind would do: what to do instead.
    pub fn wrong_so(&mut self, node: &Node, what: &str, expected: &str, help: &str) {
        if matches!(node.kind, Kind::Poison) {
            return;
        }
        let message = format!("{what} must be {expected}, this is {}", node.describe());
        let finding = Finding::error(codes::TEXT_WRONG_TYPE, message).at(self.place(node));
        self.report(finding.labelled(format!("expected {expected}")).help(help));
    }
}

/// The fields of a table while it is lowered: each is taken once, what remains is unknown. What they are, their forms, bounds
/// and examples are those of the table's rows ([`grammar`](super::grammar)).
pub struct Fields {
    object: &'static Object,
    /// Its place.
    pub origin: Origin,
    entries: Vec<Option<Entry>>,
    asked: Vec<&'static str>,
}

impl Fields {
    /// The fields of a table.
    pub fn new(object: &'static Object, origin: Origin, entries: Vec<Entry>) -> Self {
        Self { object, origin, entries: entries.into_iter().map(Some).collect(), asked: Vec::new() }
    }

    /// The fields of a node, or a finding that it has none.
    pub fn of(cx: &mut Cx, node: Node, object: &'static Object) -> Option<Self> {
        match node.kind {
            Kind::Map(entries) | Kind::Made(_, entries, _) => Some(Self::new(object, node.origin, entries)),
            Kind::List(ref list) if list.is_empty() && cx.is_lua(node.origin) => {
                Some(Self::new(object, node.origin, Vec::new()))
            }
            Kind::Null if object.may_be_empty => Some(Self::new(object, node.origin, Vec::new())),
            _ => {
                let example = cx.either(node.origin, object.example, &object.yaml());
                cx.wrong(&node, object.what, "a table of named values", &example);
                None
            }
        }
    }

    /// What the table is.
    pub fn object(&self) -> &'static Object {
        self.object
    }

    /// The row of a key.
    pub fn row(&self, key: &str) -> &'static Key {
        self.object.key(key).unwrap_or_else(|| panic!("the table of {} has no row `{key}`", self.object.what))
    }

    /// Takes a field with its name's place.
    pub fn take_entry(&mut self, key: &'static str) -> Option<Entry> {
        debug_assert!(self.object.key(key).is_some(), "the table of {} has no row `{key}`", self.object.what);
        self.asked.push(key);
        self.entries.iter_mut().find(|e| e.as_ref().is_some_and(|e| e.key == key)).and_then(Option::take)
    }

    /// Where the name of a field stands that was not taken.
    pub fn place(&self, key: &str) -> Option<Origin> {
        self.entries.iter().flatten().find(|entry| entry.key == key).map(|entry| entry.origin)
    }

    /// Where what stands behind a field's name stands, where it was not taken.
    pub fn value_place(&self, key: &str) -> Option<Origin> {
        self.entries.iter().flatten().find(|entry| entry.key == key).map(|entry| entry.value.origin)
    }

    /// Whether a field is there, and not taken.
    pub fn has(&self, key: &str) -> bool {
        self.entries.iter().flatten().any(|entry| entry.key == key)
    }

    /// Takes a field. One that must be there and is not gives a finding.
    pub fn take(&mut self, cx: &mut Cx, key: &'static str) -> Option<Node> {
        let row = self.row(key);
        if row.required {
            return self.needed(cx, key, |cx, origin| format!("add `{}`", cx.spelt(origin, row.example)));
        }
        self.take_entry(key).map(|entry| entry.value)
    }

    /// Takes a field that must be there, with the help that tells how it is written.
    pub fn needed(&mut self, cx: &mut Cx, key: &'static str, help: impl Fn(&Cx, Origin) -> String) -> Option<Node> {
        let field = self.take_entry(key).map(|entry| entry.value);
        if field.is_none() {
            // A misspelt key would give two findings for one mistake: the unknown key alone tells it.
            if !self.misspelt(key) {
                let help = self.is_another_file().unwrap_or_else(|| help(cx, self.origin));
                cx.report(
                    Finding::error(codes::TEXT_MISSING_KEY, format!("{} needs `{key}`", self.object.what))
                        .at(self.origin)
                        .labelled(format!("without `{key}`"))
                        .help(help),
                );
            }
        }
        field
    }

    /// What to do where a whole file is one of another kind than it is listed as.
    fn is_another_file(&self) -> Option<String> {
        let of_this = |file: &&super::grammar::File| std::ptr::eq(file.object, self.object);
        let this = super::grammar::FILES.iter().find(of_this)?.name;
        let has = |name: &str| self.entries.iter().flatten().any(|entry| entry.key == name);
        let other =
            super::grammar::FILES.iter().find(|file| self.object.key(file.name).is_none() && has(file.name))?.name;
        Some(format!(
            "what stands here is `{other}`: name this file under `{other}` in the deployment, and not under `{this}`"
        ))
    }

    /// Whether what is left has a key that is probably meant to be this one.
    pub fn misspelt(&self, key: &str) -> bool {
        self.entries
            .iter()
            .flatten()
            .any(|e| self.object.key(&e.key).is_none() && strsim::jaro_winkler(&e.key.to_lowercase(), key) > 0.8)
    }

    /// Reports what was not taken.
    pub fn finish(self, cx: &mut Cx) {
        let Self { object, entries, asked, .. } = self;
        let untaken = |key: &&Key| key.language == Languages::All && !asked.contains(&key.name);
        debug_assert!(
            object.keys.iter().find(untaken).is_none(),
            "{}: nobody reads `{:?}`",
            object.what,
            object.keys.iter().find(untaken)
        );
        for entry in entries.into_iter().flatten().filter(|e| !matches!(e.value.kind, Kind::Poison)) {
            if asked.contains(&&*entry.key) {
                cx.report(
                    Finding::error(
                        codes::TEXT_DUPLICATE_KEY,
                        format!("`{}` stands twice in {}", entry.key, object.what),
                    )
                    .at(entry.origin)
                    .help("keep one of them"),
                );
                continue;
            }
            let origin = cx.part(entry.origin, &entry.key);
            let table =
                matches!(&entry.value.kind, Kind::Map(_)) || matches!(&entry.value.kind, Kind::List(l) if l.is_empty());
            let inside = table && object.what == "a state";
            // `{ value: 1,0 }` and `{ events: a, b }`: a `,` ends the value before it.
            let cut_off = matches!(entry.value.kind, Kind::Null) && !cx.is_lua(entry.origin);
            let names = || object.names_in(cx.is_lua(entry.origin));
            let help = match nearest(&entry.key, names()) {
                None if cut_off && entry.key.bytes().all(|b| b.is_ascii_digit()) => {
                    "is it of the number before it? Write that with a point, like `0.5`".to_owned()
                }
                None if cut_off => format!("is it one of several? They stand in brackets: `[…, {}]`", entry.key),
                // In Lua a state is made by its function.
                None if inside && cx.is_lua(entry.origin) => {
                    format!("a state inside is made by `state`: `{} = state {{ … }}`", entry.key)
                }
                _ => did_you_mean(&entry.key, "keys", names()),
            };
            cx.report(
                Finding::error(codes::TEXT_UNKNOWN_KEY, format!("{} has no `{}`", object.what, entry.key))
                    .at(origin)
                    .labelled("unknown key")
                    .help(help),
            );
        }
    }
}

/// What to do about a key that stands twice.
pub const KEEP_ONE: &str = "keep one of them, or give one another name";

/// A key stands twice in one table of a text.
pub fn stands_twice(key: &str, first: Origin, again: Origin) -> Finding {
    Finding::error(codes::TEXT_DUPLICATE_KEY, format!("`{key}` stands twice in one table"))
        .at(again)
        .labelled("again here")
        .also(first, "first here")
        .help(KEEP_ONE)
}

/// A file that is being read: its id and the place of the whole.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reading {
    /// The file.
    pub file: FileId,
    /// The place of the whole file.
    pub whole: Origin,
}
