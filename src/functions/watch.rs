//! Counting only the calls that take long, so that a call that keeps its budget pays nothing for having one.
//!
//! As soon as a hook is set, Lua looks up from its work at every instruction. So none is set when a call begins. A timer of
//! the operating system ticks with the processor time of this thread, and its signal comes to this very thread. When a
//! tick finds the call under way that the tick before found, it sets the counting hook on what runs, and so does each tick
//! after it, so that few instructions that take long are ended too. Lua allows
//! `lua_sethook` in a signal handler ("can be called during a signal", `ldebug.c`; the interpreter's own Ctrl-C does it);
//! from another thread it would be a data race.
//!
//! What is absent: verdicts (`count.rs` counts and decides) and wall clocks: a thread that waits has no ticks. All that
//! touches Lua behind mlua's back is in this file and in `exact.rs`.

use crate::limits;
use mlua::ffi::{self, lua_State};
use mlua::{Function, Lua, Result, WeakLua};
use std::cell::Cell;
use std::ffi::c_int;
use std::ptr;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU64, Ordering::Relaxed, compiler_fence};

/// A thread of Lua that runs, or that waits for one it resumed. Lives on the stack for so long.
struct RunningThread {
    state: *mut lua_State,
    resumed_by: *mut RunningThread,
}

/// Watches the calls of one Lua state.
///
/// What the signal handler reads is atomic. The handler runs on the thread that writes it, so relaxed accesses do; fences
/// keep the compiler from moving them over what they announce.
pub struct CallWatch {
    lua: WeakLua,
    main: *mut lua_State,
    /// Counts so many instructions; whether the budget is used up.
    look: Box<dyn Fn(u32) -> bool>,
    calls: Cell<u64>,
    /// The number of the call under way; 0: none.
    call: AtomicU64,
    /// The call that the last tick saw.
    seen: AtomicU64,
    counting: AtomicBool,
    /// The innermost one that runs.
    running: AtomicPtr<RunningThread>,
    /// Held for as long as it ticks.
    timer: Option<TickTimer>,
}

thread_local! {
    /// Whose call is under way on this thread. Without a destructor, so that a signal handler may read it.
    static CURRENT: AtomicPtr<CallWatch> = const { AtomicPtr::new(ptr::null_mut()) };
}

/// The watch whose call is under way on this thread.
fn current<'a>() -> Option<&'a CallWatch> {
    let watch = CURRENT.with(|current| current.load(Relaxed));
    // SAFETY: `CallWatch::during` put it there from a borrow that lives until it has taken it away again, and all who ask are
    // called inside of that: the handler on the same thread, and what Lua calls.
    unsafe { watch.cast_const().as_ref() }
}

impl CallWatch {
    /// Watches the calls of `lua` on this thread from now on; `look` is told of every so many instructions of a call that
    /// takes long. None: the operating system gives no timer.
    pub fn start(lua: &Lua, look: impl Fn(u32) -> bool + 'static) -> Option<Self> {
        Self::with(lua, look, TickTimer::start).filter(|watch| watch.timer.is_some())
    }

    fn with(
        lua: &Lua,
        look: impl Fn(u32) -> bool + 'static,
        timer: impl FnOnce() -> Option<TickTimer>,
    ) -> Option<Self> {
        CURRENT.with(|_| ());
        let mut main = ptr::null_mut();
        let asked: Result<()> = {
            let main = &mut main;
            // SAFETY: reads the registry's main thread and leaves the stack as it was. The main thread lives as long as
            // the state.
            unsafe {
                lua.exec_raw((), move |state| {
                    ffi::lua_rawgeti(state, ffi::LUA_REGISTRYINDEX, ffi::LUA_RIDX_MAINTHREAD);
                    *main = ffi::lua_tothread(state, -1);
                    ffi::lua_pop(state, 1);
                })
            }
        };
        asked.ok().filter(|()| !main.is_null())?;
        Some(Self {
            lua: lua.weak(),
            main,
            look: Box::new(look),
            calls: Cell::new(0),
            call: AtomicU64::new(0),
            seen: AtomicU64::new(0),
            counting: AtomicBool::new(false),
            running: AtomicPtr::new(ptr::null_mut()),
            timer: timer(),
        })
    }

