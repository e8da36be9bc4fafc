//! What a transition does when it is taken: what it leaves and enters, that behind connectors with it, and what is raised on that way.

use crate::statechart::{Chart, EdgeId, NodeId, NodeKind, RaiseMoment, RaiseSite};
use rustc_hash::FxHashSet;

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
