//! Monitors: what both spellings mean.

use super::{Unit, condition, name, text, time, truth};
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::model::monitor::Sampling;
use crate::model::{EventName, Finding, Ident, Monitor, Origin, codes};
use rustc_hash::FxHashMap;

const EXAMPLE: &str = "name = monitor { when = above(\"A.x\", 2.0), event = \"e_high\" }";

/// A map of named monitors, in the order given.
pub fn monitors(cx: &mut Cx, node: Node) -> Vec<Monitor> {
    let entries = match node.kind {
        Kind::Map(entries) => entries,
        Kind::List(list) if list.is_empty() => Vec::new(),
        _ => {
            cx.wrong(&node, "the list of monitors", "a table of named values", EXAMPLE);
            return Vec::new();
        }
    };
    entries.into_iter().filter_map(|entry| monitor(cx, entry)).collect()
}

fn monitor(cx: &mut Cx, entry: Entry) -> Option<Monitor> {
    let origin = if matches!(entry.value.kind, Kind::Made(..)) { entry.value.origin } else { entry.origin };
    let key = Node::new(Kind::Str(entry.key.into()), entry.origin);
    let id = name::<Ident>(cx, &key, "a monitor's name", "aligned");
    let entries = match entry.value.kind {
        Kind::Made("monitor", mut named, list) if list.is_empty() => {
            // Lua knows the place of the whole monitor only, and a number may stand in it more than once.
            for entry in &mut named {
                if matches!(entry.value.kind, Kind::Bool(_) | Kind::Int(_) | Kind::Float(_)) {
                    entry.value.origin = cx.part(origin, &entry.key);
                }
            }
            named
        }
        Kind::Map(named) => named,
        Kind::Made("monitor", _, list) => {
            let finding = Finding::error(codes::MONITOR_ARGUMENTS, "a monitor has named parts only");
            cx.report(finding.at(list[0].origin).help(format!("write it like `{EXAMPLE}`")));
            return None;
        }
        _ => {
            cx.wrong(&entry.value, "a monitor", "a table of named values", EXAMPLE);
            return None;
        }
    };
    let mut fields = Fields::new("a monitor", origin, entries);
    let when = fields.required(cx, "when", "when = above(\"A.x\", 2.0)");
    let when = when.and_then(|node| condition::condition(cx, node, 0));
    let raise = fields.take("event");
    let raise = raise.and_then(|node| name::<EventName>(cx, &node, "`event`", "event = \"e_high\""));
    let cleared = fields.take("cleared");
    let cleared = cleared.and_then(|node| name::<EventName>(cx, &node, "`cleared`", "cleared = \"e_calm\""));
    let mut seconds = |cx: &mut Cx, key: &'static str, example: &str| {
        let node = fields.take(key)?;
        time(cx, &node, &format!("`{key}`"), Unit::Seconds, example)
    };
    let repeats = seconds(cx, "repeat_every", "repeat_every = 1.0");
    let repeat = repeats.filter(|_| raise.is_some());
    if repeats.is_some() && repeat.is_none() {
        let finding =
            Finding::warning(codes::MONITOR_NOTHING_REPEATED, "`repeat_every` repeats nothing: there is no `event`");
        cx.report(finding.at(origin).help("name the event that is to be repeated, or leave `repeat_every` out"));
    }
    let every = seconds(cx, "every", "every = 0.01");
    let enabled = fields.take("enabled").and_then(|node| truth(cx, &node, "`enabled`", "enabled = false"));
    let description = fields.take("description");
    let description = description.and_then(|node| text(cx, &node, "`description`", "description = \"what it is for\""));
    fields.finish(cx);
    Some(Monitor {
        name: id?,
        when: when?,
        raise,
        cleared,
        repeat,
        sampling: every.map_or(Sampling::OnSample, Sampling::Every),
        enabled: enabled.unwrap_or(true),
        description,
        origin,
    })
}

/// Reports monitors of the same name, and keeps the first of each.
pub fn unique(cx: &mut Cx, monitors: &mut Vec<Monitor>) {
    let mut seen: FxHashMap<Ident, Origin> = FxHashMap::default();
    monitors.retain(|m| match seen.get(&m.name) {
        None => {
            seen.insert(m.name, m.origin);
            true
        }
        Some(first) => {
            cx.report(
                Finding::error(codes::MONITOR_DUPLICATE, format!("there are two monitors `{}`", m.name))
                    .at(m.origin)
                    .labelled("again here")
                    .also(*first, "first here")
                    .help("a monitor is switched on and off by its name: give one of them another"),
            );
            false
        }
    });
}
