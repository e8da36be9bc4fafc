//! How a transaction ends: what was done is compared with what is there, and what is left is named.

use super::heed::Heed;
use super::partial::{demand_no_more, partial};
use super::{Can, Transaction, TransactionPhase};
use crate::model::{Cause, ComponentName, RunState, Snapshot, Step};
use crate::plan::undo::DraftStep;
use crate::stack::{Edits, Ending, Frame, FrameId, Part, Reason, Residual};
use crate::system::{Overlay, System, Undo, View as _, step, touch};
use rustc_hash::FxHashSet;
use std::collections::BTreeSet;
use std::ops::Range;
use std::sync::Arc;

/// What came of a transaction.
#[derive(Debug, Clone)]
pub struct TransactionEnd {
    /// What came of each part, in order.
    pub parts: Vec<PartEnd>,
    /// What is otherwise beside it than it was believed to be.
    pub beside: Option<LeftBeside>,
}

/// What something that has gone back has found otherwise, which is not its own: it would have to move.
#[derive(Debug, Clone)]
pub struct LeftBeside {
    /// What differs.
    pub residual: Arc<Residual>,
    /// Its components as the model had them.
    pub expected: Snapshot,
    /// See [`Broken::guests`](crate::stack::Broken::guests).
    pub guests: BTreeSet<ComponentName>,
}

/// What came of a part.
#[derive(Debug, Clone)]
pub enum PartEnd {
    /// It was done.
    Done,
    /// The system is as before it.
    Failed(Reason),
    /// It was given up, and the system is as before it.
    Cancelled,
    /// Neither done nor taken back.
    Broken(Box<BrokenPart>),
    /// It had not begun when one before it failed: to be taken up anew.
    Anew,
}

impl PartEnd {
    /// Without the reason.
    pub fn ending(&self) -> Ending {
        match self {
            Self::Done => Ending::Done,
            Self::Failed(_) => Ending::Failed,
            Self::Cancelled => Ending::Cancelled,
            Self::Broken(_) => Ending::Broken,
            Self::Anew => Ending::Anew,
        }
    }

    /// Why it did not simply succeed.
    pub fn reason(&self) -> Option<Reason> {
        match self {
            Self::Done | Self::Anew => None,
            Self::Failed(reason) => Some(reason.clone()),
            Self::Cancelled => Some(Reason::GivenUp),
            Self::Broken(broken) => Some(Reason::Broken(broken.residual.clone())),
        }
    }
}

/// What is left of a part that is neither done nor taken back.
#[derive(Debug, Clone)]
pub struct BrokenPart {
    /// What is left, in words and steps.
    pub residual: Arc<Residual>,
    /// The partial frame: what takes back what was done.
    pub frame: Option<Frame>,
    /// The frame that it takes the place of, where that was being undone.
    pub instead: Option<FrameId>,
    /// The components of which not all is known, as the model has them.
    pub expected: Snapshot,
    /// See [`Broken::guests`](crate::stack::Broken::guests).
    pub guests: BTreeSet<ComponentName>,
    /// What was to be undone with it: frames that are gone all the same, and what is left of others.
    pub gone: Edits,
    /// Each in the place of that of its number.
    pub also: Vec<Frame>,
}

impl BrokenPart {
    /// One of which nothing is left but that it is not known.
    pub fn of(residual: Arc<Residual>) -> Self {
        let (expected, guests, gone) = (Snapshot::default(), BTreeSet::new(), Edits::default());
        Self { residual, frame: None, instead: None, expected, guests, gone, also: Vec::new() }
    }
}

impl Transaction {
    /// Everything was tried: it is done, or, best effort, what could not be done is named.
    pub(super) fn end_forward(&mut self, live: &System, can: &Can<'_>) {
        let forward = &self.forward;
        if forward.failures.is_empty() && forward.unsettled.is_empty() && self.fallen.is_none() {
            let parts = self.planned.parts.iter().map(|_| PartEnd::Done).collect();
            return self.over(parts);
        }
        let unsettled = forward.unsettled.iter().map(|i| forward.list[*i as usize].step.clone()).collect();
        self.unsettled = unsettled;
        let left = self.remaining(0).into_iter().map(|i| forward.list[i as usize].step.clone()).collect();
        let cause = self.reason();
        let also = self.failures().into_iter().filter(|reason| *reason != cause).collect();
        let unsettled = self.unsettled.clone();
        let residual = Residual { left, also, unsettled, quarantined: self.hung(can), ..Residual::of(cause) };
        let broken = self.broken(0, residual, false, live);
        self.over(vec![broken]);
    }

