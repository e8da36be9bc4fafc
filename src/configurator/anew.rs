//! After a panic of the configurator's own thread (semantics: *What goes wrong*): it begins anew. What was under way ends
//! *broken*, with a partial frame of what was done of it; what is safe goes on, and what that has interrupted goes back.

use super::control::QueuedCommand;
use super::engine::Engine;
use super::pool::Pool;
use super::progress::Progress;
use super::request::{Reason, Request};
use super::running::{Purpose, Running};
use crate::limits;
use crate::model::{Ask, RequestId};
use crate::platform::Platform;
use crate::stack::{Requester, Residual, Why};
use crate::system::System;
use crate::transaction::{Input, PartEnd, Touched, Transaction};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;

impl Engine {
    /// A panic was caught. Neither may one while beginning anew end the thread, nor one that comes again and again keep it busy
    /// for ever: then what is under way ends at once, on what the model knows, and what waits is answered, since it may be what panics.
    pub(super) fn survive(&mut self, text: &str) {
        self.panics += 1;
        // What has come of what was under way is not known so well.
        self.emergencies.clear();
        let _ = catch_unwind(AssertUnwindSafe(|| {
            self.given.tells(|| Progress::Survived(text.to_owned()));
        }));
        let reason = Reason::Panic(text.to_owned());
        let again = self.panics > limits::PANICS_IN_A_ROW;
        if again {
            self.running.iter_mut().filter(|running| !running.is_safe()).for_each(|running| running.panics = u8::MAX);
        }
        if catch_unwind(AssertUnwindSafe(|| self.start_anew(&reason))).is_err() {
            self.end_all(&reason);
        }
        if again {
            for request in self.desk.cancel_waiting(|_| true) {
                self.owe(request);
                let _ = catch_unwind(AssertUnwindSafe(|| self.answer_unserved(&reason)));
            }
        }
        self.command_again(reason, again);
    }

    /// What was being carried out in its turn begins again: nothing else is left to stop what is up, and who waits is told. But what
    /// an operator wants recovered has left behind how far it came, and goes on when it is asked for once more.
    fn command_again(&mut self, reason: Reason, again: bool) {
        match self.doing.take() {
            Some(QueuedCommand::Recover { reply, .. }) => _ = reply.try_send(Err(Arc::new(Residual::of(reason)))),
            Some(command) if !again => {
                self.counts.command_again(command.only_asks());
                self.commands.push_front(command);
            }
            _ => {}
        }
    }

    fn start_anew(&mut self, reason: &Reason) {
        // It may have been taking everything down: what comes from now on begins again.
        self.taking_down = false;
        let Self { running, world, pool, given, .. } = self;
        for running in running {
            running.survives(reason, &mut world.system, pool, &*given.platform);
        }
        self.answer_unserved(reason);
        // Nobody is left to release what a safe configuration has interrupted, if the panic came where that had ended.
        if !self.running.iter().any(Running::is_safe) {
            self.release(Touched::default());
        }
        // The picture may be wrong as well: it is compared as soon as nothing else is to be done.
        self.switches.clear();
        self.observing.at_once(self.given.clock.now());
        self.changed();
    }

    /// Answers *broken* what is owed and nothing that is under way serves. What is safe is begun again, once: nobody stops a robot
    /// by asking for it a second time.
    fn answer_unserved(&mut self, reason: &Reason) {
        let (mut served, mut numbers): (Vec<Request>, Vec<u32>) = (Vec::new(), Vec::new());
        for running in &self.running {
            match &running.purpose {
                Purpose::Requests(number, _) => {
                    let Some(active) = self.desk.active(*number) else { continue };
                    numbers.push(*number);
                    served.extend(active.batch.requests.iter().copied());
                    served.extend(active.given_up.iter().map(|given_up| given_up.undo));
                }
                Purpose::Safe(safe) => served.push(safe.0),
                Purpose::Own | Purpose::Abandoned => {}
            }
        }
        for active in self.desk.under_way().to_vec() {
            if !numbers.contains(&active.number) {
                self.desk.over(active.number);
            }
        }
        let residual = Arc::new(Residual::of(reason.clone()));
        // On the desk something else of a request may have changed since it began.
        let is = |a: &Request, b: &Request| a.id == b.id && a.ask == b.ask && a.why == b.why;
        let owed: Vec<Request> = self.current.iter().map(|(request, _)| *request).collect();
        for request in owed.into_iter().filter(|request| !served.iter().any(|one| is(one, request))) {
            if request.why != Why::Asked {
                self.forget(request);
            } else if self.is_safe(&request) && self.panics == 1 {
                self.forget(request);
                self.counts.safe.fetch_add(1, Ordering::AcqRel);
                self.safety.waiting.push_front(request);
            } else {
                self.answer(request, request.ask.broken(), Some(Reason::Broken(residual.clone())));
            }
        }
    }

