//! Steps: primitives with their operands resolved, the only thing a platform is ever asked to do.

use super::configuration::{Call, Policy};
use super::names::{ComponentName, Ident, MemberRef, TypeName};
use super::run_state::Transition;
use super::value::Value;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use std::fmt;

/// One primitive, resolved: every value is of the type its slot has, every property of a created component has a value.
///
/// When it may happen, what it does to the picture of a system, and which steps undo it, is in `system::step`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// Move a component's run state.
    State {
        /// The component.
        component: ComponentName,
        /// The move.
        transition: Transition,
    },
    /// Create a component, unconfigured, with these values.
    Create {
        /// Its name.
        component: ComponentName,
        /// Its type.
        ty: TypeName,
        /// The activity it runs in.
        activity: Option<Ident>,
        /// The value of every property, in the type's (alphabetical) order.
        properties: Vec<Value>,
    },
    /// Destroy an unconfigured (or faulted) component without connections.
    Destroy {
        /// The component.
        component: ComponentName,
    },
    /// Connect.
    Connect {
        /// The out-port.
        from: MemberRef,
        /// The in-port.
        to: MemberRef,
        /// Latest value or FIFO.
        policy: Policy,
    },
    /// Disconnect.
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
    /// Write an in-port that nothing drives.
    PortWrite {
        /// The port.
        port: MemberRef,
        /// The value; none restores "never written".
        value: Option<Value>,
    },
    /// Call an operation.
    Operation(Call),
}

impl Step {
    /// What it does, as printed: `configure`, `start`, `stop`, `cleanup` or the primitive's name.
    pub fn verb(&self) -> &'static str {
        match self {
            Self::State { transition, .. } => transition.as_str(),
            Self::Create { .. } => "create",
            Self::Destroy { .. } => "destroy",
            Self::Connect { .. } => "connect",
            Self::Disconnect { .. } => "disconnect",
            Self::PropertySet { .. } => "property_set",
            Self::PortWrite { .. } => "port_write",
            Self::Operation(_) => "operation_call",
        }
    }

    /// The component it is done to (of a connection: that of the in-port).
    pub fn component(&self) -> ComponentName {
        match self {
            Self::State { component, .. } | Self::Create { component, .. } | Self::Destroy { component } => *component,
            Self::Connect { to, .. } | Self::Disconnect { to, .. } => to.component,
            Self::PropertySet { property, .. } => property.component,
            Self::PortWrite { port, .. } => port.component,
            Self::Operation(call) => call.operation.component,
        }
    }
}

/// `start Dynamics`, `connect A.y -> B.u (data)`, `property_set B.k = 2.0`.
impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::State { component, transition } => write!(f, "{transition} {component}"),
            Self::Create { component, ty, .. } => write!(f, "create {component} : {ty}"),
            Self::Destroy { component } => write!(f, "destroy {component}"),
            Self::Connect { from, to, policy } => write!(f, "connect {from} -> {to} ({policy})"),
            Self::Disconnect { from, to } => write!(f, "disconnect {from} -> {to}"),
            Self::PropertySet { property, value } => write!(f, "property_set {property} = {value}"),
            Self::PortWrite { port, value: Some(value) } => write!(f, "port_write {port} = {value}"),
            Self::PortWrite { port, value: None } => write!(f, "port_write {port} = never written"),
            Self::Operation(call) => write!(f, "operation_call {call}"),
        }
    }
}

/// `do`, `target` and what else belongs to it: `{"do": "property_set", "target": "B.k", "value": 2.0}`.
impl Serialize for Step {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        let mut view = s.serialize_map(None)?;
        view.serialize_entry("do", self.verb())?;
        match self {
            Self::State { component, .. } | Self::Destroy { component } => view.serialize_entry("target", component)?,
            Self::Create { component, ty, activity, properties } => {
                view.serialize_entry("target", component)?;
                view.serialize_entry("type", ty)?;
                view.serialize_entry("activity", activity)?;
                view.serialize_entry("value", properties)?;
            }
            Self::Connect { from, to, policy } => {
                ends(&mut view, from, to)?;
                view.serialize_entry("policy", policy)?;
            }
            Self::Disconnect { from, to } => ends(&mut view, from, to)?,
            Self::PropertySet { property, value } => {
                view.serialize_entry("target", property)?;
                view.serialize_entry("value", value)?;
            }
            Self::PortWrite { port, value } => {
                view.serialize_entry("target", port)?;
                view.serialize_entry("value", value)?;
            }
            Self::Operation(call) => {
                view.serialize_entry("target", &call.operation)?;
                view.serialize_entry("args", &call.args)?;
                view.serialize_entry("value", &call.args)?;
            }
        }
        view.end()
    }
}

fn ends<M: SerializeMap>(view: &mut M, from: &MemberRef, to: &MemberRef) -> Result<(), M::Error> {
    view.serialize_entry("target", to)?;
    view.serialize_entry("from", from)?;
    view.serialize_entry("to", to)
}
