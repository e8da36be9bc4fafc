//! A plain second picture of a system, with nothing but ordered maps: the rules of docs/semantics.md written a second time, to
//! judge the first by.

use davit::model::*;
use std::sync::Arc;

/// The observable system and the types.
#[derive(Debug, Clone, PartialEq)]
pub struct Plain {
    pub is: Snapshot,
    types: Vec<Arc<ComponentType>>,
}

impl Plain {
    pub fn new(is: Snapshot, types: &Catalogue) -> Self {
        Self { is, types: types.iter().cloned().collect() }
    }

    fn ty(&self, name: TypeName) -> Option<&ComponentType> {
        self.types.iter().find(|t| t.name == name).map(|t| &**t)
    }

    fn of(&self, component: ComponentName) -> Option<(&ComponentSnapshot, &ComponentType)> {
        let it = self.is.components.get(&component)?;
        Some((it, self.ty(it.ty)?))
    }

    fn port(&self, port: MemberRef) -> Option<&PortType> {
        self.of(port.component)?.1.ports.get(&port.member)
    }

    /// What a component needs for itself.
    fn needs(&self, component: ComponentName) -> Vec<String> {
        let Some((it, ty)) = self.of(component) else { return Vec::new() };
        let name = |thing: &Resource| {
            let mut name = thing.to_string();
            for (property, value) in &it.properties {
                let value = if let Value::Str(text) = value { text.to_string() } else { value.to_string() };
                name = name.replace(&format!("{{{property}}}"), &value);
            }
            name
        };
        ty.exclusive.iter().map(name).collect()
    }

    /// Whether a step may happen.
    pub fn allows(&self, step: &Step) -> bool {
        self.judge(step).is_some_and(|yes| yes)
    }

    fn judge(&self, step: &Step) -> Option<bool> {
        use RunState::{Faulted, Running, Stopped, Unconfigured};
        Some(match step {
            Step::State { component, transition } => match (self.is.components.get(component)?.state, transition) {
                (Unconfigured, Transition::Configure) => {
                    let needs = self.needs(*component);
                    let holds = |(name, it): (&ComponentName, &ComponentSnapshot)| {
                        name != component
                            && it.state != Unconfigured
                            && self.needs(*name).iter().any(|thing| needs.contains(thing))
                    };
                    !self.is.components.iter().any(holds)
                }
                (Stopped, Transition::Start)
                | (Running, Transition::Stop)
                | (Stopped | Faulted, Transition::Cleanup) => true,
                _ => false,
            },
            Step::Create { component, ty, properties, .. } => {
                let ty = self.ty(*ty)?;
                !self.is.components.contains_key(component)
                    && ty.properties.len() == properties.len()
                    && ty.properties.values().zip(properties).all(|(p, v)| p.fit(v.clone()).as_ref() == Ok(v))
            }
            Step::Destroy { component } => {
                matches!(self.is.components.get(component)?.state, Unconfigured | Faulted)
                    && !self.is.connections.keys().any(|(a, b)| a.component == *component || b.component == *component)
            }
            Step::Connect { from, to, policy } => {
                let (source, sink) = (self.port(*from)?, self.port(*to)?);
                let others: Vec<Policy> =
                    self.is.connections.iter().filter(|((_, t), _)| t == to).map(|(_, p)| *p).collect();
                let room = sink.is_event()
                    || (!others.contains(&Policy::Data) && (others.is_empty() || *policy != Policy::Data));
                let queue = !sink.buffered || *policy != Policy::Data;
                let units = match (&source.unit, &sink.unit) {
                    (Some(a), Some(b)) => a == b,
                    _ => true,
                };
                source.direction == Direction::Out
                    && sink.direction == Direction::In
                    && source.ty == sink.ty
                    && units
                    && room
                    && queue
                    && *policy != Policy::Buffer(0)
                    && !self.is.connections.contains_key(&(*from, *to))
            }
            Step::Disconnect { from, to } => self.is.connections.contains_key(&(*from, *to)),
            Step::PropertySet { property, value } => {
                let (it, ty) = self.of(property.component)?;
                let declared = ty.properties.get(&property.member)?;
                let state = match declared.tunable {
                    Tunable::Always => true,
                    Tunable::Stopped => matches!(it.state, Unconfigured | Stopped),
                    Tunable::Unconfigured => it.state == Unconfigured,
                };
                state && declared.fit(value.clone()).as_ref() == Ok(value)
            }
            Step::PortWrite { port, value } => {
                let declared = self.port(*port)?;
                let fits = value.as_ref().is_none_or(|v| v.clone().fit(&declared.ty).as_ref() == Ok(v));
                declared.direction == Direction::In
                    && !declared.buffered
                    && !declared.is_event()
                    && fits
                    && !self.is.connections.keys().any(|(_, to)| to == port)
            }
            Step::Operation(call) => {
                let declared = self.of(call.operation.component)?.1.operations.get(&call.operation.member)?;
                declared.args.len() == call.args.len()
            }
        })
    }

    /// Makes a step happen, after [`Plain::allows`].
    pub fn make(&mut self, step: &Step) {
        match step {
            Step::State { component, transition } => {
                let state = match transition {
                    Transition::Configure | Transition::Stop => RunState::Stopped,
                    Transition::Start => RunState::Running,
                    Transition::Cleanup => RunState::Unconfigured,
                };
                self.is.components.get_mut(component).unwrap().state = state;
            }
            Step::Create { component, ty, activity, properties } => {
                let names = self.ty(*ty).unwrap().properties.keys().copied();
                let properties = names.zip(properties.iter().cloned()).collect();
                let it = ComponentSnapshot { ty: *ty, state: RunState::Unconfigured, properties, activity: *activity };
                self.is.components.insert(*component, it);
            }
            Step::Destroy { component } => {
                self.is.components.remove(component);
                self.is.ports.retain(|p, _| p.component != *component);
            }
            Step::Connect { from, to, policy } => _ = self.is.connections.insert((*from, *to), *policy),
            Step::Disconnect { from, to } => _ = self.is.connections.remove(&(*from, *to)),
            Step::PropertySet { property, value } => {
                let it = self.is.components.get_mut(&property.component).unwrap();
                it.properties.insert(property.member, value.clone());
            }
            Step::PortWrite { port, value: Some(value) } => _ = self.is.ports.insert(*port, value.clone()),
            Step::PortWrite { port, value: None } => _ = self.is.ports.remove(port),
            Step::Operation(_) => {}
        }
    }

    /// Both; false when the step may not happen.
    pub fn try_make(&mut self, step: &Step) -> bool {
        let yes = self.allows(step);
        if yes {
            self.make(step);
        }
        yes
    }
}
