//! What an emergency leads back to: the system before the first of the safe configurations that are not all taken back yet.
//!
//! Each of them takes itself back, whatever it has interrupted and in whatever order several of them came, failed, were late and were let
//! go of. What all that comes to is held against the picture of before.

use super::{Frame, Inverse, Op, Stack, transaction};
use crate::model::{RunState, Step};
use crate::plan::footprint::{Footprint, Saved, Slot};
use crate::plan::undo::{DraftStep, in_order};
use crate::plan::{PlanContext, PlannedStep};
use crate::system::{self, Overlay, System, View as _, step, touch};
use std::sync::Arc;

/// The system before an emergency, and what was in force.
#[derive(Debug, Clone)]
pub struct BeforeEmergency {
    frames: Vec<Arc<Frame>>,
    system: System,
}

impl BeforeEmergency {
    /// As it is now; `system` is without what the emergency interrupts.
    pub fn new(stack: &Stack, system: System) -> Self {
        Self { frames: stack.frames().to_vec(), system }
    }

    /// The picture of that time without the newest frames that are not in force any more. None: something came since. What that has found
    /// as it wants it, it has not done, and keeps all the same: nothing is known of what is to be there.
    pub fn wanted(&self, stack: &Stack) -> Option<System> {
        let (frames, now) = (&self.frames, stack.frames());
        let is_same = now.len() <= frames.len() && now.iter().zip(frames).all(|(now, before)| now.id == before.id);
        let gone = frames.get(now.len()..).filter(|_| is_same)?;
        let mut system = self.system.clone();
        let mut go = |step: &Step| step::apply(step, &mut system).ok().map(drop);
        for frame in gone.iter().rev() {
            items(frame).iter().try_for_each(|item| go(&item.step))?;
        }
        Some(system)
    }

    /// The only safe configuration that is left of the emergency, the newest frame of all, as it leads back to there. None: it is not the only
    /// one, or does so already.
    pub fn leading_back(&self, system: &System, stack: &Stack, context: &PlanContext) -> Option<Frame> {
        let (frame, below) = stack.frames().split_last()?;
        let is_same = below.len() == self.frames.len() && below.iter().zip(&self.frames).all(|(a, b)| a.id == b.id);
        if !frame.safe || frame.partial || !is_same {
            return None;
        }
        let led = transaction(system, stack, &[Op::Undo(frame.id)], context).ok().and_then(|planned| {
            let mut led = system.clone();
            planned.steps.iter().try_for_each(|planned| step::apply(&planned.step, &mut led).ok().map(drop))?;
            Some(led)
        });
        if led.is_some_and(|led| difference(&led, &self.system, system).is_empty()) {
            return None;
        }
        let way = in_order(system, difference(system, &self.system, system)).ok()?;
        let calls = items(frame).into_iter().filter(|item| matches!(item.step, Step::Operation(_)));
        let mut view = Overlay::new(system);
        let mut touches = frame.footprint.touches.clone();
        for planned in &way {
            for touch in touch::touches(&planned.step, None, &view) {
                if !touches.iter().any(|own| own.slot == touch.slot) {
                    touches.push(touch);
                }
            }
            _ = step::apply(&planned.step, &mut view);
        }
        let mut saved = frame.saved.clone();
        for saved in &mut saved {
            saved.value = self.value(saved.slot).unwrap_or_else(|| saved.value.clone());
        }
        let items = way.iter().map(DraftStep::of).chain(calls).collect();
        let (inverse, footprint) = (Inverse::List(Arc::new(items)), Arc::new(Footprint { touches }));
        Some(Frame { inverse, footprint, saved, ..(**frame).clone() })
    }

    fn value(&self, slot: Slot) -> Option<Saved> {
        match slot {
            Slot::Property(property) => {
                let value = self.system.component(property.component)?.value(property.member)?;
                Some(Saved::Property(value.clone()))
            }
            Slot::Port(port) => step::written(port, &self.system).map(|value| Saved::Port(value.cloned())),
            _ => None,
        }
    }
}

/// What takes a frame back, in order.
fn items(frame: &Frame) -> Vec<DraftStep> {
    match &frame.inverse {
        Inverse::Steps(steps) => {
            let undoing = |done: &PlannedStep| -> Vec<DraftStep> {
                done.undo.steps().iter().map(|step| DraftStep::undoing(step, done)).collect()
            };
            steps.iter().rev().flat_map(undoing).collect()
        }
        Inverse::List(items) => items.to_vec(),
    }
}

/// The steps from one picture to another, but for what is about components that are faulted in a third one: nobody has brought that about.
pub fn difference(from: &System, to: &System, now: &System) -> Vec<Step> {
    let is_faulted = |name| now.component(name).is_some_and(|node| node.state == RunState::Faulted);
    let mut steps = system::diff(from, to);
    steps.retain(|step| !touch::components(step).into_iter().any(is_faulted));
    steps
}
