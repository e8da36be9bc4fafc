//! Prepared lists of steps: names resolved, memory taken. Carrying one out takes the registry's lock (which no activity
//! takes), touches atomic words, and allocates nothing.

use super::steps::outcome;
use super::{Inner, Outcome};
use crate::model::{Step, Transition, Value};
use crate::platform::{Cause, Prepared};
use crate::time::{Time, lock};
use std::sync::Arc;

struct EmbeddedPrepared {
    inner: Arc<Inner>,
    steps: Vec<Handle>,
    waited: bool,
}

struct Handle {
    slot: u32,
    /// Of the component that was in the slot.
    number: u64,
    act: Act,
}

enum Act {
    Shift(Transition),
    Property(usize, Value),
    Port(usize, Option<Value>),
}

/// None when a step is none of these, runs a component's own code, or names what is not there.
pub(super) fn prepare(inner: &Arc<Inner>, steps: &[Step]) -> Option<Box<dyn Prepared>> {
    let mut registry = lock(&inner.registry);
    let mut handles = Vec::with_capacity(steps.len());
    for step in steps {
        let slot = registry.find(step.component()).ok()?;
        let act = match step {
            Step::State { transition, .. } if !registry.entry(slot).cell.kind.has_hook(*transition) => {
                if *transition == Transition::Start {
                    // Its thread must not have to be made later.
                    registry.enlist(slot, &inner.clock).ok()?;
                }
                Act::Shift(*transition)
            }
            Step::PropertySet { property, value } => {
                Act::Property(registry.property(slot, property.member).ok()?, value.clone())
            }
            Step::PortWrite { port, value } => {
                let index = registry.writable(slot, port.member).ok()?;
                registry.prepare_port(slot, index, value.as_ref());
                Act::Port(index, value.clone())
            }
            _ => return None,
        };
        handles.push(Handle { slot, number: registry.entry(slot).number, act });
    }
    drop(registry);
    Some(Box::new(EmbeddedPrepared { inner: inner.clone(), steps: handles, waited: false }))
}

impl Prepared for EmbeddedPrepared {
    fn execute(&mut self, index: usize, value: Option<&Value>, now: Time, deadline: Time) -> Outcome {
        let Some(Handle { slot, number, act }) = self.steps.get(index) else {
            return Outcome::NotDone(Cause::Refused("there is no such prepared step".to_owned()));
        };
        self.waited = false;
        let inner = &self.inner;
        let mut registry = lock(&inner.registry);
        if !registry.still(*slot, *number) {
            return Outcome::NotDone(Cause::Refused("the component is not there any more".to_owned()));
        }
        match act {
            Act::Property(index, prepared) => {
                outcome(registry.set_property(*slot, *index, value.unwrap_or(prepared), false))
            }
            Act::Port(index, prepared) => {
                outcome(registry.write_port(*slot, *index, value.or(prepared.as_ref()), now, false))
            }
            Act::Shift(transition) => {
                let cell = registry.entry(*slot).cell.clone();
                let shifted = inner.shift(&mut registry, *slot, *transition, false);
                drop(registry);
                self.waited = cell.gate.is_busy();
                if let Err(cause) = inner.shifted_when_free(shifted, (cell.name, *transition), deadline, false) {
                    return Outcome::NotDone(cause);
                }
                if *transition != Transition::Stop || !cell.gate.is_busy() {
                    return Outcome::Done(None);
                }
                self.waited = true;
                match inner.await_idle(&cell, deadline) {
                    Ok(()) => Outcome::Done(None),
                    Err(outcome) => outcome,
                }
            }
        }
    }

    fn waited(&self) -> bool {
        self.waited
    }
}
