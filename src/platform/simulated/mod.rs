//! A platform that runs any declared component type, without the components: it keeps the run states, values and
//! connections a real platform would, refuses what a real platform would, and does wrong what it is told to.
//!
//! *Nothing is injected unless asked*: without [`Faults`] and [`Delays`] every step that may happen happens at once.
//! It shares no code with `system` or `plan` (see [`world`]), so that it can judge them.

mod calls;
mod faults;
mod steps;
mod world;

pub use crate::model::StepPattern;
pub use faults::{Delays, Fault, FaultRule, Faults, Reaction, When};

use super::{Cause, EventSink, Execution, ObserveError, Outcome, Platform, PlatformEvent, Prepared, Watch};
use crate::model::{Catalogue, ComponentName, ComponentSnapshot, EventName, Ident, RunState, Snapshot, Step, Value};
use crate::monitor::{InputSample, MonitorInput, state_value};
use crate::time::{Clock, Join, RecvError, Sender, Signal, Time, TrySendError};
use calls::Calls;
use faults::Chance;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::Duration;
use world::SimulatedWorld;

/// How a simulated platform is made.
#[derive(Debug, Clone, Default)]
pub struct SimulatedOptions {
    /// What goes wrong.
    pub faults: Faults,
    /// How long steps take.
    pub delays: Delays,
    /// What components raise by themselves.
    pub reactions: Vec<Reaction>,
    /// Activities that exist; none: a component may name any.
    pub activities: Option<BTreeSet<Ident>>,
    /// Every step is called blocking, also where it takes no time.
    pub blocking: bool,
}

/// The simulated platform. A cheap handle: clones are the same platform.
#[derive(Clone)]
pub struct Simulated {
    shared: Arc<SimulatedInner>,
}

struct SimulatedInner {
    clock: Clock,
    catalogue: Catalogue,
    state: Mutex<SimulatedState>,
}

struct SimulatedState {
    world: SimulatedWorld,
    faults: Faults,
    fired: Vec<u32>,
    asked: u64,
    chance: Chance,
    delays: Delays,
    blocking: bool,
    reactions: Vec<Reaction>,
    /// Components whose call has not returned.
    quarantine: BTreeSet<ComponentName>,
    sink: Option<EventSink>,
    executed: Option<Vec<Step>>,
    timers: Option<(Sender<(Time, Due)>, Join)>,
    /// The steps that take their time just now.
    calls: Calls,
}

/// What happens by itself later.
enum Due {
    Returned(ComponentName),
    Raised { event: EventName, component: ComponentName },
}

/// How many late happenings may be on their way to the timer thread at once: it takes them up at once, so this bounds a
/// burst, and what does not fit happens immediately instead of being lost.
const DUE_QUEUE: usize = 4096;

impl SimulatedInner {
    // A panic while the lock is held is a defect of this file; the data are plain, so others may go on.
    fn lock(&self) -> MutexGuard<'_, SimulatedState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn emit(&self, event: PlatformEvent) {
        let sink = self.lock().sink.clone();
        if let Some(sink) = sink {
            sink(event);
        }
    }

    fn happen(&self, due: Due) {
        let at = self.clock.now();
        match due {
            Due::Raised { event, component } => self.emit(PlatformEvent::Raised { event, component, at }),
            Due::Returned(component) => {
                // The effect of a hung step never reached the world: what the late call did is taken back by that.
                let was_there = self.lock().quarantine.remove(&component);
                if was_there {
                    self.emit(PlatformEvent::Returned { component, at });
                }
            }
        }
    }

    /// Lets `due` happen at `at`, on a thread of its own that is there from the first such wish on.
    fn later(self: &Arc<Self>, at: Time, due: Due) {
        let mut state = self.lock();
        let (sender, _) = state.timers.get_or_insert_with(|| {
            let (sender, receiver) = self.clock.channel::<(Time, Due)>(DUE_QUEUE);
            let (weak, clock) = (Arc::downgrade(self), self.clock.clone());
            let thread = self.clock.spawn("simulated: timers", move || {
                let mut queue: BTreeMap<(Time, u64), Due> = BTreeMap::new();
                let mut count = 0;
                loop {
                    let next = queue.keys().next().map_or(Time::NEVER, |(at, _)| *at);
                    match receiver.recv_deadline(next) {
                        Ok((at, due)) => {
                            count += 1;
                            queue.insert((at, count), due);
                        }
                        Err(RecvError::Timeout) => {}
                        Err(RecvError::Closed) => return,
                    }
                    while let Some(entry) = queue.first_entry().filter(|entry| entry.key().0 <= clock.now()) {
                        let due = entry.remove();
                        let Some(shared) = weak.upgrade() else { return };
                        shared.happen(due);
                    }
                }
            });
            (sender, thread)
        });
        let refused = sender.try_send((at, due)).err();
        drop(state);
        if let Some(TrySendError::Full((_, due)) | TrySendError::Closed((_, due))) = refused {
            self.happen(due);
        }
    }
}

