//! From a chart as written to tables: what rFSM's `init` does (`rfsm.md` §2), with all faults said at once.
//!
//! What `init` rejects is an error here. What it only complains about is a warning. Beyond rFSM, circles of connectors
//! (which overflow its stack) and transitions of the root (on which it trips) are refused.

use super::chart::{Chart, EdgeRow, EventId, Kind, NONE, NodeRow, Op, RaiseSite, Span, Timer, When};
use super::resolve::Names;
use super::{EdgeId, Machine, NodeId, checks, order};
use crate::limits;
use crate::model::codes;
use crate::model::finding::{self, Finding, Findings, Origin};
use crate::model::names::{EventName, Ident};
use crate::model::statechart::{
    Action, FunctionId, INITIAL, Node, ROOT, Since, State, Statechart, Transition, Trigger,
};
use crate::time::Time;
use rustc_hash::FxHashMap;

/// The chart in tables, and all that is wrong or doubtful with it.
///
/// There is a chart exactly when no finding is an error. What only a deployment can judge (that a raised name is a
/// configuration's, that somebody sends the events) is not looked at here.
pub fn compile(model: &Statechart) -> (Option<Chart>, Findings) {
    let mut builder = Builder::default();
    builder.walk_root(&model.root);
    builder.resolve_all();
    if finding::has_errors(&builder.findings) {
        return (None, builder.findings);
    }
    let mut chart = builder.tables(model.is_pure());
    checks::connector_circles(&chart, &mut builder.findings);
    if finding::has_errors(&builder.findings) {
        return (None, builder.findings);
    }
    chart.connector_edges =
        chart.nodes.iter().filter(|node| node.kind == Kind::Connector).map(|node| node.out.len).sum();
    mark_settling(&mut chart);
    checks::doubts(&chart, &mut builder.findings);
    (Some(chart), builder.findings)
}

/// A resolved transition, not yet in its place.
struct Edge<'m> {
    written: &'m Transition,
    src: u32,
    tgt: u32,
    pn: f64,
}

#[derive(Default)]
struct Builder<'m> {
    findings: Findings,
    names: Vec<Ident>,
    parents: Vec<u32>,
    depths: Vec<u32>,
    kinds: Vec<Kind>,
    origins: Vec<Origin>,
    states: Vec<Option<&'m State>>,
    children: FxHashMap<(u32, Ident), u32>,
    /// All transitions with their scopes and numbers there, in rFSM's order: a scope's own before those of the states in it.
    written: Vec<(u32, usize, &'m Transition)>,
    edges: Vec<Edge<'m>>,
    events: Vec<EventName>,
    event_ids: FxHashMap<EventName, EventId>,
    ops: Vec<Op>,
    raises: Vec<RaiseSite>,
}

/// Fields of an rFSM root or state that a child of the same name would replace.
const RESERVED: [&str; 3] = ["type", "new", "rfsm"];
const RESERVED_IN_ROOT: [&str; 6] = ["err", "warn", "info", "dbg", "getevents", "idle_hook"];

impl<'m> Builder<'m> {
    fn walk_root(&mut self, root: &'m State) {
        let node = self.add(Ident::new(ROOT).expect("`root` is a name"), NONE, 0, Kind::Composite, root.origin);
        self.walk(root, node, 0);
        if self.children.get(&(node, initial())).is_none() {
            self.findings.push(
                Finding::error(codes::CHART_NO_INITIAL, "the coordinator does not say in which state it begins")
                    .at(root.origin)
                    .path(ROOT)
                    .help("write a transition from `initial` to the first state: trans { src = \"initial\", tgt = … }"),
            );
        } else if self.kinds[self.children[&(node, initial())] as usize] != Kind::Connector {
            let at = self.children[&(node, initial())];
            self.findings.push(
                Finding::error(codes::CHART_INITIAL_STATE, "`initial` of the root is a state, not a connector")
                    .at(self.origins[at as usize])
                    .path("root.initial")
                    .help("give the state another name and write a transition from `initial` to it"),
            );
        }
    }

