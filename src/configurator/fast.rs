//! Prepared switches: the way of a request that plans nothing and allocates nothing (semantics: *Requests*).
//!
//! What was planned for a fixed configuration is kept, with its steps prepared on the platform as well. A lone request for
//! it while all is as when it was planned, or for its undo while its frame is the top, goes this way: step by step, through
//! the same gate as ever. Anything else is planned.

use super::engine::Engine;
use super::progress::{Progress, StepEnd, StepName};
use super::request::Request;
use super::running::{Purpose, Running};
use super::switches::Fast;
use super::teardown::own_plan;
use crate::limits;
use crate::model::{Ask, Cause, Outcome, Step};
use crate::stack::{Batch, Group, HandOver, Planned, ResolvedStep, Stillness, Switch, Why, World, may_apply};
use crate::time::Time;
use crate::transaction::Transaction;
use smallvec::SmallVec;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

impl Engine {
    /// Keeps what was planned for a fixed configuration.
    pub(super) fn prepare(&mut self, planned: &Planned) {
        let configuration = planned.parts.first().and_then(|part| self.given.configurations.get(&part.pushes?));
        let Some(configuration) = configuration else { return };
        let kept = self.switches.entry(configuration.id).or_default();
        // It was planned for another reason (a batch, the bound of the stack).
        if !kept.iter().any(|fast| fast.switch.fits(&self.world.system, false))
            && let Some(switch) = Switch::new(&self.world.system, configuration, planned)
            && let Some(platform) = self.given.platform.prepare(&switch.universe())
        {
            if kept.len() >= limits::PREPARED {
                kept.remove(0);
            }
            kept.push(Fast { switch, platform });
        }
    }

    /// Whether nothing waits and nothing is under way.
    pub(super) fn is_idle(&self) -> bool {
        self.running.is_empty() && self.desk.is_empty() && self.suspects.is_empty()
    }

    /// A request comes while the configurator is idle: with a prepared switch it begins and ends at once, and needs no place
    /// on the desk.
    pub(super) fn comes_alone(&mut self, request: Request) {
        let next = self.inbox.try_recv();
        let plain = request.why == Why::Asked && next.is_err();
        if plain && self.handle_fast(None, request) != Fared::Not {
            return;
        }
        self.arrive(Batch::one(request));
        if let Ok(mail) = next {
            self.take_in(mail);
        }
        self.glance();
    }

    /// Carries out a request by a prepared switch: one that has begun, `number` being its batch on the desk, or one that comes
    /// alone.
    pub(super) fn handle_fast(&mut self, number: Option<u32>, request: Request) -> Fared {
        if self.switches.is_empty()
            || !self.world.broken.is_empty()
            || !self.world.quarantined.is_empty()
            || request.still != Stillness::No
            || self.world.stack.safe().next().is_some()
        {
            return Fared::Not;
        }
        let (id, undoing) = match request.ask {
            Ask::Apply(id) => (id, false),
            Ask::UndoOf(id) => (id, true),
            _ => return Fared::Not,
        };
        let allowed = self.given.configurations.get(&id).is_some_and(|c| may_apply(&request, c, &self.given.operator));
        let known = number.and(self.current.last());
        let begun = known.map_or_else(|| self.given.clock.now(), |(_, begun)| *begun);
        let World { system, stack, .. } = &self.world;
        let own = || {
            let top = stack.top();
            top.is_some_and(|top| {
                (request.force || top.requester == request.requester)
                    && (request.scope.is_none() || request.scope == top.scope)
            })
        };
        let fits = |Fast { switch, .. }: &mut Fast| match undoing {
            true => stack.is_top(switch) && own() && switch.fits(system, true),
            false => {
                allowed
                    && stack.takes(switch, request.requester)
                    && switch.ready(system, request.requester, begun, request.scope)
            }
        };
        let Some(kept) = self.switches.get_mut(&id) else { return Fared::Not };
        let Some(place) = kept.iter_mut().position(fits) else { return Fared::Not };
        let mut fast = kept.remove(place);
        if number.is_none() {
            self.owe_since(request, begun);
        }
        let (mut at, mut sent) = (begun, 0);
        let went = catch_unwind(AssertUnwindSafe(|| self.switch_over(&mut fast, request, undoing, &mut at, &mut sent)));
        if !matches!(went, Ok(Ok(()))) {
            // Who listens has panicked, or the model: what was done is not lost with that.
            let (outcome, payload) = match went {
                Ok(ended) => (ended.err(), None),
                Err(payload) => (None, Some(payload)),
            };
            let outcome = outcome.unwrap_or_else(|| Outcome::Unknown(Cause::Lost("a panic".to_owned())));
            let number = number.or_else(|| self.takes_place(request));
            self.go_on_from(number.expect("the desk is empty"), &fast.switch, request, undoing, (sent, outcome));
            self.switches.entry(id).or_default().push(fast);
            if let Some(payload) = payload {
                resume_unwind(payload);
            }
            return Fared::GoesOn;
        }
        if undoing {
            self.world.stack.pop_switch();
            self.forget_confirmations();
        } else {
            let frame = self.world.stack.push_switch(&mut fast.switch);
            self.await_confirmation(request, frame);
            self.applied(id, None);
        }
        if self.watches_any()
            && let Some(conditions) = &self.given.conditions
        {
            conditions.nudge();
        }
        self.switches.entry(id).or_default().push(fast);
        if let Some(number) = number {
            self.desk.over(number);
        }
        self.answer(request, request.ask.done(), None);
        Fared::Done
    }

