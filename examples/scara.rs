//! Another robot under the youBot's coordinator: a SCARA on a rail, with a library of components of its own.
//!
//! ```sh
//! cargo run --example scara -- check examples/scara/deployment.yaml
//! cargo run --example scara -- run examples/scara/story.lua --clock simulated
//! ```
//!
//! The coordinator is `configs/youbot/coordinator.lua`, unchanged: what it asks for is said for this robot in
//! `examples/scara/configurations.lua`. Arm and rail have dynamics (`model.rs`); all numbers are this example's own.

#[path = "scara/library.rs"]
mod library;

fn main() -> std::process::ExitCode {
    davit::main(davit::builtin().with(library::library()))
}
