//! The planner's workbench: the steps so far, simulated on an overlay, with everything that is found on the way.

use super::footprint::{Footprint, Saved};
use super::{
    Plan, PlanContext, PlanStage, PlannedStep, Refusal, SavedValue, StepId, changes, conflicts, lists, order, replace,
};
use crate::model::codes;
use crate::model::{Call, ChangeKind, ComponentName, Configuration, Finding, Findings, Origin, Step, Target};
use crate::system::{Overlay, Reversibility, Undo, Violation, step};
use rustc_hash::FxHashSet;
use smallvec::SmallVec;

pub(super) struct PlanBuilder<'o, 's, 'c> {
    pub(super) view: &'o mut Overlay<'s>,
    pub(super) configuration: &'c Configuration,
    pub(super) context: &'c PlanContext,
    pub(super) stage: PlanStage,
    pub(super) steps: Vec<PlannedStep>,
    pub(super) footprint: Footprint,
    pub(super) saved: Vec<SavedValue>,
    pub(super) findings: Findings,
    pub(super) warnings: Findings,
    /// Components about which something is wrong already: what follows from that is not told again.
    pub(super) blamed: FxHashSet<ComponentName>,
}

pub(super) fn build(
    view: &mut Overlay<'_>,
    configuration: &Configuration,
    context: &PlanContext,
) -> Result<Plan, Refusal> {
    let mut findings = Vec::new();
    let replace::Expanded { configuration, replaced } = replace::expand(configuration, view, &mut findings);
    let configuration = configuration.as_ref();
    // What `_default` moves afterwards is mostly what is created.
    let created = configuration.changes.iter().filter(|c| matches!(c.kind, ChangeKind::Create { .. })).count();
    let defaulted = configuration.post.iter().any(|entry| entry.target == Target::Default);
    let moved = if defaulted { 2 * created } else { 0 };
    let mut b = PlanBuilder {
        view,
        configuration,
        context,
        stage: PlanStage::Pre,
        steps: Vec::with_capacity(
            configuration.changes.len() + 2 * (configuration.pre.len() + configuration.post.len()) + moved,
        ),
        footprint: Footprint::default(),
        saved: Vec::new(),
        findings,
        warnings: Vec::new(),
        blamed: FxHashSet::default(),
    };
    b.footprint.touches.reserve(2 * configuration.changes.len() - created + moved);
    let sorted = conflicts::sort(configuration, &mut b.findings);
    b.blamed.extend(&sorted.disputed);
    lists::apply(&mut b, &configuration.pre, PlanStage::Pre, &sorted, &[]);
    let stood = lists::stood(&b, &replaced);
    b.stage = PlanStage::Changes;
    let from = b.steps.len();
    changes::apply(&mut b, &sorted);
    order::irreversible_last(&mut b.steps, from, &mut b.saved);
    b.stage = PlanStage::Post;
    lists::apply(&mut b, &configuration.post, PlanStage::Post, &sorted, &stood);
    if !b.findings.is_empty() {
        return Err(Refusal { findings: b.findings, request: 0 });
    }
    b.warn_irreversible();
    Ok(Plan {
        configuration: configuration.id,
        group: configuration.group,
        steps: b.steps,
        footprint: b.footprint,
        saved: b.saved,
        warnings: b.warnings,
    })
}

impl PlanBuilder<'_, '_, '_> {
    /// The number that the next step gets.
    pub(super) fn next(&self) -> StepId {
        StepId::try_from(self.steps.len()).expect("fewer steps than that")
    }

    /// Plans one step when it may happen; else says why not. `after` are steps it must wait for.
    pub(super) fn step(&mut self, what: Step, undo: Option<&Call>, origin: Origin, after: &[StepId]) -> Option<StepId> {
        let mut found = step::precondition(&what, self.view);
        if let Some(undo) = undo {
            found.extend(step::precondition(&Step::Operation(undo.clone()), self.view));
        }
        if !found.is_empty() {
            self.refuse(found, origin);
            return None;
        }
        Some(self.allowed(what, undo, origin, after))
    }

    /// Plans one step whose precondition was looked at.
    pub(super) fn allowed(&mut self, what: Step, undo: Option<&Call>, origin: Origin, after: &[StepId]) -> StepId {
        let inverse = step::inverse(&what, undo, self.view);
        self.record(&what, undo, &inverse, true);
        let (moves, undo_moves) = (step::moves(&what, self.view), step::undo_moves(&inverse, self.view));
        step::effect(&what, self.view);
        let id = self.next();
        self.steps.push(PlannedStep {
            id,
            stage: self.stage,
            wave: self.stage as u32,
            after: SmallVec::from_slice(after),
            reversibility: step::reversibility(&what, &inverse),
            undo: inverse,
            moves,
            undo_moves,
            step: what,
            origin,
        });
        id
    }

    pub(super) fn refuse(&mut self, found: Vec<Violation>, origin: Origin) {
        for violation in found {
            if !matches!(&violation, Violation::UnknownComponent(name) if self.blamed.contains(name)) {
                let finding = violation.finding(self.view).at(origin);
                self.findings.push(finding);
            }
        }
    }

    /// Records a demand that is true already: it needs no step, and counts as a write of the value that is there.
    pub(super) fn fulfilled(&mut self, what: &Step) {
        let inverse = step::inverse(what, None, self.view);
        self.record(what, None, &inverse, false);
    }

    /// Records what a step touches and what it overwrites; `step` is false when its demand is fulfilled without it. The
    /// system is the one before it.
    fn record(&mut self, what: &Step, undo: Option<&Call>, inverse: &Undo, step: bool) {
        let touched = &mut self.footprint.touches;
        step::touch_each(what, undo, self.view, &mut |touch| touched.push(touch));
        let value = match inverse {
            Undo::One(Step::PropertySet { value, .. }) => Saved::Property(value.clone()),
            Undo::One(Step::PortWrite { value, .. }) => Saved::Port(value.clone()),
            _ => return,
        };
        if let Some(slot) = step::absolute(what) {
            self.saved.push(SavedValue { slot, value, at: self.next(), step });
        }
    }

    fn warn_irreversible(&mut self) {
        if self.configuration.irreversible {
            return;
        }
        for planned in self.steps.iter().filter(|s| s.reversibility == Reversibility::Irreversible) {
            let Undo::Irreversible(reason) = &planned.undo else { continue };
            self.warnings.push(
                Finding::warning(codes::IRREVERSIBLE, format!("in `{}`: {reason}", self.configuration.id))
                    .at(planned.origin)
                    .help("say `irreversible = true` if that is meant, or name the call that undoes it"),
            );
        }
    }
}