    /// Makes an outermost call into the state. Calls inside it belong to it.
    pub fn during<R>(&self, call: impl FnOnce() -> R) -> R {
        struct Under<'a> {
            watch: &'a CallWatch,
            before: *mut CallWatch,
            _lua: Lua,
        }
        impl Drop for Under<'_> {
            fn drop(&mut self) {
                self.watch.call.store(0, Relaxed);
                CURRENT.with(|current| current.store(self.before, Relaxed));
                self.watch.running.store(ptr::null_mut(), Relaxed);
                compiler_fence(std::sync::atomic::Ordering::SeqCst);
                if self.watch.counting.load(Relaxed) {
                    self.watch.rest();
                }
            }
        }
        // Held while the handler may look at the state.
        let Some(lua) = self.lua.try_upgrade() else { return call() };
        let mut main = RunningThread { state: self.main, resumed_by: ptr::null_mut() };
        self.calls.set(self.calls.get().wrapping_add(1));
        self.running.store(&raw mut main, Relaxed);
        let before = CURRENT.with(|current| current.swap(ptr::from_ref(self).cast_mut(), Relaxed));
        compiler_fence(std::sync::atomic::Ordering::SeqCst);
        self.call.store(self.calls.get(), Relaxed);
        let _under = Under { watch: self, before, _lua: lua };
        call()
    }

    /// The call is over: nothing is counted any more. Threads that were left behind with a hook lose it in [`look`].
    #[cold]
    fn rest(&self) {
        self.counting.store(false, Relaxed);
        // SAFETY: the state lives (`Under` holds it), and no call is under way that the handler would set a hook for.
        unsafe { ffi::lua_sethook(self.main, None, 0, 0) };
    }

    /// In the signal handler: touches nothing but atomics and what Lua allows there.
    fn tick(&self) {
        let call = self.call.load(Relaxed);
        if call == 0 || self.seen.swap(call, Relaxed) != call {
            return;
        }
        self.counting.store(true, Relaxed);
        // Those that wait count on where they are. The one that runs looks at its next instruction, however few fit between
        // two ticks; at every tick, since Lua may just have been about to forget a hook that was set before.
        let mut at = self.running.load(Relaxed);
        let mut waits = false;
        // SAFETY: entries are on the stacks of the calls that are under way on this thread, innermost first, each put here
        // after it was filled and taken away before it goes; this thread stands still meanwhile. The threads of Lua in
        // them are anchored by who resumed them.
        while let Some(thread) = unsafe { at.as_ref() } {
            // SAFETY: a living thread of Lua, on whose operating-system thread this runs, as `lua_sethook` wants it in a
            // signal handler.
            unsafe { if waits { count(thread.state) } else { set(thread.state, AT_ONCE) } };
            waits = true;
            at = thread.resumed_by;
        }
    }

    /// Resumes or closes a thread of Lua: while `resume` runs, ticks reach it too. It must not leave by a jump of Lua's.
    fn entered<R>(&self, state: *mut lua_State, resume: impl FnOnce() -> R) -> R {
        struct Leave<'a>(&'a CallWatch, *mut RunningThread);
        impl Drop for Leave<'_> {
            fn drop(&mut self) {
                self.0.running.store(self.1, Relaxed);
                compiler_fence(std::sync::atomic::Ordering::SeqCst);
            }
        }
        let resumed_by = self.running.load(Relaxed);
        let mut entry = RunningThread { state, resumed_by };
        compiler_fence(std::sync::atomic::Ordering::SeqCst);
        self.running.store(&raw mut entry, Relaxed);
        compiler_fence(std::sync::atomic::Ordering::SeqCst);
        let _leave = Leave(self, resumed_by);
        if self.counting.load(Relaxed) {
            // SAFETY: the caller's thread of Lua, alive while it is resumed.
            unsafe { count(state) };
        }
        resume()
    }
}

