//! Monitors: what both spellings mean.

use super::{entries, own_name};
use crate::lang::bound;
use crate::lang::grammar::MONITOR;
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::model::monitor::{Condition, ConditionKind};
use crate::model::{Finding, Ident, Monitor, Origin, codes};
use rustc_hash::FxHashMap;

/// A map of named monitors, in the order given.
pub fn monitors(cx: &mut Cx, node: Node) -> Vec<Monitor> {
    let entries = entries(cx, node, "the list of monitors", MONITOR.example);
    entries.into_iter().filter_map(|entry| monitor(cx, entry)).collect()
}

fn monitor(cx: &mut Cx, entry: Entry) -> Option<Monitor> {
    let origin = if matches!(entry.value.kind, Kind::Made(..)) { entry.value.origin } else { entry.origin };
    let id = own_name::<Ident>(cx, &entry, "a monitor's name", "aligned");
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
            cx.report(finding.at(list[0].origin).help(format!("write it like `{}`", MONITOR.example)));
            return None;
        }
        _ => {
            cx.wrong(&entry.value, "a monitor", "a table of named values", MONITOR.example);
            return None;
        }
    };
    let mut fields = Fields::new(&MONITOR, origin, entries);
    let nothing = Condition::new(ConditionKind::All(Vec::new()));
    let mut monitor = Monitor::new(id.or_else(|| Ident::new("unnamed").ok())?, nothing);
    monitor.origin = origin;
    let is_whole = bound::MONITOR.read(&mut monitor, &mut fields, cx);
    fields.finish(cx);
    if monitor.repeat.is_some() && monitor.raise.is_none() {
        let finding =
            Finding::warning(codes::MONITOR_NOTHING_REPEATED, "`repeat_every` repeats nothing: there is no `event`");
        cx.report(finding.at(origin).help("name the event that is to be repeated, or leave `repeat_every` out"));
        monitor.repeat = None;
    }
    (id.is_some() && is_whole).then_some(monitor)
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
