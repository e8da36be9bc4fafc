//! Printing in Lua.

use super::wrap::wrap;
use super::{change, fields, float, monitor};
use crate::diagnostics::Language;
use crate::lang::bound::{self, Pen};
use crate::model::monitor::Condition;
use crate::model::statechart::{ChartNode, State};
use crate::model::{Configuration, Statechart, Value};
use std::fmt::Write as _;

/// Words that Lua keeps for itself.
const KEYWORDS: &[&str] = &[
    "and", "break", "do", "else", "elseif", "end", "false", "for", "function", "goto", "if", "in", "local", "nil",
    "not", "or", "repeat", "return", "then", "true", "until", "while",
];

/// A text in quotes.
pub fn quoted(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            // Three digits always: what follows may be a digit.
            c if c.is_ascii_control() => _ = write!(out, "\\{:03}", c as u32),
            // Directions and line separators would make the file look other than it is.
            c if c.is_control() || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{feff}') => {
                _ = write!(out, "\\u{{{:x}}}", c as u32);
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// A key of a table.
pub fn key(text: &str) -> String {
    let mut bytes = text.bytes();
    let plain = bytes.next().is_some_and(|b| b.is_ascii_alphabetic() || b == b'_')
        && bytes.all(|b| b.is_ascii_alphanumeric() || b == b'_')
        && !KEYWORDS.contains(&text);
    if plain { text.to_owned() } else { format!("[{}]", quoted(text)) }
}

/// A value, written behind what is there.
pub fn value(v: &Value) -> String {
    let braced = |parts: Vec<String>| format!("{{ {} }}", parts.join(", "));
    match v {
        Value::Bool(v) => v.to_string(),
        // Its digits alone are read as a float, since the minus is not part of a number in Lua.
        Value::Int(i64::MIN) => "math.mininteger".to_owned(),
        Value::Int(v) => v.to_string(),
        Value::Float(v) => float(*v),
        Value::Str(v) => quoted(v),
        Value::Array(list) if list.is_empty() => "{}".to_owned(),
        Value::Array(list) => braced(list.iter().map(value).collect()),
        Value::Record(fields) => {
            braced(fields.iter().map(|(name, v)| format!("{} = {}", key(name.as_str()), value(v))).collect())
        }
    }
}

/// `ConfiguratorConf { … }`
pub fn configurations_lua(list: &[Configuration]) -> String {
    let mut out = String::from("ConfiguratorConf {\n");
    for (i, c) in list.iter().enumerate() {
        _ = writeln!(out, "{}  {} = Configuration {{", if i == 0 { "" } else { "\n" }, key(c.id.as_str()));
        let mut holds = |of: &Condition| wrap(&monitor::condition(of, Language::Lua), 12, 4);
        let keys = bound::CONFIGURATION.written(c, &mut Pen { language: Language::Lua, condition: &mut holds });
        let (before, behind) = fields::around(&keys, "post_conf_state");
        fields::lines(&mut out, "    ", before, Language::Lua);
        c.changes.iter().for_each(|c| _ = writeln!(out, "    {},", change::in_lua(&c.kind)));
        fields::lines(&mut out, "    ", behind, Language::Lua);
        out.push_str("  },\n");
    }
    out.push_str("}\n");
    out
}

fn state(out: &mut String, s: &State, indent: usize) {
    out.push_str("state {");
    let pad = "  ".repeat(indent + 1);
    let mut body = String::new();
    fields::lines(&mut body, &pad, &bound::STATE.plain(s, Language::Lua), Language::Lua);
    for child in &s.children {
        _ = write!(body, "{pad}{} = ", key(child.name().as_str()));
        match child {
            ChartNode::State(child) => state(&mut body, child, indent + 1),
            ChartNode::Connector(connector) => {
                let keys = bound::CONNECTOR.plain(connector, Language::Lua);
                _ = write!(
                    body,
                    "conn {}",
                    if keys.is_empty() { "{}".to_owned() } else { fields::table(keys, Language::Lua) }
                );
            }
        }
        body.push_str(",\n");
    }
    for t in &s.transitions {
        let keys = fields::table(bound::TRANSITION.plain(t, Language::Lua), Language::Lua);
        _ = writeln!(body, "{pad}trans {keys},");
    }
    if !body.is_empty() {
        _ = write!(out, "\n{body}{}", "  ".repeat(indent));
    }
    out.push('}');
}

/// `return state { … }`
pub fn coordinator_lua(chart: &Statechart) -> String {
    let mut out = String::from("return ");
    state(&mut out, &chart.root, 0);
    out.push('\n');
    out
}
