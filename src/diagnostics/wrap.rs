//! Where lines of text may be broken: at blanks, and not inside a name or a command in backticks, which is copied from there.

use textwrap::core::Word;
use textwrap::{Options, WordSeparator, WordSplitter};

/// What stands in backticks and is longer than this may be broken all the same.
const TOGETHER: usize = 32;

/// Lines are broken between these words, and nowhere else unless one is longer than a line.
pub const SEPARATOR: WordSeparator = WordSeparator::Custom(words);

/// `text` in lines of at most `columns`, each behind `indent` blanks; its own line breaks stay.
pub fn wrapped(text: &str, columns: usize, indent: usize) -> String {
    let indent = " ".repeat(indent);
    let options = Options::new(columns)
        .initial_indent(&indent)
        .subsequent_indent(&indent)
        .break_words(false)
        .wrap_algorithm(textwrap::WrapAlgorithm::FirstFit)
        .word_splitter(WordSplitter::NoHyphenation)
        .word_separator(SEPARATOR);
    text.lines().map(|line| textwrap::fill(line.trim(), &options).trim_end().to_owned() + "\n").collect()
}

fn words(line: &str) -> Box<dyn Iterator<Item = Word<'_>> + '_> {
    let mut from = 0;
    Box::new(std::iter::from_fn(move || {
        let rest = &line[from..];
        let end = word_end(rest)?;
        from += end;
        Some(Word::from(&rest[..end]))
    }))
}

/// How much of a text its first word takes, with the blanks behind it; none: nothing is left.
fn word_end(text: &str) -> Option<usize> {
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        at += c.len_utf8();
        match c {
            ' ' => return Some(at + text[at..].len() - text[at..].trim_start_matches(' ').len()),
            '`' => {
                let closes = text[at..].char_indices().take(TOGETHER + 1).find(|(_, c)| *c == '`');
                at += closes.map_or(0, |(closes, _)| closes + 1);
            }
            _ => {}
        }
    }
    (at > 0).then_some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(text: &str) -> Vec<&str> {
        words(text).map(|word| word.word).collect()
    }

    #[test]
    fn what_stands_in_backticks_stays_together_unless_it_is_long() {
        assert_eq!(split("say `davit undo ID`, or  not"), ["say", "`davit undo ID`,", "or", "not"]);
        assert_eq!(split("`left/e_start` is odd: ` and on"), ["`left/e_start`", "is", "odd:", "`", "and", "on"]);
        let long = format!("`{} x`", "é".repeat(TOGETHER));
        assert_eq!(split(&long).len(), 2);
        assert_eq!(split(""), [""; 0]);
        assert_eq!(wrapped("ask for `a b c` now\n\nthen", 12, 2), "  ask for\n  `a b c`\n  now\n\n  then\n");
    }
}
