//! Atomicity of what the configurator carries out: with a failure at any step, in any permitted order, the transaction's own
//! machine ends whole, or with the system as it was, or names exactly what is left. Undos before a failing push stand.

use crate::generate::{self, context, read};
use crate::plans::operator;
use crate::settings;
use davit::model::{Cause, Execution, Outcome, Step};
use davit::plan::PlannedStep;
use davit::stack::{Op, Planned, Stack, transaction};
use davit::system::{System, step};
use davit::time::Time;
use davit::transaction::{Can, Input, PartEnd, Poll, Spec, Touched, Transaction};
use proptest::prelude::*;
use std::time::Duration;

/// A machine, the model it works on, and a platform that does what it is told but for the steps it fails.
pub struct Bench {
    pub model: System,
    pub platform: System,
    asked: usize,
    fails: Vec<usize>,
    picks: Vec<u8>,
    /// Steps back that moved something.
    pub moved_back: Vec<Step>,
    /// How many steps were taken back.
    pub back: usize,
    /// What comes in a turn of its own.
    pub comes: Option<(usize, Input)>,
    /// Nobody knows whether the steps that fail were done.
    pub unknown: bool,
    /// Nobody answers who is asked how things are.
    pub blind: bool,
}

impl Bench {
    pub fn new(system: &System, fails: Vec<usize>, picks: Vec<u8>) -> Self {
        Self {
            model: system.clone(),
            platform: system.clone(),
            asked: 0,
            fails,
            picks,
            moved_back: Vec::new(),
            back: 0,
            comes: None,
            unknown: false,
            blind: false,
        }
    }

    /// Whether a step is possible on the platform, which is not what the model takes it for.
    fn fits(&self, step: &Step) -> bool {
        step::precondition(step, &self.platform).is_empty()
    }

    pub fn drive(&mut self, planned: Planned) -> Vec<PartEnd> {
        let spec = Spec {
            until: Time::NEVER,
            timeout: Duration::ZERO,
            patience: Duration::from_secs(1),
            best_effort: false,
            asked_back: false,
        };
        let mut machine = Transaction::new(planned, spec);
        let mut out: Vec<u32> = Vec::new();
        let mut released = true;
        let blocking = |_: &Step| Execution::Blocking;
        for turn in 0usize.. {
            assert!(turn < 10_000, "it ends");
            if let Some((_, input)) = self.comes.take_if(|(at, _)| *at == turn) {
                released = !matches!(input, Input::Interrupt(_));
                machine.on(input, &mut self.model);
            }
            let can = Can { execution: &blocking, room: out.len() < 3, quarantined: &[], busy: &[] };
            match machine.poll(&mut self.model, Time::default(), &can) {
                Poll::Begin(steps) => out.extend(steps),
                Poll::Cancel(_) => {}
                Poll::Ask(question) => machine.on(Input::Told { question, is: Some(true) }, &mut self.model),
                Poll::Read(components) => {
                    let seen = self.platform.snapshot_some(&components);
                    machine.on(Input::Seen((!self.blind).then_some(seen)), &mut self.model);
                }
                Poll::Wait if out.is_empty() && !released => {
                    released = true;
                    machine.on(Input::Release(Touched::default()), &mut self.model);
                }
                Poll::Wait => {
                    assert!(!out.is_empty(), "it waits for something");
                    let at = self.picks[turn % self.picks.len()] as usize % out.len();
                    let number = out.remove(at);
                    self.asked += 1;
                    let fails = self.fails.contains(&self.asked);
                    let outcome = if fails && self.unknown {
                        Outcome::Unknown(Cause::Timeout)
                    } else if fails || self.unknown && !self.fits(&machine.step(number).step) {
                        Outcome::NotDone(Cause::Failed("as told".to_owned()))
                    } else {
                        let step = &machine.step(number).step;
                        if machine.is_going_back() {
                            self.back += 1;
                            self.moved_back.extend(step::moves(step, &self.platform).then(|| step.clone()));
                        }
                        step::apply(step, &mut self.platform).expect("soundness");
                        Outcome::Done(None)
                    };
                    machine.on(Input::Ended { step: number, outcome }, &mut self.model);
                }
                Poll::Over => return machine.end().parts,
            }
        }
        unreachable!("it ends")
    }
}

