//! What there is between the beginning of stopping and its end: states, with what is waited for there, and what leads from one to the
//! next.

use super::edges::Barred;
use super::explore::Graph;
use super::state::{Failed, Move, Next};
use super::timers::{Timer, Timers, Wait, Waits, aged, comes_behind, takes};
use crate::limits;
use crate::model::EventName;
use crate::statechart::NodeId;
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
    /// It is an event that is sure to be reported.
    pub reported: bool,
}

/// What edges have to do with time.
#[derive(Default)]
pub(super) struct Timed {
    /// What they wait for; of an event what may report it.
    pub timers: FxHashMap<usize, Timers>,
    /// What is reported a time after them.
    pub set_off: FxHashMap<usize, Vec<Timer>>,
    /// Which states with a time of their own they leave and enter anew.
    pub left: FxHashMap<usize, Vec<(usize, NodeId)>>,
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
    /// What never comes there, since something else is over before: from where, by which edge, how long it would take, and how
    /// long that does.
    pub overtaken: Vec<(usize, usize, Duration, Duration)>,
    /// Somewhere two times are over at the same moment, and lead to different ends.
    pub tied: bool,
}

impl Graph<'_, '_> {
    /// What these edges wait for, those that wait for something.
    pub(super) fn timers(&mut self, edges: &[usize]) -> FxHashMap<usize, Timers> {
        let mut timers: FxHashMap<usize, Timers> = FxHashMap::default();
        let mut answers: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
        for number in edges {
            let edge = &self.edges[*number];
            if let Move::Time(number_of, event) = self.by(edge) {
                timers.insert(*number, Timers::from_iter([Timer::Time(usize::from(number_of), event)]));
            } else if let (Move::Event(at), Some(Barred::Gone)) = (self.by(edge), edge.barred()) {
                let raises = |name: EventName| self.product.alike_to(at).any(|alike| alike == name);
                let of = self.product.delayed().filter(|(_, reaction)| raises(reaction.raise));
                let of: Timers = of.map(|(reaction, _)| Timer::Reports(reaction)).collect();
                if !of.is_empty() {
                    timers.insert(*number, of);
                }
            } else if self.by(edge) == Move::Answer && self.product.may_wait(&self.states[edge.from as usize]) {
                answers.entry(edge.from).or_default().push(*number);
            }
        }
        for (from, numbers) in answers {
            let nexts = self.nexts(from).all;
            for number in numbers {
                let next = self.edges[number].place().and_then(|place| nexts.get(place));
                let of = next.map(|next| self.product.answered_after(next)).unwrap_or_default();
                if !of.is_empty() {
                    timers.insert(number, of);
                }
            }
        }
        timers
    }

    /// Of these edges, what is reported a time after them.
    pub(super) fn set_off(&self, edges: &[usize]) -> FxHashMap<usize, Vec<Timer>> {
        let mut set_off: FxHashMap<usize, Vec<Timer>> = FxHashMap::default();
        for (at, _) in self.product.delayed() {
            let of = edges.iter().filter(|number| self.sets_off(**number, at));
            of.for_each(|number| set_off.entry(*number).or_default().push(Timer::Reports(at)));
        }
        set_off
    }

    /// What an edge waits for where this is to wait for: an event for what reports it first, if something does.
    fn waits_of(&self, number: usize, timers: &FxHashMap<usize, Timers>, waits: &[Wait]) -> Timers {
        let Some(all) = timers.get(&number) else { return Timers::new() };
        if !matches!(self.by(&self.edges[number]), Move::Event(_)) {
            return all.clone();
        }
        let first = waits.iter().filter(|wait| all.contains(&wait.timer)).min_by_key(|wait| wait.left);
        first.map(|wait| wait.timer).into_iter().collect()
    }

    /// Of these edges, which states with a time of their own they leave and enter anew.
    pub(super) fn left_to_enter_anew(&mut self, edges: &[usize]) -> FxHashMap<usize, Vec<(usize, NodeId)>> {
        let mut left = FxHashMap::default();
        for number in edges {
            let edge = self.edges[*number];
            let (from, to) = (&self.states[edge.from as usize], &self.states[edge.to as usize]);
            let stays = |wait: &Wait| self.product.waits_in(to).iter().any(|other| other.timer == wait.timer);
            if !self.product.waits_in(from).iter().any(stays) {
                continue;
            }
            // What leads there tells it, but for answers.
            let (before, next) = match self.by(&edge) {
                Move::Answer => self.gone(u32::try_from(*number).unwrap_or(u32::MAX)),
                by => (from.clone(), Next::plain(by, to.clone(), Failed::Nothing)),
            };
            left.insert(*number, self.product.left_by(&before, &next));
        }
        left
    }

