//! The planner's workbench: the steps so far, simulated on an overlay, with everything that is found on the way.

use super::footprint::{Access, Footprint, Saved, Slot};
use super::{Context, Plan, PlannedStep, Refusal, SavedValue, Stage, StepId, changes, conflicts, lists, order};
use crate::model::codes;
use crate::model::{
    Call, ChangeKind, ComponentName, Configuration, Finding, Findings, MemberRef, Origin, Policy, Step, Tunable,
};
use crate::system::{Overlay, Reversibility, Undo, View, Violation, step};
use rustc_hash::FxHashSet;
use smallvec::SmallVec;

pub(super) struct Builder<'o, 's, 'c> {
    pub(super) view: &'o mut Overlay<'s>,
    pub(super) configuration: &'c Configuration,
    pub(super) context: &'c Context,
    pub(super) stage: Stage,
    pub(super) steps: Vec<PlannedStep>,
    pub(super) footprint: Footprint,
    pub(super) saved: Vec<SavedValue>,
    pub(super) findings: Findings,
    pub(super) warnings: Findings,
    /// Components about which something is wrong already: what follows from that is not told again.
    pub(super) blamed: FxHashSet<ComponentName>,
}

pub(super) fn build(view: &mut Overlay<'_>, configuration: &Configuration, context: &Context) -> Result<Plan, Refusal> {
    let revision = view.base().revision();
    let mut b = Builder {
        view,
        configuration,
        context,
        stage: Stage::Pre,
        steps: Vec::with_capacity(
            configuration.changes.len() + 2 * (configuration.pre.len() + configuration.post.len()),
        ),
        footprint: Footprint::default(),
        saved: Vec::new(),
        findings: Vec::new(),
        warnings: Vec::new(),
        blamed: FxHashSet::default(),
    };
    let sorted = conflicts::sort(configuration, &mut b.findings);
    b.blamed.extend(&sorted.disputed);
    lists::apply(&mut b, &configuration.pre, Stage::Pre, &sorted);
    b.stage = Stage::Changes;
    let from = b.steps.len();
    changes::apply(&mut b, &sorted);
    order::irreversible_last(&mut b.steps, from, &mut b.saved);
    b.stage = Stage::Post;
    lists::apply(&mut b, &configuration.post, Stage::Post, &sorted);
    if !b.findings.is_empty() {
        return Err(Refusal { findings: b.findings, request: 0 });
    }
    b.warn_irreversible();
    Ok(Plan {
        configuration: configuration.id,
        group: configuration.group,
        revision,
        steps: b.steps,
        footprint: b.footprint,
        saved: b.saved,
        warnings: b.warnings,
    })
}

/// A change as it is written: for messages.
pub(super) fn show(kind: &ChangeKind) -> String {
    match kind {
        ChangeKind::Create { component, ty, .. } => format!("create {component} : {ty}"),
        ChangeKind::Destroy { component } => format!("destroy {component}"),
        ChangeKind::Connect { from, to, policy } => format!("connect {from} -> {to} ({policy})"),
        ChangeKind::Disconnect { from, to } => format!("disconnect {from} -> {to}"),
        ChangeKind::PropertySet { property, value } => format!("property_set {property} = {value}"),
        ChangeKind::PortWrite { port, value } => format!("port_write {port} = {value}"),
        ChangeKind::OperationCall { call, .. } => Step::Operation(call.clone()).to_string(),
    }
}

