//! Who waits for whom: batches that have come, in the order in which they begin (semantics: *Requests*).
//!
//! A batch begins when no earlier one, under way or waiting, claims anything of what it claims, and when the one before of
//! the same coordinator, or of the same connection of an operator, is over. Then it has all of that until its last request is answered. So no cycle of waits can
//! arise, and none starves.

use super::claims::{Claim, Claims, is_of_system};
use super::request::{Batch, LedDown, Request, Requester, Stillness, Why};
use super::{Reason, answer};
use crate::model::{Ask, ConfigId, Verdict};
use smallvec::SmallVec;
use std::collections::VecDeque;

/// A batch that has begun, by the number under which it is under way.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct ActiveBatch {
    /// The number: the smallest that was free.
    pub number: u32,
    /// Its requests that are not answered yet, arranged.
    pub batch: Batch,
    /// Undos that have given up requests of it, in the order in which they came.
    pub given_up: Vec<GivenUp>,
    /// While this is led down its undos take along what nobody asks for any more and is in their way, which they claim as well until it is over
    /// ([`Stack::taken_along`]).
    ///
    /// [`Stack::taken_along`]: super::Stack::taken_along
    pub along: Option<(LedDown, Claim)>,
}

impl ActiveBatch {
    /// What is led down while its undos take something along.
    pub fn led(&self) -> Option<LedDown> {
        self.along.as_ref().map(|(led, _)| *led)
    }
}

/// An undo that has given up a request of a batch under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct GivenUp {
    /// The place of that request in the batch.
    pub place: usize,
    /// The undo.
    pub undo: Request,
}

/// What goes with a request of a batch under way that is answered.
#[derive(Debug, Default)]
pub struct Gone {
    /// That was the last of the batch, and it is over.
    pub over: bool,
    /// Undos that had given it up, and how they are answered.
    pub undone: SmallVec<[(Request, Verdict); 1]>,
    /// Undos that came too late for that: they are the next to begin, before what came later, also of its own batch.
    pub late: SmallVec<[Request; 1]>,
}

/// What waits and what is under way.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Desk {
    waiting: VecDeque<Batch>,
    under_way: Vec<ActiveBatch>,
}

/// What comes of a batch that has just come, beside what waits.
#[derive(Debug, Default)]
pub struct Arrival {
    /// Answered at once.
    pub told: Vec<(Request, Verdict, answer::Reason)>,
    /// Requests for safe configurations: they wait for nothing.
    pub safe: Vec<Request>,
    /// Undos that give up what is under way, with its number.
    pub given_up: Vec<(u32, Request)>,
}

/// One thing that comes of it.
#[derive(Debug)]
pub enum Arrived {
    /// A request is answered.
    Told(Request, Verdict, answer::Reason),
    /// An undo gives up what is under way under that number.
    GivesUp(u32, Request),
    /// A safe configuration is asked for.
    Safe(Request),
}

impl Arrival {
    /// All of it, in the order in which it happens: what is given up is so before what is safe interrupts it.
    pub fn in_order(self) -> impl Iterator<Item = Arrived> {
        let told = self.told.into_iter().map(|(request, verdict, why)| Arrived::Told(request, verdict, why));
        let given_up = self.given_up.into_iter().map(|(number, undo)| Arrived::GivesUp(number, undo));
        told.chain(given_up).chain(self.safe.into_iter().map(Arrived::Safe))
    }
}

impl Desk {
    /// Batches that have not begun, the oldest first.
    pub fn waiting(&self) -> impl Iterator<Item = &Batch> {
        self.waiting.iter()
    }

    /// Batches that have begun.
    pub fn under_way(&self) -> &[ActiveBatch] {
        &self.under_way
    }

    /// How many requests have not begun.
    pub fn len(&self) -> usize {
        self.waiting.iter().map(|batch| batch.requests.len()).sum()
    }

