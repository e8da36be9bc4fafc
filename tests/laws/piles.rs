//! Laws of a stack that subsystems share: each has its own of it, and what others did to one that has gone is void.

use crate::generate::{self, ConfigGene, TypeGene, config, read_all};
use crate::names::{id, ident, name};
use crate::settings;
use crate::stacks::Both;
use davit::model::{Call, Catalogue, Change, ChangeKind, ComponentName, Configuration, MemberRef, Snapshot, StateList};
use davit::model::{StateEntry, Target};
use davit::plan::PlannedStep;
use davit::stack::{Frame, FrameId, Inverse, Op, Requester, components};
use davit::system::View;
use davit::time::Time;
use proptest::collection::vec;
use proptest::prelude::*;
use std::sync::Arc;

/// What nobody else needs is what these laws are about.
pub fn catalogue(genes: &[TypeGene]) -> Arc<Catalogue> {
    let mut catalogue = Catalogue::new();
    for ty in generate::catalogue(genes, false).iter() {
        let mut ty = (**ty).clone();
        ty.exclusive.clear();
        catalogue.insert(ty);
    }
    Arc::new(catalogue)
}

fn each_member(kind: &mut ChangeKind, of: &impl Fn(ComponentName) -> ComponentName) {
    let member = |m: &mut MemberRef| m.component = of(m.component);
    match kind {
        ChangeKind::Create { component, .. }
        | ChangeKind::Destroy { component }
        | ChangeKind::Replace { component, .. } => *component = of(*component),
        ChangeKind::Connect { from, to, .. } | ChangeKind::Disconnect { from, to } => {
            [from, to].into_iter().for_each(member)
        }
        ChangeKind::PropertySet { property, .. } => member(property),
        ChangeKind::PortWrite { port, .. } => member(port),
        ChangeKind::OperationCall { call, undo } => {
            let calls: [Option<&mut Call>; 2] = [Some(call), undo.as_mut()];
            calls.into_iter().flatten().for_each(|call| member(&mut call.operation));
        }
    }
}

/// The configuration as one of the file of the subsystem of that path.
fn under(path: &str, n: usize, mut conf: Configuration) -> Configuration {
    let of = |component: ComponentName| match component.local(ident(path)) {
        Some(_) => component,
        None => name(&format!("{path}/{}", component.as_str().replace('/', "_"))),
    };
    conf.changes.iter_mut().for_each(|change| each_member(&mut change.kind, &of));
    let entry = |entry: StateEntry| match entry.target {
        Target::Component(component) => StateEntry { target: Target::Component(of(component)), ..entry },
        Target::Default => entry,
    };
    let list = |list: &StateList| StateList::of(list.iter().map(entry)).unwrap();
    (conf.pre, conf.post) = (list(&conf.pre), list(&conf.post));
    Configuration { id: id(&format!("{path}/k{n}")), group: None, ..conf }
}

fn is_in(component: ComponentName, path: &str) -> bool {
    component.local(ident(path)).is_some()
}

/// What there is in a subsystem, and what is connected inside of it.
fn part(both: &Both, path: &str) -> Snapshot {
    let mut is = both.system.snapshot();
    is.components.retain(|component, _| is_in(*component, path));
    is.ports.retain(|port, _| is_in(port.component, path));
    is.connections.retain(|(from, to), _| is_in(from.component, path) && is_in(to.component, path));
    is
}

fn push(configuration: &Configuration, requester: Requester) -> Op<'_> {
    Op::Push { configuration, requester, at: Time(1), scope: None }
}

fn inside<'b>(both: &'b Both, path: &'b str) -> impl Iterator<Item = &'b Arc<Frame>> {
    let whole = move |frame: &&Arc<Frame>| {
        let about = components(&frame.footprint);
        frame.configuration.local(ident(path)).is_some() && about.iter().all(|of| is_in(*of, path))
    };
    both.stack.frames().iter().filter(whole)
}

/// The newest frame of a requester.
fn newest(both: &Both, by: Requester) -> Option<FrameId> {
    both.stack.frames().iter().rev().find(|frame| frame.requester == by).map(|frame| frame.id)
}

/// What is of two frames that are one but for their numbers, and for the order of steps that have none: the configurations, what they are
/// about, and what takes them back.
fn content(frame: &Frame) -> (Vec<String>, Vec<String>, Vec<String>) {
    let sorted = |mut texts: Vec<String>| {
        texts.sort();
        texts
    };
    let ids = frame.parts.iter().map(|part| part.configuration.to_string()).chain([frame.configuration.to_string()]);
    let about = frame.footprint.touches.iter().map(|touch| format!("{touch:?}")).collect();
    let back = match &frame.inverse {
        Inverse::Steps(steps) => steps.iter().flat_map(|done| done.undo.steps()).map(ToString::to_string).collect(),
        Inverse::List(items) => items.iter().map(|item| item.step.to_string()).collect(),
    };
    (ids.collect(), sorted(about), sorted(back))
}

