//! The way back: what was done is taken back latest first, as far as nothing moves that nobody asked to move; what stands
//! before the failure is finished.

use super::Transaction;
use super::run::Run;
use crate::model::{ComponentName, OnFailure, Origin, Step};
use crate::plan::undo::{Item, Script};
use crate::plan::{PlannedStep, Stage, StepId};
use crate::system::touch::{Slot, components};
use crate::system::{Overlay, Reversibility, System, Undo, step};
use rustc_hash::FxHashSet;
use smallvec::SmallVec;

/// What safe configurations touched: the way back of what they interrupted leaves that alone.
#[derive(Debug, Clone, Default)]
pub struct Touched {
    slots: FxHashSet<Slot>,
    /// Components of which anything was touched.
    components: FxHashSet<ComponentName>,
}

fn slot(step: &Step) -> Slot {
    match step {
        Step::State { component, .. } => Slot::State(*component),
        Step::Create { component, .. } | Step::Destroy { component } => Slot::Component(*component),
        Step::Connect { from, to, .. } | Step::Disconnect { from, to } => Slot::Link(*from, *to),
        Step::PropertySet { property, .. } => Slot::Property(*property),
        Step::PortWrite { port, .. } => Slot::Port(*port),
        Step::Operation(call) => Slot::Operation(call.operation),
    }
}

impl Touched {
    /// `step` was done, or what it leads to was demanded.
    pub fn add(&mut self, step: &Step) {
        self.slots.insert(slot(step));
        self.components.extend(components(step));
    }

    /// The run state of `component` was demanded.
    pub fn add_state(&mut self, component: ComponentName) {
        self.slots.insert(Slot::State(component));
        self.components.insert(component);
    }

    /// Takes `other` in.
    pub fn join(&mut self, other: Self) {
        self.slots.extend(other.slots);
        self.components.extend(other.components);
    }

    /// Whether `step` would change something touched.
    pub fn has(&self, step: &Step) -> bool {
        match step {
            Step::Create { component, .. } | Step::Destroy { component } => self.components.contains(component),
            other => self.slots.contains(&slot(other)),
        }
    }
}

/// A step that stands alone in its wave and before which so many others stand.
fn item(step: Step, id: StepId, wave: u32, after: SmallVec<[StepId; 4]>) -> PlannedStep {
    PlannedStep {
        id,
        stage: Stage::Changes,
        wave,
        after,
        step,
        reversibility: Reversibility::Exact,
        undo: Undo::Nothing,
        moves: false,
        undo_moves: false,
        origin: Origin::NONE,
    }
}

/// Steps one after the other.
pub(super) fn chain(steps: impl IntoIterator<Item = Step>) -> Vec<PlannedStep> {
    let mut list = Vec::new();
    for (id, step) in (0..).zip(steps) {
        let before: Option<StepId> = StepId::checked_sub(id, 1);
        list.push(item(step, id, 0, before.into_iter().collect()));
    }
    list
}

/// Steps back, and of each which step of the forward list it takes back (none: it finishes something).
#[derive(Debug, Default)]
pub(super) struct WayBack {
    pub list: Vec<PlannedStep>,
    pub takes_back: Vec<Option<u32>>,
    pub finishes: Vec<Option<u32>>,
    /// The first step back that was withheld.
    pub withheld: Option<Step>,
    /// Steps of the forward list that need no way back: a safe configuration has touched what they did.
    pub superseded: Vec<u32>,
}

impl Transaction {
    /// The way back from where the forward list stands: for all that was done of parts from `part` on and was not taken back,
    /// latest first; then what is missing of the parts before.
    pub(super) fn way_back(&self, part: usize, live: &System) -> WayBack {
        let forward = self.forward.as_ref().expect("something was carried out");
        let mut way = WayBack::default();
        let held = self.planned.parts[part].on_failure == OnFailure::Hold && !self.asked_back;
        if self.taken_down || held && part == 0 {
            return way;
        }
        let mut ends: Vec<SmallVec<[u32; 4]>> = vec![SmallVec::new(); forward.list.len()];
        let mut followers: Vec<SmallVec<[u32; 4]>> = vec![SmallVec::new(); forward.list.len()];
        for (i, step) in (0..).zip(&forward.list) {
            for before in &step.after {
                followers[*before as usize].push(i);
            }
        }
        let waves = forward.list.iter().map(|step| step.wave).max().unwrap_or(0);
        for i in forward.done.iter().rev().copied() {
            if held || self.taken_back.contains(&i) || self.part_of(i) < part {
                continue;
            }
            let late = forward.late.iter().find(|(late, _)| *late == i).map(|(_, undo)| undo);
            let undo = late.unwrap_or_else(|| self.undo_of(i, part));
            let original = &forward.list[i as usize];
            let mut after: SmallVec<[u32; 4]> =
                followers[i as usize].iter().flat_map(|f| ends[*f as usize].clone()).collect();
            after.sort_unstable();
            after.dedup();
            for back in undo.steps() {
                let touched = late.is_none() && self.touched.has(back);
                if late.is_none() && !self.may_move(i) && step::moves(back, live) {
                    way.withheld = Some(back.clone());
                    return way;
                }
                if touched {
                    way.superseded.push(i);
                    continue;
                }
                let id = way.list.len() as u32;
                way.list.push(item(back.clone(), id, waves - original.wave, after));
                way.takes_back.push(Some(i));
                way.finishes.push(None);
                after = SmallVec::from_iter([id]);
            }
            ends[i as usize] = after;
        }
        if part > 0 {
            self.finish_before(part, live, &mut way);
        }
        way
    }

