//! Whole or not at all: steps are carried out, or taken back, or what remains is named.

use super::engine::{Broken, Engine};
use super::exec::{End, Run};
use super::pool::{Call, Reply};
use super::request::{Reason, Request, Residual};
use super::touched::Touched;
use super::work::{Item, chain, item};
use crate::model::{ComponentName, ConfigId, RunState, Snapshot, Step};
use crate::system::{self, System, Undo, View as _, step};
use crate::time::Time;
use rustc_hash::FxHashSet;
use smallvec::SmallVec;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::time::Duration;

/// How a transaction is carried out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spec {
    /// Its own time, beside that of each step.
    pub timeout: Option<Duration>,
    /// How long one step may take.
    pub patience: Duration,
    /// A failure undoes nothing.
    pub hold: bool,
}

/// How it ended.
pub(super) enum Ended {
    /// All of it was done.
    Applied,
    /// The system is as before (but for what a safe configuration did meanwhile).
    Undone(Reason),
    /// Neither.
    Broken(Arc<Residual>),
}

/// What came between.
#[derive(Default)]
pub(super) struct Interruption {
    /// The first thing that interrupted.
    pub by: Option<Reason>,
    /// What safe configurations touched.
    pub touched: Touched,
    /// The safe configurations, in the order they were applied.
    pub safe: Vec<(ConfigId, Request)>,
    /// How many of them the picture of what should be has already.
    folded: usize,
    /// What takes back what they did, in order.
    pub undo: Vec<Step>,
    /// A teardown waits: nothing is rolled back, it takes everything away.
    pub teardown: bool,
}

impl Interruption {
    /// Nothing more may come between.
    pub fn closed() -> Self {
        Self { teardown: true, ..Self::default() }
    }
}

impl Engine {
    /// Carries out `work` as a whole.
    pub(super) fn transact(&mut self, work: &[Item], spec: Spec) -> Ended {
        let until = spec.timeout.map_or(Time::NEVER, |limit| self.clock.now() + limit);
        self.transact_from(work, Run::new(work, false, true, until), spec)
    }

    /// The same from where `run` stands.
    pub(super) fn transact_from(&mut self, work: &[Item], mut run: Run, spec: Spec) -> Ended {
        self.allowed = spec.timeout.unwrap_or_default();
        self.patience = spec.patience;
        let carried = catch_unwind(AssertUnwindSafe(|| self.carry_out(work, &mut run)));
        let end = match carried {
            Ok(End::All) => return Ended::Applied,
            Ok(end) => end,
            Err(payload) => {
                // The picture as it should be is worth more than the one in the middle; see `Engine::start_anew`.
                self.expected = Some(self.without(work, &run, &[]));
                resume_unwind(payload);
            }
        };
        let mut between = Interruption::default();
        if end == End::GaveWay {
            self.serve_urgent(&mut between);
        }
        run.gives_way = !between.teardown;
        while !self.collect(work, &mut run) {
            self.serve_urgent(&mut between);
            // A teardown waits until this is over: there is nothing more to give way to.
            run.gives_way = !between.teardown;
        }
        let reason = match run.failures.first() {
            Some((_, reason)) => reason.clone(),
            None => match (run.unsettled.first(), &between.by) {
                (Some(i), _) => {
                    Reason::Step { step: work[*i as usize].step.clone(), cause: crate::platform::Cause::Timeout }
                }
                (None, Some(reason)) => reason.clone(),
                // It gave way and everything that was out came in: then all was done before anything else happened.
                (None, None) => Reason::Ended,
            },
        };
        let mut left = Left {
            reason,
            unsettled: run.unsettled.iter().map(|i| work[*i as usize].step.clone()).collect(),
            irreversible: Vec::new(),
            doubted: run.doubted,
            own: work.iter().map(|item| item.step.component()).collect(),
        };
        self.read_suspects();
        let mut expected = self.without(work, &run, &between.undo);
        self.fold(&mut expected, &mut between);
        if spec.hold || between.teardown {
            return self.break_off(left, expected);
        }
        self.roll_back(work, &run.done, &mut left, &mut between);
        self.fold(&mut expected, &mut between);
        if between.teardown {
            return self.break_off(left, expected);
        }
        self.verify(left, expected, &mut between)
    }

    /// Takes safe configurations that came between into the picture of what should be.
    fn fold(&mut self, expected: &mut System, between: &mut Interruption) {
        while let Some((id, request)) = between.safe.get(between.folded).copied() {
            between.folded += 1;
            self.fold_in(expected, id, request, &mut between.touched);
        }
    }