impl SimulatedState {
    /// The fault that hits the step asked for now, if one does, and how long it takes, if it is slow.
    fn fault(&mut self, step: &Step) -> (Option<Fault>, Option<Duration>) {
        self.asked += 1;
        let (asked, chance) = (self.asked, &mut self.chance);
        let (mut found, mut slow) = (None, None);
        for (rule, fired) in self.faults.rules.iter().zip(&mut self.fired) {
            let takes = if let Fault::Slow(takes) = rule.fault { Some(takes) } else { None };
            let known = if takes.is_some() { slow.is_some() } else { found.is_some() };
            let hit = !known
                && *fired < rule.times
                && rule.when.nth.is_none_or(|nth| nth == asked)
                && rule.when.pattern.as_ref().is_none_or(|pattern| pattern.matches(step))
                && rule.when.chance.is_none_or(|p| chance.unit() < p);
            if hit {
                *fired += 1;
                match takes {
                    Some(_) => slow = takes,
                    None => found = Some(rule.fault.clone()),
                }
            }
            if found.is_some() && slow.is_some() {
                break;
            }
        }
        (found, slow)
    }

    fn delay(&mut self, step: &Step) -> Duration {
        if self.delays.is_none() {
            return Duration::ZERO;
        }
        if let Some((_, delay)) = self.delays.of.iter().find(|(pattern, _)| pattern.matches(step)) {
            return *delay;
        }
        self.delays.base + self.delays.jitter.mul_f64(self.chance.unit())
    }

    /// Whether `step` needs a component that is in quarantine. Taking a connection away needs nothing of the component at its
    /// end; what a `safe` configuration writes or calls is let in.
    fn quarantined(&self, step: &Step, safe: bool) -> bool {
        if self.quarantine.is_empty() {
            return false;
        }
        match step {
            Step::Disconnect { .. } => false,
            Step::Operation(_) | Step::PropertySet { .. } | Step::PortWrite { .. } if safe => false,
            Step::Connect { from, to, .. } => {
                self.quarantine.contains(&from.component) || self.quarantine.contains(&to.component)
            }
            other => self.quarantine.contains(&other.component()),
        }
    }
}

impl Simulated {
    /// A platform with nothing on it.
    pub fn new(catalogue: Catalogue, clock: Clock, options: SimulatedOptions) -> Self {
        let chance = Chance(options.faults.seed);
        let state = SimulatedState {
            world: SimulatedWorld::new(catalogue.clone(), options.activities),
            fired: vec![0; options.faults.rules.len()],
            faults: options.faults,
            asked: 0,
            chance,
            delays: options.delays,
            blocking: options.blocking,
            reactions: options.reactions,
            quarantine: BTreeSet::new(),
            sink: None,
            executed: None,
            timers: None,
            calls: Calls::default(),
        };
        Self { shared: Arc::new(SimulatedInner { clock, catalogue, state: Mutex::new(state) }) }
    }

    /// The clock it runs on.
    pub fn clock(&self) -> &Clock {
        &self.shared.clock
    }

    /// From now on these faults, and no others; steps are counted from 1 again.
    pub fn set_faults(&self, faults: Faults) {
        let mut state = self.shared.lock();
        state.fired = vec![0; faults.rules.len()];
        state.asked = 0;
        state.chance = Chance(faults.seed);
        state.faults = faults;
    }

    /// From now on this goes wrong too, where no earlier rule decides. Whoever adds faults while others use the platform
    /// makes it `blocking`, so that nobody waits for a step in a thread that must not.
    pub fn add_fault(&self, rule: FaultRule) {
        let mut state = self.shared.lock();
        state.faults.rules.push(rule);
        state.fired.push(0);
    }

    /// From now on steps take so long.
    pub fn set_delays(&self, delays: Delays) {
        self.shared.lock().delays = delays;
    }

    /// How many steps were asked for since the faults were set.
    pub fn asked(&self) -> u64 {
        self.shared.lock().asked
    }

    /// From now on the steps that happened are kept; answers those kept so far.
    pub fn record(&self) -> Vec<Step> {
        self.shared.lock().executed.replace(Vec::new()).unwrap_or_default()
    }

    /// Raises `event` in the name of `component`.
    pub fn raise(&self, component: ComponentName, event: EventName) {
        self.shared.happen(Due::Raised { event, component });
    }

