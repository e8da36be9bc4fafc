//! What a command that keeps a robot up still has to say when nobody may be reading any more: findings, a panic.
//!
//! It is written in a thread of its own, and the end of the process waits for it only as long as somebody reads: a terminal
//! that was stopped (Ctrl-S) or a pipe that is full keeps neither a thread that acts nor the exit status waiting.

use super::output;
use crate::limits;
use crate::model::finding::count;
use crate::session::tap::{News, Tap};
use crate::time::Clock;
use crate::time::clock::panic_text;
use std::backtrace::{Backtrace, BacktraceStatus};
use std::panic::PanicHookInfo;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

type LastWord = Box<dyn FnOnce() + Send>;

static WORDS: OnceLock<Tap<LastWord>> = OnceLock::new();

/// Lines of the story were not read.
static STALLED: AtomicBool = AtomicBool::new(false);

/// From now on [`say`] does not wait, and a panic is told that way.
///
/// # Errors
/// When the operating system has no thread left.
pub fn prepare() -> std::io::Result<()> {
    let tap = Tap::new("davit-last-words", limits::TAP_OWN, &Clock::real(), |news: News<LastWord>| match news {
        News::One(job) => job(),
        News::Missed(words) => output::error(&format!("note: {} could not be written\n", count(words, "message"))),
    })?;
    if WORDS.set(tap).is_ok() {
        std::panic::set_hook(Box::new(|info| {
            let text = told(info);
            say(move || output::panic(&text));
        }));
    }
    Ok(())
}

/// As the standard library tells it.
fn told(info: &PanicHookInfo<'_>) -> String {
    let thread = std::thread::current();
    let place = info.location().map(ToString::to_string).unwrap_or_default();
    let why = panic_text(info.payload());
    let mut text = format!("thread '{}' panicked at {place}:\n{why}\n", thread.name().unwrap_or("unnamed"));
    let trace = Backtrace::capture();
    if trace.status() == BacktraceStatus::Captured {
        text.push_str(&format!("{trace}\n"));
    }
    text
}

/// Has `job` write something: behind what was said before, never waiting for it; at once in a command that has not
/// [prepared](prepare).
pub fn say(job: impl FnOnce() + Send + 'static) {
    match WORDS.get() {
        Some(tap) => tap.put(Box::new(job)),
        None => job(),
    }
}

/// So many lines of the story were not written, since nobody read them.
pub fn unread(lines: u64) {
    if lines > 0 {
        STALLED.store(true, Ordering::Relaxed);
        let lines = count(lines, "line");
        say(move || output::error(&format!("note: {lines} could not be written: nobody reads\n")));
    }
}

/// Waits until all is written, as long as somebody reads.
pub fn end() {
    if let Some(tap) = WORDS.get() {
        // Who took nothing of the story for that long is not waited for as long once more.
        tap.flush(if STALLED.load(Ordering::Relaxed) { limits::TAP_END_AGAIN } else { limits::TAP_END });
    }
}