    /// Whether nothing of that one waits or is under way.
    pub fn has_answered(&self, requester: Requester) -> bool {
        let of = |batch: &Batch| batch.requests.iter().any(|request| request.requester == requester);
        !self.waiting.iter().any(of) && !self.under_way.iter().any(|active| of(&active.batch))
    }

    /// Whether a coordinator has asked for something since it told that it is down, if it has: what waits came after that.
    pub fn asks_on(&self) -> bool {
        let asks = |r: &Request| r.why == Why::Asked && matches!(r.requester, Requester::Coordinator(_));
        self.waiting.iter().flat_map(|batch| &batch.requests).any(asks)
    }

    /// Whether nothing waits and nothing is under way.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.under_way.is_empty()
    }

    /// A batch comes, in the order it was raised. `safe` tells which configurations are safe ones.
    pub fn arrive(&mut self, batch: Batch, safe: impl Fn(ConfigId) -> bool, claims: &Claims) -> Arrival {
        let mut arrival = Arrival::default();
        let mut kept = Batch::default();
        for request in batch.requests {
            match request.ask {
                Ask::Apply(id) if safe(id) => arrival.safe.push(request),
                Ask::UndoOf(id) if request.why == Why::Asked => {
                    if let Some(overtaken) = self.overtake(&mut kept, id, &request) {
                        arrival.told.push((overtaken, Verdict::Cancelled, Reason::Overtaken));
                        arrival.told.push((request, Verdict::Undone, Reason::Overtaken));
                    } else if let Some(number) = self.given_up_by(id, &request, claims) {
                        arrival.given_up.push((number, request));
                    } else {
                        kept.requests.push(request);
                    }
                }
                _ => kept.requests.push(request),
            }
        }
        for safe in &arrival.safe {
            let Ask::Apply(id) = safe.ask else { continue };
            // What it takes the place of is not in force any more when that is to be undone: what comes now stays.
            let replaced = |request: &Request| {
                let own = request.requester == safe.requester && request.why == Why::Asked;
                own && matches!(request.ask, Ask::UndoOf(other) if claims.replaces(id, other))
            };
            for undo in kept.requests.iter().filter(|request| replaced(request)) {
                arrival.told.push((*undo, Verdict::Undone, Reason::SafeCame(id)));
            }
            kept.requests.retain(|request| !replaced(request));
            // What is behind in a batch under way was asked for before as well.
            let behind = self.under_way.iter_mut().flat_map(|active| &mut active.batch.requests);
            behind.filter(|r| concerns(id, r)).for_each(|request| request.still.come(Stillness::Overtaken(id)));
            kept.requests.iter_mut().for_each(|request| request.still.come(Stillness::WithSafe));
            for request in self.cancel_waiting(|request| concerns(id, request)) {
                let verdict = if request.ask.is_undo() { Verdict::UndoFailed } else { Verdict::Cancelled };
                arrival.told.push((request, verdict, Reason::SafeCame(id)));
            }
        }
        if !kept.requests.is_empty() {
            kept.arrange();
            self.waiting.push_back(kept);
        }
        arrival
    }

    /// The push that an undo takes back before it has begun.
    fn overtake(&mut self, kept: &mut Batch, id: ConfigId, undo: &Request) -> Option<Request> {
        let batches = std::iter::once(kept).chain(self.waiting.iter_mut().rev());
        for batch in batches {
            if let Some(at) = batch.requests.iter().rposition(|request| takes_back(undo, request, id)) {
                let overtaken = batch.requests.remove(at);
                self.waiting.retain(|batch| !batch.requests.is_empty());
                return Some(overtaken);
            }
        }
        None
    }

    /// What is under way and is given up by an undo, unless a request between them claims the same: then the undo waits its
    /// turn.
    fn given_up_by(&self, id: ConfigId, undo: &Request, claims: &Claims) -> Option<u32> {
        let active =
            self.under_way.iter().find(|active| active.batch.requests.iter().any(|r| takes_back(undo, r, id)))?;
        let claim = claims.of(&active.batch.requests);
        let between = self.waiting.iter().any(|batch| claims.of(&batch.requests).meets(&claim));
        (!between).then_some(active.number)
    }

    /// Takes out what waits and `out` says so of.
    pub fn cancel_waiting(&mut self, out: impl Fn(&Request) -> bool) -> Vec<Request> {
        let mut gone = Vec::new();
        for batch in &mut self.waiting {
            batch.requests.retain(|request| {
                let out = out(request);
                if out {
                    gone.push(*request);
                }
                !out
            });
        }
        self.waiting.retain(|batch| !batch.requests.is_empty());
        gone
    }

    /// The next batch that may begin; it is under way from now on. `along` says what one would take along, `safe` are the safe
    /// configurations that are being applied: what they would interrupt waits for them.
    pub fn begin_next(
        &mut self,
        claims: &Claims,
        along: impl Fn(&Batch) -> Option<(LedDown, Claim)>,
        safe: &[ConfigId],
    ) -> Option<&ActiveBatch> {
        let at = if self.under_way.is_empty() && safe.is_empty() {
            // Whatever else waits came later.
            (!self.waiting.is_empty()).then_some(0)
        } else {
            self.free(claims, &along, safe)
        }?;
        let batch = self.waiting.remove(at)?;
        let number = (0..).find(|n| self.under_way.iter().all(|active| active.number != *n))?;
        let along = along(&batch);
        self.under_way.push(ActiveBatch { number, batch, given_up: Vec::new(), along });
        self.under_way.last()
    }

    fn free(
        &self,
        claims: &Claims,
        along: impl Fn(&Batch) -> Option<(LedDown, Claim)>,
        safe: &[ConfigId],
    ) -> Option<usize> {
        let mut held = claims.of(self.under_way.iter().flat_map(|active| &active.batch.requests));
        self.under_way.iter().filter_map(|active| active.along.as_ref()).for_each(|(_, along)| held.join(along));
        let mut asking: Vec<Line> = self.under_way.iter().filter_map(|active| line(&active.batch)).collect();
        for (at, batch) in self.waiting.iter().enumerate() {
            let mut claim = claims.of(&batch.requests);
            if let Some((_, along)) = along(batch) {
                claim.join(&along);
            }
            let waits = || safe.iter().any(|safe| claims.interrupts(*safe, &batch.requests));
            if !claim.meets(&held) && line(batch).is_none_or(|by| !asking.contains(&by)) && !waits() {
                return Some(at);
            }
            held.join(&claim);
            asking.extend(line(batch));
        }
        None
    }

    /// A batch under way.
    pub fn active(&self, number: u32) -> Option<&ActiveBatch> {
        self.under_way.iter().find(|active| active.number == number)
    }

    /// An undo gives up what a batch under way asks; its place there. None: another undo of the same step has done so before.
    pub fn give_up(&mut self, number: u32, undo: Request) -> Option<usize> {
        let active = self.under_way.iter_mut().find(|active| active.number == number)?;
        let place = given_up_of(&undo, &active.batch.requests)?;
        active.given_up.push(GivenUp { place, undo });
        Some(place)
    }

    /// A batch that could begin has not done so after all: it is the first that waits, or the last, since it had just come.
    pub fn put_back(&mut self, number: u32, last: bool) {
        if let Some(at) = self.under_way.iter().position(|active| active.number == number) {
            let batch = self.under_way.remove(at).batch;
            self.waiting.insert(if last { self.waiting.len() } else { 0 }, batch);
        }
    }

    /// The first requests of a batch under way are these: what comes later does not change how they are carried out.
    pub fn begun_as(&mut self, number: u32, requests: &[Request]) {
        if let Some(active) = self.under_way.iter_mut().find(|active| active.number == number) {
            active.batch.requests.iter_mut().zip(requests).for_each(|(own, begun)| *own = *begun);
        }
    }

    /// Every request that is under way, has given something up or waits, in that order.
    pub fn requests_mut(&mut self) -> impl Iterator<Item = &mut Request> {
        let under_way = self.under_way.iter_mut().flat_map(|active| {
            active.batch.requests.iter_mut().chain(active.given_up.iter_mut().map(|given_up| &mut given_up.undo))
        });
        under_way.chain(self.waiting.iter_mut().flat_map(|batch| &mut batch.requests))
    }

    /// The same, as they are.
    pub fn requests(&self) -> impl Iterator<Item = &Request> {
        let under_way = self.under_way.iter().flat_map(|active| {
            active.batch.requests.iter().chain(active.given_up.iter().map(|given_up| &given_up.undo))
        });
        under_way.chain(self.waiting.iter().flat_map(|batch| &batch.requests))
    }

    /// The request at a place of a batch under way is answered so (none: nobody is told).
    pub fn answered(&mut self, number: u32, place: usize, verdict: Option<Verdict>) -> Gone {
        let mut gone = Gone { over: true, ..Gone::default() };
        let Some(at) = self.under_way.iter().position(|active| active.number == number) else { return gone };
        let active = &mut self.under_way[at];
        if place < active.batch.requests.len() {
            active.batch.requests.remove(place);
        }
        active.given_up.retain_mut(|given_up| {
            if given_up.place == place {
                match gave_up(verdict.unwrap_or(Verdict::Cancelled)) {
                    Some(answer) => gone.undone.push((given_up.undo, answer)),
                    None => gone.late.push(given_up.undo),
                }
                return false;
            }
            given_up.place -= usize::from(given_up.place > place);
            true
        });
        gone.over = active.batch.requests.is_empty();
        if gone.over {
            self.under_way.remove(at);
        }
        for undo in gone.late.iter().rev() {
            self.waiting.push_front(Batch::one(*undo));
        }
        gone
    }

    /// Several requests of a batch under way are answered, in the order of their places.
    pub fn all_answered(
        &mut self,
        number: u32,
        answers: impl DoubleEndedIterator<Item = (usize, Option<Verdict>)>,
    ) -> SmallVec<[Gone; 2]> {
        // From the last on, so that places stay.
        let mut gone: SmallVec<[Gone; 2]> =
            answers.rev().map(|(place, verdict)| self.answered(number, place, verdict)).collect();
        gone.reverse();
        gone
    }

    /// A batch under way is over, whatever of it was not answered.
    pub fn over(&mut self, number: u32) {
        self.under_way.retain(|active| active.number != number);
    }
}