    /// The picture without what was done (and what came between, undone by `between`), and without the faults it brought
    /// about.
    fn without(&self, work: &[Item], run: &Run, between: &[Step]) -> System {
        let mut picture = self.system.clone();
        for step in between {
            let _ = step::apply(step, &mut picture);
        }
        for (component, state) in &run.faulted {
            picture.set_state(*component, *state);
        }
        for done in run.done.iter().rev() {
            for step in work[*done as usize].undo.steps() {
                let _ = step::apply(step, &mut picture);
            }
        }
        picture
    }

    /// Takes back what was done, latest first, as far as it goes.
    fn roll_back(&mut self, work: &[Item], done: &[u32], left: &mut Left, between: &mut Interruption) {
        for item in done.iter().map(|i| &work[*i as usize]) {
            if let Undo::Irreversible(_) = item.undo {
                left.irreversible.push(item.step.clone());
            }
        }
        let mut back = backwards(work, done);
        loop {
            if !between.touched.is_empty() {
                back = without_items(back, |item| between.touched.has(&item.step));
            }
            let mut run = Run::new(&back, true, true, Time::NEVER);
            let mut end = self.carry_out(&back, &mut run);
            while end == End::GaveWay {
                self.serve_urgent(between);
                run.gives_way = !between.teardown;
                end = if self.collect(&back, &mut run) { End::All } else { End::GaveWay };
            }
            left.doubted |= run.doubted || !run.failures.is_empty();
            left.unsettled.extend(run.unsettled.iter().map(|i| back[*i as usize].step.clone()));
            if between.teardown || run.over.iter().all(|over| *over) {
                break;
            }
            let over = run.over;
            let mut at = 0;
            back = without_items(back, |_| {
                at += 1;
                over[at - 1]
            });
        }
    }

    /// Compares the platform with what should be; repairs the difference once; names what remains.
    fn verify(&mut self, left: Left, expected: System, between: &mut Interruption) -> Ended {
        let mut expected = expected;
        let Some(seen) = self.look(between) else {
            // Nobody can be asked. What every answer said without a doubt is believed.
            if left.doubted || !left.is_clean() {
                return self.broken(left, expected, false);
            }
            return Ended::Undone(left.reason);
        };
        self.fold(&mut expected, between);
        self.accept_faults(&seen, &mut expected, &left.own);
        if self.adopt(&seen).is_err() {
            return self.broken(left, expected, false);
        }
        if !system::diff::reached(&self.system, &expected) && !between.teardown {
            self.repair(&expected, between);
            match self.look(between) {
                Some(seen) if self.adopt(&seen).is_ok() => {}
                _ => return self.broken(left, expected, false),
            }
            self.fold(&mut expected, between);
        }
        if left.is_clean() && system::diff::reached(&self.system, &expected) {
            return Ended::Undone(left.reason);
        }
        self.broken(left, expected, true)
    }

    /// One attempt at going from the system as it is to `expected`, by their difference.
    pub(super) fn repair(&mut self, expected: &System, between: &mut Interruption) {
        let quarantined = self.quarantined.clone();
        let steps = system::diff(&self.system, expected);
        let steps = steps
            .into_iter()
            .filter(|step| matches!(step, Step::Disconnect { .. }) || !quarantined.contains(&step.component()));
        let work = chain(steps);
        let mut run = Run::new(&work, true, true, Time::NEVER);
        let mut end = self.carry_out(&work, &mut run);
        while end == End::GaveWay {
            self.serve_urgent(between);
            run.gives_way = !between.teardown;
            end = if self.collect(&work, &mut run) { End::All } else { End::GaveWay };
        }
    }

    /// Undoes nothing and says so.
    fn break_off(&mut self, left: Left, expected: System) -> Ended {
        let mut between = Interruption::closed();
        let seen = self.look(&mut between);
        let observed = seen.as_ref().is_some_and(|seen| self.adopt(seen).is_ok());
        let ended = self.broken(left, expected, observed);
        if let Some(broken) = &mut self.broken {
            broken.mendable = false;
        }
        ended
    }

    /// From now on the system is broken: it is as the model now says, and should be as `expected`.
    fn broken(&mut self, left: Left, expected: System, observed: bool) -> Ended {
        let residual = Arc::new(self.residual(left, &expected, observed));
        self.broken = Some(Broken { residual: residual.clone(), expected, culprit: None, mendable: true });
        self.changed();
        Ended::Broken(residual)
    }

