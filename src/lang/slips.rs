//! What is legal in rFSM and was hardly meant: fields whose names are nearly known ones, and globals that nobody has set as the
//! values of fields.

use super::tree::Cx;
use crate::functions::Field;
use crate::model::{Finding, Origin, codes};

/// The finding of a field that means nothing, if it looks like a slip.
pub fn field(field: &Field, at: Origin) -> Option<Finding> {
    let Field { of, key, near, belongs, .. } = field;
    if key == "event" && *of == "a transition" {
        let message = "`event` means nothing in a transition, so it is taken on any event";
        return Some(warning(message.to_owned(), at).labelled("not read").help("did you mean `events`?"));
    }
    if let Some(near) = near {
        let without = match (*of, *near) {
            ("a transition", "events") => ", so it is taken on any event",
            ("a transition", "guard") => ", so it is taken without a condition",
            _ => "",
        };
        let message = format!("{of} has no `{key}`: it is taken for a field of your own{without}");
        return Some(warning(message, at).labelled("not read").help(format!("did you mean `{near}`?")));
    }
    let belongs = belongs.filter(|kind| kind != of)?;
    let message = format!("`{key}` means nothing in {of}");
    Some(warning(message, at).labelled("not read").help(format!("it is a key of {belongs}: write it there")))
}

fn warning(message: String, at: Origin) -> Finding {
    Finding::warning(codes::CHART_SLIP, message).at(at)
}

/// The finding of a global that nobody has set, if it stands as the whole value of a field in that line of the text.
pub fn unset(cx: &mut Cx, line_at: Origin, text: &str, line: u32, name: &str) -> Option<Finding> {
    if !is_value(text, line, name) {
        return None;
    }
    let at = cx.sources.within(line_at, name);
    let message = format!("nobody has set `{name}`, so this field is nil: as if it was not there");
    Some(warning(message, at).labelled("not set").help(format!(
        "quote it if it is the name of an event (`\"{name}\"`), or define it before, here or in a file of the host"
    )))
}

/// Whether a name stands in that line as `= name` with `,`, `;` or `}` after it, in a table.
fn is_value(text: &str, line: u32, name: &str) -> bool {
    let tokens = tokens(text);
    let mut open: Vec<&str> = Vec::new();
    for (i, (token, at)) in tokens.iter().enumerate() {
        match *token {
            "{" | "(" | "[" => open.push(token),
            "}" | ")" | "]" => _ = open.pop(),
            _ => {}
        }
        let next = tokens.get(i + 1).map(|(token, _)| *token);
        let before = i.checked_sub(1).map(|i| tokens[i].0);
        if *at == line
            && *token == name
            && before == Some("=")
            && matches!(next, Some("," | ";" | "}"))
            && open.last() == Some(&"{")
        {
            return true;
        }
    }
    false
}

/// The words and signs of a Lua text with their lines, without texts and comments.
fn tokens(text: &str) -> Vec<(&str, u32)> {
    let bytes = text.as_bytes();
    let (mut out, mut at, mut line) = (Vec::new(), 0, 1);
    while at < bytes.len() {
        let start = at;
        at += match bytes[at] {
            b'-' if bytes.get(at + 1) == Some(&b'-') => match long(&text[at + 2..]) {
                Some(length) => length + 2,
                None => text[at..].find('\n').unwrap_or(text.len() - at),
            },
            b'[' if long(&text[at..]).is_some() => long(&text[at..]).unwrap_or(1),
            quote @ (b'"' | b'\'') => short(&bytes[at..], quote),
            b if b.is_ascii_alphanumeric() || b == b'_' => {
                let word = |b: &&u8| b.is_ascii_alphanumeric() || **b == b'_';
                let length = bytes[at..].iter().take_while(word).count();
                out.push((&text[at..at + length], line));
                length
            }
            // `==`, `~=`, `<=` and `>=` are no assignments.
            b'=' | b'~' | b'<' | b'>' if bytes.get(at + 1) == Some(&b'=') => 2,
            b if b.is_ascii_punctuation() => {
                out.push((&text[at..=at], line));
                1
            }
            _ => 1,
        };
        at = at.min(bytes.len());
        line += u32::try_from(bytes[start..at].iter().filter(|b| **b == b'\n').count()).unwrap_or(0);
    }
    out
}

/// The length of a text in long brackets (`[[…]]`, `[=[…]=]`) that begins here.
fn long(text: &str) -> Option<usize> {
    let level = text.strip_prefix('[')?.bytes().take_while(|b| *b == b'=').count();
    text[level + 1..].strip_prefix('[')?;
    let close = format!("]{}]", "=".repeat(level));
    Some(text.find(&close).map_or(text.len(), |end| end + close.len()))
}

/// The length of a quoted text.
fn short(bytes: &[u8], quote: u8) -> usize {
    let mut at = 1;
    while at < bytes.len() && bytes[at] != quote && bytes[at] != b'\n' {
        at += if bytes[at] == b'\\' { 2 } else { 1 };
    }
    (at + 1).min(bytes.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_whole_value_of_a_field_counts() {
        for text in
            ["f{ entry = do_it }", "f{ entry=do_it, }", "f{\n['a'] = do_it -- why\n}", "f{ a = \"}\", b = do_it; }"]
        {
            let line = if text.contains('\n') { 2 } else { 1 };
            assert!(is_value(text, line, "do_it"), "{text}");
        }
        for text in [
            "local x = do_it",
            "local a, b = do_it, 1",
            "f{ entry = do_it or g }",
            "f{ entry = do_it() }",
            "f{ entry = do_it.x }",
            "f{ do_it }",
            "f{ a == do_it }",
            "f{ a = 'x = do_it, ' }",
            "f{ --[[ entry = do_it, ]] }",
            "f{ [==[ ]] x = do_it, ]==] }",
            "f(a, { g(x, do_it) })",
        ] {
            assert!(!is_value(text, 1, "do_it"), "{text}");
        }
        assert!(!is_value("f{ entry = do_it }", 2, "do_it"), "another line");
        assert!(is_value("s = 'ü' f{ e = do_it }", 1, "do_it") && !is_value("'", 1, "x") && !is_value("[[", 1, "x"));
    }
}
