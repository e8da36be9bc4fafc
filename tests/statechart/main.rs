//! Statecharts: rFSM's behaviour, test by test, and a second, plain interpreter beside the engine.

mod confirmed;
mod coordinator;
mod naive;
#[path = "../support/names.rs"]
mod names;
mod random;
mod rfsm;
mod rich;
mod scripted;
mod scxml;
mod support;