    /// The places that such edges lead to from the first states, those of `late` also at the last moment; none: there are too
    /// many. Of two times the one with less left comes first.
    pub(super) fn places(
        &self,
        first: &[u32],
        edges: &[usize],
        timed: &Timed,
        rests: impl Fn(u32) -> bool,
        late: &[bool],
    ) -> Option<Places> {
        let mut out: FxHashMap<u32, Vec<usize>> = FxHashMap::default();
        edges.iter().for_each(|number| out.entry(self.edges[*number].from).or_default().push(*number));
        let mut all = Places {
            list: Vec::new(),
            legs: Vec::new(),
            due: Vec::new(),
            first: 0,
            overtaken: Vec::new(),
            tied: false,
        };
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
            let of = |number: usize| self.waits_of(number, &timed.timers, &waits);
            // What is asked for may take longer than it has to.
            let sure = |number: &usize| of(*number).iter().any(|timer| !matches!(timer, Timer::Stands(_)));
            let over = numbers.clone().filter(sure).map(|number| takes(&of(number), &waits)).min();
            let after = |number: usize, waits: &Waits| {
                let edge = &self.edges[number];
                let (before, after) = (&self.states[edge.from as usize], &self.states[edge.to as usize]);
                let left = timed.left.get(&number).map_or(&[][..], Vec::as_slice);
                let (mut still, took) = self.product.waits_after((before, &of(number), after), left, waits);
                for timer in timed.set_off.get(&number).into_iter().flatten() {
                    self.product.begins_anew(&mut still, *timer);
                }
                (still, took)
            };
            let tied = |(one, other): (usize, usize)| {
                let edge = |number: usize| &self.edges[number];
                let same = |first: usize, second: usize| {
                    let behind = out.get(&edge(first).to).into_iter().flatten();
                    behind
                        .into_iter()
                        .any(|at| self.by(edge(*at)) == self.by(edge(second)) && edge(*at).to == edge(second).to)
                };
                let comes = |first: usize, second: usize| {
                    let behind = after(first, &waits).0;
                    of(second).iter().all(|timer| comes_behind(&behind, *timer))
                };
                let differ = of(one) != of(other) && edge(one).to != edge(other).to;
                differ
                    && match (comes(one, other), comes(other, one)) {
                        (true, true) => false,
                        (true, false) => !same(one, other),
                        (false, true) => !same(other, one),
                        (false, false) => true,
                    }
            };
            let at_once = |number: &usize| !of(*number).is_empty() && Some(takes(&of(*number), &waits)) == over;
            let timed: Vec<usize> = numbers.clone().filter(at_once).collect();
            let mut pairs =
                timed.iter().enumerate().flat_map(|(at, one)| timed[..at].iter().map(|other| (*one, *other)));
            all.tied = all.tied || pairs.any(tied);
            let due = over.filter(|_| rests(at));
            all.due.push(due);
            for edge in numbers {
                let sooner = |timer: &Timer| waits.iter().any(|wait| wait.timer == *timer && wait.sooner);
                let lasts = takes(&of(edge), &waits);
                let reported = matches!(self.by(&self.edges[edge]), Move::Event(_)) && !of(edge).is_empty();
                if let Some(over) = over.filter(|over| lasts > *over && !of(edge).iter().any(sooner)) {
                    all.overtaken.push((from, edge, lasts, over));
                    continue;
                }
                let (still, takes) = after(edge, &waits);
                let to = place(self.edges[edge].to, still, &mut all, &mut open);
                all.legs.push(Leg { from, to, takes, edge, late: false, reported });
                if let Some(due) = due.filter(|due| late[edge] && !reported && !due.is_zero()) {
                    let to = place(self.edges[edge].to, after(edge, &aged(&waits, due)).0, &mut all, &mut open);
                    all.legs.push(Leg { from, to, takes: due, edge, late: true, reported });
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
