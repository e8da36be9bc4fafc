//! What a Lua text is made of, where only the text tells: Lua itself forgets which keys stood in a table, and lets nobody say what its own
//! `and` does.

use crate::diagnostics::{LuaToken, next_token};
use rustc_hash::FxHashMap;

/// A word, a sign, or a text in quotes.
#[derive(Debug, Clone, Copy)]
pub struct Token<'t> {
    /// The word or the sign; of a text `"`.
    pub text: &'t str,
    /// What stands in the quotes, as it is written; else nothing.
    pub inside: &'t str,
    /// From 1.
    pub line: u32,
    /// In characters, from 0.
    pub column: u32,
    /// In characters, with its quotes.
    pub length: u32,
}

/// Signs of two characters that hold one of `=`: no assignments.
const COMPARISONS: [&str; 4] = ["==", "~=", "<=", ">="];

/// All of a text, without comments and blanks.
pub fn tokens(text: &str) -> Vec<Token<'_>> {
    let mut tokens = Vec::new();
    let (mut at, mut counted, mut line, mut column) = (0, 0, 1, 0);
    while let Some((mut range, kind)) = next_token(text.as_bytes(), at) {
        if kind == LuaToken::Other {
            let rest = &text[range.start..];
            let sign = COMPARISONS.into_iter().find(|sign| rest.starts_with(sign)).map(str::len);
            range.end = range.start + sign.or_else(|| rest.chars().next().map(char::len_utf8)).unwrap_or(1);
        }
        for c in text[counted..range.start].chars() {
            (line, column) = if c == '\n' { (line + 1, 0) } else { (line, column + 1) };
        }
        let length = u32::try_from(text[range.clone()].chars().count()).unwrap_or(u32::MAX);
        (counted, at) = (range.start, range.end);
        let (text, inside) = match kind {
            LuaToken::Text(content) => ("\"", &text[content]),
            _ => (&text[range], ""),
        };
        tokens.push(Token { text, inside, line, column, length });
    }
    tokens
}

/// A key that stands in a table, and once more.
#[derive(Debug, Clone, Copy)]
pub struct KeyAgain<'t> {
    /// The key.
    pub key: &'t str,
    /// Where it stands first.
    pub first: Token<'t>,
    /// Where it stands again.
    pub again: Token<'t>,
}

/// What is open at a place of a text.
enum Enclosing<'t> {
    /// A table, with the keys that were there already.
    Table(FxHashMap<&'t str, Token<'t>>),
    /// Brackets, or what ends with `end` or `until`: an assignment there is none of a table's keys.
    Other,
}

/// The keys that stand in one table several times, of which Lua keeps the last. Keys that are worked out are not known.
pub fn keys_again<'t>(tokens: &[Token<'t>]) -> Vec<KeyAgain<'t>> {
    let (mut open, mut found): (Vec<Enclosing<'_>>, _) = (Vec::new(), Vec::new());
    let mut begins = false;
    for (at, token) in tokens.iter().enumerate() {
        if begins
            && let Some(Enclosing::Table(keys)) = open.last_mut()
            && let Some((key, place)) = key(&tokens[at..])
        {
            match keys.get(key) {
                Some(first) => found.push(KeyAgain { key, first: *first, again: place }),
                None => _ = keys.insert(key, place),
            }
        }
        match token.text {
            "{" => open.push(Enclosing::Table(FxHashMap::default())),
            "(" | "[" | "function" | "if" | "do" | "repeat" => open.push(Enclosing::Other),
            "}" | ")" | "]" | "end" | "until" => _ = open.pop(),
            _ => {}
        }
        begins = matches!(token.text, "{" | "," | ";");
    }
    found
}

/// The key that begins there: `key =`, `["key"] =`.
fn key<'t>(tokens: &[Token<'t>]) -> Option<(&'t str, Token<'t>)> {
    match tokens {
        [word, equals, ..] if equals.text == "=" && word.text != "\"" => Some((word.text, *word)),
        [opens, text, closes, equals, ..]
            if (opens.text, closes.text, equals.text) == ("[", "]", "=")
                && text.text == "\""
                && !text.inside.contains('\\') =>
        {
            Some((text.inside, *text))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn again(text: &str) -> Vec<(&str, u32, u32)> {
        keys_again(&tokens(text)).iter().map(|found| (found.key, found.first.line, found.again.line)).collect()
    }

    #[test]
    fn keys_of_one_table_that_stand_again_are_found_and_no_others() {
        assert_eq!(again("f{ a = 1,\n b = 2;\n a = 3,\n ['a'] = 4 }"), [("a", 1, 3), ("a", 1, 4)]);
        assert_eq!(
            again("x = { up = state {},\n down = state { entry = { 'a', 'b' }, },\n up = state {}, }"),
            [("up", 1, 3)]
        );
        assert_eq!(again("f{ g = function() if x then return { a = 1 } end end, h = 1,\n g = 2 }"), [("g", 1, 2)]);
        assert_eq!(again("f{ [\"a b\"] = 1, [ [[a b]] ] = 2 }"), [("a b", 1, 1)]);
        for text in [
            "f{ a = { a = 1 }, b = { a = 1 } }",
            "a = 1 a = 2 local t = {} t.a = 1, t.a == 2",
            "f{ g = function() x = 1; x = 2 end, x = 3 }",
            "f{ g = function() for i = 1, 2 do local i = 1; i = 2 end repeat j = 1; j = 2 until j == 2 end }",
            "f{ a = b == c, b = a ~= c, c = a <= b }",
            "f{ '}', a = 1, [[ a = 2, ]], --[[ a = 3, ]] b = 1, \"a = 4, \" }",
            "f{ s = 'it reads \\z\n  on, s = 1' }",
            "f{ a = 'b\\\r\n, a = 1, a = 2' }",
            "f{ [a] = 1, [a] = 2, [1] = 2, [1] = 3 }",
            "f{ g(a, b), a = 1, b = g(a, { b = 2 }) }",
            "} ) end a = 1, a = 2",
            "{ , , a = 'no end\n, a",
        ] {
            assert_eq!(again(text), [], "{text}");
        }
    }

    #[test]
    fn places_count_characters() {
        let text = "f{ 'ü', b = 1,\n  [\"bü\"] = 2 }";
        let all = tokens(text);
        let find = |inside: &str| all.iter().find(|token| token.inside == inside).unwrap();
        assert_eq!((find("ü").line, find("ü").column, find("ü").length), (1, 3, 3));
        assert_eq!((find("bü").line, find("bü").column, find("bü").length), (2, 3, 4));
    }
}
