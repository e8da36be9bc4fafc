//! One transaction: a plan carried out whole, or taken back, or what remains is named (semantics: *Requests*).
//!
//! A pure machine without thread, clock or platform. [`Transaction::poll`] says what is to be done next: steps to begin,
//! calls to cancel, components to read back; [`Transaction::on`] hears what came of it. The model of the system lies with
//! whoever drives the machine and changes only here, with each step that was done. The configurator carries messages
//! between a machine and the platform; a test can drive one through every outcome at every step.
//!
//! `run`: a list of steps being carried out; `immediate`: without a detour. `order`: which may begin. `settle`: unknown
//! outcomes. `stand`: whether what was applied stands. `back`: the way back; `touched`, `heed`: what it leaves to safe
//! configurations; `bring`: where it goes on for them. `mending`: what is found different. `end`: what comes of each part;
//! `endings`: what may. `messages`: what goes in and out; `hears`: what each of them does.
//!
//! *What is absent*: no step whose precondition was not looked at on the live model immediately before; no unknown outcome
//! that is taken for done or not done without having been read back; no step back that moves and that nobody asked for.

mod back;
mod bring;
mod end;
mod endings;
mod hears;
mod heed;
mod immediate;
mod limits;
mod mending;
mod messages;
mod order;
mod partial;
mod run;
mod settle;
mod stand;
mod touched;

pub use end::{BrokenPart, LeftBeside, PartEnd, TransactionEnd};
pub use endings::{Stopping, can_fail, endings};
pub use immediate::Doing;
pub use limits::{Limit, Spec};
pub use messages::{Can, Input, OpenStep, Poll, Question};
pub use touched::Touched;

use crate::model::{ComponentName, Outcome, Snapshot, Step};
use crate::plan::PlannedStep;
use crate::stack::{Planned, Reason};
use crate::system::System;
use crate::time::Time;
use back::WayBack;
use mending::Mending;
use run::StepsRun;
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;
use std::sync::Arc;

