//! The standard library against its formulas, in simulated time.

use crate::support::*;
use davit::model::*;
use davit::runtime::*;
use std::sync::Mutex;

/// Records what it reads.
struct Recorder {
    u: In<f64>,
}

static RECORDED: Mutex<Vec<(davit::time::Clock, f64)>> = Mutex::new(Vec::new());

impl Component for Recorder {
    fn new(b: &mut Builder<Self>) -> Self {
        Self { u: b.input("u") }
    }

    fn update(&mut self, cx: &mut Context) {
        if let Some(u) = self.u.get() {
            RECORDED.lock().unwrap().push((cx.clock().clone(), u));
        }
    }
}

fn recorded(b: &Bench) -> Vec<f64> {
    let mut all = RECORDED.lock().unwrap();
    let (own, others): (Vec<_>, Vec<_>) = std::mem::take(&mut *all).into_iter().partition(|(c, _)| c.is(&b.clock));
    *all = others;
    own.into_iter().map(|(_, v)| v).collect()
}

fn with_recorder(of: &str) -> Bench {
    let b = bench(Library::new("test").with::<Recorder>("Recorder"));
    b.create("z_recorder", "Recorder", "fast", &[]);
    let _ = of;
    b
}

/// What `out` writes in `n` rounds of 1 ms.
fn record(b: &Bench, components: &[&str], out: &str, n: u32) -> Vec<f64> {
    b.connect(out, "z_recorder.u", Policy::Data);
    b.start(components);
    b.start(&["z_recorder"]);
    b.wait(MS * n - MS / 2);
    recorded(b)
}

fn near(found: &[f64], expected: impl Fn(usize) -> f64) {
    for (i, v) in found.iter().enumerate() {
        let wanted = expected(i);
        assert!((v - wanted).abs() < 1e-9, "at {i}: {v} instead of {wanted}");
    }
}

fn f(v: f64) -> Value {
    Value::Float(v)
}

#[test]
fn sources() {
    let b = with_recorder("standard.Constant");
    b.create("c", "standard.Constant", "fast", &[("value", f(2.5))]);
    let found = record(&b, &["c"], "c.y", 5);
    assert_eq!(found, [2.5; 5]);

    let b = with_recorder("standard.Ramp");
    b.create("r", "standard.Ramp", "fast", &[("offset", f(1.0)), ("slope", f(-3.0))]);
    let found = record(&b, &["r"], "r.y", 200);
    assert_eq!(found.len(), 200);
    near(&found, |i| 1.0 - 3.0 * i as f64 * 1e-3);
    // Started anew it begins anew.
    b.go("r", Wanted::Stopped);
    b.start(&["r"]);
    b.wait(MS);
    assert_eq!(recorded(&b).last(), Some(&1.0));

    let b = with_recorder("standard.Sine");
    let values = [("amplitude", f(2.0)), ("frequency", f(5.0)), ("phase", f(0.3)), ("offset", f(-1.0))];
    b.create("s", "standard.Sine", "fast", &values);
    let found = record(&b, &["s"], "s.y", 500);
    near(&found, |i| -1.0 + 2.0 * (std::f64::consts::TAU * 5.0 * i as f64 * 1e-3 + 0.3).sin());
}

#[test]
fn arithmetic() {
    let b = with_recorder("standard.Gain");
    b.create("g", "standard.Gain", "fast", &[("k", f(-2.0))]);
    b.start(&["g"]);
    b.wait(MS * 3);
    b.write("g.u", 1.5);
    assert_eq!(record(&b, &["g"], "g.y", 3), [-3.0; 3]);

    let b = with_recorder("standard.Sum");
    b.create("s", "standard.Sum", "fast", &[("gains", Value::floats(&[1.0, -1.0, 10.0, 100.0]))]);
    b.write("s.u1", 5.0);
    b.write("s.u2", 2.0);
    b.write("s.u4", 1.0);
    assert_eq!(record(&b, &["s"], "s.y", 2), [103.0; 2]);

    let b = with_recorder("standard.Saturation");
    b.create("r", "standard.Ramp", "fast", &[("offset", f(-2.0)), ("slope", f(1000.0))]);
    b.create("s", "standard.Saturation", "fast", &[]);
    b.connect("r.y", "s.u", Policy::Data);
    assert_eq!(record(&b, &["r", "s"], "s.y", 5), [-1.0, -1.0, 0.0, 1.0, 1.0]);
    // Limits in the wrong order: the lower one wins.
    b.set("s.lower", 3.0);
    b.wait(MS * 2);
    assert_eq!(recorded(&b).last(), Some(&3.0));
}

#[test]
fn nothing_written_gives_nothing() {
    for ty in ["standard.Gain", "standard.Sum", "standard.Saturation"] {
        let b = with_recorder(ty);
        b.create("c", ty, "fast", &[]);
        assert_eq!(record(&b, &["c"], "c.y", 5), [] as [f64; 0], "{ty}");
    }
}

