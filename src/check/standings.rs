//! What is told of subsystems by itself where all of a deployment is followed as one: the ways up and down of `davit plan`, and the plain
//! product that tests hold against what is found file by file.

use super::product::Product;
use super::state::ProductState;
use crate::model::subsystem::{Seen, standing};
use crate::model::{Deployment, EventName, Ident, Standing};
use crate::statechart::EventId;

/// A subsystem with the numbers of its coordinators.
#[derive(Debug, Clone)]
pub struct Watched {
    path: Ident,
    /// The event that begins it.
    begins: EventName,
    members: Vec<usize>,
}

/// Of so many subsystems it is known what was told of them.
const MOST: usize = 21;

/// What was told, as a state has it: nothing since it was begun, or one of these; at first *down*.
const TOLD: [Option<Standing>; 5] =
    [Some(Standing::Down), None, Some(Standing::Up), Some(Standing::Failed), Some(Standing::Stranded)];

impl Watched {
    /// The subsystems of a deployment that is put together, by the coordinators of these names.
    pub fn all(deployment: &Deployment, names: &[(Ident, Option<Ident>)]) -> Vec<Self> {
        if deployment.own.is_none() {
            return Vec::new();
        }
        let of = |path: Ident| (0..names.len()).filter(|number| names[*number].1 == Some(path)).collect::<Vec<_>>();
        let all = deployment.all_subsystems().into_iter().map(|(path, subsystem)| {
            let begins = subsystem.own.deploy.event.within(path);
            Self { path, begins, members: of(path) }
        });
        all.filter(|watched| !watched.members.is_empty()).take(MOST).collect()
    }
}

fn told(state: &ProductState, at: usize) -> Option<Standing> {
    TOLD.get((state.children >> (3 * at) & 7) as usize).copied().flatten()
}

fn tell(state: &mut ProductState, at: usize, now: Option<Standing>) {
    let number = TOLD.iter().position(|told| *told == now).unwrap_or_default() as u64;
    state.children = state.children & !(7 << (3 * at)) | number << (3 * at);
}

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

    /// One of the coordinators takes an event up: it may be the one that begins its subsystem.
    pub(super) fn begins_subsystem(&self, state: &mut ProductState, number: usize, event: EventId) {
        for (at, watched) in self.watched.iter().enumerate() {
            let begins =
                watched.members.contains(&number) && self.members[number].name_of(event) == Some(watched.begins);
            if begins && told(state, at) == Some(Standing::Down) {
                tell(state, at, None);
            }
        }
    }

    fn seen_standing(&self, state: &ProductState, at: usize) -> Seen {
        let mut seen = Seen { up: true, down: true, ..Seen::default() };
        for number in &self.watched[at].members {
            let (member, leaf) = (&self.members[*number], state.leaves[*number]);
            let inside = |node| member.chart.is_inside(leaf, node);
            let settled = state.outstanding(member.by) == 0
                && state.inbox.iter().all(|(to, _)| usize::from(*to) != *number)
                && state.telling.iter().all(|(request, _)| request.requester != member.by);
            seen.up &= settled && member.up.is_some_and(inside);
            seen.down &= settled && member.down.is_some_and(inside);
            seen.failed |= member.failed.iter().any(|failed| inside(*failed));
        }
        let path = self.watched[at].path;
        seen.down &= self.there(state).iter().all(|component| component.local(path).is_none());
        seen
    }
}
