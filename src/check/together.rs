//! Several coordinators together: the product of their charts over one system and one stack.
//!
//! An event from outside goes to all that wait for it somewhere, and each takes it when it comes to it: until then it lies
//! in that one's inbox, and so does what another one emits. An answer goes to the one that asked, and may overtake what
//! lies there, as in a running deployment. The next event from outside comes when all inboxes are empty.

use super::coordinator::{bad_answers, outside_events};
use super::drive;
use super::product::{Unit, answer};
use super::reactions::{Reaction, Reactions};
use super::world::{Applied, EMPTY, WorldId, Worlds};
use crate::limits;
use crate::model::{Catalogue, ComponentName, ConfigId, Deployment, EventName, Ident};
use crate::stack::Requester;
use crate::statechart::{Chart, EventId, NodeId};
use rustc_hash::FxHashSet;
use smallvec::SmallVec;
use std::collections::BTreeSet;

/// One of the coordinators.
pub struct Member<'a> {
    /// Its name.
    pub name: Ident,
    /// Its chart.
    pub chart: &'a Chart,
    /// Its state that means up, and the one that means down.
    pub up: Option<NodeId>,
    /// The one that means down.
    pub down: Option<NodeId>,
    /// Configurations whose frames it may undo; none: any.
    pub undone: Option<FxHashSet<ConfigId>>,
    /// The name its frames go by.
    pub by: Requester,
    reactions: Reactions<'a>,
}

/// Requests that wait, and the number of who made them.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Waiting {
    /// The coordinator.
    pub by: u8,
    /// What it asks for.
    pub unit: Unit,
}

/// A state of the product.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct Joint {
    /// Where each coordinator is.
    pub leaves: SmallVec<[NodeId; 4]>,
    /// System and stack.
    pub world: WorldId,
    /// Requests that wait, the oldest first.
    pub waiting: SmallVec<[Waiting; 2]>,
    /// Events on their way to a coordinator, those of one in order.
    pub inbox: SmallVec<[(u8, EventId); 4]>,
}

/// What leads from one state to the next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// An event comes from outside.
    Event(EventName),
    /// Time passes for one of them.
    Time(u8, EventId),
    /// One of them takes what lies in its inbox.
    Taken(u8, EventId),
    /// The first waiting requests are answered.
    Answer(Unit, u8, bool),
}

/// The moves of the product.
pub struct Together<'a> {
    /// The deployment.
    pub deployment: &'a Deployment,
    /// The coordinators.
    pub members: Vec<Member<'a>>,
    /// What the configurator does.
    pub worlds: Worlds<'a>,
    outside: Vec<EventName>,
    /// More events were on their way, more requests waited or more frames were in force at once than are followed.
    pub overflow: bool,
}

