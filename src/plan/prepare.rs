//! Prepared switches: a fixed configuration with names resolved, values fitted and memory taken (design §6).
//!
//! A [`Switch`] plans itself on the live system again at every application, but on handles and without an allocation:
//! every precondition is looked at slot by slot, so there is nothing that could be out of date. Only when a component it
//! touches is another one than it was prepared for (its `born` number differs), or a precondition is false, it declines,
//! and the configuration is planned in the ordinary way, which also finds the words for a refusal.

use super::footprint::{Access, Footprint, Saved, Slot};
use super::undo::{absolute, restoring};
use super::{PlannedStep, SavedValue, Stage, StepId};
use crate::model::{
    ChangeKind, ComponentName, ConfigId, Configuration, Direction, Ident, MemberRef, Origin, RunState, StateList, Step,
    Target, Transition, Tunable, Value, Wanted,
};
use crate::system::touch::Touches;
use crate::system::{System, Undo, View, step};
use petgraph::stable_graph::NodeIndex;
use smallvec::SmallVec;

const MOVES: [Transition; 4] = [Transition::Configure, Transition::Start, Transition::Stop, Transition::Cleanup];

/// A component that a switch touches.
#[derive(Debug, Clone)]
struct Part {
    name: ComponentName,
    index: NodeIndex,
    born: u64,
    /// Its run state after the acts planned so far.
    state: RunState,
}

/// An absolute write of a switch.
#[derive(Debug, Clone)]
struct Write {
    part: usize,
    /// Place of the property or port in its type's order.
    at: usize,
    slot: Slot,
    value: Value,
    tunable: Tunable,
    touches: Touches,
    /// What it overwrites, and whether that is a value ("never written" is none).
    old: Value,
    was: bool,
}

#[derive(Debug, Clone, Copy)]
struct Entry {
    part: usize,
    state: Wanted,
    origin: Origin,
}

/// What one act of a switch does; numbers are those of the switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// Moves a component.
    Move(u32, Transition, Stage),
    /// Makes a write.
    Write(u32),
    /// Takes a write back.
    Restore(u32),
    /// Finds that a write's value is there already: nothing is sent.
    Keep(u32),
}

/// A fixed configuration, resolved.
#[derive(Debug, Clone)]
pub struct Switch {
    configuration: ConfigId,
    group: Option<Ident>,
    parts: Vec<Part>,
    pre: Vec<Entry>,
    writes: Vec<Write>,
    post: Vec<Entry>,
    universe: Vec<Step>,
    acts: Vec<Act>,
}

impl Switch {
    /// Prepares `configuration`, and takes memory for it in `system`. None: it is not a fixed switch (it creates,
    /// destroys, connects, disconnects, calls operations or uses `_default`), or it cannot be resolved now.
    pub fn new(system: &mut System, configuration: &Configuration) -> Option<Self> {
        let mut switch = Self {
            configuration: configuration.id,
            group: configuration.group,
            parts: Vec::new(),
            pre: Vec::new(),
            writes: Vec::new(),
            post: Vec::new(),
            universe: Vec::new(),
            acts: Vec::new(),
        };
        switch.pre = switch.entries(system, &configuration.pre)?;
        for change in &configuration.changes {
            let (slot, value) = match &change.kind {
                ChangeKind::PropertySet { property, value } => (Slot::Property(*property), value),
                ChangeKind::PortWrite { port, value } => (Slot::Port(*port), value),
                _ => return None,
            };
            switch.write(system, slot, value)?;
        }
        switch.post = switch.entries(system, &configuration.post)?;
        for part in &switch.parts {
            let moves = MOVES.map(|transition| Step::State { component: part.name, transition });
            switch.universe.extend(moves);
        }
        for write in &switch.writes {
            let (Slot::Property(m) | Slot::Port(m)) = write.slot else { return None };
            switch.universe.extend(match write.slot {
                Slot::Property(_) => {
                    let set = Step::PropertySet { property: m, value: write.value.clone() };
                    [set.clone(), set]
                }
                _ => [Some(write.value.clone()), None].map(|value| Step::PortWrite { port: m, value }),
            });
        }
        let most = 3 * (switch.pre.len() + switch.post.len()) + switch.writes.len();
        switch.acts.reserve(most);
        Some(switch)
    }

