//! What is there: components, connections, activities, as the configurator's side sees them. No activity ever touches it.

use super::order::along_the_flow;
use crate::limits;
use crate::model::{
    ComponentName, ComponentSnapshot, Direction, Ident, MemberRef, Policy, PortType, PropertyType, RunState, Snapshot,
    Value,
};
use crate::platform::Cause;
use crate::runtime::activity::{Activity, Request, Schedule};
use crate::runtime::builder::{CallerFn, Ends, PortEnd};
use crate::runtime::cell::Cell;
use crate::runtime::latest::{Reader, Writer, latest};
use crate::time::{Clock, Join, Receiver, Sender, Time};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Default)]
pub(super) struct Registry {
    slots: Vec<Option<Entry>>,
    free: Vec<u32>,
    names: FxHashMap<ComponentName, u32>,
    connections: FxHashMap<(MemberRef, MemberRef), Connection>,
    numbers: u64,
    crews: FxHashMap<Ident, Crew>,
    /// Threads of activities that are gone.
    ending: Vec<Join>,
    /// Components whose call never returned; also those that are not there any more but for that call.
    pub(super) quarantined: FxHashSet<ComponentName>,
}

/// A component.
pub(super) struct Entry {
    pub(super) cell: Arc<Cell>,
    ends: Ends,
    /// The values of its properties, in the order of names.
    values: Vec<Value>,
    ports: Vec<PortUse>,
    connections: u32,
    /// The activity it was created in, and the one it runs in.
    asked: Option<Ident>,
    pub(super) crew: Ident,
    /// Its place among the members of the activity.
    place: u32,
    /// No other component ever has it.
    pub(super) number: u64,
}

#[derive(Default)]
struct PortUse {
    connections: u32,
    /// Its connection is one of policy `data`.
    data: bool,
    written: bool,
    /// What was written; kept as memory for the next write when nothing is.
    value: Option<Value>,
}

struct Connection {
    number: u64,
    policy: Policy,
    /// Values lost, of a queue.
    lost: Option<Arc<AtomicU64>>,
}

/// An activity with the components in it.
pub(super) struct Crew {
    pub(super) activity: Arc<Activity>,
    schedule: Writer<Schedule>,
    pub(super) requests: Sender<Request>,
    /// What its thread will need, until it is started.
    waiting: Option<(Reader<Schedule>, Receiver<Request>)>,
    thread: Option<Join>,
    /// The components in the order of updates; none: destroyed.
    members: Vec<Option<u32>>,
    holes: usize,
    /// Components being made for it.
    pub(super) expected: usize,
    unpublished: bool,
    disordered: bool,
    looped: bool,
}

fn refused<T>(text: String) -> Result<T, Cause> {
    Err(Cause::Refused(text))
}

impl Entry {
    /// The function of an operation that runs in the caller's thread.
    pub(super) fn caller(&self, operation: Ident) -> Option<CallerFn> {
        self.ends.callers.iter().find(|(name, _)| *name == operation).map(|(_, f)| f.clone())
    }
}

impl Registry {
    /// The component of that name.
    pub(super) fn find(&self, name: ComponentName) -> Result<u32, Cause> {
        match self.names.get(&name) {
            Some(slot) => Ok(*slot),
            None if self.quarantined.contains(&name) => Err(Cause::Quarantined),
            None => refused(format!("there is no component `{name}`")),
        }
    }

    pub(super) fn is_free(&self, name: ComponentName) -> Result<(), Cause> {
        if self.names.contains_key(&name) {
            refused(format!("`{name}` is there already"))
        } else if self.quarantined.contains(&name) {
            Err(Cause::Quarantined)
        } else {
            Ok(())
        }
    }

    /// The component in a slot that [`Registry::find`] gave, under the same lock.
    pub(super) fn entry(&self, slot: u32) -> &Entry {
        self.slots[slot as usize].as_ref().expect("a slot found under this lock is taken")
    }

    fn entry_mut(&mut self, slot: u32) -> &mut Entry {
        self.slots[slot as usize].as_mut().expect("a slot found under this lock is taken")
    }

    /// The slot, if the component numbered `number` is still in it.
    pub(super) fn still(&self, slot: u32, number: u64) -> bool {
        self.slots.get(slot as usize).and_then(Option::as_ref).is_some_and(|entry| entry.number == number)
    }

    fn next_number(&mut self) -> u64 {
        self.numbers += 1;
        self.numbers
    }

    // ---- activities ----------------------------------------------------------------------------------------------

