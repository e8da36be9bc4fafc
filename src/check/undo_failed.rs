//! Undos that failed one after the other, of configurations that have nothing to do with each other: what stays of one of them is
//! known at a time, that of the others is *set aside*.
//!
//! Of n switches each of whose undos may fail any subset may be left over, and following all of them is following 2ⁿ systems of
//! which each tells the same. Where an undo fails while frames of others are left that claim nothing of what it claims, two ways
//! go on: on one its frame is left and those of the others are taken to be gone, on the other one it is the other way round. On
//! both the coordinator hears that it failed, and from then on an undo of what is not there may fail as well as succeed: its
//! frame may be one that was set aside.
//!
//! What that keeps: every way that coordinators can go (events, answers, states) is gone with each of what was left known
//! exactly, so whatever is wrong on it because of what *one* failed undo left is found: a refusal names one frame that is in its
//! way, and nothing in a plan depends on another one's, for only what changes values and connections of its own is set aside
//! ([`Aside::of`](super::aside::Aside::of)). What only several of them bring about together is left out, and said to be
//! ([`Bound::Aside`](super::bound::Bound::Aside)).

use super::aside::Aside;
use super::outcome::{Went, Whose, WorldId};
use super::product::Product;
use super::state::ProductState;
use super::world::Worlds;
use crate::model::{Ask, ConfigId, RequestId};
use crate::stack::claims::Claims;
use crate::stack::{Frame, Request, Requester};
use smallvec::SmallVec;
use std::sync::Arc;

impl Product<'_> {
    /// These undos have failed: the states in which that may be followed on.
    pub(super) fn undos_failed(&mut self, state: ProductState, failed: &[Request]) -> SmallVec<[ProductState; 2]> {
        let mut states: SmallVec<[ProductState; 2]> = SmallVec::from_iter([state]);
        for request in failed {
            let Ask::UndoOf(id) = request.ask else { continue };
            let stays = (id, request.requester);
            if self.aside.may(id) && self.member(stays.1).is_some() {
                states = states.into_iter().flat_map(|state| self.undo_failed(state, stays)).collect();
            }
        }
        states
    }

    fn undo_failed(&mut self, state: ProductState, stays: Whose) -> SmallVec<[ProductState; 2]> {
        let left = self.worlds.left_over(state.world, &self.aside);
        // What is left of the same, or of what touches the same, belongs together.
        let meets = |other: &Whose| *other == stays || meet(&self.worlds.claims, other.0, stays.0);
        let others: SmallVec<[Whose; 2]> = left.iter().copied().filter(|other| !meets(other)).collect();
        if others.is_empty() || !left.contains(&stays) || !state.interrupted.is_empty() {
            return SmallVec::from_iter([state]);
        }
        match (self.without(&state, &others), self.without(&state, &[stays])) {
            (Some(own), Some(rest)) => [own, rest].into_iter().collect(),
            _ => SmallVec::from_iter([state]),
        }
    }

    /// A state as if what was left of these had been undone; none: that cannot be by itself.
    fn without(&mut self, state: &ProductState, gone: &[Whose]) -> Option<ProductState> {
        let went = self.worlds.without(state.world, gone)?;
        let mut state = ProductState { aside: true, ..state.clone() };
        self.go(&mut state, &went);
        Some(state)
    }

    /// Whether what was set aside may keep an undo from being carried out: it touches something of the same.
    pub(super) fn may_be_in_the_way(&self, undo: &Request) -> bool {
        let Ask::UndoOf(id) = undo.ask else { return false };
        self.aside.ids().any(|other| other != id && meet(&self.worlds.claims, other, id))
    }

    /// Of requests that are answered, those undos that found nothing and may have been about what was set aside: their places.
    pub(super) fn may_be_aside(&self, requests: &[Request], told: &[usize]) -> SmallVec<[usize; 2]> {
        let may = |place: &&usize| {
            let request = &requests[**place];
            matches!(request.ask, Ask::UndoOf(id) if self.aside.may(id)) && request.scope.is_none()
        };
        told.iter().filter(may).copied().collect()
    }
}

fn meet(claims: &Claims, one: ConfigId, other: ConfigId) -> bool {
    let of = |id| claims.of(&[Request::new(RequestId(0), Ask::Apply(id), Requester::Operator)]);
    of(one).meets(&of(other))
}

impl Worlds<'_> {
    /// Whose frames are there since their undo has failed: they no longer belong to the state that brought them.
    fn left_over(&self, id: WorldId, aside: &Aside) -> SmallVec<[Whose; 4]> {
        let frames = self.get(id).map(|world| world.stack.frames()).unwrap_or_default();
        // What an operator has applied belongs to no state, and is not left over.
        let asked = |by: Requester| matches!(by, Requester::Coordinator(_));
        let left = frames
            .iter()
            .filter(|frame| frame.scope.is_none() && asked(frame.requester) && aside.may(frame.configuration));
        let mut left: SmallVec<[Whose; 4]> = left.map(|frame| (frame.configuration, frame.requester)).collect();
        left.sort_unstable();
        left.dedup();
        left
    }

    /// The world in which what was left of these was undone; none: something cannot be, or belongs to a state.
    fn without(&mut self, id: WorldId, gone: &[Whose]) -> Option<Went> {
        let key = (id, SmallVec::from_slice(gone));
        if let Some(known) = self.withouts.get(&key) {
            return known.clone();
        }
        let went = self.undone(id, gone);
        self.withouts.insert(key, went.clone());
        went
    }

    fn undone(&mut self, id: WorldId, gone: &[Whose]) -> Option<Went> {
        let mut world = self.get(id)?.clone();
        for whose in gone {
            let of = |frame: &&Arc<Frame>| (frame.configuration, frame.requester) == *whose;
            let frames = world.stack.frames().iter().filter(of);
            let (count, scoped) =
                frames.fold((0, false), |(n, scoped), frame| (n + 1, scoped || frame.scope.is_some()));
            let undo = Request::new(RequestId(0), Ask::UndoOf(whose.0), whose.1);
            if scoped || !(0..count).all(|_| self.carry_out(&mut world, &[undo])) {
                return None;
            }
        }
        let system = self.systems.number(&mut world.system);
        Some(self.went(id, world, system, &[]))
    }
}
