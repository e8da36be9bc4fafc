//! Where one more change has to be known: the table of `ARCHITECTURE.md` against the sources.

use super::{code_lines, root, sources};
use std::collections::{BTreeMap, BTreeSet};

/// A row of the table: who finds the file for a primitive, and for what is made of primitives; empty: it knows none of them.
struct Found {
    primitive: String,
    made: String,
}

/// The section `One more change`, file by file.
fn listed() -> BTreeMap<String, Found> {
    let text = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md is there");
    let section = text.split("## One more change").nth(1).expect("ARCHITECTURE.md has a section `One more change`");
    let rows = section.lines().skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|'));
    let rows = rows.filter_map(|line| {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let [file, _, primitive, made] = cells[..] else { panic!("four columns: {line}") };
        let file = file.strip_prefix('`')?.trim_end_matches('`');
        Some((format!("src/{file}"), Found { primitive: primitive.to_owned(), made: made.to_owned() }))
    });
    rows.collect()
}

/// The code of the sources, without their tests.
fn code() -> impl Iterator<Item = (String, String)> {
    sources("src").into_iter().filter(|(file, _)| !file.contains("/tests")).map(|(file, text)| {
        let own = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
        (file, code_lines(own).join("\n"))
    })
}

/// The patterns of each `match` in `code`: what stands before its arrows, without conditions.
fn matches(code: &str) -> Vec<Vec<String>> {
    let starts = code
        .match_indices("match ")
        .filter(|(at, _)| !code[..*at].chars().last().is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '.'));
    starts.filter_map(|(at, _)| patterns(&code[at + "match ".len()..])).collect()
}

/// The patterns of one `match`, from what is behind its word; none: it is no `match`.
fn patterns(text: &str) -> Option<Vec<String>> {
    let (mut depth, mut inside, mut begin) = (0_usize, false, 0);
    let (mut patterns, mut in_arm) = (Vec::new(), false);
    for (at, c) in text.char_indices() {
        // What is looked at has no braces.
        if !inside {
            match c {
                '{' => (inside, begin) = (true, at + 1),
                ';' => return None,
                _ => {}
            }
            continue;
        }
        match c {
            '{' | '(' | '[' => depth += 1,
            '}' if depth == 0 => return Some(patterns),
            '}' | ')' | ']' => {
                depth -= 1;
                // A block ends its arm, with or without a comma.
                if depth == 0 && in_arm && c == '}' && is_next_a_pattern(&text[at + 1..]) {
                    (in_arm, begin) = (false, at + 1);
                }
            }
            ',' if depth == 0 => (in_arm, begin) = (false, at + 1),
            '>' if depth == 0 && !in_arm && text[..at].ends_with('=') => {
                let pattern = &text[begin..at - 1];
                let pattern = pattern.split(" if ").next().unwrap_or_default();
                patterns.push(pattern.trim_start_matches([',', ' ', '\n']).trim_end().to_owned());
                in_arm = true;
            }
            _ => {}
        }
    }
    None
}

/// Whether what follows a block is the next arm, and no method called on it.
fn is_next_a_pattern(rest: &str) -> bool {
    !matches!(rest.trim_start().chars().next(), Some('.' | '?' | ',' | '=' | '&' | '|'))
}

/// The values of an enum, from the file in which it is.
fn values(file: &str, of: &str) -> Vec<String> {
    let text = std::fs::read_to_string(root().join(file)).expect("the file is there");
    let code = code_lines(&text).join("\n");
    let body = code.split(&format!("pub enum {of} {{\n")).nth(1).and_then(|rest| rest.split("\n}").next());
    let lines = body.unwrap_or_else(|| panic!("{file} has no `{of}`")).lines();
    let named = lines.filter_map(|line| line.strip_prefix("    ").filter(|line| line.starts_with(char::is_uppercase)));
    named.map(|line| line.chars().take_while(|c| c.is_alphanumeric()).collect()).collect()
}

