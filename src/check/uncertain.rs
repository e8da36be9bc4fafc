//! What a subsystem tells its parent only when something has failed there, or a monitor reports it: it need not ever come.

use crate::model::{Deployment, EventName, FAULTED, Monitor};
use crate::statechart::{Chart, EdgeId, EventId, RaiseMoment, compile};
use std::collections::BTreeSet;

/// Whether an event tells that a component has failed.
pub(super) fn fails(name: EventName) -> bool {
    name.as_str().ends_with(FAULTED)
}

/// Those of its events, by its own names.
pub fn uncertain_events(own: &Deployment) -> BTreeSet<EventName> {
    let monitored: BTreeSet<EventName> = own.monitors.iter().flat_map(Monitor::events).collect();
    let is_uncertain = |name: &EventName| fails(*name) || monitored.contains(name);
    let (mut uncertain, mut sure) = (BTreeSet::new(), BTreeSet::new());
    for chart in own.own_part().charts().filter_map(|chart| compile(chart).0) {
        for site in chart.raises() {
            let only = match site.when {
                RaiseMoment::Effect(edge) => follows(&chart, edge, &is_uncertain),
                RaiseMoment::Entry(state) => {
                    let into = chart.nodes().flat_map(|node| chart.outgoing(node)).filter(|edge| {
                        let (from, to) = chart.ends(*edge);
                        chart.is_inside(to, state) && !chart.is_inside(from, state)
                    });
                    let into: Vec<EdgeId> = into.collect();
                    !into.is_empty() && into.iter().all(|edge| follows(&chart, *edge, &is_uncertain))
                }
                RaiseMoment::Exit(_) => false,
            };
            _ = if only { uncertain.insert(site.name) } else { sure.insert(site.name) };
        }
    }
    uncertain.retain(|name| !sure.contains(name));
    uncertain
}

/// Whether a transition is taken on nothing else.
fn follows(chart: &Chart, edge: EdgeId, is_uncertain: &impl Fn(&EventName) -> bool) -> bool {
    let name = |event: &EventId| event.listed().and_then(|at| chart.events().get(at));
    chart
        .triggers(edge)
        .is_some_and(|all| !all.is_empty() && all.iter().all(|event| name(event).is_some_and(is_uncertain)))
}
