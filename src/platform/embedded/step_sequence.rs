//! Components are made, and dropped, by their own code. It hardly takes time, but it is theirs and may hang: a worker runs it,
//! the steps of a batch in one go, so that the thread's round trip is paid once for all of them.
//!
//! A [`StepSequence`] says how far the worker is. Whoever waits gives a step up when its time is over: its component is then in
//! quarantine, what the worker brings back too late is dropped, and nothing more is begun.

use super::under_way::What;
use super::wiring::check_values;
use super::workers::Job;
use super::{Inner, Outcome};
use crate::limits;
use crate::model::{ComponentName, Ident, RunState, Step, TypeName, Value};
use crate::platform::{Cause, PlatformEvent, StepBatch};
use crate::runtime::activity::ActivityThread;
use crate::runtime::beat::Beat;
use crate::runtime::cell::{Cell, CellGuard};
use crate::runtime::{Notice, guard};
use crate::time::{RecvError, Time, lock};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Steps that a worker carries out one after the other.
pub(super) struct StepSequence {
    batch: StepBatch,
    /// `2 i`: step `i` has not begun, the one before has come to its end; `2 i + 1`: it is under way; [`OVER`]: nobody
    /// waits.
    at: AtomicUsize,
    /// Whether the one that was given up was not in quarantine before.
    fresh: AtomicBool,
    /// This step and those behind it were taken back: they do not begin.
    taken_back: AtomicUsize,
}

/// Nothing more is begun, and what is under way comes back too late.
const OVER: usize = usize::MAX;

impl StepSequence {
    fn move_on(&self, from: usize, to: usize) -> bool {
        self.at.compare_exchange(from, to, Ordering::AcqRel, Ordering::Acquire).is_ok()
    }

    /// Step `i` begins; false: nobody waits any more, or it was taken back.
    fn begin(&self, i: usize) -> bool {
        i < self.taken_back.load(Ordering::Acquire) && self.move_on(2 * i, 2 * i + 1)
    }

    /// Takes `step` back, and what comes after it, unless it has begun.
    pub(super) fn take_back(&self, step: &Step) {
        if let Some(i) = self.batch.steps().iter().position(|own| own.step == *step) {
            self.taken_back.fetch_min(i, Ordering::AcqRel);
        }
    }
}

/// Who carries a step out: a worker, as number so and so of a sequence, or whoever calls; and when it must be over.
#[derive(Clone, Copy)]
struct StepRunner<'a>(Option<(&'a StepSequence, usize)>, Time);

impl StepRunner<'_> {
    /// The step has come to its end in time. Asked once, before its effect can be seen, so that nobody gives up what is
    /// there.
    fn in_time(self) -> bool {
        self.0.is_none_or(|(sequence, i)| sequence.move_on(2 * i + 1, 2 * i + 2))
    }
}

/// How one of them ended.
enum SequenceEnd {
    Ended(Outcome),
    /// After it had been given up; it has been cleaned up.
    Late,
}

impl Inner {
    /// Carries out steps that make or destroy components, one after the other: as many as are done at once, no further one a
    /// while after the first.
    pub(super) fn in_sequence(&self, batch: &StepBatch) {
        let first = self.clock.now();
        let sequence = Arc::new(StepSequence {
            batch: batch.clone(),
            at: AtomicUsize::new(0),
            fresh: AtomicBool::new(false),
            taken_back: AtomicUsize::new(usize::MAX),
        });
        let _entered = self.under_way.enter(What::Sequence(sequence.clone()));
        let (answer, answered) = self.clock.channel(1);
        let job: Job = {
            let (inner, sequence) = (self.own.clone(), sequence.clone());
            Box::new(move || {
                if let Some(inner) = inner.upgrade() {
                    inner.run_sequence(&sequence, first);
                }
                let _ = answer.try_send(());
            })
        };
        if let Err(text) = self.workers.run(job) {
            return batch.not_begun(Cause::Refused(text));
        }
        // What was done so far is told once, when somebody hangs: the others end together.
        let alone = batch.steps().len() == 1;
        let mut tells = if alone { Time::NEVER } else { first + limits::BATCH_SEQUENCE };
        let mut deadline = batch.deadline();
        loop {
            match answered.recv_deadline(deadline.min(tells)) {
                Ok(()) | Err(RecvError::Closed) => {
                    return batch.not_begun(match sequence.taken_back.load(Ordering::Acquire) {
                        0 => Cause::Cancelled,
                        _ => Cause::Refused("the platform is being taken down".to_owned()),
                    });
                }
                Err(RecvError::Timeout) => {}
            }
            let at = sequence.at.load(Ordering::Acquire);
            let (now, due) = (self.clock.now(), batch.deadline());
            if now >= tells {
                tells = Time::NEVER;
                batch.tell();
            }
            if now < due {
                deadline = due;
            } else if !at.is_multiple_of(2) {
                if self.leave_behind(&sequence, at) {
                    return batch.answer(Outcome::Unknown(Cause::Timeout));
                }
            } else if sequence.move_on(at, OVER) {
                if at == 0 {
                    // No worker came to it in time, and none will begin it.
                    return batch.not_begun(Cause::Timeout);
                }
                // Between two steps there is nobody's code but ours: the worker sees it and answers.
                deadline = Time::NEVER;
            }
        }
    }

