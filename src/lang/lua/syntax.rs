//! A text that is no Lua: what Lua says of it, and what was meant where a word of Lua is misspelt.

use crate::diagnostics::{FileId, SourceMap};
use crate::lang::tokens::tokens;
use crate::model::finding::nearest;
use crate::model::{Finding, codes};

/// Words of Lua behind which a name may stand, or before one.
const WORDS: [&str; 8] = ["return", "local", "function", "for", "while", "if", "elseif", "until"];

/// What Lua says of a text that it cannot read, with the line where it knows one.
pub fn not_lua(sources: &mut SourceMap, file: FileId, line: Option<u32>, message: &str) -> Finding {
    let at = match line {
        Some(line) => sources.exact_line(file, line),
        None => sources.whole_file(file),
    };
    let finding = Finding::error(codes::TEXT_SYNTAX, format!("this is not Lua: {message}")).at(at);
    match line.and_then(|line| misspelt(&sources.file(file).text, line, message)) {
        Some((written, meant)) => {
            let at = sources.within(at, &written);
            finding.at(at).labelled("is no word of Lua").help(format!("did you mean `{meant}`?"))
        }
        None => finding.help("see what stands just before this place: a comma, a bracket or an `end` may be missing"),
    }
}

/// The first word of a line, where Lua cannot read the name behind it and it is nearly a word of Lua.
fn misspelt(text: &str, line: u32, message: &str) -> Option<(String, &'static str)> {
    let line = text.lines().nth(line.checked_sub(1)? as usize)?;
    let of_line = tokens(line);
    let [first, second, ..] = of_line.as_slice() else { return None };
    let word = |text: &str| text.starts_with(|c: char| c.is_ascii_alphabetic());
    let meant = message.contains(&format!("near '{}'", second.text)) && word(first.text) && word(second.text);
    let near = nearest(first.text, WORDS).filter(|_| meant)?;
    Some((first.text.to_owned(), WORDS.into_iter().find(|word| *word == near)?))
}
