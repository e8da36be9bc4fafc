//! The compiled chart: flat tables, indexed by small numbers.

use super::reactions::ReactionTable;
use super::wide::Wide;
use crate::model::finding::Origin;
use crate::model::names::{EventName, Ident};
use crate::model::statechart::FunctionId;
use crate::model::words::words;
use rustc_hash::FxHashMap;
use std::fmt;

/// A state or connector of a chart. Ids are in the order of a walk through the chart as written; the root is 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId(pub(super) u32);

impl NodeId {
    /// The outermost state.
    pub const ROOT: Self = Self(0);

    /// Its number, from 0 to `Chart::len() - 1`.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A transition of a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct EdgeId(pub(super) u32);

impl EdgeId {
    /// Its number.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// An event as a chart knows it: dense for those that some transition lists, one common id for all others from outside,
/// and one for each completion that no transition lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct EventId(pub(super) u32);

impl EventId {
    /// Any event from outside that no transition lists. It still triggers transitions that take any event.
    pub const OTHER: Self = Self(u32::MAX);
    /// The event of the first entry, when no transition lists it.
    pub(super) const INIT: Self = Self(u32::MAX - 1);
    /// No event: the completion of a leaf that no chart has room for.
    pub(super) const NEVER: Self = Self(u32::MAX - 2);
    const DONE: u32 = 1 << 31;
    const STRANGE: u32 = 1 << 30;

    /// An event that no transition lists and that a [`Hook`](super::Hook) remembers under `number` (less than 2^30).
    pub fn strange(number: u32) -> Self {
        Self(Self::STRANGE | number)
    }

    /// The number under which a hook remembers it.
    pub fn as_strange(self) -> Option<u32> {
        (self.0 < Self::DONE && self.0 & Self::STRANGE != 0).then_some(self.0 & !Self::STRANGE)
    }

    /// Its place in [`Chart::events`], when some transition lists it.
    pub fn listed(self) -> Option<usize> {
        (self.0 < Self::STRANGE).then_some(self.0 as usize)
    }

    /// The leaf whose completion it is, when no transition lists that.
    pub fn as_completion(self) -> Option<NodeId> {
        (self.0 & Self::DONE != 0 && self < Self::INIT).then_some(NodeId(self.0 & !Self::DONE))
    }

    /// The completion of `leaf`, when no transition lists it.
    pub(super) fn done(leaf: u32) -> Self {
        Self(Self::DONE | leaf)
    }
}

words! {
    /// What a node is.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub enum NodeKind by word {
        /// A state without child nodes.
        Leaf = "leaf",
        /// A state with child nodes.
        Composite = "composite",
        /// A connector.
        Connector = "connector",
    }
}

/// A piece `start..start + len` of another table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Span {
    pub start: u32,
    pub len: u32,
}

impl Span {
    pub fn of<T>(self, table: &[T]) -> &[T] {
        &table[self.start as usize..(self.start + self.len) as usize]
    }

    pub fn ids(self) -> std::ops::Range<u32> {
        self.start..self.start + self.len
    }
}

pub(super) const NONE: u32 = u32::MAX;

/// What one step needs to know of a node.
#[derive(Debug, Clone)]
pub(super) struct NodeRow {
    pub parent: u32,
    pub depth: u32,
    pub kind: NodeKind,
    /// Its outgoing transitions in the order in which they are tried.
    pub out: Span,
    pub entry: Span,
    pub exit: Span,
    /// What its completion is called (leaves).
    pub done: EventId,
    /// Its time event, or [`NONE`].
    pub timer: u32,
    pub doo: Option<FunctionId>,
    /// It is a leaf whose completion, alone in its step, is known to trigger nothing.
    pub settles: bool,
}

/// What one step needs to know of a transition.
#[derive(Debug, Clone)]
pub(super) struct EdgeRow {
    pub src: u32,
    pub tgt: u32,
    /// The least common ancestor: it is neither left nor entered.
    pub lca: u32,
    /// How many states from the root inwards stay active: those down to the least common ancestor.
    pub keep: u32,
    /// Triggered by any event.
    pub null: bool,
    /// Events that trigger it, sorted by id.
    pub events: Span,
    pub predicates: Span,
    pub guard: Option<FunctionId>,
    pub effect: Span,
}

/// One thing done by an entry, exit or effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ActionOp {
    Raise(EventName),
    /// Of a state-scoped configuration of the state that is entered or left.
    RaiseScoped(EventName),
    Call(FunctionId),
}

impl ActionOp {
    /// The state whose state-scoped configuration is asked for or taken back, at that place.
    pub fn scope(self, place: super::ActionPlace) -> Option<NodeId> {
        match (self, place) {
            (Self::RaiseScoped(_), super::ActionPlace::Entry(state) | super::ActionPlace::Exit(state)) => Some(state),
            _ => None,
        }
    }
}

