//! Runs a statechart: events in, names out (semantics: *Coordinators*).
//!
//! A [`CoordinatorHandle`] is a thread of its own that takes events from its inbox, one at a time, and lets the chart react to
//! each until it comes to rest; the names that a step raises go to a [`Listener`] as one batch. [`Core`] is the same
//! without a thread, driven by calls.
//!
//! What is absent: components, configurations, a configurator, requests and their answers as such (an answer is an event
//! like any other, with a tag that says for whom it is). A coordinator performs nothing and waits for nothing but its
//! inbox and its time events; so nothing that hangs anywhere can delay its reaction.

mod core;
mod inbox;
mod thread;

pub use self::core::{ChartTrouble, Core, Delivered, Listener, Tag};
pub use inbox::{Class, Dropped, Incoming, NotAccepted, Put};
pub use thread::CoordinatorHandle;
