//! The way back: what was done is taken back latest first, as far as nothing moves that nobody asked to move; what stands
//! before the failure is finished.

use super::Transaction;
use super::run::Run;
use crate::model::{Cause, ComponentName, OnFailure, Origin, RunState, Step};
use crate::plan::{PlannedStep, Stage, StepId};
use crate::stack::Reason;
use crate::system::touch::{Slot, components};
use crate::system::{Overlay, Reversibility, System, Undo, View as _, diff, step};
use rustc_hash::FxHashSet;
use smallvec::SmallVec;

/// What safe configurations touched: the way back of what they interrupted leaves that alone.
#[derive(Debug, Clone, Default)]
pub struct Touched {
    slots: FxHashSet<Slot>,
    /// Components of which anything was touched.
    components: FxHashSet<ComponentName>,
}

fn slot(step: &Step) -> Slot {
    match step {
        Step::State { component, .. } => Slot::State(*component),
        Step::Create { component, .. } | Step::Destroy { component } => Slot::Component(*component),
        Step::Connect { from, to, .. } | Step::Disconnect { from, to } => Slot::Link(*from, *to),
        Step::PropertySet { property, .. } => Slot::Property(*property),
        Step::PortWrite { port, .. } => Slot::Port(*port),
        Step::Operation(call) => Slot::Operation(call.operation),
    }
}

impl Touched {
    /// `step` was done, or what it leads to was demanded.
    pub fn add(&mut self, step: &Step) {
        self.slots.insert(slot(step));
        self.components.extend(components(step));
    }

    /// The run state of `component` was demanded.
    pub fn add_state(&mut self, component: ComponentName) {
        self.slots.insert(Slot::State(component));
        self.components.insert(component);
    }

    /// Takes `other` in.
    pub fn join(&mut self, other: Self) {
        self.slots.extend(other.slots);
        self.components.extend(other.components);
    }

    /// Whether `step` would change something touched.
    pub fn has(&self, step: &Step) -> bool {
        match step {
            Step::Create { component, .. } | Step::Destroy { component } => self.components.contains(component),
            other => self.slots.contains(&slot(other)),
        }
    }
}

/// A step that stands alone in its wave and before which so many others stand.
fn item(step: Step, id: StepId, wave: u32, after: SmallVec<[StepId; 4]>) -> PlannedStep {
    PlannedStep {
        id,
        stage: Stage::Changes,
        wave,
        after,
        step,
        reversibility: Reversibility::Exact,
        undo: Undo::Nothing,
        moves: false,
        undo_moves: false,
        origin: Origin::NONE,
    }
}

