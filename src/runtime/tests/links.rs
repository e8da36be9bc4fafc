//! Links that are changed while they are used. (Every order of the accesses: `tests/interleavings`.)

use crate::runtime::links::{Links, links};
use std::sync::Arc;

fn seen(list: &mut Links<u64>) -> Vec<u64> {
    list.refresh();
    list.iter_mut().map(|l| *l).collect()
}

#[test]
fn orders_are_followed_in_order() {
    let (mut sender, mut list) = links();
    assert!(!list.refresh());
    sender.add(1, 10);
    sender.add(2, 20);
    sender.add(3, 30);
    sender.remove(2);
    assert_eq!(seen(&mut list), [10, 30]);
    sender.remove(1);
    sender.add(1, 11);
    assert_eq!(seen(&mut list), [30, 11]);
    sender.remove(7);
    sender.remove(3);
    sender.remove(1);
    assert_eq!(seen(&mut list), [] as [u64; 0]);
}

#[test]
fn orders_nobody_follows_do_not_pile_up() {
    let (mut sender, mut list) = links();
    for id in 0..100_000 {
        sender.add(id, id);
        sender.remove(id);
    }
    sender.add(7, 7);
    assert_eq!(seen(&mut list), [7]);
}

#[test]
fn links_are_dropped_once_wherever_they_are() {
    let counter = Arc::new(());
    let (mut sender, mut list) = links();
    for id in 0..4 {
        sender.add(id, counter.clone());
    }
    list.refresh();
    sender.remove(1);
    sender.add(9, counter.clone());
    list.refresh();
    sender.remove(2);
    sender.add(10, counter.clone());
    assert_eq!(Arc::strong_count(&counter), 1 + 4 - 1 + 2);
    drop(list);
    drop(sender);
    assert_eq!(Arc::strong_count(&counter), 1);
}

#[test]
fn a_list_changed_while_it_is_used() {
    let (mut sender, mut list) = links::<u64>();
    let thread = std::thread::spawn(move || {
        for round in 0..20_000 {
            sender.add(round, round);
            if round >= 3 {
                sender.remove(round - 3);
            }
        }
        sender.add(u64::MAX, u64::MAX);
    });
    loop {
        let now = seen(&mut list);
        assert!(now.windows(2).all(|pair| pair[0] < pair[1]) && now.len() <= 5, "{now:?}");
        if now.last() == Some(&u64::MAX) {
            assert_eq!(now.len(), 4);
            break;
        }
    }
    thread.join().unwrap();
}
