//! Finding tokens in a text: how far a Lua call reaches, and where a word stands in it.

use super::tokens::{LuaToken, next_token};
use std::ops::Range;

/// From the start of `span` (a name that is called) to the bracket that closes the call, with `:undo(…)` after it.
pub fn balanced(text: &str, span: Range<usize>) -> Range<usize> {
    let bytes = text.as_bytes();
    let (mut at, mut depth, mut end) = (span.end, 0_usize, span.end);
    while let Some((token, kind)) = next_token(bytes, at) {
        match kind {
            LuaToken::Open => depth += 1,
            LuaToken::Close if depth <= 1 => {
                end = token.end;
                match next_token(bytes, end) {
                    Some((next, LuaToken::Other)) if bytes[next.start] == b':' => depth = 0,
                    _ => break,
                }
            }
            LuaToken::Close => depth -= 1,
            LuaToken::Other if depth == 0 && !matches!(bytes[token.start], b':' | b'.') => break,
            _ => {}
        }
        at = token.end;
        if depth > 0 {
            end = at;
        }
    }
    span.start..end.max(span.end)
}

/// Every name `word` in a range.
pub fn names<'t>(text: &'t str, range: Range<usize>, word: &'t str) -> impl Iterator<Item = Range<usize>> + 't {
    let bytes = text.as_bytes().get(..range.end).unwrap_or_default();
    let mut at = range.start;
    std::iter::from_fn(move || {
        let (token, kind) = next_token(bytes, at)?;
        at = token.end;
        Some((token, kind))
    })
    .filter(move |(token, kind)| *kind == LuaToken::Name && &bytes[token.clone()] == word.as_bytes())
    .filter(move |(token, _)| text.get(token.clone()).is_some())
    .map(|(token, _)| token)
}

/// The first token in a range that is `word`: a name, or a string with that content; else one in which it stands as a word.
pub fn find(text: &str, range: Range<usize>, word: &str) -> Option<Range<usize>> {
    if word.is_empty() {
        return None;
    }
    let bytes = text.as_bytes().get(..range.end)?;
    let mut at = range.start;
    let mut part = None;
    while let Some((token, kind)) = next_token(bytes, at) {
        at = token.end;
        let content = match kind {
            LuaToken::Name => token.clone(),
            LuaToken::Text(content) => content,
            _ => continue,
        };
        if text.get(content.clone()) == Some(word) {
            return Some(token).filter(|span| text.get(span.clone()).is_some());
        }
        part = part.or_else(|| find_word(text, content, word));
    }
    // Words that are no token of Lua (`youbot.setControlMode`, unquoted in YAML).
    part.or_else(|| find_word(text, range, word))
}

/// The first place in a range where `word` stands by itself, and is no piece of a longer name.
fn find_word(text: &str, range: Range<usize>, word: &str) -> Option<Range<usize>> {
    let inside = text.get(range.clone())?;
    // A number is no part of another one: there is no 0 in 0.0.
    let number = word.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-');
    let named = |c: char| c.is_alphanumeric() || c == '_' || number && c == '.';
    let (first, last) = (word.starts_with(named), word.ends_with(named));
    let alone = |at: &usize| {
        let (before, after) = (&inside[..*at], &inside[at + word.len()..]);
        !(first && before.ends_with(named) || last && after.starts_with(named))
    };
    let found = inside.match_indices(word).map(|(at, _)| at).find(alone)?;
    Some(range.start + found..range.start + found + word.len())
}

/// The first place in a range where `word` is all that stands there: neither `run.word` nor `word.x` nor `word/x`.
pub fn find_alone(text: &str, range: Range<usize>, word: &str) -> Option<Range<usize>> {
    let mut from = range.start;
    while let Some(found) = find_word(text, from..range.end, word) {
        let joined = |c: char| matches!(c, '.' | '/');
        if !text[..found.start].ends_with(joined) && !text[found.end..].starts_with(joined) {
            return Some(found);
        }
        from = found.end;
    }
    None
}

/// The first name in a range that begins with the path `head`: what a subsystem exports, as it is written where it is used (`head.speed`),
/// or the beginning of a name that is put together (`"head/" .. how`).
pub fn find_member(text: &str, range: Range<usize>, head: &str) -> Option<Range<usize>> {
    let found = ['.', '/'].iter().find_map(|mark| find_word(text, range.clone(), &format!("{head}{mark}")))?;
    let rest = &text[found.end..range.end];
    let length = rest.find(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '.'))).unwrap_or(rest.len());
    Some(found.start..found.end + length)
}

/// The token `word` of a line where it is read: neither a field of something (`a.word`) nor a key that is given a value (`word = …`).
pub fn find_read(text: &str, line: Range<usize>, word: &str) -> Option<Range<usize>> {
    let bytes = text.as_bytes().get(..line.end)?;
    let mut at = line.start;
    while let Some((token, kind)) = next_token(bytes, at) {
        at = token.end;
        if kind != LuaToken::Name || text.get(token.clone()) != Some(word) {
            continue;
        }
        let (before, after) = (text[line.start..token.start].trim_end(), text[token.end..line.end].trim_start());
        let given = after.starts_with('=') && !after.starts_with("==");
        let field = before.ends_with(['.', ':']) && !before.ends_with("..");
        if !given && !field {
            return Some(token);
        }
    }
    None
}

