//! The way back: what was done is taken back latest first, as far as nothing moves that nobody asked to move; what stands
//! before the failure is finished.

use super::Transaction;
use super::heed::Heed;
use super::run::StepsRun;
use super::touched::Touched;
use crate::model::{Cause, OnFailure, RunState, Step};
use crate::plan::backwards::Backwards;
use crate::plan::{PlannedStep, StepId};
use crate::stack::{FrameId, Reason};
use crate::system::touch::{absolute, components};
use crate::system::{Overlay, System, Undo, View, diff, step};
use rustc_hash::FxHashSet;
use smallvec::SmallVec;

/// Steps one after the other.
pub(super) fn chain(steps: impl IntoIterator<Item = Step>) -> Vec<PlannedStep> {
    let mut list = Vec::new();
    for (id, step) in (0..).zip(steps) {
        let before: Option<StepId> = StepId::checked_sub(id, 1);
        list.push(PlannedStep::bare(step, id, 0, before.into_iter().collect()));
    }
    list
}

/// Steps back, and of each which step of the forward list it takes back (none: it finishes something).
#[derive(Debug, Default)]
pub(super) struct WayBack {
    pub list: Vec<PlannedStep>,
    pub takes_back: Vec<Option<u32>>,
    pub finishes: Vec<Option<u32>>,
    /// The first step back that was withheld.
    pub withheld: Option<Step>,
    /// Steps of the forward list that need no way back: a safe configuration has touched what they did.
    pub superseded: Vec<u32>,
    /// Something that a safe configuration wrote is brought back first.
    pub restores: bool,
    /// Something goes on to where safe configurations want it.
    pub brings: bool,
    /// Steps of the forward list of whose several steps back some are left out for that reason.
    pub left_out: Vec<u32>,
}

impl WayBack {
    /// Adds a step after all others.
    fn add_last(&mut self, step: Step, wave: u32, finishes: Option<u32>) {
        let after = (0..).take(self.list.len()).collect();
        self.add(step, wave, after, None, finishes);
    }

    /// Adds a step after all others that neither takes back nor finishes anything.
    pub fn add_behind(&mut self, step: Step) {
        let wave = self.list.iter().map(|step| step.wave + 1).max().unwrap_or(0);
        self.add_last(step, wave, None);
    }

    /// Adds a step that begins after those; answers its number.
    fn add(
        &mut self,
        step: Step,
        wave: u32,
        after: SmallVec<[StepId; 4]>,
        takes_back: Option<u32>,
        finishes: Option<u32>,
    ) -> StepId {
        let id = StepId::try_from(self.list.len()).expect("fewer steps than that");
        self.list.push(PlannedStep::bare(step, id, wave, after));
        self.takes_back.push(takes_back);
        self.finishes.push(finishes);
        id
    }
}

/// How a step goes back beside safe configurations.
pub(super) struct GoesBack<'t> {
    /// It came in after they had begun: what takes it back leads to what they have led to.
    pub late: bool,
    /// They have written the same since, or called it as well: nothing takes it back.
    pub stays: bool,
    /// What is still to be done for it.
    pub steps: &'t [Step],
}

impl GoesBack<'_> {
    /// What is done for one of its steps, where `view` is what the ones before have led to.
    pub fn instead_of(&self, back: &Step, heed: &mut Heed<'_>, view: &impl View) -> SmallVec<[Step; 2]> {
        match self.late {
            true => Heed::instead_of_late(back, view),
            false => heed.instead_of(back, view),
        }
    }
}

