//! Examples in the language of the file that they are shown for. They are written as Lua has them; what is spelt the same in both
//! (a name, a number), or is YAML already, stays as it is.

/// An example of Lua as YAML spells it; none: it is no key with a value, no call and no table.
pub fn as_yaml(example: &str) -> Option<String> {
    let mut reader = Reader { rest: example.trim() };
    let mut entries = Vec::new();
    loop {
        entries.push(reader.entry()?);
        match reader.rest {
            "" => break,
            _ => reader.skip(",")?,
        }
    }
    match &entries[..] {
        [(None, Said::Name(_) | Said::Text(_))] => None,
        [(None, alone)] => Some(alone.yaml()),
        all if all.iter().all(|(key, _)| key.is_some()) => Some(inside(all)),
        _ => None,
    }
}

/// A value.
enum Said {
    /// A name, a number: as it stands.
    Name(String),
    Text(String),
    Table(Vec<(Option<String>, Said)>),
    Call(String, Vec<(Option<String>, Said)>),
}

impl Said {
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
}

fn inside(entries: &[(Option<String>, Said)]) -> String {
    let one = |(key, value): &(Option<String>, Said)| match key {
        Some(key) => format!("{key}: {}", value.yaml()),
        None => value.yaml(),
    };
    entries.iter().map(one).collect::<Vec<_>>().join(", ")
}

struct Reader<'t> {
    rest: &'t str,
}

impl<'t> Reader<'t> {
    /// Goes past a mark and the blanks behind it.
    fn skip(&mut self, mark: &str) -> Option<()> {
        self.rest = self.rest.strip_prefix(mark)?.trim_start();
        Some(())
    }

    /// A value, with its key where it has one.
    fn entry(&mut self) -> Option<(Option<String>, Said)> {
        let value = self.value()?;
        match value {
            Said::Name(key) if self.rest.starts_with('=') => {
                self.skip("=")?;
                Some((Some(key), self.value()?))
            }
            value => Some((None, value)),
        }
    }

    fn entries(&mut self, open: &str, close: &str) -> Option<Vec<(Option<String>, Said)>> {
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

    fn value(&mut self) -> Option<Said> {
        if let Some(quote) = self.rest.chars().next().filter(|c| matches!(c, '"' | '\'')) {
            let (text, rest) = self.rest[1..].split_once(quote)?;
            self.rest = rest.trim_start();
            return Some(Said::Text(text.to_owned()));
        }
        if self.rest.starts_with('{') {
            return Some(Said::Table(self.entries("{", "}")?));
        }
        let mut value = self.word()?;
        // What a method is called on comes first.
        while self.rest.starts_with(':') {
            self.skip(":")?;
            let Said::Call(word, mut entries) = self.word()? else { return None };
            entries.insert(0, (None, value));
            value = Said::Call(word, entries);
        }
        Some(value)
    }

    /// A name or a number, or what is made with a word.
    fn word(&mut self) -> Option<Said> {
        let is_part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '-');
        let end = self.rest.find(|c| !is_part(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest.trim_start();
        match self.rest.chars().next() {
            _ if word.is_empty() => None,
            Some('(') => Some(Said::Call(word.to_owned(), self.entries("(", ")")?)),
            Some('{') => Some(Said::Call(word.to_owned(), self.entries("{", "}")?)),
            _ => Some(Said::Name(word.to_owned())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lang::words::{CONDITIONS, SIGNALS};

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
    fn every_word_of_the_monitors_language_is_told() {
        for word in CONDITIONS.iter().chain(SIGNALS) {
            let yaml = as_yaml(word.usage).unwrap_or_else(|| panic!("{}", word.usage));
            let read: serde_json::Value = serde_yaml::from_str(&yaml).unwrap_or_else(|why| panic!("{yaml}: {why}"));
            assert!(read.get(word.name).is_some_and(serde_json::Value::is_array), "{yaml}");
        }
    }
}
