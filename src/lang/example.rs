//! The examples in texts of findings, which are written as Lua has them: keys with values, tables, and what is made with a word.

use super::grammar::primitive;
use super::words::{CONDITIONS, SIGNALS};

/// A value of an example.
pub(super) enum ExampleValue {
    /// A name, a number: as it stands.
    Name(String),
    Text(String),
    Table(Vec<ExampleEntry>),
    Call(String, Vec<ExampleEntry>),
}

/// A value with its key, where it has one.
pub(super) type ExampleEntry = (Option<String>, ExampleValue);

/// What stands in an example, one after the other; none: it is no key with a value, no call and no table.
pub(super) fn parse(example: &str) -> Option<Vec<ExampleEntry>> {
    let mut reader = ExampleParser { rest: example.trim() };
    let mut entries = Vec::new();
    loop {
        entries.push(reader.entry()?);
        match reader.rest {
            "" => return Some(entries),
            _ => reader.skip(",")?,
        }
    }
}

/// A text with the examples in it, between backticks, as `spell` has them; what that does not know stays as it is.
pub(super) fn told(text: &str, spell: fn(&str) -> Option<String>) -> String {
    let mut out = String::with_capacity(text.len());
    for (at, part) in text.split('`').enumerate() {
        if at > 0 {
            out.push('`');
        }
        match is_example(part).then(|| spell(part)).flatten().filter(|_| at % 2 == 1) {
            Some(spelt) => out.push_str(&spelt),
            None => out.push_str(part),
        }
    }
    out
}

/// Whether what is quoted is an example: keys with values, a table, or what a word of the language makes. Steps as plans print them,
/// time events and calls of operations are written alike in both languages.
fn is_example(text: &str) -> bool {
    let mut reader = ExampleParser { rest: text.trim() };
    match reader.entry() {
        Some((Some(key), _)) => !key.contains(['.', '-']),
        Some((None, ExampleValue::Call(word, _))) => is_word(&word),
        Some((None, ExampleValue::Table(_))) => true,
        _ => false,
    }
}

fn is_word(word: &str) -> bool {
    let made =
        ["state", "trans", "transition", "conn", "Configuration", "ConfiguratorConf", "monitor", "Monitors", "undo"];
    primitive(word).is_some()
        || made.contains(&word)
        || CONDITIONS.iter().chain(SIGNALS).any(|known| known.name == word)
}

struct ExampleParser<'t> {
    rest: &'t str,
}

impl<'t> ExampleParser<'t> {
    /// Goes past a mark and the blanks behind it.
    fn skip(&mut self, mark: &str) -> Option<()> {
        self.rest = self.rest.strip_prefix(mark)?.trim_start();
        Some(())
    }

    /// A value, with its key where it has one.
    fn entry(&mut self) -> Option<ExampleEntry> {
        if self.rest.starts_with('[') {
            // A key that is no name in Lua.
            self.skip("[")?;
            let ExampleValue::Text(key) = self.value()? else { return None };
            self.skip("]")?;
            self.skip("=")?;
            return Some((Some(key), self.value()?));
        }
        let value = self.value()?;
        match value {
            ExampleValue::Name(key) if self.rest.starts_with('=') => {
                self.skip("=")?;
                Some((Some(key), self.value()?))
            }
            value => Some((None, value)),
        }
    }

    fn entries(&mut self, open: &str, close: &str) -> Option<Vec<ExampleEntry>> {
        self.skip(open)?;
        let mut entries = Vec::new();
        while self.skip(close).is_none() {
            if !entries.is_empty() {
                self.skip(",")?;
            }
            entries.push(self.entry()?);
        }
        Some(entries)
    }

    fn value(&mut self) -> Option<ExampleValue> {
        if let Some(quote) = self.rest.chars().next().filter(|c| matches!(c, '"' | '\'')) {
            let (text, rest) = self.rest[1..].split_once(quote)?;
            self.rest = rest.trim_start();
            return Some(ExampleValue::Text(text.to_owned()));
        }
        if self.rest.starts_with('{') {
            return Some(ExampleValue::Table(self.entries("{", "}")?));
        }
        let mut value = self.word()?;
        // What a method is called on comes first.
        while self.rest.starts_with(':') {
            self.skip(":")?;
            let ExampleValue::Call(word, mut entries) = self.word()? else { return None };
            entries.insert(0, (None, value));
            value = ExampleValue::Call(word, entries);
        }
        Some(value)
    }

    /// A name or a number, or what is made with a word.
    fn word(&mut self) -> Option<ExampleValue> {
        let is_part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '-' | '…');
        let end = self.rest.find(|c| !is_part(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest.trim_start();
        match self.rest.chars().next() {
            _ if word.is_empty() => None,
            Some('(') => Some(ExampleValue::Call(word.to_owned(), self.entries("(", ")")?)),
            Some('{') => Some(ExampleValue::Call(word.to_owned(), self.entries("{", "}")?)),
            _ => Some(ExampleValue::Name(word.to_owned())),
        }
    }
}
