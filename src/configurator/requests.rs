//! The table of requests (design §6): what each one means and how it is answered.

use super::engine::{Confirming, Engine};
use super::frames::{Op, Planned};
use super::progress::Progress;
use super::request::{Batch, Reason, Request};
use super::transaction::{Ended, Spec};
use crate::model::{Ask, ConfigId, Configuration, OnFailure, Verdict};
use crate::stack::{Requester, may_commit};
use smallvec::SmallVec;

/// What a request comes to, once its names are looked up.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    pub request: Request,
    pub op: Op,
}

impl Engine {
    /// Takes up a batch.
    pub(super) fn handle(&mut self, batch: Batch) {
        self.heard.clear();
        for request in &batch.requests {
            self.begin(*request);
        }
        if !self.suspects.is_empty() {
            self.read_suspects();
        }
        if let [request] = batch.requests[..]
            && self.is_safe(&request)
        {
            return self.handle_safe(request);
        }
        if let [request] = batch.requests[..]
            && self.handle_fast(request)
        {
            return;
        }
        let (mut undos, mut pushes) = (SmallVec::<[Part; 4]>::new(), SmallVec::<[Part; 4]>::new());
        let mixed = batch.requests.iter().any(|r| matches!(r.ask, Ask::UndoOf(_)))
            && batch.requests.iter().any(|r| matches!(r.ask, Ask::Apply(_)));
        for request in batch.requests {
            match request.ask {
                Ask::UndoOf(_) | Ask::Apply(_) if mixed => {
                    let taken: SmallVec<[Op; 4]> = undos.iter().map(|part| part.op).collect();
                    if let Some(op) = self.look_up(request, &taken) {
                        let list = if op.is_push() { &mut pushes } else { &mut undos };
                        list.push(Part { request, op });
                    }
                }
                Ask::UndoOf(_) | Ask::Apply(_) => {
                    if let Some(op) = self.look_up(request, &[]) {
                        self.alone(Part { request, op });
                    }
                }
                Ask::Undo => self.handle_undo(request),
                Ask::UndoTo(frames) => self.handle_undo_to(request, frames),
                Ask::Commit { force } => self.handle_commit(request, force),
            }
        }
        self.together(undos, pushes);
    }

    /// What a request means now; none: it has been answered.
    fn look_up(&mut self, request: Request, taken: &[Op]) -> Option<Op> {
        match request.ask {
            Ask::Apply(id) => {
                if !self.configurations.contains_key(&id) {
                    self.answer(request, Verdict::Failed, Some(Reason::Unknown(id)));
                } else if let Some(broken) = &self.broken {
                    let reason = Reason::StillBroken(broken.residual.clone());
                    self.answer(request, Verdict::Failed, Some(reason));
                } else {
                    return Some(Op::Push(id, request.requester, request.scoped));
                }
            }
            Ask::UndoOf(id) => {
                if !self.configurations.contains_key(&id) {
                    self.answer(request, Verdict::UndoFailed, Some(Reason::Unknown(id)));
                } else if self.is_culprit(id, request.requester) {
                    self.undo_by_recovery(request);
                } else {
                    match self.find_frame(id, request.requester, taken) {
                        Ok(None) => self.answer(request, Verdict::Undone, None),
                        Err(reason) => self.answer(request, Verdict::UndoFailed, Some(reason)),
                        Ok(Some(op)) => match &self.broken {
                            Some(broken) => {
                                let reason = Reason::StillBroken(broken.residual.clone());
                                self.answer(request, Verdict::UndoFailed, Some(reason));
                            }
                            None => return Some(op),
                        },
                    }
                }
            }
            Ask::Undo | Ask::UndoTo(_) | Ask::Commit { .. } => {}
        }
        None
    }

    fn is_culprit(&self, id: ConfigId, by: Requester) -> bool {
        self.broken
            .as_ref()
            .and_then(|broken| broken.culprit)
            .is_some_and(|(culprit, asked)| culprit == id && (by == Requester::Operator || by == asked))
    }

    /// The undo of the very application that broke the system: goes back to the system before it.
    fn undo_by_recovery(&mut self, request: Request) {
        let Some(broken) = self.broken.take() else { return };
        match self.recover_back(broken) {
            Ok(()) => self.answer(request, Verdict::Undone, None),
            Err(residual) => self.answer(request, Verdict::UndoBroken, Some(Reason::Broken(residual))),
        }
    }

