//! How far an element of YAML reaches, of which only the beginning is known: a key with its value, an element of a list.

use std::ops::Range;

/// From `start` to the end of what begins there: in brackets up to the comma or bracket that ends it, else over the lines that are indented
/// further.
pub fn reach(text: &str, start: usize) -> Range<usize> {
    let bytes = text.as_bytes();
    let line = text[..start].rfind('\n').map_or(0, |at| at + 1);
    // The first key of an element of a list is where that element begins.
    let before = &text[line..start];
    let dash = before.bytes().all(|byte| matches!(byte, b' ' | b'-')).then(|| before.rfind('-')).flatten();
    let column = dash.unwrap_or(start - line);
    let in_brackets = bytes[line..start].iter().fold(0_i32, |depth, byte| depth + bracket(*byte)) > 0;
    let (mut at, mut depth, mut end) = (start, 0_i32, start);
    while let Some(byte) = bytes.get(at).copied() {
        let begins = at == start || matches!(bytes[at - 1], b' ' | b'\n' | b'[' | b'{' | b',');
        match byte {
            b'\'' | b'"' if begins => at = quoted(bytes, at),
            b'#' if begins => at += bytes[at..].iter().take_while(|byte| **byte != b'\n').count() - 1,
            b',' if depth == 0 && in_brackets => break,
            b'\n' if depth == 0 && !goes_on(&bytes[at + 1..], column, dash.is_none()) => break,
            _ => {
                depth += bracket(byte);
                if depth < 0 {
                    break;
                }
            }
        }
        at += 1;
        if !byte.is_ascii_whitespace() && byte != b'#' {
            end = at;
        }
    }
    start..end.min(text.len())
}

fn bracket(byte: u8) -> i32 {
    match byte {
        b'[' | b'{' => 1,
        b']' | b'}' => -1,
        _ => 0,
    }
}

/// The closing quote of what is quoted from `at` on; where there is none, the last byte.
fn quoted(bytes: &[u8], at: usize) -> usize {
    let quote = bytes[at];
    let mut i = at + 1;
    while i < bytes.len() && bytes[i] != quote {
        i += if quote == b'"' && bytes[i] == b'\\' { 2 } else { 1 };
    }
    i.min(bytes.len() - 1)
}

/// Whether the next line that has something on it belongs to what begins in `column`: it is indented further, or where that can have one, an element of
/// its list.
fn goes_on(rest: &[u8], column: usize, has_list: bool) -> bool {
    for line in rest.split(|byte| *byte == b'\n') {
        let indent = line.iter().take_while(|byte| **byte == b' ').count();
        match line.get(indent..).unwrap_or_default() {
            [] | [b'\r'] | [b'#', ..] => {}
            own => return indent > column || indent == column && has_list && own.starts_with(b"- "),
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_reaches_to_the_end_of_its_value() {
        let text =
            "a:\n  b: { c: [1, 2], d: 'x, }' } # }\n  e:\n  - f: 1\n    g: \"h\n# no\ni\"\n\n  j: don't, k\nl: 2\n";
        for (from, wanted) in [
            ("c:", "c: [1, 2]"),
            ("d:", "d: 'x, }'"),
            ("1,", "1"),
            ("b:", "b: { c: [1, 2], d: 'x, }' }"),
            ("e:", "e:\n  - f: 1\n    g: \"h\n# no\ni\""),
            ("f:", "f: 1\n    g: \"h\n# no\ni\""),
            ("j:", "j: don't, k"),
            ("l:", "l: 2"),
        ] {
            assert_eq!(&text[reach(text, text.find(from).unwrap())], wanted, "{from}");
        }
    }

    #[test]
    fn any_cut_of_any_text_has_an_end() {
        let text = "é: [ 'ü, { x: \"\\";
        for (at, _) in text.char_indices() {
            assert!(text.get(reach(text, at)).is_some());
        }
        assert_eq!(reach("", 0), 0..0);
    }
}
