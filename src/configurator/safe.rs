//! Safe configurations: applied at once and best effort, whatever is under way and also when something is broken.
//!
//! The frame it leaves is planned on the picture without what was interrupted: so it undoes to where the stack was before
//! both, and what is rolled back around it does not matter to it.

use super::engine::Engine;
use super::request::{Reason, Request};
use super::running::{Purpose, Running};
use crate::model::{Ask, ConfigId, Target, Verdict};
use crate::stack::{Effort, Frame, effort};
use crate::system::{System, View as _, step};
use crate::time::Time;
use crate::transaction::{Input, PartEnd, Spec, Touched, Transaction};
use smallvec::SmallVec;
use std::time::Duration;

impl Engine {
    /// Begins the safe configurations that were asked for. True: there were some.
    pub(super) fn serve_safe(&mut self) -> bool {
        if self.safe.is_empty() && self.counts.safe.load(std::sync::atomic::Ordering::Acquire) == 0 {
            return false;
        }
        self.glance();
        let mut some = false;
        while let Some(request) = self.safe.pop_front() {
            self.owe(request);
            self.begin_safe(request);
            some = true;
        }
        if !some && self.counts.safe.load(std::sync::atomic::Ordering::Acquire) > 0 {
            // It was announced and is on its way.
            self.pump(self.clock.now() + Duration::from_millis(1));
        }
        some
    }

    /// A safe configuration begins: what is under way is interrupted, and told so.
    fn begin_safe(&mut self, request: Request) {
        let Ask::Apply(id) = request.ask else { return };
        let configurations = self.configurations.clone();
        let Some(configuration) = configurations.get(&id) else { return };
        let before = self.interrupt(id);
        let at = self.clock.now();
        let plan = |system: &System| effort(system, &self.world.stack, configuration, &request, at, &self.context);
        let Effort { planned, frame, troubles } = plan(&self.world.system);
        // The frame as it would be if what is interrupted had never been.
        let frame = before.map_or(frame, |before| plan(&before).frame);
        let mut touched = Touched::default();
        for entry in configuration.pre.iter().chain(configuration.post.iter()) {
            // What is not there is left out, and does not keep what is taken back from bringing it back.
            if let Target::Component(component) = entry.target
                && self.world.system.component(component).is_some()
            {
                touched.add_state(component);
            }
        }
        planned.steps.iter().for_each(|planned| touched.add(&planned.step));
        for planned in frame.steps() {
            touched.add(&planned.step);
        }
        self.troubles.push((request.id, troubles));
        let spec = Spec {
            until: Time::NEVER,
            timeout: Duration::ZERO,
            patience: self.limits.step_timeout,
            best_effort: true,
            asked_back: false,
        };
        let purpose = Purpose::Safe(Box::new((request, frame, touched)));
        let machine = Transaction::new(planned, spec);
        let running = Running::new(self.number(), machine, purpose, SmallVec::from_iter([request.id]));
        self.running.insert(0, running);
        self.review_standings();
        // Now, not after what else waits to go on.
        self.advance(0);
    }

    /// Interrupts what is under way; the picture without it, if it has done anything.
    fn interrupt(&mut self, id: ConfigId) -> Option<System> {
        let mut before: Option<System> = None;
        for at in 0..self.running.len() {
            let running = &mut self.running[at];
            if running.is_safe() || running.over {
                continue;
            }
            running.machine.on(Input::Interrupt(id), &mut self.world.system);
            let done: Vec<_> = running.machine.done_so_far().map(|(_, undo)| undo.clone()).collect();
            if !done.is_empty() {
                let picture = before.get_or_insert_with(|| self.world.system.clone());
                for undo in done.iter().rev() {
                    for back in undo.steps() {
                        let _ = step::apply(back, picture);
                    }
                }
            }
            // Calls that are out are told first.
            self.running[at].stop_brief();
            self.advance(at);
        }
        before
    }

    /// A safe configuration has been applied as far as it goes: its frame is pushed, it is answered, and what it interrupted
    /// goes back.
    pub(super) fn safe_ended(&mut self, safe: (Request, Frame, Touched), machine: Transaction, stood: Option<u64>) {
        let (request, frame, touched) = safe;
        let edits = machine.planned().parts[0].edits.clone();
        let end = machine.end();
        let troubles = self.troubles.iter().position(|(id, _)| *id == request.id);
        let mut troubles = troubles.map(|at| self.troubles.remove(at).1).unwrap_or_default();
        let mut broken = None;
        if let Some(PartEnd::Broken(part)) = end.parts.into_iter().next() {
            broken = Some(part);
        }
        let interrupted = self.running.iter().any(|running| !running.is_safe() && !running.over);
        let frame = match (&broken, interrupted) {
            (Some(part), false) => Frame { partial: true, ..part.frame.clone().unwrap_or(frame) },
            _ => Frame { partial: frame.partial || broken.is_some(), ..frame },
        };
        let held = self.held_frames();
        let pushed = self.world.stack.push_safe(edits, frame, &held);
        let (verdict, reason) = match broken {
            None if troubles.is_empty() => (Verdict::Ok, None),
            None => {
                let residual = crate::stack::Residual::of(troubles.swap_remove(0));
                (Verdict::Broken, Some(Reason::Broken(std::sync::Arc::new(residual))))
            }
            Some(part) => {
                let residual = part.residual.clone();
                let part = crate::transaction::BrokenPart { frame: None, instead: None, ..*part };
                self.left_broken(&request, part);
                if let (Some(last), false) = (self.world.broken.last_mut(), residual.is_settled()) {
                    last.frame = Some(pushed);
                }
                (Verdict::Broken, Some(Reason::Broken(residual)))
            }
        };
        self.forget_confirmations();
        self.changed();
        match (verdict, request.ask) {
            (Verdict::Ok, Ask::Apply(id)) => {
                self.await_confirmation(request, pushed);
                self.applied(id, stood);
            }
            _ => self.forget_conditions(stood),
        }
        self.answer(request, verdict, reason);
        self.release(touched);
    }

    /// What was interrupted goes back, once no safe configuration is being applied any more.
    fn release(&mut self, touched: Touched) {
        self.touched.join(touched);
        if self.running.iter().any(|running| running.is_safe() && !running.over) {
            return;
        }
        let touched = std::mem::take(&mut self.touched);
        for running in self.running.iter_mut().filter(|running| !running.is_safe() && !running.over) {
            running.machine.on(Input::Release(touched.clone()), &mut self.world.system);
        }
    }
}
