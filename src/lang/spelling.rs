//! Examples in the language of the file that they are shown for. They are written as Lua has them; what is spelt the same in both
//! (a name, a number), or is YAML already, stays as it is.

use super::example::{ExampleValue, parse, told};
use super::grammar::{Primitive, primitive};

/// An example of Lua as YAML spells it; none: it is no key with a value, no call and no table.
pub fn as_yaml(example: &str) -> Option<String> {
    let entries = parse(example)?;
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
    told(text, as_yaml)
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
