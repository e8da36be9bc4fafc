//! Bring-up and shutdown with every request answered *ok*: what `plan --bringup` and `--shutdown` show, and the least that
//! must work. All coordinators are driven together.
//!
//! Where nothing is waited for but events of components or operators, the shortest series of events is taken that leads
//! to the goal.

use super::from_outside::Raises;
use super::lasts::{Soonest, soonest};
use super::members::Member;
use super::outcome::Held;
use super::product::Product;
use super::shortest::shortest;
use super::shows::goes;
use super::state::{Failed, Move, Next, ProductState};
use super::timers::{Waits, takes};
use super::tried::{Goal, Tried, Way};
use crate::limits;
use crate::model::{Ask, Catalogue, Deployment, Findings, Ident, Snapshot, Verdict};
use crate::plan::PlannedStep;
use crate::stack::Request;
use crate::statechart::{Chart, NodeId};
use rustc_hash::{FxHashMap, FxHashSet};

/// One thing that happens on the way.
#[derive(Debug, Clone)]
pub enum WayEvent {
    /// An event comes from outside, or time passes.
    Event {
        /// The coordinator that hears it.
        coordinator: Ident,
        /// The event.
        event: String,
    },
    /// Requests made together are carried out.
    Applied {
        /// The coordinator that asks.
        coordinator: Ident,
        /// The requests, as they are carried out.
        asks: Vec<Ask>,
        /// What is done.
        steps: Vec<PlannedStep>,
        /// The system after it.
        result: Snapshot,
        /// The state the coordinator is in then.
        state: String,
    },
}

/// A bring-up or a shutdown with every request answered *ok*.
#[derive(Debug, Clone)]
pub struct Drive {
    /// What happens, in order.
    pub happenings: Vec<WayEvent>,
    /// Whether it arrives.
    pub reached: bool,
    /// The coordinator that does not arrive; when all do, the last.
    pub coordinator: Ident,
    /// The state it ends in.
    pub state: String,
    /// The system it ends with.
    pub system: Snapshot,
    /// Why a request on the way was refused, if one was; the way ends there.
    pub refused: Option<(Ask, Findings)>,
}

/// How far to drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Until {
    /// From nothing to *up*.
    Up,
    /// From *up* to *down*; what happens before *up* is left out.
    Down,
}

impl Product<'_> {
    /// What happens next by itself when every request is answered *ok*; none: nothing does, or it is refused.
    /// With `waits` told it is what comes first.
    pub(super) fn by_itself(
        &mut self,
        state: &ProductState,
        waits: Option<&Waits>,
    ) -> Result<Option<Next>, (Request, Findings)> {
        if let Some(turn) = state.desk.under_way().first().filter(|_| state.safe.is_empty() && state.due.is_empty()) {
            let (number, requests) = (turn.number, turn.batch.requests.clone());
            if self.worlds.get(state.world).is_some() {
                let comes = self.comes(state, number);
                if let Some((place, reasons)) = comes.refused.first().or(comes.hollow.first()) {
                    return Err((requests[*place], reasons.to_vec()));
                }
            }
        }
        if let Some(request) = state.safe.first().copied()
            && let reasons = self.worlds.safe(state.world, &request, &Held::new()).troubles.clone()
            && !reasons.is_empty()
        {
            return Err((request, reasons.to_vec()));
        }
        // Answers on their way, then safe configurations, then what is under way, then what lies in the inboxes.
        let mut nexts = self.goes_on(state).all;
        let Some(waits) = waits else { return Ok(nexts.into_iter().next()) };
        // The first way in which something ends is that on which nothing fails.
        let well = nexts.iter().enumerate().filter(|(_, next)| next.failed == Failed::Nothing);
        let first = well.min_by_key(|(_, next)| takes(&self.timers_of(next, waits), waits)).map_or(0, |(at, _)| at);
        Ok((first < nexts.len()).then(|| nexts.swap_remove(first)))
    }

    /// Lets everything happen that does by itself, and appends it. Stops early where all are at the goal, and with `waits` told
    /// where something takes time.
    pub(super) fn rest(
        &mut self,
        state: ProductState,
        goal: Goal,
        moves: &mut Vec<Next>,
        mut waits: Option<&mut Waits>,
    ) -> Result<ProductState, (Request, Findings)> {
        let mut state = state;
        let mut seen: FxHashSet<ProductState> = FxHashSet::default();
        for _ in 0..limits::CHECK_DRIVEN {
            if state.is_at_rest() && self.all_in(&state, goal) || state.waiting() > limits::CHECK_PILED {
                break;
            }
            // Where answers go round for ever the others come to what lies in their inboxes all the same.
            let next = match seen.insert(state.clone()) {
                true => self.by_itself(&state, waits.as_deref())?,
                false => {
                    seen.clear();
                    self.goes_on(&state).all.into_iter().find(|next| matches!(next.by, Move::Taken(..)))
                }
            };
            let Some(next) = next else { break };
            if let Some(waits) = waits.as_deref_mut() {
                let (after, took) = self.waits_behind(&state, &next, waits);
                if !took.is_zero() {
                    break;
                }
                *waits = after;
            }
            state = next.state.clone();
            moves.push(next);
        }
        Ok(state)
    }

    /// What comes first, or later.
    pub(super) fn outside_moves(&mut self, state: &ProductState, tried: &Tried, first: bool) -> Vec<Next> {
        let all = self.nexts(state).all;
        let fits = |next: &Next| match next.by {
            Move::Event(at) => {
                let name = self.outside[usize::from(at)];
                // What they tell each other comes of them where all goes well.
                let wanted = name == tried.first;
                let comes = if first { wanted } else { !self.from_outside[usize::from(at)].told_between };
                // Of subsystems what they tell where nothing fails in them. It is wanted up once.
                let well = next.failed == Failed::Nothing || !self.is_told_by_child(name);
                let reached = first || !tried.is_for_unreached(self, name);
                comes && well && reached && name != tried.never && (first || tried.stopping || !wanted)
            }
            Move::Time(..) | Move::Confirmed(_) => !first,
            Move::Unheard(_) => !first && next.failed == Failed::Nothing,
            // Where it is not confirmed it is taken back, if that does not fail.
            Move::Answer => !first && next.answers.iter().any(|(_, verdict)| *verdict == Verdict::Reverted),
            _ => false,
        };
        let comes = |next: &Next| !tried.stopping || self.raises_while_stopping(next.by) > Raises::Nobody;
        all.into_iter().filter(|next| fits(next) && comes(next)).collect()
    }
}

