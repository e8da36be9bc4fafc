//! Following anew with more of what makes many times as many states, where it was little. Where that turns out to be too much, or it has to
//! end, what is known is what was followed to its end before.

use super::behind::Behind;
use super::bound::Bound;
use super::explore::{Graph, Reached};
use super::product::Product;
use crate::limits;

/// What may be followed, or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum More {
    /// One batch of a coordinator more that waits: often there never are more at once.
    Waiting,
    /// Whether the event that ends the deployment has come.
    Stopping,
    /// That a coordinator begins again while others are led down.
    Anew,
    /// What an operator's safe configuration leads to.
    ByHand,
    /// All batches of a coordinator behind an undo that failed, and races. Comes last: it adds the most, and tells the least.
    Behind,
}

/// What has been tried.
pub(super) struct Deeper {
    /// What is tried now, and what was reached to its end without it; none: nothing was yet.
    trying: Option<(More, Option<Reached>)>,
    too_much: Vec<More>,
}

impl Deeper {
    /// Begins with little behind undos that fail, unless there is nothing else to be looked at.
    pub fn new(product: &mut Product<'_>) -> Self {
        let is_alone = product.minds_stopping && !product.waits_for_others();
        product.behind = if is_alone { Behind::AsItFits } else { Behind::Little };
        Self { trying: is_alone.then_some((More::Behind, None)), too_much: Vec::new() }
    }

    /// Where what was tried was not followed to its end: goes back to what was reached without it. False: it is to be followed anew without it.
    pub fn goes_back(&mut self, graph: &mut Graph<'_, '_>) -> bool {
        let Some((more, without)) = self.trying.take().filter(|_| graph.is_cut_off()) else { return true };
        let Some(without) = without else {
            let lean = |behind: Behind| graph.before_undo.is_some_and(|before| behind.is_lean(before));
            // As much is followed without, or it has to end.
            if !graph.is_used_up() || lean(graph.product.behind) || !lean(Behind::Little) {
                return true;
            }
            graph.product.follow_more(more, false);
            self.too_much.push(more);
            return false;
        };
        graph.product.follow_more(more, false);
        graph.reached = without;
        self.too_much.push(more);
        true
    }

    /// Whether all there is behind an undo that failed was more than is looked at.
    pub fn was_too_much_behind(&self) -> bool {
        self.too_much.contains(&More::Behind)
    }

    /// Whether it is to be followed anew with something more; else this is what is known of it.
    pub fn goes_on(&mut self, graph: &mut Graph<'_, '_>) -> bool {
        if graph.is_cut_off() {
            return false;
        }
        let product = &*graph.product;
        let was_left_out = |bound| graph.bounds.contains_key(&bound);
        let few = |bound| graph.edges.len() <= bound;
        let waiting = few(limits::CHECK_EASY) && product.most_waiting < limits::CHECK_WAITING_MOST;
        let stopping = few(limits::CHECK_STOPPING);
        let more = [
            (More::Waiting, waiting && was_left_out(Bound::Waiting)),
            (More::Stopping, stopping && !product.minds_stopping),
            (More::Anew, stopping && product.waits_for_others()),
            (More::ByHand, few(limits::CHECK_BY_HAND) && was_left_out(Bound::ByHand)),
            (More::Behind, was_left_out(Bound::Lean)),
        ]
        .into_iter()
        .find_map(|(more, wanted)| (wanted && !self.too_much.contains(&more)).then_some(more));
        let Some(more) = more else { return false };
        graph.product.follow_more(more, true);
        self.trying = Some((more, Some(std::mem::take(&mut graph.reached))));
        true
    }
}

impl Product<'_> {
    /// From now on more of it is followed, or as much as before.
    pub fn follow_more(&mut self, more: More, is_more: bool) {
        match more {
            More::Behind => self.behind = if is_more { Behind::All } else { Behind::Little },
            More::Waiting if is_more => self.most_waiting += 1,
            More::Waiting => self.most_waiting -= 1,
            More::Stopping => self.minds_stopping = is_more,
            More::Anew => self.begins_anew = is_more,
            More::ByHand => self.follows_by_hand = is_more,
        }
    }
}
