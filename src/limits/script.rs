//! Bounds of what a script looks at, records, injects and says of itself.

use std::time::Duration;

/// How long a script waits for the first value of a port that it asks for: many periods of any activity.
pub const SIGNAL_FIRST: Duration = Duration::from_secs(2);

/// Ports that a script goes on looking at, having asked for their value once: each costs its writer an exchange a write. Past
/// it the one that was asked for longest ago is let go.
pub const SIGNALS_KEPT: usize = 64;

/// Recordings of one script: each is a thread.
pub const RECORDINGS: usize = 64;

/// Signals of one recording: each is a probe.
pub const RECORDED_SIGNALS: usize = 256;

/// Values that all recordings of one script keep together (32 MB). What comes after it still counts in their figures.
pub const RECORDED_VALUES: usize = 4_000_000;

/// Figures of one script: what a person reads in one table, many times over.
pub const FIGURES: usize = 1_000;

/// What happened last that is told with a script's failure: about a screen of it.
pub const SCENE_ENTRIES: usize = 12;

/// Faults that a script has asked for and whose time has not come.
pub const INJECTIONS: usize = 1_000;

/// How long a component may take to come to a fault that is put into it: its code is busy with something else, or hangs.
pub const INJECTION: Duration = Duration::from_secs(1);