/// The shortest way from `from` to where all are inside the goal with nothing waiting, every request answered *ok*; where that
/// has too little time, or waits for what another time comes before, the one that lasts shortest. When there is none, the way to where it stops.
fn way(product: &mut Product<'_>, from: ProductState, tried: &Tried, goal: Goal) -> Way {
    let mut way = timely(product, from, tried, goal);
    if product.comes_elsewhere(&way.moves) {
        product.unordered |= way.reached;
        way.in_this_order = !way.reached && product.arrives_in_some_order(&way.from, tried, goal);
    }
    way
}

fn timely(product: &mut Product<'_>, from: ProductState, tried: &Tried, goal: Goal) -> Way {
    let mut way = shortest(product, from, tried, goal);
    if !way.reached {
        // What has to stand for a time may be overtaken.
        if !product.standing.is_empty()
            && let Soonest::Way(moves) = soonest(product, &way.from, tried, goal)
        {
            way = Way { moves, reached: true, refused: None, failed: None, ..way };
        } else {
            return way;
        }
    }
    let lasts = product.lasts(&way.from, &way.moves, tried);
    if lasts.all < tried.within && lasts.overtaken.is_none() {
        product.tied |= lasts.tied;
        return way;
    }
    match soonest(product, &way.from, tried, goal) {
        Soonest::Way(moves) => {
            way.moves = moves;
            let lasts = product.lasts(&way.from, &way.moves, tried);
            product.tied |= lasts.tied;
            way.late = (lasts.all >= tried.within).then_some((lasts.all, lasts.timers));
        }
        Soonest::Nowhere(moves) => (way.reached, way.moves, way.overtaken) = (false, moves, lasts.overtaken),
        Soonest::TooMany => product.untimed = true,
    }
    way
}

/// How the coordinators come to rest by what they ask for by themselves, before anybody wants them up. Where they go round
/// for ever: to where on that round one listens to who wants them up.
fn settled(product: &mut Product<'_>, start: &ProductState) -> Vec<Next> {
    let wanted = product.deployment.deploy.event;
    let mut way: Vec<Next> = Vec::new();
    let mut seen: FxHashMap<ProductState, usize> = std::iter::once((start.clone(), 0)).collect();
    loop {
        let last = way.last().map_or(start, |next| &next.state).clone();
        if last.waiting() > limits::CHECK_PILED || way.len() >= limits::CHECK_DRIVEN {
            return way;
        }
        let Ok(Some(next)) = product.by_itself(&last, None) else { return way };
        let round = seen.get(&next.state).copied();
        seen.insert(next.state.clone(), way.len() + 1);
        way.push(next);
        if let Some(round) = round {
            let listens = |next: &Next| {
                let members = product.members.iter_mut().zip(&next.state.leaves);
                members.into_iter().any(|(member, leaf)| member.takes(*leaf, wanted))
            };
            let from = round.saturating_sub(1);
            if let Some(at) = way[from..].iter().position(listens) {
                way.truncate(from + at + 1);
            }
            return way;
        }
    }
}

