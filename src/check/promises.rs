//! What a subsystem exports is there while that is promised: from the event that says so until its parent has let go. Both sides are held
//! to it. The parent asks for what touches it only then, and holds no frame of it any more when the promise ends; the file of the subsystem
//! takes nothing away before.

use super::children::{Child, begun, promised};
use super::coordinator::ask_of;
use super::explore::Graph;
use super::judge::{Traced, severity_of};
use super::product::Product;
use super::state::{Failed, Move, ProductState};
use crate::model::codes::{COMPOSE_PROMISE, COMPOSE_UNLEFT};
use crate::model::{Ask, ComponentName, ConfigId, EventName, Finding, SubsystemStanding};
use crate::stack::claims;
use crate::statechart::{EventId, NodeId};
use crate::system::View;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::VecDeque;

impl Product<'_> {
    /// A coordinator hears an event: it may tell how a subsystem stands.
    pub(super) fn hears_of_child(&self, state: &mut ProductState, number: usize, event: EventId) {
        if self.children.is_empty() {
            return;
        }
        let Some(name) = self.members[number].name_of(event) else { return };
        for (at, child) in self.children.iter().enumerate() {
            if name == child.from || name == child.up {
                state.children |= promised(at);
            } else if name == child.down {
                state.children &= !(promised(at) | begun(at));
            }
        }
    }

    /// A coordinator raises an event: it may be for a subsystem.
    pub(super) fn tells_child(&self, state: &mut ProductState, name: EventName) {
        for (at, child) in self.children.iter().enumerate() {
            if name == child.begins {
                state.children |= begun(at);
            } else if name == child.until {
                state.children &= !promised(at);
            }
        }
    }

    /// Whether an event is one of a subsystem that cannot tell anything: nobody has begun it.
    pub(super) fn is_silent(&self, state: &ProductState, name: EventName) -> bool {
        let mut children = self.children.iter().enumerate();
        let told =
            |child: &Child| name.local(child.path).is_some_and(|own| !own.ends_with(crate::model::subsystem::IGNORED));
        children.any(|(at, child)| told(child) && state.children & begun(at) == 0)
    }

    /// Whether a subsystem tells an event.
    pub(super) fn is_told_by_child(&self, name: EventName) -> bool {
        self.children.iter().any(|child| name.local(child.path).is_some())
    }

    /// Whether every subsystem is known to be down.
    pub(super) fn children_down(&self, state: &ProductState) -> bool {
        (0..self.children.len()).all(|at| state.children & begun(at) == 0)
    }

    /// What is asked for or in force of what a subsystem exports though that need not be there, and of which subsystem.
    fn unpromised(&self, state: &ProductState) -> Option<(ConfigId, bool, usize)> {
        for (at, child) in self.children.iter().enumerate() {
            if state.children & promised(at) != 0 || child.touching.is_empty() {
                continue;
            }
            let touches = |id: &ConfigId| child.touching.contains(id);
            let asks = state.desk.under_way().iter().flat_map(|active| &active.batch.requests);
            let asks = asks.chain(state.safe.iter()).filter_map(|request| match request.ask {
                Ask::Apply(id) => Some(id),
                _ => None,
            });
            let held = self.worlds.get(state.world).into_iter().flat_map(|world| world.stack.frames());
            let held = held.map(|frame| (frame.configuration, true));
            if let Some((id, held)) = asks.map(|id| (id, false)).chain(held).find(|(id, _)| touches(id)) {
                return Some((id, held, at));
            }
        }
        None
    }
}

impl Graph<'_, '_> {
    /// A parent keeps to what it is promised.
    pub(super) fn promises(&mut self, found: &mut Traced) {
        if self.product.children.is_empty() {
            return;
        }
        let mut some: FxHashMap<(ConfigId, usize), Vec<u32>> = FxHashMap::default();
        let mut how: FxHashMap<(ConfigId, usize), bool> = FxHashMap::default();
        for (at, state) in (0u32..).zip(&self.states) {
            if self.failed[at as usize] == Failed::Broken {
                continue;
            }
            if let Some((id, held, child)) = self.product.unpromised(state) {
                some.entry((id, child)).or_default().push(at);
                how.entry((id, child)).or_insert(held);
            }
        }
        let mut all: Vec<_> = some.into_iter().collect();
        all.sort_by_key(|((id, child), _)| (id.as_str(), *child));
        for ((id, child), states) in all {
            let Some(at) = self.best_first(states).first().copied() else { continue };
            let of = &self.product.children[child];
            let message = match how[&(id, child)] {
                true => format!("`{id}` is in force where `{}` need not be there any more, or not yet", of.path),
                false => format!("`{id}` is asked for where what `{}` exports need not be there", of.path),
            };
            let help = format!(
                "ask for it when `{}` was heard, and undo it, and wait for that, before `{}` is raised",
                of.from, of.until
            );
            let place = self.product.worlds.configuration(id).map(|c| c.origin).unwrap_or_default();
            let severity = severity_of(self.failed[at as usize]);
            let finding =
                Finding::new(severity, COMPOSE_PROMISE, message).at(place).path(format!("configurations.{id}"));
            let trace = self.trace(at);
            found.push((finding.help(help), trace));
        }
    }

