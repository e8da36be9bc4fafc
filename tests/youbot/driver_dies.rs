//! A driver that has died: nobody knows what the drives do, and nothing goes on as if they did what they did last.

use crate::scenarios::script;
use std::path::Path;

#[test]
fn it_is_noticed_and_nothing_couples() {
    let end = script(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/youbot/driver_dies.lua"), &[]);
    assert_eq!(end.figures.len(), 3);
    // Its arm cannot be led down: that is left to somebody who holds it.
    let ended = end.ended.expect("it deployed something");
    assert!(!ended.is_clean(), "{ended:?}");
}
