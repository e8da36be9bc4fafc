//! Loose tree → model: every name, type, time and choice is checked here, once, for both languages.

pub mod beside;
pub mod chart;
pub mod condition;
pub mod configuration;
pub mod deployment;
mod fields;
pub mod interface;
pub mod monitor;
mod simulated;
pub mod types;

use super::tree::{Cx, Entry, Fields, Kind, Node};
use crate::model::finding::{did_you_mean, nearest};
use crate::model::names::NameError;
use crate::model::{Finding, Ident, Origin, Value, codes};
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

/// A name of any kind.
pub fn name<T: FromStr<Err = NameError>>(cx: &mut Cx, node: &Node, what: &str, example: &str) -> Option<T> {
    let Kind::Str(text) = &node.kind else {
        cx.wrong(node, what, "a name (a text)", example);
        return None;
    };
    match text.parse() {
        Ok(name) => Some(name),
        Err(error) => {
            bad_name(cx, node, &error, example);
            None
        }
    }
}

/// The name that an entry has.
fn own_name<T: FromStr<Err = NameError>>(cx: &mut Cx, entry: &Entry, what: &str, example: &str) -> Option<T> {
    let key = Node::new(Kind::Str(entry.key.to_string().into()), entry.origin);
    name(cx, &key, what, example)
}

/// Entries with plain names, and what `one` reads of each: those of which both can be read.
pub fn by_name<T>(
    cx: &mut Cx,
    entries: Vec<Entry>,
    what: &str,
    example: &str,
    mut one: impl FnMut(&mut Cx, Option<Ident>, Entry) -> Option<T>,
) -> Vec<(Ident, T)> {
    let read = |entry: Entry| {
        let name = own_name(cx, &entry, what, example);
        let value = one(cx, name, entry);
        name.zip(value)
    };
    entries.into_iter().filter_map(read).collect()
}

pub fn bad_name(cx: &mut Cx, node: &Node, error: &NameError, example: &str) {
    let origin = cx.place(node);
    let example = cx.spelt(node.origin, example);
    let shown: String = error.text.chars().take(60).collect();
    cx.report(
        Finding::error(codes::TEXT_BAD_NAME, format!("`{shown}` is not {} {}", error.article(), error.kind))
            .at(origin)
            .labelled(error.reason)
            .help(format!("write it like `{example}`")),
    );
}

