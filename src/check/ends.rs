//! How what is under way may end.

use super::product::Product;
use super::state::{Answers, Failed, Move, Next, Nexts, State, Stop, Trouble, Unconfirmed};
use super::world::{Beside, Comes, Top, Went, WorldId};
use crate::model::{Ask, Verdict};
use crate::stack::{Request, Requester, Why, gave_up, given_up_of};
use smallvec::SmallVec;

/// A request as it is answered: what takes back what was not confirmed tells of that.
fn as_told(request: Request, verdict: Verdict) -> (Request, Verdict) {
    match (request.why, verdict, request.ask) {
        (Why::Unconfirmed(..), Verdict::Undone, Ask::UndoOf(id)) => {
            (Request { ask: Ask::Apply(id), why: Why::Asked, ..request }, Verdict::Reverted)
        }
        (Why::Unconfirmed(..), ..) => (Request { why: Why::Asked, ..request }, verdict),
        _ => (request, verdict),
    }
}

/// Requests of a batch that are answered: place and verdict; none: nobody is told.
type Given = SmallVec<[(usize, Option<Verdict>); 2]>;

impl Product<'_> {
    fn requests(state: &State, number: u32) -> SmallVec<[Request; 2]> {
        let turn = state.desk.under_way().iter().find(|turn| turn.number == number);
        turn.map(|turn| turn.batch.requests.clone()).unwrap_or_default()
    }

    /// How a batch under way may end, or its first requests.
    pub(super) fn ends(&mut self, state: &State, number: u32, nexts: &mut Nexts) {
        let requests = Self::requests(state, number);
        if let Some(top) = self.worlds.top(state.world) {
            return self.ends_somehow(state, number, top, &requests, nexts);
        }
        let comes = self.comes(state, number, &requests);
        for (place, reasons) in &comes.refused {
            if requests[*place].requester != Requester::Operator {
                nexts.troubles.push(Trouble::Refused(requests[*place], reasons.clone()));
            }
        }
        let from = nexts.all.len();
        let done = Self::done_before(&requests, &comes, comes.parts.len(), comes.takes);
        self.ended(state, number, &requests, done, &comes.done, Failed::Nothing, nexts);
        let deep = (comes.done.deep, comes.done.left);
        nexts.all[from..].iter_mut().for_each(|next| next.deep = deep);
        for (k, part) in comes.parts.iter().enumerate() {
            if part.failed.is_some() {
                let ask = requests[part.place].ask;
                self.fails(state, number, &requests, &comes, k, nexts);
                self.missing(state, number, &requests, &comes, k, &[ask.failed(), ask.broken()], nexts);
            }
        }
    }

    /// A part fails, or is left broken; those before it are done.
    fn fails(&mut self, state: &State, number: u32, requests: &[Request], comes: &Comes, k: usize, nexts: &mut Nexts) {
        let part = &comes.parts[k];
        let Some(went) = &part.failed else { return };
        let ask = requests[part.place].ask;
        let mut failed = Self::done_before(requests, comes, k, part.place);
        let mut broken = failed.clone();
        failed.push((part.place, Some(ask.failed())));
        let class = if part.undo { Failed::Undo } else { Failed::Apply };
        self.ended(state, number, requests, failed, went, class, nexts);
        broken.push((part.place, Some(ask.broken())));
        self.broke(state, number, requests, broken, nexts);
    }

    /// What stands before a part that ends so was to stand, and cannot be finished: it is broken too.
    #[allow(clippy::too_many_arguments)]
    fn missing(
        &mut self,
        state: &State,
        number: u32,
        requests: &[Request],
        comes: &Comes,
        k: usize,
        verdicts: &[Verdict],
        nexts: &mut Nexts,
    ) {
        // Nothing is known after either; only whoever compares answers minds which ones it were.
        for some in 1..1u32 << if self.tells_all { k.min(4) } else { 0 } {
            let is_broken = |part: usize| some & (1 << part) != 0;
            let first = comes.parts[some.trailing_zeros() as usize].place;
            let mut given: Given = comes.told.iter().copied().filter(|(told, _)| *told < first).collect();
            for (at, part) in comes.parts[..k].iter().enumerate() {
                let ask = requests[part.place].ask;
                given.push((part.place, Some(if is_broken(at) { ask.broken() } else { ask.done() })));
            }
            for verdict in verdicts {
                let mut given = given.clone();
                given.push((comes.parts[k].place, Some(*verdict)));
                given.sort_by_key(|(place, _)| *place);
                self.broke(state, number, requests, given, nexts);
            }
        }
    }

    /// The answers when the first `parts` are done: theirs, and what is told before `place`.
    fn done_before(requests: &[Request], comes: &Comes, parts: usize, place: usize) -> Given {
        let done = comes.parts[..parts].iter().map(|part| (part.place, Some(requests[part.place].ask.done())));
        let told = comes.told.iter().copied().filter(|(told, _)| *told < place);
        let mut given: Given = done.chain(told).collect();
        given.sort_by_key(|(place, _)| *place);
        given
    }

    /// Nothing is known: each request may end in any way, one after the other.
    fn ends_somehow(&mut self, state: &State, number: u32, top: Top, requests: &[Request], nexts: &mut Nexts) {
        let ask = requests[0].ask;
        for verdict in [ask.done(), ask.failed(), ask.broken()] {
            let went = Went::to(self.worlds.answered(top, &requests[0], verdict));
            let given = Given::from_iter([(0, Some(verdict))]);
            self.ended(state, number, requests, given, &went, Failed::Nothing, nexts);
        }
        if matches!(requests[0].why, Why::Unconfirmed(..)) {
            // Nobody is told where the frame is gone.
            self.ended(
                state,
                number,
                requests,
                Given::from_iter([(0, None)]),
                &Went::to(state.world),
                Failed::Nothing,
                nexts,
            );
        }
    }

    /// Something of a batch under way is left in between.
    fn broke(&mut self, state: &State, number: u32, requests: &[Request], given: Given, nexts: &mut Nexts) {
        let world = self.worlds.broken(state.world, requests.iter().map(|request| request.ask));
        let mut state = state.clone();
        if !self.tells_all {
            state.unconfirmed.clear();
        }
        self.ended(&state, number, requests, given, &Went::to(world), Failed::Broken, nexts);
    }

    /// These requests of a batch under way are answered, and the world has become another one.
    #[allow(clippy::too_many_arguments)]
    fn ended(
        &mut self,
        state: &State,
        number: u32,
        requests: &[Request],
        given: Given,
        went: &Went,
        failed: Failed,
        nexts: &mut Nexts,
    ) {
        let mut next = state.clone();
        self.go(&mut next, went);
        let mut given_up: SmallVec<[Request; 1]> = SmallVec::new();
        next.stopped.retain(|(of, stop)| {
            let over = *of == number;
            if let (true, Stop::GivenUp(undo)) = (over, &*stop) {
                given_up.push(*undo);
            }
            !over
        });
        next.joined.retain(|of| *of != number);
        next.placed.retain(|of| *of != number);
        // From the last on, so that places stay.
        for (place, _) in given.iter().rev() {
            next.desk.answered(number, *place);
        }
        let mut answers = Answers::new();
        let mut late: SmallVec<[Request; 1]> = SmallVec::new();
        for (place, verdict) in &given {
            let (request, Some(verdict)) = (requests[*place], *verdict) else { continue };
            self.applied(&mut next, &request, verdict, went);
            answers.push(as_told(request, verdict));
            let fits = |undo: &Request| given_up_of(undo, requests) == Some(*place);
            // It may have been given up more than once.
            while let Some(at) = given_up.iter().position(fits) {
                let undo = given_up.remove(at);
                match gave_up(verdict) {
                    None => late.push(undo),
                    Some(answer) => answers.push((undo, answer)),
                }
            }
        }
        // What was given up together with one before it is not taken up anew.
        let left = Self::requests(&next, number);
        if !left.is_empty() {
            // In the order of the batch.
            given_up.sort_by_key(|undo| given_up_of(undo, &left));
            let known = !self.tells_all || self.worlds.top(next.world).is_none();
            for undo in given_up {
                match known || given_up_of(&undo, &left).is_none() {
                    true => self.give_up_behind(&mut next, number, undo),
                    // It may have begun with those that are over now.
                    false => next.stopped.push((number, Stop::GivenUp(undo))),
                }
            }
            // The rest of it begins before whatever waits.
            self.takes_place(&mut next, number);
        }
        for undo in late.into_iter().rev() {
            next.desk.comes_next(undo);
        }
        for next in self.lands(next) {
            self.tell(next, answers.clone(), failed, nexts);
        }
    }

    /// What a request that was carried out leaves to be waited for.
    fn applied(&self, state: &mut State, request: &Request, verdict: Verdict, went: &Went) {
        let (Ask::Apply(id), Verdict::Ok) = (request.ask, verdict) else { return };
        state.lost.retain(|lost| *lost != id);
        let waits = self.worlds.configuration(id).is_some_and(|c| c.confirm.is_some());
        // One batch may push several of them.
        let free = |place: u8| state.unconfirmed.iter().all(|waits| waits.place != place);
        let mut pushed = went.pushed.iter().filter(|(of, place)| *of == id && free(*place));
        let unknown = (self.tells_all && self.worlds.top(state.world).is_some()).then_some(u8::MAX);
        if let (true, Some(place)) = (waits, pushed.next().map(|(_, place)| *place).or(unknown)) {
            state.unconfirmed.push(Unconfirmed { place, request: Request { why: Why::Asked, ..*request } });
        }
    }

    /// How a batch under way that was stopped may end.
    pub(super) fn stopped_ends(&mut self, state: &State, number: u32, nexts: &mut Nexts) {
        let requests = Self::requests(state, number);
        if requests.is_empty() {
            return;
        }
        // In the order in which they came.
        let mut given_up: SmallVec<[usize; 1]> = SmallVec::new();
        let mut late: SmallVec<[usize; 1]> = SmallVec::new();
        let mut interrupted = None;
        for (_, stop) in state.stopped.iter().filter(|(of, _)| *of == number) {
            match stop {
                Stop::GivenUp(undo) if interrupted.is_none() => given_up.extend(given_up_of(undo, &requests)),
                Stop::GivenUp(undo) => late.extend(given_up_of(undo, &requests)),
                Stop::Interrupted(planned) => interrupted = Some(*planned),
            }
        }
        // What came at the same moment may have been told first; and what came when it was on its way back, too late.
        let some = if self.tells_all { 0 } else { given_up.len() };
        given_up.append(&mut late);
        if let Some(planned) = interrupted.filter(|planned| self.worlds.top(*planned).is_none()) {
            for count in some..=given_up.len() {
                self.interrupted_ends(state, number, &requests, planned, &given_up[..count], nexts);
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
                let given = Given::from_iter([(0, Some(verdict))]);
                self.ended(state, number, &requests, given, &went, Failed::Nothing, nexts);
            }
            return;
        }
        let comes = self.comes(state, number, &requests);
        let first = |given_up: &[usize]| comes.parts.iter().position(|part| given_up.contains(&part.place));
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
            self.given_up_ends(state, number, &requests, &comes, k, nexts);
        }
    }

    /// What stands behind in a batch of which nothing is known, and was given up, had perhaps not begun.
    pub(super) fn behind_given_up(&self, state: &State, nexts: &mut Nexts) {
        if !self.tells_all || self.worlds.top(state.world).is_none() {
            return;
        }
        for (at, (number, stop)) in state.stopped.iter().enumerate() {
            let Stop::GivenUp(undo) = stop else { continue };
            if given_up_of(undo, &Self::requests(state, *number)).is_none_or(|place| place > 0) {
                let mut next = state.clone();
                next.stopped.remove(at);
                self.give_up_behind(&mut next, *number, *undo);
                nexts.all.push(Next::plain(Move::Answer, next, Failed::Nothing));
            }
        }
    }

    /// How a batch under way may end of which that part was given up.
    fn given_up_ends(
        &mut self,
        state: &State,
        number: u32,
        requests: &[Request],
        comes: &Comes,
        k: usize,
        nexts: &mut Nexts,
    ) {
        // One before it may fail meanwhile.
        for before in 0..if self.tells_all { 0 } else { k } {
            self.fails(state, number, requests, comes, before, nexts);
        }
        let part = &comes.parts[k];
        let mut cancelled = Self::done_before(requests, comes, k, part.place);
        let mut broken = cancelled.clone();
        cancelled.push((part.place, Some(Verdict::Cancelled)));
        self.ended(state, number, requests, cancelled, &part.before, Failed::Nothing, nexts);
        // The last of it may have been done when that came.
        let done = Self::done_before(requests, comes, comes.parts.len(), comes.takes);
        self.ended(state, number, requests, done, &comes.done, Failed::Nothing, nexts);
        if part.failed.is_some() {
            broken.push((part.place, Some(Verdict::Broken)));
            self.broke(state, number, requests, broken, nexts);
        }
        self.missing(state, number, requests, comes, k, &[Verdict::Cancelled, Verdict::Broken], nexts);
    }

    /// How a batch may end that a safe configuration has interrupted: it is taken back, as far as it was planned in the world
    /// from before.
    fn interrupted_ends(
        &mut self,
        state: &State,
        number: u32,
        requests: &[Request],
        planned: WorldId,
        given_up: &[usize],
        nexts: &mut Nexts,
    ) {
        let beside = Beside { joined: state.joined.contains(&number), ..Beside::default() };
        let comes = self.worlds.comes(planned, requests, &beside);
        let end =
            |place: usize| if given_up.contains(&place) { Verdict::Cancelled } else { requests[place].ask.failed() };
        // What was decided of those behind took the first for done.
        let first = comes.parts.first().map_or(usize::MAX, |part| part.place);
        let told = |(place, verdict): (usize, Option<Verdict>)| {
            (place, verdict.map(|verdict| if place < first { verdict } else { requests[place].ask.failed() }))
        };
        let mut given: Given = comes.told.iter().copied().map(told).collect();
        given.extend(comes.parts.iter().map(|part| (part.place, Some(end(part.place)))));
        given.sort_by_key(|(place, _)| *place);
        // What was being undone stays; a configuration that is not applied is as if it had not been asked for.
        let undo = comes.parts.iter().any(|part| part.undo);
        let class = if undo { Failed::Undo } else { Failed::Nothing };
        let undone = comes.parts.iter().filter(|part| part.undo).map(|part| part.place);
        let refused =
            given.iter().filter(|(_, verdict)| *verdict == Some(Verdict::UndoFailed)).map(|(place, _)| *place);
        let mut undone: SmallVec<[usize; 2]> = undone.chain(refused).collect();
        undone.sort_unstable();
        undone.dedup();
        let undone = undone.into_iter().map(|place| requests[place]);
        let world = self.worlds.stay(state.world, planned, undone, &[]);
        self.ended(state, number, requests, given.clone(), &world, class, nexts);
        let can: SmallVec<[usize; 2]> =
            comes.parts.iter().filter(|part| part.failed.is_some()).map(|part| part.place).collect();
        // Of each part something may be left; only whoever compares answers minds of which.
        let all = if self.tells_all { (1u32 << can.len().min(5)) - 1 } else { u32::from(!can.is_empty()) };
        for some in 1..=all {
            let left = |place: usize| can.iter().position(|of| *of == place).is_some_and(|at| some & (1 << at) != 0);
            let broken = |(place, verdict): (usize, Option<Verdict>)| {
                (place, if left(place) { Some(requests[place].ask.broken()) } else { verdict })
            };
            self.broke(state, number, requests, given.iter().copied().map(broken).collect(), nexts);
        }
    }

    /// How a safe configuration may end.
    pub(super) fn safe_ends(&mut self, state: &State, at: usize, nexts: &mut Nexts) {
        let mut over = state.clone();
        let request = &over.safe.remove(at);
        if let Some(top) = self.worlds.top(state.world) {
            for verdict in [Verdict::Ok, Verdict::Broken] {
                let mut next = over.clone();
                next.world = self.worlds.answered(top, request, verdict);
                self.safe_told(next, request, verdict, Failed::Nothing, nexts);
            }
            return;
        }
        let beside = self.beside(state, None);
        let comes = self.worlds.safe(state.world, request, &beside.held);
        let from = nexts.all.len();
        if !comes.troubles.is_empty() && request.requester != Requester::Operator {
            nexts.troubles.push(Trouble::Refused(*request, comes.troubles.clone()));
        }
        // Where a piece of it cannot be planned, it is done as far as it goes, and all is known of that.
        let (verdict, class) = match comes.troubles.is_empty() {
            true => (Verdict::Ok, Failed::Nothing),
            false => (Verdict::Broken, Failed::Broken),
        };
        let mut next = over.clone();
        self.go(&mut next, &comes.done);
        self.applied(&mut next, request, verdict, &comes.done);
        self.safe_told(next, request, verdict, class, nexts);
        nexts.all[from..].iter_mut().for_each(|next| next.deep = (comes.done.deep, comes.done.left));
        // What is under way may have made or changed what it finds, and goes on while it is applied.
        let claim = self.worlds.claims.of([request]);
        let meets = state.desk.under_way().iter().any(|turn| self.worlds.claims.of(&turn.batch.requests).meets(&claim));
        if comes.may_fail || meets {
            let top = Top { safe: true, actuator: self.worlds.has_actuator(state.world) };
            let mut next = over;
            next.world = self.worlds.topped(top, std::iter::once(request.ask));
            if !self.tells_all {
                next.unconfirmed.clear();
            }
            self.safe_told(next, request, Verdict::Broken, Failed::Broken, nexts);
        }
    }

    fn safe_told(&mut self, next: State, request: &Request, verdict: Verdict, failed: Failed, nexts: &mut Nexts) {
        for next in self.lands(next) {
            self.tell(next, Answers::from_iter([(*request, verdict)]), failed, nexts);
        }
    }
}

impl Went {
    /// To a world of which no frames are known.
    pub(super) fn to(world: super::world::WorldId) -> Self {
        Self { world, places: None, pushed: SmallVec::new(), deep: None, left: None }
    }
}
