//! The simulated platform's own bookkeeping: plain ordered maps and the rules of docs/semantics.md, written out once more.
//!
//! It uses nothing of `system` or `plan`, so that what it accepts and what it ends in is an independent word on what they
//! accept and end in.

use crate::model::finding::{are, count};
use crate::model::value::FitError;
use crate::model::{
    Catalogue, ComponentName, ComponentSnapshot, ComponentType, Direction, Ident, MemberRef, Policy, PortType,
    RunState, Snapshot, Step, Transition, Value, ValueType,
};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A component as the platform keeps it.
pub(super) struct SimulatedComponent {
    pub ty: Arc<ComponentType>,
    pub activity: Option<Ident>,
    pub state: RunState,
    pub properties: BTreeMap<Ident, Value>,
    /// Connections that begin or end here (one to itself counts twice).
    links: usize,
}

/// Everything there is.
#[derive(Default)]
pub(super) struct SimulatedWorld {
    pub catalogue: Catalogue,
    /// Activities that exist; none: any name is accepted.
    pub activities: Option<BTreeSet<Ident>>,
    pub components: BTreeMap<ComponentName, SimulatedComponent>,
    connections: BTreeMap<(MemberRef, MemberRef), Policy>,
    /// In-port → the out-ports connected to it.
    incoming: BTreeMap<MemberRef, Vec<MemberRef>>,
    /// Out-port → the in-ports connected to it.
    outgoing: BTreeMap<MemberRef, Vec<MemberRef>>,
    written: BTreeMap<MemberRef, Value>,
}

type RefusalText = String;

impl SimulatedWorld {
    pub fn new(catalogue: Catalogue, activities: Option<BTreeSet<Ident>>) -> Self {
        Self { catalogue, activities, ..Self::default() }
    }

    fn component(&self, name: ComponentName) -> Result<&SimulatedComponent, RefusalText> {
        self.components.get(&name).ok_or_else(|| format!("there is no component `{name}`"))
    }

    fn port(&self, port: MemberRef, direction: Direction) -> Result<&PortType, RefusalText> {
        let component = self.component(port.component)?;
        let ty = component.ty.ports.get(&port.member).ok_or_else(|| format!("there is no port `{port}`"))?;
        if ty.direction == direction {
            Ok(ty)
        } else {
            Err(format!("`{port}` is not an {}-port", if direction == Direction::In { "in" } else { "out" }))
        }
    }

    /// Whether `step` may happen now.
    pub fn check(&self, step: &Step) -> Result<(), RefusalText> {
        match step {
            Step::State { component, transition } => {
                let state = self.component(*component)?.state;
                if !transition.allowed_in(state) {
                    return Err(format!("`{component}` is {state}: it cannot {transition}"));
                }
                match self.holder(*component).filter(|_| *transition == Transition::Configure) {
                    Some(by) => Err(format!("`{component}` needs what `{by}` holds")),
                    None => Ok(()),
                }
            }
            Step::Create { component, ty, activity, properties } => {
                self.check_create(*component, *ty, *activity, properties)
            }
            Step::Destroy { component } => {
                let it = self.component(*component)?;
                if !matches!(it.state, RunState::Unconfigured | RunState::Faulted) {
                    return Err(format!("`{component}` is {}", it.state));
                }
                if it.links > 0 {
                    return Err(format!("`{component}` still has connections"));
                }
                Ok(())
            }
            Step::Connect { from, to, policy } => self.check_connect(*from, *to, *policy),
            Step::Disconnect { from, to } => {
                if self.connections.contains_key(&(*from, *to)) {
                    Ok(())
                } else {
                    Err(format!("`{from}` is not connected to `{to}`"))
                }
            }
            Step::PropertySet { property, value } => {
                let it = self.component(property.component)?;
                let ty = it
                    .ty
                    .properties
                    .get(&property.member)
                    .ok_or_else(|| format!("there is no property `{property}`"))?;
                if !ty.tunable.allows(it.state) {
                    return Err(format!("`{property}` cannot be set while {}", it.state));
                }
                exactly(value, &ty.ty)?;
                ty.fit(value.clone()).map(drop).map_err(|e| format!("`{property}`: {e}"))
            }
            Step::PortWrite { port, value } => {
                let ty = self.port(*port, Direction::In)?;
                if ty.buffered || ty.is_event() {
                    return Err(format!("`{port}` is read as a queue: it cannot be written"));
                }
                if self.incoming.get(port).is_some_and(|from| !from.is_empty()) {
                    return Err(format!("`{port}` is connected"));
                }
                value.as_ref().map_or(Ok(()), |value| exactly(value, &ty.ty))
            }
            Step::Operation(call) => {
                let it = self.component(call.operation.component)?;
                let ty = it
                    .ty
                    .operations
                    .get(&call.operation.member)
                    .ok_or_else(|| format!("there is no operation `{}`", call.operation))?;
                if ty.args.len() != call.args.len() {
                    return Err(format!("`{}` takes {}", call.operation, count(ty.args.len(), "argument")));
                }
                call.args.iter().zip(&ty.args).try_for_each(|(value, ty)| exactly(value, ty))
            }
        }
    }

