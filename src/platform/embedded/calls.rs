//! Steps that run a component's own code: hooks and operations, on workers or in the component's activity, under a
//! deadline; and what becomes of those that come back too late.

use super::under_way::{HookSettlement, What};
use super::workers::Job;
use super::{Inner, Outcome};
use crate::model::{Call as Step, RunState, Transition, Value};
use crate::platform::{Cause, PlatformEvent};
use crate::runtime::activity::{ActivityThread, OperationJob};
use crate::runtime::builder::CallerFn;
use crate::runtime::call::{CallProgress, Reply, Responder};
use crate::runtime::cell::{Cell, CellGuard, CellRequest};
use crate::runtime::guard;
use crate::time::{Receiver, RecvError, Sender, Time, lock};
use std::sync::Arc;

impl Inner {
    /// Runs a hook on a worker. The component must not be running.
    pub(super) fn hook(&self, cell: &Arc<Cell>, transition: Transition, deadline: Time, safe: bool) -> Outcome {
        // A stop has closed the gate already; its hook runs in what is, for everybody else, `stopped`.
        let may = |state| {
            if transition == Transition::Stop { state == RunState::Stopped } else { transition.allowed_in(state) }
        };
        let settled = Arc::new(HookSettlement::default());
        let _entered = self.under_way.enter(What::Hook(cell.name, transition, settled.clone()));
        let enter = || Ok(CellGuard::idle(&**cell, safe, may));
        let what = (cell.name, transition.as_str());
        let mut inside = match self.when_free(what, deadline, || settled.is_withdrawn(), enter) {
            Ok(inside) => inside.sent(cell),
            Err(cause) => return Outcome::NotDone(cause),
        };
        let (answer, answered) = self.clock.channel(1);
        let job: Job = {
            let (inner, cell, settled) = (self.own.clone(), cell.clone(), settled.clone());
            let clock = self.clock.clone();
            Box::new(move || {
                if !settled.begin() {
                    drop(inside);
                    let _ = answer.try_send(Outcome::NotDone(Cause::Cancelled));
                    return;
                }
                let result = inside.hook(&clock, transition);
                let Some(inner) = inner.upgrade() else { return };
                if settled.first() {
                    let outcome = inner.after_hook(&cell, inside, transition, result);
                    let _ = answer.try_send(outcome);
                } else {
                    let configured = match (&result, transition) {
                        (Ok(Ok(())), _) => transition != Transition::Cleanup,
                        _ => transition != Transition::Configure,
                    };
                    inner.clean_up(&cell, Some(inside), configured && result.is_ok());
                }
            })
        };
        if let Err(text) = self.workers.run(job) {
            // The job was dropped unrun, and the right to be inside with it.
            return Outcome::NotDone(Cause::Refused(text));
        }
        match answered.recv_deadline(deadline) {
            Ok(outcome) => outcome,
            Err(_) if settled.withdraw() => Outcome::NotDone(Cause::Timeout),
            Err(_) if self.give_up(cell, false, || settled.first()) => Outcome::Unknown(Cause::Timeout),
            Err(_) => answered.recv().unwrap_or(Outcome::Unknown(Cause::Timeout)),
        }
    }

    /// Puts the component where its hook has brought it.
    fn after_hook(
        &self,
        cell: &Arc<Cell>,
        inside: CellGuard<'_>,
        transition: Transition,
        result: Result<Result<(), crate::runtime::Failure>, String>,
    ) -> Outcome {
        let target = match (&result, transition) {
            (Err(_), _) => Some(RunState::Faulted),
            (Ok(Ok(())), _) => Some(transition.target()),
            // A stop that failed: it runs on.
            (Ok(Err(_)), Transition::Stop) => Some(RunState::Running),
            (Ok(Err(_)), _) => None,
        };
        let outcome = match result {
            Ok(Ok(())) => Outcome::Done(None),
            Ok(Err(failure)) => Outcome::NotDone(Cause::Failed(failure.0)),
            Err(text) => {
                cell.beat.faulted(text.clone(), self.clock.now());
                Outcome::NotDone(Cause::Panicked(text))
            }
        };
        if target == Some(RunState::Running) {
            let mut registry = lock(&self.registry);
            let ready = registry.find(cell.name).and_then(|slot| registry.enlist(slot, &self.clock).map(|()| slot));
            match ready {
                Ok(slot) => {
                    if transition == Transition::Start {
                        cell.restart();
                    }
                    inside.leave(target);
                    registry.activity_of(slot).activity.started(cell);
                }
                Err(cause) => {
                    inside.leave(None);
                    return Outcome::NotDone(cause);
                }
            }
        } else {
            inside.leave(target);
        }
        outcome
    }

