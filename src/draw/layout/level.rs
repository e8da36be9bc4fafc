//! One level: the children of a group (or of the diagram) and the parts of edges that run between them.

use super::chains::{Border, Layered, Side, Vertex, spans};
use super::laying::{Laying, add_loops};
use super::meeting::EdgeMeeting;
use super::rank::ranks;
use super::{LineRun, header, label_size, text_size};
use crate::draw::diagram::{Diagram, RankDirection, Shape, Subject};
use std::collections::BTreeMap;

/// The place of an item in its level: its start and its extent, along and across.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LaidBox {
    pub(super) along: f64,
    pub(super) across: f64,
    pub(super) len: f64,
    pub(super) wide: f64,
}

/// The part of an edge in one level.
#[derive(Debug, Clone)]
pub(super) struct EdgePart {
    pub(super) edge: usize,
    /// Parts are joined in this order: from the innermost level of the source outwards, then inwards to the target.
    pub(super) stage: i64,
    pub(super) runs: Vec<LineRun>,
    pub(super) label: Option<LaidBox>,
    pub(super) looped: Option<usize>,
}

/// A level with coordinates, relative to its own start.
#[derive(Debug, Default)]
pub(super) struct Laid {
    pub(super) items: Vec<(usize, LaidBox)>,
    pub(super) parts: Vec<EdgePart>,
}

/// All levels of a diagram.
pub(super) struct Levels<'a> {
    pub(super) diagram: &'a Diagram,
    /// Of each group, at its index + 1; of the diagram at 0.
    pub(super) children: Vec<Vec<usize>>,
    edges: Vec<Vec<usize>>,
    depth: Vec<i64>,
    pub(super) laid: Vec<Laid>,
}

/// The edges of a level.
struct LevelEdges {
    /// Edge, item, item: between two of its items.
    inner: Vec<(usize, usize, usize)>,
    /// Edge, node: from a node to itself, beside it.
    loops: Vec<(usize, usize)>,
    /// To the outside.
    borders: Vec<Border>,
}

pub(super) fn slot_of(level: Option<usize>) -> usize {
    level.map_or(0, |g| g + 1)
}

impl<'a> Levels<'a> {
    pub(super) fn new(diagram: &'a Diagram) -> Self {
        let count = diagram.nodes.len();
        let mut children = vec![Vec::new(); count + 1];
        let mut depth = vec![0; count + 1];
        for (i, node) in diagram.nodes.iter().enumerate() {
            children[slot_of(node.parent)].push(i);
            depth[i + 1] = depth[slot_of(node.parent)] + 1;
        }
        let mut levels = Self {
            diagram,
            children,
            edges: vec![Vec::new(); count + 1],
            depth,
            laid: (0..=count).map(|_| Laid::default()).collect(),
        };
        for (i, edge) in diagram.edges.iter().enumerate() {
            let level = levels.common(edge.from, edge.to);
            levels.edges[slot_of(level)].push(i);
        }
        levels
    }

