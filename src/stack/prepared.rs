//! Frames of prepared switches: pushed and popped without an allocation, from frames that were popped before.

use super::{Frame, FrameId, Inverse, Requester, Scope, Stack};
use crate::plan::prepare::Switch;
use crate::time::Time;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Popped frames of switches kept for the next time.
pub(super) const SPARES: usize = 64;

impl Stack {
    /// Whether a switch can be pushed as it is: no frame of its group must be replaced, and none be squashed for it.
    /// Otherwise its configuration is pushed by an ordinary transaction.
    pub fn takes(&self, switch: &Switch) -> bool {
        let group = switch.group();
        self.frames.len() < self.bound
            && (group.is_none()
                || self.frames.iter().all(|f| f.group != group && f.parts.iter().all(|p| p.group != group)))
    }

    /// Pushes the frame of a switch whose acts are done. [`Stack::takes`] was asked before.
    pub fn push_switch(&mut self, switch: &Switch, requester: Requester, at: Time, scope: Option<Scope>) -> FrameId {
        let id = FrameId(self.next);
        self.next += 1;
        let fits = |f: &Arc<Frame>| f.configuration == switch.configuration() && f.acts == switch.acts();
        let spare = self.spares.iter().position(fits).map(|i| self.spares.swap_remove(i));
        let frame = match spare
            .and_then(|mut frame| refreshed(&mut frame, switch, id, requester, at, scope).then_some(frame))
        {
            Some(frame) => frame,
            None => Arc::new(Frame { id, ..switch_frame(switch, requester, at, scope) }),
        };
        self.frames.push(frame);
        id
    }

    /// Whether the top is a frame of that switch, so that [`Switch::ready_undo`] can be asked.
    pub fn top_of(&self, switch: &Switch) -> Option<&Frame> {
        self.frames.last().map(|f| &**f).filter(|f| f.configuration == switch.configuration() && !f.acts.is_empty())
    }

    /// Pops the top, a frame of a switch whose undo is done, and keeps it for the next push.
    pub fn pop_switch(&mut self) {
        if let Some(frame) = self.frames.pop()
            && self.spares.len() < SPARES
        {
            self.spares.push(frame);
        }
    }
}

/// The frame of a switch whose acts are planned, without a number.
pub fn switch_frame(switch: &Switch, requester: Requester, at: Time, scope: Option<Scope>) -> Frame {
    let steps = switch.steps(switch.acts());
    let saved = switch.saved(&steps);
    Frame {
        id: FrameId(u64::MAX),
        configuration: switch.configuration(),
        group: switch.group(),
        requester,
        at,
        inverse: Inverse::Steps(steps),
        footprint: switch.footprint(),
        saved,
        floor: None,
        parts: BTreeSet::new(),
        acts: switch.acts().to_vec(),
        scope,
        partial: false,
        safe: false,
    }
}

fn refreshed(
    frame: &mut Arc<Frame>,
    switch: &Switch,
    id: FrameId,
    requester: Requester,
    at: Time,
    scope: Option<Scope>,
) -> bool {
    let Some(frame) = Arc::get_mut(frame) else { return false };
    let Inverse::Steps(steps) = &mut frame.inverse else { return false };
    frame.id = id;
    frame.requester = requester;
    frame.at = at;
    frame.scope = scope;
    switch.refresh(steps, &mut frame.saved);
    true
}
