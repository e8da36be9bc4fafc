//! The embedded component runtime (semantics: *Platforms*): components as Rust types in this process.
//!
//! For those who write components: [`Component`], [`Builder`], the ports [`In`], [`Out`], [`EventOut`], [`Prop`],
//! [`Context`], [`OperationAnswer`]; [`record!`](crate::record) for structs that travel through ports; [`Library`] to give types to
//! a program. For those who run them: the platform adapter `platform::embedded`.
//!
//! What is absent: a running component shares no lock with the configurator; a component knows no other component, no
//! configuration and no coordinator; nothing reads a clock but the one it was given.

pub mod activity;
pub mod beat;
pub mod builder;
pub(crate) mod call;
pub(crate) mod cell;
pub mod component;
pub(crate) mod gate;
pub(crate) mod guard;
pub mod latest;
pub mod library;
pub mod links;
pub mod port;
pub mod probe;
pub mod property;
mod realtime;
pub mod sight;
mod sync;
#[cfg(test)]
mod tests;
pub mod value;
mod words;

pub use crate::model::ActivityStatus;
pub use beat::{Notice, NoticeSink, Notices};
pub use builder::Builder;
pub use component::{Arguments, Component, Context, Failure, HookResult, OperationAnswer, Returned, Ticket};
pub use library::{ComponentFactory, Libraries, Library};
pub use port::{EventIn, EventOut, In, Out, Sample};
pub use probe::{Observed, ProbeReading, Probes};
pub use property::Prop;
pub use sight::Sight;
pub use value::{PortValue, record};
