//! What coordinators hear, for each leaf once.

use super::members::Member;
use crate::model::EventName;
use crate::statechart::{EventId, NodeId};
use rustc_hash::FxHashMap;
use std::rc::Rc;

/// What a coordinator hears in a leaf.
#[derive(Debug, Default)]
pub(super) struct Offers {
    /// Events from outside, by the places of the first that are like them, in order.
    pub outside: Vec<usize>,
    /// Times.
    pub timed: Vec<EventId>,
}

/// All that was asked for.
#[derive(Debug, Default)]
pub(super) struct AllOffers(FxHashMap<(usize, NodeId), Rc<Offers>>);

impl AllOffers {
    /// What the coordinator of that number hears in a leaf: always the same. `outside` are the events from outside, and `alike` the
    /// places of the first that are like each.
    pub fn of(
        &mut self,
        number: usize,
        member: &mut Member<'_>,
        leaf: NodeId,
        outside: &[EventName],
        alike: &[usize],
    ) -> Rc<Offers> {
        if let Some(known) = self.0.get(&(number, leaf)) {
            return known.clone();
        }
        let mut offers = Offers::default();
        for event in member.offers(leaf).iter() {
            let name = member.name_of(*event);
            match name.and_then(|name| outside.iter().position(|outside| *outside == name)) {
                Some(at) => offers.outside.push(alike[at]),
                None => offers.timed.push(*event),
            }
        }
        offers.outside.sort_unstable();
        offers.outside.dedup();
        let offers = Rc::new(offers);
        self.0.insert((number, leaf), offers.clone());
        offers
    }
}
