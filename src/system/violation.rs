//! Why a step may not happen, as data. What a user reads of it is in `advice`.

use crate::model::codes::{self, Code};
use crate::model::finding::{are, count};
use crate::model::{
    ComponentName, Ident, MemberClass, MemberRef, Origin, RunState, Transition, Tunable, TypeName, Value, ValueType,
};
use std::sync::Arc;

/// A false precondition of a step, or of what is made into one. `declared` is where the member at fault was declared.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)]
pub enum Violation {
    #[error("there is no component `{0}`")]
    UnknownComponent(ComponentName),
    #[error("there is no component type `{ty}`")]
    UnknownType { component: ComponentName, ty: TypeName },
    #[error("there is no activity `{activity}` for `{component}`")]
    UnknownActivity { component: ComponentName, activity: Ident, near: String },
    #[error("there is a component `{0}` already")]
    Exists(ComponentName),
    #[error("`{component}` cannot {transition}: it is {state}")]
    Transition { component: ComponentName, transition: Transition, state: RunState },
    #[error("`{component}` needs `{resource}` for itself, and `{by}` holds it")]
    ResourceHeld { component: ComponentName, resource: String, by: ComponentName },
    #[error("`{component}` is {state}; only an unconfigured or faulted component can be destroyed")]
    NotUnconfigured { component: ComponentName, state: RunState },
    #[error("`{component}` still has connections: {}", list(links))]
    StillConnected { component: ComponentName, links: Vec<(MemberRef, MemberRef)> },
    /// `types` are all that the component may be of. The member alone is quoted: a finding points at what it quotes first.
    #[error("{} ({}) has no {} `{}`", member.component, either(types), what, member.member)]
    UnknownMember { what: MemberClass, member: MemberRef, types: Vec<TypeName> },
    #[error("`{port}` is an in-port; a connection begins at an out-port")]
    NotOut { port: MemberRef, declared: Origin },
    #[error("`{port}` is an out-port; a connection ends at an in-port")]
    NotIn { port: MemberRef, declared: Origin },
    #[error("`{port}` is an out-port; only an in-port can be written")]
    WritesOut { port: MemberRef, declared: Origin },
    #[error("`{}` carries {}, `{}` takes {}", from.0, from_ty, to.0, to_ty)]
    PortTypes { from: (MemberRef, Origin), to: (MemberRef, Origin), from_ty: ValueType, to_ty: ValueType },
    #[error("`{}` is in {}, `{}` in {}", from.0, from_unit, to.0, to_unit)]
    PortUnits { from: (MemberRef, Origin), to: (MemberRef, Origin), from_unit: Arc<str>, to_unit: Arc<str> },
    #[error("`{from}` and `{to}` are connected already")]
    AlreadyConnected { from: MemberRef, to: MemberRef },
    #[error("`{from}` and `{to}` are not connected")]
    NotConnected { from: MemberRef, to: MemberRef },
    #[error("`{to}` is driven by {} already; a data connection must be the only one of its in-port", names(by))]
    DataAlone { to: MemberRef, by: Vec<MemberRef> },
    #[error("`{port}` takes only buffered connections")]
    NeedsBuffer { port: MemberRef, declared: Origin },
    #[error("the connection to `{0}` has a buffer without room for a sample")]
    BufferSize(MemberRef),
    #[error("`{property}` is tunable only while {}; `{}` is {state}", states(*tunable), property.component)]
    NotTunable { property: MemberRef, tunable: Tunable, state: RunState, declared: Origin },
    /// `wanted` is what fits, in words.
    #[error("`{slot}` cannot be {value}: {reason}")]
    BadValue { slot: MemberRef, value: String, reason: String, wanted: String, declared: Origin },
    #[error("`{}` is created without a value for `{}`, which has no default", property.component, property.member)]
    MissingProperty { property: MemberRef, ty: ValueType, declared: Origin },
    #[error("`{port}` is driven by {} and cannot be written", names(by))]
    Driven { port: MemberRef, by: Vec<MemberRef> },
    #[error("`{port}` is {} port and cannot be written", if *event { "an event" } else { "a buffered" })]
    NotWritable { port: MemberRef, event: bool, declared: Origin },
    #[error("`{operation}` takes {}, {} given", arguments(wanted.len()), are(*found))]
    ArgumentCount { operation: MemberRef, wanted: Vec<ValueType>, found: usize, declared: Origin },
    #[error("argument {position} of `{operation}` cannot be {value}: {reason}")]
    Argument {
        operation: MemberRef,
        position: usize,
        value: String,
        reason: String,
        wanted: Vec<ValueType>,
        declared: Origin,
    },
    /// A port of a component that is replaced, and what it is to be called.
    #[error("`{}` cannot become `{}`: {why}", from.0, to.0.member)]
    PortUnlike { from: (MemberRef, Origin), to: (MemberRef, Origin), why: String },
    #[error("`{port}` is connected to `{with}`, and {ty}, which replaces {}, has no port `{}`", port.component, port.member)]
    PortUnmapped { port: MemberRef, with: MemberRef, out: bool, ty: TypeName },
    #[error("`{component}` is created with {}, its type has {}", count(found, "value"), count(expected, "property"))]
    PropertyCount { component: ComponentName, expected: usize, found: usize },
}