    fn part(&mut self, system: &System, name: ComponentName) -> Option<usize> {
        if let Some(at) = self.parts.iter().position(|p| p.name == name) {
            return Some(at);
        }
        let index = system.index_of(name)?;
        let node = system.node_at(index)?;
        let (never, moves) = (node.ty.irreversible, node.ty.moves);
        if never.configure || never.stop || moves.start || moves.stop {
            return None;
        }
        self.parts.push(Part { name, index, born: node.born, state: node.state });
        Some(self.parts.len() - 1)
    }

    fn entries(&mut self, system: &System, list: &StateList) -> Option<Vec<Entry>> {
        let mut entries = Vec::with_capacity(list.len());
        for entry in list.iter() {
            let Target::Component(name) = entry.target else { return None };
            entries.push(Entry { part: self.part(system, name)?, state: entry.state, origin: entry.origin });
        }
        Some(entries)
    }

    fn write(&mut self, system: &mut System, slot: Slot, value: &Value) -> Option<()> {
        let part = self.part(system, slot.components().0)?;
        let index = self.parts[part].index;
        let node = system.node_at(index)?;
        let (at, value, tunable) = match slot {
            Slot::Property(m) => {
                let (at, declared) = node.property(m.member)?;
                (at, declared.fit(value.clone()).ok()?, declared.tunable)
            }
            Slot::Port(m) => {
                let (at, declared) = node.port(m.member)?;
                if declared.direction != Direction::In || declared.is_event() || declared.buffered {
                    return None;
                }
                (at, value.clone().fit(&declared.ty).ok()?, Tunable::Always)
            }
            _ => return None,
        };
        if let Some(same) = self.writes.iter().find(|w| w.slot == slot) {
            // The same act twice counts once; two values clash, and are refused in words by the planner.
            return (same.value == value).then_some(());
        }
        if matches!(slot, Slot::Port(_)) {
            system.reserve_port_at(index, at, &value);
        }
        let old = value.clone();
        let what = match slot {
            Slot::Property(property) => Step::PropertySet { property, value: value.clone() },
            Slot::Port(port) => Step::PortWrite { port, value: Some(value.clone()) },
            _ => return None,
        };
        let touches = step::touches(&what, None, &*system);
        self.writes.push(Write { part, at, slot, value, tunable, touches, old, was: false });
        Some(())
    }

    /// The configuration.
    pub fn configuration(&self) -> ConfigId {
        self.configuration
    }

    /// The group it belongs to.
    pub fn group(&self) -> Option<Ident> {
        self.group
    }

    /// Every step that it, its undo or its rollback may need: what a platform prepares.
    pub fn universe(&self) -> &[Step] {
        &self.universe
    }

    /// The acts planned last.
    pub fn acts(&self) -> &[Act] {
        &self.acts
    }

    /// The place in [`Switch::universe`] of what an act sends to the platform, with the value that replaces that step's
    /// own; none: nothing is sent.
    pub fn sends(&self, act: Act) -> Option<(usize, Option<&Value>)> {
        let of = |write: u32| 4 * self.parts.len() + 2 * write as usize;
        Some(match act {
            Act::Move(part, transition, _) => (4 * part as usize + MOVES.iter().position(|t| *t == transition)?, None),
            Act::Write(write) => (of(write), None),
            Act::Restore(write) => {
                let w = &self.writes[write as usize];
                if w.was { (of(write), Some(&w.old)) } else { (of(write) + 1, None) }
            }
            Act::Keep(_) => return None,
        })
    }

    /// Looks at every component it touches; false: another one has its name.
    fn look(&mut self, system: &System) -> bool {
        self.acts.clear();
        self.parts.iter_mut().all(|part| match system.node_at(part.index) {
            Some(node) if node.born == part.born => {
                part.state = node.state;
                node.state != RunState::Faulted
            }
            _ => false,
        })
    }

    fn go(&mut self, post: bool) {
        let entries = if post { &self.post } else { &self.pre };
        let stage = if post { Stage::Post } else { Stage::Pre };
        for entry in entries {
            let part = &mut self.parts[entry.part];
            for transition in part.state.path_to(entry.state) {
                #[allow(clippy::cast_possible_truncation)]
                self.acts.push(Act::Move(entry.part as u32, *transition, stage));
            }
            part.state = entry.state.into();
        }
    }

