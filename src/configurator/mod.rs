//! Transactions over a platform: configurations are applied and undone on request, whole or not at all (semantics: *Requests*).
//!
//! Requests come in as events with a number, answers go out as status events; every request gets exactly one. The
//! configurator runs on its own thread and knows no coordinator: who asks is a name. It decides nothing but whether a
//! step worked: what is to be done comes from `plan` and `stack`, what is there from the platform.
//!
//! *What is absent*: no call of the platform without a deadline; no step whose precondition was not checked on the live
//! model immediately before; no outcome *unknown* that is reported as done or not done without having been read back; no
//! request that is dropped.
//!
//! * [`Configurator`], [`ConfiguratorHandle`] (`handle`): starting one, and talking to it. [`request`]: what is asked and
//!   answered. [`control`]: how things stand, taking down. [`progress`]: what is told on the way.
//! * `engine`: the thread. `requests`: batches begin and end. `running`: a transaction under way. `carry`: it and the
//!   platform; `hands`: an immediate step. [`conditions`], `stands`: what only the values of components tell, and what is
//!   watched while it is in force. `safe`, `safety`: what goes first. `fast`, `switches`: plans that are carried out again.
//!   `taking_back`, `teardown`: the second and the third stage of stopping, to nothing; `resting`: what force applies before. `recovery`: the way out of what is broken.
//!   `anew`: after a panic. `suspects`, `reported`: who was reported faulted. `confirmations`: frames that
//!   wait to be confirmed. `observing`, `looks`: the slow look at what nothing is under way with.
//!   `pool`, `inbox`: their tools.

mod anew;
mod carry;
pub mod conditions;
mod confirmations;
pub mod control;
mod defining;
mod down;
mod emergency;
mod engine;
mod fast;
mod handle;
mod hands;
mod inbox;
mod looks;
mod observing;
mod pool;
pub mod progress;
mod recovery;
mod repair;
mod reported;
pub mod request;
mod requests;
mod resting;
mod running;
mod safe;
mod safety;
mod stands;
mod suspects;
mod switches;
mod taking_back;
mod teardown;

pub use crate::stack::answer::WAY_OUT;
pub use crate::stack::{Requester, Scope, Why};
pub use conditions::{Conditions, Truth};
pub use control::{ConfiguratorView, Drift, FrameView, Recovery, TakenDown};
pub use handle::{Configurator, ConfiguratorHandle, ConfiguratorSetup};
pub use progress::{AnswerSink, Progress, ProgressSink, StepEnd, StepName};
pub use request::{Answer, Batch, QueueFull, Reason, Request, Residual};
