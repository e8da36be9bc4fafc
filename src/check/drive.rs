//! Bring-up and shutdown with every request answered *ok*: what `plan --bringup` and `--shutdown` show, and the least that
//! must work.
//!
//! Where nothing is waited for but events of components or operators, the shortest series of events is taken that leads
//! to the goal.

use super::beside;
use super::coordinator;
use super::product::{Move, Product, State};
use super::reactions::Reactions;
use super::world::{self, Applied, World, Worlds};
use crate::limits;
use crate::model::{Ask, Catalogue, ComponentName, ConfigId, Deployment, EventName, Findings, Ident, Snapshot};
use crate::plan::PlannedStep;
use crate::stack::{Requester, Stack};
use crate::statechart::{Chart, EventId, NodeId};
use crate::system::System;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::VecDeque;
use std::sync::Arc;

/// One thing that happens on the way.
#[derive(Debug, Clone)]
pub enum Happening {
    /// An event comes from outside, or time passes.
    Event {
        /// The coordinator that hears it.
        coordinator: Ident,
        /// The event.
        event: String,
        /// The state the coordinator is in then.
        state: String,
    },
    /// Requests made together are carried out.
    Applied {
        /// The coordinator that asks.
        coordinator: Ident,
        /// The requests, as they were raised.
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
    pub happenings: Vec<Happening>,
    /// Whether it arrives.
    pub reached: bool,
    /// The coordinator that does not arrive; when all do, the last.
    pub coordinator: Ident,
    /// The state it ends in.
    pub state: String,
    /// The system it ends with.
    pub system: Snapshot,
    /// Frames that are left.
    pub frames: Vec<ConfigId>,
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

/// Configurations whose frames the coordinator may undo; none: any (it pops the top).
pub(super) fn undone(deployment: &Deployment, chart: &Chart) -> Option<FxHashSet<ConfigId>> {
    let mut ids: FxHashSet<ConfigId> =
        deployment.configurations.iter().filter(|c| c.group.is_some()).map(|c| c.id).collect();
    for site in chart.raises() {
        match coordinator::ask_of(deployment, site.name) {
            Some(Ask::Undo | Ask::UndoTo(_)) => return None,
            Some(Ask::UndoOf(id)) => _ = ids.insert(id),
            _ => {}
        }
    }
    Some(ids)
}

/// The product of a deployment's coordinator and configurator, where nothing has happened yet.
pub(super) fn product<'a>(deployment: &'a Deployment, chart: &'a Chart, catalogue: &Catalogue) -> Product<'a> {
    let outside = coordinator::outside_events(deployment, chart);
    Product {
        deployment,
        chart,
        reactions: Reactions::new(deployment, chart, &outside),
        worlds: Worlds::new(deployment, catalogue, undone(deployment, chart)),
        down: chart.find(&deployment.first_coordinator().down).ok(),
    }
}

/// A way: states with the moves that lead to them.
pub(super) struct Way {
    pub(super) from: State,
    pub(super) moves: Vec<(Move, State)>,
    pub(super) reached: bool,
    pub(super) refused: Option<(Ask, Findings)>,
}

impl Way {
    /// The state at the end.
    pub(super) fn end(&self) -> &State {
        self.moves.last().map_or(&self.from, |(_, state)| state)
    }
}

/// The shortest way from `from` to a state inside `goal` with no request waiting, every request answered *ok*, that
/// begins with `first` and has `never` nowhere. When there is none, the way to where it stops.
pub(super) fn way(product: &mut Product<'_>, from: State, first: EventName, never: EventName, goal: NodeId) -> Way {
    let first = product.chart.event(first);
    let never = product.chart.event(never);
    let begin = product.event(&from, first);
    let mut states = vec![(begin.clone(), None::<(usize, Move)>)];
    let mut index: FxHashMap<State, usize> = std::iter::once((begin, 0)).collect();
    let mut queue: VecDeque<usize> = std::iter::once(0).collect();
    let mut refused: Option<(usize, Ask, Findings)> = None;
    let mut last = 0;
    let mut reached = None;
    while let Some(at) = queue.pop_front() {
        let state = states[at].0.clone();
        if state.waiting.is_empty() && product.chart.is_inside(state.leaf, goal) {
            reached = Some(at);
            break;
        }
        if states.len() > limits::CHECK_TRANSITIONS {
            break;
        }
        last = at;
        let mut next: Vec<(Move, State)> = Vec::new();
        if state.waiting.len() > limits::CHECK_PILED {
            continue;
        }
        if let Some(unit) = state.waiting.first() {
            let asks = unit.asks.clone();
            match product.head(&state) {
                Applied::Done { world, .. } => {
                    next.push((Move::Answer { asks, ok: true }, product.answer(&state, true, world)));
                }
                Applied::Refused { which, findings } => {
                    refused.get_or_insert((at, asks[which.min(asks.len() - 1)], findings.to_vec()));
                }
                Applied::TooDeep(_) => {}
            }
        } else {
            let offers: Vec<EventId> =
                product.reactions.offers(state.leaf).iter().copied().filter(|e| *e != never).collect();
            for event in offers {
                next.push((Move::Event(event), product.event(&state, event)));
            }
        }
        for (by, state) in next {
            if !index.contains_key(&state) {
                index.insert(state.clone(), states.len());
                queue.push_back(states.len());
                states.push((state, Some((at, by))));
            }
        }
    }
    let mut at = reached.or(refused.as_ref().map(|(at, ..)| *at)).unwrap_or(last);
    let mut moves = Vec::new();
    while let Some((before, by)) = states[at].1.clone() {
        moves.push((by, states[at].0.clone()));
        at = before;
    }
    moves.push((Move::Event(first), states[0].0.clone()));
    moves.reverse();
    let refused = if reached.is_some() { None } else { refused.map(|(_, ask, findings)| (ask, findings)) };
    Way { from, moves, reached: reached.is_some(), refused }
}

/// Where the coordinator comes to by what it asks for by itself, before anybody wants it up. Where it goes round for ever:
/// where on that round it listens to who wants it up.
fn settled(product: &mut Product<'_>, start: State) -> State {
    let wanted = product.chart.event(product.deployment.deploy.event);
    let mut way = vec![start.clone()];
    let mut seen: FxHashSet<State> = std::iter::once(start).collect();
    loop {
        let last = way[way.len() - 1].clone();
        if last.waiting.is_empty() || last.waiting.len() > limits::CHECK_PILED {
            return last;
        }
        let Applied::Done { world, .. } = product.head(&last) else { return last };
        let next = product.answer(&last, true, world);
        if !seen.insert(next.clone()) || way.len() >= limits::CHECK_TRANSITIONS {
            let round = way.iter().position(|state| *state == next).unwrap_or(0);
            let listens = |state: &&State| product.reactions.react(state.leaf, wanted).taken;
            return way[round..].iter().find(listens).cloned().unwrap_or(next);
        }
        way.push(next);
    }
}

/// The ways up and, when that arrives, down. None when the coordinator cannot be entered or a state is not there.
pub(super) fn ways(product: &mut Product<'_>) -> Option<(Way, Option<Way>)> {
    let deployment = product.deployment;
    let up = product.chart.find(&deployment.first_coordinator().up).ok()?;
    let down = product.chart.find(&deployment.first_coordinator().down).ok()?;
    let start = product.start()?;
    let start = settled(product, start);
    let rise = way(product, start, deployment.deploy.event, deployment.shutdown.event, up);
    if !rise.reached {
        return Some((rise, None));
    }
    let top = rise.end().clone();
    let fall = way(product, top, deployment.shutdown.event, deployment.deploy.event, down);
    Some((rise, Some(fall)))
}

/// Drives a deployment that was checked, on the planner's picture of the system. Several coordinators are driven one after
/// the other, down in the opposite order, each with what the others emit among the events from outside.
///
/// None when a coordinator cannot be entered, or a state that the deployment names is not there.
pub fn drive(deployment: &Deployment, catalogue: &Catalogue, until: Until) -> Option<Drive> {
    let charts: Vec<Chart> =
        deployment.charts().map(|written| crate::statechart::compile(written).0).collect::<Option<_>>()?;
    let charts: Vec<&Chart> = charts.iter().collect();
    let mut each = Vec::with_capacity(charts.len());
    for (number, chart) in charts.iter().enumerate() {
        let alone = beside::view(deployment, &charts, number)?;
        let (rise, fall) = ways(&mut product(&alone, chart, catalogue))?;
        each.push((deployment.coordinators[number].name, *chart, rise, fall));
    }
    let mut driver = Driver {
        deployment,
        world: World { system: System::new(Arc::new(catalogue.clone())), stack: Stack::new(deployment.limits.stack) },
        happenings: Vec::new(),
    };
    let mut last = None;
    for (name, chart, rise, _) in &each {
        let refused = driver.replay(*name, chart, rise);
        let stops = refused.is_some() || !rise.reached;
        last = Some((*name, *chart, rise, refused));
        if stops {
            return driver.ended(last, false);
        }
    }
    if until == Until::Down {
        driver.happenings.clear();
        for (name, chart, rise, fall) in each.iter().rev() {
            let Some(fall) = fall else { return driver.ended(Some((*name, *chart, rise, None)), false) };
            let refused = driver.replay(*name, chart, fall);
            let stops = refused.is_some() || !fall.reached;
            last = Some((*name, *chart, fall, refused));
            if stops {
                return driver.ended(last, false);
            }
        }
    }
    driver.ended(last, true)
}

/// Ways are gone anew with real values: worlds that `Worlds` takes for one may differ in them.
struct Driver<'a> {
    deployment: &'a Deployment,
    world: World,
    happenings: Vec<Happening>,
}

impl Driver<'_> {
    /// One coordinator's way; what is refused on it ends it.
    fn replay(&mut self, coordinator: Ident, chart: &Chart, way: &Way) -> Option<(Ask, Findings)> {
        let context = world::context(self.deployment);
        let requester = Requester::Coordinator(ComponentName::new(coordinator.as_str()).expect("a plain name"));
        for (by, state) in &way.moves {
            let state = chart.fqn(state.leaf).to_string();
            match by {
                Move::Event(event) => {
                    let event = chart.event_text(*event);
                    self.happenings.push(Happening::Event { coordinator, event, state });
                }
                Move::Answer { asks, .. } => {
                    match world::apply(self.deployment, &context, requester, &self.world, asks) {
                        Ok(change) => {
                            self.world = change.world;
                            let (asks, steps) = (asks.to_vec(), change.steps);
                            let result = self.world.system.snapshot();
                            self.happenings.push(Happening::Applied { coordinator, asks, steps, result, state });
                        }
                        Err(refusal) => return Some((asks[0], refusal.findings)),
                    }
                }
            }
        }
        None
    }

    /// How it ends, with the way that came last.
    #[allow(clippy::type_complexity)] // one coordinator's share, taken apart at once
    fn ended(self, last: Option<(Ident, &Chart, &Way, Option<(Ask, Findings)>)>, reached: bool) -> Option<Drive> {
        let (coordinator, chart, way, refused) = last?;
        Some(Drive {
            happenings: self.happenings,
            reached,
            coordinator,
            state: chart.fqn(way.end().leaf).to_string(),
            system: self.world.system.snapshot(),
            frames: self.world.stack.frames().iter().map(|f| f.configuration).collect(),
            refused: refused.or_else(|| way.refused.clone()),
        })
    }
}
