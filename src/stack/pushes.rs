//! What applying a configuration comes to, planned once in each system: for whoever follows thousands of stacks in some dozen systems.

use crate::model::{ConfigId, Configuration, Findings};
use crate::plan::footprint::Footprint;
use crate::plan::{Plan, PlanContext, PlannedStep, Refusal, SavedValue, irreversible, plan_on};
use crate::system::Overlay;
use rustc_hash::FxHashMap;
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

/// What is pushed, in the system in which it was planned.
#[derive(Debug)]
pub(super) struct PlannedPush {
    pub steps: Arc<Vec<PlannedStep>>,
    pub footprint: Arc<Footprint>,
    pub saved: Vec<SavedValue>,
    pub floor: Option<String>,
    pub warnings: Findings,
}

impl PlannedPush {
    /// Planned on `view`, which is then as it leads to.
    pub fn on(view: &mut Overlay<'_>, configuration: &Configuration, context: &PlanContext) -> PushOutcome {
        Rc::new(plan_on(view, configuration, context).map(|plan| {
            let Plan { steps, footprint, saved, warnings, .. } = plan;
            let floor = irreversible(&steps).map(str::to_owned);
            Self { steps: Arc::new(steps), footprint: Arc::new(footprint), saved, floor, warnings }
        }))
    }
}

/// What planning a push came to.
pub(super) type PushOutcome = Rc<Result<PlannedPush, Refusal>>;

/// All that was planned more than once, by the number of the system; none: it was planned once. Where most is planned once only, keeping it
/// would be of no use.
#[derive(Debug, Default)]
pub struct PlannedPushes(RefCell<FxHashMap<(u32, ConfigId), Option<PushOutcome>>>);

/// That of one system, as nothing has changed it yet.
#[derive(Debug, Clone, Copy)]
pub struct PushesOf<'a> {
    all: &'a PlannedPushes,
    system: u32,
}

impl PlannedPushes {
    /// Those of the system of that number.
    pub fn of(&self, system: u32) -> PushesOf<'_> {
        PushesOf { all: self, system }
    }
}

impl PushesOf<'_> {
    /// What was planned of a configuration, if that is known.
    pub(super) fn known(self, of: ConfigId) -> Option<PushOutcome> {
        self.all.0.borrow().get(&(self.system, of)).cloned().flatten()
    }

    /// Notes what was planned.
    pub(super) fn note(self, of: ConfigId, planned: &PushOutcome) {
        let mut all = self.all.0.borrow_mut();
        let twice = all.contains_key(&(self.system, of));
        all.insert((self.system, of), twice.then(|| planned.clone()));
    }
}