    /// `component` fails by itself: it is faulted. Answers whether there is such a component.
    pub fn fault(&self, component: ComponentName, reason: &str) -> bool {
        let found = {
            let mut state = self.shared.lock();
            let it = state.world.components.get_mut(&component);
            it.map(|it| it.state = RunState::Faulted).is_some()
        };
        if found {
            let at = self.shared.clock.now();
            self.shared.emit(PlatformEvent::Faulted { component, reason: reason.to_owned(), at });
        }
        found
    }

    /// Something changes behind everybody's back: `step` happens if it may, without faults, delays or reactions.
    /// Answers whether it happened.
    pub fn tamper(&self, step: &Step) -> bool {
        let mut state = self.shared.lock();
        let may = state.world.check(step).is_ok();
        if may {
            state.world.apply(step);
        }
        may
    }
}

impl Platform for Simulated {
    fn catalogue(&self) -> &Catalogue {
        &self.shared.catalogue
    }

    fn execution(&self, _step: &Step) -> Execution {
        let state = self.shared.lock();
        if state.blocking || !state.faults.rules.is_empty() || !state.delays.is_none() {
            Execution::Blocking
        } else {
            Execution::Immediate
        }
    }

    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        self.execute(step, None, deadline, false)
    }

    fn execute_safe(&self, step: &Step, deadline: Time) -> Outcome {
        self.execute(step, None, deadline, true)
    }

    fn cancel(&self, step: &Step) {
        self.shared.lock().calls.cancel(step);
    }

    fn observe(&self, deadline: Time) -> Result<Snapshot, ObserveError> {
        self.see(deadline).map(|state| state.world.snapshot())
    }

    fn observe_component(
        &self,
        component: ComponentName,
        deadline: Time,
    ) -> Result<Option<ComponentSnapshot>, ObserveError> {
        self.see(deadline).map(|state| state.world.observe(component))
    }

    fn observe_some(&self, components: &[ComponentName], deadline: Time) -> Result<Snapshot, ObserveError> {
        self.see(deadline).map(|state| state.world.some(components))
    }

    fn prepare(&self, steps: &[Step]) -> Option<Box<dyn Prepared>> {
        let fixed = |step: &Step| {
            !matches!(step, Step::Create { .. } | Step::Destroy { .. }) && self.execution(step) == Execution::Immediate
        };
        steps
            .iter()
            .all(fixed)
            .then(|| Box::new(SimulatedPrepared { platform: self.clone(), steps: steps.to_vec() }) as _)
    }

    /// Its components have no code that writes anything: run states can be seen, values cannot.
    fn watch(&self, inputs: &[MonitorInput], _: &Signal) -> Option<Box<dyn Watch>> {
        Some(Box::new(StatesWatch { shared: Arc::downgrade(&self.shared), inputs: inputs.to_vec() }))
    }

    fn subscribe(&self, sink: EventSink) {
        self.shared.lock().sink = Some(sink);
    }

    fn quarantined(&self) -> Vec<ComponentName> {
        self.shared.lock().quarantine.iter().copied().collect()
    }
}

impl Simulated {
    fn see(&self, deadline: Time) -> Result<MutexGuard<'_, SimulatedState>, ObserveError> {
        let state = self.shared.lock();
        if state.faults.blind {
            drop(state);
            self.shared.clock.sleep_until(deadline);
            return Err(ObserveError::Timeout);
        }
        Ok(state)
    }
}

/// A prepared list: here, simply the list.
struct SimulatedPrepared {
    platform: Simulated,
    steps: Vec<Step>,
}

impl Prepared for SimulatedPrepared {
    fn execute(&mut self, index: usize, value: Option<&Value>, _: Time, deadline: Time) -> Outcome {
        match self.steps.get(index) {
            Some(step) => self.platform.execute(step, value, deadline, false),
            None => Outcome::NotDone(Cause::Refused(format!("there is no step {index}"))),
        }
    }
}

/// A look at run states.
struct StatesWatch {
    shared: Weak<SimulatedInner>,
    inputs: Vec<MonitorInput>,
}

impl Watch for StatesWatch {
    fn shows(&self, input: usize) -> bool {
        matches!(self.inputs[input], MonitorInput::State(_) | MonitorInput::Faulted(_))
    }

    fn look(&mut self, now: Time, samples: &mut [InputSample]) {
        let Some(shared) = self.shared.upgrade() else { return };
        let state = shared.lock();
        for (sample, input) in samples.iter_mut().zip(&self.inputs) {
            let state = |name: &ComponentName| state.world.components.get(name).map(|it| it.state);
            let value = match input {
                MonitorInput::State(name) => state(name).map(state_value),
                MonitorInput::Faulted(name) => state(name).map(|state| f64::from(u8::from(state == RunState::Faulted))),
                MonitorInput::Port(_) | MonitorInput::Activity { .. } => None,
            };
            *sample = InputSample { value: value.unwrap_or_default(), at: now, writes: 0, present: value.is_some() };
        }
    }
}
