//! What an emergency has left when it is over: nothing, where the same frames are in force as before it.

use super::engine::Engine;
use super::progress::Progress;
use super::repair::By;
use super::request::Reason;
use super::running::Running;
use crate::model::ComponentName;
use crate::stack::{BeforeEmergency, Broken, Residual, World};
use crate::system::{System, touch};
use std::collections::BTreeSet;
use std::sync::Arc;

impl Engine {
    /// A safe configuration begins: `without` is the picture without what it interrupts, where that had done anything.
    pub(super) fn emergency_begins(&mut self, without: Option<&System>) {
        let World { stack, broken, system, .. } = &self.world;
        // Of what goes on beside it nobody knows yet what it will have been.
        let rests = self.running.iter().all(Running::is_interrupted) && stack.safe().next().is_none();
        if self.emergency.is_some() || !rests || !broken.is_empty() || self.is_in_part() {
            return;
        }
        self.emergency = Some(BeforeEmergency::new(stack, without.unwrap_or(system).clone()));
    }

    /// A component has failed.
    pub(super) fn fails_in_emergency(&mut self, component: ComponentName) {
        if let Some(emergency) = &mut self.emergency {
            emergency.has_failed(component);
        }
    }

    /// Somebody takes what is there for what is to be there, or part of it.
    pub(super) fn is_accepted(&mut self) {
        self.emergency = None;
    }

    /// Whether some frame is in force in part.
    fn is_in_part(&self) -> bool {
        self.world.stack.frames().iter().any(|frame| self.world.stack.is_in_part(frame))
    }

    /// Where nothing of an emergency is under way, and nothing of what came of it is broken or in force in part: the safe configuration that
    /// is left of it is seen to lead back. When none is left what differs from before is told, and put right where nothing moves by
    /// that. Else it is for who recovers.
    pub(super) fn look_at_emergency(&mut self) {
        let World { stack, broken, quarantined, system, .. } = &self.world;
        let Some(emergency) = &mut self.emergency else { return };
        if !self.running.is_empty() || !self.safety.waiting.is_empty() || !broken.is_empty() || !quarantined.is_empty()
        {
            return;
        }
        if stack.safe().next().is_some() {
            if let Some(frame) = emergency.leading_back(system, stack, &self.given.context) {
                self.world.stack.replace(frame);
                self.changed();
            }
            return;
        }
        if self.is_in_part() {
            return;
        }
        let Some(emergency) = self.emergency.take() else { return };
        let Some((wanted, difference)) = emergency.left(&self.world.system, &self.world.stack) else { return };
        if difference.is_empty() {
            return;
        }
        let components: BTreeSet<ComponentName> = difference.iter().flat_map(touch::components).collect();
        let expected = wanted.snapshot_some(&components.iter().copied().collect::<Vec<_>>());
        let cause = Reason::LeftByEmergency(difference.clone());
        let residual = Arc::new(Residual { difference, ..Residual::of(cause) });
        self.world.breaks(Broken::of_nobody(residual.clone(), components, expected));
        self.changed();
        self.given.tells(|| Progress::Differs(residual));
        if self.repair(self.world.broken.len() - 1, By::Nobody).is_ok() {
            self.given.tells(|| Progress::Recovered);
        }
    }
}
