//! Laws of stacks: n pushes and n pops, pop_to, selective undo, net, squash.

use crate::generate::{self, ConfigGene, TypeGene, context, read};
use crate::names::name;
use crate::plain::Plain;
use crate::plans::{every_order, operator, show};
use crate::settings;
use davit::model::{Catalogue, ChangeKind, Configuration, Snapshot, Step};
use davit::plan::{PlanStage, PlannedStep, Refusal};
use davit::stack::{FrameId, Op, Planned, Requester, Scope, Stack, transaction};
use davit::system::{System, View, step};
use davit::time::Time;
use proptest::collection::vec;
use proptest::prelude::*;
use std::sync::Arc;

/// A system with its stack.
#[derive(Debug, Clone)]
pub struct Both {
    pub system: System,
    pub stack: Stack,
    pub types: Arc<Catalogue>,
}

impl Both {
    pub fn new(types: Arc<Catalogue>, bound: usize) -> Self {
        Self { system: System::new(types.clone()), stack: Stack::new(bound), types }
    }

    pub fn ask(&self, requests: &[Op<'_>]) -> Result<Planned, Refusal> {
        transaction(&self.system, &self.stack, requests, &context())
    }

    pub fn execute(&mut self, transaction: Planned) -> Vec<FrameId> {
        for s in transaction.steps.iter() {
            step::apply(&s.step, &mut self.system)
                .unwrap_or_else(|v| panic!("{}: {v:?} in {:?}", s.step, show(&transaction.steps)));
        }
        self.stack.commit(transaction)
    }

    pub fn make(&mut self, requests: &[Op<'_>]) -> Result<Vec<FrameId>, Refusal> {
        let transaction = self.ask(requests)?;
        Ok(self.execute(transaction))
    }

    /// Pushes what is accepted of `genes`, without groups, and answers the system before each, and what each did.
    fn grow(&mut self, genes: &[ConfigGene]) -> Vec<(Snapshot, Vec<Step>)> {
        let mut before = Vec::new();
        for gene in genes {
            let mut conf = read(gene, &self.system);
            conf.group = None;
            let now = self.system.snapshot();
            if self.make(&[operator(&conf)]).is_ok() {
                let frame = self.stack.top().expect("it was just pushed");
                before.push((now, record(&conf, frame.steps(), &self.system)));
            }
        }
        before
    }
}

/// What a configuration did, as plain writes: the steps it was expanded to, and its demands for values that were there
/// already, read from the configuration itself (a write counts as one). `system` is the one after it.
pub fn record(conf: &Configuration, steps: &[PlannedStep], system: &System) -> Vec<Step> {
    let done = |step: &Step| {
        steps.iter().any(|s| match (&s.step, step) {
            (Step::PropertySet { property: a, .. }, Step::PropertySet { property: b, .. }) => a == b,
            (Step::PortWrite { port: a, .. }, Step::PortWrite { port: b, .. }) => a == b,
            (Step::Create { component, .. }, step) => *component == step.component(),
            _ => false,
        })
    };
    let demands = conf.changes.iter().filter_map(|change| match &change.kind {
        ChangeKind::PropertySet { property, value } => {
            let declared = system.component(property.component)?.property(property.member)?.1;
            Some(Step::PropertySet { property: *property, value: declared.fit(value.clone()).unwrap() })
        }
        ChangeKind::PortWrite { port, value } => {
            let declared = system.component(port.component)?.port(port.member)?.1;
            Some(Step::PortWrite { port: *port, value: Some(value.clone().fit(&declared.ty).unwrap()) })
        }
        _ => None,
    });
    let kept: Vec<Step> = demands.filter(|step| !done(step)).collect();
    let post = steps.iter().filter(|s| s.stage != PlanStage::Post).count();
    let all = steps.iter().map(|s| s.step.clone());
    all.clone().take(post).chain(kept).chain(all.skip(post)).collect()
}

pub fn world(n: std::ops::Range<usize>) -> impl Strategy<Value = (Vec<TypeGene>, Vec<ConfigGene>)> {
    (generate::types(), generate::configs(n))
}

proptest! {
    #![proptest_config(settings())]

    /// n pushes then n pops is the identity, one by one or down to any depth at once, in every permitted order.
    #[test]
    fn stack((types, genes) in world(1..7), to in any::<prop::sample::Index>(), seed in any::<u64>()) {
        let mut both = Both::new(generate::catalogue(&types, false), 64);
        let before = both.grow(&genes);
        let mut jump = both.clone();
        let depth = to.index(before.len() + 1);
        let top = Plain::new(jump.system.snapshot(), &jump.types);
        let down = jump.ask(&[Op::UndoTo(depth)]).unwrap();
        let reached = every_order(&top, &down.steps, seed);
        jump.execute(down);
        prop_assert_eq!(&jump.system.snapshot(), &reached.is);
        prop_assert_eq!(jump.stack.len(), depth);
        if depth < before.len() {
            prop_assert_eq!(&reached.is, &before[depth].0);
        }
        for (earlier, _) in before.iter().rev() {
            both.make(&[Op::UndoTop]).unwrap();
            prop_assert_eq!(&both.system.snapshot(), earlier);
        }
        prop_assert!(both.stack.is_empty() && both.ask(&[Op::UndoTop]).is_err());
    }

    /// Popping a frame from the middle gives the system of the other frames' steps, or is refused; and the rest of the
    /// stack can still be popped.
    #[test]
    fn selective_undo((types, genes) in world(2..7), pick in any::<prop::sample::Index>()) {
        let mut both = Both::new(generate::catalogue(&types, false), 64);
        let records: Vec<Vec<Step>> = both.grow(&genes).into_iter().map(|(_, did)| did).collect();
        if both.stack.is_empty() {
            return Ok(());
        }
        let at = pick.index(records.len());
        let id = both.stack.frames()[at].id;
        let before = both.system.snapshot();
        let frames = both.stack.len();
        match both.make(&[Op::Undo(id)]) {
            Err(refusal) => {
                prop_assert!(at + 1 < frames, "the top can always be popped: {:?}", refusal);
                prop_assert_eq!(both.system.snapshot(), before);
                prop_assert_eq!(both.stack.len(), frames);
            }
            Ok(_) => {
                let mut plain = Plain::new(Snapshot::default(), &both.types);
                let others = records.iter().enumerate().filter(|(i, _)| *i != at).flat_map(|(_, r)| r);
                for step in others.clone() {
                    prop_assert!(plain.try_make(step), "{} cannot be replayed: {:?}", step, others.map(ToString::to_string).collect::<Vec<_>>());
                }
                prop_assert_eq!(&both.system.snapshot(), &plain.is);
                // What is left pops as if the frame had never been.
                while !both.stack.is_empty() {
                    both.make(&[Op::UndoTop]).unwrap();
                    let mut plain = Plain::new(Snapshot::default(), &both.types);
                    let left = records.iter().enumerate().filter(|(i, _)| *i != at).take(both.stack.len());
                    for step in left.flat_map(|(_, r)| r) {
                        prop_assert!(plain.try_make(step));
                    }
                    prop_assert_eq!(&both.system.snapshot(), &plain.is);
                }
            }
        }
    }

    /// An undo and a push as one transaction end in the same system, and in the same stack, as one after the other; with
    /// no more steps, and no write of what is there.
    #[test]
    fn net((types, genes) in world(2..7), pick in any::<prop::sample::Index>(), seed in any::<u64>()) {
        let mut one = Both::new(generate::catalogue(&types, false), 64);
        let (last, first) = genes.split_last().unwrap();
        one.grow(first);
        if one.stack.is_empty() {
            return Ok(());
        }
        let id = one.stack.frames()[pick.index(one.stack.len())].id;
        let mut two = one.clone();
        let start = Plain::new(one.system.snapshot(), &one.types);
        let Ok(undo) = two.ask(&[Op::Undo(id)]) else { return Ok(()) };
        let mut steps = undo.steps.len();
        two.execute(undo);
        let mut conf = read(last, &two.system);
        conf.group = None;
        let push = two.ask(&[operator(&conf)]);
        let net = one.ask(&[Op::Undo(id), operator(&conf)]);
        prop_assert_eq!(push.is_ok(), net.is_ok());
        let (Ok(push), Ok(net)) = (push, net) else { return Ok(()) };
        steps += push.steps.len();
        prop_assert!(net.steps.len() <= steps);
        let mut seen = std::collections::BTreeSet::new();
        for s in net.steps.iter() {
            if let Step::PropertySet { property, .. } = &s.step {
                let created = net.steps.iter().any(|o| matches!(o.step, Step::Create { component, .. } if component == property.component));
                prop_assert!(created || seen.insert(*property), "written twice: {:?}", show(&net.steps));
            }
        }
        let reached = every_order(&start, &net.steps, seed);
        one.execute(net);
        two.execute(push);
        prop_assert_eq!(&reached.is, &two.system.snapshot());
        while !two.stack.is_empty() {
            prop_assert_eq!(one.system.snapshot(), two.system.snapshot());
            one.make(&[Op::UndoTop]).unwrap();
            two.make(&[Op::UndoTop]).unwrap();
        }
        prop_assert!(one.stack.is_empty() && one.system.is_empty());
    }

    /// A squashed frame undoes to the same system as its parts: a stack of 2 and one of 64 part ways in nothing that can be
    /// seen.
    #[test]
    fn squash((types, genes) in world(3..9), bound in 2usize..4, keep in any::<u8>()) {
        let catalogue = generate::catalogue(&types, false);
        let mut small = Both::new(catalogue.clone(), bound);
        let mut large = Both::new(catalogue, 64);
        let mut before = Vec::new();
        for (i, gene) in genes.iter().enumerate() {
            // All of one file: what is squashed of several is for `piles`.
            let mut gene = gene.clone();
            gene.id %= 56;
            let mut conf = read(&gene, &large.system);
            conf.group = None;
            let now = large.system.snapshot();
            let active = i < 2 && keep & (1 << i) != 0;
            let request = [match operator(&conf) {
                Op::Push { configuration, requester, at, .. } => Op::Push { configuration, requester, at, scope: active.then_some(Scope(1)) },
                other => other,
            }];
            let Ok(pushed) = small.make(&request) else {
                // Refused as such, or nothing could be squashed.
                continue;
            };
            large.make(&request).unwrap();
            before.push((pushed[0], now));
            prop_assert!(small.stack.len() <= bound);
            prop_assert_eq!(small.system.snapshot(), large.system.snapshot());
        }
        prop_assert!(before.iter().zip(0..2).all(|((id, _), i)| keep & (1 << i) == 0 || i > 0 || small.stack.frame(*id).is_none_or(|f| !f.is_squashed())));
        while !small.stack.is_empty() {
            let frame = small.stack.top().unwrap().clone();
            prop_assert!(frame.floor.is_none());
            small.make(&[Op::UndoTop]).unwrap_or_else(|r| panic!("{r:?} {frame:?}"));
            let parts = frames_below(&small, &before);
            large.make(&[Op::UndoTo(parts)]).unwrap();
            prop_assert_eq!(small.system.snapshot(), large.system.snapshot());
        }
        prop_assert!(small.system.is_empty());
    }

    /// With frames of another requester between them, too: whatever is undone of a small stack, the same parts of a large one lead to the
    /// same system.
    #[test]
    fn squash_between((types, genes) in world(4..14), whose in vec(any::<bool>(), 14), bound in 2usize..4, undone in vec(any::<prop::sample::Index>(), 8)) {
        let catalogue = generate::catalogue(&types, false);
        let (mut small, mut large) = (Both::new(catalogue.clone(), bound), Both::new(catalogue, 64));
        let mut pushed: Vec<(FrameId, Requester)> = Vec::new();
        for (n, (gene, asked)) in genes.iter().zip(whose).enumerate() {
            let mut gene = gene.clone();
            gene.id %= 56;
            // Of what there is by then the values are set, mostly: that is what several may write.
            let sets = gene.changes.iter_mut().filter(|change| n > 2 && change[0] % 4 > 0);
            sets.for_each(|change| (change[0], change[1], change[3]) = (10, change[1] % 3, 1));
            let conf = Configuration { group: None, ..read(&gene, &large.system) };
            let requester = if asked { Requester::Coordinator(name("c")) } else { Requester::Operator };
            let push = [Op::Push { configuration: &conf, requester, at: Time(1), scope: None }];
            // Refused as such, or nothing could be squashed.
            let Ok(id) = small.make(&push) else { continue };
            prop_assert_eq!(&large.make(&push).unwrap(), &id);
            pushed.push((id[0], requester));
            prop_assert!(small.stack.len() <= 2 * bound);
        }
        for pick in undone {
            let frames = small.stack.frames();
            if frames.is_empty() {
                break;
            }
            let frame = &frames[pick.index(frames.len())];
            let (id, requester) = (frame.id, frame.requester);
            // Neighbours of one requester become one, which has the newest one's number.
            let older = frames.iter().filter(|frame| frame.requester == requester && frame.id < id).map(|frame| frame.id).max();
            let is_part = |(part, by): &(FrameId, Requester)| *by == requester && *part <= id && older.is_none_or(|older| *part > older);
            if let Err(refusal) = small.make(&[Op::Undo(id)]) {
                prop_assert!(small.stack.top().unwrap().id != id, "the newest one can be undone: {:?}", refusal);
                continue;
            }
            let parts: Vec<Op<'_>> = pushed.iter().rev().filter(|part| is_part(part)).map(|(part, _)| Op::Undo(*part)).collect();
            pushed.retain(|part| !is_part(part));
            large.make(&parts).map_err(|refusal| TestCaseError::fail(format!("{refusal:?}")))?;
            prop_assert_eq!(small.system.snapshot(), large.system.snapshot());
        }
    }
}

/// How many of the pushed frames the small stack still stands for: those up to its top.
fn frames_below(small: &Both, pushed: &[(FrameId, Snapshot)]) -> usize {
    small.stack.top().map_or(0, |top| pushed.iter().position(|(id, _)| *id == top.id).unwrap() + 1)
}
