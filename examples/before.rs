//! The traditional way beside Davit's: a rich coordinator, whose entry functions call components and wait, on the same robot.
//!
//! ```sh
//! cargo run --example before -- run examples/before/story.lua --clock simulated
//! ```
//!
//! The platform `open` is the built-in one with three functions for a coordinator with functions (`examples/before/coordinator.lua`): `call`,
//! `set` and `write`. Each is one blocking call of the platform, behind the configurator's back. This is here to be compared with;
//! `davit` has nothing of the kind.

#[path = "before/open.rs"]
mod open;

use davit::Extensions;

fn main() -> std::process::ExitCode {
    davit::main(Extensions::from(davit::builtin()).with_platform(open::platform()))
}