fn list(links: &[(MemberRef, MemberRef)]) -> String {
    let shown: Vec<String> = links.iter().map(|(from, to)| format!("{from} -> {to}")).collect();
    shown.join(", ")
}

fn names(by: &[MemberRef]) -> String {
    let shown: Vec<String> = by.iter().map(|port| format!("`{port}`")).collect();
    if shown.is_empty() { "a connection".to_owned() } else { shown.join(", ") }
}

/// `Pid`, `Pid or Mpc`, `Lqr, Pid or Mpc`.
pub fn either(types: &[TypeName]) -> String {
    match types {
        [] => "of unknown type".to_owned(),
        [one] => one.to_string(),
        [most @ .., last] => {
            let most: Vec<&str> = most.iter().map(TypeName::as_str).collect();
            format!("{} or {last}", most.join(", "))
        }
    }
}

fn arguments(n: usize) -> String {
    if n == 0 { "no arguments".to_owned() } else { count(n, "argument") }
}

fn states(tunable: Tunable) -> &'static str {
    match tunable {
        Tunable::Unconfigured => "unconfigured",
        Tunable::Stopped => "unconfigured or stopped",
        Tunable::Always => "anything",
    }
}

/// A value in a message: as it is written, or what kind of value it is where that is long.
pub(super) fn brief(value: &Value) -> String {
    let text = value.to_string();
    if text.chars().count() <= 60 { text } else { value.describe() }
}

impl Violation {
    /// The stable code.
    pub fn code(&self) -> Code {
        self.kind().0
    }

    /// Whether it follows from the types of the components (and the deployment's activities) alone: then it is there in
    /// every system in which they are of these types. What is not depends on what is there, in which run state, and how it
    /// is connected.
    pub fn is_of_types(&self) -> bool {
        self.kind().1
    }

