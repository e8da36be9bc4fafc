//! One property or port of a running deployment: what it is worth, and an operator's change of it.

use super::carried::shown;
use super::{Session, Unanswered};
use crate::limits;
use crate::model::finding::{did_you_mean, did_you_mean_path};
use crate::model::monitor::PortSignal;
use crate::model::{
    Ask, ChangeKind, ComponentName, ComponentType, ConfigId, Configuration, Direction, Ident, MemberRef, OperatorMay,
    RequestId, Value, ValueType,
};
use crate::time::lock;
use serde::Serialize;
use serde_json::Value as Json;
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What a member is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MemberKind {
    /// A property.
    Property,
    /// An in-port.
    In,
    /// An out-port.
    Out,
}

/// What `davit get --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MemberView {
    /// Which: `Component.member`.
    pub name: String,
    /// What it is.
    pub kind: MemberKind,
    /// Its type.
    #[serde(rename = "type")]
    pub ty: String,
    /// The unit, if its type states one.
    pub unit: Option<Arc<str>>,
    /// The value; none: there is none, or it cannot be shown, as `why` says. Of what a component sends a number that is not finite
    /// is a text: `inf`, `-inf`, `nan`.
    pub value: Option<Json>,
    /// When that was: of what a component sends when it was sent, else when it was read; in seconds of the deployment's clock.
    pub at: Option<f64>,
    /// Why there is no value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// The out-ports that drive it, where it is an in-port.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub driven_by: Vec<String>,
}

/// Why a member could not be read or set: one sentence, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct NoMember {
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: String,
}

pub(super) fn no(message: impl Into<String>, help: impl Into<String>) -> NoMember {
    NoMember { message: message.into(), help: help.into() }
}

/// A member that is there.
pub(super) struct FoundMember {
    pub member: MemberRef,
    pub kind: MemberKind,
    pub ty: ValueType,
    unit: Option<Arc<str>>,
}

/// What operators have set, as a configuration each.
#[derive(Default)]
pub(super) struct Settings {
    /// Held while something is being set: one at a time. Who only asks what has been set does not wait for that.
    one: Mutex<()>,
    all: Mutex<BTreeSet<ConfigId>>,
}

impl Session {
    /// What a property or port is worth now. Of what a component sends, within that (real) time.
    ///
    /// # Errors
    /// When there is none of that name, or the platform cannot be read.
    pub fn get(&self, name: &str, within: Duration) -> Result<MemberView, NoMember> {
        let FoundMember { member, kind, ty, unit } = self.member(name)?;
        let busy = |why: String| no(why, "something may keep it busy: `davit status` shows it");
        let seen = self.platform().observe_some(&[member.component], self.clock().now() + limits::VIEW);
        let seen = seen.map_err(|why| busy(why.to_string()))?;
        let now = self.clock().now().as_secs_f64();
        let driven_by: Vec<MemberRef> =
            seen.connections.keys().filter(|(_, to)| *to == member).map(|(from, _)| *from).collect();
        let json = |value: &Value| serde_json::to_value(value).expect("values are plain data");
        let (value, at, why) = match kind {
            MemberKind::Property => {
                let value = seen.components.get(&member.component).and_then(|c| c.properties.get(&member.member));
                (value.map(json), Some(now), value.is_none().then(|| "it is not there any more".to_owned()))
            }
            MemberKind::In if driven_by.is_empty() => {
                let value = seen.ports.get(&member);
                (value.map(json), value.map(|_| now), value.is_none().then(|| "it was never written".to_owned()))
            }
            MemberKind::In | MemberKind::Out => match self.sample(member, &ty, within) {
                Ok((value, at)) => (Some(value), Some(at), None),
                Err(why) => (None, None, Some(why)),
            },
        };
        let driven_by = driven_by.iter().map(ToString::to_string).collect();
        Ok(MemberView { name: member.to_string(), kind, ty: ty.to_string(), unit, value, at, why, driven_by })
    }

    /// Asks, in the name of an operator, for a frame of one change: that a property or port is worth this. `force`: also where
    /// the deployment's `operator:` does not list it.
    ///
    /// # Errors
    /// When there is nothing of that name that can be set to this.
    pub fn set(&self, line: u32, name: &str, value: &Json, force: bool) -> Result<RequestId, NoMember> {
        let FoundMember { member, kind, ty, .. } = self.member(name)?;
        let wanted = |why: String| no(format!("`{member}` is a {ty}: {why}"), format!("give a value of the type {ty}"));
        let value = value_of(value, &ty).map_err(wanted)?.fit(&ty).map_err(|why| wanted(why.to_string()))?;
        let change = match kind {
            MemberKind::Property => ChangeKind::PropertySet { property: member, value },
            MemberKind::In => ChangeKind::PortWrite { port: member, value },
            MemberKind::Out => {
                return Err(no(
                    format!("`{member}` is an out-port: its component alone sends on it"),
                    "an operator can set properties, and write in-ports that nothing drives",
                ));
            }
        };
        let id = ConfigId::setting(member);
        let configuration = Configuration::setting(id, change);
        let listed = self.deployment().operator.iter().any(|(may, _)| *may == OperatorMay::Set(member));
        // One at a time: what is asked for and has not begun must not become another value.
        let _one = lock(&self.settings().one);
        if self.hub().is_outstanding(Ask::Apply(id)) {
            return Err(no(format!("`{member}` is being set already"), "wait for the answer to that"));
        }
        if !self.configurator().define(configuration, listed, self.clock().now() + limits::VIEW) {
            return Err(no(Unanswered.to_string(), "something may keep it busy: `davit status` shows it"));
        }
        lock(&self.settings().all).insert(id);
        Ok(self.request_on(line, Ask::Apply(id), "operator", force))
    }

