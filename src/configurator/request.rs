//! What is asked of a configurator and what it answers: the words of the stack, at the configurator's door.

pub use crate::stack::{Answer, Batch, Reason, Request, Residual};

/// The queue of requests is full; each request of the batch was answered *failed*.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the configurator's queue is full")]
pub struct QueueFull;
