//! What is broken is brought to where the model has it: by itself, or with the undo that asks for it.

use super::engine::Engine;
use super::inbox::PoolReply;
use super::pool::PlatformCall;
use super::progress::Progress;
use super::request::{Reason, Request};
use super::running::Running;
use super::suspects::CameBack;
use super::teardown::own_plan;
use crate::limits;
use crate::model::{ComponentName, RequestId, RunState, Snapshot, Step, Verdict};
use crate::plan::undo::in_order;
use crate::stack::{Broken, Edits, FrameId, Group, HandOver, Inverse, Residual, Why, keeps_still};
use crate::system::{self, View as _, step, touch};
use crate::transaction::{BrokenPart, LeftBeside, PartEnd, Spec, Transaction};
use std::sync::Arc;

/// What came of repairing something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Repaired {
    /// It is as the model has it.
    Whole,
    /// But for what would move: an undo has not asked for that. It is broken still.
    Rests,
}

/// Who has something repaired.
#[derive(Debug, Clone, Copy)]
pub(super) enum By {
    /// An operator who recovers, without force.
    Recovery,
    /// The request of a batch under way, by that number: the undo of what broke it. `moving`: it does not go without what moves.
    Request { number: u32, moving: bool },
    /// Nobody, to pop a frame while everything is taken down.
    Stopping,
    /// Nobody: a component came back.
    Nobody,
}

impl Engine {
    /// Safe configurations that have come are applied first: they move, and nothing else does.
    pub(super) fn after_safe(&mut self) {
        loop {
            self.serve_safe();
            if !self.running.iter().any(Running::is_safe) {
                return;
            }
            if !self.advance_all() {
                self.pump(self.running_until());
            }
        }
    }

    /// Mends what a request is about to undo. None: it was answered, since that does not go.
    pub(super) fn repair_for(&mut self, (number, moving): (u32, bool), at: usize) -> Option<Repaired> {
        let request = self.desk.active(number).map(|active| active.batch.requests[0])?;
        match self.repair(at, By::Request { number, moving }) {
            Ok(repaired) => Some(repaired),
            Err(residual) => {
                let held = self.held_frames();
                self.world.stays(&request, &held);
                self.answer(request, Verdict::UndoBroken, Some(Reason::Broken(residual)));
                None
            }
        }
    }

    /// What is repaired in one net with its undo is broken no more when that is done, but for what would have moved, and where that has
    /// left something, it is told by that. Where nothing of it was done it is broken as before.
    pub(super) fn mended(&mut self, group: &mut Group, mut parts: Vec<PartEnd>, interrupted: bool) -> Vec<PartEnd> {
        let Some(of) = group.mends.clone() else { return parts };
        let Some(at) = self.place_of(&of) else { return parts };
        match (parts.first_mut(), &group.left) {
            (Some(PartEnd::Done), Some(_)) => {}
            (Some(PartEnd::Broken(part)), Some(_)) if part.residual.is_settled() => {}
            (Some(PartEnd::Broken(part)), Some(_)) => {
                group.left = None;
                self.world.breaks_beside(at, &mut part.expected);
                if self.world.broken[at].own().is_empty() {
                    self.forget_broken(&of);
                }
            }
            (Some(PartEnd::Done | PartEnd::Broken(_)), None) => self.forget_broken(&of),
            (Some(part @ PartEnd::Failed(_)), _) if !interrupted => {
                group.left = None;
                if let (Some(cause), broken) = (part.reason(), &self.world.broken[at]) {
                    let difference = system::diff(&self.world.as_meant(broken), &self.world.system);
                    let residual = Arc::new(Residual { cause, difference, ..(*broken.residual).clone() });
                    self.world.broken[at].residual = residual.clone();
                    *part = PartEnd::Broken(Box::new(BrokenPart::of(residual)));
                }
            }
            _ => group.left = None,
        }
        parts
    }

    /// What something safe had interrupted has gone back since: what has broken meanwhile is not to be as that had made it.
    pub(super) fn taken_back(&mut self, back: &[(usize, Step)], parts: &[PartEnd]) {
        let gone = |part: usize| matches!(parts[part], PartEnd::Failed(_) | PartEnd::Cancelled);
        let steps: Vec<Step> = back.iter().filter(|(part, _)| gone(*part)).map(|(_, step)| step.clone()).collect();
        self.world.expects_back(&steps);
    }

    /// Parts that are done have led on what else is broken of their components as well: it is expected as these steps, each of a part, have left it.
    pub(super) fn went_on(&mut self, group: &Group, steps: &[(usize, Step)], parts: &[PartEnd]) {
        let done = steps.iter().filter(|(part, _)| matches!(parts[*part], PartEnd::Done));
        let done: Vec<Step> = done.map(|(_, step)| step.clone()).collect();
        self.world.expects_done(&done, group.mends.as_ref());
    }

