//! How a way is gone on the simulated platform: when what is to be raised, and which steps must be slow or go wrong so that
//! the answers come as they do on the way.
//!
//! One thing happens at a time: the moves of a way are [`limits::REPLAY_STEP`] apart, and a batch that is under way for
//! several of them has a slow step as long. What has no step takes no time: a way on which such a batch is still under way
//! when something else happens is gone in another order, and a script that replays it fails there.

use super::loss::Loss;
use super::outcome::ConcurrentWork;
use super::product::Product;
use super::shows::{AT_ONCE, answered, goes, goes_back, races, same, too_late, under_way};
use super::stands::stands_after;
use super::state::{Move, Next, ProductState};
use super::trace::{Does, MoveReplay};
use crate::limits;
use crate::model::codes::CONF_HOLDS_NEVER;
use crate::model::{Ask, ConfigId, EventName, FaultKind, Finding, OnFailure, Step, Verdict};
use crate::stack::{Planned, Request};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::time::Duration;

/// For moves of a way: what is raised with them, for which coordinators alone, and whether that is later than what comes before.
pub(super) type Split = FxHashMap<usize, (EventName, Vec<String>, bool)>;

/// A step by its text, what goes wrong with it, and how long it takes.
type Armed = (String, FaultKind, Duration);

/// A batch that begins on a way.
pub(super) struct Begun {
    /// At which move.
    pub(super) at: usize,
    pub(super) requests: SmallVec<[Request; 2]>,
    /// At which move it is over; none: it is still under way at the end.
    pub(super) over: Option<usize>,
    /// It has no step to do: it is answered at once.
    pub(super) idle: bool,
}

/// Why no script makes what was interrupted or given up wait.
const GOES_BACK: &str = "what was interrupted or given up goes back at once";

