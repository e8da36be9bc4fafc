//! A prepared switch does what planning its configuration anew would do: the same steps, system, frames, answer and
//! inverse, whatever happened since it was planned; its undo what the pop of its frame does.

use crate::generate::{self, ConfigGene, TypeGene, read};
use crate::settings;
use crate::stacks::Both;
use davit::model::{ChangeKind, Configuration, MemberRef, Policy, RunState, StateList, Step, Target};
use davit::plan::PlannedStep;
use davit::stack::{Op, Planned, Requester, ResolvedStep, Scope, Switch};
use davit::system::{System, View, step};
use davit::time::Time;
use proptest::prelude::*;
use proptest::test_runner::{TestCaseError, TestRunner};
use std::cell::Cell;

/// What happens, one byte each.
type Script = Vec<(u8, u8)>;

/// The same deployment twice, once with prepared switches and once without; and what was kept of each configuration.
struct Twins {
    plain: Both,
    fast: Both,
    confs: Vec<Configuration>,
    kept: Vec<Vec<Switch>>,
    /// Configuration and way of what went the prepared way last, if nothing has happened since.
    last: Option<(usize, bool)>,
}

/// How many applications were accepted, and how many of them, and of undos, went the prepared way.
#[derive(Default)]
struct Counts {
    applied: Cell<u32>,
    applied_fast: Cell<u32>,
    undone_fast: Cell<u32>,
}

fn one_more(count: &Cell<u32>) {
    count.set(count.get() + 1);
}

impl Twins {
    fn new(types: &[TypeGene], genes: &[ConfigGene], switches: &[ConfigGene]) -> Self {
        let mut plain = Both::new(generate::catalogue(types, false), 6);
        for gene in genes {
            let conf = read(gene, &plain.system);
            let _ = plain.make(&[op(&conf, 0)]);
        }
        let read = |gene: &ConfigGene| {
            let mut conf = read(gene, &plain.system);
            // One in four stays as it is and is most often no fixed switch.
            if !gene.id.is_multiple_of(4) {
                conf.changes
                    .retain(|c| matches!(c.kind, ChangeKind::PropertySet { .. } | ChangeKind::PortWrite { .. }));
                for list in [&mut conf.pre, &mut conf.post] {
                    *list = StateList::of(list.iter().filter(|e| e.target != Target::Default)).unwrap();
                }
            }
            conf
        };
        let confs: Vec<Configuration> = switches.iter().map(read).collect();
        let kept = confs.iter().map(|_| Vec::new()).collect();
        Self { fast: plain.clone(), plain, confs, kept, last: None }
    }

    /// Applies a configuration, the prepared way where that fits.
    fn apply(&mut self, which: usize, at: u8, counts: &Counts) -> Result<(), TestCaseError> {
        let conf = self.confs[which].clone();
        let planned = self.plain.ask(&[op(&conf, at)]);
        let Both { system, stack, .. } = &self.fast;
        let (requester, time, scope) = asked(at);
        let ready =
            |switch: &mut Switch| stack.takes(switch, requester) && switch.ready(system, requester, time, scope);
        let place = self.kept[which].iter_mut().position(ready);
        if self.last == Some((which, true)) {
            prop_assert!(place.is_some(), "nothing has changed since it was undone");
        }
        self.last = None;
        match place {
            Some(place) => {
                one_more(&counts.applied_fast);
                let planned = planned.map_err(|refusal| TestCaseError::fail(format!("refused: {refusal:?}")))?;
                let mut switch = self.kept[which].remove(place);
                self.carry_out(&switch, false, &planned)?;
                self.fast.stack.push_switch(&mut switch);
                self.kept[which].push(switch);
                self.plain.execute(planned);
                self.last = Some((which, false));
            }
            None => {
                let Ok(planned) = planned else { return Ok(()) };
                if let Some(switch) = Switch::new(&self.fast.system, &conf, &planned) {
                    prop_assert!(switch.fits(&self.fast.system, false), "it was planned for this system");
                    self.kept[which].push(switch);
                }
                self.fast.execute(planned.clone());
                self.plain.execute(planned);
            }
        }
        one_more(&counts.applied);
        self.same()
    }

    /// Undoes the top, the prepared way where that fits.
    fn undo(&mut self, counts: &Counts) -> Result<(), TestCaseError> {
        let Ok(planned) = self.plain.ask(&[Op::UndoTop]) else { return Ok(()) };
        let Both { system, stack, .. } = &self.fast;
        let fits = |switch: &Switch| stack.is_top(switch) && switch.fits(system, true);
        let which = self.kept.iter().position(|kept| kept.iter().any(fits));
        if let Some((applied, false)) = self.last {
            prop_assert_eq!(which, Some(applied), "nothing has changed since it was applied");
        }
        self.last = None;
        match which {
            Some(which) => {
                one_more(&counts.undone_fast);
                let switch = self.kept[which].iter().find(|switch| fits(switch)).expect("it was just seen").clone();
                self.carry_out(&switch, true, &planned)?;
                self.fast.stack.pop_switch();
                self.last = Some((which, true));
            }
            None => _ = self.fast.execute(planned.clone()),
        }
        self.plain.execute(planned);
        self.same()
    }

