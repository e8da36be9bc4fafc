//! A driver that has died: nobody knows what the drives do, and nothing goes on as if they did what they did last.

use crate::scenarios::script;
use std::path::Path;

fn run(name: &str, set: &[(&str, &str)], figures: usize) {
    let end = script(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/youbot").join(name), set);
    assert_eq!(end.figures.len(), figures);
    // Its arm cannot be led down: that is left to somebody who holds it.
    let ended = end.ended.expect("it deployed something");
    assert!(!ended.is_clean(), "{ended:?}");
}

#[test]
fn it_is_noticed_and_nothing_couples() {
    run("driver_dies.lua", &[], 3);
}

#[test]
fn it_is_noticed_wherever_the_drives_have_power() {
    for place in ["fault", "halted", "calibrating", "unfolding"] {
        run("driver_dies_elsewhere.lua", &[("where", place)], 1);
    }
}

/// The parent's world sees it, and `configs/youbot/place.lua` tells whose arm it is.
#[test]
fn whose_arm_came_down_is_told_and_the_other_one_is_not() {
    for who in ["left", "right"] {
        run("fell.lua", &[("who", who)], 3);
    }
}

/// Its driver lives; it has jammed on the way up, and can be taken down by force alone once it has been folded by hand.
#[test]
fn an_arm_that_could_not_unfold_is_held_when_its_drives_are_to_go_off() {
    let end = script(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/youbot/jammed.lua"), &[]);
    assert_eq!(end.figures.len(), 5);
    let ended = end.ended.expect("it deployed something");
    assert!(ended.is_clean() && !ended.is_orderly(), "{ended:?}");
}

/// A call that comes back after its deadline is mended beside whatever the other robot does.
#[test]
fn a_call_that_comes_back_is_mended_while_the_other_one_is_busy() {
    let end = script(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/youbot/returned.lua"), &[]);
    let ended = end.ended.expect("it deployed something");
    assert!(ended.is_clean() && ended.is_orderly(), "{ended:?}");
}
