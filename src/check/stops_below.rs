//! How a subsystem may be stopped, and what its parent hears of that.

use super::coordinator::{ask_of, edges};
use super::taken::raised_on_each_way;
use crate::model::{Ask, Deployment, EventName, Subsystem};
use crate::statechart::{Chart, EdgeId, EventId, compile};
use rustc_hash::FxHashSet;

/// A stop of a subsystem.
#[derive(Debug, Clone)]
pub struct StopBelow {
    /// The event of safety, as the parent writes it.
    pub event: EventName,
    /// What the parent hears where it comes.
    pub heard: Vec<EventName>,
    /// It comes to the subsystem alone, or to something in it.
    alone: bool,
}

impl StopBelow {
    /// One that comes to the parent, and is given on.
    pub fn given(event: EventName) -> Self {
        Self { event, heard: vec![event], alone: false }
    }

    /// Those of a subsystem alone, and of what is in it, by operators, components and monitors there.
    pub fn alone(subsystem: &Subsystem) -> Vec<Self> {
        let own = subsystem.own.own_part();
        let charts = compiled(own);
        let inside = own.subsystems.iter().flat_map(Self::alone);
        let stops = own.safety.iter().map(|(event, _)| Self::given(*event)).chain(inside);
        let path = subsystem.name;
        let told = |stop: Self| {
            let heard = told(own, &charts, &stop.heard).into_iter().map(|event| event.within(path)).collect();
            Self { event: stop.event.within(path), heard, alone: true }
        };
        stops.map(told).collect()
    }

    /// How to hear of it, in words.
    pub fn hear(&self) -> String {
        let events = || self.heard.iter().map(|event| format!("`{event}`")).collect::<Vec<_>>().join(" or ");
        match (self.alone, self.heard.is_empty()) {
            (false, _) => format!("hear `{}`", self.event),
            (true, false) => format!("hear {} (by which that is told)", events()),
            (true, true) => {
                format!(
                    "let the subsystem emit an event wherever it takes `{}` up (`emits`), and hear that",
                    self.event
                )
            }
        }
    }
}

/// The coordinators of a file.
pub fn compiled(own: &Deployment) -> Vec<Chart> {
    own.charts().filter_map(|chart| compile(chart).0).collect()
}

/// What a file emits on each way on which one of these is taken up, and makes something safe, as far as one of these does; but for where it comes once more.
fn told(own: &Deployment, charts: &[Chart], of: &[EventName]) -> Vec<EventName> {
    let mut ways: Vec<(bool, FxHashSet<EventName>)> = Vec::new();
    for chart in charts {
        let heard: Vec<EventId> = of.iter().map(|of| chart.event(*of)).filter(|of| *of != EventId::OTHER).collect();
        let takes_up = |edge: &EdgeId| {
            !chart.leads_back(*edge) && chart.triggers(*edge).is_some_and(|all| heard.iter().any(|of| all.contains(of)))
        };
        for edge in edges(chart).filter(takes_up) {
            match raised_on_each_way(chart, edge) {
                Some(all) => {
                    ways.extend(all.into_iter().map(|way| (way.iter().any(|name| makes_safe(own, *name)), way)));
                }
                // Of too many ways nothing is told for sure.
                None => ways.push((true, FxHashSet::default())),
            }
        }
    }
    let any_safe = ways.iter().any(|(safe, _)| *safe);
    let ways: Vec<_> = ways.iter().filter(|(safe, _)| *safe || !any_safe).map(|(_, raised)| raised).collect();
    let emitted = own.emits.iter().map(|(event, _)| *event);
    emitted.filter(|event| !ways.is_empty() && ways.iter().all(|raised| raised.contains(event))).collect()
}

/// Whether that name asks for something safe.
fn makes_safe(own: &Deployment, name: EventName) -> bool {
    matches!(ask_of(own, name), Some(Ask::Apply(id)) if own.configuration(id).is_some_and(|of| of.safe))
}

/// Whether an event of safety is given on to a subsystem, or to something in it, however deep.
pub fn is_given_on(event: EventName, own: &Deployment) -> bool {
    own.safety.iter().any(|(its, _)| *its == event) || own.subsystems.iter().any(|inner| is_given_on(event, &inner.own))
}
