//! What the call under way has used up, and whether that is too much.

use super::errors::UsedUp;
use crate::limits;
use std::cell::{Cell, OnceCell};
use std::ffi::CStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// What an error says inside a call that is over; outside it is [`Count::error`].
pub const ENDED: &CStr = c"ended: its instructions are used up";

/// What whatever was [interrupted](Count::interrupted_by) ends with.
pub const INTERRUPTED: &CStr = c"interrupted from outside";

/// Counts for one call at a time: instructions, and what they set in motion (`work.rs`).
#[derive(Default)]
pub struct Count {
    used: Cell<u64>,
    /// Of these, what was done beside instructions: elements gone through, memory asked for, steps of patterns.
    work: Cell<u64>,
    /// Of these, what ticks stand for.
    ticks: Cell<u64>,
    limit: Cell<u64>,
    /// Processor time of one call where every instruction is counted: for what no count sees.
    time: Duration,
    began: Cell<Duration>,
    looks: Cell<u32>,
    /// A large piece of memory was asked for: single instructions may take long.
    large: Cell<bool>,
    out_of_time: Cell<bool>,
    over: Cell<bool>,
    /// Only calls that take long are counted.
    late: Cell<bool>,
    /// Somebody outside ends what is under way, from another thread.
    interrupt: OnceCell<Arc<AtomicBool>>,
}

/// Looks at the count between two looks at the time.
const LOOKS_WITHOUT_TIME: u32 = 10;

/// Bytes of a piece of memory with which a single instruction may take long.
const LARGE: usize = 256 * 1024;

const LONG: &str = "are there very long texts or lists?";

impl Count {
    /// Nothing is counted yet. `time`: the processor time that a call may take where every instruction is counted.
    pub fn new(time: Duration) -> Self {
        Self { limit: Cell::new(limits::LUA_INSTRUCTIONS), time, ..Self::default() }
    }

    /// From now on only calls that take long are counted.
    pub fn count_late(&self) {
        self.late.set(true);
    }

    /// Whether only calls that take long are counted.
    pub fn counts_late(&self) -> bool {
        self.late.get()
    }

    /// A call begins that may take so many instructions.
    pub fn begin(&self, limit: u64) {
        for counter in [&self.used, &self.work, &self.ticks] {
            counter.set(0);
        }
        self.limit.set(limit);
        if !self.counts_late() {
            self.began.set(processor_time());
            self.looks.set(0);
            self.out_of_time.set(false);
        }
    }

    /// The call has ended; what it ends with if it was over.
    pub fn end(&self) -> Option<mlua::Error> {
        let error = self.over.get().then(|| self.error());
        self.over.set(false);
        error
    }

    /// Once `interrupt` is set a call ends wherever it is, as if its budget were used up, with [`INTERRUPTED`]. For good.
    pub fn interrupted_by(&self, interrupt: Arc<AtomicBool>) {
        let _ = self.interrupt.set(interrupt);
    }

    fn is_interrupted(&self) -> bool {
        self.interrupt.get().is_some_and(|interrupt| interrupt.load(Ordering::Relaxed))
    }

    /// Whether the call under way has to end: its budget is used up, or it was interrupted.
    pub fn is_over(&self) -> bool {
        self.over.get() || self.is_interrupted()
    }

    /// What an error says inside a call that [is over](Self::is_over).
    pub fn ended(&self) -> &'static CStr {
        if !self.over.get() && self.is_interrupted() { INTERRUPTED } else { ENDED }
    }

    /// A call that takes long was found still under way, and has done so many instructions since; whether they are too many.
    pub fn ticked(&self, instructions: u32) -> bool {
        if instructions == limits::CALL_TICK_INSTRUCTIONS {
            self.ticks.set(self.ticks.get() + u64::from(instructions));
        }
        self.look(instructions)
    }

    /// So many instructions more; whether they are too many.
    pub fn look(&self, instructions: u32) -> bool {
        self.add(u64::from(instructions))
    }

    /// The same where every instruction is counted; there the time is looked at too, for what no count sees: instructions
    /// that compare texts of megabytes, or pass a million values.
    pub fn look_exactly(&self, instructions: u32) -> bool {
        self.looks.set(self.looks.get().wrapping_add(1));
        // Asking for the time takes as long as some twenty instructions.
        if (self.large.get() || self.looks.get().is_multiple_of(LOOKS_WITHOUT_TIME))
            && processor_time().saturating_sub(self.began.get()) > self.time
        {
            self.out_of_time.set(true);
            self.over.set(true);
        }
        self.look(instructions) || self.is_over()
    }

    /// Something goes through so many elements; whether that is too much.
    pub fn gone_through(&self, elements: u64) -> bool {
        self.more_work(elements / limits::CALL_ELEMENTS)
    }

    /// Memory is asked for; whether that is too much.
    pub fn allocated(&self, bytes: usize) -> bool {
        if bytes >= LARGE {
            self.large.set(true);
        }
        self.more_work((bytes / limits::CALL_BYTES) as u64)
    }

    fn more_work(&self, instructions: u64) -> bool {
        self.work.set(self.work.get().saturating_add(instructions));
        self.add(instructions)
    }

    fn add(&self, instructions: u64) -> bool {
        self.used.set(self.used.get().saturating_add(instructions));
        let over = self.used.get() > self.limit.get();
        if over {
            self.over.set(true);
        }
        over
    }

    /// Counts the steps of something that is no Lua, each like an instruction; `false`: they are used up, or it has to end.
    pub fn steps(&self) -> impl FnMut() -> bool + '_ {
        let mut steps = 0;
        move || {
            steps += 1;
            if steps < limits::CALL_LOOK {
                return true;
            }
            steps = 0;
            !(self.more_work(u64::from(limits::CALL_LOOK)) || self.is_over())
        }
    }

    /// What a call that is over ends with: what its budget was used up by, if that is why.
    pub fn error(&self) -> mlua::Error {
        if !self.over.get() && self.is_interrupted() {
            return mlua::Error::runtime(INTERRUPTED.to_string_lossy());
        }
        let (used, millions) = (self.used.get(), self.limit.get() / 1_000_000);
        let text = if self.out_of_time.get() {
            format!("ended after {} s of processor time: {LONG}", self.time.as_secs())
        } else if self.ticks.get() > used / 2 {
            let ticks = self.ticks.get() / u64::from(limits::CALL_TICK_INSTRUCTIONS);
            let seconds = limits::CALL_TICK.as_secs_f64() * ticks as f64;
            format!("ended after {seconds:.1} s of processor time: {LONG}")
        } else if self.work.get() > used / 2 {
            format!("ended: what it let the library do counts as more than {millions} million instructions: {LONG}")
        } else {
            format!("ended after {millions} million instructions: is there an endless loop?")
        };
        mlua::Error::external(UsedUp(text))
    }
}

/// The processor's time that this thread has used. Not the time of day: a busy machine must not refuse what an idle one
/// takes.
pub fn processor_time() -> Duration {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: `time` is a valid place to write to, and the call keeps no reference to it.
    let answer = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    if answer != 0 {
        return Duration::ZERO;
    }
    Duration::new(u64::try_from(time.tv_sec).unwrap_or(0), u32::try_from(time.tv_nsec).unwrap_or(0))
}
