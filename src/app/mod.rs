//! The composition root: load, check, build with component libraries, start; scripts. What the command line calls, and
//! what a program that embeds Davit calls.

mod load;
mod planned;
mod platforms;
pub mod script;
mod start;

pub use load::{Checked, Read, Refused, check, check_while, read, read_but_for, read_for};
pub use planned::{Application, drive, plan, plan_way, wrong_in_others};
pub use platforms::{Extensions, Making, PlatformMaker};
pub use start::{StartError, faults, reactions, start, start_on};
