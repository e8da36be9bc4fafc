//! Request to status of a switch, beside a bare ping-pong of two threads over the same kind of channel in the same run;
//! and the configurator's own time for it. Both in turns, so that they meet the same machine: back to back, when all
//! threads are awake and look for the next message themselves, and at rest, when both have gone to sleep meanwhile, as
//! they have between the requests of a coordinator.
//!
//! `cargo bench --bench switch`

use davit::configurator::{Answer, Batch, Configurator, ConfiguratorHandle, ConfiguratorSetup, Request, Requester};
use davit::model::*;
use davit::platform::Platform;
use davit::platform::embedded::EmbeddedPlatform;
use davit::runtime::{Builder, Component, In, Libraries, Library, Prop};
use davit::time::{Clock, Receiver, Sender};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

/// How often each thing is measured, in turns of so many.
const TURNS: usize = 40;
const TURN: usize = 200;

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
    make.post.push(StateEntry { target: Target::Default, state: Wanted::Running, origin: Origin::NONE }).unwrap();
    let mut switch = Configuration::new(ConfigId::new("switch").expect("a name"));
    switch.pre.push(entry("N0", Wanted::Stopped)).unwrap();
    switch
        .changes
        .push(change(ChangeKind::PropertySet { property: member("N0.gain"), value: Value::floats(&[0.1, 0.2, 0.3]) }));
    switch.changes.push(change(ChangeKind::PortWrite { port: member("N0.mode"), value: Value::Bool(true) }));
    switch.post.push(entry("N0", Wanted::Running)).unwrap();
    vec![make, switch]
}

fn median(mut times: Vec<u64>) -> u64 {
    times.sort_unstable();
    times[times.len() / 2]
}

/// Two threads and two channels.
struct PingPong {
    to: Sender<u64>,
    answer: Receiver<u64>,
}

impl PingPong {
    fn start(clock: &Clock) -> Self {
        let (to, from_main) = clock.channel::<u64>(16);
        let (back, answer) = clock.channel::<u64>(16);
        clock.spawn("echo", move || {
            while let Ok(n) = from_main.recv() {
                if back.try_send(n).is_err() {
                    return;
                }
            }
        });
        Self { to, answer }
    }

    /// Nanoseconds of a round trip.
    fn trip(&self, clock: &Clock) -> u64 {
        let begun = clock.now();
        self.to.try_send(0).expect("room");
        self.answer.recv().expect("an echo");
        clock.now().since(begun).as_nanos() as u64
    }
}

/// A configurator with the switch applied once, and `others` components that have nothing to do with it.
struct Switched {
    handle: ConfiguratorHandle,
    answers: Receiver<Answer>,
    asked: u64,
}

impl Switched {
    fn start(clock: &Clock, others: usize) -> Self {
        let loop_ = Ident::new("loop").expect("a name");
        // Idle: the time until a running activity has really stopped is another matter.
        let activity =
            Activity { period: Some(Duration::from_secs(1000)), priority: 0, cpu: None, origin: Origin::NONE };
        let activities = BTreeMap::from([(loop_, activity)]);
        let platform: Arc<dyn Platform> = Arc::new(EmbeddedPlatform::new(clock, &libraries(), &activities));
        let (sink, answers) = clock.channel::<Answer>(16);
        let handle = Configurator::start(ConfiguratorSetup {
            configurations: configurations(others),
            rest: Vec::new(),
            operator: vec![ConfigId::new("make").expect("a name"), ConfigId::new("switch").expect("a name")],
            catalogue: libraries().catalogue(),
            activities: BTreeSet::from([loop_]),
            coordinators: BTreeSet::new(),
            subsystems: Vec::new(),
            platform,
            clock: clock.clone(),
            limits: DeploymentLimits::default(),
            workers: 2,
            answers: Arc::new(move |answer| drop(sink.try_send(answer))),
            // As a session has it: every step is told.
            progress: Some(Arc::new(|progress| _ = std::hint::black_box(progress))),
            conditions: None,
        });
        let mut switched = Self { handle, answers, asked: 0 };
        switched.ask(clock, Ask::Apply(ConfigId::new("make").expect("a name")));
        switched
    }

    /// Nanoseconds from request to answer, and of the configurator's own time.
    fn ask(&mut self, clock: &Clock, ask: Ask) -> (u64, u64) {
        self.asked += 1;
        let id = RequestId(self.asked);
        let request = Request { force: true, ..Request::new(id, ask, Requester::Operator) };
        let begun = clock.now();
        self.handle.submit(Batch::one(request)).expect("room");
        let answer = self.answers.recv().expect("an answer");
        assert!(answer.verdict.is_success(), "{answer:?}");
        (clock.now().since(begun).as_nanos() as u64, answer.took.as_nanos() as u64)
    }

    /// The switch and its undo in turn.
    fn trip(&mut self, clock: &Clock) -> (u64, u64) {
        let id = ConfigId::new("switch").expect("a name");
        self.ask(clock, if self.asked % 2 == 1 { Ask::Apply(id) } else { Ask::UndoOf(id) })
    }
}

/// Medians of ping-pong, request to status and own time; before each trip everybody rests for so long.
fn measure(clock: &Clock, others: usize, rest: Duration) -> (u64, u64, u64) {
    let ping_pong = PingPong::start(clock);
    let mut switched = Switched::start(clock, others);
    let (mut bare, mut trips, mut own) = (Vec::new(), Vec::new(), Vec::new());
    let pause = || {
        if !rest.is_zero() {
            clock.sleep(rest);
        }
    };
    for _ in 0..TURNS {
        // The first ones of a turn find threads that the turn before has let fall asleep.
        for warm in 0..TURN + 20 {
            pause();
            let trip = ping_pong.trip(clock);
            if warm >= 20 {
                bare.push(trip);
            }
        }
        for warm in 0..TURN + 20 {
            pause();
            let (trip, took) = switched.trip(clock);
            if warm >= 20 {
                trips.push(trip);
                own.push(took);
            }
        }
    }
    switched.handle.stop(clock.now() + Duration::from_secs(10));
    (median(bare), median(trips), median(own))
}

fn main() {
    let clock = Clock::real();
    for (how, rest) in [("back to back", Duration::ZERO), ("at rest", Duration::from_micros(100))] {
        println!("{how} (medians of {})", TURNS * TURN);
        for others in [10, 1_000, 10_000] {
            let (bare, trip, own) = measure(&clock, others, rest);
            #[allow(clippy::cast_precision_loss)]
            let ratio = trip as f64 / bare as f64;
            println!(
                "  among {others:>6} components: own time {own:>6} ns; request to status {trip:>6} ns, ping-pong {bare:>6} ns: \
                 ratio {ratio:.2}"
            );
        }
    }
}
