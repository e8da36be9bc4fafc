//! What an emergency leads back to: the system before the first of the safe configurations that are not all taken back yet.
//!
//! Each of them takes itself back, whatever it has interrupted and in whatever order several of them came, failed, were late and were let
//! go of. What all that comes to is held against the picture of before.

use super::{Frame, FrameId, Inverse, Op, Requester, Stack, share, transaction};
use crate::model::names::is_within;
use crate::model::{ComponentName, RunState, Step};
use crate::plan::footprint::{Footprint, Index, Saved, Slot};
use crate::plan::undo::{DraftStep, in_order};
use crate::plan::{PlanContext, PlannedStep};
use crate::system::touch::Access;
use crate::system::{self, Overlay, System, View as _, step, touch};
use std::collections::BTreeSet;
use std::sync::Arc;

/// A (sub)system before an emergency, and what was in force.
#[derive(Debug, Clone)]
pub struct BeforeEmergency {
    /// The path of the (sub)system of the first safe configuration, empty at the top. What is outside is no matter of it.
    path: &'static str,
    /// What was in force then, and is to be in force still for all that is known.
    stack: Stack,
    /// The system with that in force, and nothing else.
    system: System,
    /// Of what nothing is known any more: components that were faulted then, or have failed since, and what somebody has made permanent that came
    /// since.
    unknown: Unknown,
    /// Picture and frames as they were looked at last.
    looked_at: Option<(u64, FrameId, usize)>,
}

/// Of what nothing is said: components, and what of others something has written.
#[derive(Debug, Clone, Default)]
struct Unknown {
    components: BTreeSet<ComponentName>,
    slots: BTreeSet<Slot>,
}

impl Unknown {
    fn add(&mut self, frame: &Frame) {
        let writes = frame.footprint.touches.iter().filter(|touch| touch.access != Access::Need);
        self.slots.extend(writes.map(|touch| touch.slot));
    }

    fn has_slot(&self, slot: Slot) -> bool {
        let (one, other) = slot.components();
        self.components.contains(&one)
            || self.components.contains(&other)
            || self.slots.iter().any(|own| own.overlaps(slot))
    }

    fn has(&self, step: &Step, system: &System) -> bool {
        let touches = touch::touches(step, None, system);
        let writes = touches.iter().filter(|touch| touch.access != Access::Need);
        touch::components(step).into_iter().any(|name| self.components.contains(&name))
            || writes.map(|touch| touch.slot).any(|slot| self.has_slot(slot))
    }
}

impl BeforeEmergency {
    /// As it is now; `system` is without what the emergency interrupts.
    pub fn new(path: &'static str, stack: &Stack, system: System) -> Self {
        let failed = system.graph().node_weights().filter(|node| node.state == RunState::Faulted);
        let unknown = Unknown { components: failed.map(|node| node.name).collect(), slots: BTreeSet::new() };
        Self { path, stack: stack.clone(), system, unknown, looked_at: None }
    }

    /// Whether what is called so is a matter of it.
    pub fn is_about(&self, component: ComponentName) -> bool {
        is_within(component.as_str(), self.path)
    }

    /// The same of something safe.
    pub fn covers(&self, path: &str) -> bool {
        is_within(path, self.path)
    }

    /// Whether a frame does something to what it is about, or means to.
    pub fn concerns(&self, frame: &Frame) -> bool {
        self.covers(frame.configuration.as_str()) || touched(frame).any(|component| self.is_about(component))
    }

    /// Whether that is something safe of it: not of one inside of it that was in force before.
    pub fn has(&self, frame: &Frame) -> bool {
        frame.safe && frame.id >= self.stack.next() && self.concerns(frame)
    }

    /// Nothing is known any more of a component that has failed meanwhile: nobody's undo brings it back.
    pub fn has_failed(&mut self, component: ComponentName) {
        self.unknown.components.insert(component);
        self.looked_at = None;
    }

    /// Somebody makes what is in force of theirs permanent: it stays, also what came since.
    pub fn is_permanent(&mut self, now: &Stack, by: Requester) {
        let first = self.stack.next();
        let came = now.frames().iter().filter(|frame| frame.id >= first && frame.requester == by);
        came.for_each(|frame| self.unknown.add(frame));
        self.stack.make_permanent(by);
        self.looked_at = None;
    }

