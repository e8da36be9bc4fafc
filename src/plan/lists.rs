//! The pre- and post-state lists: entries in order, `_default` expanded at its place.

use super::builder::PlanBuilder;
use super::conflicts::Sorted;
use super::footprint::{Access, Slot};
use super::order::{self, OrderMove};
use super::{PlanStage, StepId};
use crate::model::codes;
use crate::model::{ComponentName, Finding, RunState, StateEntry, StateList, Step, Target, Transition, Wanted};
use crate::system::{View, Violation};
use rustc_hash::FxHashSet;

pub(super) fn apply(b: &mut PlanBuilder<'_, '_, '_>, list: &StateList, stage: PlanStage, sorted: &Sorted) {
    b.stage = stage;
    let mut frontier: Vec<StepId> = Vec::new();
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
        if let Some(id) = b.step(Step::State { component, transition: *transition }, None, entry.origin, frontier) {
            frontier.clear();
            frontier.push(id);
        }
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
    if moving.is_empty() {
        return;
    }
    let key = match entry.state {
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
        let (state, actuator) = (node.state, node.ty.actuator);
        let mut own = None;
        let mut previous: Option<StepId> = None;
        for transition in state.path_to(entry.state) {
            waits.clear();
            match previous {
                Some(before) => waits.push(before),
                None => waits.extend_from_slice(frontier),
            }
            if *transition == key {
                waits.extend(after.iter().filter_map(|at| keys[*at as usize]));
            }
            previous =
                b.step(Step::State { component: *component, transition: *transition }, None, entry.origin, &waits);
            if *transition == key {
                own = previous;
            }
        }
        if actuator && own.is_some() {
            let verb = if key == Transition::Start { "started" } else { "stopped" };
            let message =
                format!("in `{}` the actuator `{component}` is {verb} only through `_default`", b.configuration.id);
            b.warnings.push(
                Finding::warning(codes::ACTUATOR_BY_DEFAULT, message)
                    .at(entry.origin)
                    .help(format!("name it: \"{component}:{}\"", entry.state)),
            );
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
