//! Configurations: what is to be changed, as written (paper §"Modeling configuration"; design §3).

use super::finding::Origin;
use super::monitor::Condition;
use super::names::{ComponentName, ConfigId, EventName, Ident, MemberRef, TypeName};
use super::run_state::RunState;
use super::value::Value;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

/// A named configuration.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// Its name.
    pub id: ConfigId,
    /// Run states to bring components to first, in this order.
    pub pre: Vec<StateEntry>,
    /// The set of changes. Kept in written order for messages; the order means nothing.
    pub changes: Vec<Change>,
    /// Run states to bring components to last, in this order.
    pub post: Vec<StateEntry>,
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
            pre: Vec::new(),
            changes: Vec::new(),
            post: Vec::new(),
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

/// An event that must come within a time, else the frame is popped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Confirm {
    /// The event.
    pub event: EventName,
    /// How long to wait for it.
    pub within: Duration,
}

/// One entry of a pre- or post-state list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateEntry {
    /// Whom it concerns.
    pub target: Target,
    /// The state demanded; never `faulted`.
    pub state: RunState,
    /// Where it was written.
    pub origin: Origin,
}

/// Whom an entry of a state list concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Target {
    /// One component.
    Component(ComponentName),
    /// `_default`: every component of the (sub)system that the same list does not name.
    Default,
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Component(name) => write!(f, "{name}"),
            Self::Default => f.write_str("_default"),
        }
    }
}

/// One change.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// What it does.
    pub kind: ChangeKind,
    /// Where it was written.
    pub origin: Origin,
}

/// The seven primitives.
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
}

/// A call of an operation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Call {
    /// The operation.
    pub operation: MemberRef,
    /// Its arguments.
    pub args: Vec<Value>,
}

impl ChangeKind {
    /// The primitive's name as it is written in both languages.
    pub fn verb(&self) -> &'static str {
        match self {
            Self::Create { .. } => "create",
            Self::Destroy { .. } => "destroy",
            Self::Connect { .. } => "connect",
            Self::Disconnect { .. } => "disconnect",
            Self::PropertySet { .. } => "property_set",
            Self::PortWrite { .. } => "port_write",
            Self::OperationCall { .. } => "operation_call",
        }
    }
}

/// How a connection carries samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, Default)]
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
