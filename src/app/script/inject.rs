//! `inject("drive", "overcurrent", { joint = 2 }, now() + 0.5)`: a fault put straight into a component, now or at a given time of
//! the clock, whatever is under way then. `inject("configurator", "panic")` is one in the configurator itself.

use super::{SharedHost, clock, error, figures, session, values};
use crate::limits;
use crate::model::finding::{count, did_you_mean_path};
use crate::model::injection::NoInjection;
use crate::model::{ComponentName, ComponentType, Injection, Value};
use crate::session::{Happening, Session};
use crate::time::{Clock, Signal, Time, lock};
use mlua::{Lua, Table, Value as LuaValue};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

/// What a fault is put into.
#[derive(Clone)]
enum InjectionTarget {
    Component(ComponentName, Injection),
    /// The configurator, whose thread panics.
    Configurator,
}

/// As the log names the configurator, and a script: where the deployment creates a component of that name it is that.
const CONFIGURATOR: &str = "configurator";
/// The one fault that it knows.
const PANIC: &str = "panic";

impl InjectionTarget {
    /// The names of what it is put into, and of what is.
    fn words(&self) -> (String, String) {
        match self {
            Self::Component(component, injection) => (component.to_string(), injection.to_string()),
            Self::Configurator => (CONFIGURATOR.to_owned(), PANIC.to_owned()),
        }
    }
}

/// A fault that is to be put into something.
#[derive(Clone)]
struct PlannedInjection {
    target: InjectionTarget,
    /// The line of the script that wants it.
    place: String,
}

/// Puts faults into components when their time has come: a thread of its own, one of each deployment, from the first one on.
pub(super) struct Injector {
    state: Arc<Mutex<InjectorState>>,
    wake: Signal,
}

#[derive(Default)]
struct InjectorState {
    /// By time, then in the order of the script.
    planned: BTreeMap<(Time, u64), PlannedInjection>,
    number: u64,
    closed: bool,
    failed: Vec<String>,
}

impl Injector {
    fn start(session: &Arc<Session>) -> std::io::Result<Self> {
        let clock = session.clock().clone();
        let injector = Self { state: Arc::default(), wake: clock.signal() };
        let (state, wake, session, own) =
            (injector.state.clone(), injector.wake.clone(), Arc::downgrade(session), clock.clone());
        clock.try_spawn("injector", move || live(&own, &state, &wake, &session))?;
        Ok(injector)
    }

    /// Ends it. What was wanted later does not happen, and is a failure.
    pub(super) fn end(self) -> Vec<String> {
        let mut state = lock(&self.state);
        state.closed = true;
        let planned = std::mem::take(&mut state.planned);
        let mut failed = std::mem::take(&mut state.failed);
        failed.extend(planned.into_iter().map(|((at, _), planned)| {
            let (target, fault) = planned.target.words();
            let (at, place) = (at.as_secs_f64(), planned.place);
            format!("{place}: `{fault}` was to happen to `{target}` at {at} s, and the deployment was down before")
        }));
        drop(state);
        self.wake.notify();
        failed
    }

    /// Why something that was wanted did not happen.
    pub(super) fn failure(&self) -> Option<String> {
        lock(&self.state).failed.pop()
    }
}

fn live(clock: &Clock, state: &Mutex<InjectorState>, wake: &Signal, session: &Weak<Session>) {
    loop {
        let next = lock(state).planned.keys().next().map_or(Time::NEVER, |(at, _)| *at);
        wake.wait(next);
        loop {
            let due = {
                let mut state = lock(state);
                if state.closed {
                    return;
                }
                match state.planned.first_entry() {
                    Some(entry) if entry.key().0 <= clock.now() => entry.remove(),
                    _ => break,
                }
            };
            let Some(session) = session.upgrade() else { return };
            if let Err(why) = happen(&session, &due) {
                lock(state).failed.push(format!("{}: {why}", due.place));
                session.hub().wake();
            }
        }
    }
}

