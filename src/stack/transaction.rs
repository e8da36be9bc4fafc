//! Requests become one transaction: every step decided, and the stack as it will be.

use super::share::{self, HandOver};
use super::squash;
use super::{Frame, FrameId, Inverse, Requester, Stack, net};
use crate::model::{Configuration, Finding, Findings, MemberRef, Tunable, codes};
use crate::plan::undo::{Item, Script, undo};
use crate::plan::{Context, Plan, PlannedStep, Refusal, StepId, plan_on};
use crate::system::{Overlay, System, View, Violation};
use crate::time::Time;
use smallvec::SmallVec;
use std::sync::Arc;

/// One request to the stack.
#[derive(Debug, Clone, Copy)]
pub enum Request<'a> {
    /// Apply a configuration. Its group's frame, if there is one, is popped in the same transaction.
    Push {
        /// The configuration.
        configuration: &'a Configuration,
        /// Who asks.
        requester: Requester,
        /// When.
        at: Time,
        /// Whether it belongs to a state of the coordinator that is being entered (its frame is never squashed until
        /// [`Stack::set_active`] says otherwise).
        active: bool,
    },
    /// Pop this frame, from wherever it lies.
    Undo(FrameId),
    /// Pop the top.
    UndoTop,
    /// Pop until so many frames are left.
    UndoTo(usize),
}

/// Steps, and the stack as it will be when they are done. Commit it with [`Stack::commit`]; dropped, nothing happened.
#[must_use = "a transaction does nothing until its steps are executed and it is committed to the stack"]
#[derive(Debug, Clone)]
pub struct Transaction {
    /// What is done, in an order in which it may happen; `wave` and `after` tell what may happen in parallel.
    pub steps: Vec<PlannedStep>,
    /// The revision of the system it was made from; it is valid for no other.
    pub revision: u64,
    /// Of each plan that is pushed: what is allowed and worth saying.
    pub warnings: Findings,
    /// The frames that will be popped, as they are now.
    pub popped: Vec<Arc<Frame>>,
    /// The numbers of the frames that will be pushed, in the order of the requests.
    pub pushed: Vec<FrameId>,
    pub(super) frames: Vec<Arc<Frame>>,
    pub(super) active: Vec<FrameId>,
    pub(super) next: u64,
    pub(super) version: u64,
}

impl Transaction {
    /// The frames as they will be, oldest first.
    pub fn frames(&self) -> &[Arc<Frame>] {
        &self.frames
    }
}

/// What `requests`, one after the other, mean as one transaction. Where something is undone and something is pushed, the
/// steps are the net of both. All or nothing: if one request is refused, the whole is.
///
/// # Errors
/// [`Refusal`], with the place of the refused request.
pub fn transaction(
    system: &System,
    stack: &Stack,
    requests: &[Request<'_>],
    context: &Context,
) -> Result<Transaction, Refusal> {
    let mut view = Overlay::new(system);
    let mut work = Work {
        script: Script::new(&mut view),
        frames: stack.frames.clone(),
        stack,
        warnings: Vec::new(),
        popped: Vec::new(),
        pushed: Vec::new(),
        active: Vec::new(),
        next: stack.next,
    };
    for (i, request) in requests.iter().enumerate() {
        work.request(request, context).map_err(|refusal| Refusal { request: i, ..refusal })?;
    }
    let Work { script, mut frames, warnings, popped, pushed, active, next, .. } = work;
    let whole = script.finish().map_err(|found| drifted(&found))?;
    let steps = if popped.is_empty() || pushed.is_empty() { whole } else { shorter(system, &view, whole) };
    let kept: Vec<FrameId> = stack.active.iter().chain(&active).copied().collect();
    if !squash::fit(&mut frames, stack.bound, &kept) {
        let message = format!("the stack has {} frames, and none can be squashed", frames.len());
        let finding = Finding::error(codes::STACK_FULL, message)
            .help("undo or commit something, or raise `limits: { stack: … }` in the deployment");
        return Err(Refusal { findings: vec![finding], request: requests.len().saturating_sub(1) });
    }
    Ok(Transaction {
        steps,
        revision: system.revision(),
        warnings,
        popped,
        pushed,
        frames,
        active,
        next,
        version: stack.version,
    })
}

struct Work<'o, 's, 'k> {
    script: Script<'o, 's>,
    frames: Vec<Arc<Frame>>,
    stack: &'k Stack,
    warnings: Findings,
    popped: Vec<Arc<Frame>>,
    pushed: Vec<FrameId>,
    active: Vec<FrameId>,
    next: u64,
}

