//! Where everything goes: layered layout (ranks, fewest crossings, straight edges), a layer inside each group.
//!
//! Coordinates here are *along* the direction of the ranks and *across* it; only the writer knows which is x. Each group
//! is laid out by itself, innermost first, and then is one item of its parent's layout. An edge between two levels is
//! cut at the borders it crosses: in each level its part is an edge to the border, and the place where it meets the
//! border is where the parent's part begins.

mod absolute;
mod chains;
mod level;
mod order;
mod place;
mod rank;

use super::picture::{Direction, Picture, Shape};
use super::text;

/// Font size of headings, pixels.
pub const TITLE: f64 = 13.0;
/// Font size of everything else, pixels.
pub const SMALL: f64 = 11.0;
/// Height of a line of small text and of a port, pixels.
pub const LINE: f64 = 16.0;

/// A straight run of an edge along the direction of the ranks; curves join one run to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
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
    pub runs: Vec<Run>,
    /// A loop from a node to itself beside it instead of runs: the node's rectangle.
    pub looped: Option<Rect>,
    /// Where its label stands.
    pub label: Option<Rect>,
}

/// A picture's coordinates.
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
pub fn text_size(picture: &Picture, index: usize) -> (f64, f64) {
    let node = &picture.nodes[index];
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
            (width.max(44.0), header(picture, index) + rows * LINE + if rows > 0.0 { 8.0 } else { 0.0 })
        }
    }
}

/// Height of a node's heading and lines.
pub fn header(picture: &Picture, index: usize) -> f64 {
    #[allow(clippy::cast_precision_loss)]
    let lines = picture.nodes[index].lines.len() as f64;
    28.0 + lines * (LINE - 2.0) + if lines > 0.0 { 2.0 } else { 0.0 }
}

/// Size of a label, width and height.
pub fn label_size(lines: &[String]) -> (f64, f64) {
    #[allow(clippy::cast_precision_loss)]
    let height = lines.len() as f64 * (LINE - 2.0) + 4.0;
    (lines.iter().map(|l| text::width(l, SMALL)).fold(0.0, f64::max) + 10.0, height)
}

/// Coordinates for `picture`.
pub fn layout(picture: &Picture) -> Layout {
    let mut levels = level::Levels::new(picture);
    let size = levels.lay();
    let mut nodes = vec![Rect::default(); picture.nodes.len()];
    let mut routes = vec![Route::default(); picture.edges.len()];
    levels.write(None, (0.0, 0.0), &mut nodes, &mut routes);
    let size = match picture.direction {
        Direction::Right => size,
        Direction::Down => (size.1, size.0),
    };
    Layout { nodes, routes, size }
}
