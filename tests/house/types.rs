//! One name, one type: also of types that stand inside a macro or a module of a file.

use super::{code_lines, sources};
use std::collections::BTreeMap;

const TYPES: &[&str] = &["struct", "enum", "trait", "type", "union"];

/// Names that several types may have: each a file's own, in the same place of its room.
const MANY: &[(&str, &str)] = &[("Args", "what a command line may say: one of each command, and seen by no other")];

/// What a block holds, by what stands before it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Inside {
    /// Types that others see: a file, a module, a macro.
    Seen,
    /// None that anybody else sees: a function, an implementation (whose types are parts of a trait's), tests.
    Hidden,
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

fn inside(header: &str, around: Inside) -> Inside {
    let is_hidden = words(header).any(|word| ["fn", "impl", "trait"].contains(&word)) || header.contains("mod tests");
    if is_hidden { Inside::Hidden } else { around }
}

/// The types of a source that others see.
fn types(text: &str) -> Vec<String> {
    let code = code_lines(text).join("\n").replace("'{'", "' '").replace("'}'", "' '");
    let (mut around, mut here) = (Vec::new(), Inside::Seen);
    let mut found = Vec::new();
    // What stands before a brace or a semicolon, since the last one.
    let mut header = String::new();
    for c in code.chars() {
        if !matches!(c, '{' | '}' | ';') {
            header.push(c);
            continue;
        }
        if here == Inside::Seen && c != '}' {
            found.extend(declared(&header));
        }
        match c {
            '{' => {
                around.push(here);
                here = inside(&header, here);
            }
            '}' => here = around.pop().expect("braces come in pairs"),
            _ => {}
        }
        header.clear();
    }
    found
}

/// The type that a header declares: behind attributes and who sees it, the first word says so.
fn declared(header: &str) -> Option<String> {
    let mut rest = header.trim();
    loop {
        rest = match rest {
            _ if rest.starts_with("#[") => {
                rest[2..].trim_start_matches(|c| c != ']').trim_start_matches(']').trim_start()
            }
            _ if rest.starts_with("pub(") => rest.split_once(')')?.1.trim_start(),
            _ if rest.starts_with("pub ") => rest[4..].trim_start(),
            _ if rest.starts_with("unsafe ") => rest[7..].trim_start(),
            _ => break,
        }
    }
    let (what, rest) = rest.split_once(' ')?;
    // That of a macro has the name that it is given.
    let name = TYPES.contains(&what).then(|| rest.trim_start()).filter(|rest| !rest.starts_with('$'))?;
    words(name).next().map(str::to_owned)
}

#[test]
fn one_name_is_one_type() {
    let mut names: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (file, text) in sources("src").into_iter().filter(|(file, _)| !file.contains("/tests")) {
        types(&text).into_iter().for_each(|name| names.entry(name).or_default().push(file.clone()));
    }
    assert!(names.len() > 500, "the sources were not understood: {} types", names.len());
    let several: Vec<String> = (names.iter())
        .filter(|(name, files)| files.len() > 1 && MANY.iter().all(|(many, _)| many != name))
        .map(|(name, files)| format!("`{name}` is in {}: give the newest a name of its own", files.join(", ")))
        .collect();
    assert!(several.is_empty(), "names of several types:\n{}", several.join("\n"));
}

#[test]
fn the_reader_of_types_reads() {
    let text = "pub(super) struct A<'a>(&'a u8);\nwords! {\n    /// B.\n    #[derive(Debug)]\n    pub enum B by word { X = \"x\" }\n}\n\
                macro_rules! m { ($t:ty) => { enum C {} struct $t; }; }\nmod inner { pub trait D { type Not; } }\n\
                fn f() -> u8 { struct Not; 1 }\nimpl D for A<'_> { type Not = u8; }\nmod tests { struct Not; }\n\
                pub type E = u8;";
    assert_eq!(types(text), ["A", "B", "C", "D", "E"]);
}
