//! The changes of a configuration: from an unordered set to steps with the order that they need (design §3).
//!
//! The order is derived from what the changes touch, class by class: disconnect; destroy, on the legal path down; create;
//! what concerns one component; connect. Inside a class everything commutes, so each check sees the same system whatever
//! the written order was.

use super::StepId;
use super::builder::Builder;
use super::conflicts::{Sorted, Use, clash};
use crate::model::codes;
use crate::model::finding::did_you_mean;
use crate::model::{
    Call, Change, ChangeKind, ComponentName, Finding, Ident, MemberRef, Origin, RunState, Step, TypeName, Value, Wanted,
};
use crate::system::{View, Violation, step};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::collections::BTreeMap;

type After = SmallVec<[StepId; 4]>;

/// Steps that later ones may have to wait for.
#[derive(Default)]
struct Waits {
    create: FxHashMap<ComponentName, StepId>,
    destroy: FxHashMap<ComponentName, StepId>,
    /// The last of the chained disconnects of an in-port.
    cut: FxHashMap<MemberRef, StepId>,
    cuts_of: FxHashMap<ComponentName, Vec<StepId>>,
}

impl Waits {
    fn created(&self, component: ComponentName, after: &mut After) {
        if !self.create.is_empty()
            && let Some(id) = self.create.get(&component)
            && !after.contains(id)
        {
            after.push(*id);
        }
    }

    fn cut(&self, port: MemberRef, after: &mut After) {
        if !self.cut.is_empty()
            && let Some(id) = self.cut.get(&port)
        {
            after.push(*id);
        }
    }
}

pub(super) fn apply(b: &mut Builder<'_, '_, '_>, sorted: &Sorted) {
    let changes = &b.configuration.changes;
    let mut classes: [Vec<u32>; 5] = Default::default();
    for (i, change) in changes.iter().enumerate() {
        if sorted.uses[i] == Use::No {
            continue;
        }
        let class = match &change.kind {
            ChangeKind::Disconnect { .. } => 0,
            ChangeKind::Destroy { .. } => 1,
            ChangeKind::Create { .. } => 2,
            ChangeKind::PropertySet { .. } | ChangeKind::PortWrite { .. } | ChangeKind::OperationCall { .. } => 3,
            ChangeKind::Connect { .. } => 4,
        };
        classes[class].push(u32::try_from(i).expect("fewer changes than that"));
    }
    if classes[2].len() + classes[4].len() > 64 {
        b.view.reserve(classes[2].len(), classes[4].len());
    }
    b.footprint.touches.reserve(classes[2].len() + 2 * classes[4].len());
    let mut waits = Waits::default();
    waits.create.reserve(classes[2].len());
    for i in classes.iter().flatten() {
        let change = &changes[*i as usize];
        match &change.kind {
            ChangeKind::Disconnect { from, to } => disconnect(b, &mut waits, *from, *to, change.origin, sorted),
            ChangeKind::Destroy { component } => destroy(b, &mut waits, *component, change.origin),
            ChangeKind::Create { component, ty, activity, properties } => {
                create(b, &mut waits, (*component, *ty, *activity), properties, change.origin);
            }
            ChangeKind::PropertySet { property, value } => {
                set(b, &waits, *property, value, change, sorted, *i as usize);
            }
            ChangeKind::PortWrite { port, value } => write(b, &waits, *port, value, change, sorted.uses[*i as usize]),
            ChangeKind::OperationCall { call, undo } => operation(b, &waits, call, undo.as_ref(), change.origin),
            ChangeKind::Connect { from, to, policy } => {
                let what = Step::Connect { from: *from, to: *to, policy: *policy };
                connect(b, &waits, *from, *to, what, change, &classes[4]);
            }
        }
    }
}

fn disconnect(
    b: &mut Builder<'_, '_, '_>,
    w: &mut Waits,
    from: MemberRef,
    to: MemberRef,
    origin: Origin,
    sorted: &Sorted,
) {
    let mut after = After::new();
    // Chained, so that what follows on this in-port waits for one step only.
    w.cut(to, &mut after);
    if let Some(id) = b.step(Step::Disconnect { from, to }, None, origin, &after) {
        w.cut.insert(to, id);
        if !sorted.destroyed.is_empty() {
            w.cuts_of.entry(from.component).or_default().push(id);
            w.cuts_of.entry(to.component).or_default().push(id);
        }
    }
}

fn destroy(b: &mut Builder<'_, '_, '_>, w: &mut Waits, component: ComponentName, origin: Origin) {
    let mut after = After::new();
    if let Some(state) = b.view.component(component).map(|n| n.state)
        && state != RunState::Faulted
    {
        for transition in state.path_to(Wanted::Unconfigured) {
            let step = Step::State { component, transition: *transition };
            let id = b.step(step, None, origin, &after);
            after = id.into_iter().collect();
        }
    }
    after.extend(w.cuts_of.remove(&component).unwrap_or_default());
    match b.step(Step::Destroy { component }, None, origin, &after) {
        Some(id) => _ = w.destroy.insert(component, id),
        None => _ = b.blamed.insert(component),
    }
}

