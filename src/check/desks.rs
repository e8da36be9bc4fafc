//! Desks as states of the product have them, and what becomes of them.
//!
//! A hundred thousand states have some hundred desks: each is kept once, and what comes to it, begins in it or is answered is worked
//! out once for it, whatever the system is.

use super::kept::{KeptValue, KeptValues};
use super::shared_list::SharedList;
use crate::model::{ConfigId, Verdict};
use crate::stack::claims::Claims;
use crate::stack::{Arrival, Arrived, Batch, Desk, Gone, Request, Requester, given_up_of};
use crate::statechart::NodeId;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::cell::RefCell;
use std::hash::Hash;
use std::rc::Rc;

/// A desk that is kept.
pub type KeptDesk = KeptValue<Desk>;

/// Requests without what means nothing to what they come to.
pub type PlainBatch = KeptValue<SmallVec<[Request; 2]>>;

/// Requests of a batch that are answered: their places, and how; none: nobody is told.
pub type AnsweredPlaces = SmallVec<[(usize, Option<Verdict>); 2]>;

/// What a batch that comes does to a desk.
#[derive(Debug)]
pub struct Coming {
    /// The desk with it, nothing having begun.
    pub desk: KeptDesk,
    /// What comes of it, in order.
    pub arrived: Vec<Arrived>,
    /// Batches under way that it would stop, if they are not stopped.
    pub stops: SmallVec<[u32; 2]>,
    /// Batches under way of which it undoes something.
    pub about: SmallVec<[u32; 2]>,
    /// It overtakes or cancels something, or is about what is under way.
    pub meddles: bool,
}

/// What it comes to that requests of a batch under way are answered.
#[derive(Debug)]
pub struct AnsweredBatch {
    /// The answers as they are told, with those of undos that had given something of it up.
    pub answers: SharedList<(Request, Verdict)>,
    /// Those of these undos alone.
    pub undone: Box<[(Request, Verdict)]>,
    /// Undos among the requests that have failed.
    pub undo_failed: Box<[Request]>,
}

impl AnsweredBatch {
    fn of(requests: &[Request], given: &AnsweredPlaces, gone: &[Gone]) -> Self {
        let (mut answers, mut undo_failed) = (Vec::new(), Vec::new());
        for ((place, verdict), gone) in given.iter().zip(gone) {
            let Some(request) = requests.get(*place) else { continue };
            if *verdict == Some(Verdict::UndoFailed) {
                undo_failed.push(*request);
            }
            let Some(verdict) = *verdict else { continue };
            answers.push(request.as_told(verdict));
            answers.extend(gone.undone.iter().copied());
        }
        let undone = gone.iter().flat_map(|gone| gone.undone.iter().copied()).collect();
        Self { answers: answers.into_iter().collect(), undone, undo_failed: undo_failed.into() }
    }
}

/// What was worked out of one kind of change, with the desk that comes of it.
type Worked<K, R> = RefCell<FxHashMap<(KeptDesk, K), (KeptDesk, R)>>;

/// All desks that were met.
#[derive(Debug, Default)]
pub struct Desks {
    kept: KeptValues<Desk>,
    asks: KeptValues<SmallVec<[Request; 2]>>,
    of_batches: RefCell<FxHashMap<(KeptDesk, u32), PlainBatch>>,
    comings: RefCell<FxHashMap<Batch, FxHashMap<KeptDesk, Rc<Coming>>>>,
    begins: Worked<SmallVec<[ConfigId; 1]>, Option<u32>>,
    givens: KeptValues<AnsweredPlaces>,
    answered: Worked<(u32, KeptValue<AnsweredPlaces>), Rc<AnsweredBatch>>,
    given_up: Worked<(u32, Request), Option<usize>>,
    put_back: Worked<(u32, bool), ()>,
    begun_as: Worked<(KeptDesk, u32, usize), ()>,
    left: Worked<(Requester, u32), ()>,
}

/// Requests without what means nothing to what they come to.
pub fn plain(requests: &[Request]) -> SmallVec<[Request; 2]> {
    requests.iter().map(|request| Request { tag: (0, 0), ..*request }).collect()
}

/// Whether a request was made by one of these states: nobody hears its answer any more.
pub fn is_left(request: &Request, by: Requester, left: &[NodeId]) -> bool {
    let owner = request.tag.0.checked_sub(1);
    request.requester == by && left.iter().any(|node| Some(node.index() as u64) == owner)
}

impl Desks {
    /// The desk at which nothing is.
    pub fn empty(&self) -> KeptDesk {
        self.kept.keep(Desk::default())
    }

    /// Changes a desk in a way that depends on more than it.
    pub fn change<R>(&self, desk: &mut KeptDesk, with: impl FnOnce(&mut Desk) -> R) -> R {
        let mut changed = (**desk).clone();
        let answer = with(&mut changed);
        *desk = self.kept.keep(changed);
        answer
    }

    fn once<K: Eq + Hash + Clone, R: Clone>(
        &self,
        worked: &Worked<K, R>,
        desk: &mut KeptDesk,
        how: K,
        with: impl FnOnce(&mut Desk, K) -> R,
    ) -> R {
        let key = (desk.clone(), how);
        if let Some((after, answer)) = worked.borrow().get(&key) {
            *desk = after.clone();
            return answer.clone();
        }
        let answer = self.change(desk, |desk| with(desk, key.1.clone()));
        worked.borrow_mut().insert(key, (desk.clone(), answer.clone()));
        answer
    }

