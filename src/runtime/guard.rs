//! Calling a component's own code so that its panic stays its own.

use crate::time::clock::panic_text;
use std::any::Any;
use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    /// Whether the code that runs in this thread is a component's.
    static CALLED: Cell<bool> = const { Cell::new(false) };
    /// Where the panic caught next happened.
    static PLACE: RefCell<String> = const { RefCell::new(String::new()) };
}

/// From now on panics of components print nothing: they are reported as what they are, faults. All other panics go to
/// the hook that was set before.
pub(crate) fn install() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |info| {
            if CALLED.get() {
                let place = info.location().map(|at| format!(" ({}:{})", at.file(), at.line())).unwrap_or_default();
                PLACE.with_borrow_mut(|slot| *slot = place);
            } else {
                before(info);
            }
        }));
    });
}

/// Calls `f`, a component's own code.
///
/// # Errors
/// The text of its panic, with its place.
#[inline]
pub(crate) fn call<R>(f: impl FnOnce() -> R) -> Result<R, String> {
    let before = CALLED.replace(true);
    let result = catch_unwind(AssertUnwindSafe(f));
    CALLED.set(before);
    result.map_err(told)
}

#[cold]
fn told(payload: Box<dyn Any + Send>) -> String {
    let text = format!("{}{}", panic_text(&*payload), PLACE.with_borrow_mut(std::mem::take));
    // What it unwound with is a component's too, and may panic when it is dropped.
    let _ = catch_unwind(AssertUnwindSafe(|| drop(payload)));
    text
}
