//! The configurator against docs/semantics.md, on the simulated platform and in simulated time.

mod atomicity;
mod batches;
mod claims;
mod kept_calls;
#[path = "../support/names.rs"]
mod names;
mod observing;
mod prepared;
mod repair;
mod rig;
mod safe;
mod safe_ends;
mod safe_out;
mod step_batches;
mod stuck;
mod survival;
mod table;
mod teardown;
mod times;
mod way_out;
