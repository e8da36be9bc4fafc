//! What of the latest value between two threads is left by `tests/interleavings`, which tries every order of their accesses.

use crate::runtime::latest::{Reader, latest};
use std::cell::Cell;

/// Several threads may look at a reader at once only where they may look at its value at once: were a reader of a cell to
/// be shared, it would not be clear which of the two is meant, and this would not compile.
#[test]
fn a_reader_is_shared_only_where_its_value_may_be() {
    trait Either<A> {
        fn one() {}
    }
    struct Shared;
    impl<T: ?Sized> Either<()> for T {}
    impl<T: ?Sized + Sync> Either<Shared> for T {}
    <Reader<Cell<u64>> as Either<_>>::one();
    <Reader<u64> as Either<Shared>>::one();
}

#[test]
fn a_panic_while_filling_publishes_nothing() {
    let (mut writer, mut reader) = latest(1);
    let panicked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        writer.write(|slot| {
            *slot = 2;
            std::panic::resume_unwind(Box::new(()));
        });
    }));
    assert!(panicked.is_err());
    assert!(!reader.update());
    assert_eq!(*reader.value(), 1);
    writer.write(|slot| *slot = 3);
    assert!(reader.update());
    assert_eq!(*reader.value(), 3);
}
