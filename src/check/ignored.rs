//! What a parent raises for a subsystem and no transition there takes is answered `.ignored` to the state that raised it; this is followed
//! where all of a deployment is followed as one ([`standings`](super::standings)). Elsewhere interface automata tell it.

use super::product::Product;
use super::reactions::Emitted;
use super::seldom::RaisedForChild;
use super::state::{ProductState, bit, index};
use crate::model::EventName;
use crate::model::subsystem::IGNORED;
use crate::statechart::{EventId, NodeId};

impl Product<'_> {
    /// A coordinator has raised an event, which these come to in their time: it may be for a subsystem.
    pub(super) fn offers_child(
        &mut self,
        state: &mut ProductState,
        by: usize,
        Emitted { event, owner, .. }: Emitted,
        hearers: &[(u8, EventId)],
    ) {
        let (Some(owner), true) = (owner, self.is_for_child(by, event)) else { return };
        if self.ignored(by, event) == EventId::OTHER {
            // Nobody waits to be told.
            return;
        }
        let waits = hearers.iter().fold(0, |waits, (number, _)| waits | bit(usize::from(*number)));
        state.change(|seldom| seldom.offered.push(RaisedForChild { event, by: index(by), owner, waits }));
        if waits == 0 {
            self.tells_ignored(state, by, event);
        }
    }

    /// A coordinator comes to an event, or to so many of it that are one.
    pub(super) fn takes_offered(&mut self, state: &mut ProductState, number: usize, event: EventId, times: usize) {
        if state.offered.is_empty() {
            return;
        }
        let Some(name) = self.members[number].name_of(event) else { return };
        let heard =
            |of: &RaisedForChild| of.waits == 0 && of.by == index(number) && self.ignored(number, of.event) == event;
        if let Some(at) = state.offered.iter().position(heard) {
            state.change(|seldom| seldom.offered.remove(at));
            return;
        }
        let comes = |of: &RaisedForChild| of.event == name && of.waits & bit(number) != 0;
        let taken = self.members[number].react(state.leaves[number], event).taken;
        for _ in 0..times {
            let Some(at) = state.offered.iter().position(comes) else { return };
            let offered = state.offered[at];
            let waits = offered.waits & !bit(number);
            let kept = state.offered.iter().enumerate().filter(|(place, _)| !taken || *place != at);
            let kept =
                kept.map(|(place, of)| if place == at { RaisedForChild { waits, ..*of } } else { *of }).collect();
            state.change(|seldom| seldom.offered = kept);
            if !taken && waits == 0 {
                self.tells_ignored(state, usize::from(offered.by), name);
            }
        }
    }

    /// States of a coordinator are left: nobody hears any more what they would have been told.
    pub(super) fn forgets_offered(&self, state: &mut ProductState, by: usize, left: &[NodeId]) {
        let gone = |of: &RaisedForChild| of.by == index(by) && left.contains(&of.owner);
        while let Some(at) = state.offered.iter().position(gone) {
            let offered = state.change(|seldom| seldom.offered.remove(at));
            let told = (index(by), self.ignored(by, offered.event));
            if offered.waits == 0
                && let Some(at) = state.inbox.iter().position(|lies| *lies == told)
            {
                state.inbox.remove(at);
            }
        }
    }

    fn tells_ignored(&mut self, state: &mut ProductState, by: usize, event: EventName) {
        let told = self.ignored(by, event);
        self.spread_to(state, &[(index(by), told)]);
    }

    /// Whether an event is one of a subsystem that this coordinator is not of.
    fn is_for_child(&self, by: usize, event: EventName) -> bool {
        let inside = self.watched.iter().filter(|watched| event.local(watched.path).is_some());
        let innermost = inside.max_by_key(|watched| watched.path.as_str().len());
        innermost.is_some_and(|watched| !watched.members.contains(&by))
    }

    /// As what a coordinator knows that an event was ignored; `EventId::OTHER`: not at all.
    fn ignored(&self, by: usize, event: EventName) -> EventId {
        let told = EventName::new(&format!("{event}{IGNORED}"));
        told.map_or(EventId::OTHER, |told| self.members[by].chart.event(told))
    }
}
