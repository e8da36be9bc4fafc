//! What the coordinator does when it hears something: for each leaf and event once, as a table that is filled on demand.
//!
//! In a pure coordinator at rest the active leaf is all there is to know, so that is all the state that is kept of it. On
//! its way to rest it may take several steps; what each of them raises is a batch of its own, as in a running session.

use super::coordinator::ask_of;
use super::desks::is_left;
use crate::model::statechart::FunctionId;
use crate::model::{Ask, Deployment, EventName, RequestId};
use crate::stack::{Batch, Request, Requester, Scope, Why};
use crate::statechart::{Chart, Doo, EdgeId, EventId, Hook, HookContext, Machine, NodeId, Raised};
use crate::time::Time;
use rustc_hash::{FxHashMap, FxHashSet};
use std::rc::Rc;

/// What one event leads to, until the coordinator is at rest again.
#[derive(Debug, Clone)]
pub struct Macrostep {
    /// The leaf that is active then.
    pub leaf: NodeId,
    /// Whether a transition was taken at all.
    pub taken: bool,
    /// What its steps ask for, in order; also that it has come to the state that means down.
    pub handed: Vec<Batch>,
    /// States that were left, at least once.
    pub left: Vec<NodeId>,
    /// Names that were raised and ask for nothing, in order.
    pub emitted: Vec<Emitted>,
    /// Its number among those of the same coordinator.
    pub number: u32,
}

/// A name that was raised and asks for nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Emitted {
    /// The name.
    pub event: EventName,
    /// The state that hears what is answered to it; none: that was left in the same step.
    pub owner: Option<NodeId>,
    /// So many of the batches that are handed on go before it.
    pub behind: usize,
}

impl Macrostep {
    /// Whether this was raised.
    pub fn emits(&self, event: EventName) -> bool {
        self.emitted.iter().any(|emitted| emitted.event == event)
    }
}

/// The step that emits it is not over.
const NOT_YET: usize = usize::MAX;

/// The number of the first entry.
const FIRST_ENTRY: u32 = u32::MAX;

/// The table.
pub struct Reactions<'a> {
    deployment: &'a Deployment,
    chart: &'a Chart,
    /// Made once, and placed where it is wanted.
    machine: Option<Machine>,
    table: FxHashMap<(NodeId, EventId), Rc<Macrostep>>,
    offers: FxHashMap<NodeId, Rc<Vec<EventId>>>,
    outside: Vec<EventId>,
    by: Requester,
    down: Option<NodeId>,
}

impl<'a> Reactions<'a> {
    /// An empty table. `outside` are the events that can come from components and operators; `by` is who asks, and `down` its state
    /// that means down.
    pub fn new(
        deployment: &'a Deployment,
        chart: &'a Chart,
        outside: &[EventName],
        by: Requester,
        down: Option<NodeId>,
    ) -> Self {
        Self {
            deployment,
            chart,
            machine: None,
            table: FxHashMap::default(),
            offers: FxHashMap::default(),
            outside: outside.iter().map(|e| chart.event(*e)).collect(),
            by,
            down,
        }
    }

    fn watch(&self, from: Option<NodeId>) -> MacrostepRecorder<'_> {
        let is_down = from.is_some_and(|leaf| self.down.is_some_and(|down| self.chart.is_inside(leaf, down)));
        MacrostepRecorder {
            deployment: self.deployment,
            by: self.by,
            down: self.down,
            is_down,
            taken: false,
            batch: Batch::default(),
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
        machine.leaf().map(|leaf| hook.reaction(leaf, FIRST_ENTRY))
    }

    /// What happens in `leaf` when `event` comes.
    pub fn react(&mut self, leaf: NodeId, event: EventId) -> Rc<Macrostep> {
        if let Some(known) = self.table.get(&(leaf, event)) {
            return known.clone();
        }
        let mut machine = self.machine.take().unwrap_or_else(|| Machine::new(self.chart));
        let mut hook = self.watch(Some(leaf));
        machine.place(self.chart, leaf, Time::default());
        machine.send(event);
        machine.run(self.chart, Time::default(), &mut hook);
        let number = u32::try_from(self.table.len()).unwrap_or(FIRST_ENTRY);
        let reaction = Rc::new(hook.reaction(machine.leaf().unwrap_or(leaf), number));
        self.machine = Some(machine);
        self.table.insert((leaf, event), reaction.clone());
        reaction
    }

    /// The states that were left, at least once, by what was heard in these.
    pub fn passed(&self, leaves: &FxHashSet<NodeId>) -> Vec<NodeId> {
        let heard = self.table.iter().filter(|((leaf, _), _)| leaves.contains(leaf));
        heard.flat_map(|(_, step)| step.left.iter().copied()).collect()
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
    by: Requester,
    down: Option<NodeId>,
    is_down: bool,
    taken: bool,
    batch: Batch,
    handed: Vec<Batch>,
    left: Vec<NodeId>,
    emitted: Vec<Emitted>,
}

impl MacrostepRecorder<'_> {
    fn reaction(self, leaf: NodeId, number: u32) -> Macrostep {
        let Self { taken, handed, left, emitted, .. } = self;
        Macrostep { leaf, taken, handed, left, emitted, number }
    }
}

impl Hook for MacrostepRecorder<'_> {
    fn exited(&mut self, _: &Chart, state: NodeId) {
        let requests = self.handed.iter_mut().chain([&mut self.batch]).flat_map(|batch| &mut batch.requests);
        let left = requests.filter(|request| is_left(request, self.by, &[state]));
        left.for_each(|request| request.tag = (0, 0));
        self.emitted.iter_mut().for_each(|emitted| _ = emitted.owner.take_if(|owner| *owner == state));
        if !self.left.contains(&state) {
            self.left.push(state);
        }
    }

    fn taking(&mut self, _: &Chart, _: EdgeId) {
        self.taken = true;
    }

    fn after_step(&mut self, view: &mut HookContext<'_>) {
        if !self.batch.requests.is_empty() {
            self.handed.push(std::mem::take(&mut self.batch));
        }
        // What a step asks for goes before what it tells.
        let handed = self.handed.len();
        self.emitted.iter_mut().filter(|emitted| emitted.behind == NOT_YET).for_each(|emitted| emitted.behind = handed);
        let is_down = self.down.is_some_and(|down| view.leaf.is_some_and(|leaf| view.chart.is_inside(leaf, down)));
        if is_down && !self.is_down {
            let down = Request { why: Why::Down, ..Request::new(RequestId(0), Ask::Undo, self.by) };
            self.handed.push(Batch::one(down));
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
                let tag = (raised.owner.index() as u64 + 1, 0);
                self.batch.requests.push(Request { scope, tag, ..Request::new(RequestId(0), ask, self.by) });
            }
            None => self.emitted.push(Emitted { event: raised.name, owner: Some(raised.owner), behind: NOT_YET }),
        }
    }
}