impl Work<'_, '_, '_> {
    fn request(&mut self, request: &Request<'_>, context: &Context) -> Result<(), Refusal> {
        match request {
            Request::Push { configuration, requester, at, active } => {
                self.push(configuration, *requester, *at, *active, context)
            }
            Request::Undo(id) => match self.frames.iter().position(|f| f.id == *id) {
                Some(at) => self.pop(at),
                None => {
                    let finding = Finding::error(codes::STACK_NO_FRAME, format!("there is no frame {}", id.0));
                    Err(Refusal::one(finding.help("`davit stack` shows the frames")))
                }
            },
            Request::UndoTop => match self.frames.len().checked_sub(1) {
                Some(top) => self.pop(top),
                None => Err(Refusal::one(if self.stack.committed.is_empty() {
                    Finding::error(codes::STACK_EMPTY, "there is nothing to undo")
                } else {
                    Finding::error(codes::STACK_FLOOR, "there is nothing to undo above the committed floor")
                })),
            },
            Request::UndoTo(left) => {
                while self.frames.len() > *left {
                    self.pop(self.frames.len() - 1)?;
                }
                Ok(())
            }
        }
    }

    fn pop(&mut self, at: usize) -> Result<(), Refusal> {
        let hand = share::examine(&self.frames, at).map_err(|finding| Refusal::one(*finding))?;
        let frame = self.frames[at].clone();
        self.take_back(&frame, &hand).map_err(|found| drifted(&found))?;
        share::remove(&mut self.frames, at, hand);
        // A frame that this very transaction pushes and pops leaves no trace.
        if let Some(i) = self.pushed.iter().position(|id| *id == frame.id) {
            self.pushed.remove(i);
        } else {
            self.popped.push(frame);
        }
        Ok(())
    }

    fn take_back(&mut self, frame: &Frame, hand: &HandOver) -> Result<(), Vec<Violation>> {
        let skip = |slot| hand.slots.contains(&slot);
        match &frame.inverse {
            Inverse::Steps(steps) => undo(&mut self.script, steps, &frame.saved, &skip),
            Inverse::List(items) => {
                let wave = self.script.next_wave();
                for item in items {
                    if crate::plan::undo::absolute(&item.step).is_some_and(skip) {
                        continue;
                    }
                    let after: SmallVec<[StepId; 1]> =
                        self.script.steps.last().filter(|s| s.wave == wave).map(|s| s.id).into_iter().collect();
                    self.script.add(item.clone(), wave, &after)?;
                }
                self.script.settle_all()
            }
        }
    }

    fn push(
        &mut self,
        configuration: &Configuration,
        requester: Requester,
        at: Time,
        active: bool,
        context: &Context,
    ) -> Result<(), Refusal> {
        if let Some(group) = configuration.group {
            self.replace(group, configuration, requester)?;
        }
        let plan = plan_on(self.script.view_mut(), configuration, context)?;
        let Plan { configuration, group, steps, footprint, saved, warnings, .. } = plan;
        let floor = crate::plan::irreversible(&steps).map(str::to_owned);
        self.warnings.extend(warnings);
        self.script.append(steps.iter().cloned());
        let id = FrameId(self.next);
        self.next += 1;
        self.pushed.push(id);
        if active {
            self.active.push(id);
        }
        self.frames.push(Arc::new(Frame {
            id,
            configuration,
            group,
            requester,
            at,
            inverse: Inverse::Steps(steps),
            footprint,
            saved,
            floor,
            parts: std::collections::BTreeSet::new(),
            acts: Vec::new(),
        }));
        Ok(())
    }

    /// Pops the group's frame, unless another coordinator asked for it.
    fn replace(
        &mut self,
        group: crate::model::Ident,
        configuration: &Configuration,
        requester: Requester,
    ) -> Result<(), Refusal> {
        let refused = |cause: Findings, old: &str| {
            let message = format!("`{}` would replace `{old}` of the group `{group}`", configuration.id);
            let mut findings = vec![
                Finding::error(codes::STACK_GROUP, message)
                    .at(configuration.origin)
                    .help("undo what stands in the way first; nothing has changed"),
            ];
            findings.extend(cause);
            Refusal { findings, request: 0 }
        };
        if let Some(at) = self.frames.iter().rposition(|f| f.group == Some(group)) {
            let old = self.frames[at].configuration;
            if let Some(cause) = self.frames[at].foreign_to(requester) {
                return Err(refused(vec![cause], old.as_str()));
            }
            return self.pop(at).map_err(|refusal| refused(refusal.findings, old.as_str()));
        }
        let buried = self.frames.iter().flat_map(|f| &f.parts).find(|p| p.group == Some(group));
        if let Some(part) = buried {
            let message = format!("`{}` was squashed together with other frames", part.configuration);
            let cause = Finding::error(codes::STACK_SQUASHED, message).help("undo down to the squashed frame");
            return Err(refused(vec![cause], part.configuration.as_str()));
        }
        Ok(())
    }
}

fn drifted(found: &[Violation]) -> Refusal {
    let findings = found
        .iter()
        .map(|violation| {
            Finding::error(codes::STACK_DRIFTED, format!("the system is not as the frame left it: {violation}"))
                .help("`davit drift` shows the difference")
        })
        .collect();
    Refusal { findings, request: 0 }
}

/// The net of `whole`, when it ends in the same system (`end`) and is shorter; else `whole`.
fn shorter(system: &System, end: &Overlay<'_>, whole: Vec<PlannedStep>) -> Vec<PlannedStep> {
    let bound = |property: MemberRef| {
        // The property of a component that is neither now nor at the end there: taken as bound.
        let node = system.component(property.component).or_else(|| end.component(property.component));
        let declared = node.and_then(|n| n.property(property.member));
        declared.is_none_or(|(_, p)| p.tunable != Tunable::Always)
    };
    let reduced = net::reduce(whole.iter().map(Item::of).collect(), Some(system), &bound);
    if reduced.len() >= whole.len() {
        return whole;
    }
    let mut view = Overlay::new(system);
    let mut script = Script::new(&mut view);
    for item in reduced {
        let after: SmallVec<[StepId; 1]> = script.steps.last().map(|s| s.id).into_iter().collect();
        if script.add(item, 0, &after).is_err() {
            return whole;
        }
    }
    let Ok(steps) = script.finish() else { return whole };
    if view.same(end) { steps } else { whole }
}
