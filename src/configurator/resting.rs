//! What force applies before it takes everything away: what is safe, and what brings the system to rest (semantics: *Stopping*).
//!
//! What the deployment's own file names for that comes first, then what those of its subsystems do: these have nothing to do with each
//! other, and are brought to rest side by side.

use super::control::TakenDown;
use super::engine::Engine;
use super::request::{Reason, Request};
use super::running::{Purpose, Running};
use super::teardown::own_plan;
use crate::limits;
use crate::model::{Ask, ComponentName, ConfigId, RequestId};
use crate::plan::PlannedStep;
use crate::stack::claims::is_in_system;
use crate::stack::{BestEffort, FrameId, Planned, Requester, effort};
use crate::system::touch;
use crate::time::Time;
use crate::transaction::Transaction;
use smallvec::SmallVec;

/// A configuration that is applied as far as it goes.
struct Applied {
    id: ConfigId,
    /// It brings something to rest: what of it fails is tried again.
    rests: bool,
    /// What is tried next, until then.
    planned: Option<Planned>,
    until: Time,
    whole: bool,
    /// What the plan has left out, and what failed in the end.
    left_out: Vec<Reason>,
    troubles: Vec<Reason>,
}

impl Engine {
    /// Applies what is safe, one after the other; no quarantine keeps it out.
    pub(super) fn make_all_safe(&mut self, ids: &[ConfigId], down: &mut TakenDown) {
        for id in ids {
            self.apply_together(std::slice::from_ref(id), None, down);
        }
    }

    /// Brings to rest what these do; `led`: the next frame since nobody leads. Answers those that were to be applied: what a safe
    /// configuration held still before stopping began is not moved any more.
    pub(super) fn bring_to_rest(&mut self, ids: &[ConfigId], led: FrameId, down: &mut TakenDown) -> Vec<ConfigId> {
        let free: Vec<ConfigId> = ids.iter().copied().filter(|id| !self.is_held(Some(*id))).collect();
        for together in rounds(&free) {
            self.apply_together(&together, Some(led), down);
        }
        free
    }

    /// Applies these as far as they go, side by side. `led`: they bring it to rest, and what of that fails is tried again, as often as
    /// something is removed again.
    fn apply_together(&mut self, ids: &[ConfigId], led: Option<FrameId>, down: &mut TakenDown) {
        let mut all: Vec<Applied> = ids.iter().filter_map(|id| self.to_apply(*id, led.is_some())).collect();
        for _ in 0..limits::FORCE_ROUNDS {
            let begun: Vec<Option<(u64, usize)>> = all.iter_mut().map(|one| self.begin_applying(one, led)).collect();
            for (one, (number, steps)) in all.iter_mut().zip(begun).filter_map(|(one, begun)| Some((one, begun?))) {
                let done = self.complete(number).machine;
                self.note_applied(one, &done, steps);
            }
        }
        for one in all {
            if !one.whole || !one.troubles.is_empty() || !one.left_out.is_empty() {
                down.partly.push(one.id);
            }
            down.troubles.extend(one.left_out.into_iter().chain(one.troubles));
        }
    }

    fn to_apply(&self, id: ConfigId, rests: bool) -> Option<Applied> {
        let configuration = self.given.configurations.get(&id)?;
        let request = Request::new(RequestId(0), Ask::Apply(id), Requester::Operator);
        let at = self.given.clock.now();
        let BestEffort { planned, troubles: left_out, .. } =
            effort(&self.world.system, &self.world.stack, configuration, &request, at, &self.given.context);
        // What brings it to rest may take the time that it gives itself.
        let until = at + self.patience([id]);
        let troubles = Vec::new();
        Some(Applied { id, rests, planned: Some(planned), until, whole: false, left_out, troubles })
    }

