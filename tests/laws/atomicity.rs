//! Atomicity of what the configurator carries out: with a failure at any step, in any permitted order, the transaction's own
//! machine ends whole, or with the system as it was, or names exactly what is left. Undos before a failing push stand.

use crate::generate::{self, ConfigGene, context, read};
use crate::plans::operator;
use crate::settings;
use davit::model::{
    Catalogue, Cause, Change, ChangeKind, ComponentName, ComponentType, ConfigId, Configuration, Execution, Origin,
    Outcome, Step, TypeName,
};
use davit::plan::PlannedStep;
use davit::stack::{Op, Planned, Stack, transaction};
use davit::system::{System, step};
use davit::time::Time;
use davit::transaction::{Can, Input, Limit, PartEnd, Poll, Spec, Touched, Transaction};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
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
    /// What comes in a turn of its own, one right after the other.
    pub comes: Option<(usize, Vec<Input>)>,
    /// What another transaction does in a turn.
    pub beside: Option<(usize, Step)>,
    /// Nobody knows whether the steps that fail were done.
    pub unknown: bool,
    /// Nobody answers who is asked how things are.
    pub blind: bool,
    /// What is told who asks about values.
    pub tells: Option<bool>,
}

/// What all but the last of these configurations lead to, those that are refused left out; and the last.
pub fn in_force(types: Arc<Catalogue>, genes: &[ConfigGene]) -> (System, Stack, &ConfigGene) {
    let (mut system, mut stack) = (System::new(types), Stack::new(8));
    let (last, first) = genes.split_last().expect("some configurations");
    for gene in first {
        let conf = read(gene, &system);
        let Ok(push) = transaction(&system, &stack, &[operator(&conf)], &context()) else { continue };
        push.steps.iter().for_each(|s| step::apply(&s.step, &mut system).unwrap());
        stack.commit(push);
    }
    (system, stack, last)
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
            beside: None,
            unknown: false,
            blind: false,
            tells: Some(true),
        }
    }

    /// Whether a step is possible on the platform, which is not what the model takes it for.
    fn fits(&self, step: &Step) -> bool {
        step::precondition(step, &self.platform).is_empty()
    }

    pub fn drive(&mut self, planned: Planned) -> Vec<PartEnd> {
        let spec = Spec {
            limits: [Limit::patient(Duration::from_secs(1))].into_iter().collect(),
            best_effort: false,
            asked_back: false,
        };
        let mut machine = Transaction::new(planned, spec);
        let mut out: Vec<u32> = Vec::new();
        let mut released = true;
        let blocking = |_: &Step| Execution::Blocking;
        for turn in 0usize.. {
            assert!(turn < 10_000, "it ends");
            for input in self.comes.take_if(|(at, _)| *at == turn).into_iter().flat_map(|(_, inputs)| inputs) {
                released &= !matches!(input, Input::Interrupt(_));
                machine.on(input, &mut self.model);
            }
            if let Some((_, step)) = self.beside.take_if(|(at, _)| *at == turn) {
                step::apply(&step, &mut self.model).expect("what is nobody else's");
                step::apply(&step, &mut self.platform).expect("what is nobody else's");
            }
            let room = out.len() < 3;
            let can = Can { execution: &blocking, batches: &|_| false, room, quarantined: &[], busy: &[] };
            match machine.poll(&mut self.model, Time::default(), &can) {
                Poll::Begin(steps) => out.extend(steps),
                Poll::Cancel(_) => {}
                Poll::Ask(question) => machine.on(Input::Told { question, is: self.tells }, &mut self.model),
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
                    let at = self.picks[self.asked % self.picks.len()] as usize % out.len();
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
        let (system, mut stack, last) = in_force(generate::catalogue(&types, false), &genes);
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

/// A configuration that creates plain components.
fn creates(id: &str, components: &[&str]) -> Configuration {
    let change = |component: &&str| {
        let (component, ty) = (ComponentName::new(component).unwrap(), TypeName::new("Node").unwrap());
        let kind = ChangeKind::Create { component, ty, activity: None, properties: BTreeMap::new() };
        Change { kind, origin: Origin::NONE }
    };
    Configuration { changes: components.iter().map(change).collect(), ..Configuration::new(ConfigId::new(id).unwrap()) }
}

/// A system with a component, and what undoes that and creates two others.
fn undo_and_push() -> (System, Planned) {
    let mut catalogue = Catalogue::new();
    assert!(catalogue.insert(ComponentType::new("Node", "Nothing.")).is_none());
    let mut system = System::new(Arc::new(catalogue));
    let mut stack = Stack::new(8);
    let push = transaction(&system, &stack, &[operator(&creates("first", &["a"]))], &context()).unwrap();
    push.steps.iter().for_each(|s| step::apply(&s.step, &mut system).unwrap());
    stack.commit(push);
    let second = creates("second", &["b", "c"]);
    let planned = transaction(&system, &stack, &[Op::UndoTop, operator(&second)], &context()).unwrap();
    (system, planned)
}

#[test]
fn what_was_read_before_an_interruption_is_no_news_after_it() {
    let (system, planned) = undo_and_push();
    let mut came = 0;
    for (fail, at) in (1..6).flat_map(|fail| (0..20).map(move |at| (fail, at))) {
        let mut bench = Bench::new(&system, vec![fail], vec![0]);
        bench.comes = Some((at, vec![Input::Interrupt(ConfigId::new("halt").unwrap())]));
        let ends = bench.drive(planned.clone());
        assert_eq!(bench.model.snapshot(), bench.platform.snapshot(), "failure {fail}, interrupted at {at}: {ends:?}");
        came += usize::from(bench.comes.is_none());
    }
    assert!(came > 20, "{came}");
}

#[test]
fn what_another_transaction_does_meanwhile_is_not_taken_back() {
    let (system, planned) = undo_and_push();
    let third = creates("third", &["z"]);
    let push = transaction(&system, &Stack::new(8), &[operator(&third)], &context()).unwrap();
    let other = &push.steps[0].step;
    let mut came = 0;
    for (fails, at) in [vec![2], vec![3], vec![2, 4], vec![3, 5]].iter().flat_map(|f| (0..20).map(move |at| (f, at))) {
        let mut alone = Bench::new(&system, fails.clone(), vec![0]);
        let ends = alone.drive(planned.clone());
        let mut bench = Bench::new(&system, fails.clone(), vec![0]);
        bench.beside = Some((at, other.clone()));
        let beside = bench.drive(planned.clone());
        if bench.beside.is_some() {
            continue;
        }
        came += 1;
        let endings = |ends: &[PartEnd]| ends.iter().map(PartEnd::ending).collect::<Vec<_>>();
        assert_eq!(endings(&ends), endings(&beside), "failures {fails:?}, beside at {at}: {beside:?}");
        let mut there = alone.model;
        step::apply(other, &mut there).unwrap();
        assert_eq!(there.snapshot(), bench.model.snapshot(), "failures {fails:?}, beside at {at}: {beside:?}");
    }
    assert!(came > 20, "{came}");
}