/// While `resume` resumes a thread, ticks reach it too.
fn entered<R>(state: *mut lua_State, resume: impl FnOnce() -> R) -> R {
    match current() {
        Some(watch) => watch.entered(state, resume),
        None => resume(),
    }
}

/// A hook that looks at the next instruction. By this number [`look`] knows that a tick set it.
const AT_ONCE: c_int = 1;

/// Sets the counting hook where it is missing: to set it again would begin its count anew.
///
/// # Safety
/// `state` is a living thread of Lua that belongs to this thread of the operating system.
unsafe fn count(state: *mut lua_State) {
    // SAFETY: as above.
    unsafe {
        if !ffi::lua_gethook(state).is_some_and(|hook| ptr::fn_addr_eq(hook, look as unsafe extern "C-unwind" fn(_, _)))
        {
            set(state, limits::CALL_LOOK.cast_signed());
        }
    }
}

/// Sets the counting hook, to look after so many instructions.
///
/// # Safety
/// As [`count`].
unsafe fn set(state: *mut lua_State, every: c_int) {
    // SAFETY: as above; `look` may be called whenever Lua calls hooks.
    unsafe { ffi::lua_sethook(state, Some(look), ffi::LUA_MASKCOUNT, every) };
}

/// The hook. It holds nothing that a jump of Lua's would leave behind.
unsafe extern "C-unwind" fn look(state: *mut lua_State, _: *mut ffi::lua_Debug) {
    let counting = current().filter(|watch| watch.counting.load(Relaxed));
    // SAFETY: Lua calls this with the thread that runs, and guarantees room for what is pushed here. An error ends the
    // hook and the instruction it was called at, as Lua provides for hooks.
    unsafe {
        let Some(watch) = counting else { return ffi::lua_sethook(state, None, 0, 0) };
        let mut instructions = limits::CALL_LOOK;
        if ffi::lua_gethookcount(state) == AT_ONCE {
            set(state, instructions.cast_signed());
            instructions = limits::CALL_TICK_INSTRUCTIONS;
        }
        if (watch.look)(instructions) {
            ffi::lua_pushstring(state, super::count::ENDED.as_ptr());
            ffi::lua_error(state)
        }
    }
}

/// `coroutine.resume`, by which ticks reach what it resumes.
unsafe extern "C-unwind" fn resume(state: *mut lua_State) -> c_int {
    // SAFETY: the interface of Lua, used as its own `coroutine.resume` does: arguments go over, results or the error come
    // back, and room is made before. `lua_resume` catches every error, so nothing jumps over `entered`.
    unsafe {
        ffi::luaL_checktype(state, 1, ffi::LUA_TTHREAD);
        let thread = ffi::lua_tothread(state, 1);
        let arguments = ffi::lua_gettop(state) - 1;
        if ffi::lua_checkstack(thread, arguments) == 0 {
            ffi::lua_pushboolean(state, 0);
            ffi::lua_pushstring(state, c"too many arguments to resume".as_ptr());
            return 2;
        }
        ffi::lua_xmove(state, thread, arguments);
        let mut results = 0;
        let status = entered(thread, || ffi::lua_resume(thread, state, arguments, &raw mut results));
        let good = status == ffi::LUA_OK || status == ffi::LUA_YIELD;
        if good && ffi::lua_checkstack(state, results + 1) == 0 {
            ffi::lua_pop(thread, results);
            ffi::lua_pushboolean(state, 0);
            ffi::lua_pushstring(state, c"too many results to resume".as_ptr());
            return 2;
        }
        let moved = if good { results } else { 1 };
        // In this order: a thread that resumes itself finds the error on its own stack.
        ffi::lua_xmove(thread, state, moved);
        ffi::lua_pushboolean(state, c_int::from(good));
        ffi::lua_insert(state, -(moved + 1));
        moved + 1
    }
}

/// `coroutine.close` for a thread that is suspended or dead, which the caller has looked at.
unsafe extern "C-unwind" fn close(state: *mut lua_State) -> c_int {
    // SAFETY: as above; `lua_closethread` answers errors of what it closes and does not raise them, and leaves one value
    // on the thread when it failed.
    unsafe {
        ffi::luaL_checktype(state, 1, ffi::LUA_TTHREAD);
        let thread = ffi::lua_tothread(state, 1);
        let status = entered(thread, || ffi::lua_closethread(thread, state));
        ffi::lua_pushboolean(state, c_int::from(status == ffi::LUA_OK));
        if status == ffi::LUA_OK {
            return 1;
        }
        ffi::lua_xmove(thread, state, 1);
        2
    }
}

