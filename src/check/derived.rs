//! The interface automaton of a file, of what was followed of it: what its parent raises and what it tells, and nothing else.
//!
//! What a parent is told without anybody writing it (*up*, *failed*, *down*, *stranded*) is told by the rule by which a running deployment tells
//! it; times that are over may be over at any moment.

use super::automaton::{InterfaceAction, InterfaceAutomaton, InterfaceState};
use super::automaton_draft::AutomatonDraft;
use super::edges::Edge;
use super::explore::Graph;
use super::neighbours::ParentInterface;
use super::product::Product;
use super::reactions::triggers;
use super::shared_list::SharedList;
use super::state::{Failed, Move, ProductState};
use crate::model::subsystem::{IGNORED, SeenStanding, standing};
use crate::model::{Deployment, EventName, SubsystemStanding};
use crate::statechart::EventId;
use indexmap::IndexMap;
use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};
use std::collections::BTreeSet;

/// Where a subsystem is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct ShownPlace {
    /// A state of the product.
    state: u32,
    /// What was told last.
    told: Option<SubsystemStanding>,
    /// It was told to go down, and is not yet.
    ending: bool,
    /// The worst that has failed since it was begun.
    failed: Failed,
}

/// What is made of a graph.
struct Deriving<'g, 'p, 'a> {
    graph: &'g Graph<'p, 'a>,
    parent: &'g ParentInterface,
    begins: EventName,
    ends: EventName,
    /// What the parent waits for.
    hears: FxHashSet<EventName>,
    /// The events that tell how it stands, and that one was ignored.
    standings: FxHashMap<SubsystemStanding, EventName>,
    ignored: FxHashMap<EventName, Option<EventName>>,
    seen: FxHashMap<u32, SeenStanding>,
    places: IndexMap<ShownPlace, u32, FxBuildHasher>,
    draft: AutomatonDraft,
}

impl Graph<'_, '_> {
    /// What these coordinators, which are all of a file, show its parent; none: there is too much of it.
    pub(super) fn derived(&self, parent: &ParentInterface) -> Option<InterfaceAutomaton> {
        let deployment: &Deployment = self.product.deployment;
        let (begins, ends) = (deployment.deploy.event, deployment.shutdown.event);
        let (seen, places) = (FxHashMap::default(), IndexMap::default());
        let hears = parent.hears.iter().copied().collect();
        let standings = FxHashMap::default();
        let (ignored, draft) = (FxHashMap::default(), AutomatonDraft::default());
        let mut deriving =
            Deriving { graph: self, parent, begins, ends, hears, standings, ignored, seen, places, draft };
        let start = deriving.at(ShownPlace {
            state: 0,
            told: Some(SubsystemStanding::Down),
            ending: false,
            failed: Failed::Nothing,
        });
        let mut next = 0;
        while let Some((place, number)) = deriving.places.get_index(next).map(|(place, number)| (*place, *number)) {
            next += 1;
            if deriving.places.len() > self.product.effort.places() {
                return None;
            }
            deriving.standings(place, number);
            deriving.moves(place, number);
        }
        Some(deriving.draft.finished(start))
    }
}