/// The files that match on all values of an enum, with no pattern for the rest.
fn exhaustive(file: &str, of: &str) -> BTreeSet<String> {
    let values = values(file, of);
    assert!(values.len() > 6, "`{of}` was not understood: {values:?}");
    let is_rest = |pattern: &String| {
        pattern.chars().all(|c| c.is_lowercase() || c == '_' || c.is_ascii_digit()) && !pattern.is_empty()
    };
    let names = |file_is: &str, patterns: &[String], value: &String| {
        // A value is named by its enum, by the short name that it is used under, or, in its own file, as `Self`.
        let own = file_is == file;
        let short = ["K", of].map(|name| format!("{name}::{value}"));
        let named = |pattern: &str, name: &str| {
            pattern.match_indices(name).any(|(at, _)| {
                let before = pattern[..at].chars().last();
                let after = pattern[at + name.len()..].chars().next();
                let is_word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
                !is_word(before) && !is_word(after)
            })
        };
        let itself = format!("Self::{value}");
        patterns.iter().any(|pattern| short.iter().any(|name| named(pattern, name)) || own && named(pattern, &itself))
    };
    let all = |file_is: &str, patterns: &Vec<String>| {
        !patterns.iter().any(is_rest) && values.iter().all(|value| names(file_is, patterns, value))
    };
    code()
        .filter(|(file, code)| matches(code).iter().any(|patterns| all(file, patterns)))
        .map(|(file, _)| file)
        .collect()
}

/// The files of the table of which one of its columns says this.
fn said(by: &str, column: impl Fn(&Found) -> &str) -> BTreeSet<String> {
    listed().into_iter().filter(|(_, found)| column(found) == by).map(|(file, _)| file).collect()
}

#[test]
fn the_compiler_names_what_the_table_says() {
    let changes = exhaustive("src/model/configuration.rs", "ChangeKind");
    let steps = exhaustive("src/model/step.rs", "Step");
    assert_eq!(
        said("compiler", |found| &found.made),
        changes,
        "what the compiler names of a change made of primitives"
    );
    let both: BTreeSet<String> = changes.union(&steps).cloned().collect();
    assert_eq!(said("compiler", |found| &found.primitive), both, "what the compiler names of a primitive");
}

/// What no compiler names is there, and knows the changes: a primitive by its word or its step, and `replace`, wherever it is known.
#[test]
fn what_is_found_by_hand_is_listed() {
    let code: BTreeMap<String, String> = code().collect();
    let texts: BTreeMap<String, String> = sources("src").into_iter().collect();
    for file in said("by hand", |found| &found.primitive) {
        let text = texts.get(&file).unwrap_or_else(|| panic!("ARCHITECTURE.md: there is no {file}"));
        assert!(text.contains("Step::PortWrite") || text.contains("\"port_write\""), "{file} knows no primitive");
    }
    let compiler = said("compiler", |found| &found.made);
    let mut by_hand = said("by hand", |found| &found.made);
    assert!(by_hand.remove("src/lang/grammar/configuration.rs"), "a row is where every change begins");
    let known: BTreeSet<String> = (code.into_iter())
        .filter(|(file, code)| code.contains("ChangeKind::Replace") && !compiler.contains(file))
        .map(|(file, _)| file)
        .collect();
    assert_eq!(by_hand, known, "where `replace` is known, and no compiler says so");
}

#[test]
fn the_section_says_how_many() {
    let count = |column: fn(&Found) -> &str| listed().values().filter(|found| !column(found).is_empty()).count();
    assert_eq!(
        [count(|found| &found.primitive), count(|found| &found.made)],
        [15, 14],
        "fifteen and fourteen, it says"
    );
}

#[test]
fn the_reader_of_matches_reads() {
    let code = "match step {\n    Step::A { x } if x > 1 => f(x),\n    Step::B(_) | Step::C => {\n        match y { 1 => {} _ => \
                {} }\n    }\n    other => g(other),\n}";
    let found = matches(code);
    assert_eq!(found[0], ["Step::A { x }", "Step::B(_) | Step::C", "other"]);
    assert_eq!(found[1], ["1", "_"]);
}
