//! The calls that take time: what is under way, what was given up, what waits until a component has come to rest.

use super::{SimulatedInner, SimulatedState};
use crate::model::{ComponentName, Step};
use crate::platform::{Cause, Outcome};
use crate::time::{Receiver, Sender, Time};

/// A call under way.
pub(super) struct Under {
    number: u64,
    step: Step,
    begun: bool,
    /// It was given up.
    told: bool,
    /// The component takes no notice of that.
    deaf: bool,
    wake: Sender<()>,
}

/// The list of them.
#[derive(Default)]
pub(super) struct Calls {
    list: Vec<Under>,
    numbers: u64,
}

impl Calls {
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Whether a call that was given up is still at work in the component.
    pub fn is_restless(&self, component: ComponentName) -> bool {
        self.list.iter().any(|call| call.begun && call.told && call.step.component() == component)
    }

    /// Gives up the calls for exactly this step. Only operations can be told once they have begun.
    pub fn cancel(&mut self, step: &Step) {
        for call in self.list.iter_mut().filter(|call| call.step == *step) {
            if !call.begun || matches!(step, Step::Operation(_)) {
                call.told = true;
                let _ = call.wake.try_send(());
            }
        }
    }
}

/// One's own call, in the list until this is dropped.
pub(super) struct Own<'a> {
    shared: &'a SimulatedInner,
    number: u64,
    woken: Receiver<()>,
}

impl<'a> Own<'a> {
    /// Enters a call that has not begun yet.
    pub fn enter(shared: &'a SimulatedInner, step: &Step, deaf: bool) -> Self {
        let (wake, woken) = shared.clock.channel(1);
        let calls = &mut shared.lock().calls;
        calls.numbers += 1;
        let number = calls.numbers;
        calls.list.push(Under { number, step: step.clone(), begun: false, told: false, deaf, wake });
        Self { shared, number, woken }
    }

    /// Begins; an operation (unless `safe`) only when its component has come to rest from those that were given up.
    ///
    /// # Errors
    /// The outcome of the step, when it never begins.
    pub fn begin(&self, safe: bool, deadline: Time) -> Result<(), Outcome> {
        loop {
            {
                let mut state = self.shared.lock();
                let SimulatedState { calls, quarantine, .. } = &mut *state;
                let Some(at) = calls.list.iter().position(|call| call.number == self.number) else { return Ok(()) };
                let (step, told) = (&calls.list[at].step, calls.list[at].told);
                let component = step.component();
                let waits = !safe && matches!(step, Step::Operation(_)) && calls.is_restless(component);
                if told {
                    return Err(Outcome::NotDone(Cause::Cancelled));
                }
                if !waits {
                    calls.list[at].begun = true;
                    return Ok(());
                }
                if quarantine.contains(&component) {
                    return Err(Outcome::NotDone(Cause::Quarantined));
                }
            }
            if self.woken.recv_deadline(deadline).is_err() {
                return Err(Outcome::NotDone(Cause::Timeout));
            }
        }
    }

    /// Lets the call take its time; true: it was given up before, and the component has heard it.
    pub fn takes_until(&self, time: Time) -> bool {
        loop {
            let heard = self.shared.lock().calls.list.iter().any(|c| c.number == self.number && c.told && !c.deaf);
            if heard || self.woken.recv_deadline(time).is_err() {
                return heard;
            }
        }
    }
}

impl Drop for Own<'_> {
    fn drop(&mut self) {
        let calls = &mut self.shared.lock().calls;
        if let Some(at) = calls.list.iter().position(|call| call.number == self.number) {
            calls.list.remove(at);
        }
        for call in calls.list.iter().filter(|call| !call.begun) {
            let _ = call.wake.try_send(());
        }
    }
}