/// A question that is out, and its answer once that has come.
#[derive(Debug, Clone, Copy)]
struct OpenQuestion {
    question: Question,
    told: Option<Option<bool>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TransactionPhase {
    Forward,
    /// Of a safe configuration something failed: is it as wanted all the same?
    Reviewing,
    /// All was done; what the configurations stand for is to become true.
    Standing,
    /// Nothing further begins; what is out comes in.
    Stopping,
    Back,
    /// The components are compared with the model.
    Looking,
    /// What was found different is mended, once.
    Mending,
    LookingAgain,
    Over,
}

/// A transaction under way.
#[derive(Debug)]
pub struct Transaction {
    planned: Planned,
    spec: Spec,
    phase: TransactionPhase,
    forward: StepsRun,
    /// The way back in hand, or what is mended.
    back: Option<(StepsRun, WayBack)>,
    /// How often the way back was begun.
    attempts: u32,
    /// Steps of the forward list that were taken back, and of those with several steps back how many are done.
    taken_back: FxHashSet<u32>,
    partly: FxHashMap<u32, usize>,
    /// Places of the whole that were finished on the way back.
    finished: FxHashSet<u32>,
    /// Where the net of several parts is carried out: the system that the parts before the failed one lead to, and what a
    /// held part has added to it.
    between: Option<Box<System>>,
    /// The system before all parts, where a way back has led to the one between them.
    origin: Option<Box<System>>,
    withheld: Option<Step>,
    /// Calls of which nobody knows, and that the frame takes back.
    perhaps: Vec<u32>,
    /// Steps of unknown outcome, of ways back too.
    unsettled: Vec<Step>,
    faulted: Vec<(ComponentName, crate::model::RunState)>,
    doubted: bool,
    touched: Touched,
    /// What of that was touched since the way back in hand began: it was laid out without knowing of it.
    touched_since: Option<Box<Touched>>,
    /// Steps of ways back that came in after a safe configuration had begun, with what takes them back and the revision then.
    late_back: Vec<(Step, crate::system::Undo, u64)>,
    /// Why it ends early, if not because of a step.
    stopped_by: Option<Reason>,
    /// Parts that are given up.
    given_up: SmallVec<[usize; 1]>,
    asked_back: bool,
    interrupted: bool,
    held: bool,
    taken_down: bool,
    broken_off: bool,
    reading: bool,
    seen: Option<Option<Snapshot>>,
    /// What was asked and not used yet, with the answers that came.
    asked: Vec<OpenQuestion>,
    /// The first part that does not stand for what it should.
    fallen: Option<usize>,
    cancels: Vec<u32>,
    /// Calls of the forward list that were told that they are given up: how far they came nobody knows.
    told: SmallVec<[u32; 1]>,
    mending: Mending,
    end: Option<TransactionEnd>,
}

impl Transaction {
    /// A transaction that has not begun.
    pub fn new(mut planned: Planned, spec: Spec) -> Self {
        let list = std::mem::take(&mut planned.steps);
        let limits = spec.limits_of(&planned, list.len());
        let mut forward = StepsRun::new(list, limits);
        forward.tries_all = spec.best_effort;
        forward.notes = spec.best_effort;
        Self {
            planned,
            asked_back: spec.asked_back,
            spec,
            phase: TransactionPhase::Forward,
            forward,
            back: None,
            attempts: 0,
            taken_back: FxHashSet::default(),
            partly: FxHashMap::default(),
            finished: FxHashSet::default(),
            between: None,
            origin: None,
            withheld: None,
            perhaps: Vec::new(),
            unsettled: Vec::new(),
            faulted: Vec::new(),
            doubted: false,
            touched: Touched::default(),
            touched_since: None,
            late_back: Vec::new(),
            stopped_by: None,
            given_up: SmallVec::new(),
            interrupted: false,
            held: false,
            taken_down: false,
            broken_off: false,
            reading: false,
            seen: None,
            asked: Vec::new(),
            fallen: None,
            cancels: Vec::new(),
            told: SmallVec::new(),
            mending: Mending::default(),
            end: None,
        }
    }

    /// Goes on where the first `done` steps were done already (the model has them) and the next has ended so.
    pub fn resume(&mut self, done: u32, outcome: Outcome, live: &mut System) {
        let forward = &mut self.forward;
        (0..done).for_each(|i| forward.was_done(i));
        if (done as usize) < forward.list.len() {
            forward.is_out(done, live);
            self.on(Input::Ended { step: done, outcome }, live);
        }
    }

    /// What it carries out; its steps are those of [`Self::step`] now.
    pub fn planned(&self) -> &Planned {
        &self.planned
    }

    /// How it is carried out.
    pub fn spec(&self) -> &Spec {
        &self.spec
    }

    /// All steps, one operation after the other.
    fn whole(&self) -> &[PlannedStep] {
        if self.planned.whole.is_empty() { &self.forward.list } else { &self.planned.whole }
    }

    fn in_hand(&self) -> &StepsRun {
        self.back.as_ref().map_or(&self.forward, |(run, _)| run)
    }

    fn in_hand_mut(&mut self) -> &mut StepsRun {
        match &mut self.back {
            Some((run, _)) => run,
            None => &mut self.forward,
        }
    }

    /// A step of the list in hand.
    pub fn step(&self, number: u32) -> &PlannedStep {
        &self.in_hand().list[number as usize]
    }

    /// Whether the list in hand takes something back.
    pub fn is_going_back(&self) -> bool {
        self.back.is_some()
    }

    /// The part that a step of the list in hand belongs to.
    pub fn part_of_step(&self, number: u32) -> usize {
        match &self.back {
            None => self.part_of(number),
            Some((_, way)) => {
                let taken = way.takes_back.get(number as usize).copied().flatten().map(|i| self.part_of(i));
                let finished = way.finishes.get(number as usize).copied().flatten();
                taken
                    .or(finished.map(|place| self.planned.part_of(Some(place))))
                    .unwrap_or(self.planned.parts.len() - 1)
            }
        }
    }