    fn over(&mut self, parts: Vec<PartEnd>) {
        self.end = Some(TransactionEnd { parts, beside: None });
        self.phase = TransactionPhase::Over;
    }

    /// The components it is about: also those of what takes its steps back, which may be a call of another, and of what was
    /// left out of the net and may have to be finished.
    pub(super) fn own(&self) -> Vec<ComponentName> {
        let forward = &self.forward;
        let all = forward.list.iter().chain(&self.planned.whole);
        let steps = all.flat_map(|planned| std::iter::once(&planned.step).chain(planned.undo.steps()));
        let mut own: Vec<ComponentName> = steps.flat_map(touch::components).collect();
        own.sort_unstable();
        own.dedup();
        own
    }

    fn hung(&self, can: &Can<'_>) -> Vec<ComponentName> {
        let own = self.own();
        can.quarantined.iter().copied().filter(|component| own.contains(component)).collect()
    }

    /// What failed so far, and what nobody knows of.
    pub fn failures(&self) -> Vec<Reason> {
        let forward = &self.forward;
        let unknown = |i: &u32| Reason::Step { step: forward.list[*i as usize].step.clone(), cause: Cause::Timeout };
        forward.failures.iter().map(|(_, reason)| reason.clone()).chain(forward.unsettled.iter().map(unknown)).collect()
    }

    /// That a safe configuration interrupted it, if one did.
    pub fn interrupted(&self) -> Option<Reason> {
        self.stopped_by.clone().filter(|_| self.interrupted)
    }

    /// Why it did not simply succeed.
    fn reason(&self) -> Reason {
        let forward = &self.forward;
        let part = self.failed_part();
        let first = forward.failures.iter().find(|(i, _)| self.part_of(*i) == part).or(forward.failures.first());
        match (first, forward.unsettled.first(), &self.stopped_by) {
            (_, _, Some(reason @ Reason::Interrupted(_))) => reason.clone(),
            (_, _, Some(reason)) if self.broken_off => reason.clone(),
            (_, _, Some(reason @ Reason::GivenUp)) if self.given_up.contains(&part) => reason.clone(),
            (Some((_, reason)), ..) => reason.clone(),
            (None, Some(i), _) => Reason::Step { step: forward.list[*i as usize].step.clone(), cause: Cause::Timeout },
            (None, None, Some(reason)) => reason.clone(),
            (None, None, None) => {
                let pushes = self.fallen.and_then(|part| self.planned.parts[part].pushes);
                pushes.map_or(Reason::Ended, Reason::DoesNotStand)
            }
        }
    }

    /// Steps of the forward list that were done, belong to `part` or a later one, and were not taken back.
    pub(super) fn remaining(&self, part: usize) -> Vec<u32> {
        let forward = &self.forward;
        let left = |i: &u32| {
            let needs = !matches!(self.undo_of(*i, part), Undo::Nothing);
            needs && !self.taken_back.contains(i) && self.part_of(*i) >= part
        };
        forward.done.iter().copied().filter(left).collect()
    }

    /// The system as it should be now, from the model: without the faults that this brought about, and, where nothing keeps
    /// it from that, without what could not be taken back. Tells whether the latter.
    pub(super) fn wanted(&self, part: usize, live: &System) -> (System, bool) {
        let mut wanted = live.clone();
        self.put_back(&mut wanted, &self.touched);
        let remaining = self.remaining(part);
        let plain = |i: &u32| {
            let steps = self.steps_back(*i, part);
            !steps.is_empty() && steps.iter().all(|step| !matches!(step, Step::Operation(_)))
        };
        // What may have happened is taken back by the frame.
        let whole = self.mends(part) && self.perhaps.is_empty() && remaining.iter().all(plain);
        // What cannot be taken back beside what safe configurations want is left, and told.
        let whole = whole
            && (!self.interrupted
                || self.between.is_some()
                || self.origin.is_some()
                || self.take_back(&remaining, part, &mut wanted.clone()));
        let origin = self.origin.as_ref().filter(|_| self.interrupted);
        match (&self.between, origin, whole) {
            (Some(between), _, true) => {
                for step in self.own_difference(&wanted, between) {
                    let _ = step::apply(&step, &mut wanted);
                }
            }
            // What safe configurations touched is theirs.
            (None, Some(origin), true) => {
                for step in self.own_difference(&wanted, origin).iter().filter(|step| !self.touched.has(step)) {
                    let _ = step::apply(step, &mut wanted);
                }
            }
            (None, None, true) => _ = self.take_back(&remaining, part, &mut wanted),
            // Of what was taken back in part the rest belongs to what should be.
            (_, _, false) => {
                let partly: Vec<u32> = remaining.iter().copied().filter(|i| self.is_partly_back(*i)).collect();
                self.take_back(&partly, part, &mut wanted);
            }
        }
        (wanted, whole)
    }

