//! Safety events: wherever an actuator exists, each must lead to a safe configuration without another event from outside.

use super::coordinator::outside_events;
use super::explore::Graph;
use super::judge::Traced;
use super::met::MetStates;
use super::product::Product;
use super::state::{Failed, Move, Next, ProductState};
use crate::limits;
use crate::model::codes::COORD_SAFETY_UNHEARD;
use crate::model::finding::{count, did_you_mean};
use crate::model::{Ask, Catalogue, ConfigId, Deployment, EventName, Finding, Findings, Origin, Severity};
use crate::statechart::{Chart, EventId, NodeId};
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;
use std::collections::{BTreeMap, BTreeSet};

/// Events that no coordinator listens to.
pub(super) fn unhandled(deployment: &Deployment, charts: &[&Chart]) -> Findings {
    let event = |(event, at): &(EventName, Origin)| {
        let help = near(deployment, charts, *event)?;
        let message = format!("no coordinator waits for the safety event `{event}`");
        Some(Finding::warning(COORD_SAFETY_UNHEARD, message).at(*at).path("safety").help(help))
    };
    deployment.safety.iter().filter_map(event).collect()
}

/// That something moves, and no event is named that stops it.
pub(super) fn unnamed(deployment: &Deployment, catalogue: &Catalogue) -> Option<Finding> {
    if !deployment.safety.is_empty() {
        return None;
    }
    let changes = deployment.configurations.iter().flat_map(|of| &of.changes);
    let (component, at) = changes.into_iter().find_map(|change| {
        let (component, ty, _) = change.kind.makes()?;
        catalogue.get(ty).is_some_and(|ty| ty.actuator).then_some((component, change.origin))
    })?;
    let message = format!("`{component}` moves something (`actuator: true`), and no event is named under `safety`");
    let help = "name the event that stops it, `safety: [e_stop]`, and let it lead to a `safe` configuration: it is heard before all others, also while the \
                deployment is being stopped, and `davit check` looks for places where it is not";
    let finding = Finding::warning(COORD_SAFETY_UNHEARD, message).at(deployment.key_origin("name"));
    Some(finding.path("safety").also(at, "it is made here").help(help))
}

/// What may have been meant by a safety event that no coordinator listens to; none: one does, or a function may.
fn near(deployment: &Deployment, charts: &[&Chart], event: EventName) -> Option<String> {
    if charts.iter().any(|chart| !chart.is_pure() || chart.events().contains(&event)) {
        return None;
    }
    // It is given on to the subsystems that have one of that name.
    let declares = |own: &Deployment| own.safety.iter().any(|(declared, _)| *declared == event);
    if deployment.all_subsystems().iter().any(|(_, subsystem)| declares(&subsystem.own)) {
        return None;
    }
    let heard: BTreeSet<EventName> = charts.iter().flat_map(|chart| outside_events(deployment, chart)).collect();
    Some(did_you_mean(event.as_str(), "events", heard.iter().map(EventName::as_str)))
}

impl Graph<'_, '_> {
    /// One finding for each event that does not lead to a safe configuration somewhere.
    pub(super) fn safety(&mut self, found: &mut Traced) {
        let events: Vec<_> = self.product.deployment.safety.clone();
        let order = self.in_order();
        // Where nothing comes from outside, it does not matter what came first.
        let mut good = GoodStates::default();
        let mut alike: FxHashMap<usize, BTreeMap<Option<ConfigId>, Deaf>> = FxHashMap::default();
        for (event, origin) in events {
            let mut known: FxHashSet<(SmallVec<[NodeId; 2]>, u32)> = FxHashSet::default();
            let class =
                self.product.outside.iter().position(|outside| *outside == event).map(|at| self.product.alike[at]);
            let said = class.and_then(|class| alike.get(&class).cloned());
            let mut deaf = said.clone().unwrap_or_default();
            for at in order.iter().filter(|_| said.is_none()) {
                let state = &self.reached.states[*at as usize];
                let (world, settled) = (state.world, state.inbox.is_empty() && state.in_transit.is_empty());
                if !settled || !self.product.worlds.has_actuator(world) || self.product.is_down(state) {
                    continue;
                }
                // In one place and one world, with nothing under way, it leads to one thing.
                if state.desk.is_empty() && !known.insert((state.leaves.clone(), world)) {
                    continue;
                }
                if leads_elsewhere((self.product, &self.reached.states), state, event, &mut good).is_none() {
                    continue;
                }
                let asked = asked_instead(self.product, state, event);
                let deaf = deaf.entry(asked.as_ref().map(|(id, _)| *id)).or_default();
                deaf.states.push(*at);
                deaf.leads_to = deaf.leads_to.take().or(asked.map(|(_, place)| place));
                let place = format!("`{}`", self.product.place(state));
                if !deaf.places.contains(&place) {
                    deaf.places.push(place);
                }
            }
            class.into_iter().for_each(|class| _ = alike.insert(class, deaf.clone()));
            for (asked, deaf) in deaf {
                self.unheard((event, origin), asked, deaf, &mut good, found);
            }
        }
    }