    /// Steps of the forward list that were done so far, in order, with what takes each back: what a safe configuration that
    /// comes now is planned around.
    pub fn done_so_far(&self) -> impl Iterator<Item = (&PlannedStep, &crate::system::Undo)> {
        let forward = &self.forward;
        let open = forward.done.iter().copied().filter(|i| !self.taken_back.contains(i));
        open.map(|i| (&forward.list[i as usize], self.undo_of(i, 0)))
    }

    /// The components that it is about.
    pub fn components(&self) -> Vec<ComponentName> {
        self.own()
    }

    /// All that it was to do, each step with the part that it is of.
    pub fn all_steps(&self) -> Vec<(usize, Step)> {
        let steps = (0..).zip(self.forward.list.iter());
        steps.map(|(i, planned)| (self.part_of(i), planned.step.clone())).collect()
    }

    /// What leads back from all that it was to do, latest first, each step with the part that it is of.
    pub fn undoing(&self) -> Vec<(usize, Step)> {
        let mut list = Vec::new();
        for (i, planned) in (0..).zip(self.forward.list.iter()) {
            let part = self.part_of(i);
            list.extend(planned.undo.steps().iter().rev().map(|step| (part, step.clone())));
        }
        list.reverse();
        list
    }

    /// What came of it, once it is over: told once.
    pub fn end(&mut self) -> TransactionEnd {
        self.end.take().expect("it is over")
    }

    /// What is to be done next.
    pub fn poll(&mut self, live: &mut System, now: Time, can: &Can<'_>) -> Poll {
        loop {
            if let Some(step) = self.cancels.pop() {
                return Poll::Cancel(step);
            }
            if let Some(poll) = self.settle(live) {
                return poll;
            }
            match self.phase {
                TransactionPhase::Forward | TransactionPhase::Back | TransactionPhase::Mending => {
                    let stopped = self.is_stopped();
                    let run = self.in_hand_mut();
                    if !stopped && !run.stops() {
                        let begun = run.begin(live, now, can);
                        if !begun.is_empty() {
                            return Poll::Begin(begun);
                        }
                        if !run.stops() && !run.is_over() {
                            return Poll::Wait;
                        }
                    }
                    self.carried_out();
                }
                TransactionPhase::Standing => {
                    if let Some(poll) = self.stand(live, can) {
                        return poll;
                    }
                }
                TransactionPhase::Reviewing => {
                    if !std::mem::replace(&mut self.reading, true) {
                        self.seen = None;
                        return Poll::Read(self.failed_ones());
                    }
                    let Some(seen) = self.seen.take() else { return Poll::Wait };
                    self.reading = false;
                    self.review(seen.as_ref(), live);
                    self.phase = TransactionPhase::Standing;
                }
                TransactionPhase::Stopping => {
                    let run = self.in_hand();
                    if self.held || run.out > 0 {
                        return Poll::Wait;
                    }
                    // What was being looked at when a safe configuration came is no news after the way back from there.
                    if std::mem::take(&mut self.reading) && self.seen.take().is_none() {
                        self.reading = true;
                        return Poll::Wait;
                    }
                    self.turn_back(live);
                }
                TransactionPhase::Looking | TransactionPhase::LookingAgain => {
                    if self.held {
                        return Poll::Wait;
                    }
                    if !self.reading {
                        self.reading = true;
                        self.seen = None;
                        return Poll::Read(self.own());
                    }
                    let Some(seen) = self.seen.take() else { return Poll::Wait };
                    self.reading = false;
                    self.compare(seen, live, can);
                }
                TransactionPhase::Over => return Poll::Over,
            }
        }
    }

    /// Whether nothing further of the list in hand is to begin.
    fn is_stopped(&self) -> bool {
        match self.phase {
            TransactionPhase::Forward | TransactionPhase::Reviewing | TransactionPhase::Standing => {
                self.stopped_by.is_some()
            }
            _ => self.held || self.taken_down || self.broken_off,
        }
    }

