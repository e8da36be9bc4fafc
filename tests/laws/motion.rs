//! Nothing moves that nobody asked to move: no automatic rollback moves anything, unless the configuration says so.

use crate::atomicity::{Bench, in_force};
use crate::generate::{self, context, read};
use crate::plans::operator;
use crate::settings;
use davit::model::{Catalogue, ConfigId, OnFailure};
use davit::stack::{Op, transaction};
use davit::transaction::{Input, PartEnd};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::cell::Cell;
use std::sync::Arc;

/// The same types, of which starting, stopping and half of the operations move something.
pub fn moving(catalogue: &Catalogue) -> Arc<Catalogue> {
    let mut all = Catalogue::new();
    for ty in catalogue.iter() {
        let mut ty = (**ty).clone();
        (ty.moves.start, ty.moves.stop) = (true, true);
        ty.operations.values_mut().step_by(2).for_each(|operation| operation.moves = true);
        assert!(all.insert(ty).is_none(), "each once");
    }
    Arc::new(all)
}

#[test]
fn no_automatic_rollback_moves_anything() {
    let (rollbacks, withheld, moved) = (Cell::new(0), Cell::new(0), Cell::new(0));
    let cases = (
        generate::types(),
        generate::configs(2..6),
        any::<bool>(),
        any::<bool>(),
        1usize..12,
        prop::collection::vec(any::<u8>(), 24),
    );
    let mut runner = TestRunner::new(settings());
    let ran = runner.run(&cases, |(types, mut genes, undo, asked, fail, picks)| {
        // All of one file.
        genes.iter_mut().for_each(|gene| gene.id %= 56);
        let (system, stack, last) = in_force(moving(&generate::catalogue(&types, false)), &genes);
        let mut conf = read(last, &system);
        if asked {
            conf.on_failure = OnFailure::Rollback;
        }
        let op = if undo { Op::UndoTop } else { operator(&conf) };
        let Ok(planned) = transaction(&system, &stack, &[op], &context()) else { return Ok(()) };
        let mut bench = Bench::new(&system, vec![fail], picks);
        let ends = bench.drive(planned);
        rollbacks.set(rollbacks.get() + usize::from(bench.back > 0));
        let broken = ends.iter().find_map(|end| match end {
            PartEnd::Broken(broken) => Some(broken),
            _ => None,
        });
        let held_back = broken.and_then(|broken| broken.residual.withheld.clone());
        withheld.set(withheld.get() + usize::from(held_back.is_some()));
        if asked && !undo {
            // Asked for, it goes back whatever moves.
            prop_assert_eq!(held_back, None);
            moved.set(moved.get() + usize::from(!bench.moved_back.is_empty()));
        } else {
            prop_assert!(bench.moved_back.is_empty(), "{:?}", bench.moved_back);
        }
        Ok(())
    });
    ran.unwrap_or_else(|failed| panic!("{failed}"));
    let (rollbacks, withheld, moved) = (rollbacks.get(), withheld.get(), moved.get());
    let enough = crate::cases() as usize / 12;
    assert!(rollbacks >= enough && withheld >= enough / 4 && moved >= enough / 8, "{rollbacks} {withheld} {moved}");
}

#[test]
fn an_undo_of_what_was_interrupted_moves_nothing_more_on_its_way_back() {
    let (came, withheld) = (Cell::new(0), Cell::new(0));
    let cases = (
        generate::types(),
        generate::configs(2..6),
        any::<bool>(),
        1usize..10,
        prop::option::of(1usize..6),
        prop::collection::vec(any::<u8>(), 24),
    );
    let mut runner = TestRunner::new(settings());
    let ran = runner.run(&cases, |(types, genes, rollback, at, fail, picks)| {
        let (system, stack, last) = in_force(moving(&generate::catalogue(&types, false)), &genes);
        let mut conf = read(last, &system);
        if rollback {
            conf.on_failure = OnFailure::Rollback;
        }
        let Ok(planned) = transaction(&system, &stack, &[operator(&conf)], &context()) else { return Ok(()) };
        // Interrupted alone, and with the undo right after that.
        let halt = Input::Interrupt(ConfigId::new("halt").unwrap());
        let [(alone, _), (undone, ends)] = [vec![halt.clone()], vec![halt, Input::GiveUp { part: 0 }]].map(|inputs| {
            let mut bench = Bench::new(&system, fail.into_iter().collect(), picks.clone());
            bench.unknown = fail.is_some();
            bench.comes = Some((at, inputs));
            let ends = bench.drive(planned.clone());
            (bench, ends)
        });
        prop_assert_eq!(&alone.moved_back, &undone.moved_back);
        let both = undone.comes.is_none();
        let held_back = ends.iter().any(|end| matches!(end, PartEnd::Broken(of) if of.residual.withheld.is_some()));
        came.set(came.get() + usize::from(both));
        withheld.set(withheld.get() + usize::from(both && held_back));
        Ok(())
    });
    ran.unwrap_or_else(|failed| panic!("{failed}"));
    let (came, withheld, enough) = (came.get(), withheld.get(), crate::cases() as usize / 10);
    assert!(came >= enough && withheld >= enough / 4, "{came} {withheld}");
}
