//! Atomicity, model part: fail at any step of any transaction, take back what was done, and the system is the one before.

use crate::generate::{self, context, read};
use crate::plans::operator;
use crate::settings;
use davit::plan::undo::rollback;
use davit::stack::{Op, Stack, transaction};
use davit::system::step;
use proptest::prelude::*;

proptest! {
    #![proptest_config(settings())]

    #[test]
    fn atomicity(
        types in generate::types(),
        genes in generate::configs(2..6),
        what in any::<u8>(),
        fail in any::<prop::sample::Index>(),
        picks in prop::collection::vec(any::<u8>(), 24),
    ) {
        let mut system = davit::system::System::new(generate::catalogue(&types, false));
        let mut stack = Stack::new(8);
        let (last, first) = genes.split_last().unwrap();
        for gene in first {
            let conf = read(gene, &system);
            let Ok(push) = transaction(&system, &stack, &[operator(&conf)], &context()) else { continue };
            for s in &push.steps {
                step::apply(&s.step, &mut system).unwrap();
            }
            stack.commit(push);
        }
        let conf = read(last, &system);
        let requests = [Op::UndoTop, operator(&conf)];
        // A push, an undo, or the net of both.
        let requests = [&requests[..1], &requests[1..], &requests[..]][what as usize % 3];
        let Ok(transaction) = transaction(&system, &stack, requests, &context()) else { return Ok(()) };
        let before = system.snapshot();
        // So many steps are done, in any permitted order; then one fails.
        let count = fail.index(transaction.steps.len() + 1);
        let mut done = Vec::new();
        for i in 0..count {
            let is_done = |id: u32| done.iter().any(|d: &davit::plan::PlannedStep| d.id == id);
            let wave = transaction.steps.iter().find(|s| !is_done(s.id)).unwrap().wave;
            let ready: Vec<_> = transaction
                .steps
                .iter()
                .filter(|s| s.wave == wave && !is_done(s.id) && s.after.iter().all(|id| is_done(*id)))
                .collect();
            let chosen = ready[picks[i % picks.len()] as usize % ready.len()];
            step::apply(&chosen.step, &mut system).unwrap();
            done.push(chosen.clone());
        }
        for s in rollback(&system, &done).unwrap_or_else(|v| panic!("{v:?}")) {
            step::apply(&s.step, &mut system).unwrap();
        }
        prop_assert_eq!(system.snapshot(), before);
        // The transaction was dropped: the stack is as before, and still fits the system.
        while !stack.is_empty() {
            let pop = davit::stack::transaction(&system, &stack, &[Op::UndoTop], &context()).unwrap();
            for s in &pop.steps {
                step::apply(&s.step, &mut system).unwrap();
            }
            stack.commit(pop);
        }
        prop_assert!(system.is_empty());
    }
}
