//! Ports and properties as the configurator's side has them: connecting, setting, writing.

use super::registry::{ByAddress, Connection, Registry, refused};
use crate::limits;
use crate::model::finding::count;
use crate::model::{ComponentType, Direction, Ident, MemberRef, Policy, PortType, PropertyType, RunState, Value};
use crate::platform::Cause;
use crate::runtime::builder::PortEnd;
use crate::runtime::guard;
use crate::time::Time;

impl Registry {
    /// The index of a port in the order of names, and its type.
    pub(super) fn port(&self, slot: u32, port: Ident) -> Result<(usize, &PortType), Cause> {
        let kind = &self.entry(slot).cell.kind;
        match (kind.ports.binary_search(&port), kind.ty.port(port)) {
            (Ok(index), Some(ty)) => Ok((index, ty)),
            _ => refused(format!("`{}` has no port `{port}`", self.entry(slot).cell.name)),
        }
    }

    pub(super) fn connect(&mut self, from: MemberRef, to: MemberRef, policy: Policy) -> Result<(), Cause> {
        let (writer, reader) = (self.find(from.component)?, self.find(to.component)?);
        if [writer, reader].iter().any(|slot| self.entry(*slot).cell.gate.is_quarantined()) {
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
        if used.data || (!used.others.is_empty() && carried == Policy::Data) {
            return refused(format!("{to} is connected already"));
        }
        if self.connections.contains_key(&ByAddress((from, to))) {
            return refused(format!("{from} -> {to} is connected already"));
        }
        let number = self.next_number();
        let entry = self.entry_mut(reader);
        let Some(PortEnd::In(end)) = &mut entry.ends.ports[in_port] else {
            return refused(format!("{to} is not there"));
        };
        let feed = end.open(number, carried);
        entry.ports[in_port].others.push(from);
        entry.ports[in_port].data = carried == Policy::Data;
        entry.connections += 1;
        let entry = self.entry_mut(writer);
        if let Some(PortEnd::Out(end)) = &mut entry.ends.ports[out_port] {
            end.attach(number, feed);
        }
        entry.ports[out_port].others.push(to);
        entry.connections += 1;
        self.connections.insert(ByAddress((from, to)), Connection { number, policy });
        if !self.watchers.is_empty() && carried == Policy::Data {
            self.show_connection(from, to);
        }
        let (writer, reader) = (self.entry(writer), self.entry(reader));
        if writer.runs_in == reader.runs_in && writer.place > reader.place {
            let name = writer.runs_in;
            if let Some(scheduled) = self.activities.get_mut(&name) {
                scheduled.disordered = true;
            }
            self.reorder_if_running(name);
        }
        Ok(())
    }

    /// Also while one of the ends is in quarantine: its neighbours must be able to leave.
    pub(super) fn disconnect(&mut self, from: MemberRef, to: MemberRef) -> Result<(), Cause> {
        let (writer, reader) = (self.find(from.component)?, self.find(to.component)?);
        let (out_port, in_port) = (self.port(writer, from.member)?.0, self.port(reader, to.member)?.0);
        let Some(connection) = self.connections.remove(&ByAddress((from, to))) else {
            return refused(format!("{from} -> {to} is not connected"));
        };
        if !self.watchers.is_empty() {
            self.hide_connection(to);
        }
        let entry = self.entry_mut(writer);
        if let Some(PortEnd::Out(end)) = &mut entry.ends.ports[out_port] {
            end.detach(connection.number);
        }
        entry.ports[out_port].others.forget(to);
        entry.connections -= 1;
        let entry = self.entry_mut(reader);
        if let Some(PortEnd::In(end)) = &mut entry.ends.ports[in_port] {
            end.close(connection.number);
        }
        entry.ports[in_port].others.forget(from);
        entry.ports[in_port].data = false;
        entry.connections -= 1;
        let name = entry.runs_in;
        if self.entry(writer).runs_in == name
            && let Some(scheduled) = self.activities.get_mut(&name)
            && scheduled.looped
        {
            scheduled.disordered = true;
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

    /// A `safe` value is written in quarantine too: it waits for nobody.
    pub(super) fn set_property(&mut self, slot: u32, index: usize, value: &Value, safe: bool) -> Result<(), Cause> {
        let entry = self.entry_mut(slot);
        if !safe && entry.cell.gate.is_quarantined() {
            return Err(Cause::Quarantined);
        }
        let name = entry.cell.kind.properties[index];
        let ty = &entry.cell.kind.ty.properties[&name];
        check_value(ty, value).or_else(|why| refused(format!("{}.{name}: {why}", entry.cell.name)))?;
        let state = entry.cell.state();
        if !ty.tunable.allows(state) {
            return refused(format!("{}.{name} may not be set while it is {state}", entry.cell.name));
        }
        // Turning a value into the Rust type is the component's own code as well.
        let end = entry.ends.properties[index].as_mut();
        if !end.is_some_and(|end| guard::call(|| end.set(value)).unwrap_or(false)) {
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
            entry.ports[index].value = value.cloned().map(Box::new);
        }
    }

    pub(super) fn write_port(
        &mut self,
        slot: u32,
        index: usize,
        value: Option<&Value>,
        now: Time,
        safe: bool,
    ) -> Result<(), Cause> {
        let entry = self.entry_mut(slot);
        if !safe && entry.cell.gate.is_quarantined() {
            return Err(Cause::Quarantined);
        }
        let name = entry.cell.kind.ports[index];
        if !entry.ports[index].others.is_empty() {
            return refused(format!("{}.{name} is connected", entry.cell.name));
        }
        if let Some(value) = value
            && !value.is_of(&entry.cell.kind.ty.ports[&name].ty)
        {
            return refused(format!("{value} does not fit {}.{name}", entry.cell.name));
        }
        let written = match &mut entry.ends.ports[index] {
            Some(PortEnd::In(end)) => guard::call(|| end.write(value, now)).unwrap_or(false),
            _ => false,
        };
        if !written {
            return refused(format!("the value does not fit {}.{name}", entry.cell.name));
        }
        let used = &mut entry.ports[index];
        used.written = value.is_some();
        match (&mut used.value, value) {
            (Some(slot), Some(value)) => Value::clone_from(slot, value),
            (slot @ None, Some(value)) => *slot = Some(Box::new(value.clone())),
            (_, None) => {}
        }
        Ok(())
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
pub(super) fn check_values(cell_type: &ComponentType, values: &[Value]) -> Result<(), Cause> {
    if values.len() != cell_type.properties.len() {
        let (given, wanted) = (count(values.len(), "value"), count(cell_type.properties.len(), "property"));
        return refused(format!("{given} for {wanted}"));
    }
    for ((name, ty), value) in cell_type.properties.iter().zip(values) {
        check_value(ty, value).or_else(|why| refused(format!("`{name}`: {why}")))?;
    }
    Ok(())
}
