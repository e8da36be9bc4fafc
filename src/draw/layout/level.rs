//! One level: the children of a group (or of the picture) and the parts of edges that run between them.

use super::chains::{Border, Chain, Layered, Side, Vertex, layer_count, spans};
use super::order::{Segment, order};
use super::place::{Tie, place};
use super::rank::ranks;
use super::{LINE, Run, header, label_size, text_size};
use crate::draw::picture::{Direction, Picture, Shape, Subject};
use std::collections::BTreeMap;

/// The place of an item in its level: its start and its extent, along and across.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Slot {
    pub(super) along: f64,
    pub(super) across: f64,
    pub(super) len: f64,
    pub(super) wide: f64,
}

/// The part of an edge in one level.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) edge: usize,
    /// Parts are joined in this order: from the innermost level of the source outwards, then inwards to the target.
    pub(super) stage: i64,
    pub(super) runs: Vec<Run>,
    pub(super) label: Option<Slot>,
    pub(super) looped: Option<usize>,
}

/// A level with coordinates, relative to its own start.
#[derive(Debug, Default)]
pub(super) struct Laid {
    pub(super) items: Vec<(usize, Slot)>,
    pub(super) parts: Vec<Part>,
}

/// All levels of a picture.
pub(super) struct Levels<'a> {
    pub(super) picture: &'a Picture,
    /// Of each group, at its index + 1; of the picture at 0.
    pub(super) children: Vec<Vec<usize>>,
    edges: Vec<Vec<usize>>,
    depth: Vec<i64>,
    pub(super) laid: Vec<Laid>,
}

pub(super) fn slot_of(level: Option<usize>) -> usize {
    level.map_or(0, |g| g + 1)
}

impl<'a> Levels<'a> {
    pub(super) fn new(picture: &'a Picture) -> Self {
        let count = picture.nodes.len();
        let mut children = vec![Vec::new(); count + 1];
        let mut depth = vec![0; count + 1];
        for (i, node) in picture.nodes.iter().enumerate() {
            children[slot_of(node.parent)].push(i);
            depth[i + 1] = depth[slot_of(node.parent)] + 1;
        }
        let mut levels = Self {
            picture,
            children,
            edges: vec![Vec::new(); count + 1],
            depth,
            laid: (0..=count).map(|_| Laid::default()).collect(),
        };
        for (i, edge) in picture.edges.iter().enumerate() {
            let level = levels.common(edge.from, edge.to);
            levels.edges[slot_of(level)].push(i);
        }
        levels
    }

    /// The innermost level that holds both ends; of a group and something in it, the group's own.
    fn common(&self, a: usize, b: usize) -> Option<usize> {
        if a == b {
            return self.picture.nodes[a].parent;
        }
        let mut a = Some(a);
        let mut b = Some(b);
        while a != b {
            if self.depth[slot_of(a)] >= self.depth[slot_of(b)] {
                a = self.picture.nodes[a.expect("deeper than the top")].parent;
            } else {
                b = self.picture.nodes[b.expect("deeper than the top")].parent;
            }
        }
        a
    }

    /// The item of `level` that is or contains `node`; none when `node` is the level's own group.
    fn item_in(&self, level: Option<usize>, node: usize) -> Option<usize> {
        let mut at = node;
        loop {
            if Some(at) == level {
                return None;
            }
            let parent = self.picture.nodes[at].parent;
            if parent == level {
                return Some(at);
            }
            at = parent?;
        }
    }

    fn has_ports(&self, node: usize) -> bool {
        !self.picture.nodes[node].ins.is_empty() || !self.picture.nodes[node].outs.is_empty()
    }

    /// Lays out everything. Answers its extent, along and across.
    pub(super) fn lay(&mut self) -> (f64, f64) {
        self.lay_with_ports(None, &[]).0
    }

