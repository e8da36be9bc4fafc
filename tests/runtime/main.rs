//! The embedded runtime: what components, activities and the platform around them promise. All in simulated time but where
//! threads are meant to race.

mod activities;
mod calls;
mod cancelling;
mod conformance;
mod flow;
mod gripper;
mod injecting;
mod monitors;
#[path = "../support/names.rs"]
mod names;
mod standard;
mod support;
