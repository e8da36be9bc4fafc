//! Coordinators that are down: with the last of them what was in force is forgotten.

use super::engine::Engine;
use super::progress::Progress;
use crate::model::{Ask, Ident, RequestId};
use crate::stack::{Batch, Request, Requester, Why};
use std::sync::atomic::Ordering;

impl Engine {
    /// A coordinator is down. It stands in the queue like a request, behind what it asked for; but where that is answered and others are not
    /// down nothing comes of it, and what it asks for next waits for nothing that these have asked for.
    pub(super) fn told_down(&mut self, coordinator: Requester) {
        if self.has_answered(coordinator) && !self.is_last_down(coordinator) {
            self.down.insert(coordinator);
            return;
        }
        let request = Request { why: Why::Down, ..Request::new(RequestId(0), Ask::Undo, coordinator) };
        let _ = self.desk.arrive(Batch::one(request), |_| false, &self.given.claims);
    }

    /// It has come to where nothing is left that it had asked for before.
    pub(super) fn is_taken_up_as_down(&mut self, coordinator: Requester) {
        self.down.insert(coordinator);
        // Who asks on is led anew since, and may be led down anew.
        if self.all_down() && !self.desk.asks_on() {
            self.counts.leaving.store(false, Ordering::Release);
            self.leaves(false);
        }
        self.look_whether_emptied();
    }

    /// Where all are down nothing may be left, also since somebody has put right what was. (What an operator takes away by an undo is looked at when
    /// they are down once more: `check` follows no other.)
    pub(super) fn look_whether_emptied(&mut self) {
        self.empty_subsystems();
        if self.all_down() && self.world.settle_down() {
            self.confirmations.clear();
            self.changed();
        }
    }

    /// What was in force in one life of a subsystem is not in force in the next: where all of its coordinators are down and nothing is left
    /// of it, its frames are dropped.
    fn empty_subsystems(&mut self) {
        let down = |all: &[Requester]| all.iter().all(|one| self.down.contains(one));
        let down: Vec<Ident> =
            self.given.subsystems.iter().filter(|(_, all)| down(all)).map(|(path, _)| *path).collect();
        let busy = self.held_frames();
        for path in down {
            if self.world.settle_down_in(path, &busy) {
                self.counts.leads(path, false);
                self.forget_confirmations();
                self.changed();
                self.given.tells(|| Progress::Emptied(path));
            }
        }
    }

    /// Whether nothing of that one waits or is being done, nor what is safe.
    fn has_answered(&self, coordinator: Requester) -> bool {
        let own = |request: &Request| request.requester == coordinator;
        self.desk.has_answered(coordinator)
            && !self.safety.waiting.iter().any(own)
            && !self.current.iter().any(|(request, _)| own(request))
    }

    /// Whether all coordinators, or all of a subsystem, are down once that one is.
    fn is_last_down(&self, coordinator: Requester) -> bool {
        // Who has asked for something since is down no more once that begins.
        let is_down = |one: &Requester| *one == coordinator || self.down.contains(one) && self.has_answered(*one);
        let last = |all: &[Requester]| all.contains(&coordinator) && all.iter().all(is_down);
        self.given.coordinators.iter().all(is_down) || self.given.subsystems.iter().any(|(_, all)| last(all))
    }

    /// Whether all coordinators are down.
    fn all_down(&self) -> bool {
        self.given.coordinators.iter().all(|coordinator| self.down.contains(coordinator))
    }
}