fn coordinator(path: &str) -> Requester {
    Requester::Coordinator(name(path))
}

/// The system and the stack of a whole, and of a part of it.
struct Beside {
    all: Both,
    /// `t`, and what is done to it.
    other: Both,
    /// `s` alone.
    own: Both,
    /// Frames of the parent in the one and the other, the oldest first.
    parents: Vec<(FrameId, Option<FrameId>)>,
}

impl Beside {
    /// Somebody of the parent's file changes what is there of both.
    fn parent(&mut self, n: usize, gene: &ConfigGene, by: Requester) {
        let mut conf = read_all(gene, &self.all.system);
        (conf.id, conf.group, conf.pre, conf.post) =
            (id(&format!("p{n}")), None, StateList::default(), StateList::default());
        let there = |of: ComponentName| self.all.system.component(of).is_some();
        conf.changes.retain(|change| {
            let makes = matches!(
                change.kind,
                ChangeKind::Create { .. } | ChangeKind::Destroy { .. } | ChangeKind::Replace { .. }
            );
            // Where a call of one is taken back by one of another, that is void with either.
            let elsewhere = |call: &Call, undo: &Option<Call>| {
                undo.as_ref()
                    .is_some_and(|undo| is_in(undo.operation.component, "s") != is_in(call.operation.component, "s"))
            };
            if matches!(&change.kind, ChangeKind::OperationCall { call, undo } if elsewhere(call, undo)) {
                return false;
            }
            // What connects components of one subsystem is its own matter.
            let across = match change.kind {
                ChangeKind::Connect { from, to, .. } | ChangeKind::Disconnect { from, to } => {
                    is_in(from.component, "s") != is_in(to.component, "s")
                }
                _ => true,
            };
            !makes && across && change.kind.components().into_iter().all(there)
        });
        let of_other = |change: &&Change| change.kind.components().into_iter().all(|of| is_in(of, "t"));
        let less = Configuration { changes: conf.changes.iter().filter(of_other).cloned().collect(), ..conf.clone() };
        let Ok(planned) = self.all.ask(&[push(&conf, by)]) else { return };
        let planned_less = self.other.ask(&[push(&less, by)]);
        // A connection may be what hinders a write, or lets it be.
        let Ok(planned_less) = planned_less else { return };
        let pushed = self.all.execute(planned)[0];
        let beside = self.other.execute(planned_less)[0];
        let matters = !less.changes.is_empty();
        self.parents.push((pushed, matters.then_some(beside)));
    }

    /// Undoes frames of the parent, the newest first, until there are `enough`; the part of `t` is as beside. False: one stays, since `s` is
    /// still there and has done something on top of it.
    fn undo_parents(&mut self, gone: bool, enough: impl Fn(&Self) -> bool) -> Result<bool, TestCaseError> {
        let mut at = self.parents.len();
        let mut all = true;
        while at > 0 && !enough(self) {
            at -= 1;
            let (one, beside) = self.parents[at];
            let (own, there) = (part(&self.all, "s"), self.all.stack.frame(one).is_some());
            let undo = self.all.ask(&[Op::Undo(one)]);
            if undo.is_err() && there && !gone {
                all = false;
                continue;
            }
            self.parents.remove(at);
            if let Some(beside) = beside {
                let left = self.other.stack.frame(beside).is_some();
                prop_assert!(there || !left, "of it something is left");
                if left {
                    let other = self.other.make(&[Op::Undo(beside)]);
                    prop_assert_eq!(undo.is_ok(), other.is_ok(), "{:?} {:?}", undo, other);
                }
            }
            if let Ok(undo) = undo {
                self.all.execute(undo);
            }
            prop_assert_eq!(part(&self.all, "t"), part(&self.other, "t"));
            prop_assert!(!gone || part(&self.all, "s") == own);
        }
        Ok(all)
    }
}

/// Whether something of `s` is connected to something else.
fn is_held(both: &Both) -> bool {
    let mut held = false;
    both.system.for_each_link(&mut |from, to, _| held |= is_in(from.component, "s") != is_in(to.component, "s"));
    held
}

