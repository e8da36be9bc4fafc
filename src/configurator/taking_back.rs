//! The second stage of stopping: nobody leads any more, and what is in force is taken back (semantics: *Stopping*).
//!
//! What is under way is given up as by a rollback that nobody asked for. Frames are popped, newest first, compensations
//! included: but those that came since stopping began, those of safe configurations, and what these block. What was put to
//! rest is not raised again: where something moved hardware since stopping began, or since the event that ends the deployment,
//! nothing is popped at all.

use super::control::{Moment, StoppingBegan, TakenDown};
use super::engine::Engine;
use super::repair::{By, Repaired};
use super::request::{Reason, Request};
use crate::model::{Ask, ConfigId, RequestId};
use crate::stack::claims::is_of_system;
use crate::stack::{Batch, Beside, Frame, FrameId, Inverse, LedDown, Op, Planned, Requester, Why, transaction};
use crate::system::step;
use crate::time::Time;
use crate::transaction::{Input, PartEnd, Transaction};
use std::collections::BTreeSet;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};

impl Engine {
    /// From now on operators are refused, also those that wait.
    pub(super) fn stopping_begins(&mut self) {
        if self.began.is_some() {
            return;
        }
        self.began = Some(StoppingBegan { since: self.moment(), led: None });
        let operators = |request: &Request| request.why == Why::Asked && request.requester == Requester::Operator;
        for request in self.desk.cancel_waiting(operators) {
            self.refuse(request);
        }
        self.changed();
    }

    /// A batch without what is refused since everything is being stopped, or led down since the event that ends it came (there
    /// force may do it, which `check` does not follow); none: nothing of it is left. What is safe is never refused.
    pub(super) fn without_refused(&mut self, mut batch: Batch) -> Option<Batch> {
        let stopping = self.began.is_some();
        let led = |ask: Ask| match ask {
            Ask::Apply(id) | Ask::UndoOf(id) => self.is_led_inside(id),
            // The newest of an operator's.
            Ask::Undo => {
                let own = |frame: &&Arc<Frame>| frame.requester == Requester::Operator;
                let newest = self.world.stack.frames().iter().rev().find(own);
                newest.is_some_and(|frame| self.is_led_inside(frame.configuration))
            }
            _ => false,
        };
        if stopping || self.leaving.is_some() || batch.requests.iter().any(|request| led(request.ask)) {
            let all = stopping || self.leaving.is_some();
            let safe = |id: ConfigId| self.given.configurations.get(&id).is_some_and(|c| c.safe);
            let refused = |request: &Request| {
                // While it is led down people let go of what they have made safe; once it is stopped nobody does.
                let safe = match request.ask {
                    Ask::Apply(id) => safe(id),
                    Ask::UndoOf(id) => safe(id) && !stopping,
                    _ => false,
                };
                let asked = request.why == Why::Asked && request.requester == Requester::Operator;
                asked && !safe && (all || led(request.ask)) && (stopping || !request.force)
            };
            let out: Vec<Request> = batch.requests.iter().copied().filter(refused).collect();
            batch.requests.retain(|request| !out.contains(request));
            out.into_iter().for_each(|request| self.refuse(request));
        }
        (!batch.requests.is_empty()).then_some(batch)
    }

    /// Whether a configuration is of a subsystem that is led down by itself.
    fn is_led_inside(&self, id: ConfigId) -> bool {
        self.leaving_inside.1.iter().any(|path| LedDown::Inside(*path).has(id))
    }

    fn refuse(&mut self, request: Request) {
        self.owe(request);
        self.answer(request, request.ask.failed(), Some(Reason::TakenDown));
    }

    /// The second stage.
    pub(super) fn take_all_back(&mut self, deadline: Time) -> TakenDown {
        let mut down = TakenDown::default();
        self.taking_down = true;
        self.nobody_leads();
        self.glance();
        self.confirmations.clear();
        self.forget_standings();
        for running in self.running.iter_mut().filter(|running| !running.is_safe()) {
            running.machine.on(Input::Stop, &mut self.world.system);
        }
        self.end_running();
        self.refuse_waiting();
        match self.put_to_rest() {
            None => self.pop_all(&mut down, deadline),
            Some(by) => {
                let frames = self.world.stack.frames().iter().filter(|frame| !frame.safe);
                down.kept = frames.map(|frame| frame.configuration).collect();
                down.put_to_rest = Some(by);
            }
        }
        self.see_left(&mut down);
        down.quarantined.clone_from(&self.world.quarantined);
        down.held = self.is_held(None);
        down.still = self.world.stack.safe().next().is_some();
        down.in_time = self.given.clock.now() <= deadline;
        self.taking_down = false;
        self.changed();
        down
    }

    /// The coordinators are left out; answers the number of the next frame when they were.
    pub(super) fn nobody_leads(&mut self) -> FrameId {
        let next = self.world.stack.next();
        self.began.as_mut().map_or(next, |began| *began.led.get_or_insert(next))
    }

