//! Steps that run a component's own code: hooks and operations, on workers or in the component's activity, under a
//! deadline; and what becomes of those that come back too late.

use super::steps::closed;
use super::workers::Job;
use super::{Inner, Outcome};
use crate::model::{Call as Step, RunState, Transition, Value};
use crate::platform::{Cause, PlatformEvent};
use crate::runtime::activity::{Request, Stage};
use crate::runtime::cell::{Cell, Inside};
use crate::runtime::component::{Call, Reply};
use crate::runtime::guard;
use crate::time::{Receiver, RecvError, Time, lock};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};

/// Who settles a call: its worker by answering, or its caller by giving up. Exactly one does.
#[derive(Default)]
struct Settled(AtomicU8);

impl Settled {
    fn first(&self) -> bool {
        self.0.compare_exchange(0, 1, Ordering::AcqRel, Ordering::Acquire).is_ok()
    }
}

impl Inner {
    /// Runs a hook on a worker. The component must not be running.
    pub(super) fn hook(&self, cell: &Arc<Cell>, transition: Transition, deadline: Time) -> Outcome {
        // A stop has closed the gate already; its hook runs in what is, for everybody else, `stopped`.
        let may = |state| {
            if transition == Transition::Stop { state == RunState::Stopped } else { transition.allowed_in(state) }
        };
        match cell.enter_idle(may) {
            Ok(inside) => inside.hand_over(),
            Err(why) => return Outcome::NotDone(closed(why, cell.name, transition.as_str())),
        }
        let settled = Arc::new(Settled::default());
        let (answer, answered) = self.clock.channel(1);
        let job: Job = {
            let (inner, cell, settled) = (self.own.clone(), cell.clone(), settled.clone());
            let clock = self.clock.clone();
            Box::new(move || {
                // SAFETY: `BUSY` was set above and handed over to this job alone.
                let mut inside = unsafe { Inside::resume(&cell) };
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
            // The job was dropped unrun: the right to be inside is ours again.
            // SAFETY: it was handed over to the job, and the job is gone.
            drop(unsafe { Inside::resume(cell) });
            return Outcome::NotDone(Cause::Refused(text));
        }
        match answered.recv_deadline(deadline) {
            Ok(outcome) => outcome,
            Err(_) if self.give_up(cell, false, || settled.first()) => Outcome::Unknown(Cause::Timeout),
            Err(_) => answered.recv().unwrap_or(Outcome::Unknown(Cause::Timeout)),
        }
    }

    /// Puts the component where its hook has brought it.
    fn after_hook(
        &self,
        cell: &Arc<Cell>,
        inside: Inside<'_>,
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
                    registry.crew_of(slot).activity.started(cell);
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
    pub(super) fn operation(&self, step: &Step, deadline: Time) -> Outcome {
        match self.begin_operation(step) {
            Err(cause) => Outcome::NotDone(cause),
            Ok(begun) => self.await_answer(&begun, deadline),
        }
    }

    fn begin_operation(&self, step: &Step) -> Result<Begun, Cause> {
        let (name, operation) = (step.operation.component, step.operation.member);
        let registry = lock(&self.registry);
        let slot = registry.find(name)?;
        let cell = registry.entry(slot).cell.clone();
        if cell.is_quarantined() {
            return Err(Cause::Quarantined);
        }
        let index = cell
            .kind
            .operations
            .binary_search(&operation)
            .map_err(|_| Cause::Refused(format!("`{name}` has no operation `{operation}`")))?;
        let args = &cell.kind.ty.operations[&operation].args;
        if args.len() != step.args.len() || !args.iter().zip(&step.args).all(|(ty, arg)| arg.is_of(ty)) {
            return Err(Cause::Refused(format!("the arguments do not fit {}", step.operation)));
        }
        let args: Vec<Value> = step.args.clone();
        let stage = Arc::new(Stage::default());
        let cancelled = Arc::new(AtomicBool::new(false));
        let (reply, replied) = self.clock.channel(1);
        let in_activity = cell.state() == RunState::Running;
        let mut begun =
            Begun { cell: cell.clone(), in_activity, stage: stage.clone(), cancelled: cancelled.clone(), replied };
        if let Some(caller) = registry.entry(slot).caller(operation) {
            drop(registry);
            begun.in_activity = false;
            self.workers
                .run(Box::new(move || {
                    if stage.begin() {
                        // It is never inside the component: if it hangs it costs a worker, and the component goes on.
                        stage.returned();
                        let answer = guard::call(|| caller(&args)).unwrap_or_else(Reply::Panicked);
                        let _ = reply.try_send(answer);
                    }
                }))
                .map_err(Cause::Refused)?;
            return Ok(begun);
        }
        let call = Call { reply, cancelled };
        if in_activity {
            let crew = registry.crew_of(slot);
            let request = Request { cell, operation: index, args, call, stage };
            crew.requests.try_send(request).map_err(|_| {
                Cause::Refused(format!("too many operations wait for the activity `{}`", crew.activity.name))
            })?;
            crew.activity.signal.notify();
            return Ok(begun);
        }
        drop(registry);
        cell.enter_idle(|_| true).map_err(|why| closed(why, name, "call an operation of"))?.hand_over();
        let (inner, clock, own) = (self.own.clone(), self.clock.clone(), cell.clone());
        let job: Job = Box::new(move || {
            // SAFETY: `BUSY` was set above and handed over to this job alone.
            let mut inside = unsafe { Inside::resume(&cell) };
            if !stage.begin() {
                return;
            }
            let mut ended = inside.operation(&clock, index, &args, call);
            stage.returned();
            let left = inside.leave(ended.fault.is_some().then_some(RunState::Faulted));
            if let Some(reason) = ended.fault.take() {
                cell.beat.faulted(reason, clock.now());
            }
            ended.answer();
            if left.quarantined
                && let Some(inner) = inner.upgrade()
            {
                inner.clean_up(&cell, None, cell.state() == RunState::Stopped);
            }
        });
        if let Err(text) = self.workers.run(job) {
            // SAFETY: it was handed over to the job, and the job is gone.
            drop(unsafe { Inside::resume(&own) });
            return Err(Cause::Refused(text));
        }
        Ok(begun)
    }

    fn await_answer(&self, begun: &Begun, deadline: Time) -> Outcome {
        let reply = match begun.replied.recv_deadline(deadline) {
            Ok(reply) => reply,
            Err(RecvError::Closed) => Reply::Failed("the component ended before it answered".to_owned()),
            Err(RecvError::Timeout) => {
                begun.cancelled.store(true, Ordering::Release);
                if begun.stage.withdraw() {
                    return Outcome::NotDone(Cause::Timeout);
                }
                // What answers later is only late; what has not come back at all may never.
                self.give_up(&begun.cell, begun.in_activity, || begun.stage.is_inside());
                match begun.replied.try_recv() {
                    Ok(reply) => reply,
                    Err(_) => return Outcome::Unknown(Cause::Timeout),
                }
            }
        };
        match reply {
            Reply::Done(value) => Outcome::Done(value),
            Reply::Failed(text) => Outcome::NotDone(Cause::Failed(text)),
            Reply::Panicked(text) => Outcome::NotDone(Cause::Panicked(text)),
            Reply::Refused(text) => Outcome::NotDone(Cause::Refused(text)),
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
    fn clean_up(&self, cell: &Arc<Cell>, inside: Option<Inside<'_>>, configured: bool) {
        {
            // Whoever gave it up has said so under this lock.
            let registry = lock(&self.registry);
            if !registry.quarantined.contains(&cell.name) {
                return;
            }
        }
        let Some(mut inside) = inside.or_else(|| cell.enter_returned()) else { return };
        if configured && cell.kind.has_hook(Transition::Cleanup) {
            let _ = inside.hook(&self.clock, Transition::Cleanup);
        }
        let body = inside.take();
        inside.hand_over();
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

/// A call of an operation under way.
struct Begun {
    cell: Arc<Cell>,
    /// It runs in the component's activity.
    in_activity: bool,
    stage: Arc<Stage>,
    cancelled: Arc<AtomicBool>,
    replied: Receiver<Reply>,
}
