//! What is legal in rFSM and was hardly meant: fields whose names are nearly known ones, and globals that nobody has set as the
//! values of fields.

use super::tokens::{KeyAgain, Token, keys_again, tokens};
use super::tree::{Cx, KEEP_ONE};
use crate::diagnostics::FileId;
use crate::functions::Field;
use crate::model::{Finding, Findings, Origin, codes};

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
    for (i, token) in tokens.iter().enumerate() {
        match token.text {
            "{" | "(" | "[" => open.push(token.text),
            "}" | ")" | "]" => _ = open.pop(),
            _ => {}
        }
        let next = tokens.get(i + 1).map(|token| token.text);
        let before = i.checked_sub(1).map(|i| tokens[i].text);
        if token.line == line
            && token.text == name
            && before == Some("=")
            && matches!(next, Some("," | ";" | "}"))
            && open.last() == Some(&"{")
        {
            return true;
        }
    }
    false
}

/// That a key stands twice in one table of a text: legal, and hardly meant.
pub fn twice(cx: &mut Cx, file: FileId, text: &str) -> Findings {
    let at = |cx: &mut Cx, token: &Token<'_>| cx.sources.exact(file, token.line, token.column, token.length);
    let again = keys_again(&tokens(text));
    let finding = |key: &KeyAgain<'_>| {
        let message = format!("`{}` stands twice in one table: the last one counts", key.key);
        warning(message, at(cx, &key.again))
            .labelled("again here")
            .also(at(cx, &key.first), "first here")
            .help(KEEP_ONE)
    };
    again.iter().map(finding).collect()
}

/// Of a text that nothing is told of by places: the first key that stands twice, with its line before it.
pub fn key_again(text: &str) -> Option<String> {
    let again = keys_again(&tokens(text)).into_iter().next()?;
    let (line, first, key) = (again.again.line, again.first.line, again.key);
    Some(format!(
        "{line}: `{key}` stands twice in one table, first on line {first}, and Lua keeps the last: {KEEP_ONE}"
    ))
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
