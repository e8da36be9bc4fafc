//! The one table of what can be written: every key of every table of both languages, with its form, its bounds, its unit, what
//! holds without it, an example that is read and one that is refused.
//!
//! Reading takes its forms, bounds and examples from here ([`Fields`](super::tree::Fields)), and so do the schema, the
//! annotations for Lua, the reference and `davit explain KEY`: one more key is one more row, and the line that says where its
//! value goes. A key that is read and has no row, or the reverse, is found in the first file that has such a table.

mod chart;
mod composition;
mod configuration;
mod deployment;
mod monitor;
mod own_words;
mod types;

pub use chart::{CONNECTOR, COORDINATOR_FILE, STATE, TRANSITION};
pub use composition::{EXPORTS, LEAVING, PARAMETER, SUBSYSTEM};
pub use configuration::{BUFFER, CHANGES, CONFIGURATION, CONFIGURATIONS_FILE, CONFIRM, Primitive, UNDO, primitive};
pub use deployment::{ACTIVITY, DEPLOY, DEPLOYMENT, FAULT, LIMITS, REACTION, SHUTDOWN, SIMULATED, TRUSTED};
pub use monitor::{COMPARISON, MONITOR, MONITORS_FILE};
pub use own_words::{OWN_WORDS, OwnWord};
pub use types::{EFFECT, OPERATION, PORT, PROPERTY, TYPE};

use crate::model::Code;

/// Where a table is told of in words: with links, or as plain text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Words {
    /// Markdown: tables and conditions are links.
    Linked,
    /// A terminal.
    Plain,
}

/// A table of named values.
#[derive(Debug)]
pub struct Object {
    /// Its name in references: `configuration`.
    pub name: &'static str,
    /// What it is, for messages: `a configuration`.
    pub what: &'static str,
    /// What it is for.
    pub doc: &'static str,
    /// How it is written, as Lua has it where it can be written in Lua.
    pub example: &'static str,
    /// How YAML has it where that is no other spelling of the same; empty: it is.
    pub in_yaml: &'static str,
    /// Whether nothing behind its name (`idle:`) is one without keys.
    pub may_be_empty: bool,
    /// Its keys, in the order of the reference.
    pub keys: &'static [Key],
}

/// A key of a table.
#[derive(Debug)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// What stands behind it.
    pub form: Form,
    /// Whether it must be there.
    pub required: bool,
    /// What holds without it; empty where there is nothing to say.
    pub default: &'static str,
    /// The unit of its number; empty: none.
    pub unit: &'static str,
    /// What it means.
    pub doc: &'static str,
    /// A line with it, as Lua has it where it can be written in Lua.
    pub example: &'static str,
    /// A line with it that is refused: of YAML, or of Lua where only that can have it.
    pub refused: &'static str,
    /// With this code.
    pub code: Code,
    /// The key that may stand in its place; without that one it must be there.
    pub instead: &'static str,
    /// What else must stand in the table for either, in YAML.
    pub beside: &'static str,
    /// In which languages it can be written.
    pub language: Languages,
}

/// In which languages a key can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Languages {
    /// In both, or in the one that its table is written in.
    All,
    /// Only in YAML: Lua has constructors in its place.
    Yaml,
    /// Only in Lua: a function.
    Lua,
    /// In none any more: refused, with words of its own.
    None,
}

