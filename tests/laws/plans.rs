//! Laws of single plans: soundness, order, inverse.

use crate::generate::{self, ConfigGene, TypeGene, context, read};
use crate::plain::Plain;
use crate::settings;
use davit::model::{MemberRef, Snapshot};
use davit::plan::{PlannedStep, irreversible, plan, plan_on};
use davit::stack::{Op, Requester, Stack, transaction};
use davit::system::{Access, Overlay, Reversibility, Slot, View, step};
use davit::time::Time;
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Beyond so many steps in one wave orders are sampled.
const FREE: usize = 7;

/// Walks every permitted order of `steps` from `start` (sampled, with `seed`, where there are too many): every step is
/// allowed where it comes, and all orders end in the same system, which is the answer.
///
/// All orders at once: the system after a set of steps must not depend on how it was reached, so it is enough to look at
/// every reachable set and every step that may come next.
pub fn every_order(start: &Plain, steps: &[PlannedStep], seed: u64) -> Plain {
    let mut now = start.clone();
    let mut at = 0;
    while at < steps.len() {
        let wave = steps[at].wave;
        let end = at + steps[at..].iter().take_while(|s| s.wave == wave).count();
        now = one_wave(&now, &steps[at..end], at as u32, seed);
        at = end;
    }
    now
}

fn one_wave(start: &Plain, steps: &[PlannedStep], base: u32, seed: u64) -> Plain {
    let before: Vec<Vec<usize>> = steps
        .iter()
        .enumerate()
        .map(|(i, s)| {
            assert_eq!(s.id, base + i as u32, "numbers are places");
            s.after
                .iter()
                .filter(|id| **id >= base)
                .map(|id| (*id - base) as usize)
                .inspect(|p| assert!(*p < i))
                .collect()
        })
        .collect();
    if steps.len() <= FREE {
        let mut sets: BTreeMap<u32, Plain> = BTreeMap::from([(0, start.clone())]);
        let full = (1u32 << steps.len()) - 1;
        // Sets with more steps have greater numbers than their subsets, so each is complete when it is reached.
        while let Some((set, now)) = sets.pop_first() {
            if set == full {
                return now;
            }
            for (i, planned) in steps.iter().enumerate() {
                let ready = set & (1 << i) == 0 && before[i].iter().all(|p| set & (1 << p) != 0);
                if !ready {
                    continue;
                }
                let mut next = now.clone();
                assert!(
                    next.try_make(&planned.step),
                    "{} is not allowed after {set:b} of {:?}",
                    planned.step,
                    show(steps)
                );
                let with = set | (1 << i);
                match sets.get(&with) {
                    Some(other) => assert_eq!(other.is, next.is, "orders differ: {:?}", show(steps)),
                    None => _ = sets.insert(with, next),
                }
            }
        }
        panic!("the steps wait for each other: {:?}", show(steps));
    }
    let mut result: Option<Plain> = None;
    let mut random = seed | 1;
    for _ in 0..4 {
        let mut now = start.clone();
        let mut done = vec![false; steps.len()];
        for _ in 0..steps.len() {
            let ready: Vec<usize> =
                (0..steps.len()).filter(|i| !done[*i] && before[*i].iter().all(|p| done[*p])).collect();
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            let i = ready[(random % ready.len() as u64) as usize];
            assert!(now.try_make(&steps[i].step), "{} is not allowed in an order of {:?}", steps[i].step, show(steps));
            done[i] = true;
        }
        match &result {
            Some(other) => assert_eq!(other.is, now.is, "orders differ: {:?}", show(steps)),
            None => result = Some(now),
        }
    }
    result.unwrap()
}

pub fn show(steps: &[PlannedStep]) -> Vec<String> {
    steps.iter().map(|s| format!("{}: {} after {:?} wave {}", s.id, s.step, s.after, s.wave)).collect()
}

fn case() -> impl Strategy<Value = (Vec<TypeGene>, Vec<ConfigGene>, ConfigGene, u64)> {
    (generate::types(), generate::configs(1..5), generate::config(), any::<u64>())
}

