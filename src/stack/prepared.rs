//! Prepared switches: what the planner made of a fixed configuration, kept to be carried out again (semantics: *Requests*).
//!
//! A [`Switch`] is a frame that was planned in the ordinary way, with all that decided its steps: which components there
//! were and in which run states, that nothing drove the ports, and which demands were true already. While that is so,
//! planning again could only give the same steps, and all that is new are the values they overwrite. Otherwise the
//! configuration is planned anew. The steps are resolved to handles, and go through the same gate as any other.

use super::share::components;
use super::{Frame, FrameId, Inverse, Planned, Requester, Scope, Stack};
use crate::model::{ComponentName, Configuration, RunState, Step, Target, Transition, Value};
use crate::plan::footprint::{Saved, Slot};
use crate::plan::undo::absolute;
use crate::plan::{PlannedStep, SavedValue};
use crate::system::{SlotHandle, System, Undo, View};
use crate::time::Time;
use petgraph::stable_graph::NodeIndex;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A component that a plan touches: which one it was, and its run state before the plan and after it.
#[derive(Debug, Clone, Copy)]
struct TouchedComponent {
    at: NodeIndex,
    born: u64,
    before: RunState,
    after: RunState,
}

/// The plan of a fixed configuration.
#[derive(Debug, Clone)]
pub struct Switch {
    /// The frame that it leads to. In force, it is the very one on the stack: whatever changes a frame there leaves this one
    /// as it is, and it is not found there any more.
    frame: Arc<Frame>,
    seen: Vec<TouchedComponent>,
    /// Where its steps are done.
    places: Vec<SlotHandle>,
    /// Where its saved values are.
    slots: Vec<SlotHandle>,
}

/// A step that is done next, resolved.
#[derive(Debug, Clone, Copy)]
pub struct ResolvedStep<'s> {
    /// The step.
    pub step: &'s Step,
    /// Where it is done.
    pub place: SlotHandle,
    /// Its number in the [universe](Switch::universe).
    pub index: usize,
    /// The value that replaces that step's own.
    pub value: Option<&'s Value>,
}

/// Whether a step takes or gives back what a component holds for itself: who else needs that is another matter each time.
fn holds(step: &Step, system: &System) -> bool {
    let Step::State { component, transition: Transition::Configure | Transition::Cleanup } = step else { return false };
    system.component(*component).is_some_and(|node| !node.ty.exclusive.is_empty())
}

impl Switch {
    /// Keeps what was planned on `system` for `configuration` alone. None: it is no fixed switch (it creates, destroys,
    /// connects, disconnects, calls operations, uses `_default`, has to wait for what it stands for), it moves hardware, or
    /// something is to be undone for it.
    pub fn new(system: &System, configuration: &Configuration, planned: &Planned) -> Option<Self> {
        let [part] = &planned.parts[..] else { return None };
        let frame = part.edits.push.clone()?;
        let mut lists = configuration.pre.iter().chain(configuration.post.iter());
        if !part.edits.pops.is_empty()
            || planned.revision != system.revision()
            || configuration.holds.is_some()
            || lists.any(|entry| entry.target == Target::Default)
            || !frame.steps().iter().all(is_fixed)
            || frame.steps().iter().any(|planned| holds(&planned.step, system))
        {
            return None;
        }
        let mut moved: BTreeMap<ComponentName, RunState> = BTreeMap::new();
        for planned in frame.steps() {
            if let Step::State { component, transition } = planned.step {
                moved.insert(component, transition.target());
            }
        }
        let see = |name| {
            let at = system.index_of(name)?;
            let node = system.node_at(at).filter(|node| node.state != RunState::Faulted)?;
            let after = moved.get(&name).copied().unwrap_or(node.state);
            Some(TouchedComponent { at, born: node.born, before: node.state, after })
        };
        let seen = components(&frame.footprint).into_iter().map(see).collect::<Option<_>>()?;
        let place = |planned: &PlannedStep| {
            SlotHandle::of(absolute(&planned.step).unwrap_or(Slot::State(planned.step.component())), system)
        };
        let places = frame.steps().iter().map(place).collect::<Option<_>>()?;
        let slots = frame.saved.iter().map(|saved| SlotHandle::of(saved.slot, system)).collect::<Option<_>>()?;
        Some(Self { frame, seen, places, slots })
    }

    /// The frame that it leads to.
    pub fn frame(&self) -> &Arc<Frame> {
        &self.frame
    }

    /// Every step that it or its undo may need: what a platform prepares. [`Self::step`] numbers them.
    pub fn universe(&self) -> Vec<Step> {
        let both = |planned: &PlannedStep| {
            let mut back = backwards(planned).step;
            if let Step::PortWrite { value, .. } = &mut back {
                // What is given with it counts, or that it was never written.
                *value = None;
            }
            [planned.step.clone(), back]
        };
        self.frame.steps().iter().flat_map(both).collect()
    }

