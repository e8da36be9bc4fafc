//! The step that a change means in a given system, its values fitted to what they are for. What `check` looks at and what
//! is planned is the same.

use super::PlanContext;
use super::replace::renamed;
use crate::model::finding::did_you_mean;
use crate::model::{Call, ChangeKind, ComponentName, Ident, MemberRef, Step, TypeName, Value};
use crate::system::{MemberClass, View, Violation, step};
use std::collections::BTreeMap;

/// What a change means.
#[derive(Debug, Clone, PartialEq)]
pub struct Meant {
    /// The step. Values that cannot be fitted stand in it as they are written; its precondition tells what is wrong with
    /// them.
    pub step: Step,
    /// The call that undoes it, where the change names one.
    pub undo: Option<Call>,
    /// What no step can say: of a create, that a property is not there, has no value, or cannot have that one.
    pub wrong: Vec<Violation>,
}

impl Meant {
    /// What `kind` means in `view`.
    pub fn of(kind: &ChangeKind, view: &impl View, context: &PlanContext) -> Self {
        let mut wrong = Vec::new();
        let mut named = None;
        let step = match kind {
            // Of a replacement what can be told without the system that it meets: the new component, and the names of ports.
            ChangeKind::Create { component, ty, activity, properties }
            | ChangeKind::Replace { component, ty, activity, properties, .. } => {
                if let Some(activity) = activity.filter(|name| !context.activities.contains(name)) {
                    let known = context.activities.iter().map(Ident::as_str);
                    let near = did_you_mean(activity.as_str(), "activities", known);
                    wrong.push(Violation::UnknownActivity { component: *component, activity, near });
                }
                let properties = initial(*component, *ty, properties, view, &mut wrong);
                if let ChangeKind::Replace { map, .. } = kind {
                    wrong.extend(renamed(*component, *ty, map, view));
                }
                Step::Create { component: *component, ty: *ty, activity: *activity, properties }
            }
            ChangeKind::Destroy { component } => Step::Destroy { component: *component },
            ChangeKind::Connect { from, to, policy } => Step::Connect { from: *from, to: *to, policy: *policy },
            ChangeKind::Disconnect { from, to } => Step::Disconnect { from: *from, to: *to },
            ChangeKind::PropertySet { property, value } => {
                let declared = view.component(property.component).and_then(|n| n.property(property.member));
                let fitted = declared.and_then(|(_, p)| p.fit(value.clone()).ok());
                Step::PropertySet { property: *property, value: fitted.unwrap_or_else(|| value.clone()) }
            }
            ChangeKind::PortWrite { port, value } => {
                let declared = view.component(port.component).and_then(|n| n.port(port.member));
                let fitted = declared.and_then(|(_, p)| value.clone().fit(&p.ty).ok());
                Step::PortWrite { port: *port, value: Some(fitted.unwrap_or_else(|| value.clone())) }
            }
            ChangeKind::OperationCall { call, undo } => {
                named = undo.as_ref().map(|undo| fitted(undo, view));
                Step::Operation(fitted(call, view))
            }
        };
        Self { step, undo: named, wrong }
    }

    /// Why it may not happen in `view`, that of the call which undoes it included.
    pub fn violations(&self, view: &impl View) -> Vec<Violation> {
        // A create that is wrong as it is written is no step to be looked at.
        if !self.wrong.is_empty() {
            return self.wrong.clone();
        }
        let mut found = step::precondition(&self.step, view);
        if let Some(undo) = &self.undo {
            found.extend(step::precondition(&Step::Operation(undo.clone()), view));
        }
        found
    }
}

/// The values that a component is created with, in its type's order.
fn initial(
    component: ComponentName,
    ty: TypeName,
    given: &BTreeMap<Ident, Value>,
    view: &impl View,
    wrong: &mut Vec<Violation>,
) -> Vec<Value> {
    let Some(declared) = view.types().get(ty) else {
        wrong.push(Violation::UnknownType { component, ty });
        return Vec::new();
    };
    let mut used = 0;
    let values = declared.properties.iter().map(|(name, property)| {
        let slot = component.member(*name);
        match (given.get(name), &property.default) {
            (Some(value), _) => {
                used += 1;
                property.fit(value.clone()).unwrap_or_else(|_| {
                    wrong.extend(step::bad_value(slot, property, value));
                    value.clone()
                })
            }
            (None, Some(default)) => default.clone(),
            (None, None) => {
                let (ty, declared) = (property.ty.clone(), property.origin);
                wrong.push(Violation::MissingProperty { property: slot, ty, declared });
                Value::Bool(false)
            }
        }
    });
    let values = values.collect();
    if used < given.len() {
        let unknown = given.keys().filter(|name| !declared.properties.contains_key(*name));
        let lacking = |member: MemberRef| Violation::UnknownMember {
            what: MemberClass::Property,
            member,
            types: vec![declared.name],
        };
        wrong.extend(unknown.map(|name| lacking(component.member(*name))));
    }
    values
}

/// A call with its arguments fitted where they can be.
fn fitted(call: &Call, view: &impl View) -> Call {
    let node = view.component(call.operation.component);
    let declared = node.and_then(|n| n.ty.operations.get(&call.operation.member));
    let args = call.args.iter().enumerate().map(|(i, value)| {
        let ty = declared.and_then(|o| o.args.get(i));
        ty.and_then(|ty| value.clone().fit(ty).ok()).unwrap_or_else(|| value.clone())
    });
    Call { operation: call.operation, args: args.collect() }
}
