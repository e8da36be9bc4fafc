//! The coordinators of a product.

use super::coordinator::ask_of;
use super::reactions::{Macrostep, Reactions};
use super::shape::Undone;
use crate::model::{Ask, ComponentName, ConfigId, Deployment, EventName, Ident, Verdict};
use crate::stack::Requester;
use crate::statechart::{Chart, EventId, NodeId};
use rustc_hash::{FxHashMap, FxHashSet};
use std::cell::RefCell;
use std::rc::Rc;

/// One of the coordinators.
pub struct Member<'a> {
    /// Its name.
    pub name: Ident,
    /// The subsystem that it is one of, where all of a deployment is followed as one.
    pub of: Option<Ident>,
    /// Its chart.
    pub chart: &'a Chart,
    /// Its state that means up.
    pub up: Option<NodeId>,
    /// The one that means down.
    pub down: Option<NodeId>,
    /// Those that mean that the bring-up has failed.
    pub failed: Vec<NodeId>,
    /// The name its frames go by.
    pub by: Requester,
    reactions: Option<Reactions<'a>>,
    answers: RefCell<FxHashMap<(Ask, Verdict), EventId>>,
}

impl<'a> Member<'a> {
    /// From now on it hears these events from outside.
    pub fn listen(&mut self, deployment: &'a Deployment, outside: &[EventName]) {
        self.reactions = Some(Reactions::new(deployment, self.chart, outside, self.by, self.down));
    }

    /// Where it is to come for the deployment to be up: one of a subsystem may be anywhere, its parent decides.
    pub fn goal_up(&self) -> Option<NodeId> {
        if self.of.is_some() { Some(NodeId::ROOT) } else { self.up }
    }

    fn reactions(&mut self) -> &mut Reactions<'a> {
        self.reactions.as_mut().expect("it listens since the product was made")
    }

    /// The first entry; none when the coordinator cannot be entered.
    pub fn enter(&mut self) -> Option<Macrostep> {
        self.reactions().enter()
    }

    /// What happens in `leaf` when `event` comes.
    pub fn react(&mut self, leaf: NodeId, event: EventId) -> Rc<Macrostep> {
        self.reactions().react(leaf, event)
    }

    /// The states that were left, at least once, by what was heard in these.
    pub fn passed(&mut self, leaves: &FxHashSet<NodeId>) -> Vec<NodeId> {
        self.reactions().passed(leaves)
    }

    /// Events from outside, and time events, that are heard in `leaf`.
    pub fn offers(&mut self, leaf: NodeId) -> Rc<Vec<EventId>> {
        self.reactions().offers(leaf)
    }

    /// Whether an event of that name leads anywhere from `leaf`.
    pub fn takes(&mut self, leaf: NodeId, name: EventName) -> bool {
        let event = self.chart.event(name);
        event != EventId::OTHER && self.react(leaf, event).taken
    }

    /// The event that tells an answer.
    pub fn answer(&self, ask: Ask, verdict: Verdict) -> EventId {
        let event = || self.chart.event(verdict.event(ask));
        *self.answers.borrow_mut().entry((ask, verdict)).or_insert_with(event)
    }

    /// The name of a listed event.
    pub fn name_of(&self, event: EventId) -> Option<EventName> {
        event.listed().and_then(|at| self.chart.events().get(at)).copied()
    }
}

/// How the coordinator of that name is called in frames.
///
/// # Panics
/// Never: a plain name is a component name without prefix.
pub fn requester(name: Ident) -> Requester {
    Requester::Coordinator(ComponentName::new(name.as_str()).expect("a plain name"))
}

/// Whether one of these coordinators listens to the loss of a configuration.
pub fn hears_loss(charts: &[&Chart], numbers: &[usize], id: ConfigId) -> bool {
    let event = Verdict::Lost.event(Ask::Apply(id));
    numbers.iter().any(|number| charts[*number].event(event) != EventId::OTHER)
}

/// The coordinators of these numbers, and which frames count with them.
pub fn members<'a>(deployment: &Deployment, charts: &[&'a Chart], numbers: &[usize]) -> (Vec<Member<'a>>, Undone) {
    let mut ids: FxHashSet<ConfigId> = FxHashSet::default();
    // Replaced, taken back unasked, watched, or looked at by what may move.
    let counts = deployment.configurations.iter();
    ids.extend(
        counts.filter(|c| c.group.is_some() || c.confirm.is_some() || c.holds.is_some() || c.safe).map(|c| c.id),
    );
    ids.extend(deployment.configurations.iter().map(|c| c.id).filter(|id| hears_loss(charts, numbers, *id)));
    ids.extend(deployment.operator_applies());
    let mut undone = Undone { bare: FxHashSet::default(), ..Undone::default() };
    let mut members = Vec::new();
    for number in numbers {
        let (coordinator, chart) = (&deployment.coordinators[*number], charts[*number]);
        let by = requester(coordinator.name);
        for site in chart.raises() {
            match ask_of(deployment, site.name) {
                Some(Ask::Undo | Ask::UndoTo(_)) => _ = undone.bare.insert(by),
                Some(Ask::UndoOf(id)) => _ = ids.insert(id),
                _ => {}
            }
        }
        members.push(Member {
            name: coordinator.name,
            of: coordinator.of,
            chart,
            up: chart.find(&coordinator.up).ok(),
            down: chart.find(&coordinator.down).ok(),
            failed: coordinator.failed.iter().filter_map(|state| chart.find(state).ok()).collect(),
            by,
            reactions: None,
            answers: RefCell::default(),
        });
    }
    undone.ids = Some(ids);
    (members, undone)
}
