//! Where the edges of a level meet its items, and what they ask of the order of items and of their places for that.

use super::chains::{Chain, Layered, Side, Vertex};
use super::order::{Segment, order};
use super::place::{Tie, place};
use super::{LINE, header};
use crate::draw::diagram::{Diagram, RankDirection};
use std::collections::BTreeMap;

/// A level whose edges are chains of vertices, the first of which are its items.
pub(super) struct EdgeMeeting<'a> {
    pub(super) diagram: &'a Diagram,
    pub(super) items: &'a [usize],
    /// The box of each item alone, without the loops beside it.
    pub(super) own: &'a [Vertex],
    /// By item: where edges to what is inside of it meet its border (edge, whether its source is inside).
    pub(super) ports: &'a [BTreeMap<(usize, bool), f64>],
    pub(super) layered: Layered,
}

/// By chain: how far from the middle of its first and of its last vertex it begins and ends.
pub(super) struct ChainEnds {
    pub(super) first: Vec<f64>,
    pub(super) last: Vec<f64>,
}

impl ChainEnds {
    /// How far from its middle the chain `c`, of `n` vertices, meets the vertex `k`.
    fn at(&self, c: usize, k: usize, n: usize) -> f64 {
        if k == 0 {
            self.first[c]
        } else if k + 1 == n {
            self.last[c]
        } else {
            0.0
        }
    }
}

/// (place of the other end, chain, whether it is the chain's first vertex) of those that share one side of an item.
type Users = Vec<(usize, usize, bool)>;

