//! What takes time whatever the machine does: which moves wait for it, how long, and which of several is over first.

use super::product::Product;
use super::shows::goes;
use super::state::{Move, Next, ProductState, Reacts};
use crate::model::{Ask, ConfigId, EventName, SimulatedReaction, StepPattern, Verdict};
use crate::stack::Request;
use crate::statechart::{EventId, NodeId};
use smallvec::SmallVec;
use std::time::Duration;

/// What a move waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Timer {
    /// A time event of a coordinator.
    Time(usize, EventId),
    /// What a configuration stands for has to be true so long before it is answered.
    Stands(ConfigId),
    /// A configuration is taken back where it was not confirmed.
    Reverts(ConfigId),
    /// A simulated component reports something after a step, by its place among the reactions.
    Reports(usize),
}

/// What is still to wait for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Wait {
    pub timer: Timer,
    pub left: Duration,
    /// It has begun before what is looked at: it may as well be over sooner.
    pub sooner: bool,
}

/// All that is still to wait for. What is not among it, having begun before, may be over at any moment.
pub(super) type Waits = Vec<Wait>;

/// What moves wait for: of an answer that of each request.
pub(super) type Timers = SmallVec<[Timer; 1]>;

/// How long what is waited for has still to be, where that is known.
fn left_of(timer: Timer, waits: &[Wait]) -> Option<Duration> {
    waits.iter().find(|wait| wait.timer == timer).map(|wait| wait.left)
}

/// How long this lasts at least, from one moment on.
pub(super) fn takes(timers: &[Timer], waits: &[Wait]) -> Duration {
    timers.iter().filter_map(|timer| left_of(*timer, waits)).max().unwrap_or_default()
}

/// Whether that is over at the moment from which this is to wait for.
pub(super) fn comes_behind(waits: &[Wait], timer: Timer) -> bool {
    waits.iter().any(|wait| wait.timer == timer && wait.left.is_zero())
}

/// So much time has passed without any of it being over.
pub(super) fn aged(waits: &[Wait], by: Duration) -> Waits {
    waits.iter().map(|wait| Wait { left: wait.left.saturating_sub(by), ..*wait }).collect()
}

impl<'a> Product<'a> {
    /// How long something lasts from its beginning.
    pub(super) fn lasts_whole(&self, timer: Timer) -> Duration {
        match timer {
            Timer::Time(number, event) => self.members[number].chart.time_of(event).unwrap_or_default(),
            Timer::Stands(id) => self.standing.get(&id).copied().unwrap_or_default(),
            Timer::Reverts(id) => {
                let confirm = self.worlds.configuration(id).and_then(|configuration| configuration.confirm);
                confirm.map(|confirm| confirm.within).unwrap_or_default()
            }
            Timer::Reports(at) => self.deployment.reactions[at].delay,
        }
    }

    /// What runs in a state, but for what components report; of time events with the state of the coordinator.
    fn running(&self, state: &ProductState) -> SmallVec<[(Timer, Option<NodeId>); 4]> {
        let mut all = SmallVec::new();
        for (number, member) in self.members.iter().enumerate() {
            let inside = std::iter::successors(Some(state.leaves[number]), |at| member.chart.parent(*at));
            let timed = inside.filter_map(|at| Some((Timer::Time(number, member.chart.time_event(at)?), Some(at))));
            all.extend(timed);
        }
        let under_way = state.desk.under_way().iter().flat_map(|turn| &turn.batch.requests);
        let applied = |request: &Request| if let Ask::Apply(id) = request.ask { Some(id) } else { None };
        let stands = under_way.filter_map(applied).filter(|id| self.standing.contains_key(id));
        all.extend(stands.map(|id| (Timer::Stands(id), None)));
        all.extend(state.unconfirmed.iter().filter_map(|waits| Some((Timer::Reverts(applied(&waits.request)?), None))));
        all
    }

    /// What is to wait for where everything that has a time may just have begun.
    pub(super) fn waits_in(&self, state: &ProductState) -> Waits {
        let all = self.running(state).into_iter();
        all.map(|(timer, _)| Wait { timer, left: self.lasts_whole(timer), sooner: true }).collect()
    }

