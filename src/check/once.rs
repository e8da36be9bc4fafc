//! What states of the product are made of, kept once: of a hundred thousand states most have lists that others have as
//! well, come to on other ways.

use super::seldom::{Interrupted, Seldom, SharedSeldom, Unconfirmed};
use super::shared_list::SharedList;
use super::state::ProductState;
use crate::model::{ComponentName, ConfigId, Verdict};
use crate::stack::{Batch, Request};
use crate::statechart::EventId;
use rustc_hash::FxHashSet;
use std::hash::Hash;

/// All that was met of each kind.
#[derive(Default)]
pub(super) struct Once {
    seldoms: FxHashSet<SharedSeldom>,
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
        list(&mut self.inboxes, &mut state.inbox);
        list(&mut self.stands, &mut state.stands);
        if state.seldom.is_nothing() {
            return;
        }
        if let Some(known) = self.seldoms.get(&state.seldom) {
            state.seldom = known.clone();
            return;
        }
        state.change(|seldom| self.share_lists(seldom));
        self.seldoms.insert(state.seldom.clone());
    }

    fn share_lists(&mut self, seldom: &mut Seldom) {
        list(&mut self.interrupted, &mut seldom.interrupted);
        for own in [&mut seldom.joined, &mut seldom.placed] {
            list(&mut self.numbers, own);
        }
        list(&mut self.requests, &mut seldom.safe);
        for own in [&mut seldom.due, &mut seldom.telling] {
            list(&mut self.answers, own);
        }
        list(&mut self.unconfirmed, &mut seldom.unconfirmed);
        for own in [&mut seldom.lost, &mut seldom.over, &mut seldom.confirmed] {
            list(&mut self.configurations, own);
        }
        list(&mut self.batches, &mut seldom.in_transit);
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