    /// Whether a safe configuration was in force before stopping began, or is where it has not begun, and nobody let it go; `of`: one in
    /// whose (sub)system that is.
    pub(super) fn is_held(&self, of: Option<ConfigId>) -> bool {
        let about = |frame: &Frame| of.is_none_or(|of| is_of_system(frame.configuration, of));
        self.world.stack.frames().iter().any(|frame| frame.safe && !self.came_since(frame) && about(frame))
    }

    /// This moment.
    fn moment(&self) -> Moment {
        let under_way = self.current.iter().map(|(request, _)| request).chain(&self.safety.waiting);
        let asked = under_way.map(|request| request.id).collect();
        Moment { next: self.world.stack.next(), at: self.given.clock.now(), asked, before: Vec::new() }
    }

    /// Takes notice of whether the deployment is led down.
    pub(super) fn heed_leaving(&mut self) {
        // Of the deployment, and of subsystems by themselves.
        let leaving = self.counts.leaving.load(Ordering::Acquire);
        if leaving != self.leaving.is_some() {
            self.leaves(leaving);
        }
        let changes = self.counts.leaving_changes.load(Ordering::Acquire);
        if changes != self.leaving_inside.0 {
            let all = self.counts.leaving_inside.lock().unwrap_or_else(PoisonError::into_inner);
            self.leaving_inside = (changes, all.iter().copied().collect());
        }
    }

    /// The deployment is led down from now on, or it is no more.
    pub(super) fn leaves(&mut self, leaving: bool) {
        self.leaving = leaving.then(|| self.moment());
    }

    /// What was asked for and is answered now counts as from when it was asked for.
    pub(super) fn note_answered(&mut self, request: &Request) {
        let Self { began, leaving, world, .. } = self;
        let Ask::Apply(id) = request.ask else { return };
        let frame = || world.stack.newest_of(id, Some(request.requester)).map(|frame| frame.id);
        for moment in began.iter_mut().map(|began| &mut began.since).chain(leaving) {
            moment.answered(request, frame());
        }
    }

    /// Whether a frame is of what was asked for since stopping began.
    pub(super) fn came_since(&self, frame: &Frame) -> bool {
        self.began.as_ref().is_some_and(|began| began.since.has_come(frame))
    }

    /// What moved hardware since it is led down: since stopping began, or since the event that ends the deployment, whoever
    /// raised that.
    fn put_to_rest(&self) -> Option<ConfigId> {
        let moved = |frame: &&Arc<Frame>| match &frame.inverse {
            Inverse::Steps(steps) => steps.iter().any(|planned| planned.moves),
            Inverse::List(items) => items.iter().any(|item| step::moves(&item.step, &self.world.system)),
        };
        let led = |frame: &Frame| self.leaving.as_ref().is_some_and(|since| since.has_come(frame));
        let frames = self.world.stack.frames().iter();
        frames.rev().filter(|frame| self.came_since(frame) || led(frame)).find(moved).map(|frame| frame.configuration)
    }

    /// Pops frame after frame, newest first; what cannot be popped stays, with every older frame that shares a component with
    /// it: what holds an arm up is not taken from under it. So does what is safe, also what became so meanwhile.
    fn pop_all(&mut self, down: &mut TakenDown, deadline: Time) {
        let from = self.world.stack.next();
        let mut kept: BTreeSet<FrameId> = BTreeSet::new();
        while self.given.clock.now() < deadline && !self.is_hurried() {
            self.after_safe();
            let stays = |frame: &Frame| frame.safe || frame.id >= from || kept.contains(&frame.id);
            let next = self.world.stack.frames().iter().rev().find(|frame| !stays(frame) && !self.came_since(frame));
            let Some(frame) = next.cloned() else { break };
            let own = crate::stack::components(&frame.footprint);
            let holds = |other: &Arc<Frame>| {
                let above = other.id > frame.id && (other.safe || kept.contains(&other.id));
                above && crate::stack::components(&other.footprint).iter().any(|component| own.contains(component))
            };
            if self.world.stack.frames().iter().any(holds) {
                kept.insert(frame.id);
                down.kept.push(frame.configuration);
                continue;
            }
            match self.pop(&frame, deadline) {
                Ok(()) => down.popped.push(frame.configuration),
                Err(reason) => {
                    kept.insert(frame.id);
                    down.kept.push(frame.configuration);
                    down.troubles.push(reason);
                }
            }
        }
    }