proptest! {
    #![proptest_config(settings())]

    /// Whatever operators do in two subsystems, the frames of each, squashed ones included, are as if the other were not there, and so
    /// is what undoing them leads to.
    #[test]
    fn apart(types in generate::types(), genes in vec((any::<bool>(), config()), 3..12), bound in 2usize..4, undone in vec(any::<bool>(), 12)) {
        let catalogue = catalogue(&types);
        let mut all = Both::new(catalogue.clone(), bound);
        let mut alone = ["s", "t"].map(|path| (path, Both::new(catalogue.clone(), bound)));
        for (n, (second, gene)) in genes.iter().enumerate() {
            let (path, own) = &mut alone[usize::from(*second)];
            let conf = under(path, n, read_all(gene, &own.system));
            let [apart, together] = [&*own, &all].map(|both| both.ask(&[push(&conf, Requester::Operator)]));
            prop_assert_eq!(apart.is_ok(), together.is_ok(), "{:?} {:?}", apart, together);
            let (Ok(apart), Ok(together)) = (apart, together) else { continue };
            own.execute(apart);
            all.execute(together);
            prop_assert!(all.stack.len() <= 2 * bound);
        }
        for second in undone {
            for (path, own) in &alone {
                let [apart, together] = [own, &all].map(|both| inside(both, path).map(|frame| content(frame)).collect::<Vec<_>>());
                prop_assert_eq!(apart, together);
                prop_assert_eq!(part(own, path), part(&all, path));
            }
            let (path, own) = &mut alone[usize::from(second)];
            let [apart, together] = [&*own, &all].map(|both| inside(both, path).last().map(|frame| frame.id));
            let (Some(apart), Some(together)) = (apart, together) else { continue };
            let [apart, together] = [(&*own, apart), (&all, together)].map(|(both, id)| both.ask(&[Op::Undo(id)]).unwrap());
            own.execute(apart);
            all.execute(together);
        }
    }

    /// A parent's frames do not keep a subsystem from leaving, but for what is connected. What they did to it is void then: its next life begins as
    /// the first did, and to undo the rest is what it would be had they never touched it.
    #[test]
    fn void(types in generate::types(), genes in vec((0u8..4, config()), 3..14), asked in any::<bool>()) {
        let catalogue = catalogue(&types);
        let both = || Both::new(catalogue.clone(), 64);
        let mut beside = Beside { all: both(), other: both(), own: both(), parents: Vec::new() };
        let by = if asked { coordinator("p") } else { Requester::Operator };
        let mut life = Vec::new();
        for (n, (whose, gene)) in genes.iter().enumerate() {
            let (path, apart) = match whose {
                0 => ("s", &mut beside.own),
                1 => ("t", &mut beside.other),
                _ => {
                    beside.parent(n, gene, by);
                    continue;
                }
            };
            let conf = under(path, n, read_all(gene, &apart.system));
            // What a parent is connected to stays what it is.
            let replaces = conf.changes.iter().any(|change| matches!(change.kind, ChangeKind::Replace { .. }));
            if replaces && is_held(&beside.all) {
                continue;
            }
            let op = [push(&conf, coordinator(path))];
            let Ok(planned) = apart.ask(&op) else { continue };
            // What the parent connected, or made of a value, may be in its way.
            let Ok(together) = beside.all.ask(&op) else { continue };
            beside.all.execute(together);
            apart.execute(planned);
            if path == "s" {
                life.push(conf);
            }
        }
        // It leaves.
        while let Some(id) = newest(&beside.all, coordinator("s")) {
            let undo = beside.all.ask(&[Op::Undo(id)]);
            if undo.is_err() {
                prop_assert!(is_held(&beside.all), "{:?}", undo);
                let found = undo.unwrap_err().findings;
                prop_assert!(found.iter().all(|finding| finding.code.0 == "stack::shared"), "{:?}", found);
                let all = beside.undo_parents(false, |beside| beside.all.ask(&[Op::Undo(id)]).is_ok())?;
                if beside.all.ask(&[Op::Undo(id)]).is_err() {
                    prop_assert!(!all);
                    return Ok(());
                }
                continue;
            }
            beside.all.execute(undo.unwrap());
        }
        prop_assert!(part(&beside.all, "s").components.is_empty());
        beside.all.stack.discard_in(ident("s"), &[]);
        for frame in beside.all.stack.frames() {
            prop_assert!(components(&frame.footprint).iter().all(|of| !is_in(*of, "s")), "{:?}", frame);
        }
        // It comes again, among what is left of the parent's.
        let mut again = both();
        for conf in &life {
            let op = [push(conf, coordinator("s"))];
            let (first, next) = (again.ask(&op), beside.all.ask(&op));
            prop_assert_eq!(first.is_ok(), next.is_ok(), "{:?} {:?}", first, next);
            let (Ok(first), Ok(next)) = (first, next) else { break };
            let texts = |steps: &[PlannedStep]| {
                let mut texts: Vec<String> = steps.iter().map(|planned| planned.step.to_string()).collect();
                texts.sort();
                texts
            };
            prop_assert_eq!(texts(&first.steps), texts(&next.steps));
            again.execute(first);
            beside.all.execute(next);
        }
        beside.undo_parents(true, |_| false)?;
        prop_assert_eq!(part(&beside.all, "s"), part(&again, "s"));
    }
}
