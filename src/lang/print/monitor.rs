//! Printing monitors: both languages write the same words.

use super::fields::{self, list, text};
use super::wrap::wrap;
use super::{float, lua, seconds, yaml};
use crate::diagnostics::Language;
use crate::lang::bound::{self, Pen};
use crate::model::Monitor;
use crate::model::monitor::{Condition, ConditionKind, Interval, MonitoredSignal, SignalKind};
use std::collections::HashMap;
use std::fmt::Write as _;

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

fn signals(all: &[MonitoredSignal], language: Language) -> Vec<String> {
    all.iter().map(|s| signal(s, language)).collect()
}

fn signal(s: &MonitoredSignal, l: Language) -> String {
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

/// Conditions that stand in several places. In YAML the first of them gets a name (`&c1 …`) and the others are that name
/// (`*c1`); in Lua, where a local would have to stand somewhere, each is written out.
#[derive(Default)]
pub(super) struct CommonConditions {
    /// By their text, how often they stand; what is in one counts once for all of them.
    times: HashMap<String, usize>,
    /// By their text, the names of those that were written.
    names: HashMap<String, String>,
}

/// Characters of a condition before a name is shorter.
const WORTH_A_NAME: usize = 48;

impl CommonConditions {
    /// What stands in several places in these conditions of one text.
    pub(super) fn of<'a>(conditions: impl Iterator<Item = &'a Condition>, language: Language) -> Self {
        let mut shared = Self::default();
        if language != Language::Lua {
            conditions.for_each(|condition| shared.count(condition));
        }
        shared
    }

    /// One of these conditions; they are printed in the order in which they were given.
    pub(super) fn print(&mut self, c: &Condition, language: Language) -> String {
        shared_condition(c, language, self)
    }

    fn count(&mut self, c: &Condition) {
        let text = plain(c, Language::Yaml, &mut Self::default());
        if text.len() >= WORTH_A_NAME {
            let times = self.times.entry(text).or_insert(0);
            *times += 1;
            if *times > 1 {
                return;
            }
        }
        c.parts().into_iter().for_each(|inner| self.count(inner));
    }
}

/// A condition by itself, on one line.
pub fn condition(c: &Condition, language: Language) -> String {
    plain(c, language, &mut CommonConditions::default())
}

/// A condition, or its name where it was written before.
fn shared_condition(c: &Condition, l: Language, shared: &mut CommonConditions) -> String {
    if shared.times.is_empty() {
        return plain(c, l, shared);
    }
    let key = plain(c, l, &mut CommonConditions::default());
    if shared.times.get(&key).is_none_or(|times| *times < 2) {
        return plain(c, l, shared);
    }
    if let Some(name) = shared.names.get(&key) {
        return format!("*{name}");
    }
    // What is in it may have a name of its own, which comes first.
    let text = plain(c, l, shared);
    let name = format!("c{}", shared.names.len() + 1);
    let named = format!("&{name} {text}");
    shared.names.insert(key, name);
    named
}

fn plain(c: &Condition, l: Language, shared: &mut CommonConditions) -> String {
    use ConditionKind as K;
    let mut one = |c: &Condition| shared_condition(c, l, shared);
    match &c.kind {
        K::Compare { left, op, right, hysteresis } => {
            let mut args = vec![signal(left, l), signal(right, l)];
            if let Some(h) = hysteresis {
                args.push(fields::table([("hysteresis", float(*h))], l));
            }
            call(op.word(), &args, l)
        }
        K::IsTrue(port) => call("is_true", &[text(&port.to_string(), l)], l),
        K::InState { component, state } => call("in_state", &[text(component.as_str(), l), text(state.as_str(), l)], l),
        K::Faulted(component) => call("faulted", &[text(component.as_str(), l)], l),
        K::Silent { port, time } => call("silent", &[text(&port.to_string(), l), seconds(*time)], l),
        K::All(list) => many("all", &list.iter().map(one).collect::<Vec<_>>(), l),
        K::Any(list) => many("any", &list.iter().map(one).collect::<Vec<_>>(), l),
        K::No(c) => call("no", &[one(c)], l),
        K::Implies(a, b) => call("implies", &[one(a), one(b)], l),
        K::Rise(c) => call("rise", &[one(c)], l),
        K::Fall(c) => call("fall", &[one(c)], l),
        K::Once { condition: c, interval: i } => call("once", &[one(c), interval(*i, l)], l),
        K::Historically { condition: c, interval: i } => call("historically", &[one(c), interval(*i, l)], l),
        K::Since { hold, from, interval: i } => call("since", &[one(hold), one(from), interval(*i, l)], l),
        K::ForAtLeast { condition: c, time } => method("for_at_least", &one(c), &seconds(*time), l),
        K::WithinLast { condition: c, time } => method("within_last", &one(c), &seconds(*time), l),
    }
}

/// Monitors in a language.
pub fn monitors(list: &[Monitor], language: Language) -> String {
    let is_lua = language == Language::Lua;
    if list.is_empty() {
        return if is_lua { "Monitors {}\n".to_owned() } else { "monitors: {}\n".to_owned() };
    }
    let mut shared = CommonConditions::of(list.iter().map(|m| &m.when), language);
    let mut out = String::from(if is_lua { "Monitors {\n" } else { "monitors:\n" });
    for m in list {
        if is_lua {
            _ = writeln!(out, "  {} = monitor {{", lua::key(m.name.as_str()));
        } else {
            _ = writeln!(out, "  {}:", yaml::text(m.name.as_str()));
        }
        // In YAML every line of a value stands further right than its key.
        let mut when = |of: &Condition| wrap(&shared.print(of, language), 11, if is_lua { 4 } else { 6 });
        let keys = bound::MONITOR.written(m, &mut Pen { language, condition: &mut when });
        fields::lines(&mut out, "    ", &keys, language);
        if is_lua {
            out.push_str("  },\n");
        }
    }
    if is_lua {
        out.push_str("}\n");
    }
    out
}
