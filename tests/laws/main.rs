//! The laws of plans, inverses and stacks, each as a property over generated component types, systems and sequences of
//! configurations.
//!
//! Every law runs over `DAVIT_LAW_CASES` cases, 10,000 where it is not set; `DAVIT_LAW_CASES=1000000 cargo test --release
//! --test laws` is a long run. Each run tries other cases; with `PROPTEST_RNG_SEED` set, as `.ci/run` does, always the same.

mod alone;
mod atomicity;
mod difference;
mod endings;
mod generate;
mod machine;
mod motion;
#[path = "../support/names.rs"]
mod names;
mod piles;
mod plain;
mod plans;
mod prepared;
mod repair;
mod stacks;

/// How many cases each law is tried on.
pub fn cases() -> u32 {
    std::env::var("DAVIT_LAW_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000)
}

/// The settings of every law.
pub fn settings() -> proptest::test_runner::Config {
    proptest::test_runner::Config {
        cases: cases(),
        max_shrink_iters: 4096,
        failure_persistence: None,
        ..proptest::test_runner::Config::default()
    }
}
