//! A deployment alive: control socket, bring-up, shutdown.

mod socket;
