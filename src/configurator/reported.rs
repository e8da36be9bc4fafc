//! Components that were reported faulted are looked at, and what is planned waits for that.

use super::control::Command;
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

    /// Waits until everything that was reported faulted has been looked at: what is planned then knows of it. What is safe, and
    /// what is under way, does not wait for that, nor does the end.
    pub(super) fn settle_suspects(&mut self) {
        loop {
            self.look_at_suspects();
            let Some(until) = self.suspects.until() else { return };
            self.glance();
            let did = self.serve_safe() | self.advance_all();
            if self.stopping || self.commands.iter().any(Command::is_urgent) {
                return;
            }
            if !did {
                self.pump(until.min(self.running_until()));
            }
        }
    }
}