/// What takes the place of `coroutine.resume` and of the heart of `coroutine.close`.
pub fn functions(lua: &Lua) -> Result<(Function, Function)> {
    // SAFETY: both keep to the interface of Lua's C functions.
    unsafe { Ok((lua.create_c_function(resume)?, lua.create_c_function(close)?)) }
}

/// A timer that signals this thread after every [`limits::CALL_TICK`] of its processor time.
struct TickTimer(libc::timer_t);

impl TickTimer {
    fn start() -> Option<Self> {
        let signal = signal()?;
        let period = libc::timespec { tv_sec: 0, tv_nsec: limits::CALL_TICK.subsec_nanos().into() };
        let every = libc::itimerspec { it_interval: period, it_value: period };
        // SAFETY: `sigevent` is plain data, for which zero is a value; both calls read what they are given and keep
        // nothing; the timer is one that was just made.
        unsafe {
            let mut event: libc::sigevent = std::mem::zeroed();
            event.sigev_notify = libc::SIGEV_THREAD_ID;
            event.sigev_signo = signal;
            event.sigev_notify_thread_id = libc::gettid();
            let mut timer: libc::timer_t = ptr::null_mut();
            if libc::timer_create(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut event, &raw mut timer) != 0 {
                return None;
            }
            let timer = Self(timer);
            (libc::timer_settime(timer.0, 0, &raw const every, ptr::null_mut()) == 0).then_some(timer)
        }
    }
}

impl Drop for TickTimer {
    fn drop(&mut self) {
        // SAFETY: made by `start`, deleted once. A signal that is still on its way finds no call under way.
        unsafe { libc::timer_delete(self.0) };
    }
}

