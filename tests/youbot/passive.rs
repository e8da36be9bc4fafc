//! The two laws of the coupling over delay: which one stays stable, what it costs, and what an observer of both ends sees.

use crate::coupling::{Scenario, Side, at_delay, hear, mm};
use davit::libraries::youbot::hand::{Hand, HandScript};
use davit::libraries::youbot::impedance::CouplingLaw;
use davit::libraries::youbot::network::Quality;
use davit::libraries::youbot::passivity::{CouplingEnd, PassivityObserver};
use davit::libraries::youbot::robot::CONTROL_PERIOD;
use nalgebra::Vector3;

const LAWS: [(CouplingLaw, &str); 2] = [(CouplingLaw::Position, "position"), (CouplingLaw::Tank, "tank")];

/// Two arms without friction and hardly any damping, pushed with 3 N for half a second and let alone. How far their tools are apart at
/// most in the last two of ten seconds (m), whether that is more than between the first and the third, and what was observed.
fn let_alone(law: CouplingLaw, stiffness: f64, quality: Quality) -> (f64, bool, PassivityObserver) {
    let mut pair = [Side::new(quality, 1), Side::new(quality, 2)];
    for side in &mut pair {
        let p = &mut side.robot.impedance.parameters;
        (p.law, p.stiffness, p.ref_max_age) = (law, stiffness, 10.0);
        // What else damps is taken away, and what bounds it.
        (p.damping_rel, p.damping_abs, p.f_max, p.f_rate) = (0.0, 2.0, 1e3, 1e6);
        side.robot.body.arm.friction_scale = 0.0;
        side.robot.dynamics.parameters.friction_comp = 0.0;
    }
    let mut hand = Hand::new("push 0.5 0 3 0; free 60".parse::<HandScript>().unwrap());
    let mut observer = PassivityObserver::default();
    let (mut early, mut late) = (0.0_f64, 0.0_f64);
    for tick in 0..10_000_u32 {
        let now = f64::from(tick) * CONTROL_PERIOD;
        hear(&mut pair, now);
        let push = hand.update(&Vector3::zeros(), &Vector3::zeros(), None, CONTROL_PERIOD);
        for (side, push) in pair.iter_mut().zip([push, Vector3::zeros()]) {
            side.step(now, &push);
            if tick % 4 == 0 {
                side.send(now);
            }
        }
        let end = |side: &Side| CouplingEnd { force: side.robot.force, position: side.robot.tool.position };
        observer.update([end(&pair[0]), end(&pair[1])]);
        let apart = (pair[0].robot.tool.position - pair[1].robot.tool.position).norm();
        if now > 8.0 {
            late = late.max(apart);
        } else if (1.0..3.0).contains(&now) {
            early = early.max(apart);
        }
    }
    (late, late > early, observer)
}

/// The table of docs/youbot.md: `cargo test --test youbot -- --nocapture --exact passive::table`.
#[test]
fn table() {
    println!(
        "| K, N/m | law | one way, ms | let alone | given out, J | swayed: RMS, mm | hand, N rms | largest force, N |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    let mut unstable = 0;
    for stiffness in [150.0, 300.0, 600.0] {
        for (law, name) in LAWS {
            for delay in [0.0, 0.005, 0.02, 0.05] {
                let (late, grows, observer) = let_alone(law, stiffness, at_delay(delay));
                let stable = late < 0.002;
                let swayed = Scenario { law, stiffness, quality: at_delay(delay), ..Scenario::default() }.run();
                println!(
                    "| {stiffness} | {name} | {} | {} | {:.3} | {:.1} | {:.1} | {:.1} |",
                    delay * 1e3,
                    match () {
                        () if stable => "dies out".to_owned(),
                        () if grows => format!("grows: {:.0} mm", mm(late)),
                        () => format!("rings: {:.0} mm", mm(late)),
                    },
                    0.0 - observer.minimum,
                    mm(swayed.rms),
                    swayed.hand_rms,
                    swayed.raw_max,
                );
                match law {
                    CouplingLaw::Tank => {
                        assert!(stable && !observer.violated, "{stiffness} N/m, {delay} s: {late} m, {observer:?}");
                        let plain = Scenario { stiffness, quality: at_delay(delay), ..Scenario::default() }.run();
                        assert!(swayed.rms < 1.1 * plain.rms && swayed.hand_rms < 1.1 * plain.hand_rms, "{swayed:?}");
                    }
                    CouplingLaw::Position => unstable += usize::from(grows && observer.violated),
                }
            }
        }
    }
    assert!(unstable >= 4, "the observer saw the position law violated {unstable} times");
}

/// Not only delayed: reordered, lost in bursts, twice, and cut for a while.
#[test]
fn the_tank_is_passive_over_a_bad_network() {
    let bad = Quality {
        delay: 0.03,
        jitter: 0.05,
        reorder: 0.2,
        duplicate: 0.2,
        burst_begin: 0.02,
        burst_end: 0.1,
        ..Quality::default()
    };
    let (late, _, observer) = let_alone(CouplingLaw::Tank, 600.0, bad);
    assert!(late < 0.002 && !observer.violated, "{late} m {observer:?}");
    let (late, _, observer) = let_alone(CouplingLaw::Position, 600.0, bad);
    assert!(late > 0.02 && observer.violated, "{late} m {observer:?}");
}
