//! What is there: components, connections, activities, as the configurator's side sees them. No activity ever touches it.

use super::activities::ScheduledActivity;
use super::others::Others;
use super::watchers::Watcher;
use crate::model::{ComponentName, ComponentSnapshot, Direction, Ident, MemberRef, Policy, Snapshot, Value};
use crate::platform::Cause;
use crate::runtime::builder::{CallerFn, Ends};
use crate::runtime::cell::Cell;
use crate::time::Join;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

#[derive(Default)]
pub(super) struct Registry {
    pub(super) slots: Vec<Option<RegisteredComponent>>,
    free: Vec<u32>,
    names: FxHashMap<ByAddress<ComponentName>, u32>,
    pub(super) connections: FxHashMap<ByAddress<(MemberRef, MemberRef)>, Connection>,
    numbers: u64,
    pub(super) activities: FxHashMap<Ident, ScheduledActivity>,
    /// Threads of activities that are gone.
    pub(super) ending: Vec<Join>,
    /// Components that look at others by probes.
    pub(super) watchers: Vec<Watcher>,
    /// Components whose call never returned; also those that are not there any more but for that call.
    pub(super) quarantined: FxHashSet<ComponentName>,
}

/// A name as a key that is hashed by its address: hashing the text would fetch it from memory, which among thousands of
/// components costs more than the rest of a look-up.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct ByAddress<N>(pub(super) N);

impl Hash for ByAddress<ComponentName> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        state.write_usize(self.0.address());
    }
}

impl Hash for ByAddress<(MemberRef, MemberRef)> {
    fn hash<H: Hasher>(&self, state: &mut H) {
        for end in [self.0.0, self.0.1] {
            state.write_usize(end.component.address());
            state.write_usize(end.member.address());
        }
    }
}

/// A component.
pub(super) struct RegisteredComponent {
    pub(super) cell: Arc<Cell>,
    pub(super) ends: Ends,
    /// The values of its properties, in the order of names.
    pub(super) values: Vec<Value>,
    pub(super) ports: Vec<PortUse>,
    pub(super) connections: u32,
    /// The activity it was created in, and the one it runs in.
    asked: Option<Ident>,
    pub(super) runs_in: Ident,
    /// Its place among the members of the activity.
    pub(super) place: u32,
    /// No other component ever has it.
    pub(super) number: u64,
}

#[derive(Default)]
pub(super) struct PortUse {
    /// The ports at the other ends of its connections.
    pub(super) others: Others,
    /// Its connection is one of policy `data`.
    pub(super) data: bool,
    pub(super) written: bool,
    /// What was written; kept as memory for the next write when nothing is.
    pub(super) value: Option<Box<Value>>,
}

pub(super) struct Connection {
    pub(super) number: u64,
    pub(super) policy: Policy,
}

pub(super) fn refused<T>(text: String) -> Result<T, Cause> {
    Err(Cause::Refused(text))
}

impl RegisteredComponent {
    /// The function of an operation that runs in the caller's thread.
    pub(super) fn caller(&self, operation: Ident) -> Option<CallerFn> {
        self.ends.callers.iter().find(|(name, _)| *name == operation).map(|(_, f)| f.clone())
    }
}

impl Registry {
    /// The component of that name.
    pub(super) fn find(&self, name: ComponentName) -> Result<u32, Cause> {
        match self.names.get(&ByAddress(name)) {
            Some(slot) => Ok(*slot),
            None if self.quarantined.contains(&name) => Err(Cause::Quarantined),
            None => refused(format!("there is no component `{name}`")),
        }
    }

    pub(super) fn is_free(&self, name: ComponentName) -> Result<(), Cause> {
        if self.names.contains_key(&ByAddress(name)) {
            refused(format!("`{name}` is there already"))
        } else if self.quarantined.contains(&name) {
            Err(Cause::Quarantined)
        } else {
            Ok(())
        }
    }

    /// The component in a slot that [`Registry::find`] gave, under the same lock.
    pub(super) fn entry(&self, slot: u32) -> &RegisteredComponent {
        self.slots[slot as usize].as_ref().expect("a slot found under this lock is taken")
    }

    pub(super) fn entry_mut(&mut self, slot: u32) -> &mut RegisteredComponent {
        self.slots[slot as usize].as_mut().expect("a slot found under this lock is taken")
    }

    /// The slot, if the component numbered `number` is still in it.
    pub(super) fn still(&self, slot: u32, number: u64) -> bool {
        self.slots.get(slot as usize).and_then(Option::as_ref).is_some_and(|entry| entry.number == number)
    }

    pub(super) fn next_number(&mut self) -> u64 {
        self.numbers += 1;
        self.numbers
    }

    // ---- components ----------------------------------------------------------------------------------------------

