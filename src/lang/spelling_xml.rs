//! Examples for a coordinator in SCXML: states and transitions as its elements, what they have as attributes and what stands inside them. What only
//! configurations and monitors have is written in other files.

use super::example::{ExampleEntry, ExampleValue, parse, told};
use crate::model::statechart::INITIAL;

/// A text with examples of Lua in it, between backticks, as it is told of a file in SCXML.
pub fn told_in_scxml(text: &str) -> String {
    told(text, as_scxml)
}

/// An example of Lua as SCXML spells it; none: it is of no statechart.
fn as_scxml(example: &str) -> Option<String> {
    match &parse(example)?[..] {
        [(Some(name), ExampleValue::Call(word, inside))] if word == "state" => state(name, inside),
        [(None, ExampleValue::Call(word, parts))] if word == "trans" || word == "transition" => transition(parts),
        [(None, _)] => None,
        parts => {
            let spelt: Option<Vec<String>> = parts.iter().map(part).collect();
            Some(spelt?.join(" "))
        }
    }
}

fn state(name: &str, inside: &[ExampleEntry]) -> Option<String> {
    let Parts { attributes, content } = Parts::of(inside)?;
    Some(element("state", &format!(" id=\"{name}\"{attributes}"), &content))
}

/// With the state around it that it leads from.
fn transition(parts: &[ExampleEntry]) -> Option<String> {
    let is_source = |part: &&ExampleEntry| part.0.as_deref() == Some("src");
    let others: Vec<&ExampleEntry> = parts.iter().filter(|part| !is_source(part)).collect();
    let Parts { attributes, content } = Parts::of(others)?;
    let own = element("transition", &attributes, &content);
    Some(match parts.iter().find(is_source) {
        None => own,
        Some((_, source)) => match plain(source)? {
            INITIAL => element("initial", "", &own),
            source => element("state", &format!(" id=\"{source}\""), &own),
        },
    })
}

/// What is inside an element's first tag, and what between that and its last.
#[derive(Default)]
struct Parts {
    attributes: String,
    content: String,
}

impl Parts {
    fn of<'e>(parts: impl IntoIterator<Item = &'e ExampleEntry>) -> Option<Self> {
        let mut all = Self::default();
        for entry in parts {
            match entry {
                (None, ExampleValue::Name(rest)) if rest == "…" => all.content.push('…'),
                (Some(_), ExampleValue::Call(..)) => all.content.push_str(&part(entry)?),
                (Some(key), _) if matches!(key.as_str(), "entry" | "exit" | "effect") => {
                    all.content.push_str(&part(entry)?)
                }
                _ => {
                    all.attributes.push(' ');
                    all.attributes.push_str(&part(entry)?);
                }
            }
        }
        Some(all)
    }
}

/// One key with its value.
fn part((key, value): &ExampleEntry) -> Option<String> {
    let raised = || Some(format!("<send event=\"{}\" target=\"#_parent\"/>", plain(value)?));
    Some(match (key.as_deref()?, value) {
        (name, ExampleValue::Call(word, inside)) if word == "state" => return state(name, inside),
        ("src", value) if plain(value)? == INITIAL => "<initial>".to_owned(),
        ("src", value) => format!("<state id=\"{}\">", plain(value)?),
        ("tgt", value) => format!("target=\"{}\"", plain(value)?),
        ("events", ExampleValue::Table(events)) => {
            let names: Option<Vec<&str>> = events.iter().map(|(_, event)| plain(event)).collect();
            format!("event=\"{}\"", names?.join(" "))
        }
        ("events", value) => format!("event=\"{}\"", plain(value)?),
        ("entry", _) => element("onentry", "", &raised()?),
        ("exit", _) => element("onexit", "", &raised()?),
        ("effect", _) => raised()?,
        ("config", value) => format!("davit:config=\"{}\"", plain(value)?),
        ("pn", value) => format!("davit:pn=\"{}\"", plain(value)?),
        _ => return None,
    })
}

fn element(name: &str, attributes: &str, content: &str) -> String {
    match content {
        "" => format!("<{name}{attributes}/>"),
        _ => format!("<{name}{attributes}>{content}</{name}>"),
    }
}

fn plain(value: &ExampleValue) -> Option<&str> {
    match value {
        ExampleValue::Name(text) | ExampleValue::Text(text) => Some(text),
        ExampleValue::Table(_) | ExampleValue::Call(..) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_of_a_statechart_is_told_in_scxml_and_nothing_else_is() {
        for (lua, xml) in [
            ("`trans { src = \"initial\", tgt = … }`", "`<initial><transition target=\"…\"/></initial>`"),
            (
                "`trans { src = \"a\", tgt = \"b\", events = { \"e_go\", \"e_on\" } }`",
                "`<state id=\"a\"><transition target=\"b\" event=\"e_go e_on\"/></state>`",
            ),
            (
                "`trans { tgt = \"b\", effect = \"c\" }`",
                "`<transition target=\"b\"><send event=\"c\" target=\"#_parent\"/></transition>`",
            ),
            ("write `name = state { … }`", "write `<state id=\"name\">…</state>`"),
            ("`idle = state {}`", "`<state id=\"idle\"/>`"),
            ("a transition with `src = \"initial\"` in `a`", "a transition with `<initial>` in `a`"),
            ("`entry = \"arm\"`", "`<onentry><send event=\"arm\" target=\"#_parent\"/></onentry>`"),
            ("`config = \"arm\"` of a state", "`davit:config=\"arm\"` of a state"),
        ] {
            assert_eq!(told_in_scxml(lua), xml);
        }
        for same in ["`timeout = 0.5`", "`safe = true`", "`above(\"A.x\", 2.0)`", "`e_after(1.0)`", "tgt = \"x\""] {
            assert_eq!(told_in_scxml(same), same);
        }
    }
}
