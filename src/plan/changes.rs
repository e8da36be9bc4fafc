//! The changes of a configuration: from an unordered set to steps with the order that they need (semantics: *Configurations*).
//!
//! The order is derived from what the changes touch, class by class: disconnect; destroy, on the legal path down; create;
//! what concerns one component; connect. Inside a class everything commutes, so each check sees the same system whatever
//! the written order was.

use super::StepId;
use super::builder::PlanBuilder;
use super::conflicts::{Sorted, Use, clash};
use super::meant::Meant;
use crate::model::{Change, ChangeKind, ComponentName, MemberRef, Origin, RunState, Step, Wanted};
use crate::system::{Undo, View, Violation, step};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

type After = SmallVec<[StepId; 4]>;

/// Steps that later ones may have to wait for.
#[derive(Default)]
struct ChangeWaits {
    create: FxHashMap<ComponentName, StepId>,
    destroy: FxHashMap<ComponentName, StepId>,
    /// The last of the chained disconnects of an in-port.
    cut: FxHashMap<MemberRef, StepId>,
    cuts_of: FxHashMap<ComponentName, Vec<StepId>>,
}

impl ChangeWaits {
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

pub(super) fn apply(b: &mut PlanBuilder<'_, '_, '_>, sorted: &Sorted) {
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
            ChangeKind::Replace { .. } => unreachable!("it was expanded"),
        };
        classes[class].push(u32::try_from(i).expect("fewer changes than that"));
    }
    if classes[2].len() + classes[4].len() > 64 {
        b.view.reserve(classes[2].len(), classes[4].len());
    }
    let mut waits = ChangeWaits::default();
    waits.create.reserve(classes[2].len());
    for i in classes.iter().flatten() {
        let change = &changes[*i as usize];
        let meant = Meant::of(&change.kind, b.view, b.context);
        match &change.kind {
            ChangeKind::Disconnect { from, to } => disconnect(b, &mut waits, *from, *to, change.origin, sorted),
            ChangeKind::Destroy { component } => destroy(b, &mut waits, *component, change.origin),
            ChangeKind::Create { component, .. } => create(b, &mut waits, *component, meant, change.origin),
            ChangeKind::PropertySet { property, .. } => {
                set(b, &waits, *property, meant.step, change, sorted, *i as usize);
            }
            ChangeKind::PortWrite { port, .. } => write(b, &waits, *port, meant.step, change, sorted.uses[*i as usize]),
            ChangeKind::OperationCall { .. } => operation(b, &waits, meant, change),
            ChangeKind::Connect { from, to, .. } => {
                connect(b, &waits, *from, *to, meant.step, change, &classes[4]);
            }
            ChangeKind::Replace { .. } => {}
        }
    }
    opposites(b, &classes[3]);
}

/// Two calls of which one takes the other one back: what stands in the end would depend on the order.
fn opposites(b: &mut PlanBuilder<'_, '_, '_>, own: &[u32]) {
    let changes = own.iter().map(|i| &b.configuration.changes[*i as usize]);
    let calls: Vec<(&Change, MemberRef)> = changes
        .filter_map(|change| match &change.kind {
            ChangeKind::OperationCall { call, .. } => Some((change, call.operation)),
            _ => None,
        })
        .collect();
    if calls.len() < 2 {
        return;
    }
    let taken_back_by = |change: &Change| {
        let meant = Meant::of(&change.kind, b.view, b.context);
        match step::inverse(&meant.step, meant.undo.as_ref(), b.view) {
            Undo::One(Step::Operation(call)) => Some(call.operation),
            _ => None,
        }
    };
    let backs: Vec<Option<MemberRef>> = calls.iter().map(|(change, _)| taken_back_by(change)).collect();
    for (second, (change, operation)) in calls.iter().enumerate() {
        let other =
            (0..second).find(|first| backs[*first] == Some(*operation) || backs[second] == Some(calls[*first].1));
        if let Some(first) = other {
            b.findings.push(clash(calls[first].0, change));
        }
    }
}

