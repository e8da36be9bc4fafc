//! What an emergency has left when it is over: nothing, where the same frames are in force as before it.
//!
//! Each safe configuration takes itself back, whatever it has interrupted and in whatever order several of them came, failed and
//! were let go of. What all that comes to is held against the picture of before the first of them: undo is a pop, also here.

use super::engine::Engine;
use super::progress::Progress;
use super::repair::By;
use super::request::Reason;
use crate::model::{ComponentName, RunState, Snapshot, Step};
use crate::stack::{Broken, Frame, Inverse, Residual, Stack, World};
use crate::system::{self, System, View as _, step, touch};
use std::collections::BTreeSet;
use std::sync::Arc;

/// What there was before the first of the safe configurations that are not all taken back yet.
pub struct BeforeEmergency {
    frames: Vec<Arc<Frame>>,
    system: System,
}

impl BeforeEmergency {
    /// The picture of that time without the newest frames that are not in force any more. None: something came since. What that has found
    /// as it wants it, it has not done, and keeps all the same: nothing is known of what is to be there.
    fn wanted(self, stack: &Stack) -> Option<System> {
        let Self { frames, mut system } = self;
        let now = stack.frames();
        let is_same = now.len() <= frames.len() && now.iter().zip(&frames).all(|(now, before)| now.id == before.id);
        let mut go = |step: &Step| step::apply(step, &mut system).ok().map(drop);
        for frame in frames.get(now.len()..).filter(|_| is_same)?.iter().rev() {
            match &frame.inverse {
                Inverse::Steps(steps) => {
                    steps.iter().rev().flat_map(|planned| planned.undo.steps()).try_for_each(&mut go)
                }
                Inverse::List(items) => items.iter().try_for_each(|item| go(&item.step)),
            }?;
        }
        Some(system)
    }
}

impl Engine {
    /// A safe configuration begins: `without` is the picture without what it interrupts, where that had done anything.
    pub(super) fn emergency_begins(&mut self, without: Option<&System>) {
        let World { stack, broken, system, .. } = &self.world;
        let safe = stack.safe().next().is_some() || self.running.iter().any(super::running::Running::is_safe);
        if self.before_emergency.is_some() || safe || !broken.is_empty() || self.is_in_part() {
            return;
        }
        let (frames, system) = (stack.frames().to_vec(), without.unwrap_or(system).clone());
        self.before_emergency = Some(BeforeEmergency { frames, system });
    }

    /// Whether some frame is in force in part.
    fn is_in_part(&self) -> bool {
        self.world.stack.frames().iter().any(|frame| self.world.stack.is_in_part(frame))
    }

    /// Where no emergency is left, and nothing of what came of it: what differs from before is told, and put right as far as that does not
    /// move anything. What would move is for who recovers.
    pub(super) fn look_whether_emergency_is_over(&mut self) {
        if self.before_emergency.is_none() || !self.running.is_empty() || !self.safety.waiting.is_empty() {
            return;
        }
        let World { stack, broken, quarantined, .. } = &self.world;
        if stack.safe().next().is_some() || !broken.is_empty() || !quarantined.is_empty() || self.is_in_part() {
            return;
        }
        let Some(wanted) = self.before_emergency.take().and_then(|before| before.wanted(stack)) else { return };
        let faulted = |name: &ComponentName| {
            self.world.system.component(*name).is_some_and(|node| node.state == RunState::Faulted)
        };
        let mut difference = system::diff(&wanted, &self.world.system);
        difference.retain(|step| !touch::components(step).iter().any(faulted));
        if difference.is_empty() {
            return;
        }
        let components: BTreeSet<ComponentName> = difference.iter().flat_map(touch::components).collect();
        let expected: Snapshot = wanted.snapshot_some(&components.iter().copied().collect::<Vec<_>>());
        let residual =
            Arc::new(Residual { difference: difference.clone(), ..Residual::of(Reason::LeftByEmergency(difference)) });
        self.world.breaks(Broken::of_nobody(residual.clone(), components, expected));
        self.changed();
        self.given.tells(|| Progress::Differs(residual));
        if self.repair(self.world.broken.len() - 1, By::Nobody).is_ok() {
            self.given.tells(|| Progress::Recovered);
        }
    }
}
