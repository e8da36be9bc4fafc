//! Component types: what components of a type have and may do.

use super::finding::Origin;
use super::injection::InjectionType;
use super::monitor::{Condition, SELF, is_monitors};
use super::names::{ComponentName, EventName, Ident, NameError, TypeName};
use super::resource::Resource;
use super::run_state::RunState;
use super::value::{FitError, Value, ValueType};
use super::words::{marks, words};
use rustc_hash::FxHashMap;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A component type. Members are kept in alphabetical order; the runtime may address one by its index in that order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComponentType {
    /// Its name.
    pub name: TypeName,
    /// What it is for, one or more sentences; printed by `davit types`.
    pub doc: String,
    /// Ports.
    pub ports: BTreeMap<Ident, PortType>,
    /// Properties.
    pub properties: BTreeMap<Ident, PropertyType>,
    /// Operations.
    pub operations: BTreeMap<Ident, OperationType>,
    /// Events that components of it may raise by themselves, each with what it tells.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub raises: BTreeMap<EventName, String>,
    /// What can be made to go wrong in it, beside what can in every component.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub injections: BTreeMap<Ident, InjectionType>,
    /// Types whose components start before those of this type.
    pub start_after: Vec<TypeName>,
    /// Types whose components stop after those of this type.
    pub stop_before: Vec<TypeName>,
    /// Whether it moves something.
    pub actuator: bool,
    /// Which of its run state's changes move hardware.
    pub moves: Moves,
    /// What of its life cannot be undone.
    pub irreversible: Irreversible,
    /// What a component of it needs for itself from *configured* on.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub exclusive: Vec<Resource>,
    /// Where it was declared (none for types of a library).
    #[serde(skip)]
    pub origin: Origin,
}

marks! {
    /// Which changes of a component's run state move hardware.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
    pub struct Moves {
        /// Starting.
        pub start: bool,
        /// Stopping.
        pub stop: bool,
    }
}

marks! {
    /// Which moves of a component cannot be undone.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
    #[allow(clippy::struct_excessive_bools)]
    pub struct Irreversible {
        /// Configuring (as for a device that is calibrated by it).
        pub configure: bool,
        /// Stopping.
        pub stop: bool,
        /// Destroying.
        pub destroy: bool,
    }
}

words! {
    /// A kind of what components have.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
    pub enum MemberClass by word {
        /// A port.
        Port = "port",
        /// A property.
        Property = "property",
        /// An operation.
        Operation = "operation",
    }
}

impl MemberClass {
    /// What several are called, which is also the key that they are listed under.
    pub fn several(self) -> &'static str {
        match self {
            Self::Port => "ports",
            Self::Property => "properties",
            Self::Operation => "operations",
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

words! {
    /// In or out.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub enum Direction by word {
        /// Read by the component.
        In = "in",
        /// Written by the component.
        Out = "out",
    }
}

/// A port of a type. `type: event` makes an event port, `buffered: true` a port that only takes buffered connections.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PortType {
    /// In or out.
    pub direction: Direction,
    /// What travels through it.
    #[serde(rename = "type")]
    pub ty: ValueType,
    /// The unit, if it states one.
    pub unit: Option<Arc<str>>,
    /// An in-port that is read as a queue: takes only buffered connections, any number of them.
    pub buffered: bool,
    /// An in-port that something has to drive while its component is there: a connection, or a value that is written.
    pub required: bool,
    /// What it is.
    pub doc: String,
    /// Where it was declared.
    #[serde(skip)]
    pub origin: Origin,
}

impl PortType {
    /// One of which nothing else is said.
    pub fn new(direction: Direction, ty: ValueType) -> Self {
        let (buffered, required) = (false, false);
        Self { direction, ty, unit: None, buffered, required, doc: String::new(), origin: Origin::NONE }
    }

    /// Whether it carries event names.
    pub fn is_event(&self) -> bool {
        self.ty == ValueType::Event
    }
}

words! {
    /// In which run states a property may be set.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
    pub enum Tunable by word {
        /// Only while unconfigured.
        Unconfigured = "unconfigured",
        /// While unconfigured or stopped.
        Stopped = "stopped",
        /// Also while running (and faulted).
        #[default]
        Always = "always",
    }
}

