//! An undo repairs what is broken of its frame, but for what would move and is not its own: who lets go of something has not asked for that.
//!
//! A belt that had never started, though the platform had said so, is not started by the end of an emergency. What is left so stays broken,
//! and is from then on about the frame that had brought it there: the undo of that one takes it back, and an operator who recovers mends it.

use super::mend::goes_on;
use super::{Broken, Frame, FrameId, Planned, Reason, Requester, Residual, World};
use crate::model::{ConfigId, Snapshot, Step, Transition};
use crate::plan::PlanContext;
use crate::system::{System, View as _, diff, moves_any, step, touch, without};
use std::sync::Arc;

/// What comes of something broken when an undo is done beside it.
pub enum Beside {
    /// It is left so, and this is expected of it.
    Left(Snapshot),
    /// The undo would move what it does not undo: what is broken is mended first, since it needs that.
    Hindered,
    /// It would not go then either.
    Barred,
}

impl World {
    /// The undo of a frame, with those of others that come first, in one net with what mends what is broken at this place, and what
    /// of that is left, as it is expected then. Nothing moves but what is undone. None: each goes by itself.
    pub fn undo_mended(
        &self,
        at: usize,
        of: (FrameId, &[FrameId]),
        context: &PlanContext,
    ) -> Option<(Planned, Option<Snapshot>)> {
        let meant = self.as_meant(&self.broken[at]);
        let undo = Self::undo_in(&meant, &self.stack, of, context).ok()?;
        let own: Vec<Step> = undo.steps.iter().map(|planned| planned.step.clone()).collect();
        let still = |net: &Planned| moves_only(net, &own);
        if let Some(whole) = self.in_one_net(at, &meant, undo).filter(still) {
            return Some((whole, None));
        }
        let rest = self.at_rest(at)?;
        let undo = Self::undo_in(&rest, &self.stack, of, context).ok()?;
        let planned = self.in_one_net(at, &rest, undo).filter(still)?;
        Some((planned, Some(self.left_by(at, &own))))
    }

    /// What comes of what is broken at this place when `planned`, the undo of a frame and others, is done beside it.
    pub fn beside(&self, at: usize, of: (FrameId, &[FrameId]), planned: &Planned, context: &PlanContext) -> Beside {
        let steps = |planned: &Planned| planned.steps.iter().map(|planned| planned.step.clone()).collect::<Vec<Step>>();
        match Self::undo_in(&self.as_meant(&self.broken[at]), &self.stack, of, context) {
            Ok(undo) if moves_only(planned, &steps(&undo)) => Beside::Left(self.left_by(at, &steps(&undo))),
            Ok(_) => Beside::Hindered,
            Err(_) if planned.steps.iter().any(|planned| planned.moves) => Beside::Barred,
            Err(_) => Beside::Left(self.left_by(at, &steps(planned))),
        }
    }

    /// Whether something may move to mend what is broken at this place for the undo of a frame, which does not go without: it would go then; or
    /// that only comes to rest, where the model has it, and others may be in the way of the undo for the very reason that it does not.
    pub(super) fn needs_moving(&self, at: usize, of: (FrameId, &[FrameId]), context: &PlanContext) -> bool {
        let meant = self.as_meant(&self.broken[at]);
        let stops = |step: &Step| matches!(step, Step::State { transition: Transition::Stop, .. });
        let mut moving = diff(&self.system, &meant).into_iter().filter(|step| step::moves(step, &self.system));
        Self::undo_in(&meant, &self.stack, of, context).is_ok() || moving.all(|step| stops(&step))
    }

    /// The picture with what is broken at this place as the model has it, as far as nothing has to move for that. None: nothing has to.
    fn at_rest(&self, at: usize) -> Option<System> {
        let steps = diff(&self.system, &self.as_meant(&self.broken[at]));
        moves_any(&steps, &self.system).then(|| {
            let mut rest = self.system.clone();
            for step in self.without_moving(steps) {
                step::effect(&step, &mut rest);
            }
            rest
        })
    }

    /// Those of these steps that can be done where none that moves is.
    pub fn without_moving(&self, steps: Vec<Step>) -> Vec<Step> {
        without(steps, &self.system, |step, view| step::moves(step, view))
    }

    /// Whether what is broken at this place, and is not as the model has it, is so only since something would have to move.
    pub fn rests(&self, at: usize) -> bool {
        self.at_rest(at).is_some_and(|rest| diff(&self.system, &rest).is_empty())
    }