fn happen(session: &Session, planned: &PlannedInjection) -> Result<(), String> {
    let (target, fault) = planned.target.words();
    // Told before it happens: what comes of it stands behind it.
    session.hub().note(Happening::Injected { component: target.clone(), fault: fault.clone() });
    let done = match &planned.target {
        InjectionTarget::Component(component, injection) => {
            let deadline = session.clock().now() + limits::INJECTION;
            session.platform().inject(*component, injection, deadline)
        }
        InjectionTarget::Configurator => match session.inject_configurator_panic() {
            true => Ok(()),
            false => Err("too much waits for it".to_owned()),
        },
    };
    done.map_err(|why| format!("`{fault}` could not be injected into `{target}`: {why}"))
}

pub(super) fn inject(
    host: &SharedHost,
    lua: &Lua,
    component: &str,
    what: &str,
    given: Option<LuaValue>,
    at: Option<f64>,
) -> mlua::Result<()> {
    let session = session(host)?;
    let given = parameters(given)?;
    let planned = PlannedInjection { target: known(host, component, what, &given)?, place: figures::place(lua) };
    let Some(at) = at else { return happen(&session, &planned).map_err(error) };
    let now = clock(host).now();
    if !(at.is_finite() && (0.0..=1e9).contains(&at) && at >= now.as_secs_f64()) {
        let now = now.as_secs_f64();
        let help = "it is a time of the clock, as `now()` has it: `now() + 0.5`, or nothing for at once";
        return Err(error(format!("`inject` at {at} s, and it is {now} s already: {help}")));
    }
    let mut host = host.borrow_mut();
    if host.injector.is_none() {
        let failed = |why: std::io::Error| error(format!("the operating system has no thread for it: {why}"));
        host.injector = Some(Injector::start(&session).map_err(failed)?);
    }
    let injector = host.injector.as_ref().expect("started just now");
    {
        let mut state = lock(&injector.state);
        if state.planned.len() >= limits::INJECTIONS {
            return Err(error(format!("at most {} wait for their time", count(limits::INJECTIONS, "injection"))));
        }
        state.number += 1;
        let key = (Time::default() + Duration::from_secs_f64(at), state.number);
        state.planned.insert(key, planned);
    }
    injector.wake.notify();
    Ok(())
}

fn parameters(given: Option<LuaValue>) -> mlua::Result<Vec<(String, Value)>> {
    let table: Table = match given {
        None | Some(LuaValue::Nil) => return Ok(Vec::new()),
        Some(LuaValue::Table(table)) => table,
        Some(other) => {
            let kind = other.type_name();
            let help = "write `inject(\"drive\", \"overcurrent\", { joint = 2 }, now() + 0.5)`";
            return Err(error(format!("`inject` takes parameters as a table, and this is a {kind}: {help}")));
        }
    };
    let one = |pair: mlua::Result<(LuaValue, LuaValue)>| {
        let (name, value) = pair?;
        Ok((name.to_string()?, values::to_value(&value)?))
    };
    table.pairs().map(one).collect()
}

/// The component, as one of the types as which the deployment creates it, and what is meant to happen to it; or the configurator.
fn known(host: &SharedHost, component: &str, what: &str, given: &[(String, Value)]) -> mlua::Result<InjectionTarget> {
    let host = host.borrow();
    let types: Vec<(ComponentName, Arc<ComponentType>)> = host.faults.created();
    let mut of = types.iter().filter(|(name, _)| name.as_str() == component).peekable();
    if of.peek().is_none() {
        if component == CONFIGURATOR {
            return match what == PANIC && given.is_empty() {
                true => Ok(InjectionTarget::Configurator),
                false => Err(error(
                    "the configurator knows one fault, without parameters: `inject(\"configurator\", \"panic\")`"
                        .to_owned(),
                )),
            };
        }
        let known = types.iter().map(|(name, _)| name.as_str());
        let help = did_you_mean_path(component, "components", known);
        return Err(error(format!("no configuration creates a component `{component}`: {help}")));
    }
    if host.faults.imitated() {
        let instead = format!("`fault(\"start {component}\", \"fail\")` lets a step of it go wrong");
        return Err(error(format!("nothing can be injected into components on this platform: {instead}")));
    }
    let mut wrong: Option<NoInjection> = None;
    for (name, ty) in of {
        match Injection::of(ty, what, given) {
            Ok(injection) => return Ok(InjectionTarget::Component(*name, injection)),
            Err(why) => _ = wrong.get_or_insert(why),
        }
    }
    Err(error(wrong.map_or_else(String::new, |why| why.to_string())))
}
