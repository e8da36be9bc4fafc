//! Which moves of a way a script can bring about, as far as each of them tells by itself: one thing happens at a time, and what
//! comes by itself comes as soon as it can.

use super::outcome::ConcurrentWork;
use super::product::Product;
use super::state::{Move, Next, ProductState};
use crate::limits;
use crate::model::Verdict;
use crate::stack::ActiveBatch;
use crate::stack::{Request, Why};
use smallvec::SmallVec;

/// What a state lets a script bring about next.
pub struct Shows {
    /// Nothing: something is on its way that a script cannot hold up.
    nothing: bool,
    /// Only what takes no time: what is under way has nothing to do.
    at_once: bool,
    /// Only answers: what was interrupted, or given up, goes back.
    answers: bool,
    /// Nothing is known any more, and what is answered is up to the platform.
    unknown: bool,
    /// Somebody has not heard yet what came before.
    unhandled: bool,
    /// The numbers of batches under way that have nothing to do.
    idle: SmallVec<[u32; 2]>,
}

/// What has nothing to do is answered at once.
pub(super) const AT_ONCE: &str = "what has nothing to do is answered at once";

impl Product<'_> {
    /// What a state lets a script bring about next.
    pub fn shows(&mut self, state: &ProductState) -> Shows {
        let mut idle: SmallVec<[u32; 2]> = SmallVec::new();
        let unknown = self.worlds.top(state.world).is_some();
        if state.safe.is_empty() && !unknown {
            let numbers: SmallVec<[u32; 4]> = state.desk.under_way().iter().map(|active| active.number).collect();
            for number in numbers.into_iter().filter(|number| !state.is_stopped(*number)) {
                if !self.comes(state, number).can_fail.contains(&true) {
                    idle.push(number);
                }
            }
        }
        let waits = state.desk.waiting().next().is_some();
        Shows {
            nothing: !state.in_transit.is_empty() || waits && too_late(state),
            at_once: !idle.is_empty(),
            answers: state.safe.is_empty() && goes_back(state),
            unknown,
            unhandled: self.is_told_between(state),
            idle,
        }
    }
}

impl Product<'_> {
    /// Whether what is asked for, again and again, has nothing to do, so that no time ever passes from there on.
    pub(super) fn never_rests(&mut self, state: &ProductState) -> bool {
        let mut seen: Vec<ProductState> = Vec::new();
        let mut at = state.clone();
        while seen.len() <= limits::CHECK_CYCLE {
            if seen.contains(&at) {
                return true;
            }
            let shows = self.shows(&at);
            seen.push(at.clone());
            let idle = |next: &Next| next.by == Move::Answer && shows.answers_idle(&at, next);
            let Some(next) = self.goes_on(&at).all.into_iter().find(idle) else { return false };
            at = next.state;
        }
        true
    }
}

impl Shows {
    /// Whether something under way has nothing to do.
    pub(super) fn is_at_once(&self) -> bool {
        self.at_once
    }

    /// Whether a move answers only what has nothing to do.
    fn answers_idle(&self, before: &ProductState, next: &Next) -> bool {
        let idle = |(request, _): &(Request, Verdict)| {
            let active_batches = before.desk.under_way().iter();
            let mut own = active_batches.filter(|active| active.batch.requests.contains(request));
            !before.safe.contains(request) && own.all(|active| self.idle.contains(&active.number))
        };
        next.answers.iter().all(idle)
    }

    /// Whether a script can bring this about.
    pub fn shows(&self, product: &Product<'_>, before: &ProductState, next: &Next) -> bool {
        if self.nothing || !next.state.in_transit.is_empty() {
            return false;
        }
        // Most states have nothing under way.
        let goes_on = !before.desk.under_way().is_empty() || !before.safe.is_empty();
        let races = || goes_on && races(before, next);
        match next.by {
            // How much has come is seen by nobody: in a script all has.
            Move::Taken(number, event) => product.takes_in_order(before, &next.state, usize::from(number), event),
            Move::Answer => {
                let own_time = (self.unhandled || self.at_once) && !self.answers_idle(before, next);
                // What is taken back unconfirmed may have to wait for what is under way.
                let waits =
                    next.answers.iter().any(|(_, verdict)| *verdict == Verdict::Reverted) && !before.desk.is_empty();
                // What is told behind an event that is held up would be heard before it.
                let inbox = &next.state.inbox;
                let behind = inbox.iter().enumerate().any(|(at, (to, _))| inbox[..at].iter().any(|(own, _)| own == to));
                !self.unknown && !own_time && !waits && !behind && !races()
            }
            Move::Lost(id) if product.loss(before, id).is_none() => false,
            // When that comes is up to others.
            Move::Elsewhere(_) => false,
            _ => !self.at_once && !self.answers && !self.unhandled && !races(),
        }
    }
}

