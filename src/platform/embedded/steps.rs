//! Carrying out steps: the immediate ones here, the others by [`step_sequence`](super::step_sequence) and [`calls`](super::calls).

use super::registry::Registry;
use super::under_way::{HookSettlement, What};
use super::{Inner, Outcome};
use crate::model::{ComponentName, Policy, RunState, Step, Transition};
use crate::platform::{Cause, PlatformEvent, StepBatch, TimedStep};
use crate::runtime::cell::Cell;
use crate::runtime::gate::Closed;
use crate::time::{Clock, Time, lock};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// `Ok(())` as *done*, an error as *not done*.
pub(super) fn outcome(result: Result<(), Cause>) -> Outcome {
    match result {
        Ok(()) => Outcome::Done(None),
        Err(cause) => Outcome::NotDone(cause),
    }
}

/// How long to look again and again for an update to end before sleeping between looks: most updates are shorter.
const SPINS: u32 = 200;
/// The first of these sleeps; each is twice as long as the one before, up to the last.
const FIRST_SLEEP: Duration = Duration::from_micros(20);
const LAST_SLEEP: Duration = Duration::from_millis(1);

/// Sleeping between looks at something that cannot wake whoever looks.
pub(super) struct Naps(Duration);

impl Default for Naps {
    fn default() -> Self {
        Self(FIRST_SLEEP)
    }
}

impl Naps {
    /// Sleeps for a while, longer each time, at most until `deadline`; false: it is past.
    pub(super) fn take(&mut self, clock: &Clock, deadline: Time) -> bool {
        let now = clock.now();
        if now >= deadline {
            return false;
        }
        clock.sleep_until((now + self.0).min(deadline));
        self.0 = (self.0 * 2).min(LAST_SLEEP);
        true
    }
}

/// What came of going in at a component's gate.
pub(super) type GateResult<T> = Result<Result<T, Closed>, Cause>;

/// What is to be done with which component.
pub(super) type Errand<'a> = (ComponentName, &'a str);

/// Whether somebody else is inside, who will leave.
fn is_busy<T>(entered: &GateResult<T>) -> bool {
    matches!(entered, Ok(Err(Closed::Busy)))
}

/// Who is still inside was waited for.
pub(super) fn opened<T>(entered: GateResult<T>, (name, what): Errand) -> Result<T, Cause> {
    entered?.map_err(|why| match why {
        Closed::State(state) => Cause::Refused(format!("cannot {what} `{name}` while it is {state}")),
        Closed::Busy => Cause::Timeout,
        Closed::Quarantined => Cause::Quarantined,
    })
}

impl Inner {
    /// `safe`: a step of a `safe` configuration, which quarantine does not keep out where it can be let in.
    pub(super) fn execute(&self, step: &Step, deadline: Time, safe: bool) -> Outcome {
        match step {
            Step::State { component, transition } => self.transition(*component, *transition, deadline, safe),
            Step::Create { ty, .. } if self.kinds.get(ty).is_none_or(|kind| kind.is_immediate()) => {
                self.at_once(step, deadline)
            }
            Step::Destroy { component } if self.is_dropped_at_once(*component) => self.at_once(step, deadline),
            Step::Create { .. } | Step::Destroy { .. } => {
                let alone = TimedStep { step: step.clone(), patience: Duration::MAX, until: deadline };
                let batch = StepBatch::new(self.clock.clone(), vec![alone]);
                self.in_sequence(&batch);
                batch.take(true).pop().map_or(Outcome::Unknown(Cause::Timeout), |answer| answer.outcome)
            }
            Step::Connect { from, to, policy } => outcome(self.connect(*from, *to, *policy)),
            Step::Disconnect { from, to } => outcome(lock(&self.registry).disconnect(*from, *to)),
            Step::PropertySet { property, value } => {
                let mut registry = lock(&self.registry);
                outcome(registry.find(property.component).and_then(|slot| {
                    let index = registry.property(slot, property.member)?;
                    registry.set_property(slot, index, value, safe)
                }))
            }
            Step::PortWrite { port, value } => {
                let mut registry = lock(&self.registry);
                outcome(registry.find(port.component).and_then(|slot| {
                    let index = registry.writable(slot, port.member)?;
                    registry.write_port(slot, index, value.as_ref(), self.clock.now(), safe)
                }))
            }
            Step::Operation(call) => self.operation(call, deadline, safe),
        }
    }

    fn connect(&self, from: crate::model::MemberRef, to: crate::model::MemberRef, policy: Policy) -> Result<(), Cause> {
        lock(&self.registry).connect(from, to, policy)
    }

