//! How a way is gone on the simulated platform: when what is to be raised, and which steps must be slow or go wrong so that
//! the answers come as they do on the way.
//!
//! One thing happens at a time: the moves of a way are [`limits::REPLAY_STEP`] apart, and a batch that is under way for
//! several of them has a slow step as long. What has no step takes no time: a way on which such a batch is still under way
//! when something else happens is gone in another order, and a script that replays it fails there.

use super::outcome::Beside;
use super::product::Product;
use super::stands::takes_time;
use super::state::{Move, Next, State};
use crate::limits;
use crate::model::codes::CONF_HOLDS_NEVER;
use crate::model::{Ask, ConfigId, EventName, FaultKind, Finding, Step, Verdict};
use crate::stack::{Request, Why};
use crate::statechart::EventId;
use smallvec::SmallVec;
use std::time::Duration;

/// What a move of a way needs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Replay {
    /// When it happens, from the beginning.
    pub at: Duration,
    /// What is armed before it: the text of a step, how it goes, and how long it takes.
    pub arms: Vec<(String, FaultKind, Duration)>,
    /// What is to be done for it.
    pub does: Does,
    /// At the end of a way: an answer that comes there within that time, without being part of it.
    pub then: Option<(EventName, Duration)>,
    /// At the end of a way: what is asked for there has nothing to do, so that it goes on from there at once.
    pub passes: bool,
    /// Answers that may be others, and lead to the same: what was given up and has nothing to do may be through before.
    pub either: SmallVec<[EventName; 1]>,
}

/// What is to be done for a move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Does {
    /// It comes by itself.
    #[default]
    Nothing,
    /// This event is raised.
    Raise(EventName),
    /// An operator asks for this.
    Ask(Ask),
    /// No script brings it about, and why.
    Cannot(&'static str),
}

/// A batch that begins on a way.
struct Begun {
    /// At which move.
    at: usize,
    requests: SmallVec<[Request; 2]>,
    /// At which move it is over; none: it is still under way at the end.
    over: Option<usize>,
    /// It has no step to do: it is answered at once.
    idle: bool,
}

