//! When each move of a way happens where a script goes it.

use super::loss::Loss;
use super::product::Product;
use super::replay::{Begun, Split};
use super::state::{Move, Next, ProductState};
use crate::limits;
use crate::model::{Ask, ConfigId, Verdict};
use crate::stack::Request;
use crate::statechart::{EventId, NodeId};
use std::time::Duration;

/// For each move the states with a time of their own that coordinators enter with it, also anew.
pub(super) type Entries = Vec<Vec<(usize, NodeId)>>;

impl Product<'_> {
    /// What is entered with each move.
    pub(super) fn entries(&mut self, way: &[(&ProductState, &Next)]) -> Entries {
        let mut all = Entries::new();
        for (before, next) in way {
            let left = self.left_by(before, next);
            let mut entered = Vec::new();
            for (number, member) in self.members.iter().enumerate() {
                let (from, to) = (before.leaves[number], next.state.leaves[number]);
                let timed = member.chart.nodes().filter(|node| member.chart.time_event(*node).is_some());
                let inside = timed.filter(|node| member.chart.is_inside(to, *node));
                let anew =
                    inside.filter(|node| !member.chart.is_inside(from, *node) || left.contains(&(number, *node)));
                entered.extend(anew.map(|node| (number, node)));
            }
            all.push(entered);
        }
        all
    }

    /// When each move happens.
    pub(super) fn times(
        &self,
        way: &[(&ProductState, &Next)],
        begun: &[Begun],
        split: &Split,
        entries: &Entries,
    ) -> Vec<Duration> {
        let mut times: Vec<Duration> = Vec::with_capacity(way.len());
        for (k, (_, next)) in way.iter().enumerate() {
            let before = times.last().copied().unwrap_or_default();
            let of = |request: &Request| begun.iter().find(|b| b.over == Some(k) && b.requests.contains(request));
            let at_once = match next.by {
                Move::Taken(..) => split.get(&k).is_none_or(|(_, _, later)| !later),
                // What is given up, or interrupted, is not waited for.
                Move::Answer => next.answers.iter().all(|(request, verdict)| {
                    *verdict == Verdict::Cancelled || of(request).is_none_or(|batch| batch.idle)
                }),
                _ => false,
            };
            let mut at = if at_once { before } else { before + limits::REPLAY_STEP };
            for (request, verdict) in &next.answers {
                let stands = self.stands_after(next).filter(|stands| !stands.is_zero());
                let since = match verdict {
                    Verdict::Ok => of(request).and_then(|b| Some(*times.get(b.at)? + stands?)),
                    Verdict::Reverted => self.applied_at(way, &times, k, request.ask),
                    // Nobody knows what became of a call until its time is over.
                    Verdict::Broken | Verdict::UndoBroken => {
                        of(request).and_then(|b| times.get(b.at)).map(|at| *at + self.patience(request.ask))
                    }
                    _ => None,
                };
                at = at.max(since.map_or(at, |since| since + limits::REPLAY_STEP));
            }
            if let Move::Lost(id) = next.by
                && self.loss(way[k].0, id) == Some(Loss::Lie)
            {
                at += limits::OBSERVE_EVERY;
            }
            if let Move::Time(number, event) = next.by {
                at = at.max(self.time_due(&entries[..k], &times, usize::from(number), event));
            }
            times.push(at);
        }
        times
    }

    /// When a time event comes after these moves: so long after its state was entered.
    fn time_due(
        &self,
        entries: &[Vec<(usize, NodeId)>],
        times: &[Duration],
        number: usize,
        event: EventId,
    ) -> Duration {
        let chart = self.members[number].chart;
        let takes = chart.time_of(event).unwrap_or_default();
        let owner = chart.nodes().find(|node| chart.time_event(*node) == Some(event));
        let entered = entries.iter().rposition(|of| owner.is_some_and(|owner| of.contains(&(number, owner))));
        entered.map_or(Duration::ZERO, |at| times[at]) + takes
    }

    /// Whether a time is over before a move comes: that of the move itself, which comes late, or another one, which comes first.
    pub(super) fn is_overdue(
        &self,
        way: &[(&ProductState, &Next)],
        k: usize,
        times: &[Duration],
        entries: &Entries,
    ) -> bool {
        let (before, next) = way[k];
        let over = |number: usize, node: NodeId| {
            let chart = self.members[number].chart;
            let Some(event) = chart.time_event(node) else { return false };
            let due = self.time_due(&entries[..k], times, number, event);
            if next.by == Move::Time(super::state::index(number), event) {
                return due < times[k];
            }
            let entered = entries[..k].iter().rposition(|of| of.contains(&(number, node))).map_or(0, |at| at + 1);
            let own = |(_, next): &(&ProductState, &Next)| next.by == Move::Time(super::state::index(number), event);
            due <= times[k] && !way[entered..k].iter().any(own)
        };
        let timed = |(number, member): (usize, &super::members::Member<'_>)| {
            let active = member.chart.nodes().filter(|node| member.chart.is_inside(before.leaves[number], *node));
            active.into_iter().any(|node| over(number, node))
        };
        self.members.iter().enumerate().any(timed)
    }

    /// Whether a frame that nobody has confirmed is still there when it would have been taken back.
    pub(super) fn is_unconfirmed_for_too_long(
        &self,
        way: &[(&ProductState, &Next)],
        k: usize,
        times: &[Duration],
    ) -> bool {
        let (before, next) = way[k];
        let answered = |next: &Next, ask: Ask| next.answers.iter().any(|(request, _)| request.ask == ask);
        before.unconfirmed.iter().any(|waits| {
            let Ask::Apply(id) = waits.request.ask else { return false };
            let within = self.worlds.configuration(id).and_then(|c| c.confirm).map(|confirm| confirm.within);
            // Its place may be another one by now; and one that was pushed anew has waited for less.
            let own = |of: &super::seldom::Unconfirmed| of.request.ask == waits.request.ask;
            let new = |at: &usize| !way[*at].0.unconfirmed.iter().any(own) || answered(way[*at].1, waits.request.ask);
            let pushed = (0..k).rev().find(new).unwrap_or(0);
            let age = times[k].saturating_sub(times[pushed]);
            !answered(next, waits.request.ask) && within.is_some_and(|within| age > within)
        })
    }

    /// When the frame whose confirmation did not come is taken back.
    fn applied_at(
        &self,
        way: &[(&ProductState, &Next)],
        times: &[Duration],
        before: usize,
        ask: Ask,
    ) -> Option<Duration> {
        let Ask::Apply(id) = ask else { return None };
        let within = self.worlds.configuration(id)?.confirm?.within;
        let applied = |k: &usize| way[*k].1.answers.iter().any(|(r, verdict)| r.ask == ask && *verdict == Verdict::Ok);
        (0..before).rev().find(applied).map(|k| times[k] + within)
    }

    /// How long a step of a request may take.
    pub(super) fn patience(&self, ask: Ask) -> Duration {
        let of = |id: ConfigId| self.worlds.configuration(id).and_then(|c| c.timeout);
        let own = match ask {
            Ask::Apply(id) | Ask::UndoOf(id) => of(id),
            _ => None,
        };
        own.unwrap_or(self.deployment.limits.step_timeout)
    }
}