    /// A request that came alone is under way on the empty desk.
    fn takes_place(&mut self, request: Request) -> Option<u32> {
        let _ = self.desk.arrive(Batch::one(request), |_| false, &self.given.claims);
        self.begin_next()
    }

    /// Carries out the steps, from `at` on, which becomes the time of the last look at the clock: a look costs as much as a
    /// step, so only those that may take time are measured. `sent` becomes how many were done; the error is what came of the
    /// next.
    fn switch_over(
        &mut self,
        fast: &mut Fast,
        request: Request,
        undoing: bool,
        at: &mut Time,
        sent: &mut u32,
    ) -> Result<(), Outcome> {
        let deadline = *at + self.given.limits.step_timeout;
        while let Some(ResolvedStep { step, place, index, value }) = fast.switch.step(*sent as usize, undoing) {
            let name = StepName::of(step);
            self.given.tells(|| Progress::Started(name));
            // What is written was planned for this very component; only what an undo writes is not known to be allowed.
            let known = !undoing || matches!(step, Step::State { .. });
            let allowed = known && place.allows(step, &self.world.system);
            let found = if allowed { Vec::new() } else { place.precondition(step, &self.world.system) };
            let outcome = match found.first() {
                Some(violation) => Outcome::NotDone(Cause::Refused(violation.to_string())),
                None => {
                    // After a panic in the middle nobody knows, as after any answer that did not come.
                    let call = AssertUnwindSafe(|| fast.platform.execute(index, value, *at, deadline));
                    catch_unwind(call).unwrap_or_else(|_| Outcome::Unknown(Cause::Lost("a panic".to_owned())))
                }
            };
            // Who stops may have to wait, for its update to end.
            let took = fast.platform.waited().then(|| {
                let begun = std::mem::replace(at, self.given.clock.now());
                at.since(begun)
            });
            if let Some(progress) = &self.given.progress {
                let end = StepEnd::from(&outcome);
                progress(&Progress::Ended { request: request.id, step: name, end, took, undoing });
            }
            if !matches!(outcome, Outcome::Done(_)) {
                return Err(outcome);
            }
            place.effect(step, &mut self.world.system);
            *sent += 1;
        }
        self.changed();
        Ok(())
    }

    /// What goes wrong in the middle of a switch is taken over by an ordinary transaction.
    fn go_on_from(&mut self, number: u32, switch: &Switch, request: Request, undoing: bool, ended: (u32, Outcome)) {
        let (sent, outcome) = ended;
        let mut planned = own_plan(switch.list(undoing), &self.world.system);
        let part = &mut planned.parts[0];
        part.frame = Some(switch.frame().clone());
        if undoing {
            part.edits.pops = vec![(switch.frame().id, HandOver::default())];
        } else {
            part.edits.push = part.frame.clone();
            part.pushes = Some(switch.frame().configuration);
            let configuration = self.given.configurations.get(&switch.frame().configuration);
            part.on_failure = configuration.map(|c| c.on_failure).unwrap_or_default();
        }
        let spec = self.spec(&planned, false);
        let mut machine = Transaction::new(planned, spec);
        machine.resume(sent, outcome, &mut self.world.system);
        let visit = (undoing && request.lets_go_of(switch.frame())).then_some(switch.frame().id);
        let places = SmallVec::from_iter([0]);
        let group = Group { takes: 1, places, visits: SmallVec::from_iter([visit]), ..Group::default() };
        let purpose = Purpose::Requests(number, group);
        let running =
            Running::new(self.number(), machine, purpose, SmallVec::from_iter([request.id]), self.world.stack.next());
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
