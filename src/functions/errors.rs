//! The texts of errors, as people who write Lua expect them: `file:line: message`, without stack traces.

use crate::limits;
use mlua::Error;

/// What a call ends with that has used up what it may use of the processor.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct UsedUp(pub String);

/// Of which there was not enough.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Short {
    /// Instructions, or the processor's time.
    Instructions,
    /// Memory.
    Memory,
}

/// What an error ran out of, if that is what it is.
pub fn short_of(error: &Error) -> Option<Short> {
    match error {
        Error::CallbackError { cause, .. } | Error::WithContext { cause, .. } => short_of(cause),
        Error::MemoryError(_) => Some(Short::Memory),
        other => other.downcast_ref::<UsedUp>().map(|_| Short::Instructions),
    }
}

/// The text of an error of a coordinator's functions, with file and line where Lua knows them.
pub fn message_of(error: &Error) -> String {
    message_within(error, limits::FUNCTIONS_BYTES)
}

/// The same of any state, which may hold so many bytes.
pub fn message_within(error: &Error, bytes: usize) -> String {
    let text = match error {
        Error::CallbackError { cause, traceback } => {
            let text = message_within(cause, bytes);
            return match place(traceback) {
                Some(place) if !has_place(&text) => format!("{place}: {text}"),
                _ => text,
            };
        }
        Error::SyntaxError { message, .. } | Error::RuntimeError(message) | Error::MemoryError(message) => {
            message.clone()
        }
        Error::WithContext { context, .. } => context.clone(),
        other => other.to_string(),
    };
    let text = text.split("\nstack traceback:").next().unwrap_or_default();
    let text = text.strip_prefix("runtime error: ").unwrap_or(text);
    if text.contains("not enough memory") {
        return format!("needs more than the {} MB of memory that it may hold", bytes / 1024 / 1024);
    }
    match without_address(text) {
        Some(kind) => format!("the error is a {kind} and no text"),
        None => text.to_owned(),
    }
}

/// What kind of thing a text stands for that is nothing but its address (`table: 0x55d0`).
pub fn without_address(text: &str) -> Option<&str> {
    let (kind, address) = text.split_once(": 0x")?;
    let kinds = ["table", "function", "thread", "userdata"];
    (kinds.contains(&kind) && address.bytes().all(|b| b.is_ascii_hexdigit())).then_some(kind)
}

/// The global name that an error found undefined.
pub fn undefined_global(message: &str) -> Option<&str> {
    message.split("(global '").nth(1)?.split('\'').next().filter(|name| !name.is_empty())
}

/// Names of the texts that are ours: nobody looks for a mistake there.
const OURS: [&str; 3] = ["rfsm", "[davit]", "__mlua_index"];

/// The innermost place in a stack trace that is not ours: `story.lua:12`.
fn place(traceback: &str) -> Option<String> {
    traceback.lines().map(str::trim).find_map(|line| {
        let (place, _) = line.split_once(": in ")?;
        let (file, number) = place.rsplit_once(':')?;
        let known = !OURS.contains(&file) && !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
        known.then(|| format!("{file}:{number}"))
    })
}

/// Whether a text begins with a place: `file:line: `.
fn has_place(text: &str) -> bool {
    let first = text.lines().next().unwrap_or_default();
    first.split(": ").next().is_some_and(|place| {
        place.rsplit_once(':').is_some_and(|(_, line)| !line.is_empty() && line.bytes().all(|b| b.is_ascii_digit()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn an_error_of_ours_is_told_at_the_line_that_called() {
        let traceback = "stack traceback:\n\t[C]: in ?\n\t[davit]:12: in function 'pcall'\n\trfsm:391: in function 'rfsm.step'\n\tmodel.lua:5: in function <model.lua:4>";
        #[allow(clippy::arc_with_non_send_sync)] // mlua's own field
        let error = |text: &str| Error::CallbackError {
            traceback: traceback.to_owned(),
            cause: Arc::new(Error::runtime(text.to_owned())),
        };
        assert_eq!(message_of(&error("not so")), "model.lua:5: not so");
        assert_eq!(message_of(&error("other.lua:7: not so: no")), "other.lua:7: not so: no");
        assert_eq!(message_of(&error("why: 12: no")), "model.lua:5: why: 12: no");
        assert_eq!(place("stack traceback:\n\t[C]: in ?"), None);
    }
}
