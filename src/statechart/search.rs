//! The search for a path: from a node along enabled transitions, through connectors, to a leaf.
//!
//! Nothing is executed during the search; all segments of a path see the same events (connectors are junctions). A
//! connector without an enabled way on is a dead end, and the search goes back to the next transition of the source.
//! The result is the tree of all complete paths, kept in an arena: the first one is taken, the others matter where a
//! connector has more than one (a conflict).
//!
//! Without guards, whether a connector leads on depends on the events alone; so each connector is searched once a step,
//! and a net of connectors costs its number of transitions, not its number of paths. With guards every visit counts,
//! because guards may do things.
//!
//! Connectors may lead round in a cycle that only several events together open, or that guards hold. When all of it is open,
//! rFSM overflows its stack, which ends the step with an error. Here the search is lost: it finds no path, none further in
//! either, and that is told ([`Hook::runaway`]). Without guards a cycle is known when a connector is met again on the way to
//! it; with guards only after [`limits::CONNECTOR_CHAIN`] connectors, since a guard may say something else each time.

use super::EdgeId;
use super::chart::{Chart, EdgeRow, EventId, NONE, NodeId, NodeKind};
use super::hook::{Hook, HookContext};
use super::queue::Queue;
use super::wide::candidates;
use crate::limits;

/// One way on from a node: a transition and, if it ends at a connector, the ways on from there.
#[derive(Debug, Clone, Copy)]
pub(super) struct SearchWay {
    pub edge: u32,
    /// First way on from the connector it ends at; [`NONE`] at a leaf.
    pub then: u32,
    /// The next way of the same node.
    pub other: u32,
}

/// What a search works with, kept from step to step so that none allocates.
#[derive(Debug, Clone)]
pub(super) struct Search {
    pub ways: Vec<SearchWay>,
    /// By node: the step in which it was last searched, and what was found.
    memo: Vec<(u32, u32)>,
    step: u32,
    work: u64,
    /// Connectors led round in this step: nothing is found any more.
    lost: bool,
}

/// What is noted of a connector while it is searched: whoever meets it then has gone round.
const OPEN: u32 = NONE - 1;

/// What the functions called by a search may see.
pub(super) struct Around<'a> {
    pub leaf: Option<NodeId>,
    pub events: &'a [EventId],
    pub queue: &'a mut Queue,
}

impl Around<'_> {
    fn view<'v>(&'v mut self, chart: &'v Chart) -> HookContext<'v> {
        HookContext { chart, leaf: self.leaf, events: self.events, queue: self.queue }
    }
}

/// The first look at a state's transitions.
pub(super) enum Straight {
    /// None of them is enabled, or the search is lost.
    None,
    /// This one is taken: it leads to a leaf.
    Leaf(u32),
    /// The first that is enabled leads to no leaf: it must be searched.
    Unclear,
}

impl Search {
    /// Whether the first enabled transition of `node` needs no search. Only for charts without guards.
    pub fn straight(&mut self, chart: &Chart, node: u32, events: &[EventId]) -> Straight {
        if self.lost {
            return Straight::None;
        }
        for edge in candidates(chart, node, events) {
            self.work += 1;
            let row = &chart.edges[edge as usize];
            let listed = row.events.of(&chart.triggers);
            if row.null || events.iter().any(|event| lists(listed, *event)) {
                match chart.nodes[row.tgt as usize].kind {
                    NodeKind::Leaf => return Straight::Leaf(edge),
                    NodeKind::Connector => return Straight::Unclear,
                    NodeKind::Composite => return Straight::Unclear,
                }
            }
        }
        Straight::None
    }

    pub fn new(chart: &Chart) -> Self {
        let memo = if chart.unguarded { vec![(0, NONE); chart.nodes.len()] } else { Vec::new() };
        // One more for the segment that leaves a state: without guards its search stops at the first way.
        Self { ways: Vec::with_capacity(chart.connector_edges as usize + 1), memo, step: 0, work: 0, lost: false }
    }

