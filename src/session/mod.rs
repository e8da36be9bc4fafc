//! One deployment alive.

pub mod client;
pub mod place;
pub mod rpc;
pub mod socket;
