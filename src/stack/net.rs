//! The net of a list of steps: fewer steps to the same system.
//!
//! What this leaves out is argued step by step below; all the same, whoever uses the result on a live system simulates it
//! and compares, and falls back to the whole list where they differ.

use crate::model::{ComponentName, MemberRef, Step, Transition, Tunable};
use crate::plan::footprint::Slot;
use crate::plan::undo::{DraftStep, Script, absolute};
use crate::plan::{PlannedStep, StepId};
use crate::system::{Overlay, System, View, is_so};
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;

/// The net of `items`. `present` is the system they begin in, where it is known; `bound` tells whether a property may be
/// set only in certain run states.
pub fn reduce<V: View>(
    items: Vec<DraftStep>,
    present: Option<&V>,
    bound: &dyn Fn(MemberRef) -> bool,
) -> Vec<DraftStep> {
    cancel(drop_writes(items, present, &|_| false), bound, &|_| false)
}

/// The same where some components have the same things for themselves (`rivals`), one after the other, and nobody simulates the result: what such
/// a one holds matters to the others from when it is configured on until it is cleaned up, and so does what its properties say then.
pub(super) fn reduce_among(
    items: Vec<DraftStep>,
    bound: &dyn Fn(MemberRef) -> bool,
    rivals: &dyn Fn(ComponentName) -> bool,
) -> Vec<DraftStep> {
    let items = cancel(drop_writes::<System>(items, None, rivals), bound, rivals);
    // What was written for a state that nobody is brought to any more.
    cancel(drop_writes::<System>(items, None, rivals), bound, rivals)
}

/// Whether a property may be set only in certain run states: also that of a component that is neither now nor at the end
/// there.
pub(super) fn is_bound(property: MemberRef, now: &impl View, end: &impl View) -> bool {
    let node = now.component(property.component).or_else(|| end.component(property.component));
    let declared = node.and_then(|n| n.property(property.member));
    declared.is_none_or(|(_, p)| p.tunable != Tunable::Always)
}

/// The net of `whole` with the places of its steps in it, when it ends in the same system (`end`) and is shorter.
pub(super) fn shorter(
    system: &System,
    end: &Overlay<'_>,
    whole: &[PlannedStep],
) -> Option<(Vec<PlannedStep>, Vec<u32>)> {
    let bound = |property: MemberRef| is_bound(property, system, end);
    let reduced = reduce(whole.iter().map(DraftStep::of).collect(), Some(system), &bound);
    if reduced.len() >= whole.len() {
        return None;
    }
    let mut view = Overlay::new(system);
    let mut script = Script::new(&mut view);
    for item in reduced {
        let after: SmallVec<[StepId; 1]> = script.steps.last().map(|s| s.id).into_iter().collect();
        script.add(item, 0, &after).ok()?;
    }
    let net = script.finish_placed().ok()?;
    view.same(end).then_some(net)
}

/// Of a list whose steps wait for each other one by one: values and calls wait only for those of their own component, and for what makes, drops,
/// moves or connects one. What is made safe on one component does not wait until another one has answered.
pub(super) fn components_side_by_side(steps: &mut [PlannedStep]) {
    let mut barrier: Option<StepId> = None;
    let mut last: FxHashMap<ComponentName, StepId> = FxHashMap::default();
    for planned in steps {
        planned.after = match &planned.step {
            Step::PropertySet { .. } | Step::PortWrite { .. } | Step::Operation(_) => {
                last.insert(planned.step.component(), planned.id).or(barrier).into_iter().collect()
            }
            _ => {
                let mut before: SmallVec<[StepId; 4]> = last.drain().map(|(_, id)| id).collect();
                before.sort_unstable();
                before.extend(barrier.filter(|_| before.is_empty()));
                barrier = Some(planned.id);
                before
            }
        };
    }
}

/// Absolute writes: only the last one to a slot counts, none to a component that is destroyed afterwards, and none of the
/// value that is there. No precondition depends on what a property or a port holds, so leaving one out harms nothing; but when a
/// rival is configured, its properties say what it holds.
fn drop_writes<V: View>(
    items: Vec<DraftStep>,
    present: Option<&V>,
    rivals: &dyn Fn(ComponentName) -> bool,
) -> Vec<DraftStep> {
    let mut lives: FxHashMap<ComponentName, (u32, bool)> = FxHashMap::default();
    let mut later: FxHashSet<(Slot, u32)> = FxHashSet::default();
    let mut kept: Vec<DraftStep> = Vec::with_capacity(items.len());
    for item in items.into_iter().rev() {
        let component = item.step.component();
        match &item.step {
            Step::Create { .. } => {
                let life = lives.entry(component).or_default();
                *life = (life.0 + 1, false);
            }
            Step::Destroy { .. } => {
                let life = lives.entry(component).or_default();
                *life = (life.0 + 1, true);
            }
            Step::State { transition: Transition::Configure, .. } if rivals(component) => {
                let life = lives.entry(component).or_default();
                *life = (life.0 + 1, false);
            }
            _ => {
                if let Some(slot) = absolute(&item.step) {
                    let (life, doomed) = lives.get(&component).copied().unwrap_or_default();
                    if doomed || !later.insert((slot, life)) {
                        continue;
                    }
                }
            }
        }
        kept.push(item);
    }
    kept.reverse();
    let Some(present) = present else { return kept };
    let mut replaced: FxHashSet<ComponentName> = FxHashSet::default();
    kept.retain(|item| match &item.step {
        Step::Create { component, .. } | Step::Destroy { component } => {
            replaced.insert(*component);
            true
        }
        step if absolute(step).is_some() => replaced.contains(&step.component()) || !is_so(step, present),
        _ => true,
    });
    kept
}

