//! How wide text is, for boxes that hold it in whatever font the viewer has.

use crate::model::Origin;
use crate::model::statechart::Action;

/// What actions raise, in their order; of a function nothing is known.
pub fn raised(actions: &[(Action, Origin)]) -> Vec<String> {
    let name = |action: &Action| match action {
        Action::Raise(event) => event.to_string(),
        Action::Function(_) => "function".to_owned(),
    };
    actions.iter().map(|(action, _)| name(action)).collect()
}

/// Width of `text` at `size` pixels, in pixels. Measured after DejaVu Sans, the widest of the usual sans-serif fonts, so
/// that a box is never too small.
pub fn width(text: &str, size: f64) -> f64 {
    text.chars()
        .map(|c| match c {
            'i' | 'j' | 'l' | '\'' | '|' => 0.29,
            '.' | ',' | ':' | ';' | ' ' | '!' => 0.34,
            'f' | 't' | 'r' | '(' | ')' | '[' | ']' | '/' => 0.42,
            'm' | 'w' | 'M' | 'W' | '@' | '%' => 0.96,
            '→' | '≥' | '…' => 0.9,
            'A'..='Z' => 0.7,
            '_' | '-' => 0.5,
            'a'..='z' | '0'..='9' => 0.62,
            _ if c.is_ascii() => 0.7,
            _ => 0.85,
        })
        .sum::<f64>()
        * size
}

/// `text` with the characters that XML reserves written as references; control characters become blanks.
pub fn xml(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// `text` cut to `most` characters, the last of them an ellipsis.
pub fn short(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.to_owned();
    }
    let mut out: String = text.chars().take(most.saturating_sub(1)).collect();
    out.push('…');
    out
}
