//! Changes of one configuration against each other: what counts once, and what does not commute.

use crate::model::codes;
use crate::model::{Change, ChangeKind, ComponentName, Configuration, Finding, MemberRef};
use rustc_hash::FxHashMap;
use std::collections::hash_map::Entry;

/// What a change is about; two changes with one subject are the same act twice, or they clash.
#[derive(PartialEq, Eq, Hash, Clone, Copy)]
pub enum ConflictSubject {
    /// That a component is made, or made anew.
    Create(ComponentName),
    /// That it is taken away.
    Destroy(ComponentName),
    /// A connection that is made.
    Connect(MemberRef, MemberRef),
    /// One that is taken away.
    Disconnect(MemberRef, MemberRef),
    /// The value of a property.
    Property(MemberRef),
    /// What is written on a port.
    Port(MemberRef),
    /// A call.
    Operation(MemberRef),
}

impl ConflictSubject {
    /// What that one is about.
    pub fn of(kind: &ChangeKind) -> Self {
        match kind {
            ChangeKind::Create { component, .. } | ChangeKind::Replace { component, .. } => Self::Create(*component),
            ChangeKind::Destroy { component } => Self::Destroy(*component),
            ChangeKind::Connect { from, to, .. } => Self::Connect(*from, *to),
            ChangeKind::Disconnect { from, to } => Self::Disconnect(*from, *to),
            ChangeKind::PropertySet { property, .. } => Self::Property(*property),
            ChangeKind::PortWrite { port, .. } => Self::Port(*port),
            ChangeKind::OperationCall { call, .. } => Self::Operation(call.operation),
        }
    }
}

/// What becomes of a change.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Use {
    /// It is planned.
    Yes,
    /// It is the same act as another, or was found to clash.
    No,
    /// It demands a value of the slot that this other change demands one of as well: the same once fitted, or a clash.
    Rival(usize),
}

/// The changes, sorted out.
pub(super) struct Sorted {
    pub(super) uses: Vec<Use>,
    pub(super) created: FxHashMap<ComponentName, usize>,
    pub(super) destroyed: FxHashMap<ComponentName, usize>,
    /// Components of which two different creates stand there.
    pub(super) disputed: Vec<ComponentName>,
}

pub(super) fn clash(first: &Change, second: &Change) -> Finding {
    Finding::error(codes::CLASH, format!("`{}` and `{}` do not commute", first.kind, second.kind))
        .at(second.origin)
        .labelled("this change")
        .also(first.origin, "and this one")
        .help("keep one of the two, or write two configurations and apply them one after the other")
}

pub(super) fn sort(configuration: &Configuration, findings: &mut Vec<Finding>) -> Sorted {
    let changes = &configuration.changes;
    let mut seen: FxHashMap<ConflictSubject, u32> = FxHashMap::default();
    seen.reserve(changes.len());
    let mut sorted = Sorted {
        uses: vec![Use::Yes; changes.len()],
        created: FxHashMap::default(),
        destroyed: FxHashMap::default(),
        disputed: Vec::new(),
    };
    let mut writes = false;
    for (i, change) in changes.iter().enumerate() {
        match seen.entry(ConflictSubject::of(&change.kind)) {
            Entry::Vacant(free) => {
                free.insert(u32::try_from(i).expect("fewer changes than that"));
                match &change.kind {
                    ChangeKind::Create { component, .. } => _ = sorted.created.insert(*component, i),
                    ChangeKind::Destroy { component } => _ = sorted.destroyed.insert(*component, i),
                    ChangeKind::PortWrite { .. } => writes = true,
                    _ => {}
                }
            }
            Entry::Occupied(first) => {
                let first = *first.get() as usize;
                sorted.uses[i] = if changes[first].kind == change.kind {
                    Use::No
                } else if matches!(change.kind, ChangeKind::PropertySet { .. } | ChangeKind::PortWrite { .. }) {
                    Use::Rival(first)
                } else {
                    // Neither is planned: what follows from the one or the other would depend on the written order.
                    findings.push(clash(&changes[first], change));
                    sorted.uses[first] = Use::No;
                    if let ChangeKind::Create { component, .. } = &change.kind {
                        sorted.disputed.push(*component);
                    }
                    Use::No
                };
            }
        }
    }
    if writes {
        for (i, change) in changes.iter().enumerate() {
            if let ChangeKind::Connect { to, .. } = &change.kind
                && sorted.uses[i] == Use::Yes
                && let Some(write) = seen.get(&ConflictSubject::Port(*to))
            {
                let write = *write as usize;
                findings.push(clash(&changes[write.min(i)], &changes[write.max(i)]));
                sorted.uses[i] = Use::No;
            }
        }
    }
    if !sorted.destroyed.is_empty() {
        destroyed(changes, &mut sorted, findings);
    }
    sorted
}

/// Changes to a component that is destroyed and not created again.
fn destroyed(changes: &[Change], sorted: &mut Sorted, findings: &mut Vec<Finding>) {
    for (i, change) in changes.iter().enumerate() {
        // A disconnect concerns the old component.
        use ChangeKind::{Create, Destroy, Disconnect};
        if matches!(change.kind, Create { .. } | Destroy { .. } | Disconnect { .. }) {
            continue;
        }
        for component in change.kind.components() {
            let Some(destroy) = sorted.destroyed.get(&component) else { continue };
            if sorted.created.contains_key(&component) || sorted.uses[i] == Use::No {
                continue;
            }
            sorted.uses[i] = Use::No;
            findings.push(
                Finding::error(
                    codes::TOUCHES_DESTROYED,
                    format!("`{}` touches `{component}`, which this configuration destroys", change.kind),
                )
                .at(change.origin)
                .labelled("this change")
                .also(changes[*destroy].origin, "destroyed here")
                .help("remove one of the two, or write two configurations"),
            );
        }
    }
}
