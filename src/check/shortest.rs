//! The shortest way from a state to a goal, every request answered *ok*: the least number of things from outside.
//!
//! Coordinators that have nothing to do with each other ([`groups`](super::coupling::groups)) are led there one group after the other: nothing
//! that one group hears changes what another one does, so whatever order the shortest way has, this is as short, and looked for in the sum
//! of their states instead of the product. Where that does not arrive they are tried all together.

use super::effort::Far;
use super::product::Product;
use super::state::{Move, Next, ProductState};
use super::tried::{Goal, Tried, Way};
use crate::model::Findings;
use crate::stack::Request;
use crate::statechart::EventId;
use rustc_hash::FxHashSet;
use std::collections::VecDeque;

/// Some of the coordinators, by their places; none: all of them.
pub(super) type Among<'p> = Option<&'p [usize]>;

impl Product<'_> {
    /// Whether these coordinators are all inside the goal.
    pub(super) fn are_in(&self, state: &ProductState, goal: Goal, part: Among<'_>) -> bool {
        let Some(part) = part else { return self.all_in(state, goal) };
        part.iter().all(|at| {
            let (member, leaf) = (&self.members[*at], state.leaves[*at]);
            goal(member).is_some_and(|goal| member.chart.is_inside(leaf, goal))
        })
    }

    /// Whether something that comes from outside is for nobody but these.
    fn concerns(&self, by: Move, part: Among<'_>) -> bool {
        let Some(part) = part else { return true };
        match by {
            Move::Event(at) => {
                let name = self.outside[usize::from(at)];
                let mut hear =
                    (0..self.members.len()).filter(|at| self.members[*at].chart.event(name) != EventId::OTHER);
                hear.all(|at| part.contains(&at))
            }
            Move::Time(of, _) => part.contains(&usize::from(of)),
            _ => true,
        }
    }
}

/// The shortest way from `from` to where all are inside the goal with nothing waiting. When there is none, the way to where it stops.
pub(super) fn shortest(product: &mut Product<'_>, from: ProductState, tried: &Tried, goal: Goal) -> Way {
    let groups = product.groups.clone();
    if groups.len() > 1
        && let Some(way) = one_after_the_other(product, &from, tried, goal, &groups)
    {
        return way;
    }
    search(product, from, tried, goal, None, true)
}

/// One group after the other. None: one does not arrive so.
fn one_after_the_other(
    product: &mut Product<'_>,
    from: &ProductState,
    tried: &Tried,
    goal: Goal,
    groups: &[Vec<usize>],
) -> Option<Way> {
    let untimed = product.untimed;
    let mut way: Option<Way> = None;
    for group in groups {
        let (at, begins) = way.as_ref().map_or((from, true), |way| (way.end(), false));
        let more = search(product, at.clone(), tried, goal, Some(group), begins);
        if !more.reached {
            product.untimed = untimed;
            return None;
        }
        way = Some(match way {
            None => more,
            Some(mut way) => {
                way.moves.extend(more.moves);
                way
            }
        });
    }
    let way = way?;
    (way.end().is_at_rest() && product.all_in(way.end(), goal)).then_some(way)
}

/// The same for these coordinators alone: nothing comes but what these hear, and they have to be at the goal. `begins`: first what is tried comes.
fn search(
    product: &mut Product<'_>,
    from: ProductState,
    tried: &Tried,
    goal: Goal,
    part: Among<'_>,
    begins: bool,
) -> Way {
    let mut states: Vec<(ProductState, Option<usize>, Vec<Next>)> = Vec::new();
    // To which of them something leads that need not come: where it does not arrive, these do not show why.
    let mut ill: FxHashSet<usize> = FxHashSet::default();
    let mut index: FxHashSet<ProductState> = FxHashSet::default();
    let mut queue: VecDeque<usize> = VecDeque::new();
    let mut refused: Option<(usize, Vec<Next>, (Request, Findings))> = None;
    let mut failed: Option<(usize, Vec<Next>, usize)> = None;
    states.push((from.clone(), None, Vec::new()));
    queue.push_back(0);
    let (mut last, mut reached, mut round, mut unfollowed) = (0, None, None, false);
    while let Some(at) = queue.pop_front() {
        let state = states[at].0.clone();
        if (at > 0 || !begins) && state.is_at_rest() && product.are_in(&state, goal, part) {
            reached = Some(at);
            break;
        }
        let followed = product.effort.transitions().min(product.effort.states());
        let (met, most) = (states.len(), followed.max(product.most_driven));
        if met > most || !product.effort.goes_on(at, Far { states: met, transitions: at }) {
            unfollowed = true;
            break;
        }
        if !ill.contains(&at) {
            last = at;
        }
        let first = begins && at == 0;
        for next in product.outside_moves(&state, tried, first) {
            if !first && !product.concerns(next.by, part) {
                continue;
            }
            let is_ill = ill.contains(&at) || product.need_not_come(next.by, tried.stopping);
            let mut moves = vec![next.clone()];
            let rest = product.rest(next.state, goal, &mut moves, None);
            if let Some((by, last)) = tried.fails(product, &moves) {
                moves.truncate(last + 1);
                if !is_ill {
                    let _ = failed.get_or_insert((at, moves, by));
                }
                continue;
            }
            match rest {
                Ok(rest) => {
                    if index.insert(rest.clone()) {
                        // Where answers go round for ever is what keeps it from coming anywhere.
                        round = round.or((!rest.is_at_rest()).then_some(states.len()));
                        if is_ill {
                            ill.insert(states.len());
                        }
                        queue.push_back(states.len());
                        states.push((rest, Some(at), moves));
                    }
                }
                Err(why) => _ = refused.get_or_insert((at, moves, why)),
            }
        }
    }
    let (mut at, mut moves) = match (reached, &refused, &failed) {
        (Some(at), _, _) => (at, Vec::new()),
        (None, Some((at, moves, _)), _) | (None, None, Some((at, moves, _))) => (*at, moves.clone()),
        (None, None, None) => (round.unwrap_or(last), Vec::new()),
    };
    while let Some(before) = states[at].1 {
        let mut way = states[at].2.clone();
        way.append(&mut moves);
        moves = way;
        at = before;
    }
    let refused = if reached.is_some() { None } else { refused.map(|(_, _, why)| why) };
    let failed = if reached.is_some() || refused.is_some() { None } else { failed.map(|(_, _, by)| by) };
    // What is refused, or has failed, on the way may not be in the way of another one.
    product.untimed |= unfollowed;
    let reached = reached.is_some();
    let unheard = tried.unreached.first().copied().filter(|_| !reached && refused.is_none() && failed.is_none());
    Way {
        from,
        moves,
        reached,
        refused,
        failed,
        late: None,
        overtaken: None,
        unfollowed,
        unheard,
        in_this_order: false,
    }
}