impl Product<'_> {
    /// What each move of a way needs. `way` has the state before each move.
    pub fn replay(&self, way: &[(&State, &Next)]) -> Vec<Replay> {
        let begun = self.begun(way);
        let times = self.times(way, &begun);
        let mut all: Vec<Replay> = (way.iter().zip(&times))
            .map(|((_, next), at)| Replay {
                at: *at,
                arms: Vec::new(),
                does: self.does(next),
                then: None,
                passes: false,
                either: SmallVec::new(),
            })
            .collect();
        // What comes at the instant of something else is armed before that.
        let own_time = |k: usize| k == 0 || times[k] > times[k - 1];
        for (k, (before, next)) in way.iter().enumerate() {
            if too_late(before) || races(before, next) {
                all[k].does = Does::Cannot("an answer comes while what would stop it is on its way");
            }
            if before.safe.is_empty() && !before.interrupted.is_empty() && next.by != Move::Answer {
                all[k].does = Does::Cannot("what was interrupted goes back at once");
            }
            if let Move::Time(number, event) = next.by
                && self.time_due(&way[..k], &times, usize::from(number), event) < times[k]
            {
                all[k].does = Does::Cannot("a time is over before what comes first on the way is on its way");
            }
            let stands = |(request, verdict): &(Request, Verdict)| match request.ask {
                Ask::Apply(id) if *verdict == Verdict::Ok => self.worlds.configuration(id).is_some_and(takes_time),
                _ => false,
            };
            if next.answers.iter().any(stands) {
                all[k].does = Does::Cannot("what it stands for becomes true only with time");
            }
            if next.by == Move::Answer && self.worlds.top(before.world).is_some() {
                all[k].does = Does::Cannot("what is there is not known any more");
            }
        }
        for k in (0..way.len()).filter(|k| own_time(*k) && !way[*k].0.inbox.is_empty()) {
            all[k].does = Does::Cannot("coordinators hear at different times of one event");
        }
        if let Some(end) = all.last_mut() {
            end.passes = begun.iter().any(|batch| batch.idle && batch.over.is_none());
        }
        for batch in &begun {
            let last = times.last().copied().unwrap_or_default() + limits::REPLAY_STEP;
            let until = batch.over.map_or(last, |at| times[at]);
            let answers = batch.over.map_or(&[][..], |at| &way[at].1.answers);
            if batch.idle && until > times[batch.at] && batch.over.is_some() {
                all[batch.at].does = Does::Cannot("what has nothing to do is answered at once");
            }
            for (request, verdict) in answers.iter().filter(|(r, v)| batch.idle && cancels(batch, r, *v)) {
                let replay = &mut all[batch.over.unwrap_or(batch.at)];
                match self.leads_to_the_same(batch, request) {
                    true => replay.either.push(verdict.event(request.ask)),
                    false => replay.does = Does::Cannot("what has nothing to do is answered at once"),
                }
            }
            // At the end of the way it may have become one that is refused.
            let begins = &way[batch.at].1.state;
            let state = batch.over.map_or(&way[way.len() - 1].1.state, |_| begins);
            match self.arms(state, &batch.requests, answers, until.saturating_sub(times[batch.at])) {
                Ok(arms) => {
                    let armed = (0..=batch.at).rev().find(|k| own_time(*k)).unwrap_or(0);
                    all[armed].arms.extend(arms);
                }
                Err(why) => all[batch.over.unwrap_or(batch.at)].does = Does::Cannot(why),
            }
        }
        all
    }

    /// Whether it makes no difference that a request which is given up, and has nothing to do, is through before that: nobody
    /// hears the answer any more, and no other frame went for it.
    fn leads_to_the_same(&self, batch: &Begun, request: &Request) -> bool {
        let Ask::Apply(id) = request.ask else { return false };
        let heard = batch.requests.iter().any(|own| own.ask == request.ask && own.tag.0 != 0);
        !heard && self.worlds.configuration(id).is_some_and(|c| c.group.is_none())
    }

    /// When each move happens.
    fn times(&self, way: &[(&State, &Next)], begun: &[Begun]) -> Vec<Duration> {
        let mut times: Vec<Duration> = Vec::with_capacity(way.len());
        for (k, (_, next)) in way.iter().enumerate() {
            let before = times.last().copied().unwrap_or_default();
            let of = |request: &Request| begun.iter().find(|b| b.over == Some(k) && b.requests.contains(request));
            let at_once = match next.by {
                Move::Taken(..) => true,
                Move::Answer => next.answers.iter().all(|(request, _)| of(request).is_none_or(|batch| batch.idle)),
                _ => false,
            };
            let mut at = if at_once { before } else { before + limits::REPLAY_STEP };
            for (request, verdict) in &next.answers {
                let since = match verdict {
                    Verdict::Reverted => self.applied_at(way, &times, k, request.ask),
                    // Nobody knows what became of a call until its time is over.
                    Verdict::Broken | Verdict::UndoBroken => {
                        of(request).and_then(|b| times.get(b.at)).map(|at| *at + self.patience(request.ask))
                    }
                    _ => None,
                };
                at = at.max(since.map_or(at, |since| since + limits::REPLAY_STEP));
            }
            if let Move::Time(number, event) = next.by {
                at = at.max(self.time_due(&way[..k], &times, usize::from(number), event));
            }
            times.push(at);
        }
        times
    }

    /// When a time event comes after these moves: so long after its state was entered.
    fn time_due(&self, way: &[(&State, &Next)], times: &[Duration], number: usize, event: EventId) -> Duration {
        let chart = self.members[number].chart;
        let takes = chart.time_of(event).unwrap_or_default();
        let owner = chart.nodes().find(|node| chart.time_event(*node) == Some(event));
        let inside = |state: &State| owner.is_some_and(|owner| chart.is_inside(state.leaves[number], owner));
        let entered = way.iter().rposition(|(before, next)| inside(&next.state) && !inside(before));
        entered.map_or(Duration::ZERO, |at| times[at]) + takes
    }

    /// The batches that begin on a way, and safe configurations.
    fn begun(&self, way: &[(&State, &Next)]) -> Vec<Begun> {
        let mut all: Vec<Begun> = Vec::new();
        for (k, (before, next)) in way.iter().enumerate() {
            // One that is over may be followed at once by another of the same requests.
            let known: Vec<_> = under_way(before).into_iter().filter(|batch| !answered(next, batch)).collect();
            for requests in under_way(&next.state) {
                if known.iter().any(|other| same(other, &requests)) {
                    continue;
                }
                let gone = |next: &Next| {
                    answered(next, &requests) || !under_way(&next.state).iter().any(|other| same(other, &requests))
                };
                let over = way[k + 1..].iter().position(|(_, next)| gone(next)).map(|after| k + 1 + after);
                let group = self.worlds.group(next.state.world, &requests, &Beside::default());
                let idle = group.is_some_and(|group| group.planned.is_none_or(|planned| planned.steps.is_empty()));
                // As they are when they are answered: whoever asked may have left the state that hears it.
                let requests = over.map_or(requests.clone(), |at| {
                    under_way(way[at].0).into_iter().find(|other| same(other, &requests)).unwrap_or(requests.clone())
                });
                all.push(Begun { at: k, requests, over, idle });
            }
        }
        all
    }

    /// What must be slow or go wrong for a batch that begins in a state.
    ///
    /// # Errors
    /// Why no single fault makes it end so.
    fn arms(
        &self,
        state: &State,
        requests: &[Request],
        answers: &[(Request, Verdict)],
        takes: Duration,
    ) -> Result<Vec<(String, FaultKind, Duration)>, &'static str> {
        let mut arms = Vec::new();
        let Some(group) = self.worlds.group(state.world, requests, &Beside::default()) else { return Ok(arms) };
        let Some(planned) = &group.planned else { return Ok(arms) };
        let text = |at: usize| pattern(&planned.steps[at].step);
        let broken = |(_, verdict): &(Request, Verdict)| matches!(verdict, Verdict::Broken | Verdict::UndoBroken);
        // What hangs takes its time by itself.
        if let Some(first) = planned.steps.first()
            && !takes.is_zero()
            && !answers.iter().any(broken)
        {
            arms.push((pattern(&first.step), FaultKind::Slow, takes));
        }
        for (part, place) in group.places.iter().enumerate() {
            let request = requests[*place];
            let how = match answers.iter().find(|(r, _)| *r == request).map(|(_, verdict)| *verdict) {
                Some(Verdict::Failed | Verdict::UndoFailed) => FaultKind::Fail,
                Some(Verdict::Broken | Verdict::UndoBroken) => FaultKind::Hang,
                _ => continue,
            };
            // A component that was not created is known not to be there, however that call ends.
            let serves = |at: &usize| {
                let created = how == FaultKind::Hang && matches!(planned.steps[*at].step, Step::Create { .. });
                planned.part_of(planned.place(*at)) == part && !created
            };
            let first = (0..planned.steps.len()).find(serves);
            if first.is_none() && how == FaultKind::Hang && !planned.steps.is_empty() {
                return Err("what only creates is left in between by nothing that a script can bring about");
            }
            arms.extend(first.map(|at| (text(at), how, Duration::ZERO)));
        }
        Ok(arms)
    }

    fn does(&self, next: &Next) -> Does {
        if !next.state.flight.is_empty() {
            return Does::Cannot("an answer comes while what would stop it is on its way");
        }
        match next.by {
            Move::Event(at) | Move::Dropped(at) => Does::Raise(self.outside[usize::from(at)]),
            Move::Confirmed(id) => match self.worlds.configuration(id).and_then(|c| c.confirm) {
                Some(confirm) => Does::Raise(confirm.event),
                None => Does::Nothing,
            },
            Move::Operator(ask) => Does::Ask(ask),
            Move::Lost(_) => Does::Cannot("what a configuration stands for is lost by what components do"),
            Move::Rounds => Does::Cannot("the same happens again and again, until frames are squashed"),
            Move::OthersDown => Does::Cannot("other coordinators go down"),
            Move::Time(..) | Move::Taken(..) | Move::Answer => Does::Nothing,
        }
    }

    /// When the frame whose confirmation did not come is taken back.
    fn applied_at(&self, way: &[(&State, &Next)], times: &[Duration], before: usize, ask: Ask) -> Option<Duration> {
        let Ask::Apply(id) = ask else { return None };
        let within = self.worlds.configuration(id)?.confirm?.within;
        let applied = |k: &usize| way[*k].1.answers.iter().any(|(r, verdict)| r.ask == ask && *verdict == Verdict::Ok);
        (0..before).rev().find(applied).map(|k| times[k] + within)
    }

    /// Within what time a request that is not carried out for these reasons is answered so.
    pub(super) fn fails_within(&self, ask: Ask, reasons: &[Finding]) -> Duration {
        let waits = reasons.first().is_some_and(|reason| reason.code == CONF_HOLDS_NEVER);
        if waits { self.patience(ask) + limits::REPLAY_STEP * 2 } else { Duration::ZERO }
    }

    /// How long a step of a request may take.
    fn patience(&self, ask: Ask) -> Duration {
        let of = |id: ConfigId| self.worlds.configuration(id).and_then(|c| c.timeout);
        let own = match ask {
            Ask::Apply(id) | Ask::UndoOf(id) => of(id),
            _ => None,
        };
        own.unwrap_or(self.deployment.limits.step_timeout)
    }
}

