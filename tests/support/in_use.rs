//! An allocator that knows how much memory is in use, and how much was at most: for measurements, which tell bytes.

use std::alloc::{GlobalAlloc, Layout};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Counts bytes, and leaves everything else to another allocator.
pub struct InUse<A>(pub A);

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);
static COUNTS: AtomicBool = AtomicBool::new(false);

// SAFETY: every call is handed on as it came; what is beside it are atomic numbers.
unsafe impl<A: GlobalAlloc> GlobalAlloc for InUse<A> {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if COUNTS.load(Ordering::Relaxed) {
            let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
            MOST.fetch_max(now, Ordering::Relaxed);
        }
        // SAFETY: as for whoever called this.
        unsafe { self.0.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        if COUNTS.load(Ordering::Relaxed) {
            // What was made before it began to count is not in it.
            let less = |now: usize| Some(now.saturating_sub(layout.size()));
            let _ = NOW.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less);
        }
        // SAFETY: as for whoever called this.
        unsafe { self.0.dealloc(at, layout) }
    }
}

/// Whether it counts from now on: that costs a tenth of what is measured, so that who measures time does not.
pub fn count(counts: bool) {
    COUNTS.store(counts, Ordering::Relaxed);
}

/// Bytes in use, of what was asked for since it counts. From now on the most of them is looked for.
pub fn now() -> usize {
    let now = NOW.load(Ordering::Relaxed);
    MOST.store(now, Ordering::Relaxed);
    now
}

/// The most that were in use since somebody asked for [`now`].
#[allow(dead_code)] // not every measurement asks
pub fn most() -> usize {
    MOST.load(Ordering::Relaxed)
}
