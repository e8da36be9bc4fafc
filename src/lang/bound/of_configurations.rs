//! What configurations are written with.

use super::{Pen, WrittenValue};
use crate::lang::grammar::{CONFIRM, Key};
use crate::lang::lower::name;
use crate::lang::print::fields::{list, quoted, table, text};
use crate::lang::print::seconds;
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::model::finding::{count, did_you_mean, nearest};
use crate::model::{
    ComponentName, Confirm, DefaultTwice, Finding, OnFailure, Origin, RunState, StateEntry, StateList, Target, Wanted,
    codes,
};

/// Run states to bring components to.
impl WrittenValue for StateList {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        fields.take_entry(key).map(|entry| states(cx, entry))
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.iter().next().is_none()
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        let one = |entry: StateEntry| quoted(&format!("{}:{}", entry.target, entry.state), pen.language);
        list(&self.iter().map(one).collect::<Vec<_>>(), pen.language)
    }
}

/// What a failure leads to.
impl WrittenValue for OnFailure {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        fields.choice(cx, key, Self::WORDS)
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        *self == Self::Unset
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        let word = Self::WORDS.iter().find(|(_, of)| of == self).map_or("", |(word, _)| *word);
        text(word, pen.language)
    }
}

/// What must come after it.
impl WrittenValue for Confirm {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let node = fields.take(cx, key)?;
        let mut fields = Fields::of(cx, node, &CONFIRM)?;
        let event = fields.name(cx, "event");
        let within = fields.time(cx, "within");
        fields.finish(cx);
        Some(Self { event: event?, within: within? })
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        let keys = [("event", text(self.event.as_str(), pen.language)), ("within", seconds(self.within))];
        table(keys, pen.language)
    }
}

/// A pre- or post-state list: entries `'comp:state'`, then at most one keyed `comp = 'state'`.
fn states(cx: &mut Cx, entry: Entry) -> StateList {
    const EXAMPLE: &str = "{ 'compA:running', '_default:stopped' }";
    let list_origin = cx.part(entry.value.origin, &entry.key);
    let (list, keyed) = match entry.value.kind {
        Kind::List(list) => (list, Vec::new()),
        Kind::Mixed(list, keyed) => (list, keyed),
        Kind::Map(keyed) => (Vec::new(), keyed),
        _ => {
            cx.wrong(&entry.value, &format!("`{}`", entry.key), "a list of `component:state`", EXAMPLE);
            return StateList::default();
        }
    };
    // One key, and behind a list `_default` alone, is the paper's, and Lua's alone: elsewhere it would stand last, wherever it is written.
    let last = |keyed: &Entry| list.is_empty() || keyed.key == "_default";
    if keyed.len() > 1 || (!keyed.is_empty() && !cx.is_lua(list_origin)) || !keyed.iter().all(last) {
        let keys = keyed.iter().map(|e| match &e.value.kind {
            Kind::Str(state) => format!("'{}:{state}'", e.key),
            _ => format!("'{}:stopped'", e.key),
        });
        let texts = list.iter().filter_map(|node| match &node.kind {
            Kind::Str(text) => Some(format!("'{text}'")),
            _ => None,
        });
        let as_list: Vec<String> = keys.chain(texts).collect();
        let as_list = cx.spelt(list_origin, &format!("{{ {} }}", as_list.join(", ")));
        cx.report(
            Finding::error(
                codes::CONF_KEYED_ENTRIES,
                format!("`{}` has {}, and keys have no order", entry.key, count(keyed.len(), "keyed entry")),
            )
            .at(list_origin)
            .labelled("in which order?")
            .help(format!("write them as a list, in the order wanted: `{as_list}`")),
        );
    }
    let mut found: Vec<StateEntry> = Vec::with_capacity(list.len() + keyed.len());
    for node in list {
        let Kind::Str(text) = &node.kind else {
            cx.wrong(&node, "an entry of a state list", "a text `component:state`", EXAMPLE);
            continue;
        };
        let origin = cx.inside(list_origin, node.origin, text);
        let Some((who, state)) = text.rsplit_once(':') else {
            let example = cx.spelt(list_origin, EXAMPLE);
            cx.report(
                Finding::error(codes::CONF_BAD_STATE, format!("`{text}` does not say which state"))
                    .at(origin)
                    .help(format!("write `component:state`, as in `{example}`")),
            );
            continue;
        };
        found.extend(state_entry(cx, who.trim(), state.trim(), origin));
    }
    for entry in keyed {
        let Kind::Str(state) = &entry.value.kind else {
            cx.wrong(&entry.value, "the state of a component", "a text", "_default = 'running'");
            continue;
        };
        let origin = cx.inside(list_origin, entry.origin, &entry.key);
        found.extend(state_entry(cx, &entry.key, state, origin));
    }
    let mut out = StateList::default();
    for state in found {
        if let Err(DefaultTwice(first)) = out.push(state) {
            let finding = Finding::error(codes::DEFAULT_TWICE, format!("`_default` stands twice in `{}`", entry.key))
                .at(state.origin)
                .also(first, "first here")
                .help("it stands for every component not named in the list, so it can only have one state: keep one");
            cx.report(finding);
        }
    }
    out
}

fn state_entry(cx: &mut Cx, who: &str, state: &str, origin: Origin) -> Option<StateEntry> {
    let target = if who == "_default" {
        Some(Target::Default)
    } else {
        let node = Node::new(Kind::Str(who.into()), origin);
        name::<ComponentName>(cx, &node, "a component", "compA:running").map(Target::Component)
    };
    Some(StateEntry { target: target?, state: wanted(cx, state, origin)?, origin })
}

fn wanted(cx: &mut Cx, state: &str, origin: Origin) -> Option<Wanted> {
    let named = RunState::from_name(state);
    let wanted = named.and_then(RunState::wanted);
    if named.is_some() && wanted.is_none() {
        let finding = Finding::error(codes::FAULTED_DEMANDED, format!("no configuration can demand `{state}`"));
        let help = "components become faulted by themselves; demand `unconfigured` to bring one out of it";
        cx.report(finding.at(origin).help(help));
    } else if wanted.is_none() {
        // Our own names before the field's, which differ from them in a capital letter.
        let ours = nearest(state, RunState::NAMES[..3].iter().copied());
        let help = ours.map_or_else(
            || did_you_mean(state, "states", RunState::NAMES.iter().copied()),
            |near| format!("did you mean `{near}`?"),
        );
        cx.report(Finding::error(codes::CONF_BAD_STATE, format!("`{state}` is not a run state")).at(origin).help(help));
    }
    wanted
}
