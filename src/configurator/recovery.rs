//! The way out of what is broken: compared with the platform, mended, taken back or taken as it is.

use super::control::{Drift, Recovery};
use super::engine::Engine;
use super::inbox::{PoolReply, PoolTicket};
use super::pool::{CallFor, PlatformCall};
use super::progress::Progress;
use super::repair::By;
use super::request::{Reason, Request};
use crate::limits;
use crate::model::{ComponentName, RequestId, RunState, Snapshot};
use crate::stack::{Frame, Op, Planned, Residual, transaction};
use crate::system::{self, System, View as _};
use crate::time::Time;
use crate::transaction::{PartEnd, Transaction};
use std::sync::Arc;

impl Engine {
    /// The whole system as the platform sees it; none: no answer, or safe configurations came each time while it was looked: what was seen
    /// then may be from before that.
    pub(super) fn look(&mut self) -> Option<Snapshot> {
        for _ in 0..limits::LOOKS_AGAIN {
            let before = self.world.stack.next();
            let Some(PoolReply::Observed(Ok(seen))) = self.ask(PlatformCall::Observe) else { return None };
            self.after_safe();
            if self.world.stack.next() == before {
                return Some(seen);
            }
        }
        None
    }

    /// Has a worker make a call. Where none is made any more that is told.
    pub(super) fn call(&mut self, call: PlatformCall, deadline: Time, whose: CallFor) -> PoolTicket {
        let ticket = self.pool.start(call, deadline, whose);
        if let Some(why) = self.pool.take_refused() {
            self.given.tells(|| Progress::Stuck(why));
        }
        ticket
    }

    /// Asks the platform something on a worker, while everything else goes on. None: no answer.
    pub(super) fn ask(&mut self, call: PlatformCall) -> Option<PoolReply> {
        let deadline = self.given.clock.now() + self.given.limits.step_timeout;
        let whose = if self.taking_down { CallFor::Safe } else { CallFor::Look };
        let ticket = self.call(call, deadline, whose);
        let until = deadline + limits::PLATFORM_GRACE;
        loop {
            if let Some(reply) = self.pool.take(ticket) {
                return Some(reply);
            }
            if self.given.clock.now() >= until {
                self.pool.give_up(ticket);
                return None;
            }
            self.serve_safe();
            if !self.advance_all() {
                self.pump(until.min(self.running_until()));
            }
        }
    }

    /// Makes `seen` the picture.
    pub(super) fn adopt(&mut self, seen: &Snapshot) -> Result<(), system::UnknownType> {
        if self.world.system.snapshot() != *seen {
            self.world.system = System::from_snapshot(seen, self.world.system.catalogue().clone())?;
            // They hold handles into the picture that was.
            self.switches.clear();
            self.changed();
        }
        Ok(())
    }

    /// The system as it should be: the model, with what is broken as it was meant. What partial frames hold is in force.
    fn wanted(&self) -> System {
        let mut wanted = self.world.system.clone();
        for broken in &self.world.broken {
            self.world.put_meant(broken, &mut wanted);
        }
        wanted
    }

    /// The difference between model and platform. What is under way is left out.
    pub(super) fn drift(&mut self) -> Drift {
        let Some(seen) = self.look() else { return Drift::default() };
        let Ok(actual) = System::from_snapshot(&seen, self.world.system.catalogue().clone()) else {
            return Drift::default();
        };
        let wanted = self.wanted();
        let mut faulted: Vec<ComponentName> = Vec::new();
        for node in actual.graph().node_weights().filter(|node| node.state == RunState::Faulted) {
            if wanted.component(node.name).is_none_or(|wanted| wanted.state != RunState::Faulted) {
                faulted.push(node.name);
            }
        }
        faulted.sort_unstable();
        let under_way: Vec<ComponentName> = self.running.iter().flat_map(|r| r.machine.components()).collect();
        let mut steps = system::diff(&wanted, &actual);
        steps.retain(|step| system::touch::components(step).iter().all(|component| !under_way.contains(component)));
        faulted.retain(|component| !under_way.contains(component));
        let residuals = self.world.broken.iter().map(|broken| &broken.residual);
        let unsettled = residuals.flat_map(|residual| residual.unsettled.iter().cloned()).collect();
        Drift { steps, faulted, unsettled, quarantined: self.world.quarantined.clone(), observed: true }
    }

    /// Recovers what is broken; the error is what remains. Answers whether something was.
    pub(super) fn recover(&mut self, direction: Recovery) -> Result<bool, Arc<Residual>> {
        // Whoever asks has often seen it before the slow look has.
        if direction == Recovery::Back {
            self.compare_all();
        }
        let partial = self.world.stack.frames().iter().any(|frame| self.world.stack.is_in_part(frame));
        if self.world.broken.is_empty() && !partial {
            return Ok(false);
        }
        if !self.running.is_empty() {
            return Err(Arc::new(Residual::of(Reason::Busy)));
        }
        let recovered = match direction {
            Recovery::Back => self.recover_back(),
            Recovery::Accept => self.recover_accept(),
        };
        self.given.tells(|| if recovered.is_ok() { Progress::Recovered } else { Progress::NotRecovered });
        if recovered.is_ok() {
            self.look_whether_emptied();
        }
        recovered.map(|()| true)
    }

