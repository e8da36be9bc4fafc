//! Coordinators with functions: rFSM models whose guards, effects, entries, exits, activities and predicates are Lua.
//!
//! [`read`] runs a model's text and answers its chart as plain data. [`Opener::open`] runs the same text again on the
//! thread that is to call the functions and answers [`Functions`], the hook with which the engine of
//! [`crate::statechart`] calls them. Both go the same way, so functions have the same numbers; whether the chart came out
//! the same is looked at.
//!
//! What is absent: stepping (the engine's), places in texts (`lang` makes them of lines), threads, and files: all texts
//! are given, so that what was checked is what runs.

mod aside;
mod bound;
mod budget;
mod calls;
mod count;
mod errors;
mod exact;
mod guards;
mod host;
#[cfg(any(test, feature = "internals"))]
mod lab;
mod lower;
mod merge;
mod native;
mod open;
mod patterns;
mod tables;
mod tracing;
mod unset;
mod values;
mod voice;
#[cfg(target_os = "linux")]
mod watch;
mod work;
mod world;

pub use aside::Field;
pub use budget::Budget;
pub use count::{INTERRUPTED, processor_time};
pub use errors::{Short, message_within, place_of, text_of};
pub use guards::{Guards, install as guard, loops};
pub use host::without_hash_bang;
#[cfg(any(test, feature = "internals"))]
pub use lab::Lab;
pub use lower::{Problem, Spot};
pub use open::{Functions, HostFunction, NotOpened, Opener, Reads, read};
pub use values::{of_value, to_lua, to_value};
