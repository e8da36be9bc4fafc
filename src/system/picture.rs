//! A few components by themselves: what is judged by their types is judged on this, without a graph around it.

use super::View;
use super::node::{ComponentNode, Driven};
use crate::model::{Catalogue, ComponentName, ComponentType, MemberRef, Policy};
use smallvec::SmallVec;
use std::sync::Arc;

/// Components of these types, unconfigured, without connections, without values: none that says what a property holds.
#[derive(Debug, Clone)]
pub struct Picture<'t> {
    types: &'t Catalogue,
    nodes: SmallVec<[ComponentNode; 2]>,
}

impl<'t> Picture<'t> {
    /// One without components.
    pub fn new(types: &'t Catalogue) -> Self {
        Self { types, nodes: SmallVec::new() }
    }

    /// Adds a component; its name is free.
    pub fn add(&mut self, name: ComponentName, ty: Arc<ComponentType>) {
        self.nodes.push(ComponentNode::new(name, ty, None, Vec::new()));
    }
}

impl View for Picture<'_> {
    fn types(&self) -> &Catalogue {
        self.types
    }

    fn component(&self, name: ComponentName) -> Option<&ComponentNode> {
        self.nodes.iter().find(|node| node.name == name)
    }

    fn link(&self, _: MemberRef, _: MemberRef) -> Option<Policy> {
        None
    }

    fn driven(&self, _: MemberRef) -> Driven {
        Driven::default()
    }

    fn for_each_component(&self, f: &mut dyn FnMut(&ComponentNode)) {
        self.nodes.iter().for_each(f);
    }

    fn for_each_link(&self, _: &mut dyn FnMut(MemberRef, MemberRef, Policy)) {}
}
