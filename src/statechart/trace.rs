//! What a model's own `dbg` printer is told while a machine steps (`docs/rfsm.md` §8): rFSM's tags, in its order.
//!
//! The engine only says what happens; the words are the hook's. A hook that does not want it ([`Hook::traces`]) costs
//! nothing.

use super::EdgeId;
use super::chart::{Chart, EventId, NONE, NodeId};
use super::hook::Hook;
use super::machine::Machine;

/// One thing that happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trace<'a> {
    /// There are events, and a transition is looked for (`TRANSITION`).
    Searching,
    /// No transition is enabled (`TRANSITION`).
    NotFound,
    /// The transitions of an active state are looked at (`CHECKING`).
    Checking(NodeId),
    /// The path that will be taken, segment by segment (`EXEC_PATH`).
    Path(&'a [EdgeId]),
    /// The exits of a segment begin (`TRANS_EXIT`).
    Leaving(EdgeId),
    /// A state was left; its exit has run (`STATE_EXIT`).
    Left(NodeId),
    /// The effect of a segment comes next, if it has one (`EFFECT`).
    Effect(EdgeId),
    /// The entries of a segment begin (`TRANS_ENTER`).
    Entering(EdgeId),
    /// A state was entered; its entry has run (`STATE_ENTER`).
    Entered(NodeId),
    /// A time event is due (`TIMEEVENT`); that it is raised is told next.
    Due(EventId),
    /// The engine itself raised an event: a completion, or a time event (`RAISED`).
    Raised(EventId),
}

impl Machine {
    #[inline]
    pub(super) fn trace(&mut self, chart: &Chart, what: Trace<'_>, hook: &mut impl Hook) {
        if hook.traces() {
            hook.trace(what, &mut self.view(chart));
        }
    }

    /// The path that begins with `way`.
    #[inline]
    pub(super) fn trace_path(&mut self, chart: &Chart, mut way: u32, hook: &mut impl Hook) {
        if hook.traces() {
            let mut path = Vec::new();
            while way != NONE {
                let taken = self.search.ways[way as usize];
                path.push(EdgeId(taken.edge));
                way = taken.then;
            }
            hook.trace(Trace::Path(&path), &mut self.view(chart));
        }
    }
}
