//! Whether what was applied stands: a configuration that says what it stands for counts as applied once that is true.

use super::messages::{Can, Poll, Question};
use super::{OpenQuestion, Transaction, TransactionPhase};
use crate::model::{ComponentName, Step, Transition};
use crate::system::System;

impl Transaction {
    /// Whether it stops or destroys one of these components, as it was planned.
    pub fn stops_any(&self, components: &[ComponentName]) -> bool {
        let stops = |step: &Step| match step {
            Step::State { transition, .. } => matches!(transition, Transition::Stop | Transition::Cleanup),
            Step::Destroy { .. } => true,
            _ => false,
        };
        let forward = &self.forward.list;
        !components.is_empty()
            && forward.iter().any(|planned| stops(&planned.step) && components.contains(&planned.step.component()))
    }

    /// Goes on where all was done. None: nothing is to be waited for.
    pub(super) fn stand(&mut self, live: &mut System, can: &Can<'_>) -> Option<Poll> {
        if self.stopped_by.is_some() {
            self.asked.clear();
            self.phase = TransactionPhase::Stopping;
            return None;
        }
        // A best effort of which a step failed is not what was asked for anyway.
        let whole = self.forward.failures.is_empty() && self.forward.unsettled.is_empty();
        let parts = (0..self.planned.parts.len()).filter(|part| whole && self.planned.parts[*part].holds);
        let told = |part: usize| self.asked.iter().find(|asked| asked.question == Question::Stands { part });
        let (mut open, mut waits) = (None, false);
        for part in parts {
            match told(part) {
                None => open = open.or(Some(part)),
                Some(OpenQuestion { told: None, .. }) => waits = true,
                Some(OpenQuestion { told: Some(is), .. }) if *is != Some(true) => {
                    self.fallen = Some(part);
                    break;
                }
                Some(_) => {}
            }
        }
        match (self.fallen, open) {
            (Some(_), _) if !self.spec.best_effort => self.phase = TransactionPhase::Stopping,
            (None, Some(part)) => {
                let question = Question::Stands { part };
                self.asked.push(OpenQuestion { question, told: None });
                return Some(Poll::Ask(question));
            }
            (None, None) if waits => return Some(Poll::Wait),
            _ => self.end_forward(live, can),
        }
        self.asked.clear();
        None
    }
}