impl Tunable {
    /// Whether a property may be set in `state`.
    pub fn allows(self, state: RunState) -> bool {
        match self {
            Self::Unconfigured => state == RunState::Unconfigured,
            Self::Stopped => matches!(state, RunState::Unconfigured | RunState::Stopped),
            Self::Always => true,
        }
    }
}

/// A property of a type.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PropertyType {
    /// Its type.
    #[serde(rename = "type")]
    pub ty: ValueType,
    /// Its value where none is given; a property without one must be given in `create`.
    pub default: Option<Value>,
    /// Smallest value allowed, of every number in it.
    pub min: Option<f64>,
    /// Largest value allowed, of every number in it.
    pub max: Option<f64>,
    /// When it may be set.
    pub tunable: Tunable,
    /// Whether its value is the name of an event that the component raises; empty: none.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub raises: bool,
    /// The unit, if it states one.
    pub unit: Option<Arc<str>>,
    /// What it is.
    pub doc: String,
    /// Where it was declared.
    #[serde(skip)]
    pub origin: Origin,
}

/// Why a value may not be given to a property.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ValueError {
    /// Not of the type.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// Outside the limits.
    #[error("{}", outside(*.value, *.min, *.max))]
    Range {
        /// The number at fault.
        value: f64,
        /// The smallest allowed.
        min: Option<f64>,
        /// The largest allowed.
        max: Option<f64>,
    },
    /// Not the name of an event, as the value of a property that is one.
    #[error(transparent)]
    Event(#[from] NameError),
}

impl ValueError {
    /// What to do about it where a value of that type is wanted.
    pub fn advice(&self, ty: &ValueType) -> String {
        match self {
            Self::Range { min: Some(min), max: Some(max), .. } => format!("give a value from {min} to {max}"),
            Self::Range { min: Some(min), .. } => format!("give {min} or more"),
            Self::Range { max, .. } => format!("give {} or less", max.unwrap_or(f64::INFINITY)),
            Self::Fit(_) => format!("give a value of the type {ty}"),
            Self::Event(_) => {
                "give the name of the event that is to be raised, such as `e_seen`, or \"\" for none".to_owned()
            }
        }
    }
}

fn outside(value: f64, min: Option<f64>, max: Option<f64>) -> String {
    match (min, max) {
        (Some(min), Some(max)) => format!("{value} is outside {min} … {max}"),
        (Some(min), None) => format!("{value} is less than {min}"),
        (_, max) => format!("{value} is more than {}", max.unwrap_or(f64::INFINITY)),
    }
}

impl PropertyType {
    /// One of which nothing else is said.
    pub fn new(ty: ValueType, tunable: Tunable) -> Self {
        let (default, min, max, unit, raises) = (None, None, None, None, false);
        Self { ty, default, min, max, tunable, raises, unit, doc: String::new(), origin: Origin::NONE }
    }

    /// `value` as a value of this property: of its type, within its limits, an event's name where it is one.
    ///
    /// # Errors
    /// `ValueError`, naming the number or element at fault.
    pub fn fit(&self, value: Value) -> Result<Value, ValueError> {
        let value = fit_within(value, &self.ty, self.min, self.max)?;
        self.names_event(&value)?;
        Ok(value)
    }

    /// Whether `value` is one of this property as it is; where it is not, [`fit`](Self::fit) says why.
    pub fn takes(&self, value: &Value) -> bool {
        let mut within = true;
        if self.min.is_some() || self.max.is_some() {
            value
                .for_each_number(&mut |n| within &= self.min.is_none_or(|m| n >= m) && self.max.is_none_or(|m| n <= m));
        }
        within && value.is_of(&self.ty) && self.names_event(value).is_ok()
    }

    fn names_event(&self, value: &Value) -> Result<(), NameError> {
        match value {
            Value::Str(name) if self.raises && !name.is_empty() => EventName::new(name).map(drop),
            _ => Ok(()),
        }
    }
}

/// `value` as a value of the type `ty` in which every number is within the limits.
pub(super) fn fit_within(
    value: Value,
    ty: &ValueType,
    min: Option<f64>,
    max: Option<f64>,
) -> Result<Value, ValueError> {
    let value = value.fit(ty)?;
    let mut bad = None;
    if min.is_some() || max.is_some() {
        value.for_each_number(&mut |n| {
            if bad.is_none() && (min.is_some_and(|m| n < m) || max.is_some_and(|m| n > m)) {
                bad = Some(n);
            }
        });
    }
    match bad {
        Some(value) => Err(ValueError::Range { value, min, max }),
        None => Ok(value),
    }
}

