//! Every bound of the system, with its unit and its reason.

use std::time::Duration;

/// Frames on a stack before the oldest are squashed into one. Enough for every switch of a session to be undone singly,
/// small enough that selective undo, which looks at the frames above, stays instant.
pub const STACK: usize = 64;

/// How long one step may take where the deployment does not say: longer than any software-only change, short enough that
/// an operator does not think the program hangs.
pub const STEP_TIMEOUT: Duration = Duration::from_secs(1);

/// Connections a control socket serves at once: a coordinator, a few terminals and displays; each costs a thread.
pub const SOCKET_CONNECTIONS: usize = 32;

/// Bytes of one line on the control socket: far more than any request, little enough to buffer for every connection.
pub const SOCKET_LINE: usize = 1 << 20;

/// Notifications that may wait for a slow subscriber before it is cut off.
pub const SOCKET_QUEUE: usize = 1024;

/// How long a client may take to accept what is written to it.
pub const SOCKET_WRITE: Duration = Duration::from_secs(5);

/// Entries of the log kept in memory: an hour of busy switching, a few megabytes.
pub const LOG_ENTRIES: usize = 4096;
/// Events that may wait inside a statechart for its next step. A pure chart never has more than one completion and one
/// time event per active state; the rest is for functions that send events, and for sets given to `davit sim`.
pub const CHART_QUEUE: usize = 1024;

/// Turns a statechart may take to come to rest. More than any chart needs that comes to rest at all; rFSM would never
/// return from one that does not.
pub const CHART_RUN: u64 = 10_000;

/// Levels of states in a statechart. People write five; the walk through a chart is recursive.
pub const CHART_DEPTH: usize = 100;

/// Connectors one after the other on a path. People write three; the search is recursive.
pub const CONNECTOR_CHAIN: usize = 200;

/// Answers and operators' events that may wait for a coordinator. Requests are answered once each, and a person types.
pub const INBOX_CONTROL: usize = 1024;

/// Events of monitors and components that may wait for a coordinator: some milliseconds of reacting. What waits longer is
/// no news any more.
pub const INBOX_REPORT: usize = 4096;