    /// That an event does not lead to a safe configuration where it is deaf; `asked`: it leads to this one, which is not safe.
    fn unheard(
        &mut self,
        (event, origin): (EventName, Origin),
        asked: Option<ConfigId>,
        Deaf { states, mut places, leads_to }: Deaf,
        good: &mut GoodStates,
        found: &mut Traced,
    ) {
        let Some(at) = self.best_first(states).first().copied() else { return };
        let unknown = self.product.worlds.top(self.states[at as usize].world).is_some();
        let severity = if unknown { Severity::Warning } else { Severity::Error };
        let finding = if let (Some(id), Some(place)) = (asked, leads_to) {
            let message = format!("`{event}` leads to `{place}` and asks for `{id}`, which is not `safe`");
            let help = format!("write `safe = true` in `{id}`, or ask for a configuration there that is `safe`");
            let written = self.product.worlds.configuration(id).map_or(Origin::NONE, |c| c.origin);
            Finding::new(severity, COORD_SAFETY_UNHEARD, message).also(written, "this one is asked for").help(help)
        } else {
            let more = places.len().saturating_sub(6);
            places.truncate(6);
            let more = if more > 0 { format!(" and {}", count(more, "more place")) } else { String::new() };
            let message = format!(
                "`{event}` does not lead to a `safe` configuration in {}{more}, where an actuator {}",
                places.join(", "),
                if unknown { "may be there after something broke" } else { "is there" },
            );
            let charts: Vec<&Chart> = self.product.members.iter().map(|member| member.chart).collect();
            let near = near(self.product.deployment, &charts, event).map(|near| near + " if not, ").unwrap_or_default();
            Finding::new(severity, COORD_SAFETY_UNHEARD, message).help(format!(
                "{near}add a transition on `{event}` to a state that asks for a `safe` configuration on its entry; one from the \
                 outermost state in which actuators exist serves for all inside"
            ))
        };
        let state = self.states[at as usize].clone();
        let on = leads_elsewhere((self.product, &self.reached.states), &state, event, good).unwrap_or_default();
        let trace = self.trace_on(at, on);
        let finding = (finding.at(origin).path("safety"), trace);
        // First where one is asked for: since it is not safe it is refused as well, where there is less than it touches.
        match asked {
            Some(_) => found.insert(0, finding),
            None => found.push(finding),
        }
    }
}

/// Where a safety event does not lead to a safe configuration.
#[derive(Debug, Clone, Default)]
struct Deaf {
    states: Vec<u32>,
    places: Vec<String>,
    /// Where it leads instead, if something is asked for there.
    leads_to: Option<String>,
}

/// What is asked for, and is not safe, right where a safety event leads from a state, and where that is.
fn asked_instead(product: &mut Product<'_>, state: &ProductState, event: EventName) -> Option<(ConfigId, String)> {
    for number in 0..product.members.len() {
        let id = product.members[number].chart.event(event);
        if id == EventId::OTHER {
            continue;
        }
        let reaction = product.members[number].react(state.leaves[number], id);
        let mut asks = reaction.handed.iter().flat_map(|batch| &batch.requests).map(|request| request.ask);
        let unsafe_one = asks.find_map(|ask| match ask {
            Ask::Apply(id) => product.worlds.configuration(id).filter(|c| !c.safe).map(|_| id),
            _ => None,
        });
        if let Some(id) = unsafe_one {
            let mut after = state.clone();
            after.leaves[number] = reaction.leaf;
            return Some((id, product.place_of(&after, &[number])));
        }
    }
    None
}

