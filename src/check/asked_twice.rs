//! What was asked for twice, and whose undo took the newest of it: what is in the way then is not seen where the undo is asked for, for it is
//! asked for there.

use super::explore::Graph;
use super::trace::TraceStep;
use crate::model::{Ask, ConfigId, Finding, Verdict};
use crate::stack::Request;

impl Graph<'_, '_> {
    /// The finding of a refusal, with what is in the way where that was undone on this way, and one of it is in force all the same.
    pub(super) fn with_what_was_asked_twice(
        &self,
        finding: Finding,
        at: u32,
        request: &Request,
        way: &[TraceStep],
    ) -> Finding {
        let Ask::UndoOf(below) = request.ask else { return finding };
        let world = self.product.worlds.get(self.states[at as usize].world);
        let Some(id) = world.and_then(|world| world.own_in_the_way(below, request.requester)) else { return finding };
        if !was_undone(id, way) {
            return finding;
        }
        let undo = Ask::UndoOf(id);
        let message = format!(
            "{}; `{undo}` was answered before: `{id}` was asked for more than once, and that took back the newest",
            finding.message
        );
        let help = format!(
            "let each be undone before `{id}` is asked for again: write `exit: {undo}` in the state that asks for it, or make `{id}` the \
             `config` of that state"
        );
        Finding { message, ..finding }.help(help)
    }
}

/// Whether the last that was told of a configuration on a way is that it was undone.
fn was_undone(id: ConfigId, way: &[TraceStep]) -> bool {
    let last = |ask: Ask, verdict: Verdict| {
        let event = verdict.event(ask);
        let told = way.iter().flat_map(TraceStep::answers).enumerate();
        told.filter(|(_, told)| *told == event.as_str()).map(|(at, _)| at).last()
    };
    let applied = last(Ask::Apply(id), Verdict::Ok);
    applied.is_some() && last(Ask::UndoOf(id), Verdict::Undone) > applied
}
