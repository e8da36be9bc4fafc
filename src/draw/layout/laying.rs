//! The coordinates of a level whose items have found their places: its items, the runs of its edges, and labels.

use super::chains::Chain;
use super::level::{EdgePart, Laid, LaidBox};
use super::meeting::{ChainEnds, EdgeMeeting};
use super::{LineRun, label_size};
use crate::draw::diagram::RankDirection;
use std::collections::BTreeMap;

/// A level in which everything has its place.
pub(super) struct Laying<'a> {
    pub(super) meeting: &'a EdgeMeeting<'a>,
    pub(super) ends: &'a ChainEnds,
    /// Of all vertices, across.
    pub(super) middles: &'a [f64],
    /// What they are moved by.
    pub(super) offset: f64,
    /// Where each layer begins and ends, along.
    pub(super) start: &'a [f64],
    pub(super) end: &'a [f64],
    /// The extent of the level, along.
    pub(super) size: f64,
}

impl Laying<'_> {
    /// The places of the items.
    pub(super) fn items(&self) -> Vec<(usize, LaidBox)> {
        let EdgeMeeting { diagram, items, own, layered, .. } = self.meeting;
        let slot = |(i, node): (usize, &usize)| {
            let v = layered.vertices[i];
            let along = match diagram.direction {
                // In the middle of a rank of states; columns of components begin at one line.
                RankDirection::Down => f64::midpoint(self.start[v.layer], self.end[v.layer]) - own[i].len / 2.0,
                RankDirection::Right => self.start[v.layer],
            };
            let across = self.middles[i] - v.wide / 2.0 + self.offset;
            (*node, LaidBox { along, across, len: own[i].len, wide: own[i].wide })
        };
        items.iter().enumerate().map(slot).collect()
    }

    /// Where edges to the outside meet the border (edge, whether its source is inside).
    pub(super) fn met(&self) -> BTreeMap<(usize, bool), f64> {
        let to_outside = |chain: &&Chain| chain.starts_at_border || chain.ends_at_border;
        let meets = |chain: &Chain| {
            let end = if chain.starts_at_border { 0 } else { chain.vertices.len() - 1 };
            let source = chain.starts_at_border == chain.backwards;
            ((chain.edge, source), self.middles[chain.vertices[end]] + self.offset)
        };
        self.meeting.layered.chains.iter().filter(to_outside).map(meets).collect()
    }

    /// The parts of edges in this level, but for loops.
    pub(super) fn parts(&self, items: &[(usize, LaidBox)]) -> Vec<EdgePart> {
        let part = |(c, chain): (usize, &Chain)| {
            let mut runs = self.runs(c, chain, items);
            if chain.backwards {
                runs.reverse();
                for run in &mut runs {
                    (run.from, run.to, run.heading) = (run.to, run.from, -1.0);
                }
            }
            if let Some(turns) = chain.turns {
                self.turn(chain, turns, items, &mut runs);
            }
            EdgePart { edge: chain.edge, stage: chain.stage, runs, label: self.label(chain), looped: None }
        };
        self.meeting.layered.chains.iter().enumerate().map(part).collect()
    }

    /// A chain's way along, layer by layer.
    fn runs(&self, c: usize, chain: &Chain, items: &[(usize, LaidBox)]) -> Vec<LineRun> {
        let n = chain.vertices.len();
        let run = |(k, &v): (usize, &usize)| {
            let vertex = self.meeting.layered.vertices[v];
            let (mut from, mut to) = (self.start[vertex.layer], self.end[vertex.layer]);
            let mut across = self.middles[v] + self.offset;
            if let Some((_, slot)) = items.get(v) {
                across += if k == 0 { self.ends.first[c] } else { self.ends.last[c] };
                (from, to) = if k == 0 { (slot.along + slot.len, to) } else { (from, slot.along) };
            } else if k == 0 && chain.starts_at_border {
                from = 0.0;
            } else if k + 1 == n && chain.ends_at_border {
                to = self.size;
            }
            LineRun { from, to, across, heading: 1.0 }
        };
        chain.vertices.iter().enumerate().map(run).collect()
    }

    /// The ends of a connection that runs backwards: they turn round beside its items.
    fn turn(&self, chain: &Chain, (a, b): (usize, usize), items: &[(usize, LaidBox)], runs: &mut Vec<LineRun>) {
        let vertices = &self.meeting.layered.vertices;
        let at = |item: usize, source: bool| {
            let fixed = self.meeting.fixed(chain, item, source).unwrap_or(0.0);
            items[item].1.across + self.meeting.own[item].wide / 2.0 + fixed
        };
        let (sa, sb) = (items[a].1, items[b].1);
        let out =
            LineRun { from: sa.along + sa.len, to: self.end[vertices[a].layer], across: at(a, true), heading: 1.0 };
        let back = LineRun { from: self.start[vertices[b].layer], to: sb.along, across: at(b, false), heading: 1.0 };
        runs.insert(0, out);
        runs.push(back);
    }

    fn label(&self, chain: &Chain) -> Option<LaidBox> {
        let v = chain.label?;
        let vertex = self.meeting.layered.vertices[v];
        Some(LaidBox {
            along: f64::midpoint(self.start[vertex.layer], self.end[vertex.layer]) - vertex.len / 2.0 + 3.0,
            across: self.middles[v] - vertex.wide / 2.0 + self.offset,
            len: vertex.len - 6.0,
            wide: vertex.wide,
        })
    }
}

/// Loops (edge, node) beside their items. Of several of one node the labels stand side by side.
pub(super) fn add_loops(meeting: &EdgeMeeting<'_>, loops: &[(usize, usize)], laid: &mut Laid) {
    let mut taken: BTreeMap<usize, f64> = BTreeMap::new();
    for &(edge, node) in loops {
        let (_, slot) = *laid.items.iter().find(|(item, _)| *item == node).expect("a loop of an item");
        let (w, h) = label_size(&meeting.diagram.edges[edge].label);
        let taken = taken.entry(node).or_insert(24.0);
        let label = match meeting.diagram.direction {
            RankDirection::Down => LaidBox {
                along: slot.along + slot.len / 2.0 - h / 2.0,
                across: slot.across + slot.wide + *taken,
                len: h,
                wide: w,
            },
            RankDirection::Right => {
                LaidBox { along: slot.along + slot.len + *taken, across: slot.across, len: w, wide: h }
            }
        };
        *taken += w + 6.0;
        laid.parts.push(EdgePart { edge, stage: 0, runs: Vec::new(), label: Some(label), looped: Some(node) });
    }
}