    pub(super) fn insert(
        &mut self,
        cell: Arc<Cell>,
        mut ends: Ends,
        values: Vec<Value>,
        asked: Option<Ident>,
        runs_in: Ident,
    ) {
        let probes = ends.probes.take();
        let number = self.next_number();
        let slot = self.free.pop().unwrap_or_else(|| {
            self.slots.push(None);
            u32::try_from(self.slots.len() - 1).expect("fewer than 2^32 components")
        });
        let members = &mut self.activities.get_mut(&runs_in).expect("made before its first component").members;
        let place = u32::try_from(members.len()).expect("fewer than 2^32 components");
        members.push(Some(slot));
        if let Some(scheduled) = self.activities.get_mut(&runs_in) {
            scheduled.unpublished = true;
        }
        let mut ports = Vec::with_capacity(ends.ports.len());
        ports.resize_with(ends.ports.len(), PortUse::default);
        self.names.insert(ByAddress(cell.name), slot);
        self.slots[slot as usize] =
            Some(RegisteredComponent { cell, ends, values, ports, connections: 0, asked, runs_in, place, number });
        if !self.watchers.is_empty() {
            self.show(slot);
        }
        if let Some(probes) = probes {
            self.watch(slot, probes);
        }
    }

    /// The connections that begin or end at a component; those to itself twice.
    fn ends_at(&self, slot: u32) -> impl Iterator<Item = (MemberRef, MemberRef)> + '_ {
        let entry = self.entry(slot);
        let ports = entry.cell.kind.ports.iter().zip(&entry.ports).zip(entry.cell.kind.ty.ports.values());
        ports.flat_map(move |((port, used), ty)| {
            let own = entry.cell.name.member(*port);
            used.others.as_slice().iter().map(move |other| match ty.direction {
                Direction::Out => (own, *other),
                Direction::In => (*other, own),
            })
        })
    }

    /// Whether the component may be destroyed as far as its connections go.
    pub(super) fn is_unconnected(&self, slot: u32) -> Result<(), Cause> {
        let entry = self.entry(slot);
        if entry.connections == 0 {
            return Ok(());
        }
        let name = entry.cell.name;
        let mut named: Vec<String> = self.ends_at(slot).map(|(from, to)| format!("{from} -> {to}")).collect();
        named.sort();
        named.dedup();
        refused(format!("`{name}` still has connections: {}", named.join(", ")))
    }

    /// Takes a component without connections out.
    pub(super) fn remove(&mut self, slot: u32) -> RegisteredComponent {
        if !self.watchers.is_empty() {
            self.hide(slot);
        }
        let entry = self.slots[slot as usize].take().expect("a slot found under this lock is taken");
        self.free.push(slot);
        self.names.remove(&ByAddress(entry.cell.name));
        if let Some(scheduled) = self.activities.get_mut(&entry.runs_in) {
            scheduled.members[entry.place as usize] = None;
            scheduled.holes += 1;
            if scheduled.holes == scheduled.members.len() {
                self.end_if_empty(entry.runs_in);
            } else if scheduled.holes > 16 + scheduled.members.len() / 2 {
                // The activity holds on to what is in its list: from time to time it gets one without the dead.
                let name = entry.runs_in;
                self.publish(name);
            }
        }
        entry
    }

    /// Removes all connections of a component.
    pub(super) fn sever(&mut self, name: ComponentName) {
        let Ok(slot) = self.find(name) else { return };
        let mut own: Vec<(MemberRef, MemberRef)> = self.ends_at(slot).collect();
        own.sort_unstable();
        for (from, to) in own {
            let _ = self.disconnect(from, to);
        }
    }

    /// The activities' threads and the components, to be taken down.
    pub(super) fn clear(&mut self) -> (Vec<Join>, Vec<RegisteredComponent>) {
        let mut threads = std::mem::take(&mut self.ending);
        for (_, scheduled) in self.activities.drain() {
            scheduled.activity.end();
            threads.extend(scheduled.thread);
        }
        self.names.clear();
        self.connections.clear();
        (threads, self.slots.drain(..).flatten().collect())
    }

    // ---- what can be observed ------------------------------------------------------------------------------------

    pub(super) fn component(&self, slot: u32) -> ComponentSnapshot {
        let entry = self.entry(slot);
        let kind = &entry.cell.kind;
        ComponentSnapshot {
            ty: kind.ty.name,
            state: entry.cell.state(),
            properties: kind.properties.iter().copied().zip(entry.values.iter().cloned()).collect(),
            activity: entry.asked,
        }
    }

    pub(super) fn snapshot(&self) -> Snapshot {
        let components = self.names.iter().map(|(name, slot)| (name.0, self.component(*slot))).collect();
        let connections = self.connections.iter().map(|(ends, connection)| (ends.0, connection.policy)).collect();
        let mut ports = BTreeMap::new();
        for entry in self.slots.iter().flatten() {
            written(entry, &mut ports);
        }
        Snapshot { components, connections, ports }
    }

    /// Those of these components that exist, what they are connected with, and what was written to them.
    pub(super) fn some(&self, names: &[ComponentName]) -> Snapshot {
        let mut seen = Snapshot::default();
        for name in names {
            let Ok(slot) = self.find(*name) else { continue };
            seen.components.insert(*name, self.component(slot));
            for ends in self.ends_at(slot) {
                if let Some(connection) = self.connections.get(&ByAddress(ends)) {
                    seen.connections.insert(ends, connection.policy);
                }
            }
            written(self.entry(slot), &mut seen.ports);
        }
        seen
    }
}

/// Adds the values written to a component's ports.
fn written(entry: &RegisteredComponent, ports: &mut BTreeMap<MemberRef, Value>) {
    for (port, used) in entry.cell.kind.ports.iter().zip(&entry.ports) {
        if used.written
            && let Some(value) = &used.value
        {
            ports.insert(entry.cell.name.member(*port), Value::clone(value));
        }
    }
}
