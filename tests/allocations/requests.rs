//! What a request for a prepared switch allocates on its whole way: queue, configurator, embedded platform, progress,
//! answer. Counted in the threads that have to do with it.

use crate::counting::Together;
use davit::configurator::{Answer, Batch, Configurator, ConfiguratorSetup, Request, Requester};
use davit::model::*;
use davit::platform::embedded::EmbeddedPlatform;
use davit::runtime::{Builder, Component, In, Libraries, Library, Prop};
use davit::time::Clock;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Who asks, and who answers and tells: the configurator.
static COUNT: Together = Together::new();

/// A controller with a gain of three and a reference.
#[allow(dead_code)]
struct Node {
    gain: Prop<[f64; 3]>,
    mode: In<bool>,
}

impl Component for Node {
    fn new(b: &mut Builder<Self>) -> Self {
        let gain = b.range(0.0..=10.0).tunable(Tunable::Stopped).property("gain", [0.0; 3]);
        Self { gain, mode: b.input("mode") }
    }
}

fn configurations() -> Vec<Configuration> {
    let change = |kind| Change { kind, origin: Origin::NONE };
    let component = ComponentName::new("node").unwrap();
    let entry = |target, state| StateEntry { target, state, origin: Origin::NONE };
    let mut make = Configuration::new(ConfigId::new("make").unwrap());
    make.changes.push(change(ChangeKind::Create {
        component,
        ty: TypeName::new("test.Node").unwrap(),
        activity: Some(Ident::new("loop").unwrap()),
        properties: BTreeMap::new(),
    }));
    make.post.push(entry(Target::Default, Wanted::Running)).unwrap();
    let mut switch = Configuration::new(ConfigId::new("switch").unwrap());
    switch.pre.push(entry(Target::Component(component), Wanted::Stopped)).unwrap();
    let gain = MemberRef::new("node.gain").unwrap();
    switch.changes.push(change(ChangeKind::PropertySet { property: gain, value: Value::floats(&[0.1, 0.2, 0.3]) }));
    let mode = MemberRef::new("node.mode").unwrap();
    switch.changes.push(change(ChangeKind::PortWrite { port: mode, value: Value::Bool(true) }));
    switch.post.push(entry(Target::Component(component), Wanted::Running)).unwrap();
    vec![make, switch]
}

#[test]
fn a_request_for_a_prepared_switch_allocates_nothing() {
    let clock = Clock::real();
    let libraries = Libraries::new().with(Library::new("test").with::<Node>("test.Node"));
    let name = Ident::new("loop").unwrap();
    let activity = Activity { period: Some(Duration::from_secs(1000)), priority: 0, cpu: None, origin: Origin::NONE };
    let platform = Arc::new(EmbeddedPlatform::new(&clock, &libraries, &BTreeMap::from([(name, activity)])));
    let (sink, answers) = clock.channel::<Answer>(16);
    let steps = Arc::new(AtomicU64::new(0));
    let told = steps.clone();
    let handle = Configurator::start(ConfiguratorSetup {
        configurations: configurations(),
        rest: Vec::new(),
        operator: Vec::new(),
        catalogue: libraries.catalogue(),
        activities: BTreeSet::from([name]),
        coordinators: BTreeSet::new(),
        subsystems: Vec::new(),
        platform,
        clock: clock.clone(),
        limits: DeploymentLimits::default(),
        workers: 2,
        answers: Arc::new(move |answer| {
            COUNT.add_thread();
            drop(sink.try_send(answer));
        }),
        progress: Some(Arc::new(move |_| _ = told.fetch_add(1, Ordering::Relaxed))),
        conditions: None,
    });
    COUNT.add_thread();
    let mut next = 0;
    let mut ask = |ask: Ask| {
        next += 1;
        let request = Request { force: true, ..Request::new(RequestId(next), ask, Requester::Operator) };
        handle.submit(Batch::one(request)).expect("room");
        let answer = answers.recv_deadline(clock.now() + Duration::from_secs(60)).expect("an answer");
        assert!(answer.verdict.is_success(), "{answer:?}");
    };
    let switch = ConfigId::new("switch").unwrap();
    ask(Ask::Apply(ConfigId::new("make").unwrap()));
    // The first rounds prepare the switch and make what is used again afterwards.
    for _ in 0..20 {
        ask(Ask::Apply(switch));
        ask(Ask::UndoOf(switch));
    }
    // A channel makes its list of sleepers when a thread first sleeps in it, which on a busy machine may be late. What
    // is made once ends; what a request makes shows in every round, and what grows by doubling in five of the twenty.
    let told = steps.load(Ordering::Relaxed);
    let rounds: Vec<u64> = std::iter::repeat_with(|| {
        let before = COUNT.touched();
        for _ in 0..1_000 {
            ask(Ask::Apply(switch));
            ask(Ask::UndoOf(switch));
        }
        COUNT.touched() - before
    })
    .take(20)
    .collect();
    assert!(steps.load(Ordering::Relaxed) - told >= 4_000, "its steps are told on the way");
    let clean = rounds.iter().filter(|allocations| **allocations == 0).count();
    assert!(clean >= 17, "allocations in each round of 2,000 requests: {rounds:?}");
    handle.stop(clock.now() + Duration::from_secs(10));
}
