//! Following anew with more of what makes many times as many states, where it was little. Where that turns out to be too much, what is known is
//! what was followed before.

use super::behind::Behind;
use super::bound::Bound;
use super::explore::Graph;
use super::product::Product;
use crate::limits;

/// What may be followed, or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum More {
    /// Behind an undo that failed all batches of a coordinator, and races.
    Behind,
    /// One batch of a coordinator more that waits: often there never are more at once.
    Waiting,
    /// Whether the event that ends the deployment has come.
    Stopping,
    /// That a coordinator begins again while others are led down.
    Anew,
    /// What an operator's safe configuration leads to.
    ByHand,
}

/// What has been tried.
#[derive(Debug)]
pub(super) struct Deeper {
    last: Option<More>,
    too_much: Vec<More>,
}

impl Deeper {
    /// Begins with the first following.
    pub fn new() -> Self {
        Self { last: Some(More::Behind), too_much: Vec::new() }
    }

    /// What was tried last and turned out to be too much, if it was.
    pub fn too_much(&mut self, graph: &Graph<'_, '_>) -> Option<More> {
        let (product, before) = (&*graph.product, graph.before_undo);
        if !graph.is_used_up() || product.effort.halted().is_some() {
            return None;
        }
        let leaner = before.is_some_and(|before| !product.behind.is_lean(before) && Behind::Little.is_lean(before));
        let last = self.last.take().filter(|last| *last != More::Behind || leaner)?;
        self.too_much.push(last);
        Some(last)
    }

    /// With what more it is to be followed anew; none: this is what is known of it.
    pub fn next(&mut self, graph: &Graph<'_, '_>) -> Option<More> {
        let product = &*graph.product;
        if graph.is_used_up() || product.effort.halted().is_some() {
            return None;
        }
        let was_left_out = |bound| graph.bounds.contains_key(&bound);
        let few = |bound| graph.edges.len() <= bound;
        let waiting = few(limits::CHECK_EASY) && product.most_waiting < limits::CHECK_WAITING_MOST;
        let stopping = few(limits::CHECK_STOPPING);
        self.last = [
            (More::Waiting, waiting && was_left_out(Bound::Waiting)),
            (More::Stopping, stopping && !product.minds_stopping),
            (More::Anew, stopping && product.waits_for_others()),
            (More::ByHand, few(limits::CHECK_BY_HAND) && was_left_out(Bound::ByHand)),
            (More::Behind, few(limits::CHECK_BEHIND) && was_left_out(Bound::Lean)),
        ]
        .into_iter()
        .find_map(|(more, wanted)| (wanted && !self.too_much.contains(&more)).then_some(more));
        self.last
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
