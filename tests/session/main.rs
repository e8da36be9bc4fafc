//! A deployment alive: control socket, bring-up, shutdown, faults on the way.

mod beside;
mod bringup;
mod classes;
mod doors;
mod flood;
mod hangs;
mod life;
mod settled;
mod socket;
mod stands;
mod stopping;
mod tap;