    fn add(&mut self, name: Ident, parent: u32, depth: u32, kind: Kind, origin: Origin) -> u32 {
        let node = u32::try_from(self.names.len()).expect("fewer nodes than ids");
        self.names.push(name);
        self.parents.push(parent);
        self.depths.push(depth);
        self.kinds.push(kind);
        self.origins.push(origin);
        self.states.push(None);
        if parent != NONE {
            self.children.insert((parent, name), node);
        }
        node
    }

    fn walk(&mut self, state: &'m State, node: u32, depth: u32) {
        self.states[node as usize] = Some(state);
        if depth as usize >= limits::CHART_DEPTH {
            self.findings.push(
                Finding::error(
                    codes::CHART_TOO_DEEP,
                    format!("states are nested more than {} deep", limits::CHART_DEPTH),
                )
                .at(state.origin)
                .path(self.fqn(node)),
            );
            return;
        }
        self.written
            .extend(state.transitions.iter().enumerate().map(|(number, transition)| (node, number, transition)));
        let composite = !state.children.is_empty();
        self.kinds[node as usize] = if composite { Kind::Composite } else { Kind::Leaf };
        for child in &state.children {
            let (name, origin) = (child.name(), child.origin());
            if let Some(first) = self.children.get(&(node, name)) {
                self.findings.push(
                    Finding::error(codes::CHART_TWO_NODES, format!("`{name}` stands twice in `{}`", self.fqn(node)))
                        .at(origin)
                        .also(self.origins[*first as usize], "first here")
                        .path(format!("{}.{name}", self.fqn(node))),
                );
                continue;
            }
            self.check_name(node, name, origin);
            match child {
                Node::Connector(_) => {
                    self.add(name, node, depth + 1, Kind::Connector, origin);
                }
                Node::State(inner) => {
                    let id = self.add(name, node, depth + 1, Kind::Leaf, origin);
                    self.walk(inner, id, depth + 1);
                }
            }
        }
        self.check_doo(state, node, composite);
        // Made where a transition needs it, unless it was written.
        let wanted = state.transitions.iter().find(|t| t.src.as_ref().is_some_and(|(src, _)| src == INITIAL));
        if let Some(transition) = wanted
            && composite
            && state.doo.is_none()
            && !self.children.contains_key(&(node, initial()))
        {
            let origin = transition.src.as_ref().map_or(transition.origin, |(_, origin)| *origin);
            self.add(initial(), node, depth + 1, Kind::Connector, origin);
        }
    }

    fn check_name(&mut self, parent: u32, name: Ident, origin: Origin) {
        let text = name.as_str();
        if RESERVED.contains(&text) || parent == 0 && RESERVED_IN_ROOT.contains(&text) {
            self.findings.push(
                Finding::error(codes::CHART_RESERVED, format!("a state cannot be called `{text}` here"))
                    .at(origin)
                    .path(format!("{}.{text}", self.fqn(parent)))
                    .help("rFSM uses this name itself; choose another"),
            );
        }
    }

    fn check_doo(&mut self, state: &State, node: u32, composite: bool) {
        if composite && let Some((_, origin)) = state.doo {
            self.findings.push(
                Finding::warning(
                    codes::CHART_DOO_IN_COMPOSITE,
                    format!("`{}` has states in it, so its `doo` is never run", self.fqn(node)),
                )
                .at(origin)
                .path(self.fqn(node))
                .help("move the activity into one of the states inside"),
            );
        }
    }

    fn fqn(&self, node: u32) -> String {
        self.lookup().fqn(node)
    }