    /// The step that is done as the `nth` when it is applied or undone.
    pub fn step(&self, nth: usize, undoing: bool) -> Option<ResolvedStep<'_>> {
        let steps = self.frame.steps();
        let at = if undoing { steps.len().checked_sub(nth + 1)? } else { nth };
        let planned = steps.get(at)?;
        let step = if undoing { planned.undo.steps().first()? } else { &planned.step };
        Some(ResolvedStep { step, place: self.places[at], index: 2 * at + usize::from(undoing), value: written(step) })
    }

    /// Whether planning it on `system` would give these steps; `undoing`: whether `system` is as they left it.
    pub fn fits(&self, system: &System, undoing: bool) -> bool {
        let as_seen = |seen: &TouchedComponent| {
            let state = if undoing { seen.after } else { seen.before };
            system.node_at(seen.at).is_some_and(|node| node.born == seen.born && node.state == state)
        };
        let as_saved = |(saved, place): (&SavedValue, &SlotHandle)| {
            let held = place.held(saved.slot, system);
            let there = match &saved.value {
                _ if saved.step => held == written(&self.frame.steps()[saved.at as usize].step),
                // A demand that was true: what was there is what is wanted.
                Saved::Property(value) => held == Some(value),
                Saved::Port(value) => held == value.as_ref(),
            };
            let driven = matches!(saved.slot, Slot::Port(port) if system.driven(port).links > 0);
            there == (undoing || !saved.step) && !driven
        };
        self.seen.iter().all(as_seen) && self.frame.saved.iter().zip(&self.slots).all(as_saved)
    }

    /// Makes its frame ready for another application, with the values that are about to be overwritten. False: it does not
    /// fit. Allocates nothing, unless the frame is in force.
    pub fn ready(&mut self, system: &System, requester: Requester, at: Time, scope: Option<Scope>) -> bool {
        if !self.fits(system, false) {
            return false;
        }
        let frame = Arc::make_mut(&mut self.frame);
        (frame.id, frame.requester, frame.at) = (FrameId(u64::MAX), requester, at);
        (frame.scope, frame.left) = (scope, false);
        let Inverse::Steps(steps) = &mut frame.inverse else { return false };
        // Once it was applied this way they are its own.
        let steps = Arc::make_mut(steps);
        for (saved, place) in frame.saved.iter_mut().zip(&self.slots).filter(|(saved, _)| saved.step) {
            let held = place.held(saved.slot, system);
            match (&mut saved.value, &mut steps[saved.at as usize].undo) {
                (Saved::Property(old), Undo::One(Step::PropertySet { value, .. })) => {
                    let Some(held) = held else { return false };
                    old.clone_from(held);
                    value.clone_from(held);
                }
                (Saved::Port(old), Undo::One(Step::PortWrite { value, .. })) => {
                    put(old, held);
                    put(value, held);
                }
                _ => return false,
            }
        }
        true
    }

    /// All steps of its application or its undo, one after the other.
    pub fn list(&self, undoing: bool) -> Vec<PlannedStep> {
        let steps = self.frame.steps();
        let mut list: Vec<PlannedStep> =
            if undoing { steps.iter().rev().map(backwards).collect() } else { steps.to_vec() };
        for (id, step) in (0u32..).zip(&mut list) {
            (step.id, step.wave, step.after) = (id, 0, id.checked_sub(1).into_iter().collect());
        }
        list
    }
}

impl Stack {
    /// Whether a switch can be pushed as it is, for who asks: no frame of its group must be replaced, none be squashed for it, and there is
    /// memory for it.
    /// Otherwise its configuration is pushed by an ordinary transaction.
    pub fn takes(&self, switch: &Switch, by: Requester) -> bool {
        let group = switch.frame.group;
        self.frames.len() < self.frames.capacity()
            && self.has_room(by, 1)
            && (group.is_none()
                || self.frames.iter().all(|f| f.group != group && f.parts.iter().all(|p| p.group != group)))
    }

    /// Pushes the frame of a switch that was [ready](Switch::ready) and is done. [`Stack::takes`] was asked before.
    pub fn push_switch(&mut self, switch: &mut Switch) -> FrameId {
        let id = FrameId(self.next);
        self.next += 1;
        Arc::make_mut(&mut switch.frame).id = id;
        self.frames.push(switch.frame.clone());
        id
    }

    /// Whether the top is the frame of that switch, as it was pushed.
    pub fn is_top(&self, switch: &Switch) -> bool {
        self.frames.last().is_some_and(|top| Arc::ptr_eq(top, &switch.frame))
    }

    /// Pops the top, the frame of a switch whose undo is done.
    pub fn pop_switch(&mut self) {
        self.frames.pop();
    }
}

/// Whether a step may be carried out again and taken back without being planned.
fn is_fixed(planned: &PlannedStep) -> bool {
    matches!(planned.step, Step::State { .. } | Step::PropertySet { .. } | Step::PortWrite { .. })
        && matches!(planned.undo, Undo::One(_))
        && !planned.moves
        && !planned.undo_moves
}

/// The value that a step writes.
fn written(step: &Step) -> Option<&Value> {
    match step {
        Step::PropertySet { value, .. } => Some(value),
        Step::PortWrite { value, .. } => value.as_ref(),
        _ => None,
    }
}

/// What undoes a fixed step, as a planned step.
fn backwards(planned: &PlannedStep) -> PlannedStep {
    let mut back = planned.clone();
    if let Undo::One(undo) = &mut back.undo {
        std::mem::swap(undo, &mut back.step);
    }
    back
}

/// Writes into memory that is there.
fn put(to: &mut Option<Value>, value: Option<&Value>) {
    match (to, value) {
        (Some(to), Some(value)) => to.clone_from(value),
        (to, value) => *to = value.cloned(),
    }
}
