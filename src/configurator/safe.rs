//! Safe configurations: applied at once and best effort, whatever is under way and also when the system is broken.
//!
//! The picture of what *should* be gets a safe configuration planned on it as if nothing else had happened: so the
//! interrupted work can be taken back around it, and the frame it leaves on the stack undoes to where the stack was.

use super::control::Command;
use super::engine::{Broken, Engine};
use super::exec::Run;
use super::frames::Op;
use super::request::{Reason, Request, Residual};
use super::touched::Touched;
use super::transaction::{Interruption, Left};
use super::work::Item;
use crate::model::{Ask, Change, ConfigId, Configuration, StateList, Target, Verdict};
use crate::plan;
use crate::system::{System, step};
use crate::time::Time;
use std::sync::Arc;
use std::time::Duration;

/// What came of a best effort.
#[derive(Default)]
pub(super) struct Effort {
    /// What could not be done.
    pub troubles: Vec<Reason>,
    /// Steps of which nobody knows.
    pub unsettled: Vec<crate::model::Step>,
}

impl Effort {
    fn is_whole(&self) -> bool {
        self.troubles.is_empty() && self.unsettled.is_empty()
    }
}

impl Engine {
    /// A safe request while nothing else is under way.
    pub(super) fn handle_safe(&mut self, request: Request) {
        let Ask::Apply(id) = request.ask else { return };
        let planned = if self.broken.is_none() {
            self.plan_ops(&[Op::Push(id, request.requester, request.scoped)]).ok()
        } else {
            None
        };
        let effort = match planned {
            Some(planned) => {
                let effort = self.do_what_goes(planned.steps(), &mut Interruption::default());
                if !effort.is_whole() {
                    // The frame holds all of it, so all of it is what should be.
                    let mut expected = self.system.clone();
                    for item in planned.steps() {
                        let _ = step::apply(&item.step, &mut expected);
                    }
                    self.break_safe(&effort, expected);
                }
                self.commit(planned);
                effort
            }
            None => {
                let mut between = Interruption::default();
                let effort = self.apply_safe(id, &mut between);
                match self.broken.take() {
                    Some(mut broken) => {
                        self.fold_in(&mut broken.expected, id, request, &mut between.touched);
                        // What should be has changed; what remains is told anew.
                        let left = Left::of(broken.residual.cause.clone());
                        let residual = Arc::new(self.residual(left, &broken.expected, broken.residual.observed));
                        self.broken = Some(Broken { residual, mendable: false, ..broken });
                        self.changed();
                    }
                    None => self.break_safe(&effort, self.system.clone()),
                }
                effort
            }
        };
        self.answer_safe(request, effort);
    }

    fn break_safe(&mut self, effort: &Effort, expected: System) {
        let left = Left { unsettled: effort.unsettled.clone(), ..Left::of(first(effort)) };
        let residual = Arc::new(self.residual(left, &expected, false));
        self.broken = Some(Broken { residual, expected, culprit: None, mendable: true });
        self.changed();
    }

    fn answer_safe(&mut self, request: Request, effort: Effort) {
        if effort.is_whole() {
            return self.answer(request, Verdict::Ok, None);
        }
        let residual = match &self.broken {
            Some(broken) => broken.residual.clone(),
            None => Arc::new(Residual {
                cause: first(&effort),
                difference: Vec::new(),
                unsettled: effort.unsettled,
                irreversible: Vec::new(),
                faulted: Vec::new(),
                quarantined: self.quarantined.clone(),
                observed: false,
            }),
        };
        self.answer(request, Verdict::Broken, Some(Reason::Broken(residual)));
    }

    /// Serves what waits urgently, in the middle of something.
    pub(super) fn serve_urgent(&mut self, between: &mut Interruption) {
        self.glance();
        if self.commands.iter().any(Command::is_urgent) {
            between.by.get_or_insert(Reason::TakenDown);
            if !std::mem::replace(&mut between.teardown, true)
                && self.commands.iter().any(|command| matches!(command, Command::TakeDown { forced: true, .. }))
            {
                // Not after what is out has come in: now.
                self.forced_safe = Some(self.apply_all_safe());
            }
            return;
        }
        let mut served = false;
        while let Some(request) = self.next_safe() {
            let Ask::Apply(id) = request.ask else { continue };
            served = true;
            self.begin(request);
            let effort = self.apply_safe(id, between);
            between.by.get_or_insert(Reason::Interrupted(id));
            between.safe.push((id, request));
            self.answer_safe(request, effort);
        }
        if !served && self.urgent() {
            // It was announced and is on its way.
            self.pump(self.clock.now() + Duration::from_millis(1));
        }
    }

