//! The third stage of stopping: by force, to nothing (semantics: *Stopping*).

use super::control::{QueuedCommand, TakenDown};
use super::engine::{Engine, Force};
use super::request::Reason;
use super::running::{Purpose, Running};
use crate::limits;
use crate::model::{ConfigId, RequestId, Step};
use crate::plan::PlannedStep;
use crate::stack::{Broken, FrameId, Part, Planned, Residual, Why};
use crate::system::{self, System};
use crate::time::Time;
use crate::transaction::{Input, Limit, Spec, Transaction};
use smallvec::SmallVec;
use std::sync::Arc;

impl Engine {
    pub(super) fn queued(&mut self, command: QueuedCommand) {
        self.doing = Some(command.clone());
        match command {
            QueuedCommand::Drift { reply } => {
                let drift = self.drift();
                let _ = reply.try_send(drift);
            }
            QueuedCommand::Recover { direction, reply } => {
                let outcome = self.recover(direction);
                // Who waits for the answer may look then.
                self.tell_broken();
                let _ = reply.try_send(outcome);
            }
            QueuedCommand::TakeBack { deadline, reply } => {
                let down = self.take_all_back(deadline);
                let _ = reply.try_send(down);
            }
            QueuedCommand::Force { deadline, reply } => {
                let down = self.force(deadline);
                let _ = reply.try_send(down);
            }
            QueuedCommand::DiscardStack => {
                self.world.stack.discard();
                self.is_accepted();
                self.confirmations.clear();
                self.changed();
            }
            QueuedCommand::Stop => self.stopping = true,
        }
        self.doing = None;
    }

    /// Everything that still waits is answered.
    pub(super) fn bid_farewell(&mut self) {
        self.glance();
        self.break_current(&Reason::Ended);
        let safe = std::mem::take(&mut self.safety.waiting);
        let waiting = self.desk.cancel_waiting(|_| true);
        for request in safe.into_iter().chain(waiting).filter(|request| request.why == Why::Asked) {
            let now = self.given.clock.now();
            self.tell_answer(request, request.ask.failed(), Some(Arc::new(Reason::Ended)), now);
        }
    }

    /// The third stage: no claim, residual or quarantine is in its way.
    fn force(&mut self, deadline: Time) -> TakenDown {
        let mut down = TakenDown::default();
        self.taking_down = true;
        // What was to give way to this does so now.
        self.hurried = true;
        self.glance();
        self.confirmations.clear();
        self.forget_standings();
        // Not after what is out has come in: now.
        self.break_off();
        // What is safe and was asked for before is no emergency meanwhile.
        self.after_safe();
        let (led, since) = (self.nobody_leads(), self.world.stack.next());
        let Force { safe, rest } = self.given.force.clone();
        self.make_all_safe(&safe, &mut down);
        down.rest = self.bring_to_rest(&rest, led, &mut down);
        down.safe = safe;
        self.end_running();
        self.refuse_waiting();
        // An emergency meanwhile: nothing is taken away from under what it holds, before somebody asks once more.
        if self.became_safe(since) {
            self.see_left(&mut down);
            down.still = true;
            down.in_time = self.given.clock.now() <= deadline;
            self.taking_down = false;
            self.changed();
            return down;
        }
        // Whatever time that took: to remove it is what force is for.
        let deadline = deadline.max(self.given.clock.now() + self.given.limits.step_timeout);
        self.remove_all(&mut down, deadline);
        self.world.stack.discard();
        self.is_accepted();
        self.world.broken.clear();
        if !down.is_clean() {
            let expected = System::new(self.world.system.catalogue().clone());
            let cause = down.troubles.first().cloned().unwrap_or(Reason::TakenDown);
            let residual = Residual {
                difference: system::diff(&expected, &self.world.system),
                quarantined: self.world.quarantined.clone(),
                observed: down.observed,
                ..Residual::of(cause)
            };
            let components = down.left.components.keys().copied().chain(down.quarantined.iter().copied()).collect();
            let broken = Broken::of_nobody(Arc::new(residual), components, crate::model::Snapshot::default());
            self.world.breaks(Broken { mendable: true, ..broken });
        }
        down.in_time = self.given.clock.now() <= deadline;
        self.taking_down = false;
        self.changed();
        down
    }

    /// What is under way is broken off: calls that are out are told so.
    pub(super) fn break_off(&mut self) {
        for at in 0..self.running.len() {
            if !self.running[at].is_safe() && !self.running[at].over {
                self.running[at].machine.on(Input::TakenDown, &mut self.world.system);
                self.advance(at);
            }
        }
    }