/// Whose requests begin one after the other: a coordinator's, and those of one connection of an operator.
type Line = (Requester, u32);

fn line(batch: &Batch) -> Option<Line> {
    let first = batch.requests.first().map(|request| (request.requester, request.line));
    first.filter(|line| *line != (Requester::Operator, 0))
}

/// The request of a batch under way that `undo` gives up: the newest that it may take back.
pub fn given_up_of(undo: &Request, requests: &[Request]) -> Option<usize> {
    let Ask::UndoOf(id) = undo.ask else { return None };
    requests.iter().rposition(|request| takes_back(undo, request, id))
}

/// What an undo is answered that gave up a request which ended so. None: that was through before it could be given up, and
/// the undo is a request like others, the next to begin.
fn gave_up(verdict: Verdict) -> Option<Verdict> {
    match verdict {
        Verdict::Ok => None,
        Verdict::Broken => Some(Verdict::UndoBroken),
        _ => Some(Verdict::Undone),
    }
}

/// Whether `undo` (of `id`) takes back what `request` asks.
fn takes_back(undo: &Request, request: &Request, id: ConfigId) -> bool {
    request.ask == Ask::Apply(id)
        && request.requester == undo.requester
        // What a state brought with it is taken back by leaving that state.
        && (undo.scope.is_none() || undo.scope == request.scope)
}

/// Whether a request belongs to the (sub)system of a safe configuration.
fn concerns(safe: ConfigId, request: &Request) -> bool {
    match (request.why, request.ask) {
        (Why::Asked, Ask::Apply(id) | Ask::UndoOf(id)) => is_of_system(safe, id),
        (Why::Asked, _) => safe.prefix().is_empty(),
        _ => false,
    }
}
