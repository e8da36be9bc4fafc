//! Long values over several lines: lists and tables of either language are broken where their brackets are.

/// Columns of a line before it is broken.
const WIDTH: usize = 118;

/// A value that begins at a column, its further lines no further left than `indent`.
pub fn wrap(value: &str, column: usize, indent: usize) -> String {
    let mut out = String::new();
    put(&mut out, value, column, indent);
    out
}

fn put(out: &mut String, value: &str, column: usize, indent: usize) {
    let groups = groups(value);
    let longest = groups.iter().max_by_key(|(open, close)| close - open).copied();
    let Some((open, close)) = longest.filter(|_| column + value.chars().count() > WIDTH) else {
        return out.push_str(value);
    };
    let (before, inside, after) = (&value[..=open], &value[open + 1..close], &value[close..]);
    let items = items(inside);
    out.push_str(before);
    let column = column + before.chars().count();
    match &items[..] {
        // What holds one thing is not broken itself.
        [one] => {
            let blank = inside.len() - inside.trim_start().len();
            out.push_str(&inside[..blank]);
            put(out, one, column + blank, indent);
            out.push_str(&inside[inside.trim_end().len()..]);
        }
        items => {
            for item in items {
                out.push('\n');
                out.push_str(&" ".repeat(indent + 2));
                put(out, item, indent + 2, indent + 2);
                out.push(',');
            }
            // The last comma is allowed in Lua's tables and in YAML, but not in a call of Lua.
            out.pop();
            out.push('\n');
            out.push_str(&" ".repeat(indent));
        }
    }
    out.push_str(after);
}

/// The outermost brackets of a value, by the places of the opening and the closing one.
fn groups(value: &str) -> Vec<(usize, usize)> {
    let (mut groups, mut depth, mut start) = (Vec::new(), 0_usize, 0);
    signs(value, |at, sign| match sign {
        '(' | '[' | '{' => {
            if depth == 0 {
                start = at;
            }
            depth += 1;
        }
        ')' | ']' | '}' => {
            depth = depth.saturating_sub(1);
            if depth == 0 {
                groups.push((start, at));
            }
        }
        _ => {}
    });
    groups
}

/// What stands between the commas of a list.
fn items(inside: &str) -> Vec<&str> {
    let (mut items, mut depth, mut start) = (Vec::new(), 0_usize, 0);
    signs(inside, |at, sign| match sign {
        '(' | '[' | '{' => depth += 1,
        ')' | ']' | '}' => depth = depth.saturating_sub(1),
        ',' if depth == 0 => {
            items.push(inside[start..at].trim());
            start = at + 1;
        }
        _ => {}
    });
    items.push(inside[start..].trim());
    items
}

/// Calls for every sign outside of quotes.
fn signs(text: &str, mut each: impl FnMut(usize, char)) {
    let (mut quoted, mut escaped) = (false, false);
    for (at, c) in text.char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' if quoted => escaped = true,
            '"' => quoted = !quoted,
            c if !quoted => each(at, c),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_long_values_are_broken_and_nothing_in_quotes() {
        let short = "{ gt: [a.b, 1.0] }";
        assert_eq!(wrap(short, 0, 0), short);
        let long = format!("{{ all: [{{ gt: [\"a, (b\\\"\", 1.0] }}, {}] }}", "x".repeat(110));
        let expected = format!("{{ all: [\n  {{ gt: [\"a, (b\\\"\", 1.0] }},\n  {}\n] }}", "x".repeat(110));
        assert_eq!(wrap(&long, 0, 0), expected);
        assert_eq!(wrap(&long, 10, 6).lines().nth(1), Some("        { gt: [\"a, (b\\\"\", 1.0] },"));
        let word = "x".repeat(300);
        assert_eq!(wrap(&word, 0, 0), word, "nothing to break at");
    }
}
