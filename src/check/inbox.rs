//! What a coordinator takes next of what lies in its inbox.
//!
//! A state has what came to each in the order in which it came. As in a running coordinator's inbox (`coordinator/inbox`) what is
//! urgent goes before the rest, and of each urgent event one waits: one that comes meanwhile is the same. How much of what lies
//! there had come when the coordinator took something is not known, for those who tell it have threads of their own.

use super::product::Product;
use super::state::{Move, Nexts, ProductState, index};
use crate::model::Precedence;
use crate::model::precedence::taken_first;
use crate::statechart::EventId;
use smallvec::SmallVec;

/// What a coordinator may take.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Takes {
    /// The event.
    pub event: EventId,
    /// Whether it goes before others.
    pub urgent: bool,
    /// Where it lies in the inbox, more than once if it came again before it was taken.
    pub places: SmallVec<[usize; 2]>,
}

impl Product<'_> {
    /// What a coordinator may take next; that which it takes if all had come before, first.
    pub(super) fn takes_next(&self, state: &ProductState, number: usize) -> SmallVec<[Takes; 1]> {
        let own = index(number);
        let lies = state.inbox.iter().enumerate().filter(|(_, (to, _))| *to == own);
        let lies: SmallVec<[(usize, EventId); 4]> = lies.map(|(at, (_, event))| (at, *event)).collect();
        let mut all: SmallVec<[Takes; 1]> = SmallVec::new();
        for came in (1..=lies.len()).rev() {
            let takes = self.first_of(number, &lies[..came]);
            if !all.contains(&takes) {
                all.push(takes);
            }
        }
        all
    }

    /// What goes first of what has come to a coordinator, in the order in which it came; something has.
    fn first_of(&self, number: usize, came: &[(usize, EventId)]) -> Takes {
        let precedence = |event: EventId| {
            let name = self.members[number].name_of(event);
            name.map_or(Precedence::Queued, |name| self.deployment.precedence(name))
        };
        let told: SmallVec<[(EventId, Precedence); 4]> =
            came.iter().map(|(_, event)| (*event, precedence(*event))).collect();
        let taken = taken_first(&told);
        let (event, precedence) = told[taken[0]];
        Takes { event, urgent: precedence.is_urgent(), places: taken.iter().map(|at| came[*at].0).collect() }
    }

    /// Whether a coordinator has taken what it takes if all had come before: nobody could tell how much had, else.
    pub(super) fn takes_in_order(
        &self,
        before: &ProductState,
        after: &ProductState,
        number: usize,
        event: EventId,
    ) -> bool {
        let own = index(number);
        let all = self.takes_next(before, number);
        let Some(takes) = all.first().filter(|_| all.len() > 1) else { return true };
        let left = before.inbox.iter().filter(|(to, _)| *to == own).count() - takes.places.len();
        takes.event == event && after.inbox.iter().filter(|(to, _)| *to == own).count() == left
    }

    /// A coordinator takes one of these.
    pub(super) fn take(
        &mut self,
        state: &ProductState,
        number: usize,
        takes: impl IntoIterator<Item = Takes>,
        nexts: &mut Nexts,
    ) {
        for Takes { event, places, .. } in takes {
            let mut next = state.clone();
            let stays = state.inbox.iter().enumerate().filter(|(at, _)| !places.contains(at));
            next.inbox = stays.map(|(_, lies)| *lies).collect();
            self.takes_offered(&mut next, number, event, places.len());
            self.hear(next, number, event, Move::Taken(index(number), event), nexts);
        }
    }
}
