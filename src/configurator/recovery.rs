//! The way out of what is broken: compared with the platform, mended, taken back or taken as it is.

use super::control::{Drift, Recovery};
use super::engine::Engine;
use super::inbox::Reply;
use super::pool::Call;
use super::progress::Progress;
use super::request::{Reason, Request};
use super::teardown::own_plan;
use crate::limits;
use crate::model::{ComponentName, RequestId, RunState, Snapshot, Step, Verdict};
use crate::plan::undo::in_order;
use crate::stack::{Broken, Edits, FrameId, HandOver, Inverse, Op, Residual, keeps_still, transaction};
use crate::system::{self, System, View as _, step};
use crate::transaction::{PartEnd, Spec, Transaction};
use std::sync::Arc;

impl Engine {
    /// The whole system as the platform sees it; none: no answer.
    pub(super) fn look(&mut self) -> Option<Snapshot> {
        match self.ask(Call::Observe) {
            Some(Reply::Observed(Ok(seen))) => Some(seen),
            _ => None,
        }
    }

    /// Asks the platform something on a worker, while everything else goes on. None: no answer.
    fn ask(&mut self, call: Call) -> Option<Reply> {
        let deadline = self.clock.now() + self.limits.step_timeout;
        let ticket = self.pool.start(call, deadline);
        let until = deadline + limits::PLATFORM_GRACE;
        loop {
            if let Some(reply) = self.take_reply(ticket) {
                return Some(reply);
            }
            if self.clock.now() >= until {
                self.give_up(ticket);
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
            let components: Vec<ComponentName> = broken.components.iter().copied().collect();
            let _ = wanted.adopt(&components, &broken.expected);
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

    /// Recovers what is broken; the error is what remains.
    pub(super) fn recover(&mut self, direction: Recovery) -> Result<(), Arc<Residual>> {
        let partial = self.world.stack.frames().iter().any(|frame| frame.partial);
        if self.world.broken.is_empty() && !partial {
            return Ok(());
        }
        if !self.running.is_empty() {
            return Err(Arc::new(Residual::of(Reason::Busy)));
        }
        match direction {
            Recovery::Back => self.recover_back(),
            Recovery::Accept => match self.look() {
                Some(seen) if self.adopt(&seen).is_ok() => {
                    self.world.stack.discard();
                    self.world.broken.clear();
                    self.confirming.clear();
                    self.changed();
                    if let Some(progress) = &self.progress {
                        progress(&Progress::Recovered);
                    }
                    Ok(())
                }
                _ => self.world.broken.first().map_or(Ok(()), |broken| Err(broken.residual.clone())),
            },
        }
    }

    /// Goes back to the system before whatever ended *broken*: what differs is mended, what is partial undone.
    fn recover_back(&mut self) -> Result<(), Arc<Residual>> {
        let some = !self.world.broken.is_empty() || self.world.stack.frames().iter().any(|frame| frame.partial);
        // An operator asks for it, without force; and a safe configuration may come while it is looked.
        let still = |engine: &Self| engine.world.stack.safe().next().is_some();
        while !self.world.broken.is_empty() {
            self.repair(self.world.broken.len() - 1, !still(self), RequestId(0))?;
        }
        while let Some(frame) = self.world.stack.frames().iter().rev().find(|frame| frame.partial).cloned() {
            // A person has decided that what cannot be undone may stay.
            if frame.floor.is_some() {
                self.world.stack.replace(crate::stack::Frame { floor: None, ..(*frame).clone() });
            }
            let planned = transaction(&self.world.system, &self.world.stack, &[Op::Undo(frame.id)], &self.context)
                .map_err(|refusal| Arc::new(Residual::of(Reason::Refused(refusal.findings))))?;
            if let Some(moving) = planned.steps.iter().find(|planned| planned.moves && still(self)) {
                return Err(Arc::new(Residual::of(Reason::Moves(moving.step.clone()))));
            }
            let edits = planned.parts[0].edits.clone();
            let spec = self.spec(&planned, true);
            match self.carry_out(Transaction::new(planned, spec)).end().parts.into_iter().next() {
                Some(PartEnd::Done) | None => {
                    self.world.stack.apply([&edits], &[]);
                    self.changed();
                }
                Some(PartEnd::Failed(reason)) => {
                    let left = self.partials.iter().find(|(id, _)| *id == frame.id).map(|(_, left)| (**left).clone());
                    return Err(Arc::new(Residual { cause: reason.clone(), ..left.unwrap_or(Residual::of(reason)) }));
                }
                Some(PartEnd::Broken(part)) => {
                    let residual = part.residual.clone();
                    let ask = crate::model::Ask::UndoOf(frame.configuration);
                    self.left_broken(&Request::new(RequestId(0), ask, frame.requester), *part);
                    return Err(residual);
                }
                Some(PartEnd::Cancelled | PartEnd::Anew) => return Err(Arc::new(Residual::of(Reason::Busy))),
            }
        }
        if some && let Some(progress) = &self.progress {
            progress(&Progress::Recovered);
        }
        Ok(())
    }

    /// Mends what a request is about to undo. False: it was answered, since that does not go.
    pub(super) fn repair_for(&mut self, request: &Request, at: usize) -> bool {
        match self.repair(at, !keeps_still(&self.world, request), request.id) {
            Ok(()) => true,
            Err(residual) => {
                self.answer(*request, Verdict::UndoBroken, Some(Reason::Broken(residual)));
                false
            }
        }
    }

    /// Brings what is broken to where the model has it. What is unsettled is accepted by that. `asked`: it may move;
    /// `serves`: the request that its steps are told with.
    fn repair(&mut self, at: usize, asked: bool, serves: RequestId) -> Result<(), Arc<Residual>> {
        let broken = self.world.broken.remove(at);
        let components: Vec<ComponentName> = broken.components.iter().copied().collect();
        // Anew whenever it was waited for an answer: others go on meanwhile.
        let as_expected = |system: &System| {
            let mut wanted = system.clone();
            let _ = wanted.adopt(&components, &broken.expected);
            wanted
        };
        let mut observed = self.read(&components);
        let mut wanted = as_expected(&self.world.system);
        let mut withheld = None;
        if observed {
            self.note_quarantine();
            let steps = system::diff(&self.world.system, &wanted);
            let hung = |step: &Step| self.world.quarantined.contains(&step.component());
            let steps: Vec<Step> =
                steps.into_iter().filter(|step| matches!(step, Step::Disconnect { .. }) || !hung(step)).collect();
            let moves = system::diff::moves_any(&steps, &self.world.system);
            if moves && !asked && self.world.stack.safe().next().is_some() {
                withheld = steps.iter().find(|step| step::moves(step, &self.world.system)).cloned();
            }
            if !steps.is_empty() && (asked || !moves) {
                let list = in_order(&self.world.system, steps).unwrap_or_default();
                let plan = own_plan(list, &self.world.system);
                let spec = Spec { asked_back: asked, ..self.effort(crate::time::Time::NEVER) };
                let _ = self.carry_out_for(serves, Transaction::new(plan, spec));
                observed = self.read(&components);
                wanted = as_expected(&self.world.system);
            }
        }
        // A call that is out still may happen yet.
        let out = || {
            let out = |step: &Step| self.world.quarantined.contains(&step.component());
            broken.residual.unsettled.iter().any(out)
        };
        if observed && system::diff::reached(&self.world.system, &wanted) && !out() {
            self.drop_empty(broken.frame);
            self.changed();
            return Ok(());
        }
        let mut faulted: Vec<ComponentName> = Vec::new();
        for node in components.iter().filter_map(|name| self.world.system.component(*name)) {
            if node.state == RunState::Faulted
                && wanted.component(node.name).is_none_or(|w| w.state != RunState::Faulted)
            {
                faulted.push(node.name);
            }
        }
        let residual = Arc::new(Residual {
            difference: system::diff(&wanted, &self.world.system),
            faulted,
            quarantined: self.world.quarantined.clone(),
            observed,
            withheld: withheld.or_else(|| broken.residual.withheld.clone()),
            ..(*broken.residual).clone()
        });
        self.world.broken.insert(at.min(self.world.broken.len()), Broken { residual: residual.clone(), ..broken });
        self.changed();
        Err(residual)
    }

    /// A partial frame that holds nothing to take back is gone with what was broken.
    fn drop_empty(&mut self, frame: Option<FrameId>) {
        let Some(frame) = frame.and_then(|frame| self.world.stack.frame(frame)) else { return };
        if frame.partial && frame.floor.is_none() && matches!(&frame.inverse, Inverse::List(items) if items.is_empty())
        {
            let edits = Edits { pops: vec![(frame.id, HandOver::default())], ..Edits::default() };
            self.world.stack.apply([&edits], &[]);
        }
    }

    /// Reads some components back into the model. False: nobody answered.
    fn read(&mut self, components: &[ComponentName]) -> bool {
        match self.ask(Call::ObserveSome(components.to_vec())) {
            Some(Reply::Observed(Ok(seen))) => match self.world.system.adopt(components, &seen) {
                Ok(changed) => {
                    if changed {
                        self.switches.clear();
                        self.changed();
                    }
                    true
                }
                Err(_) => false,
            },
            _ => false,
        }
    }

    /// A component came back from a call that had never returned: what could not be mended because of it may be now. By
    /// itself nothing moves.
    pub(super) fn mend(&mut self) {
        self.note_quarantine();
        let mut at = 0;
        while at < self.world.broken.len() {
            if self.world.broken[at].mendable && self.repair(at, false, RequestId(0)).is_ok() {
                if let Some(progress) = &self.progress {
                    progress(&Progress::Recovered);
                }
            } else {
                at += 1;
            }
        }
    }

    /// After a panic: what is owed is answered *broken*, and the picture is read back from the platform.
    pub(super) fn start_anew(&mut self, text: &str) {
        if let Some(progress) = &self.progress {
            progress(&Progress::Survived(text.to_owned()));
        }
        let reason = Reason::Panic(text.to_owned());
        let mut expected = self.world.system.clone();
        let running: Vec<_> = self.running.drain(..).collect();
        for running in running {
            let asked = running.asked.iter().map(|asked| asked.number);
            self.forget_conditions(asked.chain(running.stood.iter().map(|(_, number)| *number)));
            let done: Vec<_> = running.machine.done_so_far().map(|(_, undo)| undo.clone()).collect();
            for back in done.iter().rev().flat_map(|undo| undo.steps()) {
                let _ = step::apply(back, &mut expected);
            }
        }
        for turn in self.desk.under_way().to_vec() {
            self.desk.over(turn.number);
        }
        // It may have been taking everything down: what comes from now on begins again.
        self.taking_down = false;
        let seen = self.look();
        let observed = seen.is_some_and(|seen| self.adopt(&seen).is_ok());
        let residual =
            Residual { difference: system::diff(&expected, &self.world.system), observed, ..Residual::of(reason) };
        let components = residual.components().collect();
        let residual = Arc::new(residual);
        let culprit = self.current.iter().find_map(|(request, _)| match request.ask {
            crate::model::Ask::Apply(id) => Some((id, request.requester)),
            _ => None,
        });
        if !residual.is_settled() {
            let expected = expected.snapshot();
            let residual = residual.clone();
            self.world.broken.push(Broken { residual, components, culprit, frame: None, mendable: true, expected });
        }
        while let Some((request, begun)) = self.current.pop() {
            let reason = Arc::new(Reason::Broken(residual.clone()));
            self.tell_answer(request, request.ask.broken(), Some(reason), begun);
        }
    }
}