/// Steps one after the other.
pub(super) fn chain(steps: impl IntoIterator<Item = Step>) -> Vec<PlannedStep> {
    let mut list = Vec::new();
    for (id, step) in (0..).zip(steps) {
        let before: Option<StepId> = StepId::checked_sub(id, 1);
        list.push(item(step, id, 0, before.into_iter().collect()));
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
}

impl Transaction {
    /// The way back from where the forward list stands: for all that was done of parts from `part` on and was not taken back,
    /// latest first; then what is missing of the parts before.
    pub(super) fn way_back(&self, part: usize, live: &System) -> WayBack {
        let forward = self.forward.as_ref().expect("something was carried out");
        let mut way = WayBack::default();
        let held = self.holds(part);
        if self.taken_down || held && part == 0 {
            return way;
        }
        let mut ends: Vec<SmallVec<[u32; 4]>> = vec![SmallVec::new(); forward.list.len()];
        let mut followers: Vec<SmallVec<[u32; 4]>> = vec![SmallVec::new(); forward.list.len()];
        for (i, step) in (0..).zip(&forward.list) {
            for before in &step.after {
                followers[*before as usize].push(i);
            }
        }
        // What a component that is made again does is known only then.
        let mut view = Overlay::new(live);
        let waves = forward.list.iter().map(|step| step.wave).max().unwrap_or(0);
        // A call that was given up and may have happened counts as done: its compensation takes it back. Of one that nobody
        // gave up it is not known, and stays so; where it may have moved, nothing goes back past it.
        let perhaps = self.perhaps_done();
        if !self.asked_back {
            let moves =
                |i: &&u32| !self.may_move(**i) && self.steps_back(**i, part).iter().any(|back| step::moves(back, live));
            if let Some(i) = perhaps.iter().find(moves) {
                way.withheld = self.steps_back(*i, part).first().cloned();
                return way;
            }
        }
        let perhaps = perhaps.into_iter().filter(|_| self.asked_back).rev();
        for i in perhaps.chain(forward.done.iter().rev().copied()) {
            if held || self.taken_back.contains(&i) || self.part_of(i) < part {
                continue;
            }
            let late = self.late(i).is_some();
            let original = &forward.list[i as usize];
            let mut after: SmallVec<[u32; 4]> =
                followers[i as usize].iter().flat_map(|f| ends[*f as usize].clone()).collect();
            after.sort_unstable();
            after.dedup();
            for back in self.steps_back(i, part) {
                let touched = !late && self.touched.has(back);
                if !late && !self.may_move(i) && step::moves(back, &view) {
                    way.withheld = Some(back.clone());
                    return way;
                }
                if touched {
                    way.superseded.push(i);
                    continue;
                }
                let _ = step::apply(back, &mut view);
                let id = way.list.len() as u32;
                way.list.push(item(back.clone(), id, waves - original.wave, after));
                way.takes_back.push(Some(i));
                way.finishes.push(None);
                after = SmallVec::from_iter([id]);
            }
            ends[i as usize] = after;
        }
        if part > 0 {
            self.finish_before(part, live, &mut way);
        }
        way
    }

    /// Calls of which nobody knows whether they happened, and that a compensation takes back.
    pub(super) fn perhaps_done(&self) -> Vec<u32> {
        let forward = self.forward.as_ref().expect("something was carried out");
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

    /// Whether the way back of a forward step may move.
    fn may_move(&self, i: u32) -> bool {
        self.asked_back || !self.interrupted && self.planned.parts[self.part_of(i)].on_failure == OnFailure::Rollback
    }

    /// The part of a step of the forward list.
    pub(super) fn part_of(&self, i: u32) -> usize {
        self.planned.part_of(self.planned.place(i as usize))
    }

    /// What takes back a step that came in after the transaction was to stop.
    fn late(&self, i: u32) -> Option<&Undo> {
        let forward = self.forward.as_ref().expect("something was carried out");
        forward.late.iter().find(|(late, _)| *late == i).map(|(_, undo)| undo)
    }

    /// The steps that are still to be done to take a step of the forward list back.
    pub(super) fn steps_back(&self, i: u32, part: usize) -> &[Step] {
        let steps = self.late(i).unwrap_or_else(|| self.undo_of(i, part)).steps();
        &steps[self.partly.get(&i).map_or(0, |done| *done.min(&steps.len()))..]
    }

    /// Whether some of the steps that take a step back were done.
    pub(super) fn is_partly_back(&self, i: u32) -> bool {
        self.partly.get(&i).is_some_and(|done| *done > 0)
    }

    /// What takes a step of the forward list back, to where the parts before `part` have led.
    pub(super) fn undo_of(&self, i: u32, part: usize) -> &Undo {
        let forward = &self.forward.as_ref().expect("something was carried out").list[i as usize];
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
    pub(super) fn took_back(&mut self, run: &Run, way: &WayBack) -> bool {
        for i in &run.done {
            if let Some(Some(taken)) = way.takes_back.get(*i as usize) {
                *self.partly.entry(*taken).or_default() += 1;
                if self.steps_back(*taken, self.failed_part()).is_empty() {
                    self.taken_back.insert(*taken);
                }
            }
            if let Some(Some(place)) = way.finishes.get(*i as usize) {
                self.finished.insert(*place);
            }
        }
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
        let forward = self.forward.as_ref().expect("something was carried out");
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

    /// Adds what is missing of the parts before `part`: they were to stand whatever comes after them. First their calls, with
    /// what these need; then whatever else differs.
    fn finish_before(&self, part: usize, live: &System, way: &mut WayBack) {
        let Some(between) = &self.between else { return };
        let forward = self.forward.as_ref().expect("something was carried out");
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
            let id = StepId::try_from(way.list.len()).expect("fewer steps than that");
            let after = id.checked_sub(1).filter(|_| way.list.len() > first).into_iter().collect();
            way.list.push(item(step, id, wave, after));
            way.takes_back.push(None);
            way.finishes.push(place);
        };
        // A call needs what stands before it; without one, the difference is the shortest way.
        let last = open.iter().rposition(|(_, planned)| matches!(planned.step, Step::Operation(_)));
        for (place, planned) in open.iter().take(last.map_or(0, |at| at + 1)) {
            if step::apply(&planned.step, &mut view).is_ok() {
                add(way, planned.step.clone(), Some(*place));
            }
        }
        for step in diff(&view, between) {
            add(way, step, None);
        }
    }
}

/// Whether every step before and of a list was done.
pub(super) fn whole(run: &Run) -> bool {
    run.done.len() == run.list.len()
}
