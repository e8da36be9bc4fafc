//! What is known of safe configurations beside their transactions.

use super::request::{Reason, Request};
use crate::model::RequestId;
use crate::transaction::Touched;
use std::collections::VecDeque;

/// Safe configurations that were asked for, and what those under way and over leave for others to heed.
#[derive(Default)]
pub(super) struct Safety {
    /// Requests that have come and were not begun.
    pub waiting: VecDeque<Request>,
    /// What those under way could not plan.
    pub troubles: Vec<(RequestId, Vec<Reason>)>,
    /// What those that have ended touched, and what was interrupted was not told yet.
    pub touched: Touched,
}

impl Safety {
    /// What one that is over could not plan.
    pub fn troubles_of(&mut self, request: RequestId) -> Vec<Reason> {
        let at = self.troubles.iter().position(|(id, _)| *id == request);
        at.map(|at| self.troubles.remove(at).1).unwrap_or_default()
    }
}