    /// Whether no further step of the list in hand is to begin: what stands in a batch and has not begun need not either.
    pub fn begins_no_more(&self) -> bool {
        self.phase == TransactionPhase::Stopping || self.is_stopped() || self.in_hand().stops()
    }

    /// The list in hand is over, or stops.
    fn carried_out(&mut self) {
        match self.phase {
            TransactionPhase::Forward => {
                let forward = &self.forward;
                let safe = self.spec.best_effort && self.planned.parts.iter().any(|part| part.pushes.is_some());
                if forward.is_over() && safe && !forward.failures.is_empty() && !self.taken_down {
                    self.phase = TransactionPhase::Reviewing;
                } else if forward.is_over() && (self.spec.best_effort || !forward.stops() && back::whole(forward)) {
                    self.phase = TransactionPhase::Standing;
                } else {
                    self.phase = TransactionPhase::Stopping;
                }
            }
            TransactionPhase::Back => {
                // What is out comes in first.
                self.phase = TransactionPhase::Stopping;
            }
            TransactionPhase::Mending => {
                if self.in_hand().out > 0 {
                    self.phase = TransactionPhase::Stopping;
                    return;
                }
                self.back = None;
                self.phase = TransactionPhase::LookingAgain;
            }
            _ => {}
        }
    }

    /// Nothing is out any more: the way back begins, goes on, or is over.
    fn turn_back(&mut self, live: &mut System) {
        if self.mending.target.is_some() {
            self.back = None;
            self.phase = TransactionPhase::LookingAgain;
            return;
        }
        let (mut failed, mut whole) = (self.back.is_none(), false);
        if let Some((run, way)) = self.back.take() {
            (failed, whole) = (self.took_back(&run, &way), back::whole(&run));
        }
        let part = self.failed_part();
        match self.mending.interrupted.take() {
            Some(true) if whole => {
                self.mending.otherwise.clear();
                self.taken_back.extend(self.remaining(part));
                self.faulted.clear();
                self.forward.faulted.clear();
            }
            Some(_) => self.mending.broke_off = true,
            None => {}
        }
        if self.broken_off && !self.taken_down {
            self.phase = TransactionPhase::Looking;
            return;
        }
        if self.between.is_none() && part > 0 {
            self.between = Some(Box::new(self.led_to(part, live)));
            self.origin = Some(Box::new(self.before_all(live)));
        }
        let way = self.way_back(part, live);
        self.withheld.clone_from(&way.withheld);
        self.taken_back.extend(way.superseded.iter().copied());
        // A safe configuration that came during its last step may want more of what that has brought back.
        failed |= way.restores || whole && way.brings;
        self.late_back.clear();
        self.touched_since = None;
        let again = self.interrupted || self.attempts < 2;
        if way.list.is_empty() || !(failed && again) || self.attempts > 8 {
            if self.taken_down {
                self.compare_blind(0, true, live);
            } else {
                self.phase = TransactionPhase::Looking;
            }
            return;
        }
        self.attempts += 1;
        let mut run = StepsRun::untimed(Arc::new(way.list.clone()));
        run.late_from_now = false;
        self.back = Some((run, way));
        self.phase = TransactionPhase::Back;
    }

    /// The part from which on everything is taken back.
    fn failed_part(&self) -> usize {
        // Broken off, those before it stand only where they were being finished.
        if self.interrupted || self.taken_down || self.broken_off && self.between.is_none() {
            return 0;
        }
        let forward = &self.forward;
        let failures = forward.failures.iter().map(|(i, _)| *i).chain(forward.unsettled.iter().copied());
        // One that was given up is not to blame for one before it that failed.
        failures.map(|i| self.part_of(i)).chain(self.fallen).chain(self.given_up.iter().copied()).min().unwrap_or(0)
    }
}
