//! The platform `bus`: every step goes as a line of text to what stands at the other end of a device.

use davit::platforms::{
    Catalogue, Cause, ComponentSnapshot, EventSink, Execution, ObserveError, Outcome, Platform, Simulated,
};
use davit::{ComponentName, Snapshot, Step, Time};
use std::io::Write;
use std::sync::{Mutex, PoisonError};

/// What is sent, and the books of what is at the other end.
pub struct Bus {
    device: Mutex<Box<dyn Write + Send>>,
    prefix: String,
    books: Simulated,
}

impl Bus {
    pub fn new(device: Box<dyn Write + Send>, prefix: String, books: Simulated) -> Self {
        Self { device: Mutex::new(device), prefix, books }
    }

    /// What was not sent was not done.
    fn send(&self, step: &Step) -> Result<(), Outcome> {
        let mut device = self.device.lock().unwrap_or_else(PoisonError::into_inner);
        let sent = writeln!(device, "{}{step}", self.prefix);
        sent.map_err(|why| Outcome::NotDone(Cause::Refused(format!("the bus: {why}"))))
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
        self.send(step).map_or_else(|refused| refused, |()| Platform::execute(&self.books, step, deadline))
    }

    fn execute_safe(&self, step: &Step, deadline: Time) -> Outcome {
        self.send(step).map_or_else(|refused| refused, |()| self.books.execute_safe(step, deadline))
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