    /// The innermost level that holds both ends; of a group and something in it, the group's own.
    fn common(&self, a: usize, b: usize) -> Option<usize> {
        if a == b {
            return self.diagram.nodes[a].parent;
        }
        let mut a = Some(a);
        let mut b = Some(b);
        while a != b {
            if self.depth[slot_of(a)] >= self.depth[slot_of(b)] {
                a = self.diagram.nodes[a.expect("deeper than the top")].parent;
            } else {
                b = self.diagram.nodes[b.expect("deeper than the top")].parent;
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
            let parent = self.diagram.nodes[at].parent;
            if parent == level {
                return Some(at);
            }
            at = parent?;
        }
    }

    /// Lays out everything. Answers its extent, along and across.
    pub(super) fn lay(&mut self) -> (f64, f64) {
        self.lay_with_ports(None, &[]).0
    }

    /// Lays out a level whose edges to the outside are `borders`. Answers its extent and where each of them meets the
    /// border (edge, whether its source is inside).
    fn lay_with_ports(
        &mut self,
        level: Option<usize>,
        borders: &[Border],
    ) -> ((f64, f64), BTreeMap<(usize, bool), f64>) {
        let diagram = self.diagram;
        let items = self.children[slot_of(level)].clone();
        let index: BTreeMap<usize, usize> = items.iter().enumerate().map(|(i, n)| (*n, i)).collect();
        let edges = self.edges_of(level, &index, borders);
        let rank = self.ranks_of(level, items.len(), &edges);
        let (own, ports) = self.boxes(&items, &rank, &edges);
        let vertices = with_loops(diagram, &own, &edges.loops, &index);
        let layered = Layered::new(diagram, vertices, &rank, &edges.inner, &edges.borders, &index);
        let mut meeting = EdgeMeeting { diagram, items: &items, own: &own, ports: &ports, layered };
        meeting.put_in_order();
        let ends = meeting.ends();
        let middles = meeting.middles(&ends);

        let pads = self.pads(level);
        let reach = meeting.reach(&ends, &middles);
        let (start, end) = spans(&meeting.layered.layers, &meeting.layered.vertices, &reach, pads.0);
        let mut size = (end.last().copied().unwrap_or(pads.0) + pads.1, 0.0);
        let (low, high) = bounds(&meeting.layered.vertices, &middles);
        size.1 = high - low + pads.2 + pads.3;
        let mut offset = pads.2 - low;
        if let Some(group) = level {
            // Its title has room.
            let wanted = text_size(diagram, group).0;
            match diagram.direction {
                RankDirection::Down if size.1 < wanted => {
                    offset += (wanted - size.1) / 2.0;
                    size.1 = wanted;
                }
                RankDirection::Right => size.0 = size.0.max(wanted),
                RankDirection::Down => {}
            }
        }

        let laying = Laying {
            meeting: &meeting,
            ends: &ends,
            middles: &middles,
            offset,
            start: &start,
            end: &end,
            size: size.0,
        };
        let placed = laying.items();
        let mut laid = Laid { parts: laying.parts(&placed), items: placed };
        add_loops(&meeting, &edges.loops, &mut laid);
        let met = laying.met();
        self.laid[slot_of(level)] = laid;
        (size, met)
    }

    /// The edges of a level: what they join in it. Those of groups around it cross its border: `borders`, and of its own
    /// those that end at its group.
    fn edges_of(&self, level: Option<usize>, index: &BTreeMap<usize, usize>, borders: &[Border]) -> LevelEdges {
        let mut edges = LevelEdges { inner: Vec::new(), loops: Vec::new(), borders: borders.to_vec() };
        for &e in &self.edges[slot_of(level)] {
            let edge = &self.diagram.edges[e];
            let border = |item: usize, side: Side| {
                let outgoing = side == Side::End;
                Border { edge: e, item, side, outgoing, stage: 0, labelled: true }
            };
            match (self.item_in(level, edge.from), self.item_in(level, edge.to)) {
                (Some(a), Some(b)) if a == b && !edge.is_of_ports() => edges.loops.push((e, a)),
                (Some(a), Some(b)) => edges.inner.push((e, index[&a], index[&b])),
                (None, Some(item)) => edges.borders.push(border(item, Side::Start)),
                (Some(item), None) => edges.borders.push(border(item, Side::End)),
                (None, None) => {}
            }
        }
        edges
    }

    /// The ranks of the items.
    fn ranks_of(&self, level: Option<usize>, count: usize, edges: &LevelEdges) -> Vec<usize> {
        // Plans without arrows between them stand one below the other, as they are read.
        if level.is_none() && self.diagram.subject == Subject::Plan && edges.inner.is_empty() {
            return vec![0; count];
        }
        ranks(count, &edges.inner.iter().map(|(_, a, b)| (*a, *b)).collect::<Vec<_>>())
    }

    /// The boxes of the items, each in its layer. Groups are laid out for that, and tell where edges meet their border.
    fn boxes(
        &mut self,
        items: &[usize],
        rank: &[usize],
        edges: &LevelEdges,
    ) -> (Vec<Vertex>, Vec<BTreeMap<(usize, bool), f64>>) {
        let diagram = self.diagram;
        let mut boxes: Vec<Vertex> = Vec::with_capacity(items.len());
        let mut ports: Vec<BTreeMap<(usize, bool), f64>> = vec![BTreeMap::new(); items.len()];
        for (i, &node) in items.iter().enumerate() {
            let (w, h) = text_size(diagram, node);
            let (mut len, mut wide) = match diagram.direction {
                RankDirection::Right => (w, h),
                RankDirection::Down => (h, w),
            };
            if diagram.nodes[node].shape == Shape::Group && !self.children[node + 1].is_empty() {
                let crossing = self.crossing(i, node, rank, edges);
                ((len, wide), ports[i]) = self.lay_with_ports(Some(node), &crossing);
            }
            boxes.push(Vertex { layer: rank[i] * 2 + 2, len, wide });
        }
        (boxes, ports)
    }

    /// The edges of a level that cross the border of its item `i`, the group `node`.
    fn crossing(&self, i: usize, node: usize, rank: &[usize], edges: &LevelEdges) -> Vec<Border> {
        let depth = self.depth[node + 1];
        let stage = |outgoing: bool| if outgoing { -depth } else { depth };
        let inside = |deep: usize| self.item_in(Some(node), deep).expect("inside the group");
        let mut crossing: Vec<Border> = Vec::new();
        for &(e, a, b) in &edges.inner {
            let edge = &self.diagram.edges[e];
            for (end, outgoing, deep) in [(a, true, edge.from), (b, false, edge.to)] {
                if end == i && deep != node {
                    let other = if outgoing { b } else { a };
                    // One that is about ports turns round outside, where it runs backwards.
                    let end = if edge.is_of_ports() { outgoing } else { rank[i] < rank[other] };
                    let side = if end { Side::End } else { Side::Start };
                    let (item, stage) = (inside(deep), stage(outgoing));
                    crossing.push(Border { edge: e, item, side, outgoing, stage, labelled: false });
                }
            }
        }
        for b in edges.borders.iter().filter(|b| b.item == node) {
            let edge = &self.diagram.edges[b.edge];
            let deep = if b.outgoing { edge.from } else { edge.to };
            if deep != node {
                crossing.push(Border { item: inside(deep), stage: stage(b.outgoing), labelled: false, ..*b });
            }
        }
        crossing
    }

    /// Room around the content of a level: along before and after, across before and after.
    fn pads(&self, level: Option<usize>) -> (f64, f64, f64, f64) {
        let Some(group) = level else { return (0.0, 0.0, 0.0, 0.0) };
        let top = header(self.diagram, group) + 8.0;
        match self.diagram.direction {
            RankDirection::Down => (top, 16.0, 18.0, 18.0),
            RankDirection::Right => (16.0, 16.0, top, 16.0),
        }
    }
}

/// The items with what they take beside their own box: the loops to themselves.
fn with_loops(
    diagram: &Diagram,
    own: &[Vertex],
    loops: &[(usize, usize)],
    index: &BTreeMap<usize, usize>,
) -> Vec<Vertex> {
    let mut beside = vec![(0.0f64, 0.0f64); own.len()];
    for (edge, node) in loops {
        let (w, h) = label_size(&diagram.edges[*edge].label);
        let (extra, tall) = &mut beside[index[node]];
        (*extra, *tall) = (*extra + (w + 30.0), tall.max(h));
    }
    let with = |(own, (extra, tall)): (&Vertex, (f64, f64))| match diagram.direction {
        RankDirection::Down => Vertex { wide: own.wide + extra, len: own.len.max(tall), ..*own },
        RankDirection::Right => Vertex { len: own.len + extra, wide: own.wide.max(tall), ..*own },
    };
    own.iter().zip(beside).map(with).collect()
}

/// From where to where the vertices reach, across.
fn bounds(vertices: &[Vertex], middles: &[f64]) -> (f64, f64) {
    if vertices.is_empty() {
        return (0.0, 0.0);
    }
    let of = |sign: f64| vertices.iter().zip(middles).map(move |(v, middle)| middle + sign * v.wide / 2.0);
    (of(-1.0).fold(f64::INFINITY, f64::min), of(1.0).fold(f64::NEG_INFINITY, f64::max))
}
