//! What safe configurations touched, and how the way back of what they interrupted heeds it (semantics: *Safe configurations*): what they wrote is
//! never overwritten, and what is brought back comes back as they want it.

use super::Transaction;
use super::messages::OpenStep;
use super::touched::Touched;
use crate::model::{ComponentName, RunState, Step, Transition, Wanted};
use crate::plan::PlannedStep;
use crate::system::touch::{Slot, absolute, components, slot};
use crate::system::{View, step};
use rustc_hash::FxHashSet;
use smallvec::{SmallVec, smallvec};

impl Transaction {
    /// Safe configurations are over that came in between, and have touched this.
    pub(super) fn release(&mut self, touched: Touched) {
        self.held = false;
        if self.back.is_some() {
            self.touched_since.get_or_insert_default().join(touched.clone());
        }
        self.touched.join(touched);
    }

    /// Whether a safe configuration has interrupted it.
    pub fn is_interrupted(&self) -> bool {
        self.interrupted
    }

    /// Tells of each step of a best effort that was done when that was.
    pub fn note_done(&self, touched: &mut Touched) {
        let forward = &self.forward;
        forward.noted.iter().for_each(|(i, revision)| touched.did(&forward.list[*i as usize].step, *revision));
    }

    /// The steps of a best effort that were not done, or of which nobody knows.
    pub fn missed(&self) -> impl Iterator<Item = &Step> {
        let forward = &self.forward;
        let failed = forward.failures.iter().map(|(i, _)| i).chain(&forward.unsettled);
        failed.map(|i| &forward.list[*i as usize].step)
    }

    /// The steps of a best effort that were not done, for all that is known.
    pub fn failed_steps(&self) -> impl Iterator<Item = &PlannedStep> {
        let forward = &self.forward;
        forward.failures.iter().map(|(i, _)| &forward.list[*i as usize])
    }

    /// The steps of a best effort that were done, for all that is known.
    pub fn done_steps(&self) -> impl Iterator<Item = &Step> {
        self.forward.done.iter().map(|i| &self.forward.list[*i as usize].step)
    }

    /// The steps of a best effort that are not over, each with whether it is out.
    pub fn still_to_do(&self) -> impl Iterator<Item = OpenStep> + '_ {
        self.forward.open().map(|(planned, begun)| OpenStep { step: planned.step.clone(), begun })
    }

    /// Values that are on their way to the platform, of steps that are out: nobody knows whether they are there.
    pub fn values_out(&self) -> impl Iterator<Item = &Step> {
        let run = self.in_hand();
        run.outstanding().map(|i| &run.list[i as usize].step).filter(|step| absolute(step).is_some())
    }

    /// A later safe configuration does these steps: what writes the same and has not begun is not issued any more. Answers
    /// whether there was such.
    pub fn yield_to<'s>(&mut self, later: impl Iterator<Item = &'s Step>) -> bool {
        let slots: FxHashSet<Slot> = later.map(slot).collect();
        self.forward.leave_out(|step| slots.contains(&slot(step)))
    }
}

/// How far a way back has come: which components it will take away again, and which it has brought back.
pub(super) struct Heed<'t> {
    touched: &'t Touched,
    doomed: FxHashSet<ComponentName>,
    /// All that were, also those that it could not take away.
    made: FxHashSet<ComponentName>,
    remade: FxHashSet<ComponentName>,
    /// What it has made and safe configurations have made as well: that stays, and nothing else of it.
    shared: FxHashSet<ComponentName>,
}

/// How far up a run state is.
pub(super) fn height(state: RunState) -> u8 {
    match state {
        RunState::Faulted | RunState::Unconfigured => 0,
        RunState::Stopped => 1,
        RunState::Running => 2,
    }
}

/// A component goes away that may have been brought up meanwhile.
fn away(component: ComponentName, back: &Step, view: &impl View) -> SmallVec<[Step; 2]> {
    let Some(node) = view.component(component) else { return smallvec![] };
    let down = node.state.path_to(Wanted::Unconfigured).iter();
    let down = down.map(|transition| Step::State { component, transition: *transition });
    down.chain([back.clone()]).collect()
}