#[test]
fn pid_follows_its_formula() {
    let (kp, ki, kd, tf, h) = (2.0, 30.0, 0.05, 0.004, 1e-3);
    let b = with_recorder("standard.Pid");
    let values = [("kp", f(kp)), ("ki", f(ki)), ("kd", f(kd)), ("tf", f(tf)), ("lower", f(-1.5)), ("upper", f(1.2))];
    b.create("p", "standard.Pid", "fast", &values);
    b.create("m", "standard.Sine", "fast", &[("frequency", f(7.0)), ("amplitude", f(0.4))]);
    b.write("p.setpoint", 0.3);
    b.write("p.feedforward", 0.1);
    b.connect("m.y", "p.measured", Policy::Data);
    let found = record(&b, &["m", "p"], "p.command", 300);
    assert_eq!(found.len(), 300);

    let measured = |i: usize| 0.4 * (std::f64::consts::TAU * 7.0 * i as f64 * h).sin();
    let (mut integral, mut d) = (0.0, 0.0);
    let (mut at_limit, mut inside) = (0, 0);
    for (i, command) in found.iter().enumerate() {
        let error = 0.3 - measured(i);
        if i > 0 {
            d += h / (tf + h) * (-(measured(i) - measured(i - 1)) / h - d);
        }
        let rest = kp * error + kd * d + 0.1;
        let step = ki * error * h;
        let raw: f64 = rest + integral + step;
        integral = match raw {
            raw if raw > 1.2 && step > 0.0 => integral.max(1.2 - rest),
            raw if raw < -1.5 && step < 0.0 => integral.min(-1.5 - rest),
            _ => integral + step,
        };
        let wanted = (rest + integral).clamp(-1.5, 1.2);
        assert!((command - wanted).abs() < 1e-6, "at {i}: {command} instead of {wanted}");
        if (wanted - 1.2).abs() < 1e-9 || (wanted + 1.5).abs() < 1e-9 { at_limit += 1 } else { inside += 1 }
    }
    assert!(at_limit > 10 && inside > 10, "both regimes were met: {at_limit}, {inside}");
}

#[test]
fn pid_does_not_wind_up_and_can_be_reset() {
    let b = with_recorder("standard.Pid");
    b.create("p", "standard.Pid", "fast", &[("kp", f(0.0)), ("ki", f(100.0)), ("lower", f(-1.0)), ("upper", f(1.0))]);
    b.write("p.setpoint", 1.0);
    b.write("p.measured", 0.0);
    let found = record(&b, &["p"], "p.command", 1000);
    assert!(found.iter().all(|c| *c <= 1.0) && found[999] == 1.0);
    // With the error turned round it comes down at once: 0.1 a step from the limit, not after a second of unwinding.
    b.write("p.measured", 2.0);
    b.wait(MS * 2);
    let found = recorded(&b);
    assert!((found[found.len() - 1] - 0.8).abs() < 1e-9, "{found:?}");
    b.does(call("p.reset", vec![f(0.5)]));
    b.write("p.measured", 1.0);
    b.wait(MS * 2);
    assert_eq!(recorded(&b).last(), Some(&0.5));
}

#[test]
fn threshold_has_hysteresis() {
    let b = with_recorder("standard.Threshold");
    let values =
        [("rise", f(1.0)), ("fall", f(0.5)), ("rise_event", Value::str("e_high")), ("fall_event", Value::str("e_low"))];
    b.create("t", "standard.Threshold", "fast", &values);
    b.start(&["t"]);
    for u in [0.0, 0.9, 1.0, 1.1, 0.6, 1.2, 0.5, 0.4, 0.9, 2.0] {
        b.write("t.u", u);
        b.wait(MS);
    }
    let raised: Vec<String> = b.raised().into_iter().map(|(event, _)| event).collect();
    assert_eq!(raised, ["e_high", "e_low", "e_high"]);
    b.set("t.fall_event", "not an event");
    b.wait(MS * 2);
    assert_eq!(b.state_of("t"), Some(RunState::Faulted));
    assert!(b.faults()[0].1.contains("not an event"));
}

#[test]
fn csv_logger_writes_a_line_an_update() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let b = with_recorder("standard.CsvLogger");
    b.create("r", "standard.Ramp", "fast", &[("slope", f(1000.0))]);
    let values = [("path", Value::str(path.to_str().unwrap())), ("every", Value::Int(2))];
    b.create("log", "standard.CsvLogger", "fast", &values);
    b.connect("r.y", "log.u2", Policy::Data);
    b.start(&["r", "log"]);
    b.wait(MS * 5 + MS / 2);
    b.go("log", Wanted::Stopped);
    let text = std::fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    // Its hooks let the ramp begin first: the first update is the one at 1 ms.
    assert_eq!(lines, ["time,u1,u2,u3,u4,u5,u6,u7,u8", "0.002,,2,,,,,,", "0.004,,4,,,,,,"]);
    // A file that cannot be made is a failure, not a fault.
    b.go("log", Wanted::Unconfigured);
    b.set("log.path", folder.path().to_str().unwrap());
    let configure = Step::State { component: name("log"), transition: Transition::Configure };
    assert!(matches!(b.run(&configure), davit::platform::Outcome::NotDone(davit::platform::Cause::Failed(_))));
}

#[test]
fn every_member_is_described() {
    for ty in davit::libraries::standard::library().catalogue().iter() {
        assert!(ty.doc.len() > 20, "{}", ty.name);
        let docs = ty.ports.iter().map(|(n, p)| (n, &p.doc));
        let docs = docs.chain(ty.properties.iter().map(|(n, p)| (n, &p.doc)));
        for (member, doc) in docs.chain(ty.operations.iter().map(|(n, o)| (n, &o.doc))) {
            assert!(doc.len() > 5, "{}.{member}", ty.name);
        }
    }
}
