//! What a Lua text is made of.

use std::ops::Range;

/// A token of Lua, as far as anybody here needs it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LuaToken {
    /// A name or a word of the language.
    Name,
    /// A string with the range of its content.
    Text(Range<usize>),
    /// An opening bracket.
    Open,
    /// A closing one.
    Close,
    /// Any other byte.
    Other,
}

/// Length of a long bracket's opening (`[[`, `[==[`) at `at`, with its level.
fn long_bracket(text: &[u8], at: usize) -> Option<(usize, usize)> {
    let level = text.get(at + 1..)?.iter().take_while(|b| **b == b'=').count();
    (text.get(at) == Some(&b'[') && text.get(at + 1 + level) == Some(&b'[')).then_some((level + 2, level))
}

/// The end of the content of a long bracket, and the end of the bracket.
fn long_end(text: &[u8], from: usize, level: usize) -> (usize, usize) {
    let mut at = from;
    while at < text.len() {
        if text[at] != b']' {
            at += 1;
            continue;
        }
        let equals = text[at + 1..].iter().take_while(|b| **b == b'=').count();
        let after = at + 1 + equals;
        if equals == level && text.get(after) == Some(&b']') {
            return (at, after + 1);
        }
        // The next one that may close it comes behind these.
        at = after;
    }
    (text.len(), text.len())
}

/// The length of what stands at the beginning of a piece of a text in quotes: a byte, or an escape that could hide how it goes on.
fn escape(text: &[u8]) -> usize {
    match text {
        // It takes all blanks after it along, and the ends of lines.
        [b'\\', b'z', rest @ ..] => 2 + rest.iter().take_while(|byte| byte.is_ascii_whitespace()).count(),
        [b'\\', b'\r', b'\n', ..] => 3,
        [b'\\', _, ..] => 2,
        _ => 1,
    }
}

/// The next token at or after `at`, with its bytes; none at the end. Comments are skipped.
pub fn next_token(text: &[u8], mut at: usize) -> Option<(Range<usize>, LuaToken)> {
    loop {
        let byte = *text.get(at)?;
        if byte.is_ascii_whitespace() {
            at += 1;
        } else if text[at..].starts_with(b"--") {
            at = match long_bracket(text, at + 2) {
                Some((length, level)) => long_end(text, at + 2 + length, level).1,
                None => text[at..].iter().position(|b| *b == b'\n').map_or(text.len(), |n| at + n),
            };
        } else if byte.is_ascii_alphabetic() || byte == b'_' {
            let length = text[at..].iter().take_while(|b| b.is_ascii_alphanumeric() || **b == b'_').count();
            return Some((at..at + length, LuaToken::Name));
        } else if byte == b'"' || byte == b'\'' {
            let mut end = at + 1;
            while end < text.len() && text[end] != byte && text[end] != b'\n' {
                end += escape(&text[end..]);
            }
            let end = end.min(text.len());
            return Some((at..(end + 1).min(text.len()), LuaToken::Text(at + 1..end)));
        } else if let Some((length, level)) = long_bracket(text, at) {
            let (content, end) = long_end(text, at + length, level);
            return Some((at..end, LuaToken::Text(at + length..content)));
        } else {
            let token = match byte {
                b'(' | b'{' | b'[' => LuaToken::Open,
                b')' | b'}' | b']' => LuaToken::Close,
                _ => LuaToken::Other,
            };
            return Some((at..at + 1, token));
        }
    }
}