    /// What is expected of what is broken at this place when an undo of these steps is done beside it.
    fn left_by(&self, at: usize, steps: &[Step]) -> Snapshot {
        let own = self.broken[at].own();
        let mut meant = self.system.clone();
        if meant.adopt(&own, &self.broken[at].expected).is_err() {
            return self.broken[at].expected.clone();
        }
        for step in steps.iter().filter(|step| touch::components(step).iter().any(|of| own.contains(of))) {
            _ = goes_on(step, &mut meant);
        }
        meant.snapshot_some(&own)
    }

    /// An undo is done beside what is broken at this place: this is expected of it, and where that is otherwise it was seen so. Answers the
    /// steps that would mend it; none: nothing is left.
    pub fn is_left(&mut self, at: usize, expected: Snapshot) -> Option<Vec<Step>> {
        self.broken[at].expected = expected;
        let meant = self.as_meant(&self.broken[at]);
        let mend = diff(&self.system, &meant);
        let difference = diff(&meant, &self.system);
        let withheld = mend.iter().find(|step| step::moves(step, &self.system)).cloned();
        let cause = Reason::SeenOtherwise(difference.clone());
        self.broken[at].residual = Arc::new(Residual { difference, withheld, ..Residual::of(cause) });
        (!mend.is_empty()).then_some(mend)
    }

    /// The undo beside what is broken at this place has ended *broken* itself, and expects this: what would have moved is part of that.
    /// What is left of it are other components.
    pub fn breaks_beside(&mut self, at: usize, expected: &mut Snapshot) {
        let broken = &mut self.broken[at];
        for (name, meant) in &broken.expected.components {
            let state = self.system.component(*name).map(|node| node.state);
            if let Some(one) = expected.components.get_mut(name).filter(|one| Some(one.state) == state) {
                one.state = meant.state;
            }
        }
        broken.components.retain(|name| !expected.components.contains_key(name));
    }

    /// What was being done when something safe came is taken back by these steps: what is broken since is not expected with it any more.
    pub fn expects_back(&mut self, steps: &[Step]) {
        for at in self.broken_about(steps) {
            self.broken[at].expected = self.left_by(at, steps);
        }
    }

    /// These steps are done beside what is broken: of all but `mended`, for which that is known, what they are about is expected so. Where it was
    /// expected elsewhere they have led on from what is there: who asked for them had the last word.
    pub fn expects_done(&mut self, steps: &[Step], mended: Option<&Arc<Residual>>) {
        for at in self.broken_about(steps) {
            if mended.is_some_and(|mended| Arc::ptr_eq(mended, &self.broken[at].residual)) {
                continue;
            }
            self.broken[at].expected = self.left_by(at, steps);
            for step in steps {
                if let Step::State { component, transition } = step
                    && let Some(one) = self.broken[at].expected.components.get_mut(component)
                {
                    one.state = transition.target();
                }
            }
        }
    }

    /// The places of what is broken of what these steps are about.
    fn broken_about(&self, steps: &[Step]) -> Vec<usize> {
        let about = |broken: &Broken| {
            let own = broken.own();
            steps.iter().any(|step| touch::components(step).iter().any(|of| own.contains(of)))
        };
        (0..self.broken.len()).filter(|at| about(&self.broken[*at])).collect()
    }

    /// Whether nothing is in force any more of what had broken this: then nobody's undo is about it.
    pub fn is_nobodys(&self, broken: &Broken) -> bool {
        let in_force = |(id, by): (ConfigId, Requester)| self.stack.newest_of(id, Some(by)).is_some();
        broken.frame.is_none_or(|frame| self.stack.frame(frame).is_none()) && !broken.culprit.is_some_and(in_force)
    }

    /// What is broken at this place is about another frame from now on, or about none: the undo of that repairs it.
    pub fn is_about(&mut self, at: usize, frame: Option<&Frame>) {
        let broken = &mut self.broken[at];
        broken.frame = frame.map(|frame| frame.id);
        broken.culprit = frame.map(|frame| (frame.configuration, frame.requester));
        broken.mendable = false;
    }
}

/// Whether nothing moves but by these steps.
fn moves_only(planned: &Planned, own: &[Step]) -> bool {
    planned.steps.iter().filter(|planned| planned.moves).all(|planned| own.contains(&planned.step))
}
