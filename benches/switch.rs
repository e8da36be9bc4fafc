//! Request to status of a switch, beside a bare ping-pong of two threads over the same kind of channel in the same run;
//! and the configurator's own time for it.
//!
//! `cargo bench --bench switch`

use davit::configurator::{Answer, Batch, Configurator, Request, Requester, Setup};
use davit::model::*;
use davit::platform::Platform;
use davit::platform::embedded::EmbeddedPlatform;
use davit::runtime::{Builder, Component, In, Libraries, Library, Prop};
use davit::time::{Clock, Time};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

const ROUNDS: usize = 20_000;

fn member(text: &str) -> MemberRef {
    MemberRef::new(text).expect("a member")
}

fn change(kind: ChangeKind) -> Change {
    Change { kind, origin: Origin::NONE }
}

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

fn libraries() -> Libraries {
    Libraries::new().with(Library::new("bench").with::<Node>("bench.Node"))
}

/// The switch: stop, a 3-vector, a port, start; and `others` components that have nothing to do with it.
fn configurations(others: usize) -> Vec<Configuration> {
    let entry = |name: &str, state| StateEntry {
        target: Target::Component(ComponentName::new(name).expect("a name")),
        state,
        origin: Origin::NONE,
    };
    let mut make = Configuration::new(ConfigId::new("make").expect("a name"));
    for n in 0..=others {
        make.changes.push(change(ChangeKind::Create {
            component: ComponentName::new(&format!("N{n}")).expect("a name"),
            ty: TypeName::new("bench.Node").expect("a type"),
            activity: Some(Ident::new("loop").expect("a name")),
            properties: BTreeMap::new(),
        }));
    }
    make.post.push(StateEntry { target: Target::Default, state: RunState::Running, origin: Origin::NONE });
    let mut switch = Configuration::new(ConfigId::new("switch").expect("a name"));
    switch.pre.push(entry("N0", RunState::Stopped));
    switch
        .changes
        .push(change(ChangeKind::PropertySet { property: member("N0.gain"), value: Value::floats(&[0.1, 0.2, 0.3]) }));
    switch.changes.push(change(ChangeKind::PortWrite { port: member("N0.mode"), value: Value::Bool(true) }));
    switch.post.push(entry("N0", RunState::Running));
    vec![make, switch]
}

fn median(mut times: Vec<u64>) -> u64 {
    times.sort_unstable();
    times[times.len() / 2]
}

/// Nanoseconds of a round trip between two threads over two channels.
fn ping_pong(clock: &Clock) -> u64 {
    let (to, from_main) = clock.channel::<u64>(16);
    let (back, answer) = clock.channel::<u64>(16);
    let echo = clock.spawn("echo", move || {
        while let Ok(n) = from_main.recv() {
            if back.try_send(n).is_err() {
                return;
            }
        }
    });
    let mut times = Vec::with_capacity(ROUNDS);
    for n in 0..ROUNDS as u64 {
        let begun = clock.now();
        to.try_send(n).expect("room");
        answer.recv().expect("an echo");
        times.push(clock.now().since(begun).as_nanos() as u64);
    }
    drop(to);
    let _ = echo.join(Time::NEVER);
    median(times)
}

/// Nanoseconds from request to answer, and of the configurator's own time, for the switch and its undo in turn.
fn switch(clock: &Clock, others: usize) -> (u64, u64) {
    let loop_ = Ident::new("loop").expect("a name");
    // Idle: the time until a running activity has really stopped is another matter.
    let activity = Activity { period: Some(Duration::from_secs(1000)), priority: 0, cpu: None, origin: Origin::NONE };
    let activities = BTreeMap::from([(loop_, activity)]);
    let platform: Arc<dyn Platform> = Arc::new(EmbeddedPlatform::new(clock, &libraries(), &activities));
    let (sink, answers) = clock.channel::<Answer>(16);
    let handle = Configurator::start(Setup {
        configurations: configurations(others),
        catalogue: libraries().catalogue(),
        activities: BTreeSet::from([loop_]),
        platform,
        clock: clock.clone(),
        limits: DeploymentLimits::default(),
        workers: 2,
        answers: Arc::new(move |answer| drop(sink.try_send(answer))),
        // As a session has it: every step is told.
        progress: Some(Arc::new(|progress| _ = std::hint::black_box(progress))),
    });
    let mut next = 0;
    let mut ask = |ask: Ask| {
        next += 1;
        let request = Request { id: RequestId(next), ask, requester: Requester::Operator, scoped: false, tag: (0, 0) };
        let begun = clock.now();
        handle.submit(Batch::one(request)).expect("room");
        let answer = answers.recv().expect("an answer");
        assert!(answer.verdict.is_success(), "{answer:?}");
        (clock.now().since(begun).as_nanos() as u64, answer.took.as_nanos() as u64)
    };
    let id = ConfigId::new("switch").expect("a name");
    ask(Ask::Apply(ConfigId::new("make").expect("a name")));
    let (mut trips, mut own) = (Vec::with_capacity(ROUNDS), Vec::with_capacity(ROUNDS));
    for round in 0..ROUNDS {
        let (trip, took) = ask(if round % 2 == 0 { Ask::Apply(id) } else { Ask::UndoOf(id) });
        trips.push(trip);
        own.push(took);
    }
    handle.stop(clock.now() + Duration::from_secs(10));
    (median(trips), median(own))
}

fn main() {
    let clock = Clock::real();
    let bare = ping_pong(&clock);
    println!("ping-pong of two threads        {bare:>8} ns (median of {ROUNDS})");
    for others in [10, 1_000, 10_000] {
        let (trip, own) = switch(&clock, others);
        #[allow(clippy::cast_precision_loss)]
        let ratio = trip as f64 / bare as f64;
        println!(
            "switch among {others:>6} components: own time {own:>8} ns, request to status {trip:>8} ns = {ratio:.2} ping-pongs"
        );
    }
}