    /// Calls an operation.
    pub(super) fn operation(&self, step: &Step, deadline: Time, safe: bool) -> Outcome {
        let (reply, replied) = self.clock.channel(1);
        match self.find_operation(step, reply, safe) {
            Err(cause) => Outcome::NotDone(cause),
            Ok(begun) => {
                let _entered = self.under_way.enter(What::Operation(step.clone(), begun.progress.clone()));
                match self.begin_operation(&begun, step, deadline, safe) {
                    Err(cause) => Outcome::NotDone(cause),
                    Ok(()) => self.await_answer(begun, replied, deadline),
                }
            }
        }
    }

    fn find_operation(&self, step: &Step, reply: Sender<Reply>, safe: bool) -> Result<BegunCall, Cause> {
        let (name, operation) = (step.operation.component, step.operation.member);
        let registry = lock(&self.registry);
        let slot = registry.find(name)?;
        let cell = registry.entry(slot).cell.clone();
        let index = cell
            .kind
            .operations
            .binary_search(&operation)
            .map_err(|_| Cause::Refused(format!("`{name}` has no operation `{operation}`")))?;
        let place = match registry.entry(slot).caller(operation) {
            Some(function) => OperationExecutor::Beside(function),
            None if cell.state() == RunState::Running => {
                let scheduled = registry.activity_of(slot);
                OperationExecutor::Activity(scheduled.requests.clone(), scheduled.activity.clone())
            }
            None => OperationExecutor::Worker,
        };
        // Beside the component a safe call disturbs nobody, and inside it one is let in that can still come to rest.
        let keeps_out = if safe {
            !matches!(place, OperationExecutor::Beside(_)) && cell.gate.is_lost()
        } else {
            cell.gate.is_quarantined()
        };
        if keeps_out {
            return Err(Cause::Quarantined);
        }
        let args = &cell.kind.ty.operations[&operation].args;
        if args.len() != step.args.len() || !args.iter().zip(&step.args).all(|(ty, arg)| arg.is_of(ty)) {
            return Err(Cause::Refused(format!("the arguments do not fit {}", step.operation)));
        }
        let (holds, wake) = match &place {
            OperationExecutor::Beside(_) => (None, None),
            OperationExecutor::Worker | OperationExecutor::Activity(..) => {
                (Some(cell.beat.clone()), Some(registry.activity_of(slot).activity.signal.clone()))
            }
        };
        let progress = Arc::new(CallProgress::new(reply, holds, wake));
        Ok(BegunCall { cell, index, place, progress })
    }

    fn begin_operation(&self, begun: &BegunCall, step: &Step, deadline: Time, safe: bool) -> Result<(), Cause> {
        let BegunCall { cell, index, place, progress } = begun;
        let (progress, args): (_, Vec<Value>) = (progress.clone(), step.args.clone());
        match place {
            OperationExecutor::Beside(function) => {
                let function = function.clone();
                let job = move || {
                    if progress.begin() {
                        // It is never inside the component: if it hangs it costs a worker, and the component goes on.
                        progress.returned();
                        progress.answer(guard::call(|| function(&args)).unwrap_or_else(Reply::Panicked));
                    }
                };
                self.workers.run(Box::new(job)).map_err(Cause::Refused)
            }
            OperationExecutor::Activity(requests, activity) => {
                let asked = CellRequest::Operation(*index, args);
                let request = OperationJob { cell: cell.clone(), asked, call: Responder(progress), safe };
                requests.try_send(request).map_err(|_| {
                    Cause::Refused(format!("too many operations wait for the activity `{}`", activity.name))
                })?;
                activity.signal.notify();
                Ok(())
            }
            OperationExecutor::Worker => {
                let enter = || Ok(CellGuard::idle(&**cell, safe, |_| true));
                let what = (cell.name, "call an operation of");
                let inside = self.when_free(what, deadline, || progress.is_withdrawn(), enter)?;
                self.operate_idle(inside, cell, CellRequest::Operation(*index, args), Responder(progress))
            }
        }
    }

    /// Calls an operation of a component that does not run, on a worker.
    pub(super) fn operate_idle(
        &self,
        inside: CellGuard<'_>,
        cell: &Arc<Cell>,
        asked: CellRequest,
        call: Responder,
    ) -> Result<(), Cause> {
        let (inner, clock, own) = (self.own.clone(), self.clock.clone(), cell.clone());
        let inside = inside.sent(cell);
        let job: Job = Box::new(move || {
            // Left before the call is dropped: who hears its answer may call again at once.
            let mut inside = inside;
            let progress = call.0.clone();
            if !progress.begin() {
                return;
            }
            let mut ended = inside.operation(&clock, &asked, call);
            progress.returned();
            let left = inside.leave(ended.fault.is_some().then_some(RunState::Faulted));
            if let Some(reason) = ended.fault.take() {
                own.beat.faulted(reason, clock.now());
            }
            ended.answer();
            if left.quarantined
                && let Some(inner) = inner.upgrade()
            {
                inner.clean_up(&own, None, own.state() == RunState::Stopped);
            }
        });
        self.workers.run(job).map_err(Cause::Refused)
    }

