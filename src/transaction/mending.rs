//! What is found different from what should be is mended, once; what becomes of that where a safe configuration comes.

use super::back::{WayBack, chain};
use super::run::StepsRun;
use super::touched::Touched;
use super::{Can, LeftBeside, Transaction, TransactionPhase};
use crate::model::{ComponentName, OnFailure, RunState, Snapshot, Step};
use crate::stack::Residual;
use crate::system::touch::{Slot, slot};
use crate::system::{Overlay, System, View as _, moves_any, step, without};
use rustc_hash::FxHashSet;
use std::sync::Arc;

/// What is known of mending.
#[derive(Debug, Default)]
pub(super) struct Mending {
    /// What the components are compared with after it, and whether that has nothing of what was done.
    pub target: Option<Box<(System, bool)>>,
    /// It was interrupted; whether it was of all that is left.
    pub interrupted: Option<bool>,
    /// It has broken off: what had failed may be on its way to where it should be.
    pub broke_off: bool,
    /// What leads from what was found, and the model took over, to what it had before, but for what the transaction itself has
    /// done: it still should be so, if mending breaks off.
    pub otherwise: Vec<Step>,
}

impl Mending {
    /// A safe configuration comes.
    pub fn interrupt(&mut self) {
        self.interrupted = self.target.take().map(|target| target.1);
    }

    /// Whether it was not brought to its end.
    pub fn broke(&self) -> bool {
        self.broke_off || self.interrupted.is_some()
    }
}

impl Transaction {
    /// Puts components that it has brought into a fault, or found elsewhere, back to where they were, unless these safe
    /// configurations want them somewhere: also those that are on their way from there, where they were being mended.
    pub(super) fn put_back(&self, system: &mut System, heeding: &Touched) {
        let broke = self.mending.broke();
        for step in self.mending.otherwise.iter().filter(|step| broke && !heeding.has(step)) {
            let _ = step::apply(step, system);
        }
        let forward = &self.forward;
        // The last fault of a component first: between two of them the way back may have brought it somewhere else.
        for (component, state) in forward.faulted.iter().chain(&self.faulted).rev() {
            let on_its_way = broke && heeding.wants(*component).is_none();
            if system.component(*component).is_some_and(|node| on_its_way || node.state == RunState::Faulted) {
                system.set_state(*component, *state);
            }
        }
    }

    /// Whether a difference may be mended by itself.
    pub(super) fn mends(&self, part: usize) -> bool {
        let held = self.planned.parts.get(part).is_some_and(|part| part.on_failure == OnFailure::Hold);
        (!held || self.asked_back) && self.withheld.is_none() && !self.taken_down && !self.broken_off
    }

    /// Compares what was seen of its components with what should be; mends the difference once; names what remains.
    pub(super) fn compare(&mut self, seen: Option<Snapshot>, live: &mut System, can: &Can<'_>) {
        let part = self.failed_part();
        let own = self.own();
        self.note_perhaps(live);
        let (wanted, whole) = match self.mending.target.take() {
            Some(target) => *target,
            None => self.wanted(part, live),
        };
        let known = live.clone();
        let adopted = seen.as_ref().map(|seen| live.adopt(&own, seen).is_ok());
        let observed = adopted == Some(true);
        if observed && self.phase == TransactionPhase::Looking && self.mends(part) {
            let asked = self.is_asked(part);
            let steps = self.own_difference(live, &wanted);
            let steps: Vec<Step> = steps
                .into_iter()
                .filter(|step| matches!(step, Step::Disconnect { .. }) || !can.quarantined.contains(&step.component()))
                .collect();
            let steps = if asked { self.not_of_others(steps, live) } else { steps };
            if !steps.is_empty() && (asked || !moves_any(&steps, live)) {
                let done = self.forward.done.iter().map(|i| slot(&self.forward.list[*i as usize].step));
                let done: FxHashSet<Slot> = done.collect();
                let otherwise = self.own_difference(live, &known);
                if !self.mending.broke() {
                    self.mending.otherwise = otherwise.into_iter().filter(|step| !done.contains(&slot(step))).collect();
                }
                return self.mend(steps, (wanted, whole));
            }
        }
        self.judge(part, &wanted, whole, observed, live, can);
    }

    /// Whether it was asked that it goes back: then what it has moved may move.
    fn is_asked(&self, part: usize) -> bool {
        self.asked_back || !self.interrupted && self.planned.parts[part].on_failure == OnFailure::Rollback
    }

    /// Those of these steps that can be done where nothing moves that it has not moved itself: who gives it up, or wants it taken back, has
    /// asked for nothing else.
    fn not_of_others(&self, steps: Vec<Step>, live: &System) -> Vec<Step> {
        let own: Vec<ComponentName> = self.forward.moved().collect();
        let others = |step: &Step, view: &Overlay<'_>| step::moves(step, view) && !own.contains(&step.component());
        if moves_any(&steps, live) { without(steps, live, others) } else { steps }
    }

    /// What differs where it has taken back all that it has done, and nothing but what others had moved is otherwise than it was believed to
    /// be: it is none of its doing.
    pub(super) fn left_beside(
        &self,
        part: usize,
        residual: &Residual,
        wanted: &System,
        live: &System,
    ) -> Option<LeftBeside> {
        let all_back = residual.left.is_empty() && self.perhaps.is_empty();
        let known = residual.observed && residual.unsettled.is_empty();
        if !all_back || !known || !residual.faulted.is_empty() || !residual.quarantined.is_empty() {
            return None;
        }
        let mend = self.own_difference(live, wanted);
        let goes_back = self.mends(part) && self.is_asked(part);
        if !goes_back || mend.is_empty() || !self.not_of_others(mend, live).is_empty() {
            return None;
        }
        let guests = residual.guests(&self.own());
        let own: Vec<ComponentName> = residual.components().filter(|component| !guests.contains(component)).collect();
        let difference = residual.difference.clone();
        let residual = Arc::new(Residual { difference, ..Residual::of(residual.cause.clone()) });
        Some(LeftBeside { residual, expected: wanted.snapshot_some(&own), guests })
    }

    /// Mends the difference between what is there and what should be.
    fn mend(&mut self, steps: Vec<Step>, target: (System, bool)) {
        self.mending.target = Some(Box::new(target));
        let list = chain(steps);
        self.back = Some((StepsRun::untimed(Arc::new(list)), WayBack::default()));
        self.phase = TransactionPhase::Mending;
    }
}
