//! Brief steps: components are made, and dropped, by their own code. It hardly takes time, but it is theirs and may hang:
//! a worker runs it, many steps in one go, so that the thread's round trip is paid once for all of them.
//!
//! A [`Turn`] says how far the worker is. Whoever waits gives a step up when its time is over: its component is then in
//! quarantine, what the worker brings back too late is dropped, and nothing more is begun.

use super::under_way::What;
use super::wiring::check_values;
use super::workers::Job;
use super::{Inner, Outcome};
use crate::limits;
use crate::model::{ComponentName, Ident, RunState, Step, TypeName, Value};
use crate::platform::{Cause, Ended, PlatformEvent};
use crate::runtime::activity::Activity;
use crate::runtime::beat::Beat;
use crate::runtime::cell::{Cell, Inside};
use crate::runtime::{Notice, guard};
use crate::time::{RecvError, Time, lock};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Steps that a worker carries out one after the other.
pub(super) struct Turn {
    steps: Vec<Step>,
    /// `2 i`: step `i` has not begun, the one before has come to its end; `2 i + 1`: it is under way; [`OVER`]: nobody
    /// waits.
    at: AtomicUsize,
    /// When the step under way began.
    began: AtomicU64,
    ended: Mutex<Vec<Ended>>,
    /// Whether the one that was given up was not in quarantine before.
    fresh: AtomicBool,
    /// This step and those behind it were taken back: they do not begin.
    taken_back: AtomicUsize,
}

/// Nothing more is begun, and what is under way comes back too late.
const OVER: usize = usize::MAX;

impl Turn {
    fn move_on(&self, from: usize, to: usize) -> bool {
        self.at.compare_exchange(from, to, Ordering::AcqRel, Ordering::Acquire).is_ok()
    }

    /// Step `i` begins; false: nobody waits any more, or it was taken back.
    fn begin(&self, i: usize, now: Time) -> bool {
        self.began.store(now.0, Ordering::Release);
        i < self.taken_back.load(Ordering::Acquire) && self.move_on(2 * i, 2 * i + 1)
    }

    /// Takes `step` back, and what comes after it, unless it has begun.
    pub(super) fn take_back(&self, step: &Step) {
        if let Some(i) = self.steps.iter().position(|own| own == step) {
            self.taken_back.fetch_min(i, Ordering::AcqRel);
        }
    }
}

/// Who carries a step out: a worker, as number so and so of a turn, or whoever calls.
#[derive(Clone, Copy)]
struct Place<'a>(Option<(&'a Turn, usize)>);

impl Place<'_> {
    /// The step has come to its end in time. Asked once, before its effect can be seen, so that nobody gives up what is
    /// there.
    fn in_time(self) -> bool {
        self.0.is_none_or(|(turn, i)| turn.move_on(2 * i + 1, 2 * i + 2))
    }
}

/// How one of them ended.
enum Brief {
    Ended(Outcome),
    /// After it had been given up; it has been cleaned up.
    Late,
}

impl Inner {
    /// Carries out steps that make or destroy components, one after the other, each within `each` and before `until`: as
    /// many as are done at once. No further one is begun after one that is not done, nor a while after the first.
    /// Once `stop` is set none is begun either.
    pub(super) fn in_turn(&self, steps: Vec<Step>, each: Duration, until: Time, stop: &Arc<AtomicBool>) -> Vec<Ended> {
        let first = self.clock.now();
        let turn = Arc::new(Turn {
            steps,
            at: AtomicUsize::new(0),
            began: AtomicU64::new(first.0),
            ended: Mutex::default(),
            fresh: AtomicBool::new(false),
            taken_back: AtomicUsize::new(usize::MAX),
        });
        let _entered = self.under_way.enter(What::Turn(turn.clone()));
        let (answer, answered) = self.clock.channel(1);
        let job: Job = {
            let (inner, turn, stop) = (self.own.clone(), turn.clone(), stop.clone());
            Box::new(move || {
                if let Some(inner) = inner.upgrade() {
                    inner.take_turn(&turn, first, &stop);
                }
                let _ = answer.try_send(());
            })
        };
        if let Err(text) = self.workers.run(job) {
            return vec![Ended { outcome: Outcome::NotDone(Cause::Refused(text)), took: None }];
        }
        let mut deadline = (first + each).min(until);
        loop {
            match answered.recv_deadline(deadline) {
                Ok(()) | Err(RecvError::Closed) => {
                    let mut ended = std::mem::take(&mut *lock(&turn.ended));
                    if ended.is_empty() {
                        let cause = match turn.taken_back.load(Ordering::Acquire) {
                            0 => Cause::Cancelled,
                            _ => Cause::Refused("the platform is being taken down".to_owned()),
                        };
                        ended.push(Ended { outcome: Outcome::NotDone(cause), took: None });
                    }
                    return ended;
                }
                Err(RecvError::Timeout) => {}
            }
            let at = turn.at.load(Ordering::Acquire);
            let due = (Time(turn.began.load(Ordering::Acquire)) + each).min(until);
            if self.clock.now() < due {
                deadline = due;
            } else if !at.is_multiple_of(2) {
                if self.leave_behind(&turn, at) {
                    let mut ended = std::mem::take(&mut *lock(&turn.ended));
                    ended.push(Ended { outcome: Outcome::Unknown(Cause::Timeout), took: None });
                    return ended;
                }
            } else if turn.move_on(at, OVER) {
                if at == 0 {
                    // No worker came to it in time, and none will begin it.
                    return vec![Ended { outcome: Outcome::NotDone(Cause::Timeout), took: None }];
                }
                // Between two steps there is nobody's code but ours: the worker sees it and answers.
                deadline = Time::NEVER;
            }
        }
    }