    fn transition(&self, name: ComponentName, transition: Transition, deadline: Time, safe: bool) -> Outcome {
        let (cell, stopped) = {
            let mut registry = lock(&self.registry);
            let slot = match registry.find(name) {
                Ok(slot) => slot,
                Err(cause) => return Outcome::NotDone(cause),
            };
            let cell = registry.entry(slot).cell.clone();
            let hook = cell.kind.has_hook(transition);
            if transition == Transition::Stop || !hook {
                let shifted = self.shift(&mut registry, slot, transition, safe);
                drop(registry);
                if let Err(cause) = self.shifted_when_free(shifted, (name, transition), deadline, safe) {
                    return Outcome::NotDone(cause);
                }
                if !hook && !cell.gate.is_busy() {
                    return Outcome::Done(None);
                }
            }
            (cell, transition == Transition::Stop)
        };
        if stopped && let Err(outcome) = self.await_idle(&cell, deadline) {
            return outcome;
        }
        if cell.kind.has_hook(transition) { self.hook(&cell, transition, deadline, safe) } else { Outcome::Done(None) }
    }

    /// Does what a component's gate must let in, as soon as nobody is inside: an injected delay holds it for a while, and so
    /// does a call that was given up.
    ///
    /// # Errors
    /// It was withdrawn, or the deadline came, while somebody was inside; or the gate stays closed.
    pub(super) fn when_free<T>(
        &self,
        errand: Errand,
        deadline: Time,
        withdrawn: impl Fn() -> bool,
        mut enter: impl FnMut() -> GateResult<T>,
    ) -> Result<T, Cause> {
        let mut naps = Naps::default();
        loop {
            let entered = enter();
            if !is_busy(&entered) {
                return opened(entered, errand);
            }
            if withdrawn() {
                return Err(Cause::Cancelled);
            }
            if !naps.take(&self.clock, deadline) {
                return Err(Cause::Timeout);
            }
        }
    }

    /// What came of a [`shift`](Self::shift), which is tried again until nobody is inside the component.
    pub(super) fn shifted_when_free(
        &self,
        shifted: GateResult<()>,
        (name, transition): (ComponentName, Transition),
        deadline: Time,
        safe: bool,
    ) -> Result<(), Cause> {
        let errand = (name, transition.as_str());
        if !is_busy(&shifted) {
            return opened(shifted, errand);
        }
        let settled = Arc::new(HookSettlement::default());
        let _entered = self.under_way.enter(What::Hook(name, transition, settled.clone()));
        self.when_free(
            errand,
            deadline,
            || settled.is_withdrawn(),
            || {
                let mut registry = lock(&self.registry);
                let slot = registry.find(name)?;
                self.shift(&mut registry, slot, transition, safe)
            },
        )
    }

    /// Moves a component to another state, without its hook and without waiting.
    pub(super) fn shift(
        &self,
        registry: &mut Registry,
        slot: u32,
        transition: Transition,
        safe: bool,
    ) -> GateResult<()> {
        if transition == Transition::Start {
            registry.enlist(slot, &self.clock)?;
        }
        let cell = &registry.entry(slot).cell;
        if transition == Transition::Start && cell.state() == RunState::Stopped {
            cell.restart();
        }
        if let Err(why) = cell.gate.shift(transition, safe) {
            return Ok(Err(why));
        }
        match transition {
            Transition::Start => registry.activity_of(slot).activity.started(cell),
            Transition::Stop => registry.activity_of(slot).activity.stopped(cell),
            Transition::Configure | Transition::Cleanup => {}
        }
        Ok(Ok(()))
    }

    /// Waits until the update under way of a component that has been stopped has ended.
    ///
    /// # Errors
    /// The outcome of the stop, when it is not simply done.
    pub(super) fn await_idle(&self, cell: &Arc<Cell>, deadline: Time) -> Result<(), Outcome> {
        let mut naps = Naps::default();
        let mut spins = if self.clock.is_simulated() { SPINS } else { 0 };
        while cell.gate.is_busy() {
            if spins < SPINS {
                spins += 1;
                std::hint::spin_loop();
                continue;
            }
            if !naps.take(&self.clock, deadline) {
                if self.give_up(cell, true, || true) {
                    return Err(Outcome::Unknown(Cause::Timeout));
                }
                break;
            }
        }
        match cell.state() {
            RunState::Faulted => {
                Err(Outcome::NotDone(Cause::Failed("it became faulted while it was being stopped".to_owned())))
            }
            _ => Ok(()),
        }
    }

    /// Puts a component in quarantine because a call of it has not returned, if it still has not and `really` says so too.
    /// Whether it is.
    /// `in_activity`: the call holds up the component's activity.
    pub(super) fn give_up(&self, cell: &Arc<Cell>, in_activity: bool, really: impl FnOnce() -> bool) -> bool {
        let mut registry = lock(&self.registry);
        let Some(was_running) = (if really() { cell.gate.quarantine() } else { None }) else { return false };
        registry.quarantined.insert(cell.name);
        let stuck = registry.find(cell.name).ok().map(|slot| {
            let activity = &registry.activity_of(slot).activity;
            if was_running {
                activity.running.fetch_sub(1, Ordering::SeqCst);
            }
            in_activity.then_some(activity.name)
        });
        drop(registry);
        if let Some(Some(activity)) = stuck {
            // In the platform's own name: an update or operation of this component holds its whole activity up.
            if let Ok(event) = crate::model::EventName::new(&format!("{activity}.stuck")) {
                self.tell(PlatformEvent::Raised { event, component: cell.name, at: self.clock.now() });
            }
        }
        true
    }
}