    pub(super) fn residual(&mut self, left: Left, expected: &System, observed: bool) -> Residual {
        self.note_quarantine();
        let mut faulted = Vec::new();
        self.system.for_each_component(&mut |node| {
            if node.state == RunState::Faulted
                && expected.component(node.name).is_none_or(|wanted| wanted.state != RunState::Faulted)
            {
                faulted.push(node.name);
            }
        });
        faulted.sort_unstable();
        Residual {
            cause: left.reason,
            difference: system::diff(expected, &self.system),
            unsettled: left.unsettled,
            irreversible: left.irreversible,
            faulted,
            quarantined: self.quarantined.clone(),
            observed,
        }
    }

    /// The whole system as the platform sees it; none: no answer.
    pub(super) fn look(&mut self, between: &mut Interruption) -> Option<Snapshot> {
        loop {
            match self.ask(Call::Observe, !between.teardown) {
                Ok(Some(Reply::Observed(Ok(seen)))) => return Some(seen),
                Ok(_) => return None,
                Err(_) => self.serve_urgent(between),
            }
        }
    }

    /// Makes `seen` the picture.
    pub(super) fn adopt(&mut self, seen: &Snapshot) -> Result<(), system::UnknownType> {
        if self.system.snapshot() != *seen {
            self.system = System::from_snapshot(seen, self.system.catalogue().clone())?;
            // They hold handles into the picture that was.
            self.switches.clear();
            self.changed();
        }
        Ok(())
    }

    /// Components that failed by themselves meanwhile (nothing was done to them) are no remainder of the application.
    fn accept_faults(&self, seen: &Snapshot, expected: &mut System, own: &FxHashSet<ComponentName>) {
        let failed: Vec<ComponentName> = seen
            .components
            .iter()
            .filter(|(name, component)| {
                component.state == RunState::Faulted
                    && !own.contains(name)
                    && self.system.component(**name).is_some_and(|node| node.state != RunState::Faulted)
                    && expected.component(**name).map(|node| node.state)
                        == self.system.component(**name).map(|node| node.state)
            })
            .map(|(name, _)| *name)
            .collect();
        for component in failed {
            expected.set_state(component, RunState::Faulted);
        }
    }
}

/// What is left over when an application is taken back.
pub(super) struct Left {
    pub reason: Reason,
    pub unsettled: Vec<Step>,
    pub irreversible: Vec<Step>,
    /// Some answer was unclear, or a step back failed.
    pub doubted: bool,
    /// Components that the application is about.
    pub own: FxHashSet<ComponentName>,
}

impl Left {
    /// Nothing but the reason.
    pub fn of(reason: Reason) -> Self {
        Self { reason, unsettled: Vec::new(), irreversible: Vec::new(), doubted: false, own: FxHashSet::default() }
    }

    fn is_clean(&self) -> bool {
        self.unsettled.is_empty() && self.irreversible.is_empty()
    }
}

/// The inverses of what was done, latest first, in the reverse of the order that the steps needed.
fn backwards(work: &[Item], done: &[u32]) -> Vec<Item> {
    let waves = work.iter().map(|item| item.wave).max().unwrap_or(0);
    let mut followers: Vec<SmallVec<[u32; 4]>> = vec![SmallVec::new(); work.len()];
    for (i, item) in (0..).zip(work) {
        for before in &item.after {
            followers[*before as usize].push(i);
        }
    }
    // For each item, the last steps of what takes it and its followers back.
    let mut ends: Vec<SmallVec<[u32; 4]>> = vec![SmallVec::new(); work.len()];
    let mut back: Vec<Item> = Vec::with_capacity(done.len());
    for i in done.iter().rev().map(|i| *i as usize) {
        let original = &work[i];
        let mut after: SmallVec<[u32; 4]> = followers[i].iter().flat_map(|f| ends[*f as usize].clone()).collect();
        after.sort_unstable();
        after.dedup();
        for step in original.undo.steps() {
            let id = back.len() as u32;
            back.push(item(step.clone(), id, waves - original.wave, after));
            after = SmallVec::from_iter([id]);
        }
        ends[i] = after;
    }
    back
}

/// The work without some of its items; who waited for one of those waits for it no more.
fn without_items(work: Vec<Item>, mut out: impl FnMut(&Item) -> bool) -> Vec<Item> {
    let mut place: Vec<Option<u32>> = Vec::with_capacity(work.len());
    let mut kept: Vec<Item> = Vec::with_capacity(work.len());
    for mut item in work {
        if out(&item) {
            place.push(None);
        } else {
            item.after = item.after.iter().filter_map(|before| place[*before as usize]).collect();
            item.id = kept.len() as u32;
            place.push(Some(item.id));
            kept.push(item);
        }
    }
    kept
}
