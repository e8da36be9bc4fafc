//! Why a step may not happen, as data.

use super::View;
use crate::model::codes::{self, Code};
use crate::model::finding::did_you_mean;
use crate::model::{ComponentName, Ident, MemberRef, RunState, Transition, Tunable, TypeName, ValueType};
use std::sync::Arc;

/// A false precondition of a step.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)]
pub enum Violation {
    #[error("there is no component `{0}`")]
    UnknownComponent(ComponentName),
    #[error("there is no component type `{0}`")]
    UnknownType(TypeName),
    #[error("there is a component `{0}` already")]
    Exists(ComponentName),
    #[error("`{component}` cannot {transition}: it is {state}")]
    Transition { component: ComponentName, transition: Transition, state: RunState },
    #[error("`{component}` is {state}; only an unconfigured or faulted component can be destroyed")]
    NotUnconfigured { component: ComponentName, state: RunState },
    #[error("`{component}` still has connections: {}", list(links))]
    StillConnected { component: ComponentName, links: Vec<(MemberRef, MemberRef)> },
    #[error("`{}` ({ty}) has no port `{}`", port.component, port.member)]
    UnknownPort { port: MemberRef, ty: TypeName },
    #[error("`{}` ({ty}) has no property `{}`", property.component, property.member)]
    UnknownProperty { property: MemberRef, ty: TypeName },
    #[error("`{}` ({ty}) has no operation `{}`", operation.component, operation.member)]
    UnknownOperation { operation: MemberRef, ty: TypeName },
    #[error("`{0}` is an in-port; a connection begins at an out-port")]
    NotOut(MemberRef),
    #[error("`{0}` is an out-port; only an in-port can be connected to or written")]
    NotIn(MemberRef),
    #[error("`{from}` carries {from_ty}, `{to}` takes {to_ty}")]
    PortTypes { from: MemberRef, to: MemberRef, from_ty: ValueType, to_ty: ValueType },
    #[error("`{from}` is in {from_unit}, `{to}` in {to_unit}")]
    PortUnits { from: MemberRef, to: MemberRef, from_unit: Arc<str>, to_unit: Arc<str> },
    #[error("`{from}` and `{to}` are connected already")]
    AlreadyConnected { from: MemberRef, to: MemberRef },
    #[error("`{from}` and `{to}` are not connected")]
    NotConnected { from: MemberRef, to: MemberRef },
    #[error("`{to}` is driven by {} already; a data connection must be the only one of its in-port", names(by))]
    DataAlone { to: MemberRef, by: Vec<MemberRef> },
    #[error("`{0}` takes only buffered connections")]
    NeedsBuffer(MemberRef),
    #[error("the connection to `{0}` has a buffer without room for a sample")]
    BufferSize(MemberRef),
    #[error("`{property}` is tunable only while {}; `{}` is {state}", states(*tunable), property.component)]
    NotTunable { property: MemberRef, tunable: Tunable, state: RunState },
    #[error("the value of `{slot}`: {reason}")]
    BadValue { slot: MemberRef, reason: String },
    #[error("`{port}` is driven by {} and cannot be written", names(by))]
    Driven { port: MemberRef, by: Vec<MemberRef> },
    #[error("`{port}` is {} port and cannot be written", if *event { "an event" } else { "a buffered" })]
    NotWritable { port: MemberRef, event: bool },
    #[error("`{operation}` takes {expected} arguments, {found} are given")]
    ArgumentCount { operation: MemberRef, expected: usize, found: usize },
    #[error("argument {position} of `{operation}`: {reason}")]
    Argument { operation: MemberRef, position: usize, reason: String },
    #[error("`{component}` is created with {found} values, its type has {expected} properties")]
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

fn states(tunable: Tunable) -> &'static str {
    match tunable {
        Tunable::Unconfigured => "unconfigured",
        Tunable::Stopped => "unconfigured or stopped",
        Tunable::Always => "anything",
    }
}