impl<'a> Together<'a> {
    /// The product of these charts. `views` are the deployment as each of them sees it.
    pub fn new(deployment: &'a Deployment, views: &[Deployment], charts: &[&'a Chart], catalogue: &Catalogue) -> Self {
        let names: Vec<Ident> = deployment.coordinators.iter().map(|c| c.name).collect();
        let raised: Vec<BTreeSet<EventName>> =
            charts.iter().map(|chart| chart.raises().iter().map(|site| site.name).collect()).collect();
        let mut outside = BTreeSet::new();
        let mut members = Vec::new();
        for (number, ((view, chart), name)) in views.iter().zip(charts).zip(&names).enumerate() {
            // What others raise comes from them, and only then.
            let own: Vec<EventName> = outside_events(view, chart)
                .into_iter()
                .filter(|event| {
                    !raised.iter().enumerate().any(|(other, names)| other != number && names.contains(event))
                })
                .collect();
            outside.extend(own.iter().copied());
            members.push(Member {
                name: *name,
                chart,
                up: chart.find(&view.first_coordinator().up).ok(),
                down: chart.find(&view.first_coordinator().down).ok(),
                undone: drive::undone(deployment, chart),
                by: Requester::Coordinator(ComponentName::new(name.as_str()).expect("a plain name")),
                reactions: Reactions::new(deployment, chart, &own),
            });
        }
        // Frames are told apart wherever one of them might undo them.
        let undone = members.iter().map(|m| m.undone.clone()).collect::<Option<Vec<_>>>();
        let undone = undone.map(|sets| sets.into_iter().flatten().collect());
        let worlds = Worlds::new(deployment, catalogue, undone);
        Self { deployment, members, worlds, outside: outside.into_iter().collect(), overflow: false }
    }

    /// The state after the first entries; none when one of them cannot be entered.
    pub fn start(&mut self) -> Option<Joint> {
        let mut state =
            Joint { leaves: SmallVec::new(), world: EMPTY, waiting: SmallVec::new(), inbox: SmallVec::new() };
        let entered: Option<Vec<Reaction>> = self.members.iter_mut().map(|member| member.reactions.enter()).collect();
        let entered = entered?;
        state.leaves.extend(entered.iter().map(|reaction| reaction.leaf));
        for (by, reaction) in entered.iter().enumerate() {
            self.follow(&mut state, by, reaction);
        }
        Some(state)
    }

    /// Brings a reaction of one of them into a state.
    fn follow(&mut self, state: &mut Joint, by: usize, reaction: &Reaction) {
        let number = u8::try_from(by).unwrap_or(u8::MAX);
        state.leaves[by] = reaction.leaf;
        state.waiting.iter_mut().filter(|w| w.by == number).for_each(|w| w.unit.forget(&reaction.left));
        for unit in Unit::all(&reaction.asked) {
            let safe = unit.is_safe(self.deployment);
            let waiting = Waiting { by: number, unit };
            if safe { state.waiting.insert(0, waiting) } else { state.waiting.push(waiting) }
        }
        for name in &reaction.emitted {
            self.tell(state, *name, Some(by));
        }
    }

    /// Puts an event into the inbox of everybody but the one that emits it.
    fn tell(&mut self, state: &mut Joint, name: EventName, but: Option<usize>) {
        for (number, member) in self.members.iter_mut().enumerate() {
            let event = member.chart.event(name);
            let own = u8::try_from(number).unwrap_or(u8::MAX);
            // Nothing can bring it elsewhere before it takes the event, and here the event does nothing.
            let settled = !state.waiting.iter().any(|w| w.by == own) && !state.inbox.iter().any(|(to, _)| *to == own);
            if Some(number) == but
                || event == EventId::OTHER
                || settled && !member.reactions.react(state.leaves[number], event).taken
            {
                continue;
            }
            if state.inbox.len() >= limits::CHECK_INBOX {
                self.overflow = true;
                continue;
            }
            state.inbox.push((own, event));
        }
        state.inbox.sort_by_key(|(to, _)| *to);
    }

    fn react(&mut self, state: &mut Joint, by: usize, event: EventId) {
        let reaction = self.members[by].reactions.react(state.leaves[by], event);
        self.follow(state, by, &reaction);
    }

    /// Where everything leads but answers: what lies in the inboxes, else events and time.
    pub fn moves(&mut self, state: &Joint) -> Vec<(Step, Joint)> {
        let mut moves = Vec::new();
        for number in 0..self.members.len() {
            let own = u8::try_from(number).unwrap_or(u8::MAX);
            let Some(at) = state.inbox.iter().position(|(to, _)| *to == own) else { continue };
            let mut next = state.clone();
            let (_, event) = next.inbox.remove(at);
            self.react(&mut next, number, event);
            self.settle(&mut next);
            moves.push((Step::Taken(own, event), next));
        }
        if !state.inbox.is_empty() || state.waiting.len() >= limits::CHECK_WAITING {
            return moves;
        }
        let mut heard: BTreeSet<usize> = BTreeSet::new();
        for number in 0..self.members.len() {
            let offers = self.members[number].reactions.offers(state.leaves[number]);
            for event in offers.iter() {
                let name = self.members[number].chart.events().get(event.listed().unwrap_or(usize::MAX)).copied();
                match name.and_then(|name| self.outside.iter().position(|outside| *outside == name)) {
                    Some(at) => _ = heard.insert(at),
                    None => {
                        let mut next = state.clone();
                        self.react(&mut next, number, *event);
                        self.settle(&mut next);
                        moves.push((Step::Time(u8::try_from(number).unwrap_or(u8::MAX), *event), next));
                    }
                }
            }
        }
        for at in heard {
            let name = self.outside[at];
            let mut next = state.clone();
            self.tell(&mut next, name, None);
            // If one alone hears it, there is nothing to wait for.
            if let [(only, event)] = next.inbox[..] {
                next.inbox.clear();
                self.react(&mut next, usize::from(only), event);
                self.settle(&mut next);
            }
            moves.push((Step::Event(name), next));
        }
        moves
    }

    /// What the first waiting requests do in the state's world.
    pub fn head(&mut self, state: &Joint) -> Applied {
        let head = &state.waiting[0];
        self.worlds.apply_by(self.members[usize::from(head.by)].by, state.world, &head.unit.asks)
    }

    /// The state after the first waiting requests were answered and the world has become `world`.
    pub fn answer(&mut self, state: &Joint, ok: bool, world: WorldId) -> Joint {
        let mut next = Joint { world, ..state.clone() };
        let Waiting { by, mut unit } = next.waiting.remove(0);
        let number = usize::from(by);
        for i in 0..unit.asks.len() {
            if unit.owners[i].is_none() {
                continue;
            }
            let event = self.members[number].chart.event(answer(unit.asks[i], ok));
            let reaction = self.members[number].reactions.react(next.leaves[number], event);
            unit.forget(&reaction.left);
            self.follow(&mut next, number, &reaction);
        }
        self.settle(&mut next);
        next
    }

    /// Down with an empty system, the stack is discarded.
    fn settle(&self, state: &mut Joint) {
        if self.is_down(state) && self.worlds.get(state.world).system.is_empty() {
            state.world = EMPTY;
        }
    }

    /// Whether nothing waits to be answered or heard.
    pub fn is_at_rest(state: &Joint) -> bool {
        state.waiting.is_empty() && state.inbox.is_empty()
    }

    /// Whether all of them are down.
    pub fn is_down(&self, state: &Joint) -> bool {
        Self::is_at_rest(state) && self.all_in(state, |member| member.down)
    }

    /// Whether all of them are up.
    pub fn is_up(&self, state: &Joint) -> bool {
        Self::is_at_rest(state) && self.all_in(state, |member| member.up)
    }

    fn all_in(&self, state: &Joint, goal: impl Fn(&Member<'_>) -> Option<NodeId>) -> bool {
        let inside = |(member, leaf): (&Member<'_>, &NodeId)| {
            goal(member).is_some_and(|goal| member.chart.is_inside(*leaf, goal))
        };
        self.members.iter().zip(&state.leaves).all(inside)
    }

    /// Where all of them are, in words.
    pub fn place(&self, state: &Joint) -> String {
        let one = |(member, leaf): (&Member<'_>, &NodeId)| format!("{}:{}", member.name, member.chart.fqn(*leaf));
        self.members.iter().zip(&state.leaves).map(one).collect::<Vec<_>>().join(", ")
    }

    /// A move in words.
    pub fn tell_move(&self, by: &Step, to: &Joint) -> String {
        let what = match by {
            Step::Event(name) => name.to_string(),
            Step::Time(who, event) | Step::Taken(who, event) => {
                let member = &self.members[usize::from(*who)];
                format!("{} hears {}", member.name, member.chart.event_text(*event))
            }
            Step::Answer(unit, _, ok) => {
                let event = |ask| if *ok { answer(ask, true) } else { bad_answers(ask)[0] };
                unit.asks.iter().map(|ask| event(*ask).to_string()).collect::<Vec<_>>().join(", ")
            }
        };
        format!("{what} → {}", self.place(to))
    }
}