    /// Takes `remaining` back on `system`, latest first, as far as that goes. False: not all of it may be done there, since safe
    /// configurations have led elsewhere.
    fn take_back(&self, remaining: &[u32], part: usize, system: &mut System) -> bool {
        let mut all = true;
        let forward = &self.forward;
        let mut heed = Heed::new(&self.touched, remaining.iter().map(|i| &forward.list[*i as usize].step));
        for i in remaining.iter().rev() {
            let goes_back = self.goes_back(*i, part, &self.touched, &mut heed);
            for back in goes_back.steps {
                for back in goes_back.instead_of(back, &mut heed, &*system) {
                    all &= step::apply(&back, system).is_ok();
                }
            }
        }
        all
    }

    /// Notes what may have happened and can still be taken back: not what was called of a component that is gone.
    pub(super) fn note_perhaps(&mut self, live: &System) {
        let part = self.failed_part();
        let open = |i: &u32| {
            let back = self.steps_back(*i, part);
            !self.taken_back.contains(i)
                && !back.is_empty()
                && back.iter().all(|back| step::precondition(back, live).is_empty())
        };
        self.perhaps = self.perhaps_done().into_iter().filter(open).collect();
    }

    /// Nobody is asked, and the model is what is known; `observed`: nothing else can be.
    pub(super) fn compare_blind(&mut self, part: usize, observed: bool, live: &System) {
        let nothing = |_: &Step| crate::model::Execution::Blocking;
        let can = Can { execution: &nothing, batches: &|_| false, room: false, quarantined: &[], busy: &[] };
        self.judge(part, live, false, observed, live, &can);
    }