/// What stands behind a key.
#[derive(Debug, Clone, Copy)]
pub enum Form {
    /// The version of the format.
    Version,
    /// `true` or `false`.
    Truth,
    /// Any text.
    Text,
    /// The path of a file, from the folder of the file it stands in.
    Path,
    /// The name of something.
    Name(NameKind),
    /// A state: `STATE`, or `COORDINATOR:STATE`.
    State,
    /// What triggers a transition.
    Trigger,
    /// A whole number.
    Whole {
        /// The least.
        least: i64,
        /// The most.
        most: i64,
    },
    /// A finite number.
    Number,
    /// A time in seconds, more than 0, at most a day.
    Seconds,
    /// A time in milliseconds, likewise.
    Milliseconds,
    /// One of a few words.
    Choice(&'static [&'static str]),
    /// A value of a property, a port or an argument.
    Value,
    /// The type of a value.
    ValueType,
    /// A condition of the monitors' language.
    Condition,
    /// A list of `component:state`.
    States,
    /// The text of a step, as plans print it.
    Step,
    /// A function, of a coordinator that is trusted.
    Function,
    /// The changes of a configuration.
    Changes,
    /// A list of these.
    List(&'static Form),
    /// One of these, or a list of them.
    Several(&'static Form),
    /// One of these, or a list of them in which each stands once.
    Set(&'static Form),
    /// These, each under a name of its own.
    Named(NameKind, &'static Form),
    /// A table.
    Table(&'static Object),
    /// Any one of these.
    Either(&'static [Form]),
}

/// What a name can be of; the grammars are those of [`names`](crate::model::names).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NameKind {
    /// A plain name.
    Plain,
    /// A deployment: a plain name that is short enough for a file at which it is reached.
    Deployment,
    /// A platform.
    Platform,
    /// A library of component types.
    Library,
    /// A component.
    Component,
    /// A component type.
    Type,
    /// A configuration.
    Configuration,
    /// An event.
    Event,
    /// A port, property or operation of a component.
    Member,
}

impl NameKind {
    /// What is named, with its article.
    pub fn what(self) -> &'static str {
        match self {
            Self::Plain => "a name (letters, digits and `_`, no digit first)",
            Self::Deployment => "a name (letters, digits and `_`, no digit first; at most 64 letters)",
            Self::Platform => "the name of a platform",
            Self::Library => "the name of a library",
            Self::Component => "the name of a component",
            Self::Type => "the name of a component type",
            Self::Configuration => "the name of a configuration",
            Self::Event => "the name of an event (a text without blanks)",
            Self::Member => "a member of a component, `Component.member`",
        }
    }

    /// Its grammar as a regular expression.
    pub fn pattern(self) -> &'static str {
        match self {
            Self::Plain | Self::Platform | Self::Library => "^[A-Za-z_][A-Za-z0-9_]*$",
            Self::Deployment => "^[A-Za-z_][A-Za-z0-9_]{0,63}$",
            Self::Component | Self::Configuration => "^[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*$",
            Self::Type => "^([A-Za-z_][A-Za-z0-9_]*/)*[A-Za-z_][A-Za-z0-9_]*(\\.[A-Za-z_][A-Za-z0-9_]*)*$",
            Self::Event => "^\\S+$",
            Self::Member => "^[A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*\\.[A-Za-z_][A-Za-z0-9_]*$",
        }
    }
}

/// A row: name, form, meaning, a line with it, a line that is refused and with which code.
const fn key(
    name: &'static str,
    form: Form,
    doc: &'static str,
    example: &'static str,
    refused: (&'static str, Code),
) -> Key {
    Key {
        name,
        form,
        required: false,
        default: "",
        unit: "",
        doc,
        example,
        refused: refused.0,
        code: refused.1,
        instead: "",
        beside: "",
        language: Languages::All,
    }
}

impl Key {
    const fn required(mut self) -> Self {
        self.required = true;
        self
    }

    const fn without(mut self, default: &'static str) -> Self {
        self.default = default;
        self
    }

    const fn unit(mut self, unit: &'static str) -> Self {
        self.unit = unit;
        self
    }

    const fn instead(mut self, other: &'static str) -> Self {
        self.instead = other;
        self
    }

    const fn beside(mut self, other: &'static str) -> Self {
        self.beside = other;
        self
    }

    const fn only(mut self, language: Languages) -> Self {
        self.language = language;
        self
    }

    /// Its line in YAML.
    #[cfg(any(test, feature = "internals"))]
    pub fn yaml(&self) -> String {
        super::spelling::as_yaml(self.example).unwrap_or_else(|| self.example.to_owned())
    }

    /// The unit its number is in, that of its form where none is written.
    pub fn unit_of(&self) -> &'static str {
        match self.form {
            Form::Seconds => "s",
            Form::Milliseconds => "ms",
            _ => self.unit,
        }
    }

    /// What an editor tells of it: its meaning, its unit, and what is so without it.
    pub fn told(&self) -> String {
        let (unit, default) = (self.unit_of(), self.default);
        let unit = if unit.is_empty() { String::new() } else { format!(" Unit: {unit}.") };
        let default = if default.is_empty() { String::new() } else { format!(" Without it: {default}.") };
        format!("{}{unit}{default}", self.doc)
    }
}

impl Object {
    /// A table without anything, for what most tables leave out.
    const BARE: Self = Self { name: "", what: "", doc: "", example: "", in_yaml: "", may_be_empty: false, keys: &[] };

    /// The row of a key.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }

    /// The keys that can be written in one of the languages.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        self.keys.iter().filter(|key| key.language != Languages::None).map(|key| key.name)
    }

    /// Those that can be written in Lua, or in YAML, for *did you mean*. In Lua changes stand by themselves, and a constructor has arguments.
    pub fn names_in(&self, lua: bool) -> impl Iterator<Item = &'static str> {
        let arguments = primitive(self.name).filter(|_| lua).map_or(&[][..], |made| made.arguments);
        let is_there = move |key: &&Key| match key.language {
            Languages::All => !(arguments.contains(&key.name) || lua && matches!(key.form, Form::Changes)),
            Languages::Lua => lua,
            Languages::Yaml => !lua,
            Languages::None => false,
        };
        self.keys.iter().filter(is_there).map(|key| key.name)
    }

    /// How it is written in YAML.
    pub fn yaml(&self) -> String {
        match self.in_yaml {
            "" => super::spelling::as_yaml(self.example).unwrap_or_else(|| self.example.to_owned()),
            yaml => yaml.to_owned(),
        }
    }

    /// The keys that YAML can have.
    pub fn yaml_keys(&self) -> impl Iterator<Item = &'static Key> {
        self.keys.iter().filter(|key| matches!(key.language, Languages::All | Languages::Yaml))
    }
}