impl Builder<'_, '_, '_> {
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
            self.refuse(&what, found, origin);
            return None;
        }
        Some(self.allowed(what, undo, origin, after))
    }

    /// Plans one step whose precondition was looked at.
    pub(super) fn allowed(&mut self, what: Step, undo: Option<&Call>, origin: Origin, after: &[StepId]) -> StepId {
        let inverse = step::inverse(&what, undo, self.view);
        self.touch(&what, &inverse);
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

    pub(super) fn refuse(&mut self, what: &Step, found: Vec<Violation>, origin: Origin) {
        for violation in found {
            if let Violation::UnknownComponent(name) = &violation
                && self.blamed.contains(name)
            {
                continue;
            }
            let mut finding = Finding::error(violation.code(), violation.to_string()).at(origin);
            finding.help = violation.help(self.view);
            if let Some(declared) = self.declaration(&violation, what) {
                finding = finding.also(declared, "declared here");
            }
            self.findings.push(finding);
        }
    }

    /// Where the type's member at fault was declared, if in a text.
    fn declaration(&self, violation: &Violation, what: &Step) -> Option<Origin> {
        let ty = |component: ComponentName| self.view.component(component).map(|n| &n.ty);
        let port = |m: &MemberRef| ty(m.component)?.ports.get(&m.member).map(|p| p.origin);
        let property = |m: &MemberRef| ty(m.component)?.properties.get(&m.member).map(|p| p.origin);
        let origin = match violation {
            Violation::UnknownPort { port: m, .. }
            | Violation::UnknownProperty { property: m, .. }
            | Violation::UnknownOperation { operation: m, .. } => ty(m.component).map(|t| t.origin),
            Violation::NotOut(m)
            | Violation::NotIn(m)
            | Violation::NeedsBuffer(m)
            | Violation::NotWritable { port: m, .. }
            | Violation::PortTypes { to: m, .. }
            | Violation::PortUnits { to: m, .. } => port(m),
            Violation::NotTunable { property: m, .. } => property(m),
            Violation::BadValue { slot, .. } => match what {
                Step::PortWrite { .. } => port(slot),
                _ => property(slot),
            },
            Violation::ArgumentCount { operation: m, .. } | Violation::Argument { operation: m, .. } => {
                ty(m.component).and_then(|t| t.operations.get(&m.member)).map(|o| o.origin)
            }
            _ => None,
        };
        origin.filter(|o| o.is_some())
    }

    /// Records what a step touches and what its inverse will need. The system is the one before the step.
    fn touch(&mut self, what: &Step, inverse: &Undo) {
        match what {
            Step::State { component, .. } => self.footprint.touch(Slot::State(*component), Access::Write),
            Step::Create { component, .. } | Step::Destroy { component } => {
                self.footprint.touch(Slot::Component(*component), Access::Write);
            }
            Step::Connect { from, to, policy } => self.touch_link(*from, *to, *policy),
            Step::Disconnect { from, to } => {
                if let Some(policy) = self.view.link(*from, *to) {
                    self.touch_link(*from, *to, policy);
                }
            }
            Step::PropertySet { property, .. } => {
                if let Undo::One(Step::PropertySet { value, .. }) = inverse {
                    let value = Saved::Property(value.clone());
                    self.write_property(*property, value, true);
                }
            }
            Step::PortWrite { port, .. } => {
                if let Undo::One(Step::PortWrite { value, .. }) = inverse {
                    let value = Saved::Port(value.clone());
                    self.write_port(*port, value, true);
                }
            }
            Step::Operation(call) => {
                self.footprint.touch(Slot::Operation(call.operation), Access::Write);
                if let Undo::One(Step::Operation(undo)) = inverse {
                    self.footprint.touch(Slot::Operation(undo.operation), Access::Write);
                }
            }
        }
    }

    fn touch_link(&mut self, from: MemberRef, to: MemberRef, policy: Policy) {
        let event =
            self.view.component(to.component).and_then(|n| n.port(to.member)).is_some_and(|(_, p)| p.is_event());
        let access = if policy == Policy::Data && !event { Access::Write } else { Access::Join };
        self.footprint.touch(Slot::Link(from, to), Access::Write);
        self.footprint.touch(Slot::Drive(to), access);
    }

    /// Records an absolute write to a property; `step` is false when it holds the value already.
    pub(super) fn write_property(&mut self, property: MemberRef, value: Saved, step: bool) {
        let slot = Slot::Property(property);
        self.saved.push(SavedValue { slot, value, at: self.next(), step });
        self.footprint.touch(slot, Access::Write);
        let node = self.view.component(property.component);
        if node.and_then(|n| n.property(property.member)).is_some_and(|(_, p)| p.tunable != Tunable::Always) {
            self.footprint.serve(Slot::State(property.component), Access::Need, slot);
        }
    }

    /// Records an absolute write to a port; `step` is false when it holds the value already.
    pub(super) fn write_port(&mut self, port: MemberRef, value: Saved, step: bool) {
        let slot = Slot::Port(port);
        self.saved.push(SavedValue { slot, value, at: self.next(), step });
        self.footprint.touch(slot, Access::Write);
        self.footprint.serve(Slot::Drive(port), Access::Need, slot);
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