    /// Everything that is under way ends now. Of what not even that is possible with nothing is known any more.
    fn end_all(&mut self, reason: &Reason) {
        for mut running in std::mem::take(&mut self.running) {
            running.panics = u8::MAX;
            let Self { pool, given, world, .. } = self;
            let survives = || running.survives(reason, &mut world.system, pool, &*given.platform);
            if catch_unwind(AssertUnwindSafe(survives)).is_ok() {
                self.running.push(running);
            }
        }
        let _ = catch_unwind(AssertUnwindSafe(|| self.answer_unserved(reason)));
    }

    /// What has begun and was not answered is answered: nobody knows how far it came.
    pub(super) fn break_current(&mut self, reason: &Reason) {
        while let Some((request, begun)) = self.current.pop() {
            if request.why == Why::Asked {
                self.tell_answer(request, request.ask.broken(), Some(Arc::new(reason.clone())), begun);
            }
        }
    }

    /// What somebody waited for who is gone: what is done is booked, and what is left of it is kept.
    pub(super) fn abandoned(&mut self, mut machine: Transaction, since: crate::stack::FrameId) {
        let end = machine.end();
        // What force had begun it begins again, and leaves no frame of.
        if matches!(self.doing, Some(QueuedCommand::Force { .. })) {
            return;
        }
        for (part, ended) in machine.planned().parts.iter().zip(end.parts) {
            match ended {
                PartEnd::Done => _ = self.world.stack.apply([&part.edits], &[]),
                PartEnd::Broken(broken) => {
                    let request = Request::new(RequestId(0), Ask::Undo, Requester::Operator);
                    self.left_broken(&request, *broken, since);
                }
                PartEnd::Failed(_) | PartEnd::Cancelled | PartEnd::Anew => {}
            }
        }
        self.left_beside(end.beside);
        self.changed();
    }
}

impl Running {
    /// Its configurator has panicked, in the middle of this or of something else. Once: what was lost in between is looked
    /// for, and it comes to its end. In the middle of this again: it ends now.
    fn survives(&mut self, reason: &Reason, system: &mut System, pool: &mut Pool, platform: &dyn Platform) {
        if matches!(self.purpose, Purpose::Own) {
            self.purpose = Purpose::Abandoned;
        }
        if self.over {
            return;
        }
        if self.panics > 1 {
            self.give_up_calls(pool, platform);
            self.outstanding.clear();
            self.machine.break_off_blind(reason.clone(), system);
            self.over = true;
            return;
        }
        let (outstanding, asked) = (&self.outstanding, &self.asked);
        let is_out = |step| outstanding.iter().any(|call| call.is_of(step));
        let asks = |question| asked.iter().any(|asked| asked.question == question);
        self.machine.lost(is_out, asks, self.read.is_some(), system);
        if !self.is_safe() && !self.machine.is_interrupted() {
            self.machine.on(Input::BreakOff(reason.clone()), system);
        }
    }

    /// Its calls are told that they are given up, and waited for no more.
    fn give_up_calls(&self, pool: &mut Pool, platform: &dyn Platform) {
        for call in &self.outstanding {
            call.batch.stop();
            call.batch.under_way().iter().for_each(|timed| platform.cancel(&timed.step));
            pool.give_up(call.ticket);
            call.batch.close();
        }
        if let Some((ticket, _)) = self.read {
            pool.give_up(ticket);
        }
    }
}
