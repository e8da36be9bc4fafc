//! Moves and places as they are told.

use super::arrive::is_for_somebody;
use super::product::Product;
use super::state::{Move, Next, ProductState};
use super::trace::{Answered, Happened, HeardEvent, Place};
use crate::model::{Ask, EventName, Verdict};
use crate::statechart::{EventId, NodeId};

impl Product<'_> {
    /// Where all coordinators are.
    pub fn places(&self, state: &ProductState) -> Vec<Place> {
        let several = self.deployment.coordinators.len() > 1;
        let place = |(member, leaf): (&super::members::Member<'_>, &crate::statechart::NodeId)| Place {
            coordinator: several.then(|| member.name.to_string()),
            state: member.chart.fqn(*leaf).to_string(),
        };
        self.members.iter().zip(&state.leaves).map(place).collect()
    }

    /// Where all of them are, in words.
    pub fn place(&self, state: &ProductState) -> String {
        let all: Vec<usize> = (0..self.members.len()).collect();
        self.place_of(state, &all)
    }

    /// Where these are, in words.
    pub fn place_of(&self, state: &ProductState, numbers: &[usize]) -> String {
        let told = |place: Place| match place.coordinator {
            Some(name) => format!("{name}:{}", place.state),
            None => place.state,
        };
        let places = self.places(state).into_iter().enumerate().filter(|(number, _)| numbers.contains(number));
        places.map(|(_, place)| told(place)).collect::<Vec<_>>().join(", ")
    }

    /// What coordinators hear with a move, in order, as it is told.
    pub fn hears(&mut self, before: &ProductState, next: &Next) -> Vec<HeardEvent> {
        let heard = self.heard(before, next);
        let several = self.deployment.coordinators.len() > 1;
        let told = |(number, event): (usize, EventId)| HeardEvent {
            coordinator: several.then(|| self.members[number].name.to_string()),
            event: self.members[number].chart.event_text(event),
        };
        heard.into_iter().map(told).collect()
    }

    /// The states that coordinators leave with a move.
    pub(super) fn left_by(&mut self, before: &ProductState, next: &Next) -> Vec<(usize, NodeId)> {
        let (mut leaves, mut left) = (before.leaves.clone(), Vec::new());
        for (number, event) in self.heard(before, next) {
            let reaction = self.members[number].react(leaves[number], event);
            leaves[number] = reaction.leaf;
            left.extend(reaction.left.iter().map(|node| (number, *node)));
        }
        left
    }

    /// What coordinators hear with a move, in order. Where several hear of one thing, each hears it when it takes it.
    fn heard(&mut self, before: &ProductState, next: &Next) -> Vec<(usize, EventId)> {
        let mut heard: Vec<(usize, EventId)> = Vec::new();
        let all = |name: EventName| {
            let charts = self.members.iter().map(|member| member.chart.event(name)).enumerate();
            charts.filter(|(_, event)| *event != EventId::OTHER).collect::<Vec<_>>()
        };
        // Of what lies in inboxes each hears when it takes it.
        let lies = |name: EventName| {
            let is = |(to, event): &(u8, EventId)| self.members[usize::from(*to)].name_of(*event) == Some(name);
            next.state.inbox.iter().any(is)
        };
        let at_once = |name: EventName| if lies(name) { Vec::new() } else { all(name) };
        match next.by {
            Move::Event(at) | Move::Dropped(at) => heard = at_once(self.outside[usize::from(at)]),
            Move::Lost(id) => heard = at_once(Verdict::Lost.event(Ask::Apply(id))),
            Move::Time(number, event) | Move::Taken(number, event) => heard.push((usize::from(number), event)),
            Move::Answer => {
                // Whose state is left by what is heard before hears no more.
                let mut leaves = before.leaves.clone();
                let mut left: Vec<(usize, u64)> = Vec::new();
                for (request, verdict) in &next.answers {
                    let Some(number) = self.member(request.requester) else { continue };
                    let event = self.members[number].answer(request.ask, *verdict);
                    let owner = request.tag.0.checked_sub(1);
                    let gone = owner.is_some_and(|owner| left.contains(&(number, owner)));
                    if gone || !is_for_somebody(request) || event == EventId::OTHER {
                        continue;
                    }
                    let reaction = self.members[number].react(leaves[number], event);
                    leaves[number] = reaction.leaf;
                    left.extend(reaction.left.iter().map(|node| (number, node.index() as u64)));
                    heard.push((number, event));
                }
            }
            _ => {}
        }
        heard
    }

    /// A move as it is told.
    pub fn told(&self, next: &Next) -> Happened {
        let name = |number: u8| self.members[usize::from(number)].name.to_string();
        let event = |number: u8, event| self.members[usize::from(number)].chart.event_text(event);
        match next.by {
            Move::Event(at) | Move::Dropped(at) => Happened::Event { event: self.outside[usize::from(at)].to_string() },
            Move::Unheard(at) => Happened::Unheard { event: self.outside[usize::from(at)].to_string() },
            Move::Time(number, at) => Happened::Time { coordinator: name(number), event: event(number, at) },
            Move::Taken(number, at) => Happened::Heard { coordinator: name(number), event: event(number, at) },
            Move::Answer => Happened::Answer {
                answers: (next.answers.iter())
                    .map(|(request, verdict)| Answered {
                        by: request.requester.to_string(),
                        request: request.ask.to_string(),
                        answer: verdict.event(request.ask).to_string(),
                        verdict: *verdict,
                    })
                    .collect(),
            },
            Move::Confirmed(id) => Happened::Confirmed { configuration: id.to_string() },
            Move::Lost(id) => Happened::Lost { configuration: id.to_string() },
            Move::Operator(ask) => Happened::Operator { request: ask.command() },
            Move::OthersDown => Happened::Down,
            Move::Elsewhere(id) => Happened::Elsewhere { configuration: id.to_string() },
            Move::Rounds => Happened::Rounds { times: self.deployment.limits.stack },
        }
    }
}
