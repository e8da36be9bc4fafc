//! One deployment alive: monitors and operators → coordinator → configurator → status, through bounded queues.
//!
//! The coordinator and the configurator know nothing of each other; here names raised by the one become requests to the
//! other, and its answers become events. The thread that calls [`Session::bring_up`], [`Session::serve`] and
//! [`Session::take_down`] drives the deployment's life; everybody else only leaves requests and commands.

mod bring_up;
pub mod carried;
pub mod client;
mod connection;
mod consequences;
mod doors;
mod halt;
mod held;
mod hierarchy;
pub mod hub;
pub mod kept;
mod lanes;
mod life;
pub mod log;
pub mod look;
pub mod members;
mod names;
pub mod owner;
mod parts;
pub mod place;
mod raising;
pub mod recording;
mod recovery;
mod room;
mod routes;
pub mod rpc;
pub mod service;
pub mod serving;
pub mod socket;
mod stages;
mod stands;
mod steps;
mod stopping;
mod subscribers;
mod subsystems;
pub mod tap;
mod wiring;
mod writing;

pub use halt::{StandsStill, StoppingView};
pub use hub::{Hub, Observer};
pub use life::{Ended, NotUp};
pub use log::{Happening, Phase, StatusView};
pub use names::{NotFromOutside, NotNamed};
pub use raising::NotRaised;
pub use recovery::{Difference, NO_FORWARD, Recovered, recovery};
pub use stages::Stage;
pub use wiring::{Session, SessionSetup, Unanswered};

/// What may be asked of whoever drives a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// Take it down, without the coordinator if `force`.
    Shutdown {
        /// Without the coordinator.
        force: bool,
    },
}