    /// Puts the component of the step under way in quarantine, if that is still under way. Whether it was.
    fn leave_behind(&self, sequence: &StepSequence, at: usize) -> bool {
        let mut registry = lock(&self.registry);
        if !sequence.move_on(at, OVER) {
            return false;
        }
        let step = &sequence.batch.steps()[at / 2].step;
        sequence.fresh.store(registry.quarantined.insert(step.component()), Ordering::Release);
        if let Step::Create { component, activity, .. } = step {
            registry.arrived(*component, activity.unwrap_or(self.default_activity));
        }
        true
    }

    /// The worker's side.
    fn run_sequence(&self, sequence: &StepSequence, first: Time) {
        for i in 0.. {
            let now = self.clock.now();
            if i > 0 && now.since(first) >= limits::BATCH_SEQUENCE {
                return;
            }
            let [timed] = sequence.batch.begin_at(1, now) else { return };
            if !sequence.begin(i) {
                return;
            }
            let SequenceEnd::Ended(outcome) =
                self.make_or_drop(&timed.step, StepRunner(Some((sequence, i)), sequence.batch.deadline()))
            else {
                return;
            };
            sequence.batch.note(outcome, self.clock.now());
        }
    }

    /// Carries out a step of a type that promises to be made and dropped at once, in the caller's thread.
    pub(super) fn at_once(&self, step: &Step, deadline: Time) -> Outcome {
        match self.make_or_drop(step, StepRunner(None, deadline)) {
            SequenceEnd::Ended(outcome) => outcome,
            SequenceEnd::Late => Outcome::Unknown(Cause::Timeout),
        }
    }

    pub(super) fn is_dropped_at_once(&self, name: ComponentName) -> bool {
        let registry = lock(&self.registry);
        registry.find(name).is_ok_and(|slot| {
            let kind = &registry.entry(slot).cell.kind;
            kind.is_immediate() && !kind.has_hooks()
        })
    }

    fn make_or_drop(&self, step: &Step, place: StepRunner) -> SequenceEnd {
        match step {
            Step::Create { component, ty, activity, properties } => {
                self.create(*component, *ty, *activity, properties, place)
            }
            Step::Destroy { component } => self.destroy(*component, place),
            other => self.not_done(
                other.component(),
                Cause::Refused(format!("`{other}` neither makes nor drops a component")),
                place,
            ),
        }
    }