/// A time event of a state.
#[derive(Debug, Clone)]
pub(super) struct TimerRow {
    /// From the entry of the state, not from the clock's start.
    pub relative: bool,
    /// Fires when more nanoseconds than this have passed.
    pub nanos: i64,
    /// Says the time, on every entry, in place of `nanos`.
    pub by: Option<FunctionId>,
    pub event: EventId,
}

/// When a name is raised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RaiseMoment {
    /// On entry of the state: by `entry`, or to push a state-scoped configuration.
    Entry(NodeId),
    /// On exit of the state: by `exit`, or to undo a state-scoped configuration.
    Exit(NodeId),
    /// By the transition's effect.
    Effect(EdgeId),
}

/// A place in the chart that raises a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RaiseSite {
    /// The name.
    pub name: EventName,
    /// When it is raised.
    pub when: RaiseMoment,
    /// It comes from a state-scoped configuration.
    pub scoped: bool,
    /// Where it was written.
    pub origin: Origin,
}

/// A compiled statechart.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    pub(super) nodes: Vec<NodeRow>,
    pub(super) edges: Vec<EdgeRow>,
    pub(super) ops: Vec<ActionOp>,
    /// Event lists of all transitions, one after the other.
    pub(super) triggers: Vec<EventId>,
    pub(super) predicates: Vec<FunctionId>,
    pub(super) timers: Vec<TimerRow>,
    pub(super) events: Vec<EventName>,
    pub(super) event_ids: FxHashMap<EventName, EventId>,
    pub(super) names: Vec<Ident>,
    pub(super) node_origins: Vec<Origin>,
    pub(super) edge_origins: Vec<Origin>,
    /// Priority numbers of all transitions: already in the order of the outgoing lists, kept for findings.
    pub(super) priorities: Vec<f64>,
    pub(super) raises: Vec<RaiseSite>,
    pub(super) children: FxHashMap<(u32, Ident), u32>,
    /// The connector at which the chart is entered.
    pub(super) initial: u32,
    /// Depth of the deepest node.
    pub(super) depth: u32,
    /// Transitions that leave connectors: bounds the tree of paths that one search can find.
    pub(super) connector_edges: u32,
    /// Neither guards nor predicates: whether a path exists then depends on the events alone.
    pub(super) unguarded: bool,
    /// No functions at all.
    pub(super) pure: bool,
    /// The event of the first entry.
    pub(super) init: EventId,
    /// What is known beforehand of what events do.
    pub(super) reactions: ReactionTable,
    /// The transitions of nodes that have many.
    pub(super) wide: Wide,
}

impl Chart {
    /// How many states and connectors it has.
    #[allow(clippy::len_without_is_empty)] // a chart has at least a root and its initial connector
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether it has no functions.
    pub fn is_pure(&self) -> bool {
        self.pure
    }

    /// All states and connectors, in order.
    pub fn nodes(&self) -> impl ExactSizeIterator<Item = NodeId> + use<> {
        (0..u32::try_from(self.nodes.len()).unwrap_or(NONE)).map(NodeId)
    }

    /// The node of that number.
    pub fn node(&self, index: usize) -> Option<NodeId> {
        u32::try_from(index).ok().filter(|_| index < self.nodes.len()).map(NodeId)
    }

    /// What a node is.
    pub fn kind(&self, node: NodeId) -> NodeKind {
        self.nodes[node.index()].kind
    }

    /// Whether a node is a state (else it is a connector).
    pub fn is_state(&self, node: NodeId) -> bool {
        self.kind(node) != NodeKind::Connector
    }

    /// The state around a node; none for the root.
    pub fn parent(&self, node: NodeId) -> Option<NodeId> {
        (node != NodeId::ROOT).then(|| NodeId(self.nodes[node.index()].parent))
    }

    /// How many states are around a node.
    pub fn depth(&self, node: NodeId) -> usize {
        self.nodes[node.index()].depth as usize
    }

    /// Whether `node` is `of`, or inside it.
    pub fn is_inside(&self, node: NodeId, of: NodeId) -> bool {
        let mut node = node.0;
        while self.nodes[node as usize].depth > self.nodes[of.index()].depth {
            node = self.nodes[node as usize].parent;
        }
        node == of.0
    }

    /// A node's own name.
    pub fn name(&self, node: NodeId) -> Ident {
        self.names[node.index()]
    }

