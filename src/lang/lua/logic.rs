//! Lua's own `and`, `or` and `not` of conditions of monitors: `x and y` is `y`, and Lua lets nobody say otherwise. It can only
//! be seen in the text.

use super::recorder::Recorder;
use crate::lang::tokens::{Token, tokens};
use crate::lang::words;
use crate::model::{Finding, codes};

/// Reports what a text does to conditions that only `all`, `any` and `no` can do.
pub fn check(recorder: &mut Recorder, text: &str) {
    if !recorder.made.iter().any(|made| is_condition(made.verb)) {
        return;
    }
    let tokens = tokens(text);
    let named = named(&tokens);
    for (at, token) in tokens.iter().enumerate() {
        let (wrong, instead) = match token.text {
            "not" => (begins_condition(&tokens, at + 1, &named), "`no(p)`"),
            "and" => (ends_condition(&tokens, at, &named).is_some(), "`all { p, q }`"),
            // `strict and above(…) or above(…)` chooses by a parameter, and rightly.
            "or" => {
                let start = ends_condition(&tokens, at, &named);
                let chooses = start.and_then(|start| start.checked_sub(1)).is_some_and(|b| tokens[b].text == "and");
                (start.is_some() && !chooses, "`any { p, q }`")
            }
            _ => continue,
        };
        if wrong {
            let what = match token.text {
                "not" => "of a condition is always false",
                "and" => "gives the condition after it, and the one before it counts for nothing",
                _ => "gives the condition before it, and the one after it counts for nothing",
            };
            let origin = recorder.cx.sources.exact(recorder.reading.file, token.line, token.column, token.length);
            recorder.cx.report(
                Finding::error(codes::LUA_LOGIC, format!("Lua's own `{}` {what}", token.text))
                    .at(origin)
                    .help(format!("write {instead}")),
            );
        }
    }
}

fn is_condition(word: &str) -> bool {
    words::CONDITIONS.iter().any(|known| known.name == word)
}

/// Names that the text gives to conditions: `x = above(…)`.
fn named<'t>(tokens: &[Token<'t>]) -> Vec<&'t str> {
    let is_one = |at: usize| is_condition(tokens[at].text) && tokens.get(at + 1).is_some_and(|t| opens(t.text));
    (2..tokens.len()).filter(|at| tokens[at - 1].text == "=" && is_one(*at)).map(|at| tokens[at - 2].text).collect()
}

fn opens(text: &str) -> bool {
    matches!(text, "(" | "{" | "\"")
}

/// Whether a condition begins there: a name of one, or a call that makes one.
fn begins_condition(tokens: &[Token<'_>], at: usize, named: &[&str]) -> bool {
    let Some(token) = tokens.get(at) else { return false };
    let next = tokens.get(at + 1).map_or("", |token| token.text);
    named.contains(&token.text) && !matches!(next, "." | "[") || is_condition(token.text) && opens(next)
}

/// The token at which the condition begins that ends before `at`.
fn ends_condition(tokens: &[Token<'_>], at: usize, named: &[&str]) -> Option<usize> {
    let mut start = at.checked_sub(1)?;
    let before = |at: usize| at.checked_sub(1).map_or("", |at| tokens[at].text);
    loop {
        match tokens[start].text {
            ")" | "}" => {
                // Back to the word that is called.
                let mut depth = 0;
                loop {
                    match tokens[start].text {
                        ")" | "}" => depth += 1,
                        "(" | "{" => depth -= 1,
                        _ => (),
                    }
                    start = start.checked_sub(1)?;
                    if depth == 0 {
                        break;
                    }
                }
                if !is_condition(tokens[start].text) {
                    return None;
                }
                if before(start) != ":" {
                    return Some(start);
                }
                // A method: of what stands before it.
                start = start.checked_sub(2)?;
            }
            name => return (named.contains(&name) && !matches!(before(start), "." | ":")).then_some(start),
        }
    }
}