    /// What is to be known of each kind: its code, whether it follows from types alone, and the members it is about, each
    /// with where it was declared as far as the violation knows.
    pub(super) fn kind(&self) -> (Code, bool, [Option<(MemberRef, Origin)>; 2]) {
        let none = [None; 2];
        let one = |member: &MemberRef, declared: &Origin| [Some((*member, *declared)), None];
        let bare = |member: &MemberRef| one(member, &Origin::NONE);
        let two = |a: &MemberRef, b: &MemberRef| [a, b].map(|member| Some((*member, Origin::NONE)));
        match self {
            Self::UnknownComponent(_) => (codes::UNKNOWN_COMPONENT, false, none),
            Self::UnknownType { .. } => (codes::UNKNOWN_TYPE, true, none),
            Self::UnknownActivity { .. } => (codes::UNKNOWN_ACTIVITY, true, none),
            Self::Exists(_) => (codes::COMPONENT_EXISTS, false, none),
            Self::Transition { .. } => (codes::ILLEGAL_TRANSITION, false, none),
            Self::ResourceHeld { .. } => (codes::RESOURCE_HELD, false, none),
            Self::NotUnconfigured { .. } => (codes::NOT_UNCONFIGURED, false, none),
            Self::StillConnected { .. } => (codes::STILL_CONNECTED, false, none),
            Self::UnknownMember { what, member, .. } => {
                let code = match what {
                    MemberClass::Port => codes::UNKNOWN_PORT,
                    MemberClass::Property => codes::UNKNOWN_PROPERTY,
                    MemberClass::Operation => codes::UNKNOWN_OPERATION,
                };
                (code, true, bare(member))
            }
            Self::NotOut { port, declared } => (codes::NOT_AN_OUT_PORT, true, one(port, declared)),
            Self::NotIn { port, declared } | Self::WritesOut { port, declared } => {
                (codes::NOT_AN_IN_PORT, true, one(port, declared))
            }
            Self::PortTypes { from, to, .. } => (codes::PORT_TYPES, true, [Some(*from), Some(*to)]),
            Self::PortUnits { from, to, .. } => (codes::PORT_UNITS, true, [Some(*from), Some(*to)]),
            Self::AlreadyConnected { from, to } => (codes::ALREADY_CONNECTED, false, two(from, to)),
            Self::NotConnected { from, to } => (codes::NOT_CONNECTED, false, two(from, to)),
            Self::DataAlone { to, .. } => (codes::DATA_ALONE, false, bare(to)),
            Self::NeedsBuffer { port, declared } => (codes::NEEDS_BUFFER, true, one(port, declared)),
            Self::BufferSize(to) => (codes::BUFFER_SIZE, true, bare(to)),
            Self::NotTunable { property, declared, .. } => (codes::NOT_TUNABLE, false, one(property, declared)),
            Self::BadValue { slot, declared, .. } => (codes::BAD_VALUE, true, one(slot, declared)),
            Self::PropertyCount { .. } => (codes::BAD_VALUE, true, none),
            Self::MissingProperty { property, declared, .. } => {
                (codes::MISSING_PROPERTY, true, one(property, declared))
            }
            Self::Driven { port, .. } => (codes::PORT_DRIVEN, false, bare(port)),
            Self::NotWritable { port, declared, .. } => (codes::PORT_NOT_WRITABLE, true, one(port, declared)),
            Self::ArgumentCount { operation, declared, .. } | Self::Argument { operation, declared, .. } => {
                (codes::BAD_ARGUMENTS, true, one(operation, declared))
            }
            Self::PortUnlike { from, to, .. } => (codes::PORT_UNLIKE, true, [Some(*from), Some(*to)]),
            Self::PortUnmapped { port, with, .. } => (codes::PORT_UNMAPPED, false, two(port, with)),
        }
    }

    /// Whether it is the same mistake as `other`, if perhaps of another type: that `c` has no property `x`, that `c.k`
    /// cannot be so.
    pub fn is_like(&self, other: &Self) -> bool {
        self.code() == other.code() && self.members() == other.members()
    }

    /// Whether it is about a member of that component.
    pub fn is_about(&self, component: ComponentName) -> bool {
        self.members().iter().flatten().any(|member| member.component == component)
    }

    /// The members it is about.
    fn members(&self) -> [Option<MemberRef>; 2] {
        self.kind().2.map(|member| member.map(|(member, _)| member))
    }

    /// This violation where the component may be of the types of `other` as well.
    #[must_use]
    pub fn or(mut self, other: &Self) -> Self {
        if let (Self::UnknownMember { types, .. }, Self::UnknownMember { types: more, .. }) = (&mut self, other) {
            let new: Vec<TypeName> = more.iter().copied().filter(|ty| !types.contains(ty)).collect();
            types.extend(new);
        }
        self
    }
}