    /// These requests, as what they come to is asked for.
    pub fn asks(&self, requests: &[Request]) -> PlainBatch {
        self.asks.keep(plain(requests))
    }

    /// The requests of a batch under way.
    pub fn asks_of(&self, desk: &KeptDesk, number: u32) -> PlainBatch {
        let key = (desk.clone(), number);
        if let Some(known) = self.of_batches.borrow().get(&key) {
            return known.clone();
        }
        let asks = self.asks(desk.active(number).map_or(&[], |active| &active.batch.requests));
        self.of_batches.borrow_mut().insert(key, asks.clone());
        asks
    }

    /// A batch comes. `safe` tells which configurations are safe ones; always the same.
    pub fn coming(
        &self,
        desk: &KeptDesk,
        batch: &Batch,
        safe: impl Fn(ConfigId) -> bool,
        claims: &Claims,
    ) -> Rc<Coming> {
        let known = self.comings.borrow().get(batch).and_then(|of| of.get(desk)).cloned();
        known.unwrap_or_else(|| {
            let coming = Rc::new(self.work_out(desk, batch, safe, claims));
            let mut comings = self.comings.borrow_mut();
            comings.entry(batch.clone()).or_default().insert(desk.clone(), coming.clone());
            coming
        })
    }

    fn work_out(&self, desk: &KeptDesk, batch: &Batch, safe: impl Fn(ConfigId) -> bool, claims: &Claims) -> Coming {
        let mut after = desk.clone();
        let arrival = self.change(&mut after, |desk| desk.arrive(batch.clone(), safe, claims));
        let Arrival { told, safe, given_up } = &arrival;
        let mut stops: SmallVec<[u32; 2]> = given_up.iter().map(|(number, _)| *number).collect();
        if !safe.is_empty() {
            stops.extend(desk.under_way().iter().map(|active| active.number));
        }
        stops.sort_unstable();
        stops.dedup();
        // Also what waits its turn behind others: by then these may be over.
        let of = desk
            .under_way()
            .iter()
            .filter(|active| batch.requests.iter().any(|undo| given_up_of(undo, &active.batch.requests).is_some()));
        let about: SmallVec<[u32; 2]> = of.map(|active| active.number).collect();
        // What it answers by itself comes to the same whenever it comes. Who stands in the queue as down may be taken up before a safe
        // configuration makes everything wait.
        let meddles = !told.is_empty() && !desk.is_empty()
            || !about.is_empty()
            || !safe.is_empty() && desk.waiting().any(Batch::is_down);
        Coming { desk: after, arrived: arrival.in_order().collect(), stops, about, meddles }
    }

    /// The next batch that may begin does while these safe configurations are being applied: its number. None takes anything along.
    pub fn begin_next(&self, desk: &mut KeptDesk, safe: SmallVec<[ConfigId; 1]>, claims: &Claims) -> Option<u32> {
        self.once(&self.begins, desk, safe, |desk, safe| {
            desk.begin_next(claims, |_| None, &safe).map(|active| active.number)
        })
    }

    /// Answers, known by a number.
    pub fn given(&self, given: AnsweredPlaces) -> KeptValue<AnsweredPlaces> {
        self.givens.keep(given)
    }

    /// [`Desk::all_answered`].
    pub fn all_answered(
        &self,
        desk: &mut KeptDesk,
        number: u32,
        given: &KeptValue<AnsweredPlaces>,
    ) -> Rc<AnsweredBatch> {
        self.once(&self.answered, desk, (number, given.clone()), |desk, (number, given)| {
            let requests = desk.active(number).map(|active| active.batch.requests.clone()).unwrap_or_default();
            let gone = desk.all_answered(number, given.iter().copied());
            Rc::new(AnsweredBatch::of(&requests, &given, &gone))
        })
    }

    /// [`Desk::give_up`].
    pub fn give_up(&self, desk: &mut KeptDesk, number: u32, undo: Request) -> Option<usize> {
        self.once(&self.given_up, desk, (number, undo), |desk, (number, undo)| desk.give_up(number, undo))
    }

    /// [`Desk::put_back`].
    pub fn put_back(&self, desk: &mut KeptDesk, number: u32, last: bool) {
        self.once(&self.put_back, desk, (number, last), |desk, (number, last)| desk.put_back(number, last));
    }

    /// So many of the first requests of a batch under way stay as they were `before`.
    pub fn begun_as(&self, desk: &mut KeptDesk, before: &KeptDesk, number: u32, takes: usize) {
        self.once(&self.begun_as, desk, (before.clone(), number, takes), |desk, (before, number, takes)| {
            let requests = before.active(number).map_or(&[][..], |active| &active.batch.requests);
            desk.begun_as(number, &requests[..takes.min(requests.len())]);
        });
    }

    /// Nobody hears the answers any more whose state has been left by this requester.
    /// `macrostep` is the number of the step in which it has left them: always the same ones.
    pub fn leave(&self, desk: &mut KeptDesk, by: Requester, left: &[NodeId], macrostep: &u32) {
        self.once(&self.left, desk, (by, *macrostep), |desk, (by, _)| {
            let gone = desk.requests_mut().filter(|request| is_left(request, by, left));
            gone.for_each(|request| request.tag = (0, 0));
        });
    }
}
