//! Davit brings component-based robot systems up, switches them while they run, undoes what it did, and takes them down
//! again.

pub mod check;
pub mod cli;
pub mod configurator;
pub mod coordinator;
pub mod diagnostics;
pub mod draw;
pub mod functions;
pub mod lang;
pub mod libraries;
pub mod limits;
pub mod model;
pub mod monitor;

pub mod platform;
pub mod runtime;
pub mod session;
pub mod statechart;

pub mod app;
pub mod plan;
pub mod stack;
pub mod system;
pub mod time;
pub mod transaction;
