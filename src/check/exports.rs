//! What a deployment exports is there while that is promised: it takes nothing away before its parent has let go, makes nothing anew
//! meanwhile, and passes on nothing of a subsystem that does not promise that itself.

use super::coordinator::ask_of;
use super::explore::Graph;
use super::judge::{Traced, severity_of};
use super::state::{Failed, Move, ProductState};
use super::systems::SystemId;
use crate::model::codes::COMPOSE_UNLEFT;
use crate::model::{Ask, ChangeKind, ComponentName, ConfigId, Configuration, Finding, Origin, SubsystemStanding};
use crate::stack::claims;
use crate::statechart::{EventId, NodeId};
use crate::system::View;
use rustc_hash::{FxHashMap, FxHashSet};

impl Graph<'_, '_> {
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
        let passed_on = |path| interface.exports.values().any(|export| export.of.component.local(path).is_some());
        let passed_on: Vec<usize> =
            (0..self.product.children.len()).filter(|at| passed_on(self.product.children[*at].path)).collect();
        if exported.is_empty() && passed_on.is_empty() {
            return;
        }
        let promised = self.promised();
        self.remade(&promised, &exported, found);
        self.passed_on(&promised, &passed_on, found);
        self.taken_away(promised, &exported, found);
    }

    /// Something exported is not there while it is promised.
    fn taken_away(&mut self, promised: Vec<u32>, exported: &[ComponentName], found: &mut Traced) {
        let mut lacking = Vec::new();
        // Thousands of worlds have some hundred systems.
        let mut lacks: FxHashMap<SystemId, bool> = FxHashMap::default();
        for at in promised {
            let state = &self.states[at as usize];
            let Some(world) = self.product.worlds.get(state.world) else { continue };
            let of = || {
                let mut there = 0;
                world.system.for_each_component(&mut |node| there += usize::from(exported.contains(&node.name)));
                there < exported.len()
            };
            if *lacks.entry(self.product.worlds.system(state.world)).or_insert_with(of) {
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
        let (from, until) = self.span();
        let message = format!("`{gone}`, which is exported, is not there between `{from}` and `{until}`");
        let finding = Finding::error(COMPOSE_UNLEFT, message)
            .at(self.exported_at(*gone))
            .path("exports")
            .help(format!("create it before `{from}`, and take it away only when `{until}` was heard"));
        let trace = self.trace(at);
        found.push((finding, trace));
    }

    /// Something exported is taken away and made anew while it is promised, which its parent is connected to.
    fn remade(&mut self, promised: &[u32], exported: &[ComponentName], found: &mut Traced) {
        let deployment = self.product.deployment;
        let remakes = |of: &Configuration| {
            of.changes.iter().find_map(|change| match change.kind {
                ChangeKind::Destroy { component } | ChangeKind::Replace { component, .. }
                    if exported.contains(&component) =>
                {
                    Some((of.id, component, change.origin))
                }
                _ => None,
            })
        };
        let remake: FxHashMap<ConfigId, (ConfigId, ComponentName, Origin)> =
            deployment.configurations.iter().filter_map(|of| Some((of.id, remakes(of)?))).collect();
        if remake.is_empty() {
            return;
        }
        let remakes = |id: &ConfigId| remake.get(id).copied();
        let mut some: FxHashMap<ConfigId, (ComponentName, Origin, Vec<u32>)> = FxHashMap::default();
        for at in promised {
            let state = &self.states[*at as usize];
            let world = self.product.worlds.get(state.world);
            let asks = state.desk.under_way().iter().flat_map(|active| &active.batch.requests).chain(state.safe.iter());
            for request in asks {
                let of = match request.ask {
                    Ask::Apply(id) | Ask::UndoOf(id) => remakes(&id),
                    ask if ask.is_undo() => world.and_then(|world| {
                        let mut frames = world.stack.frames().iter();
                        let newest = frames.rfind(|frame| frame.requester == request.requester);
                        newest.and_then(|frame| remakes(&frame.configuration))
                    }),
                    _ => None,
                };
                if let Some((id, component, origin)) = of {
                    some.entry(id).or_insert((component, origin, Vec::new())).2.push(*at);
                }
            }
        }
        let mut all: Vec<_> = some.into_iter().collect();
        all.sort_by_key(|(id, _)| id.as_str());
        let (from, until) = self.span();
        for (id, (component, origin, states)) in all {
            let Some(at) = self.best_first(states).first().copied() else { continue };
            let message = format!(
                "`{id}` takes `{component}`, which is exported, away and makes it anew between `{from}` and `{until}`"
            );
            let finding = Finding::error(COMPOSE_UNLEFT, message)
                .at(origin)
                .also(self.exported_at(component), "exported here")
                .path(format!("configurations.{id}"))
                .help(format!("ask for it before `{from}`, or when `{until}` was heard"));
            let trace = self.trace(at);
            found.push((finding, trace));
        }
    }

    /// What is passed on of a subsystem is promised though the subsystem does not promise it.
    fn passed_on(&mut self, promised: &[u32], children: &[usize], found: &mut Traced) {
        for number in children {
            let lacks = |at: &&u32| {
                let broken = self.failed[**at as usize] == Failed::Broken;
                !broken && !self.product.is_promised(&self.states[**at as usize], *number)
            };
            let lacking: Vec<u32> = promised.iter().filter(lacks).copied().collect();
            let Some(at) = self.best_first(lacking).first().copied() else { continue };
            let (from, until) = self.span();
            let child = &self.product.children[*number];
            let (path, begun, ended) = (child.path, child.from, child.until);
            let message = format!(
                "what is exported of `{path}` need not be there between `{from}` and `{until}`, where it is promised"
            );
            let mut exports = self.product.deployment.interface.exports.values();
            let export = exports.find(|export| export.of.component.local(path).is_some());
            let finding = Finding::new(severity_of(self.failed[at as usize]), COMPOSE_UNLEFT, message)
                .at(export.map(|export| export.origin).unwrap_or_default())
                .path("exports")
                .help(format!("wait for `{begun}` before `{from}`, and raise `{ended}` only when `{until}` was heard"));
            let trace = self.trace(at);
            found.push((finding, trace));
        }
    }

    /// From when on and until when it is promised.
    fn span(&self) -> (String, String) {
        let deployment = self.product.deployment;
        let interface = &deployment.interface;
        let until = interface.leaving.map_or(deployment.shutdown.event, |leaving| leaving.until);
        let from = interface.from.map(|(event, _)| event.to_string());
        (from.unwrap_or_else(|| SubsystemStanding::Up.word().to_owned()), until.to_string())
    }

    /// Where something of a component is exported.
    fn exported_at(&self, component: ComponentName) -> Origin {
        let mut exports = self.product.deployment.interface.exports.values();
        exports.find(|export| export.of.component == component).map(|export| export.origin).unwrap_or_default()
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
                let leaves: FxHashSet<NodeId> = self.reached.states.iter().map(|state| state.leaves[number]).collect();
                for leaf in leaves {
                    let timed: Vec<EventId> = member.offers(leaf).iter().copied().collect();
                    for event in events.iter().chain(&timed) {
                        let reaction = member.react(leaf, *event);
                        if reaction.emits(from) {
                            emits.entry(number).or_default().insert((leaf.index(), reaction.leaf.index()));
                        }
                    }
                }
            }
        }
        // Most edges lead to states to which others lead as well.
        let is_up = |state: &ProductState| state.is_at_rest() && self.product.all_in(state, |member| member.up);
        let up: Vec<bool> = self.states.iter().map(is_up).collect();
        let says = |graph: &Self, before: u32, after: u32| {
            up[after as usize]
                || !emits.is_empty() && {
                    let (before, after) = (&graph.states[before as usize], &graph.states[after as usize]);
                    let pair = |number: usize| (before.leaves[number].index(), after.leaves[number].index());
                    emits.iter().any(|(number, pairs)| pairs.contains(&pair(*number)))
                }
        };
        let ends = |graph: &Self, by: Move| match by {
            Move::Event(at) => graph.product.outside[usize::from(at)] == until,
            Move::Taken(number, event) => graph.product.members[usize::from(number)].name_of(event) == Some(until),
            _ => false,
        };
        let mut met = vec![false; self.states.len()];
        let mut open: Vec<u32> = Vec::new();
        for edge in self.edges.iter() {
            if !met[edge.to as usize] && says(self, edge.from, edge.to) && !ends(self, self.by(edge)) {
                met[edge.to as usize] = true;
                open.push(edge.to);
            }
        }
        while let Some(at) = open.pop() {
            for edge in self.outgoing().of(at) {
                let edge = &self.edges[*edge as usize];
                if !met[edge.to as usize] && !ends(self, self.by(edge)) {
                    met[edge.to as usize] = true;
                    open.push(edge.to);
                }
            }
        }
        (0u32..).zip(met).filter(|(_, met)| *met).map(|(at, _)| at).collect()
    }
}
