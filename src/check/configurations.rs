//! Each configuration by itself, against everything that any configuration creates: names, types, units, limits.
//!
//! What depends on the system it meets (is the component there, in which run state, what drives the port) is found where
//! it is requested: see `explore`.

use super::universe::{Creation, Universe};
use crate::model::codes::{
    BAD_ARGUMENTS, BAD_VALUE, BUFFER_SIZE, MISSING_PROPERTY, NEEDS_BUFFER, NOT_AN_IN_PORT, NOT_AN_OUT_PORT,
    PORT_NOT_WRITABLE, PORT_TYPES, PORT_UNITS, UNKNOWN_ACTIVITY, UNKNOWN_OPERATION, UNKNOWN_PORT, UNKNOWN_PROPERTY,
    UNKNOWN_TYPE,
};
use crate::model::finding::did_you_mean;
use crate::model::{
    Call, Catalogue, Change, ChangeKind, Code, ComponentName, ComponentType, ConfigId, Configuration, Deployment,
    Direction, Finding, Findings, Ident, MemberRef, Origin, Policy, PortType, StateList, Target, TypeName, Value,
};
use std::collections::BTreeMap;

/// What is wrong with each configuration by itself.
pub fn check(deployment: &Deployment, catalogue: &Catalogue, universe: &Universe) -> Findings {
    let all: Vec<ConfigId> = deployment.configurations.iter().map(|c| c.id).collect();
    some(deployment, catalogue, universe, &all)
}

/// What is wrong with these configurations by themselves.
pub fn some(deployment: &Deployment, catalogue: &Catalogue, universe: &Universe, ids: &[ConfigId]) -> Findings {
    let mut check = Check { deployment, catalogue, universe, path: String::new(), findings: Vec::new() };
    for configuration in deployment.configurations.iter().filter(|c| ids.contains(&c.id)) {
        check.configuration(configuration);
    }
    check.findings
}

struct Check<'a> {
    deployment: &'a Deployment,
    catalogue: &'a Catalogue,
    universe: &'a Universe,
    path: String,
    findings: Findings,
}

/// Which of a component's members is meant.
#[derive(Debug, Clone, Copy)]
pub enum Member {
    /// A port.
    Port,
    /// A property.
    Property,
    /// An operation.
    Operation,
}

impl Member {
    /// What it is called, one and several, and the code of one that is not there.
    pub fn words(self) -> (&'static str, &'static str, Code) {
        match self {
            Self::Port => ("port", "ports", UNKNOWN_PORT),
            Self::Property => ("property", "properties", UNKNOWN_PROPERTY),
            Self::Operation => ("operation", "operations", UNKNOWN_OPERATION),
        }
    }

    /// The names of those that a type has.
    pub fn of(self, ty: &ComponentType) -> Vec<&'static str> {
        match self {
            Self::Port => ty.ports.keys().map(Ident::as_str).collect(),
            Self::Property => ty.properties.keys().map(Ident::as_str).collect(),
            Self::Operation => ty.operations.keys().map(Ident::as_str).collect(),
        }
    }
}

impl<'a> Check<'a> {
    fn add(&mut self, finding: Finding) {
        self.findings.push(finding.path(self.path.clone()));
    }

    fn configuration(&mut self, configuration: &Configuration) {
        for (list, entries) in [("pre_conf_state", &configuration.pre), ("post_conf_state", &configuration.post)] {
            self.states(configuration, list, entries);
        }
        for (i, change) in configuration.changes.iter().enumerate() {
            self.path = format!("configurations.{}.changes[{i}]", configuration.id);
            self.change(change);
        }
    }

    fn states(&mut self, configuration: &Configuration, list: &str, entries: &StateList) {
        for (i, entry) in entries.iter().enumerate() {
            self.path = format!("configurations.{}.{list}[{i}]", configuration.id);
            if let Target::Component(component) = entry.target {
                self.component(component, entry.origin);
            }
        }
    }

    fn change(&mut self, change: &Change) {
        let at = change.origin;
        match &change.kind {
            ChangeKind::Create { component, ty, activity, properties } => {
                self.create(*component, *ty, *activity, properties, at);
            }
            ChangeKind::Destroy { component } => {
                self.component(*component, at);
            }
            ChangeKind::Connect { from, to, policy } => self.connect(*from, *to, *policy, at),
            ChangeKind::Disconnect { from, to } => {
                self.member(*from, Member::Port, at);
                self.member(*to, Member::Port, at);
            }
            ChangeKind::PropertySet { property, value } => {
                let Some(creation) = self.member(*property, Member::Property, at) else { return };
                let slot = creation.description.as_ref().and_then(|ty| ty.properties.get(&property.member));
                if let Some(slot) = slot
                    && let Err(error) = slot.fit(value.clone())
                {
                    let found = Finding::error(BAD_VALUE, format!("{property} cannot be {value}: {error}"));
                    self.add(with_slot(found.at(at), &slot.ty.to_string(), slot.unit.as_deref(), slot.origin));
                }
            }
            ChangeKind::PortWrite { port, value } => self.port_write(*port, value, at),
            ChangeKind::OperationCall { call, undo } => {
                self.call(call, at);
                if let Some(undo) = undo {
                    self.call(undo, at);
                }
            }
        }
    }

