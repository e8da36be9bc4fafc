//! The picture of a system: components as nodes and connections as edges of a directed graph, with indices that answer
//! every question of a step's precondition without a search.

use super::node::{ComponentNode, Driven, Link};
use super::{View, ViewMut};
use crate::model::{Catalogue, ComponentName, MemberRef, Policy, RunState, Snapshot, TypeName, Value};
use petgraph::stable_graph::{EdgeIndex, NodeIndex, StableDiGraph};
use petgraph::visit::{EdgeRef, IntoEdgeReferences};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// A system, as far as it is known.
#[derive(Debug, Clone)]
pub struct System {
    types: Arc<Catalogue>,
    /// Shared with the pictures that were copied from it, until one of them changes: whoever tries something on a copy, or keeps
    /// thousands of them, pays for those that differ.
    there: Arc<There>,
    revision: u64,
}

/// What is there.
#[derive(Debug, Clone, Default)]
struct There {
    /// Each component by itself is shared as well.
    graph: StableDiGraph<Arc<ComponentNode>, Link>,
    names: FxHashMap<ComponentName, NodeIndex>,
    links: FxHashMap<(MemberRef, MemberRef), EdgeIndex>,
    driven: FxHashMap<MemberRef, Driven>,
}

/// A snapshot names a component type that the catalogue does not have.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("component `{component}` is of type `{ty}`, which is not in the catalogue")]
pub struct UnknownType {
    /// The component.
    pub component: ComponentName,
    /// Its type.
    pub ty: TypeName,
}

impl System {
    /// A system without components.
    pub fn new(types: Arc<Catalogue>) -> Self {
        Self { types, there: Arc::default(), revision: 0 }
    }

    /// The system that a platform reports. Members the type does not have are left out; properties it does have and the
    /// snapshot lacks take their default.
    ///
    /// # Errors
    /// [`UnknownType`] for the first component whose type is not in the catalogue.
    pub fn from_snapshot(snapshot: &Snapshot, types: Arc<Catalogue>) -> Result<Self, UnknownType> {
        let mut system = Self::new(types);
        for (name, component) in &snapshot.components {
            let ty =
                system.types.get(component.ty).cloned().ok_or(UnknownType { component: *name, ty: component.ty })?;
            let properties = ty
                .properties
                .iter()
                .map(|(property, declared)| {
                    component
                        .properties
                        .get(property)
                        .or(declared.default.as_ref())
                        .cloned()
                        .unwrap_or(Value::Bool(false))
                })
                .collect();
            let mut node = ComponentNode::new(*name, ty, component.activity, properties);
            node.state = component.state;
            system.insert_component(node);
        }
        for ((from, to), policy) in &snapshot.connections {
            if system.there.names.contains_key(&from.component) && system.there.names.contains_key(&to.component) {
                system.insert_link(*from, *to, *policy);
            }
        }
        for (port, value) in &snapshot.ports {
            if let Some(index) = system.component(port.component).and_then(|n| n.port(port.member)).map(|(i, _)| i) {
                system.put_port(port.component, index, Some(value));
            }
        }
        Ok(system)
    }

    /// The system as it is observed.
    pub fn snapshot(&self) -> Snapshot {
        snapshot_of(self)
    }

    /// The catalogue it was made with.
    pub fn catalogue(&self) -> &Arc<Catalogue> {
        &self.types
    }

    /// Takes over what was observed of some components (those that are not in `seen` are not there), with the connections
    /// that begin or end at them. Answers whether anything was otherwise.
    ///
    /// # Errors
    /// [`UnknownType`] for a component whose type is not in the catalogue; nothing has changed then.
    pub fn adopt(&mut self, names: &[ComponentName], seen: &Snapshot) -> Result<bool, UnknownType> {
        let mut types = Vec::with_capacity(names.len());
        for name in names {
            types.push(match seen.components.get(name) {
                None => None,
                Some(component) => Some(
                    self.types.get(component.ty).cloned().ok_or(UnknownType { component: *name, ty: component.ty })?,
                ),
            });
        }
        let mut changed = false;
        // Connections first: a component that goes has none.
        let set: rustc_hash::FxHashSet<ComponentName> = names.iter().copied().collect();
        let concerns = |from: &MemberRef, to: &MemberRef| set.contains(&from.component) || set.contains(&to.component);
        let gone: Vec<(MemberRef, MemberRef)> = self
            .there
            .links
            .iter()
            .filter(|((from, to), edge)| {
                concerns(from, to) && seen.connections.get(&(*from, *to)) != Some(&self.there.graph[**edge].policy)
            })
            .map(|(ends, _)| *ends)
            .collect();
        for (from, to) in gone {
            self.remove_link(from, to);
            changed = true;
        }
        for (name, ty) in names.iter().zip(types) {
            changed |= self.adopt_one(*name, ty, seen);
        }
        for ((from, to), policy) in seen.connections.iter().filter(|((from, to), _)| concerns(from, to)) {
            let known = self.there.names.contains_key(&from.component) && self.there.names.contains_key(&to.component);
            if known && !self.there.links.contains_key(&(*from, *to)) {
                self.insert_link(*from, *to, *policy);
                changed = true;
            }
        }
        Ok(changed)
    }