    /// Who holds something that a component needs for itself.
    fn holder(&self, component: ComponentName) -> Option<ComponentName> {
        let needs = |it: &SimulatedComponent| -> Vec<String> {
            it.ty.exclusive.iter().filter_map(|thing| thing.named(|property| it.properties.get(&property))).collect()
        };
        let own = self.components.get(&component).map(needs).filter(|own| !own.is_empty())?;
        let holds = |(name, it): &(&ComponentName, &SimulatedComponent)| {
            **name != component
                && it.state != RunState::Unconfigured
                && needs(it).iter().any(|thing| own.contains(thing))
        };
        self.components.iter().find(holds).map(|(name, _)| *name)
    }

    fn check_create(
        &self,
        component: ComponentName,
        ty: crate::model::TypeName,
        activity: Option<Ident>,
        properties: &[Value],
    ) -> Result<(), RefusalText> {
        if self.components.contains_key(&component) {
            return Err(format!("`{component}` exists already"));
        }
        let ty = self.catalogue.get(ty).ok_or_else(|| format!("there is no component type `{ty}`"))?;
        if let (Some(activity), Some(known)) = (activity, &self.activities)
            && !known.contains(&activity)
        {
            return Err(format!("there is no activity `{activity}`"));
        }
        if properties.len() != ty.properties.len() {
            let (wanted, given) = (count(ty.properties.len(), "property"), are(properties.len()));
            return Err(format!("`{}` has {wanted}, {given} given", ty.name));
        }
        for ((name, property), value) in ty.properties.iter().zip(properties) {
            exactly(value, &property.ty)?;
            property.fit(value.clone()).map_err(|e| format!("`{component}.{name}`: {e}"))?;
        }
        Ok(())
    }

    fn check_connect(&self, from: MemberRef, to: MemberRef, policy: Policy) -> Result<(), RefusalText> {
        let out = self.port(from, Direction::Out)?;
        let into = self.port(to, Direction::In)?;
        if out.ty != into.ty {
            return Err(format!("`{from}` carries {}, `{to}` takes {}", out.ty, into.ty));
        }
        if let (Some(a), Some(b)) = (&out.unit, &into.unit)
            && a != b
        {
            return Err(format!("`{from}` is in {a}, `{to}` in {b}"));
        }
        if policy == Policy::Buffer(0) {
            return Err("a buffer holds at least one sample".to_owned());
        }
        if self.connections.contains_key(&(from, to)) {
            return Err(format!("`{from}` is connected to `{to}` already"));
        }
        if into.is_event() {
            return Ok(());
        }
        if into.buffered && policy == Policy::Data {
            return Err(format!("`{to}` takes buffered connections only"));
        }
        let others = self.incoming.get(&to).map_or(&[][..], Vec::as_slice);
        if policy == Policy::Data && !others.is_empty() {
            return Err(format!("`{to}` is connected already, and a data connection must be its only one"));
        }
        if others.iter().any(|other| self.connections.get(&(*other, to)) == Some(&Policy::Data)) {
            return Err(format!("`{to}` has a data connection, which must be its only one"));
        }
        Ok(())
    }

