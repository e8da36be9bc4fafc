//! Taking everything down, comparing with the platform, and recovering.

use super::control::{Command, Drift, Recovery, TakenDown};
use super::engine::{Broken, Engine};
use super::exec::Run;
use super::frames::Op;
use super::progress::Progress;
use super::request::{Reason, Residual};
use super::transaction::{Ended, Interruption, Left};
use super::work::{Item, item};
use crate::model::{Ask, RunState, Step, Verdict};
use crate::stack::Stack;
use crate::system::{self, System, View as _};
use crate::time::Time;
use smallvec::SmallVec;
use std::sync::Arc;

impl Engine {
    pub(super) fn command(&mut self, command: Command) {
        match command {
            Command::View { system, reply } => {
                let _ = reply.try_send(self.view(system));
            }
            Command::Drift { reply } => {
                let drift = self.drift();
                let _ = reply.try_send(drift);
            }
            Command::Recover { direction, reply } => {
                let outcome = self.recover(direction);
                let _ = reply.try_send(outcome);
            }
            Command::TakeDown { forced, deadline, reply } => {
                let down = self.take_down(forced, deadline);
                let _ = reply.try_send(down);
            }
            Command::DiscardStack => {
                self.stack = Stack::new(self.limits.stack);
                self.confirming.clear();
                self.changed();
            }
            Command::Stop => self.stopping = true,
        }
    }

    fn drift(&mut self) -> Drift {
        let mut between = Interruption::closed();
        let Some(seen) = self.look(&mut between) else { return Drift::default() };
        let Ok(actual) = System::from_snapshot(&seen, self.system.catalogue().clone()) else { return Drift::default() };
        let wanted = self.broken.as_ref().map_or(&self.system, |broken| &broken.expected);
        let mut faulted: Vec<_> = actual
            .graph()
            .node_weights()
            .filter(|node| {
                node.state == RunState::Faulted
                    && wanted.component(node.name).is_none_or(|wanted| wanted.state != RunState::Faulted)
            })
            .map(|node| node.name)
            .collect();
        faulted.sort_unstable();
        Drift { steps: system::diff(wanted, &actual), faulted, observed: true }
    }

    /// Recovers a broken system.
    fn recover(&mut self, direction: Recovery) -> Result<(), Arc<Residual>> {
        let Some(broken) = self.broken.take() else { return Ok(()) };
        match direction {
            Recovery::Back => self.recover_back(broken),
            Recovery::Accept => {
                let mut between = Interruption::closed();
                match self.look(&mut between) {
                    Some(seen) if self.adopt(&seen).is_ok() => {
                        self.stack = Stack::new(self.limits.stack);
                        self.confirming.clear();
                        self.changed();
                        if let Some(progress) = &self.progress {
                            progress(&Progress::Recovered);
                        }
                        Ok(())
                    }
                    _ => {
                        let residual = broken.residual.clone();
                        self.broken = Some(broken);
                        Err(residual)
                    }
                }
            }
        }
    }

    /// Goes back to the system as it should be. What is unsettled or irreversible has then been accepted.
    pub(super) fn recover_back(&mut self, broken: Broken) -> Result<(), Arc<Residual>> {
        let mut between = Interruption::default();
        let before = self.look(&mut between);
        let mut observed = before.is_some_and(|seen| self.adopt(&seen).is_ok());
        if observed {
            self.repair(&broken.expected, &mut between);
            observed = self.look(&mut between).is_some_and(|seen| self.adopt(&seen).is_ok());
        }
        if observed && system::diff::reached(&self.system, &broken.expected) {
            self.changed();
            if let Some(progress) = &self.progress {
                progress(&Progress::Recovered);
            }
            return Ok(());
        }
        let left = Left::of(broken.residual.cause.clone());
        let residual = Arc::new(self.residual(left, &broken.expected, observed));
        self.broken = Some(Broken { residual: residual.clone(), ..broken });
        self.changed();
        Err(residual)
    }

    /// A component came back from a call that had never returned: what could not be undone because of it may be now.
    pub(super) fn mend(&mut self) {
        self.note_quarantine();
        if self.broken.as_ref().is_some_and(|broken| broken.mendable) {
            let broken = self.broken.take().expect("it is broken");
            let _ = self.recover_back(broken);
        }
    }

