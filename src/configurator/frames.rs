//! What the configurator asks of the stack.

use super::control::FrameView;
use super::engine::Engine;
use super::request::Reason;
use crate::model::{Ask, ConfigId, Finding, Step, codes};
use crate::plan::PlannedStep;
use crate::stack::{self, FrameId, Requester, Transaction};

/// A request as the stack understands it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Op {
    /// Push a configuration, asked for by so and so; whether by a state that is active.
    Push(ConfigId, Requester, bool),
    /// Pop this frame.
    Pop(FrameId),
    /// Pop the newest.
    Top,
    /// Pop until so many are left.
    To(usize),
}

impl Op {
    pub fn is_push(self) -> bool {
        matches!(self, Self::Push(..))
    }
}

/// Steps, and the stack as it will be when they are done.
pub(super) struct Planned(Transaction);

impl Planned {
    pub fn steps(&self) -> &[PlannedStep] {
        &self.0.steps
    }
}

impl Engine {
    /// What `ops` mean as one transaction, or which of them is refused and why.
    pub(super) fn plan_ops(&mut self, ops: &[Op]) -> Result<Planned, (usize, Reason)> {
        let at = self.clock.now();
        let configurations = self.configurations.clone();
        let mut requests: smallvec::SmallVec<[stack::Request<'_>; 4]> = smallvec::SmallVec::new();
        for (i, op) in ops.iter().enumerate() {
            requests.push(match *op {
                Op::Push(id, requester, active) => {
                    let configuration = configurations.get(&id).ok_or((i, Reason::Unknown(id)))?;
                    stack::Request::Push { configuration, requester, at, active }
                }
                Op::Pop(frame) => stack::Request::Undo(frame),
                Op::Top => stack::Request::UndoTop,
                Op::To(frames) => stack::Request::UndoTo(frames),
            });
        }
        let transaction = stack::transaction(&self.system, &self.stack, &requests, &self.context)
            .map_err(|refusal| (refusal.request, Reason::Refused(refusal.findings)))?;
        let hindered = self.hindered(transaction.steps.iter().map(|planned| &planned.step));
        if !hindered.is_empty() {
            return Err((ops.len().saturating_sub(1), Reason::Refused(hindered)));
        }
        Ok(Planned(transaction))
    }

    /// The findings about components in quarantine that `steps` need. A connection can be taken from any component.
    fn hindered<'a>(&self, steps: impl Iterator<Item = &'a Step>) -> Vec<Finding> {
        if self.quarantined.is_empty() {
            return Vec::new();
        }
        let mut needed: Vec<_> = steps
            .flat_map(|step| match step {
                Step::Disconnect { .. } => [None, None],
                Step::Connect { from, to, .. } => [Some(from.component), Some(to.component)],
                other => [Some(other.component()), None],
            })
            .flatten()
            .filter(|component| self.quarantined.contains(component))
            .collect();
        needed.sort_unstable();
        needed.dedup();
        let finding = |component| {
            Finding::error(
                codes::QUARANTINED,
                format!("`{component}` is in quarantine: an earlier call has not returned"),
            )
            .help("wait until the call returns, restart what the component runs on, or leave it out")
        };
        needed.into_iter().map(finding).collect()
    }

    /// The stack takes over what was done.
    pub(super) fn commit(&mut self, planned: Planned) {
        self.stack.commit(planned.0);
        self.forget_confirmations();
        self.changed();
    }

    pub(super) fn forget_confirmations(&mut self) {
        // A frame that is gone needs no confirmation any more.
        let stack = &self.stack;
        self.confirming.retain(|waiting| match waiting.request.ask {
            Ask::Apply(id) => stack.newest_of(id, Some(waiting.request.requester)).is_some(),
            _ => false,
        });
    }

    /// The newest frame of `id` that `by` may undo and that is not among `taken`. None: there is no frame of it.
    pub(super) fn find_frame(&self, id: ConfigId, by: Requester, taken: &[Op]) -> Result<Option<Op>, Reason> {
        let by = if by == Requester::Operator { None } else { Some(by) };
        let found = self.stack.frames().iter().rev().find(|frame| {
            frame.configuration == id
                && !frame.is_squashed()
                && by.is_none_or(|by| frame.requester == by)
                && !taken.contains(&Op::Pop(frame.id))
        });
        match found {
            Some(frame) => Ok(Some(Op::Pop(frame.id))),
            None if self.stack.is_buried(id, by) => Err(Reason::Refused(vec![
                Finding::error(
                    codes::STACK_SQUASHED,
                    format!("`{id}` was committed, or squashed together with others"),
                )
                .help("undo down to the squashed frame; what was committed is not undone any more"),
            ])),
            None => Ok(None),
        }
    }

    /// The frames as they are shown, oldest first.
    pub(super) fn frame_views(&self) -> Vec<FrameView> {
        let view = |frame: &std::sync::Arc<stack::Frame>| FrameView {
            configuration: frame.configuration,
            by: frame.requester,
            at: frame.at,
            floor: frame.floor.is_some(),
            parts: frame.parts.len().max(1),
        };
        self.stack.frames().iter().map(view).collect()
    }
}
