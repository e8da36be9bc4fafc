//! Counting every call from its first instruction on.
//!
//! The hook is our own. An error out of one of mlua's clears the frame of the function that runs first, and so closes the
//! variables of that function (`local x <close>`) inside the hook, where nothing is counted: what they do when they are
//! closed would run for ever.

use crate::limits;
use mlua::ffi::{self, lua_State};
use mlua::{Lua, Result};
use std::cell::Cell;
use std::ptr;

use super::count::Count;

thread_local! {
    /// Whose call is under way on this thread.
    static CURRENT: Cell<*const Count> = const { Cell::new(ptr::null()) };
}

/// Counts the instructions of all code of a state for [`during`]. Coroutines inherit it from who makes them.
pub fn begin(lua: &Lua) -> Result<()> {
    // SAFETY: a hook that keeps to what Lua allows in hooks, on a state of this thread.
    unsafe { lua.exec_raw((), |state| set(state, true)) }
}

/// Counts no more. Coroutines that have the hook lose it in their next call.
pub fn end(lua: &Lua) -> Result<()> {
    // SAFETY: as above.
    unsafe { lua.exec_raw((), |state| set(state, false)) }
}

/// Makes a call whose instructions `count` counts.
pub fn during<R>(count: &Count, call: impl FnOnce() -> R) -> R {
    struct Leave(*const Count);
    impl Drop for Leave {
        fn drop(&mut self) {
            CURRENT.set(self.0);
        }
    }
    let _leave = Leave(CURRENT.replace(count));
    call()
}

/// Whose call is under way on this thread.
///
/// # Safety
/// For who is called by Lua inside of [`during`], and is done before that is.
pub unsafe fn current<'a>() -> Option<&'a Count> {
    // SAFETY: `during` put it there from a borrow that lives until it has taken it away again.
    unsafe { CURRENT.get().as_ref() }
}

/// # Safety
/// `state` is a living thread of Lua that belongs to this thread of the operating system.
unsafe fn set(state: *mut lua_State, on: bool) {
    let every = limits::CALL_LOOK_EXACT.cast_signed();
    // SAFETY: as above; `hook` may be called whenever Lua calls hooks.
    unsafe {
        if on {
            ffi::lua_sethook(state, Some(hook), ffi::LUA_MASKCOUNT, every)
        } else {
            ffi::lua_sethook(state, None, 0, 0)
        }
    }
}

/// The hook. It holds nothing that a jump of Lua's would leave behind.
unsafe extern "C-unwind" fn hook(state: *mut lua_State, _: *mut ffi::lua_Debug) {
    // SAFETY: Lua runs inside of `during`. Lua guarantees room for what is pushed here; an error ends the hook and the instruction it was called at.
    unsafe {
        let Some(count) = current() else { return };
        if count.counts_late() {
            set(state, false);
        } else if count.look_exactly(limits::CALL_LOOK_EXACT) {
            ffi::lua_pushstring(state, count.ended().as_ptr());
            ffi::lua_error(state)
        }
    }
}
