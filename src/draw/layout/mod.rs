//! Where everything goes: layered layout (ranks, fewest crossings, straight edges), a layer inside each group.
//!
//! Coordinates here are *along* the direction of the ranks and *across* it; only the writer knows which is x. Each group
//! is laid out by itself, innermost first, and then is one item of its parent's layout. An edge between two levels is
//! cut at the borders it crosses: in each level its part is an edge to the border, and the place where it meets the
//! border is where the parent's part begins.

mod absolute;
mod chains;
mod laying;
mod level;
mod meeting;
mod order;
mod place;
mod rank;

use super::diagram::{Diagram, RankDirection, Shape};
use super::text;

/// Font size of headings, pixels.
pub const TITLE: f64 = 13.0;
/// Font size of everything else, pixels.
pub const SMALL: f64 = 11.0;
/// Height of a line of small text and of a port, pixels.
pub const LINE: f64 = 16.0;

/// A straight run of an edge along the direction of the ranks; curves join one run to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineRun {
    /// Where it begins, along.
    pub from: f64,
    /// Where it ends, along.
    pub to: f64,
    /// Where it is, across.
    pub across: f64,
    /// +1 when it goes with the ranks, −1 against.
    pub heading: f64,
}

/// A rectangle in x and y, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Rect {
    /// Left.
    pub x: f64,
    /// Top.
    pub y: f64,
    /// Width.
    pub w: f64,
    /// Height.
    pub h: f64,
}

impl Rect {
    /// Its middle.
    pub fn middle(&self) -> (f64, f64) {
        (self.x + self.w / 2.0, self.y + self.h / 2.0)
    }
}

/// An edge with coordinates.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Route {
    /// Its runs from its beginning to its end.
    pub runs: Vec<LineRun>,
    /// A loop from a node to itself beside it instead of runs: the node's rectangle.
    pub looped: Option<Rect>,
    /// Where its label stands.
    pub label: Option<Rect>,
}

/// A diagram's coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Of each node.
    pub nodes: Vec<Rect>,
    /// Of each edge.
    pub routes: Vec<Route>,
    /// Of the whole.
    pub size: (f64, f64),
}

/// Size of a node's own text, width and height; for a group: what it needs beside its children.
pub fn text_size(diagram: &Diagram, index: usize) -> (f64, f64) {
    let node = &diagram.nodes[index];
    match node.shape {
        Shape::Dot => (12.0, 12.0),
        _ => {
            let widest_line = node.lines.iter().map(|l| text::width(l, SMALL)).fold(0.0, f64::max);
            let ins = node.ins.iter().map(|l| text::width(l, SMALL)).fold(0.0, f64::max);
            let outs = node.outs.iter().map(|l| text::width(l, SMALL)).fold(0.0, f64::max);
            #[allow(clippy::cast_precision_loss)]
            let rows = node.ins.len().max(node.outs.len()) as f64;
            // Bold headings are a tenth wider.
            let width = (text::width(&node.title, TITLE) * 1.1).max(widest_line).max(ins + outs + 24.0) + 24.0;
            (width.max(44.0), header(diagram, index) + rows * LINE + if rows > 0.0 { 8.0 } else { 0.0 })
        }
    }
}

/// Height of a node's heading and lines.
pub fn header(diagram: &Diagram, index: usize) -> f64 {
    #[allow(clippy::cast_precision_loss)]
    let lines = diagram.nodes[index].lines.len() as f64;
    28.0 + lines * (LINE - 2.0) + if lines > 0.0 { 2.0 } else { 0.0 }
}

/// Size of a label, width and height.
pub fn label_size(lines: &[String]) -> (f64, f64) {
    #[allow(clippy::cast_precision_loss)]
    let height = lines.len() as f64 * (LINE - 2.0) + 4.0;
    (lines.iter().map(|l| text::width(l, SMALL)).fold(0.0, f64::max) + 10.0, height)
}

