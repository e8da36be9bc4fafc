//! A prepared switch does what the plan of its configuration does, and its undo what the pop of its frame does.

use crate::generate::{self, read};
use crate::plans::operator;
use crate::settings;
use crate::stacks::Both;
use davit::model::{ChangeKind, StateList, Step, Target};
use davit::plan::prepare::Switch;
use davit::stack::{Op, Requester};
use davit::time::Time;
use proptest::prelude::*;

proptest! {
    #![proptest_config(settings())]

    #[test]
    fn prepared((types, genes) in crate::stacks::world(2..6), switches in generate::configs(2..5), between in any::<u8>()) {
        let mut plain = Both::new(generate::catalogue(&types, false), 64);
        for gene in &genes {
            let conf = read(gene, &plain.system);
            let _ = plain.make(&[operator(&conf)]);
        }
        let mut fast = plain.clone();
        let mut confs = Vec::new();
        for gene in &switches {
            let mut conf = read(gene, &plain.system);
            conf.group = None;
            conf.changes.retain(|c| matches!(c.kind, ChangeKind::PropertySet { .. } | ChangeKind::PortWrite { .. }));
            for list in [&mut conf.pre, &mut conf.post] {
                *list = StateList::of(list.iter().filter(|e| e.target != Target::Default)).unwrap();
            }
            confs.push(conf);
        }
        let mut prepared: Vec<Option<Switch>> = confs.iter().map(|c| Switch::new(&mut fast.system, c)).collect();
        let act = |fast: &mut Both, switch: &Switch| -> Result<(), TestCaseError> {
            for act in switch.acts().to_vec() {
                if let Some((at, value)) = switch.sends(act) {
                    // What goes to the platform is a step of the universe, with the value replaced.
                    let mut step = switch.universe()[at].clone();
                    match (&mut step, value) {
                        (Step::PropertySet { value, .. }, Some(v)) => *value = v.clone(),
                        (Step::PortWrite { value, .. }, Some(v)) => *value = Some(v.clone()),
                        (_, None) => {}
                        (step, Some(_)) => prop_assert!(false, "a value for {}", step),
                    }
                    let found = davit::system::step::precondition(&step, &fast.system);
                    prop_assert!(found.is_empty(), "{} {:?}", step, found);
                    let mut check = fast.system.clone();
                    davit::system::step::effect(&step, &mut check);
                    switch.done(act, &mut fast.system);
                    prop_assert_eq!(fast.system.snapshot(), check.snapshot());
                }
            }
            Ok(())
        };
        // The same switches again and again: frames are used again, on top of each other.
        for round in 0..3u8 {
            let mut pushed = 0;
            for (conf, switch) in confs.iter().zip(&mut prepared) {
                let Some(switch) = switch else { continue };
                let planned = plain.make(&[operator(conf)]);
                prop_assert_eq!(switch.ready(&fast.system), planned.is_ok(), "{:?} {:?}", conf, planned);
                if planned.is_err() {
                    continue;
                }
                act(&mut fast, switch)?;
                fast.stack.push_switch(switch, Requester::Operator, Time(1), None);
                pushed += 1;
                prop_assert_eq!(fast.system.snapshot(), plain.system.snapshot());
                let (a, b) = (fast.stack.top().unwrap(), plain.stack.top().unwrap());
                let steps = |f: &davit::stack::Frame| f.steps().iter().map(|s| (s.step.clone(), s.undo.clone(), s.stage)).collect::<Vec<_>>();
                prop_assert_eq!(steps(a), steps(b));
                let values = |f: &davit::stack::Frame| {
                    let mut v: Vec<_> = f.saved.iter().map(|s| (s.slot, s.value.clone(), s.step)).collect();
                    v.sort_by_key(|(slot, ..)| *slot);
                    v
                };
                prop_assert_eq!(values(a), values(b));
            }
            // Popped by the switch or by an ordinary transaction, as it comes; from the middle as well.
            if between & (1 << round) != 0 && pushed > 1 {
                let at = plain.stack.len() - 2;
                let ids = (plain.stack.frames()[at].id, fast.stack.frames()[at].id);
                let done = (plain.make(&[Op::Undo(ids.0)]).is_ok(), fast.make(&[Op::Undo(ids.1)]).is_ok());
                prop_assert_eq!(done.0, done.1);
                pushed -= usize::from(done.0);
            }
            for _ in 0..pushed {
                plain.make(&[Op::UndoTop]).unwrap();
                let id = fast.stack.top().unwrap().configuration;
                // Several may have one name; the one whose acts these are takes it back.
                let at = (0..confs.len()).rev().find(|i| {
                    confs[*i].id == id && prepared[*i].as_mut().is_some_and(|s| {
                        let top = fast.stack.top().unwrap();
                        s.ready_undo(&fast.system, &top.acts, &top.saved)
                    })
                });
                match at {
                    Some(at) if between & 128 == 0 && confs.iter().filter(|c| c.id == id).count() == 1 => {
                        act(&mut fast, prepared[at].as_ref().unwrap())?;
                        fast.stack.pop_switch();
                    }
                    _ => _ = fast.make(&[Op::UndoTop]).unwrap(),
                }
                prop_assert_eq!(fast.system.snapshot(), plain.system.snapshot());
            }
        }
    }
}
