//! What of links that are changed while they are used is left by `tests/interleavings`, which tries every order of the accesses.

use crate::runtime::links::{Links, links};

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
