//! What the laws leave to examples: groups, floors, hand-over, the bound, failed components.

use super::{
    FrameId, Group, Op, Planned, PushesOf, Request, Requester, Rules, Scope, Stack, Switch, World, take_up, transaction,
};
use crate::model::*;
use crate::plan::{PlanContext, Refusal};
use crate::system::{System, View, step};
use crate::time::Time;
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;
use std::sync::Arc;

mod pushes;
mod squash;
mod void;

fn ident(name: &str) -> Ident {
    Ident::new(name).unwrap()
}

fn member(text: &str) -> MemberRef {
    MemberRef::new(text).unwrap()
}

fn types() -> Arc<Catalogue> {
    let mut ty = ComponentType::new("t.Arm", "an arm");
    for (name, tunable) in [("gain", Tunable::Always), ("mass", Tunable::Stopped)] {
        let property = PropertyType::new(ValueType::Float, tunable);
        let property = PropertyType { default: Some(Value::Float(0.0)), ..property };
        ty.properties.insert(ident(name), property);
    }
    for (name, effect) in
        [("open", Effect::Undo(ident("close"))), ("close", Effect::None), ("weld", Effect::Irreversible)]
    {
        let operation = OperationType { moves: name == "close", ..OperationType::new(effect) };
        ty.operations.insert(ident(name), operation);
    }
    let mut bus = ComponentType::new("t.Bus", "has the bus for itself");
    bus.exclusive.push(Resource::parse("bus").unwrap());
    let mut catalogue = Catalogue::new();
    catalogue.insert(ty);
    catalogue.insert(bus);
    let mut line = ComponentType::new("t.Line", "has the line of its number for itself");
    let number = PropertyType::new(ValueType::Int, Tunable::Unconfigured);
    line.properties.insert(ident("number"), PropertyType { default: Some(Value::Int(0)), ..number });
    line.exclusive.push(Resource::parse("line{number}").unwrap());
    catalogue.insert(line);
    Arc::new(catalogue)
}

struct Bench {
    system: System,
    stack: Stack,
}

fn conf(
    id: &str,
    group: Option<&str>,
    pre: &[(&str, Wanted)],
    changes: Vec<ChangeKind>,
    post: &[(&str, Wanted)],
) -> Configuration {
    let mut conf = Configuration::new(ConfigId::new(if id.is_empty() { "_" } else { id }).unwrap());
    conf.group = group.map(ident);
    let entry = |(name, state): &(&str, Wanted)| StateEntry {
        target: Target::Component(ComponentName::new(name).unwrap()),
        state: *state,
        origin: Origin::NONE,
    };
    conf.pre = StateList::of(pre.iter().map(entry)).unwrap();
    conf.changes = changes.into_iter().map(|kind| Change { kind, origin: Origin::NONE }).collect();
    conf.post = StateList::of(post.iter().map(entry)).unwrap();
    conf
}

fn set(property: &str, value: f64) -> ChangeKind {
    ChangeKind::PropertySet { property: member(property), value: Value::Float(value) }
}

fn call(operation: &str) -> ChangeKind {
    ChangeKind::OperationCall { call: Call { operation: member(operation), args: vec![] }, undo: None }
}

fn create(name: &str, ty: &str) -> ChangeKind {
    ChangeKind::Create {
        component: ComponentName::new(name).unwrap(),
        ty: TypeName::new(ty).unwrap(),
        activity: None,
        properties: BTreeMap::new(),
    }
}

fn push(configuration: &Configuration) -> Op<'_> {
    push_by(configuration, Requester::Operator)
}

fn push_by(configuration: &Configuration, requester: Requester) -> Op<'_> {
    Op::Push { configuration, requester, at: Time(0), scope: None }
}

/// What becomes of requests of one batch.
fn taken_up(
    world: &World,
    requests: &[Request],
    configurations: &[Configuration],
    joined: bool,
    pushes: Option<PushesOf<'_>>,
) -> Group {
    let rules = Rules {
        configurations: &configurations.iter().map(|configuration| (configuration.id, configuration.clone())).collect(),
        context: &PlanContext::default(),
        at: Time(0),
        held: &[],
        places: &[],
        operator: &FxHashSet::default(),
        joined,
        placed: false,
        rested: false,
        led: None,
        pushes,
    };
    take_up(world, requests, &rules)
}

impl Bench {
    /// `A` and `B` exist, running, and the stack is empty.
    fn new(bound: usize) -> Self {
        Self { system: System::new(types()), stack: Stack::new(bound) }.up()
    }

