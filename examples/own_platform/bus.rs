//! The platform `bus`: steps go as lines of text to what stands at the other end of a device, and what may go together goes in
//! one line.

use davit::platforms::{
    Catalogue, Cause, ComponentSnapshot, EventSink, Execution, ObserveError, Outcome, Platform, Simulated, StepBatch,
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

    /// One message. What was not sent was not done.
    fn send(&self, steps: &[&Step]) -> Result<(), Outcome> {
        let words: Vec<String> = steps.iter().map(ToString::to_string).collect();
        let mut device = self.device.lock().unwrap_or_else(PoisonError::into_inner);
        let sent = writeln!(device, "{}{}", self.prefix, words.join("; "));
        sent.map_err(|why| Outcome::NotDone(Cause::Refused(format!("the bus: {why}"))))
    }

    /// The answer to a step that was sent. A real one waits for it here, until the deadline.
    fn answer(&self, step: &Step, deadline: Time, safe: bool) -> Outcome {
        match safe {
            true => self.books.execute_safe(step, deadline),
            false => Platform::execute(&self.books, step, deadline),
        }
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

    /// A message costs more than a step.
    fn batches(&self, _: &Step) -> bool {
        true
    }

    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        self.send(&[step]).map_or_else(|refused| refused, |()| self.answer(step, deadline, false))
    }

    fn execute_safe(&self, step: &Step, deadline: Time) -> Outcome {
        self.send(&[step]).map_or_else(|refused| refused, |()| self.answer(step, deadline, true))
    }

    /// All that may begin goes in one message; the other end does one after the other and answers each as it ends, and begins
    /// none behind one that is not done.
    fn execute_batch(&self, batch: &StepBatch) {
        let begun = batch.begin(usize::MAX);
        let steps: Vec<&Step> = begun.iter().map(|timed| &timed.step).collect();
        if steps.is_empty() {
            return;
        }
        if let Err(refused) = self.send(&steps) {
            return batch.answer(refused);
        }
        for (i, step) in steps.into_iter().enumerate() {
            if i > 0 && batch.is_stopped() {
                return;
            }
            let outcome = self.answer(step, batch.deadline(), batch.is_safe());
            let done = matches!(outcome, Outcome::Done(_));
            batch.answer(outcome);
            if !done {
                return;
            }
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
