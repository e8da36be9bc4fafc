//! Steps carried out for requests that are not answered yet: they go with the answer into the log.

use super::log::StepTime;
use crate::limits;
use crate::model::RequestId;
use crate::time::lock;
use rustc_hash::FxHashMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// The first [`limits::STEPS_LOGGED`] steps of each request.
#[derive(Debug)]
pub(super) struct Steps {
    of: Mutex<FxHashMap<RequestId, Vec<StepTime>>>,
    /// A request of which no further step is remembered: most steps of a long plan are told for nothing.
    full: AtomicU64,
}

/// No request has that number.
const NONE: u64 = u64::MAX;

impl Default for Steps {
    fn default() -> Self {
        Self { of: Mutex::default(), full: AtomicU64::new(NONE) }
    }
}

impl Steps {
    /// A step of a request has ended.
    pub fn note(&self, request: RequestId, step: impl FnOnce() -> StepTime) {
        if self.full.load(Ordering::Relaxed) == request.0 {
            return;
        }
        let mut of = lock(&self.of);
        let steps = of.entry(request).or_default();
        if steps.len() < limits::STEPS_LOGGED {
            steps.push(step());
        } else {
            self.full.store(request.0, Ordering::Relaxed);
        }
    }

    /// The steps of a request that is answered.
    pub fn take(&self, request: RequestId) -> Vec<StepTime> {
        let mut of = lock(&self.of);
        let _ = self.full.compare_exchange(request.0, NONE, Ordering::Relaxed, Ordering::Relaxed);
        of.remove(&request).unwrap_or_default()
    }
}
