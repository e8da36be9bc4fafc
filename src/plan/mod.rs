//! How to get there: what a configuration means in a given system.
//!
//! Pure and deterministic: the planner does no I/O, reads no clock, and the same system and configuration give the same
//! plan. It never changes the system it is given. A [`Plan`] can come only from here, and only when nothing is wrong.

pub mod backwards;
mod builder;
mod changes;
mod conflicts;
pub mod footprint;
mod lists;
pub mod meant;
mod order;
pub mod replace;
#[cfg(test)]
mod tests;
pub mod undo;

use crate::model::words::words;
use crate::model::{ComponentName, ConfigId, Configuration, Deployment, Finding, Findings, Ident, Origin, Step};
use crate::system::{Overlay, Reversibility, System, Undo};
pub use conflicts::ConflictSubject;
use footprint::{Footprint, Saved, Slot};
use smallvec::SmallVec;
use std::collections::BTreeSet;

/// What a configuration is judged by, beside the system (which knows its component types).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PlanContext {
    /// The deployment's activities.
    pub activities: BTreeSet<Ident>,
    /// Components that `_default` passes over: in quarantine, or not known well enough.
    pub avoid: BTreeSet<ComponentName>,
}

impl PlanContext {
    /// That of a deployment's configurations.
    pub fn of(deployment: &Deployment) -> Self {
        Self { activities: deployment.activities.keys().copied().collect(), avoid: BTreeSet::new() }
    }
}

words! {
    /// The stage a step belongs to. Stages are barriers.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
    pub enum PlanStage by word {
        /// The pre-state list.
        Pre = "pre",
        /// The changes.
        Changes = "changes",
        /// The post-state list.
        Post = "post",
    }
}

/// The number of a step inside its plan or transaction: its place in the list.
pub type StepId = u32;

/// A step of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStep {
    /// Its number: its place in the list.
    pub id: StepId,
    /// The stage it belongs to (for an inverse: the stage of the step it undoes).
    pub stage: PlanStage,
    /// Barriers: a step begins only when all steps of smaller waves are done. Never decreases along the list.
    pub wave: u32,
    /// Steps of the same wave that must be done before; all have smaller numbers.
    pub after: SmallVec<[StepId; 4]>,
    /// What is done.
    pub step: Step,
    /// How far it can be undone.
    pub reversibility: Reversibility,
    /// What undoes it, with the values that the planner saw.
    pub undo: Undo,
    /// Whether doing it moves hardware.
    pub moves: bool,
    /// Whether undoing it moves hardware: no automatic rollback does that unasked.
    pub undo_moves: bool,
    /// The element of the configuration it comes from.
    pub origin: Origin,
}

impl PlannedStep {
    /// A step that is done for itself: nothing undoes it.
    pub fn bare(step: Step, id: StepId, wave: u32, after: SmallVec<[StepId; 4]>) -> Self {
        Self {
            id,
            stage: PlanStage::Changes,
            wave,
            after,
            step,
            reversibility: Reversibility::Exact,
            undo: Undo::Nothing,
            moves: false,
            undo_moves: false,
            origin: Origin::NONE,
        }
    }
}

/// What a slot held before an absolute write.
#[derive(Debug, Clone, PartialEq)]
pub struct SavedValue {
    /// The property or port.
    pub slot: Slot,
    /// What it held.
    pub value: Saved,
    /// The write's place: before the step of this number, or that step itself.
    pub at: StepId,
    /// Whether a step was needed (else the demand was already true).
    pub step: bool,
}

/// What a configuration means in one system.
///
/// `steps` stand in an order in which they may happen; what may happen in parallel is told by `wave` and `after`.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The configuration.
    pub configuration: ConfigId,
    /// The group it belongs to.
    pub group: Option<Ident>,
    /// What is done.
    pub steps: Vec<PlannedStep>,
    /// What it touches.
    pub footprint: Footprint,
    /// What its absolute writes overwrite.
    pub saved: Vec<SavedValue>,
    /// Allowed, and worth saying.
    pub warnings: Findings,
}

/// The reason of the first step that cannot be undone.
pub fn irreversible(steps: &[PlannedStep]) -> Option<&str> {
    steps.iter().find_map(|s| match &s.undo {
        Undo::Irreversible(reason) => Some(reason.as_str()),
        _ => None,
    })
}

/// Why a configuration is refused: every violation, not the first.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{}", findings.first().map_or("refused", |f| f.message.as_str()))]
pub struct Refusal {
    /// Errors, each at its place; never empty.
    pub findings: Findings,
    /// Which request of a batch is refused (0 where there is only one).
    pub request: usize,
}

impl Refusal {
    /// A refusal for one reason.
    pub fn one(finding: Finding) -> Self {
        Self { findings: vec![finding], request: 0 }
    }
}

/// The steps that `configuration` means in `system`.
///
/// Costs in proportion to the configuration, not to the system, except for `_default`, which looks at every component.
///
/// # Errors
/// [`Refusal`] with all violations: nothing was changed, nothing will be.
pub fn plan(system: &System, configuration: &Configuration, context: &PlanContext) -> Result<Plan, Refusal> {
    plan_on(&mut Overlay::new(system), configuration, context)
}

/// The same on a system with changes laid over it; the plan's effect is laid over it, too.
///
/// # Errors
/// [`Refusal`]; the overlay is then of no further use.
pub fn plan_on(view: &mut Overlay<'_>, configuration: &Configuration, context: &PlanContext) -> Result<Plan, Refusal> {
    builder::build(view, configuration, context)
}