/// The requests of each batch under way, and each safe configuration that is being applied.
pub(super) fn under_way(state: &ProductState) -> impl Iterator<Item = &[Request]> {
    let batches = state.desk.under_way().iter().map(|active| &active.batch.requests[..]);
    batches.chain(state.safe.iter().map(std::slice::from_ref))
}

/// How a batch goes that a state has under way, and whether it takes along what stands in its way.
pub(super) fn goes(state: &ProductState, requests: &[Request]) -> ConcurrentWork {
    let one =
        |of: &Request| requests.iter().any(|request| same(std::slice::from_ref(of), std::slice::from_ref(request)));
    let active = state.desk.under_way().iter().find(|active| active.batch.requests.iter().any(one));
    ConcurrentWork { led: active.and_then(ActiveBatch::led), ..ConcurrentWork::default() }
}

/// Whether something is under way that was interrupted, or given up.
pub(super) fn goes_back(state: &ProductState) -> bool {
    !state.interrupted.is_empty() || state.undos().next().is_some()
}

/// Whether an undo came too late to give up what is still under way: it waits for it.
pub(super) fn too_late(state: &ProductState) -> bool {
    let waits = |undo: &Request| under_way(state).any(|batch| crate::stack::given_up_of(undo, batch).is_some());
    state.desk.waiting().flat_map(|batch| &batch.requests).any(waits)
}

/// Whether what is stopped is through all the same, or what was under way turns out not to have begun.
pub(super) fn races(before: &ProductState, next: &Next) -> bool {
    let through = |(request, verdict): &(Request, Verdict)| {
        let of = before.desk.under_way().iter().find(|active| active.batch.requests.contains(request));
        verdict.is_success() && of.is_some_and(|active| before.is_stopped(active.number))
    };
    let back = |requests: &[Request]| {
        let waits = next.state.desk.waiting().any(|batch| same(&batch.requests, requests));
        waits && !under_way(&next.state).any(|other| same(other, requests))
    };
    // Or only some of it had begun: what is left of it begins anew.
    let shrinks = |requests: &[Request]| {
        let within = |other: &[Request]| {
            let known = |r: &Request| requests.iter().any(|of| (of.ask, of.requester) == (r.ask, r.requester));
            other.len() < requests.len() && other.iter().all(known)
        };
        next.answers.is_empty() && under_way(&next.state).any(within)
    };
    // Or nothing of it had, and what came has cancelled it.
    let cancelled = |requests: &[Request]| {
        let of = |r: &Request| requests.iter().any(|of| (of.ask, of.requester) == (r.ask, r.requester));
        let goes_on = under_way(&next.state).flatten().any(of);
        !goes_on && !next.answers.iter().any(|(request, _)| of(request)) && requests[0].why == Why::Asked
    };
    let stops = |requests: &[Request]| back(requests) || shrinks(requests) || cancelled(requests);
    next.answers.iter().any(through) || under_way(before).any(stops)
}

/// Whether a move answers all of a batch. An answer on its way is of something that has not begun, whoever asks for the same.
pub(super) fn answered(before: &ProductState, next: &Next, batch: &[Request]) -> bool {
    if before.due.first().is_some_and(|due| next.answers[..] == [*due]) {
        return false;
    }
    let is = |request: &Request| {
        next.answers.iter().any(|(other, _)| (other.ask, other.requester) == (request.ask, request.requester))
    };
    batch.iter().all(is)
}

/// Whether two lists ask for the same.
pub(super) fn same(a: &[Request], b: &[Request]) -> bool {
    let what = |request: &Request| (request.ask, request.requester);
    a.iter().map(what).eq(b.iter().map(what))
}