    pub(super) fn crew(&mut self, name: Ident, make: impl FnOnce() -> Activity, clock: &Clock) -> &mut Crew {
        self.crews.entry(name).or_insert_with(|| {
            let (schedule, reader) = latest::<Schedule>(Arc::from([]));
            let (requests, inbox) = clock.channel(limits::ACTIVITY_REQUESTS);
            Crew {
                activity: Arc::new(make()),
                schedule,
                requests,
                waiting: Some((reader, inbox)),
                thread: None,
                members: Vec::new(),
                holes: 0,
                expected: 0,
                unpublished: false,
                disordered: false,
                looped: false,
            }
        })
    }

    pub(super) fn crew_of(&self, slot: u32) -> &Crew {
        let name = self.entry(slot).crew;
        self.crews.get(&name).expect("the activity of a component lives as long as it")
    }

    pub(super) fn crews(&self) -> impl Iterator<Item = &Crew> {
        self.crews.values()
    }

    pub(super) fn cells<'a>(&'a self, crew: &'a Crew) -> impl Iterator<Item = &'a Arc<Cell>> + Clone + 'a {
        crew.members.iter().flatten().map(|slot| &self.entry(*slot).cell)
    }

    /// Makes the activity of a component ready to update it: its thread, its place in the schedule.
    pub(super) fn enlist(&mut self, slot: u32, clock: &Clock) -> Result<(), Cause> {
        let name = self.entry(slot).crew;
        if let Some(crew) = self.crews.get_mut(&name)
            && let Some((reader, inbox)) = crew.waiting.take()
        {
            let activity = crew.activity.clone();
            let thread = clock.try_spawn(&format!("davit-{name}"), move || activity.run(reader, &inbox));
            crew.thread = Some(thread.map_err(|error| Cause::Refused(format!("no thread for `{name}`: {error}")))?);
        }
        if self.crews.get(&name).is_some_and(|crew| crew.unpublished || crew.disordered) {
            self.publish(name);
        }
        Ok(())
    }

    /// Gives the activity its components, in order.
    fn publish(&mut self, name: Ident) {
        let Some(mut crew) = self.crews.remove(&name) else { return };
        crew.members.retain(Option::is_some);
        crew.holes = 0;
        if crew.disordered {
            let slots: Vec<u32> = crew.members.iter().flatten().copied().collect();
            let place: FxHashMap<ComponentName, usize> =
                slots.iter().enumerate().map(|(i, slot)| (self.entry(*slot).cell.name, i)).collect();
            let edges: Vec<(usize, usize)> = self
                .connections
                .keys()
                .filter_map(|(from, to)| Some((*place.get(&from.component)?, *place.get(&to.component)?)))
                .filter(|(from, to)| from != to)
                .collect();
            let names: Vec<ComponentName> = slots.iter().map(|slot| self.entry(*slot).cell.name).collect();
            let (order, looped) = along_the_flow(&names, &edges);
            crew.members = order.into_iter().map(|i| Some(slots[i])).collect();
            crew.looped = looped;
            crew.disordered = false;
        }
        for (i, slot) in crew.members.iter().flatten().enumerate() {
            if let Some(entry) = &mut self.slots[*slot as usize] {
                entry.place = u32::try_from(i).unwrap_or(u32::MAX);
            }
        }
        let cells: Schedule = crew.members.iter().flatten().map(|slot| self.entry(*slot).cell.clone()).collect();
        crew.schedule.write(|schedule| *schedule = cells);
        crew.unpublished = false;
        self.crews.insert(name, crew);
    }

    /// After a change of the data flow inside an activity: at once if it runs, else with the next start.
    fn reorder_if_running(&mut self, name: Ident) {
        if self.crews.get(&name).is_some_and(|crew| crew.disordered && crew.activity.running.load(Ordering::SeqCst) > 0)
        {
            self.publish(name);
        }
    }

    /// A component that was to be made for an activity has been made, or not.
    pub(super) fn arrived(&mut self, name: Ident) {
        if let Some(crew) = self.crews.get_mut(&name) {
            crew.expected -= 1;
        }
        self.end_if_empty(name);
    }

    /// Ends an activity that has no component any more.
    fn end_if_empty(&mut self, name: Ident) {
        if self.crews.get(&name).is_some_and(|crew| crew.expected == 0 && crew.holes == crew.members.len())
            && let Some(crew) = self.crews.remove(&name)
        {
            crew.activity.end();
            // The thread ends by itself, as soon as nothing in it hangs.
            self.ending.retain(|thread| !thread.is_finished());
            self.ending.extend(crew.thread);
        }
    }

    // ---- components ----------------------------------------------------------------------------------------------

    pub(super) fn insert(
        &mut self,
        cell: Arc<Cell>,
        ends: Ends,
        values: Vec<Value>,
        asked: Option<Ident>,
        crew: Ident,
    ) {
        let number = self.next_number();
        let slot = self.free.pop().unwrap_or_else(|| {
            self.slots.push(None);
            u32::try_from(self.slots.len() - 1).expect("fewer than 2^32 components")
        });
        let members = &mut self.crews.get_mut(&crew).expect("made before its first component").members;
        let place = u32::try_from(members.len()).expect("fewer than 2^32 components");
        members.push(Some(slot));
        if let Some(crew) = self.crews.get_mut(&crew) {
            crew.unpublished = true;
        }
        let mut ports = Vec::with_capacity(ends.ports.len());
        ports.resize_with(ends.ports.len(), PortUse::default);
        self.names.insert(cell.name, slot);
        self.slots[slot as usize] =
            Some(Entry { cell, ends, values, ports, connections: 0, asked, crew, place, number });
    }

    /// Whether the component may be destroyed as far as its connections go.
    pub(super) fn is_unconnected(&self, slot: u32) -> Result<(), Cause> {
        let entry = self.entry(slot);
        if entry.connections == 0 {
            return Ok(());
        }
        let name = entry.cell.name;
        let mut named: Vec<String> = self
            .connections
            .keys()
            .filter(|(from, to)| from.component == name || to.component == name)
            .map(|(from, to)| format!("{from} -> {to}"))
            .collect();
        named.sort();
        refused(format!("`{name}` still has connections: {}", named.join(", ")))
    }

    /// Takes a component without connections out.
    pub(super) fn remove(&mut self, slot: u32) -> Entry {
        let entry = self.slots[slot as usize].take().expect("a slot found under this lock is taken");
        self.free.push(slot);
        self.names.remove(&entry.cell.name);
        if let Some(crew) = self.crews.get_mut(&entry.crew) {
            crew.members[entry.place as usize] = None;
            crew.holes += 1;
            if crew.holes == crew.members.len() {
                self.end_if_empty(entry.crew);
            } else if crew.holes > 16 + crew.members.len() / 2 {
                // The activity holds on to what is in its list: from time to time it gets one without the dead.
                let name = entry.crew;
                self.publish(name);
            }
        }
        entry
    }

    /// Removes all connections of a component.
    pub(super) fn sever(&mut self, name: ComponentName) {
        let mut own: Vec<(MemberRef, MemberRef)> = self
            .connections
            .keys()
            .filter(|(from, to)| from.component == name || to.component == name)
            .copied()
            .collect();
        own.sort_unstable();
        for (from, to) in own {
            let _ = self.disconnect(from, to);
        }
    }

    /// The activities' threads and the components, to be taken down.
    pub(super) fn clear(&mut self) -> (Vec<Join>, Vec<Entry>) {
        let mut threads = std::mem::take(&mut self.ending);
        for (_, crew) in self.crews.drain() {
            crew.activity.end();
            threads.extend(crew.thread);
        }
        self.names.clear();
        self.connections.clear();
        (threads, self.slots.drain(..).flatten().collect())
    }

    // ---- ports and properties ------------------------------------------------------------------------------------

    /// The index of a port in the order of names, and its type.
    fn port(&self, slot: u32, port: Ident) -> Result<(usize, &PortType), Cause> {
        let kind = &self.entry(slot).cell.kind;
        match (kind.ports.binary_search(&port), kind.ty.port(port)) {
            (Ok(index), Some(ty)) => Ok((index, ty)),
            _ => refused(format!("`{}` has no port `{port}`", self.entry(slot).cell.name)),
        }
    }

    pub(super) fn connect(&mut self, from: MemberRef, to: MemberRef, policy: Policy) -> Result<(), Cause> {
        let (writer, reader) = (self.find(from.component)?, self.find(to.component)?);
        if [writer, reader].iter().any(|slot| self.entry(*slot).cell.is_quarantined()) {
            return Err(Cause::Quarantined);
        }
        let (out_port, out_type) = self.port(writer, from.member)?;
        let (in_port, in_type) = self.port(reader, to.member)?;
        if out_type.direction != Direction::Out || in_type.direction != Direction::In {
            return refused(format!("{from} -> {to} does not lead from an out-port to an in-port"));
        }
        if out_type.ty != in_type.ty {
            return refused(format!("{from} is {} and {to} is {}", out_type.ty, in_type.ty));
        }
        if let (Some(a), Some(b)) = (&out_type.unit, &in_type.unit)
            && a != b
        {
            return refused(format!("{from} is in {a} and {to} is in {b}"));
        }
        let event = in_type.is_event();
        let carried = match policy {
            Policy::Data if event => Policy::Buffer(limits::EVENT_FIFO),
            Policy::Data if in_type.buffered => return refused(format!("{to} takes only buffered connections")),
            Policy::Buffer(0) => return refused("a buffer holds at least one sample".to_owned()),
            other => other,
        };
        let used = &self.entry(reader).ports[in_port];
        if used.data || (used.connections > 0 && carried == Policy::Data) {
            return refused(format!("{to} is connected already"));
        }
        if self.connections.contains_key(&(from, to)) {
            return refused(format!("{from} -> {to} is connected already"));
        }
        let number = self.next_number();
        let entry = self.entry_mut(reader);
        let Some(PortEnd::In(end)) = &mut entry.ends.ports[in_port] else {
            return refused(format!("{to} is not there"));
        };
        let (feed, lost) = end.open(number, carried);
        entry.ports[in_port].connections += 1;
        entry.ports[in_port].data = carried == Policy::Data;
        entry.connections += 1;
        let entry = self.entry_mut(writer);
        if let Some(PortEnd::Out(end)) = &mut entry.ends.ports[out_port] {
            end.attach(number, feed);
        }
        entry.ports[out_port].connections += 1;
        entry.connections += 1;
        self.connections.insert((from, to), Connection { number, policy, lost });
        let (writer, reader) = (self.entry(writer), self.entry(reader));
        if writer.crew == reader.crew && writer.place > reader.place {
            let name = writer.crew;
            if let Some(crew) = self.crews.get_mut(&name) {
                crew.disordered = true;
            }
            self.reorder_if_running(name);
        }
        Ok(())
    }

    /// Also while one of the ends is in quarantine: its neighbours must be able to leave.
    pub(super) fn disconnect(&mut self, from: MemberRef, to: MemberRef) -> Result<(), Cause> {
        let (writer, reader) = (self.find(from.component)?, self.find(to.component)?);
        let (out_port, in_port) = (self.port(writer, from.member)?.0, self.port(reader, to.member)?.0);
        let Some(connection) = self.connections.remove(&(from, to)) else {
            return refused(format!("{from} -> {to} is not connected"));
        };
        let entry = self.entry_mut(writer);
        if let Some(PortEnd::Out(end)) = &mut entry.ends.ports[out_port] {
            end.detach(connection.number);
        }
        entry.ports[out_port].connections -= 1;
        entry.connections -= 1;
        let entry = self.entry_mut(reader);
        if let Some(PortEnd::In(end)) = &mut entry.ends.ports[in_port] {
            end.close(connection.number);
        }
        entry.ports[in_port].connections -= 1;
        entry.ports[in_port].data = false;
        entry.connections -= 1;
        let name = entry.crew;
        if self.entry(writer).crew == name
            && let Some(crew) = self.crews.get_mut(&name)
            && crew.looped
        {
            crew.disordered = true;
            self.reorder_if_running(name);
        }
        Ok(())
    }

    /// The index of a property in the order of names.
    pub(super) fn property(&self, slot: u32, property: Ident) -> Result<usize, Cause> {
        let entry = self.entry(slot);
        entry
            .cell
            .kind
            .properties
            .binary_search(&property)
            .or_else(|_| refused(format!("`{}` has no property `{property}`", entry.cell.name)))
    }

    pub(super) fn set_property(&mut self, slot: u32, index: usize, value: &Value) -> Result<(), Cause> {
        let entry = self.entry_mut(slot);
        if entry.cell.is_quarantined() {
            return Err(Cause::Quarantined);
        }
        let name = entry.cell.kind.properties[index];
        let ty = &entry.cell.kind.ty.properties[&name];
        check_value(ty, value).or_else(|why| refused(format!("{}.{name}: {why}", entry.cell.name)))?;
        let state = entry.cell.state();
        if !ty.tunable.allows(state) {
            return refused(format!("{}.{name} may not be set while it is {state}", entry.cell.name));
        }
        if !entry.ends.properties[index].as_mut().is_some_and(|end| end.set(value)) {
            return refused(format!("{value} does not fit {}.{name}", entry.cell.name));
        }
        entry.values[index].clone_from(value);
        if state == RunState::Running {
            entry.cell.beat.poke();
        }
        Ok(())
    }

    /// The index of an in-port that may be written, as far as its type goes.
    pub(super) fn writable(&self, slot: u32, port: Ident) -> Result<usize, Cause> {
        let name = self.entry(slot).cell.name;
        let (index, ty) = self.port(slot, port)?;
        if ty.direction != Direction::In {
            refused(format!("{name}.{port} is no in-port"))
        } else if ty.is_event() || ty.buffered {
            refused(format!("{name}.{port} is read as a queue: connect it"))
        } else {
            Ok(index)
        }
    }

    /// Takes the memory that writing `value` will need.
    pub(super) fn prepare_port(&mut self, slot: u32, index: usize, value: Option<&Value>) {
        let entry = self.entry_mut(slot);
        if let Some(PortEnd::In(end)) = &mut entry.ends.ports[index] {
            end.prepare();
        }
        if entry.ports[index].value.is_none() {
            entry.ports[index].value = value.cloned();
        }
    }

    pub(super) fn write_port(
        &mut self,
        slot: u32,
        index: usize,
        value: Option<&Value>,
        now: Time,
    ) -> Result<(), Cause> {
        let entry = self.entry_mut(slot);
        if entry.cell.is_quarantined() {
            return Err(Cause::Quarantined);
        }
        let name = entry.cell.kind.ports[index];
        if entry.ports[index].connections > 0 {
            return refused(format!("{}.{name} is connected", entry.cell.name));
        }
        if let Some(value) = value
            && !value.is_of(&entry.cell.kind.ty.ports[&name].ty)
        {
            return refused(format!("{value} does not fit {}.{name}", entry.cell.name));
        }
        let written = match &mut entry.ends.ports[index] {
            Some(PortEnd::In(end)) => end.write(value, now),
            _ => false,
        };
        if !written {
            return refused(format!("the value does not fit {}.{name}", entry.cell.name));
        }
        let used = &mut entry.ports[index];
        used.written = value.is_some();
        match (&mut used.value, value) {
            (Some(slot), Some(value)) => slot.clone_from(value),
            (slot @ None, Some(value)) => *slot = Some(value.clone()),
            (_, None) => {}
        }
        Ok(())
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
        let components = self.names.iter().map(|(name, slot)| (*name, self.component(*slot))).collect();
        let connections = self.connections.iter().map(|(ends, connection)| (*ends, connection.policy)).collect();
        let mut ports = BTreeMap::new();
        for entry in self.slots.iter().flatten() {
            for (port, used) in entry.cell.kind.ports.iter().zip(&entry.ports) {
                if used.written
                    && let Some(value) = &used.value
                {
                    ports.insert(entry.cell.name.member(*port), value.clone());
                }
            }
        }
        Snapshot { components, connections, ports }
    }

    pub(super) fn overflows(&self) -> Vec<((MemberRef, MemberRef), u64)> {
        let mut list: Vec<_> = self
            .connections
            .iter()
            .filter_map(|(ends, connection)| Some((*ends, connection.lost.as_ref()?.load(Ordering::Relaxed))))
            .collect();
        list.sort_unstable();
        list
    }
}

/// Whether `value` is one of the property, without making another.
fn check_value(ty: &PropertyType, value: &Value) -> Result<(), String> {
    if !value.is_of(&ty.ty) {
        return Err(format!("expected {}, found {}", ty.ty, value.describe()));
    }
    let mut outside = None;
    value.for_each_number(&mut |n| {
        if ty.min.is_some_and(|min| n < min) || ty.max.is_some_and(|max| n > max) {
            outside = Some(n);
        }
    });
    match outside {
        Some(n) => Err(format!("{n} is outside its limits")),
        None => Ok(()),
    }
}

/// Whether these are the values of all properties of a type, in the order of names.
pub(super) fn check_values(cell_type: &crate::model::ComponentType, values: &[Value]) -> Result<(), Cause> {
    if values.len() != cell_type.properties.len() {
        return refused(format!("{} values for {} properties", values.len(), cell_type.properties.len()));
    }
    for ((name, ty), value) in cell_type.properties.iter().zip(values) {
        check_value(ty, value).or_else(|why| refused(format!("`{name}`: {why}")))?;
    }
    Ok(())
}