    /// Applies every safe configuration, in the order of their names; what they could not do.
    pub(super) fn apply_all_safe(&mut self) -> (Vec<ConfigId>, Vec<Reason>) {
        let mut safe: Vec<ConfigId> = self.configurations.values().filter(|c| c.safe).map(|c| c.id).collect();
        safe.sort_unstable();
        let mut troubles = Vec::new();
        for id in &safe {
            troubles.extend(self.apply_safe(*id, &mut Interruption::default()).troubles);
        }
        (safe, troubles)
    }

    /// Applies a safe configuration on the live system as far as it goes.
    pub(super) fn apply_safe(&mut self, id: ConfigId, between: &mut Interruption) -> Effort {
        let configurations = self.configurations.clone();
        let Some(configuration) = configurations.get(&id) else { return Effort::default() };
        for entry in configuration.pre.iter().chain(configuration.post.iter()) {
            if let Target::Component(component) = entry.target {
                between.touched.add_state(component);
            }
        }
        match plan::plan(&self.system, configuration, &self.context) {
            Ok(plan) => self.do_what_goes(&plan.steps, between),
            Err(_) => {
                let mut whole = Effort::default();
                for piece in pieces(configuration) {
                    match plan::plan(&self.system, &piece, &self.context) {
                        Ok(plan) => {
                            let effort = self.do_what_goes(&plan.steps, between);
                            whole.troubles.extend(effort.troubles);
                            whole.unsettled.extend(effort.unsettled);
                        }
                        Err(refusal) => whole.troubles.push(Reason::Refused(refusal.findings)),
                    }
                }
                whole
            }
        }
    }

    fn do_what_goes(&mut self, work: &[Item], between: &mut Interruption) -> Effort {
        let patience = std::mem::replace(&mut self.patience, self.limits.step_timeout);
        let mut run = Run::new(work, true, false, Time::NEVER);
        run.safe = true;
        self.carry_out(work, &mut run);
        self.collect(work, &mut run);
        self.patience = patience;
        for item in work {
            between.touched.add(&item.step);
        }
        let undo = run.done.iter().rev().flat_map(|i| work[*i as usize].undo.steps().iter().cloned());
        between.undo.splice(0..0, undo);
        Effort {
            troubles: run.failures.into_iter().map(|(_, reason)| reason).collect(),
            unsettled: run.unsettled.iter().map(|i| work[*i as usize].step.clone()).collect(),
        }
    }

    /// Plans a safe configuration that was applied on the picture of what should be, and pushes its frame.
    /// What it does there is touched: the rollback of what it interrupted must not even pass through the opposite.
    pub(super) fn fold_in(&mut self, expected: &mut System, id: ConfigId, request: Request, touched: &mut Touched) {
        std::mem::swap(&mut self.system, expected);
        match self.plan_ops(&[Op::Push(id, request.requester, request.scoped)]) {
            Ok(planned) => {
                for item in planned.steps() {
                    touched.add(&item.step);
                    let _ = step::apply(&item.step, &mut self.system);
                }
                self.commit(planned);
            }
            Err(_) => {
                let configurations = self.configurations.clone();
                for piece in configurations.get(&id).map(pieces).unwrap_or_default() {
                    if let Ok(plan) = plan::plan(&self.system, &piece, &self.context) {
                        for item in &plan.steps {
                            touched.add(&item.step);
                            let _ = step::apply(&item.step, &mut self.system);
                        }
                    }
                }
            }
        }
        std::mem::swap(&mut self.system, expected);
    }
}

fn first(effort: &Effort) -> Reason {
    effort.troubles.first().cloned().unwrap_or_else(|| match effort.unsettled.first() {
        Some(step) => Reason::Step { step: step.clone(), cause: crate::platform::Cause::Timeout },
        None => Reason::TakenDown,
    })
}

/// A configuration in parts that can each be refused by itself: entries of the lists and changes, in their order.
fn pieces(whole: &Configuration) -> Vec<Configuration> {
    let empty = || Configuration::new(whole.id);
    let one = |entry| StateList::of([entry]).expect("one `_default` at most");
    let pre = whole.pre.iter().map(|entry| Configuration { pre: one(entry), ..empty() });
    let changes =
        whole.changes.iter().map(|change: &Change| Configuration { changes: vec![change.clone()], ..empty() });
    let post = whole.post.iter().map(|entry| Configuration { post: one(entry), ..empty() });
    pre.chain(changes).chain(post).collect()
}
