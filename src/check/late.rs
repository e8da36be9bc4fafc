//! Ways down on which events come late: at the last moment before a time would have led on, and behind them another one begins.
//!
//! Where nobody does anything it goes on by itself: by answers, and by the time that is over first; only where that leads nowhere
//! somebody raises at once what leads on. Whoever raises something else may do so at any moment before.

use super::explore::Graph;
use super::places::{Leg, Places, quickest};
use super::state::Move;
use crate::model::Finding;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::Add;
use std::time::Duration;

/// How long a way down lasts on which events come late.
pub(super) struct Late {
    lasts: Duration,
    events: BTreeSet<String>,
    /// One of them does so more than once.
    again: bool,
}

/// What a way on costs: so often somebody has to do something, so long it lasts, and so many moves it has.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
struct Cost(u32, Duration, u32);

impl Add for Cost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0, self.1 + other.1, self.2 + other.2)
    }
}

/// Whether a leg comes when its time is over.
fn comes_by_itself(leg: &Leg, by: Move) -> bool {
    leg.reported || matches!(by, Move::Time(..))
}

/// How it goes on by itself: of each place by which leg, and the places with the farthest from the end first.
pub(super) struct ByItself {
    legs: Vec<Option<usize>>,
    order: Vec<usize>,
}

impl Graph<'_, '_> {
    /// How it goes on to one of the `last` by itself, by edges that lead.
    pub(super) fn by_itself(&self, places: &Places, last: Vec<usize>, leads: impl Fn(&Leg) -> bool) -> ByItself {
        let cost = |number: usize| {
            let leg = &places.legs[number];
            let by = self.by(&self.edges[leg.edge]);
            let first = !comes_by_itself(leg, by) || places.due[leg.from].is_none_or(|due| leg.takes <= due);
            let goes = first && !leg.late && leads(leg);
            goes.then(|| Cost(u32::from(matches!(by, Move::Event(_)) && !leg.reported), leg.takes, 1))
        };
        let (all, count) = (|| 0..places.legs.len(), places.list.len());
        let back = all().filter_map(|number| Some((places.legs[number].to, places.legs[number].from, cost(number)?)));
        let costs = quickest(count, back, last);
        let mut legs: Vec<Option<usize>> = vec![None; count];
        let mut least: Vec<Option<Cost>> = vec![None; count];
        for number in all() {
            let leg = &places.legs[number];
            let Some(all) = cost(number).zip(costs[leg.to]).map(|(own, on)| own + on) else { continue };
            if costs[leg.from].is_some_and(|cost| cost >= all) && least[leg.from].is_none_or(|least| all < least) {
                (legs[leg.from], least[leg.from]) = (Some(number), Some(all));
            }
        }
        let mut order: Vec<usize> = (0..count).filter(|at| legs[*at].is_some()).collect();
        order.sort_by_key(|at| std::cmp::Reverse(least[*at]));
        ByItself { legs, order }
    }

    /// The states on ways that last too long where events come late of which `counts` says so. `there` and `on`: how long each
    /// place is from the beginning and from the end, at least.
    pub(super) fn late(
        &self,
        places: &Places,
        by_itself: &ByItself,
        there: &[Option<Duration>],
        on: &[Option<Duration>],
        counts: impl Fn(usize) -> bool,
    ) -> BTreeMap<u32, Late> {
        let within = self.product.deployment.shutdown.within;
        let mut before = there.to_vec();
        for at in &by_itself.order {
            let Some((leg, took)) = by_itself.legs[*at].map(|number| &places.legs[number]).zip(before[*at]) else {
                continue;
            };
            before[leg.to] = before[leg.to].max(Some(took + leg.takes));
        }
        // Another time begins where it lasts longer than it would have lasted without that.
        let prolongs = |number: &usize| {
            let leg = &places.legs[*number];
            let itself = by_itself.legs[leg.from].map(|own| &places.legs[own]);
            let waits = itself.filter(|own| comes_by_itself(own, self.by(&self.edges[own.edge])));
            leg.late && counts(leg.edge) && waits.is_some_and(|own| on[leg.to] > on[own.to])
        };
        let mut out: Vec<Vec<usize>> = by_itself.legs.iter().map(|leg| leg.iter().copied().collect()).collect();
        (0..places.legs.len()).filter(prolongs).for_each(|number| out[places.legs[number].from].push(number));
        // With one that came late, and by which leg that is known.
        let mut after: Vec<Option<(Duration, usize)>> = vec![None; places.list.len()];
        let is_over = |at: usize, took: Duration| on[at].is_some_and(|on| took + on > within);
        let mut open: VecDeque<(usize, Duration, bool)> = VecDeque::new();
        open.extend(before.iter().enumerate().filter_map(|(at, took)| Some((at, (*took)?, false))));
        while let Some((at, took, late)) = open.pop_front() {
            let newer = late && after[at].is_some_and(|(known, _)| known > took);
            // How much longer it gets where it is too long already tells nothing more.
            if newer || took > within {
                continue;
            }
            for number in &out[at] {
                let leg = &places.legs[*number];
                let (all, to) = (took + leg.takes, leg.to);
                let known = after[to].map(|(known, _)| known);
                if (leg.late || late) && known < Some(all) && !known.is_some_and(|known| is_over(to, known)) {
                    after[to] = Some((all, *number));
                    open.push_back((to, all, true));
                }
            }
        }
        let mut found: BTreeMap<u32, Late> = BTreeMap::new();
        for (at, took) in after.iter().enumerate() {
            if let Some((took, rest)) = took.map(|(took, _)| took).zip(on[at])
                && took + rest > within
            {
                let late = || self.way_of(places, &after, at, took + rest);
                found.entry(places.list[at].0).or_insert_with(late);
            }
        }
        found
    }

    /// What came late on the way to a place.
    fn way_of(&self, places: &Places, after: &[Option<(Duration, usize)>], at: usize, lasts: Duration) -> Late {
        let mut late = Late { lasts, events: BTreeSet::new(), again: false };
        let (mut at, mut seen) = (at, BTreeSet::new());
        while let Some((_, number)) = after[at] {
            let leg = &places.legs[number];
            if leg.late {
                late.again |= !late.events.insert(self.product.named(self.by(&self.edges[leg.edge])));
            }
            if !seen.insert(at) {
                break;
            }
            at = leg.from;
        }
        late
    }

    /// That a way down by a state is not in time where events come late.
    pub(super) fn lasts_too_long_late(&self, at: u32, late: &Late) -> Finding {
        let deployment = self.product.deployment;
        let names: Vec<String> = late.events.iter().map(|event| format!("`{event}`")).collect();
        let message = format!(
            "the way down by `{}` lasts up to {} s where {} {} late{}, and `shutdown.within_s` gives it {} s",
            self.product.place(&self.states[at as usize]),
            late.lasts.as_secs_f64(),
            names.join(", "),
            if names.len() == 1 { "comes" } else { "come" },
            if late.again { " again and again" } else { "" },
            deployment.shutdown.within.as_secs_f64()
        );
        self.too_slow(at, message, "let nothing wait once more behind that")
    }
}
