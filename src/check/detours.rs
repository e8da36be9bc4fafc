//! Ways down whose times add up to more than there is: beside the way on which everything goes well.
//!
//! Counted is from when stopping begins, at least: by the quickest way there, and the quickest on from there. Times of states that
//! were entered before then have just begun. Where the time of stopping stands still it begins anew. What comes of it that an event
//! comes late: [`late`](super::late).

use super::bound::Bound;
use super::edges::{Barred, Edge};
use super::explore::Graph;
use super::late::Late;
use super::places::{Leg, Timed, quickest};
use super::state::{Failed, Move};
use super::timers::Timers;
use crate::model::Finding;
use crate::model::codes::COORD_NO_WAY_DOWN;
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;
use std::time::Duration;

/// States in which it is being stopped and waits, and that lie on ways down that are not in time.
#[derive(Default)]
pub(super) struct Slow {
    /// On none that is: how long the quickest lasts.
    pub always: BTreeMap<u32, Duration>,
    /// Where an event that somebody may raise comes late.
    pub late: BTreeMap<u32, Late>,
    /// The same with those that a component may raise, if one does.
    pub reported: BTreeMap<u32, Late>,
    /// On none, since what would lead on takes so long, and something else is over before, after so long.
    pub overtaken: BTreeMap<u32, (Duration, Duration)>,
}

impl Graph<'_, '_> {
    /// What is too slow. `bars`: what leads down there.
    pub(super) fn slow(&mut self, bars: &[Option<Barred>]) -> Slow {
        let within = self.product.deployment.shutdown.within;
        let stopping: Vec<bool> = self.states.iter().map(|state| state.stopping).collect();
        let stops = |at: u32| stopping[at as usize];
        // What is refused is not raised; what may come leads there, and need not lead on.
        let comes = |(number, edge): &(usize, &Edge)| {
            stops(edge.from) && !matches!(bars[*number], Some(Barred::Closed | Barred::Late))
        };
        // That something fails, however soon, is no way on.
        let fails: Vec<bool> = self.edges.iter().map(|edge| edge.failed() != Failed::Nothing).collect();
        let leads = |number: usize| !fails[number] && bars[number].is_none_or(|of| of == Barred::Reported);
        let some: Vec<usize> = self.edges.iter().enumerate().filter(comes).map(|(number, _)| number).collect();
        let timers = self.timers(&some);
        if timers.is_empty() {
            return Slow::default();
        }
        let edges = || some.iter().map(|number| (*number, &self.edges[*number]));
        let whole = |timers: &Timers| timers.iter().map(|timer| self.product.lasts_whole(*timer)).max();
        let takes = |(number, edge): (usize, &Edge)| {
            let takes = timers.get(&number).and_then(whole).unwrap_or_default();
            (edge.from as usize, edge.to as usize, takes)
        };
        let (people, mut ends) = (self.stands_still(), self.arrives());
        ends.iter_mut().zip(&people).for_each(|(end, people)| *end |= people);
        let begins = |edge: &&Edge| !stops(edge.from) && stops(edge.to);
        let still = || (0u32..).zip(&people).filter(|(_, people)| **people).map(|(at, _)| at);
        let first: Vec<u32> = self.edges.iter().filter(begins).map(|edge| edge.to).chain(still()).collect();
        // As if no two times ran at once: they last no longer than that.
        let begin = first.iter().map(|at| *at as usize).collect();
        let there = quickest(self.states.len(), edges().map(takes), begin);
        let on = edges().filter(|(number, _)| leads(*number)).map(takes);
        let last: Vec<usize> = (0..ends.len()).filter(|at| ends[*at]).collect();
        let on = quickest(self.states.len(), on.map(|(from, to, takes)| (to, from, takes)), last);
        let rests = |at: u32| stops(at) && self.states[at as usize].is_at_rest() && !ends[at as usize];
        // Where it rests, or is answered after a time only.
        let answered: FxHashSet<u32> = timers.keys().map(|number| self.edges[*number].from).collect();
        let waits = |at: u32| stops(at) && !ends[at as usize] && (rests(at) || answered.contains(&at));
        let lasts = |at: u32| there[at as usize].zip(on[at as usize]).map(|(there, on)| there + on);
        let slow = |at: u32| waits(at) && lasts(at).is_some_and(|lasts| lasts >= within);
        let comes_late = |number: usize| {
            let edge = &self.edges[number];
            let event =
                matches!(self.by(edge), Move::Event(_)) && matches!(bars[number], None | Some(Barred::Reported));
            event && rests(edge.from) && on[edge.to as usize].is_some_and(|on| !on.is_zero())
        };
        let late: Vec<bool> = (0..self.edges.len()).map(comes_late).collect();
        let mut waiting: FxHashSet<u32> = FxHashSet::default();
        let contend = timers.keys().any(|number| !waiting.insert(self.edges[*number].from));
        if !(0u32..).zip(&self.states).any(|(at, _)| slow(at)) && !late.contains(&true) && !contend {
            return Slow::default();
        }
        // With the times that run at once.
        let (left, set_off) = (self.left_to_enter_anew(&some), self.set_off(&some));
        let timed = Timed { timers, set_off, left };
        let rests = |at: u32| stops(at) && self.states[at as usize].is_at_rest() && !ends[at as usize];
        let waits = |at: u32| stops(at) && !ends[at as usize] && (rests(at) || answered.contains(&at));
        let Some(places) = self.places(&first, &some, &timed, rests, &late) else {
            self.cut(Bound::Times, Failed::Nothing);
            return Slow::default();
        };
        let count = places.list.len();
        let legs = || places.legs.iter().filter(|leg| !leg.late);
        let there = quickest(count, legs().map(|leg| (leg.from, leg.to, leg.takes)), (0..places.first).collect());
        let last: Vec<usize> = (0..count).filter(|at| ends[places.list[*at].0 as usize]).collect();
        // What is sure to be reported there comes, whatever it does on another way.
        let leads_by = leads;
        let leads = |leg: &Leg| !fails[leg.edge] && (leg.reported || leads(leg.edge));
        let back = legs().filter(|leg| leads(leg)).map(|leg| (leg.to, leg.from, leg.takes));
        let leads_on = on;
        let on = quickest(count, back, last.clone());
        let mut overtaken: BTreeMap<u32, (Duration, Duration)> = BTreeMap::new();
        for (from, edge, lasts, over) in &places.overtaken {
            let (at, to) = (places.list[*from].0, self.edges[*edge].to);
            if there[*from].is_some() && on[*from].is_none() && leads_by(*edge) && leads_on[to as usize].is_some() {
                overtaken.entry(at).or_insert((*lasts, *over));
            }
        }
        let mut always: BTreeMap<u32, Duration> = BTreeMap::new();
        for (number, (at, _)) in places.list.iter().enumerate().filter(|(_, (at, _))| waits(*at)) {
            if let Some(all) = there[number].zip(on[number]).map(|(there, on)| there + on) {
                always.entry(*at).and_modify(|least| *least = all.min(*least)).or_insert(all);
            }
        }
        always.retain(|_, lasts| *lasts >= within);
        let by_itself = self.by_itself(&places, last, leads);
        let late = |counts: &dyn Fn(Option<Barred>) -> bool| {
            let mut late = self.late(&places, &by_itself, &there, &on, |edge| counts(bars[edge]));
            late.retain(|at, _| waits(*at));
            late
        };
        let raised = late(&|bar| bar.is_none());
        let reported = if raised.is_empty() { late(&|_| true) } else { BTreeMap::new() };
        if places.tied {
            self.cut(Bound::Ties, Failed::Nothing);
        }
        Slow { always, late: raised, reported, overtaken }
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
        self.too_slow(at, message, "let something lead on sooner")
    }