    /// Names the end. `whole`: `wanted` has nothing of what was done.
    pub(super) fn judge(
        &mut self,
        part: usize,
        wanted: &System,
        whole: bool,
        observed: bool,
        live: &System,
        can: &Can<'_>,
    ) {
        let forward = &self.forward;
        let open = forward.unsettled.iter().filter(|i| !self.taken_back.contains(i));
        let mut unsettled: Vec<Step> = open.map(|i| forward.list[*i as usize].step.clone()).collect();
        unsettled.append(&mut self.unsettled);
        let difference = self.own_difference(wanted, live);
        let mut faulted: Vec<ComponentName> = Vec::new();
        let own = self.own();
        for node in own.iter().filter_map(|name| live.component(*name)) {
            let was = wanted.component(node.name).map(|node| node.state);
            if node.state == RunState::Faulted && was != Some(RunState::Faulted) {
                faulted.push(node.name);
            }
        }
        // Where the way back to before is not known to be gone, what remains is told as a difference.
        let remaining = if whole { Vec::new() } else { self.remaining(part) };
        let forward = &self.forward;
        let residual = Residual {
            left: (remaining.iter().filter(|i| !self.is_partly_back(**i)))
                .map(|i| forward.list[*i as usize].step.clone())
                .collect(),
            withheld: self.withheld.clone(),
            difference,
            unsettled: unsettled.clone(),
            irreversible: (remaining.iter())
                .filter(|i| matches!(self.undo_of(**i, part), Undo::Irreversible(_)))
                .map(|i| forward.list[*i as usize].step.clone())
                .collect(),
            faulted,
            quarantined: self.hung(can),
            // Nobody can be asked: what every answer said without a doubt is believed.
            observed: observed || !self.doubted && unsettled.is_empty(),
            ..Residual::of(self.reason())
        };
        self.unsettled = unsettled;
        let beside = self.left_beside(part, &residual, wanted, live).filter(|_| remaining.is_empty());
        let clean = remaining.is_empty() && (residual.is_settled() || beside.is_some());
        let missing = self.missing(part, if beside.is_some() { wanted } else { live });
        // Interrupted, each part is to blame for what is left of it.
        let forward = &self.forward;
        let differs: FxHashSet<ComponentName> = residual.components().collect();
        let about = |i: &u32| touch::components(&forward.list[*i as usize].step).iter().any(|c| differs.contains(c));
        // Where what remains is told as a difference, it is of whoever has touched that.
        let open = if whole { self.remaining(part).into_iter().filter(about).collect() } else { remaining.clone() };
        let left: FxHashSet<usize> = open.iter().chain(&self.perhaps).map(|i| self.part_of(*i)).collect();
        let blamed = left.iter().copied().min().unwrap_or(part);
        let own_left = |at: usize| -> Residual {
            let own = open.iter().filter(|i| self.part_of(**i) == at && !self.is_partly_back(**i));
            Residual {
                left: own.map(|i| forward.list[*i as usize].step.clone()).collect(),
                observed: residual.observed,
                ..Residual::of(self.reason())
            }
        };
        // Given up before anything of it began: what is doubtful is whether those before it could be finished.
        let of_it = |i: &u32| self.part_of(*i) >= part;
        // A step of it that failed may have left its component faulted.
        let failed = forward.failures.iter().map(|(i, _)| i);
        let touched = forward.done.iter().chain(&forward.unsettled).chain(&self.perhaps).chain(failed).any(of_it);
        let finishing = part > 0 && !clean && !touched && !self.interrupted && self.given_up.contains(&part);
        let mut parts: Vec<PartEnd> = Vec::with_capacity(self.planned.parts.len());
        for (at, _) in self.planned.parts.iter().enumerate() {
            parts.push(if finishing && at + 1 == part {
                self.broken(at, residual.clone(), whole, wanted)
            } else if finishing && at == part {
                self.taken_back_whole(at)
            } else if at < part {
                if missing.contains(&at) {
                    self.broken(at, Residual::of(self.reason()), false, wanted)
                } else {
                    PartEnd::Done
                }
            } else if self.broken_off {
                match at == blamed && !clean {
                    true => self.broken(at, residual.clone(), whole, wanted),
                    false if left.contains(&at) => self.broken(at, own_left(at), whole, wanted),
                    false => self.broken_whole(residual.observed),
                }
            } else if !clean && self.interrupted {
                match at == blamed {
                    true => self.broken(at, residual.clone(), whole, wanted),
                    false if left.contains(&at) => self.broken(at, own_left(at), whole, wanted),
                    false => self.taken_back_whole(at),
                }
            } else if at == part {
                match clean {
                    true => self.taken_back_whole(at),
                    false => self.broken(at, residual.clone(), whole, wanted),
                }
            } else if self.interrupted || self.taken_down {
                self.taken_back_whole(at)
            } else {
                PartEnd::Anew
            });
        }
        self.over(parts);
        self.end.iter_mut().for_each(|end| end.beside.clone_from(&beside));
    }

    /// The end of a part of which nothing is left.
    fn taken_back_whole(&self, at: usize) -> PartEnd {
        let stopped = matches!(self.stopped_by, Some(Reason::GivenUp | Reason::Interrupted(_)));
        match self.given_up.contains(&at) && stopped {
            true => PartEnd::Cancelled,
            false => PartEnd::Failed(self.reason()),
        }
    }

    /// The end of a part of which nothing is left, but which was broken off: nobody vouches for it.
    fn broken_whole(&self, observed: bool) -> PartEnd {
        let residual = Arc::new(Residual { observed, ..Residual::of(self.reason()) });
        PartEnd::Broken(Box::new(BrokenPart::of(residual)))
    }

    /// Parts before `part` that do not stand: a call of theirs was neither done nor finished, or what they lead to is not
    /// there.
    fn missing(&self, part: usize, live: &System) -> FxHashSet<usize> {
        let Some(between) = &self.between else { return FxHashSet::default() };
        let forward = &self.forward;
        let mut done: FxHashSet<u32> = forward.done.iter().filter_map(|i| self.planned.place(*i as usize)).collect();
        done.extend(self.finished.iter().copied());
        let before = || (0..).zip(self.whole()).take_while(|(place, _)| self.planned.part_of(Some(*place)) < part);
        let mut missing: FxHashSet<usize> = before()
            .filter(|(place, planned)| !done.contains(place) && matches!(planned.step, Step::Operation(_)))
            .map(|(place, _)| self.planned.part_of(Some(place)))
            .collect();
        // What is left of the failed part itself is told with that.
        let mut stands = live.clone();
        self.take_back(&self.remaining(part), part, &mut stands);
        let differs: FxHashSet<ComponentName> =
            self.own_difference(&stands, between).iter().flat_map(touch::components).collect();
        let differs =
            before().filter(|(_, planned)| touch::components(&planned.step).iter().any(|c| differs.contains(c)));
        missing.extend(differs.map(|(place, _)| self.planned.part_of(Some(place))));
        missing
    }