proptest! {
    #![proptest_config(settings())]

    #[test]
    fn atomicity(
        types in generate::types(),
        genes in generate::configs(2..6),
        what in any::<u8>(),
        fail in 1usize..12,
        again in prop::option::of(1usize..6),
        picks in prop::collection::vec(any::<u8>(), 24),
    ) {
        let mut system = System::new(generate::catalogue(&types, false));
        let mut stack = Stack::new(8);
        let (last, first) = genes.split_last().unwrap();
        for gene in first {
            let conf = read(gene, &system);
            let Ok(push) = transaction(&system, &stack, &[operator(&conf)], &context()) else { continue };
            for s in push.steps.iter() {
                step::apply(&s.step, &mut system).unwrap();
            }
            stack.commit(push);
        }
        let conf = read(last, &system);
        let ops = [Op::UndoTop, operator(&conf)];
        // A push, an undo, or the net of both.
        let ops = [&ops[..1], &ops[1..], &ops[..]][what as usize % 3];
        let Ok(planned) = transaction(&system, &stack, ops, &context()) else { return Ok(()) };
        let edits: Vec<_> = planned.parts.iter().map(|part| part.edits.clone()).collect();
        // The system after the first so many operations alone.
        let after: Vec<System> = (0..=ops.len())
            .map(|n| {
                let mut after = system.clone();
                if n > 0 && let Ok(some) = transaction(&system, &stack, &ops[..n], &context()) {
                    some.steps.iter().for_each(|s| step::apply(&s.step, &mut after).unwrap());
                }
                after
            })
            .collect();
        let fails = std::iter::once(fail).chain(again.map(|later| fail + later)).collect();
        let told = |steps: &[PlannedStep]| steps.iter().map(|s| s.step.to_string()).collect::<Vec<_>>();
        let ranges: Vec<_> = planned.parts.iter().map(|part| part.range.clone()).collect();
        let shown = format!("steps {:?}, net of {:?} in parts {ranges:?}", told(&planned.steps), told(&planned.whole));
        let mut bench = Bench::new(&system, fails, picks);
        let ends = bench.drive(planned);
        prop_assert_eq!(bench.model.snapshot(), bench.platform.snapshot(), "the model is the platform");
        let stands = ends.iter().take_while(|end| matches!(end, PartEnd::Done)).count();
        match ends.get(stands) {
            None | Some(PartEnd::Failed(_)) => {
                prop_assert_eq!(bench.model.snapshot(), after[stands].snapshot(), "those before stand, the rest is not there: {}", shown);
                prop_assert!(ends[stands..].iter().skip(1).all(|end| matches!(end, PartEnd::Anew)));
            }
            Some(PartEnd::Broken(broken)) => {
                // What is left is exact: with it done again, the system before becomes the one there is.
                let mut there = after[stands].clone();
                for step in broken.residual.left.iter().chain(&broken.residual.difference) {
                    let _ = step::apply(step, &mut there);
                }
                prop_assert_eq!(there.snapshot(), bench.model.snapshot(), "{}", broken.residual);
                return Ok(());
            }
            Some(other) => panic!("{other:?}"),
        }
        // The stack still fits the system.
        stack.apply(&edits[..stands], &[]);
        let mut system = bench.model;
        while !stack.is_empty() {
            let pop = transaction(&system, &stack, &[Op::UndoTop], &context()).unwrap();
            for s in pop.steps.iter() {
                step::apply(&s.step, &mut system).unwrap();
            }
            stack.commit(pop);
        }
        prop_assert!(system.is_empty());
    }
}