    /// Whether the way back of a forward step may move.
    fn may_move(&self, i: u32) -> bool {
        self.asked_back || !self.interrupted && self.planned.parts[self.part_of(i)].on_failure == OnFailure::Rollback
    }

    /// The part of a step of the forward list.
    pub(super) fn part_of(&self, i: u32) -> usize {
        self.planned.part_of(self.planned.place(i as usize))
    }

    /// What takes a step of the forward list back, to where the parts before `part` have led.
    pub(super) fn undo_of(&self, i: u32, part: usize) -> &Undo {
        let forward = &self.forward.as_ref().expect("something was carried out").list[i as usize];
        // The net was planned on the system before all of them.
        let Some(place) = self.planned.place(i as usize).filter(|_| part > 0 && !self.planned.whole.is_empty()) else {
            return &forward.undo;
        };
        let whole = self.whole();
        let Some(slot) = crate::system::touch::absolute(&forward.step) else { return &whole[place as usize].undo };
        // An earlier write of the same slot may have been left out of the net.
        let from = self.planned.parts[part].range.start as usize;
        let first = whole[from..].iter().find(|planned| crate::system::touch::absolute(&planned.step) == Some(slot));
        &first.unwrap_or(&whole[place as usize]).undo
    }

    /// Adds what is missing of the parts before `part`: they were to stand whatever comes after them.
    fn finish_before(&self, part: usize, live: &System, way: &mut WayBack) {
        let forward = self.forward.as_ref().expect("something was carried out");
        let mut done: FxHashSet<u32> = forward.done.iter().filter_map(|i| self.planned.place(*i as usize)).collect();
        done.extend(self.finished.iter().copied());
        let mut view = Overlay::new(live);
        for step in &way.list {
            let _ = step::apply(&step.step, &mut view);
        }
        // What a held part has written stands above what the parts before it would write.
        let held: FxHashSet<Slot> = (forward.done.iter())
            .filter(|i| {
                self.part_of(**i) >= part && !way.takes_back.contains(&Some(**i)) && !self.taken_back.contains(*i)
            })
            .filter_map(|i| crate::system::touch::absolute(&forward.list[*i as usize].step))
            .collect();
        let wave = way.list.iter().map(|step| step.wave + 1).max().unwrap_or(0);
        let mut script = Script::new(&mut view);
        for (place, planned) in (0u32..).zip(self.whole()) {
            let before = self.planned.part_of(Some(place)) < part;
            let overwritten = crate::system::touch::absolute(&planned.step).is_some_and(|slot| held.contains(&slot));
            if !before || done.contains(&place) || overwritten {
                continue;
            }
            let mut item = Item::of(planned);
            item.of = place;
            let after: SmallVec<[StepId; 1]> = script.steps.last().map(|s| s.id).into_iter().collect();
            if script.add(item, 0, &after).is_err() {
                break;
            }
        }
        let Ok((steps, of)) = script.finish_placed() else { return };
        let base = way.list.len() as u32;
        for (mut planned, place) in steps.into_iter().zip(of) {
            planned.id += base;
            planned.after.iter_mut().for_each(|id| *id += base);
            planned.wave = wave;
            way.list.push(planned);
            way.takes_back.push(None);
            way.finishes.push((place != Item::NOWHERE).then_some(place));
        }
    }
}

/// Whether every step before and of a list was done.
pub(super) fn whole(run: &Run) -> bool {
    run.done.len() == run.list.len()
}