/// Coordinates for `diagram`.
pub fn layout(diagram: &Diagram) -> Layout {
    let mut levels = level::Levels::new(diagram);
    let size = levels.lay();
    let mut nodes = vec![Rect::default(); diagram.nodes.len()];
    let mut routes = vec![Route::default(); diagram.edges.len()];
    levels.write(None, (0.0, 0.0), &mut nodes, &mut routes);
    let size = match diagram.direction {
        RankDirection::Right => size,
        RankDirection::Down => (size.1, size.0),
    };
    Layout { nodes, routes, size }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::diagram::{DiagramEdge, DiagramNode, Subject};

    fn overlap(a: &Rect, b: &Rect) -> bool {
        let slack = 0.01;
        a.x + a.w > b.x + slack && b.x + b.w > a.x + slack && a.y + a.h > b.y + slack && b.y + b.h > a.y + slack
    }

    fn inside(a: &Rect, b: &Rect) -> bool {
        let slack = 0.01;
        a.x >= b.x - slack && a.y >= b.y - slack && a.x + a.w <= b.x + b.w + slack && a.y + a.h <= b.y + b.h + slack
    }

    /// A diagram from a seed: groups in groups, edges between any two nodes, labels, loops.
    fn diagram(seed: u64) -> Diagram {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut next = |n: usize| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 33) as usize % n
        };
        let direction = if next(2) == 0 { RankDirection::Down } else { RankDirection::Right };
        let mut diagram = Diagram::new(Subject::Plan, direction, "seeded");
        let count = 2 + next(18);
        for i in 0..count {
            let mut node = DiagramNode::new(format!("n{i}"), "x".repeat(1 + next(14)));
            node.shape = if next(3) == 0 { Shape::Group } else { Shape::Box };
            let groups: Vec<usize> = (0..i).filter(|g| diagram.nodes[*g].shape == Shape::Group).collect();
            if !groups.is_empty() && next(2) == 0 {
                node.parent = Some(groups[next(groups.len())]);
            }
            diagram.add(node);
        }
        for _ in 0..next(2 * count) {
            let mut edge = DiagramEdge::new(next(count), next(count));
            edge.label = (0..next(3)).map(|_| "label".repeat(1 + next(3))).collect();
            diagram.edges.push(edge);
        }
        diagram
    }

    #[test]
    fn nothing_overlaps_and_everything_is_inside_its_group() {
        for seed in 0..400 {
            let diagram = diagram(seed);
            let Layout { nodes, routes, size } = layout(&diagram);
            let all = Rect { x: 0.0, y: 0.0, w: size.0, h: size.1 };
            for (i, node) in diagram.nodes.iter().enumerate() {
                let around = node.parent.map_or(all, |p| nodes[p]);
                assert!(inside(&nodes[i], &around), "seed {seed}: node {i} {:?} in {around:?}", nodes[i]);
                for j in 0..i {
                    let siblings = diagram.nodes[j].parent == node.parent;
                    assert!(!siblings || !overlap(&nodes[i], &nodes[j]), "seed {seed}: nodes {j} and {i}");
                }
            }
            let labels: Vec<(usize, Rect)> =
                routes.iter().enumerate().filter_map(|(i, r)| Some((i, r.label?))).collect();
            for (k, (i, label)) in labels.iter().enumerate() {
                for (j, other) in &labels[..k] {
                    assert!(!overlap(label, other), "seed {seed}: labels of edges {j} and {i}");
                }
                for (n, node) in diagram.nodes.iter().enumerate() {
                    let leaf = diagram.children(Some(n)).next().is_none();
                    assert!(
                        node.shape == Shape::Group && !leaf || !overlap(label, &nodes[n]),
                        "seed {seed}: label {i} on {n}"
                    );
                }
            }
            for (edge, route) in diagram.edges.iter().zip(&routes) {
                assert!(route.looped.is_some() || route.runs.len() > 1, "seed {seed}: {edge:?} is not drawn");
            }
        }
    }

    #[test]
    fn many_components_are_laid_out_all_the_same() {
        let mut diagram = Diagram::new(Subject::Components, RankDirection::Right, "chain");
        for i in 0..3_000 {
            diagram.add(DiagramNode::new(format!("n{i}"), format!("n{i}")));
            if i > 0 {
                diagram.edges.push(DiagramEdge::new(i - 1, i));
            }
        }
        assert_eq!(layout(&diagram).nodes.len(), 3_000);
    }
}
