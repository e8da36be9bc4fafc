//! The embedded runtime in figures: what a write and a read of a connected port cost, what a component costs to bring up,
//! to switch and to update, and how much memory it takes.
//!
//! `cargo bench --bench ports`. Every figure is the median of several runs; the slope is fitted through the origin and a
//! constant by least squares over N = 10 to 10,000. Nothing is asserted: machines differ.

// What is measured here is real time.
#![allow(clippy::disallowed_methods)]

#[path = "../tests/support/in_use.rs"]
mod in_use;
#[path = "../tests/support/names.rs"]
mod names;

use davit::libraries::standard;
use davit::model::*;
use davit::platform::embedded::EmbeddedPlatform;
use davit::platform::{Outcome, Platform, Prepared};
use davit::runtime::*;
use davit::time::{Clock, Time};
use in_use::InUse;
use names::ident;
use std::alloc::System;
use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::{Duration, Instant};

#[global_allocator]
static ALLOCATOR: InUse<System> = InUse(System);

/// Connected to itself: an operation writes and reads many times and answers the nanoseconds of one write and one read.
struct Mirror {
    y: Out<f64>,
    u: In<f64>,
    wide_y: Out<[f64; 32]>,
    wide_u: In<[f64; 32]>,
    queue: In<f64>,
}

const ROUNDS: u32 = 1_000_000;

impl Mirror {
    fn time(mut f: impl FnMut(u32)) -> OperationAnswer<f64> {
        let start = Instant::now();
        for i in 0..ROUNDS {
            f(i);
        }
        OperationAnswer::Done(start.elapsed().as_nanos() as f64 / f64::from(ROUNDS))
    }
}

impl Component for Mirror {
    fn new(b: &mut Builder<Self>) -> Self {
        b.operation("float", |this: &mut Self, _, (): ()| {
            Self::time(|i| {
                this.y.write(f64::from(i));
                black_box(this.u.get());
            })
        });
        b.operation("wide", |this: &mut Self, _, (): ()| {
            Self::time(|i| {
                this.wide_y.write([f64::from(i); 32]);
                black_box(this.wide_u.get());
            })
        });
        b.operation("queue", |this: &mut Self, _, (): ()| {
            Self::time(|i| {
                this.y.write(f64::from(i));
                black_box(this.queue.take());
            })
        });
        Self {
            y: b.output("y"),
            u: b.input("u"),
            wide_y: b.output("wide_y"),
            wide_u: b.input("wide_u"),
            queue: b.input("queue"),
        }
    }
}

/// The target of the prepared switch.
#[allow(dead_code)]
struct Controlled {
    mode: In<bool>,
    force_gain: Prop<[f64; 3]>,
}

impl Component for Controlled {
    fn new(b: &mut Builder<Self>) -> Self {
        Self { mode: b.input("mode"), force_gain: b.property("force_gain", [0.0; 3]) }
    }
}

fn platform(clock: &Clock, period: Duration) -> EmbeddedPlatform {
    let libraries = Libraries::new()
        .with(standard::library())
        .with(Library::new("bench").with::<Mirror>("Mirror").with::<Controlled>("Controlled"));
    let activity = Activity { period: Some(period), priority: 0, cpu: None, origin: Origin::NONE };
    EmbeddedPlatform::new(clock, &libraries, &BTreeMap::from([(ident("bench"), activity)]))
}

fn done(platform: &EmbeddedPlatform, step: &Step) -> Option<Value> {
    match platform.execute(step, Time::NEVER) {
        Outcome::Done(value) => value,
        other => panic!("{step}: {other:?}"),
    }
}

fn create(name: ComponentName, ty: &str, properties: Vec<Value>) -> Step {
    Step::Create { component: name, ty: TypeName::new(ty).unwrap(), activity: Some(ident("bench")), properties }
}

fn median(mut f: impl FnMut() -> f64, runs: usize) -> f64 {
    let mut all: Vec<f64> = (0..runs).map(|_| f()).collect();
    all.sort_by(f64::total_cmp);
    all[runs / 2]
}

fn ports() {
    let clock = Clock::real();
    let platform = platform(&clock, Duration::from_secs(1000));
    let m = ComponentName::new("m").unwrap();
    done(&platform, &create(m, "Mirror", vec![]));
    let member = |name: &str| m.member(ident(name));
    for (from, to, policy) in
        [("y", "u", Policy::Data), ("wide_y", "wide_u", Policy::Data), ("y", "queue", Policy::Buffer(16))]
    {
        if to == "queue" {
            done(&platform, &Step::Disconnect { from: member("y"), to: member("u") });
        }
        done(&platform, &Step::Connect { from: member(from), to: member(to), policy });
        let operation = match to {
            "u" => "float",
            "queue" => "queue",
            _ => "wide",
        };
        let call = Step::Operation(Call { operation: member(operation), args: vec![] });
        let ns = median(|| done(&platform, &call).and_then(|v| v.as_f64()).unwrap(), 7);
        println!("one write + one read, {operation:<6} {ns:8.1} ns");
    }
}

