//! How a way is gone on the simulated platform: when what is to be raised, and which steps must be slow or go wrong so that
//! the answers come as they do on the way.
//!
//! One thing happens at a time: the moves of a way are [`limits::REPLAY_STEP`] apart, and a batch that is under way for
//! several of them has a slow step as long. What has no step takes no time: a way on which such a batch is still under way
//! when something else happens is gone in another order, and a script that replays it fails there.

use super::loss::Loss;
use super::outcome::Beside;
use super::product::Product;
use super::shows::{answered, races, same, too_late, under_way};
use super::stands::stands_after;
use super::state::{Move, Next, State};
use super::trace::{Does, Replay};
use crate::limits;
use crate::model::codes::CONF_HOLDS_NEVER;
use crate::model::{Ask, ConfigId, EventName, FaultKind, Finding, Step, Verdict};
use crate::stack::Request;
use crate::statechart::EventId;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::time::Duration;

/// For moves of a way: what is raised with them, for which coordinators alone, and whether that is later than what comes before.
type Split = FxHashMap<usize, (EventName, Vec<String>, bool)>;

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
        let split = self.split(way);
        let times = self.times(way, &begun, &split);
        let mut all: Vec<Replay> = (way.iter().zip(&times))
            .enumerate()
            .map(|(k, ((before, next), at))| Replay {
                at: *at,
                does: self.does(&way[..k], before, next),
                ..Replay::default()
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
            let reverted = next.answers.iter().any(|(_, verdict)| *verdict == Verdict::Reverted);
            if reverted && !before.desk.is_empty() {
                all[k].does = Does::Cannot("what is taken back unconfirmed may have to wait for what is under way");
            }
            if let Move::Time(number, event) = next.by
                && self.time_due(&way[..k], &times, usize::from(number), event) < times[k]
            {
                all[k].does = Does::Cannot("a time is over before what comes first on the way is on its way");
            }
            if self.stands_after(next).is_none() {
                all[k].does = Does::Cannot("what it stands for never becomes true there");
            }
            if next.by == Move::Answer && self.worlds.top(before.world).is_some() {
                all[k].does = Does::Cannot("what is there is not known any more");
            }
        }
        for replay in all.iter_mut().filter(|replay| replay.does == Does::OthersDown) {
            let members = || self.members.iter().map(|member| member.name);
            let others = self.deployment.coordinators.iter().filter(|c| !members().any(|name| name == c.name));
            replay.others = others.map(|other| format!("{}:{}", other.name, other.down)).collect();
        }
        for k in (0..way.len()).filter(|k| own_time(*k) && self.is_told_between(way[*k].0)) {
            all[k].does = Does::Cannot("what one coordinator tells another one is heard at once");
        }
        for (k, (event, to, later)) in split {
            if let (Move::Taken(number, _), true) = (way[k].1.by, later)
                && way[k].0.inbox.iter().filter(|(to, _)| *to == number).count() > 1
            {
                all[k].does = Does::Cannot("what one coordinator tells another one is heard at once");
                continue;
            }
            all[k].does = if to.is_empty() { Does::Nothing } else { Does::RaiseTo(event) };
            all[k].others = to;
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
            let stands = batch.over.and_then(|at| self.stands_after(way[at].1)).unwrap_or_default();
            let takes = until.saturating_sub(times[batch.at]).saturating_sub(stands);
            match self.arms(state, &batch.requests, answers, takes) {
                Ok(mut arms) => {
                    arms.extend(batch.over.and_then(|at| self.lie(way, at, state, batch)));
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

    /// Whether an event from another coordinator, or of a loss, is on its way to one: that nobody holds up.
    pub(super) fn is_told_between(&self, state: &State) -> bool {
        state.inbox.iter().any(|(to, event)| {
            let name = self.members[usize::from(*to)].name_of(*event);
            !name.is_some_and(|name| self.outside.contains(&name))
        })
    }

    /// Where an event from outside has to be raised for each coordinator alone, since they do not hear of it one after the
    /// other and before anything else happens.
    fn split(&self, way: &[(&State, &Next)]) -> Split {
        let mut split = Split::default();
        for (k, (_, next)) in way.iter().enumerate() {
            let Move::Event(at) = next.by else { continue };
            let name = self.outside[usize::from(at)];
            let inbox = next.state.inbox.iter();
            let lies = inbox.filter(|(to, event)| self.members[usize::from(*to)].name_of(*event) == Some(name));
            let waits: Vec<u8> = lies.map(|(to, _)| *to).collect();
            let mut taken: Vec<(usize, u8)> = Vec::new();
            for (j, (_, next)) in way.iter().enumerate().skip(k + 1) {
                match next.by {
                    Move::Event(_) => break,
                    Move::Taken(number, event) if self.members[usize::from(number)].name_of(event) == Some(name) => {
                        taken.push((j, number));
                    }
                    _ => {}
                }
            }
            let in_order = taken.iter().map(|(_, number)| number).is_sorted();
            let at_once = taken.iter().zip(k + 1..).all(|((j, _), place)| *j == place);
            if waits.is_empty() || in_order && at_once && taken.len() == waits.len() {
                continue;
            }
            let waiting = |name| waits.iter().any(|number| self.members[usize::from(*number)].name == name);
            let others = self.deployment.coordinators.iter().filter(|c| !waiting(c.name));
            split.insert(k, (name, others.map(|c| c.name.to_string()).collect(), false));
            let mut before = k;
            for (j, number) in taken {
                let to = vec![self.members[usize::from(number)].name.to_string()];
                split.insert(j, (name, to, j > before + 1));
                before = j;
            }
        }
        split
    }

    /// When each move happens.
    fn times(&self, way: &[(&State, &Next)], begun: &[Begun], split: &Split) -> Vec<Duration> {
        let mut times: Vec<Duration> = Vec::with_capacity(way.len());
        for (k, (_, next)) in way.iter().enumerate() {
            let before = times.last().copied().unwrap_or_default();
            let of = |request: &Request| begun.iter().find(|b| b.over == Some(k) && b.requests.contains(request));
            let at_once = match next.by {
                Move::Taken(..) => split.get(&k).is_none_or(|(_, _, later)| !later),
                Move::Answer => next.answers.iter().all(|(request, _)| of(request).is_none_or(|batch| batch.idle)),
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

    /// How long after its last step what a move answers *ok* stands; none: it does not.
    fn stands_after(&self, next: &Next) -> Option<Duration> {
        let mut after = Duration::ZERO;
        for (request, verdict) in &next.answers {
            if let (Ask::Apply(id), Verdict::Ok) = (request.ask, verdict)
                && let Some(configuration) = self.worlds.configuration(id).filter(|c| c.holds.is_some())
                && let Some(world) = self.worlds.get(next.state.world)
            {
                after = after.max(stands_after(self.deployment, configuration, &world.system)?);
            }
        }
        Some(after)
    }

    /// What a batch says to have done and has not, where something it applies is lost for that later.
    fn lie(
        &self,
        way: &[(&State, &Next)],
        over: usize,
        state: &State,
        batch: &Begun,
    ) -> Option<(String, FaultKind, Duration)> {
        let ok = |next: &Next, id: ConfigId| {
            next.answers.iter().any(|(request, verdict)| request.ask == Ask::Apply(id) && *verdict == Verdict::Ok)
        };
        let lost = |k: usize| match way[k].1.by {
            Move::Lost(id) if self.loss(way[k].0, id) == Some(Loss::Lie) => Some(id),
            _ => None,
        };
        let id = (over + 1..way.len()).filter_map(lost).find(|id| ok(way[over].1, *id))?;
        let group = self.worlds.group(state.world, &batch.requests, &Beside::default())?;
        let planned = group.planned.as_ref()?;
        let place = batch.requests.iter().position(|request| request.ask == Ask::Apply(id))?;
        let part = group.places.iter().position(|of| *of == place)?;
        let steps = (0..planned.steps.len()).rev().filter(|at| planned.part_of(planned.place(*at)) == part);
        let mut seen = steps.map(|at| &planned.steps[at].step).filter(|step| !matches!(step, Step::Operation(_)));
        seen.next().map(|step| (pattern(step), FaultKind::Lie, Duration::ZERO))
    }

    fn does(&self, way: &[(&State, &Next)], before: &State, next: &Next) -> Does {
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
            Move::Lost(id) => {
                let told = Verdict::Lost.event(Ask::Apply(id));
                match self.loss(before, id) {
                    Some(Loss::Fails(component)) => Does::Fail(component, told),
                    Some(Loss::Lie) => Does::Hear(told),
                    None => Does::Cannot("what it stands for cannot be lost alone"),
                }
            }
            Move::Rounds => Does::Cannot("the same happens again and again, until frames are squashed"),
            Move::OthersDown if self.was_ended(way) => Does::OthersDown,
            Move::OthersDown => Does::Cannot("nobody has told the other coordinators to come down"),
            Move::Time(..) | Move::Taken(..) | Move::Answer => Does::Nothing,
        }
    }

    /// Whether the event that ends the deployment has come since it was last wanted up.
    fn was_ended(&self, way: &[(&State, &Next)]) -> bool {
        let last = way.iter().rev().find_map(|(_, next)| match next.by {
            Move::Event(at) | Move::Dropped(at) if self.is_first_or_last(Move::Event(at)) => {
                Some(self.outside[usize::from(at)])
            }
            _ => None,
        });
        last == Some(self.deployment.shutdown.event)
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

/// Whether this answer says that a request of the batch was given up.
fn cancels(batch: &Begun, request: &Request, verdict: Verdict) -> bool {
    verdict == Verdict::Cancelled && batch.requests.iter().any(|own| own.ask == request.ask)
}