    fn up(mut self) -> Self {
        let running = [("A", Wanted::Running), ("B", Wanted::Running)];
        let up = conf("up", None, &[], vec![create("A", "t.Arm"), create("B", "t.Arm")], &running);
        self.ok(&[push(&up)]);
        self.stack.make_permanent(Requester::Operator);
        self
    }

    fn ask(&self, requests: &[Op<'_>]) -> Result<Planned, Refusal> {
        transaction(&self.system, &self.stack, requests, &PlanContext::default())
    }

    /// Executes, and answers the steps and the frames pushed.
    fn ok(&mut self, requests: &[Op<'_>]) -> (Vec<String>, Vec<FrameId>) {
        let transaction = self.ask(requests).unwrap_or_else(|r| panic!("{r:?}"));
        let steps = transaction.steps.iter().map(|s| s.step.to_string()).collect();
        for s in transaction.steps.iter() {
            step::apply(&s.step, &mut self.system).unwrap();
        }
        (steps, self.stack.commit(transaction))
    }

    fn codes(&self, requests: &[Op<'_>]) -> Vec<&'static str> {
        self.ask(requests).expect_err("it is refused").findings.iter().map(|f| f.code.0).collect()
    }

    fn value(&self, property: &str) -> f64 {
        let m = member(property);
        self.system.component(m.component).unwrap().value(m.member).unwrap().as_f64().unwrap()
    }
}

#[test]
fn alternatives_never_pass_through_what_was_before_both() {
    let mut bench = Bench::new(64);
    let stopped = [("A", Wanted::Stopped)];
    let running = [("A", Wanted::Running)];
    let eight = conf("eight", Some("dof"), &stopped, vec![set("A.mass", 8.0), set("A.gain", 1.0)], &running);
    let five = conf("five", Some("dof"), &stopped, vec![set("A.mass", 5.0)], &running);
    assert_eq!(bench.ok(&[push(&eight)]).0.len(), 4);
    let (steps, _) = bench.ok(&[push(&five)]);
    assert_eq!(steps, ["property_set A.gain = 0.0", "stop A", "property_set A.mass = 5.0", "start A"]);
    assert_eq!(bench.stack.len(), 1);
    // The new frame remembers what was before both.
    bench.ok(&[Op::UndoTop]);
    assert_eq!((bench.value("A.mass"), bench.value("A.gain")), (0.0, 0.0));
    // The same one again changes nothing at all.
    bench.ok(&[push(&eight)]);
    assert!(bench.ok(&[push(&eight)]).0.is_empty());
    assert_eq!(bench.stack.len(), 1);
}

#[test]
fn a_group_that_cannot_be_replaced_refuses_and_changes_nothing() {
    let mut bench = Bench::new(64);
    let one = conf("one", Some("g"), &[], vec![call("A.open")], &[]);
    let above = conf("above", None, &[], vec![call("A.open")], &[]);
    let two = conf("two", Some("g"), &[], vec![], &[]);
    bench.ok(&[push(&one)]);
    bench.ok(&[push(&above)]);
    let before = bench.system.revision();
    assert_eq!(bench.codes(&[push(&two)]), ["stack::group", "stack::shared"]);
    assert_eq!((bench.system.revision(), bench.stack.len()), (before, 2));
    // In one batch the frame above goes first.
    bench.ok(&[Op::UndoTop, push(&two)]);
    assert_eq!(bench.stack.len(), 1);
}

#[test]
fn undo_does_not_pass_a_floor() {
    let mut bench = Bench::new(64);
    bench.ok(&[push(&conf("below", None, &[], vec![set("A.gain", 1.0)], &[]))]);
    let below = bench.stack.top().unwrap().id;
    bench.ok(&[push(&conf("weld", None, &[], vec![call("A.weld")], &[]))]);
    let above = conf("above", None, &[], vec![set("B.gain", 1.0)], &[]);
    bench.ok(&[push(&above)]);
    assert_eq!(bench.codes(&[Op::UndoTo(0)]), ["stack::floor"]);
    assert_eq!(bench.codes(&[Op::Undo(below)]), ["stack::floor"]);
    bench.ok(&[Op::UndoTop]);
    assert_eq!(bench.codes(&[Op::UndoTop]), ["stack::floor"]);
    bench.stack.make_permanent(Requester::Operator);
    assert_eq!(bench.codes(&[Op::UndoTop]), ["stack::floor"]);
    assert!(bench.stack.is_buried(ConfigId::new("weld").unwrap(), None));
    bench.stack.discard();
    assert_eq!(bench.codes(&[Op::UndoTop]), ["stack::empty"]);
    assert_eq!(bench.codes(&[Op::Undo(below)]), ["stack::no_frame"]);
}

#[test]
fn values_are_handed_over_and_what_blocks_is_named() {
    let mut bench = Bench::new(64);
    let first = bench.ok(&[push(&conf("first", None, &[], vec![set("A.gain", 1.0)], &[]))]).1[0];
    bench.ok(&[push(&conf("second", None, &[], vec![set("A.gain", 2.0)], &[]))]);
    assert!(bench.ok(&[Op::Undo(first)]).0.is_empty(), "nothing is sent");
    assert_eq!(bench.value("A.gain"), 2.0);
    bench.ok(&[Op::UndoTop]);
    assert_eq!(bench.value("A.gain"), 0.0, "what was before the first");
    // A demand that was true already counts as a write, and takes the value over.
    let first = bench.ok(&[push(&conf("first", None, &[], vec![set("A.gain", 1.0)], &[]))]).1[0];
    bench.ok(&[push(&conf("second", None, &[], vec![set("A.gain", 1.0)], &[]))]);
    bench.ok(&[Op::Undo(first)]);
    assert_eq!(bench.value("A.gain"), 1.0);
    assert_eq!(bench.ok(&[Op::UndoTop]).0, ["property_set A.gain = 0.0"]);
    // A state that a frame above demanded by name blocks, though no step was needed.
    let stop = bench.ok(&[push(&conf("stop", None, &[("A", Wanted::Stopped)], vec![], &[]))]).1[0];
    bench.ok(&[push(&conf("needs", None, &[("A", Wanted::Stopped)], vec![], &[]))]);
    let refusal = bench.ask(&[Op::Undo(stop)]).unwrap_err();
    assert_eq!(refusal.findings[0].message, "`stop` cannot be undone before `needs`, which needs the run state of `A`");
}

#[test]
fn a_failed_component_is_taken_down_without_being_started() {
    let mut bench = Bench::new(64);
    let a = ComponentName::new("C").unwrap();
    let create = ChangeKind::Create {
        component: a,
        ty: TypeName::new("t.Arm").unwrap(),
        activity: None,
        properties: BTreeMap::new(),
    };
    bench.ok(&[push(&conf("more", None, &[], vec![create], &[("C", Wanted::Running)]))]);
    bench.system.set_state(a, RunState::Faulted);
    assert_eq!(bench.ok(&[Op::UndoTop]).0, ["destroy C"]);
    // Where it stays, it goes from the fault to where the inverse wants it.
    bench.ok(&[push(&conf("stop", None, &[("A", Wanted::Stopped)], vec![set("A.mass", 3.0)], &[]))]);
    bench.system.set_state(ComponentName::new("A").unwrap(), RunState::Faulted);
    let (steps, _) = bench.ok(&[Op::UndoTop]);
    assert_eq!(steps, ["cleanup A", "property_set A.mass = 0.0", "configure A", "start A"]);
}

/// Whether what is planned for `configuration`, behind `before`, is kept to be carried out again.
fn kept(bench: &Bench, before: &[Op<'_>], configuration: &Configuration) -> bool {
    let ops: Vec<Op<'_>> = before.iter().copied().chain([push(configuration)]).collect();
    let planned = bench.ask(&ops).unwrap_or_else(|r| panic!("{r:?}"));
    Switch::new(&bench.system, configuration, &planned).is_some()
}

#[test]
fn only_fixed_switches_of_what_does_not_move_are_prepared() {
    let mut bench = Bench::new(64);
    let switch =
        |id| conf(id, Some("mode"), &[("A", Wanted::Stopped)], vec![set("A.mass", 1.0)], &[("A", Wanted::Running)]);
    assert!(kept(&bench, &[], &switch("s")));
    let mut default = switch("s");
    default.post.push(StateEntry { target: Target::Default, state: Wanted::Running, origin: Origin::NONE }).unwrap();
    assert!(!kept(&bench, &[], &default), "what `_default` means depends on every component");
    for act in [call("A.close"), ChangeKind::Destroy { component: ComponentName::new("B").unwrap() }] {
        assert!(!kept(&bench, &[], &conf("s", None, &[], vec![set("A.gain", 1.0), act], &[])));
    }
    assert!(!kept(&bench, &[push(&switch("r"))], &switch("s")), "what another request did was not there");
    bench.ok(&[push(&switch("r"))]);
    assert!(!kept(&bench, &[], &switch("s")), "the frame of its group goes for it");
    assert!(kept(&bench, &[], &Configuration { group: None, ..switch("s") }));
    let planned = bench.ask(&[push(&switch("s"))]).unwrap();
    bench.ok(&[Op::UndoTop]);
    assert!(Switch::new(&bench.system, &switch("s"), &planned).is_none(), "it was planned for another system");
    bench.system.set_state(ComponentName::new("A").unwrap(), RunState::Faulted);
    assert!(
        !kept(&bench, &[], &conf("s", None, &[], vec![set("A.gain", 1.0)], &[])),
        "a fault is to be undone its own way"
    );
}

#[test]
fn what_moves_is_not_prepared() {
    let mut ty = types().get(TypeName::new("t.Arm").unwrap()).unwrap().as_ref().clone();
    ty.moves = Moves { start: true, stop: false };
    let mut catalogue = Catalogue::new();
    catalogue.insert(ty);
    let bench = Bench { system: System::new(Arc::new(catalogue)), stack: Stack::new(64) }.up();
    let entry = |state| [("A", state)];
    assert!(!kept(&bench, &[], &conf("s", None, &entry(Wanted::Stopped), vec![], &entry(Wanted::Running))));
    assert!(!kept(&bench, &[], &conf("s", None, &entry(Wanted::Stopped), vec![], &[])), "its undo starts it");
    assert!(kept(&bench, &[], &conf("s", None, &[], vec![set("A.gain", 1.0)], &entry(Wanted::Running))));
}

#[test]
fn an_undo_by_leaving_a_state_that_is_refused_leaves_a_frame_like_others() {
    let mut bench = Bench::new(64);
    let (low, high) = (conf("low", None, &[], vec![set("A.mass", 1.0)], &[]), conf("high", None, &[], vec![], &[]));
    let low = Configuration { pre: conf("", None, &[("A", Wanted::Stopped)], vec![], &[]).pre, ..low };
    let high =
        Configuration { changes: vec![], post: conf("", None, &[], vec![], &[("A", Wanted::Running)]).post, ..high };
    let scope = Some(Scope(7));
    bench.ok(&[Op::Push { configuration: &low, requester: Requester::Operator, at: Time(0), scope }]);
    bench.ok(&[push(&high)]);
    let ask = Ask::UndoOf(ConfigId::new("low").unwrap());
    let undo = Request { scope, ..Request::new(RequestId(1), ask, Requester::Operator) };
    let world = World::new(bench.system.clone(), bench.stack.clone());
    let group = taken_up(&world, &[undo], &[low, high], false, None);
    assert_eq!(group.told[0].verdict, Some(Verdict::UndoFailed), "`high` needs it stopped");
    let frame = bench.stack.frames()[0].id;
    assert_eq!(group.stay[..], [(0, frame)]);
}

#[test]
fn an_undo_by_leaving_a_state_is_about_the_visit_that_was_left() {
    // A safe configuration of the next visit goes before the undo of the first one.
    let mut bench = Bench::new(64);
    let mass = |value| conf("mass", None, &[], vec![set("A.gain", value)], &[]);
    let (first, later) = (mass(1.0), mass(2.0));
    let scope = Some(Scope(7));
    for configuration in [&first, &later] {
        bench.ok(&[Op::Push { configuration, requester: Requester::Operator, at: Time(0), scope }]);
    }
    let ids: Vec<FrameId> = bench.stack.frames().iter().map(|frame| frame.id).collect();
    let ask = Ask::UndoOf(ConfigId::new("mass").unwrap());
    let undo = Request { scope, ..Request::new(RequestId(1), ask, Requester::Operator) };
    let mut world = World::new(bench.system.clone(), bench.stack.clone());
    let planned = taken_up(&world, &[undo], &[later], false, None).planned.expect("nothing is in its way");
    assert_eq!(planned.parts[0].edits.pops.iter().map(|(id, _)| *id).collect::<Vec<_>>(), ids[..1]);
    assert_eq!(world.let_go_by(&undo), Some(ids[0]));
    assert_eq!(world.left_with(&undo, &ids[..1]), Some(ids[1]), "the first is being undone: this is about the next");
    world.stays(&undo, &[]);
    assert_eq!(world.let_go_by(&undo), Some(ids[1]), "what stays of the first is a frame like others");
}

#[test]
fn what_has_given_up_a_request_goes_with_its_answer() {
    let configuration = |id: &str| {
        let mut configuration = conf(id, None, &[], Vec::new(), &[]);
        configuration.changes.clear();
        configuration
    };
    let all = [configuration("a"), configuration("b"), configuration("c")];
    let claims = super::claims::Claims::new(all.iter(), &Catalogue::new());
    let request = |ask| Request::new(RequestId(0), ask, Requester::Operator);
    let (apply, undo) = (|n: usize| request(Ask::Apply(all[n].id)), |n: usize| request(Ask::UndoOf(all[n].id)));
    let under_way = || {
        let mut desk = super::Desk::default();
        let _ = desk.arrive((0..3).map(apply).collect(), |_| false, &claims);
        let number = desk.begin_next(&claims, |_| None, &[]).expect("nothing is in its way").number;
        assert_eq!([1, 2, 1].map(|n| desk.give_up(number, undo(n))), [Some(1), Some(2), Some(1)]);
        (desk, number)
    };
    // Done before they came: they begin next, in the order of what they take back.
    let (mut desk, number) = under_way();
    let gone = desk.all_answered(number, (0..3).map(|place| (place, Some(Verdict::Ok))));
    assert!(gone.iter().all(|gone| gone.undone.is_empty()) && gone[0].over && !gone[2].over);
    let waiting: Vec<_> = desk.waiting().map(|batch| batch.requests[0].ask).collect();
    assert_eq!(waiting, [undo(1).ask, undo(1).ask, undo(2).ask]);
    // One of them was cancelled, and what had given it up is answered with it; the places of the others move up.
    let (mut desk, number) = under_way();
    let gone = desk.answered(number, 1, Some(Verdict::Cancelled));
    assert_eq!(gone.undone[..], [(undo(1), Verdict::Undone), (undo(1), Verdict::Undone)]);
    assert_eq!(desk.active(number).unwrap().given_up[0].place, 1);
    let gone = desk.answered(number, 1, Some(Verdict::Broken));
    assert_eq!((gone.undone[..].to_vec(), gone.over), (vec![(undo(2), Verdict::UndoBroken)], false));
    assert!(desk.answered(number, 0, Some(Verdict::Ok)).over && desk.is_empty());
}

/// Whoever remembers a frame must never find another one under its number.
#[test]
fn numbers_of_frames_are_never_used_again() {
    let mut bench = Bench::new(8);
    let conf = conf("two", None, &[], vec![set("A.gain", 2.0)], &[]);
    let first = bench.ok(&[push(&conf)]).1[0];
    bench.stack.discard();
    let second = bench.ok(&[push(&conf)]).1[0];
    bench.ok(&[Op::Undo(second)]);
    let third = bench.ok(&[push(&conf)]).1[0];
    assert!(first < second && second < third && bench.stack.next() > third, "{first:?} {second:?} {third:?}");
}

#[test]
fn what_stands_in_the_way_goes_along_where_a_safe_configuration_keeps_what_would_move() {
    let coordinator = Requester::Coordinator(ComponentName::new("c").unwrap());
    let lower = conf("lower", None, &[("B", Wanted::Stopped)], vec![], &[]);
    let both = conf("both", None, &[], vec![call("A.open")], &[("B", Wanted::Running)]);
    let hold = conf("hold", None, &[], vec![call("A.open")], &[]);
    for safe in [false, true] {
        let mut bench = Bench::new(64);
        let hold = Configuration { safe, ..hold.clone() };
        bench.ok(&[push_by(&lower, coordinator)]);
        bench.ok(&[push_by(&hold, coordinator)]);
        bench.ok(&[push_by(&both, Requester::Operator)]);
        let world = World::new(bench.system.clone(), bench.stack.clone());
        let frames = bench.stack.frames();
        let undo = Request::new(RequestId(1), Ask::UndoOf(lower.id), coordinator);
        let along = super::leave::along(&world, frames, &undo, frames[0].id, (super::LedDown::Whole, false));
        match safe {
            true => assert_eq!(along.unwrap()[..], [frames[2].id]),
            false => assert!(along.unwrap_err().message.contains("`operation_call A.close()` moves")),
        }
        // Where a subsystem is led down by itself, what is about something else as well stays.
        let inside = super::LedDown::Inside(Ident::new("arm").unwrap());
        let stays = super::leave::along(&world, frames, &undo, frames[0].id, (inside, false)).unwrap_err();
        assert!(stays.message.ends_with("it is about `A` as well, which goes on"), "{}", stays.message);
    }
}
