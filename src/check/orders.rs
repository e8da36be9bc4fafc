//! Whether it matters for a way up or down in which order answers come and coordinators hear what they tell each other.
//!
//! A way is driven in one order, answers before what lies in inboxes. Where another one comes to rest elsewhere, that way is not
//! sure; and what does not arrive on it may in another order.

use super::product::Product;
use super::state::{Failed, Move, Next, ProductState};
use super::tried::{Goal, Tried};
use crate::limits;
use crate::statechart::NodeId;
use rustc_hash::FxHashSet;
use smallvec::SmallVec;

impl Product<'_> {
    /// Whether a way comes to rest elsewhere, too, where what happens by itself does in another order; also where there are too
    /// many orders to look at.
    pub(super) fn comes_elsewhere(&mut self, moves: &[Next]) -> bool {
        let begins = |next: &&Next| !self.happens(next) || !self.answered_after(next).is_empty();
        let begun: Vec<ProductState> = moves.iter().filter(begins).map(|next| next.state.clone()).collect();
        begun.into_iter().any(|state| self.rests(state).is_none_or(|rests| rests.len() > 1))
    }

    /// Whether a move happens by itself.
    fn happens(&self, next: &Next) -> bool {
        matches!(next.by, Move::Answer | Move::Taken(..))
    }

    /// What happens by itself at once, in whatever order, where nothing fails.
    fn at_once(&mut self, state: &ProductState) -> Vec<Next> {
        let mut all = self.goes_on(state).all;
        all.retain(|next| next.failed == Failed::Nothing && self.answered_after(next).is_empty());
        all
    }

    /// Where the coordinators may be when nothing happens by itself any more; none: there is too much to look at.
    fn rests(&mut self, from: ProductState) -> Option<FxHashSet<SmallVec<[NodeId; 2]>>> {
        let (mut rests, mut known, mut open) = (FxHashSet::default(), FxHashSet::default(), vec![from]);
        while let Some(state) = open.pop() {
            if known.len() > limits::CHECK_DRIVEN || state.waiting() > limits::CHECK_PILED {
                return None;
            }
            if !known.insert(state.clone()) {
                continue;
            }
            let nexts = self.at_once(&state);
            if nexts.is_empty() {
                rests.insert(state.leaves.iter().copied().collect());
            }
            open.extend(nexts.into_iter().map(|next| next.state));
        }
        Some(rests)
    }

    /// Whether in some order all come to the goal.
    pub(super) fn arrives_in_some_order(&mut self, from: &ProductState, tried: &Tried, goal: Goal) -> bool {
        let (mut known, mut open) = (FxHashSet::default(), vec![(from.clone(), true)]);
        while let Some((state, first)) = open.pop() {
            if known.len() > limits::CHECK_DRIVEN {
                return false;
            }
            if !first && state.is_at_rest() && self.all_in(&state, goal) {
                return true;
            }
            if !known.insert((state.clone(), first)) || state.waiting() > limits::CHECK_PILED {
                continue;
            }
            let mut nexts = if first { Vec::new() } else { self.goes_on(&state).all };
            nexts.retain(|next| next.failed == Failed::Nothing);
            if first || nexts.is_empty() {
                nexts.extend(self.outside_moves(&state, tried, first));
            }
            let comes = |next: &Next| tried.fails(self, std::slice::from_ref(next)).is_none();
            open.extend(nexts.into_iter().filter(comes).map(|next| (next.state, false)));
        }
        false
    }
}
