//! Taking back what steps did, simulated before anything happens.
//!
//! An inverse restores what was, as far as it can be: a component that has failed meanwhile is not brought back into the
//! fault, and is not started to be stopped; it goes from the fault to where the inverse wants it, at once.

use super::backwards::Backwards;
use super::footprint::{Saved, Slot};
use super::{PlanStage, PlannedStep, SavedValue, StepId};
use crate::model::{Call, ComponentName, Origin, Policy, RunState, Step, Transition, Wanted};
pub use crate::system::step::absolute;
use crate::system::touch::{components, slot};
use crate::system::{Overlay, System, Undo, View, Violation, is_so, step};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::collections::{BTreeMap, BTreeSet};

/// A step to be simulated, with what the planner must know of it beyond the step.
#[derive(Debug, Clone, PartialEq)]
pub struct DraftStep {
    /// The step.
    pub step: Step,
    /// The call that undoes it, where it is an operation's and one is known.
    pub call: Option<Call>,
    /// The policy of the connection it removes, where it is a disconnect and the policy is known.
    pub was: Option<Policy>,
    /// The stage of the configuration's step it is or undoes.
    pub stage: PlanStage,
    /// Where that was written.
    pub origin: Origin,
    /// Its place in the list it was taken from; means nothing to the planner.
    pub of: u32,
}

impl DraftStep {
    /// The place of what was taken from no list.
    pub const NOWHERE: u32 = u32::MAX;

    /// A planned step as an item.
    pub fn of(planned: &PlannedStep) -> Self {
        let (call, was) = match &planned.undo {
            Undo::One(Step::Operation(call)) => (Some(call.clone()), None),
            Undo::One(Step::Connect { policy, .. }) => (None, Some(*policy)),
            _ => (None, None),
        };
        Self { step: planned.step.clone(), call, was, stage: planned.stage, origin: planned.origin, of: planned.id }
    }

    /// A step of the inverse of `done`.
    #[inline]
    pub fn undoing(step: &Step, done: &PlannedStep) -> Self {
        let (call, was) = match &done.step {
            Step::Operation(call) => (Some(call.clone()), None),
            Step::Connect { policy, .. } => (None, Some(*policy)),
            _ => (None, None),
        };
        Self { step: step.clone(), call, was, stage: done.stage, origin: done.origin, of: Self::NOWHERE }
    }

    /// The call that it takes back, if it is the undo of one.
    pub fn takes_back_call(&self) -> Option<&Call> {
        self.call.as_ref().filter(|_| matches!(self.step, Step::Operation(_)))
    }

    /// What it takes back, where that may stay as it is while everything around it goes: an absolute write, a call.
    pub fn may_stay(&self) -> Option<Slot> {
        absolute(&self.step).or_else(|| self.takes_back_call().map(|call| Slot::Operation(call.operation)))
    }

    /// A step by itself.
    pub(crate) fn bare(step: Step, stage: PlanStage, origin: Origin) -> Self {
        Self { step, call: None, was: None, stage, origin, of: Self::NOWHERE }
    }
}

/// A list of steps in the making, each simulated when it is added.
#[derive(Debug)]
pub struct Script<'o, 's> {
    view: &'o mut Overlay<'s>,
    /// The steps so far.
    pub steps: Vec<PlannedStep>,
    /// The place that each step's item had in the list it was taken from.
    pub of: Vec<u32>,
    /// Where failed components are to go, once something needs them there.
    goals: BTreeMap<ComponentName, (Wanted, PlanStage, Origin)>,
    /// Components that were met failed. The order is then that of the list.
    failed: BTreeSet<ComponentName>,
    /// What concerns a component that is not there is left out: nothing of it is to be taken back. So is what is made, connected or disconnected
    /// already: what something safe had done may have gone with a component that was taken away under it.
    pub leaves_out_gone: bool,
}

impl<'o, 's> Script<'o, 's> {
    /// An empty list over `view`.
    pub fn new(view: &'o mut Overlay<'s>) -> Self {
        Self {
            view,
            steps: Vec::new(),
            of: Vec::new(),
            goals: BTreeMap::new(),
            failed: BTreeSet::new(),
            leaves_out_gone: false,
        }
    }

