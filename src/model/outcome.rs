//! How a step ended, and how it is carried out: what a platform answers and a transaction draws its conclusions from.

use super::value::Value;

/// How a step ended, as far as the platform knows.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// It happened. An operation's result, if it has one.
    Done(Option<Value>),
    /// It did not happen, and the component is as it was.
    NotDone(Cause),
    /// No answer in time, or the connection was lost: it may have happened, may yet happen, or not.
    Unknown(Cause),
}

/// Why a step was not done, or is not known to be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Cause {
    /// The platform's precondition is false (no such component, wrong run state, …).
    #[error("refused by the platform: {0}")]
    Refused(String),
    /// The component's own code answered with an error.
    #[error("the component failed: {0}")]
    Failed(String),
    /// The component's own code panicked; it is faulted.
    #[error("the component panicked: {0}")]
    Panicked(String),
    /// No answer before the deadline.
    #[error("no answer in time")]
    Timeout,
    /// The connection to the component was lost.
    #[error("the connection was lost: {0}")]
    Lost(String),
    /// It was given up before it had begun.
    #[error("given up before it began")]
    Cancelled,
    /// The component is in quarantine: an earlier call never returned.
    #[error("in quarantine: an earlier call has not returned")]
    Quarantined,
}

/// How a primitive is carried out on a platform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Execution {
    /// Wait-free and bounded: may run in the configurator's own thread.
    Immediate,
    /// May take until its deadline: runs on a worker, alone or in one call with others (`Platform::execute_batch`).
    Blocking,
}
