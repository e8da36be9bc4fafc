//! An allocator that counts what is asked of it: for the thread that asks, and for those that were added to a common count.
//! Threads of other tests, and those of the test runner, are in nobody's count.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts, and leaves everything else to the system's allocator.
pub struct Counting;

/// What several threads ask for together, what is given back among it.
pub struct Together(AtomicU64);

thread_local! {
    static MADE: Cell<u64> = const { Cell::new(0) };
    static TOGETHER: Cell<Option<&'static Together>> = const { Cell::new(None) };
}

fn count(made: u64) {
    MADE.with(|count| count.set(count.get() + made));
    if let Some(together) = TOGETHER.with(Cell::get) {
        together.0.fetch_add(1, Ordering::SeqCst);
    }
}

// SAFETY: every call is handed on to the system's allocator as it came; what is beside it are plain thread-local values without a
// destructor, so that counting neither allocates nor touches a dead thread's memory.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(1);
        // SAFETY: the caller keeps the contract of `alloc`, which is the same here.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        count(0);
        // SAFETY: `at` came from this allocator, that is from the system's, with this layout.
        unsafe { System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(1);
        // SAFETY: as above.
        unsafe { System.realloc(at, layout, size) }
    }
}

/// How often the calling thread has asked for memory so far.
pub fn made() -> u64 {
    MADE.with(Cell::get)
}

/// How often `work` asks for memory, in the calling thread.
pub fn made_by(work: impl FnOnce()) -> u64 {
    let before = made();
    work();
    made() - before
}

impl Together {
    /// Nothing so far.
    pub const fn new() -> Self {
        Self(AtomicU64::new(0))
    }

    /// From now on what the calling thread asks for and gives back counts here. Costs nothing to say again.
    pub fn add_thread(&'static self) {
        TOGETHER.with(|together| together.set(Some(self)));
    }

    /// How often memory was asked for or given back so far.
    pub fn touched(&self) -> u64 {
        self.0.load(Ordering::SeqCst)
    }
}