/// The signal of all timers, with its handler, which stays for the life of the process: its default would end it.
fn signal() -> Option<c_int> {
    static SIGNAL: OnceLock<Option<c_int>> = OnceLock::new();
    *SIGNAL.get_or_init(|| {
        let signal = libc::SIGRTMIN() + 5;
        // SAFETY: the handler reads a thread-local without destructor, atomics, and calls `lua_sethook`: no allocation, no
        // lock, no panic. Whoever else sends the signal, to whatever thread, causes at most one tick.
        let registered =
            unsafe { signal_hook::low_level::register(signal, || current().into_iter().for_each(CallWatch::tick)) };
        registered.ok().map(|_| signal)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mlua::Thread;
    use std::rc::Rc;

    /// A state whose function `tick` is a tick, the only ones there are, and whose calls are over after so many looks.
    fn watched(looks: u64) -> (Lua, CallWatch, Rc<Cell<u64>>) {
        let lua = Lua::new();
        let seen = Rc::new(Cell::new(0));
        let counted = seen.clone();
        let look = move |_| {
            counted.set(counted.get() + 1);
            counted.get() >= looks
        };
        let watch = CallWatch::with(&lua, look, || None).expect("a main thread");
        let tick = lua.create_function(|_, ()| {
            current().expect("a call").tick();
            Ok(())
        });
        lua.globals().set("tick", tick.expect("a function")).expect("a global");
        let asks = lua.create_function(|lua, ()| Ok(hooked(lua))).expect("a function");
        lua.globals().set("hooked", asks).expect("a global");
        let (resume, _) = functions(&lua).expect("functions");
        lua.globals().set("resume", resume).expect("a global");
        (lua, watch, seen)
    }

    fn hooked(lua: &Lua) -> bool {
        let mut hooked = false;
        // SAFETY: reads, and leaves the stack alone.
        unsafe { lua.exec_raw::<()>((), |state| hooked = ffi::lua_gethook(state).is_some()) }.expect("it runs");
        hooked
    }

    #[test]
    fn two_ticks_in_one_call_count_it_and_its_end_ends_that() {
        let (lua, watch, seen) = watched(u64::MAX);
        let run = |text: &str| watch.during(|| lua.load(text).exec()).expect("it runs");
        run("tick() assert(not hooked()) for i = 1, 1e5 do end assert(not hooked())");
        run("tick() assert(not hooked()) for i = 1, 1e5 do end assert(not hooked())");
        assert_eq!(seen.get(), 0);
        run("tick() tick() assert(hooked()) for i = 1, 1e5 do end assert(hooked())");
        assert!(seen.get() >= 100, "{}", seen.get());
        assert!(!hooked(&lua) && !watch.counting.load(Relaxed));
    }

    #[test]
    fn ticks_do_not_begin_the_count_anew_but_are_looks() {
        let (lua, watch, seen) = watched(u64::MAX);
        watch.during(|| lua.load("for i = 1, 101 do tick() end").exec()).expect("it runs");
        assert_eq!(seen.get(), 100);
    }

    #[test]
    fn a_coroutine_that_yields_between_two_looks_is_counted() {
        let (lua, watch, seen) = watched(u64::MAX);
        let text =
            "local co = coroutine.create(function() while true do for i = 1, 900 do end coroutine.yield() end end)
            tick() tick() for i = 1, 100 do resume(co) end";
        watch.during(|| lua.load(text).exec()).expect("it runs");
        assert!(seen.get() >= 80, "{}", seen.get());
    }

    #[test]
    fn what_is_resumed_is_counted_before_and_after_the_tick() {
        for text in [
            "resume(coroutine.create(function() tick() tick() while true do end end)) error('it went on', 0)",
            "local co = coroutine.create(function() while true do end end) tick() tick() resume(co) error('on', 0)",
            "resume(coroutine.create(function() resume(coroutine.create(function() tick() tick() end)) while true do end end)) tick()",
        ] {
            let (lua, watch, seen) = watched(50);
            let outcome = watch.during(|| lua.load(text).exec());
            assert!(seen.get() >= 50, "{text}");
            assert!(outcome.is_err() || text.ends_with("tick()"), "{text}");
            assert!(!hooked(&lua));
        }
    }

    #[test]
    fn a_coroutine_left_with_a_hook_loses_it() {
        let (lua, watch, _) = watched(u64::MAX);
        let run = |text: &str| watch.during(|| lua.load(text).exec()).expect("it runs");
        run(
            "co = coroutine.create(function() tick() tick() coroutine.yield() for i = 1, 1e5 do end coroutine.yield() end) resume(co)",
        );
        let thread: Thread = lua.globals().get("co").expect("it is there");
        // SAFETY: reads a hook of a thread that is held.
        let hooked = || unsafe { ffi::lua_gethook(thread.state()) }.is_some();
        assert!(hooked());
        run("resume(co)");
        assert!(!hooked());
    }

    #[test]
    fn a_tick_counts_as_the_instructions_that_its_time_is_for() {
        let lua = Lua::new();
        let sum = Rc::new(Cell::new(0));
        let counted = sum.clone();
        let look = move |instructions: u32| {
            counted.set(counted.get() + u64::from(instructions));
            false
        };
        let watch = CallWatch::with(&lua, look, || None).expect("a main thread");
        let tick = lua.create_function(|_, ()| {
            current().expect("a call").tick();
            Ok(())
        });
        lua.globals().set("tick", tick.expect("a function")).expect("a global");
        watch.during(|| lua.load("tick() tick() tick() for i = 1, 1500 do end").exec()).expect("it runs");
        assert_eq!(sum.get(), 2 * u64::from(limits::CALL_TICK_INSTRUCTIONS) + u64::from(limits::CALL_LOOK));
    }

    #[test]
    fn a_signal_of_somebody_else_does_nothing() {
        let (lua, watch, _) = watched(1);
        let signal = signal().expect("a signal");
        for _ in 0..3 {
            signal_hook::low_level::raise(signal).expect("raised");
        }
        watch.during(|| lua.load("for i = 1, 10 do end").exec()).expect("it runs");
        assert!(!hooked(&lua));
    }
}
