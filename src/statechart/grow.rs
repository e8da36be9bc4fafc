//! A chart that grows while it runs (`docs/rfsm.md` §8, `fsm_merge`).
//!
//! Only models with functions do that. What there is keeps its number, so a machine goes on with what it had: a new state
//! or transition stands at the end of its table. The outgoing transitions of a node stand side by side, so with a new one
//! all of them move to the end; the rows they leave are read by nobody who begins to look after that.

use super::chart::{ActionOp, Chart, EdgeId, EdgeRow, EventId, NONE, NodeId, NodeKind, NodeRow, Span};
use super::reactions::ReactionTable;
use super::wide::Wide;
use crate::limits;
use crate::model::finding::Origin;
use crate::model::names::{EventName, Ident};
use crate::model::statechart::{Action, ChartNode, ChartTransition, FunctionId, State, Trigger};

/// Why something cannot be added to a chart.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotGrown {
    /// The parent is a connector.
    #[error("`{0}` is a connector, and only states have something in them")]
    InConnector(String),
    /// The parent has an activity, and only leaves have one.
    #[error("`{0}` has a `doo`, and only states without one have something in them")]
    InActivity(String),
    /// A child of that name is there.
    #[error("`{0}` has a child `{1}` already")]
    Twice(String, Ident),
    /// A state with states in it.
    #[error("`{0}` has states in it, and only a single one can be added")]
    Composite(Ident),
    /// A transition from the root or to it.
    #[error("nothing leads out of the root, and nothing leads to it")]
    Root,
    /// Time events are set up when a machine is made.
    #[error("a time event cannot be added to a machine that runs")]
    Timed,
    /// It is large or deep enough.
    #[error("the chart has no room for more")]
    Full,
}

/// Something to be added, with functions counted from 0: those of the chart go before.
#[derive(Debug)]
pub struct Addition<'a, T> {
    /// What is added.
    pub what: &'a T,
    /// How many functions the machine has.
    pub functions: u32,
}

impl<T> Clone for Addition<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Addition<'_, T> {}

impl<T> Addition<'_, T> {
    fn function(&self, id: FunctionId) -> FunctionId {
        FunctionId(id.0.saturating_add(self.functions))
    }
}

impl Chart {
    /// Adds a leaf or a connector to a state. A leaf that gets something into it goes on as one: it can be entered for
    /// itself and completes then, as in rFSM, which asks only once what is a leaf.
    ///
    /// # Errors
    /// [`NotGrown`]; the chart is as before.
    pub fn add_node(&mut self, parent: NodeId, node: Addition<'_, ChartNode>) -> Result<NodeId, NotGrown> {
        let around = &self.nodes[parent.index()];
        let depth = around.depth + 1;
        let name = node.what.name();
        if around.kind == NodeKind::Connector {
            return Err(NotGrown::InConnector(self.fqn(parent).to_string()));
        }
        if around.doo.is_some() {
            return Err(NotGrown::InActivity(self.fqn(parent).to_string()));
        }
        if self.children.contains_key(&(parent.0, name)) {
            return Err(NotGrown::Twice(self.fqn(parent).to_string(), name));
        }
        if self.nodes.len() >= limits::TEXT_NODES || depth as usize > limits::CHART_DEPTH {
            return Err(NotGrown::Full);
        }
        let state = match node.what {
            ChartNode::State(state) if !state.children.is_empty() || !state.transitions.is_empty() => {
                return Err(NotGrown::Composite(name));
            }
            ChartNode::State(state) => Some(Addition { what: state, functions: node.functions }),
            ChartNode::Connector(_) => None,
        };
        let id = length(&self.nodes);
        let kind = if state.is_some() { NodeKind::Leaf } else { NodeKind::Connector };
        let out = Span { start: length(&self.edges), len: 0 };
        let (entry, exit) = state.map_or_else(Default::default, |state| self.add_entry_and_exit(state));
        let doo = state.and_then(|state| Some(state.function(state.what.doo?.0)));
        let done = EventName::new(&format!("e_done@{}.{name}", self.fqn(parent)))
            .ok()
            .and_then(|name| self.event_ids.get(&name).copied());
        self.nodes.push(NodeRow {
            parent: parent.0,
            depth,
            kind,
            out,
            entry,
            exit,
            done: done.unwrap_or_else(|| EventId::done(id)),
            timer: NONE,
            doo,
            settles: false,
        });
        self.names.push(name);
        self.node_origins.push(Origin::NONE);
        self.children.insert((parent.0, name), id);
        self.depth = self.depth.max(depth);
        self.forget();
        Ok(NodeId(id))
    }