impl EdgeMeeting<'_> {
    /// Where a chain meets an item, from the item's middle: at a port's row, or at the place on a group's border. None: not
    /// known yet.
    pub(super) fn fixed(&self, chain: &Chain, v: usize, source: bool) -> Option<f64> {
        let node = *self.items.get(v)?;
        let edge = &self.diagram.edges[chain.edge];
        if let Some(at) = self.ports[v].get(&(chain.edge, source)) {
            return Some(at - self.own[v].wide / 2.0);
        }
        let (port, end) = if source { (edge.from_port, edge.from) } else { (edge.to_port, edge.to) };
        let (drawn, rows) = (&self.diagram.nodes[node], self.diagram.direction == RankDirection::Right);
        if !rows || end != node || (drawn.ins.is_empty() && drawn.outs.is_empty()) {
            return None;
        }
        #[allow(clippy::cast_precision_loss)]
        port.map(|row| header(self.diagram, node) + (row as f64 + 0.5) * LINE - self.own[v].wide / 2.0)
    }

    /// Offsets are from the vertex' middle; a loop beside a box moves the box' middle to the start.
    fn shift(&self, v: usize) -> f64 {
        self.own.get(v).map_or(0.0, |own| (own.wide - self.layered.vertices[v].wide) / 2.0)
    }

    /// Where a chain meets a vertex, as a part of its width.
    fn fraction(&self, chain: &Chain, v: usize, source: bool) -> f64 {
        let own = self.own.get(v);
        self.fixed(chain, v, source).map_or(0.5, |offset| {
            (offset + own.map_or(0.0, |own| own.wide / 2.0)) / own.map_or(1.0, |own| own.wide.max(1.0))
        })
    }

    /// Brings the layers into an order in which few edges cross.
    pub(super) fn put_in_order(&mut self) {
        let mut segments = Vec::new();
        for chain in &self.layered.chains {
            for pair in chain.vertices.windows(2) {
                segments.push(Segment {
                    upper: pair[0],
                    upper_at: self.fraction(chain, pair[0], !chain.backwards),
                    lower: pair[1],
                    lower_at: self.fraction(chain, pair[1], chain.backwards),
                });
            }
        }
        let Layered { layers, vertices, near, .. } = &mut self.layered;
        order(layers, vertices.len(), &segments, near);
    }

    fn place_in_layer(&self) -> Vec<usize> {
        let mut places = vec![0; self.layered.vertices.len()];
        for layer in &self.layered.layers {
            for (i, v) in layer.iter().enumerate() {
                places[*v] = i;
            }
        }
        places
    }

    /// Where the chains begin and end. Those without a port share the side of their item in the order of their other ends.
    pub(super) fn ends(&self) -> ChainEnds {
        let (chains, count) = (&self.layered.chains, self.items.len());
        let place_in_layer = self.place_in_layer();
        let mut ends = ChainEnds { first: vec![0.0; chains.len()], last: vec![0.0; chains.len()] };
        let mut sharing: BTreeMap<(usize, Side), Users> = BTreeMap::new();
        for (c, chain) in chains.iter().enumerate() {
            let n = chain.vertices.len();
            if chain.turns.is_some() || n < 2 {
                continue;
            }
            let (first, last) = (chain.vertices[0], chain.vertices[n - 1]);
            match self.fixed(chain, first, !chain.backwards) {
                Some(at) => ends.first[c] = at + self.shift(first),
                None if first < count => {
                    let user = (place_in_layer[chain.vertices[1]], c, true);
                    sharing.entry((first, Side::End)).or_default().push(user);
                }
                None => {}
            }
            match self.fixed(chain, last, chain.backwards) {
                Some(at) => ends.last[c] = at + self.shift(last),
                None if last < count => {
                    let user = (place_in_layer[chain.vertices[n - 2]], c, false);
                    sharing.entry((last, Side::Start)).or_default().push(user);
                }
                None => {}
            }
        }
        for ((item, _), users) in sharing {
            self.share(item, users, &mut ends);
        }
        ends
    }

    /// Divides one side of an item among those that meet it there.
    fn share(&self, item: usize, mut users: Users, ends: &mut ChainEnds) {
        users.sort_unstable();
        #[allow(clippy::cast_precision_loss)]
        let n = users.len() as f64;
        let step = (self.own[item].wide * 0.8 / n).min(26.0);
        for (k, (_, c, first)) in users.into_iter().enumerate() {
            #[allow(clippy::cast_precision_loss)]
            let at = (k as f64 - (n - 1.0) / 2.0) * step + self.shift(item);
            if first { ends.first[c] = at } else { ends.last[c] = at }
        }
    }

    /// The middles of all vertices, across.
    pub(super) fn middles(&self, ends: &ChainEnds) -> Vec<f64> {
        let Layered { vertices, layers, chains, near } = &self.layered;
        let count = self.items.len();
        let mut ties = Vec::new();
        for (c, chain) in chains.iter().enumerate() {
            let n = chain.vertices.len();
            for (k, pair) in chain.vertices.windows(2).enumerate() {
                let (a_at, b_at) = (ends.at(c, k, n), ends.at(c, k + 1, n));
                let passes = usize::from(pair[0] >= count) + usize::from(pair[1] >= count);
                let weight = [1.0, 2.0, 24.0][passes];
                ties.push(Tie { a: pair[0], a_at, b: pair[1], b_at, weight });
            }
        }
        for (a, b) in near {
            ties.push(Tie { a: *a, a_at: 0.0, b: *b, b_at: 0.0, weight: 0.05 });
        }
        let wides: Vec<f64> = vertices.iter().map(|v| v.wide).collect();
        let gap = |a: usize, b: usize| match (a < count, b < count) {
            (true, true) => 26.0,
            (false, false) => 10.0,
            _ => 18.0,
        };
        place(layers, &wides, gap, &ties)
    }

    /// By layer: how far the edges that leave it have to go across.
    pub(super) fn reach(&self, ends: &ChainEnds, middles: &[f64]) -> Vec<f64> {
        let mut reach = vec![0.0f64; self.layered.layers.len()];
        for (c, chain) in self.layered.chains.iter().enumerate() {
            let n = chain.vertices.len();
            for (k, pair) in chain.vertices.windows(2).enumerate() {
                let a = middles[pair[0]] + ends.at(c, k, n);
                let b = middles[pair[1]] + ends.at(c, k + 1, n);
                let layer = self.layered.vertices[pair[0]].layer;
                reach[layer] = reach[layer].max((a - b).abs());
            }
        }
        reach
    }
}
