//! How what is under way may end.

use super::desks::AnsweredPlaces;
use super::kept::KeptValue;
use super::outcome::{Comes, EndsSo, InterruptedSo, Went, WorldId};
use super::product::{Product, as_begun};
use super::seldom::Unconfirmed;
use super::state::{Answers, Failed, Move, Next, Nexts, ProductState, Trouble};
use super::world::Top;
use crate::model::{Ask, Verdict};
use crate::stack::{Ending, Endings, Request, Requester, Settled, Stopped, Why, settle};
use crate::transaction::{Stopping, endings};
use smallvec::SmallVec;
use std::cmp::Ordering;

/// Of so many undos of one batch that found nothing it is told apart whether they were about what is set aside.
const SOME_ASIDE: usize = 4;

/// How a group under way has ended: what it leads to, and the answers.
struct End<'e> {
    went: &'e Went,
    /// The requests that are answered: place and verdict; none: nobody is told.
    given: KeptValue<AnsweredPlaces>,
    class: Failed,
}

/// Who is answered what, as it is settled.
fn given(settled: &Settled) -> AnsweredPlaces {
    settled.answers.iter().map(|(place, verdict, _)| (*place, *verdict)).collect()
}

impl Product<'_> {
    /// How a batch under way may end, or its first requests.
    pub(super) fn ends(&mut self, state: &ProductState, number: u32, nexts: &mut Nexts) {
        let Some(active) = state.desk.active(number) else { return };
        let requests = &active.batch.requests[..];
        if let Some(top) = self.worlds.top(state.world) {
            return self.ends_somehow(state, number, top, requests, nexts);
        }
        let comes = self.comes(state, number);
        // What is safe came in between: who asks could not know of it, and its frame stays.
        let stays = comes.refused.iter().any(|(place, why)| requests[*place].was_overtaken(why));
        for (place, reasons) in comes.refused.iter().filter(|(place, why)| !requests[*place].was_overtaken(why)) {
            if requests[*place].requester != Requester::Operator {
                nexts.troubles.push(Trouble::Refused(requests[*place], reasons.clone()));
            }
        }
        for (place, reasons) in &comes.hollow {
            if requests[*place].requester != Requester::Operator {
                nexts.troubles.push(Trouble::Hollow(requests[*place], reasons.clone()));
            }
        }
        nexts.warnings.extend(comes.warnings.clone());
        let ways = comes.ends.get_or_init(|| self.ways_to_end(requests, &comes)).clone();
        for EndsSo { endings, given } in ways.iter() {
            let from = nexts.all.len();
            self.ends_given(state, number, requests, &comes, endings, given.clone(), nexts);
            if stays {
                nexts.all[from..].iter_mut().for_each(|next| next.failed = next.failed.max(Failed::Undo));
            }
            if state.aside {
                self.ends_as_aside(state, number, requests, &comes, endings, nexts);
            }
            if endings.iter().all(|ending| *ending == Ending::Done) {
                let deep = (comes.done.deep, comes.done.left);
                nexts.all[from..].iter_mut().for_each(|next| next.deep = deep);
            }
        }
    }

    /// How a batch may end where nothing stops it: always the same where it comes to the same.
    fn ways_to_end(&self, requests: &[Request], comes: &Comes) -> KeptValue<Vec<EndsSo>> {
        let group = comes.group.group();
        let so = |endings: Endings| {
            let given = self.desks.given(given(&settle(requests, &group, &endings, Stopped::Not)));
            EndsSo { endings, given }
        };
        self.worlds.ends.keep(comes.endings(Stopping::Not, self.tells_all).map(so).collect())
    }

    /// The parts of a group under way have ended so, and no safe configuration interrupts them.
    fn ends_so(
        &mut self,
        state: &ProductState,
        number: u32,
        requests: &[Request],
        comes: &Comes,
        endings: &[Ending],
        nexts: &mut Nexts,
    ) {
        let given = self.desks.given(given(&settle(requests, &comes.group.group(), endings, Stopped::Not)));
        self.ends_given(state, number, requests, comes, endings, given, nexts);
    }

    /// The same where some is set aside: an undo that found nothing may have been about that and have failed, and so may one that
    /// has nothing to do, since something may be in its way.
    fn ends_as_aside(
        &mut self,
        state: &ProductState,
        number: u32,
        requests: &[Request],
        comes: &Comes,
        endings: &[Ending],
        nexts: &mut Nexts,
    ) {
        let told = given(&settle(requests, &comes.group.group(), endings, Stopped::Not));
        let is_part = |place: usize| comes.group.places().any(|of| of == place);
        let found_nothing =
            told.iter().filter(|(place, verdict)| !is_part(*place) && *verdict == Some(Verdict::Undone));
        let found_nothing: SmallVec<[usize; 2]> = found_nothing.map(|(place, _)| *place).collect();
        let may = self.may_be_aside(requests, &found_nothing);
        for some in 1..1u32 << may.len().min(SOME_ASIDE) {
            let fails = |place: usize| {
                may.iter().position(|of| *of == place).is_some_and(|at| some & (1 << at.min(SOME_ASIDE - 1)) != 0)
            };
            let mut given = told.clone();
            given
                .iter_mut()
                .filter(|(place, _)| fails(*place))
                .for_each(|(_, verdict)| *verdict = Some(Verdict::UndoFailed));
            let (from, given) = (nexts.all.len(), self.desks.given(given));
            self.ends_given(state, number, requests, comes, endings, given, nexts);
            nexts.all[from..].iter_mut().for_each(|next| next.failed = next.failed.max(Failed::Undo));
        }
        let done = endings.iter().all(|ending| *ending == Ending::Done);
        let idle = |part: &usize| !comes.can_fail[*part] && self.may_be_in_the_way(&requests[comes.group.place(*part)]);
        let idle: SmallVec<[usize; 2]> = (0..comes.can_fail.len()).filter(|part| done && idle(part)).collect();
        for part in idle {
            let of = |at: usize| match at.cmp(&part) {
                Ordering::Less => Ending::Done,
                Ordering::Equal => Ending::Failed,
                Ordering::Greater => Ending::Anew,
            };
            let endings: SmallVec<[Ending; 2]> = (0..comes.can_fail.len()).map(of).collect();
            self.ends_so(state, number, requests, comes, &endings, nexts);
        }
    }

    /// They have ended so, and these are the answers.
    #[expect(clippy::too_many_arguments, reason = "what a group under way is, and how it ended")]
    fn ends_given(
        &mut self,
        state: &ProductState,
        number: u32,
        requests: &[Request],
        comes: &Comes,
        endings: &[Ending],
        given: KeptValue<AnsweredPlaces>,
        nexts: &mut Nexts,
    ) {
        let Some(went) = comes.went(endings) else { return self.broke(state, number, requests, given, nexts) };
        let class = match endings.iter().position(|ending| *ending == Ending::Failed) {
            Some(part) if comes.undoes(part, requests) => Failed::Undo,
            Some(_) => Failed::Apply,
            None => Failed::Nothing,
        };
        self.ended(state, number, &End { went, given, class }, nexts);
    }

    /// Nothing is known: each request may end in any way, one after the other.
    fn ends_somehow(&mut self, state: &ProductState, number: u32, top: Top, requests: &[Request], nexts: &mut Nexts) {
        let ask = requests[0].ask;
        // It may have begun together with those before it, and may not.
        if requests[0].is_overtaken().is_some() {
            let went = Went::to(state.world);
            self.ended(state, number, &self.first_ends(&went, Some(Verdict::Cancelled)), nexts);
        }
        for verdict in [ask.done(), ask.failed(), ask.broken()] {
            let went = Went::to(self.worlds.answered(top, &requests[0], verdict));
            self.ended(state, number, &self.first_ends(&went, Some(verdict)), nexts);
        }
        if matches!(requests[0].why, Why::Unconfirmed(..)) {
            // Nobody is told where the frame is gone.
            let went = Went::to(state.world);
            self.ended(state, number, &self.first_ends(&went, None), nexts);
        }
    }

    /// Something of a batch under way is left in between.
    fn broke(
        &mut self,
        state: &ProductState,
        number: u32,
        requests: &[Request],
        given: KeptValue<AnsweredPlaces>,
        nexts: &mut Nexts,
    ) {
        let world = self.worlds.broken(state.world, requests.iter().map(|request| request.ask));
        let mut state = state.clone();
        if !self.tells_all {
            state.waits_for_none();
        }
        self.ended(&state, number, &End { went: &Went::to(world), given, class: Failed::Broken }, nexts);
    }

    /// These requests of a batch under way are answered, and the world has become another one.
    fn ended(&mut self, state: &ProductState, number: u32, end: &End<'_>, nexts: &mut Nexts) {
        let End { went, given, class } = end;
        let mut next = state.clone();
        self.go(&mut next, went);
        next.forget_batch(number);
        let answered = self.desks.all_answered(&mut next.desk, number, given);
        for (request, verdict) in &answered.answers {
            self.applied(&mut next, request, *verdict, went);
        }
        if answered.undo_failed.is_empty() {
            return self.goes_on_behind(next, number, &answered.answers, *class, nexts);
        }
        for next in self.undos_failed(next, &answered.undo_failed) {
            self.goes_on_behind(next, number, &answered.answers, *class, nexts);
        }
    }

    /// Requests of a batch under way are answered: the rest of it begins, and they are told.
    fn goes_on_behind(
        &mut self,
        mut next: ProductState,
        number: u32,
        answers: &Answers,
        class: Failed,
        nexts: &mut Nexts,
    ) {
        // What was given up together with one before it is not taken up anew; where nothing is known it may have begun with it.
        while (!self.tells_all || self.worlds.top(next.world).is_none())
            && let Some(place) =
                next.desk.active(number).and_then(|active| active.given_up.iter().map(|of| of.place).min())
        {
            self.cancel_behind(&mut next, number, place);
        }
        // The rest of it begins before whatever waits.
        self.takes_place(&mut next, number);
        for next in self.lands(next) {
            self.tell(next, answers, class, nexts);
        }
    }

    /// What a request that was carried out leaves to be waited for.
    fn applied(&self, state: &mut ProductState, request: &Request, verdict: Verdict, went: &Went) {
        let Ask::Apply(id) = request.ask else { return };
        let confirmed = state.confirmed.contains(&id);
        if confirmed {
            state.change(|seldom| seldom.confirmed.retain(|of| *of != id));
        }
        if verdict != Verdict::Ok {
            return;
        }
        if state.lost.contains(&id) {
            state.change(|seldom| seldom.lost.retain(|lost| *lost != id));
        }
        self.stands_for(state, id);
        let waits = !confirmed && self.worlds.configuration(id).is_some_and(|c| c.confirm.is_some());
        // One batch may push several of them.
        let free = |place: u8| state.unconfirmed.iter().all(|waits| waits.place != place);
        let pushed = went.places.iter().flat_map(|places| &places.pushed);
        let mut pushed = pushed.filter(|(of, place)| *of == id && free(*place));
        let unknown = (self.tells_all && self.worlds.top(state.world).is_some()).then_some(u8::MAX);
        if let (true, Some(place)) = (waits, pushed.next().map(|(_, place)| *place).or(unknown)) {
            // In which state it was asked for means nothing any more.
            let request = Request { why: Why::Asked, tag: (0, 0), ..*request };
            state.change(|seldom| seldom.unconfirmed.push(Unconfirmed { place, request, late: false }));
        }
    }

    /// How a batch under way that was stopped may end.
    pub(super) fn stopped_ends(&mut self, state: &ProductState, number: u32, nexts: &mut Nexts) {
        let Some(active) = state.desk.active(number) else { return };
        let requests = &active.batch.requests[..];
        if requests.is_empty() {
            return;
        }
        // In the order in which they came.
        let given_up: SmallVec<[usize; 1]> = active.given_up.iter().map(|given_up| given_up.place).collect();
        let interrupted = state.interrupted(number);
        let before = interrupted.map_or(given_up.len(), |interrupted| interrupted.given_up.min(given_up.len()));
        let interrupted = interrupted.map(|interrupted| interrupted.planned);
        if let Some(planned) = interrupted.filter(|planned| self.worlds.top(*planned).is_none()) {
            // What came at the same moment may have been told first; and what came when it was on its way back, too late.
            let some = if self.tells_all { 0 } else { before };
            for count in some..=given_up.len() {
                self.interrupted_ends(state, number, requests, planned, &given_up[..count], nexts);
            }
            return;
        }
        if let Some(top) = self.worlds.top(state.world) {
            let (ask, cancelled) = (requests[0].ask, given_up.contains(&0).then_some(Verdict::Cancelled));
            // What is interrupted is not carried out; an undo of what is not there is done without.
            let done = (interrupted.is_none() || ask.is_undo()).then_some(ask.done());
            for verdict in [ask.failed(), ask.broken()].into_iter().chain(done).chain(cancelled) {
                let went = match interrupted.is_some() && verdict == ask.done() {
                    true => Went::to(state.world),
                    false => Went::to(self.worlds.answered(top, &requests[0], verdict)),
                };
                self.ended(state, number, &self.first_ends(&went, Some(verdict)), nexts);
            }
            return;
        }
        let comes = self.comes(state, number);
        let first = |given_up: &[usize]| comes.group.places().position(|place| given_up.contains(&place));
        // It may be refused by now, or have been; or it was on its way back, or through, when that came.
        if self.tells_all || first(&given_up).is_none() {
            self.ends(state, number, nexts);
        }
        // What came when it was on its way back already came too late.
        let some = if self.tells_all { 1 } else { given_up.len().max(1) };
        let mut met: SmallVec<[usize; 2]> = SmallVec::new();
        for count in some..=given_up.len() {
            let Some(k) = first(&given_up[..count]).filter(|k| !met.contains(k)) else { continue };
            met.push(k);
            for endings in comes.endings(Stopping::GivenUp(k), self.tells_all) {
                self.ends_so(state, number, requests, &comes, &endings, nexts);
            }
        }
    }

    /// What stands behind in a batch of which nothing is known, and was given up, had perhaps not begun.
    pub(super) fn behind_given_up(&self, state: &ProductState, nexts: &mut Nexts) {
        if !self.tells_all || self.worlds.top(state.world).is_none() {
            return;
        }
        for active in state.desk.under_way() {
            let mut behind: SmallVec<[usize; 1]> =
                active.given_up.iter().map(|given_up| given_up.place).filter(|place| *place > 0).collect();
            behind.sort_unstable();
            behind.dedup();
            for place in behind {
                let mut next = state.clone();
                self.cancel_behind(&mut next, active.number, place);
                nexts.all.push(Next::plain(Move::Answer, next, Failed::Nothing));
            }
        }
    }

    /// How a batch may end that a safe configuration has interrupted: it is taken back, as far as it was planned in the world
    /// from before.
    fn interrupted_ends(
        &mut self,
        state: &ProductState,
        number: u32,
        requests: &[Request],
        planned: WorldId,
        given_up: &[usize],
        nexts: &mut Nexts,
    ) {
        let concurrent = as_begun(&state.desk, state, number);
        let comes = self.worlds.comes(planned, &self.desks.asks_of(&state.desk, number), &concurrent);
        let parts = comes.group.places().enumerate();
        let given_up: SmallVec<[usize; 2]> =
            parts.filter(|(_, place)| given_up.contains(place)).map(|(part, _)| part).collect();
        // What was being undone stays; a configuration that is not applied is as if it had not been asked for.
        let undo = (0..comes.can_fail.len()).any(|part| comes.undoes(part, requests));
        let class = if undo { Failed::Undo } else { Failed::Nothing };
        let ways = match given_up.is_empty() {
            true => comes.interrupted.get_or_init(|| self.ways_interrupted(requests, &comes, &[])).clone(),
            false => self.ways_interrupted(requests, &comes, &given_up),
        };
        for InterruptedSo { broken, stay, given } in ways.iter() {
            if *broken {
                self.broke(state, number, requests, given.clone(), nexts);
                continue;
            }
            let stay = stay.iter().map(|place| requests[*place]);
            let went = self.worlds.stay(state.world, planned, stay, &[]);
            self.ended(state, number, &End { went: &went, given: given.clone(), class }, nexts);
        }
    }

    /// How a batch may end that a safe configuration has interrupted, of which these parts were given up: always the same where it
    /// comes to the same.
    fn ways_interrupted(
        &self,
        requests: &[Request],
        comes: &Comes,
        given_up: &[usize],
    ) -> KeptValue<Vec<InterruptedSo>> {
        let group = comes.group.group();
        let so = |endings: Endings| {
            let settled = settle(requests, &group, &endings, Stopped::Safe);
            let (broken, given) = (endings.contains(&Ending::Broken), self.desks.given(given(&settled)));
            InterruptedSo { broken, stay: settled.stay.iter().map(|(place, _)| *place).collect(), given }
        };
        let ways = endings(&comes.can_fail, Stopping::Safe(given_up), self.tells_all);
        self.worlds.interrupted.keep(ways.into_iter().map(so).collect())
    }

    /// How a safe configuration may end.
    pub(super) fn safe_ends(&mut self, state: &ProductState, at: usize, nexts: &mut Nexts) {
        let mut over = state.clone();
        let request = over.change(|seldom| seldom.safe.remove(at));
        let request = &request;
        if let Some(top) = self.worlds.top(state.world) {
            for verdict in [Verdict::Ok, Verdict::Broken] {
                let mut next = over.clone();
                next.world = self.worlds.answered(top, request, verdict);
                self.safe_told(next, request, verdict, Failed::Nothing, nexts);
            }
            return;
        }
        let concurrent = self.concurrent_work(state, None);
        let comes = self.worlds.safe(state.world, request, &concurrent.held);
        let from = nexts.all.len();
        if !comes.troubles.is_empty() && request.requester != Requester::Operator {
            nexts.troubles.push(Trouble::Refused(*request, comes.troubles.clone()));
        }
        // Where a piece of it cannot be planned, it is done as far as it goes, and all is known of that.
        let (verdict, class) = match comes.verdict {
            Verdict::Ok => (Verdict::Ok, Failed::Nothing),
            other => (other, Failed::Broken),
        };
        let mut next = over.clone();
        self.go(&mut next, &comes.done);
        self.applied(&mut next, request, verdict, &comes.done);
        self.safe_told(next, request, verdict, class, nexts);
        nexts.all[from..].iter_mut().for_each(|next| next.deep = (comes.done.deep, comes.done.left));
        // What is under way may have made or changed what it finds, and goes on while it is applied.
        let meets = || {
            let claim = self.worlds.claims.of([request]);
            let mut under_way = state.desk.under_way().iter();
            under_way.any(|active| self.worlds.claims.of(&active.batch.requests).meets(&claim))
        };
        if comes.may_fail || meets() {
            let top = Top { safe: true, actuator: self.worlds.has_actuator(state.world) };
            let mut next = over;
            next.world = self.worlds.topped(top, std::iter::once(request.ask));
            if !self.tells_all {
                next.waits_for_none();
            }
            self.safe_told(next, request, Verdict::Broken, Failed::Broken, nexts);
        }
    }

    fn safe_told(
        &mut self,
        next: ProductState,
        request: &Request,
        verdict: Verdict,
        failed: Failed,
        nexts: &mut Nexts,
    ) {
        let answers = Answers::from_iter([(*request, verdict)]);
        for next in self.lands(next) {
            self.tell(next, &answers, failed, nexts);
        }
    }

    /// The first request is answered so.
    fn first_ends<'e>(&self, went: &'e Went, verdict: Option<Verdict>) -> End<'e> {
        End { went, given: self.desks.given(SmallVec::from_iter([(0, verdict)])), class: Failed::Nothing }
    }
}