    /// The number of the transaction that applies what is still to be applied, and how many steps it has. None: there is nothing to be
    /// done, or it would move where a safe configuration keeps everything still. It may move all the same where somebody has asked for
    /// force, and none has come since nobody leads.
    fn begin_applying(&mut self, one: &mut Applied, led: Option<FrameId>) -> Option<(u64, usize)> {
        let planned = one.planned.take()?;
        // Whoever has written it: what it moves counts, which may be of a subsystem.
        let keeper = |component: ComponentName| led.and_then(|led| self.stands_still(component, led));
        let moving = planned.steps.iter().filter(|planned| planned.moves).find_map(|planned| {
            let keeper = touch::components(&planned.step).iter().find_map(|component| keeper(*component));
            keeper.map(|safe| (planned.step.clone(), safe))
        });
        if let Some((step, safe)) = moving {
            one.troubles = vec![Reason::Moves(step, Some(safe))];
            return None;
        }
        let steps = planned.steps.len();
        let machine = Transaction::new(planned, self.effort([one.id]));
        let number = self.number();
        let serves = if one.rests { SmallVec::from_iter([RequestId(0)]) } else { SmallVec::new() };
        let running = Running::new(number, machine, Purpose::Own, serves, self.world.stack.next());
        self.running.push(Running { enters_quarantine: !one.rests, ..running });
        Some((number, steps))
    }

    /// The safe configuration that keeps a component still also from what is forced: one that was in force before stopping began, or has
    /// come since nobody leads; each, where nobody has asked for force.
    fn stands_still(&self, component: ComponentName, led: FrameId) -> Option<ConfigId> {
        let asked = self.is_hurried();
        let mut safe = self.world.stack.frames().iter().filter(|frame| frame.safe);
        let keeper = safe.find(|frame| {
            let keeps = !asked || !self.came_since(frame) || frame.id >= led;
            keeps && is_in_system(frame.configuration, component)
        });
        keeper.map(|frame| frame.configuration)
    }

    /// What has come of it, and what of that is tried again.
    fn note_applied(&self, one: &mut Applied, done: &Transaction, steps: usize) {
        // A call that was given up half way counts as done, and has brought nothing to rest.
        let interrupted = done.interrupted();
        one.whole = interrupted.is_none() && done.done_so_far().count() == steps;
        one.troubles = done.failures();
        one.troubles.extend(interrupted);
        // Not what nobody knows of: it may be moving.
        let failed: Vec<PlannedStep> = done.failed_steps().cloned().collect();
        if one.rests && !failed.is_empty() && self.given.clock.now() < one.until {
            one.planned = Some(own_plan(one_by_one(failed), &self.world.system));
        }
    }
}

/// What is applied side by side, one after the other: of the deployment's own file each by itself, then of each subsystem the first, of
/// each the second, and so on.
fn rounds(ids: &[ConfigId]) -> Vec<Vec<ConfigId>> {
    let (own, inside): (Vec<ConfigId>, Vec<ConfigId>) = ids.iter().partition(|id| id.prefix().is_empty());
    let mut all: Vec<Vec<ConfigId>> = own.into_iter().map(|id| vec![id]).collect();
    let first = all.len();
    for (at, id) in inside.iter().enumerate() {
        let before = inside[..at].iter().filter(|other| other.prefix() == id.prefix()).count();
        if all.len() <= first + before {
            all.push(Vec::new());
        }
        all[first + before].push(*id);
    }
    all
}

/// Steps one after the other.
fn one_by_one(mut steps: Vec<PlannedStep>) -> Vec<PlannedStep> {
    for (id, step) in (0u32..).zip(&mut steps) {
        (step.id, step.wave, step.after) = (id, 0, id.checked_sub(1).into_iter().collect());
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subsystems_are_brought_to_rest_side_by_side_and_behind_their_parent() {
        let ids =
            |text: &str| -> Vec<ConfigId> { text.split_whitespace().map(|id| ConfigId::new(id).unwrap()).collect() };
        let all = rounds(&ids("away left/hold left/park right/hold right/park left/in/fold off"));
        assert_eq!(
            all,
            [ids("away"), ids("off"), ids("left/hold right/hold left/in/fold"), ids("left/park right/park")]
        );
        assert!(rounds(&[]).is_empty());
    }
}
