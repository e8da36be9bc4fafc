//! What a model's tables hold beside its chart: fields that mean nothing to rFSM, and functions that are called beside those
//! of states and transitions.
//!
//! Fields of one's own are legal everywhere in rFSM. So a misspelt one is no error, and that is why it is looked for: what was
//! to be a condition or an activity is silently none.

use crate::model::finding::Origin;
use crate::model::program::AuxiliaryFunction;
use mlua::{Function, Result, Table, Value};

/// A field that means nothing where it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// What it is a field of: `a state`, `a transition`, `a connector`.
    pub of: &'static str,
    /// Its key; `[1]` for a value without one.
    pub key: String,
    /// The key that was probably meant.
    pub near: Option<&'static str>,
    /// The kind of object that a key of this name means something in.
    pub belongs: Option<&'static str>,
    /// Its place.
    pub origin: Origin,
}

/// Keys of a state, of which the first five hold functions.
const STATE: &[&str] = &["entry", "exit", "doo", "prepare", "config", "doc", "emem"];
/// Keys of a root beside those.
const ROOT: &[&str] = &["getevents", "idle_hook", "err", "warn", "info", "dbg", "pre_step_hook", "post_step_hook"];
/// Keys of a transition. `event` means nothing, and rFSM says so.
const TRANSITION: &[&str] = &["events", "guard", "effect", "likely", "src", "tgt", "pn", "doc"];
/// Keys of a connector.
const CONNECTOR: &[&str] = &["prepare", "doc"];
/// Keys that hold functions, or names to raise.
const ACTIVE: &[(&str, &str)] = &[
    ("entry", "a state"),
    ("exit", "a state"),
    ("doo", "a state"),
    ("guard", "a transition"),
    ("effect", "a transition"),
    ("events", "a transition"),
];

/// Fields that mean nothing, of every object of a machine's flat list. `place` gives places: by the number of the spot, the
/// number in the list, and a word.
pub fn fields(list: &Table, native: &Table, place: &mut super::lower::OriginLookup<'_>) -> Result<Vec<Field>> {
    let kind: Function = native.raw_get("kind")?;
    let mut found = Vec::new();
    for number in 1..=list.raw_len() {
        let row: Table = list.raw_get(number)?;
        let what: String = row.raw_get("what")?;
        let table: Table = row.raw_get("table")?;
        let spot: Option<usize> = row.raw_get("spot")?;
        let (of, known): (_, Vec<&str>) = match what.as_str() {
            "transition" => ("a transition", TRANSITION.to_vec()),
            "connector" => ("a connector", CONNECTOR.to_vec()),
            _ if number == 1 => ("a state", [STATE, ROOT].concat()),
            _ => ("a state", STATE.to_vec()),
        };
        let mut own = Vec::new();
        for pair in table.pairs::<Value, Value>() {
            let (key, value) = pair?;
            if matches!(value, Value::Table(_)) && kind.call::<Option<String>>(&value)?.is_some() {
                continue;
            }
            let (text, word) = match &key {
                Value::String(text) => (text.to_string_lossy(), true),
                other => (format!("[{}]", other.to_string().unwrap_or_default()), false),
            };
            if word && (text.starts_with('_') || known.contains(&text.as_str())) {
                continue;
            }
            own.push((text, value.is_function(), word));
        }
        // Lua's order of keys is none.
        own.sort();
        for (key, function, word) in own {
            let belongs = ACTIVE.iter().find(|(active, _)| *active == key).map(|(_, kind)| *kind);
            let near = match belongs {
                None if word => near(&key, &known, of, function),
                _ => None,
            };
            let origin = place(spot, number, if word { &key } else { "" });
            found.push(Field { of, key, near, belongs, origin });
        }
    }
    Ok(found)
}