    /// Every step as the configurator does it, against the steps of the plan.
    fn carry_out(&mut self, switch: &Switch, undoing: bool, planned: &Planned) -> Result<(), TestCaseError> {
        let universe = switch.universe();
        let list = switch.list(undoing);
        let steps = |list: &[PlannedStep]| list.iter().map(|s| (s.step.clone(), s.undo.clone())).collect::<Vec<_>>();
        prop_assert_eq!(steps(&list), steps(&planned.steps));
        for (nth, listed) in list.iter().enumerate() {
            let ResolvedStep { step, place, index, value } = switch.step(nth, undoing).expect("as many as planned");
            prop_assert_eq!(step, &listed.step);
            // What goes to the platform is a step of the universe, with the value replaced.
            let mut sent = universe[index].clone();
            match (&mut sent, value) {
                (Step::PropertySet { value, .. }, Some(v)) => value.clone_from(v),
                (Step::PortWrite { value, .. }, Some(v)) => *value = Some(v.clone()),
                (_, None) => {}
                (step, Some(_)) => prop_assert!(false, "a value for {}", step),
            }
            prop_assert_eq!(&sent, step);
            let found = step::precondition(step, &self.fast.system);
            prop_assert_eq!(place.precondition(step, &self.fast.system), found.clone(), "{}", step);
            // The short look, where the value is known to be allowed.
            if !undoing || matches!(step, Step::State { .. }) {
                prop_assert_eq!(place.allows(step, &self.fast.system), found.is_empty(), "{}", step);
            }
            prop_assert!(found.is_empty(), "{} {:?}", step, found);
            let mut named = self.fast.system.clone();
            step::effect(step, &mut named);
            place.effect(step, &mut self.fast.system);
            prop_assert_eq!(self.fast.system.snapshot(), named.snapshot());
            // Done once more it may be refused: by the same words.
            let again = step::precondition(step, &self.fast.system);
            prop_assert_eq!(place.precondition(step, &self.fast.system), again.clone(), "{}", step);
            if matches!(step, Step::State { .. }) {
                prop_assert_eq!(place.allows(step, &self.fast.system), again.is_empty(), "{}", step);
            }
        }
        prop_assert!(switch.step(list.len(), undoing).is_none());
        Ok(())
    }

    /// Something else happens to both: what another configuration does, with a frame or without one; a connection to a port
    /// that is written; a fault; a frame that goes from the middle.
    fn disturb(&mut self, how: u8, which: u8, gene: &ConfigGene) {
        self.last = None;
        let conf = match how % 12 {
            0 | 1 | 5 | 6 => read(gene, &self.plain.system),
            _ => self.confs[which as usize % self.confs.len()].clone(),
        };
        let names: Vec<_> = self.plain.system.graph().node_weights().map(|node| node.name).collect();
        for both in [&mut self.plain, &mut self.fast] {
            match how % 12 {
                0..=3 => _ = both.make(&[op(&conf, how)]),
                4 => {
                    for change in &conf.changes {
                        if let ChangeKind::PortWrite { port, .. } = change.kind {
                            drive(port, &mut both.system);
                        }
                    }
                }
                5..=8 => {
                    let Ok(planned) = both.ask(&[op(&conf, how)]) else { continue };
                    for planned in planned.steps.iter().take(1 + which as usize % 3) {
                        let _ = step::apply(&planned.step, &mut both.system);
                    }
                }
                9 | 10 => {
                    let Some(name) = names.get(which as usize % names.len().max(1)) else { continue };
                    let faulted = both.system.component(*name).is_some_and(|n| n.state == RunState::Faulted);
                    let state = if faulted { RunState::Unconfigured } else { RunState::Faulted };
                    both.system.set_state(*name, state);
                }
                _ => {
                    let frames = both.stack.frames();
                    let Some(id) = frames.get(which as usize % frames.len().max(1)).map(|f| f.id) else { continue };
                    let _ = both.make(&[Op::Undo(id)]);
                }
            }
        }
    }

    fn same(&self) -> Result<(), TestCaseError> {
        prop_assert_eq!(self.fast.system.snapshot(), self.plain.system.snapshot());
        prop_assert_eq!(self.fast.stack.frames(), self.plain.stack.frames());
        Ok(())
    }
}

/// Connects the first out-port that may be connected to `to`, if there is one.
fn drive(to: MemberRef, system: &mut System) {
    let nodes = system.graph().node_weights();
    let from: Vec<_> = nodes.flat_map(|n| n.ty.ports.keys().map(|port| n.name.member(*port))).collect();
    let _ = from.into_iter().any(|from| step::apply(&Step::Connect { from, to, policy: Policy::Data }, system).is_ok());
}

/// Who asks, when and from which state.
fn asked(at: u8) -> (Requester, Time, Option<Scope>) {
    (Requester::Operator, Time(u64::from(at)), (at % 8 == 1).then_some(Scope(u32::from(at))))
}

fn op(configuration: &Configuration, at: u8) -> Op<'_> {
    let (requester, at, scope) = asked(at);
    Op::Push { configuration, requester, at, scope }
}

#[test]
fn prepared() {
    let counts = Counts::default();
    let script = prop::collection::vec(any::<(u8, u8)>(), 8..24);
    let cases = (crate::stacks::world(2..6), generate::configs(2..5), generate::configs(1..4), script);
    let law = |((types, genes), switches, others, script): ((Vec<_>, Vec<_>), Vec<_>, Vec<_>, Script)| {
        let mut twins = Twins::new(&types, &genes, &switches);
        for (what, which) in script {
            match what % 8 {
                0..=3 => twins.apply(which as usize % switches.len(), what, &counts)?,
                4..=6 => twins.undo(&counts)?,
                _ => twins.disturb(what / 8, which, &others[which as usize % others.len()]),
            }
        }
        Ok(())
    };
    TestRunner::new(settings()).run(&cases, law).unwrap_or_else(|error| panic!("{error}"));
    let (applied, fast) = (counts.applied.get(), counts.applied_fast.get());
    assert!(fast > applied / 10, "{fast} of {applied} applications went the prepared way");
    assert!(counts.undone_fast.get() > fast / 10, "{} of {fast} undone that way", counts.undone_fast.get());
}
