//! Names of a Lua text that nothing in it declares, found before it runs: Lua itself only finds those that it comes to.
//!
//! Told only where there is no doubt: a name counts as declared in the whole text where it is a local, a parameter, a loop's or a function's name,
//! or is assigned to anywhere; and a text that goes about its globals itself (`_G`, `_ENV`) is left alone.

use super::tokens::{Token, tokens};
use crate::model::finding::nearest;
use rustc_hash::FxHashSet;

/// Lua's own words.
const KEYWORDS: [&str; 22] = [
    "and", "break", "do", "else", "elseif", "end", "false", "for", "function", "goto", "if", "in", "local", "nil",
    "not", "or", "repeat", "return", "then", "true", "until", "while",
];

/// A name that nothing declares, where it stands first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnknownName {
    /// The name.
    pub name: String,
    /// From 1.
    pub line: u32,
    /// In characters, from 0.
    pub column: u32,
    /// In characters.
    pub length: u32,
    /// The name that the text declares and that may be meant.
    pub near: Option<String>,
}

/// The names that are read and not declared, each once, in the order of the text. `known`: those that are there before it runs.
pub fn unknown_names(text: &str, known: impl Fn(&str) -> bool) -> Vec<UnknownName> {
    let all = tokens(text);
    let declared = declared(&all);
    if all.iter().any(|token| matches!(token.text, "_G" | "_ENV")) {
        return Vec::new();
    }
    let mut told = FxHashSet::default();
    let mut found = Vec::new();
    for (at, token) in all.iter().enumerate() {
        let unknown = is_name(token) && is_read(&all, at) && !declared.contains(token.text) && !known(token.text);
        if unknown && told.insert(token.text) {
            let Token { text, line, column, length, .. } = *token;
            let mut own: Vec<&str> = declared.iter().copied().collect();
            own.sort_unstable();
            let near = nearest(text, own).map(str::to_owned);
            found.push(UnknownName { name: text.to_owned(), line, column, length, near });
        }
    }
    found
}

fn is_name(token: &Token<'_>) -> bool {
    token.text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') && !KEYWORDS.contains(&token.text)
}