/// The known key that was probably meant.
fn near(key: &str, known: &[&'static str], of: &str, function: bool) -> Option<&'static str> {
    if of == "a transition" && (key == "event" || close(&key.to_lowercase(), "event", false)) {
        return Some("events");
    }
    let low = key.to_lowercase();
    let decorated = |known: &str| {
        let rest = low.replacen(known, "", 1);
        known.len() >= 4 && rest != low && matches!(rest.trim_matches('_'), "on" | "do" | "fn" | "func" | "function")
    };
    let all = known.iter().copied().filter(|known| !matches!(*known, "doc" | "emem" | "err" | "dbg"));
    all.filter(|known| close(&low, known, function) || (function && decorated(known)))
        .min_by_key(|known| strsim::osa_distance(&low, known))
}

/// Whether a word is another with a slip of the finger. The shorter the word, the less: `emit` is not `exit`, nor `note`
/// anything.
fn close(word: &str, known: &str, function: bool) -> bool {
    let mut sorted = [word.chars().collect::<Vec<_>>(), known.chars().collect()];
    sorted.iter_mut().for_each(|chars| chars.sort_unstable());
    let exchanged = sorted[0] == sorted[1];
    let first = word.chars().next() == known.chars().next();
    let ends = first && word.chars().next_back() == known.chars().next_back();
    match (strsim::osa_distance(word, known), known.len()) {
        (0, _) => true,
        (1, 0..=3) => exchanged || (function && first),
        (1, 4) => exchanged || word.len() != known.len(),
        (1, _) => true,
        (2, 6..) => ends || function,
        _ => false,
    }
}

/// Functions of the root that are called beside the chart, step hooks, and what the plugin `preview` calls.
pub fn beside(
    template: &Table,
    list: &Table,
    native: &Table,
    place: &mut super::lower::OriginLookup<'_>,
) -> Result<Vec<AuxiliaryFunction>> {
    let plugin_of: Table = native.raw_get("plugin_of")?;
    let previews = native.raw_get::<Option<bool>>("previews")?.unwrap_or(false);
    let mut found: Vec<AuxiliaryFunction> = Vec::new();
    for number in 1..=list.raw_len() {
        let row: Table = list.raw_get(number)?;
        let table: Table = row.raw_get("table")?;
        let spot: Option<usize> = row.raw_get("spot")?;
        let mut add = |part: &str, plugin: Option<String>, word: &str| {
            let name = |key: &str| row.raw_get::<Option<String>>(key).ok().flatten().unwrap_or_default();
            let at = match name("what").as_str() {
                "transition" => format!("`{}` → `{}`", name("src"), name("tgt")),
                _ if number == 1 => "`root`".to_owned(),
                _ => {
                    let full = table.raw_get::<Option<String>>("_fqn").ok().flatten();
                    format!("`{}`", full.unwrap_or_else(|| name("name")))
                }
            };
            let origin = place(spot, number, word);
            found.push(AuxiliaryFunction { place: at, part: part.to_owned(), plugin, origin });
        };
        if number == 1 {
            for key in ["getevents", "idle_hook", "dbg", "err", "warn", "info"] {
                // Printers are quiet in the machine that is read, so the template is asked.
                if template.raw_get::<Value>(key)?.is_function() {
                    add(key, None, key);
                }
            }
            for (field, hooks) in [("pre_step_hook", "_pre_step_hooks"), ("post_step_hook", "_post_step_hooks")] {
                let listed = table.raw_get::<Option<Table>>(hooks)?;
                let own = listed.is_none() && table.raw_get::<Value>(field)?.is_function();
                if own {
                    add(field, None, field);
                }
                for hook in listed.iter().flat_map(|list| list.sequence_values::<Value>()) {
                    add(field, plugin_of.raw_get(hook?)?, field);
                }
            }
        }
        for key in ["prepare", "likely"] {
            if previews && table.raw_get::<Value>(key)?.is_function() {
                add(key, None, key);
            }
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_near_and_words_of_ones_own_are_not() {
        let state = |key: &str, function| near(key, STATE, "a state", function);
        let transition = |key: &str, function| near(key, TRANSITION, "a transition", function);
        for key in ["entyr", "entri", "Entry", "etnry", "entr", "enrty"] {
            assert_eq!(state(key, false), Some("entry"), "{key}");
        }
        for key in ["exti", "exist", "exi", "EXIT"] {
            assert_eq!(state(key, false), Some("exit"), "{key}");
        }
        for key in ["evnts", "evts", "event", "evnt", "Events", "eventss"] {
            assert_eq!(transition(key, false), Some("events"), "{key}");
        }
        for key in ["gaurd", "guards", "gard", "Guard"] {
            assert_eq!(transition(key, false), Some("guard"), "{key}");
        }
        assert_eq!(state("on_entry", true), Some("entry"));
        assert_eq!(state("dooo", true), Some("doo"));
        assert_eq!([transition("np", false), transition("effct", false)], [Some("pn"), Some("effect")]);
        for key in
            ["note", "name", "id", "foo", "emit", "desc", "description", "entity", "log", "color", "x", "p", "confirm"]
        {
            assert_eq!((state(key, false), transition(key, false)), (None, None), "{key}");
        }
        for key in ["helper", "update", "reset", "step", "run", "init", "check", "entry_helper"] {
            assert_eq!((state(key, true), transition(key, true)), (None, None), "{key}");
        }
    }
}
