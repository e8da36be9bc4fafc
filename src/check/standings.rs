//! What is told of subsystems by itself where all of a deployment is followed as one: the ways up and down of `davit plan`, and the plain
//! product that tests hold against what is found file by file.

use super::children::{tell, told};
use super::product::Product;
use super::state::ProductState;
use crate::model::SubsystemStanding;
use crate::model::subsystem::{SeenStanding, standing};
use crate::statechart::EventId;
use smallvec::SmallVec;

impl Product<'_> {
    /// Tells of what subsystems have come to.
    pub(super) fn tell_standings(&mut self, state: &mut ProductState) {
        for at in 0..self.watched.len() {
            let seen = self.seen_standing(state, at);
            let Some(now) = standing(told(state, at), seen) else { continue };
            tell(state, at, Some(now));
            self.spread(state, now.event(self.watched[at].path), None);
        }
    }

    /// One of the coordinators takes an event up: it may be the one that begins its subsystem, or ends it, and leads somewhere.
    pub(super) fn begins_subsystem(&mut self, state: &mut ProductState, number: usize, event: EventId) {
        if self.watched.is_empty() {
            return;
        }
        let Some(name) = self.members[number].name_of(event) else { return };
        let leads = self.members[number].takes(state.leaves[number], name);
        for (at, watched) in self.watched.iter().enumerate().filter(|(_, watched)| watched.members.contains(&number)) {
            let was_down = told(state, at) == Some(SubsystemStanding::Down);
            if leads && (name == watched.begins || name == watched.ends && was_down) {
                tell(state, at, None);
            }
        }
    }

    fn seen_standing(&self, state: &ProductState, at: usize) -> SeenStanding {
        let path = self.watched[at].path;
        let mut seen = self.seen_of(state, &self.watched[at].members);
        seen.down = seen.down && self.there(state).iter().all(|component| component.local(path).is_none());
        seen
    }

    /// The deployment as one that all of these are of.
    pub(super) fn seen_as_one(&self, state: &ProductState) -> SeenStanding {
        let all: SmallVec<[usize; 4]> = (0..self.members.len()).collect();
        let mut seen = self.seen_of(state, &all);
        seen.down = seen.down && self.children_down(state) && self.there(state).is_empty();
        seen
    }

    /// Where these coordinators are, and nothing else.
    fn seen_of(&self, state: &ProductState, members: &[usize]) -> SeenStanding {
        let mut seen = SeenStanding { up: true, down: true, ..SeenStanding::default() };
        for number in members {
            let (member, leaf) = (&self.members[*number], state.leaves[*number]);
            let inside = |node| member.chart.is_inside(leaf, node);
            let settled = state.outstanding(member.by) == 0
                && state.inbox.iter().all(|(to, _)| usize::from(*to) != *number)
                && state.telling.iter().all(|(request, _)| request.requester != member.by);
            seen.up &= settled && member.up.is_some_and(inside);
            seen.down &= settled && member.down.is_some_and(inside);
            seen.failed |= member.failed.iter().any(|failed| inside(*failed));
        }
        seen
    }
}