fn disconnect(
    b: &mut PlanBuilder<'_, '_, '_>,
    w: &mut ChangeWaits,
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

fn destroy(b: &mut PlanBuilder<'_, '_, '_>, w: &mut ChangeWaits, component: ComponentName, origin: Origin) {
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
    b: &mut PlanBuilder<'_, '_, '_>,
    w: &mut ChangeWaits,
    component: ComponentName,
    meant: Meant,
    origin: Origin,
) {
    let Meant { step: what, wrong, .. } = meant;
    let Step::Create { ty, .. } = &what else { return };
    let known = b.view.types().get(*ty).is_some();
    if !wrong.is_empty() {
        b.refuse(wrong, origin);
        if !known {
            b.blamed.insert(component);
        } else if b.view.component(component).is_none() {
            // It stands in the picture all the same, so that what concerns it is checked too.
            step::effect(&what, b.view);
        } else if !b.blamed.contains(&component) {
            b.refuse(vec![Violation::Exists(component)], origin);
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
fn rival<'c>(b: &PlanBuilder<'_, '_, 'c>, usage: Use) -> Option<&'c Change> {
    let configuration = b.configuration;
    let Use::Rival(first) = usage else { return None };
    let first = &configuration.changes[first];
    Meant::of(&first.kind, b.view, b.context).violations(b.view).is_empty().then_some(first)
}

fn set(
    b: &mut PlanBuilder<'_, '_, '_>,
    w: &ChangeWaits,
    property: MemberRef,
    what: Step,
    change: &Change,
    sorted: &Sorted,
    index: usize,
) {
    let mut after = After::new();
    w.created(property.component, &mut after);
    let present = b.view.component(property.component).and_then(|n| n.value(property.member));
    let fulfilled = matches!(&what, Step::PropertySet { value, .. } if present == Some(value));
    let create = sorted.created.get(&property.component).map(|i| &b.configuration.changes[*i]);
    let initial = create.filter(|c| match &c.kind {
        ChangeKind::Create { properties, .. } => properties.contains_key(&property.member) && present.is_some(),
        _ => false,
    });
    let rival = rival(b, sorted.uses[index]);
    if fulfilled || rival.is_some() || initial.is_some() {
        let found = step::precondition(&what, b.view);
        if !found.is_empty() {
            b.refuse(found, change.origin);
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

fn write(b: &mut PlanBuilder<'_, '_, '_>, w: &ChangeWaits, port: MemberRef, what: Step, change: &Change, usage: Use) {
    let mut after = After::new();
    w.created(port.component, &mut after);
    w.cut(port, &mut after);
    let present = step::written(port, b.view).flatten();
    let fulfilled = matches!(&what, Step::PortWrite { value, .. } if present.is_some() && value.as_ref() == present);
    if let Some(first) = rival(b, usage) {
        let found = step::precondition(&what, b.view);
        if !found.is_empty() {
            b.refuse(found, change.origin);
        } else if !fulfilled {
            b.findings.push(clash(first, change));
        }
    } else if fulfilled {
        let found = step::precondition(&what, b.view);
        if found.is_empty() {
            b.fulfilled(&what);
        } else {
            b.refuse(found, change.origin);
        }
    } else {
        b.step(what, None, change.origin, &after);
    }
}

fn operation(b: &mut PlanBuilder<'_, '_, '_>, w: &ChangeWaits, meant: Meant, change: &Change) {
    let mut after = After::new();
    for component in change.kind.components() {
        w.created(component, &mut after);
    }
    b.step(meant.step, meant.undo.as_ref(), change.origin, &after);
}

fn connect(
    b: &mut PlanBuilder<'_, '_, '_>,
    w: &ChangeWaits,
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
            b.refuse(found, change.origin);
            return;
        }
    }
    if found.is_empty() {
        b.allowed(what, None, change.origin, &after);
    } else {
        b.refuse(found, change.origin);
    }
}