    /// Requests of batches under way that have not begun are answered.
    pub(super) fn refuse_rest(&mut self) {
        let begun: Vec<u32> = self
            .running
            .iter()
            .filter_map(|running| match &running.purpose {
                Purpose::Requests(number, _) => Some(*number),
                _ => None,
            })
            .collect();
        let left: Vec<_> =
            self.desk.under_way().iter().filter(|active| !begun.contains(&active.number)).cloned().collect();
        for active in left {
            for request in active.batch.requests {
                let gone = self.desk.answered(active.number, 0, Some(request.ask.failed()));
                match request.why {
                    Why::Asked => self.answer(request, request.ask.failed(), Some(Reason::TakenDown)),
                    _ => self.forget(request),
                }
                self.answer_undos(gone, None);
            }
        }
    }

    /// Whether a safe configuration has come since this frame would have been the next.
    fn became_safe(&self, since: FrameId) -> bool {
        self.world.stack.frames().iter().any(|frame| frame.safe && frame.id >= since)
    }

    /// Carries something of one's own out, while everything else goes on.
    pub(super) fn carry_out(&mut self, machine: Transaction) -> Transaction {
        self.carry_out_for(RequestId(0), machine)
    }

    /// The same, with the steps told among those of a request.
    pub(super) fn carry_out_for(&mut self, request: RequestId, machine: Transaction) -> Transaction {
        let number = self.number();
        self.running.push(Running::new(
            number,
            machine,
            Purpose::Own,
            SmallVec::from_iter([request]),
            self.world.stack.next(),
        ));
        self.complete(number).machine
    }

    /// A best effort for these configurations.
    pub(super) fn effort(&self, of: impl IntoIterator<Item = ConfigId>) -> Spec {
        let limits = SmallVec::from_iter([Limit::patient(self.patience(of))]);
        Spec { limits, best_effort: true, asked_back: true }
    }

    /// Removes what is there by the difference to nothing, again where something is left: a step that failed once need not
    /// fail twice.
    fn remove_all(&mut self, down: &mut TakenDown, deadline: Time) {
        let before = down.troubles.len();
        for _ in 0..limits::FORCE_ROUNDS {
            down.troubles.truncate(before);
            self.remove(down, deadline);
            let hung = &down.quarantined;
            if down.observed && down.left.components.keys().all(|component| hung.contains(component)) {
                return;
            }
        }
    }

    fn remove(&mut self, down: &mut TakenDown, deadline: Time) {
        if let Some(seen) = self.look()
            && let Err(unknown) = self.adopt(&seen)
        {
            down.troubles.push(Reason::UnknownType(unknown));
        }
        self.note_quarantine();
        let nothing = System::new(self.world.system.catalogue().clone());
        let quarantined = self.world.quarantined.clone();
        let steps = system::diff(&self.world.system, &nothing);
        let work = taking_apart(
            steps
                .into_iter()
                .filter(|step| matches!(step, Step::Disconnect { .. }) || !quarantined.contains(&step.component())),
        );
        let mut spec = self.effort([]);
        spec.limits[0].until = deadline;
        let machine = Transaction::new(own_plan(work, &self.world.system), spec);
        let done = self.carry_out(machine);
        down.forced.extend(done.done_so_far().map(|(planned, _)| planned.step.clone()));
        down.troubles.extend(done.failures());
        self.see_left(down);
        down.quarantined.clone_from(&self.world.quarantined);
    }
}

/// Steps of the configurator's own as a plan of one part.
pub(super) fn own_plan(steps: Vec<PlannedStep>, system: &System) -> Planned {
    let part = Part {
        range: 0..steps.len() as u32,
        edits: crate::stack::Edits::default(),
        pushes: None,
        holds: false,
        on_failure: crate::model::OnFailure::Unset,
        frame: None,
        along: Vec::new(),
    };
    Planned {
        steps: Arc::new(steps),
        of: Vec::new(),
        whole: Vec::new(),
        parts: vec![part],
        revision: system.revision(),
        warnings: Vec::new(),
        popped: Vec::new(),
        kept: rustc_hash::FxHashSet::default(),
    }
}

/// The steps to nothing in an order that leaves room: run states one after the other (producers before consumers), then
/// all disconnections side by side, then all destructions.
fn taking_apart(steps: impl Iterator<Item = Step>) -> Vec<PlannedStep> {
    let planned = |(id, step): (u32, Step)| {
        let (wave, after) = match step {
            Step::State { .. } => (0, id.checked_sub(1).into_iter().collect()),
            Step::Destroy { .. } => (2, SmallVec::new()),
            _ => (1, SmallVec::new()),
        };
        PlannedStep::bare(step, id, wave, after)
    };
    (0u32..).zip(steps).map(planned).collect()
}
