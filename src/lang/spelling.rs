//! Examples in the language of the file that they are shown for. They are written as Lua has them; what is spelt the same in both
//! (a name, a number), or is YAML already, stays as it is.

use super::grammar::{Primitive, primitive};
use super::words::{CONDITIONS, SIGNALS};

/// An example of Lua as YAML spells it; none: it is no key with a value, no call and no table.
pub fn as_yaml(example: &str) -> Option<String> {
    let mut reader = ExampleParser { rest: example.trim() };
    let mut entries = Vec::new();
    loop {
        entries.push(reader.entry()?);
        match reader.rest {
            "" => break,
            _ => reader.skip(",")?,
        }
    }
    match &entries[..] {
        [(None, ExampleValue::Name(_) | ExampleValue::Text(_))] => None,
        [(None, alone)] => Some(match alone.change() {
            Some((verb, parts)) => format!("{verb}: {{ {parts} }}"),
            None => alone.yaml(),
        }),
        all if all.iter().all(|(key, _)| key.is_some()) => Some(inside(all)),
        _ => None,
    }
}

/// A text with examples of Lua in it, between backticks, as it is told of a file in YAML.
pub fn told_in_yaml(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for (at, part) in text.split('`').enumerate() {
        if at > 0 {
            out.push('`');
        }
        match is_example(part).then(|| as_yaml(part)).flatten().filter(|_| at % 2 == 1) {
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

/// A value.
enum ExampleValue {
    /// A name, a number: as it stands.
    Name(String),
    Text(String),
    Table(Vec<(Option<String>, ExampleValue)>),
    Call(String, Vec<(Option<String>, ExampleValue)>),
}

impl ExampleValue {
    fn yaml(&self) -> String {
        match self {
            Self::Name(name) if name == "math.huge" => ".inf".to_owned(),
            Self::Name(name) => name.clone(),
            Self::Text(text) => {
                let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '/');
                match text.chars().all(plain) && text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
                    true => text.clone(),
                    false => format!("\"{text}\""),
                }
            }
            Self::Table(entries) if entries.is_empty() => "{}".to_owned(),
            Self::Table(entries) if entries.iter().any(|(key, _)| key.is_some()) => {
                format!("{{ {} }}", inside(entries))
            }
            Self::Table(entries) => format!("[{}]", inside(entries)),
            Self::Call(_, entries) if matches!(&entries[..], [(None, Self::Name(rest))] if rest == "…") => {
                "{ … }".to_owned()
            }
            Self::Call(..) if self.change().is_some() => {
                self.change().map(|(verb, parts)| format!("{{ {verb}: {{ {parts} }} }}")).unwrap_or_default()
            }
            // Named parts belong to what is made of them; the others are what a word is said of.
            Self::Call(_, entries) if entries.iter().all(|(key, _)| key.is_some()) => {
                if entries.is_empty() {
                    "{}".to_owned()
                } else {
                    format!("{{ {} }}", inside(entries))
                }
            }
            Self::Call(word, entries) => format!("{{ {word}: [{}] }}", inside(entries)),
        }
    }

    /// The word of a change, and its parts by name: in Lua they are its arguments.
    fn change(&self) -> Option<(&'static str, String)> {
        let Self::Call(word, entries) = self else { return None };
        if let (true, Some((None, of))) = (word == "undo", entries.first()) {
            let (verb, parts) = of.change()?;
            let called = parts_of(primitive(verb)?, &entries[1..]);
            return Some((verb, format!("{parts}, undo: {{ {called} }}")));
        }
        let of = primitive(word)?;
        Some((of.object.name, parts_of(of, entries)))
    }
}

fn parts_of(of: &Primitive, entries: &[(Option<String>, ExampleValue)]) -> String {
    let mut parts = Vec::new();
    let mut given = entries.iter().map(|(_, value)| value);
    for argument in of.arguments {
        match argument.strip_suffix('…') {
            Some(list) => {
                let rest: Vec<String> = given.by_ref().map(ExampleValue::yaml).collect();
                parts.extend((!rest.is_empty()).then(|| format!("{list}: [{}]", rest.join(", "))));
            }
            None => match given.next() {
                Some(ExampleValue::Table(options)) if *argument == "options" => parts.push(inside(options)),
                Some(value) => parts.push(format!("{argument}: {}", value.yaml())),
                None => {}
            },
        }
    }
    parts.join(", ")
}

fn inside(entries: &[(Option<String>, ExampleValue)]) -> String {
    let one = |(key, value): &(Option<String>, ExampleValue)| match key {
        Some(key) => format!("{key}: {}", value.yaml()),
        None => value.yaml(),
    };
    entries.iter().map(one).collect::<Vec<_>>().join(", ")
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
    fn entry(&mut self) -> Option<(Option<String>, ExampleValue)> {
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

    fn entries(&mut self, open: &str, close: &str) -> Option<Vec<(Option<String>, ExampleValue)>> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_in_lua_is_told_in_yaml() {
        for (lua, yaml) in [
            ("timeout = 0.5", "timeout: 0.5"),
            ("group = \"dof\"", "group: dof"),
            ("description = \"what it is for\"", "description: \"what it is for\""),
            ("{ 'compA:running', '_default:stopped' }", "[\"compA:running\", \"_default:stopped\"]"),
            ("confirm = { event = \"e_a\", within = 2.0 }", "confirm: { event: e_a, within: 2.0 }"),
            ("events = { \"e_go\" }", "events: [e_go]"),
            ("idle = state {}", "idle: {}"),
            ("src = \"a\", tgt = \"b\"", "src: a, tgt: b"),
            ("above(\"A.x[0]\", 8.0, { hysteresis = 0.5 })", "{ above: [\"A.x[0]\", 8.0, { hysteresis: 0.5 }] }"),
            ("above(\"A.x\", 2.0):for_at_least(0.3)", "{ for_at_least: [{ above: [A.x, 2.0] }, 0.3] }"),
            ("once(faulted(\"A\"), { 0, math.huge })", "{ once: [{ faulted: [A] }, [0, .inf]] }"),
            (
                "high = monitor { when = above(\"A.x\", 2.0), event = \"e_high\" }",
                "high: { when: { above: [A.x, 2.0] }, event: e_high }",
            ),
        ] {
            assert_eq!(as_yaml(lua).as_deref(), Some(yaml), "{lua}");
        }
    }

    #[test]
    fn what_is_spelt_the_same_or_is_yaml_already_stays() {
        for same in
            ["running", "0.5", "Dynamics.force[0]", "component: radio", "{ step: \"property_set a.k = 2\" }", "name: …"]
        {
            assert_eq!(as_yaml(same), None, "{same}");
        }
    }

    #[test]
    fn examples_in_a_text_are_told_in_yaml_and_nothing_else_is() {
        for (lua, yaml) in [
            ("add `disconnect(\"a.y\", \"b.u\")` to it", "add `disconnect: { from: a.y, to: b.u }` to it"),
            (
                "`create(\"M\", \"davit.Monitors\", { activity = … })`",
                "`create: { component: M, type: davit.Monitors, activity: … }`",
            ),
            (
                "`map = { [\"in\"] = \"…\" }`, `replace(\"c\", \"T\", { map = { y = \"z\" } })`",
                "`map: { in: \"…\" }`, `replace: { component: c, type: T, map: { y: z } }`",
            ),
            (
                "`operation_call(\"a.open\", 6):undo(\"a.close\", 0)`",
                "`operation_call: { operation: a.open, args: [6], undo: { operation: a.close, args: [0] } }`",
            ),
            ("`changes = { destroy(\"a\") }`", "`changes: [{ destroy: { component: a } }]`"),
            ("write `name = state { … }`", "write `name: { … }`"),
            ("`trans { src = \"initial\", tgt = … }`", "`{ src: initial, tgt: … }`"),
            ("say `safe = true` here", "say `safe: true` here"),
            ("`once(above(\"A.x\", 2.0), { 0, 1.5 })`", "`{ once: [{ above: [A.x, 2.0] }, [0, 1.5]] }`"),
        ] {
            assert_eq!(told_in_yaml(lua), yaml);
        }
        for same in [
            "`property_set a.k = 2.0` failed",
            "`operation_call a.open(0.5)`",
            "`a.open(0.5)` and `e_after(1.0)`",
            "`gain.k = 2` was there",
            "a = 1, outside of any",
            "`e_go` and `safety: [e_estop]`",
            "one ` alone, x = 1",
        ] {
            assert_eq!(told_in_yaml(same), same);
        }
    }

    #[test]
    fn every_word_of_the_monitors_language_is_told() {
        for word in CONDITIONS.iter().chain(SIGNALS) {
            let yaml = as_yaml(word.usage).unwrap_or_else(|| panic!("{}", word.usage));
            let read: serde_json::Value = serde_yaml::from_str(&yaml).unwrap_or_else(|why| panic!("{yaml}: {why}"));
            assert!(read.get(word.name).is_some_and(serde_json::Value::is_array), "{yaml}");
        }
    }
}
