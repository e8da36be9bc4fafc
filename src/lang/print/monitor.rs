//! Printing monitors: both languages write the same words.

use super::{float, lua, seconds, yaml};
use crate::diagnostics::Language;
use crate::model::Monitor;
use crate::model::monitor::{Condition, ConditionKind, Interval, Sampling, Signal, SignalKind};
use std::fmt::Write as _;
use std::time::Duration;

/// A text in quotes where the language wants them.
fn text(t: &str, language: Language) -> String {
    match language {
        Language::Lua => lua::quoted(t),
        Language::Yaml | Language::Scxml => yaml::text(t),
    }
}

fn list(items: &[String], language: Language) -> String {
    match language {
        Language::Lua => format!("{{ {} }}", items.join(", ")),
        Language::Yaml | Language::Scxml => format!("[{}]", items.join(", ")),
    }
}

/// A word with its arguments.
fn call(word: &str, args: &[String], language: Language) -> String {
    match language {
        Language::Lua => format!("{word}({})", args.join(", ")),
        Language::Yaml | Language::Scxml => match args {
            // A list alone would be taken for several arguments.
            [one] if !one.starts_with('[') => format!("{{ {word}: {one} }}"),
            _ => format!("{{ {word}: {} }}", list(args, language)),
        },
    }
}

/// A word with a list.
fn many(word: &str, items: &[String], language: Language) -> String {
    match language {
        Language::Lua => format!("{word} {}", list(items, language)),
        Language::Yaml | Language::Scxml => format!("{{ {word}: {} }}", list(items, language)),
    }
}

/// A word that Lua has as a method.
fn method(word: &str, on: &str, argument: &str, language: Language) -> String {
    match language {
        Language::Lua => format!("{on}:{word}({argument})"),
        Language::Yaml | Language::Scxml => call(word, &[on.to_owned(), argument.to_owned()], language),
    }
}

fn interval(i: Interval, language: Language) -> String {
    let infinite = match language {
        Language::Lua => "math.huge",
        Language::Yaml | Language::Scxml => ".inf",
    };
    list(&[seconds(i.from), i.to.map_or(infinite.to_owned(), seconds)], language)
}

fn signals(all: &[Signal], language: Language) -> Vec<String> {
    all.iter().map(|s| signal(s, language)).collect()
}

fn signal(s: &Signal, l: Language) -> String {
    match &s.kind {
        SignalKind::Port(port) => text(&port.to_string(), l),
        SignalKind::Age(port) => call("age", &[text(&port.to_string(), l)], l),
        SignalKind::Rate { port, over } => call("sample_rate", &[text(&port.to_string(), l), seconds(*over)], l),
        SignalKind::Activity { activity, counter } => {
            call("activity", &[text(activity.as_str(), l), text(counter.word(), l)], l)
        }
        SignalKind::Norm(list) => many("norm", &signals(list, l), l),
        SignalKind::Min(list) => many("min", &signals(list, l), l),
        SignalKind::Max(list) => many("max", &signals(list, l), l),
        SignalKind::Difference(a, b) => call("difference", &[signal(a, l), signal(b, l)], l),
        SignalKind::Abs(s) => call("abs", &[signal(s, l)], l),
        SignalKind::Constant(v) => float(*v),
    }
}

fn condition(c: &Condition, l: Language) -> String {
    use ConditionKind as K;
    let all = |list: &[Condition]| list.iter().map(|c| condition(c, l)).collect::<Vec<_>>();
    let short = |word: &str, c: &Condition, time: Duration| method(word, &condition(c, l), &seconds(time), l);
    match &c.kind {
        K::Compare { left, op, right, hysteresis } => {
            let mut args = vec![signal(left, l), signal(right, l)];
            if let Some(h) = hysteresis {
                let is = if l == Language::Lua { " =" } else { ":" };
                args.push(format!("{{ hysteresis{is} {} }}", float(*h)));
            }
            call(op.word(), &args, l)
        }
        K::IsTrue(port) => call("is_true", &[text(&port.to_string(), l)], l),
        K::InState { component, state } => call("in_state", &[text(component.as_str(), l), text(state.as_str(), l)], l),
        K::Faulted(component) => call("faulted", &[text(component.as_str(), l)], l),
        K::Silent { port, time } => call("silent", &[text(&port.to_string(), l), seconds(*time)], l),
        K::All(list) => many("all", &all(list), l),
        K::Any(list) => many("any", &all(list), l),
        K::No(c) => call("no", &[condition(c, l)], l),
        K::Implies(a, b) => call("implies", &[condition(a, l), condition(b, l)], l),
        K::Rise(c) => call("rise", &[condition(c, l)], l),
        K::Fall(c) => call("fall", &[condition(c, l)], l),
        K::Once { condition: c, interval: i } => call("once", &[condition(c, l), interval(*i, l)], l),
        K::Historically { condition: c, interval: i } => call("historically", &[condition(c, l), interval(*i, l)], l),
        K::Since { hold, from, interval: i } => {
            call("since", &[condition(hold, l), condition(from, l), interval(*i, l)], l)
        }
        K::ForAtLeast { condition: c, time } => short("for_at_least", c, *time),
        K::WithinLast { condition: c, time } => short("within_last", c, *time),
    }
}

/// Monitors in a language.
pub fn monitors(list: &[Monitor], language: Language) -> String {
    let is_lua = language == Language::Lua;
    if list.is_empty() {
        return if is_lua { "Monitors {}\n".to_owned() } else { "monitors: {}\n".to_owned() };
    }
    let mut out = String::from(if is_lua { "Monitors {\n" } else { "monitors:\n" });
    for m in list {
        if is_lua {
            _ = writeln!(out, "  {} = monitor {{", lua::key(m.name.as_str()));
        } else {
            _ = writeln!(out, "  {}:", yaml::text(m.name.as_str()));
        }
        let mut part = |key: &str, value: String| {
            _ = if is_lua { writeln!(out, "    {key} = {value},") } else { writeln!(out, "    {key}: {value}") };
        };
        if let Some(description) = &m.description {
            part("description", if is_lua { lua::quoted(description) } else { yaml::quoted(description) });
        }
        part("when", condition(&m.when, language));
        if let Some(raise) = m.raise {
            part("event", text(raise.as_str(), language));
        }
        if let Some(cleared) = m.cleared {
            part("cleared", text(cleared.as_str(), language));
        }
        if let Some(repeat) = m.repeat {
            part("repeat_every", seconds(repeat));
        }
        if let Sampling::Every(period) = m.sampling {
            part("every", seconds(period));
        }
        if !m.enabled {
            part("enabled", "false".to_owned());
        }
        if is_lua {
            out.push_str("  },\n");
        }
    }
    if is_lua {
        out.push_str("}\n");
    }
    out
}