    fn lookup(&self) -> Names<'_> {
        Names { children: &self.children, names: &self.names, parents: &self.parents }
    }

    fn resolve_all(&mut self) {
        for (scope, number, transition) in std::mem::take(&mut self.written) {
            let path = format!("{}.transitions[{number}]", self.fqn(scope));
            let ends = (
                self.end(scope, transition, &transition.src, "src", &path),
                self.end(scope, transition, &transition.tgt, "tgt", &path),
            );
            if !transition.pn.is_finite() {
                self.findings.push(
                    Finding::error(codes::CHART_BAD_PRIORITY, "a priority number must be finite")
                        .at(transition.origin)
                        .path(&path),
                );
            }
            let (Some(src), Some(tgt)) = ends else { continue };
            self.edge(transition, src, tgt, &path);
        }
    }

    /// The node at one end of a transition.
    fn end(
        &mut self,
        scope: u32,
        transition: &Transition,
        end: &Option<(String, Origin)>,
        which: &str,
        path: &str,
    ) -> Option<u32> {
        let Some((text, origin)) = end else {
            self.findings.push(
                Finding::error(
                    codes::CHART_MISSING_END,
                    format!("a transition in `{}` has no `{which}`", self.fqn(scope)),
                )
                .at(transition.origin)
                .path(path)
                .help(format!("write {which} = \"NAME\"")),
            );
            return None;
        };
        if which == "tgt" && text == "internal" {
            self.findings.push(
                Finding::error(codes::CHART_INTERNAL, "internal transitions do not exist in rFSM")
                    .at(*origin)
                    .path(path)
                    .help("a transition always ends in a state; to raise a name without leaving a state, add a state beside it"),
            );
            return None;
        }
        match self.lookup().resolve(scope, text) {
            Ok(node) => Some(node),
            Err(unresolved) => {
                self.findings.push(
                    Finding::error(codes::CHART_UNKNOWN_STATE, unresolved.message)
                        .at(*origin)
                        .labelled("no such state or connector")
                        .path(path)
                        .help(unresolved.help),
                );
                None
            }
        }
    }

    fn edge(&mut self, transition: &'m Transition, src: u32, mut tgt: u32, path: &str) {
        if src == 0 {
            self.findings.push(
                Finding::error(
                    codes::CHART_FROM_ROOT,
                    "a transition cannot start at the root: rFSM fails when it is taken",
                )
                .at(transition.origin)
                .path(path)
                .help("put all states into one state inside the root and start the transition there"),
            );
            return;
        }
        if self.kinds[tgt as usize] == Kind::Composite {
            let Some(initial) = self.children.get(&(tgt, initial())).copied() else {
                let target = self.fqn(tgt);
                let origin = transition.tgt.as_ref().map_or(transition.origin, |(_, origin)| *origin);
                self.findings.push(
                    Finding::error(
                        codes::CHART_TARGET_WITHOUT_INITIAL,
                        format!("`{target}` has states in it and does not say which is entered first"),
                    )
                    .at(origin)
                    .also(self.origins[tgt as usize], "this state has no initial connector")
                    .path(path)
                    .help(format!(
                        "write a transition from `initial` in `{target}`, or make one of its states the target"
                    )),
                );
                return;
            };
            tgt = initial;
            if self.kinds[tgt as usize] != Kind::Connector {
                self.findings.push(
                    Finding::warning(
                        codes::CHART_INITIAL_STATE,
                        format!("`{}` is a state, not a connector", self.fqn(tgt)),
                    )
                    .at(self.origins[tgt as usize])
                    .path(self.fqn(tgt))
                    .help("give the state another name and write a transition from `initial` to it"),
                );
            }
        }
        self.edges.push(Edge { written: transition, src, tgt, pn: transition.pn });
    }

    fn tables(&mut self, pure: bool) -> Chart {
        let mut outgoing: Vec<Vec<usize>> = vec![Vec::new(); self.names.len()];
        for (index, edge) in self.edges.iter().enumerate() {
            outgoing[edge.src as usize].push(index);
        }
        let timers = self.intern_triggers();
        let mut chart = Chart {
            nodes: Vec::with_capacity(self.names.len()),
            edges: Vec::with_capacity(self.edges.len()),
            ops: Vec::new(),
            triggers: Vec::new(),
            predicates: Vec::new(),
            timers: Vec::new(),
            events: Vec::new(),
            event_ids: FxHashMap::default(),
            names: Vec::new(),
            node_origins: Vec::new(),
            edge_origins: Vec::with_capacity(self.edges.len()),
            priorities: Vec::with_capacity(self.edges.len()),
            raises: Vec::new(),
            children: FxHashMap::default(),
            initial: self.children[&(0, initial())],
            depth: self.depths.iter().copied().max().unwrap_or(0),
            connector_edges: 0,
            unguarded: true,
            pure,
            init: self.event("e_init_fsm").unwrap_or(EventId::INIT),
        };
        for (node, out) in outgoing.iter_mut().enumerate() {
            order::sort(out, |index| self.edges[*index].pn);
            let start = len(&chart.edges);
            for index in out.iter() {
                self.push_edge(&mut chart, *index);
            }
            let row = self.node_row(node, Span { start, len: len(&chart.edges) - start });
            chart.nodes.push(row);
        }
        self.mark_completions(&mut chart);
        for (node, timer) in timers {
            chart.nodes[node as usize].timer = len(&chart.timers);
            chart.timers.push(timer);
        }
        chart.ops = std::mem::take(&mut self.ops);
        chart.raises = std::mem::take(&mut self.raises);
        chart.events = std::mem::take(&mut self.events);
        chart.event_ids = std::mem::take(&mut self.event_ids);
        chart.names = std::mem::take(&mut self.names);
        chart.node_origins = std::mem::take(&mut self.origins);
        chart.children = std::mem::take(&mut self.children);
        chart
    }

    fn event(&self, text: &str) -> Option<EventId> {
        self.event_ids.get(&EventName::new(text).ok()?).copied()
    }

    fn intern(&mut self, name: EventName) -> EventId {
        let next = EventId(len(&self.events));
        let events = &mut self.events;
        *self.event_ids.entry(name).or_insert_with(|| {
            events.push(name);
            next
        })
    }

    /// The name under which a trigger of a transition from `src` is known; none for predicates.
    fn name_of(&self, trigger: &Trigger, src: u32) -> Option<EventName> {
        let text = match trigger {
            Trigger::Event(name) if name.as_str() == "e_done" => format!("e_done@{}", self.fqn(src)),
            Trigger::Event(name) => return Some(*name),
            Trigger::Timed(timed) => timed.event_of(&self.fqn(src)),
            Trigger::Predicate(_) => return None,
        };
        EventName::new(&text).ok()
    }

    /// Gives every event an id, in written order, and finds the time event of each state: the last one written, as rFSM's
    /// plugin checks no more than one a state.
    fn intern_triggers(&mut self) -> Vec<(u32, Timer)> {
        let mut timers: Vec<(u32, Timer, Origin)> = Vec::new();
        let mut timer_of: FxHashMap<u32, usize> = FxHashMap::default();
        for index in 0..self.edges.len() {
            let (transition, src) = (self.edges[index].written, self.edges[index].src);
            for (trigger, origin) in &transition.events {
                let Some(name) = self.name_of(trigger, src) else { continue };
                let event = self.intern(name);
                let Trigger::Timed(timed) = trigger else { continue };
                if self.kinds[src as usize] == Kind::Connector {
                    self.findings.push(
                        Finding::warning(
                            codes::CHART_TIMER_AT_CONNECTOR,
                            format!(
                                "`{timed}` never comes: `{}` is a connector, no time is spent in it",
                                self.fqn(src)
                            ),
                        )
                        .at(*origin)
                        .path(self.fqn(src)),
                    );
                    continue;
                }
                #[allow(clippy::cast_possible_truncation)] // saturates: 292 years
                let nanos = (timed.seconds * 1e9).round() as i64;
                let timer = Timer { relative: timed.since == Since::Entry, nanos, event };
                match timer_of.get(&src).map(|at| &mut timers[*at]) {
                    None => {
                        timer_of.insert(src, timers.len());
                        timers.push((src, timer, *origin));
                    }
                    Some(entry) => {
                        if entry.1.event != event {
                            self.findings.push(
                                Finding::warning(
                                    codes::CHART_TWO_TIMERS,
                                    format!(
                                        "`{}` has two time events; only the last one written is ever raised",
                                        self.fqn(src)
                                    ),
                                )
                                .at(entry.2)
                                .labelled("never raised")
                                .also(*origin, "this one is")
                                .path(self.fqn(src))
                                .help("put the shorter time into a state inside, or use one time event"),
                            );
                        }
                        *entry = (src, timer, *origin);
                    }
                }
            }
        }
        timers.into_iter().map(|(node, timer, _)| (node, timer)).collect()
    }

    fn push_edge(&mut self, chart: &mut Chart, index: usize) {
        let (transition, src, tgt) = (self.edges[index].written, self.edges[index].src, self.edges[index].tgt);
        let (first_event, first_predicate) = (len(&chart.triggers), len(&chart.predicates));
        for (trigger, _) in &transition.events {
            match trigger {
                Trigger::Predicate(function) => chart.predicates.push(*function),
                _ => {
                    let id = self.name_of(trigger, src).and_then(|name| self.event_ids.get(&name).copied());
                    chart.triggers.push(id.expect("interned before"));
                }
            }
        }
        chart.triggers[first_event as usize..].sort_unstable();
        let edge = EdgeId(len(&chart.edges));
        let effect = self.actions(&transition.effect, When::Effect(edge));
        let guard = transition.guard.map(|(function, _)| function);
        let predicates = Span { start: first_predicate, len: len(&chart.predicates) - first_predicate };
        chart.unguarded &= guard.is_none() && predicates.len == 0;
        chart.edge_origins.push(transition.origin);
        chart.priorities.push(transition.pn);
        let lca = self.least_common_ancestor(src, tgt);
        chart.edges.push(EdgeRow {
            src,
            tgt,
            lca,
            keep: self.depths[lca as usize] + 1,
            null: transition.events.is_empty(),
            events: Span { start: first_event, len: len(&chart.triggers) - first_event },
            predicates,
            guard,
            effect,
        });
    }

    /// The innermost state around the source that is also around the target.
    fn least_common_ancestor(&self, src: u32, tgt: u32) -> u32 {
        let up = |node: u32| self.parents[node as usize];
        let (mut a, mut b) = (up(src), up(tgt));
        while a != b {
            if self.depths[a as usize] >= self.depths[b as usize] {
                a = up(a);
            } else {
                b = up(b);
            }
        }
        a
    }

    fn actions(&mut self, actions: &[(Action, Origin)], when: When) -> Span {
        let start = len(&self.ops);
        for (action, origin) in actions {
            match action {
                Action::Raise(name) => self.raise(*name, when, false, *origin),
                Action::Function(function) => self.ops.push(Op::Call(*function)),
            }
        }
        Span { start, len: len(&self.ops) - start }
    }

    fn raise(&mut self, name: EventName, when: When, scoped: bool, origin: Origin) {
        self.ops.push(Op::Raise(name));
        self.raises.push(RaiseSite { name, when, scoped, origin });
    }

    fn node_row(&mut self, node: usize, out: Span) -> NodeRow {
        let id = u32::try_from(node).expect("fewer nodes than ids");
        let kind = self.kinds[node];
        let (mut entry, mut exit, mut doo) = (Span::default(), Span::default(), None);
        if let Some(state) = self.states[node] {
            entry = self.actions(&state.entry, When::Entry(NodeId(id)));
            for (config, origin) in &state.config {
                let name = EventName::new(config.as_str()).expect("a configuration's name is an event's");
                self.raise(name, When::Entry(NodeId(id)), true, *origin);
            }
            entry.len = len(&self.ops) - entry.start;
            exit.start = len(&self.ops);
            for (config, origin) in state.config.iter().rev() {
                let name = EventName::new(&format!("{config}.undo")).expect("a configuration's name is an event's");
                self.raise(name, When::Exit(NodeId(id)), true, *origin);
            }
            self.actions(&state.exit, When::Exit(NodeId(id)));
            exit.len = len(&self.ops) - exit.start;
            doo = state.doo.map(|(function, _): (FunctionId, Origin)| function).filter(|_| kind == Kind::Leaf);
        }
        NodeRow {
            parent: if node == 0 { 0 } else { self.parents[node] },
            depth: self.depths[node],
            kind,
            out,
            entry,
            exit,
            done: EventId::done(id),
            timer: NONE,
            doo,
            settles: false,
        }
    }

    /// Completions that some transition lists get that event's id.
    fn mark_completions(&mut self, chart: &mut Chart) {
        for (index, name) in self.events.iter().enumerate() {
            let Some(path) = name.as_str().strip_prefix("e_done@") else { continue };
            let node = self.exactly(path);
            if let Some(node) = node.filter(|node| self.kinds[*node as usize] == Kind::Leaf) {
                chart.nodes[node as usize].done = EventId(u32::try_from(index).expect("fewer events than ids"));
                continue;
            }
            let why = match node {
                Some(node) if self.kinds[node as usize] == Kind::Composite => {
                    "is a state with states in it, and those never complete"
                }
                Some(_) => "is a connector",
                None => "is no state of this coordinator",
            };
            let origin = self.origin_of(*name);
            let leaves: Vec<String> = (0..len(&self.names))
                .filter(|n| self.kinds[*n as usize] == Kind::Leaf)
                .map(|n| self.lookup().fqn(n))
                .collect();
            self.findings.push(
                Finding::warning(codes::CHART_NEVER_DONE, format!("`{name}` never comes: `{path}` {why}"))
                    .at(origin)
                    .path(path.to_owned())
                    .help(match node {
                        Some(_) => "wait for the completion of a state inside: `e_done@` and its full name".to_owned(),
                        None => finding::did_you_mean(path, "states that complete", leaves.iter().map(String::as_str)),
                    }),
            );
        }
    }

    /// The node whose full name is exactly `path`.
    fn exactly(&self, path: &str) -> Option<u32> {
        let mut pieces = path.split('.');
        (pieces.next() == Some(ROOT)).then_some(())?;
        pieces.try_fold(0, |at, piece| self.lookup().child(at, piece))
    }

    fn origin_of(&self, name: EventName) -> Origin {
        let mut all = self.edges.iter().flat_map(|edge| edge.written.events.iter().map(move |event| (edge.src, event)));
        all.find(|(src, (trigger, _))| self.name_of(trigger, *src) == Some(name)).map_or(Origin::NONE, |(_, (_, o))| *o)
    }
}

/// Finds the leaves whose completion triggers nothing, by trying. Where guards decide, nobody can know.
fn mark_settling(chart: &mut Chart) {
    if !chart.unguarded {
        return;
    }
    let mut machine = Machine::new(chart);
    for leaf in chart.nodes() {
        if chart.kind(leaf) != Kind::Leaf {
            continue;
        }
        machine.place(chart, leaf, Time::default());
        machine.send(chart.completion(leaf));
        chart.nodes[leaf.index()].settles = !machine.triggers(chart);
    }
}

fn initial() -> Ident {
    Ident::new(INITIAL).expect("`initial` is a name")
}

fn len<T>(table: &[T]) -> u32 {
    u32::try_from(table.len()).expect("tables are shorter than ids reach")
}