impl Transaction {
    /// The way back from where the forward list stands: for all that was done of parts from `part` on and was not taken back,
    /// latest first; then what is missing of the parts before.
    pub(super) fn way_back(&self, part: usize, live: &System) -> WayBack {
        let forward = &self.forward;
        let mut way = WayBack::default();
        let held = self.holds(part);
        if self.taken_down || held && part == 0 && !self.interrupted {
            return way;
        }
        let mut order = Backwards::of(&forward.list);
        // What a component that is made again does is known only then.
        let mut view = Overlay::new(live);
        let open = forward.done.iter().filter(|i| !self.taken_back.contains(i));
        let mut heed = Heed::new(&self.touched, open.map(|i| &forward.list[*i as usize].step));
        // What of a way back came in only when a safe configuration had written the same.
        for (step, undo, revision) in &self.late_back {
            // Those that were there when it was laid out have it as they want it.
            let Some(since) = self.touched_since.as_deref().filter(|since| since.has(step)) else { continue };
            if !since.knew(step, *revision) && !since.overwrote(step, *revision) {
                // What they want, and nothing else, may move for it.
                let goes = |back: &&Step| self.touched.wants_step(back) || !step::moves(back, live);
                for back in undo.steps().iter().filter(goes) {
                    if step::apply(back, &mut view).is_ok() {
                        way.add(back.clone(), 0, SmallVec::new(), None, None);
                        way.restores = true;
                    }
                }
            }
        }
        // A call that was given up and may have happened counts as done: its compensation takes it back. Of one that nobody
        // gave up it is not known, and stays so; where it may have moved, nothing goes back past it.
        let perhaps = self.perhaps_done();
        if !self.asked_back && !held {
            let moves =
                |i: &&u32| !self.may_move(**i) && self.steps_back(**i, part).iter().any(|back| step::moves(back, live));
            if let Some(i) = perhaps.iter().find(moves) {
                way.withheld = self.steps_back(*i, part).first().cloned();
                return way;
            }
        }
        let perhaps = perhaps.into_iter().filter(|_| self.asked_back).rev();
        'way: for i in perhaps.chain(forward.done.iter().rev().copied()) {
            if self.taken_back.contains(&i) || self.part_of(i) < part {
                continue;
            }
            let original = &forward.list[i as usize];
            let mut after = order.waits(i as usize);
            // What is held stays as it is, but for what safe configurations want of it.
            if held && !self.goes_all_the_same(i, part) {
                way.superseded.extend(self.is_theirs(i, part).then_some(i));
                order.leave(original, &after);
                continue;
            }
            let goes_back = self.goes_back(i, part, &self.touched, &mut heed);
            // Past what stays since it moves goes only what safe configurations want.
            let demanded =
                || goes_back.late && goes_back.steps.last().is_some_and(|back| self.touched.wants_step(back));
            if way.withheld.is_some() && !demanded() {
                order.leave(original, &after);
                continue;
            }
            let before = way.list.len();
            let mut left_out = goes_back.stays;
            for back in goes_back.steps {
                let goes = goes_back.instead_of(back, &mut heed, &view);
                left_out |= goes.is_empty();
                let last = goes.len().saturating_sub(1);
                for (at, back) in goes.into_iter().enumerate() {
                    // What came in late goes back where safe configurations want that; nothing else of it moves either.
                    let wanted = goes_back.late && at == last && self.touched.wants_step(&back);
                    if !wanted && !self.may_move(i) && step::moves(&back, &view) {
                        way.withheld.get_or_insert(back);
                        order.leave(original, &after);
                        continue 'way;
                    }
                    let _ = step::apply(&back, &mut view);
                    let id = way.add(back, order.wave(original), after, (at == last).then_some(i), None);
                    after = SmallVec::from_iter([id]);
                }
            }
            // What is left out of several steps back counts with the others.
            match way.list.len() == before {
                true if left_out => way.superseded.push(i),
                _ => way.left_out.extend(left_out.then_some(i)),
            }
            order.leave(original, &after);
        }
        if way.withheld.is_some() {
            return way;
        }
        if self.interrupted {
            self.bring_as_wanted(&mut view, &mut way);
        }
        if part > 0 {
            self.finish_before(part, live, &mut way);
        } else if let Some(origin) = self.origin.as_ref().filter(|_| self.interrupted) {
            self.undo_finished(origin, live, &mut way);
        }
        way
    }

    /// Calls of which nobody knows whether they happened, and that a compensation takes back.
    pub(super) fn perhaps_done(&self) -> Vec<u32> {
        let forward = &self.forward;
        let compensated = |i: &u32| {
            let planned = &forward.list[*i as usize];
            matches!((&planned.step, &planned.undo), (Step::Operation(_), Undo::One(Step::Operation(_))))
        };
        forward.unsettled.iter().copied().filter(compensated).collect()
    }

    /// Whether what was done of a part stays when it fails.
    fn holds(&self, part: usize) -> bool {
        self.planned.parts[part].on_failure == OnFailure::Hold && !self.asked_back
    }

    /// Whether a step that is held goes back all the same: it came in after a safe configuration had begun that wants it
    /// otherwise.
    fn goes_all_the_same(&self, i: u32, part: usize) -> bool {
        let overwritten = |revision| self.touched.overwrote(&self.forward_step(i).step, revision);
        self.late(i).is_some_and(|(_, revision)| !overwritten(revision)) && self.is_theirs(i, part)
    }

    /// Whether safe configurations have touched all that taking a step back would: it is theirs, and they restore it.
    fn is_theirs(&self, i: u32, part: usize) -> bool {
        let back = self.steps_back(i, part);
        self.interrupted && !back.is_empty() && back.iter().all(|back| self.touched.has(back))
    }

    fn forward_step(&self, i: u32) -> &PlannedStep {
        &self.forward.list[i as usize]
    }

    /// Whether the way back of a forward step may move.
    fn may_move(&self, i: u32) -> bool {
        self.asked_back || !self.interrupted && self.planned.parts[self.part_of(i)].on_failure == OnFailure::Rollback
    }

    /// The part of a step of the forward list.
    pub(super) fn part_of(&self, i: u32) -> usize {
        self.planned.part_of(self.planned.place(i as usize))
    }

    /// What takes back a step that came in after a safe configuration had begun, and the revision of the model it led to.
    fn late(&self, i: u32) -> Option<(&Undo, u64)> {
        self.late_beside(i, &self.touched)
    }

    /// The same beside what these safe configurations have touched.
    fn late_beside(&self, i: u32, touched: &Touched) -> Option<(&Undo, u64)> {
        let forward = &self.forward;
        let late = forward.late.iter().find(|late| late.step == i)?;
        let known = touched.knew(&forward.list[i as usize].step, late.revision);
        (!known).then_some((&late.undo, late.revision))
    }

    /// How a step of the forward list, the next on a way back, goes back beside what safe configurations have `touched`.
    pub(super) fn goes_back(&self, i: u32, part: usize, touched: &Touched, heed: &mut Heed<'_>) -> GoesBack<'_> {
        let step = self.forward_step(i);
        let late = self.late_beside(i, touched);
        if late.is_some() {
            heed.came_late(&step.step);
        }
        let overwritten = late.is_some_and(|(_, revision)| touched.overwrote(&step.step, revision));
        let stays = overwritten || self.is_kept(&step.step, touched);
        let undo = late.map_or_else(|| self.undo_of(i, part), |(undo, _)| undo).steps();
        let done = self.partly.get(&i).map_or(0, |done| *done.min(&undo.len()));
        GoesBack { late: late.is_some(), stays, steps: if stays { &[] } else { &undo[done..] } }
    }

    /// Whether a step stays: a call, whoever made it, since safe configurations that are in force, or that these were touched by, have made it too;
    /// and what takes back a frame whose place they have taken, or that would come back, unless they want it otherwise themselves.
    fn is_kept(&self, step: &Step, touched: &Touched) -> bool {
        let kept = |of| self.planned.kept.contains(of) || touched.calls.contains(of);
        let pops = |id: FrameId| self.planned.popped.iter().any(|popped| popped.id == id);
        matches!(step, Step::Operation(call) if kept(&call.operation))
            || absolute(step).is_none()
                && !touched.opposes(step)
                && touched.gone.iter().any(|(id, of)| of == step && pops(*id))
    }

    /// The steps that are still to be done to take a step of the forward list back.
    pub(super) fn steps_back(&self, i: u32, part: usize) -> &[Step] {
        if self.is_kept(&self.forward_step(i).step, &self.touched) {
            return &[];
        }
        let steps = self.late(i).map_or_else(|| self.undo_of(i, part), |(undo, _)| undo).steps();
        &steps[self.partly.get(&i).map_or(0, |done| *done.min(&steps.len()))..]
    }

    /// Whether some of the steps that take a step back were done.
    pub(super) fn is_partly_back(&self, i: u32) -> bool {
        self.partly.get(&i).is_some_and(|done| *done > 0)
    }

    /// What takes a step of the forward list back, to where the parts before `part` have led.
    pub(super) fn undo_of(&self, i: u32, part: usize) -> &Undo {
        let forward = &self.forward.list[i as usize];
        // The net was planned on the system before all of them.
        let Some(place) = self.planned.place(i as usize).filter(|_| part > 0 && !self.planned.whole.is_empty()) else {
            return &forward.undo;
        };
        let whole = self.whole();
        let Some(slot) = crate::system::touch::absolute(&forward.step) else { return &whole[place as usize].undo };
        // An earlier write of the same slot may have been left out of the net.
        let from = self.planned.parts[part].range.start as usize;
        let first = whole[from..].iter().find(|planned| crate::system::touch::absolute(&planned.step) == Some(slot));
        &first.unwrap_or(&whole[place as usize]).undo
    }

    /// Books what a way back has done. Answers whether something of it is left to be tried again.
    pub(super) fn took_back(&mut self, run: &StepsRun, way: &WayBack) -> bool {
        for i in &run.done {
            if let Some(Some(taken)) = way.takes_back.get(*i as usize) {
                *self.partly.entry(*taken).or_default() += 1;
                let of = |i: &u32| way.takes_back[*i as usize] == Some(*taken);
                let all = || {
                    way.left_out.contains(taken) && (0..way.list.len() as u32).filter(of).all(|i| run.done.contains(&i))
                };
                if all() || self.steps_back(*taken, self.failed_part()).is_empty() {
                    self.taken_back.insert(*taken);
                }
            }
            if let Some(Some(place)) = way.finishes.get(*i as usize) {
                // Interrupted, it takes back what it had finished.
                if self.interrupted {
                    self.finished.remove(place)
                } else {
                    self.finished.insert(*place)
                };
            }
        }
        self.late_back.extend(run.late.iter().map(|late| {
            let step = run.list[late.step as usize].step.clone();
            (step, late.undo.clone(), late.revision)
        }));
        self.unsettled.extend(run.unsettled.iter().map(|i| run.list[*i as usize].step.clone()));
        self.faulted.extend(run.faulted.iter().copied());
        self.doubted |= !run.failures.is_empty();
        let hopeless = |reason: &Reason| {
            matches!(reason, Reason::Step { cause: Cause::Timeout | Cause::Quarantined | Cause::Panicked(_), .. })
        };
        !whole(run) && run.unsettled.is_empty() && !run.failures.iter().any(|(_, reason)| hopeless(reason))
    }

    /// The system that the parts before `part` lead to, as the model knows it before anything is taken back; with what was
    /// done of `part` and later ones, where that is held.
    pub(super) fn led_to(&self, part: usize, live: &System) -> System {
        let forward = &self.forward;
        let mut system = self.before_all(live);
        let before = |place: &u32| self.planned.part_of(Some(*place)) < part;
        for (_, planned) in (0u32..).zip(self.whole()).take_while(|(place, _)| before(place)) {
            let _ = step::apply(&planned.step, &mut system);
        }
        if self.holds(part) {
            for i in forward.done.iter().filter(|i| self.part_of(**i) >= part) {
                let _ = step::apply(&forward.list[*i as usize].step, &mut system);
            }
        }
        system
    }

    /// The system before all parts, as the model knows it before anything is taken back.
    pub(super) fn before_all(&self, live: &System) -> System {
        let forward = &self.forward;
        let mut system = live.clone();
        for (component, state) in forward.faulted.iter().rev() {
            if system.component(*component).is_some_and(|node| node.state == RunState::Faulted) {
                system.set_state(*component, *state);
            }
        }
        // The net was planned on the system before all of them: its own inverses lead there.
        for i in forward.done.iter().rev() {
            for back in forward.list[*i as usize].undo.steps() {
                let _ = step::apply(back, &mut system);
            }
        }
        system
    }

    /// Steps of the forward list that were done and taken back.
    pub(super) fn taken_back_so_far(&self) -> impl Iterator<Item = (&PlannedStep, &Undo)> {
        let forward = &self.forward;
        let back = forward.done.iter().filter(|i| self.taken_back.contains(*i));
        back.map(|i| (&forward.list[*i as usize], &forward.list[*i as usize].undo))
    }

    /// Whether it has done anything that was not taken back, brought a component into a fault, or found one otherwise.
    pub fn did_anything(&self) -> bool {
        let forward = &self.forward;
        let faulted = forward.faulted.iter().chain(&self.faulted).next().is_some();
        self.origin.is_some() || self.mending.broke() || faulted || self.done_so_far().next().is_some()
    }

    /// Takes what it has done out of a picture of the system, but for what safe configurations that came before have
    /// `touched`: that is theirs, and is there already.
    pub fn take_out(&self, picture: &mut System, touched: &Touched) {
        let mut theirs = self.touched.clone();
        theirs.join(touched.clone());
        if let Some(origin) = &self.origin {
            for step in self.own_difference(picture, origin).iter().filter(|step| !theirs.has(step)) {
                let _ = step::apply(step, picture);
            }
            return;
        }
        let forward = &self.forward;
        self.put_back(picture, &theirs);
        let mut heed = Heed::new(&theirs, self.done_so_far().map(|(planned, _)| &planned.step));
        for i in forward.done.iter().rev().filter(|i| !self.taken_back.contains(i)) {
            let goes_back = self.goes_back(*i, 0, &theirs, &mut heed);
            for back in goes_back.steps {
                for back in goes_back.instead_of(back, &mut heed, &*picture) {
                    let _ = step::apply(&back, picture);
                }
            }
        }
    }

    /// The steps from one system to the other that are about its own components: what others have done meanwhile is theirs.
    pub(super) fn own_difference(&self, from: &System, to: &System) -> Vec<Step> {
        let own = self.own();
        let about = |step: &Step| components(step).iter().any(|component| own.contains(component));
        diff(from, to).into_iter().filter(about).collect()
    }

    /// Adds the way from where some parts stood and others were taken back to the system before all of them; nothing of it
    /// moves.
    fn undo_finished(&self, origin: &System, live: &System, way: &mut WayBack) {
        let wave = way.list.iter().map(|step| step.wave + 1).max().unwrap_or(0);
        let mut view = live.clone();
        for step in &way.list {
            let _ = step::apply(&step.step, &mut view);
        }
        let mut finished: Vec<u32> = self.finished.iter().copied().collect();
        finished.sort_unstable();
        let call = |place: &u32| {
            let planned = &self.whole()[*place as usize];
            let goes = matches!(planned.step, Step::Operation(_)) && !self.is_kept(&planned.step, &self.touched);
            let undo = goes.then(|| planned.undo.steps().first()).flatten();
            undo.map(|back| (Some(*place), back.clone()))
        };
        let calls: Vec<(Option<u32>, Step)> = finished.iter().rev().filter_map(call).collect();
        let rest = self.own_difference(&view, origin);
        let rest = rest.into_iter().filter(|back| !self.touched.has(back)).map(|back| (None, back));
        for (place, back) in calls.into_iter().chain(rest) {
            if step::moves(&back, &view) {
                way.withheld = Some(back);
                return;
            }
            let _ = step::apply(&back, &mut view);
            way.add_last(back, wave, place);
        }
    }

    /// Adds what is missing of the parts before `part`: they were to stand whatever comes after them. First their calls, with
    /// what these need; then whatever else differs.
    fn finish_before(&self, part: usize, live: &System, way: &mut WayBack) {
        let Some(between) = &self.between else { return };
        let forward = &self.forward;
        let mut done: FxHashSet<u32> = forward.done.iter().filter_map(|i| self.planned.place(*i as usize)).collect();
        done.extend(self.finished.iter().copied());
        let before = |place: &u32| self.planned.part_of(Some(*place)) < part;
        let open: Vec<(u32, &PlannedStep)> =
            (0u32..).zip(self.whole()).filter(|(place, _)| before(place) && !done.contains(place)).collect();
        let mut view = live.clone();
        for step in &way.list {
            let _ = step::apply(&step.step, &mut view);
        }
        let wave = way.list.iter().map(|step| step.wave + 1).max().unwrap_or(0);
        let first = way.list.len();
        let add = |way: &mut WayBack, step: Step, place: Option<u32>| {
            let last = way.list.len().checked_sub(1).filter(|_| way.list.len() > first);
            let after = last.and_then(|last| StepId::try_from(last).ok()).into_iter().collect();
            way.add(step, wave, after, None, place);
        };
        // A call needs what stands before it; without one, the difference is the shortest way.
        let last = open.iter().rposition(|(_, planned)| matches!(planned.step, Step::Operation(_)));
        for (place, planned) in open.iter().take(last.map_or(0, |at| at + 1)) {
            if step::apply(&planned.step, &mut view).is_ok() {
                add(way, planned.step.clone(), Some(*place));
            }
        }
        for step in self.own_difference(&view, between) {
            add(way, step, None);
        }
    }
}

/// Whether every step before and of a list was done.
pub(super) fn whole(run: &StepsRun) -> bool {
    run.done.len() == run.list.len()
}
