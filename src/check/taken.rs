//! What a transition does when it is taken: what it leaves and enters, that behind connectors with it, and what is raised on that way.

use crate::model::EventName;
use crate::statechart::{Chart, EdgeId, NodeId, NodeKind, RaiseMoment, RaiseSite};
use rustc_hash::FxHashSet;

/// On so many ways behind connectors a transition is looked at.
const MOST_WAYS: usize = 256;

/// What one transition enters, the innermost first.
pub fn enters(chart: &Chart, edge: EdgeId) -> impl Iterator<Item = NodeId> + '_ {
    let ((_, target), stays) = (chart.ends(edge), chart.least_common_ancestor(edge));
    std::iter::successors(Some(target), |node| chart.parent(*node)).take_while(move |node| *node != stays)
}

/// What is raised where a transition is taken.
pub fn raised_by(chart: &Chart, edge: EdgeId) -> impl Iterator<Item = &RaiseSite> + '_ {
    let taken = Taken::of(chart, edge);
    let by = move |when: RaiseMoment| match when {
        RaiseMoment::Effect(of) => taken.edges.contains(&of),
        RaiseMoment::Entry(node) => taken.entered.contains(&node),
        RaiseMoment::Exit(node) => taken.leaves(chart, node),
    };
    chart.raises().iter().filter(move |site| by(site.when))
}

/// What is raised on each of the ways on which a transition may be taken; none: there are more of them than are looked at.
pub fn raised_on_each_way(chart: &Chart, edge: EdgeId) -> Option<Vec<FxHashSet<EventName>>> {
    let first = Taken::of(chart, edge);
    let left = |site: &RaiseSite| matches!(site.when, RaiseMoment::Exit(node) if first.leaves(chart, node));
    let left: FxHashSet<EventName> = chart.raises().iter().filter(|site| left(site)).map(|site| site.name).collect();
    let mut open = vec![(vec![edge], left)];
    let mut ways = Vec::new();
    while let Some((way, mut raised)) = open.pop() {
        let last = *way.last()?;
        let entered: Vec<NodeId> = enters(chart, last).collect();
        let now = |site: &&RaiseSite| match site.when {
            RaiseMoment::Effect(of) => of == last,
            RaiseMoment::Entry(node) => entered.contains(&node),
            RaiseMoment::Exit(_) => false,
        };
        raised.extend(chart.raises().iter().filter(now).map(|site| site.name));
        let target = chart.ends(last).1;
        let next =
            chart.outgoing(target).filter(|next| chart.kind(target) == NodeKind::Connector && !way.contains(next));
        let before = open.len();
        open.extend(next.map(|next| ([&way[..], &[next]].concat(), raised.clone())));
        if open.len() == before {
            ways.push(raised);
        }
        if open.len() + ways.len() > MOST_WAYS {
            return None;
        }
    }
    Some(ways)
}

/// What a transition does, that behind connectors with it.
pub struct Taken {
    source: NodeId,
    /// What is inside of this stays.
    stays: NodeId,
    edges: FxHashSet<EdgeId>,
    /// The states that it enters.
    pub entered: FxHashSet<NodeId>,
}

impl Taken {
    /// That of one.
    pub fn of(chart: &Chart, edge: EdgeId) -> Self {
        let (source, stays) = (chart.ends(edge).0, chart.least_common_ancestor(edge));
        let mut taken = Self { source, stays, edges: FxHashSet::default(), entered: FxHashSet::default() };
        let mut open = vec![edge];
        while let Some(edge) = open.pop() {
            if !taken.edges.insert(edge) {
                continue;
            }
            let target = chart.ends(edge).1;
            taken.entered.extend(enters(chart, edge));
            if chart.kind(target) == NodeKind::Connector {
                open.extend(chart.outgoing(target));
            }
        }
        taken
    }

    /// Whether a state is left, if it is active: the source, what is in it, and what is around it as far as that goes.
    fn leaves(&self, chart: &Chart, node: NodeId) -> bool {
        let around = chart.is_inside(self.source, node) && node != self.stays && chart.is_inside(node, self.stays);
        chart.is_inside(node, self.source) || around
    }
}