/// The slots that two observations differ in; of a component that came or went, its existence.
fn changed(was: &Snapshot, is: &Snapshot) -> Vec<Slot> {
    let mut slots = Vec::new();
    let names: BTreeSet<_> = was.components.keys().chain(is.components.keys()).collect();
    for name in names {
        let (Some(a), Some(b)) = (was.components.get(name), is.components.get(name)) else {
            slots.push(Slot::Component(*name));
            continue;
        };
        if a.state != b.state {
            slots.push(Slot::State(*name));
        }
        let differ = b.properties.iter().filter(|(property, value)| a.properties.get(property) != Some(value));
        slots.extend(differ.map(|(property, _)| Slot::Property(name.member(*property))));
    }
    let links: BTreeSet<_> = was.connections.keys().chain(is.connections.keys()).collect();
    for link in links.into_iter().filter(|link| was.connections.get(link) != is.connections.get(link)) {
        slots.extend([Slot::Link(link.0, link.1), Slot::Drive(link.1)]);
    }
    let there =
        |port: &&MemberRef| was.components.contains_key(&port.component) && is.components.contains_key(&port.component);
    let ports: BTreeSet<_> = was.ports.keys().chain(is.ports.keys()).collect();
    let ports = ports.into_iter().filter(there).filter(|port| was.ports.get(port) != is.ports.get(port));
    slots.extend(ports.map(|port| Slot::Port(*port)));
    slots
}

pub fn operator(configuration: &davit::model::Configuration) -> Op<'_> {
    Op::Push { configuration, requester: Requester::Operator, at: Time(1), scope: None }
}

