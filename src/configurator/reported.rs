//! Components that were reported faulted are looked at, and what begins waits for that.

use super::engine::Engine;
use super::suspects::generation_of;
use crate::model::ComponentName;

impl Engine {
    /// Looks at components that were reported faulted.
    pub(super) fn look_at_suspects(&mut self) {
        let Self { suspects, world, pool, running, given, .. } = self;
        let busy = || running.iter().flat_map(|running| running.machine.components()).collect();
        if suspects.look(&mut world.system, pool, busy, given.clock.now(), given.limits.step_timeout) {
            self.changed();
        }
    }

    /// When the model has touched a component last.
    pub(super) fn generation(&self, component: ComponentName) -> Option<u64> {
        generation_of(&self.world.system, component)
    }

    /// Whether something that was reported faulted is being looked at: what begins afterwards knows of it. What is safe, and
    /// what is under way, does not wait for that; nor is there a look at what is being worked on.
    pub(super) fn waits_for_a_look(&mut self) -> bool {
        if self.suspects.is_empty() {
            return false;
        }
        self.look_at_suspects();
        self.suspects.until().is_some()
    }
}
