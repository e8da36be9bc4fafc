//! What both languages write as keys with values: keys of configurations, states, transitions and monitors.

use super::{float, lua, seconds, yaml};
use crate::diagnostics::Language;
use crate::model::monitor::{Condition, Sampling};
use crate::model::statechart::{Action, ChartTransition, State, Trigger};
use crate::model::{Configuration, Monitor, OnFailure, Origin, StateList, Value};
use std::fmt::Write as _;

/// A key with what stands behind it.
pub type WrittenKey = (&'static str, String);

/// A text in quotes where the language wants them.
pub fn text(t: &str, language: Language) -> String {
    match language {
        Language::Lua => lua::quoted(t),
        Language::Yaml | Language::Scxml => yaml::text(t),
    }
}

/// A text in quotes.
fn quoted(t: &str, language: Language) -> String {
    match language {
        Language::Lua => lua::quoted(t),
        Language::Yaml | Language::Scxml => yaml::quoted(t),
    }
}

/// A name as the key of a table.
fn key(name: &str, language: Language) -> String {
    match language {
        Language::Lua => lua::key(name),
        Language::Yaml | Language::Scxml => yaml::text(name),
    }
}

pub fn value(v: &Value, language: Language) -> String {
    match language {
        Language::Lua => lua::value(v),
        Language::Yaml | Language::Scxml => yaml::value(v),
    }
}

pub fn list(items: &[String], language: Language) -> String {
    match language {
        Language::Lua => format!("{{ {} }}", items.join(", ")),
        Language::Yaml | Language::Scxml => format!("[{}]", items.join(", ")),
    }
}

fn texts<T: ToString>(all: impl IntoIterator<Item = T>, language: Language) -> Option<String> {
    let all: Vec<String> = all.into_iter().map(|one| text(&one.to_string(), language)).collect();
    (!all.is_empty()).then(|| list(&all, language))
}

/// Keys with their values in one line, in braces.
pub fn table<'k>(fields: impl IntoIterator<Item = (&'k str, String)>, language: Language) -> String {
    let sign = if language == Language::Lua { " =" } else { ":" };
    let fields: Vec<String> =
        fields.into_iter().map(|(name, value)| format!("{}{sign} {value}", key(name, language))).collect();
    match (fields.is_empty(), language) {
        (false, _) => format!("{{ {} }}", fields.join(", ")),
        (true, Language::Lua) => "{ }".to_owned(),
        (true, _) => "{}".to_owned(),
    }
}

/// Keys with their values, each in a line of its own.
pub fn lines(out: &mut String, pad: &str, fields: Vec<WrittenKey>, language: Language) {
    for (key, value) in fields {
        _ = match language {
            Language::Lua => writeln!(out, "{pad}{key} = {value},"),
            Language::Yaml | Language::Scxml => writeln!(out, "{pad}{key}: {value}"),
        };
    }
}

/// The keys of a configuration before its changes, and those behind them.
pub fn of_configuration(
    c: &Configuration,
    language: Language,
    holds: impl FnOnce(&Condition) -> String,
) -> [Vec<WrittenKey>; 2] {
    let states = |key, of: &StateList| {
        let entries: Vec<String> = of.iter().map(|e| quoted(&format!("{}:{}", e.target, e.state), language)).collect();
        (!entries.is_empty()).then(|| (key, list(&entries, language)))
    };
    let on_failure = match c.on_failure {
        OnFailure::Unset => None,
        OnFailure::Rollback => Some("rollback"),
        OnFailure::Hold => Some("hold"),
    };
    let confirm = c.confirm.map(|confirm| {
        let keys = [("event", text(confirm.event.as_str(), language)), ("within", seconds(confirm.within))];
        table(keys, language)
    });
    let mut before: Vec<WrittenKey> = Vec::new();
    before.extend(c.description.as_ref().map(|t| ("description", quoted(t, language))));
    before.extend(c.timeout.map(|time| ("timeout", seconds(time))));
    before.extend(c.group.map(|group| ("group", text(group.as_str(), language))));
    before.extend(c.safe.then(|| ("safe", "true".to_owned())));
    before.extend(on_failure.map(|word| ("on_failure", text(word, language))));
    before.extend(c.holds.as_ref().map(|condition| ("holds", holds(condition))));
    before.extend(confirm.map(|confirm| ("confirm", confirm)));
    before.extend(c.irreversible.then(|| ("irreversible", "true".to_owned())));
    before.extend(states("pre_conf_state", &c.pre));
    [before, states("post_conf_state", &c.post).into_iter().collect()]
}

fn raised(key: &'static str, actions: &[(Action, Origin)], language: Language) -> Option<WrittenKey> {
    let one = |(action, _): &(Action, Origin)| match action {
        Action::Raise(event) => Some(*event),
        Action::Function(_) => None,
    };
    texts(actions.iter().filter_map(one), language).map(|list| (key, list))
}

pub fn of_transition(t: &ChartTransition, language: Language) -> Vec<WrittenKey> {
    let ends = [("src", &t.src), ("tgt", &t.tgt)];
    let mut fields: Vec<WrittenKey> =
        ends.into_iter().filter_map(|(key, end)| Some((key, text(&end.as_ref()?.0, language)))).collect();
    let events = t.events.iter().map(|(trigger, _)| trigger);
    let events = texts(events.filter(|trigger| !matches!(trigger, Trigger::Predicate(_))), language);
    fields.extend(events.map(|events| ("events", events)));
    fields.extend(raised("effect", &t.effect, language));
    fields.extend((t.pn != 0.0).then(|| ("pn", float(t.pn))));
    fields.extend(t.doc.as_ref().map(|doc| ("doc", quoted(doc, language))));
    fields
}

/// The keys of a state but for what is in it.
pub fn of_state(s: &State, language: Language) -> Vec<WrittenKey> {
    let mut fields: Vec<WrittenKey> = s.doc.iter().map(|doc| ("doc", quoted(doc, language))).collect();
    fields.extend(texts(s.config.iter().map(|(id, _)| id), language).map(|list| ("config", list)));
    fields.extend(raised("entry", &s.entry, language));
    fields.extend(raised("exit", &s.exit, language));
    fields
}

pub fn of_monitor(m: &Monitor, language: Language, when: String) -> Vec<WrittenKey> {
    let mut fields: Vec<WrittenKey> = m.description.iter().map(|t| ("description", quoted(t, language))).collect();
    fields.push(("when", when));
    fields.extend(m.raise.map(|raise| ("event", text(raise.as_str(), language))));
    fields.extend(m.cleared.map(|cleared| ("cleared", text(cleared.as_str(), language))));
    fields.extend(m.repeat.map(|repeat| ("repeat_every", seconds(repeat))));
    if let Sampling::Every(period) = m.sampling {
        fields.push(("every", seconds(period)));
    }
    fields.extend((!m.enabled).then(|| ("enabled", "false".to_owned())));
    fields
}