impl Deriving<'_, '_, '_> {
    /// The number of the automaton's state for that.
    fn at(&mut self, place: ShownPlace) -> u32 {
        if let Some(known) = self.places.get(&place) {
            return *known;
        }
        let number = self.fresh(place.told == Some(SubsystemStanding::Down), place.failed);
        self.places.insert(place, number);
        number
    }

    fn fresh(&mut self, down: bool, failed: Failed) -> u32 {
        self.draft.add(InterfaceState { down, failed: failed != Failed::Nothing })
    }

    /// What is told by itself.
    fn standings(&mut self, place: ShownPlace, number: u32) {
        let ShownPlace { state, told, ending, failed } = place;
        let product = &*self.graph.product;
        let seen = *self.seen.entry(state).or_insert_with(|| product.seen_as_one(&self.graph.states[state as usize]));
        // Whose lateness nobody waits for is not told apart from others.
        let late = told.is_none() && self.waits_for(SubsystemStanding::Failed);
        let late = SeenStanding { late, stranded: ending, ..seen };
        // It is told once that it is not down in time, and how it stands otherwise when it is down or begun anew.
        let over = ending && told == Some(SubsystemStanding::Stranded);
        let (in_time, late) = (standing(told, seen).filter(|_| !over), standing(told, late));
        for now in in_time.into_iter().chain(late.filter(|late| in_time != Some(*late))) {
            let still = ending && now != SubsystemStanding::Down;
            let to = self.at(ShownPlace { told: Some(now), ending: still, ..place });
            let told = self.standing(now);
            self.tells(number, failed, &[told], to);
        }
    }

    /// What its moves show.
    fn moves(&mut self, place: ShownPlace, number: u32) {
        let state = place.state;
        let graph = self.graph;
        let at = &graph.states[state as usize];
        if graph.product.worlds.top(at.world).is_some() && graph.product.is_down(at) {
            // What is left is taken away by force, and it is as at the start.
            let to = self.at(ShownPlace { state: 0, ..place });
            self.draft.lead(number, InterfaceAction::Silent, to);
            return;
        }
        let mut taken: BTreeSet<EventName> = BTreeSet::new();
        for edge in graph.outgoing().of(state) {
            let by = &graph.edges[*edge as usize];
            let tells = graph.told.get(edge).cloned().unwrap_or_default();
            let names = self.brought(by);
            let next = ShownPlace { state: by.to, failed: place.failed.max(by.failed()), ..place };
            if names.is_empty() {
                let to = self.at(next);
                self.tells(number, next.failed, &tells, to);
            }
            for name in names {
                if name == self.begins && !self.parent.raises.contains(&name) {
                    // Nobody begins it.
                    continue;
                }
                let next = self.after(next, name, !by.dropped());
                let to = self.at(next);
                if !self.parent.raises.contains(&name) {
                    self.tells(number, next.failed, &tells, to);
                    continue;
                }
                taken.insert(name);
                self.takes(number, (name, !by.dropped()), next.failed, &tells, to);
            }
        }
        if graph.followed[state as usize] && at.inbox.is_empty() && at.in_transit.is_empty() {
            for name in self.parent.raises.difference(&taken).copied().collect::<Vec<_>>() {
                // Where one would take it, and so many requests wait that it was not followed, it waits as well.
                if !graph.product.defers(at, name) {
                    let next = self.after(place, name, false);
                    let to = self.at(next);
                    self.takes(number, (name, false), next.failed, &SharedList::new(), to);
                }
            }
        }
    }

    /// The event that tells how it stands: its name is looked up once.
    fn standing(&mut self, standing: SubsystemStanding) -> EventName {
        *self.standings.entry(standing).or_insert_with(|| standing.own_event())
    }

    fn waits_for(&mut self, standing: SubsystemStanding) -> bool {
        let event = self.standing(standing);
        self.hears.contains(&event)
    }

    /// Where it is when it has taken an event up there, `heeded` by a transition or not.
    fn after(&mut self, place: ShownPlace, event: EventName, heeded: bool) -> ShownPlace {
        let was_down = place.told == Some(SubsystemStanding::Down);
        let minds = self.waits_for(SubsystemStanding::Stranded);
        if event == self.begins && heeded {
            // What has failed before may have led here.
            let failed = if was_down { Failed::Nothing } else { place.failed };
            return ShownPlace { told: None, ending: false, failed, ..place };
        }
        let ends = event == self.ends && (heeded || !was_down);
        // Who ends what nobody has begun is told when that is down.
        let told = if ends && was_down { None } else { place.told };
        ShownPlace { told, ending: minds && (ends || place.ending), ..place }
    }

    /// The events of its parent, or that might as well be, that an edge brings; empty: none.
    fn brought(&self, edge: &Edge) -> Vec<EventName> {
        let (Move::Event(at) | Move::Dropped(at)) = self.graph.by(edge) else { return Vec::new() };
        self.graph.product.alike_to(at).collect()
    }

    /// It takes an event (heeded or not), and tells what comes of that.
    fn takes(
        &mut self,
        from: u32,
        (event, heeded): (EventName, bool),
        failed: Failed,
        tells: &SharedList<EventName>,
        to: u32,
    ) {
        let told_ignored = || EventName::new(&format!("{event}{IGNORED}")).ok();
        let ignored = if heeded { None } else { *self.ignored.entry(event).or_insert_with(told_ignored) };
        let tells: Vec<EventName> = ignored.into_iter().chain(tells.iter().copied()).collect();
        let taken = match tells.iter().any(|event| self.hears.contains(event)) {
            true => self.fresh(false, failed),
            false => to,
        };
        self.draft.lead(from, InterfaceAction::Takes { event, heeded }, taken);
        if taken != to {
            self.tells(taken, failed, &tells, to);
        }
    }

    /// It tells these one after the other, as far as its parent waits for them, where this has failed.
    fn tells(&mut self, from: u32, failed: Failed, events: &[EventName], to: u32) {
        let told: Vec<EventName> = events.iter().filter(|event| self.hears.contains(event)).copied().collect();
        let Some((last, before)) = told.split_last() else {
            self.draft.lead(from, InterfaceAction::Silent, to);
            return;
        };
        let mut at = from;
        for event in before {
            let next = self.fresh(false, failed);
            self.draft.lead(at, InterfaceAction::Tells(*event, failed), next);
            at = next;
        }
        self.draft.lead(at, InterfaceAction::Tells(*last, failed), to);
    }
}

impl Product<'_> {
    /// Whether a coordinator waits for an event where so many of its requests wait that what comes is not followed.
    fn defers(&self, state: &ProductState, name: EventName) -> bool {
        let waits = |number: usize| {
            let chart = self.members[number].chart;
            let event = chart.event(name);
            event != EventId::OTHER && triggers(chart, state.leaves[number]).0.contains(&event)
        };
        (0..self.members.len()).any(|number| self.is_busy(state, number) && waits(number))
    }
}
