//! What a script looks at: components, their states, properties and in-ports, and what happened.

use super::options::OptionFields;
use super::{SharedHost, error, session, values};
use crate::model::finding::{did_you_mean, did_you_mean_path};
use crate::model::{ComponentName, ComponentSnapshot, Direction, Ident, MemberRef, RunState, Snapshot};
use mlua::{Lua, Table, Value as LuaValue};
use serde_json::{Value as Json, json};

/// The system, as far as anybody knows it.
pub(super) fn system(host: &SharedHost) -> mlua::Result<Snapshot> {
    session(host)?.system().map_err(|unanswered| error(unanswered.to_string()))
}

pub(super) fn component_state(host: &SharedHost, name: &str) -> mlua::Result<Option<RunState>> {
    let system = system(host)?;
    let state = ComponentName::new(name).ok().and_then(|n| system.components.get(&n)).map(|c| c.state);
    Ok(state)
}

pub(super) fn assert_state(host: &SharedHost, name: &str, wanted: &str) -> mlua::Result<()> {
    let known = || did_you_mean(wanted, "run states", RunState::NAMES.iter().copied().chain(["faulted"]));
    let wanted =
        RunState::from_name(wanted).ok_or_else(|| error(format!("`{wanted}` is no run state: {}", known())))?;
    match component_state(host, name)? {
        Some(state) if state == wanted => Ok(()),
        Some(state) => Err(error(format!("`{name}` is {state}, not {wanted}"))),
        None => Err(no_component(name, &system(host)?)),
    }
}

fn member(text: &str) -> mlua::Result<MemberRef> {
    MemberRef::new(text).map_err(|e| error(e.to_string()))
}

/// The component of a member, as the snapshot of the system shows it.
fn component<'a>(host: &SharedHost, system: &'a Snapshot, of: MemberRef) -> mlua::Result<&'a ComponentSnapshot> {
    let name = of.component;
    let exported = || session(host).ok()?.deployment().exported(name.as_str(), of.member.as_str());
    system.components.get(&name).ok_or_else(|| match exported() {
        Some(own) => error(format!("there is no component `{name}`: `{of}` is `{own}` here")),
        None => no_component(name.as_str(), system),
    })
}

fn no_component(name: &str, system: &Snapshot) -> mlua::Error {
    let help = did_you_mean_path(name, "components", system.components.keys().map(ComponentName::as_str));
    error(format!("there is no component `{name}`: {help}"))
}

pub(super) fn property(host: &SharedHost, lua: &Lua, text: &str) -> mlua::Result<LuaValue> {
    let name = member(text)?;
    let system = system(host)?;
    let component = component(host, &system, name)?;
    match component.properties.get(&name.member) {
        Some(value) => values::to_lua(lua, value),
        None => {
            let known = component.properties.keys().map(Ident::as_str);
            Err(error(format!(
                "`{}` has no property `{}`: {}",
                name.component,
                name.member,
                did_you_mean(name.member.as_str(), "properties", known)
            )))
        }
    }
}

/// The value written on an in-port by a configuration; nil when never written.
pub(super) fn port(host: &SharedHost, lua: &Lua, text: &str) -> mlua::Result<LuaValue> {
    let name = member(text)?;
    let system = system(host)?;
    if let Some(value) = system.ports.get(&name) {
        return values::to_lua(lua, value);
    }
    let ty = component(host, &system, name)?.ty;
    let ins = host.borrow().faults.ports(ty, Direction::In);
    if ins.contains(&name.member) {
        return Ok(LuaValue::Nil);
    }
    let help = match host.borrow().faults.ports(ty, Direction::Out).contains(&name.member) {
        true => format!("it is an out-port, and `signal(\"{name}\")` is what it carries now"),
        false => did_you_mean(name.member.as_str(), "in-ports", ins.iter().map(Ident::as_str)),
    };
    Err(error(format!("`{}` has no in-port `{}`: {help}", name.component, name.member)))
}

/// What happened in the deployment, oldest first, as `davit log --json` prints it: from the time `since` on (seconds of the clock), as far
/// back as the log of a session reaches. Where that is not so far the first one says so, as it does to who follows the log.
pub(super) fn log(host: &SharedHost, lua: &Lua, options: Option<Table>) -> mlua::Result<LuaValue> {
    let since = OptionFields::of("log", options, &["since"])?.number("since")?.unwrap_or(f64::NEG_INFINITY);
    if since.is_nan() {
        return Err(error("`log`: `since` is not a number"));
    }
    let (mut entries, displaced) = session(host)?.hub().whole_log();
    // In the order of their times: what comes later is not earlier.
    entries.drain(..entries.partition_point(|entry| entry.at < since));
    let missed = displaced.filter(|(_, at)| *at >= since);
    let missed = missed.map(|(entries, at)| json!({ "at": at, "what": "missed", "entries": entries }));
    let entries: Vec<Json> = missed.into_iter().chain(entries.iter().map(|entry| json!(&**entry))).collect();
    values::to_lua(lua, &entries)
}
