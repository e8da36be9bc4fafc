//! What the Lua part borrows from here: constructors that remember where they were called, and inner machines.

use super::bound::{BoundMachine, Status};
use super::calls::Functions;
use super::host::{Host, run};
use super::lower::Spot;
use super::merge::merge;
use super::tables::{NotBuilt, address};
use super::values::to_json;
use crate::limits;
use crate::statechart::{Hook, Machine, MicrostepResult, NodeId, Printer};
use crate::time::Time;
use mlua::{Function, Lua, MultiValue, Result, Table, Value};
use std::rc::{Rc, Weak};

/// Puts all of it into `host.native`.
pub fn install(lua: &Lua, host: &Rc<Host>) -> Result<()> {
    let native = &host.native;
    native.raw_set("make", constructor(lua, host)?)?;
    let voice = host.voice.clone();
    native.raw_set(
        "printer",
        lua.create_function(move |lua, name: String| {
            let by = match name.as_str() {
                "err" => Printer::Err,
                "warn" => Printer::Warn,
                "dbg" => Printer::Dbg,
                _ => Printer::Info,
            };
            let voice = voice.clone();
            lua.create_function(move |_, values: MultiValue| {
                let mut line = String::new();
                for value in &values {
                    if !line.is_empty() && !line.ends_with([' ', '\t']) {
                        line.push(' ');
                    }
                    line.push_str(&value.to_string()?);
                }
                voice.say(by, &line);
                Ok(())
            })
        })?,
    )?;
    shared(lua, host, "serial", |_, host, (): ()| {
        host.serial.set(host.serial.get() + 1);
        Ok(host.serial.get())
    })?;
    shared(lua, host, "set_gettime", |_, host, f: Function| {
        *host.gettime.borrow_mut() = Some(f);
        Ok(())
    })?;
    shared(lua, host, "run_file", |lua, host, name: String| {
        let (shown, text) = (host.reader.borrow_mut())(&name).map_err(mlua::Error::runtime)?;
        let _loading = host.loading(&shown)?;
        Ok(run(lua, &shown, &text)?.pop_front().unwrap_or(Value::Nil))
    })?;
    shared(lua, host, "json", |_, host, value: Value| {
        Ok(to_json(&value, 0, &mut host.budget.count.steps())?.to_string())
    })?;
    shared(lua, host, "bind", |lua, host, fsm: Table| {
        if host.machines.borrow().len() >= limits::INNER_MACHINES {
            return Ok(Some(format!("a coordinator makes at most {} machines", limits::INNER_MACHINES)));
        }
        match BoundMachine::new(lua, (&host.budget, &host.voice), &host.native, &fsm, host.path.take()) {
            Ok(bound) => {
                host.machines.borrow_mut().insert(address(&fsm), Rc::new(bound));
                Ok(None)
            }
            Err(NotBuilt::Lua(error)) => Err(error),
            Err(NotBuilt::Findings(findings)) => {
                let all: Vec<String> = findings.into_iter().map(|f| f.message).collect();
                Ok(Some(all.join("; ")))
            }
        }
    })?;
    asking(lua, host)?;
    growing(lua, host)?;
    stepping(lua, host)
}

/// A function that needs the host, which must not hold itself.
fn shared<A, R>(lua: &Lua, host: &Rc<Host>, name: &str, f: fn(&Lua, &Host, A) -> Result<R>) -> Result<()>
where
    A: mlua::FromLuaMulti + 'static,
    R: mlua::IntoLuaMulti + 'static,
{
    let weak: Weak<Host> = Rc::downgrade(host);
    let function = lua.create_function(move |lua, args: A| {
        let host = weak.upgrade().ok_or_else(|| mlua::Error::runtime("the machine is gone"))?;
        f(lua, &host, args)
    })?;
    host.native.raw_set(name, function)
}

