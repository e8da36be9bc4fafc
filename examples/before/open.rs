//! The platform `open`: the built-in one, with functions by which a coordinator calls components and waits.

use davit::platforms::{Call, MemberRef, Outcome, Platform, PlatformKind, PlatformMaker};
use davit::{Clock, Step, Value};
use std::time::Duration;

/// How long a call is waited for. Who writes such a coordinator mostly waits for ever; the arm's longest motion takes 4.5 s.
const PATIENCE: Duration = Duration::from_secs(20);

/// Carries out one step, and waits for it.
fn carry_out(platform: &dyn Platform, clock: &Clock, step: &Step) -> Result<Value, String> {
    match platform.execute(step, clock.now() + PATIENCE) {
        Outcome::Done(answer) => Ok(answer.unwrap_or(Value::Bool(true))),
        Outcome::NotDone(cause) | Outcome::Unknown(cause) => Err(format!("{step}: {cause}")),
    }
}

fn member(value: &Value) -> Result<MemberRef, String> {
    match value {
        Value::Str(text) => text.parse().map_err(|why| format!("{why}")),
        other => Err(format!("{other} is no `Component.member`")),
    }
}

/// `call("youbot.setControlMode", 6)`
fn call(platform: &dyn Platform, clock: &Clock, values: &[Value]) -> Result<Value, String> {
    let [operation, args @ ..] = values else { return Err("call(\"Component.operation\", …)".to_owned()) };
    let call = Call { operation: member(operation)?, args: args.to_vec() };
    carry_out(platform, clock, &Step::Operation(call))
}

/// `set("Dynamics.force_gain", { 0, 0, 0 })`
fn set(platform: &dyn Platform, clock: &Clock, values: &[Value]) -> Result<Value, String> {
    let [property, value] = values else { return Err("set(\"Component.property\", value)".to_owned()) };
    let property = member(property)?;
    let there = platform.observe_component(property.component, clock.now() + PATIENCE);
    let there = there.map_err(|why| why.to_string())?.ok_or_else(|| format!("there is no {}", property.component))?;
    let ty = platform.catalogue().get(there.ty).and_then(|ty| ty.properties.get(&property.member));
    let ty = &ty.ok_or_else(|| format!("there is no {property}"))?.ty;
    let value = value.clone().fit(ty).map_err(|why| format!("{property}: {why}"))?;
    carry_out(platform, clock, &Step::PropertySet { property, value })
}

/// `write("Cart_Impedance.ext_ref_mode", true)`
fn write(platform: &dyn Platform, clock: &Clock, values: &[Value]) -> Result<Value, String> {
    let [port, value] = values else { return Err("write(\"Component.port\", value)".to_owned()) };
    carry_out(platform, clock, &Step::PortWrite { port: member(port)?, value: Some(value.clone()) })
}

/// The platform.
pub fn platform() -> PlatformMaker {
    PlatformMaker::new("open", PlatformKind::EMBEDDED, |making| Ok(making.embedded()))
        .function("call", call)
        .function("set", set)
        .function("write", write)
}
