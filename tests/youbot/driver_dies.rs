//! A driver that has died: nobody knows what the drives do, and nothing goes on as if they did what they did last.

use davit::app::script::{self, Interrupt, ScriptOptions};
use davit::lang::LoadOptions;
use davit::libraries;
use davit::time::Clock;
use std::path::Path;

#[test]
fn it_is_noticed_and_nothing_couples() {
    let clock = Clock::simulated();
    let end = script::run(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/youbot/driver_dies.lua"),
        ScriptOptions {
            clock: clock.clone(),
            extensions: libraries::builtin().into(),
            load: LoadOptions::default(),
            platform: None,
            observer: None,
            interrupt: Interrupt::default(),
            door: None,
            say: Box::new(|_| {}),
        },
    );
    clock.shutdown();
    assert!(end.failure.is_none(), "{:?}\n{:#?}", end.failure, end.figures);
    assert_eq!(end.figures.len(), 3);
    // Its arm cannot be led down: that is left to somebody who holds it.
    let ended = end.ended.expect("it deployed something");
    assert!(!ended.is_clean(), "{ended:?}");
}