    fn adopt_one(
        &mut self,
        name: ComponentName,
        ty: Option<Arc<crate::model::ComponentType>>,
        seen: &Snapshot,
    ) -> bool {
        let (Some(ty), Some(component)) = (ty, seen.components.get(&name)) else {
            let there = self.there.names.contains_key(&name);
            if there {
                self.remove_with_links(name);
            }
            return there;
        };
        let present = self.component(name);
        let another = present.is_none_or(|node| node.ty.name != component.ty || node.activity != component.activity);
        if another {
            if present.is_some() {
                self.remove_with_links(name);
            }
            let values = ty.properties.values().map(|declared| declared.default.clone().unwrap_or(Value::Bool(false)));
            let values = values.collect();
            self.insert_component(ComponentNode::new(name, ty.clone(), component.activity, values));
        }
        let mut changed = another;
        if self.component(name).is_some_and(|node| node.state != component.state) {
            self.put_state(name, component.state);
            changed = true;
        }
        for (index, property) in ty.properties.keys().enumerate() {
            let (Some(value), Some(node)) = (component.properties.get(property), self.component(name)) else {
                continue;
            };
            if node.properties.get(index) != Some(value) {
                self.put_property(name, index, value);
                changed = true;
            }
        }
        for (index, port) in ty.ports.keys().enumerate() {
            let value = seen.ports.get(&name.member(*port));
            if self.component(name).is_some_and(|node| node.written(index) != value) {
                self.put_port(name, index, value);
                changed = true;
            }
        }
        changed
    }

    fn remove_with_links(&mut self, name: ComponentName) {
        let of_it = |(a, b): &&(MemberRef, MemberRef)| a.component == name || b.component == name;
        let ends: Vec<_> = self.there.links.keys().filter(of_it).copied().collect();
        ends.into_iter().for_each(|(from, to)| self.remove_link(from, to));
        self.remove_component(name);
    }

    /// Some of its components as they are observed, with the connections that begin or end at them.
    pub fn snapshot_some(&self, names: &[ComponentName]) -> Snapshot {
        let set: rustc_hash::FxHashSet<ComponentName> = names.iter().copied().collect();
        let mut snapshot = Snapshot::default();
        for node in names.iter().filter_map(|name| self.component(*name)) {
            snapshot.components.insert(node.name, node.snapshot());
            for (port, value) in node.written_ports() {
                snapshot.ports.insert(node.name.member(port), value.clone());
            }
        }
        for ((from, to), edge) in &self.there.links {
            if set.contains(&from.component) || set.contains(&to.component) {
                snapshot.connections.insert((*from, *to), self.there.graph[*edge].policy);
            }
        }
        snapshot
    }

    /// A number that every change raises. A plan is valid for the revision it was made from.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// How many components there are.
    pub fn len(&self) -> usize {
        self.there.graph.node_count()
    }

    /// Whether there is no component.
    pub fn is_empty(&self) -> bool {
        self.there.graph.node_count() == 0
    }

    /// The graph: components, and connections from the out-port's component to the in-port's.
    pub fn graph(&self) -> &StableDiGraph<Arc<ComponentNode>, Link> {
        &self.there.graph
    }

    /// The handle of a component, valid as long as it exists.
    pub fn index_of(&self, name: ComponentName) -> Option<NodeIndex> {
        self.there.names.get(&name).copied()
    }