    /// Undos and pushes of one step of a coordinator: one transaction, by their net difference. When it cannot be had,
    /// the undos still count for themselves: a failing push does not keep the old configuration in force.
    fn together(&mut self, mut undos: SmallVec<[Part; 4]>, mut pushes: SmallVec<[Part; 4]>) {
        while !undos.is_empty() && !pushes.is_empty() {
            let ops: SmallVec<[Op; 8]> = undos.iter().chain(&pushes).map(|part| part.op).collect();
            match self.plan_ops(&ops) {
                Err((at, reason)) => {
                    if at < undos.len() {
                        let part = undos.remove(at);
                        self.answer(part.request, Verdict::UndoFailed, Some(reason));
                    } else {
                        let part = pushes.remove((at - undos.len()).min(pushes.len() - 1));
                        self.answer(part.request, Verdict::Failed, Some(reason));
                    }
                }
                Ok(planned) => {
                    let spec = self.spec(undos.iter().chain(&pushes).map(|part| part.op));
                    let first = pushes[0].request;
                    match self.carry(first, planned, spec) {
                        Ended::Applied => {
                            for part in undos {
                                self.answer(part.request, Verdict::Undone, None);
                            }
                            for part in pushes {
                                self.applied(part);
                            }
                        }
                        Ended::Undone(reason) => {
                            for part in pushes {
                                self.answer(part.request, Verdict::Failed, Some(reason.clone()));
                            }
                            for part in undos {
                                self.again(part);
                            }
                        }
                        Ended::Broken(residual) => {
                            self.blame(&pushes[0]);
                            for part in undos.into_iter().chain(pushes) {
                                let verdict = self.broken_verdict(&part);
                                self.answer(part.request, verdict, Some(Reason::Broken(residual.clone())));
                            }
                        }
                    }
                    return;
                }
            }
        }
        for part in undos.into_iter().chain(pushes) {
            self.again(part);
        }
    }

    /// What was looked up before something else was done is looked up anew.
    fn again(&mut self, part: Part) {
        if let Some(op) = self.look_up(part.request, &[]) {
            self.alone(Part { op, ..part });
        }
    }

    /// One request by itself.
    fn alone(&mut self, part: Part) {
        let failed = if part.op.is_push() { Verdict::Failed } else { Verdict::UndoFailed };
        let planned = match self.plan_ops(&[part.op]) {
            Ok(planned) => planned,
            Err((_, reason)) => return self.answer(part.request, failed, Some(reason)),
        };
        let spec = self.spec([part.op]);
        match self.carry(part.request, planned, spec) {
            Ended::Applied if failed == Verdict::Failed => {
                self.applied(part);
                if let Op::Push(id, ..) = part.op {
                    self.prepare(id);
                }
            }
            Ended::Applied => self.answer(part.request, Verdict::Undone, None),
            Ended::Undone(reason) => self.answer(part.request, failed, Some(reason)),
            Ended::Broken(residual) => {
                self.blame(&part);
                let verdict = self.broken_verdict(&part);
                self.answer(part.request, verdict, Some(Reason::Broken(residual)));
            }
        }
    }

    fn broken_verdict(&self, part: &Part) -> Verdict {
        if part.op.is_push() { Verdict::Broken } else { Verdict::UndoBroken }
    }

    pub(super) fn blame(&mut self, part: &Part) {
        if let (Op::Push(id, by, _), Some(broken)) = (part.op, &mut self.broken) {
            broken.culprit = Some((id, by));
        }
    }

    /// Carries out what was planned, and takes it into the stack when it was done.
    fn carry(&mut self, request: Request, planned: Planned, spec: Spec) -> Ended {
        if let Some(progress) = &self.progress {
            progress(&Progress::Begun { request, steps: planned.steps().len() });
        }
        let ended = self.transact(planned.steps(), spec);
        if matches!(ended, Ended::Applied) {
            self.commit(planned);
        }
        ended
    }

