//! The texts of errors, as people who write Lua expect them: `file:line: message`, without stack traces.

use crate::limits;
use mlua::Error;
use std::sync::Arc;

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

/// The text of an error of a coordinator's functions as rFSM tells it: with file and line where Lua gives them, and of an error of ours, which has none.
pub fn message_of(error: &Error) -> String {
    let at = match error {
        Error::CallbackError { .. } => place_of(error, is_theirs),
        _ => None,
    };
    told(error, at, limits::FUNCTIONS_BYTES)
}

/// The text of an error of any state, which may hold so many bytes, with file and line wherever it was raised.
pub fn message_within(error: &Error, bytes: usize) -> String {
    told(error, place_of(error, is_theirs), bytes)
}

fn told(error: &Error, at: Option<(String, u32)>, bytes: usize) -> String {
    let text = text_of(error);
    let text = match text.contains("not enough memory") {
        true => format!("needs more than the {} MB of memory that it may hold", bytes / 1024 / 1024),
        false => text,
    };
    match at {
        Some((file, line)) if !has_place(&text) => format!("{file}:{line}: {text}"),
        _ => text,
    }
}

/// The text of an error as Lua has it, without stack traces.
pub fn text_of(error: &Error) -> String {
    let text = match error {
        Error::CallbackError { cause, .. } => return text_of(cause),
        Error::SyntaxError { message, .. } | Error::RuntimeError(message) | Error::MemoryError(message) => {
            message.clone()
        }
        Error::WithContext { context, .. } => context.clone(),
        other => other.to_string(),
    };
    let text = text.split(TRACE).next().unwrap_or_default();
    let text = text.strip_prefix("runtime error: ").unwrap_or(text);
    match without_address(text) {
        Some(kind) => format!("the error is a {kind} and no text"),
        None => text.to_owned(),
    }
}

/// Where an error was raised by its stack trace, innermost first: file and line, of the files that are looked for. What is raised without a
/// place (`error("no", 0)`, a table, an error of ours) has no other.
pub fn place_of(error: &Error, of: fn(&str) -> bool) -> Option<(String, u32)> {
    match error {
        Error::CallbackError { cause, traceback } => place_of(cause, of).or_else(|| place(traceback, of)),
        Error::RuntimeError(message) => place(message.split_once(TRACE)?.1, of),
        _ => None,
    }
}

/// Tells one error at the place of another one, in whose course it came about.
pub fn placed(error: Error, at: &Error) -> Error {
    let traceback = match at {
        Error::CallbackError { traceback, .. } => traceback.as_str(),
        Error::RuntimeError(message) => message.split_once(TRACE).map_or("", |(_, trace)| trace),
        _ => "",
    };
    #[allow(clippy::arc_with_non_send_sync)] // mlua's own field
    Error::CallbackError { traceback: traceback.to_owned(), cause: Arc::new(error) }
}

/// What a stack trace begins with.
const TRACE: &str = "\nstack traceback:";

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

fn is_theirs(file: &str) -> bool {
    !OURS.contains(&file)
}

/// The innermost place of such files in a stack trace: `story.lua`, 12.
fn place(traceback: &str, of: fn(&str) -> bool) -> Option<(String, u32)> {
    traceback.lines().map(str::trim).find_map(|line| {
        let (place, _) = line.split_once(": in ")?;
        let (file, number) = place.rsplit_once(':')?;
        Some((of(file).then(|| file.to_owned())?, number.parse().ok()?))
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
        assert_eq!(place("stack traceback:\n\t[C]: in ?", |_| true), None);
        let table =
            Error::runtime("table: 0x55d0\nstack traceback:\n\t[C]: in function 'error'\n\tmodel.lua:7: in main chunk");
        assert_eq!(message_within(&table, 1), "model.lua:7: the error is a table and no text");
        assert_eq!(message_of(&table), "the error is a table and no text");
    }
}