    /// Plans its application on the live system, and captures what it will overwrite. False: plan the configuration in
    /// the ordinary way. Allocates nothing.
    pub fn ready(&mut self, system: &System) -> bool {
        if !self.look(system) {
            return false;
        }
        self.go(false);
        for i in 0..self.writes.len() {
            let write = &mut self.writes[i];
            let part = &self.parts[write.part];
            let Some(node) = system.node_at(part.index) else { return false };
            let present = match write.slot {
                Slot::Port(port) => {
                    if system.driven(port).links > 0 {
                        return false;
                    }
                    node.written(write.at)
                }
                _ => {
                    if !write.tunable.allows(part.state) {
                        return false;
                    }
                    node.properties.get(write.at)
                }
            };
            write.was = present.is_some();
            if let Some(present) = present {
                write.old.clone_from(present);
            }
            let kept = present == Some(&write.value);
            #[allow(clippy::cast_possible_truncation)]
            self.acts.push(if kept { Act::Keep(i as u32) } else { Act::Write(i as u32) });
        }
        self.go(true);
        true
    }

    /// Plans the undo of a frame that it was applied with (`acts`, `saved` in the order of its writes), which is the top of
    /// its stack. False: undo it in the ordinary way. Allocates nothing.
    pub fn ready_undo(&mut self, system: &System, acts: &[Act], saved: &[SavedValue]) -> bool {
        if !self.look(system) || saved.len() != self.writes.len() {
            return false;
        }
        for act in acts.iter().rev() {
            match *act {
                Act::Move(part, transition, stage) => {
                    let Some(it) = self.parts.get_mut(part as usize) else { return false };
                    let back = transition.inverse();
                    if !back.allowed_in(it.state) {
                        return false;
                    }
                    it.state = back.target();
                    self.acts.push(Act::Move(part, back, stage));
                }
                Act::Write(i) | Act::Keep(i) => {
                    let (Some(write), Some(saved)) = (self.writes.get_mut(i as usize), saved.get(i as usize)) else {
                        return false;
                    };
                    let part = &self.parts[write.part];
                    let Some(node) = system.node_at(part.index) else { return false };
                    let (present, value) = match (&saved.value, write.slot) {
                        (Saved::Port(value), Slot::Port(port)) => {
                            if system.driven(port).links > 0 {
                                return false;
                            }
                            (node.written(write.at), value.as_ref())
                        }
                        (Saved::Property(value), _) => {
                            if !write.tunable.allows(part.state) {
                                return false;
                            }
                            (node.properties.get(write.at), Some(value))
                        }
                        _ => return false,
                    };
                    if saved.slot != write.slot {
                        return false;
                    }
                    write.was = value.is_some();
                    if let Some(value) = value {
                        write.old.clone_from(value);
                    }
                    self.acts.push(if present == value { Act::Keep(i) } else { Act::Restore(i) });
                }
                Act::Restore(_) => return false,
            }
        }
        true
    }

    /// Records on the live system that an act was done. Allocates nothing.
    pub fn done(&self, act: Act, system: &mut System) {
        match act {
            Act::Move(part, transition, _) => system.set_state_at(self.parts[part as usize].index, transition.target()),
            Act::Write(i) | Act::Restore(i) => {
                let write = &self.writes[i as usize];
                let index = self.parts[write.part].index;
                let value =
                    if matches!(act, Act::Write(_)) { Some(&write.value) } else { write.was.then_some(&write.old) };
                match (write.slot, value) {
                    (Slot::Property(_), Some(value)) => system.set_property_at(index, write.at, value),
                    (Slot::Property(_), None) => {}
                    (_, value) => system.set_port_at(index, write.at, value),
                }
            }
            Act::Keep(_) => {}
        }
    }

    fn saved_value(write: &Write) -> Saved {
        let value = write.was.then(|| write.old.clone());
        match (write.slot, value) {
            (Slot::Property(_), Some(value)) => Saved::Property(value),
            (_, value) => Saved::Port(value),
        }
    }