    /// Puts the component of the step under way in quarantine, if that is still under way. Whether it was.
    fn leave_behind(&self, turn: &Turn, at: usize) -> bool {
        let mut registry = lock(&self.registry);
        if !turn.move_on(at, OVER) {
            return false;
        }
        let step = &turn.steps[at / 2];
        turn.fresh.store(registry.quarantined.insert(step.component()), Ordering::Release);
        if let Step::Create { component, activity, .. } = step {
            registry.arrived(*component, activity.unwrap_or(self.default_activity));
        }
        true
    }

    /// The worker's side.
    fn take_turn(&self, turn: &Turn, first: Time, stop: &AtomicBool) {
        for (i, step) in turn.steps.iter().enumerate() {
            let now = self.clock.now();
            let enough = now.since(first) >= limits::BRIEF_TURN || stop.load(Ordering::Acquire);
            if i > 0 && enough || !turn.begin(i, now) {
                return;
            }
            let Brief::Ended(outcome) = self.brief(step, Place(Some((turn, i)))) else { return };
            let done = matches!(outcome, Outcome::Done(_));
            lock(&turn.ended).push(Ended { outcome, took: Some(self.clock.now().since(now)) });
            if !done {
                return;
            }
        }
    }

    /// Carries out a step of a type that promises to be made and dropped at once, in the caller's thread.
    pub(super) fn at_once(&self, step: &Step) -> Outcome {
        match self.brief(step, Place(None)) {
            Brief::Ended(outcome) => outcome,
            Brief::Late => Outcome::Unknown(Cause::Timeout),
        }
    }

    pub(super) fn is_dropped_at_once(&self, name: ComponentName) -> bool {
        let registry = lock(&self.registry);
        registry.find(name).is_ok_and(|slot| {
            let kind = &registry.entry(slot).cell.kind;
            kind.is_immediate() && !kind.has_hooks()
        })
    }

    fn brief(&self, step: &Step, place: Place) -> Brief {
        match step {
            Step::Create { component, ty, activity, properties } => {
                self.create(*component, *ty, *activity, properties, place)
            }
            Step::Destroy { component } => self.destroy(*component, place),
            other => self.not_done(other.component(), Cause::Refused(format!("`{other}` is not brief")), place),
        }
    }

    fn create(&self, name: ComponentName, ty: TypeName, asked: Option<Ident>, values: &[Value], place: Place) -> Brief {
        let not_done = |cause| self.not_done(name, cause, place);
        let Some(kind) = self.kinds.get(&ty) else {
            return not_done(Cause::Refused(format!("no library here makes a `{ty}`")));
        };
        let crew = asked.unwrap_or(self.default_activity);
        let Some(spec) = self.activities.get(&crew).copied() else {
            return not_done(Cause::Refused(format!("there is no activity `{crew}`")));
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
                Activity::new(crew, spec, &self.clock, Box::new(late))
            };
            let crew = registry.crew(crew, make, &self.clock);
            crew.expected.push(name);
            let activity = &crew.activity;
            activity.is_event_driven().then(|| activity.signal.clone())
        };
        // The component's own code, outside the lock: whatever it does delays nobody.
        let beat = Arc::new(Beat::new(name, wake, self.notices.clone()));
        beat.set_now(self.clock.now());
        let made = guard::call(|| kind.make(&beat, values.to_vec()));
        let mut registry = lock(&self.registry);
        if !place.in_time() {
            registry.arrived(name, crew);
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
                    registry.arrived(name, crew);
                    drop(registry);
                    let _ = guard::call(|| drop(made));
                    return Brief::Ended(Outcome::NotDone(cause));
                }
                Ok(()) => {
                    let cell = Arc::new(Cell::new(kind.clone(), beat, made.body));
                    registry.insert(cell, made.ends, made.values, asked, crew);
                    Ok(())
                }
            },
        };
        registry.arrived(name, crew);
        Brief::Ended(super::steps::outcome(result))
    }

    fn destroy(&self, name: ComponentName, place: Place) -> Brief {
        let mut registry = lock(&self.registry);
        let taken = registry.find(name).and_then(|slot| {
            let cell = registry.entry(slot).cell.clone();
            if cell.gate.is_quarantined() {
                return Err(Cause::Quarantined);
            }
            registry.is_unconnected(slot)?;
            let may = |state| matches!(state, RunState::Unconfigured | RunState::Faulted);
            let mut inside =
                Inside::idle(&*cell, false, may).map_err(|why| super::steps::closed(why, name, "destroy"))?;
            let body = inside.take();
            // Nobody enters it again, whoever still knows it.
            inside.close();
            Ok((body, registry.remove(slot)))
        });
        drop(registry);
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
        if place.in_time() { Brief::Ended(Outcome::Done(None)) } else { self.back_again(name, place) }
    }

    /// It did not happen, and nothing of the component's own code was called.
    fn not_done(&self, name: ComponentName, cause: Cause, place: Place) -> Brief {
        if place.in_time() { Brief::Ended(Outcome::NotDone(cause)) } else { self.back_again(name, place) }
    }

    /// What was given up has come back, and nothing is left of it.
    fn back_again(&self, name: ComponentName, place: Place) -> Brief {
        let mut registry = lock(&self.registry);
        if place.0.is_some_and(|(turn, _)| turn.fresh.load(Ordering::Acquire)) {
            registry.quarantined.remove(&name);
            drop(registry);
            self.tell(PlatformEvent::Returned { component: name, at: self.clock.now() });
        }
        Brief::Late
    }
}
