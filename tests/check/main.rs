//! What `check` follows and what it says of it: whole deployments in, the report out.

#[path = "../cli/demo.rs"]
#[allow(dead_code)]
mod demo;

#[path = "../support/flat.rs"]
mod flat;

mod advice;
mod alike;
mod apart;
mod apart_random;
mod aside;
mod asked;
mod automata;
mod beside;
mod circles;
mod composed;
mod deeper;
mod demands;
mod exchanged;
mod exclusive;
mod flat_coupling;
mod flat_plans;
mod follow;
mod inside;
mod listeners;
mod never_entered;
mod overtaken;
mod pointed;
mod product;
mod promised;
mod replayed;
mod shown;
mod stopping;
mod support;
mod sure;
mod told_once;
mod undriven;
mod verdicts;
