//! Coordinators: rFSM's constructors in Lua, and the same in YAML.
//!
//! ```yaml
//! coordinator:
//!   states:
//!     idle: {}
//!     choice: { connector: true }
//!     copying:
//!       config: enable_copying          # one or a list, like entry, exit, effect and events
//!       entry: [e_begun]
//!   transitions:
//!     - { src: initial, tgt: idle }
//!     - { src: idle, tgt: copying, events: [e_aligned], effect: e_seen, pn: 1 }
//! ```

use super::{name, own_name, text, truth};
use crate::lang::grammar::{CONNECTOR, STATE, TRANSITION};
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::limits;
use crate::model::statechart::{self, Action, ChartTransition, Connector, ROOT, State, Statechart, Trigger};
use crate::model::{ConfigId, EventName, Finding, Ident, Origin, codes};

/// Names that mean something else in a state's table, in the one language or the other.
const RESERVED: &[&str] = &["entry", "exit", "doo", "config", "doc", "type", "new", "rfsm"];

/// Fields of a root state that rFSM gives to its host: printers and hooks. They say nothing about coordination.
const HOST: &[&str] = &["err", "warn", "info", "dbg", "getevents", "idle_hook"];

/// The chart of a tree: what `state { … }` made, or YAML's map.
pub fn statechart(cx: &mut Cx, node: Node) -> Option<Statechart> {
    let root = Ident::new(ROOT).ok()?;
    let root = state(cx, root, node, 0)?;
    Some(Statechart::new(root))
}

/// A state's parts, wherever they came from.
struct StateParts {
    fields: Fields,
    children: Vec<Entry>,
    transitions: Vec<Node>,
}

fn state(cx: &mut Cx, name: Ident, node: Node, depth: usize) -> Option<State> {
    let origin = node.origin;
    if depth > limits::TEXT_DEPTH {
        let finding = Finding::error(codes::TEXT_TOO_DEEP, "states nested too deeply").at(origin);
        cx.report(finding.help("a statechart has a handful of levels"));
        return None;
    }
    let StateParts { mut fields, children, transitions } = match node.kind {
        Kind::Made("state", named, items) => of_lua(cx, origin, named, items, depth == 0),
        _ => of_yaml(cx, node)?,
    };
    let mut out = State::new(name);
    out.origin = origin;
    for entry in children {
        out.children.extend(child(cx, entry, depth));
    }
    out.transitions = transitions.into_iter().filter_map(|node| transition(cx, node)).collect();
    out.entry = actions(cx, &mut fields, "entry");
    out.exit = actions(cx, &mut fields, "exit");
    for node in fields.several(cx, "config") {
        let id = self::name::<ConfigId>(cx, &node, "`config`", fields.row("config").example);
        let place = cx.place(&node);
        out.config.extend(id.map(|id| (id, place)));
    }
    if let Some(node) = fields.take(cx, "doo") {
        function(cx, &node, "`doo`");
    }
    out.doc = fields.text(cx, "doc");
    fields.finish(cx);
    Some(out)
}

/// A Lua state: values made by `state` and `conn` are children whatever their key, by `trans` transitions whatever
/// theirs. Keys that begin with `_` are rFSM's own.
fn of_lua(cx: &mut Cx, origin: Origin, named: Vec<Entry>, items: Vec<Node>, root: bool) -> StateParts {
    let (mut children, mut transitions, mut others) = (Vec::new(), Vec::with_capacity(items.len()), Vec::new());
    for node in items {
        match &node.kind {
            Kind::Made("trans", ..) => transitions.push(node),
            Kind::Made("state" | "conn", ..) => {
                let finding = Finding::error(codes::CHART_UNNAMED, "a state without a name").at(node.origin);
                cx.report(finding.help("write `name = state { … }`"));
            }
            _ => cx.wrong(
                &node,
                "an element of a state",
                "a transition",
                "trans { src = \"a\", tgt = \"b\", events = { \"e_go\" } }",
            ),
        }
    }
    for entry in named {
        match &entry.value.kind {
            Kind::Made("state" | "conn", ..) => children.push(entry),
            Kind::Made("trans", ..) => transitions.push(entry.value),
            _ if entry.key.starts_with('_') || (root && HOST.contains(&&*entry.key)) => {}
            _ => others.push(entry),
        }
    }
    StateParts { fields: Fields::new(&STATE, origin, others), children, transitions }
}

fn of_yaml(cx: &mut Cx, node: Node) -> Option<StateParts> {
    let mut fields = Fields::of(cx, node, &STATE)?;
    let children = fields.entries(cx, "states");
    let transitions = match fields.take(cx, "transitions") {
        None => Vec::new(),
        Some(Node { kind: Kind::List(list), .. }) => list,
        Some(node) => {
            cx.wrong(&node, "`transitions`", "a list", fields.row("transitions").example);
            Vec::new()
        }
    };
    Some(StateParts { fields, children, transitions })
}

