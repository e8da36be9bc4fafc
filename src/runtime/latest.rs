//! The latest value, from one writer to one reader, wait-free on both sides.
//!
//! Three slots: the writer owns one, the reader owns one, the third lies between them and carries the newest value that
//! was published. Publishing and taking are one atomic exchange each of the slot's number, whatever the other side does.
//! (The crate `triple_buffer` does the same with every slot on cache lines of its own: 512 bytes a value. A deployment
//! has one such cell per property and per connection, so ours is as small as its values.)

use super::sync::{Arc, AtomicU8, Ordering, UnsafeCell};
use std::marker::PhantomData;

/// Set in the middle slot's number when it holds what the reader has not seen.
const NEW: u8 = 4;
const SLOT: u8 = 3;

struct Slots<T> {
    slots: [UnsafeCell<T>; 3],
    /// The number of the slot that neither side owns, and [`NEW`].
    middle: AtomicU8,
}

// SAFETY: every slot is at any time owned by exactly one of writer, reader and middle. The numbers start as 0, 1, 2 and
// only change by exchanging an owned number with the middle one, so they stay three different numbers. A side touches the
// slot it owns only; the exchange is acquire-release, so what one side did to a slot happens before what the other does.
// Values go from thread to thread, so they must be `Send`; that a reader lends its slot to several threads only where the value is
// `Sync` is said by the reader.
unsafe impl<T: Send> Sync for Slots<T> {}

/// The side that writes.
pub struct Writer<T> {
    shared: Arc<Slots<T>>,
    own: u8,
}

/// The side that reads. It may go to another thread with values that may; several threads may look at it at once only where
/// they may look at the value at once.
pub struct Reader<T> {
    shared: Arc<Slots<T>>,
    own: u8,
    /// It lends the value of its slot to whoever sees it, as if it were its own.
    lends: PhantomData<T>,
}

/// A cell that holds `value`, seen.
pub fn latest<T: Clone>(value: T) -> (Writer<T>, Reader<T>) {
    let slots = [UnsafeCell::new(value.clone()), UnsafeCell::new(value.clone()), UnsafeCell::new(value)];
    let shared = Arc::new(Slots { slots, middle: AtomicU8::new(1) });
    (Writer { shared: shared.clone(), own: 0 }, Reader { shared, own: 2, lends: PhantomData })
}

impl<T> Writer<T> {
    /// Publishes what `fill` makes of the slot, which holds an older value (not always the last one). When `fill` panics
    /// nothing is published.
    pub fn write(&mut self, fill: impl FnOnce(&mut T)) {
        // SAFETY: the writer owns the slot `own`, and `&mut self` makes this the only use of it.
        self.shared.slots[usize::from(self.own)].with_mut(|slot| fill(unsafe { &mut *slot }));
        self.own = self.shared.middle.swap(self.own | NEW, Ordering::AcqRel) & SLOT;
    }
}

impl<T> Reader<T> {
    /// Takes the newest value; whether there was one that had not been taken.
    pub fn update(&mut self) -> bool {
        // A value published between the two lines is taken by the exchange all the same.
        if self.shared.middle.load(Ordering::Relaxed) & NEW == 0 {
            return false;
        }
        self.own = self.shared.middle.swap(self.own, Ordering::AcqRel) & SLOT;
        true
    }

    /// The value taken last.
    pub fn value(&self) -> &T {
        // SAFETY: the reader owns the slot `own`; `update` needs `&mut self`, so the slot stays its own meanwhile.
        self.shared.slots[usize::from(self.own)].with(|slot| unsafe { &*slot })
    }
}