    /// The one of that name that an operator has set.
    pub fn setting(&self, name: &str) -> Option<ConfigId> {
        lock(&self.settings().all).iter().find(|id| id.as_str() == name).copied()
    }

    /// Of a component that is there.
    pub(super) fn member(&self, name: &str) -> Result<FoundMember, NoMember> {
        // Asked before it becomes a name: names are kept for ever.
        let (of, member) = name
            .split_once('.')
            .ok_or_else(|| no(format!("`{name}` names no property or port"), "it is written `Component.member`"))?;
        let system = self
            .system()
            .map_err(|unanswered| no(unanswered.to_string(), "try again: `davit status` shows what is known"))?;
        let component = system.components.iter().find(|(known, _)| known.as_str() == of);
        let (component, ty) = component
            .and_then(|(known, it)| Some((*known, self.platform().catalogue().get(it.ty)?)))
            .ok_or_else(|| {
                let known = system.components.keys().map(ComponentName::as_str);
                let help = match self.deployment().exported(of, member) {
                    Some(own) => format!("`{name}` is `{own}` here"),
                    None => did_you_mean_path(of, "components", known),
                };
                no(format!("there is no component `{of}`"), help)
            })?;
        if let Some((known, property)) = ty.properties.iter().find(|(known, _)| known.as_str() == member) {
            let (ty, unit) = (property.ty.clone(), property.unit.clone());
            return Ok(FoundMember { member: component.member(*known), kind: MemberKind::Property, ty, unit });
        }
        let port = ty.ports.iter().find(|(known, _)| known.as_str() == member);
        let (known, port) = port.ok_or_else(|| unknown(component, member, ty))?;
        let kind = if port.direction == Direction::In { MemberKind::In } else { MemberKind::Out };
        Ok(FoundMember { member: component.member(*known), kind, ty: port.ty.clone(), unit: port.unit.clone() })
    }

    /// The next that goes through a port.
    fn sample(&self, member: MemberRef, ty: &ValueType, within: Duration) -> Result<(Json, f64), String> {
        let look = RefCell::new(self.look_at(&PortSignal::whole(member), ty)?);
        let seen = self.hub().wait_outside(within, |hub| look.borrow_mut().seen(hub.now()));
        let (value, at) = seen.ok_or_else(|| format!("nothing went through it in {} s", within.as_secs_f64()))?;
        Ok((shown(&value), at.as_secs_f64()))
    }
}

fn unknown(component: ComponentName, member: &str, ty: &ComponentType) -> NoMember {
    let known = ty.properties.keys().chain(ty.ports.keys()).map(Ident::as_str);
    no(format!("`{component}` has no property or port `{member}`"), did_you_mean(member, "properties and ports", known))
}

/// A value as JSON has it, of this type if it is in order. Names of fields that the type does not have are kept nowhere.
fn value_of(json: &Json, ty: &ValueType) -> Result<Value, String> {
    Ok(match json {
        Json::Null => return Err("null is no value".to_owned()),
        Json::Bool(is) => Value::Bool(*is),
        Json::Number(number) => match number.as_i64() {
            Some(whole) => Value::Int(whole),
            None => Value::Float(number.as_f64().ok_or_else(|| format!("{number} is no number that can be kept"))?),
        },
        Json::String(text) => Value::str(text),
        Json::Array(elements) => {
            let of = if let ValueType::Array(of, _) = ty { of } else { ty };
            Value::Array(elements.iter().map(|element| value_of(element, of)).collect::<Result<_, _>>()?)
        }
        Json::Object(fields) => {
            let own: &[(Ident, ValueType)] = if let ValueType::Record(own) = ty { own } else { &[] };
            let field = |(name, value): (&String, &Json)| {
                let known = own.iter().find(|(known, _)| known.as_str() == name);
                let (known, of) = known.ok_or_else(|| format!("it has no field `{name}`"))?;
                Ok((*known, value_of(value, of)?))
            };
            Value::Record(fields.iter().map(field).collect::<Result<_, String>>()?)
        }
    })
}