    /// Records a run state that a component took by itself, as when it became faulted. False: there is no such component.
    pub fn set_state(&mut self, component: ComponentName, state: RunState) -> bool {
        let known = self.there.names.contains_key(&component);
        if known {
            self.put_state(component, state);
        }
        known
    }

    /// The component behind a handle.
    pub fn node_at(&self, index: NodeIndex) -> Option<&ComponentNode> {
        self.there.graph.node_weight(index).map(AsRef::as_ref)
    }

    fn change(&mut self) -> &mut There {
        Arc::make_mut(&mut self.there)
    }

    /// Takes what is there from another picture of the same, so that both share it.
    pub fn share_with(&mut self, other: &Self) {
        self.there = other.there.clone();
        self.revision = other.revision;
    }

    pub(super) fn touch_at(&mut self, index: NodeIndex) -> Option<&mut ComponentNode> {
        self.revision += 1;
        let node = Arc::make_mut(&mut self.there).graph.node_weight_mut(index).map(Arc::make_mut)?;
        node.generation = self.revision;
        Some(node)
    }
}

impl View for System {
    fn types(&self) -> &Catalogue {
        &self.types
    }

    fn component(&self, name: ComponentName) -> Option<&ComponentNode> {
        self.there.names.get(&name).map(|i| &*self.there.graph[*i])
    }

    fn link(&self, from: MemberRef, to: MemberRef) -> Option<Policy> {
        self.there.links.get(&(from, to)).map(|e| self.there.graph[*e].policy)
    }

    fn driven(&self, port: MemberRef) -> Driven {
        self.there.driven.get(&port).copied().unwrap_or_default()
    }

    fn for_each_component(&self, f: &mut dyn FnMut(&ComponentNode)) {
        self.there.graph.node_weights().for_each(|node| f(node));
    }

    fn for_each_link(&self, f: &mut dyn FnMut(MemberRef, MemberRef, Policy)) {
        for edge in self.there.graph.edge_references() {
            let link = edge.weight();
            let from = self.there.graph[edge.source()].name.member(link.from);
            f(from, self.there.graph[edge.target()].name.member(link.to), link.policy);
        }
    }
}

impl ViewMut for System {
    fn touch(&mut self, name: ComponentName) -> &mut ComponentNode {
        self.touch_at(self.there.names[&name]).expect("names and nodes agree")
    }

    fn insert_component(&mut self, mut node: ComponentNode) {
        self.revision += 1;
        node.born = self.revision;
        node.generation = self.revision;
        let name = node.name;
        let index = self.change().graph.add_node(Arc::new(node));
        self.change().names.insert(name, index);
    }

    fn remove_component(&mut self, name: ComponentName) {
        self.revision += 1;
        if let Some(index) = self.change().names.remove(&name) {
            self.change().graph.remove_node(index);
        }
    }

    fn insert_link(&mut self, from: MemberRef, to: MemberRef, policy: Policy) {
        self.each_end(from, to, |node| node.degree += 1);
        let (a, b) = (self.there.names[&from.component], self.there.names[&to.component]);
        let edge = self.change().graph.add_edge(a, b, Link { from: from.member, to: to.member, policy });
        self.change().links.insert((from, to), edge);
        let driven = self.change().driven.entry(to).or_default();
        driven.links += 1;
        driven.data += u32::from(policy == Policy::Data);
    }

    fn remove_link(&mut self, from: MemberRef, to: MemberRef) {
        let Some(edge) = self.change().links.remove(&(from, to)) else { return };
        self.each_end(from, to, |node| node.degree -= 1);
        let data = self.change().graph.remove_edge(edge).is_some_and(|link| link.policy == Policy::Data);
        let ports = &mut self.change().driven;
        if let Some(driven) = ports.get_mut(&to) {
            driven.links -= 1;
            driven.data -= u32::from(data);
            if driven.links == 0 {
                ports.remove(&to);
            }
        }
    }
}

/// Any view as it is observed.
pub(super) fn snapshot_of(view: &impl View) -> Snapshot {
    let mut snapshot = Snapshot::default();
    view.for_each_component(&mut |node| {
        snapshot.components.insert(node.name, node.snapshot());
        for (port, value) in node.written_ports() {
            snapshot.ports.insert(node.name.member(port), value.clone());
        }
    });
    view.for_each_link(&mut |from, to, policy| {
        snapshot.connections.insert((from, to), policy);
    });
    snapshot
}