    /// The acts planned last as planned steps, one after the other: for a frame, and for the rollback of a switch that
    /// failed. What was overwritten is what was captured. `system` is the one before the acts.
    pub fn steps(&self, acts: &[Act]) -> Vec<PlannedStep> {
        let mut steps: Vec<PlannedStep> = Vec::with_capacity(acts.len());
        for act in acts {
            let (step, undo, stage) = match *act {
                Act::Keep(_) => continue,
                Act::Move(part, transition, stage) => {
                    let component = self.parts[part as usize].name;
                    let undo = Step::State { component, transition: transition.inverse() };
                    (Step::State { component, transition }, Some(undo), stage)
                }
                Act::Write(i) | Act::Restore(i) => {
                    let write = &self.writes[i as usize];
                    let of = |value| restoring(&SavedValue { slot: write.slot, value, at: 0, step: true });
                    let new = match write.slot {
                        Slot::Property(_) => Saved::Property(write.value.clone()),
                        _ => Saved::Port(Some(write.value.clone())),
                    };
                    let (new, old) = (of(new), of(Self::saved_value(write)));
                    let (step, undo) = if matches!(act, Act::Write(_)) { (new, old) } else { (old, new) };
                    let Some(step) = step else { continue };
                    (step, undo, Stage::Changes)
                }
            };
            let id = StepId::try_from(steps.len()).expect("few steps");
            let undo = undo.map_or(Undo::Nothing, Undo::One);
            steps.push(PlannedStep {
                id,
                stage,
                wave: stage as u32,
                after: steps
                    .last()
                    .filter(|s| s.stage == stage)
                    .map(|s| s.id)
                    .into_iter()
                    .collect::<SmallVec<[StepId; 4]>>(),
                reversibility: step::reversibility(&step, &undo),
                step,
                undo,
                // What moves is not prepared.
                moves: false,
                undo_moves: false,
                origin: self.origin(*act),
            });
        }
        steps
    }

    fn origin(&self, act: Act) -> Origin {
        let Act::Move(part, _, stage) = act else { return Origin::NONE };
        let entries = if stage == Stage::Pre { &self.pre } else { &self.post };
        entries.iter().find(|e| e.part == part as usize).map_or(Origin::NONE, |e| e.origin)
    }

    /// What the application planned last touches.
    pub fn footprint(&self) -> Footprint {
        let mut footprint = Footprint::default();
        let moved = |part: usize| self.acts.iter().any(|a| matches!(a, Act::Move(p, ..) if *p as usize == part));
        for entry in self.pre.iter().chain(&self.post) {
            let access = if moved(entry.part) { Access::Write } else { Access::Need };
            footprint.touch(Slot::State(self.parts[entry.part].name), access);
        }
        footprint.touches.extend(self.writes.iter().flat_map(|write| write.touches.iter().copied()));
        footprint
    }

    /// What the application planned last overwrites, in the order of the writes. `steps` are its steps.
    pub fn saved(&self, steps: &[PlannedStep]) -> Vec<SavedValue> {
        let first = steps.iter().filter(|s| s.stage == Stage::Pre).count();
        let place = |slot: Slot| steps.iter().position(|s| absolute(&s.step) == Some(slot));
        self.writes
            .iter()
            .map(|write| {
                let at = place(write.slot);
                let id = StepId::try_from(at.unwrap_or(first)).expect("few steps");
                SavedValue { slot: write.slot, value: Self::saved_value(write), at: id, step: at.is_some() }
            })
            .collect()
    }

    /// Writes what was captured into a frame of the same shape: its saved values and the undos of its steps. Allocates
    /// nothing when the values have the shapes they had.
    pub fn refresh(&self, steps: &mut [PlannedStep], saved: &mut [SavedValue]) {
        for (write, saved) in self.writes.iter().zip(saved.iter_mut()) {
            put(&mut saved.value, write);
            if let Some(step) = steps.get_mut(saved.at as usize).filter(|_| saved.step)
                && let Undo::One(undo) = &mut step.undo
            {
                match undo {
                    Step::PropertySet { value, .. } => value.clone_from(&write.old),
                    Step::PortWrite { value, .. } => match value {
                        Some(value) if write.was => value.clone_from(&write.old),
                        value => *value = write.was.then(|| write.old.clone()),
                    },
                    _ => {}
                }
            }
        }
    }

    /// The members it writes, in order.
    pub fn members(&self) -> impl Iterator<Item = MemberRef> {
        self.writes.iter().filter_map(|w| match w.slot {
            Slot::Property(m) | Slot::Port(m) => Some(m),
            _ => None,
        })
    }
}

fn put(saved: &mut Saved, write: &Write) {
    match saved {
        Saved::Property(value) => value.clone_from(&write.old),
        Saved::Port(Some(value)) if write.was => value.clone_from(&write.old),
        Saved::Port(value) => *value = write.was.then(|| write.old.clone()),
    }
}
