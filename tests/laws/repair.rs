//! What is broken, repaired in one net with its undo: the same system as mended first and undone then, and nothing on the way
//! that is taken back at once.

use crate::atomicity::in_force;
use crate::generate::{self, context, read};
use crate::motion::moving;
use crate::plans::operator;
use crate::settings;
use davit::model::{ComponentName, Step, Transition};
use davit::stack::{Broken, FrameId, Op, Reason, Residual, Stack, World, transaction};
use davit::system::{diff, step, touch};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use rustc_hash::FxHashSet;
use std::cell::Cell;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Components that are started and stopped by these steps, where nothing that needs them so is done in between.
fn moved_to_and_fro(steps: &[Step]) -> Option<ComponentName> {
    let mut last: Vec<(ComponentName, Transition)> = Vec::new();
    let (mut bound, mut called) = (FxHashSet::default(), FxHashSet::default());
    for step in steps {
        match step {
            Step::State { component, transition } => {
                let before = last.iter().rposition(|(of, _)| of == component);
                let back = before.is_some_and(|at| transition.inverse() == last[at].1);
                let moves = matches!(transition, Transition::Start | Transition::Stop);
                if back && !bound.contains(component) && (moves || !called.contains(component)) {
                    return Some(*component);
                }
                bound.remove(component);
                called.remove(component);
                last.push((*component, *transition));
            }
            // A property may be bound to a run state; what is made anew begins anew.
            Step::PropertySet { property, .. } => drop(bound.insert(property.component)),
            // What does not move may be brought to where it was for a call.
            Step::Operation(call) => drop(called.insert(call.operation.component)),
            Step::Create { component, .. } | Step::Destroy { component } => drop(bound.insert(*component)),
            _ => {}
        }
    }
    None
}

#[test]
fn one_net_ends_in_the_same_system_and_moves_nothing_to_and_fro() {
    let (met, shorter, called) = (Cell::new(0), Cell::new(0), Cell::new(0));
    let cases = (generate::types(), generate::configs(3..7), any::<u8>(), 1usize..6);
    let mut runner = TestRunner::new(settings());
    let ran = runner.run(&cases, |(types, genes, which, tampered)| {
        let (model, stack, last) = in_force(moving(&generate::catalogue(&types, false)), &genes);
        // A stranger did some of what a configuration would, or took some of a frame back.
        let strange = match stack.frames().last() {
            Some(top) if which % 3 > 0 => transaction(&model, &stack, &[Op::Undo(top.id)], &context()),
            _ => transaction(&model, &Stack::new(8), &[operator(&read(last, &model))], &context()),
        };
        let Ok(strange) = strange else { return Ok(()) };
        let mut actual = model.clone();
        for planned in strange.steps.iter().take(tampered) {
            step::apply(&planned.step, &mut actual).expect("as planned");
        }
        let difference = diff(&model, &actual);
        let components: BTreeSet<ComponentName> = difference.iter().flat_map(touch::components).collect();
        if components.is_empty() || stack.is_empty() {
            return Ok(());
        }
        let names: Vec<ComponentName> = components.iter().copied().collect();
        let residual = Residual { difference, ..Residual::of(Reason::Ended) };
        let expected = model.snapshot_some(&names);
        let mut world = World::new(actual.clone(), stack.clone());
        let residual = Arc::new(residual);
        world.broken.push(Broken::of_nobody(residual, components, expected));
        prop_assert!(diff(&world.as_meant(&world.broken[0]), &model).is_empty(), "what is meant is the model");
        let frame: FrameId = stack.frames()[which as usize % stack.len()].id;
        let Ok(undo) = transaction(&model, &stack, &[Op::Undo(frame)], &context()) else {
            prop_assert!(world.straight(0, frame, &context()).is_none());
            return Ok(());
        };
        let mut end = model.clone();
        undo.steps.iter().for_each(|planned| step::apply(&planned.step, &mut end).expect("as planned"));
        let Some(net) = world.straight(0, frame, &context()) else { return Ok(()) };
        met.set(met.get() + 1);
        let mut reached = actual.clone();
        let steps: Vec<Step> = net.steps.iter().map(|planned| planned.step.clone()).collect();
        for step in &steps {
            prop_assert!(step::apply(step, &mut reached).is_ok(), "`{}` of {:?}", step, steps);
        }
        prop_assert!(diff(&reached, &end).is_empty(), "{:?}", steps);
        let calls = |steps: &mut dyn Iterator<Item = &Step>| {
            steps.filter(|step| matches!(step, Step::Operation(_))).cloned().collect::<Vec<_>>()
        };
        let asked = calls(&mut undo.steps.iter().map(|planned| &planned.step));
        prop_assert_eq!(&asked, &calls(&mut steps.iter()), "every call of the undo, and no other");
        called.set(called.get() + usize::from(!asked.is_empty()));
        let whole = undo.steps.len() + world.mending(&world.broken[0]).len();
        prop_assert!(steps.len() < whole, "{} of {}", steps.len(), whole);
        shorter.set(shorter.get() + whole - steps.len());
        if let Some(moved) = moved_to_and_fro(&steps) {
            // What the frame itself did to and fro goes back so.
            let does = |transition| Step::State { component: moved, transition };
            let own = |transition| undo.steps.iter().any(|planned| planned.step == does(transition));
            prop_assert!(own(Transition::Start) && own(Transition::Stop), "{:?}", steps);
        }
        prop_assert_eq!(net.parts.len(), 1);
        prop_assert_eq!(&net.parts[0].edits, &undo.parts[0].edits);
        Ok(())
    });
    ran.unwrap_or_else(|failed| panic!("{failed}"));
    let (met, called, enough) = (met.get(), called.get(), crate::cases() as usize / 50);
    assert!(met >= enough && shorter.get() > met && called >= enough / 10, "{met} {called} {}", shorter.get());
}