/// What an operation leaves behind.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Effect {
    /// Nothing that would have to be undone.
    None,
    /// Undone by this operation of the same component, called with the same arguments, or none if it takes none.
    Undo(Ident),
    /// Something that nothing undoes.
    Irreversible,
}

/// An operation of a type.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OperationType {
    /// Types of its arguments.
    pub args: Vec<ValueType>,
    /// Type of its result, if it has one.
    pub returns: Option<ValueType>,
    /// What it leaves behind; without a word, irreversible.
    pub effect: Effect,
    /// Whether calling it moves hardware.
    pub moves: bool,
    /// What is true of the component once it was done: this settles a call of which no answer came. The component itself is
    /// written `self` in it.
    #[serde(skip)]
    pub settled_by: Option<Condition>,
    /// What it does.
    pub doc: String,
    /// Where it was declared.
    #[serde(skip)]
    pub origin: Origin,
}

impl OperationType {
    /// One without arguments and result.
    pub fn new(effect: Effect) -> Self {
        Self {
            args: Vec::new(),
            returns: None,
            effect,
            moves: false,
            settled_by: None,
            doc: String::new(),
            origin: Origin::NONE,
        }
    }

    /// The condition that settles a call of it on `component`.
    pub fn settled_by_for(&self, component: ComponentName) -> Option<Condition> {
        let mut condition = self.settled_by.clone()?;
        condition.for_each_component_mut(&mut |name| {
            if name.as_str() == SELF {
                *name = component;
            }
        });
        Some(condition)
    }
}

/// The component types a deployment may use, by name.
#[derive(Debug, Clone, Default)]
pub struct Catalogue {
    types: BTreeMap<TypeName, Arc<ComponentType>>,
    /// The same: names in their order are compared letter by letter, and a type is looked up again and again.
    by_name: FxHashMap<TypeName, Arc<ComponentType>>,
}

impl Catalogue {
    /// An empty one.
    pub fn new() -> Self {
        Self::default()
    }

    /// The types that the file of the subsystem of that path knows, by their names there.
    #[must_use]
    pub fn known_in(&self, path: Ident) -> Self {
        let mut known = Self::new();
        for ty in self.iter() {
            if let Some(name) = ty.name.local(path).and_then(|name| name.parse().ok()) {
                known.insert(ComponentType { name, ..ComponentType::clone(ty) });
            } else if !ty.name.as_str().contains('/') && !is_monitors(ty.name) {
                // The monitors of the parent are none of its own.
                known.insert(ty.clone());
            }
        }
        known
    }

    /// Adds a type; answers the one it replaced, if the name was taken.
    pub fn insert(&mut self, ty: impl Into<Arc<ComponentType>>) -> Option<Arc<ComponentType>> {
        let ty = ty.into();
        self.by_name.insert(ty.name, ty.clone());
        self.types.insert(ty.name, ty)
    }

    /// The type of that name.
    pub fn get(&self, name: TypeName) -> Option<&Arc<ComponentType>> {
        self.by_name.get(&name)
    }

    /// All types, by name.
    pub fn iter(&self) -> impl Iterator<Item = &Arc<ComponentType>> {
        self.types.values()
    }

    /// Adds all types of `other`.
    pub fn extend(&mut self, other: &Self) {
        self.types.extend(other.types.iter().map(|(name, ty)| (*name, ty.clone())));
        self.by_name.extend(other.by_name.iter().map(|(name, ty)| (*name, ty.clone())));
    }
}

impl ComponentType {
    /// A type without members; the builder methods below add them.
    ///
    /// # Panics
    /// When `name` is no type name: types are written by programmers.
    pub fn new(name: &str, doc: &str) -> Self {
        Self {
            name: TypeName::new(name).expect("a component type's name"),
            doc: doc.to_owned(),
            ports: BTreeMap::new(),
            properties: BTreeMap::new(),
            operations: BTreeMap::new(),
            raises: BTreeMap::new(),
            injections: BTreeMap::new(),
            start_after: Vec::new(),
            stop_before: Vec::new(),
            actuator: false,
            moves: Moves::default(),
            irreversible: Irreversible::default(),
            exclusive: Vec::new(),
            origin: Origin::NONE,
        }
    }

    /// The port of that name.
    pub fn port(&self, name: Ident) -> Option<&PortType> {
        self.ports.get(&name)
    }
}