    /// A node's full name: `root.sync.copying`.
    pub fn fqn(&self, node: NodeId) -> Fqn<'_> {
        Fqn { chart: self, node }
    }

    /// Where a node was written.
    pub fn origin(&self, node: NodeId) -> Origin {
        self.node_origins[node.index()]
    }

    /// The connector at which the chart is entered.
    pub fn initial(&self) -> NodeId {
        NodeId(self.initial)
    }

    /// A node's outgoing transitions, in the order in which they are tried.
    pub fn outgoing(&self, node: NodeId) -> impl ExactSizeIterator<Item = EdgeId> + use<> {
        self.nodes[node.index()].out.ids().map(EdgeId)
    }

    /// The number of transitions.
    pub fn edge_count(&self) -> usize {
        self.edges.len()
    }

    /// Where a transition starts and where it ends. The target of one that names a composite state is that state's
    /// initial connector.
    pub fn ends(&self, edge: EdgeId) -> (NodeId, NodeId) {
        let row = &self.edges[edge.index()];
        (NodeId(row.src), NodeId(row.tgt))
    }

    /// Whether a transition leads back to where it begins: the way into a composite state is one to its connector `initial`.
    pub fn leads_back(&self, edge: EdgeId) -> bool {
        let (source, target) = self.ends(edge);
        target == source || self.kind(target) == NodeKind::Connector && self.parent(target) == Some(source)
    }

    /// The state that a transition neither leaves nor enters.
    pub fn least_common_ancestor(&self, edge: EdgeId) -> NodeId {
        NodeId(self.edges[edge.index()].lca)
    }

    /// The events a transition lists; none: any event triggers it.
    pub fn triggers(&self, edge: EdgeId) -> Option<&[EventId]> {
        let row = &self.edges[edge.index()];
        (!row.null).then(|| row.events.of(&self.triggers))
    }

    /// Whether an event may trigger a transition alone: it lists it, takes any, or has a function that may say so.
    pub fn may_trigger(&self, edge: EdgeId, event: EventId) -> bool {
        let row = &self.edges[edge.index()];
        row.predicates.len > 0 || self.triggers(edge).is_none_or(|listed| listed.contains(&event))
    }

    /// The activity of a leaf, when it has one.
    pub fn doo(&self, leaf: NodeId) -> Option<FunctionId> {
        self.nodes[leaf.index()].doo
    }

    /// The event of the first entry.
    pub fn init_event(&self) -> EventId {
        self.init
    }

    /// Whether a function of the model decides over a transition (a guard or a predicate).
    pub fn is_guarded(&self, edge: EdgeId) -> bool {
        let row = &self.edges[edge.index()];
        row.guard.is_some() || row.predicates.len > 0
    }

    /// Where a transition was written.
    pub fn edge_origin(&self, edge: EdgeId) -> Origin {
        self.edge_origins[edge.index()]
    }

    /// The id of an event from outside.
    pub fn event(&self, name: EventName) -> EventId {
        self.event_ids.get(&name).copied().unwrap_or(EventId::OTHER)
    }

    /// All events that some transition lists, completions and time events among them (`e_done@root.a`).
    pub fn events(&self) -> &[EventName] {
        &self.events
    }

    /// The completion event of a leaf.
    pub fn completion(&self, leaf: NodeId) -> EventId {
        self.nodes[leaf.index()].done
    }

    /// Whether it waits for times.
    pub fn has_times(&self) -> bool {
        !self.timers.is_empty()
    }

    /// Whether a time of it counts from when it began (`e_at`).
    pub fn is_clocked(&self) -> bool {
        self.timers.iter().any(|timer| !timer.relative)
    }

    /// The time event of a state, where it has one.
    pub fn time_event(&self, state: NodeId) -> Option<EventId> {
        self.timers.get(self.nodes[state.index()].timer as usize).map(|timer| timer.event)
    }

    /// How long a time event takes from the entry of its state, where it takes always the same.
    pub fn time_of(&self, event: EventId) -> Option<std::time::Duration> {
        let timer = self.timers.iter().find(|timer| timer.event == event && timer.relative)?;
        u64::try_from(timer.nanos).ok().map(std::time::Duration::from_nanos)
    }

    /// The text of an event (`other` for those that the chart does not know).
    pub fn event_text(&self, event: EventId) -> String {
        match event {
            EventId::OTHER => "other".to_owned(),
            EventId::INIT => "e_init_fsm".to_owned(),
            event if event.as_strange().is_some() => "other".to_owned(),
            EventId(id) if id & EventId::DONE != 0 => format!("e_done@{}", self.fqn(NodeId(id & !EventId::DONE))),
            EventId(id) => self.events[id as usize].to_string(),
        }
    }

    /// Every place that raises a name.
    pub fn raises(&self) -> &[RaiseSite] {
        &self.raises
    }
}

/// Writes a node's full name.
#[derive(Clone, Copy)]
pub struct Fqn<'a> {
    chart: &'a Chart,
    node: NodeId,
}

impl fmt::Display for Fqn<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(parent) = self.chart.parent(self.node) {
            write!(f, "{}.", self.chart.fqn(parent))?;
        }
        f.write_str(self.chart.name(self.node).as_str())
    }
}
