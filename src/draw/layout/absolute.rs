//! From coordinates relative to each level to those of the diagram.

use super::super::diagram::{RankDirection, Shape};
use super::level::{LaidBox, Levels, slot_of};
use super::{LineRun, Rect, Route};

impl Levels<'_> {
    /// Writes the coordinates of a level that begins at `origin` (along, across) and of all levels in it.
    pub(super) fn write(&self, level: Option<usize>, origin: (f64, f64), nodes: &mut [Rect], routes: &mut [Route]) {
        let mut parts = vec![Vec::new(); routes.len()];
        self.write_level(level, origin, nodes, routes, &mut parts);
        for (route, mut parts) in routes.iter_mut().zip(parts) {
            parts.sort_by_key(|(stage, _)| *stage);
            route.runs = parts.into_iter().flat_map(|(_, runs)| runs).collect();
        }
        for (route, edge) in routes.iter_mut().zip(&self.diagram.edges) {
            if route.looped.is_some() {
                route.looped = Some(nodes[edge.from]);
            }
        }
    }

    fn write_level(
        &self,
        level: Option<usize>,
        (along, across): (f64, f64),
        nodes: &mut [Rect],
        routes: &mut [Route],
        parts: &mut [Vec<(i64, Vec<LineRun>)>],
    ) {
        let rect = |s: &LaidBox| match self.diagram.direction {
            RankDirection::Right => Rect { x: s.along + along, y: s.across + across, w: s.len, h: s.wide },
            RankDirection::Down => Rect { x: s.across + across, y: s.along + along, w: s.wide, h: s.len },
        };
        let laid = &self.laid[slot_of(level)];
        for (node, slot) in &laid.items {
            nodes[*node] = rect(slot);
            if self.diagram.nodes[*node].shape == Shape::Group && !self.children[node + 1].is_empty() {
                self.write_level(Some(*node), (along + slot.along, across + slot.across), nodes, routes, parts);
            }
        }
        for part in &laid.parts {
            if let Some(label) = &part.label {
                routes[part.edge].label = Some(rect(label));
            }
            if part.looped.is_some() {
                routes[part.edge].looped = Some(Rect::default());
            }
            let moved = part.runs.iter().map(|r| LineRun {
                from: r.from + along,
                to: r.to + along,
                across: r.across + across,
                heading: r.heading,
            });
            parts[part.edge].push((part.stage, moved.collect()));
        }
    }
}