impl Form {
    /// In words: `a time in seconds, more than 0, at most a day`.
    pub fn words(&self, links: Words) -> String {
        match self {
            Self::Version => "`1`".to_owned(),
            Self::Truth => "`true` or `false`".to_owned(),
            Self::Text => "a text".to_owned(),
            Self::Path => "the path of a file".to_owned(),
            Self::Name(of) => of.what().to_owned(),
            Self::State => "a state, `STATE` or `COORDINATOR:STATE`".to_owned(),
            Self::Trigger => "the name of an event, `e_after(SECONDS)` or `e_at(SECONDS)`".to_owned(),
            Self::Whole { least, most } => format!("a whole number from {least} to {most}"),
            Self::Number => "a finite number".to_owned(),
            Self::Seconds => "a time in seconds, more than 0, at most a day".to_owned(),
            Self::Milliseconds => "a time in milliseconds, more than 0, at most a day".to_owned(),
            Self::Choice(words) => {
                let words: Vec<_> = words.iter().map(|word| format!("`{word}`")).collect();
                match &words[..] {
                    [one] => one.clone(),
                    [first @ .., last] => format!("{} or {last}", first.join(", ")),
                    [] => String::new(),
                }
            }
            Self::Value => "a value: bool, number, text, list or record".to_owned(),
            Self::ValueType => {
                "a type: `bool`, `int`, `float`, `string`, `event`, `\"float[3]\"`, `\"float[]\"` or `{x: float, y: float}`"
                    .to_owned()
            }
            Self::Condition if links == Words::Linked => "a [condition](monitors.md#conditions)".to_owned(),
            Self::Condition => "a condition".to_owned(),
            Self::States => "a list of `component:state`".to_owned(),
            Self::Step => "the text of a step, or its beginning".to_owned(),
            Self::Function => "a function of Lua".to_owned(),
            Self::Changes => {
                let one = |change: &Primitive| match links {
                    Words::Linked => format!("[{0}](#table-{0})", change.object.name),
                    Words::Plain => change.object.name.to_owned(),
                };
                format!("a list of changes, each one of {}", CHANGES.iter().map(one).collect::<Vec<_>>().join(", "))
            }
            Self::List(form) => format!("a list; each: {}", form.words(links)),
            Self::Several(form) => format!("{}; or a list of such", form.words(links)),
            Self::Set(form) => format!("{}; or a list of such, each once", form.words(links)),
            Self::Named(_, form) => format!("by name; each: {}", form.words(links)),
            Self::Table(object) if links == Words::Linked => format!("a table: [{0}](#table-{0})", object.name),
            Self::Table(object) => format!("a table: {}", object.name),
            Self::Either(forms) => forms.iter().map(|form| form.words(links)).collect::<Vec<_>>().join("; or "),
        }
    }

    /// The tables in it.
    pub fn tables(&self, each: &mut dyn FnMut(&'static Object)) {
        match self {
            Self::Table(object) => each(object),
            Self::List(form) | Self::Several(form) | Self::Set(form) | Self::Named(_, form) => form.tables(each),
            Self::Either(forms) => forms.iter().for_each(|form| form.tables(each)),
            Self::Changes => CHANGES.iter().for_each(|change| each(change.object)),
            Self::Condition => each(&COMPARISON),
            _ => {}
        }
    }
}

/// A kind of file.
#[derive(Debug)]
pub struct File {
    /// Its name: `deployment`.
    pub name: &'static str,
    /// The table that it is.
    pub object: &'static Object,
    /// Whether it can be written in Lua too.
    pub in_lua: bool,
}

/// The kinds of files.
pub static FILES: &[File] = &[
    File { name: "deployment", object: &DEPLOYMENT, in_lua: false },
    File { name: "configurations", object: &CONFIGURATIONS_FILE, in_lua: true },
    File { name: "coordinator", object: &COORDINATOR_FILE, in_lua: true },
    File { name: "monitors", object: &MONITORS_FILE, in_lua: true },
];

impl File {
    /// The kind of that name.
    pub fn named(name: &str) -> Option<&'static Self> {
        FILES.iter().find(|file| file.name == name)
    }

    /// The tables of it, each once, from the outside in.
    pub fn objects(&self) -> Vec<&'static Object> {
        let mut all = vec![self.object];
        let mut at = 0;
        while let Some(object) = all.get(at).copied() {
            at += 1;
            for key in object.keys {
                key.form.tables(&mut |inner| {
                    if !all.iter().any(|other| std::ptr::eq(*other, inner)) {
                        all.push(inner);
                    }
                });
            }
        }
        all
    }
}