/// The ways up and, when that arrives, down. None when a coordinator cannot be entered or a state is not there.
pub(super) fn ways(product: &mut Product<'_>) -> Option<(Way, Option<Way>)> {
    let deployment = product.deployment;
    if product.members.iter().any(|member| member.up.is_none() || member.down.is_none()) {
        return None;
    }
    let start = product.start()?;
    let mut moves = settled(product, &start);
    let ready = moves.last().map_or(&start, |next| &next.state).clone();
    let (deploy, shutdown) = (deployment.deploy.event, deployment.shutdown.event);
    let within = deployment.deploy.within;
    let tried = Tried { first: deploy, never: shutdown, stopping: false, within, unreached: Vec::new() };
    let tried = tried.from(product, &ready, |member| member.goal_up());
    let mut rise = way(product, ready, &tried, |member| member.goal_up());
    // From the start, not from where it was ready.
    moves.append(&mut rise.moves);
    let rise = Way { from: start, moves, ..rise };
    if !rise.reached {
        return Some((rise, None));
    }
    let top = rise.end().clone();
    let within = deployment.shutdown.within;
    let tried = Tried { first: shutdown, never: deploy, stopping: true, within, unreached: Vec::new() };
    let tried = tried.from(product, &top, |member| member.down);
    let fall = way(product, top, &tried, |member| member.down);
    Some((rise, Some(fall)))
}

/// Drives a deployment that was checked, on the planner's picture of the system.
///
/// None when a coordinator cannot be entered, or a state that the deployment names is not there.
pub fn drive(deployment: &Deployment, catalogue: &Catalogue, until: Until) -> Option<Drive> {
    let charts: Option<Vec<Chart>> = deployment.charts().map(|chart| crate::statechart::compile(chart).0).collect();
    let charts = charts?;
    let charts: Vec<&Chart> = charts.iter().collect();
    let mut product = Product::of_all(deployment, &charts, catalogue);
    product.operator.clear();
    let (rise, fall) = ways(&mut product)?;
    let end = match (until, &fall) {
        (Until::Down, Some(fall)) => fall,
        _ => &rise,
    };
    let reached = end.reached && (until == Until::Up || fall.is_some());
    let world = product.worlds.get(end.end().world)?;
    let goal: Goal = if until == Until::Up { |member| member.goal_up() } else { |member| member.down };
    let mut last = product.members.iter().zip(&end.end().leaves).collect::<Vec<_>>().into_iter();
    let inside =
        |(member, leaf): &(&Member<'_>, &NodeId)| goal(member).is_some_and(|goal| member.chart.is_inside(**leaf, goal));
    let ends = last.clone().find(|one| !inside(one)).or_else(|| last.next_back());
    let (member, leaf) = ends?;
    Some(Drive {
        reached,
        coordinator: member.name,
        state: member.chart.fqn(*leaf).to_string(),
        system: world.system.snapshot(),
        refused: end.refused.clone().map(|(request, findings)| (request.ask, findings)),
        happenings: happenings(&product, end),
    })
}

/// What happens on a way.
fn happenings(product: &Product<'_>, way: &Way) -> Vec<WayEvent> {
    let mut happenings = Vec::new();
    let mut before = &way.from;
    for next in &way.moves {
        let state = |number: usize| product.members[number].chart.fqn(next.state.leaves[number]).to_string();
        let of = |number: usize, event: String| WayEvent::Event { coordinator: product.members[number].name, event };
        match next.by {
            Move::Answer => {
                let requests: Vec<Request> = next.answers.iter().map(|(request, _)| *request).collect();
                if let Some(first) = requests.first()
                    && let Some(world) = product.worlds.get(next.state.world)
                    && let Some(member) = product.member(first.requester)
                {
                    happenings.push(WayEvent::Applied {
                        coordinator: product.members[member].name,
                        asks: requests.iter().map(|request| request.ask).collect(),
                        steps: product.worlds.steps(before.world, &requests, &goes(before, &requests)),
                        result: world.system.snapshot(),
                        state: state(member),
                    });
                }
            }
            // Several take it when they come to it: each is told of then.
            Move::Event(at) if next.state.inbox.is_empty() => {
                let moved = (0..product.members.len()).filter(|n| before.leaves[*n] != next.state.leaves[*n]);
                let number = moved.into_iter().next().unwrap_or(0);
                happenings.push(of(number, product.outside[usize::from(at)].to_string()));
            }
            Move::Time(number, event) | Move::Taken(number, event) => {
                let number = usize::from(number);
                happenings.push(of(number, product.members[number].chart.event_text(event)));
            }
            _ => {}
        }
        before = &next.state;
    }
    happenings
}
