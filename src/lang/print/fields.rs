//! What both languages write as keys with values.

use super::{lua, yaml};
use crate::diagnostics::Language;
use crate::lang::bound::WrittenKey;
use crate::model::Value;
use std::fmt::Write as _;

/// A text in quotes where the language wants them.
pub fn text(t: &str, language: Language) -> String {
    match language {
        Language::Lua => lua::quoted(t),
        Language::Yaml | Language::Scxml => yaml::text(t),
    }
}

/// A text in quotes.
pub fn quoted(t: &str, language: Language) -> String {
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

/// A value.
pub fn value(v: &Value, language: Language) -> String {
    match language {
        Language::Lua => lua::value(v),
        Language::Yaml | Language::Scxml => yaml::value(v),
    }
}

/// A list of what is printed already.
pub fn list(items: &[String], language: Language) -> String {
    match language {
        Language::Lua => format!("{{ {} }}", items.join(", ")),
        Language::Yaml | Language::Scxml => format!("[{}]", items.join(", ")),
    }
}

/// Each as a text.
pub fn texts<T: ToString>(all: impl IntoIterator<Item = T>, language: Language) -> Vec<String> {
    all.into_iter().map(|one| text(&one.to_string(), language)).collect()
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
pub fn lines(out: &mut String, pad: &str, fields: &[WrittenKey], language: Language) {
    for (key, value) in fields {
        _ = match language {
            Language::Lua => writeln!(out, "{pad}{key} = {value},"),
            Language::Yaml | Language::Scxml => writeln!(out, "{pad}{key}: {value}"),
        };
    }
}

/// The keys before that one, and it with those behind it: what is no key in this language stands between them.
pub fn around<'k>(keys: &'k [WrittenKey], behind: &str) -> (&'k [WrittenKey], &'k [WrittenKey]) {
    keys.split_at(keys.iter().position(|(key, _)| *key == behind).unwrap_or(keys.len()))
}
