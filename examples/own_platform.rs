//! A program of one's own with a platform of one's own: all of `davit`, and a platform beside the built-in ones.
//!
//! ```sh
//! cargo run --example own_platform -- check examples/own_platform/deployment.yaml
//! cargo run --example own_platform -- run examples/own_platform/story.lua --clock simulated
//! ```
//!
//! The platform `bus` sends every step as a line of text to what stands at the other end of a device, which is a file or the terminal
//! here. A real one would wait for an answer until the deadline, and answer *unknown* when none comes. That it keeps the rules of
//! the trait is a test of a few lines: `docs/platforms.md`.

#[path = "own_platform/bus.rs"]
mod bus;

use bus::Bus;
use davit::platforms::{Making, Platform, PlatformKind, PlatformMaker, Simulated, SimulatedOptions};
use davit::{Extensions, Value, ValueType};
use std::fs::OpenOptions;
use std::io::Write;
use std::sync::Arc;

fn open(making: &Making<'_>) -> Result<Arc<dyn Platform>, String> {
    let text = |option: &str| match making.options.iter().find(|(name, _)| name.as_str() == option) {
        Some((_, Value::Str(text))) => text.to_string(),
        _ => String::new(),
    };
    let device: Box<dyn Write + Send> = match text("device").as_str() {
        "-" => Box::new(std::io::stdout()),
        path => Box::new(OpenOptions::new().append(true).open(path).map_err(|why| format!("{path}: {why}"))?),
    };
    let books = Simulated::new(making.checked.catalogue.clone(), making.clock.clone(), SimulatedOptions::default());
    Ok(Arc::new(Bus::new(device, text("prefix"), books)))
}

fn main() -> std::process::ExitCode {
    let bus = PlatformMaker::new("bus", PlatformKind::ELSEWHERE, open)
        .option("device", ValueType::Str, None, "where lines are sent: a file, or `-` for the terminal")
        .option("prefix", ValueType::Str, Some(Value::Str("".into())), "what stands before every line");
    davit::main(Extensions::from(davit::builtin()).with_platform(bus))
}
