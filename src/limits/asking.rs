//! Bounds of a command that asks a running deployment.

use std::time::Duration;

/// What a command waits beyond its `--within` for what the deployment says at the end of that: its way, also on a machine that is
/// busy.
pub const ANSWER_WAY: Duration = Duration::from_secs(1);

/// How often `davit shutdown` tells what it waits for.
pub const SHUTDOWN_TOLD: Duration = Duration::from_secs(1);
