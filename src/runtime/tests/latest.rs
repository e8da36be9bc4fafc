//! The latest value between two threads. (Every order of their accesses: `tests/interleavings`.)

use crate::runtime::latest::latest;

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
