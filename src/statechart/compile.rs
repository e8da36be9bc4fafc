//! From a chart as written to tables: what rFSM's `init` does (`docs/rfsm.md` §2), with all faults said at once.
//!
//! What `init` rejects is an error here. What it only complains about is a warning. Beyond rFSM, cycles of connectors
//! (which overflow its stack) and transitions of the root (on which it trips) are refused.

mod tables;

use super::chart::{ActionOp, Chart, EventId, NONE, NodeKind, RaiseSite};
use super::reactions::ReactionTable;
use super::resolve::{ResolvedNames, is_meant_initial};
use super::wide::Wide;
use super::{Machine, checks};
use crate::limits;
use crate::model::codes;
use crate::model::finding::{self, Finding, Findings, Origin};
use crate::model::names::{EventName, Ident};
use crate::model::statechart::{ChartNode, ChartTransition, INITIAL, ROOT, State, Statechart};
use crate::time::Time;
use rustc_hash::FxHashMap;

/// The chart in tables, and all that is wrong or doubtful with it.
///
/// There is a chart exactly when no finding is an error. What only a deployment can judge (that a raised name is a
/// configuration's, that somebody sends the events) is not looked at here.
pub fn compile(model: &Statechart) -> (Option<Chart>, Findings) {
    let mut builder = ChartBuilder::default();
    builder.walk_root(&model.root);
    builder.resolve_all();
    if finding::has_errors(&builder.findings) {
        return (None, builder.findings);
    }
    let mut chart = builder.tables(model.is_pure());
    checks::connector_cycles(&chart, &mut builder.findings);
    if finding::has_errors(&builder.findings) {
        return (None, builder.findings);
    }
    chart.connector_edges =
        chart.nodes.iter().filter(|node| node.kind == NodeKind::Connector).map(|node| node.out.len).sum();
    chart.wide = Wide::of(&chart);
    mark_settling(&mut chart);
    chart.reactions = ReactionTable::of(&chart);
    checks::doubts(&chart, &mut builder.findings);
    (Some(chart), builder.findings)
}

/// A resolved transition, not yet in its place.
struct ChartEdge<'m> {
    written: &'m ChartTransition,
    src: u32,
    tgt: u32,
    pn: f64,
}

#[derive(Default)]
struct ChartBuilder<'m> {
    findings: Findings,
    names: Vec<Ident>,
    parents: Vec<u32>,
    depths: Vec<u32>,
    kinds: Vec<NodeKind>,
    origins: Vec<Origin>,
    states: Vec<Option<&'m State>>,
    children: FxHashMap<(u32, Ident), u32>,
    /// All transitions with their scopes and numbers there, in rFSM's order: a scope's own before those of the states in it.
    written: Vec<(u32, usize, &'m ChartTransition)>,
    edges: Vec<ChartEdge<'m>>,
    events: Vec<EventName>,
    /// Where each was listed first.
    event_origins: Vec<Origin>,
    event_ids: FxHashMap<EventName, EventId>,
    ops: Vec<ActionOp>,
    raises: Vec<RaiseSite>,
}

/// Fields of an rFSM root or state that a child of the same name would replace.
const RESERVED: [&str; 3] = ["type", "new", "rfsm"];
const RESERVED_IN_ROOT: [&str; 6] = ["err", "warn", "info", "dbg", "getevents", "idle_hook"];

/// Whether a transition in it begins at a misspelt `initial`, which is told there.
fn misspells_initial(state: &State) -> bool {
    let of = |transition: &ChartTransition| transition.src.as_ref().is_some_and(|(text, _)| is_meant_initial(text));
    !state.children.iter().any(|child| child.name().as_str() == INITIAL) && state.transitions.iter().any(of)
}

impl<'m> ChartBuilder<'m> {
    fn walk_root(&mut self, root: &'m State) {
        let node = self.add(Ident::new(ROOT).expect("`root` is a name"), NONE, 0, NodeKind::Composite, root.origin);
        self.walk(root, node, 0);
        if !self.children.contains_key(&(node, initial())) && !misspells_initial(root) {
            self.findings.push(
                Finding::error(codes::CHART_NO_INITIAL, "the coordinator does not say in which state it begins")
                    .at(root.origin)
                    .path(ROOT)
                    .help(
                        "write a transition from `initial` to the first state: `trans { src = \"initial\", tgt = … }`",
                    ),
            );
        } else if let Some(&at) = self.children.get(&(node, initial()))
            && self.kinds[at as usize] != NodeKind::Connector
        {
            self.findings.push(
                Finding::error(codes::CHART_INITIAL_STATE, "`initial` of the root is a state, not a connector")
                    .at(self.origins[at as usize])
                    .path("root.initial")
                    .help("give the state another name and write a transition from `initial` to it"),
            );
        }
    }

    fn add(&mut self, name: Ident, parent: u32, depth: u32, kind: NodeKind, origin: Origin) -> u32 {
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
        self.kinds[node as usize] = if composite { NodeKind::Composite } else { NodeKind::Leaf };
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
                ChartNode::Connector(_) => {
                    self.add(name, node, depth + 1, NodeKind::Connector, origin);
                }
                ChartNode::State(inner) => {
                    let id = self.add(name, node, depth + 1, NodeKind::Leaf, origin);
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
            self.add(initial(), node, depth + 1, NodeKind::Connector, origin);
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

    fn lookup(&self) -> ResolvedNames<'_> {
        let suggests = self.findings.len() < limits::FINDINGS_SHOWN;
        ResolvedNames { children: &self.children, names: &self.names, parents: &self.parents, suggests }
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
        transition: &ChartTransition,
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
                .help(format!("write `{which} = \"NAME\"`")),
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
            Err(mut unresolved) => {
                if text == INITIAL && self.states[scope as usize].is_some_and(|state| state.doo.is_some()) {
                    unresolved.help =
                        "a state with a `doo` is given none: move the activity into one of the states inside"
                            .to_owned();
                }
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

    fn edge(&mut self, transition: &'m ChartTransition, src: u32, mut tgt: u32, path: &str) {
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
        if self.kinds[tgt as usize] == NodeKind::Composite {
            let Some(initial) = self.children.get(&(tgt, initial())).copied() else {
                if self.states[tgt as usize].is_some_and(misspells_initial) {
                    return;
                }
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
            if self.kinds[tgt as usize] != NodeKind::Connector {
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
        self.edges.push(ChartEdge { written: transition, src, tgt, pn: transition.pn });
    }
}

/// Finds the leaves whose completion triggers nothing, by trying. Where guards decide, nobody can know.
fn mark_settling(chart: &mut Chart) {
    if !chart.unguarded {
        return;
    }
    let mut machine = Machine::new(chart);
    for leaf in chart.nodes() {
        if chart.kind(leaf) != NodeKind::Leaf {
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
