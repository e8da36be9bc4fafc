//! The second half of compiling: resolved nodes and transitions are put into tables, in their final order.

use super::{ChartBuilder, initial, len};
use crate::model::codes;
use crate::model::finding::{self, Finding, Origin};
use crate::model::names::EventName;
use crate::model::statechart::{Action, FunctionId, ROOT, Since, Trigger};
use crate::statechart::chart::{
    ActionOp, Chart, EdgeRow, EventId, NONE, NodeKind, NodeRow, RaiseMoment, RaiseSite, Span, TimerRow,
};
use crate::statechart::{EdgeId, NodeId, order};
use rustc_hash::FxHashMap;

impl ChartBuilder<'_> {
    pub(super) fn tables(&mut self, pure: bool) -> Chart {
        let mut outgoing: Vec<Vec<usize>> = vec![Vec::new(); self.names.len()];
        for (index, edge) in self.edges.iter().enumerate() {
            outgoing[edge.src as usize].push(index);
        }
        let timers = self.intern_triggers();
        let mut chart = Chart {
            nodes: Vec::with_capacity(self.names.len()),
            edges: Vec::with_capacity(self.edges.len()),
            edge_origins: Vec::with_capacity(self.edges.len()),
            priorities: Vec::with_capacity(self.edges.len()),
            initial: self.children[&(0, initial())],
            depth: self.depths.iter().copied().max().unwrap_or(0),
            unguarded: true,
            pure,
            init: self.event("e_init_fsm").unwrap_or(EventId::INIT),
            ..Chart::default()
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

    fn intern(&mut self, name: EventName, origin: Origin) -> EventId {
        let next = EventId(len(&self.events));
        let (events, origins) = (&mut self.events, &mut self.event_origins);
        *self.event_ids.entry(name).or_insert_with(|| {
            events.push(name);
            origins.push(origin);
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
    fn intern_triggers(&mut self) -> Vec<(u32, TimerRow)> {
        let mut timers: Vec<(u32, TimerRow, Origin)> = Vec::new();
        let mut timer_of: FxHashMap<u32, usize> = FxHashMap::default();
        for index in 0..self.edges.len() {
            let (transition, src) = (self.edges[index].written, self.edges[index].src);
            for (trigger, origin) in &transition.events {
                let Some(name) = self.name_of(trigger, src) else { continue };
                let event = self.intern(name, *origin);
                let Trigger::Timed(timed) = trigger else { continue };
                if self.kinds[src as usize] == NodeKind::Connector {
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
                let timer = TimerRow { relative: timed.since == Since::Entry, nanos, by: timed.by, event };
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
        let effect = self.actions(&transition.effect, RaiseMoment::Effect(edge));
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

    fn actions(&mut self, actions: &[(Action, Origin)], when: RaiseMoment) -> Span {
        let start = len(&self.ops);
        for (action, origin) in actions {
            match action {
                Action::Raise(name) => self.raise(*name, when, false, *origin),
                Action::Function(function) => self.ops.push(ActionOp::Call(*function)),
            }
        }
        Span { start, len: len(&self.ops) - start }
    }

    fn raise(&mut self, name: EventName, when: RaiseMoment, scoped: bool, origin: Origin) {
        self.ops.push(if scoped { ActionOp::RaiseScoped(name) } else { ActionOp::Raise(name) });
        self.raises.push(RaiseSite { name, when, scoped, origin });
    }

    fn node_row(&mut self, node: usize, out: Span) -> NodeRow {
        let id = u32::try_from(node).expect("fewer nodes than ids");
        let kind = self.kinds[node];
        let (mut entry, mut exit, mut doo) = (Span::default(), Span::default(), None);
        if let Some(state) = self.states[node] {
            entry = self.actions(&state.entry, RaiseMoment::Entry(NodeId(id)));
            for (config, origin) in &state.config {
                let name = EventName::new(config.as_str()).expect("a configuration's name is an event's");
                self.raise(name, RaiseMoment::Entry(NodeId(id)), true, *origin);
            }
            entry.len = len(&self.ops) - entry.start;
            exit.start = len(&self.ops);
            for (config, origin) in state.config.iter().rev() {
                let name = EventName::new(&format!("{config}.undo")).expect("a configuration's name is an event's");
                self.raise(name, RaiseMoment::Exit(NodeId(id)), true, *origin);
            }
            self.actions(&state.exit, RaiseMoment::Exit(NodeId(id)));
            exit.len = len(&self.ops) - exit.start;
            doo = state.doo.map(|(function, _): (FunctionId, Origin)| function).filter(|_| kind == NodeKind::Leaf);
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
            if let Some(node) = node.filter(|node| self.kinds[*node as usize] == NodeKind::Leaf) {
                chart.nodes[node as usize].done = EventId(u32::try_from(index).expect("fewer events than ids"));
                continue;
            }
            let why = match node {
                Some(node) if self.kinds[node as usize] == NodeKind::Composite => {
                    "is a state with states in it, and those never complete"
                }
                Some(_) => "is a connector",
                None => "is no state of this coordinator",
            };
            let origin = self.event_origins[index];
            // What is not shown needs no list of all states.
            let leaves: Vec<String> = (0..len(&self.names))
                .filter(|n| self.lookup().suggests && self.kinds[*n as usize] == NodeKind::Leaf)
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
}