    /// Whether answers in a state may have to be waited for.
    pub(super) fn may_wait(&self, state: &ProductState) -> bool {
        self.running(state).iter().any(|(timer, _)| !matches!(timer, Timer::Time(..)))
    }

    /// What answers wait for.
    pub(super) fn answered_after(&self, next: &Next) -> Timers {
        let of = |(request, verdict): &(Request, Verdict)| match (request.ask, verdict) {
            (Ask::Apply(id), Verdict::Ok) if self.standing.contains_key(&id) => Some(Timer::Stands(id)),
            (Ask::Apply(id), Verdict::Reverted) => Some(Timer::Reverts(id)),
            _ => None,
        };
        next.answers.iter().filter_map(of).collect()
    }

    /// What a move waits for. What people may raise as well waits for nothing.
    pub(super) fn timers_of(&self, next: &Next, waits: &[Wait]) -> Timers {
        match next.by {
            Move::Time(number, event) => Timers::from_iter([Timer::Time(usize::from(number), event)]),
            Move::Answer => self.answered_after(next),
            Move::Event(at) => {
                let people = |name: EventName| self.deployment.safety.iter().any(|(safety, _)| *safety == name);
                let free = self.alike_to(at).any(|name| people(name) || self.reported(name, waits).is_none());
                let first =
                    self.alike_to(at).filter_map(|name| self.reported(name, waits)).min_by_key(|wait| wait.left);
                first.filter(|_| !free).map(|wait| wait.timer).into_iter().collect()
            }
            _ => Timers::new(),
        }
    }

    /// What is to be reported by such an event first.
    fn reported(&self, name: EventName, waits: &[Wait]) -> Option<Wait> {
        let is = |wait: &&Wait| matches!(wait.timer, Timer::Reports(at) if self.deployment.reactions[at].raise == name);
        waits.iter().filter(is).min_by_key(|wait| wait.left).copied()
    }

    /// How soon a move comes by itself at the latest, all being answered at once, and by what; none: it need not.
    pub(super) fn comes_by(&self, next: &Next, waits: &[Wait]) -> Option<(Duration, Timer)> {
        let left = |timer: Timer| (left_of(timer, waits).unwrap_or_else(|| self.lasts_whole(timer)), timer);
        match next.by {
            Move::Event(at) => {
                let reported = self.alike_to(at).filter_map(|name| self.reported(name, waits));
                reported.map(|wait| (wait.left, wait.timer)).min_by_key(|(left, _)| *left)
            }
            _ => self.timers_of(next, waits).into_iter().map(left).max_by_key(|(left, _)| *left),
        }
    }

    /// What is to wait for after a move that waited for `timers` and left these states (also to enter them anew), and how long the
    /// move took.
    pub(super) fn waits_after(
        &self,
        (before, timers, after): (&ProductState, &[Timer], &ProductState),
        left: &[(usize, NodeId)],
        waits: &[Wait],
    ) -> (Waits, Duration) {
        let took = takes(timers, waits);
        let ran = self.running(before);
        let mut still = Waits::new();
        for (timer, node) in self.running(after) {
            let anew = matches!((timer, node), (Timer::Time(number, _), Some(node)) if left.contains(&(number, node)));
            let goes_on = ran.iter().any(|(other, _)| *other == timer) && !anew && !timers.contains(&timer);
            if !goes_on {
                still.push(Wait { timer, left: self.lasts_whole(timer), sooner: false });
            } else if let Some(wait) = waits.iter().find(|wait| wait.timer == timer) {
                still.push(Wait { left: wait.left.saturating_sub(took), ..*wait });
            }
        }
        // What is reported where nobody hears it does not come once more.
        let to_come = |wait: &&Wait| matches!(wait.timer, Timer::Reports(_)) && wait.left >= took;
        let to_come = waits.iter().filter(to_come).filter(|wait| !timers.contains(&wait.timer));
        still.extend(to_come.map(|wait| Wait { left: wait.left - took, ..*wait }));
        (still, took)
    }

