//! What the coordinator does when it hears something: for each leaf and event once, as a table that is filled on demand.
//!
//! In a pure coordinator at rest the active leaf is all there is to know, so that is all the state that is kept of it. On
//! its way to rest it may take several steps; what each of them raises is a batch of its own, as in a running session.

use super::coordinator::ask_of;
use crate::model::statechart::FunctionId;
use crate::model::{Ask, Deployment, EventName};
use crate::stack::Scope;
use crate::statechart::{Chart, Doo, EdgeId, EventId, Hook, HookContext, Machine, NodeId, Raised};
use crate::time::Time;
use rustc_hash::FxHashMap;
use std::rc::Rc;

/// A request that was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Asked {
    /// What is asked.
    pub ask: Ask,
    /// Who hears the answer; none: it has been left since.
    pub owner: Option<NodeId>,
    /// The state that brings it with it, by being entered, or takes it back, by being left.
    pub scope: Option<Scope>,
}

/// What a step hands on.
#[derive(Debug, Clone)]
pub enum Handed {
    /// Requests, in the order they were made.
    Batch(Vec<Asked>),
    /// It has come to the state that means down.
    Down,
}

/// What one event leads to, until the coordinator is at rest again.
#[derive(Debug, Clone)]
pub struct Macrostep {
    /// The leaf that is active then.
    pub leaf: NodeId,
    /// Whether a transition was taken at all.
    pub taken: bool,
    /// What its steps hand on, in order.
    pub handed: Vec<Handed>,
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
    table: FxHashMap<(NodeId, EventId), Rc<Macrostep>>,
    offers: FxHashMap<NodeId, Rc<Vec<EventId>>>,
    outside: Vec<EventId>,
    down: Option<NodeId>,
}

impl<'a> Reactions<'a> {
    /// An empty table. `outside` are the events that can come from components and operators; `down` the state that means
    /// down.
    pub fn new(deployment: &'a Deployment, chart: &'a Chart, outside: &[EventName], down: Option<NodeId>) -> Self {
        Self {
            deployment,
            chart,
            machine: Machine::new(chart),
            table: FxHashMap::default(),
            offers: FxHashMap::default(),
            outside: outside.iter().map(|e| chart.event(*e)).collect(),
            down,
        }
    }

    fn watch(&self, from: Option<NodeId>) -> MacrostepRecorder<'_> {
        let is_down = from.is_some_and(|leaf| self.down.is_some_and(|down| self.chart.is_inside(leaf, down)));
        MacrostepRecorder {
            deployment: self.deployment,
            down: self.down,
            is_down,
            taken: false,
            batch: Vec::new(),
            handed: Vec::new(),
            left: Vec::new(),
            emitted: Vec::new(),
        }
    }

    /// The first entry; none when the coordinator cannot be entered.
    pub fn enter(&mut self) -> Option<Macrostep> {
        let mut machine = Machine::new(self.chart);
        // Where it begins in *down* it has come there: it is down until it asks for something.
        let mut hook = self.watch(None);
        machine.run(self.chart, Time::default(), &mut hook);
        machine.leaf().map(|leaf| hook.reaction(leaf))
    }

    /// What happens in `leaf` when `event` comes.
    pub fn react(&mut self, leaf: NodeId, event: EventId) -> Rc<Macrostep> {
        if let Some(known) = self.table.get(&(leaf, event)) {
            return known.clone();
        }
        let mut machine = std::mem::replace(&mut self.machine, Machine::new(self.chart));
        let mut hook = self.watch(Some(leaf));
        machine.place(self.chart, leaf, Time::default());
        machine.send(event);
        machine.run(self.chart, Time::default(), &mut hook);
        let reaction = Rc::new(hook.reaction(machine.leaf().unwrap_or(leaf)));
        self.machine = machine;
        self.table.insert((leaf, event), reaction.clone());
        reaction
    }

    /// Events from outside, and time events, that are heard in `leaf`.
    pub fn offers(&mut self, leaf: NodeId) -> Rc<Vec<EventId>> {
        if let Some(known) = self.offers.get(&leaf) {
            return known.clone();
        }
        let (events, any) = triggers(self.chart, leaf);
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

/// The events that transitions from `leaf` and the states around it list, and whether one takes any.
pub fn triggers(chart: &Chart, leaf: NodeId) -> (Vec<EventId>, bool) {
    let mut events: Vec<EventId> = Vec::new();
    let mut any = false;
    let mut at = Some(leaf);
    while let Some(state) = at {
        for edge in chart.outgoing(state) {
            match chart.triggers(edge) {
                Some(triggers) => events.extend(triggers),
                None => any = true,
            }
        }
        at = chart.parent(state);
    }
    (events, any)
}

/// Writes down what is raised and left.
struct MacrostepRecorder<'a> {
    deployment: &'a Deployment,
    down: Option<NodeId>,
    is_down: bool,
    taken: bool,
    batch: Vec<Asked>,
    handed: Vec<Handed>,
    left: Vec<NodeId>,
    emitted: Vec<EventName>,
}

impl MacrostepRecorder<'_> {
    fn reaction(self, leaf: NodeId) -> Macrostep {
        let Self { taken, handed, left, emitted, .. } = self;
        Macrostep { leaf, taken, handed, left, emitted }
    }
}

impl Hook for MacrostepRecorder<'_> {
    fn exited(&mut self, _: &Chart, state: NodeId) {
        let earlier = self.handed.iter_mut().flat_map(|handed| match handed {
            Handed::Batch(asked) => asked.as_mut_slice(),
            Handed::Down => &mut [],
        });
        for asked in earlier.chain(&mut self.batch).filter(|a| a.owner == Some(state)) {
            asked.owner = None;
        }
        if !self.left.contains(&state) {
            self.left.push(state);
        }
    }

    fn taking(&mut self, _: &Chart, _: EdgeId) {
        self.taken = true;
    }

    fn after_step(&mut self, view: &mut HookContext<'_>) {
        if !self.batch.is_empty() {
            self.handed.push(Handed::Batch(std::mem::take(&mut self.batch)));
        }
        let is_down = self.down.is_some_and(|down| view.leaf.is_some_and(|leaf| view.chart.is_inside(leaf, down)));
        if is_down && !self.is_down {
            self.handed.push(Handed::Down);
        }
        self.is_down = is_down;
    }

    // What a function decides is not known: it is taken to let everything pass, and what is found then is a warning.
    fn guard(&mut self, _: FunctionId, _: EdgeId, _: &mut HookContext<'_>) -> bool {
        true
    }

    fn predicate(&mut self, _: FunctionId, _: EventId, _: &mut HookContext<'_>) -> bool {
        true
    }

    fn doo(&mut self, _: FunctionId, _: NodeId, _: &mut HookContext<'_>) -> Doo {
        Doo::Finished
    }

    fn raised(&mut self, _: &Chart, raised: Raised) {
        match ask_of(self.deployment, raised.name) {
            Some(ask) => {
                let scope = raised.scope.and_then(|state| u32::try_from(state.index()).ok()).map(Scope);
                self.batch.push(Asked { ask, owner: Some(raised.owner), scope });
            }
            None => self.emitted.push(raised.name),
        }
    }
}
