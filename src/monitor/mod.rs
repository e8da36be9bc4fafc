//! Conditions over time: samples and now in, events out. Pure: it reads no clock and starts no thread.
//!
//! The semantics are those of past-time signal temporal logic over dense time, with both its readings: true or false, and
//! how far from the other (space robustness). `docs/monitors.md` states them; this is how they are computed.
//!
//! **Positions.** Every change happens at a whole nanosecond, or just after one (`age > 0.1` becomes true after, not at,
//! the instant). So everything is constant at each whole nanosecond and between two of them, and both are numbered
//! together: position `2 n` is the instant of `n` nanoseconds, `2 n + 1` what lies between it and the next. An interval
//! of time is then a range of positions, ends and all, and nothing is approximated.
//!
//! **Cost.** An operator over time keeps, of the pieces in its window, those that may still become its extreme: each piece
//! enters once and leaves once, so a sample costs the same whatever the length of the window.
//!
//! * [`Bank`]: all monitors of a deployment. * `watched`: one of them. * `program`: its condition, compiled. * `window`: `once` and `since`.
//! * `pieces`: sliding extremes. * `grade`: truth and robustness, together.
//! * [`table`]: recorded samples as text. [`replay`]: monitors over them.

mod bank;
mod compile;
mod grade;
mod nodes;
mod pieces;
mod program;
pub mod replay;
mod ring;
mod sample;
pub mod table;
mod watched;
mod window;

pub use bank::{Bank, Troubles};
pub use grade::Grade;
pub use sample::{InputSample, MonitorInput, state_value};
