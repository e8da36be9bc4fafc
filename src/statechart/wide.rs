//! The outgoing transitions of nodes that have many, by event: so that a step looks at those that its event can start, and not
//! at thousands. The order in which they are tried stays the same.

use super::chart::{Chart, EventId, NodeRow, Span};
use crate::limits;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// What is known of wide nodes; nothing of a chart that has grown.
#[derive(Debug, Clone, Default)]
pub(super) struct Wide {
    /// By node: transitions that may start on any event, or whose functions want to be asked on each.
    always: FxHashMap<u32, Span>,
    /// The others, by the events that they list.
    listed: FxHashMap<(u32, EventId), Span>,
    edges: Vec<u32>,
}

impl Wide {
    pub fn of(chart: &Chart) -> Self {
        let mut wide = Self::default();
        for (node, row) in (0..).zip(&chart.nodes).filter(|(_, row)| is_wide(row)) {
            let mut always: Vec<u32> = Vec::new();
            let mut listed: Vec<(EventId, u32)> = Vec::new();
            for edge in row.out.ids() {
                let row = &chart.edges[edge as usize];
                if row.null || row.guard.is_some() || row.predicates.len > 0 {
                    always.push(edge);
                } else {
                    listed.extend(row.events.of(&chart.triggers).iter().map(|event| (*event, edge)));
                }
            }
            let span = wide.keep(always.into_iter());
            wide.always.insert(node, span);
            // By event, and those of one event in their order.
            listed.sort_unstable();
            listed.dedup();
            for of_event in listed.chunk_by(|a, b| a.0 == b.0) {
                let span = wide.keep(of_event.iter().map(|(_, edge)| *edge));
                wide.listed.insert((node, of_event[0].0), span);
            }
        }
        wide
    }

    fn keep(&mut self, edges: impl Iterator<Item = u32>) -> Span {
        let start = self.edges.len();
        self.edges.extend(edges);
        let number = |n| u32::try_from(n).expect("fewer rows than ids");
        Span { start: number(start), len: number(self.edges.len() - start) }
    }
}

/// Whether a node has so many transitions that its events are looked up.
pub(super) fn is_wide(row: &NodeRow) -> bool {
    row.out.len as usize > limits::CHART_WIDE
}

/// The transitions of a node that these events may start, in the order in which they are tried.
pub(super) fn candidates<'c>(chart: &'c Chart, node: u32, events: &[EventId]) -> Candidates<'c> {
    let row = &chart.nodes[node as usize];
    let known = chart.wide.always.get(&node).filter(|_| is_wide(row));
    let (Some(always), [event]) = (known, events) else { return Candidates::All(row.out.ids()) };
    let listed = chart.wide.listed.get(&(node, *event)).copied().unwrap_or_default();
    Candidates::Some(always.of(&chart.wide.edges), listed.of(&chart.wide.edges))
}

/// See [`candidates`].
pub(super) enum Candidates<'c> {
    All(Range<u32>),
    /// Two lists, each in order.
    Some(&'c [u32], &'c [u32]),
}

impl Iterator for Candidates<'_> {
    type Item = u32;

    fn next(&mut self) -> Option<u32> {
        let (a, b) = match self {
            Self::All(range) => return range.next(),
            Self::Some(a, b) => (a, b),
        };
        let list = match (a.first(), b.first()) {
            (Some(first), Some(other)) if first < other => a,
            (_, Some(_)) => b,
            (_, None) => a,
        };
        let (first, rest) = list.split_first()?;
        *list = rest;
        Some(*first)
    }
}
