//! The functions a script may call, and what each takes: one called otherwise is told how it is called.

use super::error;
use mlua::{Error, FromLuaMulti, Lua, MultiValue, Result};

/// Every function: its name, how it is called, and what it takes at most.
const CALLS: &[(&str, &str, usize)] = &[
    ("deploy", "deploy(\"FILE\")` or `deploy(\"FILE\", { replay = true })", 2),
    ("raise", "raise(\"EVENT\")` or `raise(\"EVENT\", { to = \"COORDINATOR\" })", 2),
    ("apply", "apply(\"CONFIGURATION\")` or `apply(\"CONFIGURATION\", { force = true })", 2),
    ("undo", "undo()` or `undo(\"CONFIGURATION\", { force = true })", 2),
    ("set", "set(\"COMPONENT.MEMBER\", VALUE, { force = true })", 3),
    ("commit", "commit()` or `commit{ force = true }", 1),
    ("drift", "drift()", 0),
    ("recover", "recover(\"back\")` or `recover(\"accept\")", 1),
    ("signal", "signal(\"COMPONENT.PORT\")", 1),
    ("sample", "sample{ every = SECONDS, signals = { … } }", 1),
    ("expect", "expect{ name = \"NAME\", value = VALUE, max = BOUND }", 1),
    ("figure", "figure{ name = \"NAME\", value = VALUE }", 1),
    ("param", "param(\"NAME\", DEFAULT)", 2),
    ("wait", "wait(SECONDS)", 1),
    ("wait_state", "wait_state(\"STATE\", SECONDS)", 2),
    ("wait_answer", "wait_answer(\"ID.ok\", SECONDS)", 2),
    ("assert_running", "assert_running(\"COMPONENT\")", 1),
    ("assert_state", "assert_state(\"COMPONENT\", \"STATE\")", 2),
    ("state", "state(\"COMPONENT\")", 1),
    ("property", "property(\"COMPONENT.PROPERTY\")", 1),
    ("port", "port(\"COMPONENT.PORT\")", 1),
    ("system", "system()", 0),
    ("stack", "stack()", 0),
    ("active", "active()", 0),
    ("log", "log()` or `log{ since = SECONDS }", 1),
    ("now", "now()", 0),
    ("say", "say(\"TEXT\")", 1),
    ("fault", "fault(\"STEP\", \"HOW\", TIMES, SECONDS)", 4),
    ("inject", "inject(\"COMPONENT\", \"WHAT\", { … }, AT)", 4),
    ("fail", "fail(\"COMPONENT\")", 1),
    ("shutdown", "shutdown()` or `shutdown{ force = true }", 1),
];

/// Their names.
pub fn functions() -> impl Iterator<Item = &'static str> {
    CALLS.iter().map(|(name, _, _)| *name)
}

/// What a function was called with, as it takes it.
pub(super) fn taken<T: FromLuaMulti>(name: &str, given: MultiValue, lua: &Lua) -> Result<T> {
    let (call, most) = CALLS.iter().find(|(known, _, _)| *known == name).map_or((name, 0), |of| (of.1, of.2));
    let wrong = |what: String| error(format!("`{name}` is called as `{call}`: {what}"));
    let count = given.len();
    if count > most {
        let more = match most {
            0 => "it takes nothing".to_owned(),
            1 => format!("{count} values are given"),
            most => format!("it takes no more than {most} values, and {count} are given"),
        };
        return Err(wrong(more));
    }
    let nil = given.iter().position(mlua::Value::is_nil);
    T::from_lua_multi(given, lua).map_err(|why| match why {
        Error::FromLuaConversionError { from: "nil", .. } => wrong(match nil {
            Some(at) if count == 1 && at == 0 => "what is given is nil".to_owned(),
            Some(at) => format!("of what is given, number {} is nil", at + 1),
            None => "something is missing".to_owned(),
        }),
        Error::FromLuaConversionError { from, to, .. } => {
            let wanted = match to.as_str() {
                "table" | "Table" => "a table",
                "f64" | "number" => "a number",
                _ if from == "string" => return wrong("the text is not UTF-8".to_owned()),
                _ => "a text",
            };
            wrong(format!("{wanted} is wanted where this has the type {from}"))
        }
        other => other,
    })
}