/// What a slot's surviving steps are, newest last.
#[derive(Default)]
struct Trail(Vec<usize>);

impl Trail {
    fn last(&mut self, out: &[Option<DraftStep>]) -> Option<usize> {
        while let Some(at) = self.0.last() {
            if out[*at].is_some() {
                return Some(*at);
            }
            self.0.pop();
        }
        None
    }
}

#[derive(PartialEq, Eq, Hash, Clone, Copy)]
enum TrailKey {
    /// Moves of a component.
    Moves(ComponentName),
    /// What needs the component's run state as it is there.
    Needs(ComponentName),
    /// Creates and destroys.
    Exists(ComponentName),
    /// Anything at all.
    Any(ComponentName),
    /// Steps on one connection.
    Link(MemberRef, MemberRef),
    /// Steps that an in-port's being driven or not matters to.
    Drive(MemberRef),
    /// A rival takes what it has for itself, or lets it go.
    Holds,
}

struct Trails {
    trails: FxHashMap<TrailKey, Trail>,
    out: Vec<Option<DraftStep>>,
}

impl Trails {
    fn last(&mut self, kind: TrailKey) -> Option<usize> {
        self.trails.get_mut(&kind).and_then(|t| t.last(&self.out))
    }

    fn since(&mut self, kind: TrailKey, at: usize) -> bool {
        self.last(kind).is_some_and(|last| last > at)
    }

    fn push(&mut self, item: DraftStep, kinds: &[TrailKey]) {
        for kind in kinds {
            self.trails.entry(*kind).or_default().0.push(self.out.len());
        }
        self.out.push(Some(item));
    }
}

/// Pairs that take each other back, where nothing between needs the first.
fn cancel(
    items: Vec<DraftStep>,
    bound: &dyn Fn(MemberRef) -> bool,
    rivals: &dyn Fn(ComponentName) -> bool,
) -> Vec<DraftStep> {
    let mut t = Trails { trails: FxHashMap::default(), out: Vec::with_capacity(items.len()) };
    for item in items {
        match &item.step {
            Step::State { component, transition } => {
                let c = *component;
                let holds = matches!(transition, Transition::Configure | Transition::Cleanup) && rivals(c);
                if let Some(at) = t.last(TrailKey::Moves(c))
                    && let Some(DraftStep { step: Step::State { transition: before, .. }, .. }) = &t.out[at]
                    && before.inverse() == *transition
                    && !t.since(TrailKey::Needs(c), at)
                    && !(holds && t.since(TrailKey::Holds, at))
                {
                    t.out[at] = None;
                } else if holds {
                    t.push(item, &[TrailKey::Moves(c), TrailKey::Any(c), TrailKey::Holds]);
                } else {
                    t.push(item, &[TrailKey::Moves(c), TrailKey::Any(c)]);
                }
            }
            Step::PropertySet { property, .. } => {
                let c = property.component;
                if bound(*property) {
                    t.push(item, &[TrailKey::Needs(c), TrailKey::Any(c)]);
                } else {
                    t.push(item, &[TrailKey::Any(c)]);
                }
            }
            Step::PortWrite { port, .. } => {
                let (port, c) = (*port, port.component);
                t.push(item, &[TrailKey::Drive(port), TrailKey::Any(c)]);
            }
            Step::Operation(call) => {
                let c = call.operation.component;
                t.push(item, &[TrailKey::Needs(c), TrailKey::Any(c)]);
            }
            Step::Create { component, .. } => {
                let c = *component;
                t.push(item, &[TrailKey::Exists(c), TrailKey::Needs(c), TrailKey::Any(c)]);
            }
            Step::Destroy { component } => {
                let c = *component;
                // Created and destroyed again, with nothing left in between that happened to it.
                if let Some(at) = t.last(TrailKey::Exists(c))
                    && matches!(&t.out[at], Some(DraftStep { step: Step::Create { .. }, .. }))
                    && !t.since(TrailKey::Any(c), at)
                {
                    t.out[at] = None;
                } else {
                    t.push(item, &[TrailKey::Exists(c), TrailKey::Needs(c), TrailKey::Any(c)]);
                }
            }
            Step::Connect { from, to, .. } | Step::Disconnect { from, to } => {
                let (from, to) = (*from, *to);
                if let Some(at) = t.last(TrailKey::Link(from, to))
                    && undone(&mut t, at, &item, from, to)
                {
                    t.out[at] = None;
                } else {
                    let (a, b) = (from.component, to.component);
                    t.push(item, &[TrailKey::Link(from, to), TrailKey::Drive(to), TrailKey::Any(a), TrailKey::Any(b)]);
                }
            }
        }
    }
    t.out.into_iter().flatten().collect()
}

/// Whether `item` takes back the step at `at` on the same connection.
fn undone(t: &mut Trails, at: usize, item: &DraftStep, from: MemberRef, to: MemberRef) -> bool {
    if t.since(TrailKey::Exists(from.component), at) || t.since(TrailKey::Exists(to.component), at) {
        return false;
    }
    let before = t.out[at].as_ref();
    match (before.map(|b| (&b.step, b.was)), &item.step) {
        // A connection less in between: nothing that was allowed with it is refused without it.
        (Some((Step::Connect { .. }, _)), Step::Disconnect { .. }) => true,
        // A connection more in between: only what needs the in-port undriven, or drives it, minds.
        (Some((Step::Disconnect { .. }, Some(was))), Step::Connect { policy, .. }) => {
            was == *policy && !t.since(TrailKey::Drive(to), at)
        }
        _ => false,
    }
}
