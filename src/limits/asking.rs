//! Bounds of a command that asks a running deployment.

use std::time::Duration;

/// What a command waits beyond its `--within` for what the deployment says at the end of that: its way, also on a machine that is
/// busy.
pub const ANSWER_WAY: Duration = Duration::from_secs(1);

/// How often `davit shutdown` tells what it waits for.
pub const SHUTDOWN_TOLD: Duration = Duration::from_secs(1);

/// The longest `within_s` of what reads (`get`, `look`, `drift`), in seconds: it keeps its place among the connections until then, also
/// when who asked is gone.
pub const READ_WITHIN: f64 = 60.0;

/// The same of `recover`, in seconds.
pub const RECOVER_WITHIN: f64 = 600.0;
