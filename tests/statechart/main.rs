//! Statecharts: rFSM's behaviour, test by test, and a second, plain interpreter beside the engine.

mod coordinator;
mod rfsm;
mod support;
