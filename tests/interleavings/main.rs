//! The lock-free parts of the runtime, in every order in which two threads' accesses can fall (the model checker `loom`): what
//! `unsafe` there relies on. The sources themselves are built here, with loom's atomics and cells in place of the standard
//! ones, so a lost exchange, a weaker ordering or two visitors at once is found, not met by chance.

#![allow(dead_code)] // of each source a part is driven

/// In place of `runtime::sync`.
mod sync {
    pub use loom::cell::UnsafeCell;
    pub use loom::sync::Arc;
    pub use loom::sync::atomic::{AtomicPtr, AtomicU8, AtomicU32, Ordering};
}

mod model {
    pub use davit::model::{RunState, Transition};
}

#[path = "../../src/runtime/gate.rs"]
mod gate;
#[path = "../../src/runtime/latest.rs"]
mod latest;
#[path = "../../src/runtime/links.rs"]
mod links;

mod gates;

use loom::thread;

#[test]
fn a_value_is_whole_and_never_older_than_the_one_before() {
    loom::model(|| {
        let (mut writer, mut reader) = latest::latest((0, 0));
        let writing = thread::spawn(move || {
            for i in 1..=3 {
                writer.write(|slot| {
                    slot.0 = i;
                    slot.1 = i;
                });
            }
        });
        let mut last = 0;
        for _ in 0..2 {
            let new = reader.update();
            let (a, b) = *reader.value();
            assert_eq!(a, b);
            assert_eq!(new, a > last, "what is told as new is newer, and nothing else");
            last = a;
        }
        writing.join().unwrap();
        reader.update();
        assert_eq!(*reader.value(), (3, 3), "the last one is read when the writer is through");
    });
}

/// A link of which loom sees who touches it, also when it is dropped.
struct Link(i32, sync::UnsafeCell<i32>, std::sync::Arc<()>);

impl Link {
    fn new(id: i32, counted: &std::sync::Arc<()>) -> Self {
        let link = Self(id, sync::UnsafeCell::new(0), counted.clone());
        link.touch();
        link
    }

    fn touch(&self) -> i32 {
        // SAFETY: whoever has the link has it alone; if not, loom says so.
        self.1.with_mut(|used| unsafe { *used += 1 });
        self.0
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.touch();
    }
}

fn seen(list: &mut links::Links<Link>) -> Vec<i32> {
    list.refresh();
    list.iter_mut().map(|link| link.touch()).collect()
}

#[test]
fn links_are_followed_in_order_and_each_is_dropped_once() {
    loom::model(|| {
        let counted = std::sync::Arc::new(());
        let (mut sender, mut list) = links::links();
        let (one, two) = (Link::new(1, &counted), Link::new(2, &counted));
        let sending = thread::spawn(move || {
            sender.add(1, one);
            sender.add(2, two);
            sender.remove(1);
            sender
        });
        for _ in 0..2 {
            let now = seen(&mut list);
            assert!(matches!(now[..], [] | [1] | [1, 2] | [2]), "{now:?}");
        }
        let sender = sending.join().unwrap();
        assert_eq!(seen(&mut list), [2]);
        drop((sender, list));
        assert_eq!(std::sync::Arc::strong_count(&counted), 1);
    });
}

#[test]
fn what_is_removed_is_handed_back_and_nothing_of_it_is_lost() {
    loom::model(|| {
        let counted = std::sync::Arc::new(());
        let (mut sender, mut list) = links::links();
        sender.add(1, Link::new(1, &counted));
        sender.add(2, Link::new(2, &counted));
        assert_eq!(seen(&mut list), [1, 2]);
        let sending = thread::spawn(move || {
            sender.remove(1);
            sender.remove(2);
            sender
        });
        for _ in 0..2 {
            let now = seen(&mut list);
            assert!(matches!(now[..], [] | [2] | [1, 2]), "{now:?}");
        }
        let mut sender = sending.join().unwrap();
        assert!(seen(&mut list).is_empty());
        sender.remove(3);
        assert_eq!(std::sync::Arc::strong_count(&counted), 1, "what was handed back is dropped with the next order");
    });
}

#[test]
fn either_side_may_end_first() {
    loom::model(|| {
        let counted = std::sync::Arc::new(());
        let (mut sender, mut list) = links::links();
        let one = Link::new(1, &counted);
        let sending = thread::spawn(move || {
            sender.add(1, one);
            sender.remove(1);
        });
        seen(&mut list);
        drop(list);
        sending.join().unwrap();
        assert_eq!(std::sync::Arc::strong_count(&counted), 1);
    });
}