    /// What takes back what is left of a part, as far as safe configurations have left it to that, from the system as it should be: what
    /// differs from that is mended first.
    fn items_left(&self, part: usize, wanted: &System) -> Vec<DraftStep> {
        let forward = &self.forward;
        let left: Vec<u32> = (self.remaining(part).into_iter())
            .chain(self.perhaps.iter().copied())
            .filter(|i| self.part_of(*i) == part)
            .collect();
        let mut heed = Heed::new(&self.touched, left.iter().map(|i| &forward.list[*i as usize].step));
        let mut view = Overlay::new(wanted);
        let mut items = Vec::new();
        for i in left.iter().rev() {
            let goes_back = self.goes_back(*i, part, &self.touched, &mut heed);
            for back in goes_back.steps {
                for back in goes_back.instead_of(back, &mut heed, &view) {
                    let _ = step::apply(&back, &mut view);
                    items.push(DraftStep::undoing(&back, &forward.list[*i as usize]));
                }
            }
        }
        items
    }

    /// A part that is neither done nor taken back. `whole`: going to `expected` takes all of it back, and its frame has
    /// nothing to add to that.
    fn broken(&self, part: usize, residual: Residual, whole: bool, wanted: &System) -> PartEnd {
        let planned = &self.planned.parts[part];
        let undone = planned.pushes.is_none();
        let items: Vec<DraftStep> = if whole && !undone {
            Vec::new()
        } else if undone {
            self.items_open(planned.own())
        } else {
            self.items_left(part, wanted)
        };
        // A safe configuration that is being undone demands nothing any more of what is back, and perhaps broken.
        let demands = !(undone && planned.frame.as_ref().is_some_and(|frame| frame.safe));
        let left: FxHashSet<ComponentName> = residual.components().filter(|_| demands).collect();
        let mut about = self.own();
        let guests = residual.guests(&about);
        about.extend(residual.components().filter(|component| !guests.contains(component)));
        let expected = wanted.snapshot_some(&about);
        let irreversible = residual.irreversible.first().cloned();
        let floor = irreversible.map(|step| format!("`{step}` cannot be undone"));
        let frame = planned.frame.as_deref().map(|frame| {
            let mut frame = partial(frame, items, &left, floor);
            if !demands {
                demand_no_more(&mut frame);
            }
            frame
        });
        let instead = if undone { frame.as_ref().map(|frame| frame.id) } else { None };
        let residual = Arc::new(residual);
        // Of a frame that was being undone nothing is: it stays as it is.
        let frame = frame.filter(|_| !(whole && undone));
        let (gone, also) = if whole { (Edits::default(), Vec::new()) } else { self.of_along(planned) };
        PartEnd::Broken(Box::new(BrokenPart { residual, frame, instead, expected, guests, gone, also }))
    }

    /// What is still to be undone of a frame; so is what safe configurations have done again, for whom it never was, and a
    /// call that was given up: taking back half of it is not taking it back.
    fn items_open(&self, own: Range<u32>) -> Vec<DraftStep> {
        let forward = &self.forward;
        let theirs = |i: &u32| self.interrupted && self.touched.has(&forward.list[*i as usize].step);
        let done: FxHashSet<u32> = (forward.done.iter())
            .filter(|i| !self.taken_back.contains(*i) && !theirs(i) && !self.told.contains(i))
            .filter_map(|i| self.planned.place(*i as usize))
            .collect();
        let open = own.filter(|place| !done.contains(place) && !self.finished.contains(place));
        open.map(|place| DraftStep { of: DraftStep::NOWHERE, ..DraftStep::of(&self.whole()[place as usize]) }).collect()
    }

    /// What was to be undone with a part that is neither done nor taken back: what is gone all the same, and what is left of
    /// the others. Of what was not begun, or is back, nothing is told.
    fn of_along(&self, part: &Part) -> (Edits, Vec<Frame>) {
        let (mut gone, mut also) = (Edits::default(), Vec::new());
        for along in &part.along {
            let items = self.items_open(along.range.clone());
            if items.is_empty() {
                gone.pops.extend(part.edits.pops.iter().find(|(id, _)| *id == along.frame.id).cloned());
            } else if items.len() < along.range.len() {
                also.push(partial(&along.frame, items, &FxHashSet::default(), None));
            }
        }
        (gone, also)
    }
}