fn constructor(lua: &Lua, host: &Rc<Host>) -> Result<Function> {
    let weak = Rc::downgrade(host);
    lua.create_function(move |lua, (class, value): (Table, Value)| {
        let host = weak.upgrade().ok_or_else(|| mlua::Error::runtime("the machine is gone"))?;
        let table = match value {
            Value::Table(table) => table,
            Value::Nil => lua.create_table()?,
            other => {
                return Err(mlua::Error::runtime(format!("one table is wanted here, this is a {}", other.type_name())));
            }
        };
        let mut place = None;
        for level in 1..4 {
            place = lua.inspect_stack(level, |debug| {
                let line = debug.current_line()?;
                Some((debug.source().source?.trim_start_matches(['@', '=']).to_owned(), line))
            });
            if let Some(Some(_)) = place {
                break;
            }
        }
        let (file, line) = place.flatten().unwrap_or_default();
        let line = u32::try_from(line).unwrap_or(u32::MAX);
        let mut spots = host.spots.borrow_mut();
        if spots.len() >= limits::TEXT_NODES {
            return Err(mlua::Error::runtime(format!("more than {} states and transitions", limits::TEXT_NODES)));
        }
        let nth = spots.iter().rev().take_while(|spot| spot.line == line && spot.file == file).count();
        spots.push(Spot { file, line, nth: u32::try_from(nth).unwrap_or(u32::MAX) });
        host.spot_of.raw_set(&table, spots.len())?;
        table.set_metatable(Some(class))?;
        Ok(table)
    })
}

/// The machine of a root.
fn machine_of(host: &Host, fsm: &Table) -> Result<Rc<BoundMachine>> {
    host.machines
        .borrow()
        .get(&address(fsm))
        .cloned()
        .ok_or_else(|| mlua::Error::runtime("this is no machine that rfsm.init made"))
}

/// The machine a state belongs to, and which state of it.
fn state_of(host: &Host, state: &Table) -> Result<(Rc<BoundMachine>, NodeId)> {
    let mut root = state.clone();
    for _ in 0..=limits::CHART_DEPTH {
        match root.raw_get::<Option<Table>>("_parent")? {
            Some(parent) if parent != root => root = parent,
            _ => break,
        }
    }
    let bound = machine_of(host, &root)?;
    let node = bound.tables().node_of(state);
    node.map(|node| (bound, node)).ok_or_else(|| mlua::Error::runtime("this is no state of its machine"))
}

fn asking(lua: &Lua, host: &Rc<Host>) -> Result<()> {
    shared(lua, host, "leaf_fqn", |lua, host, fsm: Table| {
        let bound = machine_of(host, &fsm)?;
        let leaf = bound.status.borrow().leaf;
        Ok(match leaf {
            Some(leaf) => Value::String(lua.create_string(bound.tables().chart.fqn(leaf).to_string())?),
            None => Value::Boolean(false),
        })
    })?;
    shared(lua, host, "leaf_mode", |_, host, fsm: Table| {
        let bound = machine_of(host, &fsm)?;
        let leaf = bound.status.borrow().leaf;
        Ok(leaf.map(|leaf| bound.mode(leaf)))
    })?;
    shared(lua, host, "active", |_, host, fsm: Table| {
        let bound = machine_of(host, &fsm)?;
        let active = bound.status.borrow().active.clone();
        let chart = &bound.tables().chart;
        Ok(active.into_iter().map(|node| chart.fqn(node).to_string()).collect::<Vec<_>>())
    })?;
    shared(lua, host, "active_states", |_, host, fsm: Table| {
        let bound = machine_of(host, &fsm)?;
        let active = bound.status.borrow().active.clone();
        let tables = bound.tables();
        Ok(active.into_iter().map(|node| tables.node(node).clone()).collect::<Vec<_>>())
    })?;
    shared(lua, host, "mode", |_, host, state: Table| {
        let (bound, node) = state_of(host, &state)?;
        Ok(bound.mode(node))
    })?;
    shared(lua, host, "active_child", |_, host, state: Table| {
        let (bound, node) = state_of(host, &state)?;
        let (status, tables) = (bound.status.borrow(), bound.tables());
        let child = status.active.iter().find(|n| **n != node && tables.chart.parent(**n) == Some(node));
        Ok(child.map_or(Value::Boolean(false), |child| tables.node(*child).clone()))
    })
}

