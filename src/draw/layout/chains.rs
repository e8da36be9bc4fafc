//! The edges of a level as chains of places, one in each layer they pass.

use super::super::diagram::{Diagram, RankDirection};
use super::label_size;
use std::collections::BTreeMap;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Side {
    Start,
    End,
}

/// An edge that comes from or goes to something outside this level.
#[derive(Debug, Clone, Copy)]
pub(super) struct Border {
    pub(super) edge: usize,
    /// The item of this level that it leaves from or goes to.
    pub(super) item: usize,
    pub(super) side: Side,
    /// Whether the edge's source is inside.
    pub(super) outgoing: bool,
    pub(super) stage: i64,
    pub(super) labelled: bool,
}

/// A vertex of the layered graph: an item, or a place where an edge passes a layer.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Vertex {
    pub(super) layer: usize,
    pub(super) len: f64,
    pub(super) wide: f64,
}

/// An edge as a chain of vertices, first to last layer.
pub(super) struct Chain {
    pub(super) edge: usize,
    pub(super) stage: i64,
    pub(super) vertices: Vec<usize>,
    /// Whether the edge runs from the last vertex to the first.
    pub(super) backwards: bool,
    /// Whether its ends turn round beside the items (out-port and in-port of a connection that runs backwards).
    pub(super) turns: Option<(usize, usize)>,
    pub(super) label: Option<usize>,
    pub(super) starts_at_border: bool,
    pub(super) ends_at_border: bool,
}

/// A level as a layered graph: items, then the places where edges pass a layer.
pub(super) struct Layered {
    pub(super) vertices: Vec<Vertex>,
    pub(super) layers: Vec<Vec<usize>>,
    pub(super) chains: Vec<Chain>,
    /// Pairs of one layer that want to be near each other.
    pub(super) near: Vec<(usize, usize)>,
}

impl Layered {
    /// From the items' vertices and ranks, the edges between items (edge, item, item) and those to the outside. Items
    /// stand in the even layers from 2 on; labels in the odd ones.
    pub(super) fn new(
        diagram: &Diagram,
        mut vertices: Vec<Vertex>,
        rank: &[usize],
        inner: &[(usize, usize, usize)],
        borders: &[Border],
        index: &BTreeMap<usize, usize>,
    ) -> Self {
        let items = vertices.len();
        let layer_count = layer_count(rank);
        let layer_of = |i: usize| rank[i] * 2 + 2;
        let mut layers: Vec<Vec<usize>> = vec![Vec::new(); layer_count];
        for (i, v) in vertices.iter().enumerate() {
            layers[v.layer].push(i);
        }
        let mut chains: Vec<Chain> = Vec::new();
        let mut near: Vec<(usize, usize)> = Vec::new();
        let pass = |layers: &mut Vec<Vec<usize>>, vertices: &mut Vec<Vertex>, layer: usize| {
            vertices.push(Vertex { layer, len: 0.0, wide: 6.0 });
            layers[layer].push(vertices.len() - 1);
            vertices.len() - 1
        };
        for &(e, a, b) in inner {
            let edge = &diagram.edges[e];
            let backwards = rank[a] > rank[b] || a == b;
            let (upper, lower) = if backwards { (b, a) } else { (a, b) };
            let turning = backwards && edge.is_of_ports();
            let mut chain = Vec::new();
            let (first, last) = (layer_of(upper), layer_of(lower));
            if turning {
                for layer in first..=last {
                    chain.push(pass(&mut layers, &mut vertices, layer));
                }
                near.push((chain[0], upper));
                near.push((chain[chain.len() - 1], lower));
            } else {
                chain.push(upper);
                for layer in first + 1..last {
                    chain.push(pass(&mut layers, &mut vertices, layer));
                }
                chain.push(lower);
            }
            chains.push(Chain {
                edge: e,
                stage: 0,
                label: None,
                vertices: chain,
                backwards,
                turns: turning.then_some((a, b)),
                starts_at_border: false,
                ends_at_border: false,
            });
        }
        for b in borders {
            let item = index[&b.item];
            let mut chain = Vec::new();
            let at = layer_of(item);
            let start = b.side == Side::Start;
            if start {
                for layer in 0..at {
                    chain.push(pass(&mut layers, &mut vertices, layer));
                }
                chain.push(item);
            } else {
                chain.push(item);
                for layer in at + 1..layer_count {
                    chain.push(pass(&mut layers, &mut vertices, layer));
                }
            }
            chains.push(Chain {
                edge: b.edge,
                stage: b.stage,
                label: b.labelled.then_some(0),
                vertices: chain,
                backwards: start == b.outgoing,
                turns: None,
                starts_at_border: start,
                ends_at_border: !start,
            });
        }
        // A label stands where its edge passes between two ranks, in the middle of its way.
        for chain in &mut chains {
            let lines = &diagram.edges[chain.edge].label;
            let carries = chain.label.take().is_some() || (!chain.starts_at_border && !chain.ends_at_border);
            if lines.is_empty() || !carries {
                continue;
            }
            let between: Vec<usize> =
                chain.vertices.iter().copied().filter(|v| *v >= items && vertices[*v].layer % 2 == 1).collect();
            if let Some(&v) = between.get(between.len() / 2) {
                let (w, h) = label_size(lines);
                let (len, wide) = match diagram.direction {
                    RankDirection::Right => (w, h),
                    RankDirection::Down => (h, w),
                };
                vertices[v] = Vertex { len: len + 6.0, wide, ..vertices[v] };
                chain.label = Some(v);
            }
        }

        Self { vertices, layers, chains, near }
    }
}

/// Layers that items of these ranks need, with those for labels and borders.
pub(super) fn layer_count(rank: &[usize]) -> usize {
    rank.iter().max().map_or(0, |r| r + 1) * 2 + 3
}

/// Where each layer begins and ends: as thick as its thickest vertex, and more room after it where edges have far to go
/// across (`reach`).
pub(super) fn spans(layers: &[Vec<usize>], vertices: &[Vertex], reach: &[f64], begin: f64) -> (Vec<f64>, Vec<f64>) {
    let mut start = vec![0.0f64; layers.len()];
    let mut end = vec![0.0f64; layers.len()];
    let first = layers.iter().position(|l| !l.is_empty()).unwrap_or(0);
    let last = layers.iter().rposition(|l| !l.is_empty()).unwrap_or(0);
    let mut at = begin;
    for (l, layer) in layers.iter().enumerate() {
        start[l] = at;
        at += layer.iter().map(|v| vertices[*v].len).fold(0.0, f64::max);
        end[l] = at;
        if (first..last).contains(&l) {
            at += (13.0 + reach[l] * 0.09).min(58.0);
        }
    }
    (start, end)
}