/// The token `word` of the element that begins on a line, which may be written over several: outside of what is made inside it
/// (`name = state { … }`), since that is an element of its own.
pub fn find_in_element(text: &str, line: Range<usize>, word: &str) -> Option<Range<usize>> {
    let bytes = text.as_bytes();
    let (mut at, mut named) = (line.start, false);
    // Of each bracket that is open, whether it belongs to something made inside.
    let mut open: Vec<bool> = Vec::new();
    while let Some((token, kind)) = next_token(bytes, at) {
        if open.is_empty() && token.start >= line.end {
            break;
        }
        at = token.end;
        let inside = open.last().copied().unwrap_or(false);
        match kind {
            LuaToken::Open => open.push(inside || (named && !open.is_empty())),
            LuaToken::Close => _ = open.pop(),
            LuaToken::Name | LuaToken::Text(_) if !inside => {
                let content = if let LuaToken::Text(content) = &kind { content.clone() } else { token.clone() };
                if text.get(content) == Some(word) {
                    return Some(token).filter(|span| text.get(span.clone()).is_some());
                }
            }
            _ => {}
        }
        named = kind == LuaToken::Name;
    }
    None
}

/// After a key was found: the bytes of its value (`key = { … }`), else what remains.
pub fn reach_of_key(text: &str, key: &Range<usize>, end: usize) -> Range<usize> {
    let bytes = text.as_bytes().get(..end).unwrap_or_default();
    match next_token(bytes, key.end) {
        Some((equals, LuaToken::Other)) if bytes[equals.start] == b'=' => match next_token(bytes, equals.end) {
            Some((open, LuaToken::Open)) => {
                let value = balanced(text, open.start..open.start);
                value.start..value.end.min(end)
            }
            Some((value, _)) => value,
            None => key.end..end,
        },
        _ => key.clone(),
    }
}

/// The end of the word that starts at `at`: to the next blank or bracket, at least one character.
pub fn token_end(text: &str, at: usize) -> usize {
    let rest = &text[at..];
    let first = rest.chars().next().map_or(0, |c| if c == '\n' { 0 } else { c.len_utf8() });
    let length = rest
        .find(|c: char| c.is_whitespace() || matches!(c, ',' | '(' | ')' | '{' | '}' | '[' | ']'))
        .unwrap_or(rest.len());
    at + length.max(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_is_no_part_of_another_one() {
        let text = "set(\"a.b\", 0.0), timeout = 0, k = 10.5";
        assert_eq!(find_word(text, 0..text.len(), "0"), text.rfind("= 0,").map(|at| at + 2..at + 3));
        assert_eq!(find_word(text, 0..text.len(), "5"), None);
    }

    #[test]
    fn calls_end_where_they_close() {
        let text = "f(\")\", [[)]], --[[ ) ]] { g() }):undo('x') , h()";
        assert_eq!(&text[balanced(text, 0..1)], "f(\")\", [[)]], --[[ ) ]] { g() }):undo('x')");
        assert_eq!(balanced("f", 0..1), 0..1);
        assert_eq!(balanced("f(((", 0..1), 0..4);
        assert_eq!(&"f 'x', y"[balanced("f 'x', y", 0..1)], "f");
    }

    #[test]
    fn a_piece_of_a_longer_name_is_no_word() {
        let text = "connect('P.left_speed', 'left.spede', bus = bus, a.bus), run.undo, undo";
        let found = |span: Option<Range<usize>>| span.map(|span| (span.start, text[span].to_owned()));
        let at = |part: &str, word: &str| Some((text.find(part).unwrap(), word.to_owned()));
        let all = 0..text.len();
        assert_eq!(found(find(text, all.clone(), "left")), at("left.s", "left"));
        assert_eq!(found(find(text, all.clone(), "spe")), None);
        assert_eq!(found(find_member(text, all.clone(), "left")), at("left.s", "left.spede"));
        assert_eq!(find_member("tgt = 'left', 'left/' .. how", 0..28, "left"), Some(15..20));
        assert_eq!(found(find_read(text, all.clone(), "bus")), at("bus, a", "bus"));
        assert_eq!(found(find_alone(text, all, "undo")), Some((text.len() - 4, "undo".to_owned())));
    }

    #[test]
    fn never_panics_on_any_cut() {
        let (text, tail) = ("é = { 'ü\\", "--[==[ x ]=] \"ö");
        let text = format!("{text}{tail}");
        for (i, _) in text.char_indices() {
            let all = i..text.len();
            let _ = (balanced(&text, i..i), find(&text, all.clone(), "x"), token_end(&text, i));
            let _ =
                (find_read(&text, all.clone(), "x"), find_alone(&text, all.clone(), "x"), find_member(&text, all, "x"));
        }
    }
}
