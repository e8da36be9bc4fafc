//! What one instruction of Lua may set in motion, counted like instructions: memory that is asked for, and what a function
//! of the library is about to go through. No hook reaches into a library function, so it is counted before it runs.
//!
//! Memory is counted where it is asked for: copies of texts, lists that grow and texts put together have that in common,
//! whoever does it. A call that is over is given no large piece any more, so that it ends at once.

use super::count::ENDED;
use super::exact;
use crate::limits;
use mlua::ffi::{self, lua_State};
use mlua::{Function, Lua, Result, WeakLua};
use std::cell::Cell;
use std::ffi::{c_int, c_void};
use std::ptr;

/// Pieces that a call that is over still gets: what errors are made of.
const SMALL: usize = 4096;

thread_local! {
    /// The allocator of mlua, which is the same for all its states.
    static PLAIN: Cell<Option<ffi::lua_Alloc>> = const { Cell::new(None) };
}

/// For as long as this lives, the memory that a state asks for is counted.
pub struct CountedMemory {
    lua: WeakLua,
    plain: ffi::lua_Alloc,
}

/// Counts the memory that a state asks for, for who is in a call (`exact::during`). The state's limit of memory must have
/// been set before.
pub fn count_memory(lua: &Lua) -> Result<CountedMemory> {
    let mut plain: Option<ffi::lua_Alloc> = None;
    {
        let plain = &mut plain;
        // SAFETY: the allocator stays mlua's, with its own data; ours only looks at the sizes. A state may be given
        // another allocator at any time as long as it can free what the other one gave.
        unsafe {
            lua.exec_raw::<()>((), move |state| {
                let mut data = ptr::null_mut();
                let before = ffi::lua_getallocf(state, &raw mut data);
                *plain = Some(before);
                PLAIN.set(Some(before));
                ffi::lua_setallocf(state, counting, data);
            })?;
        }
    }
    let plain = plain.ok_or_else(|| mlua::Error::runtime("no allocator"))?;
    Ok(CountedMemory { lua: lua.weak(), plain })
}

impl Drop for CountedMemory {
    fn drop(&mut self) {
        // mlua frees the allocator's data only when it finds its own allocator.
        let Some(lua) = self.lua.try_upgrade() else { return };
        let plain = self.plain;
        // SAFETY: as in `count_memory`, the other way round.
        let _: Result<()> = unsafe {
            lua.exec_raw((), move |state| {
                let mut data = ptr::null_mut();
                ffi::lua_getallocf(state, &raw mut data);
                ffi::lua_setallocf(state, plain, data);
            })
        };
    }
}

/// The allocator. It neither unwinds nor calls Lua.
///
/// # Safety
/// To be called by Lua as its allocator, with the data that [`PLAIN`] was found with.
unsafe extern "C" fn counting(data: *mut c_void, at: *mut c_void, before: usize, now: usize) -> *mut c_void {
    let Some(plain) = PLAIN.get() else { return ptr::null_mut() };
    // Where nothing is there yet, `before` says what kind of thing it will be.
    let grows = at.is_null() || now > before;
    if grows && now >= limits::CALL_BYTES {
        // SAFETY: see `exact::current`.
        if let Some(count) = unsafe { exact::current() }
            && count.allocated(now)
            && now > SMALL
        {
            return ptr::null_mut();
        }
    }
    // SAFETY: all that the allocator's data needs comes from Lua unchanged.
    unsafe { plain(data, at, before, now) }
}

/// `charge(elements)`, called from Lua before something is gone through.
pub fn charge(lua: &Lua) -> Result<Function> {
    // SAFETY: keeps to the interface of Lua's C functions.
    unsafe { lua.create_c_function(charged) }
}

unsafe extern "C-unwind" fn charged(state: *mut lua_State) -> c_int {
    // SAFETY: as Lua calls its C functions; nothing here would be left behind by the error's jump.
    unsafe {
        let elements = ffi::lua_tonumber(state, 1);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // saturates, and no number is zero
        let elements = elements.ceil() as u64;
        if exact::current().is_some_and(|count| count.gone_through(elements)) {
            ffi::lua_pushstring(state, ENDED.as_ptr());
            ffi::lua_error(state)
        }
    }
    0
}