    /// What is to wait for after a move, and how long it took.
    pub(super) fn waits_behind(&mut self, before: &ProductState, next: &Next, waits: &[Wait]) -> (Waits, Duration) {
        let left = self.left_by(before, next);
        let timers = self.timers_of(next, waits);
        let (mut after, took) = self.waits_after((before, &timers, &next.state), &left, waits);
        for (at, reaction) in self.delayed() {
            if next.by == Move::Answer && self.does_step(before, next, &StepPattern::new(&reaction.after)) {
                self.begins_anew(&mut after, Timer::Reports(at));
            }
        }
        (after, took)
    }

    /// What simulated components report a time after a step.
    pub(super) fn delayed(&self) -> impl Iterator<Item = (usize, &'a SimulatedReaction)> + use<'a> {
        let all = if self.deployment.kind.imitates { &self.deployment.reactions[..] } else { &[] };
        all.iter().enumerate().filter(|(_, reaction)| !reaction.delay.is_zero())
    }

    /// It is waited for from now on, also if it was before.
    pub(super) fn begins_anew(&self, waits: &mut Waits, timer: Timer) {
        waits.retain(|wait| wait.timer != timer);
        waits.push(Wait { timer, left: self.lasts_whole(timer), sooner: false });
    }

    /// Whether such a step is done when these requests are carried out.
    pub(super) fn does_step(&self, before: &ProductState, next: &Next, pattern: &StepPattern) -> bool {
        let requests = succeeded(next);
        if requests.is_empty() {
            return false;
        }
        let steps = self.worlds.steps(before.world, &requests, &goes(before, &requests));
        steps.iter().any(|planned| pattern.matches(&planned.step))
    }

    /// Reactions of the simulated platform, by their places among them, whose step is done when what a move answers is carried out.
    pub(super) fn reacts(&mut self, before: &ProductState, next: &Next) -> Reacts {
        if !self.deployment.kind.imitates || self.deployment.reactions.is_empty() {
            return Reacts::new();
        }
        let requests = succeeded(next);
        if requests.is_empty() {
            return Reacts::new();
        }
        let goes = goes(before, &requests);
        let key = (before.world, self.desks.asks(&requests), goes);
        if let Some(known) = self.reacts.get(&key) {
            return known.clone();
        }
        let steps = self.worlds.steps(before.world, &key.1, &key.2);
        let all = self.deployment.reactions.iter().enumerate().filter(|(_, reaction)| {
            let pattern = StepPattern::new(&reaction.after);
            steps.iter().any(|planned| pattern.matches(&planned.step))
        });
        let all: Reacts = all.filter_map(|(at, _)| u16::try_from(at).ok()).collect();
        self.reacts.insert(key, all.clone());
        all
    }

    /// What is waited for, for words.
    pub(super) fn waits_for(&self, timer: Timer) -> String {
        let lasts = self.lasts_whole(timer).as_secs_f64();
        match timer {
            Timer::Time(number, _) => {
                let at = self.waits_at(timer).unwrap_or(NodeId::ROOT);
                format!("{lasts} s in `{}`", self.members[number].chart.fqn(at))
            }
            Timer::Stands(id) => format!("{lasts} s until `{id}` stands"),
            Timer::Reverts(id) => format!("{lasts} s until `{id}` is taken back"),
            Timer::Reports(at) => format!("{lasts} s until `{}` is reported", self.deployment.reactions[at].raise),
        }
    }

    /// The state of a coordinator in which it is waited.
    pub(super) fn waits_at(&self, timer: Timer) -> Option<NodeId> {
        let Timer::Time(number, event) = timer else { return None };
        let chart = self.members[number].chart;
        chart.nodes().find(|state| chart.time_event(*state) == Some(event))
    }
}

/// The requests that a move answers with success.
fn succeeded(next: &Next) -> Vec<Request> {
    let done = next.answers.iter().filter(|(_, verdict)| verdict.is_success());
    done.map(|(request, _)| *request).collect()
}
