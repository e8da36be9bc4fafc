//! `examples/stability.lua`, of which `davit sweep` makes the chart of `docs/youbot.md`: points of it on both sides of the border.

use davit::app::script::{self, Interrupt, ScriptOptions};
use davit::lang::LoadOptions;
use davit::libraries;
use davit::time::Clock;
use std::path::Path;

/// 2: it dies out; 1: it rings on; 0: it grows.
fn stable(stiffness: &str, delay: &str, law: &str) -> f64 {
    let mut load = LoadOptions::default();
    let set = [("K", stiffness), ("delay", delay), ("law", law)];
    load.set.extend(set.map(|(name, value)| (name.to_owned(), value.to_owned())));
    let clock = Clock::simulated();
    let end = script::run(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/stability.lua"),
        ScriptOptions {
            clock: clock.clone(),
            extensions: libraries::builtin().into(),
            load,
            platform: None,
            observer: None,
            interrupt: Interrupt::default(),
            door: None,
            checking: None,
            say: Box::new(|_| {}),
        },
    );
    clock.shutdown();
    assert!(end.failure.is_none(), "{:?}", end.failure);
    end.figures.iter().find(|figure| figure.name == "stable").expect("it says so").value
}

#[test]
#[allow(clippy::float_cmp)] // they are counts
fn points_of_the_chart() {
    for (stiffness, delay, law, expected) in [
        ("300", "0.01", "position", 2.0),
        ("300", "0.03", "position", 0.0),
        ("300", "0.03", "tank", 2.0),
        ("150", "0.03", "position", 1.0),
    ] {
        assert_eq!(stable(stiffness, delay, law), expected, "{stiffness} N/m, {delay} s, {law}");
    }
}