    /// The system after the steps so far.
    pub fn view(&self) -> &Overlay<'s> {
        self.view
    }

    /// Adds a step and answers its number; none when nothing needs to be done for it (an absolute write of the value
    /// that is there, a move of a failed component that may wait).
    ///
    /// # Errors
    /// The false preconditions.
    pub fn add(&mut self, item: DraftStep, wave: u32, after: &[StepId]) -> Result<Option<StepId>, Vec<Violation>> {
        let component = item.step.component();
        if self.leaves_out_gone {
            let gone = |name: &ComponentName| self.view.component(*name).is_none();
            let is_gone = !matches!(item.step, Step::Create { .. }) && components(&item.step).iter().any(gone);
            let is_made = matches!(item.step, Step::Create { .. } | Step::Connect { .. } | Step::Disconnect { .. });
            if is_gone || is_made && is_so(&item.step, self.view) {
                return Ok(None);
            }
        }
        if absolute(&item.step).is_some() && is_so(&item.step, self.view) {
            return Ok(None);
        }
        match &item.step {
            Step::State { transition, .. } => {
                let state = self.view.component(component).map(|n| n.state);
                // Cleaned up after a fault, and that taken back: a fault is never restored, so it is down here.
                let cleaned = state == Some(RunState::Unconfigured) && *transition != Transition::Configure;
                if state == Some(RunState::Faulted) || cleaned || self.failed.contains(&component) {
                    self.failed.insert(component);
                    self.goals.insert(component, (transition.wanted(), item.stage, item.origin));
                    return Ok(None);
                }
            }
            // A failed component may be destroyed as it is.
            Step::Destroy { .. } => {
                let state = self.view.component(component).map(|n| n.state);
                if matches!(state, Some(RunState::Faulted | RunState::Unconfigured)) {
                    self.goals.remove(&component);
                } else {
                    self.settle(component, wave)?;
                }
            }
            // These depend on run states; connections, and what is written to ports, do not.
            Step::PropertySet { .. } | Step::Operation(_) => {
                self.settle(component, wave)?;
                self.clear_fault(&item, wave)?;
            }
            _ => {}
        }
        self.push(item, wave, after).map(Some)
    }

    /// Adds a step of what is left of something that was taken back in part. What is so already, whoever did it, is not left any more;
    /// and what had brought its component to where a property may be set may be gone without it, so that is done for it and taken
    /// back.
    ///
    /// # Errors
    /// The false preconditions.
    pub fn add_left(&mut self, item: DraftStep, wave: u32, after: &[StepId]) -> Result<Option<StepId>, Vec<Violation>> {
        let Step::PropertySet { property, value } = &item.step else {
            let failed = self.failed.contains(&item.step.component());
            return if !failed && is_so(&item.step, self.view) { Ok(None) } else { self.add(item, wave, after) };
        };
        let component = property.component;
        let Some(node) = self.view.component(component) else { return self.add(item, wave, after) };
        let (state, declared) = (node.state, node.property(property.member).map(|(_, declared)| declared.tunable));
        let lower = [Wanted::Stopped, Wanted::Unconfigured];
        let goal = lower.into_iter().find(|goal| declared.is_some_and(|tunable| tunable.allows((*goal).into())));
        let (Some(goal), Some(back)) = (goal, state.wanted()) else { return self.add(item, wave, after) };
        if declared.is_none_or(|tunable| tunable.allows(state)) || node.value(property.member) == Some(value) {
            return self.add(item, wave, after);
        }
        let (stage, origin) = (item.stage, item.origin);
        let go = |script: &mut Self, from: RunState, to: Wanted, after: &[StepId]| {
            let mut last: SmallVec<[StepId; 1]> = SmallVec::from_slice(after);
            for transition in from.path_to(to) {
                let step = Step::State { component, transition: *transition };
                last = SmallVec::from_elem(script.push(DraftStep::bare(step, stage, origin), wave, &last)?, 1);
            }
            Ok::<_, Vec<Violation>>(last)
        };
        let down = go(self, state, goal, after)?;
        let Some(id) = self.add(item, wave, &down)? else { return Ok(None) };
        Ok(go(self, goal.into(), back, &[id])?.last().copied())
    }

    /// Brings a failed component to where it is to be.
    fn settle(&mut self, component: ComponentName, wave: u32) -> Result<(), Vec<Violation>> {
        let Some((goal, stage, origin)) = self.goals.remove(&component) else { return Ok(()) };
        let state = self.view.component(component).map_or(goal.into(), |n| n.state);
        for transition in state.path_to(goal) {
            let step = Step::State { component, transition: *transition };
            self.push(DraftStep::bare(step, stage, origin), wave, &[])?;
        }
        Ok(())
    }

    /// Cleans a failed component up when a property can be set only then.
    fn clear_fault(&mut self, item: &DraftStep, wave: u32) -> Result<(), Vec<Violation>> {
        let Step::PropertySet { property, .. } = &item.step else { return Ok(()) };
        let component = property.component;
        let Some(node) = self.view.component(component) else { return Ok(()) };
        let allowed = node.property(property.member).is_none_or(|(_, p)| p.tunable.allows(RunState::Faulted));
        if node.state == RunState::Faulted && !allowed {
            self.failed.insert(component);
            let step = Step::State { component, transition: Transition::Cleanup };
            self.push(DraftStep::bare(step, item.stage, item.origin), wave, &[])?;
        }
        Ok(())
    }

    fn push(&mut self, item: DraftStep, wave: u32, after: &[StepId]) -> Result<StepId, Vec<Violation>> {
        let found = step::precondition(&item.step, self.view);
        if !found.is_empty() {
            return Err(found);
        }
        let undo = step::inverse(&item.step, item.call.as_ref(), self.view);
        let (moves, undo_moves) = (step::moves(&item.step, self.view), step::undo_moves(&undo, self.view));
        step::effect(&item.step, self.view);
        let id = StepId::try_from(self.steps.len()).expect("fewer steps than that");
        self.of.push(item.of);
        self.steps.push(PlannedStep {
            id,
            stage: item.stage,
            wave,
            after: SmallVec::from_slice(after),
            reversibility: step::reversibility(&item.step, &undo),
            undo,
            moves,
            undo_moves,
            step: item.step,
            origin: item.origin,
        });
        Ok(id)
    }

    /// Adds an unplanned step after all others (each already simulated elsewhere), numbers and waves moved behind.
    pub(crate) fn append(&mut self, planned: impl IntoIterator<Item = PlannedStep>) {
        let base = self.next_id();
        let wave = self.next_wave();
        let planned = planned.into_iter();
        self.steps.reserve(planned.size_hint().0);
        for mut step in planned {
            step.id += base;
            step.wave += wave;
            step.after.iter_mut().for_each(|id| *id += base);
            self.of.push(DraftStep::NOWHERE);
            self.steps.push(step);
        }
    }

    pub(crate) fn view_mut(&mut self) -> &mut Overlay<'s> {
        self.view
    }

    fn next_id(&self) -> StepId {
        StepId::try_from(self.steps.len()).expect("fewer steps than that")
    }

    pub(crate) fn next_wave(&self) -> u32 {
        self.steps.last().map_or(0, |s| s.wave + 1)
    }

    /// Ends the list: failed components go to where they are to be.
    ///
    /// # Errors
    /// The false preconditions.
    pub fn finish(self) -> Result<Vec<PlannedStep>, Vec<Violation>> {
        self.finish_placed().map(|(steps, _)| steps)
    }

    /// The same, with the place of each step's item.
    ///
    /// # Errors
    /// The false preconditions.
    pub fn finish_placed(mut self) -> Result<(Vec<PlannedStep>, Vec<u32>), Vec<Violation>> {
        self.settle_all()?;
        if !self.failed.is_empty() {
            for i in 0..self.steps.len() {
                self.steps[i].after = i.checked_sub(1).map(|p| self.steps[p].id).into_iter().collect();
            }
        }
        Ok((self.steps, self.of))
    }

    /// Brings every failed component to where it is to be.
    ///
    /// # Errors
    /// The false preconditions.
    pub(crate) fn settle_all(&mut self) -> Result<(), Vec<Violation>> {
        let wave = self.steps.last().map_or(0, |s| s.wave);
        while let Some(component) = self.goals.keys().next().copied() {
            self.settle(component, wave)?;
        }
        Ok(())
    }
}

