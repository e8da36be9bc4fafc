//! The product of coordinator, system, stack and waiting requests: its states, and the moves between them.
//!
//! A state is the coordinator's leaf, a world and the requests that wait. From each, the first waiting request is
//! answered *ok* and *failed*, and every event that is heard comes.

use super::coordinator::bad_answers;
use super::reactions::{Asked, Reaction, Reactions};
use super::world::{Applied, EMPTY, WorldId, Worlds};
use crate::model::{Ask, ConfigId, Deployment, EventName, Findings, Verdict};
use crate::statechart::{Chart, EventId, NodeId};
use smallvec::SmallVec;

/// Requests that are answered together, and who hears the answers (none: left since).
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Unit {
    /// What is asked.
    pub asks: SmallVec<[Ask; 2]>,
    /// Who hears each answer.
    pub owners: SmallVec<[Option<NodeId>; 2]>,
}

impl Unit {
    /// Requests of one step as the configurator takes them: an undo and a push together are one transaction, else each
    /// stands by itself.
    pub fn all(asked: &[Asked]) -> Vec<Self> {
        let pushes = asked.iter().any(|a| matches!(a.ask, Ask::Apply(_)));
        let undoes = asked.iter().any(|a| !matches!(a.ask, Ask::Apply(_)));
        let unit = |asked: &[Asked]| Self {
            asks: asked.iter().map(|a| a.ask).collect(),
            owners: asked.iter().map(|a| a.owner).collect(),
        };
        if pushes && undoes { vec![unit(asked)] } else { asked.iter().map(|a| unit(std::slice::from_ref(a))).collect() }
    }

    /// Whether it goes before all others.
    pub fn is_safe(&self, deployment: &Deployment) -> bool {
        self.asks.iter().any(|ask| match ask {
            Ask::Apply(id) => deployment.configuration(*id).is_some_and(|c| c.safe),
            _ => false,
        })
    }

    /// Nobody hears the answers any more whose state has been left.
    pub fn forget(&mut self, left: &[NodeId]) {
        for owner in &mut self.owners {
            if owner.is_some_and(|owner| left.contains(&owner)) {
                *owner = None;
            }
        }
    }
}

/// A state of the product.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct State {
    /// The coordinator's leaf.
    pub leaf: NodeId,
    /// System and stack.
    pub world: WorldId,
    /// Requests that wait, the oldest first.
    pub waiting: SmallVec<[Unit; 2]>,
}

/// What leads from one state to the next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Move {
    /// An event comes.
    Event(EventId),
    /// The first waiting requests are answered.
    Answer {
        /// What was asked.
        asks: SmallVec<[Ask; 2]>,
        /// How it ended.
        ok: bool,
    },
}

/// The moves of the product.
pub struct Product<'a> {
    /// The deployment.
    pub deployment: &'a Deployment,
    /// Its coordinator.
    pub chart: &'a Chart,
    /// What the coordinator does.
    pub reactions: Reactions<'a>,
    /// What the configurator does.
    pub worlds: Worlds<'a>,
    /// The state that means down; none when there is no such state.
    pub down: Option<NodeId>,
}

/// A request that is not followed, found while moving.
#[derive(Debug, Clone)]
pub enum Trouble {
    /// The request is refused.
    Refused(Ask, std::rc::Rc<Findings>),
    /// Going round adds frames.
    TooDeep(ConfigId),
    /// Going round adds frames because their undoing fails: nothing to say, and not followed further.
    Left,
}

impl Product<'_> {
    /// The state after the first entry; none when the coordinator cannot be entered.
    pub fn start(&mut self) -> Option<State> {
        let entered = self.reactions.enter()?;
        let mut state = State { leaf: entered.leaf, world: 0, waiting: SmallVec::new() };
        self.follow(&mut state, &entered);
        Some(state)
    }

    /// Brings a reaction into a state: answers that nobody hears any more, and new requests.
    fn follow(&self, state: &mut State, reaction: &Reaction) {
        state.leaf = reaction.leaf;
        state.waiting.iter_mut().for_each(|unit| unit.forget(&reaction.left));
        for unit in Unit::all(&reaction.asked) {
            if unit.is_safe(self.deployment) { state.waiting.insert(0, unit) } else { state.waiting.push(unit) }
        }
    }

    /// The state after an event.
    pub fn event(&mut self, state: &State, event: EventId) -> State {
        let mut next = state.clone();
        let reaction = self.reactions.react(state.leaf, event);
        self.follow(&mut next, &reaction);
        self.settle(&mut next);
        next
    }

    /// Down with an empty system, the stack is discarded (design §6).
    fn settle(&self, state: &mut State) {
        if self.is_down(state) && self.worlds.get(state.world).system.is_empty() {
            state.world = EMPTY;
        }
    }

    /// Whether a state is down, with nothing left to be answered.
    pub fn is_down(&self, state: &State) -> bool {
        state.waiting.is_empty() && self.down.is_some_and(|down| self.chart.is_inside(state.leaf, down))
    }

    /// What the first waiting requests do in the state's world.
    pub fn head(&mut self, state: &State) -> Applied {
        self.worlds.apply(state.world, &state.waiting[0].asks)
    }

    /// The state after the first waiting requests were answered and the world has become `world`.
    pub fn answer(&mut self, state: &State, ok: bool, world: WorldId) -> State {
        let mut next = State { world, ..state.clone() };
        let mut unit = next.waiting.remove(0);
        for i in 0..unit.asks.len() {
            let Some(_) = unit.owners[i] else { continue };
            let answer = self.chart.event(answer(unit.asks[i], ok));
            let reaction = self.reactions.react(next.leaf, answer);
            unit.forget(&reaction.left);
            self.follow(&mut next, &reaction);
        }
        self.settle(&mut next);
        next
    }

    /// A move in words.
    pub fn tell(&self, by: &Move, to: &State) -> String {
        let what = match by {
            Move::Event(event) => self.chart.event_text(*event),
            Move::Answer { asks, ok } => {
                let events: Vec<String> = asks.iter().map(|a| answer(*a, *ok).to_string()).collect();
                events.join(", ")
            }
        };
        format!("{what} → {}", self.chart.fqn(to.leaf))
    }
}

/// The event that answers `ask`.
pub fn answer(ask: Ask, ok: bool) -> EventName {
    match (ask, ok) {
        (Ask::Apply(_), true) => Verdict::Ok.event(ask),
        (_, true) => Verdict::Undone.event(ask),
        (_, false) => bad_answers(ask)[0],
    }
}
