//! Evaluates the conditions that the configurator needs: what configurations stand for, and what settles calls (semantics:
//! *Configurations*, *What goes wrong*). By the monitors' own evaluator, without any component, on a thread of its own.
//!
//! Each condition has its own look at the platform, from when it is asked for: so it sees what is written from then on and
//! nothing before.

use super::routes::Junction;
use crate::configurator::{Conditions, Truth};
use crate::limits;
use crate::model::monitor::Condition;
use crate::model::{Catalogue, ComponentName, ComponentType, Deployment};
use crate::monitor::{Bank, InputSample, MonitorInput};
use crate::platform::{Platform, Watch};
use crate::time::{Clock, Signal, Time, lock};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, Weak};

/// The conditions under evaluation.
pub(super) struct Evaluator {
    clock: Clock,
    platform: Arc<dyn Platform>,
    junction: Weak<Junction>,
    wake: Signal,
    state: Mutex<StandsState>,
}

#[derive(Default)]
struct StandsState {
    under: BTreeMap<u64, UnderWatch>,
    closing: bool,
}

/// A condition under evaluation.
struct UnderWatch {
    bank: Bank,
    watch: Option<Box<dyn Watch>>,
    /// Of the bank's inputs, then whether each component is faulted.
    samples: Vec<InputSample>,
    /// How many of them are the bank's, and which of these are ports.
    own: usize,
    ports: Vec<usize>,
    /// It looks at counters, which nobody tells of.
    counts: bool,
    truth: Truth,
}

/// Whether anything in a deployment needs to be evaluated.
pub(super) fn needed(deployment: &Deployment, catalogue: &Catalogue) -> bool {
    let settles = |ty: &ComponentType| ty.operations.values().any(|operation| operation.settled_by.is_some());
    deployment.configurations.iter().any(|c| c.holds.is_some()) || catalogue.iter().any(|ty| settles(ty))
}

impl UnderWatch {
    fn new(condition: &Condition, platform: &dyn Platform, wake: &Signal, now: Time) -> Self {
        let bank = Bank::alone(condition, now);
        let mut inputs = bank.inputs().to_vec();
        let own = inputs.len();
        let mut components: Vec<ComponentName> = Vec::new();
        condition.for_each_component(&mut |name, _| components.push(name));
        components.sort_unstable();
        components.dedup();
        inputs.extend(components.into_iter().map(MonitorInput::Faulted));
        let ports = (0..own).filter(|i| matches!(inputs[*i], MonitorInput::Port(_))).collect();
        let counts = inputs.iter().any(|input| matches!(input, MonitorInput::Activity { .. }));
        let watch = platform.watch(&inputs, wake);
        let unseen = watch.as_ref().is_none_or(|watch| !(0..own).all(|input| watch.shows(input)));
        let samples = vec![InputSample::default(); inputs.len()];
        Self { bank, watch, samples, own, ports, counts, truth: Truth { unseen, ..Truth::default() } }
    }

    /// Looks again. True: what is known is another.
    fn look(&mut self, now: Time) -> bool {
        if let Some(watch) = &mut self.watch {
            watch.look(now, &mut self.samples);
        }
        let samples = &self.samples;
        // What a component showed last is no word of it once it is faulted.
        let faulted = samples[self.own..].iter().any(|sample| sample.present && sample.value != 0.0);
        let so = if self.truth.unseen {
            true
        } else {
            self.bank.step(now, &mut |input| samples[input], &mut |_, _| {});
            self.bank.is_true(0) == Some(true)
        };
        let is = so && !faulted;
        let before = self.truth;
        self.truth.fell |= before.is == Some(true) && !is;
        self.truth.is = Some(is);
        self.truth.sampled = self.ports.iter().all(|port| samples[*port].present);
        self.truth != before
    }

    /// When it must be looked at though nothing comes.
    fn wake(&self, now: Time) -> Time {
        match self.truth.is {
            None => now,
            Some(_) if self.truth.unseen => Time::NEVER,
            Some(_) if self.counts => now + limits::HOLDS_COUNTERS,
            Some(_) => self.bank.next_wake().unwrap_or(Time::NEVER),
        }
    }
}

impl Evaluator {
    /// Starts the thread. It ends when it is [closed](Self::close).
    pub fn start(clock: &Clock, platform: &Arc<dyn Platform>, junction: &Arc<Junction>) -> Arc<Self> {
        let evaluator = Arc::new(Self {
            clock: clock.clone(),
            platform: platform.clone(),
            junction: Arc::downgrade(junction),
            wake: clock.signal(),
            state: Mutex::default(),
        });
        let own = evaluator.clone();
        clock.spawn("conditions", move || own.live());
        evaluator
    }

    /// Ends the thread.
    pub fn close(&self) {
        lock(&self.state).closing = true;
        self.wake.notify();
    }

    fn live(&self) {
        loop {
            let until = {
                let state = lock(&self.state);
                if state.closing {
                    return;
                }
                let now = self.clock.now();
                state.under.values().map(|under| under.wake(now)).min().unwrap_or(Time::NEVER)
            };
            self.wake.wait(until);
            // What comes at one moment is looked at when all of it is there.
            self.clock.sleep(limits::HOLDS_LOOK);
            let changed = {
                let mut state = lock(&self.state);
                let now = self.clock.now();
                let mut changed = false;
                for under in state.under.values_mut() {
                    changed |= under.look(now);
                }
                changed
            };
            if changed && let Some(configurator) = self.junction.upgrade().and_then(|j| lock(&j.configurator).clone()) {
                configurator.truths_changed();
            }
        }
    }
}

impl Conditions for Evaluator {
    fn begin(&self, number: u64, condition: &Condition) {
        let under = UnderWatch::new(condition, &*self.platform, &self.wake, self.clock.now());
        let before = lock(&self.state).under.insert(number, under);
        drop(before);
        self.wake.notify();
    }

    fn end(&self, number: u64) {
        // Its look at the platform ends outside of the lock.
        let ended = lock(&self.state).under.remove(&number);
        drop(ended);
    }

    fn truth(&self, number: u64) -> Truth {
        lock(&self.state).under.get(&number).map(|under| under.truth).unwrap_or_default()
    }

    fn nudge(&self) {
        if !lock(&self.state).under.is_empty() {
            self.wake.notify();
        }
    }
}
