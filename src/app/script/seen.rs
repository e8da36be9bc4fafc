//! `signal("Arm.state.q[3]")`: what a port carries now.

use super::{SharedHost, clock, error, interrupt, looks, session, values};
use crate::limits;
use crate::model::Value;
use crate::model::monitor::ValuePart;
use crate::session::carried::{FoundSignal, PortLook};
use crate::session::members::{MemberKind, NoMember};
use mlua::{Lua, Value as LuaValue};
use std::collections::VecDeque;

/// The ports that a script looks at, by the signal as it was written. Once asked for, it goes on looking: so it knows what was
/// written last, without waiting.
#[derive(Default)]
pub(super) struct ScriptLooks(VecDeque<(String, PortLook)>);

fn told(why: &NoMember) -> mlua::Error {
    error(format!("{}: {}", why.message, why.help))
}

/// What a signal leads to; no property.
pub(super) fn find(host: &SharedHost, text: &str) -> mlua::Result<FoundSignal> {
    let found = session(host)?.find_signal(text).map_err(|why| told(&why))?;
    if found.kind == MemberKind::Property {
        return Err(error(format!("`{}` is a property: `property(\"{0}\")` reads it", found.signal.member)));
    }
    Ok(found)
}

pub(super) fn signal(host: &SharedHost, lua: &Lua, text: &str) -> mlua::Result<LuaValue> {
    let found = find(host, text)?;
    if found.kind == MemberKind::In {
        let system = looks::system(host)?;
        if !system.connections.keys().any(|(_, to)| *to == found.signal.member) {
            let value = system.ports.get(&found.signal.member).and_then(|value| part(value, &found.signal.path));
            return value.map_or(Ok(LuaValue::Nil), |value| values::of_value(lua, value));
        }
    }
    let kept = host.borrow_mut().looks.take(text);
    let mut look = match kept {
        Some(look) => look,
        None => session(host)?.look_at(&found.signal, &found.ty).map_err(|why| error(format!("`{text}`: {why}")))?,
    };
    let (clock, interrupt) = (clock(host), interrupt(host));
    let deadline = clock.now() + limits::SIGNAL_FIRST;
    let value = loop {
        interrupt.check()?;
        let now = clock.now();
        if let Some((value, _)) = look.seen(now) {
            break value;
        }
        if now >= deadline {
            let seconds = limits::SIGNAL_FIRST.as_secs_f64();
            let help = "is its component running, and does it write there?";
            return Err(error(format!("nothing came through `{}` in {seconds} s: {help}", found.signal.member)));
        }
        let patience = if clock.is_simulated() { deadline } else { deadline.min(now + limits::SIGNAL_LOOK) };
        look.wake.wait(patience);
    };
    host.borrow_mut().looks.keep(text, look);
    values::of_value(lua, &value)
}

impl ScriptLooks {
    fn take(&mut self, text: &str) -> Option<PortLook> {
        let at = self.0.iter().position(|(of, _)| of == text)?;
        self.0.remove(at).map(|(_, look)| look)
    }

    fn keep(&mut self, text: &str, look: PortLook) {
        if self.0.len() >= limits::SIGNALS_KEPT {
            self.0.pop_front();
        }
        self.0.push_back((text.to_owned(), look));
    }
}

/// What is at the end of a way into a value.
fn part<'v>(value: &'v Value, path: &[ValuePart]) -> Option<&'v Value> {
    path.iter().try_fold(value, |value, step| match (step, value) {
        (ValuePart::Index(index), Value::Array(elements)) => elements.get(*index),
        (ValuePart::Field(field), Value::Record(fields)) => {
            fields.iter().find(|(name, _)| name == field).map(|(_, value)| value)
        }
        _ => None,
    })
}