    /// How a component may have been created; a finding when nothing creates one of that name.
    fn component(&mut self, component: ComponentName, at: Origin) -> &'a [Creation] {
        let creations = self.universe.of(component);
        if creations.is_empty() {
            self.add(self.universe.unknown(component, at));
        }
        creations
    }

    /// A creation of the component that has the member; a finding when none has. None also when the type is unknown,
    /// which is said where it is created.
    fn member(&mut self, member: MemberRef, kind: Member, at: Origin) -> Option<&'a Creation> {
        let creations = self.component(member.component, at);
        let known: Vec<(&Creation, Vec<&'static str>)> =
            creations.iter().filter_map(|c| c.description.as_ref().map(|ty| (c, kind.of(ty)))).collect();
        if known.len() < creations.len() || known.is_empty() {
            return None;
        }
        let found = known.iter().find(|(_, names)| names.contains(&member.member.as_str())).map(|(c, _)| *c);
        if found.is_none() {
            let (creation, names) = &known[0];
            let (what, plural, code) = kind.words();
            let elsewhere = [Member::Port, Member::Property, Member::Operation].into_iter().find(|other| {
                creation.description.as_ref().is_some_and(|ty| other.of(ty).contains(&member.member.as_str()))
            });
            let help = match elsewhere {
                Some(other) => format!("`{}` is a {} of {}", member.member, other.words().0, creation.ty),
                None => did_you_mean(member.member.as_str(), plural, names.iter().copied()),
            };
            self.add(
                Finding::error(code, format!("{} has no {what} `{}`", member.component, member.member))
                    .at(at)
                    .labelled(format!("no such {what}"))
                    .also(creation.origin, format!("{} is created here as {}", member.component, creation.ty))
                    .help(help),
            );
        }
        found
    }

    fn create(
        &mut self,
        component: ComponentName,
        ty: TypeName,
        activity: Option<Ident>,
        properties: &BTreeMap<Ident, Value>,
        at: Origin,
    ) {
        if let Some(activity) = activity
            && !self.deployment.activities.contains_key(&activity)
        {
            let known = self.deployment.activities.keys().map(Ident::as_str);
            self.add(
                Finding::error(UNKNOWN_ACTIVITY, format!("there is no activity `{activity}` for {component}"))
                    .at(at)
                    .labelled("runs in an activity that the deployment does not declare")
                    .help(did_you_mean(activity.as_str(), "activities", known)),
            );
        }
        let Some(description) = self.catalogue.get(ty) else {
            let known: Vec<&str> = self.catalogue.iter().map(|ty| ty.name.as_str()).collect();
            // A library's prefix too many or too few is the likeliest slip.
            let own = |name: &str| name.rsplit('.').next().map(str::to_owned);
            let help = match known.iter().find(|name| own(name) == own(ty.as_str())) {
                Some(name) => format!("did you mean `{name}`?"),
                None => did_you_mean(ty.as_str(), "types", known),
            };
            self.add(
                Finding::error(UNKNOWN_TYPE, format!("there is no component type `{ty}`"))
                    .at(at)
                    .labelled(format!("{component} would be one"))
                    .help(help),
            );
            return;
        };
        for (name, value) in properties {
            let Some(slot) = description.properties.get(name) else {
                let known = description.properties.keys().map(Ident::as_str);
                self.add(
                    Finding::error(UNKNOWN_PROPERTY, format!("{component} has no property `{name}`"))
                        .at(at)
                        .labelled(format!("given to a {ty}"))
                        .also(description.origin, format!("{ty} is declared here"))
                        .help(did_you_mean(name.as_str(), "properties", known)),
                );
                continue;
            };
            if let Err(error) = slot.fit(value.clone()) {
                let found = Finding::error(BAD_VALUE, format!("{component}.{name} cannot be {value}: {error}"));
                self.add(with_slot(found.at(at), &slot.ty.to_string(), slot.unit.as_deref(), slot.origin));
            }
        }
        for (name, slot) in &description.properties {
            if slot.default.is_none() && !properties.contains_key(name) {
                self.add(
                    Finding::error(MISSING_PROPERTY, format!("{component}.{name} has no default and is not given"))
                        .at(at)
                        .also(slot.origin, "declared here without a default")
                        .help(format!("add `{name} = …` ({}) to the properties of this create", slot.ty)),
                );
            }
        }
    }

    fn connect(&mut self, from: MemberRef, to: MemberRef, policy: Policy, at: Origin) {
        if policy == Policy::Buffer(0) {
            self.add(
                Finding::error(BUFFER_SIZE, format!("the buffer from {from} to {to} has room for nothing"))
                    .at(at)
                    .help("a buffer holds at least one sample"),
            );
        }
        let a = self.port(from, Direction::Out, at);
        let b = self.port(to, Direction::In, at);
        let (Some(a), Some(b)) = (a, b) else { return };
        if a.ty != b.ty {
            self.add(
                Finding::error(PORT_TYPES, format!("{from} carries {}, {to} takes {}", a.ty, b.ty))
                    .at(at)
                    .also(a.origin, format!("{from} is declared here"))
                    .also(b.origin, format!("{to} is declared here"))
                    .help("connect ports of the same type; nothing is converted on the way"),
            );
        } else if let (Some(x), Some(y)) = (&a.unit, &b.unit)
            && x != y
        {
            self.add(
                Finding::error(PORT_UNITS, format!("{from} is in {x}, {to} in {y}"))
                    .at(at)
                    .also(a.origin, format!("{from} is declared here"))
                    .also(b.origin, format!("{to} is declared here"))
                    .help("put a component between them that converts, or correct the unit of one"),
            );
        }
        if b.buffered && policy == Policy::Data && !b.is_event() {
            self.add(
                Finding::error(NEEDS_BUFFER, format!("{to} takes only buffered connections"))
                    .at(at)
                    .also(b.origin, "declared here as buffered")
                    .help("write the connection with `buffer = n`"),
            );
        }
    }

    fn port(&mut self, port: MemberRef, direction: Direction, at: Origin) -> Option<&'a PortType> {
        let creation = self.member(port, Member::Port, at)?;
        let description = creation.description.as_ref()?.ports.get(&port.member)?;
        if description.direction != direction {
            let (code, is, rule) = match direction {
                Direction::Out => (NOT_AN_OUT_PORT, "an in-port", "a connection begins at an out-port"),
                Direction::In => (NOT_AN_IN_PORT, "an out-port", "only an in-port can be connected to or written"),
            };
            self.add(
                Finding::error(code, format!("{port} is {is}: {rule}"))
                    .at(at)
                    .also(description.origin, "declared here")
                    .help("are the two ends the wrong way round? the first is the out-port"),
            );
            return None;
        }
        Some(description)
    }

    fn port_write(&mut self, port: MemberRef, value: &Value, at: Origin) {
        let Some(slot) = self.port(port, Direction::In, at) else { return };
        if slot.buffered || slot.is_event() {
            self.add(
                Finding::error(PORT_NOT_WRITABLE, format!("{port} is read as a queue and cannot be written"))
                    .at(at)
                    .also(slot.origin, "declared here")
                    .help("connect a component that sends what you want to write"),
            );
        } else if let Err(error) = value.clone().fit(&slot.ty) {
            let found = Finding::error(BAD_VALUE, format!("{port} cannot be {value}: {error}"));
            self.add(with_slot(found.at(at), &slot.ty.to_string(), slot.unit.as_deref(), slot.origin));
        }
    }

    fn call(&mut self, call: &Call, at: Origin) {
        let Some(creation) = self.member(call.operation, Member::Operation, at) else { return };
        let Some(operation) = creation.description.as_ref().and_then(|ty| ty.operations.get(&call.operation.member))
        else {
            return;
        };
        let wanted: Vec<String> = operation.args.iter().map(ToString::to_string).collect();
        let problem = if call.args.len() == operation.args.len() {
            call.args.iter().zip(&operation.args).enumerate().find_map(|(i, (value, ty))| {
                value.clone().fit(ty).err().map(|error| format!("argument {} is {value}: {error}", i + 1))
            })
        } else {
            Some(format!("it is given {}", call.args.len()))
        };
        if let Some(problem) = problem {
            self.add(
                Finding::error(
                    BAD_ARGUMENTS,
                    format!("{} takes {} argument(s); {problem}", call.operation, operation.args.len()),
                )
                .at(at)
                .also(operation.origin, "declared here")
                .help(format!("call it as {}({})", call.operation, wanted.join(", "))),
            );
        }
    }
}

fn with_slot(finding: Finding, ty: &str, unit: Option<&str>, origin: Origin) -> Finding {
    let unit = unit.map_or_else(String::new, |u| format!(" in {u}"));
    finding.also(origin, "declared here").help(format!("give it a value of type {ty}{unit}"))
}
