//! The acceptance motion with robots as they may be: nominal, and twenty whose masses, friction and motors are drawn.

use crate::bench::{Bench, Row};
use davit::libraries::youbot::network::Random;
use davit::model::Value;

/// A robot as it may be.
#[derive(Debug, Clone, Copy)]
struct Variant {
    mass: f64,
    friction: f64,
    /// Between a torque and what it does, in s.
    lag: f64,
}

/// What came of it: tracking (mm), hand (N, rms and peak), updates with a joint at its limit, whether it copied all of the time.
#[derive(Debug, Clone, Copy)]
struct Figures {
    error: f64,
    hand: f64,
    peak: f64,
    saturated: usize,
    copied: bool,
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0_u32, 0.0), |(n, sum), v| (n + 1, sum + v * v));
    (sum / f64::from(n.max(1))).sqrt()
}

/// 42 mm to and fro in both directions for 20 s, eight degrees of freedom, encoders that count and speeds that are differences,
/// and the limits of the motors in force.
fn run(variant: Variant) -> Figures {
    let mut bench = Bench::new("youbot_arm");
    bench.all(&["create_core", "create_link", "create_monitors", "connect_all"]);
    bench.set("World", "robot1_mass_scale", variant.mass);
    bench.set("World", "robot1_friction_scale", variant.friction);
    bench.set("World", "robot1_torque_lag", variant.lag);
    bench.set("youbot", "encoders", true);
    bench.set("youbot", "heat_limit", true);
    bench.apply("load_properties");
    bench.set("Operator", "script", "free 0.5; align 4");
    bench.probe();
    bench.all(&["start_driver", "calibrate", "unfold", "start_control", "take_over", "five_DOF"]);
    bench.wait("e_qos_ok", 3.0);
    bench.wait("e_aligned", 6.0);
    bench.all(&["enable_copying", "eight_DOF"]);
    bench.set("Peer", "force_gain", Value::floats(&[0.1; 3]));
    bench.run(1.0);
    bench.set("Operator", "script", "sway 60 0.042 0.042 0 0.15");
    bench.run(1.0);
    let began = bench.now();
    bench.rows();
    bench.run(20.0);
    let rows: Vec<Row> = bench.rows();
    let hand = rows.iter().map(|row| row.hand.norm());
    let told = bench.since(began);
    let stops =
        ["e_misaligned", "e_JNT_SOFT_LIMIT_EXEEDED", "e_torque_sat", "e_overspeed", "e_I2T_EXCEEDED", "e_force_spike"];
    Figures {
        error: rms(rows.iter().filter_map(|row| row.other.map(|other| (row.tool - other).norm()))) * 1e3,
        hand: rms(hand.clone()),
        peak: hand.fold(0.0, f64::max),
        saturated: rows.iter().filter(|row| row.saturated != 0).count(),
        copied: !told.iter().any(|(_, event)| stops.contains(&event.as_str())),
    }
}

/// The table of docs/youbot.md: `cargo test --test youbot -- --nocapture --exact variants::nominal_and_the_worst_of_twenty`.
#[test]
fn nominal_and_the_worst_of_twenty() {
    let mut random = Random::new(2026);
    let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
    let nominal = run(Variant { mass: 1.0, friction: 1.0, lag: 0.0015 });
    println!("nominal: {nominal:.1?}");
    let drawn: Vec<Figures> = (0..20)
        .map(|_| {
            let variant = Variant { mass: between(0.9, 1.1), friction: between(0.7, 1.3), lag: between(0.001, 0.002) };
            let figures = run(variant);
            println!("{variant:.4?}: {figures:.1?}");
            figures
        })
        .collect();
    let worst = |of: fn(&Figures) -> f64| drawn.iter().map(of).fold(0.0, f64::max);
    println!(
        "worst: {:.1} mm, hand {:.1} N rms, {:.1} N peak",
        worst(|f| f.error),
        worst(|f| f.hand),
        worst(|f| f.peak)
    );
    assert!(nominal.error <= 12.0 && nominal.hand <= 8.0 && nominal.copied && nominal.saturated == 0, "{nominal:?}");
    assert!(drawn.iter().all(|f| f.copied && f.saturated == 0), "{drawn:?}");
    assert!(worst(|f| f.error) <= 12.0 && worst(|f| f.hand) <= 8.0, "{drawn:?}");
}