/// The steps that undo `steps` on the system they led to, last first, with as much room for parallel work as the steps
/// themselves had. `saved` has the values of absolute writes; those in slots for which `skip` is true stay as they are, and so
/// do calls of such operations.
///
/// # Errors
/// The false preconditions, where the system is not as the steps left it.
pub fn undo(
    script: &mut Script<'_, '_>,
    steps: &[PlannedStep],
    saved: &[SavedValue],
    skip: &dyn Fn(Slot) -> bool,
) -> Result<(), Vec<Violation>> {
    let first_wave = script.next_wave();
    script.steps.reserve(steps.len());
    script.of.reserve(steps.len());
    let count = |kind: fn(&Step) -> bool| steps.iter().filter(|done| kind(&done.step)).count();
    let made = count(|step| matches!(step, Step::Create { .. }));
    let connected = count(|step| matches!(step, Step::Connect { .. }));
    if made + connected > 64 {
        script.view.reserve(made, connected);
    }
    let mut back = Backwards::of(steps);
    let by_slot: FxHashMap<Slot, &SavedValue> = saved.iter().filter(|s| s.step).map(|s| (s.slot, s)).collect();
    let mut unwritten: Vec<&SavedValue> = saved.iter().filter(|s| !s.step).collect();
    unwritten.sort_by_key(|s| s.at);
    for (i, done) in steps.iter().enumerate().rev() {
        let wave = first_wave + back.wave(done);
        while unwritten.last().is_some_and(|s| s.at as usize > i) {
            restore(script, unwritten.pop().expect("it was just seen"), skip, wave)?;
        }
        let mut last = back.waits(i);
        if !skip(slot(&done.step)) {
            let kept = absolute(&done.step).and_then(|slot| by_slot.get(&slot)).and_then(|s| restoring(s));
            let steps = kept.as_ref().map_or_else(|| done.undo.steps(), std::slice::from_ref);
            for step in steps {
                if let Some(id) = script.add(DraftStep::undoing(step, done), wave, &last)? {
                    last = SmallVec::from_slice(&[id]);
                }
            }
        }
        back.leave(done, &last);
    }
    let wave = first_wave + back.waves();
    while let Some(entry) = unwritten.pop() {
        restore(script, entry, skip, wave)?;
    }
    script.settle_all()
}

