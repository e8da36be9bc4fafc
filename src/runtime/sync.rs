//! What the lock-free parts of the runtime are built on, in one place: `tests/interleavings` puts a model checker's in its
//! stead and drives those parts through every order of their accesses.

pub(super) use std::sync::Arc;
pub(super) use std::sync::atomic::{AtomicPtr, AtomicU8, AtomicU32, Ordering};

/// The standard one, asked in the way in which a model checker can watch.
#[derive(Debug, Default)]
pub(super) struct UnsafeCell<T>(std::cell::UnsafeCell<T>);

impl<T> UnsafeCell<T> {
    pub(super) const fn new(value: T) -> Self {
        Self(std::cell::UnsafeCell::new(value))
    }

    /// To look.
    #[inline]
    pub(super) fn with<R>(&self, f: impl FnOnce(*const T) -> R) -> R {
        f(self.0.get())
    }

    /// To change.
    #[inline]
    pub(super) fn with_mut<R>(&self, f: impl FnOnce(*mut T) -> R) -> R {
        f(self.0.get())
    }
}
