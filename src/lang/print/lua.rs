//! Printing in Lua.

use super::wrap::wrap;
use super::{change, float, monitor, seconds};
use crate::diagnostics::Language;
use crate::model::statechart::{Action, ChartNode, ChartTransition, State, Trigger};
use crate::model::{Configuration, OnFailure, Origin, StateList, Statechart, Value};
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
pub fn value(out: &mut String, v: &Value) {
    match v {
        Value::Bool(v) => _ = write!(out, "{v}"),
        // Its digits alone are read as a float, since the minus is not part of a number in Lua.
        Value::Int(i64::MIN) => out.push_str("math.mininteger"),
        Value::Int(v) => _ = write!(out, "{v}"),
        Value::Float(v) => out.push_str(&float(*v)),
        Value::Str(v) => out.push_str(&quoted(v)),
        Value::Array(list) if list.is_empty() => out.push_str("{}"),
        Value::Array(list) => {
            out.push_str("{ ");
            for (i, v) in list.iter().enumerate() {
                out.push_str(if i == 0 { "" } else { ", " });
                value(out, v);
            }
            out.push_str(" }");
        }
        Value::Record(fields) => {
            out.push_str("{ ");
            for (i, (name, v)) in fields.iter().enumerate() {
                _ = write!(out, "{}{} = ", if i == 0 { "" } else { ", " }, key(name.as_str()));
                value(out, v);
            }
            out.push_str(" }");
        }
    }
}

fn states(out: &mut String, name: &str, entries: &StateList) {
    if entries.is_empty() {
        return;
    }
    let list: Vec<String> = entries.iter().map(|e| quoted(&format!("{}:{}", e.target, e.state))).collect();
    _ = writeln!(out, "    {name} = {{ {} }},", list.join(", "));
}

/// `ConfiguratorConf { … }`
pub fn configurations_lua(list: &[Configuration]) -> String {
    let mut out = String::from("ConfiguratorConf {\n");
    for (i, c) in list.iter().enumerate() {
        _ = writeln!(out, "{}  {} = Configuration {{", if i == 0 { "" } else { "\n" }, key(c.id.as_str()));
        if let Some(text) = &c.description {
            _ = writeln!(out, "    description = {},", quoted(text));
        }
        if let Some(time) = c.timeout {
            _ = writeln!(out, "    timeout = {},", seconds(time));
        }
        if let Some(group) = c.group {
            _ = writeln!(out, "    group = {},", quoted(group.as_str()));
        }
        if c.safe {
            out.push_str("    safe = true,\n");
        }
        match c.on_failure {
            OnFailure::Unset => {}
            OnFailure::Rollback => out.push_str("    on_failure = \"rollback\",\n"),
            OnFailure::Hold => out.push_str("    on_failure = \"hold\",\n"),
        }
        if let Some(condition) = &c.holds {
            _ = writeln!(out, "    holds = {},", wrap(&monitor::condition(condition, Language::Lua), 12, 4));
        }
        if let Some(confirm) = &c.confirm {
            let (event, within) = (quoted(confirm.event.as_str()), seconds(confirm.within));
            _ = writeln!(out, "    confirm = {{ event = {event}, within = {within} }},");
        }
        if c.irreversible {
            out.push_str("    irreversible = true,\n");
        }
        states(&mut out, "pre_conf_state", &c.pre);
        c.changes.iter().for_each(|c| _ = writeln!(out, "    {},", change::in_lua(&c.kind)));
        states(&mut out, "post_conf_state", &c.post);
        out.push_str("  },\n");
    }
    out.push_str("}\n");
    out
}

fn texts(out: &mut String, name: &str, list: &[String]) {
    if !list.is_empty() {
        let list: Vec<String> = list.iter().map(|t| quoted(t)).collect();
        _ = write!(out, "{name} = {{ {} }}, ", list.join(", "));
    }
}

fn raised(actions: &[(Action, Origin)]) -> Vec<String> {
    let one = |(action, _): &(Action, Origin)| match action {
        Action::Raise(event) => Some(event.to_string()),
        Action::Function(_) => None,
    };
    actions.iter().filter_map(one).collect()
}

fn transition(out: &mut String, t: &ChartTransition) {
    out.push_str("trans { ");
    for (name, reference) in [("src", &t.src), ("tgt", &t.tgt)] {
        if let Some((text, _)) = reference {
            _ = write!(out, "{name} = {}, ", quoted(text));
        }
    }
    let events = t.events.iter().filter(|(trigger, _)| !matches!(trigger, Trigger::Predicate(_)));
    texts(out, "events", &events.map(|(trigger, _)| trigger.to_string()).collect::<Vec<_>>());
    texts(out, "effect", &raised(&t.effect));
    if t.pn != 0.0 {
        _ = write!(out, "pn = {}, ", float(t.pn));
    }
    if let Some(doc) = &t.doc {
        _ = write!(out, "doc = {}, ", quoted(doc));
    }
    out.truncate(out.trim_end_matches([' ', ',']).len());
    out.push_str(" },\n");
}

fn state(out: &mut String, s: &State, indent: usize) {
    out.push_str("state {");
    let pad = "  ".repeat(indent + 1);
    let mut body = String::new();
    if let Some(doc) = &s.doc {
        _ = writeln!(body, "{pad}doc = {},", quoted(doc));
    }
    let config: Vec<String> = s.config.iter().map(|(id, _)| id.to_string()).collect();
    for (name, list) in [("config", config), ("entry", raised(&s.entry)), ("exit", raised(&s.exit))] {
        let mut line = String::new();
        texts(&mut line, name, &list);
        if !line.is_empty() {
            _ = writeln!(body, "{pad}{}", line.trim_end());
        }
    }
    for child in &s.children {
        _ = write!(body, "{pad}{} = ", key(child.name().as_str()));
        match child {
            ChartNode::State(child) => state(&mut body, child, indent + 1),
            ChartNode::Connector(connector) => {
                let doc = connector.doc.as_ref().map_or(String::new(), |doc| format!(" doc = {} ", quoted(doc)));
                _ = write!(body, "conn {{{doc}}}");
            }
        }
        body.push_str(",\n");
    }
    for t in &s.transitions {
        body.push_str(&pad);
        transition(&mut body, t);
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