    /// Lets `step` happen; it was checked. Answers an operation's result.
    pub fn apply(&mut self, step: &Step) -> Option<Value> {
        match step {
            Step::State { component, transition } => {
                if let Some(it) = self.components.get_mut(component) {
                    it.state = transition.target();
                }
            }
            Step::Create { component, ty, activity, properties } => {
                let ty = self.catalogue.get(*ty)?.clone();
                let properties = ty.properties.keys().copied().zip(properties.iter().cloned()).collect();
                self.components.insert(
                    *component,
                    SimulatedComponent { ty, activity: *activity, state: RunState::Unconfigured, properties, links: 0 },
                );
            }
            Step::Destroy { component } => {
                let it = self.components.remove(component)?;
                for port in it.ty.ports.keys() {
                    self.written.remove(&component.member(*port));
                    self.incoming.remove(&component.member(*port));
                    self.outgoing.remove(&component.member(*port));
                }
            }
            Step::Connect { from, to, policy } => {
                self.connections.insert((*from, *to), *policy);
                self.incoming.entry(*to).or_default().push(*from);
                self.outgoing.entry(*from).or_default().push(*to);
                self.count_link(*from, *to, 1);
            }
            Step::Disconnect { from, to } => {
                self.connections.remove(&(*from, *to));
                if let Some(others) = self.incoming.get_mut(to) {
                    others.retain(|other| other != from);
                }
                if let Some(others) = self.outgoing.get_mut(from) {
                    others.retain(|other| other != to);
                }
                self.count_link(*from, *to, -1);
            }
            Step::PropertySet { property, value } => {
                if let Some(slot) =
                    self.components.get_mut(&property.component).and_then(|it| it.properties.get_mut(&property.member))
                {
                    slot.clone_from(value);
                }
            }
            Step::PortWrite { port, value: Some(value) } => match self.written.get_mut(port) {
                Some(slot) => slot.clone_from(value),
                None => {
                    self.written.insert(*port, value.clone());
                }
            },
            Step::PortWrite { port, value: None } => {
                self.written.remove(port);
            }
            Step::Operation(call) => {
                let it = self.components.get(&call.operation.component)?;
                return it.ty.operations.get(&call.operation.member)?.returns.as_ref().map(default_value);
            }
        }
        None
    }

    fn count_link(&mut self, from: MemberRef, to: MemberRef, by: isize) {
        for end in [from.component, to.component] {
            if let Some(it) = self.components.get_mut(&end) {
                it.links = it.links.saturating_add_signed(by);
            }
        }
    }

    pub fn observe(&self, name: ComponentName) -> Option<ComponentSnapshot> {
        self.components.get(&name).map(|it| ComponentSnapshot {
            ty: it.ty.name,
            state: it.state,
            properties: it.properties.clone(),
            activity: it.activity,
        })
    }

    /// Those of these components that exist, with what begins or ends at them and what was written to them.
    pub fn some(&self, names: &[ComponentName]) -> Snapshot {
        let mut seen = Snapshot::default();
        for name in names {
            let (Some(component), Some(it)) = (self.observe(*name), self.components.get(name)) else { continue };
            seen.components.insert(*name, component);
            for port in it.ty.ports.keys().map(|port| name.member(*port)) {
                let from = self.incoming.get(&port).into_iter().flatten().map(|from| (*from, port));
                let to = self.outgoing.get(&port).into_iter().flatten().map(|to| (port, *to));
                for ends in from.chain(to) {
                    seen.connections.extend(self.connections.get(&ends).map(|policy| (ends, *policy)));
                }
                seen.ports.extend(self.written.get(&port).map(|value| (port, value.clone())));
            }
        }
        seen
    }

    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            components: self.components.keys().filter_map(|name| Some((*name, self.observe(*name)?))).collect(),
            connections: self.connections.clone(),
            ports: self.written.clone(),
        }
    }
}

fn exactly(value: &Value, ty: &ValueType) -> Result<(), RefusalText> {
    if value.is_of(ty) {
        Ok(())
    } else {
        Err(value
            .clone()
            .fit(ty)
            .map_or_else(|e: FitError| e.to_string(), |_| format!("expected {ty}, found {}", value.describe())))
    }
}

/// What an operation of a simulated component answers: the plainest value of its type.
pub(super) fn default_value(ty: &ValueType) -> Value {
    match ty {
        ValueType::Bool => Value::Bool(false),
        ValueType::Int => Value::Int(0),
        ValueType::Float => Value::Float(0.0),
        ValueType::Str | ValueType::Event => Value::str(""),
        ValueType::Array(element, length) => Value::Array(vec![default_value(element); length.unwrap_or(0)]),
        ValueType::Record(fields) => {
            Value::Record(fields.iter().map(|(name, ty)| (*name, default_value(ty))).collect())
        }
    }
}
