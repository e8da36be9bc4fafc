//! The coordinators of a session, side by side: each on its own thread, with its own states that mean *up* and *down*.
//!
//! Events of operators and components go to all of them; an answer goes to the one that asked; what one emits is an event
//! of the others that wait for it. A frame belongs to whoever asked for it, so none undoes another's.

use super::hub::Hub;
use super::routes::{Junction, ToConfigurator};
use crate::configurator::Requester;
use crate::coordinator::CoordinatorHandle;
use crate::functions::Opener;
use crate::model::{Deployment, EventName, Ident};
use crate::statechart::{Chart, EdgeId, EventId, NodeId};
use crate::time::{Clock, lock};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

/// One coordinator of a session.
pub(super) struct CoordinatorPart {
    pub name: Ident,
    /// The subsystem that it is one of.
    pub of: Option<Ident>,
    pub chart: Arc<Chart>,
    pub coordinator: CoordinatorHandle,
    pub up: Option<NodeId>,
    pub down: Option<NodeId>,
    /// It has functions: they see every event, also one that no transition lists.
    pub sees_all: bool,
    /// The beginning of the last reaction of which it was told that it takes long.
    pub told_slow: AtomicU64,
    failed: Vec<(NodeId, String)>,
}

impl CoordinatorPart {
    /// Starts all coordinators of a deployment and makes them known to the junction.
    pub fn start_all(
        deployment: &Deployment,
        charts: impl Iterator<Item = (Arc<Chart>, Option<Opener>)>,
        clock: &Clock,
        hub: &Arc<Hub>,
        junction: &Arc<Junction>,
    ) -> Vec<Self> {
        let several = deployment.coordinators.len() > 1;
        // None reacts before all are known: what the first one emits on its first entry must find the others.
        let mut known = lock(&junction.coordinators);
        let mut parts = Vec::new();
        for (own, (chart, functions)) in deployment.coordinators.iter().zip(charts) {
            let name = own.name;
            let requester = Requester::Coordinator(name.into());
            let listener = ToConfigurator {
                hub: hub.clone(),
                junction: Arc::downgrade(junction),
                name: requester,
                prefix: if several { format!("{name}:") } else { String::new() },
                down: chart.find(&own.down).ok(),
                is_down: false,
                untold: false,
                begins: false,
                led: None,
            };
            let thread = if several { format!("coordinator {name}") } else { "coordinator".to_owned() };
            let sees_all = functions.is_some();
            let coordinator = match functions {
                None => CoordinatorHandle::start(&thread, chart.clone(), clock, listener),
                Some(opener) => {
                    let time = clock.clone();
                    let open = move || opener.open(Some(time)).map_err(|failure| failure.to_string());
                    CoordinatorHandle::start_with(&thread, chart.clone(), clock, listener, open)
                }
            };
            known.push((requester, coordinator.clone()));
            let state = |name: &str| chart.find(name).ok();
            parts.push(Self {
                name,
                of: own.of,
                up: state(&own.up),
                down: state(&own.down),
                sees_all,
                told_slow: AtomicU64::new(u64::MAX),
                failed: own.failed.iter().filter_map(|n| state(n).map(|id| (id, n.clone()))).collect(),
                chart: chart.clone(),
                coordinator,
            });
        }
        parts
    }

    /// Its states of that name, which may have the coordinator's name before it.
    pub fn named(&self, state: &str) -> Vec<NodeId> {
        match state.split_once(':') {
            Some((name, own)) if name == self.name.as_str() => self.chart.named(own),
            Some(_) => Vec::new(),
            None => self.chart.named(state),
        }
    }

    /// Whether some state of it may hear an event.
    pub fn may_hear(&self, event: EventName) -> bool {
        self.sees_all || self.chart.event(event) != EventId::OTHER
    }

    /// The transitions that an event may take from where it is.
    pub fn takes(&self, event: EventName) -> impl Iterator<Item = EdgeId> + '_ {
        let (chart, leaf) = (&*self.chart, self.coordinator.leaf());
        let number = chart.event(event);
        let inside = std::iter::successors(leaf, |node| chart.parent(*node)).filter(move |_| number != EventId::OTHER);
        inside.flat_map(|node| chart.outgoing(node)).filter(move |edge| chart.may_trigger(*edge, number))
    }

    /// Its active state that means that the bring-up failed.
    pub fn failed_state(&self) -> Option<&str> {
        self.failed.iter().find(|(id, _)| self.coordinator.is_active(*id)).map(|(_, name)| name.as_str())
    }
}

/// Names that one coordinator raises and another waits for.
pub(super) fn between(charts: &[Arc<Chart>]) -> Vec<EventName> {
    let mut names = Vec::new();
    for (number, chart) in charts.iter().enumerate() {
        let others = || charts.iter().enumerate().filter(move |(other, _)| *other != number);
        let heard = |name| others().any(|(_, other)| other.event(name) != EventId::OTHER);
        names.extend(chart.raises().iter().map(|site| site.name).filter(|name| heard(*name)));
    }
    names
}
