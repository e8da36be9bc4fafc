//! Components and connections as a system holds them.

use crate::model::{
    ComponentName, ComponentSnapshot, ComponentType, Ident, Policy, PortType, PropertyType, RunState, Value,
};
use std::sync::Arc;

/// A component.
#[derive(Debug, Clone)]
pub struct ComponentNode {
    /// Its name.
    pub name: ComponentName,
    /// Its type.
    pub ty: Arc<ComponentType>,
    /// Its run state.
    pub state: RunState,
    /// The value of every property, in the type's (alphabetical) order.
    pub properties: Vec<Value>,
    /// What was written to its ports, in the type's order; empty until the first write.
    pub(super) ports: Vec<Written>,
    /// The activity it runs in.
    pub activity: Option<Ident>,
    /// Connections that begin or end at it; one to itself counts once.
    pub degree: u32,
    /// When it was created, in revisions of the system: another component of the same name has another number.
    pub born: u64,
    /// When it was touched last, in revisions of the system.
    pub generation: u64,
}

/// What was written to a port. The value stays in memory when the port goes back to "never written", so that switching to
/// and fro allocates nothing.
#[derive(Debug, Clone)]
pub struct Written {
    written: bool,
    value: Value,
}

impl Written {
    const NEVER: Self = Self { written: false, value: Value::Bool(false) };

    pub(super) fn get(&self) -> Option<&Value> {
        self.written.then_some(&self.value)
    }

    fn put(&mut self, value: Option<&Value>) {
        self.written = value.is_some();
        if let Some(value) = value {
            self.value.clone_from(value);
        }
    }
}

/// A connection, as an edge from the out-port's component to the in-port's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Link {
    /// The out-port's name.
    pub from: Ident,
    /// The in-port's name.
    pub to: Ident,
    /// How it carries samples.
    pub policy: Policy,
}

/// What drives an in-port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Driven {
    /// Connections that end there.
    pub links: u32,
    /// How many of them carry the latest value.
    pub data: u32,
}

impl ComponentNode {
    pub(super) fn new(
        name: ComponentName,
        ty: Arc<ComponentType>,
        activity: Option<Ident>,
        properties: Vec<Value>,
    ) -> Self {
        Self {
            name,
            ty,
            state: RunState::Unconfigured,
            properties,
            ports: Vec::new(),
            activity,
            degree: 0,
            born: 0,
            generation: 0,
        }
    }

    /// Index in the type's order and declaration of a property.
    pub fn property(&self, name: Ident) -> Option<(usize, &PropertyType)> {
        self.ty.properties.iter().enumerate().find(|(_, (n, _))| **n == name).map(|(i, (_, p))| (i, p))
    }

    /// Index in the type's order and declaration of a port.
    pub fn port(&self, name: Ident) -> Option<(usize, &PortType)> {
        self.ty.ports.iter().enumerate().find(|(_, (n, _))| **n == name).map(|(i, (_, p))| (i, p))
    }

    /// The present value of a property.
    pub fn value(&self, name: Ident) -> Option<&Value> {
        self.property(name).and_then(|(i, _)| self.properties.get(i))
    }

    /// What was written to the port at `index` of the type's order; none: never written.
    pub fn written(&self, index: usize) -> Option<&Value> {
        self.ports.get(index).and_then(Written::get)
    }

    /// Ports that were written, with the value, in the type's order.
    pub fn written_ports(&self) -> impl Iterator<Item = (Ident, &Value)> {
        self.ty.ports.keys().zip(&self.ports).filter_map(|(name, w)| w.get().map(|v| (*name, v)))
    }

    pub(super) fn put_port(&mut self, index: usize, value: Option<&Value>) {
        if self.ports.is_empty() {
            if value.is_none() {
                return;
            }
            self.ports.resize(self.ty.ports.len(), Written::NEVER);
        }
        self.ports[index].put(value);
    }

    /// As it is observed.
    pub fn snapshot(&self) -> ComponentSnapshot {
        ComponentSnapshot {
            ty: self.ty.name,
            state: self.state,
            properties: self.ty.properties.keys().copied().zip(self.properties.iter().cloned()).collect(),
            activity: self.activity,
        }
    }

    /// Whether two components are the same to an observer.
    pub fn same(&self, other: &Self) -> bool {
        self.name == other.name
            && self.ty.name == other.ty.name
            && self.state == other.state
            && self.activity == other.activity
            && self.properties == other.properties
            && self.written_ports().eq(other.written_ports())
    }
}