    /// Lays out a level whose edges to the outside are `borders`. Answers its extent and where each of them meets the
    /// border (edge, whether its source is inside).
    #[allow(clippy::too_many_lines)]
    fn lay_with_ports(
        &mut self,
        level: Option<usize>,
        borders: &[Border],
    ) -> ((f64, f64), BTreeMap<(usize, bool), f64>) {
        let picture = self.picture;
        let items = self.children[slot_of(level)].clone();
        let index: BTreeMap<usize, usize> = items.iter().enumerate().map(|(i, n)| (*n, i)).collect();
        let mut borders = borders.to_vec();
        let mut inner: Vec<(usize, usize, usize)> = Vec::new();
        let mut loops: Vec<(usize, usize)> = Vec::new();
        for &e in &self.edges[slot_of(level)] {
            let edge = &picture.edges[e];
            match (self.item_in(level, edge.from), self.item_in(level, edge.to)) {
                (Some(a), Some(b)) if a == b && edge.from_port.is_none() => loops.push((e, a)),
                (Some(a), Some(b)) => inner.push((e, index[&a], index[&b])),
                (None, Some(item)) => {
                    borders.push(Border {
                        edge: e,
                        item,
                        side: Side::Start,
                        outgoing: false,
                        stage: 0,
                        labelled: true,
                    });
                }
                (Some(item), None) => {
                    borders.push(Border { edge: e, item, side: Side::End, outgoing: true, stage: 0, labelled: true });
                }
                (None, None) => {}
            }
        }
        let mut rank = ranks(items.len(), &inner.iter().map(|(_, a, b)| (*a, *b)).collect::<Vec<_>>());
        // Plans without arrows between them stand one below the other, as they are read.
        if level.is_none() && picture.subject == Subject::Plan && inner.is_empty() {
            rank.fill(0);
        }
        let layer_count = layer_count(&rank);
        let layer_of = |i: usize| rank[i] * 2 + 2;

        // Groups first: their extent, and where edges meet their border.
        let mut vertices: Vec<Vertex> = Vec::with_capacity(items.len());
        let mut ports: Vec<BTreeMap<(usize, bool), f64>> = vec![BTreeMap::new(); items.len()];
        for (i, &node) in items.iter().enumerate() {
            let (w, h) = text_size(picture, node);
            let (mut len, mut wide) = match picture.direction {
                Direction::Right => (w, h),
                Direction::Down => (h, w),
            };
            if picture.nodes[node].shape == Shape::Group && !self.children[node + 1].is_empty() {
                let mut crossing: Vec<Border> = Vec::new();
                for &(e, a, b) in &inner {
                    let edge = &picture.edges[e];
                    for (end, outgoing, deep) in [(a, true, edge.from), (b, false, edge.to)] {
                        if end == i && deep != node {
                            let other = if outgoing { b } else { a };
                            let side = if rank[i] < rank[other] { Side::End } else { Side::Start };
                            let depth = self.depth[node + 1];
                            let stage = if outgoing { -depth } else { depth };
                            let item = self.item_in(Some(node), deep).expect("inside the group");
                            crossing.push(Border { edge: e, item, side, outgoing, stage, labelled: false });
                        }
                    }
                }
                for b in borders.iter().filter(|b| b.item == node) {
                    let edge = &picture.edges[b.edge];
                    let deep = if b.outgoing { edge.from } else { edge.to };
                    if deep != node {
                        let depth = self.depth[node + 1];
                        let stage = if b.outgoing { -depth } else { depth };
                        let item = self.item_in(Some(node), deep).expect("inside the group");
                        crossing.push(Border { item, stage, labelled: false, ..*b });
                    }
                }
                let (size, met) = self.lay_with_ports(Some(node), &crossing);
                (len, wide) = size;
                ports[i] = met;
            }
            vertices.push(Vertex { layer: layer_of(i), len, wide });
        }
        // What an item takes across beside its own box: the loop to itself.
        let mut beside = vec![0.0f64; items.len()];
        let mut tall = vec![0.0f64; items.len()];
        for (e, node) in &loops {
            let (w, h) = label_size(&picture.edges[*e].label);
            beside[index[node]] += w + 30.0;
            tall[index[node]] = tall[index[node]].max(h);
        }
        let own: Vec<Vertex> = vertices.clone();
        for (v, (extra, tall)) in vertices.iter_mut().zip(beside.iter().zip(&tall)) {
            match picture.direction {
                Direction::Down => (v.wide, v.len) = (v.wide + extra, v.len.max(*tall)),
                Direction::Right => (v.len, v.wide) = (v.len + extra, v.wide.max(*tall)),
            }
        }

        let Layered { vertices, mut layers, chains, near } =
            Layered::new(picture, vertices, &rank, &inner, &borders, &index);

        // Where a chain meets an item: a port's row, the place on a group's border, or (not known yet) somewhere.
        let fixed = |chain: &Chain, v: usize, source: bool| -> Option<f64> {
            if v >= items.len() {
                return None;
            }
            let node = items[v];
            let edge = &picture.edges[chain.edge];
            if let Some(at) = ports[v].get(&(chain.edge, source)) {
                return Some(at - own[v].wide / 2.0);
            }
            let port = if source { edge.from_port } else { edge.to_port };
            let ends_here = if source { edge.from == node } else { edge.to == node };
            if picture.direction == Direction::Right
                && ends_here
                && let Some(row) = port
                && self.has_ports(node)
            {
                #[allow(clippy::cast_precision_loss)]
                return Some(header(picture, node) + (row as f64 + 0.5) * LINE - own[v].wide / 2.0);
            }
            None
        };
        // Offsets are from the vertex' middle; a loop beside a box moves the box' middle to the start.
        let shift = |v: usize| -> f64 { if v < items.len() { (own[v].wide - vertices[v].wide) / 2.0 } else { 0.0 } };
        let fraction = |v: usize, offset: Option<f64>| -> f64 {
            offset.map_or(0.5, |o| {
                (o + own.get(v).map_or(0.0, |v| v.wide / 2.0)) / own.get(v).map_or(1.0, |v| v.wide.max(1.0))
            })
        };
        let mut segments = Vec::new();
        for chain in &chains {
            for pair in chain.vertices.windows(2) {
                segments.push(Segment {
                    upper: pair[0],
                    upper_at: fraction(pair[0], fixed(chain, pair[0], !chain.backwards)),
                    lower: pair[1],
                    lower_at: fraction(pair[1], fixed(chain, pair[1], chain.backwards)),
                });
            }
        }
        order(&mut layers, vertices.len(), &segments, &near);
        let mut place_in_layer = vec![0usize; vertices.len()];
        for layer in &layers {
            for (i, v) in layer.iter().enumerate() {
                place_in_layer[*v] = i;
            }
        }
        // Edges without a port share the side of their item in the order of their other ends.
        let mut first_at: Vec<f64> = chains.iter().map(|_| 0.0).collect();
        let mut last_at = first_at.clone();
        // (place of the other end, chain, whether it is the chain's first vertex) of the users of one side.
        type Users = Vec<(usize, usize, bool)>;
        let mut sharing: BTreeMap<(usize, Side), Users> = BTreeMap::new();
        for (c, chain) in chains.iter().enumerate() {
            let n = chain.vertices.len();
            if chain.turns.is_some() || n < 2 {
                continue;
            }
            let (first, last) = (chain.vertices[0], chain.vertices[n - 1]);
            match fixed(chain, first, !chain.backwards) {
                Some(at) => first_at[c] = at + shift(first),
                None if first < items.len() => {
                    sharing.entry((first, Side::End)).or_default().push((place_in_layer[chain.vertices[1]], c, true));
                }
                None => {}
            }
            match fixed(chain, last, chain.backwards) {
                Some(at) => last_at[c] = at + shift(last),
                None if last < items.len() => {
                    sharing.entry((last, Side::Start)).or_default().push((
                        place_in_layer[chain.vertices[n - 2]],
                        c,
                        false,
                    ));
                }
                None => {}
            }
        }
        for ((item, _), mut users) in sharing {
            users.sort_unstable();
            #[allow(clippy::cast_precision_loss)]
            let n = users.len() as f64;
            let step = (own[item].wide * 0.8 / n).min(26.0);
            for (k, (_, c, first)) in users.into_iter().enumerate() {
                #[allow(clippy::cast_precision_loss)]
                let at = (k as f64 - (n - 1.0) / 2.0) * step + shift(item);
                if first { first_at[c] = at } else { last_at[c] = at }
            }
        }
        let mut ties = Vec::new();
        for (c, chain) in chains.iter().enumerate() {
            let n = chain.vertices.len();
            for (k, pair) in chain.vertices.windows(2).enumerate() {
                let a_at = if k == 0 { first_at[c] } else { 0.0 };
                let b_at = if k + 2 == n { last_at[c] } else { 0.0 };
                let passes = usize::from(pair[0] >= items.len()) + usize::from(pair[1] >= items.len());
                let weight = [1.0, 2.0, 24.0][passes];
                ties.push(Tie { a: pair[0], a_at, b: pair[1], b_at, weight });
            }
        }
        for (a, b) in &near {
            ties.push(Tie { a: *a, a_at: 0.0, b: *b, b_at: 0.0, weight: 0.05 });
        }
        let wides: Vec<f64> = vertices.iter().map(|v| v.wide).collect();
        let count = items.len();
        let gap = |a: usize, b: usize| match (a < count, b < count) {
            (true, true) => 26.0,
            (false, false) => 10.0,
            _ => 18.0,
        };
        let middles = place(&layers, &wides, gap, &ties);

        // Along: each layer as thick as its thickest vertex; more room where edges have far to go across.
        let mut reach = vec![0.0f64; layer_count];
        for (c, chain) in chains.iter().enumerate() {
            let n = chain.vertices.len();
            for (k, pair) in chain.vertices.windows(2).enumerate() {
                let a = middles[pair[0]] + if k == 0 { first_at[c] } else { 0.0 };
                let b = middles[pair[1]] + if k + 2 == n { last_at[c] } else { 0.0 };
                let layer = vertices[pair[0]].layer;
                reach[layer] = reach[layer].max((a - b).abs());
            }
        }
        let pads = self.pads(level);
        let (start, end) = spans(&layers, &vertices, &reach, pads.0);
        let at = end.last().copied().unwrap_or(pads.0);
        let mut along_size = at + pads.1;
        let low = (0..vertices.len()).map(|v| middles[v] - wides[v] / 2.0).fold(f64::INFINITY, f64::min);
        let high = (0..vertices.len()).map(|v| middles[v] + wides[v] / 2.0).fold(f64::NEG_INFINITY, f64::max);
        let content = if vertices.is_empty() { 0.0 } else { high - low };
        let mut across_size = content + pads.2 + pads.3;
        let mut offset = pads.2 - if vertices.is_empty() { 0.0 } else { low };
        if let Some(group) = level {
            let wanted = text_size(picture, group).0;
            match picture.direction {
                Direction::Down if across_size < wanted => {
                    offset += (wanted - across_size) / 2.0;
                    across_size = wanted;
                }
                Direction::Right => along_size = along_size.max(wanted),
                Direction::Down => {}
            }
        }

        let mut laid = Laid::default();
        for (i, &node) in items.iter().enumerate() {
            let v = vertices[i];
            let along = match picture.direction {
                // In the middle of a rank of states; columns of components begin at one line.
                Direction::Down => f64::midpoint(start[v.layer], end[v.layer]) - own[i].len / 2.0,
                Direction::Right => start[v.layer],
            };
            let across = middles[i] - v.wide / 2.0 + offset;
            laid.items.push((node, Slot { along, across, len: own[i].len, wide: own[i].wide }));
        }
        let mut met = BTreeMap::new();
        for (c, chain) in chains.iter().enumerate() {
            let n = chain.vertices.len();
            let mut runs: Vec<Run> = Vec::new();
            for (k, &v) in chain.vertices.iter().enumerate() {
                let vertex = vertices[v];
                let (mut from, mut to) = (start[vertex.layer], end[vertex.layer]);
                let mut across = middles[v] + offset;
                if v < count {
                    let slot = laid.items[v].1;
                    across += if k == 0 { first_at[c] } else { last_at[c] };
                    (from, to) = if k == 0 { (slot.along + slot.len, to) } else { (from, slot.along) };
                } else if k == 0 && chain.starts_at_border {
                    from = 0.0;
                } else if k + 1 == n && chain.ends_at_border {
                    to = along_size;
                }
                runs.push(Run { from, to, across, heading: 1.0 });
            }
            if chain.starts_at_border || chain.ends_at_border {
                let v = if chain.starts_at_border { chain.vertices[0] } else { chain.vertices[n - 1] };
                let source = chain.starts_at_border == chain.backwards;
                met.insert((chain.edge, source), middles[v] + offset);
            }
            if chain.backwards {
                runs.reverse();
                for run in &mut runs {
                    (run.from, run.to, run.heading) = (run.to, run.from, -1.0);
                }
            }
            if let Some((a, b)) = chain.turns {
                let at = |item: usize, source: bool| {
                    laid.items[item].1.across + own[item].wide / 2.0 + fixed(chain, item, source).unwrap_or(0.0)
                };
                let (sa, sb) = (laid.items[a].1, laid.items[b].1);
                let out =
                    Run { from: sa.along + sa.len, to: end[vertices[a].layer], across: at(a, true), heading: 1.0 };
                let back = Run { from: start[vertices[b].layer], to: sb.along, across: at(b, false), heading: 1.0 };
                runs.insert(0, out);
                runs.push(back);
            }
            let label = chain.label.map(|v| {
                let vertex = vertices[v];
                Slot {
                    along: f64::midpoint(start[vertex.layer], end[vertex.layer]) - vertex.len / 2.0 + 3.0,
                    across: middles[v] - vertex.wide / 2.0 + offset,
                    len: vertex.len - 6.0,
                    wide: vertex.wide,
                }
            });
            laid.parts.push(Part { edge: chain.edge, stage: chain.stage, runs, label, looped: None });
        }
        // Several loops of one node: their labels stand side by side.
        let mut taken: BTreeMap<usize, f64> = BTreeMap::new();
        for (e, node) in loops {
            let slot = laid.items[index[&node]].1;
            let (w, h) = label_size(&picture.edges[e].label);
            let taken = taken.entry(node).or_insert(24.0);
            let label = match picture.direction {
                Direction::Down => Slot {
                    along: slot.along + slot.len / 2.0 - h / 2.0,
                    across: slot.across + slot.wide + *taken,
                    len: h,
                    wide: w,
                },
                Direction::Right => {
                    Slot { along: slot.along + slot.len + *taken, across: slot.across, len: w, wide: h }
                }
            };
            *taken += w + 6.0;
            laid.parts.push(Part { edge: e, stage: 0, runs: Vec::new(), label: Some(label), looped: Some(node) });
        }
        self.laid[slot_of(level)] = laid;
        ((along_size, across_size), met)
    }

    /// Room around the content of a level: along before and after, across before and after.
    fn pads(&self, level: Option<usize>) -> (f64, f64, f64, f64) {
        let Some(group) = level else { return (0.0, 0.0, 0.0, 0.0) };
        let top = header(self.picture, group) + 8.0;
        match self.picture.direction {
            Direction::Down => (top, 16.0, 18.0, 18.0),
            Direction::Right => (16.0, 16.0, top, 16.0),
        }
    }
}
