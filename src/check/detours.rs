//! Ways down whose times add up to more than there is: beside the way on which everything goes well.
//!
//! Counted is from when stopping begins, at least: by the quickest way there, and the quickest on from there. Where the time of
//! stopping stands still it begins anew.

use super::bound::Bound;
use super::explore::{Barred, Edge, Graph};
use super::lasts::Waits;
use super::state::{Failed, Move};
use crate::limits;
use crate::model::Finding;
use crate::model::codes::COORD_NO_WAY_DOWN;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};
use std::time::Duration;

/// From where to where, and how long that takes.
type Leg = (usize, usize, Duration);

impl Graph<'_, '_> {
    /// States in which it is being stopped and rests, and that lie on no way down that is in time: how long the quickest lasts.
    /// `bars`: what leads down there.
    pub(super) fn slow(&mut self, bars: &[Option<Barred>]) -> BTreeMap<u32, Duration> {
        let within = self.product.deployment.shutdown.within;
        let stops = |at: u32| self.states[at as usize].stopping;
        let legs = |edge: &Edge| (edge.from as usize, edge.to as usize, self.product.takes(edge.by));
        // What is refused is not raised; what may come leads there, and need not lead on.
        let comes = |(number, edge): &(usize, &Edge)| {
            stops(edge.from) && !matches!(bars[*number], Some(Barred::Closed | Barred::Late))
        };
        let leads = |number: usize| bars[number].is_none_or(|of| of == Barred::Reported);
        let edges = || self.edges.iter().enumerate().filter(comes);
        if !edges().any(|(_, edge)| matches!(edge.by, Move::Time(..))) {
            return BTreeMap::new();
        }
        let (people, mut ends) = (self.stands_still(), self.arrives());
        ends.iter_mut().zip(&people).for_each(|(end, people)| *end |= people);
        let begins = |edge: &&Edge| !stops(edge.from) && stops(edge.to);
        let still = || (0..people.len()).filter(|at| people[*at]);
        // As if no two times ran at once: they last no longer than that.
        let first: Vec<usize> = self.edges.iter().filter(begins).map(|edge| edge.to as usize).chain(still()).collect();
        let there = quickest(self.states.len(), edges().map(|(_, edge)| legs(edge)), first);
        let on = edges().filter(|(number, _)| leads(*number)).map(|(_, edge)| legs(edge));
        let last: Vec<usize> = (0..ends.len()).filter(|at| ends[*at]).collect();
        let on = quickest(self.states.len(), on.map(|(from, to, takes)| (to, from, takes)), last);
        let rests = |at: usize| self.states[at].stopping && self.states[at].is_at_rest() && !ends[at];
        let lasts = |at: usize| there[at].zip(on[at]).map(|(there, on)| there + on);
        if !(0..self.states.len()).any(|at| rests(at) && lasts(at).is_some_and(|lasts| lasts >= within)) {
            return BTreeMap::new();
        }
        // With the times that run at once.
        let mut out: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
        edges().for_each(|(number, edge)| out.entry(edge.from).or_default().push(number));
        let mut places: Vec<(u32, Waits)> = Vec::new();
        let mut known: FxHashMap<(u32, Waits), usize> = FxHashMap::default();
        let mut open: VecDeque<usize> = VecDeque::new();
        let mut place = |at: u32, waits: Waits, places: &mut Vec<(u32, Waits)>, open: &mut VecDeque<usize>| {
            *known.entry((at, waits.clone())).or_insert_with(|| {
                places.push((at, waits));
                open.push_back(places.len() - 1);
                places.len() - 1
            })
        };
        let after = |edge: &Edge, waits: &Waits| {
            let (from, to) = (&self.states[edge.from as usize], &self.states[edge.to as usize]);
            self.product.waits_after(from, edge.by, to, waits)
        };
        for edge in self.edges.iter().filter(begins) {
            place(edge.to, after(edge, &Waits::new()).0, &mut places, &mut open);
        }
        for at in still() {
            place(u32::try_from(at).unwrap_or_default(), Waits::new(), &mut places, &mut open);
        }
        let first: Vec<usize> = (0..places.len()).collect();
        let mut all: Vec<(Leg, bool)> = Vec::new();
        while let Some(from) = open.pop_front() {
            if places.len() > limits::CHECK_DRIVEN {
                self.cut(Bound::Times, Failed::Nothing);
                return BTreeMap::new();
            }
            let (at, waits) = places[from].clone();
            for number in out.get(&at).into_iter().flatten() {
                let edge = &self.edges[*number];
                let (waits, took) = after(edge, &waits);
                all.push(((from, place(edge.to, waits, &mut places, &mut open), took), leads(*number)));
            }
        }
        let there = quickest(places.len(), all.iter().map(|(leg, _)| *leg), first);
        let last: Vec<usize> = (0..places.len()).filter(|at| ends[places[*at].0 as usize]).collect();
        let back = all.iter().filter(|(_, leads)| *leads).map(|((from, to, took), _)| (*to, *from, *took));
        let on = quickest(places.len(), back, last);
        let mut lasts: BTreeMap<u32, Duration> = BTreeMap::new();
        for (number, (at, _)) in places.iter().enumerate().filter(|(_, (at, _))| rests(*at as usize)) {
            if let Some(all) = there[number].zip(on[number]).map(|(there, on)| there + on) {
                lasts.entry(*at).and_modify(|least| *least = all.min(*least)).or_insert(all);
            }
        }
        lasts.retain(|_, lasts| *lasts >= within);
        lasts
    }

    /// That no way down by a state is in time.
    pub(super) fn lasts_too_long(&self, at: u32, lasts: Duration) -> Finding {
        let (deployment, state) = (self.product.deployment, &self.states[at as usize]);
        let message = format!(
            "the way down by `{}` lasts {} s at least, and `shutdown.within_s` gives it {} s",
            self.product.place(state),
            lasts.as_secs_f64(),
            deployment.shutdown.within.as_secs_f64()
        );
        // The one that is not down yet.
        let late = self
            .product
            .members
            .iter()
            .zip(&state.leaves)
            .find(|(member, leaf)| member.down.is_none_or(|down| !member.chart.is_inside(**leaf, down)));
        let (member, leaf) = late.unwrap_or((&self.product.members[0], &state.leaves[0]));
        Finding::warning(COORD_NO_WAY_DOWN, message)
            .at(member.chart.origin(*leaf))
            .path("shutdown.within_s")
            .help("give it more time with `shutdown.within_s`, or let something lead on sooner; else what is left is taken down \
                   without the coordinator")
    }
}

/// How long it takes at least from one of the first to each, by such legs; none: none leads there.
fn quickest(count: usize, legs: impl Iterator<Item = Leg>, first: Vec<usize>) -> Vec<Option<Duration>> {
    let mut out: Vec<Vec<(usize, Duration)>> = vec![Vec::new(); count];
    legs.for_each(|(from, to, takes)| out[from].push((to, takes)));
    let mut least: Vec<Option<Duration>> = vec![None; count];
    let mut open: BinaryHeap<Reverse<(Duration, usize)>> = BinaryHeap::new();
    open.extend(first.into_iter().map(|at| Reverse((Duration::ZERO, at))));
    while let Some(Reverse((took, at))) = open.pop() {
        if least[at].is_some() {
            continue;
        }
        least[at] = Some(took);
        open.extend(out[at].iter().map(|(to, takes)| Reverse((took + *takes, *to))));
    }
    least
}
