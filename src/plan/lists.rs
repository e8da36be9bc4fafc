//! The pre- and post-state lists: entries in order, `_default` expanded at its place.

use super::builder::PlanBuilder;
use super::conflicts::Sorted;
use super::footprint::{Access, Slot};
use super::order::{self, OrderMove};
use super::{PlanStage, PlannedStep, StepId};
use crate::model::codes;
use crate::model::{ComponentName, Finding, Origin, RunState, StateEntry, StateList, Step, Target, Transition, Wanted};
use crate::system::{View, Violation};
use rustc_hash::FxHashSet;

/// A component that is replaced, and the run state to which the new one comes where the list says nothing of it.
pub(super) struct Stood {
    component: ComponentName,
    state: Wanted,
    origin: Origin,
}

/// The run states in which the changes find what they replace. What is faulted stands nowhere that anyone may demand.
pub(super) fn stood(b: &PlanBuilder<'_, '_, '_>, replaced: &[(ComponentName, Origin)]) -> Vec<Stood> {
    let one = |(component, origin): &(ComponentName, Origin)| {
        let state = b.view.component(*component)?.state.wanted()?;
        Some(Stood { component: *component, state, origin: *origin })
    };
    replaced.iter().filter_map(one).collect()
}

/// Carries out a list; before its entries what was replaced comes to the run state in which the old one `stood`.
pub(super) fn apply(
    b: &mut PlanBuilder<'_, '_, '_>,
    list: &StateList,
    stage: PlanStage,
    sorted: &Sorted,
    stood: &[Stood],
) {
    b.stage = stage;
    let mut frontier: Vec<StepId> = Vec::new();
    for state in [Wanted::Stopped, Wanted::Running] {
        let said = |one: &&Stood| one.state == state && !says(b, list, one.component);
        let again: Vec<&Stood> = stood.iter().filter(said).collect();
        let moving = again.iter().map(|one| one.component).filter(|name| b.view.component(*name).is_some()).collect();
        let origin = |name| again.iter().find(|one| one.component == name).map_or(Origin::NONE, |one| one.origin);
        bring(b, moving, state, &origin, &mut frontier);
    }
    for entry in list.iter() {
        match entry.target {
            Target::Component(component) => named(b, component, entry, sorted, &mut frontier),
            Target::Default => expand(b, list, entry, &mut frontier),
        }
    }
}

fn named(
    b: &mut PlanBuilder<'_, '_, '_>,
    component: ComponentName,
    entry: StateEntry,
    sorted: &Sorted,
    frontier: &mut Vec<StepId>,
) {
    let Some(state) = b.view.component(component).map(|n| n.state) else {
        unknown(b, component, entry, sorted);
        return;
    };
    let path = state.path_to(entry.state);
    if path.is_empty() {
        b.footprint.touch(Slot::State(component), Access::Need);
    }
    for transition in path {
        // What would follow a move that is refused is not told again.
        let Some(id) = b.step(Step::State { component, transition: *transition }, None, entry.origin, frontier) else {
            break;
        };
        frontier.clear();
        frontier.push(id);
    }
}

fn unknown(b: &mut PlanBuilder<'_, '_, '_>, component: ComponentName, entry: StateEntry, sorted: &Sorted) {
    let changes = &b.configuration.changes;
    let finding = match (b.stage, sorted.created.get(&component), sorted.destroyed.get(&component)) {
        // One that is destroyed and created again concerns the component that was there before.
        (PlanStage::Pre, Some(create), None) => {
            let message =
                format!("`{component}` is created by this configuration and does not exist before the changes");
            Finding::error(codes::PRE_ON_CREATED, message)
                .also(changes[*create].origin, "created here")
                .help("put the entry into post_conf_state")
        }
        (PlanStage::Post, None, Some(destroy)) if !b.blamed.contains(&component) => {
            let message =
                format!("`{component}` is destroyed by this configuration and does not exist after the changes");
            Finding::error(codes::POST_ON_DESTROYED, message)
                .also(changes[*destroy].origin, "destroyed here")
                .help("remove the entry: destroy stops and cleans up by itself")
        }
        _ if b.blamed.contains(&component) => return,
        _ => Violation::UnknownComponent(component).finding(b.view),
    };
    b.findings.push(finding.at(entry.origin));
}