/// The text of a step without its values: which, not how.
fn pattern(step: &Step) -> String {
    let text = step.to_string();
    let end = ["(", " = ", " : "].iter().filter_map(|mark| text.find(mark)).min().unwrap_or(text.len());
    text[..end].trim_end().to_owned()
}

/// The requests of each batch under way, and each safe configuration that is being applied.
fn under_way(state: &State) -> Vec<SmallVec<[Request; 2]>> {
    let batches = state.desk.under_way().iter().map(|turn| turn.batch.requests.clone());
    batches.chain(state.safe.iter().map(|request| SmallVec::from_iter([*request]))).collect()
}

/// Whether an undo came too late to give up what is still under way: it waits for it.
fn too_late(state: &State) -> bool {
    let waits = |undo: &Request| {
        let of = |batch: SmallVec<[Request; 2]>| crate::stack::given_up_of(undo, &batch).is_some();
        under_way(state).into_iter().any(of)
    };
    state.desk.waiting().flat_map(|batch| &batch.requests).any(waits)
}

/// Whether what is stopped is through all the same, or what was under way turns out not to have begun.
fn races(before: &State, next: &Next) -> bool {
    let through = |(request, verdict): &(Request, Verdict)| {
        let of = before.desk.under_way().iter().find(|turn| turn.batch.requests.contains(request));
        verdict.is_success() && of.is_some_and(|turn| before.is_stopped(turn.number))
    };
    let back = |requests: &SmallVec<[Request; 2]>| {
        let waits = next.state.desk.waiting().any(|batch| same(&batch.requests, requests));
        waits && !under_way(&next.state).iter().any(|other| same(other, requests))
    };
    // Or only some of it had begun: what is left of it begins anew.
    let shrinks = |requests: &SmallVec<[Request; 2]>| {
        let within = |other: &SmallVec<[Request; 2]>| {
            let known = |r: &Request| requests.iter().any(|of| (of.ask, of.requester) == (r.ask, r.requester));
            other.len() < requests.len() && other.iter().all(known)
        };
        next.answers.is_empty() && under_way(&next.state).iter().any(within)
    };
    // Or nothing of it had, and what came has cancelled it.
    let cancelled = |requests: &SmallVec<[Request; 2]>| {
        let of = |r: &Request| requests.iter().any(|of| (of.ask, of.requester) == (r.ask, r.requester));
        let goes_on = under_way(&next.state).iter().flatten().any(of);
        !goes_on && !next.answers.iter().any(|(request, _)| of(request)) && requests[0].why == Why::Asked
    };
    let stops = |requests| back(requests) || shrinks(requests) || cancelled(requests);
    next.answers.iter().any(through) || under_way(before).iter().any(stops)
}

/// Whether this answer says that a request of the batch was given up.
fn cancels(batch: &Begun, request: &Request, verdict: Verdict) -> bool {
    verdict == Verdict::Cancelled && batch.requests.iter().any(|own| own.ask == request.ask)
}

/// Whether a move answers all of a batch.
fn answered(next: &Next, batch: &[Request]) -> bool {
    let is = |request: &Request| {
        next.answers.iter().any(|(other, _)| (other.ask, other.requester) == (request.ask, request.requester))
    };
    batch.iter().all(is)
}

/// Whether two lists ask for the same.
fn same(a: &[Request], b: &[Request]) -> bool {
    let what = |request: &Request| (request.ask, request.requester);
    a.iter().map(what).eq(b.iter().map(what))
}
