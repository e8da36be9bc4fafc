//! An immediate step, carried out in the configurator's own thread.

use super::pool;
use super::progress::{Progress, ProgressSink, StepEnd, StepName};
use super::running::served;
use crate::model::{Outcome, RequestId};
use crate::platform::Platform;
use crate::time::{Clock, Time};
use crate::transaction::Doing;

/// What it takes to carry out immediate steps of a transaction.
pub(super) struct Hands<'e> {
    tools: Tools<'e>,
    /// The request that each part of the plan serves.
    serves: &'e [RequestId],
    /// Quarantine does not keep its steps out.
    enters_quarantine: bool,
}

/// What every transaction is carried out with.
type Tools<'e> = (&'e dyn Platform, &'e Clock, Option<&'e ProgressSink>);

impl<'e> Hands<'e> {
    /// For a transaction whose parts serve these requests.
    pub fn new(tools: Tools<'e>, serves: &'e [RequestId], enters_quarantine: bool) -> Self {
        Self { tools, serves, enters_quarantine }
    }

    /// Carries out a step, from `at` on, which becomes the time of its end: of steps that follow each other one begins where
    /// the one before has ended, since a look at the clock costs as much as half a step.
    pub fn execute(&self, doing: Doing<'_>, at: &mut Time) -> Outcome {
        let (platform, clock, progress) = self.tools;
        let started = *at;
        let told = progress.map(|progress| (progress, StepName::of(doing.step)));
        if let Some((progress, step)) = told {
            progress(&Progress::Started(step));
        }
        let outcome = pool::execute(platform, doing.step, doing.deadline, self.enters_quarantine);
        *at = clock.now();
        if let Some((progress, step)) = told {
            let (request, end) = (served(self.serves, doing.part), StepEnd::from(&outcome));
            let took = Some(at.since(started));
            progress(&Progress::Ended { request, step, end, took, undoing: doing.undoing });
        }
        outcome
    }
}