    /// Pops a frame: what is left of something broken together with what mends that.
    fn pop(&mut self, frame: &Arc<Frame>, deadline: Time) -> Result<(), Reason> {
        let of = |engine: &Self| engine.world.broken.iter().position(|broken| broken.frame == Some(frame.id));
        if of(self).is_some() {
            if let Some(at) = of(self)
                && self.read_broken(at)
                && let Some(at) = of(self)
                && let Some((planned, left)) = self.world.undo_mended(at, (frame.id, &[]), &self.given.context)
            {
                let residual = self.world.broken[at].residual.clone();
                self.pop_as(frame, planned, deadline)?;
                match left {
                    Some(left) => self.leave(&residual, left),
                    None => self.forget_broken(&residual),
                }
                return Ok(());
            }
            // Nobody has asked for anything to move but what is taken back.
            if let Some(at) = of(self)
                && self.repair(at, By::Stopping).map_err(Reason::Broken)? == Repaired::Rests
                && let Some(at) = of(self)
            {
                return self.pop_beside(frame, at, deadline);
            }
            if self.world.stack.frame(frame.id).is_none() {
                return Ok(());
            }
        }
        let mut components = crate::stack::components(&frame.footprint).into_iter();
        if let Some(broken) = self.world.broken_at(&mut components) {
            return Err(Reason::StillBroken(broken.residual.clone()));
        }
        let ops = [Op::Undo(frame.id)];
        let planned = transaction(&self.world.system, &self.world.stack, &ops, &self.given.context)
            .map_err(|refusal| Reason::Refused(refusal.findings))?;
        self.pop_as(frame, planned, deadline)
    }

    /// Pops a frame beside what is broken of it, since that would have to move.
    fn pop_beside(&mut self, frame: &Arc<Frame>, at: usize, deadline: Time) -> Result<(), Reason> {
        let residual = self.world.broken[at].residual.clone();
        let ops = [Op::Undo(frame.id)];
        let planned = transaction(&self.world.system, &self.world.stack, &ops, &self.given.context)
            .map_err(|refusal| Reason::Refused(refusal.findings))?;
        let Beside::Left(left) = self.world.beside(at, (frame.id, &[]), &planned, &self.given.context) else {
            return Err(Reason::StillBroken(residual));
        };
        self.pop_as(frame, planned, deadline)?;
        self.leave(&residual, left);
        Ok(())
    }

    fn pop_as(&mut self, frame: &Frame, planned: Planned, deadline: Time) -> Result<(), Reason> {
        // A safe configuration keeps everything still.
        if let Some(safe) = self.world.stack.safe().next()
            && let Some(moving) = planned.steps.iter().find(|planned| planned.moves)
        {
            return Err(Reason::Moves(moving.step.clone(), Some(safe)));
        }
        let edits = planned.parts[0].edits.clone();
        let mut spec = self.spec(&planned, false);
        spec.limits.iter_mut().for_each(|limit| limit.until = limit.until.min(deadline));
        let since = self.world.stack.next();
        let end = self.carry_out(Transaction::new(planned, spec)).end();
        self.left_beside(end.beside);
        match end.parts.into_iter().next() {
            Some(PartEnd::Done) | None => {
                self.world.stack.apply([&edits], &[]);
                self.changed();
                Ok(())
            }
            Some(PartEnd::Failed(reason)) => Err(reason),
            Some(PartEnd::Broken(part)) => {
                let residual = part.residual.clone();
                let ask = Ask::UndoOf(frame.configuration);
                self.left_broken(&Request::new(RequestId(0), ask, frame.requester), *part, since);
                Err(Reason::Broken(residual))
            }
            Some(PartEnd::Cancelled | PartEnd::Anew) => Err(Reason::TakenDown),
        }
    }

    /// Everything that still waits is answered: nothing of it will be done.
    pub(super) fn refuse_waiting(&mut self) {
        self.glance();
        for request in self.desk.cancel_waiting(|_| true) {
            if request.why == Why::Asked {
                self.refuse(request);
            }
        }
    }

    /// Waits until nothing is under way any more.
    pub(super) fn end_running(&mut self) {
        loop {
            self.serve_safe();
            let did = self.advance_all();
            // Nothing of a batch goes on with what had not begun.
            self.refuse_rest();
            if self.running.is_empty() {
                return;
            }
            self.heed_hurry();
            if !did {
                self.pump(self.running_until());
            }
        }
    }

    /// Whether force is wanted.
    pub(super) fn is_hurried(&self) -> bool {
        self.counts.hurried.load(std::sync::atomic::Ordering::Acquire)
    }

    /// Force is wanted: what is under way is broken off, once.
    pub(super) fn heed_hurry(&mut self) {
        if self.is_hurried() && !std::mem::replace(&mut self.hurried, true) {
            self.break_off();
        }
    }

    /// What is there, as the platform shows it.
    pub(super) fn see_left(&mut self, down: &mut TakenDown) {
        match self.look() {
            Some(seen) => {
                down.observed = true;
                let _ = self.adopt(&seen);
                down.left = seen;
            }
            None => {
                down.observed = false;
                down.left = self.world.system.snapshot();
            }
        }
        self.note_quarantine();
    }
}
