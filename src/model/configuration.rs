//! Configurations: what is to be changed, as written (semantics: *Configurations*).

use super::component_type::MemberClass;
use super::finding::Origin;
use super::monitor::Condition;
use super::names::{ComponentName, ConfigId, EventName, Ident, MemberRef, TypeName};
use super::state_list::StateList;
use super::value::Value;
use serde::Serialize;
use smallvec::SmallVec;
use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

/// A named configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// Its name.
    pub id: ConfigId,
    /// Run states to bring components to first, in this order.
    pub pre: StateList,
    /// The set of changes. Kept in written order for messages; the order means nothing.
    pub changes: Vec<Change>,
    /// Run states to bring components to last, in this order.
    pub post: StateList,
    /// For the whole application; none: each step's own limit holds.
    pub timeout: Option<Duration>,
    /// Alternatives: applying one of a group replaces the group's frame.
    pub group: Option<Ident>,
    /// May be applied at any time, also when the system is broken; goes first.
    pub safe: bool,
    /// What to do when a step fails.
    pub on_failure: OnFailure,
    /// What it stands for: true once it has been applied, and watched while a frame of it is in force.
    pub holds: Option<Condition>,
    /// Popped again unless this comes in time.
    pub confirm: Option<Confirm>,
    /// The author knows that it contains steps that cannot be undone.
    pub irreversible: bool,
    /// What it is for.
    pub description: Option<String>,
    /// Where it was written.
    pub origin: Origin,
}

impl Configuration {
    /// An empty configuration.
    pub fn new(id: ConfigId) -> Self {
        Self {
            id,
            pre: StateList::default(),
            changes: Vec::new(),
            post: StateList::default(),
            timeout: None,
            group: None,
            safe: false,
            on_failure: OnFailure::Unset,
            holds: None,
            confirm: None,
            irreversible: false,
            description: None,
            origin: Origin::NONE,
        }
    }

    /// What an operator sets: one change.
    pub fn setting(id: ConfigId, kind: ChangeKind) -> Self {
        Self { changes: vec![Change { kind, origin: Origin::NONE }], ..Self::new(id) }
    }
}

/// What a failure of a step leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum OnFailure {
    /// Not said: what was done is undone, as far as undoing it moves nothing.
    #[default]
    Unset,
    /// What was done is undone, also where that moves hardware.
    Rollback,
    /// Nothing is undone; the answer is *broken*, what was done stays, and the coordinator decides.
    Hold,
}

impl OnFailure {
    /// What can be written, by its word.
    pub const WORDS: &'static [(&'static str, Self)] = &[("rollback", Self::Rollback), ("hold", Self::Hold)];
}

/// An event that must come within a time, else the frame is popped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Confirm {
    /// The event.
    pub event: EventName,
    /// How long to wait for it.
    pub within: Duration,
}

/// One change.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// What it does.
    pub kind: ChangeKind,
    /// Where it was written.
    pub origin: Origin,
}

/// The seven primitives, and what is made of them.
#[derive(Debug, Clone, PartialEq)]
pub enum ChangeKind {
    /// Create a component.
    Create {
        /// Its name.
        component: ComponentName,
        /// Its type.
        ty: TypeName,
        /// The activity it runs in.
        activity: Option<Ident>,
        /// Initial values; the others take their defaults.
        properties: BTreeMap<Ident, Value>,
    },
    /// Destroy a component, taking the legal path down first.
    Destroy {
        /// Its name.
        component: ComponentName,
    },
    /// Connect an out-port to an in-port.
    Connect {
        /// The out-port.
        from: MemberRef,
        /// The in-port.
        to: MemberRef,
        /// Latest value or FIFO.
        policy: Policy,
    },
    /// Remove a connection.
    Disconnect {
        /// The out-port.
        from: MemberRef,
        /// The in-port.
        to: MemberRef,
    },
    /// Set a property.
    PropertySet {
        /// The property.
        property: MemberRef,
        /// Its new value.
        value: Value,
    },
    /// Write a value on an in-port that nothing drives.
    PortWrite {
        /// The port.
        port: MemberRef,
        /// The value.
        value: Value,
    },
    /// Call an operation.
    OperationCall {
        /// The call.
        call: Call,
        /// The call that undoes it, if the configuration names one.
        undo: Option<Call>,
    },
    /// Put a new component in the place of one, with its connections. No primitive: the planner makes it of those that are.
    Replace {
        /// The name of both.
        component: ComponentName,
        /// The type of the new one.
        ty: TypeName,
        /// The activity the new one runs in; none: that of the old one.
        activity: Option<Ident>,
        /// Initial values of the new one; the others take their defaults.
        properties: BTreeMap<Ident, Value>,
        /// Ports of the old one, and what they are called on the new one; the others keep their names.
        map: BTreeMap<Ident, Ident>,
    },
}

