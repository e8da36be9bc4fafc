//! What an emergency has left when it is over: nothing, where the same frames are in force as before it.

use super::engine::Engine;
use super::progress::Progress;
use super::repair::By;
use super::request::Reason;
use super::running::Running;
use crate::model::{ComponentName, ConfigId};
use crate::stack::{BeforeEmergency, Broken, Requester, Residual, World};
use crate::system::{System, touch};
use std::collections::BTreeSet;
use std::sync::Arc;

impl Engine {
    /// A safe configuration begins: `without` is the picture without what it interrupts, where that had done anything. Each (sub)system has an
    /// emergency of its own, but where one of what it is in goes on.
    pub(super) fn emergency_begins(&mut self, id: ConfigId, without: Option<&System>) {
        let path = id.prefix();
        let covered = self.emergencies.iter().any(|emergency| emergency.covers(path));
        let World { stack, system, .. } = &self.world;
        let before = BeforeEmergency::new(path, stack, without.unwrap_or(system).clone());
        // Of what goes on beside it nobody knows yet what it will have been.
        let is_safe = stack.frames().iter().any(|frame| frame.safe && frame.configuration.prefix() == path);
        if covered || is_safe || !self.is_settled(&before, true) {
            return;
        }
        self.emergencies.push(before);
    }

    /// A component has failed.
    pub(super) fn fails_in_emergency(&mut self, component: ComponentName) {
        self.emergencies.iter_mut().for_each(|emergency| emergency.has_failed(component));
    }

    /// Somebody takes what is there for what is to be there.
    pub(super) fn is_accepted(&mut self) {
        self.emergencies.clear();
    }

    /// Somebody is about to make what is theirs permanent.
    pub(super) fn is_made_permanent(&mut self, by: Requester) {
        let stack = &self.world.stack;
        self.emergencies.iter_mut().for_each(|emergency| emergency.is_permanent(stack, by));
    }

    /// Whether nothing of what an emergency is about is under way (but for what it has interrupted, when it `begins`), nor broken, nor in force in
    /// part.
    fn is_settled(&self, of: &BeforeEmergency, begins: bool) -> bool {
        let World { stack, broken, quarantined, .. } = &self.world;
        let works = |running: &Running| {
            let is_about = || running.machine.components().into_iter().any(|component| of.is_about(component));
            !(begins && running.is_interrupted()) && is_about()
        };
        !self.running.iter().any(works)
            && !broken.iter().flat_map(|broken| &broken.components).any(|component| of.is_about(*component))
            && (begins || !quarantined.iter().any(|component| of.is_about(*component)))
            && !stack.frames().iter().any(|frame| of.concerns(frame) && stack.is_in_part(frame))
    }

    /// Where nothing of an emergency is under way, and nothing of what came of it is broken or in force in part: the safe configuration that
    /// is left of it is seen to lead back. When none is left what differs from before is told, and put right where nothing moves by
    /// that. Else it is for who recovers.
    pub(super) fn look_at_emergencies(&mut self) {
        if !self.safety.waiting.is_empty() {
            return;
        }
        let mut at = 0;
        while at < self.emergencies.len() {
            let emergency = &self.emergencies[at];
            if !self.is_settled(emergency, false) {
                at += 1;
            } else if self.world.stack.frames().iter().any(|frame| emergency.has(frame)) {
                let World { stack, system, .. } = &mut self.world;
                if let Some(frame) = self.emergencies[at].leading_back(system, stack, &self.given.context) {
                    stack.replace(frame);
                    self.changed();
                }
                at += 1;
            } else {
                let emergency = self.emergencies.remove(at);
                self.is_over(emergency);
            }
        }
    }

    /// Nothing of it is in force any more.
    fn is_over(&mut self, mut emergency: BeforeEmergency) {
        let left = emergency.left(&self.world.system, &self.world.stack, &self.given.context);
        let Some((wanted, difference)) = left.filter(|(_, difference)| !difference.is_empty()) else { return };
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
