//! How long a way lasts at least: time events take their time, and everything else is taken to need none.

use super::product::Product;
use super::state::{Move, Next, State};
use super::tried::{Goal, Tried, Way};
use crate::limits;
use crate::statechart::{EventId, NodeId};
use rustc_hash::FxHashSet;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

/// What is still to wait for time events of states that were entered on the way. Those of states that were entered before may
/// be over at any moment.
pub(super) type Waits = Vec<(usize, EventId, Duration)>;

impl Product<'_> {
    /// How long a time event takes from the entry of its state.
    pub(super) fn takes(&self, by: Move) -> Duration {
        match by {
            Move::Time(number, event) => self.members[usize::from(number)].chart.time_of(event).unwrap_or_default(),
            _ => Duration::ZERO,
        }
    }

    /// What is to wait for where everything that has a time was entered just now.
    pub(super) fn waits_in(&self, state: &State) -> Waits {
        let mut waits = Waits::new();
        for (number, member) in self.members.iter().enumerate() {
            let inside = std::iter::successors(Some(state.leaves[number]), |at| member.chart.parent(*at));
            let timed = inside.filter_map(|at| member.chart.time_event(at));
            waits.extend(timed.map(|event| (number, event, member.chart.time_of(event).unwrap_or_default())));
        }
        waits
    }

    /// What is to wait for after a move that left these states (also to enter them anew), and how long the move took.
    pub(super) fn waits_after(
        &self,
        (before, by, after): (&State, Move, &State),
        left: &[(usize, NodeId)],
        waits: &Waits,
    ) -> (Waits, Duration) {
        let due = |number: usize, event: EventId| waits.iter().find(|(n, e, _)| (*n, *e) == (number, event));
        let took = match by {
            Move::Time(number, event) => due(usize::from(number), event).map_or(Duration::ZERO, |(_, _, left)| *left),
            _ => Duration::ZERO,
        };
        let mut still = Waits::new();
        for (number, member) in self.members.iter().enumerate() {
            let (from, to) = (before.leaves[number], after.leaves[number]);
            let mut at: Option<NodeId> = Some(to);
            while let Some(state) = at {
                at = member.chart.parent(state);
                let Some(event) = member.chart.time_event(state) else { continue };
                let fired = matches!(by, Move::Time(n, e) if (usize::from(n), e) == (number, event));
                if fired || !member.chart.is_inside(from, state) || left.contains(&(number, state)) {
                    still.push((number, event, member.chart.time_of(event).unwrap_or_default()));
                } else if let Some((_, _, left)) = due(number, event) {
                    still.push((number, event, left.saturating_sub(took)));
                }
            }
        }
        (still, took)
    }

    /// How long these moves last at least, and the time events that they wait for.
    pub(super) fn lasts(&mut self, from: &State, moves: &[Next]) -> (Duration, Vec<(usize, EventId)>) {
        let (mut waits, mut all, mut times) = (Waits::new(), Duration::ZERO, Vec::new());
        let mut before = from;
        for next in moves {
            let left = self.left_by(before, next);
            let (after, took) = self.waits_after((before, next.by, &next.state), &left, &waits);
            if let (Move::Time(number, event), false) = (next.by, took.is_zero()) {
                times.push((usize::from(number), event));
            }
            all += took;
            waits = after;
            before = &next.state;
        }
        (all, times)
    }
}

/// The way that lasts shortest, where `way` is one that arrives.
pub(super) fn soonest(product: &mut Product<'_>, way: &Way, tried: &Tried, goal: Goal) -> Option<Vec<Next>> {
    struct Place {
        state: State,
        waits: Waits,
        before: Option<usize>,
        moves: Vec<Next>,
    }
    let start = Place { state: way.from.clone(), waits: Waits::new(), before: None, moves: Vec::new() };
    let mut places: Vec<Place> = vec![start];
    let mut known: FxHashSet<(State, Waits)> = FxHashSet::default();
    let mut open: BinaryHeap<Reverse<(Duration, usize)>> = BinaryHeap::from([Reverse((Duration::ZERO, 0))]);
    while let Some(Reverse((at, place))) = open.pop() {
        let (state, waits) = (places[place].state.clone(), places[place].waits.clone());
        if !known.insert((state.clone(), waits.clone())) {
            continue;
        }
        if place > 0 && state.is_at_rest() && product.all_in(&state, goal) {
            let (mut moves, mut place) = (Vec::new(), Some(place));
            while let Some(here) = place {
                moves.splice(0..0, places[here].moves.drain(..));
                place = places[here].before;
            }
            return Some(moves);
        }
        if places.len() > limits::CHECK_DRIVEN {
            product.untimed = true;
            return None;
        }
        for next in product.outside_moves(&state, tried, place == 0) {
            let mut moves = vec![next.clone()];
            let Ok(rest) = product.rest(next.state, goal, &mut moves) else { continue };
            if tried.fails(product, &moves).is_some() {
                continue;
            }
            let (mut waits, mut now, mut before) = (waits.clone(), at, &state);
            for next in &moves {
                let left = product.left_by(before, next);
                let (after, took) = product.waits_after((before, next.by, &next.state), &left, &waits);
                waits = after;
                now += took;
                before = &next.state;
            }
            open.push(Reverse((now, places.len())));
            places.push(Place { state: rest, waits, before: Some(place), moves });
        }
    }
    None
}