    /// How the ops are carried out: the time that their configurations give themselves, which then is also how long one
    /// step of theirs, or of their undoing, may take.
    pub(super) fn spec(&self, ops: impl IntoIterator<Item = Op>) -> Spec {
        let mut spec = Spec { timeout: None, hold: false, patience: self.limits.step_timeout };
        let mut undoes = false;
        for op in ops {
            let Op::Push(id, ..) = op else {
                undoes = true;
                continue;
            };
            if let Some(Configuration { timeout, on_failure, group, .. }) = self.configurations.get(&id) {
                undoes |= group.is_some();
                spec.hold |= *on_failure == OnFailure::Hold;
                spec.timeout = spec.timeout.max(*timeout);
            }
        }
        spec.patience = spec.patience.max(spec.timeout.unwrap_or_default());
        if undoes {
            let frames = self.stack.frames().iter();
            let longest = frames.filter_map(|f| self.configurations.get(&f.configuration)?.timeout).max();
            spec.patience = spec.patience.max(longest.unwrap_or_default());
        }
        spec
    }

    pub(super) fn applied(&mut self, part: Part) {
        let Op::Push(id, ..) = part.op else { return };
        if let Some(confirm) = self.configurations.get(&id).and_then(|c| c.confirm)
            && !self.heard.contains(&confirm.event)
        {
            self.confirming.push(Confirming {
                request: part.request,
                event: confirm.event,
                within: confirm.within,
                until: self.clock.now() + confirm.within,
            });
        }
        self.answer(part.request, Verdict::Ok, None);
    }

    fn handle_undo(&mut self, request: Request) {
        if let Some(broken) = &self.broken {
            if broken.culprit.is_some() && request.requester == Requester::Operator {
                return self.undo_by_recovery(request);
            }
            let reason = Reason::StillBroken(broken.residual.clone());
            return self.answer(request, Verdict::UndoFailed, Some(reason));
        }
        if let Some(foreign) = self.stack.frames().last().and_then(|top| top.foreign_to(request.requester)) {
            return self.answer(request, Verdict::UndoFailed, Some(Reason::Refused(vec![foreign])));
        }
        self.alone(Part { request, op: Op::Top });
    }

    /// Pops until `frames` are left, in one transaction.
    fn handle_undo_to(&mut self, request: Request, frames: usize) {
        if let Some(broken) = &self.broken {
            let reason = Reason::StillBroken(broken.residual.clone());
            return self.answer(request, Verdict::UndoFailed, Some(reason));
        }
        if self.stack.len() <= frames {
            return self.answer(request, Verdict::UndoFailed, Some(Reason::NothingToUndo));
        }
        self.alone(Part { request, op: Op::To(frames) });
    }

    fn handle_commit(&mut self, request: Request, force: bool) {
        if let Some(broken) = &self.broken {
            let reason = Reason::StillBroken(broken.residual.clone());
            return self.answer(request, Verdict::Failed, Some(reason));
        }
        if let Err(held) = may_commit(&self.stack, request.requester, force) {
            return self.answer(request, Verdict::Failed, Some(Reason::Refused(vec![held])));
        }
        self.stack.make_permanent(request.requester);
        self.forget_confirmations();
        self.changed();
        self.answer(request, Verdict::Ok, None);
    }

    /// Pops the frames whose confirmation did not come in time, and says so.
    pub(super) fn revert_unconfirmed(&mut self) {
        let now = self.clock.now();
        while let Some(at) = self.confirming.iter().position(|waiting| waiting.until <= now) {
            let Confirming { request, event, within, .. } = self.confirming.remove(at);
            let (Ask::Apply(id), reason) = (request.ask, Reason::NotConfirmed(event, within)) else { continue };
            if self.broken.is_some() {
                continue;
            }
            let Ok(Some(op)) = self.find_frame(id, request.requester, &[]) else { continue };
            let begun = self.clock.now();
            let (verdict, reason) = match self.plan_ops(&[op]) {
                Err((_, refused)) => (Verdict::UndoFailed, refused),
                Ok(planned) => match self.carry(request, planned, self.spec([op])) {
                    Ended::Applied => (Verdict::Reverted, reason),
                    Ended::Undone(failed) => (Verdict::UndoFailed, failed),
                    Ended::Broken(residual) => (Verdict::UndoBroken, Reason::Broken(residual)),
                },
            };
            self.tell_answer(request, verdict, Some(std::sync::Arc::new(reason)), begun);
        }
    }
}