impl Product<'_> {
    /// What each move of a way needs. `way` has the state before each move.
    pub fn replay(&mut self, way: &[(&ProductState, &Next)]) -> Vec<MoveReplay> {
        let entries = self.entries(way);
        let begun = self.begun(way);
        let split = self.split(way);
        let times = self.times(way, &begun, &split, &entries);
        let mut all: Vec<MoveReplay> = (way.iter().zip(&times))
            .enumerate()
            .map(|(k, ((before, next), at))| MoveReplay {
                at: *at,
                does: self.does(&way[..k], before, next),
                ..MoveReplay::default()
            })
            .collect();
        // What comes at the instant of something else is armed before that.
        let own_time = |k: usize| k == 0 || times[k] > times[k - 1];
        for (k, (before, next)) in way.iter().enumerate() {
            if too_late(before) || races(before, next) {
                all[k].does = Does::Cannot("an answer comes while what would stop it is on its way");
            }
            let own = next.by == Move::Answer || before.interrupted.is_empty() && matches!(next.by, Move::Taken(..));
            if before.safe.is_empty() && goes_back(before) && !own {
                all[k].does = Does::Cannot(GOES_BACK);
            }
            if own_time(k) && self.shows(before).is_at_once() {
                all[k].does = Does::Cannot(AT_ONCE);
            }
            let reverted = next.answers.iter().any(|(_, verdict)| *verdict == Verdict::Reverted);
            if reverted && !before.desk.is_empty() {
                all[k].does = Does::Cannot("what is taken back unconfirmed may have to wait for what is under way");
            }
            let late = |state: &ProductState| state.unconfirmed.iter().filter(|waits| waits.late).count();
            if late(&next.state) > late(before) {
                all[k].does =
                    Does::Cannot("what confirms comes too late, while what takes back waits for what is under way");
            }
            if self.is_unconfirmed_for_too_long(way, k, &times) || self.is_overdue(way, k, &times, &entries) {
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
            if matches!(all[k].does, Does::Cannot(_)) {
                continue;
            }
            if let (Move::Taken(number, _), true) = (way[k].1.by, later)
                && way[k].0.inbox.iter().filter(|(to, _)| *to == number).count() > 1
            {
                all[k].does = Does::Cannot("what one coordinator tells another one is heard at once");
                continue;
            }
            // For nobody, too: what it ends, begins or confirms is so before anybody hears it.
            all[k].does = Does::RaiseTo(event);
            all[k].others = to;
        }
        if way.last().is_some_and(|(_, next)| self.never_rests(&next.state)) {
            all.last_mut()
                .into_iter()
                .for_each(|end| end.does = Does::Cannot("from there on it goes round for ever at once"));
        }
        if let Some(end) = all.last_mut() {
            // What is raised last is heard at once.
            let heard = matches!(end.does, Does::Raise(_)) && !way[way.len() - 1].1.state.inbox.is_empty();
            end.passes = heard || begun.iter().any(|batch| batch.idle && batch.over.is_none());
        }
        for batch in &begun {
            let last = times.last().copied().unwrap_or_default() + limits::REPLAY_STEP;
            let until = batch.over.map_or(last, |at| times[at]);
            let answers = batch.over.map_or(&[][..], |at| &way[at].1.answers);
            if batch.idle && until > times[batch.at] && batch.over.is_some() {
                all[batch.at].does = Does::Cannot(AT_ONCE);
            }
            if self.finds_all_done(way, batch, &times) {
                all[batch.at].does = Does::Cannot(AT_ONCE);
            }
            for (request, verdict) in answers.iter().filter(|(r, v)| batch.idle && cancels(batch, r, *v)) {
                let replay = &mut all[batch.over.unwrap_or(batch.at)];
                match self.leads_to_the_same(batch, request) {
                    true => replay.either.push(verdict.event(request.ask)),
                    false => replay.does = Does::Cannot(AT_ONCE),
                }
            }
            // At the end of the way it may have become one that is refused.
            let begins = &way[batch.at].1.state;
            let state = batch.over.map_or(&way[way.len() - 1].1.state, |_| begins);
            let stands = batch.over.and_then(|at| self.stands_after(way[at].1)).unwrap_or_default();
            let takes = until.saturating_sub(times[batch.at]).saturating_sub(stands);
            match self.arms(state, &batch.requests, answers, takes) {
                // They would meet the steps of what goes back just then.
                Ok(arms) if self.meets_what_goes_back(way, &begun, batch, &arms) => {
                    all[batch.at].does = Does::Cannot(GOES_BACK);
                }
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

    /// Whether a safe configuration waits for another one that does all that it is about, and would be under way for longer.
    fn finds_all_done(&self, way: &[(&ProductState, &Next)], batch: &Begun, times: &[Duration]) -> bool {
        let begins = &way[batch.at].1.state;
        let own = |request: &Request| same(std::slice::from_ref(request), &batch.requests);
        if begins.safe.len() < 2 || !begins.safe.iter().any(own) {
            return false;
        }
        let over = batch.over.unwrap_or(way.len() - 1);
        let Some(alone) = (batch.at + 1..over).find(|k| way[*k].1.state.safe.len() == 1) else { return false };
        let group = self.worlds.group(way[alone].1.state.world, &batch.requests, &ConcurrentWork::default());
        times[over] > times[alone] && group.is_some_and(|g| g.planned.is_none_or(|planned| planned.steps.is_empty()))
    }

    /// Whether what is armed for the rest of a batch would meet a step with which what was given up of it goes back just then.
    fn meets_what_goes_back(
        &self,
        way: &[(&ProductState, &Next)],
        begun: &[Begun],
        batch: &Begun,
        arms: &[Armed],
    ) -> bool {
        let given_up = way[batch.at].1.answers.iter().filter(|(_, verdict)| *verdict == Verdict::Cancelled);
        let of = |request: &Request| {
            begun.iter().find(|of| of.over == Some(batch.at) && !of.idle && of.requests.contains(request))
        };
        given_up.filter_map(|(request, _)| of(request)).any(|before| {
            let state = &way[before.at].1.state;
            let steps = self.worlds.steps(state.world, &before.requests, &goes(state, &before.requests));
            let back: Vec<String> = steps.iter().flat_map(|planned| planned.undo.steps()).map(pattern).collect();
            arms.iter().any(|(step, ..)| back.contains(step))
        })
    }

    /// Whether it makes no difference that a request which is given up, and has nothing to do, is through before that: nobody
    /// hears the answer any more, and no other frame went for it.
    fn leads_to_the_same(&self, batch: &Begun, request: &Request) -> bool {
        let Ask::Apply(id) = request.ask else { return false };
        let heard = batch.requests.iter().any(|own| own.ask == request.ask && own.tag.0 != 0);
        !heard && self.worlds.configuration(id).is_some_and(|c| c.group.is_none())
    }

    /// Whether an event from another coordinator, or of a loss, is on its way to one: that nobody holds up.
    pub(super) fn is_told_between(&self, state: &ProductState) -> bool {
        state.inbox.iter().any(|(to, event)| {
            let name = self.members[usize::from(*to)].name_of(*event);
            !name.is_some_and(|name| self.outside.contains(&name))
        })
    }

    /// Where an event from outside has to be raised for each coordinator alone, since they do not hear of it one after the
    /// other and before anything else happens.
    fn split(&self, way: &[(&ProductState, &Next)]) -> Split {
        let mut split = Split::default();
        for (k, (_, next)) in way.iter().enumerate() {
            let Move::Event(at) = next.by else { continue };
            if k + 1 == way.len() {
                continue;
            }
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

    /// The batches that begin on a way, and safe configurations.
    fn begun(&self, way: &[(&ProductState, &Next)]) -> Vec<Begun> {
        let mut all: Vec<Begun> = Vec::new();
        for (k, (before, next)) in way.iter().enumerate() {
            // One that is over may be followed at once by another of the same requests.
            let known: Vec<_> = under_way(before).filter(|batch| !answered(before, next, batch)).collect();
            for requests in under_way(&next.state) {
                if known.iter().any(|other| same(other, requests)) {
                    continue;
                }
                let gone = |(before, next): &(&ProductState, &Next)| {
                    answered(before, next, requests) || !under_way(&next.state).any(|other| same(other, requests))
                };
                let over = way[k + 1..].iter().position(gone).map(|after| k + 1 + after);
                let group = self.worlds.group(next.state.world, requests, &goes(&next.state, requests));
                let idle = group.is_some_and(|group| group.planned.is_none_or(|planned| planned.steps.is_empty()));
                // As they are when they are answered: whoever asked may have left the state that hears it.
                let told = over.and_then(|at| under_way(way[at].0).find(|other| same(other, requests)));
                let requests = SmallVec::from_slice(told.unwrap_or(requests));
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
        state: &ProductState,
        requests: &[Request],
        answers: &[(Request, Verdict)],
        takes: Duration,
    ) -> Result<Vec<Armed>, &'static str> {
        let mut arms = Vec::new();
        let Some(group) = self.worlds.group(state.world, requests, &goes(state, requests)) else { return Ok(arms) };
        let Some(planned) = &group.planned else { return Ok(arms) };
        let text = |at: usize| pattern(&planned.steps[at].step);
        let mut fails: Option<usize> = None;
        let broken = |(_, verdict): &(Request, Verdict)| matches!(verdict, Verdict::Broken | Verdict::UndoBroken);
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
            fails = fails.or(first);
            arms.extend(first.map(|at| (text(at), how, Duration::ZERO)));
            // What is begun together with it, and done, would stay: then it has not simply failed.
            let concurrent = first.filter(|_| how == FaultKind::Fail && stays(planned, part));
            let concurrent = concurrent.into_iter().flat_map(|first| begun_with(planned, first, part));
            arms.extend(concurrent.take(limits::SESSION_WORKERS - 1).map(|at| (text(at), how, Duration::ZERO)));
        }
        // What hangs takes its time by itself.
        if takes.is_zero() || planned.steps.is_empty() || answers.iter().any(broken) {
            return Ok(arms);
        }
        if requests.iter().any(|request| takes >= self.patience(request.ask)) {
            return Err("what is under way on it all the time would not have so long");
        }
        // What is slow is what goes wrong, or else the last step: what follows it would meet what is armed for others
        // meanwhile. Where it is given up nothing is to be done before.
        let all_ok = !answers.is_empty() && answers.iter().all(|(_, verdict)| verdict.is_success());
        let last = if all_ok { planned.steps.len() - 1 } else { 0 };
        arms.insert(0, (text(fails.unwrap_or(last)), FaultKind::Slow, takes));
        Ok(arms)
    }

    /// How long after its last step what a move answers *ok* stands; none: it does not.
    pub(super) fn stands_after(&self, next: &Next) -> Option<Duration> {
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
        way: &[(&ProductState, &Next)],
        over: usize,
        state: &ProductState,
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
        let group = self.worlds.group(state.world, &batch.requests, &goes(state, &batch.requests))?;
        let planned = group.planned.as_ref()?;
        let place = batch.requests.iter().position(|request| request.ask == Ask::Apply(id))?;
        let part = group.places.iter().position(|of| *of == place)?;
        let steps = (0..planned.steps.len()).rev().filter(|at| planned.part_of(planned.place(*at)) == part);
        let mut seen = steps.map(|at| &planned.steps[at].step).filter(|step| !matches!(step, Step::Operation(_)));
        seen.next().map(|step| (pattern(step), FaultKind::Lie, Duration::ZERO))
    }

    fn does(&self, way: &[(&ProductState, &Next)], before: &ProductState, next: &Next) -> Does {
        if !next.state.in_transit.is_empty() {
            return Does::Cannot("an answer comes while what would stop it is on its way");
        }
        match next.by {
            Move::Event(at) | Move::Unheard(at) if self.is_told_by_child(self.outside[usize::from(at)]) => {
                Does::Cannot("a subsystem tells something just then")
            }
            Move::Event(at) | Move::Dropped(at) | Move::Unheard(at) => Does::Raise(self.outside[usize::from(at)]),
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
            Move::Elsewhere(_) => {
                Does::Cannot("a safe configuration of coordinators that are followed apart comes just then")
            }
            Move::OthersDown if self.was_ended(way) => Does::OthersDown,
            Move::OthersDown => Does::Cannot("nobody has told the other coordinators to come down"),
            Move::Time(..) | Move::Taken(..) | Move::Answer => Does::Nothing,
        }
    }

    /// Whether the event that ends the deployment has come since it was last wanted up.
    fn was_ended(&self, way: &[(&ProductState, &Next)]) -> bool {
        let last = way.iter().rev().find_map(|(_, next)| match next.by {
            Move::Event(at) | Move::Dropped(at) if self.is_first_or_last(Move::Event(at)) => {
                Some(self.outside[usize::from(at)])
            }
            _ => None,
        });
        last == Some(self.deployment.shutdown.event)
    }

    /// Within what time a request that is not carried out for these reasons is answered so.
    pub(super) fn fails_within(&self, ask: Ask, reasons: &[Finding]) -> Duration {
        let waits = reasons.first().is_some_and(|reason| reason.code == CONF_HOLDS_NEVER);
        if waits { self.patience(ask) + limits::REPLAY_STEP * 2 } else { Duration::ZERO }
    }
}

/// Whether something that was done of a part stays when the part fails: nothing goes back, or not what would move.
fn stays(planned: &Planned, part: usize) -> bool {
    let mut own = (0..planned.steps.len()).filter(|at| planned.part_of(planned.place(*at)) == part);
    match planned.parts[part].on_failure {
        OnFailure::Hold => true,
        OnFailure::Rollback => false,
        OnFailure::Unset => own.any(|at| planned.steps[at].undo_moves),
    }
}

/// The steps of a part that begin together with its first one.
fn begun_with(planned: &Planned, first: usize, part: usize) -> impl Iterator<Item = usize> {
    let of = move |at: usize| planned.part_of(planned.place(at)) == part;
    let waits = move |at: usize| planned.steps[at].after.iter().any(|before| of(*before as usize));
    let wave = planned.steps[first].wave;
    (first + 1..planned.steps.len()).filter(move |at| of(*at) && planned.steps[*at].wave == wave && !waits(*at))
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
