//! Components that were reported faulted: looked at, since the report may be older than what was done since.

use super::engine::Engine;
use super::inbox::Reply;
use super::looks::SuspectLook;
use super::pool::Call;
use crate::limits;
use crate::model::{ComponentName, RunState};
use crate::system::View as _;
use rustc_hash::FxHashSet;

impl Engine {
    /// Looks at components that were reported faulted (the report may be older than what was done since).
    pub(super) fn look_at_suspects(&mut self) {
        let mut at = 0;
        while at < self.looks.len() {
            let SuspectLook { ticket, component, generation, until } = self.looks[at];
            let seen = match self.take_reply(ticket) {
                Some(Reply::ObservedComponent(Ok(seen))) => seen,
                Some(_) => None,
                None if self.clock.now() >= until => {
                    self.give_up(ticket);
                    None
                }
                None => {
                    at += 1;
                    continue;
                }
            };
            self.looks.remove(at);
            let faulted = seen.is_some_and(|seen| seen.state == RunState::Faulted);
            let stale = self.generation(component) != generation;
            if faulted && stale {
                self.suspects.push(component);
            } else if faulted && self.world.system.set_state(component, RunState::Faulted) {
                self.changed();
            }
        }
        if self.suspects.is_empty() {
            return;
        }
        // What is being worked on is looked at by whoever works on it, or afterwards.
        let busy: FxHashSet<ComponentName> = self.running.iter().flat_map(|r| r.machine.components()).collect();
        let mut later = Vec::new();
        while let Some(component) = self.suspects.pop() {
            if self.looks.iter().any(|look| look.component == component) {
                continue;
            }
            if busy.contains(&component) || !self.pool.has_room_beside(1) {
                later.push(component);
                continue;
            }
            let deadline = self.clock.now() + self.limits.step_timeout;
            let ticket = self.pool.start(Call::ObserveComponent(component), deadline);
            let until = deadline + limits::PLATFORM_GRACE;
            self.looks.push(SuspectLook { ticket, component, generation: self.generation(component), until });
        }
        self.suspects = later;
    }

    /// When the model has touched a component last.
    pub(super) fn generation(&self, component: ComponentName) -> Option<u64> {
        self.world.system.component(component).map(|node| node.generation)
    }

    /// Waits until everything that was reported faulted has been looked at: what is planned then knows of it.
    pub(super) fn settle_suspects(&mut self) {
        loop {
            self.look_at_suspects();
            let Some(until) = self.looks.iter().map(|look| look.until).min() else { return };
            self.pump(until);
            if self.stopping {
                return;
            }
        }
    }
}