    /// Nothing leads down from a state but what another time comes before.
    pub(super) fn is_overtaken(&self, at: u32, (lasts, over): (Duration, Duration)) -> Finding {
        let message = format!(
            "from `{}` only what takes {} s leads down, and what takes {} s is always over before",
            self.product.place(&self.states[at as usize]),
            lasts.as_secs_f64(),
            over.as_secs_f64()
        );
        self.not_led_down(at, message).path("shutdown.event").help(
            "let that lead down as well, or give it more time; else what is left is taken down without the coordinator",
        )
    }

    /// A way down by a state is not in time.
    pub(super) fn too_slow(&self, at: u32, message: String, instead: &str) -> Finding {
        let help = format!(
            "give it more time with `shutdown.within_s`, or {instead}; else what is left is taken down without the coordinator"
        );
        self.not_led_down(at, message).path("shutdown.within_s").help(help)
    }

    /// What is said of one that is not down yet.
    fn not_led_down(&self, at: u32, message: String) -> Finding {
        let state = &self.states[at as usize];
        // The one that is not down yet.
        let late = self
            .product
            .members
            .iter()
            .zip(&state.leaves)
            .find(|(member, leaf)| member.down.is_none_or(|down| !member.chart.is_inside(**leaf, down)));
        let (member, leaf) = late.unwrap_or((&self.product.members[0], &state.leaves[0]));
        Finding::warning(COORD_NO_WAY_DOWN, message).at(member.chart.origin(*leaf))
    }
}
