//! What a safe configuration in force keeps: that its (sub)system stands still, and what it has written.

use super::request::{Request, Requester, Stillness, Why};
use super::work::Planned;
use super::{Reason, World};
use crate::model::{Ask, ComponentName};
use crate::plan::undo::absolute;

/// Whether these may not move for a request, since a safe configuration of their (sub)system is in force: only for what a
/// coordinator asks in a later step they may, or for what is forced.
pub fn keeps_still(world: &World, request: &Request, components: impl IntoIterator<Item = ComponentName>) -> bool {
    let foreign = request.requester == Requester::Operator || request.why != Why::Asked;
    let held = || components.into_iter().any(|component| world.stack.keeper_of(component).is_some());
    request.still != Stillness::No || foreign && !request.force && held()
}

/// Why an operator without force may not have this part of a plan: it would write what a safe configuration in force has written and nobody
/// after it, or take its place in their group. What a coordinator asks for in a later step it may, as it may move.
pub(super) fn overwrites_safe(world: &World, request: &Request, planned: &Planned, part: usize) -> Option<Reason> {
    let by_hand = request.requester == Requester::Operator && request.why == Why::Asked && !request.force;
    if !by_hand || !matches!(request.ask, Ask::Apply(_)) || world.stack.safe().next().is_none() {
        return None;
    }
    let of = &planned.parts[part];
    if of.edits.push.as_ref().is_some_and(|frame| frame.safe) {
        return None;
    }
    let popped = planned.popped.iter().filter(|frame| of.edits.pops.iter().any(|(id, _)| *id == frame.id));
    if let Some(frame) = popped.into_iter().find(|frame| frame.safe) {
        return Some(Reason::TakesSafePlace(frame.configuration));
    }
    let steps = planned.steps.iter().enumerate().filter(|(at, _)| planned.part_of(planned.place(*at)) == part);
    steps.map(|(_, planned)| &planned.step).find_map(|step| {
        let slot = absolute(step)?;
        let newest = world.stack.frames().iter().rev().find(|frame| frame.footprint.writes(slot))?;
        newest.safe.then(|| Reason::OverwritesSafe(step.clone(), newest.configuration))
    })
}