    /// A subsystem takes nothing away that it has promised.
    pub(super) fn exports_stay(&mut self, found: &mut Traced) {
        let deployment = self.product.deployment;
        let interface = &deployment.interface;
        let exported: FxHashSet<ComponentName> = interface.exports.values().map(|export| export.of.component).collect();
        let exported: Vec<ComponentName> =
            exported.into_iter().filter(|name| deployment.path_of(name.as_str()).is_none()).collect();
        // Those of which these coordinators know.
        let known: FxHashSet<ComponentName> = self
            .product
            .members
            .iter()
            .flat_map(|member| member.chart.raises())
            .filter_map(|site| match ask_of(deployment, site.name) {
                Some(Ask::Apply(id)) => deployment.configuration(id),
                _ => None,
            })
            .flat_map(claims::components)
            .collect();
        let exported: Vec<ComponentName> = exported.into_iter().filter(|name| known.contains(name)).collect();
        if exported.is_empty() {
            return;
        }
        let promised = self.promised();
        let mut lacking = Vec::new();
        for at in promised {
            let state = &self.states[at as usize];
            let Some(world) = self.product.worlds.get(state.world) else { continue };
            let mut there = 0;
            world.system.for_each_component(&mut |node| there += usize::from(exported.contains(&node.name)));
            if there < exported.len() {
                lacking.push(at);
            }
        }
        let Some(at) = self.best_first(lacking).first().copied() else { return };
        let state = &self.states[at as usize];
        let Some(world) = self.product.worlds.get(state.world) else { return };
        let mut there = FxHashSet::default();
        world.system.for_each_component(&mut |node| _ = there.insert(node.name));
        let gone = exported.iter().filter(|name| !there.contains(*name)).min_by_key(|name| name.as_str());
        let Some(gone) = gone else { return };
        let until = interface.leaving.map_or(deployment.shutdown.event, |leaving| leaving.until);
        let from =
            interface.from.map_or_else(|| SubsystemStanding::Up.word().to_owned(), |(event, _)| event.to_string());
        let message = format!("`{gone}`, which is exported, is not there between `{from}` and `{until}`");
        let export = interface.exports.values().find(|export| export.of.component == *gone);
        let finding = Finding::error(COMPOSE_UNLEFT, message)
            .at(export.map(|export| export.origin).unwrap_or_default())
            .path("exports")
            .help(format!("create it before `{from}`, and take it away only when `{until}` was heard"));
        let trace = self.trace(at);
        found.push((finding, trace));
    }

    /// The states in which what is exported has to be there.
    fn promised(&mut self) -> Vec<u32> {
        let deployment = self.product.deployment;
        let interface = &deployment.interface;
        let until = interface.leaving.map_or(deployment.shutdown.event, |leaving| leaving.until);
        let from = interface.from.map(|(event, _)| event);
        // Between which leaves the event is emitted.
        let mut emits: FxHashMap<usize, FxHashSet<(usize, usize)>> = FxHashMap::default();
        if let Some(from) = from {
            for number in 0..self.product.members.len() {
                let member = &mut self.product.members[number];
                let chart = member.chart;
                let events: Vec<EventId> = chart.events().iter().map(|event| chart.event(*event)).collect();
                let leaves: FxHashSet<NodeId> = self.states.iter().map(|state| state.leaves[number]).collect();
                for leaf in leaves {
                    let timed: Vec<EventId> = member.offers(leaf).iter().copied().collect();
                    for event in events.iter().chain(&timed) {
                        let reaction = member.react(leaf, *event);
                        if reaction.emitted.contains(&from) {
                            emits.entry(number).or_default().insert((leaf.index(), reaction.leaf.index()));
                        }
                    }
                }
            }
        }
        let says = |graph: &Self, before: u32, after: u32| {
            let (before, after) = (&graph.states[before as usize], &graph.states[after as usize]);
            let pair = |number: usize| (before.leaves[number].index(), after.leaves[number].index());
            emits.iter().any(|(number, pairs)| pairs.contains(&pair(*number)))
                || after.is_at_rest() && graph.product.all_in(after, |member| member.up)
        };
        let ends = |graph: &Self, by: Move| match by {
            Move::Event(at) => graph.product.outside[usize::from(at)] == until,
            Move::Taken(number, event) => graph.product.members[usize::from(number)].name_of(event) == Some(until),
            _ => false,
        };
        let mut met: FxHashSet<u32> = FxHashSet::default();
        let mut open: VecDeque<u32> = VecDeque::new();
        for edge in &self.edges {
            if says(self, edge.from, edge.to) && !ends(self, self.by(edge)) && met.insert(edge.to) {
                open.push_back(edge.to);
            }
        }
        while let Some(at) = open.pop_front() {
            for edge in self.outgoing().of(at) {
                let edge = &self.edges[*edge as usize];
                if !ends(self, self.by(edge)) && met.insert(edge.to) {
                    open.push_back(edge.to);
                }
            }
        }
        let mut all: Vec<u32> = met.into_iter().collect();
        all.sort_unstable();
        all
    }
}
