//! Prepared switches: the way of a request that resolves no name and allocates nothing (design §6).
//!
//! A fixed configuration is prepared when it was applied for the first time in the ordinary way, on the platform as well.
//! From then on a lone request for it, or for its undo while its frame is the top, goes this way: the switch looks at
//! every precondition on the live system, and declines when anything is not as it was prepared for.

use super::engine::Engine;
use super::exec::Run;
use super::frames::Op;
use super::progress::{Progress, StepEnd, StepName};
use super::request::{Reason, Request};
use super::requests::Part;
use super::transaction::Ended;
use crate::model::{Ask, ConfigId, Verdict};
use crate::plan::prepare::Switch;
use crate::platform::{Cause, Outcome, Prepared};
use crate::stack::Requester;
use crate::time::Time;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A switch, prepared on both sides.
pub(super) struct Fast {
    switch: Switch,
    platform: Box<dyn Prepared>,
}

impl Engine {
    /// Prepares a configuration that has just been applied, if it is a fixed switch.
    pub(super) fn prepare(&mut self, id: ConfigId) {
        if self.switches.contains_key(&id) {
            return;
        }
        let configurations = self.configurations.clone();
        if let Some(configuration) = configurations.get(&id)
            && let Some(switch) = Switch::new(&mut self.system, configuration)
            && let Some(platform) = self.platform.prepare(switch.universe())
        {
            self.switches.insert(id, Box::new(Fast { switch, platform }));
        }
    }

    /// Carries out a request that has begun by a prepared switch. False: it goes the ordinary way.
    pub(super) fn handle_fast(&mut self, request: Request) -> bool {
        if self.switches.is_empty() || self.broken.is_some() || !self.quarantined.is_empty() {
            return false;
        }
        let (id, undoing) = match request.ask {
            Ask::Apply(id) => (id, false),
            Ask::UndoOf(id) => (id, true),
            _ => return false,
        };
        let Some(mut fast) = self.switches.remove(&id) else { return false };
        let ready = if undoing {
            match self.stack.top_of(&fast.switch) {
                Some(top) if request.requester == Requester::Operator || top.requester == request.requester => {
                    fast.switch.ready_undo(&self.system, &top.acts, &top.saved)
                }
                _ => {
                    self.switches.insert(id, fast);
                    return false;
                }
            }
        } else if self.stack.takes(&fast.switch) {
            fast.switch.ready(&self.system)
        } else {
            self.switches.insert(id, fast);
            return false;
        };
        if !ready {
            // It was prepared for another system: let go, and prepared anew when it has been applied.
            return false;
        }
        let op = Op::Push(id, request.requester, request.scoped);
        let mut at = self.current.last().map_or_else(|| self.clock.now(), |(_, begun)| *begun);
        match self.switch_over(&mut fast, op, undoing, &mut at) {
            Ended::Applied => {
                if undoing {
                    self.stack.pop_switch();
                    self.forget_confirmations();
                } else {
                    self.stack.push_switch(&fast.switch, request.requester, at, request.scoped);
                }
                self.switches.insert(id, fast);
                if undoing {
                    self.answer(request, Verdict::Undone, None);
                } else {
                    self.applied(Part { request, op });
                }
            }
            Ended::Undone(reason) => {
                let verdict = if undoing { Verdict::UndoFailed } else { Verdict::Failed };
                self.answer(request, verdict, Some(reason));
            }
            Ended::Broken(residual) => {
                if !undoing {
                    self.blame(&Part { request, op });
                }
                let verdict = if undoing { Verdict::UndoBroken } else { Verdict::Broken };
                self.answer(request, verdict, Some(Reason::Broken(residual)));
            }
        }
        true
    }

    /// Carries out the acts that are ready, from `at` on, which becomes the time of the last look at the clock: a look costs
    /// as much as an act, so only those that may take time are measured. What goes wrong is taken over by an ordinary
    /// transaction in the middle.
    fn switch_over(&mut self, fast: &mut Fast, op: Op, undoing: bool, at: &mut Time) -> Ended {
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
                self.tell(step, StepEnd::from(&outcome), took, undoing);
                if !matches!(outcome, Outcome::Done(_)) {
                    let steps = fast.switch.steps(fast.switch.acts());
                    let spec = self.spec([op]);
                    let mut run = Run::new(&steps, false, true, Time::NEVER);
                    for done in 0..sent {
                        run.over[done as usize] = true;
                        run.done.push(done);
                    }
                    self.conclude(&steps, sent, outcome, &mut run);
                    return self.transact_from(&steps, run, spec);
                }
                sent += 1;
            }
            fast.switch.done(act, &mut self.system);
        }
        self.changed();
        Ended::Applied
    }
}