fn create(
    b: &mut Builder<'_, '_, '_>,
    w: &mut Waits,
    (component, ty, activity): (ComponentName, TypeName, Option<Ident>),
    given: &BTreeMap<Ident, Value>,
    origin: Origin,
) {
    if let Some(name) = activity
        && !b.context.activities.contains(&name)
    {
        let known = b.context.activities.iter().map(|a| a.as_str());
        let help = did_you_mean(name.as_str(), "activities", known);
        let message = format!("`{component}` is to run in `{name}`, which is no activity of the deployment");
        b.findings.push(Finding::error(codes::UNKNOWN_ACTIVITY, message).at(origin).help(help));
    }
    let Some(declared) = b.view.types().get(ty).cloned() else {
        let what = Step::Create { component, ty, activity, properties: Vec::new() };
        b.refuse(&what, vec![Violation::UnknownType(ty)], origin);
        b.blamed.insert(component);
        return;
    };
    let wrong_before = b.findings.len();
    let mut properties = Vec::with_capacity(declared.properties.len());
    let mut used = 0;
    for (name, property) in &declared.properties {
        let slot = component.member(*name);
        let value = match (given.get(name), &property.default) {
            (Some(value), _) => {
                used += 1;
                property.fit(value.clone()).unwrap_or_else(|error| {
                    let message = format!("the value of `{slot}`: {error}");
                    let finding = Finding::error(codes::BAD_VALUE, message).at(origin);
                    b.findings.push(if property.origin.is_some() {
                        finding.also(property.origin, "declared here")
                    } else {
                        finding
                    });
                    value.clone()
                })
            }
            (None, Some(default)) => default.clone(),
            (None, None) => {
                let message = format!("`{component}` is created without a value for `{name}`, which has no default");
                let finding = Finding::error(codes::MISSING_PROPERTY, message)
                    .at(origin)
                    .help(format!("add properties = {{ {name} = … }} to the create"));
                b.findings.push(if property.origin.is_some() {
                    finding.also(property.origin, "declared here")
                } else {
                    finding
                });
                Value::Bool(false)
            }
        };
        properties.push(value);
    }
    if used < given.len() {
        for name in given.keys().filter(|name| !declared.properties.contains_key(*name)) {
            let known = declared.properties.keys().map(|n| n.as_str());
            let help = did_you_mean(name.as_str(), "properties", known);
            let message = format!("`{component}` ({ty}) has no property `{name}`");
            b.findings.push(Finding::error(codes::UNKNOWN_PROPERTY, message).at(origin).help(help));
        }
    }
    let what = Step::Create { component, ty, activity, properties };
    if b.findings.len() > wrong_before {
        // Told already; the component stands in the picture all the same, so that what concerns it is checked too.
        if b.view.component(component).is_none() {
            step::effect(&what, b.view);
        } else if !b.blamed.contains(&component) {
            b.refuse(&what, vec![Violation::Exists(component)], origin);
        }
        return;
    }
    if b.blamed.contains(&component) && b.view.component(component).is_some() {
        // Its destroy was refused; that it still exists is no second mistake.
        return;
    }
    let after: After =
        if w.destroy.is_empty() { After::new() } else { w.destroy.get(&component).copied().into_iter().collect() };
    if let Some(id) = b.step(what, None, origin, &after) {
        w.create.insert(component, id);
    }
}

/// The change that a rival change competes with, unless that one is wrong by itself.
fn rival<'c>(b: &Builder<'_, '_, 'c>, usage: Use) -> Option<&'c Change> {
    let configuration = b.configuration;
    let Use::Rival(first) = usage else { return None };
    let first = &configuration.changes[first];
    let what = match &first.kind {
        ChangeKind::PropertySet { property, value } => {
            Step::PropertySet { property: *property, value: fit_set(b, *property, value) }
        }
        ChangeKind::PortWrite { port, value } => {
            Step::PortWrite { port: *port, value: Some(fit_write(b, *port, value)) }
        }
        _ => return Some(first),
    };
    step::precondition(&what, b.view).is_empty().then_some(first)
}

fn fit_set(b: &Builder<'_, '_, '_>, property: MemberRef, value: &Value) -> Value {
    let declared = b.view.component(property.component).and_then(|n| n.property(property.member));
    declared.and_then(|(_, p)| p.fit(value.clone()).ok()).unwrap_or_else(|| value.clone())
}

fn fit_write(b: &Builder<'_, '_, '_>, port: MemberRef, value: &Value) -> Value {
    let declared = b.view.component(port.component).and_then(|n| n.port(port.member));
    declared.and_then(|(_, p)| value.clone().fit(&p.ty).ok()).unwrap_or_else(|| value.clone())
}

