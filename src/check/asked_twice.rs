//! What was asked for twice, and whose undo took the newest of it: what is in the way then is not seen where the undo is asked for, for it is
//! asked for there.

use super::explore::Graph;
use super::trace::{Happened, TraceStep};
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

/// Whether what is in force of a configuration at the end of a way was there, or asked for, when it was undone last.
fn was_undone(id: ConfigId, way: &[TraceStep]) -> bool {
    let (ok, undone) = (Verdict::Ok.event(Ask::Apply(id)), Verdict::Undone.event(Ask::UndoOf(id)));
    let (mut since, mut comes) = (false, false);
    for step in way {
        // An event may have had it asked for anew; else what is told behind the undo was asked for before it.
        comes &= !matches!(step.what, Happened::Event { .. });
        for told in step.answers() {
            if told == undone.as_str() {
                (since, comes) = (true, true);
            } else if told == ok.as_str() {
                since &= comes;
            }
        }
    }
    since
}
