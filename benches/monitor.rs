//! What a sample costs a monitor, for windows of ten to a million samples: one table, and the ratio of the longest window
//! to the shortest.

#![allow(missing_docs, clippy::disallowed_methods)]

use davit::model::monitor::{Comparison, Condition, ConditionKind, Interval, Monitor, MonitoredSignal, SignalKind};
use davit::model::{EventName, Ident};
use davit::monitor::{Bank, InputSample};
use davit::time::Time;
use std::hint::black_box;
use std::time::{Duration, Instant};

/// Time between two samples.
const STEP: u64 = 1_000_000;

/// Samples measured, after as many as fill the window.
const MEASURED: u64 = 1_000_000;

fn monitor(kind: ConditionKind) -> Monitor {
    Monitor {
        raise: Some(EventName::new("e").expect("a name")),
        ..Monitor::new(Ident::new("m").expect("a name"), Condition::new(kind))
    }
}

fn above(bound: f64) -> Box<Condition> {
    let port = MonitoredSignal::new(SignalKind::Port("A.x".parse().expect("a port")));
    let right = MonitoredSignal::new(SignalKind::Constant(bound));
    let kind = ConditionKind::Compare { left: port, op: Comparison::Above, right, hysteresis: None };
    Box::new(Condition::new(kind))
}

/// A kind of signal: its value at a sample, and some noise.
type Shape = (&'static str, fn(u64, f64) -> f64);

const SHAPES: [Shape; 3] = [
    ("noise", |_, noise| noise),
    ("slow wave", |i, noise| (i as f64 * 1e-4).sin() + 0.01 * noise),
    ("falling", |i, _| -(i as f64)),
];

/// Nanoseconds a sample.
fn measure(kind: ConditionKind, window: u64, shape: fn(u64, f64) -> f64) -> f64 {
    let mut bank = Bank::new(&[monitor(kind)]);
    let mut seed = 1_u64;
    let mut raised = 0_u64;
    let mut started = Instant::now();
    for i in 0..window + MEASURED {
        if i == window {
            started = Instant::now();
        }
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let noise = (seed >> 33) as f64 / (1_u64 << 31) as f64;
        let at = Time(i * STEP);
        let sample = InputSample { value: shape(i, noise), at, writes: i + 1, present: true };
        bank.step(at, &mut |_| sample, &mut |_, _| raised += 1);
    }
    let took = started.elapsed();
    black_box(raised);
    took.as_secs_f64() * 1e9 / MEASURED as f64
}

fn main() {
    let windows = [10_u64, 1_000, 100_000, 1_000_000];
    println!("{:<14}{:<12}{}   longest/shortest", "", "", windows.map(|w| format!("{w:>12}")).concat());
    for name in ["once", "historically", "since", "delayed since", "for_at_least"] {
        for (shape_name, shape) in SHAPES {
            let costs = windows.map(|window| {
                let time = Duration::from_nanos(window * STEP);
                let interval = Interval { from: Duration::ZERO, to: Some(time) };
                let kind = match name {
                    "once" => ConditionKind::Once { condition: above(0.9), interval },
                    "historically" => ConditionKind::Historically { condition: above(0.1), interval },
                    "since" => ConditionKind::Since { hold: above(0.1), from: above(0.9), interval },
                    "delayed since" => ConditionKind::Since {
                        hold: above(0.1),
                        from: above(0.9),
                        interval: Interval { from: time / 2, to: Some(time) },
                    },
                    _ => ConditionKind::ForAtLeast { condition: above(0.1), time },
                };
                measure(kind, window, shape)
            });
            let table = costs.map(|cost| format!("{cost:>9.1} ns")).concat();
            println!("{name:<14}{shape_name:<12}{table}   {:.2}", costs[3] / costs[0]);
        }
    }
}
