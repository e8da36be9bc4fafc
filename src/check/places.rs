//! What there is between the beginning of stopping and its end: states, with what is waited for there, and what leads from one to the
//! next.

use super::explore::Graph;
use super::lasts::Waits;
use super::state::{Failed, Move, Next};
use crate::limits;
use crate::statechart::{EventId, NodeId};
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::ops::Add;
use std::time::Duration;

/// From one place to another.
pub(super) struct Leg {
    pub from: usize,
    pub to: usize,
    pub takes: Duration,
    /// By which edge.
    pub edge: usize,
    /// It comes at the last moment before a time leads on.
    pub late: bool,
}

/// What there is between the beginning of stopping and its end, with the times that run at once.
pub(super) struct Places {
    /// States, and what is waited for there.
    pub list: Vec<(u32, Waits)>,
    pub legs: Vec<Leg>,
    /// Of each how soon a time leads on where it rests; none: no time does.
    pub due: Vec<Option<Duration>>,
    /// It begins in so many, which come first.
    pub first: usize,
}

impl Graph<'_, '_> {
    /// Of these edges, which states with a time of their own they leave and enter anew.
    pub(super) fn left_to_enter_anew(&mut self, edges: &[usize]) -> FxHashMap<usize, Vec<(usize, NodeId)>> {
        let mut left = FxHashMap::default();
        for number in edges {
            let edge = self.edges[*number];
            let (from, to) = (&self.states[edge.from as usize], &self.states[edge.to as usize]);
            let stays = |(number, event, _): &(usize, EventId, Duration)| {
                self.product.waits_in(to).iter().any(|(n, e, _)| (n, e) == (number, event))
            };
            if !self.product.waits_in(from).iter().any(stays) {
                continue;
            }
            // What leads there tells it, but for answers.
            let (before, next) = match edge.by {
                Move::Answer => self.gone(u32::try_from(*number).unwrap_or(u32::MAX)),
                by => (from.clone(), Next::plain(by, to.clone(), Failed::Nothing)),
            };
            left.insert(*number, self.product.left_by(&before, &next));
        }
        left
    }

    /// The places that such edges lead to from the first states, those of `late` also at the last moment; none: there are too
    /// many.
    pub(super) fn places(
        &self,
        first: &[u32],
        edges: &[usize],
        left: &FxHashMap<usize, Vec<(usize, NodeId)>>,
        rests: impl Fn(u32) -> bool,
        late: &[bool],
    ) -> Option<Places> {
        let mut out: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
        edges.iter().for_each(|number| out.entry(self.edges[*number].from).or_default().push(*number));
        let mut all = Places { list: Vec::new(), legs: Vec::new(), due: Vec::new(), first: 0 };
        let mut known: FxHashMap<(u32, Waits), usize> = FxHashMap::default();
        let mut open: VecDeque<usize> = VecDeque::new();
        let mut place = |at: u32, waits: Waits, all: &mut Places, open: &mut VecDeque<usize>| {
            *known.entry((at, waits.clone())).or_insert_with(|| {
                all.list.push((at, waits));
                open.push_back(all.list.len() - 1);
                all.list.len() - 1
            })
        };
        for at in first {
            place(*at, self.product.waits_in(&self.states[*at as usize]), &mut all, &mut open);
        }
        all.first = all.list.len();
        while let Some(from) = open.pop_front() {
            if all.list.len() > limits::CHECK_DRIVEN {
                return None;
            }
            let (at, waits) = all.list[from].clone();
            let numbers = out.get(&at).into_iter().flatten().copied();
            let times = numbers.clone().filter(|number| matches!(self.edges[*number].by, Move::Time(..)));
            let after = |number: usize, waits: &Waits| {
                let edge = &self.edges[number];
                let (before, after) = (&self.states[edge.from as usize], &self.states[edge.to as usize]);
                let left = left.get(&number).map_or(&[][..], Vec::as_slice);
                self.product.waits_after((before, edge.by, after), left, waits)
            };
            let due = times.map(|number| after(number, &waits).1).min().filter(|_| rests(at));
            all.due.push(due);
            for edge in numbers {
                let (still, takes) = after(edge, &waits);
                let to = place(self.edges[edge].to, still, &mut all, &mut open);
                all.legs.push(Leg { from, to, takes, edge, late: false });
                if let Some(due) = due.filter(|due| late[edge] && !due.is_zero()) {
                    let aged = waits.iter().map(|(n, e, left)| (*n, *e, left.saturating_sub(due))).collect();
                    let to = place(self.edges[edge].to, after(edge, &aged).0, &mut all, &mut open);
                    all.legs.push(Leg { from, to, takes: due, edge, late: true });
                }
            }
        }
        Some(all)
    }
}

/// How long it takes at least from one of the first to each, by such legs; none: none leads there.
pub(super) fn quickest<C: Copy + Ord + Default + Add<Output = C>>(
    count: usize,
    legs: impl Iterator<Item = (usize, usize, C)>,
    first: Vec<usize>,
) -> Vec<Option<C>> {
    let mut out: Vec<Vec<(usize, C)>> = vec![Vec::new(); count];
    legs.for_each(|(from, to, takes)| out[from].push((to, takes)));
    let mut least: Vec<Option<C>> = vec![None; count];
    let mut open: BinaryHeap<Reverse<(C, usize)>> = BinaryHeap::new();
    open.extend(first.into_iter().map(|at| Reverse((C::default(), at))));
    while let Some(Reverse((took, at))) = open.pop() {
        if least[at].is_some() {
            continue;
        }
        least[at] = Some(took);
        open.extend(out[at].iter().map(|(to, takes)| Reverse((took + *takes, *to))));
    }
    least
}