fn is_asked(product: &Product<'_>, state: &ProductState) -> bool {
    let is_safe = |ask: Ask| match ask {
        Ask::Apply(id) => product.worlds.configuration(id).is_some_and(|c| c.safe),
        _ => false,
    };
    let in_transit = state.in_transit.iter().any(|batch| batch.requests.iter().any(|request| is_safe(request.ask)));
    product.worlds.is_safe(state.world) || !state.safe.is_empty() || in_transit
}

/// A way on which `event` does not lead to a safe configuration from this state, though nothing else comes from outside; none:
/// on each it does. `good` are states from which every such way does.
fn leads_elsewhere(
    (product, met): (&mut Product<'_>, &MetStates),
    state: &ProductState,
    event: EventName,
    good: &mut GoodStates,
) -> Option<Vec<(ProductState, Next)>> {
    if is_asked(product, state) {
        return None;
    }
    let mut after = vec![state.clone()];
    for number in 0..product.members.len() {
        let id = product.members[number].chart.event(event);
        if id != EventId::OTHER {
            after = after.into_iter().flat_map(|state| product.react(state, number, id)).collect();
        }
    }
    // What nobody waits for anywhere is no move.
    let at = product.outside.iter().position(|name| *name == event).and_then(|at| u16::try_from(at).ok());
    let mut walk = Walk { met, good, begins: usize::from(at.is_some()), way: Vec::new() };
    // Most lead there at once.
    for after in after.into_iter().filter(|after| !is_asked(product, after)).collect::<Vec<_>>() {
        let begins = at.map(|at| (state.clone(), Next::plain(Move::Event(at), after.clone(), Failed::Nothing)));
        walk.way.extend(begins);
        if !walk.leads(product, &after) {
            return Some(walk.way);
        }
        walk.way.clear();
    }
    None
}

/// States from which every way leads to a safe configuration where nothing comes from outside: most of them were met.
#[derive(Default)]
struct GoodStates {
    numbers: FxHashSet<u32>,
    others: FxHashSet<ProductState>,
}

impl GoodStates {
    fn contains(&self, met: &MetStates, state: &ProductState) -> bool {
        met.find(state).map_or_else(|| self.others.contains(state), |number| self.numbers.contains(&number))
    }

    fn insert(&mut self, met: &MetStates, state: &ProductState) {
        match met.find(state) {
            Some(number) => _ = self.numbers.insert(number),
            None => _ = self.others.insert(state.clone()),
        }
    }
}

/// Ways on which nothing comes from outside.
struct Walk<'g> {
    met: &'g MetStates,
    good: &'g mut GoodStates,
    /// So many moves come from outside, at the beginning.
    begins: usize,
    /// The moves so far, each with the state before it.
    way: Vec<(ProductState, Next)>,
}

impl Walk<'_> {
    /// Whether every way from here comes to a safe configuration; else `way` is one that does not.
    fn leads(&mut self, product: &mut Product<'_>, state: &ProductState) -> bool {
        if is_asked(product, state) || self.good.contains(self.met, state) {
            return true;
        }
        // Round and round, or too far to be an answer to an emergency.
        if self.way.len() > limits::CHECK_CYCLE || self.way.iter().skip(self.begins).any(|(before, _)| before == state)
        {
            return false;
        }
        let own = |by: &Move| matches!(by, Move::Answer | Move::Taken(..) | Move::Time(..));
        let nexts: Vec<Next> = product.nexts(state).all.into_iter().filter(|next| own(&next.by)).collect();
        if nexts.is_empty() {
            return false;
        }
        for next in nexts {
            self.way.push((state.clone(), next.clone()));
            if !self.leads(product, &next.state) {
                return false;
            }
            self.way.pop();
        }
        self.good.insert(self.met, state);
        true
    }
}