/// What a model looks for among the transitions, and adds to them (`docs/rfsm.md` §8).
fn growing(lua: &Lua, host: &Rc<Host>) -> Result<()> {
    shared(lua, host, "outgoing", |_, host, node: Table| {
        let (bound, id) = state_of(host, &node)?;
        let tables = bound.tables();
        Ok(tables.chart.outgoing(id).map(|edge| tables.edge(edge).clone()).collect::<Vec<_>>())
    })?;
    // How a path goes on at a node. Asked of the chart: what became a parent only while the machine ran is a leaf still.
    shared(lua, host, "ends", |_, host, node: Table| {
        let (bound, id) = state_of(host, &node)?;
        Ok(bound.tables().chart.kind(id).word())
    })?;
    // Nothing: any event does; else whether the transition lists this one.
    shared(lua, host, "lists", |_, host, (fsm, transition, event): (Table, Table, Value)| {
        let bound = machine_of(host, &fsm)?;
        let tables = bound.tables();
        let edge =
            tables.edge_of(&transition).ok_or_else(|| mlua::Error::runtime("this is none of its transitions"))?;
        let event = tables.event(&event);
        Ok(tables.chart.triggers(edge).map(|listed| event.is_some_and(|event| listed.contains(&event))))
    })?;
    shared(lua, host, "merge", |lua, host, args: (Table, Table, Table, Option<String>)| {
        let (fsm, parent, object, name) = args;
        let bound = machine_of(host, &fsm)?;
        let Some(parent) = bound.tables().node_of(&parent) else {
            return Ok(Some("its parent is no state of this machine".to_owned()));
        };
        let refused = merge(lua, &host.native, &bound, (parent, &object), name.as_deref())?;
        if refused.is_none() {
            let mut status = bound.status.borrow_mut();
            status.outbox.iter_mut().for_each(|event| *event = bound.known_now(*event));
            match bound.machine.borrow_mut().as_mut() {
                Some(machine) => machine.exchange(|event| bound.known_now(event)),
                None => bound.has_grown.set(true), // told after the step that is under way
            }
        }
        Ok(refused)
    })
}

fn stepping(lua: &Lua, host: &Rc<Host>) -> Result<()> {
    shared(lua, host, "send", |_, host, args: MultiValue| {
        let mut args = args.into_iter();
        let Some(Value::Table(fsm)) = args.next() else {
            return Err(mlua::Error::runtime("ERROR send_events: invalid fsm argument"));
        };
        let bound = machine_of(host, &fsm)?;
        bound.send(args.take_while(|value| !value.is_nil()));
        flush(&bound);
        Ok(())
    })?;
    shared(lua, host, "check_events", |lua, host, fsm: Table| {
        let bound = machine_of(host, &fsm)?;
        if bound.polls
            && let Value::Function(getevents) = fsm.raw_get("getevents")?
        {
            let events: Value = getevents.call(())?;
            if let Value::Table(list) = events {
                let values: Result<Vec<Value>> = list.sequence_values().collect();
                bound.send(values?);
            }
        }
        let _ = lua;
        flush(&bound);
        let status = bound.status.borrow();
        let idle = bound.machine.borrow().as_ref().map(|machine| machine.queue().events().len());
        Ok(idle.unwrap_or(status.waiting + status.outbox.len()))
    })?;
    shared(lua, host, "reset", |_, host, fsm: Table| {
        let bound = own(host, &fsm, "reset")?;
        let mut machine = taken(&bound)?;
        machine.reset(&bound.tables().chart);
        *bound.status.borrow_mut() = Status { room: limits::CHART_QUEUE, ..Default::default() };
        bound.show_leaf(None);
        *bound.thread.borrow_mut() = None;
        *bound.machine.borrow_mut() = Some(machine);
        Ok(())
    })?;
    shared(lua, host, "exit_state", |lua, host, (fsm, state): (Table, Table)| {
        let bound = own(host, &fsm, "exit_state")?;
        let tables = bound.tables();
        let Some(node) = tables.node_of(&state).filter(|node| tables.chart.is_state(*node)) else {
            return Ok(()); // a connector, or nothing of this machine: there is nothing to leave
        };
        let mut machine = taken(&bound)?;
        machine.leave(&tables.chart, node, &mut Functions { lua: lua.clone(), bound: bound.clone(), _host: None });
        bound.status.borrow_mut().leaf = machine.leaf();
        bound.show_leaf(machine.leaf());
        *bound.machine.borrow_mut() = Some(machine);
        flush(&bound);
        Ok(())
    })?;
    shared(lua, host, "step", |lua, host, (fsm, steps): (Table, f64)| {
        let bound = own(host, &fsm, "step")?;
        let mut machine = taken(&bound)?;
        let outcome = drive(lua, host, &bound, &mut machine, steps);
        *bound.machine.borrow_mut() = Some(machine);
        flush(&bound);
        outcome
    })
}

