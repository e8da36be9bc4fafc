//! Bounds of what is kept of a deployment on disk, and of looking at running ones.

use std::time::Duration;

/// Bytes of one log file before it becomes the older one and a new one begins; there are two of them. Days of ordinary
/// operation, and read at once when somebody asks.
pub const KEPT_BYTES: u64 = 4 * 1024 * 1024;

/// Bytes of what a deployment says about its own life: two lines, of which the second lists what is left of it.
pub const LIFE_BYTES: u64 = 4 * 1024 * 1024;

/// How often a running deployment says on disk that it lives: how exactly it is known when one died without a word. The time of
/// a file is all that is written.
pub const KEPT_BEAT: Duration = Duration::from_secs(1);

/// How long a deployment tries to take the lock of what is kept of it: whoever looks whether it lives holds it for a moment.
pub const KEPT_LOCK: Duration = Duration::from_millis(500);

/// Bytes of one line that a component prints; what is longer is broken.
pub const PRINTED_LENGTH: usize = 4096;

/// Printed lines that are kept in one second: a component that prints in every turn of a fast loop costs its log, and
/// nobody else anything. More are counted.
pub const PRINTED_LINES: u32 = 1000;

/// How long the end of a deployment in the background waits until what was printed is read.
pub const PRINTED_END: Duration = Duration::from_secs(1);

/// Numbers in one value of a port that are looked at when somebody asks for it: each costs a probe for a moment.
pub const GET_PARTS: usize = 256;
