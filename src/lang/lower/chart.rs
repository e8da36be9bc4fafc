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

use super::{own_name, truth};
use crate::lang::bound::{self, function};
use crate::lang::grammar::{CONNECTOR, STATE, TRANSITION};
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::limits;
use crate::model::statechart::{self, ChartTransition, Connector, ROOT, State, Statechart};
use crate::model::{Finding, Ident, Origin, codes};

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
    bound::STATE.read(&mut out, &mut fields, cx);
    if let Some(node) = fields.take(cx, "doo") {
        function(cx, &node, "`doo`");
    }
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
        let mut connector = Connector { name: ident.or_else(|| Ident::new("unnamed").ok())?, doc: None, origin };
        bound::CONNECTOR.read(&mut connector, &mut fields, cx);
        fields.finish(cx);
        ident.map(|_| statechart::ChartNode::Connector(connector))
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
    bound::TRANSITION.read(&mut out, &mut fields, cx);
    if let Some(node) = fields.take(cx, "guard") {
        function(cx, &node, "`guard`");
    }
    fields.finish(cx);
    Some(out)
}