    fn create(
        &self,
        name: ComponentName,
        ty: TypeName,
        asked: Option<Ident>,
        values: &[Value],
        place: StepRunner,
    ) -> SequenceEnd {
        let not_done = |cause| self.not_done(name, cause, place);
        let Some(kind) = self.kinds.get(&ty) else {
            return not_done(Cause::Refused(format!("no library here makes a `{ty}`")));
        };
        let runs_in = asked.unwrap_or(self.default_activity);
        let Some(spec) = self.activities.get(&runs_in).copied() else {
            return not_done(Cause::Refused(format!("there is no activity `{runs_in}`")));
        };
        if let Err(cause) = check_values(&kind.ty, values) {
            return not_done(cause);
        }
        let wake = {
            let mut registry = lock(&self.registry);
            if let Err(cause) = registry.is_free(name) {
                drop(registry);
                return not_done(cause);
            }
            let make = || {
                let inner = self.own.clone();
                let late = move |cell: &Arc<Cell>| {
                    if let Some(inner) = inner.upgrade() {
                        inner.come_back(cell.clone());
                    }
                };
                ActivityThread::new(runs_in, spec, &self.clock, Box::new(late))
            };
            let scheduled = registry.scheduled(runs_in, make, &self.clock);
            scheduled.expected.push(name);
            let activity = &scheduled.activity;
            activity.is_event_driven().then(|| activity.signal.clone())
        };
        // The component's own code, outside the lock: whatever it does delays nobody.
        let beat = Arc::new(Beat::new(name, wake, self.notices.clone()));
        beat.set_now(self.clock.now());
        let made = guard::call(|| kind.make(&beat, values.to_vec()));
        let mut registry = lock(&self.registry);
        if !place.in_time() {
            registry.arrived(name, runs_in);
            drop(registry);
            let _ = guard::call(|| drop(made));
            return self.back_again(name, place);
        }
        let result = match made {
            Err(panic) => Err(Cause::Panicked(panic)),
            Ok(Err(text)) => Err(Cause::Refused(text)),
            Ok(Ok(made)) => match registry.is_free(name) {
                Err(cause) => {
                    // Somebody else was quicker. Its own code again, so not under the lock.
                    registry.arrived(name, runs_in);
                    drop(registry);
                    let _ = guard::call(|| drop(made));
                    return SequenceEnd::Ended(Outcome::NotDone(cause));
                }
                Ok(()) => {
                    let cell = Arc::new(Cell::new(kind.clone(), beat, made.body));
                    registry.insert(cell, made.ends, made.values, asked, runs_in);
                    Ok(())
                }
            },
        };
        registry.arrived(name, runs_in);
        SequenceEnd::Ended(super::steps::outcome(result))
    }

    fn destroy(&self, name: ComponentName, place: StepRunner) -> SequenceEnd {
        let taken = self.when_free(
            (name, "destroy"),
            place.1,
            || false,
            || {
                let mut registry = lock(&self.registry);
                let slot = registry.find(name)?;
                let cell = registry.entry(slot).cell.clone();
                if cell.gate.is_quarantined() {
                    return Err(Cause::Quarantined);
                }
                registry.is_unconnected(slot)?;
                let may = |state| matches!(state, RunState::Unconfigured | RunState::Faulted);
                Ok(CellGuard::idle(&*cell, false, may).map(|mut inside| {
                    let body = inside.take();
                    // Nobody enters it again, whoever still knows it.
                    inside.close();
                    (body, registry.remove(slot))
                }))
            },
        );
        let taken = match taken {
            Ok(taken) => taken,
            Err(cause) => return self.not_done(name, cause, place),
        };
        // The component's own code, here too: it may close devices.
        let dropped = guard::call(|| drop(taken));
        if let Err(reason) = dropped {
            // It is gone all the same.
            self.notices.send(Notice::Faulted { component: name, reason, at: self.clock.now() });
        }
        if place.in_time() { SequenceEnd::Ended(Outcome::Done(None)) } else { self.back_again(name, place) }
    }

    /// It did not happen, and nothing of the component's own code was called.
    fn not_done(&self, name: ComponentName, cause: Cause, place: StepRunner) -> SequenceEnd {
        if place.in_time() { SequenceEnd::Ended(Outcome::NotDone(cause)) } else { self.back_again(name, place) }
    }

    /// What was given up has come back, and nothing is left of it.
    fn back_again(&self, name: ComponentName, place: StepRunner) -> SequenceEnd {
        let mut registry = lock(&self.registry);
        if place.0.is_some_and(|(sequence, _)| sequence.fresh.load(Ordering::Acquire)) {
            registry.quarantined.remove(&name);
            drop(registry);
            self.tell(PlatformEvent::Returned { component: name, at: self.clock.now() });
        }
        SequenceEnd::Late
    }
}
