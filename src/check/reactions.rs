//! What the coordinator does when it hears something: for each leaf and event once, as a table that is filled on demand.
//!
//! In a pure coordinator at rest the active leaf is all there is to know, so that is all the state that is kept of it.

use super::coordinator::ask_of;
use crate::model::statechart::FunctionId;
use crate::model::{Ask, Deployment, EventName};
use crate::statechart::{Chart, Doo, EdgeId, EventId, Hook, Machine, NodeId, Raised, View};
use crate::time::Time;
use rustc_hash::FxHashMap;
use std::rc::Rc;

/// A request that was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Asked {
    /// What is asked.
    pub ask: Ask,
    /// The name that was raised.
    pub name: EventName,
    /// Who hears the answer; none: it has been left since.
    pub owner: Option<NodeId>,
}

/// What one event leads to, until the coordinator is at rest again.
#[derive(Debug, Clone)]
pub struct Reaction {
    /// The leaf that is active then.
    pub leaf: NodeId,
    /// Whether a transition was taken at all.
    pub taken: bool,
    /// Requests, in the order they were made.
    pub asked: Vec<Asked>,
    /// States that were left, at least once.
    pub left: Vec<NodeId>,
    /// Names that were raised and ask for nothing, in order.
    pub emitted: Vec<EventName>,
}

/// The table.
pub struct Reactions<'a> {
    deployment: &'a Deployment,
    chart: &'a Chart,
    machine: Machine,
    table: FxHashMap<(NodeId, EventId), Rc<Reaction>>,
    offers: FxHashMap<NodeId, Rc<Vec<EventId>>>,
    outside: Vec<EventId>,
}

impl<'a> Reactions<'a> {
    /// An empty table. `outside` are the events that can come from components and operators.
    pub fn new(deployment: &'a Deployment, chart: &'a Chart, outside: &[EventName]) -> Self {
        Self {
            deployment,
            chart,
            machine: Machine::new(chart),
            table: FxHashMap::default(),
            offers: FxHashMap::default(),
            outside: outside.iter().map(|e| chart.event(*e)).collect(),
        }
    }

    /// The first entry; none when the coordinator cannot be entered.
    pub fn enter(&mut self) -> Option<Reaction> {
        let mut machine = Machine::new(self.chart);
        let mut hook = Watch::new(self.deployment);
        machine.run(self.chart, Time::default(), &mut hook);
        machine.leaf().map(|leaf| hook.reaction(leaf))
    }

    /// What happens in `leaf` when `event` comes.
    pub fn react(&mut self, leaf: NodeId, event: EventId) -> Rc<Reaction> {
        if let Some(known) = self.table.get(&(leaf, event)) {
            return known.clone();
        }
        let mut hook = Watch::new(self.deployment);
        self.machine.place(self.chart, leaf, Time::default());
        self.machine.send(event);
        self.machine.run(self.chart, Time::default(), &mut hook);
        let reaction = Rc::new(hook.reaction(self.machine.leaf().unwrap_or(leaf)));
        self.table.insert((leaf, event), reaction.clone());
        reaction
    }

    /// Events from outside, and time events, that are heard in `leaf`.
    pub fn offers(&mut self, leaf: NodeId) -> Rc<Vec<EventId>> {
        if let Some(known) = self.offers.get(&leaf) {
            return known.clone();
        }
        let mut events: Vec<EventId> = Vec::new();
        let mut any = false;
        let mut at = Some(leaf);
        while let Some(state) = at {
            for edge in self.chart.outgoing(state) {
                match self.chart.triggers(edge) {
                    Some(triggers) => events.extend(triggers),
                    None => any = true,
                }
            }
            at = self.chart.parent(state);
        }
        let mut timed: Vec<EventId> = Vec::new();
        let mut at = Some(leaf);
        while let Some(state) = at {
            timed.extend(self.chart.time_event(state));
            at = self.chart.parent(state);
        }
        let mut offers: Vec<EventId> =
            self.outside.iter().copied().filter(|e| any || events.contains(e)).chain(timed).collect();
        offers.sort_unstable();
        offers.dedup();
        // What leads nowhere by itself (a connector behind it wants another event) is no offer.
        offers.retain(|event| self.react(leaf, *event).taken);
        let offers = Rc::new(offers);
        self.offers.insert(leaf, offers.clone());
        offers
    }
}

/// Writes down what is raised and left.
struct Watch<'a> {
    deployment: &'a Deployment,
    taken: bool,
    asked: Vec<Asked>,
    left: Vec<NodeId>,
    emitted: Vec<EventName>,
}

impl<'a> Watch<'a> {
    fn new(deployment: &'a Deployment) -> Self {
        Self { deployment, taken: false, asked: Vec::new(), left: Vec::new(), emitted: Vec::new() }
    }

    fn reaction(self, leaf: NodeId) -> Reaction {
        Reaction { leaf, taken: self.taken, asked: self.asked, left: self.left, emitted: self.emitted }
    }
}

impl Hook for Watch<'_> {
    fn exited(&mut self, _: &Chart, state: NodeId) {
        for asked in self.asked.iter_mut().filter(|a| a.owner == Some(state)) {
            asked.owner = None;
        }
        if !self.left.contains(&state) {
            self.left.push(state);
        }
    }

    fn taking(&mut self, _: &Chart, _: EdgeId) {
        self.taken = true;
    }

    // What a function decides is not known: it is taken to let everything pass, and what is found then is a warning.
    fn guard(&mut self, _: FunctionId, _: EdgeId, _: &mut View<'_>) -> bool {
        true
    }

    fn predicate(&mut self, _: FunctionId, _: EventId, _: &mut View<'_>) -> bool {
        true
    }

    fn doo(&mut self, _: FunctionId, _: NodeId, _: &mut View<'_>) -> Doo {
        Doo::Finished
    }

    fn raised(&mut self, _: &Chart, raised: Raised) {
        if let Some(ask) = ask_of(self.deployment, raised.name) {
            self.asked.push(Asked { ask, name: raised.name, owner: Some(raised.owner) });
        } else {
            self.emitted.push(raised.name);
        }
    }
}
