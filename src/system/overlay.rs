//! Changes laid over a system that stays as it is: what planning simulates on. Costs memory and time for what was
//! touched, nothing for the rest.

use super::node::{ComponentNode, Driven};
use super::system_graph::snapshot_of;
use super::{System, View, ViewMut};
use crate::model::{Catalogue, ComponentName, MemberRef, Policy, Snapshot};
use rustc_hash::FxHashMap;

/// A system with changes laid over it.
#[derive(Debug, Clone)]
pub struct Overlay<'a> {
    base: &'a System,
    /// Touched components: their place in `arena`, or none when removed.
    nodes: FxHashMap<ComponentName, Option<u32>>,
    arena: Vec<ComponentNode>,
    /// Connections that differ from the base (none: removed); `link_order` has every key once, in order of first touch.
    links: FxHashMap<(MemberRef, MemberRef), Option<Policy>>,
    link_order: Vec<(MemberRef, MemberRef)>,
    driven: FxHashMap<MemberRef, Driven>,
}

impl<'a> Overlay<'a> {
    /// No changes yet.
    pub fn new(base: &'a System) -> Self {
        Self {
            base,
            nodes: FxHashMap::default(),
            arena: Vec::new(),
            links: FxHashMap::default(),
            link_order: Vec::new(),
            driven: FxHashMap::default(),
        }
    }

    /// Takes memory for so many touched components and connections beforehand.
    pub fn reserve(&mut self, components: usize, links: usize) {
        self.nodes.reserve(components);
        self.arena.reserve(components);
        self.links.reserve(links);
        self.link_order.reserve(links);
        self.driven.reserve(links);
    }

    /// The system with the changes, as it is observed.
    #[cfg(any(test, feature = "internals"))]
    pub fn snapshot(&self) -> Snapshot {
        snapshot_of(self)
    }

    /// Whether `other`, over the same base, shows the same system. Looks only at what either touched.
    pub fn same(&self, other: &Overlay<'_>) -> bool {
        let node = |name: &ComponentName| match (self.component(*name), other.component(*name)) {
            (None, None) => true,
            (Some(a), Some(b)) => a.same(b),
            _ => false,
        };
        let link = |&(from, to): &(MemberRef, MemberRef)| self.link(from, to) == other.link(from, to);
        self.nodes.keys().all(node)
            && other.nodes.keys().all(node)
            && self.link_order.iter().all(link)
            && other.link_order.iter().all(link)
    }

    fn place(&mut self, node: ComponentNode) -> u32 {
        let at = u32::try_from(self.arena.len()).expect("fewer components than that");
        self.nodes.insert(node.name, Some(at));
        self.arena.push(node);
        at
    }

    fn drive(&mut self, to: MemberRef) -> &mut Driven {
        let base = self.base;
        self.driven.entry(to).or_insert_with(|| base.driven(to))
    }

    fn put_link(&mut self, key: (MemberRef, MemberRef), policy: Option<Policy>) {
        if self.links.insert(key, policy).is_none() {
            self.link_order.push(key);
        }
    }
}

impl View for Overlay<'_> {
    fn types(&self) -> &Catalogue {
        self.base.types()
    }

    fn component(&self, name: ComponentName) -> Option<&ComponentNode> {
        match self.nodes.get(&name) {
            Some(at) => at.map(|at| &self.arena[at as usize]),
            None => self.base.component(name),
        }
    }

    fn link(&self, from: MemberRef, to: MemberRef) -> Option<Policy> {
        match self.links.get(&(from, to)) {
            Some(policy) => *policy,
            None => self.base.link(from, to),
        }
    }

    fn driven(&self, port: MemberRef) -> Driven {
        self.driven.get(&port).copied().unwrap_or_else(|| self.base.driven(port))
    }

    fn for_each_component(&self, f: &mut dyn FnMut(&ComponentNode)) {
        self.base.for_each_component(&mut |node| {
            if !self.nodes.contains_key(&node.name) {
                f(node);
            }
        });
        for (i, node) in self.arena.iter().enumerate() {
            // Places of removed and replaced components stay behind in the arena.
            if self.nodes.get(&node.name) == Some(&u32::try_from(i).ok()) {
                f(node);
            }
        }
    }

    fn for_each_link(&self, f: &mut dyn FnMut(MemberRef, MemberRef, Policy)) {
        self.base.for_each_link(&mut |from, to, policy| {
            if !self.links.contains_key(&(from, to)) {
                f(from, to, policy);
            }
        });
        for key in &self.link_order {
            if let Some(Some(policy)) = self.links.get(key) {
                f(key.0, key.1, *policy);
            }
        }
    }
}

impl ViewMut for Overlay<'_> {
    fn touch(&mut self, name: ComponentName) -> &mut ComponentNode {
        let at = match self.nodes.get(&name) {
            Some(Some(at)) => *at,
            _ => {
                let node = self.base.component(name).expect("a step touches components that exist").clone();
                self.place(node)
            }
        };
        let node = &mut self.arena[at as usize];
        node.generation += 1;
        node
    }

    fn insert_component(&mut self, node: ComponentNode) {
        self.place(node);
    }

    fn remove_component(&mut self, name: ComponentName) {
        self.nodes.insert(name, None);
    }

    fn insert_link(&mut self, from: MemberRef, to: MemberRef, policy: Policy) {
        self.each_end(from, to, |node| node.degree += 1);
        let driven = self.drive(to);
        driven.links += 1;
        driven.data += u32::from(policy == Policy::Data);
        self.put_link((from, to), Some(policy));
    }

    fn remove_link(&mut self, from: MemberRef, to: MemberRef) {
        let Some(policy) = self.link(from, to) else { return };
        self.each_end(from, to, |node| node.degree -= 1);
        let driven = self.drive(to);
        driven.links -= 1;
        driven.data -= u32::from(policy == Policy::Data);
        self.put_link((from, to), None);
    }
}