proptest! {
    #![proptest_config(settings())]

    /// Soundness, model part: in list order every step of an accepted plan is allowed by an independent picture, which
    /// agrees with the system after every step.
    #[test]
    fn soundness((types, genes, last, _) in case()) {
        let catalogue = generate::catalogue(&types, true);
        let mut system = davit::system::System::new(catalogue.clone());
        let mut plain = Plain::new(system.snapshot(), &catalogue);
        for gene in genes.iter().chain([&last]) {
            let conf = read(gene, &system);
            let before = system.clone();
            let mut overlay = Overlay::new(&before);
            let Ok(plan) = plan_on(&mut overlay, &conf, &context()) else { continue };
            let planned = plan.steps.clone();
            for s in &planned {
                prop_assert!(plain.allows(&s.step), "{} is not allowed", s.step);
                prop_assert!(step::precondition(&s.step, &system).is_empty());
                // What the planner foresaw to be overwritten is what is overwritten.
                let call = match &s.undo {
                    davit::system::Undo::One(davit::model::Step::Operation(call)) => Some(call),
                    _ => None,
                };
                prop_assert_eq!(&step::inverse(&s.step, call, &system), &s.undo);
                let touches = step::touches(&s.step, call, &system);
                let was = system.snapshot();
                plain.make(&s.step);
                step::effect(&s.step, &mut system);
                // Every slot that it changed is among those it touches, and no other component is.
                for slot in changed(&was, &system.snapshot()) {
                    let told = touches.iter().any(|t| t.slot == slot && t.access != Access::Need);
                    prop_assert!(told, "{} changes {slot}, and touches {touches:?}", s.step);
                    prop_assert!(plan.footprint.writes(slot), "{} changes {slot}", s.step);
                }
                let of = step::components(&s.step);
                let elsewhere = call.map(|call| call.operation.component);
                for touch in &touches {
                    let (a, b) = touch.slot.components();
                    // Who needs the same for itself is to stay as it is.
                    let rival = touch.access == Access::Need && matches!(touch.slot, Slot::State(_));
                    let own = |c| of.contains(c) || elsewhere == Some(*c) || rival;
                    prop_assert!([a, b].iter().all(own), "{}: {touch:?}", s.step);
                }
                prop_assert_eq!(&plain.is, &system.snapshot());
            }
            // The overlay that was planned on shows the same, also in what is counted and not observed.
            prop_assert_eq!(overlay.snapshot(), system.snapshot());
            for (name, component) in &plain.is.components {
                let degree = plain.is.connections.keys().filter(|(a, b)| a.component == *name || b.component == *name).count();
                prop_assert_eq!(overlay.component(*name).unwrap().degree as usize, degree);
                prop_assert_eq!(system.component(*name).unwrap().degree as usize, degree);
                for port in catalogue.get(component.ty).unwrap().ports.keys() {
                    let port = name.member(*port);
                    let links = plain.is.connections.iter().filter(|((_, to), _)| *to == port);
                    let data = links.clone().filter(|(_, policy)| **policy == davit::model::Policy::Data).count();
                    for driven in [overlay.driven(port), system.driven(port)] {
                        prop_assert_eq!((driven.links as usize, driven.data as usize), (links.clone().count(), data));
                    }
                }
            }
        }
        let again = davit::system::System::from_snapshot(&plain.is, catalogue).unwrap();
        prop_assert_eq!(again.snapshot(), plain.is);
    }

    /// Order: every permitted order of a plan ends in the same system; so does every permitted order of its undo.
    #[test]
    fn order((types, genes, last, seed) in case()) {
        let catalogue = generate::catalogue(&types, true);
        let (mut system, _) = generate::grow(catalogue.clone(), &genes);
        let before = Plain::new(system.snapshot(), &catalogue);
        let conf = read(&last, &system);
        let mut stack = Stack::new(8);
        let Ok(push) = transaction(&system, &stack, &[operator(&conf)], &context()) else { return Ok(()) };
        let after = every_order(&before, &push.steps, seed);
        for s in push.steps.iter() {
            step::apply(&s.step, &mut system).unwrap();
        }
        prop_assert_eq!(&system.snapshot(), &after.is);
        // Irreversible steps come last in their wave, except for what depends on them.
        for (i, s) in push.steps.iter().enumerate().filter(|(_, s)| s.reversibility == Reversibility::Irreversible) {
            let mut follows = vec![s.id];
            for later in push.steps[i + 1..].iter().filter(|l| l.wave == s.wave && l.stage == davit::plan::PlanStage::Changes) {
                if later.after.iter().any(|id| follows.contains(id)) {
                    follows.push(later.id);
                }
                let irreversible = later.reversibility == Reversibility::Irreversible;
                prop_assert!(irreversible || follows.contains(&later.id), "{:?}", show(&push.steps));
            }
        }
        stack.commit(push);
        if let Ok(pop) = transaction(&system, &stack, &[Op::UndoTop], &context()) {
            prop_assert_eq!(every_order(&after, &pop.steps, seed).is, before.is);
        }
    }

    /// The order in which changes are written does not matter: the same configuration shuffled is accepted alike and ends
    /// in the same system.
    #[test]
    fn written_order((types, genes, last, seed) in case()) {
        let (system, _) = generate::grow(generate::catalogue(&types, true), &genes);
        let conf = read(&last, &system);
        let mut other = conf.clone();
        let n = other.changes.len();
        for i in (1..n).rev() {
            other.changes.swap(i, (seed >> i) as usize % (i + 1));
        }
        match (plan(&system, &conf, &context()), plan(&system, &other, &context())) {
            (Ok(a), Ok(b)) => {
                let (mut left, mut right) = (system.clone(), system.clone());
                generate::run(&mut left, &a);
                generate::run(&mut right, &b);
                prop_assert_eq!(left.snapshot(), right.snapshot());
                prop_assert_eq!(a.steps.len(), b.steps.len());
            }
            (Err(a), Err(b)) => {
                let codes = |r: &davit::plan::Refusal| {
                    let mut codes: Vec<_> = r.findings.iter().map(|f| f.code).collect();
                    codes.sort();
                    codes.dedup();
                    // Which clash is told beside a change that is wrong by itself depends on which is met first.
                    if codes.len() > 1 {
                        codes.retain(|c| *c != davit::model::codes::CLASH);
                    }
                    codes
                };
                prop_assert_eq!(codes(&a), codes(&b), "{:?}\n{:?}", a, b);
            }
            (a, b) => prop_assert!(false, "accepted in one order only: {:?} {:?}", a.err(), b.err()),
        }
    }

    /// Inverse: apply, then undo, is the identity on the observable system.
    #[test]
    fn inverse((types, genes, last, _) in case()) {
        let (mut system, _) = generate::grow(generate::catalogue(&types, false), &genes);
        let before = system.snapshot();
        let conf = read(&last, &system);
        let Ok(plan) = plan(&system, &conf, &context()) else { return Ok(()) };
        prop_assert!(irreversible(&plan.steps).is_none());
        generate::run(&mut system, &plan);
        for undo in plan.steps.iter().rev().flat_map(|step| step.undo.steps()) {
            let allowed = step::apply(undo, &mut system);
            prop_assert!(allowed.is_ok(), "{}: {:?}", undo, allowed);
        }
        prop_assert_eq!(system.snapshot(), before);
    }
}
