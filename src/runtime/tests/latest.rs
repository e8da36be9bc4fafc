//! The latest value between two threads. (Every order of their accesses: `tests/interleavings`.)

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
fn the_newest_value_is_read_and_told_once() {
    let (mut writer, mut reader) = latest(0);
    assert!(!reader.update());
    assert_eq!(*reader.value(), 0);
    for i in 1..5 {
        writer.write(|slot| *slot = i);
    }
    assert!(reader.update());
    assert_eq!(*reader.value(), 4);
    assert!(!reader.update());
    assert_eq!(*reader.value(), 4);
}

#[test]
fn no_value_is_torn_and_none_goes_backwards() {
    let (mut writer, mut reader) = latest([0_u64; 16]);
    const LAST: u64 = 200_000;
    let thread = std::thread::spawn(move || {
        for i in 1..=LAST {
            writer.write(|slot| slot.fill(i));
        }
    });
    let mut last = 0;
    while last < LAST {
        reader.update();
        let value = *reader.value();
        assert!(value.iter().all(|v| *v == value[0]), "torn: {value:?}");
        assert!(value[0] >= last);
        last = value[0];
    }
    thread.join().unwrap();
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