fn expand(b: &mut PlanBuilder<'_, '_, '_>, list: &StateList, entry: StateEntry, frontier: &mut Vec<StepId>) {
    let named: FxHashSet<ComponentName> = list.named().collect();
    let scope = b.configuration.id.prefix();
    let wanted = RunState::from(entry.state);
    // Before the changes it is a matter of standing still, and what has faulted does: to bring it out of that could only fail.
    let stands = |state| state == RunState::Faulted && b.stage == PlanStage::Pre && wanted == RunState::Stopped;
    let mut moving: Vec<ComponentName> = Vec::new();
    b.view.for_each_component(&mut |node| {
        if node.state != wanted
            && !stands(node.state)
            && node.name.prefix() == scope
            && !named.contains(&node.name)
            && !b.context.avoid.contains(&node.name)
        {
            moving.push(node.name);
        }
    });
    let from = b.steps.len();
    bring(b, moving, entry.state, &|_| entry.origin, frontier);
    for (component, transition) in actuators(b, from) {
        let verb = if transition == Transition::Start { "started" } else { "stopped" };
        let message =
            format!("in `{}` the actuator `{component}` is {verb} only through `_default`", b.configuration.id);
        b.warnings.push(
            Finding::warning(codes::ACTUATOR_BY_DEFAULT, message)
                .at(entry.origin)
                .help(format!("name it: \"{component}:{}\"", entry.state)),
        );
    }
}

/// The actuators that the steps from there on start or stop.
fn actuators(b: &PlanBuilder<'_, '_, '_>, from: usize) -> Vec<(ComponentName, Transition)> {
    let one = |step: &PlannedStep| match step.step {
        Step::State { component, transition: transition @ (Transition::Start | Transition::Stop) } => {
            b.view.component(component).filter(|node| node.ty.actuator).map(|_| (component, transition))
        }
        _ => None,
    };
    b.steps[from..].iter().filter_map(one).collect()
}

/// Whether a list says to which run state a component comes.
fn says(b: &PlanBuilder<'_, '_, '_>, list: &StateList, component: ComponentName) -> bool {
    let by_default = || {
        component.prefix() == b.configuration.id.prefix()
            && !b.context.avoid.contains(&component)
            && list.iter().any(|entry| entry.target == Target::Default)
    };
    list.named().any(|name| name == component) || by_default()
}

/// Brings these components to a run state, in the order of the data flow.
fn bring(
    b: &mut PlanBuilder<'_, '_, '_>,
    moving: Vec<ComponentName>,
    wanted: Wanted,
    origin: &dyn Fn(ComponentName) -> Origin,
    frontier: &mut Vec<StepId>,
) {
    if moving.is_empty() {
        return;
    }
    let key = match wanted {
        Wanted::Running => Transition::Start,
        Wanted::Stopped | Wanted::Unconfigured => Transition::Stop,
    };
    let moves = order::data_flow(b.view, moving, key);
    let from = b.steps.len();
    b.steps.reserve(2 * moves.len());
    b.footprint.touches.reserve(2 * moves.len());
    // The number of the start or stop of each move; a move without one (never running) is waited for by nobody.
    let mut keys: Vec<Option<StepId>> = Vec::with_capacity(moves.len());
    let mut waits: Vec<StepId> = Vec::new();
    for OrderMove { component, after } in &moves {
        let node = b.view.component(*component).expect("it was just seen");
        let state = node.state;
        let mut own = None;
        let mut previous: Option<StepId> = None;
        for transition in state.path_to(wanted) {
            waits.clear();
            match previous {
                Some(before) => waits.push(before),
                None => waits.extend_from_slice(frontier),
            }
            if *transition == key {
                waits.extend(after.iter().filter_map(|at| keys[*at as usize]));
            }
            previous = b.step(
                Step::State { component: *component, transition: *transition },
                None,
                origin(*component),
                &waits,
            );
            if previous.is_none() {
                break;
            }
            if *transition == key {
                own = previous;
            }
        }
        keys.push(own);
    }
    order::irreversible_last(&mut b.steps, from, &mut b.saved);
    // What comes next waits for the last steps of this expansion.
    let mut waited = vec![false; b.steps.len() - from];
    for step in &b.steps[from..] {
        for id in &step.after {
            if let Some(at) = (*id as usize).checked_sub(from) {
                waited[at] = true;
            }
        }
    }
    *frontier = waited.iter().enumerate().filter(|(_, w)| !**w).map(|(i, _)| b.steps[from + i].id).collect();
}