    /// Makes room for the nodes of a chart that has grown.
    pub fn fit(&mut self, chart: &Chart) {
        self.memo.resize(if chart.unguarded { chart.nodes.len() } else { 0 }, (0, NONE));
    }

    /// Transitions looked at so far.
    pub fn work(&self) -> u64 {
        self.work
    }

    /// Counts what was looked at elsewhere.
    pub fn looked_at(&mut self, transitions: u64) {
        self.work += transitions;
    }

    /// A new step: other events.
    pub fn begin(&mut self) {
        self.ways.clear();
        self.lost = false;
        self.step = self.step.wrapping_add(1);
        if self.step == 0 {
            self.memo.fill((0, NONE));
            self.step = 1;
        }
    }

    /// The first way of all that lead from `node` to a leaf, or [`NONE`].
    pub fn from(&mut self, chart: &Chart, node: u32, around: &mut Around<'_>, hook: &mut impl Hook) -> u32 {
        if self.lost { NONE } else { self.find(chart, node, around, hook, 0) }
    }

    fn find(&mut self, chart: &Chart, node: u32, around: &mut Around<'_>, hook: &mut impl Hook, chain: usize) -> u32 {
        let row = &chart.nodes[node as usize];
        let is_connector = row.kind == NodeKind::Connector;
        if is_connector && chart.unguarded {
            let (step, found) = self.memo[node as usize];
            if step == self.step && found != OPEN {
                return found;
            }
            self.lost = step == self.step;
            self.memo[node as usize] = (self.step, OPEN);
        }
        if self.lost || chain > limits::CONNECTOR_CHAIN {
            self.lost = true;
            hook.runaway(chart, NodeId(node));
            return NONE;
        }
        let (mut first, mut last) = (NONE, NONE);
        for edge in candidates(chart, node, around.events) {
            self.work += 1;
            let edge_row = &chart.edges[edge as usize];
            if !enabled(chart, edge, edge_row, around, hook) {
                continue;
            }
            let then = match chart.nodes[edge_row.tgt as usize].kind {
                NodeKind::Leaf => NONE,
                NodeKind::Connector => match self.find(chart, edge_row.tgt, around, hook, chain + 1) {
                    NONE if self.lost => return NONE,
                    NONE => continue,
                    then => then,
                },
                NodeKind::Composite => {
                    hook.no_way(chart, NodeId(node));
                    continue;
                }
            };
            let way = u32::try_from(self.ways.len()).expect("fewer ways than ids");
            self.ways.push(SearchWay { edge, then, other: NONE });
            if first == NONE {
                first = way;
            } else {
                self.ways[last as usize].other = way;
            }
            last = way;
            // At a state only the first way matters. Looking at the others has no effect unless guards run.
            if chart.unguarded && !is_connector {
                break;
            }
        }
        if is_connector && chart.unguarded {
            self.memo[node as usize] = (self.step, first);
        }
        first
    }
}

/// Whether `edge` may be taken: its guard first, then its events.
fn enabled(chart: &Chart, edge: u32, row: &EdgeRow, around: &mut Around<'_>, hook: &mut impl Hook) -> bool {
    if let Some(guard) = row.guard
        && !hook.guard(guard, EdgeId(edge), &mut around.view(chart))
    {
        return false;
    }
    if row.null {
        return true;
    }
    let listed = row.events.of(&chart.triggers);
    let events = around.events;
    events.iter().any(|event| {
        lists(listed, *event)
            || row.predicates.len > 0
                && row
                    .predicates
                    .of(&chart.predicates)
                    .iter()
                    .any(|p| hook.predicate(*p, *event, &mut around.view(chart)))
    })
}

/// Whether the sorted list has the event.
fn lists(sorted: &[EventId], event: EventId) -> bool {
    // Up to a cache line of ids is gone through faster than searched.
    if sorted.len() <= 16 { sorted.contains(&event) } else { sorted.binary_search(&event).is_ok() }
}