    /// An undo is done beside what is broken, of which this is expected now. What is left of it, since it would move, is about the frame in
    /// force that had moved it: that is lost.
    pub(super) fn leave(&mut self, of: &Arc<Residual>, expected: Snapshot) {
        let Some(at) = self.place_of(of) else { return };
        let Some(mend) = self.world.is_left(at, expected) else {
            let residual = self.world.broken[at].residual.clone();
            return self.is_whole(&residual);
        };
        // What is safe has not moved it: it is undone beside what is broken.
        let owner = mend.iter().find_map(|step| self.wrote(step, |frame| !frame.safe));
        self.world.is_about(at, owner.as_deref());
        self.changed();
        let residual = &self.world.broken[at].residual;
        if let Some(owner) = owner {
            self.lose(owner.configuration, residual.cause.clone());
        }
    }

    /// Something that has gone back has found what others had moved otherwise than it was believed to be: that is left so, and told.
    pub(super) fn left_beside(&mut self, beside: Option<LeftBeside>) {
        let Some(LeftBeside { residual, expected, guests }) = beside else { return };
        let components = residual.components().collect();
        let of = residual.clone();
        let expects = expected.clone();
        self.world.ends_broken(Broken { guests, ..Broken::of_nobody(residual, components, expects) });
        self.leave(&of, expected);
    }

    /// Looks once more at something broken that somebody is about to be refused for: where it has become as the model has it, by what was undone
    /// or written since, it is broken no more. Nothing is done for that. What nobody knows is accepted so only where nothing is in force any more of
    /// what had called it: nobody's undo would accept it.
    pub(super) fn is_right_again(&mut self, of: &Arc<Residual>) -> bool {
        let Some(at) = self.place_of(of) else { return false };
        let known = of.unsettled.is_empty() || self.world.is_nobodys(&self.world.broken[at]);
        if !known || !self.read_broken(at) {
            return false;
        }
        if of.unsettled.iter().any(|step| self.world.quarantined.contains(&step.component())) {
            return false;
        }
        let Some(broken) = self.place_of(of).map(|at| &self.world.broken[at]) else { return false };
        let (meant, frame) = (self.world.as_meant(broken), broken.frame);
        if !system::diff::reached(&self.world.system, &meant) || self.world.is_hidden(broken) {
            return false;
        }
        self.is_whole(of);
        self.drop_empty(frame);
        true
    }

    /// Something broken is as the model has it: what it was about is there again.
    pub(super) fn is_whole(&mut self, of: &Arc<Residual>) {
        let Some(at) = self.place_of(of) else { return };
        let difference = self.world.broken[at].residual.difference.clone();
        self.forget_broken(of);
        for step in &difference {
            if let Some(frame) = self.wrote(step, |_| true)
                && self.world.broken.iter().all(|broken| broken.frame != Some(frame.id))
            {
                self.is_found_again(frame.configuration);
            }
        }
    }

    /// Something broken is no more, or is part of something else that is.
    pub(super) fn forget_broken(&mut self, of: &Arc<Residual>) {
        if let Some(at) = self.place_of(of) {
            let broken = self.world.broken.remove(at);
            self.world.hand_meant(&broken);
        }
        self.changed();
    }

    /// The request that something is repaired for; one that a safe configuration has overtaken is marked since.
    fn request_of(&self, by: By) -> Option<&Request> {
        let By::Request { number, .. } = by else { return None };
        self.desk.active(number).and_then(|active| active.batch.requests.first())
    }

    /// Whether these may move for who has them repaired: asked only when it is known what is to be done, since a safe configuration
    /// may come while it is looked.
    fn may_move(&self, by: By, components: &[ComponentName]) -> bool {
        let components = components.iter().copied();
        match by {
            By::Recovery => !components.into_iter().any(|component| self.world.stack.keeper_of(component).is_some()),
            By::Request { moving, .. } => self.request_of(by).is_some_and(|request| {
                moving && request.why == Why::Asked && !keeps_still(&self.world, request, components)
            }),
            By::Stopping | By::Nobody => false,
        }
    }

    /// Where something broken stands, by what is left of it.
    fn place_of(&self, of: &Arc<Residual>) -> Option<usize> {
        self.world.broken.iter().position(|broken| Arc::ptr_eq(&broken.residual, of))
    }