fn child(cx: &mut Cx, entry: Entry, depth: usize) -> Option<statechart::ChartNode> {
    let exact = cx.sources.is_exact(entry.origin);
    let reserved = RESERVED.contains(&&*entry.key);
    if reserved {
        let origin = cx.part(entry.origin, &entry.key);
        let finding = Finding::error(codes::CHART_RESERVED, format!("a state cannot be called `{}`", entry.key));
        cx.report(finding.at(origin).help("the word means something else in a state's table: take another name"));
    }
    let ident = own_name::<Ident>(cx, &entry, "a state's name", "idle = state {}");
    let is_connector = match &entry.value.kind {
        Kind::Made(class, ..) => *class == "conn",
        Kind::Map(entries) => entries.iter().any(|e| e.key == "connector"),
        _ => false,
    };
    let mut value = entry.value;
    if exact {
        value.origin = entry.origin;
    }
    let origin = value.origin;
    let node = if is_connector {
        let mut fields = Fields::of(cx, value, &CONNECTOR)?;
        if let Some(Entry { value: node, .. }) = fields.take_entry("connector")
            && truth(cx, &node, "`connector`", fields.row("connector").example) == Some(false)
        {
            let finding = Finding::error(codes::TEXT_BAD_VALUE, "`connector` can only be true").at(node.origin);
            cx.report(finding.help("a state is written without this key"));
        }
        let doc = fields.text(cx, "doc");
        fields.finish(cx);
        ident.map(|name| statechart::ChartNode::Connector(Connector { name, doc, origin }))
    } else {
        // Without a name its inside is still looked at, so that all findings come at once.
        let stand_in = ident.or_else(|| Ident::new("unnamed").ok())?;
        let inside = state(cx, stand_in, value, depth + 1);
        ident.and(inside).map(statechart::ChartNode::State)
    };
    node.filter(|_| !reserved)
}

fn transition(cx: &mut Cx, node: Node) -> Option<ChartTransition> {
    let origin = node.origin;
    let mut fields = match node.kind {
        Kind::Made("trans", named, items) => {
            if let Some(item) = items.first() {
                cx.wrong(item, "an element of a transition", "named", "src = \"a\", tgt = \"b\"");
            }
            let named = named.into_iter().filter(|e| !e.key.starts_with('_')).collect();
            Fields::new(&TRANSITION, origin, named)
        }
        _ => Fields::of(cx, node, &TRANSITION)?,
    };
    let mut out = ChartTransition { origin, ..ChartTransition::default() };
    out.src = reference(cx, &mut fields, "src");
    out.tgt = reference(cx, &mut fields, "tgt");
    for node in fields.several(cx, "events") {
        let (place, example) = (cx.place(&node), fields.row("events").example);
        match &node.kind {
            Kind::Str(text) => match Trigger::parse(text) {
                Ok(trigger) => out.events.push((trigger, place)),
                Err(error) => super::bad_name(cx, &node, &error, timed(text).as_deref().unwrap_or(example)),
            },
            Kind::Function => function(cx, &node, "a predicate in `events`"),
            _ => cx.wrong(&node, "an event", "a name (a text)", example),
        }
    }
    if let Some(node) = fields.take(cx, "guard") {
        function(cx, &node, "`guard`");
    }
    out.effect = actions(cx, &mut fields, "effect");
    out.pn = fields.number(cx, "pn").unwrap_or_default();
    out.doc = fields.text(cx, "doc");
    fields.finish(cx);
    Some(out)
}

/// How a time event is written that is written otherwise: with a unit, or without its brackets.
fn timed(text: &str) -> Option<String> {
    let word = ["e_after", "e_at"].into_iter().find(|word| text.starts_with(word))?;
    let rest = text[word.len()..].trim_matches(|c: char| c.is_whitespace() || "()=:".contains(c));
    Some(format!("events = {{ \"{word}({})\" }}", super::parse_time(rest)?))
}

fn reference(cx: &mut Cx, fields: &mut Fields, key: &'static str) -> Option<(String, Origin)> {
    // That it is missing is told where the chart is compiled, with what it would have to be.
    let node = fields.take_entry(key)?.value;
    let place = cx.place(&node);
    if matches!(node.kind, Kind::List(_)) {
        let message = format!("`{key}` must be one state, this is {}", node.describe());
        cx.report(Finding::error(codes::TEXT_WRONG_TYPE, message).at(place).labelled("expected a text").help(
            "write a transition for each, or put these states into one around them, and write that: a transition of a state serves for all inside",
        ));
        return None;
    }
    text(cx, &node, &format!("`{key}`"), fields.row(key).example).map(|text| (text, place))
}

/// Names to raise: one or a list.
fn actions(cx: &mut Cx, fields: &mut Fields, key: &'static str) -> Vec<(Action, Origin)> {
    let mut out = Vec::new();
    for node in fields.several(cx, key) {
        if matches!(node.kind, Kind::Function) {
            function(cx, &node, &format!("`{key}`"));
            continue;
        }
        let place = cx.place(&node);
        let event = name::<EventName>(cx, &node, &format!("`{key}`"), fields.row(key).example);
        out.extend(event.map(|event| (Action::Raise(event), place)));
    }
    out
}

/// A function in a chart: its place is known, its meaning comes later.
fn function(cx: &mut Cx, node: &Node, what: &str) {
    if !matches!(node.kind, Kind::Function) {
        cx.wrong(
            node,
            what,
            "a function (names of events stand in `entry`, `exit` and `effect`)",
            "entry = \"e_ready\"",
        );
        return;
    }
    let message = format!("{what} is a function, and a coordinator that is not trusted must be pure");
    cx.report(Finding::error(codes::CHART_FUNCTION, message).at(node.origin).labelled("in this one").help(
        "write `trusted: true` in the deployment to let it run, or raise the name of an event instead \
         (`entry = \"e_ready\"`) and let a component or a monitor do the work",
    ));
}
