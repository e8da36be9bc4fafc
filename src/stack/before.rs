//! What an emergency leads back to: the system before the first of the safe configurations that are not all taken back yet.
//!
//! Each of them takes itself back, whatever it has interrupted and in whatever order several of them came, failed, were late and were let
//! go of. What all that comes to is held against the picture of before.

use super::{Frame, FrameId, Inverse, Op, Stack, transaction};
use crate::model::{ComponentName, RunState, Step};
use crate::plan::footprint::{Footprint, Saved, Slot};
use crate::plan::undo::{DraftStep, in_order};
use crate::plan::{PlanContext, PlannedStep};
use crate::system::{self, Overlay, System, View as _, step, touch};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The system before an emergency, and what was in force.
#[derive(Debug, Clone)]
pub struct BeforeEmergency {
    frames: Vec<Arc<Frame>>,
    system: System,
    /// Components that were faulted then, or have failed since.
    failed: BTreeSet<ComponentName>,
    /// Picture and frames as they were looked at last.
    looked_at: Option<(u64, FrameId, usize)>,
}

impl BeforeEmergency {
    /// As it is now; `system` is without what the emergency interrupts.
    pub fn new(stack: &Stack, system: System) -> Self {
        let failed = system.graph().node_weights().filter(|node| node.state == RunState::Faulted);
        let failed = failed.map(|node| node.name).collect();
        Self { frames: stack.frames().to_vec(), system, failed, looked_at: None }
    }

    /// How the picture differs from that of then, where the very frames of then are in force. None: they are not. What came since may have found
    /// what it wants already, and keeps that; what went may have been made permanent.
    pub fn left(&self, system: &System, stack: &Stack) -> Option<(&System, Vec<Step>)> {
        let is_same = self.frames.iter().map(|frame| frame.id).eq(stack.frames().iter().map(|frame| frame.id));
        is_same.then(|| (&self.system, self.difference(&self.system, system)))
    }

    /// Nothing is known any more of a component that has failed meanwhile: nobody's undo brings it back.
    pub fn has_failed(&mut self, component: ComponentName) {
        self.failed.insert(component);
        self.looked_at = None;
    }

    /// The steps from one picture to another, but for what is about components that have failed.
    fn difference(&self, from: &System, to: &System) -> Vec<Step> {
        let is_faulted = |picture: &System, name| picture.component(name).is_some_and(|n| n.state == RunState::Faulted);
        let has_failed = |name| self.failed.contains(&name) || is_faulted(from, name) || is_faulted(to, name);
        let mut steps = system::diff(from, to);
        steps.retain(|step| !touch::components(step).into_iter().any(has_failed));
        steps
    }

    /// The only safe configuration that is left of the emergency, the newest frame of all, as it leads back to there. None: it is not the only
    /// one, or does so already, or that was seen before.
    pub fn leading_back(&mut self, system: &System, stack: &Stack, context: &PlanContext) -> Option<Frame> {
        let now = (system.revision(), stack.next(), stack.frames().len());
        if self.looked_at.replace(now) == Some(now) {
            return None;
        }
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
        if led.is_some_and(|led| self.difference(&led, &self.system).is_empty()) {
            return None;
        }
        let way = in_order(system, self.difference(system, &self.system)).ok()?;
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