    /// What has come since, is not safe, and is in force.
    fn since<'s>(&self, now: &'s Stack) -> impl Iterator<Item = &'s Arc<Frame>> + use<'s> {
        let first = self.stack.next();
        now.frames().iter().filter(move |frame| frame.id >= first && !frame.safe)
    }

    /// What was in force then and is not any more was taken back, or something safe has taken its place: it is to be as without that. False: it
    /// cannot be told how that would be.
    fn goes_with(&mut self, now: &Stack, context: &PlanContext) -> bool {
        // What is squashed is in force, and nobody can take it out alone.
        let is_new = |frame: &Frame| self.stack.frame(frame.id).is_none_or(|of| !of.is_squashed());
        if now.frames().iter().any(|frame| frame.is_squashed() && is_new(frame)) {
            return false;
        }
        let gone = |frame: &&Arc<Frame>| now.frame(frame.id).is_none() && self.concerns(frame);
        let gone: Vec<FrameId> = self.stack.frames().iter().rev().filter(gone).map(|frame| frame.id).collect();
        for frame in gone {
            let Ok(planned) = transaction(&self.system, &self.stack, &[Op::Undo(frame)], context) else { return false };
            let mut led = self.system.clone();
            if planned.steps.iter().any(|planned| step::apply(&planned.step, &mut led).is_err()) {
                return false;
            }
            self.system = led;
            self.stack.apply(planned.parts.iter().map(|part| &part.edits), &[]);
            self.looked_at = None;
        }
        true
    }

    /// How the picture differs from that of then, and how it would be without that difference. None: that cannot be told. What came since may
    /// have found what it wants already, and keeps that: nothing is said of what it is about, and that is as it is.
    pub fn left(&mut self, system: &System, now: &Stack, context: &PlanContext) -> Option<(System, Vec<Step>)> {
        self.goes_with(now, context).then(|| {
            let beyond = self.beyond(now);
            let mut wanted = system.clone();
            let back = self.difference(system, &self.system, &beyond);
            // What cannot be done without something of which nothing is said is told, and stays.
            back.iter().for_each(|step| drop(step::apply(step, &mut wanted)));
            (wanted, self.difference(&self.system, system, &beyond))
        })
    }

    /// Of what it says nothing while this is in force.
    fn beyond(&self, now: &Stack) -> Unknown {
        let mut beyond = self.unknown.clone();
        self.since(now).for_each(|frame| beyond.add(frame));
        beyond
    }

    /// The steps from one picture to another, but for what is outside, and about what nothing is known of.
    fn difference(&self, from: &System, to: &System, beyond: &Unknown) -> Vec<Step> {
        let is_faulted = |picture: &System, name| picture.component(name).is_some_and(|n| n.state == RunState::Faulted);
        let is_faulted = |name| is_faulted(from, name) || is_faulted(to, name);
        let mut steps = system::diff(from, to);
        steps.retain(|step| {
            let components = touch::components(step);
            // What is connected across is its parent's matter.
            let is_about = components.iter().all(|name| self.is_about(*name));
            is_about && !beyond.has(step, from) && !components.into_iter().any(is_faulted)
        });
        steps
    }

    /// The only safe configuration that is left of the emergency as it leads back to there. None: it is not the only one, or does so already, or
    /// that was seen before.
    pub fn leading_back(&mut self, system: &System, now: &Stack, context: &PlanContext) -> Option<Frame> {
        let picture = (system.revision(), now.next(), now.frames().len());
        if self.looked_at == Some(picture) {
            return None;
        }
        let known = self.goes_with(now, context);
        self.looked_at = Some(picture);
        let mut safe = now.frames().iter().filter(|frame| self.has(frame));
        let frame = safe.next().filter(|frame| known && safe.next().is_none() && !frame.partial)?.clone();
        // That of a parent leads back elsewhere as well.
        if !self.covers(frame.configuration.prefix()) {
            return None;
        }
        let led = transaction(system, now, &[Op::Undo(frame.id)], context).ok().and_then(|planned| {
            let mut led = system.clone();
            planned.steps.iter().try_for_each(|planned| step::apply(&planned.step, &mut led).ok().map(drop))?;
            Some(led)
        });
        let beyond = self.beyond(now);
        match led {
            Some(led) if self.difference(&led, &self.system, &beyond).is_empty() => return None,
            // What lies over it is in the way, and not where it leads.
            None if now.frames().iter().any(|other| other.id > frame.id && meet(other, &frame)) => return None,
            _ => {}
        }
        let own = items(&frame);
        let (calls, own): (Vec<_>, Vec<_>) = own.into_iter().partition(|item| matches!(item.step, Step::Operation(_)));
        let is_beyond = |item: &DraftStep| beyond.has(&item.step, system);
        let mut way = self.difference(system, &self.system, &beyond);
        // It moves nothing that it has not moved itself: who asks for its undo asks for that, and for nothing else.
        let index = Index::new(&frame.footprint, |touch| touch.access != Access::Need);
        way.retain(|step| {
            let touches = touch::touches(step, None, system);
            !step::moves(step, system)
                || touches.iter().any(|touch| touch.access != Access::Need && index.shares(touch))
        });
        way.extend(own.into_iter().filter(is_beyond).map(|item| item.step));
        let way = in_order(system, way).ok()?;
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
        for saved in saved.iter_mut().filter(|saved| !beyond.has_slot(saved.slot)) {
            saved.value = self.value(saved.slot).unwrap_or_else(|| saved.value.clone());
        }
        let items = way.iter().map(DraftStep::of).chain(calls).collect();
        let (inverse, footprint) = (Inverse::List(Arc::new(items)), Arc::new(Footprint { touches }));
        Some(Frame { inverse, footprint, saved, ..(*frame).clone() })
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

/// Whether two frames are about a component that is the same.
fn meet(one: &Frame, other: &Frame) -> bool {
    let of_one = share::components(&one.footprint);
    touched(other).any(|component| of_one.contains(&component))
}

fn touched(frame: &Frame) -> impl Iterator<Item = ComponentName> {
    share::components(&frame.footprint).into_iter()
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