    /// Adds a transition behind all others of its source, whatever its priority. Answers where the outgoing transitions of
    /// the source stand now: in their order, each with the number it had; the new one is the last and had none.
    ///
    /// `event` gives the number of an event that the transition lists, by its name.
    ///
    /// # Errors
    /// [`NotGrown`]; the chart is as before.
    pub fn add_edge(
        &mut self,
        (src, tgt): (NodeId, NodeId),
        transition: Addition<'_, ChartTransition>,
        event: &mut dyn FnMut(&mut Self, EventName) -> EventId,
    ) -> Result<Vec<(EdgeId, Option<EdgeId>)>, NotGrown> {
        if src == NodeId::ROOT || tgt == NodeId::ROOT {
            return Err(NotGrown::Root);
        }
        let what = transition.what;
        if what.events.iter().any(|(trigger, _)| matches!(trigger, Trigger::Timed(_))) {
            return Err(NotGrown::Timed);
        }
        let before = self.nodes[src.index()].out;
        if self.edges.len() + before.len as usize >= limits::GROWN_EDGES {
            return Err(NotGrown::Full);
        }
        // Those at the end of the table need not move.
        let stays = before.start + before.len == length(&self.edges);
        let start = if stays { before.start } else { length(&self.edges) };
        let mut places = Vec::with_capacity(before.len as usize + 1);
        for (edge, to) in before.ids().zip(start..) {
            places.push((EdgeId(to), Some(EdgeId(edge))));
            if !stays {
                self.edges.push(self.edges[edge as usize].clone());
                self.edge_origins.push(self.edge_origins[edge as usize]);
                self.priorities.push(self.priorities[edge as usize]);
            }
        }
        let mut triggers = Vec::new();
        let first_predicate = length(&self.predicates);
        for (trigger, _) in &what.events {
            match trigger {
                Trigger::Event(name) if name.as_str() == "e_done" => {
                    let done = EventName::new(&format!("e_done@{}", self.fqn(src)));
                    triggers.extend(done.ok().map(|name| event(self, name)));
                }
                Trigger::Event(name) => triggers.push(event(self, *name)),
                Trigger::Predicate(function) => self.predicates.push(transition.function(*function)),
                Trigger::Timed(_) => (),
            }
        }
        triggers.sort_unstable();
        let first_event = length(&self.triggers);
        self.triggers.append(&mut triggers);
        let effect = self.add_actions(&what.effect, transition.functions);
        let lca = self.around_both(src, tgt);
        let edge = length(&self.edges);
        let predicates = Span { start: first_predicate, len: length(&self.predicates) - first_predicate };
        let guard = what.guard.map(|(function, _)| transition.function(function));
        self.unguarded &= guard.is_none() && predicates.len == 0;
        self.edges.push(EdgeRow {
            src: src.0,
            tgt: tgt.0,
            lca: lca.0,
            keep: self.nodes[lca.index()].depth + 1,
            null: what.events.is_empty(),
            events: Span { start: first_event, len: length(&self.triggers) - first_event },
            predicates,
            guard,
            effect,
        });
        self.edge_origins.push(Origin::NONE);
        self.priorities.push(what.pn);
        self.nodes[src.index()].out = Span { start, len: before.len + 1 };
        if self.nodes[src.index()].kind == NodeKind::Connector {
            self.connector_edges += 1;
        }
        places.push((EdgeId(edge), None));
        self.forget();
        Ok(places)
    }

    /// Gives an event that transitions list a number; a completion gets it from then on.
    pub fn add_event(&mut self, name: EventName) -> EventId {
        if let Some(id) = self.event_ids.get(&name) {
            return *id;
        }
        let id = EventId(length(&self.events));
        self.events.push(name);
        self.event_ids.insert(name, id);
        if let Some(path) = name.as_str().strip_prefix("e_done@") {
            let leaf =
                self.nodes().find(|node| self.kind(*node) == NodeKind::Leaf && self.fqn(*node).to_string() == path);
            if let Some(leaf) = leaf {
                self.nodes[leaf.index()].done = id;
            }
        }
        if name.as_str() == "e_init_fsm" {
            self.init = id;
        }
        id
    }

    /// The same chart with the places in the text that another one has, which it grew from; what was added has none.
    #[must_use]
    pub fn placed_as(mut self, other: &Self) -> Self {
        fn take(own: &mut [Origin], other: &[Origin]) {
            for (at, origin) in own.iter_mut().enumerate() {
                *origin = other.get(at).copied().unwrap_or(Origin::NONE);
            }
        }
        take(&mut self.node_origins, &other.node_origins);
        take(&mut self.edge_origins, &other.edge_origins);
        self
    }

    /// What was worked out beforehand holds no more.
    fn forget(&mut self) {
        self.pure = false;
        self.reactions = ReactionTable::default();
        self.wide = Wide::default();
        self.nodes.iter_mut().for_each(|row| row.settles = false);
    }

    fn add_entry_and_exit(&mut self, state: Addition<'_, State>) -> (Span, Span) {
        let State { entry, exit, config, .. } = state.what;
        let mut entered = self.add_actions(entry, state.functions);
        let named =
            |text: &str| ActionOp::RaiseScoped(EventName::new(text).expect("a configuration's name is an event's"));
        self.ops.extend(config.iter().map(|(config, _)| named(config.as_str())));
        entered.len = length(&self.ops) - entered.start;
        let start = length(&self.ops);
        self.ops.extend(config.iter().rev().map(|(config, _)| named(&format!("{config}.undo"))));
        self.add_actions(exit, state.functions);
        (entered, Span { start, len: length(&self.ops) - start })
    }

    fn add_actions(&mut self, actions: &[(Action, Origin)], functions: u32) -> Span {
        let start = length(&self.ops);
        self.ops.extend(actions.iter().map(|(action, _)| match action {
            Action::Raise(name) => ActionOp::Raise(*name),
            Action::Function(function) => ActionOp::Call(Addition { what: action, functions }.function(*function)),
        }));
        Span { start, len: length(&self.ops) - start }
    }

    /// The innermost state around both; neither is the root.
    fn around_both(&self, a: NodeId, b: NodeId) -> NodeId {
        let mut at = NodeId(self.nodes[a.index()].parent);
        let b = NodeId(self.nodes[b.index()].parent);
        while !self.is_inside(b, at) {
            at = NodeId(self.nodes[at.index()].parent);
        }
        at
    }
}

fn length<T>(table: &[T]) -> u32 {
    u32::try_from(table.len()).expect("tables are shorter than ids reach")
}