/// Steps that bring up a chain of `n` gains, and those that take it down; components of one activity.
fn chain(n: usize) -> (Vec<Step>, Vec<Step>) {
    let names: Vec<ComponentName> = (0..n).map(|i| ComponentName::new(&format!("gain_{i}")).unwrap()).collect();
    let (u, y) = (ident("u"), ident("y"));
    let (mut up, mut down) = (Vec::new(), Vec::new());
    up.extend(names.iter().map(|name| create(*name, "standard.Gain", vec![Value::Float(1.0)])));
    for pair in names.windows(2) {
        let (from, to) = (pair[0].member(y), pair[1].member(u));
        up.push(Step::Connect { from, to, policy: Policy::Data });
        down.push(Step::Disconnect { from, to });
    }
    for transition in [Transition::Configure, Transition::Start] {
        up.extend(names.iter().map(|name| Step::State { component: *name, transition }));
    }
    let states = [Transition::Stop, Transition::Cleanup];
    let mut first: Vec<Step> = states
        .into_iter()
        .flat_map(|transition| names.iter().map(move |name| Step::State { component: *name, transition }))
        .collect();
    first.append(&mut down);
    first.extend(names.iter().map(|name| Step::Destroy { component: *name }));
    (up, first)
}

fn bring_up() {
    println!("\ncreate + connect + configure + start of a chain of Gain in one activity; and all of it taken down");
    println!("{:>8} {:>14} {:>14} {:>16}", "N", "up us/comp.", "down us/comp.", "bytes/component");
    let mut points = Vec::new();
    for n in [10, 30, 100, 300, 1_000, 3_000, 10_000] {
        let (up, down) = chain(n);
        let mut bytes = 0;
        let mut downs = Vec::new();
        let total = median(
            || {
                let clock = Clock::real();
                let platform = platform(&clock, Duration::from_secs(1000));
                let before = in_use::now();
                let start = Instant::now();
                for step in &up {
                    done(&platform, step);
                }
                let took = start.elapsed().as_nanos() as f64;
                bytes = (in_use::now() - before) / n;
                let start = Instant::now();
                for step in &down {
                    done(&platform, step);
                }
                downs.push(start.elapsed().as_nanos() as f64);
                took
            },
            9,
        );
        downs.sort_by(f64::total_cmp);
        let down = downs[downs.len() / 2];
        points.push((n as f64, total));
        println!("{n:>8} {:>14.3} {:>14.3} {bytes:>16}", total / n as f64 / 1e3, down / n as f64 / 1e3);
    }
    let count = points.len() as f64;
    let (sx, sy) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0, y + p.1));
    let (sxx, sxy) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 * p.0, y + p.0 * p.1));
    let slope = (count * sxy - sx * sy) / (count * sxx - sx * sx);
    let (small, large) = (points[2], points[points.len() - 1]);
    let exponent = (large.1 / small.1).ln() / (large.0 / small.0).ln();
    println!(
        "slope {:.3} us per component, intercept {:.1} us, exponent {exponent:.2} from N = 100 to 10,000",
        slope / 1e3,
        (sy - slope * sx) / count / 1e3
    );
}

fn switch() {
    let clock = Clock::real();
    let platform = platform(&clock, Duration::from_secs(1000));
    let [c, other] = ["controlled", "other"].map(|name| ComponentName::new(name).unwrap());
    for name in [c, other] {
        done(&platform, &create(name, "Controlled", vec![Value::floats(&[0.0; 3])]));
        done(&platform, &Step::State { component: name, transition: Transition::Configure });
        done(&platform, &Step::State { component: name, transition: Transition::Start });
    }
    let steps = [
        Step::State { component: c, transition: Transition::Stop },
        Step::PropertySet { property: c.member(ident("force_gain")), value: Value::floats(&[0.1; 3]) },
        Step::PortWrite { port: c.member(ident("mode")), value: Some(Value::Bool(true)) },
        Step::State { component: c, transition: Transition::Start },
    ];
    let mut prepared = platform.prepare(&steps).expect("all immediate");
    let time = |indices: &[usize], prepared: &mut dyn Prepared| {
        let rounds = 200_000;
        let began = clock.now();
        let deadline = began + Duration::from_secs(100);
        let start = Instant::now();
        for _ in 0..rounds {
            for index in indices {
                assert!(matches!(prepared.execute(*index, None, began, deadline), Outcome::Done(None)));
            }
        }
        start.elapsed().as_nanos() as f64 / f64::from(rounds)
    };
    println!("\nprepared, activity idle");
    for (what, indices) in
        [("stop + start", &[0, 3][..]), ("property, 3-vector", &[1]), ("port write", &[2]), ("all four", &[0, 1, 2, 3])]
    {
        println!("{what:<20} {:8.1} ns", median(|| time(indices, &mut *prepared), 7));
    }
}

fn round() {
    let clock = Clock::simulated();
    let _guard = clock.enter();
    let platform = platform(&clock, Duration::from_millis(1));
    let n = 10_000;
    for step in &chain(n).0 {
        done(&platform, step);
    }
    let feed = ComponentName::new("gain_0").unwrap().member(ident("u"));
    done(&platform, &Step::PortWrite { port: feed, value: Some(Value::Float(1.0)) });
    let ns = median(
        || {
            let start = Instant::now();
            clock.sleep(Duration::from_millis(20));
            start.elapsed().as_nanos() as f64 / 20.0 / n as f64
        },
        7,
    );
    println!("\none update (read, multiply, write) in a round of 10,000 components {ns:8.1} ns");
}

fn main() {
    in_use::count(true);
    ports();
    bring_up();
    switch();
    round();
}
