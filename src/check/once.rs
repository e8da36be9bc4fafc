//! What states of the product are made of, kept once: of a hundred thousand states most have lists that others have as
//! well, come to on other ways.

use super::shared_list::SharedList;
use super::state::{Interrupted, ProductState, Unconfirmed};
use crate::model::{ComponentName, ConfigId, Verdict};
use crate::stack::{Batch, Request};
use crate::statechart::EventId;
use rustc_hash::FxHashSet;
use std::hash::Hash;

/// All that was met of each kind.
#[derive(Default)]
pub(super) struct Once {
    interrupted: FxHashSet<SharedList<Interrupted>>,
    numbers: FxHashSet<SharedList<u32>>,
    requests: FxHashSet<SharedList<Request>>,
    answers: FxHashSet<SharedList<(Request, Verdict)>>,
    inboxes: FxHashSet<SharedList<(u8, EventId)>>,
    unconfirmed: FxHashSet<SharedList<Unconfirmed>>,
    configurations: FxHashSet<SharedList<ConfigId>>,
    stands: FxHashSet<SharedList<(ConfigId, ComponentName)>>,
    batches: FxHashSet<SharedList<Batch>>,
}

impl Once {
    /// The state, made of what is kept already where it has the same.
    pub fn share(&mut self, state: &mut ProductState) {
        list(&mut self.interrupted, &mut state.interrupted);
        for own in [&mut state.joined, &mut state.placed] {
            list(&mut self.numbers, own);
        }
        list(&mut self.requests, &mut state.safe);
        for own in [&mut state.due, &mut state.telling] {
            list(&mut self.answers, own);
        }
        list(&mut self.inboxes, &mut state.inbox);
        list(&mut self.unconfirmed, &mut state.unconfirmed);
        for own in [&mut state.lost, &mut state.over] {
            list(&mut self.configurations, own);
        }
        list(&mut self.stands, &mut state.stands);
        list(&mut self.batches, &mut state.in_transit);
    }
}

fn list<T: Eq + Hash>(kept: &mut FxHashSet<SharedList<T>>, own: &mut SharedList<T>) {
    if own.is_empty() {
        return;
    }
    match kept.get(own) {
        Some(known) => *own = known.clone(),
        None => _ = kept.insert(own.clone()),
    }
}
