//! What safe configurations touched.

use crate::model::{ComponentName, MemberRef, RunState, Step, Value, Wanted};
use crate::plan::undo::absolute;
use crate::stack::{Frame, FrameId, calls};
use crate::system::touch::{Slot, components, slot};
use rustc_hash::{FxHashMap, FxHashSet};

/// What safe configurations touched: the way back of what they interrupted leaves that alone.
#[derive(Debug, Clone, Default)]
pub struct Touched {
    pub(super) slots: FxHashSet<Slot>,
    /// At which revision of the model what touches a slot was planned last.
    pub(super) planned: FxHashMap<Slot, u64>,
    /// At which revision of the model a step of theirs was done last.
    pub(super) done: FxHashMap<Slot, u64>,
    pub(super) properties: FxHashMap<MemberRef, Value>,
    pub(super) ports: FxHashMap<MemberRef, Option<Value>>,
    pub(super) states: FxHashMap<ComponentName, RunState>,
    /// Components and connections that they have made (true) or taken away.
    pub(super) there: FxHashMap<Slot, bool>,
    /// Operations that they have called, and take back by themselves.
    pub(super) calls: FxHashSet<MemberRef>,
    /// Frames whose place they have taken, with what takes each of them back: who was doing that leaves it done.
    pub(super) gone: Vec<(FrameId, Step)>,
}

impl Touched {
    /// `step` is one of theirs, or what it leads to was demanded. Of several the last tells what is wanted.
    pub fn add(&mut self, step: &Step) {
        self.slots.insert(slot(step));
        match step {
            Step::State { component, transition } => {
                self.states.insert(*component, transition.target());
            }
            Step::PropertySet { property, value } => {
                self.properties.insert(*property, value.clone());
            }
            Step::PortWrite { port, value } => {
                self.ports.insert(*port, value.clone());
            }
            Step::Create { .. } | Step::Connect { .. } => {
                self.there.insert(slot(step), true);
            }
            Step::Destroy { .. } | Step::Disconnect { .. } => {
                self.there.insert(slot(step), false);
            }
            _ => {}
        }
    }

    /// The run state of `component` was demanded.
    pub fn add_state(&mut self, component: ComponentName, wanted: Wanted) {
        self.slots.insert(Slot::State(component));
        self.states.insert(component, wanted.into());
    }

    /// What this frame has done is not in force any more: what was before is.
    pub fn takes_place_of(&mut self, frame: &Frame) {
        self.slots.extend(frame.saved.iter().map(|saved| saved.slot));
        self.gone.extend(frame.taking_back().into_iter().map(|item| (frame.id, item.step)));
    }

    /// That is the frame that they leave: its calls are theirs, and only theirs.
    pub fn leaves(&mut self, frame: &Frame) {
        self.calls = calls(frame).collect();
    }

    /// These values were not written, for all that is known: the way back of what had written the same is open.
    pub fn missed<'s>(&mut self, steps: impl Iterator<Item = &'s Step>) {
        for slot in steps.filter_map(absolute) {
            if !self.done.contains_key(&slot) {
                self.slots.remove(&slot);
            }
        }
    }

    /// The same, with no frame that takes its calls back.
    pub fn without_calls(&self) -> Self {
        Self { calls: FxHashSet::default(), ..self.clone() }
    }

    /// It was all planned on the model of this revision.
    pub fn planned_at(&mut self, revision: u64) {
        self.planned = self.slots.iter().map(|slot| (*slot, revision)).collect();
    }

    /// `step` was done; the model has been at `revision` since.
    pub fn did(&mut self, step: &Step, revision: u64) {
        let last = self.done.entry(slot(step)).or_default();
        *last = revision.max(*last);
    }

    /// Takes `other` in, which came later.
    pub fn join(&mut self, other: Self) {
        self.slots.extend(other.slots);
        for (mine, theirs) in [(&mut self.done, other.done), (&mut self.planned, other.planned)] {
            for (slot, revision) in theirs {
                let last = mine.entry(slot).or_default();
                *last = revision.max(*last);
            }
        }
        self.properties.extend(other.properties);
        self.ports.extend(other.ports);
        self.states.extend(other.states);
        self.there.extend(other.there);
        self.calls.extend(other.calls);
        self.gone.extend(other.gone);
    }

    /// The run state that is wanted of `component`, if one is.
    pub fn wants(&self, component: ComponentName) -> Option<RunState> {
        self.states.get(&component).copied()
    }

    /// Whether they want `component` there, or gone, if they want one of them.
    pub fn wants_there(&self, component: ComponentName) -> Option<bool> {
        self.there.get(&Slot::Component(component)).copied()
    }

    /// Whether they want it otherwise than `step` leads to.
    pub fn opposes(&self, step: &Step) -> bool {
        match step {
            Step::State { component, transition } => self.wants(*component).is_some_and(|of| of != transition.target()),
            Step::Create { .. } | Step::Connect { .. } => self.there.get(&slot(step)) == Some(&false),
            Step::Destroy { .. } | Step::Disconnect { .. } => self.there.get(&slot(step)) == Some(&true),
            _ => false,
        }
    }

    /// Whether `step` brings about what is wanted: a run state that was demanded, or what one of theirs writes, calls or makes.
    pub fn wants_step(&self, step: &Step) -> bool {
        match step {
            Step::State { component, transition } => self.wants(*component) == Some(transition.target()),
            other => self.has(other),
        }
    }

    /// Whether nothing was.
    pub fn is_empty(&self) -> bool {
        self.slots.is_empty() && self.gone.is_empty()
    }

    /// Whether `step` would change something touched.
    pub fn has(&self, step: &Step) -> bool {
        let gone = |component: &ComponentName| self.slots.contains(&Slot::Component(*component));
        self.slots.contains(&slot(step)) || components(step).iter().any(gone)
    }

    /// Whether what touches the same was planned when `step` had come in at that revision: then it is not late.
    pub fn knew(&self, step: &Step, revision: u64) -> bool {
        self.planned.get(&slot(step)).is_some_and(|planned| *planned > revision)
    }

    /// Whether `step`, which came in late and made the model `revision`, was overwritten by a step of theirs after that.
    pub fn overwrote(&self, step: &Step, revision: u64) -> bool {
        self.done.get(&slot(step)).is_some_and(|done| *done > revision)
    }
}
