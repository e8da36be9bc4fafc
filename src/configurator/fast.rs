//! Prepared switches: the way of a request that resolves no name and allocates nothing (design §6).
//!
//! A fixed configuration is prepared when it was applied for the first time in the ordinary way, on the platform as well.
//! From then on a lone request for it, or for its undo while its frame is the top, goes this way: the switch looks at
//! every precondition on the live system, and declines when anything is not as it was prepared for.

use super::engine::Engine;
use super::progress::{Progress, StepEnd, StepName};
use super::request::Request;
use super::running::{Purpose, Running};
use super::switches::Fast;
use super::teardown::own_plan;
use crate::model::{Ask, Cause, ConfigId, Outcome};
use crate::plan::prepare::Switch;
use crate::stack::{Edits, Frame, Group};
use crate::time::Time;
use crate::transaction::Transaction;
use smallvec::SmallVec;
use std::panic::{AssertUnwindSafe, catch_unwind};

impl Engine {
    /// Prepares a configuration that has just been applied, if it is a fixed switch.
    pub(super) fn prepare(&mut self, id: ConfigId) {
        if self.switches.contains_key(&id) {
            return;
        }
        let configurations = self.configurations.clone();
        if let Some(configuration) = configurations.get(&id)
            // What it stands for is to be waited for.
            && configuration.holds.is_none()
            && let Some(switch) = Switch::new(&mut self.world.system, configuration)
            && let Some(platform) = self.platform.prepare(switch.universe())
        {
            self.switches.insert(id, Box::new(Fast { switch, platform }));
        }
    }

    /// Carries out a request that has begun by a prepared switch, `number` being its batch on the desk.
    pub(super) fn handle_fast(&mut self, number: u32, request: Request) -> Fared {
        if self.switches.is_empty()
            || !self.world.broken.is_empty()
            || !self.world.quarantined.is_empty()
            || request.still
            || self.world.stack.safe().next().is_some()
        {
            return Fared::Not;
        }
        let (id, undoing) = match request.ask {
            Ask::Apply(id) => (id, false),
            Ask::UndoOf(id) => (id, true),
            _ => return Fared::Not,
        };
        let Some(mut fast) = self.switches.remove(&id) else { return Fared::Not };
        let ready = if undoing {
            let own = |top: &&Frame| {
                (request.force || top.requester == request.requester)
                    && (request.scope.is_none() || request.scope == top.scope)
            };
            match self.world.stack.top_of(&fast.switch).filter(own) {
                Some(top) => fast.switch.ready_undo(&self.world.system, &top.acts, &top.saved),
                None => {
                    self.switches.insert(id, fast);
                    return Fared::Not;
                }
            }
        } else if self.world.stack.takes(&fast.switch) {
            fast.switch.ready(&self.world.system)
        } else {
            self.switches.insert(id, fast);
            return Fared::Not;
        };
        if !ready {
            // It was prepared for another system: let go, and prepared anew when it has been applied.
            return Fared::Not;
        }
        let mut at = self.current.last().map_or_else(|| self.clock.now(), |(_, begun)| *begun);
        if let Err((sent, outcome)) = self.switch_over(&mut fast, request, undoing, &mut at) {
            self.go_on_from(number, &fast.switch, request, undoing, (sent, outcome));
            self.switches.insert(id, fast);
            return Fared::GoesOn;
        }
        if undoing {
            self.world.stack.pop_switch();
            self.forget_confirmations();
        } else {
            let frame = self.world.stack.push_switch(&fast.switch, request.requester, at, request.scope);
            self.await_confirmation(request, frame);
            self.applied(id, None);
        }
        if self.watches_any()
            && let Some(conditions) = &self.conditions
        {
            conditions.nudge();
        }
        self.switches.insert(id, fast);
        self.desk.over(number);
        self.answer(request, request.ask.done(), None);
        Fared::Done
    }

    /// Carries out the acts that are ready, from `at` on, which becomes the time of the last look at the clock: a look costs
    /// as much as an act, so only those that may take time are measured. The error is the number of the step that was not
    /// done, and what came of it.
    fn switch_over(
        &mut self,
        fast: &mut Fast,
        request: Request,
        undoing: bool,
        at: &mut Time,
    ) -> Result<(), (u32, Outcome)> {
        let deadline = *at + self.limits.step_timeout;
        let mut sent = 0u32;
        for nth in 0..fast.switch.acts().len() {
            let act = fast.switch.acts()[nth];
            if let Some((index, value)) = fast.switch.sends(act) {
                let step = StepName::of(&fast.switch.universe()[index]);
                if let Some(progress) = &self.progress {
                    progress(&Progress::Started(step));
                }
                // After a panic in the middle nobody knows, as after any answer that did not come.
                let call = AssertUnwindSafe(|| fast.platform.execute(index, value, *at, deadline));
                let outcome =
                    catch_unwind(call).unwrap_or_else(|_| Outcome::Unknown(Cause::Lost("a panic".to_owned())));
                // Who stops may have to wait, for its update to end.
                let took = fast.platform.waited().then(|| {
                    let begun = std::mem::replace(at, self.clock.now());
                    at.since(begun)
                });
                if let Some(progress) = &self.progress {
                    let end = StepEnd::from(&outcome);
                    progress(&Progress::Ended { request: request.id, step, end, took, undoing });
                }
                if !matches!(outcome, Outcome::Done(_)) {
                    return Err((sent, outcome));
                }
                sent += 1;
            }
            fast.switch.done(act, &mut self.world.system);
        }
        self.changed();
        Ok(())
    }

    /// What goes wrong in the middle of a switch is taken over by an ordinary transaction.
    fn go_on_from(&mut self, number: u32, switch: &Switch, request: Request, undoing: bool, ended: (u32, Outcome)) {
        let (sent, outcome) = ended;
        let mut steps = switch.steps(switch.acts());
        for step in &mut steps {
            // Their order is that of the acts; the stages of an undo run the other way.
            step.wave = 0;
            step.after = step.id.checked_sub(1).into_iter().collect();
        }
        let (edits, frame) = if undoing {
            let top = self.world.stack.top().cloned();
            let pops = top.iter().map(|top| (top.id, crate::stack::HandOver::default())).collect();
            (Edits { pops, ..Edits::default() }, top)
        } else {
            let frame = crate::stack::switch_frame(switch, request.requester, self.clock.now(), request.scope);
            let frame = Some(std::sync::Arc::new(frame));
            (Edits { push: frame.clone(), ..Edits::default() }, frame)
        };
        let mut planned = own_plan(steps, &self.world.system);
        planned.parts[0].edits = edits;
        planned.parts[0].frame = frame;
        if !undoing {
            planned.parts[0].pushes = Some(switch.configuration());
            let on_failure = self.configurations.get(&switch.configuration()).map(|c| c.on_failure);
            planned.parts[0].on_failure = on_failure.unwrap_or_default();
        }
        let spec = self.spec(&planned, false);
        let mut machine = Transaction::new(planned, spec);
        machine.resume(sent, outcome, &mut self.world.system);
        let group = Group { takes: 1, places: SmallVec::from_iter([0]), ..Group::default() };
        let purpose = Purpose::Requests(number, group);
        let running = Running::new(self.number(), machine, purpose, SmallVec::from_iter([request.id]));
        self.running.push(running);
    }
}

/// How a request fared that might go by a prepared switch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fared {
    /// It goes the ordinary way.
    Not,
    /// It is over and answered.
    Done,
    /// Something went wrong in the middle; a transaction goes on.
    GoesOn,
}
