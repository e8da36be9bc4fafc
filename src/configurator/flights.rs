//! Calls that are out: handed to workers, awaited, and given up when they do not come back.

use super::engine::Engine;
use super::exec::Run;
use super::pool::{Call, Reply, Ticket};
use super::progress::{StepEnd, StepName};
use super::work::Item;
use crate::limits;
use crate::model::ComponentName;
use crate::platform::{Cause, Ended, Execution, Outcome};
use crate::time::Time;
use rustc_hash::FxHashSet;
use smallvec::{SmallVec, smallvec};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A call that is out: one blocking step, or several brief ones.
pub(super) struct Flight {
    ticket: Ticket,
    items: SmallVec<[u32; 1]>,
    started: Time,
    deadline: Time,
    /// Set: no further one of several is to be begun.
    stop: Arc<AtomicBool>,
}

impl Engine {
    /// Hands items to a worker: one of any kind, or several brief ones. Their preconditions hold.
    pub(super) fn launch(&mut self, work: &[Item], items: SmallVec<[u32; 1]>, run: &mut Run) {
        let started = self.clock.now();
        let stop = Arc::<AtomicBool>::default();
        let step = |i: &u32| &work[*i as usize].step;
        items.iter().for_each(|i| self.tell_started(step(i)));
        let (call, deadline) = match *items {
            [i] => (Call::Execute(step(&i).clone()), started + self.patience),
            // The last of them begins within the turn.
            _ => {
                let steps = items.iter().map(|i| step(i).clone()).collect();
                (Call::Several(steps, self.patience, stop.clone()), started + limits::BRIEF_TURN + self.patience)
            }
        };
        let deadline = deadline.min(run.until);
        let ticket = self.pool.start(call, deadline);
        run.flights.push(Flight { ticket, items, started, deadline, stop });
    }

    /// Carries out the brief steps from `work[from]` on, as many as go in one call, and takes in what came of them. False:
    /// it gave way, and they are out.
    pub(super) fn brief_from(&mut self, work: &[Item], from: usize, run: &mut Run) -> bool {
        let now = self.clock.now();
        let mut items = SmallVec::new();
        // None may need another: each is about a component of its own.
        let mut about = FxHashSet::<ComponentName>::default();
        for (at, item) in work.iter().enumerate().skip(from) {
            if run.over[at] {
                continue;
            }
            if items.len() == limits::BRIEF_STEPS
                || self.platform.execution(&item.step) != Execution::Brief
                || !about.insert(item.step.component())
            {
                break;
            }
            if let Some(reason) = self.forbidden(&item.step, run, now) {
                if items.is_empty() {
                    run.over[at] = true;
                    run.failures.push((at as u32, reason));
                    return true;
                }
                break;
            }
            items.push(at as u32);
        }
        self.launch(work, items, run);
        while !run.flights.is_empty() {
            if self.gives_way(run) {
                return false;
            }
            self.await_flight(run);
            for (i, outcome) in self.landed(work, run) {
                match outcome {
                    // Nothing touched the model meanwhile: the look at the precondition still holds.
                    Some(Outcome::Done(_)) => self.took_effect(&work[i as usize].step, i, run),
                    Some(outcome) => self.conclude(work, i, outcome, run),
                    None => {}
                }
            }
        }
        true
    }

    /// Whether something urgent waits that this gives way to; then no more of it is begun by the calls that are out.
    pub(super) fn gives_way(&self, run: &Run) -> bool {
        let gives_way = run.gives_way && self.urgent();
        if gives_way {
            run.flights.iter().for_each(|flight| flight.stop.store(true, Ordering::Release));
        }
        gives_way
    }

    /// Waits until a call is back or given up, or something urgent came.
    pub(super) fn await_flight(&mut self, run: &Run) {
        while !run.flights.iter().any(|flight| self.has_reply(flight.ticket)) {
            if self.gives_way(run) {
                return;
            }
            let until = run.flights.iter().map(|flight| flight.deadline).min().unwrap_or(Time::NEVER);
            let until = until + limits::PLATFORM_GRACE;
            if self.clock.now() >= until {
                return;
            }
            self.pump(until);
        }
    }

    /// Takes the calls that are back, and those given up, off the list: what came of their items, none where they were
    /// not begun.
    pub(super) fn landed(&mut self, work: &[Item], run: &mut Run) -> Vec<(u32, Option<Outcome>)> {
        let mut landed = Vec::new();
        let now = self.clock.now();
        let unknown = |cause| Ended { outcome: Outcome::Unknown(cause), took: None };
        let mut at = 0;
        while at < run.flights.len() {
            let flight = &run.flights[at];
            let several = flight.items.len();
            let ended: SmallVec<[Ended; 1]> = match self.take_reply(flight.ticket) {
                Some(Reply::Executed(outcome)) => smallvec![Ended { outcome, took: None }],
                Some(Reply::Several(ended)) => SmallVec::from_vec(ended),
                Some(_) => smallvec![unknown(Cause::Lost("the answer was to another question".to_owned())); several],
                None if now >= flight.deadline + limits::PLATFORM_GRACE => {
                    self.give_up(flight.ticket);
                    smallvec![unknown(Cause::Timeout); several]
                }
                None => {
                    at += 1;
                    continue;
                }
            };
            let flight = run.flights.remove(at);
            let mut ended = ended.into_iter().fuse();
            for (place, i) in flight.items.into_iter().enumerate() {
                let silent = || (place == 0).then(|| unknown(Cause::Lost("the platform said nothing".to_owned())));
                let Some(Ended { outcome, took }) = ended.next().or_else(silent) else {
                    landed.push((i, None));
                    continue;
                };
                let took = took.unwrap_or_else(|| now.since(flight.started));
                let step = &work[i as usize].step;
                self.tell(StepName::of(step), StepEnd::from(&outcome), Some(took), run.undoing);
                landed.push((i, Some(outcome)));
            }
        }
        landed
    }
}