fn set(
    b: &mut Builder<'_, '_, '_>,
    w: &Waits,
    property: MemberRef,
    value: &Value,
    change: &Change,
    sorted: &Sorted,
    index: usize,
) {
    let mut after = After::new();
    w.created(property.component, &mut after);
    let fitted = fit_set(b, property, value);
    let what = Step::PropertySet { property, value: fitted.clone() };
    let present = b.view.component(property.component).and_then(|n| n.value(property.member));
    let fulfilled = present == Some(&fitted);
    let create = sorted.created.get(&property.component).map(|i| &b.configuration.changes[*i]);
    let initial = create.filter(|c| match &c.kind {
        ChangeKind::Create { properties, .. } => properties.contains_key(&property.member) && present.is_some(),
        _ => false,
    });
    let rival = rival(b, sorted.uses[index]);
    if fulfilled || rival.is_some() || initial.is_some() {
        let found = step::precondition(&what, b.view);
        if !found.is_empty() {
            b.refuse(&what, found, change.origin);
            return;
        }
    }
    if fulfilled {
        // A demand that is true already. On a component that is created here, the create is the write.
        if create.is_none() && rival.is_none() {
            b.fulfilled(&what);
        }
    } else if let Some(other) = initial.or(rival) {
        b.findings.push(clash(other, change));
    } else {
        b.step(what, None, change.origin, &after);
    }
}

fn write(b: &mut Builder<'_, '_, '_>, w: &Waits, port: MemberRef, value: &Value, change: &Change, usage: Use) {
    let mut after = After::new();
    w.created(port.component, &mut after);
    w.cut(port, &mut after);
    let fitted = fit_write(b, port, value);
    let fulfilled = matches!(step::written(port, b.view), Some(Some(present)) if present == fitted);
    let what = Step::PortWrite { port, value: Some(fitted.clone()) };
    if let Some(first) = rival(b, usage) {
        let found = step::precondition(&what, b.view);
        if !found.is_empty() {
            b.refuse(&what, found, change.origin);
        } else if !fulfilled {
            b.findings.push(clash(first, change));
        }
    } else if fulfilled {
        let found = step::precondition(&what, b.view);
        if found.is_empty() {
            b.fulfilled(&what);
        } else {
            b.refuse(&what, found, change.origin);
        }
    } else {
        b.step(what, None, change.origin, &after);
    }
}

/// A call with its arguments fitted where they can be; the precondition tells what is wrong with the others.
fn fit(b: &Builder<'_, '_, '_>, call: &Call) -> Call {
    let node = b.view.component(call.operation.component);
    let declared = node.and_then(|n| n.ty.operations.get(&call.operation.member));
    let args = call.args.iter().enumerate().map(|(i, value)| {
        let ty = declared.and_then(|o| o.args.get(i));
        ty.and_then(|ty| value.clone().fit(ty).ok()).unwrap_or_else(|| value.clone())
    });
    Call { operation: call.operation, args: args.collect() }
}

fn operation(b: &mut Builder<'_, '_, '_>, w: &Waits, call: &Call, undo: Option<&Call>, origin: Origin) {
    let mut after = After::new();
    w.created(call.operation.component, &mut after);
    if let Some(undo) = undo {
        w.created(undo.operation.component, &mut after);
    }
    let undo = undo.map(|u| fit(b, u));
    let what = Step::Operation(fit(b, call));
    b.step(what, undo.as_ref(), origin, &after);
}

fn connect(
    b: &mut Builder<'_, '_, '_>,
    w: &Waits,
    from: MemberRef,
    to: MemberRef,
    what: Step,
    change: &Change,
    connects: &[u32],
) {
    let mut after = After::new();
    w.created(from.component, &mut after);
    w.created(to.component, &mut after);
    w.cut(to, &mut after);
    let mut found = step::precondition(&what, b.view);
    if found.iter().any(|v| matches!(v, Violation::DataAlone { .. })) {
        // Driven by a connection of this very configuration: then the two clash, whichever is written first.
        let changes = &b.configuration.changes;
        let other = connects.iter().map(|i| &changes[*i as usize]).find(|other| match &other.kind {
            ChangeKind::Connect { from: f, to: t, .. } => *t == to && *f != from && b.view.link(*f, *t).is_some(),
            _ => false,
        });
        if let Some(other) = other {
            found.retain(|v| !matches!(v, Violation::DataAlone { .. }));
            // A connection that is wrong by itself competes with nothing.
            if found.is_empty() {
                b.findings.push(clash(other, change));
            }
            b.refuse(&what, found, change.origin);
            return;
        }
    }
    if found.is_empty() {
        b.allowed(what, None, change.origin, &after);
    } else {
        b.refuse(&what, found, change.origin);
    }
}
