//! Bounds of a grid of runs.

/// Points of one sweep: hours of runs, and a table that nobody reads by eye any more.
pub const SWEEP_POINTS: usize = 10_000;

/// Runs of a sweep at the same time at most: each is a process.
pub const SWEEP_JOBS: u64 = 256;
