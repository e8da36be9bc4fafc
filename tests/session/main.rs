//! A deployment alive: control socket, bring-up, shutdown, faults on the way.

mod along;
mod beside;
mod bringup;
mod classes;
mod defects;
mod doors;
mod failed_held;
mod flood;
mod given_on;
mod hangs;
mod life;
#[path = "../support/names.rs"]
mod names;
mod platforms;
mod replaced;
mod settled;
mod socket;
mod stands;
mod stopping;
mod tap;
mod unanswered;