    /// Takes what is there as the state, and gives the stack up.
    fn recover_accept(&mut self) -> Result<(), Arc<Residual>> {
        let before = self.world.stack.next();
        let seen = self.look();
        // Nobody who asked for this knows of what has come to be safe since: that stays in force until somebody asks once more.
        let came = self.world.stack.frames().iter().find(|frame| frame.safe && frame.id >= before);
        if let Some(frame) = came {
            return Err(Arc::new(Residual::of(Reason::SafeCame(frame.configuration))));
        }
        match seen {
            Some(seen) if self.running.is_empty() && self.adopt(&seen).is_ok() => {
                self.world.stack.discard();
                self.world.broken.clear();
                self.is_accepted();
                self.confirmations.clear();
                self.changed();
                Ok(())
            }
            // Of what is only in part in force nothing else is known.
            _ => {
                let broken = self.world.broken.first().map(|broken| &broken.residual);
                let left = broken.or_else(|| self.in_part().next().map(|(_, residual)| residual));
                Err(left.cloned().unwrap_or_else(|| Arc::new(Residual::of(Reason::Busy))))
            }
        }
    }

    /// Goes back to the system before whatever ended *broken*: what differs is mended, what is partial undone. What is safe stays as far
    /// as it came: it holds something that is let go by its own undo, and not by who puts a trouble right.
    fn recover_back(&mut self) -> Result<(), Arc<Residual>> {
        loop {
            self.after_safe();
            if let Some(at) = self.world.broken.len().checked_sub(1) {
                match self.partial_of(at) {
                    Some(frame) if !frame.safe && self.read_broken(at) && self.take_back_straight(at, &frame)? => {}
                    _ => _ = self.repair(at, By::Recovery)?,
                }
                continue;
            }
            let partial = |frame: &&Arc<Frame>| self.world.stack.is_in_part(frame) && !frame.safe;
            let Some(frame) = self.world.stack.frames().iter().rev().find(partial).cloned() else {
                break;
            };
            self.pass_floor(&frame);
            let planned =
                transaction(&self.world.system, &self.world.stack, &[Op::Undo(frame.id)], &self.given.context)
                    .map_err(|refusal| Arc::new(Residual::of(Reason::Refused(refusal.findings))))?;
            self.take_back(&frame, planned)?;
        }
        let stays = self.world.stack.frames().iter().rev().find(|frame| self.world.stack.is_in_part(frame));
        stays.map_or(Ok(()), |frame| Err(self.left_of(frame, Reason::StaysSafe(frame.configuration))))
    }

    /// What is left in a partial frame, and why it still is.
    fn left_of(&self, frame: &Frame, cause: Reason) -> Arc<Residual> {
        let left = self.partials.iter().find(|(id, _)| *id == frame.id);
        let left = left.map(|(_, left)| left.of_partial(&self.world.system));
        Arc::new(Residual { cause: cause.clone(), ..left.unwrap_or(Residual::of(cause)) })
    }

    /// A person has decided that what cannot be undone may stay.
    fn pass_floor(&mut self, frame: &Frame) {
        if frame.floor.is_some() {
            self.world.stack.replace(Frame { floor: None, ..frame.clone() });
        }
    }

    /// The partial frame of something broken.
    fn partial_of(&self, at: usize) -> Option<Arc<Frame>> {
        let frame = self.world.broken[at].frame.and_then(|frame| self.world.stack.frame(frame));
        frame.filter(|frame| frame.partial).cloned()
    }

    /// Takes the partial frame of something broken back in one net with what mends that. False: each goes by itself.
    fn take_back_straight(&mut self, at: usize, frame: &Frame) -> Result<bool, Arc<Residual>> {
        self.pass_floor(frame);
        let Some(planned) = self.world.straight(at, frame.id, &self.given.context) else { return Ok(false) };
        let residual = self.world.broken[at].residual.clone();
        self.take_back(frame, planned)?;
        self.forget_broken(&residual);
        Ok(true)
    }

    /// Carries the undo of a partial frame out. An operator asks for it, without force.
    fn take_back(&mut self, frame: &Frame, planned: Planned) -> Result<(), Arc<Residual>> {
        let kept = planned.steps.iter().filter(|planned| planned.moves).find_map(|planned| {
            let safe = self.world.stack.keeper_of_step(&planned.step)?;
            Some((planned.step.clone(), safe))
        });
        if let Some((step, safe)) = kept {
            return Err(self.left_of(frame, Reason::KeptStill { frame: frame.configuration, step, safe }));
        }
        let edits = planned.parts[0].edits.clone();
        let spec = self.spec(&planned, true);
        let end = self.carry_out(Transaction::new(planned, spec)).end();
        self.left_beside(end.beside);
        match end.parts.into_iter().next() {
            Some(PartEnd::Done) | None => {
                self.world.stack.apply([&edits], &[]);
                self.changed();
                Ok(())
            }
            Some(PartEnd::Failed(reason)) => Err(self.left_of(frame, reason)),
            Some(PartEnd::Broken(part)) => {
                let residual = part.residual.clone();
                let ask = crate::model::Ask::UndoOf(frame.configuration);
                self.left_broken(&Request::new(RequestId(0), ask, frame.requester), *part, self.world.stack.next());
                Err(residual)
            }
            Some(PartEnd::Cancelled | PartEnd::Anew) => Err(Arc::new(Residual::of(Reason::Busy))),
        }
    }
}
