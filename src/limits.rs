//! Every bound of the system, with its unit and its reason.

use std::time::Duration;

/// Frames on a stack before the oldest are squashed into one. Enough for every switch of a session to be undone singly,
/// small enough that selective undo, which looks at the frames above, stays instant.
pub const STACK: usize = 64;

/// How long one step may take where the deployment does not say: longer than any software-only change, short enough that
/// an operator does not think the program hangs.
pub const STEP_TIMEOUT: Duration = Duration::from_secs(1);
