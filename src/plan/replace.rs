//! Replacing a component: made of the changes that do it, on the system it meets (semantics: *Configurations*).
//!
//! What is connected is known only there, so a configuration is expanded when it is planned; what plans sees primitives only.

use super::conflicts::clash;
use crate::model::{Change, ChangeKind, ComponentName, Configuration, Findings, Ident, MemberRef, Origin, TypeName};
use crate::system::{MemberClass, Overlay, View, Violation};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// A configuration without replacements, and the components that it replaces, with where that is said.
pub(super) struct Expanded<'c> {
    pub(super) configuration: Cow<'c, Configuration>,
    pub(super) replaced: Vec<(ComponentName, Origin)>,
}

/// One that replaces a component.
struct Replacement<'c> {
    component: ComponentName,
    ty: TypeName,
    map: &'c BTreeMap<Ident, Ident>,
    origin: Origin,
    /// Its map is wrong, or its type unknown: what becomes of its connections is not judged.
    wrong: bool,
}

pub(super) fn expand<'c>(
    configuration: &'c Configuration,
    view: &Overlay<'_>,
    findings: &mut Findings,
) -> Expanded<'c> {
    let is_one = |change: &&Change| matches!(change.kind, ChangeKind::Replace { .. });
    if !configuration.changes.iter().any(|change| is_one(&change)) {
        return Expanded { configuration: Cow::Borrowed(configuration), replaced: Vec::new() };
    }
    let mut first: BTreeMap<ComponentName, &Change> = BTreeMap::new();
    // Of two different ones neither is made: what follows from the one or the other would depend on the written order.
    let mut disputed: BTreeSet<ComponentName> = BTreeSet::new();
    for change in &configuration.changes {
        let ChangeKind::Replace { component, .. } = &change.kind else { continue };
        let other = *first.entry(*component).or_insert(change);
        if other.kind != change.kind {
            findings.push(clash(other, change));
            disputed.insert(*component);
        }
    }
    let mut changes = Vec::with_capacity(configuration.changes.len() + 8);
    changes.extend(configuration.changes.iter().filter(|change| !is_one(change)).cloned());
    let mut all: BTreeMap<ComponentName, Replacement<'_>> = BTreeMap::new();
    for (component, change) in first.into_iter().filter(|(component, _)| !disputed.contains(component)) {
        let ChangeKind::Replace { ty, activity, properties, map, .. } = &change.kind else { continue };
        let (ty, origin) = (*ty, change.origin);
        let found = renamed(component, ty, map, view);
        let wrong = !found.is_empty() || view.types().get(ty).is_none();
        findings.extend(found.iter().map(|violation| violation.finding(view).at(origin)));
        all.insert(component, Replacement { component, ty, map, origin, wrong });
        let activity = activity.or_else(|| view.component(component).and_then(|old| old.activity));
        let create = ChangeKind::Create { component, ty, activity, properties: properties.clone() };
        changes.extend([ChangeKind::Destroy { component }, create].map(|kind| Change { kind, origin }));
    }
    let ended: BTreeSet<(MemberRef, MemberRef)> = configuration
        .changes
        .iter()
        .filter_map(|change| match change.kind {
            ChangeKind::Disconnect { from, to } => Some((from, to)),
            _ => None,
        })
        .collect();
    let connected = all.keys().any(|component| view.component(*component).is_some_and(|old| old.degree > 0));
    let mut links = Vec::new();
    if connected {
        view.for_each_link(&mut |from, to, policy| {
            if all.contains_key(&from.component) || all.contains_key(&to.component) {
                links.push((from, to, policy));
            }
        });
    }
    // In an order that is the same every run.
    links.sort_unstable();
    for (from, to, policy) in links.into_iter().filter(|(from, to, _)| !ended.contains(&(*from, *to))) {
        let of = |end: MemberRef| all.get(&end.component);
        let Some(origin) = of(from).or_else(|| of(to)).map(|one| one.origin) else { continue };
        changes.push(Change { kind: ChangeKind::Disconnect { from, to }, origin });
        let new = |end, other, out, findings: &mut Findings| match of(end) {
            Some(one) => one.end(end, other, out, view, findings),
            None => Some(end),
        };
        let (from, to) = (new(from, to, true, findings), new(to, from, false, findings));
        if let Some((from, to)) = from.zip(to) {
            changes.push(Change { kind: ChangeKind::Connect { from, to, policy }, origin });
        }
    }
    let replaced = all.into_values().map(|one| (one.component, one.origin)).collect();
    Expanded { configuration: Cow::Owned(Configuration { changes, ..configuration.clone() }), replaced }
}

impl Replacement<'_> {
    /// What a connected port of the old one is on the new one.
    fn end(
        &self,
        port: MemberRef,
        with: MemberRef,
        out: bool,
        view: &Overlay<'_>,
        findings: &mut Findings,
    ) -> Option<MemberRef> {
        if self.wrong {
            return None;
        }
        let name = self.map.get(&port.member).copied().unwrap_or(port.member);
        if view.types().get(self.ty).is_some_and(|ty| ty.ports.contains_key(&name)) {
            return Some(self.component.member(name));
        }
        let violation = Violation::PortUnmapped { port, with, out, ty: self.ty };
        findings.push(violation.finding(view).at(self.origin));
        None
    }
}

/// What is wrong with the names that ports of `component` are to have when it is replaced by one of type `ty`. Of a component
/// or a type that is not there nothing is said.
pub(super) fn renamed(
    component: ComponentName,
    ty: TypeName,
    map: &BTreeMap<Ident, Ident>,
    view: &impl View,
) -> Vec<Violation> {
    let (old, new) = (view.component(component).map(|node| &node.ty), view.types().get(ty));
    let (Some(old), Some(new)) = (old, new) else { return Vec::new() };
    let mut wrong = Vec::new();
    for (from, to) in map {
        let (before, after) = (component.member(*from), component.member(*to));
        let lacking =
            |member, ty: TypeName| Violation::UnknownMember { what: MemberClass::Port, member, types: vec![ty] };
        match (old.ports.get(from), new.ports.get(to)) {
            (Some(one), Some(other)) => {
                let units = one.unit.as_ref().zip(other.unit.as_ref());
                let why = if one.direction != other.direction {
                    format!("that is an {}-port, this one an {}-port", other.direction.word(), one.direction.word())
                } else if one.ty != other.ty {
                    format!("that is of type {}, this one {}", other.ty, one.ty)
                } else if let Some((one, other)) = units.filter(|(one, other)| one != other) {
                    format!("that is in {other}, this one in {one}")
                } else {
                    continue;
                };
                wrong.push(Violation::PortUnlike { from: (before, one.origin), to: (after, other.origin), why });
            }
            (one, other) => {
                if one.is_none() {
                    wrong.push(lacking(before, old.name));
                }
                if other.is_none() {
                    wrong.push(lacking(after, ty));
                }
            }
        }
    }
    wrong
}

/// Components that what `configuration` replaces is connected to now: it touches them, and does not name them.
pub fn neighbours(configuration: &Configuration, view: &impl View) -> BTreeSet<ComponentName> {
    let replaced: BTreeSet<ComponentName> = configuration
        .changes
        .iter()
        .filter_map(|change| match &change.kind {
            ChangeKind::Replace { component, .. } => Some(*component),
            _ => None,
        })
        .collect();
    let mut found = BTreeSet::new();
    if !replaced.is_empty() {
        view.for_each_link(&mut |from, to, _| {
            if replaced.contains(&from.component) {
                found.insert(to.component);
            }
            if replaced.contains(&to.component) {
                found.insert(from.component);
            }
        });
    }
    found
}