/// A name that a change is written with: whoever walks through them needs to know no change.
#[derive(Debug)]
pub enum NameInChange<'a> {
    /// A component.
    Component(&'a mut ComponentName),
    /// The type of a component.
    Type(&'a mut TypeName),
    /// An activity.
    Activity(&'a mut Ident),
    /// A member of a component, and what it has to be.
    Member(&'a mut MemberRef, MemberClass),
}

/// A call of an operation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Call {
    /// The operation.
    pub operation: MemberRef,
    /// Its arguments.
    pub args: Vec<Value>,
}

/// `A.open(0.5, "fast")`.
impl fmt::Display for Call {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}(", self.operation)?;
        for (i, arg) in self.args.iter().enumerate() {
            write!(f, "{}{arg}", if i == 0 { "" } else { ", " })?;
        }
        f.write_str(")")
    }
}

impl ChangeKind {
    /// Its word as it is written in both languages.
    pub fn verb(&self) -> &'static str {
        match self {
            Self::Create { .. } => "create",
            Self::Destroy { .. } => "destroy",
            Self::Connect { .. } => "connect",
            Self::Disconnect { .. } => "disconnect",
            Self::PropertySet { .. } => "property_set",
            Self::PortWrite { .. } => "port_write",
            Self::OperationCall { .. } => "operation_call",
            Self::Replace { .. } => "replace",
        }
    }

    /// The component that it makes, with its type and the values that are given to it.
    pub fn makes(&self) -> Option<(ComponentName, TypeName, &BTreeMap<Ident, Value>)> {
        match self {
            Self::Create { component, ty, properties, .. } | Self::Replace { component, ty, properties, .. } => {
                Some((*component, *ty, properties))
            }
            _ => None,
        }
    }

    /// The components it names, each once: of a connection both ends, of a call that of its undo as well. What a replaced one
    /// is connected to is not named.
    pub fn components(&self) -> SmallVec<[ComponentName; 2]> {
        let (one, other) = match self {
            Self::Create { component, .. } | Self::Destroy { component } | Self::Replace { component, .. } => {
                (*component, None)
            }
            Self::Connect { from, to, .. } | Self::Disconnect { from, to } => (from.component, Some(to.component)),
            Self::PropertySet { property: member, .. } | Self::PortWrite { port: member, .. } => {
                (member.component, None)
            }
            Self::OperationCall { call, undo } => {
                (call.operation.component, undo.as_ref().map(|undo| undo.operation.component))
            }
        };
        std::iter::once(one).chain(other.filter(|other| *other != one)).collect()
    }
}

impl ChangeKind {
    /// Calls `f` with every name in it, in the order written: to put another in its place. Names of what a component's type has
    /// (its properties, the ports of a map) mean the same wherever it is.
    pub fn for_each_name_mut(&mut self, f: &mut impl FnMut(NameInChange<'_>)) {
        use MemberClass::{Operation, Port, Property};
        use NameInChange as N;
        match self {
            Self::Create { component, ty, activity, .. } | Self::Replace { component, ty, activity, .. } => {
                f(N::Component(component));
                f(N::Type(ty));
                activity.iter_mut().for_each(|activity| f(N::Activity(activity)));
            }
            Self::Destroy { component } => f(N::Component(component)),
            Self::Connect { from, to, .. } | Self::Disconnect { from, to } => {
                f(N::Member(from, Port));
                f(N::Member(to, Port));
            }
            Self::PropertySet { property, .. } => f(N::Member(property, Property)),
            Self::PortWrite { port, .. } => f(N::Member(port, Port)),
            Self::OperationCall { call, undo } => {
                std::iter::once(call).chain(undo).for_each(|call| f(N::Member(&mut call.operation, Operation)));
            }
        }
    }
}

/// As it is written, for messages: `connect A.y -> B.u (data)`, `operation_call A.open(0.5)`.
impl fmt::Display for ChangeKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Create { component, ty, .. } => write!(f, "create {component} : {ty}"),
            Self::Destroy { component } => write!(f, "destroy {component}"),
            Self::Connect { from, to, policy } => write!(f, "connect {from} -> {to} ({policy})"),
            Self::Disconnect { from, to } => write!(f, "disconnect {from} -> {to}"),
            Self::PropertySet { property, value } => write!(f, "property_set {property} = {value}"),
            Self::PortWrite { port, value } => write!(f, "port_write {port} = {value}"),
            Self::OperationCall { call, .. } => write!(f, "operation_call {call}"),
            Self::Replace { component, ty, .. } => write!(f, "replace {component} : {ty}"),
        }
    }
}

/// How a connection carries samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Default)]
#[serde(rename_all = "lowercase")]
pub enum Policy {
    /// The latest value.
    #[default]
    Data,
    /// A FIFO of at most so many samples (at least 1).
    Buffer(u32),
}

impl fmt::Display for Policy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Data => f.write_str("data"),
            Self::Buffer(n) => write!(f, "buffer({n})"),
        }
    }
}
