//! How long a way lasts at least: what takes its time does so, and everything else is taken to need none. Of two times that run
//! together the one with less left comes first.

use super::product::Product;
use super::state::{Move, Next, ProductState};
use super::timers::{Timer, Waits, aged, comes_behind, takes};
use super::tried::{Goal, Tried};
use crate::limits;
use rustc_hash::FxHashSet;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

/// How long a way lasts.
pub(super) struct Lasts {
    pub all: Duration,
    /// What it waits for.
    pub timers: Vec<Timer>,
    /// It waits for the first, and the second is over before that and leads elsewhere.
    pub overtaken: Option<(Timer, Timer)>,
    /// Something else is over at the same moment as what it waits for, and leads to another end.
    pub tied: bool,
}

/// The way that lasts shortest.
pub(super) enum Soonest {
    Way(Vec<Next>),
    /// There is none: what comes first leads here, and nowhere else.
    Nowhere(Vec<Next>),
    /// There are too many ways to look at.
    TooMany,
}

impl Product<'_> {
    /// How long a time event takes from the entry of its state.
    pub(super) fn takes(&self, by: Move) -> Duration {
        match by {
            Move::Time(number, event) => self.lasts_whole(Timer::Time(usize::from(number), event)),
            _ => Duration::ZERO,
        }
    }

    /// How long these moves last at least, and what they wait for.
    pub(super) fn lasts(&mut self, from: &ProductState, moves: &[Next], tried: &Tried) -> Lasts {
        let mut lasts = Lasts { all: Duration::ZERO, timers: Vec::new(), overtaken: None, tied: false };
        let mut waits = Waits::new();
        let mut before = from;
        for next in moves {
            let (after, took) = self.waits_behind(before, next, &waits);
            if !took.is_zero() {
                let timer = self.comes_by(next, &waits).map(|(_, timer)| timer);
                let coming = self.coming(before, tried, &waits);
                let first = coming.iter().filter_map(|next| self.comes_by(next, &waits)).min_by_key(|(at, _)| *at);
                lasts.tied = lasts.tied || coming.iter().any(|other| self.are_tied(before, (next, other), &waits));
                let first = first.filter(|(at, _)| *at < took).map(|(_, first)| first);
                lasts.overtaken = lasts.overtaken.or(timer.zip(first));
                lasts.timers.extend(timer);
            }
            lasts.all += took;
            waits = after;
            before = &next.state;
        }
        lasts
    }

    /// Whether two moves come at the same moment and lead to different ends, since one of them takes away what the other waits for.
    fn are_tied(&mut self, before: &ProductState, (one, other): (&Next, &Next), waits: &Waits) -> bool {
        let Some((first, second)) = self.comes_by(one, waits).zip(self.comes_by(other, waits)) else { return false };
        if first.0 != second.0 || first.1 == second.1 || one.state == other.state {
            return false;
        }
        let (behind_one, behind_other) =
            (self.waits_behind(before, one, waits).0, self.waits_behind(before, other, waits).0);
        let mut same = |first: &Next, second: &Next| {
            let mut all = self.nexts(&first.state).all.into_iter();
            all.any(|next| next.by == second.by && next.state == second.state)
        };
        match (comes_behind(&behind_one, second.1), comes_behind(&behind_other, first.1)) {
            (true, true) => false,
            (true, false) => !same(one, other),
            (false, true) => !same(other, one),
            (false, false) => true,
        }
    }

    /// What comes in a state, by itself or from outside.
    fn coming(&mut self, state: &ProductState, tried: &Tried, waits: &Waits) -> Vec<Next> {
        let own = self.by_itself(state, Some(waits)).ok().flatten();
        let mut all = self.outside_moves(state, tried, false);
        all.extend(own);
        all
    }
}

/// The way that lasts shortest, and on which what is over first comes first.
pub(super) fn soonest(product: &mut Product<'_>, from: &ProductState, tried: &Tried, goal: Goal) -> Soonest {
    struct Place {
        state: ProductState,
        waits: Waits,
        before: Option<usize>,
        moves: Vec<Next>,
    }
    let way_to = |places: &mut Vec<Place>, place: usize| {
        let (mut moves, mut place) = (Vec::new(), Some(place));
        while let Some(here) = place {
            moves.splice(0..0, places[here].moves.drain(..));
            place = places[here].before;
        }
        moves
    };
    let start = Place { state: from.clone(), waits: Waits::new(), before: None, moves: Vec::new() };
    let mut places: Vec<Place> = vec![start];
    let mut known: FxHashSet<(ProductState, Waits)> = FxHashSet::default();
    let mut open: BinaryHeap<Reverse<(Duration, usize)>> = BinaryHeap::from([Reverse((Duration::ZERO, 0))]);
    let mut last = 0;
    while let Some(Reverse((at, place))) = open.pop() {
        let (state, waits) = (places[place].state.clone(), places[place].waits.clone());
        if !known.insert((state.clone(), waits.clone())) {
            continue;
        }
        last = place;
        if place > 0 && state.is_at_rest() && product.all_in(&state, goal) {
            return Soonest::Way(way_to(&mut places, place));
        }
        if places.len() > limits::CHECK_DRIVEN {
            return Soonest::TooMany;
        }
        let coming =
            if place == 0 { product.outside_moves(&state, tried, true) } else { product.coming(&state, tried, &waits) };
        let first = coming.iter().filter_map(|next| product.comes_by(next, &waits)).map(|(at, _)| at).min();
        for next in coming {
            let timers = product.timers_of(&next, &waits);
            let took = takes(&timers, &waits);
            if first.is_some_and(|first| took > first) {
                continue;
            }
            // What nothing is waited for comes at once, or at the last moment before something else does.
            let late = first.filter(|first| timers.is_empty() && !first.is_zero());
            for by in std::iter::once(Duration::ZERO).chain(late) {
                let mut moves = vec![next.clone()];
                let mut waits = product.waits_behind(&state, &next, &aged(&waits, by)).0;
                let Ok(rest) = product.rest(next.state.clone(), goal, &mut moves, Some(&mut waits)) else { continue };
                if tried.fails(product, &moves).is_some() {
                    continue;
                }
                open.push(Reverse((at + by + took, places.len())));
                places.push(Place { state: rest, waits, before: Some(place), moves });
            }
        }
    }
    Soonest::Nowhere(way_to(&mut places, last))
}