impl Violation {
    /// The stable code.
    pub fn code(&self) -> Code {
        match self {
            Self::UnknownComponent(_) => codes::UNKNOWN_COMPONENT,
            Self::UnknownType(_) => codes::UNKNOWN_TYPE,
            Self::Exists(_) => codes::COMPONENT_EXISTS,
            Self::Transition { .. } => codes::ILLEGAL_TRANSITION,
            Self::NotUnconfigured { .. } => codes::NOT_UNCONFIGURED,
            Self::StillConnected { .. } => codes::STILL_CONNECTED,
            Self::UnknownPort { .. } => codes::UNKNOWN_PORT,
            Self::UnknownProperty { .. } => codes::UNKNOWN_PROPERTY,
            Self::UnknownOperation { .. } => codes::UNKNOWN_OPERATION,
            Self::NotOut(_) => codes::NOT_AN_OUT_PORT,
            Self::NotIn(_) => codes::NOT_AN_IN_PORT,
            Self::PortTypes { .. } => codes::PORT_TYPES,
            Self::PortUnits { .. } => codes::PORT_UNITS,
            Self::AlreadyConnected { .. } => codes::ALREADY_CONNECTED,
            Self::NotConnected { .. } => codes::NOT_CONNECTED,
            Self::DataAlone { .. } => codes::DATA_ALONE,
            Self::NeedsBuffer(_) => codes::NEEDS_BUFFER,
            Self::BufferSize(_) => codes::BUFFER_SIZE,
            Self::NotTunable { .. } => codes::NOT_TUNABLE,
            Self::BadValue { .. } | Self::PropertyCount { .. } => codes::BAD_VALUE,
            Self::Driven { .. } => codes::PORT_DRIVEN,
            Self::NotWritable { .. } => codes::PORT_NOT_WRITABLE,
            Self::ArgumentCount { .. } | Self::Argument { .. } => codes::BAD_ARGUMENTS,
        }
    }

    /// What to do about it, with near names where a name is unknown in `view`.
    pub fn help(&self, view: &impl View) -> Option<String> {
        let members = |component: ComponentName, pick: fn(&super::Node) -> Vec<Ident>| {
            view.component(component).map(pick).unwrap_or_default()
        };
        Some(match self {
            Self::UnknownComponent(name) => {
                let mut known = Vec::new();
                view.for_each_component(&mut |node| known.push(node.name));
                known.sort_unstable();
                did_you_mean(name.as_str(), "components", known.iter().map(|n| n.as_str()))
            }
            Self::UnknownType(name) => {
                let known: Vec<TypeName> = view.types().iter().map(|t| t.name).collect();
                did_you_mean(name.as_str(), "component types", known.iter().map(|n| n.as_str()))
            }
            Self::UnknownPort { port, .. } => {
                let known = members(port.component, |n| n.ty.ports.keys().copied().collect());
                did_you_mean(port.member.as_str(), "ports", known.iter().map(|n| n.as_str()))
            }
            Self::UnknownProperty { property, .. } => {
                let known = members(property.component, |n| n.ty.properties.keys().copied().collect());
                did_you_mean(property.member.as_str(), "properties", known.iter().map(|n| n.as_str()))
            }
            Self::UnknownOperation { operation, .. } => {
                let known = members(operation.component, |n| n.ty.operations.keys().copied().collect());
                did_you_mean(operation.member.as_str(), "operations", known.iter().map(|n| n.as_str()))
            }
            Self::Exists(name) => format!("destroy `{name}` in the same configuration, or choose another name"),
            Self::StillConnected { links, .. } => {
                let shown: Vec<String> =
                    links.iter().map(|(from, to)| format!("disconnect(\"{from}\", \"{to}\")")).collect();
                format!("add {}", shown.join(", "))
            }
            Self::NotOut(_) | Self::NotIn(_) => "are the two ends exchanged? connect(out_port, in_port)".to_owned(),
            Self::AlreadyConnected { from, to } => {
                format!("to change the policy add disconnect(\"{from}\", \"{to}\") to the same configuration")
            }
            Self::DataAlone { to, by } | Self::Driven { port: to, by } => match by.first() {
                Some(from) => format!("add disconnect(\"{from}\", \"{to}\") to the same configuration"),
                None => return None,
            },
            Self::NeedsBuffer(_) => "give a policy: { buffer = 64 }".to_owned(),
            Self::NotTunable { property, tunable, .. } => {
                let state = if *tunable == Tunable::Unconfigured { "unconfigured" } else { "stopped" };
                let c = property.component;
                format!("add \"{c}:{state}\" to pre_conf_state, and \"{c}:running\" to post_conf_state")
            }
            _ => return None,
        })
    }
}