    /// Brings what is broken to where the model has it. What is unsettled is accepted by that. It counts as broken until that is
    /// done: who comes while it is looked and mended plans with it, and who asks is told of it.
    pub(super) fn repair(&mut self, at: usize, by: By) -> Result<Repaired, Arc<Residual>> {
        let serves = self.request_of(by).map_or(RequestId(0), |request| request.id);
        let broken = self.world.broken[at].clone();
        let components: Vec<ComponentName> = broken.components.iter().copied().collect();
        let mut observed = self.read(&components);
        let mut withheld = None;
        let undone = matches!(by, By::Request { moving: false, .. } | By::Stopping);
        if observed {
            self.note_quarantine();
            // Made of what is there now: others go on while it is looked.
            let steps = self.world.mending(&broken);
            let hung = |step: &Step| self.world.quarantined.contains(&step.component());
            let steps: Vec<Step> =
                steps.into_iter().filter(|step| matches!(step, Step::Disconnect { .. }) || !hung(step)).collect();
            if undone {
                withheld = steps.iter().find(|step| step::moves(step, &self.world.system)).cloned();
            }
            let steps = if undone { self.world.without_moving(steps) } else { steps };
            let moves = system::diff::moves_any(&steps, &self.world.system);
            let touched: Vec<ComponentName> =
                components.iter().copied().chain(steps.iter().flat_map(touch::components)).collect();
            // Who is asked for nothing waits for nobody: it is tried again when that has ended.
            let later = matches!(by, By::Nobody) && self.is_worked_on(&touched);
            if later {
                self.returned = CameBack::Later;
            }
            let asked = self.may_move(by, &touched);
            if moves && !asked && self.world.stack.safe().next().is_some() {
                withheld = steps.iter().find(|step| step::moves(step, &self.world.system)).cloned();
            }
            if !steps.is_empty() && (asked || !moves) && !later {
                let list = in_order(&self.world.system, steps).unwrap_or_default();
                let plan = own_plan(list, &self.world.system);
                let spec = Spec { asked_back: asked, ..self.effort([]) };
                let _ = self.carry_out_for(serves, Transaction::new(plan, spec));
                observed = self.read(&components);
            }
        }
        let wanted = self.world.as_meant(&broken);
        // A call that is out still may happen yet.
        let out = |step: &Step| self.world.quarantined.contains(&step.component());
        let out = broken.residual.unsettled.iter().any(out);
        if observed && system::diff::reached(&self.world.system, &wanted) && !out && !self.world.is_hidden(&broken) {
            self.is_whole(&broken.residual);
            self.drop_empty(broken.frame);
            return Ok(Repaired::Whole);
        }
        let mut faulted: Vec<ComponentName> = Vec::new();
        for node in components.iter().filter_map(|name| self.world.system.component(*name)) {
            if node.state == RunState::Faulted
                && wanted.component(node.name).is_none_or(|w| w.state != RunState::Faulted)
            {
                faulted.push(node.name);
            }
        }
        let residual = Arc::new(Residual {
            difference: system::diff(&wanted, &self.world.system),
            faulted,
            quarantined: self.world.quarantined.clone(),
            observed,
            withheld: withheld.or_else(|| broken.residual.withheld.clone()),
            ..(*broken.residual).clone()
        });
        let place = self.place_of(&broken.residual);
        if let Some(at) = place {
            self.world.broken[at].residual = residual.clone();
        }
        self.changed();
        match place {
            Some(at) if undone && observed && !out && self.world.rests(at) => Ok(Repaired::Rests),
            _ => Err(residual),
        }
    }

    /// A partial frame that holds nothing to take back is gone with what was broken.
    fn drop_empty(&mut self, frame: Option<FrameId>) {
        let Some(frame) = frame.and_then(|frame| self.world.stack.frame(frame)) else { return };
        if frame.partial && frame.floor.is_none() && matches!(&frame.inverse, Inverse::List(items) if items.is_empty())
        {
            let edits = Edits { pops: vec![(frame.id, HandOver::default())], ..Edits::default() };
            self.world.stack.apply([&edits], &[]);
        }
    }

    /// Reads some components back into the model. False: nobody answered, or a safe configuration touched them each time while
    /// it was looked: what was seen then may be from before that.
    fn read(&mut self, components: &[ComponentName]) -> bool {
        for _ in 0..limits::LOOKS_AGAIN {
            let before: Vec<Option<u64>> = components.iter().map(|name| self.generation(*name)).collect();
            let Some(PoolReply::Observed(Ok(seen))) = self.ask(PlatformCall::ObserveSome(components.to_vec())) else {
                return false;
            };
            self.after_safe();
            if components.iter().zip(&before).any(|(name, before)| self.generation(*name) != *before) {
                continue;
            }
            let Ok(changed) = self.world.system.adopt(components, &seen) else { return false };
            if changed {
                self.switches.clear();
                self.changed();
            }
            return true;
        }
        false
    }

    /// A component came back from a call that had never returned: what could not be mended because of it may be now, beside whatever else is
    /// under way. By itself nothing moves.
    pub(super) fn mend(&mut self) {
        self.returned = CameBack::Nobody;
        self.note_quarantine();
        let mut at = 0;
        while at < self.world.broken.len() {
            let broken = &self.world.broken[at];
            let about: Vec<ComponentName> = broken.components.iter().copied().collect();
            if !broken.mendable {
                at += 1;
            } else if self.is_worked_on(&about) {
                self.returned = CameBack::Later;
                at += 1;
            } else if self.repair(at, By::Nobody).is_ok() {
                self.given.tells(|| Progress::Recovered);
            } else {
                at += 1;
            }
        }
    }

    /// Whether something under way is about one of these.
    fn is_worked_on(&self, components: &[ComponentName]) -> bool {
        let mut under_way = self.running.iter().flat_map(|running| running.machine.components());
        under_way.any(|component| components.contains(&component))
    }

    /// Reads what is broken back into the model. False: nobody answered.
    pub(super) fn read_broken(&mut self, at: usize) -> bool {
        let components: Vec<ComponentName> = self.world.broken[at].components.iter().copied().collect();
        let observed = self.read(&components);
        self.note_quarantine();
        observed
    }
}
