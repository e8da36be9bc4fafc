//! The traditional way beside Davit's (`examples/before`): what a rich coordinator does not hear, and Davit's does.

#[path = "../../examples/before/open.rs"]
mod open;

use davit::app::Extensions;
use davit::app::script::{self, Interrupt, ScriptOptions};
use davit::lang::LoadOptions;
use davit::libraries;
use davit::time::Clock;
use std::path::Path;

#[test]
fn side_by_side() {
    let clock = Clock::simulated();
    let end = script::run(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/before/story.lua"),
        ScriptOptions {
            clock: clock.clone(),
            extensions: Extensions::from(libraries::builtin()).with_platform(open::platform()),
            load: LoadOptions::default(),
            platform: None,
            observer: None,
            interrupt: Interrupt::default(),
            door: None,
            checking: None,
            say: Box::new(|_| {}),
        },
    );
    clock.shutdown();
    assert!(end.failure.is_none(), "{:?}\n{:#?}", end.failure, end.figures);
    assert_eq!(end.figures.len(), 2 * (3 + 5 + 5 + 5));
    let ended = end.ended.expect("it deployed something");
    assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
}