/// Whether a name is none of a member, a method, a label, a key of a table or what is assigned to.
fn is_read(all: &[Token<'_>], at: usize) -> bool {
    let before = |n: usize| at.checked_sub(n).map_or("", |at| all[at].text);
    // `a .. b` joins two values; `a.b` and `a:b` are members.
    let member = before(1) == ":" || before(1) == "." && before(2) != ".";
    // `1e6`, `0x1F`: a number comes in pieces.
    let touches = |last: &Token<'_>| (last.line, last.column + last.length) == (all[at].line, all[at].column);
    let last = at.checked_sub(1).map(|at| &all[at]);
    let number = last.is_some_and(|last| touches(last) && last.text.starts_with(|c: char| c.is_ascii_digit()));
    let attribute = before(1) == "<" && matches!(all[at].text, "const" | "close");
    !member && !number && !attribute && before(1) != "goto" && all.get(at + 1).is_none_or(|next| next.text != "=")
}

/// Of each token whether it stands in a table itself, and not in a function there: what stands before `=` is a key then, and no name.
fn in_tables(all: &[Token<'_>]) -> Vec<bool> {
    // Of what is open whether it is a table.
    let mut open: Vec<bool> = Vec::new();
    let of = |token: &Token<'_>| {
        match token.text {
            "{" => open.push(true),
            // `while` and `for` are open from their `do` on.
            "if" | "do" | "function" | "repeat" => open.push(false),
            "}" | "end" | "until" => _ = open.pop(),
            _ => {}
        }
        open.last() == Some(&true)
    };
    all.iter().map(of).collect()
}

/// All names that the text declares somewhere.
fn declared<'t>(all: &[Token<'t>]) -> FxHashSet<&'t str> {
    let mut declared = FxHashSet::default();
    let in_table = in_tables(all);
    let names = |from: usize, until: &[&str]| {
        let list = all[from..].iter().take_while(|token| !until.contains(&token.text));
        list.filter(|token| is_name(token)).map(|token| token.text).collect::<Vec<_>>()
    };
    for (at, token) in all.iter().enumerate() {
        match token.text {
            "for" => declared.extend(names(at + 1, &["=", "in"])),
            "function" => {
                // Its name, where it has one: `f`, the first of `a.b:c`.
                declared.extend(all.get(at + 1).filter(|token| is_name(token)).map(|token| token.text));
                let opens = all[at..].iter().position(|token| token.text == "(").unwrap_or(0);
                declared.extend(names(at + opens, &[")"]));
            }
            "local" => {
                let mut next = at + 1;
                while let Some(name) = all.get(next).filter(|token| is_name(token)) {
                    declared.insert(name.text);
                    // An attribute stands behind its name: `<const>`.
                    let attribute = all.get(next + 1).is_some_and(|token| token.text == "<");
                    next += if attribute { 4 } else { 1 };
                    if all.get(next).is_none_or(|token| token.text != ",") {
                        break;
                    }
                    next += 1;
                }
            }
            "=" if !in_table[at] => {
                // `a, b = …`
                let mut last = at;
                while let Some(name) = last.checked_sub(1).map(|at| all[at]).filter(is_name) {
                    declared.insert(name.text);
                    match last.checked_sub(2) {
                        Some(comma) if all[comma].text == "," => last = comma,
                        _ => break,
                    }
                }
            }
            _ => {}
        }
    }
    declared
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unknown(text: &str) -> Vec<(String, u32, u32)> {
        let known = |name: &str| matches!(name, "say" | "ipairs" | "string");
        unknown_names(text, known).into_iter().map(|one| (one.name, one.line, one.column)).collect()
    }

    #[test]
    fn names_that_nothing_declares_are_found_once() {
        assert_eq!(
            unknown("say('a')\n  rasie(\"e\") rasie('e')\nsay(x .. y)"),
            [("rasie".to_owned(), 2, 2), ("x".to_owned(), 3, 4), ("y".to_owned(), 3, 9),]
        );
        // What stands before a key of a table is a value.
        assert_eq!(unknown("say{ far, key = 1 }"), [("far".to_owned(), 1, 5)]);
        assert_eq!(unknown("say(far, { near, key = 1 })").len(), 2);
        let near = |text| unknown_names(text, |name| name == "say").remove(0).near;
        assert_eq!(near("local limit = 1 say(limti)"), Some("limit".to_owned()));
        assert_eq!(near("local limit = 1 say(other)"), None);
    }

    #[test]
    fn whatever_is_declared_somewhere_is_none_of_them() {
        for text in [
            "local a, b <const>, c <close> = 1, 2, 3 say(a + b + c)",
            "local function f(x, y, ...) return x + y + select end select = 1 f()",
            "function t.f(x) return x end t = {} t.u = t.v t:w()",
            "a, b = 1, 2 say(a, b)",
            "local t = { f = function() if t then a, b = 1, 2 end for i = 1, 2 do c, d = i, i end return a + b + c + d end, key = 1 }",
            "say{ function() repeat a, b = 1, 2 until a while b do b, c = a, b end return c end, key = 1 }",
            "for i, v in ipairs{ 1, 2 } do say(i + v) end for k = 1, 2 do say(k) end",
            "local t = { key = 1, ['other'] = 2 } say(t.key, string.format('%d', 3))",
            "do goto on end ::on:: say('it')",
            "local f = function(one) return one end say(f(0x1F, 1e5))",
            "_G.x = 1 say(x)",
            "-- rasie()\n--[[ rasie() ]] say([[rasie()]])",
        ] {
            assert!(unknown(text).is_empty(), "{text}: {:?}", unknown(text));
        }
    }
}
