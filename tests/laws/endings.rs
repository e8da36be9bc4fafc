//! However a transaction ends that is given up, interrupted or fails: so it may end by what `check` follows.

use crate::atomicity::{Bench, in_force};
use crate::generate::{self, context, read};
use crate::plans::operator;
use crate::settings;
use davit::model::monitor::{Condition, ConditionKind};
use davit::model::{
    Call, Catalogue, Change, ChangeKind, ComponentName, ComponentType, ConfigId, Configuration, Effect, Ident,
    OperationType, Origin, TypeName,
};
use davit::stack::{Ending, Endings, Op, Stack, transaction};
use davit::system::System;
use davit::transaction::{Input, PartEnd, Stopping, can_fail, endings};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A call that leaves nothing to take back, of which nobody knows: broken where it moves, and else nothing need be known. The
/// condition that settles it decides, where it can be seen.
#[test]
fn what_leaves_nothing_behind_is_broken_only_while_it_may_move() {
    let (look, name) = (Ident::new("look").unwrap(), ComponentName::new("a").unwrap());
    let change = |kind| Change { kind, origin: Origin::NONE };
    let calls = Configuration {
        changes: vec![
            change(ChangeKind::Create {
                component: name,
                ty: TypeName::new("Node").unwrap(),
                activity: None,
                properties: BTreeMap::new(),
            }),
            change(ChangeKind::OperationCall { call: Call { operation: name.member(look), args: vec![] }, undo: None }),
        ],
        ..Configuration::new(ConfigId::new("calls").unwrap())
    };
    for (moves, settles, tells, worst) in [
        (false, false, None, Ending::Failed),
        (true, false, None, Ending::Broken),
        (false, true, None, Ending::Failed),
        (true, true, None, Ending::Broken),
        (true, true, Some(false), Ending::Failed),
        (true, true, Some(true), Ending::Done),
    ] {
        let settled_by = settles.then(|| Condition::new(ConditionKind::Faulted(name)));
        let operation = OperationType { moves, settled_by, ..OperationType::new(Effect::None) };
        let mut ty = ComponentType::new("Node", "What is called.");
        ty.operations.insert(look, operation);
        let mut catalogue = Catalogue::new();
        assert!(catalogue.insert(ty).is_none());
        let system = System::new(Arc::new(catalogue));
        let planned = transaction(&system, &Stack::new(8), &[operator(&calls)], &context()).unwrap();
        let may = endings(&can_fail(&planned), Stopping::Not, true);
        let mut bench = Bench::new(&system, vec![2], vec![0]);
        (bench.unknown, bench.tells) = (true, tells);
        let ends = bench.drive(planned);
        let how: Endings = ends.iter().map(PartEnd::ending).collect();
        assert_eq!(how[..], [worst], "moves: {moves}, settled by {settles} {tells:?}");
        assert!(may.contains(&how), "{may:?}");
        if let [PartEnd::Broken(of)] = &ends[..] {
            assert_eq!(of.residual.unsettled.len(), 1);
        }
    }
}

#[test]
fn a_transaction_ends_as_check_follows_it() {
    let met: RefCell<BTreeMap<String, usize>> = RefCell::default();
    let cases = (
        generate::types(),
        generate::configs(2..6),
        0usize..6,
        (prop::collection::vec(1usize..16, 0..4), any::<bool>(), any::<bool>()),
        prop::option::weighted(0.8, 0usize..10),
        prop::collection::vec(any::<u8>(), 24),
    );
    let mut runner = TestRunner::new(settings());
    let ran = runner.run(&cases, |(types, genes, what, (fails, unknown, blind), comes, picks)| {
        let (system, stack, last) = in_force(generate::catalogue(&types, false), &genes);
        let conf = read(last, &system);
        let ops = [Op::UndoTop, operator(&conf)];
        let ops = [&ops[..1], &ops[1..], &ops[..]][what % 3];
        let Ok(planned) = transaction(&system, &stack, ops, &context()) else { return Ok(()) };
        let can = can_fail(&planned);
        // What is given up is a push.
        let part = ops.iter().position(|op| matches!(op, Op::Push { .. }));
        let (input, stopping) = match (what < 3, part) {
            (true, Some(part)) => (Input::GiveUp { part }, Stopping::GivenUp(part)),
            _ => (Input::Interrupt(ConfigId::new("halt").unwrap()), Stopping::Safe(&[])),
        };
        let mut bench = Bench::new(&system, fails, picks);
        (bench.unknown, bench.blind) = (unknown, blind);
        bench.comes = comes.map(|at| (at, vec![input]));
        let ends: Endings = bench.drive(planned).iter().map(PartEnd::ending).collect();
        // Over before that came, it ended as if nothing had been to come.
        let came = comes.is_some() && bench.comes.is_none();
        let mut may = endings(&can, Stopping::Not, true);
        if came {
            may.extend(endings(&can, stopping, true));
        }
        prop_assert!(may.contains(&ends), "{ends:?} of {may:?}");
        let kind = match came {
            false => "nothing came",
            true if matches!(stopping, Stopping::Safe(_)) => "interrupted",
            true => "given up",
        };
        let worst = if ends.contains(&Ending::Broken) {
            "broken"
        } else if ends.contains(&Ending::Cancelled) {
            "cancelled"
        } else if ends.contains(&Ending::Failed) {
            "failed"
        } else {
            "done"
        };
        *met.borrow_mut().entry(format!("{kind}, {worst}")).or_default() += 1;
        Ok(())
    });
    ran.unwrap_or_else(|failed| panic!("{failed}"));
    let (met, enough) = (met.into_inner(), crate::cases() as usize / 400);
    for kind in [
        "nothing came, broken",
        "nothing came, failed",
        "given up, cancelled",
        "given up, broken",
        "interrupted, failed",
        "interrupted, broken",
    ] {
        assert!(met.get(kind).copied().unwrap_or_default() >= enough, "{kind}: {met:?}");
    }
}
