//! Davit brings component-based robot systems up, switches them while they run, undoes what it did, and takes them down
//! again.

pub mod check;
pub mod cli;
pub mod configurator;
pub mod coordinator;
pub mod diagnostics;
pub mod draw;
pub mod functions;
pub mod lang;
pub mod libraries;
pub mod limits;
pub mod model;
pub mod monitor;

pub mod platform;
pub mod runtime;
pub mod session;
pub mod statechart;

pub mod app;
pub mod plan;
pub mod stack;
pub mod system;
pub mod time;

/// Only in a scratch build.
pub fn mutant(n: u32) -> bool {
    static CHOSEN: std::sync::OnceLock<Option<u32>> = std::sync::OnceLock::new();
    *CHOSEN.get_or_init(|| std::env::var("DAVIT_MUTANT").ok().and_then(|t| t.parse().ok())) == Some(n)
}
