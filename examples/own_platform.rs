//! A program of one's own with a platform of one's own: all of `davit`, and a platform beside the built-in ones.
//!
//! ```sh
//! cargo run --example own_platform -- check examples/own_platform/deployment.yaml
//! cargo run --example own_platform -- run examples/own_platform/story.lua --clock simulated
//! ```
//!
//! The platform `bus` sends every step as a line of text to what stands at the other end of a device, which is a file or the terminal
//! here. A real one would wait for an answer until the deadline, and answer *unknown* when none comes.

use davit::platforms::{
    Catalogue, Cause, ComponentSnapshot, EventSink, Execution, Making, ObserveError, Outcome, Platform, PlatformKind,
    PlatformMaker, Simulated, SimulatedOptions,
};
use davit::{ComponentName, Extensions, Snapshot, Step, Time, Value, ValueType};
use std::fs::OpenOptions;
use std::io::Write;
use std::sync::{Arc, Mutex, PoisonError};

/// What is sent, and the books of what is at the other end.
struct Bus {
    device: Mutex<Box<dyn Write + Send>>,
    prefix: String,
    books: Simulated,
}

impl Bus {
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
        Ok(Arc::new(Self { device: Mutex::new(device), prefix: text("prefix"), books }))
    }
}

impl Platform for Bus {
    fn catalogue(&self) -> &Catalogue {
        self.books.catalogue()
    }

    /// A line may take long: every step is carried out by a worker, under a deadline.
    fn execution(&self, _: &Step) -> Execution {
        Execution::Blocking
    }

    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        let sent = {
            let mut device = self.device.lock().unwrap_or_else(PoisonError::into_inner);
            writeln!(device, "{}{step}", self.prefix)
        };
        match sent {
            Ok(()) => self.books.execute(step, deadline),
            // What was not sent was not done.
            Err(why) => Outcome::NotDone(Cause::Refused(format!("the bus: {why}"))),
        }
    }

    fn cancel(&self, step: &Step) {
        self.books.cancel(step);
    }

    fn observe(&self, deadline: Time) -> Result<Snapshot, ObserveError> {
        self.books.observe(deadline)
    }

    fn observe_component(
        &self,
        component: ComponentName,
        deadline: Time,
    ) -> Result<Option<ComponentSnapshot>, ObserveError> {
        self.books.observe_component(component, deadline)
    }

    fn subscribe(&self, sink: EventSink) {
        self.books.subscribe(sink);
    }

    fn quarantined(&self) -> Vec<ComponentName> {
        self.books.quarantined()
    }
}

fn main() -> std::process::ExitCode {
    let bus = PlatformMaker::new("bus", PlatformKind::ELSEWHERE, Bus::open)
        .option("device", ValueType::Str, None, "where lines are sent: a file, or `-` for the terminal")
        .option("prefix", ValueType::Str, Some(Value::Str("".into())), "what stands before every line");
    davit::main(Extensions::from(davit::builtin()).with_platform(bus))
}