impl<'t> Heed<'t> {
    /// A way back that begins; it takes away again what `made` has made.
    pub fn new<'s>(touched: &'t Touched, made: impl Iterator<Item = &'s Step>) -> Self {
        let created = made.filter_map(|step| match step {
            Step::Create { component, .. } => Some(*component),
            _ => None,
        });
        let created = if touched.is_empty() { Vec::new() } else { created.collect() };
        let (shared, doomed): (_, FxHashSet<_>) =
            created.into_iter().partition(|of| touched.wants_there(*of) == Some(true));
        Self { touched, made: doomed.clone(), doomed, remade: FxHashSet::default(), shared }
    }

    /// A step that came in late goes back by itself, or stays since it was overwritten: what it made is then not there to be
    /// taken away, and what comes after it on the way is about what was there before.
    pub fn came_late(&mut self, step: &Step) {
        if let Step::Create { component, .. } = step {
            self.doomed.remove(component);
            self.made.remove(component);
        }
    }

    /// What is done for a step back of what came in late.
    pub fn instead_of_late(back: &Step, view: &impl View) -> SmallVec<[Step; 2]> {
        match back {
            Step::Destroy { component } => away(*component, back, view),
            _ => smallvec![back.clone()],
        }
    }

    /// What is done for a step back, the next on the way. Empty: it is superseded.
    pub fn instead_of(&mut self, back: &Step, view: &impl View) -> SmallVec<[Step; 2]> {
        if self.touched.is_empty() {
            return smallvec![back.clone()];
        }
        let missing = |component: &ComponentName| view.component(*component).is_none();
        match back {
            Step::Create { component, ty, activity, properties } => {
                // What they have destroyed as well their own end makes again. What stands in its place and could not be taken away
                // supersedes nothing.
                let superseded = !missing(component) && !self.made.contains(component);
                if superseded || self.touched.wants_there(*component) == Some(false) {
                    return smallvec![];
                }
                self.remade.insert(*component);
                let mut properties = properties.clone();
                let names = view.types().get(*ty).into_iter().flat_map(|ty| ty.properties.keys());
                for (name, value) in names.zip(&mut properties) {
                    if let Some(wanted) = self.touched.properties.get(&component.member(*name)) {
                        value.clone_from(wanted);
                    }
                }
                let (component, ty, activity) = (*component, *ty, *activity);
                smallvec![Step::Create { component, ty, activity, properties }]
            }
            Step::Destroy { component } if self.doomed.remove(component) => away(*component, back, view),
            _ => {
                let about = components(back);
                if about.iter().any(missing) {
                    return smallvec![];
                }
                // What goes away again is nobody's to keep; and may have gone a part of the way already.
                if about.iter().any(|component| self.doomed.contains(component)) {
                    let goes = step::precondition(back, view).is_empty();
                    return goes.then(|| back.clone()).into_iter().collect();
                }
                if about.iter().any(|component| self.shared.contains(component)) {
                    let stays = matches!(back, Step::Destroy { .. }) || self.touched.slots.contains(&slot(back));
                    return (!stays).then(|| back.clone()).into_iter().collect();
                }
                if about.iter().any(|component| self.remade.contains(component)) {
                    return self.as_wanted(back).into_iter().collect();
                }
                (!self.touched.has(back)).then(|| back.clone()).into_iter().collect()
            }
        }
    }

    /// A step back about a component that was brought back, as the safe configurations want it; none: not at all.
    fn as_wanted(&self, back: &Step) -> Option<Step> {
        match back {
            Step::PropertySet { property, .. } => {
                let value = self.touched.properties.get(property).cloned();
                Some(value.map_or_else(|| back.clone(), |value| Step::PropertySet { property: *property, value }))
            }
            Step::PortWrite { port, .. } => {
                let value = self.touched.ports.get(port).cloned();
                Some(value.map_or_else(|| back.clone(), |value| Step::PortWrite { port: *port, value }))
            }
            Step::State { component, transition } => {
                let wanted = self.touched.states.get(component);
                let up = matches!(transition, Transition::Configure | Transition::Start);
                let further = |wanted: &RunState| up && height(transition.target()) > height(*wanted);
                (!wanted.is_some_and(further)).then(|| back.clone())
            }
            _ => (!self.touched.has(back)).then(|| back.clone()),
        }
    }
}
