//! Carrying out a step: what it does to the world, how long it takes, what goes wrong with it.

use super::calls::Own;
use super::{Due, Fault, Simulated, SimulatedState};
use crate::model::{ComponentName, EventName, Step, Value};
use crate::platform::{Cause, Outcome};
use crate::time::Time;
use std::time::Duration;

impl Simulated {
    pub(super) fn execute(&self, step: &Step, value: Option<&Value>, deadline: Time, safe: bool) -> Outcome {
        let with_value;
        let step = match value {
            None => step,
            Some(value) => {
                with_value = with(step, value);
                &with_value
            }
        };
        let (fault, delay, alone) = {
            let mut state = self.shared.lock();
            let plain = state.faults.rules.is_empty() && state.delays.is_none() && state.reactions.is_empty();
            if plain && state.calls.is_empty() {
                state.asked += 1;
                if state.quarantined(step, safe) {
                    return Outcome::NotDone(Cause::Quarantined);
                }
                return Self::now(&mut state, step);
            }
            let (fault, slow) = state.fault(step);
            if state.quarantined(step, safe) {
                return Outcome::NotDone(Cause::Quarantined);
            }
            (fault, slow.unwrap_or_else(|| state.delay(step)), state.calls.is_empty())
        };
        if delay.is_zero() && alone {
            return self.carry_out(step, fault, None, deadline);
        }
        let own = Own::enter(&self.shared, step, fault == Some(Fault::Deaf));
        match own.begin(safe, deadline) {
            Ok(()) => self.carry_out(step, fault, Some((delay, &own)), deadline),
            Err(outcome) => outcome,
        }
    }

    /// `own`: how long it takes, and the call by which it can be given up meanwhile.
    fn carry_out(&self, step: &Step, fault: Option<Fault>, own: Option<(Duration, &Own)>, deadline: Time) -> Outcome {
        let end = self.shared.clock.now() + own.map_or(Duration::ZERO, |(delay, _)| delay);
        match fault {
            Some(Fault::Hang { returns }) => return self.hang(step, returns.map(|after| deadline + after), deadline),
            Some(fault @ (Fault::LostAnswer | Fault::LostRequest)) => {
                // Whoever gives it up is not heard either.
                if fault == Fault::LostAnswer {
                    self.shared.clock.sleep_until(end.min(deadline));
                    if let Outcome::Done(_) = self.let_happen(step) {
                        self.react(step);
                    }
                }
                self.shared.clock.sleep_until(deadline);
                return Outcome::Unknown(Cause::Timeout);
            }
            _ => {}
        }
        if end > deadline
            && let Err(why) = self.shared.lock().world.check(step)
        {
            return Outcome::NotDone(Cause::Refused(why));
        }
        let given_up = own.is_some_and(|(_, own)| own.takes_until(end.min(deadline)));
        if !given_up && end > deadline {
            return self.hang(step, Some(end), deadline);
        }
        match fault {
            Some(Fault::Panic) => self.panic(step),
            Some(Fault::FalseDone) => Outcome::Done(None),
            Some(Fault::FalseNotDone) => match self.let_happen(step) {
                Outcome::Done(_) => Outcome::NotDone(Cause::Failed("a false answer was injected".to_owned())),
                other => other,
            },
            // What was given up half way counts as done, also where it would have failed; but nothing follows from it.
            _ if given_up => match self.let_happen(step) {
                Outcome::Done(_) => Outcome::Done(None),
                other => other,
            },
            Some(Fault::Fail) => Outcome::NotDone(Cause::Failed("a failure was injected".to_owned())),
            _ => {
                let outcome = self.let_happen(step);
                if matches!(outcome, Outcome::Done(_)) {
                    self.react(step);
                }
                outcome
            }
        }
    }

    /// [`Self::now`] with the lock held for just that: a temporary guard would live as long as a `match` on the outcome.
    fn let_happen(&self, step: &Step) -> Outcome {
        let mut state = self.shared.lock();
        Self::now(&mut state, step)
    }

    fn now(state: &mut SimulatedState, step: &Step) -> Outcome {
        match state.world.check(step) {
            Err(why) => Outcome::NotDone(Cause::Refused(why)),
            Ok(()) => {
                let result = state.world.apply(step);
                if let Some(executed) = &mut state.executed {
                    executed.push(step.clone());
                }
                Outcome::Done(result)
            }
        }
    }

    fn panic(&self, step: &Step) -> Outcome {
        let component = step.component();
        let reason = "a panic was injected";
        let refused = self.shared.lock().world.check(step);
        if let Err(why) = refused {
            return Outcome::NotDone(Cause::Refused(why));
        }
        self.fault(component, reason);
        Outcome::NotDone(Cause::Panicked(reason.to_owned()))
    }

    /// The call does not answer; the component is in quarantine until it `returns`.
    fn hang(&self, step: &Step, returns: Option<Time>, deadline: Time) -> Outcome {
        {
            let mut state = self.shared.lock();
            if let Err(why) = state.world.check(step) {
                return Outcome::NotDone(Cause::Refused(why));
            }
            state.quarantine.insert(step.component());
        }
        if let Some(at) = returns {
            self.shared.later(at, Due::Returned(step.component()));
        }
        self.shared.clock.sleep_until(deadline);
        Outcome::Unknown(Cause::Timeout)
    }

    fn react(&self, step: &Step) {
        let due: Vec<(Duration, EventName, ComponentName)> = {
            let state = self.shared.lock();
            let fitting = state.reactions.iter().filter(|reaction| reaction.on.matches(step));
            fitting.map(|reaction| (reaction.after, reaction.raise, reaction.component)).collect()
        };
        for (after, event, component) in due {
            let due = Due::Raised { event, component };
            if after.is_zero() {
                self.shared.happen(due);
            } else {
                self.shared.later(self.shared.clock.now() + after, due);
            }
        }
    }
}

/// `step` with another value (property and port writes; others stay as they are).
fn with(step: &Step, value: &Value) -> Step {
    match step {
        Step::PropertySet { property, .. } => Step::PropertySet { property: *property, value: value.clone() },
        Step::PortWrite { port, .. } => Step::PortWrite { port: *port, value: Some(value.clone()) },
        other => other.clone(),
    }
}