fn restore(
    script: &mut Script<'_, '_>,
    saved: &SavedValue,
    skip: &dyn Fn(Slot) -> bool,
    wave: u32,
) -> Result<(), Vec<Violation>> {
    if let (false, Some(step)) = (skip(saved.slot), restoring(saved)) {
        script.add(DraftStep::bare(step, PlanStage::Changes, Origin::NONE), wave, &[])?;
    }
    Ok(())
}

/// The same steps as a plain list, last first, every absolute write of `saved` among them (also those that restore what
/// is there anyway).
pub fn items(steps: &[PlannedStep], saved: &[SavedValue]) -> Vec<DraftStep> {
    let by_slot: FxHashMap<Slot, &SavedValue> = saved.iter().filter(|s| s.step).map(|s| (s.slot, s)).collect();
    let mut unwritten: Vec<&SavedValue> = saved.iter().filter(|s| !s.step).collect();
    unwritten.sort_by_key(|s| s.at);
    let mut list = Vec::with_capacity(steps.len() + unwritten.len());
    let plain =
        |saved: &SavedValue| restoring(saved).map(|step| DraftStep::bare(step, PlanStage::Changes, Origin::NONE));
    for (i, done) in steps.iter().enumerate().rev() {
        while unwritten.last().is_some_and(|s| s.at as usize > i) {
            list.extend(unwritten.pop().and_then(plain));
        }
        let kept = absolute(&done.step).and_then(|slot| by_slot.get(&slot)).and_then(|s| restoring(s));
        let steps = kept.as_ref().map_or_else(|| done.undo.steps(), std::slice::from_ref);
        list.extend(steps.iter().map(|step| DraftStep::undoing(step, done)));
    }
    list.extend(unwritten.into_iter().rev().filter_map(plain));
    list
}

/// The step that restores a saved value.
pub fn restoring(saved: &SavedValue) -> Option<Step> {
    match (saved.slot, &saved.value) {
        (Slot::Property(property), Saved::Property(value)) => {
            Some(Step::PropertySet { property, value: value.clone() })
        }
        (Slot::Port(port), Saved::Port(value)) => Some(Step::PortWrite { port, value: value.clone() }),
        _ => None,
    }
}

/// A list of steps in that order, simulated: what executes a `system::diff`.
///
/// # Errors
/// The false preconditions of the first step that has any.
pub fn in_order(system: &System, steps: Vec<Step>) -> Result<Vec<PlannedStep>, Vec<Violation>> {
    let mut view = Overlay::new(system);
    let mut script = Script::new(&mut view);
    for step in steps {
        let after: SmallVec<[StepId; 1]> = script.steps.last().map(|s| s.id).into_iter().collect();
        let item = DraftStep::bare(step, PlanStage::Changes, Origin::NONE);
        // Not through `add`: a difference knows what it does with failed components.
        script.push(item, 0, &after)?;
    }
    Ok(script.steps)
}
