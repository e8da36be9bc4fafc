//! How long what a transaction does may take: each part as long as its configuration gives itself, on the way back as long as it takes.

use super::Transaction;
use crate::stack::Planned;
use crate::time::Time;
use smallvec::SmallVec;
use std::time::Duration;

/// How long what a part does may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limit {
    /// No step of it begins later.
    pub until: Time,
    /// What that time is, from its beginning, for words.
    pub timeout: Duration,
    /// How long one step may take.
    pub patience: Duration,
}

impl Limit {
    /// As long as it takes; one step so long.
    pub fn patient(patience: Duration) -> Self {
        Self { until: Time::NEVER, timeout: Duration::ZERO, patience }
    }
}

/// How a transaction is carried out.
#[derive(Debug, Clone)]
pub struct Spec {
    /// How long each of its parts may take; that of the last one holds for those after it.
    pub limits: SmallVec<[Limit; 1]>,
    /// Every step is tried, past failures, and none is taken back: a safe configuration.
    pub best_effort: bool,
    /// Somebody asked for what a way back would do: it may move.
    pub asked_back: bool,
}

impl Spec {
    /// How long what this part does may take.
    pub fn limit(&self, part: usize) -> Limit {
        *self.limits.get(part).or(self.limits.last()).expect("one at least")
    }

    /// The limit of all of so many steps, or of each that of its part.
    pub(super) fn limits_of(&self, planned: &Planned, steps: usize) -> SmallVec<[Limit; 1]> {
        match self.limits[..] {
            [limit] => SmallVec::from_iter([limit]),
            _ => (0..steps).map(|step| self.limit(planned.part_of(planned.place(step)))).collect(),
        }
    }
}

impl Transaction {
    /// How long a step of the list in hand may take.
    pub fn limit_of(&self, number: u32) -> Limit {
        let limit = self.spec.limit(if self.spec.limits.len() == 1 { 0 } else { self.part_of_step(number) });
        // What takes something back takes its time.
        if self.back.is_some() { Limit::patient(limit.patience) } else { limit }
    }

    /// Until when a step may take that begins now.
    pub fn deadline(&self, number: u32, now: Time) -> Time {
        let limit = self.limit_of(number);
        (now + limit.patience).min(limit.until)
    }
}