    fn take_down(&mut self, forced: bool, deadline: Time) -> TakenDown {
        let mut down = TakenDown::default();
        self.refuse_waiting();
        self.confirming.clear();
        if forced {
            let (safe, troubles) = match self.forced_safe.take() {
                Some(done) => done,
                None => self.apply_all_safe(),
            };
            down.safe = safe;
            down.troubles = troubles;
        } else if self.broken.is_none() {
            self.pop_all(&mut down, deadline);
        }
        self.remove_all(&mut down, deadline);
        self.stack = Stack::new(self.limits.stack);
        self.broken = None;
        if !down.is_clean() {
            let expected = System::new(self.system.catalogue().clone());
            let cause = down.troubles.first().cloned().unwrap_or(Reason::TakenDown);
            let residual = Arc::new(self.residual(Left::of(cause), &expected, down.observed));
            self.broken = Some(Broken { residual, expected, culprit: None, mendable: true });
        }
        down.in_time = self.clock.now() <= deadline;
        self.changed();
        down
    }

    /// Everything that still waits is answered: nothing of it will be done.
    fn refuse_waiting(&mut self) {
        while let Some(batch) = self.queue.pop_front() {
            for request in batch.requests {
                self.begin(request);
                let verdict = match request.ask {
                    Ask::Apply(_) | Ask::Commit { .. } => Verdict::Failed,
                    Ask::UndoOf(_) | Ask::Undo | Ask::UndoTo(_) => Verdict::UndoFailed,
                };
                self.answer(request, verdict, Some(Reason::TakenDown));
            }
        }
    }

    /// Removes what is there by the difference to nothing.
    fn remove_all(&mut self, down: &mut TakenDown, deadline: Time) {
        let mut between = Interruption::closed();
        if let Some(seen) = self.look(&mut between)
            && let Err(unknown) = self.adopt(&seen)
        {
            down.troubles.push(Reason::Panic(unknown.to_string()));
        }
        self.note_quarantine();
        let nothing = System::new(self.system.catalogue().clone());
        let steps = system::diff(&self.system, &nothing);
        let work =
            taking_apart(steps.into_iter().filter(|step| {
                matches!(step, Step::Disconnect { .. }) || !self.quarantined.contains(&step.component())
            }));
        self.patience = self.limits.step_timeout;
        let mut run = Run::new(&work, true, false, deadline);
        self.carry_out(&work, &mut run);
        self.collect(&work, &mut run);
        down.forced = run.done.iter().map(|i| work[*i as usize].step.clone()).collect();
        down.troubles.extend(run.failures.into_iter().map(|(_, reason)| reason));
        match self.look(&mut between) {
            Some(seen) => {
                down.observed = true;
                let _ = self.adopt(&seen);
                down.left = seen;
            }
            None => down.left = self.system.snapshot(),
        }
        self.note_quarantine();
        down.quarantined.clone_from(&self.quarantined);
    }

    /// Pops frame after frame, newest first, as long as that goes.
    fn pop_all(&mut self, down: &mut TakenDown, deadline: Time) {
        let spec = self.spec([Op::Top]);
        while !self.stack.is_empty() && self.clock.now() < deadline {
            let Some(configuration) = self.stack.top().map(|frame| frame.configuration) else { return };
            match self.plan_ops(&[Op::Top]) {
                Ok(planned) => match self.transact(planned.steps(), spec) {
                    Ended::Applied => {
                        self.commit(planned);
                        down.popped.push(configuration);
                    }
                    Ended::Undone(reason) => return down.troubles.push(reason),
                    Ended::Broken(residual) => return down.troubles.push(Reason::Broken(residual)),
                },
                Err((_, reason)) => return down.troubles.push(reason),
            }
        }
    }
}

/// The steps to nothing in an order that leaves room: run states one after the other (producers before consumers), then
/// all disconnections side by side, then all destructions.
fn taking_apart(steps: impl Iterator<Item = Step>) -> Vec<Item> {
    let mut work: Vec<Item> = Vec::new();
    for (id, step) in (0u32..).zip(steps) {
        let (wave, after) = match step {
            Step::State { .. } => (0, id.checked_sub(1).into_iter().collect()),
            Step::Destroy { .. } => (2, SmallVec::new()),
            _ => (1, SmallVec::new()),
        };
        work.push(item(step, id, wave, after));
    }
    work
}