/// A machine that Lua steps.
fn own(host: &Host, fsm: &Table, what: &str) -> Result<Rc<BoundMachine>> {
    let bound = machine_of(host, fsm)?;
    if bound.driven.get() {
        return Err(mlua::Error::runtime(format!("rfsm.{what}: the coordinator is stepped by Davit")));
    }
    Ok(bound)
}

fn taken(bound: &BoundMachine) -> Result<Machine> {
    let machine = bound.machine.borrow_mut().take();
    machine.ok_or_else(|| mlua::Error::runtime("this machine is being stepped just now"))
}

/// What was sent to a machine that is not being stepped goes straight into its queue.
fn flush(bound: &BoundMachine) {
    if let Some(machine) = bound.machine.borrow_mut().as_mut() {
        let mut status = bound.status.borrow_mut();
        for event in status.outbox.drain(..) {
            machine.send(event);
        }
        status.waiting = machine.queue().events().len();
        status.room = machine.queue().room();
    }
}

/// rFSM's step: microsteps until `steps` of them counted or nothing is left to do.
fn drive(lua: &Lua, host: &Host, bound: &Rc<BoundMachine>, machine: &mut Machine, steps: f64) -> Result<bool> {
    let mut calls = Functions { lua: lua.clone(), bound: bound.clone(), _host: None };
    bound.look_for_dbg();
    let mut left = steps;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // saturates, and the budget ends it long before
    let asked = if steps.is_finite() { steps.max(0.0) as u64 } else { 0 };
    for _ in 0..limits::CHART_RUN.saturating_add(asked) {
        let now = now(host)?;
        let before = machine.work();
        let microstep = machine.microstep(&bound.tables().chart, now, &mut calls);
        bound.status.borrow_mut().leaf = machine.leaf();
        bound.show_leaf(machine.leaf());
        if let Some(error) = bound.failed.borrow_mut().take() {
            return Err(error);
        }
        let searched = u32::try_from(machine.work().saturating_sub(before)).unwrap_or(u32::MAX);
        if host.budget.count.look(limits::TURN_INSTRUCTIONS.saturating_add(searched)) {
            return Err(host.budget.count.error());
        }
        let idle = match microstep {
            MicrostepResult::NotEntered => return Ok(false),
            MicrostepResult::Unmatched => continue,
            MicrostepResult::Entered | MicrostepResult::Taken => false,
            MicrostepResult::Quiet { idle } => idle,
        };
        left -= 1.0;
        if left < 1.0 {
            return Ok(idle);
        }
        if idle && !calls.go_on() {
            return bound.failed.borrow_mut().take().map_or(Ok(true), Err);
        }
    }
    Ok(false)
}

/// The time of inner machines: what the model's own hook says, in nanoseconds or in seconds and nanoseconds.
fn now(host: &Host) -> Result<Time> {
    let hook = host.gettime.borrow().clone();
    let Some(hook) = hook else {
        return Ok(host.clock.borrow().as_ref().map_or_else(Time::default, crate::time::Clock::now));
    };
    let (first, second): (f64, Option<f64>) = hook.call(())?;
    let nanos = second.map_or(first, |nanos| first * 1e9 + nanos);
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // saturates
    Ok(Time(nanos.max(0.0) as u64))
}