    fn await_answer(&self, begun: BegunCall, replied: Receiver<Reply>, deadline: Time) -> Outcome {
        let BegunCall { cell, place, progress, .. } = begun;
        let reply = match replied.recv_deadline(deadline) {
            Ok(reply) => reply,
            Err(RecvError::Closed) => Reply::Failed("the component ended before it answered".to_owned()),
            Err(RecvError::Timeout) => {
                let given_up_before = progress.is_told();
                if progress.withdraw() {
                    return Outcome::NotDone(Cause::Timeout);
                }
                progress.tell();
                // What answers later is only late; what has not come back at all may never.
                self.give_up(&cell, matches!(place, OperationExecutor::Activity(..)), || progress.is_inside());
                match replied.try_recv() {
                    Ok(reply) => reply,
                    Err(_) => {
                        if given_up_before && !matches!(place, OperationExecutor::Beside(_)) {
                            self.leave_restless(&cell, &progress, replied);
                        }
                        return Outcome::Unknown(Cause::Timeout);
                    }
                }
            }
        };
        match reply {
            Reply::Done(value) => Outcome::Done(value),
            Reply::HalfWay => Outcome::Done(None),
            Reply::Failed(text) => Outcome::NotDone(Cause::Failed(text)),
            Reply::Panicked(text) => Outcome::NotDone(Cause::Panicked(text)),
            Reply::Refused(text) => Outcome::NotDone(Cause::Refused(text)),
            Reply::Withdrawn => Outcome::NotDone(Cause::Cancelled),
        }
    }

    /// A call that was given up has not come to rest, though its code returns: the component is in quarantine until it has.
    fn leave_restless(&self, cell: &Arc<Cell>, progress: &Arc<CallProgress>, replied: Receiver<Reply>) {
        let mut registry = lock(&self.registry);
        if progress.is_answered() || progress.is_inside() {
            return;
        }
        cell.gate.keep_out_until_rest();
        registry.quarantined.insert(cell.name);
        drop(registry);
        let (inner, cell) = (self.own.clone(), cell.clone());
        // Without a worker (the operating system has no thread left) it stays so.
        let _ = self.workers.run(Box::new(move || {
            let _ = replied.recv();
            if let Some(inner) = inner.upgrade() {
                inner.come_to_rest(&cell);
            }
        }));
    }

    /// It answers all the time, so nothing is to be cleaned up: it stays as it is, at rest.
    fn come_to_rest(&self, cell: &Cell) {
        let mut registry = lock(&self.registry);
        if !cell.gate.came_to_rest() || cell.gate.is_lost() {
            return;
        }
        let was = registry.quarantined.remove(&cell.name);
        drop(registry);
        if was {
            self.tell(PlatformEvent::Returned { component: cell.name, at: self.clock.now() });
        }
    }

    /// A component in quarantine has come back to its activity: has a worker clean it up.
    pub(super) fn come_back(&self, cell: Arc<Cell>) {
        let inner = self.own.clone();
        // Without a worker (the platform is being taken down) it is dropped with the platform.
        let _ = self.workers.run(Box::new(move || {
            if let Some(inner) = inner.upgrade() {
                let configured = matches!(cell.state(), RunState::Stopped | RunState::Running);
                inner.clean_up(&cell, None, configured);
            }
        }));
    }

    /// Removes a component whose call came back too late. Runs on a worker. `inside`: it is still inside.
    fn clean_up(&self, cell: &Arc<Cell>, inside: Option<CellGuard<'_>>, configured: bool) {
        {
            // Whoever gave it up has said so under this lock.
            let registry = lock(&self.registry);
            if !registry.quarantined.contains(&cell.name) {
                return;
            }
        }
        let Some(mut inside) = inside.or_else(|| CellGuard::returned(cell)) else { return };
        if configured && cell.kind.has_hook(Transition::Cleanup) {
            let _ = inside.hook(&self.clock, Transition::Cleanup);
        }
        let body = inside.take();
        inside.close();
        let entry = {
            let mut registry = lock(&self.registry);
            registry.sever(cell.name);
            registry.find(cell.name).ok().map(|slot| registry.remove(slot))
        };
        // Its own code, outside the lock; until it is through, the name is not free.
        let _ = guard::call(|| drop((body, entry)));
        lock(&self.registry).quarantined.remove(&cell.name);
        self.tell(PlatformEvent::Returned { component: cell.name, at: self.clock.now() });
    }
}

/// Where an operation runs.
enum OperationExecutor {
    /// In the caller's thread, beside the component.
    Beside(CallerFn),
    /// In the component's activity, between two updates.
    Activity(Sender<OperationJob>, Arc<ActivityThread>),
    /// On a worker: the component does not run.
    Worker,
}

/// A call of an operation.
struct BegunCall {
    cell: Arc<Cell>,
    index: usize,
    place: OperationExecutor,
    progress: Arc<CallProgress>,
}