/// A list of names, each of them once; `path` is the key's, for messages.
pub fn names<T>(cx: &mut Cx, fields: &mut Fields, key: &'static str, path: &str) -> Vec<(T, Origin)>
where
    T: FromStr<Err = NameError> + PartialEq + std::fmt::Display,
{
    let mut out: Vec<(T, Origin)> = Vec::new();
    for node in fields.several(cx, key) {
        let Some(name) = name::<T>(cx, &node, path, fields.row(key).example) else { continue };
        once(cx, &mut out, name, node.origin, path);
    }
    out
}

pub fn once<T: PartialEq + std::fmt::Display>(
    cx: &mut Cx,
    out: &mut Vec<(T, Origin)>,
    name: T,
    origin: Origin,
    key: &str,
) {
    match out.iter().find(|(other, _)| *other == name) {
        None => out.push((name, origin)),
        Some((_, first)) => {
            let finding = Finding::error(codes::TEXT_DUPLICATE_KEY, format!("`{name}` stands twice in {key}"));
            cx.report(finding.at(origin).also(*first, "first here").help("name each once"));
        }
    }
}

/// A text.
pub fn text(cx: &mut Cx, node: &Node, what: &str, example: &str) -> Option<String> {
    let Kind::Str(text) = &node.kind else {
        cx.wrong(node, what, "a text", example);
        return None;
    };
    Some(text.to_string())
}

/// A truth value.
pub fn truth(cx: &mut Cx, node: &Node, what: &str, example: &str) -> Option<bool> {
    let meant = match &node.kind {
        Kind::Bool(v) => return Some(*v),
        // What YAML once took for one is told as well.
        Kind::Str(text) => match text.to_lowercase().as_str() {
            "yes" | "on" => Some("true"),
            "no" | "off" => Some("false"),
            text => nearest(text, ["true", "false"]),
        },
        _ => None,
    };
    match meant {
        Some(meant) => cx.wrong_so(node, what, "true or false", &format!("did you mean `{meant}`?")),
        None => cx.wrong(node, what, "true or false", example),
    }
    None
}

/// A finite number.
pub fn number(cx: &mut Cx, node: &Node, what: &str, example: &str) -> Option<f64> {
    match node.kind {
        #[allow(clippy::cast_precision_loss)]
        Kind::Int(v) => Some(v as f64),
        Kind::Float(v) if v.is_finite() => Some(v),
        Kind::Float(v) => {
            not_finite(cx, node, v, what);
            None
        }
        _ => {
            cx.wrong(node, what, "a number", example);
            None
        }
    }
}

fn not_finite(cx: &mut Cx, node: &Node, v: f64, what: &str) {
    cx.report(
        Finding::error(codes::TEXT_NOT_FINITE, format!("{what} cannot be {v}: it is not a finite number"))
            .at(node.origin)
            .help("values of a robot's system are finite: look at the calculation that led here"),
    );
}

/// A whole number in a range.
pub fn whole(cx: &mut Cx, node: &Node, what: &str, range: std::ops::RangeInclusive<i64>, example: &str) -> Option<i64> {
    match node.kind {
        Kind::Int(v) if range.contains(&v) => Some(v),
        Kind::Int(v) => {
            let (min, max) = (range.start(), range.end());
            let origin = cx.place(node);
            let example = cx.spelt(node.origin, example);
            cx.report(
                Finding::error(codes::TEXT_BAD_VALUE, format!("{what} must be from {min} to {max}, this is {v}"))
                    .at(origin)
                    .help(format!("write it like `{example}`")),
            );
            None
        }
        _ => {
            cx.wrong(node, what, "a whole number", example);
            None
        }
    }
}

/// One of a few words.
pub fn choice<T: Copy>(cx: &mut Cx, node: &Node, what: &str, choices: &[(&'static str, T)]) -> Option<T> {
    let words = choices.iter().map(|(word, _)| *word);
    let Kind::Str(text) = &node.kind else {
        let all: Vec<_> = words.map(|w| format!("`{w}`")).collect();
        cx.wrong(node, what, &format!("a text, one of {}", all.join(", ")), choices[0].0);
        return None;
    };
    if let Some((_, value)) = choices.iter().find(|(word, _)| *word == &**text) {
        return Some(*value);
    }
    let origin = cx.place(node);
    cx.report(
        Finding::error(codes::TEXT_BAD_VALUE, format!("{what} cannot be `{text}`"))
            .at(origin)
            .help(did_you_mean(text, "values", words)),
    );
    None
}

/// The unit a time is written in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// Seconds.
    Seconds,
    /// Milliseconds.
    Milliseconds,
}

/// An example with another number in place of its last one.
fn with_number(example: &str, number: f64) -> String {
    let is_part = |c: char| c.is_ascii_digit() || c == '.';
    let Some(last) = example.rfind(|c: char| c.is_ascii_digit()) else { return example.to_owned() };
    let start = example[..last].rfind(|c| !is_part(c)).map_or(0, |at| at + 1);
    format!("{}{number}{}", &example[..start], &example[last + 1..])
}

/// Longest time that is not taken for a mistake in the unit: a day.
const LONGEST: f64 = 86_400.0;

/// A time: a positive number of the unit, at most a day.
pub fn time(cx: &mut Cx, node: &Node, what: &str, unit: Unit, example: &str) -> Option<Duration> {
    let example = &cx.spelt(node.origin, example);
    let (word, factor) = match unit {
        Unit::Seconds => ("seconds", 1.0),
        Unit::Milliseconds => ("milliseconds", 1e-3),
    };
    let refuse = |cx: &mut Cx, message: String, help: String| {
        let origin = cx.place(node);
        cx.report(Finding::error(codes::TEXT_BAD_TIME, message).at(origin).labelled(format!("in {word}")).help(help));
        None
    };
    if let Kind::Str(text) = &node.kind {
        // A number in quotes is one of the key's own unit.
        let bare = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        let help = match bare.or_else(|| parse_time(text).map(|seconds| seconds / factor)) {
            Some(number) => format!("write the number alone: `{}`", with_number(example, number)),
            None => format!("write it like `{example}`"),
        };
        return refuse(cx, format!("{what} is a number of {word}, this is the text `{text}`"), help);
    }
    let v = number(cx, node, what, example)?;
    if v <= 0.0 {
        return refuse(
            cx,
            format!("{what} must be more than 0 {word}, this is {v}"),
            format!("write it like `{example}`"),
        );
    }
    if v * factor > LONGEST {
        let help = format!("it is a number of {word}: was another unit meant? Write it like `{example}`");
        return refuse(cx, format!("{what} of {v} {word} is longer than a day"), help);
    }
    let nanos = (v * factor * 1e9).round();
    if nanos < 1.0 {
        return refuse(
            cx,
            format!("{what} of {v} {word} is shorter than a nanosecond"),
            format!("write it like `{example}`"),
        );
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    Some(Duration::from_nanos(nanos as u64))
}

/// The seconds that a text such as `500ms` means.
pub fn parse_time(text: &str) -> Option<f64> {
    let text = text.trim();
    let end = text.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(text.len());
    let number: f64 = text[..end].parse().ok()?;
    Some(match text[end..].trim() {
        "" | "s" | "sec" | "seconds" => number,
        "ms" => number / 1e3,
        "us" | "µs" => number / 1e6,
        "ns" => number / 1e9,
        "min" => number * 60.0,
        _ => return None,
    })
}

/// A value of a property, a port or an argument.
pub fn value(cx: &mut Cx, node: Node, what: &str) -> Option<Value> {
    match node.kind {
        Kind::Bool(v) => Some(Value::Bool(v)),
        Kind::Int(v) => Some(Value::Int(v)),
        Kind::Float(v) if v.is_finite() => Some(Value::Float(v)),
        Kind::Float(v) => {
            not_finite(cx, &node, v, what);
            None
        }
        Kind::Str(v) => Some(Value::Str(Arc::from(v))),
        Kind::List(list) => {
            let length = list.len();
            let values: Vec<_> = list.into_iter().filter_map(|v| value(cx, v, what)).collect();
            (values.len() == length).then_some(Value::Array(values))
        }
        Kind::Map(entries) if entries.is_empty() => Some(Value::Array(Vec::new())),
        Kind::Map(entries) => {
            let length = entries.len();
            let mut fields =
                by_name(cx, entries, "a field of a record", "{ x = 1.0 }", |cx, _, entry| value(cx, entry.value, what));
            fields.sort_by_key(|(name, _)| *name);
            (fields.len() == length).then_some(Value::Record(fields))
        }
        Kind::Mixed(..) => {
            // Only Lua can.
            cx.report(
                Finding::error(codes::TEXT_WRONG_TYPE, format!("{what} mixes list and record"))
                    .at(node.origin)
                    .help("write either elements (`{ 1, 2 }`) or named fields (`{ x = 1, y = 2 }`)"),
            );
            None
        }
        Kind::Null | Kind::Made(..) | Kind::Handle(_) | Kind::Function | Kind::Poison => {
            cx.wrong(&node, what, "a value (bool, number, text, list or record)", "0.5");
            None
        }
    }
}

/// One or several of something: a list, or one alone.
/// The entries of a table of named values, none where it is something else. In Lua an empty table is a list as well.
pub fn entries(cx: &mut Cx, node: Node, what: &str, example: &str) -> Vec<Entry> {
    match node.kind {
        Kind::Map(entries) => entries,
        Kind::List(list) if list.is_empty() && cx.is_lua(node.origin) => Vec::new(),
        _ => {
            cx.wrong(&node, what, "a table of named values", example);
            Vec::new()
        }
    }
}

pub fn one_or_more(node: Node) -> Vec<Node> {
    match node.kind {
        Kind::List(list) => list,
        _ => vec![node],
    }
}
